"""What responses that start from position and velocity alone have in common: tables that no state changes."""

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
"""How much of the present velocity and of the control there is in something, at times (...): two arrays (...)."""


class Cubic(NamedTuple):
    """The position map between knots, for all states: points are p + early v + steps (rate v), gains are gain."""

    knots: Array  # (m + 1,) [s]
    early: Array  # (m, 4, 1) [s] shares of velocity at the knot that a control point belongs to
    steps: Array  # (m, 4, 1) [s] from that knot to the control point
    rate: Array  # (m, 4, 1) shares of velocity in the velocity there
    gain: Array  # (m, 4)


class TimeInvariant(ABC):
    """Position p + share * v + gain * u, velocity and acceleration share * v + gain * u.

    Shares and gains are functions of time: where times are asked for again and again they are computed once. Responses
    are found again as what they are equal to, so they must be hashable.
    """

    @abstractmethod
    def place_shares(self, time: Array) -> Coefficients:
        """Of the position, [s] and of the gain's unit, beyond p."""

    @abstractmethod
    def speed_shares(self, time: Array) -> Coefficients:
        """Of the velocity."""

    @abstractmethod
    def push_shares(self, time: Array) -> Coefficients:
        """Of the acceleration."""

    @property
    @abstractmethod
    def interpolation_error(self) -> float:
        """See `Response`."""

    @abstractmethod
    def knots(self, horizon: float, reach: float) -> Array:
        """See `Response`; where `interpolation_error` is 0 they do not depend on `reach`."""

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        share, gain = self.place_shares(np.asarray(t, dtype=np.float64))
        return Affine(state.position + share[..., None] * state.velocity, np.asarray(gain))

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        share, gain = self.speed_shares(np.asarray(t, dtype=np.float64))
        return Affine(share[..., None] * state.velocity, np.asarray(gain))

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        share, gain = self.push_shares(np.asarray(t, dtype=np.float64))
        return Affine(share[..., None] * state.velocity, np.asarray(gain))

    def velocity_at(self, state: State, t: float) -> Affine:
        """As `velocity`, at a time at which it is asked for by every state."""
        share, gain = _speed_shares(self, t)
        return Affine(share * state.velocity, gain)

    def acceleration_at(self, state: State, t: float) -> Affine:
        """As `acceleration`, at a time at which it is asked for by every state."""
        share, gain = _push_shares(self, t)
        return Affine(share * state.velocity, gain)

    def pieces(self, state: State, horizon: float, reach: float) -> tuple[Array, Array, Array]:
        """The position map as cubic pieces: knots (m + 1,) [s], control points of drift (m, 4, d) and gain (m, 4)."""
        table = _exact(self, horizon) if self.interpolation_error == 0.0 else _cubic(self, horizon, reach)
        velocity = state.velocity
        drift = (state.position + table.early * velocity) + table.steps * (table.rate * velocity)
        return table.knots, drift, table.gain


@lru_cache(maxsize=256)
def _speed_shares(response: TimeInvariant, t: float) -> tuple[float, Array]:
    share, gain = response.speed_shares(np.asarray(t, dtype=np.float64))
    return float(share), _fixed(np.asarray(gain))


@lru_cache(maxsize=256)
def _push_shares(response: TimeInvariant, t: float) -> tuple[float, Array]:
    share, gain = response.push_shares(np.asarray(t, dtype=np.float64))
    return float(share), _fixed(np.asarray(gain))


@lru_cache(maxsize=64)
def _exact(response: TimeInvariant, horizon: float) -> Cubic:
    return _cubic(response, horizon, 0.0)


def _cubic(response: TimeInvariant, horizon: float, reach: float) -> Cubic:
    knots = response.knots(horizon, reach)
    (place, gain), (speed, rise) = response.place_shares(knots), response.speed_shares(knots)
    ends, steps = np.array([0, 0, 1, 1]), hermite_weights(knots)
    which = np.arange(len(knots) - 1)[:, None] + ends
    gains = gain[which] + steps * rise[which]
    early, rate = _fixed(place[which][..., None]), _fixed(speed[which][..., None])
    # Kernels are compiled once more for arrays that are not to be written to: knots and gains, which they take, may be.
    return Cubic(knots, early, _fixed(steps[..., None]), rate, gains)


def _fixed(values: Array) -> Array:
    """The same array, not to be written to: it serves every state."""
    values.setflags(write=False)
    return values
