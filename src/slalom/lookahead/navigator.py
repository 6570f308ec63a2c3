"""One robot that looks ahead over sequences of accelerations, and always has one that it goes on with."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from slalom.checks import not_negative, positive
from slalom.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome
from slalom.errors import InvalidInput
from slalom.forecast import EXACT, predicted
from slalom.goal import Goal
from slalom.lookahead.search import SCALES, Search, new_search, run_searches
from slalom.lookahead.spacetime_index import PredictedObstacles
from slalom.navigator import Navigator
from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.state import State
from slalom.tolerances import COMMITTED_SLACK, CONTACT_SLACK, JUMP
from slalom.trajectory import Stationary

MARGIN_SHARES = (1.0, 0.5, 0.25, 0.0)
"""[1] Shares of the margin that are tried in turn."""
TABLE_HORIZONS = 2.0
"""[1] Timetables are made for so many times the foresight, so that they serve for many decisions."""


@dataclass(frozen=True, eq=False)
class SequenceDecision(Decision):
    """A decision for a whole sequence of accelerations.

    Attributes:
        search: what it came from. better: the search for an earlier arrival, which the next decision goes on with.
        arrival: absolute time [s] at which the sequence is at the goal; inf if it ends before.
        cut: whether the budget ended the search, not the search itself.
    """

    search: Search = field(kw_only=True)
    better: Search | None = None
    arrival: float = np.inf
    cut: bool = False


class _Scene(NamedTuple):
    """What a decision is made from."""

    state: State
    goal: Goal
    now: float
    obstacles: Sequence[Obstacle]
    prediction: PredictedObstacles
    previous: SequenceDecision | None


@dataclass(frozen=True)
class LookAhead:
    """A robot that decides by a search over sequences: accelerate now, then otherwise, then otherwise again.

    Sequences are grown best first, each step by the exact choice for several wishes (`kernels/ahead.py`). The best
    that arrives is gone on with until another arrives earlier by the navigator's `patience`, or until what is foreseen
    has changed so that it collides. To wait for a gap, to pass behind and to arrive in time come out of that. Where no
    sequence that arrives is known yet, the most promising is begun, and the search goes on at the next decision as
    long as nothing that is foreseen has changed; where there is none at all, the navigator decides.

    Safety: a sequence keeps the margin, or the largest share of it that it can, at all times until it ends, as long as
    the forecasts hold; a robot that passes its goal is not looked at beyond. Plain limits only: a largest speed and
    acceleration.

    Attributes:
        navigator: the method, whose forecast counts, the shape, the limits, period, margin, patience; and what decides
            where there is nothing to go on with.
        ahead: [s] how far ahead is looked. deadline: absolute time [s]; later arrivals do not count.
        budget: [us] of work in one decision, counted and not measured, so that results do not depend on the machine;
            a search that it ends goes on with the next decision. improving: [us] once an arrival is known.
        prepared: see `preparing`.
    """

    navigator: Navigator
    time_horizon: float = 60.0
    deadline: float = np.inf
    budget: float = 10000.0
    improvement_budget: float = 500.0
    prepared: PredictedObstacles | None = None

    def __post_init__(self) -> None:
        positive(self.time_horizon, "time_horizon")
        positive(self.budget, "budget")
        not_negative(self.improvement_budget, "improving")
        limits = self.navigator.limits
        if limits.bounds or limits.velocity_bounds or limits.acceleration_bounds:
            raise InvalidInput("limits: expected no more than a largest speed and acceleration, found further bounds")

    def decide(
        self,
        state: State,
        obstacles: Sequence[Obstacle],
        goal: Goal,
        *,
        now: float = 0.0,
        previous: Decision | None = None,
    ) -> Decision:
        """As `Navigator.decide`.

        Args:
            obstacles: the same sequence at every decision spares the work of arranging it again.

        Raises:
            InvalidInput: dimensions that differ, a goal that moves.
        """
        if not isinstance(goal.trajectory, Stationary):
            raise InvalidInput("goal: expected one at rest to look ahead, found one that moves")
        if goal.trajectory.dimension != state.dimension:
            raise InvalidInput(
                f"goal: expected dimension {state.dimension} as of the state, found {goal.trajectory.dimension}"
            )
        before = previous if isinstance(previous, SequenceDecision) else None
        table = self._prediction(obstacles, now, self.prepared if before is None else before.search.obstacles)
        scene = _Scene(state, goal, now, obstacles, table, before)
        planned = self._keep_or_improve(scene) or self._plan(scene)
        return planned or self.navigator.decide(state, obstacles, goal, now=now, previous=previous)

    def _prediction(
        self, obstacles: Sequence[Obstacle], now: float, known: PredictedObstacles | None
    ) -> PredictedObstacles:
        """What is foreseen now: the table of the decision before, if that still holds and reaches far enough."""
        n = self.navigator
        latest = max(self._deadline(now), now + n.period)
        if known is not None and known.covers(obstacles, now, latest):
            return known
        forecast, step = n.method.forecast, n.limits.max_speed / n.limits.max_acceleration
        if isinstance(forecast, EXACT):
            end = max(min(self.deadline, now + TABLE_HORIZONS * self.time_horizon), latest)
            return PredictedObstacles.of(
                obstacles, obstacles, n.robot, now, end, step, includes_future=forecast.includes_future
            )
        seen = [predicted(obstacle, forecast, now) for obstacle in obstacles if obstacle.exists(now)]
        return PredictedObstacles.of(None, seen, n.robot, now, latest, step)

    def prepared_for(self, obstacles: Sequence[Obstacle], now: float) -> "LookAhead":
        """One that has arranged these very obstacles already, as is else done in its first decision."""
        return replace(self, prepared=self._prediction(obstacles, now, None))

    def _deadline(self, now: float) -> float:
        return min(self.deadline, now + self.time_horizon)

    def _keep_or_improve(self, scene: _Scene) -> SequenceDecision | None:
        """What was decided before, or what is better by the navigator's patience; None if it is not to be kept."""
        before, now = scene.previous, scene.now
        if before is None or now >= before.search.end_time - 1e-6 * self.navigator.period:
            return None
        search, motion = before.search, before.manoeuvre
        off = float(np.abs(motion.position(now) - scene.state.position).max())
        off = max(off, float(np.abs(motion.velocity(now) - scene.state.velocity).max()))
        same = search.obstacles is scene.prediction and scene.prediction.includes_future and off <= COMMITTED_SLACK
        if off > JUMP or not (same or self._remains_clear(scene, before)):
            return None
        if not search.complete:
            return self._continue_search(scene, search) if same else None
        better = self._improved(scene, before, same)
        if better.complete and better.arrival <= before.arrival - self.navigator.patience:
            return self._decision(scene, better, self._outcome(scene, better))
        return replace(before, outcome=Outcome.KEPT, better=better if same else None)

    def _outcome(self, scene: _Scene, search: Search) -> Outcome:
        """What a sequence is that was found on the way: one that keeps less of the margin than it could is squeezed."""
        gap = scene.prediction.clearance(scene.state.position, scene.now) - CONTACT_SLACK
        whole = search.problem.margin >= min(self.navigator.margin, gap) - COMMITTED_SLACK
        return Outcome.CONSTRAINED if whole else Outcome.SQUEEZED

    def _continue_search(self, scene: _Scene, search: Search) -> SequenceDecision | None:
        """What comes of more of a search that has not found an arrival yet."""
        found = search.resumed(scene.now, self.budget, self.improvement_budget)
        if found.complete:
            return self._decision(scene, found, self._outcome(scene, found))
        found = found.with_stop(scene.now, self.navigator.horizon)
        return self._decision(scene, found, Outcome.BEGUN) if found.node >= 0 else None

    def _improved(self, scene: _Scene, before: SequenceDecision, same: bool) -> Search:
        """A little more of the search for what arrives earlier; begun again where it can not be gone on with."""
        latest = before.arrival - self.navigator.patience
        if not same:
            return self._search(scene, before.search.problem.margin, self.improvement_budget, SCALES[:1], latest)[0]
        better = before.better
        if better is None or not better.starts_after(scene.now):
            better = before.search.refined(scene.state, scene.now, SCALES[-1], latest)
        return better.extended(better.root, self.improvement_budget, 0.0)[0]

    def _remains_clear(self, scene: _Scene, before: SequenceDecision) -> bool:
        """Whether the rest of what was decided before meets nothing that is foreseen now."""
        gap = scene.prediction.clearance(scene.state.position, scene.now) - CONTACT_SLACK
        margin = min(before.search.problem.margin, gap)
        return margin >= 0.0 and before.search.is_clear(
            scene.state, scene.now, scene.prediction, margin - COMMITTED_SLACK
        )

    def _plan(self, scene: _Scene) -> SequenceDecision | None:
        """A new sequence, with as much of the margin as can be kept; None if there is none."""
        gap = scene.prediction.clearance(scene.state.position, scene.now) - CONTACT_SLACK
        if gap < 0.0:
            return None
        start, budget = None, self.budget
        for share in MARGIN_SHARES if self.navigator.margin > 0.0 else MARGIN_SHARES[:1]:
            margin = min(gap, share * self.navigator.margin)
            found, spent = self._search(scene, margin, budget, SCALES)
            budget -= spent
            if found.complete:
                outcome = Outcome.CLEAR if found.direct else Outcome.CONSTRAINED
                return self._decision(scene, found, outcome if share == 1.0 else Outcome.SQUEEZED)
            if start is None:
                stopped = found.with_stop(scene.now, self.navigator.horizon)
                start = stopped if stopped.node >= 0 else None
            if found.cut or budget <= 0.0:
                break
        return None if start is None else self._decision(scene, start, Outcome.BEGUN)

    def _search(
        self, scene: _Scene, margin: float, budget: float, scales: Sequence[float], latest: float = np.inf
    ) -> tuple[Search, float]:
        """A new search for arrivals until `latest` [s], and what it took [us]."""
        n = self.navigator
        searches = [
            new_search(
                scene.state,
                scene.goal,
                n.limits,
                scene.prediction,
                now=scene.now,
                period=n.period,
                deadline=min(latest, self._deadline(scene.now)),
                margin=margin,
                scale=scale,
            )
            for scale in scales
        ]
        return run_searches(searches, budget, min(self.improvement_budget, budget))

    def _decision(self, scene: _Scene, search: Search, outcome: Outcome) -> SequenceDecision:
        motion = search.manoeuvre(scene.state, scene.now)
        forecast, now, horizon = self.navigator.method.forecast, scene.now, self.navigator.horizon
        there = [o for o in scene.obstacles if forecast.includes_future or o.exists(now)]
        traffic = ObstacleTable([predicted(o, forecast, now) for o in there], now, horizon)
        blocked = ControlObstacle(motion.response, scene.state, traffic, self.navigator.robot, search.problem.margin)
        return SequenceDecision(
            motion,
            outcome,
            motion.control,
            blocked,
            search=search,
            arrival=search.arrival,
            cut=search.cut,
        )
