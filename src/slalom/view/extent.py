"""The box of a run that is drawn."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from slalom.checks import Array
from slalom.obstacle import Obstacle

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
