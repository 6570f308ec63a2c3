"""Robots that follow their decisions inexactly: with too little gain, with noise, with a lag of the acceleration."""

from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from slalom import METHODS, AccelerationLag, Limits, ObstacleTable, State
from slalom.sim import gallery

PARTS = 10


def lagged(state: State, command: np.ndarray, lag: float, t: float) -> State:
    """The state after t [s] of a robot whose acceleration approaches the command: da/dt = (command - a) / lag."""
    left, more = np.exp(-t / lag), state.acceleration - command
    return State(
        state.position + t * state.velocity + 0.5 * t * t * command + lag * (t - lag * (1.0 - left)) * more,
        state.velocity + t * command + lag * (1.0 - left) * more,
        command + left * more,
    )


def drive(
    seed: int, gain: float = 1.0, noise: float = 0.0, lag: float = 0.0, margin: float = 0.3
) -> tuple[float, float]:
    """Time of arrival and least clearance of a robot whose acceleration follows with a gain and a lag [s].

    Its sight of its own position and velocity has normal errors of `noise` [m, m/s]. With a lag it starts farther away
    by the way that it drives within the lag: from nearer it cannot stop before the first lane.
    """
    scenario, rng = gallery.build("roundabout_crossing", seed=seed), np.random.default_rng(seed)
    robot, dt, actuator = scenario.robots[0], scenario.dt, AccelerationLag(lag) if lag else None
    more = actuator.tracking_error(robot.limits) if actuator else 0.0
    navigator, cars = (
        replace(scenario.navigator(METHODS["nao"]), margin=margin + more),
        ObstacleTable(scenario.obstacles),
    )
    state, decision, least = (
        State(robot.state.position - lag * robot.state.velocity, robot.state.velocity),
        None,
        np.inf,
    )
    sizes = np.array([car.shape.bounding_radius + robot.shape.bounding_radius for car in scenario.obstacles])
    for step in range(400):
        now = scenario.start + step * dt
        if robot.goal.reached(state.position, state.velocity, now):
            return now - scenario.start, least
        seen = State(
            state.position + noise * rng.standard_normal(2),
            state.velocity + noise * rng.standard_normal(2),
            state.acceleration,
        )
        reference = actuator.reference(seen) if actuator else seen
        decision = navigator.decide(reference, cars, robot.goal, now=now + lag, previous=decision)
        command = gain * decision.manoeuvre.mean_acceleration(now + lag, dt)
        path = []
        for _ in range(PARTS):
            h = dt / PARTS
            if lag:
                state = lagged(state, command, lag, h)
            else:
                position = state.position + h * state.velocity + 0.5 * h * h * command
                state = State(position, state.velocity + h * command, command)
            path.append(state.position)
        times = now + dt * np.arange(1, PARTS + 1) / PARTS
        apart = np.array([np.linalg.norm(car.trajectory.position(times) - path, axis=1) for car in scenario.obstacles])
        least = min(least, float((apart - sizes[:, None]).min()))
    return np.inf, least


PLANTS = ({"gain": 0.9}, {"noise": 0.01}, {"lag": 0.15, "margin": 0.05}, {"lag": 0.3, "margin": 0.05})


exactly = cache(drive)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("seeds", [range(2), pytest.param(range(20), marks=pytest.mark.slow)])
def test_a_robot_that_follows_inexactly_arrives(seeds: range, plant: dict[str, float]) -> None:
    """It is judged from its true state: it touches nothing, and arrives within 1.6 times the time of exact execution.

    A gap that is missed may cost one of 20 robots a whole lap.
    """
    arrived, least = zip(*(drive(seed, **plant) for seed in seeds))
    assert max(arrived) < np.inf
    assert min(least) > 0.0
    late = [seed for seed in seeds if not arrived[seed] < 1.6 * exactly(seed)[0]]
    assert len(late) <= 1, late


@pytest.mark.parametrize("lag", [0.02, 0.15, 0.6])
def test_the_robot_follows_its_reference(lag: float) -> None:
    """The reference is a double integrator; the robot is where it was `lag` before, up to the stated error."""
    rng, actuator, limits, worst = np.random.default_rng(5), AccelerationLag(lag), Limits(9.0, 3.0), 0.0
    for hold in (0.1, lag, 5.0 * lag):
        state, position, velocity, past = State((1.0, -2.0), (0.4, 0.3), (0.5, -0.2)), None, None, []
        h = hold / 20
        for _ in range(200):
            reference = actuator.reference(state)
            if position is not None:
                assert reference.position == pytest.approx(position, abs=1e-9)
                assert reference.velocity == pytest.approx(velocity, abs=1e-9)
            command = limits.max_acceleration * (1.0 if rng.random() < 0.5 else -1.0) * np.array([0.6, 0.8])
            position = reference.position + hold * reference.velocity + 0.5 * hold * hold * command
            velocity = reference.velocity + hold * command
            for k in range(20):
                t = k * h
                past.append(
                    (
                        reference.position + t * reference.velocity + 0.5 * t * t * command,
                        lagged(state, command, lag, t),
                    )
                )
            state = lagged(state, command, lag, hold)
        times, wanted = h * np.arange(len(past)), np.array([each for each, _ in past])
        later = times[times >= lag]
        driven = np.array([each.position for _, each in past])[-len(later) :]
        before = np.stack([np.interp(later - lag, times, wanted[:, axis]) for axis in range(2)], axis=1)
        interpolation = limits.max_acceleration * h * h / 8.0
        error = float(np.linalg.norm(driven - before, axis=1).max())
        assert error <= actuator.tracking_error(limits) + interpolation + 1e-9
        worst = max(worst, error)
    assert worst >= 0.5 * actuator.tracking_error(limits)


@pytest.mark.parametrize("lag", [0.1, 0.2, 0.4])
def test_planned_velocities_make_up_for_a_lag_of_the_velocity(lag: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The robot keeps clear of people and walls with both commands, and arrives earlier by the planned velocity."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "benchmarks"))
    benchmark = import_module("velocity_commands")
    (planned, clear), (measured, also_clear) = benchmark.drive(lag, True), benchmark.drive(lag, False)
    assert min(clear, also_clear) > 0.0
    assert planned < measured < 40.0
