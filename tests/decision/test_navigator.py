"""One robot's decisions: every outcome, the guarantee behind them, limits, goals, preferred controls, patience."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from draws import draws, draws_of
from motion import drive
from parts import disc_or_ball

from slalom import (
    METHODS,
    Acceleration,
    Arrive,
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    ControlObstacle,
    Decision,
    Disc,
    FollowVelocity,
    Goal,
    HalfSpace,
    HorizonByName,
    KeepAcceleration,
    Limits,
    Manoeuvre,
    Mix,
    MostClearance,
    Navigator,
    Objective,
    Obstacle,
    Outcome,
    Polyline,
    Rectangle,
    SafeTime,
    Sampled,
    SlalomError,
    State,
    Stationary,
    Tracks,
    advance,
    select,
)
from slalom.base.tolerances import COMMITTED_SLACK
from slalom.decision.objective import preferred_control
from slalom.kernels.decision.collision import COMPARED_COLLISION
from slalom.kernels.decision.costs import COST_TIE
from slalom.kernels.decision.policy import MIN_IMPROVEMENT
from slalom.obstacle.window import ObstacleWindow
from slalom.sim import Recording, Robot, Scenario, simulate
from slalom.sim.measure.closest_approach import closest_approaches
from slalom.sim.measure.metrics import ADJUSTMENT

PERIOD = 0.1
PLANES = (2, 3)
ALONE = ("vo", "avo", "nao")
"""Without obstacles nlvo is vo, and ao is nao."""


def vector(d: int, *values: float) -> np.ndarray:
    """A vector with these first components."""
    return np.array([*values, 0.0, 0.0, 0.0][:d])


def navigator(d: int = 2, method: str = "nao", **settings) -> Navigator:
    """A robot of radius 1 m, at most 5 m/s and 1 m/s^2."""
    alone = replace(METHODS[method], shared=False, looks_ahead=False)
    return Navigator(alone, **{"robot": disc_or_ball(1.0, d), "limits": Limits(5.0, 1.0), **settings})


def at(d: int, speed: float) -> State:
    """At the origin, moving along x."""
    return State(np.zeros(d), vector(d, speed))


def goal(d: int, x: float = 60.0, **settings) -> Goal:
    """A goal at rest on the x axis."""
    return Goal(Stationary(vector(d, x)), **settings)


def rock(d: int, radius: float, *position: float) -> Obstacle:
    """A round obstacle at rest."""
    return Obstacle(disc_or_ball(radius, d), Stationary(vector(d, *position)), "rock")


def gate(d: int, half: float, x: float = 10.0) -> list[Obstacle]:
    """Large rocks around the x axis that leave the robot a clearance of `half` on every side."""
    away = 21.0 + half
    sides = [(away, 0.0), (-away, 0.0), (0.0, away), (0.0, -away)][: 2 * (d - 1)]
    return [rock(d, 20.0, x, *side) for side in sides]


def sound(decision: Decision, d: int) -> Decision:
    """The decision, if every number in it is one."""
    acceleration = decision.manoeuvre.mean_acceleration(decision.manoeuvre.start, PERIOD)
    for numbers in (decision.manoeuvre.control, decision.preferred, acceleration):
        assert numbers.shape == (d,)
        assert np.all(np.isfinite(numbers))
    return decision


class Step(NamedTuple):
    """One step of a run."""

    now: float
    state: State
    decision: Decision
    acceleration: np.ndarray


def follow(robot: Navigator, state: State, obstacles: Sequence[Obstacle], goal: Goal, steps: int) -> Iterator[Step]:
    """The steps of a run."""
    decision = None
    for k in range(steps):
        now = k * robot.period
        decision = sound(robot.decide(state, obstacles, goal, now=now, previous=decision), state.dimension)
        acceleration = decision.manoeuvre.mean_acceleration(now, robot.period)
        yield Step(now, state, decision, acceleration)
        state = drive(state, acceleration, robot.period)


def gaps(steps: Sequence[Step], obstacle: Obstacle) -> np.ndarray:
    """Distances between centres at the steps."""
    return np.array([np.linalg.norm(s.state.position - obstacle.trajectory.position(s.now)) for s in steps])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("d", PLANES)
def test_clear(d: int, method: str) -> None:
    """What is behind or far away does not matter."""
    robot = navigator(d, method, objective=KeepAcceleration())
    decision = sound(robot.decide(at(d, 1.0), [rock(d, 1.0, -5.0), rock(d, 1.0, 0.0, 50.0)], goal(d)), d)
    assert decision.outcome is Outcome.CLEAR
    np.testing.assert_allclose(decision.manoeuvre.control, decision.preferred)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("d", PLANES)
def test_constrained(d: int, method: str) -> None:
    """A rock on the way to the goal: another control, which keeps the margin."""
    robot = navigator(d, method)
    decision = sound(robot.decide(at(d, 1.0), [rock(d, 2.0, 9.2, 0.1)], goal(d)), d)
    assert decision.outcome is Outcome.CONSTRAINED
    assert decision.outcome.safe
    assert decision.blocked.clearance(decision.manoeuvre.control) >= 0.0
    assert decision.blocked.clearance(decision.preferred) < 0.0 or np.any(
        np.abs(decision.manoeuvre.control - decision.preferred) > 0
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("d", PLANES)
def test_kept(d: int, method: str) -> None:
    """When nothing has changed, neither does the manoeuvre."""
    robot, rocks = navigator(d, method, patience=5.0), [rock(d, 2.0, 20.0, 6.0)]
    first, second, third = (step.decision for step in follow(robot, at(d, 2.0), rocks, goal(d), 3))
    assert first.outcome.safe
    assert second.outcome is third.outcome is Outcome.KEPT
    assert third.manoeuvre is second.manoeuvre is first.manoeuvre


@pytest.mark.parametrize("d", PLANES)
def test_continued(d: int) -> None:
    """A robot that brakes before a wall goes on braking when all it can still choose are velocities into it."""
    wall, limits = [rock(d, 20.0, 31.0)], Limits(4.0, 4.0)
    first = navigator(d, "nao", limits=limits).decide(at(d, 4.0), wall, goal(d))
    assert first.outcome.safe
    chooses_velocities = navigator(d, "nlvo", limits=limits, patience=0.0)
    now = 4.0 * PERIOD
    later = first.manoeuvre.advance(now)
    alone = chooses_velocities.decide(later, wall, goal(d), now=now)
    assert not alone.outcome.safe
    second = sound(chooses_velocities.decide(later, wall, goal(d), now=now, previous=first), d)
    assert second.outcome is Outcome.CONTINUED
    assert second.outcome.safe
    assert second.manoeuvre is first.manoeuvre


@pytest.mark.parametrize("d", PLANES)
def test_a_committed_manoeuvre_is_given_up_when_it_is_no_longer_safe(d: int) -> None:
    """A rock that was not predicted ends a commitment."""
    robot = navigator(d, patience=100.0)
    first = robot.decide(at(d, 4.0), [], goal(d))
    later = first.manoeuvre.advance(PERIOD)
    assert robot.decide(later, [], goal(d), now=PERIOD, previous=first).outcome is Outcome.KEPT
    second = sound(robot.decide(later, [rock(d, 2.0, 12.5)], goal(d), now=PERIOD, previous=first), d)
    assert second.manoeuvre is not first.manoeuvre
    assert second.outcome is Outcome.CONSTRAINED


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("d", PLANES)
def test_squeezed(d: int, method: str) -> None:
    """A gate that is wide enough for the robot but not for its margin, and too near to stop."""
    robot, obstacles = navigator(d, method, margin=0.05), gate(d, 0.02)
    decision = sound(robot.decide(at(d, 5.0), obstacles, goal(d)), d)
    assert decision.outcome is Outcome.SQUEEZED
    assert decision.outcome.safe
    assert 0.0 <= decision.blocked.clearance(decision.manoeuvre.control) <= 0.021
    assert navigator(d, method, margin=0.01).decide(at(d, 5.0), obstacles, goal(d)).outcome in (
        Outcome.CLEAR,
        Outcome.CONSTRAINED,
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("d", PLANES)
def test_delayed(d: int, method: str) -> None:
    """A closed gate, too near to stop: the collision comes no earlier than with any constant acceleration."""
    robot, obstacles = navigator(d, method), gate(d, -0.5)
    decision = sound(robot.decide(at(d, 5.0), obstacles, goal(d)), d)
    assert decision.outcome is Outcome.DELAYED
    assert not decision.outcome.safe
    contact = float(decision.blocked.time_to_collision(decision.manoeuvre.control))
    assert contact < robot.horizon
    assert contact >= float(decision.blocked.time_to_collision(decision.preferred)) - robot.period
    at_full_speed = (10.0 - np.sqrt(21.0**2 - 20.5**2)) / 5.0
    assert contact > at_full_speed - 1e-6


def latest_by_bisection(robot: Navigator, state: State, goal: Goal, window: ObstacleWindow) -> float:
    """The latest collision [s] of all responses, to a hundredth of a period, by exact choices up to a time."""
    latest = 0.0
    for s in robot.situations(state, goal, 0.0):
        preferred = preferred_control(robot.objective.aims(s))
        blocked, low, high = ControlObstacle(s.response, state, window, robot.robot), 0.0, s.horizon
        while high - low > 0.01 * robot.period:
            middle = 0.5 * (low + high)
            free = select(preferred, s.admissible, replace(blocked, horizon=middle)).control is not None
            low, high = (middle, high) if free else (low, middle)
        latest = max(latest, low)
    return latest


@pytest.mark.parametrize("seed", draws(range(12)))
def test_the_latest_collision_is_that_of_the_slow_search(seed: int) -> None:
    """Rings of discs and rectangles that close around the robot: no response collides more than a period later."""
    rng = np.random.default_rng(seed)
    robot, state = navigator(2, "nao"), at(2, 3.0)
    angles, shapes = np.arange(16) * np.pi / 8.0, (Disc(1.2), Rectangle(2.4, 2.4))
    ring = []
    for k, angle in enumerate(angles + rng.uniform(-0.05, 0.05, 16)):
        outwards = np.array([np.cos(angle), np.sin(angle)])
        closing = ConstantVelocity(rng.uniform(4.0, 5.0) * outwards, -rng.uniform(0.5, 1.0) * outwards)
        ring.append(Obstacle(shapes[k % 2], closing, f"{k}"))
    decision = robot.decide(state, ring, goal(2))
    assert decision.outcome is Outcome.DELAYED
    latest = latest_by_bisection(robot, state, goal(2), robot.predict(ring, state, 0.0))
    found = float(decision.blocked.time_to_collision(decision.manoeuvre.control))
    assert -0.02 * robot.period <= latest - found <= (1.0 + COMPARED_COLLISION) * robot.period + 0.02 * robot.period


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("d", PLANES)
def test_impact(d: int, method: str) -> None:
    """A wall 20 cm ahead at 5 m/s: all that can be done is to brake."""
    robot = navigator(d, method)
    decision = sound(robot.decide(at(d, 5.0), [rock(d, 20.0, 21.2)], goal(d)), d)
    assert decision.outcome is Outcome.IMPACT
    assert not decision.outcome.safe
    acceleration = decision.manoeuvre.mean_acceleration(0.0, PERIOD)
    assert acceleration[0] < -0.5
    assert np.linalg.norm(acceleration) <= 1.0 + 1e-9


@pytest.mark.parametrize("method", ALONE)
@pytest.mark.parametrize("d", PLANES)
@pytest.mark.parametrize("offset", draws([0.0, 1e-9, 0.7]))
def test_escaping(offset: float, d: int, method: str) -> None:
    """From inside an obstacle, even from its very centre, the robot leaves, and then it drives on."""
    robot, obstacle = navigator(d, method), rock(d, 2.0, 0.0, -offset)
    steps = list(follow(robot, at(d, 0.0), [obstacle], goal(d, -40.0), 40))
    assert steps[0].decision.outcome is Outcome.ESCAPING
    assert not steps[0].decision.outcome.safe
    escaping = [s.decision.outcome is Outcome.ESCAPING for s in steps]
    assert not any(escaping[escaping.index(False) :]), "in again"
    distance = gaps(steps, obstacle)
    assert np.all(np.diff(distance[: escaping.index(False)]) > 0.0)
    assert distance[-1] > 3.0


def test_escaping_from_a_moving_obstacle() -> None:
    """It runs over the robot from behind: the way out takes its velocity into account."""
    bus = Obstacle(disc_or_ball(3.0, 2), ConstantVelocity((-2.0, 0.5), (1.0, 0.0)), "bus")
    steps = list(follow(navigator(2, limits=Limits(5.0, 3.0)), at(2, 1.0), [bus], goal(2, 60.0), 60))
    outcomes = [s.decision.outcome for s in steps]
    assert outcomes[0] is Outcome.ESCAPING
    assert outcomes[-1].safe


def test_two_overlaps_at_once() -> None:
    """Between two obstacles that both overlap the robot."""
    both = [rock(2, 2.0, 0.0, 1.0), rock(2, 2.0, 0.0, -1.0)]
    steps = list(follow(navigator(), at(2, 0.0), both, goal(2), 80))
    assert steps[0].decision.outcome is Outcome.ESCAPING
    assert steps[-1].decision.outcome.safe


@pytest.mark.parametrize("inside", [0.0, 0.03, 0.05 - 1e-7])
@pytest.mark.parametrize("d", PLANES)
def test_inside_the_margin_is_no_overlap(d: int, inside: float) -> None:
    """A robot nearer than the margin, even touching, may leave, and does not come nearer."""
    obstacle = rock(d, 2.0, 3.05 - inside)
    steps = list(follow(navigator(d), at(d, 0.0), [obstacle], goal(d, -20.0), 20))
    assert all(s.decision.outcome.safe for s in steps)
    assert np.all(np.diff(gaps(steps, obstacle)) > -1e-9)


def test_outcomes_are_ordered_and_explained() -> None:
    assert [o.safe for o in Outcome] == [True] * 7 + [False] * 8
    assert len({o.value for o in Outcome}) == len(Outcome) == 15
    assert all(o.value.endswith(".") for o in Outcome)


# Horizons.


def test_each_obstacle_counts_until_its_own_horizon() -> None:
    """A wall 30 m ahead blocks every way on for six seconds of foresight, but not for the time it takes to stop."""
    wall = Obstacle(Polyline([(30.0, -40.0), (30.0, 40.0)]), Stationary((0.0, 0.0)), "wall")
    rock = Obstacle(Disc(1.0), Stationary((9.0, 0.3)), "rock")
    robot = navigator(method="nlvo", limits=Limits(8.0, 4.0), horizon=6.0)
    state, far = at(2, 6.0), Goal(Stationary((80.0, 0.0)), 1.0)
    by_name = HorizonByName({"wall": 1.5}, 9.0)
    for rule, expected in ((None, [6.0, 6.0]), (SafeTime(0.5), [2.0, 2.0]), (by_name, [6.0, 1.5])):
        traffic = replace(robot, horizons=rule).predict([rock, wall], state, 0.0)
        ends = [traffic.bodies(robot.robot).pieces.times[k, 1] for k in (0, 1)]
        assert ends == pytest.approx(expected)
    assert robot.decide(state, [wall], far).outcome is not Outcome.CLEAR
    assert replace(robot, horizons=SafeTime(0.5)).decide(state, [wall], far).outcome is Outcome.CLEAR


@pytest.mark.parametrize("speed", draws([8.0, 2.0, 6.0]))
@pytest.mark.parametrize("max_acceleration", [1.0, 4.0])
def test_the_safe_time_is_long_enough_to_stop(speed: float, max_acceleration: float) -> None:
    """Towards a wall that is in the way of everything, seen only when it matters: the robot stops before it."""
    wall = Obstacle(Polyline([(60.0, -90.0), (60.0, 90.0)]), Stationary((0.0, 0.0)), "wall")
    robot = navigator(limits=Limits(8.0, max_acceleration), horizon=20.0, horizons=SafeTime(0.4), detours=())
    state, decision, outcomes = at(2, speed), None, set()
    for k in range(400):
        decision = robot.decide(state, [wall], Goal(Stationary((80.0, 0.0)), 1.0), now=0.1 * k, previous=decision)
        outcomes.add(decision.outcome)
        acceleration = decision.manoeuvre.mean_acceleration(0.1 * k, 0.1)
        state = advance(Acceleration(), state, acceleration, 0.1)
    assert all(outcome.safe for outcome in outcomes), outcomes
    assert state.position[0] < 59.0
    assert state.position[0] > 40.0


def test_out_of_a_wall_is_across_it() -> None:
    """Overlapping the middle of a long wall, the robot leaves by its side, not along it."""
    wall = Obstacle(Polyline([(-5.0, 0.0), (30.0, 0.0)], 0.2), Stationary((0.0, 0.0)), "wall")
    decision = navigator().decide(State((10.0, 0.4), (0.0, 0.0)), [wall], goal(2))
    assert decision.outcome is Outcome.ESCAPING
    x, y = decision.manoeuvre.control
    assert y > 0.0
    assert abs(x) < 1e-6


# Obstacles that appear.


@pytest.mark.parametrize(
    ("method", "sees"), [("vo", False), ("avo", False), ("ao", False), ("nlvo", True), ("nao", True)]
)
def test_foresight_of_an_obstacle_that_appears_later(method: str, sees: bool) -> None:
    """Only published trajectories say that something will be there."""
    speed, distance = (1.0, 11.0) if method in ("vo", "nlvo") else (4.0, 16.0)
    later = Obstacle(disc_or_ball(4.0, 2), Sampled([1.0, 20.0], [(distance, 0.5)] * 2), "later")
    robot = navigator(method=method)
    alone, among = (robot.decide(at(2, speed), others, goal(2)) for others in ([], [later]))
    assert len(robot.predict([later], at(2, speed), 0.0).obstacles) == sees
    assert len(robot.predict([later], at(2, speed), 1.0).obstacles) == 1
    assert np.array_equal(alone.manoeuvre.control, among.manoeuvre.control) != sees
    assert among.outcome.safe


@pytest.mark.parametrize("method", ["nlvo", "nao"])
def test_an_obstacle_that_appears_on_the_robot_at_once(method: str) -> None:
    """It will be there before the next decision: not safe, but a decision."""
    later = Obstacle(disc_or_ball(9.0, 2), Sampled([0.05, 20.0], [(1.0, 0.0), (1.0, 0.0)]), "later")
    decision = sound(navigator(method=method).decide(at(2, 4.0), [later], goal(2)), 2)
    assert not decision.outcome.safe


@pytest.mark.parametrize("method", ["nlvo", "nao"])
def test_an_obstacle_that_appears_everywhere_later(method: str) -> None:
    """Every control collides at the moment at which it appears, whatever rounding does to that moment."""
    for now in 0.1 * np.arange(1, 30):
        first = now + 0.7
        later = Obstacle(disc_or_ball(50.0, 2), Sampled([first, first + 20.0], [(0.0, 0.0)] * 2), "later")
        decision = sound(navigator(method=method).decide(at(2, 4.0), [later], goal(2), now=float(now)), 2)
        assert decision.outcome is Outcome.DELAYED


def test_an_obstacle_that_vanishes_in_time_is_no_obstacle() -> None:
    trajectory = Sampled([-1.0, 1.0], [(20.0, 0.0)] * 2)
    gone = Obstacle(disc_or_ball(2.0, 2), trajectory, "gone", after_end="leaves")
    robot = navigator(method="nlvo")
    alone, among = (robot.decide(at(2, 4.0), others, goal(2)) for others in ([], [gone]))
    assert np.array_equal(alone.manoeuvre.control, among.manoeuvre.control)


# Limits that contradict each other: not safe or refused, never a wrong number.


@pytest.mark.parametrize("obstacles", [[], [rock(2, 1.0, 30.0)]], ids=["alone", "among others"])
@pytest.mark.parametrize(
    "limits",
    [
        Limits(5, 1, acceleration_bounds=(HalfSpace((1, 0), -0.5), HalfSpace((-1, 0), -0.5))),
        Limits(5, 1, velocity_bounds=(HalfSpace((1, 0), -6.0),)),
    ],
    ids=["accelerations", "velocities"],
)
@pytest.mark.parametrize("method", METHODS)
def test_limits_that_cannot_be_obeyed(method: str, limits: Limits, obstacles: list[Obstacle]) -> None:
    try:
        decision = navigator(method=method, limits=limits).decide(at(2, 1.0), obstacles, goal(2))
    except SlalomError:
        return
    assert not sound(decision, 2).outcome.safe


# Random runs: the guarantee, and the limits.


def crowd(rng: np.random.Generator, d: int, count: int, *, still: bool = False) -> list[Obstacle]:
    """Obstacles of every kind between the start and the goal of `random_run`, none within 3 m of the start."""
    found: list[Obstacle] = []
    stamps = np.linspace(-1.0, 30.0, 40)
    while len(found) < count:
        position = vector(d, rng.uniform(2.0, 28.0), rng.uniform(-7.0, 7.0), rng.uniform(-3.0, 3.0))
        velocity, acceleration = (vector(d, *rng.uniform(-most, most, size=3)) for most in (1.5, 0.15))
        wander = position + np.cumsum(rng.normal(0.0, 0.5, size=(40, d)), axis=0)
        radius = float(rng.uniform(1.0, 5.0))
        kinds = (
            Stationary(position),
            ConstantVelocity(position, velocity),
            ConstantAcceleration(position, velocity, acceleration),
            Circular(position, radius, float(rng.choice([-1, 1]) * rng.uniform(0.5, 3.0)), rng.uniform(0, 6)),
            Sampled(stamps, wander, "linear"),
            Sampled(stamps, wander, "smooth"),
        )
        trajectory = kinds[0 if still else len(found) % len(kinds)]
        obstacle = Obstacle(disc_or_ball(float(rng.uniform(0.3, 1.2)), d), trajectory, f"{len(found)}")
        if np.linalg.norm(trajectory.position(0.0)) > 3.0 + obstacle.shape.radius:
            found.append(obstacle)
    return found


def random_run(
    seed: int,
    d: int,
    method: str,
    limits: Limits | None = None,
    speed: float = 1.0,
    still: bool = False,
    most: float = 9.0,
) -> Recording:
    """A run of at most `most` seconds through a crowd."""
    rng = np.random.default_rng([seed, d])
    robot = Robot(disc_or_ball(0.5, d), limits or Limits(4.0, 3.0), at(d, speed), goal(d, 30.0))
    others = tuple(crowd(rng, d, 12 if d == 2 else 18, still=still))
    return simulate(Scenario("random", (robot,), others, duration=most), METHODS[method], seed=seed)


def up_to_first_unsafe(recording: Recording) -> Recording:
    """The part of a run before the first decision that is not safe."""
    unsafe = [k for k, (name,) in enumerate(recording.outcomes) if not Outcome[name].safe]
    k = unsafe[0] if unsafe else len(recording.outcomes)
    return replace(
        recording,
        times=recording.times[: k + 1],
        positions=recording.positions[: k + 1],
        velocities=recording.velocities[: k + 1],
        accelerations=recording.accelerations[:k],
        outcomes=recording.outcomes[:k],
    )


@pytest.mark.parametrize("method", ["nlvo", "nao"])
@pytest.mark.parametrize("d", PLANES)
def test_nothing_is_hit_while_outcomes_are_safe(d: int, method: str) -> None:
    """With known trajectories, in continuous time, by code that does not decide."""
    wholly_safe, chosen = 0, 0
    for seed in range(3):
        recording = random_run(seed, d, method)
        part = up_to_first_unsafe(recording)
        wholly_safe += len(part.outcomes) == len(recording.outcomes)
        chosen += sum(name == "CONSTRAINED" for (name,) in part.outcomes)
        least = min(closest.clearance for closest in closest_approaches(part))
        assert least >= -COMMITTED_SLACK, f"seed {seed}"
    assert wholly_safe >= 2
    assert chosen >= 8


@pytest.mark.parametrize("d", PLANES)
def test_among_rocks_every_outcome_is_safe(d: int) -> None:
    """What stands still never surprises a robot that can stop within its horizon."""
    for seed in range(2):
        recording = random_run(seed, d, "nao", still=True)
        assert {name for (name,) in recording.outcomes} <= {o.name for o in Outcome if o.safe}, f"seed {seed}"
        assert min(closest.clearance for closest in closest_approaches(recording)) >= -COMMITTED_SLACK


BOUNDED = (HalfSpace((-1, 0), 0.2),), (HalfSpace((0, 1), 1.0),)


@pytest.mark.parametrize("method", draws_of({name: name for name in METHODS}, "nao", "nao_ahead", "vo"))
@pytest.mark.parametrize("d", PLANES)
def test_limits_are_obeyed_at_every_step(d: int, method: str) -> None:
    """Whatever the outcome."""
    recording = random_run(10, d, method, Limits(3.0, 2.0), most=5.0)
    assert np.linalg.norm(recording.accelerations, axis=-1).max() <= 2.0 * (1 + 1e-8)
    assert np.linalg.norm(recording.velocities, axis=-1).max() <= 3.0 * (1 + 1e-8)


@pytest.mark.parametrize("method", ["nlvo", "nao"])
def test_bounds_are_obeyed_at_every_step(method: str) -> None:
    """A robot that hardly drives backwards and turns left less sharply than right."""
    recording = random_run(12, 2, method, Limits(3.0, 2.0, *BOUNDED), most=6.0)
    assert recording.velocities[..., 0].min() >= -0.2 - 1e-8
    assert recording.accelerations[..., 1].max() <= 1.0 + 1e-8


@pytest.mark.parametrize("method", draws_of({name: name for name in METHODS}, "nao", "vo"))
@pytest.mark.parametrize("d", PLANES)
def test_a_robot_that_is_too_fast_brakes(d: int, method: str) -> None:
    """It never gets faster, and after some seconds it obeys; full braking would take one."""
    recording = random_run(13, d, method, Limits(2.0, 2.0), speed=4.0, most=7.0)
    speeds = np.linalg.norm(recording.velocities[:, 0], axis=-1)
    assert np.linalg.norm(recording.accelerations, axis=-1).max() <= 2.0 * (1 + 1e-8)
    assert speeds.max() <= 4.0 + 1e-9
    obeys = int(np.argmax(speeds <= 2.0 * (1 + 1e-8)))
    assert 0 < obeys <= 60
    assert speeds[obeys:].max() <= 2.0 * (1 + 1e-8)


@pytest.mark.parametrize("method", ALONE)
@pytest.mark.parametrize(
    "trajectory",
    [
        ConstantVelocity((10.0, 5.0), (1.0, 0.5)),
        Circular((10.0, 0.0), 5.0, 1.5),
        ConstantAcceleration((10.0, 0.0), (0.0, 1.0), (0.1, 0.0)),
        ConstantVelocity((10.0, 5.0, 1.0), (1.0, 0.5, 0.2)),
    ],
    ids=["line", "circle", "parabola", "in space"],
)
@pytest.mark.parametrize("stop", [False, True], ids=["pass", "stop"])
def test_a_moving_goal_is_reached(stop: bool, trajectory, method: str) -> None:
    """With `stop` the robot ends slow relative to the goal, not to the ground."""
    d, tolerance = trajectory.dimension, 0.5
    robot = Robot(disc_or_ball(0.5, d), Limits(4.0, 2.0), at(d, 0.0), Goal(trajectory, tolerance, stop))
    recording = simulate(Scenario("chase", (robot,), duration=40.0), METHODS[method])
    end = recording.times[-1]
    assert recording.arrived[0] == end
    assert np.linalg.norm(trajectory.position(end) - recording.positions[-1, 0]) <= tolerance
    if stop:
        assert np.linalg.norm(trajectory.velocity(end) - recording.velocities[-1, 0]) <= tolerance


@pytest.mark.parametrize("method", ALONE)
@pytest.mark.parametrize("stop", [False, True], ids=["pass", "stop"])
def test_a_goal_that_exists_for_a_while_is_reached_in_time(stop: bool, method: str) -> None:
    """Sampled for ten seconds: no look beyond its end, although a straight chase would take longer."""
    trajectory = Sampled([0.0, 10.0], [(5.0, 0.0), (12.0, 0.0)], "linear")
    robot = Robot(disc_or_ball(0.5, 2), Limits(2.0, 1.0), at(2, 0.0), Goal(trajectory, 0.5, stop))
    recording = simulate(Scenario("brief", (robot,), duration=9.9), METHODS[method])
    assert recording.arrived[0] < 10.0


@pytest.mark.parametrize("method", ALONE)
@pytest.mark.parametrize("d", PLANES)
def test_a_goal_to_stop_at(d: int, method: str) -> None:
    """Within thrice the time that full acceleration would take."""
    robot = Robot(disc_or_ball(0.5, d), Limits(2.0, 1.0), at(d, 0.0), goal(d, 12.0, tolerance=0.2, stop=True))
    recording = simulate(Scenario("stop", (robot,), duration=40.0), METHODS[method])
    assert np.isfinite(recording.arrived[0])
    assert np.linalg.norm(recording.velocities[-1, 0]) <= 0.2
    assert recording.times[-1] <= 3.0 * (12.0 / 2.0 + 2.0)


def test_a_goal_that_is_passed_is_passed_fast() -> None:
    robot = Robot(disc_or_ball(0.5, 2), Limits(2.0, 1.0), at(2, 0.0), goal(2, 20.0))
    recording = simulate(Scenario("pass", (robot,), duration=40.0), METHODS["nao"])
    fastest = 2.0 + (20.0 - 0.5 - 2.0) / 2.0
    assert fastest - 1e-9 <= recording.times[-1] <= 1.05 * fastest
    assert np.linalg.norm(recording.velocities[-1, 0]) == pytest.approx(2.0, abs=0.05)


def test_a_goal_beside_the_way_is_not_orbited() -> None:
    """Two metres abeam at full speed: turning at once would circle it for ever."""
    for method in ALONE:
        robot = Robot(disc_or_ball(0.5, 2), Limits(4.0, 1.0), at(2, 4.0), Goal(Stationary((0.0, 2.0)), 0.5))
        recording = simulate(Scenario("abeam", (robot,), duration=40.0), METHODS[method])
        assert np.isfinite(recording.arrived[0]), method


# Wishes.


def adjustments(steps: Sequence[Step]) -> int:
    """Steps at which the acceleration changes."""
    accelerations = np.array([step.acceleration for step in steps])
    return int((np.linalg.norm(np.diff(accelerations, axis=0), axis=1) > ADJUSTMENT).sum())


@pytest.mark.parametrize("method", METHODS)
def test_keeping_the_acceleration_makes_fewer_adjustments(method: str) -> None:
    """Than arriving, on a straight way with a car that crosses."""
    car = Obstacle(disc_or_ball(1.0, 2), ConstantVelocity((14.0, -8.0), (0.0, 2.2)), "car")
    count = {}
    for objective in (Arrive(), KeepAcceleration()):
        robot = navigator(method=method, objective=objective, limits=Limits(4.0, 2.0), patience=0.0)
        steps = list(follow(robot, at(2, 3.0), [car], goal(2, 30.0), 60))
        assert all(step.decision.outcome.safe for step in steps)
        count[type(objective)] = adjustments(steps)
    assert count[KeepAcceleration] < count[Arrive]


@pytest.mark.parametrize("d", PLANES)
def test_most_clearance_keeps_farther_away(d: int) -> None:
    """At least three times as far as arriving does, when up to a metre is preferred."""
    obstacle, least = rock(d, 1.5, 12.0, 0.3), {}
    for objective in (Arrive(), MostClearance(1.0, Arrive())):
        steps = list(
            follow(navigator(d, objective=objective, limits=Limits(3.0, 2.0)), at(d, 2.0), [obstacle], goal(d), 70)
        )
        least[type(objective)] = gaps(steps, obstacle).min() - 2.5
    assert 0.0 < least[Arrive] < 0.3
    assert least[MostClearance] > 3.0 * least[Arrive]


@pytest.mark.parametrize("objective", [Arrive, KeepAcceleration, lambda enough=0.0: FollowVelocity((2.0, 0.8), enough)])
def test_enough_clearance_is_that_of_most_clearance(objective: Callable[..., Objective]) -> None:
    """Every objective counts its clearance beyond the margin, also those of the compiled policy."""
    obstacle = rock(2, 1.5, 6.0, 2.7)

    def chosen(wish: Objective) -> str:
        robot = navigator(objective=wish, limits=Limits(3.0, 2.0))
        manoeuvre = robot.decide(at(2, 2.0), [obstacle], goal(2, 20.0)).manoeuvre
        return repr((manoeuvre.response, manoeuvre.control))

    assert chosen(objective(1.0)) == chosen(MostClearance(1.0, objective())) != chosen(objective())


@pytest.mark.parametrize("method", ALONE)
@pytest.mark.parametrize("d", PLANES)
def test_follow_velocity(d: int, method: str) -> None:
    """The velocity is reached and kept, whatever response the method has."""
    wanted = vector(d, 1.5, -0.8, 0.4)
    robot = navigator(d, method, objective=FollowVelocity(wanted), limits=Limits(3.0, 2.0), patience=0.0)
    last = list(follow(robot, at(d, 0.0), [], goal(d), 60))[-1]
    np.testing.assert_allclose(last.state.velocity, wanted, atol=0.05)


@pytest.mark.parametrize("weights", [(1.0, 1.0), (3.0, 1.0), (1.0, 0.0)])
@pytest.mark.parametrize("method", ["vo", "avo"])
def test_mix_is_the_weighted_mean(method: str, weights: tuple[float, float]) -> None:
    """Of the preferred controls, whatever the curvatures of the parts; the larger preferred clearance counts."""
    parts = FollowVelocity((2.0, 0.0)), Arrive()
    alone = [navigator(method=method, objective=part).decide(at(2, 1.0), [], goal(2, 5.0)).preferred for part in parts]
    mixed = Mix(tuple(zip(weights, parts)))
    both = navigator(method=method, objective=mixed).decide(at(2, 1.0), [], goal(2, 5.0)).preferred
    np.testing.assert_allclose(both, np.average(alone, axis=0, weights=weights), atol=1e-12)
    assert mixed.enough_clearance == 0.0
    assert Mix(((1.0, MostClearance(0.4, Arrive())), (1.0, Arrive()))).enough_clearance == 0.4


@cache
def judged(patience: float) -> tuple[Navigator, list[Step], list[Obstacle]]:
    """A run whose manoeuvres are changed more often the less patience there is."""
    rng = np.random.default_rng(15)
    robot, others = navigator(patience=patience, limits=Limits(4.0, 3.0), detours=()), crowd(rng, 2, 10)
    return robot, list(follow(robot, at(2, 1.0), others, goal(2, 30.0), 50)), others


def cost_of(robot: Navigator, step: Step, manoeuvre: Manoeuvre, until: float) -> float:
    """What the objective says of a manoeuvre at a step of `judged`."""
    response, aim = manoeuvre.response, goal(2, 30.0)
    return robot.objective.cost(manoeuvre, robot.situation(response, step.state, aim, step.now), until)


def free_again(robot: Navigator, manoeuvre: Manoeuvre) -> float:
    """When a robot has carried out a manoeuvre's control."""
    return manoeuvre.settled_time(robot.period, robot.horizon)


@pytest.mark.parametrize("patience", [0.0, 0.01, 0.1])
def test_a_manoeuvre_is_kept_or_the_new_choice(patience: float) -> None:
    """A decision keeps the manoeuvre before, or is that of a robot without one. How much a robot loses by keeping its
    manoeuvres over a whole drive is in test_easy_worlds.py."""
    robot, steps, others = judged(patience)
    kept = 0
    for before, step in itertools.pairwise(steps):
        fresh = robot.decide(step.state, others, goal(2, 30.0), now=step.now)
        if step.decision.outcome is Outcome.KEPT:
            kept += 1
            assert step.decision.manoeuvre is before.decision.manoeuvre
        elif step.decision.outcome in (Outcome.CLEAR, Outcome.CONSTRAINED):
            assert np.array_equal(step.decision.manoeuvre.control, fresh.manoeuvre.control)
    assert kept > 3


def test_no_response_that_is_left_out_is_better_by_much() -> None:
    """Compared with trying all responses, the choice costs more by at most MIN_IMPROVEMENT of the shortest one."""
    robot, steps, others = judged(0.01)
    for step in steps:
        fresh = robot.decide(step.state, others, goal(2, 30.0), now=step.now)
        costs = []
        for hold in robot.holds:
            alone = replace(robot, holds=(hold,)).decide(step.state, others, goal(2, 30.0), now=step.now)
            if alone.outcome in (Outcome.CLEAR, Outcome.CONSTRAINED):
                costs.append(
                    cost_of(robot, step, alone.manoeuvre, alone.manoeuvre.settled_time(robot.period, robot.horizon))
                )
        chosen = cost_of(robot, step, fresh.manoeuvre, free_again(robot, fresh.manoeuvre))
        assert chosen <= min(costs) + MIN_IMPROVEMENT * min(robot.holds) + COST_TIE


def contents(decision: Decision) -> list[object]:
    """All that a decision holds that the next one could overwrite."""
    path = decision.path
    assert path is not None
    return [decision.outcome, *(a.tolist() for a in (decision.manoeuvre.control, decision.preferred, *path))]


def test_a_decision_stays_as_it_is_when_the_robot_decides_again():
    robot, goal = Navigator(METHODS["nao"], Disc(0.3), Limits(1.5, 2.0)), Goal(Stationary((9.0, 0.0)), 0.3)
    first = robot.decide(State((0.0, 0.0), (1.0, 0.0)), [], goal)
    before = contents(first)
    robot.decide(State((0.0, 3.0), (0.0, -1.0)), [], goal, now=0.1, previous=first)
    robot.decide(State((5.0, 5.0), (0.0, 0.0)), [], goal)
    assert contents(first) == before


def test_decisions_in_threads_are_those_one_after_the_other():
    """One navigator decides for many robots, alone and among others, at the same time."""
    robot, rng = Navigator(METHODS["nao"], Disc(0.3), Limits(1.5, 2.0)), np.random.default_rng(5)
    goals = [Goal(Stationary(place), 0.3, stop=bool(k % 2)) for k, place in enumerate(rng.uniform(-9.0, 9.0, (60, 2)))]
    others = [None, *(Tracks(rng.uniform(2.0, 6.0, (n, 2)), rng.uniform(-1.0, 1.0, (n, 2)), 0.3) for n in (2, 3))]

    def decided(k: int) -> list[object]:
        state = State((0.0, 0.0), (0.5, 0.01 * k))
        first = robot.decide(state, [], goals[k], robots=others[k % 3])
        return contents(robot.decide(state, [], goals[k], robots=others[k % 3], now=0.1, previous=first))

    expected = [decided(k) for k in range(60)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(decided, range(60))) == expected


@pytest.mark.parametrize(
    ("speed", "acceleration", "period", "tolerance"),
    [(0.938, 3.489, 0.2, 0.0012), (17.273, 68.666, 0.2, 0.0121), (24.886, 95.013, 0.05, 0.0019)],
)
@pytest.mark.parametrize("begin", [0.0, 0.5, 1.0])
def test_a_robot_with_a_lag_does_not_pass_a_goal_to_stop_at(
    speed: float, acceleration: float, period: float, tolerance: float, begin: float
) -> None:
    length = 10.0 * speed
    robot = Navigator(METHODS["avo"], Disc(0.3), Limits(speed, acceleration), period=period)
    goal = Goal(Stationary((length, 0.0)), tolerance, stop=True)
    state, previous = State((0.0, 0.0), (begin * speed, 0.0)), None
    for k in range(round(16.0 / period)):
        previous = robot.decide(state, [], goal, now=k * period, previous=previous)
        push = previous.manoeuvre.mean_acceleration(k * period, period)
        place = state.position + period * state.velocity + 0.5 * period**2 * push
        state = State(place, state.velocity + period * push)
        assert state.position[0] <= length + tolerance
    assert goal.reached(state.position, state.velocity, 16.0)
