"""What a car meets in a scenario of CommonRoad: borders of the road, static obstacles, recorded vehicles."""

from dataclasses import dataclass
from math import cos, sin
from typing import Any

import numpy as np
import shapely

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.model.shape import Disc, Polygon, Polyline, Rectangle, Shape
from slalom.model.trajectory import Sampled, Stationary
from slalom.obstacle import Headings, Obstacle
from slalom.obstacle.table import ObstacleTable

GAP = 0.05
"""[m] Lanelets nearer than twice this are one road. Smaller: walls between neighbours remain. Larger: gaps close."""


def surroundings(scenario: Any) -> list[ObstacleTable]:
    """Tables of the walls, and of all obstacles on their recorded trajectories.

    Raises:
        InvalidInput: obstacles that are neither rectangles, discs nor polygons.
    """
    return [ObstacleTable(_walls(scenario)), ObstacleTable([*_at_rest(scenario), *_moving(scenario)])]


def _walls(scenario: Any) -> list[Obstacle]:
    lanes = [lanelet.polygon.shapely_object.buffer(GAP) for lanelet in scenario.lanelet_network.lanelets]
    road = shapely.union_all(lanes).buffer(-GAP)
    rings = [r for part in shapely.get_parts(road) for r in (part.exterior, *part.interiors)]
    return [Obstacle(Polyline(ring.coords), Stationary((0, 0)), "border") for ring in rings]


def _at_rest(scenario: Any) -> list[Obstacle]:
    found = [(o, o.initial_state) for o in scenario.static_obstacles]
    return [Obstacle(_shape(o), Stationary(s.position), str(o.obstacle_id), heading=s.orientation) for o, s in found]


def _moving(scenario: Any) -> list[Obstacle]:
    found, dt = list[Obstacle](), float(scenario.dt)
    for o in scenario.dynamic_obstacles:
        states = [o.initial_state, *o.prediction.trajectory.state_list]
        times, places = [dt * s.time_step for s in states], [s.position for s in states]
        path = Sampled(times, places)
        heading = Headings(times, [s.orientation for s in states])
        found.append(Obstacle(_shape(o), path, str(o.obstacle_id), heading, after_end="leaves"))
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


# ---------------------------------------------------------------------------------------------------------------------
# The target of a planning problem: it moves from the initial state to the middle of the goal.


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


# ---------------------------------------------------------------------------------------------------------------------
# Motion of a car that solves a planning problem, and the size of the car.


LENGTH, WIDTH = 4.508, 1.610
"""[m] of vehicle type 2 of CommonRoad, a BMW 320i (Althoff, Koschi and Manzinger, IV 2017)."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of the car: time steps (n,) of the scenario, positions (n, 2) [m] and velocities (n, 2) [m/s].

    `headings` and `steering` (n,) [rad] are its orientation and steering angle; those of a point mass are the direction
    of its velocity and 0. `reached`: the last state is in the goal. `safe`: all decisions were. `model`: a name of
    `MODELS`.
    """

    steps: Array
    positions: Array
    velocities: Array
    headings: Array
    steering: Array
    reached: bool
    safe: bool
    model: str
