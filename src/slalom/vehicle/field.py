"""Lengths of shortest ways of a disc among obstacles at rest, on a grid: estimates for the search of ways.

The estimates order the poses of a search only. No way is accepted or refused for them.
"""

from typing import Final

import numpy as np

from slalom.base.checks import Array
from slalom.kernels.arrays import Indices
from slalom.vehicle.sweep import Scene

CELLS: Final = 10000
"""[1] Most cells of a grid. More: larger worlds at full resolution, a later begin of the search."""

CELL: Final = 0.67
"""[1] Width of cells in inner radii of the body, where CELLS suffice.

Larger: narrow passages are closed on the grid. Smaller: more cells.
"""

BLOCKED: Final = 50.0
"""[1] Cost of a length in cells at obstacles; finite, as a cell at an obstacle may be free.

Larger: narrow passages are tried later than long detours. Smaller: the search pushes against walls.
"""

AROUND: Final = 6.0
"""[1] Least margin of the grid around start and goal, in distances of the farthest point of the body from the axle.

Larger: longer detours are estimated, in larger cells. Smaller: poses outside count as if nothing were between.
"""


class Field:
    """Lengths of shortest ways of a disc to the nearest of some places among the obstacles of a scene.

    Args:
        scene: the body and its obstacles. roots: (n, 3) poses at which the way is 0 long. others: (m, 3) further poses
            that the grid contains.
    """

    def __init__(self, scene: Scene, roots: Array, others: Array) -> None:
        self.scene = scene
        places = self._middles(np.concatenate([roots, others]))
        low, high = places.min(axis=0), places.max(axis=0)
        margin = max(float((high - low).max()), AROUND * scene.scale)
        size = high - low + 2.0 * margin
        inner = max(scene.inner, 1e-3 * scene.scale)
        self.width = max(CELL * inner, float(np.sqrt(size.prod() / CELLS)))
        self.origin = low - margin
        self.shape = (np.floor(size / self.width) + 1.0).astype(np.int64)
        grid = np.stack(np.meshgrid(*map(np.arange, self.shape), indexing="ij"), axis=-1)
        near = scene.near(self.origin + self.width * grid.reshape(-1, 2), max(inner - 0.5 * self.width, self.width))
        factor = np.where(near, BLOCKED, 1.0).reshape(self.shape)
        first = np.full(self.shape, np.inf)
        first[*self._cells(places[: len(roots)]).T] = 0.0
        self.lengths = self.width * _spread(first, factor)

    def _middles(self, poses: Array) -> Array:
        """The middles (n, 2) of the body at poses (n, 3)."""
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        x, y = self.scene.bodies[0].middle
        return np.asarray(poses[:, :2] + np.stack([c * x - s * y, s * x + c * y], axis=1))

    def _cells(self, places: Array) -> Indices:
        """The cells (n, 2) that are nearest to places (n, 2)."""
        cells = np.round((places - self.origin) / self.width).astype(np.int64)
        return np.asarray(np.clip(cells, 0, self.shape - 1))

    def __call__(self, poses: Array) -> Array:
        """Lengths (n,) [m] of the shortest ways of the disc from poses (n, 3)."""
        places = self._middles(poses)
        cells = self._cells(places)
        outside = np.abs((places - self.origin) / self.width - cells).max(axis=1) - 0.5
        return np.asarray(self.lengths[cells[:, 0], cells[:, 1]] + self.width * np.maximum(outside, 0.0))


def _spread(lengths: Array, factor: Array) -> Array:
    """Lengths (nx, ny) [cell] of the shortest ways from cells of length 0, moving to the 8 neighbours of cells."""
    moves = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if (a, b) != (0, 0)]
    padded = np.pad(lengths, 1, constant_values=np.inf)
    inside = padded[1:-1, 1:-1]
    nx, ny = lengths.shape
    while True:
        before = inside.copy()
        for a, b in moves:
            beside = padded[1 + a : 1 + a + nx, 1 + b : 1 + b + ny]
            np.minimum(inside, beside + np.hypot(a, b) * factor, out=inside)
        if np.array_equal(before, inside):
            return before
