"""Protocol of responses, and the motion under a response."""

from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.affine import Affine
from slalom.checks import Array
from slalom.state import State


@runtime_checkable
class Response(Protocol):
    """Position, velocity and acceleration as affine maps of the control, t seconds after its choice.

    Laws: position(state, 0) maps every u to the present position. Its gain starts at 0, never decreases, and increases
    until the robot rests (if it ever does). `velocity` is the derivative of `position`, and `acceleration` that of
    `velocity`, except at knots. For responses with `restartable`, advancing twice equals advancing once by the sum. t
    may have any shape (...): drift (..., d), gain (...).
    """

    @property
    def restartable(self) -> bool:
        """Whether the same u, held from any later state of the motion, continues the same motion."""

    @property
    def interpolation_error(self) -> float:
        """Largest difference [m] between the position map and its cubic pieces between `knots`; 0 if it is cubic."""

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        """Map u -> position [m] at elapsed time t [s] >= 0."""

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        """Map u -> velocity [m/s]."""

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        """Map u -> acceleration [m/s^2]; at a jump, the value that follows it."""

    def knots(self, horizon: float, speed_bound: float) -> Array:
        """Times (m + 1,) [s] from 0 to `horizon` between which the position map is nearly cubic.

        The error is at most `interpolation_error` if speed + |velocity that u stands for| <= `speed_bound` [m/s].
        """

    def settled(self, horizon: float) -> float:
        """Time [s] after which the control no longer changes the velocity.

        For responses that never end, one second, or the horizon if that is shorter.
        """

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        """Maps of u that bound the speed.

        It stays below a limit if all images have norms below the limit, and so does the present speed. At all times
        where the control ends, also after the horizon, since a manoeuvre is kept beyond it; otherwise up to the
        horizon.
        """

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        """Maps of u that bound the acceleration.

        It stays below a limit, as long as for `speed_peaks`, if all images have norms below the limit.
        """


class Unsteered:
    """Members shared by responses on which the control has no effect."""

    restartable: ClassVar[bool] = False

    def settled(self, horizon: float) -> float:
        return 0.0

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return ()

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return ()


def advance(response: Response, state: State, control: Array, duration: float) -> State:
    """State `duration` [s] after the choice of `control` (d,): the step of the simulator and of every prediction."""
    return State(
        response.position(state, duration)(control),
        response.velocity(state, duration)(control),
        response.acceleration(state, duration)(control),
    )


def affine(drift: Array, gain: Array) -> Affine:
    """Map with this drift (..., d) and gain (...)."""
    return Affine(np.asarray(drift), np.asarray(gain))


def times_of(t: npt.ArrayLike) -> tuple[Array, Array]:
    """Times as an array (...), and with a last axis (..., 1) to multiply vectors."""
    time = np.asarray(t, dtype=np.float64)
    return time, time[..., None]


def ramp(time: Array, hold: float) -> Array:
    """Integral of min(t, hold) from 0 to each time (...)."""
    held = np.minimum(time, hold)
    return np.asarray(held * (time - 0.5 * held))


def with_break(horizon: float, at: float) -> Array:
    """Knots at 0, `at` and the horizon; without `at` if it is not between them."""
    return np.array([0.0, at, horizon]) if 0.0 < at < horizon else np.array([0.0, horizon])
