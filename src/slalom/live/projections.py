"""Projections of the control space of a robot in space: where an admissible control is free, seen along each axis."""

from typing import Any, Final

import numpy as np
import numpy.typing as npt
import shapely

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.limits import Admissible
from slalom.tolerances import VIEW_PROJECTION_GRID, VIEW_SILHOUETTE

NONE: Final = 255
"""Stands for no collision in a grid of times; others are multiples of the horizon / 250."""
OUTSIDE: Final = 254
"""Stands for no admissible control in a projection."""


def multiples(times: Array, horizon: float) -> npt.NDArray[np.uint8]:
    """Return times [s] as multiples of the horizon / 250, inf as NONE."""
    return np.where(np.isfinite(times), np.round(250.0 * times / horizon), NONE).astype(np.uint8)


def projections(blocked: ControlObstacle, admissible: Admissible, half: float) -> dict[str, npt.NDArray[Any]]:
    """Return arrays of the three projections: along z, y and x.

    `shadow0` to `shadow2` (n, n), rows along the second axis: of all admissible controls on a line along the hidden
    axis, the latest time to collision, NONE if one of them is free, OUTSIDE if there is no such control.
    `silhouette0` to `silhouette2` (k, 2): outline of the projection of the admissible set.
    """
    x = np.linspace(-half, half, VIEW_PROJECTION_GRID)
    controls = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1)
    inside = admissible.contains(controls)
    latest = np.full(inside.shape, -np.inf)
    found = blocked.times_to_collision(controls[inside])
    latest[inside] = found.min(axis=-1, initial=np.inf)
    arrays: dict[str, npt.NDArray[Any]] = {}
    border = silhouette(admissible, controls[inside])
    for k, hidden in enumerate((2, 1, 0)):
        best = latest.max(axis=hidden).T
        arrays[f"shadow{k}"] = np.where(np.isneginf(best), OUTSIDE, multiples(np.maximum(best, 0.0), blocked.horizon))
        arrays[f"shadow{k}"] = arrays[f"shadow{k}"].astype(np.uint8)
        if len(border):
            hull = shapely.convex_hull(shapely.multipoints(np.delete(border, hidden, axis=1)))
            arrays[f"silhouette{k}"] = shapely.get_coordinates(hull).astype(np.float32)
    return arrays


def silhouette(admissible: Admissible, inner: Array) -> Array:
    """Return points (n, 3) on the border of a convex set that contains the controls `inner` (m, 3); none for m = 0."""
    if not len(inner):
        return np.empty((0, 3))
    middle = inner.mean(axis=0)
    index = np.arange(VIEW_SILHOUETTE) + 0.5
    polar, turn = np.arccos(1.0 - 2.0 * index / VIEW_SILHOUETTE), np.pi * (1.0 + np.sqrt(5.0)) * index
    ways = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)
    low, high = np.zeros(len(ways)), np.full(len(ways), 2.0 * admissible.largest)
    for _ in range(40):
        half = 0.5 * (low + high)
        within = admissible.excess(middle + half[:, None] * ways) <= 0.0
        low, high = np.where(within, half, low), np.where(within, high, half)
    return np.asarray(middle + low[:, None] * ways)
