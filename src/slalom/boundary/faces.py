"""The boundary of a control obstacle in the plane: faces between closed curves, each decided in the workspace.

The curves of `envelope.py` may hold more than the boundary, never less: they cut the window into faces that are free
or blocked as a whole, and one control of each is asked for.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from slalom.boundary.envelope import Indices, Mask, Nodes, Window, arc_step, point_nodes, rows_of_hull
from slalom.boundary.outline import outlines
from slalom.checks import Array
from slalom.relative_motion import RelativeMotion
from slalom.tolerances import GRID


def boundary(
    segments: RelativeMotion,
    owners: int,
    inside: Callable[[Array], npt.NDArray[np.bool_]],
    center: Array,
    radius: float,
    tolerance: float,
) -> list[Any]:
    """The control obstacle of each owner within a disc of controls.

    Args:
        segments: the table, in the plane; rows of one part one after another. owners: how many there are.
        inside: for controls (n, 2) whether they collide with each owner, (n, owners).
        center, radius: (2,) and > 0, the disc. tolerance: > 0, how far the result may be off, about; all in units of
            the control.

    Returns:
        For each owner a shapely Polygon or MultiPolygon, perhaps empty.
    """
    window = Window(np.asarray(center, dtype=np.float64), radius, tolerance)
    lines: list[list[Any]] = [[] for _ in range(owners)]
    found, owner = closed_lines(segments, window)
    for line, index in zip(found, owner):
        lines[index].append(line)
    for pieces, index in outlines(segments, window):
        lines[index].append(shapely.multilinestrings(shapely.linestrings(pieces)))
    count = int(np.ceil(2.0 * np.pi / arc_step(np.asarray(radius), tolerance)))
    angle = 2.0 * np.pi * np.arange(count + 1) / count
    angle[-1] = 0.0
    circle = shapely.linestrings(window.center + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    there = [index for index in range(owners) if lines[index]]
    faces = [_faces(lines[index], circle, window) for index in there]
    place = np.repeat(np.arange(len(there)), [len(part) for part in faces])
    every = np.concatenate(faces) if faces else np.empty(0, dtype=object)
    regions: list[Any] = [shapely.Polygon()] * owners
    if every.size:
        # Faces thinner than a quarter of the tolerance lie between two curves that are meant to be one.
        chosen = shapely.area(every) < tolerance / 8.0 * shapely.length(every)
        asked = np.flatnonzero(~chosen)
        blocked = inside(shapely.get_coordinates(shapely.point_on_surface(every[asked])))
        chosen[asked] = blocked[np.arange(len(asked)), np.array(there)[place[asked]]]
        for number, index in enumerate(there):
            taken = every[chosen & (place == number)]
            if taken.size:
                regions[index] = taken[0] if taken.size == 1 else shapely.coverage_union_all(taken)
    return regions


def _faces(lines: list[Any], circle: Any, window: Window) -> Any:
    """The faces within the window between the lines: (n,) polygons."""
    points = shapely.get_coordinates(lines)
    within = np.hypot(*(points - window.center).T).max() < window.radius - window.tolerance
    every = lines if within else [*lines, circle]
    faces, whole = _polygonized(shapely.unary_union(every))
    if not whole:
        # Curves on nearly the same line: a joint was lost to rounding, and with it a face. On a grid none is.
        faces, _ = _polygonized(shapely.unary_union(every, grid_size=GRID * window.tolerance))
    if within:
        return faces
    away = shapely.get_coordinates(shapely.point_on_surface(faces)) - window.center
    return faces[np.hypot(away[:, 0], away[:, 1]) < window.radius]


def _polygonized(noded: Any) -> tuple[Any, bool]:
    """The faces (n,) between lines that meet at their ends, and whether each line has one on both sides.

    All lines have that, being closed, but where rounding opened them.
    """
    faces, cuts, dangles, _ = shapely.polygonize_full(shapely.get_parts(noded))
    return shapely.get_parts(faces), bool(shapely.is_empty(cuts) and shapely.is_empty(dangles))


def closed_lines(segments: RelativeMotion, window: Window) -> tuple[Any, Indices]:
    """Lines around the elements of point parts (n,), closed but for what they run along in both directions.

    And their owners (n,). Coarse beyond the window.
    """
    nodes = point_nodes(segments, window, *rows_of_hull(segments, -1))
    heading, opening, n = nodes.discs.heading, nodes.discs.opening, len(nodes.run)
    if not n:
        return np.empty(0, dtype=object), np.empty(0, dtype=np.int64)
    head = np.diff(nodes.run, prepend=-1) != 0
    tail = np.append(head[1:], True)
    node, heads = np.arange(n), np.flatnonzero(head)
    # Forwards on the one side, backwards on the other, and to the first point again after a whole turn clockwise.
    index = np.concatenate([node, node, heads])
    angle = np.concatenate([heading + opening, heading - opening, (heading + opening)[heads] - 2.0 * np.pi])
    arc = np.concatenate([nodes.arc | tail, np.roll(nodes.arc, 1) | head, np.zeros(len(heads), dtype=bool)])
    order = np.lexsort((np.concatenate([node, 2 * n - node, np.full(len(heads), 3 * n)]), nodes.run[index]))
    index, angle, arc = index[order], angle[order], arc[order]
    points, ring = _with_arc_points(nodes, index, angle, arc, window)
    # To the bit closed: the angle of the last point is that of the first less 2 pi, with another rounding.
    first = np.flatnonzero(np.diff(ring, prepend=-1))
    points[np.append(first[1:], len(ring)) - 1] = points[first]
    # What is run along in both directions has the same on both sides.
    line = np.cumsum((np.diff(ring, prepend=-1) != 0) | np.append(False, _traversed_both_ways(points, ring)[:-1])) - 1
    longer = (np.bincount(line) > 1)[line]
    line = np.unique(line[longer], return_inverse=True)[1]
    starts = np.flatnonzero(np.diff(line, prepend=-1))
    return shapely.linestrings(points[longer], indices=line), nodes.owner[heads][ring[longer][starts]]


def _with_arc_points(nodes: Nodes, index: Indices, angle: Array, arc: Mask, window: Window) -> tuple[Array, Indices]:
    """Points (k, 2) on the discs index (n,) at the angles, arcs filled in between; and their runs (k,).

    What is filled in lies on the earlier disc, at multiples of one angle: where both sides run along the same arc they
    run along the same points.
    """
    center, size, _, _, _ = nodes.discs
    # Where pieces of a trajectory meet, the same disc up to rounding.
    moved = np.hypot(*np.diff(center, prepend=np.inf)) + abs(np.diff(size, prepend=0.0)) > GRID * window.tolerance
    one = np.maximum.accumulate(np.where(moved, np.arange(len(size)), 0))
    center, size = center[:, one], size[one]
    away = np.hypot(*(center - window.center[:, None])) - size > window.radius
    # A chord of a disc beyond the window stays beyond it.
    parts = np.ceil(2.0 * np.pi / np.where(away, 1.0, arc_step(size, window.tolerance))).astype(np.int64)
    disc = one[np.minimum(index, np.append(index[1:], index[-1:]))]
    sign = np.sign(np.append(np.diff(angle), 0.0))
    # Angles that grow when multiplied by the sign; the first and the last multiple strictly between them.
    low = sign * angle * parts[disc] / (2.0 * np.pi)
    high = np.append(sign[:-1] * angle[1:] * parts[disc[:-1]] / (2.0 * np.pi), 0.0)
    first = np.floor(low) + 1.0
    count = np.where(arc, np.ceil(high) - first, 0.0).clip(0.0).astype(np.int64) + 1
    source = np.repeat(np.arange(len(index)), count)
    number = np.arange(len(source)) - np.repeat(np.cumsum(count) - count, count)
    filled = number > 0
    place = np.where(filled, disc[source], index[source])
    multiple = (sign[source] * (first[source] + number - 1.0)).astype(np.int64) % parts[place]
    direction = np.where(filled, 2.0 * np.pi * multiple / parts[place], angle[source])
    points = center[:, place] + size[place] * np.stack([np.cos(direction), np.sin(direction)])
    # Beyond the window every so many points are enough: their chords do not come back.
    coarse = max(1, int(np.sqrt(0.4 * window.radius / window.tolerance)))
    near = np.hypot(*(points - window.center[:, None])) < 1.5 * window.radius
    keep = near | ~filled | (multiple % coarse == 0)
    return points.T[keep], nodes.run[index[source[keep]]]


def _traversed_both_ways(points: Array, ring: Indices) -> Mask:
    """Whether the chord from each point (k, 2) to the next one of its ring is run along backwards as well: (k,)."""
    a, b = points[:-1], points[1:]
    middle = (a + b).view(np.complex128)[:, 0]
    order = np.argsort(middle, kind="stable")
    new = (np.diff(middle[order]) != 0.0) | (np.diff(ring[:-1][order]) != 0)
    which = np.empty(len(order), dtype=np.int64)
    which[order] = np.cumsum(np.append(False, new))
    forth = (a[:, 0] < b[:, 0]) | ((a[:, 0] == b[:, 0]) & (a[:, 1] < b[:, 1]))
    back = np.bincount(which, np.where(forth, 1.0, -1.0))[which] == 0.0
    return np.append(back & (ring[1:] == ring[:-1]), False)
