"""Boxes and times of what is drawn."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from slalom.checks import Array
from slalom.obstacle import Obstacle
from slalom.trajectory import Trajectory

Extent = tuple[float, float, float, float]
"""Limits x from, x to, y from, y to of a panel [m]."""

TIMES: Final = 40
"""[1] Times of a run at which the positions of obstacles enter the drawn box."""


def drawn_box(
    points: Array, radius: float, obstacles: Sequence[Obstacle], start: float, end: float
) -> tuple[Array, Array]:
    """Return the lower and upper corner (d,) [m] of the box of a run: robots, goals, and the obstacles near them.

    Args:
        points: (n, d) [m] positions of robots and goals. radius: [m] of the largest robot. start, end: [s] of the run.
    """
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    reach = 0.6 * float(np.max(high - low)) + 4.0 * radius
    inner_low, inner_high = low - reach, high + reach
    for obstacle in obstacles:
        first, last = max(start, obstacle.trajectory.span[0]), min(end, obstacle.trajectory.span[1])
        if first > last:
            continue
        centres = obstacle.trajectory.position(np.linspace(first, last, TIMES))
        size = min(obstacle.shape.bounding_radius, reach)
        near = ((centres > inner_low) & (centres < inner_high)).all(axis=1)
        if near.any():
            low = np.minimum(low, np.maximum(centres[near].min(axis=0) - size, inner_low))
            high = np.maximum(high, np.minimum(centres[near].max(axis=0) + size, inner_high))
    pad = 0.04 * float(np.max(high - low)) + radius
    return low - pad, high + pad


def padded_extent(points: Array, min_aspect: float) -> Extent:
    """Return a bounding box of points (n, 2) with a margin of 5 %; the ratio of its sides is at least `min_aspect`."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, sides = 0.5 * (low + high), 1.1 * (high - low)
    half = 0.5 * np.maximum(sides, max(min_aspect * float(sides.max()), 1e-3))
    return (middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1])


def disc_box(center: Array, radius: float) -> Array:
    """Return the lower and upper corner (2, 2) of the bounding box of a disc."""
    return np.array([center[:2] - radius, center[:2] + radius])


def times_within(trajectory: Trajectory, start: float, end: float, count: int) -> Array:
    """Return evenly spaced times (count,) [s] from start to end within the span of a trajectory; none if disjoint."""
    first, last = trajectory.span
    begin, finish = max(start, first), min(end, last)
    return np.linspace(begin, finish, count) if begin < finish else np.empty(0)
