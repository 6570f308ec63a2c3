"""Robots that look ahead with bounds: what they do, against the definitions of the bounds; and where they arrive."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
from definitions import out_of_bound
from draws import draws
from hypothesis import given, strategies as st
from journeys import Journey, journey, least_gap, motion_of, steps_of
from motion import drive
from scenes import BOUNDS
from strategies import dimensions, numbers

from slalom import (
    AccelerateThenTurn,
    BoundedError,
    Box,
    ConstantVelocity,
    Decision,
    Disc,
    ExpectedLoss,
    Friction,
    Goal,
    HalfSpace,
    HeadingCone,
    LeastSpeed,
    Limits,
    LookAhead,
    Navigator,
    Obstacle,
    Outcome,
    Polyline,
    Rectangle,
    SequenceDecision,
    State,
    Stationary,
    TurningRadius,
    kernels,
    method,
)
from slalom.base.tolerances import COMMITTED_SLACK
from slalom.lookahead.search import bound_table, padded

COMPROMISES = (Outcome.IMPACT, Outcome.INADMISSIBLE, Outcome.ESCAPING)
"""Outcomes of decisions that may break a bound."""
SHARES = np.linspace(0.0, 1.0, 6)[1:]
"""[1] Of a period, at which velocities are compared with the set at its start."""

TOGETHER = {
    "bicycle": (TurningRadius(1.0), HeadingCone(1.0)),
    "car": (TurningRadius(1.5), Friction(1.0, 2.0, 1.5)),
    "aircraft": (LeastSpeed(0.8), TurningRadius(2.0)),
    "ship": (LeastSpeed(0.5), Friction(0.4, 0.4, 0.8)),
}
"""Bounds that vehicles have together."""
ALONE = [(kind, d) for kind in BOUNDS for d in (2, 3) if (kind, d) != ("convex_polygon", 3)]
EVERY = [*ALONE, *((kind, d) for kind in TOGETHER for d in (2, 3)), ("half_spaces", 2), ("half_spaces", 3)]
each_kind = pytest.mark.parametrize(("kind", "d"), EVERY)


def half_spaces(rng: np.random.Generator, d: int, most: float) -> tuple[HalfSpace, ...]:
    """Two in random directions, each with 0 in it."""
    return tuple(HalfSpace(rng.normal(size=d), most * rng.uniform(0.3, 1.0)) for _ in range(2))


def bounded(seed: int, kind: str, d: int) -> Journey:
    """A random journey of a robot with such bounds."""
    j, rng = journey(seed, d), np.random.default_rng([seed, d, 5])
    v, a = j.limits.max_speed, j.limits.max_acceleration
    if kind == "half_spaces":
        limits = Limits(v, a, half_spaces(rng, d, 1.5 * v), half_spaces(rng, d, a))
    else:
        limits = Limits(v, a, bounds=TOGETHER[kind] if kind in TOGETHER else (BOUNDS[kind](rng, d, a),))
    goal = replace(j.goal, stop=False) if any(isinstance(b, LeastSpeed) for b in limits.bounds) else j.goal
    return replace(j, limits=limits, goal=goal)


def broken(limits: Limits, state: State, acceleration: np.ndarray, period: float) -> Iterator[str]:
    """What a robot breaks that holds an acceleration over a period, by the definitions of its bounds."""
    velocities = state.velocity + period * SHARES[:, None] * acceleration
    if np.linalg.norm(acceleration) > limits.max_acceleration * (1.0 + 1e-6):
        yield "the largest acceleration"
    if np.linalg.norm(velocities, axis=1).max() > max(limits.max_speed, np.linalg.norm(state.velocity)) + 1e-6:
        yield "the maximum speed"
    for flats, x in ((limits.velocity_bounds, velocities[-1]), (limits.acceleration_bounds, acceleration)):
        before = state.velocity if flats is limits.velocity_bounds else 0.0 * x
        for flat in flats:
            if flat.normal @ x > max(flat.offset, flat.normal @ before) + 1e-6:
                yield f"{flat}"
    for bound in limits.bounds:
        x = acceleration[None] if bound.of == "acceleration" else velocities
        if out_of_bound(bound, state.velocity, x).max() > 1e-6:
            yield f"{bound}"


def planned(j: Journey, decision: SequenceDecision, state: State, now: float) -> Iterator[tuple[State, np.ndarray]]:
    """The states at the starts of the periods of a sequence, each with its mean acceleration over the period."""
    plan = decision.manoeuvre
    for k in range(int(np.ceil((plan.response.ends[-1] + plan.start - now) / j.period - 1e-6))):
        t = now + k * j.period
        yield State(plan.position(t), plan.velocity(t)), plan.mean_acceleration(t, j.period)


@pytest.mark.parametrize("first", draws([0, 3, 6, 9], 1))
@each_kind
def test_bounds_are_obeyed_in_every_period(kind: str, d: int, first: int) -> None:
    """By what is done, and by what is planned; and the plan keeps its margin."""
    sequences = 0
    for seed in range(first, first + 3):
        j = bounded(seed, kind, d)
        seen = None
        for now, state, decision in steps_of(j, 15, j.decider()):
            if decision.outcome not in COMPROMISES:
                acceleration = decision.manoeuvre.mean_acceleration(now, j.period)
                assert [*broken(j.limits, state, acceleration, j.period)] == [], (str(j), now)
            if not isinstance(decision, SequenceDecision) or decision.manoeuvre is seen:
                continue
            seen = decision.manoeuvre
            sequences += 1
            for then, acceleration in planned(j, decision, state, now):
                assert [*broken(j.limits, then, acceleration, j.period)] == [], (str(j), now)
            plan = motion_of(seen)
            end = float(plan.ends[-1])
            until = max(end, now + 6.0) if decision.outcome is Outcome.BEGUN else end
            assert least_gap(j, plan, now, until, now) >= decision.search.problem.margin - COMMITTED_SLACK, str(j)
    assert sequences > 0


@pytest.mark.parametrize("seeds", draws([(312, 100, 101), *(range(k, k + 6) for k in range(102, 160, 6))]))
def test_a_robot_that_must_not_stop_relies_on_motion_that_goes_on(seeds: Sequence[int]) -> None:
    """No sequence becomes slower than the least speed; without an arrival its last velocity is free to the horizon."""
    begun = 0
    for seed in seeds:
        j = bounded(seed, ("aircraft", "ship", "least_speed")[seed % 3], 2)
        (least,) = (bound for bound in j.limits.bounds if isinstance(bound, LeastSpeed))
        slowest = min(least.least, float(np.linalg.norm(j.state.velocity)))
        for now, state, decision in steps_of(j, 12, j.decider()):
            if decision.outcome in COMPROMISES:
                break
            assert np.linalg.norm(state.velocity) >= slowest - 1e-6
            if isinstance(decision, SequenceDecision):
                speeds = np.linalg.norm(decision.manoeuvre.velocity(now + np.linspace(0.0, 6.0, 301)), axis=1)
                assert speeds.min() >= slowest - 1e-6
            if decision.outcome is Outcome.BEGUN:
                begun += 1
                gap = least_gap(j, motion_of(decision.manoeuvre), now, now + 6.0, now)
                assert gap >= decision.search.problem.margin - COMMITTED_SLACK
    assert begun > 0 or 312 not in seeds


@pytest.mark.parametrize("d", [2, 3])
def test_bounds_that_exclude_nothing_change_nothing(d: int) -> None:
    """To the bit, over whole journeys."""
    wide = (Friction(50.0, 50.0, 50.0), Box(np.full(d, 50.0)), HeadingCone(0.5 * np.pi), TurningRadius(1e-9))
    far = (HalfSpace(np.ones(d), 1e3),)
    for seed in range(6):
        j = journey(seed, d)
        j = replace(j, state=replace(j.state, velocity=0.0 * j.state.velocity), bodies=j.bodies[:4])
        v, a = j.limits.max_speed, j.limits.max_acceleration
        for limits in (Limits(v, a, far, far, bounds=wide[:2]), Limits(v, a, bounds=wide[1:2])):
            for one, other in zip(
                steps_of(j, 12, j.decider()), steps_of(replace(j, limits=limits), 12, j.decider()), strict=True
            ):
                assert one[2].outcome is other[2].outcome
                times = one[0] + np.linspace(0.0, 9.0, 31)
                np.testing.assert_array_equal(one[2].manoeuvre.position(times), other[2].manoeuvre.position(times))


@given(data=st.data(), d=dimensions)
def test_breaches_are_those_of_the_rule_of_limits(data: st.DataObject, d: int) -> None:
    """Of any acceleration from any velocity, over some periods; the half-space that is returned excludes it."""
    rng = np.random.default_rng(data.draw(st.integers(0, 10**6)))
    kinds = [kind for kind, dimension in ALONE if dimension == d]
    bounds = tuple(BOUNDS[kind](rng, d, 2.0) for kind in rng.choice(kinds, 2, replace=False))
    limits = Limits(5.0, 3.0, bounds=bounds)
    velocity = rng.normal(size=d) * data.draw(st.sampled_from([0.0, 1.0, 2.0]))
    acceleration = rng.normal(size=d) * data.draw(numbers(0.0, 1.0))
    heading = rng.uniform(0.0, 6.0) if d == 2 and rng.random() < 0.3 else None
    period, count = 0.2, int(rng.integers(1, 8))
    begin, cut = State(np.zeros(d), velocity, heading=heading), np.empty(5)
    states = [begin, *(State(np.zeros(d), velocity + k * period * acceleration) for k in range(1, count))]
    expected = [limits.allows(state, acceleration, period) for state in states]
    table = bound_table(limits, begin, period)
    found = kernels.breach(table, padded(velocity), padded(acceleration), count * period, True, cut, np.zeros(1))
    assert found is not all(expected)
    if found:
        assert cut[1 : 1 + d] @ acceleration > cut[4]


# Whole journeys.


def arrival(robot: LookAhead | Navigator, state: State, obstacles: Sequence[Obstacle], goal: Goal) -> float:
    """[s] at which a robot that decides 600 times arrives; inf if not. Every decision must be safe and allowed."""
    navigator = robot.navigator if isinstance(robot, LookAhead) else robot
    period, decision = navigator.period, None
    for k in range(600):
        if goal.reached(state.position, state.velocity, k * period):
            return k * period
        decision = robot.decide(state, obstacles, goal, now=k * period, previous=decision)
        assert decision.safe
        acceleration = decision.manoeuvre.mean_acceleration(k * period, period)
        assert [*broken(navigator.limits, state, acceleration, period)] == []
        state = drive(state, acceleration, period)
    return np.inf


def both(limits: Limits, **settings: object) -> tuple[Navigator, LookAhead]:
    """The same robot without and with looking ahead."""
    robot = {"robot": Disc(0.5), "limits": limits, **settings}
    return Navigator(method("nao"), **robot), LookAhead(Navigator(method("nao_ahead"), **robot))


PLANE = Limits(25.0, 6.0, bounds=(LeastSpeed(18.0), TurningRadius(60.0)))
POCKET = Obstacle(Polyline([(-2.0, 3.0), (6.0, 3.0), (6.0, -3.0), (-2.0, -3.0)], 0.1), Stationary((0.0, 0.0)))


@pytest.mark.parametrize("place", [(120.0, 0.0, 0.0), (250.0, 5.0, -0.25)])
def test_an_aircraft_passes_a_slower_one_as_without_looking_ahead(place: tuple[float, ...]) -> None:
    x, y, sideways = place
    slower = Obstacle(Disc(5.0), ConstantVelocity((x, y), (15.0, sideways)))
    robots = both(PLANE, robot=Disc(2.0), horizon=15.0, margin=20.0, period=0.2)
    goal = Goal(Stationary((1500.0, 0.0)), 20.0)
    plain, ahead = (arrival(robot, State((0.0, 0.0), (22.0, 0.0)), [slower], goal) for robot in robots)
    assert ahead <= plain + 1.0 < np.inf


def test_an_aircraft_in_a_closed_hall_begins_to_turn() -> None:
    """It has no sequence, and no velocity that is free up to the horizon."""
    limits = Limits(10.0, 4.0, bounds=(LeastSpeed(8.0),))
    walls = [Rectangle(142.0, 1.0), Rectangle(1.0, 142.0)]
    hall = [Obstacle(walls[k], Stationary(side * 70.0 * np.eye(2)[1 - k])) for k in range(2) for side in (-1.0, 1.0)]
    _, robot = both(limits, period=0.5, horizon=20.0, holds=(0.5, 1.0, 2.0))
    decision, state, kinds = None, State((-40.0, 0.0), (9.0, 0.0)), set()
    for k in range(40):
        decision = robot.decide(state, hall, Goal(Stationary((500.0, 0.0))), now=0.5 * k, previous=decision)
        assert decision.safe
        kinds.add(type(decision.manoeuvre.response))
        state = drive(state, decision.manoeuvre.mean_acceleration(0.5 * k, 0.5), 0.5)
    assert AccelerateThenTurn in kinds


def test_a_parked_car_leaves_along_its_heading() -> None:
    """By the heading of its state, and by that of its bounds if the state has none."""
    ahead = np.array([np.cos(2.0), np.sin(2.0)])
    goal = Goal(Stationary((8.0, 3.0)), 0.5)
    for heading, faced in ((2.0, None), (None, ahead)):
        limits = Limits(3.0, 1.0, bounds=(TurningRadius(1.0, faced), HeadingCone(1.0, faced)))
        decision = both(limits)[1].decide(State((0.0, 0.0), (0.0, 0.0), heading=heading), [], goal)
        assert isinstance(decision, SequenceDecision)
        first = decision.manoeuvre.mean_acceleration(0.0, 0.1)
        np.testing.assert_allclose(first / np.linalg.norm(first), ahead, atol=1e-6)


def loss_of(limits: Limits) -> ExpectedLoss:
    robot = Navigator(method("nao_ahead"), Disc(0.3), limits, period=0.25, horizon=1.5, margin=0.1)
    return ExpectedLoss(LookAhead(robot), spread=BoundedError(0.05, 0.0, 0.1))


@pytest.mark.parametrize("kind", ["bicycle", "car", "ship"])
def test_deviations_obey_all_bounds(kind: str) -> None:
    """Of robots that weigh time against closeness, which also make some."""
    limits, deviating = Limits(1.5, 2.0, bounds=TOGETHER[kind]), 0
    for seed in range(3):
        rng = np.random.default_rng(seed)
        places, velocities = rng.uniform((1.0, -3.0), (7.0, 3.0), (8, 2)), rng.normal(scale=0.5, size=(8, 2))
        crowd = [Obstacle(Disc(0.3), ConstantVelocity(p, v)) for p, v in zip(places, velocities, strict=True)]
        state, decision, robot = State((0.0, 0.0), (1.0, 0.0)), None, loss_of(limits)
        for k in range(10):
            now = 0.25 * k
            decision = robot.decide(state, crowd, Goal(Stationary((9.0, 0.0)), 0.3), now=now, previous=decision)
            deviating += decision.outcome is Outcome.DEVIATING
            acceleration = decision.manoeuvre.mean_acceleration(now, 0.25)
            if decision.outcome not in COMPROMISES:
                assert [*broken(limits, state, acceleration, 0.25)] == [], (seed, k)
            state = drive(state, acceleration, 0.25)
    assert deviating > 0 or kind != "bicycle"


def told(decision: Decision) -> tuple[object, ...]:
    """What a decision says."""
    return decision.outcome, decision.manoeuvre.control.tobytes(), decision.manoeuvre.response


def test_work_with_bounds_is_counted() -> None:
    """The same search twice: the same bits; and a small budget cuts it."""
    limits = Limits(3.0, 1.0, bounds=(TurningRadius(1.0), Friction(0.5, 1.0, 0.7)))
    begin, goal = State((0.0, 0.0), (0.5, 0.0)), Goal(Stationary((14.0, 0.0)), 0.5)
    one, other = (both(limits)[1].decide(begin, [POCKET], goal) for _ in range(2))
    assert told(one) == told(other)
    assert replace(both(limits)[1], budget=30.0).decide(begin, [POCKET], goal).search.cut
