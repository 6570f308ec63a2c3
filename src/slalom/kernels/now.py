"""Where bodies are at the begin of a window of time, seen from the robot."""

import numpy as np

from slalom.kernels.bezier import value
from slalom.kernels.compiled import Array, Flags, Indices, MaybeHulls, kernel
from slalom.kernels.hulls import distances


@kernel
def distances_now(
    times: Array,
    points: Array,
    turns: Array,
    radius: Array,
    growth: Array,
    body: Indices,
    heads: Indices,
    unsure: Flags,
    hull: Indices,
    hulls: MaybeHulls,
    position: Array,
) -> Array:
    """Signed distance of each body at time 0 from `position` (d,) and the unit vector that attains it: (b, 4).

    Of the pieces `heads`, with which bodies begin; inf for others. Less what a body may be off where it is `unsure`.
    """
    d, n = points.shape[2], len(heads)
    places, directions, which = np.zeros((n, 3)), np.zeros((n, 2)), np.empty(n, np.int64)
    result = np.zeros((len(hull), 4))
    result[:, 0] = np.inf
    directions[:, 0] = 1.0
    for i in range(n):
        s = heads[i]
        which[i] = hull[body[s]]
        # Pieces may have begun before the window does.
        x = -times[s, 0] / (times[s, 1] - times[s, 0])
        for axis in range(d):
            p0, p1, p2, p3 = points[s, 0, axis], points[s, 1, axis], points[s, 2, axis], points[s, 3, axis]
            places[i, axis] = value(p0, p1, p2, p3, x) - position[axis]
        for axis in range(2 if len(turns) > 0 else 0):
            p0, p1, p2, p3 = turns[s, 0, axis], turns[s, 1, axis], turns[s, 2, axis], turns[s, 3, axis]
            directions[i, axis] = value(p0, p1, p2, p3, x)
    found = distances(places, directions, which, hulls)
    for i in range(n):
        s = heads[i]
        for column in range(4):
            result[body[s], column] = found[i, column]
        if unsure[body[s]]:
            # How far it may be off now is a distance, not a part of its shape.
            x = -times[s, 0] / (times[s, 1] - times[s, 0])
            result[body[s], 0] -= radius[s] + growth[s] * x
    return result
