"""The admissible set: its control nearest to a given one.

`limits` (n, 5) are boundaries as in `geometry.boundaries`: balls and half-spaces to stay inside.
"""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.geometry.boundaries import meets, project
from slalom.kernels.geometry.polygons import smallest_ball
from slalom.kernels.jit import kernel
from slalom.kernels.squared import squared


@kernel
def nearest_admissible(preferred: Array, limits: Array, center: Array) -> tuple[bool, bool]:
    """Whether `center` is the admissible control nearest to the preferred one, and whether that itself is admissible.

    All controls are (3,). `center` is written; it is a control near the preferred one if neither holds.
    """
    center[0], center[1], center[2] = preferred[0], preferred[1], preferred[2]
    if meets(limits, 0, len(limits), preferred, -1, -1):
        return True, True
    smallest = smallest_ball(limits, len(limits))
    if not distance_from_center(limits, smallest, preferred) > limits[smallest, 4]:
        return False, False
    found = np.empty((1, 3))
    project(limits, smallest, preferred, found)
    center[0], center[1], center[2] = found[0, 0], found[0, 1], found[0, 2]
    return meets(limits, 0, len(limits), center, smallest, -1), False


@kernel
def distance_from_center(limits: Array, b: int, u: Array) -> float:
    """The distance of control u (3,) from the centre of ball b of `limits` (n, 5)."""
    return float(np.sqrt(squared(u[0] - limits[b, 1]) + squared(u[1] - limits[b, 2]) + squared(u[2] - limits[b, 3])))
