"""Cubic pieces of the bodies of obstacles over an interval of time, one obstacle at a time and joined."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from slalom.checks import Array
from slalom.kernels.arrays import Corners, Flags, Hulls, Indices, MaybeCorners, MaybeHulls, Pieces
from slalom.minkowski import MinkowskiSum
from slalom.obstacle import Obstacle
from slalom.shape import Shape
from slalom.tolerances import INTERPOLATION, UNCERTAINTY_PIECES


class Bodies(NamedTuple):
    """All pieces of all bodies, and the bodies: what relative motion is made of."""

    pieces: Pieces  # times elapsed [s]; radius [m] to add to that of the body: errors and uncertainty
    turning: bool  # whether any body turns; if not, the pieces have no directions
    owner: Indices  # (b,) the obstacle
    radius: Array  # (b,) [m] of the body itself
    hull_radius: Array  # (b,) [m]
    hull: Indices  # (b,) its own number, or -1 for a point
    corners: Array  # (c, 5) see `kernels.arrays.Corners`
    first: Indices  # (b + 1,)
    unordered: Flags  # (b,)
    uncertain: Flags  # (b,) whether its obstacle has an uncertainty
    heads: Indices  # rows with which bodies begin that exist when the window begins
    has_hulls: bool  # whether any of them is more than a point

    @property
    def maybe_corners(self) -> MaybeCorners:
        """The corners of the hulls; empty where all bodies are points."""
        return Corners(self.corners, self.first, self.unordered) if self.has_hulls else ()

    @property
    def hulls(self) -> MaybeHulls:
        """The hulls of the bodies, without directions; empty where all bodies are points."""
        if not self.has_hulls:
            return ()
        return Hulls(self.hull, np.empty((4, 2, 0)), self.corners, self.first, self.unordered)

    def hulls_of(self, rows: Indices) -> MaybeHulls:
        """The hulls of bodies by number (n,), without directions; empty where all bodies are points."""
        hulls = self.hulls
        return hulls._replace(hull=self.hull[rows]) if isinstance(hulls, Hulls) else ()


def joined(
    obstacles: Sequence[Obstacle],
    indices: list[int],
    shapes: list[MinkowskiSum],
    tables: list[Pieces],
    cuts: list[slice],
    start: float,
) -> Bodies:
    """The pieces `cuts` of the tables of obstacles `indices`, times from `start` on."""
    sizes = np.array([len(shape.radius) for shape in shapes])
    owner, count = np.repeat(np.array(indices), sizes), int(sizes.sum())
    lengths = [cut.stop - cut.start for cut in cuts]
    turning = any(obstacles[index].turns for index in indices)
    pieces = Pieces(
        np.concatenate([t.times[c] for t, c in zip(tables, cuts)]) - start,
        np.concatenate([t.points[c] for t, c in zip(tables, cuts)]),
        np.concatenate([t.radius[c] for t, c in zip(tables, cuts)]),
        np.concatenate([t.growth[c] for t, c in zip(tables, cuts)]),
        np.concatenate([t.turns[c] for t, c in zip(tables, cuts)]) if turning else NO_TURNS,
        np.concatenate([t.body[c] for t, c in zip(tables, cuts)]) + np.repeat(np.cumsum(sizes) - sizes, lengths),
    )
    counts = np.concatenate([shape.counts for shape in shapes])
    plain = np.array([obstacles[index].uncertainty is None for index in indices])
    spread = np.concatenate([shape.hull_radius for shape in shapes])
    point = (counts == 1) & (spread == 0.0) & np.repeat(plain, sizes)
    heads = np.flatnonzero(np.diff(pieces.body, prepend=-1))
    hull = np.where(point, -1, np.arange(count))
    return Bodies(
        pieces,
        turning=turning,
        owner=owner,
        radius=np.concatenate([shape.radius for shape in shapes]),
        hull_radius=spread,
        hull=hull,
        corners=np.concatenate([shape.corners for shape in shapes]),
        first=np.concatenate([[0], np.cumsum(counts)]),
        unordered=np.concatenate([shape.unordered for shape in shapes]),
        uncertain=~np.repeat(plain, sizes),
        heads=heads[pieces.times[heads, 0] <= 0.0],
        has_hulls=bool(hull.max(initial=-1) >= 0),
    )


_TABLES: "WeakKeyDictionary[Obstacle, dict[tuple[Shape, int, float], Pieces]]" = WeakKeyDictionary()


def tabulated(obstacle: Obstacle, shape: MinkowskiSum, robot: Shape, start: float, horizon: float) -> Pieces:
    """The pieces of an obstacle over an interval of three horizons that holds the window, made once.

    Intervals begin at multiples of two horizons, whenever they are needed: decisions do not depend on earlier ones.
    """
    number_of_stretch = int(np.floor(start / (2.0 * horizon)))
    tables = _TABLES.setdefault(obstacle, {})
    key = (robot, number_of_stretch, horizon)
    if key not in tables:
        if len(tables) >= 8:
            tables.clear()
        first, last = obstacle.trajectory.span
        begin = 2.0 * horizon * number_of_stretch
        end = max(begin + 3.0 * horizon, start + horizon)
        tables[key] = rows_of(obstacle, shape, begin, max(begin, first), min(end, last))
    return tables[key]


def overlapping(pieces: Pieces, begin: float, end: float) -> tuple[Pieces, slice]:
    """The pieces that overlap begin to end, as a part of a table; they may begin earlier and end later."""
    times = pieces.times
    if pieces.body[-1] > 0:
        keep = (times[:, 1] > begin) & (times[:, 0] < end)
        pieces = Pieces._make(column[keep] for column in pieces)
        return pieces, slice(0, len(pieces.body))
    return pieces, slice(
        int(times[:, 1].searchsorted(begin, side="right")), int(times[:, 0].searchsorted(end, side="left"))
    )


def rows_of(obstacle: Obstacle, shape: MinkowskiSum, decided: float, begin: float, end: float) -> Pieces:
    """The pieces of an obstacle's bodies from begin to end, all absolute [s], foreseen at `decided`.

    Body after body, each in the order of time.
    """
    path = obstacle.trajectory.path(begin, end)
    turns: Array | None = None
    radius, growth = path.error, np.zeros(len(path.error))
    if obstacle.uncertainty is not None:
        path = path.cut(np.union1d(path.times, np.linspace(begin, end, UNCERTAINTY_PIECES + 1)))
        widths = obstacle.uncertainty.radius(path.times - decided, obstacle.dimension)
        radius, growth = path.error + widths[:-1], np.diff(widths)
    if obstacle.turns:
        largest = max(float(shape.hull_radius.max()), 1e-3)
        course = obstacle.directions(begin, end, INTERPOLATION / largest)
        times = np.union1d(path.times, course.times)
        k = np.clip(np.searchsorted(path.times, times[:-1], side="right") - 1, 0, len(growth) - 1)
        width = np.diff(path.times)[k]
        radius = radius[k] + growth[k] * (times[:-1] - path.times[k]) / width
        growth = growth[k] * np.diff(times) / width
        path, course = path.cut(times), course.cut(times)
        turns, radius = course.points, radius + course.error * largest
    b, n = len(shape.radius), len(path.points)
    times = np.empty((n, 2))
    times[:, 0], times[:, 1] = path.times[:-1], path.times[1:]
    if b == 1 and turns is None:
        # The usual case, for many obstacles at every decision.
        return Pieces(times, path.points + shape.offsets, radius, growth, _ahead(n), np.zeros(n, np.int64))
    if b == 1:
        points = path.points + shape.offsets
    else:
        points = (path.points[None] + shape.offsets[:, None, None]).reshape(b * n, 4, -1)
        times, radius, growth = np.tile(times, (b, 1)), np.tile(radius, b), np.tile(growth, b)
        turns = None if turns is None else np.tile(turns, (b, 1, 1))
    turns = _ahead(b * n) if turns is None else turns
    return Pieces(times, points, radius, growth, turns, np.repeat(np.arange(b), n))


@lru_cache(maxsize=256)
def _ahead(n: int) -> Array:
    """Directions (n, 4, 2) of what does not turn."""
    return np.broadcast_to(_AHEAD, (n, 4, 2))


_AHEAD = np.array([1.0, 0.0])
NO_TURNS = np.empty((0, 4, 2))


def no_bodies(d: int) -> Bodies:
    """No bodies, in dimension d."""
    none, no = np.empty(0), np.empty(0, np.int64)
    pieces = Pieces(np.empty((0, 2)), np.empty((0, 4, d)), none, none, np.empty((0, 4, 2)), no)
    first = np.zeros(1, np.int64)
    return Bodies(
        *(pieces, False, no, none, none, no, np.empty((0, 5)), first, np.empty(0, np.bool_), np.empty(0, np.bool_)),
        *(no, False),
    )
