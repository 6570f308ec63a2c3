"""What agents of navground observe: walls and discs at rest, and neighbours that are no members of their fleet.

Neighbours have no identity in navground. A neighbour is a member of the fleet if its centre is within its radius of the
centre of a member: discs that do not overlap are farther apart.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from slalom.adapters.navground.agent import Agent
from slalom.adapters.navground.world import periods
from slalom.checks import Array
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.shape import Disc, Polyline
from slalom.trajectory import Stationary


class AtRest:
    """Walls and discs at rest that agents know. The table is made anew when these change."""

    def __init__(self) -> None:
        self._seen, self._table = frozenset[Any](), ObstacleTable([])

    def table(self, members: Sequence[Agent], shift: Array) -> tuple[ObstacleTable, ...]:
        """A table of those that members observe now, displaced by `shift` (2,) [m]; none if there are none."""
        states = [m.get_environment_state() for m in members]
        lines = {(*line.p1, *line.p2) for state in states for line in state.line_obstacles}
        discs = {(*disc.position, disc.radius) for state in states for disc in state.static_obstacles}
        seen = frozenset((tuple(shift), *lines, *discs))
        if seen != self._seen:
            walls = [Obstacle(Polyline([line[:2], line[2:]]), Stationary(shift)) for line in sorted(lines)]
            posts = [Obstacle(Disc(float(r)), Stationary(np.array((x, y)) + shift)) for x, y, r in sorted(discs)]
            self._seen, self._table = seen, ObstacleTable([*walls, *posts])
        return (self._table,) if len(self._table) else ()


def neighbours(members: Sequence[Agent], shift: Array, now: float, dt: float) -> Tracks:
    """Neighbours at `now` [s] that are no members, each once, displaced by `shift` (2,) [m].

    navground renews what an agent observes just before it decides. So the first agent observes this step, and the
    others the one before, which lasted `dt` [s].
    """
    period = np.asarray(members[0].world_period, np.float64)
    centers = np.array([m.position for m in members], np.float64)
    seen = [(k > 0, each) for k, m in enumerate(members) for each in m.get_environment_state().neighbors]
    places = np.array([each.position for _, each in seen], np.float64).reshape(-1, 2)
    offsets = places[:, None] - centers
    distances = np.linalg.norm(offsets - periods(offsets, period), axis=2)
    found: list[tuple[Array, Array, float]] = []
    for j in np.flatnonzero(distances.min(axis=1, initial=np.inf) > [each.radius for _, each in seen]):
        before, each = seen[j]
        velocity = np.asarray(each.velocity, np.float64)
        place = places[j] + (dt * velocity if before else 0.0)
        offsets = np.reshape([place - other for other, _, _ in found], (-1, 2))
        if np.linalg.norm(offsets - periods(offsets, period), axis=1).min(initial=np.inf) > each.radius:
            found.append((place, velocity, float(each.radius)))
    positions, velocities, radii = (np.array(column) for column in zip(*found)) if found else np.empty((3, 0, 2))
    return Tracks(positions + shift, velocities, radii if found else 0.0, now)
