"""A node in a process of its own that drives a robot over DDS: arrival, round trips, replay to the bit.

usage: python benchmarks/ros_wire.py [--seeds 3] [--quick]

The robot and the people are those of examples/09_ros.py. They write rt/map, rt/people, rt/odom and more by cyclonedds,
with the names and types of ROS 2; the node writes rt/cmd_vel. A round trip begins when the markers are written and ends
when the command has come; it contains the decision. The first one loads the kernels, and is
shown apart. The node keeps what it gets as a bag, which is then replayed.
"""

import argparse
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, perf_counter, sleep
from typing import Any, NamedTuple

import numpy as np
from program import finish, options, table, target

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))

from importlib import import_module

import slalom
from slalom.adapters.ros.messages import store
from slalom.adapters.ros.topics import TWIST, Sent, Wire, as_sent, differences, read_bag, replay, serve, write_bag

TOPICS = {
    "/tf": "tf2_msgs/msg/TFMessage",
    "/map": "nav_msgs/msg/OccupancyGrid",
    "/goal_pose": "geometry_msgs/msg/PoseStamped",
    "/people": "visualization_msgs/msg/MarkerArray",
    "/odom": "nav_msgs/msg/Odometry",
}
PATIENCE = 20.0
"""[s] to wait for the other process."""


class Drive(NamedTuple):
    """What happened in one drive."""

    left: float  # [m] from the goal
    clearance: float  # [m] least distance from people
    trips: np.ndarray  # [s] round trips
    commands: int
    differ: int  # commands of the replay that differ


def node(domain: int, bag: Path) -> None:
    """The process of the node."""
    settings, kept = import_module("09_ros").SETTINGS, []
    # The robot waits for each command: odometry after a first one that loads kernels would come too late.
    slalom.compile("robot", "polygons", "vehicles")

    def keep(sent: Sent) -> None:
        raw = sent.message.serialize(use_version_2=False)
        kept.append(sent._replace(t=sent.t + len(kept), message=store().deserialize_cdr(raw, sent.kind)))

    commands = serve(settings.node(), TOPICS, domain=domain, timeout=3.0, seen=keep)
    write_bag([*kept, *as_sent(commands)], bag)


def drive(seed: int, domain: int, steps: int) -> Drive:
    """The process of the robot, which starts that of the node."""
    example = import_module("09_ros")
    world, trips = example.World(seed), []
    example.World(seed).drive(0.0, 0.0)  # loads what the world needs
    with TemporaryDirectory() as folder:
        bag = Path(folder) / "drive"
        command = [sys.executable, __file__, "--node", str(domain), str(bag)]
        other = subprocess.Popen(command)
        try:
            wire = Wire(domain)
            writers = {topic: wire.writer(topic, kind) for topic, kind in TOPICS.items()}
            wire.read("/cmd_vel", TWIST)
            begin = monotonic()
            while not all(writer.get_matched_subscriptions() for writer in writers.values()):
                if monotonic() - begin > PATIENCE:
                    raise TimeoutError(f"expected a node that reads {sorted(TOPICS)} within {PATIENCE:g} s, found none")
                sleep(0.01)
            # The node has found all writers here, but its own writer may not have found this reader.
            sleep(1.0)
            for sent in world.beginning():
                wire.send(writers[sent.topic], sent.message)
            answers = wire.messages(PATIENCE)
            while world.left > example.SETTINGS.tolerance and len(trips) < steps:
                seen = world.seen()
                begin = perf_counter()
                for sent in seen:
                    wire.send(writers[sent.topic], sent.message)
                twist = next(answers).message
                trips.append(perf_counter() - begin)
                world.drive(twist.linear.x, twist.angular.z)
            other.wait(PATIENCE)
        finally:
            other.kill()
        again = replay(read_bag(bag), example.SETTINGS.node())
        differ = differences(again, [each.message for each in read_bag(bag, ["/cmd_vel"])])
    return Drive(world.left, world.least, np.array(trips), len(again), differ)


def measure(seeds: int, steps: int) -> dict[str, Any]:
    """Table and targets."""
    tolerance = import_module("09_ros").SETTINGS.tolerance
    drives = [drive(seed, 40 + seed, steps) for seed in range(seeds)]
    heads = ["seed", "commands", "from the goal m", "clearance m", "first trip ms", "median ms", "99 % ms"]
    rows = [
        [k, d.commands, d.left, d.clearance, 1e3 * d.trips[0], *(1e3 * np.percentile(d.trips[1:], (50, 99)))]
        for k, d in enumerate(drives)
    ]
    return {
        "question": "Does a node over DDS drive a robot as one in the same process does?",
        "tables": [table("Drives over DDS, two processes", heads, rows)],
        "targets": [
            target("drives that did not arrive", float(sum(d.left > tolerance for d in drives)), most=0.0),
            target("drives that collided", float(sum(d.clearance < 0.0 for d in drives)), most=0.0),
            target("commands replayed differently", float(sum(d.differ for d in drives)), most=0.0),
        ],
    }


if __name__ == "__main__":
    if sys.argv[1:2] == ["--node"]:
        node(int(sys.argv[2]), Path(sys.argv[3]))
    else:
        parser: argparse.ArgumentParser = options(__doc__)
        parser.add_argument("--seeds", type=int, default=3)
        given = parser.parse_args()
        figures = measure(1, 20) if given.quick else measure(given.seeds, 400)
        finish("ros_wire", figures, given)
