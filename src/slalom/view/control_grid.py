"""Clearance to control obstacles on a grid over the drawn part of the control space."""

from typing import Any, Final, NamedTuple

import numpy as np
from contourpy import FillType, contour_generator
from matplotlib.path import Path as Outline

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.obstacle.window import ObstacleWindow

LARGE: Final = 1e6
"""[m] Magnitude of a clearance of which only the sign matters."""


class Plane(NamedTuple):
    """Grid over the drawn part of the control space; in space at one third component."""

    x: Array  # (n,)
    y: Array  # (n,)
    height: float | None  # third component, None in the plane

    def lift(self, points: Array) -> Array:
        """Return controls (..., d) at points (..., 2) of the plane."""
        if self.height is None:
            return points
        return np.concatenate([points, np.full((*points.shape[:-1], 1), self.height)], axis=-1)

    @property
    def controls(self) -> Array:
        """Controls of the grid (n, n, d), rows along y."""
        return self.lift(np.stack(np.meshgrid(self.x, self.y), axis=-1))


def clearance_field(blocked: ControlObstacle, index: int, horizon: float, controls: Array, inside: Array) -> Array:
    """Return the clearance (n, n) [m] to one obstacle up to `horizon` [s]: exact at its border, elsewhere +-LARGE.

    Args:
        inside: (n, n) whether each control of the grid collides.
    """
    field = np.where(inside, -LARGE, LARGE)
    corners = np.stack([inside[:-1, :-1], inside[1:, :-1], inside[:-1, 1:], inside[1:, 1:]])
    mixed = corners.any(axis=0) & ~corners.all(axis=0)
    border = np.zeros(inside.shape, dtype=bool)
    for rows in (slice(None, -1), slice(1, None)):
        for columns in (slice(None, -1), slice(1, None)):
            border[rows, columns] |= mixed
    if border.any():
        traffic = blocked.obstacles
        margin = np.broadcast_to(np.asarray(blocked.margin), (len(traffic.obstacles),))[index]
        single = ControlObstacle(
            blocked.response,
            blocked.state,
            ObstacleWindow([traffic.obstacles[index]], traffic.start, traffic.horizon),
            blocked.robot,
            float(margin),
            horizon,
        )
        clearances = single.clearance(controls[border])
        # Keep the sign of the grid: rounding at the border must not change the sign of a cell next to +-LARGE.
        field[border] = np.where(inside[border], np.clip(clearances, -LARGE, -1e-12), np.clip(clearances, 1e-12, LARGE))
    return field


def filled(plane: Plane, field: Array) -> Outline:
    """Return the region with negative `field` (n, n), including holes, as a path."""
    drawn = contour_generator(plane.x, plane.y, field, fill_type=FillType.OuterCode)
    parts: Any = drawn.filled(-10.0 * LARGE, 0.0)
    return Outline.make_compound_path(*(Outline(points, codes) for points, codes in zip(*parts)))
