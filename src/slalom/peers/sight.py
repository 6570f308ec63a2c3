"""Obstacles of a scenario as other projects' methods represent them: present discs and permanent walls."""

from collections.abc import Iterable

import numpy as np
import shapely

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.obstacle import Obstacle
from slalom.peers.crowd import Discs
from slalom.shape import Part
from slalom.tolerances import MITRE_LIMIT


def outlines(obstacles: Iterable[Obstacle], *, walls: bool, growth: float = 0.0) -> tuple[Array, ...]:
    """Outlines (k, 2) [m] of obstacles that are not round, see `Team`, grown by `growth` [m].

    Those of rounded parts are slightly larger.

    Raises:
        InvalidInput: an obstacle that is not round and moves or, without `walls`, any that is not round; or several
            discs that turn.
    """
    expected = "discs, and other shapes at rest" if walls else "discs"
    found: list[Array] = []
    for obstacle in obstacles:
        at_rest = obstacle.at_rest
        polygonal = [part for part in obstacle.shape.parts if len(part.corners) > 1]
        if (polygonal and not (walls and at_rest)) or (obstacle.turns and not at_rest):
            kind = f"a {type(obstacle.shape).__name__.lower()} that {'is at rest' if at_rest else 'moves'}"
            raise InvalidInput(
                f"obstacle {obstacle.name!r}: expected a shape that this method can avoid ({expected}), found {kind}"
            )
        found += [
            _outline(part, growth) @ _rotation(obstacle) + obstacle.trajectory.position(0.0) for part in polygonal
        ]
    return tuple(found)


def _outline(part: Part, growth: float) -> Array:
    radius = part.radius + growth
    if radius == 0.0:
        return part.corners
    plain = shapely.LineString(part.corners) if len(part.corners) == 2 else shapely.Polygon(part.corners)
    grown = shapely.buffer(plain, radius, cap_style="square", join_style="mitre", mitre_limit=MITRE_LIMIT)
    return np.asarray(shapely.get_coordinates(shapely.orient_polygons(grown))[:-1])


def _rotation(obstacle: Obstacle) -> Array:
    """Rotation (2, 2) from the body to the world frame, for row vectors, of an obstacle that does not turn."""
    x, y = obstacle.direction(0.0)
    return np.array([[x, y], [-y, x]])


def discs(obstacles: Iterable[Obstacle], now: float, growth: float = 0.0) -> Discs:
    """Round parts of the obstacles that exist at `now` [s], grown by their present uncertainty and `growth` [m]."""
    positions, velocities, radii = [], [], []
    for obstacle in obstacles:
        round_parts = [part for part in obstacle.shape.parts if len(part.corners) == 1]
        if not round_parts or not obstacle.exists(now):
            continue
        uncertainty = float(obstacle.uncertainty.radius(0.0, 2)) if obstacle.uncertainty else 0.0
        for part in round_parts:
            offset = part.corners[0] @ _rotation(obstacle) if np.any(part.corners) else 0.0
            positions.append(obstacle.trajectory.position(now) + offset)
            velocities.append(obstacle.trajectory.velocity(now))
            radii.append(part.radius + uncertainty + growth)
    return Discs(np.reshape(positions, (-1, 2)), np.reshape(velocities, (-1, 2)), np.array(radii, dtype=np.float64))
