"""Routes around obstacles at rest: shortest paths that keep right in doors, for agents that meet others there."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely

from slalom.base.checks import Array, array_of, each_number, not_negative, vectors
from slalom.base.errors import Extra, InvalidInput
from slalom.decision.settings import Settings
from slalom.kernels.arrays import Flags, Indices
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import hull_corners, outline_parts
from slalom.obstacle.table import ObstacleTable

DOOR_WIDTH: Final = 8.0
"""[1] Widest door, in radii of the largest agent: wider passages have no lanes.

Larger: agents leave their shortest paths in passages where others have space beside them. Smaller: agents meet head-on
in doors that are wide enough for two.
"""

DOOR_DEPTH: Final = 2.0
"""[1] Length of the lane through a door on either side of it, in radii of the largest agent.

Larger: lanes of neighbouring doors overlap. Smaller: agents cross the lane of others beside the door.
"""

CONTACT: Final = 1e-6
"""[m] Depth in the walls grown by an agent below which a line only touches them.

Larger: paths cut corners by that. Smaller: rounding closes paths along walls.
"""


CHORD: Final = 0.01
"""[1] Most by which corners of grown walls stand out of their arcs, in radii of the agent with its margin.

Larger: paths around round walls are longer, and gaps as narrow as the agent are closed. Smaller: more corners.
"""


class Walls(NamedTuple):
    """Convex parts of obstacles at rest."""

    shapes: npt.NDArray[np.object_]  # (n,) of shapely
    radii: Array  # (n,) [m] by which each is rounded


class Door(NamedTuple):
    """The shortest line across a narrow passage between walls."""

    ends: Array  # (2, 2) [m]
    left: Array  # (2,) the unit vector from the first end to the second


def routes(
    starts: npt.ArrayLike,
    goals: npt.ArrayLike,
    radii: npt.ArrayLike,
    obstacles: Sequence[Obstacle] | ObstacleTable,
    *,
    margin: float = Settings.margin,
) -> list[Array]:
    """The points (m, 2) [m] of a path around obstacles at rest for each of n agents in the plane, for a `PathGoal`.

    It is the shortest path that keeps the radius of the largest agent and the margin from obstacles, or its own radius
    where that path does not exist. Around corners and round walls it is wider by at most CHORD. From a start or to a
    goal nearer to a wall it is the shortest line that leaves the wall. It crosses each door in the middle of its right
    half: agents of both directions pass each other there. Source: de Berg et al., Computational Geometry, 2008, ch. 15
    (visibility graphs).

    Args:
        starts, goals: (n, 2) [m]. radii: (n,) or one number [m], above 0. margin: [m].

    Raises:
        InvalidInput: arrays of other shapes, a goal at its start or without a path, a start or goal in a wall or on
            it. MissingExtra: SciPy is not installed.
    """
    begin = vectors(starts, "starts", 2)
    sizes = each_number(radii, "radii", len(begin))
    if not np.all(sizes > 0.0):
        raise InvalidInput(f"radii: expected numbers above 0 m, found {sizes.min():g} m")
    return RouteMap(obstacles, float(sizes.max(initial=0.0)), margin).routes(begin, goals, sizes)


class RouteMap:
    """Obstacles at rest among which `routes` are searched again and again.

    Args:
        obstacles: those at rest count. most: [m] radius of the largest agent. margin: [m].
    """

    def __init__(self, obstacles: Sequence[Obstacle] | ObstacleTable, most: float, margin: float) -> None:
        self.walls, self.most = walls_at_rest(obstacles), most
        self.margin = not_negative(margin, "margin")
        self._areas = shapely.union_all(shapely.buffer(self.walls.shapes, self.walls.radii))
        self._solid = shapely.union_all([*self.walls.shapes, self._areas])
        self._doors = _doors(self.walls, DOOR_WIDTH * most)
        self._corners = dict[float, _Corners]()

    def routes(self, begin: Array, goals: npt.ArrayLike, sizes: Array) -> list[Array]:
        """The paths of `routes` from `begin` (n, 2) [m] for agents with radii (n,) [m] of at most `most`."""
        end = array_of(goals, "goals", begin.shape)
        same = np.flatnonzero(np.linalg.norm(end - begin, axis=1) <= CONTACT)
        if same.size:
            raise InvalidInput(f"goals[{same[0]}]: expected a place apart from the start, found {end[same[0]]}")
        for name, places in (("starts", begin), ("goals", end)):
            _refuse_inside(name, places, self.walls, self._areas)
        most, margin = self.most, self.margin
        found: list[Array | None] = [None] * len(begin)
        for radius in np.unique(np.append(sizes, most))[::-1].tolist():
            rows = [k for k, path in enumerate(found) if path is None and (radius == most or sizes[k] == radius)]
            if not rows:
                continue
            if radius not in self._corners:
                self._corners[radius] = _corners_of(_grown(self.walls, radius + margin))
            for k, path in zip(rows, _shortest_paths(begin[rows], end[rows], self._corners[radius], self._solid)):
                if path is not None:
                    found[k] = _kept_right(path, self._doors, self.walls, float(sizes[k]) + margin, DOOR_DEPTH * most)
        lost = [k for k, path in enumerate(found) if path is None]
        if lost:
            raise InvalidInput(
                f"goals[{lost[0]}]: expected a place that a path leads to, found {end[lost[0]]} without one"
            )
        return [path for path in found if path is not None]


def walls_at_rest(obstacles: Sequence[Obstacle] | ObstacleTable) -> Walls:
    """The convex parts of obstacles at rest."""
    given = obstacles.given if isinstance(obstacles, ObstacleTable) else obstacles
    parts = [part for obstacle in given if obstacle.at_rest for part in outline_parts(obstacle, 0.0)]
    hulls = [shapely.convex_hull(shapely.MultiPoint(part.corners)) for part in parts]
    return Walls(np.array(hulls, dtype=object), np.array([part.radius for part in parts]))


def _grown(walls: Walls, by: float) -> shapely.Geometry:
    """The union of walls grown by a length [m]: polygons around the exact areas, by at most CHORD of that length."""
    each = zip(walls.shapes, walls.radii)
    return shapely.union_all([shapely.Polygon(_rounded(shape, radius + by, CHORD * by)) for shape, radius in each])


def _rounded(shape: shapely.Geometry, radius: float, most: float) -> Array:
    """Corners (m, 2) [m] of a polygon around a convex shape rounded by a radius [m], at most `most` [m] outside of it.

    All its sides touch the rounded shape.
    """
    hull = hull_corners(shapely.get_coordinates(shape))
    before = hull - np.roll(hull, 1, axis=0)
    after = np.roll(before, -1, axis=0)
    first, along = np.arctan2(-before[:, 0], before[:, 1]), np.einsum("ij,ij->i", before, after)
    turn = np.arctan2(np.maximum(_cross(before, after), 0.0), along) if len(hull) > 1 else np.array([2.0 * np.pi])
    # Tangents of an arc that are the angle 2 h apart meet at radius / cos(h) from its centre.
    count = np.ceil(turn / (2.0 * np.arccos(radius / (radius + most)))).astype(np.int64)
    half, number = np.repeat(0.5 * turn / np.maximum(count, 1), count), np.concatenate([np.arange(n) for n in count])
    angle = np.repeat(first, count) + (2 * number + 1) * half
    arm = radius / np.cos(half)
    away: Array = np.stack([arm * np.cos(angle), arm * np.sin(angle)], axis=1)
    return away + np.repeat(hull, count, axis=0)


def _refuse_inside(name: str, places: Array, walls: Walls, areas: shapely.Geometry) -> None:
    """Raise InvalidInput for the first of the places (n, 2) [m] that is in a wall or on it; `areas`: those of all."""
    for k, place in enumerate(places):
        point = shapely.Point(place)
        if _away(walls, point) <= CONTACT:
            depth = shapely.distance(shapely.boundary(areas), point) if shapely.contains(areas, point) else 0.0
            raise InvalidInput(
                f"{name}[{k}]: expected a place outside of obstacles, found {place}, {depth:g} m inside one"
            )


def _cross(one: Array, other: Array) -> Array:
    """Cross products (...) of vectors (..., 2) in the plane."""
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


class _Corners(NamedTuple):
    """The corners of a blocked area, and which of them straight lines outside of it join."""

    blocked: shapely.Geometry
    inside: shapely.Geometry  # prepared
    points: Array  # (m, 3, 2) [m] see `_convex_corners`
    joined: list[Indices]  # m, of each corner those after it


def _corners_of(blocked: shapely.Geometry) -> _Corners:
    inside, corners = shapely.buffer(blocked, -CONTACT), _convex_corners(blocked)
    shapely.prepare(inside)
    joined = []
    for k, own in enumerate(corners):
        after = corners[k + 1 :]
        to = np.flatnonzero(_bends(own, after[:, 1]) & _bends(after, own[1]))
        joined.append(k + 1 + to[_free(inside, own[1], after[to, 1])])
    return _Corners(blocked, inside, corners, joined)


def _free(inside: shapely.Geometry, begin: Array, ends: Array) -> Flags:
    """Whether the straight lines from begin (2,) [m], or (k, 2), to ends (k, 2) [m] avoid an area: (k,)."""
    lines = shapely.linestrings(np.stack(np.broadcast_arrays(begin, ends), axis=1))
    return np.asarray(~shapely.intersects(inside, lines))


def _shortest_paths(begin: Array, end: Array, among: _Corners, solid: shapely.Geometry) -> list[Array | None]:
    """The shortest path (m, 2) [m] from each start to its goal outside a blocked area; None where none leads there.

    A visibility graph: the corners of the area, starts and goals, and the straight lines between them outside of it
    that shortest paths may have. A start or goal inside the area, near a wall, is joined by the shortest line that
    leaves the area; none leads there if that line meets the `solid` walls.
    """
    with Extra("tracks", "routes"):
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import dijkstra
    n, inside = len(begin), among.inside
    corners = among.points
    places, joined = _outside(np.concatenate([begin, end]), among.blocked, solid)
    nodes = np.concatenate([corners[:, 1], places])
    m = len(corners)
    # Pairs of corners, of corners and places, and each start with its goal.
    straight = np.flatnonzero(_free(inside, places[:n], places[n:]))
    pairs = [np.stack([m + straight, m + n + straight], axis=1)]
    for k in range(m):
        seen = np.flatnonzero(_bends(corners[k], places))
        to = np.append(among.joined[k], m + seen[_free(inside, corners[k, 1], places[seen])])
        pairs.append(np.stack([np.full(len(to), k), to], axis=1))
    free = np.concatenate(pairs)
    lengths = np.linalg.norm(nodes[free[:, 0]] - nodes[free[:, 1]], axis=1)
    # A length of 0 would be no edge.
    graph = csr_array((np.maximum(lengths, CONTACT), free.T), shape=(len(nodes), len(nodes)))
    away, before = dijkstra(graph, directed=False, indices=m + n + np.arange(n), return_predecessors=True)
    found: list[Array | None] = []
    for k in range(n):
        at = m + k
        if not (np.isfinite(away[k, at]) and joined[k] and joined[n + k]):
            found.append(None)
            continue
        way = [begin[k], nodes[at]]
        while at != m + n + k:
            at = int(before[k, at])
            way.append(nodes[at])
        found.append(_without_repetitions(np.array([*way, end[k]])))
    return found


def _bends(corners: Array, to: Array) -> Flags:
    """Whether a shortest path may turn at corners (..., 3, 2) [m] from or to places (..., 2) [m].

    It may if the points before and after the corner lie on one side of the line.
    """
    at = corners[..., 1, :]
    way = to - at
    sides = [_cross(way, corners[..., k, :] - at) for k in (0, 2)]
    most = CONTACT * np.linalg.norm(way, axis=-1)
    return np.asarray((np.minimum(*sides) >= -most) | (np.maximum(*sides) <= most))


def _outside(points: Array, blocked: shapely.Geometry, solid: shapely.Geometry) -> tuple[Array, npt.NDArray[np.bool_]]:
    """The nearest points (n, 2) [m] outside a blocked area, and whether a line leads there that meets no `solid`."""
    found, geometries = points.copy(), shapely.points(points)
    within = shapely.contains_properly(blocked, geometries)
    lines = shapely.shortest_line(geometries[within], shapely.boundary(blocked))
    found[within] = shapely.get_coordinates(lines).reshape(-1, 2, 2)[:, 1]
    joined = ~within
    joined[within] = ~shapely.intersects(solid, lines)
    return found, joined


def _convex_corners(area: shapely.Geometry) -> Array:
    """The corners of an area around which shortest paths bend, each between its neighbours: (m, 3, 2) [m]."""
    found = [np.empty((0, 3, 2))]
    for part in shapely.get_parts(shapely.normalize(area)):
        for ring in shapely.get_rings(part):
            points = shapely.get_coordinates(ring)[:-1]
            each = np.stack([np.roll(points, 1, axis=0), points, np.roll(points, -1, axis=0)], axis=1)
            # Rings of normalised areas are clockwise outside and counter-clockwise around holes.
            found.append(each[_cross(each[:, 1] - each[:, 0], each[:, 2] - each[:, 1]) < 0.0])
    return np.concatenate(found)


def _doors(walls: Walls, widest: float) -> list[Door]:
    """The doors of at most a width [m]: the shortest lines between two walls that no wall crosses."""
    (shapes, radii) = walls
    tree, found = shapely.STRtree(shapes), list[Door]()
    for one, other in tree.query(shapes, "dwithin", widest + 2.0 * radii.max(initial=0.0)).T.tolist():
        if one >= other:
            continue
        ends = shapely.get_coordinates(shapely.shortest_line(shapes[one], shapes[other]))
        length = float(np.linalg.norm(ends[1] - ends[0]))
        if not 0.0 < length - radii[one] - radii[other] <= widest:
            continue
        left = (ends[1] - ends[0]) / length
        middle = shapely.LineString([ends[0] + CONTACT * left, ends[1] - CONTACT * left])
        if not len(tree.query(middle, "intersects")):
            found.append(Door(ends + np.array([[radii[one]], [-radii[other]]]) * left, left))
    return found


def _kept_right(path: Array, doors: Sequence[Door], walls: Walls, size: float, depth: float) -> Array:
    """The path (m, 2) [m] with a lane of `depth` [m] on either side of each door, in the middle of its right half.

    It keeps `size` [m] from the ends of the door where it is wide enough. Corners beside the door are left out. So is a
    lane by which the path comes nearer to walls than `size`.
    """
    line, found = shapely.LineString(path), path
    at = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
    points, kept = list[tuple[float, Array]](), np.ones(len(path), np.bool_)
    clear = min(size, _away(walls, line)) - CONTACT
    for door in doors:
        crossing = shapely.intersection(line, shapely.LineString(door.ends))
        if shapely.is_empty(crossing):
            continue
        along = float(shapely.line_locate_point(line, shapely.Point(shapely.get_coordinates(crossing)[0])))
        k = min(int(np.searchsorted(at, along, side="right")), len(path) - 1)
        forward = np.array([door.left[1], -door.left[0]])
        forward *= 1.0 if forward @ (path[k] - path[k - 1]) > 0.0 else -1.0
        half = 0.5 * float(np.linalg.norm(door.ends[1] - door.ends[0]))
        right = np.array([forward[1], -forward[0]]) * max(0.0, min(0.5 * half, half - size))
        lane = [(along + by, 0.5 * door.ends.sum(axis=0) + right + by * forward) for by in (-depth, depth)]
        inner = [(s, point) for s, point in lane if 0.0 < s < at[-1] and _away(walls, shapely.Point(point)) >= size]
        left = kept & (np.abs(at - along) > depth)
        left[[0, -1]] = True
        every = sorted([*zip(at[left].tolist(), path[left]), *points, *inner], key=lambda each: each[0])
        tried = _without_repetitions(np.array([point for _, point in every]))
        if _away(walls, shapely.LineString(tried)) >= clear:
            found, kept = tried, left
            points += inner
    return found


def _away(walls: Walls, geometry: shapely.Geometry) -> float:
    """The distance [m] of a point or line from the nearest wall."""
    return float(np.min(shapely.distance(walls.shapes, geometry) - walls.radii, initial=np.inf))


def _without_repetitions(path: Array) -> Array:
    """The path (m, 2) [m] without points that are the point before them; two points at least are left."""
    new = np.ones(len(path), np.bool_)
    new[1:] = np.linalg.norm(np.diff(path, axis=0), axis=1) > CONTACT
    return path[new]
