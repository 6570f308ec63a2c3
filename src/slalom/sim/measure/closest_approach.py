"""Least clearance of a recorded run, in continuous time, by code that shares nothing with the deciding kernels.

The robot moves on parabolas, obstacles on their true trajectories. Between two times the relative position stays within
M h^2 / 8 of the chord between its ends, M a bound of the relative acceleration; intervals whose bound exceeds what is
known already are dropped, the others halved. How deep bodies with corners overlap is looked for to FINEST seconds.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.checks import Array
from slalom.obstacle import Obstacle
from slalom.sim.measure.recording import Recording
from slalom.sim.periodic import between, displaced, neighbours, to_nearest
from slalom.sim.shape_distance import Pair, differences, lowest, pairs, segment_distance, signed
from slalom.tolerances import METRIC
from slalom.trajectory import PiecewisePolynomial

Indices = npt.NDArray[np.int64]
FINEST = 1e-3
"""[s]"""


class Closest(NamedTuple):
    """The closest approach to one obstacle."""

    clearance: float  # [m]; inf if the two never exist together
    time: float  # [s] absolute


def closest_approaches(recording: Recording, robot: int = 0) -> list[Closest]:
    """The closest approach of a robot to each obstacle, its clearance at most METRIC above the true one."""
    return [_closest_image(recording, robot, obstacle) for obstacle in recording.obstacles]


def _closest_image(recording: Recording, robot: int, obstacle: Obstacle) -> Closest:
    """The closest approach of a robot to an obstacle, or to any image of it."""
    steps = last_step(recording, robot)
    found = [_closest(recording, robot, image, steps) for image in images_met(recording, robot, obstacle)]
    return min(found, key=lambda closest: closest.clearance)


def images_met(recording: Recording, robot: int, obstacle: Obstacle) -> list[Obstacle]:
    """The obstacle; where the world repeats, all its images that come nearest to a robot at some time of the run.

    With D the largest distance of the nearest image's place, and r the reach of both shapes, an image whose place is
    farther than D + 2 r is never nearer than that one.
    """
    first, last = obstacle.trajectory.span
    start, end = max(first, float(recording.times[0])), min(last, float(recording.times[-1]))
    if recording.period is None or start > end:
        return [obstacle]
    inner = recording.times[(recording.times > start) & (recording.times < end)]
    times = np.unique(np.concatenate([[start], inner, [end]]))
    apart = obstacle.trajectory.position(times) - positions_at(recording, robot, times)
    nearest = np.linalg.norm(apart + to_nearest(apart, recording.period), axis=1).max()
    # Between two steps nobody goes farther than this.
    speed = float(np.linalg.norm(recording.velocities[:, robot], axis=1).max())
    step = recording.dt * (speed + (obstacle.trajectory.speed_bound(start, end) if start < end else 0.0))
    far = float(nearest) + 2.0 * (obstacle.shape.bounding_radius + recording.shapes[robot].bounding_radius) + 2.0 * step
    return [
        displaced(obstacle, by) for by in between(-far - apart.max(axis=0), far - apart.min(axis=0), recording.period)
    ]


def between_robots(recording: Recording) -> Array:
    """The least clearance between any two robots while both are there [m]: (n, n), inf on the diagonal.

    As `closest_approaches`, at most METRIC above the true one; all pairs of discs or balls at once.
    """
    n = len(recording.shapes)
    least = np.full((n, n), np.inf)
    if n < 2 or not len(recording.accelerations):
        return least
    round_ones = np.array([len(s.parts) == 1 and len(s.parts[0].corners) == 1 for s in recording.shapes])
    for k in range(n - 1):
        others = np.arange(k + 1, n)
        both = others[round_ones[k] & round_ones[others]]
        if both.size:
            least[k, both] = _closest_discs(recording, k, both)
        for other in others[~(round_ones[k] & round_ones[others])]:
            least[k, other] = _closest_image(recording, k, driven(recording, int(other))).clearance
    return np.asarray(np.minimum(least, least.T))


def last_step(recording: Recording, robot: int) -> int:
    """How many steps the robot is there: one that passes its goal leaves the scene."""
    steps = len(recording.accelerations)
    if np.isfinite(recording.arrived[robot]) and not recording.goals[robot].stop:
        return min(steps, max(1, round(float(recording.arrived[robot] - recording.times[0]) / recording.dt)))
    return steps


def driven(recording: Recording, robot: int) -> Obstacle:
    """A robot as an obstacle on the path that it drove."""
    last = last_step(recording, robot)
    rows = (recording.positions[:last, robot], recording.velocities[:last, robot])
    powers = np.stack([*rows, 0.5 * recording.accelerations[:last, robot]], axis=1)
    path = PiecewisePolynomial(np.full(last, recording.dt), powers, float(recording.times[0]))
    return Obstacle(recording.shapes[robot], path, f"robot {robot}")


def _closest_discs(recording: Recording, robot: int, others: Indices) -> Array:
    """The least clearance of a disc or ball to others, while both are there: (k,)."""
    lasts = np.array([last_step(recording, int(k)) for k in others], dtype=np.int64)
    lasts = np.minimum(lasts, last_step(recording, robot))
    steps, dt = int(lasts.max(initial=0)), recording.dt
    parts = [shape.parts[0] for shape in recording.shapes]
    radii = np.array([parts[k].radius for k in others]) + parts[robot].radius
    offsets = np.array([parts[k].corners[0] for k in others]) - parts[robot].corners[0]
    apart = recording.positions[: steps + 1, others] - recording.positions[: steps + 1, [robot]] + offsets
    there = np.arange(steps)[:, None] < lasts
    speeds = recording.velocities[:steps, others] - recording.velocities[:steps, [robot]]
    pushes = recording.accelerations[:steps, others] - recording.accelerations[:steps, [robot]]
    starts, ends = apart[:-1], apart[1:]
    if recording.period is not None:
        far = 2.0 * dt * float(np.linalg.norm(recording.velocities, axis=-1).max())
        shifts = neighbours(recording.period, far)[:, None, None]
        by = (to_nearest(starts, recording.period) + shifts).reshape(-1, *starts.shape[1:])
        many = (len(by) // steps, 1, 1)
        there, speeds, pushes = np.tile(there, many[:2]), np.tile(speeds, many), np.tile(pushes, many)
        starts, ends = np.tile(starts, many) + by, np.tile(ends, many) + by
    gaps = [np.where(there, np.linalg.norm(x, axis=-1) - radii, np.inf).min(axis=0) for x in (starts, ends)]
    best = np.minimum(*gaps)
    bends = np.linalg.norm(pushes, axis=-1) / 8.0
    chords = segment_distance(starts.reshape(-1, starts.shape[2]), ends.reshape(-1, ends.shape[2]))
    step, who = np.nonzero(there & (chords.reshape(there.shape) - radii - bends * dt * dt < best - METRIC))
    p, v, a, bend = starts[step, who], speeds[step, who], pushes[step, who], bends[step, who]
    begin, width = np.zeros(len(step)), np.full(len(step), dt)
    while len(who):
        # The parabola's middle is a sample; halves whose chord may be nearer than the best go on.
        middle = begin + 0.5 * width
        places = [p + t[:, None] * (v + 0.5 * t[:, None] * a) for t in (begin, middle, begin + width)]
        np.minimum.at(best, who, np.linalg.norm(places[1], axis=1) - radii[who])
        halves = [segment_distance(places[j], places[j + 1]) - bend * (0.5 * width) ** 2 - radii[who] for j in (0, 1)]
        keep = [half < best[who] - METRIC for half in halves]
        p, v, a, bend, who = (np.concatenate([x[keep[0]], x[keep[1]]]) for x in (p, v, a, bend, who))
        begin = np.concatenate([begin[keep[0]], middle[keep[1]]])
        width = np.concatenate([0.5 * width[keep[0]], 0.5 * width[keep[1]]])
    return np.asarray(best)


def positions_at(recording: Recording, robot: int, times: Array) -> Array:
    """Where a robot was at absolute times (k,) within the run: (k, d)."""
    steps = len(recording.accelerations)
    k = np.clip(np.searchsorted(recording.times, times, side="right") - 1, 0, max(steps - 1, 0))
    e = (times - recording.times[k])[:, None]
    if not steps:
        return np.asarray(recording.positions[k, robot])
    velocity, push = recording.velocities[k, robot], recording.accelerations[k, robot]
    return np.asarray(recording.positions[k, robot] + e * (velocity + 0.5 * e * push))


def _closest(recording: Recording, robot: int, obstacle: Obstacle, steps: int) -> Closest:
    """The closest approach within the first `steps` of a run."""
    first, last = obstacle.trajectory.span
    start, end = max(first, float(recording.times[0])), min(last, float(recording.times[steps]))
    if start > end:
        return Closest(np.inf, np.inf)
    inner = recording.times[(recording.times > start) & (recording.times < end)]
    breaks = obstacle.trajectory.breaks(start, end)
    times = np.unique(np.concatenate([[start], inner, breaks, [end]]))
    own = np.linalg.norm(recording.accelerations[:, robot], axis=1).max(initial=0.0)
    bend = (own + obstacle.trajectory.acceleration_bound(start, end)) / 8.0 if start < end else 0.0
    best = Closest(np.inf, start)
    for pair in pairs(obstacle.shape, recording.shapes[robot]):
        best = _closest_parts(recording, robot, obstacle, pair, times, bend, best)
    return best


def _closest_parts(
    recording: Recording, robot: int, obstacle: Obstacle, pair: Pair, times: Array, bend: float, best: Closest
) -> Closest:
    """The closest approach of two parts if it is closer than `best`, else that."""

    def corners(at: Array) -> Array:
        return differences(obstacle, pair, at, positions_at(recording, robot, at))

    def nearer(at: Array, q: Array) -> Closest:
        gap = signed(q) - pair.radius
        k = int(np.argmin(gap))
        return min(best, Closest(float(gap[k]), float(at[k])), key=lambda closest: closest.clearance)

    points = corners(times)
    best = nearer(times, points)
    a, b, p, q = times[:-1], times[1:], points[:-1], points[1:]
    for _ in range(60):
        turned = _turn(obstacle, pair, a, b)
        low = lowest(p, q, turned + bend * (b - a) ** 2) - pair.radius
        keep = low < best.clearance - METRIC
        if best.clearance < 0.0 and p.shape[1] > 1:
            # Hulls tell nothing of depth: overlapping bodies are halved to the end.
            keep &= b - a > FINEST
        if not np.any(keep):
            break
        a, b, p, q = a[keep], b[keep], p[keep], q[keep]
        middle = 0.5 * (a + b)
        m = corners(middle)
        best = nearer(middle, m)
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        p, q = np.concatenate([p, m]), np.concatenate([m, q])
    return best


def _turn(obstacle: Obstacle, pair: Pair, a: Array, b: Array) -> Array:
    """By how much corners leave their straight line from a to b (k,) since the body turns evenly in between [m]."""
    if not obstacle.turns:
        return np.zeros(len(a))
    change = np.linalg.norm(obstacle.direction(b) - obstacle.direction(a), axis=1)
    reach = float(np.linalg.norm(pair.obstacle.corners, axis=1).max())
    # Half a turn between two times tells nothing of what lies between.
    return np.where(change < 1.0, 0.25 * reach * change**2, 2.0 * reach)
