"""Decisions in a periodic world: robots among the images of each other and of obstacles that they can meet."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from slalom.decision.tables import publish, reaches
from slalom.fleet.settings import Members
from slalom.forecast.forecast import Forecast
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import Paths, RobotTable, TargetPaths
from slalom.obstacle import Obstacle
from slalom.obstacle.periodic import Period, checked_period, displaced, images_met, images_near, to_nearest
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import Obstacles, ObstacleWindow, each_of, in_world, listed


class Images:
    """The images of robots and obstacles in a world with a `period` (d,) [m], up to a `horizon` [s]."""

    def __init__(self, members: Members, horizon: float, period: Period) -> None:
        shapes = members.shapes
        wide = 2.0 * max(shape.bounding_radius for shape in shapes) + float(members.margins.max())
        self.period = checked_period(period, shapes[0].dimension, wide, "world_period")
        self.members, self.horizon = members, horizon

    @contextmanager
    def around(
        self, whole: RobotTable, targets: TargetPaths, some: Indices
    ) -> Iterator[tuple[RobotTable, TargetPaths]]:
        """A table of the robots in the cell about the origin and of images near `some` of them, and their targets.

        Passive obstacles are those about that cell, see `window`. Afterwards the decisions made meanwhile are written
        into the table of the `whole` fleet.
        """
        d = self.members.shapes[0].dimension
        home = to_nearest(whole.each["position"], self.period)
        positions = whole.each["position"] + home
        distances = reaches(whole.each, self.horizon) + whole.each["margin_among"]
        robots, shifts = images_near(positions[:, :d], distances, some, self.period)
        rows, by = np.concatenate([np.arange(len(home)), robots]), np.concatenate([home, home[robots]])
        by[len(home) :, :d] += shifts
        each = whole.each[rows]
        each["position"] += by
        each["target"] += by
        each["next_image"] = _next_images(rows)
        committed, observed = whole.committed, whole.observed
        moved = committed.points + home[:, None, None]
        own = RobotTable(
            each,
            Paths(committed.times.copy(), moved.copy()),
            Paths(observed.times[rows], observed.points[rows] + by[:, None, None]),
        )
        if len(targets.points):
            of_paths = np.repeat(home, np.diff(targets.first), axis=0)
            targets = targets._replace(points=targets.points + of_paths[:, None])
        yield own, targets
        decided, kept = each[: len(home)], ("position", "target", "next_image")
        for name in kept:
            decided[name] = whole.each[name]
        whole.each[:] = decided
        changed = (own.committed.points != moved).any(axis=(1, 2, 3))
        changed |= (own.committed.times != committed.times).any(axis=1)
        committed.times[changed] = own.committed.times[changed]
        committed.points[changed] = own.committed.points[changed] - home[changed, None, None]
        for k in np.flatnonzero(changed).tolist():
            if self.members.methods[k].shared:
                publish(whole, k)

    def window(self, table: RobotTable, obstacles: Obstacles, forecast: Forecast, now: float) -> ObstacleWindow:
        """The images of predicted obstacles that robots in the cell about the origin can meet."""
        each, worlds = table.each, np.unique(table.each["world"]).tolist()
        if len(worlds) == 1:
            obstacles = in_world(obstacles, worlds[0])
        for one in listed(obstacles):
            if isinstance(one, Tracks):
                one.refuse_worlds("others")
        reach = 0.5 * np.array(self.period) + (reaches(each, self.horizon) + each["margin"]).max()
        images = images_met(each_of(obstacles), forecast, self.period, now, self.horizon, -reach, reach)
        return ObstacleWindow([displaced(predicted, by) for _, predicted, by in images], now, self.horizon)

    def met(
        self, table: RobotTable, k: int, obstacles: Obstacles, forecast: Forecast, now: float, d: int
    ) -> list[Obstacle]:
        """The images of obstacles that robot k can meet."""
        robot, position = table.each[k : k + 1], table.each["position"][k, :d]
        reach = float((reaches(robot, self.horizon) + robot["margin"])[0])
        each = images_met(
            each_of(obstacles), forecast, self.period, now, self.horizon, position - reach, position + reach
        )
        return [displaced(obstacle, by) for obstacle, _, by in each]


def _next_images(rows: Indices) -> Indices:
    """The next image of each of the rows (n,), of which each states the number of its robot; -1: none."""
    following = np.full(len(rows), -1)
    order = np.argsort(rows, kind="stable")
    same = rows[order[1:]] == rows[order[:-1]]
    following[order[:-1][same]] = order[1:][same]
    return following
