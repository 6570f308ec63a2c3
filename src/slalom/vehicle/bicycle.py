"""A bicycle or car that decides for a point ahead of its rear axle.

With speed v and steering angle d the heading turns at v tan(d) / L, L the wheelbase. The point at the distance l ahead
of the rear axle moves along the course heading + f with tan(f) = (l / L) tan(d). Let the radius of a path be nowhere
less than r > l. Once |sin f| is below l / r it never exceeds it (a tractrix): f' = (1 / radius - sin(f) / l) V. The
steering angle therefore suffices at every speed if r is the radius of the point's circle at the largest steering angle.
See docs/vehicles.md for the bound.
"""

from dataclasses import dataclass
from functools import cached_property
from math import atan, atan2, cos, hypot, pi, sin, sqrt, tan
from typing import Annotated

import numpy as np

from slalom.bounds import HeadingCone, TurningRadius
from slalom.checks import Array, NotNegative, Positive, positive
from slalom.errors import InvalidInput
from slalom.fields import check_fields
from slalom.goal import Goal
from slalom.limits import Limits
from slalom.path_goal import PathGoal
from slalom.tolerances import (
    CIRCLE_SLACK,
    CREEPING,
    REVERSALS,
    SPEED_STEP,
    STEEPEST_BEARING,
    STEEPEST_COURSE,
    STEERING_CONE,
    TURN_STEPS,
)
from slalom.trajectory import Stationary
from slalom.vehicle.motion import Motion, Turning
from slalom.vehicle.pose import Command, Pose
from slalom.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Bicycle(Vehicle):
    """Axles `wheelbase` [m] apart, the front one steered, that reach commands at the end of each `period` [s].

    Every command obeys -`max_reverse_speed` <= speed <= `max_speed` [m/s], |steering| <= `max_steering` [rad], and the
    rates `max_acceleration` [m/s^2] and `max_steering_rate` [rad/s]. The vehicle decides for the point `ahead` [m] of
    the rear axle. Plans within `limits` start from rest along its course and never reverse. `VehicleNavigator` also has
    manoeuvres that leave a place backwards.

    Attributes:
        ahead: [m]; the wheelbase by default.
        period: [s] between commands.
        max_reverse_speed: [m/s]; 0: it never reverses.

    Raises:
        InvalidInput: a value that is not above 0; a steering angle of a right angle or more.
    """

    wheelbase: Positive
    max_steering: Positive
    max_steering_rate: Positive
    max_speed: Positive
    max_acceleration: Positive
    ahead: Annotated[float | None, positive] = None
    period: Positive = 0.1
    disturbance: NotNegative = 0.0
    max_reverse_speed: NotNegative = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        if self.max_steering >= 0.5 * pi:
            raise InvalidInput(f"max_steering: expected less than pi / 2, found {self.max_steering:g}")

    @property
    def lever(self) -> float:
        return self.wheelbase if self.ahead is None else self.ahead

    @property
    def reverses(self) -> bool:
        return False

    @cached_property
    def _turning(self) -> tuple[float, float]:
        """`turning_radius`, and the steering rate [rad/s] that paths of that radius need."""
        radius, share = hypot(self.lever, self.wheelbase / tan(self.max_steering)), self.wheelbase / self.lever
        while True:
            # |f'| is at most 2 V / r where turning is bounded by the radius, (1 + Q) a / V where by the acceleration.
            speed = min(self.max_speed, sqrt(self.max_acceleration * radius))
            tangent = self.lever / sqrt(radius**2 - self.lever**2)
            rate = speed / radius * (1.0 + sqrt(1.0 + 4.0 * tangent**2)) * max(share, 1.0 / share)
            if rate <= self.max_steering_rate:
                return radius, rate
            radius /= SPEED_STEP

    @property
    def turning_radius(self) -> float:
        """Least radius [m] of the paths of the point: steering angle and steering rate always suffice.

        At least that of the circle at the largest steering angle.
        """
        return self._turning[0]

    @property
    def limits(self) -> Limits:
        bounds = TurningRadius(self.turning_radius), HeadingCone(STEERING_CONE)
        return Limits(self.max_speed, self.max_acceleration, bounds=bounds)

    @property
    def free_limits(self) -> Limits:
        return self.limits

    @cached_property
    def _displacement(self) -> float:
        """Bound [m] on the distance from the plan within the period after a decision from the state of the point."""
        v, a, h, lever, (radius, steering) = (
            self.max_speed,
            self.max_acceleration,
            self.period,
            self.lever,
            self._turning,
        )
        curvature = 1.0 / sqrt(radius**2 - lever**2)
        rate = steering * (1.0 / self.wheelbase + self.wheelbase * curvature**2)
        w, w1 = v * curvature, a * curvature + v * rate
        w2 = 2.0 * a * rate + 2.0 * v * self.wheelbase * curvature * steering * rate
        jerk = hypot(3.0 * lever * w * w1 + v * w * w, 2.0 * a * w + v * w1 + lever * w2 + lever * w**3)
        return jerk * h**3 / 12.0 + v * a * h**3 / radius + 2.0 * a * a * h**4 / radius

    @property
    def tracking_error(self) -> float:
        return self._displacement + self.disturbance

    @property
    def feedback(self) -> float:
        return self.max_acceleration

    @property
    def errors(self) -> tuple[float, float]:
        return self.disturbance, self.disturbance / self.period

    def goal(self, pose: Pose, goal: Goal, now: float = 0.0) -> Goal:
        """Goal of the point that brings the rear axle to `goal`, or a place from which it can be reached.

        A goal within the turning circle is left behind first. One far to the side is approached along the circle.
        """
        final = super().goal(pose, goal, now)
        place, _ = self.point(pose)
        to_go, course = final.position(now) - place, self._course(pose)
        bearing = (atan2(to_go[1], to_go[0]) - course + pi) % (2.0 * pi) - pi
        radius, side = CIRCLE_SLACK * self.turning_radius, 1.0 if bearing >= 0.0 else -1.0
        center = radius * side * np.array([-sin(course), cos(course)])
        if isinstance(final, PathGoal) or hypot(*to_go) <= final.tolerance:
            return final
        if hypot(*(to_go - center)) + final.tolerance < radius:
            angle = course
        elif abs(bearing) > STEEPEST_BEARING:
            angle = course + side * STEEPEST_BEARING
        else:
            return final
        distance = 2.0 * radius + hypot(*to_go)
        return Goal(Stationary(place + distance * np.array([cos(angle), sin(angle)])), radius)

    @property
    def leaves_backwards(self) -> bool:
        return self.max_reverse_speed > 0.0

    def ways_out(self, pose: Pose, periods: int) -> list[Array]:
        if not self.leaves_backwards:
            return []
        turns = (0.0, self.max_steering, -self.max_steering)
        return [
            self.standing_after(pose, -share * self.turning_radius, turn, periods)
            for share in REVERSALS
            for turn in turns
        ]

    def turn_rate(self, speed: float, turn: float) -> float:
        return speed * tan(turn) / self.wheelbase

    def turning(self, speeds: Array, turns: Array) -> Turning:
        speeds_before, speeds_after = np.abs(speeds[:-1]), np.abs(speeds[1:])
        fastest, angle = np.maximum(speeds_before, speeds_after), np.maximum(np.abs(turns[:-1]), np.abs(turns[1:]))
        a, rate = np.abs(np.diff(speeds)) / self.period, np.abs(np.diff(turns)) / self.period
        tangent = np.tan(angle)
        secant = 1.0 + tangent**2
        k, k1 = tangent / self.wheelbase, secant * rate / self.wheelbase
        k2, k3 = 2.0 * tangent * secant * rate**2 / self.wheelbase, 2.0 * secant * (secant + 2.0 * tangent**2) * rate**3
        k3 = k3 / self.wheelbase
        return Turning(fastest * k, a * k + fastest * k1, 2.0 * a * k1 + fastest * k2, 3.0 * a * k2 + fastest * k3)

    def _course(self, pose: Pose) -> float:
        return pose.heading + atan(self.lever / self.wheelbase * tan(pose.turn))

    def _reaching(self, motion: Motion, x: float, y: float) -> Command:
        share, half, size = self.lever / self.wheelbase, 0.5 * self.period, hypot(x, y)
        steering, speed = motion.turn, x * cos(motion.heading) + y * sin(motion.heading)
        # Backwards the velocity is opposite to the course.
        side = -1.0 if speed < 0.0 < self.max_reverse_speed else 1.0
        x, y, speed = side * x, side * y, side * max(0.0, side * speed)
        if size < CREEPING:
            return Command(speed, steering)
        course, before = atan2(y, x), self.turn_rate(motion.speed, motion.turn)
        for _ in range(TURN_STEPS):
            middle = self.turn_rate(0.5 * (motion.speed + speed), 0.5 * (motion.turn + steering))
            # Simpson's rule for the change of the heading.
            turned = half / 3.0 * (before + 4.0 * middle + self.turn_rate(speed, steering))
            angle = (course - motion.heading - turned + pi) % (2.0 * pi) - pi
            last, angle = steering, min(max(angle, -STEEPEST_COURSE), STEEPEST_COURSE)
            steering = min(max(atan(tan(angle) / share), -self.max_steering), self.max_steering)
            speed = side * max(0.0, size * cos(angle))
            if abs(steering - last) <= 1e-14:
                break
        return Command(speed, steering)

    def within_limits(self, motion: Motion, wanted: Command) -> Command:
        a, rate = self.max_acceleration * self.period, self.max_steering_rate * self.period
        slowest = -self.max_reverse_speed
        speed = min(max(wanted.speed, motion.speed - a, slowest), max(motion.speed + a, slowest), self.max_speed)
        turn = min(max(wanted.turn, motion.turn - rate), motion.turn + rate)
        return Command(speed, min(max(turn, -self.max_steering), self.max_steering))
