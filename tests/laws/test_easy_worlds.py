"""The easiest worlds: a robot alone drives straight, arrives and rests, in times known in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from draws import draws, draws_of
from easy_worlds import (
    AT_TOP_SPEED,
    NO_CHANGE,
    PERIODS,
    RADIUS,
    SECONDS_AT_REST,
    World,
    alone,
    assert_rests,
    braking_first,
    direction,
    driven,
    lag,
    log_uniform,
    passing_time,
    stopping_time,
    straight,
    world,
)
from hypothesis import given, settings, strategies as st

from slalom import METHODS, ConstantVelocity, Fleet, Limits, Obstacle, State
from slalom.model.shape import Disc

ALONE = [name for name, method in METHODS.items() if not method.shared]
VELOCITY = ("vo", "rvo", "nlvo", "avo")
FLEETS = ("nao", "nao_shared", "ao", "vo", "rvo")

each_method = pytest.mark.parametrize("name", draws_of({name: name for name in ALONE}, "nao", "nao_ahead", "vo", "avo"))
each_part = pytest.mark.parametrize("part", draws(range(4)))
"""In the plane and, for odd parts, in space."""
few = settings(max_examples=max(2, settings.default.max_examples // 5))
seeds = given(seed=st.integers(0, 2**32 - 1))


def generator(seed: int, part: int) -> tuple[np.random.Generator, int]:
    """A generator and the dimension of a part of the draws."""
    return np.random.default_rng([seed, part]), 2 + part % 2


@each_method
@each_part
@few
@seeds
def test_a_goal_to_pass_is_reached_as_soon_as_the_limits_allow(name: str, part: int, seed: int) -> None:
    """In a straight line, with few changes of the acceleration and none at the largest speed."""
    rng, d = generator(seed, part)
    one = world(rng, d, stop=False)
    v, a = one.max_speed, one.max_acceleration
    best = passing_time(one.length - one.tolerance, one.speed, v, a)
    run = driven(alone(name, one), one, 3.0 * best + 5.0)
    assert run.arrived is not None, one
    assert run.arrived <= 1.01 * best + lag(name, one, one.speed) + 2.0 * one.period + 1e-9, (one, run.arrived, best)
    assert straight(one, run.positions) <= one.tolerance, one
    changed = run.changes > NO_CHANGE * a
    # A step near the largest speed may still accelerate to it.
    speeds = np.linalg.norm(run.velocities, axis=1)
    fast = np.flatnonzero((speeds[:-1] > AT_TOP_SPEED * v) & (np.diff(speeds) <= 1e-9 * v))
    times = run.times[1:][changed]
    # The last steps aim at the goal itself.
    assert not np.any(changed[fast[:-4]]), (one, times)
    # A velocity that is approached with a lag changes the acceleration at each step.
    if name != "avo":
        assert len(times) <= (6 if name in VELOCITY else 3), (one, times)


@each_method
@each_part
@few
@seeds
def test_a_robot_stops_at_its_goal_and_rests_there(name: str, part: int, seed: int) -> None:
    """It is never past the goal by more than the tolerance."""
    rng, d = generator(seed, part)
    one = world(rng, d)
    best = stopping_time(one.length, one.speed, one.max_speed, one.max_acceleration)
    run = driven(alone(name, one), one, 2.0 * best + 40.0, SECONDS_AT_REST)
    assert run.arrived is not None, one
    assert run.arrived <= 1.1 * best + lag(name, one) + 4.0 * one.period + 1e-9, (one, run.arrived, best)
    beyond = float(((run.dense(one.period) - np.array(one.place)) @ (one.way / one.length)).max())
    assert beyond <= one.tolerance, one
    assert_rests(one, run, run.arrived)


@each_method
@pytest.mark.parametrize("part", draws(range(4)))
@few
@seeds
def test_a_robot_that_starts_in_any_direction_arrives_and_rests(name: str, part: int, seed: int) -> None:
    """Hardly later than by braking to rest first."""
    rng, d = generator(seed, part)
    one = world(rng, d)
    velocity = one.max_speed * rng.uniform(0.3, 1.0) * direction(rng, d)
    one = replace(one, velocity=tuple(velocity.tolist()))
    bound = braking_first(one)
    run = driven(alone(name, one), one, 2.0 * bound + 40.0, SECONDS_AT_REST)
    assert run.arrived is not None, one
    assert run.arrived <= 1.1 * bound + lag(name, one) + 4.0 * one.period + 1e-9, (one, run.arrived, bound)
    assert_rests(one, run, run.arrived)


def at_its_goal(rng: np.random.Generator, d: int, tolerance: float | None = None) -> World:
    """A robot at rest within the tolerance of its goal."""
    one = world(rng, d)
    reach = tolerance or one.tolerance
    start = np.array(one.place) + reach * rng.uniform(0.0, 0.99) * direction(rng, d)
    return replace(one, tolerance=reach, start=tuple(start.tolist()), velocity=(0.0,) * d)


@each_method
@each_part
@few
@seeds
def test_a_robot_at_rest_at_its_goal_stays(name: str, part: int, seed: int) -> None:
    """From the first decision on, also away from the middle of the goal."""
    one = at_its_goal(*generator(seed, part))
    run = driven(alone(name, one), one, 0.0, 20.0 * one.period)
    largest = float(np.abs(run.accelerations).max())
    assert largest <= 1e-9 * one.max_acceleration, one


@pytest.mark.parametrize("name", [name for name in ALONE if not METHODS[name].looks_ahead])
@each_part
@few
@seeds
def test_a_robot_comes_to_rest_relative_to_a_goal_in_motion(name: str, part: int, seed: int) -> None:
    """Its speed is at most 0.6 of the largest of the robot."""
    rng, d = generator(seed, part)
    one = world(rng, d)
    drift = one.max_speed * rng.uniform(0.1, 0.6) * direction(rng, d)
    one = replace(one, drift=tuple(drift.tolist()))
    run = driven(alone(name, one), one, 2.0 * braking_first(one) + lag(name, one) + 4.0 * one.period, SECONDS_AT_REST)
    assert run.arrived is not None, (one, braking_first(one))
    assert_rests(one, run, run.arrived)


@each_method
@each_part
@few
@seeds
def test_errors_of_measurement_do_not_move_a_robot_at_rest_at_its_goal(name: str, part: int, seed: int) -> None:
    """Once at rest, it stays while it is measured within the tolerance, at a speed up to the tolerance per second.

    The goal has a tolerance of 0.2 m. Errors have a standard deviation of 2 cm and 2 cm/s, so a tenth of both bounds.
    """
    rng, d = generator(seed, part)
    one = at_its_goal(rng, d, 0.2)
    one = replace(one, start=tuple((np.array(one.place) + 0.05 * direction(rng, d)).tolist()))
    robot, begin = alone(name, one), 3.0 * one.period

    def decide(state: State, now: float) -> np.ndarray:
        errors = rng.normal(0.0, 0.02, (2, d)) if now > begin else np.zeros((2, d))
        return robot(State(state.position + errors[0], state.velocity + errors[1]), now)

    run = driven(decide, one, 0.0, SECONDS_AT_REST)
    largest = float(np.abs(run.accelerations).max())
    assert largest <= 1e-9 * one.max_acceleration, (one, run.times[np.any(run.accelerations != 0.0, axis=1)][:3])


@each_method
@pytest.mark.parametrize("part", draws(range(0, 8, 2)))
@few
@seeds
def test_a_robot_at_its_goal_avoids_a_body_and_comes_back(name: str, part: int, seed: int) -> None:
    """The body moves through the goal at 0.2 to 0.4 of the largest speed of the robot."""
    rng, _ = generator(seed, part)
    one = at_its_goal(rng, 2)
    way, speed = direction(rng, 2), one.max_speed * rng.uniform(0.2, 0.4)
    ahead, beside = 0.7 + 8.0 * speed, rng.uniform(-0.1, 0.1) * np.array([-way[1], way[0]])
    first = np.array(one.start) - ahead * way + beside
    body = Obstacle(Disc(RADIUS), ConstantVelocity(first, speed * way))
    back = (ahead + 3.0) / speed + 3.0 * stopping_time(2.0, 0.0, one.max_speed, one.max_acceleration) + 5.0
    run = driven(alone(name, one, [body]), one, 0.0, back + 10.0)
    places = first + np.linspace(run.times, run.times + one.period, 8, axis=1)[..., None] * (speed * way)
    least = float(np.linalg.norm(run.dense(one.period) - places, axis=-1).min()) - 2.0 * RADIUS
    assert least >= -1e-6, (one, body.trajectory)
    assert_rests(one, run, back)


# Fleets.


@pytest.mark.parametrize("name", FLEETS)
@pytest.mark.parametrize("seed", draws(range(5)))
def test_a_fleet_arrives_and_rests_at_places_side_by_side(name: str, seed: int) -> None:
    """Robots of a grid drive 6 m; their places are 0.3 to 0.6 m apart."""
    rng = np.random.default_rng([seed, 8])
    n, period = int(rng.integers(2, 13)), float(rng.choice(PERIODS))
    v, a, tolerance = 1.5, log_uniform(rng, 1.0, 3.0), 0.2
    side, spacing = int(np.ceil(np.sqrt(n))), 2.0 * RADIUS + rng.uniform(0.3, 0.6)
    p = spacing * np.array([divmod(k, side) for k in range(n)], dtype=float)
    u, goals, about = np.zeros_like(p), p + np.array([6.0, 0.0]), (n, a, period, spacing)
    fleet = Fleet(METHODS[name], Disc(RADIUS), Limits(v, a), robots=n, period=period)
    arrived, k, late = None, 0, []
    while k * period <= (90.0 if arrived is None else arrived + SECONDS_AT_REST):
        acceleration = fleet.step(k * period, p, u, goals, tolerances=tolerance).accelerations
        s = np.linspace(0.0, period, 6)[:, None, None]
        path = p + s * (u + 0.5 * s * acceleration)
        gaps = np.linalg.norm(path[:, :, None] - path[:, None], axis=-1) + 9.0 * np.eye(n) - 2.0 * RADIUS
        assert gaps.min() >= -1e-6, (about, k * period)
        p, u, k = path[-1], u + period * acceleration, k + 1
        away, speeds = np.linalg.norm(p - goals, axis=1), np.linalg.norm(u, axis=1)
        if arrived is None and max(away.max(), speeds.max()) <= tolerance:
            arrived = k * period
        if arrived is not None and k * period > arrived + 0.5 * SECONDS_AT_REST:
            late.append((away.max(), speeds.max() / v, np.linalg.norm(acceleration, axis=1).max() / a))
    assert arrived is not None, (about, away)
    assert np.all(np.max(late, axis=0) <= (tolerance, 1e-3, 1e-3)), (about, np.max(late, axis=0))
