"""Common parts of vehicles: decisions for a point ahead of the axle, and commands that follow its plan."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import cos, hypot, sin, sqrt
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.base.checks import (
    DECISION,
    GOAL,
    Array,
    Checked,
    Number,
    check_fields,
    has,
    not_negative,
    number,
    positive,
    vector,
)
from slalom.decision import Decision
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path import Path, hermite
from slalom.model.path_goal import PathGoal
from slalom.model.response.protocol import Unsteered
from slalom.model.shape import Disc
from slalom.model.state import Affine, State
from slalom.obstacle.periodic import moved

# ---------------------------------------------------------------------------------------------------------------------
# Integration of the motion of a vehicle in one period, and its path as cubic pieces.


QUADRATURE_STAGES: Final = 5
"""[1] Nodes of Gauss quadrature for the motion in a period; its error is of the order 10, far below a micrometre.

More: slower plans of vehicles. Fewer: the motion is less exact than the pieces that stand for it.
"""


def _collocation() -> tuple[tuple[float, ...], tuple[float, ...], tuple[tuple[float, ...], ...]]:
    """Nodes, weights and weights of the integrals up to each node of Gauss quadrature on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(QUADRATURE_STAGES)
    nodes, weights = 0.5 * (1.0 + nodes), 0.5 * weights
    powers = np.arange(QUADRATURE_STAGES)
    up_to = (nodes[:, None] ** (powers + 1) / (powers + 1)) @ np.linalg.inv(nodes[:, None] ** powers)
    return tuple(nodes.tolist()), tuple(weights.tolist()), tuple(tuple(row) for row in up_to.tolist())


_NODES, _WEIGHTS, _UP_TO = _collocation()


class Motion(NamedTuple):
    """State of a vehicle as numbers: `Pose`."""

    x: float
    y: float
    heading: float
    speed: float
    turn: float


class Turning(NamedTuple):
    """Bounds (m,) for m periods on the absolute turn rate w of the heading [rad/s] and its first three derivatives."""

    w: Array
    w1: Array
    w2: Array
    w3: Array


def driven(
    start: Motion, speed: float, turn: float, duration: float, turn_rate: Callable[[float, float], float]
) -> Motion:
    """Motion after `duration` [s] in which speed [m/s] and turn change at constant rates to the given values.

    turn_rate: of the heading [rad/s], from speed and turn.
    """
    speeds = [start.speed + node * (speed - start.speed) for node in _NODES]
    rates = [turn_rate(v, start.turn + node * (turn - start.turn)) for v, node in zip(speeds, _NODES)]
    x, y = start.x, start.y
    for weight, row, v in zip(_WEIGHTS, _UP_TO, speeds):
        angle = start.heading + duration * sum(share * rate for share, rate in zip(row, rates))
        x += duration * weight * v * cos(angle)
        y += duration * weight * v * sin(angle)
    heading = start.heading + duration * sum(weight * rate for weight, rate in zip(_WEIGHTS, rates))
    return Motion(x, y, heading, speed, turn)


class BodyMotion(Unsteered):
    """Response whose motion is that of a point of a vehicle, whatever the control: gain 0.

    With it a `ControlObstacle` judges the motion of a vehicle as that of a robot.

    Args:
        times: (m + 1,) [s] from now. path: (m + 1, 2) [m] of the point, velocities: (m + 1, 2) [m/s].
        error: [m] of the cubic pieces between the times.
    """

    def __init__(self, times: Array, path: Array, velocities: Array, error: float) -> None:
        self.times, self.interpolation_error = times, error
        self._pieces: Path = hermite(times, path, velocities)

    def _affine(self, t: npt.ArrayLike, derivative: int) -> Affine:
        time = np.asarray(t, dtype=np.float64)
        return Affine(self._at(time, derivative), np.zeros_like(time))

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        return self._affine(t, 0)

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        return self._affine(t, 1)

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        return self._affine(t, 2)

    def _at(self, t: Array, derivative: int) -> Array:
        """Values (..., 2) of a derivative of the cubic pieces."""
        times = self.times
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        h = np.diff(times)[k]
        s = ((t - times[k]) / h)[..., None]
        p = np.moveaxis(self._pieces.points[k], -2, 0)
        if derivative == 0:
            r = 1.0 - s
            return np.asarray(r**3 * p[0] + 3.0 * r * r * s * p[1] + 3.0 * r * s * s * p[2] + s**3 * p[3])
        d = [3.0 * (b - a) / h[..., None] for a, b in pairwise(p)]
        if derivative == 1:
            return np.asarray((1.0 - s) ** 2 * d[0] + 2.0 * s * (1.0 - s) * d[1] + s * s * d[2])
        return np.asarray(2.0 * ((1.0 - s) * (d[1] - d[0]) + s * (d[2] - d[1])) / h[..., None])

    @property
    def start(self) -> State:
        """Position and velocity at time 0."""
        return State(self._at(np.zeros(()), 0), self._at(np.zeros(()), 1))

    def knots(self, horizon: float, speed_bound: float) -> Array:
        inner = self.times[(self.times > 0.0) & (self.times < horizon - 1e-9)]
        return np.concatenate([[0.0], inner, [horizon]])


def hermite_error(speeds: Array, turning: Turning, offset: float, step: float) -> float:
    """Largest error [m] of cubic pieces of `step` [s] for a point `offset` [m] ahead of the axle.

    `speeds` (m + 1,) [m/s] at the ends of the periods. With the unit vector e along the heading, the fourth derivative
    of the position is 3 v' e'' + v e''' plus `offset` times that of e.
    """
    fastest, rate = np.maximum(np.abs(speeds[:-1]), np.abs(speeds[1:])), np.abs(np.diff(speeds)) / step
    w, w1, w2, w3 = turning
    second, third = np.hypot(w1, w * w), np.hypot(w2 + w**3, 3.0 * w * w1)
    fourth = np.hypot(w3 + 6.0 * w * w * w1, 4.0 * w * w2 + 3.0 * w1 * w1 + w**4)
    largest = (3.0 * rate * second + fastest * third + abs(offset) * fourth).max(initial=0.0)
    return float(largest * step**4 / 384.0)


# ---------------------------------------------------------------------------------------------------------------------
# State and command of a vehicle in the plane, and the goal of the point that it decides for.


GOAL_HEADING_BLEND: Final = 0.25
"""[1] Distance from its goal, in tolerances of the goal, at which a vehicle keeps its heading rather than turns to it.

Larger: an axle beside its goal is left there. Smaller: the vehicle turns on the spot for errors that do not matter.
"""

POINT_TOLERANCE: Final = 0.5
"""[1] Tolerance of the goal of the point ahead of the axle, in tolerances of the goal of the axle.

The rest is left for the heading at the goal. Larger: the axle may stop short of its tolerance. Smaller: slower
arrivals.
"""


POSE: Final = (("position", "heading", "speed", "turn"), "a Pose")
"""For checks, see `checks.STATE`."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Position, heading, speed and turn of a vehicle.

    `position` (2,) [m] of the middle of its axle (of a bicycle, the rear one), `heading` [rad], `speed` [m/s] along the
    heading, negative in reverse. `turn` is the turn rate [rad/s] of a differential drive, or the steering angle [rad]
    of a bicycle.
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


class Command(NamedTuple):
    """The speed and turn rate, or steering angle, to reach at the end of a period at constant rates.

    `speed` [m/s], and as `turn` a turn rate [rad/s] (differential drive) or a steering angle [rad] (bicycle).
    """

    speed: float
    turn: float


def goal_of_point(pose: Pose, goal: Goal, ahead: float, now: float, reverses: bool) -> Goal:
    """Goal of a point `ahead` [m] of the axle that brings the axle to `goal`.

    The point goes as far beyond the goal as it is ahead of the axle, seen from the axle. Within a distance of two times
    `ahead` a vehicle that `reverses` may also come from the other side. Close to the goal its heading is kept.
    """
    has(pose, *POSE, "pose")
    has(goal, *GOAL, "goal")
    if isinstance(goal, PathGoal):
        last = goal.points[-1] - goal.points[-2]
        points = np.concatenate([goal.points[:-1], goal.points[-1:] + ahead * last / hypot(*last)])
        return PathGoal(points, goal.speeds, POINT_TOLERANCE * goal.tolerance, goal.stop, lookahead=goal.lookahead)
    direction, displacement = pose.direction, goal.position(now) - pose.position
    if reverses and hypot(*displacement) < 2.0 * ahead and displacement @ direction < 0.0:
        displacement = -displacement
    beyond = displacement + (GOAL_HEADING_BLEND * goal.tolerance) * direction
    length = hypot(*beyond)
    offset = ahead * (beyond / length if length > 0.0 else direction)
    return Goal(moved(goal.trajectory, offset), POINT_TOLERANCE * goal.tolerance, goal.stop)


# ---------------------------------------------------------------------------------------------------------------------
# Common parts of vehicles: decisions for a point ahead of the axle, and commands that follow its plan.


CREEPING: Final = 1e-3
"""[m/s] A bicycle that is to be slower than this keeps its steering angle.

Larger: it leaves the place where it stops with the wrong course. Much smaller: rounding of the velocity steers.
"""


@dataclass(frozen=True)
class Vehicle(ABC):
    """A vehicle that reaches a commanded speed and turn at the end of each `period` [s], at constant rates.

    Let v, f be the velocity of the point at the start of a period and at the end. p(t) and q(t) are position and
    velocity of the plan, e and d the errors of position and velocity at the start. The command is the one with
    f = q(t + h) - e / h - d / 2, which is deadbeat: without limits an error is gone after two periods.
    """

    @property
    @abstractmethod
    def period(self) -> float:
        """[s] between commands."""

    @property
    @abstractmethod
    def lever(self) -> float:
        """Distance [m] of the point ahead of the axle."""

    @property
    @abstractmethod
    def limits(self) -> Limits:
        """Limits of the point: within them wheels and steering always suffice."""

    @property
    @abstractmethod
    def free_limits(self) -> Limits:
        """Limits of the point for which wheels and steering suffice at some headings."""

    @property
    @abstractmethod
    def tracking_error(self) -> float:
        """Bound [m] on the distance of the point from the plan."""

    @property
    @abstractmethod
    def reverses(self) -> bool:
        """Whether plans of the point drive the vehicle backwards, and it may arrive so."""

    @property
    @abstractmethod
    def feedback(self) -> float:
        """Largest acceleration [m/s^2] that corrects errors."""

    @property
    @abstractmethod
    def errors(self) -> tuple[float, float]:
        """Largest distance [m] and speed [m/s] relative to the plan with which the vehicle is on it."""

    @abstractmethod
    def turn_rate(self, speed: float, turn: float) -> float:
        """Rate [rad/s] of the heading."""

    @abstractmethod
    def turning(self, speeds: Array, turns: Array) -> Turning:
        """Bounds on the turn rate and its derivatives between successive speeds and turns (m + 1,)."""

    @abstractmethod
    def _reaching(self, motion: Motion, x: float, y: float) -> Command:
        """Command after which the velocity of the point is (x, y) [m/s], or as near to it as the vehicle can be."""

    @abstractmethod
    def within_limits(self, motion: Motion, wanted: Command) -> Command:
        """The command within the limits with the turn, and then the speed, nearest to those of the desired one."""

    def shape(self, radius: float, center: float = 0.0) -> Disc:
        """Robot of the navigator for a body within `radius` [m] of a point `center` [m] ahead of the axle.

        It is grown by the distance between that point and the one decided for, and by `tracking_error`.
        """
        off = abs(self.lever - number(center, "center"))
        return Disc(positive(radius, "radius") + off + self.tracking_error)

    def point(self, pose: Pose) -> tuple[Array, Array]:
        """Position (2,) [m] and velocity (2,) [m/s] of the point ahead of the axle."""
        has(pose, *POSE, "pose")
        e, sideways = pose.direction, self.lever * self.turn_rate(pose.speed, pose.turn)
        return pose.position + self.lever * e, pose.speed * e + sideways * np.array([-e[1], e[0]])

    def state(self, pose: Pose, decision: Decision | None = None, now: float = 0.0) -> State:
        """State from which to decide at `now` [s]: of the plan if the vehicle is on it, else of the point.

        While the vehicle is on its plan, the plan is the motion of a robot without any error.
        """
        position, velocity = self.point(pose)
        if decision is not None:
            has(decision, *DECISION, "decision")
            plan = decision.manoeuvre
            planned = State(plan.position(now), plan.velocity(now), plan.acceleration(now), self._course(pose))
            off, drift = position - planned.position, velocity - planned.velocity
            if hypot(*off) <= self.errors[0] and hypot(*drift) <= self.errors[1]:
                return planned
        return State(position, velocity, heading=self._course(pose))

    def _course(self, pose: Pose) -> float | None:
        """Direction [rad] in which the point starts to move; None if it may start in any."""
        return None

    def goal(self, pose: Pose, goal: Goal, now: float = 0.0) -> Goal:
        """Goal of the point that brings the middle of the axle to `goal`."""
        return goal_of_point(pose, goal, self.lever, now, self.reverses)

    def command(self, pose: Pose, decision: Decision, now: float) -> Command:
        """Command for the period from `now` [s], to be reached at its end: it follows the manoeuvre of `decision`.

        It obeys all limits of the vehicle from every pose that obeys them. If the plan needs more, the command goes as
        far towards it as they permit.
        """
        has(pose, *POSE, "pose")
        has(decision, *DECISION, "decision")
        plan = decision.manoeuvre
        times = number(now, "now") + self.period * np.arange(2)
        planned = np.concatenate([plan.position(times), plan.velocity(times)], axis=1).tolist()
        return self._following(motion_of(pose), planned[0], planned[1])

    def _following(self, motion: Motion, here: list[float], there: list[float]) -> Command:
        """Command that follows a plan whose positions and velocities at both ends of the period are given."""
        h = self.period
        lever = self.lever
        c = cos(motion.heading)
        s = sin(motion.heading)
        sideways = lever * self.turn_rate(motion.speed, motion.turn)
        x = (motion.x + lever * c - here[0]) / h + 0.5 * (motion.speed * c - sideways * s - here[2])
        y = (motion.y + lever * s - here[1]) / h + 0.5 * (motion.speed * s + sideways * c - here[3])
        share = min(1.0, self.feedback * h / max(hypot(x, y), 1e-300))
        return self.within_limits(motion, self._reaching(motion, there[2] - share * x, there[3] - share * y))

    def drive(self, pose: Pose, command: Command, duration: float | None = None) -> Pose:
        """Pose after `duration` [s], by default the period, on the way to a command: exact to rounding.

        Raises:
            InvalidInput: something else than a Pose and a Command, or a duration below 0.
        """
        has(pose, *POSE, "pose")
        has(command, ("speed", "turn"), "a Command", "command")
        h = self.period if duration is None else not_negative(duration, "duration")
        speed = pose.speed + h / self.period * (command.speed - pose.speed)
        turn = pose.turn + h / self.period * (command.turn - pose.turn)
        m = driven(motion_of(pose), speed, turn, h, self.turn_rate)
        return Pose((m.x, m.y), m.heading, m.speed, m.turn)

    def follow(self, pose: Pose, plan: Manoeuvre, now: float, periods: int) -> Array:
        """Motions (periods + 1, 5) at the ends of all periods of a vehicle that follows a plan from `now` [s] on.

        Columns: position [m], heading [rad], speed [m/s], turn. It is what `command` and `drive` do.
        """
        times = now + self.period * np.arange(periods + 1)
        planned = np.concatenate([plan.position(times), plan.velocity(times)], axis=1).tolist()
        motion, motions = motion_of(pose), [motion_of(pose)]
        for here, there in pairwise(planned):
            command = self._following(motion, here, there)
            motion = driven(motion, command.speed, command.turn, self.period, self.turn_rate)
            motions.append(motion)
        return np.array(motions)

    def body_motion(self, motions: Array, ahead: float) -> BodyMotion:
        """The motion of the body's point `ahead` [m] of the axle, from `motions` as of `follow`."""
        e = np.stack([np.cos(motions[:, 2]), np.sin(motions[:, 2])], axis=1)
        rates = np.array([self.turn_rate(speed, turn) for speed, turn in motions[:, 3:].tolist()])
        path: Array = motions[:, :2] + ahead * e
        velocities: Array = motions[:, 3:4] * e + (ahead * rates)[:, None] * np.stack([-e[:, 1], e[:, 0]], axis=1)
        error = hermite_error(motions[:, 3], self.turning(motions[:, 3], motions[:, 4]), ahead, self.period)
        return BodyMotion(self.period * np.arange(len(motions), dtype=np.float64), path, velocities, error)

    def standing_after(self, pose: Pose, distance: float, turn: float, periods: int) -> Array:
        """Motions (periods + 1, 5), as of `follow`, that drive at most a `distance` [m] with `turn`, and then stand.

        A distance below 0 is driven backwards. All limits are obeyed. The last period is at rest, if braking permits.
        """
        side = 1.0 if distance > 0.0 else -1.0
        left = abs(distance)
        h = self.period
        a = self.feedback
        motion, motions = motion_of(pose), [motion_of(pose)]
        for k in range(periods):
            before = side * motion.speed
            # To change the speed takes this period, and to brake from then on whole periods.
            room = max(left - 0.5 * h * max(before, 0.0), 0.0)
            speed = a * min(sqrt(h * h + 2.0 * room / a) - h, (periods - 2 - k) * h)
            command = self.within_limits(motion, Command(side * speed if speed > CREEPING else 0.0, turn))
            motion = driven(motion, command.speed, command.turn, h, self.turn_rate)
            left -= max(0.5 * h * (before + side * motion.speed), 0.0)
            motions.append(motion)
        return np.array(motions)

    @property
    def leaves_backwards(self) -> bool:
        """Whether there are `ways_out`: not for a vehicle whose plans leave every place, or that never reverses."""
        return False

    def ways_out(self, pose: Pose, periods: int) -> list[Array]:
        """Motions as of `follow` that leave a place backwards, in the order in which they are tried."""
        return []


def motion_of(pose: Pose) -> Motion:
    """The numbers of a pose."""
    x, y = pose.position.tolist()
    return Motion(x, y, pose.heading, pose.speed, pose.turn)
