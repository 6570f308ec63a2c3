"""The view: messages, control spaces, sessions and the server; and, where there is Chromium, the page itself."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from live_views import WEB, crossing, drawn_region, kinds

from slalom import Disc, InvalidInput, Limits, Obstacle, PathGoal, State, method
from slalom.live.control_space import Fields, Plane
from slalom.live.messages import pack, quantised, renderer, unpack
from slalom.live.recorded import as_recorded, export, messages
from slalom.live.seen import decided_again
from slalom.live.session import Session, dragged, drawn, from_step, led, with_setting, without
from slalom.model.trajectory import Circular
from slalom.obstacle.displaced import moved
from slalom.sim import Recording, gallery, read_scenario, simulate
from slalom.sim.files.recorded_traffic import read_recorded
from slalom.sim.files.scenario_writer import scenario_text, write_scenario
from slalom.sim.run.recorded import recorded
from slalom.sim.scenario import Robot, Scenario


@pytest.fixture(scope="module")
def run() -> Recording:
    return simulate(crossing(), method("nao"))


@pytest.mark.parametrize("order", [0, 1, 2])
def test_messages_come_back(order: int) -> None:
    values = np.random.default_rng(1).uniform(-40.0, 40.0, (7, 3, 2))
    values[2, 1] = np.nan
    given = quantised(values, [-40.0, -40.0], [40.0, 40.0], step=0.01, order=order)
    fields, arrays = unpack(pack("frames", {"first": 3}, {"x": given, "n": np.arange(5, dtype=np.int32)}))
    assert fields == {"kind": "frames", "first": 3}
    np.testing.assert_allclose(arrays["x"], values, atol=0.0051)
    assert arrays["n"].tolist() == [0, 1, 2, 3, 4]
    with pytest.raises(InvalidInput, match="scene: expected finite numbers"):
        pack("scene", {"x": float("nan")}, {})


@pytest.mark.parametrize("step", [0, 4])
def test_drawn_boundary_is_where_the_control_obstacle_is(run: Recording, step: int) -> None:
    """Controls inside the drawn outlines collide, those outside do not, by the decision that was made."""
    found = recorded(run)
    known = list(decided_again(found.scenario, method("nao"), found.steps))[step]
    seen = known.seen(found.steps, step)
    decision = known.decision(round(seen.time / found.scenario.dt))
    control = next(m for m in messages(run) if unpack(m)[0].get("step") == step)
    fields, arrays = unpack(control)
    half = fields["planes"][0]["half"]
    region = drawn_region(arrays)
    controls = np.random.default_rng(2).uniform(-0.98 * half, 0.98 * half, (600, 2))
    away = shapely.distance(shapely.points(controls), region.boundary) > 2e-3 * half
    inside = shapely.contains_xy(region, controls[:, 0], controls[:, 1])
    assert 50 < inside[away].sum() < away.sum() - 50
    np.testing.assert_array_equal(inside[away], decision.blocked.contains(controls[away]))
    np.testing.assert_array_equal(inside[away], seen.blocked.contains(controls[away]))


def test_only_what_changed_is_computed_again() -> None:
    session = Session(crossing(), method("nao"))
    session.opening()
    session.answer({"do": "response", "number": 0, "step": 0, "id": 1})
    before = session._fields.computed
    drag = {"do": "drag", "what": "obstacle", "index": 2, "to": [7.0, -1.0], "step": 0, "gesture": 1, "id": 2}
    session.answer(drag)
    assert session._fields.computed == before + 1
    session.answer(drag | {"to": [7.0, -0.8], "id": 3})
    assert session._fields.computed == before + 2


def test_a_session_answers_every_command() -> None:
    session = Session(crossing(), method("nao"))
    assert kinds(session.opening()) == ["scene", "frames", "series", "control"]
    assert kinds(session.more(4)) == ["frames", "series"]
    assert kinds(session.answer({"do": "look", "step": 3, "id": 1})) == ["control"]
    probe = unpack(session.answer({"do": "drag", "what": "control", "to": [2.9, 0.0], "step": 0, "id": 2})[0])[0]
    assert probe["kind"] == "probe"
    assert probe["answers"] == 2
    moved = session.answer({"do": "drag", "what": "robot", "index": 0, "to": [1, 1], "step": 3, "id": 3})
    assert kinds(moved)[0] == "scene"
    assert session.scenario.robot.state.position.tolist() == [1, 1]
    assert session.scenario.start == pytest.approx(0.3)
    added = {"do": "add", "what": "obstacle", "points": [[4, 3]], "radius": 0.5, "step": 0}
    assert kinds(session.answer(added)) == kinds(moved)
    assert len(session.scenario.obstacles) == 4
    session.answer({"do": "remove", "what": "obstacle", "index": 0, "step": 0})
    assert len(session.scenario.obstacles) == 3
    session.answer({"do": "set", "name": "horizon", "value": 3.0})
    assert session.scenario.horizon == 3.0
    for _ in range(4):
        session.answer({"do": "undo"})
    assert session.scenario.robot.state.position.tolist() == [0, 0]
    both = session.answer({"do": "compare", "name": "vo", "step": 3})
    assert [unpack(m)[0]["slot"] for m in both if unpack(m)[0]["kind"] == "control"] == [1, 0]
    session.answer({"do": "method", "name": "ao"})
    assert session.method.name == "ao"
    assert kinds(session.answer({"do": "select", "robot": 0})) == ["series"]


@pytest.mark.parametrize("count", [1, 2])
def test_on_a_path_the_target_is_the_point_ahead(count: int) -> None:
    """The preferred velocity leads there, up to the corner, also between two decisions."""
    goal = PathGoal([(0, 0), (4, 0), (4, 9)], tolerance=0.3, lookahead=2.0)
    robots = [Robot(Disc(0.5), Limits(3.0, 3.0), State((0, 20 * k), (3, 0)), goal, str(k)) for k in range(count)]
    session = Session(Scenario("path", tuple(robots), (), duration=2.0), method("vo"))
    session.opening()
    session.more(8)
    for step in range(4):
        fields = unpack(session.look(step)[-1])[0]
        at = session._played.steps[step].positions[0]
        assert fields["target"] == pytest.approx([4.0, 0.0], abs=0.02)
        assert at[0] < 4.0


def arrays_of(found: list[bytes], kind: str) -> dict[str, np.ndarray]:
    return next(arrays for fields, arrays in map(unpack, found) if fields["kind"] == kind)


@pytest.mark.parametrize("name", ["alone", "fleet"])
def test_a_replay_shows_the_states_of_the_file(run: Recording, tmp_path: Path, name: str) -> None:
    """Also those that no run of the scenario would reach; the control space is that of the recorded state."""
    made = run if name == "alone" else simulate(gallery.build("circle").with_settings({"duration": 1.0}), method("nao"))
    shifted = made.positions + np.linspace(0.0, 0.8, len(made.times))[:, None, None] * np.array([0.3, 1.0])
    replace(made, positions=shifted).save(tmp_path / "run.h5")
    session = Session.of(recorded(Recording.load(tmp_path / "run.h5")), method("vo"))
    opening = session.opening()
    scene = unpack(opening[0])[0]
    assert (scene["recorded"], scene["method"], session.complete) == (True, "nao", True)
    np.testing.assert_allclose(arrays_of(opening, "frames")["positions"], shifted, atol=6e-4)
    assert session.more() == []
    session.answer({"do": "select", "robot": len(made.shapes) - 1})
    for k in (7, 2):
        fields, arrays = unpack(session.answer({"do": "look", "step": k, "id": k})[0])
        begun = round(fields["time"] / session.scenario.dt)
        assert (fields["step"], begun == k) == (k, fields["outcome"] in ("CLEAR", "CONSTRAINED"))
        np.testing.assert_allclose(arrays["drift"][0], shifted[begun, -1], atol=1e-5)


@pytest.mark.parametrize("agent", [None, "car 2"])
def test_an_agent_of_a_recording_moves_as_recorded(tmp_path: Path, agent: str | None) -> None:
    """The control space is that of its recorded state, among the other agents."""
    rows = [(f"car {j}", 0.2 * k, 0.2 * k * (2 + j), 3.0 * j + 0.02 * k * k) for j in (1, 2) for k in range(8 - j)]
    text = "\n".join(["id,t,x,y", *(f"{name},{t},{x},{y}" for name, t, x, y in rows)])
    (tmp_path / "cars.csv").write_text(text + "\n")
    tracks = read_recorded(tmp_path / "cars.csv")
    found = as_recorded(tracks, method("nao"), agent)
    session = Session.of(found, method("nao"))
    opening = session.opening()
    own = tracks.obstacles[0 if agent is None else 1].trajectory
    assert len(found.scenario.obstacles) == 1
    times = 0.1 * np.arange(len(found.steps) + 1)
    np.testing.assert_allclose(arrays_of(opening, "frames")["positions"][:, 0], own.position(times), atol=6e-4)
    fields, arrays = unpack(session.answer({"do": "look", "step": 4, "id": 1})[0])
    np.testing.assert_allclose(arrays["drift"][0], own.position(fields["time"]), atol=1e-5)


def test_a_change_of_a_replay_begins_a_run_and_undo_returns_to_the_replay(run: Recording) -> None:
    session = Session.of(recorded(run), method("vo"))
    session.opening()
    drag = {"do": "drag", "what": "robot", "index": 0, "to": [1, 1], "step": 4, "gesture": 1}
    assert unpack(session.answer(drag)[0])[0]["recorded"] is False
    assert session.scenario.start == pytest.approx(0.4)
    assert unpack(session.answer({"do": "undo"})[0])[0]["recorded"] is True
    assert unpack(session.answer({"do": "method", "name": "vo"})[0])[0]["recorded"] is False
    again = session.answer({"do": "undo"})
    assert (session.method.name, session.complete) == ("nao", True)
    np.testing.assert_allclose(arrays_of(again, "frames")["positions"], run.positions, atol=6e-4)


def test_a_replay_of_another_project_has_no_control_space(run: Recording) -> None:
    session = Session.of(recorded(replace(run, method="nao+vo")), method("nao"))
    assert kinds(session.opening()) == ["scene", "frames", "series"]
    assert kinds(session.answer({"do": "look", "step": 1})) == []


@pytest.mark.parametrize(
    ("command", "sentence"),
    [
        ({"do": "look"}, "step: expected a value"),
        ({"do": "select", "robot": 5}, "robot: expected a number below 1"),
        ({"do": "drag", "what": "wall", "index": 0, "to": [0, 0], "step": 0}, "what: expected one of"),
        ({"do": "drag", "what": "goal", "index": 9, "to": [0, 0], "step": 0}, "index: expected a number below 1"),
        ({"do": "drag", "what": "goal", "index": 0, "to": [7, -1.2], "step": 0, "gesture": 1}, ""),
        ({"do": "drag", "what": "robot", "index": 0, "to": ["x"], "step": 0}, "to: expected numbers"),
        ({"do": "drag", "what": "control", "to": [1, 2, 3], "step": 0}, "to: expected 2 numbers"),
        ({"do": "remove", "what": "obstacle", "index": 7, "step": 0}, "index: expected a number below 3"),
        ({"do": "remove", "index": 0, "step": 0}, "what: expected a value"),
        ({"do": "add", "what": "wall", "points": [[0, 0]], "radius": 1, "step": 0}, "points: expected"),
        ({"do": "path", "index": 0, "points": [[0, 0], [1, 1]], "step": 0}, "speed: expected a value"),
        ({"do": "set", "name": "dt", "value": 1.0}, "name: expected one of horizon"),
        ({"do": "method", "name": "magic"}, "method: expected one of"),
        ({"do": "undo"}, "undo: expected a change"),
    ],
)
def test_a_refused_command_is_answered_by_a_sentence(command: dict[str, object], sentence: str) -> None:
    session = Session(crossing(), method("nao"))
    session.opening()
    answers = [unpack(message)[0] for message in session.answer(command)]
    if sentence:
        assert answers[-1]["kind"] == "error"
        assert answers[-1]["text"].startswith(sentence)
    assert kinds(session.answer({"do": "look", "step": 0})) == ["control"]


def test_edits_do_what_they_say() -> None:
    scenario = crossing()
    away = dragged(scenario, "obstacle", 0, (1.0, 2.0)).obstacles[0].trajectory
    assert isinstance(away, Circular)
    np.testing.assert_allclose(away.position(0.0), (1.0, 2.0))
    straight = dragged(scenario, "obstacle_velocity", 0, (0.0, 0.0)).obstacles[0].trajectory
    here = scenario.obstacles[0].trajectory.position(0.0)
    np.testing.assert_allclose(straight.position(1.0), here - here, atol=1e-12)
    fast = dragged(scenario, "robot_velocity", 0, (50.0, 0.0)).robot.state.velocity
    assert fast.tolist() == [4.0, 0.0]
    assert len(without(scenario, "obstacle", 1).obstacles) == 2
    assert with_setting(scenario, "margin", 0.2).margin == 0.2
    assert from_step(scenario, [], 0) is scenario


def test_what_is_drawn_is_in_the_scene() -> None:
    scenario = crossing()
    post = drawn(scenario, "obstacle", [(3, 3)], 0.5).obstacles[-1]
    assert (post.name, post.shape.bounding_radius, post.trajectory.position(9.0).tolist()) == (
        "obstacle 3",
        0.5,
        [3, 3],
    )
    wall = drawn(scenario, "wall", [(1, 2), (4, 2)], 0.5)
    assert wall.obstacles[-1].shape.parts[0].corners.tolist() == [[1, 2], [4, 2]]
    assert drawn(wall, "wall", [(1, 3), (4, 3)], 0.5).obstacles[-1].name == "wall 4"
    two = drawn(scenario, "robot", [(0, 5), (9, 5)], 0.4)
    assert [robot.name for robot in two.robots] == ["robot", "robot 1"]
    assert two.robots[1].goal.position(0.0).tolist() == [9, 5]
    assert without(two, "robot", 0).robot.name == "robot 1"
    # Along 3 m and 4 m at 2 m/s from where it is, and then it stays.
    path = led(scenario, 2, [(0, 0), (10, -1.2), (10, 2.8)], 2.0).obstacles[2].trajectory
    np.testing.assert_allclose(
        path.position(np.array([0.0, 1.5, 2.5, 60.0])), [(7, -1.2), (10, -1.2), (10, 0.8), (10, 2.8)]
    )
    refused = {
        "what: expected one of obstacle, wall, robot": lambda: drawn(scenario, "tree", [(0, 0)], 1.0),
        r"points: expected \(2 or more, 2\) numbers, found \(1, 2\)": lambda: drawn(scenario, "wall", [(0, 0)], 1.0),
        "radius: expected": lambda: drawn(scenario, "obstacle", [(0, 0)], 0.0),
        "points: expected a line with a length": lambda: led(scenario, 2, [(0, 0)], 1.0),
        "speed: expected": lambda: led(scenario, 2, [(0, 0), (1, 1)], -1.0),
        "index: expected a number below 3": lambda: led(scenario, 3, [(0, 0), (1, 1)], 1.0),
        "what: expected obstacle or robot": lambda: without(scenario, "goal", 0),
        "robot: expected one that remains": lambda: without(scenario, "robot", 0),
    }
    for sentence, call in refused.items():
        with pytest.raises(InvalidInput, match=sentence):
            call()


def test_a_written_scenario_runs_equal_to_the_bit(tmp_path: Path) -> None:
    for scenario in (dragged(crossing(0.5), "obstacle_velocity", 0, (3.1, -0.7)), gallery.build("circle")):
        short = scenario.with_settings({"duration": 0.5})
        write_scenario(short, tmp_path / "scene.yaml")
        again = read_scenario(tmp_path / "scene.yaml")
        assert simulate(again, method("nao")).digest() == simulate(short, method("nao")).digest()
    shifted = moved(Circular((10, 0), 6.0, 4.0), np.array([1.0, 0.0]))
    other = replace(crossing(), obstacles=(Obstacle(Disc(1.0), shifted, "shifted"),))
    assert "piecewise_polynomial" in scenario_text(other)


def test_a_robot_among_others_sees_them() -> None:
    scenario = gallery.build("circle", {"robots": 4, "radius": 5.0, "duration": 0.4})
    found = recorded(simulate(scenario, method("nao_shared")))
    seen = list(decided_again(found.scenario, method("nao_shared"), found.steps))[2].seen(found.steps, 2, 1)
    assert {other.number for other in seen.others if other.kind == "robot"} == {0, 2, 3}
    assert seen.manoeuvre is not None
    plane = Plane((0, 1), 2.0, (0.0, 0.0))
    assert len(Fields().of(seen, plane)) == len(seen.others)


def test_export_needs_no_server_and_states_no_address(run: Recording, tmp_path: Path) -> None:
    path = export(run, tmp_path / "run.html")
    text = path.read_text()
    assert "connect-src 'none'" in text
    assert not re.search(r"""(src|href)=["']https?:""", text)


def test_the_bundle_is_that_of_the_sources(tmp_path: Path) -> None:
    node = shutil.which("node")
    if node is None or not (WEB / "node_modules").is_dir():
        pytest.skip("Node or web/node_modules is not installed (`npm ci` in web/): the bundle is not built again")
    subprocess.run([node, "build.mjs", str(tmp_path)], cwd=WEB, check=True)
    assert (tmp_path / "view.js").read_text() == renderer()
    assert (tmp_path / "explorer.html").read_text() == (WEB.parent / "docs/_static/explorer.html").read_text()
    subprocess.run([node, "node_modules/typescript/bin/tsc", "--noEmit"], cwd=WEB, check=True)
