"""Walls of files: the coordinates of the file times the unit, in scenarios, on the command line and in pictures."""

from collections.abc import Callable
from math import comb
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st
from recording_formats import RECORDED
from wall_files import MOVINGAI, SVG, blocks, collections, dxf, features, insert, svg, written

from slalom import METHODS, InvalidFile, Polyline, Stationary, read_walls
from slalom.obstacle.pieces import outline_parts
from slalom.sim import simulate
from slalom.sim.files.scenario_yaml import files_of, read_scenario

CASES = RECORDED.parent / "cases" / "files"
HALL = "MULTILINESTRING ((25 2, 35 2), (25 -1, 35 -1))"
ROBOTS = """
robots:
- {name: a, radius: 0.3, max_speed: 1.5, max_acceleration: 2, position: [26, 0], goal: {position: [34, 0], stop: true}}
- {name: b, radius: 0.3, max_speed: 1.5, max_acceleration: 2, position: [34, 1], goal: {position: [26, 1], stop: true}}
"""


def lines(path: Path, unit: float | str | None = None) -> list[list[list[float]]]:
    """The corners [m] of each wall of a file of lines."""
    found = []
    for wall in read_walls(path, unit).obstacles:
        assert isinstance(wall.shape, Polyline)
        assert isinstance(wall.trajectory, Stationary)
        found.append(np.asarray(wall.shape.points).tolist())
    return found


def covered(path: Path, unit: float | None = None) -> shapely.Geometry:
    """The area that the obstacles of a file of cells cover."""
    parts = [part for wall in read_walls(path, unit).obstacles for part in outline_parts(wall, 0.0)]
    return shapely.union_all([shapely.Polygon(part.corners) for part in parts])


RECTANGLE = [[[0, 0], [4, 0], [4, 1], [0, 1], [0, 0]]]
AS_SAID = {
    "walls.wkt": RECTANGLE,
    "walls.geojson": RECTANGLE,
    "jps_v1.sqlite": [[[-1, -1], [6, -1], [6, 2], [-1, 2], [-1, -1]]],
}


@pytest.mark.skipif(not CASES.is_dir(), reason=f"no files at {CASES}: they are not part of slalom")
def test_files_of_other_tools_are_walls() -> None:
    for name, wanted in AS_SAID.items():
        assert lines(CASES / name) == wanted, name
    floor = shapely.union_all(
        [shapely.box(x, y, x + 1, y + 1) for x, y in ((1, 1), (2, 1), (3, 1), (4, 1), (1, 2), (4, 2))]
    )
    assert shapely.equals(covered(CASES / "movingai.map"), shapely.difference(shapely.box(0, 0, 6, 4), floor))
    sides = shapely.union_all([shapely.box(x, -1, x + 0.05, -0.8) for x in (-1.0, -0.85)])
    assert shapely.symmetric_difference(covered(CASES / "nav2_map.yaml"), sides).area < 1e-12


AREAS = st.lists(st.tuples(st.integers(-50, 50), st.integers(-50, 50)), min_size=3, max_size=8, unique=True).map(
    lambda points: shapely.convex_hull(shapely.MultiPoint(points))
)


@settings(max_examples=30, deadline=None)
@given(areas=st.lists(AREAS.filter(lambda area: area.geom_type == "Polygon"), min_size=1, max_size=4))
def test_walls_are_the_outlines_of_areas(
    areas: list[shapely.Polygon], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("walls")
    wanted = [[[0.5 * x, 0.5 * y] for x, y in shapely.get_coordinates(area)] for area in areas]
    whole = shapely.GeometryCollection([shapely.MultiPolygon([area]) for area in areas])
    texts = {
        "one.wkt": whole.wkt,
        "lines.wkt": "\n".join(area.wkt for area in areas),
        "a.geojson": shapely.to_geojson(whole),
    }
    for name, content in texts.items():
        assert lines(written(folder, name, content), 0.5) == wanted


def test_cells_of_movingai_that_are_no_ground_are_walls(tmp_path: Path) -> None:
    path = written(tmp_path, "a.map", MOVINGAI)
    free = shapely.union_all([shapely.box(2 * x, 2 * y, 2 * x + 2, 2 * y + 2) for x, y in ((1, 1), (2, 1), (2, 2))])
    assert shapely.equals(covered(path, 2.0), shapely.difference(shapely.box(0, 0, 8, 6), free))


@pytest.mark.parametrize(("unit", "given"), [(4, None), (None, "mm"), (None, 0.001)])
def test_drawings_in_dxf_have_units_and_arcs(unit: int | None, given: str | float | None, tmp_path: Path) -> None:
    pytest.importorskip("ezdxf", reason="slalom[walls] is not installed")
    path = written(tmp_path, "a.dxf", dxf(unit))
    straight, arc = lines(path, given)
    assert straight == [[0, 0], [4, 0]]
    ring = shapely.Polygon(arc)
    assert ring.area == pytest.approx(np.pi * 0.25, rel=0.02)
    assert np.hypot(*(np.array(arc) - (1, 3)).T) == pytest.approx(np.full(len(arc), 0.5), abs=1e-3)
    assert 0.5 - shapely.Point(1, 3).distance(ring.exterior) <= 0.006
    assert "left out: 1 TEXT" in read_walls(path, given).notes[0]
    assert ("as assumed" in read_walls(path).notes[0]) == (unit is None)


def test_drawings_in_svg_are_turned_on_demand(tmp_path: Path) -> None:
    """Within the view box, or the height: as the same drawing in a format whose y points up."""
    line = '<polyline points="1 2 4 2 4 5"/>'
    for head, height in (('viewBox="0 -1 9 8"', 6.0), ('width="9" height="8"', 8.0)):
        path = written(tmp_path, "a.svg", f'<svg xmlns="http://www.w3.org/2000/svg" {head}>{line}</svg>')
        down, turned = read_walls(path, "cm"), read_walls(path, "cm", up=True)
        points = 0.01 * np.array([(1, height - 2), (4, height - 2), (4, height - 5)])
        np.testing.assert_allclose(turned.obstacles[0].shape.points, points)
        assert ["y points down" in "".join(one.notes) for one in (down, turned)] == [True, False]
    written(tmp_path, "s.yaml", f"walls: a.svg\nwalls_unit: cm\nwalls_up: true\n{ROBOTS}")
    np.testing.assert_allclose(read_scenario(tmp_path / "s.yaml").obstacles[-1].shape.points, points)


def test_drawings_in_svg_are_in_units_of_their_view_box(tmp_path: Path) -> None:
    box, arc = lines(written(tmp_path, "a.svg", SVG), 0.5)
    assert np.allclose(box, [[0.5, 1], [2.5, 1], [2.5, 1.5], [0.5, 1.5], [0.5, 1]])
    away = np.hypot(*(np.array(arc) - (3, 3.5)).T)
    assert away == pytest.approx(np.ones(len(arc)), abs=1e-9)
    assert 1.0 - shapely.Point(3, 3.5).distance(shapely.LineString(arc)) <= 0.0051


SVG_LINES = {
    '<path d="M1 1 l1 0 0 1z m5 0h1v1H6V1"/>': [
        [[1, 1], [2, 1], [2, 2], [1, 1]],
        [[6, 1], [7, 1], [7, 2], [6, 2], [6, 1]],
    ],
    '<path d="M1-1.5.5.5L2 2ZL3 3"/>': [[[1, -1.5], [0.5, 0.5], [2, 2], [1, -1.5]], [[1, -1.5], [3, 3]]],
    '<g transform="translate(1 2) rotate(90) scale(2)"><line x1="1" x2="3" y2="1"/></g>': [[[1, 4], [-1, 8]]],
    '<defs><polygon id="a" points="0,0 1,0 0,1"/></defs><use href="#a" x="2"/>': [[[2, 0], [3, 0], [2, 1], [2, 0]]],
    '<symbol id="a" viewBox="0 0 1 1"><line x2="1"/></symbol><use href="#a" width="4" height="2"/>': [[[1, 0], [3, 0]]],
    '<svg x="1" width="50%" viewBox="1 0 9 9"><polyline points="1 0 10 0"/></svg>': [[[1, 2.25], [5.5, 2.25]]],
    '<style>.a, .b {display: none}</style><line class="c b" x2="1"/><line x2="10%"/>': [[[0, 0], [0.9, 0]]],
    '<g style="fill:red; display:none"><line x2="1"/></g><line display="none" x2="1"/><line x2="1in"/>': [
        [[0, 0], [96, 0]]
    ],
}


@pytest.mark.parametrize("body", SVG_LINES)
def test_elements_of_svg_are_where_they_are_drawn(body: str, tmp_path: Path) -> None:
    found = lines(written(tmp_path, "a.svg", svg(body)), 1.0)
    assert [len(line) for line in found] == [len(line) for line in SVG_LINES[body]]
    assert all(np.allclose(line, wanted) for line, wanted in zip(found, SVG_LINES[body], strict=True))


def bezier(*corners: tuple[float, float]) -> Callable[[np.ndarray], np.ndarray]:
    """A Bezier curve by its definition."""
    n = len(corners) - 1
    return lambda s: sum(np.outer(comb(n, k) * (1 - s) ** (n - k) * s**k, corner) for k, corner in enumerate(corners))


def arc(rx: float, ry: float, angle: float) -> Callable[[np.ndarray], np.ndarray]:
    """An arc of an ellipse from its left end on."""
    return lambda s: np.stack([rx - rx * np.cos(angle * s), -ry * np.sin(angle * s)], axis=1)


CURVES = {
    "C1 2 3 -1 4 0": bezier((0, 0), (1, 2), (3, -1), (4, 0)),
    "Q2 4 4 0": bezier((0, 0), (2, 4), (4, 0)),
    "A2 1 0 0 1 4 0": arc(2, 1, np.pi),
    "a1 .5 0 014 0": arc(2, 1, np.pi),
    "A1 1 0 11 1 1": arc(1, 1, 1.5 * np.pi),
}


@pytest.mark.parametrize(("data", "formula"), CURVES.items())
def test_curves_of_svg_are_within_5_mm_of_their_lines(data: str, formula: Callable, tmp_path: Path) -> None:
    """Also where a transformation shears them."""
    place = 'transform="matrix(1 0 1 2 3 4)"'
    (found,) = lines(written(tmp_path, "a.svg", svg(f'<path {place} d="M0 0{data}"/>')), 1.0)
    exact = formula(np.linspace(0.0, 1.0, 2001)) @ np.array([[1, 0], [1, 2]]) + (3, 4)
    assert np.allclose((found[0], found[-1]), (exact[0], exact[-1]))
    assert shapely.hausdorff_distance(shapely.LineString(found), shapely.LineString(exact)) < 0.0051


@pytest.mark.parametrize(("crs", "unit", "read"), [("", 1.0, True), ("EPSG:25832", None, True), ("", None, False)])
def test_geojson_that_may_be_in_degrees_needs_a_unit(crs: str, unit: float | None, read: bool, tmp_path: Path) -> None:
    path = written(
        tmp_path, "a.geojson", features('{"type": "LineString", "coordinates": [[8.5, 47.3], [8.6, 47.3]]}', crs)
    )
    if read:
        assert lines(path, unit) == [[[8.5, 47.3], [8.6, 47.3]]]
    else:
        with pytest.raises(InvalidFile, match="expected a unit, found positions that are degrees"):
            read_walls(path, unit)


def test_collections_of_collections_are_walls(tmp_path: Path) -> None:
    """Also those of a file that the limits just allow."""
    for depth in (3, 98):
        assert lines(written(tmp_path, "a.wkt", collections(depth))) == [[[0, 0], [1, 1]]]
    assert len(lines(written(tmp_path, "a.dxf", blocks({"A": insert("B0", 10)}, insert("A", 10))))) == 10_000


def test_a_scenario_names_a_file_of_walls(tmp_path: Path) -> None:
    written(tmp_path, "hall.wkt", "MULTILINESTRING ((2500 200, 3500 200), (2500 -100, 3500 -100))")
    path = written(tmp_path, "a.yaml", f"walls: hall.wkt\nwalls_unit: cm\n{ROBOTS}")
    scenario = read_scenario(path)
    assert [np.asarray(wall.shape.points).tolist() for wall in scenario.obstacles] == [
        [[25, 2], [35, 2]],
        [[25, -1], [35, -1]],
    ]
    assert scenario.notes == ("hall.wkt: 2 walls, x 25 to 35 m, y -1 to 2 m",)
    assert [file.name for file in files_of(path)] == ["a.yaml", "hall.wkt"]


@pytest.mark.parametrize(
    ("keys", "mistakes"),
    [
        ("walls: none.wkt", ["none.wkt: expected a readable text file, found no such file"]),
        ("walls: hall.wkt\nwalls_unit: inch", ["a.yaml:2:13: walls_unit: expected a number [m] or one of"]),
        ("walls: hall.wkt\nwalls_up: true", ["a.yaml:2:11: walls_up: expected it with a drawing in SVG"]),
        ("walls: 3", ["3: expected walls in a file that ends in"]),
    ],
)
def test_mistakes_in_walls_are_those_of_the_file(keys: str, mistakes: list[str], tmp_path: Path) -> None:
    written(tmp_path, "hall.wkt", HALL)
    with pytest.raises(InvalidFile) as caught:
        read_scenario(written(tmp_path, "a.yaml", keys + ROBOTS))
    assert [mistake in line for mistake, line in zip(mistakes, caught.value.mistakes, strict=True)] == [True]


def test_pictures_show_walls_where_they_are(tmp_path: Path) -> None:
    from slalom.view.film import Film

    written(tmp_path, "hall.wkt", HALL)
    run = simulate(
        read_scenario(written(tmp_path, "a.yaml", f"walls: hall.wkt\nduration: 2\n{ROBOTS}")), METHODS["nao"]
    )
    (axes,) = Film(run).axes
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    assert 23.0 < left < 25.0
    assert 35.0 < right < 37.0
    assert low < -1.0
    assert high > 2.0
    assert high - low < 8.0
