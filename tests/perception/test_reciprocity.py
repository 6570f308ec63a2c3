"""How much agents yield: the conflict by search, the share of agents that do a known part, and robots that use it."""

import importlib.util
import sys
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from draws import draws

from slalom import Disc, Goal, Limits, Navigator, Obstacle, Reciprocity, State, Stationary, Tracks, method
from slalom.model.trajectory import ConstantVelocity
from slalom.perception.reciprocity import conflict
from slalom.sim import gallery

FILE = Path(__file__).parents[2] / "benchmarks" / "reciprocity.py"


@pytest.fixture(scope="module")
def benchmark() -> ModuleType:
    spec = importlib.util.spec_from_file_location("reciprocity_benchmark", FILE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["reciprocity_benchmark"] = module
    spec.loader.exec_module(module)
    return module


def touches(position: np.ndarray, velocity: np.ndarray, radius: float, horizon: float) -> bool:
    """Whether two discs touch within the horizon: the least distance at constant velocity, in closed form."""
    square = velocity @ velocity
    t = min(max(position @ velocity / square, 0.0), horizon) if square > 0.0 else 0.0
    return float(np.linalg.norm(position - t * velocity)) < radius


@pytest.mark.parametrize("seed", draws(range(60), first=20))
def test_a_conflict_is_the_least_change_that_avoids_it(seed):
    """No smaller change of the relative velocity avoids the contact, and one of that size does."""
    rng = np.random.default_rng(seed)
    position, velocity = rng.uniform(-6.0, 6.0, 2), rng.uniform(-3.0, 3.0, 2)
    if rng.random() < 0.7:
        velocity = position * rng.uniform(0.1, 1.0) + rng.normal(0.0, 0.2, 2)
    radius, horizon = min(rng.uniform(0.2, 1.5), 0.9 * float(np.linalg.norm(position))), rng.uniform(1.0, 6.0)
    found = conflict(position, velocity, radius, horizon)
    angles = np.linspace(0.0, 2.0 * np.pi, 721)
    around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    assert (found > 0.0) == touches(position, velocity, radius, horizon)
    if found > 0.0:
        for share in (0.3, 0.7, 0.99):
            assert all(touches(position, velocity + share * found * w, radius, horizon) for w in around)
        assert not all(touches(position, velocity + 1.001 * found * w, radius - 1e-3, horizon) for w in around)


def shares_of(part: float, steps: int = 6) -> list[float]:
    """The estimated shares of an agent that meets a robot head on, slightly aside, and does a part of the avoidance."""
    estimate, place, speed = Reciprocity(0.4), np.array([6.0, 0.2]), np.array([-1.0, 0.0])
    found, own = [], np.array([1.0, 0.0])
    for k in range(steps):
        state = State((0.1 * k, 0.0), own)
        tracks = Tracks([place], [speed], 0.4, 0.1 * k, ids=["agent"])
        found.append(float(estimate.update(state, tracks).shares[0]))
        left = conflict(place - state.position, own - speed, 0.8, 4.0)
        speed = speed + np.array([0.0, part * left])
        place = place + 0.1 * speed
    return found


def test_the_share_follows_what_an_agent_does():
    """None is assumed at first; an agent that does nothing has none, one that does half has a half, others between."""
    assert shares_of(0.0) == [0.0] * 6
    assert shares_of(0.5)[0] == 0.0
    assert shares_of(0.5)[-1] == 0.5
    middle = shares_of(0.04)[-1]
    assert 0.0 < middle < 0.5
    assert shares_of(-0.2, 3)[-1] == 0.0


def test_agents_are_known_by_their_ids():
    """The order of the tracks does not matter, and an agent that was away begins anew."""
    estimate, state = Reciprocity(0.4), State((0.0, 0.0), (1.0, 0.0))
    for k, speed in enumerate((0.0, 0.5, 0.5)):
        places, speeds = np.array([(5.0, 0.2), (5.0, 3.0)]), np.array([(-1.0, speed), (-1.0, 0.0)])
        order = [k % 2, 1 - k % 2]
        found = estimate.update(
            state, Tracks(places[order], speeds[order], 0.4, 0.1 * k, ids=np.array(["a", "b"])[order].tolist())
        )
    assert dict(zip(found.ids, found.shares > 0.0)) == {"a": True, "b": False}
    estimate.update(state, Tracks(places[1:], speeds[1:], 0.4, 0.3, ids=["b"]))
    assert estimate.update(state, Tracks(places[:1], speeds[:1], 0.4, 0.4, ids=["a"])).shares[0] == 0.0


def navigator() -> Navigator:
    return Navigator(method("nao"), Disc(0.4), Limits(1.5, 2.0))


def chosen(robots: Tracks | None, obstacles: list[Tracks | Obstacle]) -> np.ndarray:
    """The velocity after a second of a robot on its way to a goal."""
    decision = navigator().decide(State((0.0, 0.0), (1.0, 0.0)), obstacles, Goal(Stationary((9.0, 0.0))), robots=robots)
    return decision.manoeuvre.velocity(1.0)


def test_agents_without_a_share_are_obstacles_and_a_half_is_the_default():
    """To the bit, for the method whose share is a half; with a share between, the robot does something between."""
    agent = Tracks([(5.0, 0.1)], [(-1.0, 0.0)], 0.4)
    obstacle, half = chosen(None, [agent.with_forecast(method("nao").robot_forecast)]), chosen(agent, [])
    assert np.array_equal(chosen(agent.with_shares([0.0]), []), obstacle)
    assert np.allclose(chosen(agent.with_shares([0.5]), []), half, atol=1e-9)
    aside = [abs(chosen(agent.with_shares([share]), [])[1]) for share in (0.5, 0.25, 0.02)]
    assert aside[0] < aside[1] < aside[2] <= abs(obstacle[1]) + 0.1


def test_shares_stay_with_their_tracks():
    agents = Tracks(
        [(5.0, 0.1), (6.0, 0.1), (7.0, 0.0)], np.zeros((3, 2)), 0.4, ids=["a", "b", "c"], shares=[0.5, 0.0, 0.2]
    )
    some, rest = agents.yielding
    assert (some.ids, some.shares.tolist(), rest.ids) == (("a", "c"), [0.5, 0.2], ("b",))
    assert agents.with_forecast(method("nao").robot_forecast).shares is agents.shares
    assert Tracks([(1.0, 1.0)], [(0.0, 0.0)], 0.4).yielding[0].ids == (0,)


@pytest.mark.slow
@pytest.mark.skipif(find_spec("pyrvo") is None, reason="needs pyrvo")
@pytest.mark.parametrize("seeds", draws([range(k, k + 4) for k in range(0, 20, 4)]))
def test_among_agents_that_never_yield_the_estimate_costs_no_collision(benchmark, seeds):
    """In circle_random, where a robot that relies on half of the avoidance collides."""
    speeds = []
    for seed in seeds:
        scenario = gallery.build("circle_random", benchmark.SETTINGS["circle_random"], seed=seed)
        kinds = ("obstacles", "estimate", "half")
        speeds.append([benchmark.run(scenario, kind, yields=False).speed for kind in kinds])
    obstacles, estimate, half = np.count_nonzero(speeds, axis=0)
    assert obstacles == estimate == 0
    assert half > 0


def test_obstacles_are_predicted_as_before():
    """Tracks without shares decide as before: none is left out."""
    rock = Obstacle(Disc(0.4), ConstantVelocity((5.0, 0.1), (-1.0, 0.0)))
    tracks = Tracks([(5.0, 0.1)], [(-1.0, 0.0)], 0.4)
    assert np.allclose(chosen(None, [rock]), chosen(None, [tracks]), atol=1e-9)


def test_one_share_is_that_of_all() -> None:
    robot, goal = Navigator(method("nao"), Disc(0.3), Limits(1.5, 2.0)), Goal(Stationary((9.0, 0.0)))
    decisions = []
    for shares in (0.4, [0.4, 0.4]):
        people = Tracks([(4.0, 0.2), (6.0, -0.3)], [(-1.0, 0.0), (-0.5, 0.0)], 0.3, shares=shares)
        decisions.append(robot.decide(State((0.0, 0.0), (1.0, 0.0)), [], goal, robots=people))
    np.testing.assert_array_equal(*(decision.manoeuvre.control for decision in decisions))
