"""The page of the documentation on which control obstacles are dragged: its areas against those of the library."""

import importlib.util
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from live_views import APP, in_browser, opened

import slalom
from slalom.forecast.forecast import AtConstantAcceleration, AtConstantVelocity, Known

PAGE = Path(__file__).parents[2] / "docs/_static/explorer.html"
IDEAS = {"vo": ["VO"], "curved_road": ["VO", "NLVO"], "ao": ["VO", "AO"], "roundabout": ["AO", "NAO"]}
SPEED, ACCELERATION = 6.0, 3.0  # [m/s, m/s^2] limits of the drawn scenes
RULES: dict[str, Any] = {"VO": AtConstantVelocity(), "AO": AtConstantAcceleration()}
THREE = "&obstacles=o1,6,3,0,-1.2,0,0_o1,8,-3,-0.5,0.6,0,0_o0.8,10,1,-1,0,0,0"


def drawn(rng: np.random.Generator) -> dict[str, Any]:
    """A scene: one to three discs that accelerate, turn, or exist for a time, any response, and a method."""
    bodies = []
    for _ in range(rng.integers(1, 4)):
        direction = rng.uniform(0.0, 2.0 * np.pi)
        turns, late = rng.random() < 0.4, rng.random() < 0.2
        bodies.append(
            {
                "radius": rng.uniform(0.3, 1.8),
                "position": (rng.uniform(3.3, 14.0) * np.array([np.cos(direction), np.sin(direction)])).tolist(),
                "velocity": rng.uniform(-4.0, 4.0, 2).tolist(),
                "acceleration": [0.0, 0.0] if turns else rng.uniform(-0.6, 0.6, 2).tolist(),
                "rate": rng.uniform(0.1, 0.8) * rng.choice([-1.0, 1.0]) if turns else 0.0,
                "from": 1.5 if late and not turns else 0.0,
                "to": rng.uniform(2.0, 6.0) if late and not turns else 1e9,
            }
        )
    return {
        "robot": {"radius": rng.uniform(0.2, 1.0), "position": [0, 0], "velocity": rng.uniform(-4.0, 4.0, 2).tolist()},
        "bodies": bodies,
        "horizon": rng.uniform(2.0, 10.0),
        "margin": float(rng.choice([0.0, 0.2])),
        "hold": [None, 1.0, 2.5][rng.integers(3)],
        "ramp": float(rng.choice([0.0, 0.5])),
        "maxSpeed": SPEED,
        "maxAcceleration": ACCELERATION,
        "method": str(rng.choice(["VO", "NLVO", "AO", "NAO"])),
    }


def trajectory(body: dict[str, Any]) -> Any:
    """The trajectory of a disc of a scene."""
    place, velocity, acceleration = (np.array(body[key]) for key in ("position", "velocity", "acceleration"))
    begin, end = body["from"], body["to"]
    if body["rate"]:
        speed, sense = np.hypot(*velocity), np.sign(body["rate"])
        center = place + sense * np.array([-velocity[1], velocity[0]]) / abs(body["rate"])
        return slalom.Circular(center, speed / abs(body["rate"]), sense * speed, np.arctan2(*(place - center)[::-1]))
    if end < 1e9:
        there = place + begin * velocity + 0.5 * begin**2 * acceleration
        pieces = [[there, velocity + begin * acceleration, 0.5 * acceleration]]
        return slalom.PiecewisePolynomial([end - begin], pieces, begin)
    return slalom.ConstantAcceleration(place, velocity, acceleration)


def blocked(scene: dict[str, Any]) -> tuple[slalom.ControlObstacle, slalom.Response]:
    """The control obstacle of a scene by the library."""
    rule = RULES.get(scene["method"], Known())
    obstacles = []
    for body in scene["bodies"]:
        if rule.includes_future or body["from"] == 0.0:
            path = trajectory(body if rule.includes_future else {**body, "to": 1e9})
            obstacles.append(slalom.Obstacle(slalom.Disc(body["radius"]), rule(path, 0.0), after_end="leaves"))
    hold = scene["hold"]
    response: slalom.Response = slalom.Velocity(scene["ramp"])
    if "A" in scene["method"]:
        response = slalom.Acceleration() if hold is None else slalom.AccelerateThenCoast(hold)
    me = slalom.State((0.0, 0.0), scene["robot"]["velocity"])
    robot = slalom.Disc(scene["robot"]["radius"])
    found = slalom.control_obstacle(response, me, obstacles, robot, horizon=scene["horizon"], margin=scene["margin"])
    return found, response


@pytest.fixture(scope="module")
def page() -> Iterator[Any]:
    """The page, opened from its file; it makes no request, and its console has no error."""
    with opened(viewport={"width": 1280, "height": 800}) as (shown, troubles):
        requests: list[str] = []
        shown.on("request", lambda request: requests.append(request.url))
        shown.goto(PAGE.as_uri())
        shown.wait_for_function(f"{APP}?.drawings.length > 0")
        yield shown
        assert {url.partition("#")[0] for url in requests if not url.startswith("data:")} == {PAGE.as_uri()}
        assert troubles == []


def show(page: Any, address: str) -> None:
    """Open the scene of an address, and wait until it is drawn."""
    page.evaluate(f"{APP}.drawings.length = 0")
    page.goto(f"{PAGE.as_uri()}#{address}")
    page.wait_for_function(f"{APP}.scene.idea === '{address.partition('&')[0]}' && {APP}.drawings.length > 0")


def test_the_page_is_one_small_file() -> None:
    text = PAGE.read_text()
    print(f"{len(text.encode()) / 1e3:.0f} kB")
    assert len(text.encode()) < 300_000
    assert "default-src 'none'" in text
    assert not re.search(r"""(src|href)=["']?https?:""", text)


@in_browser
def test_areas_are_those_of_the_library(page: Any) -> None:
    """Of 50 drawn scenes, with admissible sets and first contacts, by the functions that the page draws with."""
    rng = np.random.default_rng(53)
    worst = 0.0
    for _ in range(50):
        scene = drawn(rng)
        obstacle, response = blocked(scene)
        size = 1.25 * (SPEED if "V" in scene["method"] else ACCELERATION)
        controls = rng.uniform(-size, size, (40, 2))
        found = page.evaluate(f"([scene, u, size]) => {APP}.measure(scene, u, size)", [scene, controls.tolist(), size])
        region = obstacle.boundary((0.0, 0.0), size).region
        off = abs(found["area"] - region.area) / max(region.area, 1e-3 * np.pi * size**2)
        worst = max(worst, off)
        assert off < 0.01, scene
        limits = slalom.Limits(SPEED, ACCELERATION).admissible(response, obstacle.state, scene["horizon"])
        np.testing.assert_allclose([ball["radius"] for ball in found["balls"]], limits.radii)
        np.testing.assert_allclose([ball["center"] for ball in found["balls"]], limits.centers, atol=1e-12)
        within = shapely.intersection_all(
            [shapely.Point(*c).buffer(r, quad_segs=256) for c, r in zip(limits.centers, limits.radii)]
        )
        if within.area and max(np.hypot(*np.array(limits.centers).T) + limits.radii) < 20.0:
            whole = obstacle.boundary((0.0, 0.0), 20.0).region
            assert abs(found["share"] - shapely.intersection(whole, within).area / within.area) < 0.01
        times = np.array([np.inf if t is None else t for t in found["times"]])
        np.testing.assert_allclose(times, obstacle.time_to_collision(controls), atol=5e-3)
    print(f"largest difference of areas: {100 * worst:.2f} %")


@in_browser
@pytest.mark.parametrize("idea", IDEAS)
def test_every_idea_has_a_scene_that_its_address_holds(page: Any, idea: str) -> None:
    show(page, idea)
    assert page.evaluate(f"{APP}.scene.methods") == IDEAS[idea]
    assert page.locator(f"section#{idea}").is_visible()
    text = page.locator(".why").inner_text()
    assert len(text.split("\n")) == len(IDEAS[idea])
    assert "collides with" in text
    page.evaluate(
        f"(() => {{ const s = {APP}.scene; s.robot.position = [1.5, 0.25]; s.horizon = 5; s.hold = 1.5;"
        "s.controls.acceleration = [0.5, -0.25]; s.methods = ['NAO', 'NLVO'];"
        f"Object.assign(s.obstacles[0], {{ radius: 1.25, from: 0.5, to: 2.5 }}); {APP}.changed(); }})()"
    )
    page.wait_for_function("location.hash.includes('horizon=5')")
    address, scene = page.evaluate(f"[location.hash, {APP}.scene]")
    show(page, next(other for other in IDEAS if other != idea))
    show(page, address[1:])
    again = page.evaluate(f"{APP}.scene")
    assert again == scene


COLOURED = """(controls) => {
  const app = document.getElementById('slalom').slalom;
  const shown = app.picture();
  return shown.found.map((found, slot) => {
    const view = app.controlView(slot), canvas = app.controls[slot].canvas, g = canvas.getContext('2d');
    const first = (u) => Math.min(...found.motions.map((motion) => motion?.contact(u) ?? Infinity));
    const near = [-3, 0, 3].flatMap((x) => [-3, 0, 3].map((y) => [x / view.scale, y / view.scale]));
    return controls.map(([x, y]) => {
      const u = [x * view.width / 2 / view.scale, y * view.width / 2 / view.scale];
      const pixel = [...g.getImageData(Math.round(view.px(u[0])), Math.round(view.py(u[1])), 1, 1).data];
      return [near.map(([dx, dy]) => first([u[0] + dx, u[1] + dy]) < Infinity), Math.min(...pixel) < 240];
    });
  });
}"""


@in_browser
@pytest.mark.parametrize("idea", IDEAS)
def test_what_collides_is_coloured(page: Any, idea: str) -> None:
    """At controls that are 3 pixels or more from a border, of an obstacle or of what is drawn over it."""
    show(page, idea)
    controls = np.random.default_rng(7).uniform(-0.98, 0.98, (500, 2))
    before = page.evaluate(COLOURED, controls.tolist())
    assert len(before) == len(IDEAS[idea])
    for panel in before:
        collides = np.array([near for near, _ in panel])
        clear = (collides == collides[:, :1]).all(axis=1)
        differs = clear & (collides[:, 0] != np.array([coloured for _, coloured in panel]))
        # Marks and the line of the admissible set cover a few percent of the picture.
        assert collides[clear, 0].sum() > 15
        assert (~collides[clear, 0]).sum() > 50
        assert differs.sum() <= 0.03 * clear.sum()


@in_browser
def test_a_wrong_address_is_refused_with_a_reason(page: Any) -> None:
    refused = {
        "vo&robot=1,2": r"robot: expected 5 numbers, found 1,2",
        "vo&horizon=-1": r"horizon: expected a number above 0, found -1",
        "vo&speed=3": r"expected methods, robot, .*, found speed",
        "walls": r"expected one of vo, curved_road, ao, roundabout, found walls",
        "ao&obstacles=r1,2,3,4": r"expected none on a road, as ao has none",
        "vo&methods=HRVO": r"methods: expected one or two of VO, NLVO, AO, NAO, found HRVO",
    }
    for address, reason in refused.items():
        page.goto(f"{PAGE.as_uri()}#{address}")
        page.wait_for_function("document.querySelector('.note').textContent.length > 0")
        assert re.search(reason, page.locator(".note").inner_text())
        show(page, "vo")
        assert page.locator(".note").inner_text() == ""


@in_browser
@pytest.mark.parametrize("idea", ["vo", "curved_road", "ao"])
def test_a_drag_bends_the_obstacle_within_a_picture(page: Any, idea: str) -> None:
    """Three obstacles, robot dragged: the script of a picture takes at most 16 ms at the median."""
    show(page, idea + ("" if idea == "curved_road" else THREE))
    assert page.evaluate(f"{APP}.scene.obstacles.length") == 3
    x, y = page.evaluate(
        f"(() => {{ const a = {APP}, r = a.workspace.canvas.getBoundingClientRect(), p = a.scene.robot.position;"
        "return [r.x + a.view.px(p[0]), r.y + a.view.py(p[1])]; })()"
    )
    page.evaluate(f"{APP}.drawings.length = 0")
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(120):
        page.mouse.move(x + 0.5 * k, y + 15.0 * np.sin(0.1 * k))
        page.wait_for_timeout(8)
    page.mouse.up()
    spent = np.array(page.evaluate(f"{APP}.drawings"))
    print(f"{idea}: {len(spent)} pictures, median {np.median(spent):.1f} ms, 90 % {np.percentile(spent, 90):.1f} ms")
    assert len(spent) > 20
    assert np.median(spent) <= 16.0
    assert page.evaluate(f"{APP}.scene.robot.position[0]") > 0.5


@in_browser
def test_handles_and_keys_change_the_scene(page: Any) -> None:
    show(page, "curved_road")
    page.locator("canvas[data-panel=workspace]").focus()
    shares = page.locator(".why").inner_text()
    for _ in range(20):
        page.keyboard.press("h")
        if page.evaluate(f"{APP}.grasp.held.what") == "road":
            break
    before = page.evaluate(f"{APP}.scene.road.curvature")
    page.keyboard.press("Shift+ArrowDown")
    assert page.evaluate(f"{APP}.scene.road.curvature") < before
    page.wait_for_function(f"{json.dumps(shares)} !== document.querySelector('.why').innerText")
    page.evaluate(f"{APP}.scene.road.curvature = 0; {APP}.changed()")
    page.wait_for_function("new Set(document.querySelector('.why').innerText.match(/[0-9.]+ %/g)).size === 1")
    page.keyboard.press("a")
    assert page.evaluate(f"{APP}.scene.obstacles.length") == 4
    page.keyboard.press("x")
    assert page.evaluate(f"{APP}.scene.obstacles.length") == 3
    page.locator("input[data-name=horizon]").fill("0")
    page.keyboard.press("Enter")
    assert "expected a number from 1 to 20" in page.locator(".note").inner_text()
    assert page.evaluate(f"{APP}.scene.horizon") == 3
    page.locator("[data-name=reset]").click()
    assert page.evaluate(f"{APP}.scene.road.curvature") == before


@in_browser
@pytest.mark.parametrize("width", [1280, 740, 390])
def test_nothing_is_clipped(page: Any, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 800})
    for idea in IDEAS:
        show(page, idea)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        clipped = page.evaluate(
            "[...document.querySelectorAll('.slalom :is(button, .entry, .field, .why, a, p)')]"
            ".filter((e) => e.offsetParent && e.scrollWidth > e.clientWidth + 1).map((e) => e.textContent)"
        )
        assert clipped == []
    page.set_viewport_size({"width": 1280, "height": 800})


def test_the_page_opens_in_firefox() -> None:
    if importlib.util.find_spec("selenium") is None or shutil.which("firefox") is None:
        pytest.skip("Firefox or Selenium is not installed: the page is opened in Chromium only")
    from selenium import webdriver
    from selenium.webdriver.firefox.options import Options

    options = Options()
    options.add_argument("-headless")
    driver = webdriver.Firefox(options=options)
    try:
        for idea, methods in IDEAS.items():
            driver.get(f"{PAGE.as_uri()}#{idea}")
            driver.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
            assert driver.execute_script(f"return {APP}.scene.methods") == methods
            assert driver.execute_script(f"return {APP}.drawings.length") > 0
    finally:
        driver.quit()
