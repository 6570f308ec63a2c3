"""Trajectories at rest, at constant velocity, and at constant acceleration."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, Checked, Number, vector
from slalom.fields import check_fields
from slalom.path import Path
from slalom.trajectory.protocol import Endless, Trajectory


@dataclass(frozen=True, eq=False)
class Stationary(Endless):
    """At rest at `initial_position` (d,) [m]."""

    initial_position: Checked = Checked(vector, key="position")

    @property
    def dimension(self) -> int:
        return self.initial_position.size

    def position(self, t: npt.ArrayLike) -> Array:
        # One time, as in each decision, needs no array of times.
        shape = () if isinstance(t, float) else np.shape(t)
        return np.tile(self.initial_position, (*shape, 1)) if shape else self.initial_position.copy()

    def velocity(self, t: npt.ArrayLike) -> Array:
        return np.zeros((*np.shape(t), self.dimension))

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return self.velocity(t)

    def speed_bound(self, start: float, end: float) -> float:
        return 0.0

    def acceleration_bound(self, start: float, end: float) -> float:
        return 0.0

    def path(self, start: float, end: float) -> Path:
        return _quadratic_path(self, start, end)


@dataclass(frozen=True, eq=False)
class ConstantVelocity(Endless):
    """At `initial_position` (d,) [m] at time `at` [s], with constant `initial_velocity` (d,) [m/s]."""

    initial_position: Checked = Checked(vector, key="position")
    initial_velocity: Checked = Checked(vector, key="velocity")
    at: Number = 0.0

    def __post_init__(self) -> None:
        vector(self.initial_velocity, "initial_velocity", self.initial_position.size)
        check_fields(self)

    @property
    def dimension(self) -> int:
        return self.initial_position.size

    def position(self, t: npt.ArrayLike) -> Array:
        return self.initial_position + (np.asarray(t, dtype=np.float64) - self.at)[..., None] * self.initial_velocity

    def velocity(self, t: npt.ArrayLike) -> Array:
        return np.broadcast_to(self.initial_velocity, (*np.shape(t), self.dimension))

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return np.zeros((*np.shape(t), self.dimension))

    def speed_bound(self, start: float, end: float) -> float:
        return float(np.linalg.norm(self.initial_velocity))

    def acceleration_bound(self, start: float, end: float) -> float:
        return 0.0

    def path(self, start: float, end: float) -> Path:
        return _quadratic_path(self, start, end)


@dataclass(frozen=True, eq=False)
class ConstantAcceleration(Endless):
    """At `initial_position` with `initial_velocity` at time `at` [s]; `initial_acceleration` is constant.

    All three are (d,), in [m], [m/s] and [m/s^2].
    """

    initial_position: Checked = Checked(vector, key="position")
    initial_velocity: Checked = Checked(vector, key="velocity")
    initial_acceleration: Checked = Checked(vector, key="acceleration")
    at: Number = 0.0

    def __post_init__(self) -> None:
        vector(self.initial_velocity, "initial_velocity", self.initial_position.size)
        vector(self.initial_acceleration, "initial_acceleration", self.initial_position.size)
        check_fields(self)

    @property
    def dimension(self) -> int:
        return self.initial_position.size

    def position(self, t: npt.ArrayLike) -> Array:
        elapsed = (np.asarray(t, dtype=np.float64) - self.at)[..., None]
        return self.initial_position + elapsed * (self.initial_velocity + 0.5 * elapsed * self.initial_acceleration)

    def velocity(self, t: npt.ArrayLike) -> Array:
        return (
            self.initial_velocity + (np.asarray(t, dtype=np.float64) - self.at)[..., None] * self.initial_acceleration
        )

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return np.broadcast_to(self.initial_acceleration, (*np.shape(t), self.dimension))

    def speed_bound(self, start: float, end: float) -> float:
        return float(np.linalg.norm(self.velocity(np.array([start, end])), axis=-1).max())

    def acceleration_bound(self, start: float, end: float) -> float:
        return float(np.linalg.norm(self.initial_acceleration))

    def path(self, start: float, end: float) -> Path:
        return _quadratic_path(self, start, end)


def _quadratic_path(trajectory: Trajectory, start: float, end: float) -> Path:
    """One exact piece: the control points of a parabola from its position, velocity and acceleration at the start."""
    duration = end - start
    step = trajectory.velocity(start) * (duration / 3.0)
    second_difference = trajectory.acceleration(start) * (duration * duration / 6.0)
    points = np.empty((1, 4, trajectory.dimension))
    points[0, 0] = trajectory.position(start)
    points[0, 1] = points[0, 0] + step
    points[0, 2] = points[0, 1] + step + second_difference
    points[0, 3] = points[0, 2] + step + 2.0 * second_difference
    return Path(np.array([start, end]), points, np.zeros(1))
