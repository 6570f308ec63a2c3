"""State and command of a vehicle in the plane, and the goal of the point that it decides for."""

from dataclasses import dataclass
from math import cos, hypot, sin
from typing import Final, NamedTuple

import numpy as np

from slalom.checks import GOAL, Array, Checked, Number, has, vector
from slalom.fields import check_fields
from slalom.goal import Goal
from slalom.obstacle.periodic import moved
from slalom.path_goal import PathGoal
from slalom.tolerances import GOAL_HEADING_BLEND, POINT_TOLERANCE

POSE: Final = (("position", "heading", "speed", "turn"), "a Pose")
"""For checks, see `checks.STATE`."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Position, heading, speed and turn of a vehicle.

    `position` (2,) [m] of the middle of its axle (of a bicycle, the rear one), `heading` [rad], `speed` [m/s] along the
    heading, negative in reverse. `turn` is the turn rate [rad/s] of a differential drive, or the steering angle [rad]
    of a bicycle.
    """

    position: Checked = Checked(vector)
    heading: Number  # type: ignore[misc]  # the field before it has no default: Checked is a descriptor
    speed: Number = 0.0
    turn: Number = 0.0

    def __post_init__(self) -> None:
        vector(self.position, "position", 2)
        check_fields(self)

    @property
    def direction(self) -> Array:
        """Unit vector (2,) along the heading."""
        return np.array([cos(self.heading), sin(self.heading)])

    @property
    def velocity(self) -> Array:
        """Velocity (2,) [m/s] of the middle of the axle in the world frame."""
        return self.speed * self.direction


class Command(NamedTuple):
    """The speed and turn rate, or steering angle, to reach at the end of a period at constant rates.

    `speed` [m/s], and as `turn` a turn rate [rad/s] (differential drive) or a steering angle [rad] (bicycle).
    """

    speed: float
    turn: float


def goal_of_point(pose: Pose, goal: Goal, ahead: float, now: float, reverses: bool) -> Goal:
    """Goal of a point `ahead` [m] of the axle that brings the axle to `goal`.

    The point goes as far beyond the goal as it is ahead of the axle, seen from the axle. Within a distance of two times
    `ahead` a vehicle that `reverses` may also come from the other side. Close to the goal its heading is kept.
    """
    has(pose, *POSE, "pose")
    has(goal, *GOAL, "goal")
    if isinstance(goal, PathGoal):
        last = goal.points[-1] - goal.points[-2]
        points = np.concatenate([goal.points[:-1], goal.points[-1:] + ahead * last / hypot(*last)])
        return PathGoal(points, goal.speeds, POINT_TOLERANCE * goal.tolerance, goal.stop, lookahead=goal.lookahead)
    direction, displacement = pose.direction, goal.position(now) - pose.position
    if reverses and hypot(*displacement) < 2.0 * ahead and displacement @ direction < 0.0:
        displacement = -displacement
    beyond = displacement + (GOAL_HEADING_BLEND * goal.tolerance) * direction
    length = hypot(*beyond)
    offset = ahead * (beyond / length if length > 0.0 else direction)
    return Goal(moved(goal.trajectory, offset), POINT_TOLERANCE * goal.tolerance, goal.stop)
