"""Late or lost messages and observations: the guarantee of docs/theory.md 17, and what each method guarantees."""

from dataclasses import replace

import numpy as np
import pytest
from draws import draws, examples
from hypothesis import given, strategies as st

from slalom import METHODS, Disc, Goal, Limits, Outcome, State, Stationary, Union
from slalom.forecast.forecast import FORECASTS, AcceleratingBriefly
from slalom.forecast.linear import linear_forecast
from slalom.model.trajectory import ConstantAcceleration
from slalom.sim import Robot, Scenario, load, simulate
from slalom.sim.gallery import build
from slalom.sim.measure.closest_approach import METRIC
from slalom.sim.measure.metrics import summary
from slalom.sim.run.deciders import FleetDecider
from slalom.sim.run.messages import Messages, messages_of
from slalom.sim.run.states import RobotStates, Sensing, sensing_of

SHARED, OBSERVED = METHODS["nao_shared"], METHODS["nao"]
MESSAGES = 1_000_000
"""How many are sent in all, each of which may be late by up to a second or lost."""


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


def holders(messages: Messages) -> np.ndarray:
    return np.asarray(messages.holds() & messages.holds().T & ~np.eye(len(messages.handovers), dtype=bool))


@pytest.mark.parametrize("seed", draws(range(5), 2))
def test_never_do_both_hold_the_right_of_a_pair(seed):
    scenario = crowd(5, 3.0, seed, message_delay=1.0, message_loss=0.5)
    messages, rng = messages_of(scenario, SHARED, seed), np.random.default_rng(seed)
    positions, present, decided = np.zeros((5, 3)), np.ones(5, bool), np.zeros(5)
    for _ in range(2000):
        messages.deliver(positions)
        assert not holders(messages).any()
        for i in rng.permutation(5):
            if messages.may_decide(i, present):
                decided[i] += 1
        messages.send()
        assert not holders(messages).any()
    # No robot starves: the right takes turns.
    assert decided.min() > 0.8 * decided.max() > 10


@pytest.mark.parametrize("seed", draws(range(3)))
def test_a_robot_that_decides_has_the_commitments_of_all_near_it(seed):
    """The claim on which the proof rests, with robots that walk at random and change whenever they may."""
    scenario = crowd(6, 25.0, seed, message_delay=0.7, message_loss=0.4)
    messages, rng = messages_of(scenario, SHARED, seed), np.random.default_rng(seed)
    positions = np.zeros((6, 3))
    positions[:, :2] = [robot.state.position for robot in scenario.robots]
    changed, by_news, by_distance, heading = np.full(6, -1), 0, 0, rng.normal(size=(6, 2))
    for step in range(3000):
        messages.deliver(positions)
        for i in rng.permutation(6):
            if not messages.may_decide(i, np.ones(6, bool)):
                continue
            for j in set(range(6)) - {i}:
                if np.linalg.norm(positions[i] - positions[j]) <= messages.apart[i, j]:
                    assert changed[j] <= messages.received[i, j]
                    by_news += 1
                else:
                    by_distance += 1
            changed[i] = step
        messages.send()
        turned = rng.normal(size=(6, 2))
        heading = np.where(rng.random((6, 1)) < 0.01, turned, heading)
        positions[:, :2] += (
            messages.max_speed[:, None] * messages.period * heading / np.linalg.norm(heading, axis=1)[:, None]
        )
        positions[:, :2] = np.clip(positions[:, :2], -50.0, 50.0)
    assert by_news > 100
    assert by_distance > 100


def run_of(seed: int, count: int, duration: float):
    """A random run of which a third of the messages are lost and the others late."""
    loss = float(np.random.default_rng(seed).uniform(0.05, 0.6))
    scenario = crowd(count, 4.0, seed, message_delay=1.0, message_loss=loss, duration=duration)
    recording = simulate(scenario, SHARED, seed=seed)
    return recording, count * (count - 1) * len(recording.accelerations)


@pytest.mark.parametrize("seed", draws(range(4), 2))
def test_no_collision_whatever_is_late_or_lost(seed):
    recording, _ = run_of(seed, 6, 25.0)
    assert summary(recording)["collisions"] == 0


@pytest.mark.draw(2)
def test_no_collision_in_a_million_messages_late_or_lost():
    sent, seed, moved, arrived = 0, 100, 0.0, 0
    while sent < MESSAGES:
        recording, messages = run_of(seed, 12, 40.0)
        result = summary(recording)
        assert result["collisions"] == 0, seed
        moved += float(np.linalg.norm(np.diff(recording.positions, axis=0), axis=2).sum())
        arrived += result["arrived"]
        sent, seed = sent + messages, seed + 1
    # They did not stay where they were: on average 6 of 12 arrive, and 2 to 8 in a run. Processors with other last bits
    # have other runs.
    assert moved > 12 * (seed - 100)
    assert arrived > 4 * (seed - 100)


def test_robots_arrive_though_messages_are_late_and_lost():
    scenario = build("circle", {"robots": 6, "message_delay": 1.0, "message_loss": 0.3, "duration": 120.0})
    result = summary(simulate(scenario, SHARED))
    assert result["collisions"] == 0
    assert result["arrived"] == 6


def test_robots_that_may_not_change_say_so():
    scenario = build("circle", {"robots": 4, "message_delay": 1.0, "duration": 5.0})
    outcomes = {outcome for row in simulate(scenario, SHARED).outcomes for outcome in row}
    assert Outcome.WAITING.name in outcomes
    assert Outcome.WAITING.safe


def test_the_decision_right_goes_around_with_the_messages():
    """The messages alone determine when a robot may decide."""
    scenario = crowd(4, 3.0, 1, message_delay=0.6, message_loss=0.2)
    plain = replace(scenario, robots=tuple(replace(r, shape=Union((r.shape,))) for r in scenario.robots))
    fleets = [FleetDecider(s, SHARED, 7) for s in (scenario, plain)]
    for step in range(60):
        waits = []
        for fleet in fleets:
            outcomes, _ = fleet.decide(0.1 * step)
            waits.append([outcomes[k] == "WAITING" for k in range(4)])
        assert waits[0] == waits[1]
    assert all(np.any(list(fleet.fleet.information.handovers)) for fleet in fleets)


def test_what_was_said_is_forgotten_once_all_have_heard_more():
    scenario = crowd(4, 3.0, 1, message_delay=0.6, message_loss=0.2)
    fleet = FleetDecider(scenario, SHARED, 7)
    for step in range(200):
        fleet.decide(0.1 * step)
    assert len(fleet.fleet.information._sent) < 30
    assert len(fleet.fleet.information._positions) < 30


def test_messages_and_sensing_exist_only_where_needed():
    perfect = crowd(3, 3.0, 0)
    late, blurred = replace(perfect, message_delay=0.5), replace(perfect, sight_noise=0.1)
    assert messages_of(perfect, SHARED, 0) is None
    assert messages_of(late, OBSERVED, 0) is None
    assert sensing_of(RobotStates(perfect), OBSERVED, 0) is None
    assert sensing_of(RobotStates(blurred), SHARED, 0) is None
    assert messages_of(late, SHARED, 0) is not None
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


def test_robots_with_a_forecast_that_is_no_table_run_too():
    class Curved:
        includes_future = False

        def __call__(self, trajectory, now):
            position, velocity = trajectory.position(now), trajectory.velocity(now)
            return Stationary(position + velocity * np.linalg.norm(velocity))

    scenario = build("circle", {"robots": 2, "duration": 3.0})
    recording = simulate(scenario, replace(OBSERVED, robot_forecast=Curved()))
    assert len(recording.accelerations) == 30
