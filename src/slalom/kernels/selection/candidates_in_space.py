"""Candidates for the nearest free control in space: points of single boundaries, and of curves in which two meet.

The nearest point of "admissible and outside the working set" is the preferred control, its projection on a boundary, or
lies on a curve in which two boundaries meet. On a curve it is the point nearest to the preferred control, or an end of
the part that a third boundary excludes. The heap holds at most one candidate of each curve on each side of its nearest
point. One that a boundary excludes moves on along its curve, to the end of the part that this boundary excludes. So the
work grows with the curves that come near the optimum, never with all triples of boundaries.

The rows of the heap are those of `candidates`: cost, control, boundaries i and j, and the place on their curve, see
`geometry.curves`. Column 6 of a boundary is the value beyond which it excludes a control. It is a squared distance from
the centre of a ball, or a product with the normal of a half-space.
"""

from typing import NamedTuple

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.geometry.boundaries import apart, is_flat, project
from slalom.kernels.geometry.curves import curve_of, end_of_cover, point_on
from slalom.kernels.geometry.polygons import smallest_ball
from slalom.kernels.jit import kernel
from slalom.kernels.selection.admissible import distance_from_center
from slalom.kernels.selection.candidates import put
from slalom.kernels.squared import squared
from slalom.tolerances import ADMISSIBLE, SQUARED_DISTANCE_SLACK


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
    side, x, y, z = boundaries[b, 0], boundaries[b, 1], boundaries[b, 2], boundaries[b, 3]
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
    new, curve, found = count - 1, view.curve, view.found
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
def move_on(queue: Array, n: int, boundaries: Array, k: int, view: View) -> None:
    """Put the next places on the curve of candidate n, which boundary k excludes, into the queue, with room for two.

    From the nearest point of a curve, the search continues on both sides.
    """
    i, j, t = int(queue[n, 4]), int(queue[n, 5]), queue[n, 6]
    curve, found = view.curve, view.found
    if j < 0 or not curve_of(boundaries, i, j, view.preferred, curve):
        return
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
