"""The progress of a robot towards its goal, by which it is found to be stuck."""

from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.goal import Goal
from slalom.path_goal import PathGoal
from slalom.state import State
from slalom.tolerances import APPROACH_TIME


class Approach(NamedTuple):
    """The last progress of a robot towards its goal."""

    distance: float  # [m] that was left, without the tolerance of the goal
    since: float  # [s] absolute time
    target: Array  # (d,) [m] position of the goal then


def approach_of(
    goal: Goal | None, state: State, progress: float | None, max_speed: float, now: float, last: Approach | None
) -> Approach | None:
    """The last progress of a robot in `state`: `last`, or a new one `now` [s]; None without a goal.

    It is new where the distance to the goal, on a path along it, is less than at the last one by APPROACH_TIME times
    `max_speed` [m/s]; at the goal; and where the goal has moved by more than its tolerance.

    Args:
        progress: [m] along the path of a `PathGoal`.
    """
    if goal is None:
        return None
    target = goal.position(now)
    left = float(np.linalg.norm(target - state.position))
    if progress is not None and isinstance(goal, PathGoal):
        left = max(left, goal.length - progress)
    left = max(left - goal.tolerance, 0.0)
    if (
        last is not None
        and 0.0 < left > last.distance - APPROACH_TIME * max_speed
        and float(np.linalg.norm(target - last.target)) <= goal.tolerance
    ):
        return last
    return Approach(left, now, target)
