"""`slalom compare`."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from slalom.__main__ import INTERRUPTED
from slalom.base.errors import InvalidInput
from slalom.base.writing import write_file
from slalom.cli.console import (
    DONE,
    FAILED,
    Flag,
    Names,
    Settings,
    Whole,
    new_markdown,
    parse_lists,
    print_message,
    print_result,
    progress,
    refuse_source,
    resolved,
    writable,
)
from slalom.cli.options import Look, drawable, refuse_without
from slalom.cli.report import page_text, table_text
from slalom.cli.running import print_notes, refuse_run
from slalom.sim.sweep.tables import NAMES, WRITERS, writer_of

if TYPE_CHECKING:
    from slalom.sim.sweep.study import Study


Tables = Annotated[list[Path] | None, Parameter(name=("--out", "--csv"), consume_multiple=True, negative=())]
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


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Written:
    """Files of a comparison.

    Parameters
    ----------
    page
        Write the table with confidence intervals, the command and the versions to this Markdown file.
    out
        Write the table with confidence intervals to these files, .csv or .tex (LaTeX); also if they exist. One row for
        each scenario and method, and a column for each setting that differs.
    figure
        Draw success and last arrival over the setting with the most values, or else over the methods, to this .svg,
        .pdf or .png file.
    force
        Replace a page that exists.
    """

    page: Path | None = None
    out: Tables = None
    figure: Path | None = None
    look: Look | None = None
    force: Flag = False

    def prepare(self, sources: Sequence[str], study: "Study", *, part: bool) -> None:
        """Make the folders of the files.

        Raises:
            InvalidInput: a file that would hold a `part` of the runs only; a page that exists, without `force`; another
                suffix; a table that is one of the sources; a setting of the figure that some rows do not have.
        """
        tables = self.out or []
        for option, paths in (("--page", [self.page]), ("--out", tables), ("--figure", [self.figure])):
            found = next((str(path) for path in paths if part and path is not None), None)
            if found is not None:
                raise InvalidInput(f"{option}: expected without --shard, which has a part of the runs; found {found!r}")
        new_markdown(self.page, self.force)
        for path in tables:
            writer_of(path)
        for source in sources:
            refuse_source(source, *tables)
        drawable(self.figure)
        refuse_without(self.figure, self.look)
        if self.figure is not None:
            from slalom.view.figure import axis_of

            axis_of([row.settings for row in study.rows])
        writable(self.page, self.figure, *tables)

    def write(self, study: "Study", tables: Sequence[dict[str, Any]], command: str) -> None:
        """Write the files; the `command` is that of the comparison, without the options of files."""
        from slalom.peers import contender
        from slalom.sim.sweep.case import versions

        with_versions = versions(contender(name) for row in study.rows for name in row.methods)
        if self.page is not None:
            made = f"{command} --page {shlex.quote(str(self.page))}"
            text = page_text(tables, study.title, study.text, made, with_versions, study.missing)
            write_file(self.page, text, NAMES)
        for path in self.out or ():
            listed = ", ".join(f"{name} {version}" for name, version in with_versions.items())
            made = f"Made by {command} --out {shlex.quote(str(path))} with {listed}."
            write_file(path, WRITERS[path.suffix](tables, made), NAMES)
        if self.figure is not None:
            from slalom import view

            (self.look or Look()).save(view.study(tables), self.figure)


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
    written: Written | None = None,
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
        NAME=VALUES for parameters of the scenarios or settings of every scenario; may be repeated. VALUES are numbers
        and ranges FROM:TO:STEP, separated by commas; all combinations of the lists are compared.
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
    json
        Print one JSON object.
    """
    from slalom.sim.sweep.study import compare_all, flat, is_study, named

    chosen, measured = _listed(methods), _listed(metrics)
    files = _sources(scenarios)
    study = named(
        files, settings=parse_lists(settings), methods=chosen, seeds=seeds, metrics=measured, only=only, data=data
    )
    options, targets = (work or Work()).settings(), written or Written()
    targets.prepare(files, study, part=options["shard"] is not None)
    _print_notes(study)
    finished = [0, 0]
    try:
        with progress("comparing") as advance:

            def note(done: int, total: int) -> None:
                finished[:] = done, total
                advance(done / total)

            tables = compare_all(study.rows, **options, note=print_message, progress=note)
    except KeyboardInterrupt:
        _print_stopped(finished, options["store"])
        return INTERRUPTED
    targets.write(study, tables, _command(scenarios, settings, chosen, seeds, measured, only, data))
    rows = flat(tables)
    result = tables[0] if len(tables) == 1 and not is_study(files[0]) else {"rows": rows, "left_out": study.missing}
    print_result(result, json, lambda: "\n\n".join(table_text(t) for t in tables))
    return _exit_code(rows)


def _print_stopped(finished: Sequence[int], store: Path | None) -> None:
    """Print which runs are kept after Ctrl-C, and how to go on; `finished` has their number and that of all."""
    done, total = finished
    kept = "None is kept; with --store FOLDER each finished run is."
    if store is not None:
        kept = f"{store} keeps the finished ones; the same command makes the others."
    print_message(f"slalom: stopped after {done} of {total} runs. {kept}" if done else f"slalom: stopped. {kept}")


def _sources(names: Sequence[str]) -> list[str]:
    """Return the names and paths of scenarios. Raises InvalidInput for a run."""
    files = [resolved(name) for name in names]
    for file in files:
        refuse_run(file)
    return files


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
    from slalom.peers import contender
    from slalom.sim.sweep.case import drawn, is_cases, is_file, load, without_effect

    print_notes(
        list(dict.fromkeys(n for row in study.rows if is_file(row.name) for n in load(row.name, row.settings).notes))
    )
    unused: dict[str, dict[str, None]] = {}
    for row in study.rows:
        if is_cases(row.name):
            continue
        scenario = drawn(row.name, row.settings)
        for name in row.methods:
            for setting in without_effect(scenario, contender(name, installed=False)) & row.settings.keys():
                unused.setdefault(setting, {})[f"{name} in {row.name}"] = None
    for setting, found in sorted(unused.items()):
        print_message(f"{setting}: no effect on {', '.join(found)}")
    for name in study.missing:
        print_message(f"{name}: left out, no such file; --data gives the folder of the test cases")


def _command(
    scenarios: Sequence[str],
    settings: Sequence[str] | None,
    methods: Sequence[str] | None,
    seeds: int | None,
    metrics: list[str] | None,
    only: Sequence[str] | None,
    data: Path | None,
) -> str:
    """Return the command line without files and the options that do not affect the table (jobs, backend, store)."""
    tokens = ["slalom", "compare", *scenarios]
    tokens += [token for setting in settings or () for token in ("--set", setting)]
    tokens += [] if methods is None else ["--methods", ",".join(methods)]
    tokens += [] if seeds is None else ["--seeds", str(seeds)]
    tokens += [] if metrics is None else ["--metrics", ",".join(metrics)]
    tokens += ["--only", *only] if only else []
    # The folder differs between machines; the page must not.
    tokens += [] if data is None else ["--data", "DATA_DIR"]
    return shlex.join(tokens)
