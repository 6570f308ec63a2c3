"""Manoeuvres: a response with a control, an initial state and a start time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import RESPONSE, STATE, Array, Checked, Number, check_fields, has, positive, vector
from slalom.base.tolerances import TIME, WHOLE_COUNT
from slalom.model.limits import Limits
from slalom.model.path import Path, hermite
from slalom.model.response import AccelerateThenBrake, Response, advance
from slalom.model.response.protocol import Unsteered
from slalom.model.state import Affine, State

BOUND_SHARE: Final = 1.1
"""[1] Factor on the acceleration of the cubic pieces of a manoeuvre, as a bound on its true one. Larger: safe, and
coarser. Smaller: what the pieces smooth is not bounded."""

BOUND_EXTRA: Final = 1e-3
"""[m/s, m/s^2] Addition to the speed and the acceleration of these pieces, as BOUND_SHARE."""


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """Motion of a robot in `state` at absolute time `start` [s] that applies `control` (d,) through `response`.

    A manoeuvre is a `Trajectory`, so that other robots can avoid it.
    """

    response: Response
    state: State
    control: Checked = Checked(vector)
    start: Number  # type: ignore[misc]  # the field before it has no default: Checked is a descriptor

    def __post_init__(self) -> None:
        has(self.response, *RESPONSE, "response")
        has(self.state, *STATE, "state")
        # A vector already: to check it again takes a third of the time.
        if self.control.size != self.state.dimension:
            vector(self.control, "control", self.state.dimension)
        check_fields(self)

    @property
    def dimension(self) -> int:
        return self.state.dimension

    @property
    def span(self) -> tuple[float, float]:
        return self.start, np.inf

    def _elapsed(self, t: npt.ArrayLike) -> Array:
        return np.maximum(np.asarray(t, dtype=np.float64) - self.start, 0.0)

    def position(self, t: npt.ArrayLike) -> Array:
        return self.response.position(self.state, self._elapsed(t))(self.control)

    def velocity(self, t: npt.ArrayLike) -> Array:
        return self.response.velocity(self.state, self._elapsed(t))(self.control)

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return self.response.acceleration(self.state, self._elapsed(t))(self.control)

    def _knots(self, start: float, end: float) -> Array:
        speed_bound = float(np.linalg.norm(self.state.velocity) + np.linalg.norm(self.control)) + 1.0
        knots = self.start + self.response.knots(max(end - self.start, TIME), speed_bound)
        return np.concatenate([[start], knots[(knots > start) & (knots < end)], [end]])

    def breaks(self, start: float, end: float) -> Array:
        return self._knots(start, end)[1:-1]

    def speed_bound(self, start: float, end: float) -> float:
        path = self.path(start, end)
        velocities = 3.0 * np.diff(path.points, axis=1) / np.diff(path.times)[:, None, None]
        return float(np.linalg.norm(velocities, axis=-1).max()) + BOUND_EXTRA

    def acceleration_bound(self, start: float, end: float) -> float:
        path = self.path(start, end)
        accelerations = 6.0 * np.diff(path.points, 2, axis=1) / (np.diff(path.times) ** 2)[:, None, None]
        return BOUND_SHARE * float(np.linalg.norm(accelerations, axis=-1).max()) + BOUND_EXTRA

    def path(self, start: float, end: float) -> Path:
        knots = self._knots(start, end)
        return hermite(knots, self.position(knots), self.velocity(knots), self.response.interpolation_error)

    def advance(self, duration: float) -> State:
        """State `duration` [s] after the start."""
        return advance(self.response, self.state, self.control, duration)

    def mean_acceleration(self, now: float, duration: float) -> Array:
        """Mean acceleration (d,) [m/s^2] over `duration` [s] from `now` [s].

        It is the input of a robot with piecewise constant acceleration, and equals the acceleration of the manoeuvre
        where that is constant within `duration`.

        Raises:
            InvalidInput: a duration that is not above 0.
        """
        change = self.velocity(now + duration) - self.velocity(now)
        return np.asarray(change / positive(duration, "duration"))

    def settled_time(self, period: float, horizon: float) -> float:
        """Absolute time [s] at which the control has settled, at the earliest one period after the start."""
        return self.start + (period if self.response.restartable else max(period, self.response.settled(horizon)))

    def continuation(self, state: State, now: float) -> "Continuation":
        """Rest of the manoeuvre for a robot in `state` at `now` [s], which may deviate slightly from it."""
        return Continuation(self, now, state.position - self.position(now), state.velocity - self.velocity(now))


@dataclass(frozen=True, eq=False)
class Continuation(Unsteered):
    """Response of a robot that continues a manoeuvre for every control: gain 0.

    It repeats the accelerations of the manoeuvre from `now` [s] on. An error of position (d,) [m] therefore stays, and
    an error of velocity (d,) [m/s] drifts. Used to test whether the committed manoeuvre is still safe.
    """

    manoeuvre: Manoeuvre
    now: float
    position_error: Array
    velocity_error: Array

    @property
    def interpolation_error(self) -> float:
        return self.manoeuvre.response.interpolation_error

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time = np.asarray(t, dtype=np.float64)
        drift = self.manoeuvre.position(self.now + time) + self.position_error + time[..., None] * self.velocity_error
        return Affine(drift, np.zeros_like(time))

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time = np.asarray(t, dtype=np.float64)
        return Affine(self.manoeuvre.velocity(self.now + time) + self.velocity_error, np.zeros_like(time))

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time = np.asarray(t, dtype=np.float64)
        return Affine(self.manoeuvre.acceleration(self.now + time), np.zeros_like(time))

    def knots(self, horizon: float, speed_bound: float) -> Array:
        elapsed = self.now - self.manoeuvre.start
        knots = self.manoeuvre.response.knots(elapsed + horizon, speed_bound) - elapsed
        return np.concatenate([[0.0], knots[(knots > TIME) & (knots < horizon - TIME)], [horizon]])


def state_after(manoeuvres: Sequence[Manoeuvre], state: State, measured: float, now: float) -> State:
    """The state at `now` [s] of a robot that was in `state` when it was `measured` [s].

    Each of the `manoeuvres`, in the order of their starts, lasts until the next one starts. The robot makes their
    changes of position and velocity; its deviation from them stays as it is. Before the first one it keeps its
    velocity. A heading of the state stays as it was measured.
    """
    position = state.position
    velocity = state.velocity
    acceleration = state.acceleration
    time = measured
    starts = [*(manoeuvre.start for manoeuvre in manoeuvres), np.inf]
    for manoeuvre, end in zip(manoeuvres, np.minimum(starts[1:], now).tolist()):
        if end <= max(time, manoeuvre.start):
            continue
        if manoeuvre.start >= time:
            position, time = position + (manoeuvre.start - time) * velocity, manoeuvre.start
            error = velocity - manoeuvre.state.velocity
        else:
            error = velocity - manoeuvre.velocity(time)
        position = position + manoeuvre.position(end) - manoeuvre.position(time) + (end - time) * error
        velocity = manoeuvre.velocity(end) + error
        acceleration = manoeuvre.acceleration(end)
        time = end
    return State(position + (now - time) * velocity, velocity, acceleration, state.heading)


def first_manoeuvre(state: State, limits: Limits, period: float, now: float) -> Manoeuvre:
    """The manoeuvre of a robot before its first decision: constant velocity for one period, then even braking."""
    speed = float(np.linalg.norm(state.velocity))
    brake = max(period, np.ceil(speed / limits.braking / period - WHOLE_COUNT) * period)
    return Manoeuvre(AccelerateThenBrake(period, brake), state, np.zeros(state.dimension), now)
