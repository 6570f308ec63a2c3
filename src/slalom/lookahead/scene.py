"""Input and output of one decision of a robot that looks ahead."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from slalom.decision import Decision
from slalom.decision.futures import time_of
from slalom.decision.navigator import Navigator
from slalom.forecast import futures
from slalom.goal import Goal
from slalom.kernels.arrays import Flags
from slalom.lookahead.search import Search
from slalom.lookahead.spacetime_index import PredictedObstacles
from slalom.obstacle import Obstacle
from slalom.obstacle.window import Obstacles
from slalom.state import State
from slalom.tolerances import CONTACT_SLACK
from slalom.uncertainty import Scaled


@dataclass(frozen=True, eq=False, repr=False)
class SequenceDecision(Decision):
    """Decision for a whole sequence of accelerations.

    Attributes:
        search: the search that found the sequence.
        better: the search for an earlier arrival, which the next decision continues.
        arrival: absolute time [s] at which the sequence reaches the goal; inf if it ends before.
        doubt: share of the uncertainty of all obstacles that the sequence keeps clear of.
    """

    search: Search = field(kw_only=True)
    better: Search | None = None
    arrival: float = np.inf
    doubt: float = 1.0


class Scene(NamedTuple):
    """Input of one decision."""

    navigator: Navigator
    state: State
    goal: Goal
    now: float
    deadline: float  # [s] later arrivals do not count
    given: Obstacles  # as passed by the caller
    motions: Sequence[Obstacle]  # on their predicted trajectories
    prediction: PredictedObstacles
    before: Decision | None
    previous: SequenceDecision | None  # `before`, if it is one
    doubt: float = 1.0  # share of the uncertainty of all obstacles that counts

    def with_doubt(self, share: float) -> "Scene":
        """The scene with `share` of every uncertainty; the same if none is uncertain."""
        if share == self.doubt or all(motion.uncertainty is None for motion in self.motions):
            return self
        motions = [
            motion if motion.uncertainty is None else replace(motion, uncertainty=Scaled(motion.uncertainty, share))
            for motion in self.motions
        ]
        return self._among(motions)._replace(doubt=share)

    def without(self, given_up: Flags) -> "Scene":
        """The scene without some of the motions (n,); the same without none."""
        if not given_up.any():
            return self
        return self._among([motion for motion, gone in zip(self.motions, given_up.tolist()) if not gone])

    def clearance(self) -> float:
        """[m] of the robot now; contact is 0 or less."""
        return self.prediction.clearance(self.state.position, self.now) - CONTACT_SLACK

    def _among(self, motions: Sequence[Obstacle]) -> "Scene":
        latest = predicted_until(self.navigator, self.deadline, self.now)
        table = PredictedObstacles.of(
            *(None, motions, self.navigator.robot, self.now, latest, interval_of(self.navigator)),
            include_future=self.prediction.includes_future,
        )
        return self._replace(prediction=table, motions=motions)


def time_left(decision: Decision, scene: Scene) -> float:
    """[s] to the arrival, estimated for a decision without one."""
    if isinstance(decision, SequenceDecision) and decision.arrival < np.inf:
        return decision.arrival - scene.now
    return time_of(decision, scene.navigator, scene.state, scene.goal, scene.now)


def predicted_until(navigator: Navigator, deadline: float, now: float) -> float:
    """[s] up to which a decision predicts: its deadline, or one period if that has passed."""
    return max(deadline, now + navigator.period)


def rise_of(navigator: Navigator) -> float:
    """[s] from rest to the maximum speed."""
    return navigator.limits.max_speed / navigator.limits.max_acceleration


def interval_of(navigator: Navigator) -> float:
    """[s] width of the intervals of time by which obstacles are found; at least a period bounds their number."""
    return max(rise_of(navigator), navigator.period)


def motions_of(navigator: Navigator, obstacles: Sequence[Obstacle], now: float) -> list[Obstacle]:
    """Obstacles that count at `now` [s], on their predicted trajectories."""
    forecast, rise = navigator.method.forecast, rise_of(navigator)
    there = [k for k, o in enumerate(obstacles) if forecast.includes_future or o.exists(now)]
    each = futures(obstacles, forecast, now, there, rise)
    return [motion for motions in each for motion in motions]
