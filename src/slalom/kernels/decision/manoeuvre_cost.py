"""Cost of a manoeuvre: the time until the robot arrives. And the optimistic cost of a response, without obstacles."""

import numpy as np

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.callback import call_back
from slalom.kernels.decision.limits import peak_drift, smallest_control_ball
from slalom.kernels.decision.passive_bodies import is_elsewhere
from slalom.kernels.decision.paths import acceleration_on_path, response_path, state_on_path
from slalom.kernels.decision.tables import (
    ARRIVE,
    COST,
    FOLLOW_VELOCITY,
    IN_PYTHON,
    MIXED,
    DecisionTables,
    Objectives,
    Paths,
    Robot,
    Scratch,
)
from slalom.kernels.decision.targets import rests_within, target_state, time_to_target
from slalom.kernels.geometry.cubic import copy_into, new_stack
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.squared import squared
from slalom.tolerances import ARRIVAL_SAMPLES, BALL_WINDOWS


@kernel
def new_scratch(pieces: int, dimension: int) -> Scratch:
    """Buffers for paths of so many pieces."""
    return Scratch(
        Paths(np.empty((2, pieces + 1)), np.empty((2, pieces, 4, 3))),
        np.empty((BALL_WINDOWS, 3)),
        np.empty(BALL_WINDOWS),
        new_stack(),
        np.zeros(3),
        np.empty(dimension),
        np.empty(dimension),
        np.empty(3),
        np.empty(3),
        np.empty(dimension),
        np.empty(dimension),
    )


@kernel
def first_within(before: Array, after: Array, radius: float) -> float:
    """The share [1] of the way from `before` to `after` (d,) [m] at which it gets within `radius` [m] of the origin.

    -1 if it does not.
    """
    a, b, c = 0.0, 0.0, -radius * radius
    for axis in range(len(before)):
        step = after[axis] - before[axis]
        a += step * step
        b += before[axis] * step
        c += before[axis] * before[axis]
    if c <= 0.0:
        return 0.0
    root = b * b - a * c
    if not (b < 0.0 and root >= 0.0):
        return -1.0
    x = c / (np.sqrt(root) - b)
    return float(x) if x <= 1.0 else -1.0


@inlined
def arrival_within(i: int, until: float, paths: Paths, row: int, tables: DecisionTables, scratch: Scratch) -> float:
    """Time [s] at which robot i on row `row` of `paths` passes its target, if at most `until` [s]; -1 if not.

    A robot that stops at its target has arrived, at time 0, if it is at rest there and stays there until then.
    The position and velocity (d,) after `until` then are in `scratch`.
    """
    robots, settings, position, velocity = tables.robots, tables.settings, scratch.position, scratch.velocity
    robot, away, before = robots.each[i], scratch.displacement, scratch.desired_velocity
    goal, goal_velocity, tolerance = scratch.target, scratch.target_velocity, robot.tolerance
    square, fast, resting = 0.0, robot.max_speed, robot.stop
    for axis in range(settings.dimension):
        square += squared(robot.target[axis] - robot.position[axis])
        fast += abs(robot.velocity[axis])
    # From farther away it cannot arrive until then.
    near = robot.moving or square <= squared(tolerance + fast * until)
    steps = ARRIVAL_SAMPLES if not robot.stop else 1
    for step in range(steps + 1 if near else 0):
        t = settings.now + until * step / steps
        state_on_path(paths, row, t, position, velocity)
        target_state(i, t, robots, tables.targets, goal, goal_velocity)
        for axis in range(settings.dimension):
            before[axis], away[axis] = away[axis], position[axis] - goal[axis]
            velocity[axis] -= goal_velocity[axis]
        if robot.stop:
            resting = resting and rests_within(robot, away, velocity, 0.0)
            continue
        share = first_within(before if step > 0 else away, away, tolerance)
        if share >= 0.0:
            return until * (step - 1 + share) / steps if step > 0 else 0.0
    if near and resting:
        return 0.0
    state_on_path(paths, row, settings.now + until, position, velocity)
    return -1.0


@kernel
def keep_velocity(i: int, until: float, to: float, tables: DecisionTables, scratch: Scratch) -> float:
    """Time [s] between `until` and `to` [s] at which robot i passes its target at constant velocity; -1 if not.

    `scratch` holds its position and velocity (d,), the position is then that at `to`.
    """
    robots, settings, position, velocity = tables.robots, tables.settings, scratch.position, scratch.velocity
    robot, before, after = robots.each[i], scratch.desired_velocity, scratch.displacement
    target_state(i, settings.now + until, robots, tables.targets, scratch.target, scratch.target_velocity)
    for axis in range(settings.dimension):
        before[axis] = position[axis] - scratch.target[axis]
        position[axis] += (to - until) * velocity[axis]
    target_state(i, settings.now + to, robots, tables.targets, scratch.target, scratch.target_velocity)
    for axis in range(settings.dimension):
        after[axis] = position[axis] - scratch.target[axis]
    share = -1.0 if robot.stop else first_within(before, after, robot.tolerance)
    return float(until + share * (to - until)) if share >= 0.0 else -1.0


@kernel
def difference_cost(
    i: int, until: float, to: float, paths: Paths, row: int, tables: DecisionTables, scratch: Scratch
) -> float:
    """Time [s] until robot i on row `row` of `paths` has the velocity that it follows, judged after `until` [s].

    It keeps its velocity from then to the time `to` [s], if that is later. Or, to follow an acceleration: the
    difference from it now, as a share [1] of the largest acceleration.
    """
    robot, settings, found, square = tables.robots.each[i], tables.settings, scratch.velocity, 0.0
    if robot.objective == FOLLOW_VELOCITY:
        state_on_path(paths, row, settings.now + until, scratch.position, found)
    else:
        acceleration_on_path(paths, row, settings.now, found)
    for axis in range(settings.dimension):
        square += squared(found[axis] - robot.wanted[axis])
    difference = np.sqrt(square) / robot.max_acceleration
    return float(max(until, to) + difference if robot.objective == FOLLOW_VELOCITY else difference)


@inlined
def take_part(robot: Robot, p: int, objectives: Objectives) -> None:
    """Let a robot with a mixed objective have its part p."""
    robot.objective = objectives.kind[p]
    copy_into(robot.wanted[:], objectives.wanted[p])


@kernel
def cost_in_python(until: float, to: float, paths: Paths, row: int, tables: DecisionTables) -> float:
    """Cost [s] of row `row` of `paths` by an objective in Python: up to `until` [s], then at constant velocity up to
    `to` [s] if that is later."""
    objectives = tables.objectives
    copy_into(objectives.path.times[0], paths.times[row])
    copy_into(objectives.path.points[0], paths.points[row])
    return float(call_back(objectives.address, COST, -1, until, to))


@inlined
def manoeuvre_cost(
    i: int, until: float, to: float, paths: Paths, row: int, near: Indices, tables: DecisionTables, scratch: Scratch
) -> float:
    """Cost [s] of row `row` of `paths` for robot i by its objective, see `cost_by_part`; of a mixed one the mean."""
    robot, parts = tables.robots.each[i], tables.objectives
    if robot.objective == IN_PYTHON:
        return cost_in_python(until, to, paths, row, tables)
    mixed, cost = robot.objective == MIXED, 0.0
    for p in range(len(parts.kind) if mixed else 1):
        if mixed:
            take_part(robot, p, parts)
        part = cost_by_part(i, until, to, paths, row, near, tables, scratch)
        cost += parts.weight[p] * part if mixed else part
    if mixed:
        robot.objective = MIXED
    return cost


@inlined
def cost_by_part(
    i: int, until: float, to: float, paths: Paths, row: int, near: Indices, tables: DecisionTables, scratch: Scratch
) -> float:
    """Time [s] that robot i needs to its target: on row `row` of `paths` until `until` [s], then without obstacles.

    If `to` [s] is later, it keeps its velocity from `until` to then. For a robot that follows a velocity or an
    acceleration: the cost of the difference from it. Detours around the robots `near` (m,) and the passive obstacles,
    where they will be at the horizon, are added.
    """
    robots, bodies, settings, responses = tables.robots, tables.bodies, tables.settings, tables.responses
    robot, position, velocity = robots.each[i], scratch.position, scratch.velocity
    if robot.objective != ARRIVE:
        return difference_cost(i, until, to, paths, row, tables, scratch)
    arrival = float(arrival_within(i, until, paths, row, tables, scratch))
    if arrival >= 0.0:
        return arrival
    goal, then = scratch.target, settings.now + until
    left = time_to_target(i, then, position, velocity, robots, responses, tables.targets, scratch)
    if to > until and left > 0.0:
        arrival = keep_velocity(i, until, to, tables, scratch)
        if arrival >= 0.0:
            return arrival
        until, then = to, settings.now + to
        left = time_to_target(i, then, position, velocity, robots, responses, tables.targets, scratch)
    cost = until + left
    if settings.dimension == 2 and len(settings.detours) > 0:
        target_state(i, then, robots, tables.targets, goal, scratch.target_velocity)
        longer = 0.0
        for k in near:
            end, radius = robots.each[k].end_position, robot.radius + robots.each[k].radius + robot.margin_among
            if may_block(position, goal, end[0], end[1], radius):
                longer += detour_length(position, goal, end[0], end[1], radius)
        for e in range(len(bodies.at_horizon)):
            body = bodies.at_horizon[e]
            if is_elsewhere(body.world, robot.world):
                continue
            radius = body.radius + robot.radius + robot.margin
            longer += detour_length(position, goal, body.position[0], body.position[1], radius)
        cost += longer / robot.max_speed
    return float(cost)


@inlined
def optimistic_cost(i: int, r: int, u: Array, tables: DecisionTables, scratch: Scratch) -> float:
    """Cost [s] of response r for robot i with the preferred control u (3,), without obstacles.

    The control is the one nearest to u in the smallest ball that holds all admissible controls.
    """
    robots, responses, settings = tables.robots, tables.responses, tables.settings
    robot = robots.each[i]
    inside, until = scratch.control, max(settings.period, responses.each[r].step)
    p, radius = smallest_control_ball(robot, r, responses)
    square = 0.0
    for axis in range(settings.dimension):
        inside[axis] = u[axis]
        square += squared(u[axis] + peak_drift(robot, p, axis, responses) / responses.peaks[p, 4])
    if square > radius * radius:
        for axis in range(settings.dimension):
            middle = -peak_drift(robot, p, axis, responses) / responses.peaks[p, 4]
            inside[axis] = middle + (u[axis] - middle) * (radius / np.sqrt(square))
    response_path(robot, r, inside, responses, settings, until, scratch.paths, 0)
    if robot.objective == IN_PYTHON:
        return cost_in_python(until, until, scratch.paths, 0, tables)
    mixed, cost, parts = robot.objective == MIXED, 0.0, tables.objectives
    for p in range(len(parts.kind) if mixed else 1):
        if mixed:
            take_part(robot, p, parts)
        part = optimistic_part(i, until, tables, scratch)
        cost += parts.weight[p] * part if mixed else part
    if mixed:
        robot.objective = MIXED
    return cost


@inlined
def optimistic_part(i: int, until: float, tables: DecisionTables, scratch: Scratch) -> float:
    """As `cost_by_part`, of the first row of the scratch's paths, without obstacles."""
    robots, settings = tables.robots, tables.settings
    if robots.each[i].objective != ARRIVE:
        return float(difference_cost(i, until, until, scratch.paths, 0, tables, scratch))
    arrival = float(arrival_within(i, until, scratch.paths, 0, tables, scratch))
    if arrival >= 0.0:
        return arrival
    then, position, velocity = settings.now + until, scratch.position, scratch.velocity
    left = time_to_target(i, then, position, velocity, robots, tables.responses, tables.targets, scratch)
    return float(until + left)


@kernel
def detour_length(position: Array, goal: Array, x: float, y: float, radius: float) -> float:
    """Extra length [m] of the path from `position` to `goal` (2,) [m] around a disc at (x, y) [m].

    Two tangents and an arc; 0 for a disc that is not in the way.
    """
    ax, ay, bx, by = position[0] - x, position[1] - y, goal[0] - x, goal[1] - y
    first, second = np.sqrt(ax * ax + ay * ay), np.sqrt(bx * bx + by * by)
    cosine = (ax * bx + ay * by) / max(first * second, 1e-12)
    first, second = max(first, radius), max(second, radius)
    angle = np.arccos(min(1.0, max(-1.0, cosine))) - np.arccos(radius / first) - np.arccos(radius / second)
    if angle <= 0.0:
        return 0.0
    tangents = np.sqrt(first * first - radius * radius) + np.sqrt(second * second - radius * radius)
    straight = np.sqrt(squared(goal[0] - position[0]) + squared(goal[1] - position[1]))
    return float(max(tangents + radius * angle - straight, 0.0))


@kernel
def may_block(position: Array, goal: Array, x: float, y: float, radius: float) -> bool:
    """Whether a disc at (x, y) [m] may cover a part of the line from `position` to `goal` (2,) [m].

    If not, `detour_length` around it is 0.
    """
    dx, dy, tx, ty = goal[0] - position[0], goal[1] - position[1], x - position[0], y - position[1]
    along = min(1.0, max(0.0, (tx * dx + ty * dy) / (dx * dx + dy * dy + 1e-300)))
    return bool(squared(tx - along * dx) + squared(ty - along * dy) < (1.0 + 1e-6) * radius * radius)


@kernel
def detour_lengths(position: Array, goal: Array, centers: Array, radii: Array) -> Array:
    """`detour_length` around each of the discs with `centers` (n, 2) and `radii` (n,) [m]: (n,) [m]."""
    longer = np.empty(len(radii))
    for k in range(len(radii)):
        longer[k] = detour_length(position, goal, centers[k, 0], centers[k, 1], radii[k])
    return longer
