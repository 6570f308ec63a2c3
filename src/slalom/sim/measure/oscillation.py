"""Measures of oscillation: changes of the passing side, of the heading, and of the committed manoeuvre.

Each measure is a pure function of a recording and one robot, see `robot_metrics`; `flips_between` is of all pairs.
"""

from typing import Final, NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.decision import Outcome
from slalom.kernels.arrays import Indices
from slalom.obstacle.periodic import between
from slalom.sim.measure.closest_approach import nearest_images
from slalom.sim.measure.recording import Recording, Which
from slalom.sim.measure.single_robot_view import single_robot_view
from slalom.tolerances import MOVING_SHARE


class Passing(NamedTuple):
    """Conditions under which two robots are about to pass each other on a defined side.

    Attributes:
        ahead: [s] largest time to the closest approach at the present velocities; the horizon of the gallery's robots.
            Smaller: flips of distant robots do not count.
        towards: [1] least cosine between the relative velocity and the line between the robots; 0.5 is 60 degrees.
            0: small motions of robots side by side count as flips.
        band: [1] least distance of the closest approach, as a share of the sum of the radii. 0: rounding flips the side
            of robots on a central collision course.
    """

    ahead: float = 6.0
    towards: float = 0.5
    band: float = 0.1


PASSING: Final = Passing()


def passing_sides(position: Array, velocity: Array, contact_distance: float, rule: Passing = PASSING) -> Indices:
    """Return the side (T,) on which a robot would pass another one at each step, in the plane.

    Args:
        position: (T, 2) [m] of the other robot relative to the robot.
        velocity: (T, 2) [m/s] of the robot relative to the other robot.
        contact_distance: [m] sum of their radii.

    Returns:
        Sign of velocity x position: 1 if the other robot is left of the robot's path, -1 if right of it, 0 if the
        conditions of `rule` do not hold.
        Law: the value is the same for both robots.
    """
    closing = np.sum(velocity * position, axis=1)
    squared_speed = np.sum(velocity * velocity, axis=1)
    cross_product = velocity[:, 0] * position[:, 1] - velocity[:, 1] * position[:, 0]
    speed, distance = np.sqrt(squared_speed), np.linalg.norm(position, axis=1)
    approach = (closing > rule.towards * distance * speed) & (closing <= rule.ahead * squared_speed)
    decided = np.abs(cross_product) >= rule.band * contact_distance * speed
    return np.where(approach & decided, np.sign(cross_product), 0.0).astype(np.int64)


def _flips(sides: Indices) -> int:
    """Count the changes between -1 and 1 in `sides` (T,), ignoring zeros."""
    return int(np.count_nonzero(np.diff(sides[sides != 0])))


def side_flips(recording: Recording, robot: Which = None) -> float:
    """Number of changes of the side on which the robot would pass an obstacle, over all obstacles; 0 in space.

    Walls and other obstacles of several parts have no passing side.
    """
    recording, total = single_robot_view(recording, robot), 0
    for obstacle in [image for o in recording.obstacles for image in nearest_images(recording, 0, o)]:
        first, last = obstacle.trajectory.span
        present = (recording.times >= first) & (recording.times <= last)
        if recording.dimension == 3 or len(obstacle.shape.parts) > 1 or not np.any(present):
            continue
        times = recording.times[present]
        relative_position = obstacle.trajectory.position(times) - recording.positions[present, 0]
        velocity = recording.velocities[present, 0] - obstacle.trajectory.velocity(times)
        total += _flips(
            passing_sides(
                relative_position, velocity, recording.shapes[0].bounding_radius + obstacle.shape.bounding_radius
            )
        )
    return float(total)


def flips_between(recording: Recording, rule: Passing = PASSING) -> tuple[Indices, Indices]:
    """Return side flips of each pair of robots, and the number of steps before a passing: both (N, N), symmetric."""
    n = recording.positions.shape[1]
    flips, steps = np.zeros((n, n), np.int64), np.zeros((n, n), np.int64)
    for i in range(n if recording.dimension == 2 else 0):
        for j in range(i):
            relative_position = recording.positions[:, j] - recording.positions[:, i]
            velocity = recording.velocities[:, i] - recording.velocities[:, j]
            contact_distance = recording.shapes[i].bounding_radius + recording.shapes[j].bounding_radius
            for shift in _images(recording, relative_position, velocity, rule):
                sides = passing_sides(relative_position + shift, velocity, contact_distance, rule)
                flips[i, j] += _flips(sides)
                steps[i, j] += np.count_nonzero(sides)
            flips[j, i], steps[j, i] = flips[i, j], steps[i, j]
    return flips, steps


def _images(recording: Recording, position: Array, velocity: Array, rule: Passing) -> Array:
    """Return displacements (m, 2) [m] of the other robot's images that may satisfy `rule`; only 0 without a period."""
    if recording.period is None:
        return np.zeros((1, 2))
    # A closest approach within `ahead` at a cosine above `towards` bounds the distance.
    max_distance = rule.ahead * float(np.linalg.norm(velocity, axis=1).max()) / max(rule.towards, 1e-3)
    return between(-max_distance - position.max(axis=0), max_distance - position.min(axis=0), recording.period)


def heading_variation(recording: Recording, robot: Which = None, moving: float = MOVING_SHARE) -> float:
    """Sum of the absolute changes of the heading [rad] between consecutive steps at which the robot moves.

    It includes the turns of the path itself. Unlike `heading_change` it omits steps at which the robot is slower than
    `moving` times its maximum speed.
    """
    robot = recording.row(robot)
    v = recording.velocities[:, robot]
    speed = np.linalg.norm(v, axis=1)
    moves = speed > moving * recording.limits[robot].max_speed
    unit = v[moves] / speed[moves, None]
    difference, total = (np.linalg.norm(unit[1:] + sign * unit[:-1], axis=1) for sign in (-1.0, 1.0))
    return float(2.0 * np.arctan2(difference, total).sum())


def changed_choices(recording: Recording, robot: Which = None) -> float:
    """Share of the decisions with an outcome that changed the committed manoeuvre."""
    robot = recording.row(robot)
    made = [row[robot] for row in recording.outcomes if row[robot] in Outcome.__members__]
    return sum(name not in ("KEPT", "CONTINUED") for name in made) / len(made) if made else 0.0
