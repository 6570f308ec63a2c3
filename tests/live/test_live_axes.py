"""Every axis of every layout has numbers, legends name marks that are there, titles are whole."""

from pathlib import Path
from typing import Any

import pytest
from live_views import APP, WEB, in_browser, opened, serving

from slalom.live.recorded import export
from slalom.sim import Recording, gallery, simulate

pytestmark = [pytest.mark.slow, pytest.mark.browser, in_browser]
TEXTS = """
const fill = CanvasRenderingContext2D.prototype.fillText, clear = CanvasRenderingContext2D.prototype.fillRect;
CanvasRenderingContext2D.prototype.fillText = function (words, ...at) {
  (this.canvas.texts ??= []).push([words, this.textAlign, this.textBaseline]);
  return fill.call(this, words, ...at);
};
CanvasRenderingContext2D.prototype.fillRect = function (x, y, width, height) {
  if (x === 0 && y === 0 && width > 40) this.canvas.texts = [];
  return clear.call(this, x, y, width, height);
};
"""
"""Keeps the texts of each picture."""
PANELS = """() => [...document.querySelectorAll("canvas[data-panel]")]
  .filter((one) => one.offsetParent && one.texts?.length).map((one) => [one.dataset.panel, one.texts])"""
CUT = """() => [...document.querySelectorAll("h2, .heading")]
  .filter((one) => one.scrollWidth > one.clientWidth + 1).length"""
ENTRIES = "() => [...document.querySelectorAll('.entry:not(.absent)')].map((one) => one.textContent)"
SIDES = {"x": ("center", "top"), "y": ("right", "middle"), "bar": ("left", "middle")}


def numbers(texts: list[list[str]], side: tuple[str, str]) -> set[float]:
    """The numbers besides 0 on one side of a picture."""
    shown = {words.removesuffix(" s").replace("−", "-") for words, *where in texts if tuple(where) == side}
    return {float(one) for one in shown if one.replace("-", "").replace(".", "").isdigit()} - {0.0}


def assert_axes(page: Any, least: int) -> None:
    """At least two numbers besides 0 on each axis of at least some pictures, and no title is cut."""
    page.wait_for_timeout(300)
    panels = [(name, texts) for name, texts in page.evaluate(PANELS) if name != "workspace"]
    assert len(panels) >= least
    for name, texts in panels:
        for side in ("x", "y") if name == "chart" else SIDES:
            assert len(numbers(texts, SIDES[side])) >= 2, (name, side, texts)
    assert page.evaluate(CUT) == 0


def noted(page: Any) -> Any:
    page.add_init_script(TEXTS)
    return page


@pytest.fixture(scope="module")
def runs() -> list[Recording]:
    return [simulate(gallery.build("head_on", {"offset": 0.5}), name) for name in ("nao", "vo")]


@pytest.mark.parametrize("width", [1280, 820, 390])
def test_axes_of_two_runs_of_one_robot(width: int, runs: list[Recording], tmp_path: Path) -> None:
    """A pair of files has no fields of fleets either."""
    files = [str(tmp_path / f"{run.method}.h5") for run in runs]
    for run, file in zip(runs, files):
        run.save(file)
    with serving(*files) as address, opened(viewport={"width": width, "height": 720}) as (page, troubles):
        noted(page).goto(address)
        page.wait_for_function(f"[{APP}, {APP}?.pair.second].every((one) => one?.model.control())")
        assert_axes(page, 5)
        for name in ("robot", "colour"):
            assert page.evaluate(
                f"() => [...document.querySelectorAll('[data-field={name}]')].every((x) => !x.offsetParent)"
            )
        assert troubles == []


@pytest.mark.parametrize("width", [1280, 390])
def test_axes_of_an_exported_run_and_its_sentence(width: int, runs: list[Recording], tmp_path: Path) -> None:
    """A sentence of another decision than the one in force says of when it is."""
    export(runs[0], tmp_path / "run.html", interval=1.0)
    with opened(viewport={"width": width, "height": 720}) as (page, _):
        noted(page).goto((tmp_path / "run.html").as_uri())
        page.wait_for_function(f"{APP}?.model.control()")
        assert_axes(page, 4)
        for step, begins in ((10, False), (14, True), (20, False)):
            page.evaluate(f"{APP}.seek({step})")
            page.wait_for_timeout(100)
            said = page.evaluate(f"{APP}.parts.why.textContent")
            assert said.startswith("At t = 1.0 s: ") == begins, said


def test_axes_in_a_notebook(runs: list[Recording], tmp_path: Path) -> None:
    shown = runs[0]._repr_html_()
    assert shown is not None
    (tmp_path / "cell.html").write_text(f"<div style='width:760px'>{shown}</div>")
    with opened(viewport={"width": 800, "height": 700}) as (page, _):
        noted(page).goto((tmp_path / "cell.html").as_uri())
        page.wait_for_timeout(1500)
        assert_axes(page.frames[1], 4)


@pytest.mark.parametrize("width", [1280, 900, 640, 390])
def test_axes_of_the_explored_control_spaces(width: int) -> None:
    """With a second method too; a mark that the picture lacks is not in the legend."""
    with opened(viewport={"width": width, "height": 760}) as (page, _):
        noted(page).goto((WEB.parent / "docs" / "_static" / "explorer.html").as_uri())
        page.wait_for_timeout(500)
        assert_axes(page, 1)
        assert not {"obstacle", "as a method extrapolates"} & set(page.evaluate(ENTRIES))
        page.locator("nav a").nth(1).click()
        assert_axes(page, 2)
        assert {"obstacle", "as a method extrapolates"} <= set(page.evaluate(ENTRIES))


def test_legends_name_what_is_there(tmp_path: Path) -> None:
    """Without obstacles there are no control obstacles, and nothing is hit."""
    export(simulate(gallery.build("empty", {"duration": 2.0}), "nao"), tmp_path / "run.html")
    with opened() as (page, _):
        page.goto((tmp_path / "run.html").as_uri())
        page.wait_for_function(f"{APP}?.model.control()")
        page.wait_for_timeout(200)
        assert set(page.evaluate(ENTRIES)) == {
            *("robot, arrow: motion in 1 s", "goal", "preferred, to first contact", "committed, dot per second"),
            *("preferred", "chosen", "admissible set"),
        }


def test_a_dragged_car_has_one_name() -> None:
    with serving("head_on", "--set", "offset=0.5") as address, opened() as (page, _):
        noted(page).goto(address)
        page.wait_for_function(f"{APP}?.model.complete && {APP}.model.control()")
        page.locator("canvas[data-panel=workspace]").focus()
        for _ in range(9):
            page.keyboard.press("h")
            if page.evaluate(f"{APP}.dragging.handle?.what") == "obstacle":
                break
        page.wait_for_timeout(200)
        assert page.evaluate(f"{APP}.dragging.handle?.what") == "obstacle"
        texts = dict(page.evaluate(PANELS))["workspace"]
        assert [words for words, *_ in texts if "car" in words] == ["car"]
