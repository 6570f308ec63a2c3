"""Recorded pedestrians: ETH/UCY text, TrajNet++, PedPy text and JuPedSim's databases. Positions are in the plane."""

import json
import math
import re
import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Final

import numpy as np

from slalom.checks import Array, known, positive
from slalom.errors import InvalidFile
from slalom.io.recorded import Mistake, Rows, counted, refuse
from slalom.io.table import LARGEST, Table, spaced_rows, text_of

ETH: Final = {4: ("frame", "id", "x", "y"), 8: ("frame", "id", "x", "z", "y", "vx", "vz", "vy")}
"""Columns of ETH/UCY files by their number; 8 are those of obsmat.txt, whose z is not used."""

ANNOTATED: Final = {10: 25.0, 6: 15.0}
"""[Hz] Frame rates of the videos by the frames from one annotation to the next: both are 2.5 Hz."""

ROWS_PER_SECOND: Final = 2.5
"""[Hz] Of TrajNet++ where a scene does not say."""

UNITS: Final = {"m": 1.0, "cm": 0.01}

_FRAME_RATE = re.compile(r"frame ?rate[\s:=]*(\d+(?:\.\d*)?)", re.IGNORECASE)
_UNIT = re.compile(r"\b(?:x/|in )(m|cm)\b", re.IGNORECASE)


def eth_ucy(path: Path, *, frame_rate: float | None = None) -> Rows:
    """ETH/UCY: frame, id, x, y between white space, or the eight columns of ETH's obsmat.txt, in m.

    Args:
        frame_rate: [Hz] of the video. By default 25 where frames are 10 apart and 15 where they are 6 apart.

    Raises:
        InvalidFile: rows that do not fit; frames neither 10 nor 6 apart and no `frame_rate`.
    """
    rows, lines, _ = spaced_rows(path)
    width = len(rows[0]) if rows else 4
    if width not in ETH:
        raise InvalidFile([f"{path}:{lines[0]}: expected 4 or 8 cells between white space, found {width}"])
    table = Table(path, ETH[width], rows, lines)
    ids, frames = table.ids("id", whole=True), table.numbers("frame", whole=True)
    positions = table.positions("x", "y")
    refuse(path, table.mistakes)
    apart = _step(frames)
    if frame_rate is None and apart not in ANNOTATED:
        raise InvalidFile([f"{path}: expected frames 10 or 6 apart, or a frame_rate, found {apart:g} apart and none"])
    rate = ANNOTATED[apart] if frame_rate is None else positive(frame_rate, "frame_rate")
    return table.rows_of(ids, frames / rate, positions)


def _step(frames: Array) -> int:
    """The largest number of frames that every two are a multiple of apart; 0 if they are all the same."""
    distinct = np.unique(frames).astype(np.int64)
    return math.gcd(*np.diff(distinct).tolist())


def trajnet(path: Path, *, frame_rate: float | None = None) -> Rows:
    """TrajNet++: one JSON object per line, {"scene": {...}} or {"track": {"f", "p", "x", "y"}}, in m.

    Rows that a predictor wrote (with a prediction number) are left out, with a note.

    Args:
        frame_rate: [Hz] at which frames count. By default the scenes' fps, which says how many rows there are in a
            second, or 2.5 where they do not say, times the frames from one row to the next.

    Raises:
        InvalidFile: a line that is neither, scenes of different fps.
    """
    rows, lines, rates, mistakes, predicted = [], [], dict[float, int](), list[Mistake](), 0
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
    ids, frames, positions = table.ids("p", whole=True), table.numbers("f", whole=True), table.positions("x", "y")
    refuse(path, table.mistakes)
    rate = first * max(_step(frames), 1) if frame_rate is None else positive(frame_rate, "frame_rate")
    notes = [f"{counted(predicted, 'predicted row')} left out"] if predicted else []
    return table.rows_of(ids, frames / rate, positions, notes=notes)


def _content(line: str) -> dict[str, Any]:
    """The JSON object of a line; an empty one if it holds something else."""
    try:
        content = json.loads(line)
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}


def pedpy_text(path: Path, *, frame_rate: float | None = None, unit: str | None = None) -> Rows:
    """PedPy and the pedestrian dynamics data archive: id, frame, x, y between white space; the rest is passed over.

    Lines that begin with # are comments; `framerate: 25` and the unit (`x/cm`, `in m`) stand there.

    Args:
        frame_rate: [Hz]; needed where the file does not say. unit: m or cm; where neither says, m is taken and noted.

    Raises:
        InvalidFile: rows that do not fit, no frame rate, one or a unit that is not the one given.
    """
    rows, lines, comments = spaced_rows(path)
    rate, said = _said(_FRAME_RATE, comments), _said(_UNIT, comments)
    given = None if frame_rate is None else positive(frame_rate, "frame_rate")
    if unit is not None and said not in (None, known(unit, "unit", list(UNITS))):
        raise InvalidFile([f"{path}: expected the unit that was given, {unit}, found {said}"])
    width = len(rows[0]) if rows else 4
    if width < 4:
        raise InvalidFile([f"{path}:{lines[0]}: expected 4 or more cells between white space, found {width}"])
    table = Table(path, ["id", "frame", "x", "y", *map(str, range(5, width + 1))], rows, lines)
    times = table.numbers("frame", whole=True) / _rate(path, None if rate is None else float(rate), given)
    positions = table.positions("x", "y") * UNITS[unit or said or "m"]
    notes = [] if unit or said else ["the unit of the positions is not said: m is taken"]
    return table.rows_of(table.ids("id", whole=True), times, positions, notes=notes)


def _rate(path: Path, said: float | None, given: float | None) -> float:
    """The frame rate [Hz] that a file says, or the one that was given; the same if both."""
    rate = given if said is None else said
    if rate is None or rate <= 0.0 or given not in (None, rate):
        expected = "a frame rate above 0, said or given" if given is None else f"the frame rate of {given:g} Hz"
        raise InvalidFile([f"{path}: expected {expected}, found {'none' if rate is None else f'{rate:g} Hz'}"])
    return rate


def _said(pattern: re.Pattern[str], comments: Sequence[str]) -> str | None:
    """What the first comment that matches says, in small letters."""
    found = (match[1].lower() for line in comments if (match := pattern.search(line)))
    return next(found, None)


def jupedsim(path: Path) -> Rows:
    """JuPedSim's SQLite database, version 1 or 2: table trajectory_data, and in metadata the key fps.

    Raises:
        InvalidFile: no such file or database, another version, no fps, cells that are not numbers.
    """
    query = "SELECT rowid, id, frame, pos_x, pos_y FROM trajectory_data ORDER BY rowid"
    try:
        # Read only: a file that does not exist is not made.
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as database:
            said = dict(database.execute("SELECT key, value FROM metadata").fetchall())
            rows = database.execute(query).fetchall()
    except sqlite3.Error as error:
        raise InvalidFile([f"{path}: expected a JuPedSim database, found {error}"]) from None
    try:
        version, rate = int(said.get("version", 1)), float(said.get("fps", "none"))
    except ValueError:
        version, rate = 0, 0.0
    if version not in (1, 2) or not 0.0 < rate < np.inf:
        found = f"{said.get('version', 'none')} and {said.get('fps', 'none')}"
        raise InvalidFile([f"{path}: metadata: expected version 1 or 2 and fps above 0, found {found}"])
    place = "{path}: trajectory_data row {line}"
    table = Table(path, ["row", "id", "frame", "x", "y"], rows, (row[0] for row in rows), place)
    times = table.numbers("frame", whole=True) / rate
    return table.rows_of(table.ids("id", whole=True), times, table.positions("x", "y"))
