"""Two runs beside each other in the view: of two methods from one start, and of two files."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_views import APP, crossing, in_browser, opened, serving

from slalom import method
from slalom.sim import gallery, simulate

pytestmark = [pytest.mark.slow, pytest.mark.browser, in_browser]
SHOWN = f"{APP}?.model.complete && {APP}.model.control()"
SECOND = f"{APP}.pair.second?"
BOTH = f"{SECOND}.model.complete && {SECOND}.model.control()"


def places(page: Any, steps: range) -> list[Any]:
    """Positions of the robot of both runs at some steps of the first one, as they are shown."""
    found = []
    for step in steps:
        page.evaluate(f"{APP}.seek({step})")
        page.wait_for_timeout(60)
        found.append(page.evaluate(f"[{APP}.model.robot(0), {SECOND}.model.robot(0)]"))
    return found


def test_two_methods_run_from_one_start() -> None:
    scenario = gallery.build("roundabout_crossing").with_settings({"duration": 9.0})
    runs = [simulate(scenario, method(name)) for name in ("nao", "vo")]
    with serving("roundabout_crossing", "--set", "duration=9") as address, opened() as (page, troubles):
        page.goto(address)
        page.wait_for_function(SHOWN)
        page.locator("select[aria-label^=second]").select_option("vo")
        page.wait_for_function(f"{APP}.model.control(1)?.method === 'vo'")
        page.locator("[data-name=own]").first.click()
        page.wait_for_function(f"{BOTH} && {APP}.pair.second.model.scene.method === 'vo'")
        assert page.evaluate(f"{APP}.model.scene.compare") is None
        last = max(len(run.times) for run in runs) - 1
        assert page.evaluate(f"{APP}.last") == last
        for step, shown in zip(range(0, last, 16), places(page, range(0, last, 16))):
            for run, at in zip(runs, shown):
                np.testing.assert_allclose(at, run.positions[min(step, len(run.times) - 1), 0], atol=2e-3)
        # Both control spaces are those of the time that is shown, also while it plays.
        page.evaluate(f"{APP}.seek(20)")
        page.wait_for_function(f"[{APP}, {APP}.pair.second].every((one) => one.model.control()?.step === 20)")
        found = page.evaluate(
            f"""() => new Promise((done) => {{
              const app = {APP}, found = [];
              app.play(true);
              const note = () => {{
                found.push([app, app.pair.second].map((one) => one.model.playhead * one.model.scene.dt));
                if (found.length < 60) requestAnimationFrame(note); else done(found);
              }};
              note();
            }})"""
        )
        times = np.array(found)
        # A picture may be drawn between the two.
        assert np.abs(times[1:, 0] - times[1:, 1]).max() < 0.06
        assert times[-1, 0] > times[0, 0] + 0.3
        assert page.locator(".heading:visible").all_text_contents() == [
            page.evaluate(f"['roundabout_crossing', '{name}', {one}.model.ended.text].join(' · ')")
            for name, one in (("nao", APP), ("vo", f"{APP}.pair.second"))
        ]
        assert page.locator("canvas[data-panel^=control]:visible").count() == 2
        # A change begins both runs anew.
        page.evaluate(f"{APP}.play(false); {APP}.seek(0)")
        page.evaluate(f"{APP}.send({{do: 'drag', what: 'robot', index: 0, to: [-22, 1], step: 0}})")
        page.wait_for_function(f"{APP}.model.scene.undo === 1 && {APP}.model.complete")
        page.wait_for_function(f"{BOTH} && Math.abs({APP}.pair.second.model.positions.values[1] - 1) < 1e-3")
        # The address holds both, and undo leads back to the first start.
        page.wait_for_function("location.hash.includes('own=1') && location.hash.includes('scene=')")
        kept = page.evaluate("location.hash")
        page.keyboard.press("u")
        page.wait_for_function(f"{APP}.model.scene.undo === 0 && {APP}.model.complete && {BOTH}")
        start = float(runs[0].positions[0, 0, 1])
        page.wait_for_function(f"Math.abs({APP}.pair.second.model.positions.values[1] - {start}) < 1e-3")
        page.goto("about:blank")
        page.goto(address + kept)
        page.wait_for_function(f"{SHOWN} && {BOTH} && {APP}.pair.second.model.scene.method === 'vo'")
        page.wait_for_function(f"Math.abs({APP}.pair.second.model.positions.values[1] - 1) < 1e-3")
        page.locator("[data-name=own]").first.click()
        page.wait_for_function(f"!{APP}.pair.second && {APP}.model.control(1)?.method === 'vo'")
        assert [trouble for trouble in troubles if "WebSocket" not in trouble] == []


def test_two_files_are_shown_at_one_time(tmp_path: Path) -> None:
    files = []
    for name, seconds in (("nao", 1.0), ("vo", 2.0)):
        run = simulate(crossing(seconds), method(name))
        run.save(tmp_path / f"{name}.h5")
        files.append((str(tmp_path / f"{name}.h5"), run))
    with (
        serving(*(file for file, _ in files)) as address,
        opened(viewport={"width": 1024, "height": 768}) as (page, troubles),
    ):
        page.goto(address)
        page.wait_for_function(f"{SHOWN} && {BOTH}")
        page.keyboard.press("End")
        last = len(files[1][1].times) - 1
        assert page.evaluate(f"[{APP}.model.playhead, {APP}.model.step]") == [last, len(files[0][1].times) - 1]
        for step, shown in zip(range(0, last, 4), places(page, range(0, last, 4))):
            for (_, run), at in zip(files, shown):
                np.testing.assert_allclose(at, run.positions[min(step, len(run.times) - 1), 0], atol=2e-3)
        assert page.evaluate(f"[{APP}.model.control().method, {APP}.pair.second.model.control().method]") == [
            "nao",
            "vo",
        ]
        assert page.locator("select[aria-label^=second]:visible").count() == 0
        assert page.evaluate("document.documentElement.scrollWidth") <= 1024
        for canvas in page.locator("canvas[data-panel]:visible").all():
            box = canvas.bounding_box()
            assert min(box["width"], box["height"]) > 80
        assert troubles == []


def test_a_second_file_that_cannot_run_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    from slalom.cli import main

    with pytest.raises(SystemExit, match="2"):
        main(["view", "empty", "nothing_of_this_name", "--no-browser"])
    assert "nothing_of_this_name" in capsys.readouterr().err
