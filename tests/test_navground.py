"""The behaviours for navground, judged by navground's own runner and record of collisions."""

import numpy as np
import pytest

from slalom.errors import InvalidInput

core = pytest.importorskip("navground.core", reason="the package navground is not installed")
sim = pytest.importorskip("navground.sim", reason="the package navground is not installed")


def run(behaviours, scenario, kinematics, steps=60):
    groups = [
        f"{{type: thymio, number: {count}, radius: 0.08, control_period: 0.1, kinematics: {kinematics}, "
        f"behavior: {{{settings}, optimal_speed: 0.12, safety_margin: 0.02}}, "
        "state_estimation: {type: Bounded, range: 2.0}}"
        for count, settings in behaviours
    ]
    made = sim.load_experiment(
        f"steps: {steps}\ntime_step: 0.1\nscenario: {{{scenario}, groups: [{', '.join(groups)}]}}"
    )
    made.record_config.collisions = made.record_config.efficacy = made.record_config.pose = True
    made.run(number_of_runs=1)
    return made.runs[0]


@pytest.fixture(autouse=True)
def loaded():
    core.load_plugins()


CROSS = "type: Cross, agent_margin: 0.1, side: 3, target_margin: 0.1, tolerance: 0.5"
OMNI, WHEELS = "{type: Omni, max_speed: 0.166}", "{type: 2WDiff, wheel_axis: 0.094, max_speed: 0.166}"


def test_the_entry_points_name_both_behaviours():
    assert {"Slalom", "SlalomFleet"} <= set(core.Behavior.types)


def test_yaml_sets_the_properties():
    text = "{type: SlalomFleet, method: rvo, max_acceleration: 0.5, time_horizon: 4.0, keep_right: 0.0, lead: 0.01}"
    behaviour = core.Behavior.load(text)
    assert behaviour.method == "rvo"
    assert (behaviour.max_acceleration, behaviour.time_horizon, behaviour.keep_right) == (0.5, 4.0, 0.0)
    assert behaviour.lead == pytest.approx(0.01)
    assert np.array_equal(core.Behavior.load("{type: Slalom, world_period: [8, 0]}").world_period, [8.0, 0.0])


@pytest.mark.parametrize("kinematics", [OMNI, WHEELS])
def test_a_fleet_moves_to_its_targets_without_a_collision(kinematics):
    result = run([(6, "type: SlalomFleet")], CROSS, kinematics)
    assert len(result.collisions) == 0
    assert np.mean(result.efficacy) > 0.4


def test_agents_that_wrap_around_a_periodic_world_keep_their_way():
    corridor = "type: Corridor, length: 2.0, width: 1.0"
    result = run([(3, "type: SlalomFleet, world_period: [2, 0]")], corridor, OMNI, steps=200)
    assert len(result.collisions) == 0
    assert np.mean(result.efficacy) > 0.7


def test_one_agent_among_others_of_navground():
    result = run([(1, "type: Slalom"), (5, "type: HL")], CROSS, OMNI)
    assert len(result.collisions) == 0
    assert np.mean(result.efficacy[:, 0]) > 0.4


def test_other_kinematics_are_refused():
    agent = core.Behavior.make_type("Slalom")
    agent.kinematics = core.kinematics.AheadKinematics(0.2)
    agent.radius, agent.optimal_speed = 0.1, 0.1
    agent.prepare()
    with pytest.raises(InvalidInput, match="kinematics: expected omnidirectional"):
        agent.compute_cmd_internal(0.1)


def test_a_fleet_moved_at_once_without_a_period_is_refused():
    agents = [core.Behavior.make_type("SlalomFleet") for _ in range(2)]
    for k, agent in enumerate(agents):
        agent.kinematics = core.kinematics.OmnidirectionalKinematics(0.2, 1.0)
        agent.radius, agent.optimal_speed, agent.position = 0.1, 0.1, (k, 0.0)
        agent.prepare()
    for agent in agents:
        agent.compute_cmd_internal(0.1)
    agents[1].position = (5.0, 0.0)
    with pytest.raises(InvalidInput, match="world_period: expected the period"):
        agents[0].compute_cmd_internal(0.1)
    for agent in agents:
        agent.close()
