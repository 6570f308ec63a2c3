"""Tasks over time: laws of their order, of places and queues, of figures, files and studies."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from galleries import installed
from tasks_in_scenes import STATIONS, newest_by_last, robots, scene

from slalom import InvalidFile, Obstacle, Polyline, Stationary
from slalom.sim import Drawn, Recording, Scenario, Station, Task, Tasks, compare, read_scenario, simulate
from slalom.sim.files.scenario_writer import scenario_text
from slalom.sim.measure.metrics import collisions, summary
from slalom.sim.tasks import COLUMNS, task_figures

TIME, ORIGIN, DESTINATION, ROBOT, GIVEN, BEGUN, LEFT, REACHED, DONE, WAY, FREE = range(len(COLUMNS))


@cache
def run(method: str = "nao_shared", route: bool = False) -> Recording:
    """Four robots with more tasks than they can do."""
    return simulate(scene(Tasks(STATIONS, rate=20.0, seed=3, route=route)), method)


def services(log: np.ndarray) -> list[tuple[int, float, float]]:
    """Station, begin and end of each service; those that last have the end inf."""
    ends = ((ORIGIN, BEGUN, LEFT), (DESTINATION, REACHED, DONE))
    return [(int(row[s]), row[a], row[b]) for row in log for s, a, b in ends if np.isfinite(row[a])]


@pytest.mark.parametrize("method", ["nao", "nao_shared", "ao", "orca", "social_force"])
@pytest.mark.parametrize("route", [False, True])
def test_no_task_is_lost_and_no_robot_has_two(method: str, route: bool) -> None:
    """All tasks that have arrived are done, with one robot, or waiting; times are in order."""
    installed(method)
    log = run(method, route).tasks
    assert log is not None
    done, given = np.isfinite(log[:, DONE]), np.isfinite(log[:, GIVEN])
    assert done.sum() >= 3
    assert np.array_equal(given, log[:, ROBOT] >= 0)
    assert np.all(given[done])
    for k in range(4):
        own = log[(log[:, ROBOT] == k) & given]
        own = own[np.argsort(own[:, GIVEN])]
        assert np.all(own[1:, GIVEN] >= own[:-1, DONE])  # all but the last one are done
    steps = log[given][:, [TIME, GIVEN, BEGUN, LEFT, REACHED, DONE]]
    assert np.all((steps[:, 1:] >= steps[:, :-1]) | np.isinf(steps[:, 1:]))
    # Without a table of robots the oldest task is begun first.
    assert np.all(np.diff(log[given][:, GIVEN]) >= 0.0)
    assert not np.any(given[np.argmin(given) :])


@pytest.mark.parametrize("method", ["nao_shared", "nao", "orca"])
def test_never_more_robots_at_a_station_than_places(method: str) -> None:
    installed(method)
    log = run(method, True).tasks
    assert log is not None
    for station, begin, _ in services(log):
        here = [(a, b) for s, a, b in services(log) if s == station]
        assert sum(a <= begin < b for a, b in here) <= STATIONS[station].places


def test_services_last_as_stated_and_robots_are_there() -> None:
    found = run()
    assert found.tasks is not None
    tasks = Tasks(STATIONS, rate=20.0, seed=3)
    for task, row in enumerate(found.tasks):
        for station, begin, end in services(row[None]):
            wanted = tasks.service(station, task)
            assert np.isinf(end) or end - begin == pytest.approx(wanted)
            assert 0.0 <= wanted <= 4.0
            k = round((begin - found.times[0]) / found.dt)
            away = np.linalg.norm(found.positions[k, int(row[ROBOT])] - STATIONS[station].at)
            assert away <= (0.2 if STATIONS[station].places == 1 else 0.2 + 4.0 * 0.3 + 3.0 * 0.05)


def test_the_same_seed_gives_the_same_bits_in_any_order_of_robots() -> None:
    first = scene(Tasks(STATIONS, rate=20.0, seed=3), duration=20.0)
    one, two = simulate(first, "nao_shared"), simulate(replace(first, robots=first.robots[::-1]), "nao_shared")
    assert one.digest() == simulate(first, "nao_shared").digest()
    assert np.array_equal(one.positions, two.positions[:, ::-1])
    assert one.tasks is not None
    assert two.tasks is not None
    served = one.tasks[:, ROBOT] >= 0
    assert np.array_equal(one.tasks[served, ROBOT], 3.0 - two.tasks[served, ROBOT])
    other = simulate(replace(first, tasks=Tasks(STATIONS, rate=20.0, seed=4)), "nao_shared")
    assert one.digest() != other.digest()


@pytest.mark.parametrize("method", ["nao", "nao_shared", "ao", "avo", "rvo"])
def test_robots_wait_at_rest_beside_a_place_that_is_taken(method: str) -> None:
    """One serves; the others come to rest apart from it and from each other, as far as a robot needs to pass."""
    stations = (Station("a", (0, 0), service=1e3), Station("b", (8, 0)))
    tasks = Tasks(stations, tuple(Task(0.0, "a", "b") for _ in range(5)))
    found = simulate(scene(tasks, 5, duration=40.0), method)
    assert np.linalg.norm(found.velocities[-50:], axis=2).max() < 0.05
    end = found.positions[-1]
    apart = np.linalg.norm(end[:, None] - end, axis=2)[np.triu_indices(5, 1)]
    assert apart.min() >= 4.0 * 0.3 + 3.0 * 0.05 - 2.0 * 0.2
    assert np.linalg.norm(end, axis=1).max() < 5.0
    assert not collisions(found)


@pytest.mark.parametrize("method", ["nao", "nao_shared"])
def test_no_robot_waits_for_ever(method: str) -> None:
    """Tasks that all begin at one place are all done: first come, first served. Then the run ends."""
    stations = (Station("a", (0, 0), service=1.0), Station("b", (8, 0)))
    tasks = Tasks(stations, tuple(Task(0.0, "a", "b") for _ in range(10)))
    found = simulate(scene(tasks, 5, duration=200.0), method)
    assert found.tasks is not None
    result = summary(found)
    assert (result["arrived"], result["collisions"], result["tasks"]["tasks_done"]) == (5, 0, 10)
    assert found.times[-1] < 150.0
    gaps = np.diff(np.sort(found.tasks[:, BEGUN]))
    assert gaps.min() >= 1.0
    assert gaps.max() <= 15.0
    assert result["tasks"]["waiting_longest"] == found.tasks[:, BEGUN].max()


def test_tasks_go_to_the_nearest_free_robot_or_to_their_own() -> None:
    listed = (Task(0.0, "b", "a"), Task(0.0, "a", "b", "r3"), Task(0.0, "c", "a", "r3"))
    found = simulate(scene(Tasks(STATIONS, listed), duration=1.0), "nao")
    assert found.tasks is not None
    assert found.tasks[:, ROBOT].tolist() == [3.0, -1.0, -1.0]
    alone = simulate(scene(Tasks(STATIONS, listed[1:]), duration=60.0), "nao")
    assert alone.tasks is not None
    assert alone.tasks[:, ROBOT].tolist() == [3.0, 3.0]
    assert summary(alone)["tasks"]["tasks_done"] == 2


def test_a_function_chooses_robots() -> None:
    listed = (Task(0.0, "b", "a"), Task(0.0, "c", "a"))
    found = simulate(scene(Tasks(STATIONS, listed, assign=newest_by_last), duration=1.0), "nao")
    assert found.tasks is not None
    assert found.tasks[:, ROBOT].tolist() == [2.0, 3.0]


def test_figures_by_hand() -> None:
    """One robot, alone: it waits for nothing, and drives the shortest way at nearly full speed."""
    stations = (Station("a", (0, 0), service=2.0), Station("b", (30, 0), service=4.0))
    one = Scenario("one", robots(1), duration=90.0, tasks=Tasks(stations, (Task(1.0, "a", "b"),)))
    found = simulate(one, "nao")
    (log,) = found.tasks if found.tasks is not None else ()
    figures = task_figures(found)
    assert (figures["tasks"], figures["tasks_done"]) == (1.0, 1.0)
    assert figures["waiting_50"] == figures["waiting_longest"] == log[BEGUN] - 1.0
    assert log[FREE] == pytest.approx(np.hypot(2, 4) + 30.0, abs=0.5)
    assert figures["way_over_free"] == pytest.approx(1.0, abs=0.03)
    assert figures["tasks_per_hour"] == pytest.approx(3600.0 / found.times[-1])
    busy = (log[FREE] / 1.5 + 6.0) / found.times[-1]
    assert figures["efficiency"] == pytest.approx(busy)
    assert found.arrived[0] == found.times[-1]


def test_the_shortest_way_leads_around_walls() -> None:
    pytest.importorskip("scipy")
    wall = Obstacle(Polyline([(4, -20), (4, 3)], 0.1), Stationary((0, 0)), "wall")
    tasks = Tasks(STATIONS[:2], (Task(0.0, "a", "b"),), route=True)
    found = simulate(scene(tasks, 2, obstacles=(wall,), duration=40.0), "nao_shared")
    assert found.tasks is not None
    assert found.tasks[0, FREE] > np.hypot(2, 4) + 2.0 * np.hypot(4, 3) - 0.5
    assert summary(found)["tasks"]["tasks_done"] == 1
    assert 0.95 < summary(found)["tasks"]["way_over_free"] < 1.1


FILE = """\
robots:
- {count: 3, name: r, radius: 0.3, max_speed: 1.5, max_acceleration: 2, goal: {stop: true, tolerance: 0.2},
   positions: {kind: line, first: [-2, -4], last: [2, -4]}, goals: {kind: line, first: [-2, -4], last: [2, -4]}}
tasks:
  stations:
  - {name: a, at: [0, 0], service: {first: 1, last: 3, seed: 1}}
  - {name: b, at: [8, 0], places: 2, service: 2}
  rate: 20
  seed: 5
duration: 12
"""


def test_files_say_the_same_as_python(tmp_path: Path) -> None:
    (tmp_path / "t.yaml").write_text(FILE)
    found = read_scenario(tmp_path / "t.yaml")
    stations = (Station("a", (0, 0), service=Drawn(1.0, 3.0, 1)), Station("b", (8, 0), 2, 2.0))
    own = replace(found, tasks=Tasks(stations, rate=20.0, seed=5))
    assert simulate(found, "nao").digest() == simulate(own, "nao").digest()
    (tmp_path / "again.yaml").write_text(scenario_text(own))
    assert scenario_text(read_scenario(tmp_path / "again.yaml")) == scenario_text(own)
    times = [[task.time for task in read_scenario(tmp_path / "t.yaml", seed).tasks.until(0, 60)] for seed in (0, 0, 1)]
    assert times[0] == times[1] != times[2]
    assert len(times[0]) == pytest.approx(20, abs=12)


def test_a_table_lists_tasks(tmp_path: Path) -> None:
    (tmp_path / "tasks.csv").write_text("time,origin,destination,robot\n3,b,a,\n1.5,a,b,r 2\n")
    (tmp_path / "t.yaml").write_text(FILE.replace("rate: 20", "table: tasks.csv"))
    found = read_scenario(tmp_path / "t.yaml").tasks
    assert found is not None
    assert found.until(0.0, 9.0) == [Task(1.5, "a", "b", "r 2"), Task(3.0, "b", "a")]
    assert found.until(0.0, 2.0) == [Task(1.5, "a", "b", "r 2")]


def test_studies_have_the_figures_for_any_number_of_processes(tmp_path: Path) -> None:
    (tmp_path / "t.yaml").write_text(FILE)
    given = {"store": tmp_path / "store"}
    one = compare(str(tmp_path / "t.yaml"), ["nao"], 2, **given)
    assert one == compare(str(tmp_path / "t.yaml"), ["nao"], 2, jobs=2)
    assert one == compare(str(tmp_path / "t.yaml"), ["nao"], 2, **given)
    row = one["methods"]["nao"]
    assert not row["failures"]
    assert {"tasks_done", "waiting_longest", "way_over_free"} <= row["metrics"].keys()


def test_a_recording_keeps_its_tasks(tmp_path: Path) -> None:
    found = run()
    found.save(tmp_path / "run.h5")
    again = Recording.load(tmp_path / "run.h5")
    assert again.digest() == found.digest()
    assert task_figures(again) == task_figures(found)
    assert found.only(0).tasks is None


MISTAKEN = {
    "places: 2": ("places: 0", "tasks.stations.1.places: expected 1 or more, found 0"),
    "at: [8, 0]": ("at: [0.1, 0]", "tasks: station 'b': expected one 1.35 m or more from the station 'a', found 0.1 m"),
    "stop: true": ("stop: false", "tasks: r 0.goal: expected a position to stop at"),
    "rate: 20": ("table: none.csv", "none.csv: expected a readable text file"),
    "seed: 5": ("sed: 5", "tasks.sed: expected one of stations, listed"),
    "last: 3, seed": ("last: -3, seed", "tasks.stations.0.service.last: expected 0 or more, found -3"),
}


@pytest.mark.parametrize("text", MISTAKEN)
def test_mistakes_in_files(text: str, tmp_path: Path) -> None:
    by, message = MISTAKEN[text]
    (tmp_path / "t.yaml").write_text(FILE.replace(text, by))
    with pytest.raises(InvalidFile) as found:
        read_scenario(tmp_path / "t.yaml")
    (line,) = str(found.value).splitlines()
    assert message in line
