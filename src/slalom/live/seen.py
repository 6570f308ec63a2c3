"""What one robot decided at one step of a run, and what it saw of all others: the input of the control space."""

import ast
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from slalom.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome
from slalom.decision.navigator import Navigator
from slalom.errors import InvalidInput
from slalom.forecast import predicted
from slalom.goal import Goal
from slalom.limits import Admissible
from slalom.lookahead.navigator import SequenceDecision
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method, margin_among
from slalom.objective import Situation, preferred_control
from slalom.obstacle import Obstacle
from slalom.obstacle.periodic import displaced, to_nearest
from slalom.obstacle.window import ObstacleWindow
from slalom.response import RESPONSES, Response
from slalom.response.sequence import AccelerationSequence
from slalom.sim.measure.run_log import Step
from slalom.sim.run.deciders import SingleRobotDecider
from slalom.sim.scenario import Scenario
from slalom.state import State
from slalom.trajectory import ConstantAcceleration
from slalom.view.drawn_controls import DrawnControls, drawn_controls

OLD: Final = ("", "KEPT", "CONTINUED", "WAITING")
"""Outcomes of decisions after which the manoeuvre is the same as before."""


class Other(NamedTuple):
    """An obstacle or another robot as a robot predicts it.

    Attributes:
        kind: "obstacle" or "robot". number: in the scenario, from 0. key: equal where the prediction is equal.
    """

    kind: str
    number: int
    obstacle: Obstacle
    margin: float
    key: Hashable

    @property
    def name(self) -> str:
        """The name for users."""
        return self.obstacle.name or f"{self.kind} {self.number}"


@dataclass(frozen=True, eq=False)
class Seen:
    """A decision with everything that its control space is drawn from.

    Attributes:
        time: [s] absolute. step: of the run. outcome: name of the `Outcome`, "" if none is known.
        responses: those that the robot compares. blocked: the control obstacle of the response that is drawn.
        manoeuvre: the committed one; None if none is known.
    """

    time: float
    step: int
    robot: int
    state: State
    goal: Goal
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


def response_of(text: str) -> Response | None:
    """Return the response of a text in a recording; None for one that the text does not determine."""
    try:
        call = ast.parse(text, mode="eval").body
    except SyntaxError:
        return None
    kinds = {kind.__name__: kind for kind in RESPONSES}
    if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name) or call.func.id not in kinds:
        return None
    return kinds[call.func.id](**{str(item.arg): ast.literal_eval(item.value) for item in call.keywords})


def state_at(steps: Sequence[Step], k: int, robot: int) -> State:
    """Return the state of a robot at step k; its acceleration is the one applied before."""
    before = steps[k - 1].accelerations[robot] if k else np.zeros_like(steps[k].positions[robot])
    return State(steps[k].positions[robot], steps[k].velocities[robot], before)


def committed(scenario: Scenario, steps: Sequence[Step], k: int, robot: int) -> Manoeuvre | None:
    """Return the manoeuvre to which a robot is committed after step k; None if the log does not determine it."""
    begin = next((j for j in range(k, -1, -1) if steps[j].outcomes[robot] not in OLD), None)
    response = None if begin is None else response_of(steps[begin].responses[robot])
    control = None if begin is None else steps[begin].controls[robot]
    if begin is None or response is None or control is None or not np.isfinite(control).all():
        return None
    return Manoeuvre(response, state_at(steps, begin, robot), control, scenario.start + scenario.dt * begin)


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
    others = tuple(other._replace(margin=margin) for other in _obstacles(scenario, navigator.method, state, now))
    return _seen(scenario, navigator, 0, state, step, now, others, decision.outcome.name, decision.manoeuvre, made)


def seen_among(scenario: Scenario, method: Method, steps: Sequence[Step], k: int, robot: int) -> Seen:
    """Return the decision of a robot among others at step k, from the log of the run.

    The others are predicted as the method says. The robot's share of the avoidance is not part of the picture.
    """
    own = scenario.robots[robot].method or method
    navigator, now, state = scenario.navigator(own, robot), scenario.start + scenario.dt * k, state_at(steps, k, robot)
    others = (*_obstacles(scenario, own, state, now, robot), *_robots(scenario, own, steps, k, robot))
    manoeuvre, outcome = committed(scenario, steps, k, robot), last_outcome(steps, k, robot)
    return _seen(scenario, navigator, robot, state, k, now, others, outcome, manoeuvre, None)


def last_outcome(steps: Sequence[Step], k: int, robot: int) -> str:
    """Return the outcome of the last decision up to step k; "" if there is none."""
    return next((steps[j].outcomes[robot] for j in range(k, -1, -1) if steps[j].outcomes[robot]), "")


def with_response(seen: Seen, scenario: Scenario, response: Response) -> Seen:
    """Return the same decision in the control space of another response."""
    return _seen(
        scenario,
        seen.navigator,
        seen.robot,
        seen.state,
        seen.step,
        seen.time,
        seen.others,
        seen.outcome,
        seen.manoeuvre,
        None,
        response,
    )


def _seen(
    scenario: Scenario,
    navigator: Navigator,
    robot: int,
    state: State,
    step: int,
    now: float,
    others: tuple[Other, ...],
    outcome: str,
    manoeuvre: Manoeuvre | None,
    decision: Decision | None,
    shown: Response | None = None,
) -> Seen:
    goal = scenario.robots[robot].goal
    among = len(scenario.robots) > 1
    method = navigator.method.among_robots() if among else navigator.method
    responses = method.responses(navigator.limits, navigator.period, navigator.holds)
    if decision is not None:
        response = decision.blocked.response
    elif manoeuvre is not None and not isinstance(manoeuvre.response, AccelerationSequence):
        response = shown or manoeuvre.response
    else:
        response = shown or responses[0]
    window = ObstacleWindow([other.obstacle for other in others], now, navigator.horizon)
    blocked = navigator.control_obstacle(response, window, state, np.array([other.margin for other in others]))
    limits, horizon = navigator.limits, navigator.horizon
    if decision is not None:
        controls = drawn_controls(decision, navigator, goal)
    else:
        admissible = limits.admissible(response, state, horizon)
        situation = Situation(response, state, goal, limits, admissible, now, horizon)
        preferred = preferred_control(navigator.objective.aims(situation))
        controls = DrawnControls.of(response, state, admissible, preferred, manoeuvre, now, navigator.period)
    return Seen(now, step, robot, state, goal, navigator, responses, others, outcome, manoeuvre, blocked, controls)


def _obstacles(scenario: Scenario, method: Method, state: State, now: float, robot: int = 0) -> tuple[Other, ...]:
    """The obstacles as a robot predicts them; in a periodic world the image that is nearest now."""
    margin, forecast, found = scenario.margin_of(robot), method.forecast, []
    for index, obstacle in enumerate(scenario.obstacles):
        if not (forecast.includes_future or obstacle.exists(now)):
            continue
        image = _nearest(scenario, obstacle, state, now)
        found.append(Other("obstacle", index, predicted(image, forecast, now), margin, (obstacle, repr(forecast))))
    return tuple(found)


def _nearest(scenario: Scenario, obstacle: Obstacle, state: State, now: float) -> Obstacle:
    if scenario.period is None or not obstacle.exists(now):
        return obstacle
    return displaced(obstacle, to_nearest(obstacle.trajectory.position(now) - state.position, scenario.period))


def _robots(scenario: Scenario, method: Method, steps: Sequence[Step], k: int, robot: int) -> Iterator[Other]:
    now, own = scenario.start + scenario.dt * k, steps[k].positions[robot]
    delay = scenario.dt * scenario.steps_per_decision + scenario.sight_delay
    for j, other in enumerate(scenario.robots):
        state = state_at(steps, k, j)
        if j == robot or has_left(scenario, steps, k, j):
            continue
        manoeuvre = committed(scenario, steps, k, j) if method.shared else None
        key: Hashable
        if manoeuvre is not None:
            obstacle = Obstacle(other.shape, manoeuvre, other.name)
            key = (j, manoeuvre.start, manoeuvre.control.tobytes(), repr(manoeuvre.response))
        else:
            motion = ConstantAcceleration(state.position, state.velocity, state.acceleration, now)
            obstacle = predicted(Obstacle(other.shape, motion, other.name), method.robot_forecast, now)
            key = (j, now, *(x.tobytes() for x in (state.position, state.velocity, state.acceleration)))
        if scenario.period is not None:
            obstacle = displaced(obstacle, to_nearest(state.position - own, scenario.period))
        acceleration = scenario.robots[robot].limits.max_acceleration
        margin = margin_among(method, scenario.margin_of(robot), acceleration, delay, scenario.sight_noise)
        yield Other("robot", j, obstacle, margin, key)


def has_left(scenario: Scenario, steps: Sequence[Step], k: int, robot: int) -> bool:
    """Whether a robot has left the scene before step k, see `RobotStates.present`.

    Its decisions end: no outcome follows until the next decision is due.
    """
    last = k - k % scenario.steps_per_decision
    return not scenario.robots[robot].goal.stop and last > 0 and not steps[last].outcomes[robot]


def decisions(scenario: Scenario, method: Method, steps: Sequence[Step]) -> Iterator[Decision]:
    """Make the decisions of a run of one robot again, from the recorded states; one for each step.

    Raises:
        InvalidInput: a scenario of several robots.
    """
    if len(scenario.robots) > 1:
        raise InvalidInput(f"scenario: expected one robot, found {len(scenario.robots)}")
    decider, d = SingleRobotDecider(scenario, method), scenario.dimension
    for k, step in enumerate(steps):
        if k % scenario.steps_per_decision == 0:
            states, state = decider.states, state_at(steps, k, 0)
            states.position[0, :d], states.velocity[0, :d] = step.positions[0], step.velocities[0]
            states.acceleration[0, :d] = state.acceleration
            decider.decide((0,), scenario.start + scenario.dt * k)
        assert decider.decision is not None
        yield decider.decision
