"""Periodic worlds: the images of positions, robots and obstacles, and which of them can be met.

A period (d,) [m] is the length along each axis after which the world repeats, inf where it does not. Positions are not
wrapped: a robot drives on, and it meets images that are displaced by whole periods.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, listing, number, or_infinite
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import INTERPOLATION
from slalom.forecast.forecast import Forecast
from slalom.kernels.arrays import Indices
from slalom.model.path import Path
from slalom.model.trajectory import Stationary, Trajectory
from slalom.model.trajectory.protocol import moving_direction
from slalom.obstacle.obstacle import Obstacle
from slalom.obstacle.window import predicted

IMAGES: Final = 1e-9
"""[1] Images of a periodic world are also listed up to this many periods outside the box that is searched.

Rounding then omits no image on the border of the box. Larger: more images are tested. 0: one may be missing.
"""


Period = tuple[float, ...]


def checked_period(period: Period, dimension: int, wide: float, name: str) -> Period:
    """The period. Raises InvalidInput unless it has a length above 0 for each axis, and none below `wide` [m].

    `wide` is the width of the largest robot and the margin. A robot's own images move as it does and stay a period
    away, so it need not avoid them unless it starts within one.
    """
    listing(period, f"{dimension} lengths", name)
    lengths = tuple(or_infinite(length, f"{name}[{k}]", number) for k, length in enumerate(period))
    if len(lengths) != dimension or not all(length > 0.0 for length in lengths):
        found = ", ".join(f"{length:g}" for length in lengths)
        raise InvalidInput(
            f"{name}: expected {dimension} numbers above 0, inf along an axis that does not repeat; found {found}"
        )
    if min(lengths) < wide:
        raise InvalidInput(
            f"{name}: expected at least {wide:g} m, a robot's width and the margin, found {min(lengths):g} m"
        )
    return lengths


def to_nearest(displacement: Array, period: Period) -> Array:
    """The multiples of the period (..., d or 3) [m] that make a displacement (..., d or 3) [m] shortest when added."""
    lengths = np.full(displacement.shape[-1], np.inf)
    lengths[: len(period)] = period
    repeats = np.isfinite(lengths)
    each = np.where(repeats, lengths, 1.0)
    return np.where(repeats, -each * np.round(displacement / each), 0.0)


def neighbours(period: Period, distance: float) -> Array:
    """Displacements (m, d) [m] from the nearest image to all that may be nearer after both moved by `distance` [m]."""
    largest = np.array(
        [max(1.0, np.ceil(2.0 * distance / length)) * length if np.isfinite(length) else 0.0 for length in period]
    )
    return between(-largest, largest, period)


def between(low: Array, high: Array, period: Period) -> Array:
    """All multiples of the period (m, d) [m] from `low` to `high` (d,) [m]; 0 along an axis that does not repeat."""
    axes = [
        length * np.arange(np.ceil(a / length - IMAGES), np.floor(b / length + IMAGES) + 1.0)
        if np.isfinite(length)
        else np.zeros(1)
        for a, b, length in zip(low, high, period, strict=True)
    ]
    return np.array(list(product(*axes))).reshape(-1, len(period))


def images_near(positions: Array, distances: Array, some: Indices, period: Period) -> tuple[Indices, Array]:
    """The images that any of `some` robots (m,) may be near to: their robots (i,) and displacements (i, d) [m].

    A robot and an image of another one are near if they are no farther apart than the sum of their `distances` (n,)
    [m]. positions: (n, d) [m]. Images that no robot is near to may be among them; robots themselves are not.
    """
    low, high = positions[some].min(axis=0), positions[some].max(axis=0)
    most = float(distances[some].max())
    reach = most + float(distances.max())
    shifts = between(low - reach - positions.max(axis=0), high + reach - positions.min(axis=0), period)
    shifts = shifts[np.any(shifts, axis=1)]
    images = positions + shifts[:, None]
    away = np.linalg.norm(np.maximum(np.maximum(low - images, images - high), 0.0), axis=2)
    which, robot = np.nonzero(away <= distances + most)
    return robot, shifts[which]


@dataclass(frozen=True, eq=False)
class Displaced:
    """The trajectory `of`, displaced `by` (d,) [m]."""

    of: Trajectory
    by: Array

    @property
    def dimension(self) -> int:
        return self.of.dimension

    @property
    def span(self) -> tuple[float, float]:
        return self.of.span

    def position(self, t: npt.ArrayLike) -> Array:
        return self.of.position(t) + self.by

    def velocity(self, t: npt.ArrayLike) -> Array:
        return self.of.velocity(t)

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return self.of.acceleration(t)

    def breaks(self, start: float, end: float) -> Array:
        return self.of.breaks(start, end)

    def speed_bound(self, start: float, end: float) -> float:
        return self.of.speed_bound(start, end)

    def acceleration_bound(self, start: float, end: float) -> float:
        return self.of.acceleration_bound(start, end)

    def direction(self, start: float, end: float, tolerance: float) -> Path:
        """Direction of the motion in certified pieces, see `direction.Directed`."""
        return moving_direction(self.of, start, end, tolerance)

    def path(self, start: float, end: float) -> Path:
        path = self.of.path(start, end)
        return path._replace(points=path.points + self.by)


def moved(trajectory: Trajectory, by: Array) -> Trajectory:
    """The trajectory displaced `by` (d,) [m]: the same object for a displacement of 0, `Stationary` if it is."""
    if not np.any(by):
        return trajectory
    if isinstance(trajectory, Stationary):
        return Stationary(trajectory.initial_position + by)
    return Displaced(trajectory, by)


def displaced(obstacle: Obstacle, by: Array) -> Obstacle:
    """The image of an obstacle, displaced `by` (d,) [m]; the same object at repeated calls."""
    return _image(obstacle, tuple(by.tolist())) if np.any(by) else obstacle


@lru_cache(maxsize=256)
def _image(obstacle: Obstacle, by: tuple[float, ...]) -> Obstacle:
    # Obstacle tables are cached by the identity of obstacles.
    return replace(obstacle, trajectory=moved(obstacle.trajectory, np.array(by)))


def in_box(
    obstacles: Sequence[Obstacle], period: Period, start: float, horizon: float, low: Array, high: Array
) -> Iterator[tuple[int, Array]]:
    """All images that can enter the box from `low` to `high` (d,) [m] within a horizon [s].

    Yields the index of the obstacle and the displacement (d,) [m]. The bounding box of the course, grown by the shape
    and the uncertainty, decides; it is conservative, so some images do not enter.
    """
    for k, obstacle in enumerate(obstacles):
        first, last = obstacle.trajectory.span
        begin, end = max(start, first), min(start + horizon, last)
        if begin >= end:
            continue
        points = obstacle.trajectory.path(begin, end).points.reshape(-1, obstacle.dimension)
        radius = obstacle.shape.bounding_radius + INTERPOLATION
        if obstacle.uncertainty is not None:
            radius += float(obstacle.uncertainty.radius(horizon, obstacle.dimension))
        for by in between(low - points.max(axis=0) - radius, high - points.min(axis=0) + radius, period):
            yield k, by


def images_met(
    obstacles: Sequence[Obstacle],
    forecast: Forecast,
    period: Period,
    now: float,
    horizon: float,
    low: Array,
    high: Array,
) -> Iterator[tuple[Obstacle, Obstacle, Array]]:
    """The obstacles whose images, as a forecast predicts them at `now` [s], can enter a box, see `in_box`.

    Yields the obstacle, the obstacle on its predicted trajectory, and the displacement (d,) [m] of both. Obstacles that
    appear later are included only if the forecast contains them.
    """
    existing = [o for o in obstacles if forecast.includes_future or o.exists(now)]
    foreseen = [predicted(obstacle, forecast, now) for obstacle in existing]
    for k, by in in_box(foreseen, period, now, horizon, low, high):
        yield existing[k], foreseen[k], by
