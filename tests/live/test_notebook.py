"""Runs in notebooks: what a recording shows of itself, the widget, and the notebooks of the documentation."""

import base64
import gzip
import html
import re
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slalom import Disc, InvalidInput, Limits, State, method
from slalom.live import notebook
from slalom.live.messages import unpack
from slalom.live.notebook import widget
from slalom.model.goal import Goal
from slalom.model.trajectory import Stationary
from slalom.sim import Recording, simulate
from slalom.sim.scenario import Robot, Scenario

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "notebooks").glob("*.ipynb"))
ROBOT = Robot(Disc(0.5), Limits(4.0, 3.0), State((0, 0), (3, 0)), Goal(Stationary((20, 0)), 0.5))
SCENE = Scenario("straight", (ROBOT,), (), duration=1.0)


@pytest.fixture(scope="module")
def run() -> Recording:
    return simulate(SCENE, method("nao"))


def held(block: bytes) -> list[tuple[dict, dict]]:
    """The messages of a compressed block."""
    whole, found, at = gzip.decompress(block), [], 0
    while at < len(whole):
        (size,) = struct.unpack_from("<I", whole, at)
        found.append(unpack(whole[at + 4 : at + 4 + size]))
        at += 4 + size
    return found


def messages_of(shown: str) -> list[tuple[dict, dict]]:
    """The messages in the page that a recording shows of itself."""
    page = html.unescape(shown.split('srcdoc="')[1].rsplit('"', 1)[0])
    data = re.search(r'id="slalom-data">([^<]+)<', page)
    assert data is not None
    return held(base64.b64decode(data[1]))


def test_a_recording_shows_its_own_states(run: Recording) -> None:
    shown = run._repr_html_()
    found = messages_of(shown)
    assert [fields["kind"] for fields, _ in found[:4]] == ["scene", "frames", "series", "control"]
    np.testing.assert_allclose(found[1][1]["positions"], run.positions, atol=6e-4)
    assert 'sandbox="allow-scripts"' in shown


def test_what_a_recording_shows_is_bounded(run: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    """First the control spaces are left out, then everything but a sentence."""
    whole = len(run._repr_html_())
    monkeypatch.setattr(notebook, "MOST_ROBOTS", 0)
    small = run._repr_html_()
    assert [fields["kind"] for fields, _ in messages_of(small)] == ["scene", "frames", "series"]
    assert len(small) < whole
    monkeypatch.setattr(notebook, "LARGEST", 1000)
    assert run._repr_html_() == "<p>straight, nao: number of robots 1, of steps 10.</p>"
    at_goal = simulate(replace(SCENE, robots=(replace(ROBOT, goal=Goal(Stationary((0, 0)), 0.5)),)), method("nao"))
    assert at_goal._repr_html_() == "<p>straight, nao: number of robots 1, of steps 0.</p>"


def test_a_widget_holds_the_messages_of_a_run(run: Recording) -> None:
    pytest.importorskip("anywidget", reason="slalom[notebook] is not installed: widgets are not made")
    for made in (widget(run), widget(SCENE, method("nao"))):
        found = held(made.data)
        np.testing.assert_allclose(found[1][1]["positions"], run.positions, atol=6e-4)
        assert sum(fields["kind"] == "control" for fields, _ in found) == 10


def test_a_live_widget_answers_as_a_session(run: Recording) -> None:
    """Of a scenario and of a recording; a refused command is answered by a sentence."""
    pytest.importorskip("anywidget", reason="slalom[notebook] is not installed: widgets are not made")
    for made in (widget(SCENE, method("nao"), live=True), widget(run, live=True)):
        sent = []
        made.send = lambda content, buffers, sent=sent: sent.append((content, [unpack(each) for each in buffers]))
        made._handle_custom_msg({"do": "open"}, [])
        assert [fields["kind"] for fields, _ in sent[-1][1]] == ["scene", "frames", "series", "control"]
        while not sent[-1][0]["complete"]:
            made._handle_custom_msg({"do": "more"}, [])
        for command in ({"do": "fly"}, "fly", {"do": "drag"}):
            made._handle_custom_msg(command, [])
            assert [fields["kind"] for fields, _ in sent[-1][1]] == ["error"]
        made._handle_custom_msg({"do": "drag", "what": "goal", "index": 0, "to": [9, 3], "step": 2, "id": 5}, [])
        scene = sent[-1][1][0][0]
        assert (scene["robots"][0]["goal"], scene["undo"], sent[-1][0]["complete"]) == ([9.0, 3.0], 1, False)
    with pytest.raises(InvalidInput, match="robot: expected one of 0 to 0, found 1"):
        widget(SCENE, method("nao"), robot=1, live=True)


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_the_notebooks_of_the_documentation_run(path: Path, tmp_path: Path) -> None:
    """And their last displays are what the page promises."""
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed: notebooks are not executed")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    found = nbformat.read(path, as_version=4)
    assert not any(cell.get("outputs") for cell in found.cells)
    nbclient.NotebookClient(found, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    kinds = {kind for cell in found.cells for out in cell.get("outputs", ()) for kind in out.get("data", ())}
    expected = {"one_decision.ipynb": {"image/png", "text/html"}}
    assert expected.get(path.name, {"application/vnd.jupyter.widget-view+json"}) <= kinds
