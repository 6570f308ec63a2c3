"""Trajectories displaced by a vector."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array
from slalom.model.path import Path
from slalom.model.trajectory.kinds import Stationary
from slalom.model.trajectory.protocol import Trajectory, moving_direction


@dataclass(frozen=True, eq=False)
class Displaced:
    """The trajectory `of`, displaced `by` (d,) [m]."""

    of: Trajectory
    by: Array

    @property
    def dimension(self) -> int:
        return self.of.dimension

    @property
    def span(self) -> tuple[float, float]:
        return self.of.span

    def position(self, t: npt.ArrayLike) -> Array:
        return self.of.position(t) + self.by

    def velocity(self, t: npt.ArrayLike) -> Array:
        return self.of.velocity(t)

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return self.of.acceleration(t)

    def breaks(self, start: float, end: float) -> Array:
        return self.of.breaks(start, end)

    def speed_bound(self, start: float, end: float) -> float:
        return self.of.speed_bound(start, end)

    def acceleration_bound(self, start: float, end: float) -> float:
        return self.of.acceleration_bound(start, end)

    def direction(self, start: float, end: float, tolerance: float) -> Path:
        """Direction of the motion in certified pieces, see `direction.Directed`."""
        return moving_direction(self.of, start, end, tolerance)

    def path(self, start: float, end: float) -> Path:
        path = self.of.path(start, end)
        return path._replace(points=path.points + self.by)


def moved(trajectory: Trajectory, by: Array) -> Trajectory:
    """The trajectory displaced `by` (d,) [m]: the same object for a displacement of 0, `Stationary` if it is."""
    if not np.any(by):
        return trajectory
    if isinstance(trajectory, Stationary):
        return Stationary(trajectory.initial_position + by)
    return Displaced(trajectory, by)
