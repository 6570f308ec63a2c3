"""Loops of the caller: a recording equals that of the simulator, and tracks of any agents are a recording."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import slalom
from slalom import Disc, Driver, Fleet, Goal, Limits, Navigator, ObstacleTable, State, Stationary, Tracks, method
from slalom.cli import call
from slalom.sim import Recording, Scenario, decision_at, gallery, metrics, record, simulate
from slalom.sim.explanation import explanation
from slalom.sim.run.recorded import recorded
from slalom.sim.run.simulate import by_name
from slalom.sim.run.states import integrate
from slalom.vehicle import DifferentialDrive, Pose, VehicleNavigator

SAME = ("responses", "outcomes", "holds", "foresight")
ROUNDED = ("times", "positions", "velocities", "accelerations", "controls", "arrived")


def equal(found: Recording, expected: Recording) -> None:
    """All is equal, but for names, the clock, and rounding."""
    for name in SAME:
        assert np.all(getattr(found, name) == getattr(expected, name)), name
    for name in ROUNDED:
        assert np.allclose(getattr(found, name), getattr(expected, name), rtol=0.0, atol=1e-9), name


def test_a_loop_of_one_robot_is_recorded_as_simulated_and_its_decisions_are_explained(tmp_path: Path) -> None:
    scene = gallery.build("roundabout_crossing", {"duration": 4.0}, seed=3)
    expected, robot = simulate(scene, "nao", seed=3), scene.robot
    state, decision, around = robot.state, None, ObstacleTable(scene.obstacles)
    with record(scene.navigator(method("nao")), path=tmp_path / "run.h5") as run:
        for now in expected.times[:-1].tolist():
            decision = run.decide(state, around, robot.goal, now=now, previous=decision)
            command = decision.manoeuvre.mean_acceleration(now, scene.dt)
            state = State(*integrate(state.position, state.velocity, command, scene.dt), command)
    loaded = Recording.load(tmp_path / "run.h5")
    equal(loaded, expected)
    again = recorded(loaded)
    assert again.method is not None
    last = decision_at(loaded, again.scenario, again.method, len(expected.accelerations) - 1)
    assert explanation(last)["sentences"] == explanation(decision)["sentences"]


def test_a_loop_of_a_fleet_is_recorded_as_simulated_also_when_it_is_pickled() -> None:
    scene: Scenario = by_name(gallery.build("circle", {"robots": 6.0, "duration": 6.0}))[0]
    expected, robots = simulate(scene, "nao_shared"), scene.robots
    parts = [[getattr(robot, name) for robot in robots] for name in ("shape", "limits", "name", "goal")]
    fleet = Fleet(method("nao_shared"), *parts[:2], names=parts[2], period=scene.dt, **scene.shared)
    motion = [np.array([getattr(robot.state, name) for robot in robots]) for name in ("position", "velocity")]
    run, used = record(fleet), None
    for now in expected.times[:-1].tolist():
        decided = run.step(now, *motion, goals=parts[3], accelerations=used)
        run, used = pickle.loads(pickle.dumps(run)), decided.accelerations
        motion = list(integrate(*motion, used, scene.dt))
    equal(run.recording, expected)
    assert run.recording.settings == expected.settings
    assert metrics.summary(run.recording)["min_clearance"] == pytest.approx(metrics.summary(expected)["min_clearance"])


def test_targets_change_and_robots_come_and_go() -> None:
    fleet = Fleet(method("nao"), Disc(0.3), Limits(1.5, 1.5), robots=3, period=0.1)
    places, moves = np.array([(0.0, 0.0), (5.0, 1.0), (0.0, 5.0)]), np.zeros((3, 2))
    run = record(fleet)
    for k in range(90):
        targets = [(0.0, 0.0) if k >= 40 else (3.0, 0.0), (0.0, 1.0), (3.0, 5.0)]
        there = [True, k >= 20, k < 30]
        decided = run.step(0.1 * k, places, moves, targets, present=there)
        places, moves = decided.positions + ~np.array(there)[:, None] * places, decided.velocities
    found = run.recording
    assert found.goals[0].position([0.0, 3.9, 4.0, 9.0])[:, 0].tolist() == [3.0, 3.0, 0.0, 0.0]
    assert found.appeared.tolist() == pytest.approx([0.0, 2.0, 0.0])
    assert found.arrived[2] == pytest.approx(3.0)
    at_goal = [np.linalg.norm(found.only(k).positions[-1, 0] - end) <= 0.2 for k, end in enumerate(targets[:2])]
    assert at_goal == [True, True]
    assert 5.0 < found.arrived[0] < 9.0


def test_a_driver_among_tracks_is_recorded_at_even_times() -> None:
    run = record(Driver(Navigator(method("nao"), Disc(0.3), Limits(1.5, 1.0), period=0.1)))
    goal, state = Goal(Stationary((6, 0)), 0.3, stop=True), State((0, 0), (0, 0))
    run.head_for(goal)
    assert run.command(0.0).decision is None
    for k in range(60):
        now = 0.1 * k + 0.03 * (k % 3 == 1)
        run.locate(now, state)
        person = Tracks([(3.0, 2.0 - 0.5 * now)], [(0.0, -0.5)], 0.3, now, ids=["ann"])
        planned, then = run.command(now, [person]).decision.manoeuvre, 0.1 * (k + 1) + 0.03 * (k % 3 == 0)
        state = State(planned.position(then), planned.velocity(then))
    found = run.recording
    assert np.ptp(np.diff(found.times)) < 1e-9
    assert np.isfinite(found.arrived[0])
    assert metrics.summary(found)["collisions"] == 0
    assert [one.name for one in found.obstacles] == ["track ann"]
    assert found.obstacles[0].trajectory.position(1.0) == pytest.approx([3.0, 1.5])


@pytest.mark.parametrize("wheels", [False, True])
def test_each_decision_of_a_driver_is_explained_as_it_was_made(wheels: bool, tmp_path: Path) -> None:
    """Among tracks that are predicted. What the caller sets reaches the driver; a copy goes on."""
    drive = DifferentialDrive(0.4, 1.2, 3.0, period=0.1)
    navigator = (
        VehicleNavigator(drive, method("nao"), Disc(0.25))
        if wheels
        else Navigator(method("nao"), Disc(0.25), Limits(1.0, 1.5), period=0.1)
    )
    run, made = record(Driver(navigator), path=tmp_path / "run.h5"), []
    state = Pose((0, 0), 0.0) if wheels else State((0, 0), (0, 0))
    run.head_for(Goal(Stationary((4, 0)), 0.3, stop=True))
    run.walls = ObstacleTable([slalom.Obstacle(Disc(0.4), Stationary((2.0, -0.8)), "post")])
    with run:
        for k in range(30):
            run.locate(0.1 * k, state)
            person = Tracks([(3.0, 1.5 - 0.05 * k)], [(0.0, -0.5)], 0.3, 0.1 * k, ids=["ann"])
            found = run.command(0.1 * k, [person])
            made.append((state, found.decision))
            plan, then = found.decision.manoeuvre, 0.1 * (k + 1)
            state = drive.drive(state, found.command) if wheels else State(plan.position(then), plan.velocity(then))
    recording = Recording.load(tmp_path / "run.h5")
    assert recording.positions[:-1, 0] == pytest.approx(np.array([one.position for one, _ in made]))
    assert recording.velocities[:-1, 0] == pytest.approx(np.array([one.velocity for one, _ in made]))
    assert recording.positions[-1, 0] == pytest.approx(state.position)
    assert (metrics.path_length(recording) > 1.0, metrics.summary(recording)["collisions"]) == (True, 0)
    assert {one.name for one in recording.obstacles} == {"post", "track ann"}
    for k in (0, 11, 29):
        again = pickle.loads(pickle.dumps(run)).decision_at(0.1 * k + 0.05)
        assert explanation(again)["sentences"] == explanation(made[k][1])["sentences"]
    again.dump(tmp_path / "decision.json")
    assert call(["explain", str(tmp_path / "decision.json"), "--json"]) == 0


def test_tracks_are_a_recording_with_exact_motion(tmp_path: Path) -> None:
    times = np.linspace(2.0, 6.0, 41)
    rows = np.stack([np.stack([times, 0.5 * times**2]), np.stack([9.0 - times, 20.0 + 0.0 * times])]).transpose(2, 0, 1)
    rows[:10, 1] = rows[31:, 0] = np.nan
    found = Recording.from_tracks(times, rows, [0.3, 0.4], walls=[slalom.Obstacle(Disc(1.0), Stationary((4, 0)))])
    assert found.accelerations[1:29, 0] == pytest.approx(np.tile((0.0, 1.0), (28, 1)))
    assert found.appeared == pytest.approx([2.0, 3.0])
    assert found.arrived == pytest.approx([5.0, 6.0])
    assert metrics.max_speed(found, 1) == pytest.approx(1.0)
    nearest = np.hypot(times - 4.0, 0.5 * times**2).min() - 1.3
    assert metrics.min_clearance(found.only(0)) == pytest.approx(nearest, abs=0.01)
    found.save(tmp_path / "run.h5")
    assert Recording.load(tmp_path / "run.h5").digest() == found.digest()


def test_commands_show_a_recording_as_they_show_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.csv").write_text("t,id,x,y\n0,1,0,0\n0.5,1,1,0\n1,1,2,0\n0,2,0,3\n0.5,2,0,4\n")
    (tmp_path / "hall.wkt").write_text("LINESTRING (0 -1, 2 -1)")
    given = [str(tmp_path / "a.csv"), "--walls", str(tmp_path / "hall.wkt")]
    assert call(["animate", *given[:1], str(tmp_path / "a.gif"), *given[1:], "--width", "320", "--fps", "2"]) == 0
    assert call(["export", *given[:1], str(tmp_path / "a.html"), *given[1:]]) == 0
    assert "2 agents" in capsys.readouterr().err
