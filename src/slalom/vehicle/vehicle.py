"""Common parts of vehicles: decisions for a point ahead of the axle, and commands that follow its plan."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import pairwise
from math import cos, hypot, sin, sqrt

import numpy as np

from slalom.checks import DECISION, Array, has, not_negative, number, positive
from slalom.decision import Decision
from slalom.goal import Goal
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre
from slalom.shape import Disc
from slalom.state import State
from slalom.tolerances import CREEPING
from slalom.vehicle.motion import BodyMotion, Motion, Turning, driven, hermite_error
from slalom.vehicle.pose import POSE, Command, Pose, goal_of_point


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
        h, lever, c, s = self.period, self.lever, cos(motion.heading), sin(motion.heading)
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
        side, left, h, a = (1.0 if distance > 0.0 else -1.0), abs(distance), self.period, self.feedback
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
