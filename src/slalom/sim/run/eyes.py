"""What one robot of a run sees, from decision to decision."""

from collections.abc import Sequence

import numpy as np

from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.sight import Visibility
from slalom.sim.scenario import Scenario
from slalom.state import State
from slalom.trajectory import Stationary


class Eyes:
    """Limited sight of robot `robot` of a scenario. At first it faces its goal.

    Attributes:
        last: what it saw last; None before the first decision. robots_seen: (n,) whether it saw each other robot.
    """

    def __init__(self, scenario: Scenario, robot: int) -> None:
        assert scenario.sight is not None
        self.sight, self.obstacles = scenario.sight, scenario.obstacles
        self.last: Visibility | None = None
        self.robots_seen = np.zeros(0, np.bool_)
        self._map = ObstacleTable(o for o in self.obstacles if isinstance(o.trajectory, Stationary))
        own = scenario.robots[robot]
        x, y = own.goal.position(scenario.start) - own.state.position
        self._first_heading = float(np.arctan2(y, x))

    def look(self, state: State, now: float, robots: Sequence[Obstacle] = ()) -> list[Obstacle | ObstacleTable]:
        """The map, the obstacles that are seen at `now` [s], and those that stand for hidden agents.

        `robots` (n,) are others, of which `robots_seen` says which are seen; they are not in the result.
        """
        if self.last is None and not state.velocity.any():
            state = State(state.position, state.velocity, state.acceleration, self._first_heading)
        self.last = self.sight.look(state, (*self.obstacles, *robots), now, self.last)
        there, self.robots_seen = np.split(self.last.visible, [len(self.obstacles)])
        moving = [o for o, seen in zip(self.obstacles, there) if seen and not isinstance(o.trajectory, Stationary)]
        return [self._map, *moving, *self.last.hidden]
