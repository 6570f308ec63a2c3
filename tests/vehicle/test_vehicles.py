"""Vehicles on wheels: driving against an independent integration, limits, arrivals, and clearance of the body."""

from dataclasses import replace
from math import cos, hypot, pi, sin, tan
from typing import Any, NamedTuple

import numpy as np
import pytest
import shapely
from draws import draws

from slalom import (
    Circular,
    ConstantVelocity,
    Disc,
    Goal,
    HeadingCone,
    Obstacle,
    ObstacleTable,
    Outcome,
    PathGoal,
    Polygon,
    Polyline,
    Rectangle,
    State,
    Stationary,
    Tracks,
    TurningRadius,
    method,
)
from slalom.vehicle import Bicycle, Command, DifferentialDrive, Pose, VehicleDecision, VehicleNavigator

DRIVES = {
    "service": DifferentialDrive(0.35, 1.0, 3.0, period=0.05),
    "quick": DifferentialDrive(0.4, 2.0, 8.0, ahead=0.25),
    "long period": DifferentialDrive(0.3, 1.5, 6.0, period=0.2),
    "with lag": DifferentialDrive(0.4, 1.5, 4.0, lag=0.25),
    "forward only": DifferentialDrive(0.35, 1.0, 3.0, max_reverse_speed=0.0),
    "hardly backwards": DifferentialDrive(0.4, 1.5, 4.0, lag=0.25, max_reverse_speed=0.2),
}
REVERSING = Bicycle(0.4, 0.6, 6.0, 1.5, 1.5, max_reverse_speed=0.6)
BICYCLES = {
    "robot": Bicycle(0.4, 0.6, 6.0, 1.5, 1.5),
    "car": Bicycle(2.7, 0.55, 1.5, 5.0, 3.0, ahead=1.35),
    "with lag": Bicycle(0.4, 0.6, 6.0, 1.5, 1.5, max_reverse_speed=0.6, lag=(0.2, 0.1)),
}
VEHICLES = {**{f"drive, {k}": v for k, v in DRIVES.items()}, **{f"bicycle, {k}": v for k, v in BICYCLES.items()}}


# Oracles, from the equations of motion and from polygons.


class Actuators(NamedTuple):
    """Values (2,) of the actuators: speed and steering, or the speeds of the left and the right wheel."""

    values: np.ndarray
    most: np.ndarray  # largest values
    least: np.ndarray
    rates: np.ndarray  # largest rates
    lags: np.ndarray  # [s]


def actuators(vehicle, speed: float, turn: float) -> Actuators:
    """Those of a speed and a turn."""
    lags = np.array(vehicle.lags)
    if isinstance(vehicle, Bicycle):
        most = np.array([vehicle.max_speed, vehicle.max_steering])
        least = np.array([-vehicle.max_reverse_speed, -vehicle.max_steering])
        rates = np.array([vehicle.max_acceleration, vehicle.max_steering_rate])
        return Actuators(np.array([speed, turn]), most, least, rates, lags)
    half, both = 0.5 * vehicle.track * turn, np.ones(2)
    fastest = vehicle.max_wheel_speed * both
    rates = vehicle.max_wheel_acceleration * both
    return Actuators(np.array([speed - half, speed + half]), fastest, -fastest, rates, lags[:1] * both)


def slowest(vehicle) -> float:
    """The least speed [m/s]."""
    return -(vehicle.limits.max_speed if vehicle.max_reverse_speed is None else vehicle.max_reverse_speed)


def motion_of(vehicle, values: np.ndarray) -> tuple[float, float]:
    """Speed and turn for values of the actuators."""
    if isinstance(vehicle, Bicycle):
        return float(values[0]), float(values[1])
    return float(values.mean()), float(values[1] - values[0]) / vehicle.track


def rolled(vehicle, pose: Pose, command: Command, steps: int = 20) -> list[Pose]:
    """Poses at `steps` times of a period by the classical Runge-Kutta method, from the equations of the actuators."""
    h, begin = vehicle.period / steps, actuators(vehicle, pose.speed, pose.turn)
    wanted, (rates, lags) = actuators(vehicle, *command).values, begin[3:]
    ramp = np.clip((wanted - begin.values) / vehicle.period, -rates, rates)
    lagging = lags > 0.0

    def change(y: np.ndarray) -> np.ndarray:
        speed, turn = motion_of(vehicle, y[3:])
        rate = speed * tan(turn) / vehicle.wheelbase if isinstance(vehicle, Bicycle) else turn
        slow = np.clip((wanted - y[3:]) / np.where(lagging, lags, 1.0), -rates, rates)
        return np.array([speed * cos(y[2]), speed * sin(y[2]), rate, *np.where(lagging, slow, ramp)])

    y, found = np.array([*pose.position, pose.heading, *begin.values]), []
    for _ in range(steps):
        k1 = change(y)
        k2 = change(y + 0.5 * h * k1)
        k3 = change(y + 0.5 * h * k2)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + change(y + h * k3))
        found.append(Pose(y[:2], y[2], *motion_of(vehicle, y[3:])))
    return found


def placed(shape, position, heading: float, shrunk: float = 0.0) -> tuple[Any, float]:
    """A geometry, and the radius by which it is grown; a shape with an inside loses `shrunk` [m] all around."""
    if isinstance(shape, Disc):
        return shapely.Point(*position), shape.radius - shrunk
    if isinstance(shape, Rectangle):
        x, y = 0.5 * shape.length - shrunk, 0.5 * shape.width - shrunk
        corners = np.array([(x, y), (-x, y), (-x, -y), (x, -y)])
        outline = shapely.Polygon
    else:
        corners, shrunk = np.asarray(shape.points if isinstance(shape, Polyline) else shape.corners), 0.0
        outline = shapely.LineString if isinstance(shape, Polyline) else shapely.Polygon
    c, s = cos(heading), sin(heading)
    return outline(corners @ np.array([[c, s], [-s, c]]) + np.asarray(position)), getattr(shape, "radius", 0.0)


def gap(body, center: float, pose: Pose, obstacle: Obstacle, now: float, shrunk: float = 0.0) -> float:
    """Distance [m] of a body at a pose from an obstacle; at most 0 where they touch."""
    velocity = obstacle.trajectory.velocity(now)
    facing = float(np.arctan2(velocity[1], velocity[0])) if isinstance(obstacle.shape, Rectangle) else 0.0
    there, grown = placed(obstacle.shape, obstacle.trajectory.position(now), facing)
    e = np.array([cos(pose.heading), sin(pose.heading)])
    here, radius = placed(body, pose.position + center * e, pose.heading, shrunk)
    return float(here.distance(there)) - radius - grown


class Drive(NamedTuple):
    """A simulated drive: poses at times [s], decisions, and whether it arrived."""

    times: np.ndarray
    poses: list[Pose]
    decisions: list[VehicleDecision]
    arrived: bool

    @property
    def safe(self) -> bool:
        return all(each.safe for each in self.decisions)

    @property
    def speeds(self) -> np.ndarray:
        return np.array([pose.speed for pose in self.poses])


def driven(robot: VehicleNavigator, obstacles, goal, pose: Pose, periods: int = 300, steps: int = 5) -> Drive:
    """Decisions for a vehicle that moves by the equations, until it arrives."""
    h, around, decision = robot.period, ObstacleTable(obstacles), None
    times, poses, decisions, arrived = [0.0], [pose], list[VehicleDecision](), False
    for k in range(periods):
        now = k * h
        arrived = goal is not None and goal.reached(pose.position, pose.velocity, now, pose.heading)
        if arrived:
            break
        decision = robot.decide(pose, around, goal, now=now, previous=decision)
        path = rolled(robot.vehicle, pose, decision.command, steps)
        times += [now + h * (j + 1) / steps for j in range(steps)]
        poses, pose = poses + path, path[-1]
        decisions.append(decision)
    return Drive(np.array(times), poses, decisions, arrived)


def least_gap(run: Drive, robot: VehicleNavigator, obstacles, shrunk: float = 0.0) -> float:
    """The least distance [m] of the body from obstacles on a drive."""
    return min(
        gap(robot.body, robot.center, pose, obstacle, now, shrunk)
        for now, pose in zip(run.times, run.poses, strict=True)
        for obstacle in obstacles
    )


def at(x: float, y: float, tolerance: float = 0.2, heading: float | None = None) -> Goal:
    """A goal to stop at."""
    return Goal(Stationary((x, y)), tolerance, stop=True, heading=heading)


def wall(*points, radius: float = 0.02) -> Obstacle:
    """A wall at rest."""
    return Obstacle(Polyline(list(points), radius), Stationary((0.0, 0.0)))


# Driving, and limits.


def random_pose(vehicle, rng) -> Pose:
    """A pose that obeys the limits."""
    bounds = actuators(vehicle, 0.0, 0.0)
    while True:
        speed, turn = motion_of(vehicle, rng.uniform(bounds.least, bounds.most))
        if slowest(vehicle) <= speed <= vehicle.limits.max_speed:
            return Pose(rng.normal(size=2), rng.uniform(-pi, pi), speed, turn)


@pytest.mark.parametrize("name", VEHICLES)
def test_driving_is_the_solution_of_the_equations_of_motion(name: str) -> None:
    """Also for a part of a period; with a lag exact as long as rates do not bound the actuators."""
    vehicle, rng = VEHICLES[name], np.random.default_rng(1)
    for k in range(12):
        pose = random_pose(vehicle, rng)
        far = random_pose(vehicle, rng)
        near = 0.03 if k % 2 else 1.0
        command = Command(pose.speed + near * (far.speed - pose.speed), pose.turn + near * (far.turn - pose.turn))
        path = rolled(vehicle, pose, command, 40)
        for one, expected in ((vehicle.drive(pose, command), path[-1]), (vehicle.drive(pose, command, 0.0), pose)):
            assert one.speed == pytest.approx(expected.speed, abs=1e-5)
            assert one.turn == pytest.approx(expected.turn, abs=1e-5)
        after = vehicle.drive(pose, command)
        saturated = near == 1.0 and max(vehicle.lags) > 0.0
        np.testing.assert_allclose(after.position, path[-1].position, atol=2e-3 if saturated else 1e-7)
        assert after.heading == pytest.approx(path[-1].heading, abs=2e-2 if saturated else 1e-7)
        if not saturated:
            half = vehicle.drive(pose, command, 0.5 * vehicle.period)
            np.testing.assert_allclose(
                [*half.position, half.heading], [*path[19].position, path[19].heading], atol=1e-7
            )
            assert half.speed == pytest.approx(path[19].speed)


@pytest.mark.parametrize("name", VEHICLES)
def test_commands_obey_the_limits_from_every_pose(name: str) -> None:
    """Of wheels and steering: at the ends of all periods; goals on all sides, among rocks."""
    vehicle, rng = VEHICLES[name], np.random.default_rng(2)
    robot = VehicleNavigator(vehicle, method("nao"), Disc(0.25), horizon=2.0)
    for _ in range(8):
        pose = random_pose(vehicle, rng)
        rock = Obstacle(Disc(0.3), Stationary(pose.position + rng.uniform(0.6, 3.0) * pose.direction))
        decision = robot.decide(pose, [rock], at(*rng.uniform(-4.0, 4.0, 2)))
        bounds = actuators(vehicle, 0.0, 0.0)
        states = np.array([actuators(vehicle, speed, turn).values for speed, turn in decision.motions[:, 3:]])
        assert np.all(states <= bounds.most + 1e-9)
        assert np.all(states >= bounds.least - 1e-9)
        assert np.all(np.abs(np.diff(states, axis=0)) <= bounds.rates * vehicle.period + 1e-9)
        wanted = actuators(vehicle, *decision.command).values
        assert np.all(wanted <= bounds.most + 1e-6)
        assert np.all(wanted >= bounds.least - 1e-6)
        assert min(decision.command.speed, *decision.motions[:, 3]) >= slowest(vehicle) - 1e-12
        # The command leads to the motion that was judged.
        after = rolled(vehicle, pose, decision.command, 40)[-1]
        np.testing.assert_allclose([after.speed, after.turn], decision.motions[1, 3:], atol=1e-4)


def test_further_limits_of_a_drive_hold() -> None:
    """Of the speed of the point, the turn rate and its change."""
    drive = DifferentialDrive(0.4, 2.0, 8.0, max_speed=0.7, max_turn_rate=0.8, max_turn_acceleration=1.6)
    robot = VehicleNavigator(drive, method("nao"), Disc(0.25))
    run = driven(robot, [], at(-3.0, 2.0), Pose((0.0, 0.0), 0.0))
    turns = np.array([pose.turn for pose in run.poses])
    assert run.arrived
    assert np.abs(turns).max() <= 0.8 + 1e-9
    assert np.abs(np.diff(turns[::5])).max() <= 1.6 * drive.period + 1e-9
    assert 0.6 < np.abs(run.speeds).max() <= 0.7 + 1e-6


ON_ALL_SIDES = draws(
    ["drive, service", "drive, with lag", "drive, forward only", "bicycle, robot", "bicycle, with lag"], 5
)


@pytest.mark.parametrize("bearing", draws([1.5, pi, 0.0, 3.1, -2.0], 2))
@pytest.mark.parametrize("name", ON_ALL_SIDES)
def test_goals_on_all_sides_are_reached_from_rest(name: str, bearing: float) -> None:
    robot = VehicleNavigator(VEHICLES[name], method("nao"), Disc(0.25))
    run = driven(robot, [], at(4.0 * cos(bearing), 4.0 * sin(bearing)), Pose((0.0, 0.0), 0.0), 400)
    assert run.arrived
    assert run.safe
    assert run.times[-1] < 9.0
    assert run.speeds.min() >= slowest(robot.vehicle) - 1e-9


def test_a_goal_within_the_turning_circle_is_reached() -> None:
    for bicycle in (BICYCLES["robot"], REVERSING):
        run = driven(
            VehicleNavigator(bicycle, method("nao"), Disc(0.25)), [], at(0.0, 0.5, 0.05), Pose((0.0, 0.0), 0.0)
        )
        assert run.arrived


@pytest.mark.parametrize("kind", ["drive", "bicycle"])
def test_a_vehicle_that_does_not_back_turns_before_it_is_at_a_wall(kind: str) -> None:
    """It would have no way from there. The end of the wall is 0.9 m to the side."""
    if kind == "drive":
        robot = VehicleNavigator(DRIVES["forward only"], method("nao"), Rectangle(0.6, 0.45), 0.1)
    else:
        robot = VehicleNavigator(BICYCLES["robot"], method("nao"), Rectangle(0.7, 0.4), 0.2)
    obstacles = [wall((2.6, 0.9), (2.6, -5.0))]
    run = driven(robot, obstacles, at(6.0, -0.5), Pose((0.0, 0.0), 0.0))
    assert run.arrived
    assert run.safe
    assert run.speeds.min() >= -1e-9
    assert least_gap(run, robot, obstacles) > 0.0


def test_a_drive_turns_in_place() -> None:
    """A goal beside it: the axle stays nearly where it is while the drive turns."""
    robot = VehicleNavigator(DRIVES["service"], method("nao"), Disc(0.25))
    run = driven(robot, [], at(0.0, 3.0, 0.05), Pose((0.0, 0.0), 0.0))
    turned = next(k for k, pose in enumerate(run.poses) if abs(pose.heading - 0.5 * pi) < 0.2)
    assert run.arrived
    assert max(float(np.linalg.norm(pose.position)) for pose in run.poses[:turned]) < 2.0 * robot.vehicle.lever


def noisy(seed: int, lag: float, delay: float) -> tuple[float, float]:
    """Time [s] to a goal at 8.25 m, and reversals of commanded turns per second, with noise where there is a lag."""
    drive = DifferentialDrive(0.4, 1.0, 2.0, lag=lag, delay=delay)
    robot, goal = VehicleNavigator(drive, method("nao"), Disc(0.25)), at(8.25, 0.0)
    rng, pose, decision, turns = np.random.default_rng(seed), Pose((0.0, 0.0), 0.3), None, []
    sizes = np.array([0.005, 0.005, np.radians(0.2), 0.01, 0.01]) * (lag > 0.0)
    late = [Command(0.0, 0.0)] * round(delay / drive.period)
    for k in range(400):
        if goal.reached(pose.position, pose.velocity, 0.0):
            signs = np.sign([turn for turn in turns if abs(turn) > 0.05])
            return k * drive.period, float(np.sum(signs[1:] != signs[:-1])) / (k * drive.period)
        measured = pose.motion + sizes * rng.normal(size=5)
        seen = Pose(measured[:2], *measured[2:])
        decision = robot.decide(seen, [], goal, now=k * drive.period, previous=decision)
        turns.append(decision.command.turn)
        late.append(decision.command)
        pose = rolled(drive, pose, late.pop(0), 4)[-1]
    return np.inf, np.inf


@pytest.mark.parametrize("lag", draws([0.3, 0.2, 0.4]))
def test_a_drive_with_lag_delay_and_noise_arrives_without_oscillations(lag: float) -> None:
    """Within 1.3 times the time without them; turns change their side at most every 2 s, on average over seeds."""
    without, _ = noisy(0, 0.0, 0.0)
    times, reversals = zip(*(noisy(seed, lag, 0.2) for seed in range(4)), strict=True)
    assert max(times) <= 1.3 * without
    assert np.mean(reversals) <= 0.5


@pytest.mark.parametrize("kind", ["drive", "bicycle"])
def test_a_body_keeps_its_margin(kind: str) -> None:
    """Past a person that crosses, and not by a detour."""
    vehicle = DRIVES["quick"] if kind == "drive" else BICYCLES["robot"]
    obstacles = [
        Obstacle(Disc(0.3), ConstantVelocity((3.0, -2.0), (0.0, 0.8))),
        Obstacle(Disc(0.4), Stationary((5.5, 0.1))),
    ]
    robot = VehicleNavigator(vehicle, method("nao"), Disc(0.3), horizon=4.0)
    run = driven(robot, obstacles, at(8.0, 0.0), Pose((0.0, 0.0), 0.3))
    assert run.arrived
    assert run.safe
    assert 0.05 - 1e-4 <= least_gap(run, robot, obstacles[:1]) < 1.0
    # On a way, places at rest are entered as far as the body fits.
    assert (0.05 - 1e-4 if kind == "drive" else 0.0) <= least_gap(run, robot, obstacles[1:]) < 1.0


def scene(rng) -> list[Obstacle]:
    """Moving discs, rectangles that turn, and a bent wall, none of them near the origin."""
    found = []
    for _ in range(3):
        place = rng.uniform((1.5, -3.0), (6.0, 3.0))
        found.append(Obstacle(Disc(rng.uniform(0.1, 0.4)), ConstantVelocity(place, rng.uniform(-0.6, 0.6, 2))))
    for _ in range(2):
        center = rng.uniform((3.5, -2.5), (7.0, 2.5))
        circle = Circular(center, rng.uniform(0.3, 1.0), rng.choice([-0.5, 0.5]), rng.uniform(-pi, pi))
        found.append(Obstacle(Rectangle(0.9, 0.4), circle, heading="motion"))
    corner = rng.uniform((2.5, -2.0), (5.0, 2.0))
    return [*found, wall(corner + rng.uniform(0.3, 1.0, 2), corner, corner + rng.uniform((0.3, -1.0), (1.0, -0.3)))]


@pytest.mark.parametrize("seed", draws(range(8), 4))
@pytest.mark.parametrize("kind", ["drive", "bicycle"])
def test_safe_decisions_never_touch(kind: str, seed: int) -> None:
    """In drawn scenes, for rectangles; overlaps count from a thousandth of the size of the body on."""
    rng = np.random.default_rng([seed, len(kind)])
    vehicle, center = (DRIVES["quick"], 0.1) if kind == "drive" else (REVERSING, 0.2)
    body, obstacles = Rectangle(rng.uniform(0.5, 1.0), rng.uniform(0.2, 0.5)), scene(rng)
    robot = VehicleNavigator(vehicle, method("nao"), body, center, horizon=3.0)
    run = driven(robot, obstacles, at(7.0, 0.0), Pose((0.0, 0.0), rng.uniform(-0.5, 0.5)), 100)
    # What follows an unsafe decision is no matter of this law.
    safe = next((k for k, each in enumerate(run.decisions) if not each.safe), len(run.decisions))
    count = 5 * safe + 1
    first = Drive(run.times[:count], run.poses[:count], run.decisions[:safe], run.arrived)
    assert safe > 10
    assert least_gap(first, robot, obstacles, 1e-3 * body.bounding_radius) > 0.0


def test_a_rectangle_that_turns_with_its_vehicle_passes_a_gap_narrower_than_its_length() -> None:
    """Its enclosing disc cannot."""
    walls = [wall((2.0, 0.55 * side), (2.0, 6.0 * side)) for side in (-1, 1)]
    body = Rectangle(1.3, 0.5)
    robot = VehicleNavigator(DRIVES["quick"], method("nao"), body, horizon=4.0)
    assert 2.0 * body.bounding_radius > 1.1
    run = driven(robot, walls, at(5.0, 0.0), Pose((0.0, 0.3), 0.0))
    assert run.arrived
    assert run.safe
    assert least_gap(run, robot, walls) >= 0.05 - 1e-3


def test_a_triangle_is_judged_as_it_is() -> None:
    """It passes walls that its enclosing rectangle would touch."""
    body = Polygon([(0.6, 0.0), (-0.3, 0.4), (-0.3, -0.4)])
    robot = VehicleNavigator(DRIVES["quick"], method("nao"), body, horizon=3.0)
    corner = wall((0.5, 0.42), (3.0, 0.2), radius=0.0)
    run = driven(robot, [corner], at(4.0, -0.5), Pose((0.0, 0.0), 0.0))
    assert run.arrived
    assert run.safe
    assert least_gap(run, robot, [corner]) > 0.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_car_beside_a_wall_drives_off(side: float) -> None:
    """Without a touch, from 1 cm, though its rear swings out."""
    car = Bicycle(2.7, 0.55, 1.5, 5.0, 3.0, max_reverse_speed=2.0)
    robot = VehicleNavigator(car, method("nao"), Rectangle(4.5, 1.8), 1.35)
    y = side * 0.91
    walls = [wall((-20.0, y), (40.0, y), radius=0.0)]
    run = driven(robot, walls, at(15.0, -4.0 * side, 0.5), Pose((0.0, 0.0), 0.0))
    assert run.arrived
    assert run.safe
    assert least_gap(run, robot, walls, 1e-3 * robot.body.bounding_radius) > 0.0


@pytest.mark.parametrize("moves", [True, False], ids=["beside it", "in its way"])
@pytest.mark.parametrize("name", ["drive", "bicycle"])
def test_a_vehicle_that_overlaps_a_body_stops_before_a_wall(name: str, moves: bool) -> None:
    """A person 20 mm within its body walks at its velocity, or stands; the body gets no deeper than a few mm."""
    vehicle = DifferentialDrive(0.4, 1.2, 3.0, ahead=0.1, max_speed=1.0) if name == "drive" else REVERSING
    robot = VehicleNavigator(vehicle, method("nao"), Disc(0.3), horizon=3.0, contact_at_rest=True)
    end = ObstacleTable([Obstacle(Polyline([(4.0, -3.0), (4.0, 3.0)]), Stationary((0.0, 0.0)))])
    goal, pose, decision, escaped = at(3.2, 0.0, 0.1), Pose((0.0, 0.0), 0.0, 0.6), None, False
    person = np.array([0.0, 0.58])
    for k in range(50):
        velocity = pose.velocity if moves and k < 25 else np.zeros(2)
        people = Tracks([person], [velocity], 0.3, 0.1 * k)
        decision = robot.decide(pose, [end, people], goal, now=0.1 * k, previous=decision)
        escaped = escaped or decision.outcome is Outcome.ESCAPING
        pose, person = vehicle.drive(pose, decision.command), person + 0.1 * velocity
        assert pose.position[0] <= 3.7 + 1e-4
        assert np.linalg.norm(pose.position - person) >= 0.58 - 5e-3
    assert escaped


@pytest.mark.parametrize(
    ("vehicle", "place"),
    [(REVERSING, (0.2, 0.52)), (DRIVES["quick"], (0.87, 0.0))],
    ids=["bicycle, side", "drive, front"],
)
def test_a_body_that_overlaps_leaves(vehicle, place: tuple[float, float]) -> None:
    """A rock 30 mm within it: the overlap ends and the goal is reached."""
    robot = VehicleNavigator(vehicle, method("nao"), Rectangle(0.8, 0.5), 0.2)
    rock = Obstacle(Disc(0.3), Stationary(place))
    run = driven(robot, [rock], at(4.0, 0.0), Pose((0.0, 0.0), 0.0))
    gaps = np.array([gap(robot.body, 0.2, pose, rock, 0.0, 0.1) - 0.1 for pose in run.poses])
    assert run.arrived
    assert run.decisions[0].outcome is Outcome.ESCAPING
    assert gaps.min() >= -0.03 - 0.01
    assert gaps[-1] > 0.05


# Narrow places, and others that move.

CORNER = [wall((0.8, -6.0), (0.8, 0.3))]
"""A wall in front of a bicycle at the origin, nearer than its turning radius."""


def test_a_bicycle_reverses_out_of_a_place_that_walls_block() -> None:
    robot = VehicleNavigator(REVERSING, method("nao"), Disc(0.3), 0.4, horizon=4.0)
    run = driven(robot, CORNER, at(3.0, 3.0), Pose((0.0, 0.0), 0.0))
    assert run.arrived
    assert run.safe
    assert -0.6 - 1e-9 <= run.speeds.min() < -0.3
    assert least_gap(run, robot, CORNER) >= 0.0


def test_a_bicycle_that_cannot_reverse_never_does() -> None:
    robot = VehicleNavigator(BICYCLES["robot"], method("nao"), Disc(0.3), 0.4, horizon=4.0)
    run = driven(robot, CORNER, at(3.0, 3.0), Pose((0.0, 0.0), 0.0), 100)
    assert run.safe
    assert run.speeds.min() >= 0.0


def test_a_bicycle_without_another_way_reverses_at_once() -> None:
    """A person comes towards it between walls."""
    walls = [wall((-9.0, y), (8.0, y)) for y in (-0.6, 0.6)]
    person = Obstacle(Disc(0.4), ConstantVelocity((3.0, 0.0), (-0.35, 0.0)))
    robot = VehicleNavigator(REVERSING, method("nao"), Disc(0.3), 0.4, horizon=4.0)
    run = driven(robot, [*walls, person], at(4.0, 0.0), Pose((0, 0), 0), 60)
    assert run.safe
    assert run.speeds.min() < -0.3
    assert least_gap(run, robot, [person]) > 0.0


def test_a_vehicle_stops_on_its_way_for_a_body_that_crosses_and_goes_on() -> None:
    """A wide body between walls, slowly across the way to a goal with a heading."""
    robot = VehicleNavigator(REVERSING, method("nao"), Rectangle(0.6, 0.4), 0.2, horizon=4.0)
    crossing = Obstacle(Disc(0.5), ConstantVelocity((2.2, -1.0), (0.0, 0.25)))
    walls = [wall((-2.0, y), (1.2, y)) for y in (-0.35, 0.35)] + [wall((3.2, y), (7.0, y)) for y in (-0.35, 0.35)]
    run = driven(robot, [*walls, crossing], at(5.0, 0.0, 0.1, heading=0.0), Pose((0.0, 0.0), 0.0))
    assert run.arrived
    assert run.safe
    before = next(k for k, pose in enumerate(run.poses) if pose.position[0] > 2.2)
    assert np.abs(run.speeds[5:before]).min() < 0.1
    assert least_gap(run, robot, [*walls, crossing], 1e-3) > 0.0


# Goals with a heading.


@pytest.mark.parametrize("seed", draws(range(8), 3))
@pytest.mark.parametrize("name", ["drive, quick", "bicycle, robot", "bicycle, with lag"])
def test_a_goal_with_a_heading_is_reached(name: str, seed: int) -> None:
    """In the free plane, from any heading."""
    rng, vehicle = np.random.default_rng(seed), VEHICLES[name]
    robot = VehicleNavigator(vehicle, method("nao"), Rectangle(0.6, 0.4), 0.15)
    # With a lag the vehicle ends less exactly on its way.
    exact = 2.0 if "lag" in name else 1.0
    goal = at(*rng.uniform(-3.0, 3.0, 2), 0.05 * exact, heading=rng.uniform(-pi, pi))
    goal = replace(goal, heading_tolerance=0.05 * exact)
    run = driven(robot, [], goal, Pose((0.0, 0.0), rng.uniform(-pi, pi)), 400)
    last = run.poses[-1]
    assert run.arrived
    assert run.safe
    assert abs((last.heading - goal.heading + pi) % (2.0 * pi) - pi) <= goal.heading_tolerance
    assert hypot(*(last.position - goal.position(0.0))) <= goal.tolerance


def test_a_car_enters_a_slot_backwards() -> None:
    """Of parked cars, 0.35 m wider than it."""
    car = Bicycle(2.7, 0.6, 2.0, 3.0, 2.0, max_reverse_speed=1.5)
    robot = VehicleNavigator(car, method("nao"), Rectangle(4.5, 1.8), 1.35)
    parked = [wall((-2.3, y), (2.3, y), radius=0.85) for y in (-2.15 - 0.0, 2.15)]
    goal = at(-1.35, 0.0, 0.1, heading=0.0)
    run = driven(robot, parked, goal, Pose((8.0, -6.0), 0.5 * pi), 400)
    assert run.arrived
    assert run.safe
    assert run.speeds.min() < -0.5
    assert least_gap(run, robot, parked, 2e-3) > 0.0


def test_a_cart_that_cannot_reverse_says_that_it_finds_no_way() -> None:
    """Before a wall across a lane; with reverse it finds one."""
    lane = [wall((-1.0, -0.5), (1.5, -0.5), (1.5, 0.5), (-1.0, 0.5), (-1.0, -0.5))]
    robot = VehicleNavigator(BICYCLES["robot"], method("nao"), Rectangle(0.6, 0.4), 0.2)
    run = driven(robot, lane, at(5.0, 0.0, heading=0.0), Pose((0.0, 0.0), 0.0), 20)
    no_way = run.decisions[-1].no_way
    assert not run.arrived
    assert run.safe
    assert no_way is not None
    assert "no way" in str(no_way) or "ended" in str(no_way)
    assert least_gap(run, robot, lane) > 0.0


# Parts.


def test_the_predicted_pose_is_the_pose() -> None:
    """Of a vehicle with lag and delay that moves as its model, once the first commands act."""
    drive = DifferentialDrive(0.4, 1.0, 2.0, lag=0.3, delay=0.2)
    robot, goal, pose, decision = VehicleNavigator(drive, method("nao"), Disc(0.25)), at(3, 2), Pose((0, 0), 0.0), None
    late = [Command(0.0, 0.0)] * 2
    for k in range(20):
        decision = robot.decide(pose, [], goal, now=0.1 * k, previous=decision)
        late.append(decision.command)
        assert decision.acts_at == pytest.approx(0.1 * k + 0.2)
        expected = decision.pose_at(0.1 * k + 0.1)
        pose = drive.drive(pose, late.pop(0))
        np.testing.assert_allclose(expected.motion, pose.motion, atol=1e-6)


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


@pytest.mark.parametrize("start", [(6.97, 1.645, 0.02), (6.94, 1.625, 0.24), (6.56, 1.64, 0.0)])
def test_a_drive_at_an_inner_corner_leaves_it_although_its_path_is_planned_anew(start):
    drive = DifferentialDrive(0.4, 1.2, 3.0, max_speed=1.0, lag=0.15, delay=0.025)
    robot = VehicleNavigator(drive, method("nao"), Disc(0.3), horizon=3.0, margin=0.05)
    lines = [(0, 0), (9, 0), (9, 9)], [(0, 2), (7, 2), (7, 9)]
    walls = ObstacleTable([Obstacle(Polyline(line), Stationary((0, 0))) for line in lines])
    pose, decision, step, stalled = Pose(start[:2], start[2]), None, 0, 0.0
    while pose.position[1] < 3.0 and step < 100:
        if step % 10 == 0:
            ahead = [place for place in [(7.16, 1.84), (7.23, 2.0), (8.0, 8.3)] if place[1] > pose.position[1]]
            goal = PathGoal([pose.position, *ahead], tolerance=0.2)
        decision = robot.decide(pose, [walls], goal, now=0.1 * step, previous=decision)
        # What a decision knows is known now, also where it goes on with an earlier manoeuvre.
        assert decision.inputs.now == decision.acts_at
        stalled = max(stalled, decision.stalled)
        pose, step = drive.drive(pose, decision.command), step + 1
    assert pose.position[1] >= 3.0
    assert stalled < 4.0, stalled
