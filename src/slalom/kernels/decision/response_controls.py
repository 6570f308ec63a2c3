"""Controls of a response that a robot considers, and the optimistic costs by which responses are ordered."""

import numpy as np

from slalom.kernels.arrays import Array, Flags
from slalom.kernels.decision.manoeuvre_cost import optimistic_cost
from slalom.kernels.decision.tables import DecisionSettings, ResponseTable, RobotTable, Scratch
from slalom.kernels.decision.time_to_go import passing_velocity, stopping_velocity
from slalom.kernels.jit import inlined, kernel
from slalom.tolerances import COST_TIE


@inlined
def preferred_control(
    i: int,
    r: int,
    angle: float,
    robots: RobotTable,
    responses: ResponseTable,
    settings: DecisionSettings,
    scratch: Scratch,
    u: Array,
) -> None:
    """Write the control of response r that settles at the desired velocity, turned by `angle` [rad], into u (3,)."""
    d, after = settings.dimension, responses.settled[r]
    away, velocity, desired = scratch.displacement, scratch.velocity, scratch.desired_velocity
    for axis in range(d):
        velocity[axis] = robots.velocity[i, axis]
        # From the position that the robot will have then; a detour starts at the present position.
        ahead = after * velocity[axis] if angle == 0.0 else 0.0
        away[axis] = robots.target[i, axis] - (robots.position[i, axis] + ahead)
    if robots.stop[i]:
        stopping_velocity(away, robots.max_acceleration[i], robots.max_speed[i], desired)
    else:
        passing_velocity(away, velocity, robots.max_acceleration[i], robots.max_speed[i], desired)
    if angle != 0.0:
        c, s = np.cos(angle), np.sin(angle)
        desired[0], desired[1] = c * desired[0] - s * desired[1], s * desired[0] + c * desired[1]
    for axis in range(d):
        settled = responses.settled_velocity[r, 0] * velocity[axis]
        u[axis] = (desired[axis] - settled) / responses.settled_velocity[r, 1]


@inlined
def unchanged_control(
    i: int, r: int, robots: RobotTable, responses: ResponseTable, settings: DecisionSettings, u: Array
) -> None:
    """Write the control of response r that changes nothing now into u (3,): the present acceleration or velocity."""
    for axis in range(settings.dimension):
        velocity = responses.settled_velocity[r, 0] == 0.0
        u[axis] = robots.velocity[i, axis] if velocity else robots.acceleration[i, axis]


@kernel
def optimistic_costs(
    i: int,
    detour: int,
    robots: RobotTable,
    responses: ResponseTable,
    settings: DecisionSettings,
    scratch: Scratch,
    closed: Flags,
    costs: Array,
) -> None:
    """Write the optimistic costs [s] of all responses that are not `closed` (k,) into `costs` (k * (1 + detours),).

    `detour`: 0 the straight line to the target, else the number of the detour.
    """
    first, angle, u = responses.kinds[robots.kind[i]], 0.0 if detour == 0 else settings.detours[detour - 1], np.zeros(3)
    for k in range(len(closed)):
        if not closed[k]:
            r = first + k
            preferred_control(i, r, angle, robots, responses, settings, scratch, u)
            until = max(settings.period, responses.settled[r])
            costs[detour * len(closed) + k] = optimistic_cost(i, r, until, u, robots, responses, settings, scratch)


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
