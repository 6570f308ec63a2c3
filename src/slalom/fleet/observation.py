"""What the robots of a fleet know of each other, and what each of them sees."""

from collections.abc import Iterator, Sequence

import numpy as np

from slalom.base.checks import Array, has
from slalom.base.errors import InvalidInput
from slalom.fleet.settings import Members, Policy
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import RobotTable
from slalom.model.state import State
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.perception.sight import Sight, Visibility


class Information:
    """What the robots of a fleet know of each other: all states and all published manoeuvres, as they are now.

    A simulator with late or lost observations has a subclass.
    """

    def receive(self, table: RobotTable, now: float) -> None:
        """Observe the robots, which the table holds as they are at `now` [s]."""

    def groups(
        self, table: RobotTable, d: int, policy: Policy, due: Indices, now: float
    ) -> Iterator[tuple[Indices, float]]:
        """Groups (rows) of the robots that are `due` by one policy, and the time [s] until they decide again.

        As a group decides, the table holds what it knows of the others in `d` dimensions. A time below the period
        stands for the period. Robots in no group keep their manoeuvres.
        """
        policy.observe(table, d, now, None, None)
        yield due, 0.0


class Observer:
    """Limited sight of one robot among `obstacles`, of which those at rest are a known map.

    Attributes:
        last: the visibility at the last decision; None before. robots_seen: (n,) whether each other robot was visible.
    """

    def __init__(self, sight: Sight, obstacles: Sequence[Obstacle]) -> None:
        self.sight = sight
        self.last: Visibility | None = None
        self.robots_seen = np.zeros(0, np.bool_)
        self._map = ObstacleTable(o for o in obstacles if o.at_rest)

    def look(
        self, state: State, obstacles: Sequence[Obstacle], now: float, ahead: Array, robots: Sequence[Obstacle] = ()
    ) -> list[Obstacle | ObstacleTable]:
        """The map, the obstacles that are seen at `now` [s], and those that stand for hidden agents.

        Args:
            obstacles: all that there are. robots: (n,) others, of which `robots_seen` says which are seen; they are
                not in the result.
            ahead: (2,) [m] a point that a robot faces which has not moved yet.
        """
        if self.last is None and state.heading is None and not state.velocity.any():
            x, y = ahead - state.position
            state = State(state.position, state.velocity, state.acceleration, float(np.arctan2(y, x)))
        self.last = self.sight.look(state, (*obstacles, *robots), now, self.last)
        there, self.robots_seen = np.split(self.last.visible, [len(obstacles)])
        moving = [o for o, seen in zip(obstacles, there) if seen and not o.at_rest]
        return [self._map, *moving, *self.last.hidden]


def observers_of(sight: Sight, members: Members, obstacles: Sequence[Obstacle]) -> list[Observer]:
    """The sight of each robot of a fleet. Raises InvalidInput as the fleet."""
    has(sight, ("look", "range"), "a Sight, or None", "sight")
    if members.shapes[0].dimension != 2 or members.worlds.any():
        raise InvalidInput("sight: expected none in space or in several worlds, found one")
    if sight.hidden_speed is not None:
        raise InvalidInput(f"sight: expected no hidden speed in a fleet, found {sight.hidden_speed:g} m/s")
    return [Observer(sight, obstacles) for _ in members.shapes]
