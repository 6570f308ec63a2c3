"""Fleets on the move: the tables from which they decided last, and the same decisions by one navigator per robot."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from slalom import METHODS, ConstantAcceleration, Decision, Fleet, Method, Obstacle, ObstacleTable, Outcome, Trajectory
from slalom.decision.methods import margin_among
from slalom.fleet.guidance import Guidance
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import NO_CLAIMS, NO_OBJECTIVES, DecisionTables
from slalom.model.manoeuvre import first_manoeuvre
from slalom.sim import Scenario, gallery
from slalom.sim.run.deciders import FleetDecider
from slalom.sim.run.states import RobotStates


class Watched(Fleet):
    """A fleet that keeps the arguments of its last decision."""

    def _decide(self, order, settings, bodies, obstacles):
        parts = self.responses, self._bounds, self.targets, settings, NO_OBJECTIVES, NO_CLAIMS
        self.last = order, DecisionTables(self.table, *bodies[0], *parts)
        return super()._decide(order, settings, bodies, obstacles)


class OneByOne:
    """Decisions of a fleet by the public navigator of each robot, with the other robots as obstacles.

    For methods that neither share nor regain. All robots are tested that straight motion at max speed can bring near.
    """

    def __init__(self, scenario: Scenario, method: Method, states: RobotStates) -> None:
        self.scenario, self.method, self.states = scenario, method, states
        self.table = ObstacleTable(scenario.obstacles)
        period, rows = scenario.dt * scenario.steps_per_decision, range(len(scenario.robots))
        most = max(robot.limits.max_acceleration for robot in scenario.robots)
        margin = margin_among(method, scenario.margin, most, period)
        self.navigators = [replace(scenario.navigator(method, k), margin=margin) for k in rows]
        first = [first_manoeuvre(r.state, r.limits, period, scenario.start) for r in scenario.robots]
        self.committed: list[Trajectory] = list(first)
        # A shared manoeuvre commits a robot from the begin.
        self.decisions = [Decision(m, Outcome.KEPT, m.control, None) if method.shared else None for m in first]

    def decide(self, order: Sequence[int], now: float) -> list[str]:
        seen = [self._observed(k, now) for k in range(len(self.navigators))]
        for k in order:
            paths = self.committed if self.method.shared else seen
            others = [
                Obstacle(robot.shape, paths[j], robot.name)
                for j, robot in enumerate(self.scenario.robots)
                if j != k and self.states.present[j] and self._in_reach(k, j)
            ]
            goal, obstacles = self.scenario.robots[k].goal, [self.table, *others]
            decision = self.navigators[k].decide(
                self.states.state(k), obstacles, goal, now=now, previous=self.decisions[k]
            )
            self.committed[k], self.decisions[k] = decision.manoeuvre, decision
        return [decision.outcome.name for decision in self.decisions]

    @property
    def controls(self) -> np.ndarray:
        return np.array([decision.manoeuvre.control for decision in self.decisions])

    def _in_reach(self, k: int, j: int) -> bool:
        one, other, margin = self.scenario.robots[k], self.scenario.robots[j], self.navigators[k].margin
        distance = np.linalg.norm(self.states.position[k] - self.states.position[j])
        speeds = one.limits.max_speed + other.limits.max_speed
        radii = one.shape.bounding_radius + other.shape.bounding_radius
        return bool(distance <= speeds * self.scenario.horizon + radii + margin)

    def _observed(self, k: int, now: float) -> Trajectory:
        state = self.states.state(k)
        observed = ConstantAcceleration(state.position, state.velocity, state.acceleration, now)
        return self.method.robot_forecast(observed, now)


FLEETS = [
    pytest.param(name, scenario, settings, id=f"{name}-{scenario}")
    for name in ("nao", "nao_shared", "vo", "rvo", "ao")
    for scenario, settings in (("random_goals", {"robots": 40, "side": 90}), ("circle", {"robots": 12}))
]


def last_decision(name: str, scenario: str, settings: dict[str, float]) -> tuple[Indices, DecisionTables]:
    """The robots and the tables of the eighth decision of a fleet."""
    built = gallery.build(scenario, settings, seed=5)
    decider = FleetDecider(built, METHODS[name].among_robots(), threads=1)
    decider.fleet.__class__ = Watched
    for step in range(8):
        now = step * built.dt
        decider.decide(now)
        if step < 7:
            decider.states.integrate(decider.accelerations(now, built.dt), built.dt)
    return decider.fleet.last


def guidance_in(scenario: Scenario, threads: int = 1) -> Guidance:
    """The guidance of the robots of a scenario at their starts, with their goals."""
    robots, n, d = scenario.robots, len(scenario.robots), scenario.dimension
    guidance = Guidance(
        np.array([robot.shape.bounding_radius for robot in robots]),
        np.array([robot.limits.max_speed for robot in robots]),
        scenario.margin,
        scenario.obstacles,
        threads=threads,
    )
    guide, goals = guidance.guide, np.zeros((n, 3))
    goals[:, :d] = [robot.goal.position(scenario.start) for robot in robots]
    guide.position[:, :d] = [robot.state.position for robot in robots]
    guide.velocity[:, :d] = [robot.state.velocity for robot in robots]
    tolerances = np.array([robot.goal.tolerance for robot in robots])
    guidance.head_for(goals, tolerances, np.array([robot.goal.stop for robot in robots]), np.ones(n, np.bool_))
    return guidance


def fleet_of(scenario: Scenario, method: Method) -> Fleet:
    """The robots and obstacles of a scenario, for a loop of the caller."""
    return Fleet(
        method,
        [robot.shape for robot in scenario.robots],
        [robot.limits for robot in scenario.robots],
        period=scenario.dt * scenario.steps_per_decision,
        horizon=scenario.horizon,
        margin=scenario.margin,
        holds=scenario.holds,
        patience=scenario.patience,
        obstacles=scenario.obstacles,
        guided=scenario.guided,
    )


def swap(n: int, radius: float = 5.0) -> tuple[np.ndarray, np.ndarray]:
    """Starts on a circle, and targets opposite (n, 2) [m]."""
    angles = 2.0 * np.pi * np.arange(n) / n + 0.05 * np.sin(np.arange(n))
    starts = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return starts, -starts
