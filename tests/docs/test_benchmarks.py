"""Every benchmark program runs, and the page is rendered from what they write; what they measure is not asserted."""

import csv
import json
import subprocess
import sys
from importlib.util import find_spec
from itertools import groupby
from pathlib import Path

import pytest

import slalom
from slalom.sim import read_study

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "benchmarks"
sys.path.insert(0, str(FOLDER))
sys.path.insert(0, str(ROOT / "tools"))

import best_settings  # noqa: E402
import tables  # noqa: E402

QUICK = {
    "start": ["--quick"],
    "sampling": ["--quick"],
    "mpc": ["--quick"],
    "stages": ["--quick"],
    "decision": ["--scenes", "2"],
    "walls": ["--scenes", "1"],
    "scaling": ["--quick"],
    "fleet_step": ["--quick"],
    "boundaries": ["--quick"],
    "memory": ["--quick"],
}
OLDER = ("decision", "walls")
"""Without targets and with one table that has no title."""
NEEDS = {"mpc": ("casadi",), "fleet_step": ("pyrvo", "navground")}
AVAILABLE = [name for name in QUICK if all(find_spec(package) for package in NEEDS.get(name, ()))]


def called(*arguments: object) -> subprocess.CompletedProcess[str]:
    """A Python program run as `make bench` does."""
    command = [sys.executable, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    """What all programs wrote whose packages are installed."""
    out = tmp_path_factory.mktemp("results")
    for name in AVAILABLE:
        done = called(FOLDER / f"{name}.py", *QUICK[name], "--out", out)
        assert done.returncode == 0, done.stderr
        assert "written:" in done.stdout
    return out


def test_make_bench_runs_every_program_and_the_tests_know_them() -> None:
    lines = (ROOT / "Makefile").read_text().splitlines()
    listed = next(line for line in lines if line.startswith("PROGRAMS")).partition(":=")[2].split()
    assert set(listed) == set(QUICK)


@pytest.mark.draw(3)
@pytest.mark.parametrize("name", AVAILABLE)
def test_results_hold_what_the_report_needs(results: Path, name: str) -> None:
    result = json.loads((results / f"{name}.json").read_text())
    assert result["question"]
    assert result["finished"]
    assert result["loop_ms"] > 0.0
    assert {"processor", "cores", "python", "slalom", "numpy"} <= set(result["machine"])
    if name in OLDER:
        assert result["rows"]
        return
    assert result["quick"]
    assert result["parameters"]
    assert set(result["packages"]) == set(NEEDS.get(name, ())) | ({"shapely"} if name == "boundaries" else set())
    assert result["results"]
    for one in result["tables"]:
        assert one["rows"]
        assert all(len(row) == len(one["heads"]) for row in one["rows"]), one["title"]
    for one in result["targets"]:
        assert isinstance(one["met"], bool)
        assert one["value"] is not None or not one["met"]


@pytest.mark.draw(3)
def test_slalom_is_never_farther_from_the_preferred_control_than_a_free_sample(results: Path) -> None:
    result = json.loads((results / "sampling.json").read_text())
    for one in result["results"].values():
        assert one["quality"]["scenes"] > 0
        assert one["quality"]["worse"] == 0


@pytest.mark.draw(3)
def test_the_page_is_rendered(results: Path, tmp_path: Path) -> None:
    done = called(FOLDER / "report.py", "--results", results, "--docs", tmp_path)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "performance.md").read_text()
    targets = [one for path in results.glob("*.json") for one in json.loads(path.read_text()).get("targets", [])]
    met = sum(one["met"] for one in targets)
    assert f"{met} of {len(targets)} targets are met." in text
    assert text.count("**missed**") == len(targets) - met
    assert "quick runs" in text
    for name in AVAILABLE:
        assert f"## {name}: " in text
    pictures = sorted(path.name for path in (tmp_path / "images").glob("*.png"))
    # Of these a table says it all, or the picture of another has them.
    assert len(pictures) == len(set(AVAILABLE) - set(OLDER) - {"mpc", "start"})
    assert all(f"(images/{name})" in text for name in pictures)


def test_a_report_without_results_says_what_to_do(tmp_path: Path) -> None:
    done = called(FOLDER / "report.py", "--results", tmp_path, "--docs", tmp_path)
    assert done.returncode == 1
    assert "expected results" in done.stderr
    assert "make bench" in done.stderr


@pytest.mark.parametrize(("name", "package", "extra"), [("mpc", "casadi", "bench"), ("fleet_step", "pyrvo", "peers")])
def test_programs_say_what_is_not_installed(name: str, package: str, extra: str) -> None:
    hidden = f"import runpy, sys; sys.modules[{package!r}] = None; sys.path.insert(0, {str(FOLDER)!r}); "
    run = f"sys.argv = ['{name}.py', '--quick']; runpy.run_path({str(FOLDER / name)!r} + '.py', run_name='__main__')"
    done = called("-c", hidden + run)
    assert done.returncode == 1
    assert package in done.stderr
    assert f"slalom[{extra}]" in done.stderr


@pytest.mark.slow
def test_the_written_page_is_that_of_the_kept_results(tmp_path: Path) -> None:
    """Of full runs of all programs with this version of slalom."""
    kept = FOLDER / "results" / "performance"
    assert {path.stem for path in kept.glob("*.json")} == set(QUICK)
    for path in kept.glob("*.json"):
        assert json.loads(path.read_text())["machine"]["slalom"] == slalom.__version__, path.name
    done = called(FOLDER / "report.py", "--results", kept, "--docs", tmp_path, "--keep", tmp_path / "kept")
    assert done.returncode == 0, done.stderr
    text = (ROOT / "docs" / "performance.md").read_text()
    assert (tmp_path / "performance.md").read_text() == text
    for path in kept.glob("*.json"):
        assert (tmp_path / "kept" / path.name).read_text() == path.read_text()
    assert "quick runs" not in text
    assert "Not run" not in text
    assert all(f"## {name}: " in text for name in QUICK)


def test_rows_of_baselines_have_the_settings_that_were_found() -> None:
    """In the study of planners and in the table of README, with the scenario and guidance of the row."""
    best = {}
    with (FOLDER / "results" / "best_settings.csv").open(newline="") as text:
        for (scenario, method), group in groupby(
            csv.DictReader(text), key=lambda one: (one["scenario"], one["method"])
        ):
            every = list(group)
            found = [best_settings.result_of(one) for one in every]
            assert {result.runs for result in found if not result.refused} == {len(best_settings.SEEDS)}
            k = min(range(len(every)), key=lambda k: found[k].rank)
            best[scenario, method] = every[k]["settings"]
    listed = [
        (best_settings.scenario_text(name, settings), method)
        for name, settings, methods in best_settings.SCENARIOS
        for method in methods
    ]
    own = [("roundabout_crossing", method) for method in ("vo", "nlvo", "avo", "ao")]
    assert sorted(best) == sorted({*listed, *own})
    rows = [*read_study(FOLDER / "planners.yaml").rows, *tables.TABLES[0].rows]
    made = {" ".join([tables.scenario_text(row), str(name)]) for row in rows for name in row.methods}
    for (scenario, method), settings in best.items():
        assert f"{scenario} {settings}" in made
        if scenario.startswith("circle") and method in best_settings.SLOW:
            for name, own in (
                ("ring", best_settings.RING),
                ("random_goals", {}),
                ("crossing_streams", best_settings.STREAMS),
            ):
                assert f"{best_settings.scenario_text(name, own)} {settings}" in made
