"""What one robot decided at one step of a run, and what it saw of all others: the input of the control space."""

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.choice.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome
from slalom.decision.methods import METHODS, Method, margin_among
from slalom.decision.navigator import Navigator
from slalom.lookahead.navigator import SequenceDecision
from slalom.model.goal import Goal
from slalom.model.limits import Admissible, Limits
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path_goal import PathGoal
from slalom.model.response import Response
from slalom.model.response.kinds import AccelerationSequence
from slalom.model.state import State
from slalom.model.trajectory import ConstantAcceleration, Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.periodic import displaced, to_nearest
from slalom.obstacle.predicted import predicted
from slalom.obstacle.window import ObstacleWindow
from slalom.sim.measure.recording import Step
from slalom.sim.run.deciders import SingleRobotDecider
from slalom.sim.run.fleet_decider import FleetDecider
from slalom.sim.run.simulate import by_name
from slalom.sim.run.states import RobotStates
from slalom.sim.scenario import Scenario
from slalom.sim.shape_distance import clearances
from slalom.view.control_space import DrawnControls, drawn_controls, kind, preferred_of, target_of

# ---------------------------------------------------------------------------------------------------------------------
# Targets that guidance gave the robots of a run, made again from its states.


class Targets:
    """Targets of the robots of a scenario, in the order of time; what was made once is kept."""

    def __init__(self, scenario: Scenario) -> None:
        ordered, self._rows = by_name(scenario)
        # Guidance depends on no method and no priority.
        ordered = replace(ordered, robots=tuple(replace(robot, method=None, priority=1.0) for robot in ordered.robots))
        self._scenario, self._states = scenario, RobotStates(ordered)
        self._fleet = FleetDecider(ordered, METHODS["nao"]).fleet
        self._goals = [robot.goal for robot in ordered.robots]
        self._known: list[tuple[Array, Array, Array]] = []

    def goal(self, steps: Sequence[Step], k: int, robot: int) -> Goal:
        """Return what a robot drives to at step k: the target of its latest decision, or its goal."""
        own = self._scenario.robots[robot].goal
        if self._fleet.guidance is None:
            return own
        while len(self._known) <= k:
            self._advance(steps)
        target, tolerance, stop = (values[robot] for values in self._known[k])
        made = k - k % self._scenario.steps_per_decision
        if (target == own.position(self._scenario.start + made * self._scenario.dt)).all():
            return own
        return Goal(Stationary(target), float(tolerance), bool(stop))

    def _advance(self, steps: Sequence[Step]) -> None:
        scenario = self._scenario
        states = self._states
        table, destinations = self._fleet.table, self._fleet.destinations
        each = table.each
        d = self._scenario.dimension
        k = len(self._known)
        step, now = steps[k], scenario.start + k * scenario.dt
        if k:
            # A goal may be passed during a step.
            acceleration = np.zeros_like(states.position)
            acceleration[self._rows, :d] = steps[k - 1].accelerations
            states.integrate(acceleration, scenario.dt)
        states.position[self._rows, :d], states.velocity[self._rows, :d] = step.positions, step.velocities
        states.note_arrivals(now)
        if k % scenario.steps_per_decision:
            self._known.append(self._known[-1])
            return
        each["position"], each["velocity"] = states.position, states.velocity
        each["present"] = states.present
        destinations.set(table, now, goals=self._goals)
        destinations.guide(table, now, joined=np.full(len(each), k == 0))
        rows = self._rows
        self._known.append((each["target"][rows, :d], each["tolerance"][rows], np.array(each["stop"][rows])))


# ---------------------------------------------------------------------------------------------------------------------
# Obstacles and other robots of a run as one robot predicts them, and the record of each in the log of the run.


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


def state_at(steps: Sequence[Step], k: int, robot: int) -> State:
    """Return the state of a robot at step k; its acceleration is the one applied before."""
    before = steps[k - 1].accelerations[robot] if k else np.zeros_like(steps[k].positions[robot])
    return State(steps[k].positions[robot], steps[k].velocities[robot], before)


def committed(scenario: Scenario, steps: Sequence[Step], k: int, robot: int) -> Manoeuvre | None:
    """Return the manoeuvre to which a robot is committed after step k; None if the log does not determine it."""
    begin = next((j for j in range(k, -1, -1) if steps[j].outcomes[robot] not in OLD), None)
    if begin is None:
        return None
    response, control = steps[begin].responses[robot], steps[begin].controls[robot]
    if isinstance(response, str) or not np.isfinite(control).all():
        return None
    return Manoeuvre(response, state_at(steps, begin, robot), control, scenario.start + scenario.dt * begin)


def last_outcome(steps: Sequence[Step], k: int, robot: int) -> str:
    """Return the outcome of the last decision up to step k; "" if there is none."""
    return next((steps[j].outcomes[robot] for j in range(k, -1, -1) if steps[j].outcomes[robot]), "")


def obstacles_of(scenario: Scenario, method: Method, state: State, now: float, robot: int = 0) -> tuple[Other, ...]:
    """Return the obstacles as a robot predicts them; in a periodic world the image that is nearest now."""
    margin = scenario.margin_of(robot)
    forecast = method.forecast
    found = []
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


# ---------------------------------------------------------------------------------------------------------------------
# Robots near enough to count in a picture of the control space: the others cannot be met by a drawn control.


VIEW_SAMPLES: Final = 33
"""[1] Times at which a view samples predicted paths over the horizon.

Larger: smoother curves and larger files. Smaller: corners become visible in curved paths.
"""

VIEW_PREDICTED: Final = 60
"""[1] Most obstacles and robots whose predicted paths a view shows, the nearest ones.

Larger: larger files and slower drawing. Smaller: fewer predicted paths in crowds; the control obstacle counts all.
"""


def half_side(response: Any, limits: Limits, admissible: Admissible) -> float:
    """Return half of the side of the drawn square around 0, in the unit of the control."""
    known = {"acceleration": 1.25 * limits.max_acceleration, "velocity": 1.12 * limits.max_speed}
    return known.get(kind(response).name, 1.12 * admissible.largest)


def reach(response: Response, state: State, limits: Limits, horizon: float, largest: float) -> float:
    """Return a bound [m] of how far a robot moves within the horizon [s] under controls of this size, or committed."""
    times = np.linspace(0.0, horizon, VIEW_SAMPLES)
    image = response.position(state, times)
    drift = float(np.linalg.norm(image.drift - state.position, axis=1).max())
    between = limits.max_speed * horizon / (VIEW_SAMPLES - 1)
    return max(drift + float(np.abs(image.gain).max()) * largest, limits.max_speed * horizon) + between


def near(others: tuple[Other, ...], state: State, radius: float, own: float, now: float) -> tuple[Other, ...]:
    """Return those others whose predicted motion can come into contact with a robot that moves at most `own` [m].

    All of them where there are few: their predicted paths are drawn as well.
    """
    if len(others) <= VIEW_PREDICTED:
        return others
    kept = []
    for other in others:
        if np.isfinite(other.reach):
            away = float(np.linalg.norm(other.obstacle.trajectory.position(now) - state.position))
            if away > own + other.reach + radius + other.obstacle.shape.bounding_radius + other.margin:
                continue
        kept.append(other)
    return tuple(kept)


# ---------------------------------------------------------------------------------------------------------------------
# What one robot decided at one step of a run, and what it saw of all others: the input of the control space.


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
    navigator = scenario.navigator(own, robot)
    now = scenario.start + scenario.dt * k
    state = state_at(steps, k, robot)
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


# ---------------------------------------------------------------------------------------------------------------------
# Sentences that say why a robot chose its manoeuvre, and the obstacles that decided it.


VIEW_BINDING: Final = 0.02
"""[m] A chosen manoeuvre is said to pass an obstacle closely up to this clearance beyond the margin.

Larger: more obstacles are named as reasons of a choice. Smaller: one that limits the choice may be left out.
"""

VIEW_APPROACH_SAMPLES: Final = 241
"""[1] Times at which the closest approach of a manoeuvre to an obstacle is sought, for a sentence of a view.

Larger: a more exact time in the sentence. Smaller: a less exact one.
"""


class Meeting(NamedTuple):
    """The closest approach of a manoeuvre to an obstacle."""

    other: int  # row of `Seen.others`
    time: float  # [s] after the decision
    clearance: float  # [m] between the surfaces


class Reasons(NamedTuple):
    """Why a robot chose its manoeuvre.

    Attributes:
        sentences: for the user. contact_times: (n,) [s] of contact with each other under the preferred control.
        first: row of the first one that it hits; -1 if it hits none. binding: those that the manoeuvre passes closely.
    """

    sentences: tuple[str, ...]
    contact_times: Array
    first: int
    binding: tuple[Meeting, ...]


def reasons(seen: Seen) -> Reasons:
    """Return the reasons of a decision, in the control space that is drawn."""
    quantity, preferred = kind(seen.response), seen.controls.preferred
    times = seen.blocked.times_to_collision(preferred)
    first = int(np.argmin(times)) if np.isfinite(times).any() else -1
    binding = tuple(_binding(seen))
    wanted = f"The preferred {quantity.name} {_numbers(preferred)} {quantity.unit}"
    if first >= 0:
        hit = seen.others[first]
        shared = hit.kind == "robot" and seen.navigator.method.share < 1.0
        # The picture shows the others as predicted; the decision leaves a part of the avoidance to them.
        unless = f" unless {hit.name} takes its share of the avoidance" if shared else ""
        told = f"{wanted} would hit {hit.name} in {times[first]:.1f} s{unless}."
    elif not seen.admissible.contains(preferred):
        told = f"{wanted} hits nothing, but it is outside the limits."
    else:
        told = f"{wanted} hits nothing within {seen.blocked.horizon:g} s."
    sentences = [told]
    if seen.outcome in OLD and seen.manoeuvre is not None and seen.outcome:
        age = seen.time - seen.manoeuvre.start
        sentences.append(f"{Outcome[seen.outcome].value} It is {age:.1f} s old.")
    elif seen.outcome in Outcome.__members__:
        sentences.append(Outcome[seen.outcome].value)
    if binding:
        passed = " and ".join(f"{seen.others[m.other].name} in {m.time:.1f} s" for m in binding[:2])
        least = binding[0].clearance
        closest = f"with {least:.2f} m" if least >= 0.0 else f"and overlaps by {-least:.2f} m"
        sentences.append(f"The manoeuvre passes {passed} {closest}.")
    return Reasons(tuple(sentences), times, first, binding)


def _binding(seen: Seen) -> list[Meeting]:
    """The closest approaches of the manoeuvre that leave little beyond the margin, closest first."""
    if seen.manoeuvre is None or not seen.others:
        return []
    times = seen.time + np.linspace(0.0, seen.blocked.horizon, VIEW_APPROACH_SAMPLES)
    positions = seen.manoeuvre.position(times)
    found = []
    for row, other in enumerate(seen.others):
        meeting = _closest(seen, other, row, times, positions)
        if meeting is not None and meeting.clearance <= other.margin + VIEW_BINDING:
            found.append(meeting)
    return sorted(found, key=lambda meeting: meeting.clearance)


def _closest(seen: Seen, other: Other, row: int, times: Array, positions: Array) -> Meeting | None:
    begin, end = other.obstacle.trajectory.span
    there = (times >= begin) & (times <= end)
    if not there.any():
        return None
    centres = other.obstacle.trajectory.position(times[there])
    away = np.linalg.norm(centres - positions[there], axis=1)
    reach = other.obstacle.shape.bounding_radius + seen.blocked.robot.bounding_radius + other.margin + VIEW_BINDING
    if away.min() > reach:
        return None
    distance = clearances(other.obstacle, seen.blocked.robot, times[there], positions[there])
    k = int(np.argmin(distance))
    return Meeting(row, float(times[there][k] - seen.time), float(distance[k]))


def _numbers(control: Array) -> str:
    return "(" + ", ".join(f"{x:.1f}" for x in np.round(control, 1) + 0.0).replace("-", "−") + ")"
