"""Discs and walls that one robot of a team observes, over the time of a prediction."""

from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.peers.crowd import Discs, Team, interaction_distances


class Surroundings(NamedTuple):
    """Discs at constant velocities and edges of walls at rest, around a robot of radius `radius` [m].

    Attributes:
        positions: (M, 2) [m] of the discs, nearest first. velocities: (M, 2) [m/s]. radii: (M,) [m].
        members: (M,) index in the team, or -1 for other discs.
        starts, ends: (E, 2) [m] of the edges.
    """

    radius: float
    positions: Array
    velocities: Array
    radii: Array
    members: Array
    starts: Array
    ends: Array

    def clearance(self, places: Array, times: Array) -> Array:
        """Least distances (..., H) [m] between surfaces of the robot at places (..., H, 2) [m] at times (H,) [s]."""
        least = np.full(places.shape[:-1], np.inf)
        for position, velocity, radius in zip(self.positions, self.velocities, self.radii):
            offset = places - (position + times[:, None] * velocity)
            np.minimum(least, np.hypot(offset[..., 0], offset[..., 1]) - radius, out=least)
        for start, end in zip(self.starts, self.ends):
            offset = places - nearest_point(places, start, end)
            np.minimum(least, np.hypot(offset[..., 0], offset[..., 1]), out=least)
        return least - self.radius


def nearest_point(places: Array, start: Array, end: Array) -> Array:
    """Points (..., 2) [m] of an edge nearest to places (..., 2) [m]."""
    along = end - start
    share = np.clip((places - start) @ along / (along @ along), 0.0, 1.0)
    return np.asarray(start + share[..., None] * along)


def surroundings(team: Team, positions: Array, velocities: Array, others: Discs, seconds: float) -> list[Surroundings]:
    """Obstacles and robots that each robot of the team may meet within that time [s]."""
    count = len(positions)
    places, speeds = np.concatenate([positions, others.positions]), np.concatenate([velocities, others.velocities])
    radii = np.concatenate([team.radii, others.radii])
    members = np.concatenate([np.arange(count), np.full(len(others.radii), -1)])
    edges = [pair for wall in team.walls for pair in edges_of(wall)]
    starts, ends = (np.array([edge[k] for edge in edges]).reshape(-1, 2) for k in (0, 1))
    found = []
    for k, reach in enumerate(interaction_distances(seconds, team, others)):
        distances = np.linalg.norm(places - positions[k], axis=1)
        distances[k] = np.inf
        # An order that does not depend on that of the robots: floating-point sums then agree to the bit.
        order = np.lexsort((*speeds.T, *places.T, distances))
        near = order[distances[order] <= reach]
        row = Surroundings(float(team.radii[k]), places[near], speeds[near], radii[near], members[near], starts, ends)
        found.append(row)
    return found


def edges_of(outline: Array) -> list[tuple[Array, Array]]:
    """Edges of an outline (k, 2): one of a line, k of a polygon."""
    if len(outline) == 2:
        return [(outline[0], outline[1])]
    return list(zip(outline, np.roll(outline, -1, axis=0)))
