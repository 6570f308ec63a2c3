"""Tables of one decision, each made in a single pass: pieces within a window, segments, distances now.

The same operations written with numpy cost as much for each of a dozen small arrays as one of these loops.
"""

from typing import Final

import numpy as np

from slalom.base.tolerances import BALL_ROUNDING, CONTACT, CONTACT_SLACK, OVERLAP
from slalom.kernels.arrays import Array, Bodies, CutPieces, Flags, Indices, MaybeHulls, Pieces, PositionMap
from slalom.kernels.geometry.cubic import restrict, value
from slalom.kernels.geometry.hulls import distances
from slalom.kernels.jit import kernel, squared
from slalom.kernels.relative_motion.segments import bounding_radii, relative_segments

# The rule of contact, once: when a robot overlaps a body, and how much of a margin it keeps near one.
#
# Contact is not overlap. A robot within CONTACT_SLACK of a body, and at most OVERLAP deep in it, touches the body and
# may still move away. Farther away the robot keeps the margin, or the level of its present clearance: at once less by
# CONTACT_SLACK, since a control leads away from a body only in time, and in full from the next decision on. The next
# clearance is then above the same level by more than rounding: a chain of decisions loses at most one level.


LEVEL: Final = 8.0 * CONTACT
"""[m] Distance of the levels of clearance. They lie between whole multiples of it, which users choose as margins.

A robot may not rest within half of CONTACT above a level. Larger: such places are rarer, and chains lose more.
"""


@kernel
def overlaps(clearance: float) -> bool:
    """Whether a robot with this clearance [m] overlaps a body."""
    return clearance < -OVERLAP


@kernel
def kept_margin(clearance: float, margin: float, error: float) -> tuple[float, float]:
    """The parts [m] of `margin` [m] that a robot with this clearance [m], margin not counted, keeps now and then.

    Then: from the next decision on. The robot stays half of CONTACT above the level of its clearance by its pieces,
    whose `error` [m] a choice adds. Both are negative where the robot touches the body.
    """
    level = LEVEL * (np.floor(clearance / LEVEL - 0.5) + 0.5)
    then = min(level + 0.5 * CONTACT - error, margin)
    return min(clearance - CONTACT_SLACK, then), then


@kernel
def kept_radius(distance: float, radius: float) -> float:
    """The radius [m] of a body at `distance` [m]: `radius`, margin included, or less where the robot touches it."""
    if distance - radius >= -OVERLAP and distance - radius < CONTACT_SLACK:
        return max(distance - CONTACT_SLACK, 0.0)
    return radius


# Tables of one decision, each made in a single pass: pieces within a window, segments, distances now.


@kernel
def rows_within(times: Array, begin: int, end: int, start: float, until: float) -> tuple[int, int]:
    """The rows of `begin` to `end` that overlap the interval from `start` to `until` [s], as first and last + 1.

    times: (n, 2) [s], increasing in these rows.
    """
    if not until > start:
        return begin, begin
    low = begin
    high = end
    while low < high:
        middle = (low + high) // 2
        if times[middle, 1] > start:
            high = middle
        else:
            low = middle + 1
    first = low
    while low < end and times[low, 0] < until:
        low += 1
    return first, low


@kernel
def copy_restricted(p: Array, a: float, b: float, into: Array) -> None:
    """Write the part of a cubic from a to b in [0, 1] into `into` (4, d); p: its control points (4, d)."""
    for axis in range(p.shape[1]):
        if a > 0.0 or b < 1.0:
            found = restrict(p[0, axis], p[1, axis], p[2, axis], p[3, axis], a, b)
            into[0, axis], into[1, axis], into[2, axis], into[3, axis] = found
        else:
            for j in range(4):
                into[j, axis] = p[j, axis]


@kernel
def copy_cut(pieces: Pieces, s: int, start: float, until: float, into: Pieces, k: int) -> bool:
    """Write piece s, cut to the time from `start` to `until` [s], into row k of `into`, with times from `start` on.

    Returns whether a part of it was cut off.
    """
    times = pieces.times
    begin = max(times[s, 0], start)
    end = min(times[s, 1], until)
    width = times[s, 1] - times[s, 0]
    first = (begin - times[s, 0]) / width
    last = (end - times[s, 0]) / width
    copy_restricted(pieces.points[s], first, last, into.points[k])
    if len(into.turns) > 0:
        copy_restricted(pieces.turns[s], first, last, into.turns[k])
    into.times[k, 0] = begin - start
    into.times[k, 1] = end - start
    into.radius[k] = pieces.radius[s] + pieces.growth[s] * first
    into.growth[k] = pieces.growth[s] * (last - first)
    return bool(first > 0.0 or last < 1.0)


@kernel
def pieces_within(
    pieces: Pieces, balls: Array, first: Indices, some: Indices, start: float, until: Array
) -> tuple[Pieces, Array, Indices]:
    """The pieces of the bodies `some` (b,) from `start` [s] to `until` (b,) [s] after it, with times from `start` on.

    With their `piece_balls` (m, 4) [m], from those of all pieces (n, 4), and the first row of each body (b + 1,). Body
    k of the table has the rows first[k] to first[k + 1].
    """
    times = pieces.times
    turning = len(pieces.turns) > 0
    d = pieces.points.shape[2]
    count = len(some)
    kept = 0
    rows = np.empty((count, 2), np.int64)
    for b in range(count):
        k = some[b]
        rows[b, 0], rows[b, 1] = rows_within(times, first[k], first[k + 1], start, start + until[b])
        kept += rows[b, 1] - rows[b, 0]
    found = Pieces(
        np.empty((kept, 2)),
        np.empty((kept, 4, d)),
        np.empty(kept),
        np.zeros(kept),
        np.empty((kept if turning else 0, 4, 2)),
        np.empty(kept, np.int64),
    )
    found_first = np.zeros(count + 1, np.int64)
    k = 0
    found_balls = np.empty((kept, 4))
    for b in range(count):
        found_first[b + 1] = found_first[b] + rows[b, 1] - rows[b, 0]
        for s in range(rows[b, 0], rows[b, 1]):
            found.body[k] = b
            if copy_cut(pieces, s, start, start + until[b], found, k):
                put_ball(found, k, found_balls[k])
            else:
                for axis in range(4):
                    found_balls[k, axis] = balls[s, axis]
            k += 1
    return found, found_balls, found_first


@kernel
def put_ball(pieces: Pieces, s: int, ball: Array) -> None:
    """Write the ball of row s, see `piece_balls`, into `ball` (4,) [m]."""
    square = 0.0
    d = pieces.points.shape[2]
    for axis in range(3):
        ball[axis] = 0.0
    for axis in range(d):
        p0 = pieces.points[s, 0, axis]
        p1 = pieces.points[s, 1, axis]
        p2 = pieces.points[s, 2, axis]
        p3 = pieces.points[s, 3, axis]
        low = min(min(p0, p1), min(p2, p3))
        high = max(max(p0, p1), max(p2, p3))
        ball[axis] = 0.5 * (low + high)
        square += squared(high - ball[axis])
    size = np.sqrt(square) + pieces.radius[s] + max(pieces.growth[s], 0.0)
    ball[3] = size * (1.0 + BALL_ROUNDING) + BALL_ROUNDING


@kernel
def piece_balls(pieces: Pieces) -> Array:
    """Balls (n, 4) [m] that hold the body's origin during each piece: centre, and radius with that of the piece."""
    balls = np.empty((len(pieces.body), 4))
    for s in range(len(pieces.body)):
        put_ball(pieces, s, balls[s])
    return balls


@kernel
def body_balls(balls: Array, first: Indices, size: Array) -> Array:
    """Balls (b, 4) [m] that hold each body, of `size` (b,) [m] about its origin, during all its pieces.

    `balls` (n, 4) [m] are those of the pieces; body k has the rows first[k] to first[k + 1]. The radius of a body
    without pieces is -inf.
    """
    found = np.empty((len(size), 4))
    for b in range(len(size)):
        found[b, 3] = -np.inf
        for axis in range(3):
            low = np.inf
            high = -np.inf
            for s in range(first[b], first[b + 1]):
                low = min(low, balls[s, axis])
                high = max(high, balls[s, axis])
            found[b, axis] = 0.5 * (low + high)
        for s in range(first[b], first[b + 1]):
            square = 0.0
            for axis in range(3):
                square += squared(balls[s, axis] - found[b, axis])
            reach = (np.sqrt(square) + balls[s, 3] + size[b]) * (1.0 + BALL_ROUNDING) + BALL_ROUNDING
            found[b, 3] = max(found[b, 3], reach)
    return found


@kernel
def balls_near(balls: Array, position: Array, distance: float) -> Indices:
    """Numbers (m,) of the `balls` (n, 4) [m] that are no farther from `position` (d,) [m] than `distance` [m]."""
    near = np.empty(len(balls), np.int64)
    count = 0
    for b in range(len(balls)):
        square = 0.0
        reach = balls[b, 3] + distance
        for axis in range(len(position)):
            square += squared(balls[b, axis] - position[axis])
        if reach >= 0.0 and square <= reach * reach:
            near[count] = b
            count += 1
    return near[:count].copy()


@kernel
def kept_radii(distance: Array, radius: Array) -> tuple[Array, bool]:
    """Radii (b,) [m] of bodies at `distance` (b,) [m], reduced where the robot touches them; whether it overlaps one.

    The rule is `contact.kept_radius`.
    """
    own = np.empty(len(radius))
    overlapping = False
    for b in range(len(radius)):
        own[b] = kept_radius(distance[b], radius[b])
        overlapping = overlapping or overlaps(distance[b] - own[b])
    return own, overlapping


@kernel
def segments_of(
    bodies: Bodies, own_radius: Array, motion: PositionMap, horizon: float, error: float
) -> tuple[CutPieces, Array, Indices, Indices]:
    """The segments of bodies with `own_radius` (b,) [m] each, all larger by `error` [m], up to `horizon` [s].

    Returns:
        The cut pieces, and of each: bounding radius (n,) [m], owner (n,), hull (n,).
    """
    pieces = bodies.pieces
    radius = np.empty(len(pieces.radius))
    for s in range(len(radius)):
        radius[s] = pieces.radius[s] + error + own_radius[pieces.body[s]]
    grown = Pieces(pieces.times, pieces.points, radius, pieces.growth, pieces.turns, pieces.body)
    cut = relative_segments(grown, motion, horizon)
    owner = np.empty(len(cut.body), np.int64)
    hull = np.empty(len(cut.body), np.int64)
    for k in range(len(owner)):
        owner[k], hull[k] = bodies.each[cut.body[k]].owner, bodies.hull[cut.body[k]]
    hull_radius = np.empty(len(bodies.each))
    for b in range(len(hull_radius)):
        hull_radius[b] = bodies.each[b].hull_radius
    return cut, bounding_radii(cut, hull_radius), owner, hull


@kernel
def in_balls(points: Array, centers: Array, radii: Array) -> Flags:
    """Flags (n,): which of the points (n, d) lie in all balls with `centers` (b, d) and `radii` (b,)."""
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
def places_now(pieces: Pieces, heads: Indices, position: Array) -> tuple[Array, Array]:
    """Places (h, 3) [m] of bodies on the pieces `heads` (h,) at time 0 from `position` (d,), and directions (h, 2)."""
    places = np.zeros((len(heads), 3))
    directions = np.zeros((len(heads), 2))
    directions[:, 0] = 1.0
    for i in range(len(heads)):
        s = heads[i]
        x = share_of_piece(pieces.times, s)
        for axis in range(pieces.points.shape[2]):
            p = pieces.points[s, :, axis]
            places[i, axis] = value(p[0], p[1], p[2], p[3], x) - position[axis]
        for axis in range(2 if len(pieces.turns) > 0 else 0):
            p = pieces.turns[s, :, axis]
            directions[i, axis] = value(p[0], p[1], p[2], p[3], x)
    return places, directions


@kernel
def distances_now(bodies: Bodies, heads: Indices, hulls: MaybeHulls, position: Array) -> Array:
    """Signed distance [m] of each body from `position` (d,) [m] at time 0, and the unit vector to it: (b, 4).

    Infinite for bodies without one of those `heads` (h,), see `Bodies.heads`. Less the uncertainty of the position
    where the body has one: that is a distance, not a part of its shape.
    """
    pieces = bodies.pieces
    result = np.zeros((len(bodies.hull), 4))
    result[:, 0] = np.inf
    places, directions = places_now(pieces, heads, position)
    found = distances(places, directions, bodies.hull[pieces.body[heads]], hulls)
    for i in range(len(heads)):
        s = heads[i]
        b = pieces.body[s]
        for column in range(4):
            result[b, column] = found[i, column]
        if bodies.each[b].uncertain:
            result[b, 0] -= pieces.radius[s] + pieces.growth[s] * share_of_piece(pieces.times, s)
    return result


@kernel
def bodies_at_rest(pieces: Pieces, count: int) -> Flags:
    """Flags (b,): which of `count` bodies do not move on any of their pieces."""
    still = np.ones(count, np.bool_)
    for s in range(len(pieces.body)):
        for j in range(1, 4):
            for axis in range(pieces.points.shape[2]):
                if pieces.points[s, j, axis] != pieces.points[s, 0, axis]:
                    still[pieces.body[s]] = False
    return still


@kernel
def covered_at_rest(bodies: Bodies, heads: Indices, hulls: MaybeHulls, points: Array, margin: float) -> Flags:
    """Flags (k,): which of the points (k, d) [m] are closer than the margin [m] to a body that does not move.

    Bodies begin with `heads` (h,), see `Bodies.heads`.
    """
    pieces = bodies.pieces
    balls = bodies.balls
    still = bodies_at_rest(pieces, len(bodies.each))
    covered = np.zeros(len(points), np.bool_)
    near = np.empty(len(heads), np.int64)
    for k in range(len(points)):
        count = 0
        for s in heads:
            b = pieces.body[s]
            square = 0.0
            for axis in range(points.shape[1]):
                square += squared(balls[s, axis] - points[k, axis])
            reach = balls[s, 3] + bodies.each[b].radius + bodies.each[b].hull_radius + margin
            if still[b] and square <= reach * reach:
                near[count] = s
                count += 1
        if count > 0:
            found = distances_now(bodies, near[:count], hulls, points[k])
            for s in near[:count]:
                b = pieces.body[s]
                covered[k] = covered[k] or found[b, 0] < bodies.each[b].radius + margin
    return covered


@kernel
def share_of_piece(times: Array, s: int) -> float:
    """Place of time 0 in [0, 1] on piece s with `times` (n, 2) [s]: pieces may begin before the window."""
    return float(-times[s, 0] / (times[s, 1] - times[s, 0]))


# The rule of speed limits, once: a robot above its maximum speed cannot obey it at once.


OVERSPEED_BRAKING: Final = 0.5
"""[1] Share of its maximum acceleration with which a robot above its maximum speed must at least brake.

Larger: fewer manoeuvres are admissible. Smaller: it stays too fast for longer. At 0 it need not brake.
"""


@kernel
def allowed_speed(max_speed: float, speed: float, max_deceleration: float, duration: float) -> float:
    """The largest admissible speed [m/s] after `duration` [s], for a robot with this speed [m/s] now.

    It is `max_speed` [m/s]. For a robot above it, the share OVERSPEED_BRAKING of full braking, `max_deceleration`
    [m/s^2], must have reduced the speed.
    """
    return max(max_speed, speed - OVERSPEED_BRAKING * max_deceleration * duration)
