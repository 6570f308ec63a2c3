"""The progress of a robot towards its goal, by which it is found to be stuck."""

from math import dist
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

    A new one is noted in three cases. The robot is at the goal, or the goal has moved by more than its tolerance. Or
    the distance to the goal, on a path along it, is less than at the last one by APPROACH_TIME times `max_speed` [m/s].

    Args:
        progress: [m] along the path of a `PathGoal`.
    """
    if goal is None:
        return None
    # Lists take a quarter of the time of arrays of two numbers.
    target = goal.position(now)
    place = target.tolist()
    left = dist(place, state.position.tolist())
    if progress is not None and isinstance(goal, PathGoal):
        left = max(left, goal.length - progress)
    left = max(left - goal.tolerance, 0.0)
    if (
        last is not None
        and 0.0 < left > last.distance - APPROACH_TIME * max_speed
        and dist(place, last.target.tolist()) <= goal.tolerance
    ):
        return last
    return Approach(left, now, target)


class Approaches:
    """The last progress of n robots towards their goals, as arrays: the same rule as `approach_of`."""

    def __init__(self, n: int, d: int) -> None:
        self._distance, self._since, self._target = np.full(n, np.nan), np.zeros(n), np.full((n, d), np.nan)

    def stalled(self, left: Array, targets: Array, tolerances: Array, speeds: Array, now: float) -> Array:
        """Time [s] since each robot last came nearer to its goal: (n,).

        Args:
            left: (n,) [m] to the goal, without its tolerance; nan for a robot without a goal or that is not present.
            targets: (n, d) [m] positions of the goals. tolerances: (n,) [m]. speeds: (n,) [m/s] largest ones.
        """
        same = np.linalg.norm(targets - self._target, axis=1) <= tolerances
        keeps = (left > 0.0) & (left > self._distance - APPROACH_TIME * speeds) & same
        self._distance, self._since = np.where(keeps, self._distance, left), np.where(keeps, self._since, now)
        self._target = np.where(keeps[:, None], self._target, targets)
        return now - self._since
