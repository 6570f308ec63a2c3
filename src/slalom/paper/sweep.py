"""NAO against AO in the roundabout: replan interval x lane speed x neighbours x keeping or not, many seeds each."""

from collections.abc import Callable, Sequence
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
from joblib import Parallel, delayed

from slalom.paper.controller import Rules, row

METHODS: Final = ("nao", "ao")
REPLANS: Final = (0.1, 0.25, 0.5, 1.0, 2.0)
"""[s] Between decisions."""
LANE_SPEEDS: Final = (1.0, 1.5)
"""Times the gallery's 5, 6.5 and 8 m/s."""
NEIGHBOURS: Final = (0, 5)
"""How many cars are looked at; 0 for all 30."""
KEEPS: Final = (True, False)
BATCH: Final = 10
"""Seeds of one row that one process takes at a time."""


class Cell(NamedTuple):
    """A row of the table: the rules and the lane speed."""

    rules: Rules
    speed: float


def cells(quick: bool = False) -> list[Cell]:
    """The rows of the table; a few of them if `quick`."""
    replans, speeds, counts = (
        (REPLANS[2::2], LANE_SPEEDS[:1], NEIGHBOURS[:1]) if quick else (REPLANS, LANE_SPEEDS, NEIGHBOURS)
    )
    return [
        Cell(Rules(method, replan, neighbours, keep), speed)
        for keep, neighbours, speed, replan, method in product(KEEPS, counts, speeds, replans, METHODS)
    ]


def sensitivity() -> list[Cell]:
    """Rows about one: other horizons and other acceleration limits, all cars, kept, decisions twice a second."""
    horizons = [Cell(Rules(m, 0.5, horizon=h), 1.0) for h in (2.0, 3.0, 4.0, 8.0) for m in METHODS]
    limits = [Cell(Rules(m, 0.5, max_acceleration=a), 1.0) for a in (2.0, 3.0, 6.0) for m in METHODS]
    return horizons + limits


def measured(cell: Cell, seeds: Sequence[int]) -> list[dict[str, Any]]:
    """The runs of some seeds."""
    return [row(cell.rules, seed, cell.speed) for seed in seeds]


def table(rows: Sequence[Cell], seeds: int, jobs: int, advance: Callable[[float], None]) -> list[dict[str, Any]]:
    """One aggregate for each cell, in the order of the cells, the same for any number of jobs."""
    parts = [list(range(first, min(first + BATCH, seeds))) for first in range(0, seeds, BATCH)]
    work = [(index, part) for index in range(len(rows)) for part in range(len(parts))]
    found: dict[tuple[int, int], list[dict[str, Any]]] = {}

    def one(index: int, part: int) -> tuple[int, int, list[dict[str, Any]]]:
        return index, part, measured(rows[index], parts[part])

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
    """Counts and means over the runs of one cell."""
    rules, out = cell.rules, [run for run in runs if run["out"]]
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
        "left_the_ring": len(out),
        "far_side": sum(run["far_side"] for run in runs),
        "time": float(np.mean([run["time"] for run in out])) if out else None,
        "least_clearance": min(run["clearance"] for run in runs),
    }


def measure(seeds: int, jobs: int, quick: bool, advance: Callable[[float], None]) -> dict[str, Any]:
    """The whole sweep, and with a third of the seeds the rows about one of its cells."""
    grid, around, fewer = cells(quick), sensitivity()[: 2 if quick else None], max(1, seeds // 3)
    work = seeds * len(grid), fewer * len(around)
    share = work[0] / sum(work)
    return {
        "seeds": seeds,
        "start": [-26.0, 0.0],
        "start_speed": 5.0,
        "rows": table(grid, seeds, jobs, lambda done: advance(share * done)),
        "sensitivity_seeds": fewer,
        "sensitivity": table(around, fewer, jobs, lambda done: advance(share + (1.0 - share) * done)),
    }
