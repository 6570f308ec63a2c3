"""Clearance of a body that turns with its vehicle: a rounded convex hull on a sampled motion among bodies.

Conservative advancement (Mirtich 1996): two bodies at a distance d whose points approach by at most v each second do
not touch within d / v. The distance is computed at the end of that time again, and so on.
"""

import numpy as np

from slalom.kernels.arrays import Array, Bodies, Indices, MaybeHulls
from slalom.kernels.geometry.cubic import value
from slalom.kernels.jit import kernel
from slalom.kernels.vehicle.driving import held, sampled, wrapped
from slalom.kernels.vehicle.wheels import REST_WAY, Hull, Wheels

NOT_NEARER = 0.003
"""[1] How much nearer than if it stayed a vehicle may come to what counts only while it moves, in sizes of its body.
Larger: nearer by that much in each decision. Smaller: rounding of its motion counts as approach."""


@kernel
def to_edge(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Square of the distance [m^2] of a point from the segment from a to b."""
    dx = bx - ax
    dy = by - ay
    along = ((px - ax) * dx + (py - ay) * dy) / (dx * dx + dy * dy + 1e-300)
    along = min(1.0, max(0.0, along))
    x = px - ax - along * dx
    y = py - ay - along * dy
    return x * x + y * y


@kernel
def beyond_edges(p: Array, n: int, q: Array, m: int) -> float:
    """How far q[:m] (k, 2) [m] is beyond the line of an edge of the hull p[:n], counter-clockwise, at most.

    -inf for a point. Both lines of a segment count.
    """
    most = -np.inf
    for i in range(n if n > 1 else 0):
        k = i + 1 if i + 1 < n else 0
        ex = p[k, 1] - p[i, 1]
        ey = p[i, 0] - p[k, 0]
        length = np.hypot(ex, ey)
        if length == 0.0:
            continue
        least = np.inf
        for j in range(m):
            least = min(least, ex * (q[j, 0] - p[i, 0]) + ey * (q[j, 1] - p[i, 1]))
        most = max(most, least / length)
    return most


@kernel
def separation(p: Array, n: int, q: Array, m: int) -> float:
    """Signed distance [m] of two convex hulls p[:n] and q[:m] (k, 2), counter-clockwise: minus the depth of an overlap.

    The depth is the least translation that separates them, which is along the normal of an edge.
    """
    outside = max(beyond_edges(p, n, q, m), beyond_edges(q, m, p, n))
    if -np.inf < outside < 0.0:
        return outside
    least = np.inf
    for i in range(n):
        for j in range(m):
            k = j + 1 if j + 1 < m else 0
            least = min(least, to_edge(p[i, 0], p[i, 1], q[j, 0], q[j, 1], q[k, 0], q[k, 1]))
            k = i + 1 if i + 1 < n else 0
            least = min(least, to_edge(q[j, 0], q[j, 1], p[i, 0], p[i, 1], p[k, 0], p[k, 1]))
    return float(np.sqrt(least))


@kernel
def put_corners(x: float, y: float, heading: float, corners: Array, into: Array) -> None:
    """The corners (c, 2) [m] of a body at a position and a heading, into (c, 2)."""
    c = np.cos(heading)
    s = np.sin(heading)
    for i in range(len(corners)):
        into[i, 0] = x + c * corners[i, 0] - s * corners[i, 1]
        into[i, 1] = y + s * corners[i, 0] + c * corners[i, 1]


@kernel
def exact_gap(
    pose: Array, corners: Array, bodies: Bodies, hulls: MaybeHulls, s: int, x: float, p: Array, q: Array
) -> float:
    """Signed distance [m] of a hull at a pose from the hull of piece s at the share x of it; p, q: for corners."""
    pieces = bodies.pieces
    b = pieces.body[s]
    put_corners(pose[0], pose[1], pose[2], corners, p)
    q[0, 0] = value(pieces.points[s, 0, 0], pieces.points[s, 1, 0], pieces.points[s, 2, 0], pieces.points[s, 3, 0], x)
    q[0, 1] = value(pieces.points[s, 0, 1], pieces.points[s, 1, 1], pieces.points[s, 2, 1], pieces.points[s, 3, 1], x)
    n = 1
    if len(hulls) > 0 and bodies.hull[b] >= 0:
        ox = q[0, 0]
        oy = q[0, 1]
        ex = 1.0
        ey = 0.0
        if len(pieces.turns) > 0:
            t = pieces.turns
            ex = value(t[s, 0, 0], t[s, 1, 0], t[s, 2, 0], t[s, 3, 0], x)
            ey = value(t[s, 0, 1], t[s, 1, 1], t[s, 2, 1], t[s, 3, 1], x)
        h = bodies.hull[b]
        begin = hulls.first[h]
        n = hulls.first[h + 1] - begin
        for j in range(n):
            k = begin + j
            q[j, 0] = ox + hulls.corners[k, 0] + hulls.corners[k, 3] * ex - hulls.corners[k, 4] * ey
            q[j, 1] = oy + hulls.corners[k, 1] + hulls.corners[k, 3] * ey + hulls.corners[k, 4] * ex
    return separation(p, len(corners), q, n)


@kernel
def gap(
    pose: Array, size: float, corners: Array, bodies: Bodies, hulls: MaybeHulls, s: int, x: float, p: Array, q: Array
) -> float:
    """As `exact_gap`, or less where the hulls are far apart: then the distance of the balls around them.

    size: [m] radius of the ball about the position of the pose that contains the corners.
    """
    points = bodies.pieces.points
    dx = value(points[s, 0, 0], points[s, 1, 0], points[s, 2, 0], points[s, 3, 0], x) - pose[0]
    dy = value(points[s, 0, 1], points[s, 1, 1], points[s, 2, 1], points[s, 3, 1], x) - pose[1]
    around = size + bodies.each[bodies.pieces.body[s]].hull_radius
    far = np.sqrt(dx * dx + dy * dy) - around
    if far > around:
        return float(far)
    return exact_gap(pose, corners, bodies, hulls, s, x, p, q)


@kernel
def size_of(corners: Array) -> float:
    """Radius [m] of the ball about the origin that contains the corners (c, 2) [m]."""
    square = 0.0
    for i in range(len(corners)):
        square = max(square, corners[i, 0] * corners[i, 0] + corners[i, 1] * corners[i, 1])
    return float(np.sqrt(square))


@kernel
def buffers(corners: Array, hulls: MaybeHulls) -> tuple[Array, Array]:
    """Buffers for the corners of the body of a vehicle, and of any hull."""
    most = 1
    if len(hulls) > 0:
        for h in range(len(hulls.first) - 1):
            most = max(most, hulls.first[h + 1] - hulls.first[h])
    return np.empty((len(corners), 2)), np.empty((most, 2))


@kernel
def pose_gaps(pose: Array, corners: Array, bodies: Bodies, hulls: MaybeHulls) -> Array:
    """Distance (b,) [m] of a hull at a pose (3,) from each body now; its radius and uncertainty are subtracted.

    inf for a body that does not exist now.
    """
    found = np.full(len(bodies.each), np.inf)
    p, q = buffers(corners, hulls)
    pieces = bodies.pieces
    for b in range(len(found)):
        s = bodies.first_piece[b]
        if s < bodies.first_piece[b + 1] and pieces.times[s, 0] <= 0.0:
            width = pieces.times[s, 1] - pieces.times[s, 0]
            x = -pieces.times[s, 0] / width
            radius = bodies.each[b].radius + pieces.radius[s] + pieces.growth[s] * x
            found[b] = exact_gap(pose, corners, bodies, hulls, s, x, p, q) - radius
    return found


@kernel
def approach_speed(bodies: Bodies, s: int) -> float:
    """Largest speed [m/s] with which a point of the surface of a body moves on its piece s."""
    pieces = bodies.pieces
    width = pieces.times[s, 1] - pieces.times[s, 0]
    most = 0.0
    turn = 0.0
    for j in range(3):
        dx = pieces.points[s, j + 1, 0] - pieces.points[s, j, 0]
        dy = pieces.points[s, j + 1, 1] - pieces.points[s, j, 1]
        most = max(most, np.hypot(dx, dy))
        if len(pieces.turns) > 0:
            ex = pieces.turns[s, j + 1, 0] - pieces.turns[s, j, 0]
            ey = pieces.turns[s, j + 1, 1] - pieces.turns[s, j, 1]
            turn = max(turn, np.hypot(ex, ey))
    b = pieces.body[s]
    return float((3.0 * (most + turn * bodies.each[b].hull_radius) + max(0.0, pieces.growth[s])) / width)


@kernel
def put_pose(samples: Array, step: float, k: int, x: float, pose: Array) -> None:
    """The pose (3,) at the share x after the row k of samples (n, 7) `step` [s] apart: cubic Hermite pieces."""
    y = 1.0 - x
    for axis in range(3):
        a = samples[k, axis]
        b = samples[k + 1, axis]
        first = a + step * samples[k, 3 + axis] / 3.0
        last = b - step * samples[k + 1, 3 + axis] / 3.0
        pose[axis] = y * y * y * a + 3.0 * y * x * (y * first + x * last) + x * x * x * b


@kernel
def first_contact(samples: Array, step: float, rest: float, hull: Hull, bodies: Bodies, hulls: MaybeHulls) -> float:
    """Time [s] of the first contact of a hull on a motion with a body; inf if there is none before the end.

    samples: (n, 7) as of `driving.sampled`, `step` [s] apart. rest: [s] from which on contacts do not count that count
    only while the robot moves. Those bodies may come nearer than `Hull.keep` where they would come as near to a hull
    that stays; that is tested at the rows of samples.
    """
    corners = hull.corners
    keep = hull.keep
    p, q = buffers(corners, hulls)
    size = size_of(corners)
    pieces = bodies.pieces
    last = len(samples) - 2
    first = np.inf
    end = min((last + 1) * step, hull.cap)
    pose = np.empty(3)
    for b in range(len(bodies.each)):
        until = end if bodies.each[b].at_rest else min(end, rest)
        for s in range(bodies.first_piece[b], bodies.first_piece[b + 1]):
            t0 = pieces.times[s, 0]
            width = pieces.times[s, 1] - t0
            t = max(t0, 0.0)
            stop = min(pieces.times[s, 1], until)
            speed = approach_speed(bodies, s)
            k = min(int(t / step), last)
            while t < stop:
                while k < last and (k + 1) * step <= t:
                    k += 1
                put_pose(samples, step, k, min(1.0, t / step - k), pose)
                share = (t - t0) / width
                radius = bodies.each[b].radius + pieces.radius[s] + pieces.growth[s] * share
                left = gap(pose, size, corners, bodies, hulls, s, share, p, q) - radius - keep[b]
                if left < 0.0 and not bodies.each[b].at_rest:
                    here = gap(samples[0, :3], size, corners, bodies, hulls, s, share, p, q) - radius
                    if here - (left + keep[b]) <= NOT_NEARER * size:
                        t = stop if k == last else min((k + 1) * step, stop)
                        continue
                if left < 0.0:
                    first = t
                    end = t
                    break
                left = max(left, hull.advance)
                while t < stop and left > 0.0:
                    while k < last and (k + 1) * step <= t:
                        k += 1
                    boundary = stop if k == last else min((k + 1) * step, stop)
                    rate = speed + samples[k, 6] / step
                    if rate * (boundary - t) <= left:
                        left -= rate * (boundary - t)
                        t = boundary
                    else:
                        t += left / rate
                        left = 0.0
            if first <= t:
                break
    return first


# The dynamic window (Fox, Burgard and Thrun 1997): motions that hold a speed and a turn, and then brake to rest.


NEARER = 1e-6
"""[1] Of parts of a path at equal distances the one counts that is farther along it."""

TINY = 1e-12
"""[m^2] Square of a length below which a part of a path has no direction."""


@kernel
def way_left(m: Array, way: Array, radius: float, driven: float) -> float:
    """Way [m] to the end of a polyline (n, 2) [m] from a motion (5,) after `driven` [m] from its start.

    It is the distance from the part of the polyline that may be driven so far, the rest of it, and what the heading has
    to turn, with a `radius` [m], towards the place on it that is a radius ahead. So parts that come back near the start
    are not nearer along the way.
    """
    n = len(way) - 1
    rest = 0.0
    for j in range(n):
        rest += np.hypot(way[j + 1, 0] - way[j, 0], way[j + 1, 1] - way[j, 1])
    begin = rest
    best = np.hypot(way[n, 0] - m[0], way[n, 1] - m[1]) if begin <= driven else np.inf
    best_left = 0.0
    left = 0.0
    for j in range(n - 1, -1, -1):
        dx = way[j + 1, 0] - way[j, 0]
        dy = way[j + 1, 1] - way[j, 1]
        square = dx * dx + dy * dy
        length = np.sqrt(square)
        begin = begin - length if j > 0 else 0.0
        if begin <= driven:
            share = ((m[0] - way[j, 0]) * dx + (m[1] - way[j, 1]) * dy) / max(square, TINY)
            share = min(1.0, (driven - begin) / max(length, 1e-300), max(0.0, share))
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
    driven = 0.0
    for k in range(len(motions)):
        driven += step_length(motions, k)
        least = min(least, way_left(motions[k], way, radius, driven))
    return least


@kernel
def step_length(motions: Array, k: int) -> float:
    """Distance [m] of motion k from the one before; 0 for the first one."""
    before = max(k - 1, 0)
    return float(np.hypot(motions[k, 0] - motions[before, 0], motions[k, 1] - motions[before, 1]))


@kernel
def window_costs(w: Wheels, start: Array, window: Array, count: int, way: Array, radius: float) -> Array:
    """What is left of a way [m], see `way_left`, and the distance from the start [m], at the ends of motions (n, 2).

    window: (n, 3) what they hold before they brake: speed, turn and a number of periods. count: of all periods.
    """
    found = np.empty((len(window), 2))
    for i in range(len(window)):
        motions = held(w, start, window[i, 0], window[i, 1], int(window[i, 2]), count)
        driven = 0.0
        for k in range(count + 1):
            driven += step_length(motions, k)
        end = motions[count]
        found[i, 0] = way_left(end, way, radius, driven)
        found[i, 1] = np.hypot(end[0] - start[0], end[1] - start[1])
    return found


@kernel
def contact_of(w: Wheels, motions: Array, hull: Hull, bodies: Bodies, hulls: MaybeHulls) -> float:
    """Time [s] of the first contact of a hull on motions (k, 5), see `first_contact`."""
    samples = sampled(w, motions, hull.parts, hull.rounded)
    step = w.period / hull.parts
    rest = 0.0
    for k in range(len(samples) - 1):
        if samples[k, 6] > REST_WAY:
            rest = step * (k + 1)
    return first_contact(samples, step, rest, hull, bodies, hulls)


@kernel
def first_clear(
    w: Wheels, start: Array, window: Array, order: Indices, count: int, hull: Hull, bodies: Bodies, hulls: MaybeHulls
) -> int:
    """The first of held motions in an `order` that touches nothing, see `contact_of`; -1: none."""
    for i in order:
        motions = held(w, start, window[i, 0], window[i, 1], int(window[i, 2]), count)
        if contact_of(w, motions, hull, bodies, hulls) == np.inf:
            return int(i)
    return -1
