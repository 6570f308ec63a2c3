"""Control obstacles of single obstacles on the drawn plane: exact outlines, and times to collision on a grid.

They are kept between messages, so that after a change of one obstacle only its own are computed anew.
"""

from collections import OrderedDict
from collections.abc import Hashable
from typing import Final, NamedTuple

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.live.others import Other
from slalom.live.seen import Seen
from slalom.obstacle.window import ObstacleWindow
from slalom.tolerances import VIEW_CONTEXTS, VIEW_GRID, VIEW_SLICE_GRID

PLANES: Final = {2: ((0, 1),), 3: ((0, 1), (0, 2), (1, 2))}
"""Axes of the planes that are drawn, by dimension."""


class Plane(NamedTuple):
    """Square part of the control space that is drawn: two axes, its half side, and the control that it goes through."""

    axes: tuple[int, int]
    half: float
    through: tuple[float, ...]

    @property
    def size(self) -> int:
        """Number of grid points along each axis."""
        return VIEW_GRID if len(self.through) == 2 else VIEW_SLICE_GRID

    @property
    def controls(self) -> Array:
        """Controls (n, n, d) of the grid, rows along the second axis, from low to high."""
        x = np.linspace(-self.half, self.half, self.size)
        controls = np.tile(np.array(self.through), (self.size, self.size, 1))
        controls[..., self.axes[0]], controls[..., self.axes[1]] = x[None, :], x[:, None]
        return controls


class Field(NamedTuple):
    """Control obstacle of one obstacle on a plane."""

    rings: tuple[Array, ...]  # closed curves (k, 2), holes opposite to outer ones; none in space
    times: Array | None  # (n, n) [s] time to collision, inf if there is none; None: inf everywhere


def field(seen: Seen, other: Other, margin: float, plane: Plane) -> Field:
    """Return the control obstacle of one obstacle with a margin [m] on a plane."""
    blocked = seen.blocked
    window = ObstacleWindow([other.obstacle], blocked.obstacles.start, blocked.obstacles.horizon)
    single = ControlObstacle(blocked.response, blocked.state, window, blocked.robot, margin)
    if len(plane.through) == 3:
        times = single.times_to_collision(plane.controls)[..., 0]
        return Field((), times if np.isfinite(times).any() else None)
    panel = shapely.box(-plane.half, -plane.half, plane.half, plane.half)
    # A window slightly larger than the panel, so that the border of the window is not drawn.
    whole = single.boundary((0.0, 0.0), 1.45 * plane.half).regions[0]
    region = shapely.intersection(whole, panel)
    parts = [part for part in shapely.get_parts(region) if part.geom_type == "Polygon"]
    if not parts:
        return Field((), None)
    rings = [shapely.get_coordinates(ring) for one in parts for ring in shapely.get_rings(orient(one))]
    controls = plane.controls
    # Outside the outline no control collides; only those inside it, and close to it, are tested.
    shapely.prepare(near := region.buffer(2.0 * plane.half / plane.size))
    inside = shapely.contains_xy(near, controls[..., 0], controls[..., 1])
    times = np.full(inside.shape, np.inf)
    times[inside] = single.times_to_collision(controls[inside])[..., 0]
    return Field(tuple(rings), times)


class Fields:
    """Fields that were computed, for the latest VIEW_CONTEXTS states and responses of a robot."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Hashable, dict[Hashable, Field]] = OrderedDict()
        self.computed = 0

    def of(self, seen: Seen, plane: Plane) -> list[Field]:
        """Return the fields of all others of a decision; those that were computed before are the same objects."""
        blocked = seen.blocked
        state = tuple(x.tobytes() for x in (seen.state.position, seen.state.velocity, seen.state.acceleration))
        context = (blocked.response, blocked.robot, seen.time, blocked.obstacles.horizon, state, plane)
        known = self._kept.pop(context, {})
        self._kept[context] = known
        while len(self._kept) > VIEW_CONTEXTS:
            self._kept.popitem(last=False)
        margins = np.broadcast_to(np.asarray(blocked.margin), (len(seen.others),))
        found: list[Field] = []
        now: dict[Hashable, Field] = {}
        for other, margin in zip(seen.others, margins.tolist()):
            key: Hashable = (other.key, margin)
            if key not in known:
                known[key] = field(seen, other, margin, plane)
                self.computed += 1
            now[key] = known[key]
            found.append(known[key])
        # Those of obstacles that are no longer there are forgotten.
        self._kept[context] = now
        return found
