"""Robots of a fleet that decide by one method: their settings, and how they predict the other robots."""

import numpy as np

from slalom.checks import Array
from slalom.decision.robot_tables import publish
from slalom.kernels.arrays import Flags, Indices
from slalom.kernels.decision.tables import DecisionSettings, RobotTable
from slalom.linear_forecast import linear_forecast
from slalom.methods import Method
from slalom.tolerances import FORECAST_HORIZONS
from slalom.trajectory import ConstantAcceleration


class Policy:
    """The robots `rows` (m,) of a fleet, which decide by `method`.

    Attributes:
        published: (n,) whether a robot publishes its committed manoeuvre to these robots; the states of the others are
            observed.
    """

    def __init__(self, method: Method, rows: Indices, publishes: Flags, horizon: float) -> None:
        self.method, self.rows, self.horizon = method, rows, horizon
        self.published = publishes & method.shared
        self._forecast = linear_forecast(method.robot_forecast, FORECAST_HORIZONS * horizon)

    @property
    def tabulated(self) -> bool:
        """Whether no path needs more pieces than `pieces`."""
        return bool(self.published.all()) or self._forecast is not None

    @property
    def pieces(self) -> int:
        """Number of pieces of a predicted path in tables; 0 where nothing is predicted in tables."""
        return 0 if self.published.all() or self._forecast is None else len(self._forecast.shares)

    def settings(
        self, now: float, period: float, patience: float, detours: tuple[float, ...], table: RobotTable, dimension: int
    ) -> DecisionSettings:
        """The settings of the decisions at `now` [s], until the next ones after `period` [s]."""
        method, priority = self.method, table.each["priority"]
        own, lowest = priority[self.rows].max(), priority.min()
        return DecisionSettings(
            dimension=dimension,
            now=float(now),
            period=float(period),
            horizon=float(self.horizon),
            regain=np.inf if method.regain is None else float(method.regain),
            patience=float(patience),
            share=float(method.share),
            least_share=float(method.share * lowest / (method.share * lowest + (1.0 - method.share) * own)),
            agrees=method.agrees,
            stops_at_obstacles=method.stops_at_obstacles,
            shared=method.shared,
            detours=np.array(detours, dtype=np.float64),
            budget=np.inf,
        )

    def observe(self, table: RobotTable, d: int, now: float, states: Array | None, times: Array | None) -> None:
        """Write the paths on which these robots predict all robots into `table`.

        Args:
            states: (n, 3, 3), observed at `times` (n,) [s]; None: as they are now.
        """
        if self.published.all():
            # A new committed manoeuvre is observed at once.
            return
        if states is None:
            states = np.stack([table.each[name] for name in ("position", "velocity", "acceleration")], axis=1)
        time = np.full(len(states), now) if times is None else times
        observed = np.flatnonzero(~self.published)
        rule = self._forecast
        if rule is not None and time.min() + rule.times[-1] >= now + self.horizon:
            q = len(rule.shares)
            table.observed.times[observed, : q + 1] = time[observed, None] + rule.times
            table.observed.times[observed, q + 1 :] = time[observed, None] + rule.times[-1]
            table.observed.points[observed, :q] = rule.points(states[observed])
        else:
            for k in observed[table.each["present"][observed]]:
                self._predict(k, table, d, now, states[k, :, :d], float(time[k]))
        for k in np.flatnonzero(self.published).tolist():
            publish(table, k)

    def _predict(self, k: int, table: RobotTable, d: int, now: float, state: Array, time: float) -> None:
        """Write the predicted path of robot k, observed in `state` (3, d) at `time` [s]."""
        observed = ConstantAcceleration(state[0], state[1], state[2], time)
        path = self.method.robot_forecast(observed, time).path(now, now + self.horizon)
        count = len(path.points)
        table.observed.times[k] = path.times[-1]
        table.observed.times[k, : count + 1] = path.times
        table.observed.points[k, :count, :, :d] = path.points
