"""What the documentation shows works: code blocks, examples, commands, links."""

import re
import runpy
import shlex
import subprocess
import sys
from typing import Any

import pytest
from pages import PAGES, ROOT, blocks

from slalom.cli import DONE, app, call
from slalom.sim import read_scenario


@pytest.mark.parametrize(("page", "code"), blocks("python"))
def test_python_blocks_run(page, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(code, page, "exec"), {"__name__": "__documentation__"})


SCENARIOS = [(page, text) for page, text in blocks("yaml") if re.match(r"robots?:", text) and "max_speed" in text]


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
