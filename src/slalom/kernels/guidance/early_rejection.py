"""Conservative single-precision filter that discards robots which cannot affect robot i before the exact test.

It passes every robot that matters and few others: its bounds are wider than the rounding errors of single precision.
"""

import numpy as np

from slalom.kernels.arrays import Array, Flags, Singles
from slalom.kernels.guidance.tables import RobotRows
from slalom.kernels.jit import kernel
from slalom.tolerances import (
    CIRCLE_ARC,
    CIRCLE_ENTRY,
    DIVISOR_FLOOR,
    FILTER_ROUNDING,
    FILTER_SLACK,
    FILTER_SLOWEST,
    FLAGS_PER_WORD,
)


@kernel
def robot_rows(position: Array, velocity: Array, radius: Array, present: Flags, origin: Array) -> RobotRows:
    """Rows of all robots, in single precision relative to `origin` (2,) or (3,) [m].

    position (n, 3) [m], velocity (n, 3) [m/s], radius (n,) [m], present (n,).
    """
    n = len(radius)
    exact = np.empty((6, n))
    for k in range(n):
        exact[0, k], exact[1, k] = position[k, 0], position[k, 1]
        exact[2, k], exact[3, k] = velocity[k, 0], velocity[k, 1]
        exact[4, k] = radius[k] if present[k] else -np.inf
        exact[5, k] = np.sqrt(velocity[k, 0] * velocity[k, 0] + velocity[k, 1] * velocity[k, 1])
    words = np.zeros((n + FLAGS_PER_WORD - 1) // FLAGS_PER_WORD, np.uint64)
    coarse, candidates = np.empty((5, FLAGS_PER_WORD * len(words)), np.float32), np.empty(n, np.int64)
    extent, top_speed = to_single_precision(exact, origin, coarse)
    return RobotRows(exact, coarse, origin, extent, top_speed, words.view(np.bool_), words, candidates)


@kernel
def to_single_precision(exact: Array, origin: Array, coarse: Singles) -> tuple[float, float]:
    """Extent [m] and top speed [m/s] of the robots; their rows go into `coarse`. See `RobotRows` for the arrays.

    Absent robots are NaN, so every comparison with them is false.
    """
    n, extent, top_speed, x, y = exact.shape[1], 0.0, 0.0, origin[0], origin[1]
    coarse[:] = np.nan
    for k in range(n):
        if exact[4, k] >= 0.0:
            coarse[0, k], coarse[1, k] = exact[0, k] - x, exact[1, k] - y
            coarse[2, k], coarse[3, k] = exact[2, k], exact[3, k]
            # The square of such a speed underflows in single precision: an infinite radius passes every test.
            coarse[4, k] = np.inf if 0.0 < exact[5, k] < FILTER_SLOWEST else exact[4, k]
            extent = max(extent, max(abs(exact[0, k] - x), abs(exact[1, k] - y)) + exact[4, k])
            top_speed = max(top_speed, exact[5, k])
    return extent, top_speed


@kernel
def may_encounter(
    position: Array, velocity: tuple[float, float], radius: float, end: float, factor: float, rows: RobotRows
) -> int:
    """Number of robots that may come nearer than `factor` times the sum of radii before `end` [s]; see `candidates`.

    The robot starts at position (2,) or (3,) [m] with a constant velocity [m/s] and a radius [m]. With relative
    position r and relative velocity m, the least distance is |r x m| / |m|, after -(r m) / m^2. The loop has neither
    divisions nor branches, so that it runs on vector registers.
    """
    x, y, vx, vy, radii = rows.coarse[0], rows.coarse[1], rows.coarse[2], rows.coarse[3], rows.coarse[4]
    px, py = position[0] - rows.origin[0], position[1] - rows.origin[1]
    wx, wy = velocity
    length, speed = rows.extent + abs(px) + abs(py), rows.top_speed + abs(wx) + abs(wy)
    # Error bound of the product of a position and a velocity [m^2/s].
    error = FILTER_ROUNDING * length * speed
    least = np.float32(-error)
    most = np.float32(error + FILTER_ROUNDING * end * speed * speed + 2.0 * DIVISOR_FLOOR * end)
    p, q, u, w = np.float32(px), np.float32(py), np.float32(wx), np.float32(wy)
    scale, own = np.float32(factor), np.float32(factor * radius + FILTER_ROUNDING * length)
    wide, more = np.float32(1.0 + FILTER_SLACK), np.float32(2.0 / FILTER_SLACK * error * error)
    late, possible = np.float32(end * (1.0 + FILTER_SLACK)), rows.possible
    for k in range(len(possible)):
        rx, ry, mx, my = x[k] - p, y[k] - q, vx[k] - u, vy[k] - w
        square, toward, across = mx * mx + my * my, -(rx * mx + ry * my), rx * my - ry * mx
        touch = scale * radii[k] + own
        near = across * across <= wide * touch * touch * square + more
        possible[k] = near & (toward > least) & (toward <= late * square + most)
    return list_candidates(rows)


@kernel
def may_enter_circle(circle: Array, own: float, rows: RobotRows) -> int:
    """Number of robots that may be on a traffic circle (4,), or on their way into it, at the same time; `candidates`.

    circle: centre x, y [m], radius [m], number of robots. own: distance of a robot from the centre [m]. The distances
    of robots that count differ from it by at most CIRCLE_ARC. The loop has neither divisions nor branches.
    """
    x, y, vx, vy, radii = rows.coarse[0], rows.coarse[1], rows.coarse[2], rows.coarse[3], rows.coarse[4]
    px, py = circle[0] - rows.origin[0], circle[1] - rows.origin[1]
    # Error bound of positions [m]; errors of velocities are proportional to the velocities.
    error = FILTER_ROUNDING * (rows.extent + abs(px) + abs(py))
    p, q, room, entry = np.float32(px), np.float32(py), np.float32(circle[2] + error), np.float32(CIRCLE_ENTRY)
    wide, least, possible = np.float32(1.0 + FILTER_SLACK), np.float32(error * error), rows.possible
    away, apart, none = np.float32(own), np.float32(CIRCLE_ARC * circle[2] + 2.0 * error), np.float32(0.0)
    for k in range(len(possible)):
        tx, ty, size = p - x[k], q - y[k], room + entry * radii[k]
        difference = apart + entry * radii[k]
        near, far = max(away - difference, none), away + difference
        along, across = vx[k] * tx + vy[k] * ty, vx[k] * ty - vy[k] * tx
        square_distance, square_speed = tx * tx + ty * ty, vx[k] * vx[k] + vy[k] * vy[k]
        most = wide * size * size
        towards = (along > np.float32(0.0)) | (along * along < least * square_speed)
        as_far = (near * near <= wide * square_distance) & (square_distance <= wide * far * far)
        enters = (towards & (across * across <= most * square_speed)) | (square_distance <= most)
        possible[k] = as_far & enters
    return list_candidates(rows)


@kernel
def list_candidates(rows: RobotRows) -> int:
    """Number of the robots that are possible; their numbers go into `candidates`, in ascending order."""
    count = 0
    for w in range(len(rows.words)):
        if rows.words[w] != 0:
            for k in range(FLAGS_PER_WORD * w, FLAGS_PER_WORD * w + FLAGS_PER_WORD):
                if rows.possible[k]:
                    rows.candidates[count] = k
                    count += 1
    return count
