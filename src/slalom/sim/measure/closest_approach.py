"""Least clearance of a recorded run in continuous time, by code independent of the kernels that decide.

The robot moves on parabolas, obstacles on their true trajectories. Between two times the relative position stays within
M h^2 / 8 of the chord, with a bound M of the relative acceleration. Intervals whose lower bound exceeds the least
clearance found so far are dropped, the others are halved. The penetration depth of bodies with corners is resolved to
DEPTH_RESOLUTION seconds.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.kernels.arrays import Flags, Indices
from slalom.model.trajectory import PiecewisePolynomial
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import outline_parts
from slalom.sim.measure.recording import Recording, Which
from slalom.sim.shape_distance import Pair, differences, lowest, pairs, segment_distance, signed

METRIC: Final = 1e-4
"""[m] Accuracy of recorded least clearances. Smaller: slower metrics; must stay below COLLISION."""

DEPTH_RESOLUTION: Final = 1e-3
"""[s] Shortest interval in the search for the recorded penetration depth of overlapping bodies. Larger: less depth is
found. Smaller: slower metrics of runs with collisions."""

BLOCK_STEPS: Final = 16
"""[1] Steps of a recording that one bounding ball covers in the broad phase of the clearance between robots. Larger:
larger balls, so more steps are examined. Smaller: more balls. The clearance is the same."""


class ClosestApproach(NamedTuple):
    """Closest approach to one obstacle."""

    clearance: float  # [m]; inf if the two never exist together
    time: float  # [s] absolute


class Balls(NamedTuple):
    """Balls that bound the motion of n robots during b blocks of steps."""

    first: Indices  # (b,) first step of each block
    middle: Indices  # (b,) step at the centre of each block
    last: Indices  # (b,) step at the end of each block
    centers: Array  # (b, n, d) [m] the positions at the middle step
    radii: Array  # (b, n) [m]


def closest_approaches(recording: Recording, robot: int = 0) -> list[ClosestApproach]:
    """Return the closest approach of a robot to each obstacle; clearances are at most METRIC above the true ones."""
    return [closest_to(recording, robot, obstacle) for obstacle in recording.obstacles]


def closest_to(
    recording: Recording, robot: int, obstacle: Obstacle, parts: Sequence[int] | None = None
) -> ClosestApproach:
    """Return the closest approach of a robot to an obstacle.

    parts: numbers of the parts of the obstacle that count; None: all.
    """
    there = recording.steps_of(robot)
    if there.start >= there.stop:
        return ClosestApproach(np.inf, np.inf)
    return _closest(recording, robot, obstacle, there, parts)


def between_robots(recording: Recording) -> Array:
    """Return the least clearance (n, n) [m] between any two robots while both are present; inf on the diagonal.

    Clearances are at most METRIC above the true ones, as in `closest_approaches`. Discs and balls are vectorised.
    """
    n = len(recording.shapes)
    least = np.full((n, n), np.inf)
    if n < 2 or not len(recording.accelerations):
        return least
    is_ball = np.array([len(s.parts) == 1 and len(s.parts[0].corners) == 1 for s in recording.shapes])
    balls = bounding_balls(recording)
    appeared = np.flatnonzero(np.isfinite(recording.appeared))
    as_obstacles = {k: robot_as_obstacle(recording, k) for k in appeared.tolist()} if not is_ball.all() else {}
    for k in appeared.tolist():
        others = appeared[appeared > k]
        both = others[is_ball[k] & is_ball[others]]
        if both.size:
            least[k, both] = _closest_discs(recording, k, both, balls)
        for other in others[~(is_ball[k] & is_ball[others])]:
            least[k, other] = closest_to(recording, k, as_obstacles[other]).clearance
    return np.asarray(np.minimum(least, least.T))


def robot_as_obstacle(recording: Recording, robot: int) -> Obstacle:
    """Return a robot as an obstacle on its recorded path, while it is in the world."""
    there = recording.steps_of(robot)
    made = slice(there.start, there.stop - 1)
    places, velocities = recording.positions[there, robot], recording.velocities[made, robot]
    dt = recording.dt
    # From the positions at both ends: pieces of a motion that was observed meet, too.
    powers = np.stack([places[:-1], velocities, (np.diff(places, axis=0) - dt * velocities) / dt**2], axis=1)
    path = PiecewisePolynomial(np.full(len(powers), dt), powers, float(recording.times[there.start]))
    return Obstacle(recording.shapes[robot], path, recording.names[robot])


def _closest_discs(recording: Recording, robot: int, others: Indices, balls: Balls) -> Array:
    """Return the least clearance (k,) [m] of a disc or ball to other discs or balls while both are present."""
    own, there = recording.steps_of(robot), [recording.steps_of(int(k)) for k in others]
    spans = np.array([(max(own.start, s.start), min(own.stop, s.stop) - 1) for s in there], dtype=np.int64)
    parts, dt = [shape.parts[0] for shape in recording.shapes], recording.dt
    radii = np.array([parts[k].radius for k in others]) + parts[robot].radius
    offsets = np.array([parts[k].corners[0] for k in others]) - parts[robot].corners[0]
    step, index = _steps_near(recording, robot, others, offsets, radii, spans, balls)
    other = others[index]
    p, end = (recording.positions[k, other] - recording.positions[k, robot] + offsets[index] for k in (step, step + 1))
    v = recording.velocities[step, other] - recording.velocities[step, robot]
    a = recording.accelerations[step, other] - recording.accelerations[step, robot]
    best = np.full(len(others), np.inf)
    for x in (p, end):
        np.minimum.at(best, index, np.linalg.norm(x, axis=1) - radii[index])
    curvature = np.linalg.norm(a, axis=1) / 8.0
    near = segment_distance(p, end) - radii[index] - curvature * dt * dt < best[index] - METRIC
    p, v, a, curvature, index = (x[near] for x in (p, v, a, curvature, index))
    begin, width = np.zeros(len(index)), np.full(len(index), dt)
    while len(index):
        # Sample the middle of each parabola; keep the halves whose lower bound is below the best clearance.
        middle = begin + 0.5 * width
        points = [p + t[:, None] * (v + 0.5 * t[:, None] * a) for t in (begin, middle, begin + width)]
        np.minimum.at(best, index, np.linalg.norm(points[1], axis=1) - radii[index])
        halves = [
            segment_distance(points[j], points[j + 1]) - curvature * (0.5 * width) ** 2 - radii[index] for j in (0, 1)
        ]
        keep = [half < best[index] - METRIC for half in halves]
        p, v, a, curvature, index = (np.concatenate([x[keep[0]], x[keep[1]]]) for x in (p, v, a, curvature, index))
        begin = np.concatenate([begin[keep[0]], middle[keep[1]]])
        width = np.concatenate([0.5 * width[keep[0]], 0.5 * width[keep[1]]])
    return np.asarray(best)


def bounding_balls(recording: Recording) -> Balls:
    """Return balls that bound the motion of each robot during blocks of BLOCK_STEPS steps."""
    steps, dt = len(recording.accelerations), recording.dt
    first = np.arange(0, steps, BLOCK_STEPS)
    within = np.minimum(first[:, None] + np.arange(BLOCK_STEPS + 1), steps)
    middle = within[:, BLOCK_STEPS // 2]
    centers = recording.positions[middle]
    distances = np.linalg.norm(recording.positions[within] - centers[:, None], axis=-1).max(axis=1)
    # Between two steps a robot is at most this far from the nearer one.
    ends = recording.velocities[:-1] + dt * recording.accelerations
    speed = np.maximum(np.linalg.norm(recording.velocities[:-1], axis=-1), np.linalg.norm(ends, axis=-1))
    speeds = np.maximum.reduceat(speed, first)
    return Balls(first, middle, within[:, -1], centers, distances + 0.5 * dt * speeds)


def _steps_near(
    recording: Recording, robot: int, others: Indices, offsets: Array, radii: Array, spans: Indices, balls: Balls
) -> tuple[Indices, Indices]:
    """Return steps (m,) and indices (m,) of others: all at which the closest approach to that robot may lie.

    Args:
        offsets: (k, d) [m] of the centres. radii: (k,) [m] sums of both. spans: (k, 2) first common step, and the one
            after the last.
    """
    relative = balls.centers[:, others] - balls.centers[:, [robot]] + offsets
    distance = np.linalg.norm(relative, axis=-1) - radii
    reach = balls.radii[:, others] + balls.radii[:, [robot]]
    begin, end = balls.first[:, None], balls.first[:, None] + BLOCK_STEPS
    present = (begin < spans[:, 1]) & (end > spans[:, 0])
    # The closest approach is at most as far as at the far side of the balls of any block that is present to its end.
    whole = (begin >= spans[:, 0]) & (end <= spans[:, 1])
    upper = np.where(whole, distance + reach, np.inf).min(axis=0)
    block, index = np.nonzero(present & (distance - reach <= upper))
    step = (balls.first[block][:, None] + np.arange(BLOCK_STEPS)).reshape(-1)
    index = np.repeat(index, BLOCK_STEPS)
    there = (step >= spans[index, 0]) & (step < spans[index, 1])
    return step[there], index[there]


def positions_at(recording: Recording, robot: int, times: Array) -> Array:
    """Return the positions (k, d) [m] of a robot at absolute times (k,) [s] within the run."""
    steps = len(recording.accelerations)
    k = np.clip(np.searchsorted(recording.times, times, side="right") - 1, 0, max(steps - 1, 0))
    elapsed = (times - recording.times[k])[:, None]
    if not steps:
        return np.asarray(recording.positions[k, robot])
    velocity, acceleration = recording.velocities[k, robot], recording.accelerations[k, robot]
    return np.asarray(recording.positions[k, robot] + elapsed * (velocity + 0.5 * elapsed * acceleration))


def _closest(
    recording: Recording, robot: int, obstacle: Obstacle, there: slice, parts: Sequence[int] | None
) -> ClosestApproach:
    """Return the closest approach to some parts of an obstacle while a robot is there; None: to all."""
    first, last = obstacle.trajectory.span
    start, end = max(first, float(recording.times[there.start])), min(last, float(recording.times[there.stop - 1]))
    if start > end:
        return ClosestApproach(np.inf, np.inf)
    inner = recording.times[(recording.times > start) & (recording.times < end)]
    breaks = obstacle.trajectory.breaks(start, end)
    times = np.unique(np.concatenate([[start], inner, breaks, [end]]))
    robot_acceleration = np.linalg.norm(recording.accelerations[:, robot], axis=1).max(initial=0.0)
    curvature = (robot_acceleration + obstacle.trajectory.acceleration_bound(start, end)) / 8.0 if start < end else 0.0
    best = ClosestApproach(np.inf, start)
    for pair in pairs(obstacle.shape, recording.shapes[robot], parts):
        best = _closest_parts(recording, robot, obstacle, pair, times, curvature, best)
    return best


def _closest_parts(
    recording: Recording,
    robot: int,
    obstacle: Obstacle,
    pair: Pair,
    times: Array,
    curvature: float,
    best: ClosestApproach,
) -> ClosestApproach:
    """Return the closest approach of two parts if it is closer than `best`, else `best`.

    Args:
        times: (k,) [s] samples between which motion and rotation are smooth.
        curvature: [m/s^2] bound of the relative acceleration, divided by 8.
    """

    def sampled(t: Array) -> tuple[Array, Array]:
        """Differences of the corners (k, n, d) [m] and clearances (k,) [m] at times t (k,) [s]."""
        q = differences(obstacle, pair, t, positions_at(recording, robot, t))
        return q, signed(q) - pair.radius

    def nearer(t: Array, gap: Array) -> ClosestApproach:
        k = int(np.argmin(gap))
        return min(best, ClosestApproach(float(gap[k]), float(t[k])), key=lambda closest: closest.clearance)

    near = _intervals_near(recording, robot, obstacle, pair, times, best.clearance)
    samples = np.unique(np.concatenate([near, near + 1])) if len(times) > 1 else np.zeros(1, np.int64)
    if not len(samples):
        return best
    points, gaps = sampled(times[samples])
    best = nearer(times[samples], gaps)
    start, end = np.searchsorted(samples, near), np.searchsorted(samples, near + 1)
    a = times[near]
    b = times[near + 1]
    p = points[start]
    q = points[end]
    g = gaps[start]
    h = gaps[end]
    for _ in range(60):
        deviation = _deviation_by_rotation(obstacle, pair, a, b) + curvature * (b - a) ** 2
        # The distance changes at most as fast as the corners move: few intervals need the hull of both ends.
        travel = np.linalg.norm(q - p, axis=2).max(axis=1)
        keep = 0.5 * (g + h - travel) - deviation <= best.clearance
        keep[keep] = lowest(p[keep], q[keep], deviation[keep]) - pair.radius < best.clearance - METRIC
        if best.clearance < 0.0 and p.shape[1] > 1:
            # Hulls give no bound of the depth: intervals of overlapping bodies are halved to the end.
            keep &= b - a > DEPTH_RESOLUTION
        if not np.any(keep):
            break
        a, b, p, q, g, h = (x[keep] for x in (a, b, p, q, g, h))
        middle = 0.5 * (a + b)
        m, gap = sampled(middle)
        best = nearer(middle, gap)
        a, b, g, h = (np.concatenate(x) for x in ((a, middle), (middle, b), (g, gap), (gap, h)))
        p, q = np.concatenate([p, m]), np.concatenate([m, q])
    return best


def _intervals_near(
    recording: Recording, robot: int, obstacle: Obstacle, pair: Pair, times: Array, least: float
) -> Indices:
    """Return the numbers of the intervals of `times` (k,) [s] in which two parts may be closer than `least` [m].

    The distance of bodies that do not turn changes at most as fast as both move. So the distances at the ends of a
    block of intervals bound it in between. Positions may jump in velocity at the times, as those of peers do.
    """
    every = np.arange(len(times) - 1)
    if obstacle.turns or len(times) <= 2 * BLOCK_STEPS:
        return every
    ends = np.append(np.arange(0, len(times) - 1, BLOCK_STEPS), len(times) - 1)
    t = times[ends]
    distance = signed(differences(obstacle, pair, t, positions_at(recording, robot, t))) - pair.radius
    after = recording.velocities[:-1, robot] + recording.dt * recording.accelerations[:, robot]
    speeds = [np.linalg.norm(x, axis=1).max() for x in (recording.velocities[:, robot], after)]
    speed = max(speeds) + obstacle.trajectory.speed_bound(float(times[0]), float(times[-1]))
    lower = 0.5 * (distance[:-1] + distance[1:] - speed * np.diff(t))
    blocks = np.flatnonzero(lower <= min(least, distance.min()))
    return every[np.isin(every // BLOCK_STEPS, blocks)]


def _deviation_by_rotation(obstacle: Obstacle, pair: Pair, a: Array, b: Array) -> Array:
    """Return a bound (k,) [m] of the deviation of rotating corners from the chord between times a and b (k,) [s]."""
    if not obstacle.turns:
        return np.zeros(len(a))
    change = np.linalg.norm(obstacle.direction(b) - obstacle.direction(a), axis=1)
    max_radius = float(np.linalg.norm(pair.obstacle.corners, axis=1).max())
    # The bound for small rotations does not hold for large ones: use the diameter.
    return np.where(change < 1.0, 0.25 * max_radius * change**2, 2.0 * max_radius)


# Clearances of a recorded run to its obstacles, where bounding balls show that few of them can be the nearest.
#
# The motion of a robot during a block of steps lies within a ball, and so does each part of an obstacle. The distances
# of the balls bound the clearance from below and above. By code independent of the kernels that decide.


class PartBalls(NamedTuple):
    """Balls of the p parts of all obstacles at a time in each of b blocks of steps."""

    obstacle: Indices  # (p,) number of the obstacle
    part: Indices  # (p,) number of the part in its shape
    centers: Array  # (p, b, d) [m]
    radii: Array  # (p,) [m]
    moved: Array  # (p, b) [m] how far a part moves in a block at most
    rounding: Array  # (p,) [m] radius of the part about the centre; -inf: the centre need not lie within the part
    exists: Flags  # (p, b) whether the obstacle exists at any time of the block
    there: Flags  # (p, b) whether it exists at the time of the centre


def nearest_clearances(recording: Recording) -> Array:
    """The clearance (n, m) [m] of each robot to each obstacle, in continuous time, as of `closest_approaches`.

    It is that for the nearest obstacle of a robot and for all that overlap the robot. For others it may be larger, up
    to inf.
    """
    n, m = len(recording.shapes), len(recording.obstacles)
    if not m or not len(recording.accelerations):
        each = [[closest.clearance for closest in closest_approaches(recording, k)] for k in range(n)]
        return np.array(each).reshape(n, m)
    found = np.full((n, m), np.inf)
    balls = bounding_balls(recording)
    parts = _part_balls(recording, balls)
    for k in range(n):
        low, high = _bounds(recording, k, balls, parts)
        near = low <= max(0.0, high.min()) + METRIC
        for j in np.unique(parts.obstacle[near]).tolist():
            some = parts.part[near & (parts.obstacle == j)].tolist()
            found[k, j] = closest_to(recording, k, recording.obstacles[j], some).clearance
    return found


def _part_balls(recording: Recording, balls: Balls) -> PartBalls:
    """The balls of the parts of all obstacles in the blocks of `balls`."""
    times, counts = recording.times, [len(obstacle.shape.parts) for obstacle in recording.obstacles]
    begin = times[balls.first]
    middle = times[balls.middle]
    end = times[balls.last]
    p, b = sum(counts), len(begin)
    numbers = np.repeat(np.arange(len(counts)), counts)
    of_shape = np.concatenate([np.arange(count) for count in counts])
    centers, moved = np.zeros((p, b, recording.dimension)), np.zeros((p, b))
    radii, rounding = np.zeros(p), np.full(p, -np.inf)
    exists, there = np.zeros((p, b), np.bool_), np.zeros((p, b), np.bool_)
    row = 0
    for obstacle, count in zip(recording.obstacles, counts):
        rows, (first, last) = slice(row, row + count), obstacle.trajectory.span
        row += count
        exists[rows], there[rows] = (begin <= last) & (first <= end), (first <= middle) & (middle <= last)
        start, stop = max(first, float(times[0])), min(last, float(times[-1]))
        if start > stop:
            continue
        offsets, radii[rows], rounding[rows] = _about_position(obstacle, start)
        centers[rows] = obstacle.trajectory.position(np.clip(middle, start, stop)) + offsets[:, None]
        if start < stop:
            moved[rows] = obstacle.trajectory.speed_bound(start, stop) * (end - begin)
    return PartBalls(numbers, of_shape, centers, radii, moved, rounding, exists, there)


def _about_position(obstacle: Obstacle, t: float) -> tuple[Array, Array, Array]:
    """Offsets (p, d) [m] of the balls of the parts from the obstacle's position; their radii and roundings (p,) [m]."""
    shapes = obstacle.shape.parts
    own = np.array([part.radius for part in shapes])
    if obstacle.turns:
        reach = np.array([np.linalg.norm(part.corners, axis=1).max() for part in shapes])
        return np.zeros((len(shapes), obstacle.dimension)), own + reach, np.full(len(shapes), -np.inf)
    corners = [part.corners - obstacle.trajectory.position(t) for part in outline_parts(obstacle, t)]
    offsets = np.array([each.mean(axis=0) for each in corners])
    spread = [np.linalg.norm(each - center, axis=1).max() for each, center in zip(corners, offsets)]
    return offsets, own + np.array(spread), own


def _bounds(recording: Recording, robot: int, balls: Balls, parts: PartBalls) -> tuple[Array, Array]:
    """Lower and upper bounds (p,) [m] of the least clearance of a robot to each part; inf: never there together."""
    shape, there = recording.shapes[robot], recording.steps_of(robot)
    present = (balls.first < there.stop - 1) & (balls.last > there.start)
    relative = parts.centers - balls.centers[:, robot]
    inner = relative - shape.parts[0].corners.mean(axis=0)
    reach = balls.radii[:, robot] + shape.bounding_radius + parts.radii[:, None] + parts.moved
    low = np.linalg.norm(relative, axis=2) - reach
    touch = shape.parts[0].radius + parts.rounding[:, None]
    high = np.linalg.norm(inner, axis=2) - touch
    whole = (balls.middle >= there.start) & (balls.middle < there.stop)
    low = np.where(parts.exists & present, low, np.inf).min(axis=1)
    return low, np.where(parts.there & whole, high, np.inf).min(axis=1)


def single_robot_view(recording: Recording, robot: Which = None) -> Recording:
    """Return the recording of one robot, with the other robots as obstacles on their recorded paths.

    Raises:
        InvalidInput: see `Recording.row`.
    """
    k, n = recording.row(robot), len(recording.shapes)
    there = np.isfinite(recording.appeared) & (len(recording.accelerations) > 0)
    others = [robot_as_obstacle(recording, j) for j in range(n) if j != k and there[j]]
    return replace(recording.only(k), obstacles=(*recording.obstacles, *others))
