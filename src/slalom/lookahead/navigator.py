"""Navigator of one robot that searches over sequences of accelerations and always has a safe one to continue."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Final, NamedTuple

import numpy as np

from slalom import kernels
from slalom.base.checks import Array, duration, has, not_negative, number, or_infinite, positive
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import COMMITTED_SLACK, JUMP
from slalom.choice.control_obstacle import ControlObstacle
from slalom.decision import Decision
from slalom.decision.decision import DecisionInputs, Outcome, completed, made, state_to_decide_from
from slalom.decision.document import KINDS
from slalom.decision.fallback import Level, least_given_up, levels, stated, time_of
from slalom.decision.navigator import Navigator, goal_or_place
from slalom.forecast.forecast import EXACT, Known
from slalom.forecast.from_models import FromModels
from slalom.kernels.arrays import Flags
from slalom.lookahead.record import SearchCall, recorded
from slalom.lookahead.search import (
    NODE_TIME_SLACK,
    PredictedObstacles,
    Search,
    Work,
    bound_table,
    new_search,
    run_searches,
    step_of,
)
from slalom.model.goal import Goal
from slalom.model.path_goal import PathGoal
from slalom.model.response import AccelerateThenCoast
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.model.trajectory.composite import part_until
from slalom.model.trajectory.kinds import positions_of
from slalom.obstacle import Obstacle
from slalom.obstacle.table import same_dimension
from slalom.obstacle.window import (
    Obstacles,
    ObstacleWindow,
    Reaction,
    coverages,
    covering,
    each_for_one,
    futures,
    listed,
)

# Input and output of one decision of a robot that looks ahead.


@dataclass(frozen=True, eq=False, repr=False)
class SequenceDecision(Decision):
    """Decision for a whole sequence of accelerations.

    Attributes:
        search: the search that found the sequence.
        better: the search for an earlier arrival, which the next decision continues.
        arrival: absolute time [s] at which the sequence reaches the goal; inf if it ends before.
    """

    search: Search = field(kw_only=True)
    better: Search | None = None
    arrival: float = np.inf


class Scene(NamedTuple):
    """Input of one decision."""

    navigator: Navigator
    state: State
    goal: Goal
    now: float
    deadline: float  # [s] later arrivals do not count
    given: Obstacles  # as passed by the caller
    motions: Sequence[Obstacle]  # on their predicted trajectories, with all of their uncertainty
    prediction: PredictedObstacles
    before: Decision | None
    previous: SequenceDecision | None  # `before`, if it is one

    @property
    def coverages(self) -> list[float]:
        """The shares of the errors that the sets of the motions hold, and smaller ones, see `window.coverages`."""
        return coverages(one.uncertainty for one in self.motions)

    def less(self) -> "Scene":
        """The scene with the next smaller sets, which later decisions keep; the same without."""
        return self.covering(self.coverages[:2][-1])

    def covering(self, share: float) -> "Scene":
        """The scene with sets that hold another share of the errors; the same where they do, and without sets."""
        return self if self.coverages[0] in (share, 1.0) else self._among(covering(self.motions, share))

    def stated(self, decision: Decision, share: float) -> Decision:
        """A decision that keeps sets of a `share` of the errors, see `fallback.stated`."""
        return stated(decision, self.motions, share, self.navigator, self.state, self.now)

    def without(self, given_up: Flags) -> "Scene":
        """The scene without some of the motions (n,); the same without none."""
        if not given_up.any():
            return self
        return self._among([motion for motion, gone in zip(self.motions, given_up.tolist()) if not gone])

    def clearance(self) -> float:
        """[m] What the robot can keep of its clearance, see `kept_margin`; contact is 0 or less."""
        return kernels.kept_margin(self.prediction.clearance(self.state.position, self.now), np.inf, 0.0)[1]

    def _among(self, motions: Sequence[Obstacle]) -> "Scene":
        latest = predicted_until(self.navigator, self.deadline, self.now)
        table = PredictedObstacles.of(
            *(None, motions, self.navigator.robot, self.now, latest, interval_of(self.navigator)),
            include_future=self.prediction.includes_future,
        )
        return self._replace(prediction=table, motions=motions)


def time_left(decision: Decision, scene: Scene) -> float:
    """[s] to the arrival, estimated for a decision without one."""
    if isinstance(decision, SequenceDecision) and decision.arrival < np.inf:
        return decision.arrival - scene.now
    return time_of(decision, scene.navigator, scene.state, scene.goal, scene.now)


def predicted_until(navigator: Navigator, deadline: float, now: float) -> float:
    """[s] up to which a decision predicts: its deadline, or one period if that has passed."""
    return max(deadline, now + navigator.period)


def rise_of(navigator: Navigator) -> float:
    """[s] from rest to the maximum speed."""
    return navigator.limits.max_speed / navigator.limits.max_acceleration


def interval_of(navigator: Navigator) -> float:
    """[s] width of the intervals of time by which obstacles are found; at least a period bounds their number."""
    return max(rise_of(navigator), navigator.period)


FORESEEN: Final = 48
"""[1] Moving obstacles nearest to a robot that it predicts from their past: a bound on the work of a decision. More:
slower decisions in dense crowds. Fewer: those that come from farther away are seen late."""


def motions_of(
    navigator: Navigator, obstacles: Sequence[Obstacle], now: float, place: Array | None = None, delay: float = 0.0
) -> list[Obstacle]:
    """Obstacles that count at `now` [s], on their predicted trajectories, for a robot at `place` (d,) [m].

    Where the forecast is `FromModels`, those at rest and the FORESEEN nearest of the others; without a place all.
    """
    forecast = navigator.method.forecast
    there = [k for k, o in enumerate(obstacles) if forecast.includes_future or o.exists(now)]
    if place is not None and isinstance(forecast, FromModels) and len(there) > FORESEEN:
        known = [obstacles[k].known_at(now) for k in there]
        places = positions_of([part_until(one.trajectory, now) for one in known], np.full((len(known), 1), now))[:, 0]
        gaps = np.linalg.norm(places - place, axis=1) - [one.shape.bounding_radius for one in known]
        rest = np.array([isinstance(one.trajectory, Stationary) for one in known])
        gaps[rest] = -np.inf
        nearest = np.argsort(gaps, kind="stable")[: np.count_nonzero(rest) + FORESEEN]
        there = [there[k] for k in np.sort(nearest).tolist()]
    each = futures(obstacles, forecast, now, there, Reaction(navigator.limits, navigator.period, delay))
    return [motion for motions in each for motion in motions]


# A new sequence of accelerations for a scene, or the decision of the navigator where no sequence is found.


SEARCH_SCALES: Final = (1.0, 0.5)
"""[1] Steps of a search over sequences, as multiples of the time from rest to max_speed, tried in this order. The finer
step serves if the coarser one finds no arrival. Larger: fewer nodes to the goal, narrow gaps are missed. Smaller: the
budget ends before an arrival is found."""


MARGIN_SHARES: Final = (1.0, 0.5, 0.25, 0.0)
"""[1] Shares of the margin with which a search over sequences is repeated, in this order, until one succeeds. More
values: a robot in a narrow gap keeps more of its margin, for more searches. Without 0: it finds no way where only
contact is avoidable."""


def new_plan(scene: Scene, with_less: Callable[[], Scene], budget: float, improving: float) -> Decision:
    """Decision for a new sequence, else of the navigator, in the first part of the scene that has a safe one.

    First among the stated sets of a forecast, if a sequence with the whole margin arrives there. Then with the next
    smaller sets and all futures of the obstacles, then without the least probable futures, then with smaller sets.

    Args:
        with_less: gives the scene with the next smaller sets.
        budget: [us] of work; improving: [us] of work after the first arrival, and the least for each search.
    """
    given = [] if all(motion.probability == 1.0 for motion in scene.motions) else levels(scene.motions)
    if len(scene.coverages) > 1 and not given:
        found = _sequence_in(scene, Work(budget, improving), MARGIN_SHARES[:1])
        if found is not None and found.arrival < np.inf:
            return found
    less = with_less()
    decision = scene.stated(_least_given_up(less, given, Work(budget, improving)), less.coverages[0])
    likely = scene.without(given[-1].given_up) if given else scene
    for share in scene.coverages:
        if decision.outcome.safe or decision.outcome is Outcome.LIKELY:
            break
        if share < less.coverages[0]:
            decision = likely.stated(_plan_in(likely.covering(share), Work(budget, improving)), share)
    return decision


def _least_given_up(scene: Scene, given: list[Level], work: Work) -> Decision:
    """Decision that avoids all motions of a scene, else all but the least probable ones; given: their levels."""
    if not given:
        return _plan_in(scene, work)
    return least_given_up(
        given,
        lambda level: _plan_in(scene.without(level.given_up), work),
        scene.navigator.risk,
        lambda one: time_left(one, scene),
    )


def _plan_in(scene: Scene, work: Work) -> Decision:
    """Decision for a new sequence, else of the navigator, that avoids all motions of a scene.

    A robot that must not stop begins a sequence without an arrival only where the navigator has no safe decision: such
    a sequence leads past obstacles at full speed, and the robot cannot wait for a better one.
    """
    found = _sequence_in(scene, work)
    if found is not None and not (found.outcome is Outcome.BEGUN and found.search.problem.never_stops):
        return found
    own = alone(scene)
    return own if found is None or own.safe else found


def alone(scene: Scene) -> Decision:
    """Decision of the navigator; in a part of the scene, and where it is estimated, among the motions of the scene."""
    navigator, method = scene.navigator, replace(scene.navigator.method, looks_ahead=False)
    around = scene.given
    if isinstance(method.forecast, FromModels) or not all(motion.probability == 1.0 for motion in scene.motions):
        around = [replace(motion, probability=1.0) for motion in scene.motions]
        method = replace(method, forecast=Known())
    return replace(navigator, method=method).decide(
        scene.state, around, scene.goal, now=scene.now, previous=scene.before
    )


def rests_clear(scene: Scene, arrival: float) -> bool:
    """Whether a robot that rests at its goal from `arrival` [s] on is collision-free up to the navigator's horizon.

    With the next smaller sets. True for a goal to pass, and for an arrival beyond the horizon.
    """
    motions, left = covering(scene.motions, scene.coverages[:2][-1]), scene.now + scene.navigator.horizon - arrival
    there = [motion for motion in motions if motion.exists(arrival)]
    if not scene.goal.stop or left <= scene.navigator.period or not there:
        return True
    rest, window = State(scene.goal.position(arrival), 0.0 * scene.state.velocity), ObstacleWindow(there, arrival, left)
    blocked = ControlObstacle(AccelerateThenCoast(left), rest, window, scene.navigator.robot)
    return float(blocked.clearance(0.0 * scene.state.velocity)) >= 0.0


def _sequence_in(scene: Scene, work: Work, shares: Sequence[float] = MARGIN_SHARES) -> SequenceDecision | None:
    """Decision for a new sequence with the first of those shares of the margin that has one.

    One that arrives, else one that is only begun. A search that the budget ends continues at the next decision. Not so
    where forecasts change with every observation: there the next share has a budget of its own.
    """
    changes = isinstance(scene.navigator.method.forecast, FromModels)
    clearance, margin = scene.clearance(), scene.navigator.margin
    if clearance < 0.0:
        return None
    start: Search | None = None
    left = work.left
    for share in shares if margin > 0.0 else shares[:1]:
        found, spent = search_in(scene, min(clearance, share * margin), left, work.least, SEARCH_SCALES)
        if not changes:
            left -= spent
            work.left = max(left, work.least)
        if found.complete:
            outcome = Outcome.CLEAR if found.direct else Outcome.CONSTRAINED
            return sequence_decision(scene, found, outcome if share == 1.0 else Outcome.SQUEEZED)
        start = start or _ended(scene, found)
        if not changes and (found.cut or left <= 0.0):
            break
    return None if start is None else sequence_decision(scene, start, Outcome.BEGUN)


def _ended(scene: Scene, search: Search) -> Search | None:
    """The search with a sequence that the robot can continue, if it has one; see `Search.with_end`."""
    ended = search.with_end(scene.now, scene.navigator.horizon)
    return ended if ended.node >= 0 else None


def search_in(
    scene: Scene, margin: float, budget: float, improving: float, scales: Sequence[float], latest: float = np.inf
) -> tuple[Search, float]:
    """New search for arrivals up to `latest` [s], and its work [us]; the arguments of `new_plan` and `new_search`."""
    navigator = scene.navigator
    limits, period = navigator.limits, navigator.period
    # Scales that round to the same number of periods are one search.
    steps = {step_of(limits.max_speed, limits.max_acceleration, period, scale): scale for scale in scales[::-1]}
    searches = [
        new_search(
            scene.state,
            scene.goal,
            limits,
            scene.prediction,
            now=scene.now,
            period=period,
            deadline=min(latest, scene.deadline),
            margin=margin,
            scale=scale,
        )
        for scale in reversed(steps.values())
    ]
    return run_searches(searches, budget, min(improving, budget))


def sequence_decision(scene: Scene, search: Search, outcome: Outcome) -> SequenceDecision:
    """Decision for the sequence that a search found."""
    motion = search.manoeuvre(scene.state, scene.now)
    table = ObstacleWindow(scene.motions, scene.now, scene.navigator.horizon)
    blocked = ControlObstacle(motion.response, scene.state, table, scene.navigator.robot, search.problem.margin)
    return SequenceDecision(
        *(motion, outcome, motion.control, made(blocked)),
        search=search,
        arrival=search.arrival,
        cut=search.cut,
    )


TABLE_HORIZONS: Final = 2.0
"""[1] Length of a table of known futures, in time horizons of the search, so that it serves many decisions. Larger:
more pieces in every table. Smaller: tables are made more often; at 1 for every decision."""


@dataclass(frozen=True)
class LookAhead:
    """Robot that decides by a search over sequences of accelerations.

    Sequences grow best first; each step is an exact choice near several candidate accelerations
    (`kernels/sequence_search/`). The best sequence that arrives is kept until another arrives earlier by the
    share `patience` of the time that is left, or until it collides with new predictions. The robot thus stops for gaps,
    passes behind obstacles and arrives in time without further rules. While no sequence to the goal is found, the safe
    one with the least estimated arrival is started. The search continues at the next decision as long as the
    predictions do not change. The navigator decides without any, within the tolerance of a goal to stop at, and where
    something passes through the robot at rest there. Where the sets of `FromModels` leave no safe decision, smaller
    ones count. Before that, improbable futures of obstacles are given up, see `Obstacle.probability`. A sequence that
    gave something up is kept only once it avoids all.

    Law: a sequence keeps the margin until it ends, or the largest possible fraction of it, as long as the forecasts
    hold. Where the forecast is `FromModels`, it keeps clear of its sets up to the time that the robot needs to react.
    The motion after a pass through the goal is not tested. A sequence obeys all limits; bounds as `Limits.allows` has
    it, in every period of the sequence. With the bound LeastSpeed none ends at rest: see `_plan_in`.

    Attributes:
        navigator: provides forecast, shape, limits, period, margin and patience, and decides where the search has no
            sequence.
        time_horizon: [s] length of the searched future.
        deadline: absolute time [s]; later arrivals count only where the robot alone could not arrive before.
        budget: [us] of work per decision, counted and not measured, so that results do not depend on the machine. A
            search that it ends continues at the next decision if the forecasts do not change.
        improvement_budget: [us] of work once an arrival is known.
        prepared: see `prepared_for`.
    """

    navigator: Navigator
    time_horizon: float = 60.0
    deadline: float = np.inf
    budget: float = 10000.0
    improvement_budget: float = 500.0
    prepared: PredictedObstacles | None = None

    def __post_init__(self) -> None:
        has(self.navigator, ("method", "limits", "decide"), "a Navigator", "navigator")
        if not self.navigator.contact_at_rest:
            raise InvalidInput("navigator: expected contact_at_rest=True to look ahead, found False")
        if self.prepared is not None:
            has(self.prepared, ("covers", "index"), "what prepared_for gives", "prepared")
        # As floats: kernels would be compiled once more for whole numbers.
        for name, value in (
            ("time_horizon", duration(self.time_horizon, "time_horizon")),
            ("deadline", or_infinite(self.deadline, "deadline", number)),
            ("budget", positive(self.budget, "budget")),
            ("improvement_budget", not_negative(self.improvement_budget, "improvement_budget")),
        ):
            object.__setattr__(self, name, value)
        # Refuses bounds that a search cannot take.
        d = self.navigator.robot.dimension
        bound_table(self.navigator.limits, State(np.zeros(d), np.zeros(d)), self.navigator.period)

    def decide(
        self,
        state: State,
        obstacles: Obstacles,
        goal: Goal,
        *,
        now: float = 0.0,
        previous: Decision | None = None,
        delay: float = 0.0,
    ) -> Decision:
        """Decision at the time `now` [s], see `Navigator.decide`.

        Args:
            obstacles: passing the same objects at every decision avoids building their table again.

        Raises:
            InvalidInput: dimensions that differ, a goal that moves or has a path; an obstacle whose trajectory ended
                before; a time before that of the previous decision, a delay above the horizon of the navigator.
        """
        state = state_to_decide_from(state, previous, now, delay, self.navigator)
        goal_or_place(goal, state, self.navigator.objective, self.navigator.limits)
        if isinstance(goal, PathGoal):
            raise InvalidInput("goal: expected one without a path to look ahead, found a PathGoal")
        if not isinstance(goal.trajectory, Stationary):
            raise InvalidInput("goal: expected one at rest to look ahead, found one that moves")
        before = previous if isinstance(previous, SequenceDecision) else None
        same_dimension(self.navigator.robot.dimension, state.dimension, "robot", "state")
        obstacles = tuple(listed(obstacles))
        one_by_one = each_for_one(obstacles, state.dimension, now)
        motions = motions_of(self.navigator, one_by_one, now, state.position, delay)
        tables = (self.prepared,) if before is None else (before.search.obstacles, self.prepared)
        deadline = self._deadline(state, goal, now)
        table = self._prediction(one_by_one, motions, now, tables, deadline)
        scene = Scene(self.navigator, state, goal, now, deadline, obstacles, motions, table, previous, before)
        there = goal.stop and float(np.linalg.norm(goal.position(now) - state.position)) <= goal.tolerance
        # Its table is made only where the stated sets decide nothing.
        less = cache(scene.less)
        kept = None if there else self._keep_or_improve(scene, less)
        planned = kept or (
            scene.stated(alone(less()), less().coverages[0])
            if there
            else new_plan(scene, less, self.budget, self.improvement_budget)
        )
        span = None if table.obstacles is None else (table.start, table.end)
        call = SearchCall(self if self.prepared is None else replace(self, prepared=None), state, obstacles, goal, now)
        record = recorded(call._replace(table=span), previous, fresh=kept is None)
        if not isinstance(planned, SequenceDecision):
            return replace(planned, record=record)
        if not rests_clear(scene, planned.arrival):
            return replace(scene.stated(alone(less()), less().coverages[0]), record=record)
        inputs = DecisionInputs(self.navigator, state, obstacles, goal, None, now, None, None)
        return replace(completed(planned, inputs, previous, None, np.inf), record=record)

    def _prediction(
        self,
        obstacles: Sequence[Obstacle],
        motions: Sequence[Obstacle],
        now: float,
        tables: Sequence[PredictedObstacles | None],
        deadline: float,
    ) -> PredictedObstacles:
        """Predicted obstacles now: the first of `tables` that is still valid and covers enough time, else a new one."""
        navigator = self.navigator
        latest = predicted_until(navigator, deadline, now)
        for table in tables:
            if table is not None and table.covers(obstacles, now, latest):
                return table
        if isinstance(navigator.method.forecast, EXACT):
            end = max(min(self.deadline, now + TABLE_HORIZONS * self.time_horizon), latest)
            made_now = self.with_table(obstacles, (now, end)).prepared
            assert made_now is not None
            return made_now
        return PredictedObstacles.of(None, motions, navigator.robot, now, latest, interval_of(navigator))

    def with_table(self, obstacles: Sequence[Obstacle], span: tuple[float, float]) -> "LookAhead":
        """Copy whose decisions reuse a table of these obstacles from the first to the last time of `span` [s]."""
        navigator, future = self.navigator, self.navigator.method.forecast.includes_future
        step = interval_of(navigator)
        table = PredictedObstacles.of(obstacles, obstacles, navigator.robot, *span, step, include_future=future)
        return replace(self, prepared=table)

    def prepared_for(self, obstacles: Sequence[Obstacle], now: float) -> "LookAhead":
        """Copy whose decisions reuse a table built now for exactly these obstacles; itself where none would serve."""
        if not isinstance(self.navigator.method.forecast, EXACT):
            return self
        latest = min(self.deadline, now + self.time_horizon)
        return replace(self, prepared=self._prediction(obstacles, obstacles, now, (), latest))

    def _deadline(self, state: State, goal: Goal, now: float) -> float:
        """The latest arrival [s] that counts: none after the deadline, unless the robot alone could not meet that."""
        soonest = now + goal.time_to_go(state.position, state.velocity, now, self.navigator.limits)
        return now + self.time_horizon if soonest > self.deadline else min(self.deadline, now + self.time_horizon)

    def _keep_or_improve(self, scene: Scene, less: Callable[[], Scene]) -> Decision | None:
        """Previous sequence while it avoids the smaller sets of `less`, or one that is better by the patience.

        None if the previous sequence must not be kept.
        """
        previous, now = scene.previous, scene.now
        if previous is None or now >= previous.search.end_time - NODE_TIME_SLACK * self.navigator.period:
            return None
        search, motion = previous.search, previous.manoeuvre
        deviation = float(np.abs(motion.position(now) - scene.state.position).max())
        deviation = max(deviation, float(np.abs(motion.velocity(now) - scene.state.velocity).max()))
        same = (
            search.obstacles is scene.prediction and scene.prediction.includes_future and deviation <= COMMITTED_SLACK
        )
        if deviation > JUMP:
            return None
        keeps = scene
        if not same and not self._remains_clear(scene, previous):
            keeps = less()
            if keeps is scene or not self._remains_clear(keeps, previous):
                return None
        period = self.navigator.period
        if not self.navigator.limits.allows(scene.state, motion.mean_acceleration(now, period), period):
            return None
        if not search.complete:
            return self._continue_search(scene, search) if same else None
        improved = self._improved(scene, previous, same)
        if improved.complete and improved.arrival <= self._worth_changing(previous, now):
            return sequence_decision(scene, improved, self._outcome(scene, improved))
        kept = replace(previous, outcome=Outcome.KEPT, better=improved if same else None, given_up=0.0)
        return scene.stated(kept, keeps.coverages[0])

    def _worth_changing(self, previous: SequenceDecision, now: float) -> float:
        """The latest arrival [s] for which the previous sequence is given up."""
        return previous.arrival - self.navigator.patience * max(previous.arrival - now, 0.0)

    def _outcome(self, scene: Scene, search: Search) -> Outcome:
        """Outcome of a sequence found by a continued search: SQUEEZED if it keeps less of the margin than possible."""
        full_margin = search.problem.margin >= min(self.navigator.margin, scene.clearance()) - COMMITTED_SLACK
        return Outcome.CONSTRAINED if full_margin else Outcome.SQUEEZED

    def _continue_search(self, scene: Scene, search: Search) -> SequenceDecision | None:
        """Decision after more work on a search without an arrival; None if it has no safe sequence."""
        found = search.resumed(scene.now, self.budget, self.improvement_budget)
        if found.complete:
            return sequence_decision(scene, found, self._outcome(scene, found))
        found = found.with_end(scene.now, self.navigator.horizon)
        return sequence_decision(scene, found, Outcome.BEGUN) if found.node >= 0 else None

    def _improved(self, scene: Scene, previous: SequenceDecision, same: bool) -> Search:
        """Search for an earlier arrival after a little more work; a new one where the old one cannot continue."""
        latest = self._worth_changing(previous, scene.now)
        if not same:
            margin, improving = previous.search.problem.margin, self.improvement_budget
            return search_in(scene, margin, improving, improving, SEARCH_SCALES[:1], latest)[0]
        search = previous.better
        if search is None or not search.starts_after(scene.now):
            search = previous.search.refined(scene.state, scene.now, SEARCH_SCALES[-1], latest)
        return search.extended(search.root, self.improvement_budget, 0.0)[0]

    def _remains_clear(self, scene: Scene, previous: SequenceDecision) -> bool:
        """Whether the rest of the previous sequence is collision-free under the present predictions."""
        margin = min(previous.search.problem.margin, scene.clearance())
        return margin >= 0.0 and previous.search.is_clear(
            scene.state, scene.now, scene.prediction, margin - COMMITTED_SLACK
        )


KINDS["LookAhead"] = LookAhead
