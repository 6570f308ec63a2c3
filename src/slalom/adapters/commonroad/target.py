"""The target of a planning problem: it moves from the initial state to the middle of the goal."""

from math import cos, sin
from typing import Any

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.trajectory import Sampled

TARGET_STEPS = 100
"""Samples of the motion of the target. Fewer: its velocity is less exact."""


def target(problem: Any, dt: float) -> tuple[Sampled, float]:
    """Motion of the target in steps of `dt` [s], and the orientation [rad] of the goal.

    Raises:
        InvalidInput: a goal without a position.
    """
    start, goal = problem.initial_state, problem.goal.state_list[0]
    if not goal.has_value("position"):
        raise InvalidInput(
            f"planning problem {problem.planning_problem_id}: expected a goal with a position, found none"
        )
    place = np.asarray(goal.position.shapely_object.centroid.coords[0])
    t0, t1 = dt * start.time_step, 0.5 * dt * (goal.time_step.start + goal.time_step.end)
    angle = start.orientation
    if goal.has_value("orientation"):
        angle = 0.5 * (goal.orientation.start + goal.orientation.end)
    mean = float(np.linalg.norm(place - start.position)) / (t1 - t0)
    speed = 0.5 * (goal.velocity.start + goal.velocity.end) if goal.has_value("velocity") else mean
    v0 = start.velocity * np.array([cos(start.orientation), sin(start.orientation)])
    v1 = speed * np.array([cos(angle), sin(angle)])
    s, length = np.linspace(0.0, 1.0, TARGET_STEPS)[:, None], t1 - t0
    # Cubic through both positions with both velocities.
    points = (
        (2 * s**3 - 3 * s**2 + 1) * start.position
        + (s**3 - 2 * s**2 + s) * length * v0
        + (3 * s**2 - 2 * s**3) * place
        + (s**3 - s**2) * length * v1
    )
    after = np.array([0.5, 1.0, 2.0, 4.0])
    times = np.concatenate([t0 + length * s[:, 0], t1 + after])
    return Sampled(times, np.concatenate([points, place + after[:, None] * v1])), float(angle)


def in_goal(problem: Any, position: Array, velocity: Array, step: int, heading: float | None = None) -> bool:
    """Whether a position (2,) [m] and a velocity (2,) [m/s] at a time step are in the goal.

    `heading` [rad] is the orientation; None: that of the velocity. With states of the point mass commonroad-io 2024.3
    takes the speed for the first component of the velocity when it derives the orientation. States that have an
    orientation of their own are judged as the format defines.
    """
    from commonroad.scenario.state import KSState

    speed = float(np.hypot(*velocity))
    angle = float(np.arctan2(velocity[1], velocity[0])) if heading is None else heading
    state = KSState(step, position=position, velocity=speed, orientation=angle, steering_angle=0.0)
    return bool(problem.goal.is_reached(state))
