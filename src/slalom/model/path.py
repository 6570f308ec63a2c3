"""Curves as cubic pieces with a certified error, for kernels, recordings and figures."""

from typing import Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import DIVISOR_FLOOR, REST

MAX_PIECES: Final = 1_000_000
"""[1] Pieces of a curve over one stretch of time. Larger: a slip in a radius takes gigabytes. Smaller: fine curves are
refused."""

LINE_ROUNDING: Final = 1e-13
"""[1] Rounding of a motion along a line, relative to its largest coordinate. Larger: a curve counts as a line, and
obstacles at rest are missed by that much. Smaller: rounding hides a line, and each of its pieces makes a segment of its
own."""


class Path(NamedTuple):
    """Cubic pieces in Bernstein form.

    Piece k covers times[k] to times[k + 1] with control points points[k]. The true curve lies within error[k] of the
    piece at every time. Adjacent pieces agree in position; they may differ in velocity.
    """

    times: Array  # (n + 1,) [s], increasing
    points: Array  # (n, 4, d) [m]
    error: Array  # (n,) [m]

    def cut(self, times: Array) -> "Path":
        """The same curve in pieces between `times` (k + 1,) [s]; of several curves with points (n, m, 4, d) all.

        `times` must include all times of the curve that lie within them.
        """
        k = np.clip(np.searchsorted(self.times, times[:-1], side="right") - 1, 0, len(self.points) - 1)
        h = np.diff(self.times)[k]
        shape = (-1, *[1] * (self.points.ndim - 2))
        a, b = ((times[:-1] - self.times[k]) / h).reshape(shape), ((times[1:] - self.times[k]) / h).reshape(shape)
        p0, p1, p2, p3 = np.moveaxis(self.points[k], -2, 0)
        # The control points are the values of the blossom at (a, a, a), (a, a, b), (a, b, b), (b, b, b).
        a01 = p0 + (p1 - p0) * a
        a12 = p1 + (p2 - p1) * a
        a23 = p2 + (p3 - p2) * a
        b01 = p0 + (p1 - p0) * b
        b12 = p1 + (p2 - p1) * b
        b23 = p2 + (p3 - p2) * b
        aa, aa2 = a01 + (a12 - a01) * a, a12 + (a23 - a12) * a
        ab, ab2 = a01 + (a12 - a01) * b, a12 + (a23 - a12) * b
        bb, bb2 = b01 + (b12 - b01) * b, b12 + (b23 - b12) * b
        points = np.stack([aa + (aa2 - aa) * a, aa + (aa2 - aa) * b, ab + (ab2 - ab) * b, bb + (bb2 - bb) * b], axis=-2)
        return Path(times, points, self.error[k])


def hermite(times: Array, positions: Array, velocities: Array, error: float | Array = 0.0) -> Path:
    """Cubic Hermite pieces through positions (n + 1, d) [m] with velocities (n + 1, d) [m/s] at times (n + 1,) [s]."""
    return hermite_pieces(times, positions, velocities[:-1], velocities[1:], error)


def hermite_weights(times: Array) -> Array:
    """Steps (n, 4) [s] of `hermite`: control point j is position + step * velocity.

    Control points 0 and 1 belong to the first knot of the piece, 2 and 3 to the second.
    """
    third = (times[1:] - times[:-1]) / 3.0
    return np.stack([0.0 * third, third, -third, 0.0 * third], axis=1)


def hermite_pieces(
    times: Array, positions: Array, start_velocities: Array, end_velocities: Array, error: float | Array
) -> Path:
    """Cubic pieces as of `hermite`, with velocities (n, d) [m/s] of their own at the start and the end of each."""
    third = ((times[1:] - times[:-1]) / 3.0)[:, None]
    points = np.empty((len(times) - 1, 4, positions.shape[1]))
    points[:, 0] = positions[:-1]
    points[:, 1] = positions[:-1] + third * start_velocities
    points[:, 2] = positions[1:] - third * end_velocities
    points[:, 3] = positions[1:]
    return Path(times, points, np.broadcast_to(np.asarray(error, dtype=np.float64), (len(times) - 1,)))


def rest_from(times: Array, points: Array) -> float:
    """Time [s] from which pieces between times (n + 1,) [s] with control points (n, 4, ...) stay as they are; or inf.

    Slower than AT_REST is at rest.
    """
    change = np.abs(points - points[:, 3:]).reshape(len(points), -1).max(axis=1)
    moving = np.flatnonzero(change > REST * np.diff(times))
    last = int(moving[-1]) + 1 if moving.size else 0
    return float(times[last]) if last < len(points) else np.inf


def straight_from(points: Array) -> int:
    """The first piece from which on pieces with control points (n, 4, c) lie on one line, passed in one direction.

    n if even the last one does not.
    """
    for first in range(len(points)):
        rest = points[first:].reshape(-1, points.shape[2])
        line = rest[-1] - rest[0]
        unit = line / max(float(np.linalg.norm(line)), DIVISOR_FLOOR)
        along = (rest - rest[0]) @ unit
        beside = rest - rest[0] - np.outer(along, unit)
        allowed = LINE_ROUNDING * float(np.abs(rest).max(initial=0.0))
        if np.abs(beside).max() <= allowed and np.diff(along).min() >= -allowed:
            return first
    return len(points)


def even_knots(start: float, end: float, max_step: float) -> Array:
    """Evenly spaced times (k + 1,) [s] from start to end, at most `max_step` apart; too many: InvalidInput."""
    if end - start > MAX_PIECES * max_step:
        raise InvalidInput(
            f"trajectory: expected at most {MAX_PIECES} pieces in {end - start:g} s, found pieces of {max_step:g} s"
        )
    count = max(1, int(np.ceil((end - start) / max_step))) if np.isfinite(max_step) else 1
    return np.linspace(start, end, count + 1)


def hermite_step(fourth_derivative: float, tolerance: float) -> float:
    """Largest step [s] for which cubic Hermite interpolation errs by at most `tolerance`.

    The error is at most h^4 max|f''''| / 384; for vectors the bound holds along every direction.
    """
    if fourth_derivative <= 0.0:
        return float("inf")
    return float((384.0 * tolerance / fourth_derivative) ** 0.25)
