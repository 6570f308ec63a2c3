"""A recorded run as a scenario, a method and steps: to replay it, and to make its decisions again."""

from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.decision import Decision
from slalom.decision.methods import HOLDS, METHODS, Method, method
from slalom.model.state import State
from slalom.peers import contender
from slalom.sim.measure.recording import OBSERVED, Recording, Step
from slalom.sim.run.deciders import SingleRobotDecider
from slalom.sim.scenario import SETTINGS, Robot, Scenario, from_numbers


class Recorded(NamedTuple):
    """A recorded run.

    Attributes:
        method: by which all robots decided; None if it has no control space here. name: of the method.
        end: the states at the end, as a step. arrived: (n,) absolute times [s], inf for robots that did not arrive.
        notes: assumptions, a sentence each. seed: of the errors of sensing.
        decision: the only one, of a file; None: the decisions of the method are made again.
    """

    scenario: Scenario
    method: Method | None
    name: str
    steps: list[Step]
    end: Step
    arrived: Array
    notes: tuple[str, ...]
    seed: int = 0
    decision: Decision | None = None


def recorded(recording: Recording) -> Recorded:
    """Return the scenario of a recording, the method of its robots, and its steps; of one robot from its appearance on.

    Raises:
        InvalidInput: a run without a step.
    """
    if len(recording.shapes) == 1:
        recording = recording.only()
    count = len(recording.accelerations)
    if not count:
        raise InvalidInput("recording: expected a run with at least one step, found a robot that starts at its goal")
    settings = {name: value for name, value in recording.settings.items() if name in SETTINGS}
    notes = (
        []
        if settings or recording.method == OBSERVED
        else ["The file states no settings: horizon, margin and holds are the default ones."]
    )
    later = {k: t for k, t in enumerate(recording.appears.tolist()) if t > recording.times[0]}
    parts = zip(recording.shapes, recording.limits, _first_states(recording), recording.goals)
    robots = tuple(Robot(*each, f"robot {k}", appears=later.get(k)) for k, each in enumerate(parts))
    scenario = Scenario(
        recording.scenario,
        robots,
        recording.obstacles,
        start=float(recording.times[0]),
        duration=float(recording.times[-1] - recording.times[0]),
        holds=recording.holds or HOLDS,
        **from_numbers({**settings, "dt": recording.dt}),
    )
    steps = [
        Step(
            recording.positions[k],
            recording.velocities[k],
            recording.accelerations[k],
            recording.controls[k],
            recording.responses.rows[k],
            recording.outcomes[k],
            recording.decision_times[k],
        )
        for k in range(count)
    ]
    found, more = method_of(recording)
    end = last_state(recording.positions[-1], recording.velocities[-1])
    return Recorded(scenario, found, recording.method, steps, end, recording.arrived, (*notes, *more), recording.seed)


def _first_states(recording: Recording) -> list[State]:
    """Return the state of each robot as it appears, at rest at its place if it does not."""
    rows = [min(recording.steps_of(k).start, len(recording.accelerations)) for k in range(len(recording.shapes))]
    return [State(recording.positions[row, k], recording.velocities[row, k]) for k, row in enumerate(rows)]


def last_state(positions: Array, velocities: Array) -> Step:
    """Return the states (n, d) at the end of a run as a step without accelerations and decisions."""
    zero, none = np.zeros_like(positions), ("",) * len(positions)
    return Step(positions, velocities, zero, zero, none, none, np.zeros(len(positions)))


def method_of(recording: Recording) -> tuple[Method | None, tuple[str, ...]]:
    """Return the method of a recording, None for peers, mixed and unknown ones; and a sentence if it is None."""
    name = recording.method
    plain = name.partition("@")[0]
    if plain in METHODS and "+" not in name:
        return method(name), ()
    if "+" in name:
        return None, (f"The robots decide by different methods ({name}): no control space is shown.",)
    if name == OBSERVED:
        return None, ("The agents moved as observed, by no method: no control space is shown.",)
    contender(name, installed=False)
    return None, (f"{name} is a method of another project: it has no control space here.",)


def decisions(recording: Recording, scenario: Scenario, method: Method) -> Iterator[Decision]:
    """Yield the decisions of a recorded run of one robot, made again from the recorded states, one after the other."""
    decider = SingleRobotDecider(scenario, method)
    for k in range(0, len(recording.accelerations), scenario.steps_per_decision):
        state = State(recording.positions[k, 0], recording.velocities[k, 0], recording.acceleration_before(k))
        yield decider.decide_in(state, float(recording.times[k]))


def decision_at(recording: Recording, scenario: Scenario, method: Method, step: int) -> Decision:
    """Return the decision in force at `step` of a recorded run of one robot, made again from the recorded states."""
    made = decisions(recording, scenario, method)
    return next(islice(made, step // scenario.steps_per_decision, None))
