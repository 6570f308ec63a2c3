"""What the robot wants: a preferred control for each response, and how good a manoeuvre is."""

from dataclasses import dataclass
from math import sqrt
from typing import ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np

from slalom.affine import Affine
from slalom.checks import Array, Checked, not_negative, positive, vector
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import Admissible, Limits
from slalom.response import Response
from slalom.state import State
from slalom.trajectory import Stationary, Trajectory


class Aim(NamedTuple):
    """One quadratic wish: weight * |map(u) - target|^2 should be small."""

    map: Affine
    target: Array
    weight: float = 1.0


def preferred_control(aims: tuple[Aim, ...]) -> Array:
    """The control (d,) that minimises the sum of the aims.

    Because every gain is a scalar, the sum is (sum w g^2) |u - preferred|^2 + constant: the optimum under any
    constraint is the point nearest to `preferred`, which is what `select` finds.
    """
    total, pull = 0.0, np.zeros(1)
    for aim in aims:
        gain = float(aim.map.gain)
        total += aim.weight * gain**2
        pull = pull + aim.weight * gain * (aim.target - aim.map.drift)
    if not total > 0.0:
        raise InvalidInput("aims: expected one with weight and gain above 0, found none")
    return np.asarray(pull / total)


@dataclass(frozen=True, eq=False)
class Situation:
    """What an objective may look at: one response in one state."""

    response: Response
    state: State
    goal: Goal
    limits: Limits
    admissible: Admissible
    now: float
    horizon: float


@runtime_checkable
class Objective(Protocol):
    """Quadratic wishes for one decision; and how much clearance beyond the margin is wished for."""

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        """At least one aim of positive weight and gain."""

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        """How long [s] the wish takes for a robot that follows `motion` until the time `until` and is free then."""

    @property
    def enough_clearance(self) -> float:
        """[m] Clearance beyond the margin up to which more is better than being nearer to the aims; usually 0."""


@dataclass(frozen=True)
class Arrive:
    """Be at the goal as soon as possible.

    To pass through the goal: be there at the earliest time that an admissible control allows. Where none
    does, and to stop at the goal: have the velocity that leads there and can be braked (`Goal.desired_velocity`).
    """

    enough_clearance: float = 0.0

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        s = situation
        if s.goal.stop:
            return (self._velocity_aim(s),)
        away = s.goal.position(s.now) - s.state.position
        slowest = 4.0 * sqrt(away.dot(away)) / s.limits.max_speed + 4.0 * s.limits.max_speed / s.limits.max_acceleration
        times = _growing(max(slowest, 0.04))
        for _ in range(2):
            maps = s.response.position(s.state, times)
            controls = maps.inverse(s.goal.position(s.now + times))
            reached = s.admissible.holds(controls)
            k = int(reached.argmax())
            if not reached[k]:
                return (self._velocity_aim(s),)
            # Between the last time that is too early and this one lies the earliest: look again, closer.
            found, times = times[k], _between(times[max(k - 1, 0)], times[k])
        place = s.response.position(s.state, found)
        return (Aim(place, s.goal.position(s.now + found)),)

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        s = situation
        if self._may_arrive(s, until):
            ahead = np.linspace(s.now, until, 9)
            reached = s.goal.reached_at(motion.position(ahead), motion.velocity(ahead), ahead)
            if np.any(reached):
                return float(ahead[int(np.argmax(reached))] - s.now)
        after = s.goal.time_to_go(motion.position(until), motion.velocity(until), until, s.limits)
        return float(until - s.now + after)

    def _may_arrive(self, s: Situation, until: float) -> bool:
        """Whether a robot that obeys its limits could be at the goal before `until`; a goal that moves may come."""
        if not isinstance(s.goal.trajectory, Stationary):
            return True
        away = s.goal.position(s.now) - s.state.position
        fastest = s.limits.max_speed + float(np.abs(s.state.velocity).sum())
        return sqrt(away.dot(away)) <= s.goal.tolerance + fastest * (until - s.now)

    def _velocity_aim(self, s: Situation) -> Aim:
        """Have the desired velocity of the place where the robot will be, once the control has had its effect."""
        after = s.response.settled(s.horizon)
        place = s.state.position + after * s.state.velocity
        wanted = s.goal.desired_velocity(place, s.state.velocity, s.now + after, s.limits)
        return Aim(s.response.velocity(s.state, after), wanted)


_EARLIEST, _STEPS, _CLOSER = 0.02, np.arange(64.0), np.arange(17.0)


def _growing(last: float) -> Array:
    """64 times from 0.02 s to `last`, each by the same factor later than the one before: np.geomspace."""
    first, end = np.log10(_EARLIEST), np.log10(last)
    powers = _STEPS * ((end - first) / 63.0) + first
    powers[-1] = end
    times: Array = np.power(10.0, powers)
    times[0], times[-1] = _EARLIEST, last
    return times


def _between(first: float, last: float) -> Array:
    """17 times at even steps: np.linspace."""
    times = _CLOSER * ((last - first) / 16.0) + first
    times[-1] = last
    return times


@dataclass(frozen=True)
class KeepAcceleration:
    """Change the acceleration least: comfort, and few adjustments."""

    enough_clearance: float = 0.0

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        s = situation
        return (Aim(s.response.acceleration(s.state, 0.0), s.state.acceleration),)

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        s = situation
        change = motion.acceleration(s.now) - s.state.acceleration
        return float(np.linalg.norm(change)) / s.limits.max_acceleration


@dataclass(frozen=True, eq=False)
class FollowVelocity:
    """Have the given velocity (d,) [m/s] once the control has been carried out."""

    SOON: ClassVar[float] = 1e-3
    """[s] For controls that take effect at once."""

    velocity: Checked = Checked(vector)
    enough_clearance: float = 0.0

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        s = situation
        wanted = vector(self.velocity, "velocity to follow", s.state.dimension)
        return (Aim(s.response.velocity(s.state, max(s.response.settled(s.horizon), self.SOON)), wanted),)

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        s = situation
        missing = float(np.linalg.norm(motion.velocity(until) - self.velocity))
        return float(until - s.now) + missing / s.limits.max_acceleration


@dataclass(frozen=True)
class MostClearance:
    """Keep as far from everything as possible, up to `enough` [m] beyond the margin; then as `then` wishes."""

    enough: float
    then: Objective

    def __post_init__(self) -> None:
        object.__setattr__(self, "enough", positive(self.enough, "enough"))

    @property
    def enough_clearance(self) -> float:
        return self.enough

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        return self.then.aims(situation)

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        return self.then.cost(motion, situation, until)


@dataclass(frozen=True)
class Mix:
    """A weighted sum of objectives: ((weight, objective), ...), weights of 0 or more."""

    parts: tuple[tuple[float, Objective], ...]

    def __post_init__(self) -> None:
        if not self.parts:
            raise InvalidInput("parts: expected at least one objective, found none")
        positive(sum(not_negative(weight, "weight") for weight, _ in self.parts), "sum of weights")

    @property
    def enough_clearance(self) -> float:
        return max(part.enough_clearance for _, part in self.parts)

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        # Each part is normalised to the same curvature in u, so that weights compare accelerations, not seconds.
        mixed = []
        for weight, part in self.parts:
            aims = part.aims(situation)
            curvature = sum(aim.weight * float(aim.map.gain) ** 2 for aim in aims)
            mixed += [aim._replace(weight=aim.weight * weight / curvature) for aim in aims]
        return tuple(mixed)

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        weights = sum(weight for weight, _ in self.parts)
        return sum(weight * part.cost(motion, situation, until) for weight, part in self.parts) / weights
