"""Fleets and robots in space in the view: targets of guidance, robots that are left out, and projections."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from live_views import drawn_region, kinds

from slalom import ConstantVelocity, Disc, Goal, Limits, Obstacle, Outcome, State, Stationary, method
from slalom.choice.control_obstacle import ControlObstacle
from slalom.decision.methods import Method
from slalom.live.control_space import NONE, OUTSIDE, VIEW_PROJECTION_GRID, Fields, planes_of, projections
from slalom.live.messages import unpack
from slalom.live.recorded import looked_at
from slalom.live.seen import decided_again, reasons, state_at
from slalom.live.session import Session
from slalom.obstacle.window import ObstacleWindow
from slalom.sim import Recording, Robot, Scenario, gallery, simulate
from slalom.sim.run.recorded import recorded
from slalom.sim.run.simulate import Run


@pytest.fixture(scope="module")
def ring() -> Recording:
    """Robots on a circle, which guidance leads around its middle."""
    settings = {"robots": 70, "radius": 60.0, "duration": 9.0}
    return simulate(gallery.build("circle", settings), method("nao_shared"))


def test_the_preferred_control_of_a_robot_among_others_is_that_of_its_decision(ring: Recording) -> None:
    """A decision that was free of collisions chose the preferred control: the picture shows the same one."""
    found = recorded(ring)
    clear, guided = 0, 0
    for k, known in enumerate(decided_again(found.scenario, method("nao_shared"), found.steps)):
        for robot in range(0, 70, 7):
            seen = known.seen(found.steps, k, robot)
            made = seen.manoeuvre
            if seen.outcome != Outcome.CLEAR.name or made is None:
                continue
            clear, guided = clear + 1, guided + (seen.target is not None)
            np.testing.assert_allclose(seen.controls.preferred, made.control, atol=1e-9)
            assert reasons(seen).first == -1
    assert clear > 5
    assert guided > 3


def test_targets_are_those_of_the_fleet_also_in_a_replay() -> None:
    """Of a run in which a robot passes its goal within a step, and the robot in front of it no longer keeps right."""
    robots = tuple(
        Robot(Disc(0.5), Limits(20.0, 4.0), State((x, y), (v, 0)), Goal(Stationary(goal)), name)
        for name, x, y, v, goal in (
            ("a", -20.0, 0.1, 20.0, (2.0, 0.3)),
            ("b", 60.0, -0.1, -20.0, (-200.0, 0.0)),
            ("c", 60.0, 9.0, -20.0, (-200.0, 9.0)),
        )
    )
    run = Run(Scenario("passing", robots, dt=0.2, duration=4.0), method("nao"))
    expected = []
    for _ in run.steps():
        expected.append(run.decider.fleet.table.each["target"][:, :2].copy())
    assert run.log.arrived[0] == pytest.approx(1.2)
    shifted, steps = 0, run.log.steps
    for k, known in enumerate(decided_again(run.log.scenario, method("nao"), steps)):
        for robot in np.flatnonzero(run.log.arrived > 0.2 * k).tolist():
            target = known.seen(steps, k, robot).target
            found = robots[robot].goal.position(0.0) if target is None else target
            np.testing.assert_array_equal(found, expected[k][robot])
            shifted += target is not None
    assert shifted > 0


def test_robots_that_are_left_out_can_be_met_by_no_admissible_control(ring: Recording) -> None:
    found = recorded(ring)
    for seen in looked_at(found, 0, 1.0):
        others = {other.number for other in seen.others} | {0}
        assert len(others) < 70
        step, grid = found.steps[seen.step - round(seen.age / found.scenario.dt)], planes_of(seen)[0].controls
        some = grid[seen.admissible.contains(grid)]
        for k in set(range(70)) - others:
            motion = ConstantVelocity(step.positions[k], step.velocities[k], seen.time)
            window = ObstacleWindow([Obstacle(Disc(0.5), motion)], seen.time, found.scenario.horizon)
            assert not ControlObstacle(seen.response, seen.state, window, seen.blocked.robot).contains(some).any()


def test_a_contact_that_the_others_help_to_avoid_is_said_to_be_so() -> None:
    session = Session(gallery.build("circle", {"robots": 20, "radius": 14.0}), method("nao"))
    session.opening()
    session.more(70)
    told = []
    for k in range(34, 66, 8):
        for session.robot in range(0, 20, 3):
            seen = session._seen(k)
            assert seen is not None
            why = reasons(seen)
            if why.first >= 0 and seen.others[why.first].kind == "robot":
                (words,) = (words for words in why.sentences if "would hit robot" in words)
                told.append(seen.others[why.first].share < 1.0)
                assert ("takes its share" in words) == told[-1]
    assert set(told) == {True, False}


def test_projections_are_free_where_a_control_on_the_line_is() -> None:
    """Against the definition, one line of controls after the other."""
    session = Session(gallery.build("drones_crossing"), method("nao"))
    session.opening()
    session.more(8)
    seen = session._seen(7)
    assert seen is not None
    half = planes_of(seen)[0].half
    arrays, x = projections(seen, half), np.linspace(-half, half, VIEW_PROJECTION_GRID)
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


PASSIVE = {"hidden_speed": 1.5, "passive_safety": 1}


def scenes() -> dict[str, tuple[Scenario, str]]:
    """Runs with kept manoeuvres, limited sight, moving goals, paths, images, delays, and robots of several methods."""
    circle = gallery.build("circle", {"robots": 5, "radius": 8.0, "duration": 9.0})
    moving = [Goal(ConstantVelocity(one.goal.position(0.0), (0.3, 0.1)), 0.5) for one in circle.robots]
    methods = [method("nao_shared" if k % 2 else "nao") for k in range(5)]
    chase = gallery.build("empty").robot
    chase = replace(chase, goal=Goal(ConstantVelocity((6.0, 4.0), (0.8, -0.4)), 0.5))
    post = Obstacle(Disc(0.5), Stationary((4.0, 1.5)), "post")
    start = replace(chase, state=State((0, 0), (0, 0)))
    return {
        "kept": (gallery.build("roundabout_crossing"), "nao"),
        "sequence": (gallery.build("roundabout_crossing"), "nao_ahead"),
        "hidden people": (gallery.build("blind_corner"), "nao"),
        "passive safety": (gallery.build("blind_corner").with_settings(PASSIVE), "nao"),
        "moving goal": (Scenario("moving", (start,), (post,), duration=12.0), "nao"),
        "path": (gallery.build("curved_road"), "nao"),
        "space": (gallery.build("drones_crossing"), "nao"),
        "fleet": (circle, "nao"),
        "fleet that shares": (circle, "nao_shared"),
        "fleet of rvo": (circle, "rvo"),
        "fleet with limited sight": (circle.with_settings({"sight_range": 7.0, "field_of_view": 3.0}), "nao"),
        "fleet with late observations": (circle.with_settings({"sight_delay": 0.2, "sight_noise": 0.02}), "nao"),
        "moving goals": (replace(circle, robots=tuple(map(with_goal, circle.robots, moving))), "nao"),
        "methods": (replace(circle, robots=tuple(map(with_method, circle.robots, methods))), "nao"),
    }


def with_goal(robot: Robot, goal: Goal) -> Robot:
    return replace(robot, goal=goal)


def with_method(robot: Robot, own: Method) -> Robot:
    return replace(robot, method=own)


@pytest.mark.parametrize("name", scenes())
def test_the_chosen_control_of_a_safe_decision_is_drawn_outside_of_the_colour(name: str) -> None:
    """Also of one that is kept: in the control space from which it was chosen."""
    scenario, by = scenes()[name]
    session = Session(scenario, method(by))
    session.more(90)
    steps, drawn, kept, plane = session._played.steps, 0, 0, np.eye(scenario.dimension)
    for k in range(0, len(steps), 2):
        for session.robot in range(0, len(scenario.robots), 2):
            seen = session._seen(k)
            assert seen is not None
            chosen, made = seen.controls.chosen, seen.manoeuvre
            if chosen is None or made is None or seen.outcome not in Outcome.__members__:
                continue
            at = round((seen.time - scenario.start) / scenario.dt)
            assert (made.response, made.start) == (seen.response, seen.time)
            np.testing.assert_array_equal(seen.state.position, steps[at].positions[session.robot])
            if Outcome[seen.outcome].safe:
                # At the border, the colour begins within a small distance.
                near = [chosen, *(chosen + 1e-3 * side * axis for axis in plane for side in (-1.0, 1.0))]
                assert np.isinf(seen.times(np.array(near)).min(axis=-1, initial=np.inf)).any()
                drawn, kept = drawn + 1, kept + (seen.age > 0.0)
                assert not any("overlaps" in words for words in reasons(seen).sentences)
                if seen.age > 0.0:
                    assert f"It began {seen.age:.1f} s ago" in reasons(seen).sentences[1]
    assert drawn > 10
    # Robots that wait for messages seldom decide to keep a manoeuvre.
    assert kept > 0 or name == "fleet with late messages"


def test_shares_of_the_avoidance_are_drawn() -> None:
    """The outlines and colours of a message are those of the times to collision, also of robots that share."""
    session = Session(gallery.build("circle", {"robots": 6, "radius": 5.0}), method("rvo"))
    session.more(30)
    tested = 0
    for k in range(0, 30, 6):
        seen = session._seen(k)
        assert seen is not None
        (plane,) = planes_of(seen)
        found = Fields().of(seen, plane)
        controls = np.random.default_rng(k).uniform(-0.98 * plane.half, 0.98 * plane.half, (300, 2))
        times = seen.times(controls)
        assert any(other.share == 0.5 for other in seen.others)
        for row, field in enumerate(found):
            arrays = {"rings0": np.concatenate(field.rings), "ends0": np.cumsum([len(ring) for ring in field.rings])}
            region = drawn_region(arrays | {"owners0": np.zeros(len(field.rings), int)}) if field.rings else None
            if region is None or seen.others[row].share == 1.0:
                continue
            away = shapely.distance(shapely.points(controls), region.boundary) > 2e-3 * plane.half
            inside = shapely.contains_xy(region, controls[:, 0], controls[:, 1])
            np.testing.assert_array_equal(inside[away], np.isfinite(times[away, row]))
            tested += inside[away].sum()
    assert tested > 100


def test_people_who_are_not_seen_are_not_drawn() -> None:
    """The control space counts what the decision knew, and no sentence names anything else."""
    scenario = gallery.build("blind_corner")
    session = Session(scenario, method("nao"))
    session.more(60)
    least = len(scenario.obstacles)
    for k in range(60):
        seen = session._seen(k)
        assert seen is not None
        began = session._played.known(k).decision(round((seen.time - scenario.start) / scenario.dt))
        assert [other.obstacle for other in seen.others] == list(began.blocked.obstacles.obstacles)
        least = min(least, sum(other.kind == "obstacle" for other in seen.others))
    assert least < len(scenario.obstacles)


def test_a_goal_that_moves_is_drawn_where_it_is() -> None:
    scenario, by = scenes()["moving goal"]
    session = Session(scenario, method(by))
    messages = {fields["kind"]: arrays for fields, arrays in map(unpack, session.more(30))}
    times = scenario.dt * np.arange(30)
    np.testing.assert_allclose(messages["frames"]["goals"][:, 0], scenario.robot.goal.position(times), atol=6e-4)
    assert unpack(session.look(20)[0])[0]["target"] is None
