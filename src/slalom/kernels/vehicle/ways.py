"""Motions of vehicles along ways: arcs of one curvature, between which they stop, steer on, or turn on the spot.

Let e be the distance of the axle from an arc, to the left, and f the heading relative to it; the driven distance is s.
With a curvature k + u, k that of the arc, de/ds = g f and df/ds = g u, g = 1 forwards and -1 backwards. With
u = -e / l^2 - 2 g f / l both errors fall as (1 + s / l) exp(-s / l).
"""

from typing import Final

import numpy as np

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.jit import kernel
from slalom.kernels.vehicle.driving import drive, within_limits, wrapped
from slalom.kernels.vehicle.wheels import Wheels

FEEDBACK_WAY: Final = 0.5
"""[1] The least distance l in which errors fall, in wheelbases or tracks.

Longer: wider errors. Shorter: rough steering.
"""

FEEDBACK_SECONDS: Final = 0.6
"""[s] The distance l in seconds of driving. As of FEEDBACK_WAY."""

STEERED: Final = 0.02
"""[1] A vehicle that changes its direction starts when its steering is as near to that of the arc, in shares of it.

Larger: it leaves the arc. Smaller: it stands longer.
"""

ENDED: Final = 0.002
"""[1] An arc is driven up to this distance from its end, in wheelbases or tracks; turns on the spot up to this in rad.

Larger: vehicles end farther from their goals. Smaller: they creep longer.
"""

OFF_BY: Final = 0.005
"""[1] Error that steering into the next arc may make, in wheelbases or tracks: a limit of the speed there.

Larger: faster, farther from the way. Smaller: slower.
"""

BRAKING: Final = 0.8
"""[1] Share of the largest acceleration with which a vehicle on a way brakes. The rest is for errors."""


@kernel
def speed_to_stop(w: Wheels, left: float, acceleration: float, lag: float) -> float:
    """Speed [m/s] from which a vehicle can stop within a distance [m], if it brakes from the next period on."""
    time = w.period + lag
    return acceleration * float(np.sqrt(time * time + 2.0 * max(left, 0.0) / acceleration) - time)


@kernel
def curvature(arcs: Array, k: int) -> float:
    """Curvature [1/m] of the arc k; positive to the left of the heading when driven forwards."""
    return arcs[k, 1] / arcs[k, 0] if arcs[k, 0] != 0.0 else 0.0


@kernel
def stops_after(w: Wheels, arcs: Array, k: int, stops: bool, careful: bool) -> bool:
    """Whether a vehicle stands at the end of arc k: before changes of direction, turns on the spot, and at the end.

    careful: also before other curvatures, so that it never leaves the arcs.
    """
    if k + 1 == len(arcs):
        return stops
    a = arcs[k, 0]
    b = arcs[k + 1, 0]
    turns = abs(curvature(arcs, k) - curvature(arcs, k + 1)) * w.base > STEERED
    return a == 0.0 or b == 0.0 or a * b < 0.0 or (careful and turns)


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
def put_spot_turn(w: Wheels, m: Array, pose: Array, turn: float, result: Array) -> bool:
    """The motion of a period that turns on the spot towards the end of a turn; whether it has ended already."""
    left = wrapped(pose[2] - m[2])
    if left * turn < 0.0 and abs(left) > 0.5 * np.pi:
        left += 2.0 * np.pi if turn > 0.0 else -2.0 * np.pi
    if abs(left) < ENDED and abs(m[4]) < 2.0 * ENDED / w.period:
        return True
    size = speed_to_stop(w, abs(left) - 0.5 * w.period * abs(m[4]), BRAKING * w.max_turn_change, w.turn_lag)
    v, rate = within_limits(w, m, 0.0, size if left > 0.0 else -size)
    drive(w, m, v, rate, 0.0, 1.0, result)
    return False


@kernel
def allowed_on_arc(
    w: Wheels, arcs: Array, k: int, left: float, v: float, fastest: float, stops: bool, careful: bool
) -> tuple[float, float]:
    """Largest speed [m/s] with a distance `left` [m] on arc k at the speed v, and the curvature [1/m] to steer to.

    The vehicle can stop where it has to, steers into the next arcs with an error of OFF_BY at most, and keeps the
    largest acceleration in turns.
    """
    h = w.period
    a = BRAKING * w.max_acceleration
    bend = curvature(arcs, k)
    speed = fastest if arcs[k, 0] > 0.0 or not w.steered else min(fastest, w.max_reverse)
    if bend != 0.0:
        speed = min(speed, np.sqrt(w.max_acceleration / abs(bend)))
    rest = left
    j = k
    ends = stops_after(w, arcs, k, stops, careful)
    while not ends and j + 1 < len(arcs):
        after = curvature(arcs, j + 1)
        change = abs(after - curvature(arcs, j))
        time = h + w.lag + w.turn_lag
        if w.steered:
            turn = abs(np.arctan(w.base * after) - np.arctan(w.base * curvature(arcs, j)))
            time += turn / w.max_turn_change
        else:
            time += change * fastest / w.max_turn_change
        slow = np.sqrt(24.0 * OFF_BY * w.base / max(change, 1e-9)) / time
        if j == k and left < 0.5 * max(v, 0.0) * time:
            bend = after
        speed = min(speed, np.sqrt(slow * slow + 2.0 * a * rest))
        if after != 0.0:
            speed = min(speed, np.sqrt(w.max_acceleration / abs(after) + 2.0 * a * rest))
        j += 1
        rest += abs(arcs[j, 0])
        ends = stops_after(w, arcs, j, stops, careful)
    if ends:
        speed = min(speed, speed_to_stop(w, rest - 0.5 * h * max(v, 0.0), a, w.lag))
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
            ended = put_spot_turn(w, m, poses[k + 1], arcs[k, 1], result)
        else:
            side = 1.0 if arcs[k, 0] > 0.0 else -1.0
            s, e, f = on_arc(m, poses[k], arcs[k, 0], arcs[k, 1], s)
            left = abs(arcs[k, 0]) - s
            v = side * m[3]
            ends = stops_after(w, arcs, k, stops, careful)
            near = ENDED * w.base
            ended = left < (near if ends else 0.0) and (not ends or abs(v) * w.period < near)
            if not ended:
                speed, bend = allowed_on_arc(w, arcs, k, left, v, fastest, stops, careful)
                put_on_arc(w, m, side, speed, bend, e, f, result)
        if ended:
            k += 1
            s = 0.0
        else:
            row += 1
            at[row] = k
            driven[row] = s
    return motions, at, driven
