"""`slalom compare`."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
from slalom.cli.report import page_text, table_text

if TYPE_CHECKING:
    from slalom.sim.sweep.study_yaml import Study


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
    adopt: Flag = False,
    data: Path | None = None,
    page: Path | None = None,
    json: Flag = False,
) -> int:
    """Every method on the same scenarios, seeds 0, 1, ...; the same table to the bit for any number of jobs.

    A method that cannot run a scenario is a row that says why. Exit code 1 if no method ran any, or if processes were
    killed again and again, so that runs are missing.

    Parameters
    ----------
    scenarios
        Names from `slalom list scenarios`, .yaml files, .csv files of test cases (case,agent,x,y,goal_x,goal_y,
        pref_speed,radius), or study files, which list scenarios, settings and methods.
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
    adopt
        Take over runs of former code from the store, if a sample of them, made again, has the same numbers.
    data
        Folder of the test cases that a study names; by default its own. Those not there are left out, and named.
    page
        Write the table with confidence intervals, and how it was made, to this Markdown file.
    json
        Print one JSON object.
    """
    from slalom.sim.sweep.study import compare_all, flat
    from slalom.sim.sweep.study_yaml import is_study, named

    chosen = None if methods is None else [name.strip() for name in methods.split(",") if name.strip()]
    changed = parse_settings(settings)
    study = named(scenarios, settings=changed, methods=chosen, seeds=seeds, only=only, data=data)
    writable(page)
    _say_notes(study)
    with progress("comparing") as advance:
        tables = compare_all(
            study.rows,
            jobs=jobs,
            backend=backend,
            store=store,
            adopt=adopt,
            note=complain,
            progress=lambda done, total: advance(done / total),
        )
    if page is not None:
        _write(page, study, tables, _command(scenarios, settings, chosen, seeds, only, data, page))
    alone = len(scenarios) == 1 and not is_study(scenarios[0])
    rows = flat(tables)
    result = tables[0] if alone else {"rows": rows, "left_out": study.missing}
    answer(result, json, lambda: "\n\n".join(table_text(t) for t in tables))
    killed = any(failure["killed"] for row in rows for failure in row["failures"])
    return DONE if any(row["runs"] for row in rows) and not killed else FAILED


def _say_notes(study: "Study") -> None:
    """What was repaired or assumed when the files of the scenarios were read, once, and what is left out."""
    from slalom.sim.sweep.case import is_file, load

    said = [note for row in study.rows if is_file(row.scenario) for note in load(row.scenario, row.settings).notes]
    for note in dict.fromkeys(said):
        complain(note)
    for name in study.missing:
        complain(f"{name}: left out, as there is no such file; --data names the folder of files of test cases")


def _write(page: Path, study: "Study", tables: Sequence[dict[str, Any]], command: str) -> None:
    """The page, with the versions of what the table was made with."""
    from slalom.peers import contender
    from slalom.sim.sweep.case import versions

    made_with = versions(contender(name) for row in study.rows for name in row.methods)
    with writing(page):
        page.write_text(page_text(tables, study.title, study.text, command, made_with, study.missing))


def _command(
    scenarios: Sequence[str],
    settings: Sequence[str] | None,
    methods: Sequence[str] | None,
    seeds: int | None,
    only: Sequence[str] | None,
    data: Path | None,
    page: Path,
) -> str:
    """The command without what leaves the table as it is."""
    tokens = ["slalom", "compare", *scenarios]
    tokens += [token for setting in settings or () for token in ("--set", setting)]
    tokens += [] if methods is None else ["--methods", ",".join(methods)]
    tokens += [] if seeds is None else ["--seeds", str(seeds)]
    tokens += ["--only", *only] if only else []
    # Where somebody keeps them is of no concern to others.
    tokens += [] if data is None else ["--data", "DATA_DIR"]
    return shlex.join([*tokens, "--page", str(page)])
