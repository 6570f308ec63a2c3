"""ORCA in RVO2, the library of its authors, through pyrvo."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from slalom.base.checks import Array, positive, whole
from slalom.base.errors import InvalidInput
from slalom.peers.crowd import Discs, Team, edges_of, imported, interaction_distances


class Rvo2:
    """Team in one RVO2 simulator (single precision). Other discs are agents in it that do not react.

    Robots consider the `neighbours` nearest agents that they could meet within `horizon` [s]. ORCA shares the avoidance
    with every one of them: with an agent that does not react, half of it is missing. Walls are avoided in full, within
    `wall_horizon` [s].

    Raises:
        InvalidInput: a horizon that is not above 0, no neighbour.
    """

    def __init__(self, team: Team, *, neighbours: int, horizon: float, wall_horizon: float) -> None:
        self._library = imported("pyrvo")
        self._team, self._neighbours = team, whole(neighbours, "neighbours", 1)
        self._horizon, self._wall_horizon = positive(horizon, "horizon"), positive(wall_horizon, "wall_horizon")
        self._radii = np.empty(0)
        self._simulator: Any = None

    def choose(self, positions: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        if self._simulator is None or not np.array_equal(others.radii, self._radii):
            self._begin(others.radii)
        simulator, n = self._simulator, len(positions)
        for k, (position, velocity) in enumerate(
            zip([*positions, *others.positions], [*velocities, *others.velocities])
        ):
            simulator.set_agent_position(k, tuple(position))
            simulator.set_agent_velocity(k, tuple(velocity))
        for k, (preferred_velocity, speed, distance) in enumerate(
            zip(preferred, self._team.max_speeds, interaction_distances(self._horizon, self._team, others))
        ):
            simulator.set_agent_pref_velocity(k, tuple(preferred_velocity))
            simulator.set_agent_max_speed(k, float(speed))
            simulator.set_agent_neighbor_dist(k, float(distance))
        simulator.do_step()
        return np.array([simulator.get_agent_velocity(k).to_tuple() for k in range(n)])

    def _begin(self, radii: Array) -> None:
        """Build a new simulator, because agents cannot be removed from one."""
        team = self._team
        horizon = self._horizon
        walls = self._wall_horizon
        simulator = self._library.RVOSimulator(team.period, 0.0, 0, horizon, walls, 0.0, 0.0)
        for radius, speed in zip(team.radii, team.max_speeds):
            simulator.add_agent((0.0, 0.0), 0.0, self._neighbours, horizon, walls, float(radius), float(speed))
        for radius in radii:
            simulator.add_agent((0.0, 0.0), 0.0, 0, horizon, walls, float(radius), 0.0)
        for wall in team.walls:
            simulator.add_obstacle([tuple(point) for point in wall])
        simulator.process_obstacles()
        self._simulator, self._radii = simulator, radii


# ---------------------------------------------------------------------------------------------------------------------
# Behaviours of navground: ORCA, HRVO, human-like, social force.


class Behaviours:
    """Team of robots with one navground behaviour each (single precision), of the registered `kind`.

    `time_horizon` [s] times max_speed is the horizon of navground, which is 5 m at any speed by default. `margin` [m]
    is the safety margin; `settings` are other properties of that kind. Other discs are neighbours like the rest of the
    team.

    A robot whose preferred velocity is 0 gets a stop target, because HRVO returns NaN for that velocity.

    Raises:
        InvalidInput: a setting that is not a property of the kind, because navground ignores unknown names; a time
            horizon that is not above 0.
    """

    def __init__(
        self,
        team: Team,
        kind: str,
        *,
        time_horizon: float,
        margin: float = 0.0,
        settings: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        self._library = library = imported("navground", "navground.core")
        known = library.Behavior.type_properties[kind]
        unknown = [name for name in settings if name not in known]
        if unknown:
            raise InvalidInput(f"setting of {kind}: expected one of {', '.join(sorted(known))}; found {unknown[0]!r}")
        self._team = team
        self._time_horizon = positive(time_horizon, "time_horizon")
        self._behaviours = []
        self._speeds = team.max_speeds.copy()
        for radius, speed in zip(team.radii, team.max_speeds):
            behaviour = library.Behavior.make_type(kind)
            behaviour.kinematics = library.kinematics.OmnidirectionalKinematics(float(speed))
            behaviour.radius, behaviour.optimal_speed = float(radius), float(speed)
            behaviour.horizon, behaviour.safety_margin = time_horizon * float(speed), margin
            for name, value in settings.items():
                behaviour.set(name, value)
            # The human-like behaviour sets its horizon in its first call, which always returns a velocity along x.
            behaviour.target = library.Target.Velocity((1.0, 0.0))
            behaviour.compute_cmd(team.period)
            self._behaviours.append(behaviour)
        edges = [edge for wall in team.walls for edge in edges_of(wall)]
        self._walls = [library.LineSegment(start, end) for start, end in edges]

    def choose(self, positions: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        library, period = self._library, self._team.period
        all_positions = np.concatenate([positions, others.positions])
        all_velocities = np.concatenate([velocities, others.velocities])
        radii = np.concatenate([self._team.radii, others.radii])
        neighbours = [
            library.Neighbor(p, float(r), v, k) for k, (p, r, v) in enumerate(zip(all_positions, radii, all_velocities))
        ]
        chosen = []
        for k, (behaviour, distance) in enumerate(
            zip(self._behaviours, interaction_distances(self._time_horizon, self._team, others))
        ):
            indices = np.flatnonzero(np.linalg.norm(all_positions - all_positions[k], axis=1) <= distance)
            behaviour.position, behaviour.velocity = positions[k], velocities[k]
            if self._team.max_speeds[k] != self._speeds[k]:
                speed = self._speeds[k] = self._team.max_speeds[k]
                behaviour.kinematics.max_speed = behaviour.optimal_speed = float(speed)
            # The command is not the motion of the robot: set the latter, from which the behaviour continues.
            behaviour.actuated_twist = library.Twist2(velocities[k], 0.0, library.Frame.absolute)
            preferred_velocity = preferred[k]
            behaviour.target = (
                library.Target.Velocity(preferred_velocity) if np.any(preferred_velocity) else library.Target.Stop()
            )
            # The human-like behaviour considers all directions except the one straight behind its orientation.
            behaviour.orientation = float(np.arctan2(preferred_velocity[1], preferred_velocity[0]))
            behaviour.environment_state.neighbors = [neighbours[j] for j in indices if j != k]
            # Set again: the behaviour drops obstacles that were out of range at its last call.
            behaviour.environment_state.line_obstacles = self._walls
            # Social force may take the root of a rounding error below 0, if one robot is straight ahead of another.
            with np.errstate(invalid="ignore", divide="ignore"):
                chosen.append(behaviour.compute_cmd(period, library.Frame.absolute).velocity)
        return np.array(chosen, dtype=np.float64)
