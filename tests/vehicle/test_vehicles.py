"""Vehicles on wheels: bounds against an independent integration, limits of wheels and steering, and arrivals."""

from dataclasses import replace
from math import cos, pi, sin, tan
from types import SimpleNamespace

import numpy as np
import pytest
from draws import draws

from slalom import (
    AccelerateThenCoast,
    ConstantVelocity,
    Disc,
    Goal,
    HeadingCone,
    InvalidInput,
    Limits,
    Navigator,
    Obstacle,
    ObstacleTable,
    Outcome,
    PathGoal,
    Polyline,
    Rectangle,
    State,
    Stationary,
    Tracks,
    TurningRadius,
    method,
)
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path import hermite
from slalom.vehicle import Bicycle, Command, DifferentialDrive, Pose, VehicleNavigator
from slalom.vehicle.vehicle import hermite_error

DRIVES = {
    "service": DifferentialDrive(0.35, 1.0, 3.0, 0.3, period=0.05),
    "quick": DifferentialDrive(0.4, 2.0, 8.0, 0.25),
    "long period": DifferentialDrive(0.3, 1.5, 6.0, period=0.2),
}
REVERSING = Bicycle(0.4, 0.6, 6.0, 1.5, 1.5, max_reverse_speed=0.6)
BICYCLES = {"robot": Bicycle(0.4, 0.6, 6.0, 1.5, 1.5), "car": Bicycle(2.7, 0.55, 1.5, 5.0, 3.0, ahead=1.35)}


def rolled(vehicle, pose: Pose, command: Command, steps: int = 20) -> list[Pose]:
    """Poses at `steps` times of a period by the classical Runge-Kutta method, from the equations of the wheels."""
    h, period = vehicle.period / steps, vehicle.period

    def rates(s: float, y: np.ndarray) -> np.ndarray:
        v = pose.speed + s / period * (command.speed - pose.speed)
        turn = pose.turn + s / period * (command.turn - pose.turn)
        rate = v * tan(turn) / vehicle.wheelbase if isinstance(vehicle, Bicycle) else turn
        return np.array([v * cos(y[2]), v * sin(y[2]), rate])

    y, found = np.array([*pose.position, pose.heading]), []
    for k in range(steps):
        s = k * h
        k1 = rates(s, y)
        k2 = rates(s + 0.5 * h, y + 0.5 * h * k1)
        k3 = rates(s + 0.5 * h, y + 0.5 * h * k2)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + rates(s + h, y + h * k3))
        share = (k + 1) / steps
        speed, turn = (a + share * (b - a) for a, b in ((pose.speed, command.speed), (pose.turn, command.turn)))
        found.append(Pose(y[:2], y[2], speed, turn))
    return found


def point_of(vehicle, pose: Pose) -> np.ndarray:
    return pose.position + vehicle.lever * np.array([cos(pose.heading), sin(pose.heading)])


def within_wheel_limits(drive: DifferentialDrive, pose: Pose, command: Command) -> bool:
    """Whether speeds and rates of both wheels are within their limits, up to rounding."""
    for side in (-0.5, 0.5):
        before, after = (one.speed + side * drive.track * one.turn for one in (pose, command))
        if abs(after) > drive.max_wheel_speed + 1e-12:
            return False
        if abs(after - before) > drive.max_wheel_acceleration * drive.period + 1e-12:
            return False
    return True


def accelerations(rng, style: str, limits: Limits, state: State, period: float) -> np.ndarray:
    """A random acceleration within the limits: anywhere, as strong as possible, or turning the velocity."""
    speed = float(np.linalg.norm(state.velocity))
    ahead = state.velocity / speed if speed > 1e-9 else np.array([1.0, 0.0])
    angle = {"anything": rng.uniform(-pi, pi), "reversing": pi + 0.1 * rng.normal(), "turning": 0.5 * pi}[style]
    size = limits.max_acceleration * (rng.uniform() if style == "anything" else 1.0)
    a = size * (np.cos(angle) * ahead + np.sin(angle) * np.array([-ahead[1], ahead[0]]))
    if np.linalg.norm(state.velocity + period * a) > limits.max_speed:
        a = a - (a @ ahead) * ahead
        a = a if np.linalg.norm(state.velocity + period * a) <= limits.max_speed else 0.0 * a
    return a


def planned(state: State, acceleration: np.ndarray, period: float, t: float) -> SimpleNamespace:
    """A decision for this acceleration in the period from t on."""
    return SimpleNamespace(manoeuvre=Manoeuvre(AccelerateThenCoast(period), state, acceleration, t))


@pytest.mark.parametrize("chunk", draws(range(3)))
@pytest.mark.parametrize("name", draws(DRIVES, 2))
def test_the_point_of_a_drive_stays_within_its_bound_of_the_plan(name: str, chunk: int) -> None:
    """From rest, and through reversals; against Runge-Kutta. The bound is not much too large."""
    drive, worst, reversing = DRIVES[name], 0.0, 0
    bound, limits, h = drive.tracking_error, drive.limits, drive.period
    for style in ("anything", "reversing", "turning"):
        for seed in (2 * chunk, 2 * chunk + 1):
            rng = np.random.default_rng([seed, len(style)])
            pose, decision = Pose(rng.normal(size=2), rng.uniform(-pi, pi)), None
            for k in range(60):
                state = drive.state(pose, decision, k * h)
                here = "anything" if style == "reversing" and k % 9 else style
                decision = planned(state, accelerations(rng, here, limits, state, h), h, k * h)
                command = drive.command(pose, decision, k * h)
                assert within_wheel_limits(drive, pose, command)
                path = rolled(drive, pose, command)
                at = k * h + h * np.arange(1, len(path) + 1) / len(path)
                off = [np.linalg.norm(point_of(drive, p) - decision.manoeuvre.position(t)) for p, t in zip(path, at)]
                worst, reversing, pose = max(worst, *off), reversing + (path[-1].speed < 0.0), path[-1]
    assert reversing
    assert 0.01 * bound <= worst <= bound


@pytest.mark.parametrize("name", DRIVES)
def test_errors_of_a_drive_are_gone_after_two_periods(name: str) -> None:
    """The feedback is deadbeat: of errors in position, heading and speed only the displacement of a period is left."""
    drive, h = DRIVES[name], DRIVES[name].period
    speed = 0.5 * drive.limits.max_speed
    decision = planned(State((drive.lever, 0.0), (speed, 0.0)), np.zeros(2), h, 0.0)
    size = 0.1 * drive.feedback * h * h
    pose, off = Pose((size, -size), 0.1 * size, speed + 0.1 * size / h), []
    for k in range(8):
        off.append(np.linalg.norm(point_of(drive, pose) - decision.manoeuvre.position(k * h)))
        pose = drive.drive(pose, drive.command(pose, decision, k * h))
    assert off[0] > size
    assert off[2] < 0.05 * size
    assert off[-1] < 1e-3 * size


@pytest.mark.parametrize("name", draws(BICYCLES))
def test_the_point_of_a_bicycle_stays_within_its_bound_for_a_period(name: str) -> None:
    """Accelerations that the limits of the point admit, from rest on; against Runge-Kutta."""
    bicycle, worst, turned = BICYCLES[name], 0.0, 0
    h, limits = bicycle.period, bicycle.limits
    response = AccelerateThenCoast(h)
    for seed in range(12):
        rng = np.random.default_rng(seed)
        pose, wanted = Pose(rng.normal(size=2), rng.uniform(-pi, pi)), np.zeros(2)
        for k in range(80):
            state = bicycle.state(pose, None, k * h)
            admissible = limits.admissible(response, state, 1.0)
            if k % 5 == 0:
                wanted = rng.uniform(-1.0, 1.0, 2)
            e = np.array([cos(state.heading), sin(state.heading)])
            largest = float(state.velocity @ state.velocity) / bicycle.turning_radius
            across = wanted[1] * min(largest, limits.max_acceleration) * np.array([-e[1], e[0]])
            candidates = [share * limits.max_acceleration * e + across for share in (wanted[0], 0.3 * wanted[0], 0.0)]
            control = next((c for c in candidates if admissible.contains(c)), np.zeros(2))
            turned += abs(float(control @ (-e[1], e[0]))) > 0.5 * limits.max_acceleration
            decision = planned(state, control, h, k * h)
            command = bicycle.command(pose, decision, k * h)
            assert 0.0 <= command.speed <= bicycle.max_speed
            assert abs(command.turn) <= bicycle.max_steering
            assert abs(command.turn - pose.turn) <= bicycle.max_steering_rate * h + 1e-12
            assert abs(command.speed - pose.speed) <= bicycle.max_acceleration * h + 1e-12
            path = rolled(bicycle, pose, command)
            at = k * h + h * np.arange(1, len(path) + 1) / len(path)
            off = [np.linalg.norm(point_of(bicycle, p) - decision.manoeuvre.position(t)) for p, t in zip(path, at)]
            worst, pose = max(worst, *off), path[-1]
    assert turned
    assert 0.01 * bicycle.tracking_error <= worst <= bicycle.tracking_error


@pytest.mark.parametrize("vehicle", [*DRIVES.values(), *BICYCLES.values()], ids=[*DRIVES, *BICYCLES])
def test_driving_is_the_solution_of_the_equations_of_motion(vehicle) -> None:
    rng = np.random.default_rng(1)
    for _ in range(10):
        pose = Pose(rng.normal(size=2), rng.uniform(-3, 3), rng.uniform(0, 1), rng.uniform(-0.4, 0.4))
        command = Command(rng.uniform(0, 1), rng.uniform(-0.4, 0.4))
        after, expected = vehicle.drive(pose, command), rolled(vehicle, pose, command)[-1]
        np.testing.assert_allclose([*after.position, after.heading], [*expected.position, expected.heading], atol=1e-9)
        half = vehicle.drive(pose, command, 0.5 * vehicle.period)
        assert half.speed == pytest.approx(0.5 * (pose.speed + command.speed))


def test_a_drive_obeys_its_wheels_whatever_the_plan() -> None:
    """Also from speeds above the limits of the point, and with plans that no wheel can follow."""
    drive, rng = DRIVES["service"], np.random.default_rng(2)
    for _ in range(200):
        left, right = rng.uniform(-1.0, 1.0, 2)
        pose = Pose(rng.normal(size=2), rng.uniform(-3, 3), 0.5 * (left + right), (right - left) / drive.track)
        state = State(pose.position + rng.normal(size=2), 5.0 * rng.normal(size=2))
        command = drive.command(pose, planned(state, 50.0 * rng.normal(size=2), 0.05, 0.0), 0.0)
        assert within_wheel_limits(drive, pose, command)


@pytest.mark.parametrize("seed", draws(range(6), 2))
def test_a_drive_brings_its_axle_to_the_goal_from_rest(seed: int) -> None:
    """Whatever the heading, past rocks; the body keeps clear of them on the integrated motion."""
    rng, drive = np.random.default_rng(seed), DRIVES["service"]
    angle = rng.uniform(-pi, pi)
    goal = Goal(Stationary(4.0 * np.array([cos(angle), sin(angle)])), 0.05, stop=True)
    rock = Obstacle(Disc(0.3), Stationary(2.0 * np.array([cos(angle + 0.1), sin(angle + 0.1)])))
    robot = Navigator(method("nao"), drive.shape(0.25), drive.limits, period=drive.period)
    pose, decision, nearest = Pose((0.0, 0.0), rng.uniform(-pi, pi)), None, np.inf
    for k in range(400):
        t = k * drive.period
        if goal.reached(pose.position, pose.velocity, t):
            break
        state = drive.state(pose, decision, t)
        decision = robot.decide(state, [rock], drive.goal(pose, goal, t), now=t, previous=decision)
        path = rolled(drive, pose, drive.command(pose, decision, t), 4)
        nearest = min(nearest, *(np.linalg.norm(p.position - rock.trajectory.initial_position) - 0.55 for p in path))
        pose = path[-1]
    assert goal.reached(pose.position, pose.velocity, 400.0)
    assert nearest >= robot.margin


def test_a_drive_turns_in_place() -> None:
    """A goal behind, farther than the point is ahead: the axle stays nearly where it is while the drive turns."""
    drive = DRIVES["service"]
    robot = Navigator(method("nao"), drive.shape(0.25), drive.limits, period=drive.period)
    goal, pose, decision, farthest = Goal(Stationary((0.0, 3.0)), 0.05, stop=True), Pose((0.0, 0.0), 0.0), None, 0.0
    for k in range(300):
        t = k * drive.period
        if abs(pose.heading - 0.5 * pi) < 0.2:
            break
        state = drive.state(pose, decision, t)
        decision = robot.decide(state, [], drive.goal(pose, goal, t), now=t, previous=decision)
        pose = drive.drive(pose, drive.command(pose, decision, t))
        farthest = max(farthest, float(np.linalg.norm(pose.position)))
    assert abs(pose.heading - 0.5 * pi) < 0.2
    assert farthest < 1.5 * drive.lever


@pytest.mark.parametrize("bearing", [0.0, 1.5, 3.1, -2.0])
def test_a_bicycle_reaches_goals_on_all_sides_from_rest(bearing: float) -> None:
    bicycle = BICYCLES["robot"]
    robot = Navigator(method("nao"), bicycle.shape(0.3, bicycle.lever), bicycle.limits, period=bicycle.period)
    goal = Goal(Stationary(5.0 * np.array([cos(bearing), sin(bearing)])), 0.2, stop=True)
    pose, decision = Pose((0.0, 0.0), 0.0), None
    for k in range(300):
        t = k * bicycle.period
        if goal.reached(pose.position, pose.velocity, t):
            break
        state = bicycle.state(pose, decision, t)
        decision = robot.decide(state, [], bicycle.goal(pose, goal, t), now=t, previous=decision)
        pose = bicycle.drive(pose, bicycle.command(pose, decision, t))
    assert goal.reached(pose.position, pose.velocity, 0.0)


def judged(vehicle, body, obstacles, goal, pose: Pose, center=0.0, periods: int = 300, reverse_after: float = 3.0):
    """A run by the motion of the body: its poses, its outcomes, and whether it arrived."""
    robot = VehicleNavigator(vehicle, method("nao"), body, center, horizon=4.0, reverse_after=reverse_after)
    table, decision, poses, safe = ObstacleTable(obstacles), None, [pose], []
    for k in range(periods):
        t = k * vehicle.period
        if goal.reached(pose.position, pose.velocity, t):
            return poses, safe, True
        decision = robot.decide(pose, table, goal, now=t, previous=decision)
        safe.append(decision.outcome.safe)
        path = rolled(vehicle, pose, decision.command, 5)
        poses += path
        np.testing.assert_allclose(path[-1].position, decision.motions[1, :2], atol=1e-7)
        pose = path[-1]
    return poses, safe, False


@pytest.mark.parametrize("kind", ["drive", "bicycle"])
def test_a_body_keeps_clear_where_its_own_motion_is_judged(kind: str) -> None:
    """Past a person that crosses; the clearance is that of the integrated body, not of the point ahead."""
    vehicle = DRIVES["quick"] if kind == "drive" else BICYCLES["robot"]
    person = Obstacle(Disc(0.3), ConstantVelocity((3.0, -2.0), (0.0, 0.8)))
    rock = Obstacle(Disc(0.4), Stationary((5.5, 0.1)))
    goal = Goal(Stationary((8.0, 0.0)), 0.2, stop=True)
    poses, safe, arrived = judged(vehicle, Disc(0.3), [person, rock], goal, Pose((0.0, 0.0), 0.3))
    assert arrived
    assert all(safe)
    times = np.concatenate([[0.0], vehicle.period * (np.arange(len(poses) - 1) + 1) / 5])
    places = np.array([pose.position for pose in poses])
    for one, radius in ((person, 0.6), (rock, 0.7)):
        away = np.linalg.norm(places - one.trajectory.position(times), axis=1) - radius
        assert away.min() >= 0.05 - 1e-6
        assert away.min() < 1.0


def test_a_rectangle_that_turns_with_its_vehicle_passes_a_gap_narrower_than_its_length() -> None:
    """Its enclosing disc cannot."""
    gap = 1.1
    walls = [
        Obstacle(Polyline([(2.0, 0.5 * side * gap), (2.0, 6.0 * side)], 0.02), Stationary((0.0, 0.0)))
        for side in (-1, 1)
    ]
    body, goal = Rectangle(1.3, 0.5), Goal(Stationary((5.0, 0.0)), 0.2, stop=True)
    assert 2.0 * body.bounding_radius > gap
    poses, safe, arrived = judged(DRIVES["quick"], body, walls, goal, Pose((0.0, 0.3), 0.0))
    assert arrived
    assert all(safe)
    for pose in poses:
        e = np.array([cos(pose.heading), sin(pose.heading)])
        n = np.array([-e[1], e[0]])
        corners = pose.position + np.array([0.65 * x * e + 0.25 * y * n for x in (-1, 1) for y in (-1, 1)])
        # A side of the body that crosses the line of the walls does so within the gap.
        for a, b in ((0, 1), (0, 2), (1, 3), (2, 3)):
            (x, y), (u, v) = corners[a], corners[b]
            if (x - 2.0) * (u - 2.0) < 0.0:
                assert abs(y + (2.0 - x) / (u - x) * (v - y)) < 0.5 * gap


CORNER = [Obstacle(Polyline([(1.05, -6.0), (1.05, 0.2)], 0.02), Stationary((0.0, 0.0)))]
"""A wall in front of a bicycle at the origin, nearer than its turning radius."""
ROUND_THE_CORNER = Goal(Stationary((3.0, 3.0)), 0.2, stop=True)
AHEAD = Goal(Stationary((4.0, 0.0)), 0.2, stop=True)


@pytest.mark.parametrize("moves", [True, False], ids=["beside it", "in its way"])
@pytest.mark.parametrize("name", ["drive", "bicycle"])
def test_a_vehicle_that_overlaps_a_body_stops_before_a_wall(name: str, moves: bool) -> None:
    """A person 20 mm within its body walks at its velocity, or stands; the body gets no deeper than a few mm."""
    vehicle = DifferentialDrive(0.4, 1.2, 3.0, 0.1, max_speed=1.0) if name == "drive" else REVERSING
    robot = VehicleNavigator(vehicle, method("nao"), Disc(0.3), horizon=3.0)
    wall = ObstacleTable([Obstacle(Polyline([(4.0, -3.0), (4.0, 3.0)]), Stationary((0.0, 0.0)))])
    goal, pose, decision, escaped = (
        Goal(Stationary((3.2, 0.0)), 0.1, stop=True),
        Pose((0.0, 0.0), 0.0, 0.6),
        None,
        False,
    )
    person = np.array([0.0, 0.58])
    for k in range(50):
        velocity = pose.velocity if moves and k < 25 else np.zeros(2)
        people = Tracks([person], [velocity], 0.3, 0.1 * k)
        decision = robot.decide(pose, [wall, people], goal, now=0.1 * k, previous=decision)
        escaped = escaped or decision.outcome is Outcome.ESCAPING
        pose, person = vehicle.drive(pose, decision.command), person + 0.1 * velocity
        assert pose.position[0] <= 3.7 + 1e-5
        assert np.linalg.norm(pose.position - person) >= 0.58 - 5e-3
    assert escaped


def test_a_bicycle_reverses_out_of_a_place_that_walls_block() -> None:
    poses, safe, arrived = judged(REVERSING, Disc(0.3), CORNER, ROUND_THE_CORNER, Pose((0.0, 0.0), 0.0), 0.4)
    assert arrived
    assert all(safe)
    speeds, times = np.array([pose.speed for pose in poses]), REVERSING.period * np.arange(len(poses)) / 5.0
    assert -0.6 - 1e-12 <= speeds.min() < -0.3
    assert times[speeds < 0.0][0] >= 3.0
    bodies = np.array([pose.position + 0.4 * pose.direction for pose in poses])
    assert (np.hypot(bodies[:, 0] - 1.05, np.maximum(bodies[:, 1] - 0.2, 0.0)) - 0.32).min() >= 0.05 - 1e-6


@pytest.mark.parametrize("settings", [{"max_reverse_speed": 0.0}, {"reverse_after": 60.0}], ids=str)
def test_a_bicycle_that_does_not_reverse_stays_in_front_of_a_wall(settings) -> None:
    after = settings.pop("reverse_after", 3.0)
    poses, safe, arrived = judged(
        replace(REVERSING, **settings), Disc(0.3), CORNER, ROUND_THE_CORNER, Pose((0.0, 0.0), 0.0), 0.4, 100, after
    )
    assert not arrived
    assert all(safe)
    assert min(pose.speed for pose in poses) >= 0.0


def test_a_bicycle_waits_for_what_moves() -> None:
    """It is blocked for longer than it waits in front of walls."""
    queue = [Obstacle(Disc(0.45), ConstantVelocity((1.6, y), (0.0, 1e-3))) for y in (-1.6, -0.8, 0.0, 0.8, 1.6)]
    poses, safe, arrived = judged(REVERSING, Disc(0.3), queue, AHEAD, Pose((0, 0), 0), 0.4, 100)
    assert not arrived
    assert all(safe)
    assert min(pose.speed for pose in poses) >= 0.0


def test_a_bicycle_without_another_way_reverses_at_once() -> None:
    """A person comes towards it between walls."""
    walls = [Obstacle(Polyline([(-9.0, y), (8.0, y)], 0.02), Stationary((0.0, 0.0))) for y in (-0.6, 0.6)]
    person = Obstacle(Disc(0.4), ConstantVelocity((3.0, 0.0), (-0.35, 0.0)))
    for bicycle, least in ((REVERSING, 0.05), (BICYCLES["robot"], -0.2)):
        poses, safe, _ = judged(bicycle, Disc(0.3), [*walls, person], AHEAD, Pose((0, 0), 0), 0.4, 120)
        times = np.concatenate([[0.0], 0.1 * (np.arange(len(poses) - 1) + 1) / 5])
        bodies = np.array([pose.position + 0.4 * pose.direction for pose in poses])
        clearance = (np.linalg.norm(bodies - person.trajectory.position(times), axis=1) - 0.7).min()
        assert (clearance >= 0.05 - 1e-6) == all(safe) == (bicycle is REVERSING)
        assert clearance >= least - 1e-6 or bicycle is not REVERSING


@pytest.mark.parametrize("distance", [-2.0, -0.3, 0.5, 1.5])
@pytest.mark.parametrize("speed", [-0.4, 0.0, 1.0])
def test_a_vehicle_stands_after_a_distance(distance: float, speed: float) -> None:
    """All commands are within the limits, and a plan of the point along the motion is followed exactly."""
    pose = Pose((1.0, 2.0), 0.4, speed, 0.1)
    motions = REVERSING.standing_after(pose, distance, -0.5, 80)
    speeds, turns = motions[:, 3], motions[:, 4]
    assert speeds[-1] == speeds[-2] == 0.0
    assert speeds.min() >= -0.6
    assert np.abs(np.diff(speeds)).max() <= 1.5 * 0.1 + 1e-12
    assert np.abs(np.diff(turns)).max() <= 6.0 * 0.1 + 1e-12
    driven = np.sign(distance) * 0.05 * (speeds[1:] + speeds[:-1])
    assert driven[driven > 0.0].sum() == pytest.approx(abs(distance), abs=0.02) or driven.sum() > abs(distance) > 0.0
    expected = pose
    for command in motions[1:, 3:]:
        expected = rolled(REVERSING, expected, Command(*command))[-1]
    np.testing.assert_allclose(motions[-1, :2], expected.position, atol=1e-6)
    point = REVERSING.body_motion(motions, REVERSING.lever)
    followed = REVERSING.follow(pose, Manoeuvre(point, point.start, np.zeros(2), 5.0), 5.0, 80)
    np.testing.assert_allclose(followed[:, :2], motions[:, :2], atol=2e-3)


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("vehicle", [DRIVES["quick"], BICYCLES["car"]], ids=["drive", "bicycle"])
def test_the_error_of_cubic_pieces_is_stated(vehicle, backwards: bool) -> None:
    rng, side = np.random.default_rng(3), -1.0 if backwards else 1.0
    for _ in range(20):
        pose = Pose(rng.normal(size=2), 0.3, side * rng.uniform(0, 2), rng.uniform(-0.5, 0.5))
        command, h, ahead = Command(side * rng.uniform(0, 2), rng.uniform(-0.5, 0.5)), vehicle.period, 0.7
        path = [pose, *rolled(vehicle, pose, command, 40)]
        e = np.array([(cos(p.heading), sin(p.heading)) for p in path])
        n = np.stack([-e[:, 1], e[:, 0]], axis=1)
        rates = np.array([vehicle.turn_rate(p.speed, p.turn) for p in path])
        places = np.array([p.position for p in path]) + ahead * e
        ends = np.array([p.speed for p in path])[:, None] * e + ahead * rates[:, None] * n
        control = hermite(np.array([0.0, h]), places[[0, -1]], ends[[0, -1]]).points[0]
        s = np.linspace(0.0, 1.0, 41)[:, None]
        r = 1.0 - s
        cubic = r**3 * control[0] + 3 * r * r * s * control[1] + 3 * r * s * s * control[2] + s**3 * control[3]
        turning = vehicle.turning(np.array([pose.speed, command.speed]), np.array([pose.turn, command.turn]))
        stated = hermite_error(np.array([pose.speed, command.speed]), turning, ahead, h)
        assert np.linalg.norm(cubic - places, axis=1).max() <= stated + 1e-9


def test_bounds_take_the_heading_of_the_state() -> None:
    """Also at rest, where the velocity has none."""
    rest = State((0, 0), (0, 0), heading=0.5 * pi)
    normals, offsets = TurningRadius(2.0).half_spaces(rest)
    assert np.abs(normals @ (0.0, 1.0)).max() < 1e-15
    assert np.all(offsets == 0.0)
    assert np.any(HeadingCone(0.5).half_spaces(rest)[0] @ (1.0, 0.1) > 0.0)
    assert len(TurningRadius(2.0).half_spaces(State((0, 0), (0, 0)))[0]) == 0


def test_a_path_ends_with_the_axle_at_its_end() -> None:
    drive = DRIVES["service"]
    goal = drive.goal(Pose((0, 0), 0.0), PathGoal([(0, 0), (4, 0), (4, 3)], tolerance=0.1), 0.0)
    np.testing.assert_allclose(goal.points[-1], (4.0, 3.0 + drive.lever))


INVALID = {
    "track: expected a number above 0, found 0": lambda: DifferentialDrive(0.0, 1.0, 1.0),
    "ahead: expected a number above 0, found -1": lambda: DifferentialDrive(1.0, 1.0, 1.0, -1.0),
    "disturbance: expected 0 or more, found -1": lambda: DifferentialDrive(1.0, 1.0, 1.0, disturbance=-1.0),
    "max_steering: expected less than pi / 2": lambda: Bicycle(1.0, 1.6, 1.0, 1.0, 1.0),
    "max_reverse_speed: expected 0 or more, found -1": lambda: replace(REVERSING, max_reverse_speed=-1.0),
    "reverse_after: expected 0 or more, found -1": lambda: VehicleNavigator(
        REVERSING, method("nao"), Disc(1), reverse_after=-1.0
    ),
    "max_steering_rate: expected a number above 0": lambda: Bicycle(1.0, 0.5, 0.0, 5.0, 1.0),
    "heading: expected none in space, found 1": lambda: State((0, 0, 0), (0, 0, 0), heading=1.0),
    "heading: expected finite numbers, found .nan": lambda: Pose((0, 0), np.nan),
    "pose: expected a Pose, found": lambda: DRIVES["quick"].state((0, 0)),
    "pose: expected a Pose, found .0, 0.": lambda: DRIVES["quick"].drive((0, 0), Command(1.0, 0.0)),
    "command: expected a Command, found .1, 0.": lambda: DRIVES["quick"].drive(Pose((0, 0), 0), (1, 0)),
    "decision: expected a Decision, found": lambda: DRIVES["quick"].command(Pose((0, 0), 0), 1, 0.0),
    "goal: expected a Goal or PathGoal, found": lambda: DRIVES["quick"].goal(Pose((0, 0), 0), (1, 1)),
    "body: expected a Disc or a Rectangle, found Polyline": lambda: VehicleNavigator(
        DRIVES["quick"], method("nao"), Polyline([(0, 0), (1, 0)])
    ),
    "vehicle: expected a vehicle, such as DifferentialDrive": lambda: VehicleNavigator(1, method("nao"), Disc(1)),
}


@pytest.mark.parametrize("message", INVALID)
def test_bad_input_gets_one_clear_message(message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        INVALID[message]()
