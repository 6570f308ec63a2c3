"""Comparison of methods over scenarios and seeds in one table."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, Final, NamedTuple

from slalom.checks import flag, has, listing, mapping, number, shown, text, whole
from slalom.errors import InvalidInput
from slalom.io.cadrl import read_cases
from slalom.methods import Method
from slalom.peers import CONTENDERS, Peer, contender
from slalom.sim.sweep.aggregate import aggregate
from slalom.sim.sweep.case import (
    SOURCES,
    SOURCES_UNGUIDED,
    Case,
    Failure,
    Metric,
    Source,
    drawn,
    is_deterministic,
    is_file,
    is_guided,
    method_content,
    metrics_content,
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

    For a file of test cases, the seeds are the first cases. Scenario and methods are names or objects, metrics names or
    functions of a recording. A method with settings of its own is a row of its own: settings of slalom's methods are
    those of the scenario, and parameters of a peer belong to its name, as in orca:horizon=5.
    """

    scenario: Source
    settings: Mapping[str, float] = {}
    methods: Sequence[str | Method | Peer] = METHODS
    seeds: int = SEEDS
    metrics: Sequence[Metric] = ()

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.scenario if isinstance(self.scenario, str) else self.scenario.name


def compare(
    name: Source,
    methods: Sequence[str | Method | Peer],
    seeds: int,
    *,
    settings: Mapping[str, float] | None = None,
    metrics: Sequence[Metric] = (),
    jobs: int = 1,
    backend: str | None = None,
    store: Path | str | None = None,
    adopt: bool = False,
    progress: Callable[[int, int], None] | None = None,
    note: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Compare methods on the same `seeds` scenarios (seeds 0, 1, ...), see `compare_all`.

    Args:
        name: of the gallery or a file; or an `Entry` of the gallery, or a `Scenario` for every seed.
        methods: names or objects. metrics: names of `metrics.METRICS`, or functions of a recording.

    Returns:
        {"scenario", "seeds", "settings", "deterministic", "methods": {name: {"runs", "distinct_runs",
        "runs_with_collision", "runs_all_arrived", "runs_successful", "adjustments", "jerk", "efficacy", "time",
        "extra_time", "min_clearance", "outcomes", "failures", "guided"}}}:
        counts of runs, where a successful run has all robots arrived and no collision; means over the runs of
        adjustments (of all robots), jerk [m/s^3] and efficacy (means of the robots, see `metrics.summary`); the mean
        time of the last arrival [s] over runs in which all arrived; the 50th, 75th and 90th percentile of the extra
        time [s] of all robots that arrived; the least clearance [m] of all runs.
        "deterministic" says that the runs of all seeds are the same; "runs" counts those that were made, and
        "distinct_runs" counts them as one, without intervals.
        "..._interval" is the 95 % confidence interval of the share of runs, or of the mean time. "failures" are the
        reasons of runs without a result, each with its seeds. "guided" says whether guidance chooses the targets of
        robots. A value without data is None. With metrics,
        {"metrics": {name: {"mean", "interval"}}} over the runs in which the value is finite.
    """
    row = Row(name, {} if settings is None else settings, methods, seeds, metrics)
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
        InvalidInput: an unknown scenario, setting, method, metric or backend, or a value out of range; two methods of
            one name; objects with a store, which identifies only the code of slalom and versions of packages.
            InvalidFile: mistakes in a scenario file; a damaged file in the store; former runs with other results. All
            but the last are raised before any run.
    """
    _refuse_kinds(rows, jobs, backend, store, progress, note)
    if flag(adopt, "adopt") and store is None:
        raise InvalidInput("adopt: expected a store with runs of former code, found no store")
    if (shard is not None or merge) and store is None:
        raise InvalidInput("store: expected the folder that all shards share, found none")
    if shard is not None and merge:
        raise InvalidInput("merge: expected without shard, found both")
    if jobs == 0:
        raise InvalidInput("jobs: expected a number of processes, or -1 for one per core, found 0")
    objects = [each for row in rows for each in (row.scenario, *row.methods, *row.metrics) if not isinstance(each, str)]
    if store is not None and objects:
        raise InvalidInput(f"store: expected scenarios, methods and metrics by name, found {shown(objects[0])}")
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


def _refuse_kinds(
    rows: Sequence[Row], jobs: object, backend: object, store: object, progress: object, note: object
) -> None:
    """Raise InvalidInput for arguments of other kinds."""
    for row in rows:
        mapping(row.settings, "numbers by name", "settings")
        listing(row.methods, "methods or their names", "methods")
        listing(row.metrics, "metrics or their names", "metrics")
        whole(row.seeds, "seeds", 1)
    whole(jobs, "jobs", -1)
    if backend is not None:
        text(backend, "backend")
    if not isinstance(store, Path | str | None):
        raise InvalidInput(f"store: expected a folder, found {shown(store)}")
    for name, function in (("progress", progress), ("note", note)):
        if function is not None:
            has(function, ("__call__",), "a function", name)


def cases_of(row: Row) -> list[Case]:
    """Return the runs of a row: all seeds of its first method, then those of the next. Raises InvalidInput."""
    if not len(row.methods):
        raise InvalidInput(f"methods: expected at least one of {', '.join(CONTENDERS)}; found none")
    settings = {name: number(value, name) for name, value in row.settings.items()}
    contenders = _contenders(row)
    metrics = {"metrics": metrics_content(row.metrics)} if row.metrics else {}
    scenario, name = drawn(row.scenario, settings), row.scenario
    if isinstance(name, str) and is_cases(name):
        refuse_more(name, read_cases(name), row.seeds)
    if isinstance(name, str) and (is_file(name) or is_cases(name)):
        name = str(Path(name).resolve())
    content = scenario_content(row.scenario, settings, scenario)
    for _, method in contenders.values():
        if isinstance(method, Method):
            # Settings that a navigator refuses are a mistake, also where no run would reach them.
            scenario.navigator(method)
    cases = []
    for given, method in contenders.values():
        by_name = isinstance(given, str)
        shared = {
            "scenario": content,
            "method": method_content(method) if by_name else {"name": method.name, "object": id(method)},
            **metrics,
            "sources": SOURCES if is_guided(row.scenario, settings, given) else SOURCES_UNGUIDED,
            "versions": versions([method]),
        }
        cases += [Case(name, settings, given, seed, {**shared, "seed": seed}, row.metrics) for seed in range(row.seeds)]
    return cases


def _contenders(row: Row) -> dict[str, tuple[str | Method | Peer, Method | Peer]]:
    """Return the methods of a row as they were given, and themselves, by name."""
    found: dict[str, tuple[str | Method | Peer, Method | Peer]] = {}
    for given in row.methods:
        method = contender(given)
        name = given if isinstance(given, str) else method.name
        if found.setdefault(name, (given, method))[1] != method:
            raise InvalidInput(f"methods: expected different names, found two methods named {name!r}")
    return found


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
        "scenario": row.name,
        "seeds": row.seeds,
        "settings": dict(row.settings),
        "deterministic": same,
        "methods": {
            name: aggregate(part, same) | {"guided": is_guided(row.scenario, row.settings, given)}
            for (name, (given, _)), part in zip(_contenders(row).items(), parts, strict=True)
        },
    }


def flat(tables: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return one row for each scenario and method of the tables of `compare_all`."""
    return [
        {**{name: value for name, value in table.items() if name != "methods"}, "method": method, **row}
        for table in tables
        for method, row in table["methods"].items()
    ]
