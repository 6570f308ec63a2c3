"""Robots with committed manoeuvres: what each knows of the others, and the decisions that change the manoeuvres."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TypeVar

import numpy as np

from slalom import kernels
from slalom.checks import Array, has, not_negative, positive
from slalom.decision import Outcome
from slalom.decision_tables import (
    Skeletons,
    bounds_of,
    commit_to,
    response_table,
    robot_table,
    target_paths,
)
from slalom.errors import InvalidInput
from slalom.fleet.rounds import FallBack, at_once, one_by_one
from slalom.goal import Goal
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import DecisionSettings, DecisionTables, GrownBodies, RobotTable
from slalom.limits import Limits
from slalom.linear_forecast import linear_forecast, piecewise_polynomial
from slalom.manoeuvre import Manoeuvre
from slalom.methods import HOLDS, Method, margin_among
from slalom.navigator import FALL_BACK, OUTCOMES, Navigator
from slalom.navigator_tables import ARRIVE
from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.obstacle_window import Obstacles, ObstacleWindow, listed
from slalom.path_goal import PathGoal
from slalom.response import AccelerateThenBrake
from slalom.shape import Shape
from slalom.state import State
from slalom.tolerances import DETOURS, FORECAST_HORIZONS, PATH_BRAKING, REST_DURATION, WHOLE_PERIODS
from slalom.trajectory import ConstantAcceleration, Stationary

T = TypeVar("T")


class CommittedFleet:
    """Robots that decide by one method. `fleet.Fleet` has the loop of a caller, the simulator its own.

    Attributes:
        table: the robots, see `kernels.decision.tables.RobotTable`. responses: of all kinds of robots, as tables.
        progress: [m] of each robot along its path; None where it follows none.
        skeletons: kinds of shapes. targets: motion of targets that move. margin_among: [m] between robots.
    """

    def __init__(
        self,
        method: Method,
        shapes: Shape | Sequence[Shape],
        limits: Limits | Sequence[Limits],
        *,
        robots: int | None = None,
        names: Sequence[str] | None = None,
        obstacles: Sequence[Obstacle] | ObstacleTable = (),
        period: float = 0.1,
        horizon: float = 6.0,
        margin: float = 0.05,
        holds: tuple[float, ...] = HOLDS,
        patience: float = 0.1,
        detours: tuple[float, ...] = DETOURS,
        threads: int | None = None,
    ) -> None:
        has(method, ("responses", "forecast"), "a method, such as method('nao')", "method")
        if method.looks_ahead:
            raise InvalidInput(f"method: expected one for several robots, found {method.name}, which is for one")
        n = _count(shapes, limits, robots)
        self.shapes, self.limits = _each(shapes, n), _each(limits, n)
        self.names = [f"robot {k}" for k in range(n)] if names is None else list(names)
        self.method = method.among_robots()
        self.obstacles = obstacles if isinstance(obstacles, ObstacleTable) else ObstacleTable(obstacles)
        self.period, self.horizon = positive(period, "period"), positive(horizon, "horizon")
        self.margin, self.holds, self.patience, self.detours = margin, holds, patience, detours
        self.threads = kernels.threads() if threads is None else threads
        dimensions = sorted({each.dimension for each in (*self.shapes, *self.obstacles)})
        if len(dimensions) != 1:
            raise InvalidInput(f"shapes: expected those of robots and obstacles in one dimension, found {dimensions}")
        self.dimension, self.skeletons = dimensions[0], Skeletons(self.shapes)
        if self.method.shared:
            self._refuse_short_horizon()
        most = max(each.max_acceleration for each in self.limits)
        self.margin_among = margin_among(self.method, not_negative(margin, "margin"), most, self.period)
        self.table, self.texts = self._tables()
        self._bounds = bounds_of(self.limits, [_rest(self.dimension)] * n)
        self._turning = any(each.bounds for each in self.limits)
        self.targets, _ = target_paths([], 0.0, 1.0)
        # The response of each robot whose manoeuvre is not in the tables.
        self.other_texts, self._steps = [""] * n, 0
        self._known = np.zeros(n, np.bool_)
        self.progress: list[float | None] = [None] * n
        self._last = -np.inf

    def _tables(self) -> tuple[RobotTable, list[str]]:
        """The table of robots, and the responses as text."""
        n, distinct = len(self.limits), dict[Limits, int]()
        kind = np.array([distinct.setdefault(limits, len(distinct)) for limits in self.limits])
        kinds = tuple(self.method.responses(limits, self.period, self.holds) for limits in distinct)
        self.responses = response_table(kinds, self.horizon, self.span, self.dimension)
        pieces = max(3, int(np.diff(self.responses.first).max()))
        self.forecast = (
            None
            if self.method.shared
            else linear_forecast(self.method.robot_forecast, FORECAST_HORIZONS * self.horizon)
        )
        table = robot_table(n, pieces, pieces if self.forecast is None else len(self.forecast.shares))
        table.kind[:], table.skeleton[:], table.rounding[:] = kind, self.skeletons.kind, self.skeletons.rounding
        table.radius[:] = [shape.bounding_radius for shape in self.shapes]
        table.max_speed[:] = [limits.max_speed for limits in self.limits]
        table.max_acceleration[:] = [limits.max_acceleration for limits in self.limits]
        table.braking[:] = [limits.braking for limits in self.limits]
        return table, [repr(response) for each in kinds for response in each]

    @property
    def span(self) -> float:
        """Duration [s] of the committed paths; those that end at rest last for ever."""
        return 2.0 * self.horizon

    def _refuse_short_horizon(self) -> None:
        """Raise InvalidInput for a manoeuvre that lasts longer than the horizon.

        Robots can avoid a robot at rest for all time, but not one that still moves after the horizon.
        """
        for name, limits in zip(self.names, self.limits, strict=True):
            for response in self.method.responses(limits, self.period, self.holds):
                end = response.knots(1e6, 1.0)[-2]
                if end > self.horizon:
                    raise InvalidInput(
                        f"horizon: expected at least {end:g} s, the longest manoeuvre of {name!r}, "
                        f"found {self.horizon:g} s"
                    )

    def settings(self, now: float, period: float | None = None) -> DecisionSettings:
        """The settings of the decisions at `now` [s], until the next ones after `period` [s]."""
        method = self.method
        return DecisionSettings(
            dimension=self.dimension,
            now=now,
            period=self.period if period is None else period,
            horizon=self.horizon,
            margin=self.margin_among,
            regain=np.inf if method.regain is None else method.regain,
            patience=self.patience,
            share=method.share,
            shared=method.shared,
            detours=np.array(self.detours),
        )

    def follow(self, paths: Mapping[int, PathGoal], window: ObstacleWindow) -> None:
        """Give the robots with paths, by row, the targets and largest speeds of their next step on them."""
        table, d = self.table, self.dimension
        for k, path in paths.items():
            limits, shape = self.limits[k], self.shapes[k]
            step = path.step(
                table.position[k, :d],
                self.progress[k],
                limits.max_speed,
                PATH_BRAKING * limits.braking,
                self.period,
                shape.bounding_radius,
                partial(window.covers, robot=shape, margin=self.margin),
            )
            self.progress[k], table.max_speed[k], table.final[k] = step.progress, step.max_speed, step.final
            table.target[k, :d] = step.goal.position(0.0)
            table.tolerance[k], table.stop[k] = step.goal.tolerance, step.goal.stop

    def observe(self, now: float, states: Array | None = None, times: Array | None = None) -> None:
        """Predict the paths of all robots from `states` (n, 3, 3), observed at `times` (n,) [s]; None: as they are now.

        Nothing for shared manoeuvres, which are known.
        """
        table, d = self.table, self.dimension
        if self.method.shared:
            return
        if states is None:
            states = np.stack([table.position, table.velocity, table.acceleration], axis=1)
        time = np.full(len(states), now) if times is None else times
        if self.forecast is not None and time.min() + self.forecast.times[-1] >= now + self.horizon:
            table.observed_times[:] = time[:, None] + self.forecast.times
            table.observed_points[:] = self.forecast.points(states)
            return
        for k in np.flatnonzero(table.present):
            position, velocity, acceleration = states[k, :, :d]
            observed = ConstantAcceleration(position, velocity, acceleration, float(time[k]))
            path = self.method.robot_forecast(observed, float(time[k])).path(now, now + self.horizon)
            count = len(path.points)
            table.observed_times[k] = path.times[-1]
            table.observed_times[k, : count + 1] = path.times
            table.observed_points[k, :count, :, :d] = path.points

    def grown_bodies(self, obstacles: Obstacles, now: float) -> list[GrownBodies]:
        """Predicted passive obstacles and the robots, grown by each kind of skeleton."""
        return self.grown_bodies_of(ObstacleWindow.predicted(obstacles, self.method.forecast, now, self.horizon))

    def grown_bodies_of(self, window: ObstacleWindow) -> list[GrownBodies]:
        """As `grown_bodies`, for obstacles on predicted trajectories."""
        kinds, detours = range(len(self.skeletons.shapes)), bool(self.detours)
        return [self.skeletons.grown_bodies(k, window, detours=detours) for k in kinds]

    def decide(
        self,
        order: Indices,
        settings: DecisionSettings,
        bodies: list[GrownBodies],
        fall_back: FallBack | None = None,
    ) -> dict[int, Outcome]:
        """Commit the robots (rows) in `order` to new manoeuvres, from what the table holds of the others; by row.

        With shared manoeuvres each robot avoids the decisions of those before it. `fall_back` decides where the policy
        does not; None: `Navigator` among the obstacles of the fleet.
        """
        if self._turning:
            table, d = self.table, self.dimension
            states = [State(table.position[k, :d], table.velocity[k, :d]) for k in range(len(self.limits))]
            self._bounds = bounds_of(self.limits, states)
        decide_all = one_by_one if self.method.shared else at_once
        usual = fall_back or (lambda k: self.fall_back(k, self.obstacles, settings.now))
        fallen: dict[int, Outcome] = {}
        for some in self._by_skeleton(order):
            own = bodies[self.table.skeleton[some[0]]]
            tables = DecisionTables(self.table, own, self.responses, self._bounds, self.targets, settings)
            fallen.update(decide_all(some, tables, usual, self.threads))
        found = self.table.outcome.tolist()
        return {k: fallen[k] if k in fallen else OUTCOMES[found[k]] for k in order.tolist()}

    def _by_skeleton(self, some: Indices) -> Iterator[Indices]:
        """Robots with one kind of skeleton each; in their order where each avoids the decisions before its own."""
        kinds = self.table.skeleton[some]
        if not self.method.shared:
            some = some[np.argsort(kinds, kind="stable")]
            kinds = np.sort(kinds)
        for part in np.split(some, np.flatnonzero(np.diff(kinds)) + 1):
            if len(part):
                yield part

    def fall_back(self, k: int, obstacles: Obstacles, now: float, rows: Indices | None = None) -> Outcome:
        """Commit the robot in row k to the decision of a navigator among `obstacles` and the other robots.

        `rows`: the number of the robot in each row of the table; None: the rows are the robots.
        """
        table, d = self.table, self.dimension
        number = np.arange(len(self.shapes)) if rows is None else rows
        state = State(table.position[k, :d], table.velocity[k, :d], table.acceleration[k, :d])
        others = [
            Obstacle(
                self.shapes[number[j]], piecewise_polynomial(table.observed_times[j], table.observed_points[j, ..., :d])
            )
            for j in np.flatnonzero(table.present)
            if j != k
        ]
        position = (
            table.target[k, :d] if table.objective[k] == ARRIVE else state.position + self.horizon * table.wanted[k, :d]
        )
        goal = Goal(Stationary(position), float(max(table.tolerance[k], 1e-9)), bool(table.stop[k]))
        navigator = Navigator(
            self.method,
            self.shapes[k],
            self.limits[k],
            period=self.period,
            horizon=self.horizon,
            margin=self.margin_among,
            holds=self.holds,
            patience=self.patience,
            detours=self.detours,
        )
        decision = navigator.fall_back(state, [*listed(obstacles), *others], goal, now=now)
        self.commit(k, decision.manoeuvre, now)
        table.outcome[k], table.regret[k] = FALL_BACK, 0.0
        return decision.outcome

    def commit(self, k: int, manoeuvre: Manoeuvre, now: float) -> None:
        """Commit the robot in row k to a manoeuvre that is not in the tables."""
        table, d = self.table, self.dimension
        path = manoeuvre.path(now, now + self.span)
        commit_to(table, k, path)
        if isinstance(manoeuvre.response, AccelerateThenBrake):
            table.committed_times[k, len(path.points) :] = now + REST_DURATION
        if self.method.shared:
            table.observed_times[k], table.observed_points[k] = table.committed_times[k], table.committed_points[k]
        table.response[k], self.other_texts[k] = -1, repr(manoeuvre.response)
        table.control[k, :d] = manoeuvre.control

    def committed_responses(self) -> tuple[str, ...]:
        """The responses of the committed manoeuvres, as text."""
        rows = self.table.response.tolist()
        return tuple(self.texts[r] if r >= 0 else other for r, other in zip(rows, self.other_texts, strict=True))

    def planned(self, t: float) -> tuple[Array, Array]:
        """Velocities (n, 3) [m/s] and positions (n, 3) [m] at time t [s] on the committed paths."""
        times, rows = self.table.committed_times, np.arange(len(self.table.committed_times))
        piece = np.minimum((times[:, 1:] < t).sum(axis=1), self.table.committed_points.shape[1] - 1)
        begin = times[rows, piece]
        width = (times[rows, piece + 1] - begin)[:, None]
        x, p = (t - begin)[:, None] / np.where(width > 0.0, width, 1.0), self.table.committed_points[rows, piece]
        p0, p1, p2, p3 = p[:, 0], p[:, 1], p[:, 2], p[:, 3]
        slope = (1 - x) ** 2 * (p1 - p0) + 2 * x * (1 - x) * (p2 - p1) + x * x * (p3 - p2)
        position = (1 - x) ** 3 * p0 + 3 * x * (1 - x) ** 2 * p1 + 3 * x * x * (1 - x) * p2 + x**3 * p3
        return 3.0 * slope / np.where(width > 0.0, width, 1.0), position


def first_manoeuvre(state: State, limits: Limits, period: float, now: float) -> Manoeuvre:
    """The manoeuvre of a robot before its first decision: constant velocity for one period, then even braking."""
    speed = float(np.linalg.norm(state.velocity))
    brake = max(period, np.ceil(speed / limits.braking / period - WHOLE_PERIODS) * period)
    return Manoeuvre(AccelerateThenBrake(period, brake), state, np.zeros(state.dimension), now)


def _rest(dimension: int) -> State:
    return State(np.zeros(dimension), np.zeros(dimension))


def _count(shapes: object, limits: object, robots: int | None) -> int:
    """The number of robots. Raises InvalidInput if it is not given, or given twice and differently."""
    counts = {len(each) for each in (shapes, limits) if isinstance(each, Sequence)}
    if robots is not None:
        counts.add(robots)
    if len(counts) != 1 or min(counts) < 1:
        raise InvalidInput(f"robots: expected one number above 0, by shapes, limits or robots, found {sorted(counts)}")
    return counts.pop()


def _each(value: T | Sequence[T], n: int) -> list[T]:
    return list(value) if isinstance(value, Sequence) else [value] * n
