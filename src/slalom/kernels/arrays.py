"""Types of the arrays that kernels take. Importing them does not import numba.

A group of arrays that belong together is a NamedTuple: kernels take it as one argument.
"""

from collections.abc import Hashable, Sequence
from functools import cache
from typing import (
    Annotated,
    Any,
    Final,
    NamedTuple,
    Protocol,
    TypeAlias,
    TypeVar,
    cast,
    get_args,
    get_type_hints,
    overload,
)

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.int64]
Flags: TypeAlias = npt.NDArray[np.bool_]
Plane: TypeAlias = tuple[bool, float, float, float, float]
Direction: TypeAlias = tuple[float, float, float, float]


class Corners(NamedTuple):
    """The corners of all hulls of a table: those of hull h are the rows first[h] to first[h + 1]."""

    corners: Array  # (c, 5) [m]: x, y, z do not turn; X, Y turn with the body
    first: Indices  # (h + 1,)
    unordered: Flags  # (h,) whether the corners lie in no order, some inside the hull


class Hulls(NamedTuple):
    """The hulls of the rows of a table, see `slalom.choice.envelope.RelativeMotion`."""

    hull: Indices  # (n,) number of the hull, -1 for a point
    turns: Array  # (4, 2, n) control points of the body's direction; (4, 2, 0) where none is needed
    corners: Array  # as in `Corners`
    first: Indices
    unordered: Flags


MaybeHulls: TypeAlias = Hulls | tuple[()]
"""Empty where all bodies are points. numba drops branches that depend on the length of an argument only. Kernels are
then compiled without the parts for hulls. It must be an argument itself: numba has no constant length for a field."""
MaybeCorners: TypeAlias = Corners | tuple[()]
"""The same without numbers and directions."""


class Pieces(NamedTuple):
    """Cubic pieces of bodies: one row for each piece, the pieces of a body in the order of time."""

    times: Array  # (n, 2) [s] begin and end
    points: Array  # (n, 4, d) [m] control points of the body's origin
    radius: Array  # (n,) [m] at the begin of the piece
    growth: Array  # (n,) [m] change of the radius over the piece
    turns: Array  # (n, 4, 2) control points of the body's direction, or (0, 4, 2) if no body turns
    body: Indices  # (n,) number of the body


class PositionMap(NamedTuple):
    """The position of a robot as an affine map of its control, drift + gain u, in cubic pieces over elapsed time."""

    knots: Array  # (m + 1,) [s] from 0 to the horizon or later
    drift: Array  # (m, 4, d) [m] control points
    gain: Array  # (m, 4) control points [unit of position over unit of the control]
    cross: Array  # (m, 4) those of the cross gain, see `geometry.cubic`; (0, 4) if there is none
    straight: int  # first piece from which on the position moves along one line, for any control; m if there is none


class Segments(NamedTuple):
    """Segments of the motion of bodies relative to a robot, see `slalom.choice.envelope.RelativeMotion`.

    Segments lie along the last axis, so that one pass over all of them runs on vector registers. Their hulls are an
    argument of their own, see `MaybeHulls`.
    """

    points: Array  # (4, 3, n) [m]
    gains: Array  # (4, n)
    cross: Array  # (4, n) cross gains, see `geometry.cubic`; (4, 0) if there are none
    radius: Array  # (n,) [m] at the begin
    growth: Array  # (n,) [m] change of the radius over the segment
    bounding_radius: Array  # (n,) [m] of the rounded body about its origin, over the whole segment


class CutPieces(NamedTuple):
    """Pieces of bodies relative to a robot, cut where its position map has a knot: the rows of `Segments` to be."""

    begin: Array  # (n,) [s]
    end: Array  # (n,) [s]
    points: Array  # (4, 3, n) [m]
    gains: Array  # (4, n)
    cross: Array  # (4, n) or (4, 0), as of `Segments`
    radius: Array  # (n,) [m] at the begin
    growth: Array  # (n,) [m]
    turns: Array  # (4, 2, n), or (4, 2, 0) if no body turns
    body: Indices  # (n,)


class Workspace(NamedTuple):
    """Buffers of the search for collisions on one table, made once and used for every control."""

    gaps: Array  # (n,) [m] results of the chord test
    separating: Array  # (n, 7) directions, see `geometry.hulls.put_separating`
    stack: Array  # nodes of a bisection, see `geometry.cubic.new_stack`
    path: Array  # (4, 5) control points of one hull's origin and direction
    corners: Array  # (c, 3) [m] corners of one hull
    element: Array  # (5,) place on a segment in [0, 1], centre and radius of a ball of controls
    spans: Indices  # (1,) number of spans bisected so far


class TrackSamples(NamedTuple):
    """Positions of tracks at equal spacings."""

    positions: Array  # (n, k, d) [m] nan where a track does not exist
    first: Indices  # (n,) the first column of each track
    last: Indices  # (n,) its last column; before the first where there is none
    longest: Array  # (n,) [m] the longest way of each in one spacing


# Records: rows of an array whose fields are numbers and small arrays, such as all that is known of one robot.
#
# A kernel takes an array of records as one argument, and one record as a pointer. With one array for each field a
# decision had 84 arrays, and a call of a kernel with all tables passed up to 900 numbers.
#
# The length of an array in a record is a part of its type. `robot.position[:]` is of the type of any other array, for
# which the callee is compiled once.


R = TypeVar("R")

Vector: TypeAlias = Annotated[Array, (3,)]
ControlPoints: TypeAlias = Annotated[Array, (4,)]

NUMBERS: Final[dict[Any, type[np.generic]]] = {float: np.float64, int: np.int64, bool: np.bool_}


class Records(Protocol[R]):
    """Records (n,): in kernels one of them by its number; elsewhere some of them, or a field of all by its name."""

    @overload
    def __getitem__(self, row: int) -> R: ...

    @overload
    def __getitem__(self, row: str) -> Any: ...

    @overload
    def __getitem__(self, row: slice | Indices | Flags) -> "Records[R]": ...

    def __setitem__(self, row: Any, value: Any) -> None: ...

    def __len__(self) -> int: ...

    def copy(self) -> "Records[R]":
        """The same records in an array of their own."""


@cache
def record_type(fields: Hashable) -> np.dtype[Any]:
    """The type of records with the annotated fields of a class: numbers, flags, and arrays annotated by their shape.

    Always the same object: numba knows the types of arguments by it.
    """
    listed: list[Any] = []
    for name, kind in get_type_hints(fields, include_extras=True).items():
        listed.append((name, NUMBERS[kind]) if kind in NUMBERS else (name, np.float64, get_args(kind)[1]))
    return np.dtype((np.record, np.dtype(listed, align=True)))


def joined_records(parts: Sequence[Records[R]]) -> Records[R]:
    """The records of all parts, one part after the other."""
    return cast(Records[R], np.concatenate(cast(Sequence[Any], parts)))


def zero_records(fields: type[R], n: int) -> Records[R]:
    """Records (n,) with the annotated fields of a class, all 0."""
    return cast(Records[R], np.zeros(n, record_type(cast(Hashable, fields))))


# Bodies: convex parts of obstacles, grown by parts of a robot, over time.


EVERY_WORLD = -1
"""The world of a body that is in all of them."""


class Body:
    """A part of an obstacle, grown by a part of a robot."""

    offset: Vector  # [m] of its origin from the position of the obstacle
    radius: float  # [m] without uncertainty
    hull_radius: float  # [m] of the ball about the origin that holds the hull
    owner: int  # number of the obstacle
    world: int  # in which the body is; EVERY_WORLD for all
    uncertain: bool  # whether the radius of its pieces holds an uncertainty of its position
    at_rest: bool  # whether a contact counts while the robot is at rest


class Bodies(NamedTuple):
    """All bodies of all obstacles, and their pieces: what relative motion is made of.

    Pieces are cut to a window of time that begins at 0, or may begin before the window and end after it, see
    `ObstacleWindow.uncut_bodies`.
    """

    pieces: Pieces  # radius [m] to add to that of the body: errors and uncertainty
    balls: Array  # (n, 4) [m] centre and radius of a ball that holds the origin of the body, and its radius, on a piece
    first_piece: Indices  # (b + 1,) body k has the pieces first_piece[k] to first_piece[k + 1]
    each: Records[Body]  # (b,)
    hull: Indices  # (b,) number of its hull, -1 for a point
    corners: MaybeCorners
    body_balls: Array  # (b, 4) [m] centre and radius of a ball that holds the body on all its pieces; inf: not known
    now: float  # [s] the begin of the window on the clock of the pieces
    until: Array  # (o,) [s] after now, up to which each obstacle counts
    reach: float  # [m] bodies near paths that lead farther away from the robot may be left out

    @property
    def heads(self) -> Indices:
        """The pieces (h,) with which bodies begin that exist when the window begins, to which pieces are cut."""
        some = self.first_piece[:-1][self.first_piece[:-1] < self.first_piece[1:]]
        return np.asarray(some[self.pieces.times[some, 0] <= 0.0])

    @property
    def turning(self) -> bool:
        """Whether any body turns; if not, the pieces have no directions."""
        return len(self.pieces.turns) > 0

    @property
    def owner(self) -> Indices:
        """The obstacle of each body (b,)."""
        return np.ascontiguousarray(self.each["owner"])

    @property
    def radius(self) -> Array:
        """The radius (b,) [m] of each body, without uncertainty."""
        return np.ascontiguousarray(self.each["radius"])

    @property
    def hull_radius(self) -> Array:
        """The radius (b,) [m] of the ball about the origin of each body that holds its hull."""
        return np.ascontiguousarray(self.each["hull_radius"])

    @property
    def at_rest(self) -> Flags:
        """Whether a contact with each body counts while the robot is at rest (b,)."""
        return np.ascontiguousarray(self.each["at_rest"])

    @property
    def hulls(self) -> MaybeHulls:
        """The hulls of the bodies, without directions; empty where all bodies are points."""
        return self.hulls_of(slice(None))

    def displaced(self, offsets: Array) -> "Bodies":
        """The same bodies, each displaced by its offset (b, 3) [m] at all times."""
        moved = np.append(offsets, np.zeros((len(offsets), 1)), axis=1)
        each, d = offsets[self.pieces.body], self.pieces.points.shape[2]
        return self._replace(
            pieces=self.pieces._replace(points=self.pieces.points + each[:, None, :d]),
            balls=self.balls + moved[self.pieces.body],
            body_balls=self.body_balls + moved,
        )

    def hulls_of(self, rows: Indices | slice) -> MaybeHulls:
        """The hulls of bodies by number (n,), without directions; empty where all bodies are points."""
        return Hulls(self.hull[rows], np.empty((4, 2, 0)), *self.corners) if self.corners else ()


def joined_corners(parts: Sequence[MaybeCorners]) -> MaybeCorners:
    """The corners of several parts, the hulls of each part numbered after those of the parts before it."""
    some = [part for part in parts if part]
    if len(some) < 2:
        return some[0] if some else ()
    first, before = [some[0].first], len(some[0].corners)
    for part in some[1:]:
        first.append(part.first[1:] + before)
        before += len(part.corners)
    corners, _, unordered = zip(*some)
    return Corners(np.concatenate(corners), np.concatenate(first), np.concatenate(unordered))


# Tables for many choices in one call.


class States(NamedTuple):
    """Robots in n states, all with the same gain of the response."""

    limits: Array  # (n, l, 5) admissible sets, see `geometry.boundaries`
    counts: Indices  # (n,) how many rows of the limits are those of each state
    position: Array  # (n, d) [m]
    knots: Array  # (m + 1,) [s], as in `PositionMap`
    drift: Array  # (n, m, 4, d) [m]
    gain: Array  # (m, 4)
    cross: Array  # (m, 4) or (0, 4)


class Scene(NamedTuple):
    """Obstacles, the same for all states."""

    bodies: Bodies
    heads: Indices  # see `Bodies.heads`
    radius: Array  # (b,) [m] with the margin
    error: float  # [m] of the response's cubic pieces
    horizon: float  # [s]
