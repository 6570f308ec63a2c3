"""What one robot knew and decided at one step of a run: the input of the control space."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple, cast

import numpy as np

from slalom.base.checks import Array
from slalom.choice.control_obstacle import ControlObstacle
from slalom.decision import Decision
from slalom.decision.methods import Method
from slalom.decision.navigator import Navigator
from slalom.fleet.fleet import Fleet
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.bodies import COOPERATION_RANGE
from slalom.kernels.decision.tables import Paths, RobotTable
from slalom.model.goal import Goal
from slalom.model.limits import Admissible, Limits
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path_goal import PathGoal
from slalom.model.response import Response
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.window import Obstacles, ObstacleWindow
from slalom.sim.explanation import (
    DrawnControls,
    Known,
    Met,
    Reasons,
    beginning_of,
    contact_times,
    drawn_controls,
    kind,
    known_at,
    reasons as reasons_of,
    responses_of,
    unchanged,
)
from slalom.sim.measure.recording import Step
from slalom.sim.run.deciders import FleetDecider, SingleRobotDecider
from slalom.sim.run.simulate import Run, by_name
from slalom.sim.scenario import Scenario

# The log of a run.


OLD: Final = ("", "KEPT", "CONTINUED", "INTERRUPTED")
"""Outcomes of decisions after which the manoeuvre is the same as before."""


def state_at(steps: Sequence[Step], k: int, robot: int) -> State:
    """Return the state of a robot at step k; its acceleration is the one applied before."""
    before = steps[k - 1].accelerations[robot] if k else np.zeros_like(steps[k].positions[robot])
    return State(steps[k].positions[robot], steps[k].velocities[robot], before)


def is_absent(scenario: Scenario, steps: Sequence[Step], k: int, robot: int) -> bool:
    """Whether a robot is not in the scene at step k, see `RobotStates.present`.

    It decides from its appearance until it leaves: the decision that was due last has no outcome.
    """
    own, last = scenario.robots[robot], k - k % scenario.steps_per_decision
    may_be = own.appears is not None or (not own.goal.stop and last > 0)
    return may_be and not steps[last].outcomes[robot]


def decided_again(scenario: Scenario, method: Method, steps: Sequence[Step], seed: int = 0) -> Iterator["Knowledge"]:
    """Make the decisions of a run again, from the recorded states; yield what is known after each step."""
    decider, rows = (run := Run(scenario, method, seed=seed)).decider, by_name(scenario)[1]
    states, d = decider.states, scenario.dimension
    found = Knowledge(scenario, run)
    for k, step in enumerate(steps):
        if k:
            # A goal may be passed during a step.
            acceleration = np.zeros_like(states.position)
            acceleration[rows, :d] = steps[k - 1].accelerations
            states.integrate(acceleration, scenario.dt)
        states.position[rows, :d], states.velocity[rows, :d] = step.positions, step.velocities
        now = scenario.start + scenario.dt * k
        states.note_arrivals(now)
        if k % scenario.steps_per_decision == 0:
            for j in np.flatnonzero(np.isinf(states.appeared[rows])).tolist():
                if step.outcomes[j]:
                    states.appear(int(rows[j]), now)
            decider.decide(now)
            found.note()
        yield found


# What a robot knew at a decision: its own values, and those that its fleet holds.


VIEW_SAMPLES: Final = 33
"""[1] Times at which a view samples predicted paths over the horizon. Larger: smoother curves and larger files.
Smaller: corners become visible in curved paths."""

VIEW_PREDICTED: Final = 60
"""[1] Most obstacles and robots whose predicted paths a view shows, the nearest ones. Larger: larger files and slower
drawing. Smaller: fewer predicted paths in crowds; the control obstacle counts all."""


class Other(NamedTuple):
    """An obstacle or another robot as a robot predicts it.

    Attributes:
        kind: "obstacle" or "robot"; "hidden" for what stands for agents that are not seen.
        number: in the scenario, from 0. margin: [m] that the robot keeps.
        share: [1] part of the avoidance that the robot does itself.
    """

    kind: str
    number: int
    obstacle: Obstacle
    margin: float
    share: float = 1.0

    @property
    def name(self) -> str:
        """The name for users."""
        if self.kind == "hidden":
            return "agents that are not seen"
        return self.obstacle.name or f"{self.kind} {self.number}"


Among = tuple[Known, tuple[Other, ...]]
"""What a robot knew at a decision, and the others of its control obstacle."""


class Knowledge:
    """What the robots of a run knew at their decisions so far."""

    def __init__(self, scenario: Scenario, run: Run | None, *made: Decision) -> None:
        self._scenario, self._decider = scenario, None if run is None else run.decider
        self._rows = by_name(scenario)[1].tolist()
        self._single = list[Decision | None](made)
        # Of each decision of a fleet: the table and the obstacles of each row that decided.
        self._tables = list[dict[int, tuple[RobotTable, Obstacles]]]()
        self._new = dict[int, tuple[RobotTable, Obstacles]]()
        if isinstance(self._decider, FleetDecider):
            self._decider.fleet.watch = self._watch

    def _watch(self, order: Indices, table: RobotTable, obstacles: Obstacles) -> None:
        observed = Paths(table.observed.times.copy(), table.observed.points.copy())
        known = RobotTable(table.each.copy(), table.committed, observed), obstacles
        self._new |= dict.fromkeys(order.tolist(), known)

    def note(self) -> None:
        """Note the decision that has just been made."""
        if isinstance(self._decider, SingleRobotDecider):
            self._single.append(self._decider.decision)
        elif isinstance(self._decider, FleetDecider) and not self._tables:
            # Robots that wait for messages decide later.
            decided, fleet = self._new, self._decider.fleet
            self._watch(np.array(self._rows), fleet.table, fleet.obstacles)
            self._new |= decided
        self._tables.append(self._new)
        self._new = {}

    def decision(self, k: int) -> Decision:
        """The decision in force at step k of the only robot, which has appeared."""
        found = self._single[k // self._scenario.steps_per_decision]
        assert found is not None
        return found

    def seen(self, steps: Sequence[Step], k: int, robot: int = 0, number: int = -1) -> "Seen":
        """The decision in force at step k in the control space of response `number`; -1: of the committed manoeuvre.

        That of a kept manoeuvre is the one from which it was chosen: of its own start, and of what was known then.
        """
        every = self._scenario.steps_per_decision
        made = k // every
        if self._single:
            decision = self.decision(k)
            last, first = (alone(self._scenario, known) for known in (known_at(decision), beginning_of(decision)))
            return seen_of(self._scenario, k, robot, decision.outcome.name, last, first, number)
        row, fleet = self._rows[robot], cast(FleetDecider, self._decider).fleet
        decided = [j for j in range(made + 1) if row in self._tables[j]]
        outcomes = {j: steps[every * j].outcomes[robot] for j in decided}
        begun = next((j for j in reversed(decided) if outcomes[j] not in OLD), decided[-1])
        times = self._scenario.start + self._scenario.dt * every * np.arange(made + 1)
        last, first = (
            among(self._scenario, fleet, row, self._tables[j][row], steps[every * j], float(times[j]), robot)
            for j in (decided[-1], begun)
        )
        return seen_of(self._scenario, k, robot, outcomes[decided[-1]], last, first, number)


def alone(scenario: Scenario, known: Known) -> Among:
    """What the only robot of a scenario knew at a decision, and the others in the scenario."""
    window = known.blocked.obstacles
    margins = np.broadcast_to(np.asarray(known.blocked.margin), (len(window),)).tolist()
    numbers = numbers_of(scenario, window.obstacles, known.time)
    return known, tuple(Other(*number, *more) for number, *more in zip(numbers, window.obstacles, margins))


def among(
    scenario: Scenario, fleet: Fleet, row: int, known: tuple[RobotTable, Obstacles], step: Step, now: float, robot: int
) -> Among:
    """What a robot (row) of a fleet knew at its decision `now` [s], as its fleet held it."""
    table, obstacles = known
    members, d = fleet.members, fleet.dimension
    each: Any = table.each[row]
    outcome = step.outcomes[robot]
    state = State(step.positions[robot], step.velocities[robot], each["acceleration"][:d])
    navigator = replace(
        fleet.navigator,
        method=members.methods[row],
        robot=members.shapes[row],
        limits=members.limits[row],
        margin=float(members.margins[row]),
    )
    passive, robots = fleet.known_to(row, table, obstacles, now)
    foreseen = navigator.predict(passive, state, now)
    listed = [*foreseen.obstacles, *robots.values()]
    until = np.append(foreseen.until, np.full(len(robots), navigator.horizon))
    response, manoeuvre = step.responses[robot], None
    if outcome not in OLD and not isinstance(response, str):
        manoeuvre = Manoeuvre(response, state, step.controls[robot], now)
    else:
        response = responses_of(navigator)[0]
    margins = np.append(np.full(len(foreseen), each["margin"]), np.full(len(robots), each["margin_among"]))
    if outcome in ("SQUEEZED", "DELAYED"):
        margins[:] = 0.0
    window = ObstacleWindow(listed, now, navigator.horizon, until)
    blocked = navigator.control_obstacle(response, window, state, margins)
    away = ControlObstacle(response, state, window, navigator.robot).initial_clearances[len(foreseen) :]
    names, shares = [robot.name for robot in scenario.robots], np.ones(len(listed))
    numbers = numbers_of(scenario, foreseen.obstacles, now)
    for j, (k, clearance) in enumerate(zip(robots, away.tolist()), len(foreseen)):
        other: Any = table.each[k]
        numbers.append(("robot", names.index(members.names[k])))
        # No robot relies on another one that is close.
        if clearance > COOPERATION_RANGE * (each["radius"] + other["radius"]):
            own = navigator.method.share * other["priority"]
            shares[j] = own / (own + (1.0 - navigator.method.share) * each["priority"])
    kept = np.asarray(blocked.margin).tolist()
    others = tuple(Other(*number, *more) for number, *more in zip(numbers, listed, kept, shares.tolist()))
    goal: Goal = scenario.robots[robot].goal
    if isinstance(goal, PathGoal) or not (each["final"] and each["moving"]):
        goal = Goal(Stationary(each["target"][:d].copy()), float(each["tolerance"]), bool(each["stop"]))
    return Known(navigator, goal, float(each["max_speed"]), blocked, manoeuvre, None), others


def numbers_of(scenario: Scenario, known: Sequence[Obstacle], now: float) -> list[tuple[str, int]]:
    """Kind and number in the scenario of each obstacle that a robot knows: the nearest of its name and shape."""
    same = dict[tuple[str, int], list[int]]()
    for k, one in enumerate(scenario.obstacles):
        same.setdefault((one.name, id(one.shape)), []).append(k)
    found = []
    for one in known:
        numbers = same.get((one.name, id(one.shape)), [])
        if len(numbers) > 1:
            away = [_place(scenario.obstacles[k], now) - _place(one, now) for k in numbers]
            numbers = [numbers[int(np.argmin(np.linalg.norm(away, axis=1)))]]
        found.append(("obstacle", numbers[0]) if numbers else ("hidden", 0))
    return found


def _place(obstacle: Obstacle, now: float) -> Array:
    return obstacle.trajectory.position(float(np.clip(now, *obstacle.trajectory.span)))


def half_side(response: Any, limits: Limits, admissible: Admissible) -> float:
    """Return half of the side of the drawn square around 0, in the unit of the control."""
    known = {"acceleration": 1.25 * limits.max_acceleration, "velocity": 1.12 * limits.max_speed}
    return known.get(kind(response).name, 1.12 * admissible.largest)


@dataclass(frozen=True, eq=False)
class Seen:
    """A decision with everything that its control space is drawn from.

    Attributes:
        step: of the run. outcome: name of the `Outcome`, "" if none is known.
        age: [s] of the committed manoeuvre. manoeuvre: it; None if none is known.
        target: (d,) [m] where the robot drives instead of to its goal; None: there.
        responses: those that the robot compares. others: of the control obstacle that is drawn.
    """

    step: int
    robot: int
    outcome: str
    age: float
    target: Array | None
    navigator: Navigator
    responses: tuple[Response, ...]
    others: tuple[Other, ...]
    manoeuvre: Manoeuvre | None
    controls: DrawnControls

    @property
    def blocked(self) -> ControlObstacle:
        """The control obstacle that is drawn."""
        return self.controls.blocked

    @property
    def time(self) -> float:
        """Absolute time [s] at which the control space is drawn."""
        return self.blocked.obstacles.start

    @property
    def state(self) -> State:
        """The state of the robot at this time."""
        return self.blocked.state

    @property
    def response(self) -> Response:
        """The response whose control space is drawn."""
        return self.blocked.response

    @property
    def admissible(self) -> Admissible:
        """The admissible controls of that response."""
        return self.controls.admissible

    @property
    def unchanged(self) -> Array:
        """The control (d,) that changes nothing."""
        return unchanged(self.blocked)

    def times(self, controls: Array) -> Array:
        """Time of the first contact for controls (..., d) with each other, see `contact_times`: (..., n) [s]."""
        return contact_times(self.blocked, controls, [other.share for other in self.others])


def reasons(seen: Seen) -> Reasons:
    """Return the reasons of a decision, in the control space that is drawn."""
    others = [Met(other.name, other.obstacle, other.share) for other in seen.others]
    return reasons_of(seen.controls, others, seen.outcome, seen.age)


def seen_of(
    scenario: Scenario, step: int, robot: int, outcome: str, last: Among, first: Among, number: int = -1
) -> Seen:
    """Return the decision `last`, whose manoeuvre began with the decision `first`, in a control space.

    That of the response `number` at the last decision; -1: that of the manoeuvre, from which it was chosen.
    """
    latest, manoeuvre = last[0], first[0].manoeuvre
    responses = responses_of(latest.navigator)
    selected = 0 <= number < len(responses)
    known, others = last if selected else first
    target = latest.goal.position(latest.time)
    moved = (target != scenario.robots[robot].goal.position(latest.time)).any()
    return Seen(
        step,
        robot,
        outcome,
        0.0 if manoeuvre is None else latest.time - manoeuvre.start,
        target if moved else None,
        known.navigator,
        responses,
        others,
        manoeuvre,
        drawn_controls(known, responses[number] if selected else None),
    )
