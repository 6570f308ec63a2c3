"""CommonRoad: planning problems solved among recorded traffic, and their solution files.

`solve` needs commonroad-io. The car moves as a point mass, or by the kinematic single-track model. Borders of the road
are walls. Recorded vehicles are rectangles with their recorded orientation, and their future is known (`nao`). The
target moves along lanelets from the initial state into the goal, in time.
"""

from dataclasses import dataclass, replace
from heapq import heappop, heappush
from itertools import pairwise
from math import cos, inf, pi, sin
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely
import shapely.ops

from slalom.base.checks import Array, known
from slalom.base.errors import InvalidInput
from slalom.base.writing import replacing
from slalom.decision.methods import method
from slalom.decision.navigator import Navigator
from slalom.kernels.arrays import Flags
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

# What a car meets in a scenario: borders of the road, obstacles at rest, recorded vehicles, regions of uncertain ones.


GAP, SLIT = 0.05, 1e-4
"""[m] Lanelets nearer than twice these are one road for decisions, and for the drivability checker. Smaller: walls
between neighbours remain. Larger: gaps close."""
WIDER = 0.2
"""[1] How much wider recorded vehicles are for the point mass, per metre that they are longer. Larger: freer turns."""
TURNED = 0.005
"""[rad] Error of the orientation of recorded vehicles, 1 cm at their ends. Smaller: tables take 20 times as long."""


def surroundings(scenario: Any, longer: float = 0.0) -> list[ObstacleTable]:
    """Tables of the walls, and of all obstacles on their recorded trajectories, rectangles of them `longer` [m].

    Raises:
        InvalidInput: dynamic obstacles without a prediction.
    """
    walls = [Obstacle(Polyline(line.coords), Stationary((0, 0)), "border") for line in borders(scenario, GAP)]
    return [
        ObstacleTable(walls),
        ObstacleTable([each for o in scenario.obstacles for each in _obstacles(o, scenario, longer)]),
    ]


def borders(scenario: Any, gap: float) -> list[Any]:
    """Lines of the border of the union of all lanelets, open where a lanelet has no predecessor or no successor."""
    network, ends = scenario.lanelet_network.lanelets, list[Any]()
    for lanelet in network:
        for k, others in ((0, lanelet.predecessor), (-1, lanelet.successor)):
            if not others:
                ends.append(shapely.LineString([lanelet.left_vertices[k], lanelet.right_vertices[k]]).buffer(2.0 * gap))
    road = shapely.union_all([lanelet.polygon.shapely_object.buffer(gap) for lanelet in network]).buffer(-gap)
    lines = road.boundary.difference(shapely.union_all(ends))
    return [line for line in shapely.get_parts(lines) if line.length > 0.0]


def _obstacles(obstacle: Any, scenario: Any, longer: float) -> list[Obstacle]:
    """The obstacle on its trajectory; where that is not exact, the regions that it may occupy, step by step."""
    name, dt = str(getattr(obstacle, "obstacle_id", "")), float(scenario.dt)
    role = obstacle.obstacle_role.value
    if role not in ("dynamic", "phantom"):
        return _regions(obstacle.occupancy_at_time(0).shape, name)
    prediction = obstacle.prediction
    if prediction is None:
        raise InvalidInput(f"obstacle {name}: expected a trajectory or occupied regions, found neither")
    trajectory = getattr(prediction, "trajectory", None)
    states = [obstacle.initial_state, *trajectory.state_list] if trajectory else []
    shape = _shape(obstacle.obstacle_shape, longer) if states else None
    if shape is not None and all(isinstance(state.position, np.ndarray) for state in states):
        times = [dt * state.time_step for state in states]
        path = Sampled(times, [state.position for state in states])
        turns = shapely.LineString(np.stack([times, np.unwrap([state.orientation for state in states])], axis=1))
        heading = Headings(*np.array(turns.simplify(TURNED).coords).T)
        return [Obstacle(shape, path, name, heading, after_end="leaves")]
    first = obstacle.initial_state.time_step if role == "dynamic" else prediction.initial_time_step
    steps = range(first, int(getattr(prediction.final_time_step, "end", prediction.final_time_step)) + 1)
    areas = [(k, area(found.shape)) for k in steps if (found := obstacle.occupancy_at_time(k)) is not None]
    return [
        each
        for (k, now), (end, then) in pairwise(areas)
        for each in _regions(now.union(then).convex_hull, name, (dt * k, dt * end))
    ]


def area(shape: Any) -> Any:
    """The polygons of shapely that cover a shape of CommonRoad, also a group of shapes."""
    if hasattr(shape, "shapes"):
        return shapely.union_all([area(each) for each in shape.shapes])
    if hasattr(shape, "radius"):
        # A polygon about the circle, not inside it.
        return shapely.Point(shape.center).buffer(shape.radius / cos(pi / 64), quad_segs=16)
    return shape.shapely_object


def _regions(shape: Any, name: str, span: tuple[float, float] | None = None) -> list[Obstacle]:
    """Obstacles at rest that cover a shape, always or during a span [s]."""
    found = []
    for part in shapely.get_parts(shape if hasattr(shape, "geom_type") else area(shape)):
        middle = np.asarray(part.centroid.coords[0])
        polygon = Polygon(np.asarray(part.exterior.coords)[:-1] - middle)
        path = Stationary(middle) if span is None else Sampled(span, [middle, middle])
        found.append(Obstacle(polygon, path, name, after_end="unknown" if span is None else "leaves"))
    return found


def _shape(shape: Any, longer: float) -> Shape | None:
    """The shape of an obstacle that turns with it; None for a group of shapes."""
    kind = type(shape).__name__
    if kind == "Rectangle":
        corners = np.asarray(shape.vertices)[:-1]
        return (
            Rectangle(shape.length + longer, shape.width + WIDER * longer)
            if not np.any(shape.center)
            else Polygon(corners)
        )
    if kind == "Circle" and not np.any(shape.center):
        return Disc(shape.radius)
    return Polygon(np.asarray(area(shape).exterior.coords)[:-1]) if kind in ("Circle", "Polygon") else None


CHANGE = 2.0
"""[m] What a change of lanes costs beside the length of a way. Larger: longer ways with fewer changes."""
MOST_WAYS = 4
"""Ways to a goal that are tried at most. More: goals behind closed ways are reached; longer searches."""
SIDEWAYS = 2.5
"""[s] of driving in which a way comes to the middle of its lanelet. Shorter: harder turns. Longer: later changes."""
SPACING = 0.5
"""[m] between points of a way. Smaller: slower. Larger: the goal is entered up to this late."""
INSIDE, CENTRAL = 0.3, 3.0
"""[1], [m] What targets keep from the ends of the part of a way in the goal: a share, at most so much."""
SMOOTH = 9
"""[1] Points over whose mean a way goes, twice. More: it cuts bends. Fewer: it has the corners of its lanelets."""


@dataclass(frozen=True, eq=False)
class Way:
    """A way (n, 2) [m] in points SPACING apart, and its part from `enters` to `leaves` [m] in the goal."""

    points: Array
    enters: float
    leaves: float

    def point(self, s: Array) -> Array:
        """Points (k, 2) [m] at lengths s (k,) [m]; beyond the ends on the tangents."""
        along = SPACING * np.arange(len(self.points))
        found = np.stack([np.interp(s, along, self.points[:, axis]) for axis in (0, 1)], axis=1)
        first, last = (self.points[k + 1] - self.points[k] for k in (0, -2))
        before, after = np.minimum(s, 0.0), np.maximum(s - along[-1], 0.0)
        return np.asarray(found + (before[:, None] * first + after[:, None] * last) / SPACING)

    def curvature(self, s: Array) -> Array:
        """Curvatures (k,) [1/m] at lengths s (k,) [m], at least 1e-6."""
        turn = np.gradient(np.unwrap(np.arctan2(*np.gradient(self.points, axis=0).T[::-1]))) / SPACING
        along = SPACING * np.arange(len(self.points))
        return np.asarray(np.maximum(np.abs(np.interp(s, along, turn, right=0.0)), 1e-6))


def ways(scenario: Any, problem: Any, goal: Any) -> list[Way]:
    """Ways to a goal along lanelets, the shortest first; a straight one if no lanelet leads there."""
    network, start = scenario.lanelet_network, problem.initial_state
    region = area(goal.position) if goal.has_value("position") else None
    routes = _routes(network, start, region)
    found = [way for route in routes if (way := _way(_line(network, route, start), region)) is not None]
    if not found and region is not None:
        straight = _way(np.array([start.position, region.representative_point().coords[0]]), region)
        found = [] if straight is None else [straight]
    return found[:MOST_WAYS]


def _routes(network: Any, start: Any, region: Any) -> list[list[int]]:
    """Lanelets from the start into each one that meets the region, by length; changes of lanes are left out."""
    (here,) = network.find_lanelet_by_position([start.position])
    direction = np.array([cos(start.orientation), sin(start.orientation)])
    heap: list[tuple[float, int, list[int]]] = []
    for number in here:
        line = shapely.LineString(network.find_lanelet_by_id(number).center_vertices)
        s = line.project(shapely.Point(start.position))
        ahead = np.subtract(*(line.interpolate(at).coords[0] for at in (min(s + 1.0, line.length), max(s - 1.0, 0.0))))
        aside = float(np.linalg.norm(line.interpolate(s).coords[0] - start.position))
        if ahead @ direction > 0.5 * np.linalg.norm(ahead):
            heappush(heap, (aside - s, number, [number]))
    seen, routes = set[int](), list[list[int]]()
    while heap:
        cost, number, route = heappop(heap)
        if number in seen:
            continue
        seen.add(number)
        lanelet = network.find_lanelet_by_id(number)
        if region is None or lanelet.polygon.shapely_object.intersection(region).area > 0.1:
            routes.append(route)
        for other in lanelet.successor:
            heappush(heap, (cost + float(lanelet.distance[-1]), other, [*route, other]))
        for other, same in (
            (lanelet.adj_left, lanelet.adj_left_same_direction),
            (lanelet.adj_right, lanelet.adj_right_same_direction),
        ):
            if other is not None and same:
                heappush(heap, (cost + CHANGE, other, [*route[:-1], other]))
    return routes


def _line(network: Any, route: list[int], start: Any) -> Array:
    """Points (n, 2) [m] along the middle of the lanelets of a route, from the start on."""
    ahead, speed = list(route), max(float(start.velocity), 5.0)
    while len(ahead) < len(route) + 3 and (after := network.find_lanelet_by_id(ahead[-1]).successor):
        ahead.append(after[0])
    points = np.array([start.position], dtype=np.float64)
    for number in ahead:
        line = shapely.LineString(network.find_lanelet_by_id(number).center_vertices)
        part = shapely.ops.substring(line, line.project(shapely.Point(points[-1])), line.length)
        if part.length > SPACING:
            s = np.arange(0.0, part.length, SPACING)
            middle = np.array([part.interpolate(at).coords[0] for at in s])
            share = np.clip(s / (SIDEWAYS * speed), 0.0, 1.0)
            aside = (points[-1] - middle[0]) * (1.0 - share * share * (3.0 - 2.0 * share))[:, None]
            points = np.concatenate([points, (middle + aside)[1:]])
    return points


def _way(points: Array, region: Any) -> Way | None:
    """The way through points (n, 2) [m], and its part inside the region; None if it has none."""
    line = shapely.LineString(points)
    if line.length < SPACING:
        return None
    even = np.array([line.interpolate(s).coords[0] for s in np.arange(0.0, line.length, SPACING)])
    if len(even) < 2:
        return None
    for _ in range(2):
        wide = np.concatenate(
            [2.0 * even[0] - even[SMOOTH // 2 : 0 : -1], even, 2.0 * even[-1] - even[-2 : -SMOOTH // 2 - 1 : -1]]
        )
        if len(wide) == len(even) + SMOOTH - 1:
            even = np.stack(
                [np.convolve(wide[:, axis], np.full(SMOOTH, 1.0 / SMOOTH), "valid") for axis in (0, 1)], axis=1
            )
    if region is None:
        return Way(even, 0.0, inf)
    inside = np.flatnonzero(shapely.contains_xy(region, even))
    if not len(inside):
        return None
    end = inside[np.append(np.flatnonzero(np.diff(inside) > 1), len(inside) - 1)[0]]
    return Way(even, SPACING * float(inside[0]), SPACING * float(end))


LATE = 0.05
"""[s] Delay of a target that counts as none. Targets that are late are tried after the others."""
STEADY = (2.0, 4.0, 7.0)
"""[m/s^2] Largest accelerations of targets, in the order in which they are tried. Larger: more goals are in reach."""
SLOWEST = 0.1
"""[m/s] Least speed along a way. Smaller: cars that are early stand still."""
MOST_TARGETS = 8
"""Targets that are tried at most. More: more problems are solved; longer searches."""
BEYOND = 3.0
"""[s] for which targets go on after the goal. Shorter: the car brakes before the goal."""


def targets(scenario: Any, problem: Any) -> list[Sampled]:
    """Motions of a target into the goal in steps of the scenario, those nearest to a steady motion first.

    Each moves along a way, as the car cruises that comes from its initial speed and is in time, slower in bends.
    """
    dt, start = float(scenario.dt), problem.initial_state
    v0, first = float(start.velocity), int(start.time_step)
    found = list[tuple[float, float, Sampled]]()
    for goal in problem.goal.state_list:
        low, high = (max(int(step), first + 1) for step in _ends(goal.time_step))
        speeds = np.maximum(_ends(goal.velocity), SLOWEST) if goal.has_value("velocity") else (0.0, MAX_SPEED)
        for way in ways(scenario, problem, goal):
            middle = 0.5 * (way.enters + way.leaves)
            natural = low if middle == inf else int(np.clip(first + middle / max(v0, 1.0) / dt, low, high))
            for step in dict.fromkeys((natural, low, high, (low + high) // 2)):
                for at in _places(way, v0, dt * (step - first)):
                    made = _cruise(way, at, v0, speeds, dt * (step - first))
                    if made is not None:
                        effort, speed, times, s = made
                        even = np.arange(0.0, times[-1], dt)
                        path = Sampled(dt * first + even, way.point(_at(even, times, s)))
                        found.append((effort, abs(speed - v0), path))
    return [path for *_, path in sorted(found, key=lambda one: one[:2])[:MOST_TARGETS]]


def _places(way: Way, speed: float, length: float) -> list[float]:
    """Lengths [m] of a way inside the goal, the first as near as possible to the one at a speed [m/s] for `length` [s].

    The others are spread over those that a car reaches that changes its speed.
    """
    depth = min(INSIDE * (way.leaves - way.enters), CENTRAL) if way.leaves < inf else 0.0
    braking = min(length, speed / STEADY[-1])
    least, most = (speed * t + 0.5 * a * t**2 for t, a in ((braking, -STEADY[-1]), (length, STEADY[-1])))
    enters, leaves = way.enters + depth, way.leaves - depth
    low, natural, high = np.clip([least, speed * length, most], enters, leaves).tolist()
    found = (natural, *np.linspace(natural, low, 5).tolist(), *np.linspace(natural, high, 4).tolist())
    return list(dict.fromkeys(max(place, SPACING) for place in found))


def _cruise(way: Way, at: float, v0: float, speeds: Any, length: float) -> tuple[float, float, Array, Array] | None:
    """Times (n,) [s] and lengths (n,) [m] of a motion along a way that is `at` a length [m] after `length` [s].

    With it the speed [m/s] at which it cruises, and its effort: the least acceleration [m/s^2] of STEADY for which
    there is one, more if it is late or slower than the least of `speeds` there. None if it is early with each of them.
    """
    s = np.append(np.arange(0.0, at, SPACING), at + SPACING * np.arange(int(MAX_SPEED * BEYOND / SPACING)))
    bend = way.curvature(s)
    here = int(np.searchsorted(s, at))
    for acceleration in STEADY:
        low, high = SLOWEST, MAX_SPEED
        for _ in range(30):
            speed = 0.5 * (low + high)
            cap = np.minimum(speed**2, acceleration / bend)
            cap[here] = min(cap[here], speeds[1] ** 2)
            way_of = 2.0 * acceleration * s
            # Squared speeds from which it brakes in time, and to which it comes from v0.
            cap = np.minimum.accumulate((cap + way_of)[::-1])[::-1] - way_of
            cap = np.maximum(np.maximum(cap, v0**2 - way_of), SLOWEST**2)
            cap[0] = v0**2
            v = np.sqrt(np.minimum.accumulate(cap - way_of) + way_of)
            times = np.append(0.0, np.cumsum(2.0 * np.diff(s) / (v[1:] + v[:-1])))
            low, high = (speed, high) if times[here] > length else (low, speed)
        if abs(times[here] - length) < LATE:
            break
    late = float(times[here]) - length
    if late < -LATE:
        return None
    effort = acceleration + max(0.0, late - LATE) / LATE + STEADY[-1] * max(0.0, speeds[0] - v[here])
    some = times <= length + BEYOND
    return float(effort), speed, times[some], s[some]


def _at(t: Array, times: Array, s: Array) -> Array:
    """Lengths (k,) [m] at times t (k,) [s] of a motion that is at lengths s (n,) at times (n,)."""
    return np.asarray(Sampled(times, np.stack([s, 0.0 * s], axis=1)).position(t)[:, 0])


def _ends(value: Any) -> tuple[float, float]:
    """The ends of an interval of CommonRoad, or an exact value twice."""
    return float(getattr(value, "start", value)), float(getattr(value, "end", value))


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


LENGTH, WIDTH = 4.508, 1.610
"""[m] of vehicle type 2 of CommonRoad, a BMW 320i (Althoff, Koschi and Manzinger, IV 2017)."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of the car: time steps (n,) of the scenario, positions (n, 2) [m] and velocities (n, 2) [m/s].

    `headings` and `steering` (n,) [rad] are its orientation and steering angle; those of a point mass are the direction
    of its velocity and 0. `reached`: the last state is in the goal. `safe`: all decisions were, and at no time step
    the car, turned by its orientation, meets an obstacle or the border. `model`: a name of `MODELS`.
    """

    steps: Array
    positions: Array
    velocities: Array
    headings: Array
    steering: Array
    reached: bool
    safe: bool
    model: str


def contacts(scenario: Any, motion: Motion) -> Flags:
    """Whether the car meets an obstacle or the border at each time step (n,)."""
    walls, found = shapely.union_all(borders(scenario, SLIT)), np.zeros(len(motion.steps), np.bool_)
    for k, (step, position, angle) in enumerate(zip(motion.steps.tolist(), motion.positions, motion.headings.tolist())):
        body = shapely.Polygon(_corners(angle) + position)
        regions = (o.occupancy_at_time(int(step)) for o in scenario.obstacles)
        found[k] = body.intersects(walls) or any(body.intersects(area(each.shape)) for each in regions if each)
    return found


def _corners(angle: float) -> Array:
    """Corners (4, 2) [m] of the car about its middle, at an orientation [rad]."""
    x, y = 0.5 * LENGTH, 0.5 * WIDTH
    c, s = cos(angle), sin(angle)
    return np.asarray(np.array([(-x, -y), (x, -y), (x, y), (-x, y)]) @ np.array([[c, s], [-s, c]]))


# A car that moves as a point mass (PM): a disc as wide as the car, among vehicles that are longer by the rest of it.
#
# The point mass turns with its velocity. The disc keeps that within the walls, in bends as wide as those of roads; what
# the whole body touches is judged by `contacts`.


MAX_SPEED = 50.0
"""[m/s] of a car, as CommonRoad bounds it."""
HORIZON = 2.0
"""[s] of the decisions of the point mass. Longer: it slows down before bends. Shorter: it cannot stop in time."""
STANDING = 1e-3
"""[m/s] below which the point mass keeps its orientation: the checker takes it from the velocity, also at rest."""


def drive_point_mass(scenario: Any, problem: Any, path: Sampled, max_acceleration: float, margin: float) -> Motion:
    """Motion of the point mass to a target on its path, see `solve`."""
    dt, start = float(scenario.dt), problem.initial_state
    first, last = int(start.time_step), int(max(_ends(goal.time_step)[1] for goal in problem.goal.state_list))
    limits, goal = Limits(MAX_SPEED, max_acceleration), Goal(path, 0.1, stop=True)
    angle = float(start.orientation)
    state = State(start.position, start.velocity * np.array([cos(angle), sin(angle)]))
    previous = None
    safe = True
    reached = False
    states, angles = [state], [angle]
    k = first
    robot = Navigator(method("nao"), Disc(0.5 * WIDTH), limits, period=dt, horizon=HORIZON, margin=margin)
    around = surroundings(scenario, longer=LENGTH - WIDTH)
    while k < last and not reached:
        previous = robot.decide(state, around, goal, now=k * dt, previous=previous)
        a = previous.manoeuvre.mean_acceleration(k * dt, dt)
        state = State(state.position + dt * state.velocity + 0.5 * dt * dt * a, state.velocity + dt * a, a)
        if np.linalg.norm(state.velocity) > STANDING:
            angle = float(np.arctan2(state.velocity[1], state.velocity[0]))
        states.append(state)
        angles.append(angle)
        k, safe = k + 1, safe and previous.safe
        reached = in_goal(problem, state.position, state.velocity, k, angle)
    positions, velocities = (np.array([getattr(s, name) for s in states]) for name in ("position", "velocity"))
    steps = np.arange(first, k + 1, dtype=np.float64)
    return Motion(steps, positions, velocities, np.array(angles), np.zeros(len(steps)), reached, safe, "PM")


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
SPEED_RESERVE = 1.25
"""[1] Largest speed of the car in units of the target's largest one."""


def drive_single_track(scenario: Any, problem: Any, path: Sampled, max_acceleration: float, margin: float) -> Motion:
    """Motion of the single-track model along the path of the target, see `solve`."""
    dt, start = float(scenario.dt), problem.initial_state
    first, last = int(start.time_step), int(max(_ends(goal.time_step)[1] for goal in problem.goal.state_list))
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

    with replacing(folder / name) as part:
        CommonRoadSolutionWriter(made).write_to_file(str(part.parent), name, overwrite=True)
    return folder / name


def _pm_states(motion: Motion) -> list[Any]:
    from commonroad.scenario.state import PMState

    slow = np.linalg.norm(motion.velocities, axis=1)[:, None] <= STANDING
    along = STANDING * np.stack([np.cos(motion.headings), np.sin(motion.headings)], axis=1)
    rows = zip(motion.steps.tolist(), motion.positions, np.where(slow, along, motion.velocities).tolist())
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

    Targets are tried in the order of `targets`, until a motion reaches the goal and is safe. Without any, the motion is
    the first that is safe, else the first that reaches the goal, else the first.

    Raises:
        InvalidInput: a goal to which no target moves; dynamic obstacles without a prediction; a model that is not in
            MODELS; a largest acceleration [m/s^2] or a margin [m] that no navigator accepts.
    """
    drive, best = MODELS[known(model, "model", tuple(MODELS))], list[tuple[bool, bool, Motion]]()
    for path in targets(scenario, problem):
        motion = drive(scenario, problem, path, max_acceleration, margin)
        motion = replace(motion, safe=motion.safe and not contacts(scenario, motion).any())
        if motion.safe and motion.reached:
            return motion
        best.append((motion.safe, motion.reached, motion))
    if not best:
        raise InvalidInput(f"planning problem {problem.planning_problem_id}: expected a goal in reach, found none")
    return max(best, key=lambda one: one[:2])[2]
