"""The behaviours of navground: ORCA, HRVO, human-like, social force."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.peers.crowd import Discs, Team, imported, interaction_distances


class Behaviours:
    """A team of robots with one navground behaviour each (single precision), of the registered `kind`.

    `sight` [s] is the horizon, as the time that a robot at top speed takes for it (navground's is 5 m at any speed);
    `margin` [m] the safety margin; `settings` are other properties of that kind. Others are neighbours like the rest
    of the team.

    A robot whose preferred velocity is 0 is told to stop: HRVO's answer to such a wish is not a number.

    Raises:
        InvalidInput: a setting that is not a property of the kind: navground itself takes any name and forgets it.
    """

    def __init__(
        self,
        team: Team,
        kind: str,
        *,
        horizon: float,
        margin: float = 0.0,
        settings: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        self._library = library = imported("navground", "navground.core")
        known = library.Behavior.type_properties[kind]
        unknown = [name for name in settings if name not in known]
        if unknown:
            raise InvalidInput(f"setting of {kind}: expected one of {', '.join(sorted(known))}; found {unknown[0]!r}")
        self._team, self._sight, self._behaviours = team, horizon, []
        for radius, speed in zip(team.radii, team.max_speeds):
            behaviour = library.Behavior.make_type(kind)
            behaviour.kinematics = library.kinematics.OmnidirectionalKinematics(float(speed))
            behaviour.radius, behaviour.optimal_speed = float(radius), float(speed)
            behaviour.horizon, behaviour.safety_margin = horizon * float(speed), margin
            for name, value in settings.items():
                behaviour.set(name, value)
            # The human-like one sets its horizon while it answers: the first answer to a velocity is always along x.
            behaviour.target = library.Target.Velocity((1.0, 0.0))
            behaviour.compute_cmd(team.period)
            self._behaviours.append(behaviour)
        edges = [edge for wall in team.walls for edge in _edges(wall)]
        self._walls = [library.LineSegment(start, end) for start, end in edges]

    def choose(self, places: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        library, period = self._library, self._team.period
        at = np.concatenate([places, others.positions])
        moving = np.concatenate([velocities, others.velocities])
        radii = np.concatenate([self._team.radii, others.radii])
        everybody = [library.Neighbor(p, float(r), v, k) for k, (p, r, v) in enumerate(zip(at, radii, moving))]
        chosen = []
        for k, (behaviour, away) in enumerate(
            zip(self._behaviours, interaction_distances(self._sight, self._team, others))
        ):
            near = np.flatnonzero(np.linalg.norm(at - at[k], axis=1) <= away)
            behaviour.position, behaviour.velocity = places[k], velocities[k]
            # What it commanded is not what the robot did: it goes on from that.
            behaviour.actuated_twist = library.Twist2(velocities[k], 0.0, library.Frame.absolute)
            wish = preferred[k]
            behaviour.target = library.Target.Velocity(wish) if np.any(wish) else library.Target.Stop()
            # The human-like behaviour looks all around, but for the very direction behind it.
            behaviour.orientation = float(np.arctan2(wish[1], wish[0]))
            behaviour.environment_state.neighbors = [everybody[j] for j in near if j != k]
            # Told anew: of what it was told before it forgets what was out of its sight then.
            behaviour.environment_state.line_obstacles = self._walls
            # Social force may take the root of what rounding made negative, if one robot is just ahead of another.
            with np.errstate(invalid="ignore", divide="ignore"):
                chosen.append(behaviour.compute_cmd(period, library.Frame.absolute).velocity)
        return np.array(chosen, dtype=np.float64)


def _edges(outline: Array) -> list[tuple[Array, Array]]:
    """Its sides: one of a line, as many as corners of a polygon."""
    if len(outline) == 2:
        return [(outline[0], outline[1])]
    return list(zip(outline, np.roll(outline, -1, axis=0)))
