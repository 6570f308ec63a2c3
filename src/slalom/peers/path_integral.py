"""Model predictive path integral control (MPPI) of robots that accelerate in every direction."""

import numpy as np

from slalom.checks import Array, not_negative, positive, whole
from slalom.peers.crowd import Discs, Team
from slalom.peers.surroundings import Surroundings, surroundings


class PathIntegral:
    """Team in which each robot averages random sequences of accelerations by their costs.

    Williams, Aldrich and Theodorou, Journal of Guidance, Control, and Dynamics 40(2), 2017, and Williams et al., ICRA
    2017: a sequence over the `horizon` [s] is kept and shifted by a period at each decision. `samples` sequences differ
    from it by normal noise, whose standard deviation is the share `deviation` of the maximum acceleration, constant
    over `hold` [s] each. The new sequence is their mean with the weights exp(-(cost - least cost) / `temperature`).
    Accelerations and speeds are cut to the limits in the prediction. The costs are, summed over the steps,

        |velocity - preferred|^2 / max_speed^2 + `collision` (if the clearance to discs at constant velocities, or to
        walls, is below `margin` [m])

    The cost of control is 0, a choice that Williams et al. leave open. The noise comes from `seed`: runs are the same
    every time.

    Raises:
        InvalidInput: a horizon, hold, deviation or temperature not above 0; a margin or a cost below 0; no sample.
    """

    def __init__(
        self,
        team: Team,
        *,
        margin: float = 0.0,
        horizon: float = 4.0,
        samples: int = 256,
        deviation: float = 0.7,
        hold: float = 0.5,
        temperature: float = 0.5,
        collision: float = 100.0,
        seed: int = 1,
    ) -> None:
        self._team, self._margin = team, not_negative(margin, "margin")
        self._horizon, self._temperature = positive(horizon, "horizon"), positive(temperature, "temperature")
        self._collision, self._samples = not_negative(collision, "collision"), whole(samples, "samples", 1)
        self._deviation = positive(deviation, "deviation")
        self._steps = max(1, round(self._horizon / team.period))
        self._repeats = max(1, round(positive(hold, "hold") / team.period))
        self._generator = np.random.default_rng(whole(seed, "seed"))
        self._sequences = np.zeros((len(team.radii), self._steps, 2))

    def choose(self, positions: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        around = surroundings(self._team, positions, velocities, others, self._horizon)
        blocks = -(-self._steps // self._repeats)
        shape = (len(positions), self._samples, blocks, 2)
        noise = np.repeat(self._generator.standard_normal(shape), self._repeats, axis=2)[:, :, : self._steps]
        noise[:, 0] = 0.0
        return np.array(
            [self._next(k, *row) for k, row in enumerate(zip(positions, velocities, preferred, around, noise))]
        )

    def _next(
        self, k: int, position: Array, velocity: Array, preferred: Array, around: Surroundings, noise: Array
    ) -> Array:
        max_speed, most = float(self._team.max_speeds[k]), float(self._team.max_accelerations[k])
        sampled = cut(self._sequences[k] + self._deviation * most * noise, most)
        places, speeds = self._predicted(position, velocity, sampled, max_speed)
        times: Array = self._team.period * np.arange(1.0, self._steps + 1.0)
        costs = np.square(speeds - preferred).sum(axis=-1) / max_speed**2
        costs += self._collision * (around.clearance(places, times) < self._margin)
        total = costs.sum(axis=1)
        weights = np.exp((total.min() - total) / self._temperature)
        sequence = np.tensordot(weights / weights.sum(), sampled, axes=1)
        self._sequences[k] = np.vstack([sequence[1:], np.zeros((1, 2))])
        return cut(velocity + self._team.period * sequence[0], max_speed)

    def _predicted(
        self, position: Array, velocity: Array, accelerations: Array, max_speed: float
    ) -> tuple[Array, Array]:
        """Positions [m] and velocities [m/s] (K, H, 2) at the ends of the steps."""
        period = self._team.period
        velocities = np.empty_like(accelerations)
        before = np.broadcast_to(velocity, accelerations[:, 0].shape)
        for step in range(accelerations.shape[1]):
            before = velocities[:, step] = cut(before + period * accelerations[:, step], max_speed)
        starts = np.concatenate([np.broadcast_to(velocity, (len(velocities), 1, 2)), velocities[:, :-1]], axis=1)
        return position + np.cumsum(0.5 * period * (starts + velocities), axis=1), velocities


def cut(vectors: Array, longest: float) -> Array:
    """Vectors (..., 2), shortened to the length `longest` where they are longer."""
    length = np.hypot(vectors[..., 0], vectors[..., 1])
    return np.asarray(vectors / np.maximum(length / longest, 1.0)[..., None])
