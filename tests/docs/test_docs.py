"""What the documentation shows works: code blocks, examples, commands, links."""

import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pages import BLOCK, DOCS, PAGES, ROOT, blocks

from slalom.cli import DONE, app, call
from slalom.io.formats import read_recording
from slalom.sim import Recording, read_scenario


@pytest.mark.parametrize(("page", "code"), blocks("python"))
def test_python_blocks_run(page, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(code, page, "exec"), {"__name__": "__documentation__"})


SCENARIOS = [
    (page, text) for page, text in blocks("yaml") if re.match(r"(robots?|areas):", text) and "max_speed" in text
]


@pytest.mark.parametrize(("page", "text"), SCENARIOS, ids=[page for page, _ in SCENARIOS])
def test_scenarios_of_pages_are_whole_files(page, text, tmp_path):
    """With robots: blocks of YAML that a reader copies into a file."""
    assert len(SCENARIOS) > 1
    (tmp_path / "scene.yaml").write_text(text)
    assert read_scenario(tmp_path / "scene.yaml").robots


LONG_EXAMPLES = ("03_experiment.py", "07_tracked_people.py", "08_learning.py", "09_ros.py", "11_irsim.py")


def examples() -> list[Any]:
    """The examples as parameters; those that take seconds are of continuous integration."""
    return [
        pytest.param(path, id=path.name, marks=[pytest.mark.slow] if path.name in LONG_EXAMPLES else [])
        for path in sorted((ROOT / "examples").glob("*.py"))
    ]


@pytest.mark.parametrize("example", examples())
def test_examples_run(example, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(sys, "argv", [str(example)])
    code = None
    try:
        runpy.run_path(str(example), run_name="__main__")
    except SystemExit as end:  # Without packages that it needs.
        code = end.code
    assert not code
    assert capsys.readouterr().out.strip()


def test_an_example_is_a_program():
    example = ROOT / "examples" / "01_one_decision.py"
    done = subprocess.run([sys.executable, example], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


def commands() -> list[str]:
    """Every slalom command that the documentation shows."""
    shown = [*blocks(""), *blocks("console")]
    lines = [line.removeprefix("$ ") for _, text in shown for line in text.splitlines()]
    return [re.split("#|>", line)[0].strip() for line in lines if line.startswith("slalom ")]


def test_commands_are_found():
    assert len(commands()) >= 4


@pytest.mark.parametrize("command", commands())
def test_commands_parse(command):
    """Each shown command binds to its function with every argument understood."""
    bound = app.parse_args(shlex.split(command)[1:], exit_on_error=False, print_error=False)
    assert bound[0] is not None


@pytest.mark.parametrize("example", ["crossing.yaml", "mixed.yaml", "fleet.yaml", "hall.yaml"])
def test_example_scenario_runs(example, capsys):
    assert call(["run", f"sample:{example}", "--json"]) == DONE
    assert '"collisions": 0' in capsys.readouterr().out


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_links_to_files_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)", page.read_text()):
        # The site has generated pages, whose links its build checks.
        if not target.startswith(("http", "mailto", "generated/", "../generated/")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def tracked(folder: Path) -> dict[str, np.ndarray]:
    """Places [m] of three people who walk through the door of the page, by name; written in cm."""
    found, lines = {}, ["stamp,name,row,col"]
    for k, y in enumerate((2.0, 6.0, 3.0)):
        steps = np.arange(0, 101, 2) / 10
        found[f"p{k}"] = np.stack([11 - steps, 4 + (y - 4) * (5 - steps) / 5], axis=1)
        lines += [f"{t + 2 * k},p{k},{100 * at[1]},{100 * at[0]}" for t, at in zip(steps.tolist(), found[f"p{k}"])]
    (folder / "tracker.csv").write_text("\n".join(lines) + "\n")
    return found


@pytest.mark.slow
def test_a_study_in_nine_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    """From the files of the page to its table and figure."""
    page = (DOCS / "recordings.md").read_text()
    section = page.partition("## A study in nine commands\n")[2].partition("\n## ")[0]
    (walls, scenario, shown) = (text for _, text in BLOCK.findall(section))
    monkeypatch.chdir(tmp_path)
    people = tracked(tmp_path)
    Path("rooms.wkt").write_text(walls)
    Path("rooms.yaml").write_text(scenario)
    lines = shown.splitlines()
    assert len(lines) == 9
    for line in lines:
        assert call(shlex.split(line)[1:]) == DONE, f"{line}\n{capsys.readouterr().err}"
    for name, agent in read_recording("walk.csv").agents.items():
        np.testing.assert_allclose(agent.trajectory.positions, people[name], atol=1e-12)
    run = Recording.load("run.h5")
    assert [o.name for o in run.obstacles if o.at_rest] == ["wall 0", "wall 1", "wall 2"]
    assert len(read_recording("run.sqlite").walls) > 0
    rows = [row.split(" & ")[:2] for row in Path("study.tex").read_text().splitlines() if row[:1].isdigit()]
    assert rows == [[f"{m}", f"{r}"] for m in (0.05, 0.1, 0.2) for r in (0.1, 0.2, 0.3, 0.4, 0.5)]
    assert Path("study.pdf").read_bytes()[:4] == b"%PDF"
    assert "nao_ahead" in Path("methods.md").read_text()
