"""Recorded agents and their tracks, the rows of a file before repair, and messages about them."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np

from slalom.base.checks import Array, known, positive
from slalom.base.errors import InvalidFile
from slalom.base.tolerances import LARGEST
from slalom.kernels.arrays import Flags, Indices
from slalom.model.trajectory import Sampled, Trajectory

Mistake: TypeAlias = tuple[int, str]
"""Line number and message."""

MAX_LISTED: Final = 10
"""Largest number of mistakes in one error and of agents in one note; the number of further ones is stated."""

LINE_LOCATION: Final = "{path}:{line}"
"""Template of a location in a text file; databases, whose rows have no lines, use another one."""

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
"""[m] Radius of an agent without a size, by kind: half the diagonal of a common one, 4.5 x 1.8 m for a car."""

KIND_ALIASES: Final[Mapping[str, str]] = {
    **dict.fromkeys(("person", "people", "human", "ped", "walker", "adult", "child", "skater"), "pedestrian"),
    **dict.fromkeys(("pedestrian/bicycle", "bicyclist", "cyclist", "biker", "bike"), "bicycle"),
    **dict.fromkeys(("motorcyclist", "motorbike"), "motorcycle"),
    **dict.fromkeys(("vehicle", "passenger", "taxi", "priorityvehicle", "parkedvehicle", "cart"), "car"),
    **dict.fromkeys(("truck_bus", "coach"), "bus"),
    **dict.fromkeys(("trailer", "lorry"), "truck"),
    **dict.fromkeys(("vessel", "boat"), "ship"),
    **dict.fromkeys(("airplane", "plane"), "aircraft"),
    **dict.fromkeys(("uav", "quadrotor"), "drone"),
    **dict.fromkeys(("unknown", "other", "-1"), ""),
}
"""Kinds of RADII by other words of files; "" for words that name none."""

DEFAULT_KINDS: Final[Mapping[int, str]] = {2: "pedestrian", 3: "drone"}
"""Kind of an agent without a kind in the file or the format, by the dimension of its track."""

FASTEST: Final[Mapping[str, tuple[float, float]]] = {
    **dict.fromkeys(("motorcycle", "car", "van", "truck", "bus"), (70.0, 140.0)),
    **dict(zip(("pedestrian", "bicycle"), ((2.5, 13.0), (15.0, 40.0)))),
    **dict(zip(("drone", "ship", "aircraft"), ((50.0, 100.0), (30.0, 60.0), (350.0, 1000.0)))),
}
"""[m/s] Largest plausible median speed of agents of a kind, and one that none of them has: 12.4 is the record of runs.

Larger: wrong units and rates pass without a word, or without a refusal.
"""

SLOWEST: Final = 0.05
"""[m/s] Least plausible largest speed of a recording in which agents move. Smaller: degrees and ms pass."""

HIGHEST: Final = 15_000.0
"""[m] Largest plausible altitude. Larger: feet pass as metres."""

BOUNDING_BOX: Final = "bounding box of all positions"
"""Value of the key geometry in the metadata of databases whose walkable area is no building."""

_NUMBERED = re.compile(r"(-?\d{1,18})(?:\.(\d{1,18}))?")


@dataclass(frozen=True, eq=False)
class Agent:
    """A recorded agent.

    Attributes:
        trajectory: position over time.
        kind: class of the agent as written in the file; "" if not stated.
        radius, length, width: [m]; None if not stated.
    """

    trajectory: Sampled
    kind: str = ""
    radius: float | None = None
    length: float | None = None
    width: float | None = None


@dataclass(frozen=True, eq=False)
class RecordedTracks:
    """Recorded agents by id, numeric ids first and in increasing order, with notes on repairs.

    An id is the text in the file; a whole number is written without leading zeros or decimals, except for ships and
    aircraft. Further parts of a track that was split are numbered: 7, 7.1, 7.2.

    Attributes:
        notes: repairs and assumptions, one sentence each, with a count.
        format: name of the file's format; "" for tracks that were not read from a file.
        parts: ids of the parts of each track that was split, by the id in the file.
        walls: polylines (n, 2) [m].
    """

    agents: Mapping[str, Agent]
    notes: tuple[str, ...] = ()
    format: str = ""
    parts: Mapping[str, Sequence[str]] = field(default_factory=dict)
    walls: tuple[Array, ...] = ()

    def summary(self) -> str:
        """Return the number of agents, the time span, the extent, and the median and the largest speed, in a line."""
        times = np.array([agent.trajectory.span for agent in self.agents.values()])
        points = [agent.trajectory.positions for agent in self.agents.values()]
        low, high = (np.array([bound(p, axis=0)[:2] for p in points]) for bound in (np.min, np.max))
        speeds = np.concatenate([_speeds(agent) for agent in self.agents.values()])
        start, end = times[:, 0].min(), times[:, 1].max()
        extent = " x ".join(f"{size:.4g}" for size in high.max(axis=0) - low.min(axis=0))
        return (
            f"{counted(len(points), 'agent')}, {end - start:.6g} s from {start:.6g} to {end:.6g} s, extent {extent} m, "
            f"speed median {np.median(speeds):.3g} and largest {speeds.max():.3g} m/s"
        )

    def implausible(self, kind: str, path: Path | None = None) -> list[str]:
        """Return a warning for each speed and altitude that suggests a wrong unit or rate.

        Args:
            kind: of agents whose kind is not stated; "" for that of their dimension, if their size is not stated.
            path: of a file whose unit is assumed.

        Raises:
            InvalidFile: agents in this file have a speed that none of their kind has, or none at all if it is unknown.
        """
        groups = dict[tuple[str, float], list[Array]]()
        for agent in self.agents.values():
            sized, stated = agent.radius or agent.length, kind_of(agent.kind)
            usual = kind or ("car" if sized else DEFAULT_KINDS[agent.trajectory.dimension])
            name = stated if stated in FASTEST else usual
            known = stated in FASTEST if stated else kind or not sized
            groups.setdefault((name, FASTEST[name if known else "aircraft"][1]), []).append(_speeds(agent))
        warnings = []
        for (name, most), parts in groups.items():
            speeds, plausible = np.concatenate(parts), FASTEST[name][0]
            median = float(np.median(speeds[speeds > 0.0])) if speeds.any() else 0.0
            hint = "check --frame-rate, --unit and --time-unit"
            if path is not None and median > most:
                expected = f"a median speed of {name} tracks of at most {most:g} m/s"
                found = f"{median:.3g} m/s: {hint}; --unit m reads it as it is"
                raise InvalidFile([f"{path}: expected {expected}, found {found}"])
            if median > plausible:
                hint += "; the frames of biwi_eth.txt are at 15 Hz" if name == "pedestrian" else ""
                expected = f"expected at most {plausible:g} m/s: {hint}"
                warnings.append(f"warning: median speed {median:.3g} m/s of {name} tracks, {expected}")
        points = np.concatenate([agent.trajectory.positions for agent in self.agents.values()])
        largest = max(float(np.max(speeds)) for parts in groups.values() for speeds in parts)
        if 0.0 < largest < SLOWEST:
            degrees = np.abs(points[:, 0]).max() <= 180.0 and np.abs(points[:, 1]).max() <= 90.0
            hint = "for degrees, --columns latitude=y,longitude=x; " if degrees else ""
            warnings.append(f"warning: largest speed {largest:.3g} m/s: {hint}else check --unit and --time-unit")
        if points.shape[1] == 3 and (np.max(points[:, 2]) < 0.0 or np.max(points[:, 2]) > HIGHEST):
            low, high = np.min(points[:, 2]), np.max(points[:, 2])
            hint = "--columns z=-z if z points down" if high < 0.0 else "--altitude-unit 0.3048 for feet"
            warnings.append(f"warning: z from {low:.6g} to {high:.6g} m: {hint}")
        return warnings


def _speeds(agent: Agent) -> Array:
    """Return the mean speeds (n - 1,) [m/s] between the rows of an agent."""
    track = agent.trajectory
    with np.errstate(over="ignore"):
        return np.asarray(np.linalg.norm(np.diff(track.positions, axis=0), axis=1) / np.diff(track.times))


def kind_of(text: str) -> str:
    """Return a kind in the words of RADII, "" if the text names none; another word in lower case."""
    word = text.strip().lower()
    return KIND_ALIASES.get(word, word)


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of a file before repair, one per agent and time, in the order of the file.

    Attributes:
        labels: ids. agents: (n,) indices into labels. times: (n,) [s]. positions: (n, d) [m]. lines: (n,).
        extents: radius, length or width, each (n,) [m], nan where the row states none.
        kinds: n texts, "" where the row states none; empty if the file has no kinds.
        location: template of a location in the file. walls: polylines (m, 2) [m].
        assumed: whether m is assumed: neither the file nor the definition of its format states a unit.
    """

    path: Path
    labels: Sequence[str]
    agents: Indices
    times: Array
    positions: Array
    lines: Indices
    extents: Mapping[str, Array] = field(default_factory=dict)
    kinds: Sequence[str] = ()
    notes: tuple[str, ...] = ()
    location: str = LINE_LOCATION
    walls: tuple[Array, ...] = ()
    assumed: bool = False

    def scaled(self, unit: float) -> "Rows":
        """Return the rows of a file whose lengths, read as m, are in `unit` [m]."""
        return replace(
            self,
            positions=self.positions * unit,
            extents={name: values * unit for name, values in self.extents.items()},
            walls=tuple(wall * unit for wall in self.walls),
            assumed=False,
        )


def refuse(path: Path, mistakes: Iterable[Mistake], location: str = LINE_LOCATION) -> None:
    """Raise InvalidFile if there are mistakes: the first MAX_LISTED by line, and the number of further ones."""
    ordered = [f"{location.format(path=path, line=line)}: {text}" for line, text in sorted(mistakes)]
    if ordered:
        raise InvalidFile(first_of(path, ordered))


def first_of(path: Path, mistakes: Sequence[str], most: int = MAX_LISTED) -> list[str]:
    """Return the first `most` mistakes of a file, and a line with the number of further ones."""
    more = [f"{path}: and {len(mistakes) - most} more"] if len(mistakes) > most else []
    return [*mistakes[:most], *more]


def natural(label: str) -> tuple[int, int, int, str]:
    """Return a sort key of ids: numbers by value, parts of a track by part number, then texts."""
    found = _NUMBERED.fullmatch(label)
    return (0, int(found[1]), int(found[2] or 0), "") if found else (1, 0, 0, label)


def counted(count: int, noun: str) -> str:
    """Return the count with its noun: 1 row, 2 rows."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def named(labels: Iterable[str], noun: str = "agent") -> str:
    """Return the noun with the ids: agent 4, agents 4, 9; at most MAX_LISTED, and the number of further ones."""
    ordered = sorted(set(labels), key=natural)
    more = f" and {len(ordered) - MAX_LISTED} more" if len(ordered) > MAX_LISTED else ""
    return f"{noun}{'' if len(ordered) == 1 else 's'} {', '.join(ordered[:MAX_LISTED])}{more}"


def tracks_at(
    times: Array, motions: Mapping[str, Trajectory | Array], radii: Mapping[str, float] | None = None
) -> RecordedTracks:
    """Sample agents (robots and obstacles of a simulated run) at `times` (T,) [s], for files of frames.

    An agent that exists at fewer than two of the times is left out, with a note.

    Args:
        motions: by id, positions (T, d) [m] or a trajectory, which is evaluated only within its span.
        radii: [m] by id.

    Raises:
        InvalidInput: positions or times that form no track.
    """
    agents, short = {}, []
    for label in sorted(motions, key=natural):
        motion, stamps = motions[label], np.asarray(times, dtype=np.float64)
        if not isinstance(motion, np.ndarray):
            first, last = motion.span
            stamps = stamps[(stamps >= first) & (stamps <= last)]
            if stamps.size < 2:
                short.append(label)
                continue
            motion = motion.position(stamps)
        agents[label] = Agent(Sampled(stamps, motion), radius=(radii or {}).get(label))
    notes = [f"{counted(len(short), 'agent')} at fewer than two of the times left out: {named(short, 'id')}"]
    return RecordedTracks(agents, tuple(notes) if short else ())


# Conversion of the rows of a file to tracks: repairs are noted, other mistakes are raised together.
#
# Repaired: identical rows, rows out of order, gaps (the track is split), tracks with a single row (left out). Refused:
# two positions of one agent at the same time unless `keep` selects one, an agent that exceeds the speed limit.


LONG_GAP: Final = 3.0
"""[1] A gap in a track without a split there is noted if it is longer than this many times the median step.

Larger: fewer notes. Smaller: a note for each missing sample.
"""

STAMP_ROUNDING: Final = 1e-6
"""[s] By how much time stamps may be rounded: steps that exceed a limit by less do not exceed it.

Larger: gaps that are too long are kept. Smaller: rounding splits a track.
"""


def tracks_of(
    rows: Rows,
    *,
    gap: float | None = None,
    max_speed: float | None = None,
    interpolation: str = "smooth",
    keep: str | None = None,
) -> RecordedTracks:
    """Convert rows to tracks, one per agent and gap-free part.

    Args:
        gap: [s] split a track where its agent has no row for longer; None: where the motion over a gap is not its own.
        max_speed: [m/s] a larger mean speed between consecutive rows is a mistake; LARGEST if None.
        keep: which of several rows of an agent at one time is read, "first" or "last" in the file; a mistake if None.

    Raises:
        InvalidFile: two positions at one time, a jump, an extent below 0 (all at once); no agent with two rows.
        InvalidInput: `gap` or `max_speed` not above 0, an unknown interpolation or `keep`.
    """
    longest = np.inf if gap in (None, np.inf) else positive(gap, "gap")
    fastest = LARGEST if max_speed is None else positive(max_speed, "max_speed")
    mistakes = list(_below_zero(rows))
    notes = [*rows.notes, *_unsorted(rows)]
    order, twice = _sorted(rows)
    if twice.size:
        owners = named(rows.labels[k] for k in rows.agents[twice])
        notes.append(f"{counted(twice.size, 'duplicate row')} of {owners} dropped: identical time and position")
    if keep is not None:
        order, dropped = _one_a_time(rows, order, known(keep, "keep", ["first", "last"]))
        owners = named(rows.labels[k] for k in rows.agents[dropped])
        notes += [
            f"{counted(dropped.size, 'row')} of {owners} at the time of another row left out: the {keep} is kept"
        ] * bool(dropped.size)
    agents = rows.agents[order]
    times = rows.times[order]
    positions = rows.positions[order]
    step = np.diff(times)
    same = np.diff(agents) == 0
    gaps = _gaps(step, same)
    split = same & (step > longest + STAMP_ROUNDING)
    if gap is None:
        split[[k for k in gaps.tolist() if not _own_motion(k, times, positions, same, gaps)]] = True
    mistakes += _conflicts(rows, order, same & (step == 0))
    mistakes += _jumps(rows, order, same & ~split & (step > 0), fastest)
    refuse(rows.path, mistakes, rows.location)
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
    notes += [*(splits if gap is not None else _on_gaps(rows, agents, times, gaps, split)), *varying]
    if single:
        notes.append(f"{counted(len(single), 'track')} with a single row left out: {named(single, 'id')}")
    return RecordedTracks(
        {label: tracks[label] for label in sorted(tracks, key=natural)}, tuple(notes), parts=parts, walls=rows.walls
    )


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
    agents = rows.agents[order]
    times = rows.times[order]
    positions = rows.positions[order]
    repeated = (np.diff(agents) == 0) & (np.diff(times) == 0) & np.all(np.diff(positions, axis=0) == 0, axis=1)
    twice = np.concatenate([[False], repeated])
    return order[~twice], order[twice]


def _one_a_time(rows: Rows, order: Indices, keep: str) -> tuple[Indices, Indices]:
    """Return sorted row indices with the first or the last row of each agent and time, and the other ones."""
    again = (np.diff(rows.agents[order]) == 0) & (np.diff(rows.times[order]) == 0)
    dropped = np.concatenate([[False], again]) if keep == "first" else np.concatenate([again, [False]])
    return order[~dropped], order[dropped]


def _conflicts(rows: Rows, order: Indices, where: Array) -> Iterator[Mistake]:
    """Yield a mistake for each row with the agent and time of the row before but another position."""
    count = counted(int(np.sum(where)), "such row")
    for k in np.flatnonzero(where):
        first, second = order[k], order[k + 1]
        yield (
            int(rows.lines[second]),
            f"expected one position of agent {rows.labels[rows.agents[second]]} at {rows.times[second]:g} s, found "
            f"{_position(rows.positions[second])} and {_position(rows.positions[first])} at {_line(rows, first)} "
            f"({count}; --keep first or --keep last reads one)",
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


def _gaps(step: Array, same: Flags) -> Indices:
    """Return the numbers of the steps (n,) [s] of one agent that are longer than LONG_GAP times the median one."""
    own = step[same & (step > 0)]
    usual = float(np.median(own)) if own.size else np.inf
    return np.flatnonzero(same & (step > LONG_GAP * usual + STAMP_ROUNDING))


def _own_motion(k: int, times: Array, positions: Array, same: Flags, gaps: Indices) -> bool:
    """Return whether the way over the gap after row k is a motion of the agent as it was before and is after it.

    The agent turns by a right angle at most. The speed is at least half of the lesser and at most twice the larger one
    of before and after, the velocity off their mean by at most half of the larger speed. Before and after are times as
    long as the gap.
    """
    lasts, way = times[k + 1] - times[k], positions[k + 1] - positions[k]
    ends = np.union1d(np.flatnonzero(~same), gaps)
    place = int(np.searchsorted(ends, k))
    begin = int(ends[place - 1]) + 1 if place else 0
    end = int(ends[place + 1]) if place + 1 < len(ends) else len(times) - 1
    before = max(begin, min(k - 1, int(np.searchsorted(times[begin : k + 1], times[k] - lasts)) + begin))
    after = min(end, max(k + 2, int(np.searchsorted(times[k + 1 : end + 1], times[k + 1] + lasts, "right")) + k))
    spans = [(i, j) for i, j in ((before, k), (k + 1, after)) if times[i] < times[j]]
    if not spans:
        return True
    velocities = np.array([(positions[j] - positions[i]) / (times[j] - times[i]) for i, j in spans])
    speeds = np.linalg.norm(velocities, axis=1)
    # A step is as inexact as the positions.
    steps = [np.linalg.norm(np.diff(positions[i : j + 1], axis=0), axis=1).max() for i, j in spans]
    slack, found = LONG_GAP * max(steps) / lasts, way / lasts
    if speeds.min() > slack and velocities[0] @ velocities[-1] < 0.0:
        return False
    speed, off = float(np.linalg.norm(found)), float(np.linalg.norm(found - velocities.mean(axis=0)))
    return bool(0.5 * speeds.min() - slack <= speed <= 2.0 * speeds.max() + slack and off <= 0.5 * speeds.max() + slack)


def _on_gaps(rows: Rows, agents: Indices, times: Array, gaps: Indices, split: Flags) -> list[str]:
    """Return notes on the gaps that split tracks without a `gap`, and on those that are bridged."""
    notes = []
    joined, parted = gaps[~split[gaps]], gaps[split[gaps]]
    if parted.size:
        owners = named(rows.labels[k] for k in agents[parted])
        notes.append(
            f"{counted(parted.size, 'gap')} of {owners} split, where the way over the gap is no motion of its agent: "
            "ids used again? --gap SECONDS splits by length"
        )
    if joined.size:
        step = np.diff(times)
        longest = joined[np.argmax(step[joined])]
        label = rows.labels[agents[longest]]
        notes.append(
            f"{counted(joined.size, 'gap')} bridged by the interpolation, the longest {step[longest]:g} s "
            f"(agent {label}, t = {times[longest]:g} s); --gap SECONDS splits there"
        )
    return notes


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
