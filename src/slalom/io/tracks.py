"""Readers of recorded tracks: CSV with a header `t,id,x,y[,z]`, one row per agent and frame, SI units.

`read_tracks` is strict: it repairs nothing. `csv_rows` reads the same format for `formats.read_recording`, which
repairs.
"""

from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidFile
from slalom.io.input_file import text_of
from slalom.io.recorded import Rows, first_of
from slalom.io.table import comma_table
from slalom.kernels.arrays import Indices
from slalom.trajectory import Sampled

COLUMNS = ("t", "id", "x", "y")


SAMPLES: Final[Mapping[str, str]] = {
    "crossing.yaml": "A robot crosses a road with three cars and a pedestrian.",
    "mixed.yaml": "Three robots with methods, margins and priorities of their own.",
    "fleet.yaml": "Groups of robots: on a circle, in a grid and at random places.",
    "hall.yaml": "A robot follows a path between walls, a shelf, a trolley and a person.",
    "recorded.yaml": "A robot in a recording, as a scenario file.",
    "study.yaml": "A study: two methods in two scenarios.",
    "roundabout_ring_11.csv": "A recording of 30 cars in a roundabout.",
}
"""Files that slalom brings, for `sample_data` and for the command line as sample:NAME."""


def sample_data(name: str) -> Path:
    """Return the path of a data file of slalom."""
    return Path(str(files("slalom") / "data" / name))


def read_tracks(path: Path | str, *, interpolation: str = "smooth") -> dict[int, Sampled]:
    """Read the trajectory of every agent of a CSV file, by id in increasing order.

    Rows may be in any order. Columns after x, y (and z) are ignored.

    Raises:
        InvalidFile: no such file, an invalid header or cell, an agent with a single row, two rows of one agent at the
            same time. Every mistake is reported with its line.
    """
    path = Path(path)
    lines = text_of(path, "CSV file").splitlines()
    header = [name.strip() for name in lines[0].split(",")] if lines else []
    if tuple(header[:4]) != COLUMNS:
        raise InvalidFile([f"{path}:1:1: expected a header t,id,x,y[,z], found {lines[0] if lines else 'nothing'!r}"])
    width = 5 if header[4:5] == ["z"] else 4
    # Blank lines are skipped but counted: `numbers` holds the line number of each row.
    numbers = np.array([k for k, line in enumerate(lines[1:], start=2) if line.strip()], dtype=np.int64)
    if not numbers.size:
        raise InvalidFile([f"{path}:2:1: expected rows after the header, found none"])
    rows = [lines[k - 1] for k in numbers]
    try:
        table = np.loadtxt(rows, delimiter=",", usecols=range(width), ndmin=2, dtype=np.float64, comments=None)
    except ValueError:
        table = np.full((len(rows), width), np.nan)
    wrong = ~np.isfinite(table).all(axis=1) | (table[:, 1] != np.round(table[:, 1]))
    if np.any(wrong) or any("_" in row for row in rows):
        mistakes = _bad_cells(path, lines, numbers, width)
        if mistakes:
            raise InvalidFile(first_of(path, mistakes))
    return _by_agent(path, table, numbers, interpolation)


def _bad_cells(path: Path, lines: list[str], numbers: Indices, width: int) -> list[str]:
    """Return one message for each cell that is not a number."""
    mistakes = []
    for number in numbers:
        cells = lines[number - 1].split(",")
        if len(cells) < width:
            mistakes.append(f"{path}:{number}:1: expected at least {width} columns, found {len(cells)}")
            continue
        for cell, text in enumerate(cells[:width]):
            column = 1 + sum(len(before) + 1 for before in cells[:cell])
            value = _number(text)
            if value is None:
                mistakes.append(f"{path}:{number}:{column}: expected a number, found {text!r}")
            elif not np.isfinite(value):
                mistakes.append(f"{path}:{number}:{column}: expected a finite number, found {text!r}")
            elif cell == 1 and value != round(value):
                mistakes.append(f"{path}:{number}:{column}: expected a whole number, found {text!r}")
    return mistakes


def _number(text: str) -> float | None:
    """Return the number in a cell, None if it holds none; 1_000 is a number in Python, not in a file."""
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None


def _by_agent(path: Path, table: Array, numbers: Indices, interpolation: str) -> dict[int, Sampled]:
    order = np.lexsort((table[:, 0], table[:, 1]))
    table = table[order]
    starts = np.flatnonzero(np.diff(table[:, 1], prepend=np.nan) != 0)
    tracks, mistakes = {}, []
    for start, end in zip(starts, [*starts[1:], len(table)]):
        agent, rows = int(table[start, 1]), table[start:end]
        repeated = np.flatnonzero(np.diff(rows[:, 0]) == 0)
        if len(rows) < 2:
            mistakes.append(f"{path}:{numbers[order[start]]}:1: expected at least two rows of agent {agent}, found one")
        elif repeated.size:
            line = numbers[order[start + repeated[0] + 1]]
            mistakes.append(
                f"{path}:{line}:1: expected one row of agent {agent} at {rows[repeated[0], 0]:g} s, found two"
            )
        else:
            tracks[agent] = Sampled(rows[:, 0], rows[:, 2:], interpolation)
    if mistakes:
        raise InvalidFile(first_of(path, mistakes))
    return tracks


def csv_rows(path: Path) -> Rows:
    """Read columns t, id, x, y and, if present, z, radius, length, width and kind, in any order.

    An id may be any text.

    Raises:
        InvalidFile: an invalid header or cell.
    """
    table = comma_table(path, COLUMNS)
    axes = [name for name in ("x", "y", "z") if name in table.names]
    sizes = table.extents(radius="radius", length="length", width="width")
    kinds = table.texts("kind")
    return table.rows_of(table.ids("id"), table.numbers("t"), table.positions(*axes), extents=sizes, kinds=kinds)


def window(tracks: Iterable[Sampled], start: float, end: float) -> list[Sampled]:
    """Return the tracks that exist at some time between start and end [s]."""
    return [track for track in tracks if track.span[0] < end and track.span[1] > start]
