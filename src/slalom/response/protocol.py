"""What every response is, and the motion under it."""

from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.affine import Affine
from slalom.checks import Array
from slalom.state import State


@runtime_checkable
class Response(Protocol):
    """Position, velocity and acceleration as affine maps of the control, t seconds after it was chosen.

    Laws: position(state, 0) maps every u to the present position; its gain increases from 0 until the robot rests, if
    it does, and never falls; `velocity` is the derivative of `position`, `acceleration` that of `velocity` (except at
    knots); advancing twice is advancing once by the sum, for the responses whose `restartable` is True. t may have any
    shape (...): drift (..., d), gain (...).
    """

    @property
    def restartable(self) -> bool:
        """Whether holding u from any later state of the motion continues the same motion."""

    @property
    def interpolation_error(self) -> float:
        """By how much the position map may differ from its cubic pieces between `knots` [m]; 0 if it is cubic."""

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        """u -> position [m] at elapsed time t [s] >= 0."""

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        """u -> velocity [m/s]."""

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        """u -> acceleration [m/s^2]; at a jump, the one that follows it."""

    def knots(self, horizon: float, reach: float) -> Array:
        """Times from 0 to `horizon` between which the position map is cubic, or differs from one by little.

        At most by `interpolation_error`, as long as speed + |velocity that the control stands for| <= reach [m/s].
        """

    def settled(self, horizon: float) -> float:
        """When the control has been carried out [s]: afterwards it changes the velocity no more, or, for
        responses that never end, one second or the horizon if that is shorter."""

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        """Maps of u such that the speed stays below a limit up to the horizon when all their images' norms do.

        The present speed is taken to be below the limit.
        """

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        """Maps of u such that the acceleration stays below a limit up to the horizon when their images' norms do."""


def advance(response: Response, state: State, control: Array, duration: float) -> State:
    """The state `duration` seconds after `control` was chosen. The simulator's step and every prediction."""
    return State(
        response.position(state, duration)(control),
        response.velocity(state, duration)(control),
        response.acceleration(state, duration)(control),
    )


def affine(drift: Array, gain: Array) -> Affine:
    """The map with this drift and gain."""
    return Affine(np.asarray(drift), np.asarray(gain))


def times_of(t: npt.ArrayLike) -> tuple[Array, Array]:
    """Times as an array, and with a last axis to multiply vectors with."""
    time = np.asarray(t, dtype=np.float64)
    return time, time[..., None]


def ramp(time: Array, hold: float) -> Array:
    """Integral of min(t, hold)."""
    held = np.minimum(time, hold)
    return np.asarray(held * (time - 0.5 * held))


def with_break(horizon: float, at: float) -> Array:
    """Knots at 0, `at` and the horizon; without `at` if that is not between them."""
    return np.array([0.0, at, horizon]) if 0.0 < at < horizon else np.array([0.0, horizon])
