"""Rounded convex hulls along a segment: distance, certified bounds, contact.

The hull's corners move on cubics: the origin's, plus each corner turned by the direction e. Points come in two forms:
`path` (4, 5), the control points of origin (x, y, z) and direction (ex, ey) for one control, and `q` (n, 3), the
corners at one time, in the plane counter-clockwise.

The signed distance of the origin to a convex hull is the largest, over unit vectors v, of min v . corner: negative
inside, where it is minus the depth. Any v therefore bounds it from below. For a constant v, min v . corner along a
cubic is bounded by its control points. That bound is of second order when v is the best one in the middle. A control
that slides along a hull would be bisected without end: collisions less deep than CLEARANCE are not sought.
"""

from typing import NamedTuple

import numpy as np

from slalom.kernels.arrays import Array, Direction, Hulls, Indices, MaybeHulls, Segments
from slalom.kernels.geometry.convex import order, signed_distance
from slalom.kernels.geometry.cubic import restrict, value
from slalom.kernels.jit import kernel
from slalom.tolerances import CLEARANCE, DEEPEST_SAMPLES, GOLDEN_STEPS, LEAST_WIDTH


class MovingHull(NamedTuple):
    """One rounded hull along a segment, relative to the robot under one control."""

    path: Array  # (4, 5) control points of origin (x, y, z) [m] and direction (ex, ey)
    hulls: Hulls
    hull: int  # its number
    radius: float  # [m] at the begin
    growth: float  # [m] over the segment


@kernel
def new_path(hulls: MaybeHulls) -> tuple[Array, Array]:
    """Buffers for one path (4, 5), and for the corners (c, 3) of one hull at several times (`elements.fan`).

    There is room for each hull of the rows. Most hulls of a map are of no row.
    """
    most = 1
    if len(hulls) > 0:
        for h in hulls.hull:
            if h >= 0:
                most = max(most, hulls.first[h + 1] - hulls.first[h])
    return np.empty((4, 5)), np.zeros((4 * most + 4, 3))


@kernel
def load_path(table: Segments, hulls: Hulls, s: int, u: Array, path: Array) -> None:
    """The path (4, 5) of segment s under control u (3,)."""
    points, gains, turns = table.points, table.gains, hulls.turns
    for j in range(4):
        for axis in range(3):
            path[j, axis] = points[j, axis, s] - gains[j, s] * u[axis]
        path[j, 3], path[j, 4] = turns[j, 0, s], turns[j, 1, s]


@kernel
def corners_at(moving: MovingHull, x: float, q: Array) -> int:
    """The number of corners of the hull; their positions at x in [0, 1] go into q (n, 3) [m]."""
    path, h = moving.path, moving.hull
    corners, first = moving.hulls.corners, moving.hulls.first
    # Numbers, not an array of them: its memory would take as long as the rest.
    px = value(path[0, 0], path[1, 0], path[2, 0], path[3, 0], x)
    py = value(path[0, 1], path[1, 1], path[2, 1], path[3, 1], x)
    pz = value(path[0, 2], path[1, 2], path[2, 2], path[3, 2], x)
    ex = value(path[0, 3], path[1, 3], path[2, 3], path[3, 3], x)
    ey = value(path[0, 4], path[1, 4], path[2, 4], path[3, 4], x)
    begin, n = first[h], first[h + 1] - first[h]
    for j in range(n):
        k = begin + j
        q[j, 0] = px + corners[k, 0] + corners[k, 3] * ex - corners[k, 4] * ey
        q[j, 1] = py + corners[k, 1] + corners[k, 3] * ey + corners[k, 4] * ex
        q[j, 2] = pz + corners[k, 2]
    return int(n)


@kernel
def hull_distance(moving: MovingHull, x: float, q: Array) -> Direction:
    """Signed distance [m] of the origin to the rounded hull at x, and the unit vector that attains it."""
    n = corners_at(moving, x, q)
    if moving.hulls.unordered[moving.hull]:
        n = order(q, n)
    distance, vx, vy, vz = signed_distance(q, n)
    return distance - moving.radius - moving.growth * x, vx, vy, vz


@kernel
def distance_bound(moving: MovingHull, a: float, b: float, vx: float, vy: float, vz: float) -> float:
    """A lower bound [m] of the signed distance to the rounded hull over [a, b], from the unit vector v."""
    path, h, growth = moving.path, moving.hull, moving.growth
    corners, first = moving.hulls.corners, moving.hulls.first
    # Along v only: the path of the origin, and the components of the direction along v and across it.
    p0, p1, p2, p3 = restrict(
        vx * path[0, 0] + vy * path[0, 1] + vz * path[0, 2],
        vx * path[1, 0] + vy * path[1, 1] + vz * path[1, 2],
        vx * path[2, 0] + vy * path[2, 1] + vz * path[2, 2],
        vx * path[3, 0] + vy * path[3, 1] + vz * path[3, 2],
        a,
        b,
    )
    e0, e1, e2, e3 = restrict(
        vx * path[0, 3] + vy * path[0, 4],
        vx * path[1, 3] + vy * path[1, 4],
        vx * path[2, 3] + vy * path[2, 4],
        vx * path[3, 3] + vy * path[3, 4],
        a,
        b,
    )
    f0, f1, f2, f3 = restrict(
        vy * path[0, 3] - vx * path[0, 4],
        vy * path[1, 3] - vx * path[1, 4],
        vy * path[2, 3] - vx * path[2, 4],
        vy * path[3, 3] - vx * path[3, 4],
        a,
        b,
    )
    low0, low1, low2, low3 = np.inf, np.inf, np.inf, np.inf
    for j in range(first[h], first[h + 1]):
        fixed = corners[j, 0] * vx + corners[j, 1] * vy + corners[j, 2] * vz
        cx, cy = corners[j, 3], corners[j, 4]
        low0 = min(low0, fixed + cx * e0 + cy * f0)
        low1 = min(low1, fixed + cx * e1 + cy * f1)
        low2 = min(low2, fixed + cx * e2 + cy * f2)
        low3 = min(low3, fixed + cx * e3 + cy * f3)
    first_radius, step = moving.radius + growth * a, growth * (b - a) / 3.0
    return float(
        min(
            min(p0 + low0 - first_radius, p1 + low1 - first_radius - step),
            min(p2 + low2 - first_radius - 2.0 * step, p3 + low3 - first_radius - 3.0 * step),
        )
    )


@kernel
def hull_below(moving: MovingHull, stack: Array, q: Array) -> float:
    """A place x in [0, 1] at which the origin is inside the rounded hull, or -1 if nowhere by more than CLEARANCE."""
    for end in (0.0, 1.0):
        if hull_distance(moving, end, q)[0] < 0.0:
            return end
    stack[0, 0], stack[0, 1], top = 0.0, 1.0, 0
    while top >= 0:
        a, width = stack[top, 0], stack[top, 1]
        top -= 1
        middle = a + 0.5 * width
        distance, vx, vy, vz = hull_distance(moving, middle, q)
        if distance < 0.0:
            return float(middle)
        if width < LEAST_WIDTH or distance_bound(moving, a, a + width, vx, vy, vz) >= -CLEARANCE:
            continue
        stack[top + 1, 0], stack[top + 1, 1] = middle, 0.5 * width
        stack[top + 2, 0], stack[top + 2, 1] = a, 0.5 * width
        top += 2
    return -1.0


@kernel
def hull_first_below(moving: MovingHull, stack: Array, q: Array, least: float) -> float:
    """The first x, up to `least`, at which the origin enters the rounded hull, -1 if never by more than CLEARANCE."""
    stack[0, 0], stack[0, 1], top = 0.0, 1.0, 0
    while top >= 0:
        a, width = stack[top, 0], stack[top, 1]
        top -= 1
        middle = a + 0.5 * width
        _, vx, vy, vz = hull_distance(moving, middle, q)
        if distance_bound(moving, a, a + width, vx, vy, vz) >= -CLEARANCE:
            continue
        if hull_distance(moving, a, q)[0] < 0.0:
            return float(a)
        if width < least and hull_distance(moving, a + width, q)[0] < 0.0:
            return float(a)
        if width < LEAST_WIDTH:
            continue
        stack[top + 1, 0], stack[top + 1, 1] = middle, 0.5 * width
        stack[top + 2, 0], stack[top + 2, 1] = a, 0.5 * width
        top += 2
    return -1.0


@kernel
def hull_least(
    moving: MovingHull,
    stack: Array,
    q: Array,
    ceiling: float,
    accuracy: float,
) -> float:
    """Least signed distance to the rounded hull where below `ceiling`, else `ceiling`; too large by at most
    `accuracy`.
    """
    best = ceiling
    for end in (0.0, 1.0):
        best = min(best, hull_distance(moving, end, q)[0])
    stack[0, 0], stack[0, 1], top = 0.0, 1.0, 0
    while top >= 0:
        a, width = stack[top, 0], stack[top, 1]
        top -= 1
        middle = a + 0.5 * width
        distance, vx, vy, vz = hull_distance(moving, middle, q)
        best = min(best, distance)
        if width < LEAST_WIDTH or distance_bound(moving, a, a + width, vx, vy, vz) >= best - accuracy:
            continue
        stack[top + 1, 0], stack[top + 1, 1] = middle, 0.5 * width
        stack[top + 2, 0], stack[top + 2, 1] = a, 0.5 * width
        top += 2
    return float(best)


@kernel
def deepest_time(
    moving: MovingHull,
    gain: Array,
    q: Array,
    witness: float,
) -> float:
    """A time of collision at which the control is deep inside the element: from samples, then by golden section.

    Depth counts in units of the control: signed distance over gain.
    """
    best, place, step = np.inf, witness, 1.0 / DEEPEST_SAMPLES
    for k in range(DEEPEST_SAMPLES + 2):
        x = witness if k == DEEPEST_SAMPLES + 1 else step * k
        g = value(gain[0], gain[1], gain[2], gain[3], x)
        gap = hull_distance(moving, x, q)[0]
        if gap < 0.0 and gap < best * g:
            best, place = gap / g, x
    low, high = max(0.0, place - step), min(1.0, place + step)
    share = 0.3819660112501051
    for _ in range(GOLDEN_STEPS):
        left, right = low + share * (high - low), high - share * (high - low)
        a = hull_distance(moving, left, q)[0]
        b = hull_distance(moving, right, q)[0]
        a /= value(gain[0], gain[1], gain[2], gain[3], left)
        b /= value(gain[0], gain[1], gain[2], gain[3], right)
        if a < b:
            high = right
        else:
            low = left
        x, least = (left, a) if a < b else (right, b)
        if least < best:
            best, place = least, x
    return float(place)


@kernel
def distances(places: Array, directions: Array, hull: Indices, hulls: MaybeHulls) -> Array:
    """Signed distance [m] of the origin to hulls with numbers `hull` (k,), -1 for points, and the unit vector: (k, 4).

    The origins of the hulls lie at `places` (k, 3) [m], their bodies along `directions` (k, 2).
    """
    result = np.empty((len(places), 4))
    path, q = new_path(hulls)
    for i in range(len(places)):
        if len(hulls) == 0 or hull[i] < 0:
            n = 1
            q[0, 0], q[0, 1], q[0, 2] = places[i, 0], places[i, 1], places[i, 2]
        else:
            for j in range(4):
                path[j, 0], path[j, 1], path[j, 2] = places[i, 0], places[i, 1], places[i, 2]
                path[j, 3], path[j, 4] = directions[i, 0], directions[i, 1]
            n = corners_at(MovingHull(path, hulls, hull[i], 0.0, 0.0), 0.0, q)
            n = order(q, n) if hulls.unordered[hull[i]] else n
        result[i, 0], result[i, 1], result[i, 2], result[i, 3] = signed_distance(q, n)
    return result
