"""Right of way of robots that are held up: robots of higher rank leave the ways that these claim."""

from typing import Final

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.decision.paths import state_on_path
from slalom.kernels.decision.tables import ASIDE, Claims, DecisionTables, Paths, Robot, Scratch
from slalom.kernels.jit import kernel, squared

ON_WAY_COST: Final = 20.0
"""[1] Cost of a manoeuvre that ends on the way of another robot, in times of the drive off that way. Larger: hardly any
other choices, since a robot leaves a way in any case. Near 1: it stays if its own way leads there."""

IN_PLANE: Final = 8
"""[1] The first directions of ASIDE, which are those in the plane."""


@kernel
def depth_on_way(robot: Robot, place: Array, claims: Claims, c: int, nearest: Array) -> float:
    """Distance [m] by which a robot at `place` (d,) [m] reaches into claim c; at most 0 if it is off the way.

    The nearest point of the way goes into `nearest` (d,) [m].
    """
    product = 0.0
    square = 1e-300
    for axis in range(len(place)):
        way = claims.way[c, axis]
        product += (place[axis] - claims.position[c, axis]) * way
        square += way * way
    share = min(max(product / square, 0.0), 1.0)
    away = 0.0
    for axis in range(len(place)):
        nearest[axis] = claims.position[c, axis] + share * claims.way[c, axis]
        away += squared(place[axis] - nearest[axis])
    return float(claims.width[c] + robot.radius - np.sqrt(away))


@kernel
def way_to_leave(robot: Robot, place: Array, claims: Claims, nearest: Array) -> tuple[int, float]:
    """The claim of least rank whose way a robot at `place` (d,) [m] has to leave, and how far [m] it reaches into it.

    -1 and 0 if there is none. The nearest point of the way goes into `nearest` (d,) [m].
    """
    found = -1
    depth = 0.0
    if robot.world + 1 >= len(claims.first):
        return found, depth
    for c in range(claims.first[robot.world], claims.first[robot.world + 1]):
        if claims.rank[c] < robot.rank and (found < 0 or claims.rank[c] < claims.rank[found]):
            deep = depth_on_way(robot, place, claims, c, nearest)
            if deep > 0.0:
                found = c
                depth = deep
    if found >= 0:
        depth_on_way(robot, place, claims, found, nearest)
    return found, depth


@kernel
def cost_on_ways(i: int, until: float, paths: Paths, row: int, tables: DecisionTables, scratch: Scratch) -> float:
    """Cost [s] of row `row` of `paths` for robot i if it comes to rest on a way that the robot has to leave.

    It brakes evenly after `until` [s].
    """
    if len(tables.claims.rank) == 0:
        return 0.0
    robot = tables.robots.each[i]
    place = scratch.position
    velocity = scratch.velocity
    state_on_path(paths, row, tables.settings.now + until, place, velocity)
    for axis in range(len(place)):
        place[axis] += 0.5 * velocity[axis] * robot.max_speed / robot.stopping
    _, depth = way_to_leave(robot, place, tables.claims, scratch.displacement)
    return float(ON_WAY_COST * depth / robot.max_speed)


@kernel
def ways_aside(i: int, tables: DecisionTables) -> Array:
    """Unit vectors (m, 3) in which robot i may leave the way on which it is; (0, 3) if it has none to leave.

    The first leads straight off the way. With it, the direction of the way and in space the third axis, they are those
    from the centre of a cube to its sides and edges, except to edges beside the way.
    """
    claims = tables.claims
    if len(claims.rank) == 0:
        return np.empty((0, 3))
    robot = tables.robots.each[i]
    d = tables.settings.dimension
    nearest = np.zeros(d)
    found, _ = way_to_leave(robot, robot.position[:d], claims, nearest)
    if found < 0:
        return np.empty((0, 3))
    axes = np.zeros((3, 3))
    for axis in range(d):
        axes[0, axis] = robot.position[axis] - nearest[axis]
        axes[1, axis] = claims.way[found, axis]
    orthonormalise(axes, d)
    count = len(ASIDE) if d == 3 else IN_PLANE
    directions = np.zeros((count, 3))
    for m in range(count):
        square = 0.0
        for k in range(3):
            square += abs(ASIDE[m, k])
        for axis in range(d):
            for k in range(3):
                directions[m, axis] += ASIDE[m, k] * axes[k, axis] / np.sqrt(square)
    return directions


@kernel
def orthonormalise(axes: Array, d: int) -> None:
    """Make three axes (3, 3) in d dimensions orthonormal, the second by the least turn; the third is their product.

    The first is to the right of the second where it is 0, and level in space; the second likewise.
    """
    length = 0.0
    along = 0.0
    for axis in range(d):
        length += squared(axes[0, axis])
        along += squared(axes[1, axis])
    if length < 1e-18:
        x = axes[1, 0]
        y = axes[1, 1]
        if x * x + y * y < 1e-12 * along or along == 0.0:
            x = 0.0
            y = 1.0
        axes[0, 0] = y
        axes[0, 1] = -x
        axes[0, 2] = 0.0
        length = x * x + y * y
    product = 0.0
    for axis in range(d):
        axes[0, axis] /= np.sqrt(length)
        product += axes[0, axis] * axes[1, axis]
    square = 0.0
    for axis in range(d):
        axes[1, axis] -= product * axes[0, axis]
        square += squared(axes[1, axis])
    if square <= 1e-12 * along:
        x = axes[0, 0]
        y = axes[0, 1]
        if x * x + y * y < 1e-12:
            x = 0.0
            y = 1.0
        axes[1, 0] = -y
        axes[1, 1] = x
        axes[1, 2] = 0.0
        square = x * x + y * y
    for axis in range(d):
        axes[1, axis] /= np.sqrt(square)
    for axis in range(3):
        after = (axis + 1) % 3
        last = (axis + 2) % 3
        axes[2, axis] = axes[0, after] * axes[1, last] - axes[0, last] * axes[1, after]
