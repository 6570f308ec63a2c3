"""Piecewise polynomials of any degree, as drone planners produce them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import comb

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, Checked, Number, array
from slalom.errors import InvalidInput, OutsideSpan
from slalom.fields import check_fields
from slalom.path import Path, even_knots, hermite_step
from slalom.tolerances import INTERPOLATION, JUMP
from slalom.trajectory.direction import direction_pieces


@dataclass(frozen=True, eq=False)
class PiecewisePolynomial:
    """Piece k lasts durations[k] seconds and has coefficients[k], in ascending powers of the time since its start.

    The obstacle exists from `start` [s] to `start` + the sum of the durations.

    Args:
        durations: (n,) [s], each above 0.
        coefficients: (n, degree + 1, d), in m, m/s, m/s^2, ...

    Raises:
        InvalidInput: values that are not finite, a duration that is not above 0, gaps between pieces above JUMP.
    """

    durations: Checked = Checked(array, "n")
    coefficients: Checked = Checked(array, "n n d")
    start: Number = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        shape = self.coefficients.shape
        if (
            self.durations.ndim != 1
            or len(shape) != 3
            or shape[2] not in (2, 3)
            or not 0 < self.durations.size == shape[0]
        ):
            raise InvalidInput(
                f"coefficients: expected (n, degree + 1, 2 or 3) for n >= 1 durations, "
                f"found {shape} for {self.durations.shape}"
            )
        if (self.durations <= 0).any():
            k = int(np.argmin(self.durations))
            raise InvalidInput(f"durations: expected times above 0, found {self.durations[k]:g} at index {k}")
        with np.errstate(over="ignore", invalid="ignore"):
            ends = _values(self.coefficients, self.durations)[:-1]
            jumps = np.linalg.norm(self.coefficients[1:, 0] - ends, axis=1)
        if not (jumps <= JUMP).all():
            jumps[np.isnan(jumps)] = np.inf
            k = int(np.argmax(jumps))
            raise InvalidInput(
                f"coefficients: expected pieces that meet, found a jump of {jumps[k]:g} m after piece {k}"
            )

    @cached_property
    def times(self) -> Array:
        """Start times of the pieces, and the end: (n + 1,) [s]."""
        return np.asarray(self.start + np.concatenate([[0.0], np.cumsum(self.durations)]))

    @property
    def dimension(self) -> int:
        return int(self.coefficients.shape[2])

    @property
    def span(self) -> tuple[float, float]:
        return float(self.times[0]), float(self.times[-1])

    def _derivative(self, t: npt.ArrayLike, order: int) -> Array:
        time = np.asarray(t, dtype=np.float64)
        first, last = self.span
        if np.any(time < first) or np.any(time > last):
            outside = time[(time < first) | (time > last)].ravel()[0]
            raise OutsideSpan(f"t: expected a time from {first:g} to {last:g} s, found {outside:g} s")
        k = np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, len(self.durations) - 1)
        return _values(_derived(self.coefficients, order)[k], time - self.times[k])

    def position(self, t: npt.ArrayLike) -> Array:
        return self._derivative(t, 0)

    def velocity(self, t: npt.ArrayLike) -> Array:
        return self._derivative(t, 1)

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return self._derivative(t, 2)

    def breaks(self, start: float, end: float) -> Array:
        return self.times[(self.times > start) & (self.times < end)]

    @cached_property
    def _bounds(self) -> dict[int, Array]:
        """Bounds (n, 8) of the norm of derivatives 1, 2 and 4 on each eighth of each piece, by order."""
        return {order: _norm_bounds(_derived(self.coefficients, order), self.durations) for order in (1, 2, 4)}

    def _bound(self, start: float, end: float, order: int) -> float:
        """Bound of the norm of a derivative from start to end [s]."""
        edges = self.times[:-1, None] + self.durations[:, None] * np.arange(9) / 8.0
        overlaps = (edges[:, :-1] <= end) & (edges[:, 1:] >= start)
        return float(self._bounds[order][overlaps].max(initial=0.0))

    def speed_bound(self, start: float, end: float) -> float:
        return self._bound(start, end, 1)

    def acceleration_bound(self, start: float, end: float) -> float:
        return self._bound(start, end, 2)

    def direction(self, start: float, end: float, tolerance: float) -> Path:
        """Direction of the motion in certified pieces, see `direction.Directed`."""
        edges = np.concatenate([[start], self.breaks(start, end), [end]])
        k = np.clip(np.searchsorted(self.times, 0.5 * (edges[:-1] + edges[1:]), side="right") - 1, 0, None)
        slopes = _derived(self.coefficients, 1)[k]
        velocities = _bernstein(slopes, (edges[:-1] - self.times[k])[:, None], np.diff(edges)[:, None])[:, 0]
        return direction_pieces(edges, velocities, tolerance)

    @property
    def is_cubic(self) -> bool:
        """Whether its pieces are exact as cubic pieces."""
        return bool(self.coefficients.shape[1] <= 4)

    def path(self, start: float, end: float) -> Path:
        edges = np.concatenate([[start], self.breaks(start, end), [end]])
        knots, error = (edges, np.zeros(len(edges) - 1)) if self.is_cubic else self._knots(edges)
        k = np.clip(np.searchsorted(self.times, 0.5 * (knots[:-1] + knots[1:]), side="right") - 1, 0, None)
        local_start, local_end = knots[:-1] - self.times[k], knots[1:] - self.times[k]
        slopes = _derived(self.coefficients, 1)[k]
        third = np.diff(knots) / 3.0
        return Path(knots, _control_points(self.coefficients[k], slopes, local_start, local_end, third), error)

    def _knots(self, edges: Array) -> tuple[Array, Array]:
        """Knots (n + 1,) [s] between which cubic pieces have errors (n,) [m] of at most INTERPOLATION."""
        times, errors = [edges[0]], list[float]()
        for begin, stop in pairwise(edges):
            fourth = self._bound(begin, stop, 4)
            knots = even_knots(float(begin), float(stop), hermite_step(fourth, INTERPOLATION))
            times.extend(knots[1:])
            errors.extend([fourth * (knots[1] - knots[0]) ** 4 / 384.0] * (len(knots) - 1))
        return np.array(times), np.array(errors)


def cubic_paths(several: Sequence[PiecewisePolynomial], start: float, end: float) -> tuple[Array, Array]:
    """The paths of cubic trajectories with the same `times` at once: knots (q + 1,) [s], control points (n, q, 4, d).

    To the bit those of `PiecewisePolynomial.path`.
    """
    one = several[0]
    knots = np.concatenate([[start], one.breaks(start, end), [end]])
    k = np.clip(np.searchsorted(one.times, 0.5 * (knots[:-1] + knots[1:]), side="right") - 1, 0, None)
    coefficients = np.stack([each.coefficients for each in several])[:, k]
    local_start, local_end = knots[:-1] - one.times[k], knots[1:] - one.times[k]
    slopes = _derived(coefficients, 1)
    return knots, _control_points(coefficients, slopes, local_start, local_end, np.diff(knots) / 3.0)


def _control_points(coefficients: Array, slopes: Array, begin: Array, end: Array, third: Array) -> Array:
    """Control points (..., q, 4, d) of polynomials (..., q, degree + 1, d) from local times `begin` to `end` (q,) [s].

    Each piece has its own position and velocity at its ends. `third` (q,) [s] of its duration.
    """
    points = np.empty((*coefficients.shape[:-2], 4, coefficients.shape[-1]))
    third = third[:, None]
    points[..., 0, :] = _values(coefficients, begin)
    points[..., 1, :] = points[..., 0, :] + third * _values(slopes, begin)
    points[..., 3, :] = _values(coefficients, end)
    points[..., 2, :] = points[..., 3, :] - third * _values(slopes, end)
    return points


def _values(coefficients: Array, t: Array) -> Array:
    """Values (..., d) of polynomials (..., degree + 1, d) at local times (...)."""
    result = np.zeros((*coefficients.shape[:-2], coefficients.shape[-1]))
    for power in range(coefficients.shape[-2] - 1, -1, -1):
        result = result * np.asarray(t)[..., None] + coefficients[..., power, :]
    return result


def _derived(coefficients: Array, order: int) -> Array:
    """Coefficients (..., k, d) of the derivative of that order; k >= 1 (a zero if nothing remains)."""
    for _ in range(order):
        powers = np.arange(coefficients.shape[-2], dtype=np.float64)[1:, None]
        coefficients = coefficients[..., 1:, :] * powers
    if coefficients.shape[-2] == 0:
        return np.zeros((*coefficients.shape[:-2], 1, coefficients.shape[-1]))
    return coefficients


def _norm_bounds(coefficients: Array, durations: Array) -> Array:
    """Bounds (n, 8) of |polynomial| on each eighth of each piece: the largest of its Bernstein coefficients there."""
    eighth = durations[:, None] / 8.0 * np.ones(8)
    return np.asarray(np.linalg.norm(_bernstein(coefficients, eighth * np.arange(8), eighth), axis=-1).max(axis=-1))


def _bernstein(coefficients: Array, begin: Array, width: Array) -> Array:
    """Control points (n, e, degree + 1, d) of each piece (n, degree + 1, d) on intervals from `begin`, `width` long.

    `begin` and `width` are (n, e) [s], local to the piece.
    """
    n = coefficients.shape[1] - 1
    powers = np.arange(n + 1)
    # p(begin + width s) = sum_k s^k width^k sum_j comb(j, k) begin^(j - k) c_j, then converted to Bernstein form in s.
    shift = np.array([[comb(j, k) for j in powers] for k in powers], dtype=np.float64)
    exponent = np.maximum(powers[None, :] - powers[:, None], 0)
    moved = np.einsum("kj,pekj,pjd->pekd", shift, begin[..., None, None] ** exponent, coefficients)
    scaled = moved * (width[..., None] ** powers)[..., None]
    change = np.array([[comb(i, j) / comb(n, j) for j in powers] for i in powers])
    return np.asarray(np.einsum("ij,pejd->peid", change, scaled))
