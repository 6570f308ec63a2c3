"""The exact choice: the admissible control nearest to the preferred one that collides with nothing.

Exchange of elements. The working set holds the boundaries of the admissible set (balls and half-spaces, to stay
inside) and temporal elements (balls and, in the plane, rounded convex polygons, to stay outside), at first none of
these. The nearest point of "admissible and outside the working set" is among finitely many critical points: the
preferred control, its projections on single boundaries, and the nearest points of intersections of two (in space: and
three) of them. The boundaries of a rounded polygon are circles and lines. They wait in a heap by distance. The nearest
one that is admissible and outside all elements is tested in the workspace, for all time; if it collides, the element of
a worst violation joins the working set, which rejects it for good.

Every answer is at least as near as any control that keeps CONTACT clear, since the working set is always a part of
the control obstacle; the first candidate that passes the test is therefore the optimum.
"""

import numpy as np

from slalom.kernels.bezier import below, new_stack, value
from slalom.kernels.boundaries import apart, intersect_three, intersect_two, meets, project
from slalom.kernels.clearance import put_segment
from slalom.kernels.compiled import Array, Indices, MaybeHulls, kernel
from slalom.kernels.elements import hull_element, nearest_ball
from slalom.kernels.hulls import bound, excess, hull_below, hull_sink, load, new_course
from slalom.kernels.polygons import (
    MaybePolygons,
    add_polygon,
    add_rounded,
    new_boundaries,
    new_polygons,
    outside_polygons,
    smallest_ball,
    with_room,
    within_polygon,
)
from slalom.kernels.queue import new_queue, put, take
from slalom.kernels.refine import sink
from slalom.kernels.segments import chord_gaps
from slalom.tolerances import CONTACT, SMALLEST_GAIN

SAFE, BLOCKED, INADMISSIBLE, OVERLAPPING, UNDECIDED = 0, 1, 2, 3, 4


@kernel
def deepest_violation(
    points: Array,
    gains: Array,
    radius: Array,
    growth: Array,
    reach: Array,
    hulls: MaybeHulls,
    gaps: Array,
    stack: Array,
    course: Array,
    q: Array,
    u: Array,
    element: Array,
) -> int:
    """The segment that rejects u by the most, in control units; -1 if u is free, -2 if it overlaps before u matters.

    The element's place in [0, 1] on that segment, and for a ball its centre and radius, go into `element` (5,). For
    each colliding segment the time of deepest approach is sought from a witness; any time of collision would do for
    correctness, a deep one makes the exchange short.
    """
    worst, deepest = -1, 0.0
    chord_gaps(points, gains, u[0], u[1], u[2], gaps)
    for s in range(len(gaps)):
        if gaps[s] >= reach[s]:
            continue
        if len(hulls) > 0 and hulls[0][s] >= 0:
            load(points, gains, hulls, s, u, course)
            place = hull_below(course, hulls, hulls[0][s], radius[s], growth[s], stack, q)
        else:
            put_segment(stack, points, gains, s, u[0], u[1], u[2], radius[s] * radius[s])
            place = below(stack)
            if place >= 0.0:
                place = sink(points, gains, s, u, place)
        if place < 0.0:
            continue
        g = value(gains[0, s], gains[1, s], gains[2, s], gains[3, s], place)
        if g < SMALLEST_GAIN:
            return -2
        if len(hulls) > 0 and hulls[0][s] >= 0:
            depth = -excess(course, hulls, hulls[0][s], radius[s], growth[s], place, q)[0] / g
            x, y, z = 0.0, 0.0, 0.0
        else:
            x = value(points[0, 0, s], points[1, 0, s], points[2, 0, s], points[3, 0, s], place) / g
            y = value(points[0, 1, s], points[1, 1, s], points[2, 1, s], points[3, 1, s], place) / g
            z = value(points[0, 2, s], points[1, 2, s], points[2, 2, s], points[3, 2, s], place) / g
            depth = radius[s] / g - np.sqrt((x - u[0]) ** 2 + (y - u[1]) ** 2 + (z - u[2]) ** 2)
        if worst < 0 or depth > deepest:
            worst, deepest = s, depth
            element[0], element[1], element[2], element[3], element[4] = place, x, y, z, (radius[s] + CONTACT) / g
    if len(hulls) > 0 and worst >= 0 and hulls[0][worst] >= 0:
        # Costly, and therefore done for one only.
        load(points, gains, hulls, worst, u, course)
        h, r, more = hulls[0][worst], radius[worst], growth[worst]
        element[0] = hull_sink(course, gains[:, worst], hulls, h, r, more, q, element[0])
    return worst


@kernel
def within_reach(
    limits: Array, points: Array, gains: Array, radius: Array, growth: Array, reach: Array, hulls: MaybeHulls
) -> tuple[Array, Array, Array, Array, Array, MaybeHulls]:
    """The segments that some admissible control can collide on, as copies of their rows.

    All admissible controls lie within the smallest ball of `limits`; moving the control by r from its centre
    moves the robot by at most r times the largest gain of the segment.
    """
    smallest = smallest_ball(limits, len(limits))
    center, r = limits[smallest, 1:4], limits[smallest, 4]
    gaps, keep, count = np.empty(len(radius)), np.empty(len(radius), np.int64), 0
    course, q = new_course(hulls)
    chord_gaps(points, gains, center[0], center[1], center[2], gaps)
    for s in range(len(gaps)):
        farthest = r * max(max(gains[0, s], gains[1, s]), max(gains[2, s], gains[3, s]))
        if gaps[s] >= reach[s] + farthest:
            continue
        if len(hulls) > 0 and hulls[0][s] >= 0:
            # A long wall may be out of reach although the disc about it is not.
            h = hulls[0][s]
            load(points, gains, hulls, s, center, course)
            _, vx, vy, vz = excess(course, hulls, h, radius[s], growth[s], 0.5, q)
            if bound(course, hulls, h, radius[s], growth[s], 0.0, 1.0, vx, vy, vz) >= farthest:
                continue
        keep[count] = s
        count += 1
    near, gain = np.empty((4, 3, count)), np.empty((4, count))
    around, more, far = np.empty(count), np.empty(count), np.empty(count)
    for j in range(4):
        for i in range(count):
            gain[j, i] = gains[j, keep[i]]
        for axis in range(3):
            for i in range(count):
                near[j, axis, i] = points[j, axis, keep[i]]
    for i in range(count):
        around[i], more[i], far[i] = radius[keep[i]], growth[keep[i]], reach[keep[i]]
    return near, gain, around, more, far, kept_hulls(hulls, keep, count)


@kernel
def kept_hulls(hulls: MaybeHulls, keep: Indices, count: int) -> MaybeHulls:
    """The hulls of the segments keep[:count]."""
    if len(hulls) == 0:
        return ()
    hull, turns, corners, first, mixed = hulls
    which, turned = np.empty(count, np.int64), np.empty((4, 2, count))
    for i in range(count):
        which[i] = hull[keep[i]]
    if turns.shape[2] > 0:
        for j in range(4):
            for axis in range(2):
                for i in range(count):
                    turned[j, axis, i] = turns[j, axis, keep[i]]
    return which, turned, corners, first, mixed


@kernel
def push(
    queue: Array,
    boundaries: Array,
    polygons: MaybePolygons,
    admissible: int,
    preferred: Array,
    u: Array,
    i: int,
    j: int,
    k: int,
) -> Array:
    """The queue with candidate u, generated by boundaries i, j, k (-1: none), if it is admissible.

    And on the border of the polygons that it comes from: most points of their circles and lines lie within.
    """
    if len(polygons) > 0:
        which = int(boundaries[i, 5])
        if which >= 0 and not outside_polygons(polygons, which, which + 1, u[0], u[1]):
            return queue
        which = int(boundaries[j, 5]) if j >= 0 else -1
        if which >= 0 and not outside_polygons(polygons, which, which + 1, u[0], u[1]):
            return queue
    if not meets(boundaries, 0, admissible, u, i, j, k):
        return queue
    cost = (u[0] - preferred[0]) ** 2 + (u[1] - preferred[1]) ** 2 + (u[2] - preferred[2]) ** 2
    return put(queue, cost, u, i, j, k)


@kernel
def propose(
    queue: Array,
    boundaries: Array,
    polygons: MaybePolygons,
    admissible: int,
    count: int,
    preferred: Array,
    dimension: int,
    found: Array,
) -> Array:
    """The queue with the critical points that the last boundary, number count - 1, adds to those before it."""
    new = count - 1
    project(boundaries, new, preferred, found)
    queue = push(queue, boundaries, polygons, admissible, preferred, found[0], new, -1, -1)
    for i in range(new):
        if apart(boundaries, i, new):
            continue
        number = intersect_two(boundaries, i, new, preferred, dimension, found)
        for f in range(number):
            queue = push(queue, boundaries, polygons, admissible, preferred, found[f], i, new, -1)
    if dimension == 3:
        for i in range(new):
            if apart(boundaries, i, new):
                continue
            for j in range(i):
                if apart(boundaries, j, new) or apart(boundaries, i, j):
                    continue
                number = intersect_three(boundaries, j, i, new, found)
                for f in range(number):
                    queue = push(queue, boundaries, polygons, admissible, preferred, found[f], j, i, new)
    return queue


@kernel
def nearest_free(
    preferred: Array,
    dimension: int,
    limits: Array,
    points: Array,
    gains: Array,
    radius: Array,
    growth: Array,
    reach: Array,
    hulls: MaybeHulls,
    most_elements: int,
    most_candidates: int,
) -> tuple[int, Array, int, int]:
    """Nearest safe admissible control.

    Of `limits` (n, 5), see `boundaries`, and segments as in `slalom.segments`. Returns status, control (3,), elements
    used, candidates examined.
    """
    points, gains, radius, growth, reach, kept = within_reach(limits, points, gains, radius, growth, reach, hulls)
    return exchanged(
        preferred, dimension, limits, points, gains, radius, growth, reach, kept, most_elements, most_candidates
    )


@kernel
def exchanged(
    preferred: Array,
    dimension: int,
    limits: Array,
    points: Array,
    gains: Array,
    radius: Array,
    growth: Array,
    reach: Array,
    hulls: MaybeHulls,
    most_elements: int,
    most_candidates: int,
) -> tuple[int, Array, int, int]:
    """`nearest_free` of segments that are all within reach."""
    admissible = len(limits)
    boundaries, polygons, queue = new_boundaries(limits), new_polygons(hulls), new_queue()
    stack, element, found, gaps = new_stack(), np.zeros(5), np.zeros((4, 3)), np.empty(len(radius))
    course, q = new_course(hulls)
    u = preferred.copy()
    count, elements, proposed, examined, last = admissible, 0, 0, 0, 0
    if meets(boundaries, 0, admissible, u, -1, -1, -1):
        # Only if it is not admissible can the admissible set's own boundary hold the optimum: the set is convex.
        queue = put(queue, 0.0, u, -1, -1, -1)
        proposed = admissible
    while True:
        while proposed < count:
            proposed += 1
            queue = propose(queue, boundaries, polygons, admissible, proposed, preferred, dimension, found)
        n = take(queue)
        if n == 0:
            break
        examined += 1
        if examined > most_candidates:
            return UNDECIDED, u, elements, examined
        u[0], u[1], u[2] = queue[n, 1], queue[n, 2], queue[n, 3]
        rejects = within_polygon(polygons, last, u[0], u[1])
        if rejects >= 0:
            last = rejects
            continue
        if not meets(boundaries, admissible, count, u, int(queue[n, 4]), int(queue[n, 5]), int(queue[n, 6])):
            continue
        segment = deepest_violation(points, gains, radius, growth, reach, hulls, gaps, stack, course, q, u, element)
        if segment == -2:
            return OVERLAPPING, u, elements, examined
        if segment == -1:
            return SAFE, u, elements, examined
        if elements >= most_elements:
            return UNDECIDED, u, elements, examined
        elements += 1
        if len(hulls) > 0 and len(polygons) > 0 and hulls[0][segment] >= 0:
            place = element[0]
            n, r = hull_element(points, gains, radius, growth, hulls, segment, place, u, dimension, limits, course, q)
            if dimension == 3 and n > 1:
                n = nearest_ball(q, u)
            if n > 1:
                polygons = add_polygon(polygons, q, n, r)
                boundaries, count = add_rounded(boundaries, admissible, count, polygons[1][0] - 1, q, n, r)
                continue
            element[1], element[2], element[3], element[4] = q[0, 0], q[0, 1], q[0, 2], r
        boundaries = with_room(boundaries, count + 1)
        boundaries[count, 0] = 1.0
        for column in range(1, 5):
            boundaries[count, column] = element[column]
        count += 1
    return (BLOCKED if examined else INADMISSIBLE), u, elements, examined
