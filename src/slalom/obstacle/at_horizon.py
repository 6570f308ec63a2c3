"""Obstacles at the horizon, from which the costs of detours are estimated."""

from collections.abc import Sequence

import numpy as np

from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import EVERY_WORLD, ObstacleAtHorizon
from slalom.kernels.records import Records, zero_records
from slalom.obstacle.obstacle import Obstacle


def represented(obstacles: Sequence[Obstacle]) -> Indices:
    """The obstacles that a ball represents: those of one part, contacts with which count while the robot is at rest.

    Obstacles of several parts, such as walls, are left out.
    """
    return np.array([k for k, o in enumerate(obstacles) if o.contact_at_rest and len(o.shape.parts) == 1], np.int64)


def at_horizon(obstacles: Sequence[Obstacle], some: Indices, t: float) -> Records[ObstacleAtHorizon]:
    """Some of the obstacles (m,), which exist at time t [s], as they are then."""
    found = zero_records(ObstacleAtHorizon, len(some))
    for row, k in enumerate(some.tolist()):
        position = obstacles[k].trajectory.position(t)
        found["position"][row, : len(position)] = position
        found["radius"][row] = obstacles[k].shape.bounding_radius
    found["world"] = EVERY_WORLD
    return found
