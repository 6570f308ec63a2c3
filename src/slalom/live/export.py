"""A recorded run as messages, and as one self-contained file."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from slalom.base.checks import positive, whole
from slalom.base.errors import InvalidInput
from slalom.live.control_space import Fields, control_message
from slalom.live.messages import file_page
from slalom.live.recorded import Recorded, recorded
from slalom.live.scene import Scene, series
from slalom.live.seen import Seen, Targets, decisions, seen_alone, seen_among, state_at
from slalom.sim.measure.recording import Recording

VIEW_EXPORT_INTERVAL: Final = 0.5
"""[s] Longest time between two control spaces of an exported run.

Larger: smaller files that show fewer decisions. Smaller: larger files.
"""

VIEW_EXPORTED: Final = 150
"""[1] Control spaces of an exported run, up to the rate of its decisions; more where VIEW_EXPORT_INTERVAL requires it.

Larger: larger files, about 6 kB for each among 30 obstacles. Smaller: longer steps between them in short runs.
"""


def export(
    recording: Recording,
    path: Path | str,
    *,
    robot: int = 0,
    interval: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Path:
    """Write a run as one HTML file that shows itself, without a server and without a request.

    Args:
        robot: the one whose control space is in the file.
        interval: [s] between two control spaces; by default every decision of a short run, and at least two a second.
        progress: called with the share that is done.

    Raises:
        InvalidInput: a run without a step, no such robot, an interval that is not above 0, another suffix than .html.
    """
    target = Path(path)
    if target.suffix != ".html":
        raise InvalidInput(f"path: expected a name ending in .html, found {str(path)!r}")
    title = f"{recording.scenario}, {recording.method}"
    target.write_text(file_page(title, messages(recording, robot, interval, progress)), encoding="utf-8")
    return target


def messages(
    recording: Recording,
    robot: int = 0,
    interval: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Iterator[bytes]:
    """Return all messages of a run, see `export`."""
    found = recorded(recording)
    chosen = robot_of(found, robot)
    scene = Scene(found.scenario, found.steps)
    yield scene.message(recording.method, live=False, notes=found.notes, extra={"chosen": chosen})
    yield scene.frames([*found.steps, found.end], 0, recording.arrived, complete=True)
    yield series(found.scenario, [*found.steps, found.end], chosen)
    fields = Fields()
    for seen in looked_at(found, chosen, interval):
        yield control_message(seen, fields)
        if progress:
            progress((seen.step + 1) / len(found.steps))


def robot_of(found: Recorded, robot: int) -> int:
    """Return the index of a robot. Raises InvalidInput if there is no such robot."""
    count = len(found.scenario.robots)
    if whole(robot, "robot") >= count:
        raise InvalidInput(f"robot: expected one of 0 to {count - 1}, found {robot}")
    return robot


def looked_at(found: Recorded, robot: int, interval: float | None = None) -> Iterator[Seen]:
    """Return the decisions of a robot of a recorded run at some of its steps; none without a known method."""
    scenario = found.scenario
    steps = found.steps
    method = found.method
    if method is None:
        return
    if interval is None:
        interval = min(VIEW_EXPORT_INTERVAL, scenario.dt * len(steps) / VIEW_EXPORTED)
    every = scenario.steps_per_decision
    stride = max(1, int(positive(interval, "interval") / (every * scenario.dt) + 1e-9)) * every
    if len(scenario.robots) > 1:
        targets = Targets(scenario)
        for k in range(0, len(steps), stride):
            yield seen_among(scenario, method, steps, k, robot, targets.goal(steps, k, robot))
        return
    for k, decision in enumerate(decisions(scenario, method, steps)):
        if k % stride == 0:
            yield seen_alone(scenario, method, decision, k, state_at(steps, k, 0))
