"""What the obstacles of a window come from: lists, tables and tracks."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from slalom.checks import Array
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import ObstacleAtHorizon
from slalom.kernels.records import Records
from slalom.obstacle.at_horizon import at_horizon, represented
from slalom.obstacle.obstacle import Obstacle
from slalom.obstacle.pieces import Bodies, Reach, pieces_of_each
from slalom.obstacle.table import ObstacleTable, one_dimension
from slalom.obstacle.tracks import Tracks
from slalom.shape import Shape


class Source(Protocol):
    """Obstacles that come together."""

    @property
    def dimension(self) -> int | None:
        """2 or 3; None if there are none."""

    @property
    def obstacles(self) -> Sequence[Obstacle]:
        """The obstacles of the source, one by one."""

    @property
    def is_passive(self) -> bool:
        """Whether contacts with some of them do not count while the robot is at rest."""

    @property
    def has_futures(self) -> bool:
        """Whether some are futures with a probability below 1."""

    def __len__(self) -> int: ...

    def bodies(self, robot: Shape, start: float, until: Array, horizon: float, reach: Reach | None = None) -> Bodies:
        """Their pieces from `start` on, up to `until` (n,) [s] after it, see `ObstacleTable.bodies`."""

    def at_horizon(self, start: float, horizon: float) -> tuple[Indices, Records[ObstacleAtHorizon]]:
        """Those that balls represent and that exist after `horizon` [s] from the start: numbers (m,) and balls."""


class _Listed:
    """Obstacles of this decision only."""

    def __init__(self, obstacles: Sequence[Obstacle]) -> None:
        self.obstacles = obstacles
        self.dimension = one_dimension(obstacle.dimension for obstacle in obstacles)
        self.is_passive = not all(obstacle.contact_at_rest for obstacle in obstacles)
        self.has_futures = any(obstacle.probability < 1.0 for obstacle in obstacles)

    def __len__(self) -> int:
        return len(self.obstacles)

    def bodies(self, robot: Shape, start: float, until: Array, horizon: float, reach: Reach | None = None) -> Bodies:
        """The pieces of all from `start` on, up to `until` (n,) [s] after it; none of those that do not exist then."""
        return pieces_of_each(self.obstacles, robot, start, until)

    def at_horizon(self, start: float, horizon: float) -> tuple[Indices, Records[ObstacleAtHorizon]]:
        """Those that balls represent and that exist after `horizon` [s] from the start: numbers (m,) and balls."""
        t, some = start + horizon, represented(self.obstacles)
        there = some[np.array([self.obstacles[k].exists(t) for k in some], np.bool_)]
        return there, at_horizon(self.obstacles, there, t)


def sources_of(obstacles: Sequence[Obstacle | ObstacleTable | Tracks], now: float, end: float) -> list[Source]:
    """Tables and tracks as they are, obstacles that follow each other together, as they are known at `now` [s].

    A trajectory that lasts up to the `end` [s] of the window needs no continuation.
    """
    found: list[Source] = []
    plain: list[Obstacle] = []
    for one in obstacles:
        if isinstance(one, Obstacle):
            plain.append(one if one.trajectory.span[1] >= end else one.known_at(now))
            continue
        if plain:
            found.append(_Listed(plain))
            plain = []
        found.append(one)
    return [*found, _Listed(plain)] if plain else found
