"""Readers of recorded vehicles: cars in the plane, and ships and aircraft with positions on the globe."""

import io
import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, known, number, positive, vector
from slalom.base.errors import InvalidFile, InvalidInput
from slalom.io.recorded import Rows, counted, named, refuse
from slalom.io.table import Table, comma_table, text_of

# ---------------------------------------------------------------------------------------------------------------------
# Readers of recorded road users in the plane: drone data sets (highD, inD, rounD, exiD, uniD) and INTERACTION.


CENTRES: Final = ("trackId", "frame", "xCenter", "yCenter")
CORNERS: Final = ("id", "frame", "x", "y", "width", "height")
"""Columns of highD: corner of the bounding box with the smallest x and y, and its sides along x and y."""

CASES: Final = ("track_id", "timestamp_ms", "x", "y")

_SUFFIX = "_tracks.csv"
_RATE = "_recordingMeta.csv"
_CLASSES = "_tracksMeta.csv"


def drone(path: Path, *, frame_rate: float | None = None) -> Rows:
    """Read a drone data set: NN_tracks.csv, with NN_recordingMeta.csv and NN_tracksMeta.csv if they exist.

    inD, rounD, exiD and uniD give the centre, length and width. highD gives a corner of the bounding box, from which
    the centre is computed. Its y axis points down, which is kept and noted.

    Args:
        frame_rate: [Hz]; by default frameRate of the recordingMeta file.

    Raises:
        InvalidFile: invalid rows; no frame rate, or a stated one that differs from `frame_rate`.
    """
    table = comma_table(path, CENTRES, CORNERS)
    corners = "xCenter" not in table.names
    rate = _frame_rate(path, frame_rate)
    id_column, *_ = CORNERS if corners else CENTRES
    ids, times = table.ids(id_column, whole=True), table.numbers("frame", whole=True) / rate
    if corners:
        box = table.positions("width", "height")
        positions = table.positions("x", "y") + 0.5 * box
        extents, notes = {"length": box[:, 0], "width": box[:, 1]}, ["y points down, as in the file"]
    else:
        positions, notes = table.positions("xCenter", "yCenter"), []
        extents = table.extents(length="length", width="width")
    kinds = _kinds(path, id_column)
    of_rows = [kinds.get(ids[0][k], "") for k in ids[1].tolist()] if kinds else []
    return table.rows_of(ids, times, positions, extents=extents, kinds=of_rows, notes=notes)


def companions(path: Path) -> list[Path]:
    """Return the existing files that are read together with NN_tracks.csv."""
    return [other for suffix in (_RATE, _CLASSES) if (other := _companion(path, suffix))]


def _companion(path: Path, suffix: str) -> Path | None:
    """Return the file with this suffix that belongs to NN_tracks.csv; None if there is none."""
    other = path.with_name(path.name.removesuffix(_SUFFIX) + suffix)
    return other if path.name.endswith(_SUFFIX) and os.path.isfile(other) else None


def _frame_rate(path: Path, given: float | None) -> float:
    """Return the frame rate of the recording [Hz]."""
    rate = None if given is None else positive(given, "frame_rate")
    meta = _companion(path, _RATE)
    if meta is None and rate is not None:
        return rate
    stated = []
    if meta is not None:
        table = comma_table(meta, ("frameRate",))
        stated = table.numbers("frameRate").tolist()
        refuse(meta, table.mistakes)
    if len(stated) != 1 or stated[0] <= 0.0 or rate not in (None, stated[0]):
        expected = "one frameRate above 0" if rate is None else f"one frameRate of {rate:g} Hz, as given"
        where = meta or path.with_name(path.name.removesuffix(_SUFFIX) + _RATE)
        raise InvalidFile([f"{where}: expected {expected}, found {', '.join(f'{x:g}' for x in stated) or 'none'}"])
    return float(stated[0])


def _kinds(path: Path, id_column: str) -> dict[str, str]:
    """Return the class of each track by id; empty if there is no tracksMeta file."""
    meta = _companion(path, _CLASSES)
    if meta is None:
        return {}
    table = comma_table(meta, (id_column, "class"))
    labels, index = table.ids(id_column, whole=True)
    refuse(meta, table.mistakes)
    return {labels[k]: kind for k, kind in zip(index.tolist(), table.texts("class"))}


def interaction(path: Path, *, case: float | None = None) -> Rows:
    """Read INTERACTION: track_id, timestamp_ms, x, y and, if present, agent_type, length, width.

    Args:
        case: case_id to read from a file of several cases (version 1.2), each of which has its own time.

    Raises:
        InvalidFile: invalid rows; several cases without `case`, or no rows of `case`.
    """
    table = comma_table(path, CASES)
    chosen = None
    if "case_id" in table.names:
        cases = table.numbers("case_id")
        refuse(path, table.mistakes)
        chosen = cases == (cases[0] if case is None else case)
        if not chosen.any() or (case is None and not chosen.all()):
            expected = "one case, or the case to read" if case is None else f"case {case:g}"
            found = f"{np.unique(cases).size} from {cases.min():g} to {cases.max():g}"
            raise InvalidFile([f"{path}: case_id: expected {expected}, found {found}"])
    times = table.numbers("timestamp_ms") / 1000.0
    sizes, kinds = table.extents(length="length", width="width"), table.texts("agent_type")
    positions = table.positions("x", "y")
    return table.rows_of(table.ids("track_id"), times, positions, extents=sizes, kinds=kinds, keep=chosen)


# ---------------------------------------------------------------------------------------------------------------------
# Reader of the dynamic obstacles of CommonRoad scenarios, versions 2018b and 2020a, with exact states.
#
# Format: Althoff, Koschi and Manzinger, IV 2017, and the documentation of the two versions. Time is a whole number of
# steps of `timeStepSize` [s]; positions are in m.


VERSIONS: Final = ("2018b", "2020a")
EXTENTS: Final = ("radius", "length", "width")

_ZERO = re.compile(r"[+-]?(0+\.?0*|\.0+)")


def commonroad(path: Path) -> Rows:
    """Read every dynamic obstacle with a trajectory; other obstacles are left out, with a note.

    Raises:
        InvalidFile: no XML, another version, no time step, a state whose time or position is not exact.
    """
    root, lines = _parsed(path)
    version, interval = root.get("commonRoadVersion"), root.get("timeStepSize", "")
    if root.tag != "commonRoad" or version not in VERSIONS:
        raise InvalidFile(
            [f"{path}: expected a commonRoad of version {' or '.join(VERSIONS)}, found a {root.tag} of {version}"]
        )
    try:
        step = float(interval)
    except ValueError:
        step = np.nan
    if not 0.0 < step < np.inf:
        raise InvalidFile([f"{path}:{lines[root]}: timeStepSize: expected a number above 0, found {interval!r}"])
    obstacles = _ObstacleRows()
    for element in root:
        obstacles.obstacle(element)
    refuse(path, [(lines[state], text) for state, text in obstacles.mistakes])
    table = Table(
        path, ["id", "kind", *EXTENTS, "step", "x", "y"], obstacles.rows, (lines[state] for state in obstacles.states)
    )
    times = table.numbers("step", whole=True) * step
    sizes = table.extents(**{name: name for name in EXTENTS})
    return table.rows_of(
        table.ids("id"),
        times,
        table.positions("x", "y"),
        extents=sizes,
        kinds=table.texts("kind"),
        notes=obstacles.notes(),
    )


def _parsed(path: Path) -> tuple[ET.Element, dict[ET.Element, int]]:
    """Parse the file; return the root and the first line of each element.

    The pull parser is fed line by line because ElementTree does not keep line numbers.
    """
    parser: ET.XMLPullParser[ET.Element] = ET.XMLPullParser(("start",))
    lines: dict[ET.Element, int] = {}

    def note(line: int) -> None:
        for _, element in parser.read_events():  # type: ignore[misc]  # "start" events have one form
            assert isinstance(element, ET.Element)
            lines[element] = line

    try:
        for number, line in enumerate(io.StringIO(text_of(path)), start=1):
            parser.feed(line)
            note(number)
        parser.close()
        note(number)
    except ET.ParseError as error:
        raise InvalidFile([f"{path}:{error.position[0]}: expected XML, found {error}"]) from None
    return next(iter(lines)), lines


@dataclass
class _ObstacleRows:
    """Rows, mistakes and notes collected from the obstacles of a scenario."""

    rows: list[list[str]] = field(default_factory=list)
    states: list[ET.Element] = field(default_factory=list)
    mistakes: list[tuple[ET.Element, str]] = field(default_factory=list)
    static: int = 0
    without_trajectory: list[str] = field(default_factory=list)
    without_shape: list[str] = field(default_factory=list)

    def obstacle(self, element: ET.Element) -> None:
        """Add one child of the root if it is an obstacle."""
        if element.tag == "obstacle":
            role = element.findtext("role", "").strip()
        elif element.tag.endswith("Obstacle"):
            role = element.tag.removesuffix("Obstacle")
        else:
            return
        name, trajectory = element.get("id", ""), element.find("trajectory")
        if role != "dynamic":
            self.static += 1
        elif trajectory is None:
            self.without_trajectory.append(name)
        else:
            sizes = _extents(element.find("shape"))
            if sizes is None:
                self.without_shape.append(name)
            head = [name, element.findtext("type", "").strip(), *(sizes or ("", "", ""))]
            for state in (*element.findall("initialState"), *trajectory.findall("state")):
                self.state(head, state)

    def state(self, head: list[str], state: ET.Element) -> None:
        """Add the row of one state: time step and position."""
        cells = [state.findtext(at) for at in ("time/exact", "position/point/x", "position/point/y")]
        if None in cells:
            self.mistakes.append(
                (state, f"expected an exact time and position of obstacle {head[0]}, found {_tags(state)}")
            )
        else:
            self.rows.append([*head, *(cell or "" for cell in cells)])
            self.states.append(state)

    def notes(self) -> list[str]:
        """Return one note for each kind of omission."""
        notes = []
        if self.static:
            notes.append(f"{counted(self.static, 'obstacle')} left out: not dynamic")
        if self.without_trajectory:
            notes.append(
                f"{counted(len(self.without_trajectory), 'obstacle')} without a trajectory left out: "
                f"{named(self.without_trajectory, 'id')}"
            )
        if self.without_shape:
            notes.append(
                f"shape of {named(self.without_shape, 'obstacle')} unknown: neither one rectangle nor one circle"
            )
        return notes


def _extents(shape: ET.Element | None) -> tuple[str, str, str] | None:
    """Return the texts of radius, length and width; None unless the shape is one centred rectangle or circle."""
    parts = [] if shape is None else list(shape)
    if len(parts) != 1 or parts[0].tag not in ("rectangle", "circle"):
        return None
    transforms = (element.text or "" for element in parts[0].iter() if element.tag in ("x", "y", "orientation"))
    if any(not _ZERO.fullmatch(text.strip()) for text in transforms):
        return None
    radius, length, width = (parts[0].findtext(name, "") for name in EXTENTS)
    return radius, length, width


def _tags(state: ET.Element) -> str:
    """Describe the child elements of the time and the position of a state."""
    parts = (part for part in state if part.tag in ("time", "position"))
    return ", ".join(f"{part.tag} by {' and '.join(e.tag for e in part) or 'nothing'}" for part in parts) or "neither"


# ---------------------------------------------------------------------------------------------------------------------
# Readers of ships (AIS) and aircraft (ADS-B): latitude and longitude, projected to metres east, north and up.
#
# With WGS 84, a = 6378137 m, f = 1 / 298.257223563, e^2 = f (2 - f), the geocentric position of latitude p, longitude
# l and height h is
#
#     N = a / sqrt(1 - e^2 sin^2 p)
#     X = (N + h) cos p cos l,  Y = (N + h) cos p sin l,  Z = (N (1 - e^2) + h) sin p
#
# and, with the differences D from the geocentric position of the origin (p0, l0, h0),
#
#     east  = -sin l0 DX + cos l0 DY
#     north = -sin p0 (cos l0 DX + sin l0 DY) + cos p0 DZ
#     up    =  cos p0 (cos l0 DX + sin l0 DY) + sin p0 DZ
#
# (NIMA TR8350.2, 3rd edition). Distances in space are preserved. Take a point on the ground at distance d from the
# origin. In the plane it is closer by about (d / R)^2 / 6 of d (4 mm at 10 km). It lies d^2 / 2R below the plane (7.8
# m at 10 km).


AXIS: Final = 6378137.0
ECCENTRICITY_SQUARED: Final = (2.0 - 1.0 / 298.257223563) / 298.257223563

COLUMNS: Final[Mapping[str, tuple[str, ...]]] = {
    "time": ("basedatetime", "base_date_time", "date_time_utc", "timestamp", "datetime", "time", "t"),
    "id": ("mmsi", "icao24", "icao", "hex", "id"),
    "latitude": ("latitude", "lat"),
    "longitude": ("longitude", "lon", "lng", "long"),
    "altitude": ("geoaltitude", "geo_altitude", "altitude", "baroaltitude", "baro_altitude", "alt"),
    "length": ("length",),
    "width": ("width",),
    "kind": ("vesseltype", "vessel_type", "ship type", "category"),
}
"""Lower-case names of the columns of each field; the first one that a header contains is used."""

UNKNOWN_POSITION: Final = (91.0, 181.0)
"""[degree] Latitude and longitude that AIS transmits for an unknown position (ITU-R M.1371)."""


def project(
    latitude: npt.ArrayLike, longitude: npt.ArrayLike, altitude: npt.ArrayLike, origin: Sequence[float]
) -> Array:
    """Project latitude and longitude [degree] and altitude [m] to east, north and up (..., 3) [m].

    Args:
        origin: latitude, longitude [degree] and, 0 by default, altitude [m].
    """
    lat0, lon0, h0 = (*origin, 0.0)[:3]
    east, north = np.radians(lon0), np.radians(lat0)
    dx, dy, dz = np.moveaxis(_geocentric(latitude, longitude, altitude) - _geocentric(lat0, lon0, h0), -1, 0)
    horizontal = np.cos(east) * dx + np.sin(east) * dy
    return np.stack(
        [
            np.cos(east) * dy - np.sin(east) * dx,
            np.cos(north) * dz - np.sin(north) * horizontal,
            np.cos(north) * horizontal + np.sin(north) * dz,
        ],
        axis=-1,
    )


def _geocentric(latitude: npt.ArrayLike, longitude: npt.ArrayLike, altitude: npt.ArrayLike) -> Array:
    """Return geocentric X, Y, Z (..., 3) [m] of latitude and longitude [degree] and altitude [m]."""
    p = np.radians(latitude)
    q = np.radians(longitude)
    h = np.asarray(altitude, dtype=np.float64)
    normal = AXIS / np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(p) ** 2)
    horizontal = (normal + h) * np.cos(p)
    return np.stack(
        [horizontal * np.cos(q), horizontal * np.sin(q), (normal * (1.0 - ECCENTRICITY_SQUARED) + h) * np.sin(p)],
        axis=-1,
    )


def ais(
    path: Path,
    *,
    columns: Mapping[str, str | None] | None = None,
    origin: Sequence[float] | None = None,
    epoch: float | str | None = None,
) -> Rows:
    """Read ships in the plane: east and north [m]. As `adsb`, but without altitude unless `columns` names one."""
    return adsb(path, columns={"altitude": None, **(columns or {})}, origin=origin, epoch=epoch)


def adsb(
    path: Path,
    *,
    columns: Mapping[str, str | None] | None = None,
    origin: Sequence[float] | None = None,
    epoch: float | str | None = None,
    altitude_unit: float = 1.0,
) -> Rows:
    """Read aircraft, in space if the table has an altitude: time, id, latitude and longitude [degree] below a header.

    Length and width [m] and kind are read if such columns exist. Rows without a position are left out, with a note.

    Args:
        columns: column name of a field (a key of COLUMNS); None to ignore that field. Fields that are not given are
            found by their usual names.
        origin: latitude, longitude [degree] and, 0 by default, altitude [m]; the mean position if None, with a note.
        epoch: time 0, in seconds or in ISO 8601; the first time of the file if None, with a note. Times are in
            seconds, or in ISO 8601 if the first one is; times without a zone are UTC.
        altitude_unit: [m] unit of the altitude column, 0.3048 for feet.

    Raises:
        InvalidFile: invalid rows, a latitude beyond 90 or a longitude beyond 180 degrees.
        InvalidInput: invalid settings.
    """
    zero = None if epoch is None else _epoch(epoch)
    start = None if origin is None else _origin(origin)
    names, table = _columns(path, columns or {})
    stamps, in_words = _times(table, names["time"])
    ids = table.ids(names["id"], literal=True)
    lat, lon = (table.numbers(names[field], empty=True) for field in ("latitude", "longitude"))
    height, metres = names.get("altitude"), positive(altitude_unit, "altitude_unit")
    alt = table.numbers(height, empty=True) * metres if height else np.zeros(len(lat))
    valid = ~np.isnan(lat + lon + alt) & (lat != UNKNOWN_POSITION[0]) & (lon != UNKNOWN_POSITION[1])
    for column, values, limit in (("latitude", lat, 90.0), ("longitude", lon, 180.0)):
        for k in np.flatnonzero(valid & (np.abs(values) > limit)):
            table.wrong(k, names[column], f"expected from -{limit:g} to {limit:g} degrees, found {values[k]:g}")
    refuse(path, table.mistakes)
    if not valid.any():
        raise InvalidFile([f"{path}: expected rows with a position, found none"])
    left, notes = int(np.sum(~valid)), []
    if left:
        notes.append(f"{counted(left, 'row')} without a position left out")
    if start is None:
        start = _mean_position(lat[valid], lon[valid])
        notes.append(f"origin at the mean position: latitude {start[0]!r}, longitude {start[1]!r}")
    if zero is None:
        zero = float(stamps[valid].min())
        notes.append(f"time 0 at the first time: {datetime.fromtimestamp(zero, UTC).isoformat() if in_words else zero}")
    positions = project(lat, lon, alt, start)[:, : 3 if height else 2]
    sizes = table.extents(**{field: names[field] for field in ("length", "width") if field in names})
    kinds = table.texts(names.get("kind", ""))
    return table.rows_of(ids, stamps - zero, positions, extents=sizes, kinds=kinds, notes=notes, keep=valid)


def _columns(path: Path, given: Mapping[str, str | None]) -> tuple[dict[str, str], Table]:
    """Read the table; return the column name of each field that exists, and the table."""
    for key in given:
        known(key, "columns", list(COLUMNS))
    table = comma_table(path, [name for name in given.values() if name is not None])
    name_of = {name.lower(): name for name in reversed(table.names)}
    usual = {
        field: next((name_of[name] for name in names if name in name_of), None) for field, names in COLUMNS.items()
    }
    names = {field: name for field, name in {**usual, **given}.items() if name is not None}
    missing = [field for field in ("time", "id", "latitude", "longitude") if field not in names]
    if missing:
        expected, found = ", ".join(missing), ",".join(table.names)
        raise InvalidFile([f"{path}:1: expected columns of {expected}, or their names in columns, found {found!r}"])
    return names, table


def _mean_position(latitude: Array, longitude: Array) -> tuple[float, float]:
    """Return the mean position [degree]; longitudes are averaged as offsets within +-180 degrees of the first."""
    offset = (longitude - longitude[0] + 180.0) % 360.0 - 180.0
    return float(np.mean(latitude)), float(longitude[0] + np.mean(offset))


def _times(table: Table, name: str) -> tuple[Array, bool]:
    """Return the column in seconds, since 1970 if it is in ISO 8601, and whether it is in ISO 8601."""
    cells = table.texts(name)
    try:
        float(cells[0])
    except ValueError:
        stamps = np.zeros(len(cells))
        for k, cell in enumerate(cells):
            try:
                stamps[k] = _unix(cell)
            except ValueError:
                table.wrong(k, name, f"expected a time in ISO 8601 or in seconds, found {cell!r}")
        return stamps, True
    return table.numbers(name), False


def _unix(text: str) -> float:
    """Convert a time in ISO 8601 to seconds since 1970. Raises ValueError for any other text."""
    time = datetime.fromisoformat(text)
    return (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp()


def _epoch(value: float | str) -> float:
    try:
        return _unix(value) if isinstance(value, str) else number(value, "epoch")
    except ValueError as error:
        raise InvalidInput(f"epoch: expected seconds or a time in ISO 8601, found {value!r}") from error


def _origin(value: Sequence[float]) -> tuple[float, ...]:
    origin = tuple(vector(value, "origin").tolist())
    if abs(origin[0]) > 90.0 or abs(origin[1]) > 180.0:
        raise InvalidInput(f"origin: expected a latitude and a longitude in degrees, found {origin}")
    return origin
