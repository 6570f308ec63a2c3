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

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.jit import kernel
from slalom.kernels.vehicle.wheels import CREEPING, Wheels

NODES, WEIGHTS = (0.5 * (1.0 + x) if k == 0 else 0.5 * x for k, x in enumerate(np.polynomial.legendre.leggauss(5)))
"""[1] Gauss quadrature on [0, 1] for the motion in a period; its error is of the order 10, far below a micrometre."""

UP_TO = (NODES[:, None] ** np.arange(1.0, 6.0) / np.arange(1.0, 6.0)) @ np.linalg.inv(NODES[:, None] ** np.arange(5.0))
"""[1] Weights (5, 5) of the integrals up to each node."""

TURN_STEPS: Final = 20
"""[1] Most steps of Newton's method for the turn in a period. It converges in 3 to 5. Larger: never needed. Smaller:
the velocity at the end of a period is not the commanded one."""

STEEPEST_COURSE: Final = 1.4
"""[rad] Largest angle between the heading of a bicycle and the velocity that its steering aims at, below pi / 2.
Larger: steering angles close to a right angle. Smaller: a very long steered point ahead of the front axle is not
used."""


FEEDBACK_TIME: Final = 0.4
"""[s] T, in which the error of a vehicle from its plan falls by 63 %, in addition to its lag; at least the period.
Longer: the vehicle is longer off its plan. Shorter: noise of measured poses turns it, by noise / (T lever) [rad/s]."""


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
        return executed(w, m, min(max(speed, slowest), fastest), turn)
    # Wheels with a lag would be commanded to a higher speed than the one that they are to reach.
    slowest = reached(m[3], -w.max_reverse, w.max_acceleration, h, w.lag)
    fastest = reached(m[3], w.max_axle, w.max_acceleration, h, w.lag)
    speed = min(max(speed, slowest), fastest)
    half = 0.5 * w.base
    left = m[3] - half * m[4]
    right = m[3] + half * m[4]
    low_left = reached(left, -w.max_speed, w.max_acceleration, h, w.lag)
    high_left = reached(left, w.max_speed, w.max_acceleration, h, w.lag)
    low_right = reached(right, -w.max_speed, w.max_acceleration, h, w.lag)
    high_right = reached(right, w.max_speed, w.max_acceleration, h, w.lag)
    difference = min(max(w.base * turn, low_right - high_left), high_right - low_left)
    if w.max_reverse < w.max_axle:
        # Where wheels change at their largest rate, their commands differ from those of the mean.
        apart = command_for(0.5 * (right - left), 0.5 * difference, w.max_acceleration, h, w.lag)
        low_left = max(low_left, reached(left, -w.max_reverse - apart, w.max_acceleration, h, w.lag))
        low_right = max(low_right, reached(right, apart - w.max_reverse, w.max_acceleration, h, w.lag))
    low = max(low_left, low_right - difference)
    high = min(high_left, high_right - difference)
    slower = min(max(speed - 0.5 * difference, low), high)
    return executed(w, m, slower + 0.5 * difference, difference / w.base)


@kernel
def executed(w: Wheels, m: Array, speed: float, turn: float) -> tuple[float, float]:
    """Speed and turn a period after the motion m, of those that the vehicle executes the nearest to these."""
    if w.min_speed == 0.0 and w.min_turn == 0.0:
        return speed, turn
    to_speed, to_turn = executable(w, m, speed, turn)
    return actuated(w, m, to_speed, to_turn, False)


@kernel
def executable(w: Wheels, m: Array, speed: float, turn: float) -> tuple[float, float]:
    """The command after which speed and turn are nearest to these, of those that are 0 or at least the least one."""
    to_speed, to_turn = actuated(w, m, speed, turn, True)
    if w.min_speed == 0.0 and w.min_turn == 0.0:
        return to_speed, to_turn
    best = np.inf
    found = to_speed, to_turn
    for k in range(4):
        tried = zero_or_least(to_speed, w.min_speed, k % 2), zero_or_least(to_turn, w.min_turn, k // 2)
        v, turned = actuated(w, m, tried[0], tried[1], False)
        off = abs(v - speed) + 0.5 * w.base * abs(turned - turn)
        if off < best:
            best = off
            found = tried
    return found


@kernel
def zero_or_least(command: float, least: float, share: float) -> float:
    """The command; below the least one that share of it, 0 or 1."""
    return command if abs(command) >= least else share * np.copysign(least, command)


@kernel
def actuated(w: Wheels, m: Array, speed: float, turn: float, inverse: bool) -> tuple[float, float]:
    """Speed and turn a period after the motion m (5,) under a command; with `inverse` the command for such ones."""
    rate = w.max_turn_change
    lag = w.turn_lag
    first = m[3]
    second = m[4]
    half = 0.0
    if not w.steered:
        # The actuators of a drive are its left and its right wheel.
        half = 0.5 * w.base
        rate = w.max_acceleration
        lag = w.lag
        first = m[3] - half * m[4]
        second = m[3] + half * m[4]
    to_first = speed - half * turn
    to_second = turn if w.steered else speed + half * turn
    if inverse:
        first = command_for(first, to_first, w.max_acceleration, w.period, w.lag)
        second = command_for(second, to_second, rate, w.period, lag)
    else:
        first = reached(first, to_first, w.max_acceleration, w.period, w.lag)
        second = reached(second, to_second, rate, w.period, lag)
    if w.steered:
        return first, second
    return 0.5 * (first + second), (second - first) / w.base


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
        if w.max_reverse < w.max_axle:
            # A drive turns by what it cannot drive backwards, as if that was to its side.
            c = np.cos(m[2])
            s = np.sin(m[2])
            excess = max(-w.max_reverse - (x * c + y * s), 0.0)
            aside = excess if y * c >= x * s else -excess
            x += excess * c - aside * s
            y += excess * s + aside * c
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


# Motions of vehicles along ways: arcs of one curvature, between which they stop, steer on, or turn on the spot.
#
# Let e be the distance of the axle from an arc, to the left, and f the heading relative to it; the driven distance is
# s. With a curvature k + u, k that of the arc, de/ds = g f and df/ds = g u, g = 1 forwards and -1 backwards. With u =
# -e / l^2 - 2 g f / l both errors fall as (1 + s / l) exp(-s / l).


FEEDBACK_WAY: Final = 0.5
"""[1] The least distance l in which errors fall, in wheelbases or tracks. Longer: wider errors. Shorter: rough
steering."""

FEEDBACK_SECONDS: Final = 0.6
"""[s] The distance l in seconds of driving. As of FEEDBACK_WAY."""

STEERED: Final = 0.02
"""[1] A vehicle that changes its direction starts when its steering is as near to that of the arc, in shares of it.
Larger: it leaves the arc. Smaller: it stands longer."""

BRAKING: Final = 0.8
"""[1] Share of the largest acceleration with which a vehicle on a way brakes. The rest is for errors."""


@kernel
def speed_to_stop(w: Wheels, left: float, acceleration: float) -> float:
    """Speed [m/s] from which a vehicle can stop within a distance [m], if it brakes from the next period on."""
    h = w.period
    return acceleration * float(np.sqrt(h * h + 2.0 * max(left, 0.0) / acceleration) - h)


@kernel
def curvature(arcs: Array, k: int) -> float:
    """Curvature [1/m] of the arc k; positive to the left of the heading when driven forwards."""
    return arcs[k, 1] / arcs[k, 0] if arcs[k, 0] != 0.0 else 0.0


@kernel
def change_way(arcs: Array, k: int, within: Array) -> tuple[float, float]:
    """The change of the curvature [1/m] after arc k, and the way [m] over which it makes the error of that arc."""
    change = abs(curvature(arcs, k + 1) - curvature(arcs, k))
    return change, float(np.sqrt(24.0 * within[k] / max(change, 1e-9)))


@kernel
def stops_after(w: Wheels, arcs: Array, k: int, within: Array, stops: bool, careful: bool) -> bool:
    """Whether a vehicle stands at the end of arc k: before changes of direction, turns on the spot, and at the end.

    Also before another curvature, if one of both arcs is shorter than half of the way over which it changes.
    careful: always there, so that it never leaves the arcs.
    """
    if k + 1 == len(arcs):
        return stops
    a = arcs[k, 0]
    b = arcs[k + 1, 0]
    if a * b <= 0.0:
        return True
    change, way = change_way(arcs, k, within)
    return change * w.base > STEERED and (careful or 2.0 * min(abs(a), abs(b)) < way)


@kernel
def on_arc(m: Array, pose: Array, length: float, turn: float, before: float) -> tuple[float, float, float]:
    """Driven distance [m] on an arc from a pose (3,), and the errors e [m] and f [rad] of a motion m (5,).

    before: [m] distance that was driven already, to tell full circles apart.
    """
    side = 1.0 if length > 0.0 else -1.0
    c = np.cos(pose[2])
    s = np.sin(pose[2])
    x = c * (m[0] - pose[0]) + s * (m[1] - pose[1])
    y = -s * (m[0] - pose[0]) + c * (m[1] - pose[1])
    k = turn / length
    if abs(turn) < 1e-9:
        return side * x, y, wrapped(m[2] - pose[2])
    # About the centre (0, 1 / k) the radius of the begin points to (0, -1 / k).
    angle = np.arctan2(x * k, 1.0 - y * k)
    driven = angle / k * side
    full = 2.0 * np.pi / abs(k)
    driven += full * np.floor((before - driven) / full + 0.5)
    away = np.hypot(x, y - 1.0 / k)
    error = 1.0 / k - away if k > 0.0 else 1.0 / k + away
    return driven, error, wrapped(m[2] - pose[2] - k * side * driven)


@kernel
def at_end(h: float, left: float, v: float, most: float, wanted: float, least: float, within: float) -> bool:
    """Whether an arc has ended: a vehicle that brakes now, by `most`, ends `within` what is left of it.

    Also one whose next speed, `wanted`, is nearer to 0 than to the least one that it executes.
    """
    near = max(within, abs(left)) if wanted < 0.5 * least else within
    return left <= near and abs(v) * (0.5 * h + abs(v) / (2.0 * most)) <= near + max(left, 0.0)


@kernel
def put_spot_turn(w: Wheels, m: Array, pose: Array, turn: float, within: float, result: Array) -> bool:
    """The motion of a period that turns on the spot towards the end of a turn; whether it has ended already."""
    left = wrapped(pose[2] - m[2])
    if left * turn < 0.0 and abs(left) > 0.5 * np.pi:
        left += 2.0 * np.pi if turn > 0.0 else -2.0 * np.pi
    most = BRAKING * w.max_turn_change
    size = speed_to_stop(w, abs(left) - 0.5 * w.period * abs(m[4]), most)
    if at_end(w.period, abs(left), m[4], most, size, w.min_turn, within):
        return True
    # The wheels brake first: what is left of their acceleration turns.
    spare = 2.0 / w.base * max(w.max_acceleration * w.period - abs(m[3]), 0.0)
    rate = min(max(size if left > 0.0 else -size, m[4] - spare), m[4] + spare)
    v, rate = within_limits(w, m, 0.0, rate)
    drive(w, m, v, rate, 0.0, 1.0, result)
    return False


@kernel
def allowed_on_arc(
    w: Wheels, arcs: Array, k: int, within: Array, left: float, v: float, fastest: float, stops: bool, careful: bool
) -> tuple[float, float]:
    """Largest speed [m/s] with a distance `left` [m] on arc k at the speed v, and the curvature [1/m] to steer to.

    The vehicle can stop where it has to, steers into the next arcs with an error of `within` at most, and keeps the
    largest acceleration in turns.
    """
    h = w.period
    a = BRAKING * w.max_acceleration
    bend = curvature(arcs, k)
    speed = fastest if arcs[k, 0] > 0.0 else min(fastest, w.max_reverse)
    if bend != 0.0:
        speed = min(speed, np.sqrt(w.max_acceleration / abs(bend)))
    rest = left
    j = k
    ends = stops_after(w, arcs, k, within, stops, careful)
    while not ends and j + 1 < len(arcs):
        after = curvature(arcs, j + 1)
        change, way = change_way(arcs, j, within)
        time = h + w.lag + w.turn_lag
        if w.steered:
            turn = abs(np.arctan(w.base * after) - np.arctan(w.base * curvature(arcs, j)))
            time += turn / w.max_turn_change
        else:
            time += change * fastest / w.max_turn_change
        slow = max(way / time, w.min_speed)
        if j == k and left < 0.5 * min(max(v, 0.0) * time, way):
            bend = after
        speed = min(speed, np.sqrt(slow * slow + 2.0 * a * max(rest - 0.5 * way, 0.0)))
        if after != 0.0:
            speed = min(speed, np.sqrt(w.max_acceleration / abs(after) + 2.0 * a * rest))
        j += 1
        rest += abs(arcs[j, 0])
        ends = stops_after(w, arcs, j, within, stops, careful)
    if ends:
        speed = min(speed, speed_to_stop(w, rest - 0.5 * h * max(v, 0.0), a))
    return speed, bend


@kernel
def put_on_arc(w: Wheels, m: Array, side: float, speed: float, bend: float, e: float, f: float, result: Array) -> None:
    """The motion of a period at a speed [m/s] to a curvature [1/m], with the correction of errors e [m] and f [rad]."""
    v = abs(m[3])
    reach = max(FEEDBACK_WAY * w.base, FEEDBACK_SECONDS * v)
    bend += -e / (reach * reach) - 2.0 * side * f / reach
    turn = bend * side * speed
    if w.steered:
        turn = np.arctan(w.base * bend)
        limited = min(max(turn, -w.max_turn), w.max_turn)
        near = STEERED * w.max_turn + 0.5 * w.max_turn_change * w.period
        if v < w.max_acceleration * w.period and abs(limited - m[4]) > near:
            speed = 0.0
    v, turn = within_limits(w, m, side * speed, turn)
    drive(w, m, v, turn, 0.0, 1.0, result)


@kernel
def along_way(
    w: Wheels,
    start: Array,
    arcs: Array,
    poses: Array,
    within: Array,
    first: int,
    before: float,
    fastest: float,
    stops: bool,
    careful: bool,
    count: int,
) -> tuple[Array, Indices, Array]:
    """Motions (count + 1, 5) of a vehicle along a way, the arc (count + 1,) it is on then, and the distance there [m].

    Args:
        arcs: (n, 2) length [m] and turn [rad]. poses: (n + 1, 3) at their begins, and at the end.
        within: (n,) error of each arc [m], of a turn on the spot [rad]: at its end, and of the steering into the next.
        first: the arc that it is on at the start, and the distance `before` [m] that it has driven there.
        fastest: [m/s]. stops: whether it stands at the end; else it drives on straight. careful: see `stops_after`.
    """
    motions = np.empty((count + 1, 5))
    at = np.empty(count + 1, np.int64)
    driven = np.empty(count + 1)
    motions[0] = start
    k = first
    s = before
    at[0] = k
    driven[0] = s
    row = 0
    while row < count:
        m = motions[row]
        result = motions[row + 1]
        ended = False
        if k == len(arcs):
            v, turn = within_limits(w, m, 0.0 if stops else fastest, m[4] if w.steered and stops else 0.0)
            drive(w, m, v, turn, 0.0, 1.0, result)
        elif arcs[k, 0] == 0.0:
            ended = put_spot_turn(w, m, poses[k + 1], arcs[k, 1], within[k], result)
        else:
            side = 1.0 if arcs[k, 0] > 0.0 else -1.0
            s, e, f = on_arc(m, poses[k], arcs[k, 0], arcs[k, 1], s)
            left = abs(arcs[k, 0]) - s
            v = side * m[3]
            ended = left < 0.0
            if stops_after(w, arcs, k, within, stops, careful):
                most = BRAKING * w.max_acceleration
                size = speed_to_stop(w, left - 0.5 * w.period * max(v, 0.0), most)
                ended = at_end(w.period, left, v, most, size, w.min_speed, within[k])
            if not ended:
                speed, bend = allowed_on_arc(w, arcs, k, within, left, v, fastest, stops, careful)
                put_on_arc(w, m, side, speed, bend, e, f, result)
        if ended:
            k += 1
            s = 0.0
        else:
            row += 1
            at[row] = k
            driven[row] = s
    return motions, at, driven
