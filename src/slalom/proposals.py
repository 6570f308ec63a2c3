"""Candidates and proposals of the responses in one decision, with their costs and the lengths of detours."""

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
    """Response with its preferred control and its optimistic cost: the cost of the manoeuvre without obstacles."""

    cost: float
    manoeuvre: Manoeuvre
    preferred: Array
    situation: Situation


class Proposal(NamedTuple):
    """Safe manoeuvre with its cost."""

    cost: float
    manoeuvre: Manoeuvre
    outcome: Outcome
    preferred: Array
    blocked: ControlObstacle


@dataclass(frozen=True, eq=False)
class DecisionProblem:
    """Input of one decision.

    Attributes:
        situations: one for each response, in the same state.
        table: the predicted obstacles.
        robot: its shape.
        margins: (n,) [m] to keep from each obstacle now, at most `margin`.
        period: [s] until the next decision.
        objective, detours: see `navigator.Navigator`.
    """

    situations: list[Situation]
    table: ObstacleTable
    robot: Shape
    margins: Array
    margin: float
    period: float
    objective: Objective
    detours: tuple[float, ...]

    def candidates(self) -> list[Candidate]:
        """Candidates towards the goal, one for each response."""
        return [self._candidate(s, self.objective.aims(s)) for s in self.situations]

    def detour_candidates(self, without: list[Situation]) -> list[Candidate]:
        """Candidates with the desired velocity turned by each detour angle, except for the responses of `without`."""
        candidates, situations = [], [s for s in self.situations if s not in without]
        for angle in self.detours:
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            for s in situations:
                desired = s.goal.desired_velocity(s.state.position, s.state.velocity, s.now, s.limits)
                aim = Aim(s.response.velocity(s.state, s.response.settled(s.horizon)), turn @ desired)
                candidates.append(self._candidate(s, (aim,)))
        return candidates

    def _candidate(self, s: Situation, aims: tuple[Aim, ...]) -> Candidate:
        """Candidate of one response for the given aims."""
        preferred = preferred_control(aims)
        manoeuvre = Manoeuvre(s.response, s.state, s.admissible.toward(preferred), s.now)
        return Candidate(self.objective.cost(manoeuvre, s, self.settled_time(manoeuvre)), manoeuvre, preferred, s)

    def propose(self, s: Situation, preferred: Array, margin: float | Array) -> Proposal | None:
        """Exact choice for one response at `margin` [m] (scalar or (n,)); None without a safe control."""
        blocked = ControlObstacle(s.response, s.state, self.table, self.robot, margin)
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
        """Cost [s] of the objective; with `detours`, plus the time for detours around obstacles at the horizon."""
        cost = self.objective.cost(motion, s, until)
        if self.detours and self.table.obstacles:
            lengths = detour_lengths(motion.position(until), s.goal.position(until), *self._end_positions)
            cost += float(lengths.sum()) / s.limits.max_speed
        return cost

    @cached_property
    def _end_positions(self) -> tuple[Array, Array]:
        """Positions (n, d) [m] of the obstacles at the horizon, and radii (n,) [m] that the robot must keep from them.

        Obstacles with several parts, such as walls, are left out: a disc does not represent them.
        """
        end = self.table.start + self.table.horizon
        present = [o for o in self.table.obstacles if o.exists(end) and len(o.shape.parts) == 1]
        positions = np.array([o.trajectory.position(end) for o in present])
        radii = np.array([o.shape.bounding_radius for o in present]) + self.robot.bounding_radius + self.margin
        return positions.reshape(-1, self.situations[0].state.dimension), radii

    def settled_time(self, manoeuvre: Manoeuvre) -> float:
        """Absolute time [s] at which the control of `manoeuvre` has settled."""
        return manoeuvre.settled_time(self.period, self.situations[0].horizon)


def detour_lengths(position: Array, goal: Array, centers: Array, radii: Array) -> Array:
    """Extra lengths (n,) [m] of the shortest paths from `position` to `goal` (2,) around each disc.

    The discs have centres (n, 2) [m] and radii (n,) [m]. Each path consists of two tangents and an arc; the extra
    length is 0 for a disc that does not block the straight line. A position or goal inside a disc counts as on its
    boundary.
    """
    centers = np.ascontiguousarray(centers, dtype=np.float64)
    return kernels.detour_lengths(np.asarray(position), np.asarray(goal), centers, np.asarray(radii))
