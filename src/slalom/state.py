"""State of a robot or an observed obstacle."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, vector


@dataclass(frozen=True, eq=False)
class State:
    """Position [m], velocity [m/s] and acceleration [m/s^2] in the world frame, each (d,), d = 2 or 3.

    The acceleration is the one applied up to now. Only responses that start from it (jerk) and forecasts use it.

    Raises:
        InvalidInput: values that are not finite, or of different dimensions.
    """

    position: Array
    velocity: Array
    acceleration: Array

    def __init__(
        self, position: npt.ArrayLike, velocity: npt.ArrayLike, acceleration: npt.ArrayLike | None = None
    ) -> None:
        checked_position = vector(position, "position")
        object.__setattr__(self, "position", checked_position)
        object.__setattr__(self, "velocity", vector(velocity, "velocity", checked_position.size))
        acceleration_or_zero = np.zeros(checked_position.size) if acceleration is None else acceleration
        object.__setattr__(self, "acceleration", vector(acceleration_or_zero, "acceleration", checked_position.size))

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.position.size
