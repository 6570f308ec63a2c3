"""Observed robots are predicted to stop where they would get into contact with an obstacle at rest."""

import numpy as np
import pytest
import shapely
from draws import draws
from shapely import affinity

from slalom import (
    METHODS,
    ConstantAcceleration,
    ConstantVelocity,
    Disc,
    Fleet,
    Limits,
    Obstacle,
    Polygon,
    Polyline,
    Rectangle,
    Sampled,
    Shape,
    Sight,
    Stationary,
    Tracks,
)
from slalom.kernels.decision.predicted_stops import STOP_DEPTH
from slalom.sim.sweep.case import run_one

NAO = METHODS["nao"]
LIMITS = Limits(2.0, 2.0)
HORIZON, PERIOD = 6.0, 0.1
STEP = 5e-4
"""[s] Between the samples of the oracle: robots of 2 m/s move as far as STOP_DEPTH meanwhile."""


def outline(shape: Shape) -> shapely.Geometry:
    """The region of a shape, with arcs as polygons of 64 corners a quarter."""
    parts = [shapely.MultiPoint(part.corners[:, :2]).convex_hull.buffer(part.radius, 64) for part in shape.parts]
    return shapely.union_all(parts)


def map_of(rng: np.random.Generator) -> list[Obstacle]:
    """Walls, posts and blocks at rest about the origin."""
    wall = Polyline([tuple(rng.uniform(3.0, 6.0) * np.array([np.cos(a), np.sin(a)])) for a in (0.0, 0.9, 2.0)], 0.1)
    corners = rng.uniform(0.4, 1.0, (5, 1)) * [(np.cos(a), np.sin(a)) for a in 2.0 * np.pi * np.arange(5) / 5]
    hull = shapely.MultiPoint(corners).convex_hull
    return [
        Obstacle(wall, Stationary((0.0, 0.0)), "wall"),
        Obstacle(Disc(0.4), Stationary(tuple(rng.uniform(-6.0, -2.0, 2))), "post"),
        Obstacle(Polygon(list(hull.exterior.coords)[:-1]), Stationary((0.5, -5.0)), "block"),
        Obstacle(Disc(0.5), ConstantVelocity((3.0, -3.0), (-0.5, 0.2)), "person"),
    ]


def predicted(fleet: Fleet, k: int, t: np.ndarray) -> np.ndarray:
    """Positions (len(t), 2) [m] at times [s] on the path on which the others predict robot k."""
    times, points = fleet.table.observed.times[k], fleet.table.observed.points[k, :, :, :2]
    real = np.flatnonzero(np.diff(times) > 0.0)
    piece = real[np.clip(np.searchsorted(times[real], t, side="right") - 1, 0, len(real) - 1)]
    x = ((t - times[piece]) / (times[piece + 1] - times[piece]))[:, None]
    a, b, c, d = (points[piece, j] for j in range(4))
    return (1 - x) ** 3 * a + 3 * x * (1 - x) ** 2 * b + 3 * x**2 * (1 - x) * c + x**3 * d


@pytest.mark.parametrize("seed", draws(range(24), 3))
@pytest.mark.parametrize("shape", [Disc(0.3), Rectangle(0.8, 0.4)], ids=["disc", "rectangle"])
def test_predictions_end_where_a_robot_would_enter_an_obstacle_at_rest(shape: Shape, seed: int) -> None:
    """By the distances of the regions at samples of the prediction without stops. Robots go through what moves."""
    rng = np.random.default_rng(seed)
    obstacles, now, n = map_of(rng), float(rng.choice([0.0, 7.3])), 12
    fleet = Fleet(NAO, shape, LIMITS, robots=n, obstacles=obstacles, horizon=HORIZON)
    positions, velocities = rng.uniform(-3.0, 3.0, (n, 2)), rng.uniform(-1.4, 1.4, (n, 2))
    fleet.step(now, positions, velocities, -positions)
    at_rest = shapely.union_all(
        [affinity.translate(outline(o.shape), *o.trajectory.position(0.0)) for o in obstacles if o.name != "person"]
    )
    region = outline(shape)
    smaller = region.buffer(-1.1 * STOP_DEPTH)
    times, stopped, free_ones = now + np.arange(0.0, HORIZON, STEP), 0, 0
    shapely.prepare(at_rest)

    def touches(robot: shapely.Geometry, place: np.ndarray) -> bool:
        return bool(shapely.intersects(at_rest, affinity.translate(robot, *place)))

    for k in range(n):
        # A robot that joins has not accelerated yet.
        state = ConstantAcceleration(positions[k], velocities[k], np.zeros(2), now)
        ahead, found = NAO.robot_forecast(state, now).path(now, times[-1]), predicted(fleet, k, times)
        straight = positions[k] + (times - now)[:, None] * velocities[k]
        np.testing.assert_allclose(ahead.points[-1, 3], straight[-1])
        if touches(region, positions[k]):
            continue
        apart = np.flatnonzero(np.linalg.norm(found - straight, axis=1) > 1e-9)
        entered = [j for j in range(0, len(times), 50) if touches(smaller, straight[j])]
        if not len(apart):
            free_ones += 1
            assert not entered
            continue
        stopped += 1
        stop = found[apart[0]]
        assert not entered or apart[0] <= max(entered[0], PERIOD / STEP + 1)
        assert times[apart[0]] >= now + PERIOD
        assert np.ptp(found[apart[0] :], axis=0).max() < 1e-12
        assert np.linalg.norm(stop - straight[apart[0]]) <= 2.0 * STEP
        assert touches(region.buffer(1e-4), stop)
        assert not touches(smaller, stop) or times[apart[0]] < now + PERIOD + 2.0 * STEP
    assert stopped > 0
    assert free_ones > 0


@pytest.mark.parametrize("depth", [0.0, 1e-7, 0.02])
def test_a_robot_in_contact_stops_only_where_it_gets_deeper(depth: float) -> None:
    """And not within a period, for which robots that observe it have a guarantee."""
    wall = Obstacle(Polyline([(-50.0, 0.0), (50.0, 0.0)]), Stationary((0.0, 0.0)), "wall")
    velocities = np.array([(1.0, 0.0), (0.5, 1.0), (0.0, -1.0), (0.0, 0.0)])
    positions = np.array([(10.0 * k, 0.3 - depth) for k in range(4)])
    fleet = Fleet(NAO, Disc(0.3), LIMITS, robots=4, obstacles=[wall], horizon=HORIZON)
    fleet.step(0.0, positions, velocities, positions + 5.0)
    ends = np.array([predicted(fleet, k, np.array([HORIZON]))[0] for k in range(4)])
    expected = positions + HORIZON * velocities
    expected[2] = positions[2] + PERIOD * velocities[2]
    np.testing.assert_allclose(ends, expected, atol=STOP_DEPTH)


def test_robots_stop_at_obstacles_of_their_own_world() -> None:
    """And only at those that have not left by then."""
    wall = Polyline([(5.0, -50.0), (5.0, 50.0)])
    for worlds, stops in ((None, True), ([0], True), ([1], False)):
        others = Tracks([(5.0, 0.0)], [(0.0, 0.0)], 0.5, worlds=worlds)
        fleet = Fleet(NAO, Disc(0.3), LIMITS, robots=1, horizon=HORIZON)
        fleet.step(0.0, [(0.0, 0.0)], [(1.0, 0.0)], [(0.0, 9.0)], others=[others])
        end = predicted(fleet, 0, np.array([HORIZON]))[0, 0]
        assert end == pytest.approx(4.2 if stops else 6.0, abs=STOP_DEPTH)
    for leaves, stops in ((3.0, False), (5.0, True)):
        there = Sampled([0.0, leaves], [(0.0, 0.0), (0.0, 0.0)])
        fleet = Fleet(
            NAO, Disc(0.3), LIMITS, robots=1, horizon=HORIZON, obstacles=[Obstacle(wall, there, after_end="leaves")]
        )
        fleet.step(0.0, [(0.0, 0.0)], [(1.0, 0.0)], [(0.0, 9.0)])
        end = predicted(fleet, 0, np.array([HORIZON]))[0, 0]
        assert end == pytest.approx(4.7 if stops else 6.0, abs=STOP_DEPTH)


def test_robots_stop_at_obstacles_that_their_observer_sees() -> None:
    """A robot behind another does not know of a person who stands still beyond its own range."""
    person = Obstacle(Disc(0.5), Sampled([0.0, 20.0, 40.0], [(7.0, 0.5), (7.0, 0.5), (9.0, 9.0)]), "person")
    found = {}
    for reach in (5.0, 20.0):
        for around in ([], [person]):
            for rows in ([0, 1], [1, 0]):
                fleet = Fleet(NAO, Disc(0.3), LIMITS, robots=2, obstacles=around, sight=Sight(reach), horizon=HORIZON)
                positions, velocities = np.array([(0.0, 0.0), (2.5, 0.2)]), np.array([(1.5, 0.0), (1.2, 0.0)])
                targets = np.array([(20.0, 0.0), (20.0, 0.2)])
                decided = fleet.step(0.0, positions[rows], velocities[rows], targets[rows])
                found[reach, bool(around), rows[0]] = decided.accelerations[rows.index(0)]
    for first in (0, 1):
        np.testing.assert_array_equal(found[5.0, True, first], found[5.0, False, first])
        assert np.linalg.norm(found[20.0, True, first] - found[20.0, False, first]) > 0.01


def test_a_method_without_stops_predicts_through_walls() -> None:
    wall = Obstacle(Polyline([(2.0, -9.0), (2.0, 9.0)]), Stationary((0.0, 0.0)), "wall")
    for name in ("vo", "rvo", "ao"):
        fleet = Fleet(METHODS[name], Disc(0.3), LIMITS, robots=1, obstacles=[wall], horizon=HORIZON)
        fleet.step(0.0, [(0.0, 0.0)], [(1.0, 0.0)], [(0.0, 9.0)])
        np.testing.assert_allclose(predicted(fleet, 0, np.array([HORIZON])), [(6.0, 0.0)])


@pytest.mark.parametrize("seed", draws([43, 31, 52], 0))
def test_no_robot_is_pressed_into_a_door_post(seed: int) -> None:
    """Without stops, robots got up to 0.21 m deep into the post in these draws."""
    found = run_one("doorway", {"robots": 20}, "nao", seed)
    assert (found["collisions"], found["arrived"]) == (0, 20)
