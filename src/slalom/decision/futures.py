"""Obstacles with several futures: which of them a decision avoids, and which it gives up."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final, NamedTuple, TypeVar

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.decision.decision import Decision, Outcome
from slalom.decision.settings import Risk, Settings
from slalom.kernels.arrays import Flags
from slalom.model.goal import Goal
from slalom.model.state import State
from slalom.obstacle.obstacle import Obstacle

PROBABILITY_SLACK: Final = 1e-9
"""[1] By how much the probabilities of the futures of one obstacle may exceed 1 together.

Larger: wrong weights pass. Smaller: rounding of right ones is refused.
"""


D = TypeVar("D", bound=Decision)


class Level(NamedTuple):
    """Futures that a decision gives up: all those up to some probability, except the most probable of each obstacle."""

    given_up: Flags  # (n,)
    probability: float  # upper bound of the probability that one of them comes true
    largest: float  # probability of the most probable of them; 0 without any


def levels(obstacles: Sequence[Obstacle]) -> list[Level]:
    """The levels by increasing probability; the first one gives up nothing.

    Futures of equal probability are given up together, so that their order does not matter. The most probable future
    of an obstacle is kept, which may be that there is none. The probability is the sum over all obstacles: by Boole's
    inequality it bounds that of any of the futures, however they depend on each other.

    Raises:
        InvalidInput: futures of one obstacle with probabilities of more than 1 together.
    """
    weights = np.array([obstacle.probability for obstacle in obstacles], dtype=np.float64)
    may_go = weights < 1.0
    owners: dict[str, list[int]] = {}
    for k in np.flatnonzero(may_go).tolist():
        owners.setdefault(obstacles[k].owner or obstacles[k].name, []).append(k)
    for owner, numbers in owners.items():
        total, largest = _sum(weights[numbers]), float(weights[numbers].max())
        if total > 1.0 + PROBABILITY_SLACK:
            raise InvalidInput(
                f"obstacle {owner!r}: expected futures with probabilities of at most 1 together, found {total:g}"
            )
        if largest > 1.0 - total:
            may_go[[k for k in numbers if weights[k] == largest]] = False
    steps = np.unique(weights[may_go])
    found = [Level(np.zeros(len(weights), np.bool_), 0.0, 0.0)]
    for step in steps.tolist():
        given_up = may_go & (weights <= step)
        found.append(Level(given_up, min(1.0, _sum(weights[given_up])), step))
    return found


def _sum(weights: Array) -> float:
    """The sum in the order of size, so that it does not depend on the order of the obstacles."""
    return float(np.sort(weights).sum())


def least_given_up(
    given: Sequence[Level], decide: Callable[[Level], D], risk: Risk, time_of: Callable[[D], float]
) -> D:
    """The decision that gives up the least, or the one of least expected time.

    With an infinite loss: the first level with a safe decision, found by bisection; one level gives up whatever those
    before it do, so a decision that is safe at one is safe at the next. Where no level has one: that of the last.
    With a finite loss: of the levels below `likely`, the one of least `time_of` and `loss` times the probability.

    Args:
        decide: the decision that avoids all that a level keeps. time_of: the time [s] to the arrival of one.
    """
    made: dict[int, D] = {}

    def at(k: int) -> D:
        if k not in made:
            made[k] = decide(given[k])
        return made[k]

    last = len(given) - 1
    if not at(0).outcome.safe:
        if not at(last).outcome.safe:
            return at(last)
        unsafe, safe = 0, last
        while safe - unsafe > 1:
            middle = (unsafe + safe) // 2
            unsafe, safe = (unsafe, middle) if at(middle).outcome.safe else (middle, safe)
        first = safe
    else:
        first = 0
    best = first
    if risk.loss < np.inf:
        unlikely = max(k for k, level in enumerate(given) if k == 0 or level.largest < risk.likely)
        if unlikely > first:
            best = _cheapest(given, at, risk, time_of, first, unlikely)
    return _stated(at(best), given[best])


def time_of(decision: Decision, robot: Settings, state: State, goal: Goal, now: float) -> float:
    """[s] to the estimated arrival of a robot in `state`; the cost of another objective."""
    situation = robot.situations(state, goal, now)[0]
    until = max(decision.manoeuvre.settled_time(robot.period, robot.horizon), now + robot.period)
    return robot.objective.cost(decision.manoeuvre, situation, until)


def _cheapest(
    given: Sequence[Level], at: Callable[[int], D], risk: Risk, time_of: Callable[[D], float], first: int, last: int
) -> int:
    """The level from `first` to `last` of least cost; the first of equal ones.

    A later level never takes more time. So the levels between two cost at least the time of the later one and the loss
    of the one after the earlier. Where that is no less than the best, they are not examined.
    """

    def cost(k: int) -> float:
        return time_of(at(k)) + risk.loss * given[k].probability

    best = min((first, last), key=cost)
    spans = [(first, last)]
    while spans:
        low, high = spans.pop()
        if high - low < 2 or time_of(at(high)) + risk.loss * given[low + 1].probability >= cost(best):
            continue
        middle = (low + high) // 2
        best = min((best, middle), key=lambda k: (cost(k), k))
        spans += [(middle, high), (low, middle)]
    return best


def _stated(decision: D, level: Level) -> D:
    """The decision with what it gives up."""
    if level.probability == 0.0:
        return decision
    return replace(decision, outcome=Outcome.LIKELY, given_up=level.probability)
