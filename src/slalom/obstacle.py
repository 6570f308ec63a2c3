"""Obstacles: shapes on trajectories."""

from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, has, number
from slalom.errors import InvalidInput
from slalom.path import Path
from slalom.shape import Disc, Shape
from slalom.tolerances import LOOK_BACK
from slalom.trajectory import Trajectory
from slalom.trajectory.direction import direction_path
from slalom.uncertainty import Uncertainty

MOTION: Final = "motion"


@dataclass(frozen=True, eq=False)
class Obstacle:
    """`shape` that moves along `trajectory`; `name` appears in messages and recordings.

    Attributes:
        heading: direction of the shape's x axis in the plane: an angle [rad], counter-clockwise from the world's x
            axis, or "motion": along the velocity. While the velocity is zero the last direction is kept.
        uncertainty: bound on the distance from the trajectory as a function of the time since the decision; None:
            exact.

    Raises:
        InvalidInput: no shape or trajectory, or two of different dimension; a heading in space, or an invalid one.
    """

    shape: Shape
    trajectory: Trajectory
    name: str = ""
    heading: float | Literal["motion"] = 0.0
    uncertainty: Uncertainty | None = None

    def __post_init__(self) -> None:
        has(self.shape, ("parts", "dimension"), "a shape, such as Disc(radius)", f"obstacle {self.name!r}")
        trajectory = "a trajectory, such as Stationary((x, y))"
        has(self.trajectory, ("position", "span"), trajectory, f"obstacle {self.name!r}")
        if self.shape.dimension != self.trajectory.dimension:
            raise InvalidInput(
                f"obstacle {self.name!r}: expected shape and trajectory of one dimension, "
                f"found {self.shape.dimension} and {self.trajectory.dimension}"
            )
        if self.uncertainty is not None:
            has(self.uncertainty, ("radius",), "an uncertainty, such as BoundedError(0.1)", f"obstacle {self.name!r}")
        if isinstance(self.heading, str):
            if self.heading != MOTION:
                raise InvalidInput(f"heading: expected an angle [rad] or {MOTION!r}, found {self.heading!r}")
        else:
            object.__setattr__(self, "heading", number(self.heading, "heading"))
        if self.dimension == 3 and self.heading != 0.0:
            raise InvalidInput(f"heading: expected 0 in space, where orientation is constant, found {self.heading!r}")

    @cached_property
    def dimension(self) -> int:
        """2 or 3."""
        return self.shape.dimension

    @property
    def turns(self) -> bool:
        """Whether the covered set turns: always False for a disc."""
        return self.heading == MOTION and not isinstance(self.shape, Disc)

    def direction(self, t: npt.ArrayLike) -> Array:
        """Unit vectors (..., 2) of the shape's x axis at times t (...) [s], in the plane.

        Raises:
            InvalidInput: the heading follows the motion, and the obstacle has not moved before t.
        """
        time = np.asarray(t, dtype=np.float64)
        if not isinstance(self.heading, str):
            return np.asarray(np.broadcast_to([np.cos(self.heading), np.sin(self.heading)], (*time.shape, 2)))
        velocity = self.trajectory.velocity(time)
        speed = np.linalg.norm(velocity, axis=-1, keepdims=True)
        result = velocity / np.where(speed > 0.0, speed, 1.0)
        for index in np.argwhere(speed[..., 0] == 0.0):
            result[tuple(index)] = self._last_direction(float(time[tuple(index)]))
        return np.asarray(result)

    def _last_direction(self, t: float) -> Array:
        """Direction (2,) of the last motion before t [s]."""
        earliest = max(self.trajectory.span[0], t - LOOK_BACK)
        if self.trajectory.speed_bound(earliest, t) == 0.0:
            raise InvalidInput(
                f"heading of obstacle {self.name!r}: expected one that moved before {t:g} s, found it at rest since "
                f"{earliest:g} s; give the heading as an angle"
            )
        pieces = direction_path(self.trajectory, earliest, t, 1e-3).points[:, 3]
        last = pieces[np.any(pieces != 0.0, axis=1)][-1]
        return np.asarray(last / np.linalg.norm(last))

    def directions(self, start: float, end: float, tolerance: float) -> Path:
        """`direction` from start to end [s] as cubic pieces, within `tolerance` [1] or with their own error."""
        resting = self.heading != MOTION or self.trajectory.speed_bound(start, end) == 0.0
        if resting:
            pieces = np.broadcast_to(self.direction(start), (1, 4, 2))
            return Path(np.array([start, end]), pieces, np.zeros(1))
        path = direction_path(self.trajectory, start, end, tolerance)
        first = int(np.argmax(np.any(self.trajectory.velocity(path.times) != 0.0, axis=-1)))
        if first == 0:
            return path
        # At rest at first: the previous direction holds until the obstacle moves.
        points = path.points.copy()
        points[: first - 1] = self.direction(start)
        return path._replace(points=points)

    def exists(self, t: float) -> bool:
        """Whether the obstacle exists at time t [s]."""
        first, last = self.trajectory.span
        return first <= t <= last
