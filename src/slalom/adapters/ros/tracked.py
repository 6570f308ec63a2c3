"""Obstacles from messages of trackers: markers, derived objects, and obstacles of costmap_converter."""

from collections.abc import Collection, Hashable, Iterator
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.adapters.ros.messages import Frames, heading_of, nanoseconds, rotation, xyz
from slalom.checks import Array, not_negative, positive
from slalom.errors import InvalidInput
from slalom.shape import Disc, Polygon, Polyline, Rectangle, Shape
from slalom.tolerances import UPRIGHT

CUBE, SPHERE, CYLINDER = 1, 2, 3
"""Types of visualization_msgs/Marker that are bodies."""
DELETE, DELETEALL = 2, 3
"""Actions of visualization_msgs/Marker that show nothing."""
BOX, BALL, TUBE, CONE = 1, 2, 3, 4
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
        name, kind, sizes = f"object {each.id}", each.shape.type, [float(x) for x in each.shape.dimensions]
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
