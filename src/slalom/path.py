"""A curve as cubic pieces with a certified error: what kernels, recordings and pictures work on."""

from typing import NamedTuple

import numpy as np

from slalom.checks import Array


class Path(NamedTuple):
    """Cubic pieces in Bernstein form.

    Piece k covers times[k] to times[k + 1]; its control points are points[k]; the true curve lies within
    error[k] of it at every time. Pieces may disagree in velocity where they meet, not in position.
    """

    times: Array  # (n + 1,) [s], increasing
    points: Array  # (n, 4, d) [m]
    error: Array  # (n,) [m]

    def cut(self, times: Array) -> "Path":
        """The same curve in pieces between other times (k + 1,) that include its own as far as they lie within."""
        k = np.clip(np.searchsorted(self.times, times[:-1], side="right") - 1, 0, len(self.points) - 1)
        h = np.diff(self.times)[k]
        a, b = ((times[:-1] - self.times[k]) / h)[:, None], ((times[1:] - self.times[k]) / h)[:, None]
        p0, p1, p2, p3 = np.moveaxis(self.points[k], 1, 0)
        # The control points are the cubic's blossom at (a, a, a), (a, a, b), (a, b, b), (b, b, b).
        a01, a12, a23 = p0 + (p1 - p0) * a, p1 + (p2 - p1) * a, p2 + (p3 - p2) * a
        b01, b12, b23 = p0 + (p1 - p0) * b, p1 + (p2 - p1) * b, p2 + (p3 - p2) * b
        aa, aa2 = a01 + (a12 - a01) * a, a12 + (a23 - a12) * a
        ab, ab2 = a01 + (a12 - a01) * b, a12 + (a23 - a12) * b
        bb, bb2 = b01 + (b12 - b01) * b, b12 + (b23 - b12) * b
        points = np.stack([aa + (aa2 - aa) * a, aa + (aa2 - aa) * b, ab + (ab2 - ab) * b, bb + (bb2 - bb) * b], axis=1)
        return Path(times, points, self.error[k])


def hermite(times: Array, positions: Array, velocities: Array, error: float | Array = 0.0) -> Path:
    """Pieces that agree with positions (n + 1, d) and velocities (n + 1, d) at times (n + 1,)."""
    return hermite_pieces(times, positions, velocities[:-1], velocities[1:], error)


def hermite_weights(times: Array) -> Array:
    """Steps (n, 4) [s] such that control point j is a position + step * velocity there: as `hermite`, two by two."""
    third = (times[1:] - times[:-1]) / 3.0
    return np.stack([0.0 * third, third, -third, 0.0 * third], axis=1)


def hermite_pieces(times: Array, positions: Array, leaving: Array, entering: Array, error: float | Array) -> Path:
    """As `hermite`, with the velocity (n, d) leaving each piece's first time and entering its last one."""
    third = ((times[1:] - times[:-1]) / 3.0)[:, None]
    points = np.empty((len(times) - 1, 4, positions.shape[1]))
    points[:, 0] = positions[:-1]
    points[:, 1] = positions[:-1] + third * leaving
    points[:, 2] = positions[1:] - third * entering
    points[:, 3] = positions[1:]
    return Path(times, points, np.broadcast_to(np.asarray(error, dtype=np.float64), (len(times) - 1,)))


def even_knots(start: float, end: float, longest: float) -> Array:
    """Times from start to end, evenly spaced, no farther apart than `longest`."""
    count = max(1, int(np.ceil((end - start) / longest))) if np.isfinite(longest) else 1
    return np.linspace(start, end, count + 1)


def hermite_step(fourth_derivative: float, tolerance: float) -> float:
    """Longest step for which cubic Hermite interpolation errs by at most `tolerance`.

    The error is at most h^4 max|f''''| / 384; for vectors the bound holds along every direction.
    """
    if fourth_derivative <= 0.0:
        return float("inf")
    return float((384.0 * tolerance / fourth_derivative) ** 0.25)
