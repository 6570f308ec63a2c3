"""Log of a run, written by the loop over time: every step of a recorded run, and the final states."""

from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.sim.scenario import Scenario


class Step(NamedTuple):
    """One step of N robots: states at its start, and accelerations applied during it.

    Attributes:
        positions, velocities, accelerations: (N, d) [m, m/s, m/s^2].
        controls: (N, d) of the committed manoeuvres. responses: their responses as text.
        outcomes: names of the outcomes of decisions, "" without a decision. decision_times: (N,) [s] wall clock.
    """

    positions: Array
    velocities: Array
    accelerations: Array
    controls: Array
    responses: tuple[str, ...]
    outcomes: tuple[str, ...]
    decision_times: Array


@dataclass(eq=False)
class RunLog:
    """Log of one run, from which `Recording.of` and `RunSummary.of` are built.

    Attributes:
        scenario, method, seed, foresight: see `Recording`.
        steps: steps of a recorded run. count: number of steps, recorded or not.
        statuses: number of decisions by name of the outcome.
        positions, velocities: (N, d) [m, m/s] at the end. arrived: (N,) [s] absolute, inf if not.
    """

    scenario: Scenario
    method: str
    seed: int
    foresight: str
    steps: list[Step] = field(default_factory=list)
    count: int = 0
    statuses: Counter[str] = field(default_factory=Counter)
    positions: Array = field(default_factory=lambda: np.empty((0, 2)))
    velocities: Array = field(default_factory=lambda: np.empty((0, 2)))
    arrived: Array = field(default_factory=lambda: np.empty(0))

    def end(self, positions: Array, velocities: Array, arrived: Array) -> None:
        """Store the final positions (N, d) [m], velocities (N, d) [m/s] and arrival times (N,) [s]."""
        self.positions, self.velocities, self.arrived = positions, velocities, arrived
