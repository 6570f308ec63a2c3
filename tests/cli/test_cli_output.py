"""Every command: folders of its files are made, long ones report progress, names in its texts exist."""

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from slalom.cli import app, call
from slalom.cli.console import DONE
from slalom.cli.others import TABLES
from slalom.cli.report import milliseconds

ROOT = Path(__file__).parents[2]
STARTED = "import sys, runpy; sys.argv[:] = ['slalom', *sys.argv[1:]]; print(flush=True); "
"""The beginning of a command, which says when Python itself has begun: before that Ctrl-C is not of slalom."""
ENTRIES = ("from slalom.__main__ import main; main()", "runpy.run_module('slalom', run_name='__main__')")
RUN = ["run", "empty", "--set", "duration=0.3"]
LONG = {
    "run": RUN,
    "compare": ["compare", "empty", "--set", "duration=0.3", "--methods", "vo", "--seeds", "1"],
    "reproduce": ["reproduce", "moving_obstacle", "--quick", "--out", "paper"],
    "export": ["export", "run.h5", "run.html"],
    "animate": ["animate", "run.h5", "run.gif", "--width", "320"],
}
"""Commands that may take minutes, each as a short example. `ros replay` is tested with rosbags,
`tests/adapters/test_ros.py`."""
SHORT = {"list", "decide", "explain", "convert", "show", "export-scenario"}
"""Commands of seconds; a recording of a gigabyte, the largest that is read, takes `convert` longer."""
OWN_REPORTS = {"compile", "view", "ros"}
"""Commands that print each of their steps, that run until they are stopped, or that have commands of their own."""
FILES = {
    "new/run.h5": [*RUN, "--out"],
    "new/run.csv": [*RUN, "--out"],
    "new/run.svg": [*RUN, "--figure"],
    "new/scene.svg": ["decide", "empty", "--figure"],
    "new/page.md": [*LONG["compare"], "--page"],
    "new/table.csv": ["convert", "run.h5"],
    "new/ring.csv": ["convert", "sample:roundabout_ring_11.csv"],
    "new/shown.svg": ["show", "run.h5", "--figure"],
    "new/run.html": ["export", "run.h5"],
    "new/run.gif": ["animate", "--width", "320", "run.h5"],
    "new/paper/paper.md": [*LONG["reproduce"][:-2], "--out", "other", "--page"],
}
"""Files in folders that do not exist, by the command that writes them."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder with a run in it, which is the current one."""
    monkeypatch.chdir(tmp_path)
    call([*RUN, "--out", "run.h5"])
    return tmp_path


@pytest.mark.parametrize("file", FILES)
def test_folders_of_files_are_made(file: str, folder: Path) -> None:
    """Exit code 1: in the short run the robot does not arrive."""
    if file.endswith(".gif"):
        pytest.importorskip("av", reason="slalom[video] is not installed: videos are not written")
    code = call([*FILES[file], file])
    assert code in ((DONE, 1) if FILES[file][0] == "run" else (DONE,))
    assert (folder / file).stat().st_size > 0


@pytest.mark.parametrize("command", LONG)
def test_long_commands_report_their_progress(command: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Shares that increase up to 1, for the bar of a terminal and for the time that is printed elsewhere."""
    if command == "animate":
        pytest.importorskip("av", reason="slalom[video] is not installed: videos are not written")
    shares: list[float] = []
    monkeypatch.setattr("slalom.cli.console._Estimate.advance", lambda _, share: shares.append(share))
    assert call(LONG[command]) in (DONE, 1)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def test_every_command_is_long_or_short() -> None:
    commands = {name for name in app if not name.startswith("-")}
    assert commands == {*LONG, *SHORT, *OWN_REPORTS}


def test_progress_is_a_bar_at_a_terminal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Also the time that remains; the result on stdout is the same."""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    assert call([*LONG["compare"], "--json"]) == DONE
    printed = capsys.readouterr()
    assert json.loads(printed.out)["methods"]["vo"]["runs"] == 1
    assert "comparing" in printed.err


@pytest.mark.parametrize(
    ("microseconds", "text"),
    [(0.0, "0.0 ms"), (3.14, "0.0031 ms"), (41.0, "0.041 ms"), (310.0, "0.3 ms"), (12345.0, "12.3 ms")],
)
def test_short_times_are_not_zero(microseconds: float, text: str) -> None:
    """A decision of a fleet takes some microseconds."""
    assert milliseconds(microseconds) == text


def texts() -> dict[str, str]:
    """Pages, sources and samples that name commands, by their names."""
    folders = {"src/slalom": (".py", ".yaml"), "docs": (".md",), "examples": (".py",)}
    paths = [path for name, suffixes in folders.items() for path in (ROOT / name).rglob("*") if path.suffix in suffixes]
    pages = [*paths, *(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "CHANGELOG"))]
    return {str(path.relative_to(ROOT)): path.read_text() for path in pages}


@pytest.mark.parametrize("named", [r"slalom list ([a-z]+)`", r"`slalom ([a-z-]+)[^`]*`"], ids=["lists", "commands"])
def test_commands_that_texts_name_exist(named: str) -> None:
    """The lists of `slalom list`, and the commands themselves."""
    known: Callable[[str], bool] = {*TABLES, "keys"}.__contains__ if "list" in named else app.__contains__
    found = {(page, name) for page, text in texts().items() for name in re.findall(named, text)}
    assert len({name for _, name in found}) > 5
    assert not {(page, name) for page, name in found if not known(name)}


@pytest.mark.parametrize("entry", ENTRIES)
def test_ctrl_c_ends_a_command_silently_from_its_first_moment(entry: str) -> None:
    """During the imports, and in the run."""
    for delay in (0.0, 0.05, 0.4, 1.6):
        words = [
            sys.executable,
            "-c",
            STARTED + entry,
            "run",
            "empty",
            *("--set", "distance=4000", "--set", "duration=2000"),
        ]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            process.stdout.readline()
            time.sleep(delay)
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=60)
        # A signal before the first line of slalom ends Python by itself.
        assert process.returncode == 130 or (delay == 0.0 and process.returncode in (1, -signal.SIGINT)), (delay, said)
        assert delay == 0.0 or "Traceback" not in said, (delay, said)


@pytest.mark.parametrize(("raised", "code"), [("KeyboardInterrupt", 130), ("SystemExit(143)", 143)])
def test_a_signal_in_a_callback_ends_a_command(raised: str, code: int) -> None:
    """Python drops what is raised while an object is deleted: half a second after the start, until the run ends."""
    deleted = (
        "import os, threading; "
        f"A = type('A', (), {{'__del__': lambda self: (_ for _ in ()).throw({raised})}}); "
        "threading.Timer(0.5, lambda: A()).start(); "
    )
    run = ["run", "empty", "--set", "distance=4000", "--set", "duration=2000"]
    words = [sys.executable, "-c", deleted + STARTED + ENTRIES[0], *run]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert (done.returncode, "Exception ignored" in done.stderr) == (code, False), done


def test_ctrl_c_while_python_ends_does_not_change_the_exit_code() -> None:
    """The command is done; an object that is deleted among the last sends the signal."""
    last = "import os; A = type('A', (), {'__del__': lambda self, k=os.kill, p=os.getpid(): k(p, 2)}); a = A(); "
    words = [sys.executable, "-c", last + STARTED + ENTRIES[0], "--version"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
