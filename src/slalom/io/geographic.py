"""Readers of ships (AIS) and aircraft (ADS-B): latitude and longitude, projected to metres east, north and up.

With WGS 84, a = 6378137 m, f = 1 / 298.257223563, e^2 = f (2 - f), the geocentric position of latitude p, longitude l
and height h is

    N = a / sqrt(1 - e^2 sin^2 p)
    X = (N + h) cos p cos l,  Y = (N + h) cos p sin l,  Z = (N (1 - e^2) + h) sin p

and, with the differences D from the geocentric position of the origin (p0, l0, h0),

    east  = -sin l0 DX + cos l0 DY
    north = -sin p0 (cos l0 DX + sin l0 DY) + cos p0 DZ
    up    =  cos p0 (cos l0 DX + sin l0 DY) + sin p0 DZ

(NIMA TR8350.2, 3rd edition). Distances in space are preserved. Take a point on the ground at distance d from the
origin. In the plane it is closer by about (d / R)^2 / 6 of d (4 mm at 10 km). It lies d^2 / 2R below the plane (7.8 m
at 10 km).
"""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, known, number, positive, vector
from slalom.base.errors import InvalidFile, InvalidInput
from slalom.io.recorded import Rows, counted, refuse
from slalom.io.table import Table, comma_table

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
    for field, values, limit in (("latitude", lat, 90.0), ("longitude", lon, 180.0)):
        for k in np.flatnonzero(valid & (np.abs(values) > limit)):
            table.wrong(k, names[field], f"expected from -{limit:g} to {limit:g} degrees, found {values[k]:g}")
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
    for field in given:
        known(field, "columns", list(COLUMNS))
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
