"""Where two circles in the control plane meet: what the exchange asks most often, with one division and one root."""

import numpy as np

from slalom.kernels.boundaries import is_flat
from slalom.kernels.compiled import Array, kernel


@kernel
def are_circles(boundaries: Array, i: int, j: int, dimension: int) -> bool:
    """Whether boundaries i and j are circles in the plane, see `boundaries`."""
    return bool(dimension == 2 and not is_flat(boundaries, i) and not is_flat(boundaries, j))


@kernel
def intersect_circles(boundaries: Array, i: int, j: int, found: Array) -> int:
    """The points in which circles i and j meet, into found; their number.

    With c the vector from one centre to the other, they are at the share a of c, and h |c| to its sides.
    """
    x, y, r = boundaries[i, 1], boundaries[i, 2], boundaries[i, 4]
    dx, dy, other = boundaries[j, 1] - x, boundaries[j, 2] - y, boundaries[j, 4]
    square = dx * dx + dy * dy
    if square == 0.0 or square > (r + other) ** 2 or square < (r - other) ** 2:
        return 0
    inverse = 1.0 / square
    a = 0.5 + 0.5 * (r - other) * (r + other) * inverse
    h = np.sqrt(max(r * r * inverse - a * a, 0.0))
    x, y, sx, sy = x + a * dx, y + a * dy, h * dy, h * dx
    found[0, 0], found[0, 1], found[0, 2] = x - sx, y + sy, 0.0
    found[1, 0], found[1, 1], found[1, 2] = x + sx, y - sy, 0.0
    return 2
