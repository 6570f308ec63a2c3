"""Navigator of one robot that searches over sequences of accelerations and always has a safe one to continue."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from slalom.checks import duration, has, not_negative, number, or_infinite, positive
from slalom.decision.decision import Decision, DecisionInputs, Outcome, completed, state_to_decide_from
from slalom.decision.navigator import Navigator
from slalom.decision.navigator_checks import goal_or_place
from slalom.errors import InvalidInput
from slalom.forecast import EXACT
from slalom.goal import Goal
from slalom.lookahead.plan import alone, new_plan, rests_clear, search_in, sequence_decision
from slalom.lookahead.scene import Scene, SequenceDecision as SequenceDecision, interval_of, motions_of, predicted_until
from slalom.lookahead.search import Search
from slalom.lookahead.spacetime_index import PredictedObstacles
from slalom.obstacle import Obstacle
from slalom.obstacle.table import same_dimension
from slalom.obstacle.window import Obstacles, each_for_one, listed
from slalom.path_goal import PathGoal
from slalom.state import State
from slalom.tolerances import COMMITTED_SLACK, JUMP, NODE_TIME_SLACK, SEARCH_SCALES, TABLE_HORIZONS
from slalom.trajectory import Stationary


@dataclass(frozen=True)
class LookAhead:
    """Robot that decides by a search over sequences of accelerations.

    Sequences grow best first; each step is an exact choice near several candidate accelerations
    (`kernels/sequence_search/`). The best sequence that arrives is kept until another arrives earlier by the
    share `patience` of the time that is left, or until it collides with new predictions. The robot thus stops for gaps,
    passes behind obstacles and arrives in time without further rules. While no sequence to the goal is found, the safe
    one with the least estimated arrival is started. The search continues at the next decision as long as the
    predictions do not change. The navigator decides without any, within the tolerance of a goal to stop at, and where
    something passes through the robot at rest there. The uncertainty of `FromModels` is an estimate: where it leaves no
    safe decision, less of it counts (DOUBT_SHARES), and where a sequence with SOONER_SHARE of it arrives earlier by
    SOONER_RISES times from rest to the maximum speed, that is taken. Before that, improbable futures of obstacles are
    given up, see `Obstacle.probability`; a sequence that gave some up is kept only once it avoids all.

    Law: a sequence keeps the margin until it ends, or the largest possible fraction of it, as long as the forecasts
    hold. Where the forecast is `FromModels`, it keeps at least the share `doubt` of the uncertainty and of the margin.
    The motion after a pass through the goal is not tested. Limits: only a maximum speed and a largest acceleration.

    Attributes:
        navigator: provides forecast, shape, limits, period, margin and patience, and decides where the search has no
            sequence.
        time_horizon: [s] length of the searched future.
        deadline: absolute time [s]; later arrivals do not count.
        budget: [us] of work per decision, counted and not measured, so that results do not depend on the machine. A
            search that it ends continues at the next decision, or has ANEW_BUDGETS of it where forecasts change.
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
        limits = self.navigator.limits
        if limits.bounds or limits.velocity_bounds or limits.acceleration_bounds:
            raise InvalidInput("limits: expected no more than a maximum speed and acceleration, found further bounds")

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
            obstacles: passing the same list or table at every decision avoids building its table again.

        Raises:
            InvalidInput: dimensions that differ, a goal that moves or has a path; an obstacle whose trajectory ended
                before; a time before that of the previous decision, a delay above the horizon of the navigator.
        """
        state = state_to_decide_from(state, previous, now, delay, self.navigator.horizon)
        goal_or_place(goal, state, self.navigator.objective, self.navigator.limits)
        if isinstance(goal, PathGoal):
            raise InvalidInput("goal: expected one without a path to look ahead, found a PathGoal")
        if not isinstance(goal.trajectory, Stationary):
            raise InvalidInput("goal: expected one at rest to look ahead, found one that moves")
        before = previous if isinstance(previous, SequenceDecision) else None
        same_dimension(self.navigator.robot.dimension, state.dimension, "robot", "state")
        one_by_one = each_for_one(obstacles, state.dimension, now)
        motions = motions_of(self.navigator, one_by_one, now)
        tables = (self.prepared,) if before is None else (before.search.obstacles, self.prepared)
        table = self._prediction(one_by_one, motions, now, tables)
        scene = Scene(
            self.navigator, state, goal, now, self._deadline(now), obstacles, motions, table, previous, before
        )
        if goal.stop and float(np.linalg.norm(goal.position(now) - state.position)) <= goal.tolerance:
            return alone(scene)
        planned = self._keep_or_improve(scene) or new_plan(scene, self.budget, self.improvement_budget)
        if not isinstance(planned, SequenceDecision):
            return planned
        if not rests_clear(scene, planned.arrival):
            return alone(scene)
        inputs = DecisionInputs(
            self.navigator, state, tuple(listed(obstacles)), goal, None, now, None, None, searched=True
        )
        return completed(planned, inputs, previous, None, np.inf)

    def _prediction(
        self,
        obstacles: Sequence[Obstacle],
        motions: Sequence[Obstacle],
        now: float,
        tables: Sequence[PredictedObstacles | None],
    ) -> PredictedObstacles:
        """Predicted obstacles now: the first of `tables` that is still valid and covers enough time, else a new one."""
        navigator = self.navigator
        latest = predicted_until(navigator, self._deadline(now), now)
        for table in tables:
            if table is not None and table.covers(obstacles, now, latest):
                return table
        forecast, step = navigator.method.forecast, interval_of(navigator)
        if isinstance(forecast, EXACT):
            end = max(min(self.deadline, now + TABLE_HORIZONS * self.time_horizon), latest)
            return PredictedObstacles.of(
                obstacles, obstacles, navigator.robot, now, end, step, include_future=forecast.includes_future
            )
        return PredictedObstacles.of(None, motions, navigator.robot, now, latest, step)

    def prepared_for(self, obstacles: Sequence[Obstacle], now: float) -> "LookAhead":
        """Copy whose decisions reuse a table built now for exactly these obstacles."""
        return replace(self, prepared=self._prediction(obstacles, motions_of(self.navigator, obstacles, now), now, ()))

    def _deadline(self, now: float) -> float:
        return min(self.deadline, now + self.time_horizon)

    def _keep_or_improve(self, scene: Scene) -> SequenceDecision | None:
        """Previous sequence, or one that is better by the navigator's patience.

        None if the previous sequence must not be kept.
        """
        previous, now = scene.previous, scene.now
        if previous is None or now >= previous.search.end_time - NODE_TIME_SLACK * self.navigator.period:
            return None
        scene = scene.with_doubt(previous.doubt)
        search, motion = previous.search, previous.manoeuvre
        deviation = float(np.abs(motion.position(now) - scene.state.position).max())
        deviation = max(deviation, float(np.abs(motion.velocity(now) - scene.state.velocity).max()))
        same = (
            search.obstacles is scene.prediction and scene.prediction.includes_future and deviation <= COMMITTED_SLACK
        )
        if deviation > JUMP or not (same or self._remains_clear(scene, previous)):
            return None
        if not search.complete:
            return self._continue_search(scene, search) if same else None
        improved = self._improved(scene, previous, same)
        if improved.complete and improved.arrival <= self._worth_changing(previous, now):
            return sequence_decision(scene, improved, self._outcome(scene, improved))
        return replace(previous, outcome=Outcome.KEPT, better=improved if same else None, given_up=0.0)

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
        found = found.with_stop(scene.now, self.navigator.horizon)
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
