"""Topics of ROS 2 over DDS, without ROS: names, types, quality of service and bytes are those of a ROS 2 node.

A topic /odom is rt/odom on the wire, a type nav_msgs/msg/Odometry is nav_msgs::msg::dds_::Odometry_ (the mapping of
ROS 2 to DDS). Types are final and encoded as plain CDR (XCDR version 1).
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

from slalom.adapters.ros.bag import TWIST, Sent
from slalom.adapters.ros.definitions import dds_type, to_dds
from slalom.adapters.ros.messages import SECOND
from slalom.adapters.ros.node import Command, Node

DEPTH: Final = 10
"""Messages kept by a reader or writer, the default of ROS 2."""
LATCHED: Final = ("nav_msgs/msg/OccupancyGrid", "/tf_static")
"""Kinds and topics of which a new reader gets the last messages."""


class Wire:
    """Participant in a domain of DDS that reads and writes topics of ROS 2.

    Args:
        domain: ROS_DOMAIN_ID.
    """

    def __init__(self, domain: int = 0) -> None:
        from cyclonedds.core import GuardCondition, WaitSet
        from cyclonedds.domain import DomainParticipant

        self._participant = DomainParticipant(domain)
        self._wait = WaitSet(self._participant)
        self._stop = GuardCondition(self._participant)
        self._wait.attach(self._stop)
        self._readers: list[tuple[str, str, Any]] = []

    def writer(self, topic: str, kind: str) -> Any:
        """A writer of messages of cyclonedds, see `send`."""
        from cyclonedds.pub import DataWriter

        return DataWriter(self._participant, self._topic(topic, kind), qos=_quality(topic, kind))

    def send(self, writer: Any, message: Any) -> None:
        """Write a message of cyclonedds or of rosbags."""
        writer.write(to_dds(message))

    def read(self, topic: str, kind: str) -> Any:
        """Read a topic from now on."""
        from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState
        from cyclonedds.sub import DataReader

        reader = DataReader(self._participant, self._topic(topic, kind), qos=_quality(topic, kind))
        self._readers.append((topic, kind, reader))
        self._wait.attach(ReadCondition(reader, SampleState.Any | ViewState.Any | InstanceState.Alive))
        return reader

    def messages(self, timeout: float) -> Iterator[Sent]:
        """Messages as they come, in the order in which they were written; ends after `timeout` [s] without any."""
        while self._wait.wait(round(timeout * SECOND)):
            taken = [
                Sent(topic, kind, int(message.sample_info.source_timestamp), message)
                for topic, kind, reader in self._readers
                for message in reader.take(DEPTH)
                if message.sample_info.valid_data
            ]
            yield from sorted(taken, key=lambda each: each.t)

    def _topic(self, topic: str, kind: str) -> Any:
        from cyclonedds.topic import Topic

        return Topic(self._participant, f"rt{topic}", dds_type(kind), qos=_quality(topic, kind))


def serve(
    node: Node,
    topics: Mapping[str, str],
    *,
    command: str = "/cmd_vel",
    domain: int = 0,
    timeout: float = 10.0,
    seen: Callable[[Sent], None] | None = None,
) -> list[Command]:
    """Commands of a node that ran over DDS, each sent as geometry_msgs/Twist as soon as it was made.

    Args:
        topics: the kind of message by topic.
        timeout: [s] without any message after which the node ends.
        seen: called with each message before the node takes it, for example to keep it for a bag.
    """
    wire = Wire(domain)
    writer = wire.writer(command, TWIST)
    kinds = dds_kinds()
    made = []
    for topic, kind in topics.items():
        wire.read(topic, kind)
    for each in wire.messages(timeout):
        if seen is not None:
            seen(each)
        found = node.receive(each.message)
        if found is not None:
            wire.send(writer, found.twist(kinds))
            made.append(found)
    return made


def dds_kinds() -> Any:
    """Classes of cyclonedds for `Command.twist` and `Command.accel`."""
    from types import SimpleNamespace

    return SimpleNamespace(**{name: dds_type(f"geometry_msgs/msg/{name}") for name in ("Twist", "Accel", "Vector3")})


def _quality(topic: str, kind: str) -> Any:
    """Quality of service of ROS 2: reliable, the last DEPTH messages, plain CDR."""
    from cyclonedds.core import Policy, Qos
    from cyclonedds.util import duration

    return Qos(
        Policy.Reliability.Reliable(duration(seconds=1)),
        Policy.History.KeepLast(DEPTH),
        Policy.Durability.TransientLocal if {topic, kind} & {*LATCHED} else Policy.Durability.Volatile,
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )
