"""Decisions of all robots of a run: a fleet with guidance, and late or lost messages and sensing."""

from collections.abc import Iterator, Sequence
from time import perf_counter

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.decision import Outcome
from slalom.decision.methods import Method
from slalom.decision.tables import target_paths
from slalom.fleet.fleet import CommittedFleet
from slalom.fleet.guidance import Guidance
from slalom.fleet.settings import Policy
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import DecisionSettings
from slalom.model.path_goal import PathGoal
from slalom.obstacle.window import ObstacleWindow
from slalom.sim.measure.responses import ResponseRow
from slalom.sim.run.deciders import Decisions
from slalom.sim.run.messages import Messages, messages_of
from slalom.sim.run.states import RobotStates, sensing_of

# ---------------------------------------------------------------------------------------------------------------------
# Guidance of the robots of a run.


class GuidedRun(Guidance):
    """The targets of all robots of a run.

    In space, and in a scenario that is not `guided`, the target of a robot is its goal.

    Attributes:
        guided: whether targets differ from goals.
    """

    def __init__(self, states: RobotStates, threads: int | None = None) -> None:
        scenario, robots = states.scenario, states.robots
        super().__init__(
            np.array([robot.shape.bounding_radius for robot in robots]),
            np.array([robot.limits.max_speed for robot in robots]),
            scenario.margin,
            scenario.obstacles if scenario.dimension == 2 else (),
            start=scenario.start,
            world_period=scenario.period,
            threads=threads,
        )
        self.states, self.guided = states, scenario.guided and scenario.dimension == 2
        goals, guide = states.goals(scenario.start), self.guide
        # The arrays of the states change in place.
        self.guide = guide._replace(
            position=states.position, velocity=states.velocity, present=states.present, goal=goals
        )
        guide.goal_tolerance[:] = [robot.goal.tolerance for robot in robots]
        guide.goal_stop[:] = [robot.goal.stop for robot in robots]
        guide.waypoint[:] = guide.target[:] = goals

    def update(self, now: float, period: float) -> None:
        guide = self.guide
        self.states.goals(now)
        guide.arrived[:] = np.isfinite(self.states.arrived)
        if self.guided:
            super().update(now, period)
            return
        guide.visited[:] |= guide.arrived
        guide.tolerance[:], guide.stop[:], guide.target[:] = guide.goal_tolerance, guide.goal_stop, guide.goal


# ---------------------------------------------------------------------------------------------------------------------
# Decisions of all robots of a run: a fleet with guidance, and late or lost messages and sensing.


class FleetDecider:
    """A fleet with targets from guidance.

    Attributes:
        fleet: decides; its table shares the arrays of `states`.
        messages, sensing: None where messages or observations are immediate and exact.
        period: [s] between decisions.
    """

    def __init__(self, method: Method, guidance: GuidedRun, seed: int = 0, threads: int | None = None) -> None:
        self.guidance, self.states = guidance, guidance.states
        self.scenario = scenario = guidance.states.scenario
        robots = scenario.robots
        self.period = scenario.dt * scenario.steps_per_decision
        self.fleet = fleet = CommittedFleet(
            [robot.method or method for robot in robots],
            [robot.shape for robot in robots],
            [robot.limits for robot in robots],
            names=[robot.name for robot in robots],
            obstacles=scenario.obstacles,
            period=self.period,
            priority=[robot.priority for robot in robots],
            world_period=scenario.period,
            observation_delay=scenario.sight_delay,
            observation_noise=scenario.sight_noise,
            sight=scenario.sight,
            threads=threads,
            guided=False,  # `guidance` has the targets
            **scenario.shared | {"margin": [scenario.margin_of(k) for k in range(len(robots))]},
        )
        methods = [policy.method for policy in fleet.policies]
        self.messages = next(filter(None, (messages_of(scenario, each, seed) for each in methods)), None)
        self.sensing = next(filter(None, (sensing_of(self.states, each, seed) for each in methods)), None)
        if self.messages is not None and len(methods) > 1:
            names = " and ".join(each.name for each in methods)
            raise InvalidInput(f"message_delay: expected messages without delay and loss for methods {names}")
        end = scenario.start + scenario.duration + fleet.span
        fleet.targets, self._goal_moves = target_paths([robot.goal for robot in robots], scenario.start, end)
        self._sent: dict[int, tuple[Array, Array]] = {}
        self._sensing_time = 0.0
        self._paths = {k: robot.goal for k, robot in enumerate(robots) if isinstance(robot.goal, PathGoal)}
        start, nothing = scenario.start, ObstacleWindow((), scenario.start, scenario.horizon)
        self._no_obstacles = None if scenario.obstacles else fleet.grown_bodies(nothing)
        for k, robot in enumerate(robots):
            fleet.begin(k, robot.state, start)

    def sense(self, now: float) -> None:
        before = perf_counter()
        states = self.states
        table = self.fleet.table
        each = table.each
        each["position"] = states.position
        each["velocity"] = states.velocity
        each["acceleration"] = states.acceleration
        each["present"] = states.present
        if self.messages is not None:
            if not self._sent:
                self._sent[-1] = table.committed.times.copy(), table.committed.points.copy()
            self.messages.deliver(states.position)
        elif self.sensing is not None:
            self.sensing.observe(np.array([states.position, states.velocity, states.acceleration]), now)
        self._sensing_time = perf_counter() - before

    def guide(self, now: float) -> None:
        self.guidance.update(now, self.period)
        guide, each = self.guidance.guide, self.fleet.table.each
        each["target"] = guide.target
        each["tolerance"] = guide.tolerance
        each["stop"] = guide.stop
        for policy in self.fleet.policies if self._paths else ():
            own = {k: path for k, path in self._paths.items() if k in policy.rows}
            self.fleet.follow(own, self.fleet.window(policy, self.fleet.obstacles, now))
        each["final"] = (each["target"] == guide.goal).all(axis=1)
        each["moving"] = each["final"] & self._goal_moves

    def decide(self, order: Sequence[int], now: float) -> Decisions:
        before = perf_counter()
        outcomes = dict[int, Outcome]()
        fleet = self.fleet
        for policy, due in fleet.by_policy(np.array(order, dtype=np.int64)):
            bodies = self._no_obstacles
            if bodies is None:
                bodies = fleet.grown_bodies(fleet.window(policy, fleet.obstacles, now))
            for some, settings in self._turns(policy, due, now):
                if fleet.observers:
                    outcomes |= fleet.decide_by_sight(policy, some, settings, fleet.obstacles)
                else:
                    outcomes |= fleet.decide(some, settings, bodies, fleet.obstacles)
        each = (self._sensing_time + perf_counter() - before) / max(len(order), 1)
        names = {k: outcomes.get(k, Outcome.WAITING).name for k in order}
        return Decisions(names, dict.fromkeys(order, each))

    def _turns(self, policy: Policy, due: Indices, now: float) -> Iterator[tuple[Indices, DecisionSettings]]:
        """Groups of robots that decide from the same knowledge of the others, which the table then holds."""
        settings = self.fleet.settings(policy, now)
        if self.messages is not None:
            yield from self._by_messages(self.messages, due, settings)
        elif self.sensing is not None and not policy.method.shared:
            for k in due:
                observed = np.moveaxis(self.sensing.observed[k], 0, 1)
                self.fleet.observe(policy, now, observed, self.sensing.time[k])
                yield due[due == k], settings
        else:
            self.fleet.observe(policy, now)
            yield due, settings

    def _by_messages(
        self, messages: Messages, due: Indices, settings: DecisionSettings
    ) -> Iterator[tuple[Indices, DecisionSettings]]:
        """Each robot that may decide does, with the received manoeuvres in the table; the others keep theirs.

        A robot expects its next decision after the same time as since its last one.
        """
        table, rows = self.fleet.table, np.arange(len(self.fleet.table.each))
        for k in due:
            if not messages.may_decide(int(k), table.each["present"]):
                continue
            for j in rows[rows != k]:
                times, points = self._sent[int(messages.received[k, j])]
                table.observed.times[j], table.observed.points[j] = times[j], points[j]
            yield due[due == k], settings._replace(period=max(self.period, messages.waited(int(k))))
        self._sent[messages.step] = table.committed.times.copy(), table.committed.points.copy()
        messages.send()
        for step in [step for step in self._sent if step < messages.oldest]:
            del self._sent[step]

    def accelerations(self, now: float, duration: float) -> Array:
        velocity, _ = self.fleet.planned(now + duration)
        return self.states.stop_departed((velocity - self.states.velocity) / duration, duration)

    def committed(self) -> tuple[Array, ResponseRow]:
        return self.fleet.table.each["control"][:, : self.scenario.dimension].copy(), self.fleet.committed_responses()
