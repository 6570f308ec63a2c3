"""Curves that bound the control obstacle of hulls in the plane: where outlines change from outward to inward motion.

An edge of a turning hull moves outwards on one side of a point and inwards on the other. The envelope consists of these
points, of the grazing points of the corners' discs, and of whole edges at the times at which they stop.
"""

from typing import NamedTuple

import numpy as np

from slalom.boundary.envelope import (
    Bends,
    Meets,
    Window,
    arc_step,
    chord_distance,
    discs_bend,
    halves,
    linked_rows,
    may_meet,
    rows_of_hull,
    sample,
)
from slalom.checks import Array
from slalom.kernels.arrays import Flags, Indices
from slalom.relative_motion import RelativeMotion
from slalom.tolerances import COARSE_NORMALS, MAX_ARC_POINTS, STILL


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


def outlines(segments: RelativeMotion, window: Window) -> list[tuple[Array, int]]:
    """Chords (n, 2, 2) that contain the boundary of the elements of hulls, with their owners.

    They are coarse outside the window.
    """
    linked, result = linked_rows(segments), []
    for hull in np.unique(segments.hull[segments.hull >= 0]):
        rows, control = rows_of_hull(segments, hull)
        shapes = edge_polygons(segments.corners[segments.first[hull] : segments.first[hull + 1]])
        meets = _hulls_meet(segments.bounding_radius[rows], shapes, window)
        spans = sample(rows, control, window, meets, _hulls_bend(shapes, window))
        same_row, joined = spans.continues(linked)
        for run in np.split(np.arange(len(same_row)), np.flatnonzero(~(same_row | joined))[1:]):
            if run.size:
                times = np.concatenate([spans.control[0][:, run], spans.control[3][:, run[-1:]]], axis=1)
                owner = int(segments.owner[spans.row[run[0]]])
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
