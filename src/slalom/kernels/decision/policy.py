"""The decisions of many robots, discs or balls with goals at rest, one after the other: no Python in between.

What `navigator.Navigator` does for one robot of any shape among any obstacles, for the usual fleet. A robot that this
module has no answer for is told to ask the navigator.
"""

import numpy as np

from slalom.kernels.arrays import Array, Flags, Indices
from slalom.kernels.decision.encounters import (
    commit,
    in_reach,
    obstacle_pieces,
    predict,
    reduce_margin,
    relative,
    relative_motion,
    response_path,
)
from slalom.kernels.decision.manoeuvre_cost import manoeuvre_cost, new_scratch, optimistic_cost
from slalom.kernels.decision.motion_clear import path_is_clear, preferred_is_free
from slalom.kernels.decision.neighbours import bounding_balls, cell_list, neighbours_in_cells, reachable_neighbours
from slalom.kernels.decision.tables import (
    WINDOWS,
    CellList,
    DecisionSettings,
    ObstaclePieces,
    PassiveObstacles,
    RelativeMotion,
    ResponseTable,
    RobotTable,
    Scratch,
)
from slalom.kernels.decision.time_to_go import passing_velocity, stopping_velocity
from slalom.kernels.geometry.cubic import copy_into, new_stack
from slalom.kernels.geometry.hulls import new_path
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.selection.exchange import SAFE, deepest_violation, nearest_free
from slalom.tolerances import CANDIDATES, COMMITTED_SLACK, CONTACT_SLACK, COST_TIE, ELEMENTS, MIN_IMPROVEMENT

CLEAR, CONSTRAINED, KEPT_OUTCOME, CONTINUED, SQUEEZED, FALL_BACK, SEARCH = 0, 1, 2, 3, 4, -1, -2
DIRECT_TEST_ROWS = 30
"""Of fewer rows a table of segments is made as quickly as it is asked whether one is needed: `kernels.direct`."""
MARGIN_STEPS = 4
"""How often a choice is sought, with half the margin of the time before; after them the navigator is asked."""


@inlined
def preferred_control(
    i: int,
    r: int,
    angle: float,
    fleet: RobotTable,
    answers: ResponseTable,
    terms: DecisionSettings,
    draft: Scratch,
    u: Array,
) -> None:
    """The control of response r whose velocity, once it has settled, is the wished one, turned by `angle`; into u."""
    d, after = terms.dimension, answers.settled[r]
    away, velocity, wanted = draft.displacement, draft.velocity, draft.desired_velocity
    for axis in range(d):
        velocity[axis] = fleet.velocity[i, axis]
        # From where the robot will be then; a way that is turned off is turned off from where it is.
        ahead = after * velocity[axis] if angle == 0.0 else 0.0
        away[axis] = fleet.target[i, axis] - (fleet.position[i, axis] + ahead)
    if fleet.stop[i]:
        stopping_velocity(away, fleet.max_acceleration[i], fleet.max_speed[i], wanted)
    else:
        passing_velocity(away, velocity, fleet.max_acceleration[i], fleet.max_speed[i], wanted)
    if angle != 0.0:
        c, s = np.cos(angle), np.sin(angle)
        wanted[0], wanted[1] = c * wanted[0] - s * wanted[1], s * wanted[0] + c * wanted[1]
    for axis in range(d):
        u[axis] = (wanted[axis] - answers.settled_velocity[r, 0] * velocity[axis]) / answers.settled_velocity[r, 1]


@kernel
def committed_is_clear(
    i: int, squeezed: bool, near: Indices, fleet: RobotTable, world: PassiveObstacles, terms: DecisionSettings
) -> int:
    """Whether robot i can go on as it is committed to: KEEP; CONSTRAINED if not; ASK if it overlaps something.

    `squeezed`: without keeping the margin. Only those are looked at whom it may meet on that course.
    """
    d, n, end = terms.dimension, fleet.committed_points.shape[1], -np.inf
    for p in range(n):
        if fleet.committed_times[i, p + 1] > max(terms.now, fleet.committed_times[i, p]):
            end = fleet.committed_times[i, p + 1] - terms.now
    if end < terms.horizon:
        return CONSTRAINED
    middle, spread = np.empty((WINDOWS, 3)), np.empty(WINDOWS)
    bounding_balls(fleet.committed_times[i], fleet.committed_points[i], terms, middle, spread)
    rows, overlaps = obstacle_pieces(
        i, reachable_neighbours(i, near, middle, spread, fleet, terms), fleet, world, terms
    )
    if overlaps:
        return FALL_BACK
    if squeezed:
        reduce_margin(1.0, rows)
    stack, unmet = new_stack(), np.zeros(len(rows.hull), np.bool_)
    if path_is_clear(rows, unmet, fleet.committed_times, fleet.committed_points, i, i, terms.now, terms.horizon, stack):
        return KEPT_OUTCOME
    knots, drift, count = np.empty(n + 1), np.empty((n, 4, d)), 0
    for p in range(n):
        if fleet.committed_times[i, p + 1] <= max(terms.now, fleet.committed_times[i, p]):
            continue
        knots[count] = fleet.committed_times[i, p] - terms.now
        for c in range(4):
            for axis in range(d):
                drift[count, c, axis] = fleet.committed_points[i, p, c, axis]
        count += 1
        knots[count] = fleet.committed_times[i, p + 1] - terms.now
    points, gains, radius, growth, reach, hulls, _ = relative(
        rows, world, knots[: count + 1], drift[:count], np.zeros((count, 4)), terms.horizon
    )
    motion, q = new_path(hulls)
    gaps, element = np.empty(len(radius)), np.zeros(5)
    u = np.zeros(3)
    less = COMMITTED_SLACK if squeezed else COMMITTED_SLACK + CONTACT_SLACK
    for s in range(len(radius)):
        radius[s] -= less
        reach[s] -= less
    worst = deepest_violation(points, gains, radius, growth, reach, hulls, gaps, stack, motion, q, u, element)
    return KEPT_OUTCOME if worst == -1 else CONSTRAINED


@inlined
def unchanged_control(
    i: int, r: int, fleet: RobotTable, answers: ResponseTable, terms: DecisionSettings, u: Array
) -> None:
    """The control of response r that changes nothing now: the present acceleration or velocity; into u."""
    for axis in range(terms.dimension):
        u[axis] = fleet.velocity[i, axis] if answers.settled_velocity[r, 0] == 0.0 else fleet.acceleration[i, axis]


@kernel
def optimistic_costs(
    i: int,
    turn: int,
    fleet: RobotTable,
    answers: ResponseTable,
    terms: DecisionSettings,
    draft: Scratch,
    closed: Flags,
    hopes: Array,
) -> None:
    """What each response that is not `closed` promises on the way of this `turn`, 0 the straight one, into `hopes`."""
    first, angle, u = answers.kinds[fleet.kind[i]], 0.0 if turn == 0 else terms.detours[turn - 1], np.zeros(3)
    for k in range(len(closed)):
        if not closed[k]:
            r = first + k
            preferred_control(i, r, angle, fleet, answers, terms, draft, u)
            until = max(terms.period, answers.settled[r])
            hopes[turn * len(closed) + k] = optimistic_cost(i, r, until, u, fleet, answers, terms, draft)


@kernel
def keep_committed(
    i: int,
    k: int,
    least: float,
    near: Indices,
    fleet: RobotTable,
    world: PassiveObstacles,
    answers: ResponseTable,
    terms: DecisionSettings,
    draft: Scratch,
    kept: Array,
) -> int:
    """TRY if robot i, which could do with `least` by its k-th response, loses too much by keeping its manoeuvre.

    Else as `goes_on`. `kept`: what keeping costs beside each response; inf: not known yet.
    """
    r = answers.kinds[fleet.kind[i]] + k
    if kept[k] == np.inf:
        until = max(terms.period, answers.settled[r])
        kept[k] = manoeuvre_cost(
            i, until, fleet.committed_times, fleet.committed_points, i, near, fleet, world, terms, draft
        )
    regret = fleet.regret[i] + max(0.0, kept[k] - least)
    if regret > terms.patience:
        return SEARCH
    on = committed_is_clear(i, False, near, fleet, world, terms)
    if on == KEPT_OUTCOME:
        fleet.regret[i] = regret
    return on


@kernel
def first_least(hopes: Array) -> int:
    """The first that is the least, but for COST."""
    least = np.inf
    for k in range(len(hopes)):
        least = min(least, hopes[k])
    for k in range(len(hopes)):
        if hopes[k] <= least + COST_TIE:
            return k
    return -1


@inlined
def choose(m: RelativeMotion, wanted: Array, terms: DecisionSettings, u: Array) -> bool:
    """The control nearest to `wanted` that meets nothing and is admissible, into u; whether there is one."""
    code, found, _, _ = nearest_free(
        wanted,
        terms.dimension,
        m.limits,
        m.points,
        m.gains,
        m.radius,
        m.growth,
        m.bounding_radius,
        m.hulls,
        ELEMENTS,
        CANDIDATES,
    )
    if code == SAFE:
        copy_into(u, found)
    return code == SAFE


@inlined
def best_response(
    i: int,
    rows: ObstaclePieces,
    met: Indices,
    near: Indices,
    fleet: RobotTable,
    world: PassiveObstacles,
    answers: ResponseTable,
    terms: DecisionSettings,
    draft: Scratch,
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
    first, count, worth = answers.kinds[fleet.kind[i]], len(kept), MIN_IMPROVEMENT * terms.patience + COST_TIE
    wanted, own, u = np.zeros(3), np.zeros(3), np.zeros(3)
    best, best_r, outcome, clear, turned = np.inf, -1, CONSTRAINED, False, False
    meetings: list[RelativeMotion] = []
    which, closed = np.full(count, -1), np.zeros(count, np.bool_)
    while True:
        at = first_least(hopes)
        if hopes[at] >= best - worth and not (clear or turned):
            turned = True
            for turn in range(1, 1 + len(terms.detours)):
                optimistic_costs(i, turn, fleet, answers, terms, draft, closed, hopes)
            at = first_least(hopes)
        done = hopes[at] >= best - worth
        k, least = (best_r - first, best) if done else (at % count, hopes[at])
        if keep and least < np.inf:
            on = keep_committed(i, k, least, near, fleet, world, answers, terms, draft, kept)
            keep = on == SEARCH
            if on == KEPT_OUTCOME:
                return best_r, KEPT_OUTCOME
        if done:
            return best_r, outcome
        r, turn, hopes[at] = first + k, at // count, np.inf
        if closed[k]:
            continue
        angle = 0.0 if turn == 0 else terms.detours[turn - 1]
        preferred_control(i, r, angle, fleet, answers, terms, draft, wanted)
        unchanged_control(i, r, fleet, answers, terms, own)
        asked = which[k] < 0 and len(rows.body) >= DIRECT_TEST_ROWS
        if not (asked and preferred_is_free(i, r, wanted, own, met, rows, fleet, answers, terms, draft, u)):
            if which[k] < 0:
                which[k] = len(meetings)
                meetings.append(relative_motion(i, r, rows, fleet, world, answers, terms, own))
            closed[k] = not choose(meetings[which[k]], wanted, terms, u)
            if closed[k]:
                continue
            response_path(i, r, u, fleet, answers, terms, draft.times, draft.points, 0)
        until = max(terms.period, answers.settled[r])
        cost = manoeuvre_cost(i, until, draft.times, draft.points, 0, near, fleet, world, terms, draft)
        exact = turn == 0 and u[0] == wanted[0] and u[1] == wanted[1] and u[2] == wanted[2]
        clear = clear or exact
        if cost < best - COST_TIE:
            best, best_r, outcome = cost, r, CLEAR if exact else CONSTRAINED
            copy_into(best_u, u)


@kernel
def decide(
    i: int, seen: CellList, fleet: RobotTable, world: PassiveObstacles, answers: ResponseTable, terms: DecisionSettings
) -> int:
    """The decision of robot i: its outcome. What it commits to goes into `fleet`."""
    near = in_reach(i, neighbours_in_cells(i, fleet, seen), fleet, terms)
    count = answers.kinds[fleet.kind[i] + 1] - answers.kinds[fleet.kind[i]]
    draft, best_u = new_scratch(fleet.committed_points.shape[1], terms.dimension), np.zeros(3)
    kept, nothing = np.full(count, np.inf), np.zeros(count, np.bool_)
    hopes = np.full(count * (1 + len(terms.detours)), np.inf)
    optimistic_costs(i, 0, fleet, answers, terms, draft, nothing, hopes)
    patient, on = fleet.regret[i] <= terms.patience, CONSTRAINED
    if patient:
        # Most keep what they have; for that they need not know all whom they could meet.
        k = first_least(hopes)
        on = keep_committed(i, k, hopes[k], near, fleet, world, answers, terms, draft, kept)
        if on in (KEPT_OUTCOME, FALL_BACK):
            return on
    met = reachable_neighbours(i, near, seen.reachable_centers[i], seen.reachable_radii[i], fleet, terms)
    rows, overlaps = obstacle_pieces(i, met, fleet, world, terms)
    if overlaps:
        return FALL_BACK
    for level in range(MARGIN_STEPS):
        if level > 0:
            # With half the margin, then a quarter.
            reduce_margin(0.5**level, rows)
            hopes[:] = np.inf
            optimistic_costs(i, 0, fleet, answers, terms, draft, nothing, hopes)
        keep = level == 0 and on == SEARCH
        r, outcome = best_response(i, rows, met, near, fleet, world, answers, terms, draft, keep, kept, hopes, best_u)
        if outcome == KEPT_OUTCOME:
            return KEPT_OUTCOME
        if r >= 0:
            commit(i, r, best_u, fleet, answers, terms)
            fleet.regret[i] = 0.0
            return outcome if level == 0 else SQUEEZED
        if level == 0 and patient and committed_is_clear(i, True, near, fleet, world, terms) == KEPT_OUTCOME:
            return CONTINUED
    return FALL_BACK


@kernel
def build_cell_list(order: Indices, fleet: RobotTable, answers: ResponseTable, terms: DecisionSettings) -> CellList:
    """What the decisions of the robots in `order` at this time have in common."""
    for k in range(len(fleet.present)):
        if fleet.present[k]:
            predict(k, fleet, terms)
    return cell_list(order, fleet, answers, terms)


@kernel
def decide_all(
    order: Indices,
    seen: CellList,
    fleet: RobotTable,
    world: PassiveObstacles,
    answers: ResponseTable,
    terms: DecisionSettings,
) -> int:
    """The decisions of the robots in `order`, one after the other; how many, up to one that must ask the navigator."""
    for k in range(len(order)):
        i = order[k]
        fleet.outcome[i] = decide(i, seen, fleet, world, answers, terms)
        if fleet.outcome[i] == FALL_BACK:
            return k
    return len(order)
