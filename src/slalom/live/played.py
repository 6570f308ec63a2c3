"""Where the steps of a view come from: a run that is made, or a recording that is replayed."""

from typing import Protocol

import numpy as np

from slalom.checks import Array
from slalom.decision import Decision
from slalom.live.recorded import Recorded, last_state
from slalom.live.seen import decisions
from slalom.methods import Method
from slalom.sim.measure.run_log import Step
from slalom.sim.run.deciders import SingleRobotDecider
from slalom.sim.run.simulate import Run
from slalom.sim.scenario import Scenario


class Played(Protocol):
    """Steps of a run."""

    @property
    def steps(self) -> list[Step]:
        """The steps that are known."""

    @property
    def arrived(self) -> Array:
        """Times of arrival (n,) [s] known so far, inf for the others."""

    @property
    def complete(self) -> bool:
        """Whether all steps are known."""

    @property
    def end(self) -> Step:
        """The states at the end of a complete run."""

    def advance(self, count: int) -> None:
        """Make further steps, if the run is not complete."""

    def decision(self, k: int) -> Decision:
        """Return the decision at step k of the only robot."""


class Made:
    """A run that is made step by step, see `Played`."""

    def __init__(self, scenario: Scenario, method: Method) -> None:
        self._scenario, self._run = scenario, Run(scenario, method)
        self._making = self._run.steps()
        self._decisions: list[Decision] = []
        self.complete = False

    @property
    def steps(self) -> list[Step]:
        """The steps so far."""
        return self._run.log.steps

    @property
    def arrived(self) -> Array:
        """Times of arrival (n,) [s] so far."""
        return self._run.log.arrived

    @property
    def end(self) -> Step:
        """The states after the last step."""
        log = self._run.log
        if log.steps:
            return last_state(log.positions, log.velocities)
        here = np.array([robot.state.position for robot in self._scenario.robots])
        return last_state(here, np.zeros_like(here))

    def advance(self, count: int) -> None:
        """Make further steps."""
        for _ in range(0 if self.complete else count):
            if next(self._making, None) is None:
                self.complete = True
                break
            decider = self._run.decider
            if isinstance(decider, SingleRobotDecider):
                assert decider.decision is not None
                self._decisions.append(decider.decision)

    def decision(self, k: int) -> Decision:
        """Return the decision at step k of the only robot."""
        return self._decisions[k]


class Replayed:
    """A recorded run, see `Played`. Its decisions are made again from the recorded states, up to the step asked for."""

    complete = True

    def __init__(self, found: Recorded) -> None:
        self._found = found
        self.steps, self.end, self.arrived = found.steps, found.end, found.arrived
        self._making = None if found.method is None else decisions(found.scenario, found.method, found.steps)
        self._decisions: list[Decision] = []

    def advance(self, count: int) -> None:
        """All steps are known."""

    def decision(self, k: int) -> Decision:
        """Return the decision at step k of the only robot, of a run with a known method."""
        assert self._making is not None
        while len(self._decisions) <= k:
            self._decisions.append(next(self._making))
        return self._decisions[k]
