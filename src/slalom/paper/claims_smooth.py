"""Claim `smoothness`: collisions, adjustments, acceleration and jerk of slalom's navigator in the roundabout."""

from collections.abc import Callable
from typing import Any, Final, NamedTuple

import numpy as np
from joblib import Parallel, delayed

from slalom.decision.methods import METHODS
from slalom.sim import simulate
from slalom.sim.gallery import build
from slalom.sim.measure.metrics import METRICS


class Setting(NamedTuple):
    """A row of the table: method and replan interval [s]."""

    method: str
    replan: float


SETTINGS: Final = tuple(Setting(method, replan) for replan in (0.1, 1.0) for method in ("vo", "nlvo", "ao", "nao"))
NAMES: Final = (
    "collisions",
    "arrived",
    "time",
    "adjustments",
    "mean_acceleration",
    "max_acceleration",
    "mean_jerk",
    "max_jerk",
    "heading_change",
)


def run_metrics(setting: Setting, seed: int, duration: float) -> dict[str, float]:
    """Return the metrics of one run."""
    scenario = build("roundabout_crossing", {"replan": setting.replan, "duration": duration}, seed=seed)
    recording = simulate(scenario, METHODS[setting.method], seed=seed)
    return {name: METRICS[name](recording) for name in NAMES}


def measure_smoothness(seeds: int, jobs: int, quick: bool, advance: Callable[[float], None]) -> dict[str, Any]:
    """Measure means over the seeds, and count runs with a collision and runs that arrived."""
    settings, duration = (SETTINGS[-1:], 3.0) if quick else (SETTINGS, 60.0)
    work = [(setting, seed) for setting in settings for seed in range(seeds)]
    rows = []
    for row in Parallel(n_jobs=jobs, return_as="generator")(
        delayed(run_metrics)(s, seed, duration) for s, seed in work
    ):
        rows.append(row)
        advance(len(rows) / len(work))
    table = []
    for setting in settings:
        selected = [row for row, (s, _) in zip(rows, work) if s == setting]
        means = {name: float(np.mean([row[name] for row in selected])) for name in NAMES if name not in ("collisions",)}
        table.append(
            {
                **setting._asdict(),
                "runs": len(selected),
                "runs_with_collision": sum(row["collisions"] > 0 for row in selected),
                "runs_that_arrived": sum(row["arrived"] > 0 for row in selected),
                **{name: value for name, value in means.items() if name != "arrived"},
            }
        )
    return {"seeds": seeds, "duration": duration, "max_acceleration_limit": 4.0, "rows": table}
