"""From what is observed of an obstacle now to where it will be: a rule that gives a trajectory."""

from dataclasses import dataclass, replace
from typing import Final, Protocol, runtime_checkable

import numpy as np

from slalom.checks import not_negative, positive
from slalom.errors import InvalidInput
from slalom.obstacle import Obstacle
from slalom.tolerances import REST
from slalom.trajectory import Circular, ConstantAcceleration, ConstantVelocity, PiecewisePolynomial, Trajectory
from slalom.uncertainty import BoundedError


@runtime_checkable
class Forecast(Protocol):
    """A rule from an obstacle's true trajectory and the time of observation to the trajectory that is assumed.

    Law: a rule uses the true trajectory only at `now`, except `Known` and `Present`, which are given all of it, and
    `FromPast`, which uses what was before.
    """

    @property
    def foresees(self) -> bool:
        """Whether obstacles that are not there yet are known of. If not, the rule is asked only of those that are."""

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        """The trajectory assumed from `now` on. Raises OutsideSpan when there is no obstacle at `now`."""


@dataclass(frozen=True)
class Known:
    """The trajectory itself: published plans, lanes, recordings. The assumption of NLVO and NAO."""

    @property
    def foresees(self) -> bool:
        return True

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        return trajectory


@dataclass(frozen=True)
class Present:
    """The trajectory itself, of those that are there: nothing is known of who will appear."""

    @property
    def foresees(self) -> bool:
        return False

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        return trajectory


@dataclass(frozen=True)
class AtConstantVelocity:
    """The velocity of this moment for ever. The assumption of VO and AVO."""

    @property
    def foresees(self) -> bool:
        return False

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        return ConstantVelocity(trajectory.position(now), trajectory.velocity(now), now)


@dataclass(frozen=True)
class AtConstantAcceleration:
    """The velocity and acceleration of this moment, the acceleration for ever. The assumption of AO."""

    @property
    def foresees(self) -> bool:
        return False

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        return ConstantAcceleration(
            trajectory.position(now), trajectory.velocity(now), trajectory.acceleration(now), now
        )


@dataclass(frozen=True)
class AcceleratingBriefly:
    """The acceleration of this moment for `seconds`, then the velocity reached: for robots that decide often.

    What a robot accelerates now tells where it is about to go, and nothing of what it will do later; assumed for ever,
    a robot that brakes would come back.
    """

    seconds: float = 0.3

    def __post_init__(self) -> None:
        positive(self.seconds, "seconds")

    @property
    def foresees(self) -> bool:
        return False

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        place, speed = trajectory.position(now), trajectory.velocity(now)
        push, s = trajectory.acceleration(now), self.seconds
        nothing = np.zeros_like(push)
        rows = [[place, speed, 0.5 * push], [place + s * speed + 0.5 * s * s * push, speed + s * push, nothing]]
        return PiecewisePolynomial(np.array([s, FAR]), np.array(rows), now)


@dataclass(frozen=True)
class AtConstantTurn:
    """The speed and the rate of turning of this moment for ever: what vehicles on bends and in roundabouts do.

    The rate is that of the acceleration across the velocity; what accelerates along it is dropped. Straight on where
    that turns by less than STRAIGHT radians per second, or where nothing moves.
    """

    @property
    def foresees(self) -> bool:
        return False

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        place, speed, push = trajectory.position(now), trajectory.velocity(now), trajectory.acceleration(now)
        square = float(speed @ speed)
        across = push - speed * float(push @ speed) / square if square > 0.0 else 0.0 * speed
        fast, size = float(np.sqrt(square)), float(np.linalg.norm(across))
        if size <= STRAIGHT * fast:
            return ConstantVelocity(place, speed, now)
        radius = square / size
        center = place + across / size * radius
        normal = None
        if place.size == 2:
            turning = float(np.sign(speed[0] * across[1] - speed[1] * across[0]))
        else:
            normal, turning = np.cross(speed, across), 1.0
        start = Circular(center, radius, turning * fast, 0.0, normal)
        x, y = start.basis @ (place - center)
        return replace(start, phase=float(np.arctan2(y, x)) - start.rate * now)


@dataclass(frozen=True)
class FromPast:
    """What `rule` makes of the velocity and acceleration that the positions of the last `seconds` show.

    A parabola through where the obstacle is now, fitted to where it was; one that has just appeared is seen to have the
    velocity that it has, and no acceleration. So a rule sees nothing of what a recording holds for later, and little
    of the noise of single samples.

    What is foreseen so may be off: an obstacle without an uncertainty of its own is given a bounded error that grows by
    `doubt` times its speed.
    """

    rule: Forecast
    seconds: float = 0.5
    growth: float = 0.0

    def __post_init__(self) -> None:
        positive(self.seconds, "seconds")
        not_negative(self.growth, "doubt")
        if self.rule.foresees or isinstance(self.rule, Present):
            raise InvalidInput(f"rule: expected a forecast from what is seen, found {self.rule}")

    @property
    def foresees(self) -> bool:
        return False

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        place, first = trajectory.position(now), trajectory.span[0]
        back = min(self.seconds, now - first)
        if back < 0.2 * self.seconds:
            return self.rule(ConstantAcceleration(place, trajectory.velocity(now), 0.0 * place, now), now)
        ago = -back * np.arange(1, LOOKS + 1) / LOOKS
        was = trajectory.position(np.maximum(now + ago, first)) - place
        if np.abs(was).max() <= REST * back:
            # It rests: what is left is rounding, and a direction would be made of that.
            return self.rule(ConstantAcceleration(place, 0.0 * place, 0.0 * place, now), now)
        speed, push = np.linalg.lstsq(np.stack([ago, 0.5 * ago**2], axis=1), was, rcond=None)[0]
        return self.rule(ConstantAcceleration(place, speed, push, now), now)


STRAIGHT: Final = 1e-3
"""[rad/s] Obstacles that turn more slowly are foreseen to go straight on."""
LOOKS: Final = 5
"""[1] Positions of the past that a forecast is fitted to."""
FAR: Final = 1e4
"""[s] Longer than any horizon."""

EXACT: Final = (Known, Present)
"""Kinds of forecasts that give the trajectory itself, at any time the same."""

FORECASTS: Final[dict[str, Forecast]] = {
    "known": Known(),
    "present": Present(),
    "accelerating_briefly": AcceleratingBriefly(),
    "constant_velocity": AtConstantVelocity(),
    "constant_acceleration": AtConstantAcceleration(),
    "constant_turn": AtConstantTurn(),
}
"""Every forecast by name."""


FORESIGHTS: Final[dict[str, Forecast]] = {
    "recorded": Known(),
    "present": Present(),
    "observed": FromPast(AcceleratingBriefly(1.0), growth=0.1),
    "observed_velocity": FromPast(AtConstantVelocity(), growth=0.2),
    "observed_turn": FromPast(AtConstantTurn(), growth=0.1),
}
"""Levels of foresight: the futures of all, also of who will appear; the futures of those who are there; and what was
seen until now, with accelerations that last a second, with constant velocity, or on circles. The doubts were tuned on
tasks of their own (docs/design/0010)."""


def foresight_of(forecast: Forecast) -> str:
    """The level of foresight of a forecast: recorded, present, or observed."""
    return "recorded" if forecast.foresees else "present" if isinstance(forecast, Present) else "observed"


def predicted(obstacle: Obstacle, forecast: Forecast, now: float) -> Obstacle:
    """The obstacle as a forecast sees it at `now` [s]; the same object if the forecast changes nothing.

    One that is seen at rest keeps the heading that it stopped with.
    """
    trajectory = forecast(obstacle.trajectory, now)
    if trajectory is obstacle.trajectory:
        return obstacle
    if isinstance(forecast, FromPast) and forecast.growth and obstacle.uncertainty is None:
        speed = float(np.linalg.norm(trajectory.velocity(now)))
        obstacle = replace(obstacle, uncertainty=BoundedError(velocity=forecast.growth * speed))
    if obstacle.turns and not np.any(trajectory.velocity(now)) and not np.any(trajectory.acceleration(now)):
        x, y = obstacle.direction(now)
        return replace(obstacle, trajectory=trajectory, heading=float(np.arctan2(y, x)))
    return replace(obstacle, trajectory=trajectory)
