"""Geometry in the plane that the rules of the guidance share."""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.guidance.tables import Grid, GuidanceState
from slalom.kernels.jit import kernel


@kernel
def along_and_across(x: float, y: float, dx: float, dy: float) -> tuple[float, float]:
    """Components of the vector (x, y) along (dx, dy) and to the left of it, times the length of (dx, dy)."""
    return x * dx + y * dy, dx * y - dy * x


# ---------------------------------------------------------------------------------------------------------------------
# Periodic worlds in the guidance: nearest images of robots, and obstacles at rest within one period.


@kernel
def nearest_image(j: int, k: int, robots: GuidanceState) -> tuple[float, float]:
    """Vector [m] from robot j to the nearest periodic image of robot k."""
    x = robots.position[k, 0] - robots.position[j, 0]
    y = robots.position[k, 1] - robots.position[j, 1]
    if robots.period[0] > 0.0:
        x -= robots.period[0] * np.round(x / robots.period[0])
    if robots.period[1] > 0.0:
        y -= robots.period[1] * np.round(y / robots.period[1])
    return x, y


@kernel
def is_free(x: float, y: float, radius: float, period: Array, grid: Grid) -> bool:
    """Whether a disc of a radius [m] at (x, y) [m] is on the grid and clear of obstacles at rest.

    period (2,) [m], 0 where the world is not periodic: the grid covers one period.
    """
    if period[0] > 0.0:
        x -= period[0] * np.floor((x - grid.origin[0]) / period[0])
    if period[1] > 0.0:
        y -= period[1] * np.floor((y - grid.origin[1]) / period[1])
    a = int(np.round((x - grid.origin[0]) / grid.width))
    b = int(np.round((y - grid.origin[1]) / grid.width))
    shape = grid.clearance.shape
    return bool(0 <= a < shape[0] and 0 <= b < shape[1] and grid.clearance[a, b] >= radius)
