"""What a scenario file may say of a robot's bounds: one model for each kind, with the fields of its class."""

from typing import Annotated, Final, Literal, cast

from pydantic import Field

from slalom.bounds import BOUNDS, Bound
from slalom.sim.files.schema_base import Built, Model, Positive, Vector


class _BoundSpec(Built):
    """A bound by its kind."""

    kind: str
    heading: Vector | None = None

    def build(self) -> Bound:
        return cast(Bound, BOUNDS[self.kind](**self.model_dump(exclude={"kind"})))


class FrictionSpec(_BoundSpec):
    """Two half ellipses in the frame of the body [m/s^2]."""

    kind: Literal["friction"]
    forward: Positive
    braking: Positive
    lateral: Positive


class BoxSpec(_BoundSpec):
    """A box of accelerations [m/s^2]."""

    kind: Literal["box"]
    half_widths: Vector
    frame: Literal["world", "body"] = "world"


class ConvexPolygonSpec(_BoundSpec):
    """A convex polygon of accelerations [m/s^2]."""

    kind: Literal["convex_polygon"]
    corners: list[Vector]
    frame: Literal["world", "body"] = "world"


class HeadingConeSpec(_BoundSpec):
    """Velocities near the present heading [rad]."""

    kind: Literal["heading_cone"]
    half_angle: Positive


class TurningRadiusSpec(_BoundSpec):
    """Paths that are bent at most so much [m]."""

    kind: Literal["turning_radius"]
    least: Positive


class LeastSpeedSpec(_BoundSpec):
    """Velocities that keep the robot moving [m/s]."""

    kind: Literal["least_speed"]
    least: Positive


BoundSpec = Annotated[
    FrictionSpec | BoxSpec | ConvexPolygonSpec | HeadingConeSpec | TurningRadiusSpec | LeastSpeedSpec,
    Field(discriminator="kind"),
]

BOUND_SPECS: Final[dict[str, type[Model]]] = {
    "friction": FrictionSpec,
    "box": BoxSpec,
    "convex_polygon": ConvexPolygonSpec,
    "heading_cone": HeadingConeSpec,
    "turning_radius": TurningRadiusSpec,
    "least_speed": LeastSpeedSpec,
}
"""By kind."""
