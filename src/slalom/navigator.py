"""One robot's decision at each step: choose, keep, continue, fall back, escape."""

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
    """A robot that decides with `method`.

    At each decision responses of the method propose their exact choices; the one with the earliest predicted arrival
    wins, unless the committed manoeuvre is safe and keeping it has not yet cost `patience`. They are asked in the order
    of what they promise, if nothing were in the way, and as long as one promises to be better by the share WORTH of
    `patience`. A robot without a safe proposal continues the committed manoeuvre, which was safe when chosen and still
    is as long as the forecasts hold. If they did not hold, it gives up in a stated order: the margin, then the time of
    collision, then the impact speed. See docs/design/0005 and 0011.

    Attributes:
        method: a row of the table of methods. robot: its shape. limits: what it can do.
        period: [s] between decisions. horizon: [s] of foresight. margin: [m] to keep from everything.
        holds: [s] how long accelerations are held.
        patience: [s] of predicted arrival that may be lost by keeping a manoeuvre before it is changed.
        objective: what it wants.
        horizons: a rule for shorter horizons of single obstacles; None: `horizon` for all.
        detours: angles [rad] by which the way to the goal is turned when it is not clear, in the plane; in this order
        where
            equally good. Without any, a robot waits for what stands in its way for ever.
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
        """The decision at time `now` [s] of a robot in `state`, committed to what it decided in `previous`.

        Args:
            obstacles: with their true trajectories; the method's forecast decides what of them is used.

        Raises:
            InvalidInput: dimensions that differ.
        """
        if goal.trajectory.dimension != state.dimension:
            raise InvalidInput(
                f"goal: expected dimension {state.dimension} as of the state, found {goal.trajectory.dimension}"
            )
        traffic = self.predict(obstacles, state, now)
        responses = self.method.responses(self.limits, self.period, self.holds)
        if self._too_fast(state):
            # Held long, a weak push would obey the limit in the end; the speed must come down now.
            soonest = min(response.settled(self.horizon) for response in responses)
            responses = tuple(r for r in responses if r.settled(self.horizon) <= soonest)
        situations = [self._situation(response, state, goal, now) for response in responses]
        bare = ControlObstacle(situations[0].response, state, traffic, self.robot)
        if len(bare.overlapping):
            return escape(situations[0], self.robot, self.period, bare)
        margins = np.clip(bare.initial_clearances - CONTACT_SLACK, 0.0, self.margin)
        scene = DecisionProblem(
            situations, traffic, self.robot, margins, self.margin, self.period, self.objective, self.detours
        )
        best = self._best(scene, previous)
        if isinstance(best, Decision):
            return best
        if best is not None:
            return Decision(best.manoeuvre, best.outcome, best.preferred, best.blocked)
        if previous is not None and self._committed_is_clear(scene, previous):
            return self._continue(scene, previous, Outcome.CONTINUED, previous.regret)
        wishes = [preferred_control(self.objective.aims(s)) for s in situations]
        squeezed = [scene.propose(s, wish, 0.0) for s, wish in zip(situations, wishes)]
        softer = min((p for p in squeezed if p is not None), key=lambda p: p.cost, default=None)
        if softer is not None:
            return Decision(softer.manoeuvre, Outcome.SQUEEZED, softer.preferred, softer.blocked)
        return latest_collision(situations, wishes, self.robot, self.period, traffic)

    def predict(self, obstacles: Sequence[Obstacle], state: State, now: float) -> ObstacleTable:
        """The obstacles as the method's forecast sees them at `now`.

        An obstacle that does not exist yet is seen only by a forecast that foresees.
        """
        forecast = self.method.forecast
        seen = [
            predicted(obstacle, forecast, now) for obstacle in obstacles if forecast.foresees or obstacle.exists(now)
        ]
        if self.horizons is None:
            return ObstacleTable(seen, now, self.horizon)
        each = np.minimum(self.horizons(state, seen, self.limits, now), self.horizon)
        return ObstacleTable(seen, now, self.horizon, each)

    def _situation(self, response: Response, state: State, goal: Goal, now: float) -> Situation:
        admissible = self.limits.admissible(response, state, self.horizon)
        return Situation(response, state, goal, self.limits, admissible, now, self.horizon)

    def _best(self, scene: DecisionProblem, previous: Decision | None) -> Proposal | Decision | None:
        """The proposal that costs least, if any; or the decision to go on with what the robot is committed to.

        Ways that are turned off the one to the goal are looked at where that is not clear. `kernels/crew.py` does the
        same for many robots.
        """
        worth = MIN_IMPROVEMENT * self.patience + COST_TIE
        keep = previous is not None and not self._too_fast(scene.situations[0].state)
        wishes = scene.candidates()
        best: Proposal | None = None
        clear, turned, failed = False, False, list[Situation]()
        while True:
            lowest = min((w.cost for w in wishes), default=np.inf)
            wish = next((w for w in wishes if w.cost <= lowest + COST_TIE), None)
            if wish is not None and best is not None and wish.cost >= best.cost - worth:
                wish = None
            if wish is None and not (clear or turned):
                turned, wishes = True, scene.detour_candidates(failed)
                continue
            least = wish or best
            if keep and previous is not None and least is not None:
                regret = self._regret(scene, previous, least)
                if regret <= self.patience:
                    keep = self._committed_is_clear(scene, previous)
                    if keep:
                        return self._continue(scene, previous, Outcome.KEPT, regret)
            if wish is None:
                return best
            found = scene.propose(wish.situation, wish.preferred, scene.margins)
            if found is None:
                failed.append(wish.situation)
            elif turned:
                found = found._replace(outcome=Outcome.CONSTRAINED)
            wishes = [w for w in wishes if w is not wish and w.situation not in failed]
            clear = clear or (found is not None and found.outcome is Outcome.CLEAR)
            if found is not None and (best is None or found.cost < best.cost - COST_TIE):
                best = found

    def _too_fast(self, state: State) -> bool:
        """Whether the robot exceeds its speed limit by more than rounding."""
        return float(np.linalg.norm(state.velocity)) > self.limits.max_speed * (1.0 + 10.0 * ADMISSIBLE)

    def _regret(self, scene: DecisionProblem, previous: Decision, least: Candidate | Proposal) -> float:
        """What is lost [s] by keeping the committed manoeuvre, now too, when one could have `least`.

        Both are judged by where they lead until the new one is carried out. The loss of keeping is small at every
        single step, since afterwards one is free to change; it adds up.
        """
        until = scene.settled_time(least.manoeuvre)
        kept = scene.cost(previous.manoeuvre, scene.situations[0], until)
        return previous.regret + max(0.0, kept - least.cost)

    def _committed_is_clear(self, scene: DecisionProblem, previous: Decision) -> bool:
        """Whether the committed manoeuvre is safe, and the bounds of the robot's turned body still allow it."""
        s, committed = scene.situations[0], previous.manoeuvre
        if self.limits.bounds and not self.limits.allows(
            s.state, committed.mean_acceleration(s.now, self.period), self.period
        ):
            return False
        rest = committed.continuation(s.state, s.now)
        blocked = ControlObstacle(rest, s.state, scene.traffic, self.robot, scene.margins)
        return float(blocked.clearance(np.zeros(s.state.dimension))) >= -COMMITTED_SLACK

    def _continue(self, scene: DecisionProblem, previous: Decision, outcome: Outcome, regret: float) -> Decision:
        """The decision to go on with the committed manoeuvre."""
        s = scene.situations[0]
        blocked = ControlObstacle(s.response, s.state, scene.traffic, self.robot, scene.margins)
        return Decision(previous.manoeuvre, outcome, previous.manoeuvre.control, blocked, regret)
