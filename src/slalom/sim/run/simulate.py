"""The loop over time, the only one of the simulator.

    at every decision
        states --------> decide: one robot, a fleet or a peer
          ^                                   |
          |                                   v
    at every step
        RobotStates <--- integrate <--- accelerations ---> record
        of a Scenario    exact                             RunLog ---> Recording or RunSummary

A `Decider` decides for one robot, a fleet or a peer. The loop holds what all runs share: times, arrivals, integration
and records.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Literal, overload

import numpy as np

from slalom.base.checks import OBJECTIVE, Array, flag, has, whole
from slalom.base.errors import InvalidInput
from slalom.decision.methods import Method
from slalom.decision.objective import Objective
from slalom.kernels.arrays import Indices
from slalom.peers import Peer, contender
from slalom.sim.measure.recording import Recording, RunLog, RunSummary, Step
from slalom.sim.run.appearance import let_appear
from slalom.sim.run.deciders import Decider, Decisions, FleetDecider, PeerDecider, SingleRobotDecider
from slalom.sim.run.dispatch import Dispatcher
from slalom.sim.scenario import Scenario


@overload
def simulate(
    scenario: Scenario,
    method: Method | Peer | str,
    *,
    objective: Objective | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
    record: Literal[True] = True,
) -> Recording: ...


@overload
def simulate(
    scenario: Scenario,
    method: Method | Peer | str,
    *,
    objective: Objective | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
    record: Literal[False],
) -> RunSummary: ...


def simulate(
    scenario: Scenario,
    method: Method | Peer | str,
    *,
    objective: Objective | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
    record: bool = True,
) -> Recording | RunSummary:
    """Run a scenario until all robots have arrived or its duration has passed.

    A robot is a double integrator: its acceleration is constant during a step, so a step is the exact motion that was
    predicted. With a peer see `PeerDecider`.

    All robots decide from the same past, the states at the start of the step. Each observes the others as
    `method.robot_forecast` says. With a `shared` method they decide one after the other, in the order of their names,
    which begins with another robot at each step. Each then receives the manoeuvres to which all others are committed at
    that moment (docs/theory.md, 16).

    The result depends on the scenario and the method, and on the seed where sensing is late or inexact. It depends
    neither on the order of `scenario.robots` nor on `threads`.

    Args:
        method: by which all robots decide that have none of their own; itself or its name.
        objective: of robots that have none of their own, for scenarios of one robot; None: to arrive.
        seed: from which the scenario was built, for the record; it also draws the errors of sensing.
        progress: called with the share of the duration that has passed.
        threads: number of threads in which a fleet decides; None: NUMBA_NUM_THREADS, by default one per core.
        record: with False the result is the `RunSummary` of the same run. Memory then is O(n) in the number of robots,
            independent of duration (O(n^2) where sensing is late or inexact). A recording takes
            some hundred bytes per robot and step.

    Raises:
        InvalidInput: not a scenario or not a method; two robots of one name; a method for one robot alone; an objective
            of one of several robots, of a peer, or of a method that looks ahead; with a shared method, manoeuvres that
            last longer than the horizon.
    """
    if progress is not None:
        has(progress, ("__call__",), "a function", "progress")
    flag(record, "record")
    run = Run(scenario, method, objective=objective, seed=seed, threads=threads, record=record)
    for share in run.steps():
        if progress:
            progress(share)
    return Recording.of(run.log) if record else RunSummary.of(run.log)


class Run:
    """A run that is made step by step; `simulate` makes all of them at once.

    Attributes:
        log: the steps made so far, and the states after them. decider: holds the states and the latest decisions.
        dispatcher: sets the goals of robots with tasks; None without tasks.

    Args:
        scenario, method, objective, seed, threads, record: see `simulate`, which also lists what is refused.
    """

    def __init__(
        self,
        scenario: Scenario,
        method: Method | Peer | str,
        *,
        objective: Objective | None = None,
        seed: int = 0,
        threads: int | None = None,
        record: bool = True,
    ) -> None:
        has(scenario, ("robots", "obstacles"), "a scenario, such as gallery.build('ring')", "scenario")
        method = contender(method)
        whole(seed, "seed")
        if threads is not None:
            whole(threads, "threads", 1)
        if objective is not None:
            has(objective, *OBJECTIVE, "objective")
            robots = (replace(robot, objective=robot.objective or objective) for robot in scenario.robots)
            scenario = replace(scenario, robots=tuple(robots))
        self.decider, self._rows = _decider_and_rows(scenario, method, seed, threads)
        several = len(scenario.robots) > 1 and not isinstance(method, Peer)
        # A peer refuses robots with methods of their own.
        names = dict.fromkeys((robot.method or method).name for robot in scenario.robots)
        foresight = method.foresight_among if several else method.foresight
        self.log = RunLog(scenario, "+".join(names), seed, foresight)
        self.dispatcher = None if scenario.tasks is None else Dispatcher(self.decider.states)
        self._record = record

    def steps(self) -> Iterator[float]:
        """Make one step after the other; yield the share of the duration that has passed after each."""
        decider = self.decider
        log = self.log
        rows = self._rows
        scenario, states = log.scenario, decider.states
        dt = scenario.dt
        count = round(scenario.duration / dt)
        for k in range(count):
            now = scenario.start + k * dt
            states.note_arrivals(now)
            if states.all_arrived and (self.dispatcher is None or self.dispatcher.finished):
                break
            made = Decisions([""] * len(rows), 0.0)
            if k % scenario.steps_per_decision == 0:
                let_appear(decider, now)
                if self.dispatcher is not None:
                    self.dispatcher.update(now)
                made = decider.decide(now)
            acceleration = decider.accelerations(now, dt)
            log.count += 1
            log.statuses.update(filter(None, made.outcomes))
            if self._record:
                log.steps.append(_step(decider, acceleration, made, rows, scenario.dimension))
            states.integrate(acceleration, dt)
            self._note_end()
            yield (k + 1) / count
        states.note_arrivals(scenario.start + dt * log.count)
        self._note_end()

    def _note_end(self) -> None:
        """Note the states after the steps made so far."""
        states = self.decider.states
        rows = self._rows
        d = self.log.scenario.dimension
        arrived, appeared = states.arrived[rows], states.appeared[rows]
        if self.dispatcher is not None:
            arrived = np.where(self.dispatcher.free[rows], arrived, np.inf)
            self.log.tasks = self.dispatcher.log_of(np.argsort(rows))
        self.log.end(states.position[rows, :d], states.velocity[rows, :d], arrived, appeared)


def _decider_and_rows(
    scenario: Scenario, method: Method | Peer, seed: int, threads: int | None
) -> tuple[Decider, Indices]:
    """The decider of a run, and the row of each robot of the scenario in it."""
    rows = np.arange(len(scenario.robots))
    alone = len(rows) == 1 and not isinstance(method, Peer)
    for robot in scenario.robots:
        if robot.objective is not None and not alone:
            raise InvalidInput(
                f"{robot.name}.objective: expected none for {method.name} with {len(rows)} robots, "
                f"found {robot.objective!r}"
            )
    if isinstance(method, Peer):
        return PeerDecider(scenario, method), rows
    if len(rows) == 1:
        return SingleRobotDecider(scenario, method), rows
    names = [robot.name for robot in scenario.robots]
    if len(set(names)) < len(names):
        raise InvalidInput(f"robots: expected a name for each, found {names}")
    ordered, rows = by_name(scenario)
    return FleetDecider(ordered, method, seed, threads), rows


def by_name(scenario: Scenario) -> tuple[Scenario, Indices]:
    """Return a scenario whose robots are sorted by name, and the row of each robot of the given one in it.

    Fleets are sorted so that sums over robots have the same bits in any order of the scenario.
    """
    names = [robot.name for robot in scenario.robots]
    order = sorted(range(len(names)), key=lambda k: names[k])
    return replace(scenario, robots=tuple(scenario.robots[k] for k in order)), np.argsort(order)


def _step(decider: Decider, acceleration: Array, made: Decisions, rows: Indices, d: int) -> Step:
    """The notes of one step, robot k from row rows[k]."""
    states = decider.states
    (controls, responses) = decider.committed()
    order = rows.tolist()
    outcomes = tuple(made.outcomes[k] for k in order)
    return Step(
        positions=states.position[rows, :d],
        velocities=states.velocity[rows, :d],
        accelerations=acceleration[rows, :d],
        controls=controls[rows],
        responses=tuple(responses[k] for k in order),
        outcomes=outcomes,
        decision_times=np.where(np.array(outcomes) != "", made.time, 0.0),
    )
