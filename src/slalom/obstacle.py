"""An obstacle: a shape on a trajectory."""

from dataclasses import dataclass

from slalom.errors import InvalidInput
from slalom.shape import Shape
from slalom.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A `shape` that moves along a `trajectory`; `name` appears in messages and recordings.

    Raises:
        InvalidInput: shape and trajectory of different dimension.
    """

    shape: Shape
    trajectory: Trajectory
    name: str = ""

    def __post_init__(self) -> None:
        if self.shape.dimension != self.trajectory.dimension:
            raise InvalidInput(
                f"obstacle {self.name!r}: expected shape and trajectory of one dimension, "
                f"found {self.shape.dimension} and {self.trajectory.dimension}"
            )

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.shape.dimension

    def exists(self, t: float) -> bool:
        """Whether the obstacle is there at time t [s]."""
        first, last = self.trajectory.span
        return first <= t <= last
