"""Gallery of named scenarios, for tests, benchmarks, documentation and the command line."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from slalom.base.checks import known, number, shown
from slalom.base.errors import InvalidInput
from slalom.base.registry import Kind, Registry
from slalom.sim.gallery import fleets, worlds
from slalom.sim.gallery.worlds import crowdnav
from slalom.sim.scenario import SETTINGS, Scenario


@dataclass(frozen=True)
class Entry:
    """A scenario of the gallery.

    Attributes:
        name: name of the scenario.
        build: function of the parameters, with the seed as `seed`, and a generator of that seed.
        parameters: default values by name.
        sentence: description.
    """

    name: str
    build: Callable[[Mapping[str, float], np.random.Generator], Scenario]
    parameters: Mapping[str, float]
    sentence: str


_ENTRIES: Final = (
    Entry("empty", worlds.empty, {"distance": 20.0}, "A single robot drives to its goal and stops."),
    Entry("head_on", worlds.head_on, {"speed": 5.0, "offset": 0.0}, "One car drives straight towards the robot."),
    Entry(
        "curved_road",
        worlds.curved_road,
        {"radius": 30.0, "speed": 8.0},
        "Four vehicles on a curved road: VO predicts collisions that NLVO does not.",
    ),
    Entry(
        "roundabout_crossing",
        worlds.roundabout_crossing,
        {"max_acceleration": 4.0, "speed": 1.0},
        "The paper's roundabout: 30 vehicles in three lanes, crossed from left to right.",
    ),
    Entry(
        "roundabout_exit",
        worlds.roundabout_exit,
        {"max_acceleration": 4.0, "speed": 1.0},
        "The paper's roundabout, entered on the left and left at the top.",
    ),
    Entry(
        "merging",
        worlds.merging,
        {"max_acceleration": 4.0, "speed": 1.0, "gap": 6.0, "wait": 3.0, "exit": 180.0},
        "The paper's roundabout: a robot merges into the outer lane and leaves at a later exit.",
    ),
    Entry(
        "drones_crossing",
        worlds.drones_crossing,
        {"drones": 8.0, "speed": 1.5},
        "In space: a drone crosses a hall among drones that fly on planned polynomials.",
    ),
    Entry(
        "corridor",
        worlds.corridor,
        {"people": 6.0, "door": 1.4},
        "A corridor with a doorway, through which people walk in both directions.",
    ),
    Entry(
        "blind_corner",
        worlds.blind_corner,
        {"people": 3.0, "speed": 1.5, "width": 2.4, "max_speed": 1.5, "max_acceleration": 1.0, "passive_safety": 0.0},
        "A corridor with a blind corner, around which people come that do not yield.",
    ),
    Entry(
        "circle",
        fleets.circle,
        {"robots": 4.0, "radius": 20.0, "robot_radius": 1.5, "noise": 1e-3, "max_speed": 2.0, "max_acceleration": 2.0},
        "Robots on a circle, each with its goal on the opposite side.",
    ),
    Entry(
        "circle_random",
        fleets.circle_random,
        {"robots": 10.0, "radius": 20.0, "robot_radius": 1.5, "max_speed": 2.0, "max_acceleration": 2.0},
        "Robots at random positions on a circle, each with its goal on the opposite side.",
    ),
    Entry(
        "ring",
        fleets.ring,
        {"robots": 10.0, "radius": 25.0, "robot_radius": 0.5, "noise": 0.01, "max_speed": 1.5, "max_acceleration": 2.0},
        "Robots on a circle that start at maximum speed, as in comparisons of ORCA and related methods.",
    ),
    Entry(
        "random_goals",
        fleets.random_goals,
        {"robots": 8.0, "side": 20.0, "robot_radius": 0.5, "max_speed": 1.5, "max_acceleration": 2.0},
        "Robots at random positions with random goals.",
    ),
    Entry(
        "crossing_streams",
        fleets.crossing_streams,
        {"robots": 20.0, "angle": 90.0, "lanes": 3.0, "robot_radius": 0.3, "max_speed": 1.5, "max_acceleration": 2.0},
        "Two streams of robots in lanes that cross at an angle.",
    ),
    Entry(
        "corridor_swap",
        fleets.corridor_swap,
        {"robots": 20.0, "width": 6.0, "length": 20.0, "robot_radius": 0.3, "max_speed": 1.5, "max_acceleration": 2.0},
        "Two groups of robots in a corridor swap sides.",
    ),
    Entry(
        "doorway",
        fleets.doorway,
        {
            "robots": 20.0,
            "both": 0.0,
            "door": 1.4,
            "room": 8.0,
            "robot_radius": 0.3,
            "max_speed": 1.5,
            "max_acceleration": 2.0,
        },
        "Robots pass a doorway from one room to the next; with both=1 half of them in each direction.",
    ),
    Entry(
        "navground_antipodal",
        fleets.navground_antipodal,
        {
            "robots": 20.0,
            "radius": 2.0,
            "robot_radius": 0.1,
            "noise": 0.005,
            "max_speed": 0.08,
            "max_acceleration": 0.2,
        },
        "Twenty small slow robots swap positions on a circle, as in navground's Antipodal.",
    ),
    Entry(
        "navground_cross",
        fleets.navground_cross,
        {"robots": 20.0, "side": 4.0, "robot_radius": 0.08, "max_speed": 0.12, "max_acceleration": 0.2},
        "Twenty small slow robots cross a square from all sides, as in navground's Cross.",
    ),
    Entry(
        "warehouse",
        fleets.warehouse,
        {"robots": 20.0, "rate": 18.0, "robot_radius": 0.3, "max_speed": 1.5, "max_acceleration": 2.0},
        "Robots carry goods from shelves to packing stations, task after task.",
    ),
    Entry(
        "crowdnav",
        crowdnav,
        {"people": 5.0, "max_acceleration": 1.0},
        "Test case number SEED of CrowdNav: people avoid each other but not the robot.",
    ),
    Entry(
        "recorded_roundabout",
        worlds.recorded_roundabout,
        {"at": 6.4, "random": 0.0},
        "A recorded roundabout with 30 cars, which yield to each other but not to the robot.",
    ),
)

GALLERY: Final = Registry[Entry](
    "slalom.scenarios",
    Kind(lambda part: isinstance(part, Entry), "an Entry of slalom.sim.gallery"),
    {entry.name: entry for entry in _ENTRIES},
)
"""Scenarios by name; packages add to them by entry points of the group slalom.scenarios."""

COUNTS: Final = frozenset({"robots", "people", "drones", "lanes"})
"""Parameters that count robots or obstacles."""
MOST: Final = 100_000
"""[1] Largest count: each robot takes some kilobytes, so that 1e9 of them would end the process without a message."""


def build(name: str | Entry, settings: Mapping[str, float] | None = None, *, seed: int = 0) -> Scenario:
    """Build a scenario of the gallery, or of an entry, with changed parameters of its own or settings of all scenarios.

    Raises:
        InvalidInput: an unknown name or parameter (the message lists the known ones), a negative seed.
    """
    entry = name if isinstance(name, Entry) else GALLERY.find(name, "scenario")
    if seed < 0:
        raise InvalidInput(f"seed: expected 0 or more, found {seed}")
    changed = dict(settings or {})
    for key in changed:
        known(key, f"parameter of {entry.name}", [*entry.parameters, *SETTINGS])
    for key in sorted(COUNTS & changed.keys()):
        if number(changed[key], key) > MOST:
            raise InvalidInput(f"{key}: expected at most {MOST}, found {changed[key]:g}")
    parameters = {**entry.parameters, **{k: v for k, v in changed.items() if k in entry.parameters}}
    scenario = entry.build({**parameters, "seed": seed}, np.random.default_rng(seed))
    if not isinstance(scenario, Scenario):
        raise InvalidInput(f"{entry.name}: expected a function that returns a Scenario, found {shown(scenario)}")
    scenario = scenario.with_settings({k: v for k, v in changed.items() if k not in entry.parameters})
    return replace(scenario, parameters={**parameters, **changed})
