"""The rule of speed limits, once: a robot above its maximum speed cannot obey it at once."""

from slalom.kernels.jit import kernel
from slalom.tolerances import OVERSPEED_BRAKING


@kernel
def allowed_speed(max_speed: float, speed: float, max_deceleration: float, duration: float) -> float:
    """The largest admissible speed [m/s] after `duration` [s], for a robot with this speed [m/s] now.

    It is `max_speed` [m/s]. For a robot above it, the share OVERSPEED_BRAKING of full braking, `max_deceleration`
    [m/s^2], must have reduced the speed.
    """
    return max(max_speed, speed - OVERSPEED_BRAKING * max_deceleration * duration)
