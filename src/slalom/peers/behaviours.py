"""Behaviours of navground: ORCA, HRVO, human-like, social force."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from slalom.checks import Array, positive
from slalom.errors import InvalidInput
from slalom.peers.crowd import Discs, Team, imported, interaction_distances
from slalom.peers.surroundings import edges_of


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
        self._team, self._time_horizon, self._behaviours = team, positive(time_horizon, "time_horizon"), []
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
