"""Messages of ROS 2: their types for bags and DDS, and own state, frames and times read from them."""

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any, Final, Generic, NamedTuple, TypeVar

import numpy as np

from slalom.base.checks import Array, array, number, shown, vector
from slalom.base.errors import InvalidInput
from slalom.vehicle.vehicle import Pose

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore


# ---------------------------------------------------------------------------------------------------------------------
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


# ---------------------------------------------------------------------------------------------------------------------
# Own state, frames and times from messages, read by attribute: messages of rosbags, rclpy and cyclonedds fit alike.


QUATERNION: Final = 1e-3
"""[1] Largest difference from 1 of the length of a quaternion in a message; it is then normalised.

More than rounding to float32 over many products. Larger: quaternions that were never set pass as rotations.
"""


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
