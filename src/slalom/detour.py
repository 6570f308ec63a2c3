"""How much longer the way becomes around those who will stand in it."""

import numpy as np

from slalom import kernels
from slalom.checks import Array


def way_round(place: Array, goal: Array, centers: Array, radii: Array) -> Array:
    """By how much [m] the shortest way from `place` to `goal` (2,) around each disc (n, 2), (n,) is longer than
    straight: (n,).

    Two tangents and an arc; 0 for a disc that is not in the way. A place or goal inside a disc counts as on its border.
    """
    centers = np.ascontiguousarray(centers, dtype=np.float64)
    return kernels.longer_ways(np.asarray(place), np.asarray(goal), centers, np.asarray(radii))
