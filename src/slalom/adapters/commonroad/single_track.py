"""A car that moves by the kinematic single-track model (KS), decided for by `VehicleNavigator`.

The model of the checker has its position in the middle of the body and turns about it as a bicycle about its rear axle.
The car follows the path of the target. Its speed brings it to where the target is in LOOKAHEAD seconds.
"""

from typing import Any

import numpy as np

from slalom.adapters.commonroad.scene import LENGTH, WIDTH, Motion, in_goal, surroundings, target
from slalom.base.checks import Array
from slalom.decision.methods import method
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Rectangle
from slalom.vehicle import Bicycle, Pose, VehicleNavigator

WHEELBASE = 2.5789
STEERING = 1.066
STEERING_RATE = 0.4
"""[m], [rad], [rad/s] of vehicle type 2."""
POWER = 11.5 * 7.319
"""[m^2/s^3] Largest acceleration times speed of vehicle type 2 above 7.319 m/s."""
DISCS = 6
"""Discs that cover the body, which add 0.08 m at its sides. More: less is added, and decisions take longer."""
LOOKAHEAD = 1.0
"""[s] in which the car is to be where the target is. Longer: it reacts more evenly to its delay."""
AHEAD = 2.0
"""[s] of driving to the point of the path that the car heads for. Shorter: it turns aside later."""
SPEED_RESERVE, SLOWEST = 1.25, 0.1
"""Largest speed of the car in units of the target's largest one; [m/s] least speed along a path."""


def drive_single_track(scenario: Any, problem: Any, max_acceleration: float, margin: float) -> Motion:
    """Motion of the single-track model, see `solve`."""
    dt, start = float(scenario.dt), problem.initial_state
    first, last = int(start.time_step), int(problem.goal.state_list[0].time_step.end)
    path, _ = target(problem, dt)
    times = np.arange(*path.span, dt)
    points, speeds = path.position(times), np.linalg.norm(path.velocity(times), axis=1)
    fastest = SPEED_RESERVE * max(float(speeds.max()), float(start.velocity))
    car = Bicycle(WHEELBASE, STEERING, STEERING_RATE, fastest, min(max_acceleration, POWER / fastest), period=dt)
    robot = VehicleNavigator(car, method("nao"), Rectangle(LENGTH, WIDTH), discs=DISCS, margin=margin)
    around, pose = surroundings(scenario), Pose(start.position, float(start.orientation), float(start.velocity))
    poses = [pose]
    previous = None
    safe = True
    reached = False
    k = first
    while k < last and not reached:
        goal = _along(points, path.position(min(k * dt + LOOKAHEAD, path.span[1])), pose)
        previous = robot.decide(pose, around, goal, now=k * dt, previous=previous)
        pose = car.drive(pose, previous.command)
        poses.append(pose)
        k, safe = k + 1, safe and previous.outcome.safe
        reached = in_goal(problem, pose.position, pose.velocity, k, pose.heading)
    return Motion(
        np.arange(first, k + 1, dtype=np.float64),
        np.array([each.position for each in poses]),
        np.array([each.velocity for each in poses]),
        np.array([each.heading for each in poses]),
        np.array([each.turn for each in poses]),
        reached,
        safe,
        "KS",
    )


def _along(points: Array, ahead: Array, pose: Pose) -> PathGoal:
    """The path (n, 2) [m] at the speed with which the car is where the target is after LOOKAHEAD: `ahead` (2,) [m]."""
    path = PathGoal(points, stop=False)
    way = path.nearest(ahead, 0.0, path.length) - path.nearest(pose.position, 0.0, path.length)
    return PathGoal(points, max(way / LOOKAHEAD, SLOWEST), stop=False, lookahead=AHEAD)
