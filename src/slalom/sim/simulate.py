"""The loop over time."""

from collections.abc import Callable
from time import perf_counter

from slalom.decision import Decision
from slalom.methods import Method
from slalom.peers import Peer
from slalom.sim.fleet import simulate_fleet
from slalom.sim.peer_run import simulate_peer
from slalom.sim.plant import drive
from slalom.sim.recording import Recording, Step
from slalom.sim.scenario import Scenario
from slalom.state import State


def simulate(
    scenario: Scenario,
    method: Method | Peer,
    *,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
) -> Recording:
    """Run a scenario until the robot has arrived or its time is over; of several robots, see `fleet.simulate_fleet`,
    with another project's method `peer_run.simulate_peer`.

    A robot is a double integrator: between steps its acceleration is constant, so a step is the exact motion that was
    predicted. The result depends on the scenario and the method alone; `seed`, with which the scenario was built,
    is recorded. `progress` is called with the share of the duration that has passed; `threads`: see `simulate_fleet`.
    """
    if isinstance(method, Peer):
        return simulate_peer(scenario, method, seed=seed, progress=progress)
    if len(scenario.robots) > 1:
        return simulate_fleet(scenario, method, seed=seed, progress=progress, threads=threads)
    navigator, goal, dt = scenario.decider(method), scenario.robot.goal, scenario.dt
    state, decision = scenario.robot.state, None
    steps: list[Step] = []
    count = round(scenario.duration / dt)
    for k in range(count):
        now = scenario.start + k * dt
        if goal.reached(state.position, state.velocity, now):
            break
        if k % scenario.steps_per_decision == 0 or decision is None:
            before = perf_counter()
            decision = navigator.decide(state, scenario.obstacles, goal, now=now, previous=decision)
            outcome, spent = decision.outcome.name, perf_counter() - before
        else:
            outcome, spent = "", 0.0
        push = decision.manoeuvre.mean_acceleration(now, dt)
        chosen = decision.manoeuvre
        steps.append(Step(state.position, state.velocity, push, chosen.control, repr(chosen.response), outcome, spent))
        state = drive(state, push, dt)
        if progress:
            progress((k + 1) / count)
    return Recording.of(scenario, method.name, seed, steps, state, foresight=method.foresight)


def decision_at(recording: Recording, scenario: Scenario, method: Method, step: int) -> Decision:
    """The decision that was in force at `step` of a recorded run, made again from the recorded states."""
    navigator, decision = scenario.decider(method), None
    for k in range(0, step + 1, scenario.steps_per_decision):
        state = State(recording.positions[k, 0], recording.velocities[k, 0], recording.acceleration_before(k))
        now = float(recording.times[k])
        decision = navigator.decide(state, scenario.obstacles, scenario.robot.goal, now=now, previous=decision)
    assert decision is not None
    return decision
