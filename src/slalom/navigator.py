"""One robot's decision at each step: choose, keep, continue, fall back, escape."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from slalom.checks import Array, has, not_negative, positive
from slalom.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome
from slalom.detour import way_round
from slalom.errors import InvalidInput
from slalom.fallback import delay, escape
from slalom.forecast import foreseen
from slalom.goal import Goal
from slalom.horizon import Horizon
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre
from slalom.methods import HOLDS, Method
from slalom.objective import Aim, Arrive, Objective, Situation, preferred_control
from slalom.obstacle import Obstacle
from slalom.response import Response
from slalom.selection import Status, select, select_clearest
from slalom.shape import Shape
from slalom.state import State
from slalom.tolerances import ADMISSIBLE, KEPT, TOUCHING
from slalom.traffic import Traffic


class _Proposal(NamedTuple):
    """A safe manoeuvre and what it promises."""

    cost: float
    manoeuvre: Manoeuvre
    outcome: Outcome
    preferred: Array
    blocked: ControlObstacle


@dataclass(frozen=True)
class Navigator:
    """A robot that decides with `method`.

    At each decision every response of the method proposes its exact choice; the one with the earliest predicted
    arrival wins, unless the committed manoeuvre is safe and keeping it has not yet cost `patience`. A robot without a
    safe proposal continues the committed manoeuvre, which was safe when chosen and still is as long as the forecasts
    hold. If they did not hold, it gives up in a stated order: the margin, then the time of collision, then the
    impact speed. See docs/design/0005.

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
        traffic = self.foresee(obstacles, state, now)
        responses = self.method.responses(self.limits, self.period, self.holds)
        if self._too_fast(state):
            # Held long, a weak push would obey the limit in the end; the speed must come down now.
            soonest = min(response.settled(self.horizon) for response in responses)
            responses = tuple(r for r in responses if r.settled(self.horizon) <= soonest)
        situations = [self._situation(response, state, goal, now) for response in responses]
        bare = self._blocked(situations[0], traffic, 0.0)
        if len(bare.overlapping):
            return escape(situations[0], self.robot, self.period, bare)
        margins = np.clip(bare.initial_clearances - TOUCHING, 0.0, self.margin)
        proposals = [p for s in situations if (p := self._propose(s, traffic, margins)) is not None]
        if not any(p.outcome is Outcome.CLEAR for p in proposals):
            proposals += self._detours(situations, traffic, margins)
        best = min(proposals, key=lambda p: p.cost, default=None)
        if previous is not None:
            kept = self._continued(previous, situations[0], traffic, margins, best)
            if kept is not None:
                return kept
        if best is not None:
            return Decision(best.manoeuvre, best.outcome, best.preferred, best.blocked)
        squeezed = [p for s in situations if (p := self._propose(s, traffic, 0.0)) is not None]
        if squeezed:
            best = min(squeezed, key=lambda p: p.cost)
            return Decision(best.manoeuvre, Outcome.SQUEEZED, best.preferred, best.blocked)
        wishes = [preferred_control(self.objective.aims(s)) for s in situations]
        return delay(situations, wishes, self.robot, self.period, traffic)

    def foresee(self, obstacles: Sequence[Obstacle], state: State, now: float) -> Traffic:
        """The obstacles as the method's forecast sees them at `now`.

        An obstacle that does not exist yet is seen only by a forecast that foresees.
        """
        forecast = self.method.forecast
        seen = [
            foreseen(obstacle, forecast, now) for obstacle in obstacles if forecast.foresees or obstacle.exists(now)
        ]
        if self.horizons is None:
            return Traffic(seen, now, self.horizon)
        each = np.minimum(self.horizons(state, seen, self.limits, now), self.horizon)
        return Traffic(seen, now, self.horizon, each)

    def _situation(self, response: Response, state: State, goal: Goal, now: float) -> Situation:
        admissible = self.limits.admissible(response, state, self.horizon)
        return Situation(response, state, goal, self.limits, admissible, now, self.horizon)

    def _blocked(self, s: Situation, traffic: Traffic, margin: float | Array) -> ControlObstacle:
        return ControlObstacle(s.response, s.state, traffic, self.robot, margin)

    def _detours(self, situations: list[Situation], traffic: Traffic, margins: Array) -> list[_Proposal]:
        """Proposals for ways that are turned off the one to the goal."""
        found = []
        for angle in self.detours:
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            for s in situations:
                after = s.response.settled(s.horizon)
                wanted = s.goal.desired_velocity(s.state.position, s.state.velocity, s.now, s.limits)
                aims = (Aim(s.response.velocity(s.state, after), turn @ wanted),)
                proposal = self._propose(s, traffic, margins, aims)
                if proposal is not None:
                    found.append(proposal._replace(outcome=Outcome.CONSTRAINED))
        return found

    def _propose(
        self, s: Situation, traffic: Traffic, margin: float | Array, aims: tuple[Aim, ...] | None = None
    ) -> _Proposal | None:
        """The exact choice for one response, or None when it has no safe control."""
        blocked = self._blocked(s, traffic, margin)
        preferred = preferred_control(aims or self.objective.aims(s))
        enough = self.objective.enough_clearance
        if enough:
            choice, _ = select_clearest(preferred, s.admissible, blocked, enough=enough)
        else:
            choice = select(preferred, s.admissible, blocked)
        if choice.control is None:
            return None
        manoeuvre = Manoeuvre(s.response, s.state, choice.control, s.now)
        outcome = Outcome.CLEAR if choice.status is Status.CLEAR else Outcome.CONSTRAINED
        cost = self._cost(manoeuvre, s, self.free_again(manoeuvre), traffic)
        return _Proposal(cost, manoeuvre, outcome, preferred, blocked)

    def _cost(self, motion: Manoeuvre, s: Situation, until: float, traffic: Traffic) -> float:
        """How long the objective takes [s], and with detours how long it takes to go around what will be in the way."""
        cost = self.objective.cost(motion, s, until)
        if self.detours and traffic.obstacles:
            end = traffic.start + traffic.horizon
            # What has several parts, as walls have, is not gone around as a disc.
            there = [o for o in traffic.obstacles if o.exists(end) and len(o.shape.parts) == 1]
            places = np.array([o.trajectory.position(end) for o in there]).reshape(-1, s.state.dimension)
            radii = np.array([o.shape.reach for o in there]) + self.robot.reach + self.margin
            longer = way_round(motion.position(until), s.goal.position(until), places, radii)
            cost += float(longer.sum()) / self.limits.max_speed
        return cost

    def _too_fast(self, state: State) -> bool:
        """Whether the robot exceeds its speed limit by more than rounding."""
        return float(np.linalg.norm(state.velocity)) > self.limits.max_speed * (1.0 + 10.0 * ADMISSIBLE)

    def free_again(self, manoeuvre: Manoeuvre) -> float:
        """When the control of a manoeuvre has been carried out: absolute time [s]."""
        return manoeuvre.start + max(self.period, manoeuvre.response.settled(self.horizon))

    def _continued(
        self, previous: Decision, s: Situation, traffic: Traffic, margins: Array, best: _Proposal | None
    ) -> Decision | None:
        """The committed manoeuvre, if it is safe and either nothing else is or nothing else is better enough.

        Both are judged by where they lead until the new one is carried out. The loss of keeping is small at every
        single step, since afterwards one is free to change; it adds up. A robot above its speed limit keeps nothing;
        none keeps what the bounds of its turned body do not allow.
        """
        committed, regret = previous.manoeuvre, previous.regret
        if best is not None:
            until = self.free_again(best.manoeuvre)
            regret += max(0.0, self._cost(committed, s, until, traffic) - best.cost)
            if regret > self.patience or self._too_fast(s.state):
                return None
        if self.limits.bounds and not self.limits.allows(
            s.state, committed.mean_acceleration(s.now, self.period), self.period
        ):
            # The body has turned and its bounds with it: the rest of the manoeuvre cannot be driven.
            return None
        rest = committed.continuation(s.state, s.now)
        blocked = ControlObstacle(rest, s.state, traffic, self.robot, margins)
        if float(blocked.clearance(np.zeros(s.state.dimension))) < -KEPT:
            return None
        outcome = Outcome.CONTINUED if best is None else Outcome.KEPT
        return Decision(committed, outcome, committed.control, self._blocked(s, traffic, margins), regret)
