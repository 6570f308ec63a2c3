"""Gallery scenarios of several robots without walls."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slalom.base.checks import flag, not_negative, positive, whole
from slalom.base.errors import InvalidInput
from slalom.io.pedestrians import Case
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.shape import Disc, Polyline, Rectangle, Union
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.sim.placement import equal_robots, on_circle, random_angles, random_positions, refuse_overlap
from slalom.sim.scenario import Robot, Scenario
from slalom.sim.tasks import Drawn, Station, Tasks

HOLDS = (0.5, 1.0, 2.0)
"""[s] Hold times of manoeuvres. Robots of a fleet decide often, so three hold times are sufficient."""


def circle(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build robots on a circle with goals on the opposite side; `noise` [m] is the deviation of their starts."""
    count, radius = whole(p["robots"], "robots", 1), positive(p["radius"], "radius")
    positions = on_circle(2.0 * np.pi * np.arange(count) / count, radius)
    starts = positions + rng.normal(0.0, 1.0, positions.shape) * not_negative(p["noise"], "noise")
    limits = Limits(p["max_speed"], p["max_acceleration"])
    robots = equal_robots(starts, -positions, Disc(p["robot_radius"]), limits, 0.5)
    return Scenario("circle", robots, duration=_duration(2.0 * radius, limits), horizon=6.0, holds=HOLDS)


def _duration(distance: float, limits: Limits) -> float:
    """Return the time limit [s] of a run: four times the travel time of a distance [m], plus 20 s."""
    return 4.0 * distance / limits.max_speed + 20.0


def circle_random(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build robots at random positions on a circle, at least 0.2 m apart, with goals on the opposite side."""
    count, radius = whole(p["robots"], "robots", 1), positive(p["radius"], "radius")
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    min_angle = 2.0 * np.arcsin(min(1.0, (shape.radius + 0.1) / radius))
    starts = on_circle(random_angles(count, float(min_angle), rng, "robots"), radius)
    robots = equal_robots(starts, -starts, shape, limits, 0.5)
    return Scenario("circle_random", robots, duration=_duration(2.0 * radius, limits), horizon=6.0, holds=HOLDS)


def ring(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build robots on a circle that start at maximum speed towards the opposite side.

    Comparisons of ORCA and related methods use a preferred speed of 1.5 m/s and a maximum of 2 m/s. Here `max_speed`
    is both, because limits have no preferred speed. `noise` [m] is the standard deviation of the starts.
    """
    count, radius = whole(p["robots"], "robots", 1), positive(p["radius"], "radius")
    positions = on_circle(2.0 * np.pi * np.arange(count) / count, radius)
    starts = positions + rng.normal(0.0, 1.0, positions.shape) * not_negative(p["noise"], "noise")
    limits = Limits(p["max_speed"], p["max_acceleration"])
    robots = equal_robots(starts, -positions, Disc(p["robot_radius"]), limits, 0.5, limits.max_speed)
    return Scenario("ring", robots, duration=_duration(2.0 * radius, limits), horizon=6.0, holds=HOLDS)


def random_goals(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build robots at random positions in a square with random goals; starts and goals do not overlap."""
    count, half = whole(p["robots"], "robots", 1), 0.5 * positive(p["side"], "side")
    shape = Disc(p["robot_radius"])
    starts, goals = (
        random_positions(count, (-half, -half), (half, half), 2.0 * shape.radius + 0.2, rng) for _ in range(2)
    )
    robots = equal_robots(starts, goals, shape, Limits(p["max_speed"], p["max_acceleration"]), 0.3)
    return Scenario("random_goals", robots, duration=120.0, horizon=6.0, holds=HOLDS)


def crossing_streams(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build two streams of robots that cross at an angle [degrees] and stop beyond the crossing.

    Robots belong to the two streams alternately. The distance between lanes is a diameter plus 0.4 m; the gap between
    robots of a lane is 0.4 m to 2 m. Before and after the crossing the streams do not overlap.
    """
    count, lanes = whole(p["robots"], "robots", 2), whole(p["lanes"], "lanes", 1)
    if not 0.0 < p["angle"] <= 180.0:
        raise InvalidInput(f"angle: expected more than 0 and at most 180 degrees, found {p['angle']:g}")
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    angle = np.radians(p["angle"])
    lane_width = 2.0 * shape.radius + 0.4
    spacing = 2.0 * shape.radius + 1.2
    first_distance = 4.0 + 0.5 * lane_width * lanes / np.tan(0.5 * angle)
    k, stream = np.arange(count) // 2, np.arange(count) % 2
    distances = first_distance + spacing * (k // lanes) + rng.uniform(0.0, 0.8, count)
    lateral = lane_width * (k % lanes - 0.5 * (lanes - 1))
    directions = on_circle(angle * stream, 1.0)
    lane_offsets = lateral[:, None] * directions[:, ::-1] * (-1.0, 1.0)
    length = first_distance + distances.max()
    robots = equal_robots(
        lane_offsets - distances[:, None] * directions,
        lane_offsets + (length - distances)[:, None] * directions,
        shape,
        limits,
        0.3,
    )
    return Scenario("crossing_streams", robots, duration=_duration(length, limits), horizon=6.0, holds=HOLDS)


def navground_antipodal(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build the experiment Antipodal of navground: twenty small slow robots swap positions on a circle of 2 m.

    In navground the robots have two wheels and no acceleration limit. A run is 1000 steps of 0.1 s, as in navground.
    """
    antipodal = circle(p, rng)
    robots = tuple(replace(robot, goal=replace(robot.goal, tolerance=0.2)) for robot in antipodal.robots)
    return replace(antipodal, name="navground_antipodal", robots=robots, duration=100.0, horizon=10.0, margin=0.02)


def navground_cross(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build the experiment Cross of navground: robots move once from a side of a square to the opposite side.

    In navground all robots move back and forth between two positions, left and right or bottom and top. Here each robot
    has its own start and goal in zones around them, at least 0.1 m apart. A run is 1000 steps of 0.1 s, as in
    navground.
    """
    count, side = whole(p["robots"], "robots", 1), positive(p["side"], "side")
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    starts, goals = [], []
    for quarter in range(4):
        low, high = (-0.5 * side, -0.15 * side), (-0.3 * side, 0.15 * side)
        positions = random_positions(
            (count + 3 - quarter) // 4, low, high, 2.0 * shape.radius + 0.1, rng, "robots of a side"
        )
        cosine, sine = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarter]
        rotation = np.array([[cosine, sine], [-sine, cosine]])
        starts.append(positions @ rotation)
        goals.append((positions + np.array([0.8 * side, 0.0])) @ rotation)
    robots = equal_robots(np.concatenate(starts), np.concatenate(goals), shape, limits, 0.2)
    return Scenario("navground_cross", robots, duration=100.0, horizon=10.0, margin=0.02, holds=HOLDS)


def cadrl(case: Case, max_acceleration: float = 2.0) -> Scenario:
    """Build a test case of gym-collision-avoidance (see `io.pedestrians`): discs at rest, limited to their preferred
    speed.

    A run lasts 8 times the travel time of the longest straight path, as in the original evaluation. A robot arrives
    when it stops within 0.2 m of its goal. The original has no acceleration limit; `max_acceleration` is in m/s^2.

    Raises:
        InvalidInput: robots that overlap at the start.
    """
    refuse_overlap(case.starts, case.radii, "starts")
    robots = tuple(
        Robot(
            Disc(float(case.radii[k])),
            Limits(float(case.speeds[k]), max_acceleration),
            State(case.starts[k], (0.0, 0.0)),
            Goal(Stationary(case.goals[k]), 0.2, stop=True),
            f"robot {k}",
        )
        for k in range(len(case.radii))
    )
    straight_times = np.linalg.norm(case.goals - case.starts, axis=1) / case.speeds
    duration = 0.1 * np.ceil(80.0 * straight_times.max())
    parameters = {"case": float(case.number), "max_acceleration": max_acceleration}
    return Scenario("cadrl", robots, duration=float(duration), horizon=6.0, holds=HOLDS, parameters=parameters)


WALL = 0.05
"""[m] Half the thickness of walls; widths of rooms and doorways are measured between surfaces."""


def corridor_swap(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build two groups at random positions in the first and last third of a corridor, which swap sides."""
    count, half = whole(p["robots"], "robots", 2), 0.5 * positive(p["length"], "length")
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    min_distance, side = 2.0 * shape.radius + 0.2, 0.5 * positive(p["width"], "width")
    low, high = np.array([-half, shape.radius + 0.1 - side]), np.array([-half / 3.0, side - shape.radius - 0.1])
    left_count, right_count = (count + 1) // 2, count // 2
    left, right = (random_positions(left_count, low, high, min_distance, rng, "robots of a group") for _ in range(2))
    back, forth = (random_positions(right_count, low, high, min_distance, rng, "robots of a group") for _ in range(2))
    robots = equal_robots([*left, *-back], [*-right, *forth], shape, limits, 0.3)
    end, y = half + 4.0, side + WALL
    walls = Union((Polyline([(-end, y), (end, y)], WALL), Polyline([(-end, -y), (end, -y)], WALL)))
    obstacles = (Obstacle(walls, Stationary((0.0, 0.0)), "walls"),)
    duration = 8.0 * half / limits.max_speed + 40.0
    return Scenario("corridor_swap", robots, obstacles, duration=duration, horizon=6.0, holds=HOLDS)


def doorway(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build robots at random positions in one of two square rooms, which pass the doorway between the rooms.

    With `both`, half of the robots start in each room.
    """
    count = whole(p["robots"], "robots", 1)
    room = positive(p["room"], "room")
    door = p["door"]
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    min_distance = 2.0 * shape.radius + 0.2
    if not min_distance <= door < room:
        raise InvalidInput(f"door: expected {min_distance:g} m to {room:g} m; found {door:g} m")
    edge = shape.radius + 0.1
    y = 0.5 * room + WALL
    door_edge = 0.5 * door + WALL
    # No robot starts or stops in front of the doorway.
    low, high = np.array([edge - room, edge - 0.5 * room]), np.array([-door - shape.radius, 0.5 * room - edge])
    left_positions = random_positions(count, low, high, min_distance, rng)
    right_positions = random_positions(count, low, high, min_distance, rng) * (-1.0, 1.0)
    swap = (np.arange(count) % 2 == 1)[:, None] & flag(p["both"], "both")
    robots = equal_robots(
        np.where(swap, right_positions, left_positions),
        np.where(swap, left_positions, right_positions),
        shape,
        limits,
        0.3,
    )
    x = room + WALL
    walls = Union(
        (
            Polyline([(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)], WALL),
            Polyline([(0.0, y), (0.0, door_edge)], WALL),
            Polyline([(0.0, -y), (0.0, -door_edge)], WALL),
        )
    )
    obstacles = (Obstacle(walls, Stationary((0.0, 0.0)), "walls"),)
    return Scenario("doorway", robots, obstacles, duration=180.0, horizon=6.0, holds=HOLDS)


def warehouse(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build robots that carry goods from shelves to the packing stations of a hall of 40 m x 24 m.

    Each of the 12 shelves has two stations. Four stations for packing, with two places each, are at the ends of the
    hall. `rate` tasks a minute arrive at random. Robots without a task rest in the middle of the upper and lower
    edge.
    """
    count, shape = whole(p["robots"], "robots", 1), Disc(p["robot_radius"])
    limits, corners = Limits(p["max_speed"], p["max_acceleration"]), [(0, 0), (40, 0), (40, 24), (0, 24), (0, 0)]
    shelves = [(x, y) for x in (6.5, 14.0, 21.5, 29.0) for y in (5.5, 11.2, 16.9)]
    picks = {
        f"shelf {k} {side}": (x + 2.0, y - 0.9 if side == "a" else y + 2.5)
        for k, (x, y) in enumerate(shelves)
        for side in "ab"
    }
    packs = {f"pack {k}": place for k, place in enumerate([(2.0, 7.0), (2.0, 17.0), (38.0, 7.0), (38.0, 17.0)])}
    seed = whole(p["seed"], "seed")
    stations = [Station(name, at, 1, Drawn(3.0, 8.0, seed)) for name, at in picks.items()]
    stations += [Station(name, at, 2, Drawn(4.0, 10.0, seed)) for name, at in packs.items()]
    tasks = Tasks(
        tuple(stations), rate=p["rate"], seed=seed, origins=tuple(picks), destinations=tuple(packs), route=True
    )
    half = (count + 1) // 2
    rests = [(20.0 + 1.4 * (k % half - 0.5 * (half - 1)), 1.2 if k < half else 22.8) for k in range(count)]
    robots = equal_robots(rests, rests, shape, limits, 0.2)
    obstacles = [Obstacle(Polyline(corners, WALL), Stationary((0.0, 0.0)), "walls")]
    for k, (x, y) in enumerate(shelves):
        obstacles.append(Obstacle(Rectangle(4.0, 1.6), Stationary((x + 2.0, y + 0.8)), f"shelf {k}"))
    return Scenario("warehouse", robots, tuple(obstacles), duration=180.0, horizon=6.0, holds=HOLDS, tasks=tasks)
