"""Obstacles from messages of trackers: markers, derived objects, and obstacles of costmap_converter."""

from collections.abc import Collection, Hashable, Iterator
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np
import shapely

from slalom.adapters.ros.messages import Frames, Placement, heading_of, nanoseconds, rotation, xyz
from slalom.base.checks import Array, not_negative, positive
from slalom.base.errors import InvalidInput
from slalom.model.shape import Disc, Polygon, Polyline, Rectangle, Shape
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable

UPRIGHT: Final = 1.0 - 1e-6
"""[1] Least cosine of the tilt of a box or cylinder whose footprint counts as the one it has upright (0.08 degrees).

More tilted ones count as the disc about all of them. Smaller: the footprint of a high box is underestimated.
"""


CUBE = 1
SPHERE = 2
CYLINDER = 3
"""Types of visualization_msgs/Marker that are bodies."""
DELETE, DELETEALL = 2, 3
"""Actions of visualization_msgs/Marker that show nothing."""
BOX = 1
BALL = 2
TUBE = 3
CONE = 4
"""Types of shape_msgs/SolidPrimitive that have dimensions."""
TRACKED: Final = 1
"""Detection level of a derived object whose twist is valid."""


class Seen(NamedTuple):
    """One measurement, for `Tracker.update`."""

    stamp: int  # [ns]
    id: Hashable
    position: Array  # (2,) [m]
    velocity: Array | None  # (2,) [m/s]
    shape: Shape
    heading: float | None  # [rad]


def markers(message: Any, frames: Frames, namespaces: Collection[str] | None = None) -> Iterator[Seen]:
    """Measurements of a visualization_msgs/MarkerArray; they have no velocity.

    A marker that is deleted is no longer measured: the tracker predicts it until its `max_age`.

    Args:
        namespaces: those of obstacles; None: all.

    Raises:
        InvalidInput: a marker that is no box, ball or cylinder; a frame or a time that is not known; a size of 0.
    """
    for each in message.markers:
        if each.action in (DELETE, DELETEALL) or (namespaces is not None and each.ns not in namespaces):
            continue
        name = f"marker {each.ns!r} {each.id}"
        scale = xyz(each.scale, f"{name}: scale")
        axes = rotation(each.pose.orientation, f"{name}: orientation")
        if each.type == CUBE:
            shape = _box(scale, axes, name)
        elif each.type in (SPHERE, CYLINDER):
            shape = _round(0.5 * scale, axes, each.type == CYLINDER, name)
        else:
            kinds = f"a box, ball or cylinder (type {CUBE}, {SPHERE} or {CYLINDER}), or `namespaces` of obstacles"
            raise InvalidInput(f"{name}: expected {kinds}, found type {each.type}")
        yield _placed(each, frames, name, ("marker", str(each.ns), int(each.id)), shape, axes, None)


def objects(message: Any, frames: Frames) -> Iterator[Seen]:
    """Measurements of a derived_object_msgs/ObjectArray; the twist of tracked objects is in the frame of the header.

    Raises:
        InvalidInput: an object without a shape; a frame or a time that is not known; a size of 0.
    """
    for each in message.objects:
        name = f"object {each.id}"
        kind = each.shape.type
        sizes = [float(x) for x in each.shape.dimensions]
        axes = rotation(each.pose.orientation, f"{name}: orientation")
        if len(sizes) != {BOX: 3, BALL: 1, TUBE: 2, CONE: 2}.get(kind):
            kinds = f"a box, ball, cylinder or cone (type {BOX}, {BALL}, {TUBE} or {CONE}) with its dimensions"
            raise InvalidInput(f"{name}: expected {kinds}, found type {kind} with {len(sizes)} dimensions")
        if kind == BOX:
            shape = _box(np.array(sizes), axes, name)
        elif kind == BALL:
            shape = Disc(positive(sizes[0], f"{name}: radius"))
        else:
            shape = _round(np.array([sizes[1], sizes[1], 0.5 * sizes[0]]), axes, True, name)
        velocity = xyz(each.twist.linear, f"{name}: twist.linear")[:2] if each.detection_level == TRACKED else None
        yield _placed(each, frames, name, ("object", int(each.id)), shape, axes, velocity)


def obstacles(message: Any, frames: Frames) -> Iterator[Seen]:
    """Measurements of a costmap_converter_msgs/ObstacleArrayMsg, whose corners are in the frame of the array.

    One corner is a disc, two are a line, more are a polygon, each with the radius of the obstacle around it.

    Raises:
        InvalidInput: an obstacle without a corner; a negative radius; a frame or a time that is not known.
    """
    place, stamp = frames.of(message.header.frame_id, "obstacles"), nanoseconds(message.header, "obstacles")
    for each in message.obstacles:
        name, radius = f"obstacle {each.id}", float(each.radius)
        corners = np.array([xyz(point, f"{name}: polygon")[:2] for point in each.polygon.points]).reshape(-1, 2)
        if not len(corners):
            raise InvalidInput(f"{name}: expected a polygon with at least one corner, found none")
        center = place.point(corners.mean(axis=0))
        around = place.point(corners) - center
        if len(corners) == 1:
            shape: Shape = Disc(not_negative(radius, f"{name}: radius"))
        else:
            shape = Polyline(around, radius) if len(corners) == 2 else Polygon(around, radius)
        velocity = place.axes @ xyz(each.velocities.twist.linear, f"{name}: velocities")[:2]
        yield Seen(stamp, ("obstacle", int(each.id)), center, velocity, shape, 0.0 if len(corners) > 1 else None)


def _placed(
    each: Any, frames: Frames, name: str, id: Hashable, shape: Shape, axes: Array, velocity: Array | None
) -> Seen:
    """A measurement of a message with a header and a pose."""
    place = frames.of(each.header.frame_id, name)
    heading = None if isinstance(shape, Disc) else heading_of(axes) + place.heading
    position = place.point(xyz(each.pose.position, f"{name}: position")[:2])
    moving = None if velocity is None else place.axes @ velocity
    return Seen(nanoseconds(each.header, name), id, position, moving, shape, heading)


def _box(sizes: Array, axes: Array, name: str) -> Shape:
    """Footprint of a box with sizes (3,) [m]; of one that is tilted, the disc about all of it."""
    if axes[2, 2] < UPRIGHT:
        return Disc(positive(0.5 * float(np.linalg.norm(sizes)), f"{name}: size"))
    return Rectangle(positive(sizes[0], f"{name}: length"), positive(sizes[1], f"{name}: width"))


def _round(semiaxes: Array, axes: Array, flat: bool, name: str) -> Shape:
    """Disc about an ellipsoid, or with `flat` about an elliptic cylinder, of semi-axes (3,) [m]."""
    radius = float(semiaxes[:2].max())
    if axes[2, 2] < UPRIGHT:
        radius = float(np.hypot(radius, semiaxes[2])) if flat else float(semiaxes.max())
    return Disc(positive(radius, f"{name}: radius"))


# ---------------------------------------------------------------------------------------------------------------------
# Obstacles of an occupancy grid: convex polygons that cover every occupied cell.
#
# Occupied cells are joined to regions. Notches of their outlines that are not deeper than GRID_NOTCH are filled, which
# only adds area. The regions are cut into triangles, and triangles are joined as long as they stay convex (after
# Hertel and Mehlhorn, 1983). All of this is in units of cells, so that the corners of cells are exact.


GRID_NOTCH: Final = 1.5
"""[cell] Depth up to which notches of an occupied region are filled, at which its outline has fewer corners.

The outline of a straight wall of any slope has steps of less than sqrt(2) cells; they become one edge. Larger: fewer,
coarser obstacles. 0: outlines as they are, with many times as many obstacles.
"""


Point = tuple[float, float]


def grid_polygons(message: Any, occupied: float, unknown: bool, notch: float = GRID_NOTCH) -> list[Array]:
    """Convex polygons (n, 2) [m] of a nav_msgs/OccupancyGrid, in the frame of its header.

    Args:
        occupied: [%] least value of an occupied cell. unknown: whether cells of value -1 are occupied.
        notch: [cell] depth of notches that are filled.

    Raises:
        InvalidInput: a grid whose number of cells is not width times height; a resolution that is not above 0.
    """
    info, cells = message.info, np.asarray(message.data, dtype=np.int8)
    if cells.size != info.width * info.height:
        raise InvalidInput(f"grid.data: expected {info.width} x {info.height} cells, found {cells.size}")
    cells = cells.reshape(int(info.height), int(info.width))
    resolution = positive(float(info.resolution), "grid.info.resolution")
    heading = heading_of(rotation(info.origin.orientation, "grid.info.origin.orientation"))
    origin = Placement(xyz(info.origin.position, "grid.info.origin.position")[:2], heading)
    covering = covering_polygons((cells >= occupied) | (unknown & (cells < 0)), notch)
    return [origin.point(resolution * corners) for corners in covering]


def walls(polygons: list[Array], place: Placement) -> ObstacleTable:
    """Obstacles at rest of convex polygons (n, 2) [m] in a frame that is placed in another."""
    placed = [place.point(corners) for corners in polygons]
    centers = [corners.mean(axis=0) for corners in placed]
    return ObstacleTable(
        Obstacle(Polygon(corners - center), Stationary(center), f"map {k}")
        for k, (corners, center) in enumerate(zip(placed, centers))
    )


def covering_polygons(cells: Any, notch: float) -> list[Array]:
    """Convex polygons (n, 2) [cell], counter-clockwise, that together cover the cells (height, width) that are true."""
    regions = shapely.union_all(_rows(cells))
    filled = [_without_notches(region, notch) for region in getattr(regions, "geoms", [regions])]
    joined = shapely.union_all([regions, *filled])
    return [polygon for region in shapely.get_parts(joined) if region.area > 0.0 for polygon in _convex(region)]


def _rows(cells: Any) -> list[Any]:
    """A box for each run of cells along a row; runs that repeat in the next row are one box."""
    open_runs: dict[tuple[int, int], int] = {}
    boxes = []
    empty = np.zeros((1, cells.shape[1]), bool)
    for y, row in enumerate(np.concatenate([cells, empty])):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(np.int8)))
        runs = {(int(a), int(b)) for a, b in edges.reshape(-1, 2)}
        boxes += [shapely.box(a, since, b, y) for (a, b), since in open_runs.items() if (a, b) not in runs]
        open_runs = {run: open_runs.get(run, y) for run in sorted(runs)}
    return boxes


def _without_notches(region: Any, notch: float) -> Any:
    """The region with notches filled; it may overlap itself where notches of one part reach another."""
    if region.is_empty:
        return region
    region = shapely.orient_polygons(region)
    outer = _outline(shapely.get_coordinates(region.exterior)[:-1].tolist(), notch)
    holes = [_outline(shapely.get_coordinates(ring)[:-1].tolist(), notch) for ring in region.interiors]
    return shapely.make_valid(shapely.Polygon(outer, [hole for hole in holes if len(hole) > 2]))


def _outline(corners: list[list[float]], notch: float) -> list[list[float]]:
    """The ring, with its inside to the left, without reflex corners that are not farther than `notch` inside.

    A corner is left out only if all corners left out between its neighbours are that near to the new edge.
    """
    kept = list(corners)
    dropped: list[list[list[float]]] = [[] for _ in corners]
    k = unchanged = 0
    while unchanged < len(kept) and len(kept) > 3:
        before = kept[k - 1]
        here = kept[k]
        after = kept[(k + 1) % len(kept)]
        between = [*dropped[k - 1], here, *dropped[k]]
        if _side(before, here, after) <= 0.0 and all(_depth(before, after, each) <= notch for each in between):
            dropped[k - 1] = between
            del kept[k], dropped[k]
            k, unchanged = (k - 1) % len(kept), 0
        else:
            k, unchanged = (k + 1) % len(kept), unchanged + 1
    return kept


def _side(a: list[float], b: list[float], c: list[float]) -> float:
    """Twice the area of a triangle, above 0 if it turns counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _depth(a: list[float], b: list[float], point: list[float]) -> float:
    """Distance of a point from the line through a and b."""
    length = float(np.hypot(b[0] - a[0], b[1] - a[1]))
    return abs(_side(a, b, point)) / length if length > 0.0 else float(np.hypot(point[0] - a[0], point[1] - a[1]))


def _convex(region: Any) -> list[Array]:
    """Convex polygons whose union is the region, which may have holes."""
    rings: dict[int, list[Point]] = {}
    owners: dict[tuple[Point, Point], int] = {}
    for k, triangle in enumerate(shapely.constrained_delaunay_triangles(region).geoms):
        rings[k] = [(x, y) for x, y in shapely.get_coordinates(shapely.orient_polygons(triangle))[:-1].tolist()]
        owners.update(dict.fromkeys(pairwise([*rings[k], rings[k][0]]), k))
    longest_first = sorted(owners, key=lambda edge: -np.hypot(edge[0][0] - edge[1][0], edge[0][1] - edge[1][1]))
    for a, b in longest_first:
        one, other = owners.get((a, b)), owners.get((b, a))
        if one is not None and other is not None:
            merged = _merged(rings[one], rings[other], a, b)
            if merged is not None:
                del rings[other], owners[a, b], owners[b, a]
                rings[one] = merged
                owners.update(dict.fromkeys(pairwise([*merged, merged[0]]), one))
    return [np.array(_without_straight(ring)) for ring in rings.values()]


def _merged(one: list[Point], other: list[Point], a: Point, b: Point) -> list[Point] | None:
    """Both convex rings as one along the edge from a to b of the first; None if it is not convex."""
    i, j = one.index(b), other.index(a)
    ring = [*one[i:], *one[:i], *(other[j:] + other[:j])[1:-1]]
    corners = zip(ring[-1:] + ring[:-1], ring, ring[1:] + ring[:1])
    if len(set(ring)) < len(ring):
        return None
    return ring if all(_side(list(p), list(q), list(r)) >= 0.0 for p, q, r in corners) else None


def _without_straight(ring: list[Point]) -> list[Point]:
    """The ring without corners on a straight line."""
    corners = zip(ring[-1:] + ring[:-1], ring, ring[1:] + ring[:1])
    return [q for p, q, r in corners if _side(list(p), list(q), list(r)) > 0.0]
