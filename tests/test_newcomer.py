"""A newcomer's first hour: from an empty folder and the wheel alone, everything that README and "get started" show."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

import slalom

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.DOTALL | re.MULTILINE)
SHORTER = {"compare": ["--seeds", "1"], "reproduce": ["moving_obstacle", "--quick"]}
"""What is added to commands that take minutes: they run, but less."""
UNTIL_STOPPED = ("slalom view",)
"""Beginnings of commands that end with Ctrl-C; tests/test_live.py has them."""


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


def shown(page: Path) -> Iterator[tuple[str, str]]:
    """Every command and every Python block of a page, in order."""
    for language, text in BLOCK.findall(page.read_text()):
        if language == "python":
            yield language, text
        elif language in ("", "console"):
            lines = [line.removeprefix("$ ") for line in text.splitlines()]
            yield from (("command", line) for line in lines if line.startswith("slalom "))


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


@pytest.mark.slow
@pytest.mark.parametrize("page", ["README.md", "docs/start.md"])
def test_everything_that_is_shown_runs(page: str, installed: Path, tmp_path: Path) -> None:
    """In order, in one folder that was empty; files that one command writes are there for the next."""
    parts = [part for part in shown(ROOT / page) if not part[1].startswith(UNTIL_STOPPED)]
    assert len(parts) >= 8
    module = [sys.executable, "-m", "slalom"]
    namespace: list[str] = []
    for kind, text in parts:
        if kind == "python":
            # Blocks of "get started" follow each other; those of README run alone.
            namespace = [*namespace, text] if page.endswith("start.md") else [text]
            done = run([sys.executable, "-c", "\n".join(namespace)], tmp_path, installed)
            assert done.returncode == 0, done.stderr
            continue
        words = words_of(text)
        words, target = (words[:-2], words[-1]) if ">" in words else (words, None)
        done = run([*module, *words[1:]], tmp_path, installed)
        # Exit code 1: a robot did not arrive, as with some methods in one of the comparisons.
        assert done.returncode in (0, 1), f"{text}\n{done.stdout}{done.stderr}"
        assert done.stdout or done.stderr, text
        if target is not None:
            (tmp_path / target).write_text(done.stdout)


@pytest.mark.slow
def test_results_are_what_the_page_says(installed: Path, tmp_path: Path) -> None:
    """Of the first run of "get started"."""
    text = (ROOT / "docs" / "start.md").read_text()
    assert "A robot has crossed a road. The exit code is 0, since it arrived without a collision." in text
    done = run([sys.executable, "-m", "slalom", "run", "sample:crossing.yaml", "--json"], tmp_path, installed)
    found = json.loads(done.stdout)
    assert (done.returncode, found["arrived"], found["collisions"]) == (0, 1, 0)
