"""Obstacles from messages of trackers, by the table READERS, and from occupancy grids."""

from collections.abc import Callable, Collection, Hashable, Iterator
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.adapters.ros.messages import Frames, Placement, heading_of, in_plane, nanoseconds, rotation, xyz
from slalom.base.checks import Array, not_negative, positive
from slalom.base.errors import InvalidInput
from slalom.model.shape import Disc, Polygon, Polyline, Rectangle, Shape
from slalom.obstacle.occupancy import OccupancyTable, occupancy

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
    """One measurement: after its stamp the arguments of `Tracker.update`."""

    stamp: int  # [ns]
    id: Hashable
    position: Array  # (2,) [m]
    velocity: Array | None  # (2,) [m/s]
    covariance: Array | None  # (2, 2) [m^2] of the position
    shape: Shape | None
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
        yield Seen(stamp, ("obstacle", int(each.id)), center, velocity, None, shape, 0.0 if len(corners) > 1 else None)


def _placed(
    each: Any, frames: Frames, name: str, id: Hashable, shape: Shape, axes: Array, velocity: Array | None
) -> Seen:
    """A measurement of a message with a header and a pose."""
    place = frames.of(each.header.frame_id, name)
    heading = None if isinstance(shape, Disc) else heading_of(axes) + place.heading
    position = place.point(xyz(each.pose.position, f"{name}: position")[:2])
    moving = None if velocity is None else place.axes @ velocity
    return Seen(nanoseconds(each.header, name), id, position, moving, None, shape, heading)


def people(message: Any, frames: Frames) -> Iterator[Seen]:
    """Measurements of a people_msgs/People, or of a PositionMeasurementArray; they have the shape of the tracker.

    Raises:
        InvalidInput: a frame or a time that is not known; a covariance that is none.
    """
    for each in message.people:
        measured = hasattr(each, "pos")
        header, id = (each.header, each.object_id or each.name) if measured else (message.header, each.name)
        name = f"person {id!r}"
        place = frames.of(header.frame_id, name)
        position = place.point(xyz(each.pos if measured else each.position, f"{name}: position")[:2])
        velocity = None if measured else place.axes @ xyz(each.velocity, f"{name}: velocity")[:2]
        key = ("person", str(id)) if id else None
        yield Seen(nanoseconds(header, name), key, position, velocity, _turned(each, 3, place), None, None)


def detections(message: Any, frames: Frames) -> Iterator[Seen]:
    """Measurements of a vision_msgs/Detection3DArray: boxes, with the covariance of the first result.

    Raises:
        InvalidInput: detections in an image; a frame or a time that is not known; a size of 0; a covariance that is
            none.
    """
    for each in message.detections:
        id = str(getattr(each, "id", "") or getattr(each, "tracking_id", ""))
        name = f"detection {id!r}"
        if not hasattr(each.bbox, "size"):
            raise InvalidInput(f"{name}: expected a box in space (Detection3D), found one in an image (Detection2D)")
        header = each.header if each.header.frame_id else message.header
        axes = rotation(each.bbox.center.orientation, f"{name}: orientation")
        shape = _box(xyz(each.bbox.size, f"{name}: size"), axes, name)
        boxed = SimpleNamespace(header=header, pose=each.bbox.center)
        seen = _placed(boxed, frames, name, ("detection", id) if id else None, shape, axes, None)
        spread = _turned(each.results[0].pose, 6, frames.of(header.frame_id, name)) if len(each.results) else None
        yield seen._replace(covariance=spread)


def _turned(message: Any, n: int, place: Placement) -> Array | None:
    """The covariance (2, 2) [m^2] of a position of a message in the frame of `place`; None: not known."""
    found = in_plane(message, n)
    return None if found is None else place.axes @ found @ place.axes.T


READERS: Final[dict[str, Callable[[Any, Frames], Iterator[Seen]]]] = {
    "markers": markers,
    "objects": objects,
    "obstacles": obstacles,
    "people": people,
    "detections": detections,
}
"""Readers of measurements by the field of the message that has them."""


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


def occupancy_grid(message: Any, occupied: float, unknown: bool) -> OccupancyTable:
    """The obstacles of a nav_msgs/OccupancyGrid, in the frame of its header.

    Args:
        occupied: [%] least value of an occupied cell. unknown: whether cells of value -1 are occupied.

    Raises:
        InvalidInput: a grid whose number of cells is not width times height; what `occupancy` refuses.
    """
    info, cells = message.info, grid_cells(message, message.info, "grid")
    resolution = positive(float(info.resolution), "grid.info.resolution")
    heading = heading_of(rotation(info.origin.orientation, "grid.info.origin.orientation"))
    x, y, _ = xyz(info.origin.position, "grid.info.origin.position")
    return occupancy(cells, resolution, (x, y, heading), occupied=occupied, unknown=unknown)


def grid_cells(message: Any, size: Any, name: str) -> Any:
    """The cells (height, width) of a message. Raises InvalidInput for another number of them than its size states."""
    cells = np.asarray(message.data, dtype=np.int8)
    if cells.size != size.width * size.height:
        raise InvalidInput(f"{name}.data: expected {size.width} x {size.height} cells, found {cells.size}")
    return cells.reshape(int(size.height), int(size.width))


def placed_in(known: OccupancyTable, place: Placement) -> OccupancyTable:
    """The obstacles of a grid in a frame that is placed in another."""
    x, y, heading = known.origin
    return known.at((*place.point(np.array((x, y))), place.heading + heading))
