"""From the rows of a file to tracks: what can be repaired is, and said; what cannot is refused, all at once.

Repaired: identical rows, rows out of order, gaps (the track is split), tracks with a single row (left out). Refused:
one agent at two places at the same time, an agent that is too fast.
"""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from slalom.checks import Array, positive
from slalom.errors import InvalidFile
from slalom.io.recorded import Agent, Indices, Mistake, Rows, Tracks, counted, named, natural, refuse
from slalom.trajectory import Sampled

LONG: Final = 3.0
"""A time between two rows of an agent longer than this many usual ones (the median) is noted where it is not split."""


ROUNDING: Final = 1e-6
"""[s] A time that is longer than another by less than this is as long: stamps are rounded."""


def tracks_of(
    rows: Rows, *, gap: float | None = None, max_speed: float | None = None, interpolation: str = "smooth"
) -> Tracks:
    """The tracks of a file.

    Args:
        gap: [s] a track is split where its agent has no row for longer; never if None.
        max_speed: [m/s] an agent that is faster from one row to the next has jumped: a mistake; none if None.

    Raises:
        InvalidFile: two places at one time, a jump, an extent below 0; no agent with two rows. Every mistake is named.
        InvalidInput: `gap` or `max_speed` not above 0, an unknown interpolation.
    """
    longest = np.inf if gap is None else positive(gap, "gap")
    fastest = np.inf if max_speed is None else positive(max_speed, "max_speed")
    mistakes = list(_below_zero(rows))
    notes = [*rows.notes, *_disorder(rows)]
    order, twice = _in_order(rows)
    if twice.size:
        whose = named(rows.labels[k] for k in rows.agents[twice])
        notes.append(f"{counted(twice.size, 'duplicate row')} of {whose} dropped: identical time and place")
    agents, times, positions = rows.agents[order], rows.times[order], rows.positions[order]
    step = np.diff(times)
    same = np.diff(agents) == 0
    split = same & (step > longest + ROUNDING)
    mistakes += _conflicts(rows, order, same & (step == 0))
    mistakes += _jumps(rows, order, same & ~split & (step > 0), fastest)
    refuse(rows.path, mistakes, rows.place)
    if gap is None:
        notes += _bridged(rows, agents, times, same)
    known, varying = _properties(rows)
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
            tracks[label] = Agent(track, **known[agents[start]])
    if not tracks:
        raise InvalidFile([f"{rows.path}: expected an agent with two rows or more, found none"])
    notes += [*splits, *varying]
    if single:
        notes.append(f"{counted(len(single), 'track')} with a single row left out: {named(single, 'id')}")
    return Tracks({label: tracks[label] for label in sorted(tracks, key=natural)}, tuple(notes), parts=parts)


def _below_zero(rows: Rows) -> Iterator[Mistake]:
    for name, values in rows.extents.items():
        for k in np.flatnonzero(values < 0):
            yield int(rows.lines[k]), f"{name}: expected 0 or more, found {values[k]:g}"


def _disorder(rows: Rows) -> list[str]:
    """A note on the rows that come after a later one of the same agent."""
    order = np.argsort(rows.agents, kind="stable")
    back = np.flatnonzero((np.diff(rows.times[order]) < 0) & (np.diff(rows.agents[order]) == 0))
    if not back.size:
        return []
    whose = named(rows.labels[k] for k in rows.agents[order[back]])
    return [f"{counted(back.size, 'row')} of {whose} out of order: sorted by time"]


def _in_order(rows: Rows) -> tuple[Indices, Indices]:
    """Rows by agent, then by time, then as in the file; without those that repeat the one before, which come second."""
    order = np.lexsort((rows.times, rows.agents))
    agents, times, positions = rows.agents[order], rows.times[order], rows.positions[order]
    again = (np.diff(agents) == 0) & (np.diff(times) == 0) & np.all(np.diff(positions, axis=0) == 0, axis=1)
    twice = np.concatenate([[False], again])
    return order[~twice], order[twice]


def _conflicts(rows: Rows, order: Indices, where: Array) -> Iterator[Mistake]:
    """Rows of one agent at the time of the row before, but elsewhere."""
    for k in np.flatnonzero(where):
        one, two = order[k], order[k + 1]
        yield (
            int(rows.lines[two]),
            f"expected one place of agent {rows.labels[rows.agents[two]]} at {rows.times[two]:g} s, found "
            f"{_place(rows.positions[two])} and {_place(rows.positions[one])} at {_line(rows, one)}",
        )


def _jumps(rows: Rows, order: Indices, where: Array, fastest: float) -> Iterator[Mistake]:
    """Rows of one agent too far from the row before."""
    k = np.flatnonzero(where) if np.isfinite(fastest) else np.empty(0, dtype=np.int64)
    far = np.linalg.norm(rows.positions[order[k + 1]] - rows.positions[order[k]], axis=1)
    speed = far / (rows.times[order[k + 1]] - rows.times[order[k]])
    for j in np.flatnonzero(speed > fastest):
        row = order[k[j] + 1]
        yield (
            int(rows.lines[row]),
            f"expected agent {rows.labels[rows.agents[row]]} no faster than {fastest:g} m/s, found {speed[j]:g} m/s "
            f"since {_line(rows, order[k[j]])}",
        )


def _place(position: Array) -> str:
    return f"({', '.join(f'{x:g}' for x in position)})"


def _line(rows: Rows, row: np.int64) -> str:
    return rows.place.format(path=rows.path.name, line=rows.lines[row])


def _bridged(rows: Rows, agents: Indices, times: Array, same: Array) -> list[str]:
    """A note on the times without rows over which tracks are interpolated."""
    step = np.where(same, np.diff(times), 0.0)
    usual = float(np.median(step[same])) if np.any(same) else np.inf
    k = np.flatnonzero(step > LONG * usual + ROUNDING)
    if not k.size:
        return []
    most = k[np.argmax(step[k])]
    return [
        f"{counted(k.size, 'gap')} longer than {LONG * usual:g} s bridged by the interpolation, the longest "
        f"{step[most]:g} s (agent {rows.labels[agents[most]]}, t = {times[most]:g} s)"
    ]


def _part_labels(
    labels: Sequence[str], agents: Indices, times: Array, starts: Indices
) -> tuple[list[str], list[str], dict[str, list[str]]]:
    """A label for each part, whose agents are given, a note for each agent in parts, and its parts."""
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
    """What is known of each label, and notes on what varies: the largest extent and the first kind are kept."""
    known: list[dict[str, float | str | None]] = [{} for _ in rows.labels]
    notes = []
    order = np.argsort(rows.agents, kind="stable")
    present, starts = np.unique(rows.agents[order], return_index=True)
    for name, values in rows.extents.items():
        sizes = np.where(values == 0.0, np.nan, values)[order]  # 0 is how files write what they do not know
        most, least = np.fmax.reduceat(sizes, starts), np.fmin.reduceat(sizes, starts)
        for agent, size in zip(present.tolist(), most.tolist()):
            known[agent][name] = None if np.isnan(size) else size
        if np.any(most > least):
            notes.append(
                f"{name} of {named(rows.labels[k] for k in present[most > least])} varies: the largest is kept"
            )
    varying = set()
    for agent, kind in zip(rows.agents.tolist(), rows.kinds):
        if kind and known[agent].setdefault("kind", kind) != kind:
            varying.add(rows.labels[agent])
    if varying:
        notes.append(f"kind of {named(varying)} varies: the first is kept")
    return known, notes
