"""The behaviours for navground, judged by navground's own runner and record of collisions."""

import csv
import importlib.util
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from slalom.model.state import State
from slalom.sim import Recording, metrics

core = pytest.importorskip("navground.core", reason="the package navground is not installed")
sim = pytest.importorskip("navground.sim", reason="the package navground is not installed")
agents = pytest.importorskip("slalom.adapters.navground")
PERIOD = 0.1
SINGLE = 2e-6  # positions of navground have single precision


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
    made.record_config.time = True
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


def on(kinematics, orientation=0.0, position=(0.0, 0.0)):
    """An agent of a fleet with the radius and the speed of the experiments."""
    agent = core.Behavior.make_type("SlalomFleet")
    agent.kinematics = core.Kinematics.load(kinematics)
    agent.radius, agent.optimal_speed, agent.safety_margin = 0.08, 0.12, 0.02
    agent.pose = core.Pose2(position, orientation)
    return agent


def follow(agent, velocity, lead):
    """Apply the twist that displaces the point by PERIOD times a velocity; how far it ends from there [m]."""
    planned = agents.point_of(agent, lead) + PERIOD * velocity
    agent.actuate(agents.twist(agent, velocity, lead, PERIOD), PERIOD)
    return np.linalg.norm(agents.point_of(agent, lead) - planned)


def kept_velocities(bound, heading, count, rng):
    """Velocities (m, 2) that obey a bound."""
    normals, offsets = bound.half_spaces(State((0.0, 0.0), (0.0, 0.0), heading=heading))
    cosine, sine = np.cos(heading), np.sin(heading)
    found = rng.uniform((-0.02, -0.05), (0.2, 0.05), (count, 2)) @ np.array([(cosine, sine), (-sine, cosine)])
    return found[(found @ normals.T <= offsets).all(axis=1)]


@pytest.mark.parametrize("share", [1.0, 1.0 / 1.1])
def test_wheels_follow_every_planned_velocity_while_it_is_kept(share):
    """Within the tracking error; exactly, if the velocity is smaller by the part by which plans may be too fast."""
    rng = np.random.default_rng(7)
    motion = agents.motion_of(on(WHEELS), PERIOD)
    (bound,) = motion.limits.bounds
    error = bound.tracking_error(PERIOD) if share == 1.0 else 0.0
    for heading in (0.0, 2.0, -2.6):
        velocities = kept_velocities(bound, heading, 300, rng)
        assert len(velocities) > 20
        for velocity in share * velocities:
            agent = on(WHEELS, heading)
            assert max(follow(agent, velocity, motion.lead) for _ in range(12)) <= error + SINGLE


def test_wheels_do_not_follow_velocities_far_outside_the_bound():
    motion = agents.motion_of(on(WHEELS), PERIOD)
    (bound,) = motion.limits.bounds
    for velocity in [(-0.1, 0.0), (0.0, 0.12), (0.11, 0.08)]:
        assert follow(on(WHEELS), np.array(velocity), motion.lead) > bound.tracking_error(PERIOD)


def test_wheels_turn_towards_a_velocity_aside():
    agent, motion = on(WHEELS), agents.motion_of(on(WHEELS), PERIOD)
    for _ in range(20):
        follow(agent, np.array([0.0, 0.03]), motion.lead)
    assert agent.orientation == pytest.approx(0.5 * np.pi, abs=0.02)


@pytest.mark.parametrize("turn_rate", [0.0, 0.7])
def test_omnidirectional_agents_follow_every_velocity_while_they_turn(turn_rate):
    agent = on(OMNI)
    agent.heading_behavior, agent.optimal_angular_speed = core.Behavior.Heading.velocity, turn_rate
    for angle in np.linspace(-3.0, 3.0, 7):
        before = agent.orientation
        assert follow(agent, 0.16 * np.array([np.cos(angle), np.sin(angle)]), 0.0) < SINGLE
        assert (agent.orientation != before) == (turn_rate > 0.0)


def test_an_agent_reaches_its_speed_in_the_same_time_at_every_speed():
    agent = on(OMNI)
    for speed in (0.06, 0.12):
        agent.optimal_speed = speed
        assert agents.motion_of(agent, PERIOD).limits.max_acceleration == pytest.approx(speed / 0.3)
    agent.max_acceleration = 0.7
    assert agents.motion_of(agent, PERIOD).limits.max_acceleration == pytest.approx(0.7)


def test_the_body_is_grown_by_all_that_the_plan_may_be_off():
    """Two agents whose grown discs do not overlap do not touch, at no time within a period."""
    motion = agents.motion_of(on(WHEELS), PERIOD)
    (bound,) = motion.limits.bounds
    within = motion.limits.max_acceleration * PERIOD**2 / 8.0
    assert motion.growth == pytest.approx(motion.lead + bound.tracking_error(PERIOD) + within)
    assert agents.motion_of(on(OMNI), PERIOD).growth == pytest.approx(within)


@pytest.mark.parametrize("kinematics", [OMNI, WHEELS])
def test_a_fleet_moves_to_its_targets_without_a_collision(kinematics):
    result = run([(6, "type: SlalomFleet")], CROSS, kinematics)
    assert len(result.collisions) == 0
    assert np.mean(result.efficacy) > 0.4


def test_an_agent_that_wraps_around_a_lattice_keeps_its_way():
    corridor = "type: Corridor, length: 2.0, width: 1.0"
    result = run([(1, "type: Slalom"), (3, "type: HL")], corridor, OMNI, steps=200)
    assert len(result.collisions) == 0
    assert np.mean(result.efficacy[:, 0]) > 0.7


@pytest.mark.parametrize("kinematics", [OMNI, WHEELS])
def test_one_agent_among_others_of_navground(kinematics):
    result = run([(1, "type: Slalom"), (5, "type: HL")], CROSS, kinematics)
    assert len(result.collisions) == 0
    assert np.mean(result.efficacy[:, 0]) > 0.4


@pytest.fixture(scope="module")
def program():
    """benchmarks/navground_experiments.py."""
    path = Path(__file__).parents[2] / "benchmarks" / "navground_experiments.py"
    spec = importlib.util.spec_from_file_location("navground_experiments", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_table_is_made_of_the_kept_runs(program):
    with program.TABLE.open(newline="") as file:
        assert [tuple(row) for row in csv.reader(file)] == program.table(program.kept())


def test_no_kept_run_of_slalom_has_a_collision(program):
    runs = [run for run in program.kept() if run["agents"].startswith("Slalom")]
    assert {(run["experiment"], run["kinematics"]) for run in runs} == {
        (name, kind) for name in program.SETTINGS for kind in program.KINEMATICS
    }
    assert all(int(run["own"] or run["collisions"]) == 0 for run in runs)


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", ["omnidirectional", "two wheels"])
def test_a_run_made_again_is_near_the_kept_one(program, kinematics):
    """navground has single precision, so processors may differ in the last bits, and the agents then in their ways."""
    key = {"experiment": "Antipodal", "kinematics": kinematics, "agents": "SlalomFleet", "seed": "0"}
    (kept,) = [run for run in program.kept() if key.items() <= run.items()]
    made = program.make("Antipodal", kinematics, "SlalomFleet", 0)
    assert made["collisions"] == "0"
    assert float(made["efficacy"]) == pytest.approx(float(kept["efficacy"]), abs=0.05)


@pytest.mark.parametrize(
    ("before", "after", "other", "own"),
    [((0.5, 0.0), (0.6, 0.0), (0.77, 0.0), True), ((0.5, 0.0), (0.4, 0.0), (0.57, 0.0), False)],
)
def test_a_collision_is_of_the_agent_that_moved_towards_the_other(program, before, after, other, own):
    poses = np.array([[(*before, 0.0), (*other, 0.0)], [(*after, 0.0), (*other, 0.0)]])
    record = SimpleNamespace(poses=poses, collisions=np.array([(1, 0, 1)]))
    assert program.moved_into(record, 0) == [(1, own)]
    record.collisions = np.array([(1, 0, 7)])  # a wall
    assert program.moved_into(record, 0) == [(1, True)]
    record.collisions = np.array([(1, 1, 7)])
    assert program.moved_into(record, 0) == []


def test_a_run_of_navground_is_a_recording():
    """By the line of the page: the positions, and as few collisions as navground counts."""
    made = run([(4, "type: SlalomFleet")], CROSS, OMNI)
    found = Recording.from_tracks(made.times, made.poses[..., :2], 0.08)
    assert np.allclose(found.positions, made.poses[..., :2], atol=SINGLE)
    assert metrics.summary(found)["collisions"] == len(made.collisions) == 0
