"""Environment of gymnasium: one robot among obstacles."""

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from slalom.adapters.gym.scenes import (
    RENDER_MODES,
    Scenes,
    Shown,
    Source,
    action_space,
    checked_mode,
    information,
    observation_space,
)
from slalom.adapters.gym.worlds import RUNNING, TIME, Worlds
from slalom.base.checks import Array, array_of
from slalom.base.errors import InvalidInput

Observation = npt.NDArray[np.float32]


class RobotEnv(Shown, gymnasium.Env[Observation, Array]):
    """One robot among obstacles that do not avoid it.

    Observations and rewards are those of `worlds.Worlds`. An episode is terminated by arrival or collision, and
    truncated when the duration of the scenario has passed. `info` holds `outcome` (running, arrived, collision, time),
    `is_success`, `clearance` [m] (see `clearance.least_clearances`) and `time` [s] since the start.

    Attributes:
        worlds: the state of the only robot, `worlds.position[0, 0]`.

    Args:
        scenario: a name of the gallery, a scenario, or a function from a seed to a scenario.
        settings: parameters and settings of the gallery. layouts: number of different scenarios, which are built once;
            None: a new one for each episode.
        nearest: number of bodies that are observed.
        command: "acceleration" or "velocity", see `Worlds.accelerations`.
        render_mode: "rgb_array", or "human" for a window of matplotlib, if its backend has windows.

    Raises:
        InvalidInput: a scenario of several robots; see also `Worlds` and `Motion`.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 10}  # noqa: RUF012  # the type of gymnasium

    def __init__(
        self,
        scenario: Source = "roundabout_crossing",
        *,
        settings: Mapping[str, float] | None = None,
        layouts: int | None = None,
        nearest: int = 8,
        command: str = "acceleration",
        render_mode: str | None = None,
    ) -> None:
        self.scenes = Scenes(scenario, settings, layouts)
        self.worlds = Worlds([self.scenes.of_seed(0)], nearest, command)
        if self.worlds.kind[0] != 1:
            raise InvalidInput(f"scenario: expected one robot, found {self.worlds.kind[0]}; use FleetEnv")
        # The first episode begins with `reset`.
        self.worlds.acting[:] = False
        self.observation_space, self.action_space = observation_space(self.worlds), action_space(self.worlds)
        self.render_mode = checked_mode(render_mode)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode in the scenario of the seed `options["scenario_seed"]`, or of a seed that is drawn."""
        super().reset(seed=seed)
        self.scenes.begin(self.worlds, 0, self.np_random, options)
        self.close()
        self._show()
        return self.worlds.observations()[0, 0], {"time": 0.0}

    def step(self, action: Array) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Follow an action for one period."""
        if not self.worlds.acting[0, 0]:
            raise InvalidInput("step: expected a running episode, found one that has ended or not begun; call reset")
        given = array_of(action, "action", (self.worlds.dimension,))
        made = self.worlds.step(given[None, None])
        outcome = int(made.outcomes[0, 0])
        time = float(self.worlds.steps[0] * self.worlds.period)
        info = information(outcome, float(made.clearances[0, 0]), time)
        self._show()
        ended, late = outcome not in (RUNNING, TIME), outcome == TIME
        return self.worlds.observations()[0, 0], float(made.rewards[0, 0]), ended, late, info
