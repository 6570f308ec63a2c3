"""Decisions in a periodic world: each robot among the images of the others and of obstacles that it can meet."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from slalom.decision.grown_bodies import moved_bodies
from slalom.forecast import Forecast
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import GrownBodies, RobotTable
from slalom.obstacle import Obstacle
from slalom.obstacle.periodic import Period, checked_period, displaced, images_about, images_met, to_nearest
from slalom.obstacle.window import Obstacles, ObstacleWindow, each_of

if TYPE_CHECKING:
    from slalom.fleet.committed import CommittedFleet


class Images:
    """The images of robots and obstacles in a world with a `period` (d,) [m].

    Attributes:
        robot_of: the robot in each row of the table of the fleet; between decisions the rows are the robots.
    """

    def __init__(self, fleet: "CommittedFleet", period: Period) -> None:
        table = fleet.table
        wide = 2.0 * float(table.radius.max()) + float(fleet.members.margins.max())
        self.period = checked_period(period, fleet.dimension, wide, "world_period")
        self.horizon = fleet.horizon
        self.robot_of = np.arange(len(table.radius))

    def about(
        self, fleet: "CommittedFleet", some: Indices, bodies: list[GrownBodies]
    ) -> Iterator[tuple[Indices, list[GrownBodies]]]:
        """Each of the robots `some` alone, with all images of the others that it can meet in the table of the fleet.

        Also all `bodies` grown by each kind of skeleton, from `window`. Images of a robot move as it does and need not
        be avoided by it.
        """
        whole, d = fleet.table, fleet.dimension
        speed = np.maximum(whole.max_speed, np.linalg.norm(whole.velocity, axis=1))
        reach = speed * self.horizon + whole.radius
        for k in some:
            within = reach + reach[k] + whole.margin[k]
            self.robot_of, by = images_about(k, whole.position, within, self.period)
            # Passive obstacles are those of the cell about the origin, into which `home` brings the robot.
            home = to_nearest(whole.position[k], self.period)[:d]
            fleet.table = own = RobotTable._make(column[self.robot_of] for column in whole)
            own.position[:] += by
            own.observed_points[:] += by[:, None, None]
            yield np.array([k]), [moved_bodies(each, -home) for each in bodies]
            for column, new in zip(whole, own, strict=True):
                column[k] = new[k]
            fleet.table, self.robot_of = whole, np.arange(len(whole.radius))

    def window(self, table: RobotTable, obstacles: Obstacles, forecast: Forecast, now: float) -> ObstacleWindow:
        """The images of predicted obstacles that robots in the cell about the origin can meet."""
        # No response makes a robot faster that exceeds its maximum speed.
        speed = max(table.max_speed.max(), np.linalg.norm(table.velocity, axis=1).max())
        reach = 0.5 * np.array(self.period) + speed * self.horizon + table.radius.max() + table.margin.max()
        each = images_met(each_of(obstacles), forecast, self.period, now, self.horizon, -reach, reach)
        return ObstacleWindow([displaced(predicted, by) for _, predicted, by in each], now, self.horizon)

    def met(
        self, table: RobotTable, k: int, obstacles: Obstacles, forecast: Forecast, now: float, d: int
    ) -> list[Obstacle]:
        """The images of obstacles that robot k can meet."""
        speed = max(table.max_speed[k], float(np.linalg.norm(table.velocity[k])))
        reach, position = speed * self.horizon + table.radius[k] + table.margin[k], table.position[k, :d]
        each = images_met(
            each_of(obstacles), forecast, self.period, now, self.horizon, position - reach, position + reach
        )
        return [displaced(obstacle, by) for obstacle, _, by in each]
