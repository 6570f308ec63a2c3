"""Files of walls for tests, and what `read_walls` refuses."""

from collections.abc import Callable
from pathlib import Path

import pytest

from slalom import Obstacle, Polyline, Stationary, read_walls, routes
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


def with_fewer_shapes(folder: Path) -> object:
    """Reads a drawing where at most one shape is allowed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("slalom.io.walls.MOST_SHAPES", 1)
        return read_walls(written(folder, "a.dxf", dxf()))


OF_WALL_FILES: dict[str, Callable[[Path], object]] = {
    r"a\.txt: expected walls in a file that ends in \.wkt \(shapes in WKT\), ": reading("a.txt", ""),
    r"a\.wkt: expected walls, found none": reading("a.wkt", "POINT (1 2)"),
    r"a\.wkt:2: expected a shape in WKT, found ": reading("a.wkt", "POINT (1 2)\nLINESTRING (1 2, 3)"),
    r"a\.wkt: expected positions of at most ": reading("a.wkt", "LINESTRING (0 0, 1e300 0)"),
    r"a\.geojson: expected shapes in GeoJSON, found ": reading("a.geojson", '{"type": "Polygon"}'),
    r"a\.map: expected type, height, width, map and .* found height 3, width 5 and 3 rows": reading(
        "a.map", MOVINGAI.replace("width 4", "width 5")
    ),
    r"a\.dxf: expected a drawing in DXF, found ": reading("a.dxf", "no drawing"),
    r"a\.dxf: expected curves within 1e\+08 m, found one at ": reading("a.dxf", dxf().replace("500.0", "5e20")),
    r"a\.dxf: expected at most 1 shapes, found more": with_fewer_shapes,
    r"a\.svg: expected a drawing in SVG, found ": reading("a.svg", "<svg", 1.0),
    r"a\.svg: expected curves of at most 131072 points, found a longer one": reading(
        "a.svg", SVG.replace('height="100mm"', f'height="{"9" * 30}mm"'), 1.0
    ),
    r"a\.yaml:\d+:\d+: robot\.goal: expected a position with route, found path": lambda folder: read_scenario(
        written(folder, "a.yaml", MOVING_ROUTE)
    ),
}
"""Of files of walls, and of routes around them."""

OF_WALL_UNITS: dict[str, Callable[[Path], object]] = {
    r"unit: expected a number \[m\] or one of m, .*; found 'inch'": reading("a.wkt", "LINESTRING (0 0, 1 0)", "inch"),
    r"unit: expected the length of a unit of a\.svg, as 0\.04 or cm, found none": reading("a.svg", SVG),
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
