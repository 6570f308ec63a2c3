"""The exact choice: the admissible control nearest to the preferred one that collides with nothing.

Exchange of elements. The working set holds the boundaries of the admissible set: balls and half-spaces, to stay inside.
It also holds temporal elements, at first none: balls and, in the plane, rounded convex polygons, to stay outside. The
nearest point of "admissible and outside the working set" is among finitely many critical points. These are the
preferred control, its projections on single boundaries, and the nearest points of intersections of two of them; for
space see `propose_in_space`. The boundaries of a rounded polygon are circles and lines. A heap orders the points by
distance. The nearest one that is admissible and outside all elements is tested in the workspace, for all time. If it
collides, the element of a worst violation joins the working set, which rejects it from then on.

The working set is always a part of the control obstacle. Every result is therefore at least as near as any control that
keeps CONTACT clear. The first candidate that passes the test is therefore the optimum.
"""

from typing import Final, NamedTuple

import numpy as np

from slalom.base.tolerances import CLEARANCE, CONTACT
from slalom.kernels.arrays import Array, Indices, MaybeHulls, PositionMap, Scene, Segments, States, Workspace
from slalom.kernels.geometry.cubic import below, modulus_at, to_control, value
from slalom.kernels.geometry.hulls import (
    MovingHull,
    deepest_time,
    hull_below,
    hull_distance,
    least_along,
    load_path,
    put_separating,
)
from slalom.kernels.geometry.polygons import (
    MaybePolygons,
    add_polygon,
    add_rounded,
    new_boundaries,
    new_polygons,
    smallest_ball,
    with_capacity,
    without_polygon,
)
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.relative_motion.clearance import deepen, depth_at, nearest_on_chord, new_workspace, put_segment
from slalom.kernels.relative_motion.segments import (
    Culled,
    copy_near,
    cull,
    distance,
    hulls_of_rows,
    is_clear,
    new_hulls,
    new_table,
    put_chord_distances,
)
from slalom.kernels.relative_motion.window import distances_now, kept_radii, segments_of
from slalom.kernels.selection.candidates import (
    SQUARED_DISTANCE_SLACK,
    Reference,
    distance_from_center,
    exclude_beyond,
    excluded_by,
    excluded_in_plane,
    move_on,
    nearest_admissible,
    new_queue,
    new_view,
    propose,
    propose_in_space,
    put,
    take,
    with_room,
)
from slalom.kernels.selection.elements import hull_element, nearest_ball

# The segment that rejects a control, and the place on it: the step that decides whether a control is free.


SMALLEST_GAIN: Final = 1e-14
"""Control obstacles start where the gain exceeds this (unit of the response: s, s^2, s^3). Below it the control has no
effect yet: a collision there is an overlap at the start, which is a status of its own."""


@inlined
def put_ball(table: Segments, s: int, place: float, element: Array) -> float:
    """Write centre and radius of the ball of segment s at `place` into element (5,); the scale of its gain."""
    gain, cross = table.gains[:, s], table.cross[:, s : s + 1]
    g = modulus_at(gain, cross, place)
    points = table.points
    for axis in range(3):
        p0 = points[0, axis, s]
        p1 = points[1, axis, s]
        p2 = points[2, axis, s]
        element[1 + axis] = value(p0, p1, p2, points[3, axis, s], place)
    to_control(gain, cross, place, element[1:4])
    element[4] = (table.radius[s] + CONTACT) / g
    return float(g)


@inlined
def deepest_violation(table: Segments, hulls: MaybeHulls, u: Array, work: Workspace) -> int:
    """The segment that rejects u (3,) by the most, in control units; -1 if u is free, -2 if it overlaps before u acts.

    The element's place in [0, 1] on that segment, and for a ball its centre and radius, go into `work.element` (5,).
    For each colliding segment the time of deepest approach is sought from a witness. Any time of collision would do for
    correctness; a deep one makes the exchange short.
    """
    gaps = work.gaps
    element = work.element
    worst = -1
    deepest = 0.0
    place = 0.0
    put_chord_distances(table, u, gaps)
    for s in range(len(gaps)):
        if gaps[s] >= table.bounding_radius[s]:
            continue
        if len(hulls) > 0 and hulls.hull[s] >= 0:
            gain, cross = table.gains[:, s], table.cross[:, s : s + 1]
            if least_along(work.separating[s], gain, cross, u) >= -CLEARANCE:
                continue
            load_path(table, hulls, s, u, work.path)
            moving = MovingHull(work.path, hulls, hulls.hull[s], table.radius[s], table.growth[s])
            there, spans = hull_below(moving, work.stack, work.corners)
            work.spans[0] += spans
            if there < 0.0:
                separating = work.separating[s]
                put_separating(moving, gain, cross, u, hull_distance(moving, 0.5, work.corners), separating)
                continue
            g = modulus_at(gain, cross, there)
            depth = -hull_distance(moving, there, work.corners)[0] / g
        else:
            there = nearest_on_chord(table, s, u)
            depth, g = depth_at(table, s, u, there)
            if not depth > 0.0:
                continue
        if g < SMALLEST_GAIN:
            return -2
        if worst < 0 or depth > deepest:
            worst = s
            deepest = depth
            place = there
    if worst < 0:
        # Nothing collides where its chord is nearest: all that may collide elsewhere is decided for all times.
        for s in range(len(gaps)):
            if gaps[s] >= table.bounding_radius[s] or (len(hulls) > 0 and hulls.hull[s] >= 0):
                continue
            put_segment(work, table, s, u, table.radius[s] * table.radius[s])
            place = below(work.stack)
            if place >= 0.0:
                worst = s
                break
    if worst < 0:
        return -1
    if len(hulls) == 0 or hulls.hull[worst] < 0:
        place = deepen(table, worst, u, place)
        if put_ball(table, worst, place, element) < SMALLEST_GAIN:
            return -2
    element[0] = place
    if len(hulls) > 0 and worst >= 0 and hulls.hull[worst] >= 0:
        # Costly, and therefore done for one segment only.
        load_path(table, hulls, worst, u, work.path)
        moving = MovingHull(work.path, hulls, hulls.hull[worst], table.radius[worst], table.growth[worst])
        gain, cross = table.gains[:, worst], table.cross[:, worst : worst + 1]
        element[0] = deepest_time(moving, gain, cross, work.corners, element[0])
    return worst


CULLING_FACTOR: Final = 1.3
"""[1] Segments are copied on which controls within this many times the candidate's distance may collide. Smaller: fewer
segments are copied and tested, and copying happens more often. Results do not depend on it."""

CULLING_SHARE: Final = 0.06
"""[1] To that radius this share of the distance of the farthest admissible control is added. Smaller: as for
CULLING_FACTOR, for candidates near the centre. Results do not depend on it."""

CONTACT_SHARE: Final = 0.25
"""[1] Share of CONTACT by which a control in space may lie inside an element and count as outside. Candidates are
computed with rounding that grows with the distance and size of elements. Larger than 1: the element that rejected a
control does not exclude it. Much smaller: rounding excludes free controls."""

WORK_CURVE: Final = 30
"""[1] Work of a curve in which two boundaries in space meet, in comparisons of a control with a boundary. Larger than
its true time: choices with many elements end earlier. Smaller: they may take longer than stated."""

WORK_POINT: Final = 100
"""[1] Work of a candidate in space besides its comparisons with boundaries: see WORK_CURVE."""

MOST_WORK_IN_SPACE: Final = 4_000_000
"""[1] Most work of one choice in space, in comparisons of a control with a boundary or a segment: 10 to 25 ms. Reaching
it is a status (UNDECIDED), never an answer. Larger: a choice among hundreds of obstacles may take longer. Smaller: more
choices end undecided."""

WORK_PAIR: Final = 10
"""[1] Work of the points in which two boundaries in the plane meet: see WORK_CURVE."""

WORK_SPAN: Final = 100
"""[1] Work of a span of time that is bisected in the search for contacts with a hull: see WORK_CURVE."""

MOST_WORK_IN_PLANE: Final = 40_000_000
"""[1] Most work of one choice in the plane, in comparisons: about a second. Reaching it is a status (UNDECIDED), never
an answer. Elements cover spans in proportion to the root of CONTACT and the lengths, so bodies beyond 100 km take
thousands. Larger: decisions among these take longer. Smaller: choices among small bodies end undecided."""


SAFE = 0
BLOCKED = 1
INADMISSIBLE = 2
OVERLAPPING = 3
UNDECIDED = 4
BEYOND = 5


class ChoiceProblem(NamedTuple):
    """One choice without its obstacles."""

    dimension: int
    limits: Array  # (n, 5) the admissible set, see `geometry.boundaries`
    most_elements: int
    most_candidates: int
    within: float


@kernel
def nearest_free(
    preferred: Array,
    dimension: int,
    limits: Array,
    table: Segments,
    hulls: MaybeHulls,
    most_elements: int,
    most_candidates: int,
    within: float,
) -> tuple[int, Array, int, int]:
    """Status, nearest safe admissible control (3,), elements used, candidates examined.

    Args:
        preferred: (3,). limits: (n, 5) the admissible set, see `geometry.boundaries`.
        most_elements, most_candidates: bounds on the work; reaching one, or MOST_WORK_IN_SPACE or MOST_WORK_IN_PLANE,
            gives UNDECIDED.
        within: distance from `preferred` of the controls that count; BEYOND where none of them is free.
    """
    u = preferred.copy()
    gaps = np.empty(len(table.radius))
    center = np.empty(3)
    nearest, allowed = nearest_admissible(u, limits, center)
    if is_clear(table, center, gaps) and nearest:
        return SAFE, center, 0, 1
    smallest = smallest_ball(limits, len(limits))
    farthest = limits[smallest, 4] + distance_from_center(limits, smallest, center)
    farthest = min(farthest, within + distance(preferred, center))
    rows = np.empty(len(table.radius), np.int64)
    rows = rows[: cull(table, gaps, farthest, rows)]
    problem = ChoiceProblem(dimension, limits, most_elements, most_candidates, within)
    code, elements, examined = exchanged(u, problem, Culled(table, rows, gaps, center), hulls, farthest, allowed)
    return code, u, elements, examined


@inlined
def exchanged(
    u: Array, problem: ChoiceProblem, culled: Culled, hulls: MaybeHulls, farthest: float, allowed: bool
) -> tuple[int, int, int]:
    """Status, elements used and candidates examined of `nearest_free`; the control nearest to u (3,) goes into u.

    `farthest`: of all admissible controls from the centre of `culled`. `allowed`: whether u is admissible.
    """
    limits, in_space = problem.limits, problem.dimension == 3
    most_work = MOST_WORK_IN_SPACE if in_space else MOST_WORK_IN_PLANE
    boundaries, polygons, queue = new_boundaries(limits), new_polygons(hulls), new_queue()
    found, preferred, view = np.zeros((2, 3)), u.copy(), new_view(limits, u)
    room, known, limit = len(culled.rows), 0, -1.0
    near, near_hulls, work = new_table(room, culled.table), new_hulls(room, hulls), new_workspace(room, hulls)
    admissible = len(limits)
    count, elements, proposed, examined, last, floor, spent = admissible, 0, 0, 0, 0, 0.0, 0
    for b in range(admissible):
        exclude_beyond(boundaries, b, 0.0)
    if allowed:
        # Only if u is not admissible can the boundary of the admissible set hold the optimum: the set is convex.
        put(queue, 0.0, u, -1, -1, 0.0)
        proposed = admissible
    while True:
        while proposed < count:
            proposed += 1
            queue = with_room(queue, 2 * proposed)
            spent += proposed * (WORK_CURVE if in_space else WORK_PAIR)
            if in_space:
                propose_in_space(queue, boundaries, proposed, view)
            else:
                propose(queue, boundaries, polygons, admissible, proposed, Reference(preferred, floor), found)
        n = take(queue)
        if n == 0:
            break
        if queue[n, 0] > problem.within * problem.within:
            return BEYOND, elements, examined
        examined += 1
        if examined > problem.most_candidates or spent + WORK_SPAN * work.spans[0] > most_work:
            return UNDECIDED, elements, examined
        u[0], u[1], u[2] = queue[n, 1], queue[n, 2], queue[n, 3]
        if in_space:
            rejects = excluded_by(boundaries, count, u, last)
            spent += WORK_POINT + (rejects if rejects >= 0 else count)
            if rejects >= 0:
                last = rejects
                queue = move_on(queue, n, boundaries, rejects, view)
                continue
        else:
            # All nearer controls were rejected: a new candidate there lies in some element of the working set.
            floor = queue[n, 0] * (1.0 - SQUARED_DISTANCE_SLACK)
            excluded, last = excluded_in_plane(queue[n], boundaries, polygons, count, admissible, last)
            spent += count
            if excluded:
                continue
        moved = distance(u, culled.center)
        if moved > limit:
            limit = CULLING_FACTOR * moved + CULLING_SHARE * farthest
            known = copy_near(culled, hulls, limit, near, near_hulls, known, work)
        segment = deepest_violation(near, near_hulls, u, part_of(work, known))
        spent += known
        if segment < 0:
            return (SAFE if segment == -1 else OVERLAPPING), elements, examined
        if elements >= problem.most_elements:
            return UNDECIDED, elements, examined
        elements += 1
        rejection = Rejection(segment, u)
        boundaries, polygons, count = cut_off(boundaries, polygons, count, near, near_hulls, rejection, problem, work)
        if in_space:
            queue = move_on(queue, n, boundaries, count - 1, view)
    return (BLOCKED if elements else INADMISSIBLE), elements, examined


class Rejection(NamedTuple):
    """A control that collides, and the segment on which it does."""

    segment: int
    control: Array  # (3,)


@inlined
def part_of(work: Workspace, rows: int) -> Workspace:
    """The same buffers for the first rows of a table."""
    gaps, separating = work.gaps[:rows], work.separating[:rows]
    return Workspace(gaps, separating, work.stack, work.path, work.corners, work.element, work.spans)


@inlined
def cut_off(
    boundaries: Array,
    polygons: MaybePolygons,
    count: int,
    near: Segments,
    hulls: MaybeHulls,
    rejection: Rejection,
    problem: ChoiceProblem,
    work: Workspace,
) -> tuple[Array, MaybePolygons, int]:
    """The working set, boundaries (m, 9) and polygons, and its size, with the element of `deepest_violation` added."""
    segment = rejection.segment
    u = rejection.control
    element = work.element
    q = work.corners
    if len(hulls) > 0 and len(polygons) > 0 and hulls.hull[segment] >= 0:
        n, r = hull_element(near, hulls, segment, u, problem.dimension, problem.limits, work)
        if problem.dimension == 3 and n > 1:
            n = nearest_ball(q, u)
        if n > 1:
            polygons = add_polygon(polygons, q, n, r)
            boundaries, count = add_rounded(boundaries, len(problem.limits), count, polygons[1][0] - 1, q, n, r)
            return boundaries, polygons, count
        element[1] = q[0, 0]
        element[2] = q[0, 1]
        element[3] = q[0, 2]
        element[4] = r
    boundaries = with_capacity(boundaries, count + 1)
    boundaries[count, 0] = 1.0
    for column in range(1, 5):
        boundaries[count, column] = element[column]
    without_polygon(boundaries, count)
    g = modulus_at(near.gains[:, segment], near.cross[:, segment : segment + 1], element[0])
    exclude_beyond(boundaries, count, CONTACT_SHARE * CONTACT / g)
    return boundaries, polygons, count + 1


# Many choices in one call: the same obstacles, each robot in its own state.


@kernel
def choose_many(
    preferred: Array, states: States, scene: Scene, hulls: MaybeHulls, most_elements: int, most_candidates: int
) -> tuple[Array, Indices]:
    """Controls (n, 3) and statuses (n,) of `nearest_free` for preferred controls (n, 3) in n states.

    `hulls`: of the bodies, as in `distances_now`.
    """
    n, d = states.position.shape
    controls = np.empty((n, 3))
    statuses = np.empty(n, np.int64)
    for i in range(n):
        distances = distances_now(scene.bodies, scene.heads, hulls, states.position[i])
        radius, overlapping = kept_radii(distances[:, 0], scene.radius)
        if overlapping:
            controls[i] = preferred[i]
            statuses[i] = OVERLAPPING
            continue
        motion = PositionMap(states.knots, states.drift[i], states.gain, states.cross, len(states.gain))
        cut, bounding_radius, _, hull = segments_of(scene.bodies, radius, motion, scene.horizon, scene.error)
        table = Segments(cut.points, cut.gains, cut.cross, cut.radius, cut.growth, bounding_radius)
        limits = states.limits[i, : states.counts[i]]
        row_hulls = hulls_of_rows(hulls, hull, cut.turns)
        statuses[i], controls[i], _, _ = nearest_free(
            preferred[i], d, limits, table, row_hulls, most_elements, most_candidates, np.inf
        )
    return controls, statuses
