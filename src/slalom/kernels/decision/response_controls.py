"""Controls of a response that a robot considers, and the optimistic costs by which responses are ordered."""

import numpy as np

from slalom.kernels.arrays import Array, Flags
from slalom.kernels.callback import call_back
from slalom.kernels.decision.limits import admissible_set, excess
from slalom.kernels.decision.manoeuvre_cost import optimistic_cost, take_part
from slalom.kernels.decision.tables import (
    ARRIVE,
    FOLLOW_ACCELERATION,
    IN_PYTHON,
    MIXED,
    PREFERRED,
    DecisionTables,
    ResponseSearch,
    ResponseTable,
    Scratch,
)
from slalom.kernels.decision.targets import desired_velocity, target_state
from slalom.kernels.geometry.cubic import copy_into, value
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.squared import squared
from slalom.tolerances import AIM_FIRST, AIM_LATEST, AIM_ROOT, AIM_STEPS, AIM_TIMES, COST_TIE, FASTEST_SLACK


@inlined
def preferred_control(i: int, r: int, angle: float, tables: DecisionTables, scratch: Scratch, u: Array) -> None:
    """Write the control of response r that robot i prefers into u (3,), see `preferred_by_part`.

    With a mixed objective it is the mean of those of the parts. With one in Python and an `angle` [rad], it leads to
    the velocity to which the preferred control leads, turned.
    """
    robot, parts = tables.robots.each[i], tables.objectives
    if robot.objective == IN_PYTHON:
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
    robot, objectives, shares = tables.robots.each[i], tables.objectives, tables.responses.each[r].settled_velocity
    call_back(objectives.address, PREFERRED, r - tables.responses.kinds[robot.kind], 0.0, 0.0)
    copy_into(u, objectives.preferred)
    if angle != 0.0:
        drift, reached = np.zeros(3), np.zeros(3)
        for axis in range(3):
            drift[axis] = shares[0] * robot.velocity[axis] + shares[1] * robot.acceleration[axis]
            reached[axis] = drift[axis] + shares[2] * u[axis]
        turn(reached, angle)
        for axis in range(3):
            u[axis] = (reached[axis] - drift[axis]) / shares[2]


@inlined
def turn(velocity: Array, angle: float) -> None:
    """Turn a velocity (d,) [m/s] by an angle [rad] about the third axis."""
    c, s = np.cos(angle), np.sin(angle)
    velocity[0], velocity[1] = c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1]


@inlined
def preferred_by_part(i: int, r: int, angle: float, tables: DecisionTables, scratch: Scratch, u: Array) -> None:
    """Write the control of response r that robot i prefers by an objective without parts into u (3,).

    To follow an acceleration: the control that begins with it. To pass through its goal: the control that reaches it at
    the earliest time. Otherwise, or if no admissible control does: the control that settles at the desired velocity.
    With `angle` [rad], for a detour: at that velocity, turned.
    """
    robots, responses, settings = tables.robots, tables.responses, tables.settings
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
    d, position, velocity, desired = settings.dimension, scratch.position, scratch.velocity, scratch.desired_velocity
    step = responses.each[r].step
    # To pass, from the position that the robot will have then; a detour starts at the present position.
    ahead = step if angle == 0.0 and not robot.stop else 0.0
    for axis in range(d):
        velocity[axis] = robot.velocity[axis]
        position[axis] = robot.position[axis] + ahead * velocity[axis]
    desired_velocity(i, settings.now + ahead, step, position, velocity, robots, tables.targets, scratch)
    if angle != 0.0:
        turn(desired, angle)
    shares = responses.each[r].settled_velocity
    for axis in range(d):
        u[axis] = (desired[axis] - (shares[0] * velocity[axis] + shares[1] * robot.acceleration[axis])) / shares[2]


@kernel
def earliest_aim(i: int, r: int, tables: DecisionTables, scratch: Scratch, u: Array) -> bool:
    """Write the control of response r under which robot i is at its target soonest into u (3,).

    Times are sought on a grid in geometric progression; the first success is then refined. Returns whether an
    admissible control reaches the target at one of them. No admissible control exceeds the larger of the present and
    the maximum speed within the horizon, so a target at rest is not reached sooner than at that speed.
    """
    robots, responses, targets, settings = tables.robots, tables.responses, tables.targets, tables.settings
    robot = robots.each[i]
    limits = admissible_set(i, r, robots, responses, tables.bounds)
    target_state(i, settings.now, robots, targets, scratch.target, scratch.target_velocity)
    square, top, speed = 0.0, robot.max_speed, 0.0
    for axis in range(settings.dimension):
        square += squared(scratch.target[axis] - robot.position[axis])
        speed += squared(robot.velocity[axis])
    straight = (np.sqrt(square) - responses.each[r].error) / max(top, np.sqrt(speed)) * (1.0 - FASTEST_SLACK)
    soonest = 0.0 if robot.moving else min(straight, settings.horizon)
    latest = max(AIM_LATEST * (np.sqrt(square) / top + top / robot.max_acceleration), 2.0 * AIM_FIRST)
    ratio = (latest / AIM_FIRST) ** (1.0 / (AIM_TIMES - 1))
    before, t, found = 0.0, AIM_FIRST, False
    for _ in range(AIM_TIMES):
        found = t >= soonest and excess_at_target(i, r, t, limits, tables, scratch, u) <= 0.0
        if found:
            break
        before, t = t, t * ratio
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
    g, side = excess_at_target(i, r, late, limits, tables, scratch, u), 0
    for _ in range(AIM_STEPS):
        if late - early <= AIM_ROOT * late or g == 0.0:
            break
        t = 0.5 * (early + late) if not np.isfinite(f) else (early * g - late * f) / (g - f)
        if not early < t < late:
            t = 0.5 * (early + late)
        h = excess_at_target(i, r, t, limits, tables, scratch, u)
        if h > 0.0:
            early, f = t, h
            g *= 0.5 if side < 0 else 1.0
            side = -1
        else:
            late, g = t, h
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
    robots, settings = tables.robots, tables.settings
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
    first, last = responses.first[r], responses.first[r + 1]
    low, high = first, last
    while high - low > 1:
        middle = (low + high) // 2
        if responses.knots[middle + r] <= t:
            low = middle
        else:
            high = middle
    begin, end = responses.knots[low + r], responses.knots[low + r + 1]
    x, beyond = min((t - begin) / (end - begin), 1.0), max(t - end, 0.0) * 3.0 / (end - begin)
    piece = responses.pieces[low]
    v, a, g = piece.velocity_gain, piece.acceleration_gain, piece.gain
    return (
        value(v[0], v[1], v[2], v[3], x) + beyond * (v[3] - v[2]),
        value(a[0], a[1], a[2], a[3], x) + beyond * (a[3] - a[2]),
        value(g[0], g[1], g[2], g[3], x) + beyond * (g[3] - g[2]),
    )


@kernel
def optimistic_costs(i: int, detour: int, closed: Flags, tables: DecisionTables, search: ResponseSearch) -> None:
    """Write preferred controls and optimistic costs [s] of all responses that are not `closed` (k,) into `search`.

    `detour`: 0 the straight line to the target, else the number of the detour.
    """
    robots, responses, settings = tables.robots, tables.responses, tables.settings
    first, angle = responses.kinds[robots.each[i].kind], 0.0 if detour == 0 else settings.detours[detour - 1]
    for k in range(len(closed)):
        if not closed[k]:
            r, at = first + k, detour * len(closed) + k
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
