"""A node of rclpy and its settings, which are also those of the command line. It imports no numpy by itself."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final

from slalom.base.errors import InvalidInput
from slalom.base.tolerances import OCCUPIED

if TYPE_CHECKING:
    from slalom.adapters.ros.node import Command, Node


@dataclass(frozen=True, kw_only=True)
class NodeSettings:
    """Settings of a robot and of the use of messages.

    Parameters
    ----------
    method
        A name from `slalom list methods`.
    radius
        Of the robot about the middle of its axle [m].
    max_speed
        Largest speed [m/s]; with --track that of a wheel.
    max_acceleration
        Largest acceleration [m/s^2]; with --track that of a wheel.
    track
        Distance of two driven wheels [m]; by default the robot moves in every direction.
    ahead
        Distance of the point that decides ahead of the axle [m], with --track; by default half the track.
    max_reverse_speed
        Largest speed backwards [m/s], with --track; by default max-speed; 0: never.
    lag
        Time in which the wheels approach their commanded speeds by 63 % [s], with --track.
    delay
        Time from a decision until its command acts [s], with --track.
    period
        Time between decisions [s].
    horizon
        Time up to which collisions count [s].
    margin
        Distance to keep from obstacles [m].
    patience
        Share of the time that keeping a manoeuvre may cost [1].
    frame
        Fixed frame, in which the odometry is.
    position_error
        Standard deviation of measured positions [m].
    acceleration_error
        Root of the spectral density of the accelerations of obstacles [m/s^2/sqrt(Hz)].
    max_age
        Time after which an obstacle without a measurement is dropped [s].
    namespaces
        Namespaces of markers that are obstacles; by default all.
    occupied
        Least value of an occupied cell of a map [%].
    unknown
        Whether unknown cells of a map are occupied.
    tolerance
        Distance from the goal at which the robot has arrived [m].
    state_timeout
        Time without odometry after which the robot brakes to rest [s].
    detection_timeout
        Time without obstacle messages, after the first one, after which the robot comes to rest [s]; by default
        max-age.
    sigmas
        Standard deviations of the position of odometry, by its covariance, by which the margin grows [1].
    """

    method: str = "nao"
    radius: float = 0.3
    max_speed: float = 1.0
    max_acceleration: float = 1.0
    track: float | None = None
    ahead: float | None = None
    max_reverse_speed: float | None = None
    lag: float = 0.0
    delay: float = 0.0
    period: float = 0.1
    horizon: float = 5.0
    margin: float = 0.05
    patience: float = 0.01
    frame: str = "odom"
    position_error: float = 0.1
    acceleration_error: float = 0.1
    max_age: float = 1.0
    namespaces: Sequence[str] | None = None
    occupied: float = OCCUPIED
    unknown: bool = False
    tolerance: float = 0.2
    state_timeout: float = 0.5
    detection_timeout: float | None = None
    sigmas: float = 0.0

    def node(self) -> "Node":
        """A new node. Raises InvalidInput for settings that do not fit."""
        from slalom.adapters.ros.node import Node
        from slalom.decision.methods import method
        from slalom.decision.navigator import Navigator
        from slalom.model.limits import Limits
        from slalom.model.shape import Disc
        from slalom.perception.tracker import ConstantVelocityFilter, Tracker
        from slalom.vehicle.driver import Driver
        from slalom.vehicle.navigator import VehicleNavigator
        from slalom.vehicle.vehicle import DifferentialDrive

        settings: dict[str, Any] = {"horizon": self.horizon, "margin": self.margin, "patience": self.patience}
        body, chosen = Disc(self.radius), method(self.method)
        navigator: Navigator | VehicleNavigator
        if self.track is None:
            limits = Limits(self.max_speed, self.max_acceleration)
            navigator = Navigator(chosen, body, limits, period=self.period, **settings)
        else:
            given = ("ahead", "period", "lag", "delay", "max_reverse_speed")
            wheels = self.track, self.max_speed, self.max_acceleration
            drive = DifferentialDrive(*wheels, **{name: getattr(self, name) for name in given})
            navigator = VehicleNavigator(drive, chosen, body, **settings)
        motion = ConstantVelocityFilter(self.acceleration_error, self.position_error)
        tracker = Tracker(filter=motion, max_age=self.max_age)
        timeouts = self.state_timeout, self.detection_timeout
        return Node(
            Driver(navigator, tracker, (), *timeouts),
            self.frame,
            None if self.namespaces is None else tuple(self.namespaces),
            self.occupied,
            self.unknown,
            tolerance=self.tolerance,
            sigmas=self.sigmas,
        )


# A node of rclpy around the core: topics in, geometry_msgs/Twist out. Not run here: it needs an installation of ROS 2.
#
# Start it as `python -m slalom.adapters.ros.shell --ros-args -p radius:=0.25 -p track:=0.4 -r people:=/tracked`.
# With `-p view:=8000` the page at this port shows the decisions, see `slalom.live.attach`. With `-p record:=run.h5` its
# motion is written to this file at the end, see `slalom.sim.record`.


TOPICS: Final = {
    "odom": "nav_msgs/msg/Odometry",
    "people": "visualization_msgs/msg/MarkerArray",
    "objects": "derived_object_msgs/msg/ObjectArray",
    "obstacles": "costmap_converter_msgs/msg/ObstacleArrayMsg",
    "persons": "people_msgs/msg/People",
    "detections": "vision_msgs/msg/Detection3DArray",
    "map": "nav_msgs/msg/OccupancyGrid",
    "map_updates": "map_msgs/msg/OccupancyGridUpdate",
    "plan": "nav_msgs/msg/Path",
    "goal_pose": "geometry_msgs/msg/PoseStamped",
    "tf": "tf2_msgs/msg/TFMessage",
    "tf_static": "tf2_msgs/msg/TFMessage",
}
"""Topics, to be remapped, and their kinds; kinds whose package is not installed are left out and logged."""


def main() -> None:
    """Run the node until ROS shuts down."""
    import rclpy
    from geometry_msgs.msg import Twist, Vector3
    from rcl_interfaces.msg import ParameterDescriptor
    from rclpy.node import Node as RosNode
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from rosidl_runtime_py.utilities import get_message

    rclpy.init()
    ros = RosNode("slalom")
    port = ros.declare_parameter("view", 0).value
    monitor = None
    if port:
        from slalom.live import attach

        monitor = attach(port)
        ros.get_logger().info(f"view: {monitor.address}")
    free = ParameterDescriptor(dynamic_typing=True)  # some are None by default
    chosen = {each.name: ros.declare_parameter(each.name, each.default, free).value for each in fields(NodeSettings)}
    core, commands = NodeSettings(**chosen).node(), ros.create_publisher(Twist, "cmd_vel", 10)
    run: Any = nullcontext()
    if file := ros.declare_parameter("record", "").value:
        from slalom.sim import record

        run = record(core.driver, path=file)
        core.driver = run
    kinds = type("Kinds", (), {"Twist": Twist, "Vector3": Vector3})
    last: list[object] = [None]

    def send(step: "Callable[[int], list[Command]]") -> None:
        try:
            made = step(ros.get_clock().now().nanoseconds)
        except InvalidInput as error:
            ros.get_logger().error(str(error))
            commands.publish(Twist())
            return
        for command in made:
            if command.status is not last[0]:
                ros.get_logger().info(command.sentence)
            last[0] = command.status
            if monitor is not None:
                monitor.show(command.decision)
            commands.publish(command.twist(kinds))

    def receive(message: Any) -> None:
        send(lambda now: [command for command in (core.receive(message, now),) if command is not None])

    for topic, kind in TOPICS.items():
        lasting = DurabilityPolicy.TRANSIENT_LOCAL if topic in ("map", "tf_static") else DurabilityPolicy.VOLATILE
        try:
            ros.create_subscription(get_message(kind), topic, receive, QoSProfile(depth=10, durability=lasting))
        except ModuleNotFoundError as error:
            ros.get_logger().warning(f"{topic}: not read, found no {error.name}")
    ros.create_timer(core.driver.navigator.period, lambda: send(core.overdue))
    with run:
        rclpy.spin(ros)


if __name__ == "__main__":
    main()
