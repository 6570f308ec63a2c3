"""How the robots of a run decide: the protocol of the loop over time, and robots that decide one by one."""

from collections.abc import Sequence
from time import perf_counter
from typing import NamedTuple, Protocol

import numpy as np

from slalom.checks import Array
from slalom.decision import Decision
from slalom.errors import InvalidInput
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method
from slalom.response import AccelerateThenBrake
from slalom.sim.run.robot_states import RobotStates
from slalom.sim.scenario import Scenario
from slalom.state import State
from slalom.tolerances import WHOLE_PERIODS


class Decisions(NamedTuple):
    """The decisions of one step, by the row of the robot."""

    outcomes: dict[int, str]
    times: dict[int, float]  # [s] wall clock


class Decider(Protocol):
    """All decisions of a run. The loop calls `sense`, `guide` and `decide` in this order at every decision."""

    states: RobotStates

    def sense(self, now: float) -> None:
        """Observe the other robots and receive their messages at `now` [s]."""

    def guide(self, now: float) -> None:
        """Choose the next target of every robot at `now` [s]. It has no part in safety."""

    def decide(self, order: Sequence[int], now: float) -> Decisions:
        """Choose new manoeuvres for the robots (rows) in `order` at `now` [s]."""

    def accelerations(self, now: float, duration: float) -> Array:
        """The accelerations (n, 3) [m/s^2], constant over `duration` [s], that follow the committed manoeuvres."""

    def committed(self) -> tuple[Array, tuple[str, ...]]:
        """The controls (n, d) and the responses, as text, of all committed manoeuvres."""


class SingleRobotDecider:
    """One robot that decides by its `Navigator` or `LookAhead`, without guidance."""

    def __init__(self, scenario: Scenario, method: Method) -> None:
        self.scenario, self.method, self.states = scenario, method, RobotStates(scenario)
        self.decision: Decision | None = None
        self._navigator = scenario.decider(method)

    def sense(self, now: float) -> None:
        pass

    def guide(self, now: float) -> None:
        pass

    def decide(self, order: Sequence[int], now: float) -> Decisions:
        before, state, goal = perf_counter(), self.states.state(0), self.scenario.robot.goal
        obstacles = self.scenario.around(state, now, self.method)
        self.decision = self._navigator.decide(state, obstacles, goal, now=now, previous=self.decision)
        return Decisions({0: self.decision.outcome.name}, {0: perf_counter() - before})

    def accelerations(self, now: float, duration: float) -> Array:
        assert self.decision is not None
        acceleration = np.zeros((1, 3))
        acceleration[0, : self.scenario.dimension] = self.decision.manoeuvre.mean_acceleration(now, duration)
        return acceleration

    def committed(self) -> tuple[Array, tuple[str, ...]]:
        assert self.decision is not None
        manoeuvre = self.decision.manoeuvre
        return manoeuvre.control[None], (repr(manoeuvre.response),)


def first_manoeuvre(state: State, limits: Limits, period: float, now: float) -> Manoeuvre:
    """The manoeuvre of a robot before its first decision: constant velocity for one period, then even braking."""
    speed = float(np.linalg.norm(state.velocity))
    brake = max(period, np.ceil(speed / limits.braking / period - WHOLE_PERIODS) * period)
    return Manoeuvre(AccelerateThenBrake(period, brake), state, np.zeros(state.dimension), now)


def margin_among(scenario: Scenario, method: Method) -> float:
    """The margin [m] of robots that meet each other.

    With a shared method it is that of the scenario. Robots that only observe each other add twice a t^2, the largest
    error of a prediction over one period and the delay of sight together, t, when both accelerate by a at most. They
    also add three standard deviations of what they observe.
    """
    if method.shared:
        return scenario.margin
    time = scenario.dt * scenario.steps_per_decision + scenario.sight_delay
    max_acceleration = max(robot.limits.max_acceleration for robot in scenario.robots)
    return scenario.margin + 2.0 * max_acceleration * time * time + 3.0 * scenario.sight_noise


def refuse_short_horizon(scenario: Scenario, method: Method) -> None:
    """Raise InvalidInput for a manoeuvre that lasts longer than the horizon.

    Robots can avoid a robot at rest for all time, but not one that still moves after the horizon.
    """
    for k, robot in enumerate(scenario.robots):
        navigator = scenario.navigator(method, k)
        for response in method.responses(navigator.limits, navigator.period, navigator.holds):
            end = response.knots(1e6, 1.0)[-2]
            if end > scenario.horizon:
                longest = f"{end:g} s, the longest manoeuvre of {robot.name!r}"
                raise InvalidInput(f"horizon: expected at least {longest}, found {scenario.horizon:g} s")
