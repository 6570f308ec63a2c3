"""Rows that change no choice are left out: those out of reach, and all but one of a motion along a line."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from draws import draws
from hypothesis import given, strategies as st

import slalom
from slalom import (
    Circular,
    Disc,
    Goal,
    Limits,
    Navigator,
    Obstacle,
    ObstacleTable,
    ObstacleWindow,
    Outcome,
    Polyline,
    Rectangle,
    Sampled,
    State,
    Stationary,
)
from slalom.decision import tables
from slalom.decision.tables import GrownBodies, Skeletons, response_table
from slalom.model.path import straight_from
from slalom.model.response import AccelerateThenStop
from slalom.obstacle.pieces import Reach

PERIOD = 0.1


class Scene(NamedTuple):
    """One robot among walls, cars that turn, and people."""

    robot: Navigator
    state: State
    goal: Goal
    obstacles: ObstacleTable | list[ObstacleTable]


def scene(seed: int, method: str, stop: bool) -> Scene:
    """Walls on 30 m x 30 m around a free place, and bodies on circles."""
    rng = np.random.default_rng(seed)
    walls, movers = [], []
    for _ in range(40):
        middle, along = rng.uniform(-15.0, 15.0, 2), rng.uniform(-3.0, 3.0, 2)
        if np.linalg.norm(middle) > 5.0:
            walls.append(Obstacle(Polyline((middle - along, middle + along), 0.05), Stationary((0.0, 0.0))))
    for k in range(12):
        path = Circular(rng.uniform(-8.0, 8.0, 2), rng.uniform(5.0, 9.0), rng.uniform(1.0, 4.0), rng.uniform(0.0, 6.0))
        if np.linalg.norm(path.position(0.0)) > 3.5:
            movers.append(Obstacle(Rectangle(3.0, 1.6) if k % 2 else Disc(0.4), path, heading="motion"))
    robot = Navigator(slalom.method(method), Disc(0.3), Limits(3.0, 2.0), detours=(0.6, -0.6))
    goal = Goal(Stationary(rng.uniform(-12.0, 12.0, 2)), 0.5, stop=stop)
    return Scene(robot, State((0.0, 0.0), rng.uniform(-1.0, 1.0, 2)), goal, ObstacleTable([*walls, *movers]))


def drive(s: Scene, steps: int) -> Iterator[tuple[object, ...]]:
    """What is decided at each step of a crossing."""
    state, decision = s.state, None
    for k in range(steps):
        now = PERIOD * k
        decision = s.robot.decide(state, s.obstacles, s.goal, now=now, previous=decision)
        a = decision.manoeuvre.mean_acceleration(now, PERIOD)
        state = State(state.position + PERIOD * state.velocity + 0.5 * PERIOD**2 * a, state.velocity + PERIOD * a, a)
        yield decision.outcome, repr(decision.manoeuvre.response), *decision.manoeuvre.control.tolist()


def everywhere(bodies: GrownBodies) -> GrownBodies:
    """The same bodies with balls of which nothing is known: no row and no time is left out."""
    balls, body_balls = bodies.obstacles.balls.copy(), bodies.obstacles.body_balls.copy()
    balls[:, 3], body_balls[:, 3] = np.inf, np.inf
    return bodies._replace(obstacles=bodies.obstacles._replace(balls=balls, body_balls=body_balls))


@pytest.mark.parametrize(("method", "stop"), [("nao", False), ("nao", True), ("vo", True)])
@pytest.mark.parametrize("seed", draws(range(3)))
def test_decisions_are_those_with_all_rows(seed, method, stop, monkeypatch):
    """In a closed loop among walls and movers, where the preferred control is not always free."""
    culled, made = list(drive(scene(seed, method, stop), 40)), Skeletons.grown_bodies

    def unculled(self: Skeletons, kind: int, obstacles: ObstacleWindow, *, detours: bool, around: Reach) -> GrownBodies:
        return everywhere(made(self, kind, obstacles, detours=detours))

    monkeypatch.setattr(Skeletons, "grown_bodies", unculled)
    assert culled == list(drive(scene(seed, method, stop), 40))
    assert {row[0] for row in culled} != {Outcome.CLEAR}


@pytest.mark.parametrize(("method", "horizons"), [("nao", None), ("nao", slalom.SafeTime(2.0)), ("vo", None)])
@pytest.mark.parametrize("seed", draws(range(2)))
def test_one_table_decides_as_its_parts(seed, method, horizons):
    """The pieces of a single table are cut to the window for each robot, those of parts before they are joined.

    Some obstacles appear late, or leave, so that windows begin and end within their pieces.
    """
    s = scene(seed, method, stop=True)
    robot = replace(s.robot, horizons=horizons)
    tracks = [Sampled([0.4 * k, 6.0 + k], [(-6.0 + 2.0 * k, 3.0), (5.0, -3.0 - k)]) for k in range(4)]
    every = [*s.obstacles, *(Obstacle(Disc(0.4), one, after_end="leaves") for one in tracks)]
    parts = [ObstacleTable(every[:9]), ObstacleTable(every[9:])]
    together, apart = (list(drive(s._replace(robot=robot, obstacles=o), 40)) for o in (ObstacleTable(every), parts))
    assert together == apart


@pytest.mark.parametrize("turning", [False, True])
@pytest.mark.parametrize("seed", draws(range(4)))
def test_decisions_are_those_with_every_piece_of_a_line(seed, turning, monkeypatch):
    """A robot that brakes moves along a line: obstacles at rest have one segment there, in place of one each period."""
    s = scene(seed, "nao", stop=False)
    obstacles = s.obstacles if turning else ObstacleTable([o for o in s.obstacles if isinstance(o.shape, Polyline)])
    by_lines, by_pieces = s.robot, replace(s.robot)
    state, decision, stops = s.state, None, 0
    for k in range(25):
        now = PERIOD * k
        found = by_lines.decide(state, obstacles, s.goal, now=now, previous=decision)
        if k == 0:
            response_table.cache_clear()
            monkeypatch.setattr(tables, "straight_from", len)
        exact = by_pieces.decide(state, obstacles, s.goal, now=now, previous=decision)
        assert found.outcome is exact.outcome
        assert found.manoeuvre.response == exact.manoeuvre.response
        change, least = (np.linalg.norm(one.manoeuvre.control - one.preferred) for one in (found, exact))
        assert change == pytest.approx(least, rel=0.0, abs=1e-5)
        stops += isinstance(found.manoeuvre.response, AccelerateThenStop)
        decision, a = found, found.manoeuvre.mean_acceleration(now, PERIOD)
        state = State(state.position + PERIOD * state.velocity + 0.5 * PERIOD**2 * a, state.velocity + PERIOD * a, a)
    response_table.cache_clear()
    assert stops > 0


@given(st.integers(0, 2**32 - 1))
def test_a_line_is_found_where_it_begins(seed):
    """A curve, and pieces at random rates along one line after it; a way back ends a line."""
    rng = np.random.default_rng(seed)
    curved, along, c = int(rng.integers(1, 4)), int(rng.integers(1, 6)), int(rng.integers(2, 4))
    curve = np.cumsum(rng.uniform(0.1, 1.0, (curved, 4, c)) * rng.choice([-1.0, 1.0], (curved, 4, c)), axis=0)
    shares = np.sort(rng.uniform(0.0, 1.0, 4 * along)).reshape(along, 4, 1)
    line = rng.uniform(-1.0, 1.0, c) + shares * rng.uniform(1.0, 2.0, c)
    assert straight_from(np.concatenate([curve, line])) == curved
    back = line.copy()
    back[-1, 3] = line[0, 0] - 1.0
    assert straight_from(np.concatenate([curve, back])) > curved
    assert straight_from(curve) == curved
    assert straight_from(np.ones((along, 4, c))) == 0


def distances(obstacle: Obstacle, position: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Distance [m] of a point from a wall of one edge at rest, or from the disc about another obstacle."""
    if isinstance(obstacle.shape, Polyline):
        a, b = obstacle.shape.points
        foot = a + np.clip((position - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0) * (b - a)
        return np.full(len(times), np.linalg.norm(position - foot) - obstacle.shape.radius)
    return np.linalg.norm(obstacle.trajectory.position(times) - position, axis=1) - obstacle.shape.bounding_radius


@given(st.integers(0, 2**32 - 1))
def test_bodies_within_reach_stay(seed):
    """With the same pieces. A body that is left out is farther away than what is asked for at all times."""
    rng = np.random.default_rng(seed)
    s = scene(int(rng.integers(20)), "nao", False)
    window, shape = ObstacleWindow(s.obstacles, rng.uniform(0.0, 30.0), 6.0), s.robot.robot
    reach = Reach(rng.uniform(-15.0, 15.0, 2), rng.uniform(0.0, 6.0), rng.uniform(0.0, 1.0))
    every, near = window.bodies(shape), window.bodies_near(shape, reach)
    rows = np.isin(every.owner[every.pieces.body], near.owner)
    np.testing.assert_array_equal(every.owner[every.pieces.body[rows]], near.owner[near.pieces.body])
    for name in ("times", "points", "radius", "growth", "turns"):
        np.testing.assert_array_equal(getattr(every.pieces, name)[rows], getattr(near.pieces, name))
    stays = np.isin(every.owner, near.owner)
    for name in ("each", "hull", "body_balls"):
        np.testing.assert_array_equal(getattr(every, name)[stays], getattr(near, name))
    times = window.start + np.linspace(0.0, 6.0, 40)
    for k in np.setdiff1d(every.owner, near.owner):
        away = distances(window.obstacles[k], reach.position, times) - shape.bounding_radius
        assert away.min() > reach.distance + reach.clearance


def test_walls_far_away_are_left_out():
    """Of 40 walls on 30 m x 30 m few are within 2 m."""
    s = scene(0, "nao", False)
    window, reach = ObstacleWindow(s.obstacles, 0.0, 6.0), Reach(np.zeros(2), 2.0, 0.05)
    assert len(window.bodies_near(s.robot.robot, reach).owner) < 0.5 * len(window.bodies(s.robot.robot).owner)


def test_a_path_beyond_the_known_bodies_is_not_kept():
    """The manoeuvre of a fast robot, after its limits were lowered: where it leads, bodies may have been left out.

    Of a single table no body is left out.
    """
    state, goal = State((0.0, 0.0), (0.0, 0.0)), Goal(Stationary((90.0, 0.0)), 0.5)
    walls = ObstacleTable(
        [Obstacle(Polyline(((20.0, y), (20.0, y + 1.0)), 0.05), Stationary((0.0, 0.0))) for y in (3, 9)]
    )
    fast = Navigator(slalom.method("nao"), Disc(0.3), Limits(5.0, 4.0), patience=100.0)
    slow = Navigator(slalom.method("nao"), Disc(0.3), Limits(0.3, 4.0), patience=100.0)
    decision = fast.decide(state, walls, goal)
    parts = [ObstacleTable([wall]) for wall in walls]
    for robot, around, kept in ((fast, parts, True), (slow, parts, False), (slow, walls, True)):
        again = robot.decide(state, around, goal, previous=decision)
        assert (again.outcome is Outcome.KEPT) == kept
