"""Trajectories at rest, at constant velocity, and at constant acceleration."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import comb
from typing import Annotated, Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, Checked, Direction, Number, Positive, array, check_fields, short, vector, vectors
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import INTERPOLATION, JUMP
from slalom.model.path import Path, even_knots, hermite, hermite_pieces, hermite_step
from slalom.model.trajectory.protocol import Endless, Trajectory, direction_pieces, times_within


class _Quadratic(Endless):
    """A trajectory whose position is a polynomial of degree 2 at most: one exact piece."""

    initial_position: Checked

    @property
    def dimension(self) -> int:
        return self.initial_position.size

    def path(self, start: float, end: float) -> Path:
        return Path(np.array([start, end]), quadratic_paths([self], start, np.array([end])), np.zeros(1))


def quadratic_paths(several: Sequence[object], start: float, end: Array, derivatives: int = 2) -> Array:
    """Control points (n, 4, d) [m] of the paths of QUADRATIC trajectories, from start to `end` (n,) [s].

    With 1 of the `derivatives` they have no acceleration from the start on.
    """
    # Read so, since a field that is `Checked` takes a call in Python.
    fields = [vars(one) for one in several]
    position = np.array([each["initial_position"] for each in fields])
    none = np.zeros(position.shape[1])
    velocity = np.array([each.get("initial_velocity", none) for each in fields])
    acceleration = np.array([each.get("initial_acceleration", none) for each in fields])
    elapsed = start - np.array([[each.get("at", start)] for each in fields])
    duration = (end - start)[:, None]
    step = (velocity + elapsed * acceleration) * (duration / 3.0)
    second_difference = (acceleration if derivatives == 2 else 0.0 * acceleration) * (duration * duration / 6.0)
    points = np.empty((len(fields), 4, len(none)))
    points[:, 0] = position + elapsed * (velocity + 0.5 * elapsed * acceleration)
    points[:, 1] = points[:, 0] + step
    points[:, 2] = points[:, 1] + step + second_difference
    points[:, 3] = points[:, 2] + step + 2.0 * second_difference
    return points


@dataclass(frozen=True, eq=False)
class Stationary(_Quadratic):
    """At rest at `initial_position` (d,) [m]."""

    initial_position: Checked = Checked(vector, key="position")

    def position(self, t: npt.ArrayLike) -> Array:
        # One time, as in each decision, needs no array of times.
        shape = () if isinstance(t, float) else np.shape(t)
        return np.tile(self.initial_position, (*shape, 1)) if shape else self.initial_position.copy()

    def velocity(self, t: npt.ArrayLike) -> Array:
        return np.zeros((*np.shape(t), self.dimension))

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return self.velocity(t)

    def speed_bound(self, start: float, end: float) -> float:
        return 0.0

    def acceleration_bound(self, start: float, end: float) -> float:
        return 0.0


@dataclass(frozen=True, eq=False)
class ConstantVelocity(_Quadratic):
    """At `initial_position` (d,) [m] at time `at` [s], with constant `initial_velocity` (d,) [m/s]."""

    initial_position: Checked = Checked(vector, key="position")
    initial_velocity: Checked = Checked(vector, key="velocity")
    at: Number = 0.0

    def __post_init__(self) -> None:
        vector(self.initial_velocity, "initial_velocity", self.initial_position.size)
        check_fields(self)

    def position(self, t: npt.ArrayLike) -> Array:
        return self.initial_position + (np.asarray(t, dtype=np.float64) - self.at)[..., None] * self.initial_velocity

    def velocity(self, t: npt.ArrayLike) -> Array:
        return np.broadcast_to(self.initial_velocity, (*np.shape(t), self.dimension))

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return np.zeros((*np.shape(t), self.dimension))

    def speed_bound(self, start: float, end: float) -> float:
        return float(np.linalg.norm(self.initial_velocity))

    def acceleration_bound(self, start: float, end: float) -> float:
        return 0.0


@dataclass(frozen=True, eq=False)
class ConstantAcceleration(_Quadratic):
    """At `initial_position` with `initial_velocity` at time `at` [s]; `initial_acceleration` is constant.

    All three are (d,), in [m], [m/s] and [m/s^2].
    """

    initial_position: Checked = Checked(vector, key="position")
    initial_velocity: Checked = Checked(vector, key="velocity")
    initial_acceleration: Checked = Checked(vector, key="acceleration")
    at: Number = 0.0

    def __post_init__(self) -> None:
        vector(self.initial_velocity, "initial_velocity", self.initial_position.size)
        vector(self.initial_acceleration, "initial_acceleration", self.initial_position.size)
        check_fields(self)

    def position(self, t: npt.ArrayLike) -> Array:
        elapsed = (np.asarray(t, dtype=np.float64) - self.at)[..., None]
        return self.initial_position + elapsed * (self.initial_velocity + 0.5 * elapsed * self.initial_acceleration)

    def velocity(self, t: npt.ArrayLike) -> Array:
        return (
            self.initial_velocity + (np.asarray(t, dtype=np.float64) - self.at)[..., None] * self.initial_acceleration
        )

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return np.broadcast_to(self.initial_acceleration, (*np.shape(t), self.dimension))

    def speed_bound(self, start: float, end: float) -> float:
        return float(np.linalg.norm(self.velocity(np.array([start, end])), axis=-1).max())

    def acceleration_bound(self, start: float, end: float) -> float:
        return float(np.linalg.norm(self.initial_acceleration))


# Piecewise polynomials of any degree, as drone planners produce them.


QUADRATIC: Final = (Stationary, ConstantVelocity, ConstantAcceleration)
"""Kinds of trajectories without start and end whose path is one piece."""


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
        time = times_within(self.span, t)
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


def positions_of(tracks: Sequence[Trajectory], times: Array) -> Array:
    """Positions (n, k, d) [m] of n tracks at `times` (n, k) [s], to the bit those of `position`.

    Those of `Sampled` take less time together than one by one.

    Raises:
        OutsideSpan: a time at which a track does not exist.
    """
    sampled = [k for k, track in enumerate(tracks) if isinstance(track, Sampled)]
    found = np.empty((*times.shape, tracks[0].dimension))
    for k, track in enumerate(tracks):
        if not isinstance(track, Sampled):
            found[k] = track.position(times[k])
    if sampled:
        local = [tracks[k]._local(times[k]) for k in sampled]  # type: ignore[attr-defined]  # they are Sampled
        points, _, shares = (np.stack(column) for column in zip(*local, strict=True))
        found[sampled] = _cubic(points, shares)
    return found


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


def _cubic(points: Array, share: Array) -> Array:
    """Points (..., d) of cubic pieces with control points (..., 4, d) at the share (...) [1] of their duration."""
    s = share[..., None]
    r = 1 - s
    p0, p1, p2, p3 = (points[..., k, :] for k in range(4))
    return np.asarray(r * r * r * p0 + 3 * s * r * r * p1 + 3 * s * s * r * p2 + s * s * s * p3)


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


# Circular motion at constant speed.


@dataclass(frozen=True, eq=False)
class Circular(Endless):
    """Circle of `radius` [m] about `center` (d,) [m] at constant `speed` [m/s].

    Counter-clockwise for speed > 0, seen from the tip of `normal` (in space only). At time 0 the angle from the x axis
    (in space: from the first of the two directions `basis`) is `phase` [rad].

    Raises:
        InvalidInput: a radius that is not above 0, or a normal in the plane.
    """

    center: Checked = Checked(vector)
    radius: Positive  # type: ignore[misc]  # the field before it has no default: Checked is a descriptor
    speed: Number  # type: ignore[misc]  # the same
    phase: Number = 0.0
    normal: Direction = None

    def __post_init__(self) -> None:
        check_fields(self)
        if self.normal is not None:
            if self.center.size == 2:
                raise InvalidInput("normal: expected none for a circle in the plane, found one")
            vector(self.normal, "normal", 3)

    @property
    def dimension(self) -> int:
        return self.center.size

    @property
    def basis(self) -> Array:
        """Unit vectors (2, d) that span the plane of the circle; the x and y axes for a normal along z."""
        if self.dimension == 2:
            return np.eye(2)
        n = np.array([0.0, 0.0, 1.0] if self.normal is None else self.normal)
        x = np.array([1.0, 0.0, 0.0]) if abs(n[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
        first = x - (x @ n) * n
        first /= np.linalg.norm(first)
        return np.array([first, np.cross(n, first)])

    @property
    def rate(self) -> float:
        """Angular velocity [rad/s], counter-clockwise positive."""
        return self.speed / self.radius

    def _on_circle(self, t: npt.ArrayLike, quarter_turns: int, length: float) -> Array:
        angle = self.phase + self.rate * np.asarray(t, dtype=np.float64) + 0.5 * np.pi * quarter_turns
        return length * (np.stack([np.cos(angle), np.sin(angle)], axis=-1) @ self.basis)

    def position(self, t: npt.ArrayLike) -> Array:
        return self.center + self._on_circle(t, 0, self.radius)

    def velocity(self, t: npt.ArrayLike) -> Array:
        return self._on_circle(t, 1, self.speed)

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return self._on_circle(t, 2, self.speed * self.rate)

    def speed_bound(self, start: float, end: float) -> float:
        return abs(self.speed)

    def acceleration_bound(self, start: float, end: float) -> float:
        return abs(self.speed * self.rate)

    def path(self, start: float, end: float) -> Path:
        fourth = self.radius * self.rate**4
        times = even_knots(start, end, hermite_step(fourth, INTERPOLATION))
        error = fourth * (times[1] - times[0]) ** 4 / 384.0
        angle = self.phase + self.rate * times
        cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
        first, second = self.basis
        position = self.center + self.radius * (cosine * first + sine * second)
        return hermite(times, position, self.speed * (cosine * second - sine * first), error)

    def direction(self, start: float, end: float, tolerance: float) -> Path:
        """Direction of the motion in certified pieces, see `direction.Directed`. Raises InvalidInput at speed 0."""
        if self.speed == 0.0:
            raise InvalidInput("heading: expected a trajectory that moves, found a circle at speed 0")
        fourth = self.rate**4
        times = even_knots(start, end, hermite_step(fourth, tolerance))
        error = fourth * (times[1] - times[0]) ** 4 / 384.0
        side = np.sign(self.speed)
        return hermite(times, self._on_circle(times, 1, side), self._on_circle(times, 2, side * self.rate), error)


# Trajectories through time-stamped positions.


INTERPOLATIONS: Final = ("linear", "smooth")

LONG_PIECE: Final = 10.0
"""[1] A smooth piece that is longer than this many times the shorter one beside it is straight. Larger: the velocity
before a gap carries the position far past its last stamp. Smaller: the velocity jumps more often."""


@dataclass(frozen=True, eq=False)
class Sampled:
    """Interpolation of time-stamped positions from a tracker or a file; the obstacle exists from first to last stamp.

    Between stamps the position is `linear` (the velocity jumps at every stamp) or `smooth`. Smooth pieces are cubic;
    the velocity at each stamp is that of the parabola through it and its two neighbours. Quadratic motion is thus
    exact, and an outlier affects at most two stamps on either side. Stamps may be irregular; over a gap, a piece longer
    than LONG_PIECE times the shorter one beside it, the position is linear.

    Args:
        times: (n,) [s], n >= 2, increasing.
        positions: (n, d) [m].

    Raises:
        InvalidInput: fewer than two stamps, values that are not finite, times that do not increase.
    """

    times: Checked = Checked(array, "n")
    positions: Checked = Checked(vectors, "n d")
    interpolation: Annotated[str, INTERPOLATIONS] = "smooth"

    def __post_init__(self) -> None:
        check_fields(self)
        times, positions = self.times, self.positions
        if times.ndim != 1 or positions.shape[:-1] != times.shape:
            raise InvalidInput(f"positions: expected one for each time, found {positions.shape} for {times.shape}")
        if times.size < 2:
            raise InvalidInput(f"times: expected at least two samples, found {times.size}")
        if np.any(np.diff(times) <= 0):
            k = int(np.argmax(np.diff(times) <= 0))
            raise InvalidInput(
                f"times: expected increasing times, found {times[k]:g} followed by {times[k + 1]:g} at index {k + 1}"
            )
        with np.errstate(over="ignore", invalid="ignore"):
            slopes = self._slopes
        if not np.isfinite(slopes).all():
            raise InvalidInput(f"positions: expected finite velocities between samples, found {short(slopes)}")

    @cached_property
    def _slopes(self) -> Array:
        """Velocities (n, d) [m/s] at the stamps, of the parabola through each stamp and its neighbours."""
        times, positions = self.times, self.positions
        h = np.diff(times)[:, None]
        chord = np.diff(positions, axis=0) / h
        slopes = np.empty_like(positions)
        slopes[1:-1] = (h[1:] * chord[:-1] + h[:-1] * chord[1:]) / (h[1:] + h[:-1])
        slopes[0] = 2.0 * chord[0] - slopes[1] if len(times) > 2 else chord[0]
        slopes[-1] = 2.0 * chord[-1] - slopes[-2] if len(times) > 2 else chord[-1]
        return slopes

    @property
    def dimension(self) -> int:
        return int(self.positions.shape[1])

    @cached_property
    def span(self) -> tuple[float, float]:
        return float(self.times[0]), float(self.times[-1])

    @cached_property
    def _points(self) -> Array:
        """Control points (n - 1, 4, d) [m] of all pieces."""
        p0, p3 = self.positions[:-1], self.positions[1:]
        if self.interpolation == "linear":
            return np.stack([p0, (2 * p0 + p3) / 3, (p0 + 2 * p3) / 3, p3], axis=1)
        h = np.diff(self.times)
        third = (h / 3)[:, None]
        beside = np.minimum(np.append(np.inf, h[:-1]), np.append(h[1:], np.inf))
        straight = (h > LONG_PIECE * beside)[:, None]
        p1 = np.where(straight, (2 * p0 + p3) / 3, p0 + third * self._slopes[:-1])
        p2 = np.where(straight, (p0 + 2 * p3) / 3, p3 - third * self._slopes[1:])
        return np.stack([p0, p1, p2, p3], axis=1)

    def _local(self, t: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """Control points (..., 4, d) of the piece at each time, its duration [s], and the local time in [0, 1]."""
        time = times_within(self.span, t)
        k = np.minimum(self.times.searchsorted(time, side="right") - 1, len(self.times) - 2)
        begin = self.times[k]
        h = self.times[k + 1] - begin
        return self._points[k], h, (time - begin) / h

    def position(self, t: npt.ArrayLike) -> Array:
        points, _, s = self._local(t)
        return _cubic(points, s)

    def velocity(self, t: npt.ArrayLike) -> Array:
        points, h, s = self._local(t)
        r = 1 - s
        weights = np.stack([r * r, 2 * s * r, s * s], axis=-1) * 3
        return np.asarray(np.sum(weights[..., None] * np.diff(points, axis=-2), axis=-2) / h[..., None])

    def acceleration(self, t: npt.ArrayLike) -> Array:
        points, h, s = self._local(t)
        weights = np.stack([1 - s, s], axis=-1) * 6
        return np.asarray(np.sum(weights[..., None] * np.diff(points, 2, axis=-2), axis=-2) / (h * h)[..., None])

    def _pieces(self, start: float, end: float) -> tuple[int, int]:
        """Index of the first piece that overlaps start to end, and one past the last: by bisection."""
        first = int(np.searchsorted(self.times, start, side="right")) - 1
        last = int(np.searchsorted(self.times, end, side="left"))
        return min(max(first, 0), len(self.times) - 2), min(max(last, 1), len(self.times) - 1)

    def breaks(self, start: float, end: float) -> Array:
        first, last = self._pieces(start, end)
        inner = self.times[first : last + 1]
        return inner[(inner > start) & (inner < end)]

    def speed_bound(self, start: float, end: float) -> float:
        first, last = self._pieces(start, end)
        points = self._points[first:last]
        h = np.diff(self.times[first : last + 1])[:, None, None]
        return float(np.linalg.norm(3 * np.diff(points, axis=-2) / h, axis=-1).max())

    def acceleration_bound(self, start: float, end: float) -> float:
        first, last = self._pieces(start, end)
        points = self._points[first:last]
        h = np.diff(self.times[first : last + 1])[:, None, None]
        return float(np.linalg.norm(6 * np.diff(points, 2, axis=-2) / (h * h), axis=-1).max())

    def path(self, start: float, end: float) -> Path:
        times = np.concatenate([[start], self.breaks(start, end), [end]])
        if self.interpolation == "linear":
            positions = self.position(times)
            velocity = np.diff(positions, axis=0) / np.diff(times)[:, None]
            return hermite_pieces(times, positions, velocity, velocity, 0.0)
        return hermite(times, self.position(times), self.velocity(times))
