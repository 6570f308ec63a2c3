"""Dynamic window, sampling and barriers: laws of one decision and of runs, and settings that are refused."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from draws import examples
from hypothesis import assume, given, strategies as st

from slalom import ConstantVelocity, Disc, Goal, Limits, Obstacle, State, Stationary
from slalom.peers import PEERS, Discs, Team
from slalom.peers.crowd import surroundings
from slalom.peers.methods import BarrierFilter, DynamicWindow, PathIntegral
from slalom.sim import Robot, Scenario, metrics, simulate
from slalom.sim.gallery import build

pytest.importorskip("daqp")

NONE = Discs(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))
PLANNERS = {
    "dwa": partial(DynamicWindow, margin=0.1, horizon=4.0),
    "mppi": partial(PathIntegral, margin=0.1, samples=16),
    "cbf": partial(BarrierFilter, margin=0.1, horizon=10.0),
}


def team(count: int = 1, **fields) -> Team:
    """Discs of half a metre, at most 1.5 m/s and 2 m/s^2, that decide ten times a second."""
    ones = np.ones(count)
    return Team(0.5 * ones, 1.5 * ones, 2.0 * ones, 0.1)._replace(**fields)


def scenario(*obstacles: Obstacle, start=(0.0, 0.0), velocity=(0.0, 0.0), goal=(8.0, 0.0)) -> Scenario:
    me = Robot(Disc(0.5), Limits(1.5, 2.0), State(start, velocity), Goal(Stationary(goal), 0.3))
    return Scenario("own", (me,), obstacles, duration=20.0)


vectors = st.tuples(*2 * [st.floats(-1.0, 1.0)]).map(np.array)


@pytest.mark.parametrize("name", PLANNERS)
@examples(25)
@given(vectors, vectors, st.lists(st.tuples(vectors, vectors), max_size=3))
def test_answers_keep_the_limits(name, velocity, preferred, others):
    """One period of the largest acceleration suffices, and the largest speed is not exceeded."""
    discs = Discs(
        np.array([4.0 * p for p, _ in others]).reshape(-1, 2),
        np.array([v for _, v in others]).reshape(-1, 2),
        np.full(len(others), 0.5),
    )
    chosen = PLANNERS[name](team()).choose(np.zeros((1, 2)), velocity[None], preferred[None], discs)[0]
    assert np.hypot(*chosen) <= 1.5 * (1 + 1e-6)
    assert np.hypot(*(chosen - velocity)) <= 0.2 * (1 + 1e-6)


@pytest.mark.parametrize("name", ["dwa", "cbf"])
@examples(25)
@given(vectors, vectors)
def test_without_others_the_preferred_velocity_is_chosen_or_approached(name, velocity, change):
    """Among 177 velocities of a window none is better than a preferred one that is within reach."""
    velocity = 0.9 * velocity
    preferred = velocity + 0.13 * change
    assume(np.hypot(*preferred) > 1e-2)  # the heading of a shorter one is that of rounding
    chosen = PLANNERS[name](team()).choose(np.zeros((1, 2)), velocity[None], preferred[None], NONE)[0]
    assert chosen == pytest.approx(preferred, abs=1e-6)


@pytest.mark.parametrize("name", PLANNERS)
def test_a_robot_brakes_before_a_wall_across_its_way(name):
    """Whatever it prefers: the wall is 40 m wide, and the robot comes at the largest speed."""
    wall = np.array([[6.0, -20.0], [6.0, 20.0]])
    crowd = PLANNERS[name](team(walls=(wall,)))
    place, velocity = np.zeros((1, 2)), np.array([[1.5, 0.0]])
    for _ in range(120):
        chosen = crowd.choose(place, velocity, np.array([[1.5, 0.0]]), NONE)
        place, velocity = place + 0.05 * (velocity + chosen), chosen
        assert place[0, 0] <= 5.5
    assert place[0, 0] > 4.0


@examples(10)
@given(st.floats(-0.6, 0.6), st.floats(0.0, 1.5), st.floats(2.5, 6.0))
def test_the_barrier_of_a_disc_at_rest_never_falls_below_zero(offset, speed, distance):
    """h = sqrt(2 a (d - r)) + s with r the sum of the radii, at every state of a run that begins with h >= 0."""
    rock = Obstacle(Disc(1.0), Stationary((distance, offset)))
    run = simulate(scenario(rock, velocity=(speed, 0.0), goal=(10.0, 0.0)), PEERS["cbf"])
    away = run.positions[:, 0] - [distance, offset]
    lengths = np.linalg.norm(away, axis=1)
    rates = np.einsum("ij,ij->i", away, run.velocities[:, 0]) / lengths
    assert lengths.min() >= 1.5
    assert (np.sqrt(2.0 * 2.0 * (lengths - 1.5)) + rates).min() >= 0.0


def test_the_barriers_are_shared_by_robots_that_meet():
    """The least accelerations of two equal robots along their line sum up to what the pair has to give."""
    places, velocities = np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([[1.2, 0.0], [-1.2, 0.0]])
    crowd = BarrierFilter(team(2), margin=0.0, horizon=10.0, gain=1.0)
    around = surroundings(team(2), places, velocities, NONE, 10.0)
    (n0, a0), (n1, a1) = (crowd._barriers(k, places[k], velocities[k], around[k]) for k in (0, 1))
    assert n0 == pytest.approx(-n1)
    root = np.sqrt(2 * 4.0 * 2.0)
    h = root - 2.4
    assert a0 + a1 == pytest.approx([4.0 * 2.4 / root - min(h**3, 10.0 * h)])


def test_mppi_is_the_same_every_time_and_another_seed_is_another_run():
    runs = [
        simulate(
            build("circle", {"robots": 2, "radius": 4, "robot_radius": 0.5, "duration": 2.0}),
            replace(PEERS["mppi"], crowd=partial(PathIntegral, margin=0.1, samples=16, seed=seed)),
        )
        for seed in (1, 1, 2)
    ]
    assert runs[0].digest() == runs[1].digest() != runs[2].digest()


@pytest.mark.parametrize("name", ["mppi", "cbf"])
def test_a_car_that_crosses_is_let_pass(name):
    car = Obstacle(Disc(0.8), ConstantVelocity((4.0, -5.0), (0.0, 1.4)))
    run = simulate(scenario(car), PEERS[name])
    assert np.isfinite(run.arrived[0])
    assert metrics.min_clearance(run) >= 0.0
