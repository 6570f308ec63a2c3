"""Settings of each robot of a fleet: method, shape, limits, margin, priority and world."""

from collections import Counter
from collections.abc import Sequence
from typing import Final, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from slalom.base.checks import LIMITS, METHOD, SHAPE, Array, each_number, has, listing, text, whole, whole_numbers
from slalom.base.errors import InvalidInput
from slalom.decision.methods import Method
from slalom.decision.settings import Settings
from slalom.decision.tables import publish
from slalom.forecast.linear import linear_forecast
from slalom.kernels.arrays import Flags, Indices
from slalom.kernels.decision.tables import DecisionSettings, RobotTable
from slalom.model.limits import Limits
from slalom.model.shape import Shape
from slalom.model.trajectory import ConstantAcceleration
from slalom.obstacle.window import Reaction

PRIORITY_RATIO: Final = 10.0
"""[1] Largest ratio of the priorities of two robots in a fleet. Larger: a robot may leave almost all of the avoidance
to the other, and more bodies are in reach of a decision. Smaller: less difference between robots."""


T = TypeVar("T")


class Members(NamedTuple):
    """The n robots of a fleet."""

    methods: list[Method]  # among robots
    shapes: list[Shape]
    limits: list[Limits]
    names: list[str]
    margins: Array  # (n,) [m] from obstacles
    priorities: Array  # (n,)
    worlds: Indices  # (n,)


def members_of(
    method: Method | Sequence[Method],
    shapes: Shape | Sequence[Shape],
    limits: Limits | Sequence[Limits],
    robots: int | None,
    names: Sequence[str] | None,
    margin: npt.ArrayLike,
    priority: npt.ArrayLike,
    worlds: npt.ArrayLike | None,
) -> Members:
    """The robots of a fleet, see `Fleet`.

    Raises:
        InvalidInput: sequences of different lengths, equal names, a method for one robot alone, values out of range, a
            priority among robots whose method does not share the avoidance.
    """
    n = _count((method, shapes, limits), robots)
    for k, (shape, each) in enumerate(zip(_each(shapes, n), _each(limits, n))):
        has(shape, *SHAPE, f"shapes[{k}]")
        has(each, *LIMITS, f"limits[{k}]")
    if names is not None:
        listing(names, "names", "names")
        if len(names) != n:
            raise InvalidInput(f"names: expected {n}, one for each of the robots, found {len(names)}")
        counts = Counter(text(name, f"names[{k}]") for k, name in enumerate(names))
        twice = [name for name, count in counts.items() if count > 1]
        if twice:
            raise InvalidInput(f"names: expected different ones, found {twice[0]!r} more than once")
    methods = [one.among_robots() for one in _methods(method, n)]
    margins, priorities = each_number(margin, "margin", n), each_number(priority, "priority", n)
    if np.any(margins < 0.0):
        raise InvalidInput(f"margin: expected 0 m or more, found {margins.min():g} m")
    if not (priorities.min() > 0.0 and priorities.max() <= PRIORITY_RATIO * priorities.min()):
        found = f"{priorities.min():g} to {priorities.max():g}"
        raise InvalidInput(
            f"priority: expected numbers above 0 with a ratio of at most {PRIORITY_RATIO:g}, found {found}"
        )
    for one, own in zip(methods, priorities):
        if np.any(priorities != own) and one.share == 1.0 and not one.shared:
            raise InvalidInput(f"priority: expected a method that shares the avoidance, found {one.name}")
    return Members(
        methods,
        _each(shapes, n),
        _each(limits, n),
        [f"robot {k}" for k in range(n)] if names is None else list(names),
        margins,
        priorities,
        np.zeros(n, np.int64) if worlds is None else whole_numbers(worlds, "worlds", n),
    )


def _methods(method: Method | Sequence[Method], n: int) -> list[Method]:
    methods = _each(method, n)
    for one in methods:
        has(one, *METHOD, "method")
        if one.looks_ahead:
            raise InvalidInput(f"method: expected one for several robots, found {one.name}, which is for one")
    return methods


def _count(given: Sequence[object], robots: int | None) -> int:
    """The number of robots. Raises InvalidInput if it is not given, or given twice and differently."""
    counts = {len(each) for each in given if isinstance(each, Sequence)}
    if robots is not None:
        counts.add(whole(robots, "robots", 1))
    if len(counts) != 1 or min(counts) < 1:
        expected = "one number above 0, by methods, shapes, limits or robots"
        raise InvalidInput(f"robots: expected {expected}, found {sorted(counts)}")
    return counts.pop()


def _each(value: T | Sequence[T], n: int) -> list[T]:
    return list(value) if isinstance(value, Sequence) else [value] * n


# Robots of a fleet that decide by one method: their settings, and how they predict the other robots.


FORECAST_HORIZONS: Final = 10.0
"""[1] Duration of the tables of predicted robots, in horizons. Older observations are predicted one by one. Larger:
tables of forecasts that are not polynomials have more pieces. Smaller: late sensing is slower."""


class Policy:
    """The robots `rows` (m,) of a fleet, which decide by `method`.

    Attributes:
        navigator: with this method, and the settings that all robots have in common.
        published: (n,) whether a robot publishes its committed manoeuvre to these robots; the states of the others are
            observed.
    """

    def __init__(self, navigator: Settings, rows: Indices, publishes: Flags) -> None:
        self.method = navigator.method
        self.rows = rows
        self.horizon = navigator.horizon
        self.reaction = Reaction(navigator.limits, navigator.period)
        self._settings = navigator.numbers(among=True)._replace(shared=self.method.shared)
        self.published = publishes & self.method.shared
        self._forecast = linear_forecast(self.method.robot_forecast, FORECAST_HORIZONS * self.horizon)

    @property
    def tabulated(self) -> bool:
        """Whether no path needs more pieces than `pieces`."""
        return bool(self.published.all()) or self._forecast is not None

    @property
    def pieces(self) -> int:
        """Number of pieces of a predicted path in tables; 0 where nothing is predicted in tables."""
        return 0 if self.published.all() or self._forecast is None else len(self._forecast.shares)

    def settings(self, now: float, period: float, table: RobotTable) -> DecisionSettings:
        """The settings of the decisions at `now` [s], until the next ones after `period` [s]."""
        share, priority = self.method.share, table.each["priority"]
        own, lowest = priority[self.rows].max(), priority.min()
        least = float(share * lowest / (share * lowest + (1.0 - share) * own))
        return self._settings._replace(now=float(now), period=float(period), least_share=least)

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
