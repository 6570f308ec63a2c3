"""Maps of the control that are affine with a scalar gain."""

from dataclasses import dataclass

import numpy as np

from slalom.checks import Array


@dataclass(frozen=True, slots=True, eq=False)
class Affine:
    """Affine map u -> drift + gain * u from controls (d,) to the workspace, at one time or at many.

    `drift` is (..., d) and `gain` is (...): one map per leading index. The drift of a position map is the position of
    the robot under u = 0. It is the flow of the drift vector field of control theory, not the field.

    slalom uses the map in four ways. The inverse image of an obstacle is avoided, that of the speed limit is
    admissible, and that of the goal is the target. The map itself moves the simulated robot.
    """

    drift: Array
    gain: Array

    def __call__(self, control: Array) -> Array:
        """Image of `control` (..., d), broadcast against the leading shape of the map."""
        return self.drift + self.gain[..., None] * control

    def inverse(self, point: Array) -> Array:
        """Control (..., d) whose image is `point` (..., d). The gain must not be 0. Law: map(map.inverse(x)) = x."""
        return np.asarray((point - self.drift) / self.gain[..., None])
