"""Robots that appear during a run: nothing meets them before, and everything counts from then on."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from wall_files import written

from slalom import (
    METHODS,
    ConstantVelocity,
    Disc,
    Goal,
    Limits,
    Obstacle,
    Polyline,
    Rectangle,
    State,
    Stationary,
)
from slalom.cli.report import run_text
from slalom.live.messages import Scene, unpack
from slalom.live.recorded import looked_at
from slalom.live.session import from_step
from slalom.sim import Recording, Robot, RunSummary, Scenario, decision_at, metrics, simulate
from slalom.sim.files.scenario_writer import scenario_text
from slalom.sim.files.scenario_yaml import files_of, is_random, read_scenario
from slalom.sim.measure.closest_approach import between_robots
from slalom.sim.measure.export_tracks import as_tracks, rows_of_run
from slalom.sim.measure.tidy_table import columns_of
from slalom.sim.run.recorded import recorded
from slalom.view import fleet
from slalom.view.film import Film

DT = 0.125  # a binary fraction: sums of steps are exact
RADIUS, MARGIN = 0.3, 0.05
FLEETS = ("nao_shared", "nao", "vo")


def robot(
    name: str, start: tuple[float, float], goal: tuple[float, float], appears: float | None = None, **changes: object
) -> Robot:
    """A disc that goes from a start to a goal [m]."""
    own = Robot(
        *(Disc(RADIUS), Limits(1.2, 2.0), State(start, (0, 0)), Goal(Stationary(goal), 0.2, True), name),
        appears=appears,
    )
    return replace(own, **changes)


def scenario(*robots: Robot, **settings: object) -> Scenario:
    return Scenario("hall", robots, **{"dt": DT, "duration": 40.0, "margin": MARGIN, **settings})


@pytest.fixture(scope="module")
def run() -> Recording:
    """Robots of which the second waits for the first to leave its place, and the last one does not appear."""
    robots = (
        robot("a", (0, 0), (5, 0)),
        robot("b", (0, 0), (5, 1), 0.5),
        robot("c", (5, 0), (0, 0), 1.0, state=State((5, 0), (-0.5, 0))),
        robot("d", (2, 3), (2, 3.1), 100.0),
    )
    return simulate(scenario(*robots, duration=9.0), "nao_shared")


def slow_clearance(run: Recording, j: int, k: int) -> float:
    """Least clearance [m] of two discs, at many times between the steps at which both have made a decision."""
    least = np.inf
    for step in range(len(run.accelerations)):
        if min(run.appeared[j], run.appeared[k]) < np.inf and run.times[step] >= max(run.appeared[j], run.appeared[k]):
            for h in np.linspace(0.0, run.dt, 9):
                p = [
                    run.positions[step, i] + h * run.velocities[step, i] + 0.5 * h * h * run.accelerations[step, i]
                    for i in (j, k)
                ]
                least = min(least, float(np.linalg.norm(p[0] - p[1])) - 2.0 * RADIUS)
    return least


@pytest.mark.parametrize("name", [*FLEETS, "orca"])
def test_a_run_in_which_all_appear_at_the_start_is_one_without_times(name: str) -> None:
    ends = [((0, 0), (5, 0)), ((5, 0.3), (0, 0)), ((2, 3), (2, -3))]
    runs = [simulate(scenario(*(robot(str(k), *e, at) for k, e in enumerate(ends))), name) for at in (None, 0.0)]
    assert runs[0].digest() == runs[1].digest()
    assert runs[0].positions.tobytes() == runs[1].positions.tobytes()


@pytest.mark.parametrize("name", ["nao", "nao_ahead", "nao_shared"])
def test_a_robot_alone_does_later_what_it_does_at_the_start(name: str) -> None:
    walls = (Obstacle(Polyline([(2, -1), (2, 1.5)]), Stationary((0, 0)), "wall"),)
    plain = simulate(scenario(robot("a", (0, 0.1), (5, 0)), obstacles=walls), name)
    late = simulate(scenario(robot("a", (0, 0.1), (5, 0), 2.0), obstacles=walls), name)
    own = late.only()
    assert late.appeared.tolist() == [2.0]
    assert own.times.tolist() == (plain.times + 2.0).tolist()
    np.testing.assert_allclose(own.positions, plain.positions, atol=1e-9)
    assert [metrics.time(late), metrics.path_length(late), metrics.extra_time(late)] == pytest.approx(
        [metrics.time(plain), metrics.path_length(plain), metrics.extra_time(plain)]
    )
    assert metrics.time(simulate(scenario(robot("a", (0, 0.1), (5, 0), 2.0), obstacles=walls), name, record=False)) == (
        metrics.time(late)
    )


@pytest.mark.parametrize("name", ["nao", "vo", "orca"])
def test_a_robot_is_not_avoided_before_it_appears(name: str) -> None:
    """Others move to the bit as without it, through its place."""
    pair = robot("a", (0, 0), (5, 0)), robot("b", (0, 1), (5, 1))
    plain = simulate(scenario(*pair), name)
    late = simulate(scenario(*pair, robot("c", (2.5, 0.5), (2.5, 0.6), 30.0)), name)
    steps = len(plain.times)
    assert late.appeared[2] == 30.0
    assert late.positions[:steps, :2].tobytes() == plain.positions.tobytes()
    assert late.positions[240, 2].tolist() == [2.5, 0.5]
    assert metrics.collisions(late) == 0.0


@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    st.lists(
        st.tuples(*[st.integers(0, 4)] * 4, st.sampled_from([None, 0.5, 1.0, 3.0])),
        min_size=2,
        max_size=6,
        unique_by=(lambda e: e[:2], lambda e: e[2:4]),
    ),
    st.sampled_from(FLEETS),
)
def test_nothing_touches_and_the_order_does_not_matter(ends: list[tuple[float, ...]], name: str) -> None:
    """Robots with nao_shared never touch; any order of robots, and two threads, are the same run to the bit."""
    robots = [robot(f"r{k}", e[:2], e[2:4], e[4]) for k, e in enumerate(ends)]
    one = simulate(scenario(*robots, duration=12.0), name, threads=1)
    other = simulate(scenario(*robots[::-1], duration=12.0), name, threads=2)
    assert one.positions.tobytes() == np.ascontiguousarray(other.positions[:, ::-1]).tobytes()
    assert one.appeared.tolist() == other.appeared[::-1].tolist()
    between = between_robots(one)
    for j in range(len(robots)):
        for k in range(j):
            slow = slow_clearance(one, j, k)
            assert between[j, k] <= slow + 1e-3
            assert between[j, k] >= slow - 0.1
    if name == "nao_shared":
        assert between.min() >= MARGIN - 1e-5
    for k, own in enumerate(robots):
        if own.appears is None:
            assert one.appeared[k] == 0.0
        elif np.isfinite(one.appeared[k]):
            # Its place is free when it appears.
            assert one.appeared[k] >= own.appears
            step = round(one.appeared[k] / DT)
            there = [j for j in range(len(robots)) if j != k and one.appeared[j] <= one.appeared[k]]
            apart = np.linalg.norm(one.positions[step, there] - one.positions[step, k], axis=1)
            assert apart.min(initial=np.inf) >= 2.0 * RADIUS + MARGIN - 1e-5


@pytest.mark.parametrize("name", ["nao", "orca"])
def test_the_longest_waiting_robot_appears_first(name: str) -> None:
    """Of robots at one place; those of one time in the order of their names."""
    robots = [robot(n, (0, 0), (6, y), t) for n, y, t in (("b", 0, 2.0), ("a", 2, 2.0), ("z", -2, 1.0), ("y", 1, None))]
    run = simulate(scenario(*robots), name)
    times = dict(zip(run.names, run.appeared.tolist()))
    assert times["y"] < times["z"] < times["a"] < times["b"] < np.inf


def test_a_robot_waits_for_moving_obstacles_and_not_for_walls() -> None:
    walker = Obstacle(Disc(0.3), ConstantVelocity((-3, 0), (1, 0)), "walker")
    wall = Obstacle(Polyline([(-5, 0.31), (5, 0.31)]), Stationary((0, 0)), "wall")
    run = simulate(scenario(robot("a", (0, 0), (0, -5), 2.5), obstacles=(walker, wall)), "nao")
    # It is clear of the walker from 3.65 s on.
    assert run.appeared.tolist() == [3.75]
    assert metrics.collisions(run) == 0.0
    still = simulate(scenario(robot("a", (0, 0), (0, -5), 2.5), obstacles=(wall,)), "nao")
    assert still.appeared.tolist() == [2.5]


def test_bodies_with_corners_count_from_their_appearance() -> None:
    """Two of them cross the place of the third before it appears."""
    box = Rectangle(0.5, 0.4)
    robots = robot("a", (0, 0), (5, 0), shape=box), robot("b", (2, 0), (2, 3), 6.0, shape=box)
    run = simulate(scenario(*robots), "nao_shared")
    assert run.appeared.tolist() == [0.0, 6.0]
    assert between_robots(run)[0, 1] > MARGIN - 1e-4
    assert metrics.summary(run)["collisions"] == 0


def test_robots_appear_at_decisions() -> None:
    run = simulate(scenario(robot("a", (0, 0), (3, 0), 0.6), robot("b", (0, 3), (3, 3)), dt=0.1, replan=0.5), "nao")
    assert run.appeared.tolist() == [1.0, 0.0]


def test_a_robot_that_appears_leaves_at_a_goal_without_stop() -> None:
    robots = [robot(n, (0, 0), (4, 0), t) for n, t in (("a", None), ("b", 3.0))]
    robots = [replace(one, goal=Goal(Stationary((4, 0)), 0.2)) for one in robots]
    run = simulate(scenario(*robots), "nao_shared")
    assert np.isfinite(run.arrived).all()
    spans = [agent.trajectory.span for agent in as_tracks(run).agents.values()]
    assert spans[1][0] == run.appeared[1] == 3.0
    assert [end for _, end in spans] == pytest.approx(run.arrived.tolist())


def test_everything_counts_from_the_appearance(run: Recording) -> None:
    assert run.appeared[[0, 2]].tolist() == [0.0, 1.0]
    assert 0.5 < run.appeared[1] < 2.0
    assert run.appeared[3] == np.inf
    rows = rows_of_run(run)
    assert [row.start for row in rows] == [0.0, run.appeared[1], 1.0, None]
    assert rows[3].min_clearance is None
    for k in range(3):
        first = round(run.appeared[k] / DT)
        ways = np.linalg.norm(np.diff(run.positions[first:, k], axis=0), axis=1)
        assert rows[k].path_length == pytest.approx(ways.sum())
        straight = np.linalg.norm(run.goals[k].position(0.0) - run.positions[0, k])
        assert rows[k].delay == pytest.approx(run.arrived[k] - run.appeared[k] - straight / 1.2)
    table = columns_of(run)
    for k, name in enumerate(run.names):
        own = table["time"][table["robot"] == name]
        assert own.tolist() == run.times[run.times >= run.appeared[k]].tolist()
    tracks = as_tracks(run)
    assert [agent.trajectory.span[0] for agent in tracks.agents.values()] == run.appeared[:3].tolist()
    assert "did not appear, left out: d" in tracks.notes
    text = run_text(run, metrics.summary(run))
    assert "3 after the start, 1 waited for their place, at most 0.4 s, 1 did not appear" in text
    assert run.only("c").velocities[0, 0].tolist() == [-0.5, 0.0]


def test_files_of_runs_hold_the_times(run: Recording, tmp_path: Path) -> None:
    run.save(tmp_path / "run.h5")
    loaded = Recording.load(tmp_path / "run.h5")
    assert loaded.appeared.tolist() == run.appeared.tolist()
    assert loaded.digest() == run.digest()
    robots = recorded(loaded).scenario.robots
    assert [one.appears for one in robots] == [None, 0.5, 1.0, 100.0]
    assert robots[2].state.velocity.tolist() == [-0.5, 0.0]


def test_a_summary_without_steps_holds_the_times(run: Recording) -> None:
    short = simulate(recorded(run).scenario, "nao_shared", record=False)
    assert isinstance(short, RunSummary)
    assert short.appeared.tolist() == run.appeared.tolist()


def test_pictures_show_robots_from_their_appearance_on(run: Recording) -> None:
    film = Film(run, width=320)
    for t in (0.0, 0.9, 1.0, 5.0):
        assert film.states(t)[2].tolist() == (run.appeared <= t).tolist()
        assert film.at(t).ndim == 3
    drawn = fleet(run, names=True)
    ids = [artist.get_gid() for artist in drawn.findobj()]
    assert "track-2" in ids
    assert "track-3" not in ids
    assert "name-3" not in ids


def test_the_view_shows_robots_from_their_appearance_on(run: Recording) -> None:
    found = recorded(run)
    scene = Scene(found.scenario, found.steps)
    *_, arrays = unpack(scene.frames([*found.steps, found.end], 0, found.arrived, None))
    absent = ~np.isfinite(np.asarray(arrays["positions"])[..., 0])
    assert (absent == (run.times[:, None] < run.appeared)).all()
    seen = [one.step for one in looked_at(found, 1, DT)]
    assert seen[0] == round(run.appeared[1] / DT)
    assert not list(looked_at(found, 3, DT))
    later = from_step(found.scenario, found.steps, 2)
    assert [one.appears for one in later.robots] == [None, 0.5, 1.0, 100.0]
    waiting = from_step(found.scenario, found.steps, 5)
    assert [one.appears for one in waiting.robots] == [None, 0.75, 1.0, 100.0]
    assert [one.appears for one in from_step(found.scenario, found.steps, 24).robots] == [None, None, None, 100.0]


def test_decisions_of_a_robot_that_appears_are_made_again() -> None:
    built = scenario(robot("a", (0, 0), (3, 0), 1.0))
    run = simulate(built, "nao").only()
    assert decision_at(run, recorded(run).scenario, METHODS["nao"], 3).outcome.name == run.outcomes[3][0]


AREAS = """areas:
  west: {kind: box, low: [-6, -2], high: [-4, 2], seed: 5}
  east: {kind: polygon, corners: [[4, -2], [6, -2], [6, 2]], seed: 3}
  north: {kind: box, low: [-6, 8], high: [-4, 12], seed: 0}
"""
BODY = "radius: 0.25, max_speed: 1.2, max_acceleration: 2"
STOPS = BODY + ", goal: {stop: true}"


def test_a_file_states_times_of_appearance(tmp_path: Path) -> None:
    """Of a robot, of a group, and of the robots of a table."""
    written(tmp_path, "people.csv", "x,y,goal_x,goal_y,appears\n0,9,5,9,2.5\n0,12,5,12,0\n")
    path = written(
        tmp_path,
        "a.yaml",
        f"""robots:
- {{position: [0, 0], goal: {{position: [5, 0]}}, appears: 1.5, {BODY}}}
- count: 3
  positions: {{kind: line, first: [0, 3], last: [0, 5]}}
  goals: {{kind: displaced, by: [5, 0]}}
  appears: {{first: 1, last: 3}}
  {BODY.replace(", ", chr(10) + "  ")}
- {{table: people.csv, {BODY}}}
""",
    )
    found = read_scenario(path)
    assert [one.appears for one in found.robots] == [1.5, 1.0, 2.0, 3.0, 2.5, 0.0]
    again = read_scenario(written(tmp_path, "b.yaml", scenario_text(found)))
    assert [one.appears for one in again.robots] == [1.5, 1.0, 2.0, 3.0, 2.5, 0.0]
    run = simulate(found, "nao")
    assert run.appeared.tolist() == pytest.approx([1.5, 1.0, 2.0, 3.0, 2.5, 0.0])


def test_a_file_states_flows(tmp_path: Path) -> None:
    """Counts, rates and a table; the seed moves places and random times; those that stop do not overlap."""
    written(tmp_path, "od.csv", "origin,destination,count\nwest,east,3\neast,west,0\neast,west,2\n")
    path = written(
        tmp_path,
        "a.yaml",
        f"""{AREAS}duration: 60
flows:
- {{origin: west, destination: east, count: 4, {BODY}, name: start}}
- {{origin: west, destination: east, rate: 0.5, {BODY}, appears: {{first: 2, last: 12}}, name: rate}}
- {{origin: east, destination: north, rate: 0.5, appears: {{first: 2, last: 12, seed: 1}}, {STOPS}}}
- {{table: od.csv, {BODY}, appears: 20}}
""",
    )
    found = read_scenario(path)
    names = [one.name for one in found.robots]
    assert names[:6] == ["start 0", "start 1", "start 2", "start 3", "rate 0", "rate 1"]
    assert len(names) == 4 + 5 + 5 + 3 + 2
    assert [one.appears for one in found.robots[4:9]] == [2.0, 4.0, 6.0, 8.0, 10.0]
    assert all(2.0 <= float(one.appears or 0.0) <= 12.0 for one in found.robots[9:14])
    assert {one.appears for one in found.robots[14:]} == {20.0}
    starts = np.array([one.state.position for one in found.robots])
    goals = np.array([one.goal.position(0.0) for one in found.robots])
    west = np.array([*range(9), 14, 15, 16])
    assert (np.abs(starts[west] - (-5, 0)) <= (1, 2)).all()
    # The polygon has the corners (4, -2), (6, -2) and (6, 2).
    assert (goals[west, 1] <= 2.0 * (goals[west, 0] - 4.0) - 2.0).all()
    for places in (starts[west], goals[9:14]):
        apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 9.0 * np.eye(len(places))
        assert apart.min() >= 0.5 + MARGIN
    assert is_random(path)
    other = read_scenario(path, 1)
    assert [one.appears for one in other.robots[4:9]] == [2.0, 4.0, 6.0, 8.0, 10.0]
    assert [one.appears for one in other.robots[9:14]] != [one.appears for one in found.robots[9:14]]
    assert (np.array([one.state.position for one in other.robots]) != starts).all()
    assert [file.name for file in files_of(path)] == ["a.yaml", "od.csv"]
    result = metrics.summary(simulate(found, "nao_shared"))
    assert (result["arrived"], result["collisions"]) == (19, 0)


def test_the_example_of_the_page_runs(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "library.md").read_text()
    (content,) = re.findall(r"```yaml\n(areas:.*?)```", page, re.DOTALL)
    scenario = read_scenario(written(tmp_path, "flows.yaml", content))
    found = metrics.summary(simulate(scenario, "nao_shared"))
    assert (found["robots"], found["arrived"], found["collisions"]) == (25, 25, 0)
