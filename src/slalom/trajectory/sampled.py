"""Trajectories through time-stamped positions."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Final

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, Checked, array, short, vectors
from slalom.errors import InvalidInput, OutsideSpan
from slalom.fields import check_fields
from slalom.path import Path, hermite, hermite_pieces

INTERPOLATIONS: Final = ("linear", "smooth")


@dataclass(frozen=True, eq=False)
class Sampled:
    """Interpolation of time-stamped positions from a tracker or a file; the obstacle exists from first to last stamp.

    Between stamps the position is `linear` (the velocity jumps at every stamp) or `smooth`. Smooth pieces are cubic;
    the velocity at each stamp is that of the parabola through it and its two neighbours. Quadratic motion is thus
    exact, and an outlier affects at most two stamps on either side. Stamps may be irregular.

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
        third = (np.diff(self.times) / 3)[:, None]
        return np.stack([p0, p0 + third * self._slopes[:-1], p3 - third * self._slopes[1:], p3], axis=1)

    def _local(self, t: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """Control points (..., 4, d) of the piece at each time, its duration [s], and the local time in [0, 1]."""
        time = np.asarray(t, dtype=np.float64)
        first, last = self.span
        if (time < first).any() or (time > last).any():
            outside = time[(time < first) | (time > last)].ravel()[0]
            raise OutsideSpan(f"t: expected a time from {first:g} to {last:g} s, found {outside:g} s")
        k = np.minimum(self.times.searchsorted(time, side="right") - 1, len(self.times) - 2)
        begin = self.times[k]
        h = self.times[k + 1] - begin
        return self._points[k], h, (time - begin) / h

    def position(self, t: npt.ArrayLike) -> Array:
        points, _, s = self._local(t)
        s = s[..., None]
        r, p0, p1, p2, p3 = 1 - s, points[..., 0, :], points[..., 1, :], points[..., 2, :], points[..., 3, :]
        return np.asarray(r * r * r * p0 + 3 * s * r * r * p1 + 3 * s * s * r * p2 + s * s * s * p3)

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
