"""Gallery scenarios of several robots among walls."""

from collections.abc import Mapping

import numpy as np

from slalom.checks import flag, positive, whole
from slalom.errors import InvalidInput
from slalom.limits import Limits
from slalom.obstacle import Obstacle
from slalom.shape import Disc, Polyline, Union
from slalom.sim.gallery.open_space import HOLDS, robots_without_arrival
from slalom.sim.placement import equal_robots, random_positions
from slalom.sim.scenario import Scenario
from slalom.trajectory import Stationary

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


def navground_corridor(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build the experiment Corridor of navground: robots move alternately east and west in a periodic corridor.

    All sizes are those of navground 0.7.0 (corridor.yaml). They are 20 robots of 0.08 m with a preferred speed of 0.12
    m/s, and 8 m x 0.6 m. Initial gaps are 0.12 m; a run has 1000 steps of 0.1 s. Its robots have two wheels, no
    acceleration limit and a horizon of 5 s. No robot arrives: see `open_space.robots_without_arrival`.
    """
    count, length = whole(p["robots"], "robots", 1), positive(p["length"], "length")
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    width, edge, period = positive(p["width"], "width"), shape.radius + 0.02, (length, np.inf)
    starts = random_positions(count, (0.0, edge), (length, width - edge), 2.0 * shape.radius + 0.12, rng, period=period)
    directions = np.array([(1.0, 0.0), (-1.0, 0.0)])[np.arange(count) % 2]
    robots = robots_without_arrival(starts, directions, shape, limits, 100.0)
    sides = (-WALL, width + WALL)
    walls = Union(tuple(Polyline([(0.0, y), (length, y)], WALL) for y in sides))
    obstacles = (Obstacle(walls, Stationary((0.0, 0.0)), "walls"),)
    return Scenario(
        "navground_corridor", robots, obstacles, duration=100.0, horizon=10.0, margin=0.02, holds=HOLDS, period=period,
    )  # fmt: skip


def doorway(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build robots at random positions in one of two square rooms, which pass the doorway between the rooms.

    With `both`, half of the robots start in each room.
    """
    count, room, door = whole(p["robots"], "robots", 1), positive(p["room"], "room"), p["door"]
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    min_distance = 2.0 * shape.radius + 0.2
    if not min_distance <= door < room:
        raise InvalidInput(f"door: expected {min_distance:g} m to {room:g} m; found {door:g} m")
    edge, y, door_edge = shape.radius + 0.1, 0.5 * room + WALL, 0.5 * door + WALL
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
