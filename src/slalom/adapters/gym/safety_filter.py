"""Wrapper of gymnasium that replaces the action of any policy by the nearest certified one."""

from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np

from slalom.adapters.gym.robot import Observation, RobotEnv
from slalom.checks import Array
from slalom.decision import Decision
from slalom.decision.navigator import Navigator
from slalom.errors import InvalidInput
from slalom.methods import Method, method as method_named
from slalom.objective import FollowAcceleration
from slalom.obstacle.table import ObstacleTable
from slalom.tolerances import INTERVENTION


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
        super().__init__(env)
        inner = env.unwrapped
        if not isinstance(inner, RobotEnv):
            raise InvalidInput(f"env: expected a RobotEnv, possibly wrapped, found {inner}")
        self._robot, self._method = inner, method_named(method) if isinstance(method, str) else method
        self._margin, self._horizon = margin, horizon
        self._navigator, self._table = self._prepared()
        self.decision: Decision | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode."""
        found = super().reset(seed=seed, options=options)
        self._navigator, self._table = self._prepared()
        self.decision = None
        return found

    def step(self, action: Array) -> tuple[Observation, Any, bool, bool, dict[str, Any]]:
        """Follow the nearest certified action for one period."""
        worlds = self._robot.worlds
        wanted = worlds.accelerations(np.asarray(action, np.float64)[None, None])[0, 0]
        now = worlds.now()
        self.decision = self._navigator.decide(
            worlds.state(), self._table, now=now, previous=self.decision, objective=FollowAcceleration(wanted)
        )
        applied = self.decision.manoeuvre.mean_acceleration(now, worlds.period)
        changed = float(np.linalg.norm(applied - wanted)) > INTERVENTION * self._navigator.limits.max_acceleration
        observation, reward, ended, late, info = self.env.step(worlds.actions(applied)[0, 0])
        about = {"intervened": changed, "wanted": wanted, "applied": applied}
        outcome = self.decision.outcome
        return observation, reward, ended, late, {**info, **about, "filter": outcome.name, "certified": outcome.safe}

    def _prepared(self) -> tuple[Navigator, ObstacleTable]:
        """The navigator of the scenario of this episode, and its obstacles."""
        scenario, period = self._robot.worlds.scenarios[0], self._robot.worlds.period
        usual = scenario.navigator(self._method)
        navigator = replace(
            usual,
            method=self._method,
            holds=tuple(sorted({period, *usual.holds})),
            patience=0.0,
            margin=usual.margin if self._margin is None else self._margin,
            horizon=usual.horizon if self._horizon is None else self._horizon,
        )
        return navigator, ObstacleTable(scenario.obstacles)
