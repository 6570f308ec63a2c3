"""Short deviations from a plan: one velocity, then another, each for a stage of a fixed duration."""

from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.limits import Limits
from slalom.lookahead.search import directions
from slalom.manoeuvre import Manoeuvre
from slalom.response.sequence import AccelerationSequence
from slalom.state import State
from slalom.tolerances import DEVIATION_DIRECTIONS, NODE_TIME_SLACK, WHOLE_COUNT


class Deviations(NamedTuple):
    """Motions of a robot from `state` at `now` [s], with two successive velocities.

    At the start of each stage the robot accelerates with its largest acceleration to the velocity of the stage. The
    second one is held without end.
    """

    state: State
    now: float  # [s]
    stage: float  # [s]
    accelerations: Array  # (s, 2, d) [m/s^2]
    holds: Array  # (s, 2) [s] durations of the accelerations

    @classmethod
    def of(cls, plan: Manoeuvre, state: State, limits: Limits, stage: float, now: float) -> "Deviations":
        """All pairs of velocities that the robot can take in time.

        The velocities are those in DEVIATION_DIRECTIONS directions at the maximum speed, and in every other direction
        at a half of it. Further ones are rest, the present one, and those of the plan after each stage.
        """
        speed, largest = limits.max_speed, limits.max_acceleration
        ways = _ways(state.dimension)
        own = plan.velocity(now + stage * np.array([1.0, 2.0]))
        velocities = np.concatenate([speed * ways, 0.5 * speed * ways[::2], 0.0 * ways[:1], state.velocity[None], own])
        velocities *= np.minimum(1.0, speed / np.maximum(np.linalg.norm(velocities, axis=1), speed))[:, None]
        n, d = velocities.shape
        starts = np.concatenate([np.broadcast_to(state.velocity, (n * n, d)), np.repeat(velocities, n, 0)])
        changes = np.concatenate([np.repeat(velocities, n, 0), np.tile(velocities, (n, 1))]) - starts
        holds = np.linalg.norm(changes, axis=1) / largest
        accelerations = largest * changes / np.linalg.norm(changes, axis=1, keepdims=True).clip(1e-300)
        pairs, holds = accelerations.reshape(2, n * n, d).swapaxes(0, 1), holds.reshape(2, n * n).T
        possible = np.all(holds <= stage * (1.0 + WHOLE_COUNT), axis=1)
        return cls(state, now, stage, pairs[possible], np.minimum(holds[possible], stage))

    def positions(self, times: Array) -> Array:
        """Positions (s, m, d) [m] at absolute times (m,) [s] from `now` on."""
        t = (np.asarray(times, dtype=np.float64) - self.now)[None]
        found = self.state.position + t[..., None] * self.state.velocity
        for k in range(2):
            since, hold = np.maximum(t - k * self.stage, 0.0), self.holds[:, k, None]
            ramp = np.minimum(since, hold)
            found = found + (ramp * (since - 0.5 * ramp))[..., None] * self.accelerations[:, None, k]
        return np.asarray(found)

    def best_first(self, costs: Array, highest: float, most: int) -> list[Manoeuvre]:
        """Deviations of costs (s,) below `highest`, at most `most`, cheapest first: one for each first velocity."""
        found: dict[bytes, int] = {}
        for k in np.argsort(costs, kind="stable").tolist():
            if costs[k] >= highest or len(found) == most:
                break
            found.setdefault(self.accelerations[k, 0].tobytes() + self.holds[k, 0].tobytes(), k)
        return [self.manoeuvre(k) for k in found.values()]

    def manoeuvre(self, k: int) -> Manoeuvre:
        """Deviation k as one response to its first acceleration."""
        rest = np.zeros(self.state.dimension)
        phases = []
        for hold, acceleration in zip(self.holds[k], self.accelerations[k], strict=True):
            phases += [(hold, acceleration), (self.stage - hold, rest)]
        phases = [(t, u) for t, u in phases if t > NODE_TIME_SLACK * self.stage] or [(self.stage, rest)]
        then = tuple((float(t), tuple(map(float, u))) for t, u in phases[1:])
        return Manoeuvre(AccelerationSequence(float(phases[0][0]), then), self.state, phases[0][1], self.now)


def _ways(dimension: int) -> Array:
    """Unit vectors (n, d): DEVIATION_DIRECTIONS in the plane, those of a search in space."""
    if dimension == 3:
        return directions(3)
    angles = 2.0 * np.pi * np.arange(DEVIATION_DIRECTIONS) / DEVIATION_DIRECTIONS
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)
