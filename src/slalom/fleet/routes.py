"""Routes around obstacles at rest: shortest paths that keep right in doors, for agents that meet others there."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely

from slalom.base.checks import Array, array_of, each_number, not_negative, vectors
from slalom.base.errors import Extra, InvalidInput
from slalom.decision.settings import Settings
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import outline_parts
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
    where that path does not exist. It crosses each door in the middle of its right half: agents of both directions pass
    each other there. Source: de Berg et al., Computational Geometry, 2008, ch. 15 (visibility graphs).

    Args:
        starts, goals: (n, 2) [m]. radii: (n,) or one number [m], above 0. margin: [m].

    Raises:
        InvalidInput: arrays of other shapes, a goal at its start or without a path. MissingExtra: SciPy is not
            installed.
    """
    begin = vectors(starts, "starts", 2)
    end = array_of(goals, "goals", begin.shape)
    sizes, margin = each_number(radii, "radii", len(begin)), not_negative(margin, "margin")
    if not np.all(sizes > 0.0):
        raise InvalidInput(f"radii: expected numbers above 0 m, found {sizes.min():g} m")
    same = np.flatnonzero(np.linalg.norm(end - begin, axis=1) <= CONTACT)
    if same.size:
        raise InvalidInput(f"goals[{same[0]}]: expected a place apart from the start, found {end[same[0]]}")
    walls, most = _walls(obstacles), float(sizes.max(initial=0.0))
    doors = _doors(walls, DOOR_WIDTH * most)
    found: list[Array | None] = [None] * len(begin)
    for radius in np.unique(sizes)[::-1].tolist():
        rows = [k for k, path in enumerate(found) if path is None and (radius == most or sizes[k] == radius)]
        if not rows:
            continue
        for k, path in zip(rows, _shortest_paths(begin[rows], end[rows], _grown(walls, radius + margin))):
            if path is not None:
                found[k] = _kept_right(path, doors, walls, float(sizes[k]) + margin, DOOR_DEPTH * most)
    lost = [k for k, path in enumerate(found) if path is None]
    if lost:
        raise InvalidInput(f"goals[{lost[0]}]: expected a place that a path leads to, found {end[lost[0]]} without one")
    return [path for path in found if path is not None]


def _walls(obstacles: Sequence[Obstacle] | ObstacleTable) -> Walls:
    """The convex parts of obstacles at rest."""
    given = obstacles.given if isinstance(obstacles, ObstacleTable) else obstacles
    parts = [part for obstacle in given if obstacle.at_rest for part in outline_parts(obstacle, 0.0)]
    hulls = [shapely.convex_hull(shapely.MultiPoint(part.corners)) for part in parts]
    return Walls(np.array(hulls, dtype=object), np.array([part.radius for part in parts]))


def _grown(walls: Walls, by: float) -> shapely.Geometry:
    """The union of walls grown by a length [m], with few corners: those of lines and areas stay sharp."""
    sharp = {"cap_style": "square", "join_style": "mitre", "mitre_limit": 2.0}
    return shapely.union_all(shapely.buffer(walls.shapes, walls.radii + by, **sharp))


def _shortest_paths(begin: Array, end: Array, blocked: shapely.Geometry) -> list[Array | None]:
    """The shortest path (m, 2) [m] from each start to its goal outside a blocked area; None where none leads there.

    A visibility graph: the corners of the area, starts and goals, and all straight lines between them outside of it. A
    start or goal inside the area, near a wall, is joined by the shortest line that leaves the area.
    """
    with Extra("tracks", "routes"):
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import dijkstra
    n, inside = len(begin), shapely.buffer(blocked, -CONTACT)
    shapely.prepare(inside)
    places = _outside(np.concatenate([begin, end]), blocked)
    corners = _convex_corners(blocked)
    nodes = np.concatenate([corners, places])
    m = len(corners)
    # Every pair of corners, every corner with every place, and every start with its goal.
    pairs = np.concatenate(
        [
            np.stack(np.triu_indices(m, 1), axis=1),
            np.stack(np.meshgrid(np.arange(m), m + np.arange(2 * n)), axis=-1).reshape(-1, 2),
            m + np.stack([np.arange(n), n + np.arange(n)], axis=1),
        ]
    )
    free = pairs[~shapely.intersects(inside, shapely.linestrings(nodes[pairs]))] if len(pairs) else pairs
    lengths = np.linalg.norm(nodes[free[:, 0]] - nodes[free[:, 1]], axis=1)
    # A length of 0 would be no edge.
    graph = csr_array((np.maximum(lengths, CONTACT), free.T), shape=(len(nodes), len(nodes)))
    away, before = dijkstra(graph, directed=False, indices=m + n + np.arange(n), return_predecessors=True)
    found: list[Array | None] = []
    for k in range(n):
        at = m + k
        if not np.isfinite(away[k, at]):
            found.append(None)
            continue
        way = [begin[k], nodes[at]]
        while at != m + n + k:
            at = int(before[k, at])
            way.append(nodes[at])
        found.append(_without_repetitions(np.array([*way, end[k]])))
    return found


def _outside(points: Array, blocked: shapely.Geometry) -> Array:
    """The nearest points (n, 2) [m] outside a blocked area."""
    found = points.copy()
    geometries = shapely.points(points)
    within = shapely.contains_properly(blocked, geometries)
    if within.any():
        nearest = shapely.shortest_line(geometries[within], shapely.boundary(blocked))
        found[within] = shapely.get_coordinates(nearest).reshape(-1, 2, 2)[:, 1]
    return found


def _convex_corners(area: shapely.Geometry) -> Array:
    """The corners (m, 2) [m] of an area around which shortest paths bend."""
    found = [np.empty((0, 2))]
    for part in shapely.get_parts(shapely.normalize(area)):
        for ring in shapely.get_rings(part):
            points = shapely.get_coordinates(ring)[:-1]
            before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
            # Rings of normalised areas are clockwise outside and counter-clockwise around holes.
            found.append(points[before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] < 0.0])
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

    It keeps `size` [m] from the ends of the door where it is wide enough. Corners beside the door are left out.
    """
    line = shapely.LineString(path)
    at = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
    points, kept = list[tuple[float, Array]](), np.ones(len(path), np.bool_)
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
        middle = 0.5 * door.ends.sum(axis=0) + right
        points += [(along + by, middle + by * forward) for by in (-depth, depth)]
        kept[1:-1] &= np.abs(at[1:-1] - along) > depth
    inner = [(along, point) for along, point in points if 0.0 < along < at[-1] and _away(walls, point) >= size]
    every = sorted([*zip(at[kept].tolist(), path[kept]), *inner], key=lambda each: each[0])
    return _without_repetitions(np.array([point for _, point in every]))


def _away(walls: Walls, point: Array) -> float:
    """The distance [m] of a point (2,) [m] from the nearest wall."""
    return float(np.min(shapely.distance(walls.shapes, shapely.Point(point)) - walls.radii, initial=np.inf))


def _without_repetitions(path: Array) -> Array:
    """The path (m, 2) [m] without points that are the point before them; two points at least are left."""
    new = np.ones(len(path), np.bool_)
    new[1:] = np.linalg.norm(np.diff(path, axis=0), axis=1) > CONTACT
    return path[new]
