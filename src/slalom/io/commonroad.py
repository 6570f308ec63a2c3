"""Reader of the dynamic obstacles of CommonRoad scenarios, versions 2018b and 2020a, with exact states.

Format: Althoff, Koschi and Manzinger, IV 2017, and the documentation of the two versions. Time is a whole number of
steps of `timeStepSize` [s]; positions are in m.
"""

import io
import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from slalom.errors import InvalidFile
from slalom.io.input_file import text_of
from slalom.io.recorded import Rows, counted, named, refuse
from slalom.io.table import Table

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
