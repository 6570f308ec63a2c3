"""Decision of one robot at one step: choose, keep or continue a manoeuvre, fall back, or escape."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from slalom.checks import has, not_negative, positive
from slalom.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome
from slalom.errors import InvalidInput
from slalom.fallback import escape, latest_collision
from slalom.forecast import predicted
from slalom.goal import Goal
from slalom.horizon import Horizon
from slalom.limits import Limits
from slalom.methods import HOLDS, Method
from slalom.objective import Arrive, Objective, Situation, preferred_control
from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.proposals import Candidate, DecisionProblem, Proposal
from slalom.response import Response
from slalom.shape import Shape
from slalom.state import State
from slalom.tolerances import ADMISSIBLE, COMMITTED_SLACK, CONTACT_SLACK, COST_TIE, MIN_IMPROVEMENT


@dataclass(frozen=True)
class Navigator:
    """Robot that decides with `method`.

    At each decision, responses propose their exact choices, and the proposal with the earliest predicted arrival wins.
    The committed manoeuvre is kept while it is safe and keeping it has cost less than `patience`. Responses are tried
    in order of optimistic cost (their cost without obstacles) until none can beat the best by MIN_IMPROVEMENT *
    patience. A robot without a safe proposal continues the committed manoeuvre, which remains safe as long as the
    forecasts hold. If they did not hold, requirements are dropped in this order: the margin, the latest collision, the
    least impact speed. See docs/design/0005 and 0011.

    Attributes:
        method: a row of the table of methods.
        robot: its shape.
        limits: its largest speed and acceleration, and further bounds.
        period: [s] between decisions.
        horizon: [s] up to which collisions count.
        margin: [m] to keep from every obstacle.
        holds: [s] durations for which accelerations are held.
        patience: [s] of predicted arrival that keeping a manoeuvre may cost before it is replaced.
        objective: the quantity to minimise.
        horizons: a rule for shorter horizons of single obstacles; None: `horizon` for all.
        detours: angles [rad] by which the desired velocity is turned if it is not collision-free, in the plane; among
            equal ones the first wins. Without detours, a robot blocked by a permanent obstacle never arrives.
    """

    method: Method
    robot: Shape
    limits: Limits
    period: float = 0.1
    horizon: float = 6.0
    margin: float = 0.05
    holds: tuple[float, ...] = HOLDS
    patience: float = 0.1
    objective: Objective = field(default_factory=Arrive)
    horizons: Horizon | None = None
    detours: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        has(self.method, ("responses", "forecast"), "a method, such as method('nao')", "method")
        has(self.robot, ("parts", "dimension"), "a shape, such as Disc(radius)", "robot")
        positive(self.period, "period")
        positive(self.horizon, "horizon")
        not_negative(self.margin, "margin")
        not_negative(self.patience, "patience")
        if not self.holds:
            raise InvalidInput("holds: expected at least one, found none")

    def decide(
        self,
        state: State,
        obstacles: Sequence[Obstacle],
        goal: Goal,
        *,
        now: float = 0.0,
        previous: Decision | None = None,
    ) -> Decision:
        """Decision at time `now` [s] of a robot in `state` that is committed to the manoeuvre of `previous`.

        Args:
            obstacles: with their true trajectories; the method's forecast determines which part of them is used.

        Raises:
            InvalidInput: dimensions that differ.
        """
        if goal.trajectory.dimension != state.dimension:
            raise InvalidInput(
                f"goal: expected dimension {state.dimension} as of the state, found {goal.trajectory.dimension}"
            )
        table = self.predict(obstacles, state, now)
        responses = self.method.responses(self.limits, self.period, self.holds)
        if self._too_fast(state):
            # A small acceleration held for long would obey the limit only at its end; the speed must fall now.
            shortest = min(response.settled(self.horizon) for response in responses)
            responses = tuple(r for r in responses if r.settled(self.horizon) <= shortest)
        situations = [self._situation(response, state, goal, now) for response in responses]
        overlap_test = ControlObstacle(situations[0].response, state, table, self.robot)
        if len(overlap_test.overlapping):
            return escape(situations[0], self.robot, self.period, overlap_test)
        margins = np.clip(overlap_test.initial_clearances - CONTACT_SLACK, 0.0, self.margin)
        problem = DecisionProblem(
            situations, table, self.robot, margins, self.margin, self.period, self.objective, self.detours
        )
        best = self._best_proposal(problem, previous)
        if isinstance(best, Decision):
            return best
        if best is not None:
            return Decision(best.manoeuvre, best.outcome, best.preferred, best.blocked)
        if previous is not None and self._committed_is_clear(problem, previous):
            return self._continue(problem, previous, Outcome.CONTINUED, previous.regret)
        preferred = [preferred_control(self.objective.aims(s)) for s in situations]
        without_margin = [problem.propose(s, control, 0.0) for s, control in zip(situations, preferred)]
        best_without_margin = min((p for p in without_margin if p is not None), key=lambda p: p.cost, default=None)
        if best_without_margin is not None:
            return Decision(
                best_without_margin.manoeuvre,
                Outcome.SQUEEZED,
                best_without_margin.preferred,
                best_without_margin.blocked,
            )
        return latest_collision(situations, preferred, self.robot, self.period, table)

    def predict(self, obstacles: Sequence[Obstacle], state: State, now: float) -> ObstacleTable:
        """Table of the obstacles on their predicted trajectories from `now` [s] on.

        Obstacles that appear later are included only if the forecast knows them.
        """
        forecast = self.method.forecast
        predictions = [
            predicted(obstacle, forecast, now)
            for obstacle in obstacles
            if forecast.includes_future or obstacle.exists(now)
        ]
        if self.horizons is None:
            return ObstacleTable(predictions, now, self.horizon)
        horizons = np.minimum(self.horizons(state, predictions, self.limits, now), self.horizon)
        return ObstacleTable(predictions, now, self.horizon, horizons)

    def _situation(self, response: Response, state: State, goal: Goal, now: float) -> Situation:
        admissible = self.limits.admissible(response, state, self.horizon)
        return Situation(response, state, goal, self.limits, admissible, now, self.horizon)

    def _best_proposal(self, problem: DecisionProblem, previous: Decision | None) -> Proposal | Decision | None:
        """Cheapest proposal, None without a safe one, or the decision to keep the committed manoeuvre.

        Detours are tried if no proposal towards the goal is collision-free. `kernels/decision/policy.py` implements the
        same policy for many robots.
        """
        min_improvement = MIN_IMPROVEMENT * self.patience + COST_TIE
        may_keep = previous is not None and not self._too_fast(problem.situations[0].state)
        candidates = problem.candidates()
        best: Proposal | None = None
        any_clear, detours_added, failed = False, False, list[Situation]()
        while True:
            lowest_cost = min((c.cost for c in candidates), default=np.inf)
            candidate = next((c for c in candidates if c.cost <= lowest_cost + COST_TIE), None)
            if candidate is not None and best is not None and candidate.cost >= best.cost - min_improvement:
                candidate = None
            if candidate is None and not (any_clear or detours_added):
                detours_added, candidates = True, problem.detour_candidates(failed)
                continue
            cheapest = candidate or best
            if may_keep and previous is not None and cheapest is not None:
                regret = self._regret(problem, previous, cheapest)
                if regret <= self.patience:
                    may_keep = self._committed_is_clear(problem, previous)
                    if may_keep:
                        return self._continue(problem, previous, Outcome.KEPT, regret)
            if candidate is None:
                return best
            proposal = problem.propose(candidate.situation, candidate.preferred, problem.margins)
            if proposal is None:
                failed.append(candidate.situation)
            elif detours_added:
                proposal = proposal._replace(outcome=Outcome.CONSTRAINED)
            candidates = [c for c in candidates if c is not candidate and c.situation not in failed]
            any_clear = any_clear or (proposal is not None and proposal.outcome is Outcome.CLEAR)
            if proposal is not None and (best is None or proposal.cost < best.cost - COST_TIE):
                best = proposal

    def _too_fast(self, state: State) -> bool:
        """Whether the robot exceeds its speed limit by more than rounding."""
        return float(np.linalg.norm(state.velocity)) > self.limits.max_speed * (1.0 + 10.0 * ADMISSIBLE)

    def _regret(self, problem: DecisionProblem, previous: Decision, cheapest: Candidate | Proposal) -> float:
        """Accumulated time [s] lost by keeping the committed manoeuvre instead of `cheapest`.

        Both are evaluated up to the time at which the new manoeuvre settles. The loss of a single step is small,
        because the manoeuvre may change afterwards; the sum is not.
        """
        until = problem.settled_time(cheapest.manoeuvre)
        committed_cost = problem.cost(previous.manoeuvre, problem.situations[0], until)
        return previous.regret + max(0.0, committed_cost - cheapest.cost)

    def _committed_is_clear(self, problem: DecisionProblem, previous: Decision) -> bool:
        """Whether the committed manoeuvre is safe, and still admissible under bounds that turn with the robot."""
        s, committed = problem.situations[0], previous.manoeuvre
        if self.limits.bounds and not self.limits.allows(
            s.state, committed.mean_acceleration(s.now, self.period), self.period
        ):
            return False
        rest = committed.continuation(s.state, s.now)
        blocked = ControlObstacle(rest, s.state, problem.table, self.robot, problem.margins)
        return float(blocked.clearance(np.zeros(s.state.dimension))) >= -COMMITTED_SLACK

    def _continue(self, problem: DecisionProblem, previous: Decision, outcome: Outcome, regret: float) -> Decision:
        """Decision to continue the committed manoeuvre."""
        s = problem.situations[0]
        blocked = ControlObstacle(s.response, s.state, problem.table, self.robot, problem.margins)
        return Decision(previous.manoeuvre, outcome, previous.manoeuvre.control, blocked, regret)
