"""Tables of results in the documentation: the runs behind them, kept one a line, and the tables rendered from these.

    python tools/tables.py                            # renders every table from its kept runs
    python tools/tables.py --make NAME --store DIR    # makes all runs of a table first; DIR keeps finished runs
    python tools/tables.py --make fleets --data DIR   # DIR has the test cases of other projects

The runs of the table NAME are in benchmarks/results/NAME.csv. The table of a study is the file NAME_table.csv beside
them. Other tables are in pages, between two comments that name them.
`tests/docs/test_tables.py` compares every table with its runs, and makes two runs of its rows again. Runs take place in
the processes of `portable.py`: their bits are the same on other processors.
"""

import argparse
import csv
import io
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Any

import portable

from slalom.cli.report import printed
from slalom.peers import contender
from slalom.sim import Row, compare_all
from slalom.sim.sweep.case import is_cases, is_deterministic, is_file, is_guided, run_one, versions
from slalom.sim.sweep.store import Store
from slalom.sim.sweep.study import Study, aggregate, cases_of, read_study

ROOT = Path(__file__).parents[1]
FIELDS = ("scenario", "method", "seed", "robots", "arrived", "collisions", "time", "adjustments", "min_clearance")
"""Columns of a file of runs. time [s] and min_clearance [m] have DIGITS decimals; empty: none."""
STUDY_FIELDS = (*FIELDS, "foresight", "efficacy", "extra_times", "jerk")
"""Columns of the runs of a study. extra_times [s]: of the robots that arrived, with EXTRA_DIGITS decimals."""
DIGITS = 6
"""Decimals of kept times and clearances: fewer than floats have, so that a last bit is not a difference."""
EXTRA_DIGITS = 4
"""Decimals of the extra times; a page shows 2."""

VERSIONS = ROOT / "benchmarks" / "results" / "versions.json"
"""The versions of slalom and of packages with which the runs of each study were made."""

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
    fields: tuple[str, ...] = FIELDS

    @property
    def runs(self) -> Path:
        """The file of its runs."""
        return ROOT / "benchmarks" / "results" / f"{self.name}.csv"

    def written(self, text: str, runs: Sequence[Run]) -> str:
        """The text of its page with the table of these runs."""
        return with_table(text, self, rendered(self, runs))

    def files(self, runs: Sequence[Run]) -> dict[Path, str]:
        """The new text of its page."""
        page = ROOT / self.page
        return {page: self.written(page.read_text(), runs)}


@dataclass(frozen=True)
class StudyTable:
    """The table of a study, benchmarks/results/NAME_table.csv: a row for each scenario and method with kept runs.

    Attributes:
        data: folder of the test cases of other projects; without it their runs are not made.
        has_chart: whether docs/images/NAME.svg is drawn of it.
    """

    name: str
    data: Path | None = None
    has_chart: bool = False
    fields: tuple[str, ...] = STUDY_FIELDS

    @property
    def runs(self) -> Path:
        """The file of its runs."""
        return ROOT / "benchmarks" / "results" / f"{self.name}.csv"

    @property
    def whole(self) -> Path:
        """The file of its rows."""
        return ROOT / "benchmarks" / "results" / f"{self.name}_table.csv"

    @property
    def chart(self) -> Path:
        """Its chart."""
        return ROOT / "docs" / "images" / f"{self.name}.svg"

    @cached_property
    def study(self) -> Study:
        """The study."""
        return read_study(ROOT / "benchmarks" / f"{self.name}.yaml", self.data)

    @property
    def rows(self) -> tuple[Row, ...]:
        """All its rows; those of files of test cases are the last."""
        study = self.study
        return (*study.rows, *study.left_out)

    def written(self, runs: Sequence[Run]) -> str:
        """The text of the file of its rows."""
        found = {key: list(group) for key, group in groupby(runs, key=lambda run: (run["scenario"], run["method"]))}
        tables = []
        for row in self.rows:
            methods = [method for method in row.methods if (scenario_text(row), method) in found]
            same = bool(methods) and is_deterministic(row.name, row.settings)
            aggregates = {
                method: aggregate([_result(run) for run in found[scenario_text(row), method]], same)
                | {"guided": is_guided(row.name, row.settings, method)}
                for method in methods
            }
            name = Path(row.name).name if is_cases(row.name) else row.name
            about = {"scenario": name, "seeds": row.seeds, "settings": dict(row.settings), "deterministic": same}
            tables.append({**about, "methods": aggregates})
        file = io.StringIO()
        csv.writer(file, lineterminator="\n").writerows(printed(tables))
        return file.getvalue()

    def files(self, runs: Sequence[Run]) -> dict[Path, str]:
        """The new text of the file of its rows."""
        return {self.whole: self.written(runs)}

    def draw(self) -> None:
        """Draw its chart from the file of its rows."""
        from study_chart import chart

        from slalom.view import save

        with self.whole.open(newline="") as file:
            save(chart(list(csv.DictReader(file))), self.chart)


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


BEST: Mapping[str, Mapping[str, float]] = {
    "vo": {"horizon": 1.0, "patience": 0.2, "margin": 0.2},
    "nlvo": {"horizon": 10.0, "patience": 0.05, "margin": 0.05},
    "avo": {"horizon": 10.0, "patience": 0.01, "margin": 0.8},
    "ao": {"horizon": 3.0, "patience": 0.0, "margin": 0.05},
}
"""The best settings of the baselines in `roundabout_crossing`, of benchmarks/results/best_settings.csv."""
ORCA = ("orca", "orca_limited", "orca_inflated")
TABLES = (
    Table(
        "roundabout_crossing",
        "README.md",
        (
            *(Row("roundabout_crossing", settings, (name,), 100) for name, settings in BEST.items()),
            Row("roundabout_crossing", {}, ("nao", *BEST), 100),
        ),
        {
            "method": lambda scenario, method, row: f"`{method}`",
            "settings": lambda scenario, method, row: scenario.partition(" ")[2] or "default",
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
            Row("crowdnav", {"people": 5}, ("nao_ahead", *ORCA), 100),
            Row("crowdnav", {"people": 5, "margin": 0.1}, ("nao_ahead@observed_velocity",), 100),
            Row("crowdnav", {"people": 10}, ("nao_ahead", *ORCA), 100),
            Row("crowdnav", {"people": 10, "margin": 0.1}, ("nao_ahead@observed_velocity",), 100),
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


STUDIES = (StudyTable("fleets", has_chart=True), StudyTable("planners"))


def scenario_text(row: Row) -> str:
    """A scenario with its settings, as on the command line; for a file its name without the folder."""
    name = Path(row.name).name if is_cases(row.name) or is_file(row.name) else row.name
    return " ".join([name, *(f"{name}={value:g}" for name, value in row.settings.items())])


def line(scenario: str, method: str, seed: int, result: Mapping[str, Any], fields: Sequence[str] = FIELDS) -> Run:
    """The line of a run in the file of runs."""
    values = {**result.get("metrics", {}), **result}
    return {"scenario": scenario, "method": method, "seed": str(seed)} | {
        name: _text(values[name]) for name in fields[3:]
    }


def _text(value: Any) -> str:
    """A value in a file of runs; several are separated by spaces."""
    if isinstance(value, list):
        return " ".join(f"{each:.{EXTRA_DIGITS}f}" for each in value if each is not None)
    return "" if value is None else f"{value:.{DIGITS}f}" if isinstance(value, float) else str(value)


def make(table: Table | StudyTable, store: Path, jobs: int, merge: bool = False, missing: bool = False) -> None:
    """Make all runs of a table, those of the store excepted, and write its file of runs.

    With `merge` make none: the file gets the rows of which all runs are in the store. With `missing` make only the rows
    of which the file of runs does not have every seed; of the others it keeps the first seeds.
    """
    split = [row._replace(methods=(method,)) for row in table.rows for method in row.methods]
    seeds_of = {key_of(row): row.seeds for row in split}
    known = {key: runs[: seeds_of[key]] for key, runs in kept_rows(table).items() if key in seeds_of} if missing else {}
    new = [row for row in split if len(known.get(key_of(row), ())) < row.seeds]
    if not merge:
        compare_all(new, jobs=jobs, store=store, progress=lambda done, total: print(f"{done}/{total}", end="\r"))
    lines = []
    for row in split:
        if row not in new:
            lines += known[key_of(row)]
            continue
        cases = cases_of(row)
        results = dict(Store.at(store).read(cases))
        without = [case.seed for case in cases if case.key not in results]
        scenario, method = key_of(row)
        if not without:
            lines += [line(scenario, method, case.seed, results[case.key], table.fields) for case in cases]
        elif not merge:
            raise SystemExit(f"{scenario} {method}: expected results of all seeds, found none of {without}")
    with table.runs.open("w", newline="") as file:
        writer = csv.DictWriter(file, table.fields, lineterminator="\n")
        writer.writeheader()
        writer.writerows(lines)
    if isinstance(table, StudyTable):
        made_with = json.loads(VERSIONS.read_text()) if VERSIONS.exists() else {}
        used = versions(contender(name) for row in table.rows for name in row.methods)
        VERSIONS.write_text(json.dumps(made_with | {table.name: used}, indent=2) + "\n")


def key_of(row: Row) -> tuple[str, str]:
    """Scenario and method of a row of one method, as in the file of runs."""
    return scenario_text(row), str(row.methods[0])


def kept_rows(table: Table | StudyTable) -> dict[tuple[str, str], list[Run]]:
    """The lines of the file of runs by scenario and method."""
    runs = kept(table) if table.runs.exists() else []
    return {key: list(group) for key, group in groupby(runs, key=lambda run: (run["scenario"], run["method"]))}


def kept(table: Table | StudyTable) -> list[Run]:
    """The lines of the file of runs."""
    with table.runs.open(newline="") as file:
        return list(csv.DictReader(file))


def again(row: Row, method: str, seeds: Iterable[int], fields: Sequence[str] = FIELDS) -> list[Run]:
    """The lines of runs, made now."""
    with portable.processes(1) as pool:
        task = (run_one, row.scenario, row.settings, method)
        made = [(seed, pool.submit(*task, seed, row.metrics)) for seed in seeds]
        return [line(scenario_text(row), method, seed, run.result(), fields) for seed, run in made]


def rendered(table: Table, runs: Iterable[Run]) -> str:
    """The Markdown of a table from its runs."""
    lines = [f"| {' | '.join(table.columns)} |", "|---" * len(table.columns) + "|"]
    # Files have cases, which differ.
    same = {
        scenario_text(row): not is_file(row.name) and is_deterministic(row.scenario, row.settings) for row in table.rows
    }
    for (scenario, method), group in groupby(runs, key=lambda run: (run["scenario"], run["method"])):
        found = aggregate([_result(run) for run in group], same[scenario])
        lines.append(f"| {' | '.join(cell(scenario, method, found) for cell in table.columns.values())} |")
    return "\n".join(lines)


def _result(run: Run) -> dict[str, Any]:
    """The result of a run as `aggregate` reads it."""
    counts = {name: int(run[name]) for name in ("robots", "arrived", "collisions", "adjustments")}
    numbers = {name: float(run[name]) if run[name] else None for name in ("time", "min_clearance")}
    more = {
        "efficacy": float(run.get("efficacy") or 0.0),
        "extra_times": [float(text) for text in run.get("extra_times", "").split()],
        "foresight": run.get("foresight"),
        "jerk": float(run["jerk"]) if run.get("jerk") else None,
    }
    return {**counts, **numbers, **more, "statuses": {}}


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
    every = (*TABLES, *STUDIES)
    parser.add_argument("--make", choices=[table.name for table in every], action="append", default=[])
    parser.add_argument("--store", type=Path, default=ROOT / "out" / "tables")
    parser.add_argument("--data", type=Path, help="folder of the test cases of other projects")
    parser.add_argument("--merge", action="store_true", help="make no run; take the rows that are in the store")
    parser.add_argument("--missing", action="store_true", help="make only the rows that the file of runs lacks")
    parser.add_argument("--jobs", type=int, default=1)
    words = sys.argv[1:] if tokens is None else list(tokens)
    given = parser.parse_args(words)
    if given.make and not portable.is_set():
        return portable.run(Path(__file__), words)
    for table in every:
        if table.name in given.make:
            chosen = replace(table, data=given.data) if isinstance(table, StudyTable) else table
            make(chosen, given.store, given.jobs, given.merge, given.missing)
        if table.runs.exists():
            for file, text in table.files(kept(table)).items():
                file.write_text(text)
            if isinstance(table, StudyTable) and table.has_chart:
                table.draw()
    return 0


if __name__ == "__main__":
    sys.exit(main())
