"""Records of decisions of robots that search, which files hold."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

from slalom.decision import Commitment, Decision
from slalom.decision.document import KINDS
from slalom.decision.navigator import Navigator
from slalom.model.goal import Goal
from slalom.model.state import State
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import each_for_one


@runtime_checkable
class Searching(Protocol):
    """A LookAhead or an ExpectedLoss."""

    @property
    def decide(self) -> Any:
        """See `LookAhead.decide`."""


class SearchCall(NamedTuple):
    """One call of `decide` of a robot that searches.

    Attributes:
        robot: a LookAhead or an ExpectedLoss. scales: see `ExpectedLoss.decide`.
        table: [s] begin and end of the table of obstacles that it used, if that serves several decisions.
    """

    robot: Searching
    state: State
    obstacles: Sequence[Obstacle | ObstacleTable | Tracks]
    goal: Goal
    now: float
    scales: Mapping[str, float] | None = None
    table: tuple[float, float] | None = None

    def decision(self, previous: Decision | None) -> Decision:
        """The decision after `previous`, made again."""
        robot: Any = self.robot
        further = {} if self.scales is None else {"scales": self.scales}
        if self.table is not None:
            robot = robot.with_table(each_for_one(self.obstacles, self.state.dimension, self.now), self.table)
        decided: Decision = robot.decide(
            self.state, self.obstacles, self.goal, now=self.now, previous=previous, **further
        )
        return decided


class SearchInputs(NamedTuple):
    """All inputs of a decision of a robot that searches, a `Record`: the calls since its search began.

    A search goes on over several decisions, and its tree is larger than all that it was made from.
    """

    previous: Commitment | None  # before the first call
    calls: tuple[SearchCall, ...]

    @property
    def navigator(self) -> Navigator:
        """The navigator of the robot."""
        robot: Any = self.calls[-1].robot
        found: Navigator = getattr(robot, "robot", robot).navigator
        return found

    @property
    def goal(self) -> Goal:
        """The goal of the last call."""
        return self.calls[-1].goal

    def repeat(self) -> Decision:
        """The decision, made again."""
        decision = None if self.previous is None else self.previous.decision
        for call in self.calls:
            decision = call.decision(decision)
        assert decision is not None
        return decision


def recorded(call: SearchCall, previous: Decision | None, *, fresh: bool) -> SearchInputs:
    """The record of the decision of a call; `fresh`: it does not depend on the search of the previous decision."""
    before = None if previous is None else previous.record
    if fresh or not isinstance(before, SearchInputs):
        return SearchInputs(None if previous is None else previous.commitment, (call,))
    return SearchInputs(before.previous, (*before.calls, call))


KINDS.update({"SearchCall": SearchCall, "SearchInputs": SearchInputs})
