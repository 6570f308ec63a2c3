"""Horizons of single obstacles: one for all, by name, or the time that the robot needs to stop."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import numpy as np

from slalom.base.checks import Array, CheckedFields, NotNegative, Positive, check_fields, mapping, positive
from slalom.model.limits import Limits
from slalom.model.state import State
from slalom.obstacle.obstacle import Obstacle

SHORTEST_HORIZON: Final = 1e-3
"""[s] Least horizon for one obstacle. Larger: obstacles beside a robot at rest count longer. At 0: for no time."""


@runtime_checkable
class Horizon(Protocol):
    """Rule for the horizon of each predicted obstacle.

    Law: every horizon is above 0. The navigator limits them to its own `horizon`.
    """

    def __call__(self, state: State, obstacles: Sequence[Obstacle], limits: Limits, now: float) -> Array:
        """Horizons (n,) [s] of n predicted obstacles for a robot in `state` at time `now` [s]."""


@dataclass(frozen=True)
class HorizonByName:
    """seconds[name] for named obstacles, `otherwise` [s] for all others."""

    seconds: Mapping[str, float]
    otherwise: Positive

    def __post_init__(self) -> None:
        mapping(self.seconds, "numbers by name", "seconds")
        for name, value in self.seconds.items():
            positive(value, f"seconds[{name!r}]")
        check_fields(self)

    def __call__(self, state: State, obstacles: Sequence[Obstacle], limits: Limits, now: float) -> Array:
        return np.array([self.seconds.get(obstacle.name, self.otherwise) for obstacle in obstacles])


@dataclass(frozen=True)
class SafeTime(CheckedFields):
    """Safe time horizon: the time that the robot needs to stop relative to the obstacle under full braking.

    |v - v_B| / braking + `extra`; `extra` >= 0 [s] allows for the decision period and the hold of a manoeuvre. v_B is
    the velocity of the obstacle now, or when it appears. A longer horizon forbids controls that can still be corrected.
    With a shorter one the robot may enter states in which braking is too late. Source: Gal, Shiller and Rimon, ICRA
    2009; Shiller, Gal and Raz, IROS 2011. They cut the velocity obstacle where its boundary meets that of the
    inevitable collision states. For a robot that brakes straight this is the time to stop.
    """

    extra: NotNegative = 1.0

    def __call__(self, state: State, obstacles: Sequence[Obstacle], limits: Limits, now: float) -> Array:
        times = []
        for obstacle in obstacles:
            time = min(max(now, obstacle.trajectory.span[0]), obstacle.trajectory.span[1])
            relative = state.velocity - obstacle.trajectory.velocity(time)
            times.append(float(np.linalg.norm(relative)) / limits.braking + self.extra)
        return np.maximum(np.array(times, dtype=np.float64), SHORTEST_HORIZON)


HORIZONS: Final[dict[str, type[Horizon]]] = {"horizon_by_name": HorizonByName, "safe_time": SafeTime}
"""Rules by the name that files of decisions use."""
