"""Runs in notebooks: what a recording shows of itself, and a widget with the renderer of the view."""

import html
from typing import Any, Final

from slalom.base.checks import flag, whole
from slalom.base.errors import Extra, InvalidInput
from slalom.decision.methods import METHODS, Method
from slalom.live.messages import Scene, block, file_page, pack, renderer, series
from slalom.live.recorded import how_ended, messages
from slalom.live.session import Session
from slalom.sim.measure.recording import Recording
from slalom.sim.run.recorded import recorded
from slalom.sim.run.simulate import simulate
from slalom.sim.scenario import Scenario

LARGEST: Final = 1_500_000
"""[byte] Largest page that a recording shows of itself, so that notebooks stay small."""
CONTROLS: Final = 24
"""[1] About the number of control spaces on that page."""
MOST_ROBOTS: Final = 200
"""[1] Number of robots above which that page holds no control spaces, which would take long."""
HEIGHT: Final = 660
"""[pixel] Height of the view in a notebook."""


def shown(recording: Recording) -> str:
    """Return the HTML that shows a run in a notebook: the view in a frame of its own, or a sentence if it is large."""
    steps, n = len(recording.accelerations), len(recording.shapes)
    title = f"{recording.scenario}, {recording.method}"
    said = f"<p>{html.escape(title)}: number of robots {n}, of steps {steps}.</p>"
    if not steps:
        return said
    for controls in (True, False) if n <= MOST_ROBOTS else (False,):
        page = file_page(title, _coarse(recording) if controls else _motion(recording))
        if len(page) <= LARGEST:
            style = f"width:100%;height:{HEIGHT}px;border:0"
            return f'<iframe sandbox="allow-scripts" style="{style}" srcdoc="{html.escape(page)}"></iframe>'
    return said


def _coarse(recording: Recording) -> list[bytes]:
    """The messages of a run, with about CONTROLS control spaces."""
    duration = float(recording.times[-1] - recording.times[0])
    return list(messages(recording, interval=max(recording.dt, duration / CONTROLS)))


def _motion(recording: Recording) -> list[bytes]:
    """The messages of a run without control spaces."""
    found = recorded(recording)
    scene, steps = Scene(found.scenario, found.steps), [*found.steps, found.end]
    return [
        scene.message(recording.method, live=False, notes=found.notes, extra={"chosen": 0}),
        scene.frames(steps, 0, recording.arrived, how_ended(found)),
        series(found.scenario, steps, 0),
    ]


def widget(run: Recording | Scenario, method: Method | None = None, *, robot: int = 0, live: bool = False) -> Any:
    """Return the view of a run as a widget for notebooks.

    Args:
        run: a recording, or a scenario, which is then simulated. method: of the robots of a scenario.
        robot: the one whose control space is shown.
        live: whether the scene can be changed, as in `slalom view`; the kernel of the notebook then answers.

    Raises:
        InvalidInput: a scenario without a method, a recording with one, a run without a step, no such robot, or
            anywidget is not installed (`pip install 'slalom[notebook]'`).
    """
    if isinstance(run, Scenario) == (method is None):
        raise InvalidInput("method: expected one with a scenario, and none with a recording; found otherwise")
    flag(live, "live")
    with Extra("notebook", "widget"):
        import anywidget
        import traitlets

    class View(anywidget.AnyWidget):
        """The renderer, which reads `data`: the messages of a file; a live one exchanges messages."""

        _esm = renderer()
        data = traitlets.Bytes().tag(sync=True)
        live = traitlets.Bool().tag(sync=True)

    if live:
        session = _session(run, method, robot)
        made = View(data=b"", live=True)
        made.on_msg(lambda sender, command, buffers: _answer(sender, session, command))
        return made
    recording = simulate(run, method) if isinstance(run, Scenario) and method is not None else run
    assert isinstance(recording, Recording)
    return View(data=block(messages(recording, robot)), live=False)


def _session(run: Recording | Scenario, method: Method | None, robot: int) -> Session:
    """The session of a live widget, with a robot selected."""
    if isinstance(run, Scenario) and method is not None:
        session = Session(run, method)
    else:
        assert isinstance(run, Recording)
        session = Session.of(recorded(run), METHODS["nao"])
    if whole(robot, "robot") >= len(session.scenario.robots):
        raise InvalidInput(f"robot: expected one of 0 to {len(session.scenario.robots) - 1}, found {robot}")
    session.robot = robot
    return session


def _answer(sender: Any, session: Session, command: Any) -> None:
    """Send the messages that answer a command of the page: `open`, `more`, or one of `Session.answer`."""
    given = command if isinstance(command, dict) else {}
    try:
        if given.get("do") == "open":
            found = session.opening()
        else:
            found = session.more() if given.get("do") == "more" else session.answer(given)
    except InvalidInput as error:
        found = [pack("error", {"text": str(error)}, {})]
    sender.send({"complete": session.complete}, buffers=found)
