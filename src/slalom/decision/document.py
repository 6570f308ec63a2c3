"""Files that hold everything from which a decision was made, as JSON.

An object is written as the name of its class and the arguments of its constructor, which it has as attributes. So a new
argument is in files without a line here. A class that is neither in `KINDS` nor in a table of parts is refused.
"""

import inspect
import json
import platform
from collections.abc import Callable, Mapping, Sequence, Set as AbstractSet
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from functools import lru_cache
from importlib.metadata import version
from math import isfinite
from pathlib import Path as FilePath
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from slalom.base.checks import Checked, shown, vector
from slalom.base.errors import InvalidInput
from slalom.base.registry import Tables, to_plain
from slalom.base.writing import write_file
from slalom.decision.decision import Approach, Commitment, Decision, DecisionInputs, Outcome, Record, not_kept
from slalom.decision.methods import Method, derived, variant_of
from slalom.decision.navigator import Navigator
from slalom.decision.objective import OBJECTIVES
from slalom.decision.settings import HORIZONS, Risk
from slalom.forecast.forecast import FORECASTS, FromModels, FromPast
from slalom.kernels.arrays import EVERY_WORLD
from slalom.model.bounds import BOUNDS, Bound
from slalom.model.goal import Goal
from slalom.model.limits import HalfSpace, Limits
from slalom.model.manoeuvre import Continuation, Manoeuvre
from slalom.model.path import Path
from slalom.model.path_goal import PathGoal
from slalom.model.response import RESPONSES, Response
from slalom.model.response.kinds import AccelerationSequence
from slalom.model.shape import SHAPES, Shape
from slalom.model.state import State
from slalom.model.trajectory import TRAJECTORIES, Composite, Trajectory
from slalom.model.uncertainty import UNCERTAINTIES, Adjusted, Covering, Uncertainty
from slalom.obstacle import Headings, Obstacle
from slalom.obstacle.occupancy import Frame, OccupancyTable, Runs
from slalom.obstacle.scan import Scan
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks

FORMAT: Final = "slalom decision 2"
RESPONSE_KINDS: Final = {kind.__name__: kind for kind in (*RESPONSES, AccelerationSequence)}
TABLES: Final[Tables] = {
    Shape: SHAPES,
    Trajectory: TRAJECTORIES,
    Bound: BOUNDS,
    Uncertainty: UNCERTAINTIES,
    Response: RESPONSE_KINDS,
}
"""Tables of parts by their protocol."""
_OWN: Final = (
    *(Adjusted, Approach, Commitment, Composite, Continuation, Covering, Decision, DecisionInputs, Frame, FromModels),
    *(FromPast, Goal, HalfSpace, Headings, Limits, Manoeuvre, Method, Navigator, Obstacle, ObstacleTable),
    *(OccupancyTable, Outcome, Path, PathGoal, Risk, Runs, Scan, State, Tracks),
)
KINDS: Final[dict[str, type]] = {cls.__name__: cls for cls in _OWN}
"""Classes in files by their names there, besides those of the tables of parts; packages add theirs."""
_READ: Final[dict[type, dict[str, Callable[[Any], Any]]]] = {
    ObstacleTable: {"obstacles": lambda table: table.given},
    Tracks: {
        "uncertainty": lambda tracks: tracks.uncertainties,
        "worlds": lambda tracks: None if np.all(tracks.worlds == EVERY_WORLD) else tracks.worlds,
        "ids": lambda tracks: tuple(one if isinstance(one, int | str) else str(one) for one in tracks.ids),
    },
}
"""Arguments of constructors that are no attributes of the same name."""
_LEFT_OUT: Final = ("control_obstacle", "earlier", "begun", "record")
"""Attributes of decisions that no later decision depends on, except by a delay that its file does not have any more."""


def goal_to_plain(goal: Goal, where: str) -> dict[str, Any]:
    """A goal with the keys of scenario files: its path or its trajectory, and its end."""
    ends = {"tolerance": goal.tolerance, "stop": bool(goal.stop)}
    if isinstance(goal, PathGoal):
        return {
            "path": {name: to_plain(getattr(goal, name)) for name in ("points", "speeds", "lookahead", "laps", "cut")},
            **ends,
        }
    return {"trajectory": to_plain(goal.trajectory, TRAJECTORIES, where), **ends}


# Documents of decisions.


RESULT: Final = ("outcome", "manoeuvre", "given_up", "work", "command", "motions", "first_contact", "arrival")
"""What a repeated decision has to the bit, where it has it."""


def dump(decision: Decision, file: FilePath) -> None:
    """Write the inputs and the result of a decision as JSON, see `Decision.dump`."""
    write_file(file, json.dumps(document(decision), indent=1, allow_nan=False) + "\n")


def record_of(decision: Decision) -> Record:
    """All inputs of a decision. Raises InvalidInput for one without."""
    record = decision.record or decision.inputs
    if record is None:
        raise InvalidInput("decision: expected one that a navigator made, found one without inputs")
    return record


def document(decision: Decision) -> dict[str, Any]:
    """The inputs and the result of a decision as texts, finite numbers, lists and mappings: floats are exact."""
    return {
        "format": FORMAT,
        "versions": {
            **{package: version(package) for package in ("slalom", "numpy", "numba")},
            "python": platform.python_version(),
            "machine": f"{platform.system()} {platform.machine()}",
        },
        "inputs": _Writer().plain(record_of(decision), "inputs"),
        "decision": result(decision),
    }


def result(decision: Decision) -> dict[str, Any]:
    """What a decision has of RESULT, to the bit."""
    found = {name: getattr(decision, name) for name in RESULT if hasattr(decision, name)}
    return {name: _Writer().plain(value, f"decision.{name}") for name, value in found.items()}


def kinds() -> dict[str, type]:
    """All classes that files hold, by their names there."""
    parts = (*TABLES.values(), HORIZONS, OBJECTIVES, {name: type(one) for name, one in FORECASTS.items()})
    return {cls.__name__: cls for table in parts for cls in table.values()} | KINDS


@lru_cache(maxsize=256)
def arguments_of(cls: Any) -> tuple[str, ...]:
    """Names of the arguments of the constructor of a class that its objects in files have."""
    names = inspect.signature(cls).parameters
    return tuple(name for name in names if not (issubclass(cls, Decision) and name in _LEFT_OUT))


def _of_method(found: Method) -> dict[str, Any]:
    """A method as its name in the table, the operation that makes it of that, and what else is changed."""
    variant = variant_of(found)
    made = derived(found.name, variant)
    changed = {each.name: getattr(found, each.name) for each in fields(Method)}
    changed = {name: value for name, value in changed.items() if value != getattr(made, name)}
    return {"name": found.name, "variant": variant, "changed": changed}


class _Writer:
    """What makes objects plain. One that comes again is written as the place where it came first."""

    def __init__(self) -> None:
        self._names = {cls: name for name, cls in kinds().items()}
        self._places: dict[int, tuple[Any, str]] = {}  # the object too: another one could get its number

    def plain(self, value: Any, where: str) -> Any:
        """A value as texts, finite numbers, lists and mappings. Raises InvalidInput for what no file can hold."""
        if isinstance(value, np.ndarray):
            return self._array(value, where)
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or isinstance(value, bool | int | str):
            return value
        if isinstance(value, float):
            return value if isfinite(value) else {"number": str(value)}
        if isinstance(value, Mapping):
            return {"map": {str(key): self.plain(one, f"{where}.{key}") for key, one in value.items()}}
        if isinstance(value, Sequence) and not hasattr(value, "_fields"):
            return [self.plain(one, f"{where}.{k}") for k, one in enumerate(value)]
        return self._object(value, where)

    def _array(self, value: Any, where: str) -> dict[str, Any]:
        found: dict[str, Any] = {"array": self.plain(value.tolist(), where)}
        if value.dtype != np.float64:
            found["type"] = value.dtype.name
        return found if value.size else found | {"shape": list(value.shape)}

    def _object(self, value: Any, where: str) -> Any:
        cls: Any = type(value)
        if cls not in self._names:
            raise InvalidInput(f"{where}: expected a part that files can hold, found {cls.__name__}")
        if isinstance(value, Enum):
            return {"kind": self._names[cls], "name": value.name}
        if id(value) in self._places:
            return {"same_as": self._places[id(value)][1]}
        self._places[id(value)] = value, where
        if isinstance(value, Method):
            given = _of_method(value)
        else:
            read = _READ.get(cls, {})
            given = {name: read[name](value) if name in read else getattr(value, name) for name in arguments_of(cls)}
        return {"kind": self._names[cls]} | {name: self.plain(one, f"{where}.{name}") for name, one in given.items()}


# Objects of documents.


def made(content: Any, where: str) -> Any:
    """The object of what `_Writer` wrote. Raises InvalidInput, which names the place, for anything else."""
    return _Reader().made(content, where)


class _Reader:
    """What makes objects of plain values."""

    def __init__(self) -> None:
        self._kinds = kinds()
        self._objects: dict[str, Any] = {}

    def made(self, content: Any, where: str) -> Any:
        """The object of a plain value."""
        if isinstance(content, list):
            return tuple(self.made(one, f"{where}.{k}") for k, one in enumerate(content))
        if not isinstance(content, dict):
            return content
        if "kind" in content:
            self._objects[where] = found = self._object(content, where)
            return found
        match content:
            case {"same_as": str(place)} if place in self._objects:
                return self._objects[place]
            case {"number": "inf" | "-inf" | "nan" as text}:
                return float(text)
            case {"map": dict(items)}:
                return {name: self.made(one, f"{where}.{name}") for name, one in items.items()}
            case {"array": list(rows)}:
                return self._array(self.made(rows, where), content, where)
        raise InvalidInput(f"{where}: expected a part, an array or a place before, found keys {', '.join(content)}")

    def _array(self, rows: Any, content: dict[str, Any], where: str) -> Any:
        try:
            return np.array(rows, content.get("type", "float64")).reshape(content.get("shape", np.shape(rows)))
        except (TypeError, ValueError) as error:
            raise InvalidInput(f"{where}: expected an array of numbers, found {error}") from None

    def _object(self, content: dict[str, Any], where: str) -> Any:
        kind = content["kind"]
        cls: Any = self._kinds.get(kind) if isinstance(kind, str) else None
        if cls is None:
            raise InvalidInput(f"{where}.kind: expected a class that files can hold, found {shown(kind)}")
        names = ("name",) if issubclass(cls, Enum) else _METHOD if cls is Method else arguments_of(cls)
        given = {name: self.made(value, f"{where}.{name}") for name, value in content.items() if name != "kind"}
        if set(given) != set(names):
            raise InvalidInput(f"{where}: expected {', '.join(names) or 'no key'}, found {', '.join(given) or 'none'}")
        for name, value in given.items():
            _refuse_other(value, _hints(cls).get(name, Any), f"{where}.{name}")
        try:
            return self._made(cls, given)
        except InvalidInput as error:
            raise InvalidInput(f"{where}: {error}") from None
        except (AttributeError, OverflowError, TypeError, ValueError) as error:
            raise InvalidInput(f"{where}: expected what makes a {kind}, found {error}") from None

    def _made(self, cls: Any, given: dict[str, Any]) -> Any:
        if issubclass(cls, Enum):
            if given["name"] not in cls.__members__:
                raise InvalidInput(f"name: expected one of {', '.join(cls.__members__)}, found {given['name']!r}")
            return cls[given["name"]]
        if cls is Method:
            _refuse_other(given["changed"], dict, "changed")
            return replace(derived(given["name"], given["variant"]), **given["changed"])
        found = cls(**given, control_obstacle=not_kept) if issubclass(cls, Decision) else cls(**given)
        if cls is Path:
            _refuse_path(found)
        if cls is Approach:
            vector(found.target, "target")
        return found


_METHOD: Final = ("name", "variant", "changed")


def _refuse_path(path: Path) -> None:
    """Raise InvalidInput for a path whose arrays do not fit each other."""
    n = len(path.times) - 1
    points, error = path.points.shape, path.error.shape
    if path.times.ndim != 1 or n < 1 or points[:2] != (n, 4) or error != (n,) or np.any(np.diff(path.times) <= 0.0):
        raise InvalidInput(f"path: expected increasing times and {n} pieces, found shapes {points} and {error}")


@lru_cache(maxsize=64)
def _hints(cls: Any) -> dict[str, Any]:
    """The annotations of the fields of a class; none of a class that is no dataclass and no named tuple."""
    return get_type_hints(cls) if is_dataclass(cls) or hasattr(cls, "_fields") else {}


def _refuse_other(value: Any, hint: Any, where: str) -> None:
    """Raise InvalidInput for a value that is not of the type of an annotation."""
    if not _is(value, hint):
        name = getattr(hint, "__name__", str(hint))
        raise InvalidInput(f"{where}: expected {name}, found {type(value).__name__}")


def _is(value: Any, hint: Any) -> bool:
    """Whether a value is of the type of an annotation."""
    origin, inner = get_origin(hint), get_args(hint)
    if hint in (Any, Checked) or origin is Literal:
        return hint in (Any, Checked) or value in inner
    if origin in (UnionType, Union):
        return any(_is(value, one) for one in inner)
    if origin is Annotated:
        return _is(value, inner[0])
    if hint in (int, float):
        return isinstance(value, int | hint) and not isinstance(value, bool)
    if origin is tuple and inner[1:] != (...,):
        return isinstance(value, tuple) and len(value) == len(inner) and all(map(_is, value, inner))
    if origin in (tuple, Sequence, AbstractSet):
        return isinstance(value, tuple) and all(_is(one, inner[0]) for one in value)
    return isinstance(value, origin or (NoneType if hint is None else hint))
