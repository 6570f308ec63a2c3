"""Clearance and time to collision of given controls: certified, in continuous time, in the workspace."""

import numpy as np

from slalom.kernels.bezier import first_below, least, new_stack, put_gap
from slalom.kernels.compiled import kernel
from slalom.kernels.segments import chord_gap
from slalom.tolerances import CLEARANCE, TIME


@kernel
def put_segment(stack, points, gains, s, ux, uy, uz, floor):  # type: ignore[no-untyped-def]
    """Write |relative position|^2 - floor along segment s under control u into the stack's root."""
    g0, g1, g2, g3 = gains[s, 0], gains[s, 1], gains[s, 2], gains[s, 3]
    p = points[s]
    put_gap(
        stack,
        p[0, 0] - g0 * ux, p[0, 1] - g0 * uy, p[0, 2] - g0 * uz,
        p[1, 0] - g1 * ux, p[1, 1] - g1 * uy, p[1, 2] - g1 * uz,
        p[2, 0] - g2 * ux, p[2, 1] - g2 * uy, p[2, 2] - g2 * uz,
        p[3, 0] - g3 * ux, p[3, 1] - g3 * uy, p[3, 2] - g3 * uz,
        floor,
    )  # fmt: skip


@kernel
def least_clearances(points, gains, radius, owner, owners, controls):  # type: ignore[no-untyped-def]
    """Least clearance [m] to each owner for each control, (k, owners); inf for an owner without segments.

    Never above the true minimum by more than CLEARANCE.
    """
    result = np.full((len(controls), owners), np.inf)
    stack = new_stack()
    for c in range(len(controls)):
        ux, uy, uz = controls[c, 0], controls[c, 1], controls[c, 2]
        for s in range(len(points)):
            best = result[c, owner[s]]
            if chord_gap(points, gains, s, ux, uy, uz) - radius[s] >= best:
                continue
            put_segment(stack, points, gains, s, ux, uy, uz, 0.0)
            ceiling = best + radius[s]
            found, place = least(stack, ceiling * ceiling, CLEARANCE)
            if place >= 0.0:
                result[c, owner[s]] = np.sqrt(max(found, 0.0)) - radius[s]
    return result


@kernel
def contact_times(begin, end, points, gains, radius, owner, owners, controls):  # type: ignore[no-untyped-def]
    """Elapsed time [s] of the first contact with each owner for each control, (k, owners); inf if there is none."""
    result = np.full((len(controls), owners), np.inf)
    stack = new_stack()
    for c in range(len(controls)):
        ux, uy, uz = controls[c, 0], controls[c, 1], controls[c, 2]
        for s in range(len(points)):
            if begin[s] >= result[c, owner[s]] or chord_gap(points, gains, s, ux, uy, uz) >= radius[s]:
                continue
            put_segment(stack, points, gains, s, ux, uy, uz, radius[s] * radius[s])
            place = first_below(stack, TIME)
            if place >= 0.0:
                result[c, owner[s]] = begin[s] + place * (end[s] - begin[s])
    return result
