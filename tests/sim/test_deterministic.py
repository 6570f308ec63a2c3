"""Scenarios without randomness: the runs of all seeds are one run, and tables say so."""

import json
import re
from pathlib import Path

import pytest
from galleries import NAMES

from slalom.cli import call
from slalom.cli.report import table_text
from slalom.io.table import sample_data
from slalom.peers import contender
from slalom.sim import Row, compare_all, simulate
from slalom.sim.sweep.case import drawn, is_deterministic
from slalom.sim.sweep.study import named

RANDOM = {"sight_noise": 0.01, "sight_loss": 0.1}


@pytest.mark.parametrize("name", NAMES)
def test_deterministic_is_what_gives_equal_runs(name: str) -> None:
    """Two seeds move the robots the same exactly if the scenario says so; the first task comes after seconds."""
    settings = {"duration": {"warehouse": 8.0}.get(name, 0.4)} | (
        {"robots": 4.0} if "robots" in drawn(name).parameters else {}
    )
    runs = [simulate(drawn(name, settings, seed=seed), contender("ao"), seed=0) for seed in (0, 1)]
    obstacles = [
        [o.trajectory.path(run.times[0], run.times[-1]).points.tolist() for o in run.obstacles] for run in runs
    ]
    same = runs[0].digest() == runs[1].digest() and obstacles[0] == obstacles[1]
    assert is_deterministic(name, settings) == same


def test_random_errors_and_files() -> None:
    """Errors of sensing differ by seed; a scenario file has no seed."""
    assert is_deterministic("head_on")
    for name, value in RANDOM.items():
        assert not is_deterministic("head_on", {name: value}), name
    assert is_deterministic("head_on", {"sight_delay": 0.1})
    assert is_deterministic("circle", {"noise": 0.0})
    assert is_deterministic(str(sample_data("crossing.yaml")))


def test_tables_count_one_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without intervals: twenty equal runs say no more than one."""
    page = tmp_path / "page.md"
    tokens = ["compare", "head_on", "circle", "--set", "duration=0.3", "--methods", "nao", "--seeds", "3"]
    assert call([*tokens, "--page", str(page)]) == 0
    text = capsys.readouterr().out
    assert "head_on duration=0.3, deterministic: 1 run\n" in text
    assert "circle duration=0.3, 3 seeds\n" in text
    rows = [line for line in page.read_text().splitlines() if line.startswith(("| head_on", "| circle"))]
    assert "| recorded | 1, deterministic | no | 0 | 0 | 0 |" in rows[0]
    assert "| 3 | yes | 0 (0-56 %) |" in rows[1]
    assert call([*tokens, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["rows"]
    assert [(row["deterministic"], row["runs"], row["distinct_runs"]) for row in found] == [(True, 3, 1), (False, 3, 3)]
    assert found[0]["runs_with_collision_interval"] is None
    assert found[1]["runs_with_collision_interval"] is not None


def test_one_run_of_a_deterministic_file_is_made(capsys: pytest.CaptureFixture[str]) -> None:
    """Without a number of seeds; a random scenario has 100."""
    file = str(sample_data("crossing.yaml"))
    assert call(["compare", file, "--set", "duration=0.3", "--methods", "nao", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["seeds"], found["methods"]["nao"]["runs"]) == (1, 1)
    seeds = [row.seeds for row in named([file, "circle", str(sample_data("imazu.yaml"))]).rows]
    assert seeds == [1, 100, 22]


def test_every_row_counts_alone() -> None:
    """A run that collides counts once, not once for each seed."""
    wall = Row("head_on", {"duration": 6.0, "speed": 20.0}, ["vo"], 3, ["efficacy"])
    (table,) = compare_all([wall])
    row = table["methods"]["vo"]
    assert table["deterministic"]
    assert (row["runs"], row["distinct_runs"], row["runs_with_collision"]) == (3, 1, 3)
    assert {row[f"runs_{what}_interval"] for what in ("with_collision", "all_arrived", "successful")} == {None}
    assert row["time_interval"] is None
    assert row["metrics"]["efficacy"]["interval"] is None
    assert "collided" in (text := table_text(table))
    assert re.search(r"^vo +observed +no +1 +", text, re.M)
    assert re.search(r"^vo: efficacy [-0-9.]+$", text, re.M)
