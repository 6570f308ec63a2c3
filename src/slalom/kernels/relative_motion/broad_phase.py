"""Broad phase of a choice: the segments on which a control within some distance of a given one can collide.

During a segment, a change of the control by r moves the robot by at most r times the largest gain of that segment. One
pass of the chord test at one control therefore bounds, for every segment, the distance of the controls that may collide
on it. Most segments never matter; the rows of the others are copied, and later passes run over these.
"""

from typing import NamedTuple

import numpy as np

from slalom.kernels.arrays import Array, Hulls, Indices, MaybeHulls, Segments, Workspace
from slalom.kernels.geometry.hull_bounds import least_along, put_separating
from slalom.kernels.geometry.hulls import MovingHull, hull_distance, load_path
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.relative_motion.segments import chord_distances
from slalom.kernels.squared import squared


class Culled(NamedTuple):
    """The rows of a table that may matter, and the distance from `center` of the controls that may collide on each."""

    table: Segments
    rows: Indices  # (c,)
    away: Array  # (c,) at least, in units of the control; inf for rows that were copied
    center: Array  # (3,) a control


@inlined
def is_clear(table: Segments, u: Array, gaps: Array) -> bool:
    """Whether the chord test alone shows that control u (3,) is collision-free; its distances go into gaps (n,) [m]."""
    chord_distances(table.points, table.gains, u[0], u[1], u[2], gaps)
    near = 0
    for s in range(len(gaps)):
        near += gaps[s] < table.bounding_radius[s]
    return near == 0


@inlined
def cull(table: Segments, gaps: Array, farthest: float, rows: Indices) -> int:
    """The number of segments on which controls within `farthest` may collide; their rows go into `rows` (n,).

    `gaps` (n,) holds the distances of the chord test. Its first entries become the distances of those controls.
    """
    count, gains = 0, table.gains
    for s in range(len(gaps)):
        gain = max(max(gains[0, s], gains[1, s]), max(gains[2, s], gains[3, s]))
        gap = gaps[s] - table.bounding_radius[s]
        rows[count], gaps[count] = s, gap / gain
        count += gap < farthest * gain
    return count


@kernel
def new_table(count: int) -> Segments:
    """An empty table for `count` segments."""
    points, gains, lines = np.empty((4, 3, count)), np.empty((4, count)), np.empty((3, count))
    return Segments(points, gains, lines[0], lines[1], lines[2])


@kernel
def new_hulls(count: int, hulls: MaybeHulls) -> MaybeHulls:
    """Empty rows for `count` segments with the corners of `hulls`; empty where there are none."""
    if len(hulls) == 0:
        return ()
    turns = np.empty((4, 2, count if hulls.turns.shape[2] > 0 else 0))
    return Hulls(np.empty(count, np.int64), turns, hulls.corners, hulls.first, hulls.unordered)


@inlined
def copy_near(
    culled: Culled, hulls: MaybeHulls, limit: float, near: Segments, near_hulls: MaybeHulls, count: int, work: Workspace
) -> int:
    """Copy the segments on which controls within `limit` of the centre may collide, unless they were copied before.

    They go into `near` and `near_hulls` from row `count` on, and directions that separate their hulls from the
    centre into `work.separating`. Returns the number of rows there.
    """
    table, away = culled.table, culled.away
    for c in range(len(culled.rows)):
        if not away[c] < limit:
            continue
        s = culled.rows[c]
        if len(hulls) > 0 and hulls.hull[s] >= 0:
            # A long wall may be out of reach although the disc about it is not.
            load_path(table, hulls, s, culled.center, work.path)
            hull = MovingHull(work.path, hulls, hulls.hull[s], table.radius[s], table.growth[s])
            gains, separating = table.gains[:, s], work.separating[count]
            put_separating(hull, gains, culled.center, hull_distance(hull, 0.5, work.corners), separating)
            gain = max(max(gains[0], gains[1]), max(gains[2], gains[3]))
            away[c] = max(away[c], least_along(separating, gains, culled.center) / gain)
            if not away[c] < limit:
                continue
        copy_row(table, hulls, s, near, near_hulls, count)
        away[c] = np.inf
        count += 1
    return count


@kernel
def copy_row(table: Segments, hulls: MaybeHulls, s: int, near: Segments, near_hulls: MaybeHulls, count: int) -> None:
    """Copy row s of a table into row `count` of another."""
    for j in range(4):
        near.gains[j, count] = table.gains[j, s]
        for axis in range(3):
            near.points[j, axis, count] = table.points[j, axis, s]
    near.radius[count], near.growth[count] = table.radius[s], table.growth[s]
    near.bounding_radius[count] = table.bounding_radius[s]
    if len(hulls) > 0 and len(near_hulls) > 0:
        near_hulls.hull[count] = hulls.hull[s]
        for j in range(4):
            for axis in range(2 if hulls.turns.shape[2] > 0 else 0):
                near_hulls.turns[j, axis, count] = hulls.turns[j, axis, s]


@kernel
def distance(a: Array, b: Array) -> float:
    """The distance between two points (3,)."""
    return float(np.sqrt(squared(a[0] - b[0]) + squared(a[1] - b[1]) + squared(a[2] - b[2])))
