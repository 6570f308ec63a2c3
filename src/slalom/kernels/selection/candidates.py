"""Candidates for the nearest free control: the critical points that a new element adds, and the heap of candidates.

Candidates in another element of the working set never enter the heap. Nor do those nearer to the preferred control than
the last one examined. All nearer controls were rejected, by elements that stay.

The heap is one array. Row 0 holds the number of candidates and the number of those in the heap. Candidate number n >= 1
is row n: cost, control (x, y, z), the boundaries i, j that generated it (-1 for none), and in space its place on their
curve. Column 7 of the rows from 1 on is the heap: the numbers of the candidates in it. Of candidates of equal cost
the earlier one is taken first.

One array and plain loops, since lists of tuples and `heapq` take several seconds to compile.
"""

from typing import Final, NamedTuple

import numpy as np

from slalom.base.tolerances import ADMISSIBLE
from slalom.kernels.arrays import Array
from slalom.kernels.geometry.boundaries import (
    apart,
    are_circles,
    curve_of,
    end_of_cover,
    intersect_circles,
    intersect_two,
    is_flat,
    meets,
    point_on,
    project,
)
from slalom.kernels.geometry.polygons import MaybePolygons, outside_polygons, smallest_ball, within_polygon
from slalom.kernels.jit import inlined, kernel, squared


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
    queue[0, 0] = 0.0
    queue[0, 1] = 0.0
    return queue


@kernel
def before(queue: Array, a: float, b: float) -> bool:
    """Whether candidate number a is taken before candidate number b."""
    first = queue[int(a), 0]
    second = queue[int(b), 0]
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
    queue[n, 0] = cost
    queue[n, 1] = u[0]
    queue[n, 2] = u[1]
    queue[n, 3] = u[2]
    queue[n, 4] = i
    queue[n, 5] = j
    queue[n, 6] = t
    slot = int(queue[0, 1]) + 1
    queue[0, 0] = n
    queue[0, 1] = slot
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
    first = int(queue[1, 7])
    moved = queue[size, 7]
    slot = 1
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


# The admissible set: its control nearest to a given one.
#
# `limits` (n, 5) are boundaries as in `geometry.boundaries`: balls and half-spaces to stay inside.


@kernel
def nearest_admissible(preferred: Array, limits: Array, center: Array) -> tuple[bool, bool]:
    """Whether `center` is the admissible control nearest to the preferred one, and whether that itself is admissible.

    All controls are (3,). `center` is written; it is a control near the preferred one if neither holds.
    """
    center[0] = preferred[0]
    center[1] = preferred[1]
    center[2] = preferred[2]
    if meets(limits, 0, len(limits), preferred, -1, -1):
        return True, True
    smallest = smallest_ball(limits, len(limits))
    if not distance_from_center(limits, smallest, preferred) > limits[smallest, 4]:
        return False, False
    found = np.empty((1, 3))
    project(limits, smallest, preferred, found)
    center[0] = found[0, 0]
    center[1] = found[0, 1]
    center[2] = found[0, 2]
    return meets(limits, 0, len(limits), center, smallest, -1), False


@kernel
def distance_from_center(limits: Array, b: int, u: Array) -> float:
    """The distance of control u (3,) from the centre of ball b of `limits` (n, 5)."""
    return float(np.sqrt(squared(u[0] - limits[b, 1]) + squared(u[1] - limits[b, 2]) + squared(u[2] - limits[b, 3])))


# Candidates for the nearest free control in space: points of single boundaries, and of curves in which two meet.
#
# The nearest point of "admissible and outside the working set" is the preferred control, its projection on a boundary,
# or lies on a curve in which two boundaries meet. On a curve it is the point nearest to the preferred control, or an
# end of the part that a third boundary excludes. The heap holds at most one candidate of each curve on each side of
# its nearest point. One that a boundary excludes moves on along its curve, to the end of the part that this boundary
# excludes. So the work grows with the curves that come near the optimum, never with all triples of boundaries.
#
# The rows of the heap are those of `candidates`: cost, control, boundaries i and j, and the place on their curve, see
# `geometry.curves`. Column 6 of a boundary is the value beyond which it excludes a control. It is a squared distance
# from the centre of a ball, or a product with the normal of a half-space.


SQUARED_DISTANCE_SLACK: Final = 1e-7
"""[1] Share by which a squared distance may be too small by rounding, as that of a nearly tangent intersection. Larger:
more candidates that were rejected already are examined again. Smaller: rounding loses a candidate."""


class View(NamedTuple):
    """The control from which candidates are seen, and buffers."""

    preferred: Array  # (3,)
    farthest: float  # square of the distance from it beyond which no control is admissible
    curve: Array  # (4, 3), see `geometry.curves`
    found: Array  # (1, 3)


@kernel
def new_view(limits: Array, preferred: Array) -> View:
    """The view from a preferred control (3,) on the admissible set `limits` (n, 5)."""
    smallest = smallest_ball(limits, len(limits))
    farthest = distance_from_center(limits, smallest, preferred) + limits[smallest, 4]
    return View(
        preferred.copy(), farthest * farthest * (1.0 + SQUARED_DISTANCE_SLACK), np.zeros((4, 3)), np.empty((1, 3))
    )


@kernel
def exclude_beyond(boundaries: Array, b: int, slack: float) -> None:
    """Write the value beyond which boundary b excludes a control; an element by `slack`, in units of the control."""
    r = boundaries[b, 4]
    if is_flat(boundaries, b):
        boundaries[b, 6] = r + ADMISSIBLE * (1.0 + abs(r))
    elif boundaries[b, 0] < 0.0:
        boundaries[b, 6] = squared(r * (1.0 + ADMISSIBLE) + squared(ADMISSIBLE))
    else:
        boundaries[b, 6] = squared(r - slack)


@kernel
def excludes(boundaries: Array, b: int, u: Array) -> bool:
    """Whether boundary b excludes control u (3,)."""
    side = boundaries[b, 0]
    x = boundaries[b, 1]
    y = boundaries[b, 2]
    z = boundaries[b, 3]
    if side == 0.0:
        return bool(x * u[0] + y * u[1] + z * u[2] > boundaries[b, 6])
    square = squared(u[0] - x) + squared(u[1] - y) + squared(u[2] - z)
    return bool(square < boundaries[b, 6]) if side > 0.0 else bool(square > boundaries[b, 6])


@kernel
def excluded_by(boundaries: Array, count: int, u: Array, last: int) -> int:
    """The number of one of the first `count` boundaries that excludes control u (3,), or -1.

    Number `last`, which excluded another candidate before, most likely excludes this one too: it is tested first.
    """
    if excludes(boundaries, last, u):
        return last
    for b in range(count):
        if excludes(boundaries, b, u):
            return b
    return -1


@kernel
def propose_in_space(queue: Array, boundaries: Array, count: int, view: View) -> None:
    """Put the candidates that the last boundary, number count - 1, adds into the queue (n, 8), with room for count."""
    new = count - 1
    curve = view.curve
    found = view.found
    project(boundaries, new, view.preferred, found)
    put_point(queue, view, found[0], new, -1, 0.0)
    for i in range(new):
        if apart(boundaries, i, new) or not curve_of(boundaries, i, new, view.preferred, curve):
            continue
        point_on(boundaries, i, curve, 0.0, found)
        put_point(queue, view, found[0], i, new, 0.0)


@kernel
def put_point(queue: Array, view: View, u: Array, i: int, j: int, t: float) -> None:
    """Put candidate u (3,) into the queue (n, 8), unless it is farther away than any admissible control."""
    preferred = view.preferred
    cost = squared(u[0] - preferred[0]) + squared(u[1] - preferred[1]) + squared(u[2] - preferred[2])
    if cost <= view.farthest:
        put(queue, cost, u, i, j, t)


@kernel
def move_on(queue: Array, n: int, boundaries: Array, k: int, view: View) -> Array:
    """The queue, with the next places on the curve of candidate n, which boundary k excludes.

    From the nearest point of a curve, the search continues on both sides.
    """
    queue = with_room(queue, 2)
    i = int(queue[n, 4])
    j = int(queue[n, 5])
    t = queue[n, 6]
    curve = view.curve
    found = view.found
    if j < 0 or not curve_of(boundaries, i, j, view.preferred, curve):
        return queue
    for turn in range(2):
        way = 1.0 - 2.0 * turn
        if way * t < 0.0:
            continue
        end = end_of_cover(boundaries, k, curve, t, way)
        if end > way * t and end < np.inf:
            point_on(boundaries, i, curve, way * end, found)
            if boundaries[k, 0] <= 0.0:
                project(boundaries, k, found[0], found)
            put_point(queue, view, found[0], i, j, way * end)
    return queue
