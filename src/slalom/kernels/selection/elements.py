"""Temporal elements of hulls, and of short spans of time: the parts of a control obstacle that reject a control."""

from typing import Final

import numpy as np

from slalom.base.tolerances import CONTACT
from slalom.kernels.arrays import Array, Direction, Hulls, Segments, Workspace
from slalom.kernels.geometry.cubic import modulus_at, restrict, to_control, value
from slalom.kernels.geometry.hulls import (
    MovingHull,
    corners_at,
    distance_bound,
    hull_distance,
    load_path,
    order,
    signed_distance,
    to_segment,
)
from slalom.kernels.geometry.polygons import smallest_ball
from slalom.kernels.jit import kernel, squared

ELEMENT_SPAN: Final = 0.25
"""[1] First half width, as a share of a segment, of the span of time that one element of a hull covers. Larger: fewer,
larger elements, more of them rejected. Smaller: more elements."""

ELEMENT_HALVINGS: Final = 24
"""[1] How often that width is halved before the element at a single time is taken. Larger: more work where nothing
fits. Smaller: sharp corners need more elements."""

ELEMENT_DEPTH: Final = 0.7
"""[1] An element over a span must hold the control at least this share as deep as the element at one time. Larger:
shorter spans. Smaller: elements that reject little else."""

ELEMENT_RADIUS: Final = 0.25
"""[1] And at least this share of its own radius deep. Larger: shorter spans. Smaller: elements of which the control is
hardly inside."""

SAG_SHARE: Final = 0.25
"""[1] A sag below this share of CONTACT is taken off the radius instead of shrinking the corners. Larger: elements are
a little smaller than needed. Smaller: more corners are shrunk for nothing."""

ELEMENT_GAIN: Final = 1e-9
"""[1] (unit of the response) Below this gain the corners of a hull have no image in control space. Larger: early spans
have no elements. Smaller: images of corners overflow."""


@kernel
def hull_element(
    table: Segments, hulls: Hulls, s: int, u: Array, dimension: int, limits: Array, work: Workspace
) -> tuple[int, float]:
    """Number of corners and radius of a part of the control obstacle of hull segment s that rejects u (3,).

    The corners go into `work.corners`. A sharp corner sweeps over a curve of which elements at single times cover
    points only. In the plane the part is therefore the set that surely lies between the elements of two times
    (`swept`), if that set rejects u. Otherwise, and with a cross gain, it is the element at the place
    `work.element[0]`. Both are grown by CONTACT.
    """
    load_path(table, hulls, s, u, work.path)
    moving = MovingHull(work.path, hulls, hulls.hull[s], table.radius[s], table.growth[s])
    h = moving.hull
    path = work.path
    q = work.corners
    place = work.element[0]
    gain, cross = table.gains[:, s], table.cross[:, s : s + 1]
    n = hulls.first[h + 1] - hulls.first[h]
    if n > 1 and dimension == 2 and cross.shape[1] == 0:
        deepest = hull_distance(moving, place, q)
        depth = -deepest[0] / value(gain[0], gain[1], gain[2], gain[3], place)
        turning = abs(path[0, 3] - path[3, 3]) + abs(path[0, 4] - path[3, 4]) > 0.0
        smallest = smallest_ball(limits, len(limits))
        far = np.sqrt(squared(u[0] - limits[smallest, 1]) + squared(u[1] - limits[smallest, 2])) + limits[smallest, 4]
        half = ELEMENT_SPAN
        for _ in range(ELEMENT_HALVINGS):
            a = max(0.0, place - half)
            b = min(1.0, place + half)
            if turning:
                m, r = fan(moving, gain, far, a, b, q)
            else:
                m, r = swept(moving, gain, far, a, b, q)
            # A part that u is hardly inside of would reject little else.
            if m > 1 and r - signed_distance(q, m)[0] > max(ELEMENT_DEPTH * depth, ELEMENT_RADIUS * r):
                shift(q, m, u)
                return m, r
            if is_shallow(moving, gain, deepest, a, b):
                break
            half *= 0.5
    n = corners_at(moving, place, q)
    if hulls.unordered[h]:
        n = order(q, n)
    for j in range(n):
        to_control(gain, cross, place, q[j])
    shift(q, n, u)
    return n, (moving.radius + moving.growth * place + CONTACT) / modulus_at(gain, cross, place)


@kernel
def is_shallow(moving: MovingHull, gain: Array, direction: Direction, a: float, b: float) -> bool:
    """Whether nothing that elements between a and b cover holds the control as deep as ELEMENT_RADIUS asks for.

    All of it lies beyond a line across the `direction` of the distance. So it is where a wall is hardly touched.
    """
    g0, g1, g2, g3 = restrict(gain[0], gain[1], gain[2], gain[3], a, b)
    slow, fast = min(min(g0, g1), min(g2, g3)), max(max(g0, g1), max(g2, g3))
    # By CONTACT more and less, for rounding and for a sag that is taken off the radius.
    depth = CONTACT - distance_bound(moving, a, b, direction, direction)
    radius = moving.radius + min(moving.growth * a, moving.growth * b) - CONTACT
    return bool(depth * fast < ELEMENT_RADIUS * radius * slow)


@kernel
def swept(moving: MovingHull, gain: Array, far: float, a: float, b: float, q: Array) -> tuple[int, float]:
    """Number of corners and radius of a set that the elements between a and b surely cover; the corners go into q.

    The convex hull of the elements at a and b, shrunk by the largest distance `sag` by which the motion in between may
    miss it. It is shrunk towards a point inside it. Let rho be the distance of that point from the border: shrinking by
    the share sag / rho moves the border inwards by at least sag. Nothing (0) where that leaves nothing.
    """
    m = corners_in_control(moving, gain, a, q, 0)
    if m == 0:
        return 0, 0.0
    m = order(q, m + corners_in_control(moving, gain, b, q, m))
    early = value(gain[0], gain[1], gain[2], gain[3], a)
    late = value(gain[0], gain[1], gain[2], gain[3], b)
    r = (moving.radius + min(moving.growth * a, moving.growth * b) + CONTACT) / max(early, late)
    miss = sag(moving.path, gain, far, a, b) / min(early, late)
    if miss <= SAG_SHARE * CONTACT / late:
        return m, r - miss
    x, y, rho = inner_disc(q, m)
    if m < 3 or miss >= 0.5 * rho:
        return 0, 0.0
    for j in range(m):
        q[j, 0] += (x - q[j, 0]) * miss / rho
        q[j, 1] += (y - q[j, 1]) * miss / rho
    return m, r


@kernel
def fan(moving: MovingHull, gain: Array, far: float, a: float, b: float, q: Array) -> tuple[int, float]:
    """As `swept`, for a body that turns: the set that one corner and the middle of the body cover from a to b.

    All elements in between hold the element in the middle, shrunk by as much as its corners move. With one corner
    they hold its hull with the chord of that corner's path, shrunk by the largest distance of the path from the chord.
    The corner is the one for which the control is deepest inside.
    """
    n = corners_in_control(moving, gain, a, q, 0)
    if n == 0:
        return 0, 0.0
    corners_in_control(moving, gain, b, q, n)
    corners_in_control(moving, gain, 0.5 * (a + b), q, 2 * n)
    early = value(gain[0], gain[1], gain[2], gain[3], a)
    late = value(gain[0], gain[1], gain[2], gain[3], b)
    r = (moving.radius + min(moving.growth * a, moving.growth * b) + CONTACT) / max(early, late)
    miss = corner_sag(moving, gain, far, a, b) / min(early, late)
    moved = 0.0
    for j in range(n):
        for k in (j, n + j):
            moved = max(moved, np.sqrt(squared(q[k, 0] - q[2 * n + j, 0]) + squared(q[k, 1] - q[2 * n + j, 1])))
    moved += 2.0 * miss
    core = order(q[2 * n :], n)
    x, y, rho = inner_disc(q[2 * n :], core)
    if core < 3 or moved >= 0.5 * rho:
        return 0, 0.0
    for j in range(2 * n, 2 * n + core):
        q[j, 0] += (x - q[j, 0]) * moved / rho
        q[j, 1] += (y - q[j, 1]) * moved / rho
    share = miss / (rho - moved + miss)
    best = -1
    deepest = 0.0
    trial = q[2 * n + core :]
    for j in range(n + 1):
        which = j if j < n else best
        if which < 0:
            return 0, 0.0
        for k in range(core):
            trial[k] = q[2 * n + k]
        for k in range(2):
            trial[core + k, 0] = q[which + k * n, 0] + share * (x - q[which + k * n, 0])
            trial[core + k, 1] = q[which + k * n, 1] + share * (y - q[which + k * n, 1])
            trial[core + k, 2] = 0.0
        m = order(trial, core + 2)
        if j < n:
            depth = r - signed_distance(trial, m)[0]
            if best < 0 or depth > deepest:
                best = j
                deepest = depth
    for k in range(m):
        q[k] = trial[k]
    return m, r


@kernel
def inner_disc(q: Array, n: int) -> tuple[float, float, float]:
    """The mean (x, y) of the corners q[:n] of a polygon, and its distance from the border."""
    x = 0.0
    y = 0.0
    for j in range(n):
        x = x + q[j, 0] / n
        y = y + q[j, 1] / n
    rho = np.inf
    for j in range(n):
        k = j + 1 if j + 1 < n else 0
        dx = q[k, 0] - q[j, 0]
        dy = q[k, 1] - q[j, 1]
        rho = min(rho, (dx * (y - q[j, 1]) - dy * (x - q[j, 0])) / (np.sqrt(dx * dx + dy * dy) + 1e-300))
    return x, y, rho


@kernel
def shift(q: Array, n: int, u: Array) -> None:
    """Add u (3,) to the corners q[:n]."""
    for j in range(n):
        for axis in range(3):
            q[j, axis] += u[axis]


@kernel
def corners_in_control(moving: MovingHull, gain: Array, x: float, q: Array, at: int) -> int:
    """The number of corners at x, in control space relative to the control of the path, into q from row `at` on.

    0 where the control has no effect yet.
    """
    g = value(gain[0], gain[1], gain[2], gain[3], x)
    if g < ELEMENT_GAIN:
        return 0
    n = corners_at(moving, x, q[at:])
    for j in range(at, at + n):
        for axis in range(3):
            q[j, axis] /= g
    return n


@kernel
def sag(path: Array, gain: Array, far: float, a: float, b: float) -> float:
    """Largest distance [m] between a body that does not turn and its straight interpolation between a and b.

    For every control within `far` of that of the path (4, 5). A control in the hull of the elements at a and b collides
    with the body interpolated between these times. Let (1 - m) be the weight of the element at a and m that at b. The
    contact is at the time at which (1 - l) gain(a) : l gain(b) = (1 - m) : m. The distance of the cubics from their
    chords remains.
    """
    return float(bend(path[:, 0], path[:, 1], a, b) + far * bend(gain, gain, a, b))


@kernel
def corner_sag(moving: MovingHull, gain: Array, far: float, a: float, b: float) -> float:
    """Largest distance [m] of a corner of a turning body from the chord of its path, see `sag`."""
    path = moving.path
    corners = moving.hulls.corners
    first = moving.hulls.first
    square = 0.0
    for j in range(first[moving.hull], first[moving.hull + 1]):
        square = max(square, squared(corners[j, 3]) + squared(corners[j, 4]))
    return float(sag(path, gain, far, a, b) + np.sqrt(square) * bend(path[:, 3], path[:, 4], a, b))


@kernel
def bend(x: Array, y: Array, a: float, b: float) -> float:
    """Largest distance of the plane cubic with control values x, y from its chord over [a, b]."""
    x0, x1, x2, x3 = restrict(x[0], x[1], x[2], x[3], a, b)
    y0, y1, y2, y3 = restrict(y[0], y[1], y[2], y[3], a, b)
    e = squared(x1 - (2.0 * x0 + x3) / 3.0) + squared(y1 - (2.0 * y0 + y3) / 3.0)
    f = squared(x2 - (x0 + 2.0 * x3) / 3.0) + squared(y2 - (y0 + 2.0 * y3) / 3.0)
    return float(0.75 * np.sqrt(max(e, f)))


@kernel
def nearest_ball(q: Array, u: Array) -> int:
    """Write the point of a capsule's axis nearest to u (3,) into q[0]; the number of corners, 1."""
    x, y, z = to_segment(q[0, 0] - u[0], q[0, 1] - u[1], q[0, 2] - u[2], q[1, 0] - u[0], q[1, 1] - u[1], q[1, 2] - u[2])
    q[0, 0] = x + u[0]
    q[0, 1] = y + u[1]
    q[0, 2] = z + u[2]
    return 1
