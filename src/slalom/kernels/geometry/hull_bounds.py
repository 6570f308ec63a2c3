"""Lower bounds of the signed distance to a rounded convex hull along a segment.

The signed distance of the origin to a convex hull is the largest, over unit vectors v, of min v . corner: negative
inside, where it is minus the depth. Any v therefore bounds it from below. Between two times v is the straight
interpolation of the best vectors at both. It turns with the hull, and min v . corner is bounded by its control points.
A control that slides along a hull at a constant distance then needs few bisections, with a constant v thousands.
"""

from typing import TypeAlias

import numpy as np

from slalom.kernels.arrays import Array, Direction
from slalom.kernels.geometry.cubic import restrict
from slalom.kernels.geometry.hulls import MovingHull
from slalom.kernels.jit import kernel

Cubic: TypeAlias = tuple[float, float, float, float]
"""Control values of a cubic."""


@kernel
def distance_bound(moving: MovingHull, a: float, b: float, early: Direction, late: Direction) -> float:
    """A lower bound [m] of the signed distance to the rounded hull over [a, b], from unit vectors `early` and `late`.

    The vector v is (1 - s) early + s late. If they differ by the angle t, then cos(t / 2) <= |v| <= 1 - s (1 - s)
    (1 - cos t). Along v the path and the corners are of degree 4. No bound (-inf) beyond a right angle.
    """
    path, h = moving.path, moving.hull
    corners, first = moving.hulls.corners, moving.hulls.first
    _, ux, uy, uz = early
    _, wx, wy, wz = late
    cosine = ux * wx + uy * wy + uz * wz
    if cosine < 0.0:
        return -np.inf
    x0, x1, x2, x3 = restrict(path[0, 0], path[1, 0], path[2, 0], path[3, 0], a, b)
    y0, y1, y2, y3 = restrict(path[0, 1], path[1, 1], path[2, 1], path[3, 1], a, b)
    z0, z1, z2, z3 = restrict(path[0, 2], path[1, 2], path[2, 2], path[3, 2], a, b)
    p0, p1, p2, p3, p4 = along(
        (
            ux * x0 + uy * y0 + uz * z0,
            ux * x1 + uy * y1 + uz * z1,
            ux * x2 + uy * y2 + uz * z2,
            ux * x3 + uy * y3 + uz * z3,
        ),
        (
            wx * x0 + wy * y0 + wz * z0,
            wx * x1 + wy * y1 + wz * z1,
            wx * x2 + wy * y2 + wz * z2,
            wx * x3 + wy * y3 + wz * z3,
        ),
    )
    x0, x1, x2, x3 = restrict(path[0, 3], path[1, 3], path[2, 3], path[3, 3], a, b)
    y0, y1, y2, y3 = restrict(path[0, 4], path[1, 4], path[2, 4], path[3, 4], a, b)
    e0, e1, e2, e3, e4 = along(
        (ux * x0 + uy * y0, ux * x1 + uy * y1, ux * x2 + uy * y2, ux * x3 + uy * y3),
        (wx * x0 + wy * y0, wx * x1 + wy * y1, wx * x2 + wy * y2, wx * x3 + wy * y3),
    )
    f0, f1, f2, f3, f4 = along(
        (uy * x0 - ux * y0, uy * x1 - ux * y1, uy * x2 - ux * y2, uy * x3 - ux * y3),
        (wy * x0 - wx * y0, wy * x1 - wx * y1, wy * x2 - wx * y2, wy * x3 - wx * y3),
    )
    low0, low1, low2, low3, low4 = np.inf, np.inf, np.inf, np.inf, np.inf
    for j in range(first[h], first[h + 1]):
        begin = corners[j, 0] * ux + corners[j, 1] * uy + corners[j, 2] * uz
        change = 0.25 * (corners[j, 0] * wx + corners[j, 1] * wy + corners[j, 2] * wz - begin)
        cx, cy = corners[j, 3], corners[j, 4]
        low0 = min(low0, begin + cx * e0 + cy * f0)
        low1 = min(low1, begin + change + cx * e1 + cy * f1)
        low2 = min(low2, begin + 2.0 * change + cx * e2 + cy * f2)
        low3 = min(low3, begin + 3.0 * change + cx * e3 + cy * f3)
        low4 = min(low4, begin + 4.0 * change + cx * e4 + cy * f4)
    r0, r1, r2, r3, r4, least = radius_along(moving, a, b, cosine)
    bound = min(min(p0 + low0 - r0, p1 + low1 - r1), min(p2 + low2 - r2, p3 + low3 - r3))
    bound = min(bound, p4 + low4 - r4)
    return float(bound if bound >= 0.0 else bound / least)


@kernel
def along(early: Cubic, late: Cubic) -> tuple[float, float, float, float, float]:
    """Control values of (1 - s) `early` + s `late`, for cubics with those control values."""
    p0, p1, p2, p3 = early
    q0, q1, q2, q3 = late
    return p0, 0.25 * (3.0 * p1 + q0), 0.5 * (p2 + q1), 0.25 * (p3 + 3.0 * q2), q3


@kernel
def radius_along(
    moving: MovingHull, a: float, b: float, cosine: float
) -> tuple[float, float, float, float, float, float]:
    """Control values of degree 4 of at least the radius times |v| over [a, b], see `distance_bound`, and the least |v|.

    cosine: of the angle by which v turns.
    """
    r, q, least = moving.radius + moving.growth * a, moving.radius + moving.growth * b, np.sqrt(0.5 * (1.0 + cosine))
    bend = 0.5 * (1.0 - cosine)
    if r < 0.0 or q < 0.0:
        # Below 0 the shorter |v| is the worse.
        r, q, bend = r if r >= 0.0 else r * least, q if q >= 0.0 else q * least, 0.0
    middle, other = (2.0 * r * (1.0 - bend) + q) / 3.0, (r + 2.0 * q * (1.0 - bend)) / 3.0
    return r, 0.25 * (r + 3.0 * middle), 0.5 * (middle + other), 0.25 * (3.0 * other + q), q, least


@kernel
def put_separating(moving: MovingHull, gain: Array, u: Array, direction: Direction, separating: Array) -> None:
    """Write a `direction`, and the bounds along it at the control points under the control 0, into `separating` (7,).

    `moving` is under control u (3,), `gain` (4,) is that of its segment.
    """
    path, h = moving.path, moving.hull
    corners, first = moving.hulls.corners, moving.hulls.first
    _, vx, vy, vz = direction
    separating[0], separating[1], separating[2] = vx, vy, vz
    toward = vx * u[0] + vy * u[1] + vz * u[2]
    for j in range(4):
        low = np.inf
        e, f = vx * path[j, 3] + vy * path[j, 4], vy * path[j, 3] - vx * path[j, 4]
        for k in range(first[h], first[h + 1]):
            fixed = corners[k, 0] * vx + corners[k, 1] * vy + corners[k, 2] * vz
            low = min(low, fixed + corners[k, 3] * e + corners[k, 4] * f)
        origin = vx * path[j, 0] + vy * path[j, 1] + vz * path[j, 2] + gain[j] * toward
        separating[3 + j] = origin + low - moving.radius - moving.growth * j / 3.0


@kernel
def least_along(separating: Array, gain: Array, u: Array) -> float:
    """A lower bound [m] of the signed distance under control u (3,), from a direction alone, see `put_separating`.

    gain: (4,) of the segment.
    """
    toward = separating[0] * u[0] + separating[1] * u[1] + separating[2] * u[2]
    early = min(separating[3] - gain[0] * toward, separating[4] - gain[1] * toward)
    return float(min(early, min(separating[5] - gain[2] * toward, separating[6] - gain[3] * toward)))
