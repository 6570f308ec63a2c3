"""A differential drive that decides for a point ahead of its axle, with a proven bound.

Let e be the unit vector along the heading and n the one to its left. With speed v and turn rate w the point at the
distance l ahead of the axle has the velocity v e + l w n. Every velocity of the point thus belongs to one (v, w). The
drive stands still, turns in place and starts from rest in every direction. docs/vehicles.md derives the bound.
"""

from dataclasses import dataclass
from functools import cached_property
from math import cos, hypot, sin, sqrt
from typing import Annotated, NamedTuple

import numpy as np

from slalom.checks import Array, NotNegative, Positive, positive
from slalom.errors import InvalidInput
from slalom.fields import check_fields
from slalom.limits import Limits
from slalom.tolerances import FEEDBACK_SHARE, SPEED_STEP, TURN_STEPS
from slalom.vehicle.motion import Motion, Turning
from slalom.vehicle.pose import Command
from slalom.vehicle.vehicle import Vehicle

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
        half, lever, turn = 0.5 * self.period, self.lever, motion.turn
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
        half, most, fastest = 0.5 * self.track, self.max_wheel_acceleration * self.period, self.max_wheel_speed
        (low_left, high_left), (low_right, high_right) = (
            (min(max(w - most, -fastest), fastest), max(min(w + most, fastest), -fastest))
            for w in (motion.speed - half * motion.turn, motion.speed + half * motion.turn)
        )
        difference = min(max(self.track * wanted.turn, low_right - high_left), high_right - low_left)
        low, high = max(low_left, low_right - difference), min(high_left, high_right - difference)
        left = min(max(wanted.speed - 0.5 * difference, low), high)
        return Command(left + 0.5 * difference, difference / self.track)
