"""The policy: one robot, or many one after the other, of any shape, limits and targets.

FALL_BACK is returned where a robot overlaps a body or will at once; `slalom.decision.fallback` then decides.
"""

from typing import Final

import numpy as np

from slalom.base.tolerances import CONTACT, CONTACT_SLACK
from slalom.kernels.arrays import Array, Indices, PositionMap
from slalom.kernels.by_reference import by_reference
from slalom.kernels.decision.bodies import limit_margin, obstacle_pieces, reduce_margin
from slalom.kernels.decision.collision import WORK_ROW, free_without_margin, latest_collision
from slalom.kernels.decision.costs import (
    COST_TIE,
    call_back,
    first_detour,
    first_least,
    manoeuvre_cost,
    new_scratch,
    optimistic_cost,
    optimistic_costs,
    preferred_control,
)
from slalom.kernels.decision.limits import (
    admissible_set,
    is_measured_at_rest,
    is_too_fast,
    largest_error,
    obeys_turning_bounds,
)
from slalom.kernels.decision.motion_clear import (
    DIRECT_TEST_ROWS,
    UNKNOWN,
    certain_response,
    first_met,
    met_by_preferred,
    worth_within,
)
from slalom.kernels.decision.neighbours import (
    build_cell_list,
    farthest_distance,
    reachable_balls,
    reachable_neighbours,
    robots_in_reach,
)
from slalom.kernels.decision.paths import (
    acceleration_on_path,
    bounding_balls,
    commit,
    response_path,
    rest_of_path,
    state_on_path,
    unchanged_control,
)
from slalom.kernels.decision.response_motion import (
    WORK_CHOICE,
    choose,
    free_control,
    no_motions,
    other_side,
    relative_table,
)
from slalom.kernels.decision.right_of_way import cost_on_ways, ways_aside
from slalom.kernels.decision.tables import (
    ARRIVE,
    BALL_WINDOWS,
    FOLLOW_ACCELERATION,
    CellList,
    Controls,
    DecisionTables,
    ObstaclePieces,
    Paths,
    ResponseSearch,
    Scratch,
    SelectionProblem,
)
from slalom.kernels.decision.targets import target_state
from slalom.kernels.geometry.cubic import copy_into
from slalom.kernels.jit import inlined, kernel, squared
from slalom.kernels.relative_motion.clearance import new_workspace
from slalom.kernels.selection.candidates import nearest_admissible
from slalom.kernels.selection.exchange import deepest_violation

CLEARANCE_STEPS: Final = 6
"""[1] Bisections of the clearance beyond the margin, of at most `MostClearance.enough`: to 1/64 of it. More: decisions
take longer where that clearance is not free. Fewer: the clearance found is less."""

MIN_IMPROVEMENT: Final = 0.25
"""[1] Share of the shortest response by which an optimistic cost must be below the least cost found so far. Other
responses are not examined. Larger: fewer are, and arrivals are later by up to this. 0: all that may be better."""

MARGIN_STEPS: Final = 4
"""[1] Number of margins that are tried, each half of the one before; then the fallback decides. Larger: a robot in a
narrow gap keeps more of its margin at more cost. Smaller: it falls back earlier."""


CLEAR = 0
CONSTRAINED = 1
KEPT = 2
CONTINUED = 3
SQUEEZED = 4
DELAYED = 5
INTERRUPTED = 6
FALL_BACK = -1
SEARCH = -2
"""Outcomes by number; SEARCH is none: responses must be examined."""


@kernel
def committed_is_clear(i: int, without_margin: bool, near: Indices, tables: DecisionTables, scratch: Scratch) -> int:
    """KEPT if robot i can continue its committed manoeuvre; CONSTRAINED if not; FALL_BACK if it overlaps a body.

    Without the margin it may touch bodies, by CONTACT_SLACK or as deep as it does now.
    Only bodies whose bounding balls overlap those of the committed path are tested. A path that leads to where passive
    bodies are left out is not continued.
    """
    robots = tables.robots
    settings = tables.settings
    times = robots.committed.times
    points = robots.committed.points
    d = settings.dimension
    n = points.shape[1]
    end = -np.inf
    for p in range(n):
        if times[i, p + 1] > max(settings.now, times[i, p]):
            end = times[i, p + 1] - settings.now
    if end < settings.horizon:
        return CONSTRAINED
    centers = scratch.centers
    radii = scratch.radii
    bounding_balls(times[i], points[i], settings, centers, radii)
    if farthest_distance(robots.each[i].position[:], centers, radii) > tables.bodies.reach:
        return CONSTRAINED
    met = reachable_neighbours(i, near, centers, radii, robots)
    error = largest_error(robots.each[i], tables.responses)
    margin, among = robots.each[i].margin, robots.each[i].margin_among
    if without_margin:
        robots.each[i].margin, robots.each[i].margin_among = -CONTACT_SLACK, -CONTACT_SLACK
    rows, overlapping = obstacle_pieces(i, met, error, centers, radii, False, tables)
    robots.each[i].margin, robots.each[i].margin_among = margin, among
    if overlapping:
        return FALL_BACK
    if not obeys_turning_bounds(i, robots, tables.bounds, settings, scratch.position, scratch.velocity):
        return CONSTRAINED
    for s in range(len(rows.pieces.body)):
        # Less by half of what the path is above a level, for rounding.
        rows.pieces.radius[s] -= 0.25 * CONTACT
    none, anywhere = np.zeros(len(rows.bodies), np.bool_), radii[:0]
    if first_met(rows, none, 0, centers, anywhere, robots.committed, i, i, settings, scratch.stack) < 0:
        return KEPT
    knots = np.empty(n + 1)
    drift = np.empty((n, 4, d))
    count = 0
    for p in range(n):
        if times[i, p + 1] <= max(settings.now, times[i, p]):
            continue
        knots[count] = times[i, p] - settings.now
        for c in range(4):
            for axis in range(d):
                drift[count, c, axis] = points[i, p, c, axis]
        count += 1
        knots[count] = times[i, p + 1] - settings.now
    motion = PositionMap(knots[: count + 1], drift[:count], np.zeros((count, 4)), np.empty((0, 4)), count)
    rest = rest_of_path(robots.committed, i, settings.now)
    table, hulls, body = relative_table(rows, tables.bodies, motion, settings.horizon, rest)
    for s in range(len(table.radius)):
        # The path was chosen over other knots, where errors may have had another sign.
        table.radius[s] -= 2.0 * rows.bodies[body[s]].error
        table.bounding_radius[s] -= 2.0 * rows.bodies[body[s]].error
    worst = deepest_violation(table, hulls, np.zeros(3), new_workspace(len(table.radius), hulls))
    return KEPT if worst == -1 else CONSTRAINED


@kernel
def kept_cost(i: int, until: float, to: float, near: Indices, tables: DecisionTables, scratch: Scratch) -> float:
    """Cost [s] of the committed manoeuvre of robot i, see `keep_committed`."""
    robots, settings = tables.robots, tables.settings
    if robots.each[i].resting and is_measured_at_rest(robots.each[i], settings.dimension):
        return float(cost_on_ways(i, until, robots.committed, i, tables, scratch))
    return float(manoeuvre_cost(i, until, to, robots.committed, i, near, tables, scratch))


@kernel
def keep_committed(
    i: int, k: int, least: float, free: bool, near: Indices, tables: DecisionTables, search: ResponseSearch
) -> int:
    """SEARCH if robot i loses too much by keeping its manoeuvre, else as `committed_is_clear`.

    The manoeuvre is driven until its control has been carried out, at least to the next decision: what follows proves
    that the robot can remain safe, and is no plan. The best alternative costs `least` [s], by its k-th response. The
    robot keeps its manoeuvre if it loses at most the share `patience` of the time by one of two ways to go on. It may
    keep its velocity until the alternative has been carried out. Or it may change to the alternative then. A robot that
    rests at its target loses nothing while it is measured there, at up to its tolerance per second. None is kept that
    leads past a target to stop at.
    """
    robots = tables.robots
    responses = tables.responses
    settings = tables.settings
    costs = search.kept_costs
    robot = robots.each[i]
    to = max(settings.period, responses.each[responses.kinds[robot.kind] + k].step)
    until = max(settings.period, robot.settled - settings.now)
    if costs[k] == np.inf:
        costs[k] = kept_cost(i, until, to, near, tables, search.scratch) + search.added[0]
    if robot.stop and robot.objective == ARRIVE and passes_target(i, until, tables, search.scratch):
        return SEARCH
    # A free change can be made later as well; a robot that arrives before cannot make it.
    most = until + to if not free or costs[k] <= until else 0.0
    if costs[k] - least > settings.patience * most + COST_TIE:
        if search.delays[k] == np.inf:
            search.delays[k] = loss_by_delay(i, k, until, tables, search) + search.added[0] - search.added[1]
        if search.delays[k] > settings.patience * until + COST_TIE:
            return SEARCH
    return committed_is_clear(i, False, near, tables, search.scratch)


@kernel
def passes_target(i: int, until: float, tables: DecisionTables, scratch: Scratch) -> bool:
    """Whether robot i, on its committed path for `until` [s], gets past its target by more than the tolerance there.

    Even if it brakes from then on, for at least its shortest response.
    """
    robot = tables.robots.each[i]
    then = tables.settings.now + until
    state_on_path(tables.robots.committed, i, then, scratch.position, scratch.velocity)
    target_state(i, then, tables.robots, tables.targets, scratch.target, scratch.target_velocity)
    speed = 0.0
    along = 0.0
    for axis in range(tables.settings.dimension):
        velocity = scratch.velocity[axis] - scratch.target_velocity[axis]
        speed += squared(velocity)
        along += velocity * (scratch.target[axis] - scratch.position[axis])
    speed = np.sqrt(speed)
    shortest = tables.responses.each[tables.responses.kinds[robot.kind]].shortest
    way = 0.5 * speed * max(speed / robot.stopping, shortest)
    return bool(way > along / max(speed, 1e-300) + robot.tolerance)


@inlined
def free_cost(i: int, r: int, preferred: Array, tables: DecisionTables, scratch: Scratch) -> float:
    """Cost [s] of the admissible control of response r nearest to the `preferred` one (3,), without obstacles."""
    u = np.zeros(3)
    limits = admissible_set(i, r, tables.robots, tables.responses, tables.bounds)
    if not nearest_admissible(preferred, limits, u)[0]:
        return np.inf
    return float(optimistic_cost(i, r, u, tables, scratch))


@kernel
def loss_by_delay(i: int, k: int, until: float, tables: DecisionTables, search: ResponseSearch) -> float:
    """Time [s] that robot i loses, without obstacles, if it changes to its k-th response only after `until` [s].

    inf where it is not known: aims in Python are known at the present state.
    """
    if len(tables.objectives.preferred) > 0:
        return np.inf
    robots = tables.robots
    settings = tables.settings
    scratch = search.scratch
    robot = robots.each[i]
    d = settings.dimension
    r = tables.responses.kinds[robot.kind] + k
    state = np.empty((3, 3))
    now = free_cost(i, r, search.preferred[k], tables, scratch)
    preferred = np.zeros(3)
    copy_into(state[0], robot.position)
    copy_into(state[1], robot.velocity)
    copy_into(state[2], robot.acceleration)
    target_state(i, settings.now, robots, tables.targets, scratch.target, scratch.target_velocity)
    for axis in range(d):
        robot.position[axis] = scratch.target[axis]
    target_state(i, settings.now + until, robots, tables.targets, scratch.target, scratch.target_velocity)
    state_on_path(robots.committed, i, settings.now + until, scratch.position, scratch.velocity)
    for axis in range(d):
        # As if the target had not moved meanwhile.
        robot.position[axis] += scratch.position[axis] - scratch.target[axis]
        robot.velocity[axis] = scratch.velocity[axis]
    acceleration_on_path(robots.committed, i, settings.now + until, scratch.velocity)
    for axis in range(d):
        robot.acceleration[axis] = scratch.velocity[axis]
    preferred_control(i, r, 0.0, tables, scratch, preferred)
    then = free_cost(i, r, preferred, tables, scratch)
    copy_into(robot.position[:], state[0])
    copy_into(robot.velocity[:], state[1])
    copy_into(robot.acceleration[:], state[2])
    return float(until + then - now) if now < np.inf else np.inf


@kernel
def best_response(
    i: int,
    rows: ObstaclePieces,
    met: Indices,
    near: Indices,
    tables: DecisionTables,
    search: ResponseSearch,
    keep: bool,
    safe: bool,
) -> tuple[int, int]:
    """The response and outcome of the exact choice that costs least; response -1: none.

    Its control goes into `search.control`. Responses are examined in the order of their optimistic costs, until none
    can be better than the best choice. If that path is not clear, detours of the responses with a free control follow.
    With `keep` the outcome is KEPT as soon as no response that is left is worth a change. When the budget is used up,
    the best choice so far is taken; without one, and if the committed manoeuvre is `safe`, it is INTERRUPTED.

    Args: met (m,) the robots of the bodies of `rows` after the passive ones. near (l,) those in reach.
    """
    robots, responses, settings = tables.robots, tables.responses, tables.settings
    robot, scratch, costs = robots.each[i], search.scratch, search.costs
    first, count = responses.kinds[robot.kind], len(search.excluded)
    worth = MIN_IMPROVEMENT * responses.each[first].shortest + COST_TIE
    controls = Controls(np.zeros(3), np.zeros(3), np.zeros(3))
    preferred, unchanged, u = controls.preferred, controls.unchanged, controls.found
    best, best_r, outcome, clear, detoured = np.inf, -1, CONSTRAINED, False, False
    motions = no_motions(i, rows, tables, unchanged)
    which, closed = np.full(count, -1), search.excluded.copy()
    # Without detours each response is examined once, and its cost is the distance from one control.
    ordered = robot.objective == FOLLOW_ACCELERATION and len(costs) == count and settings.share >= 1.0
    certain = certain_response(i, controls, met, rows, tables, search) if ordered else -1
    while True:
        at = certain if certain >= 0 and costs[certain] < np.inf else first_least(costs)
        if costs[at] >= best - worth and not (clear or detoured):
            detoured = True
            at = first_detour(i, closed, tables, search)
        known = safe or best_r >= 0
        over = known and robot.work >= settings.budget
        done = over or costs[at] >= best - worth
        k, least = (best_r - first, best) if done else (at % count, costs[at])
        if keep and least < np.inf:
            result = keep_committed(i, k, least, not done or outcome == CLEAR, near, tables, search)
            keep = result == SEARCH
            if result == KEPT:
                return best_r, KEPT
        if done:
            return best_r, INTERRUPTED if over and best_r < 0 else outcome
        r, detour, costs[at] = first + k, at // count, np.inf
        if closed[k]:
            continue
        until = max(settings.period, responses.each[r].step)
        copy_into(preferred, search.preferred[at])
        unchanged_control(robot, r, responses, unchanged)
        robot.work += WORK_CHOICE + WORK_ROW * len(rows.pieces.body)
        within = worth_within(robot, r, best, tables) if ordered else np.inf
        direct = which[k] < 0 and len(rows.pieces.body) >= DIRECT_TEST_ROWS and (not ordered or k == certain)
        row = met_by_preferred(i, r, 0, controls, met, rows, tables, scratch) if direct else UNKNOWN
        if row != -1:
            most = settings.budget - robot.work if known else np.inf
            closed[k] = not free_control(i, r, k, row, motions, which, rows, tables, controls, most, within, scratch)
            if closed[k]:
                continue
        cost = manoeuvre_cost(i, until, until, scratch.paths, 0, near, tables, scratch)
        exact = detour == 0 and u[0] == preferred[0] and u[1] == preferred[1] and u[2] == preferred[2]
        clear = clear or (exact and len(search.aside) == 0)
        if cost < best - COST_TIE:
            best, best_r, outcome = cost, r, CLEAR if exact else CONSTRAINED
            copy_into(search.control, u)


@kernel
def put_candidate(n: int, until: float, cost: float, paths: Paths, row: int, tables: DecisionTables) -> None:
    """Let row `row` of `paths`, up to `until` [s] from now, with a cost [s], be the candidate number n."""
    asked = tables.objectives
    copy_into(asked.paths.times[n], paths.times[row])
    copy_into(asked.paths.points[n], paths.points[row])
    asked.until[n] = until
    asked.costs[n] = cost


@kernel
def put_sides(
    i: int,
    r: int,
    n: int,
    motion: SelectionProblem,
    controls: Controls,
    found: Array,
    most: float,
    near: Indices,
    tables: DecisionTables,
    scratch: Scratch,
) -> int:
    """The number of candidates after those of response r, of which the first is number n; its path is in the scratch.

    It is the exact choice `controls.found`; the other one is that of `other_side`, with `most` [us] of work. Their
    controls go into `found` (q, 3).
    """
    settings, u = tables.settings, controls.found
    until = max(settings.period, tables.responses.each[r].step)
    for side in range(2):
        if side == 1:
            limits = other_side(motion.limits, motion.table, motion.hulls, controls.preferred, u)
            if len(limits) == 0:
                break
            other = SelectionProblem(limits, motion.table, motion.hulls)
            free, work = choose(other, controls.preferred, settings.dimension, most, np.inf, u)
            tables.robots.each[i].work += work
            if not free:
                break
            response_path(tables.robots.each[i], r, u, tables.responses, settings, until, scratch.paths, 0)
        cost = manoeuvre_cost(i, until, until, scratch.paths, 0, near, tables, scratch)
        put_candidate(n, until, cost, scratch.paths, 0, tables)
        copy_into(found[n], u)
        n += 1
    return n


@kernel
def best_candidate(
    i: int,
    rows: ObstaclePieces,
    near: Indices,
    tables: DecisionTables,
    search: ResponseSearch,
    keep: bool,
    safe: bool,
) -> tuple[int, int]:
    """As `best_response`, for an objective in Python, which is asked once for the costs of all candidates.

    They are of each response the exact choice, and the free control nearest to the preferred one of `other_side`. The
    last candidate is the committed manoeuvre.
    """
    responses, settings = tables.responses, tables.settings
    asked = tables.objectives
    robot, scratch = tables.robots.each[i], search.scratch
    first, count = responses.kinds[robot.kind], len(search.excluded)
    if len(search.costs) > count:
        first_detour(i, search.excluded, tables, search)
    controls = Controls(np.zeros(3), np.zeros(3), np.zeros(3))
    preferred = controls.preferred
    motions, which = no_motions(i, rows, tables, controls.unchanged), np.full(count, -1)
    found, numbers = np.empty((len(asked.costs), 3)), np.zeros(len(asked.costs), np.int64)
    n, over = 0, False
    for at in range(len(search.costs)):
        k = at % count
        over = (safe or n > 0) and robot.work >= settings.budget
        if over or search.excluded[k]:
            continue
        r = first + k
        most = settings.budget - robot.work if safe or n > 0 else np.inf
        copy_into(preferred, search.preferred[at])
        unchanged_control(robot, r, responses, controls.unchanged)
        robot.work += WORK_CHOICE + WORK_ROW * len(rows.pieces.body)
        free = free_control(i, r, k, UNKNOWN, motions, which, rows, tables, controls, most, np.inf, scratch)
        if free:
            last = put_sides(i, r, n, motions[which[k]], controls, found, most, near, tables, scratch)
            numbers[n:last] = at
            n = last
    if n == 0:
        return -1, INTERRUPTED if over else CONSTRAINED
    until = max(settings.period, robot.settled - settings.now)
    committed = robot.settled < np.inf
    if committed:
        put_candidate(n, until, kept_cost(i, until, until, near, tables, scratch), tables.robots.committed, i, tables)
    before = asked.costs.copy()
    call_back(asked.address, n + committed)
    best = first_least(asked.costs[:n])
    if not asked.costs[best] < np.inf:
        return -1, CONSTRAINED
    k = numbers[best] % count
    copy_into(preferred, search.preferred[numbers[best]])
    copy_into(search.control, found[best])
    is_preferred = numbers[best] < count
    for axis in range(3):
        is_preferred = is_preferred and found[best, axis] == preferred[axis]
    outcome = CLEAR if is_preferred else CONSTRAINED
    if keep and committed:
        search.added[0] = asked.costs[n] - before[n]
        search.added[1] = asked.costs[best] - before[best]
        if keep_committed(i, k, asked.costs[best], is_preferred, near, tables, search) == KEPT:
            return first + k, KEPT
    return first + k, outcome


@kernel
def best_of_responses(
    i: int,
    rows: ObstaclePieces,
    met: Indices,
    near: Indices,
    tables: DecisionTables,
    search: ResponseSearch,
    keep: bool,
    safe: bool,
) -> tuple[int, int]:
    """As `best_response`; of a robot that acts `early` first without the responses that brake."""
    costs, excluded = search.costs.copy(), search.excluded.copy()
    first = tables.responses.kinds[tables.robots.each[i].kind]
    r, outcome = -1, CONSTRAINED
    for attempt in range(2):
        if attempt == 0 and not tables.settings.early:
            continue
        for k in range(len(excluded)):
            if attempt == 0 and tables.responses.each[first + k].brakes:
                search.excluded[k] = True
                search.costs[k] = np.inf
        if tables.objectives.address != 0:
            r, outcome = best_candidate(i, rows, near, tables, search, keep, safe)
        else:
            r, outcome = best_response(i, rows, met, near, tables, search, keep, safe)
        if r >= 0 or outcome in (KEPT, INTERRUPTED):
            break
        copy_into(search.excluded, excluded)
        copy_into(search.costs, costs)
    copy_into(search.excluded, excluded)
    return r, outcome


@kernel
def most_clearance(
    i: int,
    rows: ObstaclePieces,
    met: Indices,
    near: Indices,
    optimistic: Array,
    tables: DecisionTables,
    search: ResponseSearch,
    safe: bool,
) -> tuple[int, int]:
    """As `best_response`, with as much of the last part of the margin, `enough`, as the robot can keep.

    That clearance is found by bisection, to `enough` / 2^CLEARANCE_STEPS. Without a choice nothing of `enough` is left
    in `rows`. `optimistic` (k,) [s]: the costs of all responses.
    """
    radius = rows.pieces.radius.copy()
    growth = rows.pieces.growth.copy()
    margin = rows.margin.copy()
    low = 0.0
    high = tables.robots.each[i].enough
    best = -1
    best_outcome = CONSTRAINED
    control = np.zeros(3)
    for step in range(CLEARANCE_STEPS + 1):
        extra = 0.0 if step == 0 else 0.5 * (low + high)
        copy_into(rows.pieces.radius, radius)
        copy_into(rows.pieces.growth, growth)
        for s in range(len(radius)):
            copy_into(rows.margin[s], margin[s])
        limit_margin(i, extra, rows, tables)
        copy_into(search.costs, optimistic)
        r, outcome = best_of_responses(i, rows, met, near, tables, search, False, safe)
        if r >= 0:
            low = extra
            best = r
            best_outcome = outcome
            copy_into(control, search.control)
        elif step == 0:
            return r, outcome
        else:
            high = extra
    copy_into(search.control, control)
    return best, best_outcome


@inlined
def new_search(i: int, tables: DecisionTables, scratch: Scratch) -> ResponseSearch:
    """The search of robot i, with the optimistic costs of its responses and with buffers."""
    robots = tables.robots
    responses = tables.responses
    settings = tables.settings
    robot = robots.each[i]
    first = responses.kinds[robot.kind]
    last = responses.kinds[robot.kind + 1]
    count = last - first
    shortest = np.inf
    aside = ways_aside(i, tables)
    rows = count * (1 + len(settings.detours) + len(aside))
    search = ResponseSearch(
        scratch,
        np.zeros(count, np.bool_),
        np.full(count, np.inf),
        np.full(count, np.inf),
        np.full(rows, np.inf),
        np.zeros((rows, 3)),
        np.zeros(3),
        np.zeros(2),
        aside,
    )
    if is_too_fast(robot):
        # A small acceleration held for long would obey the limit only at its end; the speed must fall now.
        for r in range(first, last):
            shortest = min(shortest, responses.each[r].settled)
        for k in range(count):
            search.excluded[k] = responses.each[first + k].settled > shortest
    optimistic_costs(i, 0, search.excluded, tables, search)
    return search


@kernel
def change_manoeuvre(i: int, may_keep: bool, near: Indices, tables: DecisionTables, search: ResponseSearch) -> int:
    """The outcome of robot i, which seeks a new manoeuvre, as of `decide`.

    With `may_keep` it keeps the committed one as soon as no response that is left is worth a change.
    """
    robots = tables.robots
    responses = tables.responses
    settings = tables.settings
    robot = robots.each[i]
    optimistic = search.costs.copy()
    committed = robot.settled < np.inf
    centers = np.empty((BALL_WINDOWS, 3))
    radii = np.empty(BALL_WINDOWS)
    reachable_balls(i, robots, responses, settings, centers, radii)
    safe = settings.budget < np.inf and committed and committed_is_clear(i, True, near, tables, search.scratch) == KEPT
    met = reachable_neighbours(i, near, centers, radii, robots)
    error = largest_error(robots.each[i], tables.responses)
    rows, overlapping = obstacle_pieces(i, met, error, centers, radii, settings.agrees, tables)
    if overlapping:
        return FALL_BACK
    for step in range(0 if settings.agrees else 1, MARGIN_STEPS + 2):
        level = max(step - 1, 0)
        if settings.agrees and step == 1:
            # Nothing is free on the agreed sides.
            rows, _ = obstacle_pieces(i, met, error, centers, radii, False, tables)
            copy_into(search.costs, optimistic)
        if level > 0:
            # With half the margin, then a quarter, then an eighth, then none.
            reduce_margin(0.5 ** min(level, MARGIN_STEPS - 1), rows)
            copy_into(search.costs, optimistic)
        keep = level == 0 and may_keep
        r, outcome = best_of_responses(i, rows, met, near, tables, search, keep, safe)
        if step == 1 and r < 0 and outcome == CONSTRAINED and robot.enough > 0.0:
            r, outcome = most_clearance(i, rows, met, near, optimistic, tables, search, safe)
        if outcome in (KEPT, INTERRUPTED):
            return outcome
        if r >= 0:
            commit(i, r, search.control, robots, responses, settings)
            copy_into(robot.preferred[:], search.preferred[r - responses.kinds[robot.kind]])
            return outcome if level == 0 else SQUEEZED
        if step == 1 and committed and committed_is_clear(i, True, near, tables, search.scratch) == KEPT:
            return CONTINUED
        if step == 1 and not free_without_margin(i, rows, tables, search):
            # No part of the margin leaves a safe control then.
            reduce_margin(1.0, rows)
            break
    # Nothing is left of the margin, and no body does a part of the avoidance.
    for b in range(len(rows.bodies)):
        rows.bodies[b].share = 1.0
    k = latest_collision(i, rows, tables, search)
    if k < 0:
        return FALL_BACK
    commit(i, responses.kinds[robot.kind] + k, search.control, robots, responses, settings)
    copy_into(robot.preferred[:], search.preferred[k])
    return DELAYED


@kernel
def decide(i: int, near: Indices, tables: DecisionTables, scratch: Scratch) -> int:
    """The outcome of the decision of robot i among the robots `near` (m,); its manoeuvre goes into the robot table.

    Most robots keep their manoeuvre. That needs fewer of the bodies in reach, and little code, which stays in the
    processor's cache: what follows is therefore a kernel of its own. An objective in Python is asked there only.
    """
    scratch = by_reference(scratch)
    robot = tables.robots.each[i]
    robot.work = 0.0
    search = new_search(i, tables, scratch)
    result = CONSTRAINED
    if robot.settled < np.inf and not is_too_fast(robot):
        result = SEARCH
        if tables.objectives.address == 0:
            k = first_least(search.costs)
            result = keep_committed(i, k, search.costs[k], True, near, tables, search)
        if result in (KEPT, FALL_BACK):
            return result
    return change_manoeuvre(i, result == SEARCH, near, tables, search)


@kernel
def decide_all(order: Indices, cells: CellList, tables: DecisionTables) -> int:
    """Number of the robots in `order` (m,) that decided, one after the other, up to the first that needs a fallback.

    `cells` are those of `build_cell_list`, or NO_CELLS: then they are made first.
    """
    tables = by_reference(tables)
    robots = tables.robots
    settings = tables.settings
    if len(cells.member) == 0:
        cells = build_cell_list(order, robots, tables.responses, settings)
    near = np.empty(len(cells.member), np.int64)
    scratch = new_scratch(robots.committed.points.shape[1], settings.dimension)
    for k in range(len(order)):
        i = order[k]
        count = robots_in_reach(i, cells, robots, settings, near)
        robots.each[i].outcome = decide(i, near[:count], tables, scratch)
        if robots.each[i].outcome == FALL_BACK:
            return k
    return len(order)
