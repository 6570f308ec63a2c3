"""The curves that bound the control obstacle of hulls in the plane: where outlines stop between moving out and in.

An edge of a hull that turns moves outwards on one side of a point and inwards on the other. The envelope consists of
these points, of the grazing points of the corners' discs, and of whole edges at the times at which they stop.
"""

from typing import NamedTuple

import numpy as np

from slalom.boundary.envelope import (
    Bends,
    Indices,
    Mask,
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
from slalom.relative_motion import RelativeMotion
from slalom.tolerances import STILL

COARSE_STEP = 0.05  # [rad] between the normals of an outline beyond the window
MAX_ARC_POINTS = 65536  # most points on such an arc within it


def hull_indices(points: Array) -> Indices:
    """Indices of the corners of the convex hull of points (c, 2), counter-clockwise (Andrew's chain)."""
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
    """A rounded polygon by points: its corners, and the angles of its normals in its frame, counter-clockwise."""

    corners: Array  # (m, 5) as in the table
    normals: Array  # (m,) [rad]
    turns: bool  # whether the normals turn with the obstacle


def edge_polygons(corners: Array) -> list[tuple[Array, bool]]:
    """Polygons that each move as one and bear all edges of the hull of corners (c, 5), and whether they turn.

    The sum of a polygon that turns and one that does not has no outline of its own that moves on: but each of its edges
    is one of the first at a corner of the second, or the other way round.
    """
    fixed, turning = (np.unique(corners[:, axes], axis=0, return_inverse=True) for axes in ([0, 1], [3, 4]))
    result = []
    for (kinds, kind), axes, turns in ((turning, [0, 1], False), (fixed, [3, 4], True)):
        for number in range(len(kinds)):
            part = corners[kind.ravel() == number]
            part = part[hull_indices(part[:, axes])]
            if len(part) > 1 or len(corners) == 1:
                result.append((part, turns))
    return result[:1] if len(corners) == 1 else result


def outline(corners: Array, turns: bool, step: float) -> Outline:
    """The outline of the polygon (n, 5), its normals at most `step` [rad] apart."""
    if len(corners) == 1:
        return subdivided(
            Outline(corners[[0, 0]], np.array([0.0, np.pi]), turns), np.full(2, int(np.ceil(np.pi / step)))
        )
    places = corners[:, [3, 4] if turns else [0, 1]]
    edges = np.roll(places, -1, axis=0) - places
    after = np.arctan2(-edges[:, 0], edges[:, 1])
    turn = np.mod(after - np.roll(after, 1), 2.0 * np.pi)
    ends = Outline(np.repeat(corners, 2, axis=0), np.stack([after - turn, after], axis=1).ravel(), turns)
    count = np.ones(len(ends.normals), dtype=np.int64)
    count[::2] = np.ceil(turn / step).astype(np.int64).clip(1)
    return subdivided(ends, count)


def subdivided(shape: Outline, count: Indices) -> Outline:
    """The outline with each arc (m,) to the next point cut into `count`."""
    source = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(source)) - np.repeat(np.cumsum(count) - count, count)) / count[source]
    turn = np.mod(np.roll(shape.normals, -1) - shape.normals, 2.0 * np.pi)
    return Outline(shape.corners[source], shape.normals[source] + share * turn[source], shape.turns)


def resolved_outline(times: Array, shape: tuple[Array, bool], window: Window) -> Outline:
    """The outline as fine as it must be where it comes near the window at the times (6, k)."""
    rough = outline(*shape, COARSE_STEP)
    v, size = outline_controls(times, rough), times[3] / times[2]
    here, margin = window.center[:, None, None], 1.5 * window.radius + COARSE_STEP**2 * size[:, None]
    near = chord_distance(v, np.roll(v, -1, axis=2), here) < margin
    # An outline may pass the window between two times.
    passes = chord_distance(v[:, :-1], v[:, 1:], here) < np.maximum(margin[:-1], margin[1:])
    near[:-1] |= passes
    near[1:] |= passes
    near |= np.roll(near, -1, axis=1)
    need = np.where(near, COARSE_STEP / arc_step(size, window.tolerance)[:, None], 1.0).max(axis=0)
    arc = (rough.corners == np.roll(rough.corners, -1, axis=0)).all(axis=1)
    arc &= np.mod(np.roll(rough.normals, -1) - rough.normals, 2.0 * np.pi) < 1.5 * COARSE_STEP
    return subdivided(rough, np.where(arc, np.ceil(need).clip(1, MAX_ARC_POINTS), 1).astype(np.int64))


def outline_controls(control: Array, shape: Outline) -> Array:
    """Controls (2, k, m) of the points of an outline at k times, control (6, k)."""
    place, (gain, radius, ex, ey) = control[:2, :, None], control[2:, :, None]
    nx, ny = np.cos(shape.normals), np.sin(shape.normals)
    c, s = np.stack([ex, ey]) / np.hypot(ex, ey) if shape.turns else (np.ones_like(ex), np.zeros_like(ex))
    normal = np.stack([nx * c - ny * s, nx * s + ny * c])
    return np.asarray((place + _corner(np.stack([ex, ey]), shape.corners) + radius * normal) / gain)


def outlines(segments: RelativeMotion, window: Window) -> list[tuple[Array, int]]:
    """Chords (n, 2, 2) that hold the boundary of the elements of hulls, with their owners; coarse beyond the window."""
    linked, result = linked_rows(segments), []
    for hull in np.unique(segments.hull[segments.hull >= 0]):
        rows, control = rows_of_hull(segments, hull)
        shapes = edge_polygons(segments.corners[segments.first[hull] : segments.first[hull + 1]])
        meets = _hulls_meet(segments.bounding_radius[rows], shapes, window)
        spans = sample(rows, control, window, meets, _hulls_bend(shapes, window))
        same, joint = spans.continues(linked)
        for run in np.split(np.arange(len(same)), np.flatnonzero(~(same | joint))[1:]):
            if run.size:
                times = np.concatenate([spans.control[0][:, run], spans.control[3][:, run[-1:]]], axis=1)
                owner = int(segments.owner[spans.row[run[0]]])
                result += [(_sweep(times, resolved_outline(times, shape, window)), owner) for shape in shapes]
    return result


def _hulls_meet(reach: Array, shapes: list[tuple[Array, bool]], window: Window) -> Meets:
    """For `sample`: whether neither the circles around hulls nor the hulls themselves keep clear of the window."""
    return lambda which, control: may_meet(control, reach[which], window) & ~_separated(control, shapes, window)


def _separated(control: Array, shapes: list[tuple[Array, bool]], window: Window) -> Mask:
    """Whether a line parts the elements of spans (4, 6, k) from the window all the time: (k,)."""
    corners = np.concatenate([shape for shape, _ in shapes])
    place = np.stack([_corner(at[4:, :, None], corners) for at in control])
    # Control points of the corners (4, 2, k, c), seen from the middle of the window.
    place = place + (control[:, :2] - control[:, 2:3] * window.center[:, None])[..., None]
    wide = control[:, 3] + control[:, 2] * window.radius
    middle = place.mean(axis=0)
    # A polygon and a point are parted along an edge, or across the direction to a corner.
    after = np.concatenate([np.roll(np.arange(len(part)), -1) + start for part, start in _with_first_corner(shapes)])
    edges = middle[..., after] - middle
    across = np.concatenate([np.stack([-edges[1], edges[0]]), middle], axis=2)
    across = across / np.maximum(np.hypot(across[0], across[1]), 1e-300)
    least = np.matmul(np.moveaxis(place, 1, -1), np.moveaxis(across, 0, 1)).min(axis=2)
    return np.asarray((least > wide[..., None]).all(axis=0).any(axis=1))


def _with_first_corner(shapes: list[tuple[Array, bool]]) -> list[tuple[Array, int]]:
    """The polygons, each with the number of corners before it."""
    sizes = np.array([len(part) for part, _ in shapes])
    return [(part, int(start)) for (part, _), start in zip(shapes, np.cumsum(sizes) - sizes)]


def _corner(direction: Array, corners: Array) -> Array:
    """Corners (c, 5) relative to the part's origin for a direction (2, ..., 1): (2, ..., c)."""
    (ex, ey), (x, y, _, turning_x, turning_y) = direction, corners.T
    return np.stack([x + turning_x * ex - turning_y * ey, y + turning_x * ey + turning_y * ex])


def _hulls_bend(shapes: list[tuple[Array, bool]], window: Window) -> Bends:
    """For `sample`: whether the points of outlines leave their chords, or the envelope of a turning edge its own."""
    rough = [outline(*shape, 0.8) for shape in shapes]
    corners, disc_bends = np.unique(np.concatenate([part for part, _ in shapes]), axis=0), discs_bend(window)

    def discs(control: Array) -> Array:
        """The control points (4, 4, k * c) of the corners' discs."""
        discs = np.repeat(control[:, :4, :, None], len(corners), axis=3)
        discs[:, :2] += np.moveaxis(_corner(np.moveaxis(control[:, 4:, :, None], 1, 0), corners), 0, 1)
        return discs.reshape(4, 4, -1)

    def bends(control: Array, left: Array, right: Array) -> tuple[Mask, Mask]:
        here = window.center[:, None, None]
        times = (control[0], halves(left)[0][3], left[3], halves(right)[0][3], control[3])
        turns, stands = disc_bends(discs(control), discs(left), discs(right))
        bent = np.asarray((turns & ~stands).reshape(-1, len(corners)).any(axis=1))
        still = np.asarray(stands.reshape(-1, len(corners)).all(axis=1))
        for shape in rough:
            a, b, c, d, e = (outline_controls(at, shape) for at in times)
            off = np.maximum(np.maximum(chord_distance(a, e, b), chord_distance(a, e, d)), chord_distance(a, e, c))
            far = chord_distance(a, e, here) > window.radius + 4.0 * off
            still &= (np.hypot(*(e - a)) + off < STILL * window.tolerance).all(axis=1)
            # Between the places about which an edge turns, the envelope is as far from it as an arc.
            place = [_pivot(*_motion(*pair)) for pair in ((a, c), (c, e))]
            edges = [np.roll(at, -1, axis=2) - at for at in (a, e)]
            area = edges[0][0] * edges[1][1] - edges[0][1] * edges[1][0]
            rise = abs(place[1] - place[0]) * abs(area) / np.maximum(np.hypot(*edges[0]), 1e-300) / 4.0
            bent |= ((off > window.tolerance) & ~far).any(axis=1) | (rise > window.tolerance).any(axis=1)
        return bent, still

    return bends


def _motion(before: Array, after: Array) -> tuple[Array, Array]:
    """How far the ends of each edge move outwards, times its length: of outlines (2, k, m) to later ones."""
    moved, edge = after - before, np.roll(before + after, -1, axis=2) - before - after
    end = np.roll(moved, -1, axis=2)
    return moved[0] * edge[1] - moved[1] * edge[0], end[0] * edge[1] - end[1] * edge[0]


def _pivot(start: Array, end: Array) -> Array:
    """Share of an edge at which its motion outwards changes sign; 1 if it does not."""
    changes = (start > 0.0) != (end > 0.0)
    return np.where(changes, start / np.where(changes, start - end, 1.0), 1.0)


def _sweep(times: Array, shape: Outline) -> Array:
    """Where an outline turns from moving outwards to inwards, over times (6, k), and parts of the first and last one.

    The union is the first outline's inside and all that edges sweep outwards; where two such pieces of area meet, their
    borders cancel. What is left is closed.
    """
    v = outline_controls(times, shape)
    w = np.roll(v, -1, axis=2)
    motion = _motion(v[:, :-1], v[:, 1:])
    pivot = np.pad(_pivot(*motion), ((1, 1), (0, 0)), constant_values=1.0)
    # Before the first outline everything moves outwards, after the last one nothing does.
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
    every = np.concatenate(lines, axis=1).transpose(1, 2, 0)
    return np.asarray(every[(every[:, 0] != every[:, 1]).any(axis=1)])
