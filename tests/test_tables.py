"""Tables of results in README and docs: they are what their kept runs give, which the present code gives again."""

import re
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from draws import commit_number
from galleries import installed

from slalom.sim import Row
from slalom.sim.sweep.case import run_one

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tools"))

import tables  # noqa: E402

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


@pytest.mark.parametrize(("table", "row", "method"), turn(ROWS))
def test_two_runs_of_a_row_give_the_same_again(table: tables.Table, row: Row, method: str) -> None:
    """Two seeds, others with each commit."""
    installed(method)
    known = {(run["scenario"], run["method"], run["seed"]): run for run in tables.kept(table)}
    for seed in {2 * commit_number() % row.seeds, (2 * commit_number() + 1) % row.seeds}:
        assert tables.again(row, method, seed) == known[tables.scenario_text(row), method, str(seed)]


def test_a_page_without_a_place_is_refused() -> None:
    table = tables.TABLES[0]
    with pytest.raises(ValueError, match=r"^README.md: expected the comments '<!-- begin of the table "):
        tables.with_table("# A page\n", table, "| a |")


class Claim(NamedTuple):
    """A row of docs/fleets.md."""

    scenario: str
    settings: dict[str, float]
    method: str
    runs: int
    collided: int
    arrived: int
    clearance: float
    deterministic: bool
    last: str

    def refused_by(self, result: dict) -> list[str]:
        """What of the row cannot be true, if this is the result of one of its runs."""
        collides, arrives = result["collisions"] > 0, result["arrived"] == result["robots"]
        return [
            name
            for name, wrong in {
                "collided": self.collided in (0, self.runs) and collides != (self.collided > 0),
                "arrived": self.arrived in (0, self.runs) and arrives != (self.arrived > 0),
                "clearance": result["min_clearance"] < self.clearance - 0.00051,
                # One distinct run is what its row says.
                "same": self.deterministic
                and (f"{result['min_clearance']:.3f}", f"{result['time']:.1f}") != (f"{self.clearance:.3f}", self.last),
            }.items()
            if wrong
        ]


def claims() -> list[Claim]:
    """The rows of docs/fleets.md without test cases of other projects and without fleets that take minutes."""
    found = []
    for line in (ROOT / "docs" / "fleets.md").read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        name, _, words = cells[0].partition(" ")
        if len(cells) != 11 or not re.fullmatch(r"[a-z_]+", name) or name == "scenario" or cells[3] == "-":
            continue
        settings = {key: float(value) for key, value in (word.split("=") for word in words.split(", ") if word)}
        runs, collided, arrived = (int(re.match(r"\d+", cells[k])[0]) for k in (3, 4, 5))
        if settings.get("robots", 20) <= 20:
            alone = "deterministic" in cells[3]
            found.append(Claim(name, settings, cells[1], runs, collided, arrived, float(cells[10]), alone, cells[7]))
    return found


CLAIMS = [
    pytest.param(one, id=" ".join([one.scenario, *(f"{k}={v:g}" for k, v in one.settings.items()), one.method]))
    for one in claims()
]


def test_rows_of_fleets_are_found() -> None:
    """Without intervals where there is one distinct run, with them elsewhere."""
    assert len(CLAIMS) >= 60
    for line in (ROOT / "docs" / "fleets.md").read_text().splitlines():
        if line.startswith("| circle"):
            assert ("deterministic" in line) == ("noise=0" in line) == ("%)" not in line), line


def test_a_row_that_is_wrong_is_refuted() -> None:
    """By a run that collides, that does not arrive, that comes closer, or that is not the only one."""
    row = Claim("circle", {}, "nao", 20, 0, 20, 0.1, False, "9.0")
    run = {"collisions": 0, "arrived": 4, "robots": 4, "min_clearance": 0.1, "time": 9.0}
    assert row.refused_by(run) == row._replace(deterministic=True).refused_by(run) == []
    assert row.refused_by(run | {"collisions": 1}) == ["collided"]
    assert row.refused_by(run | {"arrived": 3}) == ["arrived"]
    assert row.refused_by(run | {"min_clearance": 0.09}) == ["clearance"]
    assert row._replace(deterministic=True).refused_by(run | {"time": 9.1}) == ["same"]
    assert row._replace(collided=7).refused_by(run) == []


@pytest.mark.slow
@pytest.mark.parametrize("claim", [one for one in turn(CLAIMS, 3) if not one.marks])
def test_a_run_does_not_refute_its_row(claim: Claim) -> None:
    """Three rows of docs/fleets.md with each commit, whose runs are not kept: one seed of each."""
    installed(claim.method)
    found = run_one(claim.scenario, claim.settings, claim.method, commit_number() % claim.runs)
    assert not claim.refused_by(found), found
