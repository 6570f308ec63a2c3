"""A scene, a server and pages for tests of the view."""

import asyncio
import contextlib
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from slalom import Disc, Limits, Obstacle, State
from slalom.live.messages import unpack
from slalom.model.goal import Goal
from slalom.model.trajectory import Circular, ConstantVelocity, Stationary
from slalom.sim.scenario import Robot, Scenario

WEB = Path(__file__).parents[2] / "web"
CHROMIUM = shutil.which("chromium")
QUIET = ("background-networking", "component-update", "sync")
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--no-first-run", *(f"--disable-{name}" for name in QUIET)]
APP = "document.getElementById('slalom').slalom"
in_browser = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: pages are not opened")


def crossing(duration: float = 1.0) -> Scenario:
    """A robot among three cars."""
    cars = (
        Obstacle(Disc(1.0), Circular((10, 0), 6.0, 4.0, 2.5), "a"),
        Obstacle(Disc(0.8), ConstantVelocity((12, 4), (-2, -1)), "b"),
        Obstacle(Disc(0.5), Stationary((7, -1.2)), "c"),
    )
    robot = Robot(Disc(0.5), Limits(4.0, 3.0), State((0, 0), (3, 0)), Goal(Stationary((20, 0)), 0.5))
    return Scenario("crossing", (robot,), cars, duration=duration)


def kinds(found: list[bytes]) -> list[str]:
    return [unpack(message)[0]["kind"] for message in found]


def drawn_region(arrays: dict[str, np.ndarray]) -> shapely.Geometry:
    """What the renderer fills: the outer curves, which run counter-clockwise, without the holes of each obstacle."""
    outer, holes = {}, {}
    for owner, ring in zip(arrays["owners0"].tolist(), np.split(arrays["rings0"], arrays["ends0"][:-1])):
        kind = outer if shapely.LinearRing(ring).is_ccw else holes
        kind.setdefault(owner, []).append(shapely.make_valid(shapely.Polygon(ring)))
    return shapely.union_all(
        [
            shapely.difference(shapely.union_all(filled), shapely.union_all(holes.get(owner, [])))
            for owner, filled in outer.items()
        ]
    )


@contextlib.contextmanager
def serving(*arguments: str) -> Iterator[str]:
    """The address of a server, which Ctrl-C must stop within seconds."""
    pytest.importorskip("uvicorn", reason="slalom[view] is not installed: the server is not tested")
    pytest.importorskip("websockets", reason="slalom[view] is not installed: the server is not tested")
    command = [sys.executable, "-m", "slalom", "view", *arguments, "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline().strip()
    except BaseException:
        process.kill()
        process.communicate()
        raise
    process.send_signal(signal.SIGINT)
    assert process.wait(20) == 0
    process.stdout.close()


def socket_address(address: str) -> tuple[str, str]:
    """The address of the connection, and the origin of the page."""
    origin, _, query = address.partition("/?")
    return f"{origin.replace('http', 'ws')}/messages?{query}", origin


async def first_messages(url: str, origin: str, *sent: str, count: int = 4, **options: Any) -> list[bytes]:
    """The first messages of a connection, without the notice that kernels compile."""
    import websockets

    found: list[bytes] = []
    async with websockets.connect(url, origin=origin, max_size=None, **options) as connection:  # type: ignore[arg-type]
        for text in sent:
            await connection.send(text)
        while len(found) < count:
            message = await asyncio.wait_for(connection.recv(), 90)
            found += [message] if kinds([message]) != ["note"] else []  # type: ignore[list-item]
    return found


@contextlib.contextmanager
def opened(**context: Any) -> Iterator[tuple[Any, list[str]]]:
    """A page of Chromium, and the errors of its console so far."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed: pages are not opened")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        with contextlib.closing(browser):
            page = browser.new_context(bypass_csp=True, **context).new_page()
            troubles: list[str] = []
            page.on("pageerror", lambda error: troubles.append(str(error)))
            page.on("console", lambda message: troubles.append(message.text) if message.type == "error" else None)
            yield page, troubles
