"""Runs in notebooks: what a recording shows of itself, and a widget with the renderer of the view."""

import html
from typing import Any, Final

from slalom.errors import InvalidInput
from slalom.live.export import messages
from slalom.live.page import block, file_page, renderer
from slalom.live.recorded import recorded
from slalom.live.scene import Scene, series
from slalom.methods import Method
from slalom.sim.measure.recording import Recording
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
        scene.frames(steps, 0, recording.arrived, complete=True),
        series(found.scenario, steps, 0),
    ]


def widget(run: Recording | Scenario, method: Method | None = None, *, robot: int = 0) -> Any:
    """Return the view of a run as a widget for notebooks.

    Args:
        run: a recording, or a scenario, which is then simulated. method: of the robots of a scenario.
        robot: the one whose control space is shown.

    Raises:
        InvalidInput: a scenario without a method, a recording with one, a run without a step, no such robot, or
            anywidget is not installed (`pip install slalom[notebook]`).
    """
    if isinstance(run, Scenario) == (method is None):
        raise InvalidInput("method: expected one with a scenario, and none with a recording; found otherwise")
    try:
        import anywidget
        import traitlets
    except ModuleNotFoundError as error:
        needed = "expected the packages of `pip install slalom[notebook]`"
        raise InvalidInput(f"widget: {needed}, found no {error.name}") from None
    recording = simulate(run, method) if isinstance(run, Scenario) and method is not None else run
    assert isinstance(recording, Recording)

    class View(anywidget.AnyWidget):
        """The renderer, which reads `data`: the messages of a file."""

        _esm = renderer()
        data = traitlets.Bytes().tag(sync=True)

    return View(data=block(messages(recording, robot)))
