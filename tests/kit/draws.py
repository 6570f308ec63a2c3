"""The rotation of repeated draws: which draws of a law one run of the tests makes.

Many laws are tested with many draws: seeds, chunks of random scenes, responses. The first draws run always. The others
are dealt to TURNS turns. Continuous integration runs one turn per commit, so that eight commits run all.
"""

import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

TURNS = 8
USUAL_EXAMPLES = 15
"""Examples of a property in the profile of all draws, see tests/conftest.py."""


def draws(values: Iterable[Any], first: int = 1) -> list[Any]:
    """Parameters of a test: the first `first` values plain, each of the others with the mark of its turn."""
    found: list[Any] = []
    for k, value in enumerate(values):
        if k < first:
            found.append(value)
            continue
        mark = pytest.mark.draw((k - first) % TURNS)
        if isinstance(value, type(pytest.param())):
            found.append(pytest.param(*value.values, marks=[*value.marks, mark], id=value.id))
        else:
            found.append(pytest.param(value, marks=mark))
    return found


def draws_of(named: dict[str, Any], *first: str) -> list[Any]:
    """The same of values with names, which become ids: those named `first` run always."""
    names = [*first, *(name for name in named if name not in first)]
    return draws([pytest.param(named[name], id=name) for name in names], len(first))


def examples(count: int) -> settings:
    """Settings of a property with `count` examples, and with fewer of them where only the first draws run."""
    return settings(max_examples=max(1, count * settings.default.max_examples // USUAL_EXAMPLES), deadline=None)


def turns(setting: str) -> frozenset[int] | None:
    """Turns of further draws that a setting of `--draws` selects; None for the first draws alone, without `slow`.

    Raises pytest.UsageError for an unknown setting.
    """
    if setting == "first":
        return None
    if setting == "all":
        return frozenset(range(TURNS))
    if setting == "commit":
        return frozenset({commit_number() % TURNS})
    if setting in map(str, range(TURNS)):
        return frozenset({int(setting)})
    raise pytest.UsageError(f"--draws: expected first, commit, all or 0 to {TURNS - 1}, found {setting!r}")


def commit_number() -> int:
    """The number of commits up to the present one; in a shallow clone its hash as a number, without git 0."""
    try:
        if _git("rev-parse", "--is-shallow-repository") == "true":
            return int(_git("rev-parse", "HEAD"), 16)
        return int(_git("rev-list", "--count", "HEAD"))
    except (OSError, subprocess.CalledProcessError):
        return 0


def _git(*arguments: str) -> str:
    command = ["git", "-C", str(Path(__file__).parent), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def runs(item: pytest.Item, selected: frozenset[int] | None) -> bool:
    """Whether a test belongs to the selected draws. Several marks of one test add up to one turn."""
    marks = [mark.args[0] for mark in item.iter_markers("draw")]
    if selected is None:
        return not marks and item.get_closest_marker("slow") is None
    return not marks or sum(marks) % TURNS in selected
