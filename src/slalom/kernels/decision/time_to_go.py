"""The earliest arrival of a point that accelerates and then coasts.

What a robot with a goal at rest wishes for: a velocity that leads there, and how long it will take.
"""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.jit import kernel

ARRIVAL_TIMES = np.multiply.accumulate(np.concatenate([[1e-3], np.full(424, 1.05)]))
"""[s] Times up to 1e6 between which the earliest one is sought."""


NARROW = 5e-10
"""[1] How near a root by secants is to the earliest arrival, as a share of it. Larger: more steps by halves are looked
at. Smaller: more roots are not believed, and all steps are."""
SECANTS = 6
"""Steps; more than four are seldom needed."""


@kernel
def speed_excess(away: Array, v: Array, push: float, top: float, tolerance: float, t: float) -> float:
    """By how much [m^2/s^2] the square of the speed is too large after a full push in one direction that leads, with
    coasting then, to within `tolerance` of the point at time t; inf if no push does, not positive if it arrives.

    For a given displacement the full push over the shortest time leaves the smallest change of velocity, so if
    it breaks the speed limit every other push does.
    """
    square, speed, final = 0.0, 0.0, 0.0
    for axis in range(len(away)):
        square += (away[axis] - v[axis] * t) ** 2
        speed += v[axis] * v[axis]
    length = np.sqrt(square)
    if length <= tolerance:
        return -1.0
    need = (length - tolerance) / push
    if 2.0 * need > t * t:
        return np.inf
    hold = t - np.sqrt(t * t - 2.0 * need)
    for axis in range(len(away)):
        final += (v[axis] + (away[axis] - v[axis] * t) / length * push * hold) ** 2
    return float(final - max(top * top, speed) * (1.0 + 1e-9))


@kernel
def earliest_on_line(left: float, along: float, push: float, fast: float) -> float:
    """The least time [s] to get `left` [m] ahead for who has the speed `along` in that direction, at most `fast`."""
    if left <= 0.0:
        return 0.0
    faster = (fast - along) / push
    gone = 0.5 * (fast + along) * faster
    if gone < left:
        return float(faster + (left - gone) / fast)
    # It is there before it is at its fastest. In this form nothing cancels if it is on its way already.
    root = np.sqrt(along * along + 2.0 * push * left)
    return float(2.0 * left / (root + along) if along > 0.0 else (root - along) / push)


@kernel
def arrival_by_secants(away: Array, v: Array, push: float, top: float, tolerance: float) -> float:
    """About the earliest arrival where the speed limits it, or -1: nothing is promised of it."""
    square, speed, along = 0.0, 0.0, 0.0
    for axis in range(len(away)):
        square += away[axis] * away[axis]
        speed += v[axis] * v[axis]
        along += away[axis] * v[axis]
    along /= np.sqrt(square)
    fast = max(top, np.sqrt(speed))
    # Straight on at the largest speed, and what is lost until it points there.
    turn = np.sqrt(max(fast * fast - 2.0 * fast * along + speed, 0.0)) / push
    t = (np.sqrt(square) - tolerance) / fast + turn * (fast - along) / (2.0 * fast)
    before, f = t, speed_excess(away, v, push, top, tolerance, t)
    t *= 1.0 + 1e-4
    for _ in range(SECANTS):
        g = speed_excess(away, v, push, top, tolerance, t)
        if not (np.isfinite(f) and np.isfinite(g)) or f == g:
            return -1.0
        t, before, f = t - g * (t - before) / (g - f), t, g
        if abs(t - before) <= 0.1 * NARROW * t:
            break
    return float(t)


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
    first = k = np.searchsorted(ARRIVAL_TIMES, least)
    root = arrival_by_secants(away, v, push, top, tolerance)
    never, surely = root * (1.0 - NARROW), root * (1.0 + NARROW)
    while k < len(ARRIVAL_TIMES) and ARRIVAL_TIMES[k] < surely:
        k += 1
    if not (
        root > 0.0
        and (k == first or ARRIVAL_TIMES[k - 1] <= never)
        and speed_excess(away, v, push, top, tolerance, surely) <= 0.0
        and speed_excess(away, v, push, top, tolerance, never) > 0.0
    ):
        never, surely, k = -np.inf, np.inf, first
        while k < len(ARRIVAL_TIMES) and speed_excess(away, v, push, top, tolerance, ARRIVAL_TIMES[k]) > 0.0:
            k += 1
    if k == len(ARRIVAL_TIMES):
        return np.inf
    early, late = float(ARRIVAL_TIMES[k] / 1.05), float(ARRIVAL_TIMES[k])
    for _ in range(30):
        middle = 0.5 * (early + late)
        # The root tells all but the last steps.
        if middle >= surely or (middle > never and speed_excess(away, v, push, top, tolerance, middle) <= 0.0):
            late = middle
        else:
            early = middle
    return late


@kernel
def stopping_velocity(away: Array, push: float, top: float, wanted: Array) -> None:
    """Towards `away`, no faster than 0.7 of `push` brakes away nor than `top`, into `wanted`."""
    distance = 1e-12
    square = 0.0
    for axis in range(len(away)):
        square += away[axis] * away[axis]
    distance = max(np.sqrt(square), 1e-12)
    speed = min(top, np.sqrt(1.4 * push * distance))
    for axis in range(len(away)):
        wanted[axis] = away[axis] * speed / distance


@kernel
def passing_velocity(away: Array, velocity: Array, push: float, top: float, wanted: Array) -> None:
    """Towards `away` at `top`, but no faster than lets the robot turn there, into `wanted`.

    The arc from the present heading to the place has the radius distance / (2 sin angle).
    """
    square, speed, along = 0.0, 0.0, 0.0
    for axis in range(len(away)):
        square += away[axis] * away[axis]
        speed += velocity[axis] * velocity[axis]
        along += away[axis] * velocity[axis]
    distance = max(np.sqrt(square), 1e-12)
    cosine = along / (distance * max(np.sqrt(speed), 1e-12))
    sine = np.sqrt(max(1.0 - cosine * cosine, 0.0)) if cosine > 0.0 else 1.0
    slow = min(top, np.sqrt(push * distance / max(2.0 * sine, 1e-6)))
    for axis in range(len(away)):
        wanted[axis] = away[axis] * slow / distance


@kernel
def time_to_stop(distance: float, change: float, push: float, top: float) -> float:
    """An estimate [s] of how long a robot needs to stop after `distance`, if its velocity is off by `change` [m/s] now.

    Exact on a line for a robot that is not faster than its distance allows; what turning the velocity costs is
    change^2 / (2 push top).
    """
    if distance >= top * top / (2.0 * push):
        return float(distance / top + 0.5 * top / push + change * change / (2.0 * push * top))
    return float(np.sqrt(2.0 * distance / push) + change / push)


@kernel
def time_to_go(
    away: Array, velocity: Array, push: float, top: float, tolerance: float, stop: bool, wanted: Array
) -> float:
    """An estimate [s] of how long a robot needs to the goal at `away`, alone in the world. `wanted`: room."""
    if not stop:
        return earliest_arrival(away, velocity, push, top, 0.5 * tolerance)
    square, change = 0.0, 0.0
    stopping_velocity(away, push, top, wanted)
    for axis in range(len(away)):
        square += away[axis] * away[axis]
        change += (wanted[axis] - velocity[axis]) ** 2
    return time_to_stop(max(0.0, np.sqrt(square) - tolerance), np.sqrt(change), push, top)
