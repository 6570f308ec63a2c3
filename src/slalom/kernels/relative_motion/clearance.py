"""Clearance and time to collision of given controls: certified, in continuous time, in the workspace.

The time at which a control is deepest inside an obstacle: from the chord, then by Newton's method.
"""

import numpy as np

from slalom.kernels.arrays import Array, Indices, MaybeHulls
from slalom.kernels.geometry.cubic import curvature, first_below, least, new_stack, put_gap, slope, value
from slalom.kernels.geometry.hulls import hull_first_below, hull_least, load_path, new_path
from slalom.kernels.jit import kernel
from slalom.kernels.relative_motion.segments import chord_distances
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
    course, q = new_path(hulls)
    for c in range(len(controls)):
        u = controls[c]
        chord_distances(points, gains, u[0], u[1], u[2], gaps)
        for s in range(len(radius)):
            best = result[c, owner[s]]
            if gaps[s] - reach[s] >= best:
                continue
            if len(hulls) > 0 and hulls[0][s] >= 0:
                load_path(points, gains, hulls, s, u, course)
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
    course, q = new_path(hulls)
    for c in range(len(controls)):
        u = controls[c]
        chord_distances(points, gains, u[0], u[1], u[2], gaps)
        for s in range(len(radius)):
            if begin[s] >= result[c, owner[s]] or gaps[s] >= reach[s]:
                continue
            if len(hulls) > 0 and hulls[0][s] >= 0:
                load_path(points, gains, hulls, s, u, course)
                place = hull_first_below(course, hulls, hulls[0][s], radius[s], growth[s], stack, q, TIME)
            else:
                put_segment(stack, points, gains, s, u[0], u[1], u[2], radius[s] * radius[s])
                place = first_below(stack, TIME)
            if place >= 0.0:
                # Segments of several parts are not in the order of time.
                result[c, owner[s]] = min(result[c, owner[s]], begin[s] + place * (end[s] - begin[s]))
    return result


@kernel
def nearest_on_chord(points: Array, gains: Array, k: int, u: Array) -> float:
    """The place in [0, 1] at which the chord of segment k is nearest to the robot under control u."""
    g0, g3 = gains[0, k], gains[3, k]
    along, square = 0.0, 1e-300
    for axis in range(3):
        a = points[0, axis, k] - g0 * u[axis]
        d = points[3, axis, k] - g3 * u[axis] - a
        along -= a * d
        square += d * d
    return float(min(1.0, max(0.0, along / square)))


@kernel
def depth_at(points: Array, gains: Array, k: int, u: Array, radius: float, s: float) -> tuple[float, float]:
    """How deep u is inside the element of segment k at s, in control units and negative outside; and the gain."""
    gain, square = value(gains[0, k], gains[1, k], gains[2, k], gains[3, k], s), 0.0
    for axis in range(3):
        q = value(points[0, axis, k], points[1, axis, k], points[2, axis, k], points[3, axis, k], s) - u[axis] * gain
        square += q * q
    return (radius - np.sqrt(square)) / gain, gain


@kernel
def deepen(points: Array, gains: Array, k: int, u: Array, radius: float, s: float) -> float:
    """A place near s in [0, 1] at which u is no less deep inside the element of segment k, see `depth_at`.

    By a few steps of Newton's method on (radius - |p - g u|) / g. The element of that place holds all controls that are
    nearer to u than its depth; where elements sweep along, their envelope touches it.
    """
    here = depth_at(points, gains, k, u, radius, s)[0]
    for _ in range(6):
        g0, g1, g2, g3 = gains[0, k], gains[1, k], gains[2, k], gains[3, k]
        gain, rise, bend = value(g0, g1, g2, g3, s), slope(g0, g1, g2, g3, s), curvature(g0, g1, g2, g3, s)
        square, first, second = 1e-300, 0.0, 0.0
        for axis in range(3):
            p0, p1, p2, p3 = points[0, axis, k], points[1, axis, k], points[2, axis, k], points[3, axis, k]
            q = value(p0, p1, p2, p3, s) - u[axis] * gain
            v = slope(p0, p1, p2, p3, s) - u[axis] * rise
            w = curvature(p0, p1, p2, p3, s) - u[axis] * bend
            square += q * q
            first += q * v
            second += v * v + q * w
        length = np.sqrt(square)
        # Of the length, then of the depth.
        first, second = first / length, (second - first * first / square) / length
        first = -(first + rise * here) / gain
        second = -(second + bend * here + 2.0 * rise * first) / gain
        step = -first / second if second < 0.0 else (0.5 if first > 0.0 else -0.5)
        trial = min(1.0, max(0.0, s + step))
        there = depth_at(points, gains, k, u, radius, trial)[0]
        while there < here and abs(trial - s) > 1e-4:
            trial = 0.5 * (trial + s)
            there = depth_at(points, gains, k, u, radius, trial)[0]
        if there <= here:
            break
        moved = abs(trial - s)
        s, here = trial, there
        if moved < 1e-4:
            # Steps shrink quadratically: the next one would be rounding.
            break
    return s
