"""What one robot decided at one step of a run, and what it saw of all others: the input of the control space."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from slalom.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome
from slalom.decision.navigator import Navigator
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import Admissible
from slalom.live.near import half_side, near, reach
from slalom.live.others import Other, committed, last_outcome, obstacles_of, robots_of, state_at
from slalom.lookahead.navigator import SequenceDecision
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method
from slalom.obstacle.window import ObstacleWindow
from slalom.path_goal import PathGoal
from slalom.response import Response
from slalom.response.sequence import AccelerationSequence
from slalom.sim.measure.run_log import Step
from slalom.sim.run.deciders import SingleRobotDecider
from slalom.sim.scenario import Scenario
from slalom.state import State
from slalom.view.drawn_controls import DrawnControls, drawn_controls, preferred_of, target_of


@dataclass(frozen=True, eq=False)
class Seen:
    """A decision with everything that its control space is drawn from.

    Attributes:
        time: [s] absolute. step: of the run. outcome: name of the `Outcome`, "" if none is known.
        responses: those that the robot compares. blocked: the control obstacle of the response that is drawn.
        goal: what the robot drives to. progress: [m] along the path to it at the last decision; None if unknown.
        target: where guidance or the path leads next, instead of the goal of the robot; None: that goal.
        manoeuvre: the committed one; None if none is known.
    """

    time: float
    step: int
    robot: int
    state: State
    goal: Goal
    progress: float | None
    target: Goal | None
    navigator: Navigator
    responses: tuple[Response, ...]
    others: tuple[Other, ...]
    outcome: str
    manoeuvre: Manoeuvre | None
    blocked: ControlObstacle
    controls: DrawnControls

    @property
    def response(self) -> Response:
        """The response whose control space is drawn."""
        return self.blocked.response

    @property
    def admissible(self) -> Admissible:
        """The admissible controls of that response."""
        return self.controls.admissible


def seen_alone(scenario: Scenario, method: Method, decision: Decision, step: int, state: State) -> Seen:
    """Return the decision of the only robot of a scenario, as it was made at a step in a state.

    A sequence that is kept has no control space of its own: that of the first response is drawn.
    """
    now = scenario.start + scenario.dt * step
    navigator = scenario.navigator(scenario.robot.method or method)
    made = decision if decision.blocked.obstacles.start == now else None
    margin = scenario.margin_of(0)
    if decision.outcome in (Outcome.SQUEEZED, Outcome.DELAYED):
        margin = 0.0
    if isinstance(decision, SequenceDecision):
        margin = decision.search.problem.margin
    others = tuple(other._replace(margin=margin) for other in obstacles_of(scenario, navigator.method, state, now))
    goal = scenario.robot.goal
    return _seen(
        scenario,
        navigator,
        0,
        goal,
        state,
        step,
        now,
        others,
        decision.outcome.name,
        decision.manoeuvre,
        made,
        progress=decision.progress,
    )


def seen_among(
    scenario: Scenario, method: Method, steps: Sequence[Step], k: int, robot: int, goal: Goal | None = None
) -> Seen:
    """Return the decision of a robot among others at step k, from the log of the run.

    The others are predicted as the method says; those that no drawn control can meet are left out. The robot's share
    of the avoidance is not part of the picture. `goal`: what it drives to; by default its own goal, see `Targets`.
    """
    own = scenario.robots[robot].method or method
    navigator, now, state = scenario.navigator(own, robot), scenario.start + scenario.dt * k, state_at(steps, k, robot)
    others = (*obstacles_of(scenario, own, state, now, robot), *robots_of(scenario, own, steps, k, robot))
    manoeuvre, outcome = committed(scenario, steps, k, robot), last_outcome(steps, k, robot)
    to = scenario.robots[robot].goal if goal is None else goal
    return _seen(scenario, navigator, robot, to, state, k, now, others, outcome, manoeuvre, None)


def with_response(seen: Seen, scenario: Scenario, response: Response) -> Seen:
    """Return the same decision in the control space of another response."""
    return _seen(
        scenario,
        seen.navigator,
        seen.robot,
        seen.goal,
        seen.state,
        seen.step,
        seen.time,
        seen.others,
        seen.outcome,
        seen.manoeuvre,
        None,
        response,
        seen.progress,
    )


def _seen(
    scenario: Scenario,
    navigator: Navigator,
    robot: int,
    goal: Goal,
    state: State,
    step: int,
    now: float,
    others: tuple[Other, ...],
    outcome: str,
    manoeuvre: Manoeuvre | None,
    decision: Decision | None,
    shown: Response | None = None,
    progress: float | None = None,
) -> Seen:
    among = len(scenario.robots) > 1
    method = navigator.method.among_robots() if among else navigator.method
    responses = method.responses(navigator.limits, navigator.period, navigator.holds)
    if decision is not None:
        response = decision.blocked.response
    elif manoeuvre is not None and not isinstance(manoeuvre.response, AccelerationSequence):
        response = shown or manoeuvre.response
    else:
        response = shown or responses[0]
    limits, horizon = navigator.limits, navigator.horizon
    admissible = limits.admissible(response, state, horizon)
    on_path = isinstance(goal, PathGoal)
    around = ObstacleWindow([other.obstacle for other in others] if on_path else (), now, horizon)
    target, max_speed = target_of(goal, navigator, state, around, progress)
    if decision is not None:
        controls = drawn_controls(decision, navigator, goal)
    else:
        situation = navigator.situation(response, state, target, now)
        preferred = preferred_of(navigator, situation, max_speed)
        controls = DrawnControls.of(response, state, admissible, preferred, manoeuvre, now, navigator.period)
    drawn = np.sqrt(state.dimension) * half_side(response, limits, admissible)
    own = reach(response, state, limits, horizon, max(drawn, float(np.linalg.norm(controls.preferred))))
    others = near(others, state, scenario.robots[robot].shape.bounding_radius, own, now)
    window = ObstacleWindow([other.obstacle for other in others], now, horizon)
    blocked = navigator.control_obstacle(response, window, state, np.array([other.margin for other in others]))
    return Seen(
        now,
        step,
        robot,
        state,
        goal,
        progress,
        None if target is scenario.robots[robot].goal else target,
        navigator,
        responses,
        others,
        outcome,
        manoeuvre,
        blocked,
        controls,
    )


def decisions(scenario: Scenario, method: Method, steps: Sequence[Step]) -> Iterator[Decision]:
    """Make the decisions of a run of one robot again, from the recorded states; one for each step.

    Raises:
        InvalidInput: a scenario of several robots.
    """
    if len(scenario.robots) > 1:
        raise InvalidInput(f"scenario: expected one robot, found {len(scenario.robots)}")
    decider = SingleRobotDecider(scenario, method)
    for k in range(len(steps)):
        if k % scenario.steps_per_decision == 0:
            decision = decider.decide_in(state_at(steps, k, 0), scenario.start + scenario.dt * k)
        yield decision
