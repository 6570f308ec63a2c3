"""Clearance, time to collision and the deepest time of given controls: certified, in continuous time."""

from typing import Final

import numpy as np

from slalom.base.tolerances import CLEARANCE, TIME
from slalom.kernels.arrays import Array, Indices, MaybeHulls, Segments, Workspace
from slalom.kernels.geometry.cubic import (
    curvature,
    first_below,
    image,
    least,
    modulus_at,
    new_stack,
    put_distance,
    slope,
    value,
)
from slalom.kernels.geometry.hulls import MovingHull, hull_first_below, hull_least, load_path, new_path
from slalom.kernels.jit import kernel
from slalom.kernels.relative_motion.segments import put_chord_distances

NEWTON_STEPS: Final = 6
"""[1] Most steps of Newton's method towards the deepest time of a ball; it converges quadratically. Larger: never
needed. Smaller: elements are less deep, and the exchange takes longer."""

NEWTON_ACCURACY: Final = 1e-4
"""[1] Share of a segment below which a Newton step ends the search. Larger: elements are less deep. Smaller: a step
more that changes only rounding."""


@kernel
def new_workspace(segments: int, hulls: MaybeHulls) -> Workspace:
    """Buffers for a table of so many segments with those hulls."""
    path, corners = new_path(hulls)
    separating = np.empty((segments if len(hulls) > 0 else 0, 7))
    for s in range(len(separating)):
        separating[s, 3] = -np.inf
    return Workspace(np.empty(segments), separating, new_stack(), path, corners, np.zeros(5), np.zeros(1, np.int64))


@kernel
def put_segment(work: Workspace, table: Segments, s: int, u: Array, floor: float) -> None:
    """Write |relative position|^2 - floor along segment s under control u (3,) into the root of the work's stack."""
    p = work.path
    points = table.points
    for j in range(4):
        for axis in range(3):
            p[j, axis] = points[j, axis, s] - image(table.gains, table.cross, j, s, u, axis)
    put_distance(work.stack, p, floor)


@kernel
def least_clearances(table: Segments, hulls: MaybeHulls, owner: Indices, owners: int, controls: Array) -> Array:
    """Least clearance [m] to each owner for each of the controls (k, 3): (k, owners); inf without segments.

    Never above the true minimum by more than CLEARANCE. `owner` (n,): of each segment.
    """
    result = np.full((len(controls), owners), np.inf)
    radius = table.radius
    work = new_workspace(len(radius), hulls)
    for c in range(len(controls)):
        u = controls[c]
        put_chord_distances(table, u, work.gaps)
        for s in range(len(radius)):
            best = result[c, owner[s]]
            if work.gaps[s] - table.bounding_radius[s] >= best:
                continue
            if len(hulls) > 0 and hulls.hull[s] >= 0:
                load_path(table, hulls, s, u, work.path)
                moving = MovingHull(work.path, hulls, hulls.hull[s], radius[s], table.growth[s])
                result[c, owner[s]] = hull_least(moving, work.stack, work.corners, best, CLEARANCE)
                continue
            ceiling = best + radius[s]
            if ceiling <= 0.0:
                # Another part of the owner is deeper inside than this one can be.
                continue
            put_segment(work, table, s, u, 0.0)
            found, place = least(work.stack, ceiling * ceiling, CLEARANCE)
            if place >= 0.0:
                result[c, owner[s]] = np.sqrt(max(found, 0.0)) - radius[s]
    return result


@kernel
def contact_times(
    begin: Array, end: Array, table: Segments, hulls: MaybeHulls, owner: Indices, owners: int, controls: Array
) -> Array:
    """Time [s] of the first contact with each owner for each of the controls (k, 3): (k, owners); inf without one.

    `begin`, `end` (n,) [s], `owner` (n,): of each segment.
    """
    result = np.full((len(controls), owners), np.inf)
    radius = table.radius
    work = new_workspace(len(radius), hulls)
    for c in range(len(controls)):
        u = controls[c]
        put_chord_distances(table, u, work.gaps)
        for s in range(len(radius)):
            if begin[s] >= result[c, owner[s]] or work.gaps[s] >= table.bounding_radius[s]:
                continue
            if len(hulls) > 0 and hulls.hull[s] >= 0:
                load_path(table, hulls, s, u, work.path)
                moving = MovingHull(work.path, hulls, hulls.hull[s], radius[s], table.growth[s])
                place = hull_first_below(moving, work.stack, work.corners, TIME)
            else:
                put_segment(work, table, s, u, radius[s] * radius[s])
                place = first_below(work.stack, TIME)
            if place >= 0.0:
                # Segments of several parts are not in the order of time.
                result[c, owner[s]] = min(result[c, owner[s]], begin[s] + place * (end[s] - begin[s]))
    return result


@kernel
def nearest_on_chord(table: Segments, k: int, u: Array) -> float:
    """The place in [0, 1] at which the chord of segment k is nearest to the robot under control u (3,)."""
    points = table.points
    along = 0.0
    square = 1e-300
    for axis in range(3):
        a = points[0, axis, k] - image(table.gains, table.cross, 0, k, u, axis)
        d = points[3, axis, k] - image(table.gains, table.cross, 3, k, u, axis) - a
        along -= a * d
        square += d * d
    return float(min(1.0, max(0.0, along / square)))


@kernel
def depth_at(table: Segments, k: int, u: Array, s: float) -> tuple[float, float]:
    """The depth of u (3,) inside the element of segment k at s, in control units, negative outside; and the gain.

    Of a cross gain the modulus of both.
    """
    points = table.points
    gain = modulus_at(table.gains[:, k], table.cross[:, k : k + 1], s)
    turned = table.cross.shape[1] > 0
    square = 0.0
    for axis in range(3):
        q = value(points[0, axis, k], points[1, axis, k], points[2, axis, k], points[3, axis, k], s)
        if turned:
            u0 = image(table.gains, table.cross, 0, k, u, axis)
            u1 = image(table.gains, table.cross, 1, k, u, axis)
            u2 = image(table.gains, table.cross, 2, k, u, axis)
            q -= value(u0, u1, u2, image(table.gains, table.cross, 3, k, u, axis), s)
        else:
            q -= u[axis] * gain
        square += q * q
    return (table.radius[k] - np.sqrt(square)) / gain, gain


@kernel
def deepen(table: Segments, k: int, u: Array, s: float) -> float:
    """A place near s in [0, 1] at which u (3,) is no less deep inside the element of segment k, see `depth_at`.

    By a few steps of Newton's method on (radius - |p - g u|) / g. The element of that place holds all controls that are
    nearer to u than its depth. Where elements sweep along, their envelope touches it. With a cross gain s itself.
    """
    if table.cross.shape[1] > 0:
        return s
    points = table.points
    gains = table.gains
    here = depth_at(table, k, u, s)[0]
    for _ in range(NEWTON_STEPS):
        g0 = gains[0, k]
        g1 = gains[1, k]
        g2 = gains[2, k]
        g3 = gains[3, k]
        gain = value(g0, g1, g2, g3, s)
        rise = slope(g0, g1, g2, g3, s)
        bend = curvature(g0, g1, g2, g3, s)
        square = 1e-300
        first = 0.0
        second = 0.0
        for axis in range(3):
            p0 = points[0, axis, k]
            p1 = points[1, axis, k]
            p2 = points[2, axis, k]
            p3 = points[3, axis, k]
            q = value(p0, p1, p2, p3, s) - u[axis] * gain
            v = slope(p0, p1, p2, p3, s) - u[axis] * rise
            w = curvature(p0, p1, p2, p3, s) - u[axis] * bend
            square += q * q
            first += q * v
            second += v * v + q * w
        length = np.sqrt(square)
        # Derivatives of the length, then of the depth.
        first, second = first / length, (second - first * first / square) / length
        first = -(first + rise * here) / gain
        second = -(second + bend * here + 2.0 * rise * first) / gain
        step = -first / second if second < 0.0 else (0.5 if first > 0.0 else -0.5)
        trial = min(1.0, max(0.0, s + step))
        there = depth_at(table, k, u, trial)[0]
        while there < here and abs(trial - s) > NEWTON_ACCURACY:
            trial = 0.5 * (trial + s)
            there = depth_at(table, k, u, trial)[0]
        if there <= here:
            break
        moved = abs(trial - s)
        s = trial
        here = there
        if moved < NEWTON_ACCURACY:
            # Steps shrink quadratically: the next one would be rounding.
            break
    return s
