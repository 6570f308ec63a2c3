"""How far ahead collisions with each obstacle count: for all alike, by name, or until the robot can have stopped."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from slalom.checks import Array, not_negative, positive
from slalom.limits import Limits
from slalom.obstacle import Obstacle
from slalom.state import State


@runtime_checkable
class Horizon(Protocol):
    """A rule for the horizon of each obstacle, as it is foreseen.

    Law: every horizon is above 0. The navigator cuts those that exceed its own `horizon`.
    """

    def __call__(self, state: State, obstacles: Sequence[Obstacle], limits: Limits, now: float) -> Array:
        """Horizons (n,) [s] for a robot in `state` at time `now` [s]."""


@dataclass(frozen=True)
class HorizonByName:
    """seconds[name] for the obstacles that are named, `otherwise` [s] for all others."""

    seconds: Mapping[str, float]
    otherwise: float

    def __post_init__(self) -> None:
        for name, value in self.seconds.items():
            positive(value, f"seconds[{name!r}]")
        positive(self.otherwise, "otherwise")

    def __call__(self, state: State, obstacles: Sequence[Obstacle], limits: Limits, now: float) -> Array:
        return np.array([self.seconds.get(obstacle.name, self.otherwise) for obstacle in obstacles])


@dataclass(frozen=True)
class SafeTime:
    """The safe time horizon: as long as the robot needs to stop, relative to the obstacle, by full braking.

    |v - v_B| / braking, and `extra` >= 0 [s] for what a decision takes and a manoeuvre holds; v_B is the velocity of
    the obstacle now, or when it appears. A longer horizon forbids controls that can still be corrected, a shorter one
    lets the robot get to where braking comes too late (Gal, Shiller and Rimon, ICRA 2009; Shiller, Gal and Raz, IROS
    2011, who cut the velocity obstacle where its boundary meets that of the states from which a collision is
    inevitable; for a robot that brakes straight this is the time to stop).
    """

    extra: float = 1.0

    def __post_init__(self) -> None:
        not_negative(self.extra, "extra")

    def __call__(self, state: State, obstacles: Sequence[Obstacle], limits: Limits, now: float) -> Array:
        times = []
        for obstacle in obstacles:
            seen = min(max(now, obstacle.trajectory.span[0]), obstacle.trajectory.span[1])
            relative = state.velocity - obstacle.trajectory.velocity(seen)
            times.append(float(np.linalg.norm(relative)) / limits.braking + self.extra)
        return np.maximum(np.array(times, dtype=np.float64), 1e-3)
