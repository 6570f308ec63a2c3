"""The earliest arrival of a point that accelerates and then coasts."""

import numpy as np

from slalom.kernels.compiled import Array, kernel

LATE = np.multiply.accumulate(np.concatenate([[1e-3], np.full(424, 1.05)]))
"""[s] Times up to 1e6 between which the earliest one is sought."""


@kernel
def reaches(away: Array, v: Array, push: float, top: float, tolerance: float, t: float) -> bool:
    """Whether a full push in one direction, then coasting, is within `tolerance` of the point at time t.

    For a given displacement the full push over the shortest time leaves the smallest change of velocity, so if
    it breaks the speed limit every other push does.
    """
    square, speed, final = 0.0, 0.0, 0.0
    for axis in range(len(away)):
        square += (away[axis] - v[axis] * t) ** 2
        speed += v[axis] * v[axis]
    length = np.sqrt(square)
    if length <= tolerance:
        return True
    need = (length - tolerance) / push
    if 2.0 * need > t * t:
        return False
    hold = t - np.sqrt(t * t - 2.0 * need)
    for axis in range(len(away)):
        final += (v[axis] + (away[axis] - v[axis] * t) / length * push * hold) ** 2
    return bool(final <= max(top * top, speed) * (1.0 + 1e-9))


@kernel
def earliest_arrival(away: Array, v: Array, push: float, top: float, tolerance: float) -> float:
    """Time [s] at which a point with velocity v, limited to `push` and `top`, gets within `tolerance` of `away`."""
    square, speed = 0.0, 0.0
    for axis in range(len(away)):
        square += away[axis] * away[axis]
        speed += v[axis] * v[axis]
    distance = np.sqrt(square)
    if distance <= tolerance:
        return 0.0
    # On the way it is never faster than at its begin or end.
    least = (distance - tolerance) / max(top, np.sqrt(speed)) * (1.0 - 1e-6)
    k = np.searchsorted(LATE, least)
    while k < len(LATE) and not reaches(away, v, push, top, tolerance, LATE[k]):
        k += 1
    if k == len(LATE):
        return np.inf
    early, late = float(LATE[k] / 1.05), float(LATE[k])
    for _ in range(30):
        middle = 0.5 * (early + late)
        if reaches(away, v, push, top, tolerance, middle):
            late = middle
        else:
            early = middle
    return late
