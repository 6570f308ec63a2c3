"""Tools of the view's page: what the pointer is on, names, charts, events, ruler, following, pictures and lectures."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from live_views import APP, in_browser, opened, serving

from slalom import method
from slalom.sim import metrics, read_scenario, simulate

pytestmark = [pytest.mark.slow, pytest.mark.browser, in_browser]
SHOWN = f"{APP}?.model.complete && {APP}.model.control()"
BLOCKED = """
name: blocked
duration: 12
horizon: 5
robot: {position: [0, 0], radius: 0.4, max_speed: 2, max_acceleration: 2, goal: {position: [12, 0]}}
obstacles:
  - {name: post, radius: 0.8, trajectory: {kind: stationary, position: [5, 0.3]}}
  - {name: cart, radius: 0.5, trajectory: {kind: constant_velocity, position: [9, -6], velocity: [0, 1.1]}}
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("tools") / "blocked.yaml"
    path.write_text(BLOCKED)
    return str(path)


@pytest.fixture(scope="module")
def address(file: str) -> Iterator[str]:
    with serving(file) as found:
        yield found


def show(page: Any, address: str) -> None:
    page.goto(address)
    page.wait_for_function(SHOWN)
    page.wait_for_timeout(300)


def pixel(page: Any, x: float, y: float) -> tuple[float, float]:
    """Where a point of the workspace is on the page."""
    return tuple(
        page.evaluate(
            f"(() => {{ const a = {APP}, r = a.parts.workspace.canvas.getBoundingClientRect();"
            f"return [r.x + a.view.px({x}), r.y + a.view.py({y})]; }})()"
        )
    )


def stroke(page: Any, *points: tuple[float, float]) -> None:
    """Draw through points of the workspace."""
    for k, at in enumerate(points):
        page.mouse.move(*pixel(page, *at), steps=1 if k == 0 else 6)
        if k == 0:
            page.mouse.down()
    page.mouse.up()


def hover(page: Any) -> str:
    return page.evaluate(f"{APP}.parts.hover.textContent")


def test_the_pointer_shows_values_and_the_control_obstacle_of_its_body(address: str) -> None:
    with opened() as (page, troubles):
        show(page, address)
        page.evaluate(f"{APP}.seek(20)")
        page.wait_for_function(f"{APP}.model.has(20) && {APP}.model.control().arrays.rings0")
        page.mouse.move(*pixel(page, 5, 0.3))
        page.wait_for_function(f"{APP}.parts.hover.textContent.startsWith('post: 0.0 m/s')")
        assert "hit by the preferred control" in hover(page)
        assert page.evaluate(f"{APP}.model.focus") == [{"kind": "obstacle", "index": 0}]
        # In the control space: the owners of a control are the obstacles that it hits.
        control = page.evaluate(
            "(({others, arrays: {rings0, ends0, owners0}}) => ({others, rings: [...rings0.values],"
            f"ends: [...ends0.values], owners: [...owners0.values]}}))({APP}.model.control())"
        )
        rings = np.split(np.reshape(control["rings"], (-1, 2)), control["ends"][:-1])
        half = page.evaluate(f"{APP}.model.control().planes[0].half")
        found = set()
        for at in np.random.default_rng(2).uniform(-0.95 * half, 0.95 * half, (40, 2)):
            inside = {
                control["others"][owner][1]
                for owner, ring in zip(control["owners"], rings)
                if shapely.Polygon(ring).contains(shapely.Point(at))
            }
            x, y = page.evaluate(
                f"(() => {{ const a = {APP}, v = a.controlViewport(0), "
                "r = a.parts.controls[0].canvas.getBoundingClientRect();"
                f"return [r.x + v.px({at[0]}), r.y + v.py({at[1]})]; }})()"
            )
            page.mouse.move(x, y)
            focus = page.evaluate(f"{APP}.model.focus.map(({{index}}) => index)")
            assert set(focus) == inside
            assert hover(page).startswith("acceleration (")
            assert ("control obstacle of" in hover(page)) == bool(inside)
            found.add(frozenset(inside))
        assert len(found) > 1
        page.mouse.move(3, 3)
        assert (hover(page), page.evaluate(f"{APP}.model.focus")) == ("", [])
        assert troubles == []


def marked(page: Any, x: float, y: float, radius: float) -> bool:
    """Whether the pixels of a square about a point of the workspace hold the colour of names."""
    return page.evaluate(
        f"(() => {{ const a = {APP}, r = devicePixelRatio, s = Math.ceil({radius} * a.view.scale) * r;"
        f"const g = a.parts.workspace.canvas.getContext('2d');"
        f"const d = g.getImageData(a.view.px({x}) * r - s, a.view.py({y}) * r - s, 2 * s, 2 * s).data;"
        "for (let k = 0; k < d.length; k += 4) if (d[k] === 179 && d[k + 1] === 48 && d[k + 2] === 138) return true;"
        "return false; })()"
    )


def test_bodies_that_the_sentence_names_are_marked(address: str) -> None:
    with opened() as (page, troubles):
        show(page, address)
        assert "would hit post in " in page.evaluate(f"{APP}.parts.why.textContent")
        assert page.locator(".why b").all_text_contents()[0] == "post"
        assert marked(page, 5, 0.3, 1.2)
        cart = page.evaluate(f"{APP}.model.obstacle(1)")
        assert not marked(page, *cart, 0.6)
        page.locator(".why b").first.hover()
        assert page.evaluate(f"{APP}.model.focus") == [{"kind": "obstacle", "index": 0}]
        assert "focus" in page.locator(".why b").first.get_attribute("class")
        assert troubles == []


def test_charts_show_any_metric_with_its_axes(address: str, file: str) -> None:
    run = simulate(read_scenario(file), method("nao"))
    values = (
        """(k) => {
      const app = """
        + APP
        + """, told = [], own = CanvasRenderingContext2D.prototype.fillText;
      CanvasRenderingContext2D.prototype.fillText = function (words, ...more) {
        if (this.canvas === app.parts.charts[0].canvas) told.push(words);
        return own.call(this, words, ...more);
      };
      app.seek(k);
      app.draw();
      CanvasRenderingContext2D.prototype.fillText = own;
      return told;
    }"""
    )
    last = len(run.times) - 1
    expected = {
        "speed": np.linalg.norm(run.velocities[:, 0], axis=1)[20],
        "path length": np.linalg.norm(np.diff(run.positions[:21, 0], axis=0), axis=1).sum(),
        "distance to the goal": np.linalg.norm(run.positions[20, 0] - (12, 0)),
        "jerk": np.linalg.norm(run.accelerations[20, 0] - run.accelerations[19, 0]) / run.dt,
    }
    with opened() as (page, troubles):
        show(page, address)
        chart = page.locator("select[aria-label='metric of chart 1']")
        for name, value in expected.items():
            chart.select_option(name)
            told = page.evaluate(values, 20)
            shown = next(words for words in told if words.split(" ")[-1] in ("m/s", "m", "m/s³"))
            assert float(shown.split(" ")[0]) == pytest.approx(value, abs=0.06), name
            # The axes: round numbers of the metric, and times up to the end of the run.
            plain = [float(words) for words in told if words.replace(".", "").isdigit()]
            assert len(plain) >= 4
            assert any(words.endswith(" s") and abs(float(words[:-2]) - run.times[-1]) < 3 for words in told)
        for name in page.evaluate(f"[...{APP}.parts.charts[0].list.options].map((o) => o.value)"):
            chart.select_option(name)
            page.wait_for_timeout(50)
        chart.select_option("speed")
        box = page.locator("canvas.chart").first.bounding_box()
        page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 60)
        page.wait_for_function(f"{APP}.parts.hover.textContent.startsWith('speed ')")
        page.mouse.click(box["x"] + box["width"] - 12, box["y"] + 60)
        assert abs(page.evaluate(f"{APP}.model.step") - last) <= 1
        assert metrics.max_speed(run) > 0
        assert troubles == []


def test_the_time_line_shows_events(tmp_path: Path) -> None:
    scene = tmp_path / "hit.yaml"
    scene.write_text(
        "name: hit\nduration: 4\n"
        "robot: {position: [0, 0], radius: 0.4, max_speed: 1, max_acceleration: 1, goal: {position: [9, 0]}}\n"
        "obstacles:\n  - {name: truck, radius: 1,"
        " trajectory: {kind: constant_velocity, position: [6, 0], velocity: [-6, 0]}}\n"
    )
    run = simulate(read_scenario(scene), method("nao"))
    with serving(str(scene)) as address, opened() as (page, troubles):
        show(page, address)
        box = page.locator("canvas.events").bounding_box()
        told: dict[float, str] = {}
        for x in np.arange(box["x"] + 6, box["x"] + box["width"] - 6, 2.0):
            page.mouse.move(x, box["y"] + 5)
            for words in (page.locator("canvas.events").get_attribute("title") or "").splitlines():
                time, _, what = words.partition(" s: ")
                told.setdefault(float(time), what)
                if what == "collision with truck":
                    hit = x, float(time)
        starts = [t for t, name in zip(run.times, run.outcomes) if name[0] not in ("", "KEPT", "CONTINUED")]
        assert sum(what.startswith("decision") for what in told.values()) >= 0.8 * len(starts)
        page.mouse.click(hit[0], box["y"] + 5)
        assert page.evaluate(f"{APP}.model.time") == pytest.approx(hit[1], abs=0.06)
        assert troubles == []


def test_the_ruler_measures_between_points_and_bodies(address: str) -> None:
    with opened() as (page, troubles):
        show(page, address)
        page.keyboard.press("l")
        stroke(page, (1, 3), (4, -1))
        told = page.evaluate(f"{APP}.tools.ruled")
        np.testing.assert_allclose(told, [(1, 3), (4, -1)], atol=0.05)
        stroke(page, (0, 0), (5, 0.3))
        assert page.evaluate(f"{APP}.tools.ruled") == [{"kind": "robot", "index": 0}, {"kind": "obstacle", "index": 0}]
        words = (
            """(step) => {
          const app = """
            + APP
            + """, told = [], own = CanvasRenderingContext2D.prototype.fillText;
          CanvasRenderingContext2D.prototype.fillText = (words) => told.push(words);
          app.seek(step); app.draw();
          CanvasRenderingContext2D.prototype.fillText = own;
          return [told.find((one) => one.includes('between surfaces')), app.model.robot(0)];
        }"""
        )
        for step in (0, 15):
            said, at = page.evaluate(words, step)
            away = np.hypot(5 - at[0], 0.3 - at[1])
            assert said.startswith(f"{away:.2f} m") or abs(float(said.split(" ")[0]) - away) < 0.011
            between = float(said.split("surfaces ")[1].removesuffix(" m").replace("−", "-"))
            assert between == pytest.approx(away - 1.2, abs=0.011)
        assert page.evaluate(f"{APP}.model.scene.undo") == 0
        page.keyboard.press("Escape")
        assert page.evaluate(f"[{APP}.tools.chosen, {APP}.tools.ruled]") == [None, None]
        assert troubles == []


def test_the_view_follows_the_robot(address: str) -> None:
    with opened() as (page, troubles):
        show(page, address)
        scale = page.evaluate(f"{APP}.view.scale")
        page.keyboard.press("o")
        for step in (0, 25):
            page.evaluate(f"{APP}.seek({step})")
            page.wait_for_timeout(100)
            view, at = page.evaluate(f"[[{APP}.view.x, {APP}.view.y], {APP}.model.robot(0)]")
            np.testing.assert_allclose(view, at, atol=1e-6)
        assert page.evaluate(f"{APP}.view.scale") == scale
        stroke(page, (page.evaluate(f"{APP}.view.x") - 1, 2.0), (page.evaluate(f"{APP}.view.x"), 2.5))
        assert page.locator("[data-name=follow]").get_attribute("aria-pressed") == "false"
        assert troubles == []


def test_the_picture_is_saved_as_it_is_shown(address: str, tmp_path: Path) -> None:
    with opened(accept_downloads=True) as (page, troubles):
        show(page, address)
        with page.expect_download() as saved:
            page.keyboard.press("s")
        assert saved.value.suggested_filename == "blocked 0.0 s.png"
        saved.value.save_as(tmp_path / "picture.png")
        data = (tmp_path / "picture.png").read_bytes()
        assert data[:8] == b"\x89PNG\r\n\x1a\n"
        width, height = struct.unpack(">II", data[16:24])
        assert (width, height > 1000) == (2 * page.evaluate("innerWidth"), True)
        from PIL import Image

        picture = np.asarray(Image.open(tmp_path / "picture.png").convert("RGB"))
        # The robot, the words of the sentence, and the colours of the control space are in it.
        assert (np.abs(picture.astype(int) - (213, 94, 0)).max(axis=2) < 3).sum() > 500
        assert (np.abs(picture.astype(int) - (179, 48, 138)).max(axis=2) < 3).sum() > 50
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 1000
        assert troubles == []


def test_a_lecture_hides_the_choice_until_it_is_asked_for(address: str) -> None:
    robot = f"""(() => {{ const a = {APP}, c = a.model.control(), v = a.controlViewport(0), r = devicePixelRatio;
      const g = a.parts.controls[0].canvas.getContext('2d');
      return [...g.getImageData(v.px(c.chosen[0]) * r, v.py(c.chosen[1]) * r, 1, 1).data].slice(0, 3); }})()"""
    with opened() as (page, troubles):
        show(page, address)
        told = page.evaluate(f"{APP}.parts.why.textContent")
        assert page.evaluate(robot) == [213, 94, 0]
        page.keyboard.press("e")
        page.wait_for_timeout(400)
        assert page.evaluate(robot) != [213, 94, 0]
        assert page.locator(".why").text_content() == "Which control does the robot choose? "
        assert float(page.locator(".why").evaluate("(e) => parseFloat(getComputedStyle(e).fontSize)")) >= 22
        assert page.locator("select[aria-label=method]").is_hidden()
        assert "clipped" not in page.evaluate(
            "[...document.querySelectorAll('.slalom :is(button, .entry, .why)')].filter((e) => e.offsetParent"
            " && e.scrollWidth > e.clientWidth + 1).map(() => 'clipped')"
        )
        page.keyboard.press("v")
        page.wait_for_timeout(200)
        assert page.locator(".why").text_content() == told
        assert page.evaluate(robot) == [213, 94, 0]
        # The next decision is hidden again.
        page.keyboard.press("ArrowRight")
        page.wait_for_timeout(200)
        assert page.locator(".why").text_content() == "Which control does the robot choose? "
        page.locator("[data-name=reveal]").click()
        page.wait_for_timeout(200)
        assert "Which control" not in page.locator(".why").text_content()
        page.keyboard.press("e")
        page.wait_for_timeout(200)
        assert page.locator("[data-name=reveal]").is_hidden()
        assert troubles == []
