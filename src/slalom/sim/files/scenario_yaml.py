"""Reader of scenario files in YAML 1.2; all mistakes are reported at once as file:line:column."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError
from ruamel.yaml.nodes import MappingNode, Node

from slalom.base.errors import InvalidFile, InvalidInput
from slalom.base.tolerances import WHOLE_COUNT
from slalom.decision.methods import method
from slalom.fleet.routes import routes
from slalom.io import formats
from slalom.io.recorded import first_of
from slalom.io.walls import Walls, read_walls
from slalom.io.yaml_nodes import MAX_MISTAKES, compose, content_of
from slalom.model.limits import HalfSpace, Limits
from slalom.model.path_goal import PathGoal
from slalom.model.state import State
from slalom.obstacle import Obstacle
from slalom.sim.files.flows import robots_of_flows
from slalom.sim.files.parts import Place, built
from slalom.sim.files.recorded_traffic import AgentSelection, Recorded, read_recorded
from slalom.sim.files.schema import (
    CasesSpec,
    DrawnSpec,
    GroupSpec,
    HalfSpaceSpec,
    ObstacleSpec,
    RecordingSpec,
    RobotSpec,
    ScenarioSpec,
    TableSpec,
    WrittenRobot,
    is_group,
    is_table,
    number_or_text,
    robots_of,
    robots_of_table,
)
from slalom.sim.files.yaml_errors import Mistakes, in_order, messages
from slalom.sim.scenario import SETTINGS, Robot, Scenario, from_numbers, unfit_times, whole_periods

M = TypeVar("M", bound=BaseModel)


def read_scenario(path: Path | str, seed: int = 0) -> Scenario:
    """Return the scenario of a YAML file with a seed, which is added to each `seed` in the file.

    Of a file with `cases` it is the number of the case, from 0. The keys of a case replace those of the file: mappings
    key by key, all other values as a whole.

    Raises:
        InvalidFile: one line `file:line:column: KEY: expected ..., found ...` for each mistake. InvalidInput: no such
            case.
    """
    path = Path(path)
    root, content = _composed(path)
    if not _has_cases(content):
        return _scenario(path, root, _seeded(content, seed))
    cases = _cases(path, root, content)
    if not 0 <= seed < len(cases):
        raise InvalidInput(f"seed: expected 0 to {len(cases) - 1}, the cases of {path}; found {seed}")
    return _case(path, root, cases[seed])


def read_scenarios(path: Path | str) -> list[Scenario]:
    """Return the scenarios of all cases of a YAML file; the only one of a file without.

    Raises:
        InvalidFile: the mistakes of all cases, each once, as `read_scenario`.
    """
    path = Path(path)
    root, content = _composed(path)
    if not _has_cases(content):
        return [_scenario(path, root, content)]
    found: list[Scenario] = []
    mistakes: list[str] = []
    for case in _cases(path, root, content):
        try:
            found.append(_case(path, root, case))
        except InvalidFile as error:
            mistakes += error.mistakes
    if mistakes:
        raise InvalidFile(first_of(path, in_order(path, list(dict.fromkeys(mistakes))), MAX_MISTAKES))
    return found


def is_random(path: Path | str) -> bool:
    """Return whether another seed is another scenario of a YAML file without cases."""
    _, content = compose(Path(path))
    return not _has_cases(content) and _seeded(content, 1) != content


def _seeded(content: Any, seed: int) -> Any:
    """Return the content of a file with a seed added to each of its seeds; other values than seeds stay as they are."""
    if isinstance(content, list):
        return [_seeded(one, seed) for one in content]
    if not isinstance(content, dict):
        return content
    return {
        key: value + seed if key == "seed" and type(value) is int and value >= 0 else _seeded(value, seed)
        for key, value in content.items()
    }


def _with_numbers(content: Any, key: str) -> Any:
    """Return the content at a key with a number in place of each range that has a seed; all others stay as they are."""
    if isinstance(content, list):
        return [_with_numbers(one, f"{key}.{k}") for k, one in enumerate(content)]
    if not isinstance(content, dict):
        return content
    if content.keys() == DrawnSpec.model_fields.keys():
        try:
            return DrawnSpec.model_validate(content).values(1, key)[0]
        except ValidationError:
            return content  # which is refused in its place
    return {name: _with_numbers(one, f"{key}.{name}") for name, one in content.items()}


def _composed(path: Path) -> tuple[Node | None, Any]:
    """Return the nodes and the content of a scenario file. Raises InvalidFile for a study."""
    root, content = compose(path)
    if isinstance(content, dict) and "scenarios" in content and not {"robot", "robots"} & content.keys():
        raise InvalidFile([f"{path}: expected a scenario, found a study, which `slalom compare` runs"])
    return root, content


def _scenario(path: Path, root: Node | None, content: Any) -> Scenario:
    """Return the scenario of the nodes and the content of a file, or of a case."""
    if isinstance(content, dict) and "obstacles" in content:
        content = {**content, "obstacles": _with_numbers(content["obstacles"], "obstacles")}
    mistakes = messages(path, root, content, ScenarioSpec)
    parts = _Parts(path, root)
    scenario = parts.assemble(content) if isinstance(content, dict) else None
    mistakes += parts.mistakes
    if mistakes or scenario is None:
        raise InvalidFile(first_of(path, in_order(path, mistakes), MAX_MISTAKES))
    return scenario


def count_of_cases(path: Path | str) -> int | None:
    """Return the number of cases of a scenario file; None for a file without. Raises InvalidFile for invalid cases."""
    root, content = compose(Path(path))
    return len(_cases(Path(path), root, content)) if _has_cases(content) else None


def _has_cases(content: Any) -> bool:
    return isinstance(content, dict) and "cases" in content


def _cases(path: Path, root: Node | None, content: dict[str, Any]) -> list[MappingNode]:
    """Return the nodes of the cases of a file. Raises InvalidFile if they are no list of mappings."""
    if mistakes := messages(path, root, {"cases": content["cases"]}, CasesSpec):
        raise InvalidFile(first_of(path, mistakes, MAX_MISTAKES))
    assert isinstance(root, MappingNode)
    listed: list[MappingNode] = next(value for key, value in root.value if key.value == "cases").value
    return listed


def _case(path: Path, root: Node | None, case: MappingNode) -> Scenario:
    """Return the scenario of a file with the keys of a case in place of its own; each node keeps its place."""
    assert isinstance(root, MappingNode)
    shared = MappingNode(root.tag, [pair for pair in root.value if pair[0].value != "cases"], root.start_mark)
    nodes = _replaced(shared, case)
    return _scenario(path, nodes, content_of(nodes))


def _replaced(node: MappingNode, by: MappingNode) -> MappingNode:
    """Return a mapping with the values of another in place of its own: mappings key by key, others as a whole."""
    own: dict[str, tuple[Node, Node]] = {key.value: (key, value) for key, value in node.value}
    for key, value in by.value:
        former = own[key.value][1] if key.value in own else None
        if isinstance(former, MappingNode) and isinstance(value, MappingNode):
            own[key.value] = (key, _replaced(former, value))
        else:
            own[key.value] = (key, value)
    return MappingNode(node.tag, list(own.values()), node.start_mark)


def files_of(path: Path) -> list[Path]:
    """Return a valid scenario file, and the files of recordings, walls and robots that it names, if any."""
    content = compose(path)[1]
    several = (content, *content.get("cases", ()))
    keys = (("recording", "file"), ("tasks", "table"))
    named = [(one.get(key) or {}).get(name) for one in several for key, name in keys]
    named += [one.get("walls") for one in several]
    entries = [entry for one in several for key in ("robots", "flows") for entry in one.get(key) or ()]
    named += [entry["table"] for entry in entries if is_table(entry)]
    found = [formats.files_of(path.parent / name) for name in dict.fromkeys(named) if name is not None]
    return [path, *(file for files in found for file in files)]


def _stem(path: Path) -> str:
    """Return the name of a file as text: bytes that are no UTF-8 would end the writing of every result."""
    return path.stem.encode(errors="surrogateescape").decode(errors="replace")


class _Parts(Mistakes):
    """Assembles the valid parts of a file, and notes parts that contradict each other.

    Parts are validated one by one, so that a mistake in one part does not hide a contradiction between others.
    """

    def assemble(self, content: dict[str, Any]) -> Scenario | None:
        """Return the scenario; None if there is a mistake."""
        written = self.written_robots(content)
        d = self.dimension(written, content)
        robots = [self.robot(one, given, d) for one in written if d and (given := _valid(RobotSpec, one.content))]
        listed = content.get("obstacles", [])
        obstacles = [
            self.obstacle(k, one, d)
            for k, raw in enumerate(listed if isinstance(listed, list) else [])
            if (one := _valid(ObstacleSpec, raw)) and d
        ]
        recording = _valid(RecordingSpec, content.get("recording"))
        found = self.recorded(recording, d) if recording and d else None
        self.periods(content)
        spec = _valid(ScenarioSpec, content)
        settings = self.settings(spec) if spec else {}
        if spec and recording and found:
            settings |= self.while_recorded(spec, recording, found)
            settings["notes"] = (*settings.get("notes", ()), *found.notes)
            obstacles += there_in(found, recording.window, spec.horizon)
        if spec and spec.walls is not None and d and (walls := self.walls(spec, d)):
            obstacles += walls.obstacles
            settings["notes"] = (*settings.get("notes", ()), *walls.notes)
        times = (spec.duration, spec.dt, spec.replan, spec.horizon, spec.holds) if spec else None
        for name, mistake in unfit_times(*times) if times else ():
            self.note((name,), mistake)
        if spec is None or self.mistakes:
            return None
        start = float(settings["start"])
        for keys, robot in zip(written, robots):
            if robot is not None and robot.appears is not None and robot.appears < start:
                self.note(keys.at("appears"), f"expected at least start = {start:g} s, found {robot.appears:g} s")
        if self.mistakes:
            return None
        some = tuple(obstacle for obstacle in obstacles if obstacle is not None)
        whole = tuple(robot for robot in robots if robot is not None)
        if routed := [k for k, one in enumerate(written) if one.has_route()]:
            leading = self.attempt(
                written[routed[0]].at("goal"), lambda: _with_routes(whole, routed, some, spec.margin)
            )
            if leading is None:
                return None
            whole = leading
        # The only remaining refusal of a scenario without tasks is a goal under an obstacle.
        scenario = self.attempt(
            written[0].at("goal"),
            lambda: Scenario(spec.name or _stem(self.path), whole, some, holds=tuple(spec.holds), **settings),
        )
        if scenario is None or spec.tasks is None:
            return scenario
        return self.attempt(("tasks",), lambda: replace(scenario, tasks=spec.tasks.tasks(self.path.parent)))

    def settings(self, spec: ScenarioSpec) -> dict[str, Any]:
        """Return the arguments of the scenario for its settings; none of them with a mistake."""
        numbers = spec.model_dump(include=set(SETTINGS))
        notes: tuple[str, ...] = ()
        if numbers["hidden_speed"] and not numbers["passive_safety"]:
            notes = ("The file has hidden_speed without passive_safety: no agents are hidden.",)
            numbers["hidden_speed"] = 0.0
        try:
            return from_numbers(numbers) | {"notes": notes}
        except InvalidInput as error:
            key, _, text = str(error).partition(": ")
            self.note((key,), text)
            return {}

    def written_robots(self, content: dict[str, Any]) -> list[WrittenRobot]:
        """Return the keys of each robot of the file, those of groups included; note names that occur twice."""
        listed = content.get("robots")
        flows = content.get("flows") if content.get("robot") is None and listed is None else None
        if (not isinstance(listed, list) or not listed) and not flows:
            return [WrittenRobot(_name(content.get("robot"), "robot"), content.get("robot"), ("robot",), {})]
        found: list[WrittenRobot] = []
        names = set[str]()
        for k, raw in enumerate(listed or []):
            place: Place = ("robots", k)
            if is_group(raw):
                group = _valid(GroupSpec, raw)
                some = robots_of(group, raw, place, len(found), self) if group else []
            elif is_table(raw):
                file = self.path.parent / str(raw["table"])
                some = robots_of_table(file, raw, place, len(found), self) if _valid(TableSpec, raw) else []
            else:
                some = [WrittenRobot(_name(raw, f"robot {len(found)}"), raw, place, {})]
            found += some
        margin = content.get("margin", ScenarioSpec.model_fields["margin"].default)
        if isinstance(margin, int | float):
            found += robots_of_flows(content, float(margin), self.path.parent, len(found), self)
        for one in found:
            if one.name in names:
                self.note(one.at("name"), f"expected a name for each robot, found {one.name!r} again")
            names.add(one.name)
        return found

    def dimension(self, robots: list[WrittenRobot], content: dict[str, Any]) -> int | None:
        """Return the dimension of the first robot's position, also if other keys are wrong; note other dimensions.

        If two or more other vectors agree on another dimension, the first robot's position is the mistake.
        """
        d = _dimension_of_others(robots, content.get("obstacles"))
        for robot in robots:
            given = robot.content if isinstance(robot.content, dict) else {}
            position, velocity = (_valid_vector(given.get(name)) for name in ("position", "velocity"))
            d = d or (len(position) if position else None)
            for name, vector in (("position", position), ("velocity", velocity)):
                if vector and d and len(vector) != d:
                    shown = "[" + ", ".join(f"{x:g}" for x in vector) + "]"
                    self.note(robot.at(name), f"expected {d} numbers, found {shown} of shape ({len(vector)},)")
        return d

    def periods(self, content: dict[str, Any]) -> None:
        """Note a decision interval that is no multiple of the time step."""
        dt, replan = content.get("dt", ScenarioSpec.model_fields["dt"].default), content.get("replan", 0.0)
        if all(isinstance(x, int | float) and np.isfinite(x) for x in (dt, replan)) and dt > 0 and replan > 0:
            try:
                whole_periods(replan, dt)
            except InvalidInput as error:
                self.note(("replan",), str(error).removeprefix("replan: "))

    def robot(self, written: WrittenRobot, me: RobotSpec, d: int) -> Robot | None:
        """Return the robot; None if its parts differ in dimension."""
        before = len(self.mistakes)
        velocity_bounds, acceleration_bounds = (
            tuple(self.bound(written.at(name, k), spec, d) for k, spec in enumerate(getattr(me, name)))
            for name in ("velocity_bounds", "acceleration_bounds")
        )
        velocity = me.velocity or [0.0] * d
        state = State(me.position, velocity) if len(velocity) == len(me.position) == d else None
        bounds = built(me.bounds)
        for k, bound in enumerate(bounds):
            # A bound of another dimension raises in any state.
            self.attempt(written.at("bounds", k), partial(bound.half_spaces, State([1.0] * d, [1.0] * d)))
        limits = Limits(me.max_speed, me.max_acceleration, velocity_bounds, acceleration_bounds, bounds)
        goal, shape = me.goal.build(), self.attempt(written.at(), lambda: me.whole_shape(d))
        if state is None or shape is None:
            return None
        chosen = None if me.method is None else method(me.method)
        objective = built(me.objective)
        robot = self.attempt(
            written.at("goal"),
            lambda: Robot(
                *(shape, limits, state, goal, written.name, chosen, me.margin, me.priority, objective, me.appears)
            ),
        )
        return robot if len(self.mistakes) == before else None

    def bound(self, place: Place, spec: HalfSpaceSpec, d: int) -> HalfSpace:
        """Return a half-space, and note one of another dimension than the robot."""
        if len(spec.normal) != d:
            self.note((*place, "normal"), f"expected {d} numbers, found {len(spec.normal)}")
        return HalfSpace(spec.normal, spec.offset)

    def obstacle(self, k: int, spec: ObstacleSpec, d: int) -> Obstacle | None:
        """Return an obstacle of the robot's dimension; None with a mistake."""
        name = spec.name or f"obstacle {k}"
        shape = self.attempt(("obstacles", k), lambda: spec.whole_shape(d))
        if shape is None:
            return None
        given = {key: built(value) for key, value in spec if key not in ("name", "radius", "shape", "trajectory")}
        return self.attempt(
            ("obstacles", k, "trajectory"), lambda: Obstacle(shape, spec.trajectory.build(), name, **given)
        )

    def walls(self, spec: ScenarioSpec, d: int) -> Walls | None:
        """Return the walls of a file; None with a mistake."""
        unit = None if spec.walls_unit is None else number_or_text(spec.walls_unit)
        if d != 2:
            self.note(("walls",), "expected none in space, found a file of walls")
            return None
        try:
            return read_walls(self.path.parent / str(spec.walls), unit, up=spec.walls_up)
        except InvalidFile as error:
            self.mistakes.extend(error.mistakes)
        except InvalidInput as error:
            name, _, mistake = str(error).partition(": ")
            self.note((f"walls_{name}",), mistake)
        return None

    def recorded(self, spec: RecordingSpec, d: int) -> Recorded | None:
        """Return the agents of a recording of the robot's dimension; None with a mistake."""
        file, given = self.path.parent / spec.file, spec.of_format()
        name = self.attempt(("recording", "file"), lambda: spec.format or formats.format_of(file, bool(spec.columns)))
        if name is None:
            return None
        settings = formats.reader_settings(name)
        unknown = [key for key in given if key not in settings]
        for key in unknown:
            text = f"expected a setting that {name} has ({', '.join(settings) or 'none'}), found {key!r}"
            self.note(("recording", key), text)
        if unknown:
            return None
        try:
            found = read_recorded(
                file,
                AgentSelection(spec.radius, spec.agents, spec.without),
                format=name,
                gap=spec.gap,
                max_speed=spec.jump_speed,
                interpolation=spec.interpolation,
                keep=spec.keep,
                **given,
            )
        except InvalidFile as error:
            self.mistakes.extend(error.mistakes)
            return None
        except InvalidInput as error:
            key, _, text = str(error).partition(": ")
            known = key in RecordingSpec.model_fields
            self.note(("recording", key) if known else ("recording",), text if known else str(error))
            return None
        if found.dimension != d:
            self.note(("recording",), f"expected tracks of the robot's dimension, found {d} and {found.dimension}")
            return None
        return found

    def while_recorded(self, spec: ScenarioSpec, recording: RecordingSpec, found: Recorded) -> dict[str, Any]:
        """Return start, duration and the used part of the recording; none of them with a mistake."""
        (first, last), window = found.span, recording.window
        begin, end = (max(first, window[0]), min(last, window[1])) if window else (first, last)
        if window and begin >= end:
            shown = f"{window[0]:g} to {window[1]:g} s"
            self.note(("recording", "window"), f"expected a part of {first:g} to {last:g} s, found {shown}")
            return {}
        start = spec.start if "start" in spec.model_fields_set or not window else begin
        if not begin <= start < end:
            place = ("start",) if "start" in spec.model_fields_set else ("recording",)
            self.note(
                place, f"expected a start during the recording, from {begin:g} to before {end:g} s, found {start:g}"
            )
            return {}
        duration = spec.duration
        if window and "duration" not in spec.model_fields_set:
            duration = end - start
        elif window and start + duration > end + WHOLE_COUNT * abs(end):
            self.note(("duration",), f"expected at most {end - start:g} s, until the window ends, found {duration:g}")
        return {"start": start, "duration": duration, "recorded": (begin, end)}


def _with_routes(
    robots: Sequence[Robot], rows: Sequence[int], obstacles: Sequence[Obstacle], margin: float
) -> tuple[Robot, ...]:
    """Return the robots; those of some rows with the paths around obstacles at rest that lead to their goals."""
    some = [robots[k] for k in rows]
    paths = routes(
        [robot.state.position for robot in some],
        [robot.goal.position(0.0) for robot in some],
        [robot.shape.bounding_radius for robot in some],
        obstacles,
        margin=margin,
    )
    goals = {k: PathGoal(path, None, robots[k].goal.tolerance, robots[k].goal.stop) for k, path in zip(rows, paths)}
    return tuple(replace(robot, goal=goals.get(k, robot.goal)) for k, robot in enumerate(robots))


def _dimension_of_others(robots: list[WrittenRobot], obstacles: object) -> int | None:
    """Return the dimension of all vectors but the first robot's position; None if they differ or are less than two."""
    given = [robot.content for robot in robots if isinstance(robot.content, dict)]
    listed = obstacles if isinstance(obstacles, list) else []
    trajectories = [one.get("trajectory") for one in listed if isinstance(one, dict)]
    mappings = [*given[1:], *(robot.get("goal") for robot in given), *trajectories]
    values = [one.get(key) for one in mappings if isinstance(one, dict) for key in ("position", "center")]
    found = [len(vector) for raw in values if (vector := _valid_vector(raw))]
    return found[0] if len(found) > 1 and len(set(found)) == 1 else None


def _name(raw: object, default: str) -> str:
    """Return the name of a robot: as given, else the default."""
    given = raw.get("name") if isinstance(raw, dict) else None
    return str(given) if given else default


def there_in(found: Recorded, window: Sequence[float] | None, horizon: float) -> list[Obstacle]:
    """Return the agents that exist during the window [s] extended by one horizon [s]; all without a window."""
    if window is None:
        return list(found.obstacles)
    spans = (obstacle.trajectory.span for obstacle in found.obstacles)
    return [o for o, (first, last) in zip(found.obstacles, spans) if first <= window[1] + horizon and last >= window[0]]


def _valid_vector(raw: object) -> list[float] | None:
    """Return two or three numbers; None for anything else."""
    if isinstance(raw, list) and len(raw) in (2, 3) and all(isinstance(x, int | float) for x in raw):
        return raw
    return None


def _valid(model: type[M], raw: object) -> M | None:
    """Return the model of a part; None if it has mistakes, which are reported with those of the whole file."""
    try:
        return model.model_validate(raw)
    except ValidationError:
        return None
