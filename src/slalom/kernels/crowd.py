"""Models of crowds, which predict how people move: no part in safety."""

from typing import Final

import numpy as np

from slalom.base.tolerances import SIMILAR_MEMORY, SIMILAR_VELOCITY_SPAN
from slalom.kernels.arrays import Array, Indices, TrackSamples
from slalom.kernels.jit import kernel, squared

# Velocities of agents in the plane that all avoid each other, each by a half of the least change that it takes.
#
# The model is optimal reciprocal collision avoidance (van den Berg, Guy, Lin and Manocha, 2011). Each pair permits
# each of its agents a half-plane of velocities. An agent takes the permitted velocity nearest its preferred one.


CROWD_RELAXATIONS: Final = 40
"""[1] Bisections of the amount by which the half-planes of an agent are moved where they permit no velocity. More:
never needed. Fewer: a velocity that is not nearest to what is permitted."""

PARALLEL_LINES: Final = 1e-10
"""[1] Sine of the angle below which the borders of two half-planes do not intersect. Larger: half-planes at a small
angle count as parallel. Smaller: intersections far away, with rounding."""


@kernel
def avoiding_velocities(
    positions: Array,
    velocities: Array,
    radii: Array,
    preferred: Array,
    speeds: Array,
    horizon: float,
    reach: float,
    period: float,
) -> Array:
    """Next velocities (n, 2) [m/s] of all agents.

    Args:
        positions, velocities, preferred: (n, 2) [m], [m/s], [m/s]. radii: (n,) [m] with the distance that agents keep.
        speeds: (n,) [m/s] the largest of each. horizon: [s] in which no pair is to touch.
        reach: [m] distance up to which agents avoid each other. period: [s] in which pairs that touch separate.
    """
    n = len(positions)
    found = np.empty((n, 2))
    normals = np.empty((n, 2))
    offsets = np.empty(n)
    for i in range(n):
        count = 0
        for j in range(n):
            x = positions[j, 0] - positions[i, 0]
            y = positions[j, 1] - positions[i, 1]
            distance = np.sqrt(x * x + y * y)
            if j == i or distance >= reach or distance <= 0.0:
                continue
            along = x / distance
            across = y / distance
            vx = velocities[i, 0] - velocities[j, 0]
            vy = velocities[i, 1] - velocities[j, 1]
            change, toward, aside = least_change(
                distance, vx * along + vy * across, vy * along - vx * across, radii[i] + radii[j], horizon, period
            )
            if toward == 0.0 and aside == 0.0:
                continue
            nx = toward * along - aside * across
            ny = toward * across + aside * along
            normals[count, 0] = nx
            normals[count, 1] = ny
            offsets[count] = velocities[i, 0] * nx + velocities[i, 1] * ny + 0.5 * change
            count += 1
        found[i, 0], found[i, 1] = permitted_velocity(
            normals, offsets, count, speeds[i], preferred[i, 0], preferred[i, 1]
        )
    return found


@kernel
def least_change(
    distance: float, x: float, y: float, radius: float, horizon: float, period: float
) -> tuple[float, float, float]:
    """Least change [m/s] of a relative velocity to the edge of the velocity obstacle, and its direction outwards.

    The first axis points to the other agent. The change is negative for a velocity outside; the direction is (0, 0)
    where it is undefined.

    Args:
        distance: [m] between the centres. x, y: [m/s] relative velocity. radius: [m] sum of both.
        horizon: [s] of the velocity obstacle; period: [s] instead, of agents that touch.
    """
    time = horizon if distance > radius else period
    center = distance / time
    size = radius / time
    away = np.sqrt((x - center) ** 2 + y * y)
    if distance <= radius or (center - x) * distance > radius * away:
        if away <= 0.0:
            return 0.0, 0.0, 0.0
        return size - away, (x - center) / away, y / away
    sine = radius / distance
    cosine = np.sqrt(1.0 - sine * sine)
    return x * sine - abs(y) * cosine, -sine, cosine if y > 0.0 else -cosine


@kernel
def permitted_velocity(
    normals: Array, offsets: Array, count: int, speed: float, px: float, py: float
) -> tuple[float, float]:
    """The velocity nearest (px, py) [m/s] with v . normal >= offset for `count` half-planes, at most `speed` fast.

    Where there is none, all offsets are reduced by the least equal amount that permits one.
    """
    feasible, x, y = nearest_velocity(normals, offsets, count, speed, px, py, 0.0)
    if feasible:
        return x, y
    low = 0.0
    high = speed
    for k in range(count):
        high = max(high, offsets[k] + speed)
    _, x, y = nearest_velocity(normals, offsets, count, speed, px, py, high)
    for _ in range(CROWD_RELAXATIONS):
        middle = 0.5 * (low + high)
        feasible, a, b = nearest_velocity(normals, offsets, count, speed, px, py, middle)
        if feasible:
            high = middle
            x = a
            y = b
        else:
            low = middle
    return x, y


@kernel
def nearest_velocity(
    normals: Array, offsets: Array, count: int, speed: float, px: float, py: float, less: float
) -> tuple[bool, float, float]:
    """As `permitted_velocity` with offsets reduced by `less` [m/s], and whether there is one.

    Half-planes are added one by one. If a new one excludes the velocity so far, the next lies on its border.
    """
    size = np.sqrt(px * px + py * py)
    share = min(1.0, speed / size) if size > 0.0 else 1.0
    x = share * px
    y = share * py
    for i in range(count):
        nx = normals[i, 0]
        ny = normals[i, 1]
        offset = offsets[i] - less
        if nx * x + ny * y >= offset:
            continue
        if abs(offset) > speed:
            return False, x, y
        high = np.sqrt(speed * speed - offset * offset)
        low = -high
        for j in range(i):
            rise = normals[j, 1] * nx - normals[j, 0] * ny
            missing = offsets[j] - less - offset * (normals[j, 0] * nx + normals[j, 1] * ny)
            if abs(rise) <= PARALLEL_LINES:
                if missing > 0.0:
                    return False, x, y
            elif rise > 0.0:
                low = max(low, missing / rise)
            else:
                high = min(high, missing / rise)
        if low > high:
            return False, x, y
        along = min(max(py * nx - px * ny, low), high)
        x = offset * nx - along * ny
        y = offset * ny + along * nx
    return True, x, y


# Displacements of tracks, from what tracks with similar positions and velocities did before.
#
# Each earlier step of each track is a motion. Its weight falls with the distances of its position and velocity from
# the present ones, as a Gaussian. The mean deviation of the nearest motions from their velocities is added to the
# present velocity: a regression as by Nadaraya (Theory of Probability and Its Applications 9, 1964).


SIMILAR_PLACE: Final = 3.0
"""[spacings] Scale of the distance between similar motions: the way in this time at the present speed. Larger: motions
of other lanes count. Smaller: few earlier motions are similar."""

SIMILAR_VELOCITY: Final = 0.3
"""[1] Scale of the difference between velocities of similar motions, as a share of the present speed. Larger: motions
that turn elsewhere count. Smaller: few earlier motions are similar."""

SIMILAR_REACH: Final = 4.0
"""[1] Scales beyond which motions are not similar. Larger: weights of 0 are added. Smaller: weights jump to 0."""

SIMILAR_DOUBT: Final = 0.5
"""[1] Weight of the present velocity beside the weights of similar motions, each at most 1. Larger: single earlier
motions count less. Smaller: one earlier motion is repeated as it was."""

SIMILAR_CANDIDATES: Final = 4
"""[1] Similar motions that are kept, in multiples of those that count: some end too early for later knots. Larger: more
work. Smaller: fewer count at late knots."""


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
