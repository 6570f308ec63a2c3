"""Interface between a run and a method that is not one of slalom's."""

from importlib import import_module
from typing import Any, NamedTuple, Protocol

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput


class Team(NamedTuple):
    """N robots that move by one method, and the walls around them.

    Attributes:
        radii: (N,) [m] with which the method plans.
        max_speeds: (N,) [m/s], changed in place between decisions where the speed limit of a path changes.
        max_accelerations: (N,) [m/s^2].
        period: [s] between decisions.
        walls: outlines (k, 2) [m] of static obstacles: two points are a line, three or more a polygon,
            counter-clockwise.
    """

    radii: Array
    max_speeds: Array
    max_accelerations: Array
    period: float
    walls: tuple[Array, ...] = ()


class Discs(NamedTuple):
    """M discs of obstacles at one time: positions (M, 2) [m], velocities (M, 2) [m/s], radii (M,) [m]."""

    positions: Array
    velocities: Array
    radii: Array


class Crowd(Protocol):
    """Team of robots in another project's library.

    One object serves until a robot leaves; it receives the full state at every decision.
    """

    def choose(self, positions: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        """Velocities (N, 2) [m/s] of the robots at the end of the period.

        All robots decide simultaneously. They use the present positions (N, 2) [m] and velocities (N, 2) [m/s] of the
        team, and the present state of `others`. `preferred` (N, 2) [m/s] are the velocities that lead to the goals. NaN
        means that the method returned no velocity.
        """


def interaction_distances(seconds: float, team: Team, others: Discs) -> Array:
    """Distances (N,) [m] between centres within which each robot may meet another disc within that time [s]."""
    max_speed = max(team.max_speeds.max(), np.linalg.norm(others.velocities, axis=1).max(initial=0.0))
    max_radius = max(team.radii.max(), others.radii.max(initial=0.0))
    return np.asarray(seconds * (team.max_speeds + max_speed) + team.radii + max_radius)


def imported(package: str, module: str = "") -> Any:
    """Import a module of a package of the extra `peers`.

    Raises:
        InvalidInput: the package is not installed or does not load.
    """
    try:
        return import_module(module or package)
    except ImportError as error:
        raise InvalidInput(
            f"method: expected the package {package}, which this one runs in, found {error}; "
            "install it: pip install 'slalom[peers]'"
        ) from None
