"""Many choices in one call: the same obstacles, each robot in its own state."""

import numpy as np

from slalom.kernels.arrays import Array, BodyTable, Indices, MaybeHulls, PositionMap, Segments
from slalom.kernels.jit import kernel
from slalom.kernels.relative_motion.segments import hulls_of_rows
from slalom.kernels.relative_motion.window import distances_now, kept_radii, segments_of
from slalom.kernels.selection.exchange import OVERLAPPING, nearest_free
from slalom.kernels.selection.tables import Scene, States


@kernel
def choose_many(
    preferred: Array, states: States, scene: Scene, hulls: MaybeHulls, most_elements: int, most_candidates: int
) -> tuple[Array, Indices]:
    """Controls (n, 3) and statuses (n,) of `nearest_free` for preferred controls (n, 3) in n states.

    `hulls`: of the bodies, as in `distances_now`.
    """
    n, d = states.position.shape
    controls, statuses = np.empty((n, 3)), np.empty(n, np.int64)
    for i in range(n):
        distances = distances_now(scene.bodies, hulls, states.position[i])
        radius, overlapping = kept_radii(distances[:, 0], scene.table.radius)
        if overlapping:
            controls[i], statuses[i] = preferred[i], OVERLAPPING
            continue
        kept = BodyTable(radius, scene.table.hull_radius, scene.table.owner, scene.table.hull)
        motion = PositionMap(states.knots, states.drift[i], states.gain, len(states.gain))
        cut, bounding_radius, _, hull = segments_of(scene.bodies.pieces, motion, kept, scene.horizon, scene.error)
        table = Segments(cut.points, cut.gains, cut.radius, cut.growth, bounding_radius)
        limits = states.limits[i, : states.counts[i]]
        row_hulls = hulls_of_rows(hulls, hull, cut.turns)
        statuses[i], controls[i], _, _ = nearest_free(
            preferred[i], d, limits, table, row_hulls, most_elements, most_candidates
        )
    return controls, statuses
