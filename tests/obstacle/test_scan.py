"""Obstacles of a laser scan: a disc about each point, and no other."""

import pickle

import numpy as np
import pytest

from slalom import Disc, Goal, Limits, Navigator, ObstacleTable, Rectangle, State, Stationary, method, scan
from slalom.vehicle import DifferentialDrive, Pose, VehicleNavigator

ANGLES = np.linspace(-np.pi, np.pi, 360, endpoint=False)


def test_discs_are_about_the_points_of_valid_ranges() -> None:
    """Of ranges of every kind, from a sensor that is turned."""
    ranges = [1.0, np.nan, 2.0, np.inf, -np.inf, 0.05, 9.0, 3.0, 0.0]
    found = scan(ranges, 0.5 * np.arange(9), (1.0, 2.0, 0.3), radius=0.1, min_range=0.2, max_range=5.0)
    expected = [(1.0 + r * np.cos(0.3 + 0.5 * k), 2.0 + r * np.sin(0.3 + 0.5 * k)) for k, r in ((0, 1), (2, 2), (7, 3))]
    np.testing.assert_allclose(found.points, expected)
    assert [(one.shape, one.at_rest) for one in found] == [(Disc(0.1), True)] * 3
    np.testing.assert_allclose([one.trajectory.position(0.0) for one in found], expected)
    assert found.unused == {"nan": 1, "inf": 2, "near": 2, "far": 1}
    assert repr(found) == "<Scan, points: 3, nan: 1, inf: 2, near: 2, far: 1>"
    assert len(scan([np.inf], [0.0])) == 0


@pytest.mark.parametrize("robot", [Disc(0.3), Rectangle(0.5, 0.3)])
def test_the_bodies_are_those_of_a_table_of_discs(robot) -> None:
    """To the bit, also the outlines."""
    found = scan(2.0 + np.sin(3.0 * ANGLES), ANGLES, (1.0, 2.0, 0.3))
    one, plain = (each.stretch(robot, 3.0, 2.0) for each in (found, ObstacleTable(list(found))))
    for name in one.pieces._fields:
        assert np.array_equal(getattr(one.pieces, name), getattr(plain.pieces, name))
    assert np.array_equal(one.each, plain.each)
    assert np.array_equal(one.body_balls, plain.body_balls)
    outlines = [each.outlines.at_horizon for each in (found, ObstacleTable(list(found)))]
    assert np.array_equal(outlines[0].each, outlines[1].each)


def test_a_drive_passes_what_it_scans() -> None:
    """A disc of 0.5 m on its way: each scan is seen from where the drive is."""
    drive, place = DifferentialDrive(0.35, 1.0, 2.0), np.array((2.5, 0.1))
    robot, goal = VehicleNavigator(drive, method("nao"), Disc(0.25)), Goal(Stationary((5.0, 0.0)), 0.1, stop=True)
    pose, decision, least = Pose((0.0, 0.0), 0.0), None, np.inf
    for k in range(150):
        if goal.reached(pose.position, pose.velocity, 0.1 * k):
            break
        turned = ANGLES + pose.heading
        away = place - pose.position
        along = away[0] * np.cos(turned) + away[1] * np.sin(turned)
        under = 0.25 - away @ away + along**2
        ranges = np.where((under > 0.0) & (along > 0.0), along - np.sqrt(np.maximum(under, 0.0)), np.inf)
        seen = scan(ranges, ANGLES, (*pose.position, pose.heading))
        decision = robot.decide(pose, [seen], goal, now=0.1 * k, previous=decision)
        assert decision.safe
        pose = drive.drive(pose, decision.command)
        least = min(least, float(np.hypot(*(pose.position - place))) - 0.75)
    assert k < 149
    assert 0.0 < least < 0.5


def test_a_decision_with_a_scan_is_that_with_its_discs() -> None:
    found = scan(np.full(360, 3.0), ANGLES)
    robot, goal = Navigator(method("nao"), Disc(0.3), Limits(1.0, 1.5)), Goal(Stationary((2.0, 0.5)), 0.2, stop=True)
    both = [robot.decide(State((0.0, 0.0), (0.5, 0.0)), around, goal) for around in (found, list(found))]
    assert np.array_equal(both[0].manoeuvre.control, both[1].manoeuvre.control)
    assert len(pickle.loads(pickle.dumps(found))) == 360
