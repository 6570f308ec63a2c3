"""Headings of bodies that are known by themselves, as recordings and trackers state them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, Checked, array, short
from slalom.errors import InvalidInput
from slalom.fields import check_fields
from slalom.path import Path, even_knots, hermite, hermite_step


@dataclass(frozen=True, eq=False)
class Headings:
    """Heading of a body at time stamps, linear between them; before the first and after the last it stays as it is.

    A step of pi or more between stamps counts as the shorter turn. For one of pi rounding decides.

    Args:
        times: (n,) [s], increasing.
        angles: (n,) [rad], counter-clockwise from the world's x axis.

    Raises:
        InvalidInput: no stamps, values that are not finite, times that do not increase.
    """

    times: Checked = Checked(array, "n")
    angles: Checked = Checked(array, "n")

    def __post_init__(self) -> None:
        check_fields(self)
        times, angles = self.times, self.angles
        if times.ndim != 1 or times.size == 0 or angles.shape != times.shape:
            raise InvalidInput(
                "angles: expected one for each time, and one or more, "
                f"found shape {angles.shape} for times of shape {times.shape}"
            )
        if np.any(np.diff(times) <= 0.0):
            raise InvalidInput(f"times: expected increasing times, found {short(times)}")

    @cached_property
    def _continuous(self) -> Array:
        """The angles (n,) [rad] without jumps. Files hold those that were given: after a half turn these may differ."""
        return np.asarray(np.unwrap(self.angles))

    @property
    def in_files(self) -> dict[str, list[float]]:
        """Times and angles as files hold them."""
        return {"times": self.times.tolist(), "angles": self.angles.tolist()}

    def angle(self, t: npt.ArrayLike) -> Array:
        """Angles (...) [rad] at times t (...) [s]."""
        return np.asarray(np.interp(np.asarray(t, dtype=np.float64), self.times, self._continuous))

    def direction(self, t: npt.ArrayLike) -> Array:
        """Unit vectors (..., 2) at times t (...) [s]."""
        angle = self.angle(t)
        return np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    def directions(self, start: float, end: float, tolerance: float) -> Path:
        """Unit vectors from start to end [s] as cubic pieces within `tolerance` [1] or with their own error."""
        inner = self.times[(self.times > start) & (self.times < end)]
        stamps = np.concatenate([[start], inner, [end]])
        rates = np.diff(self.angle(stamps)) / np.diff(stamps)
        parts = [self._turn(a, b, w, tolerance) for a, b, w in zip(stamps[:-1], stamps[1:], rates.tolist())]
        return Path(
            np.concatenate([part.times[:-1] for part in parts] + [[end]]),
            np.concatenate([part.points for part in parts]),
            np.concatenate([part.error for part in parts]),
        )

    def _turn(self, start: float, end: float, rate: float, tolerance: float) -> Path:
        """Unit vectors that turn at one rate [rad/s], from start to end [s]."""
        times = even_knots(start, end, hermite_step(rate**4, tolerance))
        angle = self.angle(start) + rate * (times - start)
        e = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        error = rate**4 * (times[1] - times[0]) ** 4 / 384.0
        return hermite(times, e, rate * np.stack([-e[:, 1], e[:, 0]], axis=-1), error)
