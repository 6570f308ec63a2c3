"""Several robots: the guarantee of shared manoeuvres, what is seen of others, and that nothing depends on their
order.
"""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from draws import draws
from fleets import OneByOne

from slalom import (
    METHODS,
    Circular,
    Disc,
    Friction,
    Goal,
    HeadingCone,
    InvalidInput,
    Limits,
    Obstacle,
    Outcome,
    Polyline,
    Rectangle,
    State,
    Stationary,
)
from slalom.base.tolerances import COMMITTED_SLACK
from slalom.kernels import detour_lengths
from slalom.sim import Robot, Scenario, metrics, simulate
from slalom.sim.gallery import build
from slalom.sim.measure.closest_approach import METRIC, between_robots, closest_approaches, single_robot_view
from slalom.sim.measure.metrics import COLLISION
from slalom.sim.run.deciders import FleetDecider

SHARED = METHODS["nao_shared"]


def least_clearance(recording) -> float:
    """Between all robots, and to all obstacles, in continuous time."""
    each = [closest_approaches(single_robot_view(recording, k)) for k in range(len(recording.shapes))]
    return min(closest.clearance for row in each for closest in row)


def drawn(seed: int, count: int = 6, *, moving: bool = False) -> Scenario:
    """Robots of different size, shape and limits in a small walled square, perhaps on the move already."""
    rng = np.random.default_rng(seed)
    robots: list[Robot] = []
    while len(robots) < count:
        position, goal = rng.uniform(-6.0, 6.0, (2, 2))
        shape = Rectangle(1.2, 0.6, 0.1) if rng.random() < 0.3 else Disc(float(rng.uniform(0.2, 0.6)))
        away = [
            np.linalg.norm(position - r.state.position) - shape.bounding_radius - r.shape.bounding_radius
            for r in robots
        ]
        if min(away, default=9.0) < (2.0 if moving else 0.2):
            continue
        limits = Limits(float(rng.uniform(0.8, 2.0)), float(rng.uniform(1.0, 3.0)))
        velocity = rng.uniform(-0.5, 0.5, 2) if moving else np.zeros(2)
        name = f"robot {len(robots)}"
        robots.append(Robot(shape, limits, State(position, velocity), Goal(Stationary(goal), 0.4, stop=True), name))
    corners = np.array([(-8, -8), (8, -8), (8, 8), (-8, 8), (-8, -8)], float)
    walls = Obstacle(Polyline(corners, 0.05), Stationary((0.0, 0.0)), "walls")
    return Scenario("drawn", tuple(robots), (walls,), duration=12.0, horizon=6.0, holds=(0.5, 1.5))


@pytest.mark.parametrize("seed", draws(range(30), 2))
def test_shared_manoeuvres_never_collide(seed):
    """The theorem of docs/theory.md, 16, in runs in which its assumptions hold: every clearance, every outcome."""
    run = simulate(drawn(seed, moving=seed % 2 == 1), SHARED, seed=seed)
    assert least_clearance(run) >= -COMMITTED_SLACK - METRIC
    outcomes = {name for row in run.outcomes for name in row if name}
    assert all(Outcome[name].safe for name in outcomes), outcomes
    for k, limits in enumerate(run.limits):
        assert np.linalg.norm(run.accelerations[:, k], axis=1).max() <= limits.max_acceleration * (1 + 1e-7)
        assert np.linalg.norm(run.velocities[:, k], axis=1).max() <= limits.max_speed * (1 + 1e-7)


@pytest.mark.parametrize("method", ["nao_shared", "nao"])
def test_the_order_of_robots_does_not_matter(method):
    scenario = replace(drawn(3, 4), duration=4.0)
    order = [2, 0, 3, 1]
    run = simulate(scenario, METHODS[method])
    mixed = simulate(replace(scenario, robots=tuple(scenario.robots[k] for k in order)), METHODS[method])
    assert len(run.times) == len(mixed.times)
    for position, k in enumerate(order):
        assert np.array_equal(mixed.positions[:, position], run.positions[:, k])


def two(stop: bool) -> Scenario:
    """The second one wants to where the first one passes its goal."""
    limits = Limits(1.0, 1.0)
    first = Robot(Disc(0.4), limits, State((0, 0), (0, 0)), Goal(Stationary((3, 0)), 0.3, stop), "first")
    second = Robot(Disc(0.4), limits, State((0, 3), (0, 0)), Goal(Stationary((3, 0.2)), 0.3, True), "second")
    return Scenario("two", (first, second), duration=15.0, horizon=4.0, holds=(0.5, 1.0))


def test_a_robot_that_passes_its_goal_leaves():
    run = simulate(two(stop=False), SHARED)
    assert np.all(np.isfinite(run.arrived))
    step = round(float(run.arrived[0]) / run.dt)
    assert np.array_equal(run.positions[step + 1, 0], run.positions[-1, 0])
    other = single_robot_view(run, 1).obstacles[0]
    assert other.trajectory.span[1] == pytest.approx(run.arrived[0])


@pytest.mark.parametrize("seed", range(3))
def test_all_pairs_at_once_are_as_near_as_one_by_one(seed):
    """The pairs that metrics count, discs and rectangles, against the robots as obstacles of each other."""
    run = simulate(replace(drawn(seed, 4), duration=6.0), SHARED)
    between = between_robots(run)
    for k in range(4):
        each = [c.clearance for c in closest_approaches(single_robot_view(run, k))][len(run.obstacles) :]
        assert np.delete(between[k], k) == pytest.approx(each, abs=METRIC)


def test_a_robot_at_its_goal_gives_way_to_one_that_wants_there():
    """Both cannot stay: they arrive in turn."""
    run = simulate(replace(two(stop=True), duration=40.0), SHARED)
    assert np.all(np.isfinite(run.arrived))
    assert least_clearance(run) >= -COMMITTED_SLACK - METRIC


@pytest.mark.parametrize("chunk", draws(range(3)))
def test_a_fleet_decides_as_the_navigator_of_each_robot(chunk):
    """Same outcomes and controls, step by step, with manoeuvres that are shared and with such that are observed. (Of
    two responses with the same optimistic cost to the last bit either may be taken.) A navigator keeps one margin from
    all obstacles, so there are only robots where these keep a larger one from each other.
    """
    found = Counter()
    for seed in (2 * chunk, 2 * chunk + 1):
        for name in ("nao_shared", "ao", "vo"):
            method = METHODS[name].among_robots()
            # The navigators take the others for obstacles.
            method = method if method.shared else replace(method, forecast=method.robot_forecast)
            scenario = five_robots(seed) if method.shared else replace(five_robots(seed), obstacles=())
            fleet = FleetDecider(scenario, method)
            each = OneByOne(scenario, method, fleet.states)
            for step in range(8):
                now = step * scenario.dt
                expected = each.decide([(k + step) % 5 for k in range(5)], now)
                outcomes, _ = fleet.decide(now)
                assert outcomes == expected, (seed, name, step)
                apart = np.abs(fleet.committed()[0] - each.controls).max(axis=1)
                # The goal of robot 3 moves on a curve, whose pieces begin at other times in the two tables.
                assert apart[[0, 1, 2, 4]].max() <= 1e-7, (seed, name, step)
                assert apart[3] <= 1e-4, (seed, name, step)
                fleet.states.integrate(fleet.accelerations(now, scenario.dt), scenario.dt)
                found.update(outcomes)
    assert min(found["CLEAR"], found["CONSTRAINED"], found["KEPT"]) > 2, found


def test_the_number_of_threads_changes_no_bit():
    scenario = replace(build("random_goals", {"robots": 60, "side": 30}, seed=3), duration=3.0)
    runs = [simulate(scenario, METHODS["nao"], threads=threads) for threads in (1, 2, 3)]
    for run in runs[1:]:
        np.testing.assert_array_equal(run.positions, runs[0].positions)
        assert run.outcomes == runs[0].outcomes


def five_robots(seed: int) -> Scenario:
    """Five robots on the move among passive obstacles: discs and rectangles, some with bounds, one goal moves."""
    rng = np.random.default_rng(seed)
    places = np.array([(-6.0, 0), (6, 0.5), (0, 6), (0.5, -6), (5, 5)]) + rng.uniform(-1, 1, (5, 2))
    car_like = (Friction(2.0, 2.0, 1.5), HeadingCone(1.2))
    goals = [Goal(Stationary(-place), 0.4, k != 2) for k, place in enumerate(places)]
    goals[3] = Goal(Circular((0.0, 5.0), 1.0, 0.5), 0.4, True)
    robots = tuple(
        Robot(
            Rectangle(0.9, 0.5) if k in (1, 3) else Disc(0.4),
            Limits(2.0, 2.0, bounds=car_like if k in (0, 1) else ()),
            State(place, rng.uniform(-1, 1, 2)),
            goals[k],
            str(k),
        )
        for k, place in enumerate(places)
    )
    wall = Obstacle(Polyline([(-3.0, 2.0), (-1.0, 3.0)], 0.1), Stationary((0.0, 0.0)), "wall")
    car = Obstacle(Disc(0.5), Circular((0.0, 0.0), 3.0, 1.0), "car")
    return Scenario("five", robots, (wall, car), horizon=5.0, holds=(0.5, 1.0), guided=False)


def test_collisions_of_robots_count_once():
    """Two that drive through each other, recorded by hand."""
    run = simulate(two(stop=True), SHARED)
    there = np.linspace(-1.0, 1.0, len(run.times))[:, None] * np.array([1.0, 0.0])
    speed = np.full_like(there, 0.0)
    speed[:, 0] = 2.0 / (run.times[-1] - run.times[0])
    wrong = replace(
        run,
        positions=np.stack([there, -there], axis=1),
        velocities=np.stack([speed, -speed], axis=1),
        accelerations=np.zeros_like(run.accelerations),
    )
    assert metrics.summary(wrong)["collisions"] == 1
    assert metrics.summary(wrong)["min_clearance"] == pytest.approx(-0.8, abs=COLLISION)
    assert metrics.summary(run)["robots"] == 2


def test_passive_obstacles_are_avoided_by_all():
    car = Obstacle(Disc(0.5), Circular((0.0, 0.0), 5.0, 1.0), "car")
    scenario = replace(build("circle", {"robots": 2, "radius": 8.0, "robot_radius": 0.5}, seed=0), obstacles=(car,))
    run = simulate(scenario, SHARED)
    assert np.all(np.isfinite(run.arrived))
    assert least_clearance(run) >= -METRIC


class TestRefused:
    def test_two_of_one_name(self):
        robot = two(True).robots[0]
        with pytest.raises(InvalidInput, match=r"robots: expected a name for each, found \['first', 'first'\]"):
            simulate(replace(two(True), robots=(robot, robot)), SHARED)

    def test_a_horizon_that_is_too_short(self):
        with pytest.raises(InvalidInput, match=r"horizon: expected at least 2.5 s, the longest manoeuvre of 'first'"):
            simulate(replace(two(True), horizon=1.5), SHARED)


class TestDetours:
    def test_the_way_around_a_disc(self):
        """Straight through the middle: half the circle instead of the diameter, as tangents allow; beside it:
        nothing.
        """
        place, goal = np.array([-2.0, 0.0]), np.array([2.0, 0.0])
        discs = np.array([(0.0, 0.0), (0.0, 1.5), (5.0, 0.0), (0.0, 0.5)])
        longer = detour_lengths(place, goal, discs, np.ones(4))
        assert longer[0] == pytest.approx(2 * np.sqrt(3) + np.pi / 3 - 4.0)
        assert longer[1] == longer[2] == 0.0
        assert 0.0 < longer[3] < longer[0]

    @pytest.mark.parametrize("seed", range(5))
    def test_it_is_the_length_of_a_string(self, seed):
        """Against the shortest of many polygons around the disc."""
        rng = np.random.default_rng(seed)
        position, goal, radius = rng.uniform(-4, -2, 2), rng.uniform(2, 4, 2), 1.0
        angles = np.linspace(-np.pi, np.pi, 20001)
        rim = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        best = np.inf
        for side in (1, -1):
            first, second = (tangent(point, radius, side * sign) for point, sign in ((position, 1), (goal, -1)))
            turn = side * (np.arctan2(*second[::-1]) - np.arctan2(*first[::-1])) % (2 * np.pi)
            best = min(best, np.linalg.norm(position - first) + np.linalg.norm(goal - second) + radius * turn)
        assert rim.shape == (20001, 2)
        straight = np.linalg.norm(goal - position)
        along = goal - position
        across = abs(along[0] * position[1] - along[1] * position[0]) / straight
        expected = best - straight if across < radius else 0.0
        assert detour_lengths(position, goal, np.zeros((1, 2)), np.array([radius]))[0] == pytest.approx(
            expected, abs=1e-9
        )


def tangent(point, radius, side):
    """Where the tangent from a point touches the circle about the origin."""
    distance = np.linalg.norm(point)
    angle = np.arctan2(point[1], point[0]) + side * np.arccos(radius / distance)
    return radius * np.array([np.cos(angle), np.sin(angle)])
