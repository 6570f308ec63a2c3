"""Goals at rest that an obstacle at rest covers for all time: no robot reaches them."""

from collections.abc import Sequence

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.obstacle import Obstacle
from slalom.obstacle.minkowski import outline_parts
from slalom.obstacle.periodic import Period, displaced, in_box
from slalom.shape import Shape
from slalom.sim.shape_distance import clearances
from slalom.trajectory import Stationary


def refuse_hidden_goals(
    goals: Sequence[Goal],
    shapes: Sequence[Shape],
    obstacles: Sequence[Obstacle],
    start: float,
    horizon: float,
    period: Period | None,
) -> None:
    """Raise InvalidInput for a goal at rest that an obstacle at rest, or an image of it, covers.

    Args:
        shapes: of the robots with these goals. start, horizon [s], period [m]: see `Scenario`.
    """
    still = [k for k, goal in enumerate(goals) if isinstance(goal.trajectory, Stationary)]
    positions = {k: goals[k].position(start) for k in still}
    for obstacle in obstacles:
        if not obstacle.at_rest:
            continue
        for k in still if period is not None else _near(obstacle, start, positions, shapes):
            images, position, radius = [obstacle], positions[k], shapes[k].bounding_radius
            if period is not None:
                found = in_box(images, period, start, horizon, position - radius, position + radius)
                images = [displaced(obstacle, by) for _, by in found]
            each = [float(clearances(image, shapes[k], np.zeros(1), position[None])[0]) for image in images]
            clearance = min(each, default=np.inf)
            if clearance + goals[k].tolerance < 0.0:
                raise InvalidInput(
                    f"goal: expected a position that the robot can reach, found one {-clearance:g} m deep in obstacle "
                    f"{obstacle.name!r} grown by the robot's shape"
                )


def _near(obstacle: Obstacle, t: float, positions: dict[int, Array], shapes: Sequence[Shape]) -> list[int]:
    """The positions (d,) [m], by number, at which a robot touches the bounding box of an obstacle at time t [s]."""
    if not positions:
        return []
    parts = outline_parts(obstacle, t)
    low = np.min([part.corners.min(axis=0) - part.radius for part in parts], axis=0)
    high = np.max([part.corners.max(axis=0) + part.radius for part in parts], axis=0)
    places = np.array(list(positions.values()))
    away = np.linalg.norm(np.maximum(np.maximum(low - places, places - high), 0.0), axis=1)
    return [k for k, distance in zip(positions, away.tolist()) if distance <= shapes[k].bounding_radius]
