"""The program that crosses recorded crowds: what the robot may know, and what it writes."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
STEP = 0.25


def crowd(file: Path, change_from: int | None = None) -> Path:
    """A case with two people in the way of the robot; from a step on they move otherwise, and leave elsewhere."""
    k = np.arange(60)
    places = np.stack(
        [np.stack([6.0 - 0.9 * STEP * k, 0.2 + 0.0 * k]), np.stack([3.0 + 0.0 * k, 4.0 - 0.7 * STEP * k])]
    )
    xy = np.moveaxis(places, 2, 0).transpose(0, 1, 2).astype(np.float32)[None]
    people = np.tile(np.arange(2), (1, 60, 1))
    later = {"goal_xy": np.zeros((1, 2)), "dep_xy": np.zeros((1, 2)), "end_xy": np.zeros((1, 2))}
    if change_from is not None:
        xy[:, change_from:] -= 0.05 * (1.0 + np.arange(60 - change_from))[None, :, None, None]
        people[:, change_from + 10 :, 1] = 2
        later = {name: value + 3.0 for name, value in later.items()}
    np.savez(
        file,
        case=[7],
        xy=xy,
        pid=people,
        robot_start=[[0.0, 0.0]],
        robot_goal=[[8.0, 0.0]],
        person_case=[7, 7, 7],
        person_id=[0, 1, 2],
        person_radius=[0.3, 0.4, 0.4],
        dt=STEP,
        robot_radius=0.3,
        robot_v_max=1.0,
        goal_radius=0.3,
        sensor_range=5.0,
        **later,
    )
    return file


def crossed(file: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) [s] and positions (n, 2) [m] of the robot that the program writes."""
    out = file.with_suffix(".json")
    command = [sys.executable, BENCHMARKS / "crowdnavpp.py", file, "--foresight", "observed", "--out", out]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    assert "1 of 1 paths end at their goal" in ended.stdout
    (run,) = json.loads(out.read_text()).values()
    return np.array(run["t"]), np.array(run["p"])


@pytest.mark.slow
def test_the_future_changes_no_step_before_it(tmp_path: Path) -> None:
    """Until the robot observes the first step that is different, its path is the same to the bit."""
    one, other = crossed(crowd(tmp_path / "one.npz")), crossed(crowd(tmp_path / "other.npz", 8))
    same = one[0] <= 8 * STEP
    np.testing.assert_array_equal(one[0][same], other[0][: same.sum()])
    np.testing.assert_array_equal(one[1][same], other[1][: same.sum()])
    count = min(len(one[1]), len(other[1]))
    assert not np.array_equal(one[1][:count], other[1][:count])


@pytest.mark.draw(2)
def test_the_robot_obeys_the_rules_of_the_test(tmp_path: Path) -> None:
    """At most 1 m/s, 20 samples a second, no contact with anyone, from the start to the goal."""
    file = crowd(tmp_path / "case.npz")
    times, places = crossed(file)
    assert places[0].tolist() == [0.0, 0.0]
    assert np.linalg.norm(places[-1] - (8.0, 0.0)) < 0.3
    assert np.diff(times).max() <= 0.05
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(times)
    assert speeds.max() <= 1.0 + 1e-9
    with np.load(file) as data:
        people = data["xy"][0].astype(float)
    for person, radius in ((0, 0.3), (1, 0.4)):
        there = np.stack([np.interp(times, STEP * np.arange(60), people[:, person, axis]) for axis in (0, 1)], axis=1)
        assert np.linalg.norm(places - there, axis=1).min() > 0.3 + radius


@pytest.mark.slow
def test_shared_cases_are_read(tmp_path: Path) -> None:
    data = Path(__file__).parents[3] / "shared" / "data" / "crowdnavpp" / "crowdnavpp_random_dev.npz"
    if not data.exists():
        pytest.skip(f"no recorded crowds in {data.parent}")
    out = tmp_path / "result.json"
    command = [sys.executable, BENCHMARKS / "crowdnavpp.py", data, "--out", out, "--cases", "1"]
    subprocess.run(command, capture_output=True, check=True)
    assert list(json.loads(out.read_text())) == ["1000"]
