"""Files with cases, and those of other authors."""

import math
from pathlib import Path

import numpy as np
import pytest

from slalom import InvalidFile, method
from slalom.io.table import sample_data
from slalom.sim import compare, load, metrics, read_scenario, simulate
from slalom.sim.files.scenario_writer import scenario_text
from slalom.sim.files.scenario_yaml import count_of_cases, files_of, read_scenarios

KNOT, MILE = 1852.0 / 3600.0, 1852.0


def compass(x: float, y: float) -> float:
    """A direction in degrees, clockwise from the y axis."""
    return math.degrees(math.atan2(x, y)) % 360.0


CASES = """\
name: shared
duration: 2
robot: {position: [0, 0], radius: 0.5, max_speed: 1, max_acceleration: 1, goal: {position: [9, 0], tolerance: 0.3}}
obstacles:
  - &car {name: car, radius: 1, trajectory: {kind: constant_velocity, position: [9, 1], velocity: [-1, 0]}}
cases:
  - {name: first}
  - {name: second, obstacles: [], robot: {velocity: [0.5, 0], goal: {position: [5, 5]}}}
  - {duration: 3, obstacles: [*car, {radius: 2, trajectory: {kind: stationary, position: [3, 9]}}]}
"""
DOMAIN = """\
    shape: {kind: polygon, corners: [[1200, 0], [0, 400], [-400, 0], [0, -800]]}
    heading: motion
"""
WHOLE = [
    "name: first\nduration: 2\nrobot: {position: [0, 0], radius: 0.5, max_speed: 1, max_acceleration: 1, goal: "
    "{position: [9, 0], tolerance: 0.3}}\nobstacles:\n  - {name: car, radius: 1, trajectory: {kind: constant_velocity, "
    "position: [9, 1], velocity: [-1, 0]}}",
    "name: second\nduration: 2\nrobot: {position: [0, 0], velocity: [0.5, 0], radius: 0.5, max_speed: 1, "
    "max_acceleration: 1, goal: {position: [5, 5], tolerance: 0.3}}",
    "name: shared\nduration: 3\nrobot: {position: [0, 0], radius: 0.5, max_speed: 1, max_acceleration: 1, goal: "
    "{position: [9, 0], tolerance: 0.3}}\nobstacles:\n  - {name: car, radius: 1, trajectory: {kind: constant_velocity, "
    "position: [9, 1], velocity: [-1, 0]}}\n  - {radius: 2, trajectory: {kind: stationary, position: [3, 9]}}",
]


@pytest.mark.parametrize("k", range(3))
def test_a_case_is_the_file_with_its_keys(k: int, tmp_path: Path) -> None:
    """Mappings key by key, lists as a whole: the same scenario as in a file of its own."""
    (tmp_path / "cases.yaml").write_text(CASES)
    (tmp_path / "whole.yaml").write_text(WHOLE[k])
    assert scenario_text(read_scenario(tmp_path / "cases.yaml", k)) == scenario_text(
        read_scenario(tmp_path / "whole.yaml")
    )


def test_a_mistake_in_a_case_has_its_place(tmp_path: Path) -> None:
    """Line and column of the case, or of the key that it shares."""
    path = tmp_path / "a.yaml"
    path.write_text(CASES.replace("duration: 3", "duration: -3").replace("radius: 0.5", "radius: wide"))
    with pytest.raises(InvalidFile) as found:
        read_scenario(path, 2)
    assert [line.removeprefix(str(path)) for line in found.value.mistakes] == [
        ":3:35: robot.radius: expected a number, found 'wide'",
        ":9:16: duration: expected a number above 0, found -3",
    ]
    path.write_text(CASES.replace("duration: 3", "duration: -3").replace("velocity: [0.5, 0]", "velocity: fast"))
    with pytest.raises(InvalidFile) as all_cases:
        compare(str(path), ["nao"], 1)
    assert [line.removeprefix(str(path)).partition(" ")[0] for line in all_cases.value.mistakes] == [":8:53:", ":9:16:"]


def test_a_result_depends_on_the_recordings_of_all_cases(tmp_path: Path) -> None:
    """A sweep refuses to go on when one of them has changed."""
    for name in ("one", "two"):
        (tmp_path / f"{name}.csv").write_text("t,id,x,y\n0,1,3,3\n9,1,9,9\n")
    cases = "recording: {file: one.csv, radius: 0.3}\ncases:\n  - {}\n  - {recording: {file: two.csv}}\n"
    (tmp_path / "a.yaml").write_text(WHOLE[1] + "\n" + cases)
    assert [len(scenario.obstacles) for scenario in read_scenarios(tmp_path / "a.yaml")] == [1, 1]
    assert [path.name for path in files_of(tmp_path / "a.yaml")] == ["a.yaml", "one.csv", "two.csv"]


def test_domains_of_ships_stand_in_files(tmp_path: Path) -> None:
    """A polygon that turns with the motion is kept clear of: it is longer ahead than astern."""
    text = sample_data("imazu.yaml").read_text().replace("    radius: 845\n", DOMAIN)
    (tmp_path / "domains.yaml").write_text(text)
    scenario = read_scenario(tmp_path / "domains.yaml", 1)
    run = simulate(scenario, method("vo"))
    assert scenario.obstacles[0].heading == "motion"
    assert metrics.min_clearance(run) >= 0.0
    ship = scenario.obstacles[0].trajectory.position(run.times)
    assert np.linalg.norm(run.positions[:, 0] - ship, axis=1).min() < 845.0


def test_every_case_is_a_seed(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(CASES)
    assert count_of_cases(path) == 3
    table = compare(str(path), ["nao"], 3, metrics=["clearing_distance"])
    alone = [simulate(read_scenario(path, k), method("nao"), seed=k) for k in range(3)]
    nearest = [metrics.clearing_distance(run) for run in alone]
    found = table["methods"]["nao"]["metrics"]["clearing_distance"]
    assert (table["deterministic"], table["methods"]["nao"]["runs"]) == (False, 3)
    assert found["range"] == [min(nearest), max(x for x in nearest if x < math.inf)]


TABLE = """180; 270; 0; 45; 180 270; 350 315; 0 315; 180 270; 330 270; 270 15; 90 330; 180 315 350; 180 10 45;
350 315 270; 0 315 270; 45 90 270; 0 10 315; 225 345 330; 15 345 225; 0 345 270; 345 15 270; 0 315 270"""
COURSES = {k + 1: [int(course) for course in case.split()] for k, case in enumerate(TABLE.split(";"))}
"""Courses of the ships in the table of Sawada et al. 2021, degrees clockwise from north."""


def test_imazu_has_the_courses_and_speeds_of_the_table() -> None:
    path = sample_data("imazu.yaml")
    assert count_of_cases(path) == len(COURSES) == 22
    for scenario, (case, courses) in zip(read_scenarios(path), COURSES.items(), strict=True):
        assert scenario.name == f"imazu {case}"
        velocities = [o.trajectory.initial_velocity for o in scenario.obstacles]
        assert [round(compass(*v), 2) % 360 for v in velocities] == courses
        slow = [case in (3, 7, 15, 16, 17, 20, 22) and k == 0 for k in range(len(courses))]
        speeds = [math.hypot(*v) / KNOT for v in velocities]
        assert speeds == pytest.approx([8.4 if each else 12.0 for each in slow], abs=1e-3)
        for ship in scenario.obstacles:
            assert ship.trajectory.position(1800.0).tolist() == [0.0, 0.0]
            grown = ship.shape.bounding_radius + scenario.robot.shape.bounding_radius + scenario.margin
            assert grown == pytest.approx(0.5 * MILE)


@pytest.mark.parametrize(
    ("case", "separation", "when"),
    [(0, 0.0, 120.0), (1, 0.5 * 180 / math.hypot(120, 180), 100.0), (2, 0.5, 100.0), (3, 0.1413, 200.5)],
)
def test_daidalus_meets_as_its_files_say(case: int, separation: float, when: float) -> None:
    """Least distance in nautical miles, and its time, of aircraft that fly on; 18 s later where they cross in C1."""
    scenario = load(str(sample_data("daidalus.yaml")), seed=case)
    own, path = scenario.robot.state, scenario.obstacles[0].trajectory
    relative, velocity = path.position(0.0) - own.position, path.initial_velocity - own.velocity
    until = -float(relative @ velocity) / float(velocity @ velocity)
    assert float(np.linalg.norm(relative + until * velocity)) / MILE == pytest.approx(separation, abs=1e-3)
    assert until == pytest.approx(when + (4.615 if case == 1 else 0.0), abs=0.1)
