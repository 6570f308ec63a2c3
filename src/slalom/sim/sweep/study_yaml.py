"""Reader of study files: YAML with scenarios, settings and methods for one comparison."""

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from pydantic import Field, FiniteFloat
from ruamel.yaml.nodes import Node

from slalom.checks import did_you_mean, known
from slalom.errors import InvalidFile, InvalidInput
from slalom.io.cadrl import read_cases
from slalom.io.recorded import first_of
from slalom.peers import contender_named
from slalom.sim.files.schema_base import Model, Place
from slalom.sim.files.yaml_errors import MAX_MISTAKES, compose, dotted, in_order, messages, where
from slalom.sim.measure.metrics import METRICS
from slalom.sim.sweep.case import drawn, is_file
from slalom.sim.sweep.case_file import is_cases, refuse_more
from slalom.sim.sweep.study import METHODS, SEEDS, Row


class ScenarioRowSpec(Model):
    """A scenario by a name of the gallery or a file, with settings; perhaps methods and seeds of its own.

    The path of a .yaml file is relative to the study, that of a .csv file of test cases to the study or the data
    folder.
    """

    scenario: str
    settings: dict[str, FiniteFloat] = Field(default_factory=dict)
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
        place = str(folder / name) if there and (is_file(name) or is_cases(name)) else name
        row = Row(place, one.settings, one.methods or spec.methods, one.seeds or spec.seeds, tuple(spec.metrics))
        (rows if there else left_out).append(row)
        mistakes += _unfit(path, root, k, row) if there else []
    mistakes += _unknown(path, root, ("methods",), spec.methods)
    for k, name in enumerate(spec.metrics):
        if name not in METRICS:
            at, expected, hint = ("metrics", k), ", ".join(METRICS), did_you_mean(name, list(METRICS))
            mistakes.append(f"{where(path, root, at)}: {dotted(at)}expected one of {expected}; found {name!r}{hint}")
    for k, one in enumerate(spec.scenarios):
        mistakes += _unknown(path, root, ("scenarios", k, "methods"), one.methods or ())
    if mistakes:
        raise InvalidFile(first_of(path, in_order(path, mistakes), MAX_MISTAKES))
    return Study(spec.title, spec.text, rows, tuple(left_out))


def named(
    names: Sequence[str],
    *,
    settings: Mapping[str, float] | None = None,
    methods: Sequence[str] | None = None,
    seeds: int | None = None,
    metrics: Sequence[str] | None = None,
    only: Sequence[str] | None = None,
    data: Path | str | None = None,
) -> Study:
    """Return the studies and scenarios of these names as one study; a single study keeps its title and text.

    Settings are added to those of every row; methods, seeds and metrics replace those of every row.

    Args:
        only: scenarios whose rows are kept; a file of test cases by its name without the folder.
        data: see `read_study`.

    Raises:
        InvalidInput: no names, or no row with an existing file; a scenario in `only` that no row has; no such folder of
            data. InvalidFile: mistakes in a study.
    """
    studies = [read_study(name, data) if is_study(name) else Study("", "", [Row(name)]) for name in names]
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
                {**row.settings, **(settings or {})},
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


def _called(row: Row) -> str:
    """Return the name of the scenario of a row in `only`."""
    return Path(row.name).name if is_cases(row.name) else row.name


def _unfit(path: Path, root: Node | None, k: int, row: Row) -> list[str]:
    """Return the mistakes in the scenario of a row, in its settings and in its number of cases."""
    try:
        drawn(row.scenario, row.settings)
        if is_cases(row.name):
            refuse_more(row.name, read_cases(row.name), row.seeds)
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
            contender_named(name)
        except InvalidInput as error:
            at = (*place, k)
            mistakes.append(f"{where(path, root, at)}: {dotted(at)}{str(error).removeprefix('method: ')}")
    return mistakes
