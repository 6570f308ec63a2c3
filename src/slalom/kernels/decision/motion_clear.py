"""Whether a given path is certainly collision-free, piece by piece: sufficient for most choices.

Most preferred controls are free, and most committed paths are clear. This test needs no table of segments under all
controls.
"""

from typing import Final

import numpy as np

from slalom.base.tolerances import CONTACT_SLACK
from slalom.kernels.arrays import Array, Flags, Indices
from slalom.kernels.decision.bodies import meets_balls
from slalom.kernels.decision.costs import COST_TIE, first_least
from slalom.kernels.decision.limits import admissible_set, farthest_control
from slalom.kernels.decision.neighbours import reachable_neighbours, response_balls
from slalom.kernels.decision.paths import bounding_balls, response_path, rest_of_path, unchanged_control
from slalom.kernels.decision.tables import (
    RESPONSE_WINDOWS,
    Controls,
    DecisionSettings,
    DecisionTables,
    ObstaclePieces,
    Paths,
    ResponseSearch,
    Robot,
    Scratch,
)
from slalom.kernels.geometry.cubic import below, copy_into, put_distance, restrict, value
from slalom.kernels.jit import inlined, kernel, squared
from slalom.kernels.selection.candidates import nearest_admissible


@kernel
def chord_distance(p: Array) -> float:
    """A lower bound [m] of the distance to the origin along the cubic p (4, 3) [m]: that of `chord_distances`."""
    square = 1e-300
    along = 0.0
    for axis in range(3):
        square += squared(p[3, axis] - p[0, axis])
        along -= p[0, axis] * (p[3, axis] - p[0, axis])
    along = min(max(along / square, 0.0), 1.0)
    least = 0.0
    e = 0.0
    f = 0.0
    for axis in range(3):
        a = p[0, axis]
        b = p[3, axis]
        least += squared(a + along * (b - a))
        e += squared(p[1, axis] - (2.0 * a + b) / 3.0)
        f += squared(p[2, axis] - (a + 2.0 * b) / 3.0)
    return float(np.sqrt(least) - 0.75 * np.sqrt(max(e, f)))


@kernel
def keeps_distance(p: Array, radius: float, stack: Array) -> bool:
    """Whether the cubic p (4, 3) [m] stays at least `radius` [m] away from the origin, up to rounding."""
    put_distance(stack, p, radius * radius)
    return below(stack) < 0.0


@kernel
def first_met(
    rows: ObstaclePieces,
    skipped: Flags,
    begin: int,
    centers: Array,
    radii: Array,
    paths: Paths,
    row: int,
    shared_row: int,
    settings: DecisionSettings,
    stack: Array,
) -> int:
    """A row of the bodies that row `row` of `paths` may meet, sought from row `begin` on; -1: it certainly meets none.

    Bodies `skipped` (b,) are not tested, nor those that the path does not come near: `centers` (w, 3) [m] and `radii`
    (w,) [m] hold it in windows of the horizon; of length 0: not known. Near hulls a row is met. `shared_row`: the path
    that must be clear of the bodies that avoid the robot too.
    """
    pieces = rows.pieces
    now, horizon = settings.now, settings.horizon
    times, points = paths.times, paths.points
    d = pieces.points.shape[2]
    n = points.shape[1]
    p = np.zeros((4, 3))
    resting = -1.0
    count = len(pieces.body)
    for turn in range(count):
        s = begin + turn if begin + turn < count else begin + turn - count
        body = pieces.body[s]
        if skipped[body]:
            continue
        if len(radii) > 0 and rows.balls[s, 3] < np.inf:
            last = pieces.times[s, 1]
            if not meets_balls(rows.balls[s], 0.0, pieces.times[s, 0], last, horizon, centers, radii):
                continue
        own = shared_row if rows.bodies[body].share < 1.0 else row
        first = pieces.times[s, 0]
        if not rows.bodies[body].at_rest and resting < 0.0:
            resting = rest_of_path(paths, row, now)
        until = horizon if rows.bodies[body].at_rest else min(horizon, resting)
        width = pieces.times[s, 1] - pieces.times[s, 0]
        t0 = max(first, 0.0)
        t1 = min(pieces.times[s, 1], until)
        k = 0
        while t0 < t1:
            # As in `encounters.state_on_path`: the last piece that has a length goes on.
            while k < n - 1 and times[own, k + 1] - now <= t0 and times[own, k + 2] > times[own, k + 1]:
                k += 1
            start = times[own, k] - now
            end = times[own, k + 1] - now
            stop = min(t1, end) if end > t0 else t1
            a, b = (t0 - first) / width, (stop - first) / width
            e, f = (t0 - start) / (end - start), (stop - start) / (end - start)
            for axis in range(d):
                q = pieces.points[s, :, axis]
                q0, q1, q2, q3 = restrict(q[0], q[1], q[2], q[3], a, b)
                o = points[own, k, :, axis]
                o0, o1, o2, o3 = restrict(o[0], o[1], o[2], o[3], e, f)
                p[0, axis] = q0 - o0
                p[1, axis] = q1 - o1
                p[2, axis] = q2 - o2
                p[3, axis] = q3 - o3
            radius = pieces.radius[s] + pieces.growth[s] * a + max(pieces.growth[s] * (b - a), 0.0)
            if chord_distance(p) < radius + rows.bodies[body].hull_radius and not (
                rows.hull[body] < 0 and keeps_distance(p, radius, stack)
            ):
                return s
            t0 = stop
    return -1


@kernel
def common_share(rows: ObstaclePieces) -> float:
    """The share [1] of the avoidance of all bodies that do the rest of it; 1 if none does any, 0 if shares differ."""
    common = 1.0
    for b in range(len(rows.bodies)):
        share = rows.bodies[b].share
        if share < 1.0:
            if common < 1.0 and share != common:
                return 0.0
            common = share
    return common


UNKNOWN = -2
"""In place of the row that a preferred control meets: it is not admissible, or bodies do different shares."""


@kernel
def met_by_preferred(
    i: int,
    r: int,
    begin: int,
    controls: Controls,
    met: Indices,
    rows: ObstaclePieces,
    tables: DecisionTables,
    scratch: Scratch,
) -> int:
    """A row that the admissible control of response r nearest to the preferred one may meet; -1: it is free; UNKNOWN.

    That control goes into `controls.found`, its path into the first row of the scratch. Rows are tested from `begin`
    on. `met` (m,): the robots whose bodies follow the passive ones in `rows`.
    """
    robots = tables.robots
    responses = tables.responses
    settings = tables.settings
    u = controls.found
    tested = scratch.control
    unchanged = controls.unchanged
    if not nearest_admissible(controls.preferred, admissible_set(i, r, robots, responses, tables.bounds), u)[0]:
        return UNKNOWN
    share = common_share(rows)
    if share == 0.0:
        return UNKNOWN
    halves = share < 1.0
    # Passive bodies are the first ones.
    passive = len(rows.balls) > 0 and rows.balls[0, 3] < np.inf
    centers = np.empty((RESPONSE_WINDOWS if passive else 0, 3))
    radii = np.empty(len(centers))
    if passive:
        response_balls(robots.each[i], r, u, 0.0, responses, centers, radii)
    ignored = np.zeros(len(rows.bodies), np.bool_)
    for b in range(len(ignored)):
        ignored[b] = rows.bodies[b].robot >= 0
    for part in range(2 if halves else 1):
        for axis in range(3):
            tested[axis] = u[axis] if part == 0 else unchanged[axis] + (u[axis] - unchanged[axis]) / share
        response_path(robots.each[i], r, tested, responses, settings, np.inf, scratch.paths, part)
        if len(met) == 0:
            continue
        bounding_balls(scratch.paths.times[part], scratch.paths.points[part], settings, scratch.centers, scratch.radii)
        b = 0
        for k in reachable_neighbours(i, met, scratch.centers, scratch.radii, robots):
            while rows.bodies[b].robot != k:
                b += 1
            while b < len(ignored) and rows.bodies[b].robot == k:
                ignored[b] = False
                b += 1
    shared = 1 if halves else 0
    return first_met(rows, ignored, begin, centers, radii, scratch.paths, 0, shared, settings, scratch.stack)


@kernel
def least_change(r: int, row: int, rows: ObstaclePieces, tables: DecisionTables, paths: Paths) -> float:
    """A lower bound of the distance from a control of response r of all controls that do not meet the body of a row.

    The control has the first path of `paths`. At any time a change of the control moves the robot by its gain then.
    0 where the body has a hull, or does a part of the avoidance.
    """
    pieces = rows.pieces
    responses = tables.responses
    body = pieces.body[row]
    most = 0.0
    if rows.hull[body] >= 0 or rows.bodies[body].share < 1.0 or not rows.bodies[body].at_rest:
        return most
    first = responses.first[r]
    count = responses.first[r + 1] - first
    knots = responses.knots[first + r : first + r + count + 1]
    s = row
    while s > 0 and pieces.body[s - 1] == body:
        s -= 1
    k = 0
    while s < len(pieces.body) and pieces.body[s] == body:
        for half in range(2):
            x = 0.5 * half
            t = pieces.times[s, 0] + x * (pieces.times[s, 1] - pieces.times[s, 0])
            if not 0.0 < t < tables.settings.horizon:
                continue
            while k < count - 1 and knots[k + 1] <= t:
                k += 1
            e = (t - knots[k]) / (knots[k + 1] - knots[k])
            g = responses.pieces[first + k].gain
            gain = value(g[0], g[1], g[2], g[3], e)
            square = 0.0
            for axis in range(pieces.points.shape[2]):
                q = pieces.points[s, :, axis]
                o = paths.points[0, k, :, axis]
                square += squared(value(q[0], q[1], q[2], q[3], x) - value(o[0], o[1], o[2], o[3], e))
            depth = pieces.radius[s] + pieces.growth[s] * x - np.sqrt(square) - CONTACT_SLACK
            if depth > most * gain:
                most = depth / gain
        s += 1
    return float(most)


@inlined
def is_blocked(
    robot: Robot, r: int, row: int, u: Array, rows: ObstaclePieces, tables: DecisionTables, paths: Paths
) -> bool:
    """Whether every admissible control of response r certainly meets the body of a row; u (3,): see `least_change`."""
    return bool(least_change(r, row, rows, tables, paths) > farthest_control(robot, r, u, tables.responses))


# To follow an acceleration: the cost of a control is its distance from the preferred one.


DIRECT_TEST_ROWS: Final = 30
"""[1] With fewer pieces a table of segments is made as quickly as the preferred control is tested alone. Larger: the
direct test is used more seldom. Results do not depend on it."""


@inlined
def worth_within(robot: Robot, r: int, best: float, tables: DecisionTables) -> float:
    """The distance from the preferred control of response r within which a control costs less than `best`.

    For a robot that follows an acceleration. It is not known for a motion that its pieces only approximate.
    """
    response = tables.responses.each[r]
    if response.error > 0.0:
        return np.inf
    return float((best - COST_TIE) * robot.max_acceleration / abs(response.initial_acceleration[2]))


@kernel
def certain_response(
    i: int, controls: Controls, met: Indices, rows: ObstaclePieces, tables: DecisionTables, search: ResponseSearch
) -> int:
    """The first of the responses of robot i with the least cost whose preferred control is free for certain; -1: none.

    For a robot that follows an acceleration: one pass over the bodies and no search. What one response meets is tested
    first for the next one. The costs of the others become what they are at least, see `least_change`.
    """
    robot, responses = tables.robots.each[i], tables.responses
    first, count = responses.kinds[robot.kind], len(search.excluded)
    least = search.costs[first_least(search.costs)] + COST_TIE
    begin = 0
    for k in range(count if len(rows.pieces.body) >= DIRECT_TEST_ROWS else 0):
        r = first + k
        if search.costs[k] > least:
            continue
        copy_into(controls.preferred, search.preferred[k])
        unchanged_control(robot, r, responses, controls.unchanged)
        row = met_by_preferred(i, r, begin, controls, met, rows, tables, search.scratch)
        if row == -1:
            return k
        if row >= 0:
            change = least_change(r, row, rows, tables, search.scratch.paths)
            if responses.each[r].error == 0.0:
                least_cost = change * abs(responses.each[r].initial_acceleration[2]) / robot.max_acceleration
                search.costs[k] = max(search.costs[k], least_cost)
            if is_blocked(robot, r, row, controls.found, rows, tables, search.scratch.paths):
                search.costs[k] = np.inf
            begin = row
    return -1
