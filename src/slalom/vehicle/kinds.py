"""Kinds of vehicles on wheels: a bicycle or car, and a differential drive."""

from dataclasses import dataclass
from functools import cached_property
from math import atan, hypot, pi, sqrt, tan
from typing import Annotated, Final

import numpy as np

from slalom.base.checks import NotNegative, Positive, check_fields, positive
from slalom.base.errors import InvalidInput
from slalom.kernels.vehicle.wheels import Wheels
from slalom.model.bounds import HeadingCone, TurningRadius
from slalom.model.limits import Limits
from slalom.vehicle.vehicle import Pose, Vehicle

STEERING_CONE: Final = 1.2
"""[rad] Largest angle by which a decision for a bicycle turns its course.

Larger: manoeuvres that the steering does not follow are chosen. Smaller: slower avoidance.
"""

SPEED_STEP: Final = 0.98
"""[1] Ratio of successive speeds among which the largest permitted one of a vehicle is found.

Closer to 1: a speed that is up to 2 % larger.
"""

HELD_TURNS: Final = (0.0, 0.1, 0.25, 0.5, 1.0)
"""[1] Turns that a vehicle may hold where no plan is clear, as shares of its largest, to both sides.

More: ways out of narrower places, and longer decisions. Fewer: the vehicle waits more often.
"""

HELD_TURN_RATE: Final = 2.0
"""[rad/s] The largest turn rate of a differential drive that it holds. Larger: coarser steps of the smaller ones."""

GENTLE_TURNS: Final = (0.001, 0.006, 0.03)
"""[1] Further ones of a bicycle: its rear swings out towards a wall beside it, by less in a wider turn."""

HELD_SPEEDS: Final = (1.0, 0.7, 0.4, 0.2, 0.0)
"""[1] Speeds that a vehicle may hold where no plan is clear, as shares of its largest. As of HELD_TURNS."""

HELD_BACKWARDS: Final = (0.3, 1.0)
"""[1] Those of a differential drive backwards. As of HELD_TURNS."""


POINT_AHEAD: Final = 0.5
"""[1] Distance of the point that decides ahead of the axle of a differential drive, in tracks.

Longer: plans keep farther from the motion of the body. Shorter: errors of the measured pose turn the drive.
"""


def both_sides(turns: tuple[float, ...]) -> list[float]:
    """The turns to both sides, straight ahead once."""
    return [side * turn for turn in turns for side in ((1.0, -1.0) if turn > 0.0 else (1.0,))]


@dataclass(frozen=True)
class Bicycle(Vehicle):
    """Axles `wheelbase` [m] apart, the front one steered.

    Every command obeys -`max_reverse_speed` <= speed <= `max_speed` [m/s], |steering| <= `max_steering` [rad], and the
    rates `max_acceleration` [m/s^2] and `max_steering_rate` [rad/s]. It decides for the point `ahead` [m] of the rear
    axle, the front axle by default. Plans of that point start from rest along its course and never reverse; other
    manoeuvres of `VehicleNavigator` do.

    With speed v and steering angle d the heading turns at v tan(d) / L, L the wheelbase. The point at the distance l
    ahead of the rear axle moves along the course heading + f with tan(f) = (l / L) tan(d). Let the radius of a path be
    nowhere less than r > l. Once |sin f| is below l / r it never exceeds it (a tractrix). The steering angle therefore
    suffices at every speed if r is the radius of the point's circle at the largest steering angle.

    Attributes:
        max_reverse_speed: [m/s]; 0: it never reverses.
        See `Vehicle` for the others.

    Raises:
        InvalidInput: a value that is not above 0; a steering angle of a right angle or more.
    """

    wheelbase: Positive
    max_steering: Positive
    max_steering_rate: Positive
    max_speed: Positive
    max_acceleration: Positive
    max_reverse_speed: NotNegative = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        if self.max_steering >= 0.5 * pi:
            raise InvalidInput(f"max_steering: expected less than pi / 2, found {self.max_steering:g}")

    @cached_property
    def wheels(self) -> Wheels:
        return Wheels(
            True,
            self.period,
            self.lever,
            self.wheelbase,
            self.max_speed,
            self.max_reverse_speed,
            self.max_acceleration,
            self.max_steering,
            self.max_steering_rate,
            *self.lags,
        )

    @property
    def lever(self) -> float:
        return self.wheelbase if self.ahead is None else self.ahead

    @property
    def least_radius(self) -> float:
        return self.wheelbase / tan(self.max_steering)

    @property
    def holds(self) -> list[tuple[float, float]]:
        speeds = [share * self.max_speed for share in HELD_SPEEDS]
        if self.max_reverse_speed > 0.0:
            speeds.append(-self.max_reverse_speed)
        return [(v, turn * self.max_steering) for v in speeds for turn in both_sides(HELD_TURNS + GENTLE_TURNS)]

    @cached_property
    def turning_radius(self) -> float:
        """Least radius [m] of the paths of the point: steering angle and steering rate always suffice.

        At least that of the circle at the largest steering angle.
        """
        radius, share = hypot(self.lever, self.wheelbase / tan(self.max_steering)), self.wheelbase / self.lever
        while True:
            # The angle f to the course changes by at most 2 V / r where turning is bounded by the radius, and by
            # (1 + Q) a / V where by the acceleration.
            speed = min(self.max_speed, sqrt(self.max_acceleration * radius))
            tangent = self.lever / sqrt(radius**2 - self.lever**2)
            rate = speed / radius * (1.0 + sqrt(1.0 + 4.0 * tangent**2)) * max(share, 1.0 / share)
            if rate <= self.max_steering_rate:
                return radius
            radius /= SPEED_STEP

    @property
    def limits(self) -> Limits:
        bounds = TurningRadius(self.turning_radius), HeadingCone(STEERING_CONE)
        return Limits(self.max_speed, self.max_acceleration, bounds=bounds)

    def course(self, pose: Pose) -> float:
        return pose.heading + atan(self.lever / self.wheelbase * tan(pose.turn))


@dataclass(frozen=True)
class DifferentialDrive(Vehicle):
    """Two driven wheels `track` [m] apart.

    Every command obeys `max_wheel_speed` [m/s] and `max_wheel_acceleration` [m/s^2] of each wheel, and the limits of
    the turn. It decides for the point `ahead` [m] of the middle of the axle, half the track by default: with
    speed v and turn rate w that point has the velocity v e + l w n, e along the heading and n to its left. Every
    velocity of the point thus belongs to one (v, w). The drive stands still, turns in place and starts from rest in
    every direction.

    Attributes:
        max_speed, max_acceleration: [m/s], [m/s^2] further limits of the point; None: by the wheels alone.
        max_turn_rate, max_turn_acceleration: [rad/s], [rad/s^2]; None: by the wheels alone.
        See `Vehicle` for the others.

    Raises:
        InvalidInput: a value that is not above 0; different lags of speed and turn.
    """

    track: Positive
    max_wheel_speed: Positive
    max_wheel_acceleration: Positive
    max_speed: Annotated[float | None, positive] = None
    max_acceleration: Annotated[float | None, positive] = None
    max_turn_rate: Annotated[float | None, positive] = None
    max_turn_acceleration: Annotated[float | None, positive] = None

    def __post_init__(self) -> None:
        check_fields(self)
        if self.lags[0] != self.lags[1]:
            raise InvalidInput(
                f"lag: expected one lag, that of both wheels, found {self.lags[0]:g} and {self.lags[1]:g} s"
            )

    @cached_property
    def wheels(self) -> Wheels:
        speed, acceleration = self.max_wheel_speed, self.max_wheel_acceleration
        return Wheels(
            False,
            self.period,
            self.lever,
            self.track,
            speed,
            speed,
            acceleration,
            self._turn_rate,
            min(2.0 * acceleration / self.track, self.max_turn_acceleration or np.inf),
            *self.lags,
        )

    @property
    def turning_radius(self) -> float:
        return self.lever

    @property
    def _turn_rate(self) -> float:
        return min(2.0 * self.max_wheel_speed / self.track, self.max_turn_rate or np.inf)

    @property
    def lever(self) -> float:
        return POINT_AHEAD * self.track if self.ahead is None else self.ahead

    @property
    def least_radius(self) -> float:
        return self.lever

    @property
    def holds(self) -> list[tuple[float, float]]:
        speeds = [*HELD_SPEEDS, *(-share for share in HELD_BACKWARDS)]
        turns = [turn * min(HELD_TURN_RATE, self._turn_rate) for turn in both_sides(HELD_TURNS)]
        return [(share * self.limits.max_speed, turn) for share in speeds for turn in turns]

    @property
    def limits(self) -> Limits:
        speed = self.max_wheel_speed if self.max_speed is None else min(self.max_speed, self.max_wheel_speed)
        most = self.max_wheel_acceleration
        return Limits(speed, most if self.max_acceleration is None else min(self.max_acceleration, most))
