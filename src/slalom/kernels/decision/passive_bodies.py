"""Passive bodies that one robot may meet within the horizon: their pieces, cut to it, with margins."""

from typing import NamedTuple

import numpy as np

from slalom.kernels.arrays import Array, Hulls, Indices, MaybeCorners, MaybeHulls
from slalom.kernels.decision.neighbours import farthest_distance
from slalom.kernels.decision.tables import EVERY_WORLD, DecisionTables, ObstaclePieces, Robot
from slalom.kernels.geometry.cubic import value
from slalom.kernels.geometry.hulls import distances
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.relative_motion.contact import kept_margin, overlaps
from slalom.kernels.relative_motion.window import copy_restricted, put_ball, rows_within, share_of_piece
from slalom.kernels.squared import squared
from slalom.tolerances import CONTACT_SLACK


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
    per_second, last = len(radii) / horizon, len(radii) - 1
    for w in range(max(int(begin * per_second), 0), min(int(min(end, horizon) * per_second), last) + 1):
        x, y, z = centers[w, 0] - ball[0], centers[w, 1] - ball[1], centers[w, 2] - ball[2]
        reach = radii[w] + (ball[3] + more)
        if reach >= 0.0 and x * x + y * y + z * z <= reach * reach:
            return True
    return False


@inlined
def is_near(ball: Array, position: Array, distance: float) -> bool:
    """Whether a ball (4,) [m] is no farther from the `position` (3,) [m] than `distance` [m]."""
    square, reach = 0.0, ball[3] + distance
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
    robot, bodies, now, horizon = tables.robots.each[i], tables.bodies, tables.bodies.now, tables.settings.horizon
    times, count, b = bodies.pieces.times, 0, 0
    row, number = np.empty(len(times), np.int64), np.empty(len(times), np.int64)
    body = np.empty(len(bodies.passive), np.int64)
    more = robot.rounding - bodies.robot_rounding + robot.margin + error
    far = farthest_distance(robot.position[:], centers, radii) + CONTACT_SLACK
    for k in range(len(bodies.passive)):
        passive, known = bodies.passive[k], count
        until = min(bodies.until[passive.owner], horizon)
        if is_elsewhere(passive.world, robot.world) or not is_near(bodies.body_balls[k], robot.position, far + more):
            continue
        grown = passive.radius + passive.hull_radius + more
        first, last = rows_within(times, bodies.first_piece[k], bodies.first_piece[k + 1], now, now + until)
        for s in range(first, last):
            begin, end = times[s, 0] - now, times[s, 1] - now
            if may_come_near(bodies.balls[s], begin, end, grown, robot, horizon, centers, radii):
                row[count], number[count] = s, b
                count += 1
        if count > known:
            body[b] = k
            b += 1
    return PassiveRows(row[:count], number[:count], body[:b])


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
    robot, bodies, pieces, horizon = tables.robots.each[i], tables.bodies, rows.pieces, tables.settings.horizon
    fixed, turning, count, now = bodies.pieces, len(rows.pieces.turns) > 0, 0, tables.bodies.now
    more = robot.rounding - bodies.robot_rounding + robot.margin + error
    for k in range(len(passive.row)):
        s, b = passive.row[k], passive.number[k]
        body = bodies.passive[passive.body[b]]
        begin, end = max(fixed.times[s, 0], now), min(fixed.times[s, 1], now + bodies.until[body.owner])
        width = fixed.times[s, 1] - fixed.times[s, 0]
        share, last = (begin - fixed.times[s, 0]) / width, (end - fixed.times[s, 0]) / width
        copy_restricted(fixed.points[s], share, last, pieces.points[count])
        if turning:
            copy_restricted(fixed.turns[s], share, last, pieces.turns[count])
        pieces.times[count, 0], pieces.times[count, 1], pieces.body[count] = begin - now, end - now, b
        pieces.radius[count] = fixed.radius[s] + fixed.growth[s] * share
        pieces.growth[count] = fixed.growth[s] * (last - share)
        ball, grown = rows.balls[count], body.radius + body.hull_radius + more
        for axis in range(4):
            ball[axis] = bodies.balls[s, axis]
        if (share > 0.0 or last < 1.0) and ball[3] < np.inf:
            put_ball(pieces, count, ball)
            if not may_come_near(ball, begin - now, end - now, grown, robot, horizon, centers, radii):
                continue
        count += 1
    return count


@kernel
def grow_passive(
    i: int, numbers: Indices, count: int, error: float, rows: ObstaclePieces, tables: DecisionTables
) -> bool:
    """Grow the first `count` rows, of passive bodies `numbers` (b,), by robot i and by the margin that it can keep.

    Returns whether the robot overlaps one.
    """
    bodies, pieces = tables.bodies, rows.pieces
    more = tables.robots.each[i].rounding - bodies.robot_rounding
    radius = np.empty(len(numbers))
    for b in range(len(radius)):
        passive = bodies.passive[numbers[b]]
        radius[b] = passive.radius + more
        rows.hull[b], rows.bodies[b].hull_radius = bodies.hull[numbers[b]], passive.hull_radius
        rows.bodies[b].at_rest = passive.at_rest
    overlapping = add_margin(i, numbers, radius, count, rows, tables)
    for s in range(count):
        b = pieces.body[s]
        passive = bodies.passive[numbers[b]]
        pieces.radius[s] += radius[b] + error
        rows.balls[s, 3] += radius[b] + passive.hull_radius + error
        rows.margin[s, 0] = max(radius[b] - passive.radius - more, 0.0)
    return overlapping


@kernel
def add_margin(
    i: int, numbers: Indices, radius: Array, count: int, rows: ObstaclePieces, tables: DecisionTables
) -> bool:
    """Add the margin that robot i can keep to the radii (b,) [m] of passive bodies `numbers` (b,).

    Their pieces are the first `count` rows. Returns whether the robot overlaps one.
    """
    robot, bodies, pieces = tables.robots.each[i], tables.bodies, rows.pieces
    near = heads_nearby(i, radius, count, rows, tables)
    body = pieces.body[near]
    places, directions = np.zeros((len(near), 3)), np.zeros((len(near), 2))
    directions[:, 0] = 1.0
    for h in range(len(near)):
        s = near[h]
        x = share_of_piece(pieces.times, s)
        for axis in range(tables.settings.dimension):
            p = pieces.points[s, :, axis]
            places[h, axis] = value(p[0], p[1], p[2], p[3], x) - robot.position[axis]
        if len(pieces.turns) > 0:
            for axis in range(2):
                p = pieces.turns[s, :, axis]
                directions[h, axis] = value(p[0], p[1], p[2], p[3], x)
    found = distances(
        places, directions, rows.hull[body], hulls_of_bodies(bodies.corners, rows.hull, np.empty((4, 2, 0)))
    )
    overlapping = False
    kept = np.full(len(radius), robot.margin)
    for h in range(len(near)):
        s, clearance = near[h], found[h, 0] - radius[body[h]]
        passive = bodies.passive[numbers[body[h]]]
        if passive.uncertain:
            clearance -= pieces.radius[s] + pieces.growth[s] * share_of_piece(pieces.times, s)
        # From a body that a robot at rest may touch there is nothing to separate.
        overlapping = overlapping or (passive.at_rest and overlaps(clearance))
        kept[body[h]] = max(kept_margin(clearance, robot.margin), -radius[body[h]])
    for b in range(len(radius)):
        radius[b] += kept[b]
    return overlapping


@kernel
def heads_nearby(i: int, radius: Array, count: int, rows: ObstaclePieces, tables: DecisionTables) -> Indices:
    """Of the first `count` rows, those that hold the time now and to which robot i may be nearer than the margin.

    They are of bodies with radii (b,) [m].
    """
    robot, near, found = tables.robots.each[i], np.empty(count, np.int64), 0
    for s in range(count):
        b = rows.pieces.body[s]
        grown = radius[b] + rows.bodies[b].hull_radius + robot.margin + CONTACT_SLACK
        if rows.pieces.times[s, 0] <= 0.0 and is_near(rows.balls[s], robot.position, grown):
            near[found] = s
            found += 1
    return near[:found]
