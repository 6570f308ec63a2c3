"""What every trajectory is."""

from typing import ClassVar, Final, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.checks import Array
from slalom.path import Path

FOREVER: Final = (-np.inf, np.inf)


@runtime_checkable
class Trajectory(Protocol):
    """A curve in the world frame over absolute time.

    Laws: `velocity` is the derivative of `position` and `acceleration` that of `velocity`, except at `breaks`;
    `speed_bound` and `acceleration_bound` hold between breaks; `path` stays within its stated error.
    Times t may have any shape (...); results are (..., d).
    """

    @property
    def dimension(self) -> int:
        """2 or 3."""

    @property
    def span(self) -> tuple[float, float]:
        """First and last time [s] at which the obstacle exists; -inf, inf when it always does."""

    @property
    def tabulated(self) -> bool:
        """Whether `path` is expensive: its pieces are then kept and serve many decisions."""

    def position(self, t: npt.ArrayLike) -> Array:
        """Position [m]. Raises OutsideSpan outside `span`."""

    def velocity(self, t: npt.ArrayLike) -> Array:
        """Velocity [m/s]; at a break, the one that follows it. Raises OutsideSpan."""

    def acceleration(self, t: npt.ArrayLike) -> Array:
        """Acceleration [m/s^2]; at a break, the one that follows it. Raises OutsideSpan."""

    def breaks(self, start: float, end: float) -> Array:
        """Times strictly between start and end at which velocity or acceleration may jump, increasing."""

    def speed_bound(self, start: float, end: float) -> float:
        """A bound of |velocity| [m/s] over start to end."""

    def acceleration_bound(self, start: float, end: float) -> float:
        """A bound of |acceleration| [m/s^2] between breaks from start to end."""

    def path(self, start: float, end: float) -> Path:
        """Cubic pieces over start to end (both within `span`), each within INTERPOLATION of the curve."""


class Endless:
    """What trajectories without a beginning, an end and breaks have in common."""

    tabulated: ClassVar[bool] = False

    @property
    def span(self) -> tuple[float, float]:
        return FOREVER

    def breaks(self, start: float, end: float) -> Array:
        return np.empty(0)
