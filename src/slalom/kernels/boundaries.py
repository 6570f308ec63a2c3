"""Balls and half-spaces in control space: membership, projections, intersections.

A boundary is a row (side, x, y, z, r): side 1, outside the ball of centre (x, y, z) and radius r; side -1,
inside it; side 0, the half-space x u0 + y u1 + z u2 <= r with a unit normal. In the plane z is 0.
"""

import numpy as np

from slalom.kernels.compiled import Array, kernel
from slalom.tolerances import ADMISSIBLE, ELEMENT


@kernel
def meets(boundaries: Array, first: int, last: int, u: Array, i: int, j: int, k: int) -> bool:
    """Whether u satisfies the boundaries first..last-1, up to rounding; i, j, k, which generated it, are met."""
    for b in range(first, last):
        if b in (i, j, k):
            continue
        side, r = boundaries[b, 0], boundaries[b, 4]
        x, y, z = boundaries[b, 1], boundaries[b, 2], boundaries[b, 3]
        if side == 0.0:
            if x * u[0] + y * u[1] + z * u[2] > r + ADMISSIBLE * (1.0 + abs(r)):
                return False
        else:
            square = (u[0] - x) ** 2 + (u[1] - y) ** 2 + (u[2] - z) ** 2
            if side > 0.0:
                if square < r * r * (1.0 - ELEMENT):
                    return False
            elif square > (r * (1.0 + ADMISSIBLE) + ADMISSIBLE**2) ** 2:
                return False
    return True


@kernel
def project(boundaries: Array, b: int, u: Array, found: Array) -> None:
    """Nearest point of boundary b to u, into found[0]. At the centre of a ball every direction is as near."""
    x, y, z, r = boundaries[b, 1], boundaries[b, 2], boundaries[b, 3], boundaries[b, 4]
    if boundaries[b, 0] == 0.0:
        step = r - (x * u[0] + y * u[1] + z * u[2])
        found[0, 0], found[0, 1], found[0, 2] = u[0] + step * x, u[1] + step * y, u[2] + step * z
        return
    dx, dy, dz = u[0] - x, u[1] - y, u[2] - z
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    if length == 0.0:
        dx, length = 1.0, 1.0
    scale = r / length
    found[0, 0], found[0, 1], found[0, 2] = x + scale * dx, y + scale * dy, z + scale * dz


@kernel
def plane_of(boundaries: Array, i: int, j: int, plane: Array) -> bool:
    """The plane (unit normal, offset) that holds the intersection of i and j, into `plane`; False if there is none.

    For two balls it is their radical plane, for a ball and a half-space the latter's boundary.
    """
    if boundaries[i, 0] == 0.0 or boundaries[j, 0] == 0.0:
        b = i if boundaries[i, 0] == 0.0 else j
        plane[0], plane[1], plane[2], plane[3] = boundaries[b, 1], boundaries[b, 2], boundaries[b, 3], boundaries[b, 4]
        return True
    dx = boundaries[j, 1] - boundaries[i, 1]
    dy = boundaries[j, 2] - boundaries[i, 2]
    dz = boundaries[j, 3] - boundaries[i, 3]
    ri, rj = boundaries[i, 4], boundaries[j, 4]
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    if distance == 0.0 or distance > ri + rj or distance < abs(ri - rj):
        return False
    along = 0.5 * (distance + (ri - rj) * (ri + rj) / distance)
    plane[0], plane[1], plane[2] = dx / distance, dy / distance, dz / distance
    plane[3] = plane[0] * boundaries[i, 1] + plane[1] * boundaries[i, 2] + plane[2] * boundaries[i, 3] + along
    return True


@kernel
def line_of(a: Array, b: Array, line: Array) -> bool:
    """The line (point, unit direction) in which the planes a and b meet, into line; False if parallel."""
    cx, cy, cz = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    square = cx * cx + cy * cy + cz * cz
    if square < 1e-24:
        return False
    # The point of the line nearest to the origin: (a3 (b x c) + b3 (c x a)) / |c|^2 with c = a x b.
    line[0] = (a[3] * (b[1] * cz - b[2] * cy) + b[3] * (cy * a[2] - cz * a[1])) / square
    line[1] = (a[3] * (b[2] * cx - b[0] * cz) + b[3] * (cz * a[0] - cx * a[2])) / square
    line[2] = (a[3] * (b[0] * cy - b[1] * cx) + b[3] * (cx * a[1] - cy * a[0])) / square
    length = np.sqrt(square)
    line[3], line[4], line[5] = cx / length, cy / length, cz / length
    return True


@kernel
def line_meets_ball(line: Array, x: float, y: float, z: float, r: float, found: Array) -> int:
    """The points where a line (point, unit direction) meets a sphere, into found; their number."""
    px, py, pz = x - line[0], y - line[1], z - line[2]
    along = px * line[3] + py * line[4] + pz * line[5]
    fx, fy, fz = line[0] + along * line[3], line[1] + along * line[4], line[2] + along * line[5]
    square = r * r - ((fx - x) ** 2 + (fy - y) ** 2 + (fz - z) ** 2)
    if square < 0.0:
        return 0
    half = np.sqrt(square)
    for f in range(2):
        sign = half if f == 0 else -half
        found[f, 0], found[f, 1], found[f, 2] = fx + sign * line[3], fy + sign * line[4], fz + sign * line[5]
    return 2


@kernel
def intersect_two(boundaries: Array, i: int, j: int, u: Array, dimension: int, found: Array) -> int:
    """Points of boundaries i and j that can be nearest to u, into found; their number.

    In the plane: the two points (for two lines one) in which they meet. In space they meet in a circle (or
    line), and its nearest point to u is taken; seen from the circle's axis all its points are as near, one is taken
    in each of four directions.
    """
    flat_i, flat_j = boundaries[i, 0] == 0.0, boundaries[j, 0] == 0.0
    plane, line = np.empty(4), np.empty(6)
    if flat_i and flat_j:
        if not line_of(boundaries[i, 1:], boundaries[j, 1:], line):
            return 0
        along = 0.0
        if dimension == 3:
            along = (u[0] - line[0]) * line[3] + (u[1] - line[1]) * line[4] + (u[2] - line[2]) * line[5]
        for axis in range(3):
            found[0, axis] = line[axis] + along * line[3 + axis]
        return 1
    if not plane_of(boundaries, i, j, plane):
        return 0
    b = j if flat_i else i
    x, y, z, r = boundaries[b, 1], boundaries[b, 2], boundaries[b, 3], boundaries[b, 4]
    offset = plane[3] - (plane[0] * x + plane[1] * y + plane[2] * z)
    square = r * r - offset * offset
    if square < 0.0:
        return 0
    half = np.sqrt(square)
    fx, fy, fz = x + offset * plane[0], y + offset * plane[1], z + offset * plane[2]
    if dimension == 2:
        found[0, 0], found[0, 1], found[0, 2] = fx - half * plane[1], fy + half * plane[0], 0.0
        found[1, 0], found[1, 1], found[1, 2] = fx + half * plane[1], fy - half * plane[0], 0.0
        return 2
    wx, wy, wz = u[0] - fx, u[1] - fy, u[2] - fz
    height = wx * plane[0] + wy * plane[1] + wz * plane[2]
    wx, wy, wz = wx - height * plane[0], wy - height * plane[1], wz - height * plane[2]
    length = np.sqrt(wx * wx + wy * wy + wz * wz)
    if length > 1e-12 * (1.0 + half):
        scale = half / length
        found[0, 0], found[0, 1], found[0, 2] = fx + scale * wx, fy + scale * wy, fz + scale * wz
        return 1
    return around_axis(plane, fx, fy, fz, half, found)


@kernel
def around_axis(plane: Array, x: float, y: float, z: float, half: float, found: Array) -> int:
    """Four points of the circle of radius `half` about (x, y, z) in the plane, into found."""
    ex, ey, ez = 0.0, -plane[2], plane[1]
    if abs(plane[0]) > 0.7:
        ex, ey, ez = -plane[1], plane[0], 0.0
    length = np.sqrt(ex * ex + ey * ey + ez * ez)
    ex, ey, ez = ex / length, ey / length, ez / length
    gx, gy, gz = plane[1] * ez - plane[2] * ey, plane[2] * ex - plane[0] * ez, plane[0] * ey - plane[1] * ex
    for f in range(4):
        c, s = (half if f == 0 else -half if f == 1 else 0.0), (half if f == 2 else -half if f == 3 else 0.0)
        found[f, 0], found[f, 1], found[f, 2] = x + c * ex + s * gx, y + c * ey + s * gy, z + c * ez + s * gz
    return 4


@kernel
def intersect_three(boundaries: Array, i: int, j: int, k: int, found: Array) -> int:
    """Points in which three boundaries in space meet, into found; their number."""
    # Sorted so that a, b give planes together with the ball, if there is any.
    ball = -1
    for b in (i, j, k):
        if boundaries[b, 0] != 0.0:
            ball = b
    first, second, line = np.empty(4), np.empty(4), np.empty(6)
    if ball < 0:
        if not line_of(boundaries[i, 1:], boundaries[j, 1:], line):
            return 0
        n = boundaries[k]
        slope = n[1] * line[3] + n[2] * line[4] + n[3] * line[5]
        if abs(slope) < 1e-12:
            return 0
        along = (n[4] - (n[1] * line[0] + n[2] * line[1] + n[3] * line[2])) / slope
        for axis in range(3):
            found[0, axis] = line[axis] + along * line[3 + axis]
        return 1
    a = i if ball != i else j
    b = k if ball != k and a != k else j
    if not plane_of(boundaries, ball, a, first) or not plane_of(boundaries, ball, b, second):
        return 0
    if not line_of(first, second, line):
        return 0
    row = boundaries[ball]
    return line_meets_ball(line, row[1], row[2], row[3], row[4], found)
