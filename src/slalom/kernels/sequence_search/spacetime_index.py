"""What moves, as one table over a long time, from which the rows near a place at a time are taken."""

import numpy as np

from slalom.kernels.arrays import Array, Indices, MaybeHulls, Pieces, PositionMap, Segments
from slalom.kernels.jit import kernel
from slalom.kernels.relative_motion.segments import hulls_at, relative_segments
from slalom.kernels.sequence_search.tables import SpacetimeIndex


@kernel
def rows_near(
    schedule: SpacetimeIndex, t: float, length: float, place: Array, reach: float, now: float, found: Indices
) -> int:
    """How many rows may be within `reach` of `place` at some time from t to t + length; they go into found.

    Bodies that appear after `now` are not known.
    """
    last, count = len(schedule.first) - 2, 0
    k0 = max(0, int(np.floor((t - schedule.start) / schedule.width)))
    k1 = min(last, int(np.floor((t + length - schedule.start) / schedule.width)))
    for k in range(k0, k1 + 1):
        for j in range(schedule.first[k], schedule.first[k + 1]):
            s = schedule.row[j]
            # As rows are cut afterwards: one is not to vanish by rounding in between.
            begin, end = max(schedule.times[s, 0] - t, 0.0), min(schedule.times[s, 1] - t, length)
            if not begin < end or schedule.appears[s] > now:
                continue
            # Rows of several intervals are taken from the first.
            if k > k0 and schedule.times[s, 0] < schedule.start + k * schedule.width:
                continue
            square = 0.0
            for axis in range(schedule.centers.shape[1]):
                square += (schedule.centers[s, axis] - place[axis]) ** 2
            far = reach + schedule.bounding_radius[s]
            if square < far * far:
                found[count] = s
                count += 1
    return count


@kernel
def relative_rows(
    schedule: SpacetimeIndex, rows: Indices, t: float, length: float, margin: float, drift: Array, gain: Array
) -> tuple[Segments, MaybeHulls]:
    """The motion of some rows (n,) relative to a robot from t to t + length [s], radii with the margin [m].

    The robot's position has the control points drift (1, 4, d) [m] + gain (1, 4) u.
    """
    n, d = len(rows), schedule.points.shape[2]
    turning = len(schedule.turns) > 0
    times, points = np.empty((n, 2)), np.empty((n, 4, d))
    radius, growth, turns = np.empty(n), np.empty(n), np.empty((n if turning else 0, 4, 2))
    bounding_radius = np.empty(n)
    for i in range(n):
        s = rows[i]
        times[i, 0], times[i, 1] = schedule.times[s, 0] - t, schedule.times[s, 1] - t
        for c in range(4):
            for axis in range(d):
                points[i, c, axis] = schedule.points[s, c, axis]
            if turning:
                turns[i, c, 0], turns[i, c, 1] = schedule.turns[s, c, 0], schedule.turns[s, c, 1]
        radius[i], growth[i] = schedule.radius[s] + margin, schedule.growth[s]
    pieces = Pieces(times, points, radius, growth, turns, np.zeros(n, np.int64))
    cut = relative_segments(pieces, PositionMap(np.array([0.0, length]), drift, gain), length)
    for i in range(n):
        bounding_radius[i] = cut.radius[i] + max(cut.growth[i], 0.0) + schedule.hull_radius[rows[i]]
    table = Segments(cut.points, cut.gains, cut.radius, cut.growth, bounding_radius)
    return table, hulls_at(schedule.hulls, rows, cut.turns)
