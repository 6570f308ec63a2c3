"""Table of the formats of recorded tracks; reading and writing a file of any format."""

import csv
import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from slalom.base.checks import known
from slalom.base.errors import InvalidFile, InvalidInput
from slalom.base.registry import Kind, Registry
from slalom.io import pedestrians, table, vehicles, writers
from slalom.io.recorded import RecordedTracks, Rows, tracks_of
from slalom.io.table import beginning_of

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
                writers.write_csv,
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
                writers.write_trajnet,
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
                writers.write_jupedsim,
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
