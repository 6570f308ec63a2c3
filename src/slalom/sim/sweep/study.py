"""Comparison of methods over scenarios and seeds in one table."""

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, product
from pathlib import Path
from typing import Annotated, Any, Final, NamedTuple

import numpy as np
from pydantic import Field, FiniteFloat, PlainValidator, TypeAdapter
from ruamel.yaml.nodes import Node

from slalom.base.checks import did_you_mean, flag, has, known, listing, mapping, number, shown, text, whole
from slalom.base.errors import InvalidFile, InvalidInput
from slalom.decision.methods import Method
from slalom.io.recorded import first_of
from slalom.io.yaml_nodes import MAX_MISTAKES, compose
from slalom.peers import CONTENDERS, Peer, contender
from slalom.sim.files.parts import Model, Place
from slalom.sim.files.scenario_yaml import read_scenarios
from slalom.sim.files.yaml_errors import dotted, in_order, messages, where
from slalom.sim.measure.metrics import METRICS, finite
from slalom.sim.sweep.case import (
    SOURCES,
    SOURCES_UNGUIDED,
    Case,
    Failure,
    Metric,
    Source,
    count_of,
    drawn,
    in_file,
    is_cases,
    is_deterministic,
    is_file,
    is_guided,
    method_content,
    metrics_content,
    refuse_more,
    run_case,
    scenario_content,
    versions,
)
from slalom.sim.sweep.pool import map_surviving_kills, working_with
from slalom.sim.sweep.store import MISSING, OTHER, Result, Shard, Store
from slalom.sim.sweep.tables import Comparison, Comparisons

PERCENTILES: Final = (50, 75, 90)
"""[%] Percentiles of the extra time in a row."""


def wilson(count: int, runs: int) -> list[float] | None:
    """Return the 95 % confidence interval of a share, observed in `count` of `runs` (Wilson, JASA 22, 1927).

    None for no runs.
    """
    if runs == 0:
        return None
    z, share = 1.96, count / runs
    middle, scale = share + z * z / (2 * runs), 1.0 + z * z / runs
    half = z * float(np.sqrt(share * (1.0 - share) / runs + z * z / (4 * runs * runs)))
    return [max(0.0, (middle - half) / scale), min(1.0, (middle + half) / scale)]


def mean_interval(values: Sequence[float]) -> list[float] | None:
    """Return the 95 % confidence interval of a mean by Student's t; None for fewer than two values.

    The quantile of t is the expansion 26.7.5 of Abramowitz and Stegun: 0.3 % low for 4 degrees of freedom, 24 % for 1.
    """
    n = len(values)
    if n < 2:
        return None
    z, nu = 1.959964, float(n - 1)
    t = z + (z**3 + z) / (4 * nu) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * nu**2)
    t += (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * nu**3)
    mean, half = float(np.mean(values)), t * float(np.std(values, ddof=1)) / float(np.sqrt(n))
    return [mean - half, mean + half]


def aggregate(results: Sequence[Mapping[str, Any] | Failure], deterministic: bool = False) -> dict[str, Any]:
    """Return the results of seeds 0, 1, ... as one row, JSON-ready; see `study.compare`.

    Args:
        deterministic: whether all runs are the same. They then count as one distinct run, and the row has no
            confidence intervals.
    """
    rows = [row for row in results if not isinstance(row, Failure)]
    times = [row["time"] for row in rows if row["arrived"] == row["robots"]]
    # Equal runs are one: they say nothing about others.
    share, mean = (_no_interval, _no_interval) if deterministic else (wilson, mean_interval)
    good = sum(row["arrived"] == row["robots"] and not row["collisions"] for row in rows)
    extra = [seconds for row in rows for seconds in row["extra_times"] if seconds is not None]
    collided = sum(row["collisions"] > 0 for row in rows)
    clearances = [row["min_clearance"] for row in rows if row["min_clearance"] is not None]
    # Runs that were kept before their jerk was measured have none.
    jerks = [row["jerk"] for row in rows if row.get("jerk") is not None]
    outcomes: Counter[str] = Counter()
    for row in rows:
        outcomes.update(row["statuses"])
    return {
        "foresight": rows[0]["foresight"] if rows else None,
        "runs": len(rows),
        "distinct_runs": min(len(rows), 1) if deterministic else len(rows),
        "runs_with_collision": collided,
        "runs_with_collision_interval": share(collided, len(rows)),
        "runs_all_arrived": len(times),
        "runs_all_arrived_interval": share(len(times), len(rows)),
        "runs_successful": good,
        "runs_successful_interval": share(good, len(rows)),
        "adjustments": float(np.mean([row["adjustments"] for row in rows])) if rows else None,
        "jerk": float(np.mean(jerks)) if jerks else None,
        "efficacy": float(np.mean([row["efficacy"] for row in rows])) if rows else None,
        "time": finite(float(np.mean(times))) if times else None,
        "time_interval": mean(times),
        "extra_time": [float(x) for x in np.percentile(extra, PERCENTILES)] if extra else None,
        "min_clearance": finite(min(clearances, default=np.inf)),
        "outcomes": dict(sorted(outcomes.items())),
        "failures": _failures(results),
        **({"metrics": _metrics([row["metrics"] for row in rows], mean)} if rows and "metrics" in rows[0] else {}),
    }


def _metrics(
    rows: Sequence[Mapping[str, float | None]], interval: Callable[[Sequence[float]], list[float] | None]
) -> dict[str, Any]:
    """Return mean, confidence interval, least and greatest value of each metric over the runs in which it is finite."""
    found = {name: [value for row in rows if (value := row[name]) is not None] for name in rows[0]}
    return {
        name: {
            "mean": float(np.mean(values)) if values else None,
            "interval": interval(values),
            "range": [min(values), max(values)] if values else None,
        }
        for name, values in found.items()
    }


def _no_interval(*_: Any) -> None:
    """Return the interval of equal runs: none."""


def _failures(results: Sequence[Mapping[str, Any] | Failure]) -> list[dict[str, Any]]:
    """Return the reasons of runs without a result, each with its seeds."""
    seeds: dict[Failure, list[int]] = {}
    for seed, result in enumerate(results):
        if isinstance(result, Failure):
            seeds.setdefault(result, []).append(seed)
    return [{**failure._asdict(), "seeds": which} for failure, which in seeds.items()]


METHODS: Final = ("vo", "nlvo", "avo", "ao", "nao")
"""Methods of a row that names none."""
SEEDS: Final = 100
"""[1] Seeds of a row that gives no number; `named` takes all cases of a file that has fewer."""


class Row(NamedTuple):
    """A scenario with settings, and the methods to compare on seeds 0, 1, ...

    For a file of cases, the seeds are the first cases. Scenario and methods are names or objects, metrics names or
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
) -> Comparison:
    """Compare methods on the same `seeds` scenarios (seeds 0, 1, ...), see `compare_all`.

    Args:
        name: of the gallery or a file; or an `Entry` of the gallery, or a `Scenario` for every seed.
        methods: names or objects. metrics: names of `metrics.METRICS`, or functions of a recording.

    Returns:
        A dictionary with the methods `to_csv`, `to_latex` and `figure` of `Comparison`:
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
        {"metrics": {name: {"mean", "interval", "range"}}} over the runs in which the value is finite.
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
) -> Comparisons:
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
    return Comparisons(_table(row, [results[case.key] for case in made]) for row, made in zip(rows, plan))


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
    _refuse_cases(row)
    if isinstance(name, str) and in_file(name):
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


def _refuse_cases(row: Row) -> None:
    """Raise InvalidInput for more seeds than cases, InvalidFile for mistakes in any case of a scenario file."""
    count = count_of(row.scenario)
    if count is not None:
        refuse_more(row.name, count, row.seeds)
        for scenario in read_scenarios(row.name) if is_file(row.name) else ():
            scenario.with_settings(row.settings)


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


def _table(row: Row, results: Sequence[Result]) -> Comparison:
    """Return the table of `compare` from the results of the cases of the row."""
    same = is_deterministic(row.scenario, row.settings)
    parts = [results[first : first + row.seeds] for first in range(0, len(results), row.seeds)]
    methods = {
        name: aggregate(part, same) | {"guided": is_guided(row.scenario, row.settings, given)}
        for (name, (given, _)), part in zip(_contenders(row).items(), parts, strict=True)
    }
    settings = dict(row.settings)
    return Comparison(scenario=row.name, seeds=row.seeds, settings=settings, deterministic=same, methods=methods)


def flat(tables: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return one row for each scenario and method of the tables of `compare_all`."""
    return [
        {**{name: value for name, value in table.items() if name != "methods"}, "method": method, **row}
        for table in tables
        for method, row in table["methods"].items()
    ]


def grid(settings: Mapping[str, float | Sequence[float]]) -> list[dict[str, float]]:
    """Return the settings of a study: all combinations of the values, where the last name varies fastest.

    Args:
        settings: a number, or a list of numbers, by name.

    Raises:
        InvalidInput: something else than numbers, or an empty list.
    """
    values: list[list[float]] = []
    for name, given in settings.items():
        each = [given] if isinstance(given, int | float) else given
        listing(each, "a number, or a list of numbers", name)
        if not len(each):
            raise InvalidInput(f"{name}: expected at least one number, found none")
        values.append([number(one, name) for one in each])
    return [dict(zip(settings, each)) for each in product(*values)]


def _number_or_numbers(content: object) -> Any:
    """Return a number or a list of numbers. Raises the errors of pydantic, which collects them with the others."""
    kind: Any = list[FiniteFloat] if isinstance(content, list) else FiniteFloat
    return TypeAdapter(kind).validate_python(content)


NumberOrNumbers = Annotated[FiniteFloat | list[FiniteFloat], PlainValidator(_number_or_numbers)]


class ScenarioRowSpec(Model):
    """A scenario by a name of the gallery or a file, with settings; perhaps methods and seeds of its own.

    Lists of values stand for a row of each combination, see `grid`. The path of a .yaml file is relative to the study,
    that of a .csv file of test cases to the study or the data folder.
    """

    scenario: str
    settings: dict[str, NumberOrNumbers] = Field(default_factory=dict)
    methods: list[str] | None = Field(default=None, min_length=1)
    seeds: int | None = Field(default=None, ge=1)


class StudySpec(Model):
    """A study file. Its methods and seeds apply to scenarios that give none."""

    title: str = ""
    text: str = ""
    methods: list[str] = Field(default_factory=lambda: list(METHODS), min_length=1)
    seeds: int = Field(default=SEEDS, ge=1)
    metrics: list[str] = Field(default_factory=list)
    scenarios: list[ScenarioRowSpec] = Field(min_length=1)


class Study(NamedTuple):
    """The content of a study file: title and text for the page, and rows.

    `left_out` has the rows whose file of test cases does not exist, by its name in the study.
    """

    title: str
    text: str
    rows: list[Row]
    left_out: tuple[Row, ...] = ()

    @property
    def missing(self) -> list[str]:
        """The missing files of test cases, each once."""
        return list(dict.fromkeys(row.name for row in self.left_out))


def is_study(name: str) -> bool:
    """Return whether a name is that of a YAML file with `scenarios`. Raises InvalidFile if it is not YAML."""
    content = compose(Path(name))[1] if is_file(name) else None
    return isinstance(content, dict) and "scenarios" in content


def read_study(path: Path | str, data: Path | str | None = None) -> Study:
    """Return the study of a YAML file.

    Args:
        data: folder of the files of test cases; by default that of the study.

    Raises:
        InvalidFile: one line `file:line:column: KEY: expected ..., found ...` for each mistake; an unknown scenario,
            setting or method is one too. InvalidInput: no such folder of data.
    """
    path = Path(path)
    cases = path.parent if data is None else Path(data)
    if data is not None and not os.path.isdir(cases):
        raise InvalidInput(f"data: expected a folder, found none at {str(data)!r}")
    root, content = compose(path)
    if wrong := messages(path, root, content, StudySpec):
        raise InvalidFile(first_of(path, in_order(path, wrong), MAX_MISTAKES))
    spec = StudySpec.model_validate(content)
    rows: list[Row] = []
    left_out: list[Row] = []
    mistakes: list[str] = []
    for k, one in enumerate(spec.scenarios):
        name, folder = one.scenario, cases if is_cases(one.scenario) else path.parent
        there = not is_cases(name) or os.path.exists(folder / name)
        place = str(folder / name) if there and in_file(name) else name
        try:
            combined = grid(one.settings)
        except InvalidInput as error:
            here: Place = ("scenarios", k, "settings")
            mistakes.append(f"{where(path, root, here)}: {dotted(here)}{error}")
            continue
        for settings in combined:
            row = Row(place, settings, one.methods or spec.methods, one.seeds or spec.seeds, tuple(spec.metrics))
            (rows if there else left_out).append(row)
            mistakes += _unfit(path, root, k, row) if there else []
    mistakes += _unknown(path, root, ("methods",), spec.methods)
    for k, name in enumerate(spec.metrics):
        if name not in METRICS:
            at = ("metrics", k)
            expected = ", ".join(METRICS)
            hint = did_you_mean(name, list(METRICS))
            mistakes.append(f"{where(path, root, at)}: {dotted(at)}expected one of {expected}; found {name!r}{hint}")
    for k, one in enumerate(spec.scenarios):
        mistakes += _unknown(path, root, ("scenarios", k, "methods"), one.methods or ())
    if mistakes:
        raise InvalidFile(first_of(path, in_order(path, list(dict.fromkeys(mistakes))), MAX_MISTAKES))
    return Study(spec.title, spec.text, rows, tuple(left_out))


def named(
    names: Sequence[str],
    *,
    settings: Mapping[str, float | Sequence[float]] | None = None,
    methods: Sequence[str] | None = None,
    seeds: int | None = None,
    metrics: Sequence[str] | None = None,
    only: Sequence[str] | None = None,
    data: Path | str | None = None,
) -> Study:
    """Return the studies and scenarios of these names as one study; a single study keeps its title and text.

    Settings are added to those of every row, lists of values as in `grid`; methods, seeds and metrics replace those of
    every row.

    Args:
        only: scenarios whose rows are kept; a file of test cases by its name without the folder.
        data: see `read_study`.

    Raises:
        InvalidInput: no names, or no row with an existing file; a scenario in `only` that no row has; no such folder of
            data. InvalidFile: mistakes in a study.
    """
    combined = grid(settings or {})
    studies = [
        _crossed(read_study(name, data), combined)
        if is_study(name)
        else Study("", "", [_of_name(name, each) for each in combined])
        for name in names
    ]
    if data is not None and not any(is_study(name) for name in names):
        raise InvalidInput(f"data: expected only with a study file, found it with {', '.join(names)}")
    every = [row for study in studies for row in (*study.rows, *study.left_out)]
    if not every:
        raise InvalidInput("scenario: expected at least one, or a study file, found none")
    for name in only or ():
        known(name, "only", list(dict.fromkeys(_called(row) for row in every)))

    def changed(rows: Iterable[Row]) -> list[Row]:
        return [
            Row(
                row.scenario,
                row.settings,
                row.methods if methods is None else methods,
                row.seeds if seeds is None else seeds,
                row.metrics if metrics is None else metrics,
            )
            for row in rows
            if not only or _called(row) in only
        ]

    rows = changed(row for study in studies for row in study.rows)
    left_out = changed(row for study in studies for row in study.left_out)
    title, text = (studies[0].title, studies[0].text) if len(studies) == 1 else ("", "")
    study = Study(title, text, rows, tuple(left_out))
    if not rows:
        missing = ", ".join(study.missing)
        raise InvalidInput(f"data: expected the folder of {missing}; found no such file, and nothing else to run")
    return study


def _crossed(study: Study, combined: Sequence[Mapping[str, float]]) -> Study:
    """Return a study with each of its rows once for each of these settings, which are added to its own."""
    rows, left_out = (
        [row._replace(settings={**row.settings, **each}) for row in some for each in combined]
        for some in (study.rows, study.left_out)
    )
    return study._replace(rows=rows, left_out=tuple(left_out))


def _of_name(name: str, settings: Mapping[str, float]) -> Row:
    """Return the row of a scenario by name: one seed if it is deterministic, else SEEDS or all cases of a file."""
    seeds = 1 if is_deterministic(name, settings) else min(SEEDS, count_of(name) or SEEDS)
    return Row(name, settings, seeds=seeds)


def _called(row: Row) -> str:
    """Return the name of the scenario of a row in `only`."""
    return Path(row.name).name if is_cases(row.name) else row.name


def _unfit(path: Path, root: Node | None, k: int, row: Row) -> list[str]:
    """Return the mistakes in the scenario of a row, in its settings and in its number of cases."""
    try:
        drawn(row.scenario, row.settings)
        _refuse_cases(row)
    except InvalidFile as error:
        return error.mistakes
    except InvalidInput as error:
        key, _, text = str(error).partition(": ")
        named_at = key in ("scenario", "seeds")
        place = ("scenarios", k, key if named_at else "settings")
        return [f"{where(path, root, place)}: {dotted(place)}{text if named_at else error}"]
    return []


def _unknown(path: Path, root: Node | None, place: Place, names: Sequence[str]) -> list[str]:
    """Return a mistake for each unknown method. Missing packages are reported when the methods run."""
    mistakes = []
    for k, name in enumerate(names):
        try:
            contender(name, installed=False)
        except InvalidInput as error:
            at = (*place, k)
            mistakes.append(f"{where(path, root, at)}: {dotted(at)}{str(error).removeprefix('method: ')}")
    return mistakes
