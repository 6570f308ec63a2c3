"""Local refinement of the time of deepest approach."""

from slalom.kernels.bezier import curvature, slope, value
from slalom.kernels.compiled import Array, kernel


@kernel
def sink(p: Array, g: Array, u: Array, s: float) -> float:
    """A place near s in [0, 1] where |p - g u| is no larger, by a few Newton steps on its squared distance."""
    here = squared(p, g, u, s)
    for _ in range(6):
        first, second = 0.0, 0.0
        for axis in range(3):
            q = value(p[0, axis], p[1, axis], p[2, axis], p[3, axis], s) - u[axis] * value(g[0], g[1], g[2], g[3], s)
            v = slope(p[0, axis], p[1, axis], p[2, axis], p[3, axis], s) - u[axis] * slope(g[0], g[1], g[2], g[3], s)
            w = curvature(p[0, axis], p[1, axis], p[2, axis], p[3, axis], s) - u[axis] * curvature(
                g[0], g[1], g[2], g[3], s
            )
            first += q * v
            second += v * v + q * w
        step = -first / second if second > 0.0 else (0.5 if first < 0.0 else -0.5)
        trial = min(1.0, max(0.0, s + step))
        there = squared(p, g, u, trial)
        while there > here and abs(trial - s) > 1e-4:
            trial = 0.5 * (trial + s)
            there = squared(p, g, u, trial)
        if there >= here or abs(trial - s) < 1e-9:
            break
        s, here = trial, there
    return s


@kernel
def squared(p: Array, g: Array, u: Array, s: float) -> float:
    """|p - g u|^2 at s."""
    result = 0.0
    gain = value(g[0], g[1], g[2], g[3], s)
    for axis in range(3):
        q = value(p[0, axis], p[1, axis], p[2, axis], p[3, axis], s) - u[axis] * gain
        result += q * q
    return result
