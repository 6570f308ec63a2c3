"""Scenario files: what they say is what is run, and every mistake is named at once with its place."""

import re
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from draws import examples
from hypothesis import given, strategies as st
from scenario_texts import EVERYTHING, GROUP

from slalom import (
    METHODS,
    Ball,
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    Disc,
    InvalidFile,
    InvalidInput,
    Sampled,
    Sight,
    Stationary,
    method as method_named,
)
from slalom.model.bounds import BOUNDS
from slalom.model.shape import SHAPES
from slalom.model.trajectory import TRAJECTORIES
from slalom.sim import Scenario, load, read_scenario, simulate
from slalom.sim.files.scenario_writer import scenario_text
from slalom.sim.files.schema import ScenarioSpec

ROBOT = "robot: {position: [0, 0], radius: 1, max_speed: 2, max_acceleration: 1, goal: {position: [20, 0]}}\n"


BLOCK = "robot:\n  position: {}\n  radius: 1\n  max_speed: 2\n  max_acceleration: 1\n  goal: {{position: {}}}\n"


def write(folder: Path, content: str | bytes, name: str = "scenario.yaml") -> Path:
    """A file of this content."""
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def mistakes(folder: Path, content: str | bytes) -> list[str]:
    """What is wrong with a file of this content."""
    with pytest.raises(InvalidFile) as caught:
        read_scenario(write(folder, content))
    assert caught.value.mistakes
    assert not any("\n" in line for line in caught.value.mistakes)
    return caught.value.mistakes


def check(folder: Path, marked: str, *expected: str) -> None:
    """Every @ in the text marks the place of a mistake; `expected` are their messages, in the order of the places."""
    places, content = [], ""
    for part in re.split("(@)", marked):
        if part == "@":
            places.append((content.count("\n") + 1, len(content) - content.rfind("\n")))
        else:
            content += part
    prefix = folder / "scenario.yaml"
    wanted = [f"{prefix}:{line}:{column}: {text}" for (line, column), text in zip(places, expected, strict=True)]
    assert mistakes(folder, content) == wanted


def test_everything_is_read(tmp_path: Path) -> None:
    write(tmp_path, "t,id,x,y\n0,4,30,0\n9,4,31,0\n0,2,30,5\n9,2,31,5\n", "tracks.csv")
    scenario = read_scenario(write(tmp_path, EVERYTHING))
    # A file has one robot: it does not say what matters among several.
    found = {name: value for name, value in scenario.settings.items() if name in ScenarioSpec.model_fields}
    assert found == {
        "start": 1.5,
        "duration": 12.0,
        "dt": 0.05,
        "replan": 0.2,
        "horizon": 4.0,
        "margin": 0.1,
        "patience": 0.3,
        "guided": 0.0,
        "early": 1.0,
        "sight_range": 9.0,
        "field_of_view": 4.0,
        "sight_near": 1.0,
        "occlusion": 2.0,
        "hidden_speed": 1.2,
        "passive_safety": 1.0,
        "entry_time": 2.0,
    }
    assert (scenario.name, scenario.holds) == ("everything", (0.5, 1.0))
    robot = scenario.robot
    assert robot.shape == Disc(0.4)
    assert robot.state.velocity.tolist() == [1.0, -1.0]
    assert (robot.limits.max_speed, robot.limits.max_acceleration) == (2.5, 1.5)
    (velocity,), (acceleration,) = robot.limits.velocity_bounds, robot.limits.acceleration_bounds
    assert (velocity.normal.tolist(), velocity.offset) == ([-1.0, 0.0], 0.5)
    assert (acceleration.normal.tolist(), acceleration.offset) == ([0.0, 1.0], 1.25)
    assert [type(bound) for bound in robot.limits.bounds] == list(BOUNDS.values())
    friction, box, polygon, cone, turning, least = robot.limits.bounds
    assert (friction.forward, friction.braking, friction.lateral) == (1.0, 1.5, 0.75)
    assert friction.heading.tolist() == [0.0, 1.0]
    assert (box.half_widths.tolist(), box.frame) == ([1.0, 2.0], "body")
    assert (polygon.corners.tolist(), polygon.frame) == ([[1, 0], [0, 1], [-2, 0], [0, -1]], "world")
    assert (cone.half_angle, turning.least, least.least) == (1.5, 0.5, 0.25)
    assert (robot.goal.tolerance, robot.goal.stop) == (0.3, True)
    assert robot.goal.trajectory.velocity(0.0).tolist() == [0.0, 0.1]
    kinds = [type(o.trajectory) for o in scenario.obstacles]
    assert kinds == [Stationary, ConstantVelocity, ConstantAcceleration, Circular, *[Sampled] * 4]
    names = [o.name for o in scenario.obstacles]
    assert names == ["rock", *(f"obstacle {k}" for k in range(1, 6)), "agent 2", "agent 4"]
    assert [o.shape.radius for o in scenario.obstacles] == [1.0, 0.5, 0.6, 0.7, 0.0, 1.0, 0.25, 0.25]
    _, line, parabola, circle, smooth, linear, *_ = (o.trajectory for o in scenario.obstacles)
    assert line.position(2.0).tolist() == [9.0, 0.0]
    assert parabola.position(-1.0).tolist() == [3.0, -9.0]
    assert parabola.acceleration(0.0).tolist() == [0.1, 0.0]
    assert circle.position(0.0) == pytest.approx([10 + 3 * np.cos(0.5), 3 * np.sin(0.5)])
    assert circle.rate == -1 / 3
    assert (smooth.interpolation, linear.interpolation) == ("smooth", "linear")
    assert scenario.obstacles[-1].trajectory.interpolation == "linear"
    # A robot that must not stop has no passive safety.
    recording = simulate(scenario.with_settings({"passive_safety": 0.0}), METHODS["nao"])
    assert len(recording.accelerations) > 0


def test_every_kind_of_trajectory_has_its_words(tmp_path: Path) -> None:
    """What recordings can hold, scenario files can say."""
    (one,) = mistakes(tmp_path, ROBOT + "obstacles: [{radius: 1, trajectory: {kind: x}}]\n")
    assert set(re.findall(r"'(\w+)'", one)) - {"x"} == set(TRAJECTORIES)


def test_mistakes_in_bounds(tmp_path: Path) -> None:
    """What is written wrong, what a bound itself refuses, and what does not fit the robot: at its place."""
    kinds = ", ".join(f"{name!r}" for name in BOUNDS)
    check(
        tmp_path,
        BLOCK.format("[0, 0]", "[20, 0]")
        + """\
  bounds:
    - @{kind: friction, forward: 1, braking: @-1}
    - {kind: turning_radius, least: 1, @leest: 2}
    - @{kind: ellipse}
    - @{kind: convex_polygon, corners: [[1, 0], [0, 1]]}
    - @{kind: heading_cone, half_angle: 2}
    - {kind: box, half_widths: [1, 1], frame: @body-fixed}
""",
        "robot.bounds.0.lateral: expected this key, found none",
        "robot.bounds.0.braking: expected a number above 0, found -1",
        "robot.bounds.1.leest: expected one of kind, least, heading; found 'leest'; did you mean 'least'?",
        f"robot.bounds.2: expected a kind among {kinds}, found 'ellipse'",
        "robot.bounds.3: corners: expected an array (n, 2) with n >= 3, found shape (2, 2)",
        "robot.bounds.4: half_angle: expected at most pi / 2, found 2",
        "robot.bounds.5.frame: expected 'world' or 'body', found 'body-fixed'",
    )


def test_the_least_that_a_file_says(tmp_path: Path) -> None:
    """Everything else is as in `Scenario`; a robot without a velocity is at rest; the name is that of the file."""
    scenario = read_scenario(write(tmp_path, ROBOT, "plain.yml"))
    assert scenario.name == "plain"
    assert scenario.robot.state.velocity.tolist() == [0.0, 0.0]
    plain = Scenario("plain", (scenario.robot,))
    assert (scenario.settings, scenario.holds) == (plain.settings, plain.holds)
    assert isinstance(scenario.robot.goal.trajectory, Stationary)
    assert scenario.robot.goal.tolerance == 0.5


def test_space(tmp_path: Path) -> None:
    write(tmp_path, "t,id,x,y,z\n0,4,30,0,1\n9,4,31,0,1\n", "tracks.csv")
    content = ROBOT.replace("[0, 0]", "[0, 0, 0]").replace("[20, 0]", "[20, 0, 5]") + (
        "obstacles: [{radius: 1, trajectory: {kind: circular, center: [9, 0, 0], radius: 2, speed: 1, "
        "normal: [1, 0, 0]}}]\nrecording: {file: tracks.csv, radius: 1}\n"
    )
    scenario = read_scenario(write(tmp_path, content))
    assert scenario.robot.shape == Ball(1)
    assert [o.dimension for o in scenario.obstacles] == [3, 3]
    assert scenario.obstacles[0].trajectory.normal.tolist() == [1.0, 0.0, 0.0]


def test_load_takes_files_and_settings(tmp_path: Path) -> None:
    path = str(write(tmp_path, ROBOT))
    assert load(path, {"margin": 0.2}).margin == 0.2
    with pytest.raises(InvalidInput, match=r"setting: expected one of .*found 'speed'"):
        load(path, {"speed": 1.0})


MISTAKEN = """\
name: many mistakes
robot:
  position: [0, @zero]
  @radus: 1
  radius: @-0.5
  max_speed: @fast
  max_acceleration: @0
  velocity_bounds:
    - @{normal: [1, 0], @offsett: 2}
  goal:
    position: @[20]
    stop: @perhaps
obstacles:
  - radius: 1
    trajectory: @{kind: circle, center: [0, 0]}
  - radius: @.inf
    trajectory:
      @kind: circular
      center: @[1, 2, 3, 4]
      @raduis: 3
      speed: @[1]
  - @trajectory: {kind: constant_velocity, position: [1, 1], velocity: [1, 0], @att: 3}
  - radius: 1
    trajectory: @{position: [1, 1]}
  - radius: 1
    trajectory: {kind: sampled, times: @3, positions: [[0, 0], @[1]], interpolation: @cubic}
  - @7
recording: @{radius: 1}
dt: @0
horizon: @-1
holds: @[]
@durration: 5
"""
IN_ROBOT = (
    "shape, radius, name, method, margin, priority, velocity, max_speed, max_acceleration, velocity_bounds, "
    "acceleration_bounds, bounds, objective, appears, position, goal"
)
AT_TOP = (
    "name, robot, areas, flows, tasks, robots, obstacles, recording, walls, walls_unit, walls_up, start, duration, dt, "
    "replan, horizon, margin, patience, holds, guided, "
    "early, sight_range, field_of_view, sight_near, occlusion, hidden_speed, passive_safety, entry_time"
)
IN_RECORDING = (
    "file, format, radius, agents, without, window, interpolation, gap, jump_speed, frame_rate, unit, time_unit, "
    "keep, encoding, case, columns, origin, epoch, altitude_unit"
)
KINDS = ", ".join(f"{name!r}" for name in TRAJECTORIES)


def test_all_mistakes_at_once(tmp_path: Path) -> None:
    """Typos, wrong types, numbers out of range, missing keys, unknown kinds: the place, the key, what was expected."""
    check(
        tmp_path,
        MISTAKEN,
        "robot.position.1: expected a number, found 'zero'",
        f"robot.radus: expected one of {IN_ROBOT}; found 'radus'; did you mean 'radius'?",
        "robot.radius: expected 0 or more, found -0.5",
        "robot.max_speed: expected a number, found 'fast'",
        "robot.max_acceleration: expected a number above 0, found 0",
        "robot.velocity_bounds.0.offset: expected this key, found none",
        "robot.velocity_bounds.0.offsett: expected one of normal, offset; found 'offsett'; did you mean 'offset'?",
        "robot.goal.position: expected at least 2 entries, found 1",
        "robot.goal.stop: expected true or false, found 'perhaps'",
        f"obstacles.0.trajectory: expected a kind among {KINDS}, found 'circle'; did you mean 'circular'?",
        "obstacles.1.radius: expected a finite number, found inf",
        "obstacles.1.trajectory.radius: expected this key, found none",
        "obstacles.1.trajectory.center: expected at most 3 entries, found 4",
        "obstacles.1.trajectory.raduis: expected one of kind, center, radius, speed, phase, normal; found 'raduis'; "
        "did you mean 'radius'?",
        "obstacles.1.trajectory.speed: expected a number, found [1]",
        "obstacles.2.radius: expected either this key or shape, found neither",
        "obstacles.2.trajectory.att: expected one of kind, position, velocity, at; found 'att'; did you mean 'at'?",
        "obstacles.3.trajectory: expected a key 'kind', found none",
        "obstacles.4.trajectory.times: expected a list, found 3",
        "obstacles.4.trajectory.positions.1: expected at least 2 entries, found 1",
        "obstacles.4.trajectory.interpolation: expected 'linear' or 'smooth', found 'cubic'",
        "obstacles.5: expected a mapping with the keys shape, radius, name, heading, uncertainty, "
        "after_end, contact_at_rest, owner, trajectory; found 7",
        "recording.file: expected this key, found none",
        "dt: expected a number above 0, found 0",
        "horizon: expected a number above 0, found -1",
        "holds: expected at least 1 entries, found 0",
        f"durration: expected one of {AT_TOP}; found 'durration'; did you mean 'duration'?",
    )


def test_values_that_do_not_go_together_all_at_once(tmp_path: Path) -> None:
    """Dimensions, times that go backwards or repeat, directions of length 0: at the value that is wrong."""
    check(
        tmp_path,
        """\
robot:
  position: [0, 0]
  velocity: @[1, 0, 0]
  radius: 1
  max_speed: 2
  max_acceleration: 1
  velocity_bounds:
    - {normal: [1, 0], offset: 1}
    - @{normal: [0, 0], offset: 1}
  goal: @{position: [20, 0], trajectory: {kind: stationary, position: [1, 1]}}
obstacles:
  - radius: 1
    trajectory: @{kind: stationary, position: [9, 0, 0]}
  - radius: 1
    trajectory: @{kind: sampled, times: [0, 2, 1], positions: [[0, 0], [1, 0], [2, 0]]}
  - radius: 1
    trajectory: @{kind: sampled, times: [0, 1, 1], positions: [[0, 0], [1, 0], [2, 0]]}
  - radius: 1
    trajectory: @{kind: circular, center: [0, 0], radius: 3, speed: 1, normal: [0, 0, 1]}
  - radius: 1
    trajectory: @{kind: constant_velocity, position: [0, 0], velocity: [0, 0, 0]}
  - radius: 1
    trajectory: @{kind: sampled, times: [0], positions: [[0, 0]]}
replan: @0.25
""",
        "robot.velocity: expected 2 numbers, found [1, 0, 0] of shape (3,)",
        "robot.velocity_bounds.1: normal: expected a direction, found the zero vector",
        "robot.goal: expected one of position, trajectory, path, found position and trajectory",
        "obstacles.0.trajectory: obstacle 'obstacle 0': expected shape and trajectory of the same dimension, "
        "found 2 and 3",
        "obstacles.1.trajectory: times: expected increasing times, found 2 followed by 1 at index 2",
        "obstacles.2.trajectory: times: expected increasing times, found 1 followed by 1 at index 2",
        "obstacles.3.trajectory: normal: expected none for a circle in the plane, found one",
        "obstacles.4.trajectory: velocity: expected 2 numbers, found [0, 0, 0] of shape (3,)",
        "obstacles.5.trajectory: times: expected at least two samples, found 1",
        "replan: expected a multiple of dt = 0.1 s, found 0.25 s",
    )


def test_a_value_in_place_of_a_mapping(tmp_path: Path) -> None:
    """The message names the keys of the mapping, also of a part, whose kind is unknown."""
    check(
        tmp_path,
        "robot: {position: [0, 0], shape: @poligon, max_speed: 2, max_acceleration: 1,\n"
        "  goal: {path: @[[0, 0], [1, 0]]}}\n"
        "obstacles: [{shape: @{kind: poligon}, trajectory: {kind: stationary, position: [9, 0]}}]\n",
        "robot.shape: expected a mapping with the key kind; found 'poligon'",
        "robot.goal.path: expected a mapping with the keys points, speeds, lookahead, laps, cut; "
        "found [[0, 0], [1, 0]]",
        f"obstacles.0.shape: expected a kind among {', '.join(map(repr, SHAPES))}, found 'poligon'; "
        "did you mean 'polygon'?",
    )
    (one,) = mistakes(tmp_path, "[1]\n")
    assert one.endswith(":1:1: expected a mapping, found [1]")


def test_a_goal_inside_an_obstacle(tmp_path: Path) -> None:
    """Refused at the goal, if the obstacle rests there for ever."""
    (one,) = mistakes(
        tmp_path, ROBOT + "obstacles: [{name: lid, radius: 3, trajectory: {kind: stationary, position: [21, 0]}}]\n"
    )
    assert "scenario.yaml:1:79: robot.goal: expected a position that the robot can reach" in one
    assert "'lid'" in one


CROWD = """\
margin: 0.1
robots:
  - {name: first, position: [0, 0], velocity: [1, 0], radius: 0.4, max_speed: 2, max_acceleration: 1,
     goal: {position: [9, 0]}, method: rvo, margin: 0.3, priority: 2}
  - {position: [9, 0.2], radius: 0.3, max_speed: 1, max_acceleration: 2, goal: {position: [0, 0.2], stop: true}}
"""


def test_robots_with_methods_of_their_own(tmp_path: Path) -> None:
    """Each decides by its method; the others by that of the run."""
    scenario = read_scenario(write(tmp_path, CROWD))
    first, second = scenario.robots
    assert (first.name, first.method, first.margin, first.priority) == ("first", METHODS["rvo"], 0.3, 2.0)
    assert (second.name, second.method, second.margin, second.priority) == ("robot 1", None, None, 1.0)
    run = simulate(replace(scenario, duration=3.0), METHODS["nao"])
    assert run.method == "rvo+nao"
    assert {type(row[0]).__name__ for row in run.responses.rows[1:]} == {"Velocity"}
    assert {type(row[1]).__name__ for row in run.responses.rows[1:]} <= {"AccelerateThenCoast", "AccelerateThenBrake"}


def test_mistakes_in_a_list_of_robots(tmp_path: Path) -> None:
    one = "position: [0, 0], radius: 1, max_speed: 2, max_acceleration: 1, goal: {position: [20, 0]}"
    check(
        tmp_path,
        f"robots:\n- {{{one}, method: @novo}}\n- {{name: robot 0, margin: @-1, {one}}}\n".replace("name: r", "name: @r")
        + "- {position: @[0, 0, 0], radius: 1, max_speed: 2, max_acceleration: 1, goal: {position: [2, 0, 0]}}\n",
        f"robots.0.method: expected one of {', '.join(METHODS)}; found 'novo'; did you mean 'nlvo'?",
        "robots.1.name: expected a name for each robot, found 'robot 0' again",
        "robots.1.margin: expected 0 or more, found -1",
        "robots.2.position: expected 2 numbers, found [0, 0, 0] of shape (3,)",
    )


def test_either_a_robot_or_robots(tmp_path: Path) -> None:
    (one,) = mistakes(tmp_path, ROBOT + CROWD)
    assert "robots: expected either this key or robot, found both" in one


ONE_BY_ONE = """\
duration: 2
robots:
  - {name: guard, position: [0, -9], radius: 0.4, max_speed: 1, max_acceleration: 1, goal: {position: [0, -3]}}
  - {name: courier 0, position: [0, 0], radius: 0.2, priority: 4, goal: {position: [8, 1], &goal stop: true}, *shared}
  - {name: courier 1, position: [0, 3], radius: 0.3, priority: 3, goal: {position: [8, 4], *goal}, *shared}
  - {name: slow, position: [0, 6], shape: {kind: rectangle, length: 0.6, width: 0.4}, priority: 2,
     goal: {position: [8, 8]}, *slow}
  - {name: courier 3, position: [0, 9], radius: 0.5, priority: 1, goal: {position: [8, 10], *goal}, *shared}
"""
SHARED = "method: rvo, max_speed: 1.5, max_acceleration: 2, bounds: [{kind: turning_radius, least: 0.5}]"
ONE_BY_ONE = (
    ONE_BY_ONE.replace("&goal stop: true", "*goal")
    .replace("*goal", "stop: true, tolerance: 0.25")
    .replace("*shared", SHARED)
    .replace("*slow", SHARED.replace("1.5", "0.75"))
)


def test_a_group_is_its_robots_written_one_by_one(tmp_path: Path) -> None:
    """With ranges and an override: the same scenario as text, and the same run to the bit."""
    group, single = (read_scenario(write(tmp_path, text, "fleet.yaml")) for text in (GROUP, ONE_BY_ONE))
    assert scenario_text(group) == scenario_text(single)
    assert simulate(group, METHODS["nao"]).digest() == simulate(single, METHODS["nao"]).digest()
    assert [robot.shape.bounding_radius for robot in group.robots][1:3] == [0.2, pytest.approx(0.3)]


def grouped(folder: Path, count: int, positions: str, goals: str, more: str = "") -> np.ndarray:
    """Starts and goals (2, count, d) of a group with these patterns."""
    text = f"robots:\n- {{count: {count}, radius: 0.2, max_speed: 1, max_acceleration: 1, positions: {{{positions}}}, "
    scenario = read_scenario(write(folder, f"{text}goals: {{{goals}}}{more}}}\n"))
    assert [robot.name for robot in scenario.robots] == [f"robot {k}" for k in range(count)]
    starts = [robot.state.position for robot in scenario.robots]
    return np.array([starts, [robot.goal.trajectory.position(0.0) for robot in scenario.robots]])


def test_patterns(tmp_path: Path) -> None:
    """Each by its definition: on a circle and antipodal, on a line and swapped, in rows and displaced, in space."""
    starts, goals = grouped(
        tmp_path, 6, "kind: circle, center: [1, 2], radius: 5, phase: 0.5", "kind: opposite, center: [1, 2]"
    )
    assert np.hypot(*(starts - (1, 2)).T) == pytest.approx(np.full(6, 5.0))
    assert np.linalg.norm(np.roll(starts, 1, axis=0) - starts, axis=1) == pytest.approx(np.full(6, 5.0))
    assert starts[0] == pytest.approx([1 + 5 * np.cos(0.5), 2 + 5 * np.sin(0.5)])
    assert goals == pytest.approx(np.roll(starts, 3, axis=0))
    starts, goals = grouped(tmp_path, 4, "kind: line, first: [0, 0, 1], last: [6, 0, 4]", "kind: swap")
    assert starts.tolist() == [[0, 0, 1], [2, 0, 2], [4, 0, 3], [6, 0, 4]]
    assert goals.tolist() == starts[::-1].tolist()
    starts, goals = grouped(
        tmp_path, 5, "kind: grid, corner: [1, 1], spacing: 2, columns: 3", "kind: displaced, by: [0, 9]"
    )
    assert starts.tolist() == [[1, 1], [3, 1], [5, 1], [1, 3], [3, 3]]
    assert (goals - starts).tolist() == [[0, 9]] * 5


@given(st.integers(0, 2**31), st.integers(1, 12), st.sampled_from([2, 3]), st.floats(0.0, 2.0))
@examples(15)
def test_random_boxes(seed: int, count: int, d: int, apart: float) -> None:
    """Within the box, at least so far apart, the same bits for the same seed, goals independent of starts."""
    low, high = [-4.0] * d, [9.0] * d
    box = f"kind: box, low: {low}, high: {high}, min_distance: {apart}, seed: {seed}"
    with TemporaryDirectory() as folder:
        found, again = (grouped(Path(folder), count, box, box) for _ in range(2))
        other = grouped(Path(folder), count, box, box.replace(f"seed: {seed}", f"seed: {seed + 1}"))
    assert found.tobytes() == again.tobytes()
    assert found[0].tobytes() == other[0].tobytes() != found[1].tobytes() != other[1].tobytes()
    assert np.all((found >= low) & (found <= high))
    for places in found:
        gaps = np.linalg.norm(places[:, None] - places, axis=-1)[~np.eye(count, dtype=bool)]
        assert np.all(gaps >= apart)


def test_random_ranges(tmp_path: Path) -> None:
    """Between both ends, the same for the same seed; two keys draw independently."""
    drawn = [
        [(robot.limits.max_speed, robot.limits.max_acceleration) for robot in read_scenario(path).robots]
        for path in (
            write(tmp_path, GROUP.replace("max_speed: 1.5\n", line), "g.yaml")
            for line in ["max_speed: {first: 2, last: 1, seed: 7}\n"] * 2
            + ["max_speed: {first: 1, last: 2, seed: 8}\n"]
        )
    ]
    assert drawn[0] == drawn[1] != drawn[2]
    free = [speed for k, (speed, _) in enumerate(drawn[0]) if k not in (0, 3)]
    assert len({*free}) == 3
    assert all(1 <= speed <= 2 for speed in free)


def test_mistakes_in_groups(tmp_path: Path) -> None:
    """At the place in the group, once and not for each robot."""
    shared = "radius: 1, max_speed: 2, max_acceleration: 1"
    line, stay = "{kind: line, first: [0, 0], last: [9, 0]}", "{kind: displaced, by: [0, 9]}"
    check(
        tmp_path,
        f"""\
robots:
- {{count: @0, {shared}, positions: @{{kind: spiral}}, goals: {{kind: swap, @center: [0, 0]}}}}
- {{count: 3, {shared}, positions: {line}, goals: @{{kind: swap}}}}
- {{count: 90, {shared}, positions: @{{kind: box, low: [0, 0], high: [5, 5], min_distance: 2}}, goals: {stay}}}
- {{count: 3, {shared}, positions: {line}, goals: @{{kind: opposite, center: [0, 0, 0]}}}}
- count: 3
  name: b
  radius: @{{first: 1, @lost: 2}}
  max_speed: {{first: @0, last: 2}}
  max_acceleration: @fast
  positions: {line}
  goals: {stay}
  overrides: [{{robot: 0, max_speed: @-1}}]
""",
        "robots.0.count: expected 1 or more, found 0",
        "robots.0.positions: expected a kind among 'circle', 'line', 'grid', 'box', 'polygon', found 'spiral'",
        "robots.0.goals.center: expected one of kind; found 'center'",
        "robots.1.goals: expected an even count of robots that exchange places, found 3",
        "robots.2.positions: expected space for 90, 2 m apart, in 5 m x 5 m; found space for 7",
        "robots.3.goals: center: expected 2 numbers, found [0, 0, 0] of shape (3,)",
        "robots.4.radius.last: expected this key, found none",
        "robots.4.radius.lost: expected one of first, last, seed; found 'lost'; did you mean 'last'?",
        "robots.4.max_speed.first: expected a number above 0, found 0",
        "robots.4.max_acceleration: expected a number, found 'fast'",
        "robots.4.overrides.0.max_speed: expected a number above 0, found -1",
    )


@pytest.mark.parametrize(
    ("marked", "expected"),
    [
        ("{robot: @3}", "robot: expected a robot from 0 to 2, found 3"),
        ("{robot: 1}, {robot: @1}", "robot: expected one override of each robot, found 1 again"),
        (
            "{robot: 1, shape: {kind: disc, radius: 1}, radius: @1}",
            "radius: expected either this key or shape, found both",
        ),
        ("{robot: 1, position: @[0, 0, 0]}", "position: expected 2 numbers, found [0, 0, 0] of shape (3,)"),
        ("{robot: 1, velocity: @[0, 0, 0]}", "velocity: expected 2 numbers, found [0, 0, 0] of shape (3,)"),
        (
            "{robot: 1, bounds: [@{kind: box, half_widths: [1, 1, 1]}]}",
            "bounds.0: half_widths: expected 2 numbers, found [1, 1, 1]",
        ),
        (
            "{robot: 1, goal: @{position: [0, 0, 0]}}",
            "goal: robot 1.goal: expected dimension 2 as of the state, found 3",
        ),
    ],
)
def test_mistakes_in_overrides(marked: str, expected: str, tmp_path: Path) -> None:
    """At the value of the override."""
    head = "robots: [{count: 3, radius: 1, max_speed: 2, max_acceleration: 1, positions: {kind: line, first: [0, 0], "
    head += "last: [9, 0]}, goals: {kind: displaced, by: [0, 9]}, overrides: ["
    before = (head + marked).partition("@")[0]
    (one,) = mistakes(tmp_path, head + marked.replace("@", "") + "]}]\n")
    index = marked.partition("@")[0].count("{robot:") - 1
    assert one.startswith(f"{tmp_path / 'scenario.yaml'}:1:{len(before) + 1}: robots.0.overrides.{index}.{expected}")


def test_a_start_inside_an_obstacle_is_run(tmp_path: Path) -> None:
    """It has a status of its own."""
    content = ROBOT + "duration: 1\nobstacles: [{radius: 3, trajectory: {kind: stationary, position: [1, 1]}}]\n"
    recording = simulate(read_scenario(write(tmp_path, content)), METHODS["nao"])
    assert recording.outcomes[0] == ("ESCAPING",)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("margin: @true", "margin: expected a number, found True"),
        ("duration: @yesterday", "duration: expected a number, found 'yesterday'"),
        ("duration: @.nan", "duration: expected a finite number, found nan"),
        ("duration: @[3]", "duration: expected a number, found [3]"),
        ("duration: @{a: 3}", "duration: expected a number, found a mapping"),
        ("name: @5", "name: expected text, found 5"),
        ("obstacles: @{}", "obstacles: expected a list, found a mapping"),
        ("obstacles: @none", "obstacles: expected a list, found 'none'"),
        ("recording: @tracks.csv", f"recording: expected a mapping with the keys {IN_RECORDING}; found 'tracks.csv'"),
        ("holds: [1, @-1]", "holds.1: expected a number above 0, found -1"),
        ("patience: @-0.1", "patience: expected 0 or more, found -0.1"),
        ("guided: @0", "guided: expected true or false, found 0"),
        ("@Margin: 1", f"Margin: expected one of {AT_TOP}; found 'Margin'; did you mean 'margin'?"),
        ("@xyz: 1", f"xyz: expected one of {AT_TOP}; found 'xyz'"),
    ],
)
def test_one_mistake(line: str, expected: str, tmp_path: Path) -> None:
    check(tmp_path, ROBOT + line + "\n", expected)


def test_a_value_that_is_left_out(tmp_path: Path) -> None:
    """The line is that of the key, not of what follows."""
    (one,) = mistakes(tmp_path, ROBOT + "duration:\nhorizon: 3\n")
    assert re.search(r"scenario\.yaml:2:\d+: duration: expected a number, found None", one)


@pytest.mark.parametrize(
    ("marked", "expected"),
    [
        ("robot:\n  position: [0, 0\n  radius@: 1\n", r"expected ',' or '\]', but got ':'"),
        ("name: a\nrobot:\n  radius: 1\n@name: b\n", 'found duplicate key "name"'),
        ("robot:\n  radius: 1\n  @radius: 2\n", 'found duplicate key "radius"'),
        ("name: @*nobody\n", "found undefined alias 'nobody'"),
        ("name: @!secret x\n", "could not determine a constructor for the tag '!secret'"),
        ("name: @!!python/object/apply:os.getcwd []\n", "could not determine a constructor"),
        ("name: a\n@---\nname: b\n", "found another document"),
        ("name:\n@\tx: 1\n", "cannot start any token"),
        ('name: "abc@', "found unexpected end of stream"),
    ],
)
def test_what_is_not_yaml(marked: str, expected: str, tmp_path: Path) -> None:
    line, column = (
        marked[: marked.index("@")].count("\n") + 1,
        marked.index("@") - marked.rfind("\n", 0, marked.index("@")),
    )
    (one,) = mistakes(tmp_path, marked.replace("@", ""))
    assert one.startswith(f"{tmp_path / 'scenario.yaml'}:{line}:{column}: expected YAML, found a mistake: ")
    assert re.search(expected, one)


@pytest.mark.parametrize(
    "content", ["", "# nothing but a comment\n", "---\n", "- 1\n- 2\n", "just text\n", "5\n", "~\n"]
)
def test_what_is_no_mapping(content: str, tmp_path: Path) -> None:
    (one,) = mistakes(tmp_path, content)
    assert re.search(r"scenario\.yaml:\d+:\d+: expected a mapping, found ", one)


@pytest.mark.parametrize("content", [b"\xff\xfe\x00\x01", b"name: a\x00b\n", b"name: \x07\n", b"\x89HDF\r\n\x1a\n" * 9])
def test_what_is_no_text(content: bytes, tmp_path: Path) -> None:
    (one,) = mistakes(tmp_path, content)
    assert re.search(r"scenario\.yaml(:\d+:\d+)?: expected (a readable )?YAML.*, found ", one)


@pytest.mark.parametrize("content", ["1: 2\n", "? [a, b]\n: 3\n", "a: &a [*a]\n", "robot: &a {x: *a}\n", "<<: [1]\n"])
def test_strange_yaml_is_a_mistake_too(content: str, tmp_path: Path) -> None:
    """Keys that are no text, things that contain themselves, merges of nothing."""
    assert all("expected" in line or "Keys should be strings" in line for line in mistakes(tmp_path, content))


def test_recordings_that_are_not_there_or_do_not_fit(tmp_path: Path) -> None:
    """Beside the scenario file, not where the program runs."""
    (one,) = mistakes(tmp_path, ROBOT + "recording: {file: none.csv, radius: 1}\n")
    assert "none.csv: expected a readable file, found " in one
    write(tmp_path, "t,id,x,y\n0,1,0,left\n1,1,?,0\n", "bad.csv")
    assert [
        line.split("bad.csv")[1] for line in mistakes(tmp_path, ROBOT + "recording: {file: bad.csv, radius: 1}\n")
    ] == [":2: y: expected a number, found 'left'", ":3: x: expected a number, found '?'"]
    write(tmp_path, "t,id,x,y,z\n" + "".join(f"{t},{k},9,{9 + k},0\n" for k in range(30) for t in (0, 1)), "space.csv")
    found = mistakes(tmp_path, ROBOT + "recording: {file: space.csv, radius: 1}\n")
    assert all("scenario.yaml:2:12: recording: " in line and "found 2 and 3" in line for line in found)


TRACKS = "t,id,x,y,radius\n" + "".join(
    f"{t},{agent},{agent},{t},{0.5 if agent == 3 else ''}\n"
    for agent, times in ((1, range(31)), (2, range(10, 21)), (3, range(5, 100)), (40, range(60, 90)))
    for t in times
)
"""Agent 1 from 0 to 30 s, 2 from 10 to 20 s, 3, which has a radius, from 5 to 99 s, 40 from 60 to 89 s."""


def test_a_window_is_what_is_run(tmp_path: Path) -> None:
    """It begins and ends the run if nothing else does; people present in it, whole, or predicted to come."""
    write(tmp_path, TRACKS, "tracks.csv")
    scenario = read_scenario(write(tmp_path, ROBOT + "recording: {file: tracks.csv, window: [12, 40]}\n"))
    assert (scenario.start, scenario.duration, scenario.recorded) == (12.0, 28.0, (12.0, 40.0))
    assert [o.name for o in scenario.obstacles] == ["agent 1", "agent 2", "agent 3"]
    assert [o.trajectory.span for o in scenario.obstacles] == [(0.0, 30.0), (10.0, 20.0), (5.0, 99.0)]
    wide = read_scenario(write(tmp_path, ROBOT + "start: 15\nrecording: {file: tracks.csv, window: [12, 54]}\n"))
    assert (wide.start, wide.duration) == (15.0, 39.0)
    assert [o.name for o in wide.obstacles][-1] == "agent 40"  # 6 s ahead are looked at
    beyond = read_scenario(write(tmp_path, ROBOT + "duration: 2\nrecording: {file: tracks.csv, window: [90, 200]}\n"))
    assert (beyond.start, beyond.duration, beyond.recorded) == (90.0, 2.0, (90.0, 99.0))
    assert load(str(tmp_path / "scenario.yaml"), {"start": 95.0}).start == 95.0
    with pytest.raises(InvalidInput, match=r"start: expected a time of the recording, from 90 to before 99 s"):
        load(str(tmp_path / "scenario.yaml"), {"start": 89.0})


@pytest.mark.parametrize("method", ["nao", "nao@observed", "nao_ahead"])
def test_a_window_changes_nothing_in_it(method: str, tmp_path: Path) -> None:
    """The run in it is that in the whole recording, to the bit."""
    write(tmp_path, TRACKS, "tracks.csv")
    robot = ROBOT.replace("[0, 0]", "[-9, 15]").replace("[20, 0]", "[9, 15]")
    parts = "start: 14\nduration: 12\nrecording: {file: tracks.csv", "}\n"
    whole, part = (read_scenario(write(tmp_path, robot + more.join(parts))) for more in ("", ", window: [13, 27]"))
    assert len(part.obstacles) < len(whole.obstacles)
    one, two = (simulate(scenario, method_named(method)) for scenario in (whole, part))
    assert {row[0] for row in one.outcomes} > {"CLEAR"}
    assert one.digest() == two.digest()


def test_agents_of_a_recording(tmp_path: Path) -> None:
    """Only these, or without those; ids as numbers or as text; the own radius of an agent before the one given."""
    write(tmp_path, TRACKS, "tracks.csv")

    def chosen(what: str) -> dict[str, float]:
        scenario = read_scenario(write(tmp_path, ROBOT + f"start: 5\nrecording: {{file: tracks.csv, {what}}}\n"))
        return {o.name: o.shape.radius for o in scenario.obstacles}

    assert chosen("radius: 0.3") == {"agent 1": 0.3, "agent 2": 0.3, "agent 3": 0.5, "agent 40": 0.3}
    assert chosen("agents: [40, '3']") == {"agent 3": 0.5, "agent 40": 0.25}
    assert chosen("without: [3, 40]") == {"agent 1": 0.25, "agent 2": 0.25}
    assert chosen("agents: [1, 2], without: [2]") == {"agent 1": 0.25}
    assert chosen("agents: []") == {}


SHIPS = """\
recording:
  file: ships.csv
  format: ais
  columns: {id: ship, latitude: north, longitude: east, width: null}
  origin: [0, 0]
  epoch: 2022-01-03T00:00:00
  interpolation: linear
"""


def test_formats_and_their_settings(tmp_path: Path) -> None:
    """A file without a header at 10 Hz; ships in columns of other names, with an origin and a time 0 like any text."""
    write(tmp_path, "".join(f"{k} 7 {k / 10} 2\n" for k in range(40)), "walk.txt")
    walk = read_scenario(write(tmp_path, ROBOT + "recording: {file: walk.txt, format: eth_ucy, frame_rate: 10}\n"))
    assert walk.recorded == (0.0, 3.9)
    assert walk.obstacles[0].trajectory.velocity(1.0) == pytest.approx([1.0, 0.0])
    assert walk.notes[1:] == ("walk.txt: size of agent 7 not known: radius 0.25 m, as of a pedestrian",)
    rows = "".join(f"2022-01-03T00:{m:02d}:00,9,0.0,{m / 1000},160,20\n" for m in range(5))
    write(tmp_path, "time,ship,north,east,length,width\n" + rows, "ships.csv")
    ships = read_scenario(write(tmp_path, ROBOT + SHIPS))
    (ship,) = ships.obstacles
    assert ships.recorded == (0.0, 240.0)
    assert ship.trajectory.position(60.0) == pytest.approx([111.32, 0.0], abs=0.01)
    assert (ship.shape.radius, ship.trajectory.interpolation) == (80.0, "linear")
    assert ships.notes[1:] == ("ships.csv: size of agent 9 not known: radius 80 m, as of a ship",)
    (ship,) = read_scenario(write(tmp_path, ROBOT + SHIPS.replace(", width: null", ""))).obstacles
    assert ship.shape.radius == pytest.approx(np.hypot(80, 10))


def test_gaps_and_repairs_are_noted(tmp_path: Path) -> None:
    """What was done to the rows is known of the scenario."""
    write(tmp_path, TRACKS + "30,1,1,30,\n50,1,1,50,\n51,1,1,51,\n", "tracks.csv")
    found = read_scenario(write(tmp_path, ROBOT + "recording: {file: tracks.csv, radius: 1, gap: 5}\n"))
    assert [o.name for o in found.obstacles] == ["agent 1", "agent 1.1", "agent 2", "agent 3", "agent 40"]
    assert found.notes[1:] == (
        "tracks.csv: 1 duplicate row of agent 1 dropped: identical time and position",
        "tracks.csv: agent 1 split at a gap of 20 s (t = 30 s) into 1 and 1.1",
        "tracks.csv: radius of agent 3 as in the file, not the 1 m given",
    )


IN_RECORDING = {
    "format: @gpx": "format: expected one of csv, eth_ucy, {}; found 'gpx'",
    "window: @[3]": "window: expected at least 2 entries, found 1",
    "window: @[3, 3]": "window: expected a time and a later one, found 3 and 3",
    "window: @[100, 120]": "window: expected a part of 0 to 99 s, found 100 to 120 s",
    "window: [3, @soon]": "window.1: expected a number, found 'soon'",
    "agents: @[9]": "agents: expected ids of tracks.csv, agents 1, 2, 3, 40; found '9'",
    "without: @[x]": "without: expected ids of tracks.csv, agents 1, 2, 3, 40; found 'x'",
    "agents: [@[1]]": "agents.0: expected text, found [1]",
    "radius: @-1": "radius: expected 0 or more, found -1",
    "gap: @0": "gap: expected a number above 0, found 0",
    "interpolation: @cubic": "interpolation: expected 'linear' or 'smooth', found 'cubic'",
    "frame_rate: @10": "frame_rate: expected none with times in the column 't', found 10",
    "columns: @{time: t}": "columns: expected one of t, frame, {}; found 'time'",
    "@framerate: 10": "framerate: expected one of file, format, {}; found 'framerate'; did you mean 'frame_rate'?",
    "case: @3, format: trajnet": "case: expected a setting that trajnet has (frame_rate, unit), found 'case'",
    "format: ais, columns: @{when: t}": "columns: expected one of t, frame, {}; found 'when'",
    "format: ais, epoch: @now": "epoch: expected seconds or a time in ISO 8601, found 'now'",
}


@pytest.mark.parametrize("marked", IN_RECORDING)
def test_mistakes_in_a_recording(marked: str, tmp_path: Path) -> None:
    """At the value that is wrong."""
    write(tmp_path, TRACKS, "tracks.csv")
    before, after = marked.split("@")
    head = ROBOT + "recording: {file: tracks.csv, " + before
    (one,) = mistakes(tmp_path, head + after + "}\n")
    place, _, text = one.partition(": ")
    assert place == f"{tmp_path / 'scenario.yaml'}:2:{len(head.splitlines()[1]) + 1}"
    expected = "recording." + IN_RECORDING[marked]
    assert re.fullmatch(".*".join(re.escape(part) for part in expected.split("{}")), text), text


@pytest.mark.parametrize(
    ("marked", "expected"),
    [
        ("start: @99\n", "start: expected a start during the recording, from 5 to before 50 s, found 99"),
        ("duration: @90\n", "duration: expected at most 45 s, until the window ends, found 90"),
    ],
)
def test_runs_that_leave_what_is_recorded(marked: str, expected: str, tmp_path: Path) -> None:
    write(tmp_path, TRACKS, "tracks.csv")
    check(tmp_path, ROBOT + marked + "recording: {file: tracks.csv, window: [5, 50]}\n", expected)


def test_yaml_1_2(tmp_path: Path) -> None:
    """`no` is text, 010 is ten, 1e1 is a number."""
    scenario = read_scenario(write(tmp_path, ROBOT + "name: no\nduration: 1e1\nhorizon: 010\n"))
    assert (scenario.name, scenario.duration, scenario.horizon) == ("no", 10.0, 10.0)


@pytest.mark.parametrize(("line", "guided"), [("", True), ("guided: true\n", True), ("guided: false\n", False)])
def test_guidance_is_a_key_of_files(line: str, guided: bool, tmp_path: Path) -> None:
    """It is written where it differs from the default; settings of the command line and of studies replace it."""
    file = write(tmp_path, line + ROBOT)
    scenario = read_scenario(file)
    assert scenario.guided is guided
    assert ("guided: false" in scenario_text(scenario)) is not guided
    assert read_scenario(write(tmp_path, scenario_text(scenario), "again.yaml")).guided is guided
    for value in (0.0, 1.0):
        assert load(str(file), {"guided": value}).guided is bool(value)


def test_a_hidden_speed_without_passive_safety_is_noted(tmp_path: Path) -> None:
    """Former versions wrote it, without an effect."""
    scenario = read_scenario(write(tmp_path, "sight_range: 8\nhidden_speed: 1.5\n" + ROBOT))
    assert scenario.sight == Sight(8.0, occlusion="none")
    assert scenario.notes == ("The file has hidden_speed without passive_safety: no agents are hidden.",)
    note = "occlusion: expected 0, 1 or 2, found 1.5"
    with pytest.raises(InvalidFile, match=rf"scenario\.yaml:1:12: {note}"):
        read_scenario(write(tmp_path, "occlusion: 1.5\n" + ROBOT))


def test_a_number_of_an_obstacle_is_drawn_with_the_seed_of_the_run(tmp_path: Path) -> None:
    path, drawn = tmp_path / "a.yaml", "{first: -2, last: 6, seed: 1}"
    obstacle = (
        f"{{radius: 1, trajectory: {{kind: circular, center: [9, {drawn}], radius: 2, speed: 5, phase: {drawn}}}}}"
    )
    robot = "{position: [0, 0], radius: 1, max_speed: 2, max_acceleration: 1, goal: {position: [20, 0]}}"
    path.write_text(f"robot: {robot}\nobstacles: [{obstacle}, {obstacle}]\n")
    values = np.array(
        [
            [(one.trajectory.center[1], one.trajectory.phase) for one in read_scenario(path, seed).obstacles]
            for seed in range(200)
        ]
    )
    assert values.shape == (200, 2, 2)
    assert len(np.unique(values)) == values.size
    assert values.min() > -2.0
    assert values.max() < 6.0
    assert values.mean(axis=0) == pytest.approx(np.full((2, 2), 2.0), abs=0.6)
    path.write_text(path.read_text().replace("last: 6", "last: x"))
    with pytest.raises(InvalidFile, match="phase"):
        read_scenario(path)
