"""What a course costs a robot: how long it takes until it arrives; and what a response promises at best."""

import numpy as np

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.decision.encounters import response_path, state_on_path
from slalom.kernels.decision.neighbours import smallest_control_ball
from slalom.kernels.decision.tables import (
    WINDOWS,
    DecisionSettings,
    PassiveObstacles,
    ResponseTable,
    RobotTable,
    Scratch,
)
from slalom.kernels.decision.time_to_go import earliest_on_line, time_to_go
from slalom.kernels.geometry.cubic import new_stack
from slalom.kernels.jit import kernel


@kernel
def arrives(place: Array, speed: Array, goal: Array, stop: bool, tolerance: float) -> bool:
    """Whether a robot in this state is at its goal."""
    away, fast = 0.0, 0.0
    for axis in range(len(place)):
        away += (goal[axis] - place[axis]) ** 2
        fast += speed[axis] ** 2
    return bool(away <= tolerance * tolerance and (not stop or fast <= tolerance * tolerance))


@kernel
def new_scratch(pieces: int, dimension: int) -> Scratch:
    """Room for courses of so many pieces."""
    return Scratch(
        np.empty((2, pieces + 1)),
        np.empty((2, pieces, 4, 3)),
        np.empty((WINDOWS, 3)),
        np.empty(WINDOWS),
        new_stack(),
        np.zeros(3),
        np.empty(dimension),
        np.empty(dimension),
        np.empty(dimension),
        np.empty(dimension),
    )


@kernel
def arrival_within(
    i: int,
    until: float,
    begin: Array,
    points: Array,
    row: int,
    fleet: RobotTable,
    terms: DecisionSettings,
    place: Array,
    speed: Array,
) -> float:
    """When robot i arrives that follows a course of a table [s], if that is until `until`; -1 if not.

    Into `place` and `speed` where it is then, and how fast.
    """
    goal, stop, tolerance = fleet.target[i], fleet.stop[i], fleet.tolerance[i]
    away, fast = 0.0, fleet.max_speed[i]
    for axis in range(terms.dimension):
        away += (goal[axis] - fleet.position[i, axis]) ** 2
        fast += abs(fleet.velocity[i, axis])
    if away <= (tolerance + fast * until) ** 2:
        # Farther away it cannot arrive until then.
        for step in range(8):
            state_on_path(begin, points, row, terms.now + until * step / 8.0, place, speed)
            if arrives(place, speed, goal, stop, tolerance):
                return until * step / 8.0
    state_on_path(begin, points, row, terms.now + until, place, speed)
    return -1.0


@kernel
def manoeuvre_cost(
    i: int,
    until: float,
    begin: Array,
    points: Array,
    row: int,
    near: Indices,
    fleet: RobotTable,
    world: PassiveObstacles,
    terms: DecisionSettings,
    draft: Scratch,
) -> float:
    """How long [s] robot i needs that follows a course until `until`, then free but for who stands in the way."""
    d, goal = terms.dimension, fleet.target[i]
    place, speed, left = draft.position, draft.velocity, draft.displacement
    there = arrival_within(i, until, begin, points, row, fleet, terms, place, speed)
    if there >= 0.0:
        return there
    for axis in range(d):
        left[axis] = goal[axis] - place[axis]
    cost = until + time_to_go(
        left,
        speed,
        fleet.max_acceleration[i],
        fleet.max_speed[i],
        fleet.tolerance[i],
        fleet.stop[i],
        draft.desired_velocity,
    )
    if d == 2 and len(terms.detours) > 0:
        longer = 0.0
        for k in near:
            reach = fleet.radius[i] + fleet.radius[k] + terms.margin
            if may_block(place, goal, fleet.end_position[k, 0], fleet.end_position[k, 1], reach):
                longer += detour_length(place, goal, fleet.end_position[k, 0], fleet.end_position[k, 1], reach)
        for e in range(len(world.end_radii)):
            reach = world.end_radii[e] + fleet.radius[i] + terms.margin
            longer += detour_length(place, goal, world.end_positions[e, 0], world.end_positions[e, 1], reach)
        cost += longer / fleet.max_speed[i]
    return float(cost)


@kernel
def optimistic_cost(
    i: int,
    r: int,
    until: float,
    u: Array,
    fleet: RobotTable,
    answers: ResponseTable,
    terms: DecisionSettings,
    draft: Scratch,
) -> float:
    """What response r costs robot i [s] that prefers the control u, if nothing is in its way.

    Of the smallest ball that all admissible controls lie in it is the nearest to u that counts. To pass through a
    goal it is given the time of a straight line, which is no more than it needs.
    """
    d, goal = terms.dimension, fleet.target[i]
    place, speed, left, inside = draft.position, draft.velocity, draft.displacement, draft.control
    share, radius = smallest_control_ball(i, r, fleet, answers)
    square = 0.0
    for axis in range(d):
        inside[axis] = u[axis]
        square += (u[axis] + share * fleet.velocity[i, axis]) ** 2
    if square > radius * radius:
        for axis in range(d):
            middle = -share * fleet.velocity[i, axis]
            inside[axis] = middle + (u[axis] - middle) * (radius / np.sqrt(square))
    response_path(i, r, inside, fleet, answers, terms, draft.times, draft.points, 0)
    there = arrival_within(i, until, draft.times, draft.points, 0, fleet, terms, place, speed)
    if there >= 0.0:
        return there
    square, along, fast = 0.0, 0.0, 0.0
    for axis in range(d):
        left[axis] = goal[axis] - place[axis]
        square += left[axis] ** 2
        along += left[axis] * speed[axis]
        fast += speed[axis] ** 2
    if fleet.stop[i]:
        return until + time_to_go(
            left, speed, fleet.max_acceleration[i], fleet.max_speed[i], fleet.tolerance[i], True, draft.desired_velocity
        )
    distance, quick = max(np.sqrt(square), 1e-12), max(fleet.max_speed[i], np.sqrt(fast))
    return until + earliest_on_line(
        distance - 0.5 * fleet.tolerance[i], along / distance, fleet.max_acceleration[i], quick
    )


@kernel
def detour_length(place: Array, goal: Array, x: float, y: float, radius: float) -> float:
    """By how much [m] the way from `place` to `goal` in the plane around a disc is longer than straight."""
    ax, ay, bx, by = place[0] - x, place[1] - y, goal[0] - x, goal[1] - y
    first, second = np.sqrt(ax * ax + ay * ay), np.sqrt(bx * bx + by * by)
    cosine = (ax * bx + ay * by) / max(first * second, 1e-12)
    first, second = max(first, radius), max(second, radius)
    angle = np.arccos(min(1.0, max(-1.0, cosine))) - np.arccos(radius / first) - np.arccos(radius / second)
    if angle <= 0.0:
        return 0.0
    tangents = np.sqrt(first * first - radius * radius) + np.sqrt(second * second - radius * radius)
    straight = np.sqrt((goal[0] - place[0]) ** 2 + (goal[1] - place[1]) ** 2)
    return float(max(tangents + radius * angle - straight, 0.0))


@kernel
def may_block(place: Array, goal: Array, x: float, y: float, radius: float) -> bool:
    """Whether a disc may lie on the straight way from `place` to `goal`; if not, `longer_way` around it is 0."""
    dx, dy, tx, ty = goal[0] - place[0], goal[1] - place[1], x - place[0], y - place[1]
    along = min(1.0, max(0.0, (tx * dx + ty * dy) / (dx * dx + dy * dy + 1e-300)))
    return bool((tx - along * dx) ** 2 + (ty - along * dy) ** 2 < (1.0 + 1e-6) * radius * radius)


@kernel
def detour_lengths(place: Array, goal: Array, centers: Array, radii: Array) -> Array:
    """`longer_way` around each of the discs (n, 2), (n,): (n,)."""
    longer = np.empty(len(radii))
    for k in range(len(radii)):
        longer[k] = detour_length(place, goal, centers[k, 0], centers[k, 1], radii[k])
    return longer
