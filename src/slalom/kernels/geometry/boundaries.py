"""Balls and half-spaces in control space: membership, projections, intersections.

A boundary is a row (side, x, y, z, r). Side 1 is the outside of the ball of centre (x, y, z) and radius r, side -1 the
inside. Side 0 is the half-space x u0 + y u1 + z u2 <= r with a unit normal. In the plane z is 0. Circles (side 2) and
lines (side 3, x u0 + y u1 = r) of rounded polygons give candidates only. Rejection is tested with the polygon itself
(`polygons`). The exchange keeps four more columns: the polygon that a row belongs to, or -1, and the disc in which
alone the row matters. `boundaries` is an array of such rows, (n, 5) or (n, 9), u and `found` are controls.
"""

from math import pi
from typing import Final

import numpy as np

from slalom.base.tolerances import ADMISSIBLE
from slalom.kernels.arrays import Array, Plane
from slalom.kernels.jit import kernel, squared

ELEMENT: Final = 1e-12
"""[1] Relative depth inside an element that counts as lying on its boundary. Candidates are intersections of element
boundaries and carry rounding of this order. Times the distances met (up to kilometres) it stays below CONTACT, so no
collision hides in it."""

PARALLEL: Final = 1e-12
"""[1] Sine of the angle below which two planes count as parallel, and relative distance from a circle's axis. The
intersection of boundaries that meet at a smaller angle depends on rounding only."""


@kernel
def is_flat(boundaries: Array, b: int) -> bool:
    """Whether the boundary is a plane or a line."""
    return bool(boundaries[b, 0] == 0.0 or boundaries[b, 0] == 3.0)


@kernel
def meets(boundaries: Array, first: int, last: int, u: Array, i: int, j: int) -> bool:
    """Whether u (3,) satisfies the boundaries first to last - 1, up to rounding; not i and j, which generated it."""
    for b in range(first, last):
        side = boundaries[b, 0]
        if side >= 2.0 or b in (i, j):
            continue
        r = boundaries[b, 4]
        x = boundaries[b, 1]
        y = boundaries[b, 2]
        z = boundaries[b, 3]
        if side == 0.0:
            if x * u[0] + y * u[1] + z * u[2] > r + ADMISSIBLE * (1.0 + abs(r)):
                return False
        else:
            square = squared(u[0] - x) + squared(u[1] - y) + squared(u[2] - z)
            if side > 0.0:
                if square < r * r * (1.0 - ELEMENT):
                    return False
            elif square > squared(r * (1.0 + ADMISSIBLE) + squared(ADMISSIBLE)):
                return False
    return True


@kernel
def project(boundaries: Array, b: int, u: Array, found: Array) -> None:
    """Write the point of boundary b nearest to u (3,) into found[0]; at the centre of a ball any point is as near."""
    x = boundaries[b, 1]
    y = boundaries[b, 2]
    z = boundaries[b, 3]
    r = boundaries[b, 4]
    if is_flat(boundaries, b):
        step = r - (x * u[0] + y * u[1] + z * u[2])
        found[0, 0] = u[0] + step * x
        found[0, 1] = u[1] + step * y
        found[0, 2] = u[2] + step * z
        return
    dx = u[0] - x
    dy = u[1] - y
    dz = u[2] - z
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    if length == 0.0:
        dx = 1.0
        length = 1.0
    scale = r / length
    found[0, 0] = x + scale * dx
    found[0, 1] = y + scale * dy
    found[0, 2] = z + scale * dz


@kernel
def apart(boundaries: Array, i: int, j: int) -> bool:
    """Whether two boundaries are too far apart to have common points: a quick test before their intersection.

    Those of polygons are arcs and edges in discs (columns 6 to 8) in which alone they matter.
    """
    if boundaries[i, 0] >= 2.0 and boundaries[j, 0] >= 2.0:
        reach = boundaries[i, 8] + boundaries[j, 8]
        away = squared(boundaries[i, 6] - boundaries[j, 6]) + squared(boundaries[i, 7] - boundaries[j, 7])
        return bool(away > reach * reach)
    if is_flat(boundaries, i) or is_flat(boundaries, j):
        return False
    square = 0.0
    for axis in range(1, 4):
        square += squared(boundaries[i, axis] - boundaries[j, axis])
    return bool(square > squared(boundaries[i, 4] + boundaries[j, 4]))


@kernel
def plane_of(boundaries: Array, i: int, j: int) -> tuple[bool, float, float, float, float]:
    """The plane (unit normal, offset) that holds the intersection of i and j; False if there is none.

    For two balls it is their radical plane, for a ball and a half-space the latter's boundary.
    """
    if is_flat(boundaries, i) or is_flat(boundaries, j):
        b = i if is_flat(boundaries, i) else j
        return True, boundaries[b, 1], boundaries[b, 2], boundaries[b, 3], boundaries[b, 4]
    x = boundaries[i, 1]
    y = boundaries[i, 2]
    z = boundaries[i, 3]
    dx = boundaries[j, 1] - x
    dy = boundaries[j, 2] - y
    dz = boundaries[j, 3] - z
    ri = boundaries[i, 4]
    rj = boundaries[j, 4]
    square = dx * dx + dy * dy + dz * dz
    if square == 0.0 or square > squared(ri + rj) or square < squared(ri - rj):
        return False, 0.0, 0.0, 0.0, 0.0
    distance = np.sqrt(square)
    along = 0.5 * (distance + (ri - rj) * (ri + rj) / distance)
    nx = dx / distance
    ny = dy / distance
    nz = dz / distance
    return True, nx, ny, nz, nx * x + ny * y + nz * z + along


@kernel
def line_of(a: Plane, b: Plane) -> tuple[bool, float, float, float, float, float, float]:
    """The line (point, unit direction) in which the planes a and b meet; False if they are parallel."""
    _, ax, ay, az, ao = a
    _, bx, by, bz, bo = b
    cx = ay * bz - az * by
    cy = az * bx - ax * bz
    cz = ax * by - ay * bx
    square = cx * cx + cy * cy + cz * cz
    if square < PARALLEL * PARALLEL:
        return False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    # The point of the line nearest to the origin: (ao (b x c) + bo (c x a)) / |c|^2 with c = a x b.
    px = (ao * (by * cz - bz * cy) + bo * (cy * az - cz * ay)) / square
    py = (ao * (bz * cx - bx * cz) + bo * (cz * ax - cx * az)) / square
    pz = (ao * (bx * cy - by * cx) + bo * (cx * ay - cy * ax)) / square
    length = np.sqrt(square)
    return True, px, py, pz, cx / length, cy / length, cz / length


@kernel
def intersect_two(boundaries: Array, i: int, j: int, found: Array) -> int:
    """The number of points in which boundaries i and j in the plane intersect; they go into `found` (2, 3).

    Two points, or one for two lines. See `geometry.curves` for boundaries in space.
    """
    flat_i = is_flat(boundaries, i)
    flat_j = is_flat(boundaries, j)
    if flat_i and flat_j:
        meet, px, py, pz, _, _, _ = line_of(flat(boundaries, i), flat(boundaries, j))
        if not meet:
            return 0
        found[0, 0] = px
        found[0, 1] = py
        found[0, 2] = pz
        return 1
    meet, nx, ny, nz, offset = plane_of(boundaries, i, j)
    if not meet:
        return 0
    b = j if flat_i else i
    x = boundaries[b, 1]
    y = boundaries[b, 2]
    z = boundaries[b, 3]
    r = boundaries[b, 4]
    height = offset - (nx * x + ny * y + nz * z)
    square = r * r - height * height
    if square < 0.0:
        return 0
    half = np.sqrt(square)
    fx = x + height * nx
    fy = y + height * ny
    found[0, 0] = fx - half * ny
    found[0, 1] = fy + half * nx
    found[0, 2] = 0.0
    found[1, 0] = fx + half * ny
    found[1, 1] = fy - half * nx
    found[1, 2] = 0.0
    return 2


@kernel
def flat(boundaries: Array, b: int) -> tuple[bool, float, float, float, float]:
    """A half-space's plane."""
    return True, boundaries[b, 1], boundaries[b, 2], boundaries[b, 3], boundaries[b, 4]


@kernel
def are_circles(boundaries: Array, i: int, j: int) -> bool:
    """Whether boundaries i and j in the plane are circles, see `boundaries`."""
    return bool(not is_flat(boundaries, i) and not is_flat(boundaries, j))


@kernel
def intersect_circles(boundaries: Array, i: int, j: int, found: Array) -> int:
    """The number of points in which circles i and j intersect; they go into `found` (2, 3).

    With c the vector from one centre to the other, they lie at the share a of c, and h |c| to its sides. The exchange
    needs this most often; it takes one division and one root.
    """
    x = boundaries[i, 1]
    y = boundaries[i, 2]
    r = boundaries[i, 4]
    dx = boundaries[j, 1] - x
    dy = boundaries[j, 2] - y
    other = boundaries[j, 4]
    square = dx * dx + dy * dy
    if square == 0.0 or square > squared(r + other) or square < squared(r - other):
        return 0
    inverse = 1.0 / square
    a = 0.5 + 0.5 * (r - other) * (r + other) * inverse
    h = np.sqrt(max(r * r * inverse - a * a, 0.0))
    x = x + a * dx
    y = y + a * dy
    sx = h * dy
    sy = h * dx
    found[0, 0] = x - sx
    found[0, 1] = y + sy
    found[0, 2] = 0.0
    found[1, 0] = x + sx
    found[1, 1] = y - sy
    found[1, 2] = 0.0
    return 2


# Curves in space: the circle or line in which two boundaries meet, and how far along it a third one reaches.
#
# A curve is an array (4, 3): the centre of the circle, two unit vectors e, g in its plane, and the radius in the last
# row. e points to the preferred control u. Its point at angle t is centre + radius (cos t e + sin t g): the distance
# from u grows with |t| up to pi. A line has radius inf, its point nearest to u as the centre, and e along it; t is a
# length.


@kernel
def curve_of(boundaries: Array, i: int, j: int, u: Array, curve: Array) -> bool:
    """Whether boundaries i and j meet in space; the circle or line, seen from control u (3,), goes into `curve`."""
    flat_i = is_flat(boundaries, i)
    flat_j = is_flat(boundaries, j)
    if flat_i and flat_j:
        meet, px, py, pz, ex, ey, ez = line_of(flat(boundaries, i), flat(boundaries, j))
        along = (u[0] - px) * ex + (u[1] - py) * ey + (u[2] - pz) * ez
        curve[0, 0] = px + along * ex
        curve[0, 1] = py + along * ey
        curve[0, 2] = pz + along * ez
        curve[1, 0] = ex
        curve[1, 1] = ey
        curve[1, 2] = ez
        curve[3, 0] = np.inf
        return meet
    # The smaller ball holds the circle with the least rounding.
    b, other = (j, i) if flat_i or (not flat_j and boundaries[j, 4] < boundaries[i, 4]) else (i, j)
    x = boundaries[b, 1]
    y = boundaries[b, 2]
    z = boundaries[b, 3]
    r = boundaries[b, 4]
    nx = boundaries[other, 1]
    ny = boundaries[other, 2]
    nz = boundaries[other, 3]
    q = boundaries[other, 4]
    if flat_i or flat_j:
        height = q - (nx * x + ny * y + nz * z)
    else:
        nx = nx - x
        ny = ny - y
        nz = nz - z
        distance = np.sqrt(nx * nx + ny * ny + nz * nz)
        if distance == 0.0:
            return False
        nx = nx / distance
        ny = ny / distance
        nz = nz / distance
        height = 0.5 * (r * r + (distance - q) * (distance + q)) / distance
    square = (r - height) * (r + height)
    if square <= 0.0:
        return False
    half = np.sqrt(square)
    curve[0, 0] = x + height * nx
    curve[0, 1] = y + height * ny
    curve[0, 2] = z + height * nz
    curve[3, 0] = half
    frame(curve, nx, ny, nz, u)
    return True


@kernel
def frame(curve: Array, nx: float, ny: float, nz: float, u: Array) -> None:
    """Write the unit vectors of a circle with unit normal n: e towards the control u (3,), and g = n x e.

    From the axis of the circle all its points are as near, and e is any vector in its plane. Close to the axis, the
    remaining vector to u is mostly rounding error. Its share along n is therefore removed once more.
    """
    wx = u[0] - curve[0, 0]
    wy = u[1] - curve[0, 1]
    wz = u[2] - curve[0, 2]
    size = np.sqrt(wx * wx + wy * wy + wz * wz) + curve[3, 0]
    length = 0.0
    for turn in range(3):
        above = wx * nx + wy * ny + wz * nz
        wx = wx - above * nx
        wy = wy - above * ny
        wz = wz - above * nz
        length = np.sqrt(wx * wx + wy * wy + wz * wz)
        if turn == 0 and not length > PARALLEL * size:
            # The axis that is farthest from n.
            wx = 0.0
            wy = -nz
            wz = ny
            if abs(nx) > 0.7:
                wx = -ny
                wy = nx
                wz = 0.0
            length = np.sqrt(wx * wx + wy * wy + wz * wz)
        wx = wx / length
        wy = wy / length
        wz = wz / length
    curve[1, 0] = wx
    curve[1, 1] = wy
    curve[1, 2] = wz
    curve[2, 0] = ny * wz - nz * wy
    curve[2, 1] = nz * wx - nx * wz
    curve[2, 2] = nx * wy - ny * wx


@kernel
def point_on(boundaries: Array, i: int, curve: Array, t: float, found: Array) -> None:
    """Write the point of a curve at t into found[0]; exactly on boundary i, if that is one of the admissible set."""
    c = t
    s = 0.0
    if curve[3, 0] < np.inf:
        c = curve[3, 0] * np.cos(t)
        s = curve[3, 0] * np.sin(t)
    for axis in range(3):
        found[0, axis] = curve[0, axis] + c * curve[1, axis]
        if s != 0.0:
            found[0, axis] += s * curve[2, axis]
    if boundaries[i, 0] <= 0.0:
        project(boundaries, i, found[0], found)


@kernel
def end_of_cover(boundaries: Array, k: int, curve: Array, t: float, way: float) -> float:
    """The |t| at which a curve leaves the part that boundary k excludes and that holds t; inf if it does not.

    `way`: 1 towards larger t, -1 towards smaller ones. On a circle, t stays within [-pi, pi].
    """
    if curve[3, 0] == np.inf:
        return end_on_line(boundaries, k, curve, t, way)
    constant = 0.0
    along = 0.0
    across = 0.0
    x = boundaries[k, 1]
    y = boundaries[k, 2]
    z = boundaries[k, 3]
    r = boundaries[k, 4]
    half = curve[3, 0]
    # Boundary k admits the point at t where constant + along cos t + across sin t >= 0.
    if is_flat(boundaries, k):
        constant = r - (x * curve[0, 0] + y * curve[0, 1] + z * curve[0, 2])
        along = -half * (x * curve[1, 0] + y * curve[1, 1] + z * curve[1, 2])
        across = -half * (x * curve[2, 0] + y * curve[2, 1] + z * curve[2, 2])
    else:
        side = boundaries[k, 0]
        x = curve[0, 0] - x
        y = curve[0, 1] - y
        z = curve[0, 2] - z
        constant = side * (x * x + y * y + z * z + (half - r) * (half + r))
        along = side * 2.0 * half * (x * curve[1, 0] + y * curve[1, 1] + z * curve[1, 2])
        across = side * 2.0 * half * (x * curve[2, 0] + y * curve[2, 1] + z * curve[2, 2])
    most = np.sqrt(along * along + across * across)
    if constant <= -most:
        return np.inf
    width = np.arccos(-constant / most) if constant < most else pi
    end = way * np.arctan2(across, along) - width
    end += 2.0 * pi * np.ceil((way * t - end) / (2.0 * pi))
    return end if end <= pi else np.inf


@kernel
def end_on_line(boundaries: Array, k: int, curve: Array, t: float, way: float) -> float:
    """The same on a line."""
    x = boundaries[k, 1]
    y = boundaries[k, 2]
    z = boundaries[k, 3]
    r = boundaries[k, 4]
    ex = way * curve[1, 0]
    ey = way * curve[1, 1]
    ez = way * curve[1, 2]
    if is_flat(boundaries, k):
        slope = x * ex + y * ey + z * ez
        if slope >= 0.0:
            return np.inf
        return float((r - (x * curve[0, 0] + y * curve[0, 1] + z * curve[0, 2])) / slope)
    x = x - curve[0, 0]
    y = y - curve[0, 1]
    z = z - curve[0, 2]
    middle = x * ex + y * ey + z * ez
    x = x - middle * ex
    y = y - middle * ey
    z = z - middle * ez
    square = r * r - (x * x + y * y + z * z)
    if boundaries[k, 0] > 0.0:
        return float(middle + np.sqrt(max(square, 0.0)))
    if square < 0.0 or way * t > middle:
        return np.inf
    return float(middle - np.sqrt(square))


# Axes of a body along a direction.


@kernel
def axes_along(ahead: Array) -> Array:
    """Unit axes (d, d) of a body as rows, of which the first is the unit vector `ahead` (d,).

    In the plane the second is to its left. In space any two lateral directions serve; these come from the world axis
    that is most lateral.
    """
    d = len(ahead)
    axes = np.empty((d, d))
    x = ahead[0]
    y = ahead[1]
    axes[0] = ahead
    if d == 2:
        axes[1, 0] = -y
        axes[1, 1] = x
        return axes
    z = ahead[2]
    least = min(abs(x), abs(y), abs(z))
    p, q, r = (0.0, z, -y) if abs(x) == least else (-z, 0.0, x) if abs(y) == least else (y, -x, 0.0)
    length = np.sqrt(p * p + q * q + r * r)
    p = p / length
    q = q / length
    r = r / length
    axes[1, 0] = p
    axes[1, 1] = q
    axes[1, 2] = r
    axes[2, 0] = y * r - z * q
    axes[2, 1] = z * p - x * r
    axes[2, 2] = x * q - y * p
    return axes
