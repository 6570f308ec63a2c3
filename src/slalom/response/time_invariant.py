"""Base of responses that start from position and velocity alone: tables that do not depend on the state."""

from abc import ABC, abstractmethod
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from slalom.affine import Affine
from slalom.checks import Array
from slalom.path import hermite_weights
from slalom.state import State

Coefficients: TypeAlias = tuple[Array, Array]
"""Coefficients of the present velocity and of the control at times (...): two arrays (...)."""


class Cubic(NamedTuple):
    """Position map between knots for all states.

    Control points are p + position_share v + steps (velocity_share v); `gain` holds those of the gain.
    """

    knots: Array  # (m + 1,) [s]
    position_share: Array  # (m, 4, 1) [s] coefficients of v in the position at the knot of each control point
    steps: Array  # (m, 4, 1) [s] from that knot to the control point
    velocity_share: Array  # (m, 4, 1) coefficients of v in the velocity at that knot
    gain: Array  # (m, 4)


class TimeInvariant(ABC):
    """Position p + c * v + gain * u; velocity and acceleration c * v + gain * u.

    The coefficients c and the gains are functions of time and are cached for repeated times. The caches are keyed by
    equality, so subclasses must be hashable.
    """

    @abstractmethod
    def position_coefficients(self, time: Array) -> Coefficients:
        """Coefficients of the position beyond p, in [s] and in the unit of the gain."""

    @abstractmethod
    def velocity_coefficients(self, time: Array) -> Coefficients:
        """Coefficients of the velocity."""

    @abstractmethod
    def acceleration_coefficients(self, time: Array) -> Coefficients:
        """Coefficients of the acceleration."""

    @property
    @abstractmethod
    def interpolation_error(self) -> float:
        """Error [m] of cubic pieces of the position, see `Response`."""

    @abstractmethod
    def knots(self, horizon: float, speed_bound: float) -> Array:
        """Knots [s], see `Response`; where `interpolation_error` is 0 they do not depend on `speed_bound`."""

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        coefficient, gain = self.position_coefficients(np.asarray(t, dtype=np.float64))
        return Affine(state.position + coefficient[..., None] * state.velocity, np.asarray(gain))

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        coefficient, gain = self.velocity_coefficients(np.asarray(t, dtype=np.float64))
        return Affine(coefficient[..., None] * state.velocity, np.asarray(gain))

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        coefficient, gain = self.acceleration_coefficients(np.asarray(t, dtype=np.float64))
        return Affine(coefficient[..., None] * state.velocity, np.asarray(gain))

    def velocity_at(self, state: State, t: float) -> Affine:
        """Map of the velocity at one time t [s], cached, because many states share it."""
        coefficient, gain = _velocity_coefficients(self, t)
        return Affine(coefficient * state.velocity, gain)

    def acceleration_at(self, state: State, t: float) -> Affine:
        """Map of the acceleration at one time t [s], cached, because many states share it."""
        coefficient, gain = _acceleration_coefficients(self, t)
        return Affine(coefficient * state.velocity, gain)

    def pieces(self, state: State, horizon: float, speed_bound: float) -> tuple[Array, Array, Array]:
        """Position map as cubic pieces: knots (m + 1,) [s], control points of drift (m, 4, d) [m] and gain (m, 4)."""
        table = _exact(self, horizon) if self.interpolation_error == 0.0 else _cubic(self, horizon, speed_bound)
        velocity = state.velocity
        drift = (state.position + table.position_share * velocity) + table.steps * (table.velocity_share * velocity)
        return table.knots, drift, table.gain


@lru_cache(maxsize=256)
def _velocity_coefficients(response: TimeInvariant, t: float) -> tuple[float, Array]:
    coefficient, gain = response.velocity_coefficients(np.asarray(t, dtype=np.float64))
    return float(coefficient), _read_only(np.asarray(gain))


@lru_cache(maxsize=256)
def _acceleration_coefficients(response: TimeInvariant, t: float) -> tuple[float, Array]:
    coefficient, gain = response.acceleration_coefficients(np.asarray(t, dtype=np.float64))
    return float(coefficient), _read_only(np.asarray(gain))


@lru_cache(maxsize=64)
def _exact(response: TimeInvariant, horizon: float) -> Cubic:
    return _cubic(response, horizon, 0.0)


def _cubic(response: TimeInvariant, horizon: float, speed_bound: float) -> Cubic:
    knots = response.knots(horizon, speed_bound)
    (position, gain), (velocity, velocity_gain) = (
        response.position_coefficients(knots),
        response.velocity_coefficients(knots),
    )
    ends, steps = np.array([0, 0, 1, 1]), hermite_weights(knots)
    knot_of_point = np.arange(len(knots) - 1)[:, None] + ends
    gains = gain[knot_of_point] + steps * velocity_gain[knot_of_point]
    position_share, velocity_share = (
        _read_only(position[knot_of_point][..., None]),
        _read_only(velocity[knot_of_point][..., None]),
    )
    # Kernels would be compiled again for read-only arrays: knots and gains, which they take, stay writable.
    return Cubic(knots, position_share, _read_only(steps[..., None]), velocity_share, gains)


def _read_only(values: Array) -> Array:
    """The same array, made read-only, because all states share it."""
    values.setflags(write=False)
    return values
