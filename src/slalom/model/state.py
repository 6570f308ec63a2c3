"""State of a robot or an observed obstacle."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, number, vector
from slalom.base.errors import InvalidInput


@dataclass(frozen=True, eq=False)
class State:
    """Position [m], velocity [m/s] and acceleration [m/s^2] in the world frame, each (d,), d = 2 or 3.

    The acceleration is the one applied up to now. Only responses that start from it (jerk) and forecasts use it.

    `heading` [rad], in the plane only: of the x axis of the body, and of bounds in its frame. None: of the velocity.

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

    @cached_property
    def dimension(self) -> int:
        """2 or 3."""
        return self.position.size


# Maps of the control that are affine with a gain: a number, or in the plane a turn and a scale.


def scaled(gain: npt.ArrayLike, vectors: Array) -> Array:
    """Vectors (..., d) times the gain (...), broadcast.

    A complex gain g + i k, in the plane only, scales by its modulus and turns by its argument: (g x - k y, g y + k x).
    """
    factor = np.asarray(gain)
    if not np.iscomplexobj(factor):
        return np.asarray(factor[..., None] * vectors)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([factor.real * x - factor.imag * y, factor.real * y + factor.imag * x], axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class Affine:
    """Affine map u -> drift + gain * u from controls (d,) to the workspace, at one time or at many.

    `drift` is (..., d) and `gain` is (...): one map per leading index. A complex gain also turns u, see `scaled`. The
    drift of a position map is the position of the robot under u = 0. It is the flow of the drift vector field of
    control theory, not the field.

    slalom uses the map in four ways. The inverse image of an obstacle is avoided, that of the speed limit is
    admissible, and that of the goal is the target. The map itself moves the simulated robot.
    """

    drift: Array
    gain: Array

    def __call__(self, control: Array) -> Array:
        """Image of `control` (..., d), broadcast against the leading shape of the map."""
        return self.drift + scaled(self.gain, control)

    def inverse(self, point: Array) -> Array:
        """Control (..., d) whose image is `point` (..., d). The gain must not be 0. Law: map(map.inverse(x)) = x."""
        if np.iscomplexobj(self.gain):
            return scaled(1.0 / self.gain, point - self.drift)
        return np.asarray((point - self.drift) / self.gain[..., None])

    def pulled(self, normals: Array) -> Array:
        """Unit normals (n, d) turned so that normal . map(u) is |gain| times turned . u plus a constant."""
        return scaled(np.conj(self.gain) / np.abs(self.gain), normals)
