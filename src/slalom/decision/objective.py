"""Objectives: the preferred control of each response, and the cost of a manoeuvre."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import Final, NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.base.checks import (
    OBJECTIVE,
    Array,
    Checked,
    CheckedFields,
    NotNegative,
    Positive,
    check_fields,
    has,
    listing,
    not_negative,
    pair,
    positive,
    short,
    vector,
)
from slalom.base.errors import InvalidInput
from slalom.base.registry import Kind, Registry
from slalom.base.tolerances import AIM_FIRST, AIM_LATEST, AIM_TIMES, REST
from slalom.forecast.linear import piecewise_polynomial
from slalom.model.goal import Goal
from slalom.model.limits import Admissible, Limits
from slalom.model.path import Path
from slalom.model.response import Response
from slalom.model.state import Affine, State, scaled
from slalom.model.trajectory import Stationary, Trajectory
from slalom.obstacle.window import ObstacleWindow

AIM_ROUNDS: Final = 12
"""[1] Rounds in which an objective in Python seeks the earliest aim, each between two times of the one before. Larger:
more time than the last digit needs. Smaller: the aim is later than it could be."""

FINE_SAMPLES: Final = 17
"""[1] Number of evenly spaced times from the last sample without an arrival to the first one with an arrival. They are
refined once more. Larger: slower aims. Smaller: the arrival is later by a larger share of the interval."""

IMMEDIATE: Final = 1e-3
"""[s] Least time at which `FollowVelocity` evaluates the velocity of a response. At 0 an acceleration has no effect on
the velocity yet. Larger: the velocity is reached later. Much smaller: rounding of the quotient enters the control."""


class Aim(NamedTuple):
    """Quadratic term of an objective: weight * |map(u) - target|^2."""

    map: Affine
    target: Array
    weight: float = 1.0


def preferred_control(aims: tuple[Aim, ...]) -> Array:
    """Control (d,) that minimises the sum of the aims.

    Because every gain is a scalar, the sum is (sum w g^2) |u - preferred|^2 + constant. The optimum under any
    constraint is therefore the point nearest to `preferred`, which `select` computes.

    Raises:
        InvalidInput: no aim with weight and gain above 0.
    """
    total, weighted = 0.0, np.zeros(1)
    for aim in aims:
        total += aim.weight * float(abs(aim.map.gain)) ** 2
        weighted = weighted + scaled(aim.weight * np.conj(aim.map.gain), aim.target - aim.map.drift)
    if not total > 0.0:
        raise InvalidInput("aims: expected one with weight and gain above 0, found none")
    return np.asarray(weighted / total)


NO_OBSTACLES: Final = ObstacleWindow((), 0.0, 1.0)
"""The obstacles of a situation in which none is known."""


@dataclass(frozen=True, eq=False)
class Situation:
    """Input of an objective: one response in one state, among obstacles as they are predicted."""

    response: Response
    state: State
    goal: Goal
    limits: Limits
    now: float
    horizon: float
    period: float  # [s] until the next decision
    shortest: float  # [s] the least time for which the robot holds a control
    obstacles: ObstacleWindow = NO_OBSTACLES  # `positions`, `velocities` and `radii` over time

    @cached_property
    def admissible(self) -> Admissible:
        """The controls that the limits allow."""
        return self.limits.admissible(self.response, self.state, self.horizon)

    @property
    def step(self) -> float:
        """Time [s] after which the control is judged: settled, or one period where the next one may replace it."""
        return self.period if self.response.restartable else self.response.settled(self.horizon)


@dataclass(frozen=True, eq=False)
class Candidates:
    """Motions that a robot may choose: of free controls, and the present one. Each keeps its velocity at its end.

    Attributes:
        times: (n, p + 1) [s] and points: (n, p, 4, d) [m] of their cubic pieces.
        until: (n,) [s] absolute, from when on each keeps its velocity: its control has been carried out.
        costs: (n,) [s] by the objective that the asked one extends, such as the time to the goal of `Arrive`.
    """

    times: Array
    points: Array
    until: Array
    costs: Array

    def positions(self, t: npt.ArrayLike) -> Array:
        """Positions (n, m, d) [m] at absolute times t (m,) [s]."""
        return self._states(np.asarray(t, dtype=np.float64))[0]

    def velocities(self, t: npt.ArrayLike) -> Array:
        """Velocities (n, m, d) [m/s] at absolute times t (m,) [s]."""
        return self._states(np.asarray(t, dtype=np.float64))[1]

    def _states(self, t: Array) -> tuple[Array, Array]:
        times, until = self.times, self.until[:, None]
        inside = np.minimum(t, until)
        begun = (times[:, None, :-1] <= inside[..., None]) & (times[:, None, 1:] > times[:, None, :-1])
        k = (begun * np.arange(times.shape[1] - 1)).max(axis=2)
        row = np.arange(len(times))[:, None]
        h = times[row, k + 1] - times[row, k]
        x = ((inside - times[row, k]) / h)[..., None]
        p, y = self.points[row, k], 1.0 - x
        a, b, c = (y * p[:, :, j] + x * p[:, :, j + 1] for j in range(3))
        a, b = y * a + x * b, y * b + x * c
        velocities = 3.0 * (b - a) / h[..., None]
        return y * a + x * b + (t - inside)[..., None] * velocities, velocities

    def motions(self, horizon: float) -> Iterator[Trajectory]:
        """Each as a trajectory up to `horizon` [s] after its end."""
        for times, points, until in zip(self.times, self.points, self.until.tolist()):
            begin = np.flatnonzero((np.diff(times) > 0.0) & (times[:-1] < until))
            knots = np.append(times[begin], times[begin[-1] + 1])
            path = Path(knots, points[begin], np.zeros(len(begin))).cut(np.append(knots[:-1], until))
            last, duration = path.points[-1], path.times[-1] - path.times[-2]
            way = (last[3] - last[2]) * (3.0 * horizon / duration)
            straight = last[3] + way * (np.arange(4.0)[:, None] / 3.0)
            yield piecewise_polynomial(
                np.append(path.times, until + horizon), np.concatenate([path.points, straight[None]])
            )


@runtime_checkable
class Objective(Protocol):
    """Quadratic aims for one decision, the cost of a manoeuvre, and the preferred clearance beyond the margin.

    One of your own extends a class below, such as `Arrive`, by a method `costs(candidates, situation)`. It returns the
    costs (n,) [s] of all `Candidates`; inf excludes one. It is asked once for all candidates of a decision, and `cost`
    no more. The response of the situation is the first one of the robot.
    """

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        """At least one aim with weight and gain above 0."""

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        """Cost [s] of a robot that follows `motion` until the absolute time `until` [s] and moves freely afterwards.

        The response of the `situation` is the first one of the robot, whatever response `motion` belongs to.
        """

    @property
    def enough_clearance(self) -> float:
        """Clearance [m] beyond the margin up to which more clearance outweighs the aims; usually 0."""


@dataclass(frozen=True)
class Arrive(CheckedFields):
    """Arrive at the goal as early as possible.

    To pass through the goal: reach it at the earliest time that an admissible control allows. If no control does, and
    to stop at the goal: reach the velocity `Goal.desired_velocity`.
    """

    enough_clearance: NotNegative = 0.0

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        s = situation
        if s.goal.stop:
            return (self._velocity_aim(s),)
        displacement = s.goal.position(s.now) - s.state.position
        latest = (
            AIM_LATEST * sqrt(displacement.dot(displacement)) / s.limits.max_speed
            + AIM_LATEST * s.limits.max_speed / s.limits.max_acceleration
        )
        times = _geometric_times(max(latest, 2.0 * AIM_FIRST))
        for _ in range(AIM_ROUNDS):
            maps = s.response.position(s.state, times)
            controls = maps.inverse(s.goal.position(s.now + times))
            reached = s.admissible.holds(controls)
            k = int(reached.argmax())
            if not reached[k]:
                return (self._velocity_aim(s),)
            # The earliest time lies between the last infeasible time and this one: repeat with smaller steps.
            earliest, times = times[k], _even_times(times[max(k - 1, 0)], times[k])
        position_map = s.response.position(s.state, earliest)
        return (Aim(position_map, s.goal.position(s.now + earliest)),)

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        s = situation
        if self._may_arrive(s, until):
            arrival = self._arrival(motion, s, until)
            if arrival is not None:
                return arrival
        position, velocity = motion.position(until), motion.velocity(until)
        return float(until - s.now + s.goal.time_to_go(position, velocity, until, s.limits, s.shortest))

    def _arrival(self, motion: Trajectory, s: Situation, until: float) -> float | None:
        """Time [s] at which a motion passes the goal; 0 if it rests there from now to `until` [s]; None if neither."""
        times = np.linspace(s.now, until, 2 if s.goal.stop else 9)
        away = s.goal.position(times) - motion.position(times)
        if s.goal.stop:
            moves = np.linalg.norm(s.goal.velocity(times) - motion.velocity(times), axis=-1) > REST
            return None if np.any(moves | (np.linalg.norm(away, axis=-1) > s.goal.tolerance)) else 0.0
        for first, last, before, after in zip(times, times[1:], away, away[1:]):
            step = after - before
            a = step @ step
            b = before @ step
            c = before @ before - s.goal.tolerance**2
            if c <= 0.0:
                return float(first - s.now)
            if b < 0.0 and b * b >= a * c and c <= sqrt(b * b - a * c) - b:
                return float(first - s.now + (last - first) * c / (sqrt(b * b - a * c) - b))
        return None

    def _may_arrive(self, s: Situation, until: float) -> bool:
        """Whether the robot can reach the goal before `until` [s] within its limits; True for a moving goal."""
        if not isinstance(s.goal.trajectory, Stationary):
            return True
        displacement = s.goal.position(s.now) - s.state.position
        speed = s.limits.max_speed + float(np.abs(s.state.velocity).sum())
        return sqrt(displacement.dot(displacement)) <= s.goal.tolerance + speed * (until - s.now)

    def _velocity_aim(self, s: Situation) -> Aim:
        """Aim at the desired velocity at the position extrapolated to the time at which the control has settled."""
        step = s.step
        ahead = 0.0 if s.goal.stop else step
        position = s.state.position + ahead * s.state.velocity
        desired = s.goal.desired_velocity(position, s.state.velocity, s.now + ahead, s.limits, step)
        return Aim(s.response.velocity(s.state, step), desired)


_COARSE, _FINE = np.arange(float(AIM_TIMES)), np.arange(float(FINE_SAMPLES))


def _geometric_times(last: float) -> Array:
    """AIM_TIMES times [s] from AIM_FIRST to `last` in geometric progression, as np.geomspace."""
    first, end = np.log10(AIM_FIRST), np.log10(last)
    powers = _COARSE * ((end - first) / (AIM_TIMES - 1.0)) + first
    powers[-1] = end
    times: Array = np.power(10.0, powers)
    times[0], times[-1] = AIM_FIRST, last
    return times


def _even_times(first: float, last: float) -> Array:
    """FINE_SAMPLES evenly spaced times [s], as np.linspace."""
    times = _FINE * ((last - first) / (FINE_SAMPLES - 1.0)) + first
    times[-1] = last
    return times


@dataclass(frozen=True)
class KeepAcceleration(CheckedFields):
    """Change the acceleration as little as possible: comfort, and few adjustments."""

    enough_clearance: NotNegative = 0.0

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        s = situation
        return (Aim(s.response.acceleration(s.state, 0.0), s.state.acceleration),)

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        s = situation
        change = motion.acceleration(s.now) - s.state.acceleration
        return float(np.linalg.norm(change)) / s.limits.max_acceleration


@dataclass(frozen=True, eq=False)
class FollowAcceleration(CheckedFields):
    """Begin with the given acceleration (d,) [m/s^2]: a filter for the command of another controller."""

    acceleration: Checked = Checked(vector)
    enough_clearance: NotNegative = 0.0

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        s = situation
        wanted = vector(self.acceleration, "acceleration to follow", s.state.dimension)
        return (Aim(s.response.acceleration(s.state, 0.0), wanted),)

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        s = situation
        return float(np.linalg.norm(motion.acceleration(s.now) - self.acceleration)) / s.limits.max_acceleration


@dataclass(frozen=True, eq=False)
class FollowVelocity(CheckedFields):
    """Reach the given velocity (d,) [m/s] when the control has settled."""

    velocity: Checked = Checked(vector)
    enough_clearance: NotNegative = 0.0

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        s = situation
        desired = vector(self.velocity, "velocity to follow", s.state.dimension)
        return (Aim(s.response.velocity(s.state, max(s.step, IMMEDIATE)), desired),)

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        s = situation
        difference = float(np.linalg.norm(motion.velocity(until) - self.velocity))
        return float(until - s.now) + difference / s.limits.max_acceleration


@dataclass(frozen=True)
class MostClearance:
    """Maximise the clearance up to `enough` [m] beyond the margin; then minimise `then`."""

    enough: Positive
    then: Objective

    def __post_init__(self) -> None:
        check_fields(self)
        has(self.then, *OBJECTIVE, "then")

    @property
    def enough_clearance(self) -> float:
        return self.enough

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        return self.then.aims(situation)

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        return cost_of(self.then, motion, situation, until)


@dataclass(frozen=True)
class Mix:
    """Weighted sum of objectives: ((weight, objective), ...), weights of 0 or more."""

    parts: tuple[tuple[float, Objective], ...]

    def __post_init__(self) -> None:
        listing(self.parts, "weights and objectives", "parts")
        total = 0.0
        for k, part in enumerate(self.parts):
            weight, objective = pair(part, "a weight and an objective", f"parts[{k}]")
            has(objective, *OBJECTIVE, f"parts[{k}]")
            total += not_negative(weight, f"weight of parts[{k}]")
        positive(total, "sum of the weights of parts")

    @property
    def enough_clearance(self) -> float:
        return max(part.enough_clearance for _, part in self.parts)

    def aims(self, situation: Situation) -> tuple[Aim, ...]:
        # Each part is normalised to the same curvature in u, so that weights compare accelerations, not times.
        mixed = []
        for weight, part in self.parts:
            aims = part.aims(situation)
            curvature = sum(aim.weight * float(abs(aim.map.gain)) ** 2 for aim in aims)
            mixed += [aim._replace(weight=aim.weight * weight / curvature) for aim in aims]
        return tuple(mixed)

    def cost(self, motion: Trajectory, situation: Situation, until: float) -> float:
        weights = sum(weight for weight, _ in self.parts)
        return sum(weight * cost_of(part, motion, situation, until) for weight, part in self.parts) / weights


FOLLOWING = (FollowVelocity, FollowAcceleration, KeepAcceleration)
"""Objectives that need no goal."""


def parts_of(objective: Objective, weight: float = 1.0) -> list[tuple[float, Objective]]:
    """The objectives without parts of which an objective is the mean, with their shares of `weight`."""
    if type(objective) is MostClearance:
        return parts_of(objective.then, weight)
    if type(objective) is not Mix:
        return [(weight, objective)]
    total = sum(part for part, _ in objective.parts)
    return [one for part, other in objective.parts if part > 0.0 for one in parts_of(other, weight * part / total)]


def is_compiled(objective: Objective) -> bool:
    """Whether kernels have the objective; if not, they ask it for the costs of candidates."""
    return all(type(part) in (Arrive, *FOLLOWING) for _, part in parts_of(objective))


def aims_are_compiled(objective: Objective) -> bool:
    """Whether kernels have the aims of the objective."""
    known = [one.aims for one in (Arrive, *FOLLOWING)]
    return all(getattr(type(part), "aims", None) in known for _, part in parts_of(objective))


def cost_of(objective: Objective, motion: Trajectory, s: Situation, until: float) -> float:
    """Cost [s] of one motion by an objective, see `Objective`."""
    cost = objective.cost(motion, s, until)
    if not hasattr(objective, "costs"):
        return cost
    path = motion.path(s.now, until)
    one = Candidates(path.times[None], path.points[None], np.array([until]), np.array([cost]))
    return float(costs_of(objective, one, s)[0])


def costs_of(objective: Objective, candidates: Candidates, s: Situation) -> Array:
    """Costs (n,) [s] of candidates by an objective, of one without `costs` one by one.

    Raises:
        InvalidInput: an objective that returns something else.
    """
    if type(objective) is MostClearance:
        return costs_of(objective.then, candidates, s)
    if not hasattr(objective, "costs"):
        ends = zip(candidates.motions(s.horizon), candidates.until.tolist())
        return np.array([cost_of(objective, motion, s, until) for motion, until in ends])
    found = np.asarray(objective.costs(candidates, s), dtype=np.float64)
    if found.shape != candidates.costs.shape or np.isnan(found).any():
        raise InvalidInput(f"costs: expected {len(candidates.costs)} numbers, found {short(found)}")
    return found


def needs_goal(objective: Objective) -> bool:
    """Whether an objective needs a goal: only those that follow something need none."""
    return type(objective) is Arrive or any(not isinstance(part, FOLLOWING) for _, part in parts_of(objective))


OBJECTIVES: Final = Registry[type[Objective]](
    "slalom.objectives",
    Kind(
        lambda part: isinstance(part, type) and all(hasattr(part, name) for name in ("aims", "cost")),
        "a class of objectives",
    ),
    {
        "arrive": Arrive,
        "keep_acceleration": KeepAcceleration,
        "follow_acceleration": FollowAcceleration,
        "follow_velocity": FollowVelocity,
        "most_clearance": MostClearance,
        "mix": Mix,
    },
)
"""Objectives by the name that files use; packages add to them by entry points of the group slalom.objectives."""
