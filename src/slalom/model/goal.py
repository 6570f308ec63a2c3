"""Goals at rest or in motion."""

from dataclasses import dataclass
from math import pi
from typing import Final

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import TRAJECTORY, Array, flag, has, number, positive
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import ARRIVAL_FILTER, BRAKING_SHARE, REST, SQUARED_LENGTH_FLOOR
from slalom.model.limits import Limits, least_speed
from slalom.model.trajectory import Stationary, Trajectory
from slalom.model.trajectory.protocol import FOREVER

ARRIVAL_ERROR: Final = 1e-9
"""[m] Error of the least distance from a goal in motion during a step. Larger: a robot that passes at the tolerance may
arrive or not within this distance. Smaller: more halvings there."""

ROOT_HALVINGS: Final = 53
"""[1] Bisections of a share of a step: beyond them the interval is shorter than rounding can resolve."""


@dataclass(frozen=True, eq=False)
class Goal:
    """Target position, at rest or moving, to pass within `tolerance` [m] or, with `stop`, to reach and stay at.

    Before and after the span of its trajectory the goal rests at its first and last position. A goal to pass is reached
    at the end of the first step whose motion comes within `tolerance` of it, also between the ends of the step. With
    `stop` only states at the ends of steps count: there the relative speed must also be at most `tolerance` / s.

    A vehicle on wheels may also have to face in a direction there: `heading` [rad], within `heading_tolerance` [rad].
    Robots that move in every direction refuse such a goal.

    Raises:
        InvalidInput: not a trajectory; a tolerance that is not above 0.
    """

    trajectory: Trajectory
    tolerance: float = 0.5
    stop: bool = False
    heading: float | None = None
    heading_tolerance: float = 0.05

    def __post_init__(self) -> None:
        has(self.trajectory, *TRAJECTORY, "goal: trajectory")
        object.__setattr__(self, "tolerance", positive(self.tolerance, "tolerance"))
        object.__setattr__(self, "stop", flag(self.stop, "stop"))
        if self.heading is not None:
            object.__setattr__(self, "heading", number(self.heading, "heading"))
        object.__setattr__(self, "heading_tolerance", positive(self.heading_tolerance, "heading_tolerance"))

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

    def reached(
        self, position: Array, velocity: Array, now: float, heading: float | None = None, progress: float | None = None
    ) -> bool:
        """Whether a robot in this state at time `now` [s] has arrived; for its motion since see `reached_during`.

        progress: [m] along the path of a `PathGoal` at the last decision.

        Raises:
            InvalidInput: no heading [rad], for a goal that has one.
        """
        if self.heading is not None:
            if heading is None:
                raise InvalidInput(f"heading: expected that of the robot for a goal with {self.heading:g}, found none")
            if abs((heading - self.heading + pi) % (2.0 * pi) - pi) > self.heading_tolerance:
                return False
        return bool(self.reached_at(position, velocity, np.asarray(now)))

    def reached_at(self, positions: Array, velocities: Array, times: Array) -> npt.NDArray[np.bool_]:
        """Whether the goal is reached, for positions and velocities (..., d) at times (...) [s]: (...)."""
        within = np.linalg.norm(self.position(times) - positions, axis=-1) <= self.tolerance
        if not self.stop or not np.any(within):
            return np.asarray(within)
        return np.asarray(within & (np.linalg.norm(self.velocity(times) - velocities, axis=-1) <= self.tolerance))

    def reached_during(
        self,
        positions: Array,
        velocities: Array,
        accelerations: Array | float,
        times: Array | float,
        duration: float,
        progress: float | None = None,
    ) -> npt.NDArray[np.bool_]:
        """Whether the goal is reached during steps that begin in these states: (...).

        With `stop` only the end of a step counts, see `reached_at`. A goal to pass is reached if the least distance
        during the step is at most the tolerance. To a goal at rest that distance is exact. The motion relative to
        another goal is halved until the chords of its parts are within ARRIVAL_ERROR of it, by the bound of the goal's
        acceleration between its breaks.

        Args:
            positions, velocities: (..., d) [m, m/s] at the begin of each step. accelerations: (..., d) [m/s^2],
                constant during it. Where only two positions are known, the mean velocity and 0 are the straight way.
            times: (...) [s] of the begins. duration: [s] of a step.
        """
        begin, v, a = np.broadcast_arrays(positions, velocities, accelerations)
        start = np.broadcast_to(np.asarray(times, dtype=np.float64), begin.shape[:-1])
        end = begin + duration * (v + 0.5 * duration * a)
        found = np.array(self.reached_at(end, v + duration * a, start + duration))
        if self.stop or found.all():
            return found
        # No part of the motion is farther from its end than the longest way.
        speed = np.maximum(np.linalg.norm(v, axis=-1), np.linalg.norm(v + duration * a, axis=-1))
        if isinstance(self.trajectory, Stationary):
            reach = self.tolerance + duration * speed
            near = ~found & (np.linalg.norm(end - self.position(start), axis=-1) <= ARRIVAL_FILTER * reach)
            offset = (begin - self.position(start))[near]
            found[near] = least_distance(offset, duration * v[near], 0.5 * duration**2 * a[near]) <= self.tolerance
            return found
        for k in np.ndindex(found.shape):
            found[k] = found[k] or self._passed(begin[k], v[k], a[k], float(start[k]), duration)
        return found

    def _passed(self, position: Array, velocity: Array, acceleration: Array, now: float, duration: float) -> bool:
        """Whether the motion of one step from `now` [s] on passes a goal that moves."""
        first, last = np.clip(self.trajectory.span, now, now + duration).tolist()
        knots, bend = [now, first, last, now + duration], float(np.linalg.norm(acceleration)) / 8.0
        if first < last:
            knots += self.trajectory.breaks(first, last).tolist()
            bend += self.trajectory.acceleration_bound(first, last) / 8.0
        times = np.unique(knots)
        begin, end = times[:-1], times[1:]
        while len(begin):
            moments = np.stack([begin, end])
            t = (moments - now)[..., None]
            offsets = position + t * (velocity + 0.5 * t * acceleration) - self.position(moments)
            if np.any(np.linalg.norm(offsets, axis=-1) <= self.tolerance):
                return True
            error, chord = bend * (end - begin) ** 2, offsets[1] - offsets[0]
            distance = least_distance(offsets[0], chord, np.zeros_like(chord))
            if np.any((distance <= self.tolerance) & (error <= ARRIVAL_ERROR)):
                return True
            rest = (distance <= self.tolerance + error) & (error > ARRIVAL_ERROR)
            begin, end = begin[rest], end[rest]
            middle = 0.5 * (begin + end)
            begin, end = np.concatenate([begin, middle]), np.concatenate([middle, end])
        return False

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
        displacement = self.position(now) - position
        within = float(np.linalg.norm(displacement)) <= self.tolerance
        if within and self._rests(displacement, relative, period, limits.braking):
            speed = 0.0
        desired = then + away * (speed / left)
        return np.asarray(desired / max(float(np.linalg.norm(desired)) / limits.max_speed, 1.0))

    def _rests(self, away: Array, velocity: Array, step: float = 0.0, most: float = 0.0) -> bool:
        """Whether a robot that brakes evenly, by at most `most` [m/s^2], rests at the goal after a step [s].

        away: (d,) [m] displacement of the goal. velocity: (d,) [m/s] relative to it.
        """
        left = np.linalg.norm(away - 0.5 * step * velocity)
        return bool(left <= self.tolerance and np.linalg.norm(velocity) <= REST + step * most)

    def time_to_go(self, position: Array, velocity: Array, now: float, limits: Limits, shortest: float = 0.0) -> float:
        """Estimated time [s] that a robot in this state needs to the goal without obstacles.

        To pass a goal at rest: the earliest arrival under one constant acceleration followed by coasting, exact
        (`kernels/decision/targets.py`). A moving goal is evaluated where it is intercepted. With `stop`: exact on a
        line, with the deceleration of `desired_velocity`; 0 for a robot at rest within the tolerance.

        Args:
            shortest: [s] the least time for which the robot holds an acceleration. To stop takes at least twice this
                time, or once where it brakes to rest within the tolerance.
        """
        most = limits.max_acceleration
        top = limits.max_speed
        braking = BRAKING_SHARE * limits.braking
        duration = 0.0
        if self.stop:
            away, relative = self.position(now) - position, velocity - self.velocity(now)
            if self._rests(away, relative, shortest, limits.braking):
                return 0.0 if self._rests(away, relative) else shortest
            return max(float(kernels.time_to_rest(away, relative, most, braking, top)), 2.0 * shortest)
        for _ in range(1 if isinstance(self.trajectory, Stationary) else 4):
            displacement = self.position(now + duration) - position
            duration = kernels.earliest_arrival(displacement, velocity, most, top, 0.5 * self.tolerance)
        return float(duration)


def refuse_goal(goal: Goal, limits: Limits, name: str = "goal", turns: bool = False) -> None:
    """Raise InvalidInput for a goal that no robot with these limits can reach.

    That is one at rest to stop at with the bound LeastSpeed, and one with a heading for a robot without one.

    Args:
        turns: whether the robot is a vehicle that faces along its motion.
    """
    bound = least_speed(limits)
    if bound is not None and goal.stop and isinstance(goal.trajectory, Stationary):
        raise InvalidInput(
            f"{name}: expected one to pass (stop=False) with {bound!r}, by which the robot never stops; "
            "found one at rest with stop=True"
        )
    if goal.heading is not None and not turns:
        raise InvalidInput(
            f"{name}: expected one without a heading for a robot that moves in every direction, "
            f"found {goal.heading:g} rad; a VehicleNavigator takes it"
        )


def least_distance(begin: Array, way: Array, bend: Array) -> Array:
    """Least distance (n,) [m] of motions begin + u way + u^2 bend, 0 <= u <= 1, from the origin; all (n, d) [m].

    Half the derivative of the squared distance is a cubic with a leading coefficient of at least 0. It rises before the
    first and after the second root of its own derivative. Each of the two parts has at most one minimum, at the root of
    the cubic, which bisection finds to the last digit.
    """
    c0, c1 = (begin * way).sum(axis=-1), (way * way + 2.0 * begin * bend).sum(axis=-1)
    if not bend.any():
        u = np.clip(-c0 / np.maximum(c1, SQUARED_LENGTH_FLOOR), 0.0, 1.0)
        return np.asarray(np.linalg.norm(begin + u[..., None] * way, axis=-1))
    c2, c3 = 3.0 * (way * bend).sum(axis=-1), 2.0 * (bend * bend).sum(axis=-1)
    square = c2 * c2 - 3.0 * c1 * c3
    larger = np.where(square > 0.0, -c2 - np.copysign(np.sqrt(np.maximum(square, 0.0)), c2), 1.0)
    # The roots of c1 + 2 c2 u + 3 c3 u^2 without cancellation. Without any, the cubic rises up to 1.
    roots = np.stack([larger / np.maximum(3.0 * c3, SQUARED_LENGTH_FLOOR), c1 / larger])
    first, second = np.clip(np.where(square > 0.0, np.sort(roots, axis=0), 1.0), 0.0, 1.0)
    least = np.minimum(np.linalg.norm(begin, axis=-1), np.linalg.norm(begin + way + bend, axis=-1))
    low, high = np.stack([np.zeros_like(first), second]), np.stack([first, np.ones_like(second)])
    for _ in range(ROOT_HALVINGS):
        middle = 0.5 * (low + high)
        falls = c0 + middle * (c1 + middle * (c2 + middle * c3)) < 0.0
        low, high = np.where(falls, middle, low), np.where(falls, high, middle)
    for u in high[..., None]:
        least = np.minimum(least, np.linalg.norm(begin + u * (way + u * bend), axis=-1))
    return np.asarray(least)
