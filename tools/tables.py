"""Tables of results in the documentation: the runs behind them, kept one a line, and the tables rendered from these.

    python tools/tables.py                            # renders every table from its kept runs
    python tools/tables.py --make NAME --store DIR    # makes all runs of a table first; DIR keeps finished runs

The runs of the table NAME are in benchmarks/results/NAME.csv. Its page holds it between two comments that name it.
`tests/test_tables.py` compares every table with its runs, and makes two runs of each row again.
"""

import argparse
import csv
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from slalom.sim import Row, compare_all
from slalom.sim.sweep.aggregate import aggregate
from slalom.sim.sweep.case import is_deterministic, run_one
from slalom.sim.sweep.store import Store
from slalom.sim.sweep.study import cases_of

ROOT = Path(__file__).parents[1]
FIELDS = ("scenario", "method", "seed", "robots", "arrived", "collisions", "time", "adjustments", "min_clearance")
"""Columns of a file of runs. time [s] and min_clearance [m] have DIGITS decimals; empty: none."""
DIGITS = 6
"""Decimals of kept times and clearances: fewer than floats have, so that a last bit is not a difference."""

Run = dict[str, str]


@dataclass(frozen=True)
class Table:
    """A table of a page.

    Attributes:
        page: that holds it. rows: what it compares. columns: the text of a cell by heading, from the scenario with its
            settings, the method, and the row of `aggregate`.
    """

    name: str
    page: str
    rows: tuple[Row, ...]
    columns: Mapping[str, Callable[[str, str, Mapping[str, Any]], str]]

    @property
    def runs(self) -> Path:
        """The file of its runs."""
        return ROOT / "benchmarks" / "results" / f"{self.name}.csv"


def decimals(key: str, digits: int) -> Callable[[str, str, Mapping[str, Any]], str]:
    """A column with so many digits of a value; "-" for none."""
    return lambda scenario, method, row: "-" if row[key] is None else f"{row[key]:.{digits}f}"


def share(key: str) -> Callable[[str, str, Mapping[str, Any]], str]:
    """A column "12 of 20 (39-78 %)"; without an interval where all runs are the same."""

    def cell(scenario: str, method: str, row: Mapping[str, Any]) -> str:
        count, runs = min(row[key], row["distinct_runs"]), row["distinct_runs"]
        interval = row[f"{key}_interval"]
        return f"{count} of {runs}" + (
            "" if interval is None else " ({:.0f}-{:.0f} %)".format(*(100 * x for x in interval))
        )

    return cell


ORCA = ("orca", "orca_limited", "orca_inflated")
TABLES = (
    Table(
        "roundabout_crossing",
        "README.md",
        (Row("roundabout_crossing", {}, ("vo", "nlvo", "avo", "ao", "nao"), 200),),
        {
            "method": lambda scenario, method, row: f"`{method}`",
            "runs with a collision (95 %)": share("runs_with_collision"),
            "runs that arrived (95 %)": share("runs_all_arrived"),
            "mean time of those, s": decimals("time", 1),
            "adjustments per run": decimals("adjustments", 1),
            "least clearance, m": decimals("min_clearance", 3),
        },
    ),
    Table(
        "crowdnav",
        "docs/crossings.md",
        (
            Row("crowdnav", {"people": 5}, ("nao_ahead", *ORCA), 500),
            Row("crowdnav", {"people": 5, "margin": 0.1}, ("nao_ahead@observed_velocity",), 500),
            Row("crowdnav", {"people": 10}, ("nao_ahead", *ORCA), 500),
            Row("crowdnav", {"people": 10, "margin": 0.1}, ("nao_ahead@observed_velocity",), 500),
        ),
        {
            "settings": lambda scenario, method, row: scenario.partition(" ")[2],
            "method": lambda scenario, method, row: f"`{method}`",
            "success (95 %)": share("runs_successful"),
            "with a collision": lambda scenario, method, row: str(row["runs_with_collision"]),
            "arrived": lambda scenario, method, row: str(row["runs_all_arrived"]),
            "mean arrival, s": decimals("time", 2),
        },
    ),
)


def scenario_text(row: Row) -> str:
    """A scenario with its settings, as on the command line."""
    return " ".join([row.name, *(f"{name}={value:g}" for name, value in row.settings.items())])


def line(scenario: str, method: str, seed: int, result: Mapping[str, Any]) -> Run:
    """The line of a run in the file of runs."""
    values = {name: result[name] for name in FIELDS[3:]}
    return {"scenario": scenario, "method": method, "seed": str(seed)} | {
        name: "" if value is None else f"{value:.{DIGITS}f}" if isinstance(value, float) else str(value)
        for name, value in values.items()
    }


def make(table: Table, store: Path, jobs: int) -> None:
    """Make all runs of a table, those of the store excepted, and write its file of runs."""
    compare_all(table.rows, jobs=jobs, store=store, progress=lambda done, total: print(f"{done}/{total}", end="\r"))
    lines = []
    for row in table.rows:
        cases = cases_of(row)
        results = Store.at(store).read(cases)
        lines += [line(scenario_text(row), str(case.method), case.seed, results[case.key]) for case in cases]
    with table.runs.open("w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(lines)


def kept(table: Table) -> list[Run]:
    """The lines of the file of runs."""
    with table.runs.open(newline="") as file:
        return list(csv.DictReader(file))


def again(row: Row, method: str, seed: int) -> Run:
    """The line of a run, made now."""
    assert isinstance(row.scenario, str)
    return line(scenario_text(row), method, seed, run_one(row.scenario, row.settings, method, seed))


def rendered(table: Table, runs: Iterable[Run]) -> str:
    """The Markdown of a table from its runs."""
    lines = [f"| {' | '.join(table.columns)} |", "|---" * len(table.columns) + "|"]
    same = {scenario_text(row): is_deterministic(row.scenario, row.settings) for row in table.rows}
    for (scenario, method), group in groupby(runs, key=lambda run: (run["scenario"], run["method"])):
        found = aggregate([_result(run) for run in group], same[scenario])
        lines.append(f"| {' | '.join(cell(scenario, method, found) for cell in table.columns.values())} |")
    return "\n".join(lines)


def _result(run: Run) -> dict[str, Any]:
    """The result of a run as `aggregate` reads it."""
    counts = {name: int(run[name]) for name in ("robots", "arrived", "collisions", "adjustments")}
    numbers = {name: float(run[name]) if run[name] else None for name in ("time", "min_clearance")}
    return {**counts, **numbers, "efficacy": 0.0, "extra_times": (), "statuses": {}, "foresight": None}


def with_table(text: str, table: Table, content: str) -> str:
    """The text of a page with a table in its place. Raises ValueError where the page has no such place."""
    begin, end = (f"<!-- {word} of the table {table.name}, written by tools/tables.py -->" for word in ("begin", "end"))
    before, found, rest = text.partition(begin)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise ValueError(f"{table.page}: expected the comments {begin!r} and {end!r}, found no such place")
    return f"{before}{begin}\n\n{content}\n\n{end}{after}"


def main(tokens: Sequence[str] | None = None) -> int:
    """Make the runs that are asked for, and render all tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--make", choices=[table.name for table in TABLES], action="append", default=[])
    parser.add_argument("--store", type=Path, default=ROOT / "out" / "tables")
    parser.add_argument("--jobs", type=int, default=1)
    given = parser.parse_args(tokens)
    for table in TABLES:
        if table.name in given.make:
            make(table, given.store, given.jobs)
        page = ROOT / table.page
        page.write_text(with_table(page.read_text(), table, rendered(table, kept(table))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
