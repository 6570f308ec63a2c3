"""Least clearance of a recorded run, in continuous time, by code that shares nothing with the deciding kernels.

The robot moves on parabolas, obstacles on their true trajectories. Between two times the relative position stays within
M h^2 / 8 of the chord between its ends, M a bound of the relative acceleration; intervals whose bound exceeds what is
known already are dropped, the others halved.
"""

from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.obstacle import Obstacle
from slalom.sim.recording import Recording
from slalom.tolerances import METRIC


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
    touch = float(obstacle.shape.radius + recording.radii[robot])
    inner = recording.times[(recording.times > start) & (recording.times < end)]
    breaks = obstacle.trajectory.breaks(start, end)
    times = np.unique(np.concatenate([[start], inner, breaks, [end]]))
    relative = obstacle.trajectory.position(times) - positions_at(recording, robot, times)
    distance = np.linalg.norm(relative, axis=1)
    nearest = int(np.argmin(distance))
    best, when = float(distance[nearest]), float(times[nearest])
    if start == end:
        return Closest(best - touch, when)
    own = np.linalg.norm(recording.accelerations[:, robot], axis=1).max(initial=0.0)
    bend = (own + obstacle.trajectory.acceleration_bound(start, end)) / 8.0
    a, b, p, q = times[:-1], times[1:], relative[:-1], relative[1:]
    for _ in range(60):
        low = _chord_distance(p, q) - bend * (b - a) ** 2
        keep = low < best - METRIC
        if not np.any(keep):
            break
        a, b, p, q = a[keep], b[keep], p[keep], q[keep]
        middle = 0.5 * (a + b)
        m = obstacle.trajectory.position(middle) - positions_at(recording, robot, middle)
        distance = np.linalg.norm(m, axis=1)
        nearest = int(np.argmin(distance))
        if distance[nearest] < best:
            best, when = float(distance[nearest]), float(middle[nearest])
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        p, q = np.concatenate([p, m]), np.concatenate([m, q])
    return Closest(best - touch, when)


def _chord_distance(p: Array, q: Array) -> Array:
    """Distance of the origin from the segments p to q, (k,)."""
    along = q - p
    square = np.maximum(np.sum(along * along, axis=1), 1e-300)
    share = np.clip(-np.sum(p * along, axis=1) / square, 0.0, 1.0)[:, None]
    return np.asarray(np.linalg.norm(p + share * along, axis=1))
