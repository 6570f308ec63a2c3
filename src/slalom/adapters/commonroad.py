"""CommonRoad: planning problems solved among recorded traffic, and their solution files.

`solve` needs commonroad-io. The car moves as a point mass, or by the kinematic single-track model. Borders of the road
are walls. Recorded vehicles are rectangles with their recorded orientation, and their future is known (`nao`). The
target moves on the cubic that leaves the initial state and meets the goal at the middle of its time, with its speed and
orientation.
"""

from dataclasses import dataclass
from math import cos, sin
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely

from slalom.base.checks import Array, known
from slalom.base.errors import InvalidInput
from slalom.decision.methods import method
from slalom.decision.navigator import Navigator
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Disc, Polygon, Polyline, Rectangle, Shape
from slalom.model.state import State
from slalom.model.trajectory import Sampled, Stationary
from slalom.obstacle import Headings, Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.vehicle import Bicycle, Pose, VehicleNavigator

__all__ = ["MODELS", "Motion", "in_goal", "solution", "solve", "write"]

# ---------------------------------------------------------------------------------------------------------------------
# What a car meets in a scenario: borders of the road, static obstacles, recorded vehicles.


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


# ---------------------------------------------------------------------------------------------------------------------
# A car that moves as a point mass (PM): a rectangle that keeps the orientation of the goal, rounded by the margin.
#
# A point mass turns with its velocity, so its orientation may differ by as much as the margin covers.


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


# ---------------------------------------------------------------------------------------------------------------------
# A car that moves by the kinematic single-track model (KS), decided for by `VehicleNavigator`.
#
# The model of the checker has its position in the middle of the body and turns about it as a bicycle about its rear
# axle. The car follows the path of the target. Its speed brings it to where the target is in LOOKAHEAD seconds.


WHEELBASE = 2.5789
STEERING = 1.066
STEERING_RATE = 0.4
"""[m], [rad], [rad/s] of vehicle type 2."""
POWER = 11.5 * 7.319
"""[m^2/s^3] Largest acceleration times speed of vehicle type 2 above 7.319 m/s."""
LOOKAHEAD = 1.0
"""[s] in which the car is to be where the target is. Longer: it reacts more evenly to its delay."""
AHEAD = 2.0
"""[s] of driving to the point of the path that the car heads for. Shorter: it turns aside later."""
SPEED_RESERVE, SLOWEST = 1.25, 0.1
"""Largest speed of the car in units of the target's largest one; [m/s] least speed along a path."""


def drive_single_track(scenario: Any, problem: Any, max_acceleration: float, margin: float) -> Motion:
    """Motion of the single-track model, see `solve`."""
    dt, start = float(scenario.dt), problem.initial_state
    first, last = int(start.time_step), int(problem.goal.state_list[0].time_step.end)
    path, _ = target(problem, dt)
    times = np.arange(*path.span, dt)
    points, speeds = path.position(times), np.linalg.norm(path.velocity(times), axis=1)
    fastest = SPEED_RESERVE * max(float(speeds.max()), float(start.velocity))
    car = Bicycle(WHEELBASE, STEERING, STEERING_RATE, fastest, min(max_acceleration, POWER / fastest), period=dt)
    robot = VehicleNavigator(car, method("nao"), Rectangle(LENGTH, WIDTH), margin=margin)
    around, pose = surroundings(scenario), Pose(start.position, float(start.orientation), float(start.velocity))
    poses = [pose]
    previous = None
    safe = True
    reached = False
    k = first
    while k < last and not reached:
        goal = _along(points, path.position(min(k * dt + LOOKAHEAD, path.span[1])), pose)
        previous = robot.decide(pose, around, goal, now=k * dt, previous=previous)
        pose = car.drive(pose, previous.command)
        poses.append(pose)
        k, safe = k + 1, safe and previous.safe
        reached = in_goal(problem, pose.position, pose.velocity, k, pose.heading)
    return Motion(
        np.arange(first, k + 1, dtype=np.float64),
        np.array([each.position for each in poses]),
        np.array([each.velocity for each in poses]),
        np.array([each.heading for each in poses]),
        np.array([each.turn for each in poses]),
        reached,
        safe,
        "KS",
    )


def _along(points: Array, ahead: Array, pose: Pose) -> PathGoal:
    """The path (n, 2) [m] at the speed with which the car is where the target is after LOOKAHEAD: `ahead` (2,) [m]."""
    path = PathGoal(points, stop=False)
    way = path.nearest(ahead, 0.0, path.length) - path.nearest(pose.position, 0.0, path.length)
    return PathGoal(points, max(way / LOOKAHEAD, SLOWEST), stop=False, lookahead=AHEAD)


# ---------------------------------------------------------------------------------------------------------------------
# Solution files of CommonRoad, written by commonroad-io.


def solution(scenario: Any, problem: Any, motion: Motion) -> Any:
    """Solution of commonroad-io with the model of the motion, for `CommonRoadSolutionWriter` and the checker."""
    from commonroad.common import solution as kinds
    from commonroad.scenario.trajectory import Trajectory

    one = kinds.PlanningProblemSolution(
        planning_problem_id=problem.planning_problem_id,
        vehicle_type=kinds.VehicleType.BMW_320i,
        vehicle_model=kinds.VehicleModel[motion.model],
        cost_function=kinds.CostFunction.WX1,
        trajectory=Trajectory(int(motion.steps[0]), STATES[motion.model](motion)),
    )
    return kinds.Solution(scenario.scenario_id, [one])


def write(made: Any, folder: Path, name: str) -> Path:
    """Write a solution into `folder`, and return its file."""
    from commonroad.common.solution import CommonRoadSolutionWriter

    CommonRoadSolutionWriter(made).write_to_file(str(folder), name, overwrite=True)
    return folder / name


def _pm_states(motion: Motion) -> list[Any]:
    from commonroad.scenario.state import PMState

    rows = zip(motion.steps.tolist(), motion.positions, motion.velocities.tolist())
    return [PMState(int(k), position=p, velocity=v[0], velocity_y=v[1]) for k, p, v in rows]


def _ks_states(motion: Motion) -> list[Any]:
    from commonroad.scenario.state import KSState

    speeds = (motion.velocities**2).sum(axis=1) ** 0.5
    rows = zip(motion.steps.tolist(), motion.positions, speeds.tolist(), motion.headings, motion.steering)
    return [
        KSState(int(k), position=p, velocity=v, orientation=float(a), steering_angle=float(d)) for k, p, v, a, d in rows
    ]


STATES = {"PM": _pm_states, "KS": _ks_states}
"""States of a motion by the name of its model."""


MODELS: Final = {"PM": drive_point_mass, "KS": drive_single_track}
"""Models of the car by their names in CommonRoad."""


def solve(
    scenario: Any, problem: Any, model: str = "PM", *, max_acceleration: float = 8.0, margin: float = 0.3
) -> Motion:
    """Motion of a car from the initial state of a planning problem to its goal, decided by `nao` at each time step.

    Raises:
        InvalidInput: a goal without a position; obstacles that are neither rectangles, discs nor polygons; a model that
            is not in MODELS; a largest acceleration [m/s^2] or a margin [m] that no navigator accepts.
    """
    return MODELS[known(model, "model", tuple(MODELS))](scenario, problem, max_acceleration, margin)
