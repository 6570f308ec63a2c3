"""Table of the formats of recorded tracks; reading and writing a file of any format."""

import codecs
import csv
import inspect
import json
import re
import sqlite3
import zlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely

from slalom.base.checks import Array, known, positive
from slalom.base.errors import InvalidFile, InvalidInput
from slalom.base.registry import Kind, Registry
from slalom.base.tolerances import REST
from slalom.base.writing import replacing, write_file
from slalom.io import pedestrians, vehicles
from slalom.io.layout import Layout, frame_step, length_unit, read_layout
from slalom.io.recorded import BOUNDING_BOX, Agent, RecordedTracks, Rows, tracks_of
from slalom.io.sheet import LENGTHS, beginning_sheet, parquet
from slalom.io.table import beginning_of
from slalom.kernels.arrays import Indices

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

WALL: Final = 0.01
"""[m] Half the thickness of walls in the walkable area. Larger: doors are narrower. Smaller: others lose them."""

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
    with replacing(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["t", "id", *"xyz"[: d.pop()], *known, *kinds])
        writer.writerows((t, *rest) for t, _, *rest in sorted(rows, key=lambda row: row[:2]))


def write_jupedsim(path: Path | str, tracks: RecordedTracks, *, frame_rate: float) -> None:
    """Write a JuPedSim SQLite database, version 2, as read by PedPy and JuPedSim.

    The orientation is the direction of the velocity; while an agent rests, the last direction before or, at the start,
    the first one after. The walkable area, which the format requires, is the bounding box of all positions and walls
    with a margin of MARGIN, without the walls: of its parts the one with most positions. The format has no extents and
    kinds.

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
    area = _walkable(points, tracks.walls)
    rings = (ring.coords for ring in (area.exterior, *area.interiors))
    texts = [", ".join(f"{x!r} {y!r}" for x, y in ring) for ring in rings]
    wkt = f"POLYGON ({', '.join(f'({text})' for text in texts)})"
    xmin, ymin, xmax, ymax = area.bounds
    metadata = {"version": 2, "fps": float(frame_rate), "xmin": xmin, "xmax": xmax, "ymin": ymin, "ymax": ymax}
    metadata |= {} if tracks.walls else {"geometry": BOUNDING_BOX}
    all_frames = range(min(0, min(row[0] for row in rows)), max(row[0] for row in rows) + 1)
    geometry_hash = zlib.crc32(wkt.encode())
    with replacing(path, sqlite3.Error) as part, closing(sqlite3.connect(part)) as database, database:
        for table in TABLES:
            database.execute(table)
        database.execute("INSERT INTO geometry VALUES (?, ?)", (geometry_hash, wkt))
        database.executemany("INSERT INTO metadata VALUES (?, ?)", [(key, str(metadata[key])) for key in metadata])
        database.executemany("INSERT INTO frame_data VALUES (?, ?)", [(frame, geometry_hash) for frame in all_frames])
        database.executemany("INSERT INTO trajectory_data VALUES (?, ?, ?, ?, ?, ?)", sorted(rows))


def _walkable(points: Array, walls: Sequence[Array]) -> Any:
    """Return the walkable area, a polygon of shapely, about positions (n, 2) [m] between walls."""
    xmin, ymin = (np.concatenate([points, *walls]).min(axis=0) - MARGIN).tolist()
    xmax, ymax = (np.concatenate([points, *walls]).max(axis=0) + MARGIN).tolist()
    box = shapely.Polygon([(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax)])
    if not walls:
        return box
    solid = [shapely.LineString(wall).buffer(WALL, join_style="mitre") for wall in walls]
    parts = shapely.get_parts(box.difference(shapely.union_all(solid)))
    return max(parts, key=lambda part: int(np.sum(shapely.contains_xy(part, points))))


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
    owned = np.repeat(np.arange(len(agents)), [len(frames) for _, frames in agents.values()])
    step = max(1, frame_step(np.concatenate([frames for _, frames in agents.values()]), owned))
    scene = {"id": 0, "p": next(iter(agents)), "s": first, "e": last, "fps": frame_rate / step, "tag": 0}
    lines = [json.dumps({"scene": scene}), *(json.dumps({"track": row}) for row in rows)]
    write_file(path, "\n".join(lines) + "\n")


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
        recognises: predicate on the lower-case suffix and the beginning of the text. The first format whose predicate
            holds is taken, csv last.
        writer: function of a path, tracks and settings that writes a file; None for a format that is only read.
        suffix: suffix of the files that `writer` writes. layout: of a table; None for other formats.
    """

    name: str
    sentence: str
    agents: str
    reader: Callable[..., Rows]
    mark: str
    recognises: Callable[[str, str], bool]
    writer: Callable[..., None] | None = None
    suffix: str = ""
    layout: Layout | None = None


def _table(name: str, sentence: str, agents: str, mark: str, layout: Layout, **writing: Any) -> Format:
    """Return the format of tables of a layout."""

    def recognises(suffix: str, text: str) -> bool:
        sheet = beginning_sheet(Path(suffix), text)
        return sheet is not None and layout.fits(sheet)

    return Format(name, sentence, agents, partial(read_layout, layout), mark, recognises, layout=layout, **writing)


def _begins(pattern: str) -> Callable[[str, str], bool]:
    """Return a predicate: the text begins with the pattern, after white space and an XML declaration and comments."""
    compiled = re.compile(rf"\s*(?:<\?.*?\?>\s*|<!--.*?-->\s*)*(?:{pattern})", re.DOTALL)
    return lambda suffix, text: compiled.match(text) is not None


_BOXES = "position: the centre of the box; y points down, as in the file"

FORMATS: Final = Registry[Format](
    "slalom.formats",
    Kind(lambda part: isinstance(part, Format), "a Format of slalom.io.formats"),
    {
        row.name: row
        for row in (
            _table(
                "csv",
                "Any table: t or frame, id, x, y or latitude, longitude; if known, z, radius, length, width, kind.",
                "",
                "a header with t or frame, id, x, y, by their usual names",
                Layout(),
                writer=write_csv,
                suffix=".csv",
            ),
            _table(
                "eth_ucy",
                "ETH and UCY pedestrians: frame, id, x, y separated by white space, or ETH's obsmat.txt.",
                "pedestrian",
                "lines of 4 or 8 numbers separated by white space",
                Layout(
                    "frame=frame id=id x=x y=y",
                    named=False,
                    cells="[ ,;]n{4}| n{8}",
                    names=("frame id x z_ y vx vz vy", "frame id x y"),
                    either=True,
                    rates={10: 25.0, 6: 15.0},
                ),
            ),
            Format(
                "trajnet",
                "TrajNet++ pedestrians: scenes and tracks, one JSON object per line.",
                "pedestrian",
                pedestrians.trajnet,
                'lines that begin with {"scene" or {"track"',
                _begins(r'\{\s*"(?:scene|track)"'),
                write_trajnet,
                ".ndjson",
            ),
            _table(
                "pedpy",
                "PedPy text and the pedestrian dynamics data archive: id, frame, x, y separated by white space.",
                "pedestrian",
                "lines of 4 or more numbers below comments, or a header with id, frame, x, y, separated by white space",
                Layout(
                    "frame=frame|frame_id id=id|pers_id|person_id|ped_id x=x y=y",
                    named=False,
                    cells="#? h|#[ ,;]n{4,}| n{5,7}",
                    names=("id frame x y",),
                    either=True,
                    assumed=True,
                ),
            ),
            Format(
                "jupedsim",
                "SQLite databases of JuPedSim, with the borders of the walkable area as walls.",
                "pedestrian",
                pedestrians.jupedsim,
                "the SQLite signature",
                _begins("SQLite format 3"),
                write_jupedsim,
                ".sqlite",
            ),
            Format(
                "pedpy_hdf5",
                "HDF5 of the pedestrian dynamics data archive, with the borders of the walkable area as walls.",
                "pedestrian",
                pedestrians.pedpy_hdf5,
                "the HDF5 signature, in a file that is no run of slalom",
                # The names in the root group of a run of slalom are at its beginning.
                lambda suffix, text: text[1:4] == "HDF" and "run_0" not in text[:RECOGNITION_BYTES],
            ),
            _table(
                "vadere",
                "Steps of pedestrians of Vadere.",
                "pedestrian",
                "a header with pedestrianId, simTime, startX and startY",
                Layout(
                    "t=simTime id=pedestrianId x=startX y=startY t_end=endTime x_end=endX y_end=endY",
                    "endTime endX endY",
                    named=False,
                ),
            ),
            _table(
                "viswalk",
                "Pedestrians of Viswalk: a .pp file.",
                "pedestrian",
                "a header with NO, SIMSEC, COORDCENTX and COORDCENTY",
                Layout("t=simsec id=no x=coordcentx y=coordcenty", named=False),
            ),
            Format(
                "ucy_splines",
                "Splines of UCY pedestrians, in pixels: .vsp.",
                "pedestrian",
                pedestrians.vsp,
                "a first line with a number of splines",
                _begins(r"\d+\s+-\s+the number of splines"),
            ),
            _table(
                "sdd",
                "Stanford Drone Dataset: annotations.txt, boxes in pixels, 30 frames per second.",
                "pedestrian",
                "lines of 9 numbers and a label",
                Layout(
                    "x=0.5*xmin+0.5*xmax y=0.5*ymin+0.5*ymax kind=label",
                    cells=" n{9}t",
                    names=("id xmin ymin xmax ymax frame lost occluded generated label",),
                    rate=30.0,
                    unit=None,
                    left_out={"lost": (1.0, "outside of the view")},
                    notes=(_BOXES,),
                ),
            ),
            _table(
                "mot",
                "MOT Challenge: boxes in pixels, by frame and id.",
                "pedestrian",
                "lines of 7 to 10 numbers separated by commas",
                Layout(
                    "x=left+0.5*box y=top+0.5*height",
                    cells=",n{7,10}",
                    names=("frame id left top box height confidence class_ visible",),
                    unit=None,
                    left_out={"confidence": (0.0, "not to be considered")},
                    notes=(_BOXES,),
                ),
            ),
            Format(
                "drone",
                "Drone data sets highD, inD, rounD, exiD and uniD: NN_tracks.csv.",
                "car",
                vehicles.drone,
                f"a header with {','.join(vehicles.CENTRES)} or {','.join(vehicles.CORNERS)}",
                lambda suffix, text: any(
                    set(names) <= {cell.strip() for cell in text.lstrip().split("\n", 1)[0].split(",")}
                    for names in (vehicles.CENTRES, vehicles.CORNERS)
                ),
            ),
            _table(
                "interaction",
                "INTERACTION and SinD road users.",
                "car",
                "a header with track_id, frame_id, timestamp_ms, x and y",
                Layout("z= case=case_id", "track_id timestamp_ms"),
            ),
            _table(
                "ngsim",
                "NGSIM vehicles, in feet, 10 frames per second.",
                "car",
                "a header with Vehicle_ID, Frame_ID, Local_X, Local_Y and v_Class, or lines of 18 numbers",
                Layout(
                    "frame=Frame_ID id=Vehicle_ID x=Local_X y=Local_Y length=v_Length width=v_Width kind=v_Class",
                    "v_Class",
                    named=False,
                    cells=" n{18}|.h",
                    names=(
                        "Vehicle_ID Frame_ID Total_Frames Global_Time Local_X Local_Y Global_X Global_Y v_Length "
                        "v_Width v_Class",
                    ),
                    rate=10.0,
                    unit=LENGTHS["ft"],
                    kinds={"1": "motorcycle", "2": "car", "3": "truck"},
                    notes=("lengths in feet; position: the centre of the front",),
                ),
            ),
            _table(
                "kitti",
                "KITTI tracking labels: positions before the camera, 10 frames per second.",
                "car",
                "lines of 17 or 18 cells, the third of which is a type",
                Layout(
                    "x=depth y=-right",
                    cells=" nntn{14,15}",
                    names=(
                        "frame id type truncated occluded alpha left top end bottom height width length right down "
                        "depth rotation score",
                    ),
                    rate=10.0,
                    left_out={"id": (-1.0, "without a track")},
                    notes=("positions in the frame of the camera, x ahead and y left: its own motion is unknown",),
                ),
            ),
            _table(
                "argoverse",
                "Argoverse 2 motion forecasting: scenario_*.parquet, 10 steps per second.",
                "car",
                "a table with track_id, object_type, timestep, position_x and position_y",
                Layout("t= frame=timestep z=", "object_type timestep position_x position_y", rate=10.0),
            ),
            Format(
                "nuscenes",
                "nuScenes: sample_annotation.json, with the tables sample, instance and category beside it.",
                "car",
                vehicles.nuscenes,
                "JSON records with sample_token and instance_token",
                lambda suffix, text: suffix == ".json" and '"sample_token"' in text and '"instance_token"' in text,
            ),
            Format(
                "commonroad",
                "CommonRoad scenarios, 2018b and 2020a: dynamic obstacles, static ones as walls.",
                "car",
                vehicles.commonroad,
                "an XML element commonRoad",
                _begins("<commonRoad"),
            ),
            Format(
                "sumo",
                "SUMO's output fcd-export: vehicles and persons.",
                "car",
                vehicles.sumo,
                "an XML element fcd-export",
                _begins("<fcd-export"),
            ),
            _table(
                "ais",
                "Ships: tables with time, MMSI, latitude and longitude.",
                "ship",
                "a header with mmsi, a latitude and a longitude",
                Layout("id=mmsi altitude= x= y=", "mmsi", from_first=True, day_first=True),
            ),
            _table(
                "traffic",
                "Aircraft as the Python package traffic writes them: altitude in feet.",
                "aircraft",
                "a header with icao24, groundspeed, vertical_rate and altitude",
                Layout(
                    "id=icao24 x= y=",
                    "icao24 groundspeed vertical_rate altitude",
                    from_first=True,
                    altitude_unit=LENGTHS["ft"],
                    notes=("altitude in feet, as the package traffic writes it",),
                ),
            ),
            _table(
                "adsb",
                "Aircraft: tables with time, ICAO address, latitude, longitude and altitude.",
                "aircraft",
                "a header with icao24, a latitude and a longitude",
                Layout("id=icao24 x= y=", "icao24", from_first=True),
            ),
        )
    },
)
"""Formats by name; packages add to them by entry points of the group slalom.formats."""

_WALLS = "walls, not a recording: --walls reads them"

_NO_RECORDINGS: Final[Mapping[str, str]] = {
    r"PK\x03\x04": "a zip archive: unpack it",
    r"\N{REPLACEMENT CHARACTER}HDF": "a run of slalom, which is over: `slalom show` prints it",
    r"<OpenSCENARIO": "a scenario of OpenSCENARIO, not a recording",
    r"<OpenDRIVE": "roads of OpenDRIVE, not a recording",
    r"<osm": "a map of OpenStreetMap, not a recording",
    r"\{.{0,200}\"filename\"": "annotations of the VGG Image Annotator (VIA), which have no times",
    r"\{\s*\"time\".{0,40}\"states\"": "one time of aircraft of OpenSky: a recording has two or more",
    r"[!\\]AIV": "AIS sentences (NMEA 0183) with checksums, each of one position: decode them to a table with MMSI",
    r"\d\d:\d\d:\d\d(?:\.\d+)?>": "a scenario of BlueSky, not a recording",
    r"case,agent,x,y,goal_x": "starts and goals of CADRL, not a recording: `slalom compare` runs them",
    r"type \w+\s+height \d": f"a map of MovingAI: {_WALLS}",
    r"version [\d.]+\s+\d+\t": "tasks of MovingAI: starts and goals, not a recording",
    r"image:|(?:\w+:[^\n]*\n)+image:": f"a map of nav2: {_WALLS}",
    r"P[25]\s": "an image of a map, not a recording: its yaml file has the scale",
    r"(?:MULTI)?(?:POLYGON|LINESTRING|POINT)|GEOMETRYCOLLECTION": f"shapes in WKT: {_WALLS}",
    r"\{.{0,200}\"(?:FeatureCollection|Feature|Polygon|LineString)\"": f"shapes in GeoJSON: {_WALLS}",
    r"0\s+SECTION": f"a drawing in DXF: {_WALLS}",
}
"""What other files are, by the pattern with which they begin."""


def read_recording(
    path: Path | str,
    format: str | None = None,
    *,
    gap: float | None = None,
    max_speed: float | None = None,
    interpolation: str = "smooth",
    keep: str | None = None,
    **settings: Any,
) -> RecordedTracks:
    """Read the tracks of a file, with notes on all that was repaired, left out or assumed.

    Args:
        format: name in FORMATS; recognised from the file if None.
        gap: [s] split a track where its agent has no row for longer, never for inf; None: where the motion over a
            gap is not the agent's own, as where ids are used again.
        max_speed: [m/s] a larger mean speed between consecutive rows is a mistake; no limit if None.
        interpolation: "smooth" or "linear", as of `Sampled`.
        keep: which of several rows of an agent at one time is read, "first" or "last"; such rows are a mistake if None.
        settings: keyword arguments of the format's reader, such as frame_rate; with every format `unit`, of lengths.

    Raises:
        InvalidFile: no such file, no matching format, rows that form no track; every mistake with its line; an assumed
            unit that gives a median speed that no agent of the kind has.
        InvalidInput: an unknown format, unknown or invalid settings.
    """
    path = Path(path)
    row = FORMATS.find(format_of(path, "columns" in settings) if format is None else format, "format")
    metres = None if "unit" in _keywords(row.reader) else length_unit(settings.pop("unit", None))
    _check(row.reader, row.name, settings)
    rows = row.reader(path, **settings)
    rows = rows if metres is None else rows.scaled(metres)
    found = tracks_of(rows, gap=gap, max_speed=max_speed, interpolation=interpolation, keep=keep)
    warnings = found.implausible(row.agents, path if rows.assumed else None)
    return replace(found, format=row.name, notes=(*found.notes, *warnings))


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
    """Return the names of the settings with which a format is read, such as frame_rate."""
    return list(dict.fromkeys((*_keywords(FORMATS.find(name, "format").reader), "unit")))


def format_of(path: Path, columns: bool = False) -> str:
    """Recognise the format of a file from its first RECOGNITION_BYTES bytes; return its name.

    Args:
        columns: whether columns are given: a table of no known format is then one of csv.

    Raises:
        InvalidFile: no such file, or no known format; the message says what the file is, or which formats are nearest.
    """
    text = _beginning(path)
    suffix = path.suffix.lower() if path.suffix.lower() != ".gz" else Path(path.stem).suffix.lower()
    found = [row.name for row in FORMATS.values() if row.recognises(suffix, text)]
    if found:
        return next((name for name in found if name != "csv"), "csv")
    what = next((what for pattern, what in _NO_RECORDINGS.items() if _begins(pattern)(suffix, text)), None)
    if tracks := vehicles.tracks_of_meta(path):
        what = f"a file about a recording: name {tracks.name}"
    if what is not None:
        raise InvalidFile([f"{path}: expected a recording, found {what}"])
    sheet = beginning_sheet(path, text)
    if columns and sheet is not None:
        return "csv"
    line = next((line for line in text.splitlines() if line.strip()), "")
    tables = [row for row in FORMATS.values() if row.layout and re.fullmatch(row.layout.cells, ",h")]
    lacking = {row.name: row.layout.missing(sheet) for row in tables if row.layout and sheet}
    nearest = "; ".join(
        f"{name} ({FORMATS[name].mark}), without {', '.join(lacking[name])}"
        for name in sorted(lacking, key=lambda name: len(lacking[name]))[:2]
    )
    raise InvalidFile(
        [
            f"{path}: expected a file of a known format (`slalom list formats`), found {line[:60]!r}"
            f"{f'; nearest: {nearest}; --columns names other columns' if nearest else ''}"
        ]
    )


def _beginning(path: Path) -> str:
    """Return the beginning of the text of a file; the names of its columns for Parquet."""
    content = beginning_of(path, RECOGNITION_BYTES)
    if content.startswith(b"PAR1"):
        return ",".join(parquet(path, names_only=True).names) + "\n"
    marked = "utf-16" if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8-sig"
    return content.decode(marked, errors="replace").replace("\r\n", "\n").replace("\r", "\n")


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
