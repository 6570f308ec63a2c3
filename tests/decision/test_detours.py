"""Ways around: the lengths that costs count, and robots that get around and past what is exactly in the way."""

import numpy as np
import pytest
import shapely
from draws import draws

from slalom import (
    Ball,
    ConstantVelocity,
    Disc,
    Fleet,
    Goal,
    Limits,
    Navigator,
    Obstacle,
    Polyline,
    Rectangle,
    Shape,
    State,
    Stationary,
    method,
)
from slalom.kernels.decision.detours import length_around
from slalom.obstacle.window import ObstacleWindow

LIMITS = Limits(1.5, 2.0)
SHAPES = [Disc(1.0), Disc(3.0), Rectangle(2.0, 2.0), Rectangle(3.0, 6.0), Polyline([(0, -3), (0, 3)])]


def shortest(begin: np.ndarray, end: np.ndarray, corners: np.ndarray) -> float:
    """Length of the shorter of the two chains of the convex hull of all points between two of them; straight: free."""
    line, body = shapely.LineString([begin, end]), shapely.Polygon(corners)
    if not line.crosses(body):
        return float(line.length)
    ring = shapely.get_coordinates(shapely.MultiPoint([begin, end, *corners]).convex_hull.exterior)[:-1]
    first, last = (int(np.argmin(np.linalg.norm(ring - point, axis=1))) for point in (begin, end))
    ring = np.roll(ring, -first, axis=0)
    cut = (last - first) % len(ring)
    lengths = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1)
    return float(min(lengths[:cut].sum(), lengths[cut:].sum()))


@pytest.mark.parametrize("seed", draws(range(40), first=10))
def test_the_way_around_a_polygon_is_that_of_a_string(seed: int) -> None:
    """Against the convex hull of the polygon and both ends, which lie outside of it."""
    rng = np.random.default_rng(seed)
    hull = shapely.MultiPoint(rng.uniform(-1.5, 1.5, (rng.integers(3, 9), 2))).convex_hull
    corners = shapely.get_coordinates(shapely.orient_polygons(hull))[:-1]
    away = np.zeros((len(corners), 2))
    for _ in range(20):
        begin, end = rng.uniform((-6.0, -2.0), (-2.0, 2.0)), rng.uniform((2.0, -2.0), (6.0, 2.0))
        bend = np.full(2, np.nan)
        found = length_around(begin, end, np.hstack([corners, away]), 0.0, bend)
        expected = shortest(begin, end, corners) - np.linalg.norm(end - begin)
        assert found == pytest.approx(expected, abs=1e-9)
        assert np.isnan(bend).all() == (expected <= 1e-12)


def arrival(shape: Shape, trajectory, goal: Goal, speed: float, until: float) -> float:
    """The time [s] at which a robot with `nao` that starts at the origin is at its goal; inf after `until` [s]."""
    robot, obstacle = Navigator(method("nao"), Disc(0.3), LIMITS), Obstacle(shape, trajectory)
    place, velocity, decision = np.zeros(2), np.array([speed, 0.0]), None
    for k in range(round(until / 0.1)):
        t = 0.1 * k
        if goal.reached(place, velocity, t):
            return t
        decision = robot.decide(State(place, velocity), [obstacle], goal, now=t, previous=decision)
        assert decision.safe
        push = decision.manoeuvre.mean_acceleration(t, 0.1)
        place, velocity = place + 0.1 * velocity + 0.005 * push, velocity + 0.1 * push
    return np.inf


@pytest.mark.parametrize("offset", [0.0, 1e-9, 0.1])
@pytest.mark.parametrize(
    "shape", [Disc(1.0), Disc(3.0), Rectangle(2.0, 2.0), Rectangle(3.0, 6.0), Polyline([(0, -3), (0, 3)])]
)
def test_a_robot_gets_around_what_rests_in_its_way(shape: Shape, offset: float) -> None:
    """In less than twice the time along the shortest way."""
    length = 2.0 * shape.bounding_radius + 8.0
    way = 2.0 * np.hypot(0.5 * length, shape.bounding_radius + 0.3)
    goal = Goal(Stationary((length, 0.0)), 0.2, stop=True)
    assert arrival(shape, Stationary((0.5 * length, offset)), goal, 0.0, 60.0) <= 2.0 * way / 1.5 + 2.0


@pytest.mark.parametrize("offset", [0.0, 0.02])
@pytest.mark.parametrize("share", [0.25, 0.5])
@pytest.mark.parametrize("stop", [False, True])
def test_a_robot_passes_a_slower_one(share: float, offset: float, stop: bool) -> None:
    goal = Goal(Stationary((30.0, 0.0)), 0.3, stop=stop)
    slower = ConstantVelocity((4.0, offset), (share * 1.5, 0.0))
    assert arrival(Disc(0.3), slower, goal, 1.5, 60.0) <= 1.15 * 20.0 + 2.0


@pytest.mark.parametrize("name", ["nao", "nao_shared"])
@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.6, 0.0, 0.8)])
def test_two_drones_in_one_line_change_places(name: str, axis: tuple[float, float, float]) -> None:
    """Also exactly one above the other."""
    places = 5.0 * np.array([axis, -np.array(axis)])
    goals, velocities = -places, np.zeros((2, 3))
    fleet = Fleet(method(name), Ball(0.3), LIMITS, robots=2)
    for k in range(250):
        step = fleet.step(0.1 * k, places, velocities, goals)
        places, velocities = step.positions, step.velocities
        assert np.linalg.norm(places[0] - places[1]) >= 0.6
        if np.linalg.norm(places - goals, axis=1).max() <= 0.2:
            return
    pytest.fail("they have not changed places after 25 s")


def test_walls_and_boxes_have_corners_at_the_horizon() -> None:
    """In positive order, each with a direction away from the centre; discs have none."""
    shapes = [Disc(1.0), Rectangle(2.0, 1.0), Polyline([(0.0, 0.0), (3.0, 0.0)])]
    window = ObstacleWindow([Obstacle(shape, Stationary((1.0, 2.0))) for shape in shapes], 0.0, 4.0)
    each, corners = window.at_horizon(window.bodies(Disc(0.3)))
    assert (each["last"] - each["first"]).tolist() == [0, 4, 4]
    for row in each[1:]:
        grown = corners[row["first"] : row["last"]]
        outline = shapely.Polygon(grown[:, :2] + grown[:, 2:])
        assert outline.exterior.is_ccw
        assert outline.buffer(-0.5).is_valid
        assert np.linalg.norm(grown[:, 2:], axis=1) == pytest.approx(1.0)
