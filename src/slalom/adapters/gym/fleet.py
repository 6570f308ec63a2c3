"""Environment of PettingZoo: several robots that act at the same time."""

from collections.abc import Mapping
from typing import Any, ClassVar

import gymnasium
import numpy as np
from pettingzoo import ParallelEnv

from slalom.adapters.gym.robot import Observation
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
from slalom.base.checks import Array, array_of, mapping
from slalom.base.errors import InvalidInput


class FleetEnv(Shown, ParallelEnv):  # type: ignore[misc]  # PettingZoo has no types
    """Several robots among each other and among obstacles; agents are the names of the robots.

    Observations, rewards and information of each agent are as in `RobotEnv`, with its arguments. Other robots are
    observed like obstacles. An agent whose episode has ended leaves `agents`. Its robot leaves the scene, except one
    that stops at its goal, which stays there.

    Raises:
        InvalidInput: a world that repeats; robots whose names depend on the seed.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "name": "slalom_fleet_v0",
        "render_modes": list(RENDER_MODES),
        "render_fps": 10,
        "is_parallelizable": True,
    }

    def __init__(
        self,
        scenario: Source = "circle",
        *,
        settings: Mapping[str, float] | None = None,
        layouts: int | None = None,
        nearest: int = 8,
        command: str = "acceleration",
        render_mode: str | None = None,
    ) -> None:
        self.scenes = Scenes(scenario, settings, layouts)
        self.worlds = Worlds([self.scenes.of_seed(0)], nearest, command)
        self.possible_agents, self.agents = self._names(), list[str]()
        self.observation_spaces = {name: observation_space(self.worlds) for name in self.possible_agents}
        self.action_spaces = {name: action_space(self.worlds) for name in self.possible_agents}
        self.render_mode = checked_mode(render_mode)
        self._random = gymnasium.utils.seeding.np_random(None)[0]

    def observation_space(self, agent: str) -> gymnasium.Space[Any]:
        """Space of the observations of an agent."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.Space[Any]:
        """Space of the actions of an agent."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Begin an episode in the scenario of the seed `options["scenario_seed"]`, or of a seed that is drawn."""
        if seed is not None:
            self._random = gymnasium.utils.seeding.np_random(seed)[0]
        self.scenes.begin(self.worlds, 0, self._random, options)
        if self._names() != self.possible_agents:
            raise InvalidInput(f"scenario: expected the robots {self.possible_agents}, found {self._names()}")
        self.agents = list(self.possible_agents)
        self.close()
        self._show()
        return self._observations(self.agents), {name: {"time": 0.0} for name in self.agents}

    def step(
        self, actions: Mapping[str, Array]
    ) -> tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Follow the actions of all agents for one period."""
        mapping(actions, "actions by names of agents", "actions")
        if set(actions) != set(self.agents):
            raise InvalidInput(f"actions: expected one of each of {self.agents}, found {list(actions)}")
        rows = {name: self.possible_agents.index(name) for name in self.agents}
        given = np.zeros(self.worlds.position.shape)
        for name, row in rows.items():
            given[0, row] = array_of(actions[name], f"actions[{name!r}]", (self.worlds.dimension,))
        made, acted = self.worlds.step(given), list(self.agents)
        rewards, clearances, outcomes = (column[0].tolist() for column in made)
        time = float(self.worlds.steps[0] * self.worlds.period)
        infos = {name: information(outcomes[k], clearances[k], time) for name, k in rows.items()}
        self.agents = [name for name in acted if outcomes[rows[name]] == RUNNING]
        self._show()
        return (
            self._observations(acted),
            {name: rewards[k] for name, k in rows.items()},
            {name: outcomes[k] not in (RUNNING, TIME) for name, k in rows.items()},
            {name: outcomes[k] == TIME for name, k in rows.items()},
            infos,
        )

    def _names(self) -> list[str]:
        return [robot.name for robot in self.worlds.scenarios[0].robots]

    def _observations(self, agents: list[str]) -> dict[str, Observation]:
        seen = self.worlds.observations()[0]
        return {name: seen[self.possible_agents.index(name)] for name in agents}
