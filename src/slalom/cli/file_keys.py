"""Keys of scenario and study files, from the models that read them: for `slalom list keys`, and for the reference."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import NoneType
from typing import Annotated, Any, Final, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from slalom.bounds import BOUNDS
from slalom.checks import known
from slalom.cli.key_meanings import MEANINGS, unit_of
from slalom.objective import OBJECTIVES
from slalom.shape import SHAPES
from slalom.sim.files.patterns import GOALS, LAYOUTS
from slalom.sim.files.schema import ScenarioSpec
from slalom.sim.files.schema_group import GroupGoalSpec, GroupSpec, NumberOrRange, OverrideSpec, RangeSpec
from slalom.sim.files.schema_parts import OfAnyKind, model_of_part
from slalom.sim.files.schema_recording import RecordingSpec
from slalom.sim.files.schema_robot import GoalSpec, HalfSpaceSpec, ObstacleSpec, PathSpec, RobotSpec
from slalom.sim.sweep.study_yaml import ScenarioRowSpec, StudySpec
from slalom.trajectory import TRAJECTORIES
from slalom.uncertainty import UNCERTAINTIES


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
    "robot": Mapped("A robot", RobotSpec),
    "group": Mapped("A group of robots", GroupSpec),
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
        return f"mapping from texts to {in_words(get_args(hint)[1])}s"
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
