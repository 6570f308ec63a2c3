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
from slalom.tolerances import ADMISSIBLE, COST, KEPT, TOUCHING, WORTH
from slalom.traffic import Traffic


class _Wish(NamedTuple):
    """A response, the control that is preferred, and what it promises: the manoeuvre if nothing is in the way."""

    cost: float
    manoeuvre: Manoeuvre
    preferred: Array
    situation: Situation


class _Proposal(NamedTuple):
    """A safe manoeuvre and what it costs."""

    cost: float
    manoeuvre: Manoeuvre
    outcome: Outcome
    preferred: Array
    blocked: ControlObstacle


class _Scene(NamedTuple):
    """What a decision is made from."""

    situations: list[Situation]
    traffic: Traffic
    margins: Array
    previous: Decision | None


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
        scene = _Scene(situations, traffic, margins, previous)
        best = self._best(scene)
        if isinstance(best, Decision):
            return best
        if best is not None:
            return Decision(best.manoeuvre, best.outcome, best.preferred, best.blocked)
        if previous is not None and self._goes_on(scene, previous):
            return self._on(scene, previous, Outcome.CONTINUED, previous.regret)
        wishes = [preferred_control(self.objective.aims(s)) for s in situations]
        squeezed = [self._propose(s, wish, traffic, 0.0) for s, wish in zip(situations, wishes)]
        softer = min((p for p in squeezed if p is not None), key=lambda p: p.cost, default=None)
        if softer is not None:
            return Decision(softer.manoeuvre, Outcome.SQUEEZED, softer.preferred, softer.blocked)
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

    def _best(self, scene: _Scene) -> _Proposal | Decision | None:
        """The proposal that costs least, if any; or the decision to go on with what the robot is committed to.

        Ways that are turned off the one to the goal are looked at where that is not clear. `kernels/crew.py` does the
        same for many robots.
        """
        worth, previous = WORTH * self.patience + COST, scene.previous
        keep = previous is not None and not self._too_fast(scene.situations[0].state)
        wishes = [self._wish(s, self.objective.aims(s)) for s in scene.situations]
        best: _Proposal | None = None
        clear, turned, failed = False, False, list[Situation]()
        while True:
            lowest = min((w.cost for w in wishes), default=np.inf)
            wish = next((w for w in wishes if w.cost <= lowest + COST), None)
            if wish is not None and best is not None and wish.cost >= best.cost - worth:
                wish = None
            if wish is None and not (clear or turned):
                turned, wishes = True, self._turned([s for s in scene.situations if s not in failed])
                continue
            least = wish or best
            if keep and previous is not None and least is not None:
                regret = self._regret(scene, previous, least)
                if regret <= self.patience:
                    keep = self._goes_on(scene, previous)
                    if keep:
                        return self._on(scene, previous, Outcome.KEPT, regret)
            if wish is None:
                return best
            found = self._propose(wish.situation, wish.preferred, scene.traffic, scene.margins)
            if found is None:
                failed.append(wish.situation)
            elif turned:
                found = found._replace(outcome=Outcome.CONSTRAINED)
            wishes = [w for w in wishes if w is not wish and w.situation not in failed]
            clear = clear or (found is not None and found.outcome is Outcome.CLEAR)
            if found is not None and (best is None or found.cost < best.cost - COST):
                best = found

    def _wish(self, s: Situation, aims: tuple[Aim, ...]) -> _Wish:
        """What a response is asked for, and what it costs if nobody is in the way, on it or after it."""
        preferred = preferred_control(aims)
        manoeuvre = Manoeuvre(s.response, s.state, s.admissible.toward(preferred), s.now)
        return _Wish(self.objective.cost(manoeuvre, s, self.free_again(manoeuvre)), manoeuvre, preferred, s)

    def _turned(self, situations: list[Situation]) -> list[_Wish]:
        """Wishes for ways that are turned off the one to the goal."""
        found = []
        for angle in self.detours:
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            for s in situations:
                wanted = s.goal.desired_velocity(s.state.position, s.state.velocity, s.now, s.limits)
                aim = Aim(s.response.velocity(s.state, s.response.settled(s.horizon)), turn @ wanted)
                found.append(self._wish(s, (aim,)))
        return found

    def _propose(self, s: Situation, preferred: Array, traffic: Traffic, margin: float | Array) -> _Proposal | None:
        """The exact choice for one response, or None when it has no safe control."""
        blocked = self._blocked(s, traffic, margin)
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

    def _regret(self, scene: _Scene, previous: Decision, least: _Wish | _Proposal) -> float:
        """What is lost [s] by keeping the committed manoeuvre, now too, when one could have `least`.

        Both are judged by where they lead until the new one is carried out. The loss of keeping is small at every
        single step, since afterwards one is free to change; it adds up.
        """
        until = self.free_again(least.manoeuvre)
        kept = self._cost(previous.manoeuvre, scene.situations[0], until, scene.traffic)
        return previous.regret + max(0.0, kept - least.cost)

    def _goes_on(self, scene: _Scene, previous: Decision) -> bool:
        """Whether the committed manoeuvre is safe, and the bounds of the robot's turned body still allow it."""
        s, committed = scene.situations[0], previous.manoeuvre
        if self.limits.bounds and not self.limits.allows(
            s.state, committed.mean_acceleration(s.now, self.period), self.period
        ):
            return False
        rest = committed.continuation(s.state, s.now)
        blocked = ControlObstacle(rest, s.state, scene.traffic, self.robot, scene.margins)
        return float(blocked.clearance(np.zeros(s.state.dimension))) >= -KEPT

    def _on(self, scene: _Scene, previous: Decision, outcome: Outcome, regret: float) -> Decision:
        """The decision to go on with the committed manoeuvre."""
        blocked = self._blocked(scene.situations[0], scene.traffic, scene.margins)
        return Decision(previous.manoeuvre, outcome, previous.manoeuvre.control, blocked, regret)
