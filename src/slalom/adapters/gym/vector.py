"""Vector environment of gymnasium: one robot in each of many worlds, which make a step in one call."""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from slalom.adapters.gym.scenes import Scenes, Source, action_space, observation_space
from slalom.adapters.gym.worlds import ARRIVED, COLLISION, OUTCOMES, TIME, Worlds
from slalom.base.checks import Array, array_of, listing, whole
from slalom.base.errors import InvalidInput
from slalom.kernels.arrays import Flags

Observations = npt.NDArray[np.float32]
NAMES = np.array(OUTCOMES)


class RobotsEnv(gymnasium.vector.VectorEnv[Observations, Array, Any]):
    """Many independent copies of `RobotEnv`, with its arguments, as arrays.

    Copy k with seed s + k has the episodes of a `RobotEnv` with that seed. A copy whose episode has ended begins the
    next one at the next step, with a reward of 0 (`AutoresetMode.NEXT_STEP`).
    """

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}  # noqa: RUF012  # the type of gymnasium

    def __init__(
        self,
        num_envs: int = 1,
        scenario: Source = "roundabout_crossing",
        *,
        settings: Mapping[str, float] | None = None,
        layouts: int | None = None,
        nearest: int = 8,
        command: str = "acceleration",
        render_mode: None = None,
    ) -> None:
        if render_mode is not None:
            raise InvalidInput(f"render_mode: expected none for many worlds, found {render_mode!r}")
        self.scenes, self.num_envs = Scenes(scenario, settings, layouts), whole(num_envs, "num_envs", 1)
        self.worlds = Worlds([self.scenes.of_seed(0)] * self.num_envs, nearest, command)
        if self.worlds.kind[0] != 1:
            raise InvalidInput(f"scenario: expected one robot, found {self.worlds.kind[0]}; use FleetEnv")
        self.single_observation_space = observation_space(self.worlds)
        self.single_action_space = action_space(self.worlds)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._generators: list[np.random.Generator] = []

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin an episode in every world; with a number as seed, world k has the seed that is larger by k."""
        if seed is not None or not self._generators:
            seeds = [seed + k for k in range(self.num_envs)] if isinstance(seed, int) else seed
            if seeds is None:
                seeds = [None] * self.num_envs
            listing(seeds, "a whole number, or one for each world", "seed")
            if len(seeds) != self.num_envs:
                raise InvalidInput(f"seed: expected one or {self.num_envs}, found {len(seeds)}")
            self._generators = [gymnasium.utils.seeding.np_random(one)[0] for one in seeds]
        self._load(range(self.num_envs), options)
        return self.worlds.observations()[:, 0], {}

    def step(self, actions: Array) -> tuple[Observations, Array, Flags, Flags, dict[str, Any]]:
        """Follow actions (n, d) for one period."""
        if not self._generators:
            raise InvalidInput("step: expected running episodes, found none; call reset")
        given = array_of(actions, "actions", (self.num_envs, self.worlds.dimension))
        running = self.worlds.acting[:, 0].copy()
        self._load(np.flatnonzero(~running).tolist(), None)
        made = self.worlds.step(given[:, None], running)
        outcome = made.outcomes[:, 0]
        info = {
            "outcome": NAMES[outcome],
            "is_success": outcome == ARRIVED,
            "clearance": made.clearances[:, 0],
            "time": self.worlds.steps * self.worlds.period,
        }
        info |= {f"_{name}": running for name in info}
        ended = (outcome == ARRIVED) | (outcome == COLLISION)
        return self.worlds.observations()[:, 0], made.rewards[:, 0], ended, outcome == TIME, info

    def _load(self, some: Sequence[int], options: dict[str, Any] | None) -> None:
        """Begin the next episode in some worlds."""
        for k in some:
            self.scenes.begin(self.worlds, k, self._generators[k], options)
