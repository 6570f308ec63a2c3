"""Right of way among robots: those that share manoeuvres do not lock, and two that observe each other pass a door."""

import pickle

import numpy as np
import pytest
from draws import draws
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from slalom import (
    METHODS,
    Ball,
    Disc,
    Fleet,
    Limits,
    Navigator,
    PathGoal,
    Polyline,
    State,
    Stationary,
    Tracks,
    Union,
    routes,
)
from slalom.kernels.arrays import zero_records
from slalom.kernels.decision.right_of_way import depth_on_way, orthonormalise
from slalom.kernels.decision.tables import Claims, Robot
from slalom.obstacle import Obstacle
from slalom.sim.measure.closest_approach import METRIC
from slalom.sim.run.states import integrate

SHARED, LIMITS, DT, RADIUS = METHODS["nao_shared"], Limits(1.5, 2.0), 0.1, 0.3


def on_circle(n: int, radius: float) -> np.ndarray:
    angles = 2.0 * np.pi * np.arange(n) / n
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def on_sphere(n: int, radius: float, seed: int) -> np.ndarray:
    rng, places = np.random.default_rng(seed), [np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])]
    while len(places) < n:
        one = rng.normal(size=3)
        one /= np.linalg.norm(one)
        if radius * min(np.linalg.norm(one - each) for each in places) > 1.2:
            places.append(one)
    return radius * np.array(places)


def driven(fleet: Fleet, starts: np.ndarray, ends: np.ndarray, until: float, **to: object) -> tuple[float, float]:
    """The time [s] at which all are at their ends, inf if never, and the least clearance [m] at the steps."""
    positions, velocities, least = starts, np.zeros_like(starts), np.inf
    same = fleet.members.worlds[:, None] == fleet.members.worlds
    for k in range(round(until / DT)):
        decided = fleet.step(k * DT, positions, velocities, **(to or {"targets": ends}))
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
        gaps = np.linalg.norm(positions[:, None] - positions, axis=-1) - 2.0 * RADIUS
        np.fill_diagonal(gaps, np.inf)
        least = min(least, float(gaps[same].min()))
        if np.linalg.norm(positions - ends, axis=1).max() <= 0.3:
            return (k + 1) * DT, least
    return np.inf, least


@pytest.mark.parametrize("robots", draws([2, 3, 4, 6, 8, 10], 3))
def test_robots_change_sides_on_an_exact_circle(robots: int) -> None:
    starts = on_circle(robots, 3.0)
    fleet = Fleet(SHARED, Disc(RADIUS), LIMITS, robots=robots, guided=False)
    time, least = driven(fleet, starts, -starts, 30.0)
    assert time < 20.0
    assert least >= 0.0


@pytest.mark.parametrize("robots", draws([2, 4, 8], 2))
def test_balls_change_sides_through_one_point(robots: int) -> None:
    """Two of them are exactly one above the other."""
    starts = on_sphere(robots, 4.0, seed=robots)
    time, least = driven(Fleet(SHARED, Ball(RADIUS), LIMITS, robots=robots), starts, -starts, 30.0)
    assert time < 15.0
    assert least >= 0.0


@pytest.mark.parametrize("space", [False, True])
def test_robots_of_many_processes_arrive(space: bool) -> None:
    """Each is a fleet of its own; they take turns, and send each other manoeuvres as bytes."""
    starts = on_sphere(5, 3.0, seed=1) if space else on_circle(5, 3.0)
    n, shape = len(starts), Ball(RADIUS) if space else Disc(RADIUS)
    fleets = [Fleet(SHARED, shape, LIMITS, robots=1) for _ in range(n)]
    positions, velocities, sent = starts, np.zeros_like(starts), [pickle.dumps(())] * n
    for k in range(200):
        applied = np.zeros_like(starts)
        for i in np.roll(np.arange(n), k):
            others = [one for j in range(n) if j != i for one in pickle.loads(sent[j])]
            row = slice(i, i + 1)
            decided = fleets[i].step(k * DT, positions[row], velocities[row], -starts[row], others=others)
            applied[row], sent[i] = decided.accelerations, pickle.dumps(fleets[i].manoeuvres())
        positions, velocities = integrate(positions, velocities, applied, DT)
        gaps = np.linalg.norm(positions[:, None] - positions, axis=-1) + 10.0 * np.eye(n)
        assert gaps.min() >= 2.0 * RADIUS - METRIC
    assert np.linalg.norm(positions + starts, axis=1).max() <= 0.25


def test_robots_on_paths_pass_a_doorway_in_both_directions() -> None:
    walls = Union((Polyline([(0.0, 0.7), (0.0, 4.0)], 0.05), Polyline([(0.0, -0.7), (0.0, -4.0)], 0.05)))
    door = [Obstacle(walls, Stationary((0.0, 0.0)), "walls")]
    starts = np.array([(side * x, y) for side in (-1.0, 1.0) for x, y in ((2.0, 0.0), (2.5, 1.2), (2.5, -1.2))])
    ends = starts * (-1.0, 1.0)
    paths = [PathGoal([p, (np.sign(p[0]), 0.0), (-np.sign(p[0]), 0.0), q]) for p, q in zip(starts, ends)]
    fleet = Fleet(SHARED, Disc(RADIUS), LIMITS, robots=6, obstacles=door)
    time, least = driven(fleet, starts, ends, 60.0, paths=paths)
    assert time < 40.0
    assert least >= 0.0


def test_a_robot_gets_out_of_a_ring_of_robots_at_their_goals() -> None:
    """The ring makes place, and closes again."""
    ring = on_circle(8, 0.95)
    starts, ends = np.concatenate([[(0.0, 0.0)], ring]), np.concatenate([[(4.0, 0.3)], ring])
    fleet = Fleet(SHARED, Disc(RADIUS), LIMITS, robots=9, guided=False)
    time, least = driven(fleet, starts, ends, 40.0)
    assert time < 30.0
    assert least >= 0.0


def test_claims_change_no_bit_with_threads() -> None:
    starts = on_circle(30, 9.0)
    runs = []
    for threads in (1, 3):
        fleet = Fleet(SHARED, Disc(RADIUS), LIMITS, robots=30, guided=False, threads=threads)
        positions, velocities = starts, np.zeros_like(starts)
        for k in range(90):
            decided = fleet.step(k * DT, positions, velocities, -starts)
            positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
        runs.append(positions)
    assert np.array_equal(*runs)


def test_guided_fleets_claim_no_ways() -> None:
    starts = on_circle(6, 3.0)
    fleet = Fleet(SHARED, Disc(RADIUS), LIMITS, robots=6)
    for k in range(40):
        # The robots are kept at their places.
        fleet.step(k * DT, starts, np.zeros_like(starts), -starts)
        assert not len(fleet.right_of_way.claims(fleet.table).rank)


def test_the_robot_that_is_not_at_its_goal_has_the_right_of_way() -> None:
    """Then the one that has never been there, then the nearer one; ways grow with the time for which it is held up."""
    positions, targets = (
        np.array([(0.0, 0.0), (0.0, 5.0), (0.0, 10.0)]),
        np.array([(0.0, 0.0), (9.0, 5.0), (4.0, 10.0)]),
    )
    fleet = Fleet(SHARED, Disc(RADIUS), LIMITS, robots=3, guided=False)
    widths = []
    for k in range(40):
        fleet.step(k * DT, positions, np.zeros_like(positions), targets)
        claims = fleet.right_of_way.claims(fleet.table)
        widths.append(claims.width.max() if len(claims.width) else 0.0)
        assert fleet.table.each["rank"].tolist() == [2, 1, 0]
    begin = int(np.argmax(np.array(widths) > 0.0))
    assert begin * DT == pytest.approx(1.5 * 1.5 / 2.0, abs=2.0 * DT)
    assert np.diff(widths[begin:]) == pytest.approx(0.03 * 1.5 * DT)
    assert sorted(claims.rank.tolist()) == [0, 1]
    positions = np.array([(3.0, 0.0), (0.0, 5.0), (0.0, 10.0)])
    fleet.step(4.0, positions, np.zeros_like(positions), targets)
    assert fleet.table.each["rank"].tolist() == [2, 1, 0]


VECTORS = arrays(np.float64, 3, elements=st.floats(-5.0, 5.0).map(lambda x: round(x, 3)))


@settings(max_examples=60, deadline=None)
@given(place=VECTORS, begin=VECTORS, way=VECTORS, width=st.floats(0.1, 3.0), d=st.sampled_from([2, 3]))
def test_the_depth_on_a_way_is_that_at_its_nearest_sample(
    place: np.ndarray, begin: np.ndarray, way: np.ndarray, width: float, d: int
) -> None:
    begin, way = np.where(np.arange(3) < d, begin, 0.0), np.where(np.arange(3) < d, way, 0.0)
    claims = Claims(np.array([0, 1]), begin[None], way[None], np.array([width]), np.array([0]))
    robot, nearest = zero_records(Robot, 1), np.zeros(d)
    robot["radius"] = RADIUS
    depth = depth_on_way(robot[0], place[:d], claims, 0, nearest)
    samples = begin + np.linspace(0.0, 1.0, 2001)[:, None] * way
    least = np.linalg.norm(samples[:, :d] - place[:d], axis=1).min()
    assert depth == pytest.approx(width + RADIUS - least, abs=1e-5)
    assert np.linalg.norm(nearest - place[:d]) == pytest.approx(width + RADIUS - depth, abs=1e-12)


@settings(max_examples=100, deadline=None)
@given(first=VECTORS, second=VECTORS, d=st.sampled_from([2, 3]))
def test_axes_off_a_way_are_orthonormal(first: np.ndarray, second: np.ndarray, d: int) -> None:
    axes = np.zeros((3, 3))
    axes[0, :d], axes[1, :d] = first[:d], second[:d]
    given_axes = axes.copy()
    orthonormalise(axes, d)
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-9)
    if np.linalg.norm(given_axes[0]) > 1e-6:
        assert axes[0] == pytest.approx(given_axes[0] / np.linalg.norm(given_axes[0]))
    if d == 2:
        assert np.all(axes[:2, 2] == 0.0)


def door(width: float, angle: float) -> tuple[list[Obstacle], np.ndarray, np.ndarray]:
    """The walls beside a door, and the starts and ends of two robots that meet in it exactly symmetrically."""
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    sides = [np.array([(0.0, side * width / 2.0), (0.0, side * 6.0)]) @ turn for side in (1, -1)]
    starts = np.array([(-4.0, 0.4), (4.0, -0.4)]) @ turn
    return [Obstacle(Polyline(side), Stationary((0.0, 0.0))) for side in sides], starts, starts[::-1] * 1.0


@pytest.mark.parametrize("method", draws(["nao", "ao", "vo", "rvo", "nao_shared"], 2))
@pytest.mark.parametrize("place", draws([(0.85, 0.0), (1.0, 0.5 * np.pi), (1.2, 1.0)], 2))
def test_two_robots_that_meet_in_a_door_pass_it(place: tuple[float, float], method: str) -> None:
    walls, starts, ends = door(*place)
    paths = [PathGoal(points, tolerance=0.2) for points in routes(starts, ends, RADIUS, walls)]
    fleet = Fleet(METHODS[method], Disc(RADIUS), LIMITS, robots=2, obstacles=walls)
    time, least = driven(fleet, starts, ends, 30.0, paths=paths)
    assert time < 30.0
    assert least >= 0.0


@pytest.mark.parametrize("place", draws([(0.85, 0.0), (1.0, 0.5 * np.pi), (1.2, 1.0)], 2))
def test_two_navigators_that_observe_each_other_pass_a_door(place: tuple[float, float]) -> None:
    walls, starts, ends = door(*place)
    paths = [PathGoal(points, tolerance=0.2) for points in routes(starts, ends, RADIUS, walls)]
    robot, made = Navigator(METHODS["nao"], Disc(RADIUS), LIMITS), [None, None]
    positions, velocities = starts, np.zeros_like(starts)
    for k in range(300):
        seen = [Tracks(positions[j : j + 1], velocities[j : j + 1], RADIUS, k * DT, ids=["other"]) for j in (1, 0)]
        states = [State(*each) for each in zip(positions, velocities)]
        made = [
            robot.decide(state, walls, path, robots=other, now=k * DT, previous=before)
            for state, path, other, before in zip(states, paths, seen, made)
        ]
        each = np.array([one.manoeuvre.mean_acceleration(k * DT, DT) for one in made])
        positions, velocities = integrate(positions, velocities, each, DT)
        assert np.linalg.norm(positions[0] - positions[1]) >= 2.0 * RADIUS
    assert np.linalg.norm(positions - ends, axis=1).max() <= 0.3
