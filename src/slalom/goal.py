"""Goals at rest or in motion."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.checks import TRAJECTORY, Array, flag, has, positive
from slalom.limits import Limits
from slalom.tolerances import AT_REST, BRAKING_SHARE
from slalom.trajectory import Stationary, Trajectory
from slalom.trajectory.protocol import FOREVER


@dataclass(frozen=True, eq=False)
class Goal:
    """Target position, at rest or moving, to pass within `tolerance` [m] or, with `stop`, to reach and stay at.

    Before and after the span of its trajectory the goal rests at its first and last position. A robot has arrived when
    it is within `tolerance` of the goal; with `stop` its relative speed must also be at most `tolerance` / s.

    Raises:
        InvalidInput: not a trajectory; a tolerance that is not above 0.
    """

    trajectory: Trajectory
    tolerance: float = 0.5
    stop: bool = False

    def __post_init__(self) -> None:
        has(self.trajectory, *TRAJECTORY, "goal: trajectory")
        object.__setattr__(self, "tolerance", positive(self.tolerance, "tolerance"))
        object.__setattr__(self, "stop", flag(self.stop, "stop"))

    def position(self, t: npt.ArrayLike) -> Array:
        """Position (..., d) [m] of the goal at times t (...) [s]."""
        span = self.trajectory.span
        return self.trajectory.position(t if span == FOREVER else np.clip(np.asarray(t, dtype=np.float64), *span))

    def velocity(self, t: npt.ArrayLike) -> Array:
        """Velocity (..., d) [m/s] of the goal at times t (...) [s]; 0 outside the span of its trajectory."""
        first, last = self.trajectory.span
        time = np.asarray(t, dtype=np.float64)
        exists = ((time >= first) & (time <= last))[..., None]
        return np.asarray(np.where(exists, self.trajectory.velocity(np.clip(time, first, last)), 0.0))

    def reached(self, position: Array, velocity: Array, now: float) -> bool:
        """Whether a robot in this state at time `now` [s] has arrived."""
        return bool(self.reached_at(position, velocity, np.asarray(now)))

    def reached_at(self, positions: Array, velocities: Array, times: Array) -> npt.NDArray[np.bool_]:
        """Whether the goal is reached, for positions and velocities (..., d) at times (...) [s]: (...)."""
        within = np.linalg.norm(self.position(times) - positions, axis=-1) <= self.tolerance
        if not self.stop or not np.any(within):
            return np.asarray(within)
        return np.asarray(within & (np.linalg.norm(self.velocity(times) - velocities, axis=-1) <= self.tolerance))

    def interception_point(self, position: Array, now: float, limits: Limits) -> Array:
        """Position (d,) [m] where a robot at `position` (d,) [m], at max_speed from now on, meets the goal.

        Fixed-point iteration with four steps on the time of arrival. The time is bounded for goals that outrun the
        robot.
        """
        duration = 0.0
        for _ in range(4):
            distance = np.linalg.norm(self.position(now + duration) - position)
            duration = min(float(distance) / limits.max_speed, 2.0 * duration + 10.0)
        return self.position(now + duration)

    def desired_velocity(
        self, position: Array, velocity: Array, now: float, limits: Limits, period: float = 0.0
    ) -> Array:
        """Velocity (d,) [m/s] that leads a robot in this state to the goal as soon as possible.

        To pass: it points to the interception point, at max_speed or, if lower, the speed at which the robot can still
        turn there. The arc from the present heading to the point has the radius distance / (2 sin angle); without this
        limit robots orbit their goals. With `stop`: the velocity to have after `period` [s]. From there the robot comes
        to rest at the goal exactly, relative to it, if it brakes by BRAKING_SHARE of what its limits allow in whole
        periods. A robot within the tolerance that can come to rest there within one period does so.
        """
        if not self.stop:
            desired = np.empty_like(position)
            displacement = self.interception_point(position, now, limits) - position
            kernels.passing_velocity(displacement, velocity, limits.max_acceleration, limits.max_speed, desired)
            return desired
        relative, then = velocity - self.velocity(now), self.velocity(now + period)
        away = self.position(now + period) - position - 0.5 * period * (velocity + then)
        left = max(float(np.linalg.norm(away)), 1e-300)
        speed = min(kernels.stopping_speed(left, float(period), BRAKING_SHARE * limits.braking), limits.max_speed)
        if self._rests(self.position(now) - position, relative, period, BRAKING_SHARE * limits.braking):
            speed = 0.0
        desired = then + away * (speed / left)
        return np.asarray(desired / max(float(np.linalg.norm(desired)) / limits.max_speed, 1.0))

    def _rests(self, away: Array, velocity: Array, step: float = 0.0, braking: float = 0.0) -> bool:
        """Whether a robot at displacement `away` (d,) [m] from the goal comes to rest there within a step [s]."""
        farthest = max(np.linalg.norm(away), np.linalg.norm(away - 0.5 * step * velocity))
        return bool(farthest <= self.tolerance and np.linalg.norm(velocity) <= AT_REST + step * braking)

    def time_to_go(self, position: Array, velocity: Array, now: float, limits: Limits) -> float:
        """Estimated time [s] that a robot in this state needs to the goal without obstacles.

        To pass a goal at rest: the earliest arrival under one constant acceleration followed by coasting, exact
        (`kernels/decision/time_to_go.py`). A moving goal is evaluated where it is intercepted. With `stop`: exact on a
        line, with the deceleration of `desired_velocity`.
        """
        most, top, braking = limits.max_acceleration, limits.max_speed, BRAKING_SHARE * limits.braking
        if self.stop:
            away, relative = self.position(now) - position, velocity - self.velocity(now)
            if self._rests(away, relative):
                return 0.0
            return float(kernels.time_to_rest(away, relative, most, braking, top))
        duration = 0.0
        for _ in range(1 if isinstance(self.trajectory, Stationary) else 4):
            displacement = self.position(now + duration) - position
            duration = kernels.earliest_arrival(displacement, velocity, most, top, 0.5 * self.tolerance)
        return float(duration)
