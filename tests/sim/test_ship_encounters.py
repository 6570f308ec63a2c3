"""Metrics of encounters against slow derivations, files with cases, and the encounters of other authors."""

import csv
import math
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from metrics_by_hand import driven
from parts import disc_or_ball

from slalom import ConstantVelocity, InvalidFile, Obstacle, Polygon, Rectangle, Stationary, method
from slalom.io.table import sample_data
from slalom.sim import Recording, compare, load, metrics, read_scenario, simulate
from slalom.sim.files.scenario_writer import scenario_text
from slalom.sim.files.scenario_yaml import count_of_cases, files_of, read_scenarios
from slalom.sim.measure.encounters import CLEAR_STEP, COURSE_RATE, WELL_CLEAR, encounter, not_well_clear

ROOT = Path(__file__).parents[2]
DNV = Path(os.environ.get("SLALOM_DATA", ROOT.parent / "shared" / "data")) / "peers" / "dnv_ship_encounters.csv"
sys.path.insert(0, str(ROOT / "tools"))

import dnv_encounters  # noqa: E402

KNOT, MILE = 1852.0 / 3600.0, 1852.0


def ships(seed: int, others: int = 2, steps: int = 40) -> Recording:
    """A vessel that turns at random among others that keep course and speed."""
    rng = np.random.default_rng(seed)
    accelerations = np.repeat(rng.uniform(-0.3, 0.3, (steps // 4, 2)), 4, axis=0)
    obstacles = tuple(
        Obstacle(disc_or_ball(1.0, 2), ConstantVelocity(rng.uniform(-400, 400, 2), rng.uniform(-6, 6, 2)), f"ship {k}")
        for k in range(others)
    )
    start, velocity = rng.uniform(-50, 50, 2), rng.uniform(-6, 6, 2)
    return driven(accelerations, position=tuple(start), speed=tuple(velocity), dt=2.0, obstacles=obstacles)


def at(run: Recording, t: float) -> tuple[float, float, float, float]:
    """Position and velocity of the robot, step by step in plain numbers."""
    k = min(int(t / run.dt), len(run.accelerations) - 1)
    s = t - k * run.dt
    (x, y), (vx, vy), (ax, ay) = run.positions[k, 0], run.velocities[k, 0], run.accelerations[k, 0]
    return x + s * vx + s * s * ax / 2, y + s * vy + s * s * ay / 2, vx + s * ax, vy + s * ay


def compass(x: float, y: float) -> float:
    """A direction in degrees, clockwise from the y axis."""
    return math.degrees(math.atan2(x, y)) % 360.0


def turned(angle: float) -> float:
    """An angle in degrees from -180 to 180."""
    return (angle + 180.0) % 360.0 - 180.0


seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_closest_approach_is_the_least_of_many_distances(seed: int) -> None:
    run = ships(seed)
    times = np.linspace(0.0, float(run.times[-1]), 1601)
    distances = []
    for t in times:
        x, y, _, _ = at(run, t)
        others = [o.trajectory.initial_position + t * o.trajectory.initial_velocity for o in run.obstacles]
        distances.append(min(math.hypot(qx - x, qy - y) for qx, qy in others))
    found, when = metrics.closest_approach(run), metrics.time_to_closest_approach(run)
    # Two neighbouring times are 0.05 s apart, in which no pair moves by more than 2 m.
    assert min(distances) - 1.0 <= found <= min(distances) + 1e-3
    x, y, _, _ = at(run, when)
    others = [o.trajectory.initial_position + when * o.trajectory.initial_velocity for o in run.obstacles]
    assert found == pytest.approx(min(math.hypot(qx - x, qy - y) for qx, qy in others), abs=1e-6)


def test_closest_approach_is_between_positions() -> None:
    """Bodies do not change it, nor does an obstacle at rest."""
    run = ships(3)
    big = [
        replace(o, shape=shape)
        for o, shape in zip(run.obstacles, (Rectangle(30, 9), Polygon([(0, 0), (9, 0), (0, 5)])))
    ]
    rock = Obstacle(disc_or_ball(1.0, 2), Stationary((0.0, 0.0)))
    assert metrics.closest_approach(replace(run, obstacles=tuple(big))) == pytest.approx(metrics.closest_approach(run))
    assert metrics.closest_approach(replace(run, obstacles=(rock,))) == math.inf
    assert metrics.min_clearance(replace(run, obstacles=tuple(big))) < metrics.closest_approach(run)


@settings(max_examples=50, deadline=None)
@given(seeds)
def test_course_changes_count_turns_to_the_other_side(seed: int) -> None:
    run = ships(seed)
    last, count = 0.0, 0
    for (vx, vy), (wx, wy) in zip(run.velocities[:-1, 0], run.velocities[1:, 0]):
        turn = turned(compass(wx, wy) - compass(vx, vy))
        if abs(math.radians(turn)) / run.dt > COURSE_RATE:
            count += last * turn < 0.0
            last = turn
    assert metrics.course_changes(run) == count


def kind_by_compass(run: Recording, other: Obstacle) -> str:
    """The kind of an encounter by bearings on a compass, as the rules state them."""
    qx, qy = other.trajectory.initial_position - run.positions[0, 0]
    (vx, vy), (wx, wy) = run.velocities[0, 0], other.trajectory.initial_velocity
    mine, theirs = compass(vx, vy), compass(wx, wy)
    seen, seen_back = turned(compass(qx, qy) - mine), turned(compass(-qx, -qy) - theirs)
    if qx * (wx - vx) + qy * (wy - vy) >= 0.0:
        return "none"
    if abs(seen) <= 10.0 and abs(turned(theirs - mine)) >= 165.0:
        return "head-on"
    if abs(seen_back) > 112.5 and math.hypot(vx, vy) > math.hypot(wx, wy):
        return "overtaking"
    if abs(seen) > 112.5 and math.hypot(vx, vy) < math.hypot(wx, wy):
        return "overtaken"
    return "give-way" if seen > 0.0 else "stand-on"


def kept_by_compass(run: Recording, other: Obstacle) -> bool:
    """Whether the sides are kept, from states every 0.1 s."""
    kind = kind_by_compass(run, other)
    start, (wx, wy) = other.trajectory.initial_position, other.trajectory.initial_velocity
    first, crossed, nearest = None, False, (math.inf, 0.0)
    course = compass(*run.velocities[0, 0])
    total, before = 0.0, None
    for t in np.arange(0.0, float(run.times[-1]), 0.1):
        x, y, vx, vy = at(run, t)
        qx, qy = start[0] + t * wx - x, start[1] + t * wy - y
        total += turned(compass(vx, vy) - course)
        course = compass(vx, vy)
        first = first or (total if abs(total) > 5.0 else None)
        nearest = min(nearest, (math.hypot(qx, qy), turned(compass(qx, qy) - course)))
        beside = turned(compass(-qx, -qy) - compass(wx, wy))
        crossed |= before is not None and before * beside < 0.0 and abs(beside) < 90.0 and abs(before) < 90.0
        before = beside
    return {"head-on": nearest[1] < 0.0, "give-way": not crossed, "stand-on": first is None or first > 0.0}.get(
        kind, True
    )


@settings(max_examples=60, deadline=None)
@given(seeds, st.sampled_from(["any", "towards"]))
def test_sides_are_those_of_the_rules(seed: int, aim: str) -> None:
    run = ships(seed, others=1)
    other = run.obstacles[0]
    if aim == "towards":
        # Head-on, so that every rule has its share of the draws.
        v = run.velocities[0, 0]
        turn = np.random.default_rng(seed).uniform(-0.2, 0.2)
        c, s = math.cos(turn), math.sin(turn)
        ahead = run.positions[0, 0] + 200.0 / np.linalg.norm(v) * np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])
        other = Obstacle(other.shape, ConstantVelocity(ahead, -v), "ship")
        run = replace(run, obstacles=(other,))
    # In a collision, or at a speed of almost 0, rounding decides.
    assume(np.linalg.norm(run.velocities[:, 0], axis=1).min() > 0.5 and metrics.closest_approach(run) > 2.0)
    kind = encounter(
        other.trajectory.initial_position - run.positions[0, 0], run.velocities[0, 0], other.trajectory.initial_velocity
    )
    assert kind == kind_by_compass(run, other)
    assert metrics.side(run) == kept_by_compass(run, other)


vectors = st.tuples(st.floats(-9, 9), st.floats(-9, 9)).map(np.array)


@settings(max_examples=200, deadline=None)
@given(vectors, vectors, vectors)
def test_two_vessels_agree_on_their_encounter(position: np.ndarray, own: np.ndarray, other: np.ndarray) -> None:
    """One overtakes the other; seen in a mirror, who gives way stands on."""
    assume(min(np.linalg.norm(x) for x in (position, own, other)) > 0.1)
    mine, theirs = encounter(position, own, other), encounter(-position, other, own)
    if "none" in (mine, theirs):
        assert mine == theirs
    if mine == "overtaking" and theirs != "head-on":
        assert theirs == "overtaken"
    mirror, swapped = np.array([-1.0, 1.0]), {"give-way": "stand-on", "stand-on": "give-way"}
    assume(abs(position[0] * own[1] - position[1] * own[0]) > 1e-9)
    assert encounter(mirror * position, mirror * own, mirror * other) == swapped.get(mine, mine)


def test_a_vessel_without_others_keeps_all_sides() -> None:
    """Nor has a vessel at rest, or one that does not exist during the run, a side."""
    run = ships(1)
    rock = Obstacle(disc_or_ball(1.0, 2), Stationary((0.0, 9.0)))
    assert metrics.side(replace(run, obstacles=())) == metrics.side(replace(run, obstacles=(rock,))) == 1.0
    assert metrics.loss_of_well_clear(replace(run, obstacles=())) == 0.0


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-5000, 5000), min_size=6, max_size=6))
def test_well_clear_is_that_of_the_definition(numbers: list[float]) -> None:
    """In plain numbers; it is the same for both aircraft, and with equal heights that of the plane."""
    s, v = np.array(numbers[:3]) * (1, 1, 0.1), np.array(numbers[3:]) / 20.0
    square, approach = s[0] ** 2 + s[1] ** 2, s[0] * v[0] + s[1] * v[1]
    lost = square <= WELL_CLEAR.distance**2
    if not lost and approach < 0.0:
        until = -approach / (v[0] ** 2 + v[1] ** 2)
        miss = math.hypot(s[0] + until * v[0], s[1] + until * v[1])
        lost = miss <= WELL_CLEAR.distance and (WELL_CLEAR.distance**2 - square) / approach <= WELL_CLEAR.time
    level = abs(s[2]) <= WELL_CLEAR.height
    assert not_well_clear(s[None], v[None])[0] == not_well_clear(-s[None], -v[None])[0] == (lost and level)
    assert not_well_clear(s[None, :2], v[None, :2])[0] == lost


def test_well_clear_is_lost_when_daidalus_says() -> None:
    """Its regression output for H1 has the volume after 165.27 s, of a globe."""
    scenario = load(str(sample_data("daidalus.yaml")), seed=3)
    straight = driven(
        np.zeros((400, 2)),
        position=tuple(scenario.robot.state.position),
        speed=tuple(scenario.robot.state.velocity),
        obstacles=scenario.obstacles,
    )
    path = scenario.obstacles[0].trajectory
    times = np.arange(0.0, 200.0, 0.01)
    position = path.position(times) - straight.velocities[0, 0] * times[:, None]
    velocity = np.broadcast_to(path.initial_velocity - straight.velocities[0, 0], position.shape)
    first = times[np.flatnonzero(not_well_clear(position, velocity))[0]]
    assert first == pytest.approx(165.27, abs=0.1)
    # Until the distance is 1222.32 m again, behind the passing after 200.5 s.
    after = 200.5 + math.sqrt(1222.32**2 - 262.0**2) / (800 * KNOT)
    assert metrics.loss_of_well_clear(straight) == pytest.approx(after - first, abs=2 * CLEAR_STEP)


@pytest.mark.parametrize("case", range(4))
def test_intruders_of_daidalus_are_the_volume_of_well_clear(case: int) -> None:
    """At the initial velocities no place outside of the obstacle, grown by robot and margin, is one without."""
    scenario = load(str(sample_data("daidalus.yaml")), seed=case)
    (intruder,) = scenario.obstacles
    relative = intruder.trajectory.initial_velocity - scenario.robot.state.velocity
    places = np.random.default_rng(case).uniform(-18000.0, 18000.0, (40_000, 2))
    lost = not_well_clear(-places, np.broadcast_to(relative, places.shape))
    ends, axis = np.array(intruder.shape.parts[0].corners), relative / np.linalg.norm(relative)
    assert axis @ (ends[1] - ends[0]) == pytest.approx(35.0 * np.linalg.norm(relative), rel=1e-4)
    along = np.clip(places @ axis, 0.0, float(axis @ ends[1]))
    distance = np.linalg.norm(places - along[:, None] * axis, axis=1)
    assert lost.sum() > 100
    assert np.all(
        distance[lost] < intruder.shape.parts[0].radius + scenario.robot.shape.bounding_radius + scenario.margin
    )


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
    assert metrics.closest_approach(run) < 845.0


def test_every_case_is_a_seed(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(CASES)
    assert count_of_cases(path) == 3
    table = compare(str(path), ["nao"], 3, metrics=["closest_approach"])
    alone = [simulate(read_scenario(path, k), method("nao"), seed=k) for k in range(3)]
    nearest = [metrics.closest_approach(run) for run in alone]
    found = table["methods"]["nao"]["metrics"]["closest_approach"]
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


@pytest.mark.skipif(not DNV.exists(), reason="the encounters of DNV are not here")
def test_encounters_of_dnv_become_cases(tmp_path: Path) -> None:
    """Each ship keeps the course and speed of its row, and the own ship has the goal of its row."""
    target = tmp_path / "new" / "dnv.yaml"
    dnv_encounters.write(DNV, target)
    with DNV.open(newline="") as file:
        rows = list(csv.DictReader(file))
    for k, scenario in zip(range(20), read_scenarios(target), strict=True):
        own, *others = [row for row in rows if row["case"] == str(k + 1)]
        assert scenario.robot.goal.position(0.0).tolist() == [float(own["goal_x"]), float(own["goal_y"])]
        for ship, row in zip(scenario.obstacles, others, strict=True):
            v = ship.trajectory.initial_velocity
            assert turned(compass(*v) - float(row["course_deg"])) == pytest.approx(0.0, abs=1e-9)
            assert math.hypot(*v) == pytest.approx(float(row["speed"]))
