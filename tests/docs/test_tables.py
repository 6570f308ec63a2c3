"""Tables of results in README and docs: they are what their kept runs give, which the present code gives again."""

import csv
import json
import os
import re
import sys
from pathlib import Path

import pytest
from draws import commit_number
from galleries import installed

from slalom.sim import Row
from slalom.sim.sweep.case import is_cases, is_file

ROOT = Path(__file__).parents[2]
PEERS = Path(os.environ.get("SLALOM_DATA", ROOT.parent / "shared" / "data")) / "peers"
sys.path.insert(0, str(ROOT / "tools"))

import tables  # noqa: E402
import tour  # noqa: E402

ROWS = [
    pytest.param(table, row, method, id=f"{tables.scenario_text(row)} {method}")
    for table in tables.TABLES
    for row in table.rows
    for method in row.methods
]


def turn(parameters: list, of: int = 1) -> list:
    """`of` parameters take their turn with each commit; the others are slow."""
    first = commit_number() * of
    now = {(first + k) % len(parameters) for k in range(of)}
    return [
        one if k in now else pytest.param(*one.values, id=one.id, marks=pytest.mark.slow)
        for k, one in enumerate(parameters)
    ]


@pytest.mark.parametrize("table", tables.TABLES, ids=lambda table: table.name)
def test_a_page_holds_the_table_of_its_runs(table: tables.Table) -> None:
    """So that no number of a table is written by hand."""
    text = (ROOT / table.page).read_text()
    assert tables.with_table(text, table, tables.rendered(table, tables.kept(table))) == text


@pytest.mark.parametrize("table", tables.TABLES, ids=lambda table: table.name)
def test_every_seed_of_every_row_was_run(table: tables.Table) -> None:
    """Once, in the order of the rows."""
    expected = [
        (tables.scenario_text(row), method, str(seed))
        for row in table.rows
        for method in row.methods
        for seed in range(row.seeds)
    ]
    assert [(run["scenario"], run["method"], run["seed"]) for run in tables.kept(table)] == expected


@pytest.mark.slow
@pytest.mark.parametrize(("table", "row", "method"), ROWS)
def test_two_runs_of_a_row_give_the_same_again(table: tables.Table, row: Row, method: str) -> None:
    """Two seeds, others with each commit."""
    installed(method)
    if is_file(row.name) and not Path(row.name).exists():
        pytest.skip(f"{row.name} is not here")
    known = {(run["scenario"], run["method"], run["seed"]): run for run in tables.kept(table)}
    seeds = sorted({2 * commit_number() % row.seeds, (2 * commit_number() + 1) % row.seeds})
    expected = [known[tables.scenario_text(row), method, str(seed)] for seed in seeds]
    assert tables.again(row, method, seeds, table.fields) == expected


KEPT = {study.name: {(run["scenario"], run["method"]) for run in tables.kept(study)} for study in tables.STUDIES}
"""Scenario and method of the rows with kept runs, by study."""
STUDY_ROWS = [
    pytest.param(study, row, method, id=f"{study.name} {tables.scenario_text(row)} {method}")
    for study in tables.STUDIES
    for row in study.rows
    for method in row.methods
    if row.settings.get("robots", 0) <= 20
    if (tables.scenario_text(row), method) in KEPT[study.name]
]


@pytest.mark.slow
@pytest.mark.parametrize("study", tables.STUDIES, ids=lambda study: study.name)
def test_a_table_of_a_study_is_that_of_its_runs(study: tables.StudyTable) -> None:
    """Every row has kept runs."""
    assert {path: path.read_text() for path in study.files(tables.kept(study))} == study.files(tables.kept(study))
    rows = list(csv.DictReader(study.whole.read_text().splitlines()))
    assert len(rows) == sum(len(row.methods) for row in study.rows) == len(KEPT[study.name])
    assert not study.has_chart or study.chart.read_text().startswith("<?xml")


@pytest.mark.parametrize("study", tables.STUDIES, ids=lambda study: study.name)
def test_every_seed_of_the_kept_rows_of_a_study_was_run(study: tables.StudyTable) -> None:
    """Once, in the order of the rows; with the versions of all packages that were used."""
    found = [(run["scenario"], run["method"], run["seed"]) for run in tables.kept(study)]
    kept_rows = {run[:2] for run in found}
    expected = [
        (tables.scenario_text(row), method, str(seed))
        for row in study.rows
        for method in row.methods
        for seed in range(row.seeds)
        if (tables.scenario_text(row), method) in kept_rows
    ]
    assert found == expected
    used = json.loads(tables.VERSIONS.read_text())[study.name]
    assert {"slalom", "numpy", "numba", "shapely", "pyrvo", "navground"} <= set(used)


@pytest.mark.slow
@pytest.mark.parametrize(("study", "row", "method"), [one for one in turn(STUDY_ROWS, 3) if not one.marks])
def test_two_runs_of_a_row_of_a_study_give_the_same_again(study: tables.StudyTable, row: Row, method: str) -> None:
    """Three rows of at most 20 robots with each commit, and two seeds of each, others with each commit."""
    installed(method)
    name = row.name
    if is_cases(name):
        if not (PEERS / name).exists():
            pytest.skip(f"{name} is not here")
        row = row._replace(scenario=str(PEERS / name))
    known = {(run["scenario"], run["method"], run["seed"]): run for run in tables.kept(study)}
    seeds = sorted({2 * commit_number() % row.seeds, (2 * commit_number() + 1) % row.seeds})
    expected = [known[tables.scenario_text(row), method, str(seed)] for seed in seeds]
    # A file that was kept before a column was added does not have it.
    assert tables.again(row, method, seeds, tuple(expected[0])) == expected


def test_deterministic_rows_of_a_study_have_no_intervals() -> None:
    """Without intervals where there is one distinct run, with them elsewhere."""
    lines = tables.STUDIES[0].whole.read_text().splitlines()[1:]
    assert sum("circle" in line for line in lines) >= 40
    for line in lines:
        assert ("deterministic" in line) == ("noise=0" in line) == ("%)" not in line), line


NOT_MEASURED = {
    ("recordings", "kind"),
    ("irsim", "setting"),
    ("theory", "bound"),
    ("view", "type"),
    ("foresight", "model"),
}
"""Tables of numbers that define something, by page and first heading."""
COMPARED = {
    "paper": "test_paper.py",
    "performance": "test_benchmarks.py",
}
"""Pages whose tables a test compares with kept results, and its file."""
WITHOUT_VERSION = {"crossings", "foresight", "navground"}
"""Pages that state the command of a table, or where its runs are, and not the version."""


def measured_tables(page: str, text: str) -> list[tuple[str, str]]:
    """First heading of each table of numbers, and the section that holds it."""
    found = []
    for section in re.split(r"(?m)^(?=#{1,4} )", text):
        for table in re.finditer(r"(?m)^\| *([^|]*?) *\|.*\n\|[-|]+\|\n((?:\|.*\n?)+)", section):
            cells = [cell.strip() for line in table[2].splitlines() for cell in line.strip("|").split("|")[1:]]
            numbers = sum(re.match(r"[-+]?[\d*(].*", cell) is not None for cell in cells)
            marked = "written by tools/tables.py" in section[: table.start()][-100:]
            if numbers >= 0.4 * len(cells) and not marked and (page, table[1]) not in NOT_MEASURED:
                found.append((table[1], section))
    return found


PAGES = {path.stem: path for path in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]}


@pytest.mark.parametrize("page", sorted(PAGES.keys() - COMPARED.keys() - WITHOUT_VERSION))
def test_a_measured_table_states_its_command_version_and_date(page: str) -> None:
    """In its section, if it is not written from kept runs."""
    for heading, section in measured_tables(page, PAGES[page].read_text()):
        assert re.search(r"`(python|slalom|make) [^`]+`|`cross\(|^    python ", section, re.M), heading
        assert re.search(r"with\s+slalom \d+\.\d+\.\d+ on\s+20\d\d-\d\d-\d\d", section), heading


def test_the_explanations_of_the_tour_are_those_of_the_present_code() -> None:
    """Else `tools/tour.py --explanations` writes them; each names an obstacle or a limit that decided."""
    text = tour.TOUR.read_text()
    assert text == tour.written(text)
    assert len(re.findall(r"^Decisive: (obstacle|limit) `", text, re.MULTILINE)) == len(tour.EXPLAINED) == 5
