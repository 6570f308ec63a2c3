"""Recorded agents and their tracks, the rows of a file before repair, and messages about them."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidFile
from slalom.kernels.arrays import Indices
from slalom.trajectory import Sampled, Trajectory

Mistake: TypeAlias = tuple[int, str]
"""Line number and message."""

MAX_LISTED: Final = 10
"""Largest number of mistakes in one error and of agents in one note; the number of further ones is stated."""

LINE_LOCATION: Final = "{path}:{line}"
"""Template of a location in a text file; databases, whose rows have no lines, use another one."""

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
    """

    agents: Mapping[str, Agent]
    notes: tuple[str, ...] = ()
    format: str = ""
    parts: Mapping[str, Sequence[str]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of a file before repair, one per agent and time, in the order of the file.

    Attributes:
        labels: ids. agents: (n,) indices into labels. times: (n,) [s]. positions: (n, d) [m]. lines: (n,).
        extents: radius, length or width, each (n,) [m], nan where the row states none.
        kinds: n texts, "" where the row states none; empty if the file has no kinds.
        location: template of a location in the file.
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
