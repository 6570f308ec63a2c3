"""The time at which a control is deepest inside an obstacle: from the chord, then by Newton's method."""

import numpy as np

from slalom.kernels.bezier import curvature, slope, value
from slalom.kernels.compiled import Array, kernel


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
def sink(points: Array, gains: Array, k: int, u: Array, radius: float, s: float) -> float:
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
