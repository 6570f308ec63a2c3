"""Drawing of the control space: control obstacle by time to collision, admissible set, and controls."""

from collections.abc import Sequence
from functools import reduce
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from contourpy import FillType, LineType, contour_generator
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline

from slalom.base.checks import Array, vector
from slalom.base.errors import InvalidInput
from slalom.choice.control_obstacle import ControlObstacle
from slalom.model.limits import Admissible
from slalom.model.shape import Part
from slalom.obstacle.window import ObstacleWindow
from slalom.sim.explanation import kind
from slalom.view.style import (
    FAINT,
    INK,
    ROBOT,
    colour_at,
    colour_bar,
    disc,
    halo,
    legend_below,
    style,
    time_levels,
    time_scale,
)
from slalom.view.workspace import body, outline

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


# Sets of controls as shapely geometries.


def admissible_region(admissible: Admissible, height: float | None = None, axes: tuple[int, int] = (0, 1)) -> Any:
    """Return the admissible set as a shapely polygon; in space its section along `axes`, at `height` on the third axis.

    Circles have 1024 corners: the error is 5e-6 of the radius.

    Raises:
        InvalidInput: a set without a bounding ball.
    """
    if not len(admissible.radii):
        raise InvalidInput("admissible: expected a set bounded by a ball, found none")
    own, hidden = list(axes), 3 - sum(axes)
    depth = 0.0 if height is None else height - admissible.centers[:, hidden]
    squares = admissible.radii**2 - np.broadcast_to(depth, admissible.radii.shape) ** 2
    if np.any(squares <= 0.0):
        return shapely.Polygon()
    radii = np.sqrt(squares)
    balls = [shapely.Point(c[own]).buffer(float(r), quad_segs=256) for c, r in zip(admissible.centers, radii)]
    region: Any = shapely.intersection_all(balls)
    # The set lies within size / 4 of 0: clipping the distance of an edge to size / 2 does not change the section.
    size = 4.0 * float(np.linalg.norm(admissible.centers, axis=1).max() + admissible.radii.max())
    for normal, offset in zip(admissible.normals, admissible.offsets):
        planar_normal, planar_offset = normal[own], offset - (0.0 if height is None else normal[hidden] * height)
        length = float(np.linalg.norm(planar_normal))
        if length < 1e-12:
            region = region if planar_offset >= 0.0 else shapely.Polygon()
            continue
        along, side = planar_normal / length, np.array([-planar_normal[1], planar_normal[0]]) / length
        edge = along * np.clip(planar_offset / length, -0.5 * size, 0.5 * size)
        corners = [edge - size * side, edge + size * side, edge + size * (side - along), edge - size * (side + along)]
        region = region.intersection(shapely.Polygon(corners))
    return region


Extent = tuple[float, float, float, float]
"""Limits x from, x to, y from, y to of the panel, in units of the control."""


def control_space(
    ax: Axes,
    *,
    blocked: ControlObstacle,
    admissible: Admissible,
    preferred: npt.ArrayLike | None = None,
    chosen: npt.ArrayLike | None = None,
    extent: Extent | None = None,
    resolution: int = 201,
    elements: Sequence[float] = (),
    decorations: bool = True,
) -> Axes:
    """Draw the control obstacle by time to collision, the admissible set, and the preferred and chosen controls.

    Each colour fills the difference of the control obstacles of two horizons, with the precision of the contours.
    Thin lines bound the control obstacle of each single obstacle. In space the panel is the plane parallel to x-y
    through the chosen control, else the preferred one, else the center of the admissible set.

    Args:
        preferred, chosen: controls (d,), in m/s, m/s^2 or m/s^3, depending on the response.
        extent: x from, x to, y from, y to in the same unit; by default the admissible set and its surroundings.
        resolution: number of grid points along each axis, at least 2.
        elements: times [s] from now whose temporal elements are drawn as faint circles.
        decorations: whether to draw labels, legend and colour bar.

    Returns:
        `ax`.

    Raises:
        InvalidInput: different dimensions, or a resolution below 2.
    """
    if admissible.dimension != blocked.dimension:
        raise InvalidInput(f"admissible: expected dimension {blocked.dimension}, found {admissible.dimension}")
    if resolution < 2:
        raise InvalidInput(f"resolution: expected at least 2, found {resolution}")
    preferred_control = None if preferred is None else vector(preferred, "preferred", blocked.dimension)
    chosen_control = None if chosen is None else vector(chosen, "chosen", blocked.dimension)
    height = _height(admissible, preferred_control, chosen_control)
    region = admissible_region(admissible, height)
    left, right, low, high = extent or _extent(admissible, region, preferred_control, chosen_control)
    plane = Plane(np.linspace(left, right, resolution), np.linspace(low, high, resolution), height)
    with style():
        _fill(ax, blocked, plane)
        inset = 0.03 * (right - left)
        limits = _limits(
            ax, admissible, region, height, shapely.box(left + inset, low + inset, right - inset, high - inset)
        )
        for t in elements:
            _element(ax, blocked, float(t), height)
        handles = _controls(ax, blocked, height, preferred_control, chosen_control, (left, right, low, high))
        ax.set(xlim=(left, right), ylim=(low, high))
        ax.set_aspect("equal")
        if decorations:
            if len(elements):
                limits.append(Line2D([], [], color=FAINT, linewidth=0.4, label="temporal elements"))
            _decorate(ax, blocked, height, handles + limits)
    return ax


def _height(admissible: Admissible, preferred: Array | None, chosen: Array | None) -> float | None:
    if admissible.dimension == 2:
        return None
    through = chosen if chosen is not None else preferred
    return float(admissible.centers[-1, 2] if through is None else through[2])


def _extent(admissible: Admissible, region: Any, preferred: Array | None, chosen: Array | None) -> Extent:
    """Return a square around the admissible set with a margin, which includes controls nearby."""
    if region.is_empty:
        smallest = int(np.argmin(admissible.radii))
        (x, y), r = admissible.centers[smallest, :2], admissible.radii[smallest]
        box = np.array([[x - r, y - r], [x + r, y + r]])
    else:
        box = np.reshape(region.bounds, (2, 2))
    middle, half = box.mean(axis=0), 0.65 * float(np.diff(box, axis=0).max())
    for point in (preferred, chosen):
        if point is not None:
            required = 1.1 * float(np.abs(point[:2] - middle).max())
            half = max(half, required) if required < 1.8 * half else half
    return (middle[0] - half, middle[0] + half, middle[1] - half, middle[1] + half)


def _fill(ax: Axes, blocked: ControlObstacle, plane: Plane) -> None:
    """Fill the control obstacles of decreasing horizons on top of each other, and outline that of each obstacle.

    In the plane the one of the whole horizon is exact. The others, and all in space, are contours of the clearance on
    the grid.
    """
    controls = plane.controls
    times = blocked.times_to_collision(controls)
    levels = time_levels(blocked.horizon)
    colours = time_scale(blocked.horizon)
    colliding = np.flatnonzero(np.isfinite(times).any(axis=(0, 1)))
    for level, start in zip(levels[:0:-1], levels[-2::-1]):
        last = level == levels[-1]
        colour = colour_at(colours, 0.5 * (start + level))
        properties: dict[str, Any] = {"facecolor": colour, "edgecolor": colour, "linewidth": 0.1, "zorder": 1}
        if last and plane.height is None:
            _exact(ax, blocked, plane, properties)
            continue
        union = np.full(times.shape[:2], LARGE)
        for index in colliding:
            inside = np.isfinite(times[..., index]) if last else times[..., index] < level
            if inside.any():
                field = clearance_field(blocked, int(index), float(level), controls, inside)
                union = np.minimum(union, field)
                if last:
                    _outline(ax, plane, field, f"outline-{index}")
        if np.any(union < 0.0):
            patch = PathPatch(filled(plane, union), **properties)
            patch.set_gid("blocked" if last else f"blocked-{level:g}")
            ax.add_patch(patch)


def _exact(ax: Axes, blocked: ControlObstacle, plane: Plane, properties: dict[str, Any]) -> None:
    """Fill the exact control obstacle within the panel, from its boundary."""
    corners = np.array([[plane.x[0], plane.y[0]], [plane.x[-1], plane.y[-1]]])
    panel = shapely.box(*corners.ravel())
    size = float(np.linalg.norm(corners[1] - corners[0]))
    # A window slightly larger than the panel, so that the border of the window is not drawn.
    boundary_found = blocked.boundary(corners.mean(axis=0), 0.51 * size)
    for index, whole in enumerate(boundary_found.regions):
        if not whole.intersects(panel):
            continue
        lines = [shapely.get_coordinates(ring) for one in shapely.get_parts(whole) for ring in shapely.get_rings(one)]
        drawn = LineCollection(lines, colors=INK, linewidths=0.45, alpha=0.75, zorder=2)
        drawn.set_gid(f"outline-{index}")
        ax.add_collection(drawn, autolim=False)
    region = shapely.intersection(boundary_found.region, panel)
    parts = [part for part in shapely.get_parts(region) if part.geom_type == "Polygon"]
    if parts:
        patch = PathPatch(outline(shapely.MultiPolygon(parts)), **properties)
        patch.set_gid("blocked")
        ax.add_patch(patch)


def _outline(ax: Axes, plane: Plane, field: Array, gid: str) -> None:
    lines: Any = contour_generator(plane.x, plane.y, field, line_type=LineType.Separate).lines(0.0)
    drawn = LineCollection(lines, colors=INK, linewidths=0.45, alpha=0.75, zorder=2)
    drawn.set_gid(gid)
    ax.add_collection(drawn, autolim=False)


def _limits(ax: Axes, admissible: Admissible, region: Any, height: float | None, view: Any) -> list[Line2D]:
    """Draw the admissible set and, dotted, limit circles within `view`; return the legend entry of the circles."""
    depth = np.zeros(len(admissible.radii)) if height is None else height - admissible.centers[:, -1]
    properties: dict[str, Any] = {"linewidth": 0.7, "linestyle": (0, (1, 2))}
    handles = []
    for centre, squared_radius in zip(admissible.centers, admissible.radii**2 - depth**2):
        if squared_radius > 0.0:
            radius = float(np.sqrt(squared_radius))
            ring = shapely.Point(centre[:2]).buffer(radius, quad_segs=64).exterior
            if region.area < 0.999 * np.pi * squared_radius and ring.intersects(view):
                disc(ax, centre, radius, "limit", fill=False, edgecolor=INK, zorder=3, **properties)
                handles = [Line2D([], [], color=INK, label="speed, acceleration limits", **properties)]
    if not region.is_empty:
        patch = PathPatch(outline(region), fill=False, edgecolor=INK, linewidth=1.3, zorder=4)
        patch.set_path_effects(halo(2.6))
        patch.set_gid("admissible")
        ax.add_patch(patch)
    return handles


def _element(ax: Axes, blocked: ControlObstacle, t: float, height: float | None) -> None:
    """Draw the temporal elements at elapsed time t [s]; in space their sections with the plane."""
    elements = blocked.element(t)
    properties: dict[str, Any] = {"fill": False, "edgecolor": FAINT, "linewidth": 0.4, "zorder": 2.5}
    for corners, radius in zip(elements.corners, elements.radii):
        if height is None:
            body(ax, [Part(corners, float(radius))], f"element-{t:g}", **properties)
            continue
        # The section of a ball is a disc; a capsule is approximated by many balls.
        share = np.linspace(0.0, 1.0, 33 if len(corners) > 1 else 1)[:, None]
        centers = corners[0] + share * (corners[-1] - corners[0])
        squares = radius**2 - (height - centers[:, 2]) ** 2
        sections = [Part(c[None, :2], float(np.sqrt(s))) for c, s in zip(centers, squares) if s > 0.0]
        if sections:
            body(ax, sections, f"element-{t:g}", **properties)


def _controls(
    ax: Axes,
    blocked: ControlObstacle,
    height: float | None,
    preferred: Array | None,
    chosen: Array | None,
    extent: Extent,
) -> list[Line2D]:
    """Draw markers of the controls; return their legend entries.

    A control outside the panel is marked at the border, with its coordinates in the legend. The colour there is that of
    another control; therefore the marker of a preferred one has the colour of its own time to collision.
    """
    handles = []
    corner, opposite = np.array(extent[0::2]), np.array(extent[1::2])
    inset = 0.02 * (opposite - corner)
    for point, gid, label in ((preferred, "preferred", "preferred"), (chosen, "chosen", "chosen")):
        if point is None:
            continue
        outside = bool(np.any((point[:2] < corner) | (point[:2] > opposite)))
        hollow = gid == "preferred"
        suffix = f" (at {point[0]:.2g}, {point[1]:.2g})".replace("-", "−") if outside else ""
        if height is not None and abs(point[2] - height) > 1e-9:
            suffix += " (off section)"
        contact = float(blocked.time_to_collision(point)) if hollow and suffix else np.inf
        if np.isfinite(contact):
            suffix += ", hit"
        (mark,) = ax.plot(
            *np.clip(point[:2], corner + inset, opposite - inset),
            linestyle="none",
            marker="D" if outside else "o",
            markersize=6.0 if hollow else 5.2,
            markerfacecolor=_face(blocked, contact) if hollow else ROBOT,
            markeredgecolor=ROBOT if hollow else "white",
            markeredgewidth=1.4 if hollow else 0.7,
            label=label + suffix,
            zorder=6,
        )
        mark.set_path_effects(halo(2.4))
        mark.set_gid(gid)
        handles.append(mark)
    return handles


def _face(blocked: ControlObstacle, contact: float) -> Any:
    """Return the colour of a time to collision [s], white for none."""
    return colour_at(time_scale(blocked.horizon), contact) if np.isfinite(contact) else "white"


def _decorate(ax: Axes, blocked: ControlObstacle, height: float | None, handles: list[Line2D]) -> None:
    """Draw title, labels, legend and colour bar."""
    quantity = kind(blocked.response)
    ax.set_title(f"{quantity.name} {quantity.description}", pad=4)
    section = "" if height is None else f"   (section at ${quantity.letter}_z$ = {height:.2f} {quantity.unit})"
    ax.set_xlabel(f"${quantity.letter}_x$ [{quantity.unit}]{section}")
    ax.set_ylabel(f"${quantity.letter}_y$ [{quantity.unit}]", labelpad=1)
    entries: list[Any] = [
        *handles,
        Line2D([], [], color=INK, linewidth=1.3, label="admissible set"),
        Patch(facecolor="#35b779", edgecolor=INK, linewidth=0.45, label="blocked by an obstacle")
        if any(_is_shown(patch, ax) for patch in ax.patches if str(patch.get_gid()).startswith("blocked"))
        else Patch(fill=False, linewidth=0.0, label="no control blocked"),
    ]
    legend_below(ax, entries, 2)
    colour_bar(time_scale(blocked.horizon), ax, "time to collision [s]")


def _is_shown(patch: Patch, ax: Axes) -> bool:
    """Whether a part of a region lies in the panel."""
    rings = [shapely.make_valid(shapely.Polygon(ring)) for ring in patch.get_path().to_polygons()]
    return bool(
        shapely.box(*ax.viewLim.extents).intersects(reduce(shapely.symmetric_difference, rings, shapely.Polygon()))
    )
