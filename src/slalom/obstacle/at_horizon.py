"""Obstacles at the horizon, from which the costs of detours are estimated."""

from collections.abc import Hashable, Sequence
from functools import lru_cache
from typing import cast

import numpy as np

from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import EVERY_WORLD, ObstacleAtHorizon
from slalom.kernels.records import Records, zero_records
from slalom.obstacle.obstacle import Obstacle
from slalom.shape import Shape
from slalom.tolerances import BALL_FILLED


def represented(obstacles: Sequence[Obstacle]) -> Indices:
    """The obstacles that a ball represents, contacts with which count while the robot is at rest.

    Obstacles of several parts, and those that fill little of their ball, such as walls, are left out.
    """
    filled = [o.contact_at_rest and fills_ball(cast(Hashable, o.shape)) for o in obstacles]
    return np.flatnonzero(np.array(filled, np.bool_))


@lru_cache(maxsize=1024)
def fills_ball(shape: Shape) -> bool:
    """Whether a shape of one part fills at least BALL_FILLED of the ball about its position that contains it.

    That ball is large for a wall whose corners are far from its position. A robot beside the wall is inside of it. It
    would find each way along the wall longer than no motion at all.
    """
    if len(shape.parts) > 1:
        return False
    ((corners, radius),) = shape.parts
    if len(corners) == 1:
        area = np.pi * radius**2
    else:
        following = np.roll(corners, -1, axis=0)
        polygon = 0.5 * abs(float(np.sum(corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0])))
        around = float(np.linalg.norm(following - corners, axis=1).sum())
        area = polygon + around * radius + np.pi * radius**2
    return bool(area >= BALL_FILLED * np.pi * shape.bounding_radius**2)


def at_horizon(obstacles: Sequence[Obstacle], some: Indices, t: float) -> Records[ObstacleAtHorizon]:
    """Some of the obstacles (m,), which exist at time t [s], as they are then."""
    found = zero_records(ObstacleAtHorizon, len(some))
    for row, k in enumerate(some.tolist()):
        position = obstacles[k].trajectory.position(t)
        found["position"][row, : len(position)] = position
        found["radius"][row] = obstacles[k].shape.bounding_radius
    found["world"] = EVERY_WORLD
    return found
