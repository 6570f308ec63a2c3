"""Claim `sweep`: NAO against AO in the roundabout, over replan interval, lane speed, neighbours and commitment."""

from collections.abc import Callable, Sequence
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
from joblib import Parallel, delayed

from slalom.paper.controller import Rules, run_metrics

SWEPT_METHODS: Final = ("nao", "ao")
REPLANS: Final = (0.1, 0.25, 0.5, 1.0, 2.0)
"""[s] Intervals between decisions."""
LANE_SPEEDS: Final = (1.0, 1.5)
"""[1] Speed factors of the cars, times the gallery's 5, 6.5 and 8 m/s."""
NEIGHBOURS: Final = (0, 5)
"""Numbers of nearest cars that are considered; 0 for all 30."""
KEEPS: Final = (True, False)
BATCH: Final = 10
"""Number of seeds of one row per task of a process."""


class Cell(NamedTuple):
    """A cell of the sweep: parameters of the controller and lane speed factor."""

    rules: Rules
    speed: float


def cells(quick: bool = False) -> list[Cell]:
    """Return the cells of the sweep; a few of them if `quick`."""
    replans, speeds, counts = (
        (REPLANS[2::2], LANE_SPEEDS[:1], NEIGHBOURS[:1]) if quick else (REPLANS, LANE_SPEEDS, NEIGHBOURS)
    )
    return [
        Cell(Rules(method, replan, neighbours, keep), speed)
        for keep, neighbours, speed, replan, method in product(KEEPS, counts, speeds, replans, SWEPT_METHODS)
    ]


def sensitivity() -> list[Cell]:
    """Return variants of one cell (all cars, kept, replan 0.5 s) with other horizons and acceleration limits."""
    horizons = [Cell(Rules(m, 0.5, horizon=h), 1.0) for h in (2.0, 3.0, 4.0, 8.0) for m in SWEPT_METHODS]
    limits = [Cell(Rules(m, 0.5, max_acceleration=a), 1.0) for a in (2.0, 3.0, 6.0) for m in SWEPT_METHODS]
    return horizons + limits


def metrics_of_seeds(cell: Cell, seeds: Sequence[int]) -> list[dict[str, Any]]:
    """Return the metrics of the runs of some seeds."""
    return [run_metrics(cell.rules, seed, cell.speed) for seed in seeds]


def table(rows: Sequence[Cell], seeds: int, jobs: int, advance: Callable[[float], None]) -> list[dict[str, Any]]:
    """Return one aggregate per cell, in the order of the cells; the result does not depend on the number of jobs."""
    parts = [list(range(first, min(first + BATCH, seeds))) for first in range(0, seeds, BATCH)]
    work = [(index, part) for index in range(len(rows)) for part in range(len(parts))]
    found: dict[tuple[int, int], list[dict[str, Any]]] = {}

    def one(index: int, part: int) -> tuple[int, int, list[dict[str, Any]]]:
        return index, part, metrics_of_seeds(rows[index], parts[part])

    for index, part, runs in Parallel(n_jobs=jobs, return_as="generator_unordered")(
        delayed(one)(index, part) for index, part in work
    ):
        found[index, part] = runs
        advance(len(found) / len(work))
    return [
        aggregate(cell, [run for part in range(len(parts)) for run in found[index, part]])
        for index, cell in enumerate(rows)
    ]


def aggregate(cell: Cell, runs: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return counts and means over the runs of one cell."""
    rules, left = cell.rules, [run for run in runs if run["out"]]
    return {
        "method": rules.method,
        "replan": rules.replan,
        "lane_speed": cell.speed,
        "neighbours": rules.neighbours,
        "keep": rules.keep,
        "max_acceleration": rules.max_acceleration,
        "horizon": rules.horizon,
        "runs": len(runs),
        "runs_with_collision": sum(run["hits"] > 0 for run in runs),
        "cars_hit": sum(run["hits"] for run in runs),
        "adjustments": float(np.mean([run["adjustments"] for run in runs])),
        "adjustments_per_second": sum(run["adjustments"] for run in runs) / sum(run["time"] for run in runs),
        "decisions": float(np.mean([run["decisions"] for run in runs])),
        "mean_acceleration": float(np.mean([run["mean_acceleration"] for run in runs])),
        "mean_jerk": float(np.mean([run["mean_jerk"] for run in runs])),
        "without_free_control": sum(run["delayed"] for run in runs) / sum(run["decisions"] for run in runs),
        "left_the_ring": len(left),
        "far_side": sum(run["far_side"] for run in runs),
        "time": float(np.mean([run["time"] for run in left])) if left else None,
        "least_clearance": min(run["clearance"] for run in runs),
    }


def measure_sweep(seeds: int, jobs: int, quick: bool, advance: Callable[[float], None]) -> dict[str, Any]:
    """Measure the whole sweep and, with a third of the seeds, the variants of one of its cells."""
    grid = cells(quick)
    variants = sensitivity()[: 2 if quick else None]
    variant_seeds = max(1, seeds // 3)
    work = seeds * len(grid), variant_seeds * len(variants)
    share = work[0] / sum(work)
    return {
        "seeds": seeds,
        "start": [-26.0, 0.0],
        "start_speed": 5.0,
        "rows": table(grid, seeds, jobs, lambda done: advance(share * done)),
        "sensitivity_seeds": variant_seeds,
        "sensitivity": table(variants, variant_seeds, jobs, lambda done: advance(share + (1.0 - share) * done)),
    }
