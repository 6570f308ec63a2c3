"""Clearance and time to collision of given controls: certified, in continuous time, in the workspace."""

import numpy as np

from slalom.kernels.bezier import first_below, least, new_stack, put_gap
from slalom.kernels.compiled import Array, Indices, MaybeHulls, kernel
from slalom.kernels.hulls import hull_first_below, hull_least, load, new_course
from slalom.kernels.segments import chord_gaps
from slalom.tolerances import CLEARANCE, TIME


@kernel
def put_segment(
    stack: Array, points: Array, gains: Array, s: int, ux: float, uy: float, uz: float, floor: float
) -> None:
    """Write |relative position|^2 - floor along segment s under control u into the stack's root."""
    g0, g1, g2, g3 = gains[0, s], gains[1, s], gains[2, s], gains[3, s]
    put_gap(
        stack,
        points[0, 0, s] - g0 * ux, points[0, 1, s] - g0 * uy, points[0, 2, s] - g0 * uz,
        points[1, 0, s] - g1 * ux, points[1, 1, s] - g1 * uy, points[1, 2, s] - g1 * uz,
        points[2, 0, s] - g2 * ux, points[2, 1, s] - g2 * uy, points[2, 2, s] - g2 * uz,
        points[3, 0, s] - g3 * ux, points[3, 1, s] - g3 * uy, points[3, 2, s] - g3 * uz,
        floor,
    )  # fmt: skip


@kernel
def least_clearances(
    points: Array,
    gains: Array,
    radius: Array,
    growth: Array,
    reach: Array,
    hulls: MaybeHulls,
    owner: Indices,
    owners: int,
    controls: Array,
) -> Array:
    """Least clearance [m] to each owner for each control, (k, owners); inf for an owner without segments.

    Never above the true minimum by more than CLEARANCE.
    """
    result = np.full((len(controls), owners), np.inf)
    stack, gaps = new_stack(), np.empty(len(radius))
    course, q = new_course(hulls)
    for c in range(len(controls)):
        u = controls[c]
        chord_gaps(points, gains, u[0], u[1], u[2], gaps)
        for s in range(len(radius)):
            best = result[c, owner[s]]
            if gaps[s] - reach[s] >= best:
                continue
            if len(hulls) > 0 and hulls[0][s] >= 0:
                load(points, gains, hulls, s, u, course)
                result[c, owner[s]] = hull_least(
                    course, hulls, hulls[0][s], radius[s], growth[s], stack, q, best, CLEARANCE
                )
                continue
            ceiling = best + radius[s]
            if ceiling <= 0.0:
                # Another part of the owner is deeper inside than this one can be.
                continue
            put_segment(stack, points, gains, s, u[0], u[1], u[2], 0.0)
            found, place = least(stack, ceiling * ceiling, CLEARANCE)
            if place >= 0.0:
                result[c, owner[s]] = np.sqrt(max(found, 0.0)) - radius[s]
    return result


@kernel
def contact_times(
    begin: Array,
    end: Array,
    points: Array,
    gains: Array,
    radius: Array,
    growth: Array,
    reach: Array,
    hulls: MaybeHulls,
    owner: Indices,
    owners: int,
    controls: Array,
) -> Array:
    """Elapsed time [s] of the first contact with each owner for each control, (k, owners); inf if there is none."""
    result = np.full((len(controls), owners), np.inf)
    stack, gaps = new_stack(), np.empty(len(radius))
    course, q = new_course(hulls)
    for c in range(len(controls)):
        u = controls[c]
        chord_gaps(points, gains, u[0], u[1], u[2], gaps)
        for s in range(len(radius)):
            if begin[s] >= result[c, owner[s]] or gaps[s] >= reach[s]:
                continue
            if len(hulls) > 0 and hulls[0][s] >= 0:
                load(points, gains, hulls, s, u, course)
                place = hull_first_below(course, hulls, hulls[0][s], radius[s], growth[s], stack, q, TIME)
            else:
                put_segment(stack, points, gains, s, u[0], u[1], u[2], radius[s] * radius[s])
                place = first_below(stack, TIME)
            if place >= 0.0:
                # Segments of several parts are not in the order of time.
                result[c, owner[s]] = min(result[c, owner[s]], begin[s] + place * (end[s] - begin[s]))
    return result
