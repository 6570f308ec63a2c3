"""The input of one decision as the policy takes it."""

from typing import TYPE_CHECKING, NamedTuple

from slalom.checks import TRACKS, has
from slalom.decision.decision import Decision
from slalom.forecast import Forecast
from slalom.goal import Goal
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.path_goal import PathStep
from slalom.state import State

if TYPE_CHECKING:
    from slalom.decision.navigator import Navigator


class Request(NamedTuple):
    """The input of one decision, with the obstacles that decide alike apart, see `Navigator.decide`."""

    robot: "Navigator"  # with the objective of the decision
    around: tuple[Obstacle | ObstacleTable | Tracks, ...]
    others: Tracks | None
    state: State
    goal: Goal
    step: PathStep | None
    now: float
    previous: Decision | None
    limit: float  # [s] of work

    @property
    def target(self) -> Goal:
        """The goal, or the next target on the path to it."""
        return self.goal if self.step is None else self.step.goal


def observed_robots(robots: Tracks | None, forecast: Forecast) -> tuple[Tracks | None, Tracks | None]:
    """The other robots as a method predicts them, and those that do no part of the avoidance; None for none.

    Raises:
        InvalidInput: something else than tracks, or tracks with probabilities or worlds.
    """
    if robots is None:
        return None, None
    has(robots, *TRACKS, "robots")
    robots.refuse_probabilities("robots")
    robots.refuse_worlds("robots")
    robots = robots.with_forecast(forecast)
    some, rest = (robots, None) if robots.shares is None else robots.yielding
    return some if len(some) else None, rest if rest is not None and len(rest) else None
