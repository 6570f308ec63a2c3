"""The decisions of many robots, discs or balls with goals at rest, one after the other: no Python in between.

What `navigator.Navigator` does for one robot of any shape among any obstacles, for the usual fleet. A robot that this
module has no answer for is told to ask the navigator.
"""

import numpy as np

from slalom.kernels.bezier import new_stack
from slalom.kernels.compiled import Array, Indices, inlined, kernel
from slalom.kernels.copying import fill
from slalom.kernels.costs import cost_of, least_cost
from slalom.kernels.exchange import SAFE, deepest_violation, nearest_free
from slalom.kernels.fleet import commit, course, foresee, in_reach, meeting, relative
from slalom.kernels.gather import gather, squeeze
from slalom.kernels.hulls import new_course
from slalom.kernels.tables import Answers, Fleet, Meeting, Rows, Survey, Terms, World
from slalom.kernels.windows import around, survey, who_is_met
from slalom.kernels.wish import passing_velocity, stopping_velocity
from slalom.tolerances import CANDIDATES, ELEMENTS, KEPT, TOUCHING

CLEAR, CONSTRAINED, KEEP, CONTINUE, SQUEEZED, ASK = 0, 1, 2, 3, 4, -1
SQUEEZES = 4
"""How often a choice is sought, with half the margin of the time before; after them the navigator is asked."""


@kernel
def wished(place: Array, velocity: Array, goal: Array, stop: bool, push: float, top: float, wanted: Array) -> None:
    """The velocity that leads from `place` to `goal`, into `wanted`."""
    away = goal[: len(wanted)] - place
    if stop:
        stopping_velocity(away, push, top, wanted)
    else:
        passing_velocity(away, velocity, push, top, wanted)


@inlined
def preferred(
    i: int, r: int, goal: Array, stop: bool, angle: float, fleet: Fleet, answers: Answers, terms: Terms, u: Array
) -> None:
    """The control of response r whose velocity, once it has settled, is the wished one, turned by `angle`; into u."""
    d, after = terms.dimension, answers.settled[r]
    room = np.empty((3, d))
    place, velocity, wanted = room[0], room[1], room[2]
    for axis in range(d):
        velocity[axis] = fleet.velocity[i, axis]
        # Where the robot will be then; a way that is turned off is turned off from where it is.
        place[axis] = fleet.position[i, axis] + (after * velocity[axis] if angle == 0.0 else 0.0)
    wished(place, velocity, goal, stop, fleet.most[i], fleet.top[i], wanted)
    if angle != 0.0:
        c, s = np.cos(angle), np.sin(angle)
        wanted[0], wanted[1] = c * wanted[0] - s * wanted[1], s * wanted[0] + c * wanted[1]
    u[:] = 0.0
    for axis in range(d):
        u[axis] = (wanted[axis] - answers.aim[r, 0] * velocity[axis]) / answers.aim[r, 1]


@kernel
def is_clear(i: int, squeezed: bool, rows: Rows, fleet: Fleet, world: World, terms: Terms) -> bool:
    """Whether robot i can go on as it is committed to; `squeezed`: without keeping the margin."""
    d, n = terms.dimension, fleet.points.shape[1]
    knots, count = np.empty(n + 1), 0
    drift = np.empty((n, 4, d))
    for p in range(n):
        if fleet.begin[i, p + 1] <= terms.now or fleet.begin[i, p + 1] <= fleet.begin[i, p]:
            continue
        knots[count] = fleet.begin[i, p] - terms.now
        for c in range(4):
            for axis in range(d):
                drift[count, c, axis] = fleet.points[i, p, c, axis]
        count += 1
        knots[count] = fleet.begin[i, p + 1] - terms.now
    if count == 0 or knots[count] < terms.horizon:
        return False
    if squeezed:
        squeeze(1.0, rows)
    points, gains, radius, growth, reach, hulls, body = relative(
        rows, world, knots[: count + 1], drift[:count], np.zeros((count, 4)), terms.horizon
    )
    if squeezed:
        squeeze(-1.0, rows)
    motion, q = new_course(hulls)
    gaps, element = np.empty(len(radius)), np.zeros(5)
    stack, u = new_stack(), np.zeros(3)
    less = KEPT if squeezed else KEPT + TOUCHING
    for s in range(len(body)):
        radius[s] -= less
        reach[s] -= less
    return bool(
        deepest_violation(points, gains, radius, growth, reach, hulls, gaps, stack, motion, q, u, element) == -1
    )


@inlined
def own_control(i: int, r: int, fleet: Fleet, answers: Answers, terms: Terms, u: Array) -> None:
    """The control of response r that changes nothing now: the present acceleration or velocity; into u."""
    u[:] = 0.0
    for axis in range(terms.dimension):
        u[axis] = fleet.velocity[i, axis] if answers.aim[r, 0] == 0.0 else fleet.push[i, axis]


@inlined
def best_of(
    i: int,
    rows: Rows,
    near: Indices,
    fleet: Fleet,
    world: World,
    answers: Answers,
    terms: Terms,
    best_u: Array,
) -> tuple[float, int, int]:
    """The cost, response and outcome of the exact choice that costs least; its control into best_u. Response -1: none.

    Ways that are turned off the one that is wished for are looked at where that is not clear, by responses that have
    any free control. What can not cost less than the best found so far is left out.
    """
    goal, stop, tolerance = fleet.target[i], fleet.halt[i], fleet.near[i]
    p, first = fleet.points.shape[1], answers.kinds[fleet.kind[i]]
    count = answers.kinds[fleet.kind[i] + 1] - first
    wanted, own = np.zeros(3), np.zeros(3)
    begin, points = np.empty(p + 1), np.empty((p, 4, 3))
    best, best_r, outcome, clear = np.inf, -1, CONSTRAINED, False
    meetings: list[Meeting] = []
    which, closed = np.full(count, -1), np.zeros(count, np.bool_)
    for turn in range(-1, len(terms.angles)):
        if turn >= 0 and clear:
            break
        angle = 0.0 if turn < 0 else terms.angles[turn]
        for k in range(count):
            r = first + k
            if closed[k]:
                continue
            until = max(terms.period, answers.settled[r])
            # A response that is clear keeps ways from being turned, whatever it costs.
            if (clear or turn >= 0) and best < np.inf and least_cost(i, r, until, fleet, answers, terms) >= best:
                continue
            preferred(i, r, goal, stop, angle, fleet, answers, terms, wanted)
            if which[k] < 0:
                which[k] = len(meetings)
                own_control(i, r, fleet, answers, terms, own)
                meetings.append(meeting(i, r, rows, fleet, world, answers, terms, own))
            m = meetings[which[k]]
            code, u, _, _ = nearest_free(
                wanted, terms.dimension, m.limits, m.points, m.gains, m.radius, m.growth, m.reach, m.hulls,
                ELEMENTS, CANDIDATES,
            )  # fmt: skip
            closed[k] = code != SAFE
            if code != SAFE:
                continue
            course(i, r, u, fleet, answers, terms, begin, points)
            cost = cost_of(i, until, goal, stop, tolerance, begin, points, near, fleet, world, terms)
            exact = turn < 0 and u[0] == wanted[0] and u[1] == wanted[1] and u[2] == wanted[2]
            clear = clear or exact
            if cost < best:
                best, best_r, outcome = cost, r, CLEAR if exact else CONSTRAINED
                fill(best_u, u)
    return best, best_r, outcome


@kernel
def decide(i: int, seen: Survey, fleet: Fleet, world: World, answers: Answers, terms: Terms) -> int:
    """The decision of robot i: its outcome. What it commits to goes into `fleet`."""
    near = in_reach(i, around(i, fleet, seen), fleet, terms)
    rows, overlaps = gather(i, who_is_met(i, near, seen, fleet, terms), fleet, world, terms)
    if overlaps:
        return ASK
    best_u = np.zeros(3)
    for level in range(SQUEEZES):
        best, r, outcome = best_of(i, rows, near, fleet, world, answers, terms, best_u)
        if level == 0:
            regret = fleet.regret[i]
            if r >= 0:
                until, goal = max(terms.period, answers.settled[r]), fleet.target[i]
                begin, points = fleet.begin[i], fleet.points[i]
                stop, tolerance = fleet.halt[i], fleet.near[i]
                kept = cost_of(i, until, goal, stop, tolerance, begin, points, near, fleet, world, terms)
                regret += max(0.0, kept - best)
            if regret <= terms.patience and is_clear(i, r < 0, rows, fleet, world, terms):
                fleet.regret[i] = regret
                return KEEP if r >= 0 else CONTINUE
        if r >= 0:
            commit(i, r, best_u, fleet, answers, terms)
            fleet.regret[i] = 0.0
            return outcome if level == 0 else SQUEEZED
        # With half the margin, then a quarter.
        squeeze(0.5**level * 0.5, rows)
    return ASK


@kernel
def look_around(order: Indices, fleet: Fleet, answers: Answers, terms: Terms) -> Survey:
    """What the decisions of the robots in `order` at this time have in common."""
    for k in range(len(fleet.present)):
        if fleet.present[k]:
            foresee(k, fleet, terms)
    return survey(order, fleet, answers, terms)


@kernel
def decide_all(order: Indices, seen: Survey, fleet: Fleet, world: World, answers: Answers, terms: Terms) -> int:
    """The decisions of the robots in `order`, one after the other; how many, up to one that must ask the navigator."""
    for k in range(len(order)):
        i = order[k]
        fleet.outcome[i] = decide(i, seen, fleet, world, answers, terms)
        if fleet.outcome[i] == ASK:
            return k
    return len(order)
