"""Routes: shortest paths around walls, through the right half of doors; agents of both directions pass there."""

from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from wall_files import written

from slalom import (
    METHODS,
    Capsule,
    Disc,
    Fleet,
    InvalidInput,
    Limits,
    Obstacle,
    PathGoal,
    Polygon,
    Polyline,
    Rectangle,
    Stationary,
    routes,
)
from slalom.sim import metrics, simulate
from slalom.sim.files.scenario_yaml import files_of, read_scenario

MARGIN = 0.05


def wall(*points: tuple[float, float]) -> Obstacle:
    """A thin wall."""
    return Obstacle(Polyline(list(points)), Stationary((0.0, 0.0)))


def door(width: float) -> list[Obstacle]:
    """A wall along x = 0 with a door about y = 0."""
    return [wall((0, -6), (0, -width / 2)), wall((0, width / 2), (0, 6))]


def length(path: np.ndarray) -> float:
    """[m] of a path."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def test_a_path_bends_around_the_corners_of_a_wall() -> None:
    (path,) = routes([(0, 0)], [(8, 1)], 0.3, [wall((4, -3), (4, 3))])
    assert (path[0].tolist(), path[-1].tolist()) == ([0, 0], [8, 1])
    assert shapely.distance(shapely.LineString([(4, -3), (4, 3)]), shapely.LineString(path)) >= 0.35 - 1e-6
    (straight,) = routes([(0, 0)], [(8, 1)], 0.3, [wall((4, 2), (4, 3))])
    assert straight.tolist() == [[0, 0], [8, 1]]


ROUND = {
    "disc": (Disc(1.0), 1.0),
    "end of a capsule": (Capsule((0.0, 0.0), (0.0, -20.0), 0.4), 0.4),
    "end of a line": (Polyline([(0.0, 0.0), (0.0, -20.0)]), 0.0),
    "rounded corner": (Polygon([(0.0, 0.0), (-9.0, -20.0), (9.0, -20.0)], 0.7), 0.7),
}


@pytest.mark.parametrize("name", ROUND)
@pytest.mark.parametrize("size", [0.05, 0.3, 2.0])
def test_paths_around_round_walls_are_those_around_arcs(name: str, size: float) -> None:
    """The path is two tangents and an arc; corners stand out of the arc by at most 1 % of the radius and the margin."""
    shape, radius = ROUND[name]
    (path,) = routes([(-6, 0)], [(6, 0)], size, [Obstacle(shape, Stationary((0, 0)))], margin=MARGIN)

    def exact(by: float) -> float:
        return 2.0 * float(np.sqrt(36.0 - by**2)) + by * (np.pi - 2.0 * float(np.arccos(by / 6.0)))

    most = radius + size + MARGIN
    assert exact(most) - 1e-5 <= length(path) <= exact(most + 0.01 * (size + MARGIN)) + 1e-5


@pytest.mark.parametrize("turn", [0.0, 0.3, np.pi / 4])
@pytest.mark.parametrize(("gap", "fits"), [(0.62, True), (1.5, True), (0.59, False)])
def test_gaps_between_round_walls_are_as_wide_as_they_are(turn: float, gap: float, fits: bool) -> None:
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    places = [k * (2.0 + gap) * along for k in range(-2, 3)]
    walls = [Obstacle(Disc(1.0), Stationary(place)) for place in places]
    ends = [sign * (2.0 * (2.0 + gap) * along + 0.5 * across) for sign in (-1, 1)]
    room = shapely.MultiPoint([end + sign * 6 * across for end in ends for sign in (-1, 1)]).convex_hull
    walls.append(wall(*room.exterior.coords))
    go = lambda: routes([3 * across], [-3 * across], 0.25, walls, margin=MARGIN)  # noqa: E731
    if fits:
        solid = shapely.union_all([shapely.Point(place).buffer(1.0) for place in places])
        assert shapely.distance(solid, shapely.LineString(go()[0])) >= 0.25 - 1e-6
    else:
        with pytest.raises(InvalidInput, match=r"goals\[0\]: expected a place that a path leads to"):
            go()


@pytest.mark.parametrize("gap", [0.25 - 1e-9, 0.25, 0.27, 0.1])
def test_starts_and_goals_beside_walls_have_paths_that_leave_them_at_once(gap: float) -> None:
    for shape in (Rectangle(2.0, 2.0), Disc(1.0)):
        solid = shapely.box(-1, -1, 1, 1) if isinstance(shape, Rectangle) else shapely.Point(0, 0).buffer(1.0, 99)
        (path,) = routes([(1 + gap, 0)], [(-1 - gap, 0)], 0.25, [Obstacle(shape, Stationary((0, 0)))])
        near = shapely.intersection(shapely.LineString(path), shapely.buffer(solid, 0.25 - 1e-3)).length
        assert near <= 2.0 * max(0.25 - gap, 0.0) + 1e-3


BOXES = st.lists(
    st.tuples(st.integers(2, 8), st.integers(2, 8), st.integers(1, 3), st.integers(1, 3)), min_size=1, max_size=4
)


@settings(max_examples=15, deadline=None)
@given(boxes=BOXES)
def test_paths_are_as_short_as_those_of_a_grid_and_clear_of_walls(boxes: list[tuple[int, int, int, int]]) -> None:
    """No path of a fine grid outside the walls is shorter; boxes keep 5 m apart, so that there are no doors."""
    some = [Obstacle(Rectangle(w, h), Stationary((4.0 * x, 4.0 * y))) for x, y, w, h in boxes]
    area = shapely.union_all(
        [shapely.box(4 * x - w / 2, 4 * y - h / 2, 4 * x + w / 2, 4 * y + h / 2) for x, y, w, h in boxes]
    )
    start, goal, radius = (2.0, 2.0), (38.0, 37.0), 0.1
    (path,) = routes([start], [goal], radius, some, margin=MARGIN)
    assert (path[0].tolist(), path[-1].tolist()) == (list(start), list(goal))
    assert shapely.distance(shapely.LineString(path), area) >= radius + MARGIN - 1e-5
    side = 0.5
    cells = np.stack(np.meshgrid(np.arange(81), np.arange(81), indexing="ij"), axis=-1).reshape(-1, 2)
    near = [(1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2)]
    grown = shapely.buffer(area, radius + MARGIN, join_style="mitre")
    shapely.prepare(grown)
    edges = np.concatenate([np.stack([cells, cells + move], axis=1) for move in near])
    edges = edges[((edges >= 0) & (edges <= 80)).all(axis=(1, 2))]
    edges = edges[~shapely.intersects(grown, shapely.linestrings(edges * side))]
    numbers = edges @ (81, 1)
    weights = side * np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    graph = csr_array((weights, numbers.T), shape=(81 * 81, 81 * 81))
    first, last = (np.array([start, goal]) / side).round().astype(int) @ (81, 1)
    shortest = float(dijkstra(graph, directed=False, indices=first)[last])
    assert length(path) <= shortest + 1e-9
    assert length(path) >= np.hypot(36, 35) - 1e-9


@pytest.mark.parametrize(("width", "aside"), [(1.4, 0.35), (0.9, 0.15), (0.62, 0.01)])
def test_paths_of_both_directions_cross_a_door_in_their_right_halves(width: float, aside: float) -> None:
    there, back = routes([(-3, 2), (3, -2)], [(3, 2), (-3, -2)], 0.25, door(width))
    for path, right in ((there, -1.0), (back, 1.0)):
        crossing = shapely.intersection(shapely.LineString(path), shapely.LineString([(0, -6), (0, 6)]))
        assert (crossing.x, crossing.y) == pytest.approx((0.0, right * aside))
        assert np.abs(path[1:-1, 0]) == pytest.approx([0.5, 0.5])
    (wide,) = routes([(-3, 0)], [(3, 0)], 0.25, door(2.5))
    assert wide.tolist() == [[-3, 0], [3, 0]]


def test_a_small_agent_takes_the_door_that_is_too_narrow_for_the_largest() -> None:
    walls = [wall((0, -4), (0, -0.3)), wall((0, 0.3), (0, 4)), wall((-9, -4), (9, -4), (9, 4), (-9, 4), (-9, -4))]
    small, large = routes([(-3, 0), (-3, 6)], [(3, 0), (3, 6)], [0.2, 0.4], walls)
    assert shapely.intersects(shapely.LineString(small), shapely.LineString([(0, -0.3), (0, 0.3)]))
    assert large.tolist() == [[-3, 6], [3, 6]]
    with pytest.raises(InvalidInput, match=r"goals\[0\]: expected a place that a path leads to, found \[3\. 0\.\]"):
        routes([(-3, 0)], [(3, 0)], 0.4, walls)


def test_agents_near_walls_are_led_off_them() -> None:
    (path,) = routes([(-0.1, -3)], [(0.1, -3)], 0.25, door(1.4))
    assert path[[0, -1]].tolist() == [[-0.1, -3], [0.1, -3]]
    assert path[1] == pytest.approx((-0.3, -3))
    assert path[-2] == pytest.approx((0.3, -3))
    assert length(path) > 5.0


@pytest.mark.parametrize(("count", "limit"), [(1, 12.0), (5, 40.0)])
def test_agents_of_both_directions_pass_a_door(count: int, limit: float) -> None:
    """Radii up to 0.28 m at a door of 1.3 m, in which two of them have space for three margins."""
    rng = np.random.default_rng(7)
    left = np.stack([-2.0 - 0.8 * np.arange(count), rng.uniform(-1, 1, count)], axis=1)
    starts, goals = np.concatenate([left, -left]), np.concatenate([-left, left])
    radii = rng.uniform(0.2, 0.28, 2 * count)
    paths = [PathGoal(path, tolerance=0.3) for path in routes(starts, goals, radii, door(1.3))]
    discs = [Disc(float(r)) for r in radii]
    fleet = Fleet(METHODS["nao_shared"], discs, Limits(1.2, 2.0), obstacles=door(1.3), period=0.1)
    positions, velocities, arrived = starts, np.zeros_like(starts), np.zeros(2 * count, bool)
    for step in range(int(limit / 0.1)):
        found = fleet.step(0.1 * step, positions, velocities, paths=paths)
        positions, velocities = found.positions, found.velocities
        apart = np.linalg.norm(positions[:, None] - positions, axis=2) - radii[:, None] - radii
        assert apart[np.triu_indices(2 * count, 1)].min() > 0.0
        arrived |= np.linalg.norm(positions - goals, axis=1) < 0.3
        if arrived.all():
            break
    assert arrived.all()


HALL = "walls: hall.wkt\nduration: 30\n"
TABLE = "- {table: people.csv, max_acceleration: 2, goal: {route: true, stop: true, tolerance: 0.3}}\n"


def test_a_file_names_a_table_of_agents_and_leads_them_by_routes(tmp_path: Path) -> None:
    written(tmp_path, "hall.wkt", "MULTILINESTRING ((0 -6, 0 -0.7), (0 0.7, 0 6))")
    written(tmp_path, "people.csv", "name,x,y,goal_x,goal_y,radius,max_speed\na,-3,2,3,2,0.2,1.2\nb,3,-2,-3,-2,0.3,1\n")
    own = "- {position: [0, 9], goal: {position: [0, 8]}, radius: 0.3, max_speed: 1, max_acceleration: 1}\n"
    path = written(tmp_path, "a.yaml", f"{HALL}robots:\n{TABLE}{own}")
    scenario = read_scenario(path)
    assert [robot.name for robot in scenario.robots] == ["a", "b", "robot 2"]
    assert [robot.limits.max_speed for robot in scenario.robots] == [1.2, 1.0, 1.0]
    assert [robot.shape.bounding_radius for robot in scenario.robots] == [0.2, 0.3, 0.3]
    wanted = routes([(-3, 2), (3, -2)], [(3, 2), (-3, -2)], [0.2, 0.3], door(1.4))
    for robot, points in zip(scenario.robots, wanted):
        assert isinstance(robot.goal, PathGoal)
        assert robot.goal.points.tolist() == points.tolist()
        assert (robot.goal.tolerance, robot.goal.stop) == (0.3, True)
    assert not isinstance(scenario.robots[2].goal, PathGoal)
    assert [file.name for file in files_of(path)] == ["a.yaml", "hall.wkt", "people.csv"]
    found = metrics.summary(simulate(scenario, METHODS["nao_shared"]))
    assert (found["arrived"], found["collisions"]) == (3, 0)
