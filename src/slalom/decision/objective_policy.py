"""Decisions for objectives other than `Arrive`: the same policy, with aims and costs of Python objects."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.decision.decision import Decision, Outcome, made
from slalom.goal import Goal
from slalom.manoeuvre import Manoeuvre
from slalom.objective import Situation, preferred_control
from slalom.obstacle.window import ObstacleWindow
from slalom.selection import Status, select, select_clearest
from slalom.state import State
from slalom.tolerances import COMMITTED_SLACK, CONTACT_SLACK, COST_TIE, MIN_IMPROVEMENT

if TYPE_CHECKING:
    from slalom.decision.navigator import Navigator


class Candidate(NamedTuple):
    """Response with its preferred control and its optimistic cost: the cost of the manoeuvre without obstacles."""

    cost: float
    until: float  # [s] absolute time at which the control has settled
    preferred: Array
    situation: Situation


class Proposal(NamedTuple):
    """Safe manoeuvre with its cost."""

    cost: float
    until: float
    manoeuvre: Manoeuvre
    outcome: Outcome
    preferred: Array
    blocked: ControlObstacle


def decide_by_objective(
    robot: "Navigator", obstacles: ObstacleWindow, state: State, goal: Goal, now: float, previous: Decision | None
) -> Decision | None:
    """Decision of a robot in `state`; None for one that overlaps an obstacle or has no safe control.

    Responses are tried in order of optimistic cost until none can beat the best by the share MIN_IMPROVEMENT of the
    shortest response. The committed manoeuvre is kept while it is clear, until its control has been carried out, and
    while that costs at most the share `patience` of the time.
    """
    situations = robot.situations(state, goal, now)
    now_clear = ControlObstacle(situations[0].response, state, obstacles, robot.robot)
    if len(now_clear.overlapping):
        return None
    margins = np.clip(now_clear.initial_clearances - CONTACT_SLACK, 0.0, robot.margin)
    candidates = [_candidate(robot, s) for s in situations]
    may_keep = previous is not None and not robot.is_too_fast(state)
    best: Proposal | None = None
    while True:
        lowest = min((c.cost for c in candidates), default=np.inf)
        candidate = next((c for c in candidates if c.cost <= lowest + COST_TIE), None)
        worth = MIN_IMPROVEMENT * min(s.shortest for s in situations) + COST_TIE
        if candidate is not None and best is not None and candidate.cost >= best.cost - worth:
            candidate = None
        cheapest = candidate or best
        if may_keep and previous is not None and cheapest is not None:
            until = max(previous.manoeuvre.settled_time(robot.period, robot.horizon), cheapest.until)
            kept = robot.objective.cost(previous.manoeuvre, situations[0], until)
            if kept - cheapest.cost <= robot.patience * (until - now) + COST_TIE:
                may_keep, blocked = _committed_is_clear(robot, situations[0], obstacles, margins, previous)
                if may_keep:
                    manoeuvre = previous.manoeuvre
                    return Decision(manoeuvre, Outcome.KEPT, manoeuvre.control, made(blocked))
        if candidate is None:
            break
        candidates = [c for c in candidates if c is not candidate]
        proposal = _propose(robot, candidate, obstacles, margins)
        if proposal is not None and (best is None or proposal.cost < best.cost - COST_TIE):
            best = proposal
    if best is None and previous is not None:
        clear, blocked = _committed_is_clear(robot, situations[0], obstacles, margins, previous)
        if clear:
            manoeuvre = previous.manoeuvre
            return Decision(manoeuvre, Outcome.CONTINUED, manoeuvre.control, made(blocked))
    if best is None:
        squeezed = [_propose(robot, _candidate(robot, s), obstacles, 0.0) for s in situations]
        best = min((p for p in squeezed if p is not None), key=lambda p: p.cost, default=None)
        best = best and best._replace(outcome=Outcome.SQUEEZED)
    return best and Decision(best.manoeuvre, best.outcome, best.preferred, made(best.blocked))


def _candidate(robot: "Navigator", s: Situation) -> Candidate:
    preferred = preferred_control(robot.objective.aims(s))
    manoeuvre = Manoeuvre(s.response, s.state, s.admissible.toward(preferred), s.now)
    until = manoeuvre.settled_time(robot.period, s.horizon)
    return Candidate(robot.objective.cost(manoeuvre, s, until), until, preferred, s)


def _propose(
    robot: "Navigator", candidate: Candidate, obstacles: ObstacleWindow, margin: float | Array
) -> Proposal | None:
    """Exact choice for one response at `margin` [m] (scalar or (n,)); None without a safe control."""
    s = candidate.situation
    blocked = ControlObstacle(s.response, s.state, obstacles, robot.robot, margin)
    enough = robot.objective.enough_clearance
    if enough:
        choice, _ = select_clearest(candidate.preferred, s.admissible, blocked, enough=enough)
    else:
        choice = select(candidate.preferred, s.admissible, blocked)
    if choice.control is None:
        return None
    manoeuvre = Manoeuvre(s.response, s.state, choice.control, s.now)
    outcome = Outcome.CLEAR if choice.status is Status.CLEAR else Outcome.CONSTRAINED
    until = manoeuvre.settled_time(robot.period, s.horizon)
    return Proposal(robot.objective.cost(manoeuvre, s, until), until, manoeuvre, outcome, candidate.preferred, blocked)


def _committed_is_clear(
    robot: "Navigator", s: Situation, obstacles: ObstacleWindow, margins: Array, previous: Decision
) -> tuple[bool, ControlObstacle]:
    """Whether the committed manoeuvre is safe and admissible; and the control obstacle of the first response."""
    committed = previous.manoeuvre
    blocked = ControlObstacle(s.response, s.state, obstacles, robot.robot, margins)
    if not robot.limits.allows(s.state, committed.mean_acceleration(s.now, robot.period), robot.period):
        return False, blocked
    rest = ControlObstacle(committed.continuation(s.state, s.now), s.state, obstacles, robot.robot, margins)
    return float(rest.clearance(np.zeros(s.state.dimension))) >= -COMMITTED_SLACK, blocked
