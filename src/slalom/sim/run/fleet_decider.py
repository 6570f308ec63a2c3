"""How the robots of a scenario decide: all by one kernel where they are discs or balls, else each by its navigator."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from slalom import kernels
from slalom.checks import Array
from slalom.decision import Decision, Outcome
from slalom.forecast import predicted
from slalom.goal import Goal
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import DecisionSettings, DecisionTables, PassiveObstacles, RobotTable
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method
from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.response import AccelerateThenBrake
from slalom.shape import Ball, Disc
from slalom.sim.periodic import displaced, images_about, in_box, to_nearest
from slalom.sim.run.deciders import Decisions, first_manoeuvre, margin_among
from slalom.sim.run.guidance import Guidance
from slalom.sim.run.messages import Messages, messages_of
from slalom.sim.run.response_tables import linear_forecast, piecewise_polynomial, response_table
from slalom.sim.run.rounds import at_once, one_by_one
from slalom.sim.run.sensing import sensing_of
from slalom.sim.scenario import DETOURS, Scenario
from slalom.state import State
from slalom.tolerances import BALL_WINDOWS, REST_DURATION
from slalom.trajectory import ConstantAcceleration, Stationary, Trajectory

BY_NUMBER = (Outcome.CLEAR, Outcome.CONSTRAINED, Outcome.KEPT, Outcome.CONTINUED, Outcome.SQUEEZED, Outcome.WAITING)
OUTCOMES = tuple(outcome.name for outcome in BY_NUMBER)
"""What the kernel's numbers mean; it knows nothing of the last."""
WAIT, FALL_BACK = 5, -1
"""The numbers of a robot that may not decide, and of one that the kernel has no answer for: it asks its navigator."""
FORECAST_HORIZONS = 10.0
"""[1] Forecasts of robots are tables over so many horizons: sight is seldom older."""


def is_disc_fleet(scenario: Scenario) -> bool:
    """Whether a crew can decide for the robots of a scenario."""
    return all(
        isinstance(robot.shape, (Disc, Ball))
        and isinstance(robot.goal.trajectory, Stationary)
        and not (robot.limits.bounds or robot.limits.velocity_bounds or robot.limits.acceleration_bounds)
        for robot in scenario.robots
    )


class FleetDecider:
    """Discs or balls with goals at rest: one kernel decides for all, the navigator for a robot that has no safe choice.

    What a robot commits to is kept as cubic pieces over two horizons, or for ever where it ends at rest.
    """

    def __init__(self, method: Method, guidance: Guidance, seed: int = 0, threads: int | None = None) -> None:
        self.threads = kernels.threads() if threads is None else threads
        self.method, self.guidance, self.states = method, guidance, guidance.states
        self.scenario = scenario = guidance.states.scenario
        self.messages = messages_of(scenario, method, seed)
        self.sensing = sensing_of(self.states, method, seed)
        self._sensing_time = 0.0
        robots, guide = scenario.robots, guidance.guide
        self.period, self.span = scenario.dt * scenario.steps_per_decision, 2.0 * scenario.horizon
        self.margin = margin_among(scenario, method)
        distinct: dict[Limits, int] = {}
        kind = np.array([distinct.setdefault(robot.limits, len(distinct)) for robot in robots])
        kinds = [method.responses(limits, self.period, scenario.holds) for limits in distinct]
        self.answers = response_table(kinds, scenario.horizon, self.span, scenario.dimension)
        self.texts = [repr(response) for kind_of in kinds for response in kind_of]
        n, pieces = len(robots), max(3, int(np.diff(self.answers.first).max()))
        # What others see of a robot that they observe.
        self._outlook = (
            None if method.shared else linear_forecast(method.robot_forecast, FORECAST_HORIZONS * scenario.horizon)
        )
        seen = pieces if self._outlook is None else len(self._outlook.shares)
        self.fleet = RobotTable(
            position=guide.position,
            velocity=guide.velocity,
            acceleration=np.zeros((n, 3)),
            kind=kind,
            radius=guide.radius,
            max_speed=guide.max_speed,
            max_acceleration=np.array([robot.limits.max_acceleration for robot in robots]),
            target=guide.target,
            tolerance=guide.tolerance,
            stop=guide.stop,
            present=guide.present,
            committed_times=np.zeros((n, pieces + 1)),
            committed_points=np.zeros((n, pieces, 4, 3)),
            observed_times=np.zeros((n, seen + 1)),
            observed_points=np.zeros((n, seen, 4, 3)),
            ball_centers=np.zeros((n, BALL_WINDOWS, 3)),
            ball_radii=np.zeros((n, BALL_WINDOWS)),
            end_position=np.zeros((n, 3)),
            # Shared manoeuvres are promises from the begin; seen robots are free to change their first.
            regret=np.zeros(n) if method.shared else np.full(n, np.inf),
            response=np.full(n, -1),
            control=np.zeros((n, 3)),
            outcome=np.zeros(n, np.int64),
        )
        self._others, self._who = [""] * n, np.arange(n)
        self._sent: dict[int, tuple[Array, Array]] = {}
        self._empty = None if scenario.obstacles else self._world(scenario.start)
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

    def decide(self, order: Sequence[int], now: float) -> Decisions:
        before = perf_counter()
        s, due = self.scenario, np.array(order, dtype=np.int64)
        regain = np.inf if self.method.regain is None else self.method.regain
        usual = DecisionSettings(
            s.dimension, now, self.period, s.horizon, self.margin, regain, s.patience, self.method.share,
            self.method.shared, np.array(DETOURS),
        )  # fmt: skip
        everywhere, outcomes = self._world(now) if self._empty is None else self._empty, {}
        all_decide = one_by_one if self.method.shared else at_once
        for together, terms in self._turns(due, usual):
            for some, world in self._among_images(together, everywhere):
                tables = DecisionTables(self.fleet, world, self.answers, terms)
                outcomes.update(all_decide(some, tables, lambda k: self._ask(k, now).outcome.name, self.threads))
        found = self.fleet.outcome.tolist()
        outcomes.update({k: OUTCOMES[found[k]] for k in order if found[k] != FALL_BACK})
        each = (self._sensing_time + perf_counter() - before) / max(len(order), 1)
        return Decisions(outcomes, dict.fromkeys(order, each))

    def _turns(self, due: Indices, terms: DecisionSettings) -> Iterator[tuple[Indices, DecisionSettings]]:
        """Those who decide one after the other from the same knowledge of the others, which is in `fleet` then."""
        if self.messages is not None:
            yield from self._by_messages(self.messages, due, terms)
        elif self.sensing is not None:
            for k in due:
                self._predict(terms.now, int(k))
                yield due[due == k], terms
        else:
            yield due, terms

    def _among_images(self, some: Indices, world: PassiveObstacles) -> Iterator[tuple[Indices, PassiveObstacles]]:
        """Where the world repeats each alone, with all images of the others that it could meet in `fleet`; not with its
        own, which go as it goes.
        """
        whole, period, d = self.fleet, self.scenario.period, self.scenario.dimension
        if period is None:
            yield some, world
            return
        fast = np.maximum(whole.max_speed, np.linalg.norm(whole.velocity, axis=1))
        reach = fast * self.scenario.horizon + whole.radius
        for k in some:
            self._who, by = images_about(k, whole.position, reach + reach[k] + self.margin, period)
            # The world is that of the first cell, about the origin, into which this brings the robot.
            home = to_nearest(whole.position[k], period)[:d]
            self.fleet = own = RobotTable._make(of_all[self._who] for of_all in whole)
            own.position[:] += by
            own.observed_points[:] += by[:, None, None]
            yield (
                np.array([k]),
                world._replace(
                    pieces=world.pieces._replace(points=world.pieces.points - home),
                    end_positions=world.end_positions - home,
                ),
            )
            for of_all, seen in zip(whole, own, strict=True):
                of_all[k] = seen[k]
            self.fleet, self._who = whole, np.arange(len(whole.radius))

    def _by_messages(
        self, messages: Messages, due: Indices, terms: DecisionSettings
    ) -> Iterator[tuple[Indices, DecisionSettings]]:
        """Each of those who may decide, with what it has heard in `fleet`; the others go on as they are committed.

        It expects to decide again after as long as it has waited now.
        """
        fleet, rows = self.fleet, np.arange(len(self.fleet.radius))
        for k in due:
            if not messages.may_decide(int(k), fleet.present):
                fleet.outcome[k] = WAIT
                continue
            for j in rows[rows != k]:
                begin, points = self._sent[int(messages.heard[k, j])]
                fleet.observed_times[j], fleet.observed_points[j] = begin[j], points[j]
            yield due[due == k], terms._replace(period=max(self.period, messages.waited(int(k))))
        self._sent[messages.step] = fleet.committed_times.copy(), fleet.committed_points.copy()
        messages.send()
        for step in [step for step in self._sent if step < messages.oldest]:
            del self._sent[step]

    def accelerations(self, now: float, duration: float) -> Array:
        fleet, t = self.fleet, now + duration
        rows = np.arange(len(fleet.committed_times))
        piece = np.minimum((fleet.committed_times[:, 1:] < t).sum(axis=1), fleet.committed_points.shape[1] - 1)
        width = (fleet.committed_times[rows, piece + 1] - fleet.committed_times[rows, piece])[:, None]
        x = (t - fleet.committed_times[rows, piece])[:, None] / width
        p = fleet.committed_points[rows, piece]
        bends = (1 - x) ** 2 * (p[:, 1] - p[:, 0]) + 2 * x * (1 - x) * (p[:, 2] - p[:, 1]) + x * x * (p[:, 3] - p[:, 2])
        return self.states.stop_departed((3.0 * bends / width - fleet.velocity) / duration, duration)

    def committed(self) -> tuple[Array, tuple[str, ...]]:
        numbers, texts, others = self.fleet.response.tolist(), self.texts, self._others
        said = tuple(texts[r] if r >= 0 else others[k] for k, r in enumerate(numbers))
        return self.fleet.control[:, : self.scenario.dimension].copy(), said

    def _predict(self, now: float, who: int = -1) -> None:
        """What is seen of each robot, by all alike or by robot `who` as it watches: a forecast from its state."""
        fleet, d = self.fleet, self.scenario.dimension
        states = np.stack([fleet.position, fleet.velocity, fleet.acceleration], axis=1)
        when = np.full(len(states), now)
        if self.sensing is not None:
            states, when = np.moveaxis(self.sensing.seen[who], 0, 1), self.sensing.when[who]
        if self._outlook is not None and when.min() + self._outlook.times[-1] >= now + self.scenario.horizon:
            fleet.observed_times[:] = when[:, None] + self._outlook.times
            fleet.observed_points[:] = self._outlook.points(states)
            return
        for k in np.flatnonzero(fleet.present):
            place, speed, push = states[k, :, :d]
            seen = ConstantAcceleration(place, speed, push, float(when[k]))
            self._show(int(k), self.method.robot_forecast(seen, float(when[k])), now)

    def _show(self, k: int, path: Trajectory, now: float) -> None:
        """Robot k is seen to follow a path of at most as many pieces as there is room for."""
        fleet, d = self.fleet, self.scenario.dimension
        pieces = path.path(now, now + self.scenario.horizon)
        count = len(pieces.points)
        fleet.observed_times[k] = pieces.times[-1]
        fleet.observed_times[k, : count + 1] = pieces.times
        fleet.observed_points[k, :count, :, :d] = pieces.points

    def _commit(self, k: int, manoeuvre: Manoeuvre, now: float) -> None:
        """Robot k follows a manoeuvre that is none of the tables'."""
        fleet, d = self.fleet, self.scenario.dimension
        path = manoeuvre.path(now, now + self.span)
        count = len(path.points)
        fleet.committed_times[k] = path.times[-1]
        fleet.committed_times[k, :count] = path.times[:-1]
        fleet.committed_points[k, :count, :, :d] = path.points
        if isinstance(manoeuvre.response, AccelerateThenBrake):
            fleet.committed_times[k, count:] = now + REST_DURATION
        if self.method.shared:
            fleet.observed_times[k], fleet.observed_points[k] = fleet.committed_times[k], fleet.committed_points[k]
        fleet.response[k], self._others[k] = -1, repr(manoeuvre.response)
        fleet.control[k, :d] = manoeuvre.control

    def _ask(self, k: int, now: float) -> Decision:
        """What the navigator of robot k says, and what it commits to by it."""
        fleet, d, scenario = self.fleet, self.scenario.dimension, self.scenario
        state = State(fleet.position[k, :d], fleet.velocity[k, :d], fleet.acceleration[k, :d])
        others = [
            Obstacle(scenario.robots[self._who[j]].shape, self._seen(int(j)), scenario.robots[self._who[j]].name)
            for j in np.flatnonzero(fleet.present)
            if j != k
        ]
        goal = Goal(Stationary(fleet.target[k, :d]), float(fleet.tolerance[k]), bool(fleet.stop[k]))
        navigator = replace(scenario.navigator(self.method, k), margin=self.margin)
        passive = scenario.around(state, now, self.method, k, self.margin)
        decision = navigator.decide(state, [*passive, *others], goal, now=now)
        self._commit(k, decision.manoeuvre, now)
        fleet.outcome[k], fleet.regret[k] = FALL_BACK, 0.0
        return decision

    def _seen(self, k: int) -> Trajectory:
        """The course that the others see of robot k."""
        return piecewise_polynomial(
            self.fleet.observed_times[k], self.fleet.observed_points[k, ..., : self.scenario.dimension]
        )

    def _world(self, now: float) -> PassiveObstacles:
        """The passive obstacles as foreseen, or their images that could be met in the first cell, grown by the first
        robot's shape.
        """
        d, horizon, shape = self.scenario.dimension, self.scenario.horizon, self.scenario.robot.shape
        forecast = self.method.forecast
        there = [o for o in self.scenario.obstacles if forecast.includes_future or o.exists(now)]
        seen = [predicted(obstacle, forecast, now) for obstacle in there]
        if self.scenario.period is not None:
            # No response makes a robot that is faster than its top speed faster still.
            fast = max(self.fleet.max_speed.max(), np.linalg.norm(self.fleet.velocity, axis=1).max())
            far = 0.5 * np.array(self.scenario.period) + fast * horizon + self.fleet.radius.max() + self.margin
            found = in_box(seen, self.scenario.period, now, horizon, -far, far)
            seen = [displaced(seen[k], by) for k, by in found]
        bodies = ObstacleTable(seen, now, horizon).bodies(shape)
        stay = [o for o in seen if o.exists(now + horizon) and len(o.shape.parts) == 1]
        return PassiveObstacles(
            pieces=bodies.pieces,
            body_radius=bodies.radius,
            hull_radius=bodies.hull_radius,
            hull=bodies.hull,
            corners=bodies.maybe_corners,
            heads=bodies.heads,
            end_positions=np.array([o.trajectory.position(now + horizon) for o in stay]).reshape(-1, d),
            end_radii=np.array([o.shape.bounding_radius for o in stay]),
            robot_radius=shape.bounding_radius,
        )
