"""Scenarios of episodes by name or as objects, and the spaces that environments share."""

from collections.abc import Callable, Mapping

import numpy as np
from gymnasium.spaces import Box

from slalom.adapters.gym.worlds import Worlds
from slalom.errors import InvalidInput
from slalom.sim.gallery import build
from slalom.sim.scenario import Scenario

Source = str | Scenario | Callable[[int], Scenario]
"""A name of the gallery; one scenario for every episode; or a function from a seed to a scenario."""
SEED, SEEDS = "scenario_seed", 2**31
"""The option of `reset` that names the seed of the scenario; seeds that are drawn are below SEEDS."""


class Scenes:
    """Builds the scenario of each episode."""

    def __init__(self, source: Source, settings: Mapping[str, float] | None) -> None:
        if settings and not isinstance(source, str):
            raise InvalidInput(f"settings: expected none for a scenario that is not of the gallery, found {settings}")
        if not (isinstance(source, str | Scenario) or callable(source)):
            raise InvalidInput(f"scenario: expected a name, a Scenario or a function of the seed, found {source!r}")
        self.source, self.settings = source, settings

    def first(self) -> Scenario:
        """The scenario from which spaces are made."""
        return self.of_seed(0)

    def of_seed(self, seed: int) -> Scenario:
        """The scenario of a seed."""
        if isinstance(self.source, str):
            return build(self.source, self.settings, seed=seed)
        return self.source if isinstance(self.source, Scenario) else self.source(seed)

    def next(self, rng: np.random.Generator, options: Mapping[str, object] | None) -> Scenario:
        """The scenario of the next episode: of the seed that `options` name, or of one that is drawn."""
        drawn = int(rng.integers(SEEDS))
        given = (options or {}).get(SEED, drawn)
        unknown = [name for name in options or {} if name != SEED]
        if unknown or isinstance(given, bool) or not isinstance(given, int | np.integer):
            raise InvalidInput(f"options: expected {{{SEED!r}: a whole number}}, found {options}")
        return self.of_seed(int(given))


def action_space(worlds: Worlds) -> Box:
    """Space of the action of one robot."""
    return Box(-1.0, 1.0, (worlds.dimension,), np.float32)


def observation_space(worlds: Worlds) -> Box:
    """Space of the observation of one robot."""
    return Box(-1.0, 1.0, (worlds.size,), np.float32)
