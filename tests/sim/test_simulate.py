"""The loop over time: exact steps, the end of a run, the same run again and again."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from motion import drive
from parts import disc_or_ball

from slalom import (
    METHODS,
    Circular,
    ConstantVelocity,
    Goal,
    InvalidInput,
    Limits,
    Obstacle,
    Outcome,
    Sampled,
    State,
    Stationary,
)
from slalom.sim import Recording, Robot, Scenario, decision_at, metrics, simulate
from slalom.sim.gallery import build


def vector(d: int, *values: float) -> np.ndarray:
    """A vector with these first components."""
    return np.array([*values, 0.0, 0.0, 0.0][:d])


def scenario(d: int = 2, **settings) -> Scenario:
    """A robot that passes four obstacles of different kinds on its way to a goal 20 m ahead."""
    robot = Robot(
        disc_or_ball(0.5, d),
        Limits(3.0, 2.0),
        State(np.zeros(d), vector(d, 1.0)),
        Goal(Stationary(vector(d, 20.0)), 0.5),
    )
    stamps = np.linspace(-1.0, 40.0, 30)
    wander = vector(d, 13.0) + np.cumsum(np.random.default_rng(3).normal(0.0, 0.4, (30, d)), axis=0)
    obstacles = (
        Obstacle(disc_or_ball(1.0, d), Stationary(vector(d, 6.0, 0.2)), "rock"),
        Obstacle(disc_or_ball(0.8, d), ConstantVelocity(vector(d, 16.0, 1.0), vector(d, -0.8)), "walker"),
        Obstacle(disc_or_ball(0.6, d), Circular(vector(d, 10.0), 3.0, 1.2, 0.5), "circler"),
        Obstacle(disc_or_ball(0.5, d), Sampled(stamps, wander), "wanderer"),
    )
    return Scenario("four", (robot,), obstacles, duration=30.0, **settings)


def same(a: Recording, b: Recording) -> bool:
    """Whether two runs are the same to the bit, the wall clock aside."""
    arrays = ("times", "positions", "velocities", "accelerations", "controls", "arrived")
    return all(getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in arrays) and (
        (a.responses, a.outcomes, a.digest()) == (b.responses, b.outcomes, b.digest())
    )


@pytest.mark.parametrize("method", ["nlvo", "avo", "nao"])
@pytest.mark.parametrize("d", [2, 3])
def test_replay_of_the_accelerations_is_the_run(d: int, method: str) -> None:
    """To the bit: what is recorded is all there is."""
    start = scenario(d)
    recording = simulate(start, METHODS[method])
    state = start.robot.state
    for k, (acceleration,) in enumerate(recording.accelerations):
        assert state.position.tobytes() == recording.positions[k, 0].tobytes()
        assert state.velocity.tobytes() == recording.velocities[k, 0].tobytes()
        assert recording.acceleration_before(k).tobytes() == state.acceleration.tobytes()
        state = drive(state, acceleration, recording.dt)
    assert state.position.tobytes() == recording.positions[-1, 0].tobytes()
    assert state.velocity.tobytes() == recording.velocities[-1, 0].tobytes()
    assert len(recording.accelerations) > 10


def test_a_step_is_exact() -> None:
    """x + v t + a t^2 / 2, in twice the precision."""
    state = drive(State((1.0, 2.0), (3.0, -1.0)), np.array([0.5, 4.0]), 0.25)
    np.testing.assert_array_equal(state.position, [1.0 + 0.75 + 0.015625, 2.0 - 0.25 + 0.125])
    np.testing.assert_array_equal(state.velocity, [3.125, 0.0])
    np.testing.assert_array_equal(state.acceleration, [0.5, 4.0])


@pytest.mark.parametrize("method", ["nlvo", "nao"])
def test_the_prediction_is_the_simulation(method: str) -> None:
    """A committed manoeuvre passes through the recorded states for as long as it is kept."""
    start = scenario()
    recording = simulate(start, METHODS[method])
    for k in (0, 3, 8, 15):
        manoeuvre = decision_at(recording, start, METHODS[method], k).manoeuvre
        then = recording.times[k + 1]
        np.testing.assert_allclose(manoeuvre.position(then), recording.positions[k + 1, 0], atol=1e-9)
        np.testing.assert_allclose(manoeuvre.velocity(then), recording.velocities[k + 1, 0], atol=1e-9)


def test_decision_at_makes_the_recorded_decision_again() -> None:
    start = scenario(replan=0.3)
    recording = simulate(start, METHODS["nao"])
    for k in (0, 4, 6):
        decision = decision_at(recording, start, METHODS["nao"], k)
        assert decision.manoeuvre.control.tobytes() == recording.controls[k, 0].tobytes()
        assert decision.manoeuvre.response == recording.responses.rows[k][0]
        if recording.outcomes[k][0]:
            assert decision.outcome.name == recording.outcomes[k][0]


def test_the_digest_tells_runs_apart() -> None:
    """Method, margin, seed and start all show in it."""
    short = replace(scenario(), duration=3.0)
    runs = [
        simulate(short, METHODS["nao"]),
        simulate(short, METHODS["nlvo"]),
        simulate(replace(short, margin=0.2), METHODS["nao"]),
        simulate(short, METHODS["nao"], seed=1),
        simulate(replace(short, start=1.0), METHODS["nao"]),
    ]
    assert len({run.digest() for run in runs}) == len(runs)
    assert not same(runs[0], runs[2])


def test_other_seeds_are_other_runs_and_the_same_seed_is_the_same() -> None:
    starts = [build("roundabout_crossing", {"duration": 1.0}, seed=seed) for seed in (0, 0, 1)]
    digests = [simulate(start, METHODS["nlvo"]).digest() for start in starts]
    assert digests[0] == digests[1] != digests[2]


@pytest.mark.parametrize("method", ["nlvo", "avo", "nao"])
@pytest.mark.parametrize("d", [2, 3])
def test_the_order_of_obstacles_does_not_matter(d: int, method: str) -> None:
    """To the bit."""
    one = scenario(d)
    two = replace(one, obstacles=tuple(one.obstacles[k] for k in (2, 0, 3, 1)))
    assert same(*(simulate(replace(s, duration=4.0), METHODS[method]) for s in (one, two)))


def test_decisions_are_due_at_every_replan_only() -> None:
    """In between the committed manoeuvre goes on: the recorded control does not change."""
    recording = simulate(scenario(replan=0.5), METHODS["nao"])
    made = [bool(name) for (name,) in recording.outcomes]
    assert made == [k % 5 == 0 for k in range(len(made))]
    assert np.all((recording.decision_times[:, 0] > 0.0) == made)
    for k in range(len(made)):
        assert recording.controls[k].tobytes() == recording.controls[5 * (k // 5)].tobytes()
    assert np.isfinite(recording.arrived[0])


@pytest.mark.parametrize(("replan", "steps"), [(0.0, 1), (0.1, 1), (0.3, 3), (2.0, 20)])
def test_the_period_of_the_navigator_is_the_interval_of_decisions(replan: float, steps: int) -> None:
    start = scenario(replan=replan)
    assert start.steps_per_decision == steps
    assert start.navigator(METHODS["nao"]).period == pytest.approx(0.1 * steps)


@pytest.mark.parametrize("dt", [0.05, 0.1, 0.25])
def test_times_are_evenly_spaced_from_the_start(dt: float) -> None:
    recording = simulate(scenario(start=7.0, dt=dt), METHODS["nlvo"])
    np.testing.assert_allclose(recording.times, 7.0 + dt * np.arange(len(recording.times)), rtol=0, atol=1e-12)
    assert recording.dt == dt
    assert len(recording.times) == len(recording.positions) == len(recording.accelerations) + 1


def test_the_start_is_when_obstacles_are_where_they_are() -> None:
    """The same world, one second later, is another run."""
    early, late = (simulate(replace(scenario(start=start), duration=3.0), METHODS["nao"]) for start in (0.0, 1.0))
    assert early.times[0] == 0.0
    assert late.times[0] == 1.0
    assert not np.array_equal(early.positions[:20], late.positions[:20])


def test_a_run_ends_on_arrival() -> None:
    """At the end of the first step that comes within the tolerance, not before and not after."""
    recording = simulate(scenario(), METHODS["nao"])
    distances = distances_during_steps(recording)
    assert distances[-1] <= recording.goals[0].tolerance < distances[:-1].min()
    assert recording.arrived[0] == recording.times[-1]


def distances_during_steps(recording: Recording) -> np.ndarray:
    """The least distance (T,) [m] of the only robot from its goal at rest, of dense samples of each step."""
    s = np.linspace(0.0, recording.dt, 2001)[:, None, None]
    x, v, a = recording.positions[:-1, 0], recording.velocities[:-1, 0], recording.accelerations[:, 0]
    return np.linalg.norm(x + s * (v + 0.5 * s * a) - recording.goals[0].position(0.0), axis=2).min(axis=0)


@pytest.mark.parametrize("name", ["avo", "nao", "nao_ahead", "orca_limited"])
@given(distance=st.floats(30.0, 60.0), beside=st.floats(-0.45, 0.45))
def test_a_fast_robot_arrives_at_its_first_passage(name: str, distance: float, beside: float) -> None:
    """At 20 m/s it is 4 m farther at each sample, the tolerance is 0.5 m: most samples lie outside."""
    goal = Goal(Stationary((distance, beside)), 0.5)
    robot = Robot(disc_or_ball(0.5, 2), Limits(20.0, 4.0), State((0, 0), (20, 0)), goal)
    built = Scenario("fast", (robot,), duration=8.0, dt=0.2)
    recording = simulate(built, name)
    near = distances_during_steps(recording) <= 0.5
    assert recording.arrived[0] == recording.times[1 + int(np.argmax(near))] == recording.times[-1]
    assert recording.arrived[0] == pytest.approx(distance / 20.0, abs=0.25)
    assert metrics.arrived(recording) == 1.0
    assert metrics.time(recording) == recording.times[-1]
    assert metrics.extra_time(recording) <= 0.25
    summary = simulate(built, name, record=False)
    assert (metrics.arrived(summary), metrics.time(summary)) == (1.0, metrics.time(recording))


def test_a_robot_that_is_to_stop_does_not_arrive_by_passing() -> None:
    goal = Goal(Stationary((30.0, 0.0)), 0.5, stop=True)
    robot = Robot(disc_or_ball(0.5, 2), Limits(20.0, 4.0), State((0, 0), (20, 0)), goal)
    recording = simulate(Scenario("fast", (robot,), duration=20.0, dt=0.2), "nao")
    passes = recording.times[1 + int(np.argmax(distances_during_steps(recording) <= 0.5))]
    assert passes < recording.arrived[0] == recording.times[-1]
    assert np.linalg.norm(recording.positions[-1, 0] - (30.0, 0.0)) <= 0.5
    assert np.linalg.norm(recording.velocities[-1, 0]) <= 0.5


def test_robots_of_a_fleet_leave_the_scene_where_they_pass_their_goals() -> None:
    """Each at its own step; a goal in motion is passed where it is."""
    goals = [Goal(Stationary((30.0, 0.1))), Goal(ConstantVelocity((46.0, 20.0), (-6.0, 0.0)))]
    robots = tuple(
        Robot(disc_or_ball(0.5, 2), Limits(20.0, 4.0), State((0, 20 * k), (20, 0)), goal, f"r{k}")
        for k, goal in enumerate(goals)
    )
    recording = simulate(Scenario("fast", robots, duration=10.0, dt=0.2), "nao")
    assert recording.arrived == pytest.approx([1.6, 1.8])


def test_a_run_ends_when_its_time_is_over() -> None:
    recording = simulate(scenario().with_settings({"duration": 1.5}), METHODS["nao"])
    assert len(recording.accelerations) == 15
    assert recording.times[-1] == pytest.approx(1.5)
    assert recording.arrived[0] == np.inf


def test_a_robot_that_starts_at_its_goal_has_arrived() -> None:
    recording = simulate(build("empty", {"distance": 0.0}), METHODS["nao"])
    assert len(recording.accelerations) == 0
    assert recording.arrived[0] == recording.times[0] == 0.0


def test_progress_is_reported_in_shares() -> None:
    shares: list[float] = []
    simulate(scenario().with_settings({"duration": 2.0}), METHODS["nlvo"], progress=shares.append)
    np.testing.assert_allclose(shares, np.arange(1, 21) / 20)


def test_settings_reach_the_navigator() -> None:
    start = scenario(margin=0.3, patience=0.7, horizon=4.0, holds=(0.5,), dt=0.2)
    navigator = start.navigator(METHODS["ao"])
    assert (navigator.margin, navigator.patience, navigator.horizon, navigator.holds) == (0.3, 0.7, 4.0, (0.5,))
    assert navigator.period == 0.2
    assert navigator.limits is start.robot.limits
    changed = start.with_settings({"margin": 0.1, "horizon": 3.0})
    assert (changed.margin, changed.horizon, changed.patience) == (0.1, 3.0, 0.7)
    with pytest.raises(InvalidInput, match="replan"):
        start.with_settings({"replan": 0.3})


@pytest.mark.parametrize("method", METHODS)
def test_overlap_at_the_start_is_a_status(method: str) -> None:
    """Inside a rock: the run goes on, and says so."""
    start = scenario()
    inside = replace(start, obstacles=(Obstacle(disc_or_ball(2.0, 2), Stationary((0.0, -1.0)), "rock"),))
    recording = simulate(inside.with_settings({"duration": 4.0}), METHODS[method])
    assert recording.outcomes[0] == ("ESCAPING",)
    assert recording.outcomes[-1] != ("ESCAPING",)
    assert np.all(np.isfinite(recording.positions))


@pytest.mark.parametrize("method", METHODS)
def test_a_goal_under_something_that_may_move_is_waited_for(method: str) -> None:
    """The robot does not run into it; under a rock that rests for ever the scenario is refused."""
    parked = Obstacle(disc_or_ball(3.0, 2), ConstantVelocity((20.0, 0.0), (0.0, 0.0)), "parked")
    recording = simulate(replace(scenario(), obstacles=(parked,), duration=12.0), METHODS[method])
    assert recording.arrived[0] == np.inf
    distance = np.linalg.norm(recording.positions[:, 0] - [20.0, 0.0], axis=1)
    assert distance.min() >= 3.5 - 1e-5
    assert all(Outcome[name].safe for (name,) in recording.outcomes)
    with pytest.raises(InvalidInput, match="goal: expected a position that the robot can reach"):
        replace(scenario(), obstacles=(Obstacle(disc_or_ball(3.0, 2), Stationary((20.0, 0.0)), "rock"),))
