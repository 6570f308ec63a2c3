"""Shapes grown by the shape of a robot: the convex bodies that a point must keep out of (Minkowski)."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.obstacle import Obstacle
from slalom.shape import Part, Shape

Indices = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]


class Grown(NamedTuple):
    """An obstacle's shape grown by a robot's, as bodies: the convex hulls of the differences of their corners."""

    offsets: Array  # (b, d) [m] the body's origin from the obstacle's position
    counts: Indices  # (b,) corners
    corners: Array  # (c, 5) [m] from the body's origin, see `segments.Segments`
    radius: Array  # (b,) [m] radius
    hull_radius: Array  # (b,) [m] the largest distance of a corner from the body's origin
    unordered: Flags  # (b,)


def grown(obstacle: Obstacle, robot: Shape) -> Grown:
    """The shape of an obstacle, in its constant heading if it has one, grown by that of a robot that never turns.

    Raises:
        InvalidInput: in space, a robot and an obstacle that are both not round.
    """
    angle = None if obstacle.turns else 0.0 if isinstance(obstacle.heading, str) else obstacle.heading
    result: Grown = _grown(obstacle.shape, robot, angle)  # type: ignore[arg-type]  # shapes are values
    return result


@lru_cache(maxsize=4096)
def _grown(shape: Shape, robot: Shape, angle: float | None) -> Grown:
    d = shape.dimension
    offsets, corners, around, mixed = [], [], [], []
    for part in shape.parts:
        for other in robot.parts:
            several = len(part.corners) > 1 and len(other.corners) > 1
            if several and d == 3:
                raise InvalidInput(
                    "robot: expected a ball, or obstacles that are balls, in space; found parts with "
                    f"{len(other.corners)} and {len(part.corners)} corners"
                )
            if angle is None:
                offset, hull = _turning(part, other)
            else:
                offset, hull = _fixed(part, other, angle)
            offsets.append(offset)
            corners.append(hull)
            around.append(part.radius + other.radius)
            # Turned against each other, the corners of the sum change places.
            mixed.append(several and angle is None)
    return Grown(
        np.array(offsets),
        np.array([len(c) for c in corners], dtype=np.int64),
        np.concatenate(corners),
        np.array(around),
        np.array([float((_length(c[:, :3]) + _length(c[:, 3:])).max()) for c in corners]),
        np.array(mixed),
    )


def _length(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _turning(part: Part, other: Part) -> tuple[Array, Array]:
    """A body's origin and corners (n, 5): those of the obstacle turn, those of the robot do not."""
    mine, its = np.indices((len(part.corners), len(other.corners))).reshape(2, -1)
    corners = np.zeros((len(mine), 5))
    corners[:, :2], corners[:, 3:] = -other.corners[its], part.corners[mine]
    offset = np.zeros(2)
    if len(other.corners) == 1:
        offset, corners[:, :2] = -other.corners[0], 0.0
    return offset, corners


def _fixed(part: Part, other: Part, angle: float) -> tuple[Array, Array]:
    """A body's origin and corners (n, 5) for an obstacle in a constant heading."""
    own = part.corners if not angle else part.corners @ _rotation(angle).T
    d = own.shape[1]
    points = (own[:, None] - other.corners[None]).reshape(-1, d)
    if len(points) > 2:
        points = hull_corners(points)
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    corners = np.zeros((len(points), 5))
    corners[:, :d] = points - center
    return center, corners


def _rotation(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def hull_corners(points: Array) -> Array:
    """The corners (n, 2) of the convex hull of points in the plane, counter-clockwise; two if they lie on a line."""
    import shapely

    hull = shapely.MultiPoint(points).convex_hull
    if hull.geom_type == "Polygon":
        return np.array(shapely.get_coordinates(shapely.orient_polygons(hull))[:-1])
    return np.array(shapely.get_coordinates(hull))


def outline_parts(obstacle: Obstacle, t: float) -> list[Part]:
    """What an obstacle covers at absolute time t [s]: rounded hulls with corners in the world frame."""
    place = obstacle.trajectory.position(t)
    if obstacle.dimension == 3:
        return [Part(place + part.corners, part.radius) for part in obstacle.shape.parts]
    e = obstacle.direction(t) if obstacle.turns or not isinstance(obstacle.heading, str) else np.array([1.0, 0.0])
    turn = np.array([[e[0], -e[1]], [e[1], e[0]]])
    return [Part(place + part.corners @ turn.T, part.radius) for part in obstacle.shape.parts]
