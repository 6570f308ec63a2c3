"""Readers of recorded pedestrians in the plane: ETH/UCY text, TrajNet++, PedPy text and JuPedSim databases."""

import json
import math
import re
import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.base.checks import Array, known, positive
from slalom.base.errors import InvalidFile
from slalom.base.tolerances import LARGEST
from slalom.io.recorded import Mistake, Rows, counted, refuse
from slalom.io.table import MAX_ROWS, Table, comma_table, file_size, spaced_rows, text_of

# ---------------------------------------------------------------------------------------------------------------------
# Reader of CADRL test cases (mit-acl/gym-collision-avoidance): CSV, one row per robot of a case.
#
# Header `case,agent,x,y,goal_x,goal_y,pref_speed,radius`; metres and m/s. Robots are discs that start at rest.


COLUMNS = ("case", "agent", "x", "y", "goal_x", "goal_y", "pref_speed", "radius")


class Case(NamedTuple):
    """A test case: its number, `starts` and `goals` (n, 2) [m], preferred `speeds` (n,) [m/s] and `radii` (n,) [m]."""

    number: int
    starts: Array
    goals: Array
    speeds: Array
    radii: Array


def read_cases(path: Path | str) -> list[Case]:
    """Read the cases of a file, by increasing number; the robots of a case are ordered by `agent`.

    Rows may be in any order.

    Raises:
        InvalidFile: no such file, an invalid header or cell, the same robot twice in a case.
    """
    table = comma_table(Path(path), COLUMNS)
    case, agent = (table.numbers(name, whole=True) for name in COLUMNS[:2])
    starts, goals = table.positions("x", "y"), table.positions("goal_x", "goal_y")
    speeds, radii = table.numbers("pref_speed"), table.numbers("radius")
    for name, values in (("pref_speed", speeds), ("radius", radii)):
        for k in np.flatnonzero(values <= 0.0):
            table.wrong(k, name, f"expected a number above 0, found {values[k]:g}")
    order = np.lexsort((agent, case))
    for k in order[1:][(np.diff(case[order]) == 0.0) & (np.diff(agent[order]) == 0.0)]:
        table.wrong(k, "agent", f"expected each agent once in a case, found {agent[k]:g} again in case {case[k]:g}")
    refuse(table.path, table.mistakes, table.location)
    groups = (order[case[order] == number] for number in np.unique(case))
    return [Case(int(case[rows[0]]), starts[rows], goals[rows], speeds[rows], radii[rows]) for rows in groups]


# ---------------------------------------------------------------------------------------------------------------------
# Rows of SQLite databases, read within bounds that a malformed file cannot exceed.


ROW_BYTES: Final = 8
"""[B] Least size of a row in a database: a file that holds more rows per byte holds the same page many times.

Larger: small databases could be refused. Smaller: malformed ones of some megabytes take longer to refuse.
"""

DATABASE_VALUE: Final = 100_000
"""[B] Length of a text in a database. Larger: a generated column takes gigabytes. Smaller: long remarks are refused."""

DATABASE_STEPS: Final = 100
"""[1] Operations of SQLite per row that a file of its size may hold, and at least as many as for 10000 rows.

A row of a table takes 7.

Larger: a view or a generated column without end is refused later. Smaller: slow queries of valid files are refused.
"""


INTERVAL: Final = 10_000
"""Number of operations of SQLite between two counts of them."""


def rows_of_queries(path: Path, kind: str, queries: Sequence[str]) -> list[list[tuple[Any, ...]]]:
    """Return the rows of each query of a database, which is opened for reading only.

    Views, generated columns and pages that occur many times can stand for rows without end. Hence the number of rows
    is bounded by the size of the file, and so are the operations of SQLite.

    Args:
        kind: of the database, for messages.

    Raises:
        InvalidFile: no such file, no database, a query that does not fit it or exceeds a bound.
    """
    size = file_size(path, kind)
    most = min(size // ROW_BYTES, MAX_ROWS)
    left = [max(most, 10_000) * DATABASE_STEPS // INTERVAL]

    def interrupted() -> bool:
        left[0] -= 1
        return left[0] < 0

    try:
        # sqlite3 would create a file that does not exist, if it were not opened for reading only.
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as database:
            database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, DATABASE_VALUE)
            database.set_progress_handler(interrupted, INTERVAL)
            found = [database.execute(query).fetchmany(most + 1) for query in queries]
    except (sqlite3.Error, UnicodeDecodeError) as error:
        text = "a query that does not end" if left[0] < 0 else error
        raise InvalidFile([f"{path}: expected a {kind}, found {text}"]) from None
    if any(len(rows) > most for rows in found):
        raise InvalidFile([f"{path}: expected at most {most} rows in a file of {size} bytes, found more"])
    return found


# ---------------------------------------------------------------------------------------------------------------------
# Readers of recorded pedestrians in the plane: ETH/UCY text, TrajNet++, PedPy text and JuPedSim databases.


ETH: Final = {4: ("frame", "id", "x", "y"), 8: ("frame", "id", "x", "z", "y", "vx", "vz", "vy")}
"""Columns of ETH/UCY files by their count; 8 columns are those of obsmat.txt, whose z is not used."""

VIDEO_RATES: Final = {10: 25.0, 6: 15.0}
"""[Hz] Frame rate of the video by the number of frames between annotations; both give 2.5 annotations per second."""

ROWS_PER_SECOND: Final = 2.5
"""[Hz] Row rate of TrajNet++ for scenes that state none."""

UNITS: Final = {"m": 1.0, "cm": 0.01}

_FRAME_RATE = re.compile(r"frame ?rate[\s:=]*(\d+(?:\.\d*)?)", re.IGNORECASE)
_UNIT = re.compile(r"\b(?:x/|in )(m|cm)\b", re.IGNORECASE)


def eth_ucy(path: Path, *, frame_rate: float | None = None) -> Rows:
    """Read ETH/UCY text: frame, id, x, y [m] separated by white space, or the eight columns of ETH's obsmat.txt.

    Args:
        frame_rate: [Hz] of the video. By default 25 for frames 10 apart and 15 for frames 6 apart.

    Raises:
        InvalidFile: invalid rows; frames neither 10 nor 6 apart and no `frame_rate`.
    """
    rows, lines, _ = spaced_rows(path)
    width = len(rows[0]) if rows else 4
    if width not in ETH:
        raise InvalidFile([f"{path}:{lines[0]}: expected 4 or 8 cells separated by white space, found {width}"])
    table = Table(path, ETH[width], rows, lines)
    ids, frames = table.ids("id", whole=True), table.numbers("frame", whole=True)
    positions = table.positions("x", "y")
    refuse(path, table.mistakes)
    step = _frame_step(frames)
    if frame_rate is None and step not in VIDEO_RATES:
        raise InvalidFile([f"{path}: expected frames 10 or 6 apart, or a frame_rate, found {step:g} apart and none"])
    rate = VIDEO_RATES[step] if frame_rate is None else positive(frame_rate, "frame_rate")
    return table.rows_of(ids, frames / rate, positions)


def _frame_step(frames: Array) -> int:
    """Return the greatest common divisor of the differences between frames; 0 if all frames are the same."""
    distinct = np.unique(frames).astype(np.int64)
    return math.gcd(*np.diff(distinct).tolist())


def trajnet(path: Path, *, frame_rate: float | None = None) -> Rows:
    """Read TrajNet++: one JSON object per line, {"scene": {...}} or {"track": {"f", "p", "x", "y"}}, in m.

    Predicted rows (with a prediction number) are left out, with a note.

    Args:
        frame_rate: [Hz] of the frame numbers. By default the number of frames between consecutive rows times the row
            rate. The row rate is the fps of the scenes, or 2.5 if the scenes state none.

    Raises:
        InvalidFile: a line that is neither a scene nor a track, scenes of different fps.
    """
    rows = []
    lines = []
    rates = dict[float, int]()
    mistakes = list[Mistake]()
    predicted = 0
    for number, line in enumerate(text_of(path).split("\n"), start=1):
        if not line.strip():
            continue
        content = _content(line)
        scene, track = content.get("scene"), content.get("track")
        if isinstance(scene, dict):
            fps = scene.get("fps", ROWS_PER_SECOND)
            if isinstance(fps, int | float) and 0.0 < fps <= LARGEST:
                rates.setdefault(float(fps), number)
            else:
                mistakes.append((number, f"fps: expected a number above 0, found {fps!r}"))
        elif not isinstance(track, dict):
            mistakes.append((number, f"expected a scene or a track, found {line[:60]!r}"))
        elif track.keys() & {"prediction_number", "pred_number"}:
            predicted += 1
        else:
            rows.append([track.get(name) for name in "fpxy"])
            lines.append(number)
    first, *others = rates or (ROWS_PER_SECOND,)
    mistakes += [(rates[fps], f"fps: expected {first:g} as in line {rates[first]}, found {fps:g}") for fps in others]
    refuse(path, mistakes)
    table = Table(path, "fpxy", rows, lines)
    ids = table.ids("p", whole=True)
    frames = table.numbers("f", whole=True)
    positions = table.positions("x", "y")
    refuse(path, table.mistakes)
    rate = first * max(_frame_step(frames), 1) if frame_rate is None else positive(frame_rate, "frame_rate")
    notes = [f"{counted(predicted, 'predicted row')} left out"] if predicted else []
    return table.rows_of(ids, frames / rate, positions, notes=notes)


def _content(line: str) -> dict[str, Any]:
    """Return the JSON object of a line; an empty one for any other content."""
    try:
        content = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def pedpy_text(path: Path, *, frame_rate: float | None = None, unit: str | None = None) -> Rows:
    """Read PedPy text and the pedestrian dynamics data archive: id, frame, x, y separated by white space.

    Further cells are ignored. Lines that begin with # are comments, which may state the frame rate (`framerate: 25`)
    and the unit (`x/cm`, `in m`).

    Args:
        frame_rate: [Hz]; required if the file states none.
        unit: m or cm; if neither the file nor this argument states one, m, with a note.

    Raises:
        InvalidFile: invalid rows, no frame rate, a stated frame rate or unit that differs from the given one.
    """
    rows, lines, comments = spaced_rows(path)
    rate, unit_stated = _stated(_FRAME_RATE, comments), _stated(_UNIT, comments)
    given = None if frame_rate is None else positive(frame_rate, "frame_rate")
    if unit is not None and unit_stated not in (None, known(unit, "unit", list(UNITS))):
        raise InvalidFile([f"{path}: expected the given unit {unit}, found {unit_stated}"])
    width = len(rows[0]) if rows else 4
    if width < 4:
        raise InvalidFile([f"{path}:{lines[0]}: expected 4 or more cells separated by white space, found {width}"])
    table = Table(path, ["id", "frame", "x", "y", *map(str, range(5, width + 1))], rows, lines)
    times = table.numbers("frame", whole=True) / _rate(path, None if rate is None else float(rate), given)
    positions = table.positions("x", "y") * UNITS[unit or unit_stated or "m"]
    notes = [] if unit or unit_stated else ["unit of the positions not stated: m assumed"]
    return table.rows_of(table.ids("id", whole=True), times, positions, notes=notes)


def _rate(path: Path, stated: float | None, given: float | None) -> float:
    """Return the frame rate [Hz] stated in a file or given; raise InvalidFile if both exist and differ."""
    rate = given if stated is None else stated
    if rate is None or rate <= 0.0 or given not in (None, rate):
        expected = "a frame rate above 0, in the file or given" if given is None else f"the frame rate of {given:g} Hz"
        raise InvalidFile([f"{path}: expected {expected}, found {'none' if rate is None else f'{rate:g} Hz'}"])
    return rate


def _stated(pattern: re.Pattern[str], comments: Sequence[str]) -> str | None:
    """Return the first group of the first match in the comments, in lower case; None without a match."""
    found = (match[1].lower() for line in comments if (match := pattern.search(line)))
    return next(found, None)


def jupedsim(path: Path) -> Rows:
    """Read a JuPedSim SQLite database, version 1 or 2: table trajectory_data, and the key fps of table metadata.

    Raises:
        InvalidFile: no such file or database, another version, no fps, cells that are not numbers.
    """
    query = "SELECT rowid, id, frame, pos_x, pos_y FROM trajectory_data ORDER BY rowid"
    stated, rows = rows_of_queries(path, "JuPedSim database", ("SELECT key, value FROM metadata", query))
    metadata = dict(stated)
    try:
        version, rate = int(metadata.get("version", 1)), float(metadata.get("fps", "none"))
    except (TypeError, ValueError, OverflowError):
        version, rate = 0, 0.0
    if version not in (1, 2) or not 0.0 < rate < np.inf:
        found = f"{metadata.get('version', 'none')} and {metadata.get('fps', 'none')}"
        raise InvalidFile([f"{path}: metadata: expected version 1 or 2 and fps above 0, found {found}"])
    location = "{path}: trajectory_data row {line}"
    table = Table(path, ["row", "id", "frame", "x", "y"], rows, (row[0] for row in rows), location)
    times = table.numbers("frame", whole=True) / rate
    return table.rows_of(table.ids("id", whole=True), times, table.positions("x", "y"))
