"""Many choices in one call: the same obstacles, each robot in its own state."""

import numpy as np

from slalom.kernels.arrays import Array, Flags, Indices, MaybeHulls
from slalom.kernels.jit import kernel
from slalom.kernels.relative_motion.segments import hulls_of
from slalom.kernels.relative_motion.window import distances_now, kept_radii, segments_of
from slalom.kernels.selection.exchange import OVERLAPPING, nearest_free


@kernel
def choose_many(
    preferred: Array,
    limits: Array,
    counts: Indices,
    position: Array,
    knots: Array,
    drift: Array,
    gain: Array,
    times: Array,
    points: Array,
    radius: Array,
    growth: Array,
    turns: Array,
    body: Indices,
    heads: Indices,
    unsure: Flags,
    wider: Array,
    spread: Array,
    hull: Indices,
    solid: MaybeHulls,
    error: float,
    horizon: float,
    most_elements: int,
    most_candidates: int,
) -> tuple[Array, Indices]:
    """Controls (n, 3) and statuses (n,) of `nearest_free` for preferred controls (n, 3) in n states.

    Args:
        limits: (n, l, 5) of which the first counts (n,) rows are those of the state. position: (n, d).
        knots: (m + 1,), drift: (n, m, 4, d), gain: (m, 4): as in `relative_segments`.
        times to heads: pieces of bodies, see `traffic.Pieces`; unsure to hull: of the bodies, `wider` their radii with
            the margin. solid: hulls as in `distances_now`. error: [m] of the response's pieces.
    """
    n, d = position.shape
    controls, statuses = np.empty((n, 3)), np.empty(n, np.int64)
    for i in range(n):
        gaps = distances_now(times, points, turns, radius, growth, body, heads, unsure, hull, solid, position[i])
        own, overlaps = kept_radii(gaps[:, 0], wider)
        if overlaps:
            controls[i], statuses[i] = preferred[i], OVERLAPPING
            continue
        _, _, rel, gains, grown, widening, turned, reach, which, _ = segments_of(
            times, points, radius, growth, turns, body, knots, drift[i], gain, horizon, error, own, spread, hull, hull
        )
        hulls = hulls_of(solid, which, turned)
        statuses[i], controls[i], _, _ = nearest_free(
            preferred[i], d, limits[i, : counts[i]], rel, gains, grown, widening, reach, hulls,
            most_elements, most_candidates,
        )  # fmt: skip
    return controls, statuses
