"""Scenarios of several robots that meet each other: they join the gallery."""

from collections.abc import Mapping

import numpy as np

from slalom.goal import Goal
from slalom.limits import Limits
from slalom.shape import Disc
from slalom.sim.scenario import Robot, Scenario
from slalom.state import State
from slalom.trajectory import Stationary

HOLDS = (0.5, 1.0, 2.0)
"""[s] A fleet decides often; three holds are enough for it."""


def circle(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Robots on a circle, all of which want to the opposite side; `noise` [m] moves their starts a little."""
    count, radius = int(p["robots"]), p["radius"]
    angles = 2.0 * np.pi * np.arange(count) / count
    places = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    starts = places + rng.normal(0.0, 1.0, places.shape) * p["noise"]
    limits, shape = Limits(p["max_speed"], p["max_acceleration"]), Disc(p["robot_radius"])
    robots = tuple(
        Robot(shape, limits, State(start, (0.0, 0.0)), Goal(Stationary(-place), 0.5, stop=True), f"robot {k:03d}")
        for k, (start, place) in enumerate(zip(starts, places))
    )
    longest = 4.0 * 2.0 * radius / p["max_speed"] + 20.0
    return Scenario("circle", robots, duration=longest, horizon=6.0, holds=HOLDS)


def random_goals(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Robots at random places of a square with goals at other random places, none of which overlap."""
    count, apart = int(p["robots"]), 2.0 * p["robot_radius"] + 0.2
    starts, goals = (_spread(count, p["side"], apart, rng) for _ in range(2))
    limits, shape = Limits(p["max_speed"], p["max_acceleration"]), Disc(p["robot_radius"])
    robots = tuple(
        Robot(shape, limits, State(start, (0.0, 0.0)), Goal(Stationary(goal), 0.3, stop=True), f"robot {k:03d}")
        for k, (start, goal) in enumerate(zip(starts, goals))
    )
    return Scenario("random_goals", robots, duration=120.0, horizon=6.0, holds=HOLDS)


def _spread(count: int, side: float, apart: float, rng: np.random.Generator) -> np.ndarray:
    """`count` places in a square about the origin, each at least `apart` from all others."""
    places = np.empty((0, 2))
    while len(places) < count:
        place = rng.uniform(-0.5 * side, 0.5 * side, 2)
        if not len(places) or np.linalg.norm(places - place, axis=1).min() >= apart:
            places = np.vstack([places, place])
    return places
