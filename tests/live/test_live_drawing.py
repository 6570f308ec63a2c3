"""A scene that is drawn in the view, from an empty page to a run of its file."""

from pathlib import Path

import numpy as np
import pytest
from live_views import APP, in_browser, opened, serving
from test_live_tools import pixel, stroke

from slalom import method
from slalom.sim import read_scenario, simulate

pytestmark = [pytest.mark.slow, pytest.mark.browser, in_browser]
SHOWN = f"{APP}?.model.complete && {APP}.model.control()"


def test_a_scene_is_drawn_and_its_file_runs(tmp_path: Path) -> None:
    with serving("roundabout_crossing") as address, opened(accept_downloads=True) as (page, troubles):
        page.goto(address)
        page.wait_for_function(SHOWN)
        page.locator("[data-name=draw]").click()
        page.locator("[data-name=empty]").click()
        page.wait_for_function(f"{APP}.model.scene.title === 'drawing' && {APP}.model.complete")
        page.wait_for_timeout(300)
        assert page.evaluate(f"{APP}.model.scene.obstacles.length") == 0
        # A stroke of some pixels would be a click.
        page.mouse.move(*pixel(page, 5, -0.5))
        page.mouse.wheel(0, -500)
        page.wait_for_function(f"{APP}.view.scale > 12")

        def draw(tool: str, *points: tuple[float, float], changes: int) -> None:
            page.locator(f"[data-name={tool}]").click()
            stroke(page, *points)
            page.wait_for_function(f"{APP}.model.scene.undo === {changes} && {APP}.model.complete")
            page.locator(f"[data-name={tool}]").click()

        draw("wall", (2, 2), (8, 2.5), changes=2)
        draw("obstacle", (5, -1.5), (5, -0.9), changes=3)
        page.locator("[data-field=pace] input").fill("0.8")
        draw("path", (5, -1.5), (6, -1.5), (6, 1.0), changes=4)
        page.locator("[data-field=size] input").fill("0.3")
        draw("robot", (9, -1), (1, -1), changes=5)
        # A goal is dragged, and a click draws an obstacle of the radius of the field, which is removed again.
        goal = page.evaluate(f"{APP}.model.goal(0)")
        stroke(page, tuple(goal), (9.0, 1.0))
        page.wait_for_function(f"{APP}.model.scene.undo === 6 && {APP}.model.complete")
        draw("obstacle", (3, -2.4), changes=7)
        assert page.evaluate(f"{APP}.model.scene.obstacles[2].radius") == pytest.approx(0.3)
        page.mouse.click(*pixel(page, 3, -2.4))
        page.locator("[data-name=remove]").click()
        page.wait_for_function(f"{APP}.model.scene.undo === 8 && {APP}.model.complete")
        with page.expect_download() as saved:
            page.locator("[data-name=save]").click()
        assert saved.value.suggested_filename == "drawing.yaml"
        saved.value.save_as(tmp_path / "drawing.yaml")
        shown = [
            page.evaluate(f"[{APP}.seek({k}), {APP}.model.robot(0), {APP}.model.robot(1)]") for k in (0, 20, 10**6)
        ]
        assert troubles == []
    made = read_scenario(tmp_path / "drawing.yaml")
    wall, post = made.obstacles
    np.testing.assert_allclose(wall.shape.parts[0].corners, [(2, 2), (8, 2.5)], atol=0.05)
    assert post.shape.bounding_radius == pytest.approx(0.6, abs=0.05)
    np.testing.assert_allclose(post.trajectory.position(np.array([0.0, 100.0])), [(5, -1.5), (6, 1.0)], atol=0.1)
    assert np.linalg.norm(post.trajectory.velocity(0.5)) == pytest.approx(0.8, abs=1e-6)
    assert [robot.shape.bounding_radius for robot in made.robots] == [0.5, 0.3]
    np.testing.assert_allclose(made.robots[0].goal.position(0.0), (9, 1), atol=0.05)
    run = simulate(made, method("nao"))
    for step, (_, *places) in zip((0, 20, -1), shown):
        np.testing.assert_allclose(places, run.positions[step], atol=2e-3)


def test_a_path_begins_on_an_obstacle_and_a_click_draws_no_wall() -> None:
    with serving("empty") as address, opened() as (page, troubles):
        page.goto(address)
        page.wait_for_function(SHOWN)
        page.locator("[data-name=draw]").click()
        page.locator("[data-name=path]").click()
        stroke(page, (3, 1), (4, 2))
        assert page.evaluate(f"{APP}.parts.note.textContent") == "Begin the path on an obstacle."
        page.locator("[data-name=wall]").click()
        page.mouse.click(*pixel(page, 3, 1))
        assert page.evaluate(f"{APP}.parts.note.textContent").startswith("Draw a wall: drag along it")
        assert page.evaluate(f"{APP}.model.scene.undo") == 0
        # What cannot be drawn is refused by a sentence, and the scene stays.
        page.locator("[data-name=wall]").click()
        page.locator("[data-field=size] input").fill("-1")
        page.locator("[data-name=add]").click()
        page.wait_for_function(f"{APP}.parts.note.textContent.includes('radius: expected')")
        assert page.evaluate(f"[{APP}.model.scene.undo, {APP}.model.scene.obstacles.length]") == [0, 0]
        assert troubles == []
