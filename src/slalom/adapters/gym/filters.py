"""Nearest certified accelerations of the robot in one world, step by step."""

from collections.abc import MutableMapping
from dataclasses import replace
from typing import Any, Final, NamedTuple
from weakref import WeakValueDictionary

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper

from slalom.adapters.gym.environments import Observation, Observations, RobotEnv, RobotsEnv
from slalom.adapters.gym.worlds import Worlds
from slalom.base.checks import METHOD, Array, array_of, has
from slalom.base.errors import InvalidInput
from slalom.decision import Decision, Outcome
from slalom.decision.methods import Method, method as method_named
from slalom.decision.objective import FollowAcceleration
from slalom.kernels.arrays import Flags
from slalom.obstacle.table import ObstacleTable

INTERVENTION: Final = 1e-6
"""[1] A filter has intervened if it changes an acceleration by more than this, in units of the largest one.

Larger: small changes count as none. Smaller: rounding counts as an intervention.
"""


Tables = MutableMapping[int, ObstacleTable]


class Filtered(NamedTuple):
    """Result of a filter for one action."""

    wanted: Array  # (d,) [m/s^2]
    applied: Array  # (d,) [m/s^2]
    intervened: bool
    decision: Decision


class Rules(NamedTuple):
    """Settings of a filter; `margin` [m] and `horizon` [s] of None are those of the scenario."""

    method: Method
    margin: float | None
    horizon: float | None


def rules_of(method: Method | str, margin: float | None, horizon: float | None) -> Rules:
    """The settings of a filter. Raises InvalidInput for an unknown method."""
    chosen = method_named(method) if isinstance(method, str) else method
    has(chosen, *METHOD, "method")
    return Rules(chosen, margin, horizon)


def shared_tables() -> Tables:
    """Tables by the number of their scenario, kept while a certifier holds them."""
    return WeakValueDictionary()


class Certifier:
    """Robot of world w whose accelerations become the nearest certified ones during one episode.

    Attributes:
        decision: of the last step; None before the first one.

    Raises:
        InvalidInput: settings that no navigator accepts.
    """

    def __init__(self, worlds: Worlds, w: int, rules: Rules, tables: Tables) -> None:
        self._worlds = worlds
        self._w = w
        self._scenario = worlds.scenarios[w]
        usual = self._scenario.navigator(rules.method)
        self._navigator = replace(
            usual,
            method=rules.method,
            holds=tuple(sorted({worlds.period, *usual.holds})),
            patience=0.0,
            margin=usual.margin if rules.margin is None else rules.margin,
            horizon=usual.horizon if rules.horizon is None else rules.horizon,
        )
        # The scenario is held as long as its table, so no other one has its number meanwhile.
        key = id(self._scenario)
        if key not in tables:
            self._table = tables[key] = ObstacleTable(self._scenario.obstacles)
        self._table = tables[key]
        self.decision: Decision | None = None

    def certified(self, wanted: Array) -> Filtered:
        """The acceleration (d,) [m/s^2] nearest to the wanted one that is collision-free up to the horizon.

        Raises:
            InvalidInput: a method that does not set the acceleration at once.
        """
        now = self._worlds.now(self._w)
        self.decision = self._navigator.decide(
            self._worlds.state(self._w),
            self._table,
            now=now,
            previous=self.decision,
            objective=FollowAcceleration(wanted),
        )
        applied = self.decision.manoeuvre.mean_acceleration(now, self._worlds.period)
        changed = float(np.linalg.norm(applied - wanted)) > INTERVENTION * self._navigator.limits.max_acceleration
        return Filtered(wanted, applied, changed, self.decision)


# ---------------------------------------------------------------------------------------------------------------------
# Wrapper of gymnasium that replaces the action of any policy by the nearest certified one.


class SafetyFilter(gymnasium.Wrapper[Observation, Array, Observation, Array]):
    """A policy of which each action becomes the nearest acceleration that is collision-free up to the horizon.

    A manoeuvre holds that acceleration and then coasts or stops. A step at which no manoeuvre is safe continues the
    last one, which stays safe up to its horizon as long as the forecasts hold. `info` describes the step:
    `intervened`, whether the applied acceleration differs from that of the policy; `wanted` and `applied` (d,) [m/s^2];
    `filter`, the outcome of the decision; and `certified`, whether it is safe.

    Attributes:
        decision: the decision of the last step; None before the first one.

    Args:
        env: a `RobotEnv`, possibly in other wrappers. method: a row of the table of methods or its name. With nao the
            future of obstacles is given, with nao@observed it is predicted from observations.
        margin: [m] to keep from obstacles; None: that of the scenario. horizon: [s]; None: that of the scenario.

    Raises:
        InvalidInput: another environment; a method that does not set the acceleration at once, for example vo.
    """

    def __init__(
        self,
        env: gymnasium.Env[Observation, Array],
        method: Method | str = "nao",
        *,
        margin: float | None = None,
        horizon: float | None = None,
    ) -> None:
        inner = getattr(env, "unwrapped", env)
        if not isinstance(inner, RobotEnv):
            raise InvalidInput(f"env: expected a RobotEnv, possibly wrapped, found {inner}")
        super().__init__(env)
        self._robot, self._rules = inner, rules_of(method, margin, horizon)
        self._certifier = self._begun()

    @property
    def decision(self) -> Decision | None:
        return self._certifier.decision

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode."""
        found = super().reset(seed=seed, options=options)
        self._certifier = self._begun()
        return found

    def step(self, action: Array) -> tuple[Observation, Any, bool, bool, dict[str, Any]]:
        """Follow the nearest certified action for one period."""
        worlds = self._robot.worlds
        given = array_of(action, "action", (worlds.dimension,))
        wanted = worlds.accelerations(given[None, None])[0, 0]
        made = self._certifier.certified(wanted)
        observation, reward, ended, late, info = self.env.step(worlds.actions(made.applied)[0, 0])
        about = {"intervened": made.intervened, "wanted": wanted, "applied": made.applied}
        outcome = made.decision.outcome
        return observation, reward, ended, late, {**info, **about, "filter": outcome.name, "certified": outcome.safe}

    def _begun(self) -> Certifier:
        return Certifier(self._robot.worlds, 0, self._rules, shared_tables())


# ---------------------------------------------------------------------------------------------------------------------
# Wrapper of gymnasium for vector environments: the actions of many robots become the nearest certified ones.


NO_FILTER = ""
"""`info["filter"]` of a world that begins an episode in this step."""


class VectorSafetyFilter(VectorWrapper):
    """`SafetyFilter` for all robots of a `RobotsEnv`, with its arguments.

    Each robot does what it does in a `SafetyFilter` of its own, to the bit. `info` holds the same entries as arrays:
    `intervened`, `certified` and `filter` (n,), `wanted` and `applied` (n, d) [m/s^2]. In a world that begins an
    episode in this step nothing is applied: `intervened` is false, `certified` is true and `filter` is empty.

    Raises:
        InvalidInput: another environment; a method that does not set the acceleration at once, for example vo.
    """

    def __init__(
        self,
        env: VectorEnv[Any, Any, Any],
        method: Method | str = "nao",
        *,
        margin: float | None = None,
        horizon: float | None = None,
    ) -> None:
        inner = getattr(env, "unwrapped", env)
        if not isinstance(inner, RobotsEnv):
            raise InvalidInput(f"env: expected a RobotsEnv, possibly wrapped, found {inner}")
        super().__init__(env)
        self._robots = inner
        self._rules = rules_of(method, margin, horizon)
        self._tables = shared_tables()
        self._certifiers = [self._begun(w) for w in range(inner.num_envs)]

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Observations, dict[str, Any]]:
        """Begin an episode in every world."""
        found = super().reset(seed=seed, options=options)
        self._certifiers = [self._begun(w) for w in range(self._robots.num_envs)]
        return found

    def step(self, actions: Array) -> tuple[Observations, Array, Flags, Flags, dict[str, Any]]:
        """Follow the nearest certified actions for one period."""
        worlds = self._robots.worlds
        given = array_of(actions, "actions", (self._robots.num_envs, worlds.dimension))
        wanted = worlds.accelerations(given[:, None])[:, 0]
        applied, running = np.zeros_like(wanted), worlds.acting[:, 0].copy()
        intervened, outcomes = np.zeros(len(wanted), np.bool_), dict[int, Outcome]()
        for w in np.flatnonzero(running).tolist():
            made = self._certifiers[w].certified(wanted[w])
            applied[w] = made.applied
            intervened[w] = made.intervened
            outcomes[w] = made.decision.outcome
        wanted[~running] = 0.0
        observations, rewards, ended, late, info = self.env.step(worlds.actions(applied[:, None])[:, 0])
        for w in np.flatnonzero(~running).tolist():
            self._certifiers[w] = self._begun(w)
        rows = range(len(wanted))
        about = {
            "intervened": intervened,
            "wanted": wanted,
            "applied": applied,
            "filter": np.array([outcomes[w].name if w in outcomes else NO_FILTER for w in rows]),
            "certified": np.array([w not in outcomes or outcomes[w].safe for w in rows]),
        }
        return observations, rewards, ended, late, {**info, **about, **{f"_{name}": running for name in about}}

    def _begun(self, w: int) -> Certifier:
        return Certifier(self._robots.worlds, w, self._rules, self._tables)
