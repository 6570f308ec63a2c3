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
from typing import Annotated, Final, NamedTuple

import numpy as np

from slalom.base.checks import Array, NotNegative, Positive, check_fields, positive
from slalom.base.errors import InvalidInput
from slalom.model.bounds import HeadingCone, TurningRadius
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.path_goal import PathGoal
from slalom.model.trajectory import Stationary
from slalom.vehicle.vehicle import CREEPING, Command, Motion, Pose, Turning, Vehicle

TURN_STEPS: Final = 20
"""[1] Most steps of Newton's method for the turn in a period. It converges in 3 to 5.

Larger: never needed. Smaller: the velocity at the end of a period is not the commanded one.
"""

STEERING_CONE: Final = 1.2
"""[rad] Largest angle by which a decision for a bicycle turns its course.

Larger: manoeuvres that the steering does not follow are chosen. Smaller: slower avoidance.
"""

REVERSALS: Final = (3.0, 2.0, 1.0)
"""[1] Distances in turning radii by which a bicycle leaves a place backwards; the first free one is taken.

Longer: more room for the next turn, and more that is driven twice. Shorter: it may need several reversals.
"""

STEEPEST_COURSE: Final = 1.4
"""[rad] Largest angle between the heading of a bicycle and the velocity that its steering aims at, below pi / 2.

Larger: steering angles close to a right angle. Smaller: a very long steered point ahead of the front axle is not used.
"""

SPEED_STEP: Final = 0.98
"""[1] Ratio of successive speeds among which the largest permitted one of a vehicle is found.

Closer to 1: a speed that is up to 2 % larger.
"""

CIRCLE_SLACK: Final = 1.1
"""[1] Circle on which a bicycle turns towards a goal far to its side, in circles of its smallest turning radius.

Larger: wider turns. With 1 the goal may slip into the circle, and the turn begins anew.
"""

STEEPEST_BEARING: Final = 1.0
"""[rad] Angle between the course of a bicycle and its goal beyond which it first turns along a circle.

Larger: accelerations towards the goal that slow it down before it turns. Smaller: wider turns.
"""


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
        v = self.max_speed
        a = self.max_acceleration
        h = self.period
        lever = self.lever
        (radius, steering) = self._turning
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
        share = self.lever / self.wheelbase
        half = 0.5 * self.period
        size = hypot(x, y)
        steering, speed = motion.turn, x * cos(motion.heading) + y * sin(motion.heading)
        # Backwards the velocity is opposite to the course.
        side = -1.0 if speed < 0.0 < self.max_reverse_speed else 1.0
        x = side * x
        y = side * y
        speed = side * max(0.0, side * speed)
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


# ---------------------------------------------------------------------------------------------------------------------
# A differential drive that decides for a point ahead of its axle, with a proven bound.
#
# Let e be the unit vector along the heading and n the one to its left. With speed v and turn rate w the point at the
# distance l ahead of the axle has the velocity v e + l w n. Every velocity of the point thus belongs to one (v, w).
# The drive stands still, turns in place and starts from rest in every direction. docs/vehicles.md derives the bound.


FEEDBACK_SHARE: Final = 0.5
"""[1] Largest share of the acceleration of a vehicle, and of its speed, that the correction of errors may take.

Larger: faster vehicles with slower reactions. Smaller: in long periods vehicles are slower.
"""


WORST_CASE_SHARE = 1.5 + sqrt(3.0) / 18.0
"""[1] Largest error of position, in units of the displacement D of one period (docs/vehicles.md)."""


class _Bounds(NamedTuple):
    """Bounds on the motion of the point."""

    speed: float  # V [m/s], with errors
    acceleration: float  # B [m/s^2], with feedback
    displacement: float  # D [m], of one period


@dataclass(frozen=True)
class DifferentialDrive(Vehicle):
    """Two driven wheels `track` [m] apart that reach commanded (speed, turn rate) at the end of each `period` [s].

    Every command obeys `max_wheel_speed` [m/s] and `max_wheel_acceleration` [m/s^2]. In between the wheels change their
    speeds at constant rates. The vehicle decides for the point `ahead` [m] of the middle of the axle.

    Law: `shape` about the plan contains the body at all times.

    Attributes:
        ahead: [m]; half the track by default. A larger one permits a larger speed, and grows the robot.
        period: [s] between commands. In a long one the largest speed of the point is smaller.
        max_speed, max_acceleration: [m/s], [m/s^2] further limits of the point; None: by the wheels alone.
        disturbance: [m] further distance from the plan at which the drive still counts as on it: slip, localisation. It
            is grown into the robot.

    Raises:
        InvalidInput: a value that is not above 0; a period in which the point would leave the plan by too much at any
            speed.
    """

    track: Positive
    max_wheel_speed: Positive
    max_wheel_acceleration: Positive
    ahead: Annotated[float | None, positive] = None
    period: Positive = 0.1
    max_speed: Annotated[float | None, positive] = None
    max_acceleration: Annotated[float | None, positive] = None
    disturbance: NotNegative = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        slow = self._available if self.max_acceleration is None else min(self._available, self.max_acceleration)
        # The displacement of the slowest point, in proportion to its speed.
        longest = sqrt(4.0 * FEEDBACK_SHARE * self.lever / slow)
        if self.period >= longest:
            raise InvalidInput(f"period: expected less than {longest:g} s for these wheels, found {self.period:g} s")

    @property
    def lever(self) -> float:
        return 0.5 * self.track if self.ahead is None else self.ahead

    @property
    def reverses(self) -> bool:
        return True

    @property
    def _wheel_share(self) -> float:
        """Largest speed of a wheel for a unit speed of the point."""
        return hypot(1.0, 0.5 * self.track / self.lever)

    @property
    def _available(self) -> float:
        """Acceleration [m/s^2] of the point that the wheels always permit at rest."""
        return self.max_wheel_acceleration / self._wheel_share

    @cached_property
    def _bounds(self) -> _Bounds:
        """Largest speed and acceleration of the point that the wheels always permit, and the displacement."""
        lever, h = self.lever, self.period
        available = self._available
        speed = min(self.max_wheel_speed / self._wheel_share, sqrt(0.5 * available * lever))
        if self.max_speed is not None:
            speed = min(speed, self.max_speed)
        while True:
            acceleration = available - speed * speed / lever
            if self.max_acceleration is not None:
                acceleration = min(acceleration, self.max_acceleration)
            slow = 1.0 - 1.5 * speed * h / lever
            jerk = speed / lever * (3.0 * acceleration + speed * speed / lever) / max(slow, 1e-9)
            bounds = _Bounds(speed, acceleration, jerk * h**3 / 12.0)
            if slow > 0.0 and bounds.displacement <= FEEDBACK_SHARE * h * min(0.5 * h * acceleration, speed):
                return bounds
            # In a long period the drive turns far: a slower point keeps the bound.
            speed *= SPEED_STEP

    @property
    def limits(self) -> Limits:
        bounds, h = self._bounds, self.period
        return Limits(bounds.speed - bounds.displacement / h, bounds.acceleration - 2.0 * bounds.displacement / h**2)

    @property
    def free_limits(self) -> Limits:
        speed = self.max_wheel_speed if self.max_speed is None else min(self.max_speed, self.max_wheel_speed)
        most = self.max_wheel_acceleration
        return Limits(speed, most if self.max_acceleration is None else min(self.max_acceleration, most))

    @property
    def tracking_error(self) -> float:
        return WORST_CASE_SHARE * self._bounds.displacement + self.disturbance

    @property
    def feedback(self) -> float:
        return self._bounds.acceleration

    @property
    def errors(self) -> tuple[float, float]:
        displacement = self._bounds.displacement
        return 1.5 * displacement + self.disturbance, (displacement + self.disturbance) / self.period

    def turn_rate(self, speed: float, turn: float) -> float:
        return turn

    def turning(self, speeds: Array, turns: Array) -> Turning:
        rate, zero = np.abs(np.diff(turns)) / self.period, np.zeros(len(turns) - 1)
        return Turning(np.maximum(np.abs(turns[:-1]), np.abs(turns[1:])), rate, zero, zero)

    def _reaching(self, motion: Motion, x: float, y: float) -> Command:
        half = 0.5 * self.period
        lever = self.lever
        turn = motion.turn
        for _ in range(TURN_STEPS):
            angle = motion.heading + half * (motion.turn + turn)
            c, s = cos(angle), sin(angle)
            change = (lever * turn - (y * c - x * s)) / max(lever + half * (x * c + y * s), 0.5 * lever)
            turn -= change
            if abs(change) <= 1e-15 * (1.0 + abs(turn)):
                break
        angle = motion.heading + half * (motion.turn + turn)
        return Command(x * cos(angle) + y * sin(angle), turn)

    def within_limits(self, motion: Motion, wanted: Command) -> Command:
        half = 0.5 * self.track
        most = self.max_wheel_acceleration * self.period
        fastest = self.max_wheel_speed
        (low_left, high_left), (low_right, high_right) = (
            (min(max(w - most, -fastest), fastest), max(min(w + most, fastest), -fastest))
            for w in (motion.speed - half * motion.turn, motion.speed + half * motion.turn)
        )
        difference = min(max(self.track * wanted.turn, low_right - high_left), high_right - low_left)
        low, high = max(low_left, low_right - difference), min(high_left, high_right - difference)
        left = min(max(wanted.speed - 0.5 * difference, low), high)
        return Command(left + 0.5 * difference, difference / self.track)
