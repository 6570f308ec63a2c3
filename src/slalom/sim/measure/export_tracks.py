"""A run as agents of a recording: as tracks, and as a table with a row for each."""

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import shapely

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.base.writing import replacing
from slalom.io.recorded import MAX_LISTED, Agent, RecordedTracks, tracks_at
from slalom.model.shape import Ball, Disc, Rectangle, Shape
from slalom.model.trajectory import Sampled, Trajectory
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import outline_parts
from slalom.sim.measure.closest_approach import between_robots, nearest_clearances
from slalom.sim.measure.metrics import extra_time, finite, path_length
from slalom.sim.measure.recording import Recording

ROBOT: Final = "robot"
"""Kind of robots, and name of the first one."""

_ID = re.compile(r"agent (.+)")
_WHOLE = re.compile(r"0|-?[1-9]\d{0,17}")


class _Body(NamedTuple):
    """A robot or an obstacle as an agent of a recording."""

    name: str
    shape: Shape
    motion: Trajectory
    kind: str


def as_tracks(recording: Recording, *, frames: bool = False) -> RecordedTracks:
    """Convert a run to tracks of its robots and obstacles, sampled at its steps.

    Times are those of the run; with `frames` they start at 0. A recorded agent keeps its id, which must be a whole
    number with `frames`. All others, the robots last, get the numbers after the largest id. Obstacles that are neither
    round nor rectangles are walls if they are at rest in the plane, else they are left out. Notes list both.

    Raises:
        InvalidInput: a run without a step.
    """
    if not len(recording.accelerations):
        raise InvalidInput("run: expected at least one step to write, found a robot that starts at its goal")
    existing = [o for o in recording.obstacles if _exists_during(o.trajectory, recording)]
    present = [_Body(o.name, o.shape, o.trajectory, "") for o in existing]
    bodies = [body for body in present if _extents(body.shape) is not None]
    others = [o for o, body in zip(existing, present) if _extents(body.shape) is None]
    walls = [ring for o in others if o.at_rest and recording.dimension == 2 for ring in _outlines(o)]
    left_out = [o.name for o in others if not o.at_rest or recording.dimension == 3]
    absent = list[str]()
    for k, shape in enumerate(recording.shapes):
        steps = recording.steps_of(k)
        if steps.start >= steps.stop:
            absent.append(recording.names[k])
            continue
        motion = Sampled(recording.times[steps], recording.positions[steps, k])
        bodies.append(_Body(f"{ROBOT} {k}" if k else ROBOT, shape, motion, ROBOT))
    labels, notes = _labels([body.name for body in bodies], frames)
    found = tracks_at(recording.times, {label: body.motion for label, body in zip(labels, bodies)})
    by_label = dict(zip(labels, bodies))
    first = float(recording.times[0]) if frames else 0.0
    agents = {label: _agent(by_label[label], agent.trajectory, first) for label, agent in found.agents.items()}
    if left_out:
        notes.append(f"neither round nor a rectangle, left out: {', '.join(left_out)}")
    if absent:
        notes.append(f"did not appear, left out: {', '.join(absent)}")
    lost = _lost_properties(agents.values()) if frames else ()
    return RecordedTracks(agents, (*notes, *found.notes, *lost), walls=tuple(walls))


def _outlines(obstacle: Obstacle) -> list[Array]:
    """Return the outlines (n, 2) [m] of the parts of an obstacle at rest."""
    found = []
    for corners, radius in outline_parts(obstacle, 0.0):
        line = shapely.LineString(corners) if len(corners) == 2 else shapely.LinearRing(corners)
        grown = line if radius == 0.0 else shapely.MultiPoint(corners).convex_hull.buffer(radius).exterior
        found.append(shapely.get_coordinates(grown))
    return found


def _exists_during(motion: Trajectory, recording: Recording) -> bool:
    first, last = motion.span
    return bool(np.any((recording.times >= first) & (recording.times <= last)))


def _extents(shape: Shape) -> dict[str, float] | None:
    """Return radius, or length and width [m]; None for other shapes."""
    if isinstance(shape, Disc | Ball):
        return {"radius": shape.radius}
    if isinstance(shape, Rectangle):
        return {"length": shape.length + 2.0 * shape.radius, "width": shape.width + 2.0 * shape.radius}
    return None


def _agent(body: _Body, track: Sampled, first: float) -> Agent:
    return Agent(Sampled(track.times - first, track.positions), body.kind, **(_extents(body.shape) or {}))


def _labels(names: Sequence[str], whole: bool) -> tuple[list[str], list[str]]:
    """Return an id for each name, and a note on the ids that are not taken from the name."""
    labels: list[str] = []
    for name in names:
        match = _ID.fullmatch(name)
        valid = match is not None and match[1] not in labels and (not whole or _WHOLE.fullmatch(match[1]))
        labels.append(match[1] if match and valid else "")
    next_number = max((int(label) for label in labels if _WHOLE.fullmatch(label)), default=-1) + 1
    assigned = []
    for k, name in enumerate(names):
        if not labels[k]:
            labels[k] = str(next_number)
            assigned.append(f"{name or 'an obstacle'} is {next_number}")
            next_number += 1
    more = f" and {len(assigned) - MAX_LISTED} more" if len(assigned) > MAX_LISTED else ""
    return labels, [f"ids: {', '.join(assigned[:MAX_LISTED])}{more}"] if assigned else []


def with_numeric_ids(tracks: RecordedTracks) -> RecordedTracks:
    """Return the tracks with whole numbers as ids, as files of frames require, and notes on lost properties."""
    labels, notes = _labels([f"agent {label}" for label in tracks.agents], True)
    lost = (*tracks.notes, *notes, *_lost_properties(tracks.agents.values()))
    return replace(tracks, agents=dict(zip(labels, tracks.agents.values())), notes=lost)


def _lost_properties(agents: Iterable[Agent]) -> list[str]:
    """Return a note if agents have sizes or kinds, which files of frames cannot hold."""
    sized = any(agent.radius or agent.length or agent.width or agent.kind for agent in agents)
    return ["sizes and kinds left out: files of frames cannot hold them"] if sized else []


# A table with a row for each agent: start, arrival, path length, delay, least clearance.


class AgentRow(NamedTuple):
    """A row of the table; None has no value.

    Of a run: `start` [s] is the appearance, `arrival` [s] at the goal, `delay` [s] as the metric extra_time, and
    `min_clearance` [m] in continuous time.
    Of a recording: `arrival` is the last time, `delay` the time beyond that of the straight way at the median speed,
    and `min_clearance` is that of the discs of other agents at times one median step apart.
    """

    agent: str
    kind: str
    start: float | None
    arrival: float | None
    path_length: float
    delay: float | None
    min_clearance: float | None


def rows_of_run(recording: Recording) -> list[AgentRow]:
    """Return a row for each robot of a run, in their order."""
    passive, between = nearest_clearances(recording), between_robots(recording)
    least = np.minimum(passive.min(axis=1, initial=np.inf), between.min(axis=1, initial=np.inf))
    return [
        AgentRow(
            name,
            "robot",
            finite(float(recording.appeared[k])),
            finite(float(recording.arrived[k])),
            path_length(recording, k),
            finite(extra_time(recording, k)),
            finite(float(least[k])),
        )
        for k, name in enumerate(recording.names)
    ]


def rows_of_tracks(tracks: RecordedTracks, radii: Mapping[str, float]) -> list[AgentRow]:
    """Return a row for each agent of a recording; radii: [m] by id."""
    least = _clearances(tracks, radii)
    found = []
    for label, agent in tracks.agents.items():
        times, points = agent.trajectory.times, agent.trajectory.positions
        ways = np.linalg.norm(np.diff(points, axis=0), axis=1)
        usual, straight = float(np.median(ways / np.diff(times))), float(np.linalg.norm(points[-1] - points[0]))
        delay = float(times[-1] - times[0]) - straight / usual if usual > 0.0 else None
        start, end = agent.trajectory.span
        found.append(AgentRow(label, agent.kind, start, end, float(ways.sum()), delay, finite(least[label])))
    return found


def _clearances(tracks: RecordedTracks, radii: Mapping[str, float]) -> dict[str, float]:
    """Return the least clearance [m] of each agent from the others, inf without any, at even times."""
    agents = list(tracks.agents.items())
    steps = np.concatenate([np.diff(agent.trajectory.times) for _, agent in agents])
    step, first = float(np.median(steps)), min(agent.trajectory.span[0] for _, agent in agents)
    numbers, owners = list[Array](), list[Array]()
    points = list[Array]()
    for k, (_, agent) in enumerate(agents):
        start, end = agent.trajectory.span
        # A share of a step: rounded stamps are not before the first one.
        some = np.arange(np.ceil((start - first) / step - 1e-6), np.floor((end - first) / step + 1e-6) + 1.0)
        numbers.append(some)
        owners.append(np.full(len(some), k))
        points.append(agent.trajectory.position(np.clip(first + step * some, start, end)))
    order = np.argsort(np.concatenate(numbers), kind="stable")
    owner, place = np.concatenate(owners)[order], np.concatenate(points)[order]
    radius, least = np.array([radii[label] for label, _ in agents]), np.full(len(agents), np.inf)
    for present in np.split(np.arange(len(order)), np.flatnonzero(np.diff(np.concatenate(numbers)[order])) + 1):
        own, at = owner[present], place[present]
        apart = np.linalg.norm(at[:, None] - at[None], axis=2) - radius[own][:, None] - radius[own][None]
        np.fill_diagonal(apart, np.inf)
        least[own] = np.minimum(least[own], apart.min(axis=1, initial=np.inf))
    return dict(zip((label for label, _ in agents), least.tolist()))


def write_agents(rows: Sequence[AgentRow], path: Path) -> None:
    """Write the rows as CSV with a header; None is an empty cell. Raises InvalidFile for a file that is not written."""
    cells: list[tuple[Any, ...]] = [tuple("" if cell is None else cell for cell in row) for row in rows]
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([AgentRow._fields, *cells])
