"""Fleets and robots in space in the view: targets of guidance, robots that are left out, and projections."""

import numpy as np
import pytest
from live_views import kinds

from slalom import Disc, Goal, Limits, Outcome, State, Stationary, method
from slalom.live import seen as nearest
from slalom.live.control_space import NONE, OUTSIDE, VIEW_PROJECTION_GRID, Fields, planes_of, projections
from slalom.live.messages import unpack
from slalom.live.recorded import recorded
from slalom.live.seen import VIEW_PREDICTED, Targets, reasons, seen_among, state_at
from slalom.live.session import Session
from slalom.sim import Recording, Robot, Scenario, gallery, simulate
from slalom.sim.run.simulate import Run


@pytest.fixture(scope="module")
def ring() -> Recording:
    """Robots on a circle, which guidance leads around its middle."""
    settings = {"robots": 70, "radius": 60.0, "duration": 9.0}
    return simulate(gallery.build("circle", settings), method("nao_shared"))


def test_the_preferred_control_of_a_robot_among_others_is_that_of_its_decision(ring: Recording) -> None:
    """A decision that was free of collisions chose the preferred control: the picture shows the same one."""
    found, own = recorded(ring), method("nao_shared")
    targets, clear, guided = Targets(found.scenario), 0, 0
    for k in range(0, 90, 6):
        for robot in range(0, 70, 14):
            goal = targets.goal(found.steps, k, robot)
            seen = seen_among(found.scenario, own, found.steps, k, robot, goal)
            made = seen.manoeuvre
            if seen.outcome != Outcome.CLEAR.name or made is None or made.start != seen.time:
                continue
            clear, guided = clear + 1, guided + (seen.target is not None)
            np.testing.assert_allclose(seen.controls.preferred, made.control, atol=1e-9)
            assert reasons(seen).first == -1
    assert clear > 5
    assert guided > 3


def test_targets_are_the_same_in_any_order_and_end_at_the_goal(ring: Recording) -> None:
    found = recorded(ring)
    late, stepwise = Targets(found.scenario), Targets(found.scenario)
    last = late.goal(found.steps, 15, 3).position(0.0)
    each = [stepwise.goal(found.steps, k, 3).position(0.0) for k in range(16)]
    np.testing.assert_array_equal(each[15], last)
    alone = gallery.build("circle", {"robots": 2, "radius": 5.0, "guided": 0})
    session = Session(alone, method("nao"))
    session.opening()
    assert Targets(alone).goal(session._played.steps, 0, 1) is alone.robots[1].goal


def test_targets_are_those_of_a_run_in_which_a_robot_passed_its_goal_within_a_step() -> None:
    """It has left the scene, so that the robot in front of it no longer keeps right."""
    robots = tuple(
        Robot(Disc(0.5), Limits(20.0, 4.0), State((x, y), (v, 0)), Goal(Stationary(goal)), name)
        for name, x, y, v, goal in (
            ("a", -20.0, 0.1, 20.0, (2.0, 0.3)),
            ("b", 60.0, -0.1, -20.0, (-200.0, 0.0)),
            ("c", 60.0, 9.0, -20.0, (-200.0, 9.0)),
        )
    )
    run = Run(Scenario("passing", robots, dt=0.2, duration=4.0), method("nao"))
    targets, known, shifted = Targets(run.log.scenario), [], 0
    for _ in run.steps():
        known.append(run.decider.fleet.table.each["target"][:, :2].copy())
    assert run.log.arrived[0] == pytest.approx(1.2)
    for k, expected in enumerate(known):
        for robot in np.flatnonzero(run.log.arrived > 0.2 * k).tolist():
            found = targets.goal(run.log.steps, k, robot).position(0.2 * k)
            np.testing.assert_array_equal(found, expected[robot])
            shifted += not np.array_equal(found, robots[robot].goal.position(0.0))
    assert shifted > 0


def test_robots_that_are_left_out_can_be_met_by_no_drawn_control(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = {"robots": 70, "radius": 60.0, "duration": 3.0}
    made = recorded(simulate(gallery.build("circle", settings), method("nao")))
    few = seen_among(made.scenario, method("nao"), made.steps, 25, 0)
    assert len(few.others) < VIEW_PREDICTED
    monkeypatch.setattr(nearest, "VIEW_PREDICTED", 1000)
    every = seen_among(made.scenario, method("nao"), made.steps, 25, 0)
    kept, met = {other.number for other in few.others}, set()
    for other, field in zip(every.others, Fields().of(every, planes_of(every)[0])):
        if field.times is not None and np.isfinite(field.times).any():
            met.add(other.number)
    assert len(every.others) == 69
    assert len(met) > 1
    assert met <= kept
    assert reasons(every).sentences == reasons(few).sentences


def test_a_contact_that_the_others_help_to_avoid_is_said_to_be_so() -> None:
    session = Session(gallery.build("circle", {"robots": 20, "radius": 14.0}), method("nao"))
    session.opening()
    session.more(110)
    told = []
    for k in range(70, 110, 8):
        for session.robot in range(0, 20, 3):
            seen = session._seen(k)
            assert seen is not None
            told += [words for words in reasons(seen).sentences if "would hit robot" in words]
    assert told
    assert all("takes its share" in words for words in told)


def test_projections_are_free_where_a_control_on_the_line_is() -> None:
    """Against the definition, one line of controls after the other."""
    session = Session(gallery.build("drones_crossing"), method("nao"))
    session.opening()
    session.more(8)
    seen = session._seen(7)
    assert seen is not None
    half = planes_of(seen)[0].half
    arrays, x = projections(seen.blocked, seen.admissible, half), np.linspace(-half, half, VIEW_PROJECTION_GRID)
    generator, outcomes = np.random.default_rng(3), set()
    for k, hidden in enumerate((2, 1, 0)):
        for a, b in generator.integers(0, VIEW_PROJECTION_GRID, (60, 2)):
            line = np.insert(np.tile((x[a], x[b]), (len(x), 1)), hidden, x, axis=1)
            line = line[seen.admissible.contains(line)]
            value = arrays[f"shadow{k}"][b, a]
            outcomes.add("outside" if value == OUTSIDE else "free" if value == NONE else "hit")
            if not len(line):
                assert value == OUTSIDE
                continue
            free = ~seen.blocked.contains(line)
            assert (value == NONE) == free.any()
            if not free.any():
                latest = seen.blocked.times_to_collision(line).min(axis=1).max()
                assert value == round(250.0 * latest / seen.blocked.horizon)
    assert outcomes == {"outside", "free", "hit"}
    for k, hidden in enumerate((2, 1, 0)):
        smallest = int(np.argmin(seen.admissible.radii))
        middle = np.delete(seen.admissible.centers[smallest], hidden)
        far = np.linalg.norm(arrays[f"silhouette{k}"] - middle, axis=1)
        assert far.max() == pytest.approx(seen.admissible.radii[smallest], rel=0.01)


def test_a_second_method_and_a_response_are_shown_at_the_step_that_is_looked_at() -> None:
    session = Session(gallery.build("roundabout_crossing", seed=3), method("nao"))
    session.opening()
    session.more(12)
    both = session.answer({"do": "compare", "name": "vo", "step": 9, "id": 4})
    assert kinds(both) == ["control", "control"]
    assert [unpack(message)[0]["step"] for message in both if unpack(message)[0]["slot"] == 0] == [9]
    drift = [unpack(message)[1]["drift"][0] for message in both]
    np.testing.assert_allclose(drift[0], drift[1], atol=1e-5)
    np.testing.assert_allclose(drift[0], state_at(session._played.steps, 9, 0).position, atol=1e-5)
    assert kinds(session.answer({"do": "compare", "name": "", "step": 9})) == ["control"]
    shown = unpack(session.answer({"do": "response", "number": 1, "step": 9})[0])[0]
    assert (shown["step"], shown["response"]) == (9, shown["responses"][1].partition(" ")[2])
    assert len(session._played.steps) > 12
