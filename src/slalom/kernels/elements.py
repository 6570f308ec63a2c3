"""Temporal elements of hulls, and of short spans of time: the cuts that reject a colliding control."""

import numpy as np

from slalom.kernels.bezier import restrict, value
from slalom.kernels.compiled import Array, Hulls, kernel
from slalom.kernels.hulls import corners_at, excess, load, order, signed_distance, to_segment
from slalom.kernels.polygons import smallest_ball
from slalom.tolerances import CONTACT


@kernel
def hull_element(
    points: Array,
    gains: Array,
    radius: Array,
    growth: Array,
    hulls: Hulls,
    s: int,
    place: float,
    u: Array,
    dimension: int,
    limits: Array,
    course: Array,
    q: Array,
) -> tuple[int, float]:
    """A part of the control obstacle of hull segment s that rejects u: corners, into q, their number, and radius.

    A sharp corner sweeps over a curve of which elements at single times cover points only. In the plane the part is
    therefore, where that rejects u, what surely lies between the elements of two times (`swept`); else the element
    at `place`. Both are grown by CONTACT.
    """
    h = hulls[0][s]
    load(points, gains, hulls, s, u, course)
    gain = gains[:, s]
    n = hulls[3][h + 1] - hulls[3][h]
    if n > 1 and dimension == 2:
        depth = -excess(course, hulls, h, radius[s], growth[s], place, q)[0]
        depth /= value(gain[0], gain[1], gain[2], gain[3], place)
        smallest = smallest_ball(limits)
        far = np.sqrt((u[0] - limits[smallest, 1]) ** 2 + (u[1] - limits[smallest, 2]) ** 2) + limits[smallest, 4]
        half = 0.25
        for _ in range(24):
            a, b = max(0.0, place - half), min(1.0, place + half)
            m, r = swept(course, gain, hulls, h, radius[s], growth[s], far, a, b, q)
            # One that u is hardly inside of would reject little else.
            if m > 1 and r - signed_distance(q, m)[0] > max(0.7 * depth, 0.25 * r):
                shift(q, m, u)
                return m, r
            half *= 0.5
    n = corners_at(course, hulls, h, place, q)
    if hulls[4][h]:
        n = order(q, n)
    g = value(gain[0], gain[1], gain[2], gain[3], place)
    for j in range(n):
        for axis in range(3):
            q[j, axis] /= g
    shift(q, n, u)
    return n, (radius[s] + growth[s] * place + CONTACT) / g


@kernel
def swept(
    course: Array,
    gain: Array,
    hulls: Hulls,
    h: int,
    radius: float,
    growth: float,
    far: float,
    a: float,
    b: float,
    q: Array,
) -> tuple[int, float]:
    """What the elements between a and b cover for sure: corners relative to the control, into q, number, and radius.

    The convex hull of the elements at a and b, shrunk by as much as the motion in between may miss it (`sag`): towards
    a point inside it, since shrinking by the share sag / rho moves its border inwards by at least sag, with rho the
    distance of that point from the border. Nothing (0) where that leaves nothing.
    """
    m = corners_in_control(course, gain, hulls, h, a, q, 0)
    if m == 0:
        return 0, 0.0
    m = order(q, m + corners_in_control(course, gain, hulls, h, b, q, m))
    early = value(gain[0], gain[1], gain[2], gain[3], a)
    late = value(gain[0], gain[1], gain[2], gain[3], b)
    r = (radius + min(growth * a, growth * b) + CONTACT) / max(early, late)
    miss = sag(course, gain, hulls, h, far, a, b) / min(early, late)
    if miss <= 0.25 * CONTACT / late:
        return m, r - miss
    x, y = 0.0, 0.0
    for j in range(m):
        x, y = x + q[j, 0] / m, y + q[j, 1] / m
    rho = np.inf
    for j in range(m):
        k = j + 1 if j + 1 < m else 0
        dx, dy = q[k, 0] - q[j, 0], q[k, 1] - q[j, 1]
        rho = min(rho, (dx * (y - q[j, 1]) - dy * (x - q[j, 0])) / (np.sqrt(dx * dx + dy * dy) + 1e-300))
    if m < 3 or miss >= 0.5 * rho:
        return 0, 0.0
    for j in range(m):
        q[j, 0] += (x - q[j, 0]) * miss / rho
        q[j, 1] += (y - q[j, 1]) * miss / rho
    return m, r


@kernel
def shift(q: Array, n: int, u: Array) -> None:
    """Move corners relative to u to where they are."""
    for j in range(n):
        for axis in range(3):
            q[j, axis] += u[axis]


@kernel
def corners_in_control(course: Array, gain: Array, hulls: Hulls, h: int, x: float, q: Array, at: int) -> int:
    """The corners at x in control space relative to the control of the course, into q from row `at` on; how many.

    None where the control has no effect yet.
    """
    g = value(gain[0], gain[1], gain[2], gain[3], x)
    if g < 1e-9:
        return 0
    n = corners_at(course, hulls, h, x, q[at:])
    for j in range(at, at + n):
        for axis in range(3):
            q[j, axis] /= g
    return n


@kernel
def sag(course: Array, gain: Array, hulls: Hulls, h: int, far: float, a: float, b: float) -> float:
    """By how much, in the workspace, the bodies between a and b may miss their straight interpolation.

    For every control within `far` of that of the course. A control in the hull of the elements at a and b collides with
    the body interpolated between these times, as a sum of sets: with weights (1 - m) on the element at a and m on that
    at b, take the time at which (1 - l) gain(a) : l gain(b) = (1 - m) : m. What remains is how far cubics bend from
    their chords and, for a body that turns, how far the sum of two bodies in different directions e exceeds the body in
    between: at l, by at most 2 l (1 - l) |e(b) - e(a)| of its size.
    """
    total = bend(course[:, 0], course[:, 1], a, b) + far * bend(gain, gain, a, b)
    spread = 0.0
    for j in range(hulls[3][h], hulls[3][h + 1]):
        spread = max(spread, hulls[2][j, 3] ** 2 + hulls[2][j, 4] ** 2)
    if spread > 0.0:
        turn = bend(course[:, 3], course[:, 4], a, b)
        change = 0.0
        for axis in range(3, 5):
            p0, _, _, p3 = restrict(course[0, axis], course[1, axis], course[2, axis], course[3, axis], a, b)
            change += (p3 - p0) ** 2
        total += np.sqrt(spread) * (turn + 0.5 * np.sqrt(change))
    return float(total)


@kernel
def bend(x: Array, y: Array, a: float, b: float) -> float:
    """How far the plane cubic with control values x, y may be from its chord over [a, b], see `chord_gaps`."""
    x0, x1, x2, x3 = restrict(x[0], x[1], x[2], x[3], a, b)
    y0, y1, y2, y3 = restrict(y[0], y[1], y[2], y[3], a, b)
    e = (x1 - (2.0 * x0 + x3) / 3.0) ** 2 + (y1 - (2.0 * y0 + y3) / 3.0) ** 2
    f = (x2 - (x0 + 2.0 * x3) / 3.0) ** 2 + (y2 - (y0 + 2.0 * y3) / 3.0) ** 2
    return float(0.75 * np.sqrt(max(e, f)))


@kernel
def nearest_ball(q: Array, u: Array) -> int:
    """Of a capsule in space, the ball about the point of its axis nearest to u, into q; always one corner."""
    x, y, z = to_segment(q[0, 0] - u[0], q[0, 1] - u[1], q[0, 2] - u[2], q[1, 0] - u[0], q[1, 1] - u[1], q[1, 2] - u[2])
    q[0, 0], q[0, 1], q[0, 2] = x + u[0], y + u[1], z + u[2]
    return 1
