"""Checks of the settings of a navigator, and of the input of each decision."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from slalom.checks import (
    GOAL,
    LIMITS,
    METHOD,
    OBJECTIVE,
    SHAPE,
    duration,
    has,
    listing,
    not_negative,
    number,
    positive,
)
from slalom.errors import InvalidInput
from slalom.goal import Goal, refuse_stop
from slalom.limits import Limits
from slalom.objective import Objective, needs_goal
from slalom.obstacle.table import same_dimension
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import ObstacleWindow
from slalom.shape import Shape
from slalom.state import State
from slalom.trajectory import Stationary

if TYPE_CHECKING:
    from slalom.decision.navigator import Navigator


def check_settings(robot: "Navigator") -> None:
    """Raise InvalidInput for settings of wrong kinds or out of range."""
    has(robot.method, *METHOD, "method")
    has(robot.robot, *SHAPE, "robot")
    within_horizon(duration(robot.period, "period"), duration(robot.horizon, "horizon"))
    not_negative(robot.margin, "margin")
    not_negative(robot.patience, "patience")
    positive(robot.stuck_after, "stuck_after")
    has(robot.limits, *LIMITS, "limits")
    has(robot.objective, *OBJECTIVE, "objective")
    has(robot.risk, ("loss", "likely"), "a Risk", "risk")
    if robot.horizons is not None:
        has(robot.horizons, ("__call__",), "a rule for horizons, such as SafeTime(), or None", "horizons")
    checked_holds(robot.holds)
    checked_detours(robot.detours)


def within_horizon(period: float, horizon: float) -> None:
    """Raise InvalidInput for a period [s] of decisions above the horizon [s]: a robot may collide between them."""
    if period > horizon:
        raise InvalidInput(f"period: expected at most the horizon, {horizon:g} s, found {period:g} s")


def checked_holds(holds: Sequence[float]) -> tuple[float, ...]:
    """The durations [s] for which accelerations are held. Raises InvalidInput for something else, and for none."""
    listing(holds, "durations", "holds")
    if not len(holds):
        raise InvalidInput("holds: expected at least one, found none")
    return tuple(duration(hold, f"holds[{k}]") for k, hold in enumerate(holds))


def checked_detours(detours: Sequence[float]) -> tuple[float, ...]:
    """The angles [rad] of detours. Raises InvalidInput for something else."""
    listing(detours, "angles", "detours")
    return tuple(number(angle, f"detours[{k}]") for k, angle in enumerate(detours))


def goal_or_place(goal: Goal | None, state: State, objective: Objective, limits: Limits) -> Goal:
    """The goal; the position of the robot for an objective that needs none.

    Raises:
        InvalidInput: no goal for an objective that needs one, or one to stop at for a robot that never stops; a goal of
            another dimension than the state.
    """
    if goal is None:
        if needs_goal(objective):
            raise InvalidInput(f"goal: expected one for the objective {objective!r}, found none")
        return Goal(Stationary(state.position))
    has(goal, *GOAL, "goal")
    same_dimension(goal.trajectory.dimension, state.dimension, "goal", "state")
    if needs_goal(objective):
        refuse_stop(goal, limits)
    return goal


def check_dimensions(robot: Shape, state: State, obstacles: ObstacleWindow, others: Tracks | None) -> None:
    """Raise InvalidInput for parts of another dimension than the state; for robots observed after the decision."""
    d = state.dimension
    same_dimension(robot.dimension, d, "robot", "state")
    same_dimension(obstacles.dimension, d, "obstacles", "state")
    if others is not None:
        same_dimension(others.dimension, d, "robots", "state")
        others.refuse_later(obstacles.start, "robots")
