"""Deciders of the robots of a run: one robot, a fleet, or a peer, by the protocol of the loop over time."""

from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import NamedTuple, Protocol

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import PATH_BRAKING
from slalom.decision import Decision
from slalom.decision.methods import Method
from slalom.fleet.fleet import Fleet
from slalom.fleet.observation import Observer
from slalom.forecast.forecast import AtConstantVelocity
from slalom.kernels.arrays import Flags
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Disc
from slalom.model.state import State
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.window import Obstacles, ObstacleWindow
from slalom.peers import Crowd, Peer, Team, discs, outlines
from slalom.sim.measure.recording import CHOSEN, UNANSWERED
from slalom.sim.measure.responses import ResponseRow
from slalom.sim.run.states import RobotStates, sensing_of
from slalom.sim.scenario import SIGHT, Robot, Scenario


class Decisions(NamedTuple):
    """The decisions of one step: names of outcomes by the row of the robot, "" without one; the time of each."""

    outcomes: list[str]  # n
    time: float  # [s] wall clock


class Decider(Protocol):
    """All decisions of a run."""

    states: RobotStates

    def decide(self, now: float) -> Decisions:
        """Choose new manoeuvres for all robots that are present at `now` [s]."""

    def accelerations(self, now: float, duration: float) -> Array:
        """The accelerations (n, 3) [m/s^2], constant over `duration` [s], that follow the committed manoeuvres."""

    def committed(self) -> tuple[Array, ResponseRow]:
        """The controls (n, d) and the responses of all committed manoeuvres; for peers the names of their methods."""


class SingleRobotDecider:
    """One robot that decides by its `Navigator` or `LookAhead`, without guidance."""

    def __init__(self, scenario: Scenario, method: Method) -> None:
        method = scenario.robot.method or method
        self.scenario = scenario
        self.method = method
        self.states = RobotStates(scenario)
        self.decision: Decision | None = None
        self._navigator = scenario.decider(method)
        self._observer = Observer(scenario.sight, scenario.obstacles) if scenario.sight else None
        self._table = ObstacleTable(scenario.obstacles)

    def decide(self, now: float) -> Decisions:
        if np.isinf(self.states.appeared[0]):
            return Decisions([""], 0.0)
        before = perf_counter()
        state, goal = self.states.state(0), self.states.goal[0]
        if self._observer is not None:
            obstacles: Obstacles = self._observer.look(state, self.scenario.obstacles, now, goal.position(now))
        else:
            obstacles = self._table
        self.decision = self._navigator.decide(state, obstacles, goal, now=now, previous=self.decision)
        self.states.progress[0] = self.decision.progress
        return Decisions([self.decision.outcome.name], perf_counter() - before)

    def decide_in(self, state: State, now: float) -> Decision:
        """The decision at `now` [s] of the robot in `state`; the next one continues it."""
        states, d = self.states, state.dimension
        if np.isinf(states.appeared[0]):
            states.appear(0, now)
        states.position[0, :d], states.velocity[0, :d] = state.position, state.velocity
        states.acceleration[0, :d] = state.acceleration
        self.decide(now)
        assert self.decision is not None
        return self.decision

    def accelerations(self, now: float, duration: float) -> Array:
        acceleration = np.zeros((1, 3))
        if self.decision is None:
            return acceleration
        acceleration[0, : self.scenario.dimension] = self.decision.manoeuvre.mean_acceleration(now, duration)
        return acceleration

    def committed(self) -> tuple[Array, ResponseRow]:
        if self.decision is None:
            return np.zeros((1, self.scenario.dimension)), ("",)
        manoeuvre = self.decision.manoeuvre
        return manoeuvre.control[None], (manoeuvre.response,)


class FleetDecider:
    """All robots of a run, which decide as a `Fleet`.

    Attributes:
        fleet: decides. Late or lost observations are its `information`.

    Raises:
        InvalidInput: as `Fleet`.
    """

    def __init__(self, scenario: Scenario, method: Method, seed: int = 0, threads: int | None = None) -> None:
        robots = scenario.robots
        self.scenario, self.states = scenario, RobotStates(scenario)
        self.fleet = fleet = Fleet(
            [robot.method or method for robot in robots],
            [robot.shape for robot in robots],
            [robot.limits for robot in robots],
            names=[robot.name for robot in robots],
            obstacles=scenario.obstacles,
            period=scenario.dt * scenario.steps_per_decision,
            priority=[robot.priority for robot in robots],
            observation_delay=scenario.sight_delay,
            observation_noise=scenario.sight_noise,
            sight=scenario.sight,
            threads=threads,
            guided=scenario.guided and scenario.dimension == 2,
            early=scenario.early,
            **scenario.shared | {"margin": [scenario.margin_of(k) for k in range(len(robots))]},
        )
        methods = [policy.method for policy in fleet.policies]
        sensing = [found for found in (sensing_of(self.states, each, seed) for each in methods) if found]
        fleet.information = next(iter(sensing), fleet.information)

    def decide(self, now: float) -> Decisions:
        before, states = perf_counter(), self.states
        d = self.scenario.dimension
        found = self.fleet.step(
            now,
            states.position[:, :d],
            states.velocity[:, :d],
            goals=self.states.goal,
            accelerations=states.acceleration[:, :d],
            present=states.present,
        )
        states.progress = self.fleet.destinations.progress
        outcomes = ["" if outcome is None else outcome.name for outcome in found.outcomes]
        return Decisions(outcomes, (perf_counter() - before) / max(int(states.present.sum()), 1))

    def accelerations(self, now: float, duration: float) -> Array:
        velocity, _ = self.fleet.planned(now + duration)
        return np.where(self.states.present[:, None], (velocity - self.states.velocity) / duration, 0.0)

    def committed(self) -> tuple[Array, ResponseRow]:
        controls = self.fleet.table.each["control"][:, : self.scenario.dimension].copy()
        return controls, tuple(self.fleet.committed_responses())


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
            observe each other late or inexactly.
    """

    def __init__(self, scenario: Scenario, peer: Peer) -> None:
        _refuse(scenario, peer)
        self.scenario, self.peer = scenario, peer
        self.states = states = RobotStates(scenario, arrivals_are_final=True)
        self._margins = np.array([scenario.margin_of(k) for k in range(len(scenario.robots))])
        self._growth = 0.5 * float(self._margins.max())
        self._walls = outlines(scenario.obstacles, walls=peer.walls, growth=self._growth)
        self._period = scenario.dt * scenario.steps_per_decision
        self._goals = list(states.goal)
        self._limits = [robot.limits for robot in scenario.robots]
        on_paths = scenario.tasks is not None or any(isinstance(goal, PathGoal) for goal in states.goal)
        self._table = ObstacleTable(scenario.obstacles if on_paths else ())
        self._chosen, self._answered = states.velocity[:, :2].copy(), np.ones(len(states.arrived), np.bool_)
        self._members = np.zeros_like(states.present)
        if states.present.any():
            self._begin(states.present)

    def _begin(self, members: Flags) -> None:
        """Let the peer begin with the robots that are present."""
        self._members = members.copy()
        robots = [robot for robot, member in zip(self.scenario.robots, members, strict=True) if member]
        radii = np.array([robot.shape.bounding_radius for robot in robots])
        speeds = np.array([robot.limits.max_speed for robot in robots])
        accelerations = np.array([robot.limits.max_acceleration for robot in robots])
        self._speeds = speeds
        self._crowd: Crowd = self.peer.begin(
            Team(radii, speeds, accelerations, self._period, self._walls), self._margins[members]
        )

    def _follow(self, now: float) -> None:
        """Set the goals of all robots; the targets and speed limits of those that follow paths."""
        self._goals, self._limits = list(self.states.goal), [robot.limits for robot in self.scenario.robots]
        paths = {k: goal for k, goal in enumerate(self.states.goal) if isinstance(goal, PathGoal)}
        if not paths:
            return
        window = ObstacleWindow.predicted(self._table, AtConstantVelocity(), now, self.scenario.horizon)
        for k in [k for k in paths if self.states.present[k]]:
            robot, path = self.scenario.robots[k], paths[k]
            step = path.step(
                self.states.state(k).position,
                self.states.progress[k],
                robot.limits.max_speed,
                PATH_BRAKING * robot.limits.braking,
                self._period,
                robot.shape.bounding_radius,
                partial(window.covered, robot=robot.shape, margin=self.scenario.margin_of(k)),
                partial(window.covered, robot=robot.shape, margin=0.0),
            )
            self.states.progress[k], self._goals[k] = step.progress, step.goal
            self._limits[k] = replace(robot.limits, max_speed=step.max_speed)

    def decide(self, now: float) -> Decisions:
        self._follow(now)
        before, states = perf_counter(), self.states
        if not states.present.any():
            return Decisions([""] * len(states.present), 0.0)
        if not np.array_equal(self._members, states.present):
            self._begin(states.present)
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
        outcomes = np.where(self._members, np.where(self._answered, CHOSEN, UNANSWERED), "").tolist()
        return Decisions(outcomes, (perf_counter() - before) / len(here))

    def accelerations(self, now: float, duration: float) -> Array:
        states = self.states
        self._chosen[~states.present] = 0.0
        acceleration = np.zeros_like(states.velocity)
        acceleration[states.present, :2] = (self._chosen - states.velocity[:, :2])[states.present] / duration
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
