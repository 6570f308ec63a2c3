"""Worlds that repeat, as guides know them: the nearest images of robots, and what rests in one period."""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.guidance.tables import GuidanceState
from slalom.kernels.jit import kernel


@kernel
def apart(j: int, k: int, guide: GuidanceState) -> tuple[float, float]:
    """Where robot k is from robot j: that of its images which is nearest."""
    x, y = guide.position[k, 0] - guide.position[j, 0], guide.position[k, 1] - guide.position[j, 1]
    if guide.period[0] > 0.0:
        x -= guide.period[0] * np.round(x / guide.period[0])
    if guide.period[1] > 0.0:
        y -= guide.period[1] * np.round(y / guide.period[1])
    return x, y


@kernel
def is_free(x: float, y: float, reach: float, guide: GuidanceState, grid: Array, clearance: Array) -> bool:
    """Whether what rests is at least `reach` from a place, of which the grid may hold an image."""
    if guide.period[0] > 0.0:
        x -= guide.period[0] * np.floor((x - grid[0]) / guide.period[0])
    if guide.period[1] > 0.0:
        y -= guide.period[1] * np.floor((y - grid[1]) / guide.period[1])
    a, b = int(np.round((x - grid[0]) / grid[2])), int(np.round((y - grid[1]) / grid[2]))
    return bool(0 <= a < clearance.shape[0] and 0 <= b < clearance.shape[1] and clearance[a, b] >= reach)
