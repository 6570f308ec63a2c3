"""Curves in space: the circle or line in which two boundaries meet, and how far along it a third one reaches.

A curve is an array (4, 3): the centre of the circle, two unit vectors e, g in its plane, and the radius in the last
row. e points to the preferred control u. Its point at angle t is centre + radius (cos t e + sin t g): the distance from
u grows with |t| up to pi. A line has radius inf, its point nearest to u as the centre, and e along it; t is a length.
"""

from math import pi

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.geometry.boundaries import flat, is_flat, line_of, project
from slalom.kernels.jit import kernel
from slalom.tolerances import PARALLEL


@kernel
def curve_of(boundaries: Array, i: int, j: int, u: Array, curve: Array) -> bool:
    """Whether boundaries i and j meet in space; the circle or line, seen from control u (3,), goes into `curve`."""
    flat_i, flat_j = is_flat(boundaries, i), is_flat(boundaries, j)
    if flat_i and flat_j:
        meet, px, py, pz, ex, ey, ez = line_of(flat(boundaries, i), flat(boundaries, j))
        along = (u[0] - px) * ex + (u[1] - py) * ey + (u[2] - pz) * ez
        curve[0, 0], curve[0, 1], curve[0, 2] = px + along * ex, py + along * ey, pz + along * ez
        curve[1, 0], curve[1, 1], curve[1, 2] = ex, ey, ez
        curve[3, 0] = np.inf
        return meet
    # The smaller ball holds the circle with the least rounding.
    b, other = (j, i) if flat_i or (not flat_j and boundaries[j, 4] < boundaries[i, 4]) else (i, j)
    x, y, z, r = boundaries[b, 1], boundaries[b, 2], boundaries[b, 3], boundaries[b, 4]
    nx, ny, nz, q = boundaries[other, 1], boundaries[other, 2], boundaries[other, 3], boundaries[other, 4]
    if flat_i or flat_j:
        height = q - (nx * x + ny * y + nz * z)
    else:
        nx, ny, nz = nx - x, ny - y, nz - z
        distance = np.sqrt(nx * nx + ny * ny + nz * nz)
        if distance == 0.0:
            return False
        nx, ny, nz = nx / distance, ny / distance, nz / distance
        height = 0.5 * (r * r + (distance - q) * (distance + q)) / distance
    square = (r - height) * (r + height)
    if square <= 0.0:
        return False
    half = np.sqrt(square)
    curve[0, 0], curve[0, 1], curve[0, 2] = x + height * nx, y + height * ny, z + height * nz
    curve[3, 0] = half
    frame(curve, nx, ny, nz, u)
    return True


@kernel
def frame(curve: Array, nx: float, ny: float, nz: float, u: Array) -> None:
    """Write the unit vectors of a circle with unit normal n: e towards the control u (3,), and g = n x e.

    From the axis of the circle all its points are as near, and e is any vector in its plane. Close to the axis, the
    remaining vector to u is mostly rounding error. Its share along n is therefore removed once more.
    """
    wx, wy, wz = u[0] - curve[0, 0], u[1] - curve[0, 1], u[2] - curve[0, 2]
    size = np.sqrt(wx * wx + wy * wy + wz * wz) + curve[3, 0]
    length = 0.0
    for turn in range(3):
        above = wx * nx + wy * ny + wz * nz
        wx, wy, wz = wx - above * nx, wy - above * ny, wz - above * nz
        length = np.sqrt(wx * wx + wy * wy + wz * wz)
        if turn == 0 and not length > PARALLEL * size:
            # The axis that is farthest from n.
            wx, wy, wz = 0.0, -nz, ny
            if abs(nx) > 0.7:
                wx, wy, wz = -ny, nx, 0.0
            length = np.sqrt(wx * wx + wy * wy + wz * wz)
        wx, wy, wz = wx / length, wy / length, wz / length
    curve[1, 0], curve[1, 1], curve[1, 2] = wx, wy, wz
    curve[2, 0], curve[2, 1], curve[2, 2] = ny * wz - nz * wy, nz * wx - nx * wz, nx * wy - ny * wx


@kernel
def point_on(boundaries: Array, i: int, curve: Array, t: float, found: Array) -> None:
    """Write the point of a curve at t into found[0]; exactly on boundary i, if that is one of the admissible set."""
    c, s = t, 0.0
    if curve[3, 0] < np.inf:
        c, s = curve[3, 0] * np.cos(t), curve[3, 0] * np.sin(t)
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
    constant, along, across = 0.0, 0.0, 0.0
    x, y, z, r = boundaries[k, 1], boundaries[k, 2], boundaries[k, 3], boundaries[k, 4]
    half = curve[3, 0]
    # Boundary k admits the point at t where constant + along cos t + across sin t >= 0.
    if is_flat(boundaries, k):
        constant = r - (x * curve[0, 0] + y * curve[0, 1] + z * curve[0, 2])
        along = -half * (x * curve[1, 0] + y * curve[1, 1] + z * curve[1, 2])
        across = -half * (x * curve[2, 0] + y * curve[2, 1] + z * curve[2, 2])
    else:
        side = boundaries[k, 0]
        x, y, z = curve[0, 0] - x, curve[0, 1] - y, curve[0, 2] - z
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
    x, y, z, r = boundaries[k, 1], boundaries[k, 2], boundaries[k, 3], boundaries[k, 4]
    ex, ey, ez = way * curve[1, 0], way * curve[1, 1], way * curve[1, 2]
    if is_flat(boundaries, k):
        slope = x * ex + y * ey + z * ez
        if slope >= 0.0:
            return np.inf
        return float((r - (x * curve[0, 0] + y * curve[0, 1] + z * curve[0, 2])) / slope)
    x, y, z = x - curve[0, 0], y - curve[0, 1], z - curve[0, 2]
    middle = x * ex + y * ey + z * ez
    x, y, z = x - middle * ex, y - middle * ey, z - middle * ez
    square = r * r - (x * x + y * y + z * z)
    if boundaries[k, 0] > 0.0:
        return float(middle + np.sqrt(max(square, 0.0)))
    if square < 0.0 or way * t > middle:
        return np.inf
    return float(middle - np.sqrt(square))
