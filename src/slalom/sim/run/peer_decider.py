"""Robots that another project's method moves."""

from dataclasses import replace
from functools import partial
from time import perf_counter

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import PATH_BRAKING
from slalom.forecast.forecast import AtConstantVelocity
from slalom.kernels.arrays import Flags
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Disc
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.window import ObstacleWindow
from slalom.peers import Crowd, Peer, Team, discs, outlines
from slalom.sim.measure.recording import CHOSEN, UNANSWERED
from slalom.sim.measure.responses import ResponseRow
from slalom.sim.run.deciders import Decisions
from slalom.sim.run.states import RobotStates
from slalom.sim.scenario import SIGHT, Robot, Scenario


class PeerDecider:
    """All robots of a run with a peer, without guidance.

    A robot prefers its goal's `desired_velocity`. On a path the goal is the target of `PathGoal.step`, with its speed
    limit, as in slalom's fleets. It reaches the velocity that the peer chose by a constant acceleration over the step.
    A `limited` peer uses at most the maximum acceleration of the robot, so it may need more than one step. Of obstacles
    the peer observes position and velocity. The horizon, patience and holds of navigators do not concern it.

    The margin reaches every peer as a larger radius for its planning: half of its own margin for each robot, and half
    of the largest margin for each obstacle. Two robots thus keep the mean of their margins, and a robot keeps its
    margin from obstacles, or more where others have a larger one. Collisions and metrics have the true radii.

    Controls are the chosen velocities [m/s]; the decision time of a robot is its share of the time for all. Without
    an answer of the peer a robot keeps its velocity, and the outcome is UNANSWERED.

    Raises:
        InvalidInput: the peer's package is not installed; a scenario in space, a robot that is not a disc or has
            other limits than a maximum speed and acceleration, an obstacle that the peer cannot avoid; robots that
            observe each other late or inexactly; a periodic world.
    """

    def __init__(self, scenario: Scenario, peer: Peer) -> None:
        _refuse(scenario, peer)
        self.scenario, self.peer = scenario, peer
        self.states = states = RobotStates(scenario, arrivals_are_final=True)
        self._margins = np.array([scenario.margin_of(k) for k in range(len(scenario.robots))])
        self._growth = 0.5 * float(self._margins.max())
        self._walls = outlines(scenario.obstacles, walls=peer.walls, growth=self._growth)
        self._period = scenario.dt * scenario.steps_per_decision
        self._paths = {k: robot.goal for k, robot in enumerate(scenario.robots) if isinstance(robot.goal, PathGoal)}
        self._progress: list[float | None] = [None] * len(scenario.robots)
        self._goals = [robot.goal for robot in scenario.robots]
        self._limits = [robot.limits for robot in scenario.robots]
        self._table = ObstacleTable(scenario.obstacles if self._paths else ())
        self._chosen, self._answered = states.velocity[:, :2].copy(), np.ones(len(states.arrived), np.bool_)
        self._crowd = self._begin(states.present)
        self._members = states.present.copy()

    def _begin(self, members: Flags) -> Crowd:
        robots = [robot for robot, member in zip(self.scenario.robots, members, strict=True) if member]
        radii = np.array([robot.shape.bounding_radius for robot in robots])
        speeds = np.array([robot.limits.max_speed for robot in robots])
        accelerations = np.array([robot.limits.max_acceleration for robot in robots])
        self._speeds = speeds
        return self.peer.begin(Team(radii, speeds, accelerations, self._period, self._walls), self._margins[members])

    def _follow(self, now: float) -> None:
        """Set the targets and speed limits of the robots that follow paths."""
        if not self._paths:
            return
        window = ObstacleWindow.predicted(self._table, AtConstantVelocity(), now, self.scenario.horizon)
        for k in [k for k in self._paths if self.states.present[k]]:
            robot, path = self.scenario.robots[k], self._paths[k]
            step = path.step(
                self.states.state(k).position,
                self._progress[k],
                robot.limits.max_speed,
                PATH_BRAKING * robot.limits.braking,
                self._period,
                robot.shape.bounding_radius,
                partial(window.covered, robot=robot.shape, margin=self.scenario.margin_of(k)),
            )
            self._progress[k], self._goals[k] = step.progress, step.goal
            self._limits[k] = replace(robot.limits, max_speed=step.max_speed)

    def decide(self, now: float) -> Decisions:
        self._follow(now)
        before, states = perf_counter(), self.states
        if not np.array_equal(self._members, states.present):
            self._members = states.present.copy()
            self._crowd = self._begin(self._members)
        here = np.flatnonzero(self._members).tolist()
        limits, each = [self._limits[k] for k in here], [states.state(k) for k in here]
        preferred = np.array(
            [
                self._goals[k].desired_velocity(state.position, state.velocity, now, own, self._period)
                for k, state, own in zip(here, each, limits, strict=True)
            ]
        )
        self._speeds[:] = [own.max_speed for own in limits]
        positions, velocities = np.array([s.position for s in each]), np.array([s.velocity for s in each])
        chosen = self._crowd.choose(positions, velocities, preferred, discs(self.scenario.obstacles, now, self._growth))
        for k, velocity, own, state in zip(here, chosen, limits, each, strict=True):
            self._answered[k] = np.isfinite(velocity).all()
            # RVO2 computes in single precision and exceeds the maximum speed by up to a percent.
            excess = float(np.linalg.norm(velocity)) / own.max_speed
            self._chosen[k] = velocity / max(excess, 1.0) if self._answered[k] else state.velocity
        outcomes = {k: CHOSEN if self._answered[k] else UNANSWERED for k in here}
        return Decisions(outcomes, dict.fromkeys(outcomes, (perf_counter() - before) / len(here)))

    def accelerations(self, now: float, duration: float) -> Array:
        states = self.states
        self._chosen[~states.present] = 0.0
        acceleration = np.zeros_like(states.velocity)
        acceleration[:, :2] = (self._chosen - states.velocity[:, :2]) / duration
        if self.peer.limited:
            for k in np.flatnonzero(states.present):
                size = float(np.linalg.norm(acceleration[k, :2]))
                max_acceleration = self.scenario.robots[k].limits.max_acceleration
                if size > max_acceleration:
                    acceleration[k, :2] *= max_acceleration / size
        return acceleration

    def committed(self) -> tuple[Array, ResponseRow]:
        return self._chosen.copy(), (self.peer.name,) * len(self._chosen)


def _refuse(scenario: Scenario, peer: Peer) -> None:
    """Raise InvalidInput for a scenario that the peer cannot be run in."""
    for name in ("sight_noise", "sight_delay", "sight_loss", *SIGHT):
        if found := scenario.settings[name]:
            raise InvalidInput(f"{name}: expected 0 for {peer.name}, whose observations are exact; found {found:g}")
    if scenario.period is not None:
        raise InvalidInput(
            f"period: expected none for {peer.name}, whose world is not periodic; found {scenario.period}"
        )
    for robot in scenario.robots:
        _refuse_robot(robot, peer)


def _refuse_robot(robot: Robot, peer: Peer) -> None:
    limits = robot.limits
    if robot.method is not None:
        raise InvalidInput(
            f"{robot.name}.method: expected none of its own among robots that decide by {peer.name}, "
            f"found {robot.method.name}"
        )
    more = [name for name in ("velocity_bounds", "acceleration_bounds", "bounds") if getattr(limits, name)]
    if not isinstance(robot.shape, Disc) or more:
        found = more[0] if more else f"a {type(robot.shape).__name__.lower()}"
        raise InvalidInput(
            f"{robot.name}: expected a disc in the plane with max_speed and max_acceleration alone, as {peer.name} "
            f"requires, found {found}"
        )
