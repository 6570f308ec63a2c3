"""The gallery's scenarios are what they say."""

import inspect

import numpy as np
import pytest

import slalom
from slalom.sim import gallery, metrics, simulate
from slalom.sim.gaps import clearances


@pytest.mark.parametrize("name", gallery.GALLERY)
def test_nao_crosses_every_scenario_without_a_collision(name):
    scenario = gallery.build(name)
    method = "nao_shared" if len(scenario.robots) > 1 else "nao"
    result = metrics.summary(simulate(scenario, slalom.method(method)))
    assert result["arrived"] == len(scenario.robots)
    assert result["collisions"] == 0


@pytest.mark.parametrize("entry", gallery.GALLERY.values(), ids=lambda entry: entry.name)
def test_every_scenario_fits_on_a_screen(entry):
    assert len(inspect.getsource(entry.build).splitlines()) <= 40


@pytest.mark.parametrize("name", gallery.GALLERY)
@pytest.mark.parametrize("seed", range(3))
def test_starts_are_free_of_overlap(name, seed):
    scenario = gallery.build(name, seed=seed)
    for obstacle in scenario.obstacles:
        if obstacle.exists(scenario.start):
            now, place = np.array([scenario.start]), scenario.robot.state.position[None]
            assert clearances(obstacle, scenario.robot.shape, now, place)[0] > 0.0


@pytest.mark.parametrize("seed", range(20))
def test_cars_of_the_roundabout_keep_their_distance(seed):
    """Thirty cars in three lanes, each lane's cars at least 4.5 m of arc apart."""
    cars = gallery.build("roundabout_crossing", seed=seed).obstacles
    assert len(cars) == 30
    for lane, speed in ((12.0, 5.0), (16.0, 6.5), (20.0, 8.0)):
        paths = [car.trajectory for car in cars if car.trajectory.radius == lane]
        assert [path.speed for path in paths] == [speed] * 10
        phases = np.sort([path.phase % (2 * np.pi) for path in paths])
        assert np.diff([*phases, phases[0] + 2 * np.pi]).min() * lane >= 4.5 - 1e-9


def test_on_the_curved_road_vo_flags_a_car_that_nlvo_does_not():
    scenario = gallery.build("curved_road")
    straight_on = scenario.robot.state.velocity
    flagged = {}
    for name in ("vo", "nlvo"):
        navigator = scenario.navigator(slalom.method(name))
        traffic = navigator.foresee(scenario.obstacles, scenario.robot.state, scenario.start)
        blocked = slalom.ControlObstacle(slalom.Velocity(), scenario.robot.state, traffic, scenario.robot.shape)
        flagged[name] = bool(blocked.contains(straight_on))
    assert flagged == {"vo": True, "nlvo": False}


def test_recorded_cars_are_the_recording():
    cars = gallery.build("recorded_roundabout").obstacles
    assert len(cars) == 30
    assert all(car.trajectory.span == (0.0, 119.9) for car in cars)
    assert np.allclose(cars[0].trajectory.position(0.0), (-41.938, 11.278))


@pytest.mark.parametrize("chunk", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 25))])
def test_the_corridor_is_crossed_without_a_collision(chunk):
    """Among walls, a doorway and six people who do not give way: a hundred seeds, four at a time."""
    for seed in range(4 * chunk, 4 * chunk + 4):
        row = metrics.summary(simulate(gallery.build("corridor", seed=seed), slalom.METHODS["nao"], seed=seed))
        assert row["collisions"] == 0, row
        assert row["min_clearance"] >= 0.0, row
        assert row["arrived"] == 1, row
