"""Responses to a velocity: reached at once, by a ramp, or with a lag."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slalom.affine import Affine
from slalom.checks import Array, NotNegative, Positive
from slalom.fields import check_fields
from slalom.path import hermite_step
from slalom.response.protocol import affine, ramp, with_break
from slalom.response.time_invariant import Coefficients, TimeInvariant
from slalom.state import State
from slalom.tolerances import INTERPOLATION


@dataclass(frozen=True)
class Velocity(TimeInvariant):
    """u is a velocity [m/s], reached by a constant acceleration over `ramp` seconds and then constant.

    ramp = 0 is the assumption of the classical velocity obstacle, an instant change: gain t (Fiorini and Shiller 1998).
    With ramp = the control period it is the exact motion of a robot driven by acceleration. Prediction and simulation
    then agree, and |u - v| <= max_acceleration * ramp are the velocities reachable in one period.
    """

    interpolation_error: ClassVar[float] = 0.0
    ramp: NotNegative = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def restartable(self) -> bool:
        return self.ramp == 0.0

    def position_coefficients(self, time: Array) -> Coefficients:
        gain = time if self.ramp == 0 else ramp(time, self.ramp) / self.ramp
        return time - gain, gain

    def velocity_coefficients(self, time: Array) -> Coefficients:
        gain = np.ones_like(time) if self.ramp == 0 else np.minimum(time, self.ramp) / self.ramp
        return 1.0 - gain, gain

    def acceleration_coefficients(self, time: Array) -> Coefficients:
        gain = np.zeros_like(time) if self.ramp == 0 else (time < self.ramp) / self.ramp
        return -gain, gain

    def knots(self, horizon: float, speed_bound: float) -> Array:
        return with_break(horizon, self.ramp)

    def settled(self, horizon: float) -> float:
        return self.ramp

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity_at(state, max(self.ramp, 0.0)),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return () if self.ramp == 0 else (self.acceleration_at(state, 0.0),)


@dataclass(frozen=True)
class LaggedVelocity(TimeInvariant):
    """u is a velocity [m/s], approached by a proportional controller: dv/dt = (u - v) / lag.

    Gain t - lag (1 - e^(-t/lag)) (van den Berg, Snape, Guy and Manocha 2011, the AVO).
    """

    interpolation_error: ClassVar[float] = INTERPOLATION
    restartable: ClassVar[bool] = True
    lag: Positive

    def __post_init__(self) -> None:
        check_fields(self)

    def position_coefficients(self, time: Array) -> Coefficients:
        x = time / self.lag
        initial = -np.expm1(-x) * self.lag
        # For small x, t - lag (1 - e^-x) loses all digits; the series is exact to rounding there.
        series = time * x * (0.5 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x / 720))))
        return initial, np.where(x < 1e-2, series, time - initial)

    def velocity_coefficients(self, time: Array) -> Coefficients:
        return np.exp(-time / self.lag), -np.expm1(-time / self.lag)

    def acceleration_coefficients(self, time: Array) -> Coefficients:
        decay = np.exp(-time / self.lag) / self.lag
        return -decay, decay

    def knots(self, horizon: float, speed_bound: float) -> Array:
        # The fourth derivative is at most speed_bound e^(-t/lag) / lag^3 and decreases along a step. Its value at the
        # start of each step therefore bounds it, and steps grow until the last one ends at the horizon.
        times = [0.0]
        while times[-1] < horizon:
            fourth = speed_bound * np.exp(-times[-1] / self.lag) / self.lag**3
            remaining = horizon - times[-1]
            step = remaining if fourth * remaining**4 <= 384.0 * INTERPOLATION else hermite_step(fourth, INTERPOLATION)
            times.append(times[-1] + min(step, remaining))
        times[-1] = horizon
        return np.array(times)

    def settled(self, horizon: float) -> float:
        return self.lag

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (affine(np.zeros(state.dimension), np.array(1.0)),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.acceleration_at(state, 0.0),)
