"""Paths to follow: where a robot is on them, how fast it may be, and robots that follow them."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from strategies import numbers

from slalom import (
    METHODS,
    ConstantVelocity,
    Disc,
    Fleet,
    Limits,
    Navigator,
    Obstacle,
    ObstacleTable,
    PathGoal,
    Polyline,
    Rectangle,
    State,
    Stationary,
)
from slalom.base.tolerances import PATH_BRAKING
from slalom.sim import Robot, Scenario, read_scenario, simulate
from slalom.sim.measure.metrics import min_clearance
from slalom.sim.run.states import integrate
from slalom.vehicle import DifferentialDrive, Pose, VehicleNavigator

DT = 0.1
CORNERS = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (20.0, 8.0), (20.0, 0.0), (30.0, 0.0)])
SPEEDS = (2.0, 2.0, 1.0, 2.0, 0.6, 0.0)
LIMITS = Limits(2.5, 2.0)


@st.composite
def paths(draw: st.DrawFn) -> PathGoal:
    """Polylines in the plane and in space."""
    d, n = draw(st.sampled_from([2, 3])), draw(st.integers(2, 7))
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    points = np.cumsum(rng.uniform(0.2, 3.0, (n, 1)) * rng.normal(size=(n, d)), axis=0)
    return PathGoal(points, rng.uniform(0.2, 3.0, n))


@given(goal=paths(), seed=st.integers(0, 10**6))
def test_the_nearest_point_is_the_nearest_of_many(goal: PathGoal, seed: int) -> None:
    """Within the stretch that is asked for."""
    rng = np.random.default_rng(seed)
    position = goal.points[0] + rng.normal(size=goal.points.shape[1]) * 4.0
    since, until = np.sort(rng.uniform(0.0, goal.length, 2))
    found = goal.nearest(position, since, until)
    assert since <= found <= until
    samples = np.linspace(since, until, 400)
    distances = [np.linalg.norm(goal.point(at) - position) for at in samples]
    assert np.linalg.norm(goal.point(found) - position) <= min(distances) + 1e-9


@given(goal=paths(), braking=numbers(0.1, 3.0), share=numbers(0.0, 1.0))
def test_the_allowed_speed_can_be_kept(goal: PathGoal, braking: float, share: float) -> None:
    """It is at most the profile, and braking leads from any point to what is allowed further on."""
    at = share * goal.length
    speed = goal.allowed_speed(at, 9.0, braking)
    assert 0.0 < speed <= max(goal.speeds)
    for further in np.linspace(at, goal.length, 50):
        assert speed**2 <= goal.allowed_speed(further, 9.0, braking) ** 2 + 2.0 * braking * (further - at) + 1e-9
    on_points = np.cumsum([0.0, *np.linalg.norm(np.diff(goal.points, axis=0), axis=1)])
    for place, limit in zip(on_points, goal.speeds):
        assert goal.allowed_speed(place, 9.0, braking) <= limit + 1e-9
    assert goal.allowed_speed(at, 0.1, braking) == 0.1


def follow(goal: PathGoal, obstacles: ObstacleTable, method: str = "nao") -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Positions and velocities of a robot on a path until it has arrived, and its progress."""
    navigator, previous = Navigator(METHODS[method], Disc(0.4), LIMITS), None
    state, track, progress = State(goal.points[0], (0.0, 0.0)), [], []
    for k in range(700):
        if goal.reached(state.position, state.velocity, k * DT):
            return *np.moveaxis(np.array(track), 1, 0), progress
        previous = navigator.decide(state, obstacles, goal, now=k * DT, previous=previous)
        acceleration = previous.manoeuvre.mean_acceleration(k * DT, DT)
        state = State(*integrate(state.position, state.velocity, acceleration, DT), acceleration)
        track.append((state.position, state.velocity))
        progress.append(previous.progress)
    raise AssertionError(f"not arrived at {state.position}")


@pytest.mark.parametrize("method", ["nao", "ao", "vo"])
def test_a_robot_follows_a_path_with_its_speeds(method: str) -> None:
    goal = PathGoal(CORNERS, SPEEDS, 0.3)
    places, velocities, progress = follow(goal, ObstacleTable([]), method)
    assert np.all(np.diff(progress) >= 0.0)
    off = [np.linalg.norm(goal.point(goal.nearest(place, 0.0, goal.length)) - place) for place in places]
    # Corners are cut by less than half of the lookahead.
    assert max(off) <= 1.0
    speeds = np.linalg.norm(velocities, axis=1)
    allowed = np.array([goal.allowed_speed(at, 9.0, PATH_BRAKING * LIMITS.braking) for at in progress])
    assert np.all(speeds <= allowed + 0.05)
    assert speeds.mean() >= 0.7 * allowed.mean()


OBSTACLES = {
    "parked": [Obstacle(Rectangle(4.0, 1.8), Stationary((5.0, 0.0)))],
    "wall": [Obstacle(Polyline([(8.0, 4.0), (12.0, 4.0)]), Stationary((0.0, 0.0)))],
    "crossing": [Obstacle(Disc(0.5), ConstantVelocity((5.0, -6.0), (0.0, 1.0)))],
    "oncoming": [Obstacle(Disc(0.5), ConstantVelocity((10.0, 20.0), (0.0, -1.0)))],
}


@pytest.mark.parametrize("name", OBSTACLES)
def test_a_robot_passes_what_is_on_its_path(name: str) -> None:
    """Without contact: it follows the path around it."""
    obstacles = OBSTACLES[name]
    scenario = Scenario(
        name,
        (Robot(Disc(0.4), LIMITS, State((0.0, 0.0), (0.0, 0.0)), PathGoal(CORNERS, SPEEDS, 0.3)),),
        tuple(obstacles),
        duration=70.0,
    )
    run = simulate(scenario, METHODS["nao"])
    assert np.isfinite(run.arrived[0])
    assert min_clearance(run) >= 0.0


def test_a_path_that_crosses_itself_is_followed_in_order() -> None:
    loop = PathGoal([(0, 0), (8, 0), (8, 6), (4, 6), (4, -5)], 1.5, 0.3)
    places, _, progress = follow(loop, ObstacleTable([]))
    assert max(np.diff(progress)) <= 1.0
    assert places[:, 0].max() >= 7.0


SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0)]
AT = np.linspace(0.0, 2.0 * np.pi, 60)
RETURNING = {
    "laps": PathGoal(SQUARE, tolerance=0.2, laps=2),
    "there and back": PathGoal([(0, 0), (0, 0), (5, 0), (0, 0)], tolerance=0.2),
    "rows": PathGoal([(0, 0), (4, 0), (4, 0.3), (0, 0.3), (0, 0.6), (4, 0.6)], tolerance=0.2),
    "crossing": PathGoal([(0, 0), (6, 0), (6, 3), (3, 3), (3, -0.2)], tolerance=0.2, cut=0.2),
    "eight": PathGoal(np.stack([np.sin(2.0 * AT), np.sin(AT)], axis=1) * 2.0, tolerance=0.2, stop=False),
}


def off(goal: PathGoal, track: np.ndarray) -> float:
    """Largest distance of the path from a track, in the order of the path."""
    places, at, most = goal.points_at(np.arange(0.0, goal.length - goal.tolerance, 0.05)), 0, 0.0
    for place in places:
        distances = np.linalg.norm(track[at : at + 40] - place, axis=1)
        # The first place of the track that is about as near: it may pass the place again on its way back.
        at += int(np.argmax(distances <= distances.min() + 0.05))
        most = max(most, float(distances.min()))
    return most


@pytest.mark.parametrize("name", RETURNING)
@pytest.mark.parametrize("beside", [0.0, 0.07])
def test_a_path_that_comes_back_is_driven_from_its_begin_to_its_end(name: str, beside: float) -> None:
    """A robot without and a drive with wheels, which never backs up where no part turns back on itself."""
    goal, limits = RETURNING[name], Limits(1.0, 2.0)
    navigator, decision = Navigator(METHODS["nao"], Disc(0.2), limits), None
    state, track, k = State(goal.points[0] + (-beside, beside), (0.0, 0.0)), [], 0
    while not goal.reached(state.position, state.velocity, k * DT) and k < 600:
        decision = navigator.decide(state, [], goal, now=k * DT, previous=decision)
        state = decision.manoeuvre.advance(DT * (k + 1) - decision.manoeuvre.start)
        track.append(state.position)
        k += 1
    assert off(goal, np.array(track)) <= 0.3
    driven = np.linalg.norm(np.diff(track, axis=0), axis=1).sum()
    assert 0.94 * goal.length - goal.tolerance <= driven <= 1.05 * goal.length + beside

    drive = DifferentialDrive(0.3, 1.0, 2.0, period=DT)
    wheels = VehicleNavigator(drive, METHODS["nao"], Disc(0.2))
    pose, decision, track, k, backed = Pose(goal.points[0] + (-beside, beside), 0.0), None, [], 0, 0.0
    while not goal.reached(pose.position, pose.velocity, k * DT) and k < 900:
        decision = wheels.decide(pose, [], goal, now=k * DT, previous=decision)
        pose, k = drive.drive(pose, decision.command), k + 1
        backed += DT * max(0.0, -pose.speed)
        track.append(pose.position)
    assert off(goal, np.array(track)) <= 0.3
    assert backed <= (0.5 if name == "there and back" else 0.02)


def test_a_goal_counts_a_closed_path_as_reached_only_after_it_was_driven() -> None:
    """By the progress; without one by that of the last decision for it, or by the first place that it can mean."""
    goal = PathGoal(SQUARE, tolerance=0.3)
    still = np.zeros(2)
    assert not goal.reached(goal.points[0], still, 0.0)
    assert not goal.reached(goal.points[0], still, 0.0, progress=8.0)
    assert goal.reached(goal.points[0], still, 0.0, progress=15.8)
    assert not goal.reached_during(np.array([0.0, 0.2]), np.array([0.0, -1.0]), 0.0, 0.0, 0.1, 8.0)
    assert PathGoal(SQUARE, tolerance=0.3, stop=False).reached_during(
        np.array([0.0, 0.35]), np.array([0.0, -1.0]), np.zeros(2), 0.0, 0.1, 15.6
    )
    run = simulate(
        Scenario("square", (Robot(Disc(0.2), Limits(1.0, 2.0), State((0, 0), (0, 0)), goal),), duration=30.0), "nao"
    )
    assert run.arrived[0] >= 0.95 * goal.length


def test_a_fleet_follows_paths_as_a_navigator_and_goes_on_from_a_copy() -> None:
    """Alone as the navigator; two that cross keep apart; a copy remembers how far each has come."""
    goal = PathGoal(CORNERS, SPEEDS, 0.3)
    alone = Fleet(METHODS["vo"], Disc(0.4), LIMITS, robots=1, period=DT, detours=())
    navigator, previous = Navigator(METHODS["vo"], Disc(0.4), LIMITS), None
    positions, velocities = CORNERS[:1], np.zeros((1, 2))
    for k in range(60):
        decided = alone.step(k * DT, positions, velocities, paths=[goal])
        previous = navigator.decide(State(positions[0], velocities[0]), [], goal, now=k * DT, previous=previous)
        assert previous.outcome is decided.outcomes[0]
        np.testing.assert_allclose(
            previous.manoeuvre.mean_acceleration(k * DT, DT), decided.accelerations[0], atol=1e-9
        )
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)

    routes = [PathGoal([(0, 0), (10, 0)], 1.5, 0.3), PathGoal([(5, -5), (5, 5)], [1.0, 0.0], 0.3)]
    fleet, nearest = Fleet(METHODS["nao"], Disc(0.4), LIMITS, robots=2, period=DT), np.inf
    positions, velocities = np.array([route.points[0] for route in routes]), np.zeros((2, 2))
    for k in range(160):
        if k == 40:
            fleet = pickle.loads(pickle.dumps(fleet))
        decided = fleet.step(k * DT, positions, velocities, paths=routes)
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
        nearest = min(nearest, float(np.linalg.norm(positions[0] - positions[1])))
    assert nearest >= 0.8
    assert all(route.reached(p, v, 0.0) for route, p, v in zip(routes, positions, velocities))


WALLS = ObstacleTable(
    [
        Obstacle(Polyline(points), Stationary((0.0, 0.0)))
        for points in ([(0.0, 2.0), (9.0, 2.0)], [(0.0, 0.0), (12.0, 0.0), (12.0, 6.0)])
    ]
)
"""A corridor along the x axis, open at its upper right corner."""


def test_a_robot_begins_a_new_path_where_it_is_nearest() -> None:
    """Planned anew on the way: lengths along the old path mean nothing on the new one, in a replay too."""
    navigator = Navigator(METHODS["nao"], Disc(0.3), Limits(1.0, 1.0), horizon=3.0)
    goal, state, decision = PathGoal([(1, 1), (11, 1)], tolerance=0.2), State((1.0, 1.0), (0.0, 0.0)), None
    for k in range(400):
        if k == 60:
            goal = PathGoal([tuple(state.position), (10.2, 1.0), (10.2, 3.2), (2.0, 3.2)], tolerance=0.2)
        if k == 30:
            # The same points: the progress goes on.
            goal = PathGoal(goal.points, tolerance=0.2)
        before = decision
        decision = navigator.decide(state, WALLS, goal, now=DT * k, previous=decision)
        if k == 30:
            assert decision.progress >= before.progress > 1.0
        if k == 60:
            assert before.progress > 5.0
            assert decision.progress == pytest.approx(0.0, abs=0.1)
            assert decision.inputs.previous.progress is None
        if goal.reached(state.position, state.velocity, DT * k):
            break
        state = decision.manoeuvre.advance(DT * (k + 1) - decision.manoeuvre.start)
    assert goal.reached(state.position, state.velocity, DT * k)


def test_a_fleet_begins_new_paths_where_its_robots_are_nearest() -> None:
    routes = [PathGoal([(0, 0), (30, 0)], 1.5, 0.3), PathGoal([(0, 5), (30, 5)], 1.5, 0.3)]
    fleet = Fleet(METHODS["nao"], Disc(0.4), LIMITS, robots=2, period=DT)
    positions, velocities = np.array([route.points[0] for route in routes]), np.zeros((2, 2))
    for k in range(80):
        if k == 60:
            routes = [PathGoal([tuple(positions[0]), (30, -8)], 1.5, 0.3), routes[1]]
        decided = fleet.step(k * DT, positions, velocities, paths=routes)
        if k == 60:
            # A target just ahead on the new path, as far as the robot looks.
            assert np.linalg.norm(fleet.table.each["target"][0, :2] - positions[0]) <= 2.5
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
    assert positions[1, 0] > 8.0


FILE = """\
robot:
  shape: {kind: disc, radius: 0.4}
  position: [0, 0]
  max_speed: 2.5
  max_acceleration: 2
  goal: {path: {points: [[0, 0], [6, 0], [6, 5]], speeds: [1.5, 1, 0]}, tolerance: 0.3, stop: true}
obstacles:
  - {shape: {kind: disc, radius: 0.5}, trajectory: {kind: stationary, position: [3, 0.1]}}
"""


def test_a_scenario_file_has_a_path(tmp_path: Path) -> None:
    file = tmp_path / "path.yaml"
    file.write_text(FILE)
    scenario = read_scenario(file)
    assert isinstance(scenario.robot.goal, PathGoal)
    run = simulate(scenario, METHODS["nao"])
    assert np.isfinite(run.arrived[0])
    assert min_clearance(run) >= 0.0
    assert np.linalg.norm(run.velocities, axis=-1).max() <= 1.55


def test_a_robot_pushed_behind_a_corner_at_the_end_goes_back_along_the_path() -> None:
    """No length is left of the path, and the end is hidden: the target is a place before it in sight."""
    path = PathGoal([(0, 0), (4, 0), (4, 4)])
    step = path.step(np.array([6.0, 0.0]), 8.0, 1.0, 1.0, 0.1, 0.3, hidden=lambda points: points[:, 1] > 0.5)
    assert step.progress == 8.0
    assert not step.final
    assert step.goal.position(0.0)[1] < 1.0
    assert step.goal.tolerance > 0.0
