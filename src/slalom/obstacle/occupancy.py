"""Obstacles of occupancy grids: rectangles whose union is that of the occupied cells."""

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import Array, array, array_of, flag, number, positive, whole
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import OCCUPIED
from slalom.kernels.arrays import EVERY_WORLD, Bodies, Flags, Indices, Pieces, zero_records
from slalom.kernels.decision.tables import AtHorizon, ObstacleAtHorizon
from slalom.model.shape import Rectangle, Shape
from slalom.model.trajectory import Stationary
from slalom.obstacle.obstacle import Obstacle
from slalom.obstacle.pieces import NO_TURNS, bodies_of, rotation, sum_of_shapes, sums_together
from slalom.obstacle.table import ObstacleTable, Outlines, fills_ball


class Runs(NamedTuple):
    """Occupied cells as runs along rows, row by row."""

    row: Indices  # (n,)
    first: Indices  # (n,) column of the first cell
    end: Indices  # (n,) column after the last cell


def occupancy(
    grid: npt.ArrayLike,
    resolution: float,
    origin: npt.ArrayLike = (0.0, 0.0, 0.0),
    *,
    occupied: float = OCCUPIED,
    unknown: bool = False,
) -> "OccupancyTable":
    """The obstacles of an occupancy grid, for decisions: rectangles that cover exactly the occupied cells.

    Args:
        grid: (height, width) whole numbers from -1 to 100 [%], where -1 is unknown, or booleans, where True is
            occupied. Rows go along y, columns along x, as in nav_msgs/OccupancyGrid.
        resolution: [m] side of a cell.
        origin: (x, y, heading) [m, m, rad] of the corner of cell (0, 0), or (x, y).
        occupied: [%] least value of an occupied cell. unknown: whether unknown cells are occupied.

    Raises:
        InvalidInput: a grid of another shape, or with other values; a resolution that is not above 0; a threshold
            outside of 0 to 100.
    """
    side = positive(resolution, "resolution")
    place = array(origin, "origin")
    if place.shape not in ((2,), (3,)):
        raise InvalidInput(f"origin: expected (x, y) or (x, y, heading), found shape {place.shape}")
    threshold = number(occupied, "occupied")
    if not 0.0 <= threshold <= 100.0:
        raise InvalidInput(f"occupied: expected a number from 0 to 100 %, found {threshold:g}")
    counts = flag(unknown, "unknown")
    cells = _occupied(grid, threshold, counts, "grid")
    heading = float(place[2]) if len(place) == 3 else 0.0
    frame = Frame(cells.shape, side, (float(place[0]), float(place[1]), heading), threshold, counts)
    return OccupancyTable(frame, _runs(cells))


class Frame(NamedTuple):
    """What a grid is read by."""

    shape: tuple[int, ...]  # rows and columns
    resolution: float  # [m]
    origin: tuple[float, float, float]  # [m, m, rad]
    occupied: float  # [%]
    unknown: bool


class OccupancyTable(ObstacleTable):
    """Obstacles at rest of an occupancy grid, made by `occupancy` or `read_map`.

    Each obstacle is a rectangle of cells: a run along a row, joined with runs of the same columns in the rows after it.
    Two rectangles have no cell in common. Law: the table depends on the present cells only, not on earlier updates.

    Attributes:
        shape: (height, width) [cell]. resolution: [m]. origin: (x, y, heading) [m, m, rad].
        frame, runs: what it is made of.
        rectangles: (n, 4) [cell], columns and rows of the first cell and of the one after the last: x0, y0, x1, y1.
    """

    def __init__(self, frame: Frame, runs: Runs) -> None:
        self.frame, self.runs = frame, runs
        self.shape, self.resolution = frame.shape, frame.resolution
        self.origin = frame.origin
        self.rectangles = _joined(runs)
        sizes = self.rectangles[:, 2:] - self.rectangles[:, :2]
        self._sizes, self._kind = np.unique(sizes, axis=0, return_inverse=True)
        self._kind = self._kind.reshape(-1)
        self._turn = rotation(self.origin[2])
        middles = 0.5 * self.resolution * (self.rectangles[:, :2] + self.rectangles[:, 2:])
        self._centers = np.array(self.origin[:2]) + middles @ self._turn.T
        self.dimension = 2 if len(self.rectangles) else None
        self._spans = np.tile((-np.inf, np.inf), (len(self.rectangles), 1))
        self._known_until, self._at_rest = np.inf, True
        self._uncertain = self.is_passive = self.has_futures = False
        self._bodies, self._parts = {}, {}

    def __len__(self) -> int:
        return len(self.rectangles)

    def __repr__(self) -> str:
        height, width = self.shape
        return f"<OccupancyTable of {width} x {height} cells, obstacles: {len(self)}>"

    @property
    def cells(self) -> Flags:
        """Whether each cell is occupied: (height, width)."""
        found = np.zeros(self.shape, np.bool_)
        for x0, y0, x1, y1 in self.rectangles.tolist():
            found[y0:y1, x0:x1] = True
        return found

    def updated(self, part: npt.ArrayLike, row: int = 0, column: int = 0) -> "OccupancyTable":
        """The table of the same grid with other values in a part, which is read as the grid was.

        Only the rows of the part are searched for occupied cells again.

        Args:
            part: (h, w) values as those of the grid. row: of its first cell. column: of its first cell.

        Raises:
            InvalidInput: a part of another form, with other values, or outside of the grid.
        """
        changed = _occupied(part, self.frame.occupied, self.frame.unknown, "part")
        y, x = whole(row, "row"), whole(column, "column")
        (height, width), (h, w) = self.shape, changed.shape
        if y < 0 or x < 0 or y + h > height or x + w > width:
            raise InvalidInput(
                f"part: expected cells within {width} x {height}, "
                f"found columns {x} to {x + w - 1} and rows {y} to {y + h - 1}"
            )
        runs = self.runs
        begin, end = np.searchsorted(runs.row, (y, y + h))
        rows = np.zeros((h, width), np.int8)
        # Each run adds one from its first cell on and takes it away after the last.
        there = runs.row[begin:end] - y
        ends = np.zeros((h, width + 1), np.int8)
        ends[there, runs.first[begin:end]] = 1
        ends[there, runs.end[begin:end]] -= 1
        np.cumsum(ends[:, :-1], axis=1, out=rows)
        rows[:, x : x + w] = changed
        new = _runs(rows.astype(np.bool_))
        new = new._replace(row=new.row + y)
        joined = (np.concatenate([old[:begin], one, old[end:]]) for old, one in zip(runs, new))
        return OccupancyTable(self.frame, Runs(*joined))

    def at(self, origin: npt.ArrayLike) -> "OccupancyTable":
        """The same cells with another origin (x, y, heading) [m, m, rad]."""
        x, y, heading = array_of(origin, "origin", (3,)).tolist()
        return OccupancyTable(self.frame._replace(origin=(x, y, heading)), self.runs)

    @cached_property
    def given(self) -> tuple[Obstacle, ...]:  # type: ignore[override]  # made when asked for
        """The rectangles one by one."""
        heading = self.origin[2]
        return tuple(
            Obstacle(self._shapes[kind], Stationary(center), f"map {k}", heading)
            for k, (kind, center) in enumerate(zip(self._kind.tolist(), self._centers))
        )

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:  # type: ignore[override]  # made when asked for
        """The rectangles one by one."""
        return self.given

    @cached_property
    def _shapes(self) -> tuple[Rectangle, ...]:
        """The rectangles that differ."""
        return tuple(Rectangle(self.resolution * w, self.resolution * h) for w, h in self._sizes.tolist())

    def split(self, *, at_rest: bool) -> tuple[ObstacleTable, tuple[Obstacle, ...]]:
        """The table itself and no other obstacles, see `ObstacleTable.split`."""
        return self, ()

    @cached_property
    def outlines(self) -> Outlines:
        """The outlines of the rectangles, see `ObstacleTable.outlines`."""
        n = len(self)
        found = zero_records(ObstacleAtHorizon, n)
        found["position"][:, :2] = self._centers
        found["ball"] = np.array([shape.bounding_radius for shape in self._shapes])[self._kind]
        found["filled"] = np.array([fills_ball(shape) for shape in self._shapes], np.bool_)[self._kind]
        found["first"], found["last"] = 4 * np.arange(n), 4 * np.arange(n) + 4
        found["world"] = EVERY_WORLD
        around = self._corners @ self._turn.T
        away = around / np.linalg.norm(around, axis=2)[..., None]
        corners = np.concatenate([around + self._centers[:, None], away], axis=2).reshape(-1, 4)
        return Outlines(np.arange(n), np.zeros(n, np.bool_), AtHorizon(found, corners))

    @property
    def _corners(self) -> Array:
        """The corners (n, 4, 2) [m] of each rectangle about its center, in the frame of the grid, counter-clockwise."""
        kinds = np.array([shape.parts[0].corners for shape in self._shapes]).reshape(-1, 4, 2)
        return np.asarray(kinds[self._kind])

    def _made(self, robot: Shape, begin: float, end: float) -> Bodies:
        """All bodies from begin to end [s]: those of `ObstacleTable`, made of arrays."""
        kinds = [sum_of_shapes(shape, robot, self.origin[2]) for shape in self._shapes]
        n, b = len(self), len(robot.parts)
        shape = sums_together(kinds[kind] for kind in self._kind.tolist())
        points = np.repeat(self._centers, b, axis=0) + shape.offsets
        pieces = Pieces(
            np.tile(np.array([[begin, end]]), (n * b, 1)),
            np.repeat(points[:, None], 4, axis=1),
            np.zeros(n * b),
            np.zeros(n * b),
            NO_TURNS,
            np.arange(n * b),
        )
        bodies = bodies_of(pieces, shape, np.repeat(np.arange(n), b), np.zeros(n * b, np.bool_), n)
        balls = kernels.body_balls(bodies.balls, bodies.first_piece, bodies.radius + bodies.hull_radius)
        return bodies._replace(body_balls=balls)


def _occupied(grid: npt.ArrayLike, occupied: float, unknown: bool, name: str) -> Flags:
    """Whether each cell (height, width) of a grid is occupied. Raises InvalidInput for something else than a grid."""
    try:
        values: npt.NDArray[Any] = np.asarray(grid)
    except ValueError:
        raise InvalidInput(f"{name}: expected rows of one length, found different ones") from None
    if values.ndim != 2:
        raise InvalidInput(f"{name}: expected an array (height, width) of cells, found shape {values.shape}")
    if values.dtype == np.bool_:
        return np.asarray(values)
    if not np.issubdtype(values.dtype, np.integer):
        kind = f"an array of {values.dtype}"
        raise InvalidInput(f"{name}: expected whole numbers from -1 to 100, or booleans, found {kind}")
    if values.size and not (int(values.min()) >= -1 and int(values.max()) <= 100):
        y, x = np.argwhere((values < -1) | (values > 100))[0].tolist()
        raise InvalidInput(f"{name}[{y}, {x}]: expected a value from -1 to 100, found {values[y, x]}")
    known = (values >= occupied) & (values >= 0)
    return np.asarray(known | (values < 0) if unknown else known)


def _runs(cells: Flags) -> Runs:
    """The runs of occupied cells (height, width) along rows, row by row."""
    edges = np.zeros((cells.shape[0], cells.shape[1] + 1), np.bool_)
    edges[:, :-1] = cells
    edges[:, 1:] ^= cells
    row, column = np.nonzero(edges)
    return Runs(row[::2], column[::2], column[1::2])


def _joined(runs: Runs) -> Array:
    """Rectangles (n, 4) [cell] of runs: those of the same columns in rows one after the other are one."""
    order = np.lexsort((runs.row, runs.end, runs.first))
    row, first, end = (each[order] for each in runs)
    begins = np.ones(len(row), np.bool_)
    begins[1:] = (first[1:] != first[:-1]) | (end[1:] != end[:-1]) | (row[1:] != row[:-1] + 1)
    start = np.flatnonzero(begins)
    last = np.append(start[1:], len(row))[: len(start)] - 1
    return np.stack([first[start], row[start], end[start], row[last] + 1], axis=1)
