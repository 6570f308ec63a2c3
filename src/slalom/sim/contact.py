"""Least clearance of a recorded run, in continuous time, by code that shares nothing with the deciding kernels.

The robot moves on parabolas, obstacles on their true trajectories. Between two times the relative position stays within
M h^2 / 8 of the chord between its ends, M a bound of the relative acceleration; intervals whose bound exceeds what is
known already are dropped, the others halved. How deep bodies with corners overlap is looked for to FINEST seconds.
"""

from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.obstacle import Obstacle
from slalom.sim.gaps import Pair, differences, lowest, pairs, signed
from slalom.sim.recording import Recording
from slalom.tolerances import METRIC

FINEST = 1e-3
"""[s]"""


class Closest(NamedTuple):
    """The closest approach to one obstacle."""

    clearance: float  # [m]; inf if the two never exist together
    time: float  # [s] absolute


def closest_approaches(recording: Recording, robot: int = 0) -> list[Closest]:
    """The closest approach of a robot to each obstacle, its clearance at most METRIC above the true one."""
    return [_closest(recording, robot, obstacle) for obstacle in recording.obstacles]


def positions_at(recording: Recording, robot: int, times: Array) -> Array:
    """Where a robot was at absolute times (k,) within the run: (k, d)."""
    steps = len(recording.accelerations)
    k = np.clip(np.searchsorted(recording.times, times, side="right") - 1, 0, max(steps - 1, 0))
    e = (times - recording.times[k])[:, None]
    if not steps:
        return np.asarray(recording.positions[k, robot])
    velocity, push = recording.velocities[k, robot], recording.accelerations[k, robot]
    return np.asarray(recording.positions[k, robot] + e * (velocity + 0.5 * e * push))


def _closest(recording: Recording, robot: int, obstacle: Obstacle) -> Closest:
    first, last = obstacle.trajectory.span
    start, end = max(first, float(recording.times[0])), min(last, float(recording.times[-1]))
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
