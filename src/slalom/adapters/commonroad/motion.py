"""Motion of a car that solves a planning problem, and the size of the car."""

from dataclasses import dataclass

from slalom.checks import Array

LENGTH, WIDTH = 4.508, 1.610
"""[m] of vehicle type 2 of CommonRoad, a BMW 320i (Althoff, Koschi and Manzinger, IV 2017)."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of the car: time steps (n,) of the scenario, positions (n, 2) [m] and velocities (n, 2) [m/s].

    `headings` and `steering` (n,) [rad] are its orientation and steering angle; those of a point mass are the direction
    of its velocity and 0. `reached`: the last state is in the goal. `safe`: all decisions were. `model`: a name of
    `MODELS`.
    """

    steps: Array
    positions: Array
    velocities: Array
    headings: Array
    steering: Array
    reached: bool
    safe: bool
    model: str
