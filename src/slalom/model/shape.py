"""Shapes of obstacles and robots."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final, NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.base.checks import SHAPE, Array, Checked, NotNegative, Positive, array, check_fields, has, listing, vector
from slalom.base.errors import InvalidInput


class Part(NamedTuple):
    """Convex hull of `corners` (n, d) [m], relative to the position, rounded by `radius` [m].

    The part is the set of all points within `radius` of the hull. In the plane three or more corners are
    counter-clockwise.
    """

    corners: Array
    radius: float


@runtime_checkable
class Shape(Protocol):
    """Union of rounded convex hulls around a position, in the body frame: x forward, y to the left.

    Law: let a robot have shape A at p and an obstacle shape B at c. They overlap exactly if p lies in the Minkowski sum
    of B and -A at c. Shapes are open sets: contact is not overlap.
    """

    @property
    def dimension(self) -> int:
        """2 or 3."""

    @property
    def parts(self) -> tuple[Part, ...]:
        """Convex parts, at least one."""

    @property
    def bounding_radius(self) -> float:
        """Radius [m] of the smallest ball about the position that contains the shape."""


class _Shaped(ABC):
    """Members shared by all shapes that are not round."""

    @cached_property
    @abstractmethod
    def parts(self) -> tuple[Part, ...]:
        """Convex parts, at least one."""

    @property
    def dimension(self) -> int:
        return int(self.parts[0].corners.shape[1])

    @cached_property
    def bounding_radius(self) -> float:
        return max(float(np.linalg.norm(part.corners, axis=1).max()) + part.radius for part in self.parts)


class _Round:
    """Members shared by discs and balls."""

    radius: float
    dimension: ClassVar[int]

    def __post_init__(self) -> None:
        check_fields(self)

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        return (Part(np.zeros((1, self.dimension)), self.radius),)

    @property
    def bounding_radius(self) -> float:
        return self.radius


@dataclass(frozen=True)
class Disc(_Round):
    """Disc of `radius` >= 0 [m] in the plane."""

    dimension: ClassVar[int] = 2
    radius: NotNegative


@dataclass(frozen=True)
class Ball(_Round):
    """Ball of `radius` >= 0 [m] in space."""

    dimension: ClassVar[int] = 3
    radius: NotNegative


@dataclass(frozen=True, eq=False)
class Capsule(_Shaped):
    """All points within `radius` > 0 [m] of the segment from `start` to `end` (d,) [m], in the plane or in space."""

    start: Checked = Checked(vector)
    end: Checked = Checked(vector)
    radius: Positive  # type: ignore[misc]  # the fields before it have no default: Checked is a descriptor

    def __post_init__(self) -> None:
        vector(self.end, "end", self.start.size)
        check_fields(self)

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        return (_segment(self.start, self.end, self.radius),)


@dataclass(frozen=True)
class Rectangle(_Shaped):
    """Rectangle centred at the position, rounded by `radius` [m].

    `length` > 0 [m] is the extent along x (forward), `width` > 0 [m] along y.
    """

    length: Positive
    width: Positive
    radius: NotNegative = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        return (Part(signs * (0.5 * self.length, 0.5 * self.width), self.radius),)


def _points(value: npt.ArrayLike, name: str) -> Array:
    points = array(value, name)
    if points.ndim != 2 or points.shape[1] != 2:
        raise InvalidInput(f"{name}: expected points (n, 2) in the plane, found shape {points.shape}")
    return points


@dataclass(frozen=True, eq=False)
class Polygon(_Shaped):
    """Simple polygon of three or more `corners` (n, 2) [m], rounded by `radius` [m].

    It may be convex or not, in either orientation. A polygon that is not convex becomes a union of triangles.
    """

    corners: Checked = Checked(_points, "n 2")
    radius: NotNegative = 0.0

    def __post_init__(self) -> None:
        import shapely

        check_fields(self)
        if len(self.corners) < 3 or not shapely.Polygon(self.corners).is_valid:
            found = f"{len(self.corners)} that {'do' if len(self.corners) >= 3 else 'are too few'}"
            raise InvalidInput(
                f"corners: expected 3 or more of a polygon that does not cross or touch itself, found {found}"
            )

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        import shapely

        polygon = shapely.Polygon(self.corners)
        hull = polygon.convex_hull
        if hull.area <= polygon.area * (1.0 + 1e-12):
            return (Part(_counter_clockwise(hull), self.radius),)
        triangles = shapely.constrained_delaunay_triangles(polygon).geoms
        return tuple(Part(_counter_clockwise(triangle), self.radius) for triangle in triangles)


def _counter_clockwise(polygon: object) -> Array:
    import shapely

    exterior = shapely.get_exterior_ring(shapely.orient_polygons(polygon))
    return np.array(shapely.get_coordinates(exterior)[:-1])


@dataclass(frozen=True, eq=False)
class Polyline(_Shaped):
    """Wall: all points within `radius` >= 0 [m] of the polyline through two or more `points` (n, 2) [m]."""

    points: Checked = Checked(_points, "n 2")
    radius: NotNegative = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        if len(self.points) < 2 or not np.all(np.any(np.diff(self.points, axis=0) != 0.0, axis=1)):
            raise InvalidInput(
                f"points: expected 2 or more, each different from the one before it, found {self.points.tolist()}"
            )

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        return tuple(Part(ends, self.radius) for ends in np.stack([self.points[:-1], self.points[1:]], axis=1))

    @cached_property
    def bounding_radius(self) -> float:
        # Of all points at once: walls of files have up to millions.
        return float(np.linalg.norm(self.points, axis=1).max()) + self.radius


@dataclass(frozen=True, eq=False)
class Union(_Shaped):
    """Union of shapes of one dimension that move together."""

    shapes: tuple[Shape, ...]

    def __post_init__(self) -> None:
        listing(self.shapes, "shapes", "shapes")
        for k, shape in enumerate(self.shapes):
            has(shape, *SHAPE, f"shapes[{k}]")
        object.__setattr__(self, "shapes", tuple(self.shapes))
        dimensions = sorted({shape.dimension for shape in self.shapes})
        if len(dimensions) != 1:
            raise InvalidInput(f"shapes: expected one or more of the same dimension, found dimensions {dimensions}")

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        return tuple(part for shape in self.shapes for part in shape.parts)


def _segment(a: Array, b: Array, radius: float) -> Part:
    return Part(np.array([a] if np.array_equal(a, b) else [a, b]), radius)


def round_shape(radius: float, dimension: int) -> Shape:
    """Disc or ball of `radius` [m]."""
    return Disc(radius) if dimension == 2 else Ball(radius)


def is_round(shape: Shape) -> bool:
    """Whether a shape is one disc or ball about its position."""
    return len(shape.parts) == 1 and len(shape.parts[0].corners) == 1 and not shape.parts[0].corners.any()


def refuse_turned(shape: Shape, heading: float | None, name: str) -> None:
    """Raise InvalidInput for a heading [rad] other than 0 of a robot that is not round: its shape never turns.

    A robot that keeps its heading has a shape that is turned by it already.
    """
    if heading and not is_round(shape):
        raise InvalidInput(
            f"{name}: expected none for a {type(shape).__name__}, whose axes are those of the world, found "
            f"{heading:g} rad; give a disc, a Polygon turned by it, or a VehicleNavigator, whose body turns"
        )


SHAPES: Final[dict[str, type[Shape]]] = {
    "disc": Disc,
    "ball": Ball,
    "capsule": Capsule,
    "rectangle": Rectangle,
    "polygon": Polygon,
    "polyline": Polyline,
    "union": Union,
}
"""Shapes by name."""
