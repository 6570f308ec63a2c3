"""Many choices in one call: the same obstacles, each robot in its own state."""

import numpy as np

from slalom.kernels.compiled import Array, Flags, Indices, MaybeHulls, kernel
from slalom.kernels.exchange import OVERLAPPING, nearest_free
from slalom.kernels.now import distances_now
from slalom.kernels.schedule import hulls_of
from slalom.kernels.segments import relative_segments
from slalom.tolerances import CONTACT, TOUCHING


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
    controls, statuses, around = np.empty((n, 3)), np.empty(n, np.int64), np.empty(len(radius))
    own = np.empty(len(wider))
    for i in range(n):
        gaps = distances_now(times, points, turns, radius, growth, body, heads, unsure, hull, solid, position[i])
        overlaps = False
        for b in range(len(wider)):
            gap, own[b] = gaps[b, 0], wider[b]
            # Contact is not overlap, see `ControlObstacle`.
            if gap - wider[b] >= -CONTACT and gap - wider[b] < TOUCHING:
                own[b] = max(gap - TOUCHING, 0.0)
            overlaps = overlaps or gap - own[b] < -CONTACT
        if overlaps:
            controls[i], statuses[i] = preferred[i], OVERLAPPING
            continue
        for s in range(len(radius)):
            around[s] = radius[s] + error + own[body[s]]
        _, _, rel, gains, grown, widening, turned, which = relative_segments(
            times, points, around, growth, turns, body, knots, drift[i], gain, horizon
        )
        reach = np.empty(len(grown))
        for s in range(len(grown)):
            reach[s] = grown[s] + max(widening[s], 0.0) + spread[which[s]]
        hulls = hulls_of(solid, which, turned)
        statuses[i], controls[i], _, _ = nearest_free(
            preferred[i], d, limits[i, : counts[i]], rel, gains, grown, widening, reach, hulls,
            most_elements, most_candidates,
        )  # fmt: skip
    return controls, statuses
