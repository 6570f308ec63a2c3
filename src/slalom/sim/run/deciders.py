"""Deciders of the robots of a run: the protocol of the loop over time, and robots that decide one by one."""

from time import perf_counter
from typing import NamedTuple, Protocol

import numpy as np

from slalom.base.checks import Array
from slalom.decision import Decision
from slalom.decision.methods import Method
from slalom.fleet.observation import Observer
from slalom.model.state import State
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.window import Obstacles
from slalom.sim.measure.responses import ResponseRow
from slalom.sim.run.states import RobotStates
from slalom.sim.scenario import Scenario


class Decisions(NamedTuple):
    """The decisions of one step, by the row of the robot."""

    outcomes: dict[int, str]
    times: dict[int, float]  # [s] wall clock


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
        self._table = ObstacleTable(scenario.obstacles) if scenario.period is None else None

    def decide(self, now: float) -> Decisions:
        before = perf_counter()
        state = self.states.state(0)
        goal = self.scenario.robot.goal
        if self._observer is not None:
            obstacles: Obstacles = self._observer.look(state, self.scenario.obstacles, now, goal.position(now))
        else:
            obstacles = self._table or self.scenario.around(state, now, self.method)
        self.decision = self._navigator.decide(state, obstacles, goal, now=now, previous=self.decision)
        return Decisions({0: self.decision.outcome.name}, {0: perf_counter() - before})

    def decide_in(self, state: State, now: float) -> Decision:
        """The decision at `now` [s] of the robot in `state`; the next one continues it."""
        states, d = self.states, state.dimension
        states.position[0, :d], states.velocity[0, :d] = state.position, state.velocity
        states.acceleration[0, :d] = state.acceleration
        self.decide(now)
        assert self.decision is not None
        return self.decision

    def accelerations(self, now: float, duration: float) -> Array:
        assert self.decision is not None
        acceleration = np.zeros((1, 3))
        acceleration[0, : self.scenario.dimension] = self.decision.manoeuvre.mean_acceleration(now, duration)
        return acceleration

    def committed(self) -> tuple[Array, ResponseRow]:
        assert self.decision is not None
        manoeuvre = self.decision.manoeuvre
        return manoeuvre.control[None], (manoeuvre.response,)
