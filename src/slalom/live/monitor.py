"""The view of a program of the user: its decisions in the browser, as they are made."""

from collections.abc import Mapping
from threading import Condition, Thread
from time import monotonic, thread_time
from typing import Any, Final

from slalom.base.checks import has, number, positive
from slalom.base.errors import Extra, InvalidInput
from slalom.decision import Decision
from slalom.live.messages import pack, series
from slalom.live.recorded import of_decision
from slalom.live.session import Session

with Extra("view", "attach"):
    from slalom.live.server import Server

SHARE: Final = 0.05
"""[1] Share of the time that the view may compute, by default. Larger: more pictures. Smaller: less load."""
PATIENCE: Final = 0.1
"""[s] A page waits this long for the next decision before it reads its commands. Larger: slower answers."""
TITLE: Final = "decisions"
LOOKS: Final = ("look", "select", "response", "compare", "yaml")
"""Commands of the page that change no scene; a drag of the control is one too."""


class Monitor:
    """A view of decisions in the browser, which another thread serves.

    `show` notes a decision and returns at once. Of the decisions that come while a picture is made only the latest is
    drawn. After a picture that took t [s] of computing, the view rests for t (1 / share - 1), so that it takes at most
    this share of one core from the loop. Without an open page nothing is computed.

    Attributes:
        address: of the page, with its token. shown: number of decisions that `show` took. drawn: of pictures.
    """

    def __init__(self, port: int = 0, share: float = SHARE) -> None:
        if positive(share, "share") > 1.0:
            raise InvalidInput(f"share: expected at most 1, found {number(share, 'share'):g}")
        self.share = share
        self.shown = self.drawn = 0
        self._latest: Decision | None = None
        self._news, self._closed = Condition(), False
        self._rests = 0.0
        self._server = Server(lambda: Following(self), TITLE, port)
        self.address = self._server.address
        self._thread = Thread(target=self._server.run, name="slalom-view", daemon=True)
        self._thread.start()

    def show(self, decision: Decision) -> None:
        """Show a decision of a `Navigator`, a `LookAhead` or a `VehicleNavigator`; it never waits for a page.

        Raises:
            InvalidInput: something else than such a decision.
        """
        plan = getattr(decision, "plan", decision)
        has(plan, ("inputs", "manoeuvre", "outcome"), "a decision of a navigator", "decision")
        with self._news:
            self._latest, self.shown = plan, self.shown + 1
            self._news.notify_all()

    def newest(self, after: int, seconds: float) -> tuple[int, Decision] | None:
        """Return number and decision of the latest one that is later than number `after`; wait for it for a time [s].

        None if none comes. Raises InvalidInput after `close`.
        """
        with self._news:
            self._news.wait_for(lambda: self._closed or self.shown > after, seconds)
            if self._closed:
                raise InvalidInput("monitor: expected an open one, found a closed one")
            return None if self._latest is None or self.shown <= after else (self.shown, self._latest)

    def rest(self, seconds: float) -> None:
        """Wait for a time [s], or until `close`."""
        with self._news:
            self._news.wait_for(lambda: self._closed, seconds)

    def resting(self) -> float:
        """Return the time [s] for which the view rests still."""
        return max(0.0, self._rests - monotonic())

    def took(self, seconds: float) -> None:
        """Note a picture that took a time [s] of computing, and begin the rest after it."""
        self.drawn += 1
        self._rests = monotonic() + seconds * (1.0 / self.share - 1.0)

    def close(self) -> None:
        """Stop the server and its thread."""
        with self._news:
            self._closed = True
            self._news.notify_all()
        self._server.stop()
        self._thread.join()

    def __enter__(self) -> "Monitor":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def attach(port: int = 0, *, share: float = SHARE) -> Monitor:
    """Serve a page that shows the decisions of a program, and return its `Monitor`; the program calls `show`.

    Args:
        port: of this machine, at which the page is served; 0 for any free one. share: most time [1] of one core that
            the view takes for computing. A robot that waits between its decisions can give more.

    Raises:
        InvalidInput: not a port, or one that is not free; a share that is not above 0 and at most 1.
    """
    return Monitor(port, share)


class Following(Session):
    """The latest decision of a monitor as a scene of one step. The page cannot change it."""

    complete = False

    def __init__(self, monitor: Monitor) -> None:
        self._monitor, self._number = monitor, 0
        found = None
        while found is None:
            found = monitor.newest(0, 10.0 * PATIENCE)
        self._take(*found)

    def _take(self, number: int, decision: Decision) -> None:
        """Show a decision in place of the one before, in the same box as long as the robot and its goal lie in it."""
        shown, before = of_decision(decision, TITLE), self.__dict__.get("_box")
        assert shown.method is not None
        compared, response = self.__dict__.get("compared"), self.__dict__.get("response", -1)
        super().__init__(shown.scenario, shown.method, shown)
        self._number = number
        self.compared, self.response = compared, response
        own = shown.scenario.robot
        places = (own.state.position, own.goal.position(shown.scenario.start))
        if before is not None and all((before.low <= p).all() and (p <= before.high).all() for p in places):
            self._box = before
            self._begin()

    def more(self, count: int = 0) -> list[bytes]:
        """Return the messages of the next decision; none if none comes within PATIENCE, or while the view rests.

        With a count: those of the only step, which `opening` asks for.
        """
        if count:
            return self._frames()
        rest = self._monitor.resting()
        if rest > 0.0:
            self._monitor.rest(min(rest, PATIENCE))
            return []
        found = self._monitor.newest(self._number, PATIENCE)
        if found is None:
            return []
        begun = thread_time()
        self._take(*found)
        messages = self.opening()
        self._monitor.took(thread_time() - begun)
        return messages

    def _frames(self) -> list[bytes]:
        """Return the only step; the run does not end with it."""
        steps = self._played.steps
        frames = self._scene.frames(steps, 0, self._played.arrived, None)
        return [frames, series(self.scenario, steps, self.robot)]

    def answer(self, command: Mapping[str, Any]) -> list[bytes]:
        if command.get("do") not in LOOKS and not (command.get("do") == "drag" and command.get("what") == "control"):
            return [pack("error", {"text": "This view follows a program, which takes no changes."}, {})]
        return super().answer(command)
