"""Where the robot should be."""

from dataclasses import dataclass

import numpy as np

from slalom.checks import Array, positive
from slalom.limits import Limits
from slalom.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Goal:
    """A place, at rest or moving, to pass within `tolerance` [m], or with `stop` to reach and stay at.

    A robot has arrived when it is within `tolerance` of the goal; with `stop` also at most `tolerance` / s faster
    or slower than it.
    """

    trajectory: Trajectory
    tolerance: float = 0.5
    stop: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "tolerance", positive(self.tolerance, "tolerance"))

    def reached(self, position: Array, velocity: Array, now: float) -> bool:
        """Whether a robot in this state at time `now` [s] has arrived."""
        near = np.linalg.norm(self.trajectory.position(now) - position) <= self.tolerance
        if not self.stop:
            return bool(near)
        return bool(near and np.linalg.norm(self.trajectory.velocity(now) - velocity) <= self.tolerance)

    def desired_velocity(self, position: Array, now: float, limits: Limits) -> Array:
        """The velocity (..., d) [m/s] that leads from `position` (..., d) to the goal as soon as possible.

        Towards the goal at top speed; with `stop` no faster, relative to the goal, than 0.7 of the limit brakes away.
        """
        away = self.trajectory.position(now) - position
        distance = np.linalg.norm(away, axis=-1, keepdims=True)
        speed = np.full_like(distance, limits.max_speed)
        if not self.stop:
            return np.asarray(away * speed / np.maximum(distance, 1e-12))
        speed = np.minimum(speed, np.sqrt(1.4 * limits.max_acceleration * distance))
        wanted = self.trajectory.velocity(now) + away * speed / np.maximum(distance, 1e-12)
        excess = np.linalg.norm(wanted, axis=-1, keepdims=True) / limits.max_speed
        return np.asarray(wanted / np.maximum(excess, 1.0))

    def time_to_go(self, position: Array, velocity: Array, now: float, limits: Limits) -> float:
        """An estimate [s] of how long a robot in this state needs to the goal, alone in the world.

        Exact on a line for a robot that is not slower than its distance allows: the distance at top speed, and
        what is lost by turning the present velocity into the desired one, |dv|^2 / (2 a v); with `stop` the braking.
        """
        top, push = limits.max_speed, limits.max_acceleration
        distance = max(0.0, float(np.linalg.norm(self.trajectory.position(now) - position)) - self.tolerance)
        change = float(np.linalg.norm(self.desired_velocity(position, now, limits) - velocity))
        lost = change * change / (2.0 * push * top)
        if not self.stop:
            return distance / top + lost
        braking = top * top / (2.0 * push)
        if distance >= braking:
            return distance / top + 0.5 * top / push + lost
        return float(np.sqrt(2.0 * distance / push)) + change / push
