"""The loop over time for several robots that meet each other."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from slalom.decision import Decision
from slalom.detour import keep_right
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method
from slalom.navigator import Navigator
from slalom.obstacle import Obstacle
from slalom.response import AccelerateThenBrake
from slalom.sim.plant import drive
from slalom.sim.recording import Recording, Step
from slalom.sim.scenario import Robot, Scenario
from slalom.state import State
from slalom.trajectory import ConstantAcceleration, PiecewisePolynomial, Stationary, Trajectory


@dataclass
class Pilot:
    """One robot while it drives: its state, what it is committed to, when it arrived, whether it has left."""

    robot: Robot
    navigator: Navigator
    state: State
    committed: Manoeuvre
    decision: Decision | None = None
    arrived: float = np.inf

    @property
    def gone(self) -> bool:
        """A robot that passes its goal leaves the scene there."""
        return bool(np.isfinite(self.arrived)) and not self.robot.goal.stop

    def reach(self, horizon: float) -> float:
        """How far [m] any point of the robot can get within `horizon` [s]."""
        speed = max(self.robot.limits.max_speed, float(np.linalg.norm(self.state.velocity)))
        return speed * horizon + self.robot.shape.reach


def simulate_fleet(
    scenario: Scenario, method: Method, *, seed: int = 0, progress: Callable[[float], None] | None = None
) -> Recording:
    """Run a scenario of several robots until all have arrived or its time is over.

    At every step all robots see the same past: each sees the others as `method.of_robots` says, from their states at
    the begin of the step. With a method that is `shared` they decide one after the other, in the order of their names,
    which begins with another one at each step, and each sees the manoeuvres that all others are committed to at that
    moment (docs/theory.md, 16). Who cannot be met within the horizon is not looked at; nobody else is left out.

    The result does not depend on the order of `scenario.robots`.

    Raises:
        InvalidInput: two robots of one name; with a shared method, manoeuvres that last longer than the horizon.
    """
    dt, horizon = scenario.dt, scenario.horizon
    names = [robot.name for robot in scenario.robots]
    if len(set(names)) < len(names):
        raise InvalidInput(f"robots: expected a name for each, found {names}")
    pilots = [_pilot(scenario, method, k) for k in range(len(scenario.robots))]
    if method.shared:
        _refuse_short_horizon(pilots, horizon)
    order = sorted(range(len(pilots)), key=lambda k: pilots[k].robot.name)
    rows: list[list[Step]] = []
    count = round(scenario.duration / dt)
    for k in range(count):
        now = scenario.start + k * dt
        _note_arrivals(pilots, now)
        if all(np.isfinite(pilot.arrived) for pilot in pilots):
            break
        due = k % scenario.steps_per_decision == 0
        seen = None if method.shared else [_observed(pilot, now) for pilot in pilots]
        decided: dict[int, tuple[Decision, float]] = {}
        for index in order[k % len(order) :] + order[: k % len(order)]:
            pilot = pilots[index]
            if due and not pilot.gone:
                others = _others(pilots, index, seen, method, now, horizon)
                before = perf_counter()
                goal = _way(pilots, index, now)
                decision = pilot.navigator.decide(
                    pilot.state, [*scenario.obstacles, *others], goal, now=now, previous=pilot.decision
                )
                decided[index] = decision, perf_counter() - before
                if method.shared:
                    pilot.committed, pilot.decision = decision.manoeuvre, decision
        rows.append([_step(pilot, decided.get(index), now, dt) for index, pilot in enumerate(pilots)])
        for pilot, step in zip(pilots, rows[-1]):
            pilot.state = drive(pilot.state, step.acceleration, dt)
        if progress:
            progress((k + 1) / count)
    _note_arrivals(pilots, scenario.start + dt * len(rows))
    return Recording.of_many(
        scenario, method.name, seed, rows, [pilot.state for pilot in pilots], [pilot.arrived for pilot in pilots]
    )


def _pilot(scenario: Scenario, method: Method, k: int) -> Pilot:
    """Before its first decision a robot is committed to go on for one period and to brake evenly then."""
    robot = scenario.robots[k]
    period = scenario.dt * scenario.steps_per_decision
    speed = float(np.linalg.norm(robot.state.velocity))
    brake = max(period, np.ceil(speed / robot.limits.braking / period - 1e-9) * period)
    still = Manoeuvre(AccelerateThenBrake(period, brake), robot.state, np.zeros(scenario.dimension), scenario.start)
    return Pilot(robot, scenario.navigator(method, k), robot.state, still)


def _refuse_short_horizon(pilots: list[Pilot], horizon: float) -> None:
    """Robots at rest can be avoided for all time, robots that still move after the horizon cannot."""
    for pilot in pilots:
        navigator = pilot.navigator
        for response in navigator.method.responses(navigator.limits, navigator.period, navigator.holds):
            end = response.knots(1e6, 1.0)[-2]
            if end > horizon:
                longest = f"{end:g} s, the longest manoeuvre of {pilot.robot.name!r}"
                raise InvalidInput(f"horizon: expected at least {longest}, found {horizon:g} s")


def _note_arrivals(pilots: list[Pilot], now: float) -> None:
    for pilot in pilots:
        if not np.isfinite(pilot.arrived) and pilot.robot.goal.reached(pilot.state.position, pilot.state.velocity, now):
            pilot.arrived = now


def _observed(pilot: Pilot, now: float) -> Trajectory:
    """What can be seen of a robot: where it is, how fast, and how it accelerates."""
    state = pilot.state
    return ConstantAcceleration(state.position, state.velocity, state.acceleration, now)


def _others(
    pilots: list[Pilot], index: int, seen: list[Trajectory] | None, method: Method, now: float, horizon: float
) -> list[Obstacle]:
    """All robots that robot `index` could meet within the horizon, as it sees them."""
    me = pilots[index]
    found = []
    for k, pilot in enumerate(pilots):
        if k == index or pilot.gone:
            continue
        away = float(np.linalg.norm(pilot.state.position - me.state.position))
        if away <= me.reach(horizon) + pilot.reach(horizon) + me.navigator.margin:
            path = pilot.committed if seen is None else method.of_robots(seen[k], now)
            found.append(Obstacle(pilot.robot.shape, path, pilot.robot.name))
    return found


def _way(pilots: list[Pilot], index: int, now: float) -> Goal:
    """The goal, or a place beside the one where the robot would meet others."""
    me = pilots[index]
    others = [pilot for k, pilot in enumerate(pilots) if k != index and not pilot.gone]
    if not others or me.robot.state.dimension != 2:
        return me.robot.goal
    place = keep_right(
        me.state.position,
        me.robot.goal.position(now),
        me.robot.limits.max_speed,
        me.robot.shape.reach,
        np.array([pilot.state.position for pilot in others]),
        np.array([pilot.state.velocity for pilot in others]),
        np.array([pilot.robot.shape.reach for pilot in others]),
    )
    return me.robot.goal if place is None else Goal(Stationary(place), 0.5)


def _step(pilot: Pilot, decided: tuple[Decision, float] | None, now: float, dt: float) -> Step:
    """What a robot does in the step that begins `now`."""
    outcome, spent = "", 0.0
    if decided is not None:
        pilot.decision, spent = decided
        pilot.committed, outcome = pilot.decision.manoeuvre, pilot.decision.outcome.name
    chosen = pilot.committed
    push = chosen.mean_acceleration(now, dt)
    if pilot.gone:
        push = -pilot.state.velocity / dt if np.any(pilot.state.velocity) else np.zeros_like(push)
    state = pilot.state
    return Step(state.position, state.velocity, push, chosen.control, repr(chosen.response), outcome, spent)


def seen_by(recording: Recording, robot: int) -> Recording:
    """The run of one robot of several, in which the others are obstacles on the paths that they drove."""
    others = []
    steps = len(recording.accelerations)
    for k, shape in enumerate(recording.shapes):
        if k == robot or not steps:
            continue
        last = steps
        if np.isfinite(recording.arrived[k]) and not recording.goals[k].stop:
            last = max(1, round((recording.arrived[k] - recording.times[0]) / recording.dt))
        powers = np.stack(
            [recording.positions[:last, k], recording.velocities[:last, k], 0.5 * recording.accelerations[:last, k]],
            axis=1,
        )
        path = PiecewisePolynomial(np.full(last, recording.dt), powers, float(recording.times[0]))
        others.append(Obstacle(shape, path, f"robot {k}"))
    one = slice(robot, robot + 1)
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
