"""Clearance and time to collision of given controls: certified, in continuous time, in the workspace."""

import numpy as np

from slalom.kernels.bezier import first_below, least, new_stack, put_gap
from slalom.kernels.compiled import Array, Indices, kernel
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
def least_clearances(points: Array, gains: Array, radius: Array, owner: Indices, owners: int, controls: Array) -> Array:
    """Least clearance [m] to each owner for each control, (k, owners); inf for an owner without segments.

    Never above the true minimum by more than CLEARANCE.
    """
    result = np.full((len(controls), owners), np.inf)
    stack, gaps = new_stack(), np.empty(len(radius))
    for c in range(len(controls)):
        ux, uy, uz = controls[c, 0], controls[c, 1], controls[c, 2]
        chord_gaps(points, gains, ux, uy, uz, gaps)
        for s in range(len(radius)):
            best = result[c, owner[s]]
            if gaps[s] - radius[s] >= best:
                continue
            put_segment(stack, points, gains, s, ux, uy, uz, 0.0)
            ceiling = best + radius[s]
            found, place = least(stack, ceiling * ceiling, CLEARANCE)
            if place >= 0.0:
                result[c, owner[s]] = np.sqrt(max(found, 0.0)) - radius[s]
    return result


@kernel
def contact_times(
    begin: Array, end: Array, points: Array, gains: Array, radius: Array, owner: Indices, owners: int, controls: Array
) -> Array:
    """Elapsed time [s] of the first contact with each owner for each control, (k, owners); inf if there is none."""
    result = np.full((len(controls), owners), np.inf)
    stack, gaps = new_stack(), np.empty(len(radius))
    for c in range(len(controls)):
        ux, uy, uz = controls[c, 0], controls[c, 1], controls[c, 2]
        chord_gaps(points, gains, ux, uy, uz, gaps)
        for s in range(len(radius)):
            if begin[s] >= result[c, owner[s]] or gaps[s] >= radius[s]:
                continue
            put_segment(stack, points, gains, s, ux, uy, uz, radius[s] * radius[s])
            place = first_below(stack, TIME)
            if place >= 0.0:
                result[c, owner[s]] = begin[s] + place * (end[s] - begin[s])
    return result
