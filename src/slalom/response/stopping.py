"""Responses to an acceleration that is held and followed by a stop."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slalom.affine import Affine
from slalom.checks import Array, Positive, positive
from slalom.fields import check_fields
from slalom.response.time_invariant import Coefficients, TimeInvariant
from slalom.state import State
from slalom.tolerances import WHOLE_COUNT


class _Stopping(TimeInvariant):
    """Acceleration held for `hold` seconds, then braking proportional to the velocity at the start of braking."""

    interpolation_error: ClassVar[float] = 0.0
    restartable: ClassVar[bool] = False
    hold: float

    @abstractmethod
    def _braking(self, time: Array) -> tuple[Array, Array, Array]:
        """Distance, speed and acceleration at times (...) [s], per unit of speed at the start of braking."""

    def position_coefficients(self, time: Array) -> Coefficients:
        held, (distance, _, _) = np.minimum(time, self.hold), self._braking(time)
        return held + distance, 0.5 * held * held + self.hold * distance

    def velocity_coefficients(self, time: Array) -> Coefficients:
        held, (_, speed, _) = np.minimum(time, self.hold), self._braking(time)
        return speed, np.where(time < self.hold, held, self.hold * speed)

    def acceleration_coefficients(self, time: Array) -> Coefficients:
        _, _, braking = self._braking(time)
        return braking, np.where(time < self.hold, 1.0, self.hold * braking)

    def settled(self, horizon: float) -> float:
        return self.hold

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity_at(state, self.hold),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return self.acceleration_at(state, 0.0), self.acceleration_at(state, self.hold)


@dataclass(frozen=True)
class AccelerateThenStop(_Stopping):
    """u is an acceleration [m/s^2], held for `hold` seconds; then the robot brakes to rest.

    From then on the acceleration of each control period is -rate * v, constant over the period. The speed thus
    decreases by the factor 1 - rate * period per period, and a robot with piecewise constant acceleration follows
    exactly. rate <= max_acceleration / max_speed keeps the braking admissible.

    Args:
        hold: [s] > 0.
        rate: [1/s] > 0 with rate * period < 1.
        period: [s] > 0.
    """

    hold: Positive
    rate: Positive
    period: Positive

    def __post_init__(self) -> None:
        check_fields(self)
        if self.rate * self.period >= 1.0:
            positive(1.0 - self.rate * self.period, "1 - rate * period")

    def _braking(self, time: Array) -> tuple[Array, Array, Array]:
        """Distance, speed and acceleration at times (...) [s], per unit of speed at the start of braking."""
        elapsed = np.maximum(time - self.hold, 0.0)
        k = np.floor(elapsed / self.period + WHOLE_COUNT)
        in_period = np.maximum(elapsed - k * self.period, 0.0)
        factor = 1.0 - self.rate * self.period
        speed = factor**k
        # Over one period from speed s the distance is s (period - rate period^2 / 2): a geometric series.
        full_periods = (1.0 - speed) / self.rate * (1.0 - 0.5 * self.rate * self.period)
        distance = full_periods + speed * in_period * (1.0 - 0.5 * self.rate * in_period)
        return distance, speed * (1.0 - self.rate * in_period), np.where(time < self.hold, 0.0, -self.rate * speed)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        braking = np.arange(self.hold, horizon, self.period)
        if braking.size and horizon - braking[-1] < WHOLE_COUNT * self.period:
            braking = braking[:-1]
        return np.concatenate([[0.0], braking, [horizon]])


@dataclass(frozen=True)
class AccelerateThenBrake(_Stopping):
    """u is an acceleration [m/s^2], held for `hold` seconds; then the robot brakes to rest within `brake` seconds.

    From a velocity w it brakes with -w / brake, so that it rests from hold + brake on. The manoeuvre has an end, so
    other robots can avoid it for all time. Braking is within a limit a while |w| <= a brake.
    """

    hold: Positive
    brake: Positive

    def __post_init__(self) -> None:
        check_fields(self)

    def _braking(self, time: Array) -> tuple[Array, Array, Array]:
        """Distance, speed and acceleration at times (...) [s], per unit of speed at the start of braking."""
        elapsed = np.clip(time - self.hold, 0.0, self.brake)
        moving = (time >= self.hold) & (time < self.hold + self.brake)
        distance = elapsed * (1.0 - 0.5 * elapsed / self.brake)
        return distance, 1.0 - elapsed / self.brake, np.where(moving, -1.0 / self.brake, 0.0)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        inner = np.array([self.hold, self.hold + self.brake])
        return np.concatenate([[0.0], inner[inner < horizon], [horizon]])
