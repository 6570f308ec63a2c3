"""Recorded tracks and decisions as runs, and the export of a run as messages and as one self-contained file."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from slalom.base.checks import positive, whole
from slalom.base.errors import InvalidInput
from slalom.base.writing import write_file
from slalom.decision import Decision
from slalom.decision.methods import Method
from slalom.decision.settings import NUMBERS
from slalom.live.control_space import Fields, control_message
from slalom.live.messages import Ended, Scene, ended, file_page, series
from slalom.live.seen import Seen, decided_again, is_absent
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.response import Acceleration, advance
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.sim.explanation import known_at
from slalom.sim.files.decision_file import read_decision
from slalom.sim.files.recorded_traffic import MAX_DURATION, Recorded as Tracks
from slalom.sim.measure.recording import Recording, Step
from slalom.sim.run.recorded import Recorded, last_state, recorded
from slalom.sim.scenario import Robot, Scenario, from_numbers

# An agent of a recording of tracks as a robot that moves as recorded, among the other agents.


STEP: Final = 0.1
"""[s] Between two states of the replay."""


def as_recorded(tracks: Tracks, method: Method, agent: str | None = None, at: float | None = None) -> Recorded:
    """Return the motion of one agent as a run whose decisions `method` makes in its recorded states.

    Its limits are the largest speed and acceleration of this motion, its goal is where it ends.

    Args:
        agent: id of the agent; by default that of the longest track. at: [s] start of the replay; by default that of
            the track. At most MAX_DURATION is replayed.

    Raises:
        InvalidInput: an unknown id, or a track without a step after `at`.
    """
    names = [obstacle.name for obstacle in tracks.obstacles]
    spans = np.array([obstacle.trajectory.span for obstacle in tracks.obstacles])
    k = int(np.argmax(spans[:, 1] - spans[:, 0]))
    if agent is not None:
        if f"agent {agent}" not in names:
            raise InvalidInput(f"--agent: expected the id of an agent of {tracks.name}, found {agent!r}")
        k = names.index(f"agent {agent}")
    own, others = tracks.obstacles[k], (*tracks.obstacles[:k], *tracks.obstacles[k + 1 :])
    first, last = max(spans[k, 0], -np.inf if at is None else at), spans[k, 1]
    count = int((min(last - first, MAX_DURATION)) / STEP + 1e-9)
    if count < 1:
        where = f"from {spans[k, 0]:g} to {last:g} s" if at is None else f"after {at:g} s"
        raise InvalidInput(f"{own.name}: expected a track of at least {STEP:g} s, found one {where}")
    times = np.minimum(first + STEP * np.arange(count + 1), last)
    positions, velocities = own.trajectory.position(times), own.trajectory.velocity(times)
    accelerations = np.diff(velocities, axis=0) / STEP
    fastest = float(np.linalg.norm(velocities, axis=1).max())
    hardest = float(np.linalg.norm(accelerations, axis=1).max())
    robot = Robot(
        own.shape,
        Limits(max(fastest, 0.1), max(hardest, 0.1)),
        State(positions[0], velocities[0]),
        Goal(Stationary(positions[-1]), 0.5),
        own.name,
    )
    told = f"{own.name} moves as recorded. The control space shows what {method.name} would decide in its place."
    scenario = Scenario(
        tracks.name, (robot,), others, dt=STEP, start=first, duration=count * STEP, notes=(*tracks.notes, told)
    )
    zero = np.zeros((1, tracks.dimension))
    blank = Step(zero, zero, zero, zero, ("",), ("",), np.zeros(1))
    moved = zip(positions[:-1, None], velocities[:-1, None], accelerations[:, None])
    steps = [blank._replace(positions=p, velocities=v, accelerations=a) for p, v, a in moved]
    end = last_state(positions[-1:], velocities[-1:])
    return Recorded(scenario, method, method.name, steps, end, times[-1:], ())


def of_file(path: Path | str) -> Recorded:
    """Return the decision of a file that `Decision.dump` wrote, made again, as `of_decision`.

    Raises:
        InvalidFile: mistakes in the file. InvalidInput: a scene that cannot run.
    """
    read = read_decision(path)
    decision, same = read.repeat()
    notes = [] if same else [f"The decision differs from the one that was written, with {read.versions}."]
    return of_decision(decision, Path(path).name, notes)


def of_decision(decision: Decision, name: str, notes: Sequence[str] = ()) -> Recorded:
    """Return a decision as a run of one step among the predicted obstacles.

    Raises:
        InvalidInput: a decision that no navigator made, or a scene that cannot run.
    """
    known, made = known_at(decision), decision.inputs
    assert made is not None
    navigator, notes = known.navigator, list(notes)
    if made.robots is not None and len(made.robots):
        notes.append(f"{len(made.robots)} observed robots, which share the avoidance, are not shown.")
    goal = Goal(Stationary(made.state.position)) if made.goal is None else made.goal
    robot = Robot(navigator.robot, navigator.limits, made.state, goal, objective=navigator.objective)
    scenario = Scenario(
        name,
        (robot,),
        tuple(known.blocked.obstacles.obstacles),
        start=made.now,
        duration=max(navigator.horizon, navigator.period),
        dt=navigator.period,
        holds=navigator.holds,
        **from_numbers({name: getattr(navigator, name) for name in NUMBERS}),
    )
    manoeuvre, none = decision.manoeuvre, np.zeros(1)
    acceleration = manoeuvre.mean_acceleration(made.now, navigator.period)
    step = Step(
        made.state.position[None],
        made.state.velocity[None],
        acceleration[None],
        manoeuvre.control[None],
        (manoeuvre.response,),
        (decision.outcome.name,),
        none,
    )
    after = advance(Acceleration(), made.state, acceleration, navigator.period)
    end = last_state(after.position[None], after.velocity[None])
    method = navigator.method
    return Recorded(scenario, method, method.name, [step], end, np.full(1, np.inf), tuple(notes), decision=decision)


VIEW_EXPORT_INTERVAL: Final = 0.5
"""[s] Longest time between two control spaces of an exported run. Larger: smaller files that show fewer decisions.
Smaller: larger files."""

VIEW_EXPORTED: Final = 150
"""[1] Control spaces of an exported run, up to the rate of its decisions; more where VIEW_EXPORT_INTERVAL requires it.
Larger: larger files, about 6 kB for each among 30 obstacles. Smaller: longer steps between them in short runs."""


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
    write_file(target, file_page(title, messages(recording, robot, interval, progress)))
    return target


def messages(
    recording: Recording, robot: int = 0, interval: float | None = None, progress: Callable[[float], None] | None = None
) -> Iterator[bytes]:
    """Return all messages of a run, see `export`."""
    found = recorded(recording)
    chosen = robot_of(found, robot)
    scene = Scene(found.scenario, found.steps)
    yield scene.message(recording.method, live=False, notes=found.notes, extra={"chosen": chosen})
    yield scene.frames([*found.steps, found.end], 0, found.arrived, how_ended(found))
    yield series(found.scenario, [*found.steps, found.end], chosen)
    fields = Fields()
    for seen in looked_at(found, chosen, interval):
        yield control_message(seen, fields)
        if progress:
            progress((seen.step + 1) / len(found.steps))


def how_ended(found: Recorded) -> Ended:
    """Return how a recorded run ended."""
    return ended(found.scenario, found.steps, found.end, found.arrived)


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
    for k, known in enumerate(decided_again(scenario, method, steps, found.seed)):
        if k % stride == 0 and not (scenario.robots[robot].appears and is_absent(scenario, steps, k, robot)):
            yield known.seen(steps, k, robot)
