"""The loop over time for several robots that meet each other."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.methods import Method
from slalom.sim.measure.closest_approach import driven
from slalom.sim.measure.recording import Recording
from slalom.sim.measure.run_summary import RunSummary
from slalom.sim.run.among import Decider
from slalom.sim.run.crew import FleetDecider, is_disc_fleet
from slalom.sim.run.guidance import Guidance
from slalom.sim.run.pilots import NavigatorDecider
from slalom.sim.scenario import Scenario
from slalom.state import State


def simulate_fleet(
    scenario: Scenario,
    method: Method,
    *,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
    record: bool = True,
) -> Recording | RunSummary:
    """Run a scenario of several robots until all have arrived or its time is over.

    At every step all robots see the same past: each sees the others as `method.of_robots` says, from their states at
    the begin of the step. With a method that is `shared` they decide one after the other, in the order of their names,
    which begins with another one at each step, and each sees the manoeuvres that all others are committed to at that
    moment (docs/theory.md, 16). Who cannot be met within the horizon is not looked at; nobody else is left out.

    The result does not depend on the order of `scenario.robots`, nor on the number of `threads` in which robots that
    only see each other decide (None: as many as NUMBA_NUM_THREADS says, by default one for each core).

    With `record=False` nothing is kept of what happened in between; the result is the `Ending`. What stays in memory
    is of the order of the number of robots; where sight or messages are late, inexact or lost, of its square.

    Raises:
        InvalidInput: two robots of one name; with a shared method, manoeuvres that last longer than the horizon.
    """
    names = [robot.name for robot in scenario.robots]
    if len(set(names)) < len(names):
        raise InvalidInput(f"robots: expected a name for each, found {names}")
    order = sorted(range(len(names)), key=lambda k: names[k])
    # Robots are always handled in the order of their names, so that sums over them have the same bits.
    sorted_scenario = replace(scenario, robots=tuple(scenario.robots[k] for k in order))
    if method.looks_ahead:
        raise InvalidInput(f"method: expected one for several robots, found {method.name}, for a robot alone")
    method = method.among_robots()
    if method.shared:
        _refuse_short_horizon(sorted_scenario, method)
    run = _Run(sorted_scenario, method, seed, threads, record)
    run.to_the_end(progress)
    where = [order.index(k) for k in range(len(order))]
    return (run.recording if record else run.ending)(scenario, method, seed, where)


def _refuse_short_horizon(scenario: Scenario, method: Method) -> None:
    """Robots at rest can be avoided for all time, robots that still move after the horizon cannot."""
    for k, robot in enumerate(scenario.robots):
        navigator = scenario.navigator(method, k)
        for response in method.responses(navigator.limits, navigator.period, navigator.holds):
            end = response.knots(1e6, 1.0)[-2]
            if end > scenario.horizon:
                longest = f"{end:g} s, the longest manoeuvre of {robot.name!r}"
                raise InvalidInput(f"horizon: expected at least {longest}, found {scenario.horizon:g} s")


class _Run:
    """A run while it goes on: what has been driven so far, step by step."""

    def __init__(self, scenario: Scenario, method: Method, seed: int, threads: int | None, record: bool) -> None:
        self.scenario, self.record, self.steps = scenario, record, 0
        self.statuses: Counter[str] = Counter()
        self.guidance = Guidance(scenario, threads)
        self.deciders: Decider = (
            FleetDecider(scenario, method, self.guidance, seed, threads)
            if is_disc_fleet(scenario)
            else NavigatorDecider(scenario, method, self.guidance, seed)
        )
        self.states: list[tuple[Array, Array]] = []
        self.pushes: list[Array] = []
        self.controls: list[Array] = []
        self.responses: list[tuple[str, ...]] = []
        self.outcomes: list[tuple[str, ...]] = []
        self.times: list[Array] = []

    def to_the_end(self, progress: Callable[[float], None] | None) -> None:
        s, guidance, n = self.scenario, self.guidance, len(self.scenario.robots)
        count = round(s.duration / s.dt)
        for k in range(count):
            now = s.start + k * s.dt
            guidance.note_arrivals(now)
            if np.all(np.isfinite(guidance.arrived)):
                break
            outcomes: dict[int, str] = {}
            spent: dict[int, float] = {}
            if k % s.steps_per_decision == 0:
                guidance.update(now, s.dt * s.steps_per_decision)
                turns = [(k + j) % n for j in range(n)]
                outcomes, spent = self.deciders.decide([j for j in turns if guidance.guide.present[j]], now)
            push = self._pushed(now)
            self.steps += 1
            self.statuses.update(outcomes.values())
            if self.record:
                self._note(push, outcomes, spent)
            guidance.drive(push, s.dt)
            if progress:
                progress((k + 1) / count)
        guidance.note_arrivals(s.start + s.dt * self.steps)
        self.states.append((guidance.guide.position.copy(), guidance.guide.velocity.copy()))

    def _pushed(self, now: float) -> Array:
        """What all apply; who has left the scene comes to rest at once."""
        push, guide = self.deciders.push(now, self.scenario.dt), self.guidance.guide
        push[~guide.present] = -guide.velocity[~guide.present] / self.scenario.dt
        return push

    def _note(self, push: Array, outcomes: dict[int, str], spent: dict[int, float]) -> None:
        guide, n = self.guidance.guide, len(push)
        self.states.append((guide.position.copy(), guide.velocity.copy()))
        self.pushes.append(push)
        controls, responses = self.deciders.chosen()
        self.controls.append(controls)
        self.responses.append(responses)
        self.outcomes.append(tuple(outcomes.get(k, "") for k in range(n)))
        self.times.append(np.array([spent.get(k, 0.0) for k in range(n)]))

    def ending(self, scenario: Scenario, method: Method, seed: int, where: list[int]) -> RunSummary:
        """How the run ended of which robot k stands in row where[k]."""
        (position, velocity), d = self.states[-1], scenario.dimension
        return RunSummary.of(
            scenario,
            method.name,
            seed,
            self.steps,
            [State(position[k, :d], velocity[k, :d]) for k in where],
            self.guidance.arrived[where].tolist(),
            self.statuses,
            foresight=method.foresight_among,
        )

    def recording(self, scenario: Scenario, method: Method, seed: int, where: list[int]) -> Recording:
        """The run of which robot k stands in column where[k] of what was noted."""
        n, d, steps = len(where), scenario.dimension, len(self.pushes)
        return Recording(
            scenario=scenario.name,
            method=method.name,
            seed=seed,
            dt=scenario.dt,
            parameters=dict(scenario.parameters),
            times=scenario.start + scenario.dt * np.arange(steps + 1, dtype=np.float64),
            positions=np.array([position for position, _ in self.states])[:, where, :d],
            velocities=np.array([velocity for _, velocity in self.states])[:, where, :d],
            accelerations=np.array(self.pushes).reshape(-1, n, 3)[:, where, :d],
            controls=np.array(self.controls).reshape(-1, n, d)[:, where],
            responses=tuple(tuple(row[k] for k in where) for row in self.responses),
            outcomes=tuple(tuple(row[k] for k in where) for row in self.outcomes),
            decision_times=np.array(self.times).reshape(-1, n)[:, where],
            shapes=tuple(robot.shape for robot in scenario.robots),
            limits=tuple(robot.limits for robot in scenario.robots),
            goals=tuple(robot.goal for robot in scenario.robots),
            arrived=self.guidance.arrived[where],
            obstacles=scenario.obstacles,
            foresight=method.foresight_among,
            period=scenario.period,
        )


def seen_by(recording: Recording, robot: int) -> Recording:
    """The run of one robot of several, in which the others are obstacles on the paths that they drove."""
    steps, one = len(recording.accelerations), slice(robot, robot + 1)
    others = [driven(recording, k) for k in range(len(recording.shapes)) if k != robot and steps]
    return replace(
        recording,
        positions=recording.positions[:, one],
        velocities=recording.velocities[:, one],
        accelerations=recording.accelerations[:, one],
        controls=recording.controls[:, one],
        responses=tuple(row[one] for row in recording.responses),
        outcomes=tuple(row[one] for row in recording.outcomes),
        decision_times=recording.decision_times[:, one],
        shapes=recording.shapes[one],
        limits=recording.limits[one],
        goals=recording.goals[one],
        arrived=recording.arrived[one],
        obstacles=(*recording.obstacles, *others),
    )
