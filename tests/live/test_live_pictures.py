"""What the page of the view shows: the decision that was made, where things are, and how the run ended."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_views import APP, in_browser, opened, serving

from slalom import method
from slalom.live.messages import unpack
from slalom.live.session import Session
from slalom.sim import read_scenario

pytestmark = [pytest.mark.slow, pytest.mark.browser, in_browser]
SHOWN = f"{APP}?.model.complete && {APP}.model.control()"
CHASE = """
name: chase
duration: 6
horizon: 5
robot: {position: [0, 0], radius: 0.4, max_speed: 2, max_acceleration: 2, goal: {trajectory:
  {kind: constant_velocity, position: [6, 4], velocity: [0.8, -0.4]}}}
obstacles:
  - {name: post, radius: 0.5, trajectory: {kind: stationary, position: [4, 1.5]}}
"""
HIT = """
name: hit
duration: 3
robot: {position: [0, 0], radius: 0.4, max_speed: 1, max_acceleration: 1, goal: {position: [9, 0]}}
obstacles:
  - {name: truck, radius: 1, trajectory: {kind: constant_velocity, position: [6, 0], velocity: [-6, 0]}}
"""


def scene(folder: Path, text: str) -> str:
    """The name of a new file with a scenario."""
    (folder / "scene.yaml").write_text(text)
    return str(folder / "scene.yaml")


def test_a_moving_goal_is_drawn_where_it_is(tmp_path: Path) -> None:
    file = scene(tmp_path, CHASE)
    goal = read_scenario(file).robot.goal
    with serving(file) as address, opened() as (page, troubles):
        page.goto(address)
        page.wait_for_function(SHOWN)
        for step in (0, 17, 30):
            time, at = page.evaluate(f"[{APP}.seek({step}), {APP}.model.time, {APP}.model.goal(0)].slice(1)")
            np.testing.assert_allclose(at, goal.position(time), atol=2e-3)
            assert page.evaluate(f"{APP}.view.holds({APP}.view.px({at[0]}), {APP}.view.py({at[1]}))")
        assert troubles == []


def test_the_page_says_how_the_run_ended(tmp_path: Path) -> None:
    file = scene(tmp_path, HIT)
    session = Session(read_scenario(file), method("nao"))
    session.opening()
    found = [unpack(message)[0] for message in session.more(1000)]
    (said,) = (one["ended"] for one in found if one["kind"] == "frames")
    assert said["text"].startswith("Not arrived after 3.0 s. Collision: truck, deepest at ")
    assert said["collided"]
    with serving(file) as address, opened() as (page, _):
        page.goto(address)
        page.wait_for_function(SHOWN)
        page.wait_for_function(f"{APP}.parts.result.textContent.length > 0")
        assert page.evaluate(f"[{APP}.parts.result.textContent, {APP}.parts.result.className]") == [
            said["text"],
            "result alert",
        ]


def test_a_fleet_without_a_collision_is_said_to_have_none() -> None:
    from slalom.sim import gallery

    session = Session(gallery.build("circle", {"robots": 4, "radius": 4.0}), method("nao"))
    session.opening()
    said = next(unpack(message)[0].get("ended") for message in session.more(1000))
    assert said["text"].startswith("4 of 4 robots arrived, the last at ")
    assert (said["text"].endswith("No collision."), said["collided"]) == (True, False)


SLOWLY = f"""(delay) => {{
  const app = {APP}, send = app.source.send.bind(app.source);
  app.source.send = (command) => setTimeout(() => send(command), delay);
  const found = [];
  app.seek(0);
  app.play(true);
  return new Promise((done) => {{
    const note = () => {{
      const shown = app.model.overlay(), every = app.model.scene.period_steps;
      found.push([shown ? Math.floor(shown.step / every) : -1, Math.floor(app.model.step / every)]);
      if (found.length < 150) requestAnimationFrame(note);
      else done(found);
    }};
    note();
  }});
}}"""


def test_paths_are_drawn_only_at_the_positions_of_their_decision() -> None:
    """Also when a control space takes longer than a step: the positions wait for it."""
    with serving("roundabout_crossing") as address, opened() as (page, troubles):
        page.goto(address)
        page.wait_for_function(SHOWN)
        found = np.array(page.evaluate(SLOWLY, 250))
        drawn = found[found[:, 0] >= 0]
        np.testing.assert_array_equal(drawn[:, 0], drawn[:, 1])
        assert len(drawn) >= 0.9 * len(found)
        assert found[-1, 1] > 3
        assert troubles == []


@pytest.mark.parametrize("scale", [4.0, 30.0, 700.0])
def test_the_scale_bar_is_as_long_as_it_says(scale: float) -> None:
    record = f"""(scale) => {{
      const app = {APP}, told = [], own = CanvasRenderingContext2D.prototype.fillText;
      CanvasRenderingContext2D.prototype.fillText = function (words, ...more) {{
        if (this.canvas === app.parts.workspace.canvas) told.push(words);
        return own.call(this, words, ...more);
      }};
      app.view.scale = scale;
      app.view.x += 0.37;
      app.draw();
      CanvasRenderingContext2D.prototype.fillText = own;
      return told.filter((words) => /^[0-9.]+ m$/.test(words));
    }}"""
    with serving("roundabout_crossing") as address, opened() as (page, _):
        page.goto(address)
        page.wait_for_function(SHOWN)
        page.wait_for_timeout(300)  # what was said of the end may have moved the panels
        (told,) = page.evaluate(record, scale)
        assert 50.0 < float(told.removesuffix(" m")) * scale < 160.0


def test_two_control_spaces_fit_on_a_projector_and_a_small_admissible_set_is_enlarged() -> None:
    with serving("roundabout_crossing") as address, opened(viewport={"width": 1024, "height": 768}) as (page, troubles):
        page.goto(address)
        page.wait_for_function(SHOWN)
        page.evaluate(f"{APP}.seek(30); {APP}.compare('vo')")
        page.wait_for_function(f"{APP}.model.control(1)")
        page.wait_for_timeout(300)
        for slot in (0, 1):
            assert page.evaluate(f"{APP}.controlViewport({slot}).width") > 280
        assert page.evaluate("document.documentElement.scrollWidth") <= 1024
        small, inset = inset_of(page)
        assert inset["scale"] > 4.0 * small["scale"]
        # A control that is dragged there is that under the pointer.
        box = page.locator("canvas[data-panel='control second']").bounding_box()
        page.mouse.move(box["x"] + inset["left"] + 20, box["y"] + inset["top"] + 20)
        page.mouse.down()
        page.mouse.up()
        page.wait_for_function(f"{APP}.model.probe")
        probed = page.evaluate(f"{APP}.model.probe.control")
        half = 0.5 * inset["width"] / inset["scale"]
        assert np.abs(np.subtract(probed, (inset["x"], inset["y"]))).max() <= half
        assert troubles == []


def inset_of(page: Any) -> list[dict[str, float]]:
    """The viewport of the second control space, and that of the enlarged picture in one of its corners."""
    return page.evaluate(
        f"""(() => {{
          const app = {APP}, view = app.controlViewport(1), ends = [9, view.width - 9];
          const found = ends.flatMap((x) => ends.map((y) => app.controlViewport(1, [view.left + x, view.top + y])));
          return [view, found.find((one) => one.scale !== view.scale)];
        }})()"""
    )
