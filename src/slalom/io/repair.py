"""Conversion of the rows of a file to tracks: repairs are noted, other mistakes are raised together.

Repaired: identical rows, rows out of order, gaps (the track is split), tracks with a single row (left out). Refused:
two positions of one agent at the same time, an agent that exceeds the speed limit.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from slalom.checks import Array, positive
from slalom.errors import InvalidFile
from slalom.io.recorded import Agent, Mistake, RecordedTracks, Rows, counted, named, natural, refuse
from slalom.kernels.arrays import Indices
from slalom.tolerances import LARGEST, LONG_GAP, STAMP_ROUNDING
from slalom.trajectory import Sampled


def tracks_of(
    rows: Rows, *, gap: float | None = None, max_speed: float | None = None, interpolation: str = "smooth"
) -> RecordedTracks:
    """Convert rows to tracks, one per agent and gap-free part.

    Args:
        gap: [s] split a track where its agent has no row for longer; never if None.
        max_speed: [m/s] a larger mean speed between consecutive rows is a mistake; LARGEST if None.

    Raises:
        InvalidFile: two positions at one time, a jump, an extent below 0 (all at once); no agent with two rows.
        InvalidInput: `gap` or `max_speed` not above 0, an unknown interpolation.
    """
    longest = np.inf if gap is None else positive(gap, "gap")
    fastest = LARGEST if max_speed is None else positive(max_speed, "max_speed")
    mistakes = list(_below_zero(rows))
    notes = [*rows.notes, *_unsorted(rows)]
    order, twice = _sorted(rows)
    if twice.size:
        owners = named(rows.labels[k] for k in rows.agents[twice])
        notes.append(f"{counted(twice.size, 'duplicate row')} of {owners} dropped: identical time and position")
    agents, times, positions = rows.agents[order], rows.times[order], rows.positions[order]
    step = np.diff(times)
    same = np.diff(agents) == 0
    split = same & (step > longest + STAMP_ROUNDING)
    mistakes += _conflicts(rows, order, same & (step == 0))
    mistakes += _jumps(rows, order, same & ~split & (step > 0), fastest)
    refuse(rows.path, mistakes, rows.location)
    if gap is None:
        notes += _bridged(rows, agents, times, same)
    properties, varying = _properties(rows)
    tracks: dict[str, Agent] = {}
    single: list[str] = []
    starts = np.flatnonzero(np.concatenate([[True], ~same | split]))
    ends = np.append(starts[1:], len(order))
    labels, splits, parts = _part_labels(rows.labels, agents[starts], times, starts)
    for label, start, end in zip(labels, starts.tolist(), ends.tolist()):
        if end - start < 2:
            single.append(label)
        else:
            track = Sampled(times[start:end], positions[start:end], interpolation)
            tracks[label] = Agent(track, **properties[agents[start]])
    if not tracks:
        raise InvalidFile([f"{rows.path}: expected an agent with two rows or more, found none"])
    notes += [*splits, *varying]
    if single:
        notes.append(f"{counted(len(single), 'track')} with a single row left out: {named(single, 'id')}")
    return RecordedTracks({label: tracks[label] for label in sorted(tracks, key=natural)}, tuple(notes), parts=parts)


def _below_zero(rows: Rows) -> Iterator[Mistake]:
    for name, values in rows.extents.items():
        for k in np.flatnonzero(values < 0):
            yield int(rows.lines[k]), f"{name}: expected 0 or more, found {values[k]:g}"


def _unsorted(rows: Rows) -> list[str]:
    """Return a note on the rows that follow a later row of the same agent."""
    order = np.argsort(rows.agents, kind="stable")
    backward = np.flatnonzero((np.diff(rows.times[order]) < 0) & (np.diff(rows.agents[order]) == 0))
    if not backward.size:
        return []
    owners = named(rows.labels[k] for k in rows.agents[order[backward]])
    return [f"{counted(backward.size, 'row')} of {owners} out of order: sorted by time"]


def _sorted(rows: Rows) -> tuple[Indices, Indices]:
    """Return row indices sorted by agent, time and line, without duplicates, and the indices of the duplicates."""
    order = np.lexsort((rows.times, rows.agents))
    agents, times, positions = rows.agents[order], rows.times[order], rows.positions[order]
    repeated = (np.diff(agents) == 0) & (np.diff(times) == 0) & np.all(np.diff(positions, axis=0) == 0, axis=1)
    twice = np.concatenate([[False], repeated])
    return order[~twice], order[twice]


def _conflicts(rows: Rows, order: Indices, where: Array) -> Iterator[Mistake]:
    """Yield a mistake for each row with the agent and time of the row before but another position."""
    for k in np.flatnonzero(where):
        first, second = order[k], order[k + 1]
        yield (
            int(rows.lines[second]),
            f"expected one position of agent {rows.labels[rows.agents[second]]} at {rows.times[second]:g} s, found "
            f"{_position(rows.positions[second])} and {_position(rows.positions[first])} at {_line(rows, first)}",
        )


def _jumps(rows: Rows, order: Indices, where: Array, fastest: float) -> Iterator[Mistake]:
    """Yield a mistake for each row that its agent reaches faster than `fastest` [m/s] from the row before."""
    k = np.flatnonzero(where)
    distance = np.linalg.norm(rows.positions[order[k + 1]] - rows.positions[order[k]], axis=1)
    with np.errstate(over="ignore"):
        speed = distance / (rows.times[order[k + 1]] - rows.times[order[k]])
    for j in np.flatnonzero(speed > fastest):
        row = order[k[j] + 1]
        yield (
            int(rows.lines[row]),
            f"expected agent {rows.labels[rows.agents[row]]} no faster than {fastest:g} m/s, found {speed[j]:g} m/s "
            f"since {_line(rows, order[k[j]])}",
        )


def _position(position: Array) -> str:
    return f"({', '.join(f'{x:g}' for x in position)})"


def _line(rows: Rows, row: np.int64) -> str:
    return rows.location.format(path=rows.path.name, line=rows.lines[row])


def _bridged(rows: Rows, agents: Indices, times: Array, same: Array) -> list[str]:
    """Return a note on the gaps over which tracks are interpolated."""
    step = np.where(same, np.diff(times), 0.0)
    usual = float(np.median(step[same])) if np.any(same) else np.inf
    k = np.flatnonzero(step > LONG_GAP * usual + STAMP_ROUNDING)
    if not k.size:
        return []
    longest = k[np.argmax(step[k])]
    return [
        f"{counted(k.size, 'gap')} longer than {LONG_GAP * usual:g} s bridged by the interpolation, the longest "
        f"{step[longest]:g} s (agent {rows.labels[agents[longest]]}, t = {times[longest]:g} s)"
    ]


def _part_labels(
    labels: Sequence[str], agents: Indices, times: Array, starts: Indices
) -> tuple[list[str], list[str], dict[str, list[str]]]:
    """Label the parts of all tracks.

    Args:
        agents: (m,) agent index of each part. times: (n,) [s] of all rows. starts: (m,) first row of each part.

    Returns:
        A label for each part, a note for each agent that was split, and the labels of its parts by the file's id.
    """
    taken, parts = set(labels), dict[int, list[str]]()
    gaps = dict[int, list[str]]()
    found = []
    for agent, start in zip(agents.tolist(), starts.tolist()):
        own = parts.setdefault(agent, [])
        label, number = labels[agent], len(own)
        if own:
            while f"{labels[agent]}.{number}" in taken:
                number += 1
            label = f"{labels[agent]}.{number}"
            taken.add(label)
            last = times[start - 1]
            gaps.setdefault(agent, []).append(f"{times[start] - last:g} s (t = {last:g} s)")
        own.append(label)
        found.append(label)
    notes = [
        f"agent {labels[agent]} split at {'a gap' if len(where) == 1 else 'gaps'} of {_listed(where)} "
        f"into {_listed(parts[agent])}"
        for agent, where in gaps.items()
    ]
    return found, notes, {labels[agent]: parts[agent] for agent in gaps}


def _listed(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _properties(rows: Rows) -> tuple[list[dict[str, float | str | None]], list[str]]:
    """Return extents and kind of each label, and notes on varying values: largest extent and first kind are kept."""
    properties: list[dict[str, float | str | None]] = [{} for _ in rows.labels]
    notes = []
    order = np.argsort(rows.agents, kind="stable")
    present, starts = np.unique(rows.agents[order], return_index=True)
    for name, values in rows.extents.items():
        sizes = np.where(values == 0.0, np.nan, values)[order]  # files write 0 for an unknown extent
        largest, smallest = np.fmax.reduceat(sizes, starts), np.fmin.reduceat(sizes, starts)
        for agent, size in zip(present.tolist(), largest.tolist()):
            properties[agent][name] = None if np.isnan(size) else size
        if np.any(largest > smallest):
            notes.append(
                f"{name} of {named(rows.labels[k] for k in present[largest > smallest])} varies: the largest is kept"
            )
    varying = set()
    for agent, kind in zip(rows.agents.tolist(), rows.kinds):
        if kind and properties[agent].setdefault("kind", kind) != kind:
            varying.add(rows.labels[agent])
    if varying:
        notes.append(f"kind of {named(varying)} varies: the first is kept")
    return properties, notes
