"""ROS 2: the core of a node, what it makes of messages, bags, and topics over DDS. See docs/ros.md."""
