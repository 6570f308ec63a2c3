"""The obstacles of a scenario as other projects' methods see them: discs now, walls for ever."""

from collections.abc import Iterable

import numpy as np
import shapely

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.obstacle import Obstacle
from slalom.peers.crowd import Discs
from slalom.shape import Part
from slalom.trajectory import Stationary

MITRE = 100.0
"""[1] How far the outline of a rounded corner may reach, in radii: corners stay sharp, so that nothing is left out."""


def outlines(obstacles: Iterable[Obstacle], *, walls: bool) -> tuple[Array, ...]:
    """What is not round, as outlines (k, 2) [m], see `Team`; of a part with a radius somewhat larger than it is.

    Raises:
        InvalidInput: an obstacle is not round and moves or, without `walls`, is not round; or is several discs and
            turns.
    """
    sees = "discs, and other shapes that stand" if walls else "discs"
    found: list[Array] = []
    for obstacle in obstacles:
        stands = isinstance(obstacle.trajectory, Stationary)
        edged = [part for part in obstacle.shape.parts if len(part.corners) > 1]
        if (edged and not (walls and stands)) or (obstacle.turns and not stands):
            what = f"a {type(obstacle.shape).__name__.lower()} that {'stands' if stands else 'moves'}"
            raise InvalidInput(
                f"obstacle {obstacle.name!r}: expected a shape that this method can avoid ({sees}), found {what}"
            )
        found += [_outline(part) @ _rotation(obstacle) + obstacle.trajectory.position(0.0) for part in edged]
    return tuple(found)


def _outline(part: Part) -> Array:
    if part.radius == 0.0:
        return part.corners
    plain = shapely.LineString(part.corners) if len(part.corners) == 2 else shapely.Polygon(part.corners)
    grown = shapely.buffer(plain, part.radius, cap_style="square", join_style="mitre", mitre_limit=MITRE)
    return np.asarray(shapely.get_coordinates(shapely.orient_polygons(grown))[:-1])


def _rotation(obstacle: Obstacle) -> Array:
    """From the body to the world, for rows, of an obstacle that does not turn."""
    x, y = obstacle.direction(0.0)
    return np.array([[x, y], [-y, x]])


def discs(obstacles: Iterable[Obstacle], now: float) -> Discs:
    """What is round and there at time `now` [s], as large as the uncertainty of where it is now makes it."""
    places, velocities, radii = [], [], []
    for obstacle in obstacles:
        round_parts = [part for part in obstacle.shape.parts if len(part.corners) == 1]
        if not round_parts or not obstacle.exists(now):
            continue
        more = float(obstacle.uncertainty.radius(0.0, 2)) if obstacle.uncertainty else 0.0
        for part in round_parts:
            off = part.corners[0] @ _rotation(obstacle) if np.any(part.corners) else 0.0
            places.append(obstacle.trajectory.position(now) + off)
            velocities.append(obstacle.trajectory.velocity(now))
            radii.append(part.radius + more)
    return Discs(np.reshape(places, (-1, 2)), np.reshape(velocities, (-1, 2)), np.array(radii, dtype=np.float64))
