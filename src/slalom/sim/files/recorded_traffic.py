"""Scenarios from recordings: recorded agents as the obstacles of one robot. They do not react to it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.checks import number, positive, vector
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.io.formats import FORMATS, read_recording
from slalom.io.recorded import Agent, Tracks, named
from slalom.limits import Limits
from slalom.obstacle import Obstacle
from slalom.shape import round_shape
from slalom.sim.scenario import Robot, Scenario
from slalom.state import State
from slalom.trajectory import Stationary

UNKNOWN: Final[Mapping[int, str]] = {2: "pedestrian", 3: "drone"}
"""What agents are taken for of which neither the file nor its format says it, by their dimension."""

RADII: Final[Mapping[str, float]] = {
    "pedestrian": 0.25,
    "bicycle": 0.95,
    "motorcycle": 1.2,
    "car": 2.4,
    "van": 3.0,
    "truck": 6.2,
    "bus": 6.2,
    "ship": 50.0,
    "aircraft": 30.0,
    "drone": 0.3,
}
"""[m] Of agents of which nobody says how large they are: half the diagonal of a usual one, 4.5 x 1.8 m for a car."""

WORDS: Final[Mapping[str, str]] = {
    "pedestrian/bicycle": "bicycle",
    "bicyclist": "bicycle",
    "truck_bus": "bus",
    "taxi": "car",
    "priorityvehicle": "car",
    "parkedvehicle": "car",
    "trailer": "truck",
}
"""What files call kinds of RADII in other words."""

LONGEST: Final = 60.0
"""[s] Duration of a run, as of every scenario, if the recording lasts so long."""


class Recorded(NamedTuple):
    """The agents of a recording as obstacles.

    Attributes:
        name: of the file. obstacles: called agent and the id. span: [s] the first and the last time of the recording.
        dimension: 2 or 3. notes: what was repaired, left out or assumed.
    """

    name: str
    obstacles: tuple[Obstacle, ...]
    span: tuple[float, float]
    dimension: int
    notes: tuple[str, ...]


@dataclass(frozen=True)
class AgentSelection:
    """Who of a recording is an obstacle, and how large.

    Attributes:
        radius: [m] of agents of which the file does not say it. agents: ids; None for all. without: ids to leave out.
    """

    radius: float | None = None
    agents: Sequence[str] | None = None
    without: Sequence[str] = ()


def read_recorded(path: Path | str, who: AgentSelection | None = None, **reading: Any) -> Recorded:
    """The agents of a recording of any format as discs, or balls in space.

    The radius of an agent is its own if the file has one; else that of `who`; else half the diagonal of its length and
    width; else that of its kind in RADII, which is noted.

    Args:
        reading: see `io.formats.read_recording`.

    Raises:
        InvalidFile: no such file, or rows that make no tracks. InvalidInput: settings that the format does not have, an
            id that there is not.
    """
    path, who = Path(path), who or AgentSelection()
    tracks = read_recording(path, **reading)
    spans = np.array([agent.trajectory.span for agent in tracks.agents.values()])
    agents = chosen(tracks, who, path.name).agents
    radii, notes = _radii(agents, FORMATS[tracks.format].agents, who.radius)
    d = next(iter(tracks.agents.values())).trajectory.dimension
    obstacles = [Obstacle(round_shape(radii[k], d), agent.trajectory, f"agent {k}") for k, agent in agents.items()]
    said = tuple(f"{path.name}: {note}" for note in (*tracks.notes, *notes))
    return Recorded(path.stem, tuple(obstacles), (float(spans[:, 0].min()), float(spans[:, 1].max())), d, said)


def chosen(tracks: Tracks, who: AgentSelection, name: str) -> Tracks:
    """Those agents of the tracks of a file of that name, with all parts of a track that was split.

    Raises:
        InvalidInput: an id that there is not.
    """
    for what, asked in (("agents", who.agents or ()), ("without", who.without)):
        for label in asked:
            if label not in tracks.agents and label not in tracks.parts:
                raise InvalidInput(f"{what}: expected ids of {name}, {named(tracks.agents)}; found {label!r}")
    wanted, unwanted = (
        {part for label in asked for part in (label, *tracks.parts.get(label, ()))}
        for asked in (tracks.agents if who.agents is None else who.agents, who.without)
    )
    some = wanted - unwanted
    return replace(tracks, agents={label: agent for label, agent in tracks.agents.items() if label in some})


def _radii(agents: Mapping[str, Agent], kind: str, given: float | None) -> tuple[dict[str, float], list[str]]:
    """The radius of each agent [m], and notes on what was assumed; `kind` is what they are in files of the format."""
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
            what = _kind(agent.kind, kind or UNKNOWN[agent.trajectory.dimension])
            radii[label] = max(RADII[what], 0.5 * (agent.length or agent.width or 0.0))
            assumed.setdefault((what, radii[label]), []).append(label)
    notes = [f"size of {named(who)} not known: radius {r:g} m, as of a {what}" for (what, r), who in assumed.items()]
    kept = [label for label, agent in agents.items() if given is not None and agent.radius not in (None, given)]
    if kept:
        notes.append(f"radius of {named(kept)} as in the file, not the {given:g} m given")
    return radii, notes


def _kind(said: str, otherwise: str) -> str:
    """A kind of RADII: what the file says of the agent, or otherwise."""
    word = said.strip().lower()
    word = WORDS.get(word, word)
    return word if word in RADII else otherwise


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
    """One robot, a disc or a ball, that goes from `start` to `goal` (d,) [m] among recorded agents.

    Args:
        at: [s] when it begins, in the recording's own time; its first if None. velocity: (d,) [m/s] at the start, zero
            if None. radius, tolerance: [m]. max_speed: [m/s]. max_acceleration: [m/s^2].
        duration: [s]; until the recording ends, but at most LONGEST, if None.

    Raises:
        InvalidInput: numbers that do not fit each other or the recording.
    """
    d, (first, last) = recorded.dimension, recorded.span
    begin = first if at is None else number(at, "at")
    if not first <= begin < last:
        raise InvalidInput(
            f"at: expected a time of {recorded.name}, from {first:g} to before {last:g} s, found {begin:g} s"
        )
    speed = vector(np.zeros(d) if velocity is None else velocity, "start velocity", d)
    state = State(vector(start, "start", d), speed)
    there = Goal(Stationary(vector(goal, "goal", d)), positive(tolerance, "tolerance"))
    limits = Limits(positive(max_speed, "speed"), positive(max_acceleration, "acceleration"))
    return Scenario(
        recorded.name,
        (Robot(round_shape(radius, d), limits, state, there),),
        recorded.obstacles,
        start=begin,
        duration=min(LONGEST, last - begin) if duration is None else duration,
        recorded=recorded.span,
        notes=recorded.notes,
    )


def ends_before(scenario: Scenario, end: float) -> list[str]:
    """A note if a run of a scenario that went on until `end` [s] outlasted what was recorded."""
    if scenario.recorded is None or end <= scenario.recorded[1] + 1e-9 * abs(end):
        return []
    last = scenario.recorded[1]
    return [
        f"{scenario.name}: the recording, or what is used of it, ends at {last:g} s, before the run does at {end:g} s"
    ]
