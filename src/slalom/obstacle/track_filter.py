"""Filters: estimates of an obstacle's motion, with their uncertainty, from measurements that are not exact."""

from dataclasses import dataclass, field
from math import sqrt
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from slalom.checks import Array, Fraction, NotNegative, Positive
from slalom.fields import check_fields
from slalom.forecast import AtConstantVelocity, Forecast
from slalom.uncertainty import KalmanError, Uncertainty


class Measurement(NamedTuple):
    """A measurement of one obstacle by a perception system."""

    t: float  # [s] absolute time
    position: Array  # (d,) [m]
    velocity: Array | None  # (d,) [m/s]
    covariance: Array | None  # of the position (d, d) [m^2], or of position and velocity (2 d, 2 d)


class Estimate(NamedTuple):
    """The state of an obstacle, and the uncertainty of its prediction."""

    state: Array  # (3, d): position [m], velocity [m/s] and acceleration [m/s^2]
    uncertainty: Uncertainty  # of the prediction, as a function of the time since the estimate


@runtime_checkable
class Filter(Protocol):
    """Estimate of motion from measurements in the order of time.

    A belief is a value of any type that no method changes: the tracker keeps beliefs, to replay late measurements.

    Laws: predicting over s and then over t is predicting over s + t. The radius of the uncertainty obeys the laws of
    `Uncertainty` and does not shrink while a belief is predicted.
    """

    @property
    def forecast(self) -> Forecast:
        """The forecast from an estimate, for methods that use trajectories as given."""

    def begin(self, seen: Measurement) -> Any:
        """The belief after the first measurement."""

    def predict(self, belief: Any, duration: float) -> Any:
        """The belief `duration` [s] >= 0 later, without a measurement."""

    def correct(self, belief: Any, seen: Measurement) -> Any:
        """The belief after a measurement at its time."""

    def estimate(self, belief: Any) -> Estimate:
        """The estimate as position, velocity and uncertainty."""


class Gaussian(NamedTuple):
    """Belief of a Kalman filter: position and velocity with their covariance."""

    mean: Array  # (2 d,)
    covariance: Array  # (2 d, 2 d)


@dataclass(frozen=True)
class ConstantVelocityFilter:
    """Kalman filter for motion at constant velocity, disturbed by accelerations that are white noise.

    Prediction, correction and process noise: Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking
    and Navigation, 2001, sections 5.2 and 6.2; the correction in Joseph's form.

    Attributes:
        acceleration: [m/s^2/sqrt(Hz)] root of the spectral density of the accelerations. The larger, the faster the
            filter follows a turn, and the faster its uncertainty grows.
        position: [m] standard deviation per axis of a position that comes without a covariance.
        velocity: [m/s] the same of a velocity.
        first_velocity: [m/s] the same of the velocity of an obstacle that is measured the first time, without velocity.
        probability: with which an obstacle is outside the radius at any one time.
    """

    acceleration: NotNegative = 0.2
    position: Positive = 0.1
    velocity: Positive = 0.2
    first_velocity: Positive = 1.0
    probability: Fraction = 0.05
    forecast: Forecast = field(default=AtConstantVelocity(), init=False)

    def __post_init__(self) -> None:
        check_fields(self)

    def begin(self, seen: Measurement) -> Gaussian:
        values, covariance = self._measured(seen)
        d = seen.position.size
        mean, first = np.zeros(2 * d), np.diag(np.repeat([0.0, self.first_velocity**2], d))
        mean[: values.size], first[: values.size, : values.size] = values, covariance
        return Gaussian(mean, first)

    def predict(self, belief: Gaussian, duration: float) -> Gaussian:
        d, t, noise = belief.mean.size // 2, duration, self.acceleration**2 * np.eye(belief.mean.size // 2)
        place, velocity = belief.mean[:d], belief.mean[d:]
        # In blocks of position and velocity: products with the sparse matrix of the step take four times as long.
        of_place, mixed, of_velocity = belief.covariance[:d, :d], belief.covariance[:d, d:], belief.covariance[d:, d:]
        along = mixed + t * of_velocity
        mean, covariance = np.concatenate([place + t * velocity, velocity]), np.empty((2 * d, 2 * d))
        covariance[:d, :d] = of_place + t * (mixed.T + along) + t**3 / 3.0 * noise
        covariance[:d, d:] = along + t**2 / 2.0 * noise
        covariance[d:, :d] = covariance[:d, d:].T
        covariance[d:, d:] = of_velocity + t * noise
        return Gaussian(mean, covariance)

    def correct(self, belief: Gaussian, seen: Measurement) -> Gaussian:
        values, noise = self._measured(seen)
        m, covariance = values.size, belief.covariance
        gain = np.linalg.solve(covariance[:m, :m] + noise, covariance[:m]).T
        keep = np.eye(belief.mean.size)
        keep[:, :m] -= gain
        corrected = keep @ covariance @ keep.T + gain @ noise @ gain.T
        return Gaussian(belief.mean + gain @ (values - belief.mean[:m]), 0.5 * (corrected + corrected.T))

    def estimate(self, belief: Gaussian) -> Estimate:
        d = belief.mean.size // 2
        of_place, mixed, of_velocity = belief.covariance[:d, :d], belief.covariance[:d, d:], belief.covariance[d:, d:]
        blocks = np.stack([of_place, of_velocity, 0.5 * (mixed + mixed.T)])
        largest = np.maximum(np.linalg.eigvalsh(blocks)[:, -1], 0.0).tolist()
        position, velocity = sqrt(largest[0]), sqrt(largest[1])
        correlation = min(largest[2] / (position * velocity), 1.0) if position * velocity > 0.0 else 0.0
        state = np.stack([belief.mean[:d], belief.mean[d:], np.zeros(d)])
        return Estimate(state, KalmanError(position, velocity, correlation, self.acceleration, self.probability))

    def _measured(self, seen: Measurement) -> tuple[Array, Array]:
        """The measured numbers (m,), m = d or 2 d, and their covariance (m, m)."""
        d = seen.position.size
        values = seen.position if seen.velocity is None else np.concatenate([seen.position, seen.velocity])
        covariance = np.diag(np.repeat([self.position**2, self.velocity**2], d)[: values.size])
        if seen.covariance is not None:
            given = len(seen.covariance)
            covariance[:given, :given] = seen.covariance
        return values, covariance
