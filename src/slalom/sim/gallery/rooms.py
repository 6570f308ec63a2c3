"""Scenarios of several robots among walls: they join the gallery."""

from collections.abc import Mapping

import numpy as np

from slalom.checks import positive, whole
from slalom.errors import InvalidInput
from slalom.limits import Limits
from slalom.obstacle import Obstacle
from slalom.shape import Disc, Polyline, Union
from slalom.sim.gallery.open_space import HOLDS, ahead_for_ever
from slalom.sim.gallery.placement import random_positions, team
from slalom.sim.scenario import Scenario
from slalom.trajectory import Stationary

WALL = 0.05
"""[m] Half the thickness of walls; widths of rooms and doorways are between surfaces."""


def corridor_swap(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Two groups at random places in the first and the last third of a corridor change sides."""
    count, half = whole(p["robots"], "robots", 2), 0.5 * positive(p["length"], "length")
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    apart, side = 2.0 * shape.radius + 0.2, 0.5 * positive(p["width"], "width")
    low, high = np.array([-half, shape.radius + 0.1 - side]), np.array([-half / 3.0, side - shape.radius - 0.1])
    many, few = (count + 1) // 2, count // 2
    left, right = (random_positions(many, low, high, apart, rng, "robots of a group") for _ in range(2))
    back, forth = (random_positions(few, low, high, apart, rng, "robots of a group") for _ in range(2))
    robots = team([*left, *-back], [*-right, *forth], shape, limits, 0.3)
    end, y = half + 4.0, side + WALL
    walls = Union((Polyline([(-end, y), (end, y)], WALL), Polyline([(-end, -y), (end, -y)], WALL)))
    around = (Obstacle(walls, Stationary((0.0, 0.0)), "walls"),)
    duration = 8.0 * half / limits.max_speed + 40.0
    return Scenario("corridor_swap", robots, around, duration=duration, horizon=6.0, holds=HOLDS)


def navground_corridor(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """The experiment Corridor of navground: robots that go east and west by turns in a corridor that repeats.

    The 20 robots of 0.08 m that prefer 0.12 m/s, the 8 m x 0.6 m, 0.12 m between them at first and the
    1000 steps of 0.1 s are those of navground 0.7.0 (corridor.yaml). There they have two wheels, no limit on
    acceleration and a horizon of 5 s. Nobody arrives: see `crowds.ahead_for_ever`.
    """
    count, length = whole(p["robots"], "robots", 1), positive(p["length"], "length")
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    width, edge, period = positive(p["width"], "width"), shape.radius + 0.02, (length, np.inf)
    starts = random_positions(count, (0.0, edge), (length, width - edge), 2.0 * shape.radius + 0.12, rng, period=period)
    along = np.array([(1.0, 0.0), (-1.0, 0.0)])[np.arange(count) % 2]
    robots = ahead_for_ever(starts, along, shape, limits, 100.0)
    sides = (-WALL, width + WALL)
    walls = Union(tuple(Polyline([(0.0, y), (length, y)], WALL) for y in sides))
    around = (Obstacle(walls, Stationary((0.0, 0.0)), "walls"),)
    return Scenario(
        "navground_corridor", robots, around, duration=100.0, horizon=10.0, margin=0.02, holds=HOLDS, period=period,
    )  # fmt: skip


def doorway(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Robots at random places of one of two square rooms go through the doorway between them; if `both`, half of them
    each way.
    """
    count, room, door = whole(p["robots"], "robots", 1), positive(p["room"], "room"), p["door"]
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    least = 2.0 * shape.radius + 0.2
    if not least <= door < room:
        raise InvalidInput(
            f"door: expected {least:g} m, for robots to pass, up to the room's {room:g} m; found {door:g} m"
        )
    edge, y, jamb = shape.radius + 0.1, 0.5 * room + WALL, 0.5 * door + WALL
    # Nobody starts or stops in front of the doorway.
    low, high = np.array([edge - room, edge - 0.5 * room]), np.array([-door - shape.radius, 0.5 * room - edge])
    here = random_positions(count, low, high, least, rng)
    there = random_positions(count, low, high, least, rng) * (-1.0, 1.0)
    swap = (np.arange(count) % 2 == 1)[:, None] & bool(p["both"])
    robots = team(np.where(swap, there, here), np.where(swap, here, there), shape, limits, 0.3)
    x = room + WALL
    walls = Union(
        (
            Polyline([(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)], WALL),
            Polyline([(0.0, y), (0.0, jamb)], WALL),
            Polyline([(0.0, -y), (0.0, -jamb)], WALL),
        )
    )
    around = (Obstacle(walls, Stationary((0.0, 0.0)), "walls"),)
    return Scenario("doorway", robots, around, duration=180.0, horizon=6.0, holds=HOLDS)
