"""Encounters of one robot: passive bodies and other robots as pieces with margins, and their relative motion."""

import numpy as np

from slalom.kernels.arrays import Array, Hulls, Indices, MaybeCorners, MaybeHulls, Pieces, PositionMap, Segments
from slalom.kernels.decision.paths import state_on_path
from slalom.kernels.decision.tables import (
    DecisionSettings,
    ObstaclePieces,
    PassiveObstacles,
    Paths,
    RelativeMotion,
    ResponseTable,
    RobotTable,
)
from slalom.kernels.geometry.cubic import copy_into, restrict, value
from slalom.kernels.geometry.hulls import distances
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.relative_motion.contact import kept_margin, overlaps
from slalom.kernels.relative_motion.segments import bounding_radii, relative_segments
from slalom.kernels.relative_motion.speed_limit import allowed_speed
from slalom.kernels.relative_motion.window import share_of_piece
from slalom.kernels.selection.admissible import segments_in_reach
from slalom.tolerances import COOPERATION_RANGE


@kernel
def in_reach(i: int, others: Indices, robots: RobotTable, settings: DecisionSettings) -> Indices:
    """Those of the robots `others` (m,) that robot i can meet within the horizon, both straight at max speed."""
    near, count = np.empty(len(others), np.int64), 0
    for k in others:
        speeds = robots.max_speed[i] + robots.max_speed[k]
        reach = speeds * settings.horizon + robots.radius[i] + robots.radius[k] + settings.margin
        square = 0.0
        for axis in range(settings.dimension):
            square += (robots.position[k, axis] - robots.position[i, axis]) ** 2
        if square <= reach * reach:
            near[count] = k
            count += 1
    return near[:count]


@inlined
def hulls_of_bodies(corners: MaybeCorners, hull: Indices, turned: Array) -> MaybeHulls:
    """Hulls with numbers `hull` (n,) and directions `turned` (4, 2, n); empty where there are no corners."""
    if len(corners) > 0:
        return Hulls(hull, turned, corners.corners, corners.first, corners.unordered)
    return ()


@inlined
def hulls_of_segments(corners: MaybeCorners, rows: ObstaclePieces, body: Indices, turned: Array) -> MaybeHulls:
    """The hulls of segments of those bodies (n,), `turned` (4, 2, n): their directions if any turns."""
    if len(corners) > 0:
        if len(rows.pieces.turns) == 0:
            turned = np.zeros((4, 2, len(body)))
            turned[:, 0] = 1.0
        return hulls_of_bodies(corners, rows.hull[body], turned)
    return ()


@kernel
def relative_table(
    rows: ObstaclePieces, passive: PassiveObstacles, motion: PositionMap, horizon: float
) -> tuple[Segments, MaybeHulls, Indices]:
    """The segments, hulls and bodies (n,) of the motion relative to a robot, up to the horizon [s]."""
    cut = relative_segments(rows.pieces, motion, horizon)
    table = Segments(cut.points, cut.gains, cut.radius, cut.growth, bounding_radii(cut, rows.hull_radius))
    return table, hulls_of_segments(passive.corners, rows, cut.body, cut.turns), cut.body


@inlined
def admissible_set(i: int, r: int, robots: RobotTable, responses: ResponseTable, settings: DecisionSettings) -> Array:
    """The admissible set (l, 5) of response r for robot i, balls as in `limits.Limits.admissible`."""
    count = 0
    for p in range(len(responses.peaks)):
        count += responses.peaks[p, 0] == r
    rows = np.zeros((count, 5))
    square = 0.0
    for axis in range(settings.dimension):
        square += robots.velocity[i, axis] ** 2
    speed = np.sqrt(square)
    fastest = allowed_speed(robots.max_speed[i], speed, robots.max_acceleration[i], responses.settled[r])
    k = 0
    for p in range(len(responses.peaks)):
        if responses.peaks[p, 0] != r:
            continue
        share, gain = responses.peaks[p, 2], responses.peaks[p, 3]
        rows[k, 0] = -1.0
        for axis in range(settings.dimension):
            rows[k, 1 + axis] = -share * robots.velocity[i, axis] / gain
        rows[k, 4] = (fastest if responses.peaks[p, 1] == 0.0 else robots.max_acceleration[i]) / abs(gain)
        k += 1
    return rows


@inlined
def relative_motion(
    i: int,
    r: int,
    rows: ObstaclePieces,
    robots: RobotTable,
    passive: PassiveObstacles,
    responses: ResponseTable,
    settings: DecisionSettings,
    unchanged: Array,
) -> RelativeMotion:
    """The relative motion of robot i under response r; `unchanged` (3,): the control that changes nothing now."""
    d, first, last = settings.dimension, responses.first[r], responses.first[r + 1]
    m = last - first
    knots = responses.knots[first + r : last + r + 1]
    drift = np.empty((m, 4, d))
    for p in range(m):
        for c in range(4):
            for axis in range(d):
                drift[p, c, axis] = (
                    robots.position[i, axis] + responses.velocity_gain[first + p, c] * robots.velocity[i, axis]
                )
    motion = PositionMap(knots, drift, responses.gain[first:last])
    table, hulls, body = relative_table(rows, passive, motion, settings.horizon)
    if settings.share < 1.0:
        # Half the change of the control must do where the other robot avoids too: unchanged + (u - unchanged) / share
        # is tested.
        n, rest = len(body), 1.0 / settings.share - 1.0
        cooperates = np.empty(n, np.bool_)
        for s in range(n):
            cooperates[s] = rows.cooperates[body[s]]
        for c in range(4):
            for axis in range(d):
                by = unchanged[axis]
                for s in range(n):
                    table.points[c, axis, s] += table.gains[c, s] * by * rest if cooperates[s] else 0.0
            for s in range(n):
                table.gains[c, s] = table.gains[c, s] / settings.share if cooperates[s] else table.gains[c, s]
    limits = admissible_set(i, r, robots, responses, settings)
    near, near_hulls = segments_in_reach(limits, table, hulls)
    return RelativeMotion(limits, near, near_hulls)


@kernel
def obstacle_pieces(
    i: int, near: Indices, robots: RobotTable, passive: PassiveObstacles, settings: DecisionSettings
) -> tuple[ObstaclePieces, bool]:
    """The pieces of passive bodies and of the robots `near` (m,) that robot i may meet; whether it overlaps one now."""
    d, now, q, count = settings.dimension, settings.now, robots.observed_points.shape[1], len(near)
    fixed, bodies = len(passive.pieces.body), len(passive.body_radius)
    # One row more for each robot: one piece is cut where the margin is whole again.
    n, turning = fixed + count * (q + 1), len(passive.pieces.turns) > 0
    turns = np.zeros((n if turning else 0, 4, 2))
    pieces = Pieces(np.empty((n, 2)), np.empty((n, 4, d)), np.empty(n), np.zeros(n), turns, np.empty(n, np.int64))
    margin = np.zeros((n, 2))
    hull, hull_radius = np.full(bodies + count, -1), np.zeros(bodies + count)
    cooperates = np.zeros(bodies + count, np.bool_)
    overlapping = False
    if fixed:
        overlapping = add_passive(i, robots, passive, settings, pieces, margin)
        copy_into(hull, passive.hull)
        copy_into(hull_radius, passive.hull_radius)
    s = fixed
    position, velocity = np.empty(d), np.empty(d)
    observed = Paths(robots.observed_times, robots.observed_points)
    for j in range(count):
        k = near[j]
        state_on_path(observed, k, now, position, velocity)
        square = 0.0
        for axis in range(d):
            square += (position[axis] - robots.position[i, axis]) ** 2
        touch = robots.radius[i] + robots.radius[k]
        clearance = np.sqrt(square) - touch
        overlapping = overlapping or overlaps(clearance)
        extra = kept_margin(clearance, settings.margin)
        # No robot relies on the other where both are close: there it is too late for mistakes.
        cooperates[bodies + j] = clearance > COOPERATION_RANGE * touch
        end, cut = s, settings.regain if extra < settings.margin else np.inf
        for p in range(q):
            first, last = robots.observed_times[k, p], robots.observed_times[k, p + 1]
            if last <= now or last <= first or first >= now + settings.horizon:
                continue
            end = add_piece(first - now, last - now, robots.observed_points[k, p], cut, end, pieces)
        for row in range(s, end):
            pieces.radius[row], pieces.body[row], margin[row, 0] = touch + extra, bodies + j, max(extra, 0.0)
            if turning:
                for c in range(4):
                    turns[row, c, 0] = 1.0
        if cut < np.inf:
            grow_margin(settings.margin - max(extra, 0.0), cut, s, end, pieces, margin)
        s = end
    used = Pieces(pieces.times[:s], pieces.points[:s], pieces.radius[:s], pieces.growth[:s], turns[:s], pieces.body[:s])
    return ObstaclePieces(used, margin[:s], hull, hull_radius, cooperates), overlapping


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
def add_passive(
    i: int, robots: RobotTable, passive: PassiveObstacles, settings: DecisionSettings, pieces: Pieces, margin: Array
) -> bool:
    """Write the passive bodies, grown by robot i and by the margin it can keep, into the first rows.

    Returns whether the robot overlaps one. `margin` (n, 2) [m]: see `ObstaclePieces`.
    """
    fixed = passive.pieces
    copy_into(pieces.times, fixed.times)
    copy_into(pieces.points, fixed.points)
    copy_into(pieces.growth, fixed.growth)
    copy_into(pieces.body, fixed.body)
    if len(fixed.turns) > 0:
        copy_into(pieces.turns, fixed.turns)
    radius = passive.body_radius + (robots.radius[i] - passive.robot_radius)
    overlapping = add_margin(i, robots, passive, settings, radius)
    for s in range(len(fixed.body)):
        b = fixed.body[s]
        pieces.radius[s] = fixed.radius[s] + radius[b]
        margin[s, 0] = max(radius[b] - passive.body_radius[b] - (robots.radius[i] - passive.robot_radius), 0.0)
    return overlapping


@kernel
def add_margin(
    i: int, robots: RobotTable, passive: PassiveObstacles, settings: DecisionSettings, radius: Array
) -> bool:
    """Add the margin that robot i can keep to the radii (b,) [m] of passive bodies; whether it overlaps one."""
    fixed, heads = passive.pieces, passive.heads
    body = fixed.body[heads]
    places, directions = np.zeros((len(heads), 3)), np.zeros((len(heads), 2))
    directions[:, 0] = 1.0
    for h in range(len(heads)):
        s = heads[h]
        x = share_of_piece(fixed.times, s)
        for axis in range(settings.dimension):
            p = fixed.points[s, :, axis]
            places[h, axis] = value(p[0], p[1], p[2], p[3], x) - robots.position[i, axis]
        if len(fixed.turns) > 0:
            for axis in range(2):
                p = fixed.turns[s, :, axis]
                directions[h, axis] = value(p[0], p[1], p[2], p[3], x)
    found = distances(
        places, directions, passive.hull[body], hulls_of_bodies(passive.corners, passive.hull, np.empty((4, 2, 0)))
    )
    overlapping = False
    kept = np.full(len(radius), settings.margin)
    for h in range(len(heads)):
        clearance = found[h, 0] - radius[body[h]]
        overlapping = overlapping or overlaps(clearance)
        kept[body[h]] = max(kept_margin(clearance, settings.margin), -radius[body[h]])
    radius += kept
    return overlapping
