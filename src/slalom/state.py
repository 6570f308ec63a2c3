"""State of a robot or an observed obstacle."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, number, vector
from slalom.errors import InvalidInput


@dataclass(frozen=True, eq=False)
class State:
    """Position [m], velocity [m/s] and acceleration [m/s^2] in the world frame, each (d,), d = 2 or 3.

    The acceleration is the one applied up to now. Only responses that start from it (jerk) and forecasts use it.

    `heading` [rad], in the plane only, is the direction of the x axis of the body. Bounds in the frame of the body are
    then along it. None: along the velocity.

    Raises:
        InvalidInput: values that are not finite, or of different dimensions; a heading in space.
    """

    position: Array
    velocity: Array
    acceleration: Array
    heading: float | None

    def __init__(
        self,
        position: npt.ArrayLike,
        velocity: npt.ArrayLike,
        acceleration: npt.ArrayLike | None = None,
        heading: float | None = None,
    ) -> None:
        checked_position = vector(position, "position")
        object.__setattr__(self, "position", checked_position)
        object.__setattr__(self, "velocity", vector(velocity, "velocity", checked_position.size))
        acceleration_or_zero = np.zeros(checked_position.size) if acceleration is None else acceleration
        object.__setattr__(self, "acceleration", vector(acceleration_or_zero, "acceleration", checked_position.size))
        object.__setattr__(self, "heading", None if heading is None else number(heading, "heading"))
        if heading is not None and checked_position.size == 3:
            raise InvalidInput(f"heading: expected none in space, found {heading:g}")

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.position.size
