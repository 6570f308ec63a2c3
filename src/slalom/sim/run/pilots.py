"""Robots of any shape, limits and goals, each of which decides by its own navigator."""

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from slalom.checks import Array
from slalom.decision import Decision, Outcome
from slalom.goal import Goal
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method
from slalom.obstacle import Obstacle
from slalom.sim.periodic import images_within, moved
from slalom.sim.run.among import first_manoeuvre, margin_among
from slalom.sim.run.guidance import Guidance
from slalom.sim.run.messages import messages_of
from slalom.sim.run.sensing import sensing_of
from slalom.sim.scenario import Scenario
from slalom.state import State
from slalom.trajectory import ConstantAcceleration, Stationary, Trajectory


class NavigatorDecider:
    """See `crew.Deciders`."""

    def __init__(self, scenario: Scenario, method: Method, guidance: Guidance, seed: int = 0) -> None:
        self.scenario, self.method, self.guidance = scenario, method, guidance
        self.post, self.watch = messages_of(scenario, method, seed), sensing_of(scenario, method, guidance, seed)
        period = scenario.dt * scenario.steps_per_decision
        margin = margin_among(scenario, method)
        self._navigators = [replace(scenario.navigator(method, k), margin=margin) for k in range(len(scenario.robots))]
        self._committed = [first_manoeuvre(r.state, r.limits, period, scenario.start) for r in scenario.robots]
        self._decisions: list[Decision | None] = [None] * len(scenario.robots)
        self._said: dict[int, list[Manoeuvre]] = {}

    def decide(self, order: Sequence[int], now: float) -> tuple[dict[int, str], dict[int, float]]:
        n, guide = len(self._navigators), self.guidance.guide
        if self.watch is not None:
            self.watch.look(np.array([guide.position, guide.velocity, self.guidance.push]), now)
        made: dict[int, tuple[Decision, float]] = {}
        outcomes: dict[int, str] = {}
        if self.post is not None:
            self._said.setdefault(-1, list(self._committed))
            self.post.deliver(guide.position)
        seen = [self._observed(j, now) for j in range(n)] if self.watch is None else []
        for k in order:
            if self.post is not None and not self.post.may_decide(k, guide.present):
                outcomes[k] = Outcome.WAITING.name
                continue
            made[k] = self._one(k, self._paths(k, seen, now), now)
            if self.method.shared:
                self._committed[k] = made[k][0].manoeuvre
        for k, (decision, _) in made.items():
            self._committed[k], self._decisions[k] = decision.manoeuvre, decision
        if self.post is not None:
            self._said[self.post.step] = list(self._committed)
            self.post.send()
            self._said = {step: said for step, said in self._said.items() if step >= self.post.oldest}
        outcomes.update((k, decision.outcome.name) for k, (decision, _) in made.items())
        return outcomes, {k: made[k][1] if k in made else 0.0 for k in order}

    def _one(self, k: int, paths: Sequence[Trajectory], now: float) -> tuple[Decision, float]:
        """The decision of robot k that sees the others follow `paths`, and the time [s] that it took."""
        before = perf_counter()
        passive = self.scenario.around(self._state(k), now, self.method, k, self._navigators[k].margin)
        around = [*passive, *self._others(k, paths)]
        decision = self._navigators[k].decide(
            self._state(k), around, self._goal(k), now=now, previous=self._decisions[k]
        )
        return decision, perf_counter() - before

    def _paths(self, k: int, seen: list[Trajectory], now: float) -> Sequence[Trajectory]:
        """What robot k takes the others to do, one path for each robot."""
        rows = range(len(self._committed))
        if self.post is not None:
            heard = self.post.heard[k]
            return [self._committed[j] if j == k else self._said[int(heard[j])][j] for j in rows]
        if self.method.shared:
            return self._committed
        if self.watch is None:
            return seen
        looks = [self.watch.state(k, j) for j in rows]
        return [self._foreseen(state, when) for state, when in looks]

    def push(self, now: float, dt: float) -> Array:
        push = np.zeros((len(self._committed), 3))
        for k, manoeuvre in enumerate(self._committed):
            push[k, : self.scenario.dimension] = manoeuvre.mean_acceleration(now, dt)
        return push

    def chosen(self) -> tuple[Array, tuple[str, ...]]:
        controls = np.array([manoeuvre.control for manoeuvre in self._committed])
        return controls, tuple(repr(manoeuvre.response) for manoeuvre in self._committed)

    def _state(self, k: int) -> State:
        d, guide = self.scenario.dimension, self.guidance.guide
        return State(guide.position[k, :d], guide.velocity[k, :d], self.guidance.push[k, :d])

    def _observed(self, k: int, now: float) -> Trajectory:
        """What the others assume of a robot: where it is, how fast, and how it accelerates, is all they see."""
        return self._foreseen(self._state(k), now)

    def _foreseen(self, state: State, when: float) -> Trajectory:
        """The path of a robot that was seen in a state at `when` [s]."""
        seen = ConstantAcceleration(state.position, state.velocity, state.acceleration, when)
        return self.method.robot_forecast(seen, when)

    def _goal(self, k: int) -> Goal:
        """Its own, or the place that it is guided to."""
        d, guide, own = self.scenario.dimension, self.guidance.guide, self.scenario.robots[k].goal
        if np.array_equal(guide.target[k], guide.goal[k]):
            return own
        return Goal(Stationary(guide.target[k, :d]), float(guide.tolerance[k]), bool(guide.stop[k]))

    def _others(self, k: int, paths: Sequence[Trajectory]) -> list[Obstacle]:
        """All robots that robot k could meet within the horizon, as it sees them."""
        guide, found, d = self.guidance.guide, [], self.scenario.dimension
        reach = self._reach(k) + self._navigators[k].margin
        for j, robot in enumerate(self.scenario.robots):
            apart, far = guide.position[j] - guide.position[k], reach + self._reach(j)
            if j != k and guide.present[j]:
                for by in images_within(apart[:d], far, self.scenario.period):
                    found.append(Obstacle(robot.shape, moved(paths[j], by), robot.name))
        return found

    def _reach(self, k: int) -> float:
        """How far [m] any point of the robot can get within the horizon."""
        guide = self.guidance.guide
        speed = max(float(guide.max_speed[k]), float(np.linalg.norm(guide.velocity[k])))
        return speed * self.scenario.horizon + float(guide.radius[k])
