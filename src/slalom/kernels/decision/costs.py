"""Cost of a manoeuvre: the time until the robot arrives. And the optimistic cost of a response, without obstacles."""

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import lower_builtin, type_callable

from slalom.base.tolerances import AIM_FIRST, AIM_LATEST, AIM_TIMES
from slalom.kernels.arrays import Array, Flags, Indices
from slalom.kernels.decision.detours import detour_length, longer_by_balls, may_block, time_around
from slalom.kernels.decision.limits import admissible_set, excess, peak_drift, smallest_control_ball
from slalom.kernels.decision.paths import acceleration_on_path, response_path, state_on_path
from slalom.kernels.decision.right_of_way import cost_on_ways
from slalom.kernels.decision.tables import (
    ARRIVE,
    BALL_WINDOWS,
    CALLBACK,
    FOLLOW_ACCELERATION,
    FOLLOW_VELOCITY,
    MIXED,
    DecisionTables,
    Objectives,
    Paths,
    ResponseSearch,
    ResponseTable,
    Robot,
    Scratch,
)
from slalom.kernels.decision.targets import desired_velocity, piece_of, rests_within, target_state, time_to_target
from slalom.kernels.geometry.cubic import copy_into, new_stack, value
from slalom.kernels.jit import inlined, kernel, squared

ARRIVAL_SAMPLES: Final = 8
"""[1] Times at which a manoeuvre is tested for an arrival before its control has been carried out. Larger: an arrival
on the way is noticed earlier. Smaller: a robot may pass its goal unnoticed in the cost."""


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
    a = 0.0
    b = 0.0
    c = -radius * radius
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
    robots = tables.robots
    settings = tables.settings
    position = scratch.position
    velocity = scratch.velocity
    robot = robots.each[i]
    away = scratch.displacement
    before = scratch.desired_velocity
    goal = scratch.target
    goal_velocity = scratch.target_velocity
    tolerance = robot.tolerance
    square = 0.0
    fast = robot.max_speed
    resting = robot.stop
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
    robots = tables.robots
    settings = tables.settings
    position = scratch.position
    velocity = scratch.velocity
    robot = robots.each[i]
    before = scratch.desired_velocity
    after = scratch.displacement
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
    robot = tables.robots.each[i]
    settings = tables.settings
    found = scratch.velocity
    square = 0.0
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


@inlined
def manoeuvre_cost(
    i: int, until: float, to: float, paths: Paths, row: int, near: Indices, tables: DecisionTables, scratch: Scratch
) -> float:
    """Cost [s] of row `row` of `paths` for robot i by its objective, see `cost_by_part`; of a mixed one the mean.

    A manoeuvre that ends on a way that the robot has to leave costs more, see `cost_on_ways`.
    """
    robot = tables.robots.each[i]
    parts = tables.objectives
    mixed = robot.objective == MIXED
    cost = 0.0
    for p in range(len(parts.kind) if mixed else 1):
        if mixed:
            take_part(robot, p, parts)
        part = cost_by_part(i, until, to, paths, row, near, tables, scratch)
        cost += parts.weight[p] * part if mixed else part
    if mixed:
        robot.objective = MIXED
    return cost + cost_on_ways(i, until, paths, row, tables, scratch)


@inlined
def cost_by_part(
    i: int, until: float, to: float, paths: Paths, row: int, near: Indices, tables: DecisionTables, scratch: Scratch
) -> float:
    """Time [s] that robot i needs to its target: on row `row` of `paths` until `until` [s], then without obstacles.

    If `to` [s] is later, it keeps its velocity from `until` to then. For a robot that follows a velocity or an
    acceleration: the cost of the difference from it. Detours around the robots `near` (m,) and the passive obstacles,
    where they will be at the horizon, are added.
    """
    robots = tables.robots
    settings = tables.settings
    responses = tables.responses
    robot = robots.each[i]
    position = scratch.position
    velocity = scratch.velocity
    if robot.objective != ARRIVE:
        return difference_cost(i, until, to, paths, row, tables, scratch)
    arrival = float(arrival_within(i, until, paths, row, tables, scratch))
    if arrival >= 0.0:
        return arrival
    goal = scratch.target
    then = settings.now + until
    left = time_to_target(i, then, position, velocity, robots, responses, tables.targets, scratch)
    if to > until and left > 0.0:
        arrival = keep_velocity(i, until, to, tables, scratch)
        if arrival >= 0.0:
            return arrival
        until = to
        then = settings.now + to
        left = time_to_target(i, then, position, velocity, robots, responses, tables.targets, scratch)
    cost = until + left
    if len(settings.detours) > 0:
        if settings.held_up:
            cost = until + time_around(i, then, left, tables, scratch)
        target_state(i, then, robots, tables.targets, goal, scratch.target_velocity)
        longer = 0.0
        for k in near:
            end = robots.each[k].end_position
            radius = robot.radius + robots.each[k].radius + robot.margin_among
            if may_block(position, goal, end, radius):
                longer += detour_length(position, goal, end, radius)
        if not settings.held_up:
            longer += longer_by_balls(i, goal, tables, scratch)
        cost += longer / robot.max_speed
    return float(cost)


@inlined
def optimistic_cost(i: int, r: int, u: Array, tables: DecisionTables, scratch: Scratch) -> float:
    """Cost [s] of response r for robot i with the preferred control u (3,), without obstacles.

    The control is the one nearest to u in the smallest ball that holds all admissible controls.
    """
    robots = tables.robots
    responses = tables.responses
    settings = tables.settings
    robot = robots.each[i]
    inside = scratch.control
    until = max(settings.period, responses.each[r].step)
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
    mixed = robot.objective == MIXED
    cost = 0.0
    parts = tables.objectives
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
    robots = tables.robots
    settings = tables.settings
    if robots.each[i].objective != ARRIVE:
        return float(difference_cost(i, until, until, scratch.paths, 0, tables, scratch))
    arrival = float(arrival_within(i, until, scratch.paths, 0, tables, scratch))
    if arrival >= 0.0:
        return arrival
    then = settings.now + until
    position = scratch.position
    velocity = scratch.velocity
    left = time_to_target(i, then, position, velocity, robots, tables.responses, tables.targets, scratch)
    if settings.held_up:
        left = min(left, time_around(i, then, left, tables, scratch))
    return float(until + left)


# Controls of a response that a robot considers, and the optimistic costs by which responses are ordered.


COST_TIE: Final = 1e-9
"""[s] Costs and optimistic costs that differ by less are equal: the first response is taken. Larger: more ties.
Smaller: rounding decides which response is taken."""

FASTEST_SLACK: Final = 1e-6
"""[1] Share by which the time to a target at the largest speed is reduced, for rounding. Larger: more times are tested
that no control can meet. Smaller than the rounding: the earliest time may be missed."""

AIM_STEPS: Final = 60
"""[1] Most steps of regula falsi towards the earliest aim; seldom more than ten. Smaller: the aim is later than it
could be."""

AIM_ROOT: Final = 1e-14
"""[1] Relative width of the bracket of the earliest aim at which its search ends. Larger: costs that are equal in
theory differ. Smaller than rounding: all steps are computed."""


STEEP: Final = 3.0
"""[1] Square of the slope above which a velocity is steep: 60 degrees. Larger: detours of robots that climb turn them
less. Smaller: robots that climb pass others above or below."""


@inlined
def preferred_control(i: int, r: int, angle: float, tables: DecisionTables, scratch: Scratch, u: Array) -> None:
    """Write the control of response r that robot i prefers into u (3,), see `preferred_by_part`.

    With a mixed objective it is the mean of those of the parts. With aims in Python and an `angle` [rad], it leads to
    the velocity to which the preferred control leads, turned.
    """
    robot = tables.robots.each[i]
    parts = tables.objectives
    if len(parts.preferred) > 0:
        preferred_in_python(i, r, angle, tables, u)
        return
    mixed = robot.objective == MIXED
    part = np.zeros(3) if mixed else u
    for p in range(len(parts.kind) if mixed else 1):
        if mixed:
            take_part(robot, p, parts)
        preferred_by_part(i, r, angle, tables, scratch, part)
        for axis in range(3 if mixed else 0):
            u[axis] = (u[axis] if p > 0 else 0.0) + parts.weight[p] * part[axis]
    if mixed:
        robot.objective = MIXED


@kernel
def preferred_in_python(i: int, r: int, angle: float, tables: DecisionTables, u: Array) -> None:
    """Write the control of response r that an objective in Python prefers into u (3,), see `preferred_control`."""
    robot = tables.robots.each[i]
    shares = tables.responses.each[r].settled_velocity
    copy_into(u, tables.objectives.preferred[r - tables.responses.kinds[robot.kind]])
    if angle != 0.0:
        drift = np.zeros(3)
        reached = np.zeros(3)
        for axis in range(3):
            drift[axis] = shares[0] * robot.velocity[axis] + shares[1] * robot.acceleration[axis]
            reached[axis] = drift[axis] + shares[2] * u[axis]
        turn(reached, angle)
        for axis in range(3):
            u[axis] = (reached[axis] - drift[axis]) / shares[2]


@inlined
def turn(velocity: Array, angle: float) -> None:
    """Turn a velocity (d,) [m/s] by an angle [rad] about the third axis, one that is steep in space about the second.

    Two robots that come towards each other and turn by the same angle thus pass on opposite sides.
    """
    c = np.cos(angle)
    s = np.sin(angle)
    x = velocity[0]
    y = velocity[1]
    if len(velocity) == 3 and squared(velocity[2]) > STEEP * (x * x + y * y):
        z = velocity[2]
        velocity[2], velocity[0] = c * z - s * x, s * z + c * x
        return
    velocity[0], velocity[1] = c * x - s * y, s * x + c * y


@inlined
def preferred_by_part(i: int, r: int, angle: float, tables: DecisionTables, scratch: Scratch, u: Array) -> None:
    """Write the control of response r that robot i prefers by an objective without parts into u (3,).

    To follow an acceleration: the control that begins with it. To pass through its goal: the control that reaches it at
    the earliest time. Otherwise, or if no admissible control does: the control that settles at the desired velocity.
    With `angle` [rad], for a detour: at that velocity, turned.
    """
    robots = tables.robots
    responses = tables.responses
    settings = tables.settings
    robot = robots.each[i]
    if robot.objective == FOLLOW_ACCELERATION:
        initial = responses.each[r].initial_acceleration
        for axis in range(settings.dimension):
            drift = initial[0] * robot.velocity[axis] + initial[1] * robot.acceleration[axis]
            u[axis] = (robot.wanted[axis] - drift) / initial[2]
        return
    if (
        angle == 0.0
        and robot.objective == ARRIVE
        and robot.final
        and not robot.stop
        and earliest_aim(i, r, tables, scratch, u)
    ):
        return
    d = settings.dimension
    position = scratch.position
    velocity = scratch.velocity
    desired = scratch.desired_velocity
    step = responses.each[r].step
    # To pass, from the position that the robot will have then; a detour starts at the present position.
    ahead = step if angle == 0.0 and not robot.stop else 0.0
    for axis in range(d):
        velocity[axis] = robot.velocity[axis]
        position[axis] = robot.position[axis] + ahead * velocity[axis]
    desired_velocity(i, settings.now + ahead, step, position, velocity, robots, tables.targets, scratch)
    if angle != 0.0:
        turn(desired, angle)
    control_to_velocity(robot, r, desired, responses, u)


@inlined
def control_to_velocity(robot: Robot, r: int, desired: Array, responses: ResponseTable, u: Array) -> None:
    """Write the control of response r under which a robot settles at the velocity `desired` (d,) [m/s] into u (3,)."""
    shares = responses.each[r].settled_velocity
    for axis in range(len(desired)):
        drift = shares[0] * robot.velocity[axis] + shares[1] * robot.acceleration[axis]
        u[axis] = (desired[axis] - drift) / shares[2]


@kernel
def earliest_aim(i: int, r: int, tables: DecisionTables, scratch: Scratch, u: Array) -> bool:
    """Write the control of response r under which robot i is at its target soonest into u (3,).

    Times are sought on a grid in geometric progression; the first success is then refined. Returns whether an
    admissible control reaches the target at one of them. No admissible control exceeds the larger of the present and
    the maximum speed within the horizon, so a target at rest is not reached sooner than at that speed.
    """
    robots = tables.robots
    responses = tables.responses
    targets = tables.targets
    settings = tables.settings
    robot = robots.each[i]
    limits = admissible_set(i, r, robots, responses, tables.bounds)
    target_state(i, settings.now, robots, targets, scratch.target, scratch.target_velocity)
    square = 0.0
    top = robot.max_speed
    speed = 0.0
    for axis in range(settings.dimension):
        square += squared(scratch.target[axis] - robot.position[axis])
        speed += squared(robot.velocity[axis])
    straight = (np.sqrt(square) - responses.each[r].error) / max(top, np.sqrt(speed)) * (1.0 - FASTEST_SLACK)
    soonest = 0.0 if robot.moving else min(straight, settings.horizon)
    latest = max(AIM_LATEST * (np.sqrt(square) / top + top / robot.max_acceleration), 2.0 * AIM_FIRST)
    ratio = (latest / AIM_FIRST) ** (1.0 / (AIM_TIMES - 1))
    before = 0.0
    t = AIM_FIRST
    found = False
    for _ in range(AIM_TIMES):
        found = t >= soonest and excess_at_target(i, r, t, limits, tables, scratch, u) <= 0.0
        if found:
            break
        before = t
        t = t * ratio
    if not found:
        return False
    if soonest > before and excess_at_target(i, r, soonest, limits, tables, scratch, u) <= 0.0:
        return True
    return first_admissible(i, r, max(before, soonest), t, limits, tables, scratch, u)


@kernel
def first_admissible(
    i: int, r: int, early: float, late: float, limits: Array, tables: DecisionTables, scratch: Scratch, u: Array
) -> bool:
    """Write the control of response r that reaches the target at the earliest time from `early` to `late` [s] into u.

    The one of `late` is admissible, that of `early` is not. Regula falsi, with halved values where one end stays.
    """
    f = excess_at_target(i, r, early, limits, tables, scratch, u)
    g = excess_at_target(i, r, late, limits, tables, scratch, u)
    side = 0
    for _ in range(AIM_STEPS):
        if late - early <= AIM_ROOT * late or g == 0.0:
            break
        t = 0.5 * (early + late) if not np.isfinite(f) else (early * g - late * f) / (g - f)
        if not early < t < late:
            t = 0.5 * (early + late)
        h = excess_at_target(i, r, t, limits, tables, scratch, u)
        if h > 0.0:
            early = t
            f = h
            g *= 0.5 if side < 0 else 1.0
            side = -1
        else:
            late = t
            g = h
            f *= 0.5 if side > 0 else 1.0
            side = 1
    return excess_at_target(i, r, late, limits, tables, scratch, u) <= 0.0


@kernel
def excess_at_target(
    i: int, r: int, t: float, limits: Array, tables: DecisionTables, scratch: Scratch, u: Array
) -> float:
    """How far the control of response r that is at the target of robot i after t [s] is outside of `limits` (l, 5).

    That control goes into u (3,); not above 0 if it is admissible, inf if there is none.
    """
    robots = tables.robots
    settings = tables.settings
    robot = robots.each[i]
    of_velocity, of_acceleration, gain = position_shares(r, t, tables.responses)
    if not gain > 0.0:
        return np.inf
    target_state(i, settings.now + t, robots, tables.targets, scratch.target, scratch.target_velocity)
    for axis in range(settings.dimension):
        drift = robot.position[axis] + of_velocity * robot.velocity[axis]
        u[axis] = (scratch.target[axis] - (drift + of_acceleration * robot.acceleration[axis])) / gain
    return excess(limits, u)


@kernel
def position_shares(r: int, t: float, responses: ResponseTable) -> tuple[float, float, float]:
    """Shares of velocity [s], acceleration [s^2] and control in the displacement under response r after t [s].

    After the end of its table the motion goes on in a straight line.
    """
    low = piece_of(responses.knots, responses.first, r, t)
    begin = responses.knots[low + r]
    end = responses.knots[low + r + 1]
    x = min((t - begin) / (end - begin), 1.0)
    beyond = max(t - end, 0.0) * 3.0 / (end - begin)
    piece = responses.pieces[low]
    v = piece.velocity_gain
    a = piece.acceleration_gain
    g = piece.gain
    return (
        value(v[0], v[1], v[2], v[3], x) + beyond * (v[3] - v[2]),
        value(a[0], a[1], a[2], a[3], x) + beyond * (a[3] - a[2]),
        value(g[0], g[1], g[2], g[3], x) + beyond * (g[3] - g[2]),
    )


@kernel
def optimistic_costs(i: int, detour: int, closed: Flags, tables: DecisionTables, search: ResponseSearch) -> None:
    """Write preferred controls and optimistic costs [s] of all responses that are not `closed` (k,) into `search`.

    `detour`: 0 the straight line to the target, else the number of the detour, or after these of a way aside.
    """
    robots = tables.robots
    responses = tables.responses
    settings = tables.settings
    robot = robots.each[i]
    first = responses.kinds[robot.kind]
    desired = search.scratch.desired_velocity
    aside = detour - 1 - len(settings.detours)
    angle = 0.0 if detour == 0 or aside >= 0 else settings.detours[detour - 1]
    for k in range(len(closed)):
        if not closed[k]:
            r = first + k
            at = detour * len(closed) + k
            if aside >= 0:
                for axis in range(settings.dimension):
                    desired[axis] = robot.max_speed * search.aside[aside, axis]
                control_to_velocity(robot, r, desired, responses, search.preferred[at])
            else:
                preferred_control(i, r, angle, tables, search.scratch, search.preferred[at])
            search.costs[at] = optimistic_cost(i, r, search.preferred[at], tables, search.scratch)


@kernel
def first_least(costs: Array) -> int:
    """The first entry of `costs` (n,) [s] that is the least up to COST_TIE."""
    least = np.inf
    for k in range(len(costs)):
        least = min(least, costs[k])
    for k in range(len(costs)):
        if costs[k] <= least + COST_TIE:
            return k
    return -1


@kernel
def first_detour(i: int, closed: Flags, tables: DecisionTables, search: ResponseSearch) -> int:
    """The entry of `search.costs` that is least, after the optimistic costs of all detours; see `optimistic_costs`."""
    for detour in range(1, 1 + len(tables.settings.detours) + len(search.aside)):
        optimistic_costs(i, detour, closed, tables, search)
    return first_least(search.costs)


# Calls of Python from kernels, by the address of a function.


def call_back(address: int, count: int) -> float:
    """Call the function at `address`, one of type CALLBACK, for so many candidates.

    It writes into arrays that the kernel reads. Its caller holds the function, and raises what was raised there.
    """
    return float(CALLBACK(address)(count))


@type_callable(call_back)
def _type_of_answer(_context: Any) -> Callable[..., Any]:
    def answer(_address: Any, _count: Any) -> Any:
        return types.float64

    return answer


@lower_builtin(call_back, types.Integer, types.Integer)  # type: ignore[no-untyped-call, untyped-decorator]
def _call(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    address, count = (
        context.cast(builder, value, found, types.int64) for value, found in zip(arguments, signature.args)
    )
    function = ir.FunctionType(ir.DoubleType(), [ir.IntType(64)]).as_pointer()
    return builder.call(builder.inttoptr(address, function), [count])
