"""The decisions of many robots, discs or balls with goals at rest, one after the other: no Python in between.

What `navigator.Navigator` does for one robot of any shape among any obstacles, for the usual fleet. A robot that this
module has no answer for is told to ask the navigator.
"""

import numpy as np

from slalom.kernels.arrays import Array, Flags, Indices
from slalom.kernels.decision.encounters import commit, course, foresee, gather, in_reach, meeting, relative, squeeze
from slalom.kernels.decision.manoeuvre_cost import cost_of, new_draft, promise
from slalom.kernels.decision.motion_clear import directly, passes
from slalom.kernels.decision.neighbours import around, survey, whereabouts, who_is_met
from slalom.kernels.decision.tables import WINDOWS, Answers, Draft, Fleet, Meeting, Rows, Survey, Terms, World
from slalom.kernels.decision.time_to_go import passing_velocity, stopping_velocity
from slalom.kernels.geometry.cubic import fill, new_stack
from slalom.kernels.geometry.hulls import new_course
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.selection.exchange import SAFE, deepest_violation, nearest_free
from slalom.tolerances import CANDIDATES, COST, ELEMENTS, KEPT, TOUCHING, WORTH

CLEAR, CONSTRAINED, KEEP, CONTINUE, SQUEEZED, ASK, TRY = 0, 1, 2, 3, 4, -1, -2
FEW = 30
"""Of fewer rows a table of segments is made as quickly as it is asked whether one is needed: `kernels.direct`."""
SQUEEZES = 4
"""How often a choice is sought, with half the margin of the time before; after them the navigator is asked."""


@inlined
def preferred(
    i: int, r: int, angle: float, fleet: Fleet, answers: Answers, terms: Terms, draft: Draft, u: Array
) -> None:
    """The control of response r whose velocity, once it has settled, is the wished one, turned by `angle`; into u."""
    d, after = terms.dimension, answers.settled[r]
    away, velocity, wanted = draft.left, draft.speed, draft.wanted
    for axis in range(d):
        velocity[axis] = fleet.velocity[i, axis]
        # From where the robot will be then; a way that is turned off is turned off from where it is.
        ahead = after * velocity[axis] if angle == 0.0 else 0.0
        away[axis] = fleet.target[i, axis] - (fleet.position[i, axis] + ahead)
    if fleet.halt[i]:
        stopping_velocity(away, fleet.most[i], fleet.top[i], wanted)
    else:
        passing_velocity(away, velocity, fleet.most[i], fleet.top[i], wanted)
    if angle != 0.0:
        c, s = np.cos(angle), np.sin(angle)
        wanted[0], wanted[1] = c * wanted[0] - s * wanted[1], s * wanted[0] + c * wanted[1]
    for axis in range(d):
        u[axis] = (wanted[axis] - answers.aim[r, 0] * velocity[axis]) / answers.aim[r, 1]


@kernel
def goes_on(i: int, squeezed: bool, near: Indices, fleet: Fleet, world: World, terms: Terms) -> int:
    """Whether robot i can go on as it is committed to: KEEP; CONSTRAINED if not; ASK if it overlaps something.

    `squeezed`: without keeping the margin. Only those are looked at whom it may meet on that course.
    """
    d, n, end = terms.dimension, fleet.points.shape[1], -np.inf
    for p in range(n):
        if fleet.begin[i, p + 1] > max(terms.now, fleet.begin[i, p]):
            end = fleet.begin[i, p + 1] - terms.now
    if end < terms.horizon:
        return CONSTRAINED
    middle, spread = np.empty((WINDOWS, 3)), np.empty(WINDOWS)
    whereabouts(fleet.begin[i], fleet.points[i], terms, middle, spread)
    rows, overlaps = gather(i, who_is_met(i, near, middle, spread, fleet, terms), fleet, world, terms)
    if overlaps:
        return ASK
    if squeezed:
        squeeze(1.0, rows)
    stack, unmet = new_stack(), np.zeros(len(rows.hull), np.bool_)
    if passes(rows, unmet, fleet.begin, fleet.points, i, i, terms.now, terms.horizon, stack):
        return KEEP
    knots, drift, count = np.empty(n + 1), np.empty((n, 4, d)), 0
    for p in range(n):
        if fleet.begin[i, p + 1] <= max(terms.now, fleet.begin[i, p]):
            continue
        knots[count] = fleet.begin[i, p] - terms.now
        for c in range(4):
            for axis in range(d):
                drift[count, c, axis] = fleet.points[i, p, c, axis]
        count += 1
        knots[count] = fleet.begin[i, p + 1] - terms.now
    points, gains, radius, growth, reach, hulls, _ = relative(
        rows, world, knots[: count + 1], drift[:count], np.zeros((count, 4)), terms.horizon
    )
    motion, q = new_course(hulls)
    gaps, element = np.empty(len(radius)), np.zeros(5)
    u = np.zeros(3)
    less = KEPT if squeezed else KEPT + TOUCHING
    for s in range(len(radius)):
        radius[s] -= less
        reach[s] -= less
    worst = deepest_violation(points, gains, radius, growth, reach, hulls, gaps, stack, motion, q, u, element)
    return KEEP if worst == -1 else CONSTRAINED


@inlined
def own_control(i: int, r: int, fleet: Fleet, answers: Answers, terms: Terms, u: Array) -> None:
    """The control of response r that changes nothing now: the present acceleration or velocity; into u."""
    for axis in range(terms.dimension):
        u[axis] = fleet.velocity[i, axis] if answers.aim[r, 0] == 0.0 else fleet.push[i, axis]


@kernel
def promises(
    i: int, turn: int, fleet: Fleet, answers: Answers, terms: Terms, draft: Draft, closed: Flags, hopes: Array
) -> None:
    """What each response that is not `closed` promises on the way of this `turn`, 0 the straight one, into `hopes`."""
    first, angle, u = answers.kinds[fleet.kind[i]], 0.0 if turn == 0 else terms.angles[turn - 1], np.zeros(3)
    for k in range(len(closed)):
        if not closed[k]:
            r = first + k
            preferred(i, r, angle, fleet, answers, terms, draft, u)
            until = max(terms.period, answers.settled[r])
            hopes[turn * len(closed) + k] = promise(i, r, until, u, fleet, answers, terms, draft)


@kernel
def kept_for(
    i: int,
    k: int,
    least: float,
    near: Indices,
    fleet: Fleet,
    world: World,
    answers: Answers,
    terms: Terms,
    draft: Draft,
    kept: Array,
) -> int:
    """TRY if robot i, which could do with `least` by its k-th response, loses too much by keeping its manoeuvre.

    Else as `goes_on`. `kept`: what keeping costs beside each response; inf: not known yet.
    """
    r = answers.kinds[fleet.kind[i]] + k
    if kept[k] == np.inf:
        until = max(terms.period, answers.settled[r])
        kept[k] = cost_of(i, until, fleet.begin, fleet.points, i, near, fleet, world, terms, draft)
    regret = fleet.regret[i] + max(0.0, kept[k] - least)
    if regret > terms.patience:
        return TRY
    on = goes_on(i, False, near, fleet, world, terms)
    if on == KEEP:
        fleet.regret[i] = regret
    return on


@kernel
def first_least(hopes: Array) -> int:
    """The first that is the least, but for COST."""
    least = np.inf
    for k in range(len(hopes)):
        least = min(least, hopes[k])
    for k in range(len(hopes)):
        if hopes[k] <= least + COST:
            return k
    return -1


@inlined
def choose(m: Meeting, wanted: Array, terms: Terms, u: Array) -> bool:
    """The control nearest to `wanted` that meets nothing and is admissible, into u; whether there is one."""
    code, found, _, _ = nearest_free(
        wanted, terms.dimension, m.limits, m.points, m.gains, m.radius, m.growth, m.reach, m.hulls, ELEMENTS, CANDIDATES
    )
    if code == SAFE:
        fill(u, found)
    return code == SAFE


@inlined
def best_of(
    i: int,
    rows: Rows,
    met: Indices,
    near: Indices,
    fleet: Fleet,
    world: World,
    answers: Answers,
    terms: Terms,
    draft: Draft,
    keep: bool,
    kept: Array,
    hopes: Array,
    best_u: Array,
) -> tuple[int, int]:
    """The response and outcome of the exact choice that costs least, its control into best_u. Response -1: none.

    Responses are looked at in the order of what they promise, until none promises to be better than the best choice;
    then, if that way is not clear, those that have any free control on ways that are turned off it. With `keep` the
    outcome is KEEP as soon as nothing that is left promises enough to change what the robot is committed to, if that
    is clear.

    Args:
        met: the robots that the rows after those of passive bodies belong to. near: those in reach.
        kept: see `kept_for`. hopes: what is promised on the straight way; room for the others, with inf.
    """
    first, count, worth = answers.kinds[fleet.kind[i]], len(kept), WORTH * terms.patience + COST
    wanted, own, u = np.zeros(3), np.zeros(3), np.zeros(3)
    best, best_r, outcome, clear, turned = np.inf, -1, CONSTRAINED, False, False
    meetings: list[Meeting] = []
    which, closed = np.full(count, -1), np.zeros(count, np.bool_)
    while True:
        at = first_least(hopes)
        if hopes[at] >= best - worth and not (clear or turned):
            turned = True
            for turn in range(1, 1 + len(terms.angles)):
                promises(i, turn, fleet, answers, terms, draft, closed, hopes)
            at = first_least(hopes)
        done = hopes[at] >= best - worth
        k, least = (best_r - first, best) if done else (at % count, hopes[at])
        if keep and least < np.inf:
            on = kept_for(i, k, least, near, fleet, world, answers, terms, draft, kept)
            keep = on == TRY
            if on == KEEP:
                return best_r, KEEP
        if done:
            return best_r, outcome
        r, turn, hopes[at] = first + k, at // count, np.inf
        if closed[k]:
            continue
        angle = 0.0 if turn == 0 else terms.angles[turn - 1]
        preferred(i, r, angle, fleet, answers, terms, draft, wanted)
        own_control(i, r, fleet, answers, terms, own)
        asked = which[k] < 0 and len(rows.body) >= FEW
        if not (asked and directly(i, r, wanted, own, met, rows, fleet, answers, terms, draft, u)):
            if which[k] < 0:
                which[k] = len(meetings)
                meetings.append(meeting(i, r, rows, fleet, world, answers, terms, own))
            closed[k] = not choose(meetings[which[k]], wanted, terms, u)
            if closed[k]:
                continue
            course(i, r, u, fleet, answers, terms, draft.begin, draft.points, 0)
        until = max(terms.period, answers.settled[r])
        cost = cost_of(i, until, draft.begin, draft.points, 0, near, fleet, world, terms, draft)
        exact = turn == 0 and u[0] == wanted[0] and u[1] == wanted[1] and u[2] == wanted[2]
        clear = clear or exact
        if cost < best - COST:
            best, best_r, outcome = cost, r, CLEAR if exact else CONSTRAINED
            fill(best_u, u)


@kernel
def decide(i: int, seen: Survey, fleet: Fleet, world: World, answers: Answers, terms: Terms) -> int:
    """The decision of robot i: its outcome. What it commits to goes into `fleet`."""
    near = in_reach(i, around(i, fleet, seen), fleet, terms)
    count = answers.kinds[fleet.kind[i] + 1] - answers.kinds[fleet.kind[i]]
    draft, best_u = new_draft(fleet.points.shape[1], terms.dimension), np.zeros(3)
    kept, nothing = np.full(count, np.inf), np.zeros(count, np.bool_)
    hopes = np.full(count * (1 + len(terms.angles)), np.inf)
    promises(i, 0, fleet, answers, terms, draft, nothing, hopes)
    patient, on = fleet.regret[i] <= terms.patience, CONSTRAINED
    if patient:
        # Most keep what they have; for that they need not know all whom they could meet.
        k = first_least(hopes)
        on = kept_for(i, k, hopes[k], near, fleet, world, answers, terms, draft, kept)
        if on in (KEEP, ASK):
            return on
    met = who_is_met(i, near, seen.middle[i], seen.spread[i], fleet, terms)
    rows, overlaps = gather(i, met, fleet, world, terms)
    if overlaps:
        return ASK
    for level in range(SQUEEZES):
        if level > 0:
            # With half the margin, then a quarter.
            squeeze(0.5**level, rows)
            hopes[:] = np.inf
            promises(i, 0, fleet, answers, terms, draft, nothing, hopes)
        keep = level == 0 and on == TRY
        r, outcome = best_of(i, rows, met, near, fleet, world, answers, terms, draft, keep, kept, hopes, best_u)
        if outcome == KEEP:
            return KEEP
        if r >= 0:
            commit(i, r, best_u, fleet, answers, terms)
            fleet.regret[i] = 0.0
            return outcome if level == 0 else SQUEEZED
        if level == 0 and patient and goes_on(i, True, near, fleet, world, terms) == KEEP:
            return CONTINUE
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
