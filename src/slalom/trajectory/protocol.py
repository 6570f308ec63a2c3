"""Protocol of trajectories."""

from typing import Final, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.checks import Array
from slalom.path import Path

FOREVER: Final = (-np.inf, np.inf)


@runtime_checkable
class Trajectory(Protocol):
    """Curve in the world frame over absolute time.

    Laws: `velocity` is the derivative of `position`, and `acceleration` that of `velocity`, except at `breaks`.
    `speed_bound` and `acceleration_bound` hold between breaks. `path` stays within its stated error. Times t may have
    any shape (...); results are (..., d).
    """

    @property
    def dimension(self) -> int:
        """2 or 3."""

    @property
    def span(self) -> tuple[float, float]:
        """First and last time [s] at which the obstacle exists; (-inf, inf) for obstacles that always exist."""

    def position(self, t: npt.ArrayLike) -> Array:
        """Position (..., d) [m]. Raises OutsideSpan outside `span`."""

    def velocity(self, t: npt.ArrayLike) -> Array:
        """Velocity (..., d) [m/s]; at a break, the value that follows it. Raises OutsideSpan."""

    def acceleration(self, t: npt.ArrayLike) -> Array:
        """Acceleration (..., d) [m/s^2]; at a break, the value that follows it. Raises OutsideSpan."""

    def breaks(self, start: float, end: float) -> Array:
        """Increasing times (k,) [s] strictly between start and end at which velocity or acceleration may jump."""

    def speed_bound(self, start: float, end: float) -> float:
        """Upper bound [m/s] of |velocity| from start to end [s]."""

    def acceleration_bound(self, start: float, end: float) -> float:
        """Upper bound [m/s^2] of |acceleration| between breaks from start to end [s]."""

    def path(self, start: float, end: float) -> Path:
        """Cubic pieces from start to end [s] (both within `span`), each within INTERPOLATION of the curve."""


class Endless:
    """Members shared by trajectories without start, end and breaks."""

    @property
    def span(self) -> tuple[float, float]:
        return FOREVER

    def breaks(self, start: float, end: float) -> Array:
        return np.empty(0)
