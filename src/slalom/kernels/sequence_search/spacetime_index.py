"""Queries of the space-time index: pieces of bodies near a point during an interval, and their relative motion."""

import numpy as np

from slalom.kernels.arrays import Array, Indices, MaybeHulls, Pieces, PositionMap, Segments
from slalom.kernels.jit import kernel
from slalom.kernels.relative_motion.segments import hulls_at, relative_segments
from slalom.kernels.sequence_search.tables import SpacetimeIndex
from slalom.kernels.squared import squared


@kernel
def rows_near(
    index: SpacetimeIndex, t: float, duration: float, position: Array, radius: float, now: float, rows: Indices
) -> int:
    """Number of pieces that may come within `radius` [m] of position (3,) [m] from t to t + duration [s].

    Their numbers go into `rows` (n,). Bodies that appear after `now` [s] are not known.
    """
    last, count = len(index.first) - 2, 0
    k0 = max(0, int(np.floor((t - index.start) / index.width)))
    k1 = min(last, int(np.floor((t + duration - index.start) / index.width)))
    for k in range(k0, k1 + 1):
        for j in range(index.first[k], index.first[k + 1]):
            s = index.row[j]
            # The same differences as in `relative_rows`: no piece may vanish by rounding in between.
            begin, end = max(index.times[s, 0] - t, 0.0), min(index.times[s, 1] - t, duration)
            if not begin < end or index.appears[s] > now:
                continue
            # A piece that overlaps several intervals is taken from the first.
            if k > k0 and index.times[s, 0] < index.start + k * index.width:
                continue
            square = 0.0
            for axis in range(index.centers.shape[1]):
                square += squared(index.centers[s, axis] - position[axis])
            far = radius + index.bounding_radius[s]
            if square < far * far:
                rows[count] = s
                count += 1
    return count


@kernel
def relative_rows(
    index: SpacetimeIndex, rows: Indices, t: float, motion: PositionMap, margin: float
) -> tuple[Segments, MaybeHulls]:
    """Motion of the pieces `rows` (n,) relative to a robot with a position map of one piece from time t [s] on.

    The radii include the margin [m].
    """
    n, d = len(rows), index.points.shape[2]
    turning = len(index.turns) > 0
    times, points = np.empty((n, 2)), np.empty((n, 4, d))
    radius, growth, turns = np.empty(n), np.empty(n), np.empty((n if turning else 0, 4, 2))
    bounding_radius = np.empty(n)
    for i in range(n):
        s = rows[i]
        times[i, 0], times[i, 1] = index.times[s, 0] - t, index.times[s, 1] - t
        for c in range(4):
            for axis in range(d):
                points[i, c, axis] = index.points[s, c, axis]
            if turning:
                turns[i, c, 0], turns[i, c, 1] = index.turns[s, c, 0], index.turns[s, c, 1]
        radius[i], growth[i] = index.radius[s] + margin, index.growth[s]
    cut = relative_segments(
        Pieces(times, points, radius, growth, turns, np.zeros(n, np.int64)), motion, motion.knots[1]
    )
    for i in range(n):
        bounding_radius[i] = cut.radius[i] + max(cut.growth[i], 0.0) + index.hull_radius[rows[i]]
    table = Segments(cut.points, cut.gains, cut.radius, cut.growth, bounding_radius)
    return table, hulls_at(index.hulls, rows, cut.turns)
