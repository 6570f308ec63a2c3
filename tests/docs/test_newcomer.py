"""A newcomer's first hour: from an empty folder and the wheel alone, everything that README and first pages show."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import pytest

import slalom

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```(?:\n\n```text\n(.*?)^```)?", re.DOTALL | re.MULTILINE)
"""A block, and the output that the page states below it."""
TIME = re.compile(r"\d+\.\d+ ms")
"""Times of this machine, which differ."""
SHORTER = {"compare": ["--seeds", "1"], "reproduce": ["moving_obstacle", "--quick"], "animate": ["--fps", "1"]}
"""What is added to commands that take minutes: they run, but less."""
UNTIL_STOPPED = ("slalom view",)
"""Beginnings of commands that end with Ctrl-C; tests/live/test_live.py has them."""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, installed into a folder of its own; packages that it needs are those of this environment.

    The compiled kernels are those of this clone, whose sources are the same.
    """
    if find_spec("hatchling") is None:
        pytest.skip("hatchling, which builds the wheel, is not installed")
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, "wheel", ".", "--no-deps", "--no-build-isolation", "-w", folder], cwd=ROOT, check=True)
    (wheel,) = folder.glob("*.whl")
    subprocess.run([*pip, "install", "--no-deps", "--no-compile", "--target", folder / "site", wheel], check=True)
    ours, theirs = Path(slalom.__file__).parent, folder / "site" / "slalom"
    for path in theirs.rglob("*.py"):
        assert path.read_bytes() == (ours / path.relative_to(theirs)).read_bytes()
        shutil.copystat(ours / path.relative_to(theirs), path)
    for cache in (ours / "kernels").rglob("__pycache__"):
        shutil.copytree(cache, theirs / cache.relative_to(ours))
    return folder / "site"


class Part(NamedTuple):
    """Commands or Python of one block, and what the page says that they print; None if it says nothing."""

    kind: str
    texts: list[str]
    stated: str | None


def shown(page: Path) -> Iterator[Part]:
    """Every block of a page with Python or commands of slalom, in order."""
    for language, text, stated in BLOCK.findall(page.read_text()):
        if language == "python":
            yield Part(language, [text], stated or None)
        elif language in ("", "console"):
            lines = [line.removeprefix("$ ") for line in text.splitlines()]
            commands = [line for line in lines if line.startswith("slalom ") and not line.startswith(UNTIL_STOPPED)]
            if commands:
                yield Part("command", commands, stated or None)


def words_of(line: str) -> list[str]:
    """The words of a command, shorter where it takes minutes."""
    words = shlex.split(line, comments=True)
    more = SHORTER.get(words[1], [])
    if more and more[0] in words:
        first = words.index(more[0])
        del words[first : first + 2]
    return [*words, *more]


PROGRAM = """
import io, json, sys
from contextlib import redirect_stdout
from pathlib import Path

import slalom
from slalom.cli import call

steps, follow = json.load(sys.stdin)
said, namespace = [], {"__name__": "__documentation__"}
for step in steps:
    target = step.pop() if ">" in step[:-1] else None
    with redirect_stdout(io.StringIO()) as out:
        if step[0] == "slalom":
            code = call([word for word in step[1:] if word != ">"])
            assert code in (0, 1), (code, step)
        else:
            exec(step[0], namespace if follow else dict(namespace))
    if target:
        Path(target).write_text(out.getvalue())
    said.append("" if target else out.getvalue())
print(json.dumps([slalom.__file__, said]))
"""
"""Runs blocks of Python and commands in order. Exit code 1: a robot did not arrive, as in one of the comparisons."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "shows", "stated"),
    [("README.md", 3, 2), ("docs/start.md", 8, 6), ("docs/library.md", 4, 2), ("docs/commands.md", 16, 0)],
)
def test_everything_that_is_shown_runs_and_prints_what_the_page_says(
    page: str, shows: int, stated: int, installed: Path, tmp_path: Path
) -> None:
    """From the wheel, not from the clone, in a folder that was empty; a command finds files of those before it."""
    parts = list(shown(ROOT / page))
    assert sum(len(part.texts) for part in parts) >= shows
    assert sum(part.stated is not None for part in parts) >= stated
    steps, owners = list[list[str]](), list[Part]()
    for part in parts:
        for text in part.texts:
            # What the page states is what the command prints as it stands there.
            of_command = words_of if part.stated is None else partial(shlex.split, comments=True)
            steps.append([text] if part.kind == "python" else of_command(text))
            owners.append(part)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        # Blocks of "get started" follow each other; those of other pages run alone.
        input=json.dumps([steps, page.endswith("start.md")]),
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    where, said = json.loads(done.stdout)
    assert Path(where).is_relative_to(installed)
    for part in parts:
        printed = "".join(text for text, owner in zip(said, owners, strict=True) if owner is part)
        if part.stated is not None:
            assert TIME.sub("TIME", printed).rstrip() == TIME.sub("TIME", part.stated).rstrip()


def test_times_alone_are_masked() -> None:
    """A page with another result does not pass."""
    assert TIME.sub("TIME", "decision time 0.2 ms (99 %: 11.0 ms)") == "decision time TIME (99 %: TIME)"
    assert TIME.sub("TIME", "time 9.1 s, clearance 0.1 m") == "time 9.1 s, clearance 0.1 m"
