"""What is known of recorded agents, and rows of a file before they become tracks."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from slalom.checks import Array
from slalom.errors import InvalidFile
from slalom.trajectory import Sampled, Trajectory

Indices: TypeAlias = npt.NDArray[np.int64]
Mistake: TypeAlias = tuple[int, str]
"""The line and what is wrong there."""

SHOWN: Final = 10
"""Mistakes in one error, and agents in one note; how many more there are is said."""

IN_LINES: Final = "{path}:{line}"
"""How a place in a file is written; rows of a database have no lines."""

_NUMBERED = re.compile(r"(-?\d{1,18})(?:\.(\d{1,18}))?")


@dataclass(frozen=True, eq=False)
class Agent:
    """A recorded agent.

    Attributes:
        trajectory: where it was. kind: what it is, in the words of the file; "" where the file does not say.
        radius, length, width: [m]; None where the file does not say.
    """

    trajectory: Sampled
    kind: str = ""
    radius: float | None = None
    length: float | None = None
    width: float | None = None


@dataclass(frozen=True, eq=False)
class Tracks:
    """Recorded agents by their id, numbers first and in increasing order, and what was done to the rows of the file.

    An id is the file's own text, a whole number without leading zeros or decimals (but those of ships and aircraft are
    as they are). Further parts of a track that was split are called after the first: 7, 7.1, 7.2; `parts` has their
    ids by that of the file. Each note is a sentence with its count. `format` is the name of the file's format, "" of
    tracks from no file.
    """

    agents: Mapping[str, Agent]
    notes: tuple[str, ...] = ()
    format: str = ""
    parts: Mapping[str, Sequence[str]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Rows:
    """What a file says, one row per agent and time, in the order of the file: nothing is repaired yet.

    Attributes:
        labels: ids. agents: (n,) indices into labels. times: (n,) [s]. positions: (n, d) [m]. lines: (n,).
        extents: radius, length or width, each (n,) [m], nan where the row does not say.
        kinds: n texts, "" where the row does not say; or none at all. place: how a line is written.
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
    place: str = IN_LINES


def refuse(path: Path, mistakes: Iterable[Mistake], place: str = IN_LINES) -> None:
    """Raise InvalidFile if there are mistakes: in the order of their lines, ten at most and how many more."""
    ordered = [f"{place.format(path=path, line=line)}: {text}" for line, text in sorted(mistakes)]
    if ordered:
        more = [f"{path}: and {len(ordered) - SHOWN} more"] if len(ordered) > SHOWN else []
        raise InvalidFile(ordered[:SHOWN] + more)


def natural(label: str) -> tuple[int, int, int, str]:
    """A key that orders ids: numbers by value, parts of a track after each other, then texts."""
    found = _NUMBERED.fullmatch(label)
    return (0, int(found[1]), int(found[2] or 0), "") if found else (1, 0, 0, label)


def counted(count: int, what: str) -> str:
    """The count and the word: 1 row, 2 rows."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def named(labels: Iterable[str], what: str = "agent") -> str:
    """The ids with the word: agent 4, agents 4, 9; ten at most and how many more."""
    ordered = sorted(set(labels), key=natural)
    more = f" and {len(ordered) - SHOWN} more" if len(ordered) > SHOWN else ""
    return f"{what}{'' if len(ordered) == 1 else 's'} {', '.join(ordered[:SHOWN])}{more}"


def tracks_at(
    times: Array, motions: Mapping[str, Trajectory | Array], radii: Mapping[str, float] | None = None
) -> Tracks:
    """Agents as they are at `times` (T,) [s], for files of frames: robots and obstacles of a simulated run.

    Args:
        motions: by id, positions (T, d) [m] or a trajectory, which is asked only for the times at which it exists.
        radii: [m] by id. An agent that exists at fewer than two of the times is left out, with a note.

    Raises:
        InvalidInput: positions or times that do not make a track.
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
    return Tracks(agents, tuple(notes) if short else ())
