"""Test cases of CrowdNav: a robot crosses a circle among people, which avoid each other but not the robot.

Chen, Liu, Kreiss and Alahi, ICRA 2019 (arXiv:1809.08835); numbers as in the code of the paper (vita-epfl/CrowdNav).
Test case k is drawn with numpy's legacy generator of seed 1000 + k. People do not react to the robot, so their paths
are computed once, by ORCA (package pyrvo, in single precision).
"""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np

from slalom.checks import Array, whole
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import Limits
from slalom.obstacle import Obstacle
from slalom.shape import Disc
from slalom.sim.scenario import Robot, Scenario
from slalom.state import State
from slalom.tolerances import MAX_TRIES
from slalom.trajectory import Sampled, Stationary

RADIUS = 0.3
"""[m] Radius of robot and people."""
DT = 0.25
"""[s] Interval between decisions of robot and people."""
WALK_DURATION = 60.0
"""[s] Duration of the people's paths: longer than a run and a horizon, so that no predicted path ends."""


def crowdnav(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build the test case of CrowdNav whose number is the seed; 0 to 499 are the published ones, with five people.

    The known future paths (NLVO, NAO) are the simulated ones. The observed velocity of a person is that of the
    starting step, 0.25 s earlier than in CrowdNav.

    Raises:
        InvalidInput: pyrvo is not installed, or the circle has no space for so many people.
    """
    starts = start_positions(whole(p["people"], "people"), int(p["seed"]))
    times = np.arange(round(WALK_DURATION / DT) + 1) * DT
    paths = np.moveaxis(walking_positions(starts, len(times) - 1), 1, 0)
    crowd = tuple(
        Obstacle(Disc(RADIUS), Sampled(times, path, "linear"), f"person {k + 1}") for k, path in enumerate(paths)
    )
    goal = Goal(Stationary((0.0, 4.0)), RADIUS)
    robot = Robot(Disc(RADIUS), Limits(1.0, p["max_acceleration"]), State((0.0, -4.0), (0.0, 0.0)), goal)
    # A run ends before the step that would start at 24 s.
    return Scenario("crowdnav", (robot,), crowd, duration=24.0, dt=DT)


def start_positions(count: int, case: int) -> Array:
    """Return the start positions (count, 2) [m] of the people of a test case; each goal is the opposite position."""
    try:
        draws = np.random.RandomState(1000 + case)
    except ValueError:
        raise InvalidInput(f"seed: expected less than {2**32 - 1000} for a legacy generator, found {case}") from None
    starts, occupied = np.empty((0, 2)), np.array([(0.0, -4.0), (0.0, 4.0)])
    failures = 0
    while len(starts) < count:
        if failures == MAX_TRIES:
            raise InvalidInput(f"people: expected space for {count} on the circle, found space for {len(starts)}")
        angle, x, y = draws.random_sample(3)
        candidate = 4.0 * np.array([np.cos(angle * 2.0 * np.pi), np.sin(angle * 2.0 * np.pi)]) + (x - 0.5, y - 0.5)
        failures += 1
        if np.linalg.norm(occupied - candidate, axis=1).min() >= 2.0 * RADIUS + 0.2:
            starts, occupied, failures = np.vstack([starts, candidate]), np.vstack([occupied, candidate, -candidate]), 0
    return starts


def walking_positions(starts: Array, steps: int) -> Array:
    """Return the positions (steps + 1, n, 2) [m] of people that avoid each other, every DT.

    The preferred speed is up to 1 m/s towards the opposite position, also after arrival. Each person observes the
    position and velocity of the others. ORCA considers up to 10 others within 10 m, has a horizon of 5 s, and enlarges
    radii by 1 cm.
    """
    simulator = _orca()(DT, 10.0, 10, 5.0, 5.0, RADIUS + 0.01, 1.0)
    positions, velocities = starts, np.zeros_like(starts)
    for start in starts:
        simulator.add_agent(tuple(start))
    result = [positions]
    for _ in range(steps):
        preferred = -starts - positions
        preferred = preferred / np.maximum(np.linalg.norm(preferred, axis=1, keepdims=True), 1.0)
        for k in range(len(starts)):
            simulator.set_agent_position(k, tuple(positions[k]))
            simulator.set_agent_velocity(k, tuple(velocities[k]))
            simulator.set_agent_pref_velocity(k, tuple(preferred[k]))
        simulator.do_step()
        chosen = (simulator.get_agent_velocity(k) for k in range(len(starts)))
        velocities = np.array([(v.x, v.y) for v in chosen]).reshape(-1, 2)
        positions = positions + DT * velocities
        result.append(positions)
    return np.array(result)


def _orca() -> Any:
    """Return the simulator class of pyrvo. Raises InvalidInput if pyrvo is not installed."""
    try:
        return import_module("pyrvo").RVOSimulator
    except ImportError:
        raise InvalidInput(
            "crowdnav: expected the package pyrvo, which moves the people; found none: pip install 'slalom[peers]'"
        ) from None
