"""Models of the robots and obstacles of scenario files: one for each mapping in them."""

from dataclasses import dataclass
from math import isfinite
from typing import Annotated, Any, Literal, cast

from pydantic import AfterValidator, Field, FiniteFloat, GetCoreSchemaHandler, ValidationInfo, field_validator
from pydantic_core import core_schema

from slalom.checks import shown
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import HalfSpace
from slalom.methods import method
from slalom.obstacle import Headings
from slalom.path_goal import PathGoal
from slalom.shape import Shape, round_shape
from slalom.sim.files.schema_base import Built, Model, ModelByContent, NotNegative, Positive, Text, Vector
from slalom.sim.files.schema_parts import BoundModel, ObjectiveModel, ShapeModel, TrajectoryModel, UncertaintyModel
from slalom.trajectory import Stationary


class Shaped(Model):
    """A body that has either a radius or a shape."""

    shape: ShapeModel | None = None
    radius: NotNegative | None = Field(default=None, validate_default=True)

    @field_validator("radius")
    @classmethod
    def _one_of_them(cls, radius: float | None, info: ValidationInfo) -> float | None:
        # A shape with mistakes of its own is not in the data.
        if "shape" in info.data and (radius is None) == (info.data["shape"] is None):
            raise InvalidInput(f"expected either this key or shape, found {'neither' if radius is None else 'both'}")
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


class GoalSpec(Built):
    """The goal of a robot: a position, a trajectory, or the end of a path that is followed there."""

    position: Vector | None = None
    trajectory: TrajectoryModel | None = None
    path: PathSpec | None = None
    tolerance: Positive = 0.5
    stop: bool = False

    def build(self) -> Goal:
        given = {"position": self.position, "trajectory": self.trajectory, "path": self.path}
        found = [name for name, value in given.items() if value is not None]
        if len(found) != 1:
            raise InvalidInput(f"expected one of {', '.join(given)}, found {' and '.join(found) or 'none'}")
        if self.path is not None:
            return PathGoal(
                self.path.points, self.path.speeds, self.tolerance, self.stop, lookahead=self.path.lookahead
            )
        if self.trajectory is not None:
            return Goal(self.trajectory.build(), self.tolerance, self.stop)
        assert self.position is not None
        return Goal(Stationary(self.position), self.tolerance, self.stop)


class HalfSpaceSpec(Built):
    """The half-space normal . x <= offset."""

    normal: Vector
    offset: FiniteFloat

    def build(self) -> HalfSpace:
        return HalfSpace(self.normal, self.offset)


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


class RobotSpec(RobotKeys):
    """A robot, in SI units. Its orientation is constant."""

    position: Vector
    goal: GoalSpec


class HeadingsSpec(Built):
    """Keys of `Headings`: angles [rad] at times [s]."""

    times: Annotated[list[FiniteFloat], Field(min_length=1)]
    angles: Annotated[list[FiniteFloat], Field(min_length=1)]

    def build(self) -> Headings:
        """Return the headings."""
        return Headings(self.times, self.angles)


@dataclass(frozen=True, eq=False)
class HeadingOfContent(ModelByContent):
    """Metadata of the heading of an obstacle: one message for a content that is none."""

    def model_of(self, content: object) -> type[Model] | None:
        """Return the model of angles over time for a mapping."""
        return HeadingsSpec if isinstance(content, dict) else None

    def validate(self, content: object) -> object:
        """Return the validated heading. Raises the errors of pydantic, which collects them with the others."""
        if isinstance(content, dict):
            return HeadingsSpec.model_validate(content)
        if content == "motion" or (type(content) in (int, float) and isfinite(cast(float, content))):
            return content
        raise InvalidInput(f"expected an angle [rad], 'motion', or times and angles; found {shown(content)}")

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.validate)


HeadingModel = Annotated[float | Literal["motion"] | HeadingsSpec, HeadingOfContent()]


def heading_of(spec: float | Literal["motion"] | HeadingsSpec) -> float | Literal["motion"] | Headings:
    """The heading of an obstacle from its model."""
    return spec.build() if isinstance(spec, HeadingsSpec) else spec


class ObstacleSpec(Shaped):
    """A shape on a trajectory."""

    name: str = ""
    heading: HeadingModel = 0.0
    uncertainty: UncertaintyModel | None = None
    trajectory: TrajectoryModel
