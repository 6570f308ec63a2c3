"""Decisions of all robots of a run: a fleet with guidance, late or lost messages and sensing, and periodic images."""

from collections.abc import Iterator, Sequence
from time import perf_counter

import numpy as np

from slalom.checks import Array
from slalom.decision import Outcome
from slalom.decision_tables import moved_bodies, target_paths
from slalom.fleet.committed import CommittedFleet, first_manoeuvre
from slalom.forecast import predicted
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import DecisionSettings, GrownBodies, RobotTable
from slalom.methods import Method, margin_among
from slalom.obstacle import Obstacle
from slalom.obstacle_window import Obstacles, ObstacleWindow
from slalom.path_goal import PathGoal
from slalom.sim.periodic import displaced, images_about, in_box, to_nearest
from slalom.sim.run.deciders import Decisions
from slalom.sim.run.guidance import Guidance
from slalom.sim.run.messages import Messages, messages_of
from slalom.sim.run.sensing import sensing_of
from slalom.sim.scenario import Scenario
from slalom.state import State


def margin_of(scenario: Scenario, method: Method) -> float:
    """The margin [m] of the robots of a scenario that meet each other, see `methods.margin_among`."""
    time = scenario.dt * scenario.steps_per_decision + scenario.sight_delay
    most = max(robot.limits.max_acceleration for robot in scenario.robots)
    return margin_among(method, scenario.margin, most, time, scenario.sight_noise)


class FleetDecider:
    """A fleet whose robots have the targets that guidance gives them.

    Attributes:
        fleet: decides; its table shares the arrays of `states`.
        messages, sensing: None where messages or observations are immediate and exact.
        margin: [m], see `margin_of`. period: [s] between decisions.
    """

    def __init__(self, method: Method, guidance: Guidance, seed: int = 0, threads: int | None = None) -> None:
        self.guidance, self.states = guidance, guidance.states
        self.scenario = scenario = guidance.states.scenario
        robots, guide = scenario.robots, guidance.guide
        self.period = scenario.dt * scenario.steps_per_decision
        self.fleet = fleet = CommittedFleet(
            method,
            [robot.shape for robot in robots],
            [robot.limits for robot in robots],
            names=[robot.name for robot in robots],
            obstacles=scenario.obstacles,
            period=self.period,
            horizon=scenario.horizon,
            margin=scenario.margin,
            holds=scenario.holds,
            patience=scenario.patience,
            threads=threads,
        )
        self.method = method = fleet.method
        self.messages, self.sensing = messages_of(scenario, method, seed), sensing_of(self.states, method, seed)
        self.margin = fleet.margin_among = margin_of(scenario, method)
        fleet.table = fleet.table._replace(
            position=guide.position,
            velocity=guide.velocity,
            radius=guide.radius,
            max_speed=guide.max_speed,
            target=guide.target,
            tolerance=guide.tolerance,
            stop=guide.stop,
            present=guide.present,
        )
        end = scenario.start + scenario.duration + fleet.span
        fleet.targets, self._goal_moves = target_paths([robot.goal for robot in robots], scenario.start, end)
        # The robot in each row of the table.
        self._robot_of = np.arange(len(robots))
        self._sent: dict[int, tuple[Array, Array]] = {}
        self._sensing_time = 0.0
        self._paths = {k: robot.goal for k, robot in enumerate(robots) if isinstance(robot.goal, PathGoal)}
        self._no_obstacles = None if scenario.obstacles else fleet.grown_bodies((), scenario.start)
        for k, robot in enumerate(robots):
            fleet.commit(k, first_manoeuvre(robot.state, robot.limits, self.period, scenario.start), scenario.start)
        # A shared manoeuvre commits a robot from the begin; an observed robot is free to change its first one.
        fleet.table.regret[:] = 0.0 if method.shared else np.inf

    def sense(self, now: float) -> None:
        before, states, table = perf_counter(), self.states, self.fleet.table
        table.acceleration[:] = states.acceleration
        if self.messages is not None:
            if not self._sent:
                self._sent[-1] = table.committed_times.copy(), table.committed_points.copy()
            self.messages.deliver(states.position)
        elif self.sensing is not None:
            self.sensing.observe(np.array([states.position, states.velocity, states.acceleration]), now)
        else:
            self.fleet.observe(now)
        self._sensing_time = perf_counter() - before

    def guide(self, now: float) -> None:
        self.guidance.update(now, self.period)
        table = self.fleet.table
        if self._paths:
            self.fleet.follow(self._paths, self._window(now))
        table.final[:] = (table.target == self.guidance.guide.goal).all(axis=1)
        table.moving[:] = table.final & self._goal_moves

    def decide(self, order: Sequence[int], now: float) -> Decisions:
        before, outcomes = perf_counter(), dict[int, Outcome]()
        everywhere = self._grown_bodies(now) if self._no_obstacles is None else self._no_obstacles
        for together, settings in self._turns(np.array(order, dtype=np.int64), self.fleet.settings(now)):
            for some, bodies in self._among_images(together, everywhere):
                outcomes.update(self.fleet.decide(some, settings, bodies, lambda k: self._fall_back(k, now)))
        each = (self._sensing_time + perf_counter() - before) / max(len(order), 1)
        names = {k: outcomes.get(k, Outcome.WAITING).name for k in order}
        return Decisions(names, dict.fromkeys(order, each))

    def _turns(self, due: Indices, settings: DecisionSettings) -> Iterator[tuple[Indices, DecisionSettings]]:
        """Groups of robots that decide from the same knowledge of the others, which the table then holds."""
        if self.messages is not None:
            yield from self._by_messages(self.messages, due, settings)
        elif self.sensing is not None:
            for k in due:
                observed = np.moveaxis(self.sensing.observed[k], 0, 1)
                self.fleet.observe(settings.now, observed, self.sensing.time[k])
                yield due[due == k], settings
        else:
            yield due, settings

    def _by_messages(
        self, messages: Messages, due: Indices, settings: DecisionSettings
    ) -> Iterator[tuple[Indices, DecisionSettings]]:
        """Each robot that may decide, with the manoeuvres that it has received in the table; the others wait.

        A robot expects to decide again after as long as it has waited now.
        """
        table, rows = self.fleet.table, np.arange(len(self.fleet.table.radius))
        for k in due:
            if not messages.may_decide(int(k), table.present):
                continue
            for j in rows[rows != k]:
                times, points = self._sent[int(messages.received[k, j])]
                table.observed_times[j], table.observed_points[j] = times[j], points[j]
            yield due[due == k], settings._replace(period=max(self.period, messages.waited(int(k))))
        self._sent[messages.step] = table.committed_times.copy(), table.committed_points.copy()
        messages.send()
        for step in [step for step in self._sent if step < messages.oldest]:
            del self._sent[step]

    def _among_images(self, some: Indices, bodies: list[GrownBodies]) -> Iterator[tuple[Indices, list[GrownBodies]]]:
        """Robots that decide together, and all bodies grown by each kind of skeleton.

        In a periodic world each robot alone, with all images of the others that it can meet in the table. Its own
        images move as it does and need not be avoided.
        """
        fleet, whole, period, d = self.fleet, self.fleet.table, self.scenario.period, self.scenario.dimension
        if period is None:
            yield some, bodies
            return
        speed = np.maximum(whole.max_speed, np.linalg.norm(whole.velocity, axis=1))
        reach = speed * self.scenario.horizon + whole.radius
        for k in some:
            self._robot_of, by = images_about(k, whole.position, reach + reach[k] + self.margin, period)
            # Passive obstacles are those of the cell about the origin, into which `home` brings the robot.
            home = to_nearest(whole.position[k], period)[:d]
            fleet.table = own = RobotTable._make(column[self._robot_of] for column in whole)
            own.position[:] += by
            own.observed_points[:] += by[:, None, None]
            yield np.array([k]), [moved_bodies(each, -home) for each in bodies]
            for column, new in zip(whole, own, strict=True):
                column[k] = new[k]
            fleet.table, self._robot_of = whole, np.arange(len(whole.radius))

    def accelerations(self, now: float, duration: float) -> Array:
        velocity, _ = self.fleet.planned(now + duration)
        return self.states.stop_departed((velocity - self.fleet.table.velocity) / duration, duration)

    def committed(self) -> tuple[Array, tuple[str, ...]]:
        return self.fleet.table.control[:, : self.scenario.dimension].copy(), self.fleet.committed_responses()

    def _fall_back(self, k: int, now: float) -> Outcome:
        """Commit robot k to the decision of a navigator."""
        table, d = self.fleet.table, self.scenario.dimension
        state = State(table.position[k, :d], table.velocity[k, :d], table.acceleration[k, :d])
        passive: Obstacles = self.fleet.obstacles
        if self.scenario.period is not None:
            passive = self.scenario.around(state, now, self.method, k, self.margin)
        return self.fleet.fall_back(k, passive, now, self._robot_of)

    def _grown_bodies(self, now: float) -> list[GrownBodies]:
        """All bodies that robots can meet, see `_window`."""
        return self.fleet.grown_bodies_of(self._window(now))

    def _window(self, now: float) -> ObstacleWindow:
        """The predicted obstacles; in a periodic world for robots in the cell about the origin."""
        s, forecast, table = self.scenario, self.method.forecast, self.fleet.table
        if s.period is None:
            return ObstacleWindow.predicted(self.fleet.obstacles, forecast, now, s.horizon)
        existing = [o for o in s.obstacles if forecast.includes_future or o.exists(now)]
        obstacles: list[Obstacle] = [predicted(obstacle, forecast, now) for obstacle in existing]
        # No response makes a robot faster that exceeds its largest speed.
        speed = max(table.max_speed.max(), np.linalg.norm(table.velocity, axis=1).max())
        reach = 0.5 * np.array(s.period) + speed * s.horizon + table.radius.max() + self.margin
        images = in_box(obstacles, s.period, now, s.horizon, -reach, reach)
        return ObstacleWindow([displaced(obstacles[k], by) for k, by in images], now, s.horizon)
