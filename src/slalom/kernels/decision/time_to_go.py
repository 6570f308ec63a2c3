"""Earliest arrival of a point that accelerates and then coasts; desired velocity; estimate of the time to the goal."""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.jit import kernel
from slalom.kernels.squared import squared
from slalom.tolerances import (
    ADMISSIBLE,
    ARRIVAL_COUNT,
    ARRIVAL_FIRST,
    ARRIVAL_RATIO,
    ARRIVAL_ROOT,
    ARRIVAL_STEPS,
    SECANT_OFFSET,
)

ARRIVAL_TIMES = np.multiply.accumulate(np.concatenate([[ARRIVAL_FIRST], np.full(ARRIVAL_COUNT, ARRIVAL_RATIO)]))
"""[s] Times up to 1e6 between which the earliest one is sought."""


@kernel
def speed_excess(away: Array, v: Array, max_acceleration: float, max_speed: float, tolerance: float, t: float) -> float:
    """Excess [m^2/s^2] of the squared final speed over the limit, for an arrival within `tolerance` at time t [s].

    The point accelerates fully in one direction, then coasts, to within `tolerance` [m] of the displacement `away` (d,)
    [m], with velocity v (d,) [m/s]. Infinite if no such acceleration arrives; not positive if it arrives. For a given
    displacement the full acceleration over the shortest time changes the velocity least: if that breaks the speed
    limit, every other one does.
    """
    square, speed, final = 0.0, 0.0, 0.0
    for axis in range(len(away)):
        square += squared(away[axis] - v[axis] * t)
        speed += v[axis] * v[axis]
    length = np.sqrt(square)
    if length <= tolerance:
        return -1.0
    need = (length - tolerance) / max_acceleration
    if 2.0 * need > t * t:
        return np.inf
    hold = t - np.sqrt(t * t - 2.0 * need)
    for axis in range(len(away)):
        final += squared(v[axis] + (away[axis] - v[axis] * t) / length * max_acceleration * hold)
    return float(final - max(max_speed * max_speed, speed) * (1.0 + ADMISSIBLE))


@kernel
def earliest_on_line(left: float, along: float, max_acceleration: float, fast: float) -> float:
    """The least time [s] to advance by `left` [m] from the speed `along` [m/s], never above `fast` [m/s]."""
    if left <= 0.0:
        return 0.0
    faster = (fast - along) / max_acceleration
    gone = 0.5 * (fast + along) * faster
    if gone < left:
        return float(faster + (left - gone) / fast)
    # It arrives before it reaches its largest speed. In this form nothing cancels if it moves there already.
    root = np.sqrt(along * along + 2.0 * max_acceleration * left)
    return float(2.0 * left / (root + along) if along > 0.0 else (root - along) / max_acceleration)


@kernel
def arrival_by_secants(away: Array, v: Array, max_acceleration: float, max_speed: float, tolerance: float) -> float:
    """An estimate [s], without a guarantee, of the earliest arrival where the speed limits it; or -1.

    Arguments as of `earliest_arrival`.
    """
    square, speed, along = 0.0, 0.0, 0.0
    for axis in range(len(away)):
        square += away[axis] * away[axis]
        speed += v[axis] * v[axis]
        along += away[axis] * v[axis]
    along /= np.sqrt(square)
    fast = max(max_speed, np.sqrt(speed))
    # Straight ahead at the largest speed, and the time lost until the velocity points there.
    turn = np.sqrt(max(fast * fast - 2.0 * fast * along + speed, 0.0)) / max_acceleration
    t = (np.sqrt(square) - tolerance) / fast + turn * (fast - along) / (2.0 * fast)
    before, f = t, speed_excess(away, v, max_acceleration, max_speed, tolerance, t)
    t *= 1.0 + SECANT_OFFSET
    for _ in range(ARRIVAL_STEPS):
        g = speed_excess(away, v, max_acceleration, max_speed, tolerance, t)
        if not (np.isfinite(f) and np.isfinite(g)) or f == g:
            return -1.0
        t, before, f = t - g * (t - before) / (g - f), t, g
        if abs(t - before) <= 0.1 * ARRIVAL_ROOT * t:
            break
    return float(t)


@kernel
def earliest_arrival(away: Array, v: Array, max_acceleration: float, max_speed: float, tolerance: float) -> float:
    """Earliest time [s] at which a point gets within `tolerance` [m] of the displacement `away` (d,) [m]; inf if never.

    The point has the velocity v (d,) [m/s]. It accelerates once by at most `max_acceleration` [m/s^2] and then coasts,
    at most at `max_speed` [m/s] or at its present speed.
    """
    square, speed = 0.0, 0.0
    for axis in range(len(away)):
        square += away[axis] * away[axis]
        speed += v[axis] * v[axis]
    distance = np.sqrt(square)
    if distance <= tolerance:
        return 0.0
    # On the way the point is never faster than at its start or end.
    least = (distance - tolerance) / max(max_speed, np.sqrt(speed)) * (1.0 - 1e-6)
    first = k = np.searchsorted(ARRIVAL_TIMES, least)
    root = arrival_by_secants(away, v, max_acceleration, max_speed, tolerance)
    never, surely = root * (1.0 - ARRIVAL_ROOT), root * (1.0 + ARRIVAL_ROOT)
    while k < len(ARRIVAL_TIMES) and ARRIVAL_TIMES[k] < surely:
        k += 1
    if not (
        root > 0.0
        and (k == first or ARRIVAL_TIMES[k - 1] <= never)
        and speed_excess(away, v, max_acceleration, max_speed, tolerance, surely) <= 0.0
        and speed_excess(away, v, max_acceleration, max_speed, tolerance, never) > 0.0
    ):
        never, surely, k = -np.inf, np.inf, first
        while (
            k < len(ARRIVAL_TIMES)
            and speed_excess(away, v, max_acceleration, max_speed, tolerance, ARRIVAL_TIMES[k]) > 0.0
        ):
            k += 1
    if k == len(ARRIVAL_TIMES):
        return np.inf
    early, late = float(ARRIVAL_TIMES[k] / ARRIVAL_RATIO), float(ARRIVAL_TIMES[k])
    for _ in range(30):
        middle = 0.5 * (early + late)
        # The root decides all but the last steps.
        if middle >= surely or (
            middle > never and speed_excess(away, v, max_acceleration, max_speed, tolerance, middle) <= 0.0
        ):
            late = middle
        else:
            early = middle
    return late


@kernel
def stopping_speed(left: float, step: float, braking: float) -> float:
    """The largest speed [m/s] after `step` [s] from which a robot comes to rest exactly, if steps take at least that.

    `left` [m]: the distance that is left if the robot moves for the step at half its present velocity; half of the new
    velocity adds to it. A robot slower than braking step, in [m/s], comes to rest in one further step; a faster one
    brakes by `braking` [m/s^2] first, and by at most 9/8 of that in the step before the last.
    """
    if left <= braking * step * step:
        return float(left / step) if step > 0.0 else 0.0
    slow = braking * step
    return float(0.5 * (np.sqrt(slow * slow + 8.0 * braking * left) - slow))


@kernel
def passing_velocity(away: Array, velocity: Array, max_acceleration: float, max_speed: float, desired: Array) -> None:
    """The desired velocity towards a place to pass, into `desired` (d,) [m/s]; `away` (d,) [m]: its displacement.

    At most `max_speed` [m/s]. `max_acceleration` [m/s^2] also bounds it on the arc from the present heading to the
    place, which has the radius distance / (2 sin angle).
    """
    square, speed, along = 0.0, 0.0, 0.0
    for axis in range(len(away)):
        square += away[axis] * away[axis]
        speed += velocity[axis] * velocity[axis]
        along += away[axis] * velocity[axis]
    distance = max(np.sqrt(square), 1e-12)
    cosine = along / (distance * max(np.sqrt(speed), 1e-12))
    sine = np.sqrt(max(1.0 - cosine * cosine, 0.0)) if cosine > 0.0 else 1.0
    slow = min(max_speed, np.sqrt(max_acceleration * distance / max(2.0 * sine, 1e-6)))
    for axis in range(len(away)):
        desired[axis] = away[axis] * slow / distance


@kernel
def time_to_rest(away: Array, velocity: Array, max_acceleration: float, braking: float, max_speed: float) -> float:
    """An estimate [s] of the time to rest at a place with displacement `away` (d,) [m], without obstacles.

    Exact on a line: the robot accelerates, moves at most at `max_speed` [m/s], and brakes by `braking` [m/s^2]. To lose
    a velocity v across the line takes v^2 / (a (2 w + v)), with the largest speed w on the way: v^2 / (2 a w) for a
    small one, v / a from rest.
    """
    square, speed, along = 0.0, 0.0, 0.0
    for axis in range(len(away)):
        square += away[axis] * away[axis]
        speed += velocity[axis] * velocity[axis]
        along += away[axis] * velocity[axis]
    distance = np.sqrt(square)
    along /= max(distance, 1e-12)
    across = np.sqrt(max(speed - along * along, 0.0))
    waiting = 0.0
    if along > 0.0 and along * along > 2.0 * braking * distance:
        # It passes the place, and comes back.
        waiting, distance, along = along / braking, 0.5 * along * along / braking - distance, 0.0
    top, both = max(max_speed, along), 1.0 / max_acceleration + 1.0 / braking
    left = distance + 0.5 * along * along / max_acceleration
    fastest = np.sqrt(2.0 * left / both)
    beyond = 0.0
    if fastest > top:
        fastest, beyond = top, (left - 0.5 * top * top * both) / top
    turning = across * across / (max_acceleration * (2.0 * fastest + across)) if across > 0.0 else 0.0
    return float(waiting + (fastest - along) / max_acceleration + beyond + fastest / braking + turning)


@kernel
def time_to_go(
    away: Array,
    velocity: Array,
    max_acceleration: float,
    braking: float,
    max_speed: float,
    tolerance: float,
    stop: bool,
) -> float:
    """An estimate [s] of the time to a goal with displacement `away` (d,) [m], without obstacles.

    `velocity` (d,) [m/s] relative to the goal; `tolerance` [m]; `stop`: whether to stop there.
    """
    if stop:
        return time_to_rest(away, velocity, max_acceleration, braking, max_speed)
    return earliest_arrival(away, velocity, max_acceleration, max_speed, 0.5 * tolerance)
