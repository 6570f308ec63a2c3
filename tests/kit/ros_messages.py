"""Messages of ROS as plain objects with their fields, and what a node must refuse."""

import sys
from collections.abc import Callable
from math import cos, sin
from pathlib import Path
from types import SimpleNamespace as Message
from unittest.mock import patch

import numpy as np

from slalom import Disc, Goal, Limits, Navigator, State, Stationary, method
from slalom.adapters.mavlink import setpoint
from slalom.adapters.ros import topics
from slalom.adapters.ros.messages import Frames, detections, markers, objects, obstacles, odometry, people
from slalom.adapters.ros.shell import NodeSettings
from slalom.adapters.ros.topics import figure
from slalom.cli.others import replay


def header(t: float = 10.0, frame: str = "odom") -> Message:
    """A std_msgs/Header."""
    ns = round(t * 1e9)
    return Message(stamp=Message(sec=ns // 10**9, nanosec=ns % 10**9), frame_id=frame)


def xyz(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Message:
    """A point or vector."""
    return Message(x=x, y=y, z=z)


def about(axis: tuple[float, float, float], angle: float) -> Message:
    """A geometry_msgs/Quaternion."""
    x, y, z = (sin(0.5 * angle) * each for each in axis)
    return Message(x=x, y=y, z=z, w=cos(0.5 * angle))


def pose(x: float = 0.0, y: float = 0.0, heading: float = 0.0) -> Message:
    """A geometry_msgs/Pose."""
    return Message(position=xyz(x, y), orientation=about((0.0, 0.0, 1.0), heading))


def odom(t: float = 10.0, at: Message | None = None, twist: tuple[float, ...] = (0.0, 0.0, 0.0), **changes: object):
    """A nav_msgs/Odometry with the twist (forward, sideways, turn)."""
    moving = Message(linear=xyz(*twist[:2]), angular=xyz(z=twist[2]))
    fields = {"header": header(t), "child_frame_id": "base", "pose": Message(pose=at or pose())}
    return Message(**{**fields, "twist": Message(twist=moving), **changes})


def marker(**changes: object) -> Message:
    """A visualization_msgs/Marker, a cylinder of 0.6 m by 1.8 m at (4, 0) that nothing else is said of."""
    fields = {"header": header(), "ns": "people", "id": 7, "type": 3, "action": 0, "pose": pose(4.0)}
    return Message(**{**fields, "scale": xyz(0.6, 0.6, 1.8), **changes})


def an_object(**changes: object) -> Message:
    """A derived_object_msgs/Object, a tracked box of 4 m by 2 m."""
    fields = {"header": header(), "id": 3, "detection_level": 1, "pose": pose(5.0, 1.0, 0.5)}
    fields |= {"twist": Message(linear=xyz(1.0, 2.0)), "shape": Message(type=1, dimensions=[4.0, 2.0, 1.5])}
    return Message(**{**fields, **changes})


def an_obstacle(*corners: tuple[float, float], radius: float = 0.0, velocity: tuple[float, float] = (0.0, 0.0)):
    """A costmap_converter_msgs/ObstacleMsg."""
    moving = Message(twist=Message(linear=xyz(*velocity)))
    return Message(polygon=Message(points=[xyz(*each) for each in corners]), radius=radius, id=5, velocities=moving)


def persons(*people: tuple[str, tuple[float, float], tuple[float, float]], **changes: object) -> Message:
    """A people_msgs/People: names, positions and velocities."""
    found = [Message(name=name, position=xyz(*place), velocity=xyz(*moving)) for name, place, moving in people]
    return Message(**{"header": header(), "people": found, **changes})


def measured(id: str = "7", covariance: object = (), **changes: object) -> Message:
    """A people_msgs/PositionMeasurementArray with one at (4, 0)."""
    fields = {"header": header(), "name": "leg", "object_id": id, "pos": xyz(4.0), "covariance": covariance}
    return Message(header=header(), people=[Message(**{**fields, **changes})], cooccurrence=[])


def detection(id: str = "7", covariance: object = (), **changes: object) -> Message:
    """A vision_msgs/Detection3DArray with a box of 0.6 m by 0.4 m at (4, 0), whose own header says nothing."""
    box = Message(center=pose(4.0, 0.0, 0.3), size=xyz(0.6, 0.4, 1.8))
    result = Message(pose=Message(pose=pose(4.0), covariance=covariance))
    fields = {"header": Message(stamp=Message(sec=0, nanosec=0), frame_id=""), "bbox": box, "id": id}
    return Message(header=header(), detections=[Message(**{**fields, "results": [result], **changes})])


def grid_update(cells: object, x: int = 0, y: int = 0, **changes: object) -> Message:
    """A map_msgs/OccupancyGridUpdate."""
    data = np.asarray(cells, dtype=np.int8)
    fields = {"header": header(), "x": x, "y": y, "width": data.shape[1], "height": data.shape[0]}
    return Message(**{**fields, "data": data.ravel().tolist(), **changes})


def of_pose(**variances: float) -> list[float]:
    """A covariance of 6 x 6 numbers with these variances [m^2] of x and y, and `xy` between them."""
    found = np.zeros((6, 6))
    found[0, 0], found[1, 1] = variances.get("x", 0.0), variances.get("y", 0.0)
    found[0, 1] = found[1, 0] = variances.get("xy", 0.0)
    return found.ravel().tolist()


def grid(cells: object, resolution: float = 0.5, origin: Message | None = None, **changes: object) -> Message:
    """A nav_msgs/OccupancyGrid."""
    data = np.asarray(cells, dtype=np.int8)
    size = {"width": data.shape[1], "height": data.shape[0]}
    info = Message(resolution=resolution, origin=origin or pose(), **{**size, **changes})
    return Message(header=header(frame="odom"), info=info, data=data.ravel().tolist())


def transform(parent: str, child: str, x: float, y: float, heading: float) -> Message:
    """A tf2_msgs/TFMessage with one transform."""
    moved = Message(translation=xyz(x, y), rotation=about((0.0, 0.0, 1.0), heading))
    return Message(transforms=[Message(header=header(frame=parent), child_frame_id=child, transform=moved)])


def goal_pose(x: float, y: float, heading: float = 0.0, frame: str = "odom") -> Message:
    """A geometry_msgs/PoseStamped."""
    return Message(header=header(frame=frame), pose=pose(x, y, heading))


def in_the_plane(_: Path) -> object:
    """A setpoint of a decision in the plane."""
    navigator = Navigator(method("nao"), Disc(0.3), Limits(1.0, 1.0))
    return setpoint(navigator.decide(State((0, 0), (0, 0)), [], Goal(Stationary((9, 0)))), 0.0)


def without_rosbags(_: Path) -> object:
    """The command where rosbags is not installed."""
    with patch.dict(sys.modules, {"rosbags": None}):
        return replay(Path("drive"))


def no_bag(folder: Path) -> object:
    """A reader that finds no bag, in place of that of rosbags."""

    def missing(*_: object, **__: object) -> None:
        raise FileNotFoundError("nothing")

    reader = Message(AnyReader=missing, AnyReaderError=KeyError)
    found = {"rosbags": Message(highlevel=reader), "rosbags.highlevel": reader}
    with patch.dict(sys.modules, found), patch.object(topics, "store"):
        return list(topics.read_bag(folder / "drive"))


def bag_that_exists(folder: Path) -> object:
    """A bag in place of a folder, for which no package is needed."""
    writer = Message(Writer=None, WriterError=KeyError, StoragePlugin=Message(MCAP=1))
    with patch.dict(sys.modules, {"rosbags": Message(rosbag2=writer), "rosbags.rosbag2": writer}):
        return topics.write_bag([], folder)


def with_map(message: Message) -> object:
    """A node that got a map of 2 x 2 cells, and then a message."""
    node = NodeSettings().node()
    node.receive(grid(np.zeros((2, 2))))
    return node.receive(message)


BAGS: dict[str, Callable[[Path], object]] = {
    r"drive: expected a bag of ROS, found nothing": no_bag,
    r"expected a file that can be written, found a folder": bag_that_exists,
}
"""Of files."""

FRAMES = Frames("odom")
OF_ADAPTERS: dict[str, Callable[[Path], object]] = {
    r"decision: expected one in space, found dimension 2": in_the_plane,
    r"topics: expected some of /a; found /b": lambda _: topics._taken({"/a": topics.ODOMETRY}, ["/b"]),
    r"topics: expected some with nav_.*; found x/msg/Y": lambda _: topics._taken({"/a": "x/msg/Y"}, ["/a"]),
    r"topics: expected one with odometry, found /a, /b": lambda _: topics._taken(
        {"/b": topics.ODOMETRY, "/a": topics.ODOMETRY}, None
    ),
    r"--figure: expected at least 2 commands to draw, found 0": lambda _: figure([], Disc(1.0)),
    r"bag: expected obstacles as visualization_msgs/msg/MarkerArray, .*; found /a \(sensor_msgs/msg/LaserScan\), /t "
    r"\(spencer_tracking_msgs/msg/TrackedPersons\)": lambda _: topics._taken(
        {
            "/t": "spencer_tracking_msgs/msg/TrackedPersons",
            "/a": "sensor_msgs/msg/LaserScan",
            "/image": "sensor_msgs/msg/Image",
        },
        None,
    ),
    r"ignore: expected some of /a; found /b": lambda _: topics._taken({"/a": topics.ODOMETRY}, None, ["/b"]),
    r"detection '7': expected a box in space \(Detection3D\), found one in an image": lambda _: list(
        detections(detection(bbox=Message(center=Message(theta=0.0), size_x=3.0, size_y=4.0)), FRAMES)
    ),
    r"covariance: expected 9 numbers, found 36": lambda _: list(people(measured(covariance=of_pose(x=1.0)), FRAMES)),
    r"covariance: expected a symmetric one without negative eigenvalues, found \[\[1": lambda _: odometry(
        odom(pose=Message(pose=pose(), covariance=of_pose(x=1.0, xy=2.0)))
    ),
    r"grid update: expected a nav_msgs/OccupancyGrid before, found none": lambda _: (
        NodeSettings().node().receive(grid_update([[100]]))
    ),
    r"grid update: header\.frame_id: expected 'odom', as of the map, found 'map'": lambda _: with_map(
        grid_update([[100]], header=header(frame="map"))
    ),
    r"grid update\.data: expected 2 x 1 cells, found 1": lambda _: with_map(grid_update([[100]], width=2)),
    r"part: expected cells within 2 x 2, found columns 2 to 2": lambda _: with_map(grid_update([[100]], x=2)),
    r"odometry\.header\.stamp: expected a time above 0, found 0 ns": lambda _: odometry(odom(0.0)),
    r"odometry\.pose\.orientation: expected a quaternion of length 1, found length 0": lambda _: odometry(
        odom(at=Message(position=xyz(), orientation=Message(x=0.0, y=0.0, z=0.0, w=0.0)))
    ),
    r"marker 'people' 7\.header\.frame_id: expected one of \['odom'\], or a transform .*, found 'map'": lambda _: list(
        markers(Message(markers=[marker(header=header(frame="map"))]), FRAMES)
    ),
    r"marker 'people' 7: expected a box, ball or cylinder .*, found type 9": lambda _: list(
        markers(Message(markers=[marker(type=9)]), FRAMES)
    ),
    r"object 3: expected a box, .*, found type 1 with 2 dimensions": lambda _: list(
        objects(Message(objects=[an_object(shape=Message(type=1, dimensions=[1.0, 2.0]))]), FRAMES)
    ),
    r"obstacle 5: expected a polygon with at least one corner, found none": lambda _: list(
        obstacles(Message(header=header(), obstacles=[an_obstacle()]), FRAMES)
    ),
    r"grid\.data: expected 3 x 2 cells, found 4": lambda _: (
        NodeSettings().node().receive(grid(np.zeros((2, 2)), width=3))
    ),
    r"message: expected one of nav_msgs/msg/Odometry, .*; found SimpleNamespace": lambda _: (
        NodeSettings().node().receive(Message(text="hello"))
    ),
    r"path\.poses: expected at least one pose, found none": lambda _: (
        NodeSettings().node().receive(Message(header=header(), poses=[]))
    ),
    r"odometry\.header\.frame_id: expected 'odom', found 'map'": lambda _: (
        NodeSettings().node().receive(odom(header=header(frame="map")))
    ),
}
"""Of messages and setpoints."""
