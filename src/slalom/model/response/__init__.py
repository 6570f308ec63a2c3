"""Responses: the motion of the robot under a constant control u, affine in u at every time."""

from typing import Final

from slalom.model.response.kinds import (
    AccelerateThenBrake as AccelerateThenBrake,
    AccelerateThenCoast as AccelerateThenCoast,
    AccelerateThenStop as AccelerateThenStop,
    AccelerateThenTurn as AccelerateThenTurn,
    Acceleration as Acceleration,
    Jerk as Jerk,
    LaggedVelocity as LaggedVelocity,
    Velocity as Velocity,
)
from slalom.model.response.protocol import Response as Response, advance as advance

RESPONSES: Final[tuple[type[Response], ...]] = (
    Velocity,
    LaggedVelocity,
    Acceleration,
    AccelerateThenCoast,
    AccelerateThenStop,
    AccelerateThenBrake,
    AccelerateThenTurn,
    Jerk,
)
"""Kinds of responses."""
