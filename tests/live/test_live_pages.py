"""The page of the view in Chromium."""

import base64
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from live_views import APP, crossing, drawn_region, in_browser, opened, serving

from slalom import method
from slalom.live.messages import renderer
from slalom.live.recorded import export
from slalom.live.seen import decided_again
from slalom.sim import Recording, gallery, read_scenario, simulate
from slalom.sim.run.recorded import recorded

pytestmark = [pytest.mark.slow, pytest.mark.browser, in_browser]
LOOKED = f"{APP}?.model.complete && {APP}.model.control()"
"""Whether a page knows its whole run, and shows a control space."""


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """The address of a server."""
    with serving("roundabout_crossing", "--seed", "3") as found:
        yield found


@pytest.fixture(scope="module")
def run() -> Recording:
    return simulate(crossing(), method("nao"))


def pixels(page: Any, controls: np.ndarray) -> np.ndarray:
    """The colours (n, 3) of the drawn control space at controls (n, 2), without marks and deciding elements."""
    return np.array(
        page.evaluate(
            "(controls) => { const a = " + APP + ", g = a.parts.controls[0].canvas.getContext('2d');"
            "const v = a.controlViewport(0), r = devicePixelRatio;"
            "return controls.map(([x, y]) => [...g.getImageData(v.px(x) * r, v.py(y) * r, 1, 1).data].slice(0, 3)); }",
            controls.tolist(),
        )
    )


def away_from_marks(page: Any, controls: np.ndarray, distance: float) -> np.ndarray:
    """Which controls (n, 2) are at least some pixels away from the marks and the border of the admissible set.

    A plane that touches the admissible set in one point has no border.
    """
    marks = page.evaluate(
        "(() => { const a = " + APP + ", c = a.model.control(), p = c.planes[a.plane], v = a.controlViewport(0);"
        "const s = c.arrays['admissible' + a.plane]?.values ?? [], u = c.planes[a.plane].axes;"
        "return { scale: v.scale, marks: [c.preferred, c.chosen].map((m) => u.map((k) => m[k])), line: [...s] }; })()"
    )
    far = np.ones(len(controls), dtype=bool)
    if marks["line"]:
        border = shapely.LinearRing(np.reshape(marks["line"], (-1, 2)))
        far = shapely.distance(shapely.points(controls), border) * marks["scale"] > distance
    half = np.abs(controls).max()
    for mark in np.clip(marks["marks"], -half, half):
        far &= np.linalg.norm(controls - mark, axis=1) * marks["scale"] > distance + 14
    return far


def test_a_file_opens_without_a_request(run: Recording, tmp_path: Path) -> None:
    file = export(run, tmp_path / "run.html")
    with opened() as (page, troubles):
        requests: list[str] = []
        page.on("request", lambda request: requests.append(request.url))
        page.goto(file.as_uri())
        page.wait_for_function(f"{APP}.model.controls[0].size > 0")
        page.keyboard.press("ArrowRight")
        assert page.evaluate(f"{APP}.model.step") == 1
        page.keyboard.press("Space")
        page.wait_for_function(f"{APP}.model.playhead > 2")
        assert requests == [file.as_uri()]
        assert troubles == []


def test_drawn_colours_are_those_of_the_control_obstacle(run: Recording, tmp_path: Path) -> None:
    """The pixels of the page, against the control obstacle by which the robot decided."""
    found, step = recorded(run), 4
    known = list(decided_again(found.scenario, method("nao"), found.steps))[step]
    seen = known.seen(found.steps, step)
    decision = known.decision(round(seen.time / found.scenario.dt))
    with opened() as (page, troubles):
        page.goto(export(run, tmp_path / "run.html").as_uri())
        page.wait_for_function(f"{APP}.model.controls[0].size > 0")
        page.evaluate(f"{APP}.setDeciding(false); {APP}.seek({step})")
        page.wait_for_timeout(200)
        half = page.evaluate(f"{APP}.model.control().planes[0].half")
        controls = np.random.default_rng(5).uniform(-0.97 * half, 0.97 * half, (3000, 2))
        seen_boundary = drawn_region(outlines(page)).boundary
        scale = page.evaluate(f"{APP}.controlViewport(0).scale")
        far = away_from_marks(page, controls, 5.0) & (
            shapely.distance(shapely.points(controls), seen_boundary) * scale > 3.0
        )
        coloured = (pixels(page, controls) < 250).any(axis=1)
        inside = decision.blocked.contains(controls)
        thin = np.zeros(len(controls), dtype=bool)
        for ring in rings_of(page):
            thin |= shapely.distance(shapely.points(controls), shapely.LinearRing(ring)) * scale < 3.0
        kept = far & ~thin
        assert 200 < inside[kept].sum() < kept.sum() - 200
        np.testing.assert_array_equal(coloured[kept], inside[kept])
        np.testing.assert_array_equal(seen.blocked.contains(controls), inside)
        assert troubles == []


def rings_of(page: Any) -> list[np.ndarray]:
    """The outlines that the page draws."""
    arrays = outlines(page)
    return [ring for ring in np.split(arrays["rings0"], arrays["ends0"][:-1]) if len(ring) > 3]


def outlines(page: Any) -> dict[str, np.ndarray]:
    """The outlines of the shown control space, as the page holds them."""
    held = page.evaluate(
        f"(() => {{ const a = {APP}.model.control().arrays;"
        "return Object.fromEntries(['rings0', 'ends0', 'owners0'].map((k) => [k, [...a[k].values]])); })()"
    )
    return {
        "rings0": np.reshape(held["rings0"], (-1, 2)),
        "ends0": np.array(held["ends0"], dtype=int),
        "owners0": np.array(held["owners0"], dtype=int),
    }


def test_the_slice_in_space_is_coloured_where_controls_collide(tmp_path: Path) -> None:
    made = simulate(gallery.build("drones_crossing").with_settings({"duration": 1.0}), method("nao"))
    found, step = recorded(made), 7
    blocked = list(decided_again(found.scenario, method("nao"), found.steps))[step].seen(found.steps, step).blocked
    with opened() as (page, troubles):
        page.goto(export(made, tmp_path / "run.html").as_uri())
        page.wait_for_function(f"{APP}.model.controls[0].size > 0")
        page.evaluate(f"{APP}.seek({step})")
        for key, axes in (("1", (0, 1)), ("2", (0, 2)), ("3", (1, 2))):
            page.keyboard.press(key)
            page.wait_for_timeout(200)
            plane = page.evaluate(f"{APP}.model.control().planes[{APP}.plane]")
            assert tuple(plane["axes"]) == axes
            half = plane["half"]
            flat = np.random.default_rng(6).uniform(-0.97 * half, 0.97 * half, (800, 2))
            around = flat[:, None] + 0.03 * half * np.stack([np.cos(np.arange(8)), np.sin(np.arange(8))], axis=1)
            controls = np.tile(plane["through"], (800, 9, 1))
            controls[:, 0, axes], controls[:, 1:, axes] = flat, around
            blocked_there = blocked.contains(controls)
            clear = (blocked_there == blocked_there[:, :1]).all(axis=1) & away_from_marks(page, flat, 5.0)
            coloured = (pixels(page, flat) < 250).any(axis=1)
            np.testing.assert_array_equal(coloured[clear], blocked_there[clear, 0])
            assert clear.sum() > 300
        box = page.locator("canvas[data-panel=control]").first.bounding_box()
        page.mouse.click(box["x"] + box["width"] - 40, box["y"] + 60)
        assert page.evaluate(f"{APP}.plane") == 0
        assert troubles == []


def test_a_drag_is_answered_and_the_copied_scene_runs_equal(address: str, tmp_path: Path) -> None:
    with opened() as (page, troubles):
        page.goto(address)
        page.wait_for_function(LOOKED)
        x, y = page.evaluate(
            f"(() => {{ const a = {APP}, o = a.model.obstacle(3);"
            "const r = a.parts.workspace.canvas.getBoundingClientRect();"
            "return [r.x + a.view.px(o[0]), r.y + a.view.py(o[1])]; })()"
        )
        before = page.evaluate(f"{APP}.model.obstacle(3)")
        page.evaluate(f"{APP}.latencies.length = 0")
        page.mouse.move(x, y)
        page.mouse.down()
        for k in range(60):
            page.mouse.move(x + k, y)
            page.wait_for_timeout(10)
        page.mouse.up()
        page.wait_for_function(f"{APP}.model.scene.undo === 1 && {APP}.model.complete")
        assert page.evaluate(f"{APP}.model.obstacle(3)")[0] > before[0] + 1.0
        spent = np.array(page.evaluate(f"{APP}.latencies"))
        median, worst = np.percentile(spent, [50, 99])
        print(f"redrawn after a drag: median {median:.0f} ms, 99 % {worst:.0f} ms, {len(spent)} drags")
        page.locator("select[aria-label=method]").select_option("vo")
        page.wait_for_function(f"{APP}.model.control()?.method === 'vo'")
        page.locator("[data-name=draw]").click()
        page.locator("[data-name=yaml]").click()
        page.wait_for_function(f"{APP}.parts.yamlText.value.length > 0")
        (tmp_path / "scene.yaml").write_text(page.evaluate(f"{APP}.parts.yamlText.value"))
        page.wait_for_function(f"{APP}.model.complete")
        page.keyboard.press("Escape")
        shown = [page.evaluate(f"[{APP}.seek({k}), {APP}.model.robot(0)][1]") for k in (0, 5, 10**6)]
        count = page.evaluate(f"{APP}.model.count")
        assert troubles == []
    again = simulate(read_scenario(tmp_path / "scene.yaml"), method("vo"))
    assert len(again.times) == count
    np.testing.assert_allclose(shown, again.positions[[0, 5, -1], 0], atol=1e-3)


def test_a_replay_in_a_browser(run: Recording, tmp_path: Path) -> None:
    """Step, slider and play show the states of the file, each with its control space."""
    file = tmp_path / "run.h5"
    shifted = run.positions + np.linspace(0.0, 0.8, len(run.times))[:, None, None] * np.array([0.3, 1.0])
    replace(run, positions=shifted).save(file)
    with serving(str(file)) as address, opened() as (page, _):
        page.goto(address)
        page.wait_for_function(f"{LOOKED}?.step === 0")
        for act in (
            lambda: page.keyboard.press("ArrowRight"),
            lambda: page.locator("input[aria-label='time of the run']").fill("6"),
            lambda: page.keyboard.press("End"),
        ):
            act()
            step = page.evaluate(f"{APP}.model.step")
            np.testing.assert_allclose(page.evaluate(f"{APP}.model.robot(0)"), shifted[step, 0], atol=1e-3)
            last = min(step, len(run.accelerations) - 1)
            page.wait_for_function(f"{APP}.model.control()?.step === {last}")
            page.locator("canvas").first.focus()
        page.keyboard.press("Space")
        page.wait_for_function(f"{APP}.model.playhead > 1 && {APP}.model.playhead < {len(run.times) - 1}")


def test_a_scene_with_fewer_bodies_is_drawn_before_its_control_space(address: str) -> None:
    """Their messages arrive one by one, and a frame may be drawn in between."""
    shown = f"""() => {{
        const app = {APP};
        app.setElement(1.0);
        app.receive([{{ ...app.model.scene, obstacles: [], moving: [] }}]);
        app.model.count = 1;
        app.draw();
        return app.model.control();
    }}"""
    with opened() as (page, troubles):
        page.goto(address)
        page.wait_for_function(LOOKED)
        assert page.evaluate(f"{APP}.model.control().predicted.length") > 0
        assert page.evaluate(shown) is None
        assert troubles == []


def test_everything_is_reachable_by_the_keyboard(address: str) -> None:
    """Handles, control, methods, undo, dialogs; the time that is shown stays when a second method is chosen."""
    with opened(color_scheme="dark") as (page, troubles):
        page.goto(address)
        page.wait_for_function(LOOKED)
        page.keyboard.press("ArrowRight")
        page.keyboard.press("c")
        page.wait_for_function(f"{APP}.model.control(1) && {APP}.model.scene.compare")
        assert page.evaluate(f"{APP}.model.step") == 1
        page.evaluate(f"{APP}.compare('')")
        for _ in range(4):
            page.keyboard.press("h")
        assert page.evaluate(f"{APP}.dragging.handle.what") == "control"
        page.keyboard.press("Shift+ArrowUp")
        page.wait_for_function(f"{APP}.model.probe?.sentence.includes('hits')")
        page.keyboard.press("Escape")
        page.keyboard.press("h")
        page.keyboard.press("h")
        assert page.evaluate(f"{APP}.dragging.handle.what") == "robot"
        before = page.evaluate(f"{APP}.model.robot(0)")
        page.keyboard.press("Shift+ArrowUp")
        page.wait_for_function(f"{APP}.model.scene.undo === 1 && {APP}.model.count > 1")
        after = page.evaluate(f"[{APP}.seek(0), {APP}.model.robot(0)][1]")
        np.testing.assert_allclose(after, np.add(before, (0.0, 0.25)), atol=1e-3)
        page.keyboard.press("u")
        page.wait_for_function(f"{APP}.model.scene.undo === 0")
        count = page.evaluate(f"{APP}.model.scene.obstacles.length")
        page.keyboard.press("a")
        page.wait_for_function(f"{APP}.model.scene.obstacles.length === {count + 1}")
        page.keyboard.press("x")
        page.wait_for_function(f"{APP}.model.scene.obstacles.length === {count}")
        page.keyboard.press("?")
        assert page.evaluate(f"{APP}.parts.keys.open")
        page.keyboard.press("Escape")
        assert not page.evaluate(f"{APP}.parts.keys.open")
        page.keyboard.press("t")
        assert page.evaluate(f"{APP}.root.dataset.theme") == "light"
        assert troubles == []


def test_the_camera_turns_by_mouse_and_keyboard() -> None:
    with serving("drones_crossing", "--set", "duration=1") as address, opened() as (page, troubles):
        page.goto(address)
        page.wait_for_function(LOOKED)
        yaw = page.evaluate(f"{APP}.camera.yaw")
        page.keyboard.press("Shift+ArrowRight")
        assert page.evaluate(f"{APP}.camera.yaw") > yaw
        box = page.locator("canvas").first.bounding_box()
        page.mouse.move(box["x"] + 20, box["y"] + 20)
        page.mouse.down()
        page.mouse.move(box["x"] - 60, box["y"] + 40)
        page.mouse.up()
        assert page.evaluate(f"{APP}.camera.yaw") < yaw
        page.keyboard.press("f")
        assert page.evaluate(f"{APP}.camera.yaw") == yaw
        assert troubles == []


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1024, 640), (480, 800)])
def test_no_text_is_clipped_and_nothing_overlaps(address: str, width: int, height: int) -> None:
    with opened(viewport={"width": width, "height": height}) as (page, _):
        page.goto(address)
        page.wait_for_function(LOOKED)
        clipped = page.evaluate(
            "[...document.querySelectorAll('.slalom :is(button, h2, .entry, .field, .why, .clock, .title)')]"
            ".filter((e) => e.offsetParent && e.scrollWidth > e.clientWidth + 1).map((e) => e.textContent)"
        )
        assert clipped == []
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        boxes = page.evaluate(
            "[...document.querySelectorAll('.slalom header > *, .slalom .transport > *, .slalom .panel,"
            ".slalom .charts .frame')].filter((e) => e.offsetParent).map((e) => {"
            "const r = e.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom, e.textContent]; })"
        )
        for k, (left, top, right, bottom, words) in enumerate(boxes):
            for other in boxes[k + 1 :]:
                overlap = min(right, other[2]) - max(left, other[0]), min(bottom, other[3]) - max(top, other[1])
                assert min(overlap) < 1.0, (words, other[4])


def test_a_live_widget_is_driven_by_the_kernel() -> None:
    """A page with the model of anywidget, whose messages go to a widget in this process."""
    pytest.importorskip("anywidget", reason="slalom[notebook] is not installed: widgets are not made")
    from slalom.live.notebook import widget

    made = widget(crossing(), method("nao"), live=True)
    sent: list[tuple[Any, list[str]]] = []
    made.send = lambda content, buffers: sent.append((content, [base64.b64encode(b).decode() for b in buffers]))

    def kernel(_source: Any, command: Any) -> list[Any]:
        sent.clear()
        made._handle_custom_msg(command, [])
        return [*sent]

    with opened() as (page, troubles):
        page.expose_binding("kernel", kernel)
        page.set_content("<div id='slalom'></div>")
        page.evaluate(
            """async (source) => {
            const url = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
            const { default: widget } = await import(url);
            const bytes = (text) => new DataView(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
            let taken = () => {};
            const model = {
              get: (name) => name === "live",
              on: (_, callback) => { taken = callback; },
              send: async (command) => {
                for (const [content, buffers] of await window.kernel(command)) taken(content, buffers.map(bytes));
              },
            };
            widget.render({ model, el: document.getElementById("slalom") });
        }""",
            renderer(),
        )
        page.wait_for_function(LOOKED)
        page.evaluate(f"{APP}.select(0); {APP}.send({{do: 'drag', what: 'robot', index: 0, to: [1, 1], step: 3}})")
        page.wait_for_function(f"{APP}.model.scene.undo === 1 && {APP}.model.complete")
        np.testing.assert_allclose(page.evaluate(f"[{APP}.seek(0), {APP}.model.robot(0)][1]"), (1.0, 1.0), atol=1e-3)
        assert troubles == []


def test_a_fleet_moves_while_it_is_made() -> None:
    """Pictures of 200 robots while they are simulated; the rate is printed."""
    settings = ("--set", "robots=200", "--set", "radius=150", "--set", "duration=20")
    with serving("circle", *settings) as address, opened() as (page, troubles):
        page.goto(address)
        page.wait_for_function(f"{APP}?.model.count > 3 && {APP}.model.control()", timeout=90_000)
        page.evaluate(f"{APP}.drawings.length = 0; {APP}.play(true)")
        page.wait_for_timeout(3000)
        drawn, step = page.evaluate(f"[{APP}.drawings.length, {APP}.model.step]")
        print(f"200 robots: {drawn / 3.0:.0f} pictures a second, {step} steps in 3 s")
        assert step > 1
        page.evaluate(f"{APP}.play(false); {APP}.select(70)")
        page.wait_for_function(f"{APP}.model.control()?.robot === 70")
        others = page.evaluate(f"{APP}.model.control().others.map(([kind, k]) => k)")
        assert {69, 71} <= set(others)
        for colouring in ("outcome", "speed", "time"):
            page.locator("select[aria-label^=colour]").select_option(colouring)
            page.wait_for_timeout(100)
        assert troubles == []
