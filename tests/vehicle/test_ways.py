"""Ways among obstacles: parking and docking against a dense oracle, certified motions, and cases without a way."""

import importlib.util
import sys
from math import ceil, cos, hypot, pi, sin
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import shapely
from draws import draws, examples
from hypothesis import given, strategies as st

from slalom import Capsule, Disc, Polygon, Rectangle, Union
from slalom.vehicle.curves import Arc, along, ends, length_of, reeds_shepp
from slalom.vehicle.search import Field
from slalom.vehicle.sweep import RESOLUTION, ROUNDED, Scene, convex_bodies, outline
from slalom.vehicle.ways import Outcome, way_among

STEP = 2e-3
BODY = Rectangle(0.8, 0.5)


def program() -> ModuleType:
    """The benchmark that draws cases, as a module."""
    folder = Path(__file__).parents[2] / "benchmarks"
    spec = importlib.util.spec_from_file_location("parking", folder / "parking.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(folder))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(folder))
    return module


PARKING = program()


def least_distance(body, center: float, start, way, obstacles) -> float:
    """Least distance [m] to obstacles, of corners that are moved by plain trigonometry in steps of STEP."""
    (part,) = body.parts
    reach = max(hypot(x + center, y) for x, y in part.corners) + part.radius
    poses, (x, y, heading) = [start], start
    for length, turn in way:
        n = max(1, ceil((abs(length) + reach * abs(turn)) / STEP))
        for _ in range(n):
            # The chord of the arc.
            chord = length / n if turn == 0.0 else 2.0 * sin(0.5 * turn / n) * length / turn
            x, y = x + chord * cos(heading + 0.5 * turn / n), y + chord * sin(heading + 0.5 * turn / n)
            heading += turn / n
            poses.append((x, y, heading))
    at = np.array(poses)
    corners = part.corners + np.array([center, 0.0])
    c, s = np.cos(at[:, 2, None]), np.sin(at[:, 2, None])
    moved = np.stack(
        [at[:, :1] + c * corners[:, 0] - s * corners[:, 1], at[:, 1:2] + s * corners[:, 0] + c * corners[:, 1]], 2
    )
    bodies = shapely.convex_hull(shapely.multipoints(moved)) if len(corners) < 3 else shapely.polygons(moved)
    near = shapely.STRtree(obstacles).query_nearest(bodies, return_distance=True, all_matches=False)[1]
    return float(near.min()) - part.radius


@pytest.mark.parametrize("seed", draws(range(500, 505)))
@pytest.mark.parametrize("kind", PARKING.KINDS)
def test_vehicles_park_and_dock_without_contact(kind: str, seed: int) -> None:
    """At 2 mm steps. Only some carts, which cannot reverse, have no way."""
    case = PARKING.drawn(kind, seed)
    found = case.found()
    if found.way is None:
        assert kind == "cart"
        assert found.outcome in (Outcome.EXHAUSTED, Outcome.UNKNOWN)
        return
    assert (found.outcome, found.goal) == (Outcome.FOUND, 0)
    assert found == case.found()
    start = case.start
    center = case.options.get("center", 0.0)
    last = ends(start, found.way)[-1]
    assert hypot(*(last - case.goal)[:2]) < 1e-9
    assert abs(np.exp(1j * last[2]) - np.exp(1j * case.goal[2])) < 1e-9
    clearance = least_distance(case.body, center, start, found.way, case.obstacles)
    assert clearance > 0.0
    assert not found.kept or clearance > 0.9 * case.options["clearance"]
    assert found.cost >= length_of(found.way) - 1e-9
    radius = case.options.get("radius", 0.0)
    assert all(arc.length == 0.0 or abs(arc.length) >= radius * abs(arc.turn) - 1e-9 for arc in found.way)
    if not case.options.get("reverse", True):
        assert all(arc.length > 0.0 for arc in found.way)
    if case.options.get("turns_on_spot", False):
        assert all(arc.length == 0.0 or arc.turn == 0.0 for arc in found.way)


@pytest.mark.parametrize("gap", [5.5, 5.3])
def test_a_car_of_4_5_m_parks_in_a_short_gap(gap: float) -> None:
    """By several reversals."""
    case = PARKING.parallel(np.random.default_rng(2), (gap, gap))
    found = case.found()
    assert found.way is not None
    assert least_distance(case.body, PARKING.CAR_CENTER, case.start, found.way, case.obstacles) > 0.0


def test_ways_through_doors_are_found() -> None:
    """Three rooms with doors at opposite ends; a drive, a car, and a cart that cannot reverse."""
    walls = [shapely.box(-0.2, -0.2, 10.0, 0.0), shapely.box(-0.2, 6.0, 10.0, 6.2)]
    walls += [shapely.box(x, 0.0, x + 0.1, 4.8) if x < 4.0 else shapely.box(x, 1.2, x + 0.1, 6.0) for x in (3.3, 6.6)]
    for options in ({"turns_on_spot": True}, {"radius": 0.8}, {"radius": 0.8, "reverse": False}):
        start = (0.8, 0.8, 0.0)
        found = way_among(start, (9.0, 5.0, 0.5 * pi), BODY, walls, clearance=0.1, **options)
        assert found.way is not None
        assert least_distance(BODY, 0.0, start, found.way, walls) > 0.0


# Goals and outcomes.


def test_without_obstacles_the_way_is_the_cheapest_direct_one() -> None:
    rng = np.random.default_rng(4)
    for _ in range(10):
        start, goal = np.column_stack([rng.uniform(-4.0, 4.0, (2, 2)), rng.uniform(-pi, pi, 2)])
        found = way_among(start, goal, BODY, [], 1.0)
        assert found.way is not None
        assert found.searched == 0
        assert found.cost <= length_of(reeds_shepp(start, goal, 1.0)[0]) + 3.0 * 0.5 * hypot(0.4, 0.25) + 1e-9


def test_a_goal_is_one_of_several_poses_or_a_place() -> None:
    wall = shapely.box(2.0, -3.0, 2.2, 3.0)
    start = (0.0, 0.0, 0.0)
    poses = [(2.1, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, -9.0, 0.0)]
    found = way_among(start, poses, BODY, [wall], 0.6)
    assert found.way is not None
    assert found.goal == 2
    assert ends(start, found.way)[-1] == pytest.approx(poses[2], abs=1e-9)
    for options in ({"radius": 0.6}, {"radius": 0.6, "reverse": False}, {"turns_on_spot": True}):
        for place in ((4.0, 0.5), (1.0, 0.2), (-2.0, 0.0), (0.0, 0.0)):
            found = way_among(start, place, BODY, [wall], **options)
            assert found.way is not None
            assert found.goal is None
            assert ends(start, found.way)[-1][:2] == pytest.approx(place, abs=1e-9)
            assert not found.way or least_distance(BODY, 0.0, start, found.way, [wall]) > 0.0


def test_where_there_is_no_way_the_outcome_says_why() -> None:
    """A gap shorter than the body, a start in an obstacle, inside a large one, a closed room, a cart at a wall."""
    short = PARKING.parallel(np.random.default_rng(2), (4.4, 4.4)).found()
    assert (short.outcome, short.obstacle, short.way) == (Outcome.OVERLAP_AT_GOAL, 0, None)
    rocks = [shapely.Point(9.0, 9.0), shapely.box(-5.0, -5.0, 5.0, 5.0)]
    inside = way_among((0.0, 0.0, 0.0), (8.0, 0.0, 0.0), BODY, rocks, 1.0)
    assert (inside.outcome, inside.obstacle) == (Outcome.OVERLAP_AT_START, 1)
    assert "Obstacle 1." in str(inside)
    room = shapely.box(-0.42, -0.27, 0.42, 0.27).exterior
    closed = way_among((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), BODY, [room], 1.0)
    assert closed.outcome is Outcome.EXHAUSTED
    ahead = [shapely.box(0.45, -3.0, 0.6, 3.0)]
    stays = way_among((0.0, 0.0, 0.0), (-3.0, 1.0, 0.0), BODY, ahead, 1.0, reverse=False)
    assert stays.outcome is Outcome.EXHAUSTED
    assert way_among((0.0, 0.0, 0.0), (-3.0, 1.0, 0.0), BODY, ahead, 1.0).way is not None
    few = PARKING.parallel(np.random.default_rng(2), (5.5, 5.5)).found(most_poses=20)
    assert few.outcome is Outcome.UNKNOWN
    assert few.cost == np.inf


BODIES = {
    "rectangle": Rectangle(0.9, 0.5),
    "rounded": Rectangle(0.7, 0.3, 0.1),
    "disc": Disc(0.35),
    "capsule": Capsule((-0.3, 0.0), (0.4, 0.1), 0.2),
    "triangle": Polygon([(-0.4, -0.3), (0.6, 0.0), (-0.4, 0.3)]),
}


def obstacles_of(rng) -> list:
    """A disc, a box, a wall and a point near the origin."""
    places = rng.uniform(-1.5, 1.5, (4, 2))
    box = Rectangle(*rng.uniform(0.1, 0.6, 2))
    shapes = [outline(Disc(0.2), places[0]), outline(box, places[1], rng.uniform(-pi, pi))]
    return [*shapes, shapely.LineString([places[2], places[2] + rng.normal(size=2)]), shapely.Point(places[3])]


@pytest.mark.parametrize("name", BODIES)
def test_motions_that_are_clear_keep_their_distance(name: str) -> None:
    """Clear ones keep the clearance at all times; those that keep more than the bounds of the tests are clear."""
    rng = np.random.default_rng(len(name))
    body, counts = BODIES[name], [0, 0]
    for clearance in (0.0, 0.2):
        for _ in range(60):
            obstacles, center = obstacles_of(rng), rng.uniform(-0.4, 0.4)
            scene = Scene(convex_bodies(body, center), obstacles)
            pose = np.array([*rng.uniform(-1.5, 1.5, 2), rng.uniform(-pi, pi)])
            arc = Arc(rng.uniform(-1.0, 1.0) * rng.integers(2), rng.uniform(-2.0, 2.0))
            if scene.overlapped(pose) is not None:
                continue
            clear = scene.clear(pose[None], np.array([arc.length]), np.array([arc.turn]), clearance)[0]
            least = least_distance(body, center, tuple(pose.tolist()), [arc], obstacles)
            if clear:
                assert least >= clearance - 1e-12
            else:
                # Grown corners, and rounded bodies, are polygons with normals of up to 45 and 15 degrees between them.
                rounding = body.parts[0].radius
                assert least <= (clearance + RESOLUTION) / cos(pi / 8) + rounding * (1.0 / cos(pi / 8) - 1.0) + STEP
            counts[int(clear)] += 1
    assert min(counts) > 10


def test_chains_end_at_their_first_arc_that_is_not_clear() -> None:
    scene = Scene(convex_bodies(Disc(0.2)), [shapely.box(2.0, -1.0, 2.1, 1.0)])
    poses = np.column_stack([np.tile(np.arange(4.0), 2), np.repeat([0.0, 5.0], 4), np.zeros(8)])
    chain, place = np.repeat([0, 1], 4), np.tile(np.arange(4), 2)
    until = scene.until(poses, np.ones(8), np.zeros(8), chain, place)
    assert until.tolist() == [1, 8]


@examples(40)
@given(st.sampled_from(sorted(BODIES)), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-pi, pi))
def test_outlines_contain_their_shapes_and_little_more(name, x, y, heading) -> None:
    """Against points of the shape that are rounded by shapely."""
    shape = BODIES[name]
    (part,) = shape.parts
    c, s = cos(heading), sin(heading)
    corners = part.corners @ np.array([[c, s], [-s, c]]) + (x, y)
    inner = shapely.convex_hull(shapely.multipoints(corners)).buffer(part.radius, quad_segs=64)
    found = outline(shape, (x, y), heading)
    assert found.buffer(1e-9).contains(inner)
    assert found.hausdorff_distance(inner) <= ROUNDED + 1e-3


def test_bodies_of_several_parts_are_tested_in_all() -> None:
    """A hook passes a column between its parts that a hull would touch."""
    hook = Union(
        (Polygon([(0.0, 0.4), (1.0, 0.4), (1.0, 0.6), (0.0, 0.6)]), Polygon([(0, -0.6), (1, -0.6), (1, -0.4)]))
    )
    column = [outline(Disc(0.2), (2.0, 0.0))]
    poses, length, turn = np.zeros((1, 3)), np.array([1.5]), np.array([0.0])
    assert Scene(convex_bodies(hook), column).clear(poses, length, turn)[0]
    assert not Scene(convex_bodies(hook), column).clear(poses, length, np.array([0.4]))[0]
    assert not Scene(convex_bodies(Rectangle(2.0, 1.2)), column).clear(poses, length, turn)[0]


def test_estimates_on_the_grid_are_lengths_around_obstacles() -> None:
    """In the open those of moves to 8 neighbours; behind a wall the way around it."""
    roots, others = np.zeros((1, 3)), np.array([[4.0, 0.0, 0.0]])
    rng = np.random.default_rng(1)
    poses = np.column_stack([rng.uniform(-3.0, 6.0, (200, 2)), np.zeros(200)])
    free = Field(Scene(convex_bodies(Disc(0.3)), []), roots, others)
    distance = np.hypot(*poses[:, :2].T)
    assert np.all(np.abs(free(poses) - distance) <= 0.09 * distance + 2.0 * free.width)
    wall = shapely.box(2.0, -3.0, 2.1, 3.0)
    behind = Field(Scene(convex_bodies(Disc(0.3)), [wall]), roots, others)
    around = 2.0 * hypot(2.05, 3.3)
    assert behind(others)[0] == pytest.approx(around, rel=0.12)
    assert np.all(behind(poses) >= free(poses) - 1e-9)
    assert along((0.0, 0.0, 0.0), (), 1.0) == pytest.approx(0.0)
