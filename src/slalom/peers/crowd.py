"""Interface between a run and a method that is not one of slalom's."""

from collections.abc import Iterable
from importlib import import_module
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import Extra, InvalidInput
from slalom.model.shape import Part
from slalom.obstacle import Obstacle


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
        MissingExtra: the package is not installed or does not load.
    """
    with Extra("peers", "method"):
        return import_module(module or package)


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


# Obstacles of a scenario as other projects' methods represent them: present discs and permanent walls.


MITRE_LIMIT: Final = 100.0
"""[1] Largest mitre of the outline of a rounded corner for methods of other projects, in radii. Larger: long spikes at
sharp corners. Smaller: the outline of a sharp corner no longer contains the shape."""


def outlines(obstacles: Iterable[Obstacle], *, walls: bool, growth: float = 0.0) -> tuple[Array, ...]:
    """Outlines (k, 2) [m] of obstacles that are not round, see `Team`, grown by `growth` [m].

    Those of rounded parts are slightly larger.

    Raises:
        InvalidInput: an obstacle that is not round and moves or, without `walls`, any that is not round; or several
            discs that turn.
    """
    expected = "discs, and other shapes at rest" if walls else "discs"
    found: list[Array] = []
    for obstacle in obstacles:
        at_rest = obstacle.at_rest
        polygonal = [part for part in obstacle.shape.parts if len(part.corners) > 1]
        if (polygonal and not (walls and at_rest)) or (obstacle.turns and not at_rest):
            kind = f"a {type(obstacle.shape).__name__.lower()} that {'is at rest' if at_rest else 'moves'}"
            raise InvalidInput(
                f"obstacle {obstacle.name!r}: expected a shape that this method can avoid ({expected}), found {kind}"
            )
        found += [
            _outline(part, growth) @ _rotation(obstacle) + obstacle.trajectory.position(0.0) for part in polygonal
        ]
    return tuple(found)


def _outline(part: Part, growth: float) -> Array:
    radius = part.radius + growth
    if radius == 0.0:
        return part.corners
    import shapely

    plain = shapely.LineString(part.corners) if len(part.corners) == 2 else shapely.Polygon(part.corners)
    grown = shapely.buffer(plain, radius, cap_style="square", join_style="mitre", mitre_limit=MITRE_LIMIT)
    return np.asarray(shapely.get_coordinates(shapely.orient_polygons(grown))[:-1])


def _rotation(obstacle: Obstacle) -> Array:
    """Rotation (2, 2) from the body to the world frame, for row vectors, of an obstacle that does not turn."""
    x, y = obstacle.direction(0.0)
    return np.array([[x, y], [-y, x]])


def discs(obstacles: Iterable[Obstacle], now: float, growth: float = 0.0) -> Discs:
    """Round parts of the obstacles that exist at `now` [s], grown by their present uncertainty and `growth` [m]."""
    positions = []
    velocities = []
    radii = []
    for obstacle in obstacles:
        round_parts = [part for part in obstacle.shape.parts if len(part.corners) == 1]
        if not round_parts or not obstacle.exists(now):
            continue
        uncertainty = float(obstacle.uncertainty.radius(0.0, 2)) if obstacle.uncertainty else 0.0
        for part in round_parts:
            offset = part.corners[0] @ _rotation(obstacle) if np.any(part.corners) else 0.0
            positions.append(obstacle.trajectory.position(now) + offset)
            velocities.append(obstacle.trajectory.velocity(now))
            radii.append(part.radius + uncertainty + growth)
    return Discs(np.reshape(positions, (-1, 2)), np.reshape(velocities, (-1, 2)), np.array(radii, dtype=np.float64))
