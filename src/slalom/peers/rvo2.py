"""ORCA in RVO2, the library of its authors, through pyrvo."""

from typing import Any

import numpy as np

from slalom.checks import Array
from slalom.peers.crowd import Discs, Team, imported, interaction_distances


class Rvo2:
    """A team in one RVO2 simulator (single precision). Others are agents in it that do not answer.

    Of each other and of the others, robots see the `neighbours` nearest that they could meet within `horizon` [s], and
    ORCA shares the work with every one of them: with one that does not answer half of it is left undone. Walls are
    avoided alone, over the same horizon.
    """

    def __init__(self, team: Team, *, neighbours: int, horizon: float) -> None:
        self._library = imported("pyrvo")
        self._team, self._neighbours, self._horizon = team, neighbours, horizon
        self._radii = np.empty(0)
        self._simulator: Any = None

    def choose(self, places: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        if self._simulator is None or not np.array_equal(others.radii, self._radii):
            self._begin(others.radii)
        simulator, n = self._simulator, len(places)
        for k, (place, velocity) in enumerate(zip([*places, *others.positions], [*velocities, *others.velocities])):
            simulator.set_agent_position(k, tuple(place))
            simulator.set_agent_velocity(k, tuple(velocity))
        for k, (wish, away) in enumerate(zip(preferred, interaction_distances(self._horizon, self._team, others))):
            simulator.set_agent_pref_velocity(k, tuple(wish))
            simulator.set_agent_neighbor_dist(k, float(away))
        simulator.do_step()
        return np.array([simulator.get_agent_velocity(k).to_tuple() for k in range(n)])

    def _begin(self, radii: Array) -> None:
        """A new simulator: agents cannot be taken out of one."""
        team, horizon = self._team, self._horizon
        simulator = self._library.RVOSimulator(team.period, 0.0, 0, horizon, horizon, 0.0, 0.0)
        for radius, speed in zip(team.radii, team.max_speeds):
            simulator.add_agent((0.0, 0.0), 0.0, self._neighbours, horizon, horizon, float(radius), float(speed))
        for radius in radii:
            simulator.add_agent((0.0, 0.0), 0.0, 0, horizon, horizon, float(radius), 0.0)
        for wall in team.walls:
            simulator.add_obstacle([tuple(point) for point in wall])
        simulator.process_obstacles()
        self._simulator, self._radii = simulator, radii
