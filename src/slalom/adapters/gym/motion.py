"""Motion of the obstacles of a scenario at the ends of equal steps, and how far it leaves the straight line between."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.kernels.arrays import Flags, Indices
from slalom.model.shape import Ball, Disc
from slalom.obstacle import Obstacle
from slalom.sim.scenario import Scenario
from slalom.sim.shape_distance import segment_distance

GYM_BLOCK: Final = 64
"""[1] Steps for which the motion of obstacles is computed at once, for each world.

Larger: more memory, about 1 kB for each obstacle and 16 steps, and more work for episodes that end early. Smaller:
slower steps.
"""


class Motion:
    """Discs, balls and walls of a scenario, computed in blocks of GYM_BLOCK steps.

    Attributes:
        moving: n discs or balls. radii: (n,) [m].
        walls: m obstacles, one for each wall. ends: (m, 2, d) [m] of walls. wall_radii: (m,) [m].

    Args:
        keep: whether to keep all blocks, for scenarios of several episodes.

    Raises:
        InvalidInput: an obstacle that is no disc, no ball and no wall at rest.
    """

    def __init__(self, scenario: Scenario, period: float, *, keep: bool = False) -> None:
        self.start = scenario.start
        self.period = period
        d = scenario.dimension
        self.moving = [each for each in scenario.obstacles if isinstance(each.shape, Disc | Ball)]
        self.radii = np.array([each.shape.bounding_radius for each in self.moving])
        self.walls: list[Obstacle] = []
        ends: list[Array] = []
        wall_radii: list[float] = []
        for obstacle in scenario.obstacles:
            if not isinstance(obstacle.shape, Disc | Ball):
                for corners, radius in _segments(obstacle):
                    self.walls.append(obstacle)
                    ends.append(corners)
                    wall_radii.append(radius)
        self.ends, self.wall_radii = np.array(ends).reshape(-1, 2, d), np.array(wall_radii)
        self._blocks: dict[int, _Block] = {}
        self._keep = keep

    def at(self, step: int) -> tuple[Array, Array, Flags]:
        """Positions (n, d) [m], velocities (n, d) [m/s] and existence (n,) at the start of a step."""
        block, k = self._block(step), step % GYM_BLOCK
        return block.positions[k], block.velocities[k], block.there[k]

    def during(self, step: int) -> tuple[Array, Flags]:
        """Largest distance (n,) [m] from the chord of a step, and existence (n,) at any time of it."""
        block, k = self._block(step), step % GYM_BLOCK
        return block.bends[k], block.during[k]

    def _block(self, step: int) -> "_Block":
        number = step // GYM_BLOCK
        found = self._blocks.get(number)
        if found is None:
            if not self._keep:
                # An episode goes on by one step at a time: it needs this block and the one before.
                self._blocks.pop(number - 2, None)
            found = self._blocks[number] = self._computed(number * GYM_BLOCK)
        return found

    def _computed(self, first: int) -> "_Block":
        """The block that begins with a step."""
        times: Array = np.asarray(self.start + self.period * (first + np.arange(GYM_BLOCK + 1)), np.float64)
        n = len(self.moving)
        d = self.ends.shape[2]
        k = GYM_BLOCK
        exists, during = np.zeros((k, n), np.bool_), np.zeros((k, n), np.bool_)
        block = _Block(np.zeros((k, n, d)), np.zeros((k, n, d)), exists, np.zeros((k, n)), during)
        for j, obstacle in enumerate(self.moving):
            trajectory, (start, end) = obstacle.trajectory, obstacle.trajectory.span
            within = np.clip(times, start, end)
            block.positions[:, j], block.velocities[:, j] = (
                trajectory.position(within[:-1]),
                trajectory.velocity(within[:-1]),
            )
            exists[:, j] = (start <= times[:-1]) & (times[:-1] <= end)
            during[:, j] = (start < times[1:]) & (times[:-1] < end)
            if within[0] < within[-1]:
                partly = during[:, j] & ((times[:-1] < start) | (times[1:] > end))
                block.bends[:, j] = _bends(obstacle, float(within[0]), float(within[-1]), times)
                block.bends[partly, j] += self.period * trajectory.speed_bound(float(within[0]), float(within[-1]))
        return block


class _Block(NamedTuple):
    """Motion of n obstacles during k steps."""

    positions: Array  # (k, n, d) [m] at the begins
    velocities: Array  # (k, n, d) [m/s]
    there: Flags  # (k, n)
    bends: Array  # (k, n) [m]
    during: Flags  # (k, n)


def _segments(obstacle: Obstacle) -> list[tuple[Array, float]]:
    """Ends (2, d) [m] and radius [m] of each wall of an obstacle."""
    parts = obstacle.shape.parts
    if not obstacle.at_rest or any(len(part.corners) > 2 for part in parts):
        raise InvalidInput(
            f"obstacle {obstacle.name!r}: expected a disc, a ball or walls at rest (Polyline, Capsule), "
            f"found {type(obstacle.shape).__name__} on {type(obstacle.trajectory).__name__}"
        )
    axis, found = obstacle.direction(0.0), []
    for corners, radius in parts:
        if corners.shape[1] == 2:
            corners = corners[:, :1] * axis + corners[:, 1:] * np.array([-axis[1], axis[0]])
        ends = obstacle.trajectory.position(0.0) + corners
        found.append((np.stack([ends[0], ends[-1]]), radius))
    return found


def _bends(obstacle: Obstacle, begin: float, end: float, times: Array) -> Array:
    """Bounds (k,) [m] of the distance from the chord between times (k + 1,) [s].

    A curve with |acceleration| <= M stays within M h^2 / 8 of its chord. A jump of the velocity by c at the time s of a
    step adds at most c s (h - s) / h.
    """
    trajectory, h = obstacle.trajectory, times[1] - times[0]
    if not len(trajectory.breaks(begin, end)):
        return np.full(len(times) - 1, trajectory.acceleration_bound(begin, end) * h * h / 8.0)
    path = trajectory.path(begin, end)
    width, p = np.diff(path.times)[:, None], path.points
    second = np.maximum(
        np.linalg.norm(p[:, 2] - 2.0 * p[:, 1] + p[:, 0], axis=1),
        np.linalg.norm(p[:, 3] - 2.0 * p[:, 2] + p[:, 1], axis=1),
    )
    curvature = 6.0 * second / width[:, 0] ** 2
    jumps = np.linalg.norm(3.0 * ((p[1:, 1] - p[1:, 0]) / width[1:] - (p[:-1, 3] - p[:-1, 2]) / width[:-1]), axis=1)
    # Pieces that each step meets; the last step may end after the path.
    low = np.clip(np.searchsorted(path.times, times[:-1], side="right") - 1, 0, len(p) - 1)
    high = np.clip(np.searchsorted(path.times, times[1:], side="left") - 1, 0, len(p) - 1)
    bends = np.array([curvature[a : b + 1].max() for a, b in zip(low, high)]) * h * h / 8.0
    bends += 2.0 * path.error.max(initial=0.0)
    knots = path.times[1:-1]
    step = np.clip(np.searchsorted(times, knots, side="right") - 1, 0, len(bends) - 1)
    since = np.clip(knots - times[step], 0.0, h)
    np.add.at(bends, step, jumps * since * (h - since) / h)
    return np.asarray(bends)


def nearest_on(ends: Array, points: Array) -> Array:
    """Offsets (..., m, d) [m] from points (..., d) to the nearest points of segments between `ends` (..., m, 2, d)."""
    begin, along = ends[..., 0, :] - points[..., None, :], ends[..., 1, :] - ends[..., 0, :]
    square = np.maximum((along * along).sum(axis=-1), 1e-300)
    share = np.clip(-(begin * along).sum(axis=-1) / square, 0.0, 1.0)
    return np.asarray(begin + share[..., None] * along)


def least_distances(before: Array, after: Array) -> Array:
    """Distances (...) [m] of the origin to the segments from `before` to `after`, both (..., d) [m]."""
    shape, d = before.shape[:-1], before.shape[-1]
    return segment_distance(before.reshape(-1, d), after.reshape(-1, d)).reshape(shape)


# ---------------------------------------------------------------------------------------------------------------------
# Bodies that the robots of many worlds can meet, relative to each robot, as arrays.


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
        self.motions = list(motions)
        self._robots = robots
        w = len(motions)
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
