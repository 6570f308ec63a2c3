"""The relative motion of obstacles and a controlled robot as one flat table of cubic segments.

The meaning of the rows is stated in `slalom.choice.envelope`.
"""

from typing import Final, NamedTuple

import numpy as np

from slalom.kernels.arrays import (
    Array,
    CutPieces,
    Flags,
    Hulls,
    Indices,
    MaybeHulls,
    Pieces,
    PositionMap,
    Segments,
    Workspace,
)
from slalom.kernels.geometry.cubic import image, largest_modulus, restrict, value
from slalom.kernels.geometry.hulls import MovingHull, hull_distance, least_along, load_path, put_separating
from slalom.kernels.jit import inlined, kernel, squared, vectorized

KEPT_ROBOT_MOTIONS: Final = 8
"""[1] Parts of a robot's own motion that are kept from one body to the next, since bodies are often cut at equal times.
Larger: longer lists are searched, most of them without a match. Smaller: the same parts are computed again."""


@kernel
def relative_segments(pieces: Pieces, motion: PositionMap, horizon: float) -> CutPieces:
    """Bodies relative to a robot from time 0 to `horizon` [s]: pieces cut at its knots, the drift subtracted.

    Pieces that begin before 0 or end after the horizon are restricted to the window. A body at rest is met by the same
    controls however fast the robot moves along a line. From piece `motion.straight` on it has one segment in place of
    one for each piece; that segment is passed at a constant rate.
    """
    times, points = pieces.times, pieces.points
    body, knots = pieces.body, motion.knots
    n, m = len(times), len(motion.drift)
    d = points.shape[2]
    turning = len(pieces.turns) > 0
    still = rows_at_rest(pieces) if motion.straight < m - 1 else np.zeros(n, np.bool_)
    count = segment_count(times, body, still, motion, horizon)
    lines = np.empty((4, count))
    begin, end = lines[0], lines[1]
    radius, growth = lines[2], lines[3]
    relative, gains = np.empty((4, 3, count)), np.empty((4, count))
    crossed = len(motion.cross) > 0
    cross = np.empty((4, count if crossed else 0))
    turned = np.empty((4, 2, count if turning else 0))
    bodies = np.empty(count, np.int64)
    for c in range(4):
        for axis in range(d, 3):
            for i in range(count):
                relative[c, axis, i] = 0.0
    k, piece = 0, 0
    part = 0
    own = np.empty((KEPT_ROBOT_MOTIONS, 2 + 4 * (d + 2)))
    own[:, 0] = np.nan
    for s in range(n):
        t0, t1 = max(times[s, 0], 0.0), min(times[s, 1], horizon)
        if s == 0 or body[s] != body[s - 1]:
            piece, part = 0, 0
        while t0 < t1:
            while piece < m - 1 and knots[piece + 1] <= t0:
                piece += 1
            stop = t1 if piece == m - 1 or (still[s] and piece >= motion.straight) else min(t1, knots[piece + 1])
            width = times[s, 1] - times[s, 0]
            a, b = (t0 - times[s, 0]) / width, (stop - times[s, 0]) / width
            cut = a > 0.0 or b < 1.0
            if own[part, 0] != t0 or own[part, 1] != stop:
                robot_motion(motion, piece, t0, stop, own, part)
            for axis in range(d):
                p0, p1 = points[s, 0, axis], points[s, 1, axis]
                p2, p3 = points[s, 2, axis], points[s, 3, axis]
                if cut:
                    p0, p1, p2, p3 = restrict(p0, p1, p2, p3, a, b)
                q = 6 + 4 * axis
                relative[0, axis, k], relative[1, axis, k] = p0 - own[part, q], p1 - own[part, q + 1]
                relative[2, axis, k], relative[3, axis, k] = p2 - own[part, q + 2], p3 - own[part, q + 3]
            gains[0, k], gains[1, k] = own[part, 2], own[part, 3]
            gains[2, k], gains[3, k] = own[part, 4], own[part, 5]
            if crossed:
                for c in range(4):
                    cross[c, k] = own[part, 6 + 4 * d + c]
            part = min(part + 1, KEPT_ROBOT_MOTIONS - 1)
            if turning:
                turns = pieces.turns
                for axis in range(2):
                    turned[0, axis, k], turned[1, axis, k], turned[2, axis, k], turned[3, axis, k] = restrict(
                        turns[s, 0, axis], turns[s, 1, axis], turns[s, 2, axis], turns[s, 3, axis], a, b
                    )
            begin[k], end[k] = t0, stop
            bodies[k] = body[s]
            radius[k], growth[k] = pieces.radius[s] + pieces.growth[s] * a, pieces.growth[s] * (b - a)
            k += 1
            t0 = stop
    return CutPieces(begin, end, relative, gains, cross, radius, growth, turned, bodies)


@kernel
def robot_motion(motion: PositionMap, piece: int, t0: float, stop: float, own: Array, part: int) -> None:
    """The position map from t0 in a piece to stop [s], into row `part` of `own` (k, 2 + 4 (d + 2)).

    The times, four control points of the gain, four of each axis of the drift, and four of a cross gain. Where the time
    `stop` is in a later piece, they are those of the line between both positions, which no response with a cross gain
    has.
    """
    knots = motion.knots
    drift = motion.drift
    gain = motion.gain
    last = piece
    while last < len(drift) - 1 and knots[last + 1] < stop:
        last += 1
    if last > piece:
        line_of_motion(motion, piece, last, t0, stop, own, part)
        return
    span = knots[piece + 1] - knots[piece]
    e = (t0 - knots[piece]) / span
    f = (stop - knots[piece]) / span
    own[part, 0] = t0
    own[part, 1] = stop
    own[part, 2], own[part, 3], own[part, 4], own[part, 5] = restrict(
        gain[piece, 0], gain[piece, 1], gain[piece, 2], gain[piece, 3], e, f
    )
    for axis in range(drift.shape[2]):
        q = 6 + 4 * axis
        own[part, q], own[part, q + 1], own[part, q + 2], own[part, q + 3] = restrict(
            drift[piece, 0, axis], drift[piece, 1, axis], drift[piece, 2, axis], drift[piece, 3, axis], e, f
        )
    if len(motion.cross) > 0:
        q = 6 + 4 * drift.shape[2]
        k = motion.cross[piece]
        own[part, q], own[part, q + 1], own[part, q + 2], own[part, q + 3] = restrict(k[0], k[1], k[2], k[3], e, f)


@kernel
def line_of_motion(motion: PositionMap, piece: int, last: int, t0: float, stop: float, own: Array, part: int) -> None:
    """The line between the positions at t0 in `piece` and stop [s] in `last`, into `own` as in `robot_motion`."""
    knots = motion.knots
    drift = motion.drift
    gain = motion.gain
    e = (t0 - knots[piece]) / (knots[piece + 1] - knots[piece])
    f = (stop - knots[last]) / (knots[last + 1] - knots[last])
    own[part, 0] = t0
    own[part, 1] = stop
    own[part, 2] = value(gain[piece, 0], gain[piece, 1], gain[piece, 2], gain[piece, 3], e)
    own[part, 5] = value(gain[last, 0], gain[last, 1], gain[last, 2], gain[last, 3], f)
    for axis in range(drift.shape[2]):
        p = drift[piece, :, axis]
        q = drift[last, :, axis]
        own[part, 6 + 4 * axis] = value(p[0], p[1], p[2], p[3], e)
        own[part, 9 + 4 * axis] = value(q[0], q[1], q[2], q[3], f)
    for k in range(1 + drift.shape[2]):
        first = own[part, 2 + 4 * k]
        end = own[part, 5 + 4 * k]
        own[part, 3 + 4 * k] = (2.0 * first + end) / 3.0
        own[part, 4 + 4 * k] = (first + 2.0 * end) / 3.0


@kernel
def rows_at_rest(pieces: Pieces) -> Flags:
    """Flags (n,): on which pieces the body neither moves nor turns nor grows."""
    still = np.empty(len(pieces.growth), np.bool_)
    for s in range(len(still)):
        still[s] = pieces.growth[s] == 0.0
        for c in range(1, 4):
            for axis in range(pieces.points.shape[2]):
                still[s] = still[s] and pieces.points[s, c, axis] == pieces.points[s, 0, axis]
            for axis in range(2 if len(pieces.turns) > 0 else 0):
                still[s] = still[s] and pieces.turns[s, c, axis] == pieces.turns[s, 0, axis]
    return still


@kernel
def segment_count(times: Array, body: Indices, still: Flags, motion: PositionMap, horizon: float) -> int:
    """Number of segments of pieces with `times` (n, 2) [s] of bodies (n,), `still` (n,) on some: `relative_segments`.

    To fill less memory than was allocated costs more than this count.
    """
    knots = motion.knots
    m = len(motion.drift)
    count = 0
    piece = 0
    for s in range(len(times)):
        t0 = max(times[s, 0], 0.0)
        t1 = min(times[s, 1], horizon)
        if s == 0 or body[s] != body[s - 1]:
            piece = 0
        while t0 < t1:
            while piece < m - 1 and knots[piece + 1] <= t0:
                piece += 1
            t0 = t1 if piece == m - 1 or (still[s] and piece >= motion.straight) else min(t1, knots[piece + 1])
            count += 1
    return count


@kernel
def bounding_radii(cut: CutPieces, hull_radius: Array) -> Array:
    """Radius (n,) [m] of the ball about each segment's origin that holds its rounded body, `hull_radius` (b,) [m]."""
    radii = np.empty(len(cut.body))
    for s in range(len(cut.body)):
        radii[s] = cut.radius[s] + max(cut.growth[s], 0.0) + hull_radius[cut.body[s]]
    return radii


@kernel
def hulls_of_rows(hulls: MaybeHulls, hull: Indices, turns: Array) -> MaybeHulls:
    """The hulls of other rows, with numbers `hull` (n,) and directions `turns` (4, 2, n), (4, 2, 0) if none turns."""
    if len(hulls) == 0:
        return ()
    n = len(hull)
    if turns.shape[2] == 0:
        turns = np.zeros((4, 2, n))
        for c in range(4):
            for i in range(n):
                turns[c, 0, i] = 1.0
    return Hulls(hull, turns, hulls.corners, hulls.first, hulls.unordered)


@kernel
def hulls_at(hulls: MaybeHulls, rows: Indices, turns: Array) -> MaybeHulls:
    """The hulls of the rows (n,) of a table, with directions `turns` as in `hulls_of_rows`."""
    if len(hulls) == 0:
        return ()
    hull = np.empty(len(rows), np.int64)
    for i in range(len(rows)):
        hull[i] = hulls.hull[rows[i]]
    return hulls_of_rows(hulls, hull, turns)


@vectorized
def chord_distances(points: Array, gains: Array, ux: float, uy: float, uz: float, gaps: Array) -> None:
    """Lower bounds [m] of the distance to the origin along every segment under control (ux, uy, uz), into gaps (n,).

    The distance of the chord, less the distance by which the cubic may leave it. Let e, f be the distances of the inner
    control points from the points at one and two thirds of the chord. The bend is at most 3/4 max(|e|, |f|), since 3 s
    (1 - s) <= 3/4. The loop has no calls and no branches, so that it runs on vector registers.

    Args:
        points: (4, 3, n) [m], gains: (4, n): of `Segments`.
    """
    x0 = points[0, 0]
    y0 = points[0, 1]
    z0 = points[0, 2]
    x1 = points[1, 0]
    y1 = points[1, 1]
    z1 = points[1, 2]
    x2 = points[2, 0]
    y2 = points[2, 1]
    z2 = points[2, 2]
    x3 = points[3, 0]
    y3 = points[3, 1]
    z3 = points[3, 2]
    gain0 = gains[0]
    gain1 = gains[1]
    gain2 = gains[2]
    gain3 = gains[3]
    third = 1.0 / 3.0
    for s in range(len(gaps)):
        g0 = gain0[s]
        g1 = gain1[s]
        g2 = gain2[s]
        g3 = gain3[s]
        ax = x0[s] - g0 * ux
        ay = y0[s] - g0 * uy
        az = z0[s] - g0 * uz
        bx = x3[s] - g3 * ux
        by = y3[s] - g3 * uy
        bz = z3[s] - g3 * uz
        dx = bx - ax
        dy = by - ay
        dz = bz - az
        along = -(ax * dx + ay * dy + az * dz) / (dx * dx + dy * dy + dz * dz + 1e-300)
        along = along if along > 0.0 else 0.0
        along = along if along < 1.0 else 1.0
        cx = ax + along * dx
        cy = ay + along * dy
        cz = az + along * dz
        ex = x1[s] - g1 * ux - (2.0 * ax + bx) * third
        ey = y1[s] - g1 * uy - (2.0 * ay + by) * third
        ez = z1[s] - g1 * uz - (2.0 * az + bz) * third
        fx = x2[s] - g2 * ux - (ax + 2.0 * bx) * third
        fy = y2[s] - g2 * uy - (ay + 2.0 * by) * third
        fz = z2[s] - g2 * uz - (az + 2.0 * bz) * third
        e = ex * ex + ey * ey + ez * ez
        f = fx * fx + fy * fy + fz * fz
        bend = e if e > f else f
        gaps[s] = np.sqrt(cx * cx + cy * cy + cz * cz) - 0.75 * np.sqrt(bend)


@kernel
def put_chord_distances(table: Segments, u: Array, gaps: Array) -> None:
    """Lower bounds [m] of the distance to the origin along every segment under control u (3,), into gaps (n,)."""
    if table.cross.shape[1] == 0:
        chord_distances(table.points, table.gains, u[0], u[1], u[2], gaps)
        return
    # The images of a control that is turned are taken off the points, and then no control is left.
    points = table.points.copy()
    for j in range(4):
        for axis in range(2):
            for s in range(len(gaps)):
                points[j, axis, s] -= image(table.gains, table.cross, j, s, u, axis)
    chord_distances(points, table.gains, 0.0, 0.0, 0.0, gaps)


# Broad phase of a choice: the segments on which a control within some distance of a given one can collide.
#
# During a segment, a change of the control by r moves the robot by at most r times the largest gain of that segment.
# One pass of the chord test at one control therefore bounds, for every segment, the distance of the controls that may
# collide on it. Most segments never matter; the rows of the others are copied, and later passes run over these.


class Culled(NamedTuple):
    """The rows of a table that may matter, and the distance from `center` of the controls that may collide on each."""

    table: Segments
    rows: Indices  # (c,)
    away: Array  # (c,) at least, in units of the control; inf for rows that were copied
    center: Array  # (3,) a control


@inlined
def is_clear(table: Segments, u: Array, gaps: Array) -> bool:
    """Whether the chord test alone shows that control u (3,) is collision-free; its distances go into gaps (n,) [m]."""
    put_chord_distances(table, u, gaps)
    near = 0
    for s in range(len(gaps)):
        near += gaps[s] < table.bounding_radius[s]
    return near == 0


@inlined
def cull(table: Segments, gaps: Array, farthest: float, rows: Indices) -> int:
    """The number of segments on which controls within `farthest` may collide; their rows go into `rows` (n,).

    `gaps` (n,) holds the distances of the chord test. Its first entries become the distances of those controls.
    """
    count = 0
    for s in range(len(gaps)):
        gain = largest_modulus(table.gains, table.cross, s)
        gap = gaps[s] - table.bounding_radius[s]
        rows[count] = s
        gaps[count] = gap / gain
        count += gap < farthest * gain
    return count


@kernel
def new_table(count: int, like: Segments) -> Segments:
    """An empty table for `count` segments, with cross gains where those of `like` have them."""
    points = np.empty((4, 3, count))
    gains = np.empty((4, count))
    cross = np.empty((4, count if like.cross.shape[1] > 0 else 0))
    lines = np.empty((3, count))
    return Segments(points, gains, cross, lines[0], lines[1], lines[2])


@kernel
def new_hulls(count: int, hulls: MaybeHulls) -> MaybeHulls:
    """Empty rows for `count` segments with the corners of `hulls`; empty where there are none."""
    if len(hulls) == 0:
        return ()
    turns = np.empty((4, 2, count if hulls.turns.shape[2] > 0 else 0))
    return Hulls(np.empty(count, np.int64), turns, hulls.corners, hulls.first, hulls.unordered)


@inlined
def copy_near(
    culled: Culled, hulls: MaybeHulls, limit: float, near: Segments, near_hulls: MaybeHulls, count: int, work: Workspace
) -> int:
    """Copy the segments on which controls within `limit` of the centre may collide, unless they were copied before.

    They go into `near` and `near_hulls` from row `count` on, and directions that separate their hulls from the
    centre into `work.separating`. Returns the number of rows there.
    """
    table = culled.table
    away = culled.away
    for c in range(len(culled.rows)):
        if not away[c] < limit:
            continue
        s = culled.rows[c]
        if len(hulls) > 0 and hulls.hull[s] >= 0:
            # A long wall may be out of reach although the disc about it is not.
            load_path(table, hulls, s, culled.center, work.path)
            hull = MovingHull(work.path, hulls, hulls.hull[s], table.radius[s], table.growth[s])
            gains, cross = table.gains[:, s], table.cross[:, s : s + 1]
            separating = work.separating[count]
            put_separating(hull, gains, cross, culled.center, hull_distance(hull, 0.5, work.corners), separating)
            gain = largest_modulus(table.gains, table.cross, s)
            away[c] = max(away[c], least_along(separating, gains, cross, culled.center) / gain)
            if not away[c] < limit:
                continue
        copy_row(table, hulls, s, near, near_hulls, count)
        away[c] = np.inf
        count += 1
    return count


@kernel
def copy_row(table: Segments, hulls: MaybeHulls, s: int, near: Segments, near_hulls: MaybeHulls, count: int) -> None:
    """Copy row s of a table into row `count` of another."""
    for j in range(4):
        near.gains[j, count] = table.gains[j, s]
        if table.cross.shape[1] > 0:
            near.cross[j, count] = table.cross[j, s]
        for axis in range(3):
            near.points[j, axis, count] = table.points[j, axis, s]
    near.radius[count] = table.radius[s]
    near.growth[count] = table.growth[s]
    near.bounding_radius[count] = table.bounding_radius[s]
    if len(hulls) > 0 and len(near_hulls) > 0:
        near_hulls.hull[count] = hulls.hull[s]
        for j in range(4):
            for axis in range(2 if hulls.turns.shape[2] > 0 else 0):
                near_hulls.turns[j, axis, count] = hulls.turns[j, axis, s]


@kernel
def distance(a: Array, b: Array) -> float:
    """The distance between two points (3,)."""
    return float(np.sqrt(squared(a[0] - b[0]) + squared(a[1] - b[1]) + squared(a[2] - b[2])))
