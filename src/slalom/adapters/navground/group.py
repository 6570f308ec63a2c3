"""Agents that decide together when the first of them is asked."""

from typing import Any

import numpy as np
from navground import core

from slalom.adapters.navground import tune
from slalom.adapters.navground.agent import Agent, desired_velocity, lead_of, point_of, speed_of, turn, twist
from slalom.adapters.navground.surroundings import AtRest, neighbours
from slalom.adapters.navground.wheels import PointAhead
from slalom.adapters.navground.world import periods
from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.fleet.fleet import Fleet
from slalom.limits import Limits
from slalom.methods import method
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.shape import Disc

HOLDS = (0.2, 0.5)
"""[s] Hold times of manoeuvres. Agents of a fleet decide often, so two hold times are sufficient."""
REST = 1e-3
"""[m/s] An agent slower than this turns on the spot. Larger: it turns while it still brakes."""


class Group:
    """Agents of a fleet. Their points are unwrapped: they do not jump to the other side of a periodic world."""

    def __init__(self) -> None:
        self.members: list[Agent] = []
        self._commands: list[core.Twist2] = []
        self._now, self._at_rest = 0.0, AtRest()
        self._settings: list[tuple[Any, ...]] = []
        self._fleet: Fleet | None = None
        self._planned = self._velocities = self._shift = np.empty((0, 2))

    def command(self, member: Agent, dt: float) -> core.Twist2:
        """Twist of a member; all decide when the first is asked."""
        if member is self.members[0]:
            self._commands = self._decide(self.members, dt)
        return self._commands[self.members.index(member)]

    def _decide(self, members: list[Agent], dt: float) -> list[core.Twist2]:
        points = np.array([point_of(m) for m in members])
        settings: list[tuple[Any, ...]] = [
            (m, dt, speed_of(m), float(m.radius), float(m.safety_margin), str(m.values)) for m in members
        ]
        if self._fleet is None or settings != self._settings:
            self._settings, self._planned, self._shift = settings, points, np.zeros_like(points)
            self._velocities = np.array([m.velocity for m in members], dtype=np.float64)
            self._fleet = _fleet(members, dt)
        self._unwrap(points, members)
        if tune.log is not None:
            tune.log.append(np.linalg.norm(self._planned - points - self._shift, axis=1))
        points = points + self._shift
        # One agent alone is unwrapped in a world that repeats; of several, the period is known.
        alone = self._shift[0] if len(members) == 1 else np.zeros(2)
        desired = np.array([desired_velocity(m) for m in members])
        around: list[ObstacleTable | Tracks | Obstacle] = [
            *self._at_rest.table(members, alone),
            neighbours(members, alone, self._now, dt),
        ]
        if tune.obj == "vel":
            decided = self._fleet.step(self._now, points, self._velocities, desired_velocities=desired, others=around, headings=[m.orientation for m in members])
        else:
            targets, tol, stop = zip(*[_target(m, p, d, dt) for m, p, d in zip(members, points, desired)])
            decided = self._fleet.step(
                self._now, points, self._velocities, np.array(targets), tolerances=np.array(tol), stop=np.array(stop), others=around
            )
        self._now += dt
        self._planned, self._velocities = decided.positions, decided.velocities
        # The twist is held, so the agent moves by its mean velocity.
        means, speeds = (decided.positions - points) / dt, np.linalg.norm(decided.velocities, axis=1)
        return [
            twist(m, mean, dt) if np.any(wanted) or np.linalg.norm(mean) > REST else turn(m, dt)
            for m, wanted, mean, speed in zip(members, desired, means, speeds)
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


def _bounds(m):
    lead = lead_of(m)
    return (PointAhead(lead, m.kinematics.wheel_axis, m.kinematics.max_speed),) if lead and tune.cone else ()


def top(m):
    return speed_of(m) if tune.maxspeed == "target" else min(float(m.kinematics.max_speed), tune.maxspeed * speed_of(m))


def _target(m, p, d, dt):
    speed = np.linalg.norm(d)
    if speed == 0.0:
        return p, 0.02, True
    if m.target.position is not None:
        off = float(np.linalg.norm(np.asarray(m.target.position) - np.asarray(m.position)))
        return p + d / speed * off, m.target.position_tolerance, tune.pos_stop
    return p + d / speed * tune.far * float(m.radius), 0.1, False


def _fleet(members: list[Agent], dt: float) -> Fleet:
    period = np.asarray(members[0].world_period)
    return Fleet(
        [method(m.method) for m in members],
        [Disc(float(m.radius)) for m in members],
        [Limits(top(m), m.max_acceleration if tune.acc_tau is None else speed_of(m) / tune.acc_tau, bounds=_bounds(m)) for m in members],
        period=dt,
        horizon=members[0].time_horizon,
        margin=[max(float(m.safety_margin), 2.0 * lead_of(m)) if tune.lead_margin is None else float(m.safety_margin) + tune.lead_margin * lead_of(m) for m in members],
        patience=tune.patience,
        **({} if tune.detours is None else dict(detours=tune.detours)),
        world_period=tuple(np.where(period > 0.0, period, np.inf).tolist()) if np.any(period) else None,
        holds=HOLDS,
    )
