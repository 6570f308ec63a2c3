"""Worlds that repeat: where the images of a place are, and which of them matter.

A period (d,) [m] says after how much along each axis the world is the same again; inf where it never is. Places are not
wrapped: a robot drives on and on, and what it meets are images, displaced by whole periods.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.kernels.arrays import Indices
from slalom.obstacle import Obstacle
from slalom.path import Path
from slalom.tolerances import INTERPOLATION
from slalom.trajectory import Stationary, Trajectory

Period = tuple[float, ...]


def refuse_no_period(period: Period, dimension: int, wide: float) -> None:
    """Raises InvalidInput unless a period has a length for each axis, perhaps inf, with room for robots `wide` [m].

    A robot's own images go as it goes and stay a period away: it need not avoid them if it does not begin in one.
    """
    if len(period) != dimension or not all(length > 0.0 for length in period):
        found = ", ".join(f"{length:g}" for length in period)
        raise InvalidInput(
            f"period: expected {dimension} numbers above 0, inf where the world does not repeat; found {found}"
        )
    if min(period) < wide:
        raise InvalidInput(
            f"period: expected at least {wide:g} m, a robot's width and the margin, found {min(period):g} m"
        )


def to_nearest(apart: Array, period: Period) -> Array:
    """What brings places nearest that are `apart` (..., d or 3) from another one: multiples of the period."""
    lengths = np.full(apart.shape[-1], np.inf)
    lengths[: len(period)] = period
    repeats = np.isfinite(lengths)
    each = np.where(repeats, lengths, 1.0)
    return np.where(repeats, -each * np.round(apart / each), 0.0)


def neighbours(period: Period, far: float) -> Array:
    """Displacements (m, d): of the nearest image, to all that may be nearer than it after both have gone `far` [m]."""
    most = np.array(
        [max(1.0, np.ceil(2.0 * far / length)) * length if np.isfinite(length) else 0.0 for length in period]
    )
    return between(-most, most, period)


def between(low: Array, high: Array, period: Period) -> Array:
    """All displacements (m, d) from `low` to `high` (d,) [m]; along an axis that does not repeat it is 0."""
    # A little more than asked for: rounding leaves out nobody.
    slack = 1e-9
    axes = [
        length * np.arange(np.ceil(a / length - slack), np.floor(b / length + slack) + 1.0)
        if np.isfinite(length)
        else np.zeros(1)
        for a, b, length in zip(low, high, period, strict=True)
    ]
    return np.array(list(product(*axes))).reshape(-1, len(period))


def images_within(apart: Array, far: float, period: Period | None) -> Array:
    """Displacements (m, d) of the images of a place `apart` (d,) from another one that are at most `far` [m] away."""
    shifts = np.zeros((1, len(apart))) if period is None else between(-far - apart, far - apart, period)
    return np.asarray(shifts[np.linalg.norm(apart + shifts, axis=1) <= far])


def images_about(k: int, places: Array, far: Array, period: Period) -> tuple[Indices, Array]:
    """Robots (m,) of which images are within `far` (n,) [m] of robot k, and by how much these are displaced (m, 3).

    The first n are all robots, in their order, each at its nearest image. Of robot k there is no other.
    """
    d, nearest = len(period), to_nearest(places - places[k], period)
    apart = (places - places[k] + nearest)[:, :d]
    reach = float(far.max())
    more = between(-reach - apart.max(axis=0), reach - apart.min(axis=0), period)
    more = more[np.any(more, axis=1)]
    within = np.linalg.norm(apart + more[:, None], axis=2) <= far
    within[:, k] = False
    which, who = np.nonzero(within)
    shifts = nearest[who]
    shifts[:, :d] += more[which]
    return np.concatenate([np.arange(len(places)), who]), np.concatenate([nearest, shifts])


@dataclass(frozen=True, eq=False)
class Displaced:
    """A trajectory that is another one displaced `by` (d,) [m]."""

    tabulated: ClassVar[bool] = False
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

    def path(self, start: float, end: float) -> Path:
        path = self.of.path(start, end)
        return path._replace(points=path.points + self.by)


def moved(trajectory: Trajectory, by: Array) -> Trajectory:
    """The trajectory displaced `by` (d,) [m]; itself if that is nothing, and at rest if it is."""
    if not np.any(by):
        return trajectory
    if isinstance(trajectory, Stationary):
        return Stationary(trajectory.initial_position + by)
    return Displaced(trajectory, by)


def displaced(obstacle: Obstacle, by: Array) -> Obstacle:
    """The image of an obstacle, displaced `by` (d,) [m]: the same object while it is asked for again and again."""
    return _image(obstacle, tuple(by.tolist())) if np.any(by) else obstacle


@lru_cache(maxsize=256)
def _image(obstacle: Obstacle, by: tuple[float, ...]) -> Obstacle:
    # Tables of obstacles are kept by the objects that they are of (see `traffic`).
    return replace(obstacle, trajectory=moved(obstacle.trajectory, np.array(by)))


def in_box(
    obstacles: Sequence[Obstacle], period: Period, start: float, horizon: float, low: Array, high: Array
) -> Iterator[tuple[int, Array]]:
    """Which obstacle and displacement (d,): all images that enter the box from `low` to `high` (d,) within a horizon.

    By the box about the course, grown by all that may cover: nobody is left out, some are given that do not enter.
    """
    for k, obstacle in enumerate(obstacles):
        first, last = obstacle.trajectory.span
        begin, end = max(start, first), min(start + horizon, last)
        if begin >= end:
            continue
        points = obstacle.trajectory.path(begin, end).points.reshape(-1, obstacle.dimension)
        reach = obstacle.shape.bounding_radius + INTERPOLATION
        if obstacle.uncertainty is not None:
            reach += float(obstacle.uncertainty.radius(horizon, obstacle.dimension))
        for by in between(low - points.max(axis=0) - reach, high - points.min(axis=0) + reach, period):
            yield k, by
