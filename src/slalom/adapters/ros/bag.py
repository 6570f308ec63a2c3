"""Bags of ROS 2 through a node: the messages in the order of the bag, the commands in a bag or a table."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from csv import writer
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.adapters.ros.definitions import store
from slalom.adapters.ros.messages import SECOND, seconds
from slalom.adapters.ros.node import KINDS, Command, Node
from slalom.base.errors import InvalidFile, InvalidInput, reason

ODOMETRY: Final = "nav_msgs/msg/Odometry"
TWIST: Final = "geometry_msgs/msg/Twist"
COLUMNS: Final = ("time", "linear_x", "linear_y", "angular_z", "acceleration_x", "acceleration_y", "outcome")
"""Columns of a table of commands: s, m/s, m/s, rad/s, m/s^2, m/s^2."""


class Sent(NamedTuple):
    """A message of a bag."""

    topic: str
    kind: str  # as in nav_msgs/msg/Odometry
    t: int  # [ns] at which it was recorded
    message: Any


def kinds() -> Any:
    """Classes of rosbags for `Command.twist` and `Command.accel`."""
    from types import SimpleNamespace

    types = store().types
    return SimpleNamespace(**{name: types[f"geometry_msgs/msg/{name}"] for name in ("Twist", "Accel", "Vector3")})


def read_bag(
    bag: Path, topics: Collection[str] | None = None, progress: Callable[[float], None] | None = None
) -> Iterator[Sent]:
    """Messages of a bag in the order in which they were recorded.

    Args:
        topics: those to read; None: all of a kind that a node takes. progress: called with the share that is read.

    Raises:
        InvalidFile: no bag. InvalidInput: a topic that the bag does not have, or of a kind that no node takes; odometry
            of more than one topic.
    """
    from rosbags.highlevel import AnyReader, AnyReaderError

    try:
        with AnyReader([bag], default_typestore=store()) as reader:
            found = {each.topic: str(each.msgtype) for each in reader.connections}
            taken = _taken(found, topics)
            connections = [c for c in reader.connections if c.topic in taken]
            count = sum(c.msgcount for c in connections)
            for k, (connection, t, raw) in enumerate(reader.messages(connections), 1):
                message = reader.deserialize(raw, connection.msgtype)
                yield Sent(connection.topic, str(connection.msgtype), t, message)
                if progress:
                    progress(k / count)
    except (AnyReaderError, OSError) as error:
        raise InvalidFile([f"{bag}: expected a bag of ROS, found {reason(error)}"]) from None


def _taken(found: dict[str, str], topics: Collection[str] | None) -> set[str]:
    """Topics to read, of those found with their kinds."""
    missing = sorted(set(topics or ()) - set(found))
    if missing:
        raise InvalidInput(f"topics: expected some of {', '.join(sorted(found))}; found {', '.join(missing)}")
    taken = {topic for topic, kind in found.items() if kind in (KINDS if topics is None else {*KINDS, TWIST})}
    refused = sorted(set(topics or ()) - taken)
    if refused:
        raise InvalidInput(f"topics: expected some with {', '.join(KINDS)}; found {found[refused[0]]}")
    taken = taken if topics is None else set(topics)
    sources = sorted(topic for topic in taken if found[topic] == ODOMETRY)
    if len(sources) > 1:
        raise InvalidInput(f"topics: expected one with odometry, found {', '.join(sources)}")
    return taken


def replay(messages: Iterable[Sent], node: Node) -> list[Command]:
    """Commands of a node that takes the messages in their order."""
    commands = (node.receive(each.message) for each in messages)
    return [command for command in commands if command is not None]


def differences(commands: Sequence[Command], twists: Iterable[Any]) -> int:
    """Number of commands that differ in any bit from the recorded geometry_msgs/Twist, or have none."""
    made = [_numbers(command.twist(kinds())) for command in commands]
    kept = [_numbers(twist) for twist in twists]
    return sum(a != b for a, b in zip(made, kept)) + abs(len(made) - len(kept))


def _numbers(twist: Any) -> bytes:
    parts = [getattr(part, axis) for part in (twist.linear, twist.angular) for axis in "xyz"]
    return np.array(parts, dtype=np.float64).tobytes()


def write_table(commands: Iterable[Command], file: Path) -> None:
    """Write commands as comma-separated values, with all digits."""
    with file.open("w", newline="", encoding="utf-8") as stream:
        table = writer(stream)
        table.writerow(COLUMNS)
        for each in commands:
            numbers = (*each.linear.tolist(), each.angular, *each.acceleration.tolist())
            table.writerow([repr(seconds(each.stamp)), *map(repr, numbers), each.decision.outcome.name])


def write_bag(messages: Iterable[Sent], folder: Path) -> None:
    """Write messages of rosbags as a bag of ROS 2, which may not exist.

    Raises:
        InvalidFile: a folder that exists.
    """
    from rosbags.rosbag2 import StoragePlugin, Writer, WriterError

    try:
        with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
            connections: dict[str, Any] = {}
            for topic, kind, t, message in messages:
                if topic not in connections:
                    connections[topic] = bag.add_connection(topic, kind, typestore=store())
                bag.write(connections[topic], t, store().serialize_cdr(message, kind))
    except WriterError as error:
        raise InvalidFile([f"{folder}: expected a bag that can be written, found {error}"]) from None


def as_sent(commands: Iterable[Command], topic: str = "/cmd_vel") -> Iterator[Sent]:
    """Commands as messages of a bag, at the time of their odometry."""
    return (Sent(topic, TWIST, each.stamp, each.twist(kinds())) for each in commands)


def stamped(t: float, frame: str) -> Any:
    """A std_msgs/Header at time t [s] in a frame."""
    types = store().types
    stamp = round(t * SECOND)
    time = types["builtin_interfaces/msg/Time"](sec=stamp // SECOND, nanosec=stamp % SECOND)
    return types["std_msgs/msg/Header"](stamp=time, frame_id=frame)
