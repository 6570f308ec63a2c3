"""Late, inexact and lost observations: what each robot observes, and forecasts as tables."""

from dataclasses import replace

import numpy as np
import pytest
from draws import examples
from hypothesis import given, strategies as st

from slalom import METHODS, Disc, Goal, Limits, State, Stationary
from slalom.forecast.forecast import FORECASTS, AcceleratingBriefly
from slalom.forecast.linear import linear_forecast
from slalom.model.trajectory import ConstantAcceleration
from slalom.sim import Robot, Scenario, load, simulate
from slalom.sim.measure.closest_approach import METRIC
from slalom.sim.measure.metrics import summary
from slalom.sim.run.states import RobotStates, Sensing, sensing_of

SHARED, OBSERVED = METHODS["nao_shared"], METHODS["nao"]


def crowd(count: int, side: float, seed: int, **settings: float) -> Scenario:
    """Robots at random places that want to random places: so near to each other that all must take turns."""
    rng = np.random.default_rng(seed)
    robots: list[Robot] = []
    while len(robots) < count:
        position, goal = rng.uniform(-side, side, (2, 2))
        if min((np.linalg.norm(position - r.state.position) for r in robots), default=9.0) > 1.2:
            limits = Limits(float(rng.uniform(0.8, 2.0)), float(rng.uniform(1.0, 3.0)))
            goal_at = Goal(Stationary(goal), 0.3, stop=True)
            robots.append(Robot(Disc(0.5), limits, State(position, np.zeros(2)), goal_at, f"robot {len(robots)}"))
    return Scenario("crowd", tuple(robots), holds=(0.5, 1.0, 2.0)).with_settings(settings)


def test_sensing_exists_only_where_needed():
    perfect = crowd(3, 3.0, 0)
    blurred = replace(perfect, sight_noise=0.1)
    assert sensing_of(RobotStates(perfect), OBSERVED, 0) is None
    assert sensing_of(RobotStates(blurred), SHARED, 0) is None
    assert sensing_of(RobotStates(blurred), OBSERVED, 0) is not None


def test_sight_is_as_late_as_said():
    scenario = replace(crowd(3, 3.0, 0), sight_delay=0.3)
    states = np.zeros((3, 3, 3))
    watch = Sensing(scenario, states, 0)
    for step in range(10):
        now = 0.1 * step
        watch.observe(states + step, now)
        state, when = watch.state(0, 1)
        assert when == pytest.approx(max(0.0, now - 0.3))
        assert state.position[0] == max(0, step - 3)


def test_sight_is_as_inexact_and_as_seldom_as_said():
    scenario = replace(crowd(3, 3.0, 0), sight_noise=0.2, sight_loss=0.25)
    states, errors, fresh = np.zeros((3, 3, 3)), [], []
    watch = Sensing(scenario, states, 0)
    for step in range(4000):
        before = watch.observed[0, :, 1].copy()
        watch.observe(states, 0.1 * step)
        fresh.append((watch.observed[0, :, 1] != before).any())
        errors.append(watch.observed[0, :, 1, :2])
        assert not watch.observed[..., 2].any()
    assert np.mean(fresh) == pytest.approx(0.75, abs=0.03)
    assert np.std(np.array(errors)[np.array(fresh)]) == pytest.approx(0.2, rel=0.03)


@pytest.mark.parametrize("seed", range(2))
def test_robots_that_see_badly_pass_each_other(seed):
    settings_of = {"robots": 6, "sight_noise": 0.03, "sight_delay": 0.2, "sight_loss": 0.2, "duration": 60.0}
    result = summary(simulate(load("circle", settings_of, seed=seed), OBSERVED, seed=seed))
    assert result["collisions"] == 0
    assert result["arrived"] == 6


@pytest.mark.parametrize("name", [name for name in FORECASTS if name not in ("known", "constant_turn")])
@examples(20)
@given(state=st.lists(st.floats(-5.0, 5.0), min_size=6, max_size=6))
def test_forecasts_as_tables(name, state):
    forecast = FORECASTS[name]
    table = linear_forecast(forecast, 30.0)
    rows = np.array(state).reshape(3, 2)
    path = forecast(ConstantAcceleration(*rows, 0.0), 0.0).path(0.0, 30.0)
    assert np.allclose(table.times, path.times)
    assert np.allclose(table.points(rows[None])[0], path.points, atol=METRIC)


def test_a_forecast_that_is_not_linear_is_no_table():
    class Stopping:
        includes_future = False

        def __call__(self, trajectory, now):
            fast = np.linalg.norm(trajectory.velocity(now)) > 1.0
            return AcceleratingBriefly(0.3 if fast else 0.1)(trajectory, now)

    class Curved:
        includes_future = False

        def __call__(self, trajectory, now):
            position, velocity = trajectory.position(now), trajectory.velocity(now)
            return Stationary(position + velocity * np.linalg.norm(velocity))

    assert linear_forecast(Stopping(), 30.0) is None
    assert linear_forecast(Curved(), 30.0) is None
