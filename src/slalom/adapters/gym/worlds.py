"""Many worlds of robots that follow actions, as arrays: one step of all, what robots observe, rewards and outcomes.

W worlds have R robots each. Robots are double integrators that hold an acceleration during a step.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.adapters.gym.motion import Bodies, Motion, Surroundings, least_distances, observed, shortened
from slalom.base.checks import Array, array_of, known, whole
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import ARRIVAL_FILTER, CERTIFIED
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

# ---------------------------------------------------------------------------------------------------------------------
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


# ---------------------------------------------------------------------------------------------------------------------
# Many worlds of robots that follow actions, as arrays: one step of all, what robots observe, rewards and outcomes.


RUNNING, ARRIVED, COLLISION, TIME = range(4)
OUTCOMES: Final = ("running", "arrived", "collision", "time")
COMMANDS: Final = ("acceleration", "velocity")


class Transition(NamedTuple):
    """Result of a step of W worlds with R robots; 0 and inf for robots that did not act."""

    rewards: Array  # (W, R)
    clearances: Array  # (W, R) [m], see `clearance.least_clearances`
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

    Raises:
        InvalidInput: a world that repeats, robots that are no discs or balls, worlds that differ in their number of
            robots, their dimension or their period; see also `Motion`.
    """

    def __init__(self, scenarios: Sequence[Scenario], nearest: int, command: str) -> None:
        first, w = scenarios[0], len(scenarios)
        self.kind = _kind(first)
        r, self.dimension, self.period = self.kind
        self.nearest, self.command = whole(nearest, "nearest", 1), known(command, "command", COMMANDS)
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
    def size(self) -> int:
        """Length of an observation."""
        return 3 * self.dimension + self.nearest * (2 * self.dimension + 2)

    def load(self, w: int, scenario: Scenario, motion: Motion | None = None) -> None:
        """Begin a new episode in world w, with the motion of its obstacles if that was made before."""
        if _kind(scenario) != self.kind:
            raise InvalidInput(
                f"scenario: expected the number of robots, the dimension and the period {self.kind} in every world, "
                f"found {_kind(scenario)}"
            )
        if scenario.period is not None:
            raise InvalidInput(f"scenario: expected a world that does not repeat, found {scenario.name}")
        for robot in scenario.robots:
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
        of the step in units of max_speed. The acceleration is shortened to the largest one, then the velocity at the
        end of the step to max_speed.
        """
        max_speed, most = self.robots.max_speed[..., None], self.robots.max_acceleration[..., None]
        if self.command == "velocity":
            share = (shortened(actions) * max_speed - self.velocity) / (self.period * most)
        else:
            share = actions
        after = self.velocity + self.period * most * shortened(share)
        return np.asarray((max_speed * shortened(after / max_speed) - self.velocity) / self.period)

    def actions(self, accelerations: Array) -> Array:
        """Actions (W, R, d) that robots follow by `accelerations` (W, R, d) [m/s^2] within their limits."""
        if self.command == "velocity":
            return np.asarray((self.velocity + self.period * accelerations) / self.robots.max_speed[..., None])
        return np.asarray(accelerations / self.robots.max_acceleration[..., None])

    def step(self, actions: Array, worlds: Flags | None = None) -> Transition:
        """Make a step in all worlds, or in some of them (W,).

        The reward is the difference of two shares: the decrease of the distance to the goal over the initial one, and
        the period over the duration. An arrival adds 1, a collision subtracts 1.

        Raises:
            InvalidInput: actions of another shape, or not finite.
        """
        wanted, some = array_of(actions, "action", self.position.shape), np.ones(len(self.steps), np.bool_)
        some = some if worlds is None else worlds
        moves = self.acting & some[:, None]
        # A robot that has stopped at its goal stays there.
        held = np.where(self.acting[..., None], self.accelerations(wanted), -self.velocity / self.period)
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
        return Transition(np.where(moves, reward, 0.0), clearance, outcome)

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
        Vectors longer than 1 are shortened to 1.
        """
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
