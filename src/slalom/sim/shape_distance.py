"""Distances between shapes in the workspace, by code that shares nothing with the kernels that decide.

Two parts overlap exactly if the origin is within the sum of their radii of the convex hull of the differences of their
corners (Minkowski difference). shapely computes hulls and distances; in space only balls and capsules occur.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely

from slalom.checks import Array
from slalom.obstacle import Obstacle
from slalom.shape import Part, Shape

ORIGIN = shapely.Point(0.0, 0.0)


class Pair(NamedTuple):
    """A part of an obstacle and a part of a robot."""

    obstacle: Part
    robot: Part

    @property
    def radius(self) -> float:
        """The sum of both radii [m]."""
        return self.obstacle.radius + self.robot.radius


def pairs(obstacle: Shape, robot: Shape) -> Iterator[Pair]:
    """Every part of the obstacle with every part of the robot."""
    for part in obstacle.parts:
        for other in robot.parts:
            yield Pair(part, other)


def differences(obstacle: Obstacle, pair: Pair, times: Array, positions: Array) -> Array:
    """Differences (k, n, d) [m] of the corners of the obstacle's part and the robot's part.

    At absolute `times` (k,) [s] the robot is at `positions` (k, d) [m].
    """
    corners = np.broadcast_to(pair.obstacle.corners, (len(times), *pair.obstacle.corners.shape))
    if obstacle.angle != 0.0:
        e = obstacle.direction(times)[:, None]
        x, y = corners[..., :1], corners[..., 1:]
        corners = x * e + y * np.stack([-e[..., 1], e[..., 0]], axis=-1)
    relative = obstacle.trajectory.position(times) - positions
    difference = corners[:, :, None] - pair.robot.corners[None, None]
    return np.asarray(difference.reshape(len(times), -1, positions.shape[1]) + relative[:, None])


def signed(q: Array) -> Array:
    """Signed distances (k,) [m] of the origin to the convex hulls of q (k, n, d) [m]; inside, minus the depth."""
    if q.shape[1] == 1:
        return np.asarray(np.linalg.norm(q[:, 0], axis=1))
    if q.shape[2] == 3:
        return segment_distance(q[:, 0], q[:, -1])
    hulls = shapely.convex_hull(shapely.multipoints(q))
    distance = shapely.distance(hulls, ORIGIN)
    inside = (distance == 0.0) & (shapely.area(hulls) > 0.0)
    distance[inside] = -shapely.distance(shapely.boundary(hulls[inside]), ORIGIN)
    return np.asarray(distance)


def segment_distance(p: Array, q: Array) -> Array:
    """Distances (k,) [m] of the origin to the segments from p to q, both (k, d) [m]."""
    along = q - p
    square = np.maximum(np.sum(along * along, axis=1), 1e-300)
    share = np.clip(-np.sum(p * along, axis=1) / square, 0.0, 1.0)[:, None]
    return np.asarray(np.linalg.norm(p + share * along, axis=1))


def clearances(obstacle: Obstacle, robot: Shape, times: Array, positions: Array) -> Array:
    """Clearances (k,) [m] of a robot at `positions` (k, d) [m] to an obstacle, at absolute times (k,) [s]."""
    each = pairs(obstacle.shape, robot)
    found = [signed(differences(obstacle, pair, times, positions)) - pair.radius for pair in each]
    return np.asarray(np.min(found, axis=0))


def lowest(before: Array, after: Array, turned: Array) -> Array:
    """Lower bounds (k,) [m] of `signed` for corners that move straight from `before` to `after`, both (k, n, d) [m].

    `turned` (k,) [m] is how far corners may leave the straight line because the body turns.
    """
    both = np.concatenate([before, after], axis=1)
    if before.shape[1] == 1:
        return segment_distance(before[:, 0], after[:, 0]) - turned
    if before.shape[2] == 3:
        travel = np.linalg.norm(after - before, axis=2).max(axis=1)
        return np.asarray(np.minimum(signed(before), signed(after)) - 0.5 * travel - turned)
    return np.asarray(shapely.distance(shapely.convex_hull(shapely.multipoints(both)), ORIGIN) - turned)
