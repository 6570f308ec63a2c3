"""Scenarios x methods x seeds -> one table."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, Final, NamedTuple

from slalom.checks import number
from slalom.errors import InvalidInput
from slalom.io.cadrl import read_cases
from slalom.methods import Method
from slalom.peers import CONTENDERS, contender
from slalom.sim.sweep.aggregate import aggregate
from slalom.sim.sweep.case import (
    SOURCES,
    Case,
    Failure,
    drawn,
    is_file,
    method_content,
    run_case,
    scenario_content,
    versions,
)
from slalom.sim.sweep.case_file import is_cases, refuse_more
from slalom.sim.sweep.pool import map_surviving_kills, working_with
from slalom.sim.sweep.store import Result, Store

METHODS: Final = ("vo", "nlvo", "avo", "ao", "nao")
"""Compared if nothing else is said."""
SEEDS: Final = 100
"""[1] Of each scenario and method if nothing else is said."""


class Row(NamedTuple):
    """A scenario with settings, and the methods that are compared in it on seeds 0, 1, ...

    Of a file of test cases, seeds are the first so many cases.
    """

    scenario: str
    settings: Mapping[str, float] = {}
    methods: Sequence[str] = METHODS
    seeds: int = SEEDS


def compare(
    name: str,
    methods: Sequence[str],
    seeds: int,
    *,
    settings: Mapping[str, float] | None = None,
    jobs: int = 1,
    backend: str | None = None,
    store: Path | str | None = None,
    adopt: bool = False,
    progress: Callable[[int, int], None] | None = None,
    note: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Every method on the same `seeds` scenarios (seeds 0, 1, ...), see `compare_all`.

    Returns:
        {"scenario", "seeds", "settings", "methods": {name: {"runs", "runs_with_collision", "runs_all_arrived",
        "runs_successful", "adjustments", "efficacy", "time", "extra_time", "min_clearance", "outcomes", "failures"}}}:
        counts, of which a successful run is one in which all arrived and nobody collided; means over the runs for
        adjustments and efficacy and, over those in which all arrived, time until the last did [s]; of all robots that
        arrived the 50th, 75th and 90th percentile of the extra time [s]; the least clearance [m] of all; for the
        counts and the time "..._interval", between which the share of runs and the mean lie with 95 % confidence; and
        for runs that have no result the reasons, each with its seeds. What there is not is None.
    """
    row = Row(name, settings or {}, methods, seeds)
    return compare_all([row], jobs=jobs, backend=backend, store=store, adopt=adopt, progress=progress, note=note)[0]


def compare_all(
    rows: Sequence[Row],
    *,
    jobs: int = 1,
    backend: str | None = None,
    store: Path | str | None = None,
    adopt: bool = False,
    progress: Callable[[int, int], None] | None = None,
    note: Callable[[str], None] | None = None,
) -> list[dict[str, Any]]:
    """What `compare` gives for each of the rows; the same to the bit for any `jobs` and `backend`, and interrupted or
    not.

    With a `store`, a folder that is made if need be, every run is kept there as soon as it is finished, and a run that
    is there already is not made again: see `Store`. A scenario that a method cannot run (some take discs only), and a
    run whose process is killed again and again, see `pool.survive`, is a failure in the row, not the end. `progress`
    is called with the number of runs that there are and that there will be.

    Args:
        jobs: processes; -1 for one per core. backend: what joblib works with, see `pool.working_with`.

    Raises:
        InvalidInput: an unknown scenario, setting, method or backend, or a value that does not fit. InvalidFile:
            mistakes in a scenario file; a damaged file in the store. Both before anything is run.
    """
    if adopt and store is None:
        raise InvalidInput("adopt: expected a store with runs of former code, found no store")
    if jobs == 0 or any(row.seeds < 1 for row in rows):
        least = min((row.seeds for row in rows), default=1)
        raise InvalidInput(f"seeds, jobs: expected seeds of 1 or more and jobs not 0, found {least} and {jobs}")
    plan = [cases_of(row) for row in rows]
    # By seeds first, so that the work ahead is like the work behind: joblib makes batches by how long runs took.
    cases = {case.key: case for case in sorted(chain.from_iterable(plan), key=lambda case: case.seed)}
    with working_with(backend):
        kept = Store.at(store) if store is not None else None
        if kept is not None and adopt:
            run = partial(_run_and_keep, kept, jobs)
            adopted, compared = kept.adopt(cases.values(), run)
            if note:
                note(f"{store}: {adopted} runs of former code adopted; {compared} made again, with the same results")
        results: dict[str, Result] = dict(kept.read(cases.values())) if kept else {}
        if progress and results:
            progress(len(results), len(cases))
        missing = {key: case for key, case in cases.items() if key not in results}
        for key, result in _finished(kept, missing, jobs):
            results[key] = result
            if progress:
                progress(len(results), len(cases))
    return [_table(row, [results[case.key] for case in made]) for row, made in zip(rows, plan)]


def cases_of(row: Row) -> list[Case]:
    """The runs of a row: all seeds of its first method, then those of the next. Everything is checked."""
    if not row.methods:
        raise InvalidInput(f"methods: expected at least one of {', '.join(CONTENDERS)}; found none")
    settings = {name: number(value, name) for name, value in row.settings.items()}
    contenders = {name: contender(name) for name in row.methods}
    scenario = drawn(row.scenario, settings)
    if is_cases(row.scenario):
        refuse_more(row.scenario, read_cases(row.scenario), row.seeds)
    a_file = is_file(row.scenario) or is_cases(row.scenario)
    where = str(Path(row.scenario).resolve()) if a_file else row.scenario
    about = scenario_content(row.scenario, settings, scenario)
    for method in contenders.values():
        if isinstance(method, Method):
            # What a navigator refuses is a mistake in the settings, whatever happens in the run.
            scenario.navigator(method)
    made = []
    for name, method in contenders.items():
        shared = {
            "scenario": about,
            "method": method_content(method),
            "sources": SOURCES,
            "versions": versions([method]),
        }
        made += [Case(where, settings, name, seed, {**shared, "seed": seed}) for seed in range(row.seeds)]
    return made


def _finished(store: Store | None, cases: Mapping[str, Case], jobs: int) -> Iterator[tuple[str, Result]]:
    """Yield key and result of each case, in the order in which the runs finish, and store them."""
    return map_surviving_kills(partial(_kept, store), cases, jobs=jobs, recall=partial(_recalled, store))


def _run_and_keep(store: Store, jobs: int, cases: Sequence[Case]) -> dict[str, Result]:
    """Return the results of the cases by key, and store them."""
    return dict(_finished(store, {case.key: case for case in cases}, jobs))


def _kept(store: Store | None, case: Case) -> Result:
    """The result of a run, which is in the store as soon as it is known, and before it is handed on."""
    result = run_case(case)
    if store is not None and not isinstance(result, Failure):
        store.write(case, result)
    return result


def _recalled(store: Store | None, cases: Iterable[Case]) -> dict[str, Result]:
    return dict(store.read(cases)) if store is not None else {}


def _table(row: Row, results: Sequence[Result]) -> dict[str, Any]:
    """What `compare` gives, from the results of the row's cases."""
    parts = [results[first : first + row.seeds] for first in range(0, len(results), row.seeds)]
    return {
        "scenario": row.scenario,
        "seeds": row.seeds,
        "settings": dict(row.settings),
        "methods": {name: aggregate(part) for name, part in zip(dict.fromkeys(row.methods), parts, strict=True)},
    }


def flat(tables: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One row for each scenario and method of what `compare_all` gives."""
    return [
        {**{name: value for name, value in table.items() if name != "methods"}, "method": method, **row}
        for table in tables
        for method, row in table["methods"].items()
    ]
