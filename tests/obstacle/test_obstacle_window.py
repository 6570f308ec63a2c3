"""The pieces of obstacles over a window of time are the obstacles."""

import pickle
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from parts import TRAJECTORIES, disc_or_ball

from slalom import (
    METHODS,
    AcceleratingBriefly,
    Acceleration,
    AtConstantAcceleration,
    AtConstantTurn,
    AtConstantVelocity,
    BoundedError,
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    ControlObstacle,
    Disc,
    Forecast,
    GaussianError,
    Goal,
    Limits,
    Navigator,
    Obstacle,
    ObstacleTable,
    ObstacleWindow,
    PiecewisePolynomial,
    Polyline,
    Rectangle,
    State,
    Stationary,
    Tracks,
    Trajectory,
    Uncertainty,
)
from slalom.base.tolerances import INTERPOLATION
from slalom.kernels.arrays import Bodies
from slalom.kernels.decision.tables import AtHorizon
from slalom.obstacle.pieces import Reach
from slalom.peers import contender

WINDOWS = ((-0.8, 0.5), (0.0, 4.0), (1.0, 2.0), (3.3, 3.5), (6.5, 4.0), (30.0, 4.0))
"""[s] Start and length; the last but one outlives the obstacles that end at 7 s, the last follows them."""
SHARES = np.linspace(0.0, 1.0, 9)
BERNSTEIN = np.stack([(1 - SHARES) ** 3, 3 * SHARES * (1 - SHARES) ** 2, 3 * SHARES**2 * (1 - SHARES), SHARES**3])
ROUNDING = 1e-9


def assert_pieces_follow(bodies: Bodies, body: int, track: Trajectory, start: float, horizon: float) -> None:
    """The pieces of a body cover the part of the window in which its obstacle exists, and follow its trajectory."""
    rows = np.flatnonzero(bodies.pieces.body == body)
    times = bodies.pieces.times[rows]
    first, last = max(track.span[0], start) - start, min(track.span[1], start + horizon) - start
    assert times[0, 0] <= first + ROUNDING
    assert times[-1, 1] >= last - ROUNDING
    np.testing.assert_allclose(times[1:, 0], times[:-1, 1], atol=ROUNDING)
    for row, (begin, end) in zip(rows, times):
        elapsed = begin + (end - begin) * SHARES
        points = np.einsum("kd,ks->sd", bodies.pieces.points[row], BERNSTEIN)
        expected = track.position(np.clip(start + elapsed, *track.span))
        error = getattr(track, "tolerance", INTERPOLATION) + ROUNDING
        assert np.linalg.norm(points - expected, axis=1).max() <= error


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("uncertain", [False, True])
@pytest.mark.parametrize(("start", "horizon"), WINDOWS)
def test_pieces_of_a_window_are_the_trajectory(start: float, horizon: float, uncertain: bool, d: int) -> None:
    """Of each obstacle alone and of all together; an obstacle that does not exist within the window has no piece."""
    error = BoundedError(0.1, 0.05) if uncertain else None
    tracks = [track(d) for track in TRAJECTORIES.values()]
    obstacles = [Obstacle(disc_or_ball(0.5, d), track, uncertainty=error, after_end="leaves") for track in tracks]
    robot = disc_or_ball(0.3, d)
    for some in ([obstacle] for obstacle in obstacles):
        bodies = ObstacleWindow(some, start, horizon).bodies(robot)
        track = some[0].trajectory
        if track.span[0] < start + horizon and track.span[1] > start:
            assert_pieces_follow(bodies, 0, track, start, horizon)
        else:
            assert len(bodies.pieces.body) == 0
    known = {k for k, track in enumerate(tracks) if track.span[0] < start + horizon and track.span[1] > start}
    together = (obstacles, ObstacleTable(obstacles), [ObstacleTable(obstacles[:3]), *obstacles[3:]])
    for many in together[: 1 if uncertain else 3]:
        bodies = ObstacleWindow(many, start, horizon).bodies(robot)
        there = set(bodies.pieces.body.tolist())
        for body in there:
            assert_pieces_follow(bodies, body, tracks[bodies.owner[body]], start, horizon)
        assert {int(bodies.owner[body]) for body in there} == known


@pytest.mark.parametrize("d", [2, 3])
def test_a_window_moved_along_several_stretches_has_the_same_pieces(d: int) -> None:
    """The pieces of a table that serves many decisions are those of the obstacles at each of them."""
    smooth = [Obstacle(disc_or_ball(0.5, d), TRAJECTORIES[name](d)) for name in ("circular", "circular_clockwise")]
    robot, table = disc_or_ball(0.3, d), ObstacleTable(smooth)
    for start in (*np.arange(0.0, 40.0, 0.7), 16.0, 48.0 - 1e-15, 0.1 * 160):
        bodies = ObstacleWindow(table, start, 4.0).bodies(robot)
        for body in range(2):
            assert_pieces_follow(bodies, body, smooth[body].trajectory, start, 4.0)
        assert np.array_equal(bodies.heads, np.flatnonzero(np.diff(bodies.pieces.body, prepend=-1)))


ROBOT = Rectangle(0.8, 0.4)
GOAL = Goal(Stationary((12.0, 0.0)), 0.5)
STATE = State((0.0, 0.0), (1.0, 0.0))


def street() -> list[Obstacle]:
    """Walls, cars that turn, and one that exists only for a while."""
    return [
        Obstacle(Polyline([(0.0, 3.0), (12.0, 3.0)]), Stationary((0.0, 0.0))),
        Obstacle(Rectangle(2.0, 1.0), ConstantVelocity((8.0, 0.3), (-0.6, 0.0)), heading="motion"),
        Obstacle(Rectangle(2.0, 1.0), Circular((5.0, -3.0), 2.0, 1.0, 0.3), heading="motion"),
        Obstacle(Disc(0.4), Briefly((3.0, -0.2), (0.3, 0.1)), after_end="leaves"),
        Obstacle(Polyline([(0.0, -4.0), (12.0, -4.0)]), Stationary((0.0, 0.0))),
    ]


class Briefly(ConstantVelocity):
    """Exists from 2 to 9 s."""

    @property
    def span(self) -> tuple[float, float]:
        return 2.0, 9.0


@pytest.mark.parametrize("method", ["nao", "ao", "vo", "nao@present"])
@pytest.mark.parametrize("now", [0.0, 4.5, 23.95, 24.0])
def test_tables_decide_as_lists(now: float, method: str) -> None:
    """Alone, in parts, and with obstacles beside them; a table forgets nothing and knows nothing more."""
    navigator, listed = Navigator(contender(method), ROBOT, Limits(2.0, 2.0), detours=(0.5,)), street()
    expected = navigator.decide(STATE, listed, GOAL, now=now)
    whole = ObstacleTable(listed)
    for obstacles in (whole, [whole], [ObstacleTable(listed[:2]), *listed[2:4], ObstacleTable(listed[4:])]):
        for _ in range(2):
            decision = navigator.decide(STATE, obstacles, GOAL, now=now)
            assert decision.outcome is expected.outcome
            np.testing.assert_allclose(decision.manoeuvre.control, expected.manoeuvre.control, atol=1e-5)
            clearances = [each.blocked.initial_clearances for each in (decision, expected)]
            np.testing.assert_allclose(*(np.sort(each[np.isfinite(each)]) for each in clearances), atol=1e-5)


def test_obstacles_at_rest_are_made_once_for_all_time() -> None:
    """Every decision has the same pieces, those of one obstacle alone, from before the epoch to long after it."""
    walls = [Obstacle(Polyline([(k, 0.0), (k, 2.0)], 0.1), Stationary((0.5, 0.0))) for k in range(3)]
    table = ObstacleTable(walls)
    made = [ObstacleWindow(table, start, 6.0).bodies(ROBOT) for start in (-50.0, 0.0, 30.1, 1.7e9)]
    alone = ObstacleWindow(walls, 30.1, 6.0).bodies(ROBOT)
    for bodies in made:
        assert bodies.corners is made[0].corners
        np.testing.assert_array_equal(bodies.pieces.points, alone.pieces.points)
        np.testing.assert_allclose(bodies.pieces.times, alone.pieces.times, atol=1e-6)
        np.testing.assert_array_equal(bodies.heads, alone.heads)


def test_a_table_is_pickled_without_its_pieces() -> None:
    table = ObstacleTable(street())
    before = ObstacleWindow(table, 0.0, 6.0).bodies(ROBOT)
    copy = pickle.loads(pickle.dumps(table))
    assert len(pickle.dumps(table)) < 5000
    assert np.array_equal(ObstacleWindow(copy, 0.0, 6.0).bodies(ROBOT).pieces.points, before.pieces.points)


def test_an_uncertain_obstacle_in_a_table_grows_from_each_decision() -> None:
    unsure = [replace(one, uncertainty=BoundedError(0.1, 0.2)) for one in street()[1:2]]
    navigator = Navigator(METHODS["nao"], ROBOT, Limits(2.0, 2.0))
    table = ObstacleTable([*unsure, *street()[2:3]])
    for now in (0.0, 3.0):
        expected = navigator.decide(STATE, [*street()[2:3], *unsure], GOAL, now=now)
        decision = navigator.decide(STATE, table, GOAL, now=now)
        np.testing.assert_allclose(decision.manoeuvre.control, expected.manoeuvre.control, atol=1e-5)


def test_the_fall_back_considers_only_known_obstacles() -> None:
    """What a robot inside an obstacle avoids while it leaves: not what will appear later and is not known."""
    inside = Obstacle(Disc(0.5), Stationary((0.1, 0.0)))
    navigator = Navigator(contender("nao@present"), ROBOT, Limits(2.0, 2.0))
    later = Obstacle(Disc(0.4), Briefly((-0.2, 0.1), (0.0, 0.0)))
    alone = navigator.decide(STATE, [inside], GOAL)
    for obstacles in ([inside, later], ObstacleTable([inside, later])):
        decision = navigator.decide(STATE, obstacles, GOAL)
        assert decision.outcome is alone.outcome
        assert np.array_equal(decision.manoeuvre.control, alone.manoeuvre.control)


def crowd(rng: np.random.Generator, d: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Positions, velocities, accelerations and radii of some discs away from the origin."""
    places = rng.uniform(-9.0, 9.0, (30, d))
    places = places[np.linalg.norm(places, axis=1) > 2.0]
    motions = rng.normal(size=(2, *places.shape))
    return places, motions[0], 0.5 * motions[1], rng.uniform(0.1, 0.6, len(places))


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("unsure", [None, BoundedError(0.05, 0.1), GaussianError(0.05, 0.05)])
@pytest.mark.parametrize("method", ["nao", "ao", "avo", "vo"])
def test_tracks_decide_as_obstacles(method: str, unsure: Uncertainty | None, d: int) -> None:
    """At the time of the observation and later."""
    places, velocities, accelerations, radii = crowd(np.random.default_rng(d), d)
    robot, zero = Navigator(METHODS[method], disc_or_ball(0.3, d), Limits(2.0, 2.0)), np.zeros(d)
    state, goal = State(zero, 0.5 * np.eye(d)[0]), Goal(Stationary(12.0 * np.eye(d)[0]), 0.5)
    forecast = AtConstantVelocity() if method in ("vo", "avo") else AtConstantAcceleration()
    tracks = Tracks(
        places,
        velocities,
        radii,
        accelerations=accelerations,
        uncertainty=unsure,
        forecast=AtConstantAcceleration(),
        braking=0.0,
    )
    obstacles = [
        Obstacle(disc_or_ball(r, d), forecast(ConstantAcceleration(p, v, a), 0.0), uncertainty=unsure)
        for p, v, a, r in zip(places, velocities, accelerations, radii)
    ]
    expected = robot.decide(state, obstacles, goal)
    decision = robot.decide(state, tracks, goal)
    assert decision.outcome is expected.outcome
    np.testing.assert_allclose(decision.manoeuvre.control, expected.manoeuvre.control, atol=1e-9)
    if unsure is None:
        expected, decision = (robot.decide(state, some, goal, now=0.4) for some in (obstacles, tracks))
        assert decision.outcome is expected.outcome
        np.testing.assert_allclose(decision.manoeuvre.control, expected.manoeuvre.control, atol=1e-9)


@pytest.mark.parametrize("forecast", [AtConstantTurn(), AcceleratingBriefly(0.5), None])
def test_tracks_of_any_forecast_are_its_obstacles(forecast: Forecast | None) -> None:
    """As arrays where the forecast allows, one by one where not; grown by a robot of any shape."""
    places, velocities, accelerations, radii = crowd(np.random.default_rng(5), 2)
    tracks = Tracks(places, velocities, radii, 1.0, accelerations=accelerations, forecast=forecast)
    found = ObstacleWindow(tracks, 1.3, 4.0)
    expected = ObstacleWindow(list(tracks.obstacles), 1.3, 4.0)
    state, answer = State((0.0, 0.0), (0.5, 0.0)), Acceleration()
    controls = np.random.default_rng(6).normal(size=(20, 2))
    some = [ControlObstacle(answer, state, window, ROBOT).clearances(controls) for window in (found, expected)]
    np.testing.assert_allclose(*some, atol=1e-8)


def test_an_old_uncertain_track_is_wider() -> None:
    """Its uncertainty grows from the observation on, not from the decision."""
    tracks = Tracks([(6.0, 0.0)], [(0.0, 0.0)], 0.5, t=1.0, uncertainty=BoundedError(0.1, 0.3))
    for now in (1.0, 1.5, 4.0):
        blocked = ControlObstacle(Acceleration(), STATE, ObstacleWindow(tracks, now, 2.0), Disc(0.2))
        assert blocked.initial_clearances[0] == pytest.approx(6.0 - 0.5 - 0.2 - 0.1 - 0.3 * (now - 1.0), abs=1e-9)


def test_shorter_horizons_hold_for_tracks() -> None:
    places, velocities, _, radii = crowd(np.random.default_rng(7), 2)
    tracks = Tracks(places, velocities, radii)
    horizons = np.linspace(0.0, 4.0, len(tracks))
    some = [ObstacleWindow(each, 0.0, 4.0, horizons) for each in (tracks, list(tracks.obstacles))]
    pieces = [window.bodies(ROBOT).pieces for window in some]
    np.testing.assert_allclose(pieces[0].times, pieces[1].times)
    assert pieces[0].times[:, 1].max() <= 4.0


@pytest.mark.parametrize("absent", [[0], [1, 3], [2, 4], [0, 1, 2, 3, 4, 5]])
def test_a_window_without_some_tracks_is_the_window_without_their_obstacles(absent: list[int]) -> None:
    """Tracks after a wall: the numbers of those that are left do not change, nor do their control obstacles."""
    rng = np.random.default_rng(3)
    wall = Obstacle(Polyline(np.array([[0.0, 4.0], [9.0, 5.0]]), 0.1), Stationary((0.0, 0.0)))
    tracks = Tracks(rng.uniform(2.0, 6.0, (5, 2)), rng.uniform(-1.0, 1.0, (5, 2)), 0.5, 0.0)
    state = State((0.0, 0.0), (1.0, 0.0))
    together = ObstacleWindow([wall, tracks], 0.0, 4.0).without(np.array(absent))
    apart = ObstacleWindow([wall, *tracks.obstacles], 0.0, 4.0).without(np.array(absent))
    controls = rng.uniform(-2.0, 2.0, (200, 2))
    first, second = (ControlObstacle(Acceleration(), state, each, Disc(0.3)) for each in (together, apart))
    np.testing.assert_allclose(
        [first.times_to_collision(u) for u in controls], [second.times_to_collision(u) for u in controls], atol=1e-6
    )
    assert np.flatnonzero(np.isinf(first.initial_clearances)).tolist() == absent


def at_horizon(window: ObstacleWindow) -> AtHorizon:
    """The obstacles around which detours lead, as the bodies of a robot tell them."""
    return window.at_horizon(window.bodies(Rectangle(0.6, 0.4)))


@pytest.mark.parametrize("forecast", [AtConstantTurn(), AcceleratingBriefly(0.5), None])
@pytest.mark.parametrize("start", [1.0, 1.3, 4.0])
def test_balls_at_the_horizon_are_those_of_the_obstacles_one_by_one(start: float, forecast: Forecast | None) -> None:
    """Of tracks, tables and lists, without those that are left out, have gone, or have several parts."""
    places, velocities, accelerations, radii = crowd(np.random.default_rng(8), 2)
    tracks = Tracks(places, velocities, radii, 1.0, accelerations=accelerations, forecast=forecast)
    walls = Obstacle(Polyline([(0.0, 3.0), (12.0, 3.0), (12.0, 9.0)]), Stationary((0.0, 0.0)))
    given = [*street(), walls, Obstacle(Disc(0.3), Stationary((1.0, 2.0)), contact_at_rest=False)]
    every, without = [*given, *tracks.obstacles], [1, 7, 9]
    end = start + 4.0
    fence = Obstacle(Polyline([(0.0, 5.0), (4.0, 5.0)], 0.1), Stationary((0.0, 0.0)))
    assert len(at_horizon(ObstacleWindow([fence], start, 4.0)).corners) == 4
    kept = [k for k, o in enumerate(every) if len(o.shape.parts) == 1 and o.contact_at_rest and k not in without]
    kept = [k for k in kept if every[k].exists(end)]
    for together in (every, [ObstacleTable(given), tracks], [*given, tracks], [ObstacleTable(given), *every[7:]]):
        found, corners = at_horizon(ObstacleWindow(together, start, 4.0).without(np.array(without)))
        order = np.lexsort(found["position"].T)
        expected = np.array([every[k].trajectory.position(end) for k in kept])
        ball = np.array([every[k].shape.bounding_radius for k in kept])
        rows = np.lexsort(np.hstack([expected, np.zeros((len(kept), 1))]).T)
        np.testing.assert_allclose(found["position"][order, :2], expected[rows], atol=2.0 * INTERPOLATION)
        np.testing.assert_array_equal(found["ball"][order], ball[rows])
        assert found["last"].max() <= len(corners)


def test_an_obstacle_by_its_number() -> None:
    """Obstacles and tracks are numbered one after the other; no others exist."""
    rock = Obstacle(Disc(1.0), Stationary((9.0, 9.0)))
    tracks = Tracks(np.array([[1.0, 2.0], [3.0, 4.0]]), np.zeros((2, 2)), 0.5, 0.0, ids=("a", "b"))
    window = ObstacleWindow([rock, tracks, rock], 0.0, 4.0)
    assert [window.obstacle(k).name for k in range(4)] == [each.name for each in window.obstacles]
    for outside in (-1, 4):
        with pytest.raises(IndexError, match="index: expected a number below 4"):
            window.obstacle(outside)


def test_what_covers_a_point_is_at_rest_throughout() -> None:
    """A car that stops within the window moves, whatever its last piece does."""
    stops = PiecewisePolynomial([1.0, 9.0], [[(4.0, 0.0), (1.0, 0.0)], [(5.0, 0.0), (0.0, 0.0)]])
    moving, resting = Obstacle(Disc(2.0), stops), Obstacle(Disc(2.0), Stationary((4.5, 0.0)))
    points = np.array([(4.5, 0.0), (9.0, 0.0)])
    assert ObstacleWindow([moving], 0.0, 6.0).covered(points, Disc(0.3), 0.1).tolist() == [False, False]
    assert ObstacleWindow([moving, resting], 0.0, 6.0).covered(points, Disc(0.3), 0.1).tolist() == [True, False]


@pytest.mark.parametrize("around", [None, Reach(np.zeros(2), 3.0, 0.3), Reach(np.zeros(2), 9.0, 0.3)])
def test_what_covers_a_point_is_nearer_than_the_margin(around: Reach | None) -> None:
    """Obstacles of all kinds at rest, in a table and alone, against the distance from each; points out of reach too."""
    rng = np.random.default_rng(5)
    shapes = [Disc(0.8), Rectangle(2.0, 0.5), Polyline([(-1.0, 0.0), (0.0, 1.0), (1.0, 0.0)], 0.1)]
    some = [
        Obstacle(shapes[k % 3], Stationary(rng.uniform(-6.0, 6.0, 2)), heading=float(rng.uniform(0.0, 6.0)))
        for k in range(12)
    ]
    unsure = Obstacle(Disc(0.5), Stationary((1.0, 1.0)), uncertainty=BoundedError(0.4))
    robot, points = Rectangle(0.6, 0.4), rng.uniform(-6.0, 6.0, (200, 2))
    found = ObstacleWindow([ObstacleTable(some[:8]), *some[8:], unsure], 0.0, 4.0).covered(points, robot, 0.3, around)
    each = [ObstacleWindow([one], 0.0, 4.0) for one in [*some, unsure]]
    gaps = [[float((w.distances(robot, p)[0] - w.bodies(robot).radius).min()) for w in each] for p in points]
    np.testing.assert_array_equal(found, np.array(gaps).min(axis=1) < 0.3)
    assert 20 < np.count_nonzero(found) < 180


def test_threads_share_a_table() -> None:
    """Robots of different shapes at different times, in threads that take turns as often as they can."""
    table, until = ObstacleTable([Obstacle(Disc(0.5), ConstantVelocity((5.0, 0.0), (0.1, 0.0)))]), np.ones(1)

    def radii(thread: int) -> list[float]:
        robot = Disc(0.1 * (thread + 1))
        times = [60.0 * ((k * (thread + 3)) % 7) for k in range(200)]
        return [float(table.bodies(robot, t, until, 1.0).radius[0]) for t in times]

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as pool:
            found = list(pool.map(radii, range(8)))
    finally:
        sys.setswitchinterval(before)
    assert found == [[pytest.approx(0.5 + 0.1 * (thread + 1))] * 200 for thread in range(8)]


@pytest.mark.parametrize("forecast", [None, AtConstantVelocity(), AtConstantAcceleration()], ids=str)
@pytest.mark.parametrize("start", [0.0, 1.3])
def test_many_obstacles_at_once_have_the_bodies_of_each_alone(forecast: Forecast | None, start: float) -> None:
    rule = METHODS["nao"].forecast if forecast is None else forecast
    rng = np.random.default_rng(0)
    vectors = rng.normal(0.0, 2.0, (6, 3, 2))
    corner = Polyline([(0.0, 0.0), (2.0, 0.0), (2.0, 3.0)], 0.1)
    obstacles = [
        *(Obstacle(Disc(0.2 + 0.1 * k), ConstantVelocity(p, v, 0.5)) for k, (p, v, _) in enumerate(vectors[:2])),
        Obstacle(Rectangle(2.0, 1.0), Circular((1.0, 2.0), 3.0, 1.0), heading="motion"),
        Obstacle(Rectangle(2.0, 1.0), ConstantAcceleration(*vectors[2], 0.2), heading=0.7, contact_at_rest=False),
        Obstacle(corner, Stationary(vectors[3, 0])),
    ]
    together = ObstacleWindow.predicted(obstacles, rule, start, 4.0)
    robot = Rectangle(1.0, 0.5)
    found, alone = (
        together.bodies(robot),
        [ObstacleWindow([one], start, 4.0).bodies(robot) for one in together.obstacles],
    )
    np.testing.assert_array_equal(found.pieces.times, np.concatenate([one.pieces.times for one in alone]))
    np.testing.assert_array_equal(found.pieces.points, np.concatenate([one.pieces.points for one in alone]))
    np.testing.assert_array_equal(found.corners.corners, np.concatenate([one.corners.corners for one in alone]))
    for field in ("radius", "hull_radius", "offset", "at_rest"):
        np.testing.assert_array_equal(found.each[field], np.concatenate([one.each[field] for one in alone]))
    assert found.each["owner"].tolist() == [k for k, one in enumerate(alone) for _ in one.each]
