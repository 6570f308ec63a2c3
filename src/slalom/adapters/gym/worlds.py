"""Many worlds of robots that follow actions, as arrays: one step of all, what robots observe, rewards and outcomes.

W worlds have R robots each. Robots are double integrators that hold an acceleration during a step.
"""

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, array, array_of, known, whole
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import ARRIVAL_FILTER, CERTIFIED, REST
from slalom.choice.control_obstacle import ControlObstacle
from slalom.kernels.arrays import Flags, Indices
from slalom.model.response import Acceleration
from slalom.model.shape import Ball, Disc
from slalom.model.state import State
from slalom.model.trajectory import ConstantAcceleration, Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow
from slalom.sim.run.states import integrate
from slalom.sim.scenario import Scenario
from slalom.sim.shape_distance import segment_distance

# Motion of the obstacles of a scenario at the ends of equal steps, and how far it leaves the straight line between.


GYM_BLOCK: Final = 64
"""[1] Steps for which the motion of obstacles is computed at once, for each world. Larger: more memory, about 1 kB for
each obstacle and 16 steps, and more work for episodes that end early. Smaller: slower steps."""


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

    def wall_distances(self, position: Array, way: Array) -> Array:
        """Distances (W, R, k) [m] from `position` (W, R, 2) [m] to walls along the directions `way` (2, k).

        A wall with a radius is met at its two sides and its two ends; inf where none is met.
        """
        exist, radii = self._exist[:, self.moving + self._robots :], self._radii[:, self.moving + self._robots :]
        begin = self._ends[:, None, :, 0] - position[:, :, None]
        end = self._ends[:, None, :, 1] - position[:, :, None]
        along = end - begin
        length = np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-300)
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / length
        least, radius = np.full((*position.shape[:2], way.shape[1]), np.inf), radii[:, None, :, None]
        there = exist[:, None, :, None]
        for side in (-1.0, 1.0):
            # The line of a side: normal . (t way - begin) = side radius, between both ends.
            away = (normal * begin).sum(axis=-1)[..., None] + side * radius
            with np.errstate(divide="ignore", invalid="ignore"):
                t = away / (normal @ way)
                share = ((t[..., None] * way.T - begin[..., None, :]) * (along / length**2)[..., None, :]).sum(axis=-1)
            hit = there & (t >= 0.0) & (share >= 0.0) & (share <= 1.0)
            least = np.minimum(least, np.where(hit, t, np.inf).min(axis=2, initial=np.inf))
        for corner in (begin, end):
            ahead = corner @ way
            root = radius * radius - (corner * corner).sum(axis=-1)[..., None] + ahead * ahead
            hit = there & (root >= 0.0) & (ahead > 0.0)
            t = np.where(hit, ahead - np.sqrt(np.maximum(root, 0.0)), np.inf)
            least = np.minimum(least, t.min(axis=2, initial=np.inf))
        return np.asarray(least)

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


# Least clearance of the robots of many worlds during a step, in continuous time.
#
# A lower bound comes from the chords of relative motion. Where it is not above 0, the clearance is that of the control
# obstacle from which decisions are made.


class Moved(NamedTuple):
    """States (W, R, d) at the start of a step, and the accelerations during it."""

    position: Array
    velocity: Array
    acceleration: Array


def least_clearances(
    worlds: "Worlds", moved: Moved, steps: Indices, some: Flags, before: Surroundings, after: Surroundings
) -> Array:
    """Lower bounds (W, R) [m] of the least clearance of `some` robots (W, R) during `steps` (W,); inf for the others.

    Above 0 they are below the true ones by at most M h^2 / 8, with the step h and the relative acceleration M. Near a
    wall they are below by at most the distance that the robot drives in the step. Otherwise they are exact up to
    CERTIFIED.
    """
    (w, r, b) = before.there.shape
    o = before.moving
    h = worlds.period
    own = np.linalg.norm(moved.acceleration, axis=-1) * h * h / 8.0
    bends = np.zeros((w, b))
    there = before.there.copy()
    bends[:, :o], exist = worlds.bodies.during(steps)
    bends[:, o : o + r], there[..., :o] = own, exist[:, None]
    distance = least_distances(before.offsets, after.offsets)
    # The nearest point of a wall moves along it: the distance changes at most as fast as the robot moves.
    way = np.linalg.norm(h * moved.velocity + 0.5 * h * h * moved.acceleration, axis=-1)[..., None]
    ends = (np.linalg.norm(each.offsets[:, :, o + r :], axis=-1) for each in (before, after))
    distance[..., o + r :] = np.maximum(0.5 * (sum(ends) - way), 0.0)
    lower = distance - own[..., None] - bends[:, None] - before.radii[:, None] - worlds.robots.radius[..., None]
    lower = np.where(there & some[..., None], lower, np.inf)
    least = lower.min(axis=-1, initial=np.inf)
    for k, j in np.argwhere(least <= 0.0).tolist():
        close = np.flatnonzero(lower[k, j] <= 0.0)
        others = [_body(worlds, moved, k, int(body), o, worlds.now(k) - h) for body in close]
        window = ObstacleWindow(others, worlds.now(k) - h, h)
        state, shape = State(moved.position[k, j], moved.velocity[k, j]), worlds.scenarios[k].robots[j].shape
        exact = float(ControlObstacle(Acceleration(), state, window, shape).clearance(moved.acceleration[k, j]))
        rest = lower[k, j, lower[k, j] > 0.0]
        least[k, j] = min(exact, float(rest.min(initial=np.inf)))
    return np.asarray(least)


def _body(worlds: "Worlds", moved: Moved, w: int, body: int, moving: int, start: float) -> Obstacle:
    """A body of `Surroundings` as an obstacle."""
    r = body - moving
    if r < 0:
        return worlds.bodies.motions[w].moving[body]
    robots = worlds.scenarios[w].robots
    if r < len(robots):
        path = ConstantAcceleration(moved.position[w, r], moved.velocity[w, r], moved.acceleration[w, r], start)
        return Obstacle(robots[r].shape, path)
    return worlds.bodies.motions[w].walls[r - len(robots)]


RUNNING, ARRIVED, COLLISION, TIME = range(4)
OUTCOMES: Final = ("running", "arrived", "collision", "time")
COMMANDS: Final = ("acceleration", "velocity", "unicycle", "discrete")
DIRECTIONS: Final = 8
"""[1] Directions of the accelerations of discrete actions. Larger: finer actions, and more of them to learn."""


class Transition(NamedTuple):
    """Result of a step of W worlds with R robots; 0 and inf for robots that did not act."""

    rewards: Array  # (W, R)
    clearances: Array  # (W, R) [m], see `least_clearances`
    outcomes: Indices  # (W, R) index in OUTCOMES


class _Robots:
    """Settings (W, R) of all robots."""

    def __init__(self, shape: tuple[int, int]) -> None:
        self.max_speed = np.zeros(shape)
        self.max_acceleration = np.zeros(shape)
        self.radius = np.zeros(shape)
        self.sight = np.zeros(shape)
        self.tolerance = np.zeros(shape)
        self.distance = np.zeros(shape)
        self.stop, self.chases = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)

    def set(self, w: int, scenario: Scenario) -> None:
        """Write the settings of world w; `sight` is how far a robot drives at max_speed within the horizon [m]."""
        robots = scenario.robots
        self.max_speed[w] = [robot.limits.max_speed for robot in robots]
        self.max_acceleration[w] = [robot.limits.max_acceleration for robot in robots]
        self.radius[w] = [robot.shape.bounding_radius for robot in robots]
        self.sight[w] = self.max_speed[w] * scenario.horizon
        self.tolerance[w], self.stop[w] = [r.goal.tolerance for r in robots], [r.goal.stop for r in robots]
        self.chases[w] = [not isinstance(robot.goal.trajectory, Stationary) for robot in robots]


class Worlds:
    """W worlds with the same number of robots and the same period.

    Attributes:
        scenarios: W, one for each world. position, velocity: (W, R, d) [m, m/s]. steps: (W,) made in this episode.
        acting: (W, R) whether a robot follows actions. there: (W, R) whether it is in the scene. A robot that collided
            or passed its goal is not; a robot that stops at its goal stays.

    Args:
        nearest: number of other bodies that a robot observes. command: see `accelerations`.
        observe: a function of the worlds that returns the observations (W, R, k); None: see `observations`.
        reward: a function of the worlds after a step and of its `Transition` that returns rewards (W, R); None: see
            `step`.

    Raises:
        InvalidInput: a world that repeats, robots that are no discs or balls, worlds that differ in their number of
            robots, their dimension or their period; see also `Motion`.
    """

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        nearest: int,
        command: str,
        observe: "Callable[[Worlds], Array] | None" = None,
        reward: "Callable[[Worlds, Transition], Array] | None" = None,
    ) -> None:
        first, w = scenarios[0], len(scenarios)
        self.kind = _kind(first)
        r, self.dimension, self.period = self.kind
        self.nearest, self.command = whole(nearest, "nearest", 1), known(command, "command", COMMANDS)
        if self.dimension != 2 and command in ("unicycle", "discrete"):
            raise InvalidInput(f"command: expected 'acceleration' or 'velocity' in space, found {command!r}")
        self.observe, self.reward = observe, reward
        # (W, R, d) [m/s^2] that robots follow in the next step in place of their actions, as a filter sets them.
        self.certified: Array | None = None
        self.scenarios = list(scenarios)
        self.bodies = Bodies([Motion(each, self.period) for each in scenarios], r)
        self.position, self.velocity = np.zeros((w, r, self.dimension)), np.zeros((w, r, self.dimension))
        self.steps, self.acting = np.zeros(w, np.int64), np.zeros((w, r), np.bool_)
        self.there, self.robots = np.ones((w, r), np.bool_), _Robots((w, r))
        self._goal, self._goal_velocity = np.zeros_like(self.position), np.zeros_like(self.position)
        self._around: Surroundings | None = None
        for k, scenario in enumerate(scenarios):
            self.load(k, scenario)

    @property
    def action_shape(self) -> tuple[int, ...]:
        """The shape of the action of one robot."""
        return () if self.command == "discrete" else (self.dimension,)

    @property
    def size(self) -> int:
        """Length of an observation."""
        if self.observe is not None:
            return int(self.observe(self).shape[-1])
        return 3 * self.dimension + self.nearest * (2 * self.dimension + 2)

    def load(self, w: int, scenario: Scenario, motion: Motion | None = None) -> None:
        """Begin a new episode in world w, with the motion of its obstacles if that was made before."""
        if _kind(scenario) != self.kind:
            raise InvalidInput(
                f"scenario: expected the number of robots, the dimension and the period {self.kind} in every world, "
                f"found {_kind(scenario)}"
            )
        for robot in scenario.robots:
            if robot.appears is not None and robot.appears > scenario.start:
                raise InvalidInput(f"{robot.name}.appears: expected none in an environment, found {robot.appears:g} s")
            if not isinstance(robot.shape, Disc | Ball):
                raise InvalidInput(f"{robot.name}.shape: expected a disc or a ball, found {type(robot.shape).__name__}")
        self.scenarios[w] = scenario
        self.bodies = self.bodies.replaced(w, motion or Motion(scenario, self.period))
        self.position[w] = [robot.state.position for robot in scenario.robots]
        self.velocity[w] = [robot.state.velocity for robot in scenario.robots]
        self.steps[w] = 0
        self.acting[w] = True
        self.there[w] = True
        self.robots.set(w, scenario)
        self._set_goals(w, range(len(scenario.robots)))
        away = np.linalg.norm(self._goal[w] - self.position[w], axis=1)
        self.robots.distance[w] = np.maximum(away, self.robots.tolerance[w])
        self._around = None

    def now(self, w: int = 0) -> float:
        """Absolute time [s] in world w."""
        return float(self.scenarios[w].start + self.steps[w] * self.period)

    def state(self, w: int = 0, r: int = 0) -> State:
        """State of a robot."""
        return State(self.position[w, r], self.velocity[w, r])

    def accelerations(self, actions: Array) -> Array:
        """Accelerations (W, R, d) [m/s^2] by which robots follow `actions` (W, R, d) within their limits.

        An action is the acceleration in units of the largest one. With command "velocity" it is the velocity at the end
        of the step in units of max_speed. With "unicycle" it is the acceleration ahead and to the left: along the
        velocity, or towards the goal at rest; the robot brakes to rest and never backwards. With "discrete" it is a
        whole number (W, R): 0 for none, k for the largest acceleration in direction 2 pi (k - 1) / DIRECTIONS. The
        acceleration is shortened to the largest one, then the velocity at the end of the step to max_speed.

        Raises:
            InvalidInput: a discrete action that is not a whole number from 0 to DIRECTIONS.
        """
        max_speed, most = self.robots.max_speed[..., None], self.robots.max_acceleration[..., None]
        if self.command == "velocity":
            share = (shortened(actions) * max_speed - self.velocity) / (self.period * most)
        elif self.command == "unicycle":
            share = self._ahead(actions)
        elif self.command == "discrete":
            number = np.asarray(actions)
            if not np.all((number >= 0) & (number <= DIRECTIONS) & (number == np.floor(number))):
                raise InvalidInput(f"action: expected whole numbers from 0 to {DIRECTIONS}, found {number.ravel()}")
            angle = 2.0 * np.pi * (number - 1) / DIRECTIONS
            share = np.where(number[..., None] > 0, np.stack([np.cos(angle), np.sin(angle)], axis=-1), 0.0)
        else:
            share = actions
        after = self.velocity + self.period * most * shortened(share)
        return np.asarray((max_speed * shortened(after / max_speed) - self.velocity) / self.period)

    def _ahead(self, actions: Array) -> Array:
        """Accelerations (W, R, 2) in units of the largest ones, of `actions` (W, R, 2) ahead and to the left."""
        speed = np.linalg.norm(self.velocity, axis=-1, keepdims=True)
        away = self._goal - self.position
        ahead = np.where(speed > REST, self.velocity, away)
        ahead = ahead / np.maximum(np.linalg.norm(ahead, axis=-1, keepdims=True), 1e-300)
        left = np.stack([-ahead[..., 1], ahead[..., 0]], axis=-1)
        given = shortened(actions)
        # No more braking than to rest.
        slowest = -speed / (self.period * self.robots.max_acceleration[..., None])
        return np.asarray(np.maximum(given[..., :1], slowest) * ahead + given[..., 1:] * left)

    def step(self, actions: Array, worlds: Flags | None = None) -> Transition:
        """Make a step in all worlds, or in some of them (W,).

        The reward is the difference of two shares: the decrease of the distance to the goal over the initial one, and
        the period over the duration. An arrival adds 1, a collision subtracts 1.

        Raises:
            InvalidInput: actions of another shape, or not finite.
        """
        shape = (*self.acting.shape, *self.action_shape)
        wanted, some = array_of(actions, "action", shape), np.ones(len(self.steps), np.bool_)
        followed = self.accelerations(wanted) if self.certified is None else self.certified
        self.certified = None
        some = some if worlds is None else worlds
        moves = self.acting & some[:, None]
        # A robot that has stopped at its goal stays there.
        held = np.where(self.acting[..., None], followed, -self.velocity / self.period)
        acceleration = np.where(some[:, None, None], held, 0.0)
        around, distance = self._surroundings(), np.linalg.norm(self._goal - self.position, axis=-1)
        moved = Moved(self.position, np.where(some[:, None, None], self.velocity, 0.0), acceleration)
        self.position, after = integrate(moved.position, moved.velocity, acceleration, self.period)
        self.velocity = np.where(some[:, None, None], after, self.velocity)
        steps = self.steps
        self.steps = self.steps + some
        self._around = None
        for k in np.flatnonzero(self.robots.chases.any(axis=1) & some).tolist():
            self._set_goals(k, np.flatnonzero(self.robots.chases[k]).tolist())
        clearance = least_clearances(self, moved, steps, moves, around, self._surroundings())
        return self._ends(moves, clearance, distance, moved, steps)

    def _ends(self, moves: Flags, clearance: Array, before: Array, moved: Moved, steps: Indices) -> Transition:
        """Rewards and outcomes of the robots that moved from `moved` and `steps` (W,) on.

        `before` (W, R) [m] is their distance to the goal before.
        """
        robots, distance = self.robots, np.linalg.norm(self._goal - self.position, axis=-1)
        slow = np.linalg.norm(self._goal_velocity - self.velocity, axis=-1) <= robots.tolerance
        durations = np.array([scenario.duration for scenario in self.scenarios])
        outcome = np.where((self.steps + 0.5) * self.period > durations, TIME, RUNNING)[:, None]
        there = (distance <= robots.tolerance) & (slow | ~robots.stop)
        there |= self._passed(moves & ~there & ~robots.stop, distance, moved, steps)
        outcome = np.where(there, ARRIVED, outcome)
        outcome = np.where(clearance < -CERTIFIED, COLLISION, outcome) * moves
        reward = (before - distance) / robots.distance - (self.period / durations)[:, None]
        reward += np.where(outcome == ARRIVED, 1.0, 0.0) - np.where(outcome == COLLISION, 1.0, 0.0)
        self.acting &= outcome == RUNNING
        gone = (outcome == COLLISION) | ((outcome == ARRIVED) & ~robots.stop)
        if gone.any():
            self.there &= ~gone
            self._around = None
        made = Transition(np.where(moves, reward, 0.0), clearance, outcome)
        if self.reward is None:
            return made
        given = array_of(self.reward(self, made), "rewards", made.rewards.shape)
        return made._replace(rewards=np.where(moves, given, 0.0))

    def _passed(self, some: Flags, distance: Array, moved: Moved, steps: Indices) -> Flags:
        """Which of some robots (W, R) passed their goals during the step: (W, R); `distance` [m] is that at its end."""
        speed = np.maximum(np.linalg.norm(moved.velocity, axis=-1), np.linalg.norm(self.velocity, axis=-1))
        near = distance <= ARRIVAL_FILTER * (self.robots.tolerance + self.period * speed)
        passed = np.asarray(some & (near | self.robots.chases))
        for w, r in np.argwhere(passed).tolist():
            goal, begin = self.scenarios[w].robots[r].goal, self.scenarios[w].start + steps[w] * self.period
            p = moved.position[w, r]
            v = moved.velocity[w, r]
            a = moved.acceleration[w, r]
            passed[w, r] = goal.reached_during(p, v, a, begin, self.period)
        return passed

    def observations(self) -> npt.NDArray[np.float32]:
        """Observations (W, R, size), in [-1, 1].

        First the own velocity in units of max_speed and the offset to the goal in units of sight. Then the velocity of
        the goal relative to the robot in units of twice max_speed, and the nearest bodies, see `bodies.observed`.
        Vectors longer than 1 are shortened to 1. Those of `observe` are as it returns them.
        """
        if self.observe is not None:
            found = array(self.observe(self), "observations")
            if found.ndim != 3 or found.shape[:2] != self.acting.shape:
                raise InvalidInput(
                    f"observations: expected shape {self.acting.shape} and one more, found {found.shape}"
                )
            return found.astype(np.float32)
        robots, (w, r) = self.robots, self.acting.shape
        seen = observed(self._surroundings(), robots.radius, robots.sight, robots.max_speed, self.nearest)
        max_speed = robots.max_speed[..., None]
        own = [
            self.velocity / max_speed,
            shortened((self._goal - self.position) / robots.sight[..., None]),
            shortened((self._goal_velocity - self.velocity) / (2.0 * max_speed)),
            seen.reshape(w, r, -1),
        ]
        # Rounding may leave a length just above 1.
        return np.clip(np.concatenate(own, axis=-1), -1.0, 1.0).astype(np.float32)

    def rays(self, count: int) -> Array:
        """Distances (W, R, count) to the nearest surfaces in directions 2 pi k / count, in units of sight, at most 1.

        In the plane, from the surfaces of the robots, in the axes of the world: as of a laser scanner without noise.
        """
        around = self._surroundings()
        angle = 2.0 * np.pi * np.arange(whole(count, "count", 1)) / count
        way, o = np.stack([np.cos(angle), np.sin(angle)]), around.moving + self.acting.shape[1]
        offsets, radius = around.offsets[:, :, :o], around.radii[:, None, :o, None]
        along, square = offsets @ way, (offsets * offsets).sum(axis=-1)[..., None]
        root = radius * radius - square + along * along
        hit = (root >= 0.0) & (along > 0.0) & around.there[:, :, :o, None]
        discs = np.where(hit, along - np.sqrt(np.maximum(root, 0.0)), np.inf).min(axis=2, initial=np.inf)
        walls = self.bodies.wall_distances(self.position, way)
        found = np.minimum(discs, walls) - self.robots.radius[..., None]
        return np.asarray(np.clip(found / self.robots.sight[..., None], 0.0, 1.0))

    def _surroundings(self) -> Surroundings:
        if self._around is None:
            here = (self.position, self.velocity, self.robots.radius, self.there)
            self._around = self.bodies.around(self.steps, *here)
        return self._around

    def _set_goals(self, w: int, some: Sequence[int]) -> None:
        """Set the positions and velocities of goals to those of now."""
        now = self.now(w)
        for r in some:
            goal = self.scenarios[w].robots[r].goal
            self._goal[w, r], self._goal_velocity[w, r] = goal.position(now), goal.velocity(now)


def _kind(scenario: Scenario) -> tuple[int, int, float]:
    """Number of robots, dimension and period [s]."""
    return len(scenario.robots), scenario.dimension, scenario.dt * scenario.steps_per_decision
