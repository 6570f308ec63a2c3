"""Decisions of all robots of a run by a fleet."""

from time import perf_counter

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.decision.methods import Method
from slalom.fleet.fleet import Fleet
from slalom.sim.measure.responses import ResponseRow
from slalom.sim.run.deciders import Decisions
from slalom.sim.run.messages import messages_of
from slalom.sim.run.states import RobotStates, sensing_of
from slalom.sim.scenario import Scenario


class FleetDecider:
    """All robots of a run, which decide as a `Fleet`.

    Attributes:
        fleet: decides. Late or lost messages and observations are its `information`.

    Raises:
        InvalidInput: messages with delay or loss among robots of several methods; as `Fleet`.
    """

    def __init__(self, scenario: Scenario, method: Method, seed: int = 0, threads: int | None = None) -> None:
        robots = scenario.robots
        self.scenario, self.states = scenario, RobotStates(scenario)
        self.fleet = fleet = Fleet(
            [robot.method or method for robot in robots],
            [robot.shape for robot in robots],
            [robot.limits for robot in robots],
            names=[robot.name for robot in robots],
            obstacles=scenario.obstacles,
            period=scenario.dt * scenario.steps_per_decision,
            priority=[robot.priority for robot in robots],
            world_period=scenario.period,
            observation_delay=scenario.sight_delay,
            observation_noise=scenario.sight_noise,
            sight=scenario.sight,
            threads=threads,
            guided=scenario.guided and scenario.dimension == 2,
            early=scenario.early,
            **scenario.shared | {"margin": [scenario.margin_of(k) for k in range(len(robots))]},
        )
        self._goals = [robot.goal for robot in robots]
        methods = [policy.method for policy in fleet.policies]
        messages = [found for found in (messages_of(scenario, each, seed) for each in methods) if found]
        if messages and len(methods) > 1:
            names = " and ".join(each.name for each in methods)
            raise InvalidInput(f"message_delay: expected messages without delay and loss for methods {names}")
        sensing = [found for found in (sensing_of(self.states, each, seed) for each in methods) if found]
        fleet.information = next(iter([*messages, *sensing]), fleet.information)

    def decide(self, now: float) -> Decisions:
        before, states = perf_counter(), self.states
        d = self.scenario.dimension
        found = self.fleet.step(
            now,
            states.position[:, :d],
            states.velocity[:, :d],
            goals=self._goals,
            accelerations=states.acceleration[:, :d],
            present=states.present,
        )
        outcomes = {k: outcome.name for k, outcome in enumerate(found.outcomes) if outcome is not None}
        return Decisions(outcomes, dict.fromkeys(outcomes, (perf_counter() - before) / max(len(outcomes), 1)))

    def accelerations(self, now: float, duration: float) -> Array:
        velocity, _ = self.fleet.planned(now + duration)
        return self.states.stop_departed((velocity - self.states.velocity) / duration, duration)

    def committed(self) -> tuple[Array, ResponseRow]:
        return self.fleet.table.each["control"][:, : self.scenario.dimension].copy(), self.fleet.committed_responses()
