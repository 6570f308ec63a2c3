"""Sets of controls as shapely geometries."""

from typing import Any

import numpy as np
import shapely

from slalom.errors import InvalidInput
from slalom.limits import Admissible


def admissible_region(admissible: Admissible, height: float | None = None) -> Any:
    """Return the admissible set as a shapely polygon; in space its section at the third component `height`.

    Circles have 1024 corners: the error is 5e-6 of the radius.

    Raises:
        InvalidInput: a set without a bounding ball.
    """
    if not len(admissible.radii):
        raise InvalidInput("admissible: expected a set bounded by a ball, found none")
    depth = 0.0 if height is None else height - admissible.centers[:, -1]
    squares = admissible.radii**2 - np.broadcast_to(depth, admissible.radii.shape) ** 2
    if np.any(squares <= 0.0):
        return shapely.Polygon()
    radii = np.sqrt(squares)
    balls = [shapely.Point(c[:2]).buffer(float(r), quad_segs=256) for c, r in zip(admissible.centers, radii)]
    region: Any = shapely.intersection_all(balls)
    # The set lies within size / 4 of 0: clipping the distance of an edge to size / 2 does not change the section.
    size = 4.0 * float(np.linalg.norm(admissible.centers, axis=1).max() + admissible.radii.max())
    for normal, offset in zip(admissible.normals, admissible.offsets):
        planar_normal, planar_offset = normal[:2], offset - (0.0 if height is None else normal[2] * height)
        length = float(np.linalg.norm(planar_normal))
        if length < 1e-12:
            region = region if planar_offset >= 0.0 else shapely.Polygon()
            continue
        along, side = planar_normal / length, np.array([-planar_normal[1], planar_normal[0]]) / length
        edge = along * np.clip(planar_offset / length, -0.5 * size, 0.5 * size)
        corners = [edge - size * side, edge + size * side, edge + size * (side - along), edge - size * (side + along)]
        region = region.intersection(shapely.Polygon(corners))
    return region
