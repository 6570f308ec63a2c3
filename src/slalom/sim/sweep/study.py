"""Comparison of methods over scenarios and seeds in one table."""

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
    is_deterministic,
    is_file,
    method_content,
    run_case,
    scenario_content,
    versions,
)
from slalom.sim.sweep.case_file import is_cases, refuse_more
from slalom.sim.sweep.pool import map_surviving_kills, working_with
from slalom.sim.sweep.shard import MISSING, OTHER, Shard
from slalom.sim.sweep.store import Result, Store

METHODS: Final = ("vo", "nlvo", "avo", "ao", "nao")
"""Methods of a row that names none."""
SEEDS: Final = 100
"""[1] Seeds of a row that gives no number."""


class Row(NamedTuple):
    """A scenario with settings, and the methods to compare on seeds 0, 1, ...

    For a file of test cases, the seeds are the first cases.
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
    """Compare methods on the same `seeds` scenarios (seeds 0, 1, ...), see `compare_all`.

    Returns:
        {"scenario", "seeds", "settings", "deterministic", "methods": {name: {"runs", "runs_with_collision",
        "runs_all_arrived", "runs_successful", "adjustments", "efficacy", "time", "extra_time", "min_clearance",
        "outcomes", "failures"}}}:
        counts of runs, where a successful run has all robots arrived and no collision; means over the runs of
        adjustments and efficacy; the mean time of the last arrival [s] over runs in which all arrived; the 50th, 75th
        and 90th percentile of the extra time [s] of all robots that arrived; the least clearance [m] of all runs.
        "deterministic" says that the runs of all seeds are the same; they are one run, without intervals.
        "..._interval" is the 95 % confidence interval of the share of runs, or of the mean time. "failures" are the
        reasons of runs without a result, each with its seeds. A value without data is None.
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
    shard: Shard | None = None,
    merge: bool = False,
    progress: Callable[[int, int], None] | None = None,
    note: Callable[[str], None] | None = None,
) -> list[dict[str, Any]]:
    """Return the table of `compare` for each row: the same to the bit for any `jobs` and `backend`, interrupted or not.

    A scenario that a method cannot run (some take discs only) is a failure in the row. So is a run whose process is
    killed repeatedly, see `pool.map_surviving_kills`.

    Args:
        jobs: processes; -1 for one per core. backend: of joblib, see `pool.working_with`.
        store: folder, made if it does not exist. Every finished run is stored there, and no stored run is made again,
            see `Store`. adopt: take over runs of former code from it first, see `Store.adopt`.
        shard: make only these of the runs; the rows have the runs of other shards that are in the store already.
        merge: make no run; runs that are not in the store are failures in the rows.
        progress: called with the number of finished runs and of all. note: called with a sentence on adopted runs.

    Raises:
        InvalidInput: an unknown scenario, setting, method or backend, or a value out of range. InvalidFile: mistakes
            in a scenario file; a damaged file in the store; former runs with other results. All but the last are
            raised before any run.
    """
    if adopt and store is None:
        raise InvalidInput("adopt: expected a store with runs of former code, found no store")
    if (shard is not None or merge) and store is None:
        raise InvalidInput("store: expected the folder that all shards share, found none")
    if shard is not None and merge:
        raise InvalidInput("merge: expected without shard, found both")
    if jobs == 0 or any(row.seeds < 1 for row in rows):
        least = min((row.seeds for row in rows), default=1)
        raise InvalidInput(f"seeds, jobs: expected seeds of 1 or more and jobs not 0, found {least} and {jobs}")
    plan = [cases_of(row) for row in rows]
    # Seeds first: joblib sizes batches by the durations of the last runs, which are then like the next ones.
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
        own = {} if merge else cases if shard is None else shard.part(cases)
        results |= {key: MISSING if merge else OTHER for key in cases if key not in results and key not in own}
        missing = {key: case for key, case in own.items() if key not in results}
        for key, result in _finished(kept, missing, jobs):
            results[key] = result
            if progress:
                progress(len(results), len(cases))
    return [_table(row, [results[case.key] for case in made]) for row, made in zip(rows, plan)]


def cases_of(row: Row) -> list[Case]:
    """Return the runs of a row: all seeds of its first method, then those of the next. Raises InvalidInput."""
    if not row.methods:
        raise InvalidInput(f"methods: expected at least one of {', '.join(CONTENDERS)}; found none")
    settings = {name: number(value, name) for name, value in row.settings.items()}
    contenders = {name: contender(name) for name in row.methods}
    scenario = drawn(row.scenario, settings)
    if is_cases(row.scenario):
        refuse_more(row.scenario, read_cases(row.scenario), row.seeds)
    a_file = is_file(row.scenario) or is_cases(row.scenario)
    name = str(Path(row.scenario).resolve()) if a_file else row.scenario
    content = scenario_content(row.scenario, settings, scenario)
    for method in contenders.values():
        if isinstance(method, Method):
            # Settings that a navigator refuses are a mistake, also where no run would reach them.
            scenario.navigator(method)
    cases = []
    for called, method in contenders.items():
        shared = {
            "scenario": content,
            "method": method_content(method),
            "sources": SOURCES,
            "versions": versions([method]),
        }
        cases += [Case(name, settings, called, seed, {**shared, "seed": seed}) for seed in range(row.seeds)]
    return cases


def _finished(store: Store | None, cases: Mapping[str, Case], jobs: int) -> Iterator[tuple[str, Result]]:
    """Yield key and result of each case, in the order in which the runs finish, and store them."""
    return map_surviving_kills(partial(_kept, store), cases, jobs=jobs, recall=partial(_recalled, store))


def _run_and_keep(store: Store, jobs: int, cases: Sequence[Case]) -> dict[str, Result]:
    """Return the results of the cases by key, and store them."""
    return dict(_finished(store, {case.key: case for case in cases}, jobs))


def _kept(store: Store | None, case: Case) -> Result:
    """Return the result of a run, after it has been stored."""
    result = run_case(case)
    if store is not None and not isinstance(result, Failure):
        store.write(case, result)
    return result


def _recalled(store: Store | None, cases: Iterable[Case]) -> dict[str, Result]:
    return dict(store.read(cases)) if store is not None else {}


def _table(row: Row, results: Sequence[Result]) -> dict[str, Any]:
    """Return the table of `compare` from the results of the cases of the row."""
    same = is_deterministic(row.scenario, row.settings)
    parts = [results[first : first + row.seeds] for first in range(0, len(results), row.seeds)]
    return {
        "scenario": row.scenario,
        "seeds": row.seeds,
        "settings": dict(row.settings),
        "deterministic": same,
        "methods": {name: aggregate(part, same) for name, part in zip(dict.fromkeys(row.methods), parts, strict=True)},
    }


def flat(tables: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return one row for each scenario and method of the tables of `compare_all`."""
    return [
        {**{name: value for name, value in table.items() if name != "methods"}, "method": method, **row}
        for table in tables
        for method, row in table["methods"].items()
    ]
