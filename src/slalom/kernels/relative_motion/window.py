"""What every decision does anew, in one pass each: pieces out of a table, segments with their radii, controls in balls.

The same could be said in a few operations on arrays, each of which costs as much as all of the loop.

Where bodies are at the begin of a window of time, seen from the robot.
"""

import numpy as np

from slalom.kernels.arrays import Array, Flags, Indices, MaybeHulls
from slalom.kernels.geometry.cubic import value
from slalom.kernels.geometry.hulls import distances
from slalom.kernels.jit import kernel
from slalom.kernels.relative_motion.segments import relative_segments
from slalom.tolerances import CONTACT, CONTACT_SLACK


@kernel
def pieces_within(
    times: Array, points: Array, radius: Array, growth: Array, turns: Array, body: Indices, start: float, end: float
) -> tuple[Array, Array, Array, Array, Array, Indices, Indices]:
    """The pieces (n, ...) that overlap start to end, with times from `start` on; turns may be (0, 4, 2).

    The last array holds the rows with which bodies begin that are there at `start`.
    """
    n, d, kept, turning = len(body), points.shape[2], 0, len(turns) > 0
    for s in range(n):
        kept += times[s, 1] > start and times[s, 0] < end
    when, where, who = np.empty((kept, 2)), np.empty((kept, 4, d)), np.empty(kept, np.int64)
    around, widening, turned = np.empty(kept), np.empty(kept), np.empty((kept if turning else 0, 4, 2))
    heads, first, k = np.empty(kept, np.int64), 0, 0
    for s in range(n):
        if not (times[s, 1] > start and times[s, 0] < end):
            continue
        when[k, 0], when[k, 1] = times[s, 0] - start, times[s, 1] - start
        for j in range(4):
            for axis in range(d):
                where[k, j, axis] = points[s, j, axis]
        if turning:
            for j in range(4):
                turned[k, j, 0], turned[k, j, 1] = turns[s, j, 0], turns[s, j, 1]
        around[k], widening[k], who[k] = radius[s], growth[s], body[s]
        if (k == 0 or who[k - 1] != who[k]) and when[k, 0] <= 0.0:
            heads[first] = k
            first += 1
        k += 1
    return when, where, around, widening, turned, who, heads[:first].copy()


@kernel
def kept_radii(gaps: Array, wider: Array) -> tuple[Array, bool]:
    """Radii (b,) [m], less where the robot touches a body already; whether it overlaps any. See `ControlObstacle`."""
    own, overlaps = np.empty(len(wider)), False
    for b in range(len(wider)):
        gap, own[b] = gaps[b], wider[b]
        # Contact is not overlap: from a body that it is within TOUCHING of, the robot may still move away.
        if gap - wider[b] >= -CONTACT and gap - wider[b] < CONTACT_SLACK:
            own[b] = max(gap - CONTACT_SLACK, 0.0)
        overlaps = overlaps or gap - own[b] < -CONTACT
    return own, overlaps


@kernel
def segments_of(
    times: Array,
    points: Array,
    radius: Array,
    growth: Array,
    turns: Array,
    body: Indices,
    knots: Array,
    drift: Array,
    gain: Array,
    horizon: float,
    error: float,
    radii: Array,
    spread: Array,
    owner: Indices,
    hull: Indices,
) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array, Indices, Indices]:
    """`relative_segments` of bodies with these radii, spreads, owners and hulls, each (b,), `error` [m] larger all.

    Returns:
        begin, end, points, gains, radius, growth, turns as there; reach, owner and hull of each segment.
    """
    around = np.empty(len(radius))
    for s in range(len(radius)):
        around[s] = radius[s] + error + radii[body[s]]
    begin, end, rel, gains, around, widening, turned, who = relative_segments(
        times, points, around, growth, turns, body, knots, drift, gain, horizon
    )
    reach, which = np.empty(len(who)), np.empty(len(who), np.int64)
    for k in range(len(who)):
        b = who[k]
        reach[k] = around[k] + max(widening[k], 0.0) + spread[b]
        who[k], which[k] = owner[b], hull[b]
    return begin, end, rel, gains, around, widening, turned, reach, who, which


@kernel
def in_balls(points: Array, centers: Array, radii: Array) -> Flags:
    """Which of the points (n, d) are in all balls about `centers` (b, d): (n,)."""
    inside = np.ones(len(points), np.bool_)
    for k in range(len(points)):
        for b in range(len(radii)):
            square = 0.0
            for axis in range(points.shape[1]):
                away = points[k, axis] - centers[b, axis]
                square += away * away
            inside[k] = inside[k] and np.sqrt(square) <= radii[b]
    return inside


@kernel
def distances_now(
    times: Array,
    points: Array,
    turns: Array,
    radius: Array,
    growth: Array,
    body: Indices,
    heads: Indices,
    unsure: Flags,
    hull: Indices,
    hulls: MaybeHulls,
    position: Array,
) -> Array:
    """Signed distance of each body at time 0 from `position` (d,) and the unit vector that attains it: (b, 4).

    Of the pieces `heads`, with which bodies begin; inf for others. Less what a body may be off where it is `unsure`.
    """
    d, n = points.shape[2], len(heads)
    places, directions, which = np.zeros((n, 3)), np.zeros((n, 2)), np.empty(n, np.int64)
    result = np.zeros((len(hull), 4))
    result[:, 0] = np.inf
    directions[:, 0] = 1.0
    for i in range(n):
        s = heads[i]
        which[i] = hull[body[s]]
        # Pieces may have begun before the window does.
        x = -times[s, 0] / (times[s, 1] - times[s, 0])
        for axis in range(d):
            p0, p1, p2, p3 = points[s, 0, axis], points[s, 1, axis], points[s, 2, axis], points[s, 3, axis]
            places[i, axis] = value(p0, p1, p2, p3, x) - position[axis]
        for axis in range(2 if len(turns) > 0 else 0):
            p0, p1, p2, p3 = turns[s, 0, axis], turns[s, 1, axis], turns[s, 2, axis], turns[s, 3, axis]
            directions[i, axis] = value(p0, p1, p2, p3, x)
    found = distances(places, directions, which, hulls)
    for i in range(n):
        s = heads[i]
        for column in range(4):
            result[body[s], column] = found[i, column]
        if unsure[body[s]]:
            # How far it may be off now is a distance, not a part of its shape.
            x = -times[s, 0] / (times[s, 1] - times[s, 0])
            result[body[s], 0] -= radius[s] + growth[s] * x
    return result
