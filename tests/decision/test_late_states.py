"""States that are late or noisy, steps of unequal length, and time that jumps."""

import numpy as np
import pytest

from slalom import (
    Acceleration,
    ConstantVelocity,
    Disc,
    Goal,
    Limits,
    LookAhead,
    Manoeuvre,
    Navigator,
    Obstacle,
    State,
    Stationary,
    TurningRadius,
    Velocity,
    method,
)
from slalom.model.manoeuvre import state_after

GOAL = Goal(Stationary((14.0, 0.0)), 0.3)
PEOPLE = [
    Obstacle(Disc(0.3), ConstantVelocity((6.0, -4.0), (0.0, 0.9)), "a"),
    Obstacle(Disc(0.3), ConstantVelocity((12.0, 0.3), (-1.0, 0.0)), "b"),
    Obstacle(Disc(0.3), ConstantVelocity((9.0, 5.0), (-0.1, -0.9)), "c"),
]


def robot(name: str = "nao", margin: float = 0.05) -> Navigator:
    return Navigator(method(name), Disc(0.3), Limits(1.5, 2.0), period=0.1, margin=margin)


def applied(state: State, motions: list[tuple[float, np.ndarray]], now: float) -> State:
    """The motion under accelerations (time from which each acts, (d,)), integrated one by one in plain numbers."""
    position, velocity = state.position.copy(), state.velocity.copy()
    for (begin, push), end in zip(motions, [*(begin for begin, _ in motions[1:]), now]):
        h = end - begin
        position, velocity = position + h * velocity + 0.5 * h * h * push, velocity + h * push
    return State(position, velocity)


@pytest.mark.parametrize("d", [2, 3])
def test_the_state_after_commitments_is_the_integrated_one(d: int) -> None:
    """From a time between, before or after them, with a deviation from the plans."""
    rng = np.random.default_rng(d)
    for _ in range(20):
        starts, pushes = np.cumsum(rng.uniform(0.05, 0.4, 4)), rng.normal(size=(4, d))
        manoeuvres = [
            Manoeuvre(Acceleration(), State(rng.normal(size=d), rng.normal(size=d)), push, float(start))
            for start, push in zip(starts, pushes)
        ]
        state, measured = State(rng.normal(size=d), rng.normal(size=d)), float(rng.uniform(0.0, 1.5))
        now = measured + float(rng.uniform(0.0, 1.5))
        times = [(measured, np.zeros(d)), *((float(t), p) for t, p in zip(starts, pushes))]
        acting = [(max(t, measured), p) for t, p in times if t < now]
        last = [k for k, (t, _) in enumerate(acting) if t == measured][-1]
        expected = applied(state, acting[last:], now)
        found = state_after(manoeuvres, state, measured, now)
        np.testing.assert_allclose(found.position, expected.position, atol=1e-12)
        np.testing.assert_allclose(found.velocity, expected.velocity, atol=1e-12)


def test_a_commanded_velocity_is_reached() -> None:
    """Of a response that sets the velocity at once, also where it begins meanwhile."""
    state = State((0.0, 0.0), (1.0, 0.0))
    turn = Manoeuvre(Velocity(), state, (0.0, 2.0), 0.5)
    found = state_after([turn], state, 0.0, 1.0)
    np.testing.assert_allclose(found.position, (0.5, 1.0))
    np.testing.assert_allclose(found.velocity, (0.0, 2.0))


def drive(delay: float, told: float, steps: list[float], noise: float = 0.0, margin: float = 0.05, seed: int = 0):
    """Least distance from the people and decisions without a safe manoeuvre, in a loop of steps [s] of these lengths.

    The navigator gets states that are `delay` [s] old and is told `told`; the robot follows the newest manoeuvre from
    the time for which it was decided.
    """
    rng, navigator, decision = np.random.default_rng(seed), robot(margin=margin), None
    truth, now, nearest, unsafe = [(0.0, State((0.0, 0.0), (0.0, 0.0)), None)], 0.0, np.inf, 0
    for h in steps:
        if GOAL.reached(truth[-1][1].position, truth[-1][1].velocity, now):
            break
        seen_at = max(now - delay, 0.0)
        seen = at(truth, seen_at)
        seen = State(seen.position, seen.velocity + rng.uniform(-noise, noise, 2))
        decision = navigator.decide(seen, PEOPLE, GOAL, now=now, previous=decision, delay=min(told, now))
        unsafe += not decision.outcome.safe
        truth[-1] = (now, truth[-1][1], decision.manoeuvre)
        for t in now + h * np.linspace(0.1, 1.0, 10):
            place = at(truth, float(t)).position
            nearest = min(nearest, *(np.linalg.norm(o.trajectory.position(t) - place) - 0.6 for o in PEOPLE))
        truth.append((now + h, at(truth, now + h), decision.manoeuvre))
        now += h
    return nearest, unsafe, now, truth


def at(truth: list, t: float) -> State:
    """The true state at t [s]: the accelerations of what was followed, from the last record before."""
    begin, state, manoeuvre = [one for one in truth if one[0] <= t][-1]
    if manoeuvre is None:
        return state
    error = state.velocity - manoeuvre.velocity(begin)
    position = state.position + manoeuvre.position(t) - manoeuvre.position(begin) + (t - begin) * error
    return State(position, manoeuvre.velocity(t) + error)


@pytest.mark.parametrize("delay", [0.03, 0.1, 0.25])
def test_a_stated_delay_changes_nothing(delay: float) -> None:
    """Without noise the predicted state is the true one: decisions are those of a robot without delay."""
    prompt, late = drive(0.0, 0.0, [0.1] * 200), drive(delay, delay, [0.1] * 200)
    assert prompt[0] > 0.0
    assert prompt[1] == late[1] == 0
    assert late[2] == pytest.approx(prompt[2])
    for (t, one, _), (u, other, _) in zip(prompt[3], late[3]):
        assert t == u
        np.testing.assert_allclose(other.position, one.position, atol=1e-6)


def test_a_delay_without_a_commitment_keeps_the_velocity() -> None:
    state, later = State((0.0, 0.0), (1.0, 0.5)), State((0.3, 0.15), (1.0, 0.5))
    late, prompt = (robot().decide(s, PEOPLE, GOAL, now=2.0, delay=age) for s, age in ((state, 0.3), (later, 0.0)))
    np.testing.assert_allclose(late.manoeuvre.state.position, later.position)
    np.testing.assert_allclose(late.manoeuvre.control, prompt.manoeuvre.control, atol=1e-9)


def test_a_late_state_keeps_its_heading() -> None:
    """A parked car leaves along its heading, whatever the age of its state."""
    facing = 1.2
    limits = Limits(2.0, 1.5, bounds=(TurningRadius(2.0),))
    car = Navigator(method("nao"), Disc(0.3), limits)
    parked = State((0.0, 0.0), (0.0, 0.0), heading=facing)
    first = car.decide(parked, [], GOAL, now=0.0)
    for previous, delay in ((None, 0.1), (None, 0.0), (first, 0.1)):
        decision = car.decide(parked, [], GOAL, now=0.1, previous=previous, delay=delay)
        assert decision.inputs.state.heading == facing
        moved = decision.manoeuvre.position(0.4) - decision.manoeuvre.position(0.1)
        assert np.linalg.norm(moved) > 0.01
        # A turn of the radius 2 m would leave the line by more.
        assert abs(moved[0] * np.sin(facing) - moved[1] * np.cos(facing)) < 0.1 * np.linalg.norm(moved) ** 2 / 2.0


def test_the_commitments_of_a_search_are_kept_too() -> None:
    ahead, decision = LookAhead(robot("nao"), time_horizon=30.0), None
    state = State((0.0, 0.0), (0.0, 0.0))
    for now in (0.0, 0.1, 0.2, 0.3):
        decision = ahead.decide(state, PEOPLE, GOAL, now=now, previous=decision)
        later = decision.state_at(now + 0.1, state, now)
        state = State(later.position, later.velocity)
    start = State((0.0, 0.0), (0.0, 0.0))
    np.testing.assert_allclose(decision.state_at(0.4, start, 0.0).position, state.position, atol=1e-9)


def test_only_a_horizon_of_commitments_is_kept() -> None:
    navigator, decision = robot(), None
    state = State((0.0, 0.0), (0.0, 0.0))
    for k in range(150):
        goal = Goal(Stationary((14.0, 9.0 * (-1) ** k)), 0.3)
        decision = navigator.decide(state, [], goal, now=0.1 * k, previous=decision)
        later = decision.state_at(0.1 * (k + 1), state, 0.1 * k)
        state = State(later.position, later.velocity)
    assert 10 < len(decision.earlier) <= 62


@pytest.mark.parametrize("noise", [0.02, 0.1])
def test_a_noisy_velocity(noise: float) -> None:
    """No collision, if the margin holds what a wrong velocity moves the robot until the next measurement."""
    for seed in range(3):
        nearest, _, now, _ = drive(0.0, 0.0, [0.1] * 300, noise, margin=0.05 + 0.1 * noise, seed=seed)
        assert nearest > 0.0
        assert now < 29.0


def test_steps_of_unequal_length() -> None:
    """From 10 to 400 ms: what is committed to is safe up to the horizon, however late the next decision comes."""
    for seed in range(3):
        steps = np.random.default_rng(seed).uniform(0.01, 0.4, 400).tolist()
        nearest, unsafe, now, _ = drive(0.0, 0.0, steps)
        assert (unsafe, nearest > 0.0, now < 29.0) == (0, True, True)


@pytest.mark.parametrize("jump", [1.0, 5.0, 30.0, 1e4])
def test_time_that_jumps_forward(jump: float) -> None:
    """A robot that stood still meanwhile decides anew: the commitment counts for nothing beyond its time."""
    navigator, wall = robot(), [Obstacle(Disc(1.0), Stationary((3.0, 0.2)), "rock")]
    first = navigator.decide(State((0.0, 0.0), (1.0, 0.0)), wall, GOAL, now=0.0)
    state = State((0.4, 0.0), (0.0, 0.0))
    decision = navigator.decide(state, wall, GOAL, now=jump, previous=first)
    assert decision.outcome.safe
    position, velocity = state.position, state.velocity
    for t in jump + 0.01 * np.arange(500):
        push = decision.manoeuvre.mean_acceleration(t, 0.01)
        position, velocity = position + 0.01 * velocity + 0.5e-4 * push, velocity + 0.01 * push
        assert np.linalg.norm(position - (3.0, 0.2)) > 1.3


@pytest.mark.parametrize("delay", [0.1, 0.25])
def test_a_search_decides_for_the_state_at_which_its_decision_acts(delay: float) -> None:
    """The sequences of a robot that is told of the delay are those of a robot without delay."""
    found = {}
    for age in (0.0, delay):
        ahead, decision, states = LookAhead(robot("nao"), time_horizon=30.0), None, [State((0.0, 0.0), (1.0, 0.0))]
        controls = []
        for k in range(8):
            old = states[max(k - round(age / 0.05), 0)]
            late = min(age, 0.05 * k)
            decision = ahead.decide(old, PEOPLE, GOAL, now=0.05 * k, previous=decision, delay=late)
            controls.append(decision.manoeuvre.mean_acceleration(0.05 * k, 0.05))
            states.append(decision.state_at(0.05 * (k + 1), states[-1], 0.05 * k))
        found[age] = np.array(controls)
    np.testing.assert_allclose(found[delay], found[0.0], atol=1e-6)
