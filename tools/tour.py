"""Pictures of docs/tour.md, docs/view.md and README.md, taken from the view itself: `.venv/bin/python tools/tour.py`.

It needs Chromium (`make chromium`) and Playwright. Look at each picture before you keep it.
"""

import io
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from slalom import method
from slalom.sim import gallery, simulate
from slalom.view import animate

IMAGES = Path(__file__).parents[1] / "docs" / "images"
APP = "document.getElementById('slalom').slalom"
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars"]
SIZE = {"width": 1280, "height": 760}
AHEAD = 5.9
"""[s] Time ahead in tour_ahead.png: the manoeuvre passes a car with the margin then."""


@contextmanager
def served(*arguments: str) -> Iterator[str]:
    """The address of `slalom view` with these arguments."""
    command = [sys.executable, "-m", "slalom", "view", *arguments, "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline().strip()
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20)


@contextmanager
def page_of(browser: Any, address: str, size: dict[str, int], scheme: str = "light") -> Iterator[Page]:
    """A page of the view, once its run is complete."""
    context = browser.new_context(viewport=size, color_scheme=scheme, bypass_csp=True)
    page = context.new_page()
    page.goto(address)
    page.wait_for_function(f"{APP}.model.complete && {APP}.model.control()", timeout=120_000)
    yield page
    context.close()


def seek(page: Page, step: int) -> None:
    """Show a step with its control space."""
    page.evaluate(f"{APP}.seek({step})")
    page.wait_for_function(f"{APP}.model.control()?.step === {step}", timeout=60_000)
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def shot(page: Page, name: str) -> None:
    """Write a picture of the page."""
    page.wait_for_timeout(150)
    Image.open(io.BytesIO(page.screenshot())).convert("RGB").save(IMAGES / name, optimize=True)
    print(IMAGES / name, (IMAGES / name).stat().st_size // 1000, "kB")


def hit_step(outcomes: list[str]) -> int:
    """The first decision after the start that avoids something."""
    return next(k for k, name in enumerate(outcomes) if k > 5 and name == "CONSTRAINED")


def still(browser: Any, run: Path, turning: int) -> None:
    """The pictures of the tour."""
    with served(str(run)) as address, page_of(browser, address, SIZE) as page:
        seek(page, turning)
        shot(page, "tour_turn.png")
        page.evaluate(f"{APP}.setElement({AHEAD})")
        shot(page, "tour_ahead.png")
        page.evaluate(f"{APP}.setElement(0)")
        x, y = page.evaluate(
            f"(() => {{ const a = {APP}, v = a.controlViewport(0), u = a.model.control().preferred;"
            "const r = a.parts.controls[0].canvas.getBoundingClientRect(), h = a.model.control().planes[0].half;"
            "const c = (x) => Math.max(-0.93 * h, Math.min(0.93 * h, x));"
            "return [r.x + v.px(c(u[0])), r.y + v.py(c(u[1]))]; })()"
        )
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x - 1, y)
        page.wait_for_function(f"{APP}.model.probe !== null")
        shot(page, "tour_probe.png")
        page.mouse.up()
        page.locator("select[aria-label^=second]").select_option("vo")
        page.wait_for_function(f"{APP}.model.control(1)?.method === 'vo'", timeout=60_000)
        seek(page, turning)
        page.wait_for_function(f"{APP}.model.control(1)?.step !== undefined")
        page.wait_for_timeout(800)
        shot(page, "tour_compare.png")
        page.keyboard.press("t")
        shot(page, "view.png")


def pair(browser: Any, step: int) -> None:
    """The picture of docs/view.md of two runs from one start."""
    scene = ("roundabout_crossing", "--seed", "3", "--set", "duration=9")
    with served(*scene) as address, page_of(browser, address, SIZE) as page:
        page.evaluate(f"{APP}.chooseBeside('vo', true)")
        page.wait_for_function(f"{APP}.pair.second?.model.complete", timeout=120_000)
        page.evaluate(f"{APP}.seek({step})")
        both = f"[{APP}, {APP}.pair.second].every((one) => one.model.has({step}))"
        page.wait_for_function(both, timeout=60_000)
        shot(page, "view_pair.png")


def space_and_fleet(browser: Any) -> None:
    """The pictures of docs/view.md of a robot in space and of a fleet."""
    with served("drones_crossing") as address, page_of(browser, address, SIZE) as page:
        seek(page, 7)
        page.keyboard.press("2")
        shot(page, "view_space.png")
    with served("doorway", "--set", "duration=8") as address, page_of(browser, address, SIZE) as page:
        seek(page, 40)
        # The target of this robot is not its goal.
        page.evaluate(f"{APP}.select(10)")
        page.wait_for_function(f"{APP}.model.control()?.robot === 10 && {APP}.model.control()?.step === 40")
        page.locator("select[aria-label^=colour]").select_option("outcome")
        shot(page, "view_fleet.png")


def main() -> None:
    """Make the run, and take the pictures."""
    recording = simulate(gallery.build("roundabout_crossing", seed=3), method("nao"), seed=3)
    turning = hit_step([row[0] for row in recording.outcomes])
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        run = Path(folder) / "run.h5"
        recording.save(run)
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        still(browser, run, turning)
        pair(browser, turning)
        space_and_fleet(browser)
        browser.close()
    animate(recording, IMAGES / "view.gif", fps=8.0, speed=2.4, control_space=True)


if __name__ == "__main__":
    main()
