"""`slalom compare`."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from slalom.cli.console import (
    DONE,
    FAILED,
    Flag,
    Names,
    Settings,
    answer,
    complain,
    parse_settings,
    progress,
    writable,
    writing,
)
from slalom.report import page_text, table_text

if TYPE_CHECKING:
    from slalom.sim.study import Row


def compare(
    scenarios: list[str],
    /,
    *,
    settings: Settings = None,
    methods: str | None = None,
    seeds: int | None = None,
    only: Names = None,
    jobs: int = 1,
    backend: str | None = None,
    store: Path | None = None,
    page: Path | None = None,
    json: Flag = False,
) -> int:
    """Every method on the same scenarios, seeds 0, 1, ...; the same table to the bit for any number of jobs.

    A method that cannot run a scenario is a row that says why. Exit code 1 if no method ran any, or if processes were
    killed again and again, so that runs are missing.

    Parameters
    ----------
    scenarios
        Names from `slalom list scenarios`, .yaml files, or study files, which list scenarios, settings and methods.
    settings
        NAME=VALUE for parameters of the scenarios or settings of every scenario; may be repeated.
    methods
        Names from `slalom list methods`, with commas between; by default those of the study, or vo,nlvo,avo,ao,nao.
    seeds
        How many times each scenario is drawn; by default as in the study, or 100.
    only
        Of a study, only these scenarios.
    jobs
        How many processes; -1 for one per core.
    backend
        What joblib works with: loky (by default), threading, sequential, dask, ray.
    store
        Folder that keeps every finished run, made if need be; the same command goes on where it was interrupted.
    page
        Write the table with confidence intervals, and how it was made, to this Markdown file.
    json
        Print one JSON object.
    """
    from slalom.peers import contender
    from slalom.sim.case import versions
    from slalom.sim.study import compare_all, flat
    from slalom.sim.study_file import is_study, named

    chosen = None if methods is None else [name.strip() for name in methods.split(",") if name.strip()]
    changed = parse_settings(settings)
    study = named(scenarios, settings=changed, methods=chosen, seeds=seeds, only=only)
    writable(page)
    _say_notes(study.rows)
    with progress("comparing") as advance:
        tables = compare_all(
            study.rows,
            jobs=jobs,
            backend=backend,
            store=store,
            progress=lambda done, total: advance(done / total),
        )
    if page is not None:
        command = _command(scenarios, settings, chosen, seeds, only, page)
        made_with = versions(contender(name) for row in study.rows for name in row.methods)
        with writing(page):
            page.write_text(page_text(tables, study.title, study.text, command, made_with))
    alone = len(scenarios) == 1 and not is_study(scenarios[0])
    answer(tables[0] if alone else {"rows": flat(tables)}, json, lambda: "\n\n".join(table_text(t) for t in tables))
    rows = flat(tables)
    killed = any(failure["killed"] for row in rows for failure in row["failures"])
    return DONE if any(row["runs"] for row in rows) and not killed else FAILED


def _say_notes(rows: Sequence["Row"]) -> None:
    """What was repaired or assumed when the files of the scenarios were read, once."""
    from slalom.sim.case import is_file, load

    said = [note for row in rows if is_file(row.scenario) for note in load(row.scenario, row.settings).notes]
    for note in dict.fromkeys(said):
        complain(note)


def _command(
    scenarios: Sequence[str],
    settings: Sequence[str] | None,
    methods: Sequence[str] | None,
    seeds: int | None,
    only: Sequence[str] | None,
    page: Path,
) -> str:
    """The command without what leaves the table as it is."""
    tokens = ["slalom", "compare", *scenarios]
    tokens += [token for setting in settings or () for token in ("--set", setting)]
    tokens += [] if methods is None else ["--methods", ",".join(methods)]
    tokens += [] if seeds is None else ["--seeds", str(seeds)]
    tokens += ["--only", *only] if only else []
    return shlex.join([*tokens, "--page", str(page)])
