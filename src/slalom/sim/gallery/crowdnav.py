"""The test cases of CrowdNav: a robot crosses a circle among people who avoid each other but do not see it.

Chen, Liu, Kreiss and Alahi, ICRA 2019 (arXiv:1809.08835); numbers as in the code of the paper (vita-epfl/CrowdNav):
test case k is drawn with numpy's legacy generator of seed 1000 + k. People do not react to the robot, so where they go
is computed once, by ORCA (package pyrvo, in single precision).
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
from slalom.sim.gallery.placement import TRIES
from slalom.sim.scenario import Robot, Scenario
from slalom.state import State
from slalom.trajectory import Sampled, Stationary

RADIUS = 0.3
"""[m] Of everybody."""
DT = 0.25
"""[s] Between decisions of everybody."""
WALK = 60.0
"""[s] For which people are there: more than a run and a horizon, so that nobody is foreseen to vanish."""


def crowdnav(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """The test case of CrowdNav whose number is the seed; 0 to 499 are the published ones, with five people.

    Their known futures (NLVO, NAO) are the recorded ones. What is observed of a person's velocity is that of the step
    that begins: one step of 0.25 s earlier than in CrowdNav.

    Raises:
        InvalidInput: pyrvo is not installed, or no room for so many people.
    """
    starts = people(whole(p["people"], "people"), int(p["seed"]))
    times = np.arange(round(WALK / DT) + 1) * DT
    walks = np.moveaxis(walk(starts, len(times) - 1), 1, 0)
    crowd = tuple(
        Obstacle(Disc(RADIUS), Sampled(times, path, "linear"), f"person {k + 1}") for k, path in enumerate(walks)
    )
    goal = Goal(Stationary((0.0, 4.0)), RADIUS)
    robot = Robot(Disc(RADIUS), Limits(1.0, p["max_acceleration"]), State((0.0, -4.0), (0.0, 0.0)), goal)
    # A run is over at the first step that would begin at 24 s.
    return Scenario("crowdnav", (robot,), crowd, duration=24.0, dt=DT)


def people(count: int, case: int) -> Array:
    """Where the people of a test case start, (count, 2) [m]; each wants to the opposite place."""
    try:
        draws = np.random.RandomState(1000 + case)
    except ValueError:
        raise InvalidInput(f"seed: expected less than {2**32 - 1000} for a legacy generator, found {case}") from None
    starts, taken = np.empty((0, 2)), np.array([(0.0, -4.0), (0.0, 4.0)])
    vain = 0
    while len(starts) < count:
        if vain == TRIES:
            raise InvalidInput(f"people: expected room for {count} on the circle, found it for {len(starts)}")
        angle, x, y = draws.random_sample(3)
        place = 4.0 * np.array([np.cos(angle * 2.0 * np.pi), np.sin(angle * 2.0 * np.pi)]) + (x - 0.5, y - 0.5)
        vain += 1
        if np.linalg.norm(taken - place, axis=1).min() >= 2.0 * RADIUS + 0.2:
            starts, taken, vain = np.vstack([starts, place]), np.vstack([taken, place, -place]), 0
    return starts


def walk(starts: Array, steps: int) -> Array:
    """Where people who avoid each other are after 0 to `steps` steps of DT: (steps + 1, n, 2) [m].

    Everybody prefers up to 1 m/s towards the opposite place, goes on when there, and knows of the others position and
    velocity; ORCA sees up to 10 others within 10 m, looks 5 s ahead, and takes radii for 1 cm larger than they are.
    """
    simulator = _orca()(DT, 10.0, 10, 5.0, 5.0, RADIUS + 0.01, 1.0)
    places, velocities = starts, np.zeros_like(starts)
    for place in starts:
        simulator.add_agent(tuple(place))
    result = [places]
    for _ in range(steps):
        wanted = -starts - places
        wanted = wanted / np.maximum(np.linalg.norm(wanted, axis=1, keepdims=True), 1.0)
        for k in range(len(starts)):
            simulator.set_agent_position(k, tuple(places[k]))
            simulator.set_agent_velocity(k, tuple(velocities[k]))
            simulator.set_agent_pref_velocity(k, tuple(wanted[k]))
        simulator.do_step()
        chosen = (simulator.get_agent_velocity(k) for k in range(len(starts)))
        velocities = np.array([(v.x, v.y) for v in chosen]).reshape(-1, 2)
        places = places + DT * velocities
        result.append(places)
    return np.array(result)


def _orca() -> Any:
    """The simulator's class of pyrvo."""
    try:
        return import_module("pyrvo").RVOSimulator
    except ImportError:
        raise InvalidInput(
            "crowdnav: expected the package pyrvo, which moves the people; found none: pip install 'slalom[peers]'"
        ) from None
