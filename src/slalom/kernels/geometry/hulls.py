"""Rounded convex hulls along a segment: their corners and signed distances.

The hull's corners move on cubics: the origin's, plus each corner turned by the direction e. Points come in two forms:
`path` (4, 5), the control points of origin (x, y, z) and direction (ex, ey) for one control, and `q` (n, 3), the
corners at one time, in the plane counter-clockwise.
"""

from typing import NamedTuple

import numpy as np

from slalom.kernels.arrays import Array, Direction, Hulls, Indices, MaybeHulls, Segments
from slalom.kernels.geometry.convex import order, signed_distance
from slalom.kernels.geometry.cubic import value
from slalom.kernels.jit import kernel


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
