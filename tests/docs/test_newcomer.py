"""A newcomer's first hour: from an empty folder and the wheel alone, everything that README and first pages show."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
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
SHORTER = {"compare": ["--seeds", "1"], "reproduce": ["moving_obstacle", "--quick"]}
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
    if ">" in words:
        return words
    return (
        [*words, *more]
        if "--seeds" not in words
        else [*words[: words.index("--seeds")], *more, *words[words.index("--seeds") + 2 :]]
    )


def run(command: list[str], folder: Path, installed: Path) -> subprocess.CompletedProcess[str]:
    """Run a program in a folder, with the installed wheel."""
    settings = {**os.environ, "PYTHONPATH": str(installed)}
    return subprocess.run(command, cwd=folder, env=settings, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_the_wheel_is_what_runs(installed: Path, tmp_path: Path) -> None:
    """Not the clone."""
    done = run([sys.executable, "-c", "import slalom; print(slalom.__file__)"], tmp_path, installed)
    assert Path(done.stdout.strip()).is_relative_to(installed)


def said(words: list[str], folder: Path, installed: Path) -> str:
    """What a command prints; its file after > gets it instead."""
    words, target = (words[:-2], words[-1]) if ">" in words else (words, None)
    done = run([sys.executable, "-m", "slalom", *words[1:]], folder, installed)
    # Exit code 1: a robot did not arrive, as with some methods in one of the comparisons.
    assert done.returncode in (0, 1), f"{words}\n{done.stdout}{done.stderr}"
    assert done.stdout or done.stderr, words
    if target is None:
        return done.stdout
    (folder / target).write_text(done.stdout)
    return ""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "shows", "stated"),
    [("README.md", 3, 2), ("docs/start.md", 8, 6), ("docs/library.md", 4, 2), ("docs/commands.md", 16, 0)],
)
def test_everything_that_is_shown_runs_and_prints_what_the_page_says(
    page: str, shows: int, stated: int, installed: Path, tmp_path: Path
) -> None:
    """In order, in one folder that was empty; files that one command writes are there for the next."""
    parts = list(shown(ROOT / page))
    assert sum(len(part.texts) for part in parts) >= shows
    assert sum(part.stated is not None for part in parts) >= stated
    namespace, before = "", ""
    for part in parts:
        if part.kind == "python":
            # Blocks of "get started" follow each other; those of other pages run alone.
            namespace = namespace + part.texts[0] if page.endswith("start.md") else part.texts[0]
            done = run([sys.executable, "-c", namespace], tmp_path, installed)
            assert done.returncode == 0, done.stderr
            printed = done.stdout.removeprefix(before)
            before = done.stdout if page.endswith("start.md") else ""
        else:
            # What the page states is what the command prints as it stands there.
            words = [shlex.split(text, comments=True) if part.stated else words_of(text) for text in part.texts]
            printed = "".join(said(each, tmp_path, installed) for each in words)
        if part.stated is not None:
            assert TIME.sub("TIME", printed).rstrip() == TIME.sub("TIME", part.stated).rstrip()


def test_times_alone_are_masked() -> None:
    """A page with another result does not pass."""
    assert TIME.sub("TIME", "decision time 0.2 ms (99 %: 11.0 ms)") == "decision time TIME (99 %: TIME)"
    assert TIME.sub("TIME", "time 9.1 s, clearance 0.1 m") == "time 9.1 s, clearance 0.1 m"
