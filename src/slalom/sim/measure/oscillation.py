"""Whether robots oscillate: how often they change the side on which they pass, their heading, their choice.

One pure function of a recording per measure. Like the metrics they are of robot 0 if no robot is named;
`flips_between` is of all pairs of robots.
"""

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.checks import Array
from slalom.decision import Outcome
from slalom.sim.measure.closest_approach import images_met
from slalom.sim.measure.recording import Recording
from slalom.sim.periodic import between

Counts = npt.NDArray[np.int64]

MOVING: Final = 0.1
"""[1] A robot moves, and has a heading, if it is faster than this share of its largest speed.

Smaller: robots that shiver on the spot turn by hundreds of radians.
"""


class Passing(NamedTuple):
    """When two are about to pass each other, so that there is a side on which they do.

    Attributes:
        ahead: [s] they are within reach if at their present velocities they are nearest within this time; the horizon
            of the gallery's robots. Shorter: flips of robots that are still far from each other do not count.
        towards: [1] they approach if their relative velocity has more than this cosine with the line between them, here
            that of 60 degrees. 0: robots that stand side by side and shiver count as changing sides.
        band: [1] the side is decided if they would miss each other's centre by this share of the sum of their radii.
            0: robots that head for each other's centre change sides with every rounding.
    """

    ahead: float = 6.0
    towards: float = 0.5
    band: float = 0.1


PASSING: Final = Passing()


def passing_sides(place: Array, velocity: Array, touch: float, rule: Passing = PASSING) -> Counts:
    """On which side a robot would pass another one at each step, in the plane: (T,).

    Args:
        place: (T, 2) [m] of the other one, seen from the robot.
        velocity: (T, 2) [m/s] of the robot, seen from the other one.
        touch: [m] sum of their radii.

    Returns:
        The sign of velocity x place: 1 where the other one is left of the robot's way, -1 where it is right of it; 0
        where by `rule` they do not approach, are not within reach or have not decided.
        Law: the same for both of them.
    """
    closing = np.sum(velocity * place, axis=1)
    square = np.sum(velocity * velocity, axis=1)
    across = velocity[:, 0] * place[:, 1] - velocity[:, 1] * place[:, 0]
    speed, distance = np.sqrt(square), np.linalg.norm(place, axis=1)
    approach = (closing > rule.towards * distance * speed) & (closing <= rule.ahead * square)
    decided = np.abs(across) >= rule.band * touch * speed
    return np.where(approach & decided, np.sign(across), 0.0).astype(np.int64)


def _flips(sides: Counts) -> int:
    """How often a side follows on the other one, whatever lies between them."""
    return int(np.count_nonzero(np.diff(sides[sides != 0])))


def side_flips(recording: Recording) -> float:
    """How often the side changes on which the robot would pass an obstacle, of all obstacles; 0 in space.

    Walls and what else has several parts have no side to be passed on.
    """
    total = 0
    for obstacle in [image for o in recording.obstacles for image in images_met(recording, 0, o)]:
        first, last = obstacle.trajectory.span
        there = (recording.times >= first) & (recording.times <= last)
        if recording.dimension == 3 or len(obstacle.shape.parts) > 1 or not np.any(there):
            continue
        times = recording.times[there]
        place = obstacle.trajectory.position(times) - recording.positions[there, 0]
        velocity = recording.velocities[there, 0] - obstacle.trajectory.velocity(times)
        total += _flips(
            passing_sides(place, velocity, recording.shapes[0].bounding_radius + obstacle.shape.bounding_radius)
        )
    return float(total)


def flips_between(recording: Recording, rule: Passing = PASSING) -> tuple[Counts, Counts]:
    """`side_flips` of each pair of robots, and at how many steps they are about to pass: both (N, N), symmetric."""
    n = recording.positions.shape[1]
    flips, steps = np.zeros((n, n), np.int64), np.zeros((n, n), np.int64)
    for i in range(n if recording.dimension == 2 else 0):
        for j in range(i):
            place = recording.positions[:, j] - recording.positions[:, i]
            velocity = recording.velocities[:, i] - recording.velocities[:, j]
            touch = recording.shapes[i].bounding_radius + recording.shapes[j].bounding_radius
            for by in _images(recording, place, velocity, rule):
                sides = passing_sides(place + by, velocity, touch, rule)
                flips[i, j] += _flips(sides)
                steps[i, j] += np.count_nonzero(sides)
            flips[j, i], steps[j, i] = flips[i, j], steps[i, j]
    return flips, steps


def _images(recording: Recording, place: Array, velocity: Array, rule: Passing) -> Array:
    """Displacements (m, 2) [m] of the images of the other one that may be within reach by `rule`; (0, 0) alone."""
    if recording.period is None:
        return np.zeros((1, 2))
    # Within reach is who is passed within `ahead` seconds: those at the distance that is covered then, over `towards`.
    far = rule.ahead * float(np.linalg.norm(velocity, axis=1).max()) / max(rule.towards, 1e-3)
    return between(-far - place.max(axis=0), far - place.min(axis=0), recording.period)


def heading_variation(recording: Recording, robot: int = 0, moving: float = MOVING) -> float:
    """Sum of the absolute angles [rad] by which the velocity turns, from one step at which the robot moves to the next.

    In total: what the way itself needs is part of it. Unlike `heading_change` it leaves out steps at which the robot
    all but stands, slower than `moving` times its largest speed.
    """
    v = recording.velocities[:, robot]
    speed = np.linalg.norm(v, axis=1)
    moves = speed > moving * recording.limits[robot].max_speed
    unit = v[moves] / speed[moves, None]
    apart, along = (np.linalg.norm(unit[1:] + sign * unit[:-1], axis=1) for sign in (-1.0, 1.0))
    return float(2.0 * np.arctan2(apart, along).sum())


def changed_choices(recording: Recording, robot: int = 0) -> float:
    """Share of the decisions, of those that have an outcome, that changed the committed manoeuvre."""
    made = [row[robot] for row in recording.outcomes if row[robot] in Outcome.__members__]
    return sum(name not in ("KEPT", "CONTINUED") for name in made) / len(made) if made else 0.0
