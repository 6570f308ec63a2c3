"""Responses: the motion of the robot under a constant control u, affine in u with a scalar gain at every time."""

from typing import Final

from slalom.response.acceleration import AccelerateThenCoast as AccelerateThenCoast, Acceleration as Acceleration
from slalom.response.jerk import Jerk as Jerk
from slalom.response.protocol import Response as Response, advance as advance
from slalom.response.stopping import (
    AccelerateThenBrake as AccelerateThenBrake,
    AccelerateThenStop as AccelerateThenStop,
)
from slalom.response.velocity import LaggedVelocity as LaggedVelocity, Velocity as Velocity

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
