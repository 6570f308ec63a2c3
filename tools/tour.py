"""Pictures of docs/tour.md, docs/view.md and README.md, and the explanations of docs/tour.md.

usage: .venv/bin/python tools/tour.py [--explanations]

Pictures are taken from the view itself, which needs Chromium (`make chromium`) and Playwright. Look at each picture
before you keep it.
"""

import io
import json
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PIL import Image

from slalom import method
from slalom.cli import call
from slalom.sim import gallery, simulate
from slalom.view import animate

if TYPE_CHECKING:
    from playwright.sync_api import Page

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
def page_of(browser: Any, address: str, size: dict[str, int], scheme: str = "light") -> Iterator["Page"]:
    """A page of the view, once its run is complete."""
    context = browser.new_context(viewport=size, color_scheme=scheme, bypass_csp=True)
    page = context.new_page()
    page.goto(address)
    page.wait_for_function(f"{APP}.model.complete && {APP}.model.control()", timeout=120_000)
    yield page
    context.close()


def seek(page: "Page", step: int) -> None:
    """Show a step with its control space."""
    page.evaluate(f"{APP}.seek({step})")
    page.wait_for_function(f"{APP}.model.control()?.step === {step}", timeout=60_000)
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def shot(page: "Page", name: str) -> None:
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


TOUR = IMAGES.parent / "tour.md"
BEGIN, END = "<!-- begin of the explanations, written by tools/tour.py -->", "<!-- end of the explanations -->"
EXPLAINED = (
    "sample:crossing.yaml",
    "head_on --set offset=0.5",
    "sample:hall.yaml --at 4",
    "roundabout_crossing --seed 3 --at 0.9",
    "empty --at 4",
)
"""Scenes of the tour: arguments of `slalom explain`."""


def told(arguments: str) -> str:
    """What `slalom explain` tells of a scene: the command, its sentences but for comparisons, and what decided."""
    found = io.StringIO()
    with redirect_stdout(found):
        call(["explain", *arguments.split(), "--json"])
    result = json.loads(found.getvalue())
    sentences = [one for one in result["sentences"] if not one.startswith(("Alternative ", "Chosen ", "Kept "))]
    obstacles = [one["obstacle"] for one in result["passes"]] or [
        each["obstacle"] for each in (result["preferred_hits"],) if each
    ]
    decisive = [f"obstacle `{one}`" for one in obstacles] + [f"limit `{one}`" for one in result["limits"]]
    lines = [f"`slalom explain {arguments}`:", "", *(f"> {one}" for one in sentences), ""]
    return "\n".join([*lines, f"Decisive: {', '.join(decisive)}."])


def explanations() -> str:
    """The part of docs/tour.md with the explanations."""
    return "\n\n".join([BEGIN, *(told(each) for each in EXPLAINED), END])


def written(text: str) -> str:
    """The text of docs/tour.md with the explanations that the present code gives."""
    before, _, rest = text.partition(BEGIN)
    return before + explanations() + rest.partition(END)[2]


def main() -> None:
    """Write the explanations; make the run, and take the pictures."""
    TOUR.write_text(written(TOUR.read_text()))
    if "--explanations" in sys.argv[1:]:
        return
    from playwright.sync_api import sync_playwright

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
