"""Response to a jerk."""

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from slalom.affine import Affine
from slalom.checks import Array
from slalom.response.protocol import affine, times_of
from slalom.state import State


@dataclass(frozen=True)
class Jerk:
    """u is a jerk [m/s^3], held without end from the present acceleration: gain t^3 / 6."""

    interpolation_error: ClassVar[float] = 0.0
    restartable: ClassVar[bool] = True

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        drift = state.position + column * (state.velocity + 0.5 * column * state.acceleration)
        return affine(drift, time**3 / 6.0)

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        return affine(state.velocity + column * state.acceleration, 0.5 * time * time)

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        return affine(state.acceleration + 0.0 * column, time)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        return np.array([0.0, horizon])

    def settled(self, horizon: float) -> float:
        return min(1.0, horizon)

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        # The velocity is quadratic in t: on each eighth of the horizon it lies in the hull of its control points.
        times = np.linspace(0.0, horizon, 9)
        peaks = []
        for start, end in pairwise(times):
            v, a = self.velocity(state, start), self.acceleration(state, start)
            half = 0.5 * (end - start)
            peaks += [affine(v.drift + half * a.drift, v.gain + half * a.gain), self.velocity(state, end)]
        return tuple(peak for peak in peaks if peak.gain > 0)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.acceleration(state, horizon),)
