"""Clearances of a recorded run to its obstacles, where bounding balls show that few of them can be the nearest.

The motion of a robot during a block of steps lies within a ball, and so does each part of an obstacle. The distances of
the balls bound the clearance from below and above. By code independent of the kernels that decide.
"""

from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.kernels.arrays import Flags, Indices
from slalom.obstacle import Obstacle
from slalom.obstacle.minkowski import outline_parts
from slalom.obstacle.periodic import to_nearest
from slalom.sim.measure.closest_approach import (
    Balls,
    bounding_balls,
    closest_approaches,
    closest_image,
    last_step,
)
from slalom.sim.measure.recording import Recording
from slalom.tolerances import METRIC


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
            found[k, j] = closest_image(recording, k, recording.obstacles[j], some).clearance
    return found


def _part_balls(recording: Recording, balls: Balls) -> PartBalls:
    """The balls of the parts of all obstacles in the blocks of `balls`."""
    times, counts = recording.times, [len(obstacle.shape.parts) for obstacle in recording.obstacles]
    begin, middle, end = times[balls.first], times[balls.middle], times[balls.last]
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
    shape, present = recording.shapes[robot], balls.first < last_step(recording, robot)
    relative = parts.centers - balls.centers[:, robot]
    inner = relative - shape.parts[0].corners.mean(axis=0)
    if recording.period is not None:
        relative, inner = (x + to_nearest(x, recording.period) for x in (relative, inner))
    reach = balls.radii[:, robot] + shape.bounding_radius + parts.radii[:, None] + parts.moved
    low = np.linalg.norm(relative, axis=2) - reach
    touch = shape.parts[0].radius + parts.rounding[:, None]
    high = np.linalg.norm(inner, axis=2) - touch
    whole = balls.middle <= last_step(recording, robot)
    low = np.where(parts.exists & present, low, np.inf).min(axis=1)
    return low, np.where(parts.there & whole, high, np.inf).min(axis=1)
