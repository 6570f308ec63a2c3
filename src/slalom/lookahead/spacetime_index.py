"""Obstacles over a long time, ordered so that who is near a place at a time is found at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slalom import kernels
from slalom.checks import Array
from slalom.kernels.arrays import Indices, MaybeHulls
from slalom.kernels.sequence_search.tables import SpacetimeIndex
from slalom.obstacle import Obstacle
from slalom.obstacle_pieces import Bodies
from slalom.obstacle_table import ObstacleTable
from slalom.shape import Shape


@dataclass(frozen=True, eq=False)
class PredictedObstacles:
    """The pieces of all obstacles, grown by a robot's shape, from `start` to `end`, absolute times [s].

    Attributes:
        obstacles: those that were asked about, if the table serves for more than one decision; else None.
        everybody: whether who appears later is known of now. schedule: the table.
    """

    obstacles: Sequence[Obstacle] | None
    includes_future: bool
    start: float
    end: float
    index: SpacetimeIndex

    @classmethod
    def of(
        cls,
        obstacles: Sequence[Obstacle] | None,
        predictions: Sequence[Obstacle],
        robot: Shape,
        start: float,
        end: float,
        width: float,
        *,
        includes_future: bool = True,
    ) -> "PredictedObstacles":
        """The table of `seen`, the obstacles as they are foreseen, listed in intervals of `width` [s].

        Raises:
            InvalidInput: different dimensions, an end that is not after the start.
        """
        bodies = ObstacleTable(predictions, start, end - start).bodies(robot)
        since = np.array([obstacle.trajectory.span[0] for obstacle in predictions], dtype=np.float64)
        return cls(obstacles, includes_future, start, end, _spacetime_index(bodies, since, start, end, width))

    def covers(self, obstacles: Sequence[Obstacle], now: float, until: float) -> bool:
        """Whether this is still what is known of the obstacles, from `now` to `until` [s]."""
        return self.obstacles is obstacles and self.start <= now and until <= self.end

    def known_at(self, now: float) -> float:
        """Up to when [s] bodies must have appeared to be known of at `now`."""
        return np.inf if self.includes_future else now

    def clearance(self, place: Array, now: float) -> float:
        """How far [m] a robot at `place` (d,) is from the nearest body at `now` [s]; inf without any."""
        s = self.index
        k = min(max(int((now - s.start) / s.width), 0), len(s.first) - 2)
        rows = s.row[s.first[k] : s.first[k + 1]]
        there = (s.times[rows, 0] <= now) & (s.times[rows, 1] >= now) & (s.appears[rows] <= now)
        rows = rows[there]
        if not len(rows):
            return np.inf
        x = (now - s.times[rows, 0]) / (s.times[rows, 1] - s.times[rows, 0])
        weights = np.stack([(1 - x) ** 3, 3 * x * (1 - x) ** 2, 3 * x * x * (1 - x), x**3], axis=1)
        places, ahead = np.zeros((len(rows), 3)), np.zeros((len(rows), 2))
        places[:, : len(place)] = np.einsum("nj,njd->nd", weights, s.points[rows]) - place
        ahead[:, 0] = 1.0
        if len(s.turns):
            ahead = np.einsum("nj,njd->nd", weights, s.turns[rows])
        which = s.hulls[0][rows] if s.hulls else np.full(len(rows), -1)
        found = kernels.distances(places, ahead, which, s.hulls)
        return float((found[:, 0] - s.radius[rows] - s.growth[rows] * x).min())


def _spacetime_index(bodies: Bodies, since: Array, start: float, end: float, width: float) -> SpacetimeIndex:
    rows = bodies.pieces
    times, which = rows.times + start, rows.body
    around = rows.radius + bodies.radius[which]
    middle = rows.points.mean(axis=1)
    bends = np.linalg.norm(rows.points - middle[:, None], axis=2).max(axis=1, initial=0.0)
    begin, row = _rows_by_interval(times, start, end, width)
    hulls: MaybeHulls = ()
    if bodies.hull.max(initial=-1) >= 0:
        hulls = (bodies.hull[which], np.empty((4, 2, 0)), bodies.corners, bodies.first, bodies.unordered)
    return SpacetimeIndex(
        times=times,
        points=np.ascontiguousarray(rows.points),
        radius=around,
        growth=np.ascontiguousarray(rows.growth),
        turns=np.ascontiguousarray(rows.turns) if bodies.turning else np.empty((0, 4, 2)),
        centers=middle,
        bounding_radius=bends + around + np.maximum(rows.growth, 0.0) + bodies.hull_radius[which],
        hull_radius=bodies.hull_radius[which],
        appears=since[bodies.owner[which]],
        hulls=hulls,
        start=float(start),
        width=float(width),
        first=begin,
        row=row,
    )


def _rows_by_interval(times: Array, start: float, end: float, width: float) -> tuple[Indices, Indices]:
    """Which rows overlap which interval: those of interval k are row[begin[k]:begin[k + 1]]."""
    count = max(1, int(np.ceil((end - start) / width)))
    first, last = (np.clip(np.floor((t - start) / width).astype(np.int64), 0, count - 1) for t in times.T)
    many = last - first + 1
    rows = np.repeat(np.arange(len(times)), many)
    place = np.repeat(first, many) + np.arange(len(rows)) - np.repeat(np.cumsum(many) - many, many)
    order = np.argsort(place, kind="stable")
    begin = np.concatenate([[0], np.cumsum(np.bincount(place, minlength=count))])
    return begin.astype(np.int64), rows[order]
