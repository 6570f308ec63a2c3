"""Summary of a run without a recording."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.sim.measure.recording import Recording
from slalom.sim.measure.run_log import RunLog


@dataclass(frozen=True, eq=False)
class RunSummary:
    """Final state of a run of N robots; its size does not depend on the duration.

    Only the metrics `arrived` and `time` accept it. The others, including collisions, need the whole run: an attribute
    that only a `Recording` has raises InvalidInput.

    Attributes:
        scenario, method, seed, dt, parameters, foresight: as in `Recording`.
        times: (2,) absolute start and end [s]. steps: number of steps.
        position: (N, d) [m] at the end. velocity: (N, d) [m/s] at the end.
        arrived: (N,) absolute time [s], inf if the robot did not arrive.
        statuses: number of decisions by name of the outcome.
    """

    scenario: str
    method: str
    seed: int
    dt: float
    parameters: dict[str, float]
    times: Array
    steps: int
    position: Array
    velocity: Array
    arrived: Array
    statuses: dict[str, int]
    foresight: str = ""

    @classmethod
    def of(cls, log: RunLog) -> "RunSummary":
        """Return the summary of a run from its log."""
        scenario = log.scenario
        return cls(
            scenario=scenario.name,
            method=log.method,
            seed=log.seed,
            dt=scenario.dt,
            parameters=dict(scenario.parameters),
            times=scenario.start + scenario.dt * np.array([0.0, log.count]),
            steps=log.count,
            position=log.positions,
            velocity=log.velocities,
            arrived=log.arrived,
            statuses=dict(sorted(log.statuses.items())),
            foresight=log.foresight,
        )

    def __getattr__(self, name: str) -> Any:
        if name in RECORDING_ATTRIBUTES:
            raise InvalidInput(f"{name}: expected a recorded run, found one with record=False")
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")


RECORDING_ATTRIBUTES = {
    name for name in (*dir(Recording), *(f.name for f in fields(Recording))) if not name.startswith("_")
}
"""Names of the public attributes of recordings."""
