"""Minkowski sums of obstacle and robot shapes: convex bodies that the robot's position must avoid."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.kernels.arrays import Flags, Indices
from slalom.obstacle.obstacle import Obstacle
from slalom.shape import Part, Shape


class MinkowskiSum(NamedTuple):
    """Obstacle shape grown by the robot shape, as b convex bodies: hulls of the differences of their corners."""

    offsets: Array  # (b, d) [m] the body's origin from the obstacle's position
    counts: Indices  # (b,) corners
    corners: Array  # (c, 5) [m] from the body's origin, see `RelativeMotion`
    radius: Array  # (b,) [m] rounding
    hull_radius: Array  # (b,) [m] the largest distance of a corner from the body's origin
    unordered: Flags  # (b,)


def minkowski_sum(obstacle: Obstacle, robot: Shape) -> MinkowskiSum:
    """Minkowski sum of an obstacle's shape and the reflection of a robot that never turns.

    The obstacle is in its constant heading if it has one, otherwise in its body frame.

    Raises:
        InvalidInput: in space, neither robot nor obstacle is round.
    """
    result: MinkowskiSum = _minkowski_sum(obstacle.shape, robot, obstacle.angle)  # type: ignore[arg-type]  # shapes are values
    return result


def sum_of_shapes(shape: Shape, robot: Shape) -> MinkowskiSum:
    """Minkowski sum of a shape and the reflection of a robot's, neither of which turns; raises as `minkowski_sum`."""
    result: MinkowskiSum = _minkowski_sum(shape, robot, 0.0)  # type: ignore[arg-type]  # shapes are values
    return result


@lru_cache(maxsize=4096)
def _minkowski_sum(shape: Shape, robot: Shape, angle: float | None) -> MinkowskiSum:
    d = shape.dimension
    offsets, corners, radii, unordered = [], [], [], []
    for part in shape.parts:
        for other in robot.parts:
            both_polygonal = len(part.corners) > 1 and len(other.corners) > 1
            if both_polygonal and d == 3:
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
            radii.append(part.radius + other.radius)
            # The order of the corners of the sum changes with the heading.
            unordered.append(both_polygonal and angle is None)
    return MinkowskiSum(
        np.array(offsets),
        np.array([len(c) for c in corners], dtype=np.int64),
        np.concatenate(corners),
        np.array(radii),
        np.array([float((_length(c[:, :3]) + _length(c[:, 3:])).max()) for c in corners]),
        np.array(unordered),
    )


def _length(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _turning(part: Part, other: Part) -> tuple[Array, Array]:
    """Origin (2,) and corners (n, 5) [m] of a body; the parts of the obstacle turn, those of the robot do not."""
    own, others = np.indices((len(part.corners), len(other.corners))).reshape(2, -1)
    corners = np.zeros((len(own), 5))
    corners[:, :2], corners[:, 3:] = -other.corners[others], part.corners[own]
    offset = np.zeros(2)
    if len(other.corners) == 1:
        offset, corners[:, :2] = -other.corners[0], 0.0
    return offset, corners


def _fixed(part: Part, other: Part, angle: float) -> tuple[Array, Array]:
    """Origin (d,) and corners (n, 5) [m] of a body for an obstacle in a constant heading `angle` [rad]."""
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
    """Corners (n, 2) of the convex hull of points (m, 2) in the plane, counter-clockwise; two if they are collinear."""
    import shapely

    hull = shapely.MultiPoint(points).convex_hull
    if hull.geom_type == "Polygon":
        return np.array(shapely.get_coordinates(shapely.orient_polygons(hull))[:-1])
    return np.array(shapely.get_coordinates(hull))


def outline_parts(obstacle: Obstacle, t: float) -> list[Part]:
    """Parts of an obstacle at absolute time t [s]: rounded hulls with corners (n, d) [m] in the world frame."""
    position = obstacle.trajectory.position(t)
    if obstacle.dimension == 3:
        return [Part(position + part.corners, part.radius) for part in obstacle.shape.parts]
    e = obstacle.direction(t) if obstacle.angle is None else np.array([np.cos(obstacle.angle), np.sin(obstacle.angle)])
    turn = np.array([[e[0], -e[1]], [e[1], e[0]]])
    return [Part(position + part.corners @ turn.T, part.radius) for part in obstacle.shape.parts]
