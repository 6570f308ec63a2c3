"""ROS 2: the core of a node, its messages, bags, and topics over DDS. See docs/ros.md."""
