"""Messages of ROS 2: their types for bags and DDS, and own state, frames, times and obstacles read from them."""

from collections.abc import Callable, Collection, Hashable, Iterator
from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final, Generic, NamedTuple, TypeVar

import numpy as np

from slalom.base.checks import Array, array, not_negative, number, positive, shown, vector
from slalom.base.errors import InvalidInput
from slalom.model.shape import Disc, Polygon, Polyline, Rectangle, Shape
from slalom.obstacle.occupancy import OccupancyTable, occupancy
from slalom.vehicle.vehicle import Pose

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore


# Message types of ROS 2: the store of rosbags with packages more, and the same types for DDS.
#
# Definitions are those of ROS 2 Humble. The packages of OBSTACLES are not among them; their fields follow the
# documentation of the packages (docs.ros.org).


OBSTACLES: Final[dict[str, str]] = {
    "costmap_converter_msgs/msg/ObstacleMsg": """
        std_msgs/Header header
        geometry_msgs/Polygon polygon
        float64 radius
        int64 id
        geometry_msgs/Quaternion orientation
        geometry_msgs/TwistWithCovariance velocities""",
    "costmap_converter_msgs/msg/ObstacleArrayMsg": """
        std_msgs/Header header
        costmap_converter_msgs/ObstacleMsg[] obstacles""",
    "derived_object_msgs/msg/Object": """
        std_msgs/Header header
        uint32 id
        uint8 detection_level
        bool object_classified
        geometry_msgs/Pose pose
        geometry_msgs/Twist twist
        geometry_msgs/Accel accel
        geometry_msgs/Polygon polygon
        shape_msgs/SolidPrimitive shape
        uint8 classification
        uint8 classification_certainty
        uint32 classification_age""",
    "derived_object_msgs/msg/ObjectArray": """
        std_msgs/Header header
        derived_object_msgs/Object[] objects""",
    "people_msgs/msg/Person": "string name\ngeometry_msgs/Point position\ngeometry_msgs/Point velocity\n"
    "float64 reliability\nstring[] tagnames\nstring[] tags",
    "people_msgs/msg/People": "std_msgs/Header header\npeople_msgs/Person[] people",
    "people_msgs/msg/PositionMeasurement": "std_msgs/Header header\nstring name\nstring object_id\n"
    "geometry_msgs/Point pos\nfloat64 reliability\nfloat64[9] covariance\nbyte initialization",
    "people_msgs/msg/PositionMeasurementArray": "std_msgs/Header header\n"
    "people_msgs/PositionMeasurement[] people\nfloat32[] cooccurrence",
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score",
    "vision_msgs/msg/ObjectHypothesisWithPose": "vision_msgs/ObjectHypothesis hypothesis\n"
    "geometry_msgs/PoseWithCovariance pose",
    "vision_msgs/msg/BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size",
    "vision_msgs/msg/Detection3D": "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
    "vision_msgs/BoundingBox3D bbox\nstring id",
    "vision_msgs/msg/Detection3DArray": "std_msgs/Header header\nvision_msgs/Detection3D[] detections",
    "map_msgs/msg/OccupancyGridUpdate": "std_msgs/Header header\nint32 x\nint32 y\nuint32 width\nuint32 height\n"
    "int8[] data",
}
"""Fields of messages that rosbags does not define, by type."""

_IDL: Final = {"string": str, "bool": bool}
"""Types of IDL that are those of Python; all others have the same names in `cyclonedds.idl.types`."""


@cache
def store() -> "Typestore":
    """Message types of ROS 2 Humble and of OBSTACLES, as rosbags makes them."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    made = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in OBSTACLES.items():
        made.register(get_types_from_msg(text, name))
    return made


def dds_name(name: str) -> str:
    """Name of a message type on the wire: nav_msgs/msg/Odometry is nav_msgs::msg::dds_::Odometry_."""
    *packages, last = name.split("/")
    return "::".join([*packages, "dds_", f"{last}_"])


@cache
def dds_type(name: str) -> Any:
    """Type of cyclonedds for a message type, such as nav_msgs/msg/Odometry, with the fields of `store`."""
    from dataclasses import dataclass
    from types import new_class

    from cyclonedds.idl import IdlStruct, annotations

    fields = {field: _dds_field(node) for field, node in store().fielddefs[name][1]}
    made = new_class(
        name.rsplit("/", 1)[1],
        (IdlStruct,),
        {"typename": dds_name(name)},
        lambda namespace: namespace["__annotations__"].update(fields),
    )
    return dataclass(annotations.final(made))


def _dds_field(node: Any) -> Any:
    """Annotation of a field that rosbags describes as (kind, details)."""
    from cyclonedds import idl
    from rosbags.interfaces import Nodetype

    types: Any = idl.types
    kind, details = node
    if kind == Nodetype.NAME:
        return dds_type(details)
    if kind == Nodetype.BASE:
        return _IDL.get(details[0]) or getattr(types, details[0])
    inner, length = _dds_field(details[0]), details[1]
    if kind == Nodetype.ARRAY:
        return types.array[inner, length]
    return types.sequence[inner, length] if length else types.sequence[inner]


def to_dds(message: Any) -> Any:
    """The message of rosbags as one of cyclonedds, field by field."""
    import numpy as np

    if isinstance(message, np.ndarray):
        return message.tolist()
    if isinstance(message, list):
        return [to_dds(each) for each in message]
    if not hasattr(message, "__msgtype__"):
        return message
    values = {name: to_dds(getattr(message, name)) for name, _ in store().fielddefs[message.__msgtype__][1]}
    return dds_type(message.__msgtype__)(**values)


# Own state, frames and times from messages, read by attribute: messages of rosbags, rclpy and cyclonedds fit alike.


QUATERNION: Final = 1e-3
"""[1] Largest difference from 1 of the length of a quaternion in a message; it is then normalised. More than rounding
to float32 over many products. Larger: quaternions that were never set pass as rotations."""


T = TypeVar("T")
SECOND: Final = 1_000_000_000
"""[ns] A second."""


def nanoseconds(header: Any, name: str) -> int:
    """Time stamp [ns] of a header. Raises InvalidInput for a stamp of 0, which means an unknown time."""
    stamp = int(header.stamp.sec) * SECOND + int(header.stamp.nanosec)
    if stamp <= 0:
        raise InvalidInput(f"{name}.header.stamp: expected a time above 0, found {stamp} ns")
    return stamp


def seconds(stamp: int) -> float:
    """Time [s] of a stamp [ns], rounded once."""
    return stamp / SECOND


def xyz(value: Any, name: str) -> Array:
    """Three components (3,) of a point or vector. Raises InvalidInput for numbers that are not finite."""
    return vector((value.x, value.y, value.z), name, 3)


def rotation(quaternion: Any, name: str) -> Array:
    """Rotation matrix (3, 3) of a unit quaternion. Raises InvalidInput for another length, such as all zeros."""
    x, y, z, w = (number(getattr(quaternion, axis), name) for axis in "xyzw")
    length = float(np.sqrt(x * x + y * y + z * z + w * w))
    if abs(length - 1.0) > QUATERNION:
        raise InvalidInput(f"{name}: expected a quaternion of length 1, found length {length:g}")
    x, y, z, w = (each / length for each in (x, y, z, w))
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def heading_of(matrix: Array) -> float:
    """Direction [rad] of the x axis of a rotation matrix in the plane."""
    return float(np.arctan2(matrix[1, 0], matrix[0, 0]))


class Odometry(NamedTuple):
    """Pose and motion of the robot in the frame of the header."""

    stamp: int  # [ns]
    frame: str
    position: Array  # (2,) [m]
    heading: float  # [rad]
    velocity: Array  # (2,) [m/s], in the frame of the header
    speed: float  # [m/s] along the heading
    turn: float  # [rad/s]
    error: float  # [m] largest standard deviation of the position; 0: not stated

    @property
    def pose(self) -> Pose:
        """The pose of a vehicle on wheels."""
        return Pose(self.position, self.heading, self.speed, self.turn)


def odometry(message: Any) -> Odometry:
    """Read a nav_msgs/Odometry, whose twist is in the frame of the body.

    Raises:
        InvalidInput: no time stamp; numbers that are not finite; a quaternion or covariance that is none.
    """
    pose, twist = message.pose.pose, message.twist.twist
    axes = rotation(pose.orientation, "odometry.pose.orientation")
    body = xyz(twist.linear, "odometry.twist.linear")
    return Odometry(
        nanoseconds(message.header, "odometry"),
        str(message.header.frame_id),
        xyz(pose.position, "odometry.pose.position")[:2],
        heading_of(axes),
        (axes @ body)[:2],
        float(body[0]),
        number(twist.angular.z, "odometry.twist.angular.z"),
        0.0 if (stated := in_plane(message.pose, 6)) is None else float(np.sqrt(np.linalg.eigvalsh(stated)[1])),
    )


def in_plane(message: Any, n: int) -> Array | None:
    """The covariance (2, 2) [m^2] of x and y in a field `covariance` of n x n numbers; None: all of it is 0, or none.

    Zeros mean that it is not known. Raises InvalidInput for another number of values, or ones that are none.
    """
    given = array(getattr(message, "covariance", ()), "covariance")
    if not given.any():
        return None
    if given.size != n * n:
        raise InvalidInput(f"covariance: expected {n * n} numbers, found {given.size}")
    found = given.reshape(n, n)[:2, :2]
    if np.linalg.eigvalsh(found)[0] < 0.0 or found[0, 1] != found[1, 0]:
        raise InvalidInput(f"covariance: expected a symmetric one without negative eigenvalues, found {found.tolist()}")
    return np.asarray(found)


class Placement(NamedTuple):
    """Pose of a frame in another: `position` (2,) [m] of its origin, and its `heading` [rad]."""

    position: Array
    heading: float

    @property
    def key(self) -> tuple[float, ...]:
        """The numbers, to compare."""
        return (*self.position.tolist(), self.heading)

    @property
    def axes(self) -> Array:
        """Rotation matrix (2, 2)."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.array([[c, -s], [s, c]])

    def point(self, points: Array) -> Array:
        """Points (..., 2) [m] of the placed frame in the other one."""
        return self.position + points @ self.axes.T

    @property
    def inverse(self) -> "Placement":
        """Pose of the other frame in this one."""
        return Placement(-self.position @ self.axes, -self.heading)


STILL = Placement(np.zeros(2), 0.0)
"""A frame in itself."""


class Frames:
    """Frames known relative to the fixed one, from tf2_msgs/TFMessage: both directions, without chains of frames."""

    def __init__(self, fixed: str) -> None:
        self.fixed = fixed
        self._known = {fixed: STILL}

    def update(self, message: Any) -> None:
        """Take the transforms between the fixed frame and another."""
        for each in message.transforms:
            axes = rotation(each.transform.rotation, "transform.rotation")
            place = Placement(xyz(each.transform.translation, "transform.translation")[:2], heading_of(axes))
            if each.header.frame_id == self.fixed:
                self._known[str(each.child_frame_id)] = place
            elif each.child_frame_id == self.fixed:
                self._known[str(each.header.frame_id)] = place.inverse

    def of(self, frame: str, name: str) -> Placement:
        """Pose of a frame in the fixed one. Raises InvalidInput for an unknown frame."""
        if frame not in self._known:
            expected = f"one of {sorted(self._known)}, or a transform of it from or to {self.fixed!r} before"
            raise InvalidInput(f"{name}.header.frame_id: expected {expected}, found {shown(frame)}")
        return self._known[frame]


class Placed(Generic[T]):
    """Object in a frame, made anew in the fixed frame when the transform between them changes."""

    def __init__(self, frame: str, make: Callable[[Placement], T]) -> None:
        self._frame, self._make = frame, make
        self._made: tuple[tuple[float, ...], T] | None = None

    def at(self, frames: Frames, name: str) -> T:
        """The object in the fixed frame."""
        place = frames.of(self._frame, name)
        if self._made is None or self._made[0] != place.key:
            self._made = place.key, self._make(place)
        return self._made[1]


# Obstacles from messages of trackers, by the table READERS, and from occupancy grids.


UPRIGHT: Final = 1.0 - 1e-6
"""[1] Least cosine of the tilt of a box or cylinder whose footprint counts as the one it has upright (0.08 degrees).
More tilted ones count as the disc about all of them. Smaller: the footprint of a high box is underestimated."""


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
