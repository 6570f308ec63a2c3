"""A row for each agent of runs and recordings, and runs with their walls as JuPedSim and PedPy open them."""

import csv
import re
import sqlite3
from pathlib import Path

import numpy as np
import pytest
import shapely
from commands import Say, saying
from hypothesis import given, settings, strategies as st

from slalom import Disc, Limits, Obstacle, Polyline, State, Stationary, method
from slalom.io.formats import read_recording
from slalom.io.recorded import Agent, RecordedTracks
from slalom.model.goal import Goal
from slalom.model.trajectory import Sampled
from slalom.sim import Recording, Robot, Scenario, metrics, simulate
from slalom.sim.measure.export_tracks import rows_of_run, rows_of_tracks

PAGE = Path(__file__).parents[2] / "docs" / "recordings.md"
WALLS = ([(0, -5), (0, -0.7)], [(0, 0.7), (0, 5)])


@pytest.fixture(scope="module")
def run() -> Recording:
    """Three robots go through a door of 1.4 m; the last one has no time to arrive."""
    robots = tuple(
        Robot(Disc(0.25), Limits(1.5, 2.0), State((x, 0), (0, 0)), Goal(Stationary((3, y)), 0.2), name=f"robot {k}")
        for k, (x, y) in enumerate(((-1, 1), (-2, -1), (-14, 0)))
    )
    walls = tuple(Obstacle(Polyline(wall), Stationary((0, 0)), "wall") for wall in WALLS)
    return simulate(Scenario("door", robots, walls, duration=8.0), method("nao_shared"))


@pytest.fixture
def say(run: Recording, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Say:
    """Run a command in a folder with the run in it."""
    run.save(tmp_path / "run.h5")
    monkeypatch.chdir(tmp_path)
    return saying(capsys)


def test_rows_of_a_run(run: Recording) -> None:
    """As the metrics of each robot say, and the least of them is that of the run."""
    rows = rows_of_run(run)
    assert [row.agent for row in rows] == list(run.names)
    assert [row.arrival is None for row in rows] == [False, False, True]
    assert [row.delay is None for row in rows] == [False, False, True]
    for k, row in enumerate(rows):
        assert row.path_length == metrics.path_length(run, k)
        assert row.start == run.times[0]
    assert rows[0].delay == rows[0].arrival - np.hypot(4, 1) / 1.5
    assert min(row.min_clearance for row in rows) == metrics.min_clearance(run)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.lists(st.tuples(*[st.integers(-50, 50)] * 4, st.integers(0, 15), st.integers(2, 20)), min_size=1, max_size=5))
def test_rows_of_a_recording(walks: list[tuple[int, ...]]) -> None:
    """Agents that walk straight on, against a loop over all pairs and times."""
    agents = {}
    for k, (x, y, u, v, first, count) in enumerate(walks):
        frames = np.arange(first, first + count)
        way = np.array([x, y]) / 10 + frames[:, None] * np.array([u, v]) / 100
        agents[str(k)] = Agent(Sampled(frames / 10, way))
    rows = rows_of_tracks(RecordedTracks(agents), dict.fromkeys(agents, 0.2))
    for row, (_, _, u, v, first, count) in zip(rows, walks):
        assert row.arrival - row.start == pytest.approx((count - 1) / 10)
        assert row.path_length == pytest.approx((count - 1) * np.hypot(u, v) / 100, abs=1e-9)
        assert row.delay == (None if u == v == 0 else pytest.approx(0.0, abs=1e-6))
        least = [
            np.linalg.norm(agents[row.agent].trajectory.position(t / 10) - other.trajectory.position(t / 10)) - 0.4
            for label, other in agents.items()
            for t in range(first, first + count)
            if label != row.agent and other.trajectory.span[0] <= t / 10 <= other.trajectory.span[1]
        ]
        assert row.min_clearance == (pytest.approx(min(least), abs=1e-6) if least else None)


def test_convert_writes_a_row_for_each_agent(say: Say, run: Recording) -> None:
    assert say("convert", "run.h5", "agents.csv", "--per-agent").code == 0
    with open("agents.csv", newline="") as file:
        found = [*csv.DictReader(file)]
    assert [(row["agent"], row["arrival"] == "") for row in found] == [(n, n == run.names[2]) for n in run.names]
    assert float(found[0]["path_length"]) == metrics.path_length(run, 0)
    said = say("convert", "sample:roundabout_ring_11.csv", "cars.csv", "--per-agent", "--agents", "1,2", "--json")
    assert [row["agent"] for row in said.noted_json["agents"]] == ["1", "2"]
    assert "as of a pedestrian" not in said.err
    for tokens, what in (
        (("run.h5", "a.sqlite"), r"TARGET: expected a file that ends in \.csv with --per-agent; found 'a\.sqlite'"),
        (("run.h5", "a.csv", "--gap", "1"), "--gap: expected only with recorded tracks, found it with the run"),
    ):
        said = say("convert", *tokens, "--per-agent")
        assert said.code == 2
        assert re.search(what, said.err)


def test_a_run_with_walls_as_a_database(say: Say, run: Recording) -> None:
    """Robots at their places; walls are no part of the walkable area, and are walls when it is read again."""
    said = say("convert", "run.h5", "run.sqlite")
    assert said.code == 0
    assert "left out: w" not in said.err
    read = read_recording("run.sqlite")
    assert len(read.agents) == 3
    for k, agent in enumerate(read.agents.values()):
        steps = len(agent.trajectory.times)
        np.testing.assert_array_equal(agent.trajectory.positions, run.positions[:steps, k])
    with sqlite3.connect("run.sqlite") as database:
        ((wkt,),) = database.execute("SELECT wkt FROM geometry")
    area = shapely.from_wkt(wkt)
    assert area.geom_type == "Polygon"
    assert all(not area.contains(shapely.Point(0, y)) for y in (-5, -1, -0.7, 0.7, 3))
    assert area.contains(shapely.LineString([(-1, 0), (1, 0)]))
    assert shapely.contains_xy(area, run.positions.reshape(-1, 2)).all()
    assert min(shapely.LineString(wall).distance(shapely.Point(0, 2)) for wall in read.walls) < 0.011
    said = say("convert", "run.h5", "run.ndjson")
    assert "2 walls left out: trajnet has none" in said.err


def test_pedpy_opens_it_and_measures_density_and_flow(say: Say) -> None:
    """The recipe of the page on recordings: two of three robots pass the line behind the door."""
    pytest.importorskip("pedpy", reason="PedPy is not installed: pip install 'slalom[pedpy]'")
    assert say("convert", "run.h5", "run.sqlite").code == 0
    (recipe,) = re.findall(r"```text\n(import pedpy\n.*?)```", PAGE.read_text(), re.DOTALL)
    found: dict[str, object] = {}
    exec(recipe, found)
    assert found["crossings"]["cumulative_pedestrians"].max() == 2
    assert 0.0 < found["density"]["density"].max() <= 3 / 4.0
