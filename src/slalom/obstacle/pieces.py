"""Cubic pieces of the bodies of obstacles over an interval of time, one obstacle at a time and joined."""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any, Final, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import INTERPOLATION
from slalom.kernels.arrays import (
    EVERY_WORLD,
    Bodies,
    Body,
    Corners,
    Flags,
    Indices,
    Pieces,
    joined_corners,
    joined_records,
    zero_records,
)
from slalom.model.path import Path
from slalom.model.shape import Part, Shape
from slalom.model.trajectory import PiecewisePolynomial, Trajectory
from slalom.model.trajectory.kinds import cubic_paths, quadratic_paths
from slalom.model.uncertainty import until_of
from slalom.obstacle.obstacle import Obstacle


class MinkowskiSum(NamedTuple):
    """Obstacle shape grown by the robot shape, as b convex bodies: hulls of the differences of their corners."""

    offsets: Array  # (b, d) [m] the body's origin from the obstacle's position
    counts: Indices  # (b,) corners
    corners: Array  # (c, 5) [m] from the body's origin, see `RelativeMotion`
    radius: Array  # (b,) [m] rounding
    hull_radius: Array  # (b,) [m] the largest distance of a corner from the body's origin
    unordered: Flags  # (b,)

    @property
    def is_point(self) -> Flags:
        """Whether each body is a rounded point: its origin (b,)."""
        return np.asarray((self.counts == 1) & (self.hull_radius == 0.0))

    @property
    def hulls(self) -> Corners:
        """The corners, each body with a hull of its own number."""
        return Corners(self.corners, np.concatenate([[0], np.cumsum(self.counts)]), self.unordered)

    def repeated(self, n: int) -> "MinkowskiSum":
        """The bodies n times, one time after the other."""
        columns: tuple[npt.NDArray[Any], ...] = self
        # Half the time of `np.tile`.
        return MinkowskiSum(*(np.repeat(each[None], n, axis=0).reshape(-1, *each.shape[1:]) for each in columns))


def no_sum(d: int) -> MinkowskiSum:
    """No bodies, in dimension d."""
    none, no = np.empty(0), np.empty(0, np.int64)
    return MinkowskiSum(np.empty((0, d)), no, np.empty((0, 5)), none, none, np.empty(0, np.bool_))


def sums_together(sums: Iterable[MinkowskiSum]) -> MinkowskiSum:
    """The bodies of several sums, one sum after the other."""
    return MinkowskiSum(*(np.concatenate(column) for column in zip(*sums)))


def minkowski_sum(obstacle: Obstacle, robot: Shape) -> MinkowskiSum:
    """Minkowski sum of an obstacle's shape and the reflection of a robot that never turns.

    The obstacle is in its constant heading if it has one, otherwise in its body frame.

    Raises:
        InvalidInput: in space, neither robot nor obstacle is round.
    """
    result: MinkowskiSum = _minkowski_sum(obstacle.shape, robot, obstacle.angle)  # type: ignore[arg-type]  # shapes are values
    return result


def sum_of_shapes(shape: Shape, robot: Shape, angle: float = 0.0) -> MinkowskiSum:
    """Minkowski sum of a shape in a constant heading `angle` [rad] and the reflection of a robot that never turns.

    Raises as `minkowski_sum`.
    """
    result: MinkowskiSum = _minkowski_sum(shape, robot, angle)  # type: ignore[arg-type]  # shapes are values
    return result


@lru_cache(maxsize=4096)
def _minkowski_sum(shape: Shape, robot: Shape, angle: float | None) -> MinkowskiSum:
    bodies = []
    for part in shape.parts:
        for other in robot.parts:
            both_polygonal = len(part.corners) > 1 and len(other.corners) > 1
            if both_polygonal and shape.dimension == 3:
                raise InvalidInput(
                    "robot: expected a ball, or obstacles that are balls, in space; found parts with "
                    f"{len(other.corners)} and {len(part.corners)} corners"
                )
            offset, corners = _turning(part, other) if angle is None else _fixed(part, other, angle)
            # The order of the corners of the sum changes with the heading.
            bodies.append(_sum_of(offset, corners, part.radius + other.radius, both_polygonal and angle is None))
    return sums_together(bodies)


def _sum_of(offset: Array, corners: Array, radius: float, unordered: bool) -> MinkowskiSum:
    """One body, see `MinkowskiSum`."""
    extent = float((_length(corners[:, :3]) + _length(corners[:, 3:])).max())
    return MinkowskiSum(
        offset[None], np.array([len(corners)]), corners, np.array([radius]), np.array([extent]), np.array([unordered])
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
    own = part.corners if not angle else part.corners @ rotation(angle).T
    d = own.shape[1]
    points = (own[:, None] - other.corners[None]).reshape(-1, d)
    if len(points) > 2:
        points = hull_corners(points)
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    corners = np.zeros((len(points), 5))
    corners[:, :d] = points - center
    return center, corners


def rotation(angle: float) -> Array:
    """The matrix (2, 2) that turns vectors counter-clockwise by an angle [rad]."""
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


SMALLEST_EXTENT: Final = 1e-3
"""[m] Largest distance of a corner below which a body that turns counts as this large. Larger: less exact directions of
small bodies. Smaller: more pieces for bodies that are nearly points."""

UNCERTAINTY_PIECES: Final = 8
"""[1] Straight lines that stand for a growing radius over one window. Larger: more pieces. Smaller: the radius is
larger than needed in between."""


STRETCHED_PART: Final = Part(np.array([(0.0, 0.0), (-1.0, 0.0)]), 0.0)
"""A body from its predicted place to where it is if it brakes, whose displacement is the direction of the body."""


class Reach(NamedTuple):
    """The ball that a robot stays in within a window of time: bodies farther away from it may be left out."""

    position: Array  # (d,) [m] of the robot
    distance: float  # [m] that it moves at most
    clearance: float  # [m] from bodies that still count, with all errors of both


def bodies_of(pieces: Pieces, shape: MinkowskiSum, owner: Indices, uncertain: Flags, count: int) -> Bodies:
    """The bodies of `count` obstacles in every world, contact with which counts, with pieces cut to a window of time.

    `owner` (b,) is the obstacle of each, `uncertain` (b,) whether the radius of its pieces holds an uncertainty. Balls
    that hold bodies on all their pieces are not known.
    """
    each, unknown = zero_records(Body, len(owner)), np.zeros((len(owner), 4))
    each["world"], each["at_rest"] = EVERY_WORLD, True
    each["owner"], each["uncertain"] = owner, uncertain
    each["radius"], each["hull_radius"] = shape.radius, shape.hull_radius
    each["offset"][:, : shape.offsets.shape[1]] = shape.offsets
    hull = np.where(shape.is_point & ~uncertain, -1, np.arange(len(owner)))
    unknown[:, 3] = np.inf
    return Bodies(
        pieces,
        kernels.piece_balls(pieces),
        first_piece=np.searchsorted(pieces.body, np.arange(len(owner) + 1)),
        each=each,
        hull=hull,
        corners=shape.hulls if hull.max(initial=-1) >= 0 else (),
        body_balls=unknown,
        now=0.0,
        until=np.full(count, np.inf),
        reach=np.inf,
    )


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
    uncertain = np.array([obstacles[index].uncertainty is not None for index in indices])
    owner, uncertain = np.repeat(np.array(indices), sizes), np.repeat(uncertain, sizes)
    bodies = bodies_of(pieces, sums_together(shapes), owner, uncertain, len(obstacles))
    bodies.each["at_rest"] = np.repeat([obstacles[index].contact_at_rest for index in indices], sizes)
    return bodies


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
        return no_bodies(robot.dimension, len(obstacles))
    foreseen = start if decided is None else decided
    paths = _paths_at_once([obstacles[index] for index in indices], spans, foreseen)
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


def straight_bodies(
    obstacles: Sequence[Obstacle], robot: Shape, start: float, until: Array, derivatives: int
) -> Bodies:
    """As `pieces_of_each`, all at once, of exact obstacles on quadratic paths in constant headings."""
    end = start + until
    some = np.flatnonzero(start < end).tolist()
    if not some:
        return no_bodies(robot.dimension, len(obstacles))
    each, end = [obstacles[k] for k in some], end[some]
    shapes: list[MinkowskiSum] = [_minkowski_sum(one.shape, robot, one.heading) for one in each]  # type: ignore[arg-type]
    sizes = np.array([len(shape.radius) for shape in shapes])
    grown, total = sums_together(shapes), int(sizes.sum())
    points = quadratic_paths([one.trajectory for one in each], start, end, derivatives)
    points = np.repeat(points, sizes, axis=0) + grown.offsets[:, None]
    times, none = np.zeros((total, 2)), np.zeros(total)
    times[:, 1] = np.repeat(end - start, sizes)
    pieces = Pieces(times, points, none, none, NO_TURNS, np.arange(total))
    bodies = bodies_of(pieces, grown, np.repeat(some, sizes), np.zeros(total, np.bool_), len(obstacles))
    bodies.each["at_rest"] = np.repeat([one.contact_at_rest for one in each], sizes)
    return bodies


@lru_cache(maxsize=256)
def _stretched_sum(radius: float, robot: Shape) -> MinkowskiSum:
    """Minkowski sum of a disc, stretched by a displacement that is the direction of the body, and a robot."""
    return sums_together(
        _sum_of(*_turning(STRETCHED_PART, other), radius + other.radius, len(other.corners) > 1)
        for other in robot.parts
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


def _paths_at_once(
    obstacles: Sequence[Obstacle], spans: Sequence[tuple[float, float]], decided: float
) -> dict[int, Path]:
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
    uncertain: dict[tuple[bytes, float], list[int]] = {}
    for k, path in found.items():
        if obstacles[k].uncertainty is not None:
            uncertain.setdefault((path.times.tobytes(), decided + until_of(obstacles[k].uncertainty)), []).append(k)
    for (_, until), some in uncertain.items():
        paths = [found[k] for k in some]
        points, errors = np.stack([path.points for path in paths], axis=1), np.stack([p.error for p in paths], axis=1)
        together = Path(paths[0].times, points, errors)
        cut = together.cut(_uncertain_knots(together, float(together.times[0]), float(together.times[-1]), until))
        for row, k in enumerate(some):
            found[k] = Path(cut.times, np.ascontiguousarray(cut.points[:, row]), cut.error[:, row].copy())
    return found


def _uncertain_knots(path: Path, begin: float, end: float, until: float) -> Array:
    """Times [s] between which a radius that grows `until` a time [s] is taken as linear."""
    knots = np.union1d(path.times, np.linspace(begin, end, UNCERTAINTY_PIECES + 1))
    # A piece as short as rounding would have no direction.
    return knots if np.isclose(knots, until).any() or not begin < until < end else np.union1d(knots, [until])


def merged(parts: Sequence[Bodies]) -> Bodies:
    """The bodies of several parts, cut to one window of time, one part after the other."""
    if len(parts) == 1:
        return parts[0]
    rows, bodies = [len(part.pieces.body) for part in parts], [len(part.each) for part in parts]
    from_row, from_body = np.cumsum([0, *rows]), np.cumsum([0, *bodies])
    from_hull = np.cumsum([0, *(len(part.corners.unordered) if part.corners else 0 for part in parts)])
    columns, turning = zip(*(part.pieces for part in parts)), any(part.turning for part in parts)
    times, points, radius, growth, turns, body = columns
    if turning:
        turns = tuple(part.pieces.turns if part.turning else _ahead(n) for part, n in zip(parts, rows))
    each = joined_records([part.each for part in parts])
    each["owner"] += np.repeat(np.cumsum([0, *(len(part.until) for part in parts)])[:-1], bodies)
    return Bodies(
        Pieces(
            np.concatenate(times),
            np.concatenate(points),
            np.concatenate(radius),
            np.concatenate(growth),
            np.concatenate(turns) if turning else NO_TURNS,
            np.concatenate(body) + np.repeat(from_body[:-1], rows),
        ),
        balls=np.concatenate([part.balls for part in parts]),
        first_piece=np.concatenate([[0], *(part.first_piece[1:] + k for part, k in zip(parts, from_row))]),
        each=each,
        hull=np.concatenate([np.where(p.hull < 0, -1, p.hull + k) for p, k in zip(parts, from_hull)]),
        corners=joined_corners([part.corners for part in parts]),
        body_balls=np.concatenate([part.body_balls for part in parts]),
        now=0.0,
        until=np.concatenate([part.until for part in parts]),
        reach=min(part.reach for part in parts),
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
        return no_pieces(obstacle.dimension)
    path = obstacle.trajectory.path(begin, end) if known is None else known
    turns: Array | None = None
    radius, growth = path.error, np.zeros(len(path.error))
    if obstacle.uncertainty is not None:
        until = decided + until_of(obstacle.uncertainty)
        path = path.cut(_uncertain_knots(path, begin, end, until)) if known is None else path
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


def no_bodies(d: int, count: int) -> Bodies:
    """No bodies of `count` obstacles, in dimension d."""
    return bodies_of(no_pieces(d), no_sum(d), np.empty(0, np.int64), np.empty(0, np.bool_), count)


def no_pieces(d: int) -> Pieces:
    """No pieces, in dimension d."""
    return Pieces(np.empty((0, 2)), np.empty((0, 4, d)), np.empty(0), np.empty(0), NO_TURNS, np.empty(0, np.int64))
