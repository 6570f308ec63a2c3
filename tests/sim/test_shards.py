"""Shares of a comparison on several machines: together they are the whole, and a merge says what is missing."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from slalom.cli import call
from slalom.sim import Row, compare_all
from slalom.sim.sweep.store import MISSING, OTHER, Shard, Store

ROWS = [Row("head_on", {"duration": 0.5}, ["avo", "vo"], 7), Row("empty", {"duration": 0.3}, ["avo"], 3)]
KILLED = """
import os, signal
from slalom.sim import Row, compare_all
from slalom.sim.sweep.store import Shard

def kill(done, total):
    if done == {done}:
        os.kill(os.getpid(), signal.SIGKILL)

compare_all({rows!r}, store={store!r}, shard=Shard(2, 3), progress=kill)
"""


@pytest.mark.parametrize("count", [1, 2, 3, 17, 30])
def test_the_shards_are_a_partition(count: int) -> None:
    """Every item once, and as many in each, up to one."""
    items = {f"key {k}": k for k in range(17)}
    parts = [Shard(k + 1, count).part(items) for k in range(count)]
    assert sorted(item for part in parts for item in part.values()) == [*range(17)]
    sizes = {len(part) for part in parts}
    assert max(sizes) - min(sizes) <= 1


@pytest.mark.slow
def test_three_shards_of_which_one_is_killed(tmp_path: Path) -> None:
    """The merge names what is missing; the killed shard goes on, and the table is that of one machine to the bit."""
    whole = compare_all(ROWS)
    store = Store.at(tmp_path / "runs")
    first = compare_all(ROWS, store=store.folder, shard=Shard(1, 3))
    made = len([*store.folder.glob("*.json")])
    assert made == 6
    assert {
        failure["reason"] for table in first for row in table["methods"].values() for failure in row["failures"]
    } == {OTHER.reason}
    # The progress counts the runs of other shards too, made or left to them: 17 less 6, and two of its own.
    code = KILLED.format(store=str(store.folder), rows=ROWS, done=13)
    done = subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parent, check=False)
    assert done.returncode == -signal.SIGKILL
    lost = 6 - (len([*store.folder.glob("*.json")]) - made)
    assert 0 < lost < 6
    compare_all(ROWS, store=store.folder, shard=Shard(3, 3))
    merged = compare_all(ROWS, store=store.folder, merge=True)
    failures = [failure for table in merged for row in table["methods"].values() for failure in row["failures"]]
    assert {failure["reason"] for failure in failures} == {MISSING.reason}
    assert sum(len(failure["seeds"]) for failure in failures) == lost
    assert sum(row["runs"] for table in merged for row in table["methods"].values()) == 17 - lost
    compare_all(ROWS, store=store.folder, shard=Shard(2, 3))
    assert compare_all(ROWS, store=store.folder, merge=True) == whole


def test_the_command_merges(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 1 and the seeds while something is missing, then the table of the command without shards."""
    tokens = ["compare", "head_on", "--methods", "vo,avo", "--seeds", "3", "--set", "duration=0.3", "--json"]
    shared = ["--store", str(tmp_path / "runs")]
    assert call(tokens) == 0
    whole = json.loads(capsys.readouterr().out)
    for shard in ("1/3", "3/3"):
        assert call([*tokens, *shared, "--shard", shard]) == 0
    capsys.readouterr()
    assert call([*tokens, *shared, "--merge"]) == 1
    found = json.loads(capsys.readouterr().out)["methods"]
    assert sum(len(failure["seeds"]) for row in found.values() for failure in row["failures"]) == 2
    assert call([*tokens[:-1], *shared, "--merge"]) == 1
    assert MISSING.reason in capsys.readouterr().out
    assert call([*tokens, *shared, "--shard", "2/3"]) == 0
    capsys.readouterr()
    assert call([*tokens, *shared, "--merge"]) == 0
    assert json.loads(capsys.readouterr().out) == whole
