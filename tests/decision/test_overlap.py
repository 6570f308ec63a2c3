"""A robot that overlaps obstacles: it gets no deeper than SHALLOW_OVERLAP, or than it is, into any of them.

Also where others leave it no safe control.
"""

import numpy as np
import pytest
from draws import draws, examples
from hypothesis import given, strategies as st
from motion import drive
from parts import disc_or_ball

from slalom import (
    METHODS,
    ConstantVelocity,
    Disc,
    Fleet,
    Goal,
    Limits,
    Navigator,
    Obstacle,
    Outcome,
    Polyline,
    Rectangle,
    Shape,
    State,
    Stationary,
    Tracks,
    Union,
)
from slalom.base.tolerances import CONTACT_SLACK, OVERLAP
from slalom.obstacle.window import SHALLOW_OVERLAP, ObstacleWindow
from slalom.sim.run.states import integrate

PERIOD = 0.1
RADIUS = 0.3
WALL = Obstacle(Polyline([(-50.0, 0.0), (50.0, 0.0)]), Stationary((0.0, 0.0)), "wall")
SHALLOWEST = 1.2 * OVERLAP
"""[m] A depth that inexact execution or positions of single precision cause."""


def clearances(robot: Shape, obstacles: list[Obstacle], state: State, now: float) -> np.ndarray:
    """The clearances (n,) [m] of a robot to obstacles at a time [s]: below 0 its depth in them."""
    window = ObstacleWindow(obstacles, now, 1.0)
    bodies, found = window.bodies(robot), np.full(len(obstacles), np.inf)
    np.minimum.at(found, bodies.owner, window.distances(robot, state.position)[0] - bodies.radius)
    return found


@st.composite
def surrounded(draw: st.DrawFn, d: int) -> tuple[State, list[Obstacle]]:
    """A robot at rest that overlaps one to three bodies at rest, among bodies that arrive after more than a period."""
    seed, count = draw(st.integers(0, 2**32 - 1)), draw(st.integers(1, 3))
    depths = draw(st.lists(st.sampled_from([SHALLOWEST, 1e-4, 0.02, 0.2]), min_size=count, max_size=count))
    rng = np.random.default_rng(seed)

    def directions(n: int) -> np.ndarray:
        found = rng.normal(size=(n, d))
        return found / np.linalg.norm(found, axis=1, keepdims=True)

    radii = rng.uniform(0.2, 3.0, count)
    touching = [
        Obstacle(disc_or_ball(radius, d), Stationary((RADIUS + radius - depth) * ahead))
        for radius, depth, ahead in zip(radii, depths, directions(count))
    ]
    speeds, ways = rng.uniform(0.5, 2.0, 6), directions(6)
    arriving = [
        Obstacle(
            disc_or_ball(0.3, d), ConstantVelocity((2.0 * RADIUS + speed * rng.uniform(0.3, 3.0)) * way, -speed * way)
        )
        for speed, way in zip(speeds, ways)
    ]
    return State(np.zeros(d), np.zeros(d)), [*touching, *arriving]


@pytest.mark.parametrize("method", ["vo", "avo", "nao"])
@pytest.mark.parametrize("d", [2, 3])
@examples(25)
@given(st.data())
def test_no_deeper_within_the_period(d: int, method: str, data: st.DataObject) -> None:
    """Rest gets no deeper. So a control that does is never needed where nothing arrives within the period."""
    state, obstacles = data.draw(surrounded(d))
    robot = Navigator(METHODS[method], disc_or_ball(RADIUS, d), Limits(1.5, 2.0), period=PERIOD)
    decision = robot.decide(state, obstacles, Goal(Stationary(np.full(d, 9.0)), 0.5))
    assert decision.outcome is Outcome.ESCAPING
    at_first = clearances(robot.robot, obstacles, state, 0.0)
    allowed = np.where(at_first < -OVERLAP, np.minimum(at_first, -SHALLOW_OVERLAP), 0.0)
    for part in (0.25, 0.5, 0.75, 1.0):
        now = part * PERIOD
        after = drive(state, decision.manoeuvre.mean_acceleration(0.0, now), now)
        assert np.all(clearances(robot.robot, obstacles, after, now) >= allowed - CONTACT_SLACK)


STARTS = np.array([(-1.9, 0.6), (1.8, 0.5), (0.1, 2.2)])
VELOCITIES = np.array([(0.5, -0.1), (-0.5, -0.08), (0.0, -0.5)])
STOP = 1.9
"""[s] Three bodies approach a robot at a wall from all sides, as if they passed over it, and stop before they touch."""


@pytest.mark.parametrize("method", ["vo", "avo", "nao"])
@pytest.mark.parametrize("depth", draws([0.1, SHALLOWEST, 1e-3]))
@pytest.mark.parametrize("shape", [Disc(RADIUS), Rectangle(0.7, 2.0 * RADIUS)], ids=["disc", "rectangle"])
def test_bodies_that_approach_press_no_robot_into_a_wall(shape: Shape, depth: float, method: str) -> None:
    """Each step predicts that they go on, and with most methods no control is clear of all of them then."""
    robot = Navigator(METHODS[method], shape, Limits(1.0, 1.0), period=PERIOD)
    state, goal, previous = State((0.0, RADIUS - depth), (0.0, 0.0)), Goal(Stationary((0.0, 0.3)), 0.1, stop=True), None
    for k in range(40):
        now = k * PERIOD
        velocities = VELOCITIES if now < STOP else 0.0 * VELOCITIES
        seen = Tracks(STARTS + min(now, STOP) * VELOCITIES, velocities, 0.3, now)
        previous = robot.decide(state, [WALL, seen], goal, now=now, previous=previous)
        assert previous.outcome is not Outcome.IMPACT
        state = drive(state, previous.manoeuvre.mean_acceleration(now, PERIOD), PERIOD)
        assert clearances(shape, [WALL], state, now)[0] >= -max(depth, SHALLOW_OVERLAP) - 40.0 * CONTACT_SLACK


@pytest.mark.parametrize("method", ["vo", "avo", "nao", "ao", "nlvo"])
def test_bodies_that_approach_drive_no_robot_into_a_wall(method: str) -> None:
    """Three close in on a robot beside a wall, which it may choose no motion into: it can stop."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        gap = float(rng.choice([0.02, 0.1, 0.3]))
        starts = np.array(
            [(x + rng.uniform(-0.1, 0.1), RADIUS + gap + rng.uniform(0.7, 2.5)) for x in (-0.75, 0, 0.75)]
        )
        towards = np.array([(rng.uniform(-0.1, 0.1), -rng.uniform(0.5, 2.0)) for _ in starts])
        robot = Navigator(METHODS[method], Disc(RADIUS), Limits(1.2, 2.0), horizon=3.0, margin=0.05, period=PERIOD)
        state, previous = State((0.0, RADIUS + gap), (rng.uniform(-0.8, 0.8), 0.0)), None
        for k in range(20):
            now = k * PERIOD
            seen = Tracks(starts + now * towards, towards, 0.3, now)
            previous = robot.decide(state, [WALL, seen], Goal(Stationary((0.0, 0.8)), 0.2), now=now, previous=previous)
            state = drive(state, previous.manoeuvre.mean_acceleration(now, PERIOD), PERIOD)
            assert clearances(Disc(RADIUS), [WALL], state, now)[0] >= -20.0 * CONTACT_SLACK


def test_robots_of_a_fleet_press_none_into_a_wall() -> None:
    """Six robots that share the avoidance, one of them a little deep in the wall between the others."""
    starts = np.array([(0.0, RADIUS - SHALLOWEST), (-0.75, 0.4), (0.75, 0.4), (-0.4, 1.1), (0.4, 1.1), (0.0, 1.8)])
    targets = np.array([(0.0, 5.0), (3.0, 0.35), (-3.0, 0.35), (0.5, 0.35), (-0.5, 0.35), (0.0, 0.35)])
    fleet = Fleet(METHODS["nao"], Disc(RADIUS), Limits(1.0, 1.0), robots=6, period=PERIOD, margin=0.0)
    positions, velocities = starts, np.zeros_like(starts)
    for k in range(60):
        decided = fleet.step(k * PERIOD, positions, velocities, targets, others=[WALL])
        positions, velocities = integrate(positions, velocities, decided.accelerations, PERIOD)
        assert positions[:, 1].min() >= RADIUS - SHALLOW_OVERLAP - CONTACT_SLACK
        if k == 0:
            assert decided.outcomes[0] is Outcome.ESCAPING


CORNER = Obstacle(
    Union((Polyline([(-9.0, 0.0), (9.0, 0.0)], radius=0.05), Polyline([(0.0, 0.0), (0.0, 4.0)], radius=0.05))),
    Stationary((0.0, 0.0)),
    "corner",
)


def depths(shape: Shape, state: State) -> np.ndarray:
    """The depth (2,) [m] of a robot in each wall of the corner."""
    window = ObstacleWindow([CORNER], 0.0, 1.0)
    return window.bodies(shape).radius - window.distances(shape, state.position)[0]


@pytest.mark.parametrize("method", ["vo", "avo", "nao"])
@pytest.mark.parametrize("shape", [Disc(RADIUS), Rectangle(2.0 * RADIUS, 2.0 * RADIUS)], ids=["disc", "square"])
@examples(25)
@given(
    st.tuples(*[st.sampled_from([-0.01, 0.0, 0.005, 0.02, 0.1])] * 2),
    st.tuples(st.floats(0.0, 0.4), st.floats(0.0, 0.4)),
)
def test_a_robot_that_brakes_too_late_crosses_no_wall(
    shape: Shape, method: str, deep: tuple[float, float], toward: tuple[float, float]
) -> None:
    """It moves into two walls, which are one obstacle, and gets at most three braking distances deeper."""
    most_braking = 2.0
    robot = Navigator(METHODS[method], shape, Limits(1.5, most_braking), period=PERIOD)
    state = State((deep[0] - RADIUS - 0.05, RADIUS + 0.05 - deep[1]), (toward[0], -toward[1]))
    braking = np.array([toward[1], toward[0]]) * np.hypot(*toward) / (2.0 * most_braking)
    allowed = np.maximum(depths(shape, state), SHALLOW_OVERLAP) + 3.0 * braking + 5.0 * SHALLOW_OVERLAP
    previous = None
    for k in range(12):
        goal = Goal(Stationary((3.0, 3.0)), 0.2)
        previous = robot.decide(state, [CORNER], goal, now=k * PERIOD, previous=previous)
        state = drive(state, previous.manoeuvre.mean_acceleration(k * PERIOD, PERIOD), PERIOD)
        assert np.all(depths(shape, state) <= allowed)


def test_a_robot_leaves_a_polygon_that_holds_its_center() -> None:
    """No smaller radius frees it there: the polygon does not count until its centre is outside."""
    block = Obstacle(Rectangle(4.0, 2.0), Stationary((0.0, 0.0)), "block")
    robot, goal = (
        Navigator(METHODS["nao"], Disc(RADIUS), Limits(1.5, 2.0), period=PERIOD),
        Goal(Stationary((9.0, 0.0)), 1.0),
    )
    state, previous, depths = State((0.2, 0.3), (0.0, 0.0)), None, []
    for k in range(25):
        previous = robot.decide(state, [block], goal, now=k * PERIOD, previous=previous)
        depths.append(clearances(robot.robot, [block], state, 0.0)[0])
        if previous.outcome is not Outcome.ESCAPING:
            break
        state = drive(state, previous.manoeuvre.mean_acceleration(k * PERIOD, PERIOD), PERIOD)
    assert previous.outcome.safe
    assert np.all(np.diff(depths) > 0.0)


ROOM = Obstacle(Polyline([(-3, -3), (-3, 3), (3, 3), (3, -3), (-3, -3)]), Stationary((0.0, 0.0)), "room")
ON_IT = {"on it": (0.0, 0.0), "beside it": (0.05, 0.0), "in front": (0.25, 0.1), "behind": (-0.2, -0.02)}
"""Positions [m] from the robot of a body that moves with it: perception that reports the robot itself, a load."""


@pytest.mark.parametrize("method", draws(["nao", "avo", "vo", "ao"], 2))
@pytest.mark.parametrize("place", draws(ON_IT, 2))
@pytest.mark.parametrize("radius", draws([0.3, 0.6]))
def test_a_body_that_moves_with_the_robot_presses_it_into_no_wall(radius: float, place: str, method: str) -> None:
    """Every way out is predicted to get deeper into the body, since it keeps the velocity of the robot."""
    robot, goal = Navigator(METHODS[method], Disc(RADIUS), Limits(1.5, 1.0)), Goal(Stationary((2.0, 0.0)), stop=True)
    state, previous = State((0.0, 0.0), (0.0, 0.0)), None
    for k in range(90):
        now = k * PERIOD
        body = Tracks([state.position + ON_IT[place]], [state.velocity], radius, now)
        previous = robot.decide(state, [ROOM, body], goal, now=now, previous=previous)
        assert previous.outcome is Outcome.ESCAPING
        state = drive(state, previous.manoeuvre.mean_acceleration(now, PERIOD), PERIOD)
        assert clearances(robot.robot, [ROOM], state, now)[0] >= -CONTACT_SLACK


@pytest.mark.parametrize("same_target", [False, True])
@pytest.mark.parametrize("name", ["nao", "nao_shared", "rvo", "vo"])
@pytest.mark.parametrize("count", draws([3, 2, 5]))
def test_robots_at_one_position_leave_it_in_different_directions(count: int, name: str, same_target: bool) -> None:
    """They have no direction from each other."""
    angles = 2.0 * np.pi * np.arange(count) / count
    targets = 4.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1) * (not same_target)
    fleet = Fleet(METHODS[name], Disc(RADIUS), Limits(1.5, 2.0), robots=count)
    positions, velocities, others = np.ones((count, 2)), np.zeros((count, 2)), ~np.eye(count, dtype=bool)
    for k in range(40):
        decided = fleet.step(k * PERIOD, positions, velocities, targets)
        positions, velocities = integrate(positions, velocities, decided.accelerations, PERIOD)
    apart = np.linalg.norm(positions[:, None] - positions, axis=2)[others]
    assert apart.min() > 2.0 * RADIUS - 1e-4


def test_balls_at_one_position_leave_it() -> None:
    """In space too."""
    fleet = Fleet(METHODS["nao"], disc_or_ball(RADIUS, 3), Limits(1.5, 2.0), robots=2)
    positions, velocities, targets = np.zeros((2, 3)), np.zeros((2, 3)), np.array([(0.0, 0.0, 5.0), (0.0, 0.0, -5.0)])
    for k in range(40):
        decided = fleet.step(k * PERIOD, positions, velocities, targets)
        positions, velocities = integrate(positions, velocities, decided.accelerations, PERIOD)
    assert np.linalg.norm(positions[1] - positions[0]) > 2.0 * RADIUS
