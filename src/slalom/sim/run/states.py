"""The states of all robots of a run as arrays, their arrivals, and the one integrator."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.base.tolerances import ARRIVAL_FILTER, WHOLE_COUNT
from slalom.decision.methods import Method
from slalom.fleet.guidance import ARRIVAL_LOST
from slalom.fleet.observation import Information
from slalom.fleet.settings import Policy
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import RobotTable
from slalom.model.goal import Goal
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.sim.scenario import Scenario


def integrate(position: Array, velocity: Array, acceleration: Array, duration: float) -> tuple[Array, Array]:
    """Position [m] and velocity [m/s] of double integrators after `duration` [s], each (..., d).

    Exact for an `acceleration` (..., d) [m/s^2] that is constant over the duration.
    """
    return position + duration * (velocity + 0.5 * duration * acceleration), velocity + duration * acceleration


class _Step(NamedTuple):
    """The motion of n robots in the step made last."""

    position: Array  # (n, 3) [m] at its begin
    velocity: Array  # (n, 3) [m/s]
    acceleration: Array  # (n, 3) [m/s^2]
    duration: float  # [s]


class RobotStates:
    """The states of the n robots of a scenario during a run.

    Attributes:
        goal: of each robot now; `head_for` changes it.
        position, velocity, acceleration: (n, 3) [m, m/s, m/s^2]; the acceleration was applied up to now. Tables of
            kernels share these arrays, so they change in place.
        arrived: (n,) [s] absolute time of arrival, inf before it.
        present: (n,) whether a robot is in the scene. A robot that passes its goal without a stop leaves it there.
        appeared: (n,) [s] absolute time from which a robot is in the scene, inf before it (see `appearance`). Until
            then it rests at its place.
        progress: [m] of each robot along its path at its last decision; None before it, and without a path.
        arrivals_are_final: whether a robot counts as arrived for good. Otherwise its arrival is lost at ARRIVAL_LOST
            times the tolerance from its goal: guidance moves robots away from their goals to let others pass.
    """

    def __init__(self, scenario: Scenario, *, arrivals_are_final: bool = False) -> None:
        robots, n = scenario.robots, len(scenario.robots)
        self.scenario = scenario
        self.robots = robots
        self.dimension = scenario.dimension
        self.arrivals_are_final = arrivals_are_final
        self.position = _in_space(np.array([robot.state.position for robot in robots]))
        self.velocity = _in_space(np.array([robot.state.velocity for robot in robots]))
        self.acceleration = _in_space(np.array([robot.state.acceleration for robot in robots]))
        self.arrived = np.full(n, np.inf)
        self.progress: list[float | None] = [None] * n
        self.appeared = np.full(n, scenario.start, dtype=np.float64)
        later = np.flatnonzero(scenario.appearances > scenario.start)
        self.appeared[later] = np.inf
        self.present = np.isfinite(self.appeared)
        self.velocity[later], self.acceleration[later] = 0.0, 0.0
        self.goal = [robot.goal for robot in robots]
        self._goal = _in_space(np.array([goal.position(scenario.start) for goal in self.goal]))
        self._tolerance = np.array([goal.tolerance for goal in self.goal])
        self._passes = np.array([not goal.stop for goal in self.goal])
        self._step: _Step | None = None
        self._moving = [k for k, goal in enumerate(self.goal) if not isinstance(goal.trajectory, Stationary)]

    def state(self, k: int) -> State:
        """The state of robot k."""
        d = self.dimension
        return State(self.position[k, :d], self.velocity[k, :d], self.acceleration[k, :d])

    def due(self, now: float) -> list[int]:
        """The robots whose time to appear has come at `now` [s], those that wait longest first, then by name."""
        waiting = [(self.robots[k], k) for k in np.flatnonzero(np.isinf(self.appeared)).tolist()]
        last = now + WHOLE_COUNT * max(1.0, abs(now))
        found = [(robot.appears, robot.name, k) for robot, k in waiting if robot.appears is not None]
        return [k for appears, _, k in sorted(found) if appears <= last]

    def appear(self, k: int, now: float) -> None:
        """Let robot k be in the scene from `now` [s], in its initial state."""
        first, d = self.robots[k].state, self.dimension
        self.velocity[k, :d], self.acceleration[k, :d] = first.velocity, first.acceleration
        self.appeared[k], self.present[k] = now, True

    def head_for(self, k: int, goal: Goal) -> None:
        """Give robot k another goal at rest to stop at; it has not arrived there yet."""
        if goal is not self.goal[k]:
            self.goal[k], self._goal[k, : self.dimension] = goal, goal.position(0.0)
            self._tolerance[k], self.progress[k] = goal.tolerance, None
        self.arrived[k] = np.inf

    def goals(self, now: float) -> Array:
        """The positions (n, 3) [m] of all goals at `now` [s]; always the same array, changed in place."""
        for k in self._moving:
            self._goal[k, : self.dimension] = self.goal[k].position(now)
        return self._goal

    def note_arrivals(self, now: float) -> None:
        """Update `arrived` and `present` at `now` [s], at the start or at the end of the step made last."""
        distance, reach = np.linalg.norm(self.goals(now) - self.position, axis=1), self._tolerance
        if self._step is not None:
            before, after = (np.linalg.norm(v, axis=1) for v in (self._step.velocity, self.velocity))
            reach = reach + self._passes * self._step.duration * np.maximum(before, after)
        near = distance <= ARRIVAL_FILTER * reach
        near[self._moving] = True
        for k in np.flatnonzero(self.present & near).tolist():
            if not np.isfinite(self.arrived[k]) and self._reached(k, now):
                self.arrived[k] = now
                self.present[k] = self.goal[k].stop
        if not self.arrivals_are_final:
            self.arrived[self.present & (distance > ARRIVAL_LOST * self._tolerance)] = np.inf

    def _reached(self, k: int, now: float) -> bool:
        """Whether robot k has reached its goal at `now` [s] or, a goal to pass, during the step before."""
        goal = self.goal[k]
        d = self.dimension
        step = self._step
        progress = self.progress[k]
        if goal.reached(self.position[k, :d], self.velocity[k, :d], now, progress=progress):
            return True
        if step is None or goal.stop:
            return False
        p = step.position[k, :d]
        v = step.velocity[k, :d]
        a = step.acceleration[k, :d]
        return bool(goal.reached_during(p, v, a, now - step.duration, step.duration, progress))

    @property
    def all_arrived(self) -> bool:
        """Whether every robot has arrived."""
        return bool(np.isfinite(self.arrived).all())

    def integrate(self, acceleration: Array, duration: float) -> None:
        """Advance all robots by `duration` [s] at the accelerations (n, 3) [m/s^2]; those outside the scene rest."""
        self._step = _Step(self.position.copy(), self.velocity.copy(), acceleration.copy(), duration)
        self.velocity[~self.present] = 0.0
        self.position[:], self.velocity[:] = integrate(self.position, self.velocity, acceleration, duration)
        self.acceleration[:] = acceleration


def _in_space(rows: Array) -> Array:
    """Vectors (n, d) as (n, 3): missing coordinates are 0."""
    wide = np.zeros((len(rows), 3))
    wide[:, : rows.shape[1]] = rows
    return wide


class Sensing(Information):
    """The last observation that each of n robots has of each other one.

    At every decision each robot observes the position, velocity and acceleration that each other one had `sight_delay`
    ago. Each coordinate has an independent normal error of standard deviation `sight_noise` [m, m/s, m/s^2]. With
    probability `sight_loss` an observation is lost and the one before it stays. All initial states are known.

    Attributes:
        observed: (n, 3, n, 3) position, velocity and acceleration [m, m/s, m/s^2]; the first axis is the observer, the
            third the observed robot. time: (n, n) [s] absolute, at which they held.
    """

    def __init__(self, scenario: Scenario, states: Array, seed: int) -> None:
        n, period = len(scenario.robots), scenario.dt * scenario.steps_per_decision
        self.dimension = scenario.dimension
        self.noise, self.loss = scenario.sight_noise, scenario.sight_loss
        self.delay, self._delay_steps = scenario.sight_delay, round(scenario.sight_delay / period)
        self.random = np.random.default_rng([seed, n])
        self.observed = np.broadcast_to(states, (n, 3, n, 3)).copy()
        self.time = np.full((n, n), scenario.start)
        self._past: list[Array] = []

    def receive(self, table: RobotTable, now: float) -> None:
        each = table.each
        self.observe(np.array([each["position"], each["velocity"], each["acceleration"]]), now)

    def groups(
        self, table: RobotTable, d: int, policy: Policy, due: Indices, now: float
    ) -> Iterator[tuple[Indices, float]]:
        """Each robot with the others as it observed them last; those that share their manoeuvres know them at once."""
        if policy.method.shared:
            yield from super().groups(table, d, policy, due, now)
            return
        for k in due.tolist():
            policy.observe(table, d, now, np.moveaxis(self.observed[k], 0, 1), self.time[k])
            yield due[due == k], 0.0

    def observe(self, states: Array, now: float) -> None:
        """Observe all robots; `states` (3, n, 3): positions, velocities and accelerations at `now` [s]."""
        n = len(self.time)
        self._past.append(states)
        if len(self._past) > self._delay_steps + 1:
            self._past.pop(0)
        if len(self._past) <= self._delay_steps:
            return
        errors = self.noise * self.random.standard_normal((n, 3, n, 3))
        observed = np.broadcast_to(self._past[0], (n, 3, n, 3)) + errors
        observed[..., self.dimension :] = 0.0
        fresh = self.random.random((n, n)) >= self.loss
        self.observed = np.where(fresh[:, None, :, None], observed, self.observed)
        self.time[fresh] = now - self.delay

    def state(self, i: int, j: int) -> tuple[State, float]:
        """The state of robot j that robot i observed last, and its time [s]."""
        position, velocity, acceleration = self.observed[i, :, j, : self.dimension]
        return State(position, velocity, acceleration), float(self.time[i, j])


def sensing_of(states: RobotStates, method: Method, seed: int) -> Sensing | None:
    """The sensing of a run in which robots observe each other late, inexactly or with losses; else None."""
    scenario = states.scenario
    if method.shared or not (scenario.sight_noise or scenario.sight_delay or scenario.sight_loss):
        return None
    return Sensing(scenario, np.array([states.position, states.velocity, states.acceleration]), seed)
