"""Encounters of one robot: passive bodies and other robots as pieces with margins."""

import numpy as np

from slalom.kernels.arrays import Array, Indices, Pieces
from slalom.kernels.decision.passive_bodies import add_passive, grow_passive, hulls_of_bodies, passive_in_reach
from slalom.kernels.decision.paths import state_on_path
from slalom.kernels.decision.reciprocity import agreed_side, share_of
from slalom.kernels.decision.tables import MET_BODY, DecisionTables, MetBody, ObstaclePieces
from slalom.kernels.geometry.cubic import restrict
from slalom.kernels.geometry.hulls import distances
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.records import Records
from slalom.kernels.relative_motion.contact import kept_margin, overlaps
from slalom.kernels.squared import squared
from slalom.tolerances import COOPERATION_RANGE


@kernel
def new_bodies(count: int) -> Records[MetBody]:
    """Bodies (n,) of no robot, which do no part of the avoidance."""
    bodies = np.zeros(count, MET_BODY)
    for b in range(count):
        bodies[b].robot, bodies[b].share, bodies[b].at_rest = -1, 1.0, True
    return bodies  # type: ignore[return-value]


@kernel
def obstacle_pieces(
    i: int, near: Indices, error: float, centers: Array, radii: Array, agrees: bool, tables: DecisionTables
) -> tuple[ObstaclePieces, bool]:
    """The pieces of passive bodies and of the robots `near` (m,) that robot i may meet; whether it overlaps one now.

    Passive rows are those that its motion, bounded by `centers` (w, 3) [m] and `radii` (w,) [m], comes near. Bodies are
    larger by `error` [m], that of the robot's own pieces. If the robot `agrees` on sides, see `agreed_side`.
    """
    robots, bodies = tables.robots, tables.bodies
    d, q = tables.settings.dimension, robots.observed.points.shape[1]
    passive = passive_in_reach(i, error, centers, radii, tables)
    total = len(passive.body)
    for k in near:
        skeleton = robots.each[k].skeleton
        total += bodies.robot_first[skeleton + 1] - bodies.robot_first[skeleton]
    # One row more for each body of a robot: one piece is cut where the margin is whole again.
    n, turning = len(passive.row) + (total - len(passive.body)) * (q + 1), len(bodies.pieces.turns) > 0
    turns = np.zeros((n if turning else 0, 4, 2))
    pieces = Pieces(np.empty((n, 2)), np.empty((n, 4, d)), np.empty(n), np.zeros(n), turns, np.empty(n, np.int64))
    met, hull, balls = new_bodies(total), np.full(total, -1), np.full((n, 4), np.inf)
    rows = ObstaclePieces(pieces, np.zeros((n, 2)), balls, met, hull)
    s, overlaps_passive = 0, False
    if len(passive.row):
        s = add_passive(i, passive, error, centers, radii, rows, tables)
        overlaps_passive = grow_passive(i, passive.body, s, error, rows, tables)
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
    robots, bodies, settings, pieces = tables.robots, tables.bodies, tables.settings, rows.pieces
    robot, observed, d, now = robots.each[i], robots.observed, settings.dimension, settings.now
    position, velocity, place, overlapping = np.empty(d), np.empty(d), np.zeros((1, 3)), False
    side = np.zeros(d)
    turning, margin = len(pieces.turns) > 0, robot.margin_among
    for k in near:
        other = robots.each[k]
        state_on_path(observed, k, now, position, velocity)
        both = robot.rounding + other.rounding
        for j in range(bodies.robot_first[other.skeleton], bodies.robot_first[other.skeleton + 1]):
            part, square = bodies.robot_bodies[j], 0.0
            for axis in range(d):
                place[0, axis] = position[axis] + part.offset[axis] - robot.position[axis]
                square += squared(place[0, axis])
            distance = np.sqrt(square)
            if bodies.robot_hull[j] >= 0:
                hulls = hulls_of_bodies(bodies.corners, bodies.robot_hull, np.empty((4, 2, 0)))
                distance = distances(place, np.array([[1.0, 0.0]]), bodies.robot_hull[j : j + 1], hulls)[0, 0]
            clearance = distance - (part.radius + both)
            overlapping = overlapping or overlaps(clearance)
            extra = kept_margin(clearance, margin)
            # No robot relies on the other where both are close: there it is too late for mistakes.
            if settings.share < 1.0 and clearance > COOPERATION_RANGE * (robot.radius + other.radius):
                rows.bodies[body].share = share_of(robot, other, settings)
            wider = 0.0
            if agrees and rows.bodies[body].share < 1.0:
                wider = agreed_side(robot, other, position, velocity, clearance - max(extra, 0.0), side)
            rows.bodies[body].robot, rows.hull[body] = k, bodies.robot_hull[j]
            rows.bodies[body].hull_radius = part.hull_radius
            end, cut = s, settings.regain if extra < margin else np.inf
            for p in range(observed.points.shape[1]):
                first, last = observed.times[k, p], observed.times[k, p + 1]
                if last <= now or last <= first or first >= now + settings.horizon:
                    continue
                end = add_piece(first - now, last - now, observed.points[k, p], cut, end, pieces)
            for row in range(s, end):
                pieces.radius[row], pieces.body[row] = part.radius + both + extra + error + wider, body
                rows.margin[row, 0] = max(extra, 0.0)
                for c in range(4):
                    for axis in range(d):
                        pieces.points[row, c, axis] += part.offset[axis] + wider * side[axis]
                    if turning:
                        pieces.turns[row, c, 0] = 1.0
            if cut < np.inf:
                grow_margin(margin - max(extra, 0.0), cut, s, end, pieces, rows.margin)
            s, body = end, body + 1
    return overlapping, s


@kernel
def add_piece(first: float, last: float, points: Array, cut: float, s: int, pieces: Pieces) -> int:
    """Write a piece, control points (4, d) driven from `first` to `last` [s], into row s; the next free row.

    Two rows if the time `cut` [s] lies within it.
    """
    parts = 2 if first < cut and cut < last else 1
    for part in range(parts):
        pieces.times[s, 0], pieces.times[s, 1] = first if part == 0 else cut, last if part == parts - 1 else cut
        for axis in range(pieces.points.shape[2]):
            p0, p1, p2, p3 = points[0, axis], points[1, axis], points[2, axis], points[3, axis]
            if parts == 2:
                e, f = (pieces.times[s, 0] - first) / (last - first), (pieces.times[s, 1] - first) / (last - first)
                p0, p1, p2, p3 = restrict(p0, p1, p2, p3, e, f)
            pieces.points[s, 0, axis], pieces.points[s, 1, axis] = p0, p1
            pieces.points[s, 2, axis], pieces.points[s, 3, axis] = p2, p3
        s += 1
    return s


@kernel
def grow_margin(lost: float, within: float, begin: int, end: int, pieces: Pieces, margin: Array) -> None:
    """Let the radii of rows `begin` to `end`, of one robot, grow evenly by the `lost` margin [m] `within` a time [s].

    `margin` (n, 2) [m]: see `ObstaclePieces`.
    """
    times = pieces.times
    for s in range(begin, end):
        early, late = lost * min(max(times[s, 0] / within, 0.0), 1.0), lost * min(max(times[s, 1] / within, 0.0), 1.0)
        pieces.radius[s] += early
        pieces.growth[s] = late - early
        margin[s, 0] += early
        margin[s, 1] = late - early


@kernel
def limit_margin(i: int, extra: float, rows: ObstaclePieces, tables: DecisionTables) -> None:
    """Leave at most `extra` [m] of the last part, `enough`, of the margins of robot i in all radii."""
    robot, radius, growth, margin = tables.robots.each[i], rows.pieces.radius, rows.pieces.growth, rows.margin
    for s in range(len(radius)):
        whole = robot.margin_among if rows.bodies[rows.pieces.body[s]].robot >= 0 else robot.margin
        most = whole - robot.enough + extra
        first, last = min(margin[s, 0], most), min(margin[s, 0] + margin[s, 1], most)
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
