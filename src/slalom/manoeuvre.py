"""A response with its control and its start: a whole future path."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from slalom.affine import Affine
from slalom.checks import Array, Checked, number, vector
from slalom.path import Path, hermite
from slalom.response import Response, advance
from slalom.state import State


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """The motion of a robot that was in `state` at absolute time `start` [s] and answers `control` by `response`.

    It is a trajectory (see `trajectory.Trajectory`), so others can avoid it.
    """

    tabulated: ClassVar[bool] = False
    response: Response
    state: State
    control: Checked = Checked(vector)
    start: float  # type: ignore[misc]  # the field before it has no default: Checked is a descriptor

    def __post_init__(self) -> None:
        vector(self.control, "control", self.state.dimension)
        object.__setattr__(self, "start", number(self.start, "start"))

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
        reach = float(np.linalg.norm(self.state.velocity) + np.linalg.norm(self.control)) + 1.0
        knots = self.start + self.response.knots(max(end - self.start, 1e-9), reach)
        return np.concatenate([[start], knots[(knots > start) & (knots < end)], [end]])

    def breaks(self, start: float, end: float) -> Array:
        return self._knots(start, end)[1:-1]

    def speed_bound(self, start: float, end: float) -> float:
        path = self.path(start, end)
        steps = 3.0 * np.diff(path.points, axis=1) / np.diff(path.times)[:, None, None]
        return float(np.linalg.norm(steps, axis=-1).max()) + 1e-3

    def acceleration_bound(self, start: float, end: float) -> float:
        path = self.path(start, end)
        bends = 6.0 * np.diff(path.points, 2, axis=1) / (np.diff(path.times) ** 2)[:, None, None]
        return 1.1 * float(np.linalg.norm(bends, axis=-1).max()) + 1e-3

    def path(self, start: float, end: float) -> Path:
        knots = self._knots(start, end)
        return hermite(knots, self.position(knots), self.velocity(knots), self.response.interpolation_error)

    def advance(self, duration: float) -> State:
        """The state `duration` seconds after the start."""
        return advance(self.response, self.state, self.control, duration)

    def mean_acceleration(self, now: float, duration: float) -> Array:
        """What a robot driven by piecewise constant accelerations applies from `now` on [m/s^2].

        The manoeuvre itself where its acceleration does not change within `duration`.
        """
        change = self.velocity(now + duration) - self.velocity(now)
        return np.asarray(change / duration)

    def settled_time(self, period: float, horizon: float) -> float:
        """When its control has been carried out, if at the earliest one period after its start: absolute time [s]."""
        return self.start + max(period, self.response.settled(horizon))

    def continuation(self, state: State, now: float) -> "Continuation":
        """The rest of the manoeuvre for a robot that is in `state` at `now`, perhaps a little off its course."""
        return Continuation(self, now, state.position - self.position(now), state.velocity - self.velocity(now))


@dataclass(frozen=True, eq=False)
class Continuation:
    """The response of a robot that goes on with a manoeuvre whatever the control: gain 0.

    It repeats the manoeuvre's accelerations from `now` on; a deviation (`off_place`, `off_speed`) therefore
    stays and drifts. Serves to ask whether the committed manoeuvre is still safe.
    """

    manoeuvre: Manoeuvre
    now: float
    position_error: Array
    velocity_error: Array

    @property
    def interpolation_error(self) -> float:
        return self.manoeuvre.response.interpolation_error

    @property
    def restartable(self) -> bool:
        return False

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

    def knots(self, horizon: float, reach: float) -> Array:
        elapsed = self.now - self.manoeuvre.start
        knots = self.manoeuvre.response.knots(elapsed + horizon, reach) - elapsed
        return np.concatenate([[0.0], knots[(knots > 1e-9) & (knots < horizon - 1e-9)], [horizon]])

    def settled(self, horizon: float) -> float:
        return 0.0

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return ()

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return ()
