"""What the user of the view must not lose: a replay, changes, the picture, keys, and the state in the address."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_views import APP, crossing, in_browser, opened, serving

from slalom import method
from slalom.live.messages import unpack
from slalom.live.recorded import of_file
from slalom.live.session import Session, scenario_of
from slalom.sim import gallery, simulate

SHOWN = f"{APP}?.model.complete && {APP}.model.control()"


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """The address of a server."""
    with serving("roundabout_crossing", "--seed", "3") as found:
        yield found


browsed = [pytest.mark.slow, pytest.mark.browser, in_browser]


def show(page: Any, address: str) -> None:
    """Open a page of a server, with its whole run and a control space."""
    page.goto(address)
    page.wait_for_function(SHOWN)
    page.wait_for_timeout(300)


def pixel_of_obstacle(page: Any, k: int) -> list[float]:
    return page.evaluate(
        f"(() => {{ const a = {APP}, o = a.model.obstacle({k}), r = a.parts.workspace.canvas.getBoundingClientRect();"
        "return [r.x + a.view.px(o[0]), r.y + a.view.py(o[1])]; })()"
    )


class TestInTheBrowser:
    pytestmark = browsed

    def test_a_click_names_a_body_and_changes_nothing(self, tmp_path: Path) -> None:
        file = tmp_path / "run.h5"
        simulate(crossing(), method("nao")).save(file)
        with serving(str(file)) as address, opened() as (page, troubles):
            show(page, address)
            page.evaluate(f"{APP}.seek(4)")
            page.wait_for_timeout(300)
            count = page.evaluate(f"{APP}.model.count")
            page.mouse.move(*pixel_of_obstacle(page, 1))
            page.wait_for_function(f"{APP}.parts.hover.textContent.startsWith('b: 2.2 m/s')")
            page.mouse.down()
            page.mouse.up()
            page.wait_for_timeout(400)
            scene = page.evaluate(f"(({{recorded, undo}}) => [recorded, undo])({APP}.model.scene)")
            assert (scene, page.evaluate(f"{APP}.model.count")) == ([True, 0], count)
            assert page.evaluate(f"{APP}.dragging.handle") == {"what": "obstacle", "index": 1}
            assert troubles == []

    def test_no_number_of_a_robot_and_no_error_ends_the_drawing(self) -> None:
        with serving("circle", "--set", "duration=2") as address, opened() as (page, troubles):
            show(page, address)
            for given, selected in (("1.5", 2), ("", 2), ("99", 3), ("-1", 0)):
                page.locator("input[aria-label=robot]").fill(given)
                page.keyboard.press("Tab")
                assert page.evaluate(f"{APP}.model.selected") == selected
                assert page.locator("input[aria-label=robot]").input_value() == str(selected)
            assert troubles == []
            page.evaluate(f"{APP}.own = {APP}.draw; {APP}.draw = () => {{ throw new Error('no'); }}; 0")
            page.evaluate(f"{APP}.seek(3)")
            page.wait_for_function(f"{APP}.parts.note.textContent.includes('cannot be drawn: Error: no')")
            page.evaluate(f"{APP}.draw = {APP}.own; {APP}.drawings.length = 0; {APP}.seek(5)")
            page.wait_for_function(f"{APP}.drawings.length > 0")

    def test_a_reload_and_another_server_show_the_same(self, address: str) -> None:
        with opened() as (page, troubles):
            show(page, address)
            page.evaluate(f"{APP}.seek(5); {APP}.select(0)")
            page.evaluate(f"{APP}.send({{do: 'drag', what: 'obstacle', index: 3, to: [50, 50], step: 5, gesture: 1}})")
            page.wait_for_function(f"{APP}.model.scene.undo === 1 && {APP}.model.complete")
            page.locator("select[aria-label=method]").select_option("ao")
            page.wait_for_function(f"{APP}.model.scene.method === 'ao' && {APP}.model.complete")
            page.evaluate(f"{APP}.compare('vo'); {APP}.seek(7)")
            page.wait_for_function("location.hash.includes('scene=') && location.hash.includes('step=7')")
            page.wait_for_function("location.hash.includes('compare=vo')")
            kept = page.evaluate("location.hash")
            places = f"[...{APP}.model.obstacle(3), ...{APP}.model.robot(0)]"
            names = f"[{APP}.model.scene.method, {APP}.model.scene.compare]"
            before, there = page.evaluate(places), f"{APP}.model.step === 7 && {APP}.model.scene.compare === 'vo'"
            assert page.evaluate(f"[{APP}.seek(0), {APP}.model.obstacle(3)][1]") == pytest.approx([50, 50], abs=0.01)
            page.evaluate(f"{APP}.seek(7)")
            page.reload()
            page.wait_for_function(f"{SHOWN} && {there}")
            assert page.evaluate(names) == ["ao", "vo"]
            np.testing.assert_allclose(page.evaluate(places), before, atol=0.01)
            with serving("empty") as other:
                page.goto("about:blank")
                page.goto(other + kept)
                page.wait_for_function(f"{SHOWN} && {there}")
                assert page.evaluate(names) == ["ao", "vo"]
                np.testing.assert_allclose(page.evaluate(places), before, atol=0.01)
            page.wait_for_function(f"{APP}.parts.note.textContent.includes('add everything from # on')")
            assert [trouble for trouble in troubles if "WebSocket" not in trouble] == []

    def test_the_foresight_is_chosen_and_a_refused_choice_is_taken_back(self) -> None:
        with (
            serving("circle", "--set", "duration=2", "--method", "nao@observed") as address,
            opened() as (page, troubles),
        ):
            show(page, address)
            lists = "['method', 'foresight', 'compare'].map((name) => " + APP + ".parts[name].value)"
            assert page.evaluate(lists) == ["nao", "observed", ""]
            page.locator("select[aria-label^=foresight]").select_option("observed_turn")
            page.wait_for_function(f"{APP}.model.scene.method === 'nao@observed_turn' && {APP}.model.complete")
            for name in ("method", "second"):
                page.locator(f"select[aria-label^={name}]").select_option("nao_ahead")
                page.wait_for_function(f"{APP}.parts.note.textContent.length > 0")
                assert page.evaluate(lists) == ["nao", "observed_turn", ""]
                assert page.evaluate(f"{APP}.parts.controls[1].section.hidden")
            page.locator("select[aria-label^=second]").select_option("vo")
            page.wait_for_function(f"{APP}.model.control(1)?.method === 'vo'")
            assert page.evaluate(f"{APP}.parts.note.textContent") == ""
            assert not page.evaluate(f"{APP}.parts.controls[1].section.hidden")
            assert troubles == []

    def test_keys_work_after_a_slider_and_a_list(self, address: str) -> None:
        with opened() as (page, _):
            show(page, address)
            page.locator("input[aria-label='time of the run']").focus()
            page.keyboard.press("Space")
            assert page.evaluate(f"{APP}.model.playing")
            page.keyboard.press("Space")
            page.locator("select[aria-label=method]").select_option("ao")
            page.wait_for_function(f"{APP}.model.scene.method === 'ao' && {APP}.model.complete")
            page.locator("select[aria-label=method]").focus()
            step = page.evaluate(f"{APP}.model.step")
            page.keyboard.press("ArrowRight")
            assert page.evaluate(f"[{APP}.model.step, {APP}.parts.method.value]") == [step + 1, "ao"]

    def test_a_finger_moves_the_page_and_two_magnify(self, address: str) -> None:
        with opened(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True) as (page, troubles):
            show(page, address)
            box = page.locator("canvas").first.bounding_box()
            client = page.context.new_cdp_session(page)
            x, y = box["x"] + 20, box["y"] + 0.8 * box["height"]

            def touch(kind: str, *points: tuple[float, float]) -> None:
                given = [{"x": a, "y": b, "id": k} for k, (a, b) in enumerate(points)]
                client.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": given})
                page.wait_for_timeout(16)

            touch("touchStart", (x, y))
            for k in range(16):
                touch("touchMove", (x, y - 16 * k))
            touch("touchEnd")
            page.wait_for_function("scrollY > 200")
            page.wait_for_timeout(600)
            page.evaluate("scrollTo(0, 0)")
            page.wait_for_timeout(200)
            scale = page.evaluate(f"{APP}.view.scale")
            touch("touchStart", (x, y), (x + 40, y))
            for k in range(10):
                touch("touchMove", (x, y), (x + 40 + 8 * k, y))
            touch("touchEnd")
            assert page.evaluate("scrollY") == 0
            assert page.evaluate(f"{APP}.view.scale") > 1.4 * scale
            assert troubles == []

    def test_before_the_scene_is_there_the_page_shows_a_sentence(self, address: str) -> None:
        with opened() as (page, _):
            page.add_init_script("WebSocket = class { addEventListener() {} send() {} };")
            page.goto(address)
            shown = "[...document.querySelectorAll('.slalom canvas, .slalom .why')].filter((e) => e.offsetParent)"
            page.wait_for_function(f"{shown}.length === 1")
            assert page.evaluate(f"{shown}[0].textContent") == "The scene is being prepared."


def test_copied_yaml_has_the_method() -> None:
    session = Session(crossing(), method("nao@observed"))
    session.answer({"do": "method", "name": "ao@present"})
    copied = unpack(session.answer({"do": "yaml"})[0])[0]["text"]
    again = scenario_of(copied)
    assert again.robot.method == method("ao@present")
    assert simulate(again, "nao").digest() == simulate(crossing(), "ao@present").digest()
    # In the view, the method of the file is the one that another choice replaces.
    shown = Session(again, method("nao"))
    assert (shown.method.name, shown.scenario.robot.method) == ("ao@present", None)


def test_a_state_is_restored_or_refused_as_a_whole() -> None:
    session = Session(gallery.build("head_on"), method("nao"))
    session.opening()
    text = unpack(Session(crossing(), method("vo")).answer({"do": "yaml"})[0])[0]["text"]
    scene = unpack(session.answer({"do": "restore", "scene": text, "method": "vo", "compare": "ao", "robot": 0})[0])[0]
    assert (scene["title"], scene["method"], scene["undo"], session.compared) == ("crossing", "vo", 1, method("ao"))
    for wrong in ({"scene": "robot: 3"}, {"method": "magic"}, {"scene": text, "robot": -1}):
        (error,) = [unpack(message)[0] for message in session.answer({"do": "restore", **wrong})]
        assert error["kind"] == "error"
        assert (session.scenario.name, session.method.name) == ("crossing", "vo")
    refused = unpack(session.answer({"do": "restore", "compare": "magic"})[-1])[0]
    assert (refused["kind"], session.compared) == ("error", None)
    session.answer({"do": "undo"})
    assert (session.scenario.name, session.method.name) == ("head_on", "nao")


@pytest.mark.parametrize("kept", [False, True])
def test_the_file_of_a_decision_is_shown(kept: bool, tmp_path: Path) -> None:
    """Of a kept manoeuvre the control space of now, without the control that was chosen in another one."""
    scenario = gallery.build("roundabout_crossing", seed=3)
    session = Session(scenario, method("nao"))
    session.more(40)
    decisions = [session._played.known(k).decision(k) for k in range(40)]
    decision = next(each for each in decisions[5:] if (each.begun is not None) == kept)
    decision.dump(tmp_path / "decision.json")
    found = of_file(tmp_path / "decision.json")
    shown = Session.of(found, method("vo"))
    scene = unpack(shown.opening()[0])[0]
    assert (scene["recorded"], scene["method"], scene["start"]) == (True, "nao", decision.inputs.now)
    seen = shown._seen(0)
    assert (seen.outcome, seen.time) == (decision.outcome.name, decision.inputs.now)
    np.testing.assert_array_equal(seen.state.position, decision.inputs.state.position)
    assert (seen.controls.chosen is None) == kept
    if not kept:
        assert [other.obstacle.name for other in seen.others] == [o.name for o in decision.blocked.obstacles.obstacles]
        np.testing.assert_array_equal(seen.controls.chosen, decision.manoeuvre.control)
        assert np.isinf(seen.times(seen.controls.chosen[None] * (1.0 - 1e-9))).all() or not decision.safe
    changed = shown.answer({"do": "drag", "what": "robot", "index": 0, "to": [1.0, 1.0], "step": 0, "gesture": 1})
    assert unpack(changed[0])[0]["recorded"] is False
