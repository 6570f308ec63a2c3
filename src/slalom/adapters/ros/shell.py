"""A node of rclpy around the core: topics in, geometry_msgs/Twist out. Not run here: it needs an installation of ROS 2.

Start it as `python -m slalom.adapters.ros.shell --ros-args -p radius:=0.25 -p track:=0.4 -r people:=/tracked`.
"""

from dataclasses import fields
from typing import Any, Final

from slalom.adapters.ros.settings import NodeSettings
from slalom.base.errors import InvalidInput

TOPICS: Final = {
    "odom": "nav_msgs/msg/Odometry",
    "people": "visualization_msgs/msg/MarkerArray",
    "objects": "derived_object_msgs/msg/ObjectArray",
    "obstacles": "costmap_converter_msgs/msg/ObstacleArrayMsg",
    "map": "nav_msgs/msg/OccupancyGrid",
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
    free = ParameterDescriptor(dynamic_typing=True)  # some are None by default
    chosen = {each.name: ros.declare_parameter(each.name, each.default, free).value for each in fields(NodeSettings)}
    core, commands = NodeSettings(**chosen).node(), ros.create_publisher(Twist, "cmd_vel", 10)
    kinds = type("Kinds", (), {"Twist": Twist, "Vector3": Vector3})

    def receive(message: Any) -> None:
        try:
            command = core.receive(message)
        except InvalidInput as error:
            ros.get_logger().error(str(error))
            commands.publish(Twist())
            return
        if command is not None:
            commands.publish(command.twist(kinds))

    for topic, kind in TOPICS.items():
        lasting = DurabilityPolicy.TRANSIENT_LOCAL if topic in ("map", "tf_static") else DurabilityPolicy.VOLATILE
        try:
            ros.create_subscription(get_message(kind), topic, receive, QoSProfile(depth=10, durability=lasting))
        except ModuleNotFoundError as error:
            ros.get_logger().warning(f"{topic}: not read, found no {error.name}")
    rclpy.spin(ros)


if __name__ == "__main__":
    main()
