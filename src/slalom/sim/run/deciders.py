"""How the robots of a run decide: the protocol of the loop over time, and robots that decide one by one."""

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple, Protocol

import numpy as np

from slalom.checks import Array
from slalom.decision import Decision, Outcome
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method
from slalom.obstacle import Obstacle
from slalom.response import AccelerateThenBrake
from slalom.sim.periodic import images_within, moved
from slalom.sim.run.guidance import Guidance
from slalom.sim.run.messages import messages_of
from slalom.sim.run.robot_states import RobotStates
from slalom.sim.run.sensing import sensing_of
from slalom.sim.scenario import Scenario
from slalom.state import State
from slalom.tolerances import WHOLE_PERIODS
from slalom.trajectory import ConstantAcceleration, Stationary, Trajectory


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
        self.states.acceleration[0, : scenario.dimension] = scenario.robot.state.acceleration
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


class NavigatorDecider:
    """Robots of any shape, limits and goals; each decides by its own `Navigator`."""

    def __init__(self, method: Method, guidance: Guidance, seed: int = 0) -> None:
        self.method, self.guidance, self.states = method, guidance, guidance.states
        self.scenario = scenario = guidance.states.scenario
        self.messages = messages_of(scenario, method, seed)
        self.sensing = sensing_of(self.states, method, seed)
        self.period = scenario.dt * scenario.steps_per_decision
        margin = margin_among(scenario, method)
        self._navigators = [replace(scenario.navigator(method, k), margin=margin) for k in range(len(scenario.robots))]
        self._committed = [first_manoeuvre(r.state, r.limits, self.period, scenario.start) for r in scenario.robots]
        self._decisions: list[Decision | None] = [None] * len(scenario.robots)
        self._observed: list[Trajectory] = []
        self._sent: dict[int, list[Manoeuvre]] = {}

    def sense(self, now: float) -> None:
        states = self.states
        if self.sensing is not None:
            self.sensing.observe(np.array([states.position, states.velocity, states.acceleration]), now)
        else:
            self._observed = [self._predicted(states.state(k), now) for k in range(len(self._navigators))]
        if self.messages is not None:
            self._sent.setdefault(-1, list(self._committed))
            self.messages.deliver(states.position)

    def guide(self, now: float) -> None:
        self.guidance.update(now, self.period)

    def decide(self, order: Sequence[int], now: float) -> Decisions:
        made: dict[int, Decision] = {}
        outcomes: dict[int, str] = {}
        times = dict.fromkeys(order, 0.0)
        for k in order:
            if self.messages is not None and not self.messages.may_decide(k, self.states.present):
                outcomes[k] = Outcome.WAITING.name
                continue
            made[k], times[k] = self._decision(k, self._paths(k), now)
            if self.method.shared:
                self._committed[k] = made[k].manoeuvre
        for k, decision in made.items():
            self._committed[k], self._decisions[k] = decision.manoeuvre, decision
        if self.messages is not None:
            self._sent[self.messages.step] = list(self._committed)
            self.messages.send()
            self._sent = {step: sent for step, sent in self._sent.items() if step >= self.messages.oldest}
        outcomes.update((k, decision.outcome.name) for k, decision in made.items())
        return Decisions(outcomes, times)

    def _decision(self, k: int, paths: Sequence[Trajectory], now: float) -> tuple[Decision, float]:
        """The decision of robot k among robots that follow `paths`, and the wall clock time [s] that it took."""
        before = perf_counter()
        state, navigator = self.states.state(k), self._navigators[k]
        passive = self.scenario.around(state, now, self.method, k, navigator.margin)
        obstacles = [*passive, *self._others(k, paths)]
        decision = navigator.decide(state, obstacles, self._goal(k), now=now, previous=self._decisions[k])
        return decision, perf_counter() - before

    def _paths(self, k: int) -> Sequence[Trajectory]:
        """The paths of all robots as robot k knows them, by row."""
        rows = range(len(self._committed))
        if self.messages is not None:
            received = self.messages.received[k]
            return [self._committed[j] if j == k else self._sent[int(received[j])][j] for j in rows]
        if self.method.shared:
            return self._committed
        if self.sensing is None:
            return self._observed
        return [self._predicted(*self.sensing.state(k, j)) for j in rows]

    def accelerations(self, now: float, duration: float) -> Array:
        acceleration = np.zeros((len(self._committed), 3))
        for k, manoeuvre in enumerate(self._committed):
            acceleration[k, : self.scenario.dimension] = manoeuvre.mean_acceleration(now, duration)
        return self.states.stop_departed(acceleration, duration)

    def committed(self) -> tuple[Array, tuple[str, ...]]:
        controls = np.array([manoeuvre.control for manoeuvre in self._committed])
        return controls, tuple(repr(manoeuvre.response) for manoeuvre in self._committed)

    def _predicted(self, state: State, time: float) -> Trajectory:
        """The predicted path of a robot that was observed in `state` at `time` [s]."""
        observed = ConstantAcceleration(state.position, state.velocity, state.acceleration, time)
        return self.method.robot_forecast(observed, time)

    def _goal(self, k: int) -> Goal:
        """The goal of robot k, or the target that guidance gives it instead."""
        d, guide, own = self.scenario.dimension, self.guidance.guide, self.scenario.robots[k].goal
        if np.array_equal(guide.target[k], guide.goal[k]):
            return own
        return Goal(Stationary(guide.target[k, :d]), float(guide.tolerance[k]), bool(guide.stop[k]))

    def _others(self, k: int, paths: Sequence[Trajectory]) -> list[Obstacle]:
        """All robots on their `paths` that robot k can meet within the horizon."""
        states, found, d = self.states, [], self.scenario.dimension
        reach = self._reach(k) + self._navigators[k].margin
        for j, robot in enumerate(self.scenario.robots):
            displacement, distance = states.position[j] - states.position[k], reach + self._reach(j)
            if j != k and states.present[j]:
                for by in images_within(displacement[:d], distance, self.scenario.period):
                    found.append(Obstacle(robot.shape, moved(paths[j], by), robot.name))
        return found

    def _reach(self, k: int) -> float:
        """The radius [m] of a ball about robot k that it cannot leave within the horizon."""
        robot = self.scenario.robots[k]
        speed = max(robot.limits.max_speed, float(np.linalg.norm(self.states.velocity[k])))
        return speed * self.scenario.horizon + robot.shape.bounding_radius
