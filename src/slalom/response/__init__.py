"""Responses: the motion of the robot under a constant control u, affine in u with a scalar gain at every time."""

from typing import Final

from slalom.response.acceleration import AccelerateThenCoast, Acceleration
from slalom.response.jerk import Jerk
from slalom.response.protocol import Response, advance
from slalom.response.stopping import AccelerateThenBrake, AccelerateThenStop
from slalom.response.velocity import LaggedVelocity, Velocity

__all__ = [
    "RESPONSES",
    "AccelerateThenBrake",
    "AccelerateThenCoast",
    "AccelerateThenStop",
    "Acceleration",
    "Jerk",
    "LaggedVelocity",
    "Response",
    "Velocity",
    "advance",
]

RESPONSES: Final[tuple[type[Response], ...]] = (
    Velocity,
    LaggedVelocity,
    Acceleration,
    AccelerateThenCoast,
    AccelerateThenStop,
    AccelerateThenBrake,
    Jerk,
)
"""Kinds of responses."""
