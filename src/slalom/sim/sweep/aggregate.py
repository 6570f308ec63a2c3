"""Aggregation of the runs of one scenario and method to a table row, with confidence intervals."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from slalom.sim.measure.metrics import finite
from slalom.sim.sweep.case import Failure

PERCENTILES: Final = (50, 75, 90)
"""[%] Percentiles of the extra time in a row."""


def wilson(count: int, runs: int) -> list[float] | None:
    """Return the 95 % confidence interval of a share, observed in `count` of `runs` (Wilson, JASA 22, 1927).

    None for no runs.
    """
    if runs == 0:
        return None
    z, share = 1.96, count / runs
    middle, scale = share + z * z / (2 * runs), 1.0 + z * z / runs
    half = z * float(np.sqrt(share * (1.0 - share) / runs + z * z / (4 * runs * runs)))
    return [max(0.0, (middle - half) / scale), min(1.0, (middle + half) / scale)]


def mean_interval(values: Sequence[float]) -> list[float] | None:
    """Return the 95 % confidence interval of a mean by Student's t; None for fewer than two values.

    The quantile of t is the expansion 26.7.5 of Abramowitz and Stegun: 0.3 % low for 4 degrees of freedom, 24 % for 1.
    """
    n = len(values)
    if n < 2:
        return None
    z, nu = 1.959964, float(n - 1)
    t = z + (z**3 + z) / (4 * nu) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * nu**2)
    t += (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * nu**3)
    mean, half = float(np.mean(values)), t * float(np.std(values, ddof=1)) / float(np.sqrt(n))
    return [mean - half, mean + half]


def aggregate(results: Sequence[Mapping[str, Any] | Failure], deterministic: bool = False) -> dict[str, Any]:
    """Return the results of seeds 0, 1, ... as one row, JSON-ready; see `study.compare`.

    Args:
        deterministic: whether all runs are the same. They then count as one distinct run, and the row has no
            confidence intervals.
    """
    rows = [row for row in results if not isinstance(row, Failure)]
    times = [row["time"] for row in rows if row["arrived"] == row["robots"]]
    # Equal runs are one: they say nothing about others.
    share, mean = (_no_interval, _no_interval) if deterministic else (wilson, mean_interval)
    good = sum(row["arrived"] == row["robots"] and not row["collisions"] for row in rows)
    extra = [seconds for row in rows for seconds in row["extra_times"] if seconds is not None]
    collided = sum(row["collisions"] > 0 for row in rows)
    clearances = [row["min_clearance"] for row in rows if row["min_clearance"] is not None]
    # Runs that were kept before their jerk was measured have none.
    jerks = [row["jerk"] for row in rows if row.get("jerk") is not None]
    outcomes: Counter[str] = Counter()
    for row in rows:
        outcomes.update(row["statuses"])
    return {
        "foresight": rows[0]["foresight"] if rows else None,
        "runs": len(rows),
        "distinct_runs": min(len(rows), 1) if deterministic else len(rows),
        "runs_with_collision": collided,
        "runs_with_collision_interval": share(collided, len(rows)),
        "runs_all_arrived": len(times),
        "runs_all_arrived_interval": share(len(times), len(rows)),
        "runs_successful": good,
        "runs_successful_interval": share(good, len(rows)),
        "adjustments": float(np.mean([row["adjustments"] for row in rows])) if rows else None,
        "jerk": float(np.mean(jerks)) if jerks else None,
        "efficacy": float(np.mean([row["efficacy"] for row in rows])) if rows else None,
        "time": finite(float(np.mean(times))) if times else None,
        "time_interval": mean(times),
        "extra_time": [float(x) for x in np.percentile(extra, PERCENTILES)] if extra else None,
        "min_clearance": finite(min(clearances, default=np.inf)),
        "outcomes": dict(sorted(outcomes.items())),
        "failures": _failures(results),
        **({"metrics": _metrics([row["metrics"] for row in rows], mean)} if rows and "metrics" in rows[0] else {}),
    }


def _metrics(
    rows: Sequence[Mapping[str, float | None]], interval: Callable[[Sequence[float]], list[float] | None]
) -> dict[str, Any]:
    """Return mean and confidence interval of each metric over the runs in which it is finite."""
    found = {name: [value for row in rows if (value := row[name]) is not None] for name in rows[0]}
    return {
        name: {"mean": float(np.mean(values)) if values else None, "interval": interval(values)}
        for name, values in found.items()
    }


def _no_interval(*_: Any) -> None:
    """Return the interval of equal runs: none."""


def _failures(results: Sequence[Mapping[str, Any] | Failure]) -> list[dict[str, Any]]:
    """Return the reasons of runs without a result, each with its seeds."""
    seeds: dict[Failure, list[int]] = {}
    for seed, result in enumerate(results):
        if isinstance(result, Failure):
            seeds.setdefault(result, []).append(seed)
    return [{**failure._asdict(), "seeds": which} for failure, which in seeds.items()]
