"""The oracle itself: its distances against shapely, its quick answers against its slow ones, and closed forms."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
import shapely
from hulls import Pair, turned
from oracle import JUMP, Problem, facing
from scenes import SHAPES, scene

from slalom.model.shape import Capsule, Disc, Polygon, Polyline, Rectangle, Union

ROBOT = [(np.zeros((1, 2)), 0.0)]
GROWN = 0.01  # [m]


def hull(corners):
    return shapely.MultiPoint(corners).convex_hull


def random_corners(rng):
    """A point, a segment or a convex polygon, counter-clockwise; often along the axes, so that sides are parallel."""
    count = int(rng.integers(1, 7))
    if rng.random() < 0.3:
        x, y = rng.uniform(0.2, 2.0, size=2)
        return np.array([[-x, -y], [x, -y], [x, y], [-x, y]]) if count > 2 else np.array([[-x, y], [x, y]])[:count]
    points = rng.normal(size=(count, 2)) * rng.uniform(0.2, 2.0, size=2)
    return shapely.get_coordinates(shapely.normalize(hull(points)))[: None if count < 3 else -1][::-1]


def rotated(corners, angle):
    return shapely.get_coordinates(
        shapely.affinity.rotate(shapely.MultiPoint(corners), angle, (0, 0), use_radians=True)
    )


@pytest.mark.parametrize("turns", [False, True], ids=["still", "turning"])
def test_signed_gap_is_that_of_shapely(turns):
    """Apart: the distance of the sets. Overlapping: how deep the robot is in the hull of all differences of corners."""
    rng, apart, deep = np.random.default_rng(1), 0, 0
    for _ in range(1000):
        a, b, radius = random_corners(rng), random_corners(rng), rng.uniform(0.0, 0.5)
        pair, angles = Pair(0, a, b, radius, turns), rng.uniform(-pi, pi, size=3) * turns
        q = rng.normal(size=(3, 2)) * rng.choice([0.3, 1.5, 4.0])
        found = pair.gap(q, np.column_stack([np.cos(angles), np.sin(angles)]))
        for point, angle, gap in zip(q, angles, found):
            placed = rotated(a, angle)
            distance = hull(placed).distance(hull(b + point))
            if distance > 0:
                apart += 1
                assert gap == pytest.approx(distance - radius, abs=1e-8)
                continue
            deep += 1
            differences = hull((placed[:, None] - b).reshape(-1, 2))
            depth = differences.boundary.distance(shapely.Point(point)) if differences.area > 0 else 0.0
            assert gap == pytest.approx(-depth - radius, abs=1e-8)
    assert min(apart, deep) > 500


@pytest.mark.parametrize("name", SHAPES)
def test_parts_cover_what_the_shape_says(name):
    """Against the shape's own definition, drawn by shapely and GROWN, so that a bare line has an area too."""
    rng = np.random.default_rng(2)
    for _ in range(100):
        shape = SHAPES[name](rng, 2, rng.uniform(0.2, 2.0))
        covered = shapely.union_all([hull(corners).buffer(radius + GROWN, 64) for corners, radius in shape.parts])
        truth = drawn(shape)
        assert covered.symmetric_difference(truth).area <= 1e-3 * truth.area
        assert shape.bounding_radius + GROWN == pytest.approx(truth.hausdorff_distance(shapely.Point(0, 0)), rel=1e-3)
        for corners, _ in shape.parts:
            # Counter-clockwise and convex.
            assert len(corners) < 3 or shapely.is_ccw(shapely.LinearRing(corners))
            assert len(corners) < 3 or hull(corners).area == pytest.approx(shapely.Polygon(corners).area)


def drawn(shape):
    """What a shape covers, GROWN; arcs of 64 sides per quarter."""
    if isinstance(shape, Union):
        return shapely.union_all([drawn(part) for part in shape.shapes])
    if isinstance(shape, Rectangle):
        x, y = shape.length / 2, shape.width / 2
        return shapely.box(-x, -y, x, y).buffer(shape.radius + GROWN, 64)
    if isinstance(shape, Disc):
        return shapely.Point(0, 0).buffer(shape.radius + GROWN, 64)
    if isinstance(shape, Polygon):
        return shapely.Polygon(shape.corners).buffer(shape.radius + GROWN, 64)
    points = [shape.start, shape.end] if isinstance(shape, Capsule) else shape.points
    return shapely.LineString(points).buffer(shape.radius + GROWN, 64)


def test_gap_in_space_is_the_distance_to_the_segment():
    rng = np.random.default_rng(3)
    ends, position = rng.normal(size=(2, 3)), 2 * rng.normal(size=(500, 3))
    fine = ends[0] + np.linspace(0, 1, 20001)[:, None] * (ends[1] - ends[0])
    truth = [np.sqrt(((fine - point) ** 2).sum(axis=1).min()) for point in position]
    ball = np.zeros((1, 3))
    np.testing.assert_allclose(Pair(0, ends, ball, 0.25, False).gap(position), np.array(truth) - 0.25, atol=1e-6)
    np.testing.assert_allclose(Pair(0, ball, ends, 0.25, False).gap(-position), np.array(truth) - 0.25, atol=1e-6)


@pytest.mark.parametrize("number", range(24))
def test_quick_answers_are_the_slow_ones(number):
    """Least gaps of many controls at once, and samples near the least, against every sample of every obstacle."""
    s = scene(number, 2 + (number % 4 == 3))
    p = s.problem
    if not p.motions:
        return
    for every in (1, 37):
        slow = [min(p.gap(i, u, p.times[::every]).min() for i in range(len(p.motions))) for u in s.trials]
        np.testing.assert_allclose(p.gaps(s.trials, every), np.minimum(slow, 1e8), atol=1e-6)
    for u in s.trials:
        samples = p.sampled_gap(u)
        deep = samples.min(axis=0) < -1e-4
        assert p.first_overlap(u, 1e-4) == (p.times[np.argmax(deep)] if deep.any() else np.inf)
        assert samples.min() - 0.05 <= p.clearance(u) <= samples.min() + 1e-6


@pytest.mark.parametrize("number", range(8))
def test_turning_bodies_are_bodies_turned_at_each_time(number):
    """The same answers when each body is turned to its direction beforehand, time by time."""
    s = scene(100 + number, 2)
    p, moments = s.problem, np.linspace(0.0, s.problem.horizon, 23)
    for i, (parts, heading, what) in enumerate(zip(p.shapes, p.headings, p.motions)):
        if heading == "motion":
            ahead = facing(*what, p.start + moments)
            for t, (x, y) in zip(moments, ahead):
                if not np.isnan(x):
                    fixed = p.among([parts], [float(np.arctan2(y, x))], [what])
                    here = np.array([t])
                    assert fixed.gap(0, s.preferred, here) == pytest.approx(p.gap(i, s.preferred, here), abs=1e-9)


def still(shapes, headings, motions, robot=ROBOT, horizon=4.0):
    """A robot at the origin whose control is its velocity."""
    zero = np.zeros(2)
    parts = [list(shape.parts) for shape in shapes]
    return Problem(2, 0.0, horizon, zero, zero, zero, ("Velocity", {}), robot, parts, headings, motions)


def line(position, speed):
    return "constant_velocity", {"initial_position": np.array(position), "initial_velocity": np.array(speed), "at": 0.0}


def test_a_rectangle_passes_at_a_known_distance():
    """A car 4 by 2 m drives along y = 3; turned into its motion, across it, and by 45 degrees."""
    car, motions = Rectangle(4.0, 2.0), [line([-10.0, 3.0], [5.0, 0.0])]
    for heading, expected in [(0.0, 2.0), ("motion", 2.0), (pi / 2, 1.0), (pi / 4, 3.0 - 3.0 / np.sqrt(2.0))]:
        for robot, radius in (ROBOT, 0.0), ([(np.zeros((1, 2)), 0.4)], 0.4):
            p = still([car], [heading], motions, robot)
            assert p.clearance(np.zeros(2)) == pytest.approx(expected - radius, abs=1e-8)
            assert p.gaps(np.zeros((1, 2)))[0] == pytest.approx(expected - radius, abs=1e-5)
    # A robot that is a car too, 4 by 2 m across: nearer by half its length.
    across = still([car], ["motion"], motions, [(Rectangle(2.0, 4.0).parts[0].corners, 0.0)])
    assert across.clearance(np.zeros(2)) == pytest.approx(0.0, abs=1e-8)
    assert across.clearance(np.array([0.0, 0.1])) < -0.1


def test_the_first_contact_with_a_rectangle_is_when_its_front_arrives():
    p = still([Rectangle(4.0, 2.0)], ["motion"], [line([10.0, 0.5], [-4.0, 0.0])], [(np.zeros((1, 2)), 0.3)])
    assert p.first_overlap(np.zeros(2), 0.0) == pytest.approx((10.0 - 2.0 - 0.3) / 4.0, abs=2e-3)
    # At its deepest the near side is 0.5 m away, and the robot's radius beyond.
    assert p.clearance(np.zeros(2)) == pytest.approx(-0.8, abs=1e-8)


@pytest.mark.parametrize("speed", [2.0, -2.0])
def test_a_car_on_a_circle_about_the_robot_keeps_its_distance(speed):
    """The middle of its long side, at 5 - 1 m, is nearest at every time; with a fixed heading a corner or a side is."""
    circle = "circular", {"center": np.zeros(2), "radius": 5.0, "speed": speed, "phase": 0.3}
    p, t = still([Rectangle(4.0, 2.0)], ["motion"], [circle], horizon=0.5), np.linspace(0.0, 0.5, 50)
    np.testing.assert_allclose(p.gap(0, np.zeros(2), t), 4.0, atol=1e-12)
    assert p.clearance(np.zeros(2)) == pytest.approx(4.0, abs=1e-9)
    fixed = replace(p, headings=[0.0])
    x, y = 5.0 * np.cos(0.3 + speed / 5.0 * t), 5.0 * np.sin(0.3 + speed / 5.0 * t)
    expected = np.hypot(np.maximum(np.abs(x) - 2.0, 0.0), np.maximum(np.abs(y) - 1.0, 0.0))
    np.testing.assert_allclose(fixed.gap(0, np.zeros(2), t), expected, atol=1e-12)


def test_a_body_that_turns_at_once_is_looked_at_on_both_sides():
    """Past a corner of its path a long body lies across; the last it was before is a clearance too, of no sample."""
    walk = {"times": [0.0, 1.0, 2.0], "positions": [[-3.0, 1.0], [0.0, 1.0], [0.0, 5.0]], "interpolation": "linear"}
    bar, still_u = Polyline([[-2.0, 0.0], [0.0, -0.5], [2.0, 0.0]]), np.zeros(2)
    p = still([bar], ["motion"], [("sampled", walk)], horizon=2.0)
    assert {1.0 - JUMP, 1.0, 1.0 + JUMP} <= set(p.times)
    # Its notch points to the robot until 1 s, when it is right above; then it stands upright, the lower end at y = -1.
    assert p.gap(0, still_u, np.array([1.0 - 1e-6]))[0] == pytest.approx(0.5, abs=1e-5)
    assert p.gap(0, still_u, np.array([1.0]))[0] == pytest.approx(0.5 / np.sqrt(1.0 + 0.0625) * 0.5, abs=1e-3)
    walk["positions"][2] = walk["positions"][1]  # waits: keeps its direction
    np.testing.assert_allclose(p.facing(0, np.array([0.2, 0.99, 1.0, 1.7])), [[1.0, 0.0]] * 4)


def test_a_turn_of_a_point_is_that_of_the_plane():
    quarter = turned(np.array([[1.0, 0.0], [0.0, 2.0]]), np.array([[0.0, 1.0]]))
    np.testing.assert_allclose(quarter[:, :, 0].T, [[0.0, 1.0], [-2.0, 0.0]])
