"""`slalom compare`."""

import csv
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cyclopts import Group, Parameter

from slalom.base.errors import InvalidInput
from slalom.cli.console import (
    DONE,
    FAILED,
    Flag,
    Names,
    Settings,
    Whole,
    new_markdown,
    parse_settings,
    print_message,
    print_result,
    progress,
    refuse_source,
    resolved,
    writable,
    writing,
)
from slalom.cli.report import page_text, table_text
from slalom.cli.running import refuse_run

if TYPE_CHECKING:
    from slalom.sim.sweep.study import Study


# ---------------------------------------------------------------------------------------------------------------------
# Comparisons as CSV: one row for each scenario and method.


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


# ---------------------------------------------------------------------------------------------------------------------
# `slalom compare`.


WORK = Group("Where runs are made and kept", sort_key=1)


@Parameter(name="*", group=WORK)
@dataclass(frozen=True, kw_only=True)
class Work:
    """Options of processes, of the store, and of several machines.

    Parameters
    ----------
    jobs
        Number of processes; -1 for one per core.
    backend
        Backend of joblib: loky (by default), threading, sequential, dask, ray.
    store
        Folder that keeps every finished run, created if needed; the same command resumes an interrupted comparison.
    adopt
        Adopt runs of former code from the store if a sample of them gives the same numbers when it is run again.
    shard
        K/N: make only share K of N of the runs, for several machines that share the store.
    merge
        Make no run; print the table of the runs in the store and list the missing ones, with exit code 1 if there are
        any.
    """

    jobs: Whole = 1
    backend: str | None = None
    store: Path | None = None
    adopt: Flag = False
    shard: str | None = None
    merge: Flag = False

    def settings(self) -> dict[str, Any]:
        """Return the keyword arguments of `compare_all`."""
        from slalom.sim.sweep.store import Shard

        shard = None if self.shard is None else Shard.named(self.shard)
        return {**vars(self), "shard": shard}


def compare(
    scenarios: list[str],
    /,
    *,
    settings: Settings = None,
    methods: str | None = None,
    seeds: Whole | None = None,
    metrics: str | None = None,
    only: Names = None,
    work: Work | None = None,
    data: Path | None = None,
    page: Path | None = None,
    csv: Path | None = None,
    force: Flag = False,
    json: Flag = False,
) -> int:
    """Compare methods on the same scenarios and seeds 0, 1, ...; the table does not depend on the number of jobs.

    The row of a method that cannot run a scenario states the reason. Exit code 1 if no run finished, or if runs are
    missing because their processes were killed repeatedly.

    Parameters
    ----------
    scenarios
        Names from `slalom list scenarios`, .yaml files, .csv files of test cases (case,agent,x,y,goal_x,goal_y,
        pref_speed,radius), or study files (sample:study.yaml). Seeds are the cases of a file (sample:imazu.yaml).
    settings
        NAME=VALUE for parameters of the scenarios or settings of every scenario; may be repeated.
    methods
        Names from `slalom list methods`, separated by commas; by default those of the study, or vo,nlvo,avo,ao,nao.
        Methods of other authors take parameters, as in orca:horizon=5:neighbours=10.
    seeds
        Number of seeds per scenario; by default as in the study, else 1 if it is deterministic, or at most 100 cases.
    metrics
        Names from `slalom list metrics`, separated by commas: further columns; by default those of the study.
    only
        Run only these scenarios of a study.
    data
        Folder of the test cases that a study names; by default the folder of the study. Missing files are left out
        and listed.
    page
        Write the table with confidence intervals, the command and the versions to this Markdown file.
    csv
        Write the table with confidence intervals to this CSV file, one row for each scenario and method.
    force
        Replace a page that exists.
    json
        Print one JSON object.
    """
    from slalom.sim.sweep.study import compare_all, flat, is_study, named

    chosen, measured = _listed(methods), _listed(metrics)
    changed = parse_settings(settings)
    files = _sources(scenarios)
    study = named(files, settings=changed, methods=chosen, seeds=seeds, metrics=measured, only=only, data=data)
    options = (work or Work()).settings()
    _prepare(page, csv, force, files, part=options["shard"] is not None)
    _print_notes(study)
    with progress("comparing") as advance:
        tables = compare_all(
            study.rows, **options, note=print_message, progress=lambda done, total: advance(done / total)
        )
    if page is not None:
        _write_page(page, study, tables, _command(scenarios, settings, chosen, seeds, measured, only, data, page))
    single, rows = len(scenarios) == 1 and not is_study(files[0]), flat(tables)
    if csv is not None:
        _write(csv, csv_text(rows))
    result = tables[0] if single else {"rows": rows, "left_out": study.missing}
    print_result(result, json, lambda: "\n\n".join(table_text(t) for t in tables))
    return _exit_code(rows)


def _sources(names: Sequence[str]) -> list[str]:
    """Return the names and paths of scenarios. Raises InvalidInput for a run."""
    files = [resolved(name) for name in names]
    for file in files:
        refuse_run(file)
    return files


def _prepare(page: Path | None, csv: Path | None, force: bool, sources: Sequence[str], *, part: bool) -> None:
    """Make the folders of the files to write.

    Raises:
        InvalidInput: a file that would hold a part of the runs only; a page that exists, without `force`; another
            suffix than .md or .csv; a CSV file that is one of the sources.
    """
    for option, path in (("--page", page), ("--csv", csv)):
        if part and path is not None:
            raise InvalidInput(f"{option}: expected without --shard, which has a part of the runs; found {str(path)!r}")
    new_markdown(page, force)
    if csv is not None and csv.suffix != ".csv":
        raise InvalidInput(f"--csv: expected a file that ends in .csv, found {str(csv)!r}")
    for source in sources:
        refuse_source(source, csv)
    writable(page, csv)


def _exit_code(rows: Sequence[dict[str, Any]]) -> int:
    """Return FAILED if there is no run, a process was killed repeatedly, or a merge did not find a run."""
    from slalom.sim.sweep.store import MISSING

    failures = [failure for row in rows for failure in row["failures"]]
    lost = any(failure["killed"] or failure["reason"] == MISSING.reason for failure in failures)
    return FAILED if lost or not any(row["runs"] for row in rows) else DONE


def _listed(names: str | None) -> list[str] | None:
    """Return names that are separated by commas; None for none."""
    return None if names is None else [name.strip() for name in names.split(",") if name.strip()]


def _print_notes(study: "Study") -> None:
    """Print the notes on repairs and assumptions of all scenario files, each once, and the files left out."""
    from slalom.sim.sweep.case import is_file, load

    messages = [note for row in study.rows if is_file(row.name) for note in load(row.scenario, row.settings).notes]
    for note in dict.fromkeys(messages):
        print_message(note)
    for name in study.missing:
        print_message(f"{name}: left out, no such file; --data gives the folder of the test cases")


def _write_page(page: Path, study: "Study", tables: Sequence[dict[str, Any]], command: str) -> None:
    """Write the page, with the versions of the libraries and methods used."""
    from slalom.peers import contender
    from slalom.sim.sweep.case import versions

    made_with = versions(contender(name) for row in study.rows for name in row.methods)
    text = page_text(tables, study.title, study.text, command, made_with, study.missing)
    _write(page, text)


def _write(path: Path, text: str) -> None:
    with writing(path):
        # A name of a file that the encoding of the system does not have is written as its bytes.
        path.write_text(text, encoding="utf-8", errors="surrogateescape")


def _command(
    scenarios: Sequence[str],
    settings: Sequence[str] | None,
    methods: Sequence[str] | None,
    seeds: int | None,
    metrics: list[str] | None,
    only: Sequence[str] | None,
    data: Path | None,
    page: Path,
) -> str:
    """Return the command line without the options that do not affect the table (jobs, backend, store)."""
    tokens = ["slalom", "compare", *scenarios]
    tokens += [token for setting in settings or () for token in ("--set", setting)]
    tokens += [] if methods is None else ["--methods", ",".join(methods)]
    tokens += [] if seeds is None else ["--seeds", str(seeds)]
    tokens += [] if metrics is None else ["--metrics", ",".join(metrics)]
    tokens += ["--only", *only] if only else []
    # The folder differs between machines; the page must not.
    tokens += [] if data is None else ["--data", "DATA_DIR"]
    return shlex.join([*tokens, "--page", str(page)])
