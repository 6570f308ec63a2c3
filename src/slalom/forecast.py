"""From what is observed of an obstacle now to where it will be: a rule that gives a trajectory."""

from dataclasses import dataclass, replace
from typing import Final, Protocol, runtime_checkable

import numpy as np

from slalom.checks import positive
from slalom.obstacle import Obstacle
from slalom.trajectory import ConstantAcceleration, ConstantVelocity, PiecewisePolynomial, Trajectory


@runtime_checkable
class Forecast(Protocol):
    """A rule from an obstacle's true trajectory and the time of observation to the trajectory that is assumed.

    Law: a rule uses the true trajectory only at `now`, except `Known`, which is given all of it.
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


FAR: Final = 1e4
"""[s] Longer than any horizon."""

FORECASTS: Final[dict[str, Forecast]] = {
    "known": Known(),
    "accelerating_briefly": AcceleratingBriefly(),
    "constant_velocity": AtConstantVelocity(),
    "constant_acceleration": AtConstantAcceleration(),
}
"""Every forecast by name."""


def foreseen(obstacle: Obstacle, forecast: Forecast, now: float) -> Obstacle:
    """The obstacle as a forecast sees it at `now` [s]; the same object if the forecast changes nothing.

    One that is seen at rest keeps the heading that it stopped with.
    """
    trajectory = forecast(obstacle.trajectory, now)
    if trajectory is obstacle.trajectory:
        return obstacle
    if obstacle.turns and not np.any(trajectory.velocity(now)) and not np.any(trajectory.acceleration(now)):
        x, y = obstacle.direction(now)
        return replace(obstacle, trajectory=trajectory, heading=float(np.arctan2(y, x)))
    return replace(obstacle, trajectory=trajectory)
