"""Candidates for the nearest free control: the critical points that a new element adds, and the heap of candidates.

Candidates in another element of the working set never enter the heap. Nor do those nearer to the preferred control than
the last one examined. All nearer controls were rejected, by elements that stay.

The heap is one array. Row 0 holds the number of candidates and the number of those in the heap. Candidate number n >= 1
is row n: cost, control (x, y, z), the boundaries i, j that generated it (-1 for none), and in space its place on their
curve. Column 7 of the rows from 1 on is the heap: the numbers of the candidates in it. Of candidates of equal cost
the earlier one is taken first.

One array and plain loops, since lists of tuples and `heapq` take several seconds to compile.
"""

from typing import NamedTuple

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.geometry.boundaries import (
    apart,
    are_circles,
    intersect_circles,
    intersect_two,
    meets,
    project,
)
from slalom.kernels.geometry.polygons import MaybePolygons, outside_polygons, within_polygon
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.squared import squared


class Reference(NamedTuple):
    """The control to which candidates shall be near."""

    preferred: Array  # (3,)
    floor: float  # square of the distance from it below which all controls were rejected


@kernel
def push(
    queue: Array,
    boundaries: Array,
    polygons: MaybePolygons,
    last: int,
    reference: Reference,
    u: Array,
    generators: tuple[int, int],
) -> None:
    """Put candidate u (3,) into the queue (n, 8), if it is admissible; `generators`: boundaries i, j, -1 for none.

    It must lie on the border of the polygons that generated it: most points of their circles and lines lie within.
    Only the first `last` boundaries (m, 9) are tested.
    """
    preferred = reference.preferred
    cost = squared(u[0] - preferred[0]) + squared(u[1] - preferred[1]) + squared(u[2] - preferred[2])
    if cost < reference.floor:
        return
    i, j = generators
    if len(polygons) > 0:
        which = int(boundaries[i, 5])
        if which >= 0 and not outside_polygons(polygons, which, which + 1, u[0], u[1]):
            return
        which = int(boundaries[j, 5]) if j >= 0 else -1
        if which >= 0 and not outside_polygons(polygons, which, which + 1, u[0], u[1]):
            return
    if meets(boundaries, 0, last, u, i, j):
        put(queue, cost, u, i, j, 0.0)


@inlined
def excluded_in_plane(
    candidate: Array, boundaries: Array, polygons: MaybePolygons, count: int, admissible: int, last: int
) -> tuple[bool, int]:
    """Whether one of the first `count` boundaries (m, 9), or a polygon, excludes a row of the heap; its number.

    `last`: of the polygon that excluded another one before. The first `admissible` boundaries bound the admissible set.
    """
    rejects = within_polygon(polygons, last, candidate[1], candidate[2])
    if rejects >= 0:
        return True, rejects
    # It was found to meet those before the last of the boundaries that generated it.
    newest = max(int(max(candidate[4], candidate[5])), admissible - 1)
    return not meets(boundaries, newest + 1, count, candidate[1:4], -1, -1), last


@inlined
def propose(
    queue: Array,
    boundaries: Array,
    polygons: MaybePolygons,
    admissible: int,
    count: int,
    reference: Reference,
    found: Array,
) -> None:
    """Put the critical points that the last boundary in the plane, number count - 1, adds into the queue (n, 8).

    It has room for 2 count of them. The first `admissible` of the boundaries (m, 9) bound the admissible set. `found`
    (2, 3) is a buffer.
    """
    new = count - 1
    last = max(new, admissible)
    project(boundaries, new, reference.preferred, found)
    push(queue, boundaries, polygons, last, reference, found[0], (new, -1))
    for i in range(new):
        if apart(boundaries, i, new):
            continue
        if are_circles(boundaries, i, new):
            number = intersect_circles(boundaries, i, new, found)
        else:
            number = intersect_two(boundaries, i, new, found)
        for f in range(number):
            push(queue, boundaries, polygons, last, reference, found[f], (i, new))


@kernel
def new_queue() -> Array:
    """An empty heap (128, 8)."""
    queue = np.empty((128, 8))
    queue[0, 0], queue[0, 1] = 0.0, 0.0
    return queue


@kernel
def before(queue: Array, a: float, b: float) -> bool:
    """Whether candidate number a is taken before candidate number b."""
    first, second = queue[int(a), 0], queue[int(b), 0]
    return bool(first < second or (first == second and a < b))


@kernel
def with_room(queue: Array, more: int) -> Array:
    """The queue (n, 8), in a larger array if there is no room for so many `more` candidates."""
    used = int(queue[0, 0]) + 1
    if used + more <= len(queue):
        return queue
    larger = np.empty((2 * (used + more), 8))
    for row in range(used):
        for column in range(8):
            larger[row, column] = queue[row, column]
    return larger


@kernel
def put(queue: Array, cost: float, u: Array, i: int, j: int, t: float) -> None:
    """Put candidate u (3,) into the queue (n, 8), which has room for it."""
    n = int(queue[0, 0]) + 1
    queue[n, 0], queue[n, 1], queue[n, 2], queue[n, 3] = cost, u[0], u[1], u[2]
    queue[n, 4], queue[n, 5], queue[n, 6] = i, j, t
    slot = int(queue[0, 1]) + 1
    queue[0, 0], queue[0, 1] = n, slot
    while slot > 1 and before(queue, n, queue[slot // 2, 7]):
        queue[slot, 7] = queue[slot // 2, 7]
        slot //= 2
    queue[slot, 7] = n


@inlined
def take(queue: Array) -> int:
    """The number of the candidate of least cost, removed from the heap (n, 8); 0 if the heap is empty."""
    size = int(queue[0, 1])
    if size == 0:
        return 0
    first, moved, slot = int(queue[1, 7]), queue[size, 7], 1
    size -= 1
    queue[0, 1] = size
    while 2 * slot <= size:
        child = 2 * slot
        if child < size and before(queue, queue[child + 1, 7], queue[child, 7]):
            child += 1
        if before(queue, moved, queue[child, 7]):
            break
        queue[slot, 7] = queue[child, 7]
        slot = child
    queue[slot, 7] = moved
    return first
