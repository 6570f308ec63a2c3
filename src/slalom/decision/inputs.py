"""Inputs of a decision: the scene, and what the decision before left."""

from collections.abc import Sequence
from typing import NamedTuple

from slalom.base.checks import Array
from slalom.decision.settings import Settings
from slalom.model.goal import Goal
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path import Path
from slalom.model.state import State
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks


class Approach(NamedTuple):
    """The last progress of a robot towards its goal."""

    distance: float  # [m] that was left, without the tolerance of the goal
    since: float  # [s] absolute time
    target: Array  # (d,) [m] position of the goal then
    pace: float  # [m] the least distance left so far, plus what a robot drives that is not held up, see HELD_UP
    paced: float  # [s] absolute time of that


class Commitment(NamedTuple):
    """The part of the previous decision on which a decision depends, see `Decision`."""

    manoeuvre: Manoeuvre
    path: Path | None
    progress: float | None
    approach: Approach | None


class DecisionInputs(NamedTuple):
    """All inputs of a decision, see `Navigator.decide`."""

    navigator: Settings
    state: State
    obstacles: Sequence[Obstacle | ObstacleTable | Tracks]
    goal: Goal | None
    robots: Tracks | None
    now: float
    budget: float | None
    previous: Commitment | None
    searched: bool = False  # whether a search over sequences made the decision: the navigator alone does not repeat it
