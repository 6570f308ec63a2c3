"""Responses to an acceleration: held for ever, or held and then coasting."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slalom.affine import Affine
from slalom.checks import Array, positive
from slalom.response.protocol import affine, ramp, times_of, with_break
from slalom.state import State


@dataclass(frozen=True)
class Acceleration:
    """u is an acceleration [m/s^2], held for ever: gain t^2 / 2 (Stern and Shiller 2025, AO and NAO)."""

    @property
    def interpolation_error(self) -> float:
        return 0.0

    @property
    def restartable(self) -> bool:
        return True

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        return affine(state.position + column * state.velocity, 0.5 * time * time)

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        return affine(state.velocity + 0.0 * column, time)

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        return affine(0.0 * column * state.velocity, np.ones_like(time))

    def knots(self, horizon: float, reach: float) -> Array:
        return np.array([0.0, horizon])

    def settled(self, horizon: float) -> float:
        return min(1.0, horizon)

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity(state, horizon),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.acceleration(state, 0.0),)


@dataclass(frozen=True)
class AccelerateThenCoast:
    """u is an acceleration [m/s^2], held for `hold` seconds; then the velocity stays.

    Gain t^2 / 2, then hold (t - hold / 2). A vehicle's speed does not grow for ever; this one's does not.
    """

    hold: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "hold", positive(self.hold, "hold"))

    @property
    def interpolation_error(self) -> float:
        return 0.0

    @property
    def restartable(self) -> bool:
        return False

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        return affine(state.position + column * state.velocity, ramp(time, self.hold))

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        return affine(state.velocity + 0.0 * column, np.minimum(time, self.hold))

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        return affine(0.0 * column * state.velocity, np.where(time < self.hold, 1.0, 0.0))

    def knots(self, horizon: float, reach: float) -> Array:
        return with_break(horizon, self.hold)

    def settled(self, horizon: float) -> float:
        return self.hold

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity(state, min(self.hold, horizon)),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.acceleration(state, 0.0),)
