"""Cost of a manoeuvre: the time until the robot arrives. And the optimistic cost of a response, without obstacles."""

import numpy as np

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.decision.limits import peak_drift, smallest_control_ball
from slalom.kernels.decision.passive_bodies import is_elsewhere
from slalom.kernels.decision.paths import acceleration_on_path, response_path, state_on_path
from slalom.kernels.decision.tables import DecisionTables, Paths, Scratch
from slalom.kernels.decision.targets import ARRIVE, FOLLOW_VELOCITY, target_state, time_to_target
from slalom.kernels.decision.time_to_go import earliest_on_line
from slalom.kernels.geometry.cubic import new_stack
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.squared import squared
from slalom.tolerances import ARRIVAL_SAMPLES, BALL_WINDOWS


@kernel
def arrives(position: Array, velocity: Array, goal: Array, goal_velocity: Array, stop: bool, tolerance: float) -> bool:
    """Whether a robot with this position and velocity (d,) is at its goal, within `tolerance` [m], [m/s]."""
    away, fast = 0.0, 0.0
    for axis in range(len(position)):
        away += squared(goal[axis] - position[axis])
        fast += squared(velocity[axis] - goal_velocity[axis])
    return bool(away <= tolerance * tolerance and (not stop or fast <= tolerance * tolerance))


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


@inlined
def arrival_within(i: int, until: float, paths: Paths, row: int, tables: DecisionTables, scratch: Scratch) -> float:
    """Time [s] at which robot i on row `row` of `paths` arrives, if at most `until` [s]; -1 if not.

    Its position and velocity (d,) then go into `scratch`.
    """
    robots, settings, position, velocity = tables.robots, tables.settings, scratch.position, scratch.velocity
    robot = robots.each[i]
    goal, goal_velocity, tolerance = scratch.target, scratch.target_velocity, robot.tolerance
    away, fast = 0.0, robot.max_speed
    for axis in range(settings.dimension):
        away += squared(robot.target[axis] - robot.position[axis])
        fast += abs(robot.velocity[axis])
    if robot.moving or away <= squared(tolerance + fast * until):
        # From farther away it cannot arrive until then.
        for step in range(ARRIVAL_SAMPLES):
            t = settings.now + until * step / ARRIVAL_SAMPLES
            state_on_path(paths, row, t, position, velocity)
            target_state(i, t, robots, tables.targets, goal, goal_velocity)
            if arrives(position, velocity, goal, goal_velocity, robot.stop, tolerance):
                return until * step / ARRIVAL_SAMPLES
    state_on_path(paths, row, settings.now + until, position, velocity)
    return -1.0


@kernel
def difference_cost(i: int, until: float, paths: Paths, row: int, tables: DecisionTables, scratch: Scratch) -> float:
    """Time [s] until robot i on row `row` of `paths` has the velocity that it follows, judged after `until` [s].

    Or, to follow an acceleration: the difference from it now, as a share [1] of the largest acceleration.
    """
    robot, settings, found, square = tables.robots.each[i], tables.settings, scratch.velocity, 0.0
    if robot.objective == FOLLOW_VELOCITY:
        state_on_path(paths, row, settings.now + until, scratch.position, found)
    else:
        acceleration_on_path(paths, row, settings.now, found)
    for axis in range(settings.dimension):
        square += squared(found[axis] - robot.wanted[axis])
    difference = np.sqrt(square) / robot.max_acceleration
    return float(until + difference if robot.objective == FOLLOW_VELOCITY else difference)


@inlined
def manoeuvre_cost(
    i: int, until: float, paths: Paths, row: int, near: Indices, tables: DecisionTables, scratch: Scratch
) -> float:
    """Time [s] that robot i needs to its target: on row `row` of `paths` until `until` [s], then without obstacles.

    For a robot that follows a velocity or an acceleration: the cost of the difference from it. Detours around the
    robots `near` (m,) and the passive obstacles, where they will be at the horizon, are added.
    """
    robots, bodies, settings = tables.robots, tables.bodies, tables.settings
    robot = robots.each[i]
    if robot.objective != ARRIVE:
        return difference_cost(i, until, paths, row, tables, scratch)
    arrival = float(arrival_within(i, until, paths, row, tables, scratch))
    if arrival >= 0.0:
        return arrival
    position, goal, then = scratch.position, scratch.target, settings.now + until
    cost = until + time_to_target(i, then, position, scratch.velocity, robots, tables.targets, scratch)
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

    The control is the one nearest to u in the smallest ball that holds all admissible controls. To pass through a goal
    at rest the time of a straight line counts, which is no more than the robot needs.
    """
    robots, responses, settings = tables.robots, tables.responses, tables.settings
    robot = robots.each[i]
    inside, until = scratch.control, max(settings.period, responses.each[r].settled)
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
    if robot.objective != ARRIVE:
        return float(difference_cost(i, until, scratch.paths, 0, tables, scratch))
    arrival = float(arrival_within(i, until, scratch.paths, 0, tables, scratch))
    if arrival >= 0.0:
        return arrival
    position, velocity = scratch.position, scratch.velocity
    if robot.stop or robot.moving:
        then = settings.now + until
        return float(until + time_to_target(i, then, position, velocity, robots, tables.targets, scratch))
    square, along, fast = 0.0, 0.0, 0.0
    for axis in range(settings.dimension):
        away = robot.target[axis] - position[axis]
        square += away * away
        along += away * velocity[axis]
        fast += squared(velocity[axis])
    distance, quick = max(np.sqrt(square), 1e-12), max(robot.max_speed, np.sqrt(fast))
    line = distance - 0.5 * robot.tolerance
    return float(until + earliest_on_line(line, along / distance, robot.max_acceleration, quick))


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
