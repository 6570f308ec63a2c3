"""Files of walls for tests, and what `read_walls` refuses."""

from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

from slalom import Obstacle, Polyline, Stationary, read_walls, routes
from slalom.io import walls_child
from slalom.sim.files.scenario_yaml import read_scenario

MOVINGAI = "type octile\nheight 3\nwidth 4\nmap\n@@@@\n@..T\n@@S@\n"
SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="200mm" height="100mm" viewBox="0 0 20 10">'
    '<g transform="translate(1, 2)"><rect width="4" height="1"/><circle cx="5" cy="5" r="2"/></g></svg>'
)
DXF_ENTITIES = (
    "0\nLINE\n8\n0\n10\n0.0\n20\n0.0\n11\n4000.0\n21\n0.0\n"
    "0\nCIRCLE\n8\n0\n10\n1000.0\n20\n3000.0\n40\n500.0\n"
    "0\nTEXT\n8\n0\n10\n0.0\n20\n0.0\n40\n2.5\n1\nhall\n"
)


RING = Obstacle(Polyline([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]), Stationary((0.0, 0.0)))
MOVING_ROUTE = (
    "robot: {radius: 0.3, max_speed: 1, max_acceleration: 1, position: [0, 0], "
    "goal: {path: {points: [[0, 0], [1, 0]]}, route: true}}\n"
)


def dxf(unit: int | None = 4) -> str:
    """A drawing of a line, a circle and a text; unit 4 is mm, None: the file states none."""
    header = "" if unit is None else f"0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n{unit}\n0\nENDSEC\n"
    return f"{header}0\nSECTION\n2\nENTITIES\n{DXF_ENTITIES}0\nENDSEC\n0\nEOF\n"


def written(folder: Path, name: str, content: str) -> Path:
    """A file of this content."""
    (folder / name).write_text(content)
    return folder / name


def reading(name: str, content: str, unit: float | str | None = None) -> Callable[[Path], object]:
    """A call that reads such a file."""
    return lambda folder: read_walls(written(folder, name, content), unit)


def svg(body: str) -> str:
    """A drawing in SVG of these elements."""
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">{body}</svg>'


def blocks(inserts: dict[str, str], entities: str) -> str:
    """A drawing in DXF of a line in block B0, of other blocks, and of entities."""
    found = {"B0": "0\nLINE\n8\n0\n10\n0\n20\n0\n11\n1\n21\n1\n", **inserts}
    texts = (f"0\nBLOCK\n8\n0\n2\n{name}\n10\n0\n20\n0\n{body}0\nENDBLK\n8\n0\n" for name, body in found.items())
    sections = ("BLOCKS", "".join(texts)), ("ENTITIES", entities)
    return "".join(f"0\nSECTION\n2\n{name}\n{body}0\nENDSEC\n" for name, body in sections) + "0\nEOF\n"


def insert(name: str, times: int = 1) -> str:
    """A reference to a block in as many rows and columns."""
    return f"0\nINSERT\n8\n0\n2\n{name}\n10\n0\n20\n0\n70\n{times}\n71\n{times}\n44\n1\n45\n1\n"


def collections(depth: int) -> str:
    """Collections in WKT within each other."""
    return "GEOMETRYCOLLECTION (" * depth + "LINESTRING (0 0, 1 1)" + ")" * depth


def features(geometry: str, crs: str = "") -> str:
    """A geometry in GeoJSON."""
    system = f', "crs": {{"type": "name", "properties": {{"name": "{crs}"}}}}' if crs else ""
    feature = f'{{"type": "Feature", "geometry": {geometry}}}'
    return f'{{"type": "FeatureCollection"{system}, "features": [{feature}]}}'


def read_wall_here(folder: Path, name: str, content: str) -> object:
    """Read a file of walls as the process does that reads it."""
    path = written(folder, name, content)
    if name.endswith("dxf"):
        return walls_child.dxf(str(path), 0.005, None)
    return walls_child.svg(content, 0.005) if name.endswith("svg") else getattr(walls_child, path.suffix[1:])(content)


def with_fewer_points(folder: Path) -> object:
    """Read a line where at most one point is allowed."""
    with patch.object(walls_child, "MOST_POINTS", 1):
        return read_wall_here(folder, "a.wkt", "LINESTRING (0 0, 1 1)")


TWICE = "".join(f'<g id="a{k + 1}">{f"<use href={chr(34)}#a{k}{chr(34)}/>" * 10}</g>' for k in range(9))
CHAIN = {f"B{k + 1}": insert(f"B{k}") for k in range(200)}
FEATURE = '{"type": "Feature", "geometry": '
STREET = '{"type": "LineString", "coordinates": [[8.5417, 47.3769], [8.542, 47.377]]}'
REFUSED_WALLS: dict[str, tuple[str, str]] = {
    "shapes nested more than 100 times": ("a.wkt", collections(30_000)),
    "a character of code 0": ("a.wkt", "LINESTRING (0 0, 1 1)\0LINESTRING (5 5, 6 6)"),
    "ParseException: .* in line 2": ("a.wkt", "POINT (1 2)\nLINESTRING (1 2, 3)"),
    "[Nn]onlinear|Unknown type": ("a.wkt", "GEOMETRYCOLLECTION (CIRCULARSTRING (0 0, 1 1, 2 0))"),
    "Polygon without a list of coordinates": ("a.geojson", '{"type": "Polygon"}'),
    "a shape of type Circle": ("a.geojson", '{"type": "Circle"}'),
    "3 as a shape": ("a.geojson", "3"),
    r"\[\[1\], \[2\]\] as positions": ("a.geojson", '{"type": "LineString", "coordinates": [[1], [2]]}'),
    r"an area that ends at \[9, 9\]": ("a.geojson", '{"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [9, 9]]]}'),
    "objects nested more than 100 times": ("a.geojson", FEATURE * 200 + "null" + "}" * 200),
    r"positions in degrees \(.*CRS84": ("a.geojson", features(STREET, "urn:ogc:def:crs:OGC:1.3:CRS84")),
    r"positions in degrees \(.*4326": ("b.geojson", features(STREET, "EPSG:4326")),
    "a part that contains itself": ("a.dxf", blocks({"A": insert("A")}, insert("A"))),
    "1.8e[+]09 shapes and points by repeated parts": ("b.dxf", blocks({}, insert("B0", 30_000))),
    "3.22e[+]09 shapes and": ("c.dxf", blocks({f"B{k + 1}": insert(f"B{k}") * 10 for k in range(9)}, insert("B9"))),
    "parts nested more than 100 times": ("d.dxf", blocks(CHAIN, insert("B200"))),
    "curves of more than 4000000 points": ("e.dxf", dxf().replace("500.0", "5e20")),
    "part that contains itself": ("a.svg", svg('<g id="a"><use href="#a"/></g>')),
    "4.22e[+]09 shapes and": ("b.svg", svg(f'<defs><path id="a0" d="M0 0L1 1"/>{TWICE}</defs><use href="#a9"/>')),
    "parts nested more than 100": ("c.svg", svg("<g>" * 50_000 + "</g>" * 50_000)),
    "curves of more than 4000000": ("d.svg", svg('<circle r="1e30"/>')),
    "an element html": ("e.svg", "<html/>"),
    "'1 one' in place of numbers": ("f.svg", svg('<path d="M0 0L1 one"/>')),
    "a length of '3 miles'": ("g.svg", svg('<rect width="3 miles" height="1"/>')),
    "transformations 'scale[(]2'": ("h.svg", svg('<rect transform="scale(2" width="1" height="1"/>')),
    r"a transformation scale\(1 2 3\)": ("i.svg", svg('<rect transform="scale(1 2 3)" width="1" height="1"/>')),
    "a path that begins with 'L1 1'": ("j.svg", svg('<path d="L1 1"/>')),
    "L1 1 2 in a path": ("k.svg", svg('<path d="M0 0L1 1 2"/>')),
    "'1 1 0 2 1 4 4' in place of arcs": ("l.svg", svg('<path d="M0 0A1 1 0 2 1 4 4"/>')),
}
"""What the process that reads walls refuses, as the end of its message, and a file of each kind."""


OF_WALL_FILES: dict[str, Callable[[Path], object]] = {
    r"a\.txt: expected walls in a file that ends in \.wkt \(shapes in WKT\), ": reading("a.txt", ""),
    r"a\.png: expected walls .* found an image: .* map of nav2; `slalom\.occupancy` makes ": reading("a.png", ""),
    r"a\.wkt: expected walls, found none": reading("a.wkt", "POINT (1 2)"),
    r"a\.wkt: expected positions of at most ": reading("a.wkt", "LINESTRING (0 0, 1e300 0)"),
    r"a\.geojson: expected a unit, found positions that are degrees by ": reading("a.geojson", features(STREET)),
    r"a\.map: expected type, height, width, map and .* found height 3, width 5 and 3 rows": reading(
        "a.map", MOVINGAI.replace("width 4", "width 5")
    ),
    r"a\.dxf: expected a drawing in DXF, found ": reading("a.dxf", "no drawing"),
    r"a\.svg: expected a drawing in SVG, found ": reading("a.svg", "<svg", 1.0),
    r"a\.yaml:\d+:\d+: robot\.goal: expected a position with route, found path": lambda folder: read_scenario(
        written(folder, "a.yaml", MOVING_ROUTE)
    ),
}
"""Of files of walls, and of routes around them."""
OF_WALL_FILES |= {
    rf"{name}: expected .*, found .*({said})": reading(name, content, 1.0)
    for said, (name, content) in REFUSED_WALLS.items()
}

OF_WALL_UNITS: dict[str, Callable[[Path], object]] = {
    r"unit: expected a number \[m\] or one of m, .*; found 'inch'": reading("a.wkt", "LINESTRING (0 0, 1 0)", "inch"),
    r"unit: expected the length of a unit of a\.svg, as 0\.04 or cm, found none": reading("a.svg", SVG),
    r"up: expected it with a drawing in SVG, whose y points down, found it with a\.wkt": lambda folder: read_walls(
        written(folder, "a.wkt", "LINESTRING (0 0, 1 0)"), up=True
    ),
    r"unit: expected none for a\.yaml, which states its own, found cm": reading("a.yaml", "", "cm"),
    r"radii: expected numbers above 0 m, found 0 m": lambda _: routes([(0, 0)], [(1, 0)], 0.0, ()),
    r"goals\[0\]: expected a place apart from the start, found \[0\. 0\.\]": lambda _: routes(
        [(0, 0)], [(0, 0)], 0.3, ()
    ),
    r"starts\[0\]: expected a place outside of obstacles, found \[3\. 0\.\], 0 m inside one": lambda _: routes(
        [(3, 0)], [(0, 0)], 0.4, [Obstacle(Polyline([(3, -4), (3, 4)]), Stationary((0, 0)))]
    ),
    r"goals\[0\]: expected a place that a path leads to, found \[3\. 0\.\] without one": lambda _: routes(
        [(0, 0)], [(3, 0)], 0.3, [RING]
    ),
}
"""Of their units, and of routes."""
