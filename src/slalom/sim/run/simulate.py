"""The loop over time."""

from collections import Counter
from collections.abc import Callable
from time import perf_counter
from typing import Literal, overload

import numpy as np

from slalom.checks import has
from slalom.decision import Decision
from slalom.methods import Method
from slalom.peers import Peer
from slalom.sim.measure.recording import Recording, Step
from slalom.sim.measure.run_summary import RunSummary
from slalom.sim.run.fleet import simulate_fleet
from slalom.sim.run.peer_run import simulate_peer
from slalom.sim.run.plant import drive
from slalom.sim.scenario import Scenario
from slalom.state import State


@overload
def simulate(
    scenario: Scenario,
    method: Method | Peer,
    *,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
    record: Literal[True] = True,
) -> Recording: ...


@overload
def simulate(
    scenario: Scenario,
    method: Method | Peer,
    *,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
    record: Literal[False],
) -> RunSummary: ...


def simulate(
    scenario: Scenario,
    method: Method | Peer,
    *,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
    record: bool = True,
) -> Recording | RunSummary:
    """Run a scenario until the robot has arrived or its time is over; of several robots, see `fleet.simulate_fleet`,
    with another project's method `peer_run.simulate_peer`.

    A robot is a double integrator: between steps its acceleration is constant, so a step is the exact motion that was
    predicted. The result depends on the scenario and the method alone; `seed`, with which the scenario was built,
    is recorded. `progress` is called with the share of the duration that has passed; `threads`: see `simulate_fleet`.

    A recording takes some hundred bytes for each robot and step. With `record=False` there is none: the result is the
    `Ending` of the same run, and memory does not grow with the time that it lasts.

    Raises:
        InvalidInput: something else than a scenario, or than a method.
    """
    has(scenario, ("robots", "obstacles"), "a scenario, such as gallery.build('ring')", "scenario")
    if isinstance(method, Peer):
        return simulate_peer(scenario, method, seed=seed, progress=progress, record=record)
    has(method, ("responses", "forecast"), "a method, such as method('nao')", "method")
    if len(scenario.robots) > 1:
        return simulate_fleet(scenario, method, seed=seed, progress=progress, threads=threads, record=record)
    return _alone(scenario, method, seed, progress, record)


def _alone(
    scenario: Scenario, method: Method, seed: int, progress: Callable[[float], None] | None, record: bool
) -> Recording | RunSummary:
    """The run of one robot."""
    navigator, goal, dt = scenario.decider(method), scenario.robot.goal, scenario.dt
    state, decision, now = scenario.robot.state, None, scenario.start
    steps: list[Step] = []
    statuses: Counter[str] = Counter()
    count = round(scenario.duration / dt)
    for k in range(count + 1):
        now, done = scenario.start + k * dt, k
        arrived = goal.reached(state.position, state.velocity, now)
        if arrived or k == count:
            break
        outcome, spent = "", 0.0
        if k % scenario.steps_per_decision == 0 or decision is None:
            before = perf_counter()
            around = scenario.around(state, now, method)
            decision = navigator.decide(state, around, goal, now=now, previous=decision)
            outcome, spent = decision.outcome.name, perf_counter() - before
            statuses[outcome] += 1
        chosen = decision.manoeuvre
        push = chosen.mean_acceleration(now, dt)
        if record:
            text = repr(chosen.response)
            steps.append(Step(state.position, state.velocity, push, chosen.control, text, outcome, spent))
        state = drive(state, push, dt)
        if progress:
            progress((k + 1) / count)
    if record:
        return Recording.of(scenario, method.name, seed, steps, state, foresight=method.foresight)
    end = [now if arrived else np.inf]
    return RunSummary.of(scenario, method.name, seed, done, [state], end, statuses, foresight=method.foresight)


def decision_at(recording: Recording, scenario: Scenario, method: Method, step: int) -> Decision:
    """The decision that was in force at `step` of a recorded run, made again from the recorded states."""
    navigator, decision = scenario.decider(method), None
    for k in range(0, step + 1, scenario.steps_per_decision):
        state = State(recording.positions[k, 0], recording.velocities[k, 0], recording.acceleration_before(k))
        now = float(recording.times[k])
        around = scenario.around(state, now, method)
        decision = navigator.decide(state, around, scenario.robot.goal, now=now, previous=decision)
    assert decision is not None
    return decision
