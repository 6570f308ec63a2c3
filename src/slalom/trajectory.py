"""Where an obstacle is at every time of its life."""

from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, Checked, array, known, number, positive, vector, vectors
from slalom.errors import InvalidInput, OutsideSpan
from slalom.path import Path, even_knots, hermite, hermite_pieces, hermite_step
from slalom.tolerances import INTERPOLATION

FOREVER: Final = (-np.inf, np.inf)


@runtime_checkable
class Trajectory(Protocol):
    """A curve in the world frame over absolute time.

    Laws: `velocity` is the derivative of `position` and `acceleration` that of `velocity`, except at `breaks`;
    `speed_bound` and `acceleration_bound` hold between breaks; `path` stays within its stated error.
    Times t may have any shape (...); results are (..., d).
    """

    @property
    def dimension(self) -> int:
        """2 or 3."""

    @property
    def span(self) -> tuple[float, float]:
        """First and last time [s] at which the obstacle exists; -inf, inf when it always does."""

    def position(self, t: npt.ArrayLike) -> Array:
        """Position [m]. Raises OutsideSpan outside `span`."""

    def velocity(self, t: npt.ArrayLike) -> Array:
        """Velocity [m/s]; at a break, the one that follows it. Raises OutsideSpan."""

    def acceleration(self, t: npt.ArrayLike) -> Array:
        """Acceleration [m/s^2]; at a break, the one that follows it. Raises OutsideSpan."""

    def breaks(self, start: float, end: float) -> Array:
        """Times strictly between start and end at which velocity or acceleration may jump, increasing."""

    def speed_bound(self, start: float, end: float) -> float:
        """A bound of |velocity| [m/s] over start to end."""

    def acceleration_bound(self, start: float, end: float) -> float:
        """A bound of |acceleration| [m/s^2] between breaks from start to end."""

    def path(self, start: float, end: float) -> Path:
        """Cubic pieces over start to end (both within `span`), each within INTERPOLATION of the curve."""


class _Endless:
    """What trajectories without a beginning, an end and breaks have in common."""

    @property
    def span(self) -> tuple[float, float]:
        return FOREVER

    def breaks(self, start: float, end: float) -> Array:
        return np.empty(0)


@dataclass(frozen=True, eq=False)
class Stationary(_Endless):
    """At rest at `place` (d,) [m]."""

    place: Checked = Checked(vector)

    @property
    def dimension(self) -> int:
        return self.place.size

    def position(self, t: npt.ArrayLike) -> Array:
        return self.place + 0.0 * np.asarray(t, dtype=np.float64)[..., None]

    def velocity(self, t: npt.ArrayLike) -> Array:
        return np.zeros((*np.shape(t), self.dimension))

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return self.velocity(t)

    def speed_bound(self, start: float, end: float) -> float:
        return 0.0

    def acceleration_bound(self, start: float, end: float) -> float:
        return 0.0

    def path(self, start: float, end: float) -> Path:
        return _quadratic_path(self, start, end)


@dataclass(frozen=True, eq=False)
class ConstantVelocity(_Endless):
    """At `place` (d,) [m] at time `at` [s], moving with `speed` (d,) [m/s] for ever."""

    place: Checked = Checked(vector)
    speed: Checked = Checked(vector)
    at: float = 0.0

    def __post_init__(self) -> None:
        vector(self.speed, "speed", self.place.size)
        object.__setattr__(self, "at", number(self.at, "at"))

    @property
    def dimension(self) -> int:
        return self.place.size

    def position(self, t: npt.ArrayLike) -> Array:
        return self.place + (np.asarray(t, dtype=np.float64) - self.at)[..., None] * self.speed

    def velocity(self, t: npt.ArrayLike) -> Array:
        return np.broadcast_to(self.speed, (*np.shape(t), self.dimension))

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return np.zeros((*np.shape(t), self.dimension))

    def speed_bound(self, start: float, end: float) -> float:
        return float(np.linalg.norm(self.speed))

    def acceleration_bound(self, start: float, end: float) -> float:
        return 0.0

    def path(self, start: float, end: float) -> Path:
        return _quadratic_path(self, start, end)


@dataclass(frozen=True, eq=False)
class ConstantAcceleration(_Endless):
    """At `place` [m] at time `at` [s] with velocity `speed` [m/s], accelerating with `push` [m/s^2] for ever."""

    place: Checked = Checked(vector)
    speed: Checked = Checked(vector)
    push: Checked = Checked(vector)
    at: float = 0.0

    def __post_init__(self) -> None:
        vector(self.speed, "speed", self.place.size)
        vector(self.push, "push", self.place.size)
        object.__setattr__(self, "at", number(self.at, "at"))

    @property
    def dimension(self) -> int:
        return self.place.size

    def position(self, t: npt.ArrayLike) -> Array:
        elapsed = (np.asarray(t, dtype=np.float64) - self.at)[..., None]
        return self.place + elapsed * (self.speed + 0.5 * elapsed * self.push)

    def velocity(self, t: npt.ArrayLike) -> Array:
        return self.speed + (np.asarray(t, dtype=np.float64) - self.at)[..., None] * self.push

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return np.broadcast_to(self.push, (*np.shape(t), self.dimension))

    def speed_bound(self, start: float, end: float) -> float:
        return float(np.linalg.norm(self.velocity(np.array([start, end])), axis=-1).max())

    def acceleration_bound(self, start: float, end: float) -> float:
        return float(np.linalg.norm(self.push))

    def path(self, start: float, end: float) -> Path:
        return _quadratic_path(self, start, end)


@dataclass(frozen=True, eq=False)
class Circular(_Endless):
    """On a circle of `radius` [m] about `center` (d,) [m] at constant `speed` [m/s].

    Counter-clockwise for speed > 0, seen from the tip of `normal` (in space; in the plane there is none to give).
    At time 0 the angle from the x axis (in space: from the first of the two directions `basis`) is `phase` [rad].
    """

    center: Checked = Checked(vector)
    radius: float  # type: ignore[misc]  # the field before it has no default: Checked is a descriptor
    speed: float  # type: ignore[misc]
    phase: float = 0.0
    normal: npt.ArrayLike | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", positive(self.radius, "radius"))
        object.__setattr__(self, "speed", number(self.speed, "speed"))
        object.__setattr__(self, "phase", number(self.phase, "phase"))
        if self.normal is not None:
            if self.center.size == 2:
                raise InvalidInput("normal: expected none for a circle in the plane, found one")
            normal = vector(self.normal, "normal", 3)
            if not np.any(normal):
                raise InvalidInput("normal: expected a direction, found the zero vector")
            object.__setattr__(self, "normal", array(normal / np.linalg.norm(normal), "normal"))

    @property
    def dimension(self) -> int:
        return self.center.size

    @property
    def basis(self) -> Array:
        """Two unit vectors (2, d) that span the plane of the circle; the x and y axes for a normal along z."""
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


INTERPOLATIONS: Final = ("linear", "smooth")


@dataclass(frozen=True, eq=False)
class Sampled:
    """Time-stamped positions as they come from a tracker or a file; the obstacle exists from first to last.

    Between stamps the position is `linear` (velocity jumps at every stamp) or `smooth`: cubic pieces with, at
    each stamp, the velocity of the parabola through it and its two neighbours, so quadratic motion is exact and
    an outlier reaches no farther than two stamps. Stamps may be irregular.

    Args:
        times: (n,) [s], n >= 2, increasing. positions: (n, d) [m].

    Raises:
        InvalidInput: fewer than two stamps, not finite, times that do not increase.
    """

    times: Checked = Checked(array)
    positions: Checked = Checked(vectors)
    interpolation: str = "smooth"

    def __post_init__(self) -> None:
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
        known(self.interpolation, "interpolation", INTERPOLATIONS)
        object.__setattr__(self, "_slopes", self._stamp_velocities(times, positions))

    @staticmethod
    def _stamp_velocities(times: Array, positions: Array) -> Array:
        """Velocity at each stamp, of the parabola through it and its neighbours."""
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

    @property
    def span(self) -> tuple[float, float]:
        return float(self.times[0]), float(self.times[-1])

    def _local(self, t: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """Control points (..., 4, d) of the piece that holds each time, its length, and the place in it."""
        time = np.asarray(t, dtype=np.float64)
        first, last = self.span
        if np.any(time < first) or np.any(time > last):
            wrong = time[(time < first) | (time > last)].ravel()[0]
            raise OutsideSpan(f"t: expected a time from {first:g} to {last:g} s, found {wrong:g} s")
        k = np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, len(self.times) - 2)
        h = self.times[k + 1] - self.times[k]
        return self._control_points(k), h, (time - self.times[k]) / h

    def _control_points(self, k: npt.NDArray[np.int64]) -> Array:
        p0, p3 = self.positions[k], self.positions[k + 1]
        if self.interpolation == "linear":
            return np.stack([p0, (2 * p0 + p3) / 3, (p0 + 2 * p3) / 3, p3], axis=-2)
        slopes: Array = self._slopes  # type: ignore[attr-defined]
        third = ((self.times[k + 1] - self.times[k]) / 3)[..., None]
        return np.stack([p0, p0 + third * slopes[k], p3 - third * slopes[k + 1], p3], axis=-2)

    def position(self, t: npt.ArrayLike) -> Array:
        points, _, s = self._local(t)
        r = 1 - s
        weights = np.stack([r * r * r, 3 * s * r * r, 3 * s * s * r, s * s * s], axis=-1)
        return np.asarray(np.sum(weights[..., None] * points, axis=-2))

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
        """First and one past the last piece that overlap start to end: found by bisection, not by a scan."""
        first = int(np.searchsorted(self.times, start, side="right")) - 1
        last = int(np.searchsorted(self.times, end, side="left"))
        return min(max(first, 0), len(self.times) - 2), min(max(last, 1), len(self.times) - 1)

    def breaks(self, start: float, end: float) -> Array:
        first, last = self._pieces(start, end)
        inner = self.times[first : last + 1]
        return inner[(inner > start) & (inner < end)]

    def speed_bound(self, start: float, end: float) -> float:
        first, last = self._pieces(start, end)
        points = self._control_points(np.arange(first, last))
        h = np.diff(self.times[first : last + 1])[:, None, None]
        return float(np.linalg.norm(3 * np.diff(points, axis=-2) / h, axis=-1).max())

    def acceleration_bound(self, start: float, end: float) -> float:
        first, last = self._pieces(start, end)
        points = self._control_points(np.arange(first, last))
        h = np.diff(self.times[first : last + 1])[:, None, None]
        return float(np.linalg.norm(6 * np.diff(points, 2, axis=-2) / (h * h), axis=-1).max())

    def path(self, start: float, end: float) -> Path:
        times = np.concatenate([[start], self.breaks(start, end), [end]])
        if self.interpolation == "linear":
            positions = self.position(times)
            velocity = np.diff(positions, axis=0) / np.diff(times)[:, None]
            return hermite_pieces(times, positions, velocity, velocity, 0.0)
        return hermite(times, self.position(times), self.velocity(times))


TRAJECTORIES: Final[dict[str, type[Trajectory]]] = {
    "stationary": Stationary,
    "constant_velocity": ConstantVelocity,
    "constant_acceleration": ConstantAcceleration,
    "circular": Circular,
    "sampled": Sampled,
}
"""Every kind of trajectory by the name that scenario files and recordings use."""


def _quadratic_path(trajectory: Trajectory, start: float, end: float) -> Path:
    times = np.array([start, end])
    return hermite(times, trajectory.position(times), trajectory.velocity(times))
