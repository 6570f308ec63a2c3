"""Least clearance of the robots of many worlds during a step, in continuous time.

A lower bound comes from the chords of relative motion. Where it is not above 0, the clearance is that of the control
obstacle from which decisions are made.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from slalom.adapters.gym.bodies import Surroundings
from slalom.adapters.gym.motion import least_distances
from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.kernels.arrays import Flags, Indices
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow
from slalom.response import Acceleration
from slalom.state import State
from slalom.trajectory import ConstantAcceleration

if TYPE_CHECKING:
    from slalom.adapters.gym.worlds import Worlds


class Moved(NamedTuple):
    """States (W, R, d) at the start of a step, and the accelerations during it."""

    position: Array
    velocity: Array
    acceleration: Array


def least_clearances(
    worlds: "Worlds", moved: Moved, steps: Indices, some: Flags, before: Surroundings, after: Surroundings
) -> Array:
    """Lower bounds (W, R) [m] of the least clearance of `some` robots (W, R) during `steps` (W,); inf for the others.

    Above 0 they are below the true ones by at most M h^2 / 8, with the step h and the relative acceleration M. Near a
    wall they are below by at most the distance that the robot drives in the step. Otherwise they are exact up to
    CERTIFIED.
    """
    (w, r, b), o, h = before.there.shape, before.moving, worlds.period
    own, bends, there = np.linalg.norm(moved.acceleration, axis=-1) * h * h / 8.0, np.zeros((w, b)), before.there.copy()
    bends[:, :o], exist = worlds.bodies.during(steps)
    bends[:, o : o + r], there[..., :o] = own, exist[:, None]
    distance = least_distances(before.offsets, after.offsets)
    # The nearest point of a wall moves along it: the distance changes at most as fast as the robot moves.
    way = np.linalg.norm(h * moved.velocity + 0.5 * h * h * moved.acceleration, axis=-1)[..., None]
    ends = (np.linalg.norm(each.offsets[:, :, o + r :], axis=-1) for each in (before, after))
    distance[..., o + r :] = np.maximum(0.5 * (sum(ends) - way), 0.0)
    lower = distance - own[..., None] - bends[:, None] - before.radii[:, None] - worlds.robots.radius[..., None]
    lower = np.where(there & some[..., None], lower, np.inf)
    least = lower.min(axis=-1, initial=np.inf)
    for k, j in np.argwhere(least <= 0.0).tolist():
        close = np.flatnonzero(lower[k, j] <= 0.0)
        others = [_body(worlds, moved, k, int(body), o, worlds.now(k) - h) for body in close]
        window = ObstacleWindow(others, worlds.now(k) - h, h)
        state, shape = State(moved.position[k, j], moved.velocity[k, j]), worlds.scenarios[k].robots[j].shape
        exact = float(ControlObstacle(Acceleration(), state, window, shape).clearance(moved.acceleration[k, j]))
        rest = lower[k, j, lower[k, j] > 0.0]
        least[k, j] = min(exact, float(rest.min(initial=np.inf)))
    return np.asarray(least)


def _body(worlds: "Worlds", moved: Moved, w: int, body: int, moving: int, start: float) -> Obstacle:
    """A body of `Surroundings` as an obstacle."""
    r = body - moving
    if r < 0:
        return worlds.bodies.motions[w].moving[body]
    robots = worlds.scenarios[w].robots
    if r < len(robots):
        path = ConstantAcceleration(moved.position[w, r], moved.velocity[w, r], moved.acceleration[w, r], start)
        return Obstacle(robots[r].shape, path)
    return worlds.bodies.motions[w].walls[r - len(robots)]
