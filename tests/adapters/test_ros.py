"""ROS 2 without ROS: bags and the wire, with the packages of `slalom[ros]`."""

import subprocess
import sys
from importlib import import_module
from itertools import islice
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from slalom.cli import BAD_INPUT, DONE, FAILED, call

pytest.importorskip("rosbags.highlevel", reason="the package rosbags is not installed: pip install 'slalom[ros]'")
pytestmark = pytest.mark.adapters

from slalom.adapters.ros import messages as definitions, topics  # noqa: E402

ROOT = Path(__file__).parents[2]
FLAGS = ["--radius", "0.25", "--track", "0.4", "--ahead", "0.4", "--max-speed", "1.4", "--max-acceleration", "4"]
FLAGS += ["--horizon", "3", "--position-error", "0.02", "--acceleration-error", "0.05"]
WIRE = [*definitions.OBSTACLES, "nav_msgs/msg/Odometry", "visualization_msgs/msg/MarkerArray"]
WIRE += ["nav_msgs/msg/OccupancyGrid", "nav_msgs/msg/Path", "geometry_msgs/msg/Twist", "tf2_msgs/msg/TFMessage"]


@pytest.fixture(scope="module")
def example() -> ModuleType:
    sys.path.insert(0, str(ROOT / "examples"))
    return import_module("09_ros")


@pytest.fixture(scope="module")
def drive(example, tmp_path_factory) -> Path:
    """A bag of 6 s of the example, in which the commands are those of the node that drove."""
    world, node, messages, commands = example.World(2), example.SETTINGS.node(), [], []
    for sent in world.beginning():
        messages.append(sent)
        node.receive(sent.message)
    for _ in range(60):
        for sent in world.seen():
            messages.append(sent)
            command = node.receive(sent.message)
        commands.append(command)
        world.drive(float(command.linear[0]), command.angular)
    path = tmp_path_factory.mktemp("bags") / "drive"
    topics.write_bag([*messages, *topics.as_sent(commands)], path)
    return path


def test_a_bag_gives_the_commands_of_the_first_run_to_the_bit(drive, tmp_path, capsys):
    table, again, figure = tmp_path / "c.csv", tmp_path / "again", tmp_path / "c.png"
    given = ["ros", "replay", str(drive), *FLAGS, "--expected", "/cmd_vel"]
    assert call([*given, "--out", str(table), "--figure", str(figure), "--json"]) == DONE
    assert '"commands": 60' in capsys.readouterr().out
    assert call([*given, "--out", str(again)]) == DONE
    first, second = ([s.message for s in topics.read_bag(path, ["/cmd_vel"])] for path in (drive, again))
    assert len(first) == 60
    assert [topics._numbers(twist) for twist in first] == [topics._numbers(twist) for twist in second]
    rows = [line.split(",") for line in table.read_text().splitlines()]
    assert rows[0] == list(topics.COLUMNS)
    assert [float(row[1]) for row in rows[1:]] == [twist.linear.x for twist in first]
    assert figure.stat().st_size > 10_000


def test_the_share_of_the_messages_that_are_read_is_reported(drive):
    shares = []
    read = list(topics.read_bag(drive, ["/odom"], shares.append))
    assert shares == [k / len(read) for k in range(1, len(read) + 1)]


def test_obstacles_that_are_not_read_are_refused_or_ignored(drive, tmp_path, capsys):
    """A bag with the scans of a laser, whose messages no node takes."""
    store = definitions.store()
    scan = store.types["sensor_msgs/msg/LaserScan"]
    empty = np.zeros(0, np.float32)
    numbers = dict.fromkeys(("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time"), 0.1)
    seen = scan(
        header=topics.stamped(1001.0, "base"), range_min=0.1, range_max=9.0, ranges=empty, intensities=empty, **numbers
    )
    path = tmp_path / "with scans"
    messages = list(topics.read_bag(drive))
    topics.write_bag([*messages, topics.Sent("/scan", "sensor_msgs/msg/LaserScan", messages[-1].t + 1, seen)], path)
    assert call(["ros", "replay", str(path), *FLAGS]) == BAD_INPUT
    told = capsys.readouterr().err
    assert "named by --ignore; found /scan (sensor_msgs/msg/LaserScan)" in told
    assert "people_msgs/msg/People" in told
    assert call(["ros", "replay", str(path), *FLAGS, "--ignore", "/scan", "--json"]) == DONE
    assert '"commands": 60' in capsys.readouterr().out
    assert call(["ros", "replay", str(path), *FLAGS, "--topics", "/odom", "/goal_pose", "/tf"]) == DONE


def test_a_gap_of_odometry_is_replayed_with_the_commands_to_brake(drive):
    """In place of 2 s in the middle of the drive; the robot is then where it was, and drives on."""
    messages = list(topics.read_bag(drive))
    begin = messages[0].t + 2 * 10**9
    kept = [each for each in messages if each.topic != "/odom" or not begin < each.t < begin + 2 * 10**9]
    node = import_module("09_ros").SETTINGS.node()
    commands = topics.replay(kept, node)
    late = [each for each in commands if each.status.name == "NO_STATE"]
    assert 3 <= len(late) <= 15
    assert np.abs(late[-1].linear).max() <= 1e-6
    times = [each.stamp for each in commands]
    assert times == sorted(times)


def test_other_settings_give_other_commands_and_are_noticed(drive, capsys):
    changed = [*FLAGS, "--margin", "0.2"]
    assert call(["ros", "replay", str(drive), *changed, "--expected", "/cmd_vel"]) == FAILED
    assert call(["ros", "replay", str(drive), "--topics", "/nothing"]) == BAD_INPUT
    assert "topics: expected some of /cmd_vel, /goal_pose" in capsys.readouterr().err


def test_a_goal_may_come_from_the_command_line(drive, capsys):
    given = ["ros", "replay", str(drive), *FLAGS, "--topics", "/odom", "--goal", "-3,1", "--json"]
    assert call(given) == DONE
    assert '"commands": 60, "unsafe": 0' in capsys.readouterr().out


def drawn(node, rng):
    """A message, or a value of a field, at random; `node` is as rosbags describes fields."""
    kind, details = node
    store = definitions.store()
    if kind.name == "NAME":
        return store.types[details](**{name: drawn(each, rng) for name, each in store.fielddefs[details][1]})
    if kind.name == "BASE":
        if details[0] in ("string", "bool"):
            return "ab/c"[: rng.integers(5)] if details[0] == "string" else bool(rng.integers(2))
        number = np.dtype(details[0])
        return number.type(rng.normal() if number.kind == "f" else rng.integers(100)).item()
    count = details[1] if kind.name == "ARRAY" else rng.integers((details[1] or 4) + 1)
    values = [drawn(details[0], rng) for _ in range(count)]
    numbers = details[0][0].name == "BASE" and details[0][1][0] != "string"
    return np.array(values, details[0][1][0]) if numbers else values


@pytest.mark.parametrize("kind", WIRE)
def test_cyclonedds_and_rosbags_write_the_same_bytes(kind):
    """Of random messages; and each reads those of the other."""
    pytest.importorskip("cyclonedds", reason="the package cyclonedds is not installed: pip install 'slalom[ros]'")
    from rosbags.interfaces import Nodetype

    rng, store, lengths = np.random.default_rng(0), definitions.store(), set()
    for _ in range(10):
        message = drawn((Nodetype.NAME, kind), rng)
        raw, sent = bytes(store.serialize_cdr(message, kind)), definitions.to_dds(message)
        assert sent.serialize(use_version_2=False) == raw
        assert type(sent).deserialize(raw).serialize(use_version_2=False) == raw
        assert bytes(store.serialize_cdr(store.deserialize_cdr(raw, kind), kind)) == raw
        lengths.add(len(raw))
    assert len(lengths) > 1 or kind.endswith(("Twist", "BoundingBox3D"))


def test_names_on_the_wire_are_those_of_ros():
    pytest.importorskip("cyclonedds", reason="the package cyclonedds is not installed: pip install 'slalom[ros]'")
    topic = topics.Wire(31).writer("/odom", "nav_msgs/msg/Odometry").topic
    assert (topic.get_name(), topic.get_type_name()) == ("rt/odom", "nav_msgs::msg::dds_::Odometry_")


def test_messages_come_in_the_order_in_which_they_were_written(example):
    pytest.importorskip("cyclonedds", reason="the package cyclonedds is not installed: pip install 'slalom[ros]'")
    one, other, world = topics.Wire(32), topics.Wire(32), example.World(0)
    kinds = {sent.topic: sent.kind for sent in world.seen()}
    writers = {topic: one.writer(topic, kind) for topic, kind in kinds.items()}
    for topic, kind in kinds.items():
        other.read(topic, kind)
    written = [sent for _ in range(5) for sent in world.seen()]
    for sent in written:
        one.send(writers[sent.topic], sent.message)
    read = list(islice(other.messages(5.0), len(written)))
    assert [sent.topic for sent in read] == [sent.topic for sent in written]
    assert all(a.message == definitions.to_dds(b.message) for a, b in zip(read, written))


def test_a_map_is_kept_for_a_reader_that_comes_later(example):
    pytest.importorskip("cyclonedds", reason="the package cyclonedds is not installed: pip install 'slalom[ros]'")
    one, other, world = topics.Wire(33), topics.Wire(33), example.World(0)
    # A writer that is gone keeps nothing.
    writers = [(one.writer(sent.topic, sent.kind), sent.message) for sent in world.beginning()]
    for writer, message in writers:
        one.send(writer, message)
    for sent in world.beginning():
        other.read(sent.topic, sent.kind)
    assert [sent.topic for sent in other.messages(1.0)] == ["/map"]


def test_a_node_in_another_process_answers_over_dds(tmp_path):
    """The commands that it sends are those of the replay of what it got."""
    pytest.importorskip("cyclonedds", reason="the package cyclonedds is not installed: pip install 'slalom[ros]'")
    command = [sys.executable, "benchmarks/ros_wire.py", "--quick", "--out", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "met: drives that collided: 0" in done.stdout
    assert "met: commands replayed differently: 0" in done.stdout


def test_the_example_runs():
    done = subprocess.run([sys.executable, "examples/09_ros.py"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "0 differ" in done.stdout


def test_a_name_too_long_for_a_bag_is_one_clear_line(capsys: pytest.CaptureFixture) -> None:
    assert call(["ros", "replay", 300 * "a", "--goal", "1,2"]) == BAD_INPUT
    assert capsys.readouterr().err.endswith("expected a bag of ROS, found a name that is too long\n")
