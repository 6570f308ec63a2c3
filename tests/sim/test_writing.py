"""A file that slalom writes is whole: the former one, or the new one, on a full disk and after a signal."""

import os
import re
import resource
import signal
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

import pytest

import slalom
from slalom import Disc, InvalidFile, Limits, Obstacle, State, method, view
from slalom.base.writing import replacing, write_file
from slalom.cli import BAD_INPUT, call
from slalom.cli.running import write_run
from slalom.live.recorded import export
from slalom.model.goal import Goal
from slalom.model.trajectory import Stationary
from slalom.sim import Recording, decision_at, simulate
from slalom.sim.files.scenario_writer import write_scenario
from slalom.sim.measure.export_tracks import rows_of_run, write_agents
from slalom.sim.measure.tidy_table import write_table
from slalom.sim.scenario import Robot, Scenario
from slalom.sim.sweep.case import Case
from slalom.sim.sweep.store import Store
from slalom.view.fleet import replay

OBSTACLES = tuple(Obstacle(Disc(0.5), Stationary((5.0 + k, 3.0 - 10.0 * (k % 2)))) for k in range(40))
ROBOT = Robot(Disc(0.6), Limits(3.0, 3.0), State((0, 0), (2, 0)), Goal(Stationary((14, 0)), 0.5))
SCENARIO = Scenario("passing", (ROBOT,), OBSTACLES, duration=2.0)
SOURCES = Path(slalom.__file__).parent
GOOD = b"the good file that was there"
LIMITS = (0, 4_000, 40_000)


@pytest.fixture(scope="module")
def run() -> Recording:
    return simulate(SCENARIO, method("nao"))


def video(run: Recording, path: Path) -> None:
    pytest.importorskip("av", reason="slalom[video] is not installed: videos are not written")
    view.animate(run, path, width=320, fps=5.0)


def parquet(run: Recording, path: Path) -> None:
    pytest.importorskip("pyarrow", reason="slalom[data] is not installed: Parquet is not written")
    write_table(run, path)


def stored(run: Recording, path: Path) -> None:
    case = Case("passing", {}, "nao", 0, {"names": run.names * 5000})
    with patch.object(Case, "key", path.stem):
        Store(path.parent).write(case, {})


WRITERS: dict[str, Callable[[Recording, Path], object]] = {
    **dict.fromkeys(("run.h5", "run.csv", "run.ndjson", "run.sqlite"), write_run),
    "table.csv": write_table,
    "table.parquet": parquet,
    "agents.csv": lambda run, path: write_agents(rows_of_run(run) * 1000, path),
    "scenario.yaml": lambda run, path: write_scenario(SCENARIO, path),
    "decision.json": lambda run, path: decision_at(run, SCENARIO, method("nao"), 3).dump(path),
    "stored.json": stored,
    **dict.fromkeys(
        ("figure.svg", "figure.png", "figure.pdf"), lambda run, path: view.save(replay(run, SCENARIO, "nao"), path)
    ),
    **dict.fromkeys(("video.mp4", "video.gif"), video),
    "page.html": export,
}
"""What writes a file, by the name of the file."""


@contextmanager
def full_disk(size: int) -> Iterator[None]:
    """No file is larger than this [B]."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_the_former_file(name: str, run: Recording, tmp_path: Path) -> None:
    path, refused = tmp_path / name, 0
    WRITERS[name](run, path)
    whole = path.stat().st_size
    for size in LIMITS:
        path.write_bytes(GOOD)
        path.chmod(0o640)
        said = ""
        with full_disk(size):
            try:
                WRITERS[name](run, path)
            except InvalidFile as error:
                said = str(error)
        if said:
            refused += 1
            assert re.match(rf".*{name}: expected a file that can be written, found [^\n]+$", said)
            assert path.read_bytes() == GOOD
        else:  # videos differ by some bytes
            assert abs(path.stat().st_size - whole) < 9 <= whole <= size + 8
        assert stat.S_IMODE(path.stat().st_mode) == 0o640
        assert os.listdir(tmp_path) == [name]
    assert refused == 1 + (whole > LIMITS[1]) + (whole > LIMITS[2])


def test_commands_say_so_in_one_sentence(run: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run.save(tmp_path / "run.h5")
    for name, tokens in (("a.h5", "run empty --out {}"), ("a.csv", "convert {run} {}")):
        target = tmp_path / name
        target.write_bytes(GOOD)
        words = [word.format(target, run=tmp_path / "run.h5") for word in tokens.split()]
        with full_disk(0):
            assert call(words) == BAD_INPUT
        assert capsys.readouterr() == ("", f"{target}: expected a file that can be written, found File too large\n")
        assert target.read_bytes() == GOOD


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_signal_leaves_the_former_file(number: int, tmp_path: Path) -> None:
    """SIGINT also removes what was written until then."""
    path = tmp_path / "a.csv"
    path.write_bytes(GOOD)
    program = f"""
import os, sys
from slalom.base.writing import replacing
with replacing(sys.argv[1]) as part:
    part.write_text("half")
    os.kill(os.getpid(), {number:d})
"""
    assert subprocess.run([sys.executable, "-c", program, path], capture_output=True).returncode == -number
    assert path.read_bytes() == GOOD
    assert len(os.listdir(tmp_path)) == (2 if number == signal.SIGKILL else 1)


def test_links_and_pipes_stay(tmp_path: Path) -> None:
    link, file = tmp_path / "link.csv", tmp_path / "file.csv"
    link.symlink_to(file)
    write_file(link, "new")
    assert link.is_symlink()
    assert file.read_text() == "new"
    with replacing(os.devnull) as part:
        assert part == Path(os.devnull)
    assert Path(os.devnull).is_char_device()


def test_every_file_is_written_beside_its_place() -> None:
    """Other writers of files open a `part` of `replacing`."""
    writes = re.compile(
        r"""(\w+)[ (]*\.(?:write_text|write_bytes)\(|open\((?:str\()?(\w+).*"w"|(\w+)\.open\("w"|h5py\.File\((\w+)
        |savefig\((\w+)|sqlite3\.connect\((\w+)\)|parquet\.write_table\(.*, (\w+)\)""",
        re.VERBOSE,
    )
    found = {
        (path.name, *filter(None, match.groups()))
        for path in SOURCES.rglob("*.py")
        for line in path.read_text().splitlines()
        if (match := writes.search(line))
    }
    elsewhere = {each for each in found if each[1] != "part"}
    # The writers of a tidy table get a part; a figure is drawn to memory; one file is read; two are temporary.
    assert elsewhere == {
        ("tidy_table.py", "path"),
        ("style.py", "memory"),
        ("hdf5_child.py", "path"),
        ("session.py", "file"),
        ("entries.py", "draft"),
    }
    assert len(found) > 8
