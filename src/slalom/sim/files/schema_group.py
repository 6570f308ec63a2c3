"""Model of a group of robots in a scenario file, and the robots that it stands for."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, NamedTuple

import numpy as np
from pydantic import ConfigDict, Field, GetCoreSchemaHandler, TypeAdapter, create_model
from pydantic.fields import FieldInfo
from pydantic_core import core_schema

from slalom.checks import vectors
from slalom.sim.files.patterns import GOALS, LAYOUTS, generator
from slalom.sim.files.schema_base import Model, ModelByContent, NotNegative, Place, Positive
from slalom.sim.files.schema_parts import OfAnyKind, PartModel
from slalom.sim.files.schema_robot import RobotKeys, RobotSpec
from slalom.sim.files.yaml_errors import Mistakes
from slalom.tolerances import YAML_VALUES

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


@dataclass(frozen=True, eq=False)
class NumberOrRange(ModelByContent):
    """Metadata of a field that holds a number, or a mapping with the range of the numbers of a group."""

    number: Any
    range: type[RangeSpec]

    def model_of(self, content: object) -> type[Model] | None:
        return self.range if isinstance(content, dict) else None

    def validate(self, content: object) -> object:
        """Return the number or the range. Raises the errors of pydantic, which collects them with the others."""
        if isinstance(content, dict):
            return self.range.model_validate(content)
        return TypeAdapter(self.number, config=ConfigDict(strict=True)).validate_python(content)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.validate)


PositiveOrRange = Annotated[Any, NumberOrRange(Positive, PositiveRangeSpec)]
NotNegativeOrRange = Annotated[Any, NumberOrRange(NotNegative, RangeSpec)]


class GroupGoalSpec(Model):
    """Keys that the goals of a group have in common."""

    tolerance: Positive = 0.5
    stop: bool = False


def _optional(field: FieldInfo) -> Any:
    """Return the type of a field, or None."""
    given: Any = Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
    return given | None


_KEYS: dict[str, Any] = {"robot": (Annotated[int, Field(ge=0)], ...)}
_KEYS |= {name: (_optional(field), None) for name, field in RobotSpec.model_fields.items()}
OverrideSpec = create_model("OverrideSpec", __base__=Model, __doc__="A robot of a group that differs.", **_KEYS)


class GroupSpec(RobotKeys):
    """Robots that share their settings, placed by patterns."""

    count: Annotated[int, Field(ge=1, le=YAML_VALUES // VALUES_PER_ROBOT)]
    radius: NotNegativeOrRange | None = Field(default=None, validate_default=True)
    margin: NotNegativeOrRange | None = None
    priority: PositiveOrRange = 1.0
    max_speed: PositiveOrRange
    max_acceleration: PositiveOrRange
    positions: Annotated[PartModel, OfAnyKind(LAYOUTS)]
    goals: Annotated[PartModel, OfAnyKind(GOALS)]
    goal: GroupGoalSpec = Field(default_factory=GroupGoalSpec)
    overrides: list[OverrideSpec] = Field(default_factory=list)  # type: ignore[valid-type]  # made at run time


@dataclass(frozen=True, eq=False)
class RobotOrGroupByContent(ModelByContent):
    """Metadata of an entry of `robots`: a group has a count, a robot has none."""

    def model_of(self, content: object) -> type[Model] | None:
        return GroupSpec if is_group(content) else RobotSpec

    def validate(self, content: object) -> Model:
        """Return the robot or the group. Raises the errors of pydantic, which collects them with the others."""
        return (GroupSpec if is_group(content) else RobotSpec).model_validate(content)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.validate)


RobotOrGroup = Annotated[Model, RobotOrGroupByContent()]


def is_group(content: object) -> bool:
    """Whether an entry of `robots` is a group."""
    return isinstance(content, dict) and "count" in content


class WrittenRobot(NamedTuple):
    """A robot of a file: its name, keys and place, and the places of keys that stand elsewhere."""

    name: str
    content: object
    place: Place
    elsewhere: Mapping[str, Place]

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
    count, layout, pattern = spec.count, spec.positions.build(), spec.goals.build()
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
