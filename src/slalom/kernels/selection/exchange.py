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

from slalom.kernels.arrays import Array, Indices, MaybeHulls
from slalom.kernels.geometry.boundaries import meets, project
from slalom.kernels.geometry.cubic import below, new_stack, value
from slalom.kernels.geometry.hulls import deepest_time, hull_below, hull_distance, load_path, new_path
from slalom.kernels.geometry.polygons import (
    MaybePolygons,
    add_polygon,
    add_rounded,
    new_boundaries,
    new_polygons,
    smallest_ball,
    with_capacity,
    within_polygon,
    without_polygon,
)
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.relative_motion.broad_phase import Table, copy_near, copy_row, cull, distance, is_clear, new_table
from slalom.kernels.relative_motion.clearance import deepen, depth_at, nearest_on_chord, put_segment
from slalom.kernels.relative_motion.segments import chord_distances
from slalom.kernels.selection.candidates import SQUARED_DISTANCE_SLACK, new_queue, propose, put, take
from slalom.kernels.selection.elements import hull_element, nearest_ball
from slalom.tolerances import CONTACT, SMALLEST_GAIN

CULLING_FACTOR, CULLING_SHARE = 1.3, 0.06
"""[1] Segments are looked at that controls within so many times the candidate's distance may collide on, and this share
of the farthest control's more: smaller, fewer are copied and tested; larger, more at a time."""
SAFE, BLOCKED, INADMISSIBLE, OVERLAPPING, UNDECIDED = 0, 1, 2, 3, 4


@inlined
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
    worst, deepest, place = -1, 0.0, 0.0
    chord_distances(points, gains, u[0], u[1], u[2], gaps)
    for s in range(len(gaps)):
        if gaps[s] >= reach[s]:
            continue
        if len(hulls) > 0 and hulls[0][s] >= 0:
            load_path(points, gains, hulls, s, u, course)
            there = hull_below(course, hulls, hulls[0][s], radius[s], growth[s], stack, q)
            if there < 0.0:
                continue
            g = value(gains[0, s], gains[1, s], gains[2, s], gains[3, s], there)
            depth = -hull_distance(course, hulls, hulls[0][s], radius[s], growth[s], there, q)[0] / g
        else:
            there = nearest_on_chord(points, gains, s, u)
            depth, g = depth_at(points, gains, s, u, radius[s], there)
            if not depth > 0.0:
                continue
        if g < SMALLEST_GAIN:
            return -2
        if worst < 0 or depth > deepest:
            worst, deepest, place = s, depth, there
    if worst < 0:
        # Nothing collides where its chord is nearest: all that may collide elsewhere is decided for all times.
        for s in range(len(gaps)):
            if gaps[s] >= reach[s] or (len(hulls) > 0 and hulls[0][s] >= 0):
                continue
            put_segment(stack, points, gains, s, u[0], u[1], u[2], radius[s] * radius[s])
            place = below(stack)
            if place >= 0.0:
                worst = s
                break
    if worst < 0:
        return -1
    if len(hulls) == 0 or hulls[0][worst] < 0:
        place = deepen(points, gains, worst, u, radius[worst], place)
        g = value(gains[0, worst], gains[1, worst], gains[2, worst], gains[3, worst], place)
        if g < SMALLEST_GAIN:
            return -2
        for axis in range(3):
            p0, p1, p2 = points[0, axis, worst], points[1, axis, worst], points[2, axis, worst]
            element[1 + axis] = value(p0, p1, p2, points[3, axis, worst], place) / g
        element[4] = (radius[worst] + CONTACT) / g
    element[0] = place
    if len(hulls) > 0 and worst >= 0 and hulls[0][worst] >= 0:
        # Costly, and therefore done for one only.
        load_path(points, gains, hulls, worst, u, course)
        h, r, more = hulls[0][worst], radius[worst], growth[worst]
        element[0] = deepest_time(course, gains[:, worst], hulls, h, r, more, q, element[0])
    return worst


@kernel
def segments_in_reach(
    limits: Array, points: Array, gains: Array, radius: Array, growth: Array, reach: Array, hulls: MaybeHulls
) -> tuple[Array, Array, Array, Array, Array, MaybeHulls]:
    """The segments that some admissible control can collide on, as copies of their rows.

    All admissible controls lie within the smallest ball of `limits`.
    """
    smallest = smallest_ball(limits, len(limits))
    center, gaps, which = limits[smallest, 1:4], np.empty(len(radius)), np.empty(len(radius), np.int64)
    chord_distances(points, gains, center[0], center[1], center[2], gaps)
    which = which[: cull(gains, reach, gaps, limits[smallest, 4], which)]
    table, (near, solid) = (points, gains, radius, growth, reach), new_table(len(which), hulls)
    course, q = new_path(hulls)
    count = copy_near(table, hulls, which, gaps, limits[smallest, 4], center, near, solid, 0, course, q)
    if count < len(which):
        table, hulls, (near, solid) = near, solid, new_table(count, hulls)
        for s in range(count):
            copy_row(table, hulls, s, near, solid, s)
    return near[0], near[1], near[2], near[3], near[4], solid


@kernel
def nearest_admissible(preferred: Array, limits: Array, center: Array) -> tuple[bool, bool]:
    """Whether `center` is the admissible control nearest to the preferred one, and whether that itself is admissible.

    If neither, `center` is a control near it.
    """
    center[0], center[1], center[2] = preferred[0], preferred[1], preferred[2]
    if meets(limits, 0, len(limits), preferred, -1, -1, -1):
        return True, True
    smallest = smallest_ball(limits, len(limits))
    if not apart_by(limits, smallest, preferred) > limits[smallest, 4]:
        return False, False
    found = np.empty((1, 3))
    project(limits, smallest, preferred, found)
    center[0], center[1], center[2] = found[0, 0], found[0, 1], found[0, 2]
    return meets(limits, 0, len(limits), center, smallest, -1, -1), False


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

    Of `limits` (n, 5), see `boundaries`, and segments as in `slalom.relative_motion`. Returns status, control (3,),
    elements used, candidates examined.
    """
    u, gaps, center = preferred.copy(), np.empty(len(radius)), np.empty(3)
    nearest, allowed = nearest_admissible(u, limits, center)
    if is_clear(points, gains, reach, center, gaps) and nearest:
        return SAFE, center, 0, 1
    smallest = smallest_ball(limits, len(limits))
    farthest = limits[smallest, 4] + apart_by(limits, smallest, center)
    which = np.empty(len(radius), np.int64)
    which = which[: cull(gains, reach, gaps, farthest, which)]
    table = (points, gains, radius, growth, reach)
    code, elements, examined = exchanged(
        u, dimension, limits, table, hulls, which, gaps, center, farthest, allowed, most_elements, most_candidates
    )
    return code, u, elements, examined


@kernel
def apart_by(limits: Array, b: int, u: Array) -> float:
    """How far u is from the centre of ball b."""
    return float(np.sqrt((u[0] - limits[b, 1]) ** 2 + (u[1] - limits[b, 2]) ** 2 + (u[2] - limits[b, 3]) ** 2))


@inlined
def exchanged(
    u: Array,
    dimension: int,
    limits: Array,
    table: Table,
    hulls: MaybeHulls,
    which: Indices,
    away: Array,
    center: Array,
    farthest: float,
    allowed: bool,
    most_elements: int,
    most_candidates: int,
) -> tuple[int, int, int]:
    """`nearest_free` to u, into u.

    Of the segments `which` of a table, on which only controls so far `away` from `center` collide: see `near`.
    """
    boundaries, polygons, queue = new_boundaries(limits), new_polygons(hulls), new_queue()
    stack, element, found, preferred = new_stack(), np.zeros(5), np.zeros((4, 3)), u.copy()
    course, q = new_path(hulls)
    (near, solid), known, limit, gaps = new_table(len(which), hulls), 0, -1.0, np.empty(len(which))
    admissible = len(limits)
    count, elements, proposed, examined, last, floor = admissible, 0, 0, 0, 0, 0.0
    if allowed:
        # Only if it is not admissible can the admissible set's own boundary hold the optimum: the set is convex.
        queue = put(queue, 0.0, u, -1, -1, -1)
        proposed = admissible
    while True:
        while proposed < count:
            proposed += 1
            queue = propose(queue, boundaries, polygons, admissible, proposed, preferred, floor, dimension, found)
        n = take(queue)
        if n == 0:
            break
        examined += 1
        if examined > most_candidates:
            return UNDECIDED, elements, examined
        u[0], u[1], u[2] = queue[n, 1], queue[n, 2], queue[n, 3]
        # All that is nearer was rejected: a new candidate there lies in some element of the working set.
        floor = queue[n, 0] * (1.0 - SQUARED_DISTANCE_SLACK)
        rejects = within_polygon(polygons, last, u[0], u[1])
        if rejects >= 0:
            last = rejects
            continue
        # It was found to meet those before the last of the boundaries that generated it.
        newest = max(int(max(max(queue[n, 4], queue[n, 5]), queue[n, 6])), admissible - 1)
        if not meets(boundaries, newest + 1, count, u, -1, -1, -1):
            continue
        moved = distance(u, center)
        if moved > limit:
            limit = CULLING_FACTOR * moved + CULLING_SHARE * farthest
            known = copy_near(table, hulls, which, away, limit, center, near, solid, known, course, q)
        points, gains, radius, growth, reach = near
        segment = deepest_violation(
            points, gains, radius, growth, reach, solid, gaps[:known], stack, course, q, u, element
        )
        if segment < 0:
            return (SAFE if segment == -1 else OVERLAPPING), elements, examined
        if elements >= most_elements:
            return UNDECIDED, elements, examined
        elements += 1
        boundaries, polygons, count = cut_off(
            boundaries, polygons, count, near, solid, segment, element, u, dimension, limits, course, q
        )
    return (BLOCKED if examined else INADMISSIBLE), elements, examined


@inlined
def cut_off(
    boundaries: Array,
    polygons: MaybePolygons,
    count: int,
    near: Table,
    hulls: MaybeHulls,
    segment: int,
    element: Array,
    u: Array,
    dimension: int,
    limits: Array,
    course: Array,
    q: Array,
) -> tuple[Array, MaybePolygons, int]:
    """The working set and how many boundaries it has with the element that rejects u, of `deepest_violation`."""
    points, gains, radius, growth, _ = near
    if len(hulls) > 0 and len(polygons) > 0 and hulls[0][segment] >= 0:
        place = element[0]
        n, r = hull_element(points, gains, radius, growth, hulls, segment, place, u, dimension, limits, course, q)
        if dimension == 3 and n > 1:
            n = nearest_ball(q, u)
        if n > 1:
            polygons = add_polygon(polygons, q, n, r)
            boundaries, count = add_rounded(boundaries, len(limits), count, polygons[1][0] - 1, q, n, r)
            return boundaries, polygons, count
        element[1], element[2], element[3], element[4] = q[0, 0], q[0, 1], q[0, 2], r
    boundaries = with_capacity(boundaries, count + 1)
    boundaries[count, 0] = 1.0
    for column in range(1, 5):
        boundaries[count, column] = element[column]
    without_polygon(boundaries, count)
    return boundaries, polygons, count + 1
