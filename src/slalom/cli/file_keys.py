"""Keys of scenario and study files, from the models that read them: for `slalom list keys`, and for the reference."""

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import NoneType
from typing import Annotated, Any, Final, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from slalom.base.checks import known
from slalom.decision.objective import OBJECTIVES
from slalom.decision.settings import SharedSettings
from slalom.model.bounds import BOUNDS
from slalom.model.shape import SHAPES
from slalom.model.trajectory import TRAJECTORIES
from slalom.model.uncertainty import UNCERTAINTIES
from slalom.sim.files.parts import OfAnyKind, model_of_part
from slalom.sim.files.patterns import GOALS, LAYOUTS
from slalom.sim.files.schema import (
    CasesSpec,
    FlowSpec,
    FlowTableSpec,
    GoalSpec,
    GroupGoalSpec,
    GroupSpec,
    HalfSpaceSpec,
    NumberOrRange,
    ObstacleSpec,
    OverrideSpec,
    PathSpec,
    RangeSpec,
    RecordingSpec,
    RobotSpec,
    ScenarioSpec,
    StationSpec,
    TableSpec,
    TaskSpec,
    TasksSpec,
    TimeRangeSpec,
)
from slalom.sim.measure.hdf5 import unit_of
from slalom.sim.sweep.study import ScenarioRowSpec, StudySpec


def meanings_of(part: type) -> dict[str, str]:
    """Return the meanings of the attributes of a class, of a line each, from its docstring."""
    return dict(re.findall(r"^    (\w+): (.+)\.$", inspect.getdoc(part) or "", re.MULTILINE))


ROBOT_KEYS: Final[Mapping[str, str]] = {
    "shape": "one of the shapes; either this key or radius",
    "radius": "[m] of a disc, in space of a ball",
    "name": "in results and files",
    "method": "by which it decides; by default that of the run",
    "objective": "cost that the robot minimises; by default the time of arrival",
    "margin": "[m] its own, by default that of the scenario",
    "priority": "[1] of two robots, the one with the smaller value does more of the avoidance",
    "velocity": "[m/s] at the start; by default 0",
    "max_speed": "[m/s]",
    "max_acceleration": "[m/s^2]",
    "velocity_bounds": "half-spaces of the velocity [m/s]",
    "acceleration_bounds": "half-spaces of the acceleration [m/s^2]",
    "bounds": "that depend on the state",
    "appears": "[s] absolute time before which it is not in the world; by default it is there from the start",
}
"""Meaning of the keys that a robot and a group have in common."""

MEANINGS: Final[Mapping[str, Mapping[str, str]]] = {
    "ScenarioSpec": {
        "name": "by default that of the file",
        "robot": "the only robot: keys of a robot",
        "robots": "several robots or groups of robots, in place of `robot`",
        "areas": "patterns of positions by name, for flows",
        "flows": "robots from area to area, beside `robots` or in place of them: keys of a flow",
        "tasks": "stations and tasks over time, in the plane: keys of tasks",
        "obstacles": "keys of an obstacle",
        "recording": "recorded agents as obstacles: keys of a recording",
        "walls": "file of walls, relative to the scenario file",
        "walls_unit": "m, cm, mm, km, ft or a number [m]; by default as the file of walls states",
        "walls_up": "whether to turn a drawing in SVG, whose y points down",
        "start": "[s] absolute time of the start",
        "duration": "[s] after which a robot that has not arrived has failed",
        "dt": "[s] between steps",
        "replan": "[s] between decisions, a multiple of dt; 0: dt",
        **meanings_of(SharedSettings),
        "guided": "whether several robots in the plane go around obstacles at rest and past each other; see `Fleet`",
        "early": "whether robots avoid a collision as soon as the horizon shows it, not when they could hardly stop",
        "sight_range": "[m] range of the sensors; 0: not limited",
        "field_of_view": "[rad] full angle about the direction of motion; 0: a full turn",
        "sight_near": "[m] radius that is sensed in all directions",
        "occlusion": "1: obstacles at rest occlude others, 2: all obstacles do, 0: none does",
        "hidden_speed": "[m/s] largest speed of hidden agents, with passive_safety",
        "passive_safety": "1: hidden agents touch the robot at rest only, 2: visible ones as well, 0: neither",
        "entry_time": "[s] within which hidden agents enter with a learned probability; 0: they are certain",
    },
    "CasesSpec": {"cases": "keys of the scenario that differ; the seed is the number of the case, from 0"},
    "RobotSpec": {**ROBOT_KEYS, "position": "[m] at the start", "goal": "keys of a goal"},
    "GroupSpec": {
        **ROBOT_KEYS,
        "name": "of the group; its robots are NAME 0, NAME 1 and so on",
        "count": "number of robots; this key makes an entry of `robots` a group",
        "positions": "pattern of the starts",
        "goals": "pattern of the goals",
        "goal": "keys that the goals of a group have in common",
        "overrides": "robots that differ",
    },
    "FlowSpec": {
        **ROBOT_KEYS,
        "name": "of the flow; its robots are NAME 0, NAME 1 and so on",
        "goal": "keys that the goals of a group have in common",
        "origin": "area of the starts",
        "destination": "area of the goals",
        "count": "number of robots; either this key or rate",
        "rate": "[1/s] of robots that appear, in the range `appears`",
    },
    "TasksSpec": {
        "stations": "keys of a station",
        "listed": "keys of a task",
        "table": "file with time, origin, destination and, if wanted, robot in columns, a task for each row",
        "rate": "tasks a minute that arrive at random, from one station to another one",
        "seed": "of the tasks at random",
        "origins": "stations where tasks at random begin; by default all",
        "destinations": "stations where they end; by default all",
        "route": "whether shortest paths around obstacles at rest lead to stations and goals",
    },
    "StationSpec": {
        "name": "for tasks",
        "at": "[m] its first place",
        "places": "number of robots that it serves at once",
        "service": "[s] for which a robot rests there",
    },
    "TimeRangeSpec": {
        "first": "[s] one end of random numbers, drawn for each task",
        "last": "[s] the other end",
        "seed": "of random numbers, uniform between both ends",
    },
    "TaskSpec": {
        "time": "[s] absolute, from which it is known",
        "origin": "station to which the robot goes first",
        "destination": "station to which it goes next",
        "robot": "the only one that may serve it; by default the nearest free one",
    },
    "FlowTableSpec": {
        **ROBOT_KEYS,
        "goal": "keys that the goals of a group have in common",
        "table": "file with origin, destination and count in columns, a flow for each row",
    },
    "GroupGoalSpec": {
        "tolerance": "[m] within which a robot has arrived",
        "stop": "whether the robots stop there",
        "route": "whether shortest paths around obstacles at rest lead there",
    },
    "TableSpec": {
        **ROBOT_KEYS,
        "table": "file with x, y, goal_x, goal_y [m] in columns; this key makes an entry of `robots` a table",
        "name": "by a column of that name",
        "radius": "[m]; by default the column of that name",
        "max_speed": "[m/s]; by default the column of that name",
        "goal": "keys that the goals of a group have in common",
    },
    "RangeSpec": {
        "first": "of the first robot, or one end of random numbers",
        "last": "of the last robot, evenly in between, or the other end",
        "seed": "of random numbers, uniform between both ends",
    },
    "OverrideSpec": {
        **ROBOT_KEYS,
        "robot": "its number in the group, from 0",
        "position": "[m] at the start",
        "goal": "keys of a goal, in place of that of the group",
    },
    "GoalSpec": {
        "position": "[m]; one of position, trajectory and path",
        "trajectory": "of a goal that moves",
        "path": "that leads to the goal: keys of a path",
        "tolerance": "[m] within which the robot has arrived",
        "stop": "whether the robot stops there",
        "route": "whether the shortest path around obstacles at rest leads to the position",
    },
    "PathSpec": {
        "points": "[m] of the polyline",
        "speeds": "[m/s] one, or one for each point",
        "lookahead": "[s] of driving from the robot to its target on the path",
        "laps": "how often a closed path is driven",
        "cut": "[m] by which corners may be cut; by default half the radius of the robot",
    },
    "HalfSpaceSpec": {"normal": "direction", "offset": "normal . x is at most this"},
    "ObstacleSpec": {
        "shape": "one of the shapes; either this key or radius",
        "radius": "[m] of a disc, in space of a ball",
        "name": "in results",
        "heading": "[rad] of the shape; motion: along the velocity; or a mapping of times [s] and angles [rad]",
        "uncertainty": "of the position",
        "after_end": "what follows the end of the trajectory; unknown: it leaves",
        "contact_at_rest": "whether a contact counts while the robot is at rest",
        "owner": "name of the obstacle of which it is a future",
        "trajectory": "one of the trajectories",
    },
    "RecordingSpec": {
        "file": "relative to the scenario file",
        "format": "by default recognised",
        "radius": "[m] of agents without one in the file",
        "agents": "ids of the only agents to read",
        "without": "ids of agents to leave out",
        "window": "[s] start and end, in the time of the recording",
        "interpolation": "between rows",
        "gap": "[s] above which a track is split",
        "jump_speed": "[m/s] above which an agent is refused",
        "keep": "first or last of several rows of an agent at one time",
        "frame_rate": "[Hz] of a format with frame numbers",
        "unit": "of lengths: m, cm, mm, km, ft or a number [m]",
        "time_unit": "of times: s, ms, us, ns, min or h",
        "encoding": "of a table, such as latin-1",
        "case": "of an INTERACTION file",
        "columns": "columns of a table by field",
        "origin": "latitude, longitude [degree] and altitude [m] of 0, 0, 0",
        "epoch": "time 0, in seconds or ISO 8601",
        "altitude_unit": "[m] of the altitude",
    },
    "StudySpec": {
        "title": "of the page",
        "text": "first paragraph of the page",
        "methods": "of rows without their own",
        "seeds": "number of seeds of rows without their own",
        "metrics": "further columns, names of `slalom list metrics`",
        "scenarios": "rows: keys of a row of a study",
    },
    "ScenarioRowSpec": {
        "scenario": "a name of the gallery, a scenario file, or a file of test cases",
        "settings": "NAME: VALUE of parameters and settings; lists of values are combined",
        "methods": "of this row",
        "seeds": "number of seeds of this row",
    },
}
"""Meaning of each key of files, by model; a test refuses a key without one."""


class Mapped(NamedTuple):
    """A mapping of a file: its title and its model."""

    title: str
    model: type[BaseModel]


class Family(NamedTuple):
    """Parts with the key `kind`: their title, and their classes by kind."""

    title: str
    kinds: Mapping[str, type]


class Key(NamedTuple):
    """A key of a mapping, in words; `default` is "required", or "-" if there is no value by default."""

    name: str
    value: str
    default: str
    meaning: str


MAPPINGS: Final[Mapping[str, Mapped]] = {
    "scenario": Mapped("A scenario", ScenarioSpec),
    "cases": Mapped("A scenario file with cases: also", CasesSpec),
    "robot": Mapped("A robot", RobotSpec),
    "group": Mapped("A group of robots", GroupSpec),
    "table": Mapped("Robots of a table", TableSpec),
    "flow": Mapped("A flow of robots", FlowSpec),
    "flow_table": Mapped("Flows of a table", FlowTableSpec),
    "tasks": Mapped("Tasks", TasksSpec),
    "station": Mapped("A station", StationSpec),
    "service": Mapped("A time of service, drawn", TimeRangeSpec),
    "task": Mapped("A task", TaskSpec),
    "group_goal": Mapped("The goals of a group", GroupGoalSpec),
    "range": Mapped("A range of numbers", RangeSpec),
    "override": Mapped("A robot of a group that differs", OverrideSpec),
    "goal": Mapped("A goal", GoalSpec),
    "path": Mapped("A path", PathSpec),
    "half_space": Mapped("A half-space", HalfSpaceSpec),
    "obstacle": Mapped("An obstacle", ObstacleSpec),
    "recording": Mapped("A recording", RecordingSpec),
    "study": Mapped("A study", StudySpec),
    "study_row": Mapped("A row of a study", ScenarioRowSpec),
}
"""Mappings of files by the name of their keys on the command line."""
FAMILIES: Final[Mapping[str, Family]] = {
    "patterns": Family("Positions and goals of a group", LAYOUTS),
    "goal_patterns": Family(
        "Goals of a group alone", {kind: part for kind, part in GOALS.items() if kind not in LAYOUTS}
    ),
    "trajectories": Family("Trajectories", TRAJECTORIES),
    "shapes": Family("Shapes", SHAPES),
    "bounds": Family("Bounds", BOUNDS),
    "uncertainties": Family("Uncertainties", UNCERTAINTIES),
    "objectives": Family("Objectives", OBJECTIVES),
}
"""Families of parts by the name of their keys on the command line."""
WORDS: Final = {float: "number", int: "whole number", str: "text", bool: "true or false", list: "list"}


def in_words(hint: Any, metadata: Sequence[Any] = ()) -> str:
    """Return the type of a key in words."""
    metadata = [m for item in metadata for m in (item.metadata if isinstance(item, FieldInfo) else [item])]
    if any(isinstance(item, OfAnyKind) for item in metadata):
        return "part with a `kind`"
    for item in metadata:
        if isinstance(item, NumberOrRange):
            return f"{in_words(item.number)}, or a range"
    if get_origin(hint) is Annotated:
        return in_words(get_args(hint)[0], get_args(hint)[1:])
    if get_origin(hint) is Literal:
        return " or ".join(f"`{value}`" for value in get_args(hint))
    if get_origin(hint) is list:
        (item,) = get_args(hint)
        bounds = {type(m).__name__: m for m in metadata}
        if "MinLen" in bounds and "MaxLen" in bounds and in_words(item) == "number":
            return "2 or 3 numbers" if bounds["MaxLen"].max_length == 3 else "2 numbers"
        inner = in_words(item)
        return f"list of {inner}s" if inner in ("number", "text") else f"list of ({inner})"
    if get_origin(hint) is dict:
        inner = in_words(get_args(hint)[1]).removesuffix("s")
        return f"mapping from texts to {inner}s"
    if get_origin(hint) is tuple:
        return f"list of {len(get_args(hint))}: {', '.join(in_words(item) for item in get_args(hint))}"
    if get_args(hint):
        return " or ".join(in_words(item) for item in get_args(hint) if item is not NoneType)
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return "mapping"
    words = WORDS.get(hint, "value")
    limits = {type(m).__name__: m for m in metadata}
    if "Gt" in limits:
        return f"{words} above {limits['Gt'].gt:g}"
    return f"{words}, {limits['Ge'].ge:g} or more" if "Ge" in limits else words


def keys_of(model: type[BaseModel], meaning: Callable[[str], str]) -> list[Key]:
    """Return the keys of a mapping without `kind`, each with its `meaning`."""
    return [
        Key(name, in_words(field.annotation, field.metadata), _default(field), meaning(name))
        for name, field in model.model_fields.items()
        if name != "kind"
    ]


def _default(field: FieldInfo) -> str:
    """Return the default of a key in words."""
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if isinstance(value, bool):
        return str(value).lower()
    return "-" if value in (None, [], "") or isinstance(value, BaseModel) else str(value)


def mapping_keys(name: str) -> list[Key]:
    """Return the keys of one of MAPPINGS."""
    model = MAPPINGS[name].model
    return keys_of(model, MEANINGS[model.__name__].__getitem__)


def kind_keys(kind: str, part: type) -> list[Key]:
    """Return the keys of a part; their meaning is the unit."""
    return keys_of(model_of_part(kind, part), partial(unit_of, kind))


def sentence_of(part: type) -> str:
    """Return the first sentence of the docstring of a part."""
    return (inspect.getdoc(part) or "").partition("\n")[0]


def listed(name: str | None) -> dict[str, dict[str, dict[str, str]]]:
    """Return rows for `slalom list keys`: the keys of a mapping, of a family or of a kind; None: the names of all.

    Raises:
        InvalidInput: an unknown name.
    """
    kinds = {kind: part for family in FAMILIES.values() for kind, part in family.kinds.items()}
    if name is None:
        mappings = {each: ", ".join(mapped.model.model_fields) for each, mapped in MAPPINGS.items()}
        families = {each: "kind: " + ", ".join(family.kinds) for each, family in FAMILIES.items()}
        return {"keys": {each: {"sentence": text} for each, text in (mappings | families).items()}}
    if name in MAPPINGS:
        return {name: {key.name: _row(key, key.meaning) for key in mapping_keys(name)}}
    known(name, "keys", [*MAPPINGS, *FAMILIES, *kinds])
    return {
        f"kind: {kind} ({family.title.lower()})": {
            key.name: _row(key, "" if key.meaning == "-" else f"[{key.meaning}]") for key in kind_keys(kind, part)
        }
        for of, family in FAMILIES.items()
        for kind, part in family.kinds.items()
        if name in (of, kind)
    }


def _row(key: Key, meaning: str) -> dict[str, str]:
    """Return a row of a list: the sentence, and its parts for JSON."""
    default = {"-": "", "required": ", required"}.get(key.default, f", by default {key.default}")
    sentence = f"{key.value}{default}" + (f": {meaning}" if meaning else "")
    return {"sentence": sentence, "value": key.value, "default": key.default, "meaning": key.meaning}
