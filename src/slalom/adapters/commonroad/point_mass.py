"""A car that moves as a point mass (PM): a rectangle that keeps the orientation of the goal, rounded by the margin.

A point mass turns with its velocity, so its orientation may differ by as much as the margin covers.
"""

from math import cos, sin
from typing import Any

import numpy as np

from slalom.adapters.commonroad.scene import LENGTH, WIDTH, Motion, in_goal, surroundings, target
from slalom.decision.methods import method
from slalom.decision.navigator import Navigator
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.shape import Polygon
from slalom.model.state import State

MAX_SPEED = 50.0
"""[m/s] of a car, as CommonRoad bounds it."""


def drive_point_mass(scenario: Any, problem: Any, max_acceleration: float, margin: float) -> Motion:
    """Motion of the point mass, see `solve`."""
    dt, start = float(scenario.dt), problem.initial_state
    first, last = int(start.time_step), int(problem.goal.state_list[0].time_step.end)
    path, angle = target(problem, dt)
    limits, goal = Limits(MAX_SPEED, max_acceleration), Goal(path, 0.1, stop=True)
    robot = Navigator(method("nao"), _rectangle(angle), limits, period=dt, margin=margin)
    around, direction = surroundings(scenario), np.array([cos(start.orientation), sin(start.orientation)])
    state = State(start.position, start.velocity * direction)
    previous = None
    safe = True
    reached = False
    states, k = [state], first
    while k < last and not reached:
        previous = robot.decide(state, around, goal, now=k * dt, previous=previous)
        a = previous.manoeuvre.mean_acceleration(k * dt, dt)
        state = State(state.position + dt * state.velocity + 0.5 * dt * dt * a, state.velocity + dt * a, a)
        states.append(state)
        k, safe = k + 1, safe and previous.safe
        reached = in_goal(problem, state.position, state.velocity, k)
    positions, velocities = (np.array([getattr(s, name) for s in states]) for name in ("position", "velocity"))
    headings = np.arctan2(velocities[:, 1], velocities[:, 0])
    steps = np.arange(first, k + 1, dtype=np.float64)
    return Motion(steps, positions, velocities, headings, np.zeros(len(steps)), reached, safe, "PM")


def _rectangle(angle: float) -> Polygon:
    x, y = 0.5 * LENGTH, 0.5 * WIDTH
    c, s = cos(angle), sin(angle)
    return Polygon(np.array([(-x, -y), (x, -y), (x, y), (-x, y)]) @ np.array([[c, s], [-s, c]]))
