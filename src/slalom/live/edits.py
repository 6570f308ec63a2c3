"""Changes of a scenario by hand: each returns another scenario."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, number, positive, vector, whole
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.live.others import has_left, state_at
from slalom.obstacle import Obstacle
from slalom.obstacle.periodic import moved
from slalom.shape import round_shape
from slalom.sim.measure.run_log import Step
from slalom.sim.scenario import Robot, Scenario
from slalom.state import State
from slalom.trajectory import (
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    PiecewisePolynomial,
    Sampled,
    Stationary,
    Trajectory,
)

HANDLES = ("robot", "robot_velocity", "goal", "obstacle", "obstacle_velocity")


def from_step(scenario: Scenario, steps: Sequence[Step], k: int) -> Scenario:
    """Return the scenario that begins with the states of step k of a run; robots that have left are left out."""
    if k == 0 or not steps:
        return scenario
    now = scenario.start + scenario.dt * k
    kept = [j for j in range(len(scenario.robots)) if not has_left(scenario, steps, k, j)]
    robots = tuple(replace(scenario.robots[j], state=state_at(steps, k, j)) for j in kept)
    duration = max(scenario.dt, scenario.start + scenario.duration - now)
    return replace(scenario, robots=robots, start=now, duration=duration)


def dragged(scenario: Scenario, what: str, index: int, to: npt.ArrayLike) -> Scenario:
    """Return the scenario with a handle moved to a position (d,) [m].

    A velocity handle is where the robot or obstacle would be after one second. An obstacle whose velocity is set moves
    straight from then on.

    Raises:
        InvalidInput: an unknown handle, no such robot or obstacle, a position that is not d numbers.
    """
    target = vector(to, "to", scenario.dimension)
    if what not in HANDLES:
        raise InvalidInput(f"what: expected one of {', '.join(HANDLES)}; found {what!r}")
    listed: Sequence[Any] = scenario.obstacles if what.startswith("obstacle") else scenario.robots
    if whole(index, "index") >= len(listed):
        raise InvalidInput(f"index: expected a number below {len(listed)}, found {index}")
    if what.startswith("obstacle"):
        obstacles = list(scenario.obstacles)
        obstacles[index] = _obstacle(obstacles[index], what, target, scenario.start)
        return replace(scenario, obstacles=tuple(obstacles))
    robots = list(scenario.robots)
    robots[index] = _robot(robots[index], what, target)
    return replace(scenario, robots=tuple(robots))


def _robot(robot: Robot, what: str, target: Array) -> Robot:
    state, goal = robot.state, robot.goal
    if what == "goal":
        return replace(robot, goal=Goal(Stationary(target), goal.tolerance, goal.stop))
    if what == "robot":
        return replace(robot, state=State(target, state.velocity))
    velocity = target - state.position
    size = float(np.linalg.norm(velocity))
    largest = robot.limits.max_speed
    return replace(robot, state=State(state.position, velocity * min(1.0, largest / max(size, largest))))


def _obstacle(obstacle: Obstacle, what: str, target: Array, now: float) -> Obstacle:
    if not obstacle.exists(now):
        raise InvalidInput(f"obstacle {obstacle.name!r}: expected one that exists at {now:g} s, found none then")
    here = obstacle.trajectory.position(now)
    if what == "obstacle":
        return replace(obstacle, trajectory=displaced_by(obstacle.trajectory, target - here))
    velocity = target - here
    if obstacle.turns and isinstance(obstacle.heading, str) and not np.any(velocity):
        x, y = obstacle.direction(now)
        return replace(obstacle, trajectory=Stationary(here), heading=float(np.arctan2(y, x)))
    return replace(obstacle, trajectory=ConstantVelocity(here, velocity, now))


def displaced_by(trajectory: Trajectory, by: Array) -> Trajectory:
    """Return a trajectory displaced `by` (d,) [m], of the same kind where the kind is one of files."""
    places = {
        Stationary: "initial_position",
        ConstantVelocity: "initial_position",
        ConstantAcceleration: "initial_position",
        Circular: "center",
        Sampled: "positions",
    }
    for kind, name in places.items():
        if type(trajectory) is kind:
            found: Trajectory = replace(trajectory, **{name: getattr(trajectory, name) + by})  # type: ignore[type-var]  # a dataclass
            return found
    if isinstance(trajectory, PiecewisePolynomial):
        coefficients = trajectory.coefficients.copy()
        coefficients[:, 0] += by
        return PiecewisePolynomial(trajectory.durations, coefficients, trajectory.start)
    return moved(trajectory, by)


def with_obstacle(scenario: Scenario, to: npt.ArrayLike, radius: float) -> Scenario:
    """Return the scenario with one more disc or ball at rest at a position (d,) [m]."""
    place = vector(to, "to", scenario.dimension)
    shape = round_shape(positive(radius, "radius"), scenario.dimension)
    obstacle = Obstacle(shape, Stationary(place), f"obstacle {len(scenario.obstacles)}")
    return replace(scenario, obstacles=(*scenario.obstacles, obstacle))


def without_obstacle(scenario: Scenario, index: int) -> Scenario:
    """Return the scenario without one obstacle. Raises InvalidInput if there is no such obstacle."""
    if whole(index, "index") >= len(scenario.obstacles):
        raise InvalidInput(f"index: expected a number below {len(scenario.obstacles)}, found {index}")
    return replace(scenario, obstacles=scenario.obstacles[:index] + scenario.obstacles[index + 1 :])


def with_setting(scenario: Scenario, name: str, value: float) -> Scenario:
    """Return the scenario with another horizon, margin or patience. Raises InvalidInput for another name."""
    if name not in ("horizon", "margin", "patience"):
        raise InvalidInput(f"name: expected one of horizon, margin, patience; found {name!r}")
    return scenario.with_settings({name: number(value, name)})
