"""CommonRoad: planning problems solved by a point mass among recorded traffic, and their solution files.

`solve` needs commonroad-io. The car is a rectangle with the orientation of the goal, rounded by `margin`. A point mass
turns with its velocity, so its orientation may differ by as much as the margin covers. Borders of the road are walls.
Recorded vehicles are rectangles that turn with their motion, and their future is known (`nao`). The target moves on the
cubic that leaves the initial state and meets the goal at the middle of its time, with its speed and orientation.
"""

from dataclasses import dataclass
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from slalom.checks import Array
from slalom.decision.navigator import Navigator
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import Limits
from slalom.methods import method
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.shape import Disc, Polygon, Polyline, Rectangle, Shape
from slalom.state import State
from slalom.trajectory import Sampled, Stationary

LENGTH, WIDTH = 4.508, 1.610
"""[m] of vehicle type 2 of CommonRoad, a BMW 320i (Althoff, Koschi and Manzinger, IV 2017)."""
GAP = 0.05
"""[m] Lanelets nearer than twice this are one road. Smaller: walls between neighbours remain. Larger: gaps close."""
TARGET_STEPS = 100
"""Samples of the motion of the target. Fewer: its velocity is less exact."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of the car: time steps (n,) of the scenario, positions (n, 2) [m] and velocities (n, 2) [m/s].

    `reached`: the last state is in the goal. `safe`: all decisions were.
    """

    steps: Array
    positions: Array
    velocities: Array
    reached: bool
    safe: bool


def solve(scenario: Any, problem: Any, max_acceleration: float = 8.0, margin: float = 0.3) -> Motion:
    """Motion of a car from the initial state of a planning problem to its goal, decided by `nao` at each time step.

    Raises:
        InvalidInput: a goal without a position; obstacles that are neither rectangles, discs nor polygons; a largest
            acceleration [m/s^2] or a margin [m] that no navigator accepts.
    """
    dt, start = float(scenario.dt), problem.initial_state
    first, last = int(start.time_step), int(problem.goal.state_list[0].time_step.end)
    target, angle = _target(problem, dt)
    robot = Navigator(
        method("nao"), _rectangle(LENGTH, WIDTH, angle), Limits(50.0, max_acceleration), period=dt, margin=margin
    )
    around = [ObstacleTable(_walls(scenario)), ObstacleTable([*_at_rest(scenario), *_moving(scenario, dt)])]
    direction = np.array([cos(start.orientation), sin(start.orientation)])
    state, previous, safe, reached = State(start.position, start.velocity * direction), None, True, False
    states, k = [state], first
    while k < last and not reached:
        previous = robot.decide(state, around, target, now=k * dt, previous=previous)
        a = previous.manoeuvre.mean_acceleration(k * dt, dt)
        state = State(state.position + dt * state.velocity + 0.5 * dt * dt * a, state.velocity + dt * a, a)
        states.append(state)
        k, safe = k + 1, safe and previous.safe
        reached = in_goal(problem, state.position, state.velocity, k)
    positions, velocities = (np.array([getattr(s, name) for s in states]) for name in ("position", "velocity"))
    return Motion(np.arange(first, k + 1, dtype=np.float64), positions, velocities, reached, safe)


def solution(scenario: Any, problem: Any, motion: Motion) -> Any:
    """Solution of commonroad-io with the point-mass model (PM), for `CommonRoadSolutionWriter` and the checker."""
    from commonroad.common import solution as kinds
    from commonroad.scenario.trajectory import Trajectory

    states = [_pm_state(p, v, int(k)) for k, p, v in zip(motion.steps, motion.positions, motion.velocities)]
    one = kinds.PlanningProblemSolution(
        planning_problem_id=problem.planning_problem_id,
        vehicle_type=kinds.VehicleType.BMW_320i,
        vehicle_model=kinds.VehicleModel.PM,
        cost_function=kinds.CostFunction.WX1,
        trajectory=Trajectory(int(motion.steps[0]), states),
    )
    return kinds.Solution(scenario.scenario_id, [one])


def in_goal(problem: Any, position: Array, velocity: Array, step: int) -> bool:
    """Whether a position (2,) [m] and a velocity (2,) [m/s] at a time step are in the goal.

    With states of the point mass commonroad-io 2024.3 takes the speed for the first component of the velocity when it
    derives the orientation. States that have an orientation of their own are judged by the format.
    """
    from commonroad.scenario.state import KSState

    speed, angle = float(np.hypot(*velocity)), float(np.arctan2(velocity[1], velocity[0]))
    state = KSState(step, position=position, velocity=speed, orientation=angle, steering_angle=0.0)
    return bool(problem.goal.is_reached(state))


def write(made: Any, folder: Path, name: str) -> Path:
    """Write a solution into `folder`, and return its file."""
    from commonroad.common.solution import CommonRoadSolutionWriter

    CommonRoadSolutionWriter(made).write_to_file(str(folder), name, overwrite=True)
    return folder / name


def _pm_state(position: Array, velocity: Array, step: int) -> Any:
    from commonroad.scenario.state import PMState

    return PMState(step, position=position, velocity=float(velocity[0]), velocity_y=float(velocity[1]))


def _target(problem: Any, dt: float) -> tuple[Goal, float]:
    """The goal in motion, and the orientation [rad] there."""
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
    return Goal(Sampled(times, np.concatenate([points, place + after[:, None] * v1])), 0.1, stop=True), float(angle)


def _walls(scenario: Any) -> list[Obstacle]:
    lanes = [lanelet.polygon.shapely_object.buffer(GAP) for lanelet in scenario.lanelet_network.lanelets]
    road = shapely.union_all(lanes).buffer(-GAP)
    rings = [r for part in shapely.get_parts(road) for r in (part.exterior, *part.interiors)]
    return [Obstacle(Polyline(ring.coords), Stationary((0, 0)), "border") for ring in rings]


def _at_rest(scenario: Any) -> list[Obstacle]:
    found = [(o, o.initial_state) for o in scenario.static_obstacles]
    return [Obstacle(_shape(o), Stationary(s.position), str(o.obstacle_id), heading=s.orientation) for o, s in found]


def _moving(scenario: Any, dt: float) -> list[Obstacle]:
    found = []
    for o in scenario.dynamic_obstacles:
        states = [o.initial_state, *o.prediction.trajectory.state_list]
        times, places = [dt * s.time_step for s in states], [s.position for s in states]
        path = Sampled(times, places)
        found.append(Obstacle(_shape(o), path, str(o.obstacle_id), heading="motion", after_end="leaves"))
    return found


def _shape(obstacle: Any) -> Shape:
    shape, kind = obstacle.obstacle_shape, type(obstacle.obstacle_shape).__name__
    if kind == "Rectangle":
        return Rectangle(shape.length, shape.width)
    if kind == "Circle":
        return Disc(shape.radius)
    if kind == "Polygon":
        return Polygon(shape.shapely_object.exterior.coords[:-1])
    raise InvalidInput(f"obstacle {obstacle.obstacle_id}: expected a rectangle, disc or polygon, found {kind}")


def _rectangle(length: float, width: float, angle: float) -> Polygon:
    x, y = 0.5 * length, 0.5 * width
    c, s = cos(angle), sin(angle)
    return Polygon(np.array([(-x, -y), (x, -y), (x, y), (-x, y)]) @ np.array([[c, s], [-s, c]]))
