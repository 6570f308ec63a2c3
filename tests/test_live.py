"""The view: messages, control spaces, sessions and the server; and, where there is Chromium, the page itself."""

import asyncio
import contextlib
import json
import re
import shutil
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from slalom import Disc, InvalidInput, Limits, Obstacle, State, method
from slalom.goal import Goal
from slalom.live.agents import as_recorded
from slalom.live.edits import dragged, from_step, with_obstacle, with_setting, without_obstacle
from slalom.live.export import export, messages
from slalom.live.fields import Fields, Plane
from slalom.live.messages import pack, quantised, unpack
from slalom.live.others import state_at
from slalom.live.page import renderer
from slalom.live.recorded import recorded
from slalom.live.seen import decisions, seen_alone, seen_among
from slalom.live.session import Session
from slalom.obstacle.periodic import moved
from slalom.sim import Recording, gallery, read_scenario, simulate
from slalom.sim.files.recorded_traffic import read_recorded
from slalom.sim.files.scenario_writer import scenario_text, write_scenario
from slalom.sim.scenario import Robot, Scenario
from slalom.trajectory import Circular, ConstantVelocity, Stationary

WEB = Path(__file__).parents[1] / "web"
CHROMIUM = shutil.which("chromium")
QUIET = ("background-networking", "component-update", "sync")
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--no-first-run", *(f"--disable-{name}" for name in QUIET)]


def crossing(duration: float = 1.0) -> Scenario:
    """A robot among three cars."""
    cars = (
        Obstacle(Disc(1.0), Circular((10, 0), 6.0, 4.0, 2.5), "a"),
        Obstacle(Disc(0.8), ConstantVelocity((12, 4), (-2, -1)), "b"),
        Obstacle(Disc(0.5), Stationary((7, -1.2)), "c"),
    )
    robot = Robot(Disc(0.5), Limits(4.0, 3.0), State((0, 0), (3, 0)), Goal(Stationary((20, 0)), 0.5))
    return Scenario("crossing", (robot,), cars, duration=duration)


@pytest.fixture(scope="module")
def run() -> Recording:
    return simulate(crossing(), method("nao"))


def kinds(found: list[bytes]) -> list[str]:
    return [unpack(message)[0]["kind"] for message in found]


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


def drawn_region(arrays: dict[str, np.ndarray]) -> shapely.Geometry:
    """What the renderer fills: the outer curves, which run counter-clockwise, without the holes of each obstacle."""
    outer, holes = {}, {}
    for owner, ring in zip(arrays["owners0"].tolist(), np.split(arrays["rings0"], arrays["ends0"][:-1])):
        kind = outer if shapely.LinearRing(ring).is_ccw else holes
        kind.setdefault(owner, []).append(shapely.make_valid(shapely.Polygon(ring)))
    return shapely.union_all(
        [
            shapely.difference(shapely.union_all(filled), shapely.union_all(holes.get(owner, [])))
            for owner, filled in outer.items()
        ]
    )


@pytest.mark.parametrize("step", [0, 4])
def test_drawn_boundary_is_where_the_control_obstacle_is(run: Recording, step: int) -> None:
    """Controls inside the drawn outlines collide, those outside do not, by the decision that was made."""
    found = recorded(run)
    decision = list(decisions(found.scenario, method("nao"), found.steps))[step]
    seen = seen_alone(found.scenario, method("nao"), decision, step, state_at(found.steps, step, 0))
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
    session.answer({"do": "response", "number": 0, "id": 1})
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
    assert kinds(session.answer({"do": "add", "to": [4, 3], "radius": 0.5, "step": 0})) == kinds(moved)
    assert len(session.scenario.obstacles) == 4
    session.answer({"do": "remove", "index": 0, "step": 0})
    assert len(session.scenario.obstacles) == 3
    session.answer({"do": "set", "name": "horizon", "value": 3.0})
    assert session.scenario.horizon == 3.0
    for _ in range(4):
        session.answer({"do": "undo"})
    assert session.scenario.robot.state.position.tolist() == [0, 0]
    both = session.answer({"do": "compare", "name": "vo"})
    assert [unpack(m)[0]["slot"] for m in both if unpack(m)[0]["kind"] == "control"] == [1, 0]
    session.answer({"do": "method", "name": "ao"})
    assert session.method.name == "ao"
    assert kinds(session.answer({"do": "select", "robot": 0})) == ["series"]


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
        drift = arrays_of(session.answer({"do": "look", "step": k, "id": k}), "control")["drift"]
        np.testing.assert_allclose(drift[0], shifted[k, -1], atol=1e-5)


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
    drift = arrays_of(session.answer({"do": "look", "step": 4, "id": 1}), "control")["drift"]
    np.testing.assert_allclose(drift[0], own.position(0.4), atol=1e-5)


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
        ({"do": "remove", "index": 7, "step": 0}, "index: expected a number below 3"),
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


def test_unknown_commands_and_runs_without_steps_are_refused(run: Recording, tmp_path: Path) -> None:
    session = Session(crossing(), method("nao"))
    with pytest.raises(InvalidInput, match="do: expected one of look"):
        session.answer({"do": "fly"})
    with pytest.raises(InvalidInput, match=r"ending in \.html"):
        export(run, tmp_path / "run.pdf")
    with pytest.raises(InvalidInput, match="robot: expected one of 0 to 0"):
        export(run, tmp_path / "run.html", robot=1)
    with pytest.raises(InvalidInput, match="expected one robot"):
        next(decisions(gallery.build("circle"), method("nao"), []))
    with pytest.raises(InvalidInput, match="sight_noise: expected 0 in a file"):
        scenario_text(crossing().with_settings({"sight_noise": 0.1}))


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
    assert len(with_obstacle(scenario, (3, 3), 0.5).obstacles) == 4
    assert len(without_obstacle(scenario, 1).obstacles) == 2
    assert with_setting(scenario, "margin", 0.2).margin == 0.2
    assert from_step(scenario, [], 0) is scenario


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
    scenario = gallery.build("circle").with_settings({"duration": 0.4})
    found = recorded(simulate(scenario, method("nao_shared")))
    seen = seen_among(found.scenario, method("nao_shared"), found.steps, 2, 1)
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
    subprocess.run([node, "build.mjs", str(tmp_path / "view.js")], cwd=WEB, check=True)
    assert (tmp_path / "view.js").read_text() == renderer()
    subprocess.run([node, "node_modules/typescript/bin/tsc", "--noEmit"], cwd=WEB, check=True)


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """The address of a server."""
    with serving("roundabout_crossing", "--seed", "3") as found:
        yield found


@contextlib.contextmanager
def serving(*arguments: str) -> Iterator[str]:
    """The address of a server, which Ctrl-C must stop within seconds."""
    pytest.importorskip("uvicorn", reason="slalom[view] is not installed: the server is not tested")
    pytest.importorskip("websockets", reason="slalom[view] is not installed: the server is not tested")
    command = [sys.executable, "-m", "slalom", "view", *arguments, "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    yield process.stdout.readline().strip()
    process.send_signal(signal.SIGINT)
    assert process.wait(20) == 0
    process.stdout.close()


def socket_address(address: str) -> tuple[str, str]:
    """The address of the connection, and the origin of the page."""
    origin, _, query = address.partition("/?")
    return f"{origin.replace('http', 'ws')}/messages?{query}", origin


async def first_messages(url: str, origin: str, *sent: str, count: int = 4) -> list[bytes]:
    import websockets

    async with websockets.connect(url, origin=origin, max_size=None) as connection:  # type: ignore[arg-type]
        for text in sent:
            await connection.send(text)
        return [await asyncio.wait_for(connection.recv(), 30) for _ in range(count)]  # type: ignore[misc]


@pytest.mark.slow
def test_the_server_refuses_what_it_must(address: str) -> None:
    import websockets

    url, origin = socket_address(address)
    assert kinds(asyncio.run(first_messages(url, origin)))[:2] == ["scene", "frames"]
    with pytest.raises(urllib.error.HTTPError, match="403"):
        urllib.request.urlopen(address[:-4] + "AAAA")
    for wrong_url, wrong_origin in ((url[:-4] + "AAAA", origin), (url, "http://example.org")):
        with pytest.raises(websockets.exceptions.InvalidStatus):
            asyncio.run(first_messages(wrong_url, wrong_origin))
    for sent in ("x" * 20000, "x" * 200000, "not json", "[1]", '{"do": 3}', "[" * 9000):
        with pytest.raises(websockets.exceptions.ConnectionClosed):
            asyncio.run(first_messages(url, origin, sent, count=1000))


@pytest.mark.slow
def test_the_server_survives_clients_that_come_and_go(address: str) -> None:
    import websockets

    url, origin = socket_address(address)

    async def come_and_go() -> None:
        for _ in range(100):
            async with websockets.connect(url, origin=origin):  # type: ignore[arg-type]
                pass
        # One that stops reading does not hold up another.
        async with websockets.connect(url, origin=origin, max_queue=1):  # type: ignore[arg-type]
            await first_messages(url, origin)

    asyncio.run(come_and_go())
    assert kinds(asyncio.run(first_messages(url, origin)))[0] == "scene"


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: pages are not opened")
def test_pages_in_a_browser(address: str, run: Recording, tmp_path: Path) -> None:
    """A file opens without a request; the live view answers a drag, and copies the scene that it shows."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed: pages are not opened")
    app = "document.getElementById('slalom').slalom"
    page_file = export(run, tmp_path / "run.html")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        with contextlib.closing(browser):
            page = browser.new_context(bypass_csp=True).new_page()
            requests, troubles = [], []
            page.on("request", lambda request: requests.append(request.url))
            page.on("pageerror", lambda error: troubles.append(str(error)))
            page.on("console", lambda message: troubles.append(message.text) if message.type == "error" else None)
            page.goto(page_file.as_uri())
            page.wait_for_function(f"{app}.model.controls[0].size > 0")
            page.keyboard.press("ArrowRight")
            assert page.evaluate(f"{app}.model.step") == 1
            page.keyboard.press("Space")
            page.wait_for_function(f"{app}.model.playhead > 2")
            assert requests == [page_file.as_uri()]
            page.goto(address)
            page.wait_for_function(f"{app}.model.complete && {app}.model.controls[0].size > 0")
            x, y = page.evaluate(
                f"(() => {{ const a = {app}, o = a.model.obstacle(3);"
                "const r = a.parts.workspace.canvas.getBoundingClientRect();"
                "return [r.x + a.view.px(o[0]), r.y + a.view.py(o[1])]; })()"
            )
            before = page.evaluate(f"{app}.model.obstacle(3)")
            page.evaluate(f"{app}.latencies.length = 0")
            page.mouse.move(x, y)
            page.mouse.down()
            for k in range(60):
                page.mouse.move(x + k, y)
                page.wait_for_timeout(10)
            page.mouse.up()
            page.wait_for_function(f"{app}.model.scene.undo === 1 && {app}.model.complete")
            assert page.evaluate(f"{app}.model.obstacle(3)")[0] > before[0] + 1.0
            spent = np.array(page.evaluate(f"{app}.latencies"))
            median, worst = np.percentile(spent, [50, 99])
            print(f"redrawn after a drag: median {median:.0f} ms, 99 % {worst:.0f} ms, {len(spent)} drags")
            page.locator("select[aria-label=method]").select_option("vo")
            page.wait_for_function(f"{app}.model.control()?.method === 'vo'")
            page.locator("[data-name=yaml]").click()
            page.wait_for_function(f"{app}.parts.yamlText.value.length > 0")
            (tmp_path / "scene.yaml").write_text(page.evaluate(f"{app}.parts.yamlText.value"))
            page.wait_for_function(f"{app}.model.complete")
            shown = page.evaluate(f"{app}.model.count")
            assert troubles == []
    again = simulate(read_scenario(tmp_path / "scene.yaml"), method("vo"))
    assert len(again.times) == shown
    assert json.dumps(again.times[0]) == "0.0"


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: pages are not opened")
def test_a_replay_in_a_browser(run: Recording, tmp_path: Path) -> None:
    """Step, slider and play show the states of the file, each with its control space."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed: pages are not opened")
    app, file = "document.getElementById('slalom').slalom", tmp_path / "run.h5"
    shifted = run.positions + np.linspace(0.0, 0.8, len(run.times))[:, None, None] * np.array([0.3, 1.0])
    replace(run, positions=shifted).save(file)
    with serving(str(file)) as address, sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        with contextlib.closing(browser):
            page = browser.new_context(bypass_csp=True).new_page()
            page.goto(address)
            page.wait_for_function(f"{app}.model.complete && {app}.model.control()?.step === 0")
            for act in (
                lambda: page.keyboard.press("ArrowRight"),
                lambda: page.locator("input[aria-label='time of the run']").fill("6"),
                lambda: page.keyboard.press("End"),
            ):
                act()
                step = page.evaluate(f"{app}.model.step")
                np.testing.assert_allclose(page.evaluate(f"{app}.model.robot(0)"), shifted[step, 0], atol=1e-3)
                last = min(step, len(run.accelerations) - 1)
                page.wait_for_function(f"{app}.model.control()?.step === {last}")
                page.locator("canvas").first.focus()
            page.keyboard.press("Space")
            page.wait_for_function(f"{app}.model.playhead > 1 && {app}.model.playhead < {len(run.times) - 1}")
