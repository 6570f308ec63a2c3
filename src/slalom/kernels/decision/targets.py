"""Targets at rest or in motion: their positions, the velocity that leads to them, the time to reach them."""

from typing import Final

import numpy as np

from slalom.base.tolerances import ADMISSIBLE, BRAKING_SHARE, REST
from slalom.kernels.arrays import Array, Indices
from slalom.kernels.decision.tables import FOLLOW_VELOCITY, ResponseTable, Robot, RobotTable, Scratch, TargetPaths
from slalom.kernels.geometry.cubic import slope, value
from slalom.kernels.jit import inlined, kernel, squared

# Earliest arrival of a point that accelerates and then coasts; desired velocity; estimate of the time to the goal.


ARRIVAL_FIRST: Final = 1e-3
"""[s] First of the times between which an earliest arrival is sought. Larger: arrivals before it are rounded up.
Smaller: more times."""

ARRIVAL_RATIO: Final = 1.05
"""[1] Ratio of successive times of that list. Larger: two arrivals may lie in one interval. Smaller: more times."""

ARRIVAL_COUNT: Final = 424
"""[1] Number of these ratios: the last time is about 1e6 s. Smaller: later arrivals count as never."""


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
    square = 0.0
    speed = 0.0
    final = 0.0
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


@inlined
def products(away: Array, velocity: Array) -> tuple[float, float, float]:
    """The square of a displacement (d,), that of a velocity (d,), and their scalar product."""
    square = 0.0
    speed = 0.0
    along = 0.0
    for axis in range(len(away)):
        square += away[axis] * away[axis]
        speed += velocity[axis] * velocity[axis]
        along += away[axis] * velocity[axis]
    return square, speed, along


@kernel
def earliest_arrival(away: Array, v: Array, max_acceleration: float, max_speed: float, tolerance: float) -> float:
    """Earliest time [s] at which a point gets within `tolerance` [m] of the displacement `away` (d,) [m]; inf if never.

    The point has the velocity v (d,) [m/s]. It accelerates once by at most `max_acceleration` [m/s^2] and then coasts,
    at most at `max_speed` [m/s] or at its present speed.
    """
    square, speed, _ = products(away, v)
    distance = np.sqrt(square)
    if distance <= tolerance:
        return 0.0
    # On the way the point is never faster than at its start or end.
    least = (distance - tolerance) / max(max_speed, np.sqrt(speed)) * (1.0 - 1e-6)
    k = np.searchsorted(ARRIVAL_TIMES, least)
    while (
        k < len(ARRIVAL_TIMES) and speed_excess(away, v, max_acceleration, max_speed, tolerance, ARRIVAL_TIMES[k]) > 0.0
    ):
        k += 1
    if k == len(ARRIVAL_TIMES):
        return np.inf
    early = float(ARRIVAL_TIMES[k] / ARRIVAL_RATIO)
    late = float(ARRIVAL_TIMES[k])
    for _ in range(30):
        middle = 0.5 * (early + late)
        if speed_excess(away, v, max_acceleration, max_speed, tolerance, middle) <= 0.0:
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
    square, speed, along = products(away, velocity)
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
    square, speed, along = products(away, velocity)
    distance = np.sqrt(square)
    along /= max(distance, 1e-12)
    across = np.sqrt(max(speed - along * along, 0.0))
    waiting = 0.0
    if along > 0.0 and along * along > 2.0 * braking * distance:
        # It passes the place, and comes back.
        waiting = along / braking
        distance = 0.5 * along * along / braking - distance
        along = 0.0
    top = max(max_speed, along)
    both = 1.0 / max_acceleration + 1.0 / braking
    left = distance + 0.5 * along * along / max_acceleration
    fastest = np.sqrt(2.0 * left / both)
    beyond = 0.0
    if fastest > top:
        fastest = top
        beyond = (left - 0.5 * top * top * both) / top
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


INTERCEPTION_STEPS: Final = 4
"""[1] Iterations that find where a robot at maximum speed meets a moving goal. Larger: exact for goals that turn
quickly. Smaller: the robot moves to a place that the goal passes at another time."""

INTERCEPTION_WAIT: Final = 10.0
"""[s] Largest growth of the time of an interception in its first iteration: goals may outrun the robot. Larger: the
robot moves to a far future place of a goal that it cannot reach. Smaller: more iterations are needed."""


@inlined
def piece_of(times: Array, first: Indices, i: int, t: float) -> int:
    """The last piece of row i that begins at time t or before; pieces k of row i begin at times[k + i], one more ends.

    Row i has the pieces first[i] to first[i + 1].
    """
    low = first[i]
    high = first[i + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if times[middle + i] <= t:
            low = middle
        else:
            high = middle
    return int(low)


@kernel
def moving_target(i: int, t: float, targets: TargetPaths, position: Array, velocity: Array) -> None:
    """Write the position (3,) [m] and velocity (3,) [m/s] of the moving target of robot i at time t [s]."""
    begin = targets.times[targets.first[i] + i]
    end = targets.times[targets.first[i + 1] + i]
    at = min(max(t, begin), end)
    low = piece_of(targets.times, targets.first, i, at)
    width = targets.times[low + i + 1] - targets.times[low + i]
    x = (at - targets.times[low + i]) / width
    moves = begin <= t <= end
    for axis in range(3):
        p = targets.points[low, :, axis]
        position[axis] = value(p[0], p[1], p[2], p[3], x)
        velocity[axis] = slope(p[0], p[1], p[2], p[3], x) / width if moves else 0.0


@inlined
def target_state(i: int, t: float, robots: RobotTable, targets: TargetPaths, position: Array, velocity: Array) -> None:
    """Write the position (3,) [m] and velocity (3,) [m/s] of the target of robot i at time t [s]."""
    robot = robots.each[i]
    if robot.moving:
        moving_target(i, t, targets, position, velocity)
        return
    for axis in range(3):
        position[axis] = robot.target[axis]
        velocity[axis] = 0.0


@kernel
def intercept(i: int, t: float, position: Array, max_speed: float, targets: TargetPaths, scratch: Scratch) -> None:
    """Write the place at which robot i meets its moving target into `scratch.target`.

    The robot is at `position` (d,) [m] and at max speed from t [s] on. Fixed-point iteration on the time of arrival,
    which is bounded for targets that outrun the robot.
    """
    duration = 0.0
    for _ in range(INTERCEPTION_STEPS):
        moving_target(i, t + duration, targets, scratch.target, scratch.target_velocity)
        square = 0.0
        for axis in range(len(position)):
            square += squared(scratch.target[axis] - position[axis])
        duration = min(np.sqrt(square) / max_speed, 2.0 * duration + INTERCEPTION_WAIT)
    moving_target(i, t + duration, targets, scratch.target, scratch.target_velocity)


@inlined
def rests_within(robot: Robot, away: Array, velocity: Array, step: float) -> bool:
    """Whether a robot that brakes evenly rests at its target after `step` [s]; with a step of 0: whether it rests now.

    `away` (d,) [m]: the displacement of the target, `velocity` (d,) [m/s] relative to it.
    """
    square = 0.0
    speed = 0.0
    for axis in range(len(away)):
        square += squared(away[axis] - 0.5 * step * velocity[axis])
        speed += squared(velocity[axis])
    return bool(square <= squared(robot.tolerance) and speed <= squared(REST + step * robot.stopping / BRAKING_SHARE))


@inlined
def desired_velocity(
    i: int,
    t: float,
    step: float,
    position: Array,
    velocity: Array,
    robots: RobotTable,
    targets: TargetPaths,
    scratch: Scratch,
) -> None:
    """Write the velocity (d,) [m/s] that leads robot i from this state at time t [s] to its target.

    It goes into `scratch.desired_velocity`. To stop at the target: the velocity to have after `step` [s], from which
    the robot comes to rest there; a robot at its target brakes to rest within one step where it can. The rule is that
    of `slalom.model.goal.Goal.desired_velocity`. A robot that follows a velocity desires that one.
    """
    robot = robots.each[i]
    away = scratch.displacement
    desired = scratch.desired_velocity
    top = robot.max_speed
    if robot.objective == FOLLOW_VELOCITY:
        for axis in range(len(position)):
            desired[axis] = robot.wanted[axis]
        return
    if not robot.stop:
        if robot.moving:
            intercept(i, t, position, top, targets, scratch)
        else:
            target_state(i, t, robots, targets, scratch.target, scratch.target_velocity)
        for axis in range(len(position)):
            away[axis] = scratch.target[axis] - position[axis]
        passing_velocity(away, velocity, robot.max_acceleration, top, desired)
        return
    target_state(i, t, robots, targets, scratch.target, scratch.target_velocity)
    for axis in range(len(position)):
        away[axis] = scratch.target[axis] - position[axis]
        desired[axis] = velocity[axis] - scratch.target_velocity[axis]
    resting = rests_within(robot, away, desired, step)
    square = 0.0
    for axis in range(len(position)):
        square += squared(away[axis])
    resting = resting and square <= squared(robot.tolerance)
    square = 0.0
    target_state(i, t + step, robots, targets, scratch.target, scratch.target_velocity)
    for axis in range(len(position)):
        mean = 0.5 * (velocity[axis] + scratch.target_velocity[axis])
        away[axis] = scratch.target[axis] - position[axis] - step * mean
        square += away[axis] * away[axis]
    left = max(np.sqrt(square), 1e-300)
    speed = 0.0 if resting else min(stopping_speed(left, step, robot.stopping), top)
    square = 0.0
    for axis in range(len(position)):
        desired[axis] = scratch.target_velocity[axis] + away[axis] * speed / left
        square += squared(desired[axis])
    share = max(np.sqrt(square) / top, 1.0)
    for axis in range(len(position)):
        desired[axis] /= share


@inlined
def time_to_target(
    i: int,
    t: float,
    position: Array,
    velocity: Array,
    robots: RobotTable,
    responses: ResponseTable,
    targets: TargetPaths,
    scratch: Scratch,
) -> float:
    """An estimate [s] of the time that robot i needs from this state (d,) at t [s] to its target, without obstacles.

    The rule is that of `slalom.model.goal.Goal.time_to_go`. To stop takes at least two of its shortest responses, or
    one that ends at rest at the target.
    """
    robot = robots.each[i]
    most = robot.max_acceleration
    top = robot.max_speed
    tolerance = robot.tolerance
    away = scratch.displacement
    relative = scratch.desired_velocity
    duration = 0.0
    shortest = responses.each[responses.kinds[robot.kind]].shortest
    for _ in range(INTERCEPTION_STEPS if robot.moving and not robot.stop else 1):
        target_state(i, t + duration, robots, targets, scratch.target, scratch.target_velocity)
        for axis in range(len(position)):
            away[axis] = scratch.target[axis] - position[axis]
            relative[axis] = velocity[axis] - (scratch.target_velocity[axis] if robot.stop else 0.0)
        duration = time_to_go(away, relative, most, robot.stopping, top, tolerance, robot.stop)
    if robot.stop:
        if rests_within(robot, away, relative, shortest):
            return 0.0 if rests_within(robot, away, relative, 0.0) else shortest
        duration = max(duration, 2.0 * shortest)
    return float(duration)
