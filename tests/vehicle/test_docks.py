"""Goals with a heading for worn wheels: dead zones, friction, rounding, slip, lag, delay."""

from collections import deque
from dataclasses import dataclass
from math import copysign, cos, dist, floor, hypot, pi, sin, sqrt, tan
from typing import Any

import numpy as np
import pytest
from draws import draws

from slalom import Disc, Driver, DriveStatus, Goal, Rectangle, Stationary, method
from slalom.vehicle import Bicycle, DifferentialDrive, Pose, VehicleNavigator

PARTS = 10
STANDING = 5.0


@dataclass
class Wear:
    """What becomes of a command: of the speed and of the turn of a drive, in this order."""

    step: tuple[float, float] = (0.0, 0.0)  # commands are rounded down to a multiple
    dead: tuple[float, float] = (0.0, 0.0)
    friction: tuple[float, float] = (0.0, 0.0)
    slip: float = 0.0

    def executed(self, command: tuple[float, float]) -> np.ndarray:
        """The speed and turn that the actuators head for."""
        found = []
        for u, step, dead, friction in zip(command, self.step, self.dead, self.friction, strict=True):
            size = abs(u) if step == 0.0 else step * floor(abs(u) / step + 1e-9)
            found.append(copysign(0.0 if size < dead - 1e-12 else max(size - friction, 0.0), u))
        return np.array(found)


class Plant:
    """A vehicle at a pose (x, y, heading) whose actuators are worn, integrated by the midpoint rule."""

    def __init__(self, vehicle, wear: Wear, pose) -> None:
        self.vehicle, self.wear, self.place, self.now = vehicle, wear, np.array(pose, float), 0.0
        self.values, self.target, self.start = np.zeros(2), np.zeros(2), np.zeros(2)
        self.waiting: deque[tuple[float, Any]] = deque()
        self.steered = isinstance(vehicle, Bicycle)
        half = 0.0 if self.steered else 0.5 * vehicle.track
        self.mixed = np.array([[1.0, -half], [0.0 if self.steered else 1.0, half or 1.0]])
        both = [vehicle.max_acceleration, vehicle.max_steering_rate] if self.steered else None
        self.rates = np.array(both or [vehicle.max_wheel_acceleration] * 2)

    @property
    def pose(self) -> Pose:
        return Pose(self.place[:2], self.place[2], *np.linalg.solve(self.mixed, self.values))

    def drive(self, command: tuple[float, float]) -> None:
        """The motion of a period; the command acts after the delay of the vehicle."""
        h, lags = self.vehicle.period / PARTS, np.array(self.vehicle.lags)
        self.waiting.append((self.now + self.vehicle.delay, command))
        for _ in range(PARTS):
            while self.waiting and self.waiting[0][0] <= self.now + 1e-9:
                self.target = self.mixed @ self.wear.executed(self.waiting.popleft()[1])
                self.start = self.values
            late = (self.target - self.values) * -np.expm1(-h / np.maximum(lags, 1e-9))
            even = (self.target - self.start) / PARTS
            even = np.where(np.abs(even) < np.abs(self.target - self.values), even, self.target - self.values)
            change = np.clip(np.where(lags > 0.0, late, even), -self.rates * h, self.rates * h)
            speed, turn = np.linalg.solve(self.mixed, self.values + 0.5 * change) * (1.0 - self.wear.slip, 1.0)
            rate = speed * tan(turn) / self.vehicle.wheelbase if self.steered else turn * (1.0 - self.wear.slip)
            middle = self.place[2] + 0.5 * h * rate
            self.place += h * np.array([speed * cos(middle), speed * sin(middle), rate])
            self.values, self.now = self.values + change, self.now + h


def vehicle_of(steered: bool, **more):
    if steered:
        return Bicycle(0.4, 0.6, 2.0, 0.8, 1.0, max_reverse_speed=0.4, **more)
    return DifferentialDrive(0.35, 0.8, 1.5, **more)


def navigator_of(vehicle) -> VehicleNavigator:
    body, center = (Rectangle(0.6, 0.4), 0.2) if isinstance(vehicle, Bicycle) else (Disc(0.25), 0.0)
    return VehicleNavigator(vehicle, method("nao"), body, center)


def drawn(seed: int, worn: bool = True):
    """A vehicle, its wear, a goal up to 5 m away, and the pose at the start."""
    rng = np.random.default_rng(seed)
    steered, stated = rng.random(2) < 0.5
    some = [float(rng.uniform(0.1, 1.0) * most * (rng.random() < 0.5)) for most in (0.06, 0.1, 0.1, 0.3, 0.03, 0.05)]
    turns = 0.0 if steered else 1.0
    pairs = [(some[k], turns * some[k + 1]) for k in (0, 2, 4)]
    wear = Wear(*pairs, slip=float(rng.choice([0.0, 0.05, 0.1]))) if worn else Wear()
    more = {"lag": float(rng.choice([0.0, 0.1, 0.3])), "delay": float(rng.choice([0.0, 0.05, 0.2]))}
    more["period"] = float(rng.choice([0.05, 0.1, 0.2]))
    if stated and worn:
        # The least command that is executed: rounded down it is in no dead zone.
        least = [step * -(-dead // step) if step > 0.0 else dead for step, dead in zip(*pairs[:2], strict=True)]
        more |= {"min_speed": max(least[0], pairs[0][0])} | (
            {} if steered else {"min_turn_rate": max(least[1], pairs[0][1])}
        )
    away, bearing = rng.uniform(1.0, 5.0), rng.uniform(-pi, pi)
    tolerance, faces = float(rng.choice([0.02, 0.05, 0.1, 0.2])), float(rng.choice([0.03, 0.05, 0.1]))
    place = Stationary((away * cos(bearing), away * sin(bearing)))
    goal = Goal(place, tolerance, True, float(rng.uniform(-pi, pi)), faces)
    return vehicle_of(bool(steered), **more), wear, goal, (0.0, 0.0, float(rng.uniform(-pi, pi)))


def docked(vehicle, wear: Wear, goal: Goal, start, until: float = 120.0):
    """The time [s] of arrival, the last decision, and the longest time that the vehicle stood without being stuck."""
    robot, plant, decision = navigator_of(vehicle), Plant(vehicle, wear, start), None
    stood = longest = 0.0
    while plant.now < until:
        pose, now, before = plant.pose, plant.now, plant.place.copy()
        if goal.reached(pose.position, pose.velocity, now, pose.heading):
            return now, decision, longest
        decision = robot.decide(pose, [], goal, now=now, previous=decision)
        least = vehicle.min_speed, getattr(vehicle, "min_turn_rate", 0.0)
        assert all(u == 0.0 or abs(u) >= most for u, most in zip(decision.command, least, strict=True))
        if decision.stuck:
            break
        plant.drive(decision.command)
        stood = stood + vehicle.period if np.abs(plant.place - before).max() < 1e-5 else 0.0
        longest = max(longest, stood)
    return np.inf, decision, longest


@pytest.mark.parametrize("chunk", draws(range(25), 1))
def test_worn_vehicles_arrive_or_say_within_5_s_of_standing_that_they_are_stuck(chunk: int) -> None:
    """Twelve draws of wear, stated or not. Few are stuck."""
    stuck = 0
    for seed in range(12 * chunk, 12 * chunk + 12):
        vehicle, wear, goal, start = drawn(seed)
        arrived, decision, stood = docked(vehicle, wear, goal, start)
        assert arrived < np.inf or decision.stuck, seed
        assert stood <= STANDING, seed
        stuck += arrived == np.inf
    assert stuck <= 3


def ramp(length: float, speed: float, acceleration: float) -> float:
    """The least time [s] of a way from rest to rest."""
    if length < speed**2 / acceleration:
        return 2.0 * sqrt(length / acceleration)
    return length / speed + speed / acceleration


def test_the_median_dock_of_a_drive_takes_little_more_than_the_direct_way() -> None:
    """To turn, drive and turn from rest to rest, forwards or backwards; with lags, delays and long periods."""
    ratios = []
    for seed in range(40):
        vehicle, wear, goal, start = drawn(seed, worn=False)
        if isinstance(vehicle, Bicycle):
            continue
        (x, y), rate = goal.position(0.0), 2.0 / vehicle.track
        times = []
        for course in (np.arctan2(y, x), np.arctan2(-y, -x)):
            turns = [abs((end + pi) % (2.0 * pi) - pi) for end in (course - start[2], goal.heading - course)]
            turned = [
                ramp(turn, rate * vehicle.max_wheel_speed, rate * vehicle.max_wheel_acceleration) for turn in turns
            ]
            times.append(sum(turned) + ramp(hypot(x, y), vehicle.max_wheel_speed, vehicle.max_wheel_acceleration))
        ratios.append(docked(vehicle, wear, goal, start)[0] / min(times))
    assert np.median(ratios) < 1.2
    assert max(ratios) < 2.0


@pytest.mark.parametrize("steered", [False, True], ids=["drive", "bicycle"])
def test_the_certified_motion_is_that_of_the_least_commands(steered: bool) -> None:
    """A vehicle that ignores smaller ones is where it was predicted to be; one period does not reach them."""
    more = {"min_speed": 0.12} | ({} if steered else {"min_turn_rate": 0.5})
    vehicle = vehicle_of(steered, period=0.05, **more)
    robot, decision = navigator_of(vehicle), None
    wear = Wear(dead=(0.12, 0.0 if steered else 0.5))
    plant = Plant(vehicle, wear, (0.0, 0.0, 0.3))
    goal = Goal(Stationary((1.5, 0.6)), 0.03, True, 2.0)
    while not goal.reached(plant.pose.position, plant.pose.velocity, plant.now, plant.pose.heading):
        assert plant.now < 15.0
        decision = robot.decide(plant.pose, [], goal, now=plant.now, previous=decision)
        plant.drive(decision.command)
        predicted = decision.pose_at(plant.now)
        assert dist(predicted.position, plant.pose.position) < 1e-4
        assert abs(predicted.heading - plant.pose.heading) < 1e-4


def test_a_vehicle_that_does_not_move_says_why() -> None:
    """The decision and the driver; not while it waits, nor after a pause without commands."""
    vehicle = vehicle_of(False)
    driver, goal = Driver(navigator_of(vehicle)), Goal(Stationary((3.0, 0.0)), 0.05, True, 1.0)
    driver.head_for(goal)
    for k in [*range(20), *range(100, 150)]:
        driver.locate(0.1 * k, Pose((0.0, 0.0), 0.4))
        drive = driver.command(0.1 * k)
        stuck = drive.decision is not None and drive.decision.stuck
        assert stuck == ("dead zone" in drive.sentence)
        assert not (stuck and k < 130)
        if stuck:
            break
    assert stuck
    assert k < 140
    assert "min_speed" in drive.decision.as_dict()["unmoved"]
    driver.locate(14.1, Pose((0.0, 0.0), 0.4))
    assert driver.command(14.1).status in (DriveStatus.TURNING, DriveStatus.BACKING)
