"""ROS 2: the core of a node, its messages, bags, and topics over DDS. See docs/ros.md."""

from typing import Final

OCCUPIED: Final = 65
"""[%] Least value of an occupied cell of an occupancy grid by default, as map servers use it.

Larger: fewer cells are obstacles. Unknown cells (-1) are decided apart.
"""
