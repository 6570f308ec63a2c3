"""Readers of walls, which run in the process of `io.limited`: they import nothing of slalom.

Each returns a tree and the arrays `points` (n, 2) and `counts` (m,), the points of each of m lines, in units of the
file; of an image, its cells. All raise Refused, and what the libraries raise.
"""

import json
import re
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator
from itertools import groupby
from math import ceil, hypot, inf, pi, sqrt, tan
from operator import itemgetter
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely

DEPTH: Final = 100
"""[1] Parts within parts of a file of walls, as groups of groups.

Larger: recursion may end in an error. Smaller: drawings of editors that nest groups are refused.
"""

EXPANDED: Final = 100_000
"""[1] Shapes and points of a file beyond those that it states, by parts that occur several times.

Larger: a file of a few bytes takes minutes. Smaller: drawings with many pieces of furniture are refused.
"""

MOST_POINTS: Final = 4_000_000
"""[1] Points of a file, with those of its curves. Larger: mistaken files take all memory. Smaller: maps are refused."""

MOST_CELLS: Final = 2**26
"""[1] Cells of a map. Larger: an image of a few kilobytes takes gigabytes. Smaller: large maps are refused."""

Answer = tuple[dict[str, Any], list[Any]]


class Refused(Exception):
    """Content that no file of walls has; the message states it."""


def expanded(root: Hashable, inside: Callable[[Any], tuple[float, list[tuple[Any, int]]]]) -> tuple[float, float, int]:
    """Return the weight of all that a file stands for, the weight of what it states, and the depth.

    Args:
        inside: the own weight of a part, and the parts of which it consists with how often each occurs.

    A part that contains itself makes the weight infinite.
    """
    weights, depths = dict[Any, float](), dict[Any, int]()
    stated, stack = 0.0, [root]
    while stack:
        part = stack[-1]
        own, parts = inside(part)
        if part not in weights:
            # Until it is known: that of a part that contains itself stays infinite.
            weights[part], depths[part] = inf, 0
            stated += own
            stack += [one for one, _ in parts if one not in weights]
            if stack[-1] is not part:
                continue
        weights[part] = own + sum(times * weights[one] for one, times in parts)
        depths[part] = 1 + max((depths[one] for one, _ in parts), default=0)
        stack.pop()
    return weights[root], stated, depths[root]


def check_expanded(root: Hashable, inside: Callable[[Any], tuple[float, list[tuple[Any, int]]]]) -> None:
    """Raise Refused for parts that contain themselves, are nested deeper than DEPTH or occur too often."""
    weight, stated, depth = expanded(root, inside)
    if weight == inf:
        raise Refused("a part that contains itself")
    if depth > DEPTH:
        raise Refused(f"parts nested more than {DEPTH} times")
    if weight - stated > EXPANDED:
        raise Refused(f"{weight - stated:.3g} shapes and points by repeated parts, more than {EXPANDED}")


class Lines:
    """The lines of a file: points within `tolerance` [unit of the file] of its curves."""

    def __init__(self, tolerance: float = inf) -> None:
        self.tolerance, self.left = tolerance, float(MOST_POINTS)
        self.found: list[Any] = []

    def add(self, points: Any) -> None:
        """Append a line through points (n, 2); fewer than two points are none."""
        if len(points) > 1:
            self.found.append(np.asarray(points, dtype=np.float64))

    def steps(self, bend: float) -> Any:
        """Return parameters (n,) above 0 up to 1 of points of a curve; `bend`: the size of its second derivative."""
        count = sqrt(bend / (8.0 * self.tolerance))
        self.left -= count
        # Not a number for a curve with positions that are none.
        if not self.left >= 0.0:
            raise Refused(f"curves of more than {MOST_POINTS} points")
        return np.linspace(0.0, 1.0, max(ceil(count), 1) + 1)[1:]

    def cubic(self, corners: Any, scale: float = 1.0) -> Any:
        """Return points (n, 2) of a Bezier curve with 4 corners (4, 2), without the first; `scale`: of its unit."""
        a, b, c, d = np.asarray(corners, dtype=np.float64)
        bend = 6.0 * float(np.hypot(*np.stack([a - 2.0 * b + c, b - 2.0 * c + d]).T).max())
        t = self.steps(bend * scale)[:, None]
        s = 1.0 - t
        return s**3 * a + 3.0 * s * s * t * b + 3.0 * s * t * t * c + t**3 * d

    def answer(self, **tree: Any) -> Answer:
        """Return the answer for these lines."""
        counts = np.array([len(points) for points in self.found], dtype=np.int64)
        if counts.sum() > MOST_POINTS:
            raise Refused(f"{counts.sum()} points, more than {MOST_POINTS}")
        return tree, [np.concatenate(self.found or [np.empty((0, 2))]), counts]


def wkt(content: str) -> Answer:
    """The lines and outlines of shapes in WKT: one, or one on each line."""
    if "\0" in content:
        raise Refused("a character of code 0")
    letters = np.frombuffer(content.encode(), np.uint8)
    depth = np.cumsum((letters == ord("(")).astype(np.int32) - (letters == ord(")")))
    if depth.max(initial=0) > DEPTH:
        raise Refused(f"shapes nested more than {DEPTH} times")
    try:
        shapes = [shapely.from_wkt(content)]
    except shapely.errors.ShapelyError:
        shapes = [_parsed(k + 1, line) for k, line in enumerate(content.splitlines()) if line.strip()]
    lines = Lines()
    rings, others = outlines(shapes)
    for line in (*rings, *others):
        lines.add(shapely.get_coordinates(line))
    return lines.answer(areas=len(rings))


def _parsed(number: int, line: str) -> Any:
    """The shape of line `number` in WKT."""
    try:
        return shapely.from_wkt(line)
    except shapely.errors.ShapelyError as error:
        raise Refused(f"{error} in line {number}") from None


def outlines(shapes: Iterable[Any]) -> tuple[Any, Any]:
    """The outlines of areas, and the lines, of shapes of shapely; points are left out."""
    parts = np.asarray(list(shapes), dtype=object)
    # Of collections of collections; a collection of nothing has no parts.
    while (shapely.get_type_id(parts) > 3).any():
        parts = shapely.get_parts(parts)
    areas = shapely.get_dimensions(parts) == 2
    return shapely.get_rings(parts[areas]), parts[shapely.get_dimensions(parts) == 1]


GEOGRAPHIC: Final = re.compile(r"CRS:?(84|83|27)\b|EPSG:+([\d.]*:)?4\d{3}\b", re.IGNORECASE)
"""Names of systems of coordinates in degrees."""

LEVELS: Final = {"LineString": 1, "MultiLineString": 2, "Polygon": 2, "MultiPolygon": 3}
"""[1] Lists within each other that are the coordinates of a shape of GeoJSON, but those of positions."""


def geojson(content: str) -> Answer:
    """The lines and outlines of GeoJSON, and whether its positions may be degrees, which they are by its standard.

    Positions are refused whose system of coordinates, the former member `crs`, is in degrees.
    """
    root = json.loads(content)
    lines = Lines()
    for positions in _positions(root, 0):
        lines.add(positions)
    _, (points, counts) = lines.answer()
    system = str(root.get("crs") or "")
    geographic = GEOGRAPHIC.search(system) is not None
    # A degree is 111 km: walls in degrees have fractions.
    may_be = bool((np.abs(points) <= (180.0, 90.0)).all() and (geographic or (points % 1.0).any()))
    if may_be and geographic:
        raise Refused(f"positions in degrees ({system[:100]}), which a projection turns into metres")
    return {"may_be_degrees": may_be and not system}, [points, counts]


def _positions(shape: Any, depth: int) -> Iterator[Any]:
    """The positions (n, 2) of each line of an object of GeoJSON."""
    if not isinstance(shape, dict) or depth > DEPTH:
        raise Refused(f"objects nested more than {DEPTH} times" if depth > DEPTH else f"{str(shape)[:100]} as a shape")
    kind = shape.get("type")
    if kind == "Feature":
        yield from () if shape.get("geometry") is None else _positions(shape["geometry"], depth + 1)
    elif kind in ("FeatureCollection", "GeometryCollection"):
        for part in _list(shape, "features" if kind[0] == "F" else "geometries"):
            yield from _positions(part, depth + 1)
    elif kind in LEVELS:
        parts = [_list(shape, "coordinates")]
        for _ in range(LEVELS[kind] - 1):
            parts = [part for several in parts for part in several]
        for part in parts:
            points = np.array(part or np.empty((0, 2)))
            if points.ndim != 2 or points.shape[1] < 2 or points.dtype.kind not in "if":
                raise Refused(f"{str(part)[:100]} as positions")
            if len(points) and "Polygon" in kind and (points[0] != points[-1]).any():
                raise Refused(f"an area that ends at {points[-1].tolist()} and begins at {points[0].tolist()}")
            yield points[:, :2]
    elif kind not in ("Point", "MultiPoint"):
        raise Refused(f"a shape of type {str(kind)[:100]}")


def _list(shape: dict[str, Any], key: str) -> list[Any]:
    """The list of this key."""
    if not isinstance(shape.get(key), list):
        raise Refused(f"{shape['type']} without a list of {key}")
    return shape[key]  # type: ignore[no-any-return]


def dxf(path: str, error: float, unit: float | None) -> Answer:
    """The lines and curves of a drawing in DXF, blocks included; texts and others are left out, and counted.

    Args:
        error: [m] largest distance of a curve. unit: [m] given; None: as the file states, else 1 m.
    """
    from io import StringIO

    import ezdxf
    from ezdxf import disassemble, units
    from ezdxf.path import make_path

    raw, notes = Path(path).read_bytes(), list[str]()
    try:
        content = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        content, notes = raw.decode("latin-1"), ["text not in UTF-8: read as Latin-1"]
    drawing = ezdxf.read(StringIO(content.replace("\r\n", "\n").replace("\r", "\n")))
    check_expanded("", lambda name: _of_block(drawing, name))
    # ezdxf takes m where a file has no unit.
    known = drawing.units and "$INSUNITS" in content
    stated = float(units.conversion_factor(drawing.units, units.M)) if known else None
    lines, others = Lines(error / (stated or unit or 1.0)), Counter[str]()
    for entity in disassemble.recursive_decompose(drawing.modelspace()):
        try:
            outline = make_path(entity)
        except TypeError:
            others[entity.dxftype()] += 1
            continue
        for part in outline.sub_paths():
            lines.add(_flat(lines, part) if part.has_curves else [(p.x, p.y) for p in part.control_vertices()])
    return lines.answer(unit=stated, notes=notes, others=others)


def _of_block(drawing: Any, name: str) -> tuple[float, list[tuple[Any, int]]]:
    """The weight of a block of a drawing, of the drawing itself for "", and the blocks in it, see `expanded`."""
    weight, parts = 1.0, list[tuple[Any, int]]()
    for entity in drawing.blocks.get(name, ()) if name else drawing.modelspace():
        weight += 1 + (len(entity) if hasattr(entity, "__len__") else 0)
        kind = entity.dxftype()
        if kind == "INSERT":
            parts.append((entity.dxf.get("name", "").lower(), max(entity.mcount, 1)))
        elif kind in ("DIMENSION", "ACAD_TABLE"):
            parts.append((entity.dxf.get("geometry", "").lower(), 1))
    return weight, [part for part in parts if part[0]]


def _flat(lines: Lines, path: Any) -> Any:
    """The points (n, 2) of a path of ezdxf."""
    at = np.array([(path.start.x, path.start.y)])
    found = [at]
    for step in path.commands():
        end = np.array([(step.end.x, step.end.y)])
        controls = [np.array([(p.x, p.y)]) for p in (getattr(step, name, None) for name in _CONTROLS) if p is not None]
        if len(controls) == 1:
            controls = [each + 2.0 / 3.0 * (controls[0] - each) for each in (at, end)]
        found.append(lines.cubic(np.concatenate([at, *controls, end])) if controls else end)
        at = end
    return np.concatenate(found)


_CONTROLS = ("ctrl", "ctrl1", "ctrl2")


def svg(content: str, error: float) -> Answer:
    """The lines and curves of a drawing in SVG, in units of its viewBox; texts and others are left out, and counted.

    Args:
        error: [unit of the file] largest distance of a curve.

    Elements that are not drawn are left out: those in `defs`, those with `display: none`, also by their class.
    """
    root = ET.fromstring(content)
    if _tag(root) != "svg":
        raise Refused(f"an element {_tag(root)[:100]}")
    drawing = Drawing(root, Lines(error))
    check_expanded(root, drawing.inside)
    box = _numbers(root.get("viewBox", ""))
    top = box[1] if len(box) == 4 else 0.0
    width, height = (
        box[2:4] if len(box) == 4 else (_length(root.get(name, "100%"), 0.0) for name in ("width", "height"))
    )
    drawing.draw(root, np.eye(2, 3), (width, height))
    return drawing.lines.answer(others=drawing.others, turned=2.0 * top + height)


NUMBER: Final = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
ARC: Final = re.compile(
    r"[\s,]*".join((r"", *[f"({NUMBER.pattern})"] * 3, "([01])", "([01])", *[f"({NUMBER.pattern})"] * 2))
)
UNITS: Final = {"": 1.0, "px": 1.0, "in": 96.0, "cm": 96.0 / 2.54, "mm": 96.0 / 25.4, "pt": 96.0 / 72.0, "pc": 16.0}
"""[px] Units of lengths of SVG."""
GROUPS: Final = ("svg", "g", "a", "switch", "symbol")
SHAPES: Final = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
LEFT_OUT: Final = ("text", "image", "foreignObject")
SPACES: Final = " \t\n\r\f,"


def _tag(element: Any) -> str:
    """The name of an element of SVG; names of other languages keep theirs."""
    return str(element.tag).removeprefix("{http://www.w3.org/2000/svg}")


def _numbers(text: str) -> list[float]:
    """The numbers of a text, between which are spaces and commas."""
    if not set(NUMBER.sub("", text)) <= set(SPACES):
        raise Refused(f"{text[:100]!r} in place of numbers")
    return list(map(float, NUMBER.findall(text)))


def _length(text: str, whole: float) -> float:
    """A length [px or units of the viewBox]; of a percentage, the share of `whole`."""
    number = NUMBER.match(text)
    if number and number.end() == len(text):
        return float(text)
    number = NUMBER.match(text.strip())
    unit = text.strip()[number.end() :].strip() if number else text
    if number is None or unit not in (*UNITS, "%"):
        raise Refused(f"a length of {text[:100]!r}")
    return float(number[0]) * (whole / 100.0 if unit == "%" else UNITS[unit])


def _transform(text: str) -> Any:
    """The matrix (2, 3) of a list of transformations."""
    found, each = np.eye(3), re.compile(r"(\w+)\s*\(([^()]*)\)")
    if not set(each.sub("", text)) <= set(SPACES):
        raise Refused(f"transformations {text[:100]!r}")
    for name, values in each.findall(text):
        one, v = np.eye(3), _numbers(values)
        if name == "matrix" and len(v) == 6:
            one[:2] = np.reshape(v, (3, 2)).T
        elif name == "translate" and len(v) in (1, 2):
            one[:2, 2] = (*v, 0.0)[:2]
        elif name == "scale" and len(v) in (1, 2):
            one[0, 0], one[1, 1] = v[0], v[-1]
        elif name == "rotate" and len(v) in (1, 3):
            center = np.array(v[1:] or (0.0, 0.0))
            one[:2, :2] = _rotation(v[0])
            one[:2, 2] = center - one[:2, :2] @ center
        elif name in ("skewX", "skewY") and len(v) == 1:
            one[(0, 1) if name == "skewX" else (1, 0)] = tan(v[0] * pi / 180.0)
        else:
            raise Refused(f"a transformation {name}({values})"[:100])
        found = found @ one
    return found[:2]


def _moved(matrix: Any, x: float, y: float, scale_x: float = 1.0, scale_y: float = 1.0) -> Any:
    """The matrix (2, 3) that scales and moves before `matrix`."""
    return np.column_stack([matrix[:, 0] * scale_x, matrix[:, 1] * scale_y, matrix @ (x, y, 1.0)])


class Drawing:
    """The elements of a drawing in SVG that are drawn."""

    def __init__(self, root: Any, lines: Lines) -> None:
        self.lines = lines
        self.others = Counter[str]()
        self.named = {element.get("id"): element for element in reversed(list(root.iter())) if element.get("id")}
        styles = " ".join(element.text or "" for element in root.iter() if _tag(element) == "style")
        rules = re.findall(r"([^{}]*)\{([^{}]*)\}", styles)
        self.hidden = {name for these, rule in rules if _hides(rule) for name in re.findall(r"\.([\w-]+)", these)}

    def drawn(self, element: Any) -> list[Any]:
        """The elements of a group, or those to which a `use` refers, that are drawn."""
        if _tag(element) in GROUPS:
            return [child for child in element if not self.is_hidden(child) and _tag(child) != "symbol"]
        target = self.named.get(self.reference(element)) if _tag(element) == "use" else None
        return [] if target is None or self.is_hidden(target) else [target]

    def is_hidden(self, element: Any) -> bool:
        """Whether an element and those in it are not drawn."""
        if element.get("display") == "none" or _hides(element.get("style", "")):
            return True
        return not self.hidden.isdisjoint(element.get("class", "").split())

    def reference(self, element: Any) -> str:
        """The id to which a `use` refers; "" for another file."""
        found = str(element.get("href") or element.get("{http://www.w3.org/1999/xlink}href") or "")
        return found[1:] if found.startswith("#") else ""

    def inside(self, element: Any) -> tuple[float, list[tuple[Any, int]]]:
        """The weight of an element and the elements that are drawn for it, see `expanded`."""
        # A point takes four characters or more.
        own = 1 + len(element.get("d", "") + element.get("points", "")) // 4
        return own, [(part, 1) for part in self.drawn(element)]

    def draw(self, element: Any, matrix: Any, view: tuple[float, float]) -> None:
        """Add the lines of an element. `matrix` (2, 3) of what it is in, `view` [unit] the size of the view."""
        tag = _tag(element)
        if element.get("transform"):
            matrix = matrix @ np.vstack([_transform(element.get("transform")), (0.0, 0.0, 1.0)])
        if tag in SHAPES:
            for line in Pen(self.lines, matrix).path(_outline(element, view)):
                self.lines.add(line @ matrix[:, :2].T + matrix[:, 2])
            return
        if tag == "use":
            matrix = _moved(matrix, *(_length(element.get(name, "0"), whole) for name, whole in zip("xy", view)))
        for part in (drawn := self.drawn(element)):
            inner, inner_view = matrix, view
            if _tag(part) in ("svg", "symbol"):
                inner, inner_view = _viewport(part, element if tag == "use" else part, matrix, view)
            self.draw(part, inner, inner_view)
        if tag in LEFT_OUT or (tag == "use" and not drawn):
            self.others[tag] += 1


def _hides(style: str) -> bool:
    """Whether declarations of a style hide an element."""
    return re.search(r"(?:^|;)\s*display\s*:\s*none", style) is not None


def _viewport(element: Any, sized: Any, matrix: Any, view: tuple[float, float]) -> tuple[Any, tuple[float, float]]:
    """The matrix (2, 3) and the view of a `svg` or `symbol` in a drawing; `sized` has the width and the height."""
    x, y = (_length(element.get(name, "0"), whole) for name, whole in zip("xy", view))
    width, height = (
        _length(sized.get(name) or element.get(name) or "100%", whole) for name, whole in zip(("width", "height"), view)
    )
    box = _numbers(element.get("viewBox", ""))
    if len(box) != 4:
        return _moved(matrix, x, y), (width, height)
    scales = [width / box[2], height / box[3]]
    place = element.get("preserveAspectRatio", "xMidYMid")
    if not place.startswith("none"):
        scales = [max(scales) if "slice" in place else min(scales)] * 2
    spare = (width - scales[0] * box[2], height - scales[1] * box[3])
    share = [{"Mi": 0.5, "Ma": 1.0}.get(place[k : k + 2], 0.0) for k in (1, 5)]
    x, y = x + share[0] * spare[0] - scales[0] * box[0], y + share[1] * spare[1] - scales[1] * box[1]
    return _moved(matrix, x, y, *scales), (box[2], box[3])


def _outline(element: Any, view: tuple[float, float]) -> str:
    """The path that stands for a shape."""
    tag, get = _tag(element), element.get
    if tag in ("path", "polyline", "polygon"):
        points = get("points", "").strip()
        return str(get("d", "")) if tag == "path" else f"M{points}{'z' * (tag == 'polygon')}" if points else ""

    def size(name: str, other: str = "") -> float:
        whole = view[0] if "x" in name or name == "width" else view[1]
        return _length(get(name) or get(other) or "0", hypot(*view) / sqrt(2.0) if name == "r" else whole)

    if tag == "line":
        return f"M{size('x1')} {size('y1')}L{size('x2')} {size('y2')}"
    if tag == "rect":
        x, y, w, h = (size(name) for name in ("x", "y", "width", "height"))
        rx = min(size("rx", "ry"), 0.5 * w)
        ry = min(size("ry", "rx"), 0.5 * h)
        if rx <= 0.0 or ry <= 0.0:
            return f"M{x} {y}H{x + w}V{y + h}H{x}z" if w > 0.0 and h > 0.0 else ""
        right, low = x + w, y + h
        turn = f"A{rx} {ry} 0 0 1"
        return (
            f"M{x + rx} {y}H{right - rx}{turn} {right} {y + ry}V{low - ry}{turn} {right - rx} {low}"
            f"H{x + rx}{turn} {x} {low - ry}V{y + ry}{turn} {x + rx} {y}z"
        )
    x, y = size("cx"), size("cy")
    rx, ry = (size("r"),) * 2 if tag == "circle" else (size("rx", "ry"), size("ry", "rx"))
    half = f"A{rx} {ry} 0 1 1"
    return f"M{x + rx} {y}{half} {x - rx} {y}{half} {x + rx} {y}z" if rx > 0.0 and ry > 0.0 else ""


class Pen:
    """The lines of the paths of a shape in its own coordinates; `matrix` (2, 3) leads to those of the drawing."""

    def __init__(self, lines: Lines, matrix: Any) -> None:
        self.lines, self.matrix = lines, matrix
        self.done, self.pieces = list[Any](), list[Any]()
        self.at = self.start = self.control = np.zeros(2)

    @property
    def scale(self) -> float:
        """[unit of the drawing] Largest length of a vector of length 1 in the drawing."""
        return float(np.linalg.norm(self.matrix[:, :2], 2))

    def path(self, text: str) -> list[Any]:
        """The lines (n, 2) of the data of a path. Raises Refused for commands that are none."""
        tokens, before = re.split(r"([MmZzLlHhVvCcSsQqTtAa])", text), ""
        if tokens[0].strip() or (len(tokens) > 1 and tokens[1] not in "Mm"):
            raise Refused(f"a path that begins with {text[:100]!r}")
        for command, values in _joined(tokens):
            kind = command.upper()
            numbers = _arcs(values) if kind == "A" else _numbers(values)
            width = WIDTHS[kind]
            if len(numbers) % width or bool(numbers) == (kind == "Z"):
                raise Refused(f"{command}{values[:100]} in a path")
            rows = np.reshape(numbers, (-1, width))
            origin = self.at if command.islower() else np.zeros(2)
            if kind in "MLHV":
                self.straight(kind, rows, origin, command.islower())
            elif kind == "Z":
                self.to(self.start[None])
                self.begin(self.start)
            for row in rows if kind in "CSQTA" else ():
                origin = self.at if command.islower() else np.zeros(2)
                if kind == "A":
                    self.arc(row[:5].tolist(), origin + row[5:])
                else:
                    self.curve(kind, before, row.reshape(-1, 2) + origin)
                before = kind
            before = kind
        self.begin(self.start)
        return self.done

    def begin(self, point: Any) -> None:
        """Begin another line at a point."""
        if len(self.pieces) > 1:
            self.done.append(np.concatenate(self.pieces))
        self.start = self.at = point
        self.pieces = [point[None]]

    def to(self, points: Any) -> None:
        """Continue the line to points (n, 2)."""
        if len(points):
            self.pieces.append(points)
            self.at = points[-1]

    def straight(self, kind: str, rows: Any, origin: Any, relative: bool) -> None:
        """Lines through positions, x or y."""
        if kind in "HV":
            along = np.cumsum(rows[:, 0]) if relative else rows[:, 0]
            rows = np.tile(self.at, (len(rows), 1))
            rows[:, "HV".index(kind)] = along + origin["HV".index(kind)]
        else:
            rows = (np.cumsum(rows, axis=0) if relative else rows) + origin
        if kind == "M":
            self.begin(rows[0])
        self.to(rows[kind == "M" :])

    def curve(self, kind: str, before: str, corners: Any) -> None:
        """A Bezier curve with corners after the first one; S and T continue the curve before."""
        if kind in "ST":
            smooth = before in ("CS" if kind == "S" else "QT") and before != ""
            corners = np.vstack([2.0 * self.at - self.control if smooth else self.at, corners])
        self.control = corners[-2]
        if kind in "QT":
            corners = np.vstack(
                [each + 2.0 / 3.0 * (corners[0] - each) for each in (self.at, corners[1])] + [corners[1]]
            )
        self.to(self.lines.cubic(np.vstack([self.at, corners]), self.scale))

    def arc(self, numbers: list[float], end: Any) -> None:
        """An arc of an ellipse. Source: SVG 1.1, appendix F.6, endpoint to center parameterization."""
        rx, ry, turn, large, sweep = numbers
        axes = _rotation(turn) * (abs(rx), abs(ry))
        if rx == 0.0 or ry == 0.0 or np.array_equal(end, self.at):
            self.to(end[None])
            return
        # In the frame in which the ellipse is the unit circle, unless it is too small for the end.
        half = _rotation(turn).T @ (0.5 * (self.at - end)) / (abs(rx), abs(ry))
        far = max(float(np.hypot(*half)), 1.0)
        half, axes = half / far, axes * far
        away = sqrt(max(1.0 / float(half @ half) - 1.0, 0.0)) * (-1.0 if large == sweep else 1.0)
        center = away * np.array([half[1], -half[0]])
        first, last = (np.arctan2(*(point - center)[::-1]) for point in (half, -half))
        angle = (last - first) % (2.0 * pi) - (0.0 if sweep else 2.0 * pi)
        bend = angle * angle * float(np.linalg.norm(axes)) * self.scale
        angles = first + angle * self.lines.steps(bend)
        middle = 0.5 * (self.at + end) + axes @ center
        points = middle + np.stack([np.cos(angles), np.sin(angles)], axis=1) @ axes.T
        points[-1] = end
        self.to(points)


def _joined(tokens: list[str]) -> Iterator[tuple[str, str]]:
    """The commands of a path with the numbers after them: of several equal ones, those of all."""
    for command, several in groupby(zip(tokens[1::2], tokens[2::2]), itemgetter(0)):
        values = [numbers for _, numbers in several]
        if command in "MmZz" or not all(map(str.strip, values)):
            yield from ((command, numbers) for numbers in values)
        else:
            yield command, " ".join(values)


WIDTHS: Final = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 1}
"""[1] Numbers of each command of a path."""


def _arcs(text: str) -> list[float]:
    """The numbers of arcs, whose flags need no spaces between them."""
    if not set(ARC.sub("", text)) <= set(SPACES):
        raise Refused(f"{text[:100]!r} in place of arcs")
    return [float(number) for arc in ARC.findall(text) for number in arc]


def _rotation(degrees: float) -> Any:
    """The matrix (2, 2) of a rotation."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s], [s, c]])


# Images.


def image(path: str, size: int, mode: str, negate: bool, occupied: float, free: float) -> Answer:
    """The cells (height, width) from -1 to 100 [%] of an image of `size` bytes, from its last row on.

    The brightness of a pixel is the mean of its colours, in the mode trinary with its opacity. A cell is as occupied as
    it is dark, with `negate` as it is bright. Source: loadMapFromFile of nav2_map_server.

    Args:
        mode: of nav2: trinary, scale or raw. occupied: [1] occupancy above which a cell is occupied; free: below which
            it is free.
    """
    from PIL import Image, UnidentifiedImageError

    Image.init()
    # Another program reads EPS. Cells are counted here.
    Image.MAX_IMAGE_PIXELS = None
    try:
        picture: Any = Image.open(path, formats=[name for name in Image.ID if name != "EPS"])
    except UnidentifiedImageError:
        raise Refused("another file") from None
    if picture.width * picture.height > MOST_CELLS:
        picture.close()
        raise Refused(f"{picture.width} x {picture.height} cells, more than {MOST_CELLS}")
    picture.load()
    opaque: Any = True
    if picture.mode.startswith("I"):
        full, count = 65535, 1
        sums = np.clip(np.asarray(picture, dtype=np.int32), 0, full)
    else:
        rgba, full = np.asarray(picture.convert("RGBA")), 255
        has_opacity = "A" in picture.getbands() or "transparency" in picture.info
        count = 4 if mode == "trinary" and has_opacity else 3
        sums, opaque = rgba[..., :count].sum(axis=-1, dtype=np.int16), rgba[..., 3] == full
    # Few sums differ: each has its value.
    bright = np.arange(full * count + 1) / (full * count)
    share = bright if negate else 1.0 - bright
    values = np.full(len(bright), -1, np.int64)
    if mode == "raw":
        levels = np.round(bright * 255.0).astype(np.int64)
        values = np.where(levels <= 100, levels, values)
    else:
        if mode == "scale":
            values = np.rint((share - free) / (occupied - free) * 100.0).astype(np.int64)
        values[share < free], values[share > occupied] = 0, 100
    cells = values.astype(np.int8)[sums]
    if mode == "scale":
        cells[~np.broadcast_to(opaque, cells.shape)] = -1
    # A change between neighbours takes a bit of the file unless parts are repeated.
    changes = np.count_nonzero(cells[:, 1:] != cells[:, :-1])
    if changes > EXPANDED + 8 * size:
        raise Refused(f"{changes} changes between cells in {size} bytes, far more than an image of this size holds")
    return {}, [cells[::-1]]
