"""Decisions in a periodic world: each robot among the images of the others and of obstacles that it can meet."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from slalom.decision.grown_bodies import moved_bodies
from slalom.decision.robot_tables import copy_robot, reaches, some_robots
from slalom.forecast import Forecast
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import GrownBodies, RobotTable
from slalom.obstacle import Obstacle
from slalom.obstacle.periodic import Period, checked_period, displaced, images_about, images_met, to_nearest
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import Obstacles, ObstacleWindow, each_of, in_world, listed

if TYPE_CHECKING:
    from slalom.fleet.committed import CommittedFleet


class Images:
    """The images of robots and obstacles in a world with a `period` (d,) [m].

    Attributes:
        robot_of: the robot in each row of the table of the fleet; between decisions the rows are the robots.
    """

    def __init__(self, fleet: "CommittedFleet", period: Period) -> None:
        table = fleet.table
        wide = 2.0 * float(table.each["radius"].max()) + float(fleet.members.margins.max())
        self.period = checked_period(period, fleet.dimension, wide, "world_period")
        self.horizon = fleet.horizon
        self.robot_of = np.arange(len(table.each))

    def about(
        self, fleet: "CommittedFleet", some: Indices, bodies: list[GrownBodies]
    ) -> Iterator[tuple[Indices, list[GrownBodies]]]:
        """Each of the robots `some` alone, with all images of the others that it can meet in the table of the fleet.

        Also all `bodies` grown by each kind of skeleton, from `window`. Images of a robot move as it does and need not
        be avoided by it.
        """
        whole, d = fleet.table, fleet.dimension
        each = whole.each
        reach = reaches(each, self.horizon)
        for k in some:
            within = reach + reach[k] + each["margin"][k]
            self.robot_of, by = images_about(k, each["position"], within, self.period)
            # Passive obstacles are those of the cell about the origin, into which `home` brings the robot.
            home = to_nearest(each["position"][k], self.period)[:d]
            fleet.table = own = some_robots(whole, self.robot_of)
            own.each["position"] += by
            own.observed.points[:] += by[:, None, None]
            yield np.array([k]), [moved_bodies(each, -home) for each in bodies]
            copy_robot(own, k, whole)
            fleet.table, self.robot_of = whole, np.arange(len(whole.each))

    def window(self, table: RobotTable, obstacles: Obstacles, forecast: Forecast, now: float) -> ObstacleWindow:
        """The images of predicted obstacles that robots in the cell about the origin can meet."""
        # No response makes a robot faster that exceeds its maximum speed.
        each, worlds = table.each, np.unique(table.each["world"]).tolist()
        if len(worlds) == 1:
            obstacles = in_world(obstacles, worlds[0])
        for one in listed(obstacles):
            if isinstance(one, Tracks):
                one.refuse_worlds("others")
        speed = max(each["max_speed"].max(), np.linalg.norm(each["velocity"], axis=1).max())
        reach = 0.5 * np.array(self.period) + speed * self.horizon + each["radius"].max() + each["margin"].max()
        images = images_met(each_of(obstacles), forecast, self.period, now, self.horizon, -reach, reach)
        return ObstacleWindow([displaced(predicted, by) for _, predicted, by in images], now, self.horizon)

    def met(
        self, table: RobotTable, k: int, obstacles: Obstacles, forecast: Forecast, now: float, d: int
    ) -> list[Obstacle]:
        """The images of obstacles that robot k can meet."""
        robot, position = table.each[k : k + 1], table.each["position"][k, :d]
        speed = max(float(robot["max_speed"][0]), float(np.linalg.norm(robot["velocity"])))
        reach = speed * self.horizon + float(robot["radius"][0] + robot["margin"][0])
        each = images_met(
            each_of(obstacles), forecast, self.period, now, self.horizon, position - reach, position + reach
        )
        return [displaced(obstacle, by) for obstacle, _, by in each]
