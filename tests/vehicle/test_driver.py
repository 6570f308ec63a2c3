"""The loop around a navigator: watchdogs, replanned paths, maps that change, recoveries, arrival."""

from collections.abc import Callable
from math import ceil
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st

import slalom
from slalom import Disc, Driver, DriveStatus as S, Goal, Limits, Navigator, PathGoal, Polyline, State, Stationary
from slalom.vehicle import Bicycle, DifferentialDrive, Pose, VehicleNavigator

DT, RADIUS = 0.1, 0.25
NAO = slalom.method("nao")
DRIVE = DifferentialDrive(0.4, 1.2, 3.0, period=DT)
CAR = Bicycle(0.4, 0.6, 2.0, 1.0, 1.0, max_reverse_speed=0.4, period=DT)
Walls = list[list[tuple[float, float]]]


def free(**changes: Any) -> Navigator:
    """A robot that moves in every direction."""
    return Navigator(NAO, Disc(RADIUS), Limits(1.0, 1.5), **{"period": DT, "horizon": 3.0, **changes})


def wheels(vehicle: Any) -> VehicleNavigator:
    """A vehicle whose body is the disc about the middle of its axles."""
    center = 0.2 if isinstance(vehicle, Bicycle) else 0.0
    return VehicleNavigator(vehicle, NAO, Disc(RADIUS), center, horizon=3.0)


ROBOTS: dict[str, Callable[[], Any]] = {
    "free": free,
    "drive": lambda: wheels(DRIVE),
    "drive with a lag": lambda: wheels(DifferentialDrive(0.4, 1.2, 3.0, period=DT, lag=0.15)),
    "car": lambda: wheels(CAR),
}


def table(walls: Walls) -> slalom.ObstacleTable:
    return slalom.ObstacleTable([slalom.Obstacle(Polyline(line), Stationary((0.0, 0.0))) for line in walls])


class Robot:
    """A robot that does as it is told, and the loop of its driver."""

    def __init__(self, navigator: Any, place: tuple[float, float], walls: Walls = (), **options: Any) -> None:
        self.driver = Driver(navigator, walls=table(walls), **options)
        turns = isinstance(navigator, VehicleNavigator)
        self.state: Any = Pose(place, 0.0) if turns else State(place, (0.0, 0.0))
        self.now, self.lines, self.gap = (0.0, shapely.MultiLineString(list(walls) or [[(99, 99), (99, 98)]]), np.inf)
        self.middle = np.array([navigator.center if turns else 0.0, 0.0])

    def step(self, known: bool = True) -> slalom.Drive:
        """One period; `known`: whether the driver gets the state."""
        if known:
            self.driver.locate(self.now, self.state)
        drive = self.driver.command(self.now)
        if isinstance(self.state, Pose):
            self.state = self.driver.navigator.vehicle.drive(self.state, drive.command)
            middle = self.state.position + self.middle[0] * self.state.direction
        else:
            plan = drive.decision.manoeuvre
            after = plan.velocity(self.now + DT)
            assert np.array_equal(after, drive.command)
            self.state = State(self.state.position + DT * 0.5 * (self.state.velocity + after), after)
            middle = self.state.position
        self.gap = min(self.gap, self.lines.distance(shapely.Point(middle)) - RADIUS)
        self.now += DT
        return drive

    def run(
        self, duration: float, each: Callable[[int, slalom.Drive], None] = lambda k, drive: None
    ) -> list[slalom.Drive]:
        """Drive up to the arrival, or for a duration [s]."""
        drives: list[slalom.Drive] = []
        while len(drives) < duration / DT and not (drives and drives[-1].status is S.ARRIVED):
            drives.append(self.step())
            each(len(drives), drives[-1])
        return drives


@pytest.mark.parametrize("robot", ROBOTS)
@settings(max_examples=3)
@given(steps=st.integers(5, 30), silent=st.integers(20, 60))
def test_without_states_it_stops_within_the_braking_distance_and_goes_on_after(robot, steps, silent):
    """On its path: it begins to brake after the timeout, as hard as its limits allow, and its path goes on."""
    one = Robot(ROBOTS[robot](), (0.0, 0.0))
    one.driver.head_for(PathGoal([(0.0, 0.0), (9.0, 0.0)], tolerance=0.2))
    before = [one.step() for _ in range(steps)][-1]
    place = one.state.position
    drives = [one.step(known=False) for _ in range(silent)]
    overdue = [drive for drive in drives if drive.status is S.NO_STATE]
    assert len(drives) - len(overdue) == round(one.driver.state_timeout / DT)
    assert f"old, 0.5 s are allowed; it can rest within {overdue[0].stop:.2f} m)" in overdue[0].sentence
    navigator = one.driver.navigator
    limits = (navigator.vehicle if isinstance(navigator, VehicleNavigator) else navigator).limits
    lag = max(navigator.vehicle.lags) if isinstance(navigator, VehicleNavigator) else 0.0
    speed = limits.max_speed
    most = speed * (one.driver.state_timeout + 2 * DT + lag) + 0.5 * speed**2 / limits.braking
    assert np.linalg.norm(one.state.position - place) <= most
    assert np.linalg.norm(one.state.velocity) < 1e-3
    again = one.run(15.0)
    assert again[0].status is S.DRIVING
    assert again[0].decision.progress >= before.decision.progress - 1e-9
    assert again[-1].status is S.ARRIVED


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_path_that_is_replanned_every_second_is_driven_from_its_begin(robot):
    """Along a wall, around its end and back on its other side: no part of a new path is left out."""
    walls = [[(0.0, 2.0), (9.0, 2.0)], [(0.0, 0.0), (12.0, 0.0), (12.0, 6.0)]]
    corners = [(10.4, 1.0), (10.4, 3.2), (3.0, 3.2)]
    one, passed, begins = Robot(ROBOTS[robot](), (1.0, 1.0), walls), 0, []

    def replan(k: int, drive: slalom.Drive) -> None:
        nonlocal passed
        if k % 10 == 1 and k > 1:
            begins.append(drive.decision.progress or 0.0)  # None: an earlier manoeuvre goes on
        if k % 10 == 0:
            while passed < 2 and np.linalg.norm(one.state.position - corners[passed]) < 1.0:
                passed += 1
            one.driver.head_for(PathGoal([one.state.position, *corners[passed:]], tolerance=0.2))

    one.driver.head_for(PathGoal([(1.0, 1.0), *corners], tolerance=0.2))
    drives = one.run(50.0, replan)
    assert drives[-1].status is S.ARRIVED
    assert {drive.status for drive in drives} == {S.DRIVING, S.ARRIVED}
    assert all(drive.decision.safe for drive in drives)
    # The point ahead of an axle is on the path farther on.
    assert max(begins) < 0.7
    assert one.gap > 0.0


CLOSED: Walls = [[(0, 0), (10, 0), (10, 12), (0, 12), (0, 0)], [(5, 0), (5, 10)]]
"""Two rooms whose door at (5, 3) is closed; another one is at (5, 11), out of sight."""
AROUND = [(4.2, 11.0), (5.8, 11.0), (9.0, 3.0)]


@pytest.mark.parametrize(("robot", "tried"), [("free", set()), ("drive", set()), ("car", {S.BACKING})])
def test_behind_a_closed_door_it_needs_another_path_and_drives_it(robot, tried):
    """The planner at 1 Hz knows the door as open until it is asked."""
    one, asked = Robot(ROBOTS[robot](), (1.0, 3.0), CLOSED), []

    def replan(k: int, drive: slalom.Drive) -> None:
        asked.extend([k] if drive.status is S.NEEDS_PATH else [])
        if k % 10 == 0 and not asked:
            one.driver.head_for(PathGoal([one.state.position, (9.0, 3.0)], tolerance=0.2))
        elif asked and k == asked[0] + 5:
            one.driver.head_for(PathGoal([one.state.position, *AROUND], tolerance=0.2))

    one.driver.head_for(PathGoal([(1.0, 3.0), (9.0, 3.0)], tolerance=0.2))
    drives = one.run(90.0, replan)
    found = {drive.status for drive in drives}
    assert found - {S.TURNING, S.BACKING} == {S.DRIVING, S.YIELDING, S.NEEDS_PATH, S.ARRIVED}
    assert tried <= found
    assert asked[-1] - asked[0] == 5, "the new path begins anew"
    assert all(drive.decision.safe for drive in drives)
    assert one.gap > 0.0


def test_a_drive_whose_goal_is_walled_in_says_so():
    """A vehicle that parks searches a way itself."""
    one = Robot(wheels(DRIVE), (1.0, 3.0), [*CLOSED[:1], [(5, 0), (5, 12)]])
    one.driver.head_for(Goal(Stationary((9.0, 3.0)), 0.2, stop=True, heading=0.0))
    drives = one.run(25.0)
    assert drives[-1].status is S.NEEDS_PATH
    assert str(drives[-1].decision.no_way) in drives[-1].sentence
    one.driver.head_for(Goal(Stationary((9.0, 3.0)), 0.2, stop=True, heading=0.0))
    assert one.step().status is S.NEEDS_PATH, "the same goal again changes nothing"
    one.driver.walls = table([*CLOSED[:1], [(5, 0), (5, 2)], [(5, 4), (5, 12)]])
    assert one.run(60.0)[-1].status is S.ARRIVED, "another map does"


def test_a_longer_path_is_another_way():
    """A robot that turns back for a detour is not stuck, however long that takes."""
    one = Robot(free(stuck_after=2.0), (8.0, 0.0))
    one.driver.head_for(PathGoal([(8.0, 0.0), (10.0, 0.0)], tolerance=0.2))
    one.run(1.0)
    one.driver.head_for(PathGoal([one.state.position, (1.0, 1.0), (1.0, 3.0), (10.0, 3.0), (10.0, 0.0)], tolerance=0.2))
    drives = one.run(40.0)
    assert {drive.status for drive in drives} == {S.DRIVING, S.ARRIVED}


def test_a_map_that_changes_at_5_hz_is_driven_through():
    """Noisy cells, drawn anew each time: a hall with a door whose jambs are 1.2 m apart."""
    one, rng = (
        Robot(wheels(DRIVE), (1.0, 1.0), [[(3.0, 0.0), (3.0, 1.4)], [(3.0, 2.6), (3.0, 4.0)]]),
        np.random.default_rng(3),
    )
    cells = np.zeros((80, 120), np.int8)
    cells[:28, 59:61] = cells[52:, 59:61] = 100
    near = np.zeros_like(cells, np.bool_)
    near[:29, 58:62] = near[51:, 58:62] = True

    def updated(k: int, drive: Any) -> None:
        if k % 2 == 0:
            seen = np.where(
                near & (rng.random(cells.shape) < 0.05), 100, np.where(rng.random(cells.shape) < 0.03, 0, cells)
            )
            one.driver.walls = slalom.occupancy(seen.astype(np.int8), 0.05)

    updated(0, None)
    one.driver.head_for(PathGoal([(1.0, 1.0), (2.4, 2.0), (3.6, 2.0), (5.0, 1.0)], tolerance=0.2))
    assert one.run(20.0, updated)[-1].status is S.ARRIVED
    assert one.gap > 0.0


def test_without_detections_it_rests_and_drives_on_with_the_next_ones():
    one = Robot(free(), (0.0, 0.0))
    one.driver.head_for(PathGoal([(0.0, 0.0), (9.0, 0.0)], tolerance=0.2))
    first = [one.step() for _ in range(15)]
    assert first[-1].status is S.DRIVING, "it may have no perception"
    one.driver.see(one.now, [("person", (0.0, 5.0))])
    drives = [one.step() for _ in range(30)]
    late = [drive for drive in drives if drive.status is S.NO_DETECTIONS]
    assert len(late) == 30 - 1 - round(one.driver.tracker.max_age / DT)
    assert "the last ones are 1.10 s old, 1 s are allowed" in late[0].sentence
    assert np.linalg.norm(one.state.velocity) < 1e-6
    one.driver.see(one.now)
    assert one.step().status is S.DRIVING
    blind = Robot(free(), (0.0, 0.0), detection_timeout=np.inf)
    blind.driver.head_for(Goal(Stationary((9.0, 0.0)), 0.2))
    assert blind.driver.see(0.0, [("person", (0.0, 5.0)), ("person", (0.0, 5.0))]) == 1
    assert blind.run(20.0)[-1].status is S.ARRIVED


@given(error=st.floats(0.0, 0.3))
@settings(max_examples=5)
def test_the_margin_grows_with_the_error_of_the_position(error):
    """The robot is up to the error away from where it says it is."""
    driver, state, gap = Driver(free(), walls=table([[(3.0, -2.0), (3.0, 0.3)]])), State((0.0, 0.0), (0.0, 0.0)), np.inf
    driver.head_for(PathGoal([(0.0, 0.0), (2.4, 0.9), (3.6, 0.9), (6.0, 0.0)], tolerance=0.2))
    wall = shapely.LineString([(3.0, -2.0), (3.0, 0.3)])
    for k in range(120):
        driver.locate(DT * k, state, error)
        drive = driver.command(DT * k)
        state = State(state.position + DT * 0.5 * (state.velocity + drive.command), drive.command)
        gap = min(gap, wall.distance(shapely.Point(state.position)) - RADIUS)
    assert driver.arrived
    assert gap >= error
    assert drive.decision.inputs.navigator.margin == pytest.approx(0.05 + 0.02 * ceil(error / 0.02 - 1e-9))


def test_it_waits_for_a_state_rests_without_a_goal_and_at_one():
    driver = Driver(wheels(DRIVE))
    assert driver.command(0.0)[:4] == (S.WAITING, S.WAITING.value, (0.0, 0.0), None)
    assert np.array_equal(Driver(free()).command(0.0).command, np.zeros(2))
    one = Robot(wheels(DRIVE), (0.0, 0.0))
    assert one.step().status is S.IDLE
    one.driver.head_for(Goal(Stationary((1.0, 0.0)), 0.2, stop=True))
    assert one.run(10.0)[-1].status is S.ARRIVED
    at = [one.step() and one.state.position for _ in range(30)]
    assert np.linalg.norm(at[-1] - at[10]) < 1e-3
    one.state = Pose(one.state.position - (0.6, 0.0), 0.0)
    assert one.step().status is S.DRIVING
    one.driver.head_for(None)
    assert [one.step() for _ in range(20)][-1].status is S.IDLE
    assert abs(one.state.speed) < 1e-6


def test_a_goal_to_pass_is_passed():
    one = Robot(free(), (0.0, 0.0))
    one.driver.head_for(Goal(Stationary((3.0, 0.0)), 0.3))
    assert one.run(10.0)[-1].status is S.ARRIVED
    assert np.linalg.norm(one.state.velocity) > 0.3


def test_an_unsafe_decision_is_said():
    one = Robot(free(), (0.0, 0.0))
    one.driver.head_for(Goal(Stationary((9.0, 0.0)), 0.2))
    one.driver.locate(0.0, one.state)
    rushing = slalom.Tracks([(0.9, 0.0)], [(-6.0, 0.0)], 0.3, 0.0)
    drive = one.driver.command(0.0, rushing)
    assert drive.sentence == f"{S.DRIVING.value} {drive.decision.outcome.value}"
    assert not drive.decision.safe


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_that_waits_says_for_whom_and_drives_on_after(robot):
    """In a hall that two people close side by side, until they leave."""
    one = Robot(ROBOTS[robot](), (0.0, 0.0), [[(-3.0, y), (9.0, y)] for y in (-0.6, 0.6)])
    one.driver.head_for(PathGoal([(0.0, 0.0), (7.0, 0.0)], tolerance=0.2))
    drives = []
    for k in range(200):
        one.driver.see(one.now, [(7, (3.0, 0.25)), ("b", (3.0, -0.25))] if k < 80 else [])
        drives.append(one.step())
    standing = drives[72:80]
    assert {drive.status for drive in standing} == {S.YIELDING}
    assert all(set(drive.waits_for) == {7, "b"} for drive in standing)
    assert all("7" in drive.sentence and f"rest within {drive.stop:.2f} m" in drive.sentence for drive in standing)
    assert drives[-1].status is S.ARRIVED
    assert {drive.waits_for for drive in drives if drive.status is not S.YIELDING} == {()}


def test_a_robot_before_a_goal_in_an_obstacle_names_it_when_it_stands():
    one = Robot(wheels(DRIVE), (0.0, 0.0))
    rock = slalom.Obstacle(slalom.Rectangle(2.0, 2.0), Stationary((4.0, 0.0)), "rock")
    one.driver.walls = [rock]
    one.driver.head_for(Goal(Stationary((4.0, 0.0)), 0.2, stop=True))
    drives = [one.step() for _ in range(36)]
    assert {(drive.status, drive.waits_for) for drive in drives[30:]} == {(S.YIELDING, ("rock",))}


def test_a_robot_that_cannot_rest_does_not_say_that_it_will():
    limits = Limits(3.0, 1.5, bounds=(slalom.LeastSpeed(1.0),))
    driver = Driver(Navigator(NAO, Disc(RADIUS), limits, period=DT, horizon=3.0))
    driver.locate(0.0, State((0.0, 0.0), (2.0, 0.0)))
    drive = driver.command(0.0)
    assert drive.stop == np.inf
    assert drive.sentence.endswith("(its limits do not let it rest).")


@pytest.mark.parametrize("robot", list(ROBOTS)[1:])
def test_a_vehicle_before_a_sudden_person_stops_as_short_as_it_can(robot):
    """Within its lag and period no longer way than at its hardest; and no command is above its largest speed."""
    one = Robot(ROBOTS[robot](), (0.0, 0.0))
    vehicle = one.driver.navigator.vehicle
    most = vehicle.limits.max_speed
    one.driver.head_for(PathGoal([(0.0, 0.0), (19.0, 0.0)], tolerance=0.2))
    before = [one.step() for _ in range(30)]
    assert max(abs(drive.command.speed) for drive in before) <= most + 1e-12
    place, speed = one.state.position, one.state.speed
    least = vehicle.limits.max_speed**2 / (2.0 * vehicle.limits.max_acceleration)
    reach = RADIUS + one.middle[0] + 0.3
    there = place + np.array((reach + 0.6 * least, 0.0))
    one.driver.see(one.now, [("p", there)])
    while abs(one.state.speed) > 1e-3:
        drive = one.step()
        assert drive.decision.outcome.name in ("BRAKING", "ESCAPING", "STOPPING", "DELAYED")
        one.driver.see(one.now, [("p", there)])
    assert np.linalg.norm(one.state.position - place) <= speed**2 / (2.0 * vehicle.limits.max_acceleration) * 1.1
