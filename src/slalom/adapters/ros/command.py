"""Commands of a node to a robot, and their messages."""

from typing import Any, NamedTuple

from slalom.checks import Array
from slalom.decision import Decision


class Command(NamedTuple):
    """Command for a period from the time of an odometry on."""

    stamp: int  # [ns]
    linear: Array  # (2,) [m/s] in the frame of the body, at the end of the period
    angular: float  # [rad/s] at the end of the period
    acceleration: Array  # (2,) [m/s^2] in the frame of the body, mean of the period; of the point ahead of the axle
    decision: Decision

    def twist(self, kinds: Any) -> Any:
        """A geometry_msgs/Twist, made of `kinds.Twist` and `kinds.Vector3`."""
        linear, angular = (*self.linear.tolist(), 0.0), (0.0, 0.0, self.angular)
        return kinds.Twist(linear=_vector3(kinds, linear), angular=_vector3(kinds, angular))

    def accel(self, kinds: Any) -> Any:
        """A geometry_msgs/Accel, made of `kinds.Accel` and `kinds.Vector3`; it does not turn."""
        linear = (*self.acceleration.tolist(), 0.0)
        return kinds.Accel(linear=_vector3(kinds, linear), angular=_vector3(kinds, (0.0, 0.0, 0.0)))


def _vector3(kinds: Any, values: tuple[float, ...]) -> Any:
    return kinds.Vector3(**dict(zip("xyz", values, strict=True)))
