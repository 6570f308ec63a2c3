"""What a course costs a robot: how long it takes until it arrives; and what no course of a response costs less than."""

import numpy as np

from slalom.kernels.arrival import no_sooner
from slalom.kernels.bezier import slope, value
from slalom.kernels.compiled import Array, Indices, kernel
from slalom.kernels.gather import place_at
from slalom.kernels.meeting import in_the_way, longer_way
from slalom.kernels.tables import Answers, Fleet, Terms, World
from slalom.kernels.windows import smallest_limit
from slalom.kernels.wish import time_to_go, time_to_stop
from slalom.tolerances import COST


@kernel
def arrives(place: Array, speed: Array, goal: Array, stop: bool, tolerance: float) -> bool:
    """Whether a robot in this state is at its goal."""
    away, fast = 0.0, 0.0
    for axis in range(len(place)):
        away += (goal[axis] - place[axis]) ** 2
        fast += speed[axis] ** 2
    return bool(away <= tolerance * tolerance and (not stop or fast <= tolerance * tolerance))


@kernel
def cost_of(
    i: int,
    until: float,
    goal: Array,
    stop: bool,
    tolerance: float,
    begin: Array,
    points: Array,
    near: Indices,
    fleet: Fleet,
    world: World,
    terms: Terms,
) -> float:
    """How long [s] robot i needs that follows a course until `until`, then free but for who stands in the way."""
    d = terms.dimension
    room = np.empty((4, d))
    place, speed, wanted, left = room[0], room[1], room[2], room[3]
    away, fast = 0.0, fleet.top[i]
    for axis in range(d):
        away += (goal[axis] - fleet.position[i, axis]) ** 2
        fast += abs(fleet.velocity[i, axis])
    if away <= (tolerance + fast * until) ** 2:
        # Farther away it cannot arrive until then.
        for step in range(8):
            place_at(begin, points, terms.now + until * step / 8.0, place, speed)
            if arrives(place, speed, goal, stop, tolerance):
                return until * step / 8.0
    place_at(begin, points, terms.now + until, place, speed)
    for axis in range(d):
        left[axis] = goal[axis] - place[axis]
    cost = until + time_to_go(left, speed, fleet.most[i], fleet.top[i], tolerance, stop, wanted)
    if d == 2 and len(terms.angles) > 0:
        longer = 0.0
        for k in near:
            reach = fleet.radius[i] + fleet.radius[k] + terms.margin
            if in_the_way(place, goal, fleet.later[k, 0], fleet.later[k, 1], reach):
                longer += longer_way(place, goal, fleet.later[k, 0], fleet.later[k, 1], reach)
        for e in range(len(world.reach)):
            reach = world.reach[e] + fleet.radius[i] + terms.margin
            longer += longer_way(place, goal, world.ends[e, 0], world.ends[e, 1], reach)
        cost += longer / fleet.top[i]
    return float(cost)


@kernel
def least_cost(i: int, r: int, until: float, fleet: Fleet, answers: Answers, terms: Terms) -> float:
    """What no admissible control of response r costs less than [s], see `cost_of`; whether it is free or not.

    Nobody gets ahead, in the direction of the goal, farther and faster than with the control farthest in that
    direction of the smallest ball that all admissible ones lie in.
    """
    d, goal = terms.dimension, fleet.target[i]
    square, along, speed, fast = 0.0, 0.0, 0.0, fleet.top[i]
    for axis in range(d):
        away = goal[axis] - fleet.position[i, axis]
        square += away * away
        along += away * fleet.velocity[i, axis]
        speed += fleet.velocity[i, axis] ** 2
        fast += abs(fleet.velocity[i, axis])
    if square <= (fleet.near[i] + fast * until) ** 2:
        # It may be there before, see `cost_of`.
        return 0.0
    distance = np.sqrt(square)
    along /= distance
    p = answers.first[r]
    while p < answers.first[r + 1] - 1 and answers.knots[p + r + 1] <= until:
        p += 1
    begin, end = answers.knots[p + r], answers.knots[p + r + 1]
    x, b, g = (until - begin) / (end - begin), answers.place[p], answers.gain[p]
    share, radius = smallest_limit(i, r, fleet, answers)
    # Of place and velocity: the share of the present velocity, and of the control, of whichever sign.
    gain, rise = value(g[0], g[1], g[2], g[3], x), slope(g[0], g[1], g[2], g[3], x)
    ahead = (value(b[0], b[1], b[2], b[3], x) - gain * share) * along + abs(gain) * radius
    later = ((slope(b[0], b[1], b[2], b[3], x) - rise * share) * along + abs(rise) * radius) / (end - begin)
    left = distance - ahead
    if fleet.halt[i]:
        still = time_to_stop(max(left - fleet.near[i], 0.0), 0.0, fleet.most[i], fleet.top[i])
    else:
        quick = max(fleet.top[i], np.sqrt(speed)) * (1.0 + COST)
        still = no_sooner(left - 0.5 * fleet.near[i], min(later, quick), fleet.most[i], quick)
    return (until + still) * (1.0 - COST)
