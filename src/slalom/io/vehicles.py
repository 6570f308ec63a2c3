"""Readers of recorded road users in the plane: drone data sets (highD, inD, rounD, exiD, uniD) and INTERACTION."""

import os
from pathlib import Path
from typing import Final

import numpy as np

from slalom.checks import positive
from slalom.errors import InvalidFile
from slalom.io.recorded import Rows, refuse
from slalom.io.table import comma_table

CENTRES: Final = ("trackId", "frame", "xCenter", "yCenter")
CORNERS: Final = ("id", "frame", "x", "y", "width", "height")
"""Columns of highD: corner of the bounding box with the smallest x and y, and its sides along x and y."""

CASES: Final = ("track_id", "timestamp_ms", "x", "y")

_SUFFIX, _RATE, _CLASSES = "_tracks.csv", "_recordingMeta.csv", "_tracksMeta.csv"


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
