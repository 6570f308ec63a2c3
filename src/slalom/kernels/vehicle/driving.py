"""Motions of vehicles on wheels: commands within their limits, that follow a plan or hold a speed and a turn.

A motion is a row (5,): x, y [m] of the middle of the axle (of a bicycle, the rear one), heading [rad], speed [m/s]
along it, and turn: the turn rate [rad/s] of a differential drive, the steering angle [rad] of a bicycle.

Let f be the velocity of the point `lever` ahead of the axle at the end of a period h, q(t) the velocity of a plan, e
and d the errors of position and velocity at the start. A motion that reaches q(t + h) has the error e + h d / 2 then.
The motion that follows the plan has f = q(t + h) - (e + h d / 2) / T: errors fall by 1 - h / T in each period.

An actuator with the lag T approaches its command u as ds/dt = (u - s) / T, by at most its largest rate. Without lag it
reaches the command at the end of the period, at a constant rate.
"""

from typing import Final

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.jit import kernel
from slalom.kernels.vehicle.wheels import CREEPING, Wheels

NODES, WEIGHTS = (0.5 * (1.0 + x) if k == 0 else 0.5 * x for k, x in enumerate(np.polynomial.legendre.leggauss(5)))
"""[1] Gauss quadrature on [0, 1] for the motion in a period; its error is of the order 10, far below a micrometre."""

UP_TO = (NODES[:, None] ** np.arange(1.0, 6.0) / np.arange(1.0, 6.0)) @ np.linalg.inv(NODES[:, None] ** np.arange(5.0))
"""[1] Weights (5, 5) of the integrals up to each node."""

TURN_STEPS: Final = 20
"""[1] Most steps of Newton's method for the turn in a period. It converges in 3 to 5.

Larger: never needed. Smaller: the velocity at the end of a period is not the commanded one.
"""

STEEPEST_COURSE: Final = 1.4
"""[rad] Largest angle between the heading of a bicycle and the velocity that its steering aims at, below pi / 2.

Larger: steering angles close to a right angle. Smaller: a very long steered point ahead of the front axle is not used.
"""


FEEDBACK_TIME: Final = 0.4
"""[s] T, in which the error of a vehicle from its plan falls by 63 %, in addition to its lag; at least the period.

Longer: the vehicle is longer off its plan. Shorter: noise of measured poses turns it, by noise / (T lever) [rad/s].
"""


@kernel
def wrapped(angle: float) -> float:
    """The angle [rad] within [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


@kernel
def share_of_lag(time: float, lag: float) -> float:
    """The share of the way to a command that an actuator has passed after a `time` [s]."""
    return 1.0 if lag <= 0.0 else 1.0 - np.exp(-time / lag)


@kernel
def reached(start: float, command: float, rate: float, h: float, lag: float) -> float:
    """The value of an actuator after h [s] under a command: within its `rate` [1/s], and with its lag [s]."""
    change = command - start
    size = abs(change)
    if lag <= 0.0:
        size = min(size, rate * h)
    elif size > rate * lag:
        # First at the largest rate, until the lag alone changes it more slowly.
        steady = min(h, size / rate - lag)
        size = rate * steady + rate * lag * share_of_lag(h - steady, lag)
    else:
        size *= share_of_lag(h, lag)
    return start + size if change > 0.0 else start - size


@kernel
def command_for(start: float, end: float, rate: float, h: float, lag: float) -> float:
    """The command after which an actuator has the value `end` in h [s]: the inverse of `reached`."""
    change = abs(end - start)
    if lag <= 0.0 or change == 0.0:
        return end
    size = change / share_of_lag(h, lag)
    if size > rate * lag:
        low, high = 0.0, h
        for _ in range(60):
            steady = 0.5 * (low + high)
            if rate * steady + rate * lag * share_of_lag(h - steady, lag) < change:
                low = steady
            else:
                high = steady
        size = rate * (lag + 0.5 * (low + high))
    return start + size if end > start else start - size


@kernel
def turn_rate(w: Wheels, speed: float, turn: float) -> float:
    """Rate [rad/s] of the heading."""
    return speed * np.tan(turn) / w.base if w.steered else turn


@kernel
def profile(w: Wheels, lag: float, share: float) -> float:
    """The share of the change in a period that an actuator has passed after a `share` of the time."""
    if lag <= 0.0:
        return share
    return share_of_lag(share * w.period, lag) / share_of_lag(w.period, lag)


@kernel
def drive(w: Wheels, m: Array, speed: float, turn: float, begin: float, end: float, result: Array) -> None:
    """The motion at the share `end` of a period, of one that is in m (5,) at the share `begin`, into result (5,).

    speed, turn: those at the end of the period. `m` and `result` may be the same.
    """
    h = w.period * (end - begin)
    first = profile(w, w.lag, begin)
    first_turn = profile(w, w.turn_lag, begin)
    speeds = np.empty(6)
    turns = np.empty(6)
    for k in range(6):
        share = begin + (end - begin) * (NODES[k] if k < 5 else 1.0)
        a = (profile(w, w.lag, share) - first) / (1.0 - first)
        b = (profile(w, w.turn_lag, share) - first_turn) / (1.0 - first_turn)
        speeds[k] = m[3] + a * (speed - m[3])
        turns[k] = m[4] + b * (turn - m[4])
    rates = np.empty(5)
    for k in range(5):
        rates[k] = turn_rate(w, speeds[k], turns[k])
    x = 0.0
    y = 0.0
    heading = 0.0
    for k in range(5):
        angle = 0.0
        for j in range(5):
            angle += UP_TO[k, j] * rates[j]
        angle = m[2] + h * angle
        x += WEIGHTS[k] * speeds[k] * np.cos(angle)
        y += WEIGHTS[k] * speeds[k] * np.sin(angle)
        heading += WEIGHTS[k] * rates[k]
    result[0] = m[0] + h * x
    result[1] = m[1] + h * y
    result[2] = m[2] + h * heading
    result[3] = speeds[5]
    result[4] = turns[5]


@kernel
def within_limits(w: Wheels, m: Array, speed: float, turn: float) -> tuple[float, float]:
    """Speed and turn at the end of a period, within all limits: the nearest turn, and then the nearest speed."""
    h = w.period
    low = reached(m[4], -w.max_turn, w.max_turn_change, h, w.turn_lag)
    high = reached(m[4], w.max_turn, w.max_turn_change, h, w.turn_lag)
    turn = min(max(turn, low), high)
    if w.steered:
        slowest = reached(m[3], -w.max_reverse, w.max_acceleration, h, w.lag)
        fastest = reached(m[3], w.max_speed, w.max_acceleration, h, w.lag)
        return min(max(speed, slowest), fastest), turn
    half = 0.5 * w.base
    left = m[3] - half * m[4]
    right = m[3] + half * m[4]
    low_left = reached(left, -w.max_speed, w.max_acceleration, h, w.lag)
    high_left = reached(left, w.max_speed, w.max_acceleration, h, w.lag)
    low_right = reached(right, -w.max_speed, w.max_acceleration, h, w.lag)
    high_right = reached(right, w.max_speed, w.max_acceleration, h, w.lag)
    difference = min(max(w.base * turn, low_right - high_left), high_right - low_left)
    low = max(low_left, low_right - difference)
    high = min(high_left, high_right - difference)
    slower = min(max(speed - 0.5 * difference, low), high)
    return slower + 0.5 * difference, difference / w.base


@kernel
def commanded(w: Wheels, m: Array, speed: float, turn: float) -> tuple[float, float]:
    """The command after which speed and turn are reached at the end of a period from the motion m (5,)."""
    h = w.period
    if w.steered:
        return (
            command_for(m[3], speed, w.max_acceleration, h, w.lag),
            command_for(m[4], turn, w.max_turn_change, h, w.turn_lag),
        )
    half = 0.5 * w.base
    left = command_for(m[3] - half * m[4], speed - half * turn, w.max_acceleration, h, w.lag)
    right = command_for(m[3] + half * m[4], speed + half * turn, w.max_acceleration, h, w.lag)
    return 0.5 * (left + right), (right - left) / w.base


@kernel
def reached_after(w: Wheels, m: Array, speed: float, turn: float) -> tuple[float, float]:
    """Speed and turn at the end of a period under a command, of a vehicle in the motion m (5,)."""
    h = w.period
    if w.steered:
        return (
            reached(m[3], speed, w.max_acceleration, h, w.lag),
            reached(m[4], turn, w.max_turn_change, h, w.turn_lag),
        )
    half = 0.5 * w.base
    left = reached(m[3] - half * m[4], speed - half * turn, w.max_acceleration, h, w.lag)
    right = reached(m[3] + half * m[4], speed + half * turn, w.max_acceleration, h, w.lag)
    return 0.5 * (left + right), (right - left) / w.base


@kernel
def point_velocity(w: Wheels, m: Array) -> tuple[float, float]:
    """Velocity [m/s] of the point ahead of the axle."""
    c = np.cos(m[2])
    s = np.sin(m[2])
    sideways = w.lever * turn_rate(w, m[3], m[4])
    return m[3] * c - sideways * s, m[3] * s + sideways * c


@kernel
def aimed(w: Wheels, m: Array, x: float, y: float) -> tuple[float, float]:
    """Speed and turn with which the velocity of the point is (x, y) [m/s], or as near to it as the vehicle can be."""
    half = 0.5 * w.period
    turn = m[4]
    if not w.steered:
        for _ in range(TURN_STEPS):
            angle = m[2] + half * (m[4] + turn)
            c = np.cos(angle)
            s = np.sin(angle)
            change = (w.lever * turn - (y * c - x * s)) / max(w.lever + half * (x * c + y * s), 0.5 * w.lever)
            turn -= change
            if abs(change) <= 1e-15 * (1.0 + abs(turn)):
                break
        angle = m[2] + half * (m[4] + turn)
        return x * np.cos(angle) + y * np.sin(angle), turn
    share = w.lever / w.base
    size = np.hypot(x, y)
    speed = x * np.cos(m[2]) + y * np.sin(m[2])
    # Backwards the velocity is opposite to the course.
    side = -1.0 if speed < 0.0 < w.max_reverse else 1.0
    speed = side * max(0.0, side * speed)
    if size < CREEPING:
        return speed, turn
    course = np.arctan2(side * y, side * x)
    before = turn_rate(w, m[3], m[4])
    for _ in range(TURN_STEPS):
        middle = turn_rate(w, 0.5 * (m[3] + speed), 0.5 * (m[4] + turn))
        # Simpson's rule for the change of the heading.
        turned = half / 3.0 * (before + 4.0 * middle + turn_rate(w, speed, turn))
        angle = min(max(wrapped(course - m[2] - turned), -STEEPEST_COURSE), STEEPEST_COURSE)
        last = turn
        turn = min(max(np.arctan(np.tan(angle) / share), -w.max_turn), w.max_turn)
        speed = side * max(0.0, size * np.cos(angle))
        if abs(turn - last) <= 1e-14:
            break
    return speed, turn


@kernel
def follow(w: Wheels, start: Array, planned: Array) -> Array:
    """Motions (n, 5) at the ends of all periods of a vehicle that follows a plan of its point.

    planned: (n, 4) position [m] and velocity [m/s] of the plan at these times.
    """
    h = w.period
    time = max(h, FEEDBACK_TIME + max(w.lag, w.turn_lag))
    motions = np.empty((len(planned), 5))
    motions[0] = start
    for k in range(len(planned) - 1):
        m = motions[k]
        vx, vy = point_velocity(w, m)
        x = (m[0] + w.lever * np.cos(m[2]) - planned[k, 0] + 0.5 * h * (vx - planned[k, 2])) / time
        y = (m[1] + w.lever * np.sin(m[2]) - planned[k, 1] + 0.5 * h * (vy - planned[k, 3])) / time
        share = min(1.0, w.max_acceleration * h / max(np.hypot(x, y), 1e-300))
        speed, turn = aimed(w, m, planned[k + 1, 2] - share * x, planned[k + 1, 3] - share * y)
        speed, turn = within_limits(w, m, speed, turn)
        drive(w, m, speed, turn, 0.0, 1.0, motions[k + 1])
    return motions


@kernel
def held(w: Wheels, start: Array, speed: float, turn: float, periods: int, count: int) -> Array:
    """Motions (count + 1, 5) of a vehicle that holds a speed and a turn for some periods, and then brakes to rest."""
    motions = np.empty((count + 1, 5))
    motions[0] = start
    for k in range(count):
        m = motions[k]
        keeps = turn
        if k >= periods and m[3] == 0.0 and m[4] == 0.0:
            motions[k + 1] = m
            continue
        if k >= periods:
            # A drive that brakes keeps its curvature, a bicycle its steering angle.
            speed = 0.0
            ahead, _ = within_limits(w, m, 0.0, m[4])
            keeps = m[4]
            if not w.steered:
                keeps = m[4] * ahead / m[3] if abs(m[3]) > CREEPING else 0.0
        v, turned = within_limits(w, m, speed, keeps)
        drive(w, m, v, turned, 0.0, 1.0, motions[k + 1])
    return motions


@kernel
def sampled(w: Wheels, motions: Array, parts: int, radius: float) -> Array:
    """Motions (n, 7) in `parts` of each period: x, y [m], heading [rad], their rates, and the way from there.

    radius: [m] of the body about the middle of the axle. No point of it moves farther than the way [m] up to the next
    row.
    """
    n = len(motions) - 1
    found = np.empty((n * parts + 1, 7))
    m = motions[0].copy()
    step = w.period / parts
    for k in range(n):
        m[:] = motions[k]
        for j in range(parts):
            row = found[k * parts + j]
            put_rates(w, m, row)
            v = abs(m[3])
            turn = abs(m[4])
            drive(w, m, motions[k + 1, 3], motions[k + 1, 4], j / parts, (j + 1.0) / parts, m)
            v = max(v, abs(m[3]))
            row[6] = (v + radius * abs(turn_rate(w, v, max(turn, abs(m[4]))))) * step
    put_rates(w, motions[n], found[n * parts])
    found[n * parts, 6] = 0.0
    return found


@kernel
def put_rates(w: Wheels, m: Array, row: Array) -> None:
    """Position and heading of the motion m (5,), and their rates, into the row (7,)."""
    row[0] = m[0]
    row[1] = m[1]
    row[2] = m[2]
    row[3] = m[3] * np.cos(m[2])
    row[4] = m[3] * np.sin(m[2])
    row[5] = turn_rate(w, m[3], m[4])
