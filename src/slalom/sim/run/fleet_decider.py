"""Decisions of all robots of a run by the compiled policy."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from slalom import kernels
from slalom.checks import Array
from slalom.decision import Outcome
from slalom.decision_tables import (
    Skeletons,
    bounds_of,
    commit_to,
    moved_bodies,
    response_table,
    robot_table,
    target_paths,
)
from slalom.forecast import predicted
from slalom.goal import Goal
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import DecisionSettings, DecisionTables, GrownBodies, RobotTable
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method
from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.response import AccelerateThenBrake
from slalom.sim.periodic import displaced, images_about, in_box, to_nearest
from slalom.sim.run.deciders import Decisions, first_manoeuvre, margin_among
from slalom.sim.run.guidance import Guidance
from slalom.sim.run.linear_forecast import linear_forecast, piecewise_polynomial
from slalom.sim.run.messages import Messages, messages_of
from slalom.sim.run.rounds import at_once, one_by_one
from slalom.sim.run.sensing import sensing_of
from slalom.state import State
from slalom.tolerances import DETOURS, FORECAST_HORIZONS, REST_DURATION
from slalom.trajectory import ConstantAcceleration, Stationary, Trajectory

BY_NUMBER = (Outcome.CLEAR, Outcome.CONSTRAINED, Outcome.KEPT, Outcome.CONTINUED, Outcome.SQUEEZED, Outcome.WAITING)
OUTCOMES = tuple(outcome.name for outcome in BY_NUMBER)
"""The outcomes by the kernel's numbers, and last the outcome WAIT, which the kernel never gives."""
WAIT, FALL_BACK = 5, -1
"""The numbers of a robot that may not decide, and of one for which `Navigator` decided as the fallback."""


class FleetDecider:
    """One kernel decides for all robots, `Navigator.fall_back` for a robot without a safe control.

    Committed manoeuvres are cubic pieces over two horizons, or for all time where they end at rest.

    Attributes:
        fleet: all robots, as `kernels.decision.tables.RobotTable`. responses: their responses as tables.
        messages, sensing: None where messages or observations are immediate and exact.
        margin: [m], see `margin_among`. period: [s] between decisions. span: [s] of committed manoeuvres.
    """

    def __init__(self, method: Method, guidance: Guidance, seed: int = 0, threads: int | None = None) -> None:
        self.threads = kernels.threads() if threads is None else threads
        self.method, self.guidance, self.states = method, guidance, guidance.states
        self.scenario = scenario = guidance.states.scenario
        self.messages, self.sensing = messages_of(scenario, method, seed), sensing_of(self.states, method, seed)
        robots, guide, n = scenario.robots, guidance.guide, len(scenario.robots)
        self.period, self.span = scenario.dt * scenario.steps_per_decision, 2.0 * scenario.horizon
        self.margin = margin_among(scenario, method)
        self._limits, self._skeletons = [r.limits for r in robots], Skeletons([r.shape for r in robots])
        self._turning = [k for k, limits in enumerate(self._limits) if limits.bounds]
        distinct: dict[Limits, int] = {}
        kind = np.array([distinct.setdefault(limits, len(distinct)) for limits in self._limits])
        kinds = tuple(method.responses(limits, self.period, scenario.holds) for limits in distinct)
        self.responses = response_table(kinds, scenario.horizon, self.span, scenario.dimension)
        self._texts = [repr(response) for each in kinds for response in each]
        pieces = max(3, int(np.diff(self.responses.first).max()))
        self._forecast = (
            None if method.shared else linear_forecast(method.robot_forecast, FORECAST_HORIZONS * scenario.horizon)
        )
        observed = pieces if self._forecast is None else len(self._forecast.shares)
        end = scenario.start + scenario.duration + self.span
        self._targets, self._goal_moves = target_paths([r.goal for r in robots], scenario.start, end)
        self.fleet = robot_table(n, pieces, observed)._replace(
            position=guide.position,
            velocity=guide.velocity,
            kind=kind,
            skeleton=self._skeletons.kind,
            rounding=self._skeletons.rounding,
            radius=guide.radius,
            max_speed=guide.max_speed,
            max_acceleration=np.array([limits.max_acceleration for limits in self._limits]),
            braking=np.array([limits.braking for limits in self._limits]),
            target=guide.target,
            tolerance=guide.tolerance,
            stop=guide.stop,
            present=guide.present,
        )
        if method.shared:
            # A shared manoeuvre commits a robot from the begin; an observed robot is free to change its first one.
            self.fleet.regret[:] = 0.0
        # The response of each robot whose manoeuvre is not in the tables, and the robot in each row of `fleet`.
        self._other_texts, self._robot_of = [""] * n, np.arange(n)
        self._sent: dict[int, tuple[Array, Array]] = {}
        self._sensing_time = 0.0
        self._bounds = bounds_of(self._limits, [r.state for r in robots])
        self._no_obstacles = None if scenario.obstacles else self._grown_bodies(scenario.start)
        for k, robot in enumerate(robots):
            self._commit(k, first_manoeuvre(robot.state, robot.limits, self.period, scenario.start), scenario.start)

    def sense(self, now: float) -> None:
        before, fleet = perf_counter(), self.fleet
        fleet.acceleration[:] = self.states.acceleration
        if self.messages is not None:
            if not self._sent:
                self._sent[-1] = fleet.committed_times.copy(), fleet.committed_points.copy()
            self.messages.deliver(fleet.position)
        elif self.sensing is not None:
            self.sensing.observe(np.array([fleet.position, fleet.velocity, fleet.acceleration]), now)
        elif not self.method.shared:
            self._predict(now)
        self._sensing_time = perf_counter() - before

    def guide(self, now: float) -> None:
        self.guidance.update(now, self.period)
        fleet = self.fleet
        fleet.final[:] = (fleet.target == self.guidance.guide.goal).all(axis=1)
        fleet.moving[:] = fleet.final & self._goal_moves

    def decide(self, order: Sequence[int], now: float) -> Decisions:
        before, s, method = perf_counter(), self.scenario, self.method
        regain = np.inf if method.regain is None else method.regain
        usual = DecisionSettings(
            s.dimension, now, self.period, s.horizon, self.margin, regain, s.patience, method.share, method.shared,
            np.array(DETOURS),
        )  # fmt: skip
        everywhere, outcomes = self._grown_bodies(now) if self._no_obstacles is None else self._no_obstacles, {}
        decide_all = one_by_one if method.shared else at_once
        if self._turning:
            self._bounds = bounds_of(self._limits, [self.states.state(k) for k in range(len(self._limits))])
        for together, settings in self._turns(np.array(order, dtype=np.int64), usual):
            for some, bodies in self._among_images(together, everywhere):
                tables = DecisionTables(self.fleet, bodies, self.responses, self._bounds, self._targets, settings)
                outcomes.update(decide_all(some, tables, lambda k: self._fall_back(k, now), self.threads))
        found = self.fleet.outcome.tolist()
        outcomes.update({k: OUTCOMES[found[k]] for k in order if found[k] != FALL_BACK})
        each = (self._sensing_time + perf_counter() - before) / max(len(order), 1)
        return Decisions(outcomes, dict.fromkeys(order, each))

    def _turns(self, due: Indices, settings: DecisionSettings) -> Iterator[tuple[Indices, DecisionSettings]]:
        """Groups of robots that decide from the same knowledge of the others, which `fleet` then holds."""
        if self.messages is not None:
            yield from self._by_messages(self.messages, due, settings)
        elif self.sensing is not None:
            for k in due:
                self._predict(settings.now, int(k))
                yield due[due == k], settings
        else:
            yield due, settings

    def _by_messages(
        self, messages: Messages, due: Indices, settings: DecisionSettings
    ) -> Iterator[tuple[Indices, DecisionSettings]]:
        """Each robot that may decide, with the manoeuvres that it has received in `fleet`; the others go on.

        A robot expects to decide again after as long as it has waited now.
        """
        fleet, rows = self.fleet, np.arange(len(self.fleet.radius))
        for k in due:
            if not messages.may_decide(int(k), fleet.present):
                fleet.outcome[k] = WAIT
                continue
            for j in rows[rows != k]:
                times, points = self._sent[int(messages.received[k, j])]
                fleet.observed_times[j], fleet.observed_points[j] = times[j], points[j]
            yield due[due == k], settings._replace(period=max(self.period, messages.waited(int(k))))
        self._sent[messages.step] = fleet.committed_times.copy(), fleet.committed_points.copy()
        messages.send()
        for step in [step for step in self._sent if step < messages.oldest]:
            del self._sent[step]

    def _among_images(self, some: Indices, bodies: list[GrownBodies]) -> Iterator[tuple[Indices, GrownBodies]]:
        """Robots that decide together, and all bodies grown by their kind of skeleton.

        In a periodic world each robot alone, with all images of the others that it can meet in `fleet`. Its own images
        move as it does and need not be avoided.
        """
        whole, period, d = self.fleet, self.scenario.period, self.scenario.dimension
        if period is None:
            yield from self._by_skeleton(some, bodies)
            return
        speed = np.maximum(whole.max_speed, np.linalg.norm(whole.velocity, axis=1))
        reach = speed * self.scenario.horizon + whole.radius
        for k in some:
            self._robot_of, by = images_about(k, whole.position, reach + reach[k] + self.margin, period)
            # Passive obstacles are those of the cell about the origin, into which `home` brings the robot.
            home = to_nearest(whole.position[k], period)[:d]
            self.fleet = own = RobotTable._make(column[self._robot_of] for column in whole)
            own.position[:] += by
            own.observed_points[:] += by[:, None, None]
            yield np.array([k]), moved_bodies(bodies[whole.skeleton[k]], -home)
            for column, new in zip(whole, own, strict=True):
                column[k] = new[k]
            self.fleet, self._robot_of = whole, np.arange(len(whole.radius))

    def _by_skeleton(self, some: Indices, bodies: list[GrownBodies]) -> Iterator[tuple[Indices, GrownBodies]]:
        """Robots with one kind of skeleton each; in their order where each avoids the decisions before its own."""
        kinds = self.fleet.skeleton[some]
        if not self.method.shared:
            some = some[np.argsort(kinds, kind="stable")]
            kinds = np.sort(kinds)
        for part in np.split(some, np.flatnonzero(np.diff(kinds)) + 1):
            if len(part):
                yield part, bodies[self.fleet.skeleton[part[0]]]

    def accelerations(self, now: float, duration: float) -> Array:
        fleet, t = self.fleet, now + duration
        rows = np.arange(len(fleet.committed_times))
        piece = np.minimum((fleet.committed_times[:, 1:] < t).sum(axis=1), fleet.committed_points.shape[1] - 1)
        width = (fleet.committed_times[rows, piece + 1] - fleet.committed_times[rows, piece])[:, None]
        x = (t - fleet.committed_times[rows, piece])[:, None] / width
        p = fleet.committed_points[rows, piece]
        slope = (1 - x) ** 2 * (p[:, 1] - p[:, 0]) + 2 * x * (1 - x) * (p[:, 2] - p[:, 1]) + x * x * (p[:, 3] - p[:, 2])
        return self.states.stop_departed((3.0 * slope / width - fleet.velocity) / duration, duration)

    def committed(self) -> tuple[Array, tuple[str, ...]]:
        rows, texts, others = self.fleet.response.tolist(), self._texts, self._other_texts
        responses = tuple(texts[r] if r >= 0 else others[k] for k, r in enumerate(rows))
        return self.fleet.control[:, : self.scenario.dimension].copy(), responses

    def _predict(self, now: float, observer: int = -1) -> None:
        """Write the predicted paths of all robots into `fleet`: from the present states, or from what one observed."""
        fleet, d = self.fleet, self.scenario.dimension
        states = np.stack([fleet.position, fleet.velocity, fleet.acceleration], axis=1)
        time = np.full(len(states), now)
        if self.sensing is not None:
            states, time = np.moveaxis(self.sensing.observed[observer], 0, 1), self.sensing.time[observer]
        if self._forecast is not None and time.min() + self._forecast.times[-1] >= now + self.scenario.horizon:
            fleet.observed_times[:] = time[:, None] + self._forecast.times
            fleet.observed_points[:] = self._forecast.points(states)
            return
        for k in np.flatnonzero(fleet.present):
            position, velocity, acceleration = states[k, :, :d]
            observed = ConstantAcceleration(position, velocity, acceleration, float(time[k]))
            self._show(int(k), self.method.robot_forecast(observed, float(time[k])), now)

    def _show(self, k: int, path: Trajectory, now: float) -> None:
        """Write `path` into `fleet` as the observed path of robot k. It has no more pieces than the table holds."""
        fleet, d = self.fleet, self.scenario.dimension
        pieces = path.path(now, now + self.scenario.horizon)
        count = len(pieces.points)
        fleet.observed_times[k] = pieces.times[-1]
        fleet.observed_times[k, : count + 1] = pieces.times
        fleet.observed_points[k, :count, :, :d] = pieces.points

    def _commit(self, k: int, manoeuvre: Manoeuvre, now: float) -> None:
        """Commit robot k to a manoeuvre that is not in the tables."""
        fleet, d = self.fleet, self.scenario.dimension
        path = manoeuvre.path(now, now + self.span)
        commit_to(fleet, k, path)
        if isinstance(manoeuvre.response, AccelerateThenBrake):
            fleet.committed_times[k, len(path.points) :] = now + REST_DURATION
        if self.method.shared:
            fleet.observed_times[k], fleet.observed_points[k] = fleet.committed_times[k], fleet.committed_points[k]
        fleet.response[k], self._other_texts[k] = -1, repr(manoeuvre.response)
        fleet.control[k, :d] = manoeuvre.control

    def _fall_back(self, k: int, now: float) -> str:
        """Commit robot k to the decision of its `Navigator`; the name of the outcome."""
        fleet, d, scenario = self.fleet, self.scenario.dimension, self.scenario
        state = State(fleet.position[k, :d], fleet.velocity[k, :d], fleet.acceleration[k, :d])
        others = [self._observed(int(j)) for j in np.flatnonzero(fleet.present) if j != k]
        goal = Goal(Stationary(fleet.target[k, :d]), float(fleet.tolerance[k]), bool(fleet.stop[k]))
        navigator = replace(scenario.navigator(self.method, k), margin=self.margin)
        passive = scenario.around(state, now, self.method, k, self.margin)
        decision = navigator.fall_back(state, [*passive, *others], goal, now=now)
        self._commit(k, decision.manoeuvre, now)
        fleet.outcome[k], fleet.regret[k] = FALL_BACK, 0.0
        return decision.outcome.name

    def _observed(self, k: int) -> Obstacle:
        """The robot in row k of `fleet` as an obstacle on its observed path."""
        robot, points = self.scenario.robots[self._robot_of[k]], self.fleet.observed_points[k]
        path = piecewise_polynomial(self.fleet.observed_times[k], points[..., : self.scenario.dimension])
        return Obstacle(robot.shape, path, robot.name)

    def _grown_bodies(self, now: float) -> list[GrownBodies]:
        """The predicted passive obstacles and the robots, grown by each kind of skeleton.

        In a periodic world all images that robots in the cell about the origin can meet.
        """
        s, forecast = self.scenario, self.method.forecast
        existing = [o for o in s.obstacles if forecast.includes_future or o.exists(now)]
        obstacles = [predicted(obstacle, forecast, now) for obstacle in existing]
        if s.period is not None:
            # No response makes a robot faster that exceeds its largest speed.
            speed = max(self.fleet.max_speed.max(), np.linalg.norm(self.fleet.velocity, axis=1).max())
            reach = 0.5 * np.array(s.period) + speed * s.horizon + self.fleet.radius.max() + self.margin
            images = in_box(obstacles, s.period, now, s.horizon, -reach, reach)
            obstacles = [displaced(obstacles[k], by) for k, by in images]
        table = ObstacleTable(obstacles, now, s.horizon)
        return [self._skeletons.grown_bodies(kind, table) for kind in range(len(self._skeletons.shapes))]
