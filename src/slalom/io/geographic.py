"""Tables of latitudes and longitudes: ships (AIS) and aircraft (ADS-B), projected to metres east, north and up.

With WGS 84, a = 6378137 m, f = 1 / 298.257223563, e^2 = f (2 - f), latitude p, longitude l and height h are the place

    N = a / sqrt(1 - e^2 sin^2 p)
    X = (N + h) cos p cos l,  Y = (N + h) cos p sin l,  Z = (N (1 - e^2) + h) sin p

and, with the differences D to the same of the origin (p0, l0, h0),

    east  = -sin l0 DX + cos l0 DY
    north = -sin p0 (cos l0 DX + sin l0 DY) + cos p0 DZ
    up    =  cos p0 (cos l0 DX + sin l0 DY) + sin p0 DZ

(NIMA TR8350.2, 3rd edition). Distances in space are kept; on the ground a distance d from the origin is shorter in the
plane by about (d / R)^2 / 6 of it, 4 mm at 10 km, and lies d^2 / 2R below it, 7.8 m at 10 km.
"""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, known, number, positive, vector
from slalom.errors import InvalidFile, InvalidInput
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
"""Names, in small letters, by which a column is recognised, the first that a header has."""

NOWHERE: Final = (91.0, 181.0)
"""[degree] Latitude and longitude that AIS sends where it knows none (ITU-R M.1371)."""


def project(
    latitude: npt.ArrayLike, longitude: npt.ArrayLike, altitude: npt.ArrayLike, origin: Sequence[float]
) -> Array:
    """East, north and up (..., 3) [m] of an origin (latitude, longitude[, altitude]) [degree, degree, m]."""
    lat0, lon0, h0 = (*origin, 0.0)[:3]
    east, north = np.radians(lon0), np.radians(lat0)
    dx, dy, dz = np.moveaxis(_geocentric(latitude, longitude, altitude) - _geocentric(lat0, lon0, h0), -1, 0)
    outward = np.cos(east) * dx + np.sin(east) * dy
    return np.stack(
        [
            np.cos(east) * dy - np.sin(east) * dx,
            np.cos(north) * dz - np.sin(north) * outward,
            np.cos(north) * outward + np.sin(north) * dz,
        ],
        axis=-1,
    )


def _geocentric(latitude: npt.ArrayLike, longitude: npt.ArrayLike, altitude: npt.ArrayLike) -> Array:
    """X, Y, Z (..., 3) [m] from degrees and m."""
    p, q, h = np.radians(latitude), np.radians(longitude), np.asarray(altitude, dtype=np.float64)
    normal = AXIS / np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(p) ** 2)
    away = (normal + h) * np.cos(p)
    return np.stack(
        [away * np.cos(q), away * np.sin(q), (normal * (1.0 - ECCENTRICITY_SQUARED) + h) * np.sin(p)], axis=-1
    )


def ais(
    path: Path,
    *,
    columns: Mapping[str, str | None] | None = None,
    origin: Sequence[float] | None = None,
    epoch: float | str | None = None,
) -> Rows:
    """Ships in the plane: east and north [m]. As `adsb`, without altitude unless `columns` name one."""
    return adsb(path, columns={"altitude": None, **(columns or {})}, origin=origin, epoch=epoch)


def adsb(
    path: Path,
    *,
    columns: Mapping[str, str | None] | None = None,
    origin: Sequence[float] | None = None,
    epoch: float | str | None = None,
    altitude_unit: float = 1.0,
) -> Rows:
    """Aircraft, in space where there is an altitude: time, id, latitude and longitude [degree] under a header.

    Length and width [m] and kind are read where there are such columns. Rows without a place are left out, with a note.

    Args:
        columns: names of columns by what they are (a key of COLUMNS); None for one that is not to be read. Others are
            found by their usual names.
        origin: latitude, longitude [degree] and, 0 if not given, altitude [m]; the mean place if None, which is noted.
        epoch: time 0, in seconds or in ISO 8601; the first time of the file if None, which is noted. Times are seconds,
            or ISO 8601 if the first is; those without a zone are UTC.
        altitude_unit: [m] of the column, 0.3048 for feet.

    Raises:
        InvalidFile: rows that do not fit, a latitude beyond 90 or a longitude beyond 180 degrees.
        InvalidInput: settings that do not fit.
    """
    zero = None if epoch is None else _epoch(epoch)
    start = None if origin is None else _origin(origin)
    names, table = _columns(path, columns or {})
    stamps, in_words = _times(table, names["time"])
    ids = table.ids(names["id"], literal=True)
    lat, lon = (table.numbers(names[what], empty=True) for what in ("latitude", "longitude"))
    height, metres = names.get("altitude"), positive(altitude_unit, "altitude_unit")
    alt = table.numbers(height, empty=True) * metres if height else np.zeros(len(lat))
    there = ~np.isnan(lat + lon + alt) & (lat != NOWHERE[0]) & (lon != NOWHERE[1])
    for what, values, limit in (("latitude", lat, 90.0), ("longitude", lon, 180.0)):
        for k in np.flatnonzero(there & (np.abs(values) > limit)):
            table.wrong(k, names[what], f"expected from -{limit:g} to {limit:g} degrees, found {values[k]:g}")
    refuse(path, table.mistakes)
    if not there.any():
        raise InvalidFile([f"{path}: expected rows with a place, found none"])
    left, notes = int(np.sum(~there)), []
    if left:
        notes.append(f"{counted(left, 'row')} without a place left out")
    if start is None:
        start = _mean(lat[there], lon[there])
        notes.append(f"origin at the mean place: latitude {start[0]!r}, longitude {start[1]!r}")
    if zero is None:
        zero = float(stamps[there].min())
        notes.append(
            f"times count from the first: {datetime.fromtimestamp(zero, UTC).isoformat() if in_words else zero}"
        )
    positions = project(lat, lon, alt, start)[:, : 3 if height else 2]
    sizes = table.extents(**{what: names[what] for what in ("length", "width") if what in names})
    kinds = table.texts(names.get("kind", ""))
    return table.rows_of(ids, stamps - zero, positions, extents=sizes, kinds=kinds, notes=notes, keep=there)


def _columns(path: Path, given: Mapping[str, str | None]) -> tuple[dict[str, str], Table]:
    """The name of each column that there is, by what it is."""
    for what in given:
        known(what, "columns", list(COLUMNS))
    table = comma_table(path, [name for name in given.values() if name is not None])
    small = {name.lower(): name for name in reversed(table.names)}
    usual = {what: next((small[name] for name in names if name in small), None) for what, names in COLUMNS.items()}
    names = {what: name for what, name in {**usual, **given}.items() if name is not None}
    missing = [what for what in ("time", "id", "latitude", "longitude") if what not in names]
    if missing:
        expected, found = ", ".join(missing), ",".join(table.names)
        raise InvalidFile([f"{path}:1: expected columns of {expected}, or their names in columns, found {found!r}"])
    return names, table


def _mean(latitude: Array, longitude: Array) -> tuple[float, float]:
    """The mean place [degree]: longitudes are counted from the first, the shorter way around."""
    around = (longitude - longitude[0] + 180.0) % 360.0 - 180.0
    return float(np.mean(latitude)), float(longitude[0] + np.mean(around))


def _times(table: Table, name: str) -> tuple[Array, bool]:
    """The column in seconds, since 1970 where it is written in ISO 8601, and whether it is."""
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
    """Seconds since 1970 of a time in ISO 8601; ValueError for any other text."""
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
