"""Behaviours of navground: `Slalom` for one agent among others, `SlalomFleet` for agents that decide together.

navground finds both by the entry point group `navground_behaviors`; their properties can be set in YAML. Kinematics are
omnidirectional or of two driven wheels. The latter are controlled at a point `lead` [m] ahead of the axle, which can
move in every direction (input-output linearisation; Siciliano, Sciavicco, Villani and Oriolo, *Robotics*, Springer
2009, section 11.6). The margin of the disc about that point is larger by twice `lead`, once for each of two agents.

Neighbours have no identity in navground. A neighbour is a member of the fleet if its centre is within its radius of the
centre of a member. Discs that do not overlap are farther apart. All others are not expected to avoid the fleet.
"""

from typing import Any, Final

import numpy as np
from navground import core

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.fleet.fleet import Fleet
from slalom.limits import Limits
from slalom.methods import method
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.shape import Disc, Polyline
from slalom.trajectory import Stationary

TWO_WHEELS = "2WDiff"
"""Type of the kinematics of two driven wheels."""
HOLDS = (0.5, 1.0, 2.0)
"""[s] Hold times of manoeuvres. Agents of a fleet decide often, so three hold times are sufficient."""
REST = 1e-3
"""[m/s] An agent slower than this turns on the spot. Larger: it turns while it still brakes."""


class _Group:
    """Agents of a fleet. Their points are unwrapped: they do not jump to the other side of a periodic world."""

    def __init__(self) -> None:
        self.members: list[SlalomFleet] = []
        self._commands: list[core.Twist2] = []
        self._now, self._seen = 0.0, frozenset[Any]()
        self._settings: list[tuple[Any, ...]] = []
        self._fleet: Fleet | None = None
        self._planned = self._velocities = self._shift = np.empty((0, 2))
        self._walls = ObstacleTable([])

    def command(self, member: "SlalomFleet", dt: float) -> core.Twist2:
        """Twist of a member; all decide at the first call of a step."""
        if member is self.members[0]:
            self._commands = self._decide(self.members, dt)
        return self._commands[self.members.index(member)]

    def _decide(self, members: list["SlalomFleet"], dt: float) -> list[core.Twist2]:
        points = np.array([_point(m) for m in members])
        settings: list[tuple[Any, ...]] = [
            (m, dt, _speed(m), float(m.radius), float(m.safety_margin), str(m.values)) for m in members
        ]
        if self._fleet is None or settings != self._settings:
            self._settings, self._planned, self._shift = settings, points, np.zeros_like(points)
            self._velocities = np.array([m.velocity for m in members], dtype=np.float64)
            self._fleet = _fleet(members, dt)
        self._unwrap(points, members)
        points = points + self._shift
        others = self._others(members, dt)
        desired = np.array([_desired_velocity(m) for m in members])
        around: list[ObstacleTable | Tracks | Obstacle] = [*self._around(members), others]
        decided = self._fleet.step(self._now, points, self._velocities, desired_velocities=desired, others=around)
        self._now += dt
        self._planned, self._velocities = decided.positions, decided.velocities
        # The twist is held, so the agent moves by its mean velocity.
        means, speeds = (decided.positions - points) / dt, np.linalg.norm(decided.velocities, axis=1)
        return [
            _twist(m, mean) if np.any(wanted) or speed > REST else _turn(m, dt)
            for m, wanted, mean, speed in zip(members, desired, means, speeds)
        ]

    def _unwrap(self, points: Array, members: list["SlalomFleet"]) -> None:
        """Find where agents were moved to the other side of a world that repeats."""
        moved, period = self._planned - points - self._shift, np.asarray(members[0].world_period)
        jumped = np.linalg.norm(moved, axis=1) > [float(m.radius) for m in members]
        if np.any(period):
            self._shift = self._shift + _periods(moved, period)
        elif len(members) == 1 and jumped[0]:
            self._shift = self._shift + moved
        elif np.any(jumped):
            raise InvalidInput(
                "world_period: expected the period of the world, because an agent was moved by "
                f"{np.linalg.norm(moved, axis=1).max():g} m at once, found {period.tolist()}"
            )

    def _around(self, members: list["SlalomFleet"]) -> tuple[ObstacleTable, ...]:
        """Walls and discs at rest around the members."""
        states = [m.get_environment_state() for m in members]
        alone = self._shift[0] if len(members) == 1 else np.zeros(2)
        lines = {(*line.p1, *line.p2) for state in states for line in state.line_obstacles}
        discs = {(*disc.position, disc.radius) for state in states for disc in state.static_obstacles}
        seen = frozenset((tuple(alone), *lines, *discs))
        if seen != self._seen:
            walls = [Obstacle(Polyline([line[:2], line[2:]]), Stationary(alone)) for line in sorted(lines)]
            posts = [Obstacle(Disc(float(r)), Stationary(np.array((x, y)) + alone)) for x, y, r in sorted(discs)]
            self._seen, self._walls = seen, ObstacleTable([*walls, *posts])
        return (self._walls,) if len(self._walls) else ()

    def _others(self, members: list["SlalomFleet"], dt: float) -> Tracks:
        """Neighbours that are no members, each once."""
        period, alone = np.asarray(members[0].world_period, np.float64), len(members) == 1
        centers = np.array([m.position for m in members], np.float64)
        # navground renews what an agent observes just before it decides: the first one's is of this step.
        seen = [(bool(k), each) for k, m in enumerate(members) for each in m.get_environment_state().neighbors]
        places = np.array([each.position for _, each in seen], np.float64).reshape(-1, 2)
        offsets = places[:, None] - centers
        distances = np.linalg.norm(offsets - _periods(offsets, period), axis=2)
        found: list[tuple[Array, Array, float]] = []
        for j in np.flatnonzero(distances.min(axis=1, initial=np.inf) > [each.radius for _, each in seen]):
            before, each = seen[j]
            velocity = np.asarray(each.velocity, np.float64)
            place = places[j] + (dt * velocity if before else 0.0)
            offsets = np.reshape([place - other for other, _, _ in found], (-1, 2))
            if np.linalg.norm(offsets - _periods(offsets, period), axis=1).min(initial=np.inf) > each.radius:
                found.append((place, velocity, float(each.radius)))
        positions, velocities, radii = (np.array(column) for column in zip(*found)) if found else np.empty((3, 0, 2))
        return Tracks(positions + (self._shift[0] if alone else 0.0), velocities, radii if found else 0.0, self._now)


PROPERTIES: Final[dict[str, tuple[Any, str]]] = {
    "method": ("nao", "A method of several robots, see `slalom list methods`"),
    "max_acceleration": (1.0, "Largest acceleration [m/s^2]"),
    "time_horizon": (3.0, "Time up to which collisions count [s]"),
    "keep_right": (0.25, "Angle [rad] from the target to the desired velocity, to the right"),
    "lead": (0.02, "Distance of the controlled point ahead of the axle [m]"),
    "world_period": ([0.0, 0.0], "Period of a world that repeats [m], 0 where it does not"),
}
"""Registered properties with their default values and descriptions."""


def _registered(name: str) -> Any:
    default, text = PROPERTIES[name]
    kind = "vector" if isinstance(default, list) else type(default).__name__
    values = core.register(default, text, scalar_type_name=kind)(lambda self: self.values[name])
    return property(values, lambda self, value: self.values.update({name: value}))


class SlalomFleet(core.Behavior, name="SlalomFleet"):
    """An agent that decides together with all others of this behaviour that have the same `world_period`.

    navground 0.7 does not read the properties of members of its own groups of behaviours; hence `_Group`.
    """

    method, max_acceleration, time_horizon, keep_right, lead, world_period = map(_registered, PROPERTIES)

    def __init__(self, kinematics: core.Kinematics | None = None, radius: float = 0.0) -> None:
        self.values = {name: default for name, (default, _) in PROPERTIES.items()}
        self._state, self._group = core.GeometricState(), _Group()
        super().__init__(kinematics, radius)

    def get_environment_state(self) -> core.GeometricState:
        return self._state

    def prepare(self) -> None:
        self._group = _GROUPS.setdefault(tuple(self.world_period), _Group())
        self._group.members.append(self)

    def close(self) -> None:
        self._group.members.remove(self)
        if not self._group.members:
            _GROUPS.pop(tuple(self.world_period), None)

    def compute_cmd_internal(self, time_step: Any) -> core.Twist2:
        return self._group.command(self, float(time_step))


class Slalom(SlalomFleet, name="Slalom", include_properties_of=["SlalomFleet"]):
    """An agent that decides alone, and expects of no neighbour that it avoids the agent."""

    def prepare(self) -> None:
        self._group = _Group()
        self._group.members.append(self)


_GROUPS: dict[tuple[float, ...], _Group] = {}
"""Agents of the running world that decide together, by the period of the world."""


def _fleet(members: list[SlalomFleet], dt: float) -> Fleet:
    period = np.asarray(members[0].world_period)
    return Fleet(
        [method(m.method) for m in members],
        [Disc(float(m.radius)) for m in members],
        [Limits(_speed(m), m.max_acceleration) for m in members],
        period=dt,
        horizon=members[0].time_horizon,
        margin=[float(m.safety_margin) + 2.0 * _lead(m) for m in members],
        world_period=tuple(np.where(period > 0.0, period, np.inf).tolist()) if np.any(period) else None,
        holds=HOLDS,
    )


def _speed(member: SlalomFleet) -> float:
    """Largest speed [m/s]: that of the target, or the optimal one."""
    speed = member.optimal_speed if member.target.speed is None else member.target.speed
    return float(min(speed, member.kinematics.max_speed))


def _periods(offsets: Array, period: Array) -> Array:
    """Multiples of the period nearest to offsets (n, 2) [m]; 0 along axes without a period."""
    repeats = period > 0.0
    return np.where(repeats, period * np.round(offsets / np.where(repeats, period, 1.0)), 0.0)


def _lead(member: SlalomFleet) -> float:
    """Distance [m] of the controlled point ahead of the centre. Raises InvalidInput for other kinematics."""
    if member.kinematics.dof() == 3:
        return 0.0
    if member.kinematics.type != TWO_WHEELS:
        expected = f"omnidirectional ones or {TWO_WHEELS}"
        raise InvalidInput(f"kinematics: expected {expected}, found {member.kinematics.type}")
    return float(member.lead)


def _point(member: SlalomFleet) -> Array:
    """Controlled point (2,) [m]."""
    return np.asarray(np.asarray(member.position, np.float64) + _lead(member) * _axes(member)[0])


def _axes(member: SlalomFleet) -> Array:
    """Unit vectors (2, 2) ahead and to the left."""
    cosine, sine = np.cos(member.orientation), np.sin(member.orientation)
    return np.array([[cosine, sine], [-sine, cosine]])


def _desired_velocity(member: SlalomFleet) -> Array:
    """Velocity (2,) [m/s] towards the target, turned to the right; 0 for an agent that stops.

    It is longer by as much as the turn takes of its part towards the target.
    """
    target, way = member.target, np.zeros(2)
    if target.position is not None:
        offset = np.asarray(target.position, np.float64) - np.asarray(member.position, np.float64)
        way = offset if np.linalg.norm(offset) >= target.position_tolerance else way
    elif target.direction is not None:
        way = np.asarray(target.direction, np.float64)
    length, turn = float(np.linalg.norm(way)), np.tan(member.keep_right)
    return _speed(member) / length * np.array([way[0] + turn * way[1], way[1] - turn * way[0]]) if length else way


def _twist(member: SlalomFleet, velocity: Array) -> core.Twist2:
    """Twist that moves the controlled point at `velocity` (2,) [m/s]."""
    lead = _lead(member)
    if not lead:
        return member.feasible_twist(member.twist_towards_velocity(velocity))
    forward, sideways = _axes(member) @ velocity
    return member.feasible_twist(core.Twist2((forward, 0.0), sideways / lead, core.Frame.relative))


def _turn(member: SlalomFleet, dt: float) -> core.Twist2:
    """Twist of an agent at rest, which may turn to an orientation."""
    target = member.target
    speed = member.optimal_angular_speed if target.angular_speed is None else target.angular_speed
    if target.orientation is not None:
        return member.cmd_twist_towards_orientation(target.orientation, speed, dt)
    if target.orientation is None and target.angular_speed is not None:
        return member.cmd_twist_towards_angular_speed(speed, dt)
    return core.Twist2((0.0, 0.0), 0.0, core.Frame.relative)
