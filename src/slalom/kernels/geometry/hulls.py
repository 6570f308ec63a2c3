"""Rounded convex hulls along a segment: their corners and signed distances.

The hull's corners move on cubics: the origin's, plus each corner turned by the direction e. Points come in two forms:
`path` (4, 5), the control points of origin (x, y, z) and direction (ex, ey) for one control, and `q` (n, 3), the
corners at one time, in the plane counter-clockwise.
"""

from typing import Final, NamedTuple, TypeAlias

import numpy as np

from slalom.base.tolerances import CLEARANCE, CONTACT, CONTACT_SLACK, RESOLVED
from slalom.kernels.arrays import Array, Direction, Hulls, Indices, MaybeHulls, Segments
from slalom.kernels.geometry.cubic import LEAST_WIDTH, image, modulus_at, restrict, value
from slalom.kernels.jit import kernel, squared

# The signed distance of the origin to the convex hull of a few points.


SHORT: Final = 3e-8
"""[1] Share of the largest length in a hull below which the direction of a distance is that across its nearest edge.
The direction of a difference d of lengths L is off by about 1e-16 L / d, which moves the other end of the edge by 1e-16
L^2 / d: by less than d if d exceeds 1e-8 L. Larger: directions near corners are off by more. Smaller than about 1e-8:
no bound along such a direction decides, and bisections halve each span to the last digit. In the plane only: in space
bodies are round."""


@kernel
def to_segment(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    """The point of the segment from a to b nearest to the origin."""
    dx = bx - ax
    dy = by - ay
    dz = bz - az
    along = -(ax * dx + ay * dy + az * dz) / (dx * dx + dy * dy + dz * dz + 1e-300)
    along = min(1.0, max(0.0, along))
    return ax + along * dx, ay + along * dy, az + along * dz


@kernel
def signed_distance(q: Array, n: int) -> Direction:
    """Signed distance of the origin to the hull of the corners q[:n] (m, 3) [m], and the unit vector that attains it.

    Two corners: a segment, in the plane or in space. More: a polygon in the plane.
    """
    least = np.inf
    px = 0.0
    py = 0.0
    pz = 0.0
    inside = n > 2
    for i in range(n if n > 2 else 1):
        k = i + 1 if i + 1 < n else 0
        ax = q[i, 0]
        ay = q[i, 1]
        bx = q[k, 0]
        by = q[k, 1]
        x, y, z = to_segment(ax, ay, q[i, 2], bx, by, q[k, 2])
        square = x * x + y * y + z * z
        inside = inside and (by - ay) * ax + (ax - bx) * ay >= 0.0
        if square < least:
            least = square
            px = x
            py = y
            pz = z
    distance = np.sqrt(least)
    largest = 0.0
    for i in range(n):
        largest = max(largest, max(abs(q[i, 0]), abs(q[i, 1])))
    short = max(CONTACT, SHORT * largest)
    if not inside and distance >= short:
        return distance, px / distance, py / distance, pz / distance
    depth, nx, ny = outermost_edge(q, n)
    # A body that turns on the spot has all its corners in one place (`model.trajectory.protocol`): no edge, no
    # interior.
    if n > 2 and -np.inf < depth <= 0.0:
        return depth, -nx, -ny, 0.0
    if distance < short and q[0, 2] == 0.0 and q[n - 1, 2] == 0.0 and 0.999 * distance <= abs(depth) < np.inf:
        # Rounding leaves no direction in so short a difference. That of the edge, which is about as near, is exact.
        side = -1.0 if depth > 0.0 else 1.0
        return distance, side * nx, side * ny, 0.0
    if distance > 0.0:
        return distance, px / distance, py / distance, pz / distance
    return 0.0, nx, ny, 0.0


@kernel
def outermost_edge(q: Array, n: int) -> tuple[float, float, float]:
    """How far the origin is beyond the line of an edge of q[:n] (m, 3) [m] at most, and the normal of that edge.

    Negative inside a polygon; -inf without an edge.
    """
    depth = -np.inf
    nx = 1.0
    ny = 0.0
    for i in range(n if n > 2 else 1):
        k = i + 1 if i + 1 < n else 0
        ax = q[i, 0]
        ay = q[i, 1]
        bx = q[k, 0]
        by = q[k, 1]
        length = np.sqrt(squared(bx - ax) + squared(by - ay))
        if length > 0.0:
            ex = (by - ay) / length
            ey = (ax - bx) / length
            beyond = -(ex * ax + ey * ay)
            if beyond > depth:
                depth = beyond
                nx = ex
                ny = ey
    return depth, nx, ny


@kernel
def order(q: Array, n: int) -> int:
    """The number of corners of the hull of q[:n] (m, 3) in the plane, which are sorted counter-clockwise into q.

    Andrew's monotone chain. Only hulls of two turning parts need it: all others keep their order.
    """
    for i in range(1, n):
        for j in range(i, 0, -1):
            if q[j, 0] > q[j - 1, 0] or (q[j, 0] == q[j - 1, 0] and q[j, 1] >= q[j - 1, 1]):
                break
            for axis in range(2):
                q[j, axis], q[j - 1, axis] = q[j - 1, axis], q[j, axis]
    chain = np.empty((2 * n, 2))
    count = 0
    for turn in range(2):
        low = count + 1
        for step in range(n):
            i = step if turn == 0 else n - 1 - step
            while count > low and (chain[count - 1, 0] - chain[count - 2, 0]) * (q[i, 1] - chain[count - 2, 1]) <= (
                chain[count - 1, 1] - chain[count - 2, 1]
            ) * (q[i, 0] - chain[count - 2, 0]):
                count -= 1
            chain[count, 0] = q[i, 0]
            chain[count, 1] = q[i, 1]
            count += 1
        count -= 1
    for i in range(count):
        q[i, 0], q[i, 1], q[i, 2] = chain[i, 0], chain[i, 1], 0.0
    return count


class MovingHull(NamedTuple):
    """One rounded hull along a segment, relative to the robot under one control."""

    path: Array  # (4, 5) control points of origin (x, y, z) [m] and direction (ex, ey)
    hulls: Hulls
    hull: int  # its number
    radius: float  # [m] at the begin
    growth: float  # [m] over the segment


@kernel
def new_path(hulls: MaybeHulls) -> tuple[Array, Array]:
    """Buffers for one path (4, 5), and for the corners (c, 3) of one hull at several times (`elements.fan`).

    There is room for each hull of the rows. Most hulls of a map are of no row.
    """
    most = 1
    if len(hulls) > 0:
        for h in hulls.hull:
            if h >= 0:
                most = max(most, hulls.first[h + 1] - hulls.first[h])
    return np.empty((4, 5)), np.zeros((4 * most + 4, 3))


@kernel
def load_path(table: Segments, hulls: Hulls, s: int, u: Array, path: Array) -> None:
    """The path (4, 5) of segment s under control u (3,)."""
    points = table.points
    turns = hulls.turns
    for j in range(4):
        for axis in range(3):
            path[j, axis] = points[j, axis, s] - image(table.gains, table.cross, j, s, u, axis)
        path[j, 3], path[j, 4] = turns[j, 0, s], turns[j, 1, s]


@kernel
def corners_at(moving: MovingHull, x: float, q: Array) -> int:
    """The number of corners of the hull; their positions at x in [0, 1] go into q (n, 3) [m]."""
    path = moving.path
    h = moving.hull
    corners = moving.hulls.corners
    first = moving.hulls.first
    # Numbers, not an array of them: its memory would take as long as the rest.
    px = value(path[0, 0], path[1, 0], path[2, 0], path[3, 0], x)
    py = value(path[0, 1], path[1, 1], path[2, 1], path[3, 1], x)
    pz = value(path[0, 2], path[1, 2], path[2, 2], path[3, 2], x)
    ex = value(path[0, 3], path[1, 3], path[2, 3], path[3, 3], x)
    ey = value(path[0, 4], path[1, 4], path[2, 4], path[3, 4], x)
    begin = first[h]
    n = first[h + 1] - first[h]
    for j in range(n):
        k = begin + j
        q[j, 0] = px + corners[k, 0] + corners[k, 3] * ex - corners[k, 4] * ey
        q[j, 1] = py + corners[k, 1] + corners[k, 3] * ey + corners[k, 4] * ex
        q[j, 2] = pz + corners[k, 2]
    return int(n)


@kernel
def hull_distance(moving: MovingHull, x: float, q: Array) -> Direction:
    """Signed distance [m] of the origin to the rounded hull at x, and the unit vector that attains it."""
    n = corners_at(moving, x, q)
    if moving.hulls.unordered[moving.hull]:
        n = order(q, n)
    distance, vx, vy, vz = signed_distance(q, n)
    return distance - moving.radius - moving.growth * x, vx, vy, vz


@kernel
def distances(places: Array, directions: Array, hull: Indices, hulls: MaybeHulls) -> Array:
    """Signed distance [m] of the origin to hulls with numbers `hull` (k,), -1 for points, and the unit vector: (k, 4).

    The origins of the hulls lie at `places` (k, 3) [m], their bodies along `directions` (k, 2).
    """
    result = np.empty((len(places), 4))
    path, q = new_path(hulls)
    for i in range(len(places)):
        if len(hulls) == 0 or hull[i] < 0:
            n = 1
            q[0, 0] = places[i, 0]
            q[0, 1] = places[i, 1]
            q[0, 2] = places[i, 2]
        else:
            for j in range(4):
                path[j, 0] = places[i, 0]
                path[j, 1] = places[i, 1]
                path[j, 2] = places[i, 2]
                path[j, 3] = directions[i, 0]
                path[j, 4] = directions[i, 1]
            n = corners_at(MovingHull(path, hulls, hull[i], 0.0, 0.0), 0.0, q)
            n = order(q, n) if hulls.unordered[hull[i]] else n
        result[i, 0], result[i, 1], result[i, 2], result[i, 3] = signed_distance(q, n)
    return result


# Lower bounds of the signed distance to a rounded convex hull along a segment.
#
# The signed distance of the origin to a convex hull is the largest, over unit vectors v, of min v . corner: negative
# inside, where it is minus the depth. Any v therefore bounds it from below. Between two times v is the straight
# interpolation of the best vectors at both. It turns with the hull, and min v . corner is bounded by its control
# points. A control that slides along a hull at a constant distance then needs few bisections, with a constant v
# thousands.


Cubic: TypeAlias = tuple[float, float, float, float]
"""Control values of a cubic."""


@kernel
def distance_bound(moving: MovingHull, a: float, b: float, early: Direction, late: Direction) -> float:
    """A lower bound [m] of the signed distance to the rounded hull over [a, b], from unit vectors `early` and `late`.

    The vector v is (1 - s) early + s late. If they differ by the angle t, then cos(t / 2) <= |v| <= 1 - s (1 - s)
    (1 - cos t). Along v the path and the corners are of degree 4. No bound (-inf) beyond a right angle.
    """
    path = moving.path
    h = moving.hull
    corners = moving.hulls.corners
    first = moving.hulls.first
    _, ux, uy, uz = early
    _, wx, wy, wz = late
    cosine = ux * wx + uy * wy + uz * wz
    if cosine < 0.0:
        return -np.inf
    x0, x1, x2, x3 = restrict(path[0, 0], path[1, 0], path[2, 0], path[3, 0], a, b)
    y0, y1, y2, y3 = restrict(path[0, 1], path[1, 1], path[2, 1], path[3, 1], a, b)
    z0, z1, z2, z3 = restrict(path[0, 2], path[1, 2], path[2, 2], path[3, 2], a, b)
    p0, p1, p2, p3, p4 = along(
        (
            ux * x0 + uy * y0 + uz * z0,
            ux * x1 + uy * y1 + uz * z1,
            ux * x2 + uy * y2 + uz * z2,
            ux * x3 + uy * y3 + uz * z3,
        ),
        (
            wx * x0 + wy * y0 + wz * z0,
            wx * x1 + wy * y1 + wz * z1,
            wx * x2 + wy * y2 + wz * z2,
            wx * x3 + wy * y3 + wz * z3,
        ),
    )
    x0, x1, x2, x3 = restrict(path[0, 3], path[1, 3], path[2, 3], path[3, 3], a, b)
    y0, y1, y2, y3 = restrict(path[0, 4], path[1, 4], path[2, 4], path[3, 4], a, b)
    e0, e1, e2, e3, e4 = along(
        (ux * x0 + uy * y0, ux * x1 + uy * y1, ux * x2 + uy * y2, ux * x3 + uy * y3),
        (wx * x0 + wy * y0, wx * x1 + wy * y1, wx * x2 + wy * y2, wx * x3 + wy * y3),
    )
    f0, f1, f2, f3, f4 = along(
        (uy * x0 - ux * y0, uy * x1 - ux * y1, uy * x2 - ux * y2, uy * x3 - ux * y3),
        (wy * x0 - wx * y0, wy * x1 - wx * y1, wy * x2 - wx * y2, wy * x3 - wx * y3),
    )
    low0 = np.inf
    low1 = np.inf
    low2 = np.inf
    low3 = np.inf
    low4 = np.inf
    for j in range(first[h], first[h + 1]):
        begin = corners[j, 0] * ux + corners[j, 1] * uy + corners[j, 2] * uz
        change = 0.25 * (corners[j, 0] * wx + corners[j, 1] * wy + corners[j, 2] * wz - begin)
        cx = corners[j, 3]
        cy = corners[j, 4]
        low0 = min(low0, begin + cx * e0 + cy * f0)
        low1 = min(low1, begin + change + cx * e1 + cy * f1)
        low2 = min(low2, begin + 2.0 * change + cx * e2 + cy * f2)
        low3 = min(low3, begin + 3.0 * change + cx * e3 + cy * f3)
        low4 = min(low4, begin + 4.0 * change + cx * e4 + cy * f4)
    r0, r1, r2, r3, r4, least = radius_along(moving, a, b, cosine)
    bound = min(min(p0 + low0 - r0, p1 + low1 - r1), min(p2 + low2 - r2, p3 + low3 - r3))
    bound = min(bound, p4 + low4 - r4)
    return float(bound if bound >= 0.0 else bound / least)


@kernel
def along(early: Cubic, late: Cubic) -> tuple[float, float, float, float, float]:
    """Control values of (1 - s) `early` + s `late`, for cubics with those control values."""
    p0, p1, p2, p3 = early
    q0, q1, q2, q3 = late
    return p0, 0.25 * (3.0 * p1 + q0), 0.5 * (p2 + q1), 0.25 * (p3 + 3.0 * q2), q3


@kernel
def radius_along(
    moving: MovingHull, a: float, b: float, cosine: float
) -> tuple[float, float, float, float, float, float]:
    """Control values of degree 4 of at least the radius times |v| over [a, b], see `distance_bound`, and the least |v|.

    cosine: of the angle by which v turns.
    """
    r = moving.radius + moving.growth * a
    q = moving.radius + moving.growth * b
    least = np.sqrt(0.5 * (1.0 + cosine))
    bend = 0.5 * (1.0 - cosine)
    if r < 0.0 or q < 0.0:
        # Below 0 the shorter |v| is the worse.
        r = r if r >= 0.0 else r * least
        q = q if q >= 0.0 else q * least
        bend = 0.0
    middle = (2.0 * r * (1.0 - bend) + q) / 3.0
    other = (r + 2.0 * q * (1.0 - bend)) / 3.0
    return r, 0.25 * (r + 3.0 * middle), 0.5 * (middle + other), 0.25 * (3.0 * other + q), q, least


@kernel
def put_separating(
    moving: MovingHull, gain: Array, cross: Array, u: Array, direction: Direction, separating: Array
) -> None:
    """Write a `direction`, and the bounds along it at the control points under the control 0, into `separating` (7,).

    `moving` is under control u (3,), `gain` (4,) and `cross` (4, 1 or 0) are those of its segment.
    """
    path = moving.path
    h = moving.hull
    corners = moving.hulls.corners
    first = moving.hulls.first
    _, vx, vy, vz = direction
    separating[0] = vx
    separating[1] = vy
    separating[2] = vz
    toward = vx * u[0] + vy * u[1] + vz * u[2]
    turned = vy * u[0] - vx * u[1]
    for j in range(4):
        low = np.inf
        e = vx * path[j, 3] + vy * path[j, 4]
        f = vy * path[j, 3] - vx * path[j, 4]
        for k in range(first[h], first[h + 1]):
            fixed = corners[k, 0] * vx + corners[k, 1] * vy + corners[k, 2] * vz
            low = min(low, fixed + corners[k, 3] * e + corners[k, 4] * f)
        origin = vx * path[j, 0] + vy * path[j, 1] + vz * path[j, 2] + gain[j] * toward
        if cross.shape[1] > 0:
            origin += cross[j, 0] * turned
        separating[3 + j] = origin + low - moving.radius - moving.growth * j / 3.0


@kernel
def least_along(separating: Array, gain: Array, cross: Array, u: Array) -> float:
    """A lower bound [m] of the signed distance under control u (3,), from a direction alone, see `put_separating`.

    gain (4,), cross (4, 1 or 0): of the segment.
    """
    toward = separating[0] * u[0] + separating[1] * u[1] + separating[2] * u[2]
    if cross.shape[1] > 0:
        turned = separating[1] * u[0] - separating[0] * u[1]
        least = np.inf
        for j in range(4):
            least = min(least, separating[3 + j] - gain[j] * toward - cross[j, 0] * turned)
        return float(least)
    early = min(separating[3] - gain[0] * toward, separating[4] - gain[1] * toward)
    return float(min(early, min(separating[5] - gain[2] * toward, separating[6] - gain[3] * toward)))


# Contacts with a rounded convex hull along a segment: whether and when, the least distance, the deepest time.
#
# Spans of time are bisected until a bound or a distance decides. A control that slides along a hull at the distance 0
# would be bisected without end: collisions less deep than CLEARANCE, or than a share of large lengths, are not sought.
# What MOST_SPANS spans leave undecided counts as a collision.


MOST_SPANS: Final = 2048
"""[1] Most spans of a segment that are bisected before it counts as colliding: about 2 ms. Larger: a control that
slides along a hull takes longer. Smaller than a few times DEPTH: free controls are lost, since a span is bisected so
often around each time at which the direction of the distance jumps."""

DEEPEST_SAMPLES: Final = 8
"""[1] Intervals of a segment at whose ends the depth inside a hull is sampled before golden section. Larger: deeper
elements, at more cost each. Smaller: a deeper time may be missed, and the exchange takes longer."""

GOLDEN_STEPS: Final = 18
"""[1] Steps of golden section towards the deepest time: each multiplies the interval by 0.618. Larger: time spent below
rounding. Smaller: elements are less deep."""


@kernel
def push(stack: Array, top: int, a: float, width: float, early: Direction, late: Direction) -> None:
    """Write the span from a on, of that `width`, with the directions at both ends, into row `top` of a stack."""
    node = stack[top]
    node[0] = a
    node[1] = width
    node[2] = early[1]
    node[3] = early[2]
    node[4] = early[3]
    node[5] = late[1]
    node[6] = late[2]
    node[7] = late[3]


@kernel
def pop(stack: Array, top: int) -> tuple[float, float, Direction, Direction]:
    """The span in row `top` of a stack, see `push`; the distances of the directions are not kept."""
    node = stack[top]
    return node[0], node[1], (0.0, node[2], node[3], node[4]), (0.0, node[5], node[6], node[7])


@kernel
def resolved(moving: MovingHull, accuracy: float) -> float:
    """The `accuracy` [m], or the share RESOLVED of the largest length of path, corners and radius if that is more."""
    hulls = moving.hulls
    largest = max(abs(moving.radius), abs(moving.radius + moving.growth))
    for j in range(4):
        for axis in range(3):
            largest = max(largest, abs(moving.path[j, axis]))
    for k in range(hulls.first[moving.hull], hulls.first[moving.hull + 1]):
        for axis in range(5):
            largest = max(largest, abs(hulls.corners[k, axis]))
    return max(accuracy, RESOLVED * largest)


@kernel
def hull_below(moving: MovingHull, stack: Array, q: Array) -> tuple[float, int]:
    """A place x in [0, 1] at which the origin is inside the rounded hull, and the number of spans bisected.

    -1 if it is nowhere deeper inside than `resolved`. After MOST_SPANS the place of a span that is not decided.
    """
    early = hull_distance(moving, 0.0, q)
    late = hull_distance(moving, 1.0, q)
    if early[0] < 0.0 or late[0] < 0.0:
        return 0.0 if early[0] < 0.0 else 1.0, 0
    depth = resolved(moving, CLEARANCE)
    push(stack, 0, 0.0, 1.0, early, late)
    top = 0
    spans = 0
    while top >= 0:
        a, width, early, late = pop(stack, top)
        top -= 1
        if width < LEAST_WIDTH or distance_bound(moving, a, a + width, early, late) >= -depth:
            continue
        middle = a + 0.5 * width
        there = hull_distance(moving, middle, q)
        spans += 1
        if there[0] < 0.0 or spans >= MOST_SPANS:
            return float(middle), spans
        push(stack, top + 1, middle, 0.5 * width, there, late)
        push(stack, top + 2, a, 0.5 * width, early, there)
        top += 2
    return -1.0, spans


@kernel
def hull_first_below(moving: MovingHull, stack: Array, q: Array, least: float) -> float:
    """The first x, up to `least`, at which the origin enters the rounded hull, -1 if never deeper than `resolved`.

    After MOST_SPANS the begin of the first span that is not decided.
    """
    depth = resolved(moving, CLEARANCE)
    stack[0, 0] = 0.0
    stack[0, 1] = 1.0
    top = 0
    spans = 0
    while top >= 0:
        a = stack[top, 0]
        width = stack[top, 1]
        top -= 1
        early = hull_distance(moving, a, q)
        late = hull_distance(moving, a + width, q)
        if distance_bound(moving, a, a + width, early, late) >= -depth:
            continue
        if early[0] < 0.0 or (width < least and late[0] < 0.0) or spans >= MOST_SPANS:
            return float(a)
        if width < LEAST_WIDTH:
            continue
        spans += 1
        stack[top + 1, 0] = a + 0.5 * width
        stack[top + 1, 1] = 0.5 * width
        stack[top + 2, 0] = a
        stack[top + 2, 1] = 0.5 * width
        top += 2
    return -1.0


@kernel
def hull_least(moving: MovingHull, stack: Array, q: Array, ceiling: float, accuracy: float) -> float:
    """Least signed distance to the rounded hull where below `ceiling`, else `ceiling`; too large by at most
    `accuracy`, see `resolved`. At most -CONTACT_SLACK where MOST_SPANS do not decide, which no slack takes for free.
    """
    early = hull_distance(moving, 0.0, q)
    late = hull_distance(moving, 1.0, q)
    best = min(ceiling, min(early[0], late[0]))
    accuracy = resolved(moving, accuracy)
    push(stack, 0, 0.0, 1.0, early, late)
    top = 0
    spans = 0
    while top >= 0:
        a, width, early, late = pop(stack, top)
        top -= 1
        if width < LEAST_WIDTH or distance_bound(moving, a, a + width, early, late) >= best - accuracy:
            continue
        there = hull_distance(moving, a + 0.5 * width, q)
        best = min(best, there[0])
        spans += 1
        if spans >= MOST_SPANS:
            return float(min(best, -CONTACT_SLACK))
        push(stack, top + 1, a + 0.5 * width, 0.5 * width, there, late)
        push(stack, top + 2, a, 0.5 * width, early, there)
        top += 2
    return float(best)


@kernel
def deepest_time(moving: MovingHull, gain: Array, cross: Array, q: Array, witness: float) -> float:
    """A time of collision at which the control is deep inside the element: from samples, then by golden section.

    Depth counts in units of the control: signed distance over gain.
    """
    best = np.inf
    place = witness
    step = 1.0 / DEEPEST_SAMPLES
    for k in range(DEEPEST_SAMPLES + 2):
        x = witness if k == DEEPEST_SAMPLES + 1 else step * k
        g = modulus_at(gain, cross, x)
        gap = hull_distance(moving, x, q)[0]
        if gap < 0.0 and gap < best * g:
            best = gap / g
            place = x
    low = max(0.0, place - step)
    high = min(1.0, place + step)
    share = 0.3819660112501051
    for _ in range(GOLDEN_STEPS):
        left = low + share * (high - low)
        right = high - share * (high - low)
        a = hull_distance(moving, left, q)[0]
        b = hull_distance(moving, right, q)[0]
        a /= modulus_at(gain, cross, left)
        b /= modulus_at(gain, cross, right)
        if a < b:
            high = right
        else:
            low = left
        x, least = (left, a) if a < b else (right, b)
        if least < best:
            best = least
            place = x
    return float(place)
