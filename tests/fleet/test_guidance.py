"""Targets of robots that share the plane: paths around obstacles at rest, traffic circles, priority inheritance."""

from itertools import pairwise

import numpy as np
import pytest
from draws import draws
from fleets import guidance_in

from slalom import METHODS, Disc, Fleet, Goal, Limits, Obstacle, Polyline, State, Stationary
from slalom.kernels.guidance.grid import (
    BUCKET_WIDTH,
    PARKED_COST,
    WALL_COST,
    cell_costs,
    farthest_in_sight,
    goal_in_sight,
    line_of_sight,
    new_path_search,
    path_lengths,
    path_to_goal,
)
from slalom.kernels.guidance.priority_inheritance import REQUEST_BESIDE_AFTER
from slalom.kernels.guidance.tables import Grid
from slalom.kernels.guidance.traffic_circle import circle_around, tangent_target, update_targets
from slalom.sim import Robot, Scenario, simulate
from slalom.sim.gallery import build
from slalom.sim.run.deciders import FleetDecider
from slalom.sim.run.states import integrate

MOVES = [(a, b) for a in range(-2, 3) for b in range(-2, 3) if a * a + b * b in (1, 2, 5)]


def fleet(positions, goals, *, walls=None) -> Scenario:
    """Robots at rest with goals at which they stop."""
    robots = tuple(
        Robot(Disc(0.4), Limits(1.5, 2.0), State(p, (0.0, 0.0)), Goal(Stationary(g), 0.3, stop=True), f"robot {k:02d}")
        for k, (p, g) in enumerate(zip(positions, goals))
    )
    obstacles = () if walls is None else (Obstacle(Polyline(walls, 0.05), Stationary((0.0, 0.0)), "walls"),)
    return Scenario("fleet", robots, obstacles, duration=40.0, holds=(0.5, 1.0, 2.0))


class TestPaths:
    @pytest.mark.parametrize("seed", range(5))
    def test_lengths_are_those_of_all_pairs(self, seed):
        """Against Bellman and Ford on the same 16 moves."""
        rng = np.random.default_rng(seed)
        cost = np.where(rng.random((9, 8)) < 0.3, PARKED_COST, 1.0)
        goal = (int(rng.integers(9)), int(rng.integers(8)))
        cells = [(x, y) for x in range(9) for y in range(8)]
        slow = dict.fromkeys(cells, np.inf) | {goal: 0.0}
        for _ in range(40):
            for x, y in cells:
                for a, b in MOVES:
                    u, v = x + a, y + b
                    if (u, v) in slow:
                        each = 0.5 * (cost[x, y] + cost[u, v])
                        if abs(a) + abs(b) == 3:
                            # The two cells between: half the long side, with and without the short one.
                            middle = (x + a // 2, y) if abs(a) == 2 else (x, y + b // 2)
                            other = (x + a // 2, y + b) if abs(a) == 2 else (x + a, y + b // 2)
                            each = max(each, cost[middle], cost[other])
                        slow[x, y] = min(slow[x, y], slow[u, v] + np.hypot(a, b) * each)
        search = new_path_search(cost)
        path_lengths(cost, goal, (-1, -1), search)
        found = search.lengths.reshape(cost.shape)
        assert all(found[cell] == pytest.approx(slow[cell]) for cell in cells)

    @pytest.mark.parametrize("seed", range(30))
    def test_no_path_is_much_shorter(self, seed):
        """On maps with discs and walls, against the lengths of the paths from all cells."""
        rng, n = np.random.default_rng(seed), 60
        x, y = np.indices((n, n))
        cost = np.ones((n, n))
        for _ in range(12):
            a, b, r = rng.integers(0, n), rng.integers(0, n), rng.uniform(1.0, 6.0)
            cost[(x - a) ** 2 + (y - b) ** 2 < r * r] = PARKED_COST
        for _ in range(4):
            a, b = rng.integers(0, n - 30, 2)
            cost[a : a + 30, b] = WALL_COST
        ends = rng.integers(0, n, 4)
        goal, start = tuple(ends[:2]), tuple(ends[2:])
        every, search = new_path_search(cost), new_path_search(cost)
        path_lengths(cost, goal, (-1, -1), every)
        lengths, path = every.lengths.reshape(n, n), path_to_goal(cost, goal, start, search)
        assert path[0] == start
        assert path[-1] == goal
        assert np.isinf(search.lengths).all()
        # A second search in the same memory finds the same.
        assert path_to_goal(cost, goal, start, search) == path
        length = 0.0
        for one, other in pairwise(path):
            step = np.array(other) - one
            if abs(step).sum() == 3:
                middle = np.sign(step) * (abs(step) == 2)
                crossed = [cost[tuple(one + middle)], cost[tuple(other - middle)]]
            else:
                crossed = []
            length += np.hypot(*step) * max(0.5 * (cost[one] + cost[other]), *crossed, 0.0)
        assert lengths[start] - 1e-9 <= length <= lengths[start] + BUCKET_WIDTH

    def test_robots_that_have_arrived_and_walls_are_gone_around(self):
        clearance = np.full((41, 41), np.inf)
        clearance[20, 10:] = 0.0
        grid, positions = (
            Grid(np.zeros(2), 0.1, clearance, clearance + 0.07),
            np.array([(1.0, 1.0, 0.0), (2.7, 3.0, 0.0)]),
        )
        radii, parked = np.array([0.2, 0.3]), np.array([1])
        cost = cell_costs(grid, 0.2, positions, radii, parked)
        assert cost[20, 30] == WALL_COST
        assert cost[27, 30] == cost[31, 30] == PARKED_COST
        assert cost[27, 36] == cost[10, 10] == 1.0
        positions[0] = (1.0, 1.0, 0.0)
        assert goal_in_sight(grid, 0.2, positions, radii, parked, 0, np.array([1.5, 3.0, 0.0]))
        positions[0], goal, corner = (1.0, 3.0, 0.0), np.array([3.5, 3.0, 0.0]), np.zeros(3)
        assert not goal_in_sight(grid, 0.2, positions, radii, parked, 0, goal)
        farthest_in_sight(grid, cost, positions[0], goal, new_path_search(cost), corner)
        assert line_of_sight(cost, 10.0, 30.0, corner[0] / 0.1, corner[1] / 0.1)
        assert corner[1] < 1.25

    @pytest.mark.parametrize("seed", range(12))
    def test_passages_that_are_too_narrow_are_closed(self, seed):
        """Cells are two thirds of a robot wide; a passage counts by its own width, at any place and angle.

        Beside it, 4 m away, is a wide one.
        """
        rng = np.random.default_rng(seed)
        angle, free = rng.uniform(0.0, 2.0 * np.pi), 0.45 + rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-2.3, -1.0)
        turn = np.array([(np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle))])
        corners = [((0.0, free + 0.05), (0.0, 6.0)), ((0.0, -free - 0.05), (0.0, -3.0)), ((0.0, -5.0), (0.0, -9.0))]
        walls = [Obstacle(Polyline(np.array(each) @ turn.T, 0.05), Stationary((0.0, 0.0))) for each in corners]
        one = Fleet(METHODS["nao"], Disc(0.4), Limits(1.5, 2.0), robots=1, obstacles=walls, guided=True)
        places, velocities = (turn @ rng.uniform((-3.0, -1.0), (-2.0, 1.0)))[None], np.zeros((1, 2))
        goal, passed, k = turn @ (3.0, 0.3), np.nan, 0
        while np.linalg.norm(places - goal) > 0.2 and k < 150:
            step = one.step(0.1 * k, places, velocities, goal[None])
            (before, _), (after, across) = places[0] @ turn, step.positions[0] @ turn
            passed = across if before < 0.0 <= after else passed
            places, velocities, k = step.positions, step.velocities, k + 1
        assert k < 150
        assert (abs(passed) < 0.5) == (free > 0.45)

    def test_a_robot_finds_its_way_out_of_a_trap(self):
        """A U of walls between it and its goal."""
        walls = np.array([(-1.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-1.0, 3.0)])
        run = simulate(fleet([(0.0, 0.0), (9.0, 9.0)], [(7.0, 0.0), (9.0, 5.0)], walls=walls), METHODS["nao_shared"])
        assert np.all(np.isfinite(run.arrived))


class TestTrafficCircles:
    def test_robots_of_a_circle_pass_its_middle_on_the_same_side(self):
        scenario = build("circle", {"robots": 12, "noise": 0.0})
        guidance = guidance_in(scenario)
        guide = guidance.guide
        guide.velocity[:] = -2.0 * guide.position / 20.0
        update_targets(np.arange(len(guide.radius)), guide)
        ahead = -guide.position
        towards = guide.target - guide.position
        turn = ahead[:, 0] * towards[:, 1] - ahead[:, 1] * towards[:, 0]
        assert np.all(turn < 0.0)
        assert np.ptp(np.linalg.norm(towards, axis=1)) < 1e-9
        assert np.linalg.norm(guide.circle[:, :2], axis=1).max() < 2.0
        # Twelve robots side by side on it, and some room.
        assert np.all(2.0 * np.pi * guide.circle[:, 2] > 12 * 3.0)
        assert not guide.stop.any()

    def test_without_guidance_targets_are_the_goals(self):
        """At every step of a run in which guided robots go around each other; 0.0 and 1.0 are what `--set` gives."""
        for guided, straight in ((0.0, True), (1.0, False)):
            decider = FleetDecider(build("circle", {"robots": 4, "guided": guided}), METHODS["nao"])
            goals = np.array([robot.goal.position(0.0) for robot in decider.scenario.robots])
            found = []
            for step in range(60):
                decider.decide(0.1 * step)
                each = decider.fleet.table.each
                found.append(np.array_equal(each["target"][:, :2], goals) and bool(each["stop"].all()))
                decider.states.integrate(decider.accelerations(0.1 * step, 0.1), 0.1)
            assert all(found) == straight

    def test_without_encounters_targets_are_the_goals(self):
        guidance = guidance_in(fleet([(0.0, 0.0), (0.0, 5.0)], [(9.0, 0.0), (9.0, 5.0)]))
        guidance.guide.velocity[:, 0] = 1.5
        update_targets(np.arange(2), guidance.guide)
        assert np.array_equal(guidance.guide.target, guidance.guide.goal)

    def test_a_traffic_circle_beside_the_way_is_not_entered(self):
        guide = guidance_in(fleet([(0.0, 0.0)], [(9.0, 0.0)])).guide
        position = np.zeros(3)
        assert tangent_target(0, guide, np.array([5.0, 0.0, 1.0, 2.0]), position)
        assert position[1] < 0.0
        # The line to it touches the circle: its middle is one radius away.
        assert abs(5.0 * position[1]) == pytest.approx(np.linalg.norm(position))
        for ring in ([5.0, 2.0, 1.0, 2.0], [-3.0, 0.0, 1.0, 2.0], [8.8, 0.0, 1.0, 2.0]):
            assert not tangent_target(0, guide, np.array(ring), position)

    def test_encounters_elsewhere_do_not_enlarge_the_circle(self):
        found, ring = np.array([(1.0, 0.0, 0.0, 0.5), (2.0, 0.5, 0.0, 0.5), (3.0, 30.0, 0.0, 0.5)]), np.zeros(4)
        circle_around(0.5, found, 3, ring)
        assert ring[3] == 2
        assert ring[0] == pytest.approx(0.25)

    def test_robots_that_have_arrived_keep_no_circle(self):
        """They drift at their goals beside the way of the robot, by rounding towards the centre of its circle."""
        guide = guidance_in(fleet([(0.0, 0.0), (2.5, 1.5)], [(9.0, 0.0), (2.5, 1.5)])).guide
        guide.velocity[1, 1] = -1e-9
        for arrived in (False, True):
            guide.arrived[1] = arrived
            guide.circle[0] = (2.5, 0.0, 1.2, 2.0)
            update_targets(np.arange(1), guide)
            assert (guide.circle[0, 2] > 0.0) != arrived
            assert np.array_equal(guide.target[0], guide.goal[0]) == arrived

    def test_robots_that_come_later_do_not_enlarge_the_circle(self):
        """Forty robots are on their way to the place where two others meet long before."""
        angles = np.linspace(0.1, 2.0 * np.pi, 40)
        far = 120.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        positions = np.array([(-10.0, 0.1), (10.0, 0.0), *far])
        goals = np.array([(9.0, 0.0), (-9.0, 0.0), *-far])
        found = []
        for count in (2, len(positions)):
            guide = guidance_in(fleet(positions[:count], goals[:count])).guide
            guide.velocity[:, :2] = 0.012 * (goals - positions)[:count]
            guide.velocity[:2, 0] = (1.5, -1.5)
            for _ in range(3):
                update_targets(np.arange(count), guide)
            found.append((guide.circle[:2].copy(), guide.target[:2].copy()))
        (circle, target), (among, guided) = found
        assert np.all(circle[:, 2] > 0.0)
        assert np.array_equal(circle, among)
        assert np.array_equal(target, guided)


class TestPriorityInheritance:
    def test_a_robot_at_its_goal_in_a_passage_lets_another_through(self):
        """A passage one robot wide, in which the first has arrived."""
        walls = np.array([(-1, 0.6), (4, 0.6), (4, 3), (9, 3), (9, -3), (4, -3), (4, -0.6), (-1, -0.6)], float)
        positions, goals = [(3.0, 0.0), (0.0, 0.0)], [(3.0, 0.0), (7.0, 1.0)]
        run = simulate(fleet(positions, goals, walls=walls), METHODS["nao_shared"])
        assert np.isfinite(run.arrived[1])

    def test_the_robot_that_has_waited_longest_goes_first(self):
        robots = fleet([(0.0, 0.0), (0.9, 0.0), (1.8, 0.0)], [(9.0, 0.0), (-9.0, 0.0), (1.8, 0.0)])
        guidance = guidance_in(robots)
        guide = guidance.guide
        guide.waiting_time[:] = (5.0, 3.0, 0.0)
        guidance.update(0.0, 0.1)
        assert guide.yielding[1, 2] > 0.0
        assert np.array_equal(guide.target[1, :2], guide.yielding[1, :2])
        assert abs(guide.target[1, 1]) > 0.5
        assert np.array_equal(guide.target[0], guide.waypoint[0])

    @pytest.mark.parametrize("waited", [0.9 * REQUEST_BESIDE_AFTER, REQUEST_BESIDE_AFTER])
    def test_after_a_long_wait_robots_beside_it_yield_too(self, waited):
        guidance = guidance_in(fleet([(0.0, 0.0), (0.0, 0.85)], [(9.0, 0.0), (0.0, 9.0)]))
        guide = guidance.guide
        guide.waiting_time[0] = waited
        guidance.update(0.0, 0.1)
        assert (guide.yielding[1, 2] > 0.0) == (waited >= REQUEST_BESIDE_AFTER)

    @pytest.mark.parametrize("seed", draws([5, 114]))
    def test_an_arch_before_a_door_does_not_last(self, seed):
        """Two robots at the jambs and one between them, none of them ahead of another, held up the rest for good."""
        run = simulate(build("doorway", {}, seed=seed), METHODS["nao_shared"])
        assert np.all(np.isfinite(run.arrived))


@pytest.mark.parametrize("name", ["corridor_swap", "crossing_streams", "doorway"])
@pytest.mark.parametrize("seed", draws(range(5)))
def test_all_arrive(name, seed):
    """Twenty robots, shared manoeuvres."""
    run = simulate(build(name, {}, seed=seed), METHODS["nao_shared"])
    assert np.all(np.isfinite(run.arrived))


def test_the_number_of_threads_changes_no_target():
    scenario = build("random_goals", {"robots": 600, "side": 80}, seed=2)
    found = []
    for threads in (1, 2, 3):
        guidance = guidance_in(scenario, threads)
        for step in range(3):
            guidance.update(0.1 * step, 0.1)
            guide, push = guidance.guide, np.random.default_rng(step).uniform(-1.0, 1.0, (600, 3))
            guide.position[:], guide.velocity[:] = integrate(guide.position, guide.velocity, push, 0.1)
        found.append(guidance.guide.target.copy())
    np.testing.assert_array_equal(found[1], found[0])
    np.testing.assert_array_equal(found[2], found[0])
    assert np.any(found[0] != guidance.guide.goal)
