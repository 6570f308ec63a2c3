"""Predicted obstacles over a long time, indexed by time for fast queries."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slalom import kernels
from slalom.checks import Array
from slalom.kernels.arrays import Indices
from slalom.kernels.sequence_search.tables import SpacetimeIndex
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import Bodies
from slalom.obstacle.window import ObstacleWindow
from slalom.shape import Shape


@dataclass(frozen=True, eq=False)
class PredictedObstacles:
    """Pieces of all obstacles, grown by a robot's shape, from `start` to `end`, absolute times [s].

    Attributes:
        obstacles: the sequence that the table was built for, if it serves more than one decision; else None.
        includes_future: whether obstacles that appear later are known now.
        index: the table.
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
        include_future: bool = True,
    ) -> "PredictedObstacles":
        """Table of `predictions`, the obstacles on their predicted trajectories, indexed by intervals of `width` [s].

        Raises:
            InvalidInput: different dimensions, an end that is not after the start.
        """
        bodies = ObstacleWindow(predictions, start, end - start).bodies(robot)
        appearances = np.array([obstacle.trajectory.span[0] for obstacle in predictions], dtype=np.float64)
        return cls(obstacles, include_future, start, end, _spacetime_index(bodies, appearances, start, end, width))

    def covers(self, obstacles: Sequence[Obstacle], now: float, until: float) -> bool:
        """Whether the table is still valid for these obstacles from `now` to `until` [s]."""
        return self.obstacles is obstacles and self.start <= now and until <= self.end

    def known_at(self, now: float) -> float:
        """Latest time [s] of appearance of the bodies that are known at `now` [s]."""
        return np.inf if self.includes_future else now

    def clearance(self, position: Array, now: float) -> float:
        """Distance [m] of a robot at `position` (d,) [m] from the nearest body at `now` [s]; inf without bodies."""
        s = self.index
        k = min(max(int((now - s.start) / s.width), 0), len(s.first) - 2)
        rows = s.row[s.first[k] : s.first[k + 1]]
        present = (s.times[rows, 0] <= now) & (s.times[rows, 1] >= now) & (s.appears[rows] <= now)
        rows = rows[present]
        if not len(rows):
            return np.inf
        fraction = (now - s.times[rows, 0]) / (s.times[rows, 1] - s.times[rows, 0])
        weights = np.stack(
            [
                (1 - fraction) ** 3,
                3 * fraction * (1 - fraction) ** 2,
                3 * fraction * fraction * (1 - fraction),
                fraction**3,
            ],
            axis=1,
        )
        positions, directions = np.zeros((len(rows), 3)), np.zeros((len(rows), 2))
        positions[:, : len(position)] = np.einsum("nj,njd->nd", weights, s.points[rows]) - position
        directions[:, 0] = 1.0
        if len(s.turns):
            directions = np.einsum("nj,njd->nd", weights, s.turns[rows])
        hull = s.hulls.hull[rows] if s.hulls else np.full(len(rows), -1)
        distances = kernels.distances(positions, directions, hull, s.hulls)
        return float((distances[:, 0] - s.radius[rows] - s.growth[rows] * fraction).min())


def _spacetime_index(bodies: Bodies, appearances: Array, start: float, end: float, width: float) -> SpacetimeIndex:
    rows = bodies.pieces
    times, body = rows.times + start, rows.body
    radius = rows.radius + bodies.radius[body]
    centers = rows.points.mean(axis=1)
    extents = np.linalg.norm(rows.points - centers[:, None], axis=2).max(axis=1, initial=0.0)
    first, row = _rows_by_interval(times, start, end, width)
    return SpacetimeIndex(
        times=times,
        points=np.ascontiguousarray(rows.points),
        radius=radius,
        growth=np.ascontiguousarray(rows.growth),
        turns=np.ascontiguousarray(rows.turns) if bodies.turning else np.empty((0, 4, 2)),
        centers=centers,
        bounding_radius=extents + radius + np.maximum(rows.growth, 0.0) + bodies.hull_radius[body],
        hull_radius=bodies.hull_radius[body],
        appears=appearances[bodies.owner[body]],
        hulls=bodies.hulls_of(body),
        start=float(start),
        width=float(width),
        first=first,
        row=row,
    )


def _rows_by_interval(times: Array, start: float, end: float, width: float) -> tuple[Indices, Indices]:
    """Rows that overlap each interval: those of interval k are row[starts[k]:starts[k + 1]]."""
    count = max(1, int(np.ceil((end - start) / width)))
    first, last = (np.clip(np.floor((t - start) / width).astype(np.int64), 0, count - 1) for t in times.T)
    counts = last - first + 1
    rows = np.repeat(np.arange(len(times)), counts)
    interval = np.repeat(first, counts) + np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    order = np.argsort(interval, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(interval, minlength=count))])
    return starts.astype(np.int64), rows[order]
