"""The budget of tools/budget.toml: no figure above its limit, and no limit that rises without a reason."""

import re
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import budget  # noqa: E402


def test_the_project_is_within_its_budget() -> None:
    assert list(budget.breaches(tomllib.loads(budget.FILE.read_text()), budget.figures())) == []


def entry(low: int, high: int, **texts: Any) -> dict[str, Any]:
    return {"what": "tests.lines", "from": low, "to": high, "bought": "a law", "removed": "two cases", **texts}


@pytest.mark.parametrize(
    ("history", "raised", "figure", "said"),
    [
        ([1000], [], 1000, ""),
        ([1000, 900], [], 900, ""),
        ([1000, 905], [], 900, ""),
        ([1000], [], 1001, "tests.lines: expected at most 1000, found 1001"),
        ([1000], [], 900, "tests.lines: expected a limit near 900, found 1000"),
        ([1000, 1100], [entry(1000, 1100)], 1100, ""),
        ([1000, 900, 950], [], 950, "tests.lines: expected one entry .*, found 900 to 950 in one"),
        ([1000, 900, 950], [entry(900, 940)], 950, "tests.lines: expected one entry"),
        ([1000], [entry(1000, 1100)], 1000, "tests.lines: expected one entry .*, found 1000 to 1100 in one"),
        ([1000, 1100], [entry(1000, 1100)] * 2, 1100, "tests.lines: expected one entry"),
        ([1000, 1100], [entry(1000, 1100, removed=" ")], 1100, "tests.lines: expected removed in a line, found ' '"),
        ([1000, 1100], [entry(1000, 1100, bought="a\nb")], 1100, "tests.lines: expected bought in a line, found"),
    ],
)
def test_a_limit_is_kept_lowered_and_raised_with_a_reason(
    history: list[int], raised: list[dict[str, Any]], figure: int, said: str
) -> None:
    file = {"slack": 0.01, "tests": {"lines": history}, "raised": raised}
    found = list(budget.breaches(file, {"tests.lines": figure}))
    assert bool(found) == bool(said)
    for sentence in found:
        assert re.match(said, sentence), sentence


def test_every_figure_has_a_row() -> None:
    file = {"slack": 0.01, "tests": {"lines": [5]}}
    assert [name.split(":")[0] for name in budget.breaches(file, {"pages.words": 5})] == ["pages.words", "tests.lines"]


@pytest.mark.parametrize(
    ("history", "figure", "after"),
    [([9], 9, [9]), ([9], 7, [9, 7]), ([9, 7], 5, [9, 5]), ([9, 7], 8, [9, 7]), ([9, 7, 8], 6, [9, 7, 8, 6])],
)
def test_falls_are_recorded_and_rises_stay(history: list[int], figure: int, after: list[int]) -> None:
    assert budget.lowered(history, figure) == after


def test_figures_of_a_small_project(tmp_path: Path) -> None:
    texts = {
        "src/slalom/__init__.pyi": "from slalom.a import B as B, C as C\n",
        "src/slalom/top.py": "x = 1\n",
        "src/slalom/fleet/a.py": 'GAIN = 2.0\n"""[1] A gain. Larger: overshoot."""\nGAIN = 3.0\n"""[1] A gain."""\n',
        "src/slalom/io/b.py": 'MOST: int = 2\n"""[1] Larger: slower."""\n',
        "tests/test_a.py": "\n\n",
        "README.md": "two words",
        "docs/a/b.md": "and three more",
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    lines = {"source.root": 1, "source.fleet": 4, "source.io": 2, "source.all": 7, "tests.lines": 2}
    others = {"constants.behaviour": 1, "constants.other": 1, "public.names": 2, "pages.words": 5}
    assert budget.figures(tmp_path) == lines | others
