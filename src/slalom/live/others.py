"""Obstacles and other robots of a run as one robot predicts them, and the record of each in the log of the run."""

import ast
from collections.abc import Hashable, Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from slalom.forecast import predicted
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method, margin_among
from slalom.obstacle import Obstacle
from slalom.obstacle.periodic import displaced, to_nearest
from slalom.response import RESPONSES, Response
from slalom.sim.measure.run_log import Step
from slalom.sim.scenario import Scenario
from slalom.state import State
from slalom.trajectory import ConstantAcceleration

OLD: Final = ("", "KEPT", "CONTINUED", "WAITING")
"""Outcomes of decisions after which the manoeuvre is the same as before."""


class Other(NamedTuple):
    """An obstacle or another robot as a robot predicts it.

    Attributes:
        kind: "obstacle" or "robot". number: in the scenario, from 0. key: equal where the prediction is equal.
        reach: [m] bound of its predicted motion over the horizon; inf: none is known.
    """

    kind: str
    number: int
    obstacle: Obstacle
    margin: float
    key: Hashable
    reach: float = np.inf

    @property
    def name(self) -> str:
        """The name for users."""
        return self.obstacle.name or f"{self.kind} {self.number}"


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


def last_outcome(steps: Sequence[Step], k: int, robot: int) -> str:
    """Return the outcome of the last decision up to step k; "" if there is none."""
    return next((steps[j].outcomes[robot] for j in range(k, -1, -1) if steps[j].outcomes[robot]), "")


def obstacles_of(scenario: Scenario, method: Method, state: State, now: float, robot: int = 0) -> tuple[Other, ...]:
    """Return the obstacles as a robot predicts them; in a periodic world the image that is nearest now."""
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


def robots_of(scenario: Scenario, method: Method, steps: Sequence[Step], k: int, robot: int) -> Iterator[Other]:
    """Return the other robots at step k as a robot predicts them; those that have left are not among them."""
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
        fast, hard = float(np.linalg.norm(state.velocity)), float(np.linalg.norm(state.acceleration))
        bound = other.limits.max_speed if manoeuvre is not None else fast + hard * scenario.horizon
        yield Other("robot", j, obstacle, margin, key, 1.01 * bound * scenario.horizon)


def has_left(scenario: Scenario, steps: Sequence[Step], k: int, robot: int) -> bool:
    """Whether a robot has left the scene before step k, see `RobotStates.present`.

    Its decisions end: no outcome follows until the next decision is due.
    """
    last = k - k % scenario.steps_per_decision
    return not scenario.robots[robot].goal.stop and last > 0 and not steps[last].outcomes[robot]
