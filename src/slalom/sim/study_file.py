"""Study files: YAML that lists scenarios with their settings and methods, to be compared with one command."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from pydantic import Field, FiniteFloat, ValidationError
from ruamel.yaml.nodes import Node

from slalom.checks import known
from slalom.errors import InvalidFile, InvalidInput
from slalom.peers import contender_named
from slalom.sim.case import is_file, load
from slalom.sim.file_mistakes import compose, dotted, message, where
from slalom.sim.file_model import Model
from slalom.sim.study import METHODS, SEEDS, Row


class ScenarioRowSpec(Model):
    """A scenario, by a name of the gallery or a .yaml file beside the study, with settings; methods of its own."""

    scenario: str
    settings: dict[str, FiniteFloat] = Field(default_factory=dict)
    methods: list[str] | None = Field(default=None, min_length=1)
    seeds: int | None = Field(default=None, ge=1)


class StudySpec(Model):
    """A study file; methods and seeds are those of the scenarios that name none."""

    title: str = ""
    text: str = ""
    methods: list[str] = Field(default_factory=lambda: list(METHODS), min_length=1)
    seeds: int = Field(default=SEEDS, ge=1)
    scenarios: list[ScenarioRowSpec] = Field(min_length=1)


class Study(NamedTuple):
    """What a study file says: its title and text for the page, and its rows."""

    title: str
    text: str
    rows: list[Row]


def is_study(name: str) -> bool:
    """Whether a name is that of a YAML file that lists `scenarios`. Raises InvalidFile if it is not YAML."""
    content = compose(Path(name))[1] if is_file(name) else None
    return isinstance(content, dict) and "scenarios" in content


def read_study(path: Path | str) -> Study:
    """The study of a YAML file.

    Raises:
        InvalidFile: with one `file:line:column: expected, found` for every mistake; an unknown scenario, setting or
            method is one too.
    """
    path = Path(path)
    root, content = compose(path)
    try:
        spec = StudySpec.model_validate(content)
    except ValidationError as error:
        raise InvalidFile([message(path, root, dict(mistake), _keys_at) for mistake in error.errors()]) from None
    rows = [
        Row(
            str(path.parent / one.scenario) if is_file(one.scenario) else one.scenario,
            one.settings,
            one.methods or spec.methods,
            one.seeds or spec.seeds,
        )
        for one in spec.scenarios
    ]
    mistakes = [mistake for k, row in enumerate(rows) for mistake in _unfit(path, root, k, row)]
    mistakes += _unknown(path, root, ("methods",), spec.methods)
    for k, one in enumerate(spec.scenarios):
        mistakes += _unknown(path, root, ("scenarios", k, "methods"), one.methods or ())
    if mistakes:
        raise InvalidFile(mistakes)
    return Study(spec.title, spec.text, rows)


def named(
    names: Sequence[str],
    *,
    settings: Mapping[str, float] | None = None,
    methods: Sequence[str] | None = None,
    seeds: int | None = None,
    only: Sequence[str] | None = None,
) -> Study:
    """The studies and scenarios of those names as one study; title and text are those of a study that is alone.

    Settings are added to those of every row, methods and seeds stand in for theirs.

    Args:
        only: leave out all rows but those of these scenarios.

    Raises:
        InvalidInput: nothing is named; `only` names a scenario that no row has. InvalidFile: mistakes in a study.
    """
    studies = [read_study(name) if is_study(name) else Study("", "", [Row(name)]) for name in names]
    rows = [row for study in studies for row in study.rows]
    have = list(dict.fromkeys(row.scenario for row in rows))
    if not rows:
        raise InvalidInput("scenario: expected at least one, or a study file, found none")
    for name in only or ():
        known(name, "only", have)
    rows = [
        Row(
            row.scenario,
            {**row.settings, **(settings or {})},
            row.methods if methods is None else methods,
            row.seeds if seeds is None else seeds,
        )
        for row in rows
        if not only or row.scenario in only
    ]
    title, text = (studies[0].title, studies[0].text) if len(studies) == 1 else ("", "")
    return Study(title, text, rows)


def _unfit(path: Path, root: Node | None, k: int, row: Row) -> list[str]:
    """What is wrong with the scenario of a row or with its settings."""
    try:
        load(row.scenario, row.settings)
    except InvalidFile as error:
        return error.mistakes
    except InvalidInput as error:
        place = ("scenarios", k, "scenario" if str(error).startswith("scenario: ") else "settings")
        return [f"{where(path, root, place)}: {dotted(place)}{str(error).removeprefix('scenario: ')}"]
    return []


def _unknown(path: Path, root: Node | None, place: tuple[str | int, ...], names: Sequence[str]) -> list[str]:
    """The methods among the names that there are not. Whether their packages are installed is asked when they run."""
    mistakes = []
    for k, name in enumerate(names):
        try:
            contender_named(name)
        except InvalidInput as error:
            at = (*place, k)
            mistakes.append(f"{where(path, root, at)}: {dotted(at)}{str(error).removeprefix('method: ')}")
    return mistakes


def _keys_at(place: tuple[str | int, ...]) -> list[str]:
    """The keys that the model at `place` knows."""
    return list((ScenarioRowSpec if "scenarios" in place else StudySpec).model_fields)
