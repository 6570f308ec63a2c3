"""Shares of the avoidance of two robots that avoid each other, and the side on which they pass."""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.decision.tables import DecisionSettings, RobotTable
from slalom.kernels.jit import kernel
from slalom.kernels.squared import squared
from slalom.tolerances import AGREED_SIDE, SIDE_ROUNDING


@kernel
def share_of(i: int, k: int, robots: RobotTable, settings: DecisionSettings) -> float:
    """The part [1] of the avoidance that robot i does itself, robot k the rest: less with more priority than it."""
    own, other = settings.share * robots.priority[k], (1.0 - settings.share) * robots.priority[i]
    return float(own / (own + other))


@kernel
def agreed_side(
    i: int, k: int, position: Array, velocity: Array, room: float, robots: RobotTable, side: Array
) -> float:
    """Widening [m] of robot k towards a side, the unit vector `side` (d,).

    Two robots that would both make a half of the avoidance collide if they do so towards opposite sides. Each therefore
    passes on the side on which it would pass now if neither changed its velocity, the right one if that is none. The
    other side counts as wider by twice the result, by which the body is displaced and grown. Robots that will not meet
    agree on nothing. Both robots find the same side, since the relative motion of one is the negative of the other's.

    Args:
        position, velocity: (d,) [m], [m/s] of robot k as observed. room: [m] by which the body may grow now.
    """
    d, square, along, fast = len(side), 0.0, 0.0, 0.0
    for axis in range(d):
        away, relative = position[axis] - robots.position[i, axis], robots.velocity[i, axis] - velocity[axis]
        square += away * away
        along += away * relative
        fast += relative * relative
    size, aside = robots.radius[i] + robots.radius[k] + robots.margin[i], 0.0
    if along <= 0.0 or square <= 0.0 or square - along * along / fast >= size * size:
        return 0.0
    for axis in range(d):
        away, relative = position[axis] - robots.position[i, axis], robots.velocity[i, axis] - velocity[axis]
        side[axis] = away * along / square - relative
        aside += squared(side[axis])
    if aside <= SIDE_ROUNDING * fast:
        # To the right of the line to robot k lies the free side.
        side[0], side[1] = robots.position[i, 1] - position[1], position[0] - robots.position[i, 0]
        aside = squared(side[0]) + squared(side[1])
        if d == 3:
            side[2] = 0.0
        if aside <= 0.0:
            return 0.0
    for axis in range(d):
        side[axis] /= np.sqrt(aside)
    return float(max(min(AGREED_SIDE * size, room), 0.0))
