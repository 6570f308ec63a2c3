"""Readers of recorded road users in the plane: drone data sets (highD, inD, rounD, exiD, uniD) and INTERACTION."""

import io
import os
import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from slalom.base.checks import positive
from slalom.base.errors import InvalidFile
from slalom.io.recorded import Rows, counted, named, refuse
from slalom.io.table import Table, comma_table, text_of

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
