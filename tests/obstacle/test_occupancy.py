"""Obstacles of occupancy grids: they cover exactly the occupied cells, also after updates in parts."""

import pickle

import numpy as np
import pytest
import shapely
from draws import examples
from hypothesis import given, strategies as st
from nav2_maps import map_file
from PIL import Image

from slalom import (
    Disc,
    Goal,
    Limits,
    Navigator,
    Obstacle,
    ObstacleTable,
    Polygon,
    Rectangle,
    State,
    Stationary,
    method,
    occupancy,
    read_map,
)
from slalom.obstacle.pieces import outline_parts

ROBOTS = {
    "disc": Disc(0.3),
    "rectangle": Rectangle(0.5, 0.3),
    "triangle": Polygon([(0.3, 0.0), (-0.2, 0.2), (-0.2, -0.2)]),
}


def drawn(seed: int, height: int, width: int, share: float) -> np.ndarray:
    """A grid of values from -1 to 100, of which about a share is occupied."""
    rng = np.random.default_rng(seed)
    cells = rng.integers(0, 65, (height, width))
    cells[rng.random(cells.shape) < share] = rng.integers(65, 101)
    cells[rng.random(cells.shape) < 0.1] = -1
    return cells


GRIDS = {
    "seed": st.integers(0, 10**6),
    "height": st.integers(0, 20),
    "width": st.integers(0, 20),
    "share": st.sampled_from((0.0, 0.1, 0.5, 0.9, 1.0)),
    "unknown": st.booleans(),
}


@examples(60)
@given(**GRIDS, heading=st.sampled_from((0.0, 0.7, -2.0)))
def test_obstacles_cover_exactly_the_occupied_cells(seed, height, width, share, unknown, heading) -> None:
    """Points of each cell, and the area: no obstacle overlaps another, or a free cell."""
    values, resolution, origin = drawn(seed, height, width, share), 0.25, np.array((3.0, -1.0))
    found = occupancy(values, resolution, (*origin, heading), unknown=unknown)
    covered = [shapely.Polygon(outline_parts(one, 0.0)[0].corners) for one in found]
    c, s = np.cos(heading), np.sin(heading)
    axes = np.array([[c, -s], [s, c]])
    expected = 0
    for (row, column), value in np.ndenumerate(values):
        occupied = value >= 65 or (unknown and value == -1)
        expected += occupied
        for within in ((0.5, 0.5), (0.01, 0.01), (0.99, 0.01), (0.01, 0.99), (0.99, 0.99)):
            x, y = origin + axes @ (resolution * (np.array((column, row)) + within))
            assert any(area.contains(shapely.Point(x, y)) for area in covered) == occupied
    assert sum(area.area for area in covered) == pytest.approx(expected * resolution**2)
    assert found.cells.sum() == expected


@examples(40)
@given(**GRIDS, parts=st.lists(st.tuples(*[st.integers(0, 20)] * 4), min_size=1, max_size=4))
def test_updates_in_parts_are_those_from_scratch(seed, height, width, share, unknown, parts) -> None:
    """The obstacles, in their order, and the former table is what it was."""
    values = drawn(seed, height, width, share)
    first = table = occupancy(values, 0.1, unknown=unknown)
    before = first.rectangles.copy()
    now = values.copy()
    for k, (row, column, h, w) in enumerate(parts):
        row, column = min(row, height), min(column, width)
        part = drawn(seed + k + 1, min(h, height - row), min(w, width - column), share)
        now[row : row + len(part), column : column + part.shape[1]] = part
        table = table.updated(part, row, column)
    anew = occupancy(now, 0.1, unknown=unknown)
    assert np.array_equal(table.rectangles, anew.rectangles)
    assert np.array_equal(first.rectangles, before)
    assert np.array_equal(table.cells, anew.cells)


def test_rectangles_are_few() -> None:
    """Walls along the axes are one each, in both directions."""
    cells = np.zeros((60, 80), np.bool_)
    cells[5:8, 4:70] = cells[20:50, 10:12] = cells[30:40, 30:45] = True
    assert len(occupancy(cells, 0.05)) == 3


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("heading", [0.0, 0.6])
def test_the_bodies_are_those_of_a_table_of_rectangles(robot: str, heading: float) -> None:
    """To the bit; the outlines up to rounding."""
    table = occupancy(drawn(3, 15, 18, 0.3), 0.2, (1.0, 2.0, heading))
    plain = ObstacleTable([Obstacle(o.shape, Stationary(o.trajectory.position(0.0)), heading=heading) for o in table])
    found, expected = (one.stretch(ROBOTS[robot], 3.0, 2.0) for one in (table, plain))
    assert pickle.dumps(found) == pickle.dumps(expected)
    for name in found.pieces._fields:
        assert np.array_equal(getattr(found.pieces, name), getattr(expected.pieces, name))
    corners = [one.outlines.at_horizon.corners for one in (table, plain)]
    np.testing.assert_allclose(*corners, atol=1e-12)
    for name in table.outlines.at_horizon.each.dtype.names:
        values = [one.outlines.at_horizon.each[name] for one in (table, plain)]
        np.testing.assert_allclose(*values, atol=1e-12)


def test_a_robot_drives_around_the_cells() -> None:
    """The decisions are those among plain rectangles; the table goes through a pickle."""
    cells = np.zeros((40, 60), np.int8)
    cells[10:32, 20:23] = 100
    table = pickle.loads(pickle.dumps(occupancy(cells, 0.1)))
    robot, goal = Navigator(method("nao"), Disc(0.3), Limits(1.0, 1.5)), Goal(Stationary((5.5, 2.0)), 0.2, stop=True)
    for obstacles in (table, list(table)):
        state, decision, least = State((0.5, 1.0), (0.0, 0.0)), None, np.inf
        for k in range(100):
            decision = robot.decide(state, obstacles, goal, now=0.1 * k, previous=decision)
            assert decision.safe
            state = decision.manoeuvre.advance(0.1 * (k + 1) - decision.manoeuvre.start)
            nearest = np.clip(state.position, (2.0, 1.0), (2.3, 3.2))
            least = min(least, float(np.linalg.norm(state.position - nearest)))
        assert least > 0.3
        assert np.linalg.norm(state.position - (5.5, 2.0)) < 0.3
    assert table.at((1.0, 0.0, 0.0)).given[0].trajectory.position(0.0)[0] == pytest.approx(3.15)
    assert repr(table) == "<OccupancyTable of 60 x 40 cells, obstacles: 1>"


def test_a_table_without_cells_is_empty() -> None:
    robot = Navigator(method("nao"), Disc(0.3), Limits(1.0, 1.5))
    empty = occupancy(np.zeros((5, 5), np.int8), 0.1)
    assert len(empty) == 0
    assert robot.decide(State((0.0, 0.0), (0.5, 0.0)), empty, Goal(Stationary((5.0, 0.0)))).safe


def read_by_pixels(pixels: np.ndarray, mode: str, negate: bool, occupied: float, free: float) -> np.ndarray:
    """The values of the cells as nav2_map_server documents them, pixel by pixel, with the last row first."""
    height, width, channels = pixels.shape
    found = np.zeros((height, width), np.int64)
    for y in range(height):
        for x in range(width):
            pixel = pixels[y, x].tolist()
            opaque = channels not in (2, 4) or pixel[-1] == 255
            colours = pixel if mode == "trinary" or channels in (1, 3) else pixel[:-1]
            if channels == 2:
                colours = [pixel[0]] * 3 + pixel[1:] * (mode == "trinary")
            shade = sum(colours) / (255 * len(colours))
            share = shade if negate else 1.0 - shade
            if mode == "raw":
                value = round(shade * 255)
                value = value if value <= 100 else -1
            elif mode == "scale" and not opaque:
                value = -1
            elif share > occupied:
                value = 100
            elif share < free:
                value = 0
            else:
                value = -1 if mode == "trinary" else int(np.rint((share - free) / (occupied - free) * 100.0))
            found[height - 1 - y, x] = value
    return found


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
@pytest.mark.parametrize("negate", [False, True])
@pytest.mark.parametrize(("kind", "channels"), [("pgm", 1), ("png", 1), ("png", 2), ("png", 3), ("png", 4)])
def test_maps_are_read_as_documented(tmp_path, mode: str, negate: bool, kind: str, channels: int) -> None:
    pixels = np.random.default_rng(channels).integers(0, 256, (9, 7, channels)).astype(np.uint8)
    if channels in (2, 4):
        pixels[::2, :, -1] = 255
    path = map_file(tmp_path, image=f"other.{kind}", mode=mode, negate=str(negate).lower())
    Image.fromarray(pixels[..., 0] if channels == 1 else pixels).save(tmp_path / f"other.{kind}")
    values = read_by_pixels(pixels, mode, negate, 0.65, 0.25)
    for unknown in (False, True):
        for occupied in (30, 65):
            found = read_map(path, occupied=occupied, unknown=unknown)
            expected = occupancy(values, 0.05, (-1.0, 2.0, 0.0), occupied=occupied, unknown=unknown)
            assert np.array_equal(found.rectangles, expected.rectangles)
            assert (found.resolution, found.origin) == (0.05, (-1.0, 2.0, 0.0))


def test_a_map_of_16_bits(tmp_path) -> None:
    path = map_file(tmp_path, image="deep.png")
    Image.fromarray(np.array([[0, 65535], [65535, 30000]], np.uint16)).save(tmp_path / "deep.png")
    assert read_map(path).cells.tolist() == [[False, False], [True, False]]


def test_the_sample_of_the_documentation(tmp_path) -> None:
    """The lower left pixel is the cell at the origin, and other keys are not used."""
    path = map_file(tmp_path, [[255, 255, 255], [0, 205, 255]], free_thresh="0.196", frame_id="map")
    found = read_map(str(path))
    assert found.rectangles.tolist() == [[0, 0, 1, 1]]
    np.testing.assert_allclose(found.given[0].trajectory.position(0.0), (-0.975, 2.025))
    assert read_map(path, unknown=True).rectangles.tolist() == [[0, 0, 2, 1]]
