"""Distances between whole shapes in the workspace, by code that shares nothing with the deciding kernels.

A robot's part and an obstacle's part overlap exactly if the differences of their corners have the origin within the sum
of the radii of their convex hull (Minkowski). Hulls and distances are shapely's; in space only balls and capsules
occur.
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
        """Both radii [m]."""
        return self.obstacle.radius + self.robot.radius


def pairs(obstacle: Shape, robot: Shape) -> Iterator[Pair]:
    """Every part of one with every part of the other."""
    for part in obstacle.parts:
        for other in robot.parts:
            yield Pair(part, other)


def differences(obstacle: Obstacle, pair: Pair, times: Array, places: Array) -> Array:
    """Corners of the obstacle's part less those of the robot's: (k, n, d) [m] at absolute times (k,), robots at (k,
    d).
    """
    corners = np.broadcast_to(pair.obstacle.corners, (len(times), *pair.obstacle.corners.shape))
    if obstacle.turns or obstacle.heading != 0.0:
        e = obstacle.direction(times)[:, None]
        x, y = corners[..., :1], corners[..., 1:]
        corners = x * e + y * np.stack([-e[..., 1], e[..., 0]], axis=-1)
    relative = obstacle.trajectory.position(times) - places
    apart = corners[:, :, None] - pair.robot.corners[None, None]
    return np.asarray(apart.reshape(len(times), -1, places.shape[1]) + relative[:, None])


def signed(q: Array) -> Array:
    """Signed distance (k,) of the origin to the convex hulls of q (k, n, d): inside, minus the depth."""
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
    """Distance (k,) of the origin from the segments p to q, both (k, d)."""
    along = q - p
    square = np.maximum(np.sum(along * along, axis=1), 1e-300)
    share = np.clip(-np.sum(p * along, axis=1) / square, 0.0, 1.0)[:, None]
    return np.asarray(np.linalg.norm(p + share * along, axis=1))


def clearances(obstacle: Obstacle, robot: Shape, times: Array, places: Array) -> Array:
    """Clearance [m] between an obstacle and a robot at places (k, d) at absolute times (k,): (k,)."""
    found = [signed(differences(obstacle, pair, times, places)) - pair.radius for pair in pairs(obstacle.shape, robot)]
    return np.asarray(np.min(found, axis=0))


def lowest(before: Array, after: Array, turned: Array) -> Array:
    """A lower bound (k,) of `signed` for corners that go straight from before to after, both (k, n, d).

    `turned` (k,) [m] is by how much corners may leave the straight line since the body turns.
    """
    both = np.concatenate([before, after], axis=1)
    if before.shape[1] == 1:
        return segment_distance(before[:, 0], after[:, 0]) - turned
    if before.shape[2] == 3:
        travel = np.linalg.norm(after - before, axis=2).max(axis=1)
        return np.asarray(np.minimum(signed(before), signed(after)) - 0.5 * travel - turned)
    return np.asarray(shapely.distance(shapely.convex_hull(shapely.multipoints(both)), ORIGIN) - turned)
