"""Model of a scenario file."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple, cast

import numpy as np
from pydantic import (
    AfterValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    TypeAdapter,
    ValidationInfo,
    create_model,
    field_validator,
)
from pydantic.fields import FieldInfo

from slalom.base.checks import did_you_mean, shown, vectors
from slalom.base.errors import InvalidFile, InvalidInput
from slalom.base.tolerances import WHOLE_COUNT
from slalom.decision.methods import method
from slalom.decision.settings import SharedSettings
from slalom.io.formats import FORMATS
from slalom.io.recorded import refuse
from slalom.io.sheet import comma_table
from slalom.io.yaml_nodes import YAML_VALUES
from slalom.model.goal import Goal
from slalom.model.limits import HalfSpace
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Shape, round_shape
from slalom.model.trajectory import Stationary
from slalom.obstacle import Headings
from slalom.sim.files.parts import (
    BoundModel,
    Built,
    Model,
    ModelByContent,
    NotNegative,
    ObjectiveModel,
    OfAnyKind,
    PartModel,
    Place,
    Positive,
    ShapeModel,
    Text,
    TrajectoryModel,
    UncertaintyModel,
    Vector,
    built,
    model_of_settings,
)
from slalom.sim.files.patterns import GOALS, LAYOUTS, generator
from slalom.sim.files.yaml_errors import Mistakes
from slalom.sim.tasks import Drawn, Station, Task, Tasks

# Model of the recording in a scenario file, the agents of which are obstacles.


Window = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)]


class RecordingSpec(Model):
    """Recorded agents as obstacles, from a file of any format; its path is relative to the scenario file.

    `radius` [m] is that of agents without one in the file (see `recorded_traffic.read_recorded`). `window` [s] is the
    first and the last time of the used part, in the time of the recording.
    """

    file: str
    format: str | None = None
    radius: NotNegative | None = None
    agents: list[Text] | None = None
    without: list[Text] = Field(default_factory=list)
    window: Window | None = None
    interpolation: Literal["linear", "smooth"] = "smooth"
    gap: Positive | None = None
    jump_speed: Positive | None = None
    frame_rate: Positive | None = None
    unit: Text | None = None
    time_unit: Text | None = None
    keep: Literal["first", "last"] | None = None
    encoding: Text | None = None
    case: FiniteFloat | None = None
    columns: dict[str, str | None] | None = None
    origin: Vector | None = None
    epoch: Text | None = None
    altitude_unit: Positive | None = None

    @field_validator("format")
    @classmethod
    def _known(cls, name: str | None) -> str | None:
        if name is not None and name not in FORMATS:
            hint = did_you_mean(name, list(FORMATS))
            raise InvalidInput(f"expected one of {', '.join(FORMATS)}; found {name!r}{hint}")
        return name

    @field_validator("window")
    @classmethod
    def _forward(cls, window: list[float] | None) -> list[float] | None:
        if window is not None and window[0] >= window[1]:
            raise InvalidInput(f"expected a time and a later one, found {window[0]:g} and {window[1]:g}")
        return window

    def of_format(self) -> dict[str, Any]:
        """Return the given settings of a reader, by name."""
        names = ("frame_rate", "time_unit", "encoding", "case", "columns", "origin", "altitude_unit")
        given = {name: getattr(self, name) for name in names}
        given |= {name: text and number_or_text(text) for name in ("epoch", "unit") if (text := getattr(self, name))}
        return {name: value for name, value in given.items() if value is not None}


def number_or_text(text: str) -> float | str:
    """Return a time as a number of seconds if it is one, else as text."""
    try:
        return float(text)
    except ValueError:
        return text


# Models of the robots and obstacles of scenario files: one for each mapping in them.


def refuse_unless_one(value: object, other: str, info: ValidationInfo) -> None:
    """Raise InvalidInput unless the file has either this key or the one before it, `other`.

    Nothing is refused where that key has mistakes of its own: it is not in the data.
    """
    if other in info.data and (value is None) == (info.data[other] is None):
        raise InvalidInput(f"expected either this key or {other}, found {'neither' if value is None else 'both'}")


class Shaped(Model):
    """A body that has either a radius or a shape."""

    shape: ShapeModel | None = None
    radius: NotNegative | None = Field(default=None, validate_default=True)

    @field_validator("radius")
    @classmethod
    def _one_of_them(cls, radius: float | None, info: ValidationInfo) -> float | None:
        refuse_unless_one(radius, "shape", info)
        return radius

    def whole_shape(self, dimension: int) -> Shape:
        """Return the shape. Raises InvalidInput if it is of another dimension."""
        if self.shape is None:
            return round_shape(float(self.radius or 0.0), dimension)
        shape: Shape = self.shape.build()
        if shape.dimension != dimension:
            raise InvalidInput(f"expected a shape of dimension {dimension} as of the robot, found {shape.dimension}")
        return shape


class PathSpec(Model):
    """A polyline with speeds, see `PathGoal`."""

    points: list[Vector]
    speeds: FiniteFloat | list[FiniteFloat] | None = None
    lookahead: Positive = 1.0
    laps: Annotated[int, Field(ge=1)] = 1
    cut: Positive | None = None


class GoalSpec(Built):
    """The goal of a robot: a position, a trajectory, or the end of a path that is followed there."""

    position: Vector | None = None
    trajectory: TrajectoryModel | None = None
    path: PathSpec | None = None
    tolerance: Positive = 0.5
    stop: bool = False
    route: bool = False

    def build(self) -> Goal:
        """Return the goal; one with a route is at its position until the obstacles are known."""
        given = {"position": self.position, "trajectory": self.trajectory, "path": self.path}
        found = [name for name, value in given.items() if value is not None]
        if len(found) != 1:
            raise InvalidInput(f"expected one of {', '.join(given)}, found {' and '.join(found) or 'none'}")
        if self.route and self.position is None:
            raise InvalidInput(f"expected a position with route, found {found[0]}")
        if self.path is not None:
            path = self.path
            further: dict[str, Any] = {"lookahead": path.lookahead, "laps": path.laps, "cut": path.cut}
            return PathGoal(path.points, path.speeds, self.tolerance, self.stop, **further)
        if self.trajectory is not None:
            return Goal(self.trajectory.build(), self.tolerance, self.stop)
        assert self.position is not None
        return Goal(Stationary(self.position), self.tolerance, self.stop)


class HalfSpaceSpec(PartModel):
    """The half-space normal . x <= offset."""

    part = HalfSpace
    normal: Vector
    offset: FiniteFloat


def known_method(name: str) -> str:
    """The name of a method, with its foresight. Raises InvalidInput for an unknown one."""
    try:
        return method(name).name
    except InvalidInput as error:
        # The place names the key.
        raise InvalidInput(str(error).removeprefix("method: ")) from None


class RobotKeys(Shaped):
    """Keys that a robot and a group of robots have in common."""

    name: Text = ""
    method: Annotated[str, AfterValidator(known_method)] | None = None
    margin: NotNegative | None = None
    priority: Positive = 1.0
    velocity: Vector | None = None
    max_speed: Positive
    max_acceleration: Positive
    velocity_bounds: list[HalfSpaceSpec] = Field(default_factory=list)
    acceleration_bounds: list[HalfSpaceSpec] = Field(default_factory=list)
    bounds: list[BoundModel] = Field(default_factory=list)
    objective: ObjectiveModel | None = None
    appears: FiniteFloat | None = None


class RobotSpec(RobotKeys):
    """A robot, in SI units. Its orientation is constant."""

    position: Vector
    goal: GoalSpec


class HeadingsSpec(PartModel):
    """Keys of `Headings`: angles [rad] at times [s]."""

    part = Headings
    times: Annotated[list[FiniteFloat], Field(min_length=1)]
    angles: Annotated[list[FiniteFloat], Field(min_length=1)]


@dataclass(frozen=True, eq=False)
class HeadingOfContent(ModelByContent):
    """Metadata of the heading of an obstacle: one message for a content that is none."""

    def model_of(self, content: object) -> type[Model] | None:
        return HeadingsSpec if isinstance(content, dict) else None

    def validate(self, content: object) -> object:
        if isinstance(content, dict):
            return HeadingsSpec.model_validate(content)
        if content == "motion" or (type(content) in (int, float) and isfinite(cast(float, content))):
            return content
        raise InvalidInput(f"expected an angle [rad], 'motion', or times and angles; found {shown(content)}")


HeadingModel = Annotated[float | Literal["motion"] | HeadingsSpec, HeadingOfContent()]


class ObstacleSpec(Shaped):
    """A shape on a trajectory."""

    name: str = ""
    heading: HeadingModel = 0.0
    uncertainty: UncertaintyModel | None = None
    after_end: Literal["unknown", "continues", "leaves"] = "unknown"
    contact_at_rest: bool = True
    owner: str = ""
    trajectory: TrajectoryModel


# Model of a group of robots in a scenario file, and the robots that it stands for.


VALUES_PER_ROBOT: Final = 20
"""Values of a file that a robot stands for, about; a group counts as the robots that it stands for."""


class RangeSpec(Model):
    """Numbers of a group: evenly over its robots, or drawn between both with a seed."""

    first: NotNegative
    last: NotNegative
    seed: Annotated[int, Field(ge=0)] | None = None

    def values(self, count: int, key: str) -> list[float]:
        """Return `count` numbers between `first` and `last`, both included."""
        if self.seed is None:
            return [float(x) for x in np.linspace(self.first, self.last, count)]
        low, high = sorted((self.first, self.last))
        return [float(x) for x in generator(self.seed, key).uniform(low, high, count)]


class PositiveRangeSpec(RangeSpec):
    """A range of numbers above 0."""

    first: Positive
    last: Positive


class DrawnSpec(RangeSpec):
    """A number of an obstacle, drawn between both with a seed."""

    first: FiniteFloat
    last: FiniteFloat
    seed: Annotated[int, Field(ge=0)]


@dataclass(frozen=True, eq=False)
class NumberOrRange(ModelByContent):
    """Metadata of a field that holds a number, or a mapping with the range of the numbers of a group."""

    number: Any
    range: type[RangeSpec]

    def model_of(self, content: object) -> type[Model] | None:
        return self.range if isinstance(content, dict) else None

    def validate(self, content: object) -> object:
        if isinstance(content, dict):
            return self.range.model_validate(content)
        return TypeAdapter(self.number, config=ConfigDict(strict=True)).validate_python(content)


PositiveOrRange = Annotated[Any, NumberOrRange(Positive, PositiveRangeSpec)]
NotNegativeOrRange = Annotated[Any, NumberOrRange(NotNegative, RangeSpec)]


class GroupGoalSpec(Model):
    """Keys that the goals of a group have in common."""

    tolerance: Positive = 0.5
    stop: bool = False
    route: bool = False


def _optional(field: FieldInfo) -> Any:
    """Return the type of a field, or None."""
    given: Any = Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
    return given | None


_KEYS: dict[str, Any] = {"robot": (Annotated[int, Field(ge=0)], ...)}
_KEYS |= {name: (_optional(field), None) for name, field in RobotSpec.model_fields.items()}
OverrideSpec = create_model("OverrideSpec", __base__=Model, __doc__="A robot of a group that differs.", **_KEYS)


Count = Annotated[int, Field(ge=1, le=YAML_VALUES // VALUES_PER_ROBOT)]
LayoutModel = Annotated[PartModel, OfAnyKind(LAYOUTS)]


class SharedKeys(RobotKeys):
    """Keys that several robots share, some of them ranges over the robots."""

    radius: NotNegativeOrRange | None = Field(default=None, validate_default=True)
    margin: NotNegativeOrRange | None = None
    priority: PositiveOrRange = 1.0
    max_speed: PositiveOrRange
    max_acceleration: PositiveOrRange
    appears: NotNegativeOrRange | None = None
    goal: GroupGoalSpec = Field(default_factory=GroupGoalSpec)


class GroupSpec(SharedKeys):
    """Robots that share their settings, placed by patterns."""

    count: Count
    positions: LayoutModel
    goals: Annotated[PartModel, OfAnyKind(GOALS)]
    overrides: list[OverrideSpec] = Field(default_factory=list)  # type: ignore[valid-type]  # made at run time


class FlowSpec(SharedKeys):
    """Robots that go from one area to another: `count` of them, or `rate` per second of the range `appears`."""

    origin: Text
    destination: Text
    count: Count | None = None
    rate: Positive | None = Field(default=None, validate_default=True)

    @field_validator("rate")
    @classmethod
    def _one_of_two(cls, rate: float | None, info: ValidationInfo) -> float | None:
        refuse_unless_one(rate, "count", info)
        if rate is None or "appears" not in info.data:
            return rate
        span = info.data["appears"]
        if not isinstance(span, RangeSpec) or rate * (span.last - span.first) < 1.0:
            raise InvalidInput("expected a range of appears in which one robot appears at least, found none")
        return rate

    def times(self, key: str) -> list[float]:
        """Return the times [s] of appearance of all robots; none without the key."""
        span, rate = self.appears, self.rate
        if not isinstance(span, RangeSpec):
            return [] if span is None else [span] * (self.count or 0)
        if rate is None or span.seed is not None:
            return span.values(self.count or self.number(), key)
        return [span.first + k / rate for k in range(self.number())]

    def number(self) -> int:
        """Return the number of robots: `count`, or those that appear at a `rate`, the first one at once."""
        span: Any = self.appears
        return self.count or int(float(self.rate or 0.0) * (span.last - span.first) * (1.0 + WHOLE_COUNT))


class FlowTableSpec(SharedKeys):
    """Flows of a table, a row each: origin, destination and count."""

    table: Text


class TableSpec(RobotKeys):
    """Robots of a table, a row each: x, y, goal_x, goal_y and, in place of keys, name, radius, max_speed, appears."""

    table: Text
    radius: NotNegative | None = None
    max_speed: Positive | None = None  # type: ignore[assignment]  # columns stand for it
    goal: GroupGoalSpec = Field(default_factory=GroupGoalSpec)


@dataclass(frozen=True, eq=False)
class ByContent(ModelByContent):
    """Metadata of an entry whose keys determine its model, which `choose` returns."""

    choose: Callable[[object], type[Model]]

    def model_of(self, content: object) -> type[Model] | None:
        return self.choose(content)

    def validate(self, content: object) -> Model:
        return self.choose(content).model_validate(content)


RobotOrGroup = Annotated[
    Model, ByContent(lambda content: GroupSpec if is_group(content) else TableSpec if is_table(content) else RobotSpec)
]
"""An entry of `robots`: a group has a count, a table its file, a robot has neither."""
FlowOrTable = Annotated[Model, ByContent(lambda content: FlowTableSpec if is_table(content) else FlowSpec)]


def is_group(content: object) -> bool:
    """Whether an entry of `robots` is a group."""
    return isinstance(content, dict) and "count" in content


def is_table(content: object) -> bool:
    """Whether an entry of `robots` is a table."""
    return isinstance(content, dict) and "table" in content


class WrittenRobot(NamedTuple):
    """A robot of a file: its name, keys and place, and the places of keys that stand elsewhere."""

    name: str
    content: object
    place: Place
    elsewhere: Mapping[str, Place]

    def has_route(self) -> bool:
        """Return whether a path around obstacles at rest leads to its goal."""
        goal = self.content.get("goal") if isinstance(self.content, dict) else None
        return isinstance(goal, dict) and goal.get("route") is True

    def at(self, *keys: str | int) -> Place:
        """Return the place of a value of the robot."""
        return (*self.elsewhere.get(str(keys[0]), (*self.place, keys[0])), *keys[1:]) if keys else self.place


def robots_of(
    spec: GroupSpec, content: Mapping[str, Any], place: Place, number: int, mistakes: Mistakes
) -> list[WrittenRobot]:
    """Return the robots of a group, each with the keys of a robot that is written on its own; none with a mistake.

    Args:
        spec: the model of `content`, the group at `place`. number: of its first robot in the fleet, for robots
            without a name. mistakes: gets those of patterns and overrides.
    """
    count = spec.count
    layout = spec.positions.build()
    pattern = spec.goals.build()
    positions = mistakes.attempt((*place, "positions"), lambda: vectors(layout.points(count, "positions"), "positions"))
    if positions is None:
        return []
    d = positions.shape[1]
    goals = mistakes.attempt((*place, "goals"), lambda: vectors(pattern.goals(positions), "goals", d))
    overrides = _overrides(content, place, count, mistakes)
    if goals is None or overrides is None:
        return []
    shared = {key: content[key] for key in RobotKeys.model_fields if key in content}
    ranges = {key: value.values(count, key) for key, value in spec if isinstance(value, RangeSpec)}
    found = []
    for k in range(count):
        robot = shared | {key: values[k] for key, values in ranges.items()}
        robot["name"] = f"{spec.name} {k}" if spec.name else f"robot {number + k}"
        robot["position"] = positions[k].tolist()
        robot["goal"] = {**content.get("goal", {}), "position": goals[k].tolist()}
        elsewhere = {"position": (*place, "positions"), "goal": (*place, "goals")}
        if k in overrides:
            at, own = overrides[k]
            if own.keys() & {"shape", "radius"}:
                robot = {key: value for key, value in robot.items() if key not in ("shape", "radius")}
            robot |= own
            elsewhere |= {key: (*at, key) for key in own}
        found.append(WrittenRobot(str(robot["name"]), robot, place, elsewhere))
    return found


TABLE_COLUMNS: Final = ("x", "y", "goal_x", "goal_y", "name", "radius", "max_speed", "appears")


def robots_of_table(
    file: Path, content: Mapping[str, Any], place: Place, number: int, mistakes: Mistakes
) -> list[WrittenRobot]:
    """Return the robots of a table, each with the keys of a robot that is written on its own; none with a mistake.

    Args: as of `robots_of`.
    """
    try:
        table = comma_table(file, ("x", "y", "goal_x", "goal_y"))
        positions, goals = table.positions("x", "y"), table.positions("goal_x", "goal_y")
        columns = {key: table.numbers(key) for key in ("radius", "max_speed", "appears") if key in table.names}
        for key, values in columns.items():
            for row in np.flatnonzero((values <= 0.0) & (key != "appears")):
                table.wrong(row, key, f"expected a number above 0, found {values[row]:g}")
        refuse(table.path, table.mistakes, table.location)
    except InvalidFile as error:
        mistakes.mistakes.extend(error.mistakes)
        return []
    for name in table.names:
        if name not in TABLE_COLUMNS:
            mistakes.note((*place, "table"), f"expected columns among {', '.join(TABLE_COLUMNS)}, found {name}")
            return []
    for key in ("radius", "max_speed"):
        if key not in columns and key not in content and not (key == "radius" and "shape" in content):
            mistakes.note((*place, "table"), f"expected a column {key}, or this key; found neither")
            return []
    shared = {key: content[key] for key in RobotKeys.model_fields if key in content}
    names = table.texts("name") or [f"robot {number + k}" for k in range(len(positions))]
    elsewhere = dict.fromkeys(("name", "position", "goal", *columns), (*place, "table"))
    found = []
    for k, name in enumerate(names):
        robot = shared | {key: float(values[k]) for key, values in columns.items()} | {"name": name}
        robot["position"] = positions[k].tolist()
        robot["goal"] = {**content.get("goal", {}), "position": goals[k].tolist()}
        found.append(WrittenRobot(name, robot, place, elsewhere))
    return found


def _overrides(
    content: Mapping[str, Any], place: Place, count: int, mistakes: Mistakes
) -> dict[int, tuple[Place, dict[str, Any]]] | None:
    """Return the place and the keys of the override of each robot that has one; None with a mistake."""
    found: dict[int, tuple[Place, dict[str, Any]]] = {}
    before = len(mistakes.mistakes)
    for j, one in enumerate(content.get("overrides", [])):
        at, k = (*place, "overrides", j), one["robot"]
        if k >= count:
            mistakes.note((*at, "robot"), f"expected a robot from 0 to {count - 1}, found {k}")
        elif k in found:
            mistakes.note((*at, "robot"), f"expected one override of each robot, found {k} again")
        elif {"shape", "radius"} <= one.keys():
            mistakes.note((*at, "radius"), "expected either this key or shape, found both")
        else:
            found[k] = at, {key: value for key, value in one.items() if key != "robot" and value is not None}
    return found if len(mistakes.mistakes) == before else None


class TimeRangeSpec(RangeSpec):
    """A time of a station, drawn for each task between both with a seed."""

    seed: Annotated[int, Field(ge=0)]


TimeOrRange = Annotated[Any, NumberOrRange(NotNegative, TimeRangeSpec)]


class StationSpec(Built):
    """A station of tasks."""

    name: Text
    at: Vector
    places: Annotated[int, Field(ge=1)] = 1
    service: TimeOrRange = 0.0

    def build(self) -> Station:
        given = self.service
        drawn = Drawn(given.first, given.last, given.seed) if isinstance(given, TimeRangeSpec) else given
        return Station(self.name, self.at, self.places, drawn)


class TaskSpec(Built):
    """A task of a list."""

    time: FiniteFloat
    origin: Text
    destination: Text
    robot: Text = ""

    def build(self) -> Task:
        return Task(self.time, self.origin, self.destination, self.robot)


class TasksSpec(Model):
    """Stations, and the tasks between them: listed, of a table, or at random with a rate."""

    stations: list[StationSpec] = Field(min_length=2)
    listed: list[TaskSpec] = Field(default_factory=list)
    table: Text | None = None
    rate: NotNegative = 0.0
    seed: Annotated[int, Field(ge=0)] = 0
    origins: list[Text] = Field(default_factory=list)
    destinations: list[Text] = Field(default_factory=list)
    route: bool = False

    def tasks(self, folder: Path) -> Tasks:
        """Return the tasks; the table is in a folder. Raises InvalidFile for one, InvalidInput for contradictions."""
        given = {name: getattr(self, name) for name in ("rate", "seed", "route")}
        given |= {name: tuple(getattr(self, name)) for name in ("origins", "destinations")}
        listed = (*built(self.listed), *(_tasks_of_table(folder / self.table) if self.table else ()))
        return Tasks(built(self.stations), listed, **given)


def _tasks_of_table(file: Path) -> list[Task]:
    """Return the task of each row of a table."""
    table = comma_table(file, ("time", "origin", "destination"))
    times = table.numbers("time")
    refuse(table.path, table.mistakes, table.location)
    robots = table.texts("robot") if "robot" in table.names else [""] * len(times)
    return [Task(*row) for row in zip(times.tolist(), table.texts("origin"), table.texts("destination"), robots)]


Areas = dict[str, LayoutModel]


class WorldSpec(Model):
    """The robots, the obstacles and the times of a scenario file."""

    name: str = ""
    robot: RobotSpec | None = None
    areas: Areas = Field(default_factory=dict)
    flows: list[FlowOrTable] = Field(default_factory=list)
    tasks: TasksSpec | None = None
    robots: list[RobotOrGroup] | None = Field(default=None, min_length=1, validate_default=True)
    obstacles: list[ObstacleSpec] = Field(default_factory=list)
    recording: RecordingSpec | None = None
    walls: Text | None = None
    walls_unit: Text | None = None
    walls_up: bool = False
    start: FiniteFloat = 0.0
    duration: Positive = 60.0
    dt: Positive = 0.1
    replan: NotNegative = 0.0

    @field_validator("robots")
    @classmethod
    def _one_of_both(cls, robots: list[Model] | None, info: ValidationInfo) -> list[Model] | None:
        # Flows with mistakes of their own are not in the data.
        alone = robots is None and info.data.get("robot") is None
        if not alone or not info.data.get("flows", True):
            refuse_unless_one(robots, "robot", info)
        return robots


_Decided: Any = model_of_settings("_Decided", SharedSettings, WorldSpec)
"""The same with the settings of decisions."""


class ScenarioSpec(_Decided):  # type: ignore[misc]  # derived
    """A scenario file."""

    guided: bool = True
    early: bool = False
    sight_range: NotNegative = 0.0
    field_of_view: NotNegative = 0.0
    sight_near: NotNegative = 0.0
    occlusion: NotNegative = 0.0
    hidden_speed: NotNegative = 0.0
    passive_safety: NotNegative = 0.0
    entry_time: NotNegative = 0.0


class CasesSpec(Model):
    """Scenarios of one file: the mappings of keys that differ, one for each seed."""

    cases: list[dict[str, Any]] = Field(min_length=1)
