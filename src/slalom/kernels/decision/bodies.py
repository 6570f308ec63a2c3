"""Passive bodies that one robot may meet within the horizon: their pieces, cut to it, with margins."""

from typing import Final, NamedTuple

import numpy as np

from slalom.base.tolerances import CONTACT_SLACK, INTERPOLATION
from slalom.kernels.arrays import EVERY_WORLD, Array, Hulls, Indices, MaybeCorners, MaybeHulls, Pieces, Records
from slalom.kernels.decision.neighbours import farthest_distance
from slalom.kernels.decision.paths import state_on_path
from slalom.kernels.decision.tables import MET_BODY, DecisionSettings, DecisionTables, MetBody, ObstaclePieces, Robot
from slalom.kernels.geometry.cubic import copy_into
from slalom.kernels.geometry.hulls import distances
from slalom.kernels.jit import inlined, kernel, squared
from slalom.kernels.relative_motion.window import (
    copy_cut,
    copy_restricted,
    kept_margin,
    overlaps,
    places_now,
    put_ball,
    rows_within,
    share_of_piece,
)


class PassiveRows(NamedTuple):
    """Rows of passive pieces that a robot may come near, and their bodies, numbered anew."""

    row: Indices  # (n,) in the table of all pieces
    number: Indices  # (n,) new number of its body
    body: Indices  # (b,) number of each in the table of all bodies


@inlined
def is_elsewhere(world: int, own: int) -> bool:
    """Whether a body in `world` is in another one than a robot in its `own`."""
    return world != own and world != EVERY_WORLD


@inlined
def hulls_of_bodies(corners: MaybeCorners, hull: Indices, turned: Array) -> MaybeHulls:
    """Hulls with numbers `hull` (n,) and directions `turned` (4, 2, n); empty where there are no corners."""
    if len(corners) > 0:
        return Hulls(hull, turned, corners.corners, corners.first, corners.unordered)
    return ()


@inlined
def meets_balls(
    ball: Array, more: float, begin: float, end: float, horizon: float, centers: Array, radii: Array
) -> bool:
    """Whether a ball (4,) [m], larger by `more` [m], touches one of those of the windows from `begin` to `end` [s].

    `centers` (w, 3) [m] and `radii` (w,) [m]: of the windows, of equal length up to the horizon [s].
    """
    # A window that a ball touches for a rounding error of its time is left out: nothing moves far meanwhile.
    per_second = len(radii) / horizon
    last = len(radii) - 1
    for w in range(max(int(begin * per_second), 0), min(int(min(end, horizon) * per_second), last) + 1):
        x = centers[w, 0] - ball[0]
        y = centers[w, 1] - ball[1]
        z = centers[w, 2] - ball[2]
        reach = radii[w] + (ball[3] + more)
        if reach >= 0.0 and x * x + y * y + z * z <= reach * reach:
            return True
    return False


@inlined
def is_near(ball: Array, position: Array, distance: float) -> bool:
    """Whether a ball (4,) [m] is no farther from the `position` (3,) [m] than `distance` [m]."""
    square = 0.0
    reach = ball[3] + distance
    for axis in range(3):
        square += squared(ball[axis] - position[axis])
    return bool(reach >= 0.0 and square <= reach * reach)


@inlined
def may_come_near(
    ball: Array, begin: float, end: float, grown: float, robot: Robot, horizon: float, centers: Array, radii: Array
) -> bool:
    """Whether a piece from `begin` to `end` [s], with a ball (4,) [m], larger by `grown` [m], comes near a robot.

    Within the horizon [s], where `centers` (w, 3) [m] and `radii` (w,) [m] bound its motion; or now.
    """
    return meets_balls(ball, grown, begin, end, horizon, centers, radii) or (
        begin <= 0.0 and is_near(ball, robot.position, grown + CONTACT_SLACK)
    )


@kernel
def passive_in_reach(i: int, error: float, centers: Array, radii: Array, tables: DecisionTables) -> PassiveRows:
    """The rows of passive pieces that robot i can approach closer than the margin within the horizon.

    `centers` (w, 3) [m] and `radii` (w,) [m] bound its motion in each window of the horizon. What is within the margin
    now is among the rows too.
    """
    bodies = tables.bodies
    rows = len(bodies.pieces.times)
    found = PassiveRows(np.empty(rows, np.int64), np.empty(rows, np.int64), np.empty(len(bodies.each), np.int64))
    count, b = put_passive(i, error, centers, radii, tables, found)
    return PassiveRows(found.row[:count], found.number[:count], found.body[:b])


@kernel
def put_passive(
    i: int, error: float, centers: Array, radii: Array, tables: DecisionTables, found: PassiveRows
) -> tuple[int, int]:
    """The numbers of rows and bodies of `passive_in_reach`, which go into `found`.

    A kernel of its own, since it returns no array: a reference to a row would cost as much as its test.
    """
    robot = tables.robots.each[i]
    bodies = tables.bodies
    now = bodies.now
    horizon = tables.settings.horizon
    times = bodies.pieces.times
    count = 0
    b = 0
    more = robot.rounding - tables.robot_bodies.rounding + robot.margin + error
    far = farthest_distance(robot.position[:], centers, radii) + CONTACT_SLACK
    for k in range(len(bodies.each)):
        passive = bodies.each[k]
        known = count
        until = min(bodies.until[passive.owner], horizon)
        if is_elsewhere(passive.world, robot.world) or not is_near(bodies.body_balls[k], robot.position, far + more):
            continue
        grown = passive.radius + passive.hull_radius + more
        first, last = rows_within(times, bodies.first_piece[k], bodies.first_piece[k + 1], now, now + until)
        for s in range(first, last):
            begin = times[s, 0] - now
            end = times[s, 1] - now
            if may_come_near(bodies.balls[s], begin, end, grown, robot, horizon, centers, radii):
                found.row[count] = s
                found.number[count] = b
                count += 1
        if count > known:
            found.body[b] = k
            b += 1
    return count, b


@kernel
def add_passive(
    i: int,
    passive: PassiveRows,
    error: float,
    centers: Array,
    radii: Array,
    rows: ObstaclePieces,
    tables: DecisionTables,
) -> int:
    """Write the passive rows, cut to the time in which they count, into the first; the number of those that stay.

    The others are out of reach of robot i once they are cut, see `passive_in_reach`. Radii are those of the pieces.
    """
    robot = tables.robots.each[i]
    bodies = tables.bodies
    pieces = rows.pieces
    horizon = tables.settings.horizon
    count = 0
    more = robot.rounding - tables.robot_bodies.rounding + robot.margin + error
    for k in range(len(passive.row)):
        s = passive.row[k]
        b = passive.number[k]
        body = bodies.each[passive.body[b]]
        was_cut = copy_cut(bodies.pieces, s, bodies.now, bodies.now + bodies.until[body.owner], pieces, count)
        pieces.body[count] = b
        ball = rows.balls[count]
        grown = body.radius + body.hull_radius + more
        for axis in range(4):
            ball[axis] = bodies.balls[s, axis]
        if was_cut and ball[3] < np.inf:
            put_ball(pieces, count, ball)
            begin = pieces.times[count, 0]
            end = pieces.times[count, 1]
            if not may_come_near(ball, begin, end, grown, robot, horizon, centers, radii):
                continue
        count += 1
    return count


@kernel
def grow_passive(
    i: int, numbers: Indices, count: int, error: float, rows: ObstaclePieces, tables: DecisionTables
) -> tuple[bool, int]:
    """Grow the first `count` rows, of passive bodies `numbers` (b,), by robot i and by the margin that it can keep.

    Returns whether the robot overlaps one, and the number of rows: where its margin grows again rows are cut.
    """
    bodies = tables.bodies
    pieces = rows.pieces
    margin = tables.robots.each[i].margin
    more = tables.robots.each[i].rounding - tables.robot_bodies.rounding
    radius = np.empty(len(numbers))
    for b in range(len(radius)):
        passive = bodies.each[numbers[b]]
        radius[b] = passive.radius + more
        rows.hull[b] = bodies.hull[numbers[b]]
        rows.bodies[b].hull_radius = passive.hull_radius
        rows.bodies[b].at_rest = passive.at_rest
        rows.bodies[b].error = error
    for s in range(count):
        met = rows.bodies[pieces.body[s]]
        met.error = max(met.error, error + min(pieces.radius[s], 2.0 * INTERPOLATION))
    kept, overlapping = kept_margins(i, numbers, radius, count, rows, tables)
    end = count
    while end > 0:
        b = pieces.body[end - 1]
        begin = end - 1
        while begin > 0 and pieces.body[begin - 1] == b:
            begin -= 1
        known = count
        if kept[b, 0] < kept[b, 1]:
            count += cut_row(tables.settings.period, begin, end, count, rows)
        for s in range(begin, end + count - known):
            pieces.radius[s] += radius[b] + error
            rows.balls[s, 3] += radius[b] + rows.bodies[b].hull_radius + error + kept[b, 1]
        add_margin(kept[b, 0], kept[b, 1], margin, np.inf, begin, end + count - known, rows, tables.settings)
        end = begin
    return overlapping, count


@kernel
def kept_margins(
    i: int, numbers: Indices, radius: Array, count: int, rows: ObstaclePieces, tables: DecisionTables
) -> tuple[Array, bool]:
    """The margins (b, 2) [m], now and then, that robot i keeps from passive bodies `numbers` (b,): `kept_margin`.

    Bodies have radii (b,) [m] and the first `count` rows. Returns also whether the robot overlaps one.
    """
    robot = tables.robots.each[i]
    bodies = tables.bodies
    pieces = rows.pieces
    near = heads_nearby(i, radius, count, rows, tables)
    body = pieces.body[near]
    places, directions = places_now(pieces, near, robot.position[:])
    found = distances(
        places, directions, rows.hull[body], hulls_of_bodies(bodies.corners, rows.hull, np.empty((4, 2, 0)))
    )
    overlapping = False
    kept = np.full((len(radius), 2), robot.margin)
    for h in range(len(near)):
        s = near[h]
        clearance = found[h, 0] - radius[body[h]]
        passive = bodies.each[numbers[body[h]]]
        if passive.uncertain:
            clearance -= pieces.radius[s] + pieces.growth[s] * share_of_piece(pieces.times, s)
        # From a body that a robot at rest may touch there is nothing to separate.
        overlapping = overlapping or (passive.at_rest and overlaps(clearance))
        now, then = kept_margin(clearance, robot.margin, rows.bodies[body[h]].error)
        kept[body[h], 0] = max(now, -radius[body[h]])
        kept[body[h], 1] = max(then, -radius[body[h]])
    return kept, overlapping


@kernel
def cut_row(at: float, begin: int, end: int, count: int, rows: ObstaclePieces) -> int:
    """Cut the row among `begin` to `end`, of one body, that the time `at` [s] lies within; the number of added rows.

    The rows after it, of `count` in all, move on by one.
    """
    pieces = rows.pieces
    at_row = -1
    for s in range(begin, end):
        if pieces.times[s, 0] < at < pieces.times[s, 1]:
            at_row = s
    if at_row < 0:
        return 0
    for s in range(count - 1, at_row - 1, -1):
        copy_into(pieces.times[s + 1], pieces.times[s])
        copy_restricted(pieces.points[s], 0.0, 1.0, pieces.points[s + 1])
        if len(pieces.turns) > 0:
            copy_restricted(pieces.turns[s], 0.0, 1.0, pieces.turns[s + 1])
        pieces.radius[s + 1], pieces.growth[s + 1] = pieces.radius[s], pieces.growth[s]
        pieces.body[s + 1] = pieces.body[s]
        copy_into(rows.balls[s + 1], rows.balls[s])
        copy_into(rows.margin[s + 1], rows.margin[s])
    s = at_row
    share = (at - pieces.times[s, 0]) / (pieces.times[s, 1] - pieces.times[s, 0])
    for part in range(2):
        a, b = (share, 1.0) if part == 1 else (0.0, share)
        copy_restricted(pieces.points[s + part], a, b, pieces.points[s + part])
        if len(pieces.turns) > 0:
            copy_restricted(pieces.turns[s + part], a, b, pieces.turns[s + part])
        pieces.times[s + part, 1 - part] = at
        pieces.radius[s + part] += a * pieces.growth[s + part]
        pieces.growth[s + part] *= b - a
    return 1


@kernel
def add_margin(
    now: float,
    then: float,
    whole: float,
    regain: float,
    begin: int,
    end: int,
    rows: ObstaclePieces,
    settings: DecisionSettings,
) -> None:
    """Add a margin [m] to the radii of rows `begin` to `end`, of one body: from `now` evenly to `then` in one period.

    Then it stays, or becomes `whole` at the time `regain` [s]. See `ObstaclePieces.margin`.
    """
    pieces = rows.pieces
    span = max(regain - settings.period, 0.0)
    kept = np.empty(2)
    for s in range(begin, end):
        for k in range(2):
            t = pieces.times[s, k]
            kept[k] = now + (then - now) * min(max(t / settings.period, 0.0), 1.0)
            if regain < np.inf and t > settings.period:
                kept[k] += (whole - then) * (min((t - settings.period) / span, 1.0) if span > 0.0 else 1.0)
        pieces.radius[s] += kept[0]
        pieces.growth[s] += kept[1] - kept[0]
        rows.margin[s, 0] = max(kept[0], 0.0)
        rows.margin[s, 1] = max(kept[1], 0.0) - max(kept[0], 0.0)


@kernel
def heads_nearby(i: int, radius: Array, count: int, rows: ObstaclePieces, tables: DecisionTables) -> Indices:
    """Of the first `count` rows, those that hold the time now and to which robot i may be nearer than the margin.

    They are of bodies with radii (b,) [m].
    """
    robot = tables.robots.each[i]
    near = np.empty(count, np.int64)
    found = 0
    for s in range(count):
        b = rows.pieces.body[s]
        grown = radius[b] + rows.bodies[b].hull_radius + robot.margin + CONTACT_SLACK
        if rows.pieces.times[s, 0] <= 0.0 and is_near(rows.balls[s], robot.position, grown):
            near[found] = s
            found += 1
    return near[:found]


# Shares of the avoidance of two robots that avoid each other, and the side on which they pass.


AGREED_SIDE: Final = 0.1
"""[1] Half the width by which a robot counts as wider on the side on which two robots do not pass, in sums of radii.
Larger: robots pass farther from each other and arrive later. Smaller: two robots that avoid towards the same side
collide."""

SIDE_ROUNDING: Final = 1e-18
"""[1] Square of the share of the relative velocity across the line between two robots that is a side. Larger: robots
that meet almost head-on pass on the right. Smaller: rounding decides the side."""


@kernel
def share_of(robot: Robot, other: Robot, settings: DecisionSettings) -> float:
    """The part [1] of the avoidance that a robot does itself: with more priority than the other one it does less."""
    own = settings.share * other.priority
    rest = (1.0 - settings.share) * robot.priority
    return float(own / (own + rest))


@kernel
def agreed_side(robot: Robot, other: Robot, position: Array, velocity: Array, room: float, side: Array) -> float:
    """Widening [m] of the other robot towards a side, the unit vector `side` (d,).

    Two robots that would both make a half of the avoidance collide if they do so towards opposite sides. Each therefore
    passes on the side on which it would pass now if neither changed its velocity, the right one if that is none. The
    other side counts as wider by twice the result, by which the body is displaced and grown. Robots that will not meet
    agree on nothing. Both robots find the same side, since the relative motion of one is the negative of the other's.

    Args:
        position, velocity: (d,) [m], [m/s] of the other robot as observed. room: [m] by which the body may grow now.
    """
    d = len(side)
    square = 0.0
    along = 0.0
    fast = 0.0
    for axis in range(d):
        away = position[axis] - robot.position[axis]
        relative = robot.velocity[axis] - velocity[axis]
        square += away * away
        along += away * relative
        fast += relative * relative
    size = robot.radius + other.radius + robot.margin_among
    aside = 0.0
    if along <= 0.0 or square <= 0.0 or square - along * along / fast >= size * size:
        return 0.0
    for axis in range(d):
        away = position[axis] - robot.position[axis]
        relative = robot.velocity[axis] - velocity[axis]
        side[axis] = away * along / square - relative
        aside += squared(side[axis])
    if aside <= SIDE_ROUNDING * fast:
        # To the right of the line to the other robot lies the free side.
        side[0] = robot.position[1] - position[1]
        side[1] = position[0] - robot.position[0]
        aside = squared(side[0]) + squared(side[1])
        if d == 3:
            side[2] = 0.0
        if aside <= 0.0:
            return 0.0
    for axis in range(d):
        side[axis] /= np.sqrt(aside)
    return float(max(min(AGREED_SIDE * size, room), 0.0))


# Encounters of one robot: passive bodies and other robots as pieces with margins.


COOPERATION_RANGE: Final = 0.3
"""[1] Robots nearer to each other than this share of the sum of their radii avoid each other in full, not in part.
Larger: less use is made of reciprocity. Smaller: two robots with wrong predictions of each other touch."""


@kernel
def new_bodies(count: int) -> Records[MetBody]:
    """Bodies (n,) of no robot, which do no part of the avoidance."""
    bodies = np.zeros(count, MET_BODY)
    for b in range(count):
        bodies[b].robot = -1
        bodies[b].share = 1.0
        bodies[b].at_rest = True
    return bodies  # type: ignore[return-value]


@kernel
def obstacle_pieces(
    i: int, near: Indices, error: float, centers: Array, radii: Array, agrees: bool, tables: DecisionTables
) -> tuple[ObstaclePieces, bool]:
    """The pieces of passive bodies and of the robots `near` (m,) that robot i may meet; whether it overlaps one now.

    Passive rows are those that its motion, bounded by `centers` (w, 3) [m] and `radii` (w,) [m], comes near. Bodies are
    larger by `error` [m], that of the robot's own pieces. If the robot `agrees` on sides, see `agreed_side`.
    """
    robots = tables.robots
    bodies = tables.bodies
    d = tables.settings.dimension
    q = robots.observed.points.shape[1]
    passive = passive_in_reach(i, error, centers, radii, tables)
    total = len(passive.body)
    for k in near:
        skeleton = robots.each[k].skeleton
        total += tables.robot_bodies.first[skeleton + 1] - tables.robot_bodies.first[skeleton]
    # One row more for each passive body and two for each body of a robot: pieces are cut where margins have grown.
    n = len(passive.row) + len(passive.body) + (total - len(passive.body)) * (q + 2)
    turning = len(bodies.pieces.turns) > 0
    turns = np.zeros((n if turning else 0, 4, 2))
    pieces = Pieces(np.empty((n, 2)), np.empty((n, 4, d)), np.empty(n), np.zeros(n), turns, np.empty(n, np.int64))
    met = new_bodies(total)
    hull = np.full(total, -1)
    balls = np.full((n, 4), np.inf)
    rows = ObstaclePieces(pieces, np.zeros((n, 2)), balls, met, hull)
    s = 0
    overlaps_passive = False
    if len(passive.row):
        s = add_passive(i, passive, error, centers, radii, rows, tables)
        overlaps_passive, s = grow_passive(i, passive.body, s, error, rows, tables)
    overlaps_robot, s = add_robots(i, near, len(passive.body), s, error, agrees, rows, tables)
    used = Pieces(pieces.times[:s], pieces.points[:s], pieces.radius[:s], pieces.growth[:s], turns[:s], pieces.body[:s])
    found = ObstaclePieces(used, rows.margin[:s], rows.balls[:s], met, hull)
    return found, overlaps_passive or overlaps_robot


@inlined
def add_robots(
    i: int, near: Indices, body: int, s: int, error: float, agrees: bool, rows: ObstaclePieces, tables: DecisionTables
) -> tuple[bool, int]:
    """Write the bodies of the robots `near` (m,) on their observed paths, grown by robot i and the margin.

    The first is number `body` and begins at row s. Returns whether robot i overlaps one, and the next free row.
    """
    robots = tables.robots
    bodies = tables.robot_bodies
    settings = tables.settings
    pieces = rows.pieces
    robot = robots.each[i]
    observed = robots.observed
    d = settings.dimension
    now = settings.now
    position, velocity = np.empty(d), np.empty(d)
    place = np.zeros((1, 3))
    overlapping = False
    side = np.zeros(d)
    margin = robot.margin_among
    for k in near:
        other = robots.each[k]
        state_on_path(observed, k, now, position, velocity)
        both = robot.rounding + other.rounding
        for j in range(bodies.first[other.skeleton], bodies.first[other.skeleton + 1]):
            part = bodies.each[j]
            square = 0.0
            for axis in range(d):
                place[0, axis] = position[axis] + part.offset[axis] - robot.position[axis]
                square += squared(place[0, axis])
            distance = np.sqrt(square)
            if bodies.hull[j] >= 0:
                hulls = hulls_of_bodies(tables.bodies.corners, bodies.hull, np.empty((4, 2, 0)))
                distance = distances(place, np.array([[1.0, 0.0]]), bodies.hull[j : j + 1], hulls)[0, 0]
            clearance = distance - (part.radius + both)
            overlapping = overlapping or overlaps(clearance)
            kept, then = kept_margin(clearance, margin, error)
            # No robot relies on the other where both are close: there it is too late for mistakes.
            if settings.share < 1.0 and clearance > COOPERATION_RANGE * (robot.radius + other.radius):
                rows.bodies[body].share = share_of(robot, other, settings)
            wider = 0.0
            if agrees and rows.bodies[body].share < 1.0:
                wider = agreed_side(robot, other, position, velocity, clearance - max(then, 0.0), side)
            rows.bodies[body].robot = k
            rows.hull[body] = bodies.hull[j]
            rows.bodies[body].hull_radius = part.hull_radius
            rows.bodies[body].error = error
            end = s
            for p in range(observed.points.shape[1]):
                first = observed.times[k, p]
                last = observed.times[k, p + 1]
                if last <= now or last <= first or first >= now + settings.horizon:
                    continue
                put_piece(first - now, last - now, observed.points[k, p], end, pieces)
                pieces.body[end] = body
                end += 1
            if kept < margin:
                end += cut_row(settings.period, s, end, end, rows)
                end += cut_row(settings.regain, s, end, end, rows)
            for row in range(s, end):
                pieces.radius[row] = part.radius + both + error + wider
                for c in range(4):
                    for axis in range(d):
                        pieces.points[row, c, axis] += part.offset[axis] + wider * side[axis]
                    if len(pieces.turns) > 0:
                        pieces.turns[row, c, 0] = 1.0
            add_margin(kept, then, margin, settings.regain, s, end, rows, settings)
            s = end
            body = body + 1
    return overlapping, s


@kernel
def put_piece(first: float, last: float, points: Array, s: int, pieces: Pieces) -> None:
    """Write a piece, control points (4, d) driven from `first` to `last` [s], into row s, with no radius."""
    pieces.times[s, 0] = first
    pieces.times[s, 1] = last
    pieces.radius[s] = 0.0
    pieces.growth[s] = 0.0
    for c in range(4):
        for axis in range(pieces.points.shape[2]):
            pieces.points[s, c, axis] = points[c, axis]


@kernel
def limit_margin(i: int, extra: float, rows: ObstaclePieces, tables: DecisionTables) -> None:
    """Leave at most `extra` [m] of the last part, `enough`, of the margins of robot i in all radii."""
    robot = tables.robots.each[i]
    radius = rows.pieces.radius
    growth = rows.pieces.growth
    margin = rows.margin
    for s in range(len(radius)):
        whole = robot.margin_among if rows.bodies[rows.pieces.body[s]].robot >= 0 else robot.margin
        most = whole - robot.enough + extra
        first = min(margin[s, 0], most)
        last = min(margin[s, 0] + margin[s, 1], most)
        radius[s] -= margin[s, 0] - first
        growth[s] -= margin[s, 1] - (last - first)
        margin[s, 0] = first
        margin[s, 1] = last - first


@kernel
def reduce_margin(share: float, rows: ObstaclePieces) -> None:
    """Take the `share` [1] of the whole margin off all radii."""
    for s in range(len(rows.pieces.body)):
        rows.pieces.radius[s] -= share * rows.margin[s, 0]
        rows.pieces.growth[s] -= share * rows.margin[s, 1]
