"""Responses to an acceleration: held without end, or held and followed by constant velocity."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slalom.affine import Affine
from slalom.checks import Array, Positive
from slalom.fields import check_fields
from slalom.response.protocol import ramp, with_break
from slalom.response.time_invariant import Coefficients, TimeInvariant
from slalom.state import State


@dataclass(frozen=True)
class Acceleration(TimeInvariant):
    """u is an acceleration [m/s^2], held without end: gain t^2 / 2 (Stern and Shiller 2025, AO and NAO)."""

    interpolation_error: ClassVar[float] = 0.0
    restartable: ClassVar[bool] = True

    def position_coefficients(self, time: Array) -> Coefficients:
        return time, 0.5 * time * time

    def velocity_coefficients(self, time: Array) -> Coefficients:
        return np.ones_like(time), time

    def acceleration_coefficients(self, time: Array) -> Coefficients:
        return np.zeros_like(time), np.ones_like(time)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        return np.array([0.0, horizon])

    def settled(self, horizon: float) -> float:
        return min(1.0, horizon)

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity_at(state, horizon),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.acceleration_at(state, 0.0),)


@dataclass(frozen=True)
class AccelerateThenCoast(TimeInvariant):
    """u is an acceleration [m/s^2], held for `hold` seconds; then the velocity is constant.

    Gain t^2 / 2, then hold (t - hold / 2). The speed stays bounded, as that of a vehicle does.
    """

    interpolation_error: ClassVar[float] = 0.0
    restartable: ClassVar[bool] = False
    hold: Positive

    def __post_init__(self) -> None:
        check_fields(self)

    def position_coefficients(self, time: Array) -> Coefficients:
        return time, ramp(time, self.hold)

    def velocity_coefficients(self, time: Array) -> Coefficients:
        return np.ones_like(time), np.minimum(time, self.hold)

    def acceleration_coefficients(self, time: Array) -> Coefficients:
        return np.zeros_like(time), np.where(time < self.hold, 1.0, 0.0)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        return with_break(horizon, self.hold)

    def settled(self, horizon: float) -> float:
        return self.hold

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity_at(state, self.hold),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.acceleration_at(state, 0.0),)
