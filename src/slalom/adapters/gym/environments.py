"""Environments of gymnasium and PettingZoo: one robot, one robot in each of many worlds, and a fleet."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import Space
from gymnasium.spaces import Box, Discrete
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from pettingzoo import ParallelEnv

from slalom.adapters.gym.worlds import (
    ARRIVED,
    COLLISION,
    DIRECTIONS,
    OUTCOMES,
    RUNNING,
    TIME,
    Motion,
    Transition,
    Worlds,
)
from slalom.base.checks import Array, array_of, did_you_mean, has, known, listing, mapping, whole
from slalom.base.errors import InvalidInput
from slalom.kernels.arrays import Flags
from slalom.sim.gallery import build
from slalom.sim.scenario import Scenario
from slalom.view.fleet import Picture

# Scenarios of episodes by name or as objects, and the spaces that environments share.


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
    if worlds.command == "discrete":
        return Discrete(DIRECTIONS + 1)
    return Box(-1.0, 1.0, (worlds.dimension,), np.float32)


def observation_space(worlds: Worlds) -> Space[Any]:
    """Space of the observation of one robot; without bounds where a function observes."""
    bound = 1.0 if worlds.observe is None else np.inf
    return Box(-bound, bound, (worlds.size,), np.float32)


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


Observation = npt.NDArray[np.float32]


class RobotEnv(Shown, gymnasium.Env[Observation, Array]):
    """One robot among obstacles that do not avoid it.

    Observations and rewards are those of `worlds.Worlds`. An episode is terminated by arrival or collision, and
    truncated when the duration of the scenario has passed. `info` holds `outcome` (running, arrived, collision, time),
    `is_success`, `clearance` [m] (see `worlds.least_clearances`) and `time` [s] since the start.

    Attributes:
        worlds: the state of the only robot, `worlds.position[0, 0]`.

    Args:
        scenario: a name of the gallery, a scenario, or a function from a seed to a scenario.
        settings: parameters and settings of the gallery. layouts: number of different scenarios, which are built once;
            None: a new one for each episode.
        nearest: number of bodies that are observed.
        command: "acceleration", "velocity", "unicycle" or "discrete", see `Worlds.accelerations`.
        observe: a function of `worlds` that returns observations (W, R, k), such as `Worlds.rays` among others; None:
            those of `Worlds.observations`. reward: a function of `worlds` after a step and its `Transition` that
            returns rewards (W, R); None: those of `Worlds.step`.
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
        observe: Callable[[Worlds], Array] | None = None,
        reward: Callable[[Worlds, Transition], Array] | None = None,
        render_mode: str | None = None,
    ) -> None:
        self.scenes = Scenes(scenario, settings, layouts)
        self.worlds = Worlds([self.scenes.of_seed(0)], nearest, command, observe, reward)
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
        given = array_of(action, "action", self.worlds.action_shape)
        made = self.worlds.step(given[None, None])
        outcome = int(made.outcomes[0, 0])
        time = float(self.worlds.steps[0] * self.worlds.period)
        info = information(outcome, float(made.clearances[0, 0]), time)
        self._show()
        ended, late = outcome not in (RUNNING, TIME), outcome == TIME
        return self.worlds.observations()[0, 0], float(made.rewards[0, 0]), ended, late, info


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
        observe: Callable[[Worlds], Array] | None = None,
        reward: Callable[[Worlds, Transition], Array] | None = None,
        render_mode: None = None,
    ) -> None:
        if render_mode is not None:
            raise InvalidInput(f"render_mode: expected none for many worlds, found {render_mode!r}")
        self.scenes, self.num_envs = Scenes(scenario, settings, layouts), whole(num_envs, "num_envs", 1)
        self.worlds = Worlds([self.scenes.of_seed(0)] * self.num_envs, nearest, command, observe, reward)
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
        given = array_of(actions, "actions", (self.num_envs, *self.worlds.action_shape))
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


class FleetEnv(Shown, ParallelEnv):  # type: ignore[misc]  # PettingZoo has no types
    """Several robots among each other and among obstacles; agents are the names of the robots.

    Observations, rewards and information of each agent are as in `RobotEnv`, with its arguments. Other robots are
    observed like obstacles. An agent whose episode has ended leaves `agents`. Its robot leaves the scene, except one
    that stops at its goal, which stays there.

    Raises:
        InvalidInput: robots whose names depend on the seed.
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
        observe: Callable[[Worlds], Array] | None = None,
        reward: Callable[[Worlds, Transition], Array] | None = None,
        render_mode: str | None = None,
    ) -> None:
        self.scenes = Scenes(scenario, settings, layouts)
        self.worlds = Worlds([self.scenes.of_seed(0)], nearest, command, observe, reward)
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
        given = np.zeros((*self.worlds.acting.shape, *self.worlds.action_shape))
        for name, row in rows.items():
            given[0, row] = array_of(actions[name], f"actions[{name!r}]", self.worlds.action_shape)
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
