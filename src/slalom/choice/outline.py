"""Curves that bound the control obstacle of hulls in the plane: where outlines change from outward to inward motion.

An edge of a turning hull moves outwards on one side of a point and inwards on the other. The envelope consists of these
points, of the grazing points of the corners' discs, and of whole edges at the times at which they stop.
"""

from collections.abc import Callable
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely

from slalom.base.checks import Array
from slalom.base.tolerances import STILL
from slalom.choice.envelope import (
    Bends,
    Meets,
    Nodes,
    RelativeMotion,
    Window,
    arc_step,
    chord_distance,
    discs_bend,
    halves,
    linked_rows,
    may_meet,
    point_nodes,
    rows_of_hull,
    sample,
)
from slalom.kernels.arrays import Flags, Indices

COARSE_NORMALS: Final = 0.05
"""[rad] Angle between the normals of an outline outside the window of a boundary. Larger: a far outline that crosses
the window may be missed. Smaller: more points that are not drawn."""

MAX_ARC_POINTS: Final = 65536
"""[1] Largest number of points on such an arc within the window. Larger: more memory where a huge radius meets a small
tolerance. Smaller: the boundary there is off by more than its tolerance."""


def hull_indices(points: Array) -> Indices:
    """Indices of the corners of the convex hull of points (c, 2), counter-clockwise (Andrew's monotone chain)."""
    _, distinct = np.unique(points, axis=0, return_index=True)
    if len(distinct) < 2:
        return distinct
    corners: list[np.int64] = []
    for ordered in (distinct, distinct[::-1]):
        chain: list[np.int64] = []
        for index in ordered:
            while len(chain) > 1:
                (ax, ay), (bx, by) = points[chain[-1]] - points[chain[-2]], points[index] - points[chain[-1]]
                if ax * by - ay * bx > 0.0:
                    break
                chain.pop()
            chain.append(index)
        corners += chain[:-1]
    return np.array(corners)


class Outline(NamedTuple):
    """Rounded polygon by points: its corners, and the angles of its normals in its frame, counter-clockwise."""

    corners: Array  # (m, 5) as in the table
    normals: Array  # (m,) [rad]
    turns: bool  # whether the normals turn with the obstacle


def edge_polygons(corners: Array) -> list[tuple[Array, bool]]:
    """Polygons (n, 5) that each move rigidly and carry all edges of the hull of corners (c, 5), and whether they turn.

    The sum of a turning and a fixed polygon does not move rigidly. But each of its edges is an edge of the first at a
    corner of the second, or vice versa.
    """
    fixed, turning = (np.unique(corners[:, axes], axis=0, return_inverse=True) for axes in ([0, 1], [3, 4]))
    result = []
    for (kinds, kind), axes, turns in ((turning, [0, 1], False), (fixed, [3, 4], True)):
        for index in range(len(kinds)):
            part = corners[kind.ravel() == index]
            part = part[hull_indices(part[:, axes])]
            if len(part) > 1 or len(corners) == 1:
                result.append((part, turns))
    return result[:1] if len(corners) == 1 else result


def outline(corners: Array, turns: bool, step: float) -> Outline:
    """Outline of the polygon (n, 5), with normals at most `step` [rad] apart."""
    if len(corners) == 1:
        return subdivided(
            Outline(corners[[0, 0]], np.array([0.0, np.pi]), turns), np.full(2, int(np.ceil(np.pi / step)))
        )
    positions = corners[:, [3, 4] if turns else [0, 1]]
    edges = np.roll(positions, -1, axis=0) - positions
    edge_angles = np.arctan2(-edges[:, 0], edges[:, 1])
    exterior_angles = np.mod(edge_angles - np.roll(edge_angles, 1), 2.0 * np.pi)
    ends = Outline(
        np.repeat(corners, 2, axis=0), np.stack([edge_angles - exterior_angles, edge_angles], axis=1).ravel(), turns
    )
    count = np.ones(len(ends.normals), dtype=np.int64)
    count[::2] = np.ceil(exterior_angles / step).astype(np.int64).clip(1)
    return subdivided(ends, count)


def subdivided(shape: Outline, count: Indices) -> Outline:
    """Outline with each arc (m,) to the next point divided into `count` parts."""
    source = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(source)) - np.repeat(np.cumsum(count) - count, count)) / count[source]
    turn = np.mod(np.roll(shape.normals, -1) - shape.normals, 2.0 * np.pi)
    return Outline(shape.corners[source], shape.normals[source] + share * turn[source], shape.turns)


def resolved_outline(times: Array, shape: tuple[Array, bool], window: Window) -> Outline:
    """Outline that is as fine as necessary where it comes near the window at the times (6, k)."""
    coarse = outline(*shape, COARSE_NORMALS)
    v, radius = outline_controls(times, coarse), times[3] / times[2]
    center, margin = window.center[:, None, None], 1.5 * window.radius + COARSE_NORMALS**2 * radius[:, None]
    near = chord_distance(v, np.roll(v, -1, axis=2), center) < margin
    # An outline may cross the window between two times.
    crosses = chord_distance(v[:, :-1], v[:, 1:], center) < np.maximum(margin[:-1], margin[1:])
    near[:-1] |= crosses
    near[1:] |= crosses
    near |= np.roll(near, -1, axis=1)
    divisions = np.where(near, COARSE_NORMALS / arc_step(radius, window.tolerance)[:, None], 1.0).max(axis=0)
    arc = (coarse.corners == np.roll(coarse.corners, -1, axis=0)).all(axis=1)
    arc &= np.mod(np.roll(coarse.normals, -1) - coarse.normals, 2.0 * np.pi) < 1.5 * COARSE_NORMALS
    return subdivided(coarse, np.where(arc, np.ceil(divisions).clip(1, MAX_ARC_POINTS), 1).astype(np.int64))


def outline_controls(control: Array, shape: Outline) -> Array:
    """Controls (2, k, m) of the points of an outline at k times, control (6, k)."""
    position, (gain, radius, ex, ey) = control[:2, :, None], control[2:, :, None]
    nx, ny = np.cos(shape.normals), np.sin(shape.normals)
    c, s = np.stack([ex, ey]) / np.hypot(ex, ey) if shape.turns else (np.ones_like(ex), np.zeros_like(ex))
    normal = np.stack([nx * c - ny * s, nx * s + ny * c])
    return np.asarray((position + _corner(np.stack([ex, ey]), shape.corners) + radius * normal) / gain)


def outlines(motion: RelativeMotion, window: Window) -> list[tuple[Array, int]]:
    """Chords (n, 2, 2) that contain the boundary of the elements of hulls, with their owners.

    They are coarse outside the window.
    """
    hulls = motion.hulls
    linked, result = linked_rows(motion), []
    for hull in np.unique(hulls.hull[hulls.hull >= 0]):
        rows, control = rows_of_hull(motion, hull)
        shapes = edge_polygons(hulls.corners[hulls.first[hull] : hulls.first[hull + 1]])
        meets = _hulls_meet(motion.table.bounding_radius[rows], shapes, window)
        spans = sample(rows, control, window, meets, _hulls_bend(shapes, window))
        same_row, joined = spans.continues(linked)
        for run in np.split(np.arange(len(same_row)), np.flatnonzero(~(same_row | joined))[1:]):
            if run.size:
                times = np.concatenate([spans.control[0][:, run], spans.control[3][:, run[-1:]]], axis=1)
                owner = int(motion.owner[spans.row[run[0]]])
                result += [(_sweep(times, resolved_outline(times, shape, window)), owner) for shape in shapes]
    return result


def _hulls_meet(bounding_radius: Array, shapes: list[tuple[Array, bool]], window: Window) -> Meets:
    """Test for `sample`: whether the bounding circles of hulls or the hulls themselves may overlap the window."""
    return lambda which, control: (
        may_meet(control, bounding_radius[which], window) & ~_separated(control, shapes, window)
    )


def _separated(control: Array, shapes: list[tuple[Array, bool]], window: Window) -> Flags:
    """Whether a line separates the elements of spans (4, 6, k) from the window at all times: (k,)."""
    corners = np.concatenate([shape for shape, _ in shapes])
    position = np.stack([_corner(at[4:, :, None], corners) for at in control])
    # Control points of the corners (4, 2, k, c), relative to the centre of the window.
    position = position + (control[:, :2] - control[:, 2:3] * window.center[:, None])[..., None]
    margin = control[:, 3] + control[:, 2] * window.radius
    mean_position = position.mean(axis=0)
    # A polygon and a point are separated along an edge, or across the direction to a corner.
    next_corner = np.concatenate(
        [np.roll(np.arange(len(part)), -1) + start for part, start in _with_first_corner(shapes)]
    )
    edges = mean_position[..., next_corner] - mean_position
    normals = np.concatenate([np.stack([-edges[1], edges[0]]), mean_position], axis=2)
    normals = normals / np.maximum(np.hypot(normals[0], normals[1]), 1e-300)
    min_distance = np.matmul(np.moveaxis(position, 1, -1), np.moveaxis(normals, 0, 1)).min(axis=2)
    return np.asarray((min_distance > margin[..., None]).all(axis=0).any(axis=1))


def _with_first_corner(shapes: list[tuple[Array, bool]]) -> list[tuple[Array, int]]:
    """Polygons with the number of corners before each."""
    sizes = np.array([len(part) for part, _ in shapes])
    return [(part, int(start)) for (part, _), start in zip(shapes, np.cumsum(sizes) - sizes)]


def _corner(direction: Array, corners: Array) -> Array:
    """Corners (c, 5) relative to the part's origin for a direction (2, ..., 1): (2, ..., c)."""
    (ex, ey), (x, y, _, turning_x, turning_y) = direction, corners.T
    return np.stack([x + turning_x * ex - turning_y * ey, y + turning_x * ey + turning_y * ex])


def _hulls_bend(shapes: list[tuple[Array, bool]], window: Window) -> Bends:
    """Test for `sample`: whether points of outlines, or the envelopes of turning edges, leave their chords."""
    coarse = [outline(*shape, 0.8) for shape in shapes]
    corners, disc_bends = np.unique(np.concatenate([part for part, _ in shapes]), axis=0), discs_bend(window)

    def discs(control: Array) -> Array:
        """The control points (4, 4, k * c) of the corners' discs."""
        discs = np.repeat(control[:, :4, :, None], len(corners), axis=3)
        discs[:, :2] += np.moveaxis(_corner(np.moveaxis(control[:, 4:, :, None], 1, 0), corners), 0, 1)
        return discs.reshape(4, 4, -1)

    def bends(control: Array, left: Array, right: Array) -> tuple[Flags, Flags]:
        center = window.center[:, None, None]
        times = (control[0], halves(left)[0][3], left[3], halves(right)[0][3], control[3])
        turns, stands = disc_bends(discs(control), discs(left), discs(right))
        bent = np.asarray((turns & ~stands).reshape(-1, len(corners)).any(axis=1))
        still = np.asarray(stands.reshape(-1, len(corners)).all(axis=1))
        for shape in coarse:
            a, b, c, d, e = (outline_controls(at, shape) for at in times)
            off = np.maximum(np.maximum(chord_distance(a, e, b), chord_distance(a, e, d)), chord_distance(a, e, c))
            far = chord_distance(a, e, center) > window.radius + 4.0 * off
            still &= (np.hypot(*(e - a)) + off < STILL * window.tolerance).all(axis=1)
            # Between the pivots of an edge, the envelope is as far from it as an arc.
            pivots = [_pivot(*_motion(*pair)) for pair in ((a, c), (c, e))]
            edges = [np.roll(at, -1, axis=2) - at for at in (a, e)]
            area = edges[0][0] * edges[1][1] - edges[0][1] * edges[1][0]
            rise = abs(pivots[1] - pivots[0]) * abs(area) / np.maximum(np.hypot(*edges[0]), 1e-300) / 4.0
            bent |= ((off > window.tolerance) & ~far).any(axis=1) | (rise > window.tolerance).any(axis=1)
        return bent, still

    return bends


def _motion(before: Array, after: Array) -> tuple[Array, Array]:
    """Outward displacements of the ends of each edge, times its length, from outlines (2, k, m) to later ones."""
    moved, edge = after - before, np.roll(before + after, -1, axis=2) - before - after
    end = np.roll(moved, -1, axis=2)
    return moved[0] * edge[1] - moved[1] * edge[0], end[0] * edge[1] - end[1] * edge[0]


def _pivot(start: Array, end: Array) -> Array:
    """Fraction of an edge at which its outward motion changes sign; 1 if it does not."""
    changes = (start > 0.0) != (end > 0.0)
    return np.where(changes, start / np.where(changes, start - end, 1.0), 1.0)


def _sweep(times: Array, shape: Outline) -> Array:
    """Chords (n, 2, 2) where an outline changes from outward to inward motion over times (6, k).

    Includes parts of the first and the last outline. The union is the interior of the first outline and the area that
    edges sweep outwards. Where two such areas meet, their boundaries cancel; the rest is closed.
    """
    v = outline_controls(times, shape)
    w = np.roll(v, -1, axis=2)
    motion = _motion(v[:, :-1], v[:, 1:])
    pivot = np.pad(_pivot(*motion), ((1, 1), (0, 0)), constant_values=1.0)
    # Before the first outline every edge moves outwards, after the last one none does.
    start, end = (np.pad(part > 0.0, ((1, 1), (0, 0)), constant_values=False) for part in motion)
    start[0] = end[0] = True

    def at(share: Array, rows: slice = slice(None)) -> Array:
        a, b = v[:, rows], w[:, rows]
        return np.where(share == 1.0, b, a + share * (b - a))

    low, high = np.minimum(pivot[:-1], pivot[1:]), np.maximum(pivot[:-1], pivot[1:])
    earlier = np.where(pivot[:-1] < pivot[1:], end[:-1], start[:-1])
    later = np.where(pivot[1:] < pivot[:-1], end[1:], start[1:])
    marks = [at(share) for share in (np.zeros_like(low), low, high, np.ones_like(low))]
    differs = (start[1:] != start[:-1], earlier != later, end[1:] != end[:-1])
    lines = [np.stack([a[:, d], b[:, d]], axis=-1) for a, b, d in zip(marks, marks[1:], differs)]
    inner, share = (start != end)[1:-1], pivot[1:-1]
    across = (np.roll(end, 1, axis=1) != start)[1:-1]
    lines += [
        np.stack([at(share, slice(None, -1))[:, inner], at(share, slice(1, None))[:, inner]], axis=-1),
        np.stack([v[:, :-1][:, across], v[:, 1:][:, across]], axis=-1),
    ]
    chords = np.concatenate(lines, axis=1).transpose(1, 2, 0)
    return np.asarray(chords[(chords[:, 0] != chords[:, 1]).any(axis=1)])


# Boundary of a control obstacle in the plane: faces between closed curves, each tested in the workspace.
#
# The curves of `envelope.py` include the whole boundary and possibly more. They divide the window into faces that are
# free or blocked as a whole, so one control of each face is tested.


GRID: Final = 1e-3
"""[1] The grid on which curves of a boundary meet, as a share of its tolerance. Larger: corners move by as much.
Smaller: below the rounding of a crossing, faces stay open and are lost."""


def boundary(
    motion: RelativeMotion,
    owners: int,
    inside: Callable[[Array], npt.NDArray[np.bool_]],
    center: Array,
    radius: float,
    tolerance: float,
) -> list[Any]:
    """Control obstacle of each owner within a disc of controls.

    Args:
        motion: in the plane; rows of one part are consecutive.
        owners: number of owners.
        inside: for controls (n, 2) whether they collide with each owner, (n, owners).
        center, radius: (2,) and > 0, the disc.
        tolerance: > 0, approximate error of the result; all in units of the control.

    Returns:
        For each owner a shapely Polygon or MultiPolygon, possibly empty.
    """
    window = Window(np.asarray(center, dtype=np.float64), radius, tolerance)
    lines: list[list[Any]] = [[] for _ in range(owners)]
    closed, owner = closed_lines(motion, window)
    for line, index in zip(closed, owner):
        lines[index].append(line)
    for pieces, index in outlines(motion, window):
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


def closed_lines(motion: RelativeMotion, window: Window) -> tuple[Any, Indices]:
    """Lines (n,) around the elements of point parts, and their owners (n,); coarse outside the window.

    The lines are closed, except for parts that they traverse in both directions.
    """
    nodes = point_nodes(motion, window, *rows_of_hull(motion, -1))
    heading = nodes.discs.heading
    opening = nodes.discs.opening
    n = len(nodes.run)
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
    index = index[order]
    angle = angle[order]
    arc = arc[order]
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
