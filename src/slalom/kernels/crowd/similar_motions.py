"""Displacements of tracks, from what tracks with similar positions and velocities did before.

Each earlier step of each track is a motion. Its weight falls with the distances of its position and velocity from the
present ones, as a Gaussian. The mean deviation of the nearest motions from their velocities is added to the present
velocity: a regression as by Nadaraya (Theory of Probability and Its Applications 9, 1964).
"""

from typing import Final

import numpy as np

from slalom.base.tolerances import SIMILAR_MEMORY, SIMILAR_VELOCITY_SPAN
from slalom.kernels.arrays import Array, Indices, TrackSamples
from slalom.kernels.jit import kernel, squared

SIMILAR_PLACE: Final = 3.0
"""[spacings] Scale of the distance between similar motions: the way in this time at the present speed.

Larger: motions of other lanes count. Smaller: few earlier motions are similar.
"""

SIMILAR_VELOCITY: Final = 0.3
"""[1] Scale of the difference between velocities of similar motions, as a share of the present speed.

Larger: motions that turn elsewhere count. Smaller: few earlier motions are similar.
"""

SIMILAR_REACH: Final = 4.0
"""[1] Scales beyond which motions are not similar. Larger: weights of 0 are added. Smaller: weights jump to 0."""

SIMILAR_DOUBT: Final = 0.5
"""[1] Weight of the present velocity beside the weights of similar motions, each at most 1.

Larger: single earlier motions count less. Smaller: one earlier motion is repeated as it was.
"""

SIMILAR_CANDIDATES: Final = 4
"""[1] Similar motions that are kept, in multiples of those that count: some end too early for later knots.

Larger: more work. Smaller: fewer count at late knots.
"""


@kernel
def similar_displacements(places: Array, velocities: Array, knots: Indices, samples: TrackSamples, count: int) -> Array:
    """Displacements (q, m, d + 2) [m] after `knots` (m,) [spacings] of tracks at `places` (q, d) [m].

    Up to `count` similar motions have a weight at each knot: those that reach it within the samples, whose last column
    is the present. Where there is none, the present velocity lasts. The last two columns are the variance [m^2] of the
    motions about their mean, and their share [1] of all weights: the present velocity has the rest.

    Args:
        velocities: (q, d) [m per spacing]. knots: of at least 0, increasing.
    """
    q = len(places)
    m = len(knots)
    d = places.shape[1]
    found = np.zeros((q, m, d + 2))
    motion = np.empty(d)
    near = np.empty((SIMILAR_CANDIDATES * count, 2), np.int64)
    distances = np.empty(SIMILAR_CANDIDATES * count)
    for j in range(q):
        kept = nearest_motions(places[j], velocities[j], samples, near, distances)
        for k in range(m):
            total = SIMILAR_DOUBT
            square = 0.0
            used = 0
            motion[:] = 0.0
            for c in range(kept):
                i = near[c, 0]
                begin = near[c, 1]
                end = begin + knots[k]
                if used == count or end > samples.last[i]:
                    continue
                weight = np.exp(-0.5 * distances[c])
                used = used + 1
                total += weight
                for axis in range(d):
                    track = samples.positions[i, :, axis]
                    velocity = (track[begin] - track[begin - SIMILAR_VELOCITY_SPAN]) / SIMILAR_VELOCITY_SPAN
                    deviation = track[end] - track[begin] - knots[k] * velocity
                    motion[axis] += weight * deviation
                    square += weight * squared(deviation)
            variance = square / total
            for axis in range(d):
                mean = motion[axis] / total
                variance -= squared(mean)
                found[j, k, axis] = velocities[j, axis] * knots[k] + mean
            found[j, k, d] = max(variance, 0.0)
            found[j, k, d + 1] = 1.0 - SIMILAR_DOUBT / total
    return found


@kernel
def nearest_motions(place: Array, velocity: Array, samples: TrackSamples, near: Indices, distances: Array) -> int:
    """Number of motions similar to one at `place` (d,) [m] with `velocity` (d,) [m per spacing].

    Their tracks and columns go into `near` (c, 2), the squares of their distances [1] into `distances` (c,), the
    nearest first; of equal ones the first track, then the first column.
    """
    d = len(place)
    kept = 0
    square = 0.0
    for axis in range(d):
        square += squared(velocity[axis])
    if square == 0.0:
        return 0
    per_place = 1.0 / (squared(SIMILAR_PLACE) * square)
    per_velocity = 1.0 / (squared(SIMILAR_VELOCITY) * square)
    for i in range(len(samples.first)):
        track = samples.positions[i]
        following = samples.first[i] + SIMILAR_VELOCITY_SPAN
        while following <= samples.last[i]:
            k = following
            distance = 0.0
            following += 1
            for axis in range(d):
                distance += per_place * squared(track[k, axis] - place[axis])
            if distance >= squared(SIMILAR_REACH):
                # The track needs some spacings to come near.
                far = (np.sqrt(distance) - SIMILAR_REACH) * SIMILAR_PLACE * np.sqrt(square)
                steps = far / samples.longest[i] if samples.longest[i] > 0.0 else np.inf
                following += int(min(steps, float(SIMILAR_MEMORY)))
                continue
            for axis in range(d):
                mean = (track[k, axis] - track[k - SIMILAR_VELOCITY_SPAN, axis]) / SIMILAR_VELOCITY_SPAN
                distance += per_velocity * squared(mean - velocity[axis])
            if distance >= squared(SIMILAR_REACH) or (kept == len(distances) and distance >= distances[kept - 1]):
                continue
            at = min(kept, len(distances) - 1)
            while at > 0 and distances[at - 1] > distance:
                distances[at], near[at, 0], near[at, 1] = distances[at - 1], near[at - 1, 0], near[at - 1, 1]
                at -= 1
            distances[at] = distance
            near[at, 0] = i
            near[at, 1] = k
            kept = min(kept + 1, len(distances))
    return kept
