"""Everything that the robots of many worlds can meet, relative to each robot, as arrays."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slalom.adapters.gym.motion import Motion, nearest_on
from slalom.checks import Array
from slalom.kernels.arrays import Flags, Indices


class Surroundings(NamedTuple):
    """What each of W x R robots can meet: B discs or balls, namely obstacles, robots and the nearest points of walls.

    Of the B bodies the first are `moving` obstacles, then the R robots, the rest are walls.
    """

    offsets: Array  # (W, R, B, d) [m] from the robot
    velocities: Array  # (W, R, B, d) [m/s] relative to the robot
    radii: Array  # (W, B) [m]
    there: Flags  # (W, R, B) whether it exists and is not the robot itself
    moving: int


def surroundings(
    motions: Sequence[Motion], steps: Indices, position: Array, velocity: Array, radii: Array, there: Flags
) -> Surroundings:
    """What robots at `position` (W, R, d) [m] with `radii` (W, R) [m] can meet at the begin of `steps` (W,)."""
    w, r, d = position.shape
    o, m = max(len(each.moving) for each in motions), max(len(each.walls) for each in motions)
    places, speeds = np.zeros((w, o + r, d)), np.zeros((w, o + r, d))
    ends, sizes = np.zeros((w, m, 2, d)), np.zeros((w, o + r + m))
    exist = np.zeros((w, o + r + m), np.bool_)
    for k, (motion, step) in enumerate(zip(motions, steps.tolist())):
        n, walls = len(motion.moving), len(motion.walls)
        places[k, :n], speeds[k, :n], exist[k, :n] = motion.at(step)
        sizes[k, :n] = motion.radii
        ends[k, :walls], sizes[k, o + r : o + r + walls] = motion.ends, motion.wall_radii
        exist[k, o + r : o + r + walls] = True
    places[:, o : o + r], speeds[:, o : o + r] = position, velocity
    sizes[:, o : o + r], exist[:, o : o + r] = radii, there
    offsets = np.concatenate([places[:, None] - position[:, :, None], nearest_on(ends[:, None], position)], axis=2)
    relative = np.concatenate([speeds, np.zeros((w, m, d))], axis=1)[:, None] - velocity[:, :, None]
    others = np.broadcast_to(exist[:, None], (w, r, o + r + m)).copy()
    others[:, np.arange(r), o + np.arange(r)] = False
    return Surroundings(offsets, relative, sizes, others, o)


def observed(around: Surroundings, radii: Array, sight: Array, max_speed: Array, nearest: int) -> Array:
    """What robots with `radii`, `sight` and `max_speed` (W, R) see of the nearest bodies: (W, R, nearest, 2 d + 2).

    A row is 1, the offset in units of sight, the relative velocity in units of twice max_speed, and the sum of both
    radii in units of sight, at most 1. Rows are sorted by clearance; a row without a body within sight is 0.
    """
    apart = np.linalg.norm(around.offsets, axis=-1)
    both = around.radii[:, None] + radii[..., None]
    gaps = np.where(around.there & (apart <= sight[..., None]), apart - both, np.inf)
    rows = np.argsort(gaps, axis=-1, kind="stable")[..., :nearest]
    pick = rows[..., None]
    seen = np.take_along_axis(gaps, rows, axis=-1) < np.inf
    far = sight[..., None, None]
    fields = [
        np.ones_like(pick),
        np.take_along_axis(around.offsets, pick, axis=2) / far,
        shortened(np.take_along_axis(around.velocities, pick, axis=2) / (2.0 * max_speed[..., None, None])),
        np.minimum(np.take_along_axis(both, rows, axis=-1)[..., None] / far, 1.0),
    ]
    table = np.where(seen[..., None], np.concatenate(fields, axis=-1), 0.0)
    missing = nearest - rows.shape[-1]
    return np.pad(table, ((0, 0), (0, 0), (0, missing), (0, 0))) if missing else table


def shortened(vectors: Array) -> Array:
    """Vectors (..., d), those longer than 1 with length 1."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1.0))
