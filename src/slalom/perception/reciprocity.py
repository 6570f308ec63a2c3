"""Estimate of how much other agents yield, from what they were seen to do."""

from collections.abc import Hashable
from dataclasses import KW_ONLY, dataclass, field
from typing import Any

import numpy as np

from slalom.base.checks import STATE, TRACKS, Array, NotNegative, Positive, check_fields, has, not_before
from slalom.model.state import State
from slalom.obstacle.table import same_dimension
from slalom.obstacle.tracks import Tracks, told_apart


@dataclass
class _Seen:
    """An agent: where and how fast it was relative to the robot; what it did and what was due, see `Reciprocity`."""

    position: Array
    velocity: Array
    done: float = 0.0
    due: float = 0.0


@dataclass(eq=False)
class Reciprocity:
    """Estimate of the part of the avoidance that each observed agent does itself, from 0 to 0.5.

    Two discs are in conflict if they would touch within `horizon` [s] at constant velocities. The conflict is the least
    change of their relative velocity [m/s] that avoids this: the distance from the edge of the velocity obstacle (van
    den Berg, Guy, Lin and Manocha, 2011, call that change u). From one observation to the next, the part of the
    conflict that the agent's own change of velocity removes counts as done. The whole conflict counts as due within
    `response` [s]. The share is done over due, both forgotten with the time constant `memory` [s], and at most 0.5. An
    agent that was in no conflict yet has the share 0: it counts as an obstacle.

    Attributes:
        radius: [m] of the robot, with the margin that agents can be expected to keep.
        horizon: [s] of conflicts. response: [s] in which an agent that yields resolves one. memory: [s].
        doubt: [m/s] >= 0 that count as due from the start. Larger: the share grows later.

    Raises:
        InvalidInput: a value out of its range.
    """

    radius: NotNegative
    _: KW_ONLY
    horizon: Positive = 4.0
    response: Positive = 0.5
    memory: Positive = 5.0
    doubt: NotNegative = 0.1
    _time: float = field(default=-np.inf, init=False, repr=False)
    _own: Array = field(default_factory=lambda: np.zeros(0), init=False, repr=False)
    _agents: dict[Hashable, _Seen] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        check_fields(self)

    def update(self, state: State, tracks: Tracks) -> Tracks:
        """The tracks with shares; call it at every decision, with the state of the robot at the time of the tracks.

        Agents are told apart by their ids; those that are no longer observed are forgotten.

        Raises:
            InvalidInput: something else than a state and tracks, different dimensions, two equal ids, tracks
                that are older than the last.
        """
        has(state, *STATE, "state")
        has(tracks, *TRACKS, "tracks")
        told_apart(tracks.ids, "tracks.ids")
        same_dimension(tracks.dimension, state.dimension, "tracks", "state")
        step = not_before(tracks.t, self._time, "tracks.t", "an update") - self._time
        shares, agents = np.zeros(len(tracks)), dict[Hashable, Any]()
        for k, name in enumerate(tracks.ids):
            position, velocity = tracks.states[k, :2]
            agent = self._agents.get(name) or _Seen(position, velocity)
            if name in self._agents and step > 0.0:
                self._learn(agent, velocity, self.radius + float(tracks.radii[k]), step)
            agent.position, agent.velocity = position - state.position, velocity
            agents[name] = agent
            due = agent.due + self.doubt
            shares[k] = min(max(agent.done / due, 0.0), 0.5) if due > 0.0 else 0.0
        self._time = tracks.t
        self._own = state.velocity
        self._agents = agents
        return tracks.with_shares(shares)

    def _learn(self, agent: _Seen, velocity: Array, radius: float, step: float) -> None:
        """Count what an agent, which has a new velocity (d,) [m/s] after a step [s], has done."""
        kept = float(np.exp(-step / self.memory))
        before = conflict(agent.position, self._own - agent.velocity, radius, self.horizon)
        after = conflict(agent.position, self._own - velocity, radius, self.horizon)
        agent.done = kept * agent.done + before - after
        agent.due = kept * agent.due + before * min(step / self.response, 1.0)


def conflict(position: Array, velocity: Array, radius: float, horizon: float) -> float:
    """Least change [m/s] of the relative velocity so that two discs do not touch within the horizon [s].

    0 if they do not; where they overlap already, 0 as well.

    Args:
        position: (d,) [m] of the other one from here. velocity: (d,) [m/s] of this one relative to the other one.
        radius: [m] the sum of both.
    """
    distance = float(np.linalg.norm(position))
    if distance <= radius:
        return 0.0
    toward = position / distance
    # In the plane of position and velocity: x towards the other one, y >= 0 across.
    x = float(velocity @ toward)
    y = float(np.linalg.norm(velocity - x * toward))
    sine, cosine = radius / distance, float(np.sqrt(1.0 - (radius / distance) ** 2))
    leg = x * sine - y * cosine
    if leg <= 0.0:
        return 0.0
    # The truncated cone ends in a disc about position / horizon, which its legs touch.
    center, size = distance / horizon, radius / horizon
    away = float(np.hypot(x - center, y))
    if (center - x) * distance > radius * away:
        return max(size - away, 0.0)
    return leg
