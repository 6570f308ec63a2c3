"""The dynamic window approach for robots that accelerate in every direction."""

import numpy as np

from slalom.checks import Array, not_negative, positive, whole
from slalom.peers.crowd import Discs, Team
from slalom.peers.surroundings import Surroundings, surroundings

STEP = 0.1
"""[s] Between tests of a predicted motion. Smaller: thin walls are not jumped over at higher speeds, more time."""


class DynamicWindow:
    """Team in which each robot takes the best velocity of its window (Fox, Burgard and Thrun, IEEE RAM 4(1), 1997).

    The window holds the velocities that one period of acceleration reaches, on a grid of `grid` x `grid`. Each is held
    while the discs keep theirs. It is admissible if the robot can brake before it comes nearer than `margin` [m] to a
    body. This is tested up to `horizon` [s] or the time of the braking. Among these the robot maximises

        heading (1 - angle to the preferred velocity / pi) + distance (free share of the longest way)
        + speed (1 - difference to the preferred speed / max_speed)

    with the weights `heading`, `distance` and `speed`. The authors had circular arcs of a synchro-drive and obstacles
    at rest; here motions are straight. Without an admissible velocity the robot brakes as hard as it can.

    Raises:
        InvalidInput: a weight or margin below 0, a horizon not above 0, a grid of fewer than 3.
    """

    def __init__(
        self,
        team: Team,
        *,
        heading: float = 2.0,
        distance: float = 0.2,
        speed: float = 0.2,
        margin: float = 0.0,
        horizon: float,
        grid: int = 15,
    ) -> None:
        self._team = team
        self._weights = tuple(
            not_negative(w, n) for w, n in ((heading, "heading"), (distance, "distance"), (speed, "speed"))
        )
        self._margin, self._horizon = not_negative(margin, "margin"), positive(horizon, "horizon")
        ticks = np.linspace(-1.0, 1.0, whole(grid, "grid", 3))
        square = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 2)
        self._window = square[np.hypot(*square.T) <= 1.0]

    def choose(self, positions: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        around = surroundings(self._team, positions, velocities, others, self._horizon)
        return np.array([self._best(k, *row) for k, row in enumerate(zip(positions, velocities, preferred, around))])

    def _best(self, k: int, position: Array, velocity: Array, preferred: Array, around: Surroundings) -> Array:
        max_speed, most = float(self._team.max_speeds[k]), float(self._team.max_accelerations[k])
        period = self._team.period
        candidates = velocity + period * most * self._window
        wanted = preferred - velocity
        within = wanted / max(float(np.hypot(*wanted)) / (period * most), 1.0)
        candidates = np.vstack([candidates, velocity + within])
        speeds = np.hypot(*candidates.T)
        candidates, speeds = candidates[speeds <= max_speed], speeds[speeds <= max_speed]
        if not len(candidates):  # faster than max_speed by more than a period can brake
            return np.asarray(velocity * max(0.0, 1.0 - period * most / float(np.hypot(*velocity))))
        horizon = max(self._horizon, period + 0.5 * max_speed / most)
        times: Array = STEP * np.arange(1.0, np.ceil(horizon / STEP) + 1.0)
        ramp = np.minimum(times, period)
        way = ramp[:, None] * velocity + (0.5 * ramp**2 / period)[:, None] * (candidates - velocity)[:, None]
        places = position + way + (times - ramp)[:, None] * candidates[:, None]
        hit = around.clearance(places, times) < self._margin
        first = np.where(hit.any(axis=1), hit.argmax(axis=1), hit.shape[1])
        distance = speeds * STEP * first
        admissible = (first == hit.shape[1]) | (distance >= speeds * period + 0.5 * speeds**2 / most)
        if not admissible.any():
            return np.asarray(candidates[np.argmin(speeds)])
        share = np.where(first == hit.shape[1], 1.0, distance / (max_speed * horizon))
        size = float(np.hypot(*preferred))
        cosine = candidates @ preferred / np.maximum(speeds * size, np.finfo(float).tiny)
        facing = 1.0 - np.arccos(np.clip(cosine, -1.0, 1.0)) / np.pi
        terms = (facing, share, 1.0 - np.abs(speeds - size) / max_speed)
        value = sum(weight * term for weight, term in zip(self._weights, terms))
        return np.asarray(candidates[np.argmax(np.where(admissible, value, -np.inf))])
