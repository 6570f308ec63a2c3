"""Responses to an acceleration: held for ever, or held and then coasting or stopping."""

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


@dataclass(frozen=True)
class AccelerateThenStop:
    """u is an acceleration [m/s^2], held for `hold` seconds; then the robot brakes to rest.

    From then on the acceleration at each control period is -rate * v, held over the period, so the speed falls
    by the factor 1 - rate * period each time and a robot driven by constant accelerations follows exactly.
    rate <= max_acceleration / max_speed keeps the braking admissible.

    Args:
        hold: [s] > 0. rate: [1/s] > 0 with rate * period < 1. period: [s] > 0.
    """

    hold: float
    rate: float
    period: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "hold", positive(self.hold, "hold"))
        object.__setattr__(self, "rate", positive(self.rate, "rate"))
        object.__setattr__(self, "period", positive(self.period, "period"))
        if self.rate * self.period >= 1.0:
            positive(1.0 - self.rate * self.period, "1 - rate * period")

    @property
    def interpolation_error(self) -> float:
        return 0.0

    @property
    def restartable(self) -> bool:
        return False

    def _braking(self, time: Array) -> tuple[Array, Array, Array]:
        """Distance, speed and acceleration at time t after braking began, per unit of speed at its begin."""
        since = np.maximum(time - self.hold, 0.0)
        k = np.floor(since / self.period + 1e-9)
        within = np.maximum(since - k * self.period, 0.0)
        factor = 1.0 - self.rate * self.period
        speed = factor**k
        # Over one period from speed s the distance is s (period - rate period^2 / 2); these add up geometrically.
        whole = (1.0 - speed) / self.rate * (1.0 - 0.5 * self.rate * self.period)
        distance = whole + speed * within * (1.0 - 0.5 * self.rate * within)
        return distance, speed * (1.0 - self.rate * within), np.where(time < self.hold, 0.0, -self.rate * speed)

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = times_of(t)
        held, (distance, _, _) = np.minimum(time, self.hold), self._braking(time)
        return affine(
            state.position + (held + distance)[..., None] * state.velocity,
            0.5 * held * held + self.hold * distance,
        )

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = times_of(t)
        held, (_, speed, _) = np.minimum(time, self.hold), self._braking(time)
        return affine(speed[..., None] * state.velocity, np.where(time < self.hold, held, self.hold * speed))

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = times_of(t)
        _, _, braking = self._braking(time)
        return affine(braking[..., None] * state.velocity, np.where(time < self.hold, 1.0, self.hold * braking))

    def knots(self, horizon: float, reach: float) -> Array:
        braking = np.arange(self.hold, horizon, self.period)
        if braking.size and horizon - braking[-1] < 1e-9 * self.period:
            braking = braking[:-1]
        return np.concatenate([[0.0], braking, [horizon]])

    def settled(self, horizon: float) -> float:
        return self.hold

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity(state, min(self.hold, horizon)),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        first = self.acceleration(state, 0.0)
        return (first,) if horizon <= self.hold else (first, self.acceleration(state, self.hold))
