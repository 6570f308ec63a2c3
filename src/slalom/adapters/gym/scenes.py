"""Scenarios of episodes by name or as objects, and the spaces that environments share."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import Space
from gymnasium.spaces import Box

from slalom.adapters.gym.motion import Motion
from slalom.adapters.gym.worlds import OUTCOMES, Worlds
from slalom.base.checks import did_you_mean, has, known, mapping, whole
from slalom.base.errors import InvalidInput
from slalom.sim.gallery import build
from slalom.sim.scenario import Scenario
from slalom.view.fleet import Picture

Source = str | Scenario | Callable[[int], Scenario]
"""A name of the gallery; one scenario for every episode; or a function from a seed to a scenario."""
SEED, SEEDS = "scenario_seed", 2**31
"""The option of `reset` that names the seed of the scenario; seeds that are drawn are below SEEDS."""


class Scenes:
    """Begins episodes: each in the scenario of a seed that is drawn.

    Args:
        source: see `Source`. settings: parameters and settings of the gallery.
        layouts: number of different scenarios, of the seeds 0 to layouts - 1, which are built once; None: a new one for
            each episode.
    """

    def __init__(self, source: Source, settings: Mapping[str, float] | None, layouts: int | None) -> None:
        if settings is not None:
            mapping(settings, "numbers by name", "settings")
        if settings and not isinstance(source, str):
            raise InvalidInput(f"settings: expected none for a scenario that is not of the gallery, found {settings}")
        if not (isinstance(source, str | Scenario) or callable(source)):
            raise InvalidInput(f"scenario: expected a name, a Scenario or a function of the seed, found {source!r}")
        self._source, self._settings = source, settings
        self._layouts = None if layouts is None else whole(layouts, "layouts", 1)
        self._built: dict[int, tuple[Scenario, Motion]] = {}

    def of_seed(self, seed: int) -> Scenario:
        """The scenario of a seed. Raises InvalidInput for one with limited sight: observations show all obstacles."""
        if isinstance(self._source, str):
            scenario = build(self._source, self._settings, seed=seed)
        else:
            scenario = self._source if isinstance(self._source, Scenario) else self._source(seed)
            has(scenario, ("robots", "sight"), "a function that returns a Scenario", "scenario")
        if scenario.sight is not None:
            raise InvalidInput(f"scenario: expected one without limited sight, found {scenario.name}")
        return scenario

    def begin(
        self, worlds: Worlds, w: int, rng: np.random.Generator, options: Mapping[str, object] | None = None
    ) -> None:
        """Begin an episode in world w, in the scenario of the seed that `options` name, or of one that is drawn.

        Other options are those of wrappers.

        Raises:
            InvalidInput: a seed that is not a whole number; an option whose name is nearly that of the seed.
        """
        given = {} if options is None else options
        mapping(given, "options by name", "options")
        for name in given:
            if name != SEED and (hint := did_you_mean(name, [SEED])):
                raise InvalidInput(f"options: expected {SEED!r} or an option of a wrapper, found {name!r}{hint}")
        drawn = int(rng.integers(SEEDS if self._layouts is None else self._layouts))
        seed = given.get(SEED, drawn)
        if isinstance(seed, bool) or not isinstance(seed, int | np.integer):
            raise InvalidInput(f"options[{SEED!r}]: expected a whole number, found {seed!r}")
        seed = int(seed)
        if self._layouts is None:
            worlds.load(w, self.of_seed(seed))
            return
        if seed not in self._built:
            scenario = self.of_seed(seed)
            self._built[seed] = scenario, Motion(scenario, worlds.period, keep=True)
        worlds.load(w, *self._built[seed])


def action_space(worlds: Worlds) -> Space[Any]:
    """Space of the action of one robot."""
    return Box(-1.0, 1.0, (worlds.dimension,), np.float32)


def observation_space(worlds: Worlds) -> Space[Any]:
    """Space of the observation of one robot."""
    return Box(-1.0, 1.0, (worlds.size,), np.float32)


# ---------------------------------------------------------------------------------------------------------------------
# Shared parts of environments with one world: pictures, and the values of `info` after a step.


RENDER_MODES = ("rgb_array", "human")


class Shown:
    """Pictures of the only world of an environment."""

    worlds: Worlds
    render_mode: str | None
    _picture: Picture | None = None

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Picture (height, width, 3) with render_mode "rgb_array"; with "human" it is shown at each step."""
        return self._drawn().pixels() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def _show(self) -> None:
        if self.render_mode == "human":
            self._drawn().show()

    def _drawn(self) -> Picture:
        if self._picture is None:
            self._picture = Picture(self.worlds.scenarios[0], window=self.render_mode == "human")
        self._picture.draw(self.worlds.position[0], self.worlds.velocity[0], self.worlds.there[0], self.worlds.now())
        return self._picture


def checked_mode(render_mode: str | None) -> str | None:
    """The render mode. Raises InvalidInput for an unknown one."""
    return None if render_mode is None else known(render_mode, "render_mode", RENDER_MODES)


def information(outcome: int, clearance: float, time: float) -> dict[str, Any]:
    """The values of `info` after a step, see `RobotEnv`."""
    name = OUTCOMES[outcome]
    return {"outcome": name, "is_success": name == "arrived", "clearance": clearance, "time": time}
