"""Common parts of vehicles on wheels: pose, command, the point that decides, and driving within all limits."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import atan, cos, hypot, pi, sin, sqrt, tan
from typing import Annotated, Final, NamedTuple

import numpy as np

from slalom import kernels
from slalom.base.checks import (
    GOAL,
    Array,
    Checked,
    NotNegative,
    Number,
    Positive,
    check_fields,
    has,
    not_negative,
    positive,
    vector,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import DIVISOR_FLOOR
from slalom.kernels.vehicle.wheels import Wheels
from slalom.model.bounds import HeadingCone, TurningRadius
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.path_goal import PathGoal
from slalom.model.state import State
from slalom.obstacle.displaced import moved

GOAL_HEADING_BLEND: Final = 0.25
"""[1] Distance from its goal, in tolerances of the goal, at which a vehicle keeps its heading rather than turns to it.
Larger: an axle beside its goal is left there. Smaller: the vehicle turns on the spot for errors that do not matter."""

POINT_TOLERANCE: Final = 0.5
"""[1] Tolerance of the goal of the point ahead of the axle, in tolerances of the goal of the axle. The rest is left for
the heading at the goal. Larger: the axle may stop short of its tolerance. Smaller: slower arrivals."""

ARC_STEP: Final = pi / 16.0
"""[rad] Parts of arcs at corners of a path. They differ by a two-hundredth of the radius. Larger: the vehicle passes
beside its path. Smaller: more points."""

STEERED_AHEAD: Final = 0.6
"""[1] The point of a steered vehicle is this far ahead on the course of its path, in distances of it from the axle. 0:
the axle is inside of turns. 1: it is on them while the steering keeps up, and else outside."""

CUSP: Final = 5.0 * pi / 6.0
"""[rad] A turn from which on a path turns back at a point. Larger: bicycles drive loops there. Smaller: they stop."""

POSE: Final = (("position", "heading", "speed", "turn"), "a Pose")
"""For checks, see `checks.STATE`."""

COMMAND: Final = (("speed", "turn"), "a Command")
"""For checks, see `checks.STATE`."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Position, heading, speed and turn of a vehicle.

    `position` (2,) [m] of the middle of its axle (of a bicycle, the rear one), `heading` [rad], `speed` [m/s] along the
    heading, negative in reverse. `turn` is the turn rate [rad/s] of a differential drive, or the steering angle [rad]
    of a bicycle. Measured values are meant, also of speed and turn.
    """

    position: Checked = Checked(vector)
    heading: Number  # type: ignore[misc]  # the field before it has no default: Checked is a descriptor
    speed: Number = 0.0
    turn: Number = 0.0

    def __post_init__(self) -> None:
        vector(self.position, "position", 2)
        check_fields(self)

    @property
    def direction(self) -> Array:
        """Unit vector (2,) along the heading."""
        return np.array([cos(self.heading), sin(self.heading)])

    @property
    def velocity(self) -> Array:
        """Velocity (2,) [m/s] of the middle of the axle in the world frame."""
        return self.speed * self.direction

    @property
    def motion(self) -> Array:
        """The numbers of the pose as a row (5,) of motions: x, y [m], heading [rad], speed [m/s], turn."""
        return np.array([*self.position, self.heading, self.speed, self.turn])


def pose_of(motion: Array) -> Pose:
    """The pose of a row (5,) of motions."""
    x, y, heading, speed, turn = motion.tolist()
    return Pose((x, y), heading, speed, turn)


class Command(NamedTuple):
    """The speed and turn rate, or steering angle, to command for a period.

    `speed` [m/s], and as `turn` a turn rate [rad/s] (differential drive) or a steering angle [rad] (bicycle). Without
    `Vehicle.lag` both are reached at the end of the period, at constant rates.
    """

    speed: float
    turn: float


def goal_of_point(pose: Pose, goal: Goal, ahead: float, now: float, reverses: bool) -> Goal:
    """Goal of a point `ahead` [m] of the axle that brings the axle to `goal`.

    The point goes as far beyond the goal as it is ahead of the axle, seen from the axle. Within a distance of two times
    `ahead` a vehicle that `reverses` may also come from the other side. Close to the goal its heading is kept.
    """
    direction, displacement = pose.direction, goal.position(now) - pose.position
    if reverses and hypot(*displacement) < 2.0 * ahead and displacement @ direction < 0.0:
        displacement = -displacement
    beyond = displacement + (GOAL_HEADING_BLEND * goal.tolerance) * direction
    length = hypot(*beyond)
    offset = ahead * (beyond / length if length > 0.0 else direction)
    return Goal(moved(goal.trajectory, offset), POINT_TOLERANCE * goal.tolerance, goal.stop)


@lru_cache(maxsize=64)
def path_of_point(goal: PathGoal, ahead: float, radius: float, turns: bool) -> tuple[PathGoal, Array]:
    """The path of a point `ahead` [m] of an axle that drives a path, and the lengths (m,) [m] of that at its knots.

    At corners the axle drives arcs that cut them by half the cut of the path, or more with its least `radius` [m], up
    to the middle of the parts beside them. At a cusp it turns on the spot. turns: whether the vehicle can do that.
    """
    knots, legs = goal.knots, np.diff(goal.lengths)
    steps = np.diff(knots[:, :2], axis=0)
    course = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    change = np.diff(course)
    half = np.cos(0.5 * change)
    bend = np.maximum(0.5 * goal.cut_of(ahead) * half / np.maximum(1.0 - half, DIVISOR_FLOOR), radius)
    before = np.minimum(bend * np.abs(np.tan(0.5 * change)), 0.5 * np.minimum(legs[:-1], legs[1:]))
    before = np.where(np.abs(change) > CUSP, 0.0, before)
    counts = np.concatenate([[1], np.ceil(np.abs(change) / ARC_STEP).astype(np.int64) + 1, [1]])
    of, first = np.repeat(np.arange(len(knots)), counts), np.cumsum(counts) - counts
    share = (np.arange(len(of)) - first[of]) / np.maximum(counts[of] - 1, 1)
    before, change = (np.concatenate([[0.0], each, [0.0]])[of] for each in (before, change))
    begin, turned = course[np.maximum(of - 1, 0)], share * change
    # From the begin of an arc with the radius r, r sin and r (1 - cos) of the angle ahead and aside.
    bend = before / np.where(change == 0.0, 1.0, np.tan(0.5 * change))
    along, aside = bend * np.sin(turned) - before, bend * (1.0 - np.cos(turned))
    off = np.where((of == len(knots) - 1) | turns, ahead, STEERED_AHEAD * ahead)
    along, aside = along + off * np.cos(turned), aside + off * np.sin(turned)
    points = knots[of]
    points[:, 0] += along * np.cos(begin) - aside * np.sin(begin)
    points[:, 1] += along * np.sin(begin) + aside * np.cos(begin)
    speeds = None if goal.squares is None else np.sqrt(goal.squares[of])
    tolerance = POINT_TOLERANCE * goal.tolerance
    of_point = PathGoal(points, speeds, tolerance, goal.stop, lookahead=goal.lookahead, cut=goal.cut)
    return of_point, (goal.lengths[of] + before * (2.0 * share - 1.0))[of_point.kept]


def checked_lags(lag: float | tuple[float, float], name: str) -> tuple[float, float]:
    """The lags [s] of speed and turn; one number is both. Raises InvalidInput for something else."""
    if not isinstance(lag, tuple | list):
        return not_negative(lag, name), not_negative(lag, name)
    if len(lag) != 2:
        raise InvalidInput(f"{name}: expected one lag, or those of speed and turn, found {len(lag)}")
    return not_negative(lag[0], name), not_negative(lag[1], name)


def refuse_least(name: str, least: float, most: float) -> None:
    """Raise InvalidInput for a least speed or turn rate above the largest one."""
    if least > most:
        raise InvalidInput(f"{name}: expected at most the largest one, {most:g}, found {least:g}")


@dataclass(frozen=True, kw_only=True)
class Vehicle(ABC):
    """A vehicle that reaches a commanded speed and turn: at the end of each `period` at constant rates, or with a lag.

    Attributes:
        ahead: [m] distance of the point that decides from the axle; None: of the kind of vehicle.
        period: [s] between commands.
        lag: [s] with which speed and turn approach their commands, as first-order systems; one number, or one for the
            speed and one for the turn. 0: they reach them at the end of the period.
        delay: [s] from a decision until its command acts.
        min_speed: [m/s] the least speed that the vehicle executes: a smaller one is as 0. No such command is made.

    Raises:
        InvalidInput: a value of a wrong kind or out of its range.
    """

    ahead: Annotated[float | None, positive] = None
    period: Positive = 0.1
    lag: Annotated[float | tuple[float, float], checked_lags] = 0.0
    delay: NotNegative = 0.0
    min_speed: NotNegative = 0.0

    @property
    @abstractmethod
    def wheels(self) -> Wheels:
        """The numbers of the vehicle, for kernels."""

    @property
    @abstractmethod
    def lever(self) -> float:
        """Distance [m] of the point that decides ahead of the axle."""

    @property
    def turns_on_spot(self) -> bool:
        """Whether the vehicle turns without driving."""
        return not self.wheels.steered

    @property
    def backs(self) -> bool:
        """Whether the vehicle drives backwards at all."""
        return self.wheels.max_reverse > 0.0

    @property
    @abstractmethod
    def least_radius(self) -> float:
        """Least radius [m] of circles of the middle of the axle."""

    @property
    @abstractmethod
    def turning_radius(self) -> float:
        """Least radius [m] of the paths of the point on which the vehicle keeps a useful speed."""

    @property
    @abstractmethod
    def limits(self) -> Limits:
        """Limits of the point, for which wheels and steering suffice at some headings."""

    @property
    @abstractmethod
    def holds(self) -> list[tuple[float, float]]:
        """Speeds [m/s] and turns that the vehicle may hold where no plan of the point is clear."""

    @property
    def lags(self) -> tuple[float, float]:
        """The lags [s] of speed and turn."""
        return checked_lags(self.lag, "lag")

    def turn_rate(self, speed: float, turn: float) -> float:
        """Rate [rad/s] of the heading at a speed [m/s] and a turn."""
        return float(kernels.turn_rate(self.wheels, speed, turn))

    def point(self, pose: Pose) -> tuple[Array, Array]:
        """Position (2,) [m] and velocity (2,) [m/s] of the point ahead of the axle."""
        has(pose, *POSE, "pose")
        e, sideways = pose.direction, self.lever * self.turn_rate(pose.speed, pose.turn)
        return pose.position + self.lever * e, pose.speed * e + sideways * np.array([-e[1], e[0]])

    def state(self, pose: Pose) -> State:
        """State of the point at a pose."""
        position, velocity = self.point(pose)
        return State(position, velocity, heading=self.course(pose))

    def course(self, pose: Pose) -> float | None:
        """Direction [rad] in which the point starts to move; None if it may start in any."""
        return None

    def goal(self, pose: Pose, goal: Goal, now: float = 0.0) -> Goal:
        """Goal of the point that brings the middle of the axle to `goal`."""
        has(pose, *POSE, "pose")
        has(goal, *GOAL, "goal")
        if isinstance(goal, PathGoal):
            return path_of_point(goal, self.lever, self.least_radius, self.turns_on_spot)[0]
        return goal_of_point(pose, goal, self.lever, now, self.backs and self.turns_on_spot)

    def command(self, motion: Array, end: Array) -> Command:
        """Command after which speed and turn are those of the motion `end` (5,), a period after `motion` (5,)."""
        speed, turn = kernels.executable(self.wheels, motion, end[3], end[4])
        # Where a wheel changes its speed at the largest rate, the mean of both commands is not that of one actuator.
        return self._within(Command(float(speed), float(turn)))

    def _within(self, command: Command) -> Command:
        """The nearest command within the largest speeds and turns."""
        w = self.wheels
        return Command(
            min(max(command.speed, -w.max_reverse), w.max_axle), min(max(command.turn, -w.max_turn), w.max_turn)
        )

    def drive(self, pose: Pose, command: Command, duration: float | None = None) -> Pose:
        """Pose after `duration` [s], by default the period, under a command.

        It is exact to rounding; with a lag, where no rate is a limit within the period. The vehicle goes no farther
        towards the command than its limits permit. Its `delay` is not simulated.

        Raises:
            InvalidInput: something else than a Pose and a Command, or a duration below 0 or above the period.
        """
        has(pose, *POSE, "pose")
        has(command, *COMMAND, "command")
        share = 1.0 if duration is None else not_negative(duration, "duration") / self.period
        if share > 1.0:
            raise InvalidInput(f"duration: expected at most the period, {self.period:g} s, found {duration:g} s")
        motion, (speed, turn) = pose.motion, self._within(Command(float(command.speed), float(command.turn)))
        speed, turn = kernels.actuated(self.wheels, motion, speed, turn, False)
        kernels.drive(self.wheels, motion, speed, turn, 0.0, share, motion)
        return pose_of(motion)


# Kinds of vehicles.


STEERING_CONE: Final = 1.2
"""[rad] Largest angle by which a decision for a bicycle turns its course. Larger: manoeuvres that the steering does not
follow are chosen. Smaller: slower avoidance."""

SPEED_STEP: Final = 0.98
"""[1] Ratio of successive speeds among which the largest permitted one of a vehicle is found. Closer to 1: a speed that
is up to 2 % larger."""

HELD_TURNS: Final = (0.0, 0.1, 0.25, 0.5, 1.0)
"""[1] Turns that a vehicle may hold where no plan is clear, as shares of its largest, to both sides. More: ways out of
narrower places, and longer decisions. Fewer: the vehicle waits more often."""

HELD_TURN_RATE: Final = 2.0
"""[rad/s] The largest turn rate of a differential drive that it holds. Larger: coarser steps of the smaller ones."""

GENTLE_TURNS: Final = (0.001, 0.006, 0.03)
"""[1] Further ones of a bicycle: its rear swings out towards a wall beside it, by less in a wider turn."""

HELD_SPEEDS: Final = (1.0, 0.7, 0.4, 0.2, 0.0)
"""[1] Speeds that a vehicle may hold where no plan is clear, as shares of its largest. As of HELD_TURNS."""

HELD_BACKWARDS: Final = (0.3, 1.0)
"""[1] Those of a differential drive backwards. As of HELD_TURNS."""


POINT_AHEAD: Final = 0.5
"""[1] Distance of the point that decides ahead of the axle of a differential drive, in tracks. Longer: plans keep
farther from the motion of the body. Shorter: errors of the measured pose turn the drive."""


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
        InvalidInput: a value that is not above 0; a steering angle of a right angle or more; a least speed above a
            largest one.
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
        refuse_least("min_speed", self.min_speed, min(self.max_speed, self.max_reverse_speed or np.inf))

    @cached_property
    def wheels(self) -> Wheels:
        return Wheels(
            True,
            self.period,
            self.lever,
            self.wheelbase,
            self.max_speed,
            self.max_reverse_speed,
            self.max_speed,
            self.max_acceleration,
            self.max_steering,
            self.max_steering_rate,
            *self.lags,
            self.min_speed,
            0.0,
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
        max_reverse_speed: [m/s] of the middle of the axle; 0: it never reverses; None: the largest speed.
        max_turn_rate, max_turn_acceleration: [rad/s], [rad/s^2]; None: by the wheels alone.
        min_turn_rate: [rad/s] the least one that is executed, as `min_speed`.
        See `Vehicle` for the others.

    Raises:
        InvalidInput: a value that is not above 0; different lags of speed and turn; a least speed or turn rate above
            the largest one.
    """

    track: Positive
    max_wheel_speed: Positive
    max_wheel_acceleration: Positive
    max_speed: Annotated[float | None, positive] = None
    max_acceleration: Annotated[float | None, positive] = None
    max_turn_rate: Annotated[float | None, positive] = None
    max_turn_acceleration: Annotated[float | None, positive] = None
    min_turn_rate: NotNegative = 0.0
    max_reverse_speed: Annotated[float | None, not_negative] = None

    def __post_init__(self) -> None:
        check_fields(self)
        refuse_least("min_speed", self.min_speed, min(self.limits.max_speed, self._reverse or np.inf))
        refuse_least("min_turn_rate", self.min_turn_rate, self._turn_rate)
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
            self._reverse,
            self.limits.max_speed,
            acceleration,
            self._turn_rate,
            min(2.0 * acceleration / self.track, self.max_turn_acceleration or np.inf),
            *self.lags,
            self.min_speed,
            self.min_turn_rate,
        )

    @property
    def turning_radius(self) -> float:
        return self.lever

    @property
    def _reverse(self) -> float:
        most = self.limits.max_speed
        return most if self.max_reverse_speed is None else min(self.max_reverse_speed, most)

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
        speeds = [share * self.limits.max_speed for share in HELD_SPEEDS]
        speeds += [-share * self._reverse for share in HELD_BACKWARDS if self.backs]
        turns = [turn * min(HELD_TURN_RATE, self._turn_rate) for turn in both_sides(HELD_TURNS)]
        return [(speed, turn) for speed in speeds for turn in turns]

    @property
    def limits(self) -> Limits:
        speed = self.max_wheel_speed if self.max_speed is None else min(self.max_speed, self.max_wheel_speed)
        most = self.max_wheel_acceleration
        return Limits(speed, most if self.max_acceleration is None else min(self.max_acceleration, most))
