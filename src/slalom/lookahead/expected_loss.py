"""Robot that looks ahead with several margins and takes the decision of least expected loss of time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import itemgetter
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import (
    DECISION,
    GOAL,
    UNCERTAINTY,
    Array,
    array,
    array_of,
    flag,
    has,
    listing,
    mapping,
    not_negative,
    number,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import WHOLE_COUNT
from slalom.choice.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome
from slalom.decision.decision import DecisionInputs, completed, made, state_to_decide_from
from slalom.decision.document import KINDS
from slalom.forecast.forecast import EXACT, Present
from slalom.kernels.arrays import Flags
from slalom.kernels.sequence_search.tables import BoundTable
from slalom.lookahead.navigator import LookAhead, SequenceDecision, motions_of, rise_of
from slalom.lookahead.record import SearchCall, SearchInputs, recorded
from slalom.lookahead.search import NODE_TIME_SLACK, bound_table, directions, padded
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.response.kinds import AccelerationSequence
from slalom.model.state import State
from slalom.model.uncertainty import Adjusted, BoundedError, Uncertainty
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable, same_dimension
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import Obstacles, ObstacleWindow, each_for_one, listed

# Short deviations from a plan: one velocity, then another, each for a stage of a fixed duration.


DEVIATION_DIRECTIONS: Final = 16
"""[1] Directions of the velocities of a deviation in the plane. More: slower decisions, with the square. Fewer:
deviations through narrow gaps are missed."""


class Deviations(NamedTuple):
    """Motions of a robot from `state` at `now` [s], with two successive velocities.

    At the start of each stage the robot accelerates with its largest acceleration to the velocity of the stage. The
    second one is held without end.
    """

    state: State
    now: float  # [s]
    stage: float  # [s]
    accelerations: Array  # (s, 2, d) [m/s^2]
    holds: Array  # (s, 2) [s] durations of the accelerations

    @classmethod
    def of(cls, plan: Manoeuvre, state: State, limits: Limits, stage: float, now: float) -> "Deviations":
        """All pairs of velocities that the robot can take in time.

        The velocities are those in DEVIATION_DIRECTIONS directions at the maximum speed, and in every other direction
        at a half of it. Further ones are rest, the present one, and those of the plan after each stage.
        """
        speed, largest = limits.max_speed, limits.max_acceleration
        ways = _ways(state.dimension)
        own = plan.velocity(now + stage * np.array([1.0, 2.0]))
        velocities = np.concatenate([speed * ways, 0.5 * speed * ways[::2], 0.0 * ways[:1], state.velocity[None], own])
        velocities *= np.minimum(1.0, speed / np.maximum(np.linalg.norm(velocities, axis=1), speed))[:, None]
        n, d = velocities.shape
        starts = np.concatenate([np.broadcast_to(state.velocity, (n * n, d)), np.repeat(velocities, n, 0)])
        changes = np.concatenate([np.repeat(velocities, n, 0), np.tile(velocities, (n, 1))]) - starts
        holds = np.linalg.norm(changes, axis=1) / largest
        accelerations = largest * changes / np.linalg.norm(changes, axis=1, keepdims=True).clip(1e-300)
        pairs, holds = accelerations.reshape(2, n * n, d).swapaxes(0, 1), holds.reshape(2, n * n).T
        possible = np.all(holds <= stage * (1.0 + WHOLE_COUNT), axis=1)
        return cls(state, now, stage, pairs[possible], np.minimum(holds[possible], stage))

    def positions(self, times: Array) -> Array:
        """Positions (s, m, d) [m] at absolute times (m,) [s] from `now` on."""
        t = (np.asarray(times, dtype=np.float64) - self.now)[None]
        found = self.state.position + t[..., None] * self.state.velocity
        for k in range(2):
            since, hold = np.maximum(t - k * self.stage, 0.0), self.holds[:, k, None]
            ramp = np.minimum(since, hold)
            found = found + (ramp * (since - 0.5 * ramp))[..., None] * self.accelerations[:, None, k]
        return np.asarray(found)

    def best_first(self, costs: Array, highest: float, most: int, bounds: BoundTable) -> list[Manoeuvre]:
        """Deviations of costs (s,) below `highest` that obey all bounds, at most `most`, cheapest first.

        One for each first velocity.
        """
        found: dict[bytes, int] = {}
        for k in np.argsort(costs, kind="stable").tolist():
            if costs[k] >= highest or len(found) == most:
                break
            first = self.accelerations[k, 0].tobytes() + self.holds[k, 0].tobytes()
            if first not in found and self._obeys(k, bounds):
                found[first] = k
        return [self.manoeuvre(k) for k in found.values()]

    def _obeys(self, k: int, bounds: BoundTable) -> bool:
        """Whether deviation k obeys all bounds."""
        velocity = padded(self.state.velocity)
        for stage, (hold, acceleration) in enumerate(zip(self.holds[k].tolist(), self.accelerations[k], strict=True)):
            u = padded(acceleration)
            if kernels.breach(bounds, velocity, u, hold, stage == 0, np.empty(0), np.zeros(1)):
                return False
            velocity = velocity + hold * u
        return True

    def manoeuvre(self, k: int) -> Manoeuvre:
        """Deviation k as one response to its first acceleration."""
        rest = np.zeros(self.state.dimension)
        phases = []
        for hold, acceleration in zip(self.holds[k], self.accelerations[k], strict=True):
            phases += [(hold, acceleration), (self.stage - hold, rest)]
        phases = [(t, u) for t, u in phases if t > NODE_TIME_SLACK * self.stage] or [(self.stage, rest)]
        then = tuple((float(t), tuple(map(float, u))) for t, u in phases[1:])
        return Manoeuvre(AccelerationSequence(float(phases[0][0]), then), self.state, phases[0][1], self.now)


def _ways(dimension: int) -> Array:
    """Unit vectors (n, d): DEVIATION_DIRECTIONS in the plane, those of a search in space."""
    if dimension == 3:
        return directions(3)
    angles = 2.0 * np.pi * np.arange(DEVIATION_DIRECTIONS) / DEVIATION_DIRECTIONS
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


LOSS_TIMES: Final = 8
"""[1] Moments at which the closeness of a plan counts. More: slower decisions. Fewer: late closeness is not counted."""

LOSS_STEPS: Final = 2
"""[1] Moments in one stage: the time from rest to the maximum speed, in whole periods. More: slower decisions for the
same time ahead. Fewer: a short approach is missed."""

LOSS_DISCOUNT: Final = 0.6
"""[1] Weight of a stage, as a multiple of the one before. Larger: late closeness counts as much as an early one."""

DEVIATION_GAIN: Final = 0.02
"""[s] By how much the expected loss of a deviation must be below that of the plan. Larger: fewer changes of the motion.
Smaller: deviations that gain nothing, and a new plan after each."""

DEVIATION_PLANS: Final = 3
"""[1] Deviations of a decision after which a plan is searched. More: slower decisions. Fewer: a deviation that only
seems to be good hides a better one."""

NO_SPREAD: Final = 1e-100
"""[m] In place of no spread of the errors of a forecast. A gap divided by it has a finite square. Larger: contacts are
expected at a small distance from what is certain. Smaller: the square overflows."""


@dataclass(frozen=True)
class ExpectedLoss:
    """Robot that weighs time against closeness: of several plans and deviations it takes that of least expected loss.

    A large margin tolerates errors of the forecast and costs time. No margin suits all scenes, so `robot` plans with
    each, and with a share of the uncertainty of the obstacles. The cost of a plan is its time to arrival, and `loss`
    times the expected number of contacts. Then deviations are tried that take two other velocities, each for one stage.
    A stage is the time from rest to the maximum speed in whole periods. A rough cost of a deviation is that of the plan
    with the way back to it at the maximum speed. For the DEVIATION_PLANS best first velocities the cost is that of a
    plan with the first margin, which begins after the first stage. The best one is taken if its cost is lower by
    DEVIATION_GAIN.

    Errors of the forecast are small most of the time and large at times. Let c be the distance from an
    obstacle. The probability that the error in its direction exceeds c is taken to be 1 / (2 (1 + c / spread)^2). The
    expected number of contacts is the sum over obstacles and LOSS_TIMES moments, with less weight for later moments.
    A future of an obstacle counts with its probability. `decide` takes factors of the spread by the names of obstacles,
    such as `AvoidingCrowd.scales`.

    Law: a plan is a decision of `robot` with one of the margins, so it has the guarantee of `LookAhead` with that
    margin. Without deviations and with one margin the decision is that of `LookAhead`. A deviation has the outcome
    DEVIATING and no guarantee. Shapes count as their bounding balls in the cost.

    Attributes:
        robot: looks ahead; its margin is replaced.
        margins: [m] each of at least 0.
        shares: of the uncertainty of every obstacle, one for each margin, from 0 to 1.
        loss: [s] of time that one expected contact is worth.
        spread: scale of the error of the forecast by prediction time.
        deviates: whether deviations are tried.
    """

    robot: LookAhead
    margins: Sequence[float] = (0.05, 0.1, 0.2, 0.3)
    shares: Sequence[float] = (0.0, 1.0, 1.0, 1.0)
    loss: float = 120.0
    spread: Uncertainty = field(default_factory=lambda: BoundedError(0.005, 0.0, 0.08))
    deviates: bool = True

    def __post_init__(self) -> None:
        has(self.robot, ("navigator", "decide", "time_horizon"), "a LookAhead", "robot")
        listing(self.margins, "margins", "margins")
        margins = tuple(not_negative(margin, f"margins[{k}]") for k, margin in enumerate(self.margins))
        if not margins:
            raise InvalidInput("margins: expected one or more, found none")
        listing(self.shares, "shares of the uncertainty", "shares")
        shares = tuple(not_negative(share, f"shares[{k}]") for k, share in enumerate(self.shares))
        if len(shares) != len(margins) or max(shares) > 1.0:
            raise InvalidInput(f"shares: expected {len(margins)} numbers from 0 to 1, found {list(shares)}")
        has(self.spread, *UNCERTAINTY, "spread")
        flag(self.deviates, "deviates")
        for name, value in (("margins", margins), ("shares", shares), ("loss", not_negative(self.loss, "loss"))):
            object.__setattr__(self, name, value)

    def decide(
        self,
        state: State,
        obstacles: Obstacles,
        goal: Goal,
        *,
        now: float = 0.0,
        previous: Decision | None = None,
        delay: float = 0.0,
        scales: Mapping[str, float] | None = None,
    ) -> Decision:
        """As `LookAhead.decide`, with the plan or the deviation of least cost; of equal costs the first plan.

        `scales` are factors of the spread by the names of obstacles; 1 for others. Raises InvalidInput for one below 0.
        """
        state = state_to_decide_from(state, previous, now, delay, self.robot.navigator)
        same_dimension(self.robot.navigator.robot.dimension, state.dimension, "robot", "state")
        obstacles = tuple(listed(obstacles))
        one_by_one = each_for_one(obstacles, state.dimension, number(now, "now"))
        motions = self._motions(one_by_one, now)
        ahead = self._ahead(motions, self._times(now), now, scales)
        robots = self._robots(one_by_one, now)
        plans = [robot.decide(state, around, goal, now=now, previous=previous) for robot, around in robots]
        best = min(((self._cost(plan, ahead, goal, now), plan) for plan in plans), key=itemgetter(0))
        deviates = self.deviates and delay == 0.0
        call = SearchCall(replace(self, deviates=deviates), state, obstacles, goal, now, scales)
        record = recorded(call, previous, fresh=all(map(_is_fresh, plans)))
        if not deviates:
            return replace(best[1], record=record)
        moment = _Moment(state, obstacles, motions, ahead, goal, now, previous)
        return replace(self._deviation(best, moment, self._follower(*robots[0], now)) or best[1], record=record)

    @staticmethod
    def _follower(robot: LookAhead, around: Sequence[Obstacle], now: float) -> tuple[LookAhead, Sequence[Obstacle]]:
        """The robot that plans from the end of a first stage on, and the obstacles as they are predicted at `now` [s].

        A forecast made at the end of the stage would observe the obstacles then, which is not known yet.
        """
        navigator = robot.navigator
        motions = motions_of(navigator, around, now)
        if isinstance(navigator.method.forecast, EXACT):
            return robot, motions
        method = replace(navigator.method, forecast=Present())
        return replace(robot, navigator=replace(navigator, method=method)), motions

    def _robots(self, obstacles: Sequence[Obstacle], now: float) -> list[tuple[LookAhead, Sequence[Obstacle]]]:
        """The robot with each margin, and the obstacles with the share of that margin."""
        scenes: dict[float, tuple[LookAhead, Sequence[Obstacle]]] = {}
        for share in self.shares:
            if share not in scenes:
                around = [_with_share(obstacle, share) for obstacle in obstacles] if share < 1.0 else obstacles
                scenes[share] = self.robot.prepared_for(around, now), around
        found = []
        for margin, share in zip(self.margins, self.shares, strict=True):
            shared, around = scenes[share]
            found.append((replace(shared, navigator=replace(shared.navigator, margin=margin)), around))
        return found

    def cost(
        self,
        decision: Decision,
        obstacles: Obstacles,
        goal: Goal,
        now: float,
        scales: Mapping[str, float] | None = None,
    ) -> float:
        """Time [s] from `now` to the arrival, and `loss` for each expected contact.

        Without a known arrival the time is an estimate: three times the span of the moments, and the rest of the way at
        the maximum speed. The rest begins at the position at the last moment. The first term exceeds the span, so that
        a known arrival is preferred. A decision that is not safe costs a contact in the stage after the last moment.
        """
        has(decision, *DECISION, "decision")
        has(goal, *GOAL, "goal")
        d = self.robot.navigator.robot.dimension
        same_dimension(decision.manoeuvre.dimension, d, "decision", "robot")
        same_dimension(goal.trajectory.dimension, d, "goal", "robot")
        motions = self._motions(each_for_one(obstacles, d, number(now, "now")), now)
        return self._cost(decision, self._ahead(motions, self._times(now), now, scales), goal, now)

    def contacts(
        self,
        places: Array,
        obstacles: Obstacles,
        times: npt.ArrayLike,
        now: float,
        scales: Mapping[str, float] | None = None,
    ) -> Array:
        """Expected number of contacts (..., n) of robots at `places` (..., n, d) [m] at `times` (n,) [s]."""
        d, now = self.robot.navigator.robot.dimension, number(now, "now")
        places = array(places, "places")
        if places.ndim < 2 or places.shape[-1] != d:
            raise InvalidInput(f"places: expected an array of shape (..., n, {d}), found shape {places.shape}")
        times = array_of(times, "times", places.shape[-2:-1])
        motions = self._motions(each_for_one(obstacles, d, now), now)
        return _contacts(places, self._ahead(motions, times, now, scales))

    def _motions(self, obstacles: Sequence[Obstacle], now: float) -> list[Obstacle]:
        return motions_of(self.robot.navigator, [obstacle for obstacle in obstacles if obstacle.exists(now)], now)

    @property
    def _stage(self) -> float:
        """[s] from rest to the maximum speed, in whole periods."""
        period = self.robot.navigator.period
        return period * max(1, int(np.ceil(rise_of(self.robot.navigator) / period - WHOLE_COUNT)))

    def _times(self, now: float) -> Array:
        return now + self._stage * np.arange(1, LOSS_TIMES + 1, dtype=np.float64) / LOSS_STEPS

    def _sum(self, contacts: Array) -> Array:
        """Weighted sum (...) of contacts (..., n) at all moments."""
        stages = np.arange(LOSS_TIMES) // LOSS_STEPS
        return np.asarray(contacts @ (LOSS_DISCOUNT**stages / LOSS_STEPS))

    def _cost(self, decision: Decision, ahead: "_Ahead", goal: Goal, now: float) -> float:
        places = decision.manoeuvre.position(self._times(now))
        contacts = float(self._sum(_contacts(places, ahead)))
        return self._time(decision, goal, now, places[-1]) + self.loss * contacts

    def _time(self, decision: Decision, goal: Goal, now: float, end: Array) -> float:
        if isinstance(decision, SequenceDecision) and np.isfinite(decision.arrival):
            return decision.arrival - now
        left = float(np.linalg.norm(end - goal.trajectory.position(now))) / self.robot.navigator.limits.max_speed
        safe = decision.outcome.safe or decision.outcome is Outcome.LIKELY
        later = 0.0 if safe else self.loss * LOSS_DISCOUNT ** (LOSS_TIMES // LOSS_STEPS)
        return 3.0 * float(self._times(0.0)[-1]) + left + later

    def _ahead(
        self, motions: Sequence[Obstacle], times: Array, now: float, scales: Mapping[str, float] | None
    ) -> "_Ahead":
        """The obstacles at `times` (m,) [s]."""
        given = {} if scales is None else scales
        mapping(given, "factors by names of obstacles", "scales")
        factors = [not_negative(given.get(motion.name, 1.0), f"scales[{motion.name!r}]") for motion in motions]
        own, d = self.robot.navigator.robot.bounding_radius, self.robot.navigator.robot.dimension
        positions, present = np.zeros((len(motions), len(times), d)), np.ones((len(motions), len(times)), np.bool_)
        for k, motion in enumerate(motions):
            first, last = motion.trajectory.span
            there = present[k] = (first <= times) & (times <= last)
            positions[k, there] = motion.trajectory.position(times[there])
        radii = np.array([own + motion.shape.bounding_radius for motion in motions])
        weights = np.array([motion.probability for motion in motions])
        spread = np.outer(factors, self.spread.radius(times - now, d)).clip(NO_SPREAD)
        return _Ahead(positions, present, radii, spread, weights)

    def _deviation(
        self, plan: tuple[float, Decision], moment: "_Moment", follower: tuple[LookAhead, Sequence[Obstacle]]
    ) -> Decision | None:
        """The deviation of least cost; None if none costs less than the plan by DEVIATION_GAIN."""
        navigator = self.robot.navigator
        now = moment.now
        motion = plan[1].manoeuvre
        times, highest = self._times(now), plan[0] - DEVIATION_GAIN
        others = Deviations.of(motion, moment.state, navigator.limits, self._stage, now)
        places = others.positions(times)
        back = np.linalg.norm(places[:, 2 * LOSS_STEPS - 1] - motion.position(times[2 * LOSS_STEPS - 1]), axis=-1)
        costs = back / navigator.limits.max_speed + self.loss * self._sum(_contacts(places, moment.ahead))
        costs += self._time(plan[1], moment.goal, now, motion.position(times[-1]))
        bounds = bound_table(navigator.limits, moment.state, navigator.period)
        promising = others.best_first(costs, highest, DEVIATION_PLANS, bounds)
        cost, chosen = min(
            ((self._cost_with_plan(one, moment, follower), k) for k, one in enumerate(promising)), default=(np.inf, -1)
        )
        if cost >= highest:
            return None
        manoeuvre = promising[chosen]
        table = ObstacleWindow(moment.motions, now, navigator.horizon)
        blocked = ControlObstacle(manoeuvre.response, moment.state, table, navigator.robot, 0.0)
        decision = Decision(manoeuvre, Outcome.DEVIATING, manoeuvre.control, made(blocked))
        inputs = DecisionInputs(navigator, moment.state, moment.obstacles, moment.goal, None, now, None, None)
        return completed(decision, inputs, moment.previous, None, np.inf)

    def _cost_with_plan(
        self, deviation: Manoeuvre, moment: "_Moment", follower: tuple[LookAhead, Sequence[Obstacle]]
    ) -> float:
        """Cost [s] of the first stage of a deviation and of the plan of `follower` after it."""
        (robot, around) = follower
        goal = moment.goal
        times = self._times(moment.now)
        then = moment.now + self._stage
        places, state = deviation.position(times), State(deviation.position(then), deviation.velocity(then))
        left = 0.0
        if np.linalg.norm(state.position - goal.trajectory.position(then)) > goal.tolerance:
            plan = robot.decide(state, around, goal, now=then)
            places[LOSS_STEPS:] = plan.manoeuvre.position(times[LOSS_STEPS:])
            left = self._time(plan, goal, then, plan.manoeuvre.position(times[-1] + self._stage))
        return self._stage + left + self.loss * float(self._sum(_contacts(places, moment.ahead)))


class _Moment(NamedTuple):
    """What one decision is about."""

    state: State
    obstacles: Sequence[Obstacle | ObstacleTable | Tracks]
    motions: Sequence[Obstacle]  # predicted
    ahead: "_Ahead"
    goal: Goal
    now: float  # [s]
    previous: Decision | None


class _Ahead(NamedTuple):
    """Obstacles at m moments."""

    positions: Array  # (n, m, d) [m]
    present: Flags  # (n, m) whether they exist
    radii: Array  # (n,) [m] sum of bounding radii with the robot
    spread: Array  # (n, m) [m]
    weights: Array  # (n,) [1] probabilities


def _is_fresh(plan: Decision) -> bool:
    """Whether a plan depends neither on the search of the previous decision nor on its table of obstacles."""
    record = plan.record
    assert isinstance(record, SearchInputs)
    first, *later = record.calls
    return not later and (first.table is None or first.table[0] == first.now)


def _contacts(places: Array, ahead: _Ahead) -> Array:
    """Expected number of contacts (..., m) of robots at `places` (..., m, d) [m]."""
    gaps = np.linalg.norm(ahead.positions - places[..., None, :, :], axis=-1) - ahead.radii[:, None]
    beyond = 0.5 / (1.0 + np.abs(gaps) / ahead.spread) ** 2
    each = np.where(ahead.present, np.where(gaps < 0.0, 1.0 - beyond, beyond), 0.0)
    return np.asarray((ahead.weights[:, None] * each).sum(axis=-2))


def _with_share(obstacle: Obstacle, share: float) -> Obstacle:
    """The obstacle with that share of its uncertainty."""
    if obstacle.uncertainty is None:
        return obstacle
    return replace(obstacle, uncertainty=Adjusted(obstacle.uncertainty, share=share) if share > 0.0 else None)


KINDS["ExpectedLoss"] = ExpectedLoss
