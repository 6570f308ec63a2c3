"""Agents that decide together when the first of them is asked."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from navground import core

from slalom.adapters.navground.agent import (
    AT_REST,
    HOLDS,
    Agent,
    Motion,
    desired_velocity,
    motion_of,
    point_of,
    speed_of,
    turn,
    twist,
)
from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.decision.methods import method
from slalom.fleet.fleet import Fleet
from slalom.model.shape import Disc, Polyline
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks

# ---------------------------------------------------------------------------------------------------------------------
# A world that repeats.


def periods(offsets: Array, period: Array) -> Array:
    """Multiples of the period nearest to offsets (n, 2) [m]; 0 along axes without a period."""
    repeats = period > 0.0
    return np.where(repeats, period * np.round(offsets / np.where(repeats, period, 1.0)), 0.0)


# ---------------------------------------------------------------------------------------------------------------------
# What agents of navground observe: walls and discs at rest, and neighbours that are no members of their fleet.
#
# Neighbours have no identity in navground. A neighbour is a member of the fleet if its centre is within its radius of
# the centre of a member: discs that do not overlap are farther apart.


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


# ---------------------------------------------------------------------------------------------------------------------
# Agents that decide together when the first of them is asked.


class Group:
    """Agents of a fleet. Their points are unwrapped: they do not jump to the other side of a periodic world."""

    def __init__(self) -> None:
        self.members: list[Agent] = []
        self._commands: list[core.Twist2] = []
        self._now, self._at_rest = 0.0, AtRest()
        self._settings: list[tuple[Any, ...]] = []
        self._fleet: Fleet | None = None
        self._motions: list[Motion] = []
        self._planned = self._velocities = self._shift = np.empty((0, 2))

    def command(self, member: Agent, dt: float) -> core.Twist2:
        """Twist of a member; all decide when the first is asked."""
        if member is self.members[0]:
            self._commands = self._decide(self.members, dt)
        return self._commands[self.members.index(member)]

    def _decide(self, members: list[Agent], dt: float) -> list[core.Twist2]:
        settings: list[tuple[Any, ...]] = [
            (m, dt, speed_of(m), float(m.radius), float(m.safety_margin), *map(_comparable, m.values.values()))
            for m in members
        ]
        renewed = self._fleet is None or settings != self._settings
        if renewed:
            self._motions = [motion_of(m, dt) for m in members]
        points = np.array([point_of(m, motion.lead) for m, motion in zip(members, self._motions)])
        if self._fleet is None or renewed:
            self._settings = settings
            self._planned = points
            self._shift = np.zeros_like(points)
            self._velocities = np.array([m.velocity for m in members], dtype=np.float64)
            self._fleet = _fleet(members, self._motions, dt)
        self._unwrap(points, members)
        points = points + self._shift
        # One agent alone is unwrapped in a world that repeats; of several, the period is known.
        alone = self._shift[0] if len(members) == 1 else np.zeros(2)
        desired = np.array(
            [
                desired_velocity(m, velocity, self._fleet.navigator.holds[0], motion.limits.braking)
                for m, velocity, motion in zip(members, self._velocities, self._motions)
            ]
        )
        around: list[ObstacleTable | Tracks | Obstacle] = [
            *self._at_rest.table(members, alone),
            neighbours(members, alone, self._now, dt),
        ]
        headings = [float(m.orientation) for m in members]
        decided = self._fleet.step(
            self._now, points, self._velocities, desired_velocities=desired, headings=headings, others=around
        )
        self._now += dt
        self._planned, self._velocities = decided.positions, decided.velocities
        # The twist is held, so the agent moves by its mean velocity.
        means = (decided.positions - points) / dt
        return [
            twist(m, mean, motion.lead, dt) if np.any(wanted) or np.linalg.norm(mean) > AT_REST else turn(m, dt)
            for m, wanted, mean, motion in zip(members, desired, means, self._motions)
        ]

    def _unwrap(self, points: Array, members: list[Agent]) -> None:
        """Find where agents were moved to the other side of a world that repeats."""
        moved, period = self._planned - points - self._shift, np.asarray(members[0].world_period)
        jumped = np.linalg.norm(moved, axis=1) > [float(m.radius) for m in members]
        if np.any(period):
            self._shift = self._shift + periods(moved, period)
        elif len(members) == 1 and jumped[0]:
            self._shift = self._shift + moved
        elif np.any(jumped):
            raise InvalidInput(
                "world_period: expected the period of the world, because an agent was moved by "
                f"{np.linalg.norm(moved, axis=1).max():g} m at once, found {period.tolist()}"
            )


def _comparable(value: Any) -> Any:
    """The value of a property; that of a vector as a tuple."""
    return tuple(np.asarray(value).tolist()) if np.ndim(value) else value


def _fleet(members: list[Agent], motions: list[Motion], dt: float) -> Fleet:
    """Bodies are grown, not margins: a margin is given up where no manoeuvre keeps it, a body is not."""
    period = np.asarray(members[0].world_period)
    return Fleet(
        [method(m.method) for m in members],
        [Disc(float(m.radius) + motion.growth) for m, motion in zip(members, motions)],
        [motion.limits for motion in motions],
        period=dt,
        horizon=members[0].time_horizon,
        margin=[max(float(m.safety_margin) - 2.0 * motion.growth, 0.0) for m, motion in zip(members, motions)],
        world_period=tuple(np.where(period > 0.0, period, np.inf).tolist()) if np.any(period) else None,
        holds=HOLDS,
        guided=False,
    )
