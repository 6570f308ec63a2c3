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
def test_a_page_of_a_study_is_that_of_its_runs(study: tables.StudyPage) -> None:
    """Title, text, command and every row with kept runs. All other rows name the version that made them."""
    runs = tables.kept(study)
    files = study.files(runs)
    assert {path: path.read_text() for path in files} == files
    expected = [(tables.scenario_text(row), method) for row in study.rows for method in row.methods]
    made = {(run["scenario"], run["method"]) for run in runs}
    assert ["slalom" not in row["runs"] for row in rows_of(study)] == [key in made for key in expected]


def rows_of(study: tables.StudyPage) -> list[dict[str, str]]:
    """All rows of a study by heading, from its page or from the file of all rows beside it."""
    if study.main is not None:
        return list(csv.DictReader(study.whole.read_text().splitlines()))
    heads, *lines = [
        line[2:-2].split(" | ") for line in (ROOT / study.page).read_text().splitlines() if line[:2] == "| "
    ]
    return [dict(zip(heads, line)) for line in lines]


@pytest.mark.parametrize("study", [study for study in tables.STUDIES if study.main], ids=lambda study: study.name)
def test_a_page_with_a_chart_has_the_main_rows(study: tables.StudyPage) -> None:
    """As in the file of all rows, which it names, with every scenario and method that is a main one."""
    text = (ROOT / study.page).read_text()
    heads, *lines = [line[2:-2].split(" | ") for line in text.splitlines() if line.startswith("| ")]
    rows, (scenarios, methods) = rows_of(study), study.main
    main = [list(row.values()) for row in rows if row["scenario"] in scenarios and row["method"] in methods]
    assert heads == list(rows[0])
    assert lines == main
    assert ({line[0] for line in lines}, {line[1] for line in lines}) == (set(scenarios), set(methods))
    assert f"]({study.name}.csv)" in text
    assert f"](images/{study.chart.name})" in text
    assert study.chart.read_text().startswith("<?xml")


@pytest.mark.parametrize("study", tables.STUDIES, ids=lambda study: study.name)
def test_every_seed_of_the_kept_rows_of_a_study_was_run(study: tables.StudyPage) -> None:
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


def test_a_row_without_runs_names_its_version(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Rows with kept runs are rendered from these; a second rendering changes nothing."""
    (tmp_path / "benchmarks" / "results").mkdir(parents=True)
    (tmp_path / "benchmarks" / "small.yaml").write_text(
        "title: Small\nmethods: [nao, vo]\nseeds: 1\nscenarios: [{scenario: empty, settings: {duration: 1}}]\n"
    )
    monkeypatch.setattr(tables, "ROOT", tmp_path)
    monkeypatch.setattr(tables, "VERSIONS", tmp_path / "versions.json")
    study = tables.StudyPage("small")
    tables.make(study, tmp_path / "store", 1)
    runs = tables.kept(study)
    whole = study.written("", runs)
    assert whole.startswith(
        "# Small\n\nMade by `slalom compare benchmarks/small.yaml --page docs/small.md` with slalom "
    )
    former = re.sub(r"slalom [\d.]+", "slalom 0.0.9", whole, count=1).replace(" 0.50 ", " 0.40 ")
    part = study.written(former, [run for run in runs if run["method"] == "nao"])
    of_nao, of_vo = part.splitlines()[-2:]
    assert of_nao == whole.splitlines()[-2]
    assert of_vo.split(" | ")[3] == "1, deterministic, slalom 0.0.9"
    assert study.written(part, [run for run in runs if run["method"] == "nao"]) == part
    assert study.written(part, runs) == whole
    tables.make(study, tmp_path / "none", 1, merge=True)
    assert tables.kept(study) == []


@pytest.mark.slow
@pytest.mark.parametrize(("study", "row", "method"), [one for one in turn(STUDY_ROWS, 3) if not one.marks])
def test_two_runs_of_a_row_of_a_study_give_the_same_again(study: tables.StudyPage, row: Row, method: str) -> None:
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
    lines = (ROOT / "docs" / "fleets.csv").read_text().splitlines()[1:]
    assert sum("circle" in line for line in lines) >= 40
    for line in lines:
        assert ("deterministic" in line) == ("noise=0" in line) == ("%)" not in line), line


NOT_MEASURED = {
    ("recordings", "kind"),
    ("irsim", "setting"),
    ("theory", "bound"),
    ("view", "type"),
    ("foresight", "model"),
    ("encounters", "file"),
}
"""Tables of numbers that define something, by page and first heading."""
COMPARED = {
    "paper": "test_paper.py",
    "performance": "test_benchmarks.py",
    "fleets": "this file",
    "planners": "this file",
}
"""Pages whose tables a test compares with kept results, and its file."""
WITHOUT_VERSION = {"crossings", "foresight", "navground", "navground_tables"}
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
    """In its section, if it is not written from kept runs. A page of `slalom compare` needs no date: runs are exact."""
    for heading, section in measured_tables(page, PAGES[page].read_text()):
        if re.search(r"^Made by `slalom compare .*` with slalom \d+\.\d+\.\d+, ", section, re.M):
            continue
        assert re.search(r"`(python|slalom|make) [^`]+`|`cross\(|^    python ", section, re.M), heading
        assert re.search(r"with\s+slalom \d+\.\d+\.\d+ on\s+20\d\d-\d\d-\d\d", section), heading


def test_the_explanations_of_the_tour_are_those_of_the_present_code() -> None:
    """Else `tools/tour.py --explanations` writes them; each names an obstacle or a limit that decided."""
    text = tour.TOUR.read_text()
    assert text == tour.written(text)
    assert len(re.findall(r"^Decisive: (obstacle|limit) `", text, re.MULTILINE)) == len(tour.EXPLAINED) == 5
