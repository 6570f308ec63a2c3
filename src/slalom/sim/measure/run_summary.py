"""How a run ended that was not recorded."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.sim.measure.recording import Recording
from slalom.sim.measure.run_log import RunLog


@dataclass(frozen=True, eq=False)
class RunSummary:
    """The end of a run of N robots: as large after an hour as after a second.

    Of the metrics `arrived` and `time` need no more. All others are of what happened in between, also collisions: an
    attribute that only a `Recording` has raises InvalidInput.

    Attributes:
        scenario, method, seed, dt, parameters, foresight: as of a `Recording`.
        times: (2,) absolute [s], of the begin and the end. steps: how many there were.
        position, velocity: (N, d) at the end.
        arrived: (N,) absolute time, inf if not.
        statuses: how often each outcome of a decision occurred, by its name.
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
        """The end of a run."""
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
        if name in RECORDED:
            raise InvalidInput(f"{name}: expected a run that was recorded, found one with record=False")
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")


RECORDED = {name for name in (*dir(Recording), *(f.name for f in fields(Recording))) if not name.startswith("_")}
"""The attributes of recordings."""
