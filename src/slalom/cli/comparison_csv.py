"""Comparisons as CSV: one row for each scenario and method."""

import csv
from collections.abc import Iterable, Mapping
from io import StringIO
from typing import Any, Final

COUNTS: Final = ("runs_with_collision", "runs_all_arrived", "runs_successful")
"""Counts of runs with a confidence interval of their share."""
PERCENTILES: Final = ("extra_time_50", "extra_time_75", "extra_time_90")
"""[s] Columns of the percentiles of the extra time."""
HEADS: Final = (
    *("scenario", "settings", "method", "foresight", "guided", "seeds", "runs", "distinct_runs"),
    *(name for count in COUNTS for name in (count, f"{count}_low", f"{count}_high")),
    *("time", "time_low", "time_high", "adjustments", "jerk", *PERCENTILES, "efficacy", "min_clearance", "failures"),
)
"""Columns before those of further metrics. Times in s, jerk in m/s^3, clearance in m; shares of 95 % intervals."""


def csv_text(rows: Iterable[Mapping[str, Any]]) -> str:
    """Return rows of `study.flat` as CSV with a header; empty cells have no value.

    Numbers are read back to the bit. A metric has three columns: its mean and the ends of its interval.
    """
    rows = list(rows)
    metrics = list(dict.fromkeys(name for row in rows for name in row.get("metrics", ())))
    heads = [*HEADS, *(head for name in metrics for head in (name, f"{name}_low", f"{name}_high"))]
    stream = StringIO()
    writer = csv.DictWriter(stream, heads, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(_cells(row) for row in rows)
    return stream.getvalue()


def _cells(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return the cells of a row by column."""
    cells = {name: row[name] for name in HEADS if name in row and name != "failures"}
    cells["settings"] = " ".join(f"{name}={value!r}" for name, value in row["settings"].items())
    cells["guided"] = str(row["guided"]).lower()
    cells["failures"] = "; ".join(f"{len(one['seeds'])}: {one['reason']}" for one in row["failures"])
    for name in (*COUNTS, "time"):
        cells |= _interval(name, row[f"{name}_interval"])
    cells |= zip(PERCENTILES, row["extra_time"] or (None,) * len(PERCENTILES))
    for name, found in row.get("metrics", {}).items():
        cells |= {name: found["mean"]} | _interval(name, found["interval"])
    return cells


def _interval(name: str, interval: list[float] | None) -> dict[str, float | None]:
    low, high = interval or (None, None)
    return {f"{name}_low": low, f"{name}_high": high}
