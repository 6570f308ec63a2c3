"""Encounters of one robot: passive bodies and other robots as pieces with margins."""

import numpy as np

from slalom.kernels.arrays import Array, Hulls, Indices, MaybeCorners, MaybeHulls, Pieces
from slalom.kernels.decision.paths import state_on_path
from slalom.kernels.decision.reciprocity import agreed_side, share_of
from slalom.kernels.decision.tables import (
    EVERY_WORLD,
    MET_BODY,
    EncounterTables,
    MetBody,
    ObstaclePieces,
)
from slalom.kernels.geometry.cubic import restrict, value
from slalom.kernels.geometry.hulls import distances
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.records import Records
from slalom.kernels.relative_motion.contact import kept_margin, overlaps
from slalom.kernels.relative_motion.window import share_of_piece
from slalom.kernels.squared import squared
from slalom.tolerances import CONTACT_SLACK, COOPERATION_RANGE


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
def passive_rows_in_reach(i: int, error: float, centers: Array, radii: Array, scene: EncounterTables) -> Indices:
    """The rows of passive pieces that robot i can approach closer than the margin within the horizon.

    `centers` (w, 3) [m] and `radii` (w,) [m] bound its motion in each window of the horizon.
    """
    robot, bodies, settings = scene.robots.each[i], scene.bodies, scene.settings
    times, balls, body = bodies.pieces.times, bodies.balls, bodies.pieces.body
    rows, count, horizon = np.empty(len(body), np.int64), 0, settings.horizon
    more = robot.rounding - bodies.robot_rounding + robot.margin + error
    for s in range(len(body)):
        passive = bodies.passive[body[s]]
        if times[s, 1] <= 0.0 or times[s, 0] >= horizon or is_elsewhere(passive.world, robot.world):
            continue
        grown = passive.radius + passive.hull_radius + more
        if meets_balls(balls[s], grown, times[s, 0], times[s, 1], horizon, centers, radii):
            rows[count] = s
            count += 1
    return rows[:count]


@kernel
def new_bodies(count: int) -> Records[MetBody]:
    """Bodies (n,) of no robot, which do no part of the avoidance."""
    bodies = np.zeros(count, MET_BODY)
    for b in range(count):
        bodies[b].robot, bodies[b].share, bodies[b].at_rest = -1, 1.0, True
    return bodies  # type: ignore[return-value]


@kernel
def obstacle_pieces(
    i: int, near: Indices, error: float, centers: Array, radii: Array, agrees: bool, scene: EncounterTables
) -> tuple[ObstaclePieces, bool]:
    """The pieces of passive bodies and of the robots `near` (m,) that robot i may meet; whether it overlaps one now.

    Passive rows are those that its motion, bounded by `centers` (w, 3) [m] and `radii` (w,) [m], comes near. Bodies are
    larger by `error` [m], that of the robot's own pieces. If the robot `agrees` on sides, see `agreed_side`.
    """
    robots, bodies, fixed = scene.robots, scene.bodies, len(scene.bodies.passive)
    d, q = scene.settings.dimension, robots.observed.points.shape[1]
    passive = passive_rows_in_reach(i, error, centers, radii, scene)
    total = fixed
    for k in near:
        skeleton = robots.each[k].skeleton
        total += bodies.robot_first[skeleton + 1] - bodies.robot_first[skeleton]
    # One row more for each body of a robot: one piece is cut where the margin is whole again.
    n, turning = len(passive) + (total - fixed) * (q + 1), len(bodies.pieces.turns) > 0
    turns = np.zeros((n if turning else 0, 4, 2))
    pieces = Pieces(np.empty((n, 2)), np.empty((n, 4, d)), np.empty(n), np.zeros(n), turns, np.empty(n, np.int64))
    met, hull, balls = new_bodies(total), np.full(total, -1), np.full((n, 4), np.inf)
    rows = ObstaclePieces(pieces, np.zeros((n, 2)), balls, met, hull)
    overlaps_passive = add_passive(i, passive, error, rows, scene) if fixed else False
    overlaps_robot, s = add_robots(i, near, len(passive), error, agrees, rows, scene)
    used = Pieces(pieces.times[:s], pieces.points[:s], pieces.radius[:s], pieces.growth[:s], turns[:s], pieces.body[:s])
    found = ObstaclePieces(used, rows.margin[:s], rows.balls[:s], met, hull)
    return found, overlaps_passive or overlaps_robot


@inlined
def add_robots(
    i: int, near: Indices, s: int, error: float, agrees: bool, rows: ObstaclePieces, scene: EncounterTables
) -> tuple[bool, int]:
    """Write the bodies of the robots `near` (m,) on their observed paths, grown by robot i and the margin.

    They begin at row s. Returns whether robot i overlaps one, and the next free row.
    """
    robots, bodies, settings, pieces = scene.robots, scene.bodies, scene.settings, rows.pieces
    robot, observed, d, now = robots.each[i], robots.observed, settings.dimension, settings.now
    position, velocity, place, overlapping = np.empty(d), np.empty(d), np.zeros((1, 3)), False
    side = np.zeros(d)
    body, turning, margin = len(bodies.passive), len(pieces.turns) > 0, robot.margin
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
def reduce_margin(share: float, rows: ObstaclePieces) -> None:
    """Take the `share` [1] of the whole margin off all radii."""
    for s in range(len(rows.pieces.body)):
        rows.pieces.radius[s] -= share * rows.margin[s, 0]
        rows.pieces.growth[s] -= share * rows.margin[s, 1]


@kernel
def add_passive(i: int, passive: Indices, error: float, rows: ObstaclePieces, scene: EncounterTables) -> bool:
    """Write the rows `passive` (m,) of passive bodies, grown by robot i and by the margin it can keep, into the first.

    Returns whether the robot overlaps one.
    """
    bodies, pieces = scene.bodies, rows.pieces
    fixed, d, turning = bodies.pieces, pieces.points.shape[2], len(pieces.turns) > 0
    more = scene.robots.each[i].rounding - bodies.robot_rounding
    radius = np.empty(len(bodies.passive))
    for b in range(len(radius)):
        radius[b] = bodies.passive[b].radius + more
        rows.hull[b], rows.bodies[b].hull_radius = bodies.hull[b], bodies.passive[b].hull_radius
        rows.bodies[b].at_rest = bodies.passive[b].at_rest
    overlapping = add_margin(i, radius, scene)
    for s in range(len(passive)):
        row, b = passive[s], fixed.body[passive[s]]
        pieces.times[s, 0], pieces.times[s, 1] = fixed.times[row, 0], fixed.times[row, 1]
        for c in range(4):
            for axis in range(d):
                pieces.points[s, c, axis] = fixed.points[row, c, axis]
            if turning:
                pieces.turns[s, c, 0], pieces.turns[s, c, 1] = fixed.turns[row, c, 0], fixed.turns[row, c, 1]
        pieces.radius[s], pieces.growth[s] = fixed.radius[row] + radius[b] + error, fixed.growth[row]
        pieces.body[s] = b
        for axis in range(3):
            rows.balls[s, axis] = bodies.balls[row, axis]
        rows.balls[s, 3] = bodies.balls[row, 3] + radius[b] + bodies.passive[b].hull_radius + error
        rows.margin[s, 0] = max(radius[b] - bodies.passive[b].radius - more, 0.0)
    return overlapping


@kernel
def add_margin(i: int, radius: Array, scene: EncounterTables) -> bool:
    """Add the margin that robot i can keep to the radii (b,) [m] of passive bodies; whether it overlaps one."""
    robot, bodies, settings = scene.robots.each[i], scene.bodies, scene.settings
    fixed, near = bodies.pieces, passive_heads_nearby(i, radius, scene)
    body = fixed.body[near]
    places, directions = np.zeros((len(near), 3)), np.zeros((len(near), 2))
    directions[:, 0] = 1.0
    for h in range(len(near)):
        s = near[h]
        x = share_of_piece(fixed.times, s)
        for axis in range(settings.dimension):
            p = fixed.points[s, :, axis]
            places[h, axis] = value(p[0], p[1], p[2], p[3], x) - robot.position[axis]
        if len(fixed.turns) > 0:
            for axis in range(2):
                p = fixed.turns[s, :, axis]
                directions[h, axis] = value(p[0], p[1], p[2], p[3], x)
    found = distances(
        places, directions, bodies.hull[body], hulls_of_bodies(bodies.corners, bodies.hull, np.empty((4, 2, 0)))
    )
    overlapping = False
    kept = np.full(len(radius), robot.margin)
    for h in range(len(near)):
        s, clearance = near[h], found[h, 0] - radius[body[h]]
        if bodies.passive[body[h]].uncertain:
            clearance -= fixed.radius[s] + fixed.growth[s] * share_of_piece(fixed.times, s)
        # From a body that a robot at rest may touch there is nothing to separate.
        overlapping = overlapping or (bodies.passive[body[h]].at_rest and overlaps(clearance))
        kept[body[h]] = max(kept_margin(clearance, robot.margin), -radius[body[h]])
    for b in range(len(radius)):
        radius[b] += kept[b]
    return overlapping


@kernel
def passive_heads_nearby(i: int, radius: Array, scene: EncounterTables) -> Indices:
    """The heads of passive bodies with radii (b,) [m] of which robot i may be nearer to than the margin now."""
    robot, bodies, count = scene.robots.each[i], scene.bodies, 0
    near = np.empty(len(bodies.heads), np.int64)
    for s in bodies.heads:
        b, square = bodies.pieces.body[s], 0.0
        if is_elsewhere(bodies.passive[b].world, robot.world):
            continue
        for axis in range(3):
            square += squared(bodies.balls[s, axis] - robot.position[axis])
        reach = bodies.balls[s, 3] + radius[b] + bodies.passive[b].hull_radius + robot.margin + CONTACT_SLACK
        if square <= reach * reach:
            near[count] = s
            count += 1
    return near[:count]
