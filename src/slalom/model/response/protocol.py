"""Protocol of responses, and the motion under a response."""

from abc import ABC, abstractmethod
from functools import lru_cache
from math import ceil, log2, sqrt
from typing import ClassVar, NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, CheckedFields
from slalom.model.path import hermite, hermite_weights, rest_from
from slalom.model.state import Affine, State, scaled


@runtime_checkable
class Response(Protocol):
    """Position, velocity and acceleration as affine maps of the control, t seconds after its choice.

    Laws: position(state, 0) maps every u to the present position. Its gain starts at 0, never decreases, and increases
    until the robot rests (if it ever does). In the plane it may be complex and turn the control; its modulus then may
    decrease, but never to 0. `velocity` is the derivative of `position`, and `acceleration` that of
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


# Base of responses that start from position and velocity alone: tables that do not depend on the state.


Coefficients: TypeAlias = tuple[Array, Array]
"""Coefficients of the present velocity and of the control at times (...): two arrays (...)."""


class Cubic(NamedTuple):
    """Position map between knots for all states.

    Control points are p + position_share v + steps (velocity_share v); `gain` holds those of the gain.
    """

    knots: Array  # (m + 1,) [s]
    position_share: Array  # (m, 4) [s] coefficients of v in the position at the knot of each control point
    steps: Array  # (m, 4, 1) [s] from that knot to the control point
    velocity_share: Array  # (m, 4) coefficients of v in the velocity at that knot
    gain: Array  # (m, 4)


class TimeInvariant(CheckedFields, ABC):
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
        return Affine(state.position + scaled(coefficient, state.velocity), np.asarray(gain))

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        coefficient, gain = self.velocity_coefficients(np.asarray(t, dtype=np.float64))
        return Affine(scaled(coefficient, state.velocity), np.asarray(gain))

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        coefficient, gain = self.acceleration_coefficients(np.asarray(t, dtype=np.float64))
        return Affine(scaled(coefficient, state.velocity), np.asarray(gain))

    def velocity_at(self, state: State, t: float) -> Affine:
        """Map of the velocity at one time t [s], cached, because many states share it."""
        coefficient, gain = _velocity_coefficients(self, t)
        return Affine(scaled(coefficient, state.velocity), gain)

    def acceleration_at(self, state: State, t: float) -> Affine:
        """Map of the acceleration at one time t [s], cached, because many states share it."""
        coefficient, gain = _acceleration_coefficients(self, t)
        return Affine(scaled(coefficient, state.velocity), gain)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.acceleration_at(state, 0.0),)

    def pieces(self, state: State, horizon: float, speed_bound: float) -> tuple[Array, Array, Array]:
        """Position map as cubic pieces: knots (m + 1,) [s], control points of drift (m, 4, d) [m] and gain (m, 4)."""
        table = _exact(self, horizon) if self.interpolation_error == 0.0 else _cubic(self, horizon, speed_bound)
        velocity = state.velocity
        velocities = table.steps * scaled(table.velocity_share, velocity)
        drift = (state.position + scaled(table.position_share, velocity)) + velocities
        return table.knots, drift, table.gain


@lru_cache(maxsize=256)
def _velocity_coefficients(response: TimeInvariant, t: float) -> Coefficients:
    coefficient, gain = response.velocity_coefficients(np.asarray(t, dtype=np.float64))
    return _read_only(np.asarray(coefficient)), _read_only(np.asarray(gain))


@lru_cache(maxsize=256)
def _acceleration_coefficients(response: TimeInvariant, t: float) -> Coefficients:
    coefficient, gain = response.acceleration_coefficients(np.asarray(t, dtype=np.float64))
    return _read_only(np.asarray(coefficient)), _read_only(np.asarray(gain))


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
    position_share, velocity_share = _read_only(position[knot_of_point]), _read_only(velocity[knot_of_point])
    # Kernels would be compiled again for read-only arrays: knots and gains, which they take, stay writable.
    return Cubic(knots, position_share, _read_only(steps[..., None]), velocity_share, gains)


def _read_only(values: Array) -> Array:
    """The same array, made read-only, because all states share it."""
    values.setflags(write=False)
    return values


# Position maps of responses as cubic pieces, fine enough for the controls for which they are used.


def _usual_bound(state: State) -> float:
    """100 m/s more than twice the speed [m/s]: the speed and the controls of nearly all robots stay below."""
    return 2.0 * sqrt(state.velocity.dot(state.velocity)) + 100.0


def _speed_bound(response: Response, state: State, horizon: float, largest: float) -> float:
    """The speed [m/s] and the velocity that a control of the norm `largest` stands for, together."""
    gain = float(abs(response.velocity(state, horizon).gain))
    return sqrt(state.velocity.dot(state.velocity)) + largest * max(1.0, gain)


def piece_norm(response: Response, state: State, horizon: float, largest: float) -> float:
    """The norm of controls for which pieces are made, so that they hold for controls of up to the norm `largest`.

    0 where the usual pieces hold, else a power of two, so that slightly larger controls do not make other pieces.
    """
    if response.interpolation_error == 0.0 or _speed_bound(response, state, horizon, largest) <= _usual_bound(state):
        return 0.0
    return float(2.0 ** ceil(log2(largest)))


def response_pieces(
    response: Response, state: State, horizon: float, largest: float = 0.0
) -> tuple[Array, Array, Array]:
    """The position map as cubic pieces: knots (m + 1,) [s], control points of drift (m, 4, d) and gain (m, 4).

    largest: norm of controls for which the stated error must hold. It holds for those up to `_usual_bound` anyhow.
    """
    reach = _usual_bound(state)
    if largest > 0.0 and response.interpolation_error > 0.0:
        reach = max(reach, _speed_bound(response, state, horizon, largest))
    if isinstance(response, TimeInvariant):
        return response.pieces(state, horizon, reach)
    knots = response.knots(horizon, reach)
    position, velocity = response.position(state, knots), response.velocity(state, knots)
    drift = hermite(knots, position.drift, velocity.drift).points
    return knots, drift, _gain_points(knots, position.gain, velocity.gain)


def _gain_points(knots: Array, position: Array, velocity: Array) -> Array:
    """Control points (m, 4) of the gain with values and derivatives (m + 1,) at the knots."""
    ends = np.arange(len(knots) - 1)[:, None] + np.array([0, 0, 1, 1])
    return np.asarray(position[ends] + hermite_weights(knots) * velocity[ends])


def parts_of_gain(gain: Array) -> tuple[Array, Array]:
    """The gain (m, 4) and its cross gain (m, 4) as kernels take them: (0, 4) for a gain that does not turn."""
    if not np.iscomplexobj(gain):
        return gain, np.empty((0, 4))
    return np.ascontiguousarray(gain.real), np.ascontiguousarray(gain.imag)


def rest_time(response: Response, state: State, horizon: float) -> float:
    """Time [s] from which the robot in `state` is at rest under every control up to the horizon [s]; inf: never."""
    knots = response.knots(horizon, _usual_bound(state))
    position = response.position(state, knots)
    velocity = response.velocity(state, knots)
    drift = hermite(knots, position.drift, velocity.drift).points
    gain = np.abs(_gain_points(knots, position.gain, velocity.gain))[..., None]
    return rest_from(knots, np.concatenate([drift, gain], axis=2))
