"""Nearest certified accelerations of the robot in one world, step by step."""

from collections.abc import MutableMapping
from dataclasses import replace
from typing import NamedTuple
from weakref import WeakValueDictionary

import numpy as np

from slalom.adapters.gym.worlds import Worlds
from slalom.checks import METHOD, Array, has
from slalom.decision import Decision
from slalom.methods import Method, method as method_named
from slalom.objective import FollowAcceleration
from slalom.obstacle.table import ObstacleTable
from slalom.tolerances import INTERVENTION

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
        self._worlds, self._w, self._scenario = worlds, w, worlds.scenarios[w]
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
