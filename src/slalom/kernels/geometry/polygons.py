"""Rounded convex polygons in the control plane: the working set's elements that are not balls.

Several polygons are one flat list of corners. Polygon k has the corners (x, y) in rows begins[k] to begins[k + 1],
counter-clockwise. It is rounded by radii[k], and the disc (x, y, r) in row k of `around` contains it.
"""

from typing import Final, TypeAlias

import numpy as np

from slalom.kernels.arrays import Array, Indices, MaybeHulls
from slalom.kernels.geometry.boundaries import ELEMENT
from slalom.kernels.jit import kernel, squared

POLYGON_SLACK: Final = 1e-9
"""[1] Relative slack by which arcs and edges of rounded polygons count as reaching into the admissible set. Larger:
more candidates. Smaller: rounding loses a boundary that touches the set."""


Polygons: TypeAlias = tuple[Array, Indices, Array, Array]
"""corners, begins, radii, around; begins[0] is the number of polygons, polygon k lies from begins[k + 1] on."""
MaybePolygons: TypeAlias = Polygons | tuple[()]
"""Empty where there are no hulls, see `kernels.arrays.MaybeHulls`."""


@kernel
def smallest_ball(limits: Array, admissible: int) -> int:
    """The row of the smallest ball among the first `admissible` rows of `limits` (n, 5): it holds all controls."""
    smallest = -1
    for b in range(admissible):
        if limits[b, 0] < 0.0 and (smallest < 0 or limits[b, 4] < limits[smallest, 4]):
            smallest = b
    return smallest


@kernel
def new_boundaries(limits: Array) -> Array:
    """The boundaries (n, 9) of the admissible set `limits` (l, 5), with free rows for more."""
    boundaries = np.empty((len(limits) + 64, 9))
    for b in range(len(limits)):
        for column in range(5):
            boundaries[b, column] = limits[b, column]
        without_polygon(boundaries, b)
    return boundaries


@kernel
def without_polygon(boundaries: Array, b: int) -> None:
    """Mark boundary b of (n, 9) as one that belongs to no polygon and matters everywhere."""
    boundaries[b, 5] = -1.0
    boundaries[b, 6] = 0.0
    boundaries[b, 7] = 0.0
    boundaries[b, 8] = np.inf


@kernel
def with_capacity(boundaries: Array, count: int) -> Array:
    """The boundaries (n, 9), in a larger array if there are fewer than `count` rows."""
    if count <= len(boundaries):
        return boundaries
    larger = np.empty((2 * count, 9))
    for b in range(len(boundaries)):
        for column in range(9):
            larger[b, column] = boundaries[b, column]
    return larger


@kernel
def new_polygons(hulls: MaybeHulls) -> MaybePolygons:
    """An empty list of polygons; an empty tuple where there are no hulls."""
    if len(hulls) == 0:
        return ()
    return np.empty((16, 2)), np.zeros(6, np.int64), np.empty(4), np.empty((4, 3))


@kernel
def add_polygon(polygons: Polygons, q: Array, n: int, r: float) -> Polygons:
    """The polygons and one more, with corners q[:n] (m, 3) and rounded by r."""
    corners, begins, radii, around = polygons
    k = begins[0]
    start = begins[k + 1]
    if k + 1 > len(radii):
        longer = np.empty(2 * k)
        more = np.zeros(2 * k + 2, np.int64)
        wider = np.empty((2 * k, 3))
        for j in range(k):
            longer[j] = radii[j]
            wider[j, 0], wider[j, 1], wider[j, 2] = around[j, 0], around[j, 1], around[j, 2]
        for j in range(k + 2):
            more[j] = begins[j]
        begins = more
        radii = longer
        around = wider
    if start + n > len(corners):
        larger = np.empty((2 * (start + n), 2))
        for j in range(start):
            larger[j, 0], larger[j, 1] = corners[j, 0], corners[j, 1]
        corners = larger
    x = 0.0
    y = 0.0
    for j in range(n):
        corners[start + j, 0], corners[start + j, 1] = q[j, 0], q[j, 1]
        x = x + q[j, 0] / n
        y = y + q[j, 1] / n
    farthest = 0.0
    for j in range(n):
        farthest = max(farthest, np.sqrt(squared(q[j, 0] - x) + squared(q[j, 1] - y)))
    around[k, 0] = x
    around[k, 1] = y
    around[k, 2] = farthest + r
    radii[k], begins[k + 2], begins[0] = r, start + n, k + 1
    return corners, begins, radii, around


@kernel
def outside_polygons(polygons: Polygons, begin: int, end: int, x: float, y: float) -> bool:
    """Whether the control (x, y) is outside the rounded polygons begin to end - 1, up to rounding."""
    corners, begins, radii, around = polygons
    for k in range(begin, end):
        dx = x - around[k, 0]
        dy = y - around[k, 1]
        far = around[k, 2]
        if dx * dx + dy * dy >= far * far:
            continue
        # Rounding is relative to the size of the polygon and to where it is.
        size = far + abs(around[k, 0]) + abs(around[k, 1])
        keep = radii[k] - ELEMENT * size
        if keep > 0.0 and not beyond(corners, begins[k + 1], begins[k + 2], x, y, keep):
            return False
    return True


@kernel
def within_polygon(polygons: MaybePolygons, last: int, x: float, y: float) -> int:
    """The number of a rounded polygon that holds the control (x, y), or -1.

    The one that rejected the last control most likely rejects this one too: it is tested first.
    """
    if len(polygons) == 0:
        return -1
    if polygons[1][0] > 0 and not outside_polygons(polygons, last, last + 1, x, y):
        return last
    for k in range(polygons[1][0]):
        if not outside_polygons(polygons, k, k + 1, x, y):
            return k
    return -1


@kernel
def beyond(corners: Array, first: int, last: int, x: float, y: float, keep: float) -> bool:
    """Whether (x, y) is at least `keep` from the polygon with corners (n, 2) first to last - 1; inside counts as 0."""
    within = last - first > 2
    for j in range(first, last):
        k = j + 1 if j + 1 < last else first
        ax = corners[j, 0] - x
        ay = corners[j, 1] - y
        dx = corners[k, 0] - corners[j, 0]
        dy = corners[k, 1] - corners[j, 1]
        if dx * ay - dy * ax > 0.0:
            within = False
        along = min(1.0, max(0.0, -(ax * dx + ay * dy) / (dx * dx + dy * dy + 1e-300)))
        if squared(ax + along * dx) + squared(ay + along * dy) < keep * keep:
            return False
    return not within


@kernel
def add_rounded(
    boundaries: Array, admissible: int, count: int, which: int, q: Array, n: int, r: float
) -> tuple[Array, int]:
    """The boundaries (n, 9) and their number, with the circles and lines of a rounded polygon added.

    Only those that reach into the admissible set, the first `admissible` rows. `which`: its number; q[:n]: its corners.
    """
    boundaries = with_capacity(boundaries, count + 2 * n)
    smallest = smallest_ball(boundaries, admissible)
    x = boundaries[smallest, 1]
    y = boundaries[smallest, 2]
    most = boundaries[smallest, 4]
    for j in range(n):
        ax = q[j, 0]
        ay = q[j, 1]
        distance = np.sqrt(squared(ax - x) + squared(ay - y))
        # Within rounding of touching it still counts.
        slack = POLYGON_SLACK * (most + r)
        if abs(distance - r) <= most + slack:
            boundaries[count, 0] = 2.0
            boundaries[count, 1] = ax
            boundaries[count, 2] = ay
            boundaries[count, 3] = 0.0
            boundaries[count, 4] = r
            boundaries[count, 5] = which
            boundaries[count, 6] = ax
            boundaries[count, 7] = ay
            boundaries[count, 8] = r * (1.0 + POLYGON_SLACK)
            count += 1
        k = j + 1 if j + 1 < n else 0
        dx = q[k, 0] - ax
        dy = q[k, 1] - ay
        length = np.sqrt(dx * dx + dy * dy)
        if length == 0.0:
            continue
        nx = dy / length
        ny = -dx / length
        ex = ax + r * nx - x
        ey = ay + r * ny - y
        foot = -(ex * dx + ey * dy) / length
        along = min(length, max(0.0, foot)) / length
        if squared(ex + along * dx) + squared(ey + along * dy) <= squared(most + slack):
            boundaries[count, 0] = 3.0
            boundaries[count, 3] = 0.0
            boundaries[count, 1] = nx
            boundaries[count, 2] = ny
            boundaries[count, 4] = nx * ax + ny * ay + r
            boundaries[count, 5] = which
            # The disc about the part of the edge that lies within the ball.
            off = ex * ex + ey * ey - foot * foot
            half = np.sqrt(max(squared(most + slack) - off, 0.0))
            begin = max(0.0, foot - half)
            end = min(length, foot + half)
            middle = 0.5 * (begin + end) / length
            boundaries[count, 6] = x + ex + middle * dx
            boundaries[count, 7] = y + ey + middle * dy
            boundaries[count, 8] = 0.5 * (end - begin) + slack
            count += 1
    return boundaries, count
