"""Readers of recorded vehicles whose files are no single table: drone data sets, CommonRoad, SUMO and nuScenes."""

import io
import json
import os
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from math import ceil
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, positive
from slalom.base.errors import InvalidFile
from slalom.io.layout import EXTENTS, Layout, read_layout
from slalom.io.recorded import RADII, Rows, counted, kind_of, named, refuse
from slalom.io.sheet import comma_table
from slalom.io.table import Table, beginning_of, file_size, text_of

# Reader of drone data sets: highD, inD, rounD, exiD, uniD.


CENTRES: Final = ("trackId", "frame", "xCenter", "yCenter")
CORNERS: Final = ("id", "frame", "x", "y", "width", "height")
"""Columns of highD: corner of the bounding box with the smallest x and y, and its sides along x and y."""

_SUFFIX = "_tracks.csv"
_RATE = "_recordingMeta.csv"
_CLASSES = "_tracksMeta.csv"

_BY_CENTRE = Layout("frame=frame id=trackId x=xCenter y=yCenter length=length width=width", named=False)
_BY_CORNER = Layout(
    "frame=frame id=id x=x+0.5*width y=y+0.5*height length=width width=height",
    named=False,
    notes=("y points down, as in the file",),
)


def drone(path: Path, *, frame_rate: float | None = None) -> Rows:
    """Read a drone data set: NN_tracks.csv, with NN_recordingMeta.csv and NN_tracksMeta.csv if they exist.

    inD, rounD, exiD and uniD give the centre, length and width. highD gives a corner of the bounding box, from which
    the centre is computed. Its y axis points down, which is kept and noted.

    Args:
        frame_rate: [Hz]; by default frameRate of the recordingMeta file.

    Raises:
        InvalidFile: invalid rows; no frame rate, or a stated one that differs from `frame_rate`.
    """
    centres = b"xCenter" in beginning_of(path, 4096)
    rate = _frame_rate(path, frame_rate)
    rows = read_layout(_BY_CENTRE if centres else _BY_CORNER, path, frame_rate=rate)
    kinds = _kinds(path, "trackId" if centres else "id")
    return replace(rows, kinds=[kinds.get(rows.labels[k], "") for k in rows.agents.tolist()]) if kinds else rows


def tracks_of_meta(path: Path) -> Path | None:
    """Return the file of tracks to which a file of a drone data set belongs; None for any other file."""
    suffix = next((suffix for suffix in (_RATE, _CLASSES) if path.name.endswith(suffix)), None)
    return None if suffix is None else path.with_name(path.name.removesuffix(suffix) + _SUFFIX)


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
        found = ", ".join(f"{x:g}" for x in stated) or "none"
        absent = "" if meta else ": the file does not exist, and no frame_rate was given"
        raise InvalidFile([f"{where}: expected {expected}, found {found}{absent}"])
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


# Reader of the dynamic obstacles of CommonRoad scenarios, versions 2018b and 2020a, with exact states.
#
# Format: Althoff, Koschi and Manzinger, IV 2017, and the documentation of the two versions. Time is a whole number of
# steps of `timeStepSize` [s]; positions are in m.


VERSIONS: Final = ("2018b", "2020a")
ROUND: Final = 0.005
"""[m] How far the polygons of static circles exceed them. Larger: narrower gaps beside them. Smaller: more corners."""
BOX: Final = ((-1, -1), (1, -1), (1, 1), (-1, 1))
"""Corners of a rectangle, in halves of its sides."""


def commonroad(path: Path) -> Rows:
    """Read every dynamic obstacle with a trajectory, and static ones as walls; others are left out, with a note.

    Raises:
        InvalidFile: no XML, another version, no time step, a state without an exact time or a position.
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
    sizes = table.extents(*EXTENTS)
    read = table.rows_of(
        table.ids("id"),
        times,
        table.positions("x", "y"),
        extents=sizes,
        kinds=table.texts("kind"),
        notes=obstacles.notes(),
    )
    return replace(read, walls=tuple(obstacles.walls))


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
    static: list[str] = field(default_factory=list)
    walls: list[Array] = field(default_factory=list)
    others: list[str] = field(default_factory=list)
    without_trajectory: list[str] = field(default_factory=list)
    without_shape: list[str] = field(default_factory=list)
    covered: list[str] = field(default_factory=list)
    uncertain: list[str] = field(default_factory=list)

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
            rings = _rings(element) if role == "static" else []
            (self.static if rings else self.others).append(name)
            self.walls += rings
        elif trajectory is None:
            self.without_trajectory.append(name)
        else:
            sizes = self._extents(name, element.find("shape"))
            for state in (*element.findall("initialState"), *trajectory.findall("state")):
                self.state([name, element.findtext("type", "").strip(), *sizes], state)

    def _extents(self, name: str, shape: ET.Element | None) -> tuple[str, str, str]:
        """Return the texts of radius, length and width: of the shape, or of a disc that covers it; "" if unknown."""
        parts = [] if shape is None else list(shape)
        if len(parts) == 1 and parts[0].tag in ("rectangle", "circle") and not np.any(_transform(parts[0])):
            radius, length, width = (parts[0].findtext(size, "") for size in EXTENTS)
            return radius, length, width
        reach = max(map(_reach, parts), default=np.nan)
        if not np.isfinite(reach):
            self.without_shape.append(name)
            return "", "", ""
        self.covered.append(name)
        return repr(reach), "", ""

    def state(self, head: list[str], state: ET.Element) -> None:
        """Add the row of one state: time step and position, the centre of a region."""
        region = state.find("position/*/center")
        point = state.find("position/point") if region is None else region
        cells = [state.findtext("time/exact"), *(None if point is None else point.findtext(axis) for axis in "xy")]
        if None in cells:
            self.mistakes.append(
                (state, f"expected an exact time and a position of obstacle {head[0]}, found {_tags(state)}")
            )
        else:
            self.uncertain += [] if region is None else [head[0]]
            self.rows.append([*head, *(cell or "" for cell in cells)])
            self.states.append(state)

    def notes(self) -> list[str]:
        """Return one note for each kind of omission."""
        each = (
            (self.static, "at rest, outlines read as walls"),
            (self.others, "left out: neither dynamic nor at rest at an exact place"),
            (self.without_trajectory, "without a trajectory left out"),
        )
        notes = [f"{counted(len(ids), 'obstacle')} {what}: {named(ids, 'id')}" for ids, what in each if ids]
        if self.without_shape:
            notes.append(f"shape of {named(self.without_shape, 'obstacle')} unknown")
        if self.covered:
            notes.append(f"shape of {named(self.covered, 'obstacle')} covered by a disc about the position")
        if self.uncertain:
            ids = named(self.uncertain, "obstacle")
            notes.append(
                f"{counted(len(self.uncertain), 'position')} of {ids} uncertain: the centres of the regions are read"
            )
        return notes


def _transform(part: ET.Element) -> tuple[float, float, float]:
    """Return the centre x, y [m] and the orientation [rad] of a part of a shape; nan for what is no number."""
    x, y, angle = (_value(part.findtext(at, "0")) for at in ("center/x", "center/y", "orientation"))
    return x, y, angle


def _reach(part: ET.Element) -> float:
    """Return the largest distance [m] of a part of a shape from the position of its obstacle; nan if unknown."""
    if part.tag == "circle":
        x, y, _ = _transform(part)
        return float(np.hypot(x, y)) + _value(part.findtext("radius", ""))
    return float(np.max(np.abs(_corners(part)), initial=-np.inf))


def _corners(part: ET.Element) -> npt.NDArray[np.complex128]:
    """Return the corners (n,), x + i y [m], of a part of a shape about the position of its obstacle; nan if unknown.

    A circle is a polygon around it, within ROUND.
    """
    x, y, angle = _transform(part)
    if part.tag == "polygon":
        points = part.findall("point")
        return np.array([complex(_value(p.findtext("x", "")), _value(p.findtext("y", ""))) for p in points])
    if part.tag == "circle":
        radius = _value(part.findtext("radius", ""))
        if not 0.0 < radius < np.inf:
            return np.full(1, np.nan, np.complex128)
        count = max(8, ceil(np.pi / np.arccos(radius / (radius + ROUND))))
        angles = 2.0 * np.pi * np.arange(count) / count
        return np.asarray(complex(x, y) + radius / np.cos(np.pi / count) * np.exp(1j * angles))
    length, width = (0.5 * _value(part.findtext(size, "")) for size in ("length", "width"))
    turned = complex(np.cos(angle), np.sin(angle))
    return np.asarray(complex(x, y) + turned * np.array([complex(a * length, b * width) for a, b in BOX]))


def _rings(element: ET.Element) -> list[Array]:
    """Return the outlines (n, 2) [m] of a static obstacle, first point last again; none if a place is not exact."""
    state, shape = element.find("initialState"), element.find("shape")
    if state is None or shape is None:
        return []
    x, y = (_value(state.findtext(f"position/point/{axis}", "")) for axis in "xy")
    angle = _value(state.findtext("orientation/exact", "0" if state.find("orientation") is None else ""))
    rings = []
    for part in shape:
        corners = complex(x, y) + np.exp(1j * angle) * _corners(part)
        rings.append(np.column_stack([corners.real, corners.imag])[[*range(len(corners)), 0]])
    return rings if all(len(ring) > 3 and np.isfinite(ring).all() for ring in rings) else []


def _value(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan


def _tags(state: ET.Element) -> str:
    """Describe the child elements of the time and the position of a state."""
    parts = (part for part in state if part.tag in ("time", "position"))
    return ", ".join(f"{part.tag} by {' and '.join(e.tag for e in part) or 'nothing'}" for part in parts) or "neither"


def sumo(path: Path) -> Rows:
    """Read SUMO's output fcd-export: vehicles and persons by time step, in s and m.

    Raises:
        InvalidFile: no XML, no fcd-export, cells that are not numbers.
    """
    root, lines = _parsed(path)
    if root.tag != "fcd-export":
        raise InvalidFile([f"{path}: expected an fcd-export, found {root.tag}"])
    rows, numbers = list[list[str]](), list[int]()
    for step in root.iterfind("timestep"):
        for agent in step:
            kind = "pedestrian" if agent.tag == "person" else agent.get("type", "")
            kind = kind if kind_of(kind) in RADII else "car"
            rows.append([step.get("time", ""), *(agent.get(name, "") for name in ("id", "x", "y")), kind])
            numbers.append(lines[agent])
    table = Table(path, ["t", "id", "x", "y", "kind"], rows, numbers)
    notes = ["position of a vehicle: the centre of its front bumper"]
    return table.rows_of(
        table.ids("id"), table.numbers("t"), table.positions("x", "y"), kinds=table.texts("kind"), notes=notes
    )


def nuscenes(path: Path) -> Rows:
    """Read sample_annotation.json of nuScenes with sample.json, instance.json and category.json beside it.

    Raises:
        InvalidFile: a missing table, a table of another kind.
    """
    file_size(path)
    others = [path.with_name(f"{name}.json") for name in ("sample", "instance", "category")]
    absent = [other.name for other in others if not other.is_file()]
    if absent:
        raise InvalidFile([f"{path}: expected the other tables of nuScenes beside it, found no {', '.join(absent)}"])
    samples, instances, categories = (_by_token(other, _records(other)) for other in others)
    records = _records(path)
    try:
        rows = [
            [
                samples[record["sample_token"]]["timestamp"],
                record["instance_token"],
                *record["translation"][:2],
                *record["size"][:2],
                categories[instances[record["instance_token"]]["category_token"]]["name"],
            ]
            for record in records
        ]
    except (KeyError, TypeError, IndexError) as error:
        raise InvalidFile([f"{path}: expected records of nuScenes, found none of {error}"]) from None
    location = "{path}: record {line}"
    table = Table(
        path, ["timestamp", "id", "x", "y", "width", "length", "kind"], rows, range(1, len(rows) + 1), location
    )
    parts = [text.split(".") for text in table.texts("kind")]
    kinds = ["pedestrian" if words[0] == "human" else words[min(1, len(words) - 1)] for words in parts]
    times = table.numbers("timestamp")
    first = float(np.nanmin(times))
    notes = [f"time 0 at the first time: {1e-6 * first!r}"]
    sizes = table.extents("width", "length")
    positions = table.positions("x", "y")
    return table.rows_of(table.ids("id"), 1e-6 * (times - first), positions, extents=sizes, kinds=kinds, notes=notes)


def _records(path: Path) -> list[Any]:
    try:
        found = json.loads(text_of(path))
    except (ValueError, RecursionError) as error:
        raise InvalidFile([f"{path}: expected JSON, found {error}"]) from None
    if not isinstance(found, list):
        raise InvalidFile([f"{path}: expected a list of records, found {type(found).__name__}"])
    return found


def _by_token(path: Path, records: Iterable[Any]) -> dict[str, Any]:
    try:
        return {record["token"]: record for record in records}
    except (KeyError, TypeError):
        raise InvalidFile([f"{path}: expected records with a token, found others"]) from None
