"""The view of a program: decisions of a loop in the browser, which never wait for it."""

import asyncio
import json
import time
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest
from live_views import APP, crossing, in_browser, kinds, opened, socket_address

import slalom
from slalom import InvalidInput, State
from slalom.live import monitor as monitors
from slalom.live.messages import unpack
from slalom.live.monitor import PATIENCE, Following, Monitor

pytest.importorskip("uvicorn", reason="slalom[view] is not installed: the server is not tested")
websockets = pytest.importorskip("websockets", reason="slalom[view] is not installed: the server is not tested")
SCENE = crossing()
NAVIGATOR = SCENE.navigator(slalom.method("nao"))


def decided(x: float, previous: Any = None) -> Any:
    """A decision at x [m] of the robot."""
    return NAVIGATOR.decide(State((x, 0), (3, 0)), SCENE.obstacles, SCENE.robot.goal, now=0.1, previous=previous)


def places(messages: list[bytes]) -> list[float]:
    """Where the robot is in the frames of some messages [m]."""
    found = [unpack(message) for message in messages]
    return [arrays["positions"][0, 0, 0] for fields, arrays in found if fields["kind"] == "frames"]


async def watched(address: str, begin: Event, until: float) -> list[bytes]:
    """The messages of a page until the robot is at a place [m]."""
    url, origin = socket_address(address)
    found: list[bytes] = []
    async with websockets.connect(url, origin=origin, max_size=None) as connection:
        while not places(found) or abs(places(found)[-1] - until) > 2e-3:
            found.append(await asyncio.wait_for(connection.recv(), 60))
            begin.set()
    return [message for message in found if kinds([message]) != ["note"]]


def test_a_page_shows_the_decisions_of_a_loop() -> None:
    """The first, and in the end the last; each with its own control space, which is that of the decision."""
    with slalom.live.attach(share=1.0) as monitor:
        begun, last = Event(), 1.5
        first = decided(0.5)
        monitor.show(first)
        found: list[bytes] = []
        page = Thread(target=lambda: found.extend(asyncio.run(watched(monitor.address, begun, last))))
        page.start()
        assert begun.wait(60)
        for x in np.linspace(0.6, last, 10):
            shown = decided(x)
            monitor.show(shown)
        page.join(60)
        assert not page.is_alive()
        assert monitor.shown == 11
    assert places(found)[0] == pytest.approx(0.5, abs=1e-3)
    assert places(found)[-1] == pytest.approx(last, abs=1e-3)
    assert kinds(found[:4]) == ["scene", "frames", "series", "control"]
    controls = [unpack(message)[0] for message in found if kinds([message]) == ["control"]]
    np.testing.assert_allclose(controls[0]["chosen"], first.manoeuvre.control, atol=1e-6)
    if kinds(found[-1:]) == ["control"]:
        np.testing.assert_allclose(controls[-1]["chosen"], shown.manoeuvre.control, atol=1e-6)


def test_the_loop_never_waits_and_stale_decisions_are_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    """A page whose drawing hangs takes nothing from the loop; it then draws the latest decision only."""
    hangs, goes_on, opening = Event(), Event(), Following.opening

    def slow(self: Following, answers: int = 0) -> list[bytes]:
        hangs.set()
        assert goes_on.wait(60)
        return opening(self, answers)

    with Monitor(share=1.0) as monitor:
        monitor.show(decided(0.5))
        following = Following(monitor)
        monkeypatch.setattr(Following, "opening", slow)
        monitor.show(decided(0.6))
        made: list[bytes] = []
        drawing = Thread(target=lambda: made.extend(following.more()))
        drawing.start()
        assert hangs.wait(60)
        decisions = [decided(x) for x in (0.7, 0.8, 0.9)]
        for decision in decisions:  # were one of them to wait for the page, the test would not end
            monitor.show(decision)
        goes_on.set()
        drawing.join(60)
        assert places(made) == pytest.approx([0.6], abs=1e-3)
        time.sleep(monitor.resting())
        assert places(following.more()) == pytest.approx([0.9], abs=1e-3)
        assert (monitor.shown, monitor.drawn) == (5, 2)
        assert following.more() == []


def test_the_view_rests_in_proportion_to_its_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """By counted clocks: computing is at most the share of the time, however long a picture takes."""
    wall, worked = [0.0], [0.0]
    costs = iter([0.02, 0.3, 0.001, 0.08, 0.02])

    def opening(self: Following, answers: int = 0) -> list[bytes]:
        cost = next(costs)
        wall[0], worked[0] = wall[0] + cost, worked[0] + cost
        return [b""]

    with Monitor(share=0.05) as monitor:
        monitor.show(decided(0.5))
        following = Following(monitor)
        monkeypatch.setattr(Following, "opening", opening)
        monkeypatch.setattr(monitors, "monotonic", lambda: wall[0])
        monkeypatch.setattr(monitors, "thread_time", lambda: worked[0])
        monkeypatch.setattr(monitor, "rest", lambda seconds: wall.__setitem__(0, wall[0] + seconds))
        for _ in range(5):
            monitor.show(decided(0.6))
            while not following.more():
                assert monitor.resting() <= 0.3 * 19.0
            assert worked[0] <= 0.05 * (wall[0] + monitor.resting()) + 1e-9
        assert monitor.drawn == 5
        assert PATIENCE < 1.0


def test_a_page_cannot_change_a_program() -> None:
    """It may look, choose a response or a second method, and try a control."""
    with Monitor() as monitor:
        monitor.show(decided(0.5))
        following = Following(monitor)
        following.opening()
        for command in ({"do": "add", "to": [1, 1], "radius": 1}, {"do": "drag", "what": "goal", "index": 0}):
            assert unpack(following.answer({**command, "step": 0})[0])[0]["text"].startswith("This view follows a prog")
        tried = following.answer({"do": "drag", "what": "control", "to": [0.0, 0.0], "step": 0})
        assert kinds(tried) == ["probe"]
        both = following.answer({"do": "compare", "name": "vo", "step": 0})
        assert kinds(both) == ["control", "control"]
        monitor.show(decided(0.6))
        time.sleep(monitor.resting())
        assert kinds(following.more()) == ["scene", "frames", "series", "control", "control"]
        with pytest.raises(InvalidInput, match="decision: expected a decision of a navigator, found 3"):
            monitor.show(3)
    with pytest.raises(InvalidInput, match="share: expected at most 1, found 2"):
        Monitor(share=2.0)


@pytest.mark.browser
@in_browser
def test_the_page_follows_a_loop() -> None:
    """The robot is drawn where the last decision found it, without an error on the page."""
    with slalom.live.attach(share=1.0) as monitor, opened() as (page, troubles):
        monitor.show(decided(0.5))
        page.goto(monitor.address)
        page.wait_for_function(f"{APP}?.model.control()", timeout=60_000)
        for x in (0.6, 0.7, 0.8):
            monitor.show(decided(x))
            time.sleep(0.2)
        seen = f"{APP}.model.control()?.path !== undefined && {APP}.model.count"
        page.wait_for_function(f"{APP}.model.count === 1", timeout=60_000)
        assert json.dumps(page.evaluate(seen)) is not None
        assert troubles == []
