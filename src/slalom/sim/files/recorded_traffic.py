"""Scenarios from recordings: recorded agents as obstacles of one robot, without reaction to it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import number, positive, shown, vector
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import WHOLE_COUNT
from slalom.io.formats import FORMATS, read_recording
from slalom.io.recorded import DEFAULT_KINDS, RADII, Agent, RecordedTracks, counted, kind_of, named
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.shape import Polyline, round_shape
from slalom.model.state import State
from slalom.model.trajectory import Sampled, Stationary
from slalom.obstacle import Obstacle
from slalom.sim.measure.recording import Recording
from slalom.sim.scenario import Robot, Scenario

MAX_DURATION: Final = 60.0
"""[s] Duration of a run, unless the recording ends before. It is the default of every scenario."""


@dataclass(frozen=True)
class Recorded:
    """The agents of a recording as obstacles.

    Attributes:
        name: of the file. obstacles: with names "agent ID". span: [s] the first and the last time of the recording.
        dimension: 2 or 3. notes: repairs, omissions and assumptions, a sentence each.
    """

    name: str
    obstacles: tuple[Obstacle, ...]
    span: tuple[float, float]
    dimension: int
    notes: tuple[str, ...]


@dataclass(frozen=True)
class AgentSelection:
    """Agents of a recording that become obstacles, and their default radius.

    Attributes:
        radius: [m] of agents without one in the file. agents: ids; None for all. without: ids to leave out.
    """

    radius: float | None = None
    agents: Sequence[str] | None = None
    without: Sequence[str] = ()


def read_recorded(path: Path | str, selection: AgentSelection | None = None, **reading: Any) -> Recorded:
    """Return the agents of a recording of any format as discs, or balls in space.

    The radius of an agent is the first available one of four: its own in the file, that of `selection`, half the
    diagonal of its length and width, that of its kind in RADII. The last is noted.

    Args:
        reading: see `io.formats.read_recording`.

    Raises:
        InvalidFile: no such file, or rows that make no tracks. InvalidInput: unknown settings or ids.
    """
    path, selection = Path(path), selection or AgentSelection()
    tracks = read_recording(path, **reading)
    spans = np.array([agent.trajectory.span for agent in tracks.agents.values()])
    agents = chosen(tracks, selection, path.name).agents
    radii, notes = radii_of(agents, FORMATS[tracks.format].agents, selection.radius)
    d = next(iter(tracks.agents.values())).trajectory.dimension
    obstacles = [Obstacle(round_shape(radii[k], d), agent.trajectory, f"agent {k}") for k, agent in agents.items()]
    if tracks.walls:
        obstacles += [
            Obstacle(Polyline(wall), Stationary((0.0, 0.0)), f"wall {k}") for k, wall in enumerate(tracks.walls)
        ]
        notes.append(f"{counted(len(tracks.walls), 'wall')}: obstacles at rest")
    noted = tuple(f"{path.name}: {note}" for note in (tracks.summary(), *tracks.notes, *notes))
    return Recorded(path.stem, tuple(obstacles), (float(spans[:, 0].min()), float(spans[:, 1].max())), d, noted)


def chosen(tracks: RecordedTracks, selection: AgentSelection, name: str) -> RecordedTracks:
    """Return the selected agents of the tracks of the file `name`, with all parts of a split track.

    Raises:
        InvalidInput: an unknown id.
    """
    for key, labels in (("agents", selection.agents or ()), ("without", selection.without)):
        for label in labels:
            if label not in tracks.agents and label not in tracks.parts:
                raise InvalidInput(f"{key}: expected ids of {name}, {named(tracks.agents)}; found {label!r}")
    wanted, unwanted = (
        {part for label in labels for part in (label, *tracks.parts.get(label, ()))}
        for labels in (tracks.agents if selection.agents is None else selection.agents, selection.without)
    )
    kept = wanted - unwanted
    return replace(tracks, agents={label: agent for label, agent in tracks.agents.items() if label in kept})


def radii_of(agents: Mapping[str, Agent], kind: str, given: float | None) -> tuple[dict[str, float], list[str]]:
    """Return the radius of each agent [m] and notes on assumptions; `kind` is the kind of agents of the format."""
    radii: dict[str, float] = {}
    assumed: dict[tuple[str, float], list[str]] = {}
    for label, agent in agents.items():
        if agent.radius is not None:
            radii[label] = agent.radius
        elif given is not None:
            radii[label] = given
        elif agent.length is not None and agent.width is not None:
            radii[label] = 0.5 * float(np.hypot(agent.length, agent.width))
        else:
            found = _kind(label, agent.kind, kind or DEFAULT_KINDS[agent.trajectory.dimension])
            radii[label] = max(RADII[found], 0.5 * (agent.length or agent.width or 0.0))
            assumed.setdefault((found, radii[label]), []).append(label)
    notes = [f"size of {named(ids)} not known: radius {r:g} m, as of a {word}" for (word, r), ids in assumed.items()]
    kept = [label for label, agent in agents.items() if given is not None and agent.radius not in (None, given)]
    if kept:
        notes.append(f"radius of {named(kept)} as in the file, not the {given:g} m given")
    return radii, notes


def _kind(label: str, written: str, default: str) -> str:
    """Return a kind of RADII: the one that the file names, or the default if it names none.

    Kinds of ships and aircraft are codes of their own. Raises InvalidInput for another word.
    """
    word = kind_of(written) or default
    if word in RADII or default in ("ship", "aircraft"):
        return word if word in RADII else default
    kinds = ", ".join(RADII)
    raise InvalidInput(f"agent {label}: expected a kind of {kinds}, or --agent-radius; found {shown(written)}")


def crossing(
    recorded: Recorded,
    start: npt.ArrayLike,
    goal: npt.ArrayLike,
    *,
    at: float | None = None,
    velocity: npt.ArrayLike | None = None,
    radius: float = 0.3,
    max_speed: float = 1.6,
    max_acceleration: float = 1.5,
    tolerance: float = 0.5,
    duration: float | None = None,
) -> Scenario:
    """Return a scenario of one robot, a disc or a ball, from `start` to `goal` (d,) [m] among recorded agents.

    Args:
        at: [s] start of the run in the time of the recording; its first if None. velocity: (d,) [m/s] at the start,
            zero if None. radius, tolerance: [m]. max_speed: [m/s]. max_acceleration: [m/s^2].
        duration: [s]; until the end of the recording, at most MAX_DURATION, if None.

    Raises:
        InvalidInput: numbers that contradict each other or the recording.
    """
    d, (first, last) = recorded.dimension, recorded.span
    begin = first if at is None else number(at, "at")
    if not first <= begin < last:
        raise InvalidInput(
            f"at: expected a time of {recorded.name}, from {first:g} to before {last:g} s, found {begin:g} s"
        )
    initial_velocity = vector(np.zeros(d) if velocity is None else velocity, "start velocity", d)
    state = State(vector(start, "start", d), initial_velocity)
    target = Goal(Stationary(vector(goal, "goal", d)), positive(tolerance, "tolerance"))
    limits = Limits(positive(max_speed, "speed"), positive(max_acceleration, "acceleration"))
    return Scenario(
        recorded.name,
        (Robot(round_shape(radius, d), limits, state, target),),
        recorded.obstacles,
        start=begin,
        duration=min(MAX_DURATION, last - begin) if duration is None else duration,
        recorded=recorded.span,
        notes=recorded.notes,
    )


def observed(recorded: Recorded) -> Recording:
    """Return the agents of a recording as robots that moved so, at even times as far apart as most rows."""
    agents = [one for one in recorded.obstacles if isinstance(one.trajectory, Sampled)]
    stamps = [one.trajectory.times for one in agents if isinstance(one.trajectory, Sampled)]
    step = float(np.median(np.concatenate([np.diff(times) for times in stamps])))
    first, last = recorded.span
    times = first + step * np.arange(int((last - first) / step + WHOLE_COUNT * (last - first) / step) + 1)
    motion = np.full((2, len(times), len(agents), recorded.dimension), np.nan)
    for k, one in enumerate(agents):
        begin, end = one.trajectory.span
        slack = WHOLE_COUNT * max(1.0, abs(last))
        rows = np.flatnonzero((times >= begin - slack) & (times <= end + slack))
        within = np.clip(times[rows], begin, end)
        motion[:, rows, k] = one.trajectory.position(within), one.trajectory.velocity(within)
    there = np.isfinite(motion[0, :, :, 0]).sum(axis=0) > 1
    return Recording.from_tracks(
        times,
        motion[0][:, there],
        [one.shape.bounding_radius for one, some in zip(agents, there) if some],
        velocities=motion[1][:, there],
        walls=[one for one in recorded.obstacles if not isinstance(one.trajectory, Sampled)],
        names=[one.name for one, some in zip(agents, there) if some],
        name=recorded.name,
    )


def ends_before(scenario: Scenario, end: float) -> list[str]:
    """Return a note if a run of a scenario until `end` [s] outlasted the recording; else none."""
    if scenario.recorded is None or end <= scenario.recorded[1] + WHOLE_COUNT * abs(end):
        return []
    last = scenario.recorded[1]
    return [
        f"{scenario.name}: the used part of the recording ends at {last:g} s, before the end of the run at {end:g} s"
    ]
