"""The tables from which one robot decides."""

from typing import TYPE_CHECKING

import numpy as np

from slalom.checks import Array, vector
from slalom.decision_tables import Skeletons, response_table
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.kernels.decision.tables import DecisionSettings, DecisionTables, ResponseTable
from slalom.methods import margin_among
from slalom.objective import FollowAcceleration, FollowVelocity, KeepAcceleration, Objective
from slalom.obstacle_window import ObstacleWindow
from slalom.response import Response
from slalom.robot_tables import bounds_of, robot_table, target_paths, tracked_robots
from slalom.shape import round_shape
from slalom.state import State
from slalom.tolerances import AIM_LATEST
from slalom.tracks import Tracks

if TYPE_CHECKING:
    from slalom.navigator import Navigator

ARRIVE, FOLLOW_VELOCITY, FOLLOW_ACCELERATION = 0, 1, 2
"""The objectives of the compiled policy by number."""


def tables_of(
    robot: "Navigator",
    responses: tuple[Response, ...],
    obstacles: ObstacleWindow,
    others: Tracks | None,
    state: State,
    goal: Goal,
    now: float,
    pieces: int,
    budget: float,
) -> DecisionTables:
    """The tables of a decision, with the robot in row 0; its committed path may have so many `pieces`.

    `budget` [s]: see `Navigator.decide`.

    Raises:
        InvalidInput: an acceleration to follow with a response that does not set the acceleration at once.
    """
    d, limits, method = state.dimension, robot.limits, robot.method
    table = response_table((responses,), robot.horizon, 2.0 * robot.horizon, d)
    pieces, margin, shapes = max(pieces, int(np.diff(table.first).max())), robot.margin, [robot.robot]
    if others is None:
        robots = robot_table(1, pieces, 1)
    else:
        robots = tracked_robots(others, pieces, now + robot.horizon)
        margin = margin_among(method, margin, limits.max_acceleration, robot.period)
        shapes.append(round_shape(0.0, d))
    robots.position[0, :d], robots.velocity[0, :d] = state.position, state.velocity
    robots.acceleration[0, :d] = state.acceleration
    robots.objective[0], robots.wanted[0, :d] = _wanted(robot.objective, table, state)
    skeletons = Skeletons(shapes)
    robots.skeleton[1:] = skeletons.kind[-1]
    robots.margin[0] = margin
    robots.rounding[0], robots.radius[0] = skeletons.rounding[0], robot.robot.bounding_radius
    robots.max_speed[0], robots.max_acceleration[0] = limits.max_speed, limits.max_acceleration
    robots.braking[0], robots.tolerance[0], robots.stop[0] = limits.braking, goal.tolerance, goal.stop
    robots.target[0, :d], robots.final[0] = goal.position(now), True
    distance = float(np.linalg.norm(robots.target[0, :d] - state.position))
    latest = AIM_LATEST * (distance / limits.max_speed + limits.max_speed / limits.max_acceleration)
    targets, robots.moving[:] = target_paths([goal], now, now + robot.horizon + latest)
    settings = DecisionSettings(
        dimension=d,
        now=now,
        period=robot.period,
        horizon=robot.horizon,
        regain=np.inf if method.regain is None or others is None else method.regain,
        patience=robot.patience,
        share=1.0 if others is None else method.share,
        least_share=1.0 if others is None else method.share,
        agrees=method.agrees and others is not None,
        shared=False,
        detours=np.array(robot.detours),
        budget=1e6 * budget,
    )
    bodies = skeletons.grown_bodies(0, obstacles, detours=bool(robot.detours))
    return DecisionTables(robots, bodies, table, bounds_of([limits], [state]), targets, settings)


def _wanted(objective: Objective, table: ResponseTable, state: State) -> tuple[int, Array]:
    """The number of the objective, and the velocity or acceleration (d,) to follow."""
    if isinstance(objective, FollowVelocity):
        return FOLLOW_VELOCITY, vector(objective.velocity, "velocity to follow", state.dimension)
    if isinstance(objective, (FollowAcceleration, KeepAcceleration)):
        if not table.initial_acceleration[:, 2].all():
            raise InvalidInput(
                f"objective: expected one for responses that set no acceleration at once, found {objective!r}"
            )
        if isinstance(objective, KeepAcceleration):
            return FOLLOW_ACCELERATION, state.acceleration
        return FOLLOW_ACCELERATION, vector(objective.acceleration, "acceleration to follow", state.dimension)
    return ARRIVE, np.zeros(state.dimension)
