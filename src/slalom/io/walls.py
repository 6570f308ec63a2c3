"""Walls of drawings and maps: the outlines of areas, lines, and occupied cells, as obstacles at rest."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from slalom.base.checks import Array, array_of, flag, known, positive, share, shown, text
from slalom.base.errors import Extra, InvalidFile, InvalidInput
from slalom.base.tolerances import OCCUPIED
from slalom.obstacle.occupancy import OccupancyTable, occupancy

if TYPE_CHECKING:
    from ruamel.yaml.nodes import Node
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import shapely

from slalom.base.tolerances import LARGEST
from slalom.io.limited import within_limits
from slalom.io.pedestrians import jupedsim
from slalom.io.recorded import counted
from slalom.io.sheet import LENGTHS, unit_name
from slalom.io.table import file_size, text_of
from slalom.io.walls_child import outlines
from slalom.model.shape import Polyline
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle

ARC_ERROR: Final = 0.005
"""[m] Largest distance of a curve of a drawing from the lines that stand for it.

Larger: round walls have corners that robots keep clear of too little. Smaller: more lines.
"""

GROUND: Final = ".GS"
"""Cells of a MovingAI map that are free: ground and swamp."""


class Walls(NamedTuple):
    """Obstacles at rest of a file, and notes on it, a sentence each."""

    obstacles: tuple[Obstacle, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Drawn:
    """The lines and areas of a drawing in units of the file, and notes on it."""

    geometries: Iterable[Any]  # of shapely
    unit: float | None = None  # [m] as the file states it; 0: the caller must state it
    notes: tuple[str, ...] = ()
    turned: float | None = None  # sum of y that points down and y that points up; None: y points up


@dataclass(frozen=True)
class WallFormat:
    """A format of walls: one row of the table.

    Attributes:
        sentence: description.
        reader: function of a path and the unit [m] that returns what is drawn, or cells.
        unit: [m] where neither the file nor the caller states one; 0: one is required; None: the file states it.
    """

    sentence: str
    reader: Callable[[Path, float], Drawn | OccupancyTable]
    unit: float | None = 1.0


def read_walls(path: Path | str, unit: float | str | None = None, *, up: bool = False) -> Walls:
    """The walls of a file of a format of WALL_FORMATS, in its coordinates times the unit.

    Walls are lines and the outlines of areas: a robot stays on its side. Of maps of cells, all occupied cells are
    obstacles.

    Args:
        unit: [m] or one of LENGTHS; None: as the file states, else 1 m.
        up: whether to turn a drawing in SVG, whose y points down, within its viewBox: it looks as in its viewer.

    Raises:
        InvalidFile: a file that cannot be read, of another format, or without walls. InvalidInput: a unit that is none,
            is missing or is stated by the file; `up` with another format than SVG. MissingExtra: a package that the
            format needs is not installed.
    """
    file = Path(text(str(path), "path"))
    row = WALL_FORMATS.get(file.suffix.lower())
    if row is None:
        known = ", ".join(f"{suffix} ({row.sentence})" for suffix, row in WALL_FORMATS.items())
        image = f"; found an image: {MAPS}" if file.suffix.lower() in IMAGES else ""
        raise InvalidFile([f"{file}: expected walls in a file that ends in {known}{image}"])
    if flag(up, "up") and row.reader is not _svg:
        raise InvalidInput(f"up: expected it with a drawing in SVG, whose y points down, found it with {file.name}")
    given = None if unit is None else _metres(unit)
    if given is None and row.unit == 0.0:
        raise InvalidInput(f"unit: expected the length of a unit of {file.name}, as 0.04 or cm, found none")
    if given is not None and row.unit is None:
        raise InvalidInput(f"unit: expected none for {file.name}, which states its own, found {unit}")
    read = row.reader(file, given or row.unit or 1.0)
    drawn = Drawn((), 1.0) if isinstance(read, OccupancyTable) else read
    if isinstance(read, OccupancyTable):
        walls, corners = read.given, read.outlines.at_horizon.corners[:, :2]
    else:
        if given is None and drawn.unit == 0.0:
            found = "positions that are degrees by the standard of the format: project them, or give m if they are none"
            raise InvalidFile([f"{file}: expected a unit, found {found}"])
        walls, corners = _outlines(file, drawn, given or drawn.unit or 1.0, drawn.turned if up else None)
    if not walls:
        raise InvalidFile([f"{file}: expected walls, found none"])
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    summary = f"{counted(len(walls), 'wall')}, x {x0:.5g} to {x1:.5g} m, y {y0:.5g} to {y1:.5g} m"
    down = ("y points down, as in the file",) if drawn.turned is not None and not up else ()
    assumed = ("in m, as assumed",) if given is None and drawn.unit is None else ()
    return Walls(walls, (f"{file.name}: {'; '.join((summary, *down, *drawn.notes, *assumed))}",))


def _metres(unit: float | str) -> float:
    """A unit [m]. Raises InvalidInput for an unknown name, or a number that is not above 0."""
    if isinstance(unit, str) and unit_name(unit) not in LENGTHS:
        raise InvalidInput(f"unit: expected a number [m] or one of {', '.join(LENGTHS)}; found {unit!r}")
    return LENGTHS[unit_name(unit)] if isinstance(unit, str) else positive(unit, "unit")


def _outlines(path: Path, drawn: Drawn, unit: float, turned: float | None) -> tuple[tuple[Obstacle, ...], Array]:
    """Lines and outlines of areas [unit] as obstacles, and their corners (n, 2) [m]; points are left out.

    With `turned` [unit] y becomes `turned` minus y.
    Raises InvalidFile for a huge position.
    """
    lines = np.concatenate(outlines(drawn.geometries))
    # Positions that are not finite are refused with those that are huge.
    with np.errstate(invalid="ignore", over="ignore"):
        corners = shapely.get_coordinates(lines) * unit
        if turned is not None:
            corners[:, 1] = turned * unit - corners[:, 1]
    if not (np.isfinite(corners).all() and np.abs(corners).max(initial=0.0) <= LARGEST):
        raise InvalidFile([f"{path}: expected positions of at most {LARGEST:g} m, found others"])
    lines = shapely.remove_repeated_points(shapely.set_coordinates(lines, corners))
    points, line = shapely.get_coordinates(lines, return_index=True)
    each = np.split(points, np.flatnonzero(np.diff(line)) + 1)
    rest = Stationary((0.0, 0.0))
    long = (points for points in each if len(points) > 1 and (points[1:] != points[0]).any())
    return tuple(Obstacle(Polyline(points), rest, f"wall {k}") for k, points in enumerate(long)), corners


# Readers, and the table of formats.


def _drawn(answer: tuple[dict[str, Any], list[Any]]) -> Drawn:
    """The lines of an answer of `walls_child`."""
    tree, (points, counts) = answer
    left_out = ", ".join(f"{count} {kind}" for kind, count in sorted(tree.get("others", {}).items()))
    notes = (*tree.get("notes", ()), *([f"left out: {left_out}"] if left_out else []))
    unit = 0.0 if tree.get("may_be_degrees") else tree.get("unit")
    lines = shapely.linestrings(points, indices=np.repeat(np.arange(len(counts)), counts))
    return Drawn(lines, unit, notes, tree.get("turned"))


def _wkt(path: Path, unit: float) -> Drawn:
    """The shapes of a text in WKT: one, or one on each line."""
    return _drawn(within_limits(path, file_size(path), "shapes in WKT", "wkt", text_of(path)))


def _geojson(path: Path, unit: float) -> Drawn:
    """The shapes of GeoJSON."""
    return _drawn(within_limits(path, file_size(path), "shapes in GeoJSON", "geojson", text_of(path)))


def _jupedsim(path: Path, unit: float) -> Drawn:
    """The borders of the walkable area of a recording of JuPedSim."""
    return Drawn([shapely.LineString(wall) for wall in jupedsim(path).walls], 1.0)


def _movingai(path: Path, unit: float) -> OccupancyTable:
    """The cells of a MovingAI map that are not ground; y counts rows from the first, as in its tasks."""
    lines = text_of(path).rstrip("\n").split("\n")
    heads = dict(line.split(maxsplit=1) for line in lines[:3] if len(line.split()) == 2)
    height, width = heads.get("height", ""), heads.get("width", "")
    rows = lines[4:]
    if lines[3:4] != ["map"] or str(len(rows)) != height or {str(len(row)) for row in rows} != {width}:
        found = f"height {height}, width {width} and {len(rows)} rows of {sorted({len(row) for row in rows})[:3]} cells"
        raise InvalidFile([f"{path}: expected type, height, width, map and as many rows and cells, found {found}"])
    return occupancy(~np.isin(np.array(rows).view("U1").reshape(len(rows), -1), list(GROUND)), unit)


def _nav2(path: Path, unit: float) -> OccupancyTable:
    """The occupied cells of a map of nav2."""
    return read_map(path)


def _dxf(path: Path, unit: float) -> Drawn:
    """The lines and curves of a drawing in DXF, blocks included; texts and others are left out, and counted."""
    with Extra("walls", "read_walls"):
        import ezdxf  # noqa: F401  # the extra is missing before a file is read
    return _drawn(
        within_limits(path, file_size(path), "a drawing in DXF", "dxf", os.path.abspath(path), ARC_ERROR, unit)
    )


def _svg(path: Path, unit: float) -> Drawn:
    """The lines and curves of a drawing in SVG, in units of its viewBox; y points down, as in the file."""
    return _drawn(within_limits(path, file_size(path), "a drawing in SVG", "svg", text_of(path), ARC_ERROR / unit))


WALL_FORMATS: Final[Mapping[str, WallFormat]] = {
    ".wkt": WallFormat("shapes in WKT", _wkt),
    ".geojson": WallFormat("shapes in GeoJSON", _geojson),
    ".dxf": WallFormat("a drawing in DXF", _dxf),
    ".svg": WallFormat("a drawing in SVG", _svg, 0.0),
    ".map": WallFormat("a map of MovingAI", _movingai),
    ".yaml": WallFormat("a map of nav2", _nav2, None),
    ".sqlite": WallFormat("the area of a JuPedSim recording", _jupedsim, None),
}
"""The formats of walls, by suffix."""
IMAGES: Final = (".png", ".pgm", ".pbm", ".jpg", ".jpeg", ".bmp", ".gif", ".tif", ".tiff")
MAPS: Final = "its scale is in the .yaml file of a map of nav2; `slalom.occupancy` makes obstacles of an array of cells"

KEYS: Final = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
"""Keys that a map has; `mode` may be among them, and others are not used."""
MODES: Final = ("trinary", "scale", "raw")
"""Values of the key `mode`; the first one is the default."""


def read_map(path: Path | str, *, occupied: float = OCCUPIED, unknown: bool = False) -> OccupancyTable:
    """The obstacles of a map of nav2: rectangles that cover exactly the occupied cells.

    The image is in any format that Pillow reads, such as PGM and PNG. Its last row begins at the origin.

    Args:
        path: of the YAML file. Keys and modes are those of nav2_map_server (ROS 2 Jazzy).
        occupied: [%] least value of an occupied cell; it matters in the modes `scale` and `raw` alone.
        unknown: whether unknown cells are occupied.

    Raises:
        InvalidFile: a file that cannot be read; a missing key, or a value that is none.
        InvalidInput: a threshold outside of 0 to 100.
        MissingExtra: no Pillow or no ruamel.yaml.
    """
    file = Path(text(str(path), "path"))
    with Extra("maps", "read_map"):
        import PIL.Image  # noqa: F401  # the extra is missing before a file is read

        from slalom.io.yaml_nodes import compose
    root, content = compose(file)
    image, resolution, origin, reading = _checked(file, root, content)
    size = file_size(image, "image")
    _, (cells,) = within_limits(
        image, size, "an image that can be read", "image", os.path.abspath(image), size, *reading
    )
    return occupancy(cells, resolution, origin, occupied=occupied, unknown=unknown)


def _checked(file: Path, root: "Node | None", content: Any) -> tuple[Path, float, Array, tuple[Any, ...]]:
    """Image, resolution [m], origin [m, m, rad] of a map, and further arguments of `walls_child.image`.

    Raises InvalidFile with all its mistakes.
    """
    from slalom.io.yaml_nodes import place_of

    if not isinstance(content, dict):
        raise InvalidFile([f"{file}: expected a mapping with the keys {', '.join(KEYS)}; found {shown(content)}"])
    assert root is not None
    places = {key.value: place_of(file, value) for key, value in root.value}
    mistakes = [f"{file}: {key}: expected this key, found none" for key in KEYS if key not in content]
    found: dict[str, Any] = {}
    for key, check in _CHECKS.items():
        try:
            if key in content:
                found[key] = check(content[key], key)
        except InvalidInput as error:
            # A merged key has no place of its own.
            mistakes.append(f"{places.get(key, file)}: {error}")
    free, occupied = found.get("free_thresh", -np.inf), found.get("occupied_thresh", np.inf)
    if free >= occupied:
        place = places.get("free_thresh", file)
        mistakes.append(f"{place}: free_thresh: expected less than occupied_thresh, found {free:g}")
    if mistakes:
        raise InvalidFile(mistakes)
    reading = (found.get("mode", MODES[0]), found["negate"], occupied, free)
    return file.parent / found["image"], found["resolution"], found["origin"], reading


def _mode(value: Any, name: str) -> str:
    """One of MODES."""
    return known(text(value, name), name, MODES)


_CHECKS: Final[dict[str, Any]] = {
    "image": text,
    "resolution": positive,
    "origin": partial(array_of, shape=(3,)),
    "negate": flag,
    "occupied_thresh": share,
    "free_thresh": share,
    "mode": _mode,
}
