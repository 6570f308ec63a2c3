"""Bodies that the robots of many worlds can meet, relative to each robot, as arrays."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slalom.adapters.gym.motion import Motion, nearest_on
from slalom.checks import Array
from slalom.kernels.arrays import Flags, Indices


class Surroundings(NamedTuple):
    """Discs or balls B that each of W x R robots can meet: obstacles, robots and the nearest points of walls.

    Of the B bodies the first are `moving` obstacles, then the R robots, the rest are walls.
    """

    offsets: Array  # (W, R, B, d) [m] from the robot
    velocities: Array  # (W, R, B, d) [m/s] relative to the robot
    radii: Array  # (W, B) [m]
    there: Flags  # (W, R, B) whether it exists and is not the robot itself
    moving: int


class Bodies:
    """The bodies of all worlds: as many moving obstacles, robots and walls as the world with the most has."""

    def __init__(self, motions: Sequence[Motion], robots: int) -> None:
        self.motions, self._robots, w = list(motions), robots, len(motions)
        self.moving, walls = max(len(each.moving) for each in motions), max(len(each.walls) for each in motions)
        first, d = self.moving + robots, motions[0].ends.shape[2]
        self._places, self._speeds = np.zeros((w, first, d)), np.zeros((w, first, d))
        self._ends, self._radii = np.zeros((w, walls, 2, d)), np.zeros((w, first + walls))
        self._exist = np.zeros((w, first + walls), np.bool_)
        for k in range(w):
            self._write(k)

    def replaced(self, w: int, motion: Motion) -> "Bodies":
        """The bodies with another motion in world w; the same object if it has space for it."""
        self.motions[w] = motion
        if len(motion.moving) > self.moving or len(motion.walls) > self._ends.shape[1]:
            return Bodies(self.motions, self._robots)
        self._write(w)
        return self

    def _write(self, w: int) -> None:
        """Write the values that are constant during an episode of world w."""
        motion, first = self.motions[w], self.moving + self._robots
        n, m = len(motion.moving), len(motion.walls)
        self._exist[w], self._radii[w, :n] = False, motion.radii
        self._ends[w, :m], self._radii[w, first : first + m] = motion.ends, motion.wall_radii
        self._exist[w, first : first + m] = True

    def around(self, steps: Indices, position: Array, velocity: Array, radii: Array, there: Flags) -> Surroundings:
        """Bodies that robots at `position` (W, R, d) [m] with `radii` (W, R) [m] can meet when `steps` (W,) begin."""
        (w, r, d), o = position.shape, self.moving
        for k, (motion, step) in enumerate(zip(self.motions, steps.tolist())):
            n = len(motion.moving)
            self._places[k, :n], self._speeds[k, :n], self._exist[k, :n] = motion.at(step)
        self._places[:, o:], self._speeds[:, o:] = position, velocity
        self._radii[:, o : o + r], self._exist[:, o : o + r] = radii, there
        m = self._ends.shape[1]
        offsets, relative = np.empty((w, r, o + r + m, d)), np.empty((w, r, o + r + m, d))
        offsets[:, :, : o + r] = self._places[:, None] - position[:, :, None]
        offsets[:, :, o + r :] = nearest_on(self._ends[:, None], position)
        relative[:, :, : o + r], relative[:, :, o + r :] = self._speeds[:, None], 0.0
        relative -= velocity[:, :, None]
        others = np.repeat(self._exist[:, None], r, axis=1)
        others[:, np.arange(r), o + np.arange(r)] = False
        return Surroundings(offsets, relative, self._radii.copy(), others, o)

    def during(self, steps: Indices) -> tuple[Array, Flags]:
        """Distances from the chords (W, o) [m] of the moving obstacles in `steps` (W,), and whether they exist then."""
        bends = np.zeros((len(steps), self.moving))
        exist = np.zeros(bends.shape, np.bool_)
        for k, (motion, step) in enumerate(zip(self.motions, steps.tolist())):
            n = len(motion.moving)
            bends[k, :n], exist[k, :n] = motion.during(step)
        return bends, exist


def observed(around: Surroundings, radii: Array, sight: Array, max_speed: Array, nearest: int) -> Array:
    """Observations (W, R, nearest, 2 d + 2) of the nearest bodies by robots with `radii`, `sight`, `max_speed` (W, R).

    A row is 1, the offset, the relative velocity, and the sum of both radii, at most 1. Lengths are in units of sight,
    velocities in units of twice max_speed. Rows are sorted by clearance; a row without a body within sight is 0.
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
