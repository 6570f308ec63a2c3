"""A run or a recording as a table with a row for each agent: start, arrival, path length, delay, least clearance."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidFile, reason
from slalom.io.recorded import RecordedTracks
from slalom.sim.measure.closest_approach import between_robots, nearest_clearances
from slalom.sim.measure.metrics import extra_time, finite, path_length
from slalom.sim.measure.recording import Recording


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
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([AgentRow._fields, *cells])
    except OSError as error:
        raise InvalidFile([f"{path}: expected a file that can be written, found {reason(error)}"]) from None
