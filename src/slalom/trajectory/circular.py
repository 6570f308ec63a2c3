"""Circular motion at constant speed."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, Checked, Direction, Number, Positive, vector
from slalom.errors import InvalidInput
from slalom.fields import check_fields
from slalom.path import Path, even_knots, hermite, hermite_step
from slalom.tolerances import INTERPOLATION
from slalom.trajectory.protocol import Endless


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
