"""Response that continues with a fixed sequence of accelerations."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from slalom.affine import Affine
from slalom.checks import Array, Positive, listing, pair, positive, vector
from slalom.errors import InvalidInput
from slalom.fields import check_fields
from slalom.response.protocol import affine, ramp, times_of
from slalom.state import State


@dataclass(frozen=True, repr=False)
class AccelerationSequence:
    """u is an acceleration [m/s^2], held for `hold` seconds; `then` follows, then the velocity is constant.

    The gain is that of `AccelerateThenCoast`; the later accelerations do not depend on u. `then` holds them in order,
    each with its duration: ((seconds, (ax, ay)), ...).
    """

    interpolation_error: ClassVar[float] = 0.0
    restartable: ClassVar[bool] = False
    hold: Positive
    then: tuple[tuple[float, tuple[float, ...]], ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        listing(self.then, "durations and accelerations", "then")
        pairs = [pair(one, "a duration and an acceleration", f"then[{k}]") for k, one in enumerate(self.then)]
        then = tuple(
            (positive(seconds, f"then[{k}]"), tuple(vector(acceleration, f"then[{k}]").tolist()))
            for k, (seconds, acceleration) in enumerate(pairs)
        )
        dimensions = {len(acceleration) for _, acceleration in then}
        if len(dimensions) > 1:
            raise InvalidInput(f"then: expected accelerations of the same dimension, found {sorted(dimensions)}")
        object.__setattr__(self, "then", then)

    def __repr__(self) -> str:
        return f"AccelerationSequence(hold={self.hold:g}, then={len(self.then)} more)"

    @property
    def ends(self) -> Array:
        """End times (1 + n,) [s] of the accelerations."""
        return np.cumsum([self.hold, *(seconds for seconds, _ in self.then)])

    def _accelerations(self, dimension: int) -> Array:
        """Later accelerations (n, d) [m/s^2].

        Raises:
            InvalidInput: accelerations of another dimension.
        """
        if self.then and len(self.then[0][1]) != dimension:
            raise InvalidInput(f"then: expected dimension {dimension} as of the state, found {len(self.then[0][1])}")
        return np.array([acceleration for _, acceleration in self.then]).reshape(-1, dimension)

    def _elapsed(self, time: Array) -> tuple[Array, Array]:
        """Time since each later acceleration started (..., n) [s], 0 before it, and its duration (n,) [s]."""
        ends = self.ends
        return np.maximum(time[..., None] - ends[:-1], 0.0), np.diff(ends)

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        since, held = self._elapsed(time)
        later = np.where(since < held, 0.5 * since**2, held * (since - 0.5 * held)) @ self._accelerations(
            state.dimension
        )
        return affine(state.position + column * state.velocity + later, ramp(time, self.hold))

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        since, held = self._elapsed(time)
        later = np.minimum(since, held) @ self._accelerations(state.dimension)
        return affine(state.velocity + 0.0 * column + later, np.minimum(time, self.hold))

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = times_of(t)
        ends = self.ends
        active = (time[..., None] >= ends[:-1]) & (time[..., None] < ends[1:])
        later = active.astype(np.float64) @ self._accelerations(state.dimension)
        return affine(later, np.where(time < self.hold, 1.0, 0.0))

    def knots(self, horizon: float, speed_bound: float) -> Array:
        ends = self.ends
        return np.concatenate([[0.0], ends[ends < horizon], [horizon]])

    def settled(self, horizon: float) -> float:
        return self.hold

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        # The speed is convex while an acceleration is held: its maximum is at an end.
        return tuple(self.velocity(state, float(end)) for end in self.ends)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        starts = np.concatenate([[0.0], self.ends[:-1]])
        return tuple(self.acceleration(state, float(at)) for at in starts)
