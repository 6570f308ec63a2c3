"""Cubic pieces of the bodies of obstacles over an interval of time, one obstacle at a time and joined."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple, cast

import numpy as np

from slalom import kernels
from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import INTERPOLATION
from slalom.kernels.arrays import Flags, Hulls, Indices, MaybeHulls, Pieces, Records, joined_records, zero_records
from slalom.kernels.decision.tables import EVERY_WORLD, PassiveBody
from slalom.model.path import Path
from slalom.model.shape import Part, Shape
from slalom.model.trajectory import PiecewisePolynomial, Trajectory
from slalom.model.trajectory.kinds import cubic_paths
from slalom.obstacle.obstacle import Obstacle

# ---------------------------------------------------------------------------------------------------------------------
# Minkowski sums of obstacle and robot shapes: convex bodies that the robot's position must avoid.


class MinkowskiSum(NamedTuple):
    """Obstacle shape grown by the robot shape, as b convex bodies: hulls of the differences of their corners."""

    offsets: Array  # (b, d) [m] the body's origin from the obstacle's position
    counts: Indices  # (b,) corners
    corners: Array  # (c, 5) [m] from the body's origin, see `RelativeMotion`
    radius: Array  # (b,) [m] rounding
    hull_radius: Array  # (b,) [m] the largest distance of a corner from the body's origin
    unordered: Flags  # (b,)


def minkowski_sum(obstacle: Obstacle, robot: Shape) -> MinkowskiSum:
    """Minkowski sum of an obstacle's shape and the reflection of a robot that never turns.

    The obstacle is in its constant heading if it has one, otherwise in its body frame.

    Raises:
        InvalidInput: in space, neither robot nor obstacle is round.
    """
    result: MinkowskiSum = _minkowski_sum(obstacle.shape, robot, obstacle.angle)  # type: ignore[arg-type]  # shapes are values
    return result


def sum_of_shapes(shape: Shape, robot: Shape) -> MinkowskiSum:
    """Minkowski sum of a shape and the reflection of a robot's, neither of which turns; raises as `minkowski_sum`."""
    result: MinkowskiSum = _minkowski_sum(shape, robot, 0.0)  # type: ignore[arg-type]  # shapes are values
    return result


@lru_cache(maxsize=4096)
def _minkowski_sum(shape: Shape, robot: Shape, angle: float | None) -> MinkowskiSum:
    d = shape.dimension
    offsets = []
    corners = []
    radii = []
    unordered = []
    for part in shape.parts:
        for other in robot.parts:
            both_polygonal = len(part.corners) > 1 and len(other.corners) > 1
            if both_polygonal and d == 3:
                raise InvalidInput(
                    "robot: expected a ball, or obstacles that are balls, in space; found parts with "
                    f"{len(other.corners)} and {len(part.corners)} corners"
                )
            if angle is None:
                offset, hull = _turning(part, other)
            else:
                offset, hull = _fixed(part, other, angle)
            offsets.append(offset)
            corners.append(hull)
            radii.append(part.radius + other.radius)
            # The order of the corners of the sum changes with the heading.
            unordered.append(both_polygonal and angle is None)
    return MinkowskiSum(
        np.array(offsets),
        np.array([len(c) for c in corners], dtype=np.int64),
        np.concatenate(corners),
        np.array(radii),
        np.array([float((_length(c[:, :3]) + _length(c[:, 3:])).max()) for c in corners]),
        np.array(unordered),
    )


def _length(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _turning(part: Part, other: Part) -> tuple[Array, Array]:
    """Origin (2,) and corners (n, 5) [m] of a body; the parts of the obstacle turn, those of the robot do not."""
    own, others = np.indices((len(part.corners), len(other.corners))).reshape(2, -1)
    corners = np.zeros((len(own), 5))
    corners[:, :2], corners[:, 3:] = -other.corners[others], part.corners[own]
    offset = np.zeros(2)
    if len(other.corners) == 1:
        offset, corners[:, :2] = -other.corners[0], 0.0
    return offset, corners


def _fixed(part: Part, other: Part, angle: float) -> tuple[Array, Array]:
    """Origin (d,) and corners (n, 5) [m] of a body for an obstacle in a constant heading `angle` [rad]."""
    own = part.corners if not angle else part.corners @ _rotation(angle).T
    d = own.shape[1]
    points = (own[:, None] - other.corners[None]).reshape(-1, d)
    if len(points) > 2:
        points = hull_corners(points)
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    corners = np.zeros((len(points), 5))
    corners[:, :d] = points - center
    return center, corners


def _rotation(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def hull_corners(points: Array) -> Array:
    """Corners (n, 2) of the convex hull of points (m, 2) in the plane, counter-clockwise; two if they are collinear."""
    import shapely

    hull = shapely.MultiPoint(points).convex_hull
    if hull.geom_type == "Polygon":
        return np.array(shapely.get_coordinates(shapely.orient_polygons(hull))[:-1])
    return np.array(shapely.get_coordinates(hull))


def outline_parts(obstacle: Obstacle, t: float) -> list[Part]:
    """Parts of an obstacle at absolute time t [s]: rounded hulls with corners (n, d) [m] in the world frame."""
    position = obstacle.trajectory.position(t)
    if obstacle.dimension == 3:
        return [Part(position + part.corners, part.radius) for part in obstacle.shape.parts]
    e = obstacle.direction(t) if obstacle.angle is None else np.array([np.cos(obstacle.angle), np.sin(obstacle.angle)])
    turn = np.array([[e[0], -e[1]], [e[1], e[0]]])
    return [Part(position + part.corners @ turn.T, part.radius) for part in obstacle.shape.parts]


# ---------------------------------------------------------------------------------------------------------------------
# Cubic pieces of the bodies of obstacles over an interval of time, one obstacle at a time and joined.


SMALLEST_EXTENT: Final = 1e-3
"""[m] Largest distance of a corner below which a body that turns counts as this large.

Larger: less exact directions of small bodies. Smaller: more pieces for bodies that are nearly points.
"""

UNCERTAINTY_PIECES: Final = 8
"""[1] Straight lines that stand for a growing radius over one window.

Larger: more pieces. Smaller: the radius is larger than needed in between.
"""


STRETCHED_PART: Final = Part(np.array([(0.0, 0.0), (-1.0, 0.0)]), 0.0)
"""A body from its predicted place to where it is if it brakes, whose displacement is the direction of the body."""


class Reach(NamedTuple):
    """The ball that a robot stays in within a window of time: bodies farther away from it may be left out."""

    position: Array  # (d,) [m] of the robot
    distance: float  # [m] that it moves at most
    clearance: float  # [m] from bodies that still count, with all errors of both


class Bodies(NamedTuple):
    """All pieces of all bodies, and the bodies: what relative motion is made of."""

    pieces: Pieces  # times elapsed [s]; radius [m] to add to that of the body: errors and uncertainty
    balls: Array  # (n, 4) [m] see `kernels.piece_balls`
    turning: bool  # whether any body turns; if not, the pieces have no directions
    each: Records[PassiveBody]  # (b,)
    hull: Indices  # (b,) number of its hull, or -1 for a point
    corners: Array  # (c, 5) see `kernels.arrays.Corners`
    first: Indices  # (h + 1,)
    unordered: Flags  # (h,)
    first_piece: Indices  # (b + 1,) body k has the pieces first_piece[k] to first_piece[k + 1]
    has_hulls: bool  # whether any of them is more than a point

    @property
    def heads(self) -> Indices:
        """The pieces (h,) with which bodies begin that exist when the window begins."""
        some = self.first_piece[:-1][self.first_piece[:-1] < self.first_piece[1:]]
        return np.asarray(some[self.pieces.times[some, 0] <= 0.0])

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
    def uncertain(self) -> Flags:
        """Whether the obstacle of each body has an uncertainty (b,)."""
        return np.ascontiguousarray(self.each["uncertain"])

    @property
    def at_rest(self) -> Flags:
        """Whether a contact with each body counts while the robot is at rest (b,)."""
        return np.ascontiguousarray(self.each["at_rest"])

    @property
    def hulls(self) -> MaybeHulls:
        """The hulls of the bodies, without directions; empty where all bodies are points."""
        if not self.has_hulls:
            return ()
        return Hulls(self.hull, np.empty((4, 2, 0)), self.corners, self.first, self.unordered)

    def displaced(self, offsets: Array) -> "Bodies":
        """The same bodies, each displaced by its offset (b, 3) [m] at all times."""
        each, d = offsets[self.pieces.body], self.pieces.points.shape[2]
        balls = self.balls + np.append(each, np.zeros((len(each), 1)), axis=1)
        return self._replace(pieces=self.pieces._replace(points=self.pieces.points + each[:, None, :d]), balls=balls)

    def hulls_of(self, rows: Indices) -> MaybeHulls:
        """The hulls of bodies by number (n,), without directions; empty where all bodies are points."""
        hulls = self.hulls
        return hulls._replace(hull=self.hull[rows]) if isinstance(hulls, Hulls) else ()


class TimedBodies(NamedTuple):
    """Bodies with pieces that may begin before a window of time and end after it."""

    bodies: Bodies  # grown by a robot's shape, of which those farther away than `reach` may be left out
    balls: Array  # (b, 4) [m] balls that hold each body on all its pieces; radius inf: not known
    now: float  # [s] the begin of the window on the clock of the pieces
    until: Array  # (o,) [s] after it, up to which each obstacle counts
    reach: float  # [m]


def passive_bodies(count: int) -> Records[PassiveBody]:
    """Bodies (b,) in every world, contact with which counts; the rest is 0."""
    each = zero_records(PassiveBody, count)
    each["world"], each["at_rest"] = EVERY_WORLD, True
    return each


def joined(
    obstacles: Sequence[Obstacle],
    indices: Sequence[int],
    shapes: list[MinkowskiSum],
    tables: list[Pieces],
    start: float,
    stretched: bool = False,
) -> Bodies:
    """The pieces of obstacles `indices`, times from `start` on; `stretched`: some by the way to where they brake to."""
    sizes = np.array([len(shape.radius) for shape in shapes])
    owner, count = np.repeat(np.array(indices), sizes), int(sizes.sum())
    lengths = [len(table.body) for table in tables]
    turning = stretched or any(obstacles[index].turns for index in indices)
    pieces = Pieces(
        np.concatenate([t.times for t in tables]) - start,
        np.concatenate([t.points for t in tables]),
        np.concatenate([t.radius for t in tables]),
        np.concatenate([t.growth for t in tables]),
        np.concatenate([t.turns for t in tables]) if turning else NO_TURNS,
        np.concatenate([t.body for t in tables]) + np.repeat(np.cumsum(sizes) - sizes, lengths),
    )
    counts = np.concatenate([shape.counts for shape in shapes])
    plain = np.array([obstacles[index].uncertainty is None for index in indices])
    spread = np.concatenate([shape.hull_radius for shape in shapes])
    point = (counts == 1) & (spread == 0.0) & np.repeat(plain, sizes)
    hull, each = np.where(point, -1, np.arange(count)), passive_bodies(count)
    each["owner"] = owner
    each["hull_radius"] = spread
    each["uncertain"] = ~np.repeat(plain, sizes)
    each["radius"] = np.concatenate([shape.radius for shape in shapes])
    each["at_rest"] = np.repeat([obstacles[index].contact_at_rest for index in indices], sizes)
    return Bodies(
        pieces,
        kernels.piece_balls(pieces),
        turning=turning,
        each=each,
        hull=hull,
        corners=np.concatenate([shape.corners for shape in shapes]),
        first=np.concatenate([[0], np.cumsum(counts)]),
        unordered=np.concatenate([shape.unordered for shape in shapes]),
        first_piece=np.searchsorted(pieces.body, np.arange(count + 1)),
        has_hulls=bool(hull.max(initial=-1) >= 0),
    )


def pieces_of_each(
    obstacles: Sequence[Obstacle],
    robot: Shape,
    start: float,
    until: Array,
    decided: float | None = None,
    braking: Array | None = None,
) -> Bodies:
    """The pieces of obstacles from `start` on, up to `until` (n,) [s] after it; those that do not exist have none.

    Args:
        decided: when they were predicted [s]; None: at the start.
        braking: (n,) [m/s^2] deceleration up to which each may brake from that time on; only for discs in the plane.
            Its body covers all places from the predicted one to that of the hardest braking. None: they do not brake.
    """
    shapes = []
    indices = []
    spans = []
    for index, (obstacle, duration) in enumerate(zip(obstacles, until.tolist())):
        first, last = obstacle.trajectory.span
        begin, end = max(start, first), min(start + duration, last)
        if begin < end:
            shapes.append(minkowski_sum(obstacle, robot))
            indices.append(index)
            spans.append((begin, end))
    if not indices:
        return no_bodies(robot.dimension)
    foreseen = start if decided is None else decided
    paths = _paths_at_once([obstacles[index] for index in indices], spans)
    ways: list[Path | None] = [None] * len(indices)
    for k, index in enumerate(() if braking is None else indices):
        assert braking is not None
        way = braking_displacement(obstacles[index].trajectory, float(braking[index]), foreseen, *spans[k])
        longest = float(np.linalg.norm(way.points, axis=2).max())
        shape = _stretched_sum(obstacles[index].shape.bounding_radius, robot)  # type: ignore[arg-type]  # a value
        ways[k], shapes[k] = way, shape._replace(hull_radius=shape.hull_radius + max(longest - 1.0, 0.0))
    tables = [
        rows_of(obstacles[index], shape, foreseen, *span, paths.get(k), ways[k])
        for k, (index, shape, span) in enumerate(zip(indices, shapes, spans, strict=True))
    ]
    return joined(obstacles, indices, shapes, tables, start, braking is not None)


@lru_cache(maxsize=256)
def _stretched_sum(radius: float, robot: Shape) -> MinkowskiSum:
    """Minkowski sum of a disc, stretched by a displacement that is the direction of the body, and a robot."""
    parts = [(_turning(STRETCHED_PART, other), other) for other in robot.parts]
    return MinkowskiSum(
        np.array([offset for (offset, _), _ in parts]),
        np.array([len(corners) for (_, corners), _ in parts], dtype=np.int64),
        np.concatenate([corners for (_, corners), _ in parts]),
        np.array([radius + other.radius for _, other in parts]),
        np.array([float((_length(c[:, :3]) + _length(c[:, 3:])).max()) for (_, c), _ in parts]),
        np.array([len(other.corners) > 1 for _, other in parts]),
    )


def braking_displacement(trajectory: Trajectory, braking: float, since: float, begin: float, end: float) -> Path:
    """The displacement (2,) [m] from where an obstacle is if it brakes to where it is on its trajectory.

    It brakes at `braking` [m/s^2] from `since` [s] on, along its velocity then, and stays at rest. At least
    SMALLEST_EXTENT long. From begin to end, absolute [s], in cubic pieces.
    """
    place, velocity = trajectory.position(since), trajectory.velocity(since)
    speed = float(np.linalg.norm(velocity))
    ahead, rest = velocity / speed, since + speed / braking
    path = trajectory.path(begin, end)
    times = np.union1d(path.times, [rest]) if begin < rest < end else path.times
    path = path.cut(times)
    moved = np.clip(times, since, rest) - since
    slowed = np.where(times < rest, speed - braking * moved, 0.0)
    widths = np.diff(times) / 3.0
    first, last = (speed - 0.5 * braking * moved) * moved, np.empty((len(widths), 4))
    last[:, 0], last[:, 3] = first[:-1], first[1:]
    last[:, 1], last[:, 2] = first[:-1] + widths * slowed[:-1], first[1:] - widths * slowed[1:]
    braked = place + last[..., None] * ahead - SMALLEST_EXTENT * ahead
    return Path(times, path.points - braked, path.error)


def _paths_at_once(obstacles: Sequence[Obstacle], spans: Sequence[tuple[float, float]]) -> dict[int, Path]:
    """Paths by number of obstacles, such as predictions of one moment, which take less time together than one by one.

    They are those of cubic trajectories with the same times, and of uncertain obstacles, cut as `rows_of` needs them.
    """
    groups: dict[tuple[bytes, int, tuple[float, float]], list[int]] = {}
    found = {}
    for k, (obstacle, span) in enumerate(zip(obstacles, spans, strict=True)):
        ahead = obstacle.trajectory
        if isinstance(ahead, PiecewisePolynomial) and ahead.is_cubic:
            groups.setdefault((ahead.times.tobytes(), ahead.coefficients.shape[1], span), []).append(k)
        elif obstacle.uncertainty is not None:
            found[k] = ahead.path(*span)
    for (_, _, (begin, end)), some in groups.items():
        times, points = cubic_paths([cast(PiecewisePolynomial, obstacles[k].trajectory) for k in some], begin, end)
        found |= {k: Path(times, own, np.zeros(len(times) - 1)) for k, own in zip(some, points, strict=True)}
    uncertain: dict[bytes, list[int]] = {}
    for k, path in found.items():
        if obstacles[k].uncertainty is not None:
            uncertain.setdefault(path.times.tobytes(), []).append(k)
    for some in uncertain.values():
        paths = [found[k] for k in some]
        points, errors = np.stack([path.points for path in paths], axis=1), np.stack([p.error for p in paths], axis=1)
        together = Path(paths[0].times, points, errors)
        cut = together.cut(_uncertain_knots(together, float(together.times[0]), float(together.times[-1])))
        for row, k in enumerate(some):
            found[k] = Path(cut.times, np.ascontiguousarray(cut.points[:, row]), cut.error[:, row].copy())
    return found


def _uncertain_knots(path: Path, begin: float, end: float) -> Array:
    """Times [s] between which a radius that grows is taken as linear."""
    return np.union1d(path.times, np.linspace(begin, end, UNCERTAINTY_PIECES + 1))


def merged(parts: Sequence[Bodies], counts: Sequence[int]) -> Bodies:
    """The bodies of several parts, with `counts` obstacles each, one part after the other."""
    if len(parts) == 1:
        return parts[0]
    rows, bodies = [len(part.pieces.body) for part in parts], [len(part.each) for part in parts]
    from_row, from_body = np.cumsum([0, *rows]), np.cumsum([0, *bodies])
    from_corner = np.cumsum([0, *(len(part.corners) for part in parts)])
    from_hull = np.cumsum([0, *(len(part.unordered) for part in parts)])
    columns, turning = zip(*(part.pieces for part in parts)), any(part.turning for part in parts)
    times, points, radius, growth, turns, body = columns
    if turning:
        turns = tuple(part.pieces.turns if part.turning else _ahead(n) for part, n in zip(parts, rows))
    each = joined_records([part.each for part in parts])
    each["owner"] += np.repeat(np.cumsum([0, *counts])[:-1], bodies)
    return Bodies(
        Pieces(
            np.concatenate(times),
            np.concatenate(points),
            np.concatenate(radius),
            np.concatenate(growth),
            np.concatenate(turns) if turning else NO_TURNS,
            np.concatenate(body) + np.repeat(from_body[:-1], rows),
        ),
        np.concatenate([part.balls for part in parts]),
        turning=turning,
        each=each,
        hull=np.concatenate([np.where(p.hull < 0, -1, p.hull + k) for p, k in zip(parts, from_hull)]),
        corners=np.concatenate([part.corners for part in parts]),
        first=np.concatenate([[0], *(part.first[1:] + k for part, k in zip(parts, from_corner))]),
        unordered=np.concatenate([part.unordered for part in parts]),
        first_piece=np.concatenate([[0], *(part.first_piece[1:] + k for part, k in zip(parts, from_row))]),
        has_hulls=any(part.has_hulls for part in parts),
    )


def rows_of(
    obstacle: Obstacle,
    shape: MinkowskiSum,
    decided: float,
    begin: float,
    end: float,
    known: Path | None = None,
    way: Path | None = None,
) -> Pieces:
    """The pieces of an obstacle's bodies from begin to end, all absolute [s], foreseen at `decided`.

    Body after body, each in the order of time; none if the end is not after the start.

    Args:
        known: the path, of an uncertain obstacle cut at `_uncertain_knots`; None: not made yet.
        way: see `braking_displacement`, of a disc that may brake.
    """
    if not begin < end:
        return no_bodies(obstacle.dimension).pieces
    path = obstacle.trajectory.path(begin, end) if known is None else known
    turns: Array | None = None
    radius, growth = path.error, np.zeros(len(path.error))
    if obstacle.uncertainty is not None:
        path = path.cut(_uncertain_knots(path, begin, end)) if known is None else path
        widths = obstacle.uncertainty.radius(path.times - decided, obstacle.dimension)
        radius, growth = path.error + widths[:-1], np.diff(widths)
    if obstacle.turns or way is not None:
        largest = max(float(shape.hull_radius.max()), SMALLEST_EXTENT)
        course = obstacle.directions(begin, end, INTERPOLATION / largest) if way is None else way
        times = np.union1d(path.times, course.times)
        k = np.clip(np.searchsorted(path.times, times[:-1], side="right") - 1, 0, len(growth) - 1)
        width = np.diff(path.times)[k]
        radius = radius[k] + growth[k] * (times[:-1] - path.times[k]) / width
        growth = growth[k] * np.diff(times) / width
        path, course = path.cut(times), course.cut(times)
        turns, radius = course.points, radius + course.error * (largest if way is None else 1.0)
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
        times = np.tile(times, (b, 1))
        radius = np.tile(radius, b)
        growth = np.tile(growth, b)
        turns = None if turns is None else np.tile(turns, (b, 1, 1))
    turns = _ahead(b * n) if turns is None else turns
    return Pieces(times, points, radius, growth, turns, np.repeat(np.arange(b), n))


@lru_cache(maxsize=256)
def _ahead(n: int) -> Array:
    """Directions (n, 4, 2) of bodies that do not turn."""
    return np.broadcast_to(_AHEAD, (n, 4, 2))


_AHEAD = np.array([1.0, 0.0])
NO_TURNS = np.empty((0, 4, 2))


def no_bodies(d: int) -> Bodies:
    """No bodies, in dimension d."""
    none = np.empty(0)
    no = np.empty(0, np.int64)
    never = np.empty(0, np.bool_)
    return Bodies(
        Pieces(np.empty((0, 2)), np.empty((0, 4, d)), none, none, np.empty((0, 4, 2)), no),
        balls=np.empty((0, 4)),
        turning=False,
        each=passive_bodies(0),
        hull=no,
        corners=np.empty((0, 5)),
        first=np.zeros(1, np.int64),
        unordered=never,
        first_piece=np.zeros(1, np.int64),
        has_hulls=False,
    )
