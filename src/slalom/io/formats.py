"""The table of formats of recorded tracks, and reading a file of any of them."""

import csv
import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from slalom.checks import known
from slalom.errors import InvalidFile, InvalidInput
from slalom.io import commonroad, geographic, pedestrians, tracks, vehicles, writers
from slalom.io.recorded import Rows, Tracks
from slalom.io.repair import tracks_of

BEGINNING: Final = 4096
"""Bytes of a file by which its format is recognised."""


@dataclass(frozen=True)
class Format:
    """A row of the table.

    Attributes:
        name: what the command line calls it. sentence: what it is.
        agents: what they are where the file does not say; "" if that may be anything.
        reader: from a path and settings to the rows of the file.
        mark: by what it is recognised, in words. recognises: whether a file may be of this format, from its suffix in
            small letters and its first line that is not blank; no two formats recognise the same file.
        writer: from a path, tracks and settings to a file; None if it is only read. suffix: of the files it writes.
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
    """Whether the first line has cells of these names."""

    def recognises(suffix: str, line: str) -> bool:
        return {cell.strip() for cell in next(csv.reader([line]), [])}.issuperset(names)

    return recognises


def _place_of(name: str) -> Callable[[str, str], bool]:
    """Whether the first line has a column of this name, in small letters, and a latitude and a longitude."""

    def recognises(suffix: str, line: str) -> bool:
        cells = {cell.strip().lower() for cell in next(csv.reader([line]), [])}
        return name in cells and all(cells.intersection(geographic.COLUMNS[what]) for what in ("latitude", "longitude"))

    return recognises


def _numbers(suffix: str, line: str) -> bool:
    """Whether the first line is four or eight numbers between white space."""
    try:
        return len([float(cell) for cell in line.split()]) in pedestrians.ETH
    except ValueError:
        return False


FORMATS: Final[dict[str, Format]] = {
    row.name: row
    for row in (
        Format(
            "csv",
            "Slalom's own: t, id, x, y and, if known, z, radius, length, width and kind; s and m.",
            "",
            tracks.csv_rows,
            "a header with t,id,x,y",
            _header("t", "id", "x", "y"),
            writers.write_csv,
            ".csv",
        ),
        Format(
            "eth_ucy",
            "ETH and UCY pedestrians: frame, id, x, y between white space, or ETH's obsmat.txt.",
            "pedestrian",
            pedestrians.eth_ucy,
            "lines of 4 or 8 numbers between white space",
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
            "PedPy's text and the pedestrian dynamics data archive: id, frame, x, y under comments.",
            "pedestrian",
            pedestrians.pedpy_text,
            "a first line that begins with #",
            lambda suffix, line: line.lstrip().startswith("#"),
        ),
        Format(
            "jupedsim",
            "JuPedSim's SQLite database.",
            "pedestrian",
            pedestrians.jupedsim,
            "the signature of SQLite",
            lambda suffix, line: line.startswith("SQLite format 3"),
            writers.write_jupedsim,
            ".sqlite",
        ),
        Format(
            "drone",
            "The drone data sets highD, inD, rounD, exiD and uniD: NN_tracks.csv.",
            "car",
            vehicles.drone,
            f"a header with {','.join(vehicles.CENTRES)} or {','.join(vehicles.CORNERS)}",
            lambda suffix, line: _header(*vehicles.CENTRES)(suffix, line) or _header(*vehicles.CORNERS)(suffix, line),
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
            commonroad.commonroad,
            "the suffix .xml",
            lambda suffix, line: suffix == ".xml",
        ),
        Format(
            "ais",
            "Ships: tables with time, MMSI, latitude and longitude.",
            "ship",
            geographic.ais,
            "a header with mmsi, a latitude and a longitude",
            _place_of("mmsi"),
        ),
        Format(
            "adsb",
            "Aircraft: tables with time, ICAO address, latitude, longitude and altitude.",
            "aircraft",
            geographic.adsb,
            "a header with icao24, a latitude and a longitude",
            _place_of("icao24"),
        ),
    )
}
"""Every format by name."""


def read_recording(
    path: Path | str,
    format: str | None = None,
    *,
    gap: float | None = None,
    max_speed: float | None = None,
    interpolation: str = "smooth",
    **settings: Any,
) -> Tracks:
    """The tracks of a file, and notes on all that was repaired, left out or assumed.

    Args:
        format: a name in FORMATS; recognised from the file if None.
        gap: [s] a track is split where its agent has no row for longer; never if None.
        max_speed: [m/s] an agent that is faster from one row to the next has jumped, which is a mistake; none if None.
        settings: of the format's reader, such as frame_rate.

    Raises:
        InvalidFile: no such file, no format that fits, rows that make no tracks; every mistake with its line.
        InvalidInput: an unknown format, settings that the format does not have or that do not fit.
    """
    path = Path(path)
    row = FORMATS[known(format_of(path) if format is None else format, "format", list(FORMATS))]
    _check(row.reader, row.name, settings)
    rows = row.reader(path, **settings)
    found = tracks_of(rows, gap=gap, max_speed=max_speed, interpolation=interpolation)
    return replace(found, format=row.name)


WRITTEN: Final[dict[str, str]] = {row.suffix: row.name for row in FORMATS.values() if row.writer}
"""The format that a file is written in, by its suffix."""


def write_recording(path: Path | str, tracks: Tracks, format: str, **settings: Any) -> None:
    """Write tracks to a file of a format that has a writer.

    Raises:
        InvalidInput: another format, settings that it does not have or that do not fit, tracks that it cannot hold.
        InvalidFile: a file that cannot be written.
    """
    writer = FORMATS[known(format, "format", list(WRITTEN.values()))].writer
    assert writer is not None
    _check(writer, format, settings)
    writer(Path(path), tracks, **settings)


def files_of(path: Path) -> list[Path]:
    """The file itself and those that are read with it."""
    return [path, *vehicles.beside(path)]


def settings_to_write(name: str) -> list[str]:
    """The settings that the writer of a format has: frame_rate where it counts frames, and numbers agents."""
    writer = FORMATS[known(name, "format", list(WRITTEN.values()))].writer
    assert writer is not None
    return list(_keywords(writer))


def settings_of(name: str) -> list[str]:
    """The settings that the reader of a format has, such as frame_rate."""
    return list(_keywords(FORMATS[known(name, "format", list(FORMATS))].reader))


def format_of(path: Path) -> str:
    """The name of the format of a file, recognised from its beginning.

    Raises:
        InvalidFile: no such file, or one of no format that is known.
    """
    try:
        with path.open("rb") as file:
            text = file.read(BEGINNING).decode("utf-8-sig", errors="replace")
    except OSError as error:
        raise InvalidFile([f"{path}: expected a file that can be read, found {error}"]) from None
    line = next((line for line in text.splitlines() if line.strip()), "")
    found = [row for row in FORMATS.values() if row.recognises(path.suffix.lower(), line)]
    if len(found) != 1:
        marks = "; ".join(f"{row.name}: {row.mark}" for row in FORMATS.values())
        raise InvalidFile(
            [f"{path}: expected a file of a format that is known, or its name ({marks}), found {line[:60]!r}"]
        )
    return found[0].name


def _check(function: Callable[..., Any], name: str, settings: dict[str, Any]) -> None:
    """Every setting is one of the function, and none that it needs is missing."""
    parameters = _keywords(function)
    needed = [p.name for p in parameters.values() if p.default is p.empty]
    if not set(needed) <= set(settings) <= set(parameters):
        expected = f"settings {', '.join(parameters) or 'none'}"
        if needed:
            expected += f", with {', '.join(needed)}"
        raise InvalidInput(f"{name}: expected {expected}, found {', '.join(settings) or 'none'}")


def _keywords(function: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """What a reader or writer can be told by name."""
    return {p.name: p for p in inspect.signature(function).parameters.values() if p.kind is p.KEYWORD_ONLY}
