"""A new sequence of accelerations for a scene, or the decision of the navigator where no sequence is found."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slalom.control_obstacle import ControlObstacle
from slalom.decision.decision import Decision, Outcome, made
from slalom.decision.futures import Level, least_given_up, levels
from slalom.forecast import Known
from slalom.forecast_from_models import FromModels
from slalom.lookahead.scene import Scene, SequenceDecision, rise_of, time_left
from slalom.lookahead.search import Search, Work, new_search, run_searches, step_of
from slalom.obstacle.window import ObstacleWindow
from slalom.response import AccelerateThenCoast
from slalom.state import State
from slalom.tolerances import (
    ANEW_BUDGETS,
    DOUBT_SHARES,
    MARGIN_SHARES,
    SEARCH_SCALES,
    SOONER_RISES,
    SOONER_SHARE,
)


def new_plan(scene: Scene, budget: float, improving: float) -> Decision:
    """Decision for a new sequence, else of the navigator, in the first part of the scene that has a safe one.

    First with all futures of the obstacles, then without the least probable ones. Where the uncertainty is an estimate,
    then with less and less of it. A safe decision is replaced by one with less of it that arrives much earlier.

    Args:
        budget: [us] of work; improving: [us] of work after the first arrival, and the least for each search.
    """
    estimated = isinstance(scene.navigator.method.forecast, FromModels)
    work = Work(budget * (ANEW_BUDGETS if estimated else 1.0), improving)
    given: list[Level] = []
    if all(motion.probability == 1.0 for motion in scene.motions):
        decision = _plan_in(scene, work)
    else:
        given = levels(scene.motions)
        decision = least_given_up(
            given,
            lambda level: _plan_in(scene.without(level.given_up), work),
            scene.navigator.risk,
            lambda one: time_left(one, scene),
        )
    if not estimated:
        return decision
    if decision.outcome.safe or decision.outcome is Outcome.LIKELY:
        return decision if given else _sooner(scene, decision, Work(ANEW_BUDGETS * budget, improving))
    likely = scene.without(given[-1].given_up) if given else scene
    for doubt in DOUBT_SHARES[1:]:
        part = likely.with_doubt(doubt)
        if part is likely:
            break
        decision = _plan_in(part, work)
        if decision.outcome.safe:
            break
    return decision


def _sooner(scene: Scene, decision: Decision, work: Work) -> Decision:
    """A sequence that keeps clear of less of the uncertainty and arrives much earlier; without one, `decision`.

    The radius of an estimate grows with time, and obstacles appear of which nothing is known yet. A robot that plans to
    pass once all others have left may wait until its deadline.
    """
    latest = _arrival(decision) - SOONER_RISES * rise_of(scene.navigator)
    way = float(np.linalg.norm(scene.goal.position(scene.now) - scene.state.position))
    if scene.now + way / scene.navigator.limits.max_speed >= latest:
        return decision
    part = scene.with_doubt(SOONER_SHARE)
    found = None if part is scene else _sequence_in(part, (part.doubt,), work)
    return decision if found is None or found.arrival > latest or found.arrival == np.inf else found


def _arrival(decision: Decision) -> float:
    """[s] inf without a known one."""
    return decision.arrival if isinstance(decision, SequenceDecision) else np.inf


def _plan_in(scene: Scene, work: Work) -> Decision:
    """Decision for a new sequence, else of the navigator, that avoids all motions of a scene."""
    shares = MARGIN_SHARES if scene.doubt == 1.0 else (scene.doubt,)
    return _sequence_in(scene, shares, work) or alone(scene)


def alone(scene: Scene) -> Decision:
    """Decision of the navigator; in a part of the scene it avoids the motions that this predicts."""
    navigator, method = scene.navigator, replace(scene.navigator.method, looks_ahead=False)
    around, whole = scene.given, scene.doubt == 1.0
    if not whole or not all(motion.probability == 1.0 for motion in scene.motions):
        around = [replace(motion, probability=1.0) for motion in scene.motions]
        method = replace(method, forecast=Known())
    without_search = replace(navigator, method=method, margin=scene.doubt * navigator.margin)
    decision = without_search.decide(scene.state, around, scene.goal, now=scene.now, previous=scene.before)
    return decision if whole or not decision.outcome.safe else replace(decision, outcome=Outcome.SQUEEZED)


def rests_clear(scene: Scene, arrival: float) -> bool:
    """Whether a robot that rests at its goal from `arrival` [s] on is collision-free up to the navigator's horizon.

    True for a goal to pass, and for an arrival beyond the horizon.
    """
    left, there = scene.now + scene.navigator.horizon - arrival, [m for m in scene.motions if m.exists(arrival)]
    if not scene.goal.stop or left <= scene.navigator.period or not there:
        return True
    rest, window = State(scene.goal.position(arrival), 0.0 * scene.state.velocity), ObstacleWindow(there, arrival, left)
    blocked = ControlObstacle(AccelerateThenCoast(left), rest, window, scene.navigator.robot)
    return float(blocked.clearance(0.0 * scene.state.velocity)) >= 0.0


def _sequence_in(scene: Scene, shares: Sequence[float], work: Work) -> SequenceDecision | None:
    """Decision for a new sequence with the first of those shares of the margin that has one.

    One that arrives, else one that is only begun.
    """
    clearance, margin = scene.clearance(), scene.navigator.margin
    if clearance < 0.0:
        return None
    start: Search | None = None
    left = work.left
    for share in shares if margin > 0.0 else shares[:1]:
        found, spent = search_in(scene, min(clearance, share * margin), left, work.least, SEARCH_SCALES)
        left -= spent
        work.left = max(left, work.least)
        if found.complete:
            outcome = Outcome.CLEAR if found.direct else Outcome.CONSTRAINED
            whole = share == scene.doubt == 1.0
            return sequence_decision(scene, found, outcome if whole else Outcome.SQUEEZED)
        start = start or _stopped(scene, found)
        if found.cut or left <= 0.0:
            break
    return None if start is None else sequence_decision(scene, start, Outcome.BEGUN)


def _stopped(scene: Scene, search: Search) -> Search | None:
    """The search with a sequence that ends at rest, if it has one."""
    stopped = search.with_stop(scene.now, scene.navigator.horizon)
    return stopped if stopped.node >= 0 else None


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
        doubt=scene.doubt,
    )
