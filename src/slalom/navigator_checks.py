"""Checks of the settings of a navigator, and of what it is given at each decision."""

from typing import TYPE_CHECKING

from slalom.checks import has, listing, not_negative, number, positive
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.objective import FollowAcceleration, FollowVelocity, KeepAcceleration, Objective
from slalom.obstacle_window import ObstacleWindow
from slalom.shape import Shape
from slalom.state import State
from slalom.tracks import Tracks
from slalom.trajectory import Stationary

if TYPE_CHECKING:
    from slalom.navigator import Navigator

FOLLOWING = (FollowVelocity, FollowAcceleration, KeepAcceleration)
"""Objectives that need no goal."""


def check_settings(robot: "Navigator") -> None:
    """Raise InvalidInput for settings of wrong kinds or out of range."""
    has(robot.method, ("responses", "forecast"), "a method, such as method('nao')", "method")
    has(robot.robot, ("parts", "dimension"), "a shape, such as Disc(radius)", "robot")
    positive(robot.period, "period")
    positive(robot.horizon, "horizon")
    not_negative(robot.margin, "margin")
    not_negative(robot.patience, "patience")
    positive(robot.stuck_after, "stuck_after")
    has(robot.limits, ("max_speed", "braking"), "Limits", "limits")
    has(robot.objective, ("aims", "cost"), "an objective, such as Arrive()", "objective")
    if robot.horizons is not None:
        has(robot.horizons, ("__call__",), "a rule for horizons, such as SafeTime(), or None", "horizons")
    listing(robot.holds, "durations", "holds")
    listing(robot.detours, "angles", "detours")
    for k, hold in enumerate(robot.holds):
        positive(hold, f"holds[{k}]")
    for k, angle in enumerate(robot.detours):
        number(angle, f"detours[{k}]")
    if not robot.holds:
        raise InvalidInput("holds: expected at least one, found none")


def goal_or_place(goal: Goal | None, state: State, objective: Objective) -> Goal:
    """The goal; the position of the robot for an objective that needs none.

    Raises:
        InvalidInput: no goal for an objective that needs one; a goal of another dimension than the state.
    """
    if goal is None:
        if not isinstance(objective, FOLLOWING):
            raise InvalidInput(f"goal: expected one for the objective {objective!r}, found none")
        return Goal(Stationary(state.position))
    has(goal, ("trajectory", "tolerance", "stop"), "a Goal", "goal")
    if goal.trajectory.dimension != state.dimension:
        raise InvalidInput(
            f"goal: expected dimension {state.dimension} as of the state, found {goal.trajectory.dimension}"
        )
    return goal


def check_dimensions(robot: Shape, state: State, obstacles: ObstacleWindow, others: Tracks | None) -> None:
    """Raise InvalidInput for parts of another dimension than the state."""
    sizes = {"robot": robot.dimension, "obstacles": obstacles.dimension, "robots": others and others.dimension}
    for what, dimension in sizes.items():
        if dimension not in (None, state.dimension):
            raise InvalidInput(f"{what}: expected dimension {state.dimension} as of the state, found {dimension}")
