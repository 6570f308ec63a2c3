"""How a run ended that was not recorded."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.sim.measure.recording import Recording
from slalom.sim.scenario import Scenario


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
    def of(
        cls,
        scenario: Scenario,
        method: str,
        seed: int,
        steps: int,
        last: Sequence[Any],
        arrived: Sequence[float],
        statuses: Mapping[str, int],
        *,
        foresight: str,
    ) -> "RunSummary":
        """The end of a run of so many steps that ended in the states `last` (N)."""
        return cls(
            scenario=scenario.name,
            method=method,
            seed=seed,
            dt=scenario.dt,
            parameters=dict(scenario.parameters),
            times=scenario.start + scenario.dt * np.array([0.0, steps]),
            steps=steps,
            position=np.array([state.position for state in last]),
            velocity=np.array([state.velocity for state in last]),
            arrived=np.array(arrived),
            statuses=dict(sorted(statuses.items())),
            foresight=foresight,
        )

    def __getattr__(self, name: str) -> Any:
        if name in RECORDED:
            raise InvalidInput(f"{name}: expected a run that was recorded, found one with record=False")
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")


RECORDED = {name for name in (*dir(Recording), *(f.name for f in fields(Recording))) if not name.startswith("_")}
"""The attributes of recordings."""
