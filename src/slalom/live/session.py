"""One view of a scenario: its state, and the answers to commands. It is independent of the network."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import MAX_HORIZON, Array, number, positive, vector, vectors, whole
from slalom.base.errors import InvalidInput, SlalomError
from slalom.decision.methods import Method, method as method_of
from slalom.decision.settings import NUMBERS
from slalom.live.control_space import Fields, control_message
from slalom.live.messages import Scene, ended, pack, series
from slalom.live.seen import VIEW_SAMPLES, Knowledge, Seen, decided_again, is_absent, state_at
from slalom.model.goal import Goal
from slalom.model.shape import Polyline, round_shape
from slalom.model.state import State
from slalom.model.trajectory import (
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    PiecewisePolynomial,
    Sampled,
    Stationary,
    Trajectory,
)
from slalom.obstacle import Obstacle
from slalom.obstacle.displaced import moved
from slalom.sim import gallery
from slalom.sim.files.scenario_writer import scenario_text
from slalom.sim.files.scenario_yaml import read_scenario
from slalom.sim.measure.recording import Step
from slalom.sim.run.recorded import Recorded, last_state
from slalom.sim.run.simulate import Run
from slalom.sim.scenario import Robot, Scenario


class Made:
    """A run that is made step by step."""

    def __init__(self, scenario: Scenario, method: Method) -> None:
        self._scenario, self._run = scenario, Run(scenario, method)
        self._making = self._run.steps()
        self._known = Knowledge(scenario, self._run)
        self.complete = False

    @property
    def steps(self) -> list[Step]:
        """The steps so far."""
        return self._run.log.steps

    @property
    def arrived(self) -> Array:
        """Times of arrival (n,) [s] so far."""
        return self._run.log.arrived

    @property
    def end(self) -> Step:
        """The states after the last step."""
        log = self._run.log
        if log.steps:
            return last_state(log.positions, log.velocities)
        here = np.array([robot.state.position for robot in self._scenario.robots])
        return last_state(here, np.zeros_like(here))

    def advance(self, count: int) -> None:
        """Make further steps."""
        for _ in range(0 if self.complete else count):
            if next(self._making, None) is None:
                self.complete = True
                break
            if (len(self.steps) - 1) % self._scenario.steps_per_decision == 0:
                self._known.note()

    def known(self, k: int) -> Knowledge:
        """Return what the robots knew at their decisions so far."""
        return self._known


class Replayed:
    """A recorded run. Its decisions are made again from the recorded states, up to the step asked for."""

    complete = True

    def __init__(self, found: Recorded) -> None:
        self._found = found
        self.steps = found.steps
        self.end = found.end
        self.arrived = found.arrived
        self._making: Iterator[Knowledge] | None = None
        if found.decision is not None:
            self._making = iter([Knowledge(found.scenario, None, found.decision)])
        elif found.method is not None:
            self._making = decided_again(found.scenario, found.method, found.steps, found.seed)
        self._count = 0

    def advance(self, count: int) -> None:
        """All steps are known."""

    def known(self, k: int) -> Knowledge:
        """Return what the robots knew at their decisions in a run with a known method, up to step k or later."""
        assert self._making is not None
        while self._count <= k:
            self._known, self._count = next(self._making), self._count + 1
        return self._known


HANDLES = ("robot", "robot_velocity", "goal", "obstacle", "obstacle_velocity")


def from_step(scenario: Scenario, steps: Sequence[Step], k: int) -> Scenario:
    """Return the scenario that begins with the states of step k of a run.

    Robots that have left are left out. Those that have not appeared yet appear later.
    """
    if k == 0 or not steps:
        return scenario
    now = scenario.start + scenario.dt * k
    robots = list[Robot]()
    for j, robot in enumerate(scenario.robots):
        if not is_absent(scenario, steps, k, j):
            robots.append(replace(robot, state=state_at(steps, k, j), appears=None))
        elif robot.appears is not None and not any(step.outcomes[j] for step in steps[:k]):
            robots.append(replace(robot, appears=max(robot.appears, now + scenario.dt)))
    duration = max(scenario.dt, scenario.start + scenario.duration - now)
    return replace(scenario, robots=tuple(robots), start=now, duration=duration)


def dragged(scenario: Scenario, what: str, index: int, to: npt.ArrayLike) -> Scenario:
    """Return the scenario with a handle moved to a position (d,) [m].

    A velocity handle is where the robot or obstacle would be after one second. An obstacle whose velocity is set moves
    straight from then on.

    Raises:
        InvalidInput: an unknown handle, no such robot or obstacle, a position that is not d numbers.
    """
    target = vector(to, "to", scenario.dimension)
    if what not in HANDLES:
        raise InvalidInput(f"what: expected one of {', '.join(HANDLES)}; found {what!r}")
    listed: Sequence[Any] = scenario.obstacles if what.startswith("obstacle") else scenario.robots
    if whole(index, "index") >= len(listed):
        raise InvalidInput(f"index: expected a number below {len(listed)}, found {index}")
    if what.startswith("obstacle"):
        obstacles = list(scenario.obstacles)
        obstacles[index] = _obstacle(obstacles[index], what, target, scenario.start)
        return replace(scenario, obstacles=tuple(obstacles))
    robots = list(scenario.robots)
    robots[index] = _robot(robots[index], what, target)
    return replace(scenario, robots=tuple(robots))


def _robot(robot: Robot, what: str, target: Array) -> Robot:
    state, goal = robot.state, robot.goal
    if what == "goal":
        return replace(robot, goal=Goal(Stationary(target), goal.tolerance, goal.stop))
    if what == "robot":
        return replace(robot, state=State(target, state.velocity))
    velocity = target - state.position
    size = float(np.linalg.norm(velocity))
    largest = robot.limits.max_speed
    return replace(robot, state=State(state.position, velocity * min(1.0, largest / max(size, largest))))


def _obstacle(obstacle: Obstacle, what: str, target: Array, now: float) -> Obstacle:
    if not obstacle.exists(now):
        raise InvalidInput(f"obstacle {obstacle.name!r}: expected one that exists at {now:g} s, found none then")
    here = obstacle.trajectory.position(now)
    if what == "obstacle":
        return replace(obstacle, trajectory=displaced_by(obstacle.trajectory, target - here))
    velocity = target - here
    if obstacle.turns and isinstance(obstacle.heading, str) and not np.any(velocity):
        x, y = obstacle.direction(now)
        return replace(obstacle, trajectory=Stationary(here), heading=float(np.arctan2(y, x)))
    return replace(obstacle, trajectory=ConstantVelocity(here, velocity, now))


def displaced_by(trajectory: Trajectory, by: Array) -> Trajectory:
    """Return a trajectory displaced `by` (d,) [m], of the same kind where the kind is one of files."""
    places = {
        Stationary: "initial_position",
        ConstantVelocity: "initial_position",
        ConstantAcceleration: "initial_position",
        Circular: "center",
        Sampled: "positions",
    }
    for kind, name in places.items():
        if type(trajectory) is kind:
            found: Trajectory = replace(trajectory, **{name: getattr(trajectory, name) + by})  # type: ignore[type-var]  # a dataclass
            return found
    if isinstance(trajectory, PiecewisePolynomial):
        coefficients = trajectory.coefficients.copy()
        coefficients[:, 0] += by
        return PiecewisePolynomial(trajectory.durations, coefficients, trajectory.start)
    return moved(trajectory, by)


def drawn(scenario: Scenario, what: str, points: npt.ArrayLike, radius: float) -> Scenario:
    """Return the scenario with one more body at rest, drawn through points (n, d) [m].

    An "obstacle" is a disc or ball about the first point, a "wall" a line through all, without thickness. A "robot" of
    this radius stands at the first point, with its goal at the last one; its limits are those of the first robot.

    Raises:
        InvalidInput: another body, points that are not (n, d), too few of them, a radius that is not above 0.
    """
    places = np.atleast_2d(vectors(points, "points"))
    least = {"obstacle": 1, "wall": 2, "robot": 2}
    if what not in least:
        raise InvalidInput(f"what: expected one of {', '.join(least)}; found {what!r}")
    if len(places) < least[what] or places.shape[1] != scenario.dimension:
        wanted = f"({least[what]} or more, {scenario.dimension})"
        raise InvalidInput(f"points: expected {wanted} numbers, found {places.shape}")
    shape = round_shape(positive(radius, "radius"), scenario.dimension)
    if what == "robot":
        first, place = scenario.robots[0], State(places[0], np.zeros(scenario.dimension))
        goal = Goal(Stationary(places[-1]), first.goal.tolerance, first.goal.stop)
        robot = Robot(shape, first.limits, place, goal, _unused(what, [one.name for one in scenario.robots]))
        return replace(scenario, robots=(*scenario.robots, robot))
    still = Stationary(places[0])
    if what == "wall":
        shape, still = Polyline(places), Stationary(np.zeros(scenario.dimension))
    obstacle = Obstacle(shape, still, _unused(what, [one.name for one in scenario.obstacles]))
    return replace(scenario, obstacles=(*scenario.obstacles, obstacle))


def _unused(kind: str, names: Sequence[str]) -> str:
    """The first name of a kind, with a number, that is not among others."""
    return next(name for k in range(len(names), 2 * len(names) + 1) if (name := f"{kind} {k}") not in names)


def led(scenario: Scenario, index: int, points: npt.ArrayLike, speed: float) -> Scenario:
    """Return the scenario with an obstacle that moves along a line of points (n, d) [m] from where it is, and stays.

    Args:
        speed: [m/s].

    Raises:
        InvalidInput: no such obstacle, points that are not (n, d), a line without a length, a speed not above 0.
    """
    if whole(index, "index") >= len(scenario.obstacles):
        raise InvalidInput(f"index: expected a number below {len(scenario.obstacles)}, found {index}")
    obstacle, now = scenario.obstacles[index], scenario.start
    places = np.atleast_2d(vectors(points, "points"))
    if places.shape[1] != scenario.dimension:
        raise InvalidInput(f"points: expected (n, {scenario.dimension}) numbers, found {places.shape}")
    if not obstacle.exists(now):
        raise InvalidInput(f"obstacle {obstacle.name!r}: expected one that exists at {now:g} s, found none then")
    places = np.concatenate([obstacle.trajectory.position(now)[None], places[1:]])
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    places, lengths = places[np.append(True, lengths > 0.0)], lengths[lengths > 0.0]
    if not len(lengths):
        raise InvalidInput("points: expected a line with a length above 0, found one point")
    times = now + np.append(0.0, np.cumsum(lengths)) / positive(speed, "speed")
    # It stays at its end for as long as any horizon of this run sees.
    last = max(times[-1], now + scenario.duration) + MAX_HORIZON
    path = Sampled(np.append(times, last), np.concatenate([places, places[-1:]]), "linear")
    obstacles = list(scenario.obstacles)
    obstacles[index] = replace(obstacle, trajectory=path)
    return replace(scenario, obstacles=tuple(obstacles))


def without(scenario: Scenario, what: str, index: int) -> Scenario:
    """Return the scenario without one obstacle or robot. Raises InvalidInput without such a one, or the last robot."""
    if what not in ("obstacle", "robot"):
        raise InvalidInput(f"what: expected obstacle or robot; found {what!r}")
    obstacles, robots = list(scenario.obstacles), list(scenario.robots)
    listed: list[Any] = obstacles if what == "obstacle" else robots
    if whole(index, "index") >= len(listed):
        raise InvalidInput(f"index: expected a number below {len(listed)}, found {index}")
    del listed[index]
    if not robots:
        raise InvalidInput("robot: expected one that remains in the scene, found the only one")
    return replace(scenario, robots=tuple(robots), obstacles=tuple(obstacles))


def with_setting(scenario: Scenario, name: str, value: float) -> Scenario:
    """Return the scenario with another value of one of NUMBERS. Raises InvalidInput for another name."""
    if name not in NUMBERS:
        raise InvalidInput(f"name: expected one of {', '.join(NUMBERS)}; found {name!r}")
    return scenario.with_settings({name: number(value, name)})


CHUNK: Final = 5
"""[1] Steps of a run in one message."""
MAX_UNDO: Final = 100


class Session:
    """A scenario that runs and can be changed.

    A change at a step makes the states of that step the start of a new scenario. The run is made again from there.

    Attributes:
        scenario, method: what runs. recorded: what is replayed, until a change; None: nothing.
        compared: a second method whose control space is shown beside it; None: none.
        robot: whose control space is shown. response: number of the response that is drawn; -1: the committed one.
    """

    def __init__(self, scenario: Scenario, method: Method, recorded: Recorded | None = None) -> None:
        own = {robot.method for robot in scenario.robots}
        if len(own) == 1 and None not in own:
            # A method that all robots have in their file is the one of the view, which can choose another one.
            scenario = replace(scenario, robots=tuple(replace(robot, method=None) for robot in scenario.robots))
            method = own.pop() or method
        self.scenario = scenario
        self.method = method
        self.recorded = recorded
        self.compared: Method | None = None
        self.robot, self.response = 0, -1
        self._box = Scene(scenario, [] if recorded is None else recorded.steps)
        self._undo: list[tuple[Scenario, Recorded | None, Method, Scene]] = []
        self._gesture: object = None
        self._restored = False
        self._fields = Fields()
        self._begin()

    @classmethod
    def of(cls, recorded: Recorded, otherwise: Method) -> "Session":
        """Return the replay of a recording; `otherwise` decides after a change if its method is not known."""
        return cls(recorded.scenario, recorded.method or otherwise, recorded)

    def _begin(self) -> None:
        """Begin the run of the present scenario, or its replay."""
        self._scene = Scene(self.scenario, box=(self._box.low, self._box.high))
        self.robot = min(self.robot, len(self.scenario.robots) - 1)
        self._played: Made | Replayed = (
            Made(self.scenario, self.method) if self.recorded is None else Replayed(self.recorded)
        )
        self._sent = 0
        self.complete = False

    def opening(self, answers: int = 0) -> list[bytes]:
        """Return the messages that show the scenario at its start."""
        extra = {
            "undo": len(self._undo),
            "compare": None if self.compared is None else self.compared.name,
            "chosen": self.robot,
            "recorded": self.recorded is not None,
            "restored": self._restored,
        }
        name, notes = (self.method.name, ()) if self.recorded is None else (self.recorded.name, self.recorded.notes)
        scene = self._scene.message(name, live=True, notes=notes, extra=extra)
        first = self.more(1)
        return [scene, *first, *self.look(0, answers)]

    def more(self, count: int = CHUNK) -> list[bytes]:
        """Make further steps of the run; return their messages, none after its end. A replay is sent at once."""
        if self.complete:
            return []
        played = self._played
        played.advance(count)
        self.complete = played.complete
        steps, first = played.steps[self._sent :], self._sent
        self._sent = len(played.steps)
        if self.complete:
            steps = [*steps, played.end]
        if not steps:
            return []
        how = ended(self.scenario, played.steps, played.end, played.arrived) if self.complete else None
        frames = self._scene.frames(steps, first, played.arrived, how)
        return [frames, series(self.scenario, steps, self.robot, first)]

    def answer(self, command: Mapping[str, Any]) -> list[bytes]:
        """Return the messages that answer a command; a refused one is answered by its sentence.

        Raises:
            InvalidInput: not a known command.
        """
        name, answers = command.get("do"), command.get("id", 0)
        known = {
            "look": self._look,
            "select": self._select,
            "drag": self._drag,
            "add": self._add,
            "path": self._path,
            "remove": self._remove,
            "new": self._new,
            "method": self._method,
            "compare": self._compare,
            "response": self._response,
            "set": self._set,
            "undo": self._take_back,
            "yaml": self._yaml,
            "restore": self._restore,
        }
        if name not in known:
            raise InvalidInput(f"do: expected one of {', '.join(known)}; found {name!r}")
        try:
            return known[name](command, whole(_given(command, "id") if answers else 0, "id"))
        except SlalomError as error:
            return [pack("error", {"text": str(error)}, {})]

    def look(self, k: int, answers: int = 0) -> list[bytes]:
        """Return the control space of the selected robot at step k."""
        seen = self._seen(k)
        if seen is None:
            return []
        found = [control_message(seen, self._fields, answers)]
        if self.compared is not None:
            other = self._seen_by(self.compared, k)
            found.insert(0, control_message(other, self._fields, 0, slot=1))
        return found

    def _seen(self, k: int) -> Seen | None:
        steps = self._played.steps
        if not steps or (self.recorded is not None and self.recorded.method is None):
            return None
        k = max(0, min(k, len(steps) - 1))
        if self.scenario.robots[self.robot].appears is not None and is_absent(self.scenario, steps, k, self.robot):
            return None
        return self._played.known(k).seen(steps, k, self.robot, self.response)

    def _seen_by(self, method: Method, k: int) -> Seen:
        """The decision that another method would make in the state of step k."""
        k = max(0, min(k, len(self._played.steps) - 1))
        here = from_step(self.scenario, self._played.steps, k)
        made = Made(here, method)
        made.advance(1)
        return made.known(0).seen(made.steps, 0, min(self.robot, len(here.robots) - 1))

    def _look(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        return self.look(_step_of(command), answers)

    def _select(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        robot = whole(_given(command, "robot"), "robot")
        if robot >= len(self.scenario.robots):
            raise InvalidInput(f"robot: expected a number below {len(self.scenario.robots)}, found {robot}")
        self.robot = robot
        return [series(self.scenario, self._played.steps, robot)]

    def _drag(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        what, to = str(_given(command, "what")), _given(command, "to")
        if what == "control":
            return self._probe(_step_of(command), to, answers, whole(command.get("slot", 0), "slot"))
        changed = dragged(self._base(command), what, whole(_given(command, "index"), "index"), to)
        return self._replaced(command, changed, answers)

    def _continues(self, command: Mapping[str, Any]) -> bool:
        """Whether a command goes on with the gesture of the one before: the state before them is restored at once."""
        return command.get("gesture") is not None and command["gesture"] == self._gesture

    def _base(self, command: Mapping[str, Any]) -> Scenario:
        """The scenario from which a change begins."""
        if self._continues(command):
            return self.scenario
        step, steps = _step_of(command), self._played.steps
        return from_step(self.scenario, steps, min(step, len(steps) - 1) if steps else 0)

    def _replaced(self, command: Mapping[str, Any], scenario: Scenario, answers: int) -> list[bytes]:
        """Run another scenario; the one before it can be restored."""
        if not self._continues(command):
            self._remember()
        self._gesture = command.get("gesture")
        self.scenario = scenario
        return self._restarted(answers)

    def _remember(self) -> None:
        """Keep the present scenario or replay for undo; what follows is a run of its own."""
        self._undo = [*self._undo[-MAX_UNDO + 1 :], (self.scenario, self.recorded, self.method, self._box)]
        self.recorded = None

    def _restarted(self, answers: int) -> list[bytes]:
        try:
            self._begin()
            return self.opening(answers)
        except SlalomError as error:
            # The scenario is one that cannot run, such as one whose goal is covered: the one before it stays.
            self.scenario, self.recorded, self.method, self._box = self._undo.pop()
            self._gesture = None
            self._begin()
            raise InvalidInput(str(error)) from error

    def _probe(self, k: int, to: Any, answers: int, slot: int) -> list[bytes]:
        """Message with the path of a control, and with the first obstacle that it hits."""
        seen = self._seen(k)
        if seen is None:
            return []
        seen = self._seen_by(self.compared, k) if slot and self.compared is not None else seen
        control = vector(to, "to", self.scenario.dimension)
        times = seen.times(control)
        first = int(np.argmin(times)) if np.isfinite(times).any() else -1
        inside = bool(seen.admissible.contains(control))
        hits = (
            f"hits {seen.others[first].name} in {times[first]:.2f} s."
            if first >= 0
            else (f"hits nothing within {seen.blocked.horizon:g} s.")
        )
        numbers = ", ".join(f"{x:.2f}" for x in np.round(control, 2) + 0.0).replace("-", "−")
        limits = "" if inside else " It is outside the limits."
        elapsed = np.linspace(0.0, seen.blocked.horizon, VIEW_SAMPLES)
        path = seen.response.position(seen.state, elapsed)(control)
        described = {
            "answers": answers,
            "slot": slot,
            "control": control.tolist(),
            "time": float(times[first]) if first >= 0 else None,
            "first": first,
            "sentence": f"The control ({numbers}) {hits}{limits}",
        }
        return [pack("probe", described, {"path": path.astype(np.float32)})]

    def _add(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        what, points = str(_given(command, "what")), _given(command, "points")
        return self._replaced(command, drawn(self._base(command), what, points, _given(command, "radius")), answers)

    def _path(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        index, points = _given(command, "index"), _given(command, "points")
        return self._replaced(command, led(self._base(command), index, points, _given(command, "speed")), answers)

    def _remove(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        what, index = str(_given(command, "what")), _given(command, "index")
        return self._replaced(command, without(self._base(command), what, index), answers)

    def _new(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        """An empty page: a robot and its goal."""
        scenario = replace(gallery.build("empty"), name="drawing")
        self._remember()
        self._box = Scene(scenario)
        self.scenario, self._gesture = scenario, None
        return self._restarted(answers)

    def _set(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        changed = with_setting(self.scenario, str(_given(command, "name")), _given(command, "value"))
        return self._replaced(command, changed, answers)

    def _method(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        before, recorded = self.method, self.recorded
        chosen = method_of(str(_given(command, "name")))
        if recorded is not None:
            self._remember()
        self.method, self.response = chosen, -1
        try:
            self._begin()
            return self.opening(answers)
        except SlalomError as error:
            self.method = before
            if recorded is not None:
                _, self.recorded, _, _ = self._undo.pop()
            self._begin()
            raise InvalidInput(str(error)) from error

    def _compare(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        name = str(_given(command, "name"))
        compared, step = method_of(name) if name else None, _step_of(command)
        if compared is not None and self._seen(step) is not None:
            self._seen_by(compared, step)  # what it cannot decide is refused before it is shown
        self.compared = compared
        return self.look(step, answers)

    def _response(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        number = _given(command, "number")
        self.response = -1 if number == -1 else whole(number, "number")
        return self.look(_step_of(command), answers)

    def _take_back(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        if not self._undo:
            raise InvalidInput("undo: expected a change before, found none")
        self.scenario, self.recorded, self.method, self._box = self._undo.pop()
        self._gesture = None
        self._begin()
        return self.opening(answers)

    def _yaml(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        # A page that keeps its state asks quietly.
        return [pack("yaml", {"text": self._text(), "quiet": bool(command.get("quiet"))}, {})]

    def _text(self) -> str:
        """The scenario as YAML, with the method of the robots."""
        robots = tuple(replace(robot, method=robot.method or self.method) for robot in self.scenario.robots)
        return scenario_text(replace(self.scenario, robots=robots))

    def _restore(self, command: Mapping[str, Any], answers: int) -> list[bytes]:
        """Take the state that a page kept: scene as YAML, method, second method and robot, each if it is given."""
        scene, compare = command.get("scene"), command.get("compare")
        scenario = self.scenario if scene is None else scenario_of(str(scene))
        found = Session(scenario, self.method)
        # The scene holds a method too; the page may show another one in it.
        chosen = method_of(str(command.get("method", found.method.name)))
        robot = whole(command.get("robot", 0), "robot")
        if scene is not None or chosen != self.method:
            self._remember()
        self.scenario, self.method = found.scenario, chosen
        if scenario.name != self._box.scenario.name:
            self._box = found._box
        self.robot, self.compared = robot, None
        self._restored = True
        messages = self._restarted(answers)
        return messages + (self.answer({"do": "compare", "name": compare, "step": 0}) if compare else [])


def scenario_of(text: str) -> Scenario:
    """Return the scenario of the text of a file. Raises InvalidFile for mistakes."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "scene.yaml"
        file.write_text(text, encoding="utf-8")
        return read_scenario(file)


def _step_of(command: Mapping[str, Any]) -> int:
    """Return the step that a command is about."""
    return whole(_given(command, "step"), "step")


def _given(command: Mapping[str, Any], name: str) -> Any:
    """Return a value of a command. Raises InvalidInput if it is missing."""
    if name not in command:
        raise InvalidInput(f"{name}: expected a value in the command, found none")
    return command[name]
