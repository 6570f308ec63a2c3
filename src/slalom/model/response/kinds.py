"""Responses to a velocity: reached at once, by a ramp, or with a lag."""

from abc import abstractmethod
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, NotNegative, Number, Positive, check_fields, listing, pair, positive, vector
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import INTERPOLATION, WHOLE_COUNT
from slalom.model.path import even_knots, hermite_step
from slalom.model.response.protocol import Coefficients, TimeInvariant, affine, ramp, times_of, with_break
from slalom.model.state import Affine, State


@dataclass(frozen=True)
class Velocity(TimeInvariant):
    """u is a velocity [m/s], reached by a constant acceleration over `ramp` seconds and then constant.

    ramp = 0 is the assumption of the classical velocity obstacle, an instant change: gain t (Fiorini and Shiller 1998).
    With ramp = the control period it is the exact motion of a robot driven by acceleration. Prediction and simulation
    then agree, and |u - v| <= max_acceleration * ramp are the velocities reachable in one period.
    """

    interpolation_error: ClassVar[float] = 0.0
    ramp: NotNegative = 0.0

    @property
    def restartable(self) -> bool:
        return self.ramp == 0.0

    def position_coefficients(self, time: Array) -> Coefficients:
        gain = time if self.ramp == 0 else ramp(time, self.ramp) / self.ramp
        return time - gain, gain

    def velocity_coefficients(self, time: Array) -> Coefficients:
        gain = np.ones_like(time) if self.ramp == 0 else np.minimum(time, self.ramp) / self.ramp
        return 1.0 - gain, gain

    def acceleration_coefficients(self, time: Array) -> Coefficients:
        gain = np.zeros_like(time) if self.ramp == 0 else (time < self.ramp) / self.ramp
        return -gain, gain

    def knots(self, horizon: float, speed_bound: float) -> Array:
        return with_break(horizon, self.ramp)

    def settled(self, horizon: float) -> float:
        return self.ramp

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity_at(state, max(self.ramp, 0.0)),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return () if self.ramp == 0 else (self.acceleration_at(state, 0.0),)


@dataclass(frozen=True)
class LaggedVelocity(TimeInvariant):
    """u is a velocity [m/s], approached by a proportional controller: dv/dt = (u - v) / lag.

    Gain t - lag (1 - e^(-t/lag)) (van den Berg, Snape, Guy and Manocha 2011, the AVO).
    """

    interpolation_error: ClassVar[float] = INTERPOLATION
    restartable: ClassVar[bool] = True
    lag: Positive

    def position_coefficients(self, time: Array) -> Coefficients:
        x = time / self.lag
        initial = -np.expm1(-x) * self.lag
        # For small x, t - lag (1 - e^-x) loses all digits; the series is exact to rounding there.
        series = time * x * (0.5 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x / 720))))
        return initial, np.where(x < 1e-2, series, time - initial)

    def velocity_coefficients(self, time: Array) -> Coefficients:
        return np.exp(-time / self.lag), -np.expm1(-time / self.lag)

    def acceleration_coefficients(self, time: Array) -> Coefficients:
        decay = np.exp(-time / self.lag) / self.lag
        return -decay, decay

    def knots(self, horizon: float, speed_bound: float) -> Array:
        # The fourth derivative is at most speed_bound e^(-t/lag) / lag^3 and decreases along a step. Its value at the
        # start of each step therefore bounds it, and steps grow until the last one ends at the horizon.
        times = [0.0]
        while times[-1] < horizon:
            fourth = speed_bound * np.exp(-times[-1] / self.lag) / self.lag**3
            remaining = horizon - times[-1]
            step = remaining if fourth * remaining**4 <= 384.0 * INTERPOLATION else hermite_step(fourth, INTERPOLATION)
            times.append(times[-1] + min(step, remaining))
        times[-1] = horizon
        return np.array(times)

    def settled(self, horizon: float) -> float:
        return self.lag

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (affine(np.zeros(state.dimension), np.array(1.0)),)


# Responses to an acceleration: held without end, or held and followed by constant velocity.


class _Held(TimeInvariant):
    """An acceleration that is held for `hold` seconds; nothing later makes the robot faster."""

    restartable: ClassVar[bool] = False
    hold: float

    def settled(self, horizon: float) -> float:
        return self.hold

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity_at(state, self.hold),)


@dataclass(frozen=True)
class Acceleration(TimeInvariant):
    """u is an acceleration [m/s^2], held without end: gain t^2 / 2 (Stern and Shiller 2025, AO and NAO)."""

    interpolation_error: ClassVar[float] = 0.0
    restartable: ClassVar[bool] = True

    def position_coefficients(self, time: Array) -> Coefficients:
        return time, 0.5 * time * time

    def velocity_coefficients(self, time: Array) -> Coefficients:
        return np.ones_like(time), time

    def acceleration_coefficients(self, time: Array) -> Coefficients:
        return np.zeros_like(time), np.ones_like(time)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        return np.array([0.0, horizon])

    def settled(self, horizon: float) -> float:
        return min(1.0, horizon)

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity_at(state, horizon),)


@dataclass(frozen=True)
class AccelerateThenCoast(_Held):
    """u is an acceleration [m/s^2], held for `hold` seconds; then the velocity is constant.

    Gain t^2 / 2, then hold (t - hold / 2). The speed stays bounded, as that of a vehicle does.
    """

    interpolation_error: ClassVar[float] = 0.0
    hold: Positive

    def position_coefficients(self, time: Array) -> Coefficients:
        return time, ramp(time, self.hold)

    def velocity_coefficients(self, time: Array) -> Coefficients:
        return np.ones_like(time), np.minimum(time, self.hold)

    def acceleration_coefficients(self, time: Array) -> Coefficients:
        return np.zeros_like(time), np.where(time < self.hold, 1.0, 0.0)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        return with_break(horizon, self.hold)


# Responses to an acceleration that is held and followed by a stop.


class _Stopping(_Held):
    """Acceleration held for `hold` seconds, then braking proportional to the velocity at the start of braking."""

    interpolation_error: ClassVar[float] = 0.0

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

    def _braking(self, time: Array) -> tuple[Array, Array, Array]:
        """Distance, speed and acceleration at times (...) [s], per unit of speed at the start of braking."""
        elapsed = np.clip(time - self.hold, 0.0, self.brake)
        moving = (time >= self.hold) & (time < self.hold + self.brake)
        distance = elapsed * (1.0 - 0.5 * elapsed / self.brake)
        return distance, 1.0 - elapsed / self.brake, np.where(moving, -1.0 / self.brake, 0.0)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        inner = np.array([self.hold, self.hold + self.brake])
        return np.concatenate([[0.0], inner[inner < horizon], [horizon]])


# Response to an acceleration that is held and followed by a turn.


@dataclass(frozen=True)
class AccelerateThenTurn(_Held):
    """u is an acceleration [m/s^2], held for `hold` seconds; then the robot turns at constant speed without end.

    In the plane only. From a velocity w it drives on the circle of the radius |w| / |rate|.
    With E(s) = (e^(i rate s) - 1) / (i rate), the gain s after the hold is hold^2 / 2 + hold E(s). That is a complex
    number, by which the control is turned and scaled (docs/theory.md, 5).

    Args:
        hold: [s] > 0.
        rate: [rad/s] other than 0, above 0 to the left.

    Raises:
        InvalidInput: a rate of 0; a state in space.
    """

    interpolation_error: ClassVar[float] = INTERPOLATION
    turns: ClassVar[bool] = True
    hold: Positive
    rate: Number

    def __post_init__(self) -> None:
        check_fields(self)
        if self.rate == 0.0:
            raise InvalidInput("rate: expected a number other than 0; to keep the velocity use AccelerateThenCoast")

    def _turned(self, time: Array) -> tuple[Array, Array]:
        """E(s) [s] and e^(i rate s) at times (...) [s], s after the hold; 0 and 1 during it."""
        angle = self.rate * np.maximum(time - self.hold, 0.0)
        # e^(i x) - 1 = 2 i sin(x / 2) e^(i x / 2) keeps all digits of small angles.
        chord = 2.0 * np.sin(0.5 * angle) / self.rate * np.exp(0.5j * angle)
        return chord, np.exp(1j * angle)

    def position_coefficients(self, time: Array) -> Coefficients:
        held, (chord, _) = np.minimum(time, self.hold), self._turned(time)
        return held + chord, 0.5 * held * held + self.hold * chord

    def velocity_coefficients(self, time: Array) -> Coefficients:
        _, turn = self._turned(time)
        return turn, np.minimum(time, self.hold) * turn

    def acceleration_coefficients(self, time: Array) -> Coefficients:
        _, turn = self._turned(time)
        lateral = np.where(time < self.hold, 0.0, 1j * self.rate * turn)
        return lateral, np.where(time < self.hold, 1.0, self.hold * lateral)

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        if state.dimension != 2:
            raise InvalidInput(f"response: expected a robot in the plane, found one of dimension {state.dimension}")
        return super().position(state, t)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        if horizon <= self.hold:
            return np.array([0.0, horizon])
        step = hermite_step(abs(self.rate) ** 3 * speed_bound, INTERPOLATION)
        return np.concatenate([[0.0], even_knots(self.hold, horizon, step)])

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return self.acceleration_at(state, 0.0), self.acceleration_at(state, self.hold)


# Response to a jerk.


@dataclass(frozen=True)
class Jerk:
    """u is a jerk [m/s^3], held without end from the present acceleration: gain t^3 / 6."""

    interpolation_error: ClassVar[float] = 0.0
    restartable: ClassVar[bool] = True

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        drift = state.position + column * (state.velocity + 0.5 * column * state.acceleration)
        return affine(drift, time**3 / 6.0)

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        return affine(state.velocity + column * state.acceleration, 0.5 * time * time)

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        return affine(state.acceleration + 0.0 * column, time)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        return np.array([0.0, horizon])

    def settled(self, horizon: float) -> float:
        return min(1.0, horizon)

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        # The velocity is quadratic in t: on each eighth of the horizon it lies in the hull of its control points.
        times = np.linspace(0.0, horizon, 9)
        peaks = []
        for start, end in pairwise(times):
            v, a = self.velocity(state, start), self.acceleration(state, start)
            half = 0.5 * (end - start)
            peaks += [affine(v.drift + half * a.drift, v.gain + half * a.gain), self.velocity(state, end)]
        return tuple(peak for peak in peaks if peak.gain > 0)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.acceleration(state, horizon),)


# Response that continues with a fixed sequence of accelerations.


@dataclass(frozen=True, repr=False)
class AccelerationSequence:
    """u is an acceleration [m/s^2], held for `hold` seconds; `then` follows, then the velocity is constant.

    The gain is that of `AccelerateThenCoast`; the later accelerations do not depend on u. `then` holds them in order,
    each with its duration: ((seconds, (ax, ay)), ...).
    """

    interpolation_error: ClassVar[float] = 0.0
    restartable: ClassVar[bool] = False
    hold: Positive
    then: tuple[tuple[float, tuple[float, ...]], ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        listing(self.then, "durations and accelerations", "then")
        pairs = [pair(one, "a duration and an acceleration", f"then[{k}]") for k, one in enumerate(self.then)]
        then = tuple(
            (positive(seconds, f"then[{k}]"), tuple(vector(acceleration, f"then[{k}]").tolist()))
            for k, (seconds, acceleration) in enumerate(pairs)
        )
        dimensions = {len(acceleration) for _, acceleration in then}
        if len(dimensions) > 1:
            raise InvalidInput(f"then: expected accelerations of the same dimension, found {sorted(dimensions)}")
        object.__setattr__(self, "then", then)

    def __repr__(self) -> str:
        return f"AccelerationSequence(hold={self.hold:g}, then={len(self.then)} more)"

    @property
    def ends(self) -> Array:
        """End times (1 + n,) [s] of the accelerations."""
        return np.cumsum([self.hold, *(seconds for seconds, _ in self.then)])

    def _accelerations(self, dimension: int) -> Array:
        """Later accelerations (n, d) [m/s^2].

        Raises:
            InvalidInput: accelerations of another dimension.
        """
        if self.then and len(self.then[0][1]) != dimension:
            raise InvalidInput(f"then: expected dimension {dimension} as of the state, found {len(self.then[0][1])}")
        return np.array([acceleration for _, acceleration in self.then]).reshape(-1, dimension)

    def _elapsed(self, time: Array) -> tuple[Array, Array]:
        """Time since each later acceleration started (..., n) [s], 0 before it, and its duration (n,) [s]."""
        ends = self.ends
        return np.maximum(time[..., None] - ends[:-1], 0.0), np.diff(ends)

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        since, held = self._elapsed(time)
        later = np.where(since < held, 0.5 * since**2, held * (since - 0.5 * held)) @ self._accelerations(
            state.dimension
        )
        return affine(state.position + column * state.velocity + later, ramp(time, self.hold))

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time, column = times_of(t)
        since, held = self._elapsed(time)
        later = np.minimum(since, held) @ self._accelerations(state.dimension)
        return affine(state.velocity + 0.0 * column + later, np.minimum(time, self.hold))

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time, _ = times_of(t)
        ends = self.ends
        active = (time[..., None] >= ends[:-1]) & (time[..., None] < ends[1:])
        later = active.astype(np.float64) @ self._accelerations(state.dimension)
        return affine(later, np.where(time < self.hold, 1.0, 0.0))

    def knots(self, horizon: float, speed_bound: float) -> Array:
        ends = self.ends
        return np.concatenate([[0.0], ends[ends < horizon], [horizon]])

    def settled(self, horizon: float) -> float:
        return self.hold

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        # The speed is convex while an acceleration is held: its maximum is at an end.
        return tuple(self.velocity(state, float(end)) for end in self.ends)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        starts = np.concatenate([[0.0], self.ends[:-1]])
        return tuple(self.acceleration(state, float(at)) for at in starts)
