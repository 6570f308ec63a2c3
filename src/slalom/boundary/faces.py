"""Boundary of a control obstacle in the plane: faces between closed curves, each tested in the workspace.

The curves of `envelope.py` include the whole boundary and possibly more. They divide the window into faces that are
free or blocked as a whole, so one control of each face is tested.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from slalom.boundary.envelope import Nodes, Window, arc_step, point_nodes, rows_of_hull
from slalom.boundary.outline import outlines
from slalom.checks import Array
from slalom.kernels.arrays import Flags, Indices
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
    """Control obstacle of each owner within a disc of controls.

    Args:
        segments: the table, in the plane; rows of one part are consecutive.
        owners: number of owners.
        inside: for controls (n, 2) whether they collide with each owner, (n, owners).
        center, radius: (2,) and > 0, the disc.
        tolerance: > 0, approximate error of the result; all in units of the control.

    Returns:
        For each owner a shapely Polygon or MultiPolygon, possibly empty.
    """
    window = Window(np.asarray(center, dtype=np.float64), radius, tolerance)
    lines: list[list[Any]] = [[] for _ in range(owners)]
    closed, owner = closed_lines(segments, window)
    for line, index in zip(closed, owner):
        lines[index].append(line)
    for pieces, index in outlines(segments, window):
        lines[index].append(shapely.multilinestrings(shapely.linestrings(pieces)))
    count = int(np.ceil(2.0 * np.pi / arc_step(np.asarray(radius), tolerance)))
    angle = 2.0 * np.pi * np.arange(count + 1) / count
    angle[-1] = 0.0
    circle = shapely.linestrings(window.center + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    present = [index for index in range(owners) if lines[index]]
    faces = [_faces(lines[index], circle, window) for index in present]
    slot_of_face = np.repeat(np.arange(len(present)), [len(part) for part in faces])
    all_faces = np.concatenate(faces) if faces else np.empty(0, dtype=object)
    regions: list[Any] = [shapely.Polygon()] * owners
    if all_faces.size:
        # Faces thinner than a quarter of the tolerance lie between two approximations of one curve.
        selected = shapely.area(all_faces) < tolerance / 8.0 * shapely.length(all_faces)
        tested = np.flatnonzero(~selected)
        blocked = inside(shapely.get_coordinates(shapely.point_on_surface(all_faces[tested])))
        selected[tested] = blocked[np.arange(len(tested)), np.array(present)[slot_of_face[tested]]]
        for slot, index in enumerate(present):
            chosen = all_faces[selected & (slot_of_face == slot)]
            if chosen.size:
                regions[index] = chosen[0] if chosen.size == 1 else shapely.coverage_union_all(chosen)
    return regions


def _faces(lines: list[Any], circle: Any, window: Window) -> Any:
    """Faces (n,) within the window between the lines, as polygons."""
    points = shapely.get_coordinates(lines)
    within = np.hypot(*(points - window.center).T).max() < window.radius - window.tolerance
    all_lines = lines if within else [*lines, circle]
    faces, complete = _polygonized(shapely.unary_union(all_lines))
    if not complete:
        # Curves that nearly coincide: rounding lost a joint, and with it a face. Snapping to a grid restores it.
        faces, _ = _polygonized(shapely.unary_union(all_lines, grid_size=GRID * window.tolerance))
    if within:
        return faces
    offset = shapely.get_coordinates(shapely.point_on_surface(faces)) - window.center
    return faces[np.hypot(offset[:, 0], offset[:, 1]) < window.radius]


def _polygonized(noded: Any) -> tuple[Any, bool]:
    """Faces (n,) between lines that meet at their ends, and whether each line has one on both sides.

    Closed curves always do, except where rounding opened them.
    """
    faces, cuts, dangles, _ = shapely.polygonize_full(shapely.get_parts(noded))
    return shapely.get_parts(faces), bool(shapely.is_empty(cuts) and shapely.is_empty(dangles))


def closed_lines(segments: RelativeMotion, window: Window) -> tuple[Any, Indices]:
    """Lines (n,) around the elements of point parts, and their owners (n,); coarse outside the window.

    The lines are closed, except for parts that they traverse in both directions.
    """
    nodes = point_nodes(segments, window, *rows_of_hull(segments, -1))
    heading, opening, n = nodes.discs.heading, nodes.discs.opening, len(nodes.run)
    if not n:
        return np.empty(0, dtype=object), np.empty(0, dtype=np.int64)
    head = np.diff(nodes.run, prepend=-1) != 0
    tail = np.append(head[1:], True)
    node, heads = np.arange(n), np.flatnonzero(head)
    # Forwards on one side, backwards on the other, and after a full clockwise turn to the first point.
    index = np.concatenate([node, node, heads])
    angle = np.concatenate([heading + opening, heading - opening, (heading + opening)[heads] - 2.0 * np.pi])
    arc = np.concatenate([nodes.arc | tail, np.roll(nodes.arc, 1) | head, np.zeros(len(heads), dtype=bool)])
    order = np.lexsort((np.concatenate([node, 2 * n - node, np.full(len(heads), 3 * n)]), nodes.run[index]))
    index, angle, arc = index[order], angle[order], arc[order]
    points, curve = _with_arc_points(nodes, index, angle, arc, window)
    # Close exactly: the angle of the last point is that of the first minus 2 pi, with other rounding.
    first = np.flatnonzero(np.diff(curve, prepend=-1))
    points[np.append(first[1:], len(curve)) - 1] = points[first]
    # Parts traversed in both directions have the same face on both sides.
    line = np.cumsum((np.diff(curve, prepend=-1) != 0) | np.append(False, _traversed_both_ways(points, curve)[:-1])) - 1
    nondegenerate = (np.bincount(line) > 1)[line]
    line = np.unique(line[nondegenerate], return_inverse=True)[1]
    starts = np.flatnonzero(np.diff(line, prepend=-1))
    return shapely.linestrings(points[nondegenerate], indices=line), nodes.owner[heads][curve[nondegenerate][starts]]


def _with_arc_points(nodes: Nodes, index: Indices, angle: Array, arc: Flags, window: Window) -> tuple[Array, Indices]:
    """Points (k, 2) on the discs `index` (n,) at the angles (n,), with arcs filled in, and their runs (k,).

    Arc points lie on the earlier disc at multiples of one angle, so that both sides use the same points on a common
    arc.
    """
    center, radius, _, _, _ = nodes.discs
    # The same disc up to rounding where pieces of a trajectory join.
    moved = np.hypot(*np.diff(center, prepend=np.inf)) + abs(np.diff(radius, prepend=0.0)) > GRID * window.tolerance
    representative = np.maximum.accumulate(np.where(moved, np.arange(len(radius)), 0))
    center, radius = center[:, representative], radius[representative]
    outside = np.hypot(*(center - window.center[:, None])) - radius > window.radius
    # A chord of a disc outside the window stays outside it.
    divisions = np.ceil(2.0 * np.pi / np.where(outside, 1.0, arc_step(radius, window.tolerance))).astype(np.int64)
    disc = representative[np.minimum(index, np.append(index[1:], index[-1:]))]
    sign = np.sign(np.append(np.diff(angle), 0.0))
    # Angles times the sign increase; the first and the last multiple strictly between them.
    first_exact = sign * angle * divisions[disc] / (2.0 * np.pi)
    last_exact = np.append(sign[:-1] * angle[1:] * divisions[disc[:-1]] / (2.0 * np.pi), 0.0)
    first = np.floor(first_exact) + 1.0
    count = np.where(arc, np.ceil(last_exact) - first, 0.0).clip(0.0).astype(np.int64) + 1
    source = np.repeat(np.arange(len(index)), count)
    number = np.arange(len(source)) - np.repeat(np.cumsum(count) - count, count)
    filled = number > 0
    disc_of_point = np.where(filled, disc[source], index[source])
    multiple = (sign[source] * (first[source] + number - 1.0)).astype(np.int64) % divisions[disc_of_point]
    direction = np.where(filled, 2.0 * np.pi * multiple / divisions[disc_of_point], angle[source])
    points = center[:, disc_of_point] + radius[disc_of_point] * np.stack([np.cos(direction), np.sin(direction)])
    # Outside the window fewer points suffice: their chords stay outside.
    coarse = max(1, int(np.sqrt(0.4 * window.radius / window.tolerance)))
    near = np.hypot(*(points - window.center[:, None])) < 1.5 * window.radius
    keep = near | ~filled | (multiple % coarse == 0)
    return points.T[keep], nodes.run[index[source[keep]]]


def _traversed_both_ways(points: Array, curve: Indices) -> Flags:
    """Whether the chord from each point (k, 2) to the next one of its curve is also traversed backwards: (k,)."""
    a, b = points[:-1], points[1:]
    middle = (a + b).view(np.complex128)[:, 0]
    order = np.argsort(middle, kind="stable")
    new = (np.diff(middle[order]) != 0.0) | (np.diff(curve[:-1][order]) != 0)
    group = np.empty(len(order), dtype=np.int64)
    group[order] = np.cumsum(np.append(False, new))
    forwards = (a[:, 0] < b[:, 0]) | ((a[:, 0] == b[:, 0]) & (a[:, 1] < b[:, 1]))
    cancelled = np.bincount(group, np.where(forwards, 1.0, -1.0))[group] == 0.0
    return np.append(cancelled & (curve[1:] == curve[:-1]), False)
