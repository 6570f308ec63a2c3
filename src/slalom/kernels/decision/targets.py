"""Targets at rest or in motion: their positions, the velocity that leads to them, the time to reach them."""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.decision.tables import FOLLOW_VELOCITY, ResponseTable, Robot, RobotTable, Scratch, TargetPaths
from slalom.kernels.decision.time_to_go import passing_velocity, stopping_speed, time_to_go
from slalom.kernels.geometry.cubic import slope, value
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.squared import squared
from slalom.tolerances import AT_REST, BRAKING_SHARE, INTERCEPTION_STEPS, INTERCEPTION_WAIT


@kernel
def moving_target(i: int, t: float, targets: TargetPaths, position: Array, velocity: Array) -> None:
    """Write the position (3,) [m] and velocity (3,) [m/s] of the moving target of robot i at time t [s]."""
    first, last = targets.first[i], targets.first[i + 1]
    begin, end = targets.times[first + i], targets.times[last + i]
    low, high, at = first, last, min(max(t, begin), end)
    while high - low > 1:
        middle = (low + high) // 2
        if targets.times[middle + i] <= at:
            low = middle
        else:
            high = middle
    width = targets.times[low + i + 1] - targets.times[low + i]
    x, moves = (at - targets.times[low + i]) / width, begin <= t <= end
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
        position[axis], velocity[axis] = robot.target[axis], 0.0


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
    square, speed = 0.0, 0.0
    for axis in range(len(away)):
        square += squared(away[axis] - 0.5 * step * velocity[axis])
        speed += squared(velocity[axis])
    return bool(
        square <= squared(robot.tolerance) and speed <= squared(AT_REST + step * robot.stopping / BRAKING_SHARE)
    )


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
    of `slalom.goal.Goal.desired_velocity`. A robot that follows a velocity desires that one.
    """
    robot = robots.each[i]
    away, desired, top = scratch.displacement, scratch.desired_velocity, robot.max_speed
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
    resting, square = resting and square <= squared(robot.tolerance), 0.0
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

    The rule is that of `slalom.goal.Goal.time_to_go`. To stop takes at least two of its shortest responses, or one
    that ends at rest at the target.
    """
    robot = robots.each[i]
    most, top, tolerance = robot.max_acceleration, robot.max_speed, robot.tolerance
    away, relative, duration = scratch.displacement, scratch.desired_velocity, 0.0
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
