"""Targets that guidance gave the robots of a run, made again from its states."""

from collections.abc import Sequence

import numpy as np

from slalom.checks import Array
from slalom.goal import Goal
from slalom.sim.measure.run_log import Step
from slalom.sim.run.guidance import GuidedRun
from slalom.sim.run.robot_states import RobotStates
from slalom.sim.run.simulate import by_name
from slalom.sim.scenario import Scenario
from slalom.trajectory import Stationary


class Targets:
    """Targets of the robots of a scenario, in the order of time; what was made once is kept."""

    def __init__(self, scenario: Scenario) -> None:
        ordered, self._rows = by_name(scenario)
        self._scenario, self._states = scenario, RobotStates(ordered)
        self._guidance = GuidedRun(self._states)
        self._known: list[tuple[Array, Array, Array]] = []

    def goal(self, steps: Sequence[Step], k: int, robot: int) -> Goal:
        """Return what a robot drives to at step k: the target of its latest decision, or its goal."""
        own = self._scenario.robots[robot].goal
        if not self._guidance.guided:
            return own
        while len(self._known) <= k:
            self._advance(steps)
        target, tolerance, stop = (values[robot] for values in self._known[k])
        made = k - k % self._scenario.steps_per_decision
        if (target == own.position(self._scenario.start + made * self._scenario.dt)).all():
            return own
        return Goal(Stationary(target), float(tolerance), bool(stop))

    def _advance(self, steps: Sequence[Step]) -> None:
        scenario, states, guide, d = self._scenario, self._states, self._guidance.guide, self._scenario.dimension
        k = len(self._known)
        step, now = steps[k], scenario.start + k * scenario.dt
        if k:
            # A goal may be passed during a step.
            acceleration = np.zeros_like(states.position)
            acceleration[self._rows, :d] = steps[k - 1].accelerations
            states.integrate(acceleration, scenario.dt)
        states.position[self._rows, :d], states.velocity[self._rows, :d] = step.positions, step.velocities
        states.note_arrivals(now)
        if k % scenario.steps_per_decision:
            self._known.append(self._known[-1])
            return
        self._guidance.update(now, scenario.dt * scenario.steps_per_decision)
        rows = self._rows
        self._known.append((guide.target[rows, :d], guide.tolerance[rows], np.array(guide.stop[rows])))
