"""The one concept: a map of the control that is affine with a scalar gain."""

from dataclasses import dataclass

import numpy as np

from slalom.checks import Array


@dataclass(frozen=True, slots=True)
class Affine:
    """The map u -> drift + gain * u from controls to the workspace, at one time or at many.

    `drift` is (..., d) and `gain` is (...): one map per leading index. The drift of a position map is where
    the robot would be with u = 0 (not the drift vector field of control theory, but its flow).

    Four uses of this map make up slalom: the inverse image of an obstacle is kept out of, the inverse image
    of the speed limit is kept in, the inverse image of the goal is aimed at, and the map itself moves the
    simulated robot.
    """

    drift: Array
    gain: Array

    def __call__(self, control: Array) -> Array:
        """Image of `control` (..., d), broadcast against the leading shape of the map."""
        return self.drift + self.gain[..., None] * control

    def inverse(self, point: Array) -> Array:
        """Control whose image is `point` (..., d). The gain must not be 0. Law: map(map.inverse(x)) = x."""
        return np.asarray((point - self.drift) / self.gain[..., None])
