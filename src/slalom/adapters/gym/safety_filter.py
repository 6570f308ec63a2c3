"""Wrapper of gymnasium that replaces the action of any policy by the nearest certified one."""

from typing import Any

import gymnasium

from slalom.adapters.gym.certifier import Certifier, rules_of, shared_tables
from slalom.adapters.gym.robot import Observation, RobotEnv
from slalom.checks import Array, array_of
from slalom.decision import Decision
from slalom.errors import InvalidInput
from slalom.methods import Method


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
