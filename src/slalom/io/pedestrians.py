"""Readers of recorded pedestrians whose files are no text tables: TrajNet++, splines, SQLite and HDF5 with walls."""

import json
import sqlite3
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.base.checks import Array, positive, shown
from slalom.base.errors import InvalidFile, InvalidInput, require
from slalom.base.tolerances import LARGEST
from slalom.io.hdf5 import Texts, member, numbers, read_tree, scalar
from slalom.io.layout import frame_step, length_unit
from slalom.io.limited import within_limits
from slalom.io.recorded import BOUNDING_BOX, Mistake, Rows, counted, refuse
from slalom.io.sheet import comma_table
from slalom.io.table import MAX_ROWS, Table, file_size, text_of

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


ROWS_PER_SECOND: Final = 2.5
"""[Hz] Row rate of TrajNet++ for scenes that state none."""

VIDEO_RATE: Final = 25.0
"""[Hz] Frame rate of the videos of UCY."""


RECORDS: Final = ("id", "frame", "x", "y")
"""Fields of HDF5 of the pedestrian dynamics data archive that are read."""


def trajnet(path: Path, *, frame_rate: float | None = None) -> Rows:
    """Read TrajNet++: one JSON object per line, {"scene": {...}} or {"track": {"f", "p", "x", "y"}}, in m.

    Predicted rows (with a prediction number) are left out, with a note.

    Args:
        frame_rate: [Hz] of the frame numbers. By default the median number of frames between consecutive rows of a
            pedestrian times the row rate. The row rate is the fps of the scenes, or 2.5 if the scenes state none.

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
    rate = first * max(frame_step(frames, ids[1]), 1) if frame_rate is None else positive(frame_rate, "frame_rate")
    notes = [f"{counted(predicted, 'predicted row')} left out"] if predicted else []
    return table.rows_of(ids, frames / rate, positions, notes=notes)


def _content(line: str) -> dict[str, Any]:
    """Return the JSON object of a line; an empty one for any other content."""
    try:
        content = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def vsp(path: Path, *, unit: float | str | None = None, frame_rate: float = VIDEO_RATE) -> Rows:
    """Read the splines of UCY: for each pedestrian, the number of control points, then x, y, frame and gaze of each.

    Args:
        unit: of the positions, which are in pixels from the middle of the image. frame_rate: [Hz] of the video.

    Raises:
        InvalidFile: no unit, a number of points that is none, cells that are not numbers.
    """
    metres, rate = length_unit(unit), positive(frame_rate, "frame_rate")
    if metres is None:
        raise InvalidFile(
            [f"{path}: expected a unit, as in unit=0.04 for 0.04 m in a pixel, found positions in pixels"]
        )
    lines = text_of(path).split("\n")
    rows, numbers = list[list[Any]](), list[int]()
    left = agent = 0
    for number, line in enumerate(lines[1:], start=2):
        cells = line.split()
        if not cells:
            continue
        if left:
            left -= 1
            rows.append([agent, *(cells + [""] * 3)[:3]])
            numbers.append(number)
        elif cells[0].isdigit() and len(cells[0]) < 10:
            agent, left = agent + 1, int(cells[0])
        else:
            raise InvalidFile([f"{path}:{number}: expected a number of control points, found {line[:60]!r}"])
    table = Table(path, ["id", "x", "y", "frame"], rows, numbers)
    notes = ["x and y count from the middle of the image"]
    times = table.numbers("frame", whole=True) / rate
    return table.rows_of(table.ids("id"), times, table.positions("x", "y") * metres, notes=notes)


def jupedsim(path: Path) -> Rows:
    """Read a JuPedSim SQLite database, version 1 or 2: table trajectory_data, and the key fps of table metadata.

    Walls are the borders of the areas of the table geometry, unless the metadata call them a bounding box.

    Raises:
        InvalidFile: no such file or database, another version, no fps, cells that are not numbers.
    """
    query = "SELECT rowid, id, frame, pos_x, pos_y FROM trajectory_data ORDER BY rowid"
    tables = "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = 'geometry'"
    stated, rows, geometry = rows_of_queries(
        path, "JuPedSim database", ("SELECT key, value FROM metadata", query, tables)
    )
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
    read = table.rows_of(table.ids("id", whole=True), times, table.positions("x", "y"))
    if not geometry or metadata.get("geometry") == BOUNDING_BOX:
        return read
    (texts,) = rows_of_queries(path, "JuPedSim database", ("SELECT DISTINCT wkt FROM geometry",))
    several = [f"the {len(texts)} areas of different times are all walls"] if len(texts) > 1 else []
    return replace(
        read,
        walls=tuple(ring for (text,) in texts for ring in _rings(path, "geometry", text)),
        notes=(*read.notes, *several),
    )


def pedpy_hdf5(path: Path) -> Rows:
    """Read HDF5 of the pedestrian dynamics data archive: records `trajectory` with id, frame, x and y [m].

    The attribute fps of the records is their frame rate [Hz]. Walls are the borders of the areas of the attribute
    wkt_geometry of the file, if it has one. Heights are not read: they are those of heads.

    Raises:
        InvalidFile: no such file, no HDF5, no such records or fps, values that are not numbers, another geometry.
        MissingExtra: h5py is not installed.
    """
    require("sim", f"{path.name}: HDF5")
    tree = read_tree(path)
    try:
        records = member(tree.groups, "trajectory")
        columns = [numbers(records.datasets, name) for name in RECORDS]
        rate = positive(scalar(records.attributes, "fps"), "fps")
        positive(1.0 / rate, "1 / fps")
        if any(values.shape != (columns[0].size,) for values in columns):
            raise InvalidInput(f"trajectory: expected a list, found shapes {[values.shape for values in columns]}")
    except InvalidInput as error:
        expected = "records `trajectory` with id, frame, x, y and the attribute fps"
        raise InvalidFile([f"{path}: expected {expected}, found {error}"]) from None
    # Of more than MAX_ROWS, one more is refused as well as all.
    rows = list(zip(*(values[: MAX_ROWS + 1].tolist() for values in columns)))
    table = Table(path, RECORDS, rows, range(1, len(rows) + 1), "{path}: trajectory row {line}", underscores=False)
    times = table.numbers("frame", whole=True) / rate
    read = replace(table.rows_of(table.ids("id", whole=True), times, table.positions("x", "y")), assumed=True)
    if "wkt_geometry" not in tree.attributes:
        return read
    stored = tree.attributes["wkt_geometry"]
    wkt = stored.texts[0] if isinstance(stored, Texts) and len(stored.texts) == 1 else stored
    return replace(read, walls=tuple(_rings(path, "wkt_geometry", wkt)))


def _rings(path: Path, name: str, wkt: Any) -> list[Array]:
    """Return the borders (n, 2) [m] of the areas of a text in WKT, first point last again; `name` is for messages."""
    text = wkt if isinstance(wkt, str) else ""
    tree, (points, counts) = within_limits(f"{path}: {name}", len(text), "areas in WKT", "wkt", text)
    rings = np.split(points, np.cumsum(counts)[: tree["areas"]])[: tree["areas"]]
    if not rings or not all(np.isfinite(ring).all() and np.abs(ring).max() <= LARGEST for ring in rings):
        raise InvalidFile([f"{path}: {name}: expected areas in WKT, found {shown(wkt)}"])
    return [ring[np.append(True, (ring[1:] != ring[:-1]).any(axis=1))] for ring in rings]
