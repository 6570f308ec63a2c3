"""What the policy leaves open: least impact, rest before a contact, the way out of an overlap, what to give up."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final, NamedTuple, TypeVar

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import REST
from slalom.choice.control_obstacle import ControlObstacle
from slalom.choice.selection import select
from slalom.decision.decision import Decision, Outcome, made
from slalom.decision.objective import NO_OBSTACLES, Situation, cost_of
from slalom.decision.settings import Risk, Settings
from slalom.kernels.arrays import Flags
from slalom.model.goal import Goal
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.shape import Shape
from slalom.model.state import State
from slalom.model.uncertainty import coverage_of, until_of
from slalom.obstacle import Obstacle
from slalom.obstacle.window import SHALLOW_OVERLAP, ObstacleWindow, coverages

DEEPEST: Final = 1.0
"""[m] A robot that gets deeper than this into an obstacle within one period, whatever it does, does not avoid it.
Larger: more choices before such a decision. Smaller: fast obstacles that press a robot push it into others."""

DEEPER_BY: Final = (0.001, 0.004, 0.016, 0.064, 0.256)
"""[m] By how much deeper into all obstacles a robot may get that overlaps some: the first with which it has a control.
More of them: it gets less deep, and such decisions take longer. Larger: bodies that press it may push it through
walls."""


def least_impact(s: Situation, robot: Shape, period: float, obstacle_window: ObstacleWindow) -> Decision:
    """Decision for a collision within this period: match the velocity of the obstacle hit first, see `nearest`."""
    blocked = ControlObstacle(s.response, s.state, obstacle_window, robot)
    times = blocked.times_to_collision(np.zeros(s.state.dimension))
    preferred, outcome = np.zeros(s.state.dimension), Outcome.INADMISSIBLE
    if select(preferred, s.admissible, replace(blocked, obstacles=ObstacleWindow((), s.now, s.horizon))).safe:
        outcome = Outcome.IMPACT
    if np.any(np.isfinite(times)):
        first = int(np.argmin(times))
        other = obstacle_window.obstacle(first).trajectory.velocity(s.now + float(times[first]))
        preferred = s.response.velocity(s.state, period).inverse(other)
    manoeuvre = Manoeuvre(s.response, s.state, nearest(preferred, s, blocked), s.now)
    return Decision(manoeuvre, outcome, preferred, made(blocked))


def escape_velocity(s: Situation, blocked: ControlObstacle) -> Array:
    """Velocity (d,) [m/s] that leaves overlapped obstacles: their mean velocity plus the maximum speed away."""
    overlapped = [blocked.obstacles.obstacle(int(index)).trajectory for index in blocked.overlapping]
    directions = [blocked.escape_direction(int(index)) for index in blocked.overlapping]
    direction = np.mean(directions, axis=0)
    if np.linalg.norm(direction) < 1e-6:
        # Overlaps on opposite sides cancel: leave sideways, where both distances grow.
        axis = np.eye(s.state.dimension)[int(np.argmin(np.abs(directions[0])))]
        direction = axis - (axis @ directions[0]) * directions[0]
    obstacle_velocity = np.mean([trajectory.velocity(s.now) for trajectory in overlapped], axis=0)
    return np.asarray(obstacle_velocity + s.limits.max_speed * direction / np.linalg.norm(direction))


def _least_deepening(s: Situation, period: float, blocked: ControlObstacle) -> Array:
    """How much deeper [m] the robot gets into each obstacle (n,) within this period, whatever it does: 0 for most.

    It is found by doubling, so up to twice as much; infinite for an obstacle that no depth up to DEEPEST frees it from.
    """
    obstacles = blocked.obstacles
    every = np.arange(len(blocked.obstacles))
    coast = np.zeros(s.state.dimension)
    deeper = np.zeros(len(every))
    for index in blocked.overlapping.tolist():
        only = obstacles.without(every != index)
        while deeper[index] < np.inf:
            touched = only.touched_from(s.state.position, deeper)
            alone = ControlObstacle(s.response, s.state, touched, blocked.robot, horizon=period)
            if select(coast, s.admissible, alone).safe:
                break
            deeper[index] = max(2.0 * deeper[index], SHALLOW_OVERLAP)
            if deeper[index] > DEEPEST:
                deeper[index] = np.inf
    return deeper


def way_out(
    s: Situation, period: float, blocked: ControlObstacle, decide: Callable[[ObstacleWindow], Decision | None]
) -> Decision | None:
    """Decision of a robot that overlaps obstacles: no deeper into any if possible, else rather into moving ones.

    decide: makes the decision of the robot among other obstacles, in which it overlaps none; None if it has none.
    """
    obstacles, position = blocked.obstacles, s.state.position
    deeper = _least_deepening(s, period, blocked)
    found = decide(obstacles.touched_from(position, deeper))
    moving = [k for k in blocked.overlapping.tolist() if is_moving(obstacles.obstacle(k), s.now)]
    if moving and (found is None or not found.safe):
        into_moving = deeper.copy()
        into_moving[moving] = np.inf
        others = obstacles.touched_from(position, into_moving)
        if found is None or _too_late_to_stop(found, s, period, replace(blocked, obstacles=others)):
            found = decide(others) or found
    for all_by in DEEPER_BY:
        found = found or decide(obstacles.touched_from(position, deeper, all_by))
    return found


def _too_late_to_stop(decision: Decision, s: Situation, period: float, others: ControlObstacle) -> bool:
    """Whether a decision hits another obstacle before a robot that brakes one period later has stopped."""
    manoeuvre = decision.manoeuvre
    times = replace(others, response=manoeuvre.response).times_to_collision(manoeuvre.control)
    to_stop = float(np.linalg.norm(s.state.velocity)) / s.limits.braking
    return bool(times.min(initial=np.inf) <= period + to_stop)


def is_moving(obstacle: Obstacle, now: float) -> bool:
    """Whether an obstacle moves at `now` [s]."""
    return bool(np.linalg.norm(obstacle.trajectory.velocity(now)) > REST)


def stands(obstacle: Obstacle, now: float) -> bool:
    """Whether an obstacle exists at `now` [s] and does not move then."""
    return obstacle.exists(now) and not is_moving(obstacle, now)


def leave(s: Situation, period: float, velocity: Array, blocked: ControlObstacle) -> Decision:
    """Decision of a robot that overlaps obstacles and cannot avoid others within this period: towards `velocity`."""
    preferred = s.response.velocity(s.state, period).inverse(velocity)
    manoeuvre = Manoeuvre(s.response, s.state, nearest(preferred, s, blocked), s.now)
    return Decision(manoeuvre, Outcome.ESCAPING, preferred, made(blocked))


def stop(s: Situation, robot: Shape, obstacle_window: ObstacleWindow) -> Decision:
    """Decision of a robot that may be touched at rest and must not move into contact: rest, or brake hardest."""
    preferred = s.response.velocity(s.state, s.response.settled(s.horizon)).inverse(np.zeros(s.state.dimension))
    outcome = Outcome.STOPPING if float(np.linalg.norm(s.state.velocity)) <= REST else Outcome.BRAKING
    blocked = ControlObstacle(s.response, s.state, obstacle_window, robot)
    manoeuvre = Manoeuvre(s.response, s.state, nearest(preferred, s, blocked), s.now)
    return Decision(manoeuvre, outcome, preferred, made(blocked))


def nearest(preferred: Array, s: Situation, blocked: ControlObstacle) -> Array:
    """Admissible control (d,) nearest to `preferred` that hits no known obstacle at rest outside of the robot.

    If none is: with no obstacle counted; if none is, the limits' compromise.
    """
    passed = [each.uncertainty is not None or not stands(each, s.now) for each in blocked.obstacles.obstacles]
    at_rest = blocked.obstacles.without(np.array(passed, np.bool_)).without(blocked.overlapping)
    for obstacles in (at_rest, ObstacleWindow((), s.now, s.horizon)):
        choice = select(preferred, s.admissible, replace(blocked, obstacles=obstacles))
        if choice.control is not None:
            return choice.control
    return s.admissible.compromise(preferred)


# Obstacles with several futures: which of them a decision avoids, and which it gives up.


PROBABILITY_SLACK: Final = 1e-9
"""[1] By how much the probabilities of the futures of one obstacle may exceed 1 together. Larger: wrong weights pass.
Smaller: rounding of right ones is refused."""


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


def time_of(
    decision: Decision, robot: Settings, state: State, goal: Goal, now: float, obstacles: ObstacleWindow = NO_OBSTACLES
) -> float:
    """[s] to the estimated arrival of a robot in `state`; the cost of another objective."""
    situation = replace(robot.situations(state, goal, now)[0], obstacles=obstacles)
    until = max(decision.manoeuvre.settled_time(robot.period, robot.horizon), now + robot.period)
    return cost_of(robot.objective, decision.manoeuvre, situation, until)


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


# Sets of a forecast: how much of them a decision keeps.


def among_sets(window: ObstacleWindow, robot: Settings, state: State, decide: Callable[[ObstacleWindow], D]) -> D:
    """The decision among sets one size smaller than those that are stated; where none is safe, among smaller ones.

    What later decisions can correct does not block now. See `stated`.
    """
    shares = window.coverages
    for share in shares[1:] or shares:
        decision = decide(window.covering(share))
        if decision.outcome.safe or decision.outcome is Outcome.LIKELY:
            break
    return decision if share == shares[0] else stated(decision, window.obstacles, share, robot, state, window.start)


def stated(decision: D, obstacles: Sequence[Obstacle], share: float, robot: Settings, state: State, now: float) -> D:
    """A decision that keeps sets of a `share` of the errors: LIKELY unless it keeps the stated ones while they grow."""
    sets = [one for one in obstacles if coverage_of(one.uncertainty) < 1.0]
    if not decision.outcome.safe or share == coverages(one.uncertainty for one in sets)[0]:
        return decision
    window = ObstacleWindow(sets, now, min(max(until_of(one.uncertainty) for one in sets), robot.horizon))
    blocked = ControlObstacle(decision.manoeuvre.continuation(state, now), state, window, robot.robot)
    if not blocked.overlaps and blocked.time_to_collision(np.zeros(state.dimension)) == np.inf:
        return decision
    return replace(decision, outcome=Outcome.LIKELY, given_up=1.0 - share)
