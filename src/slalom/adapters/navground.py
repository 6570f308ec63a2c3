"""Behaviours of navground: `Slalom` for one agent among others, `SlalomFleet` for agents that decide together.

Their properties can be set in YAML. Kinematics are omnidirectional or of two driven wheels. The disc about the
controlled point is larger than the agent by the distance of the point from the centre and by the error of following.
Neighbours that are no members of the fleet are not expected to avoid it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import atan2, cos, hypot, sin
from typing import Any, ClassVar, Final, Literal, NamedTuple

import numpy as np

from slalom import kernels
from slalom.base.checks import Array, positive
from slalom.base.errors import Extra, InvalidInput
from slalom.base.tolerances import BRAKING_SHARE
from slalom.decision.methods import method
from slalom.fleet.fleet import Fleet
from slalom.model.bounds import HalfSpaces, axes, ball_sides
from slalom.model.limits import Limits
from slalom.model.shape import Disc, Polyline
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks

with Extra("navground", __name__):
    from navground import core

__all__ = ["PROPERTIES", "Slalom", "SlalomFleet"]

# Numerical constants of the adapter for navground.


RAMP = 0.3
"""[s] in which an agent reaches its speed, unless its acceleration is given. Larger: slower reactions. Smaller: fleets
that only observe each other keep wider margins."""
LEAD_SHARE = 0.1
"""[1] Distance of the controlled point ahead of the axle as a share of the distance of the wheels. Larger: the point
moves sideways at a larger speed, and the body is grown by more."""
OVERSPEED = 1.1
"""[1] Planned speeds of wheels as a share of those permitted. Larger: plans turn more at once, and the body is grown by
the part that wheels do not follow. 1: they follow all plans."""
ARC_RESERVE = 1.005
"""[1] Speeds of wheels on an arc as a share of those of the straight displacement to the same end. Smaller: wheels
would not follow some displacements exactly. The largest share found is 1.0048, for points 0.1 of the track ahead."""
HOLDS = (0.2, 0.5)
"""[s] Hold times of manoeuvres. Agents of a fleet decide often, so two hold times are sufficient."""
AT_REST = 1e-3
"""[m/s] An agent slower than this turns on the spot. Larger: it turns while it still brakes."""


# The motion that two driven wheels can give to a point ahead of their axle (input-output linearisation).
#
# The point moves in every direction (Siciliano, Sciavicco, Villani and Oriolo, *Robotics*, Springer 2009, section
# 11.6).


@dataclass(frozen=True)
class PointAhead:
    """Velocities that the point `lead` [m] ahead can keep while the body turns towards them: a bound of `Limits`.

    Wheels `track` [m] apart that reach `max_wheel_speed` [m/s] permit |v_x| + k |v_y| <= max_wheel_speed, x ahead, with
    k = track / (2 lead). While the point keeps a velocity, the body turns until x is along it. The left side is largest
    where k is the tangent of the angle between both. A velocity can thus be kept if it is in the hull of two sets: the
    right half of the disc about 0 with the radius max_wheel_speed / hypot(1, k), and the largest velocity ahead.
    Backwards there is none. Wheels may be planned OVERSPEED times as fast, see `tracking_error`. Two chords replace the
    arcs.

    Raises:
        InvalidInput: a value that is not above 0.
    """

    of: ClassVar[Literal["velocity"]] = "velocity"
    braking: ClassVar[float] = np.inf
    lead: float
    track: float
    max_wheel_speed: float

    def __post_init__(self) -> None:
        for name in ("lead", "track", "max_wheel_speed"):
            positive(getattr(self, name), name)

    @cached_property
    def _sides(self) -> HalfSpaces:
        """Half-spaces in the body frame: the two tangents from the largest velocity, two chords, none backwards."""
        k, fastest = 0.5 * self.track / self.lead, self.max_wheel_speed * OVERSPEED / ARC_RESERVE
        begin, radius = float(np.arctan(k)), fastest / hypot(1.0, k)
        half = 0.5 * (0.5 * np.pi - begin)
        angles = np.array([begin, -begin, begin + half, -begin - half, np.pi])
        offsets = radius * np.array([1.0, 1.0, np.cos(half), np.cos(half), 0.0])
        return np.stack([np.cos(angles), np.sin(angles)], axis=1), offsets

    def half_spaces(self, state: State) -> HalfSpaces:
        normals, offsets = self._sides
        frame = axes(state)
        return ball_sides(float(offsets[2]), 2) if frame is None else (normals @ frame, offsets)

    def tracking_error(self, period: float) -> float:
        """Largest distance [m] of the point from its plan after a `period` [s], with velocities within the bound.

        Where planned wheels are too fast, the kinematics of navground reduce the speed ahead by no more than that.
        """
        return (OVERSPEED - 1.0) * self.max_wheel_speed * period


def arc_of(displacement: Array, lead: float) -> tuple[float, float]:
    """Length [m] of the arc of the axle, and its angle [rad], that displace the point by (2,) [m] in the body frame.

    The change of the direction to the point is across the mean heading, at half the angle: 2 lead sin(angle / 2). The
    chord of the arc is along it. `displacement` is above -2 lead ahead.
    """
    x, y = displacement.tolist()
    half = atan2(y, 2.0 * lead + x)
    chord = x * cos(half) + y * sin(half)
    return chord / float(np.sinc(half / np.pi)), 2.0 * half


# One agent of navground: the point that it controls, the velocity that it desires, and twists that move the point.
#
# An agent of two driven wheels is controlled at a point ahead of the axle, see `PointAhead`.


TWO_WHEELS = "2WDiff"
"""Type of the kinematics of two driven wheels."""


class Motion(NamedTuple):
    """Limits of the motion of an agent, for its centre or for a point ahead, about which it is larger."""

    lead: float  # [m] of the controlled point ahead of the centre
    limits: Limits  # of the point
    growth: float  # [m] of the body about the point


def speed_of(member: SlalomFleet) -> float:
    """Desired speed [m/s]: that of the target, or the optimal one."""
    speed = member.optimal_speed if member.target.speed is None else member.target.speed
    return float(min(speed, member.kinematics.max_speed))


def motion_of(member: SlalomFleet, period: float) -> Motion:
    """Limits of the motion of an agent, with decisions every `period` [s].

    The body is grown by the lead, by the error of following, and by the error of the motion within a period. That is
    the distance between the plan, with constant acceleration, and the motion by a constant twist.

    Raises:
        InvalidInput: kinematics that are neither omnidirectional nor of two driven wheels.
    """
    kinematics: Any = member.kinematics  # of two wheels: with an axis
    fastest = float(kinematics.max_speed)
    acceleration = float(member.max_acceleration) or min(speed_of(member), fastest) / RAMP
    within = acceleration * period * period / 8.0
    if kinematics.dof() == 3:
        return Motion(0.0, Limits(fastest, acceleration), within)
    if kinematics.type != TWO_WHEELS:
        expected = f"omnidirectional ones or {TWO_WHEELS}"
        raise InvalidInput(f"kinematics: expected {expected}, found {kinematics.type}")
    track = float(kinematics.wheel_axis)
    bound = PointAhead(float(member.lead) or LEAD_SHARE * track, track, fastest)
    limits = Limits(fastest, acceleration, bounds=(bound,))
    return Motion(bound.lead, limits, bound.lead + bound.tracking_error(period) + within)


def point_of(member: SlalomFleet, lead: float) -> Array:
    """Controlled point (2,) [m]."""
    return np.asarray(np.asarray(member.position, np.float64) + lead * _axes(member)[0])


def _axes(member: SlalomFleet) -> Array:
    """Unit vectors (2, 2) ahead and to the left."""
    cosine, sine = np.cos(member.orientation), np.sin(member.orientation)
    return np.array([[cosine, sine], [-sine, cosine]])


def desired_velocity(member: SlalomFleet, velocity: Array, step: float, braking: float) -> Array:
    """Velocity (2,) [m/s] towards the target, turned to the right; 0 for an agent that stops.

    It is longer by as much as the turn takes of its part towards the target. Near a place it is the velocity to have
    after `step` [s], from which the agent comes to rest there, see `slalom.Goal.desired_velocity`.

    Args:
        velocity: (2,) [m/s] of the controlled point. braking: [m/s^2] by which it may stop.
    """
    target, way = member.target, np.zeros(2)
    if target.position is not None:
        offset = np.asarray(target.position, np.float64) - np.asarray(member.position, np.float64)
        left = offset - 0.5 * step * velocity
        distance = float(np.linalg.norm(left))
        speed = float(kernels.stopping_speed(distance, step, BRAKING_SHARE * braking))
        if speed < speed_of(member):
            within = np.linalg.norm(offset) < target.position_tolerance and distance < target.position_tolerance
            return np.zeros(2) if within else left * (speed / distance)
        way = offset if np.linalg.norm(offset) >= target.position_tolerance else way
    elif target.direction is not None:
        way = np.asarray(target.direction, np.float64)
    length, turn = float(np.linalg.norm(way)), np.tan(member.keep_right)
    return speed_of(member) / length * np.array([way[0] + turn * way[1], way[1] - turn * way[0]]) if length else way


def twist(member: SlalomFleet, velocity: Array, lead: float, dt: float) -> core.Twist2:
    """Twist of the next `dt` [s] that displaces the controlled point by `dt` times `velocity` (2,) [m/s]."""
    if not lead:
        wanted = member.twist_towards_velocity(velocity)
        # The twist is held in the frame of the body: about the mean heading the displacement is the wanted one.
        half = 0.5 * dt * wanted.angular_speed
        cosine, sine = np.cos(half), np.sin(half)
        x, y = _axes(member) @ velocity / float(np.sinc(half / np.pi))
        turned = (float(cosine * x + sine * y), float(cosine * y - sine * x))
        return member.feasible_twist(core.Twist2(turned, wanted.angular_speed, core.Frame.relative))
    length, angle = arc_of(dt * (_axes(member) @ velocity), lead)
    return member.feasible_twist(core.Twist2((length / dt, 0.0), angle / dt, core.Frame.relative))


def turn(member: SlalomFleet, dt: float) -> core.Twist2:
    """Twist of an agent at rest, which may turn to an orientation."""
    target = member.target
    speed = member.optimal_angular_speed if target.angular_speed is None else target.angular_speed
    if target.orientation is not None:
        return member.cmd_twist_towards_orientation(target.orientation, speed, dt)
    if target.orientation is None and target.angular_speed is not None:
        return member.cmd_twist_towards_angular_speed(speed, dt)
    return core.Twist2((0.0, 0.0), 0.0, core.Frame.relative)


# What agents of navground observe: walls and discs at rest, and neighbours that are no members of their fleet.
#
# Neighbours have no identity in navground. A neighbour is a member of the fleet if its centre is within its radius of
# the centre of a member: discs that do not overlap are farther apart.


class AtRest:
    """Walls and discs at rest that agents know. The table is made anew when these change."""

    def __init__(self) -> None:
        self._seen, self._table = frozenset[Any](), ObstacleTable([])

    def table(self, members: Sequence[SlalomFleet], shift: Array) -> tuple[ObstacleTable, ...]:
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


def neighbours(members: Sequence[SlalomFleet], shift: Array, now: float, dt: float) -> Tracks:
    """Neighbours at `now` [s] that are no members, each once, displaced by `shift` (2,) [m].

    navground renews what an agent observes just before it decides. So the first agent observes this step, and the
    others the one before, which lasted `dt` [s].
    """
    centers = np.array([m.position for m in members], np.float64)
    seen = [(k > 0, each) for k, m in enumerate(members) for each in m.get_environment_state().neighbors]
    places = np.array([each.position for _, each in seen], np.float64).reshape(-1, 2)
    distances = np.linalg.norm(places[:, None] - centers, axis=2)
    found: list[tuple[Array, Array, float]] = []
    for j in np.flatnonzero(distances.min(axis=1, initial=np.inf) > [each.radius for _, each in seen]):
        before, each = seen[j]
        velocity = np.asarray(each.velocity, np.float64)
        place = places[j] + (dt * velocity if before else 0.0)
        offsets = np.reshape([place - other for other, _, _ in found], (-1, 2))
        if np.linalg.norm(offsets, axis=1).min(initial=np.inf) > each.radius:
            found.append((place, velocity, float(each.radius)))
    positions, velocities, radii = (np.array(column) for column in zip(*found)) if found else np.empty((3, 0, 2))
    return Tracks(positions + shift, velocities, radii if found else 0.0, now)


class Group:
    """Agents of a fleet. Of a single agent the points are unwrapped: no jump to the other side of a lattice."""

    def __init__(self) -> None:
        self.members: list[SlalomFleet] = []
        self._commands: list[core.Twist2] = []
        self._now, self._at_rest = 0.0, AtRest()
        self._settings: list[tuple[Any, ...]] = []
        self._fleet: Fleet | None = None
        self._motions: list[Motion] = []
        self._planned = self._velocities = self._shift = np.empty((0, 2))

    def command(self, member: SlalomFleet, dt: float) -> core.Twist2:
        """Twist of a member; all decide when the first is asked."""
        if member is self.members[0]:
            self._commands = self._decide(self.members, dt)
        return self._commands[self.members.index(member)]

    def _decide(self, members: list[SlalomFleet], dt: float) -> list[core.Twist2]:
        settings: list[tuple[Any, ...]] = [
            (m, dt, speed_of(m), float(m.radius), float(m.safety_margin), *m.values.values()) for m in members
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

    def _unwrap(self, points: Array, members: list[SlalomFleet]) -> None:
        """Find where the agent was moved to the other side of a lattice; raises InvalidInput among several."""
        moved = self._planned - points - self._shift
        jumped = np.linalg.norm(moved, axis=1) > [float(m.radius) for m in members]
        if len(members) == 1 and jumped[0]:
            self._shift = self._shift + moved
        elif np.any(jumped):
            raise InvalidInput(
                "SlalomFleet: expected a world that does not repeat (use Slalom in a lattice), "
                f"found an agent that was moved by {np.linalg.norm(moved, axis=1).max():g} m at once"
            )


def _fleet(members: list[SlalomFleet], motions: list[Motion], dt: float) -> Fleet:
    """Bodies are grown, not margins: a margin is given up where no manoeuvre keeps it, a body is not."""
    return Fleet(
        [method(m.method) for m in members],
        [Disc(float(m.radius) + motion.growth) for m, motion in zip(members, motions)],
        [motion.limits for motion in motions],
        period=dt,
        horizon=members[0].time_horizon,
        margin=[max(float(m.safety_margin) - 2.0 * motion.growth, 0.0) for m, motion in zip(members, motions)],
        holds=HOLDS,
        guided=False,
    )


# Behaviours of navground, which finds them by the entry point group `navground_behaviors`.


PROPERTIES: Final[dict[str, tuple[Any, str]]] = {
    "method": ("nao", "A method of several robots, see `slalom list methods`"),
    "max_acceleration": (0.0, "Largest acceleration [m/s^2]; 0: the desired speed within 0.3 s"),
    "time_horizon": (3.0, "Time up to which collisions count [s]"),
    "keep_right": (0.25, "Angle [rad] from the target to the desired velocity, to the right"),
    "lead": (0.0, "Distance of the controlled point ahead of the axle [m]; 0: a tenth of that of the wheels"),
}
"""Registered properties with their default values and descriptions."""


def _registered(name: str) -> Any:
    default, text = PROPERTIES[name]
    values = core.register(default, text, scalar_type_name=type(default).__name__)(lambda self: self.values[name])
    return property(values, lambda self, value: self.values.update({name: value}))


class SlalomFleet(core.Behavior, name="SlalomFleet"):
    """An agent that decides together with all others of this behaviour.

    navground 0.7 does not read the properties of members of its own groups of behaviours; hence `Group`.
    """

    method, max_acceleration, time_horizon, keep_right, lead = map(_registered, PROPERTIES)

    def __init__(self, kinematics: core.Kinematics | None = None, radius: float = 0.0) -> None:
        self.values = {name: default for name, (default, _) in PROPERTIES.items()}
        self._state, self._group = core.GeometricState(), Group()
        super().__init__(kinematics, radius)

    def get_environment_state(self) -> core.GeometricState:
        return self._state

    def prepare(self) -> None:
        self._group = _TOGETHER
        self._group.members.append(self)

    def close(self) -> None:
        self._group.members.remove(self)

    def compute_cmd_internal(self, time_step: Any) -> core.Twist2:
        return self._group.command(self, float(time_step))


class Slalom(SlalomFleet, name="Slalom", include_properties_of=["SlalomFleet"]):
    """An agent that decides alone, and expects of no neighbour that it avoids the agent."""

    def prepare(self) -> None:
        self._group = Group()
        self._group.members.append(self)


_TOGETHER = Group()
"""Agents of the running world that decide together."""
