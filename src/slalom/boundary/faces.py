"""The boundary of a control obstacle in the plane: faces between closed curves, each decided in the workspace.

The curves of `envelope.py` may hold more than the boundary, never less: they cut the window into faces that are free
or blocked as a whole, and one control of each is asked for.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from slalom.boundary.envelope import Indices, Mask, Nodes, Window, arc_step, parts, point_nodes
from slalom.boundary.outline import outlines
from slalom.checks import Array
from slalom.segments import Segments
from slalom.tolerances import GRID


def boundary(
    segments: Segments,
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
    found, owner = rings(segments, window)
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
    faces, whole = _between(shapely.unary_union(every))
    if not whole:
        # Curves on nearly the same line: a joint was lost to rounding, and with it a face. On a grid none is.
        faces, _ = _between(shapely.unary_union(every, grid_size=GRID * window.tolerance))
    if within:
        return faces
    away = shapely.get_coordinates(shapely.point_on_surface(faces)) - window.center
    return faces[np.hypot(away[:, 0], away[:, 1]) < window.radius]


def _between(noded: Any) -> tuple[Any, bool]:
    """The faces (n,) between lines that meet at their ends, and whether each line has one on both sides.

    All lines have that, being closed, but where rounding opened them.
    """
    faces, cuts, dangles, _ = shapely.polygonize_full(shapely.get_parts(noded))
    return shapely.get_parts(faces), bool(shapely.is_empty(cuts) and shapely.is_empty(dangles))


def rings(segments: Segments, window: Window) -> tuple[Any, Indices]:
    """Closed lines around the elements of point parts (n,), and their owners (n,). Coarse beyond the window."""
    nodes = point_nodes(segments, window, *parts(segments, -1))
    heading, opening, n = nodes.touch.heading, nodes.touch.opening, len(nodes.run)
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
    points, ring = _filled(nodes, index, angle, arc, window)
    # To the bit closed: the angle of the last point is that of the first less 2 pi, with another rounding.
    first = np.flatnonzero(np.diff(ring, prepend=-1))
    points[np.append(first[1:], len(ring)) - 1] = points[first]
    return shapely.linestrings(points, indices=ring), nodes.owner[heads]


def _filled(nodes: Nodes, index: Indices, angle: Array, arc: Mask, window: Window) -> tuple[Array, Indices]:
    """Points (k, 2) on the discs index (n,) at the angles, arcs filled in between; and their runs (k,)."""
    center, size, _, _, _ = nodes.touch
    away = np.hypot(*(center - window.center[:, None])) - size > window.radius
    # A chord of a disc beyond the window stays beyond it.
    step = np.where(away, 1.0, arc_step(size, window.tolerance))[index]
    turn = np.append(np.diff(angle), 0.0)
    count = np.where(arc, np.ceil(abs(turn) / step), 1.0).astype(np.int64).clip(1)
    source = np.repeat(np.arange(len(index)), count)
    number = np.arange(len(source)) - np.repeat(np.cumsum(count) - count, count)
    share = number / count[source]
    after = np.minimum(source + 1, len(index) - 1)
    place = center[:, index[source]] * (1.0 - share) + center[:, index[after]] * share
    reach = size[index[source]] * (1.0 - share) + size[index[after]] * share
    direction = angle[source] + share * turn[source]
    points = place + reach * np.stack([np.cos(direction), np.sin(direction)])
    # Beyond the window every so many points are enough: their chords do not come back.
    coarse = max(1, int(np.sqrt(0.4 * window.radius / window.tolerance)))
    near = np.hypot(*(points - window.center[:, None])) < 1.5 * window.radius
    keep = near | (number % coarse == 0)
    return points.T[keep], nodes.run[index[source[keep]]]
