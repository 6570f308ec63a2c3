"""Wrapper of gymnasium for vector environments: the actions of many robots become the nearest certified ones."""

from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper

from slalom.adapters.gym.certifier import Certifier, rules_of, shared_tables
from slalom.adapters.gym.vector import Observations, RobotsEnv
from slalom.checks import Array, array_of
from slalom.decision import Outcome
from slalom.errors import InvalidInput
from slalom.kernels.arrays import Flags
from slalom.methods import Method

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
        self._robots, self._rules, self._tables = inner, rules_of(method, margin, horizon), shared_tables()
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
            applied[w], intervened[w], outcomes[w] = made.applied, made.intervened, made.decision.outcome
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
