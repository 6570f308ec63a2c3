"""What a run asks of another project's method, and what it tells it."""

from importlib import import_module
from typing import Any, NamedTuple, Protocol

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput


class Team(NamedTuple):
    """N robots that move by one method, and what never changes around them.

    Attributes:
        radii: (N,) [m] that the method plans with. speeds: (N,) [m/s], the largest. period: [s] between decisions.
        walls: outlines (k, 2) [m] of what stands: two points are a line, three or more a polygon, counter-clockwise.
    """

    radii: Array
    max_speeds: Array
    period: float
    walls: tuple[Array, ...] = ()


class Discs(NamedTuple):
    """M discs that others are at one time: places (M, 2) [m], velocities (M, 2) [m/s], radii (M,) [m]."""

    positions: Array
    velocities: Array
    radii: Array


class Crowd(Protocol):
    """A team of robots in another project's library; one object until a robot leaves, told all at every decision."""

    def choose(self, places: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        """The velocities (N, 2) [m/s] that the robots want at the end of the period.

        All of them see the same past: places (N, 2) [m] and velocities (N, 2) [m/s] of the team, and the others, of
        which they know no future. `preferred` (N, 2) [m/s] are the velocities that lead them to their goals. NaN
        is no answer.
        """


def interaction_distances(seconds: float, team: Team, others: Discs) -> Array:
    """How far away (N,) [m] may be, centre to centre, what a robot could meet within that time at top speed."""
    fastest = max(team.max_speeds.max(), np.linalg.norm(others.velocities, axis=1).max(initial=0.0))
    widest = max(team.radii.max(), others.radii.max(initial=0.0))
    return np.asarray(seconds * (team.max_speeds + fastest) + team.radii + widest)


def imported(package: str, module: str = "") -> Any:
    """A module of a package of the extra `peers`. Raises InvalidInput when it is not installed or does not load."""
    try:
        return import_module(module or package)
    except ImportError as error:
        raise InvalidInput(
            f"method: expected the package {package}, which this one runs in, found {error}; "
            "install it: pip install 'slalom[peers]'"
        ) from None
