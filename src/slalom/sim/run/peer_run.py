"""The loop over time for robots that another project's method moves."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.peers import Crowd, Peer, discs, outlines
from slalom.shape import Disc
from slalom.sim.measure.recording import CHOSEN, UNANSWERED, Recording, Step
from slalom.sim.measure.run_summary import RunSummary
from slalom.sim.run.plant import drive
from slalom.sim.scenario import Robot, Scenario
from slalom.state import State


@dataclass
class Member:
    """One robot of the crowd: its state, the velocity it goes to, whether the peer chose that, when it arrived."""

    robot: Robot
    state: State
    aim: Array
    answered: bool = True
    arrived: float = np.inf

    @property
    def gone(self) -> bool:
        """A robot that passes its goal leaves the scene there."""
        return bool(np.isfinite(self.arrived)) and not self.robot.goal.stop

    def note_arrival(self, now: float) -> None:
        """Once it has arrived, it has."""
        state = self.state
        if not np.isfinite(self.arrived) and self.robot.goal.reached(state.position, state.velocity, now):
            self.arrived = now

    def step(self, peer: Peer, dt: float, due: bool, spent: float) -> Step:
        """What it does in a step of dt [s], at whose begin a decision was `due` and took `spent` [s]."""
        here, aim = not self.gone, np.zeros(2) if self.gone else self.aim
        push = (aim - self.state.velocity) / dt
        size, most = float(np.linalg.norm(push)), self.robot.limits.max_acceleration
        if peer.limited and here and size > most:
            push *= most / size
        outcome = (CHOSEN if self.answered else UNANSWERED) if due and here else ""
        return Step(self.state.position, self.state.velocity, push, aim, peer.name, outcome, spent if outcome else 0.0)


def simulate_peer(
    scenario: Scenario,
    peer: Peer,
    *,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    record: bool = True,
) -> Recording | RunSummary:
    """Run a scenario with a peer until all robots have arrived or its time is over.

    The robots are those of every run, double integrators with the same goals. A robot prefers its goal's
    `desired_velocity` and reaches the velocity that the peer chose by a constant acceleration over the step; with a
    `limited` peer by at most its largest one, so perhaps not within the step. Of obstacles the peer sees where they
    are and how fast. The settings of navigators (horizon, margin, patience, holds) do not concern it.

    Controls in the recording are the chosen velocities [m/s], decision times each robot's share of the time for all. A
    robot for which the peer answers with no number keeps its velocity, and the outcome says so.

    Raises:
        InvalidInput: the peer's package is not installed; a scenario in space, a robot that is not a disc or has
            other limits than a largest speed and acceleration, an obstacle that the peer cannot avoid; robots that see
            each other late or inexactly; a world that repeats.
    """
    for name in ("sight_noise", "sight_delay", "sight_loss"):
        if getattr(scenario, name):
            raise InvalidInput(
                f"{name}: expected 0 for {peer.name}, which sees exactly; found {getattr(scenario, name):g}"
            )
    if scenario.period is not None:
        raise InvalidInput(f"period: expected none for {peer.name}, which knows one world; found {scenario.period}")
    for robot in scenario.robots:
        _refuse(robot, peer)
    walls = outlines(scenario.obstacles, walls=peer.walls)
    members = [Member(robot, robot.state, robot.state.velocity) for robot in scenario.robots]
    dt, count = scenario.dt, round(scenario.duration / scenario.dt)
    crowd, here = _begin(scenario, peer, members, walls), members
    rows: list[list[Step]] = []
    statuses: Counter[str] = Counter()
    done = 0
    for k in range(count):
        now = scenario.start + k * dt
        for member in members:
            member.note_arrival(now)
        if all(np.isfinite(member.arrived) for member in members):
            break
        due, spent = k % scenario.steps_per_decision == 0, 0.0
        if due:
            before = perf_counter()
            staying = [member for member in members if not member.gone]
            if len(staying) < len(here):
                crowd, here = _begin(scenario, peer, staying, walls), staying
            _choose(scenario, crowd, here, now)
            spent = (perf_counter() - before) / len(here)
        row, done = [member.step(peer, dt, due, spent) for member in members], k + 1
        statuses.update(step.outcome for step in row if step.outcome)
        if record:
            rows.append(row)
        for member, step in zip(members, row):
            member.state = drive(member.state, step.acceleration, dt)
        if progress:
            progress((k + 1) / count)
    for member in members:
        member.note_arrival(scenario.start + dt * done)
    ends, arrived = [member.state for member in members], [member.arrived for member in members]
    if not record:
        return RunSummary.of(scenario, peer.name, seed, done, ends, arrived, statuses, foresight=peer.foresight)
    return Recording.of_many(scenario, peer.name, seed, rows, ends, arrived, foresight=peer.foresight)


def _refuse(robot: Robot, peer: Peer) -> None:
    limits = robot.limits
    more = [what for what in ("velocity_bounds", "acceleration_bounds", "bounds") if getattr(limits, what)]
    if not isinstance(robot.shape, Disc) or more:
        found = more[0] if more else f"a {type(robot.shape).__name__.lower()}"
        raise InvalidInput(
            f"{robot.name}: expected a disc in the plane with max_speed and max_acceleration alone, as {peer.name} "
            f"takes it, found {found}"
        )


def _begin(scenario: Scenario, peer: Peer, here: Sequence[Member], walls: tuple[Array, ...]) -> Crowd:
    """The crowd of the robots that are in the scene."""
    radii = np.array([member.robot.shape.bounding_radius for member in here])
    speeds = np.array([member.robot.limits.max_speed for member in here])
    return peer.begin(radii, speeds, scenario.dt * scenario.steps_per_decision, walls)


def _choose(scenario: Scenario, crowd: Crowd, here: Sequence[Member], now: float) -> None:
    """Ask the peer where the robots in the scene go, none faster than it can."""
    places = np.array([member.state.position for member in here])
    velocities = np.array([member.state.velocity for member in here])
    preferred = np.array(
        [m.robot.goal.desired_velocity(m.state.position, m.state.velocity, now, m.robot.limits) for m in here]
    )
    chosen = crowd.choose(places, velocities, preferred, discs(scenario.obstacles, now))
    for member, aim in zip(here, chosen):
        member.answered = bool(np.isfinite(aim).all())
        # In single precision RVO2 goes up to a percent beyond the largest speed that it was told.
        excess = float(np.linalg.norm(aim)) / member.robot.limits.max_speed
        member.aim = aim / max(excess, 1.0) if member.answered else member.state.velocity
