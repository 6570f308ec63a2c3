"""Vehicles in their dynamic window, and passive safety: they touch nothing that is observed as long as they move."""

import numpy as np
import pytest

from slalom import (
    BoundedError,
    ConstantVelocityFilter,
    Disc,
    Goal,
    Obstacle,
    ObstacleTable,
    Outcome,
    PathGoal,
    Polyline,
    Rectangle,
    Shape,
    Stationary,
    Tracker,
    Tracks,
    method,
)
from slalom.vehicle import Bicycle, DifferentialDrive, Pose, VehicleNavigator

DRIVE = DifferentialDrive(0.4, 1.2, 3.0, max_speed=1.0, lag=0.15)
CAR = Bicycle(
    wheelbase=0.5, max_steering=0.6, max_steering_rate=4.0, max_speed=1.0, max_acceleration=1.5, max_reverse_speed=0.4
)
ROOM = ObstacleTable(
    [Obstacle(Polyline([(0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0), (0.0, 0.0)]), Stationary((0.0, 0.0)))]
)
BODY, PERSON = 0.3, 0.3


def gap(place: np.ndarray, person: np.ndarray) -> float:
    """[m] between a round body of a drive and a person."""
    return float(np.hypot(*(place - person))) - BODY - PERSON


@pytest.mark.parametrize("vehicle", [DRIVE, CAR], ids=["drive", "car"])
def test_a_motion_touches_no_track_before_it_rests(vehicle: DifferentialDrive | Bicycle) -> None:
    """Where the outcome is safe, people keep their radius, or come no nearer than to one that stays."""
    robot = VehicleNavigator(vehicle, method("nao"), Disc(BODY), horizon=3.0)
    seen = set[Outcome]()
    for seed in range(30):
        rng = np.random.default_rng(seed)
        pose = Pose(rng.uniform((2.0, 2.0), (10.0, 6.0)), rng.uniform(-3.0, 3.0), rng.uniform(0.0, 1.0))
        people, velocities = rng.uniform((0.0, 0.0), (12.0, 8.0), (6, 2)), rng.uniform(-1.2, 1.2, (6, 2))
        far = np.hypot(*(people - pose.position).T) > 0.9
        people, velocities = people[far], velocities[far]
        radius = rng.uniform(0.0, 0.3)
        tracks = Tracks(people, velocities, PERSON, uncertainty=BoundedError(radius))
        goal = Goal(Stationary(rng.uniform((1.0, 1.0), (11.0, 7.0))), 0.2)
        decision = robot.decide(pose, [ROOM, tracks], goal)
        seen.add(decision.outcome)
        if not decision.safe:
            continue
        motions = decision.motions
        moving = np.flatnonzero(np.abs(motions[:, 3]) > 1e-9)
        for k in range(moving[-1] + 1 if len(moving) else 0):
            place = motions[k, :2]
            assert np.all(place > BODY - 1e-4)
            assert np.all(place < (12.0 - BODY + 1e-4, 8.0 - BODY + 1e-4))
            for person, velocity in zip(people, velocities, strict=True):
                there = person + velocity * k * vehicle.period
                stays = gap(motions[0, :2], there)
                assert gap(place, there) >= min(radius, stays) - 2e-3, (seed, k)
    assert Outcome.CONSTRAINED in seen


def test_a_drive_never_moves_into_a_person_that_walks_at_it() -> None:
    """A person that walks at it along its way meets it at rest, or while it moves away or past."""
    robot = VehicleNavigator(DRIVE, method("nao"), Disc(BODY), horizon=3.0)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        pose, decision = Pose((1.0, 4.0), 0.0), None
        person, velocity = np.array([8.0, rng.uniform(3.5, 4.5)]), np.array([-rng.uniform(0.5, 1.2), 0.0])
        for k in range(80):
            tracks = Tracks([person], [velocity], PERSON, 0.1 * k, uncertainty=BoundedError(0.2))
            goal = Goal(Stationary((11.0, 4.0)), 0.2)
            decision = robot.decide(pose, [ROOM, tracks], goal, now=0.1 * k, previous=decision)
            if gap(pose.position, person) < 0.0:
                towards = (person - pose.position) / np.hypot(*(person - pose.position))
                assert pose.velocity @ towards <= 0.05
            pose, person = DRIVE.drive(pose, decision.command), person + 0.1 * velocity
        assert pose.position[0] > 4.0


def test_contacts_at_rest_count_where_the_navigator_says_so() -> None:
    """A person will walk into a vehicle that stands by a wall: by default it may stay, otherwise that is unsafe."""
    tracks = Tracks([(3.0, 0.36)], [(-1.0, 0.0)], PERSON)
    pose, goal = Pose((0.36, 0.36), 0.0), Goal(Stationary((0.36, 0.36)), 0.2)
    corner = ObstacleTable(
        [Obstacle(Polyline([(4.0, 0.0), (0.0, 0.0), (0.0, 0.8), (4.0, 0.8)]), Stationary((0.0, 0.0)), name="wall")]
    )
    passive = VehicleNavigator(DRIVE, method("nao"), Disc(BODY), horizon=3.0)
    decision = passive.decide(pose, [corner, tracks], goal)
    assert decision.safe
    strict = VehicleNavigator(DRIVE, method("nao"), Disc(BODY), horizon=3.0, contact_at_rest=True)
    decision = strict.decide(pose, [corner, tracks], goal)
    assert not decision.safe


def test_noise_of_the_speed_of_a_drive_at_rest_is_no_motion() -> None:
    """Before a person in its margin it stays, and stays safe, whichever speed within the noise is measured."""
    robot = VehicleNavigator(DRIVE, method("nao"), Disc(BODY), horizon=3.0, margin=0.05)
    goal, decision = Goal(Stationary((3.0, 4.0)), 0.2, stop=True), None
    for k, speed in enumerate((0.0, 0.0, 0.03, -0.03, 0.05, 0.02)):
        tracks = Tracks([(3.63, 4.0)], [(0.0, 0.0)], PERSON, 0.1 * k, uncertainty=BoundedError(0.1))
        pose = Pose((3.0, 4.0), 0.0, speed, -speed)
        decision = robot.decide(pose, [ROOM, tracks], goal, now=0.1 * k, previous=decision)
        assert decision.safe
        assert decision.command == (0.0, 0.0)


@pytest.mark.parametrize("strict", [False, True])
@pytest.mark.parametrize("shape", [Disc(PERSON), Rectangle(0.6, 0.6)], ids=["disc", "box"])
def test_what_walks_into_a_vehicle_drives_it_into_no_wall(shape: Shape, strict: bool) -> None:
    """Three abreast walk at a vehicle that stands 0.1 m before a wall: it touches the wall in no motion."""
    wall = Obstacle(Polyline([(-5.0, -BODY - 0.1), (5.0, -BODY - 0.1)]), Stationary((0.0, 0.0)), "wall")
    robot = VehicleNavigator(DRIVE, method("nao"), Disc(BODY), horizon=3.0, margin=0.05, contact_at_rest=strict)
    for heading in (0.5, 1.5, -2.5):
        tracker, pose, decision = Tracker(shape, ConstantVelocityFilter(position=0.05)), Pose((0.0, 0.0), heading), None
        for k in range(40):
            now, y = 0.1 * k, 3.0 - 0.1 * k
            for x in (-0.75, 0.0, 0.75):
                tracker.update(now, x, (x, y), heading=None if isinstance(shape, Disc) else 0.0)
            goal = Goal(Stationary((0.0, 0.5)), 0.2, stop=True)
            decision = robot.decide(pose, [wall, *tracker.at(now)], goal, now=now, previous=decision)
            pose = DRIVE.drive(pose, decision.command)
            assert pose.position[1] > -0.1


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_drive_arrives_in_a_hall_of_people(seed: int) -> None:
    """Six people walk straight and turn at walls; they avoid nothing, and are measured with noise."""
    rng = np.random.default_rng(seed)
    robot = VehicleNavigator(DRIVE, method("nao"), Disc(BODY), horizon=3.0)
    tracker = Tracker(Disc(PERSON))
    people, headings = rng.uniform((3.0, 1.0), (11.0, 7.0), (6, 2)), rng.uniform(-3.0, 3.0, 6)
    velocities = rng.uniform(0.5, 1.2, 6)[:, None] * np.stack([np.cos(headings), np.sin(headings)], axis=1)
    pose, decision, goal = Pose((1.0, 4.0), 0.0), None, PathGoal([(1.0, 4.0), (11.0, 4.0)], tolerance=0.2)
    for k in range(250):
        for i in range(6):
            tracker.update(0.1 * k, i, people[i] + rng.normal(0.0, 0.03, 2))
        decision = robot.decide(pose, [ROOM, *tracker.at(0.1 * k)], goal, now=0.1 * k, previous=decision)
        pose = DRIVE.drive(pose, decision.command)
        for person in people:
            if gap(pose.position, person) < 0.0:
                towards = (person - pose.position) / np.hypot(*(person - pose.position))
                assert pose.velocity @ towards <= 0.05
        people = people + 0.1 * velocities
        velocities = np.where((people < 0.4) | (people > (11.6, 7.6)), -velocities, velocities)
        if np.hypot(*(pose.position - (11.0, 4.0))) < 0.3:
            break
    assert np.hypot(*(pose.position - (11.0, 4.0))) < 0.3
    assert k < 200


def test_a_long_body_passes_a_gap_among_people_at_rest() -> None:
    """People at rest leave 10 cm on each side of a body that only fits along its heading."""
    robot = VehicleNavigator(DRIVE, method("nao"), Rectangle(0.9, 0.5), horizon=3.0, margin=0.02)
    tracks = Tracks([(3.0, 4.65), (3.0, 3.35)], np.zeros((2, 2)), PERSON)
    pose, decision, goal = Pose((1.0, 4.0), 0.0), None, PathGoal([(1.0, 4.0), (6.0, 4.0)], tolerance=0.2)
    for k in range(120):
        decision = robot.decide(pose, [ROOM, tracks], goal, now=0.1 * k, previous=decision)
        pose = DRIVE.drive(pose, decision.command)
        if pose.position[0] > 5.0:
            break
    assert pose.position[0] > 5.0
