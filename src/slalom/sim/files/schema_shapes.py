"""What a scenario file may say of shapes and of uncertainty: one model for each kind, with the fields of its class."""

from typing import Annotated, Final, Literal, cast

from pydantic import Field, FiniteFloat, ValidationInfo, field_validator

from slalom.errors import InvalidInput
from slalom.shape import SHAPES, Shape, Union, round_shape
from slalom.sim.files.schema_base import Built, Model, NotNegative, Positive, Vector
from slalom.uncertainty import UNCERTAINTIES, Uncertainty

Point = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)]


class _ShapePart(Built):
    """A shape by its kind."""

    kind: str

    def build(self) -> Shape:
        return cast(Shape, SHAPES[self.kind](**self.model_dump(exclude={"kind"})))


class DiscSpec(_ShapePart):
    """A disc."""

    kind: Literal["disc"]
    radius: NotNegative


class BallSpec(_ShapePart):
    """A ball in space."""

    kind: Literal["ball"]
    radius: NotNegative


class CapsuleSpec(_ShapePart):
    """A thick straight line."""

    kind: Literal["capsule"]
    start: Vector
    end: Vector
    radius: Positive


class RectangleSpec(_ShapePart):
    """A rectangle, its length along the heading."""

    kind: Literal["rectangle"]
    length: Positive
    width: Positive
    radius: NotNegative = 0.0


class PolygonSpec(_ShapePart):
    """A polygon, convex or not."""

    kind: Literal["polygon"]
    corners: list[Point]
    radius: NotNegative = 0.0


class PolylineSpec(_ShapePart):
    """A wall."""

    kind: Literal["polyline"]
    points: list[Point]
    radius: NotNegative = 0.0


class UnionSpec(Built):
    """Several shapes that move together."""

    kind: Literal["union"]
    shapes: list["ShapeSpec"]

    def build(self) -> Shape:
        return Union(tuple(shape.build() for shape in self.shapes))


ShapeSpec = Annotated[
    DiscSpec | BallSpec | CapsuleSpec | RectangleSpec | PolygonSpec | PolylineSpec | UnionSpec,
    Field(discriminator="kind"),
]


class BoundedErrorSpec(Built):
    """An error that is at most so large."""

    kind: Literal["bounded_error"]
    position: NotNegative = 0.0
    velocity: NotNegative = 0.0
    acceleration: NotNegative = 0.0

    def build(self) -> Uncertainty:
        return cast(Uncertainty, UNCERTAINTIES[self.kind](**self.model_dump(exclude={"kind"})))


class GaussianErrorSpec(Built):
    """A Gaussian error and the probability with which it may be larger than counted with."""

    kind: Literal["gaussian_error"]
    position: NotNegative
    velocity: NotNegative = 0.0
    probability: Positive = 0.01

    def build(self) -> Uncertainty:
        return cast(Uncertainty, UNCERTAINTIES[self.kind](**self.model_dump(exclude={"kind"})))


UncertaintySpec = Annotated[BoundedErrorSpec | GaussianErrorSpec, Field(discriminator="kind")]

SHAPE_SPECS: Final[dict[str, type[Model]]] = {
    "disc": DiscSpec,
    "ball": BallSpec,
    "capsule": CapsuleSpec,
    "rectangle": RectangleSpec,
    "polygon": PolygonSpec,
    "polyline": PolylineSpec,
    "union": UnionSpec,
    "bounded_error": BoundedErrorSpec,
    "gaussian_error": GaussianErrorSpec,
}
"""By kind."""


class Shaped(Model):
    """Something that has either a radius or a shape."""

    shape: ShapeSpec | None = None
    radius: NotNegative | None = Field(default=None, validate_default=True)

    @field_validator("radius")
    @classmethod
    def _one_of_them(cls, radius: float | None, info: ValidationInfo) -> float | None:
        # A shape with mistakes of its own is not in the data.
        if "shape" in info.data and (radius is None) == (info.data["shape"] is None):
            raise InvalidInput(f"expected either this key or shape, found {'neither' if radius is None else 'both'}")
        return radius

    def whole_shape(self, dimension: int) -> Shape:
        """The shape. Raises InvalidInput if it is of another dimension."""
        if self.shape is None:
            return round_shape(float(self.radius or 0.0), dimension)
        shape = self.shape.build()
        if shape.dimension != dimension:
            raise InvalidInput(f"expected a shape of dimension {dimension} as of the robot, found {shape.dimension}")
        return shape
