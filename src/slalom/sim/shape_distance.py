"""Distances between shapes in the workspace, by code that shares nothing with the kernels that decide.

Two parts overlap exactly if the origin is within the sum of their radii of the convex hull of the differences of their
corners (Minkowski difference). shapely computes hulls and distances; in space only balls and capsules occur.
"""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import shapely

from slalom.base.checks import Array
from slalom.model.shape import Part, Shape
from slalom.obstacle import Obstacle

ORIGIN = shapely.Point(0.0, 0.0)


class Pair(NamedTuple):
    """A part of an obstacle and a part of a robot."""

    obstacle: Part
    robot: Part

    @property
    def radius(self) -> float:
        """The sum of both radii [m]."""
        return self.obstacle.radius + self.robot.radius


def pairs(obstacle: Shape, robot: Shape, parts: Sequence[int] | None = None) -> Iterator[Pair]:
    """The `parts` of the obstacle, by number, with every part of the robot; None: all of them."""
    for k in range(len(obstacle.parts)) if parts is None else parts:
        for other in robot.parts:
            yield Pair(obstacle.parts[k], other)


def differences(obstacle: Obstacle, pair: Pair, times: Array, positions: Array) -> Array:
    """Differences (k, n, d) [m] of the corners of the obstacle's part and the robot's part.

    At absolute `times` (k,) [s] the robot is at `positions` (k, d) [m].
    """
    corners = _turned(obstacle, pair.obstacle.corners, times)
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
    each = list(pairs(obstacle.shape, robot))
    if len(each) > 1:
        each = _nearest_pairs(obstacle, robot, each, times, positions)
    found = [signed(differences(obstacle, pair, times, positions)) - pair.radius for pair in each]
    return np.asarray(np.min(found, axis=0))


def _nearest_pairs(obstacle: Obstacle, robot: Shape, each: list[Pair], times: Array, positions: Array) -> list[Pair]:
    """The pairs (p,) that may be the nearest at one of the times (k,) [s], by the balls that contain their parts."""
    balls: _PairBalls = _pair_balls(obstacle.shape, robot)  # type: ignore[arg-type]  # shapes are values
    # The clearance of the centres (k, p) is at least that of the parts.
    relative = _turned(obstacle, balls.centers, times) - balls.others
    relative = relative + (obstacle.trajectory.position(times) - positions)[:, None]
    high = np.linalg.norm(relative, axis=2) - balls.radii
    near = (high - balls.spread <= high.min(axis=1, keepdims=True)).any(axis=0)
    return [pair for pair, yes in zip(each, near) if yes]


class _PairBalls(NamedTuple):
    """The balls of p pairs of parts, about the means of their corners."""

    centers: Array  # (p, d) [m] of the obstacle's part
    others: Array  # (p, d) [m] of the robot's part
    radii: Array  # (p,) [m] the sum of both radii of the parts
    spread: Array  # (p,) [m] the sum of the largest distances of their corners from the centres


@lru_cache(maxsize=256)
def _pair_balls(obstacle: Shape, robot: Shape) -> _PairBalls:
    each = list(pairs(obstacle, robot))
    centers = [pair.obstacle.corners.mean(axis=0) for pair in each]
    others = [pair.robot.corners.mean(axis=0) for pair in each]
    spread = [
        np.linalg.norm(pair.obstacle.corners - center, axis=1).max()
        + np.linalg.norm(pair.robot.corners - other, axis=1).max()
        for pair, center, other in zip(each, centers, others)
    ]
    return _PairBalls(np.array(centers), np.array(others), np.array([pair.radius for pair in each]), np.array(spread))


def _turned(obstacle: Obstacle, points: Array, times: Array) -> Array:
    """Points (n, d) [m] of an obstacle's shape as the obstacle is turned at absolute times (k,) [s]: (k, n, d)."""
    turned = np.broadcast_to(points, (len(times), *points.shape))
    if obstacle.angle != 0.0:
        e = obstacle.direction(times)[:, None]
        x, y = turned[..., :1], turned[..., 1:]
        turned = x * e + y * np.stack([-e[..., 1], e[..., 0]], axis=-1)
    return turned


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
