"""Local refinement of the time of deepest approach."""

from slalom.kernels.bezier import curvature, slope, value
from slalom.kernels.compiled import Array, kernel


@kernel
def sink(points: Array, gains: Array, k: int, u: Array, s: float) -> float:
    """A place near s in [0, 1] where |p - g u| is no larger on segment k, by a few Newton steps on its square."""
    g0, g1, g2, g3 = gains[0, k], gains[1, k], gains[2, k], gains[3, k]
    here = squared(points, gains, k, u, s)
    for _ in range(6):
        first, second = 0.0, 0.0
        for axis in range(3):
            p0, p1, p2, p3 = points[0, axis, k], points[1, axis, k], points[2, axis, k], points[3, axis, k]
            q = value(p0, p1, p2, p3, s) - u[axis] * value(g0, g1, g2, g3, s)
            v = slope(p0, p1, p2, p3, s) - u[axis] * slope(g0, g1, g2, g3, s)
            w = curvature(p0, p1, p2, p3, s) - u[axis] * curvature(g0, g1, g2, g3, s)
            first += q * v
            second += v * v + q * w
        step = -first / second if second > 0.0 else (0.5 if first < 0.0 else -0.5)
        trial = min(1.0, max(0.0, s + step))
        there = squared(points, gains, k, u, trial)
        while there > here and abs(trial - s) > 1e-4:
            trial = 0.5 * (trial + s)
            there = squared(points, gains, k, u, trial)
        if there >= here or abs(trial - s) < 1e-9:
            break
        s, here = trial, there
    return s


@kernel
def squared(points: Array, gains: Array, k: int, u: Array, s: float) -> float:
    """|p - g u|^2 at s on segment k."""
    result = 0.0
    gain = value(gains[0, k], gains[1, k], gains[2, k], gains[3, k], s)
    for axis in range(3):
        p0, p1, p2, p3 = points[0, axis, k], points[1, axis, k], points[2, axis, k], points[3, axis, k]
        q = value(p0, p1, p2, p3, s) - u[axis] * gain
        result += q * q
    return result
