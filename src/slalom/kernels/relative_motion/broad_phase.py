"""Which segments a choice has to do with: those that a control within some distance of a given one can collide on.

Moving the control by r moves the robot, at any time of a segment, by at most r times the largest gain of that segment.
One pass of the chord test at one control therefore tells of every segment how far away the controls are that may
collide on it. Most never matter; rows of the others are copied, so that later passes run over these only.
"""

from typing import TypeAlias

import numpy as np

from slalom.kernels.arrays import Array, Indices, MaybeHulls
from slalom.kernels.geometry.hulls import distance_bound, hull_distance, load_path
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.relative_motion.segments import chord_distances

Table: TypeAlias = tuple[Array, Array, Array, Array, Array]
"""points, gains, radius, growth, reach: see `slalom.relative_motion`; their hulls go apart."""


@inlined
def is_clear(points: Array, gains: Array, reach: Array, u: Array, gaps: Array) -> bool:
    """Whether the chord test alone shows that control u is free; the chord test's distances go into gaps."""
    chord_distances(points, gains, u[0], u[1], u[2], gaps)
    near = 0
    for s in range(len(gaps)):
        near += gaps[s] < reach[s]
    return near == 0


@inlined
def cull(gains: Array, reach: Array, gaps: Array, farthest: float, which: Indices) -> int:
    """How many segments controls within `farthest` may collide on; their numbers go into which, and into the first
    rows of gaps how far away these controls are at least. `gaps` holds the distances of the chord test."""
    count = 0
    for s in range(len(gaps)):
        gain = max(max(gains[0, s], gains[1, s]), max(gains[2, s], gains[3, s]))
        gap = gaps[s] - reach[s]
        which[count], gaps[count] = s, gap / gain
        count += gap < farthest * gain
    return count


@kernel
def new_table(count: int, hulls: MaybeHulls) -> tuple[Table, MaybeHulls]:
    """A table with room for so many segments, and their hulls."""
    points, gains, around = np.empty((4, 3, count)), np.empty((4, count)), np.empty((3, count))
    return (points, gains, around[0], around[1], around[2]), new_hulls(count, hulls)


@kernel
def new_hulls(count: int, hulls: MaybeHulls) -> MaybeHulls:
    """The hulls of that table; nothing where there are none."""
    if len(hulls) == 0:
        return ()
    turned = np.empty((4, 2, count if hulls[1].shape[2] > 0 else 0))
    return np.empty(count, np.int64), turned, hulls[2], hulls[3], hulls[4]


@inlined
def copy_near(
    table: Table,
    hulls: MaybeHulls,
    which: Indices,
    away: Array,
    limit: float,
    center: Array,
    near: Table,
    near_hulls: MaybeHulls,
    count: int,
    course: Array,
    q: Array,
) -> int:
    """Copy the segments that controls within `limit` of `center` may collide on, and that were not copied yet.

    They go into `near` from row `count` on; returns the number of its rows. `which` and `away` are of `within`.
    """
    points, gains, radius, growth, _ = table
    for c in range(len(which)):
        if not away[c] < limit:
            continue
        s = which[c]
        if len(hulls) > 0 and hulls[0][s] >= 0:
            # A long wall may be out of reach although the disc about it is not.
            h = hulls[0][s]
            load_path(points, gains, hulls, s, center, course)
            _, vx, vy, vz = hull_distance(course, hulls, h, radius[s], growth[s], 0.5, q)
            gain = max(max(gains[0, s], gains[1, s]), max(gains[2, s], gains[3, s]))
            away[c] = max(away[c], distance_bound(course, hulls, h, radius[s], growth[s], 0.0, 1.0, vx, vy, vz) / gain)
            if not away[c] < limit:
                continue
        copy_row(table, hulls, s, near, near_hulls, count)
        away[c] = np.inf
        count += 1
    return count


@kernel
def copy_row(table: Table, hulls: MaybeHulls, s: int, near: Table, near_hulls: MaybeHulls, count: int) -> None:
    """Row s of a table as row `count` of another."""
    for j in range(4):
        near[1][j, count] = table[1][j, s]
        for axis in range(3):
            near[0][j, axis, count] = table[0][j, axis, s]
    near[2][count], near[3][count], near[4][count] = table[2][s], table[3][s], table[4][s]
    if len(hulls) > 0 and len(near_hulls) > 0:
        near_hulls[0][count] = hulls[0][s]
        for j in range(4):
            for axis in range(2 if hulls[1].shape[2] > 0 else 0):
                near_hulls[1][j, axis, count] = hulls[1][j, axis, s]


@kernel
def distance(a: Array, b: Array) -> float:
    """Between two points in space."""
    return float(np.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2))
