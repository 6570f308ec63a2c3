"""Motion of the obstacles of a scenario at the ends of equal steps, and how far it leaves the straight line between."""

from collections.abc import Sequence

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.kernels.arrays import Flags
from slalom.obstacle import Obstacle
from slalom.shape import Ball, Disc
from slalom.sim.scenario import Scenario
from slalom.sim.shape_distance import segment_distance
from slalom.tolerances import GYM_BLOCK
from slalom.trajectory import Stationary


class Motion:
    """Discs, balls and walls of a scenario, computed in blocks of GYM_BLOCK steps.

    Attributes:
        moving: n discs or balls. radii: (n,) [m]. speeds: (n,) [m/s] largest ones.
        walls: m obstacles, one for each wall. ends: (m, 2, d) [m] of walls. wall_radii: (m,) [m].

    Raises:
        InvalidInput: an obstacle that is no disc, no ball and no wall at rest.
    """

    def __init__(self, scenario: Scenario, period: float) -> None:
        self.start, self.period, d = scenario.start, period, scenario.dimension
        self.moving = [each for each in scenario.obstacles if isinstance(each.shape, Disc | Ball)]
        self.radii = np.array([each.shape.bounding_radius for each in self.moving])
        self.walls: list[Obstacle] = []
        ends: list[Array] = []
        wall_radii: list[float] = []
        for obstacle in scenario.obstacles:
            if not isinstance(obstacle.shape, Disc | Ball):
                for corners, radius in _segments(obstacle):
                    self.walls.append(obstacle)
                    ends.append(corners)
                    wall_radii.append(radius)
        self.ends, self.wall_radii = np.array(ends).reshape(-1, 2, d), np.array(wall_radii)
        self._first = -GYM_BLOCK - 1

    def at(self, step: int) -> tuple[Array, Array, Flags]:
        """Positions (n, d) [m], velocities (n, d) [m/s] and existence (n,) at the begin of a step."""
        k = self._row(step)
        return self._positions[k], self._velocities[k], self._there[k]

    def during(self, step: int) -> tuple[Array, Flags]:
        """Largest distance (n,) [m] from the chord of a step, and existence (n,) at any time of it."""
        k = self._row(step)
        return self._bends[k], self._during[k]

    def _row(self, step: int) -> int:
        if not self._first <= step < self._first + GYM_BLOCK:
            self._first = step
            self._compute(self.start + self.period * (step + np.arange(GYM_BLOCK + 1)))
        return step - self._first

    def _compute(self, times: Array) -> None:
        """Fill the block at times (k + 1,) [s]."""
        n, d, k = len(self.moving), self.ends.shape[2], len(times) - 1
        self._positions, self._velocities = np.zeros((k + 1, n, d)), np.zeros((k + 1, n, d))
        self._there, self._during = np.zeros((k + 1, n), np.bool_), np.zeros((k, n), np.bool_)
        self._bends = np.zeros((k, n))
        for j, obstacle in enumerate(self.moving):
            trajectory, (first, last) = obstacle.trajectory, obstacle.trajectory.span
            within = np.clip(times, first, last)
            self._positions[:, j], self._velocities[:, j] = trajectory.position(within), trajectory.velocity(within)
            self._there[:, j] = (first <= times) & (times <= last)
            self._during[:, j] = (first < times[1:]) & (times[:-1] < last)
            begin, end = within[0], within[-1]
            if begin < end:
                partly = self._during[:, j] & ((times[:-1] < first) | (times[1:] > last))
                self._bends[:, j] = _bends(obstacle, begin, end, times)
                self._bends[partly, j] += self.period * trajectory.speed_bound(begin, end)


def _segments(obstacle: Obstacle) -> list[tuple[Array, float]]:
    """Ends (2, d) [m] and radius [m] of each wall of an obstacle."""
    parts = obstacle.shape.parts
    if not isinstance(obstacle.trajectory, Stationary) or any(len(part.corners) > 2 for part in parts):
        raise InvalidInput(
            f"obstacle {obstacle.name!r}: expected a disc, a ball or walls at rest (Polyline, Capsule), "
            f"found {type(obstacle.shape).__name__} on {type(obstacle.trajectory).__name__}"
        )
    axis, found = obstacle.direction(0.0), []
    for corners, radius in parts:
        if corners.shape[1] == 2:
            corners = corners[:, :1] * axis + corners[:, 1:] * np.array([-axis[1], axis[0]])
        ends = obstacle.trajectory.initial_position + corners
        found.append((np.stack([ends[0], ends[-1]]), radius))
    return found


def _bends(obstacle: Obstacle, begin: float, end: float, times: Array) -> Array:
    """Bounds (k,) [m] of the distance from the chord between times (k + 1,) [s].

    A curve with |acceleration| <= M stays within M h^2 / 8 of its chord. A jump of the velocity by c at the time s of a
    step adds at most c s (h - s) / h.
    """
    trajectory, h = obstacle.trajectory, times[1] - times[0]
    if not len(trajectory.breaks(begin, end)):
        return np.full(len(times) - 1, trajectory.acceleration_bound(begin, end) * h * h / 8.0)
    path = trajectory.path(begin, end)
    width, p = np.diff(path.times)[:, None], path.points
    second = np.maximum(
        np.linalg.norm(p[:, 2] - 2.0 * p[:, 1] + p[:, 0], axis=1),
        np.linalg.norm(p[:, 3] - 2.0 * p[:, 2] + p[:, 1], axis=1),
    )
    curvature = 6.0 * second / width[:, 0] ** 2
    jumps = np.linalg.norm(3.0 * ((p[1:, 1] - p[1:, 0]) / width[1:] - (p[:-1, 3] - p[:-1, 2]) / width[:-1]), axis=1)
    # Pieces that each step meets; the last step may end after the path.
    low = np.clip(np.searchsorted(path.times, times[:-1], side="right") - 1, 0, len(p) - 1)
    high = np.clip(np.searchsorted(path.times, times[1:], side="left") - 1, 0, len(p) - 1)
    bends = np.array([curvature[a : b + 1].max() for a, b in zip(low, high)]) * h * h / 8.0
    bends += 2.0 * path.error.max(initial=0.0)
    knots = path.times[1:-1]
    step = np.clip(np.searchsorted(times, knots, side="right") - 1, 0, len(bends) - 1)
    since = np.clip(knots - times[step], 0.0, h)
    np.add.at(bends, step, jumps * since * (h - since) / h)
    return bends


def nearest_on(walls: Sequence[Array] | Array, points: Array) -> Array:
    """Offsets (..., m, d) [m] from points (..., d) to the nearest points of walls (..., m, 2, d) [m]."""
    ends = np.asarray(walls)
    begin, along = ends[..., 0, :] - points[..., None, :], ends[..., 1, :] - ends[..., 0, :]
    square = np.maximum((along * along).sum(axis=-1), 1e-300)
    share = np.clip(-(begin * along).sum(axis=-1) / square, 0.0, 1.0)
    return np.asarray(begin + share[..., None] * along)


def least_distances(before: Array, after: Array) -> Array:
    """Distances (...) [m] of the origin to the segments from `before` to `after`, both (..., d) [m]."""
    shape, d = before.shape[:-1], before.shape[-1]
    return segment_distance(before.reshape(-1, d), after.reshape(-1, d)).reshape(shape)
