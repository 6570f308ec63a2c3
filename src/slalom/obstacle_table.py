"""Obstacles over a window of time: one table for all control obstacles of a decision."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.checks import Array, number, positive
from slalom.errors import InvalidInput
from slalom.kernels.arrays import Snapshot
from slalom.minkowski import minkowski_sum
from slalom.obstacle import Obstacle
from slalom.obstacle_pieces import (
    Bodies,
    joined,
    no_bodies,
    overlapping,
    rows_of,
    tabulated,
)
from slalom.shape import Shape


class ObstacleTable:
    """Obstacles over a window of time as cubic pieces.

    Args:
        obstacles: all of one dimension; those that do not exist within the window leave no piece.
        start: absolute time [s] of the decision. horizon: length of the window [s] > 0.
        horizons: (n,) [s] one for each obstacle, above 0 and at most `horizon`; beyond it that obstacle counts no more.

    Raises:
        InvalidInput: different dimensions, a horizon that is not above 0.
    """

    def __init__(
        self, obstacles: Sequence[Obstacle], start: float, horizon: float, horizons: npt.ArrayLike | None = None
    ) -> None:
        self.obstacles = tuple(obstacles)
        self.start = number(start, "start")
        self.horizon = positive(horizon, "horizon")
        dimensions = {obstacle.dimension for obstacle in self.obstacles}
        if len(dimensions) > 1:
            raise InvalidInput(f"obstacles: expected one dimension, found {sorted(dimensions)}")
        self.dimension = dimensions.pop() if dimensions else None
        self._until = None if horizons is None else self._each(horizons)
        self._bodies: dict[Shape, Bodies] = {}
        self._distances: tuple[tuple[Shape, bytes], Array, Array] | None = None

    def _each(self, horizons: npt.ArrayLike) -> list[float]:
        each = [positive(one, f"horizons[{k}]") for k, one in enumerate(np.atleast_1d(np.asarray(horizons)))]
        if len(each) != len(self.obstacles) or max(each, default=0.0) > self.horizon:
            raise InvalidInput(
                f"horizons: expected {len(self.obstacles)} of at most {self.horizon:g} s, found {len(each)} up to "
                f"{max(each, default=0.0):g} s"
            )
        return each

    def bodies(self, robot: Shape) -> Bodies:
        """The pieces of all obstacles grown by a robot's shape."""
        if robot not in self._bodies:
            self._bodies[robot] = self._grow(robot)
        return self._bodies[robot]

    def distances(self, robot: Shape, position: Array) -> tuple[Array, Array]:
        """Distance (b,) [m] of each body from a robot at `position` (d,) [m] now, and the direction of each (b, d).

        The radius is not subtracted, the uncertainty of the position is. Infinite for a body that does not exist now.
        Inside a body the distance is minus the depth. Against the unit vectors a robot leaves a body soonest.
        """
        key = (robot, position.tobytes())
        if self._distances is None or self._distances[0] != key:
            self._distances = (key, *self._measure(robot, position))
        return self._distances[1:]

    def _measure(self, robot: Shape, position: Array) -> tuple[Array, Array]:
        bodies = self.bodies(robot)
        now = Snapshot(bodies.pieces, bodies.heads, bodies.uncertain, bodies.hull)
        found = kernels.distances_now(now, bodies.hulls, position)
        return found[:, 0], found[:, 1 : 1 + position.size]

    def _grow(self, robot: Shape) -> Bodies:
        bodies = self._known(robot)
        return self._anew(robot) if bodies is None else bodies

    def _known(self, robot: Shape) -> Bodies | None:
        """The pieces, taken from a table of all obstacles that serves many decisions; None if there is no such table.

        Not if one of them is not tabulated, counts for less than the whole window, or is not there in it.
        """
        if self._until is not None or not self.obstacles:
            return None
        stretch = int(np.floor(self.start / (2.0 * self.horizon)))
        key = (self.obstacles, robot, stretch, self.horizon)
        if key not in _JOINED:
            if len(_JOINED) >= 8:
                _JOINED.clear()
            _JOINED[key] = self._joined(robot)
        bodies = _JOINED[key]
        if bodies is None:
            return None
        first, last, all_pieces = bodies
        start, end = self.start, self.start + self.horizon
        if not (first < end and last > start):
            return None
        pieces, heads = kernels.pieces_within(all_pieces.pieces, start, end)
        return all_pieces._replace(pieces=pieces, heads=heads)

    def _joined(self, robot: Shape) -> tuple[float, float, Bodies] | None:
        """Times at which the last obstacle appears and the first vanishes, and all pieces over an interval of time."""
        if any(not o.trajectory.tabulated or o.uncertainty is not None for o in self.obstacles):
            return None
        spans = [obstacle.trajectory.span for obstacle in self.obstacles]
        first, last = max(span[0] for span in spans), min(span[1] for span in spans)
        if not (first < self.start + self.horizon and last > self.start):
            return None
        shapes = [minkowski_sum(obstacle, robot) for obstacle in self.obstacles]
        tables = [
            tabulated(obstacle, shape, robot, self.start, self.horizon)
            for obstacle, shape in zip(self.obstacles, shapes)
        ]
        cuts = [slice(0, len(table.body)) for table in tables]
        return first, last, joined(self.obstacles, list(range(len(shapes))), shapes, tables, cuts, 0.0)

    def _anew(self, robot: Shape) -> Bodies:
        tables, shapes, cuts, indices = [], [], [], []
        for index, obstacle in enumerate(self.obstacles):
            first, last = obstacle.trajectory.span
            until = self.horizon if self._until is None else self._until[index]
            begin, end = max(self.start, first), min(self.start + until, last)
            if begin >= end:
                continue
            shape = minkowski_sum(obstacle, robot)
            many = obstacle.trajectory.tabulated and obstacle.uncertainty is None
            if many and until == self.horizon:
                table = tabulated(obstacle, shape, robot, self.start, self.horizon)
                table, cut = overlapping(table, begin, end)
            else:
                table = rows_of(obstacle, shape, self.start, begin, end)
                cut = slice(0, len(table.body))
            tables.append(table)
            cuts.append(cut)
            shapes.append(shape)
            indices.append(index)
        if not tables:
            return no_bodies(self.dimension or 2)
        return joined(self.obstacles, indices, shapes, tables, cuts, self.start)


_JOINED: dict[tuple[tuple[Obstacle, ...], Shape, int, float], tuple[float, float, Bodies] | None] = {}
"""The tables of all obstacles of a scene together, of the last few: most decisions are about the same ones."""
