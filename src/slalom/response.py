"""How a control u, held from now, moves the robot: an affine map of u with a scalar gain, at every time."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.affine import Affine
from slalom.checks import Array, not_negative, positive
from slalom.path import hermite_step
from slalom.state import State
from slalom.tolerances import INTERPOLATION


@runtime_checkable
class Response(Protocol):
    """Position, velocity and acceleration as affine maps of the control, t seconds after it was chosen.

    Laws: position(state, 0) maps every u to the present position; its gain increases strictly from 0; `velocity` is the
    derivative of `position`, `acceleration` that of `velocity` (except at knots); advancing twice is advancing once
    by the sum, for the responses whose `restartable` is True. t may have any shape (...): drift (..., d), gain (...).
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

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        """Maps of u such that the speed stays below a limit up to the horizon when all their images' norms do.

        The present speed is taken to be below the limit.
        """

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        """Maps of u such that the acceleration stays below a limit up to the horizon when their images' norms do."""


def _affine(drift: Array, gain: Array) -> Affine:
    return Affine(np.asarray(drift), np.asarray(gain))


def _times(t: npt.ArrayLike) -> tuple[Array, Array]:
    time = np.asarray(t, dtype=np.float64)
    return time, time[..., None]


@dataclass(frozen=True)
class Velocity:
    """u is a velocity [m/s], reached by a constant acceleration over `ramp` seconds and then kept.

    ramp = 0 is the classical velocity obstacle's assumption, an instant change: gain t (Fiorini and Shiller
    1998). With ramp = the control period it is exactly what a robot driven by acceleration does, so prediction and
    simulation agree and |u - v| <= max_acceleration * ramp are the velocities reachable in one period.
    """

    ramp: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "ramp", not_negative(self.ramp, "ramp"))

    @property
    def interpolation_error(self) -> float:
        return 0.0

    @property
    def restartable(self) -> bool:
        return self.ramp == 0.0

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = _times(t)
        gain = time if self.ramp == 0 else _ramp(time, self.ramp) / self.ramp
        return _affine(state.position + (column - gain[..., None]) * state.velocity, gain)

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = _times(t)
        gain = np.ones_like(time) if self.ramp == 0 else np.minimum(time, self.ramp) / self.ramp
        return _affine((1.0 - gain)[..., None] * state.velocity, gain)

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = _times(t)
        gain = np.zeros_like(time) if self.ramp == 0 else (time < self.ramp) / self.ramp
        return _affine(-gain[..., None] * state.velocity, gain)

    def knots(self, horizon: float, reach: float) -> Array:
        return _with_break(horizon, self.ramp)

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity(state, max(self.ramp, 0.0)),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return () if self.ramp == 0 else (self.acceleration(state, 0.0),)


@dataclass(frozen=True)
class LaggedVelocity:
    """u is a velocity [m/s] that is approached as by a proportional controller: dv/dt = (u - v) / lag.

    Gain t - lag (1 - e^(-t/lag)) (van den Berg, Snape, Guy and Manocha 2011, the AVO).
    """

    lag: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "lag", positive(self.lag, "lag"))

    @property
    def interpolation_error(self) -> float:
        return INTERPOLATION

    @property
    def restartable(self) -> bool:
        return True

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = _times(t)
        x = time / self.lag
        spent = -np.expm1(-x) * self.lag
        # t - lag (1 - e^-x) loses all digits for small x; there its series is exact to rounding.
        series = time * x * (0.5 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x / 720))))
        gain = np.where(x < 1e-2, series, time - spent)
        return _affine(state.position + spent[..., None] * state.velocity, gain)

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = _times(t)
        left = np.exp(-time / self.lag)
        return _affine(left[..., None] * state.velocity, -np.expm1(-time / self.lag))

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = _times(t)
        left = np.exp(-time / self.lag) / self.lag
        return _affine(-left[..., None] * state.velocity, left)

    def knots(self, horizon: float, reach: float) -> Array:
        # The fourth derivative is |u - v| e^(-t/lag) / lag^3: steps may grow by the fourth root of e^(t/lag).
        times = [0.0]
        while times[-1] < horizon:
            fourth = reach * np.exp(-times[-1] / self.lag) / self.lag**3
            times.append(times[-1] + min(hermite_step(fourth, INTERPOLATION), 2.0 * self.lag))
        times[-1] = horizon
        return np.array(times)

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (_affine(np.zeros(state.dimension), np.array(1.0)),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.acceleration(state, 0.0),)


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
        time, column = _times(t)
        return _affine(state.position + column * state.velocity, 0.5 * time * time)

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = _times(t)
        return _affine(state.velocity + 0.0 * column, time)

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = _times(t)
        return _affine(0.0 * column * state.velocity, np.ones_like(time))

    def knots(self, horizon: float, reach: float) -> Array:
        return np.array([0.0, horizon])

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
        time, column = _times(t)
        return _affine(state.position + column * state.velocity, _ramp(time, self.hold))

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = _times(t)
        return _affine(state.velocity + 0.0 * column, np.minimum(time, self.hold))

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = _times(t)
        return _affine(0.0 * column * state.velocity, np.where(time < self.hold, 1.0, 0.0))

    def knots(self, horizon: float, reach: float) -> Array:
        return _with_break(horizon, self.hold)

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
        time, _ = _times(t)
        held, (distance, _, _) = np.minimum(time, self.hold), self._braking(time)
        return _affine(
            state.position + (held + distance)[..., None] * state.velocity,
            0.5 * held * held + self.hold * distance,
        )

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = _times(t)
        held, (_, speed, _) = np.minimum(time, self.hold), self._braking(time)
        return _affine(speed[..., None] * state.velocity, np.where(time < self.hold, held, self.hold * speed))

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = _times(t)
        _, _, braking = self._braking(time)
        return _affine(braking[..., None] * state.velocity, np.where(time < self.hold, 1.0, self.hold * braking))

    def knots(self, horizon: float, reach: float) -> Array:
        braking = np.arange(self.hold, horizon, self.period)
        if braking.size and horizon - braking[-1] < 1e-9 * self.period:
            braking = braking[:-1]
        return np.concatenate([[0.0], braking, [horizon]])

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity(state, min(self.hold, horizon)),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        first = self.acceleration(state, 0.0)
        return (first,) if horizon <= self.hold else (first, self.acceleration(state, self.hold))


@dataclass(frozen=True)
class Jerk:
    """u is a jerk [m/s^3], held for ever from the present acceleration: gain t^3 / 6."""

    @property
    def interpolation_error(self) -> float:
        return 0.0

    @property
    def restartable(self) -> bool:
        return True

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = _times(t)
        drift = state.position + column * (state.velocity + 0.5 * column * state.acceleration)
        return _affine(drift, time**3 / 6.0)

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = _times(t)
        return _affine(state.velocity + column * state.acceleration, 0.5 * time * time)

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = _times(t)
        return _affine(state.acceleration + 0.0 * column, time)

    def knots(self, horizon: float, reach: float) -> Array:
        return np.array([0.0, horizon])

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        # The velocity is a quadratic in t; on each eighth of the horizon it stays in the hull of its control points.
        times = np.linspace(0.0, horizon, 9)
        peaks = []
        for start, end in pairwise(times):
            v, a = self.velocity(state, start), self.acceleration(state, start)
            half = 0.5 * (end - start)
            peaks += [_affine(v.drift + half * a.drift, v.gain + half * a.gain), self.velocity(state, end)]
        return tuple(peak for peak in peaks if peak.gain > 0)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.acceleration(state, horizon),)


def advance(response: Response, state: State, control: Array, duration: float) -> State:
    """The state `duration` seconds after `control` was chosen. The simulator's step and every prediction."""
    return State(
        response.position(state, duration)(control),
        response.velocity(state, duration)(control),
        response.acceleration(state, duration)(control),
    )


def _ramp(time: Array, hold: float) -> Array:
    """Integral of min(t, hold)."""
    held = np.minimum(time, hold)
    return np.asarray(held * (time - 0.5 * held))


def _with_break(horizon: float, at: float) -> Array:
    return np.array([0.0, at, horizon]) if 0.0 < at < horizon else np.array([0.0, horizon])


RESPONSES: tuple[type, ...] = (Velocity, LaggedVelocity, Acceleration, AccelerateThenCoast, AccelerateThenStop, Jerk)
"""Every kind of response."""
