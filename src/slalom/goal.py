"""Where the robot should be."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.checks import Array, has, positive
from slalom.limits import Limits
from slalom.trajectory import Stationary, Trajectory
from slalom.trajectory.protocol import FOREVER


@dataclass(frozen=True, eq=False)
class Goal:
    """A place, at rest or moving, to pass within `tolerance` [m], or with `stop` to reach and stay at.

    Before and after the span of its trajectory the goal rests where that begins and ends. A robot has arrived when it
    is within `tolerance` of the goal; with `stop` also at most `tolerance` / s faster or slower than it.

    Raises:
        InvalidInput: no trajectory; a tolerance that is not above 0.
    """

    trajectory: Trajectory
    tolerance: float = 0.5
    stop: bool = False

    def __post_init__(self) -> None:
        has(self.trajectory, ("position", "span"), "a trajectory, such as Stationary((x, y))", "goal")
        object.__setattr__(self, "tolerance", positive(self.tolerance, "tolerance"))

    def position(self, t: npt.ArrayLike) -> Array:
        """Where the goal is at times t (...): (..., d) [m]."""
        span = self.trajectory.span
        return self.trajectory.position(t if span == FOREVER else np.clip(np.asarray(t, dtype=np.float64), *span))

    def velocity(self, t: npt.ArrayLike) -> Array:
        """How fast the goal is at times t (...): (..., d) [m/s]."""
        first, last = self.trajectory.span
        time = np.asarray(t, dtype=np.float64)
        there = ((time >= first) & (time <= last))[..., None]
        return np.asarray(np.where(there, self.trajectory.velocity(np.clip(time, first, last)), 0.0))

    def reached(self, position: Array, velocity: Array, now: float) -> bool:
        """Whether a robot in this state at time `now` [s] has arrived."""
        return bool(self.reached_at(position, velocity, np.asarray(now)))

    def reached_at(self, positions: Array, velocities: Array, times: Array) -> npt.NDArray[np.bool_]:
        """As `reached`, for states (..., d) at times (...)."""
        near = np.linalg.norm(self.position(times) - positions, axis=-1) <= self.tolerance
        if not self.stop or not np.any(near):
            return np.asarray(near)
        return np.asarray(near & (np.linalg.norm(self.velocity(times) - velocities, axis=-1) <= self.tolerance))

    def meeting_point(self, position: Array, now: float, limits: Limits) -> Array:
        """Where a robot at `position` (d,) [m], at top speed from now on, meets the goal; the goal itself if at rest.

        A few rounds of "where will it be when I get there"; a goal that runs away is led by a bounded time.
        """
        ahead = 0.0
        for _ in range(4):
            away = np.linalg.norm(self.position(now + ahead) - position)
            ahead = min(float(away) / limits.max_speed, 2.0 * ahead + 10.0)
        return self.position(now + ahead)

    def desired_velocity(self, position: Array, velocity: Array, now: float, limits: Limits) -> Array:
        """The velocity (d,) [m/s] that leads a robot in this state to the goal as soon as possible.

        Towards the meeting point at top speed, but no faster than lets it turn there: the arc from the present heading
        to the point has the radius distance / (2 sin angle), or robots would orbit their goals. With `stop` no
        faster, relative to the goal, than 0.7 of the limit brakes away.
        """
        wanted = np.empty_like(position)
        if not self.stop:
            away = self.meeting_point(position, now, limits) - position
            kernels.passing_velocity(away, velocity, limits.max_acceleration, limits.max_speed, wanted)
            return wanted
        away = self.position(now) - position
        kernels.stopping_velocity(away, limits.max_acceleration, limits.max_speed, wanted)
        wanted += self.velocity(now)
        return np.asarray(wanted / max(float(np.linalg.norm(wanted)) / limits.max_speed, 1.0))

    def time_to_go(self, position: Array, velocity: Array, now: float, limits: Limits) -> float:
        """An estimate [s] of how long a robot in this state needs to the goal, alone in the world.

        To pass through a goal at rest: the earliest arrival by one push and coasting, exact (`kernels/arrival.py`); a
        moving goal is taken where it is met. With `stop`: exact on a line for a robot that is not faster than
        its distance allows; what turning the velocity costs is |dv|^2 / (2 a v).
        """
        top, push = limits.max_speed, limits.max_acceleration
        if not self.stop:
            ahead = 0.0
            for _ in range(1 if isinstance(self.trajectory, Stationary) else 4):
                away = self.position(now + ahead) - position
                ahead = kernels.earliest_arrival(away, velocity, push, top, 0.5 * self.tolerance)
            return float(ahead)
        distance = max(0.0, float(np.linalg.norm(self.position(now) - position)) - self.tolerance)
        change = float(np.linalg.norm(self.desired_velocity(position, velocity, now, limits) - velocity))
        return float(kernels.time_to_stop(distance, change, push, top))
