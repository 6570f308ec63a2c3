"""Axes of a body along a direction."""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.jit import kernel


@kernel
def axes_along(ahead: Array) -> Array:
    """Unit axes (d, d) of a body as rows, of which the first is the unit vector `ahead` (d,).

    In the plane the second is to its left. In space any two lateral directions serve; these come from the world axis
    that is most lateral.
    """
    d = len(ahead)
    axes = np.empty((d, d))
    x = ahead[0]
    y = ahead[1]
    axes[0] = ahead
    if d == 2:
        axes[1, 0] = -y
        axes[1, 1] = x
        return axes
    z = ahead[2]
    least = min(abs(x), abs(y), abs(z))
    p, q, r = (0.0, z, -y) if abs(x) == least else (-z, 0.0, x) if abs(y) == least else (y, -x, 0.0)
    length = np.sqrt(p * p + q * q + r * r)
    p = p / length
    q = q / length
    r = r / length
    axes[1, 0] = p
    axes[1, 1] = q
    axes[1, 2] = r
    axes[2, 0] = y * r - z * q
    axes[2, 1] = z * p - x * r
    axes[2, 2] = x * q - y * p
    return axes
