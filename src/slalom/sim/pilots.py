"""Robots of any shape, limits and goals, each of which decides by its own navigator."""

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from slalom.checks import Array
from slalom.decision import Decision
from slalom.goal import Goal
from slalom.methods import Method
from slalom.obstacle import Obstacle
from slalom.sim.crew import first_manoeuvre, margin_among
from slalom.sim.guidance import Guidance
from slalom.sim.scenario import Scenario
from slalom.state import State
from slalom.trajectory import ConstantAcceleration, Stationary, Trajectory


class Pilots:
    """See `crew.Deciders`."""

    def __init__(self, scenario: Scenario, method: Method, guidance: Guidance) -> None:
        self.scenario, self.method, self.guidance = scenario, method, guidance
        period = scenario.dt * scenario.steps_per_decision
        margin = margin_among(scenario, method)
        self._navigators = [replace(scenario.navigator(method, k), margin=margin) for k in range(len(scenario.robots))]
        self._committed = [first_manoeuvre(r.state, r.limits, period, scenario.start) for r in scenario.robots]
        self._decisions: list[Decision | None] = [None] * len(scenario.robots)

    def decide(self, order: Sequence[int], now: float) -> tuple[dict[int, str], dict[int, float]]:
        seen = None if self.method.shared else [self._observed(k, now) for k in range(len(self._navigators))]
        made: dict[int, tuple[Decision, float]] = {}
        for k in order:
            before = perf_counter()
            around = [*self.scenario.obstacles, *self._others(k, seen, now)]
            decision = self._navigators[k].decide(
                self._state(k), around, self._goal(k), now=now, previous=self._decisions[k]
            )
            made[k] = decision, perf_counter() - before
            if self.method.shared:
                self._committed[k] = decision.manoeuvre
        for k, (decision, _) in made.items():
            self._committed[k], self._decisions[k] = decision.manoeuvre, decision
        return {k: d.outcome.name for k, (d, _) in made.items()}, {k: spent for k, (_, spent) in made.items()}

    def push(self, now: float, dt: float) -> Array:
        push = np.zeros((len(self._committed), 3))
        for k, manoeuvre in enumerate(self._committed):
            push[k, : self.scenario.dimension] = manoeuvre.mean_acceleration(now, dt)
        return push

    def chosen(self, k: int) -> tuple[Array, str]:
        return np.asarray(self._committed[k].control), repr(self._committed[k].response)

    def _state(self, k: int) -> State:
        d, guide = self.scenario.dimension, self.guidance.guide
        return State(guide.position[k, :d], guide.velocity[k, :d], self.guidance.push[k, :d])

    def _observed(self, k: int, now: float) -> Trajectory:
        """What the others assume of a robot: where it is, how fast, and how it accelerates, is all they see."""
        state = self._state(k)
        seen = ConstantAcceleration(state.position, state.velocity, state.acceleration, now)
        return self.method.of_robots(seen, now)

    def _goal(self, k: int) -> Goal:
        """Its own, or the place that it is guided to."""
        d, guide, own = self.scenario.dimension, self.guidance.guide, self.scenario.robots[k].goal
        if np.array_equal(guide.target[k], guide.goal[k]):
            return own
        return Goal(Stationary(guide.target[k, :d]), float(guide.near[k]), bool(guide.halt[k]))

    def _others(self, k: int, seen: list[Trajectory] | None, now: float) -> list[Obstacle]:
        """All robots that robot k could meet within the horizon, as it sees them."""
        guide, found = self.guidance.guide, []
        reach = self._reach(k) + self._navigators[k].margin
        for j, robot in enumerate(self.scenario.robots):
            away = float(np.linalg.norm(guide.position[j] - guide.position[k]))
            if j != k and guide.present[j] and away <= reach + self._reach(j):
                path: Trajectory = self._committed[j] if seen is None else seen[j]
                found.append(Obstacle(robot.shape, path, robot.name))
        return found

    def _reach(self, k: int) -> float:
        """How far [m] any point of the robot can get within the horizon."""
        guide = self.guidance.guide
        speed = max(float(guide.top[k]), float(np.linalg.norm(guide.velocity[k])))
        return speed * self.scenario.horizon + float(guide.radius[k])
