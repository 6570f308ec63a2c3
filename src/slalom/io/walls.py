"""Walls of drawings and maps: the outlines of areas, lines, and occupied cells, as obstacles at rest."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, array_of, flag, known, positive, share, shown, text
from slalom.base.errors import Extra, InvalidFile, InvalidInput, reason
from slalom.base.tolerances import OCCUPIED
from slalom.obstacle.occupancy import OccupancyTable, occupancy

if TYPE_CHECKING:
    from PIL.Image import Image
    from ruamel.yaml.nodes import Node
import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from io import StringIO

import shapely
from numpy.typing import ArrayLike

from slalom.base.tolerances import LARGEST
from slalom.io.pedestrians import jupedsim
from slalom.io.recorded import counted
from slalom.io.sheet import LENGTHS, unit_name
from slalom.io.table import decoded, text_of
from slalom.model.shape import Polyline
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import outline_parts

ARC_ERROR: Final = 0.005
"""[m] Largest distance of a curve of a drawing from the lines that stand for it.

Larger: round walls have corners that robots keep clear of too little. Smaller: more lines.
"""

FARTHEST_CURVE: Final = 1e8
"""[m] Largest distance of a curve from the origin of a drawing in DXF.

Larger: mistaken drawings take minutes and all memory. Smaller: maps of countries are refused. So too the next two.
"""

MOST_POINTS: Final = 2**17
"""[1] Largest number of points of a curve of a drawing in SVG."""

MOST_SHAPES: Final = 1_000_000
"""[1] Largest number of shapes of a drawing in DXF, with those of its blocks."""

GROUND: Final = ".GS"
"""Cells of a MovingAI map that are free: ground and swamp."""

OF_PACKAGES: Final = (ArithmeticError, AttributeError, LookupError, SyntaxError, TypeError, ValueError)
"""What the packages that read DXF and SVG raise for mistakes in a file."""


class Walls(NamedTuple):
    """Obstacles at rest of a file, and notes on it, a sentence each."""

    obstacles: tuple[Obstacle, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Drawn:
    """The lines and areas of a drawing in units of the file, and notes on it."""

    geometries: Iterable[Any]  # of shapely
    unit: float | None = None  # [m] as the file states it
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class WallFormat:
    """A format of walls: one row of the table.

    Attributes:
        sentence: description.
        reader: function of a path and the unit [m] that returns obstacles or what is drawn.
        unit: [m] where neither the file nor the caller states one; 0: one is required; None: the file states it.
    """

    sentence: str
    reader: Callable[[Path, float], Drawn | tuple[Obstacle, ...]]
    unit: float | None = 1.0


def read_walls(path: Path | str, unit: float | str | None = None) -> Walls:
    """The walls of a file of a format of WALL_FORMATS, in its coordinates times the unit.

    Walls are lines and the outlines of areas: a robot stays on its side. Of maps of cells, all occupied cells are
    obstacles.

    Args:
        unit: [m] or one of LENGTHS; None: as the file states, else 1 m.

    Raises:
        InvalidFile: a file that cannot be read, of another format, or without walls. InvalidInput: a unit that is none,
            is missing or is stated by the file. MissingExtra: a package that the format needs is not installed.
    """
    file = Path(text(str(path), "path"))
    row = WALL_FORMATS.get(file.suffix.lower())
    if row is None:
        known = ", ".join(f"{suffix} ({row.sentence})" for suffix, row in WALL_FORMATS.items())
        raise InvalidFile([f"{file}: expected walls in a file that ends in {known}"])
    given = None if unit is None else _metres(unit)
    if given is None and row.unit == 0.0:
        raise InvalidInput(f"unit: expected the length of a unit of {file.name}, as 0.04 or cm, found none")
    if given is not None and row.unit is None:
        raise InvalidInput(f"unit: expected none for {file.name}, which states its own, found {unit}")
    # Positions that are not finite are refused with those that are huge.
    with np.errstate(invalid="ignore", over="ignore"):
        read = row.reader(file, given or row.unit or 1.0)
        drawn = read if isinstance(read, Drawn) else Drawn((), 1.0)
        walls = read if isinstance(read, tuple) else _outlines(file, read, given or read.unit or 1.0)
    if not walls:
        raise InvalidFile([f"{file}: expected walls, found none"])
    corners = np.concatenate([part.corners for wall in walls for part in outline_parts(wall, 0.0)])
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    summary = f"{counted(len(walls), 'wall')}, x {x0:.5g} to {x1:.5g} m, y {y0:.5g} to {y1:.5g} m"
    assumed = ("in m, as assumed",) if given is None and drawn.unit is None else ()
    return Walls(walls, (f"{file.name}: {'; '.join((summary, *drawn.notes, *assumed))}",))


def _metres(unit: float | str) -> float:
    """A unit [m]. Raises InvalidInput for an unknown name, or a number that is not above 0."""
    if isinstance(unit, str) and unit_name(unit) not in LENGTHS:
        raise InvalidInput(f"unit: expected a number [m] or one of {', '.join(LENGTHS)}; found {unit!r}")
    return LENGTHS[unit_name(unit)] if isinstance(unit, str) else positive(unit, "unit")


def _outlines(path: Path, drawn: Drawn, unit: float) -> tuple[Obstacle, ...]:
    """Lines and outlines of areas [unit] as obstacles; points are left out. Raises InvalidFile for a huge position."""
    parts = shapely.get_parts(shapely.get_parts(list(drawn.geometries)))
    areas = shapely.get_dimensions(parts) == 2
    lines = np.concatenate([shapely.get_rings(parts[areas]), parts[shapely.get_dimensions(parts) == 1]])
    found = [shapely.get_coordinates(line) * unit for line in shapely.remove_repeated_points(lines)]
    for points in found:
        if not (np.isfinite(points).all() and np.abs(points).max(initial=0.0) <= LARGEST):
            raise InvalidFile([f"{path}: expected positions of at most {LARGEST:g} m, found others"])
    long = [points for points in found if len(points) > 1]
    return tuple(Obstacle(Polyline(points), Stationary((0.0, 0.0)), f"wall {k}") for k, points in enumerate(long))


# ---------------------------------------------------------------------------------------------------------------------
# Readers, and the table of formats.


def _wkt(path: Path, unit: float) -> Drawn:
    """The shapes of a text in WKT: one, or one on each line."""
    content = text_of(path)
    try:
        return Drawn([shapely.from_wkt(content)])
    except shapely.errors.ShapelyError:
        lines = content.splitlines()
        return Drawn([_parsed(path, k + 1, line) for k, line in enumerate(lines) if line.strip()])


def _parsed(path: Path, number: int, line: str) -> Any:
    """The shape of line `number` in WKT."""
    try:
        return shapely.from_wkt(line)
    except shapely.errors.ShapelyError as error:
        raise InvalidFile([f"{path}:{number}: expected a shape in WKT, found {error}"]) from None


def _geojson(path: Path, unit: float) -> Drawn:
    """The shapes of GeoJSON."""
    content = text_of(path)
    try:
        json.loads(content)
        return Drawn([shapely.from_geojson(content)])
    except (ValueError, RecursionError, shapely.errors.ShapelyError) as error:
        raise InvalidFile([f"{path}: expected shapes in GeoJSON, found {' '.join(str(error).split())}"]) from None


def _jupedsim(path: Path, unit: float) -> Drawn:
    """The borders of the walkable area of a recording of JuPedSim."""
    return Drawn([shapely.LineString(wall) for wall in jupedsim(path).walls], 1.0)


def _movingai(path: Path, unit: float) -> tuple[Obstacle, ...]:
    """The cells of a MovingAI map that are not ground; y counts rows from the first, as in its tasks."""
    lines = text_of(path).splitlines()
    heads = dict(line.split(maxsplit=1) for line in lines[:3] if len(line.split()) == 2)
    height, width = heads.get("height", ""), heads.get("width", "")
    rows = lines[4:]
    while rows and not rows[-1].strip():
        rows = rows[:-1]
    if lines[3:4] != ["map"] or str(len(rows)) != height or {str(len(row)) for row in rows} != {width}:
        found = f"height {height}, width {width} and {len(rows)} rows of {sorted({len(row) for row in rows})[:3]} cells"
        raise InvalidFile([f"{path}: expected type, height, width, map and as many rows and cells, found {found}"])
    cells = np.array([[cell not in GROUND for cell in row] for row in rows])
    return occupancy(cells, unit).given


def _nav2(path: Path, unit: float) -> tuple[Obstacle, ...]:
    """The occupied cells of a map of nav2."""
    return read_map(path).given


def _dxf(path: Path, unit: float) -> Drawn:
    """The lines and curves of a drawing in DXF, blocks included; texts and others are left out, and counted."""
    with Extra("walls", "read_walls"):
        import ezdxf
        from ezdxf import disassemble, units
        from ezdxf.path import make_path
    content, notes = decoded(path)
    lines, others = list[Any](), Counter[str]()
    try:
        drawing = ezdxf.read(StringIO(content))
        # ezdxf takes m where a file has no unit.
        known = drawing.units and "$INSUNITS" in content
        stated = float(units.conversion_factor(drawing.units, units.M)) if known else None
        for count, entity in enumerate(disassemble.recursive_decompose(drawing.modelspace())):
            if count == MOST_SHAPES:
                raise InvalidFile([f"{path}: expected at most {MOST_SHAPES} shapes, found more"])
            try:
                outline = make_path(entity)
            except TypeError:
                others[entity.dxftype()] += 1
                continue
            for part in outline.sub_paths():
                if part.has_curves:
                    _check_positions(path, [tuple(point) for point in part.control_vertices()], stated or unit)
                points = [(x, y) for x, y, _ in part.flattening(ARC_ERROR / (stated or unit))]
                lines += [shapely.LineString(points)] if len(points) > 1 else []
    except (OSError, ezdxf.DXFError, *OF_PACKAGES) as error:
        raise InvalidFile([f"{path}: expected a drawing in DXF, found {' '.join(str(error).split())}"]) from None
    left_out = ", ".join(f"{count} {kind}" for kind, count in sorted(others.items()))
    return Drawn(lines, stated, (*notes, *([f"left out: {left_out}"] if others else [])))


def _svg(path: Path, unit: float) -> Drawn:
    """The lines and curves of a drawing in SVG, in units of its viewBox; y points down, as in the file."""
    with Extra("walls", "read_walls"):
        import svgelements as svg
    try:
        drawing = svg.SVG.parse(StringIO(text_of(path)))
        to_units = ~svg.Matrix(drawing.viewbox_transform or "")
        lines = [
            shapely.LineString(points)
            for shape in drawing.elements(lambda element: isinstance(element, svg.Shape))
            for part in (svg.Path(shape) * to_units).reify().as_subpaths()
            if len(points := _points(svg, svg.Path(part), path, unit)) > 1
        ]
    except OF_PACKAGES as error:
        raise InvalidFile([f"{path}: expected a drawing in SVG, found {' '.join(str(error).split())}"]) from None
    return Drawn(lines, None, ("y points down, as in the file",))


def _check_positions(path: Path, points: ArrayLike, unit: float) -> None:
    """Raise InvalidFile unless the points of a curve [unit] are at most FARTHEST_CURVE from the origin."""
    farthest = float(np.abs(points).max()) * unit
    if not farthest <= FARTHEST_CURVE:
        raise InvalidFile([f"{path}: expected curves within {FARTHEST_CURVE:g} m, found one at {farthest:.3g} m"])


def _points(svg: Any, path: Any, file: Path, unit: float) -> Array:
    """The points (n, 2) of a path of svgelements, with curves within ARC_ERROR of the lines between them."""
    found = list[Array]()
    for piece in path:
        if isinstance(piece, (svg.Move, svg.Line, svg.Close)):
            found += [] if piece.end is None else [np.array([[piece.end.x, piece.end.y]])]
            continue
        count = 2
        while True:
            points = np.asarray(piece.npoint(np.linspace(0.0, 1.0, 2 * count + 1)), dtype=np.float64)
            if count > MOST_POINTS:
                raise InvalidFile([f"{file}: expected curves of at most {MOST_POINTS} points, found a longer one"])
            # Between two points of a curve, its distance from the chord is that of the point between them, nearly.
            if np.linalg.norm(points[1::2] - 0.5 * (points[:-1:2] + points[2::2]), axis=1).max() * unit <= ARC_ERROR:
                break
            count *= 2
        found.append(points[::2])
    return np.concatenate(found) if found else np.empty((0, 2))


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


# ---------------------------------------------------------------------------------------------------------------------
# Maps of nav2.


KEYS: Final = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
"""Keys that a map has; `mode` may be among them, and others are not used."""
MODES: Final = ("trinary", "scale", "raw")
"""Values of the key `mode`; the first one is the default."""


class _Reading(NamedTuple):
    """How cells are read from an image."""

    mode: str
    negate: bool  # whether white is occupied
    occupied: float  # [1] occupancy above which a cell is occupied
    free: float  # [1] occupancy below which a cell is free


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
    return occupancy(_cells(_image(image), reading), resolution, origin, occupied=occupied, unknown=unknown)


def _checked(file: Path, root: "Node | None", content: Any) -> tuple[Path, float, Array, _Reading]:
    """Image, resolution [m], origin [m, m, rad] and reading of a map. Raises InvalidFile with all its mistakes."""
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
    reading = _Reading(found.get("mode", MODES[0]), found["negate"], occupied, free)
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


def _image(path: Path) -> "Image":
    """An image with all its pixels. Raises InvalidFile for a file that is none."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            image.load()
            return image.copy()
    except UnidentifiedImageError:
        raise InvalidFile([f"{path}: expected an image that Pillow reads, found another file"]) from None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        found = reason(error) if isinstance(error, OSError) and error.errno else " ".join(str(error).split())
        raise InvalidFile([f"{path}: expected an image that can be read, found {found}"]) from None


def _cells(image: "Image", reading: _Reading) -> npt.NDArray[np.int64]:
    """Cells (height, width) from -1 to 100 [%] of an image, from its last row on.

    The brightness of a pixel is the mean of its colours, in the mode trinary with its opacity. A cell is as occupied as
    it is dark, with `negate` as it is bright. Source: loadMapFromFile of nav2_map_server.
    """
    if image.mode.startswith("I"):
        colours, full = np.asarray(image, dtype=np.int64)[::-1, :, None], 65535
        opaque = np.ones(colours.shape[:2], np.bool_)
    else:
        rgba, full = np.asarray(image.convert("RGBA"), dtype=np.int64)[::-1], 255
        has_opacity = "A" in image.getbands() or "transparency" in image.info
        colours = rgba if reading.mode == "trinary" and has_opacity else rgba[..., :3]
        opaque = rgba[..., 3] == full
    bright = colours.sum(axis=-1) / (full * colours.shape[-1])
    cells = np.full(bright.shape, -1, np.int64)
    if reading.mode == "raw":
        values = np.round(bright * 255.0).astype(np.int64)
        return np.where(values <= 100, values, cells)
    share = bright if reading.negate else 1.0 - bright
    if reading.mode == "scale":
        cells = np.rint((share - reading.free) / (reading.occupied - reading.free) * 100.0).astype(np.int64)
    cells[share < reading.free] = 0
    cells[share > reading.occupied] = 100
    if reading.mode == "scale":
        cells[~opaque] = -1
    return cells
