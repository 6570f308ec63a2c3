"""Robots of a fleet that may meet: no encounter is left out, and a lost margin is restored."""

from dataclasses import replace

import numpy as np
import pytest
from draws import draws
from fleets import OneByOne

from slalom import METHODS, Disc, Goal, Limits, State, Stationary
from slalom.decision.methods import margin_among
from slalom.sim import Robot, Scenario, gallery, simulate
from slalom.sim.run.deciders import FleetDecider

SHARED = METHODS["nao_shared"]
FLEETS = {
    "sparse": ("random_goals", {"robots": 30, "side": 60}),
    "dense": ("circle", {"robots": 12, "radius": 8}),
    "streams": ("crossing_streams", {"robots": 12}),
    "door": ("doorway", {"robots": 8}),
}
"""Scenario and settings of fleets in which the broad phase leaves out many robots, few, or walls."""


def fleet(name: str, duration: float) -> Scenario:
    """A fleet without guidance, so that goals alone decide where robots head."""
    scenario, settings = FLEETS[name]
    return replace(gallery.build(scenario, settings, seed=5), duration=duration, guided=False)


@pytest.mark.parametrize("name", draws(["door", "dense", "streams", "sparse"], 2))
def test_no_robot_that_can_be_met_is_left_out(name: str) -> None:
    """Decisions with the broad phase of a fleet are those of navigators, each of which gets all robots."""
    scenario, found = fleet(name, 1.5), set()
    together = FleetDecider(scenario, SHARED)
    alone = OneByOne(scenario, SHARED, together.states)
    order = list(range(len(scenario.robots)))
    for step in range(15):
        now = step * scenario.dt
        expected = alone.decide(order[step:] + order[:step], now)
        outcomes, _ = together.decide(now)
        assert outcomes == expected, step
        np.testing.assert_allclose(together.committed()[0], alone.controls, atol=1e-7)
        together.states.integrate(together.accelerations(now, scenario.dt), scenario.dt)
        found.update(outcomes)
    assert {"CLEAR", "CONSTRAINED"} <= found


@pytest.mark.parametrize("method", ["nao", "vo"])
def test_robots_out_of_reach_change_no_bit(method: str) -> None:
    """Two fleets a kilometre apart move as each of them alone. (Shared manoeuvres depend on a drawn order as well.)"""
    here = fleet("dense", 2.0)
    away = np.array([1000.0, 0.0])
    there = tuple(
        replace(
            robot,
            name=f"{robot.name} there",
            state=State(robot.state.position + away, robot.state.velocity),
            goal=replace(robot.goal, trajectory=Stationary(robot.goal.position(0.0) + away)),
        )
        for robot in here.robots
    )
    alone = simulate(here, METHODS[method])
    both = simulate(replace(here, robots=(*here.robots, *there)), METHODS[method])
    assert np.array_equal(both.positions[:, : len(here.robots)], alone.positions)


def gap_after(seconds: float, within: float | None) -> tuple[float, float]:
    """The gap [m] of two robots that drive side by side, nearer to each other than the margin; and the margin [m]."""
    limits = Limits(2.0, 2.0)
    robots = tuple(
        Robot(Disc(0.5), limits, State((0.0, y), (1.0, 0.0)), Goal(Stationary((50.0, y)), 0.2, True), str(k))
        for k, y in enumerate((0.0, 1.01))
    )
    scenario = Scenario("side_by_side", robots, duration=seconds)
    method = replace(METHODS["nao"], regain=within)
    run = simulate(scenario, method)
    apart = run.positions[-1, 0] - run.positions[-1, 1]
    margin = margin_among(method, scenario.margin, limits.max_acceleration, scenario.dt)
    return float(np.linalg.norm(apart)) - 1.0, margin


def test_robots_side_by_side_restore_the_margin_between_them() -> None:
    found, margin = gap_after(2.0, 1.0)
    assert found >= margin - 1e-3
    without, _ = gap_after(2.0, None)
    assert without < 0.5 * margin
