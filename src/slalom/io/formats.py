"""Table of the formats of recorded tracks; reading and writing a file of any format."""

import csv
import inspect
import json
import math
import re
import sqlite3
import zlib
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from slalom.base.checks import Array, known, positive
from slalom.base.errors import InvalidFile, InvalidInput, reason
from slalom.base.registry import Kind, Registry
from slalom.base.tolerances import REST
from slalom.io import pedestrians, table, vehicles
from slalom.io.recorded import Agent, RecordedTracks, Rows, tracks_of
from slalom.io.table import beginning_of
from slalom.kernels.arrays import Indices

# ---------------------------------------------------------------------------------------------------------------------
# Writers of tracks: CSV, JuPedSim database and TrajNet++. Positions keep every bit.
#
# CSV also keeps every bit of a time. The other formats hold frame numbers, so every time must be a multiple of 1 /
# frame_rate.


FRAME_ROUNDING: Final = 1e-6
"""[1] Largest distance of a time from its frame, in frames, for formats that number frames.

Larger: times are changed by up to this when written. Smaller: rounding refuses tracks at whole frames.
"""


MARGIN: Final = 1.0
"""[m] Margin of the walkable area of a database around the bounding box of all positions."""

TABLES: Final = (
    "CREATE TABLE trajectory_data (frame INTEGER NOT NULL, id INTEGER NOT NULL, pos_x REAL NOT NULL, "
    "pos_y REAL NOT NULL, ori_x REAL NOT NULL, ori_y REAL NOT NULL)",
    "CREATE TABLE metadata (key TEXT NOT NULL UNIQUE PRIMARY KEY, value TEXT NOT NULL)",
    "CREATE TABLE geometry (hash INTEGER NOT NULL UNIQUE, wkt TEXT NOT NULL)",
    "CREATE TABLE frame_data (frame INTEGER NOT NULL, geometry_hash INTEGER NOT NULL)",
    "CREATE INDEX frame_id_idx ON trajectory_data (frame, id)",
)
"""SQL statements that create the tables of a JuPedSim database, version 2."""


def write_csv(path: Path | str, tracks: RecordedTracks) -> None:
    """Write CSV: t,id,x,y[,z] and, if any agent has them, radius, length, width and kind; by time, then agent.

    Raises:
        InvalidInput: no agents, agents of different dimensions.
        InvalidFile: a file that cannot be written.
    """
    agents = _agents_of(tracks)
    d = {agent.trajectory.dimension for agent in agents.values()}
    if len(d) > 1:
        raise InvalidInput(f"tracks: expected agents of the same dimension, found {sorted(d)}")
    known = [name for name in ("radius", "length", "width") if any(getattr(a, name) for a in agents.values())]
    kinds = ["kind"] if any(agent.kind for agent in agents.values()) else []
    rows = []
    for order, (label, agent) in enumerate(agents.items()):
        own = ["" if (size := getattr(agent, name)) is None else size for name in known] + [agent.kind for _ in kinds]
        track = agent.trajectory
        rows += [(t, order, label, *p, *own) for t, p in zip(track.times.tolist(), track.positions.tolist())]
    with _writing(path), open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["t", "id", *"xyz"[: d.pop()], *known, *kinds])
        writer.writerows((t, *rest) for t, _, *rest in sorted(rows, key=lambda row: row[:2]))


def write_jupedsim(path: Path | str, tracks: RecordedTracks, *, frame_rate: float) -> None:
    """Write a JuPedSim SQLite database, version 2, as read by PedPy and JuPedSim.

    The orientation is the direction of the velocity; while an agent rests, the last direction before or, at the start,
    the first one after. The walkable area, which the format requires, is the bounding box of all positions with a
    margin of MARGIN. The format has no extents and kinds.

    Args:
        frame_rate: [Hz] of the frame numbers.

    Raises:
        InvalidInput: agents that are not in the plane, ids that are not whole numbers, times off the frames.
        InvalidFile: a file that cannot be written.
    """
    agents = _frames_of(tracks, frame_rate)
    rows = [
        (frame, label, *position, *direction)
        for label, (agent, frames) in agents.items()
        for frame, position, direction in zip(frames.tolist(), agent.positions.tolist(), _directions(agent).tolist())
    ]
    points = np.concatenate([agent.positions for agent, _ in agents.values()])
    (xmin, ymin), (xmax, ymax) = (points.min(axis=0) - MARGIN).tolist(), (points.max(axis=0) + MARGIN).tolist()
    corners = [(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax), (xmin, ymin)]
    wkt = f"POLYGON (({', '.join(f'{x!r} {y!r}' for x, y in corners)}))"
    metadata = {"version": 2, "fps": float(frame_rate), "xmin": xmin, "xmax": xmax, "ymin": ymin, "ymax": ymax}
    all_frames = range(min(0, min(row[0] for row in rows)), max(row[0] for row in rows) + 1)
    with _writing(path):
        Path(path).unlink(missing_ok=True)
        with closing(sqlite3.connect(path)) as database, database:
            for table in TABLES:
                database.execute(table)
            geometry_hash = zlib.crc32(wkt.encode())
            database.execute("INSERT INTO geometry VALUES (?, ?)", (geometry_hash, wkt))
            database.executemany("INSERT INTO metadata VALUES (?, ?)", [(key, str(metadata[key])) for key in metadata])
            database.executemany(
                "INSERT INTO frame_data VALUES (?, ?)", [(frame, geometry_hash) for frame in all_frames]
            )
            database.executemany("INSERT INTO trajectory_data VALUES (?, ?, ?, ?, ?, ?)", sorted(rows))


def write_trajnet(path: Path | str, tracks: RecordedTracks, *, frame_rate: float) -> None:
    """Write TrajNet++: one scene over all frames, whose primary pedestrian is the first agent, then the rows by frame.

    The format has no extents and kinds. The fps of the scene is the number of rows per second, as the format defines.

    Args, Raises: as write_jupedsim.
    """
    agents = _frames_of(tracks, frame_rate)
    rows = [
        {"f": frame, "p": label, "x": x, "y": y}
        for label, (agent, frames) in agents.items()
        for frame, (x, y) in zip(frames.tolist(), agent.positions.tolist())
    ]
    rows.sort(key=lambda row: (row["f"], row["p"]))
    first, last = rows[0]["f"], rows[-1]["f"]
    step = math.gcd(*(int(row["f"] - first) for row in rows))
    scene = {"id": 0, "p": next(iter(agents)), "s": first, "e": last, "fps": frame_rate / step, "tag": 0}
    lines = [json.dumps({"scene": scene}), *(json.dumps({"track": row}) for row in rows)]
    with _writing(path):
        Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


@contextmanager
def _writing(path: Path | str) -> Iterator[None]:
    try:
        yield
    except (OSError, sqlite3.Error) as error:
        raise InvalidFile([f"{path}: expected a file that can be written, found {reason(error)}"]) from None


def _agents_of(tracks: RecordedTracks) -> dict[str, Agent]:
    if not tracks.agents:
        raise InvalidInput("tracks: expected at least one agent, found none")
    return dict(tracks.agents)


def _frames_of(tracks: RecordedTracks, frame_rate: float) -> dict[int, tuple[Any, Indices]]:
    """Return the trajectory and the frame numbers (n,) of each agent, by agent number."""
    rate = positive(frame_rate, "frame_rate")
    found = {}
    for label, agent in _agents_of(tracks).items():
        track = agent.trajectory
        if track.dimension != 2:
            raise InvalidInput(f"agent {label}: expected positions in the plane, found dimension {track.dimension}")
        if not re.fullmatch(r"0|-?[1-9]\d{0,17}", label):
            raise InvalidInput(f"agent {label}: expected a whole number as id, found {label!r}")
        frames = np.round(track.times * rate)
        off = np.abs(track.times * rate - frames)
        if off.max() > FRAME_ROUNDING or np.any(np.diff(frames) == 0):
            worst = track.times[np.argmax(off)]
            raise InvalidInput(f"agent {label}: expected different multiples of 1 / {rate:g} s, found {worst:g} s")
        found[int(label)] = track, frames.astype(np.int64)
    return found


def _directions(track: Any) -> Array:
    """Return the unit direction of motion (n, 2) at each time; of another time while the agent rests."""
    velocity = track.velocity(track.times)
    speed = np.linalg.norm(velocity, axis=1)
    moving = np.flatnonzero(speed > REST)
    if not moving.size:
        return np.tile([1.0, 0.0], (len(speed), 1))
    last = moving[np.maximum(np.searchsorted(moving, np.arange(len(speed)), side="right") - 1, 0)]
    return np.asarray(velocity[last] / speed[last, None])


# ---------------------------------------------------------------------------------------------------------------------
# Table of the formats of recorded tracks; reading and writing a file of any format.


RECOGNITION_BYTES: Final = 4096
"""Number of bytes at the start of a file from which its format is recognised."""


@dataclass(frozen=True)
class Format:
    """A format of recorded tracks: one row of the table.

    Attributes:
        name: name on the command line.
        sentence: description.
        agents: kind of agents if the file does not state it; "" if unknown.
        reader: function of a path and settings that returns the rows of the file.
        mark: description of the feature that identifies the format.
        recognises: predicate on the lower-case suffix and the first line that is not blank. No file satisfies the
            predicates of two formats.
        writer: function of a path, tracks and settings that writes a file; None for a format that is only read.
        suffix: suffix of the files that `writer` writes.
    """

    name: str
    sentence: str
    agents: str
    reader: Callable[..., Rows]
    mark: str
    recognises: Callable[[str, str], bool]
    writer: Callable[..., None] | None = None
    suffix: str = ""


def _header(*names: str) -> Callable[[str, str], bool]:
    """Return a predicate: the first line has cells of these names."""

    def recognises(suffix: str, line: str) -> bool:
        return {cell.strip() for cell in next(csv.reader([line]), [])}.issuperset(names)

    return recognises


def _geographic_header(name: str) -> Callable[[str, str], bool]:
    """Return a predicate: the first line names a column `name`, a latitude and a longitude, in any case."""

    def recognises(suffix: str, line: str) -> bool:
        cells = {cell.strip().lower() for cell in next(csv.reader([line]), [])}
        return name in cells and all(cells.intersection(vehicles.COLUMNS[field]) for field in ("latitude", "longitude"))

    return recognises


def _numbers(suffix: str, line: str) -> bool:
    """Return whether the first line holds four or eight numbers separated by white space."""
    try:
        return len([float(cell) for cell in line.split()]) in pedestrians.ETH
    except ValueError:
        return False


FORMATS: Final = Registry[Format](
    "slalom.formats",
    Kind(lambda part: isinstance(part, Format), "a Format of slalom.io.formats"),
    {
        row.name: row
        for row in (
            Format(
                "csv",
                "Slalom's own format: t, id, x, y and, if known, z, radius, length, width and kind; s and m.",
                "",
                table.csv_rows,
                "a header with t,id,x,y",
                _header("t", "id", "x", "y"),
                write_csv,
                ".csv",
            ),
            Format(
                "eth_ucy",
                "ETH and UCY pedestrians: frame, id, x, y separated by white space, or ETH's obsmat.txt.",
                "pedestrian",
                pedestrians.eth_ucy,
                "lines of 4 or 8 numbers separated by white space",
                _numbers,
            ),
            Format(
                "trajnet",
                "TrajNet++ pedestrians: scenes and tracks, one JSON object per line.",
                "pedestrian",
                pedestrians.trajnet,
                'lines that begin with {"scene" or {"track"',
                lambda suffix, line: line.replace(" ", "").startswith(('{"scene"', '{"track"')),
                write_trajnet,
                ".ndjson",
            ),
            Format(
                "pedpy",
                "PedPy text and the pedestrian dynamics data archive: id, frame, x, y below comment lines.",
                "pedestrian",
                pedestrians.pedpy_text,
                "a first line that begins with #",
                lambda suffix, line: line.lstrip().startswith("#"),
            ),
            Format(
                "jupedsim",
                "SQLite databases of JuPedSim.",
                "pedestrian",
                pedestrians.jupedsim,
                "the SQLite signature",
                lambda suffix, line: line.startswith("SQLite format 3"),
                write_jupedsim,
                ".sqlite",
            ),
            Format(
                "drone",
                "Drone data sets highD, inD, rounD, exiD and uniD: NN_tracks.csv.",
                "car",
                vehicles.drone,
                f"a header with {','.join(vehicles.CENTRES)} or {','.join(vehicles.CORNERS)}",
                lambda suffix, line: (
                    _header(*vehicles.CENTRES)(suffix, line) or _header(*vehicles.CORNERS)(suffix, line)
                ),
            ),
            Format(
                "interaction",
                "INTERACTION road users.",
                "car",
                vehicles.interaction,
                f"a header with {','.join(vehicles.CASES)}",
                _header(*vehicles.CASES),
            ),
            Format(
                "commonroad",
                "CommonRoad scenarios, 2018b and 2020a: dynamic obstacles.",
                "car",
                vehicles.commonroad,
                "the suffix .xml",
                lambda suffix, line: suffix == ".xml",
            ),
            Format(
                "ais",
                "Ships: tables with time, MMSI, latitude and longitude.",
                "ship",
                vehicles.ais,
                "a header with mmsi, a latitude and a longitude",
                _geographic_header("mmsi"),
            ),
            Format(
                "adsb",
                "Aircraft: tables with time, ICAO address, latitude, longitude and altitude.",
                "aircraft",
                vehicles.adsb,
                "a header with icao24, a latitude and a longitude",
                _geographic_header("icao24"),
            ),
        )
    },
)
"""Formats by name; packages add to them by entry points of the group slalom.formats."""


def read_recording(
    path: Path | str,
    format: str | None = None,
    *,
    gap: float | None = None,
    max_speed: float | None = None,
    interpolation: str = "smooth",
    **settings: Any,
) -> RecordedTracks:
    """Read the tracks of a file, with notes on all that was repaired, left out or assumed.

    Args:
        format: name in FORMATS; recognised from the file if None.
        gap: [s] split a track where its agent has no row for longer; never if None.
        max_speed: [m/s] a larger mean speed between consecutive rows is a mistake; no limit if None.
        interpolation: "smooth" or "linear", as of `Sampled`.
        settings: keyword arguments of the format's reader, such as frame_rate.

    Raises:
        InvalidFile: no such file, no matching format, rows that form no track; every mistake with its line.
        InvalidInput: an unknown format, unknown or invalid settings.
    """
    path = Path(path)
    row = FORMATS.find(format_of(path) if format is None else format, "format")
    _check(row.reader, row.name, settings)
    rows = row.reader(path, **settings)
    found = tracks_of(rows, gap=gap, max_speed=max_speed, interpolation=interpolation)
    return replace(found, format=row.name)


def format_of_suffix() -> dict[str, str]:
    """Return the name of the format that is written, by suffix of the file."""
    return {row.suffix: row.name for row in FORMATS.values() if row.writer}


def write_recording(path: Path | str, tracks: RecordedTracks, format: str, **settings: Any) -> None:
    """Write tracks to a file of a format that has a writer.

    Raises:
        InvalidInput: another format, unknown or invalid settings, tracks that the format cannot hold.
        InvalidFile: a file that cannot be written.
    """
    writer = FORMATS[known(format, "format", list(format_of_suffix().values()))].writer
    assert writer is not None
    _check(writer, format, settings)
    writer(Path(path), tracks, **settings)


def files_of(path: Path) -> list[Path]:
    """Return the file and the files that are read together with it."""
    return [path, *vehicles.companions(path)]


def writer_settings(name: str) -> list[str]:
    """Return the names of the settings of a writer: frame_rate if the format stores frame and agent numbers."""
    writer = FORMATS[known(name, "format", list(format_of_suffix().values()))].writer
    assert writer is not None
    return list(_keywords(writer))


def reader_settings(name: str) -> list[str]:
    """Return the names of the settings of the reader of a format, such as frame_rate."""
    return list(_keywords(FORMATS.find(name, "format").reader))


def format_of(path: Path) -> str:
    """Recognise the format of a file from its first RECOGNITION_BYTES bytes; return its name.

    Raises:
        InvalidFile: no such file, or no known format.
    """
    text = beginning_of(path, RECOGNITION_BYTES).decode("utf-8-sig", errors="replace")
    line = next((line for line in text.splitlines() if line.strip()), "")
    found = [row for row in FORMATS.values() if row.recognises(path.suffix.lower(), line)]
    if len(found) != 1:
        marks = "; ".join(f"{row.name}: {row.mark}" for row in FORMATS.values())
        raise InvalidFile(
            [f"{path}: expected a file of a known format, or the name of its format ({marks}), found {line[:60]!r}"]
        )
    return found[0].name


def _check(function: Callable[..., Any], name: str, settings: dict[str, Any]) -> None:
    """Raise InvalidInput unless `settings` holds only keywords of the function and all that it requires."""
    parameters = _keywords(function)
    needed = [p.name for p in parameters.values() if p.default is p.empty]
    if not set(needed) <= set(settings) <= set(parameters):
        expected = f"settings {', '.join(parameters) or 'none'}"
        if needed:
            expected += f", with {', '.join(needed)}"
        raise InvalidInput(f"{name}: expected {expected}, found {', '.join(settings) or 'none'}")


def _keywords(function: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """Return the keyword-only parameters of a reader or writer by name."""
    return {p.name: p for p in inspect.signature(function).parameters.values() if p.kind is p.KEYWORD_ONLY}
