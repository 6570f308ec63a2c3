"""The easiest worlds through every entry point that decides: one robot alone arrives in time and rests."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from draws import draws
from easy_entries import ENDING, ENTRIES, WHEELS, drive_of, driven_on_wheels
from easy_worlds import SECONDS_AT_REST, World, assert_rests, log_uniform, passing_time, stopping_time, straight, world
from irsim_worlds import robot as robot_of_irsim


def world_of_an_entry(seed: int, stop: bool) -> World:
    """A robot at rest in the plane, at most 2 m/s fast, with a tolerance that wheels can keep."""
    rng = np.random.default_rng([seed, 9])
    one = world(rng, 2, stop=stop, fastest=2.0)
    return replace(one, velocity=(0.0, 0.0), tolerance=log_uniform(rng, 0.02, 0.2))


def latest_arrival(one: World, v: float, a: float) -> float:
    """Time [s] of the latest arrival from rest that is accepted, with limits v [m/s] and a [m/s^2]."""
    if one.stop:
        return 1.1 * stopping_time(one.length, 0.0, v, a) + 4.0 * one.period
    return 1.01 * passing_time(one.length - one.tolerance, 0.0, v, a) + 2.0 * one.period


each_entry_seed = pytest.mark.parametrize("seed", draws(range(5)))
both_goals = pytest.mark.parametrize("stop", [True, False])


@pytest.mark.parametrize("name", ENTRIES)
@both_goals
@each_entry_seed
def test_every_entry_point_leads_one_robot_to_its_goal(name: str, stop: bool, seed: int) -> None:
    """In time; a robot that stops then rests, where the entry point does not end with the arrival."""
    one = world_of_an_entry(seed, stop)
    latest = latest_arrival(one, one.max_speed, one.max_acceleration)
    run = ENTRIES[name](one, 2.0 * latest, SECONDS_AT_REST)
    assert run.arrived is not None, one
    assert run.arrived <= latest + 1e-9, one
    assert straight(one, run.positions) <= one.tolerance, one
    if stop and name not in ENDING:
        assert_rests(one, run, run.arrived)


@pytest.mark.parametrize("name", WHEELS)
@both_goals
@each_entry_seed
def test_a_differential_drive_reaches_its_goal_and_rests(name: str, stop: bool, seed: int) -> None:
    """It faces its goal, so that it is as fast as its wheels; at rest its command is 0."""
    one = world_of_an_entry(seed, stop)
    one = replace(one, max_acceleration=min(one.max_acceleration, 2.0))
    latest = latest_arrival(one, one.max_speed, one.max_acceleration)
    heading = float(np.arctan2(one.way[1], one.way[0]))
    run = driven_on_wheels(WHEELS[name](one), one, heading, 2.0 * latest, SECONDS_AT_REST if stop else 0.0)
    assert run.arrived is not None, one
    assert run.arrived <= latest + 1e-9, one
    assert straight(one, run.positions) <= one.tolerance, one
    if stop:
        there = run.times >= run.arrived - 1e-9
        away = float(np.linalg.norm(run.positions[there] - one.place, axis=1).max())
        assert away <= one.tolerance + 1e-9, one
        late = run.times > run.arrived + 0.5 * SECONDS_AT_REST
        speed, turn = np.abs(run.commands[late]).max(axis=0)
        assert speed <= 1e-3 * one.max_speed, one
        assert turn * drive_of(one).lever <= 1e-3 * one.max_speed, one


@pytest.mark.parametrize("tolerance", [0.1, 0.02, 0.005])
@pytest.mark.parametrize("kinematics", ["Omni, max_speed: 0.166", "2WDiff, wheel_axis: 0.094, max_speed: 0.166"])
def test_an_agent_of_navground_reaches_its_target_and_rests(kinematics: str, tolerance: float) -> None:
    """By default it reaches its speed of 0.12 m/s within 0.3 s."""
    core = pytest.importorskip("navground.core", reason="the package navground is not installed")
    core.load_plugins()
    agent, place, h, v = core.Behavior.make_type("Slalom"), np.array([2.0, 0.0]), 0.1, 0.12
    agent.kinematics, agent.radius = core.Kinematics.load(f"{{type: {kinematics}}}"), 0.08
    agent.optimal_speed, agent.keep_right, agent.target = v, 0.0, core.Target.Point(place, tolerance)
    agent.prepare()
    latest, path, twists = 1.1 * stopping_time(2.0, 0.0, v, v / 0.3) + 4.0 * h, [], []
    for _ in range(round((latest + SECONDS_AT_REST) / h)):
        path.append(np.array(agent.position, dtype=np.float64))
        command = agent.compute_cmd(h)
        twists.append((*command.velocity, command.angular_speed))
        agent.actuate(command, h)
    agent.close()
    there = np.linalg.norm(np.array(path) - place, axis=1)[round(latest / h) :]
    assert float(there.max()) <= tolerance + 1e-5
    assert float(np.abs(twists[-round(0.5 * SECONDS_AT_REST / h) :]).max()) <= 1e-3 * v


@pytest.mark.adapters
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("threshold", [0.25, 0.05])
@pytest.mark.parametrize("kind", ["omni", "diff", "acker"])
def test_a_robot_of_irsim_reaches_its_goal_and_rests(tmp_path: Path, kind: str, threshold: float) -> None:
    """Its speed is at most 1.2 m/s, and its acceleration 2 m/s^2."""
    simulator = pytest.importorskip("irsim", reason="the package ir-sim is not installed")
    import slalom.adapters.irsim  # noqa: F401  # registers the behaviour

    text = robot_of_irsim(kind, "name: slalom", [1, 5, 0], [9, 5, 0]).replace("0.25", f"{threshold}")
    (tmp_path / "world.yaml").write_text(f"world: {{height: 10, width: 12, step_time: 0.1}}\nrobot:\n{text}")
    env = simulator.make(str(tmp_path / "world.yaml"), display=False, log_level="ERROR")
    latest, path = 1.1 * stopping_time(8.0, 0.0, 1.2, 2.0) + 0.4, []
    for _ in range(round((latest + SECONDS_AT_REST) / 0.1)):
        env.step()
        path.append(env.robot_list[0].state[:3, 0].copy())
    env.end(0)
    there = np.array(path)[round(latest / 0.1) :]
    assert float(np.linalg.norm(there[:, :2] - (9.0, 5.0), axis=1).max()) <= threshold
    assert float(np.abs(np.diff(there[len(there) // 2 :], axis=0)).max()) <= 1e-9
