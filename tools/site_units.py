"""Meanings of the parameters of scenarios, for the reference."""

from collections.abc import Mapping
from typing import Final

PARAMETERS: Final[Mapping[str, str]] = {
    "angle": "[degree] between the streams, above 0 and at most 180",
    "at": "[s] time of the recording at which the robot starts",
    "both": "1: robots start in both rooms; 0: in one",
    "distance": "[m] to the goal",
    "door": "[m] width of the doorway",
    "drones": "number of other drones",
    "exit": "[degree] from the entry to the exit",
    "gap": "[m] least gap between the cars of the lane",
    "lanes": "number of lanes of each stream",
    "length": "[m] of the corridor",
    "max_acceleration": "[m/s^2] of the robots",
    "max_speed": "[m/s] of the robots",
    "noise": "[m] standard deviation of the starts",
    "offset": "[m] of the car from the straight line of the robot",
    "passive_safety": "1: hidden agents touch the robot at rest only, 2: visible ones as well, 0: neither",
    "people": "number of people",
    "radius": "[m] of the circle of starts",
    "random": "1: random start and goal outside of the ring; 0: fixed ones",
    "rate": "tasks a minute that arrive",
    "robot_radius": "[m] of each robot",
    "robots": "number of robots",
    "room": "[m] side of each room",
    "side": "[m] of the square",
    "speed": "[m/s] of the car, and of the robot at its start",
    "wait": "[s] from the start until the gap passes the entry",
    "width": "[m] of the corridor",
}
"""Meaning and unit of a parameter of any scenario of the gallery."""
OWN_PARAMETERS: Final[Mapping[tuple[str, str], str]] = {
    ("curved_road", "radius"): "[m] of the inner lane",
    ("curved_road", "speed"): "[m/s] of the robot; cars drive at 0.9 to 1.3 times of it",
    ("drones_crossing", "speed"): "[m/s] of the other drones, about",
    ("roundabout_crossing", "speed"): "factor of the speeds of the lanes, 5, 6.5 and 8 m/s",
    ("roundabout_exit", "speed"): "factor of the speeds of the lanes, 5, 6.5 and 8 m/s",
    ("merging", "speed"): "factor of the speeds of the lanes, 5, 6.5 and 8 m/s",
}
"""Meaning of a parameter of one scenario that differs, by scenario and parameter."""


def meaning_of(scenario: str, parameter: str) -> str:
    """Return the meaning of a parameter of a scenario. Raises KeyError for a parameter without one."""
    return OWN_PARAMETERS.get((scenario, parameter)) or PARAMETERS[parameter]
