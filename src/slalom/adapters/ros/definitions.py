"""Message types of ROS 2: the store of rosbags with two packages more, and the same types for DDS.

Definitions are those of ROS 2 Humble. `costmap_converter_msgs` and `derived_object_msgs` are not among them; their
fields follow the documentation of both packages (docs.ros.org).
"""

from functools import cache
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

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
