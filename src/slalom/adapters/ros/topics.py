"""Topics of ROS 2 through a node: from bags, and over DDS without ROS; the figure of a replay."""

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from csv import writer
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.adapters.ros.messages import READERS, SECOND, dds_type, seconds, store, to_dds
from slalom.adapters.ros.node import KINDS, Command, Node
from slalom.base.checks import Array
from slalom.base.errors import InvalidFile, InvalidInput, reason
from slalom.base.writing import replacing
from slalom.model.shape import Disc, Shape
from slalom.model.trajectory import Sampled, Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks

# Bags of ROS 2 through a node: the messages in the order of the bag, the commands in a bag or a table.


ODOMETRY: Final = "nav_msgs/msg/Odometry"
TWIST: Final = "geometry_msgs/msg/Twist"
COLUMNS: Final = ("time", "linear_x", "linear_y", "angular_z", "acceleration_x", "acceleration_y", "outcome")
"""Columns of a table of commands: s, m/s, m/s, rad/s, m/s^2, m/s^2."""


WITHOUT_OBSTACLES: Final = re.compile(
    "(action|actionlib|control|diagnostic|geographic|geometry|lifecycle|map|nav|rosgraph|sensor|shape|statistics|std|tf2"
    "|trajectory|unique_identifier)_msgs|(builtin|composition|rcl)_interfaces|bond|dynamic_reconfigure"
)
"""Packages of messages that say nothing of obstacles, except those of OF_OBSTACLES."""
OF_OBSTACLES: Final = re.compile("Scan|PointCloud|Range|GridCells|ProjectedMap")
"""Names of messages of these packages from which obstacles can be detected."""


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
    bag: Path,
    topics: Collection[str] | None = None,
    progress: Callable[[float], None] | None = None,
    ignore: Collection[str] = (),
) -> Iterator[Sent]:
    """Messages of a bag in the order in which they were recorded.

    Args:
        topics: those to read; None: all of a kind that a node takes. progress: called with the share that is read.
        ignore: those not to read, whatever their kind.

    Raises:
        InvalidFile: no bag. InvalidInput: a topic that the bag does not have, or of a kind that no node takes; odometry
            of more than one topic; without `topics`, obstacles of a kind that no node takes and that are not ignored.
    """
    from rosbags.highlevel import AnyReader, AnyReaderError

    try:
        with AnyReader([bag], default_typestore=store()) as reader:
            found = {each.topic: str(each.msgtype) for each in reader.connections}
            taken = _taken(found, topics, ignore)
            connections = [c for c in reader.connections if c.topic in taken]
            count = sum(c.msgcount for c in connections)
            for k, (connection, t, raw) in enumerate(reader.messages(connections), 1):
                message = reader.deserialize(raw, connection.msgtype)
                yield Sent(connection.topic, str(connection.msgtype), t, message)
                if progress:
                    progress(k / count)
    except (AnyReaderError, OSError) as error:
        raise InvalidFile([f"{bag}: expected a bag of ROS, found {reason(error)}"]) from None


def _taken(found: dict[str, str], topics: Collection[str] | None, ignore: Collection[str] = ()) -> set[str]:
    """Topics to read, of those found with their kinds."""
    for name, given in (("topics", topics), ("ignore", ignore)):
        missing = sorted(set(given or ()) - set(found))
        if missing:
            raise InvalidInput(f"{name}: expected some of {', '.join(sorted(found))}; found {', '.join(missing)}")
    found = {topic: kind for topic, kind in found.items() if topic not in ignore}
    taken = {topic for topic, kind in found.items() if kind in (KINDS if topics is None else {*KINDS, TWIST})}
    refused = sorted(set(topics or ()) - taken)
    if refused:
        raise InvalidInput(f"topics: expected some with {', '.join(KINDS)}; found {found.get(refused[0], 'none')}")
    unread = sorted(f"{topic} ({kind})" for topic, kind in found.items() if _may_have_obstacles(kind))
    if topics is None and unread:
        known = ", ".join(kind for kind, fields in KINDS.items() if fields[0] in READERS)
        expected = f"obstacles as {known}, or the others named by --ignore"
        raise InvalidInput(f"bag: expected {expected}; found {', '.join(unread)}")
    taken = taken if topics is None else set(topics)
    sources = sorted(topic for topic in taken if found[topic] == ODOMETRY)
    if len(sources) > 1:
        raise InvalidInput(f"topics: expected one with odometry, found {', '.join(sources)}")
    return taken


def _may_have_obstacles(kind: str) -> bool:
    """Whether messages of a kind that no node takes may tell of obstacles."""
    package, name = kind.split("/")[0], kind.split("/")[-1]
    return kind not in KINDS and not (WITHOUT_OBSTACLES.fullmatch(package) and not OF_OBSTACLES.search(name))


def replay(messages: Iterable[Sent], node: Node) -> list[Command]:
    """Commands of a node that takes the messages in their order, with those where no odometry came in time."""
    commands: list[Command] = []
    for each in messages:
        found = [*node.overdue(each.t), node.receive(each.message, each.t)]
        commands += [command for command in found if command is not None]
    return commands


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
    with replacing(file) as part, part.open("w", newline="", encoding="utf-8") as stream:
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

    mcap = StoragePlugin.MCAP
    with replacing(folder, WriterError) as part, Writer(part, version=9, storage_plugin=mcap) as bag:
        connections: dict[str, Any] = {}
        for topic, kind, t, message in messages:
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=store())
            bag.write(connections[topic], t, store().serialize_cdr(message, kind))


def as_sent(commands: Iterable[Command], topic: str = "/cmd_vel") -> Iterator[Sent]:
    """Commands as messages of a bag, at the time of their odometry."""
    return (Sent(topic, TWIST, each.stamp, each.twist(kinds())) for each in commands)


def stamped(t: float, frame: str) -> Any:
    """A std_msgs/Header at time t [s] in a frame."""
    types = store().types
    stamp = round(t * SECOND)
    time = types["builtin_interfaces/msg/Time"](sec=stamp // SECOND, nanosec=stamp % SECOND)
    return types["std_msgs/msg/Header"](stamp=time, frame_id=frame)


# Topics of ROS 2 over DDS, without ROS: names, types, quality of service and bytes are those of a ROS 2 node.
#
# A topic /odom is rt/odom on the wire, a type nav_msgs/msg/Odometry is nav_msgs::msg::dds_::Odometry_ (the mapping of
# ROS 2 to DDS). Types are final and encoded as plain CDR (XCDR version 1).


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
        return (sent for silence, sent in self.heard(timeout, timeout) if silence == 0.0)

    def heard(self, timeout: float, period: float) -> Iterator[tuple[float, Sent]]:
        """As `messages`, each with 0; after each `period` [s] without any the last one again, with the silence [s]."""
        silence, last = 0.0, None
        while silence < timeout:
            if not self._wait.wait(round(period * SECOND)):
                silence += period
                if last is not None:
                    yield silence, last
                continue
            taken = [
                Sent(topic, kind, int(message.sample_info.source_timestamp), message)
                for topic, kind, reader in self._readers
                for message in reader.take(DEPTH)
                if message.sample_info.valid_data
            ]
            for last in sorted(taken, key=lambda each: each.t):
                silence = 0.0
                yield 0.0, last

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

    Where no odometry comes in time it commands to brake; after the last message these commands are sent only.

    Args:
        topics: the kind of message by topic.
        timeout: [s] without any message after which the node ends.
        seen: called with each message before the node takes it, for example to keep it for a bag.
    """
    wire = Wire(domain)
    writer = wire.writer(command, TWIST)
    kinds = dds_kinds()
    made, braking = list[Command](), list[Command]()
    for topic, kind in topics.items():
        wire.read(topic, kind)
    for silence, each in wire.heard(timeout, node.driver.navigator.period):
        braked = node.overdue(each.t + round(silence * SECOND))
        braking += braked
        for one in braked:
            wire.send(writer, one.twist(kinds))
        if silence > 0.0:
            continue
        if seen is not None:
            seen(each)
        found = node.receive(each.message, each.t)
        made, braking = [*made, *braking], []
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


# Figure of a replay: the commands, and the obstacles at the decisions.


def figure(commands: Sequence[Command], robot: Shape) -> Any:
    """Draw the states from which a node decided, its commands, and the obstacles as it estimated them.

    Raises:
        InvalidInput: fewer than two commands.
    """
    from slalom.view.figure import driven

    if len(commands) < 2:
        raise InvalidInput(f"--figure: expected at least 2 commands to draw, found {len(commands)}")
    inputs = [command.decision.inputs for command in commands]
    known = [each for each in inputs if each is not None]
    goal = next((each.goal for each in reversed(known) if each.goal is not None), None)
    # Times since the epoch would hide differences of seconds.
    first = known[0].now
    return driven(
        [each.now - first for each in known],
        np.array([each.state.position for each in known]),
        _estimated(known, first),
        robot=robot,
        goal=goal,
        commands={
            "speed [m/s]": np.array([np.linalg.norm(each.linear) for each in commands]),
            "turn rate [rad/s]": np.array([each.angular for each in commands]),
        },
    )


def _estimated(inputs: Sequence[Any], first: float) -> list[Obstacle]:
    """The map of the last decision, and tracked obstacles where they were estimated at each.

    Times are in seconds since `first`.
    """
    seen: dict[object, list[tuple[float, Array, Shape]]] = {}
    for each in inputs:
        for part in each.obstacles:
            if isinstance(part, Tracks):
                for id, state, radius in zip(part.ids, part.states, part.radii):
                    seen.setdefault(id, []).append((each.now - first, state[0], Disc(float(radius))))
            elif isinstance(part, Obstacle):
                seen.setdefault(part.name, []).append(
                    (each.now - first, part.trajectory.position(each.now), part.shape)
                )
    found = [one for part in inputs[-1].obstacles if isinstance(part, ObstacleTable) for one in part.given]
    for id, rows in seen.items():
        times, places, shapes = zip(*rows)
        motion = Sampled(times, np.array(places)) if len(rows) > 1 else Stationary(places[0])
        found.append(Obstacle(shapes[-1], motion, str(id), after_end="leaves"))
    return found
