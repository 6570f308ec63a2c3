"""The relative motion of obstacles and a controlled robot as one flat table of cubic segments.

What its rows mean is written in `slalom.relative_motion`. They lie along the last axis, so that one pass over all of
them runs on vector registers.
"""

import numpy as np

from slalom.kernels.arrays import Array, Indices, MaybeHulls
from slalom.kernels.geometry.cubic import restrict
from slalom.kernels.jit import kernel

ROBOT_MOTIONS = 8
"""Bodies are often cut at the same times; of so many of the parts of one, what the robot does itself is kept for the
next body. More: lists that are hardly ever so long are looked after."""


@kernel
def relative_segments(
    times: Array,
    points: Array,
    radius: Array,
    growth: Array,
    turns: Array,
    body: Indices,
    knots: Array,
    drift: Array,
    gain: Array,
    horizon: float,
) -> tuple[Array, Array, Array, Array, Array, Array, Array, Indices]:
    """Cut the bodies' pieces where the response has a knot, and subtract the drift.

    Args:
        times: (n, 2) elapsed begin and end of each piece of a body; pieces of a body in order.
        points: (n, 4, d) its control points; radius, growth: (n,) as at its begin, and the change to its end.
        turns: (n, 4, 2) control points of its direction, or (0, 4, 2) if nothing turns. body: (n,).
        knots: (m + 1,) elapsed times of the response's pieces, from 0 to at least `horizon`.
        drift: (m, 4, d), gain: (m, 4): control points of its position map.

    Returns:
        begin, end, points (4, 3, k), gains (4, k), radius, growth, turns (4, 2, k), body.
    """
    n, m, d = len(times), len(drift), points.shape[2]
    turning = len(turns) > 0
    room = segment_count(times, body, knots, m, horizon)
    lines = np.empty((4, room))
    begin, end, around, widening = lines[0], lines[1], lines[2], lines[3]
    rel, gains, turned = np.empty((4, 3, room)), np.empty((4, room)), np.empty((4, 2, room if turning else 0))
    who = np.empty(room, np.int64)
    for c in range(4):
        for axis in range(d, 3):
            for i in range(room):
                rel[c, axis, i] = 0.0
    k, piece, part = 0, 0, 0
    own = np.empty((ROBOT_MOTIONS, 2 + 4 * (d + 1)))
    own[:, 0] = np.nan
    for s in range(n):
        t0, t1 = max(times[s, 0], 0.0), min(times[s, 1], horizon)
        if s == 0 or body[s] != body[s - 1]:
            piece, part = 0, 0
        while t0 < t1:
            while piece < m - 1 and knots[piece + 1] <= t0:
                piece += 1
            stop = t1 if piece == m - 1 else min(t1, knots[piece + 1])
            width = times[s, 1] - times[s, 0]
            a, b = (t0 - times[s, 0]) / width, (stop - times[s, 0]) / width
            cut = a > 0.0 or b < 1.0
            if own[part, 0] != t0 or own[part, 1] != stop:
                robot_motion(knots, drift, gain, piece, t0, stop, own[part])
            for axis in range(d):
                p0, p1, p2, p3 = points[s, 0, axis], points[s, 1, axis], points[s, 2, axis], points[s, 3, axis]
                if cut:
                    p0, p1, p2, p3 = restrict(p0, p1, p2, p3, a, b)
                q = 6 + 4 * axis
                rel[0, axis, k], rel[1, axis, k] = p0 - own[part, q], p1 - own[part, q + 1]
                rel[2, axis, k], rel[3, axis, k] = p2 - own[part, q + 2], p3 - own[part, q + 3]
            gains[0, k], gains[1, k], gains[2, k], gains[3, k] = own[part, 2], own[part, 3], own[part, 4], own[part, 5]
            part = min(part + 1, ROBOT_MOTIONS - 1)
            if turning:
                for axis in range(2):
                    turned[0, axis, k], turned[1, axis, k], turned[2, axis, k], turned[3, axis, k] = restrict(
                        turns[s, 0, axis], turns[s, 1, axis], turns[s, 2, axis], turns[s, 3, axis], a, b
                    )
            begin[k], end[k], who[k] = t0, stop, body[s]
            around[k], widening[k] = radius[s] + growth[s] * a, growth[s] * (b - a)
            k += 1
            t0 = stop
    return begin, end, rel, gains, around, widening, turned, who


@kernel
def robot_motion(knots: Array, drift: Array, gain: Array, piece: int, t0: float, stop: float, own: Array) -> None:
    """What the robot itself does from t0 to stop, on one piece: these times, the gain and the drift, into `own`."""
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
def segment_count(times: Array, body: Indices, knots: Array, m: int, horizon: float) -> int:
    """How many segments these pieces are cut into: memory that is never filled would cost more than this count."""
    count, piece = 0, 0
    for s in range(len(times)):
        t0, t1 = max(times[s, 0], 0.0), min(times[s, 1], horizon)
        if s == 0 or body[s] != body[s - 1]:
            piece = 0
        while t0 < t1:
            while piece < m - 1 and knots[piece + 1] <= t0:
                piece += 1
            t0 = t1 if piece == m - 1 else min(t1, knots[piece + 1])
            count += 1
    return count


@kernel
def chord_distances(points: Array, gains: Array, ux: float, uy: float, uz: float, gaps: Array) -> None:
    """Lower bounds of the distance to the origin along every segment under control (ux, uy, uz), into gaps.

    The distance of the chord, less how far the cubic may bend away from it: with e, f the distances of the inner
    control points from the points at one and two thirds of the chord, it bends by at most 3/4 max(|e|, |f|),
    since 3 s (1 - s) <= 3/4. Written without calls and branches: this loop must run on vector registers.
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


@kernel
def hulls_of(hulls: MaybeHulls, rows: Indices, turned: Array) -> MaybeHulls:
    """The hulls of some rows, whose directions are `turned` if any of them turns."""
    if len(hulls) == 0:
        return ()
    n = len(rows)
    hull = np.empty(n, np.int64)
    for i in range(n):
        hull[i] = hulls[0][rows[i]]
    if turned.shape[2] == 0:
        turned = np.zeros((4, 2, n))
        for c in range(4):
            for i in range(n):
                turned[c, 0, i] = 1.0
    return hull, turned, hulls[2], hulls[3], hulls[4]
