"""The dynamic window (Fox, Burgard and Thrun 1997): motions that hold a speed and a turn, and then brake to rest."""

import numpy as np

from slalom.kernels.arrays import Array, Bodies, Indices, MaybeHulls
from slalom.kernels.jit import kernel
from slalom.kernels.vehicle.body import first_contact
from slalom.kernels.vehicle.driving import held, sampled, wrapped
from slalom.kernels.vehicle.wheels import REST_WAY, Wheels

NEARER = 1e-6
"""[1] Of parts of a path at equal distances the one counts that is farther along it."""

TINY = 1e-12
"""[m^2] Square of a length below which a part of a path has no direction."""


@kernel
def way_left(m: Array, way: Array, radius: float) -> float:
    """Way [m] to the end of a polyline (n, 2) [m] from a motion (5,).

    It is the distance from the polyline, the rest of it, and what the heading has to turn, with a `radius` [m], towards
    the place on it that is a radius ahead.
    """
    n = len(way) - 1
    best = np.hypot(way[n, 0] - m[0], way[n, 1] - m[1])
    best_left = 0.0
    left = 0.0
    for j in range(n - 1, -1, -1):
        dx = way[j + 1, 0] - way[j, 0]
        dy = way[j + 1, 1] - way[j, 1]
        square = dx * dx + dy * dy
        share = min(1.0, max(0.0, ((m[0] - way[j, 0]) * dx + (m[1] - way[j, 1]) * dy) / max(square, TINY)))
        length = np.sqrt(square)
        off = np.hypot(m[0] - way[j, 0] - share * dx, m[1] - way[j, 1] - share * dy)
        rest = left + (1.0 - share) * length
        if off + NEARER * rest < best + NEARER * best_left:
            best = off
            best_left = rest
        left += length
    x = way[n, 0]
    y = way[n, 1]
    ahead = best_left - radius
    for j in range(n - 1, -1, -1):
        length = np.hypot(way[j + 1, 0] - way[j, 0], way[j + 1, 1] - way[j, 1])
        if ahead <= 0.0:
            break
        share = 1.0 - min(1.0, ahead / max(length, 1e-300))
        x = way[j, 0] + share * (way[j + 1, 0] - way[j, 0])
        y = way[j, 1] + share * (way[j + 1, 1] - way[j, 1])
        ahead -= length
    bearing = 0.0
    if x != m[0] or y != m[1]:
        bearing = abs(wrapped(np.arctan2(y - m[1], x - m[0]) - m[2]))
    return float(best + best_left + radius * min(bearing, 1.0))


@kernel
def least_left(motions: Array, way: Array, radius: float) -> float:
    """The least way [m] that is left on motions (k, 5), see `way_left`."""
    least = np.inf
    for k in range(len(motions)):
        least = min(least, way_left(motions[k], way, radius))
    return least


@kernel
def window_costs(w: Wheels, start: Array, window: Array, count: int, way: Array, radius: float) -> Array:
    """What is left of a way [m], see `way_left`, and the distance from the start [m], at the ends of motions (n, 2).

    window: (n, 3) what they hold before they brake: speed, turn and a number of periods. count: of all periods.
    """
    found = np.empty((len(window), 2))
    for i in range(len(window)):
        end = held(w, start, window[i, 0], window[i, 1], int(window[i, 2]), count)[count]
        found[i, 0] = way_left(end, way, radius)
        found[i, 1] = np.hypot(end[0] - start[0], end[1] - start[1])
    return found


@kernel
def contact_of(
    w: Wheels,
    motions: Array,
    parts: int,
    size: float,
    corners: Array,
    bodies: Bodies,
    hulls: MaybeHulls,
    keep: Array,
    advance: float,
    cap: float,
) -> float:
    """Time [s] of the first contact of a hull on motions (k, 5), see `first_contact`; `size` [m] as of `sampled`."""
    samples = sampled(w, motions, parts, size)
    step = w.period / parts
    rest = 0.0
    for k in range(len(samples) - 1):
        if samples[k, 6] > REST_WAY:
            rest = step * (k + 1)
    return first_contact(samples, step, rest, corners, bodies, hulls, keep, advance, cap)


@kernel
def first_clear(
    w: Wheels,
    start: Array,
    window: Array,
    order: Indices,
    count: int,
    parts: int,
    size: float,
    corners: Array,
    bodies: Bodies,
    hulls: MaybeHulls,
    keep: Array,
    advance: float,
    cap: float,
) -> int:
    """The first of held motions in an `order` that touches nothing, see `contact_of`; -1: none."""
    for i in order:
        motions = held(w, start, window[i, 0], window[i, 1], int(window[i, 2]), count)
        if contact_of(w, motions, parts, size, corners, bodies, hulls, keep, advance, cap) == np.inf:
            return int(i)
    return -1
