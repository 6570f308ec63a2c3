"""Robots that must not stop: responses that end in a turn, decisions that are safe by them, and acting early."""

import numpy as np
import pytest
import shapely
from draws import draws
from hypothesis import given, strategies as st
from scipy.integrate import solve_ivp
from strategies import numbers

from slalom import (
    AccelerateThenCoast,
    AccelerateThenStop,
    AccelerateThenTurn,
    Box,
    Circular,
    ConstantVelocity,
    Disc,
    Friction,
    Goal,
    HalfSpace,
    HeadingCone,
    LeastSpeed,
    Limits,
    Navigator,
    Obstacle,
    Outcome,
    Rectangle,
    State,
    Stationary,
    TurningRadius,
    control_obstacle,
    method,
)
from slalom.sim import load, read_scenario
from slalom.sim.files.scenario_writer import write_scenario

turning = st.builds(
    AccelerateThenTurn,
    numbers(0.1, 3.0),
    st.sampled_from([-1.0, 1.0]).flatmap(lambda s: numbers(0.05, 2.0).map(s.__mul__)),
)
"""Left and right, from wide circles to tight ones."""
plane = st.tuples(numbers(-5.0, 5.0), numbers(-5.0, 5.0)).map(np.array)


@given(response=turning, velocity=plane, u=plane, duration=numbers(0.01, 20.0))
def test_motion_is_that_of_the_equations(response, velocity, u, duration) -> None:
    """Against an integrator: the acceleration u, then the rate times the velocity, turned to the left."""

    def held(t, y):
        return [y[2], y[3], *u]

    def turned(t, y):
        return [y[2], y[3], -response.rate * y[3], response.rate * y[2]]

    state, exact = State((1.0, -2.0), velocity), {"rtol": 1e-10, "atol": 1e-11}
    y = np.concatenate([state.position, state.velocity])
    y = solve_ivp(held, (0.0, min(duration, response.hold)), y, **exact).y[:, -1]
    if duration > response.hold:
        y = solve_ivp(turned, (response.hold, duration), y, **exact).y[:, -1]
    np.testing.assert_allclose(response.position(state, duration)(u), y[:2], atol=1e-6)
    np.testing.assert_allclose(response.velocity(state, duration)(u), y[2:], atol=1e-6)


@given(response=turning, velocity=plane, u=plane)
def test_speed_is_kept_and_the_gain_never_vanishes(response, velocity, u) -> None:
    state, times = State((0.0, 0.0), velocity), np.linspace(0.0, 40.0 / abs(response.rate), 4001)[1:]
    speeds = np.linalg.norm(response.velocity(state, times)(u), axis=1)
    after = times >= response.hold
    assert np.ptp(speeds[after]) <= 1e-9 * (1.0 + speeds.max())
    assert np.abs(response.position(state, times).gain).min() > 0.0
    lateral = np.linalg.norm(response.acceleration(state, times)(u), axis=1)[after]
    np.testing.assert_allclose(lateral, abs(response.rate) * speeds[after], atol=1e-9)


@given(response=turning, velocity=plane, u=plane, reach=numbers(0.5, 20.0))
def test_image_and_inverse_agree(response, velocity, u, reach) -> None:
    image = response.position(State((3.0, 1.0), velocity), reach)
    np.testing.assert_allclose(image.inverse(image(u)), u, atol=1e-6 / np.abs(image.gain))


def test_boundary_divides_the_controls_that_collide() -> None:
    """Against the decision of each control in the workspace, for discs and corners, also of a body that turns."""
    shapes = (
        Obstacle(Disc(1.0), ConstantVelocity((8.0, 3.0), (-1.0, 0.0))),
        Obstacle(Rectangle(3.0, 1.0), ConstantVelocity((0.0, 9.0), (1.0, -0.3))),
        Obstacle(Rectangle(3.0, 1.0), Circular((6.0, -4.0), 2.0, 1.0, 0.3), heading="motion"),
    )
    response, state = AccelerateThenTurn(1.0, 0.5), State((0.0, 0.0), (3.0, 0.0))
    blocked = control_obstacle(response, state, shapes, Disc(0.4), horizon=10.0)
    tried = np.random.default_rng(0).uniform(-3.0, 3.0, size=(4000, 2))
    region = blocked.boundary((0.0, 0.0), 4.0).region
    wrong = shapely.contains_xy(region, *tried.T) != blocked.contains(tried)
    assert wrong.sum() <= 40  # 1 %: within the tolerance of the curves, which are drawn in another frame


@given(data=st.data())
def test_rate_of_turns_obeys_all_limits_at_all_headings(data) -> None:
    """Against the half-spaces of each heading, at each speed."""
    bounds = [
        Friction(*(data.draw(numbers(0.2, 4.0)) for _ in range(3))),
        TurningRadius(data.draw(numbers(0.2, 20.0))),
        Box(
            (data.draw(numbers(0.2, 4.0)), data.draw(numbers(0.2, 4.0))), data.draw(st.sampled_from(["world", "body"]))
        ),
        HeadingCone(0.5),
    ]
    some = tuple(bound for bound in bounds if data.draw(st.booleans()))
    flats = (HalfSpace((0.6, 0.8), data.draw(numbers(0.2, 3.0))),) if data.draw(st.booleans()) else ()
    limits = Limits(4.0, 2.0, acceleration_bounds=flats, bounds=some)
    rate, most = limits.turn_rate(1.0), np.inf
    assert rate > 0.0
    for speed in np.linspace(1.0, 4.0, 7):
        for angle in np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False):
            ahead = np.array([np.cos(angle), np.sin(angle)])
            left = np.array([-ahead[1], ahead[0]])
            for side in (-1.0, 1.0):
                acceleration = side * rate * speed * left
                within = 2.0 / np.linalg.norm(acceleration)
                for bound in limits.acceleration_bounds:
                    along = bound.normal @ acceleration
                    within = min(within, bound.offset / along) if along > 0.0 else within
                for bound in limits.bounds:
                    if bound.of == "acceleration":
                        normals, offsets = bound.half_spaces(State((0.0, 0.0), speed * ahead))
                        along = normals @ acceleration
                        within = min(within, (offsets[along > 0] / along[along > 0]).min(initial=np.inf))
                most = min(most, within)
    assert most >= 1.0 - 1e-9


def test_half_space_of_the_velocity_forbids_turns() -> None:
    assert Limits(4.0, 2.0, velocity_bounds=(HalfSpace((1.0, 0.0), 3.0),)).turn_rate(1.0) == 0.0


def robot(limits: Limits, **settings) -> Navigator:
    return Navigator(method("nao"), Disc(settings.pop("radius", 1.0)), limits, **settings)


def closed_loop(navigator, state, obstacles, goal, steps):
    """The decisions of a robot that follows exactly, each with the state in which it was made."""
    decision, now = None, 0.0
    for k in range(steps):
        decision = navigator.decide(state, obstacles, goal, now=now, previous=decision)
        yield state, now, decision
        now = (k + 1) * navigator.period
        state = decision.manoeuvre.advance(now - decision.manoeuvre.start)


def gap(obstacle, positions, times, radius):
    """Distance (n,) [m] of surfaces of a disc and an obstacle, a disc or a rectangle along the axes."""
    away = positions - obstacle.trajectory.position(times)
    if isinstance(obstacle.shape, Disc):
        return np.linalg.norm(away, axis=1) - obstacle.shape.radius - radius
    beyond = np.abs(away) - obstacle.shape.parts[0].corners.max(axis=0)
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return outside + np.minimum(beyond.max(axis=1), 0.0) - radius


def never_stopping(rng):
    """Random limits with a least speed, and the horizon [s] of a scene at their scale."""
    v = float(np.exp(rng.uniform(0.0, np.log(30.0))))
    a = v * float(np.exp(rng.uniform(np.log(0.1), np.log(1.5))))
    bounds = [LeastSpeed(v * rng.uniform(0.3, 0.95))]
    bounds += [Friction(*(a * rng.uniform(0.3, 1.0, 3)))] if rng.random() < 0.5 else []
    bounds += [TurningRadius(v * v / a * rng.uniform(0.3, 2.0))] if rng.random() < 0.5 else []
    bounds += [HeadingCone(rng.uniform(0.3, 1.5))] if rng.random() < 0.2 else []
    return Limits(v, a, bounds=tuple(bounds)), v / a * rng.uniform(3.0, 10.0)


def hall_and_traffic(rng, size, horizon):
    """Walls around a square of a half width, and discs and boxes at rest and in motion in it."""
    walls = [Rectangle(2.2 * size, 0.02 * size), Rectangle(0.02 * size, 2.2 * size)]
    found = [
        Obstacle(walls[axis], Stationary(side * size * np.eye(2)[1 - axis]))
        for axis in range(2)
        for side in (-1.0, 1.0)
    ]
    for _ in range(int(rng.integers(1, 10))):
        place, half = rng.uniform(-0.9, 0.9, 2) * size, size * rng.uniform(0.02, 0.12)
        shape = Disc(half) if rng.random() < 0.6 else Rectangle(2.0 * half, half * rng.uniform(0.2, 1.0))
        speed = size / horizon * rng.uniform(0.2, 2.0)
        motions = (
            Stationary(place),
            ConstantVelocity(place, speed * rng.normal(size=2)),
            Circular(place, 0.3 * size, rng.uniform(0.0, 6.0), speed / (0.3 * size)),
        )
        found.append(Obstacle(shape, motions[rng.integers(3)]))
    return found


@pytest.mark.parametrize("seeds", draws([range(k, k + 3) for k in range(0, 60, 3)]))
def test_safe_decisions_rest_on_motion_that_the_limits_allow(seeds) -> None:
    """Dense samples of every safe manoeuvre: nothing is touched up to the horizon, and no bound is broken after it."""
    ended_in_a_turn = 0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        limits, horizon = never_stopping(rng)
        v, least = limits.max_speed, limits.bounds[0].least
        size, radius = v * horizon * rng.uniform(0.15, 0.6), 0.01 * v * horizon
        obstacles, angle = hall_and_traffic(rng, size, horizon), rng.uniform(0.0, 2.0 * np.pi)
        state = State((0.0, 0.0), rng.uniform(least, v) * np.array([np.cos(angle), np.sin(angle)]))
        navigator = robot(
            limits, radius=radius, period=horizon / 100, horizon=horizon, margin=0.0, holds=(horizon / 25, horizon / 8)
        )
        goal = Goal(Stationary(rng.uniform(-0.9, 0.9, 2) * size), radius)
        for before, now, decision in closed_loop(navigator, state, obstacles, goal, 12):
            if not decision.safe:
                continue
            times = now + np.linspace(0.0, horizon, 1500, endpoint=False)
            manoeuvre = decision.manoeuvre
            ended_in_a_turn += isinstance(manoeuvre.response, AccelerateThenTurn)
            positions, velocities = manoeuvre.position(times), manoeuvre.velocity(times)
            assert min(gap(each, positions, times, radius).min() for each in obstacles) > -1e-5 * size
            speeds, first = np.linalg.norm(velocities, axis=1), np.linalg.norm(before.velocity)
            assert speeds.min() >= min(least, first) - 1e-6 * v
            assert speeds.max() <= max(v, first) + 1e-6 * v
            if isinstance(manoeuvre.response, AccelerateThenTurn):
                after = np.flatnonzero(times > manoeuvre.start + manoeuvre.response.hold)[::300]
                for k in after.tolist():
                    acceleration = manoeuvre.acceleration(times[k])
                    assert limits.allows(State(positions[k], velocities[k]), acceleration, 1e-6), limits
    if 3 in seeds:
        assert ended_in_a_turn > 0


def test_robot_circles_in_a_closed_hall_for_ever() -> None:
    """Its goal is behind a wall; three horizons long every decision is safe, and it never gets slower."""
    limits = Limits(10.0, 4.0, bounds=(LeastSpeed(8.0),))
    walls = [Rectangle(142.0, 1.0), Rectangle(1.0, 142.0)]
    hall = [Obstacle(walls[k], Stationary(side * 70.0 * np.eye(2)[1 - k])) for k in range(2) for side in (-1.0, 1.0)]
    navigator = robot(limits, period=0.5, horizon=20.0, holds=(0.5, 1.0, 2.0))
    kinds = set()
    begin = State((-40.0, 0.0), (9.0, 0.0))
    for state, _, decision in closed_loop(navigator, begin, hall, Goal(Stationary((500.0, 0.0))), 120):
        assert decision.safe, decision
        assert np.linalg.norm(state.velocity) >= 8.0 - 1e-9
        assert np.abs(state.position).max() <= 68.5 + 1e-6
        kinds.add(type(decision.manoeuvre.response))
    assert AccelerateThenTurn in kinds


def test_responses_of_a_robot_that_must_not_stop() -> None:
    limits = Limits(10.0, 2.0, bounds=(LeastSpeed(8.0),))
    for name in ("nao", "ao"):
        row = method(name)
        for found in (row.responses(limits, 0.1, (0.5, 1.0)), row.among_robots().responses(limits, 0.1, (0.5, 1.0))):
            assert {type(each) for each in found} == {AccelerateThenCoast}
        assert {each.rate for each in row.turning(limits, 0.1, (0.5,))} == {-0.2, 0.2, -0.1, 0.1}
        assert any(isinstance(each, AccelerateThenStop) for each in row.responses(Limits(10.0, 2.0), 0.1, (0.5,)))


@pytest.mark.parametrize("early", [True, False])
def test_robot_acts_early_if_it_shall(early) -> None:
    """A crossing 300 s ahead, a horizon of 200 s: it acts when the horizon shows it, or when it could hardly stop."""
    limits = Limits(6.0, 0.08)
    ship = Obstacle(Disc(400.0), ConstantVelocity((1800.0, 1800.0), (-6.0, 0.0)))
    navigator = Navigator(
        method("nao"), Disc(50.0), limits, period=5.0, horizon=200.0, holds=(5.0, 10.0, 40.0, 80.0), early=early
    )
    first, goal = np.inf, Goal(Stationary((0.0, 6000.0)), 100.0)
    for _, now, decision in closed_loop(navigator, State((0.0, 0.0), (0.0, 6.0)), [ship], goal, 70):
        assert decision.safe
        if decision.outcome is Outcome.CONSTRAINED:
            first = min(first, now)
    assert (first <= 60.0) == early, first


def test_robot_that_acts_early_comes_to_rest_in_a_dead_end() -> None:
    walls = [
        Obstacle(Rectangle(4.0, 0.5), Stationary((4.0, 0.0))),
        Obstacle(Rectangle(20.0, 0.5), Stationary((0.0, 2.0))),
        Obstacle(Rectangle(20.0, 0.5), Stationary((0.0, -2.0))),
        Obstacle(Rectangle(0.5, 4.0), Stationary((-6.0, 0.0))),
        Obstacle(Rectangle(0.5, 4.0), Stationary((3.0, 0.0))),
    ]
    navigator = Navigator(method("nao"), Disc(0.4), Limits(1.0, 1.0), horizon=20.0, early=True)
    goal = Goal(Stationary((20.0, 0.0)), 0.3)
    found = list(closed_loop(navigator, State((-2.0, 0.0), (1.0, 0.0)), walls, goal, 120))
    assert all(decision.safe for _, _, decision in found)
    assert np.linalg.norm(found[-1][0].velocity) < 0.2


def test_early_is_a_setting_of_scenarios_and_files(tmp_path) -> None:
    scenario = load("head_on").with_settings({"early": 1})
    assert scenario.early
    assert scenario.navigator(method("nao")).early
    write_scenario(scenario, tmp_path / "early.yaml")
    assert read_scenario(tmp_path / "early.yaml").early
