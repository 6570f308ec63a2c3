"""Walls of files: the coordinates of the file times the unit, in scenarios, on the command line and in pictures."""

from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st
from recording_formats import RECORDED
from wall_files import MOVINGAI, SVG, dxf, written

from slalom import METHODS, InvalidFile, Polyline, Stationary, read_walls
from slalom.base.errors import MissingExtra
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


def test_drawings_in_svg_are_in_units_of_their_view_box(tmp_path: Path) -> None:
    pytest.importorskip("svgelements", reason="slalom[walls] is not installed")
    box, arc = lines(written(tmp_path, "a.svg", SVG), 0.5)
    assert np.allclose(box, [[0.5, 1], [2.5, 1], [2.5, 1.5], [0.5, 1.5], [0.5, 1]])
    away = np.hypot(*(np.array(arc) - (3, 3.5)).T)
    assert away == pytest.approx(np.ones(len(arc)), abs=1e-9)
    assert 1.0 - shapely.Point(3, 3.5).distance(shapely.LineString(arc)) <= 0.0051


def test_drawings_name_the_extra_that_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, module, content in (("a.dxf", "ezdxf", dxf()), ("a.svg", "svgelements", SVG)):
        monkeypatch.setitem(__import__("sys").modules, module, None)
        with pytest.raises(MissingExtra, match=r"read_walls: .*slalom\[walls\]"):
            read_walls(written(tmp_path, name, content), 1.0)


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
        ("walls: 3", ["3: expected walls in a file that ends in"]),
    ],
)
def test_mistakes_in_walls_are_those_of_the_file(keys: str, mistakes: list[str], tmp_path: Path) -> None:
    written(tmp_path, "hall.wkt", HALL)
    with pytest.raises(InvalidFile) as caught:
        read_scenario(written(tmp_path, "a.yaml", keys + ROBOTS))
    assert [mistake in line for mistake, line in zip(mistakes, caught.value.mistakes, strict=True)] == [True]


def test_walls_in_space_are_refused(tmp_path: Path) -> None:
    written(tmp_path, "hall.wkt", HALL)
    robot = "robot: {radius: 0.3, max_speed: 1, max_acceleration: 1, position: [0, 0, 0], goal: {position: [9, 0, 0]}}"
    with pytest.raises(InvalidFile, match=r"a\.yaml:1:8: walls: expected none in space"):
        read_scenario(written(tmp_path, "a.yaml", f"walls: hall.wkt\n{robot}"))


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
