"""Trajectories composed of others, and of plain functions."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slalom.base.checks import (
    TRAJECTORY,
    Array,
    NotNegative,
    Number,
    Positive,
    array,
    check_fields,
    has,
    listing,
    positive,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import JUMP
from slalom.model.path import Path, even_knots, hermite_pieces
from slalom.model.trajectory.protocol import Trajectory, moving_direction, times_within


@dataclass(frozen=True, eq=False)
class Composite:
    """Concatenation of trajectories: parts[k] until switches[k] [s], the last one until its own end.

    For example a lane, then a line: Composite((lane, line), (4.0,)), where both have the same position at 4 s.

    Raises:
        InvalidInput: not one switch between two parts each; switches that do not increase; a part that does not exist
            at its switch; parts with a gap above JUMP.
    """

    parts: tuple[Trajectory, ...]
    switches: tuple[float, ...]

    def __post_init__(self) -> None:
        listing(self.parts, "trajectories", "parts")
        listing(self.switches, "times", "switches")
        for k, part in enumerate(self.parts):
            has(part, *TRAJECTORY, f"parts[{k}]")
        if len(self.parts) != len(self.switches) + 1 or not self.switches:
            raise InvalidInput(
                f"switches: expected one between two parts each, found {len(self.switches)} for {len(self.parts)} parts"
            )
        dimensions = sorted({part.dimension for part in self.parts})
        if len(dimensions) > 1:
            raise InvalidInput(f"parts: expected one dimension, found {dimensions}")
        if np.any(np.diff(array(self.switches, "switches")) <= 0):
            raise InvalidInput(f"switches: expected increasing times, found {self.switches}")
        for k, t in enumerate(self.switches):
            for part in self.parts[k : k + 2]:
                if not part.span[0] <= t <= part.span[1]:
                    raise InvalidInput(f"switches: expected both parts to exist at {t:g} s, found a span {part.span}")
            jump = float(np.linalg.norm(self.parts[k].position(t) - self.parts[k + 1].position(t)))
            if jump > JUMP:
                raise InvalidInput(f"parts: expected parts that meet, found a jump of {jump:g} m at {t:g} s")

    @property
    def dimension(self) -> int:
        return self.parts[0].dimension

    @property
    def span(self) -> tuple[float, float]:
        return self.parts[0].span[0], self.parts[-1].span[1]

    def _of_parts(self, t: npt.ArrayLike, name: str) -> Array:
        """Evaluate the method `name` of the part that applies at each time (...): (..., d)."""
        time = np.asarray(t, dtype=np.float64)
        k = np.searchsorted(self.switches, time, side="right")
        result = np.empty((*time.shape, self.dimension))
        for index, part in enumerate(self.parts):
            applies = k == index
            if np.any(applies):
                result[applies] = getattr(part, name)(time[applies])
        return result

    def position(self, t: npt.ArrayLike) -> Array:
        return self._of_parts(t, "position")

    def velocity(self, t: npt.ArrayLike) -> Array:
        return self._of_parts(t, "velocity")

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return self._of_parts(t, "acceleration")

    def _pieces(self, start: float, end: float) -> list[tuple[Trajectory, float, float]]:
        """Parts that apply between start and end [s], each with its interval."""
        edges = (-np.inf, *self.switches, np.inf)
        cut = [(part, max(start, a), min(end, b)) for part, a, b in zip(self.parts, edges[:-1], edges[1:])]
        return [(part, a, b) for part, a, b in cut if a < b or (a == b == start == end)]

    def breaks(self, start: float, end: float) -> Array:
        inner = [part.breaks(a, b) for part, a, b in self._pieces(start, end)]
        switches = np.array([t for t in self.switches if start < t < end])
        return np.unique(np.concatenate([*inner, switches]))

    def speed_bound(self, start: float, end: float) -> float:
        return max(part.speed_bound(a, b) for part, a, b in self._pieces(start, end))

    def acceleration_bound(self, start: float, end: float) -> float:
        return max(part.acceleration_bound(a, b) for part, a, b in self._pieces(start, end))

    def direction(self, start: float, end: float, tolerance: float) -> Path:
        """Direction of the motion in certified pieces, see `direction.Directed`."""
        return _joined([moving_direction(part, a, b, tolerance) for part, a, b in self._pieces(start, end)])

    def path(self, start: float, end: float) -> Path:
        return _joined([part.path(a, b) for part, a, b in self._pieces(start, end)])


def part_until(trajectory: Trajectory, now: float) -> Trajectory:
    """The trajectory up to `now` [s]: the first part of a composite that has not switched, else the whole."""
    while isinstance(trajectory, Composite) and now <= trajectory.switches[0]:
        trajectory = trajectory.parts[0]
    return trajectory


def _joined(paths: list[Path]) -> Path:
    """Concatenation of paths."""
    times = np.concatenate([paths[0].times[:1], *(path.times[1:] for path in paths)])
    return Path(times, np.concatenate([p.points for p in paths]), np.concatenate([p.error for p in paths]))


@dataclass(frozen=True, eq=False)
class Function:
    """Motion given by `function` from a time [s] to a position (d,) [m].

    The caller guarantees |velocity| <= max_speed [m/s] and |acceleration| <= max_acceleration [m/s^2] between `first`
    and `last` [s]; all certificates depend on it. The motion is replaced by chords within `tolerance` [m], by h^2
    max_acceleration / 8; a smaller tolerance gives more chords. Velocity and acceleration are central differences.

    Raises:
        InvalidInput: negative bounds, an empty span, a position of the wrong form.
    """

    function: Callable[[float], npt.ArrayLike]
    max_speed: NotNegative
    max_acceleration: NotNegative
    first: Number
    last: Number
    tolerance: Positive = 1e-3

    def __post_init__(self) -> None:
        has(self.function, ("__call__",), "a function of a time", "function")
        check_fields(self)
        positive(self.last - self.first, "last - first")
        position = np.asarray(self.function(self.first), dtype=np.float64)
        if position.shape not in ((2,), (3,)) or not np.all(np.isfinite(position)):
            raise InvalidInput(f"function: expected a position of 2 or 3 finite numbers, found {position}")

    @property
    def dimension(self) -> int:
        return int(np.size(self.function(self.first)))

    @property
    def span(self) -> tuple[float, float]:
        return self.first, self.last

    def position(self, t: npt.ArrayLike) -> Array:
        time = times_within(self.span, t)
        positions = [np.asarray(self.function(float(x)), dtype=np.float64) for x in time.ravel()]
        return np.array(positions).reshape(*time.shape, self.dimension)

    def _inside(self, t: npt.ArrayLike) -> tuple[Array, float]:
        """Times moved inward by the difference step where they are within it of an end, and that step [s]."""
        step = min(1e-4, 0.25 * (self.last - self.first))
        return np.clip(np.asarray(t, dtype=np.float64), self.first + step, self.last - step), step

    def velocity(self, t: npt.ArrayLike) -> Array:
        self.position(t)
        time, step = self._inside(t)
        return np.asarray((self.position(time + step) - self.position(time - step)) / (2.0 * step))

    def acceleration(self, t: npt.ArrayLike) -> Array:
        self.position(t)
        time, step = self._inside(t)
        ends = self.position(time + step) + self.position(time - step)
        return np.asarray((ends - 2.0 * self.position(time)) / (step * step))

    def breaks(self, start: float, end: float) -> Array:
        return np.empty(0)

    def speed_bound(self, start: float, end: float) -> float:
        return self.max_speed

    def acceleration_bound(self, start: float, end: float) -> float:
        return self.max_acceleration

    def path(self, start: float, end: float) -> Path:
        max_step = np.sqrt(8.0 * self.tolerance / self.max_acceleration) if self.max_acceleration else np.inf
        times = even_knots(start, end, float(max_step))
        positions = self.position(times)
        chord_velocity = np.diff(positions, axis=0) / np.diff(times)[:, None]
        error = self.max_acceleration * (times[1] - times[0]) ** 2 / 8.0
        return hermite_pieces(times, positions, chord_velocity, chord_velocity, error)
