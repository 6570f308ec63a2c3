"""Shares of the avoidance of two robots that avoid each other, and the side on which they pass."""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.decision.tables import DecisionSettings, Robot
from slalom.kernels.jit import kernel
from slalom.kernels.squared import squared
from slalom.tolerances import AGREED_SIDE, SIDE_ROUNDING


@kernel
def share_of(robot: Robot, other: Robot, settings: DecisionSettings) -> float:
    """The part [1] of the avoidance that a robot does itself: with more priority than the other one it does less."""
    own, rest = settings.share * other.priority, (1.0 - settings.share) * robot.priority
    return float(own / (own + rest))


@kernel
def agreed_side(robot: Robot, other: Robot, position: Array, velocity: Array, room: float, side: Array) -> float:
    """Widening [m] of the other robot towards a side, the unit vector `side` (d,).

    Two robots that would both make a half of the avoidance collide if they do so towards opposite sides. Each therefore
    passes on the side on which it would pass now if neither changed its velocity, the right one if that is none. The
    other side counts as wider by twice the result, by which the body is displaced and grown. Robots that will not meet
    agree on nothing. Both robots find the same side, since the relative motion of one is the negative of the other's.

    Args:
        position, velocity: (d,) [m], [m/s] of the other robot as observed. room: [m] by which the body may grow now.
    """
    d, square, along, fast = len(side), 0.0, 0.0, 0.0
    for axis in range(d):
        away, relative = position[axis] - robot.position[axis], robot.velocity[axis] - velocity[axis]
        square += away * away
        along += away * relative
        fast += relative * relative
    size, aside = robot.radius + other.radius + robot.margin_among, 0.0
    if along <= 0.0 or square <= 0.0 or square - along * along / fast >= size * size:
        return 0.0
    for axis in range(d):
        away, relative = position[axis] - robot.position[axis], robot.velocity[axis] - velocity[axis]
        side[axis] = away * along / square - relative
        aside += squared(side[axis])
    if aside <= SIDE_ROUNDING * fast:
        # To the right of the line to the other robot lies the free side.
        side[0], side[1] = robot.position[1] - position[1], position[0] - robot.position[0]
        aside = squared(side[0]) + squared(side[1])
        if d == 3:
            side[2] = 0.0
        if aside <= 0.0:
            return 0.0
    for axis in range(d):
        side[axis] /= np.sqrt(aside)
    return float(max(min(AGREED_SIDE * size, room), 0.0))
