"""Reports of decisions: budgets, stuck robots, collisions, files that repeat a decision, threads."""

import json
import logging
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import slalom
from slalom.decision.methods import VARIANTS
from slalom.sim.files.decision_file import read_decision

WALL = slalom.Obstacle(slalom.Polyline([(3, -2), (3, 2)], 0.05), slalom.Stationary((0, 0)), "wall")
GOAL = slalom.Goal(slalom.Stationary((8, 0)), stop=True)
LIMITS = slalom.Limits(1.5, 1.0)


def navigator(**settings) -> slalom.Navigator:
    """A disc that decides by nao."""
    return slalom.Navigator(slalom.method("nao"), slalom.Disc(0.3), LIMITS, **settings)


def crowd(t: float) -> slalom.Tracks:
    """Eight people who cross the way."""
    places = np.array([(2.0 + 0.7 * k, (-1) ** k * (2.5 - 0.8 * t)) for k in range(8)])
    return slalom.Tracks(places, [(0.0, -0.8 * (-1) ** k) for k in range(8)], 0.25, t)


def run(steps: int, budget=None, obstacles=lambda t: [crowd(t)], **settings) -> list[slalom.Decision]:
    """The decisions of a robot that carries them out."""
    robot, found = navigator(**settings), []
    position, velocity, previous = np.zeros(2), np.zeros(2), None
    for k in range(steps):
        t = 0.1 * k
        state = slalom.State(position, velocity)
        previous = robot.decide(state, obstacles(t), GOAL, now=t, previous=previous, budget=budget)
        applied = previous.manoeuvre.mean_acceleration(t, 0.1)
        position, velocity = position + 0.1 * velocity + 0.005 * applied, velocity + 0.1 * applied
        found.append(previous)
    return found


def bits(decisions) -> list[tuple[str, bytes]]:
    """Outcomes and controls."""
    return [(one.outcome.name, one.manoeuvre.control.tobytes()) for one in decisions]


def test_a_decision_without_budget_left_goes_on_with_the_committed_manoeuvre() -> None:
    committed = run(20)
    known = {id(one.manoeuvre) for one in committed}
    bounded = run(30, budget=0.0)
    assert bounded[0].safe
    assert any(one.outcome is slalom.Outcome.INTERRUPTED for one in bounded)
    for before, one in pairwise(bounded):
        if one.outcome is slalom.Outcome.INTERRUPTED:
            assert one.cut
            assert one.manoeuvre is before.manoeuvre
    assert len(known) > 1


def test_a_budget_that_is_not_used_up_changes_nothing() -> None:
    free = run(20)
    assert bits(run(20, budget=2.0 * max(one.work for one in free))) == bits(free)
    assert not any(one.cut for one in free)


def test_behind_a_wall_a_robot_is_stuck_and_names_it() -> None:
    decisions = run(160, obstacles=lambda t: [WALL], stuck_after=5.0, detours=())
    assert not decisions[20].stuck
    assert decisions[-1].stuck
    assert decisions[-1].outcome is slalom.Outcome.KEPT
    assert decisions[-1].in_the_way == ("wall",)
    assert decisions[-1].as_dict()["in_the_way"] == ["wall"]


def test_an_inevitable_collision_has_time_place_and_name() -> None:
    robot = navigator()
    rock = slalom.Obstacle(slalom.Disc(0.5), slalom.ConstantVelocity((4, 0), (-4, 0)))
    made = robot.decide(slalom.State((0, 0), (1.5, 0)), [rock], GOAL)
    hit = made.collision
    assert not made.safe
    assert hit is not None
    assert hit.obstacle == "obstacles[0]"
    distance = np.linalg.norm(hit.position - rock.trajectory.position(hit.time))
    assert abs(distance - 0.8) < 1e-3
    assert json.loads(json.dumps(made.as_dict(), allow_nan=False))["collision"]["obstacle"] == "obstacles[0]"


@pytest.mark.parametrize("foresight", ["", "@observed"])
@pytest.mark.parametrize("variant", [None, *VARIANTS])
def test_a_file_repeats_a_decision_of_each_variant_of_a_method(tmp_path, variant, foresight) -> None:
    of_table = slalom.method(f"nao{foresight}")
    made_of_it = of_table if variant is None else VARIANTS[variant](of_table)
    robot = replace(navigator(), method=made_of_it)
    made = robot.decide(slalom.State((0.0, 0.0), (1.0, 0.0)), [WALL], GOAL)
    made.dump(tmp_path / "d.json")
    assert json.loads((tmp_path / "d.json").read_text())["inputs"]["navigator"]["method"]["variant"] == variant
    again, same = read_decision(tmp_path / "d.json").repeat()
    assert same
    assert again.as_dict() == made.as_dict()
    assert again.inputs.navigator.method == made_of_it


def test_each_decision_is_one_line_of_the_log(caplog) -> None:
    with caplog.at_level(logging.DEBUG, "slalom"):
        made = run(2)
    assert len(caplog.messages) == len(made)
    assert made[0].outcome.name in caplog.messages[0]


def test_threads_that_share_a_navigator_and_a_table_give_the_same_bits() -> None:
    robot, table = navigator(), slalom.ObstacleTable([WALL])
    states = [slalom.State((0.02 * k, -1.0 + 0.05 * k), (0.5, 0)) for k in range(40)]

    def decide(k: int) -> tuple[str, bytes]:
        made = robot.decide(states[k], [table, crowd(0.1 * k)], GOAL, now=0.1 * k)
        return made.outcome.name, made.manoeuvre.control.tobytes()

    alone = [decide(k) for k in range(40)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(decide, [*range(40)] * 3)) == alone * 3


def test_the_work_of_a_second_is_measured() -> None:
    assert 0.0 < slalom.work_per_second() < np.inf


def test_decisions_of_a_search_report_as_others_do() -> None:
    """Walled in, it is stuck and names the wall."""
    box = slalom.Obstacle(slalom.Polyline([(-2, -2), (2, -2), (2, 2), (-2, 2), (-2, -2)], 0.05), WALL.trajectory, "box")
    ahead = slalom.LookAhead(navigator(stuck_after=3.0), time_horizon=20.0, budget=500.0)
    state, previous, walls = slalom.State((0, 0), (0, 0)), None, [box]
    for k in range(45):
        previous = ahead.decide(state, walls, GOAL, now=0.1 * k, previous=previous)
        state = previous.state_at(0.1 * (k + 1), state, 0.1 * k)
    assert previous.safe
    assert previous.stuck
    assert previous.in_the_way == ("box",)
    assert previous.as_dict()["time"] == pytest.approx(4.4)


def test_a_step_of_a_fleet_says_which_robots_are_safe_and_stuck() -> None:
    """A robot behind a wall comes no nearer; one before a rock cannot avoid it; the third is absent."""
    rock = slalom.Obstacle(slalom.Disc(0.5), slalom.ConstantVelocity((2.0, 8.0), (-4.0, 0.0)), "rock")
    wide = slalom.Obstacle(slalom.Polyline([(3, -6), (3, 6)], 0.05), slalom.Stationary((0, 0)), "wall")
    settings = {"obstacles": [wide, rock], "detours": (), "stuck_after": 4.0, "guided": False}
    fleet = slalom.Fleet(slalom.method("nao"), slalom.Disc(0.3), LIMITS, robots=3, **settings)
    places, speeds = np.array([(0.0, 0.0), (0.0, 8.0), (0.0, -20.0)]), np.zeros((3, 2))
    targets, unsafe, present = np.array([(8.0, 0.0), (8.0, 8.0), (0.0, 0.0)]), [], (True, True, False)
    for k in range(100):
        made = fleet.step(0.1 * k, places, speeds, targets, present=present)
        assert made.safe.tolist() == [outcome is None or outcome.safe for outcome in made.outcomes]
        unsafe.append(~made.safe)
        places, speeds = made.positions, made.velocities
        places[2] = (0.0, -20.0)
    assert made.stuck.tolist() == [True, False, False]
    assert made.stalled[0] >= 4.0
    assert made.stalled[2] == 0.0
    assert np.any(unsafe, axis=0).tolist() == [False, True, False]


def test_stages_of_a_decision_made_again() -> None:
    found = run(3)[-1].stages()
    assert {name: stage.calls for name, stage in found.items() if stage.calls} == dict.fromkeys(
        ("predict", "gather", "policy", "report"), 1
    )
    assert all(stage.time >= 0.0 for stage in found.values())
    with pytest.raises(slalom.InvalidInput, match="found one without inputs"):
        replace(run(1)[0], inputs=None).stages()
