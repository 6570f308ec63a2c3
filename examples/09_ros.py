"""A robot on two wheels with messages of ROS 2, without ROS: the drive is kept as a bag and replayed."""

import sys
from math import cos, sin
from pathlib import Path
from tempfile import TemporaryDirectory

try:
    import rosbags.highlevel  # noqa: F401
except ModuleNotFoundError:
    print("This example needs rosbags: pip install 'slalom[ros]'.")
    sys.exit()

import numpy as np

from slalom.adapters.ros.messages import store
from slalom.adapters.ros.shell import NodeSettings
from slalom.adapters.ros.topics import Sent, as_sent, differences, read_bag, replay, stamped, write_bag
from slalom.vehicle import Command, DifferentialDrive, Pose

PERIOD, BODY, PERSON = 0.1, 0.25, 0.3
SETTINGS = NodeSettings(
    radius=BODY,
    track=0.4,
    ahead=0.4,
    max_speed=1.4,
    max_acceleration=4.0,
    period=PERIOD,
    horizon=3.0,
    position_error=0.02,
    acceleration_error=0.05,
)
DRIVE = DifferentialDrive(0.4, 1.4, 4.0, ahead=0.4, period=PERIOD)
MAP = np.array([-1.0, -4.0]), 0.3
"""Where the map is in the odometry: position [m] and heading [rad]."""
GOAL = (11.0, 4.0)
"""[m] In the map."""


class World:
    """A robot and people in a hall, and the messages about them; every random number follows from the seed."""

    def __init__(self, seed: int, people: int = 5) -> None:
        self.types, self.rng = store().types, np.random.default_rng(seed)
        self.now, self.pose = 1000.0, Pose(self.in_odometry((1.0, 4.0)), MAP[1], 0.0, 0.0)
        self.people = np.column_stack([self.rng.uniform(3.0, 10.0, people), self.rng.uniform(1.5, 6.5, people)])
        ways = self.rng.uniform(0.0, 2.0 * np.pi, people)
        self.velocities = 0.7 * np.column_stack([np.cos(ways), np.sin(ways)])
        self.count = 0
        self.least = np.inf  # [m] distance from people

    def in_odometry(self, points: object) -> np.ndarray:
        """Points of the map in the frame of the odometry."""
        c, s = cos(MAP[1]), sin(MAP[1])
        return MAP[0] + np.asarray(points) @ np.array([[c, s], [-s, c]])

    def make(self, name: str, **fields: object) -> object:
        """A message, such as geometry_msgs/Point."""
        package, kind = name.split("/")
        return self.types[f"{package}/msg/{kind}"](**fields)

    def at(self, position: object, heading: float) -> object:
        """A geometry_msgs/Pose."""
        x, y = (float(each) for each in position)
        turned = self.make("geometry_msgs/Quaternion", x=0.0, y=0.0, z=sin(0.5 * heading), w=cos(0.5 * heading))
        return self.make(
            "geometry_msgs/Pose", position=self.make("geometry_msgs/Point", x=x, y=y, z=0.0), orientation=turned
        )

    def sent(self, topic: str, name: str, message: object) -> Sent:
        """A message on its topic."""
        self.count += 1  # [ns] no two messages come at one time, which would leave their order open
        return Sent(topic, name.replace("/", "/msg/"), round(self.now * 1e9) + self.count, message)

    def beginning(self) -> list[Sent]:
        """The frame of the map, the map, and the goal."""
        pose = self.at(*MAP)
        moved = self.make("geometry_msgs/Vector3", x=pose.position.x, y=pose.position.y, z=0.0)
        transform = self.make("geometry_msgs/Transform", translation=moved, rotation=pose.orientation)
        header = stamped(self.now, "odom")
        placed = self.make("geometry_msgs/TransformStamped", header=header, child_frame_id="map", transform=transform)
        header = stamped(self.now, "map")
        goal = self.make("geometry_msgs/PoseStamped", header=header, pose=self.at(GOAL, 0.0))
        return [
            self.sent("/tf", "tf2_msgs/TFMessage", self.make("tf2_msgs/TFMessage", transforms=[placed])),
            self.sent("/map", "nav_msgs/OccupancyGrid", self.grid()),
            self.sent("/goal_pose", "geometry_msgs/PoseStamped", goal),
        ]

    def grid(self) -> object:
        """A hall of 12 m by 8 m in cells of 5 cm, with walls, a slanted wall and two pillars."""
        y, x = 0.05 * (np.mgrid[:160, :240] + 0.5)
        walls = np.minimum(np.minimum(x, 12.0 - x), np.minimum(y, 8.0 - y)) < 0.1
        slanted = (np.abs(0.6 * (x - 6.0) - 0.8 * (y - 6.0)) < 0.1) & (np.abs(x - 6.0) < 1.2)
        pillars = sum(np.maximum(np.abs(x - a), np.abs(y - b)) < 0.2 for a, b in ((4.0, 2.5), (8.0, 4.5)))
        cells = np.where(walls | slanted | (pillars > 0), 100, 0).astype(np.int8)
        begin = self.make("builtin_interfaces/Time", sec=0, nanosec=0)
        size = {"width": 240, "height": 160, "resolution": float(np.float32(0.05))}
        info = self.make("nav_msgs/MapMetaData", map_load_time=begin, origin=self.at((0.0, 0.0), 0.0), **size)
        return self.make("nav_msgs/OccupancyGrid", header=stamped(self.now, "map"), info=info, data=cells.ravel())

    def seen(self) -> list[Sent]:
        """People as markers, with noise, and then the odometry."""
        noisy = self.people + self.rng.normal(0.0, 0.02, self.people.shape)
        markers = [self.marker(k, self.in_odometry(place)) for k, place in enumerate(noisy)]
        crowd = self.make("visualization_msgs/MarkerArray", markers=markers)
        vector = [
            self.make("geometry_msgs/Vector3", x=x, y=0.0, z=z)
            for x, z in ((self.pose.speed, 0.0), (0.0, self.pose.turn))
        ]
        twist = self.make("geometry_msgs/Twist", linear=vector[0], angular=vector[1])
        odometry = self.make(
            "nav_msgs/Odometry",
            header=stamped(self.now, "odom"),
            child_frame_id="base_link",
            pose=self.make(
                "geometry_msgs/PoseWithCovariance",
                pose=self.at(self.pose.position, self.pose.heading),
                covariance=np.zeros(36),
            ),
            twist=self.make("geometry_msgs/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
        )
        return [
            self.sent("/people", "visualization_msgs/MarkerArray", crowd),
            self.sent("/odom", "nav_msgs/Odometry", odometry),
        ]

    def marker(self, number: int, place: np.ndarray) -> object:
        """A person as a cylinder."""
        zero = self.make("builtin_interfaces/Time", sec=0, nanosec=0)
        image = self.make("sensor_msgs/CompressedImage", header=stamped(0.0, ""), format="", data=np.zeros(0, np.uint8))
        return self.make(
            "visualization_msgs/Marker",
            header=stamped(self.now, "odom"),
            ns="people",
            id=number,
            type=3,
            action=0,
            pose=self.at(place, 0.0),
            scale=self.make("geometry_msgs/Vector3", x=2.0 * PERSON, y=2.0 * PERSON, z=1.8),
            color=self.make("std_msgs/ColorRGBA", r=0.0, g=0.5, b=1.0, a=1.0),
            lifetime=self.make("builtin_interfaces/Duration", sec=zero.sec, nanosec=zero.nanosec),
            frame_locked=False,
            points=[],
            colors=[],
            texture_resource="",
            texture=image,
            uv_coordinates=[],
            text="",
            mesh_use_embedded_materials=False,
            mesh_resource="",
            mesh_file=self.make("visualization_msgs/MeshFile", filename="", data=np.zeros(0, np.uint8)),
        )

    def drive(self, speed: float, turn: float) -> None:
        """Drive for a period to a command, while people walk; they turn around at the walls."""
        for part in np.linspace(0.0, PERIOD, 6)[1:]:
            at = DRIVE.drive(self.pose, Command(speed, turn), float(part)).position
            gaps = np.linalg.norm(self.in_odometry(self.people + part * self.velocities) - at, axis=1)
            self.least = min(self.least, float(gaps.min(initial=np.inf)) - BODY - PERSON)
        self.pose = DRIVE.drive(self.pose, Command(speed, turn))
        self.people = self.people + PERIOD * self.velocities
        out = (self.people < (0.6, 0.6)) | (self.people > (11.4, 7.4))
        self.velocities = np.where(out, np.sign((6.0, 4.0) - self.people) * np.abs(self.velocities), self.velocities)
        self.now += PERIOD

    @property
    def left(self) -> float:
        """Distance [m] from the goal."""
        return float(np.linalg.norm(self.pose.position - self.in_odometry(GOAL)))


if __name__ == "__main__":
    world, node = World(seed=1), SETTINGS.node()
    messages, commands = world.beginning(), []
    for each in messages:
        node.receive(each.message)
    while world.left > SETTINGS.tolerance and len(commands) < 300:
        seen = world.seen()
        messages += seen
        found = [node.receive(each.message) for each in seen][-1]
        commands.append(found)
        world.drive(float(found.linear[0]), found.angular)
    print(f"{len(commands)} commands; {world.left:.2f} m from the goal; at least {world.least:.2f} m from people")
    with TemporaryDirectory() as folder:
        bag = Path(folder) / "drive"
        write_bag([*messages, *as_sent(commands)], bag)
        again = replay(read_bag(bag), SETTINGS.node())
        differ = differences(again, [each.message for each in read_bag(bag, ["/cmd_vel"])])
        print(f"replayed from a bag: {len(again)} commands, {differ} differ")
    assert world.left <= SETTINGS.tolerance
    assert world.least > 0.0
    assert differ == 0
