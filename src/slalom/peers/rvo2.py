"""ORCA in RVO2, the library of its authors, through pyrvo."""

from typing import Any

import numpy as np

from slalom.checks import Array, positive, whole
from slalom.peers.crowd import Discs, Team, imported, interaction_distances


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
        team, horizon, walls = self._team, self._horizon, self._wall_horizon
        simulator = self._library.RVOSimulator(team.period, 0.0, 0, horizon, walls, 0.0, 0.0)
        for radius, speed in zip(team.radii, team.max_speeds):
            simulator.add_agent((0.0, 0.0), 0.0, self._neighbours, horizon, walls, float(radius), float(speed))
        for radius in radii:
            simulator.add_agent((0.0, 0.0), 0.0, 0, horizon, walls, float(radius), 0.0)
        for wall in team.walls:
            simulator.add_obstacle([tuple(point) for point in wall])
        simulator.process_obstacles()
        self._simulator, self._radii = simulator, radii
