"""The time of a step of a fleet, and the fleets that several programs measure."""

from time import perf_counter

import numpy as np

from slalom import Method
from slalom.sim import Recording, Scenario, gallery, simulate

ROOM, DT = 100.0, 0.1
"""[m^2] of the square per robot: about 10 others are within 18 m, the distance that two robots close in 6 s. [s]"""


def fleet(robots: int, seconds: float, room: float = ROOM) -> Scenario:
    """Robots of 0.5 m with random goals, `room` [m^2] each, for `seconds` [s]."""
    settings = {"robots": robots, "side": float(np.sqrt(room * robots)), "duration": seconds, "dt": DT}
    return gallery.build("random_goals", settings)


def steps(scenario: Scenario, chosen: Method) -> tuple[np.ndarray, Recording]:
    """Wall clock of every step except the first [s], without work outside the loop; and the run."""
    stamps: list[float] = []
    run = simulate(scenario, chosen, progress=lambda _: stamps.append(perf_counter()))
    return np.diff(stamps), run
