"""Forecast of a crowd whose agents avoid each other, with a preferred velocity of each that its past explains."""

from collections.abc import Hashable
from dataclasses import KW_ONLY, dataclass, field
from typing import Final

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import TRACKS, UNCERTAINTY, Array, NotNegative, Positive, check_fields, has, whole
from slalom.base.errors import InvalidInput, OutsideSpan
from slalom.kernels.arrays import Flags, Indices
from slalom.model.path import Path, hermite_pieces
from slalom.model.shape import Disc
from slalom.model.uncertainty import Uncertainty
from slalom.obstacle import Obstacle
from slalom.obstacle.tracks import Tracks, told_apart

CROWD_ERROR: Final = 0.072
"""[m/s] Root mean square of the errors of predicted velocities over one period in a typical crowd. Larger: errors count
as smaller than usual, and closeness costs less. It fits the spread of an expected loss."""

CROWD_PRIOR: Final = 100.0
"""[1] Typical errors that count with those that were observed. More: a crowd is known later to differ."""

CROWD_LARGEST_ERROR: Final = 0.4
"""[m/s] Larger errors count as this. Larger: one sudden change outweighs many predictions."""

CROWD_SCALES: Final = (0.4, 2.0)
"""[1] Least and largest factor of the errors of a crowd. Further apart: more trust, or less, in what was observed."""

CROWD_LEAST: Final = 0.6
"""[1] Factor of the errors of an agent that was predicted exactly. Larger: more distance from steady agents."""

CROWD_DOUBLING: Final = 0.12
"""[m/s] Last error of an agent that adds 1 to its factor. Larger: less distance from agents that have just changed."""

CROWD_UNKNOWN: Final = 2.0
"""[1] Factor of the errors of an agent that was not predicted so far. Larger: more distance from new agents."""

CROWD_MEMORY: Final = 0.7
"""[1] Weight of the errors of the forecast of an agent at one observation, relative to the next. Larger: a later change
between a model and a constant velocity. Smaller: a single error changes it."""


@dataclass
class _Agents:
    """Agents at the last observation; all arrays have one row for each."""

    rows: dict[Hashable, int]
    positions: Array  # (n, 2) [m]
    velocities: Array  # (n, 2) [m/s]
    radii: Array  # (n,) [m]
    preferred: Array  # (n, 2) [m/s]
    speeds: Array  # (n,) [m/s] the largest observed
    known: Flags  # (n,) whether they were observed before, so that their velocity is compared with the model
    errors: Array  # (n, 2) [m/s] of the model and of a constant velocity, with CROWD_MEMORY
    last: Array  # (n,) [m/s] error of the last prediction, nan without one


class _Steps:
    """Trajectory through positions (n, 2) [m] at increasing times (n,) [s], straight between them and after the last.

    The velocity after the last time is that before it. It has no end, so that nothing continues it at every decision.
    """

    def __init__(self, times: Array, positions: Array) -> None:
        self._times, self._positions = times, positions
        self._velocities = np.diff(positions, axis=0) / np.diff(times)[:, None]
        self.dimension, self.span = 2, (float(times[0]), np.inf)

    def _piece(self, t: npt.ArrayLike) -> tuple[Array, Indices]:
        time = np.asarray(t, dtype=np.float64)
        if np.any(time < self._times[0]):
            raise OutsideSpan(f"t: expected a time from {self._times[0]:g} s on, found {time.min():g} s")
        k = np.searchsorted(self._times, time, side="right") - 1
        return time, np.minimum(k, len(self._velocities) - 1)

    def position(self, t: npt.ArrayLike) -> Array:
        time, k = self._piece(t)
        return np.asarray(self._positions[k] + (time - self._times[k])[..., None] * self._velocities[k])

    def velocity(self, t: npt.ArrayLike) -> Array:
        return np.asarray(self._velocities[self._piece(t)[1]])

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return 0.0 * self.velocity(t)

    def breaks(self, start: float, end: float) -> Array:
        inner = self._times[1:-1]
        return inner[(inner > start) & (inner < end)]

    def speed_bound(self, start: float, end: float) -> float:
        return float(np.linalg.norm(self._velocities, axis=1).max())

    def acceleration_bound(self, start: float, end: float) -> float:
        return 0.0

    def path(self, start: float, end: float) -> Path:
        times = np.concatenate([[start], self.breaks(start, end), [end]])
        velocities = self._velocities[self._piece(times[:-1])[1]]
        return hermite_pieces(times, self.position(times), velocities, velocities, 0.0)


@dataclass(eq=False)
class AvoidingCrowd:
    """Forecast of discs in the plane that avoid each other, and not the robot.

    Each agent takes in each period the velocity nearest its preferred one that makes its half of the avoidance of all
    others (ORCA: van den Berg, Guy, Lin and Manocha, 2011). The model simulates all agents together for `steps`
    periods; after that velocities stay constant.

    Preferred velocities are hidden. At each observation the model predicts the velocities that are observed now from
    the estimates of the last one. The difference is added to the estimate. Laws: an agent that the others do not
    restrict has its velocity as its estimate; if one other restricts it, the new estimate explains the observed
    velocity. An agent that a constant velocity has explained better so far is predicted with that.

    Attributes:
        period: [s] in which agents choose a velocity. horizon: [s] for which they avoid contact.
        distance: [m] by which each counts as larger. reach: [m] between centres of agents that avoid each other.
        steps: periods that are simulated. uncertainty: of the predictions.

    Raises:
        InvalidInput: a value out of its range.
    """

    period: Positive
    _: KW_ONLY
    horizon: Positive = 5.0
    distance: NotNegative = 0.16
    reach: Positive = 10.0
    steps: int = 12
    uncertainty: Uncertainty | None = None
    _squares: float = field(default=0.0, init=False, repr=False)
    _predicted: int = field(default=0, init=False, repr=False)
    _now: float = field(default=-np.inf, init=False, repr=False)
    _agents: _Agents | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        check_fields(self)
        self.steps = whole(self.steps, "steps", 1)
        if self.uncertainty is not None:
            has(self.uncertainty, *UNCERTAINTY, "uncertainty")

    def predict(self, tracks: Tracks) -> list[Obstacle]:
        """The tracks on their predicted trajectories; call it once at every observation.

        Agents are told apart by their ids. The first velocity of an agent is its first estimate, and is not compared
        with the model. An agent that is no longer observed is forgotten.

        Raises:
            InvalidInput: something else than tracks, tracks in space, two equal ids, a time that is not after the last.
        """
        has(tracks, *TRACKS, "tracks")
        told_apart(tracks.ids, "tracks.ids")
        tracks.refuse_worlds("tracks")
        tracks.refuse_probabilities("tracks")
        if tracks.dimension != 2:
            raise InvalidInput(f"tracks: expected them in the plane, found dimension {tracks.dimension}")
        if not tracks.t > self._now:
            raise InvalidInput(f"tracks.t: expected a time after {self._now:g} s, that of the last; found {tracks.t:g}")
        agents = self._agents = self._updated(tracks)
        self._now = tracks.t
        paths = self._simulated(agents)
        times = tracks.t + self.period * np.arange(self.steps + 1, dtype=np.float64)
        return [
            Obstacle(Disc(float(radius)), _Steps(times, paths[:, k]), str(name), uncertainty=self.uncertainty or given)
            for k, (radius, name, given) in enumerate(zip(tracks.radii, tracks.ids, tracks.uncertainties, strict=True))
        ]

    @property
    def preferred(self) -> dict[Hashable, Array]:
        """Estimated preferred velocity (2,) [m/s] of each agent of the last observation, by id."""
        agents = self._agents
        return {} if agents is None else {name: agents.preferred[k] for name, k in agents.rows.items()}

    @property
    def scales(self) -> dict[str, float]:
        """How large the error of each agent is likely to be, relative to a typical one [1], by its name.

        The product of two factors. One is the root mean square of the errors over one period of all agents so far, in
        units of CROWD_ERROR. It begins at 1 and stays within CROWD_SCALES. The other grows with the last error of the
        agent: large errors follow each other. Without a prediction so far it is CROWD_UNKNOWN.
        """
        agents = self._agents
        if agents is None:
            return {}
        squares = self._squares + CROWD_PRIOR * CROWD_ERROR**2
        common = float(np.clip(np.sqrt(squares / (self._predicted + CROWD_PRIOR)) / CROWD_ERROR, *CROWD_SCALES))
        own = CROWD_LEAST + np.sqrt(agents.last / CROWD_DOUBLING)
        own[np.isnan(own)] = CROWD_UNKNOWN
        return {str(name): common * float(own[k]) for name, k in agents.rows.items()}

    def _chosen(self, agents: _Agents, positions: Array, velocities: Array) -> Array:
        """Velocities (n, 2) [m/s] that the model chooses."""
        return np.asarray(
            kernels.avoiding_velocities(
                *(positions, velocities, agents.radii + self.distance, agents.preferred, agents.speeds),
                *(self.horizon, self.reach, self.period),
            )
        )

    def _updated(self, tracks: Tracks) -> _Agents:
        """Agents of this observation, with what the last one taught."""
        positions, velocities = (np.ascontiguousarray(tracks.states[:, k]) for k in range(2))
        n, before = len(tracks), self._agents
        now = _Agents(
            {name: k for k, name in enumerate(tracks.ids)},
            *(positions, velocities, np.array(tracks.radii), velocities.copy()),
            np.linalg.norm(velocities, axis=1),
            np.zeros(n, np.bool_),
            np.zeros((n, 2)),
            np.full(n, np.nan),
        )
        if before is None or not before.rows:
            return now
        chosen = self._chosen(before, before.positions, before.velocities)
        predicted = np.where(_explained(before), chosen, before.velocities)
        for name, k in now.rows.items():
            if name not in before.rows:
                continue
            j = before.rows[name]
            now.known[k], now.speeds[k] = True, max(now.speeds[k], before.speeds[j])
            if before.known[j]:
                now.last[k] = np.linalg.norm(velocities[k] - predicted[j])
                missing = velocities[k] - chosen[j]
                estimate = before.preferred[j] + missing
                size = float(np.linalg.norm(estimate))
                now.preferred[k] = estimate * min(1.0, now.speeds[k] / size) if size > 0.0 else estimate
                change = velocities[k] - before.velocities[j]
                now.errors[k] = CROWD_MEMORY * before.errors[j] + np.linalg.norm([missing, change], axis=1)
        known = now.last[~np.isnan(now.last)].clip(max=CROWD_LARGEST_ERROR)
        self._squares, self._predicted = self._squares + float(known @ known), self._predicted + len(known)
        return now

    def _simulated(self, agents: _Agents) -> Array:
        """Positions (steps + 1, n, 2) [m] at the ends of all periods from now on."""
        explained = _explained(agents)
        paths, velocities = [agents.positions], agents.velocities
        for _ in range(self.steps):
            velocities = np.where(explained, self._chosen(agents, paths[-1], velocities), velocities)
            paths.append(paths[-1] + self.period * velocities)
        return np.array(paths)


def _explained(agents: _Agents) -> Flags:
    """Whether the model has explained each agent at least as well as a constant velocity: (n, 1)."""
    return np.asarray(agents.errors[:, :1] <= agents.errors[:, 1:])
