"""Forecasts: rules that predict an obstacle's trajectory from the present information about it."""

from dataclasses import dataclass, replace
from typing import ClassVar, Final, Protocol, runtime_checkable

import numpy as np

from slalom.base.checks import FORECAST, NotNegative, Positive, check_fields, has
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import LONGEST_FORECAST, REST
from slalom.forecast.from_models import FromModels as FromModels
from slalom.model.trajectory import Circular, ConstantAcceleration, ConstantVelocity, PiecewisePolynomial, Trajectory

STRAIGHT_TURN_RATE: Final = 0.001
"""[rad/s] Obstacles that turn more slowly are predicted to move straight on. Larger: gentle turns are ignored. Smaller:
circles of enormous radius lose digits."""

PAST_POSITIONS: Final = 5
"""[1] Number of past positions to which `FromPast` fits its parabola. Larger: more smoothing of noise. Smaller: noise
enters the prediction."""


@runtime_checkable
class Forecast(Protocol):
    """Rule from an obstacle's true trajectory and the time of observation to the predicted trajectory.

    Law: a rule uses the true trajectory at `now` only. Exceptions: `Known` and `Present` use all of it, `FromPast` and
    `FromModels` use its past, `FromModels` that of others too.
    """

    @property
    def includes_future(self) -> bool:
        """Whether obstacles that appear later are known. If not, the rule applies to present obstacles only."""

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        """Predicted trajectory from `now` [s] on. Raises OutsideSpan if the obstacle does not exist at `now`."""


@dataclass(frozen=True)
class Known:
    """The true trajectory: published plans, lanes, recordings. The assumption of NLVO and NAO."""

    includes_future: ClassVar[bool] = True

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        return trajectory


@dataclass(frozen=True)
class Present:
    """The true trajectory of obstacles that exist now; obstacles that appear later are unknown."""

    includes_future: ClassVar[bool] = False

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        return trajectory


@dataclass(frozen=True)
class AtConstantVelocity:
    """The present velocity without end. The assumption of VO and AVO."""

    includes_future: ClassVar[bool] = False

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        return ConstantVelocity(trajectory.position(now), trajectory.velocity(now), now)


@dataclass(frozen=True)
class AtConstantAcceleration:
    """The present velocity, and the present acceleration without end. The assumption of AO."""

    includes_future: ClassVar[bool] = False

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        return ConstantAcceleration(
            trajectory.position(now), trajectory.velocity(now), trajectory.acceleration(now), now
        )


@dataclass(frozen=True)
class AcceleratingBriefly:
    """The present acceleration for `seconds`, then constant velocity: for robots that decide often.

    The present acceleration indicates the next velocity of a robot, but nothing beyond. Extrapolated without end, a
    braking robot would reverse.
    """

    includes_future: ClassVar[bool] = False
    seconds: Positive = 0.3

    def __post_init__(self) -> None:
        check_fields(self)

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        position, velocity = trajectory.position(now), trajectory.velocity(now)
        acceleration, s = trajectory.acceleration(now), self.seconds
        zero = np.zeros_like(acceleration)
        rows = [
            [position, velocity, 0.5 * acceleration],
            [position + s * velocity + 0.5 * s * s * acceleration, velocity + s * acceleration, zero],
        ]
        return PiecewisePolynomial(np.array([s, LONGEST_FORECAST]), np.array(rows), now)


@dataclass(frozen=True)
class AtConstantTurn:
    """The present speed and turn rate without end: vehicles on bends and in roundabouts.

    The turn rate follows from the acceleration across the velocity; the acceleration along it is ignored. An obstacle
    at rest, or with a turn rate below STRAIGHT_TURN_RATE, moves straight on.
    """

    includes_future: ClassVar[bool] = False

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        position = trajectory.position(now)
        velocity = trajectory.velocity(now)
        acceleration = trajectory.acceleration(now)
        speed_squared = float(velocity @ velocity)
        across = (
            acceleration - velocity * float(acceleration @ velocity) / speed_squared
            if speed_squared > 0.0
            else 0.0 * velocity
        )
        speed, lateral = float(np.sqrt(speed_squared)), float(np.linalg.norm(across))
        if lateral <= STRAIGHT_TURN_RATE * speed:
            return ConstantVelocity(position, velocity, now)
        radius = speed_squared / lateral
        center = position + across / lateral * radius
        normal = None
        if position.size == 2:
            sense = float(np.sign(velocity[0] * across[1] - velocity[1] * across[0]))
        else:
            normal, sense = np.cross(velocity, across), 1.0
        start = Circular(center, radius, sense * speed, 0.0, normal)
        x, y = start.basis @ (position - center)
        return replace(start, phase=float(np.arctan2(y, x)) - start.rate * now)


@dataclass(frozen=True)
class FromPast:
    """`rule` applied to the velocity and acceleration estimated from the positions of the last `seconds`.

    The estimate is the least-squares parabola through the present position, fitted to PAST_POSITIONS earlier ones. An
    obstacle that has just appeared has its true velocity, as a sensor of velocities measures it, and no acceleration.
    The velocity of a linear recording leads to the next sample: only then does the rule use what comes later. It uses
    little of the noise of single samples.

    An obstacle without an uncertainty of its own gets a bounded error that grows with time by `growth` times its speed.
    """

    includes_future: ClassVar[bool] = False
    rule: Forecast
    seconds: Positive = 0.5
    growth: NotNegative = 0.0

    def __post_init__(self) -> None:
        has(self.rule, *FORECAST, "rule")
        check_fields(self)
        if self.rule.includes_future or isinstance(self.rule, Present):
            raise InvalidInput(f"rule: expected a forecast from the observed state, found {self.rule}")

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        position, first = trajectory.position(now), trajectory.span[0]
        duration = min(self.seconds, now - first)
        if duration < 0.2 * self.seconds:
            return self.rule(ConstantAcceleration(position, trajectory.velocity(now), 0.0 * position, now), now)
        times = -duration * np.arange(1, PAST_POSITIONS + 1) / PAST_POSITIONS
        displacements = trajectory.position(np.maximum(now + times, first)) - position
        if np.abs(displacements).max() <= REST * duration:
            # At rest: the remaining displacement is rounding and has no meaningful direction.
            return self.rule(ConstantAcceleration(position, 0.0 * position, 0.0 * position, now), now)
        velocity, acceleration = np.linalg.lstsq(np.stack([times, 0.5 * times**2], axis=1), displacements, rcond=None)[
            0
        ]
        return self.rule(ConstantAcceleration(position, velocity, acceleration, now), now)


OBSERVING: Final = (FromPast, FromModels)
"""Forecasts that need past positions."""

EXACT: Final = (Known, Present)
"""Forecasts that return the true trajectory, at every time the same object."""

FORECASTS: Final[dict[str, Forecast]] = {
    "known": Known(),
    "present": Present(),
    "accelerating_briefly": AcceleratingBriefly(),
    "constant_velocity": AtConstantVelocity(),
    "constant_acceleration": AtConstantAcceleration(),
    "constant_turn": AtConstantTurn(),
}
"""Forecasts by name."""


FORESIGHTS: Final[dict[str, Forecast]] = {
    "recorded": Known(),
    "present": Present(),
    "observed": FromModels(),
    "observed_velocity": FromPast(AtConstantVelocity(), growth=0.2),
    "observed_turn": FromPast(AtConstantTurn(), growth=0.1),
}
"""Levels of foresight by name. recorded: all trajectories, including obstacles that appear later. present: the
trajectories of present obstacles. observed: predictions from past positions with several motion models.
observed_velocity, observed_turn: with a constant velocity or a constant turn; their growth rates were tuned on separate
tasks (docs/design/0010)."""


def foresight_of(forecast: Forecast) -> str:
    """Level of foresight of a forecast: recorded, present, or observed."""
    return "recorded" if forecast.includes_future else "present" if isinstance(forecast, Present) else "observed"
