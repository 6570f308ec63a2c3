"""What the responses of a method propose to one robot in one decision: their exact choices, and what these cost.

How much longer the way becomes around those who will stand in it.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from slalom import kernels
from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.decision import Outcome
from slalom.manoeuvre import Manoeuvre
from slalom.objective import Aim, Objective, Situation, preferred_control
from slalom.obstacle_table import ObstacleTable
from slalom.selection import Status, select, select_clearest
from slalom.shape import Shape


class Candidate(NamedTuple):
    """A response, the control that is preferred, and what it promises: the manoeuvre if nothing is in the way."""

    cost: float
    manoeuvre: Manoeuvre
    preferred: Array
    situation: Situation


class Proposal(NamedTuple):
    """A safe manoeuvre and what it costs."""

    cost: float
    manoeuvre: Manoeuvre
    outcome: Outcome
    preferred: Array
    blocked: ControlObstacle


@dataclass(frozen=True, eq=False)
class DecisionProblem:
    """What one decision is made from.

    Attributes:
        situations: one for each response, in the same state. traffic: who is in the way.
        robot: its shape. margins: (n,) [m] to keep from each obstacle now, at most `margin`.
        period: [s] until the next decision.
        objective, detours: see `navigator.Navigator`.
    """

    situations: list[Situation]
    traffic: ObstacleTable
    robot: Shape
    margins: Array
    margin: float
    period: float
    objective: Objective
    detours: tuple[float, ...]

    def candidates(self) -> list[Candidate]:
        """What each response is asked for on the way to the goal."""
        return [self._candidate(s, self.objective.aims(s)) for s in self.situations]

    def detour_candidates(self, without: list[Situation]) -> list[Candidate]:
        """Wishes for ways that are turned off the one to the goal, of all responses but some."""
        found, situations = [], [s for s in self.situations if s not in without]
        for angle in self.detours:
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            for s in situations:
                wanted = s.goal.desired_velocity(s.state.position, s.state.velocity, s.now, s.limits)
                aim = Aim(s.response.velocity(s.state, s.response.settled(s.horizon)), turn @ wanted)
                found.append(self._candidate(s, (aim,)))
        return found

    def _candidate(self, s: Situation, aims: tuple[Aim, ...]) -> Candidate:
        """What a response is asked for, and what it costs if nobody is in the way, on it or after it."""
        preferred = preferred_control(aims)
        manoeuvre = Manoeuvre(s.response, s.state, s.admissible.toward(preferred), s.now)
        return Candidate(self.objective.cost(manoeuvre, s, self.settled_time(manoeuvre)), manoeuvre, preferred, s)

    def propose(self, s: Situation, preferred: Array, margin: float | Array) -> Proposal | None:
        """The exact choice for one response, or None when it has no safe control."""
        blocked = ControlObstacle(s.response, s.state, self.traffic, self.robot, margin)
        enough = self.objective.enough_clearance
        if enough:
            choice, _ = select_clearest(preferred, s.admissible, blocked, enough=enough)
        else:
            choice = select(preferred, s.admissible, blocked)
        if choice.control is None:
            return None
        manoeuvre = Manoeuvre(s.response, s.state, choice.control, s.now)
        outcome = Outcome.CLEAR if choice.status is Status.CLEAR else Outcome.CONSTRAINED
        return Proposal(self.cost(manoeuvre, s, self.settled_time(manoeuvre)), manoeuvre, outcome, preferred, blocked)

    def cost(self, motion: Manoeuvre, s: Situation, until: float) -> float:
        """How long the objective takes [s], and with detours how long it takes to go around what will be in the way."""
        cost = self.objective.cost(motion, s, until)
        if self.detours and self.traffic.obstacles:
            longer = detour_lengths(motion.position(until), s.goal.position(until), *self._end_positions)
            cost += float(longer.sum()) / s.limits.max_speed
        return cost

    @cached_property
    def _end_positions(self) -> tuple[Array, Array]:
        """Where obstacles are at the horizon (n, d), and how near (n,) the robot may come to them.

        What has several parts, as walls have, is not gone around as a disc.
        """
        end = self.traffic.start + self.traffic.horizon
        there = [o for o in self.traffic.obstacles if o.exists(end) and len(o.shape.parts) == 1]
        places = np.array([o.trajectory.position(end) for o in there])
        radii = np.array([o.shape.bounding_radius for o in there]) + self.robot.bounding_radius + self.margin
        return places.reshape(-1, self.situations[0].state.dimension), radii

    def settled_time(self, manoeuvre: Manoeuvre) -> float:
        """When the robot is free to do something else: absolute time [s]."""
        return manoeuvre.settled_time(self.period, self.situations[0].horizon)


def detour_lengths(place: Array, goal: Array, centers: Array, radii: Array) -> Array:
    """By how much [m] the shortest way from `place` to `goal` (2,) around each disc (n, 2), (n,) is longer than
    straight: (n,).

    Two tangents and an arc; 0 for a disc that is not in the way. A place or goal inside a disc counts as on its border.
    """
    centers = np.ascontiguousarray(centers, dtype=np.float64)
    return kernels.detour_lengths(np.asarray(place), np.asarray(goal), centers, np.asarray(radii))
