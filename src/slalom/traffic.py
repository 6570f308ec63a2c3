"""Obstacles over a window of time: made once, used by every control obstacle of a decision."""

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.checks import Array, number, positive
from slalom.errors import InvalidInput
from slalom.grown import Grown, grown
from slalom.obstacle import Obstacle
from slalom.shape import Shape
from slalom.tolerances import INTERPOLATION
from slalom.trajectory import Circular, Composite, Function, PiecewisePolynomial, Sampled

if TYPE_CHECKING:
    from slalom.kernels.compiled import MaybeHulls

Indices = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

WIDENINGS = 8
"""Straight lines that stand for a growing radius over one window."""


class Pieces(NamedTuple):
    """Rows for pieces of bodies."""

    times: Array  # (n, 2) elapsed [s]
    points: Array  # (n, 4, d)
    radius: Array  # (n,) [m] to add to that of the body: errors and uncertainty
    growth: Array  # (n,) [m] how much that changes over the piece
    turns: Array  # (n, 4, 2); in `Bodies` none if nothing turns
    body: Indices  # (n,)


class Bodies(NamedTuple):
    """All pieces of all bodies, and the bodies: what relative motion is made of, see `segments.Segments`."""

    pieces: Pieces
    turning: bool
    owner: Indices  # (b,) the obstacle
    around: Array  # (b,) [m] the body's own radius
    spread: Array  # (b,) [m]
    hull: Indices  # (b,) its own number, or -1 for a point
    corners: Array  # (c, 5)
    first: Indices  # (b + 1,)
    mixed: Flags  # (b,)
    unsure: Flags  # (b,) whether its obstacle has an uncertainty
    heads: Indices  # rows with which bodies begin that are there when the window begins


class Traffic:
    """Obstacles over a window of time as cubic pieces.

    Args:
        obstacles: all of one dimension; those that do not exist within the window leave no piece.
        start: absolute time [s] of the decision. horizon: length of the window [s] > 0.
        horizons: (n,) [s] one for each obstacle, above 0 and at most `horizon`; beyond it that obstacle counts no more.

    Raises:
        InvalidInput: different dimensions, a horizon that is not above 0.
    """

    def __init__(
        self, obstacles: Sequence[Obstacle], start: float, horizon: float, horizons: npt.ArrayLike | None = None
    ) -> None:
        self.obstacles = tuple(obstacles)
        self.start = number(start, "start")
        self.horizon = positive(horizon, "horizon")
        dimensions = {obstacle.dimension for obstacle in self.obstacles}
        if len(dimensions) > 1:
            raise InvalidInput(f"obstacles: expected one dimension, found {sorted(dimensions)}")
        self.dimension = dimensions.pop() if dimensions else None
        self._until = None if horizons is None else self._each(horizons)
        self._bodies: dict[Shape, Bodies] = {}
        self._distances: tuple[tuple[Shape, bytes], Array, Array] | None = None

    def _each(self, horizons: npt.ArrayLike) -> list[float]:
        each = [positive(one, f"horizons[{k}]") for k, one in enumerate(np.atleast_1d(np.asarray(horizons)))]
        if len(each) != len(self.obstacles) or max(each, default=0.0) > self.horizon:
            raise InvalidInput(
                f"horizons: expected {len(self.obstacles)} of at most {self.horizon:g} s, found {len(each)} up to "
                f"{max(each, default=0.0):g} s"
            )
        return each

    def bodies(self, robot: Shape) -> Bodies:
        """The pieces of all obstacles grown by a robot's shape."""
        if robot not in self._bodies:
            self._bodies[robot] = self._grow(robot)
        return self._bodies[robot]

    def distances(self, robot: Shape, position: Array) -> tuple[Array, Array]:
        """How far each body is now, its radius not taken off, from a robot at `position` (d,): (b,) [m], and where to.

        Less what it may be off now; inf for a body that is not there. Inside a body the distance is minus the depth. A
        robot leaves it, or goes away from it, soonest against the unit vectors (b, d).
        """
        key = (robot, position.tobytes())
        if self._distances is None or self._distances[0] != key:
            self._distances = (key, *self._measure(robot, position))
        return self._distances[1:]

    def _measure(self, robot: Shape, position: Array) -> tuple[Array, Array]:
        bodies = self.bodies(robot)
        rows = bodies.pieces
        hulls: MaybeHulls = ()
        if bodies.hull.max(initial=-1) >= 0:
            hulls = (bodies.hull, np.empty((4, 2, 0)), bodies.corners, bodies.first, bodies.mixed)
        found = kernels.distances_now(
            rows.times, rows.points, rows.turns if bodies.turning else _NO_TURNS, rows.radius, rows.growth, rows.body,
            bodies.heads, bodies.unsure, bodies.hull, hulls, position,
        )  # fmt: skip
        return found[:, 0], found[:, 1 : 1 + position.size]

    def _grow(self, robot: Shape) -> Bodies:
        bodies = self._known(robot)
        return self._anew(robot) if bodies is None else bodies

    def _known(self, robot: Shape) -> Bodies | None:
        """The pieces out of one table of all obstacles, which serves many decisions; None where there is none.

        Not if one of them is not tabulated, counts for less than the whole window, or is not there in it.
        """
        if self._until is not None or not self.obstacles:
            return None
        stretch = int(np.floor(self.start / (2.0 * self.horizon)))
        key = (self.obstacles, robot, stretch, self.horizon)
        if key not in _JOINED:
            if len(_JOINED) >= 8:
                _JOINED.clear()
            _JOINED[key] = self._joined(robot)
        bodies = _JOINED[key]
        if bodies is None:
            return None
        first, last, all_pieces = bodies
        start, end = self.start, self.start + self.horizon
        if not (first < end and last > start):
            return None
        rows = all_pieces.pieces
        keep = np.flatnonzero((rows.times[:, 1] > start) & (rows.times[:, 0] < end))
        times, body = rows.times[keep] - start, rows.body[keep]
        heads = np.flatnonzero(np.concatenate([_FIRST, body[1:] != body[:-1]])[: len(body)])
        pieces = Pieces(
            times,
            rows.points[keep],
            rows.radius[keep],
            rows.growth[keep],
            rows.turns[keep] if all_pieces.turning else _NO_TURNS,
            body,
        )
        return all_pieces._replace(pieces=pieces, heads=heads[times[heads, 0] <= 0.0])

    def _joined(self, robot: Shape) -> tuple[float, float, Bodies] | None:
        """When the last obstacle appears and the first one vanishes, and the pieces of all over a stretch of time."""
        if any(not isinstance(o.trajectory, TABULATED) or o.uncertainty is not None for o in self.obstacles):
            return None
        spans = [obstacle.trajectory.span for obstacle in self.obstacles]
        first, last = max(span[0] for span in spans), min(span[1] for span in spans)
        if not (first < self.start + self.horizon and last > self.start):
            return None
        shapes = [grown(obstacle, robot) for obstacle in self.obstacles]
        tables = [
            _tabulated(obstacle, shape, robot, self.start, self.horizon)
            for obstacle, shape in zip(self.obstacles, shapes)
        ]
        cuts = [slice(0, len(table.body)) for table in tables]
        return first, last, _together(self.obstacles, list(range(len(shapes))), shapes, tables, cuts, 0.0)

    def _anew(self, robot: Shape) -> Bodies:
        tables, shapes, cuts, indices = [], [], [], []
        for index, obstacle in enumerate(self.obstacles):
            first, last = obstacle.trajectory.span
            until = self.horizon if self._until is None else self._until[index]
            begin, end = max(self.start, first), min(self.start + until, last)
            if begin >= end:
                continue
            shape = grown(obstacle, robot)
            many = isinstance(obstacle.trajectory, TABULATED) and obstacle.uncertainty is None
            if many and until == self.horizon:
                table = _tabulated(obstacle, shape, robot, self.start, self.horizon)
                table, cut = _overlapping(table, begin, end)
            else:
                table = _rows(obstacle, shape, self.start, begin, end)
                cut = slice(0, len(table.body))
            tables.append(table)
            cuts.append(cut)
            shapes.append(shape)
            indices.append(index)
        if not tables:
            return _nothing(self.dimension or 2)
        return _together(self.obstacles, indices, shapes, tables, cuts, self.start)


def _together(
    obstacles: Sequence[Obstacle],
    indices: list[int],
    shapes: list[Grown],
    tables: list[Pieces],
    cuts: list[slice],
    start: float,
) -> Bodies:
    """The pieces `cuts` of the tables of obstacles `indices`, times from `start` on."""
    sizes = np.array([len(shape.around) for shape in shapes])
    owner, count = np.repeat(np.array(indices), sizes), int(sizes.sum())
    lengths = [cut.stop - cut.start for cut in cuts]
    turning = any(obstacles[index].turns for index in indices)
    pieces = Pieces(
        np.concatenate([t.times[c] for t, c in zip(tables, cuts)]) - start,
        np.concatenate([t.points[c] for t, c in zip(tables, cuts)]),
        np.concatenate([t.radius[c] for t, c in zip(tables, cuts)]),
        np.concatenate([t.growth[c] for t, c in zip(tables, cuts)]),
        np.concatenate([t.turns[c] for t, c in zip(tables, cuts)]) if turning else _NO_TURNS,
        np.concatenate([t.body[c] for t, c in zip(tables, cuts)]) + np.repeat(np.cumsum(sizes) - sizes, lengths),
    )
    counts = np.concatenate([shape.counts for shape in shapes])
    plain = np.array([obstacles[index].uncertainty is None for index in indices])
    spread = np.concatenate([shape.spread for shape in shapes])
    point = (counts == 1) & (spread == 0.0) & np.repeat(plain, sizes)
    heads = np.flatnonzero(np.diff(pieces.body, prepend=-1))
    return Bodies(
        pieces,
        turning=turning,
        owner=owner,
        around=np.concatenate([shape.around for shape in shapes]),
        spread=spread,
        hull=np.where(point, -1, np.arange(count)),
        corners=np.concatenate([shape.corners for shape in shapes]),
        first=np.concatenate([[0], np.cumsum(counts)]),
        mixed=np.concatenate([shape.mixed for shape in shapes]),
        unsure=~np.repeat(plain, sizes),
        heads=heads[pieces.times[heads, 0] <= 0.0],
    )


TABULATED = (Circular, Sampled, PiecewisePolynomial, Composite, Function)
"""Trajectories with many pieces, which are cut once for many decisions."""

_TABLES: "WeakKeyDictionary[Obstacle, dict[tuple[Shape, int, float], Pieces]]" = WeakKeyDictionary()


_JOINED: dict[tuple[tuple[Obstacle, ...], Shape, int, float], tuple[float, float, Bodies] | None] = {}
"""The tables of all obstacles of a scene together, of the last few: most decisions are about the same ones."""


def _tabulated(obstacle: Obstacle, shape: Grown, robot: Shape, start: float, horizon: float) -> Pieces:
    """The pieces of an obstacle over a stretch of three horizons that holds the window, cut once.

    Stretches begin at multiples of two horizons, whenever they are asked for: decisions do not depend on earlier ones.
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
        tables[key] = _rows(obstacle, shape, begin, max(begin, first), min(end, last))
    return tables[key]


def _overlapping(pieces: Pieces, begin: float, end: float) -> tuple[Pieces, slice]:
    """The pieces that overlap begin to end, as a part of a table; they may begin earlier and end later."""
    times = pieces.times
    if pieces.body[-1] > 0:
        keep = (times[:, 1] > begin) & (times[:, 0] < end)
        pieces = Pieces._make(column[keep] for column in pieces)
        return pieces, slice(0, len(pieces.body))
    return pieces, slice(
        int(times[:, 1].searchsorted(begin, side="right")), int(times[:, 0].searchsorted(end, side="left"))
    )


def _rows(obstacle: Obstacle, shape: Grown, decided: float, begin: float, end: float) -> Pieces:
    """The pieces of an obstacle's bodies from begin to end, all absolute [s], foreseen at `decided`.

    Body after body, each in the order of time.
    """
    path = obstacle.trajectory.path(begin, end)
    turns: Array | None = None
    radius, growth = path.error, np.zeros(len(path.error))
    if obstacle.uncertainty is not None:
        path = path.cut(np.union1d(path.times, np.linspace(begin, end, WIDENINGS + 1)))
        widths = obstacle.uncertainty.radius(path.times - decided, obstacle.dimension)
        radius, growth = path.error + widths[:-1], np.diff(widths)
    if obstacle.turns:
        largest = max(float(shape.spread.max()), 1e-3)
        course = obstacle.directions(begin, end, INTERPOLATION / largest)
        times = np.union1d(path.times, course.times)
        k = np.clip(np.searchsorted(path.times, times[:-1], side="right") - 1, 0, len(growth) - 1)
        width = np.diff(path.times)[k]
        radius = radius[k] + growth[k] * (times[:-1] - path.times[k]) / width
        growth = growth[k] * np.diff(times) / width
        path, course = path.cut(times), course.cut(times)
        turns, radius = course.points, radius + course.error * largest
    b, n = len(shape.around), len(path.points)
    times = np.empty((n, 2))
    times[:, 0], times[:, 1] = path.times[:-1], path.times[1:]
    if b == 1 and turns is None:
        # The usual case, made for many obstacles at every decision.
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
_NO_TURNS = np.empty((0, 4, 2))
_FIRST = np.ones(1, np.bool_)


def _nothing(d: int) -> Bodies:
    none, no = np.empty(0), np.empty(0, np.int64)
    pieces = Pieces(np.empty((0, 2)), np.empty((0, 4, d)), none, none, np.empty((0, 4, 2)), no)
    first = np.zeros(1, np.int64)
    return Bodies(
        pieces, False, no, none, none, no, np.empty((0, 5)), first, np.empty(0, np.bool_), np.empty(0, np.bool_), no
    )
