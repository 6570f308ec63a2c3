"""Arrival at a goal: estimates against motions that no robot can beat, passes against dense samples of the motion."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from parts import TRAJECTORIES

from slalom import Fleet, Goal, Limits, PathGoal, Stationary, method
from slalom.model.shape import Disc
from slalom.model.state import State
from slalom.model.trajectory import Sampled

COORDINATES = st.floats(-40.0, 40.0)
SAMPLES = 20001
CLOSE = 1e-4
"""[m] The least of the dense samples is this close to that of the motion: nearer to the tolerance it says nothing."""


def dense_distance(goal: Goal, begin: State, now: float, duration: float) -> float:
    """The least distance [m] of samples of one step from the goal, which is where it is at each of them."""
    s = np.linspace(0.0, duration, SAMPLES)[:, None]
    positions = begin.position + s * begin.velocity + 0.5 * s * s * begin.acceleration
    return float(np.linalg.norm(positions - goal.position(now + s[:, 0]), axis=1).min())


def states(rng: np.random.Generator, n: int, d: int) -> list[State]:
    """States of fast and slow robots that turn, brake, reverse, go straight or rest."""
    speeds, sizes = 10.0 ** rng.uniform(-2.0, 1.5, (n, 1)), 10.0 ** rng.uniform(-3.0, 2.0, (n, 1))
    velocities, accelerations = speeds * rng.normal(size=(n, d)), sizes * rng.normal(size=(n, d))
    accelerations[::5], velocities[::7] = 0.0, 0.0
    accelerations[::3] = -velocities[::3] * rng.uniform(1.0, 20.0, (len(accelerations[::3]), 1))
    return [State(*row) for row in zip(rng.normal(0.0, 2.0, (n, d)), velocities, accelerations)]


@pytest.mark.parametrize("d", [2, 3])
@given(seed=st.integers(0, 2**32 - 1))
def test_a_goal_at_rest_is_reached_where_dense_samples_come_within_its_tolerance(d: int, seed: int) -> None:
    """Goals beside the motion, at a distance near the tolerance."""
    rng, decided = np.random.default_rng(seed), 0
    for begin in states(rng, 20, d):
        duration, s = float(rng.uniform(0.02, 0.5)), rng.uniform(-0.2, 1.2)
        t = s * duration
        near = begin.position + t * begin.velocity + 0.5 * t * t * begin.acceleration
        goal = Goal(Stationary(near + rng.normal(0.0, 0.3, d)), float(rng.uniform(0.05, 0.8)))
        least = dense_distance(goal, begin, 0.0, duration)
        if abs(least - goal.tolerance) > CLOSE:
            found = goal.reached_during(begin.position, begin.velocity, begin.acceleration, 0.0, duration)
            assert bool(found) == (least <= goal.tolerance)
            decided += 1
    assert decided > 10


@pytest.mark.parametrize("kind", sorted(TRAJECTORIES))
@given(seed=st.integers(0, 2**32 - 1))
def test_a_goal_in_motion_is_reached_where_dense_samples_come_within_its_tolerance(kind: str, seed: int) -> None:
    """Also over the breaks of its motion, and before and after its span."""
    rng = np.random.default_rng(seed)
    trajectory = TRAJECTORIES[kind](2)
    for begin in states(rng, 5, 2):
        now, duration = float(rng.uniform(-2.0, 8.0)), float(rng.uniform(0.05, 1.0))
        goal = Goal(trajectory, float(rng.uniform(0.05, 0.8)))
        t = rng.uniform(0.0, duration)
        moved = t * begin.velocity + 0.5 * t * t * begin.acceleration
        position = goal.position(now + t) + rng.normal(0.0, 0.3, 2) - moved
        begin = State(position, begin.velocity, begin.acceleration)
        least = dense_distance(goal, begin, now, duration)
        if abs(least - goal.tolerance) > CLOSE:
            found = goal.reached_during(position, begin.velocity, begin.acceleration, now, duration)
            assert bool(found) == (least <= goal.tolerance)


@given(seed=st.integers(0, 2**32 - 1), stop=st.booleans())
def test_many_steps_at_once_are_judged_as_one_by_one(seed: int, stop: bool) -> None:
    rng = np.random.default_rng(seed)
    begin, times = states(rng, 12, 2), rng.uniform(0.0, 3.0, (4, 3))
    position, velocity, acceleration = (
        np.array([getattr(one, name) for one in begin]).reshape(4, 3, 2)
        for name in ("position", "velocity", "acceleration")
    )
    for trajectory in (Stationary((0.3, 0.2)), TRAJECTORIES["circular"](2)):
        goal = Goal(trajectory, 0.8, stop)
        found = goal.reached_during(position, velocity, acceleration, times, 0.2)
        assert found.shape == (4, 3)
        for k in np.ndindex(4, 3):
            one = goal.reached_during(position[k], velocity[k], acceleration[k], times[k], 0.2)
            assert one.shape == ()
            assert one == found[k]


@given(seed=st.integers(0, 2**32 - 1))
def test_a_goal_to_stop_at_is_not_reached_by_passing(seed: int) -> None:
    """The state at the end of the step alone decides, as that of a sample."""
    rng = np.random.default_rng(seed)
    for begin in states(rng, 20, 2):
        v, a = begin.velocity, begin.acceleration
        end, after = begin.position + 0.2 * (v + 0.1 * a), v + 0.2 * a
        for place in (end, begin.position + 0.1 * (v + 0.05 * a)):
            goal = Goal(Stationary(place), 0.3, stop=True)
            assert goal.reached_during(begin.position, v, a, 1.0, 0.2) == goal.reached(end, after, 1.2)
    fast = Goal(Stationary((2.0, 0.0)), 0.5, stop=True)
    assert not fast.reached_during(np.zeros(2), np.array([20.0, 0.0]), np.zeros(2), 0.0, 0.2)


def test_the_end_of_a_path_is_passed_between_samples_too() -> None:
    step = np.array([18.0, 0.1]), np.array([20.0, 0.0]), np.zeros(2), 0.0, 0.2
    assert PathGoal([(0, 0), (20, 0)], stop=False).reached_during(*step)
    assert not PathGoal([(0, 0), (20, 0)], stop=True).reached_during(*step)


def test_a_goal_with_a_corner_within_a_step_is_met_there() -> None:
    """The goal comes to the robot and leaves again between the ends of the step."""
    goal = Goal(Sampled([0.0, 0.05, 0.1, 9.0], [(0.0, 3.0), (0.0, 0.5), (0.0, 3.0), (0.0, 3.0)], "linear"), 0.51)
    assert goal.reached_during(np.zeros(2), np.zeros(2), np.zeros(2), 0.0, 0.1)
    assert not goal.reached_during(np.zeros(2), np.zeros(2), np.zeros(2), 0.1, 0.1)


def test_a_guided_fleet_notes_a_goal_that_was_passed_between_two_steps() -> None:
    """Not one that is given after the pass."""
    fleet = Fleet(method("nao"), Disc(0.3), Limits(20.0, 2.0), robots=3, period=0.2, guided=True)
    starts, velocities = np.array([(0.0, 0.0), (0.0, 20.0), (0.0, 40.0)]), np.full((3, 2), (20.0, 0.0))
    goals = np.array([(2.0, 0.1), (2.0, 20.1), (60.0, 40.0)])
    stops = [False, True, False]
    fleet.step(0.0, starts, velocities, goals, tolerances=0.5, stop=stops)
    assert fleet.guidance is not None
    assert fleet.guidance.guide.arrived.tolist() == [False, False, False]
    goals[2] = (2.0, 40.1)
    fleet.step(0.2, starts + np.array([4.0, 0.0]), velocities, goals, tolerances=0.5, stop=stops)
    assert fleet.guidance.guide.arrived.tolist() == [True, False, False]


@given(
    place=st.tuples(COORDINATES, COORDINATES),
    velocity=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)),
    max_acceleration=st.floats(0.2, 5.0),
    max_speed=st.floats(0.5, 5.0),
    tolerance=st.floats(0.1, 1.0),
)
def test_no_arrival_is_sooner_than_full_acceleration_along_the_line(
    place: tuple[float, float],
    velocity: tuple[float, float],
    max_acceleration: float,
    max_speed: float,
    tolerance: float,
) -> None:
    """The component of the motion towards the goal is that of a robot on a line."""
    position, v = np.array(place), np.array(velocity)
    distance = float(np.linalg.norm(position)) - tolerance
    if distance <= 0.0:
        return
    towards = -float(v @ position) / float(np.linalg.norm(position))
    fast = max(max_speed, float(np.linalg.norm(v)))
    until_fast = (fast - towards) / max_acceleration
    covered = 0.5 * (fast + towards) * until_fast
    if covered < distance:
        soonest = until_fast + (distance - covered) / fast
    else:
        soonest = (np.sqrt(towards**2 + 2.0 * max_acceleration * distance) - towards) / max_acceleration
    goal = Goal(Stationary((0.0, 0.0)), tolerance)
    assert goal.time_to_go(position, v, 0.0, Limits(max_speed, max_acceleration)) >= soonest * (1.0 - 1e-9)
