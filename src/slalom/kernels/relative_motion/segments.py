"""The relative motion of obstacles and a controlled robot as one flat table of cubic segments.

The meaning of the rows is stated in `slalom.relative_motion`.
"""

import numpy as np

from slalom.kernels.arrays import Array, CutPieces, Flags, Hulls, Indices, MaybeHulls, Pieces, PositionMap
from slalom.kernels.geometry.cubic import restrict, value
from slalom.kernels.jit import kernel, vectorized
from slalom.tolerances import KEPT_ROBOT_MOTIONS


@kernel
def relative_segments(pieces: Pieces, motion: PositionMap, horizon: float) -> CutPieces:
    """Bodies relative to a robot from time 0 to `horizon` [s]: pieces cut at its knots, the drift subtracted.

    Pieces that begin before 0 or end after the horizon are restricted to the window. A body at rest is met by the same
    controls however fast the robot moves along a line. From piece `motion.straight` on it has one segment in place of
    one for each piece; that segment is passed at a constant rate.
    """
    times, points, body, knots = pieces.times, pieces.points, pieces.body, motion.knots
    n, m, d = len(times), len(motion.drift), points.shape[2]
    turning = len(pieces.turns) > 0
    still = rows_at_rest(pieces) if motion.straight < m - 1 else np.zeros(n, np.bool_)
    count = segment_count(times, body, still, motion, horizon)
    lines = np.empty((4, count))
    begin, end, radius, growth = lines[0], lines[1], lines[2], lines[3]
    relative, gains, turned = np.empty((4, 3, count)), np.empty((4, count)), np.empty((4, 2, count if turning else 0))
    bodies = np.empty(count, np.int64)
    for c in range(4):
        for axis in range(d, 3):
            for i in range(count):
                relative[c, axis, i] = 0.0
    k, piece, part = 0, 0, 0
    own = np.empty((KEPT_ROBOT_MOTIONS, 2 + 4 * (d + 1)))
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
                robot_motion(motion, piece, t0, stop, own[part])
            for axis in range(d):
                p0, p1, p2, p3 = points[s, 0, axis], points[s, 1, axis], points[s, 2, axis], points[s, 3, axis]
                if cut:
                    p0, p1, p2, p3 = restrict(p0, p1, p2, p3, a, b)
                q = 6 + 4 * axis
                relative[0, axis, k], relative[1, axis, k] = p0 - own[part, q], p1 - own[part, q + 1]
                relative[2, axis, k], relative[3, axis, k] = p2 - own[part, q + 2], p3 - own[part, q + 3]
            gains[0, k], gains[1, k], gains[2, k], gains[3, k] = own[part, 2], own[part, 3], own[part, 4], own[part, 5]
            part = min(part + 1, KEPT_ROBOT_MOTIONS - 1)
            if turning:
                turns = pieces.turns
                for axis in range(2):
                    turned[0, axis, k], turned[1, axis, k], turned[2, axis, k], turned[3, axis, k] = restrict(
                        turns[s, 0, axis], turns[s, 1, axis], turns[s, 2, axis], turns[s, 3, axis], a, b
                    )
            begin[k], end[k], bodies[k] = t0, stop, body[s]
            radius[k], growth[k] = pieces.radius[s] + pieces.growth[s] * a, pieces.growth[s] * (b - a)
            k += 1
            t0 = stop
    return CutPieces(begin, end, relative, gains, radius, growth, turned, bodies)


@kernel
def robot_motion(motion: PositionMap, piece: int, t0: float, stop: float, own: Array) -> None:
    """The position map from t0 in a piece to stop [s], into `own` (2 + 4 (d + 1),).

    The times, four control points of the gain, and four of each axis of the drift. Where the time `stop` is in a later
    piece, they are those of the line between both positions.
    """
    knots, drift, gain, last = motion.knots, motion.drift, motion.gain, piece
    while last < len(drift) - 1 and knots[last + 1] < stop:
        last += 1
    if last > piece:
        line_of_motion(motion, piece, last, t0, stop, own)
        return
    span = knots[piece + 1] - knots[piece]
    e, f = (t0 - knots[piece]) / span, (stop - knots[piece]) / span
    own[0], own[1] = t0, stop
    own[2], own[3], own[4], own[5] = restrict(gain[piece, 0], gain[piece, 1], gain[piece, 2], gain[piece, 3], e, f)
    for axis in range(drift.shape[2]):
        q = 6 + 4 * axis
        own[q], own[q + 1], own[q + 2], own[q + 3] = restrict(
            drift[piece, 0, axis], drift[piece, 1, axis], drift[piece, 2, axis], drift[piece, 3, axis], e, f
        )


@kernel
def line_of_motion(motion: PositionMap, piece: int, last: int, t0: float, stop: float, own: Array) -> None:
    """The line between the positions at t0 in `piece` and stop [s] in `last`, into `own` as in `robot_motion`."""
    knots, drift, gain = motion.knots, motion.drift, motion.gain
    e = (t0 - knots[piece]) / (knots[piece + 1] - knots[piece])
    f = (stop - knots[last]) / (knots[last + 1] - knots[last])
    own[0], own[1] = t0, stop
    own[2] = value(gain[piece, 0], gain[piece, 1], gain[piece, 2], gain[piece, 3], e)
    own[5] = value(gain[last, 0], gain[last, 1], gain[last, 2], gain[last, 3], f)
    for axis in range(drift.shape[2]):
        p, q = drift[piece, :, axis], drift[last, :, axis]
        own[6 + 4 * axis] = value(p[0], p[1], p[2], p[3], e)
        own[9 + 4 * axis] = value(q[0], q[1], q[2], q[3], f)
    for k in range(1 + drift.shape[2]):
        first, end = own[2 + 4 * k], own[5 + 4 * k]
        own[3 + 4 * k], own[4 + 4 * k] = (2.0 * first + end) / 3.0, (first + 2.0 * end) / 3.0


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
    knots, m, count, piece = motion.knots, len(motion.drift), 0, 0
    for s in range(len(times)):
        t0, t1 = max(times[s, 0], 0.0), min(times[s, 1], horizon)
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
    x0, y0, z0 = points[0, 0], points[0, 1], points[0, 2]
    x1, y1, z1 = points[1, 0], points[1, 1], points[1, 2]
    x2, y2, z2 = points[2, 0], points[2, 1], points[2, 2]
    x3, y3, z3 = points[3, 0], points[3, 1], points[3, 2]
    gain0, gain1, gain2, gain3 = gains[0], gains[1], gains[2], gains[3]
    third = 1.0 / 3.0
    for s in range(len(gaps)):
        g0, g1, g2, g3 = gain0[s], gain1[s], gain2[s], gain3[s]
        ax, ay, az = x0[s] - g0 * ux, y0[s] - g0 * uy, z0[s] - g0 * uz
        bx, by, bz = x3[s] - g3 * ux, y3[s] - g3 * uy, z3[s] - g3 * uz
        dx, dy, dz = bx - ax, by - ay, bz - az
        along = -(ax * dx + ay * dy + az * dz) / (dx * dx + dy * dy + dz * dz + 1e-300)
        along = along if along > 0.0 else 0.0
        along = along if along < 1.0 else 1.0
        cx, cy, cz = ax + along * dx, ay + along * dy, az + along * dz
        ex = x1[s] - g1 * ux - (2.0 * ax + bx) * third
        ey = y1[s] - g1 * uy - (2.0 * ay + by) * third
        ez = z1[s] - g1 * uz - (2.0 * az + bz) * third
        fx = x2[s] - g2 * ux - (ax + 2.0 * bx) * third
        fy = y2[s] - g2 * uy - (ay + 2.0 * by) * third
        fz = z2[s] - g2 * uz - (az + 2.0 * bz) * third
        e, f = ex * ex + ey * ey + ez * ez, fx * fx + fy * fy + fz * fz
        bend = e if e > f else f
        gaps[s] = np.sqrt(cx * cx + cy * cy + cz * cz) - 0.75 * np.sqrt(bend)
