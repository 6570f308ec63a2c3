"""The signed distance of the origin to the convex hull of a few points."""

import numpy as np

from slalom.kernels.arrays import Array, Direction
from slalom.kernels.jit import kernel
from slalom.kernels.squared import squared
from slalom.tolerances import CONTACT


@kernel
def to_segment(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    """The point of the segment from a to b nearest to the origin."""
    dx, dy, dz = bx - ax, by - ay, bz - az
    along = -(ax * dx + ay * dy + az * dz) / (dx * dx + dy * dy + dz * dz + 1e-300)
    along = min(1.0, max(0.0, along))
    return ax + along * dx, ay + along * dy, az + along * dz


@kernel
def signed_distance(q: Array, n: int) -> Direction:
    """Signed distance of the origin to the hull of the corners q[:n] (m, 3) [m], and the unit vector that attains it.

    Two corners: a segment, in the plane or in space. More: a polygon in the plane.
    """
    least, px, py, pz, inside = np.inf, 0.0, 0.0, 0.0, n > 2
    for i in range(n if n > 2 else 1):
        k = i + 1 if i + 1 < n else 0
        ax, ay, bx, by = q[i, 0], q[i, 1], q[k, 0], q[k, 1]
        x, y, z = to_segment(ax, ay, q[i, 2], bx, by, q[k, 2])
        square = x * x + y * y + z * z
        inside = inside and (by - ay) * ax + (ax - bx) * ay >= 0.0
        if square < least:
            least, px, py, pz = square, x, y, z
    distance = np.sqrt(least)
    if not inside and distance >= CONTACT:
        return distance, px / distance, py / distance, pz / distance
    depth, nx, ny = outermost_edge(q, n)
    # A body that turns on the spot has all its corners in one place (`trajectory.direction`): no edge, no interior.
    if n > 2 and -np.inf < depth <= 0.0:
        return depth, -nx, -ny, 0.0
    if distance < CONTACT and q[0, 2] == 0.0 and q[n - 1, 2] == 0.0 and 0.999 * distance <= abs(depth) < np.inf:
        # Rounding leaves no direction in so short a difference. That of the edge, which is about as near, is exact.
        side = -1.0 if depth > 0.0 else 1.0
        return distance, side * nx, side * ny, 0.0
    if distance > 0.0:
        return distance, px / distance, py / distance, pz / distance
    return 0.0, nx, ny, 0.0


@kernel
def outermost_edge(q: Array, n: int) -> tuple[float, float, float]:
    """How far the origin is beyond the line of an edge of q[:n] (m, 3) [m] at most, and the normal of that edge.

    Negative inside a polygon; -inf without an edge.
    """
    depth, nx, ny = -np.inf, 1.0, 0.0
    for i in range(n if n > 2 else 1):
        k = i + 1 if i + 1 < n else 0
        ax, ay, bx, by = q[i, 0], q[i, 1], q[k, 0], q[k, 1]
        length = np.sqrt(squared(bx - ax) + squared(by - ay))
        if length > 0.0:
            ex, ey = (by - ay) / length, (ax - bx) / length
            beyond = -(ex * ax + ey * ay)
            if beyond > depth:
                depth, nx, ny = beyond, ex, ey
    return depth, nx, ny


@kernel
def order(q: Array, n: int) -> int:
    """The number of corners of the hull of q[:n] (m, 3) in the plane, which are sorted counter-clockwise into q.

    Andrew's monotone chain. Only hulls of two turning parts need it: all others keep their order.
    """
    for i in range(1, n):
        for j in range(i, 0, -1):
            if q[j, 0] > q[j - 1, 0] or (q[j, 0] == q[j - 1, 0] and q[j, 1] >= q[j - 1, 1]):
                break
            for axis in range(2):
                q[j, axis], q[j - 1, axis] = q[j - 1, axis], q[j, axis]
    chain, count = np.empty((2 * n, 2)), 0
    for turn in range(2):
        low = count + 1
        for step in range(n):
            i = step if turn == 0 else n - 1 - step
            while count > low and (chain[count - 1, 0] - chain[count - 2, 0]) * (q[i, 1] - chain[count - 2, 1]) <= (
                chain[count - 1, 1] - chain[count - 2, 1]
            ) * (q[i, 0] - chain[count - 2, 0]):
                count -= 1
            chain[count, 0], chain[count, 1] = q[i, 0], q[i, 1]
            count += 1
        count -= 1
    for i in range(count):
        q[i, 0], q[i, 1], q[i, 2] = chain[i, 0], chain[i, 1], 0.0
    return count
