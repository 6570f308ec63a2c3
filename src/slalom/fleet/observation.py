"""Limited sight from decision to decision: the observer of one robot, and decisions of a fleet by what is visible."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from slalom.base.checks import Array, has
from slalom.base.errors import InvalidInput
from slalom.decision import Outcome
from slalom.fleet.settings import Policy
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import DecisionSettings
from slalom.model.state import State
from slalom.model.trajectory import ConstantVelocity
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.window import Obstacles, each_of, in_world
from slalom.perception.sight import Sight, Visibility

if TYPE_CHECKING:
    from slalom.fleet.fleet import CommittedFleet


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


def observers_of(fleet: "CommittedFleet", sight: Sight) -> list[Observer]:
    """The sight of each robot of a fleet. Raises InvalidInput as the fleet."""
    has(sight, ("look", "range"), "a Sight, or None", "sight")
    if fleet.dimension != 2 or fleet.images is not None or fleet.table.each["world"].any():
        raise InvalidInput("sight: expected none in space, in a periodic world or in several worlds, found one")
    if sight.hidden_speed is not None:
        raise InvalidInput(f"sight: expected no hidden speed in a fleet, found {sight.hidden_speed:g} m/s")
    return [Observer(sight, fleet.obstacles.given) for _ in fleet.members.shapes]


def decide_by_sight(
    fleet: "CommittedFleet", policy: Policy, some: Indices, settings: DecisionSettings, around: Obstacles
) -> dict[int, Outcome]:
    """The outcomes of robots (rows), each of which decides among the obstacles and the robots that it sees.

    Robots that share their manoeuvres know them of all robots.
    """
    each, d, now, outcomes = fleet.table.each, fleet.dimension, settings.now, dict[int, Outcome]()
    observed = fleet.table.observed
    times, points = observed.times.copy(), observed.points.copy()
    # There is one world, number 0.
    obstacles, present = each_of(in_world(around, 0)), each["present"].copy()
    robots = [
        Obstacle(shape, ConstantVelocity(position, velocity, now))
        for shape, position, velocity in zip(fleet.members.shapes, each["position"][:, :d], each["velocity"][:, :d])
    ]
    for k in some.tolist():
        others = [j for j in range(len(robots)) if j != k and each["present"][j]]
        heading = None if fleet.headings is None else float(fleet.headings[k])
        state = State(each["position"][k, :d], each["velocity"][k, :d], each["acceleration"][k, :d], heading)
        seen = fleet.observers[k].look(state, obstacles, now, each["target"][k, :d], [robots[j] for j in others])
        if not policy.method.shared:
            each["present"] = False
            each["present"][others], each["present"][k] = fleet.observers[k].robots_seen, True
        bodies = fleet.grown_bodies(fleet.window(policy, seen, now))
        outcomes |= fleet.decide(some[some == k], settings, bodies, seen)
        each["present"] = present
        if not settings.shared:
            # The next robot may not see the obstacles at which the others were predicted to stop.
            observed.times[:], observed.points[:] = times, points
    return outcomes
