"""The relative motion of obstacles and a controlled robot as one flat table of cubic segments.

Row s of the table: over the elapsed times begin[s] to end[s], the position of obstacle owner[s] relative to the
robot under control u is the cubic with control points points[s, j] - gains[s, j] * u, j = 0..3. It collides
while nearer to the origin than radius[s]. In the plane the third coordinate is 0.
"""

import numpy as np

from slalom.kernels.bezier import restrict
from slalom.kernels.compiled import kernel


@kernel
def relative_segments(times, points, error, radius, owner, knots, drift, gain, horizon):  # type: ignore[no-untyped-def]
    """Cut the obstacles' pieces where the response has a knot, and subtract the drift.

    Args:
        times: (n, 2) elapsed begin and end of each obstacle piece; pieces of an owner in order.
        points: (n, 4, d) its control points; error, radius, owner: (n,).
        knots: (m + 1,) elapsed times of the response's pieces, from 0 to at least `horizon`.
        drift: (m, 4, d), gain: (m, 4): control points of its position map.

    Returns:
        begin, end, points (k, 4, 3), gains (k, 4), radius, owner.
    """
    n, m, d = len(times), len(drift), points.shape[2]
    room = n + (owner[-1] + 1 if n else 0) * m + 1
    begin, end = np.empty(room), np.empty(room)
    rel, gains = np.zeros((room, 4, 3)), np.empty((room, 4))
    reach, who = np.empty(room), np.empty(room, np.int64)
    k, piece = 0, 0
    for s in range(n):
        t0, t1 = max(times[s, 0], 0.0), min(times[s, 1], horizon)
        if s == 0 or owner[s] != owner[s - 1]:
            piece = 0
        while t0 < t1:
            while piece < m - 1 and knots[piece + 1] <= t0:
                piece += 1
            stop = t1 if piece == m - 1 else min(t1, knots[piece + 1])
            width, span = times[s, 1] - times[s, 0], knots[piece + 1] - knots[piece]
            a, b = (t0 - times[s, 0]) / width, (stop - times[s, 0]) / width
            e, f = (t0 - knots[piece]) / span, (stop - knots[piece]) / span
            for axis in range(d):
                p0, p1, p2, p3 = restrict(
                    points[s, 0, axis], points[s, 1, axis], points[s, 2, axis], points[s, 3, axis], a, b
                )
                q0, q1, q2, q3 = restrict(
                    drift[piece, 0, axis], drift[piece, 1, axis], drift[piece, 2, axis], drift[piece, 3, axis], e, f
                )
                rel[k, 0, axis], rel[k, 1, axis] = p0 - q0, p1 - q1
                rel[k, 2, axis], rel[k, 3, axis] = p2 - q2, p3 - q3
            gains[k, 0], gains[k, 1], gains[k, 2], gains[k, 3] = restrict(
                gain[piece, 0], gain[piece, 1], gain[piece, 2], gain[piece, 3], e, f
            )
            begin[k], end[k] = t0, stop
            reach[k], who[k] = radius[s] + error[s], owner[s]
            k += 1
            t0 = stop
    return begin[:k], end[:k], rel[:k], gains[:k], reach[:k], who[:k]


@kernel
def chord_gap(points, gains, s, ux, uy, uz):  # type: ignore[no-untyped-def]
    """A lower bound of the distance to the origin along segment s under control (ux, uy, uz).

    The distance of the chord, less how far the cubic may bend away from it: with e1, e2 the distances of the inner
    control points from the points at one and two thirds of the chord, it bends by at most 3/4 max(e1, e2),
    since 3 s (1 - s) <= 3/4.
    """
    g0, g1, g2, g3 = gains[s, 0], gains[s, 1], gains[s, 2], gains[s, 3]
    ax, ay, az = points[s, 0, 0] - g0 * ux, points[s, 0, 1] - g0 * uy, points[s, 0, 2] - g0 * uz
    bx, by, bz = points[s, 3, 0] - g3 * ux, points[s, 3, 1] - g3 * uy, points[s, 3, 2] - g3 * uz
    dx, dy, dz = bx - ax, by - ay, bz - az
    square = dx * dx + dy * dy + dz * dz
    along = min(1.0, max(0.0, -(ax * dx + ay * dy + az * dz) / (square + 1e-300)))
    cx, cy, cz = ax + along * dx, ay + along * dy, az + along * dz
    ex = points[s, 1, 0] - g1 * ux - (2.0 * ax + bx) / 3.0
    ey = points[s, 1, 1] - g1 * uy - (2.0 * ay + by) / 3.0
    ez = points[s, 1, 2] - g1 * uz - (2.0 * az + bz) / 3.0
    fx = points[s, 2, 0] - g2 * ux - (ax + 2.0 * bx) / 3.0
    fy = points[s, 2, 1] - g2 * uy - (ay + 2.0 * by) / 3.0
    fz = points[s, 2, 2] - g2 * uz - (az + 2.0 * bz) / 3.0
    bend = max(ex * ex + ey * ey + ez * ez, fx * fx + fy * fy + fz * fz)
    return np.sqrt(cx * cx + cy * cy + cz * cz) - 0.75 * np.sqrt(bend)
