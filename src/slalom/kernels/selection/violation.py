"""The segment that rejects a control, and the place on it: the step that decides whether a control is free."""

from slalom.kernels.arrays import Array, MaybeHulls, Segments, Workspace
from slalom.kernels.geometry.cubic import below, value
from slalom.kernels.geometry.hull_bounds import least_along, put_separating
from slalom.kernels.geometry.hull_contacts import deepest_time, hull_below
from slalom.kernels.geometry.hulls import MovingHull, hull_distance, load_path
from slalom.kernels.jit import inlined
from slalom.kernels.relative_motion.clearance import deepen, depth_at, nearest_on_chord, put_segment
from slalom.kernels.relative_motion.segments import chord_distances
from slalom.tolerances import CLEARANCE, CONTACT, SMALLEST_GAIN


@inlined
def deepest_violation(table: Segments, hulls: MaybeHulls, u: Array, work: Workspace) -> int:
    """The segment that rejects u (3,) by the most, in control units; -1 if u is free, -2 if it overlaps before u acts.

    The element's place in [0, 1] on that segment, and for a ball its centre and radius, go into `work.element` (5,).
    For each colliding segment the time of deepest approach is sought from a witness. Any time of collision would do for
    correctness; a deep one makes the exchange short.
    """
    points, gains, gaps, element = table.points, table.gains, work.gaps, work.element
    worst, deepest, place = -1, 0.0, 0.0
    chord_distances(points, gains, u[0], u[1], u[2], gaps)
    for s in range(len(gaps)):
        if gaps[s] >= table.bounding_radius[s]:
            continue
        if len(hulls) > 0 and hulls.hull[s] >= 0:
            if least_along(work.separating[s], gains[:, s], u) >= -CLEARANCE:
                continue
            load_path(table, hulls, s, u, work.path)
            moving = MovingHull(work.path, hulls, hulls.hull[s], table.radius[s], table.growth[s])
            there = hull_below(moving, work.stack, work.corners)
            if there < 0.0:
                put_separating(moving, gains[:, s], u, hull_distance(moving, 0.5, work.corners), work.separating[s])
                continue
            g = value(gains[0, s], gains[1, s], gains[2, s], gains[3, s], there)
            depth = -hull_distance(moving, there, work.corners)[0] / g
        else:
            there = nearest_on_chord(table, s, u)
            depth, g = depth_at(table, s, u, there)
            if not depth > 0.0:
                continue
        if g < SMALLEST_GAIN:
            return -2
        if worst < 0 or depth > deepest:
            worst, deepest, place = s, depth, there
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
        g = value(gains[0, worst], gains[1, worst], gains[2, worst], gains[3, worst], place)
        if g < SMALLEST_GAIN:
            return -2
        for axis in range(3):
            p0, p1, p2 = points[0, axis, worst], points[1, axis, worst], points[2, axis, worst]
            element[1 + axis] = value(p0, p1, p2, points[3, axis, worst], place) / g
        element[4] = (table.radius[worst] + CONTACT) / g
    element[0] = place
    if len(hulls) > 0 and worst >= 0 and hulls.hull[worst] >= 0:
        # Costly, and therefore done for one segment only.
        load_path(table, hulls, worst, u, work.path)
        moving = MovingHull(work.path, hulls, hulls.hull[worst], table.radius[worst], table.growth[worst])
        element[0] = deepest_time(moving, gains[:, worst], work.corners, element[0])
    return worst
