"""Recorded tracks: CSV with a header `t,id,x,y[,z]` first, one row per agent and frame, SI units."""

from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path

import numpy as np

from slalom.errors import InvalidFile
from slalom.trajectory import Sampled

COLUMNS = ("t", "id", "x", "y")


def sample_data(name: str) -> Path:
    """A file that is shipped with slalom, by its name."""
    return Path(str(files("slalom") / "data" / name))


def read_tracks(path: Path | str, *, interpolation: str = "smooth") -> dict[int, Sampled]:
    """The trajectory of every agent of a CSV file by its id, ids in increasing order.

    Rows may come in any order. Columns after x, y (and z) are ignored.

    Raises:
        InvalidFile: no such file, a header or a cell that does not fit, an agent with a single row, two rows of one
            agent at the same time. Every mistake found is named with its line.
    """
    path = Path(path)
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidFile([f"{path}: expected a readable CSV file, found {error}"]) from None
    header = [name.strip() for name in lines[0].split(",")] if lines else []
    if tuple(header[:4]) != COLUMNS:
        raise InvalidFile([f"{path}:1:1: expected a header t,id,x,y[,z], found {lines[0] if lines else 'nothing'!r}"])
    width = 5 if header[4:5] == ["z"] else 4
    try:
        table = np.loadtxt(lines[1:], delimiter=",", usecols=range(width), ndmin=2, dtype=np.float64)
    except ValueError:
        raise InvalidFile(_bad_cells(path, lines, width)) from None
    mistakes = [
        f"{path}:{row + 2}:1: expected finite numbers, found {lines[row + 1]!r}"
        for row in np.flatnonzero(~np.isfinite(table).all(axis=1))[:10]
    ]
    if mistakes:
        raise InvalidFile(mistakes)
    return _by_agent(path, table, interpolation)


def _bad_cells(path: Path, lines: list[str], width: int) -> list[str]:
    """One message for each cell that is not a number, ten at most."""
    mistakes = []
    for number, line in enumerate(lines[1:], start=2):
        cells = line.split(",")
        if len(cells) < width:
            mistakes.append(f"{path}:{number}:1: expected at least {width} columns, found {len(cells)}")
            continue
        for cell in range(width):
            try:
                float(cells[cell])
            except ValueError:
                column = 1 + sum(len(before) + 1 for before in cells[:cell])
                mistakes.append(f"{path}:{number}:{column}: expected a number, found {cells[cell]!r}")
    return mistakes[:10] + ([f"{path}: and {len(mistakes) - 10} more"] if len(mistakes) > 10 else [])


def _by_agent(path: Path, table: np.ndarray, interpolation: str) -> dict[int, Sampled]:
    order = np.lexsort((table[:, 0], table[:, 1]))
    table = table[order]
    starts = np.flatnonzero(np.diff(table[:, 1], prepend=np.nan) != 0)
    tracks, mistakes = {}, []
    for start, end in zip(starts, [*starts[1:], len(table)]):
        agent, rows = int(table[start, 1]), table[start:end]
        again = np.flatnonzero(np.diff(rows[:, 0]) == 0)
        if len(rows) < 2:
            mistakes.append(f"{path}:{order[start] + 2}:1: expected at least two rows of agent {agent}, found one")
        elif again.size:
            line = order[start + again[0] + 1] + 2
            mistakes.append(f"{path}:{line}:1: expected one row of agent {agent} at {rows[again[0], 0]:g} s, found two")
        else:
            tracks[agent] = Sampled(rows[:, 0], rows[:, 2:], interpolation)
    if mistakes:
        raise InvalidFile(mistakes)
    return tracks


def window(tracks: Iterable[Sampled], start: float, end: float) -> list[Sampled]:
    """The tracks that exist at some time between start and end [s]."""
    return [track for track in tracks if track.span[0] < end and track.span[1] > start]
