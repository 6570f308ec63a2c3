"""A differential drive that decides for a point ahead of its axle, with a proven bound.

With speed v and turn rate w the point at the distance l ahead of the axle has the velocity v e + l w n, where e is the
unit vector along the heading and n the one to its left. Every velocity of the point thus belongs to one (v, w): the
drive stands still, turns in place and starts from rest in every direction.

The accelerations of the wheels are constant in each period h. The command brings the velocity of the point at the end
of the period to v_0 + (a + c) h, with a the mean acceleration of the plan and the deadbeat feedback
c = -(f_x / h^2 + 3 f_v / (2 h)) of its errors f_x, f_v. docs/vehicles.md derives the bound.
"""

from dataclasses import dataclass
from functools import cached_property
from math import cos, hypot, sin, sqrt
from typing import NamedTuple

import numpy as np

from slalom.checks import Array, has, not_negative, number, positive
from slalom.decision import Decision
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import Limits
from slalom.shape import Disc
from slalom.state import State
from slalom.tolerances import TURN_STEPS
from slalom.vehicle.pose import Command, Pose, goal_of_point, state_of_point

WORST_CASE_SHARE = 1.5 + sqrt(3.0) / 18.0
"""[1] Largest error of position, in units of the displacement D of one period (docs/vehicles.md)."""

_GAUSS_RULE = np.polynomial.legendre.leggauss(10)


class _Bounds(NamedTuple):
    """Bounds on the motion of the point."""

    speed: float  # V [m/s], with errors
    acceleration: float  # B [m/s^2], with feedback
    displacement: float  # D [m], of one period


@dataclass(frozen=True)
class DifferentialDrive:
    """Two driven wheels `track` [m] apart that reach commanded (speed, turn rate) at the end of each `period` [s].

    Every command obeys `max_wheel_speed` [m/s] and `max_wheel_acceleration` [m/s^2]. In between the wheels change their
    speeds at constant rates. The vehicle decides for the point `ahead` [m] of the middle of the axle.

    Law: if the drive starts from rest, or on the plan, `shape` about the plan contains the body at all times.

    Attributes:
        ahead: [m]; half the track by default. A larger one permits a larger speed, and grows the robot.
        period: [s] between commands.
        max_speed, max_acceleration: [m/s], [m/s^2] further limits of the point; None: by the wheels alone.
        disturbance: [m] further distance from the plan at which the drive still counts as on it: slip, localisation. It
            is grown into the robot.

    Raises:
        InvalidInput: a value that is not above 0; a period so long that the bound does not hold.
    """

    track: float
    max_wheel_speed: float
    max_wheel_acceleration: float
    ahead: float | None = None
    period: float = 0.1
    max_speed: float | None = None
    max_acceleration: float | None = None
    disturbance: float = 0.0

    def __post_init__(self) -> None:
        for name in ("track", "max_wheel_speed", "max_wheel_acceleration", "period"):
            object.__setattr__(self, name, positive(getattr(self, name), name))
        for name in ("ahead", "max_speed", "max_acceleration"):
            given = getattr(self, name)
            object.__setattr__(self, name, None if given is None else positive(given, name))
        object.__setattr__(self, "disturbance", not_negative(self.disturbance, "disturbance"))
        self._bounds  # noqa: B018  # refuses a period that is too long

    @property
    def lever(self) -> float:
        """Distance [m] of the point ahead of the axle."""
        return 0.5 * self.track if self.ahead is None else self.ahead

    @cached_property
    def _bounds(self) -> _Bounds:
        """Largest speed and acceleration of the point that the wheels always permit, and the displacement."""
        lever, h = self.lever, self.period
        wheel_share = hypot(1.0, 0.5 * self.track / lever)
        available = self.max_wheel_acceleration / wheel_share
        speed = min(self.max_wheel_speed / wheel_share, sqrt(0.5 * available * lever))
        if self.max_speed is not None:
            speed = min(speed, self.max_speed)
        acceleration = available - speed * speed / lever
        if self.max_acceleration is not None:
            acceleration = min(acceleration, self.max_acceleration)
        slow = 1.0 - 1.5 * speed * h / lever
        jerk = speed / lever * (3.0 * acceleration + speed * speed / lever) / max(slow, 1e-9)
        bounds = _Bounds(speed, acceleration, jerk * h**3 / 12.0)
        feedback = 2.0 * bounds.displacement / h**2
        if slow <= 0.0 or feedback > 0.5 * acceleration or bounds.displacement / h > 0.5 * speed:
            raise InvalidInput(
                f"period: expected one within which a drive of {speed:.3g} m/s turns little about a point "
                f"{lever:g} m ahead, found {h:g} s; a smaller max_speed or a larger ahead permits it"
            )
        return bounds

    @property
    def limits(self) -> Limits:
        """Limits of the point: with them the wheels always suffice."""
        bounds, h = self._bounds, self.period
        feedback = 2.0 * bounds.displacement / h**2
        return Limits(bounds.speed - bounds.displacement / h, bounds.acceleration - feedback)

    @property
    def tracking_error(self) -> float:
        """Bound [m] on the distance of the point from the plan, at all times, with `disturbance`."""
        return WORST_CASE_SHARE * self._bounds.displacement + self.disturbance

    def shape(self, radius: float, center: float = 0.0) -> Disc:
        """Robot of the navigator for a body within `radius` [m] of a point `center` [m] ahead of the axle.

        It grows by the distance between that point and the one decided for, and by `tracking_error`.
        """
        off = abs(self.lever - number(center, "center"))
        return Disc(positive(radius, "radius") + off + self.tracking_error)

    def point(self, pose: Pose) -> tuple[Array, Array]:
        """Position (2,) [m] and velocity (2,) [m/s] of the point ahead of the axle."""
        has(pose, ("position", "heading", "speed", "turn"), "a Pose", "pose")
        e = pose.direction
        return pose.position + self.lever * e, pose.speed * e + self.lever * pose.turn * np.array([-e[1], e[0]])

    def state(self, pose: Pose, decision: Decision | None = None, now: float = 0.0) -> State:
        """State from which to decide at `now` [s]: of the plan of `decision` if the drive is on it, else of the point.

        The drive is on the plan while the point is within `tracking_error` of it.
        """
        position, velocity = self.point(pose)
        displacement = self._bounds.displacement
        errors = 1.5 * displacement + self.disturbance, (displacement + self.disturbance) / self.period
        return state_of_point(position, velocity, decision, now, errors)

    def goal(self, pose: Pose, goal: Goal, now: float = 0.0) -> Goal:
        """Goal of the point that brings the middle of the axle to `goal`."""
        has(goal, ("trajectory", "tolerance", "stop"), "a Goal", "goal")
        return goal_of_point(pose, goal, self.lever, now, reverses=True)

    def command(self, pose: Pose, decision: Decision, now: float) -> Command:
        """Command for the period from `now` [s]: (speed [m/s], turn rate [rad/s]) at its end.

        It follows the manoeuvre of `decision`. It obeys the limits of the wheels from every pose that obeys them; if
        the plan needs more, it goes as far towards it as they permit.
        """
        position, velocity = self.point(pose)
        plan, h = decision.manoeuvre, self.period
        off, drift = position - plan.position(now), velocity - plan.velocity(now)
        target = velocity + h * plan.mean_acceleration(now, h) - off / h - 1.5 * drift
        return self._within_limits(pose, self._reaching(pose, float(target[0]), float(target[1])))

    def _reaching(self, pose: Pose, x: float, y: float) -> Command:
        """Command after which the velocity of the point is (x, y) [m/s]."""
        half, lever, turn = 0.5 * self.period, self.lever, pose.turn
        for _ in range(TURN_STEPS):
            angle = pose.heading + half * (pose.turn + turn)
            c, s = cos(angle), sin(angle)
            change = (lever * turn - (y * c - x * s)) / max(lever + half * (x * c + y * s), 0.5 * lever)
            turn -= change
            if abs(change) <= 1e-15 * (1.0 + abs(turn)):
                break
        angle = pose.heading + half * (pose.turn + turn)
        return Command(x * cos(angle) + y * sin(angle), turn)

    def _within_limits(self, pose: Pose, wanted: Command) -> Command:
        """The command nearest to the wanted one on the way from the present wheel speeds that the limits permit."""
        half, h = 0.5 * self.track, self.period
        now = (pose.speed - half * pose.turn, pose.speed + half * pose.turn)
        then = (wanted.speed - half * wanted.turn, wanted.speed + half * wanted.turn)
        share, most, fastest = 1.0, self.max_wheel_acceleration * h, self.max_wheel_speed
        for begin, end in zip(now, then, strict=True):
            change = end - begin
            if abs(change) > most:
                share = min(share, most / abs(change))
            if abs(end) > fastest and abs(begin) <= fastest:
                share = min(share, (fastest - abs(begin)) / (abs(end) - abs(begin)))
        left, right = (min(max(b + share * (e - b), -fastest), fastest) for b, e in zip(now, then, strict=True))
        return Command(0.5 * (left + right), (right - left) / self.track)

    def drive(self, pose: Pose, command: Command, duration: float | None = None) -> Pose:
        """Pose after `duration` [s], by default the period, on the way to a command: exact to rounding.

        Positions are exact for turns of at most 2 rad.
        """
        h = self.period if duration is None else not_negative(duration, "duration")
        nodes, weights = _GAUSS_RULE
        times = 0.5 * h * (1.0 + nodes)
        rate, spin = (command.speed - pose.speed) / self.period, (command.turn - pose.turn) / self.period
        angles = pose.heading + times * (pose.turn + 0.5 * spin * times)
        path = 0.5 * h * (weights * (pose.speed + rate * times)) @ np.stack([np.cos(angles), np.sin(angles)], axis=1)
        heading = pose.heading + h * (pose.turn + 0.5 * spin * h)
        return Pose(pose.position + path, heading, pose.speed + rate * h, pose.turn + spin * h)
