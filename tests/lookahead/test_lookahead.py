"""One robot that looks ahead: what it plans, measured by `journeys.py`, and how it goes on with it."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from draws import draws
from galleries import FLEETS, WITH_PYRVO, gallery_run
from hypothesis import given, strategies as st
from journeys import Decided, Journey, driven, journey, least_gap, motion_of
from motion import drive
from parts import disc_or_ball
from strategies import dimensions, numbers, states, vectors

from slalom import (
    FORESIGHTS,
    METHODS,
    AccelerateThenCoast,
    AccelerationSequence,
    ConstantVelocity,
    Decision,
    Disc,
    Goal,
    InvalidInput,
    Limits,
    LookAhead,
    Manoeuvre,
    Navigator,
    Obstacle,
    Outcome,
    Polyline,
    Sampled,
    SequenceDecision,
    State,
    Stationary,
    method,
)
from slalom.base.tolerances import CERTIFIED, COMMITTED_SLACK, CONTACT, CONTACT_SLACK
from slalom.lookahead.navigator import FORESEEN, MARGIN_SHARES, motions_of
from slalom.lookahead.search import PredictedObstacles
from slalom.obstacle.pieces import UNCERTAINTY_PIECES
from slalom.sim import Recording, simulate
from slalom.sim.gallery import GALLERY, build
from slalom.sim.measure.closest_approach import METRIC, closest_approaches

ROUNDING = 1e-9
PERIOD = 0.1
each_dimension = pytest.mark.parametrize("d", [2, 3])


# A plan as one response.


@st.composite
def plans(draw: st.DrawFn, d: int) -> Manoeuvre:
    """Up to five accelerations, one after the other."""
    later = tuple((draw(numbers(0.1, 2.0)), tuple(draw(vectors(d, 2.0)))) for _ in range(draw(st.integers(0, 4))))
    response = AccelerationSequence(draw(numbers(0.1, 2.0)), later)
    return Manoeuvre(response, draw(states(d)), draw(vectors(d, 2.0)), 0.0)


def moments(plan: Manoeuvre, end: float) -> np.ndarray:
    """Times from 0 to `end`, with all those at which an acceleration ends."""
    return np.unique(np.append(np.linspace(0.0, end, 401), np.clip(plan.response.ends, 0.0, end)))


@given(data=st.data(), d=dimensions)
def test_a_plan_is_its_accelerations_one_after_the_other(data: st.DataObject, d: int) -> None:
    """The motion is that of a body with these accelerations, one after the other, which then goes straight on."""
    plan = data.draw(plans(d))
    times = moments(plan, 1.5 * float(plan.response.ends[-1]))
    position, velocity, acceleration = motion_of(plan).at(times)
    np.testing.assert_allclose(plan.position(times), position, atol=ROUNDING)
    np.testing.assert_allclose(plan.velocity(times), velocity, atol=ROUNDING)
    between = 0.5 * (times[1:] + times[:-1])
    np.testing.assert_allclose(plan.acceleration(between), motion_of(plan).at(between)[2], atol=ROUNDING)
    np.testing.assert_allclose(plan.acceleration(times)[[0, -1]], acceleration[[0, -1]], atol=ROUNDING)


@given(data=st.data(), d=dimensions)
def test_the_velocity_of_a_plan_is_the_derivative_of_its_position(data: st.DataObject, d: int) -> None:
    """And its acceleration that of the velocity. Both integrals are exact, by trapezia and by rectangles."""
    plan = data.draw(plans(d))
    times = moments(plan, 1.5 * float(plan.response.ends[-1]))
    h, speeds = np.diff(times)[:, None], plan.velocity(times)
    np.testing.assert_allclose(np.diff(plan.position(times), axis=0), 0.5 * h * (speeds[1:] + speeds[:-1]), atol=1e-12)
    middle = plan.acceleration(0.5 * (times[1:] + times[:-1]))
    np.testing.assert_allclose(np.diff(speeds, axis=0), h * middle, atol=1e-12)


@given(data=st.data(), d=dimensions)
def test_only_the_first_acceleration_of_a_plan_is_a_control(data: st.DataObject, d: int) -> None:
    """Its gain is that of accelerating and coasting, to the bit; without more, so is everything else."""
    plan, horizon = data.draw(plans(d)), data.draw(numbers(0.1, 9.0))
    times, plain = moments(plan, 9.0), AccelerateThenCoast(plan.response.hold)
    for what in ("position", "velocity", "acceleration"):
        ours, theirs = (getattr(response, what)(plan.state, times) for response in (plan.response, plain))
        np.testing.assert_array_equal(ours.gain, theirs.gain)
        alone = getattr(AccelerationSequence(plan.response.hold), what)(plan.state, times)
        np.testing.assert_array_equal(alone.gain, theirs.gain)
        np.testing.assert_array_equal(alone.drift, theirs.drift)
    alone = AccelerationSequence(plan.response.hold)
    np.testing.assert_array_equal(alone.knots(horizon, 9.0), plain.knots(horizon, 9.0))
    assert alone.settled(horizon) == plain.settled(horizon)
    for what in ("speed_peaks", "acceleration_peaks"):
        for ours, theirs in zip(getattr(alone, what)(plan.state, horizon), getattr(plain, what)(plan.state, horizon)):
            np.testing.assert_array_equal(ours.drift, theirs.drift)
            np.testing.assert_array_equal(ours.gain, theirs.gain)


@given(data=st.data(), d=dimensions)
def test_knots_of_a_plan_are_where_its_acceleration_changes(data: st.DataObject, d: int) -> None:
    plan, horizon = data.draw(plans(d)), data.draw(numbers(0.05, 12.0))
    for at in (horizon, *plan.response.ends):
        knots = plan.response.knots(float(at), 9.0)
        assert (knots[0], knots[-1]) == (0.0, at)
        assert np.all(np.diff(knots) > 0.0)
        assert np.setdiff1d(plan.response.ends[plan.response.ends < at], knots).size == 0
        assert len(knots) == 2 + np.count_nonzero(plan.response.ends < at)


@given(data=st.data(), d=dimensions)
def test_peaks_of_a_plan_bound_what_it_does(data: st.DataObject, d: int) -> None:
    """The largest speed is that of now or of a peak, the largest acceleration that of a peak: also after a horizon."""
    plan, horizon = data.draw(plans(d)), data.draw(numbers(0.05, 12.0))
    response, u = plan.response, plan.control
    end = float(response.ends[-1])
    times = moments(plan, end)[:-1]
    speeds = np.linalg.norm(plan.velocity(np.append(times, end)), axis=1)
    peaks = [np.linalg.norm(peak(u)) for peak in response.speed_peaks(plan.state, horizon)]
    assert speeds.max() == pytest.approx(max(speeds[0], *peaks), abs=ROUNDING)
    accelerations = np.linalg.norm(plan.acceleration(times), axis=1)
    peaks = [np.linalg.norm(peak(u)) for peak in response.acceleration_peaks(plan.state, horizon)]
    assert accelerations.max() == pytest.approx(max(peaks), abs=ROUNDING)


def test_a_plan_is_named_shortly() -> None:
    """It stands in recordings, once for each step."""
    plan = AccelerationSequence(0.123456789, [(1, [0.1, 0.2])] * 40)
    assert repr(plan) == "AccelerationSequence(hold=0.123457, then=40 more)"
    assert plan == AccelerationSequence(0.123456789, ((1.0, (0.1, 0.2)),) * 40)
    assert hash(plan) == hash(replace(plan))


# Every plan, measured.


def faults(j: Journey, run: Sequence[Decided]) -> Iterator[str]:
    """What is wrong with decisions that are sequences, in the order in which they were made."""
    seen, rooms, required, last = None, [], 0.0, -np.inf
    for now, state, decision in run:
        plan = motion_of(decision.manoeuvre)
        end, here = float(plan.ends[-1]), f"at {now - j.start:g} s, {decision.outcome.name}"
        gaps = (float(b.gaps(j.robot, state.position[None], np.array([now]), now)[0]) for b in j.bodies)
        room = min(gaps, default=np.inf)
        # What is gone on with keeps the margin of the step that began it, which none does where the navigator decided.
        rooms = [*(rooms if now - last < 1.5 * j.period else ()), room]
        last = now
        if decision.outcome in (Outcome.CLEAR, Outcome.CONSTRAINED):
            required = min(j.margin, room - CONTACT_SLACK)
        elif decision.outcome is not Outcome.KEPT:
            required = decision.search.problem.margin
            fitting = [min(share * j.margin, then - CONTACT_SLACK) for share in MARGIN_SHARES for then in rooms]
            if min(abs(required - share) for share in fitting) > COMMITTED_SLACK + CONTACT_SLACK:
                yield f"{here}: margin {required} is no share of {j.margin}"
        position, velocity, _ = (value[0] for value in plan.at(np.array([now])))
        if max(np.abs(position - state.position).max(), np.abs(velocity - state.velocity).max()) > COMMITTED_SLACK:
            yield f"{here}: the plan is elsewhere"
        if (decision.outcome is Outcome.KEPT) != (decision.manoeuvre is seen):
            yield f"{here}: kept is what is not new"
        if decision.manoeuvre is seen:
            continue
        seen = decision.manoeuvre
        until = max(end, now + 6.0) if decision.outcome is Outcome.BEGUN else end
        gap = least_gap(j, plan, now, until, now)
        if gap < required - COMMITTED_SLACK:
            yield f"{here}: a clearance of {gap}, not {required}"
        yield from (f"{here}: {fault}" for fault in unlawful(j, now, decision))


def unlawful(j: Journey, now: float, decision: SequenceDecision) -> Iterator[str]:
    """What of a new plan does not obey the limits, the period, or the rule that it ends at rest."""
    plan = motion_of(decision.manoeuvre)
    if np.linalg.norm(plan.accelerations, axis=1).max() > j.limits.max_acceleration * (1.0 + ROUNDING):
        yield "accelerates too hard"
    # Speed is convex while an acceleration is held.
    speeds = np.linalg.norm(plan.at(plan.ends)[1], axis=1)
    if speeds.max() > j.limits.max_speed * (1.0 + ROUNDING):
        yield "too fast"
    periods = (plan.ends - now) / j.period
    changes = np.any(np.diff(plan.accelerations, axis=0, append=0.0 * plan.accelerations[:1]) != 0.0, axis=1)
    if np.abs(periods - np.round(periods))[changes].max(initial=0.0) > 1e-6:
        yield f"accelerations change after {periods} periods"
    if decision.outcome is Outcome.BEGUN and speeds[-1] > ROUNDING:
        yield f"ends at {speeds[-1]} m/s"


def missed(j: Journey, run: Sequence[Decided]) -> Iterator[str]:
    """Plans that are not at the goal when they say that they are."""
    for now, _, decision in run:
        if decision.outcome is Outcome.BEGUN and np.isfinite(decision.arrival):
            yield f"at {now - j.start:g} s: begun, and said to arrive"
        if decision.outcome is Outcome.KEPT or not np.isfinite(decision.arrival):
            continue
        position, velocity, _ = (value[0] for value in motion_of(decision.manoeuvre).at(np.array([decision.arrival])))
        away = float(np.linalg.norm(position - j.goal.trajectory.initial_position))
        if away > j.goal.tolerance:
            yield f"at {now - j.start:g} s: {away} m from the goal, of which the tolerance is {j.goal.tolerance} m"
        if j.goal.stop and np.linalg.norm(velocity) > ROUNDING:
            yield f"at {now - j.start:g} s: arrives at {np.linalg.norm(velocity)} m/s"


BATCH = 11
"""[1] Journeys of one test."""


@cache
def batch(first: int, d: int, steps: int) -> tuple[tuple[Journey, tuple[Decided, ...]], ...]:
    """Journeys from number `first` on, and what was decided of them, without the trees that were searched for it.

    Kept for several tests: a tree takes a megabyte, and there are a thousand of them.
    """
    found = (journey(first + k, d) for k in range(BATCH))
    return tuple((j, tuple(map(without_tree, driven(j, steps)))) for j in found)


def without_tree(step: Decided) -> Decided:
    """All but the nodes of the trees: when the sequence ends, and whether it arrives, is still known."""
    search = step.decision.search
    few = {name: None for name in search.tree._fields if name not in ("time", "counts")}
    tree = search.tree._replace(**few, time=search.tree.time[: search.node + 1].copy())
    return step._replace(decision=replace(step.decision, search=replace(search, tree=tree), better=None))


quick = pytest.mark.parametrize("first", draws(range(0, 10 * BATCH, BATCH)))
many = pytest.mark.parametrize("first", draws(range(1000, 1000 + 40 * BATCH, BATCH), 0))


@quick
@each_dimension
def test_plans_keep_clear_and_obey_the_limits(d: int, first: int) -> None:
    assert [f"{j}: {fault}" for j, run in batch(first, d, 6) for fault in faults(j, run)] == []


@quick
@each_dimension
def test_plans_arrive_when_they_say(d: int, first: int) -> None:
    assert [f"{j}: {fault}" for j, run in batch(first, d, 6) for fault in missed(j, run)] == []


@many
@each_dimension
def test_many_plans_keep_clear_obey_the_limits_and_arrive_when_they_say(d: int, first: int) -> None:
    for k in range(first, first + BATCH):
        j = journey(k, d)
        run = tuple(driven(j, 40))
        assert [f"{j}: {fault}" for fault in (*faults(j, run), *missed(j, run))] == []


@pytest.mark.parametrize("seed", [1354])
def test_every_step_is_decided(seed: int) -> None:
    """Of journeys on which that failed once."""
    j = journey(seed, 2)
    assert [f"{j}: {fault}" for fault in faults(j, tuple(driven(j, 12)))] == []


@pytest.mark.draw(0)
def test_these_journeys_tell_something() -> None:
    """Every outcome of a search, every kind of motion, shape and heading; and arrivals among obstacles."""
    runs = [pair for d in (2, 3) for first in range(0, 10 * BATCH, BATCH) for pair in batch(first, d, 6)]
    outcomes = [step.decision.outcome for _, run in runs for step in run]
    for outcome in (Outcome.CLEAR, Outcome.CONSTRAINED, Outcome.BEGUN, Outcome.SQUEEZED, Outcome.KEPT):
        assert outcomes.count(outcome) >= 4, outcome
    bodies = [body for j, run in runs if run for body in j.bodies]
    for what in ("Disc", "Ball", "Capsule", "Rectangle", "Polygon", "Polyline", "Union"):
        assert sum(type(body.shape).__name__ == what for body in bodies) >= 10, what
    for kind in ("stationary", "constant_velocity", "constant_acceleration", "circular", "sampled"):
        assert sum(body.kind == kind for body in bodies) >= 10, kind
    assert {b.parameters["interpolation"] for b in bodies if b.kind == "sampled"} == {"linear", "smooth"}
    assert sum(body.heading == "motion" and len(body.shape.parts[0].corners) > 1 for body in bodies) >= 10
    assert sum(any(body.unsure) for body in bodies) >= 10
    # Most first decisions are sequences that arrive, and the margin decides about many of them.
    firsts = [run[0].decision for _, run in runs if run]
    assert np.mean([np.isfinite(decision.arrival) for decision in firsts]) > 0.7
    tight = [
        least_gap(j, motion_of(first.decision.manoeuvre), first.now, first.decision.arrival, first.now) - j.margin
        for j, first in [(j, run[0]) for j, run in runs[:60] if run]
        if np.isfinite(first.decision.arrival)
    ]
    assert np.count_nonzero(np.abs(tight) < 1e-3) > 10


# Alone in the world.


def look_ahead(d: int = 2, limits: Limits | None = None, name: str = "nao_ahead", **settings) -> LookAhead:
    """A robot of radius 0.5 m, at most 3 m/s and 1 m/s^2."""
    own = {"time_horizon", "deadline", "budget", "improvement_budget"} & set(settings)
    others = {key: value for key, value in settings.items() if key not in own}
    others = {"robot": disc_or_ball(0.5, d), "limits": limits or Limits(3.0, 1.0), "period": PERIOD, **others}
    robot = Navigator(method(name), **others)
    return LookAhead(robot, **{key: settings[key] for key in own})


def alone(seed: int, d: int, *, stop: bool) -> tuple[LookAhead, State, Goal]:
    """A robot that moves anyhow, and a goal."""
    rng = np.random.default_rng([seed, d, stop])
    limits = Limits(float(rng.uniform(1.0, 5.0)), float(rng.uniform(0.3, 4.0)))
    way, pull = rng.normal(size=(2, d))
    way *= limits.max_speed * rng.uniform(2.0, 8.0) / np.linalg.norm(way)
    speed = limits.max_speed * rng.uniform(0.0, 1.0) * pull / np.linalg.norm(pull)
    goal = Goal(Stationary(way), float(rng.choice([0.2, 0.5, 1.0])), stop=stop)
    return look_ahead(d, limits, period=float(rng.choice([0.1, 0.2, 0.25]))), State(np.zeros(d), speed), goal


def driven_alone(robot: LookAhead, state: State, goal: Goal, obstacles: Sequence[Obstacle] = ()) -> float:
    """When it has arrived [s]; inf if not within a minute."""
    decision, period = None, robot.navigator.period
    for k in range(round(60.0 / period)):
        if goal.reached(state.position, state.velocity, k * period):
            return k * period
        decision = robot.decide(state, obstacles, goal, now=k * period, previous=decision)
        state = drive(state, decision.manoeuvre.mean_acceleration(k * period, period), period)
    return np.inf


def beyond_need(robot: LookAhead, state: State, goal: Goal) -> Iterator[str]:
    """Faults of the first decision of a robot alone: it needs one acceleration, and with `stop` one that brakes."""
    decision = robot.decide(state, (), goal)
    position = goal.trajectory.initial_position
    said = f"{state.velocity} m/s, to {position} within {goal.tolerance} m, {robot.navigator.limits}"
    if decision.outcome is not Outcome.CLEAR:
        yield f"{said}: {decision.outcome.name}"
    accelerations = np.count_nonzero(np.any(motion_of(decision.manoeuvre).accelerations != 0.0, axis=1))
    if accelerations > 1 + goal.stop:
        yield f"{said}: {accelerations} accelerations"
    away = float(np.linalg.norm(decision.manoeuvre.position(decision.arrival) - goal.trajectory.initial_position))
    if away > goal.tolerance:
        yield f"{said}: {away} m away at its arrival"


def beyond_time(robot: LookAhead, state: State, goal: Goal) -> Iterator[str]:
    """Whether the first decision to pass a goal leads there later than is possible, but for one period."""
    arrival, period = robot.decide(state, (), goal).arrival, robot.navigator.period
    soonest = goal.time_to_go(state.position, state.velocity, 0.0, robot.navigator.limits)
    if arrival > soonest + period:
        yield f"{state.velocity} m/s, to {goal.trajectory.initial_position}: at {arrival} s, not {soonest} s"
    # Whether a robot has arrived is asked at its steps: it should not pass by within one.
    if (
        goal.tolerance >= robot.navigator.limits.max_speed * period
        and driven_alone(robot, state, goal) > arrival + period
    ):
        yield f"{state.velocity} m/s, to {goal.trajectory.initial_position}: planned for {arrival} s, but not there"


def turned_away(d: int) -> list[tuple[LookAhead, State, Goal]]:
    """Slow to turn, and not on the way."""
    robot, goal = look_ahead(d, Limits(5.0, 0.5)), Goal(Stationary(18.0 * np.eye(d)[0]), 0.2)
    speeds = [(-3.0, 2.7), (1.9, -3.0), (0.0, -3.0), (0.0, -1.0), (-2.0, 0.0), (2.0, 0.0), (0.0, 0.0)]
    return [(robot, State(np.zeros(d), np.array([*speed, 0.0][:d])), goal) for speed in speeds]


@each_dimension
def test_alone_it_needs_one_acceleration_to_pass_its_goal(d: int) -> None:
    journeys = [*turned_away(d), *(alone(seed, d, stop=False) for seed in range(40))]
    assert [fault for journey in journeys for fault in beyond_need(*journey)] == []


@each_dimension
def test_alone_it_passes_its_goal_as_soon_as_it_can(d: int) -> None:
    """As the closed form of the earliest arrival has it, but for whole periods."""
    journeys = [*turned_away(d), *(alone(seed, d, stop=False) for seed in range(40))]
    assert [fault for journey in journeys for fault in beyond_time(*journey)] == []


@pytest.mark.xfail(
    reason="to stop, sequences have more accelerations than need be and arrive up to 3 s later", strict=True
)
@each_dimension
def test_alone_it_needs_two_accelerations_to_stop_at_its_goal(d: int) -> None:
    assert [fault for seed in range(20) for fault in beyond_need(*alone(seed, d, stop=True))] == []


@pytest.mark.parametrize("seed", range(10))
@each_dimension
def test_alone_it_is_at_its_goal_about_as_soon_as_it_can(d: int, seed: int) -> None:
    """From rest, for which there is a closed form; what is planned first improves on the way.

    Later than that by at most a step of the search, and a period for each of the three pieces.
    """
    robot, _, goal = alone(seed, d, stop=True)
    limits, rest = robot.navigator.limits, State(np.zeros(d), np.zeros(d))
    soonest = goal.time_to_go(rest.position, rest.velocity, 0.0, limits)
    step = limits.max_speed / limits.max_acceleration
    assert driven_alone(robot, rest, goal) <= soonest + step + 3.0 * robot.navigator.period


# Whole runs.

MOVING_GOALS = ("curved_road", "merging")
ALONE = [
    pytest.param(name, marks=WITH_PYRVO) if name == "crowdnav" else name
    for name in GALLERY
    if name not in (*FLEETS, *MOVING_GOALS)
]


def clear(recording: Recording, margin: float) -> bool:
    """Whether the margin was kept all the way, by code that shares nothing with the deciding kernels."""
    return all(closest.clearance >= margin - COMMITTED_SLACK - METRIC for closest in closest_approaches(recording))


def test_scenarios_of_one_robot_are_known() -> None:
    assert set(GALLERY) == {*FLEETS, *MOVING_GOALS} | {getattr(name, "values", (name,))[0] for name in ALONE}
    for name in MOVING_GOALS:
        with pytest.raises(InvalidInput, match="goal: expected one at rest to look ahead"):
            simulate(build(name), METHODS["nao_ahead"])


@pytest.mark.parametrize("name", draws(ALONE, 4))
def test_it_crosses_every_scenario_and_keeps_the_margin(name: str) -> None:
    """Where it decides by itself from begin to end."""
    recording = gallery_run(name, "nao_ahead", 0)
    assert np.isfinite(recording.arrived[0])
    assert clear(recording, build(name).margin)
    assert {outcome for row in recording.outcomes for outcome in row} <= {"CLEAR", "CONSTRAINED", "KEPT", "BEGUN"}
    assert recording.arrived[0] <= gallery_run(name, "nao", 0).arrived[0] + 1.0


# Budgets, deadlines.


@pytest.mark.parametrize("most", [1e6, 1e20, 1e100])
def test_a_large_acceleration_takes_no_more_memory(most: float) -> None:
    """Intervals of time by which obstacles are found are no shorter than a period, however soon it is fast."""
    crossing = Obstacle(Disc(0.4), ConstantVelocity((4.0, 0.1), (-0.5, 0.0)))
    robot, state = look_ahead(limits=Limits(2.0, most)), State((0.0, 0.0), (0.0, 0.0))
    decision = robot.decide(state, [crossing], Goal(Stationary((8.0, 0.0)), 0.3, True))
    usual = look_ahead(limits=Limits(2.0, 100.0)).decide(state, [crossing], Goal(Stationary((8.0, 0.0)), 0.3, True))
    assert decision.search.obstacles.index.first.size == usual.search.obstacles.index.first.size < 1e5
    times = np.linspace(0.0, 6.0, 601)
    gaps = np.linalg.norm(decision.manoeuvre.position(times) - crossing.trajectory.position(times), axis=1)
    assert decision.safe
    assert gaps.min() >= 0.4 + robot.navigator.robot.bounding_radius


def pocket() -> list[Obstacle]:
    """A wall in the way, open behind the robot."""
    wall = Polyline([(-2.0, 3.0), (6.0, 3.0), (6.0, -3.0), (-2.0, -3.0)], 0.1)
    return [Obstacle(wall, Stationary((0.0, 0.0)), "pocket")]


REST = State((0.0, 0.0), (0.0, 0.0))
BEHIND = Goal(Stationary((14.0, 0.0)), 0.5)


def test_a_small_budget_ends_a_search_and_not_the_journey() -> None:
    """Out of a pocket, with so little work at each decision that it takes many: begun, and gone on with."""
    robot, state, decision, found = look_ahead(budget=30.0, improvement_budget=30.0), REST, None, []
    for k in range(600):
        if BEHIND.reached(state.position, state.velocity, PERIOD * k):
            break
        decision = robot.decide(state, WALLS, BEHIND, now=PERIOD * k, previous=decision)
        found.append(decision)
        state = drive(state, decision.manoeuvre.mean_acceleration(PERIOD * k, PERIOD), PERIOD)
    assert k < 599, "it never arrives"
    assert all(isinstance(decision, SequenceDecision) for decision in found)
    begun = [decision for decision in found if decision.outcome is Outcome.BEGUN]
    assert len(begun) > 5
    assert all(decision.cut and decision.arrival == np.inf for decision in begun)
    much = look_ahead(budget=1e6).decide(REST, WALLS, BEHIND)
    assert np.isfinite(much.arrival)
    assert PERIOD * k >= much.arrival - PERIOD


WALLS = pocket()


def test_no_clock_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """A decision is made without knowing how long it takes."""
    robot, goal = look_ahead(), Goal(Stationary((20.0, 0.0)), 0.5)
    first = robot.decide(REST, [rock(), *WALLS], goal)

    def asked() -> float:
        raise AssertionError("a clock is asked")

    for clock in ("time", "perf_counter", "monotonic", "process_time", "thread_time", "time_ns", "perf_counter_ns"):
        monkeypatch.setattr(time, clock, asked)
    assert told(robot.decide(REST, [rock(), *WALLS], goal)) == told(first)


def told(decision: Decision) -> tuple[object, ...]:
    """All that a decision says."""
    plan = decision.manoeuvre
    more = (decision.arrival, decision.cut) if isinstance(decision, SequenceDecision) else ()
    return (decision.outcome, plan.start, plan.control.tobytes(), plan.response, *more)


@pytest.mark.parametrize("seconds", draws([2.5, 0.3, 1.0, 5.0]))
@each_dimension
def test_nothing_later_is_planned_than_a_deadline_that_the_robot_alone_can_meet(d: int, seconds: float) -> None:
    """Where it cannot, arrivals are those without a deadline."""
    planned, free = 0, 0
    for seed in range(8):
        j = journey(seed, d)
        robot, deadline = j.decider(deadline=j.start + seconds), j.start + seconds
        for step in driven(j, 8, robot):
            state, limits = step.state, robot.navigator.limits
            met = step.now + j.goal.time_to_go(state.position, state.velocity, step.now, limits) <= deadline
            if isinstance(step.decision, SequenceDecision) and np.isfinite(step.decision.arrival):
                assert not met or step.decision.arrival <= deadline + ROUNDING
                planned += met
                free += not met
    assert planned > 10 or seconds < 4.0
    assert free > 10 or seconds > 4.0


def test_a_deadline_is_met_if_it_can_be() -> None:
    """A little later than the soonest arrival it changes nothing; one that cannot be met changes nothing either."""
    goal = Goal(Stationary((15.0, 0.0)), 0.5)
    free = look_ahead().decide(REST, [rock()], goal)
    assert look_ahead(deadline=free.arrival + 0.01).decide(REST, [rock()], goal).arrival <= free.arrival + 0.01
    early = goal.time_to_go(REST.position, REST.velocity, 0.0, Limits(3.0, 1.0)) - 0.2
    assert told(look_ahead(deadline=early).decide(REST, [rock()], goal)) == told(free)


def test_after_its_deadline_a_robot_drives_on() -> None:
    robot = look_ahead(deadline=5.0)
    for now in (4.95, 5.0, 7.0):
        decision = robot.decide(REST, WALLS, BEHIND, now=now)
        assert decision.outcome.safe
        assert now < decision.arrival < np.inf


# Going on with what was decided.


@quick
@each_dimension
def test_a_plan_is_kept_until_one_is_better_by_the_patience(d: int, first: int) -> None:
    """With recorded futures nothing else ends it; and all is looked up in one table."""
    for j, steps in batch(first, d, 6):
        patience = j.decider().navigator.patience
        for before, after in pairwise(steps):
            if after.now - before.now > 1.5 * j.period:
                continue  # in between the navigator decided
            assert after.decision.search.obstacles is before.decision.search.obstacles
            if before.decision.search.end_time <= after.now + 1e-6 * j.period:
                continue
            kept = after.decision.manoeuvre is before.decision.manoeuvre
            assert kept == (after.decision.outcome is Outcome.KEPT)
            if np.isfinite(before.decision.arrival):
                assert kept or after.decision.arrival <= before.decision.arrival - patience
                assert not kept or after.decision.arrival == before.decision.arrival
            else:
                assert after.decision.outcome in (Outcome.BEGUN, Outcome.CONSTRAINED, Outcome.SQUEEZED)


def crossing(start: float, reach: float = 1.0) -> Obstacle:
    """An obstacle that appears at a time and stands in the way of the robot soon after."""
    return Obstacle(Disc(reach), Sampled([start, start + 30.0], [(6.0, 0.1), (6.5, 0.0)]), "late", after_end="leaves")


@pytest.mark.parametrize("name", ["nao_ahead", "nao_ahead@present", "nao_ahead@observed"])
def test_an_obstacle_that_appears_later_changes_nothing_before(name: str) -> None:
    """Unless the recording is known: then the robot reacts before."""
    goal, appears = Goal(Stationary((20.0, 0.0)), 0.5), 1.5
    worlds = [[rock()], [rock(), crossing(appears)]]
    runs = [list(decisions(look_ahead(name=name), REST, world, goal, 30)) for world in worlds]
    same = [told(one) == told(other) for one, other in zip(*runs)]
    if name == "nao_ahead":
        assert not same[0]
    else:
        assert all(same[:15])
        assert not all(same[15:])


def rock() -> Obstacle:
    """Beside the way."""
    return Obstacle(Disc(1.0), Stationary((10.0, 1.2)), "rock")


def decisions(
    robot: LookAhead, state: State, obstacles: Sequence[Obstacle], goal: Goal, steps: int
) -> Iterator[Decision]:
    """The first decisions of a run."""
    decision = None
    for k in range(steps):
        decision = robot.decide(state, obstacles, goal, now=PERIOD * k, previous=decision)
        yield decision
        state = drive(state, decision.manoeuvre.mean_acceleration(PERIOD * k, PERIOD), PERIOD)


@pytest.mark.parametrize("foresight", draws(["observed", *sorted({*FORESIGHTS} - {"observed"})], 2))
def test_observations_are_of_the_past(foresight: str) -> None:
    """A change of all that comes after now leaves decisions from observations the same."""
    goal, differ = Goal(Stationary((15.0, 0.0)), 0.5), 0
    for seed in range(2):
        rng = np.random.default_rng(seed)
        stamps = np.arange(-20, 120) * PERIOD
        worlds: list[list[Obstacle]] = [[], []]
        for _ in range(5):
            steps = np.cumsum(rng.normal(0.0, 0.02, (len(stamps), 2)), axis=0) + rng.normal(0.0, 0.1, 2)
            positions = rng.uniform((2.0, -6.0), (12.0, 6.0)) + np.cumsum(steps, axis=0)
            now = np.searchsorted(stamps, 1.0 - 1e-9)
            other = np.concatenate(
                [positions[: now + 1], positions[now] + (positions[now] - positions[now + 1 :])[:, ::-1]]
            )
            for world, track in zip(worlds, (positions, other)):
                world.append(Obstacle(Disc(0.6), Sampled(stamps, track, "linear")))
        runs = [list(decisions(look_ahead(name=f"nao_ahead@{foresight}"), REST, world, goal, 11)) for world in worlds]
        same = [told(one) == told(other) for one, other in zip(*runs)]
        if foresight.startswith("observed"):
            assert all(same), seed
        differ += not all(same)
    assert (differ > 0) == (not foresight.startswith("observed"))


def test_an_obstacle_that_appears_in_the_way_ends_a_plan() -> None:
    """The new one keeps clear of them."""
    goal, late = Goal(Stationary((20.0, 0.0)), 0.5), crossing(1.5)
    found = list(decisions(look_ahead(name="nao_ahead@present"), REST, [late], goal, 30))
    assert found[14].manoeuvre is found[0].manoeuvre
    assert found[15].manoeuvre is not found[0].manoeuvre
    assert found[15].outcome is Outcome.CONSTRAINED
    times = np.linspace(1.5, found[15].arrival, 5000)
    before, after = (
        plan.position(times) - late.trajectory.position(times) for plan in (found[0].manoeuvre, found[15].manoeuvre)
    )
    assert np.linalg.norm(before, axis=1).min() < 1.5
    assert np.linalg.norm(after, axis=1).min() >= 1.55 - COMMITTED_SLACK


@pytest.mark.parametrize(("off", "kept"), [(0.0, True), (3e-6, True), (0.5, False)])
def test_a_robot_off_its_course_plans_anew(off: float, kept: bool) -> None:
    """From where it is; unless that is where it should be."""
    robot, goal = look_ahead(), Goal(Stationary((20.0, 0.0)), 0.5)
    first = robot.decide(REST, [rock()], goal)
    there = drive(REST, first.manoeuvre.mean_acceleration(0.0, PERIOD), PERIOD)
    there = State(there.position + np.array([0.0, off]), there.velocity)
    second = robot.decide(there, [rock()], goal, now=PERIOD, previous=first)
    assert isinstance(second, SequenceDecision)
    assert (second.manoeuvre is first.manoeuvre) == kept
    off_course = np.abs(second.manoeuvre.position(PERIOD) - there.position).max()
    assert off_course <= (off if kept else 0.0) + ROUNDING


# Where there is nothing to go on with.


def test_without_a_sequence_the_navigator_decides() -> None:
    """Overlapping, or about to collide whatever is done: as without looking ahead."""
    wall = [Obstacle(Polyline([(6.0, -30.0), (6.0, 30.0)]), Stationary((0.0, 0.0)), "wall")]
    fast = State((5.3, 0.0), (3.0, 0.0))
    inside = State((5.8, 0.0), (0.0, 0.0))
    for state, outcome in ((fast, Outcome.IMPACT), (inside, Outcome.ESCAPING)):
        robot, goal = look_ahead(), Goal(Stationary((20.0, 0.0)))
        decision = robot.decide(state, wall, goal)
        assert not isinstance(decision, SequenceDecision)
        assert decision.outcome is outcome
        alone = replace(robot.navigator, method=METHODS["nao"])
        assert told(decision) == told(alone.decide(state, wall, goal))
        # What was decided so is nothing that a plan goes on from.
        after = drive(state, decision.manoeuvre.mean_acceleration(0.0, PERIOD), PERIOD)
        robot.decide(after, [], goal, now=PERIOD, previous=decision)
        assert isinstance(robot.decide(after, [], goal, now=PERIOD, previous=decision), SequenceDecision)


@pytest.mark.parametrize("gap", [2.0 * CONTACT_SLACK, 0.01, 0.05 - 1e-7])
def test_within_the_margin_it_plans_away(gap: float) -> None:
    """With as much of the margin as it has, and comes no nearer."""
    stone = [Obstacle(Disc(2.0), Stationary((2.5 + gap, 0.0)), "stone")]
    decision = look_ahead().decide(REST, stone, Goal(Stationary((-9.0, 3.0)), 0.5))
    assert isinstance(decision, SequenceDecision)
    assert np.isfinite(decision.arrival)
    positions = decision.manoeuvre.position(np.linspace(0.0, decision.arrival, 5000))
    assert np.linalg.norm(positions - (2.5 + gap, 0.0), axis=1).min() >= 2.5 + gap - CONTACT_SLACK - COMMITTED_SLACK


def test_touching_the_navigator_leads_away_first() -> None:
    stone, goal = [Obstacle(Disc(2.0), Stationary((2.5, 0.0)), "stone")], Goal(Stationary((-9.0, 3.0)), 0.5)
    first, second = decisions(look_ahead(), REST, stone, goal, 2)
    assert not isinstance(first, SequenceDecision)
    assert first.outcome.safe
    assert isinstance(second, SequenceDecision)


@pytest.mark.parametrize("robot_radius", [0.45, 0.6])
def test_to_wait_for_a_gap_comes_out_of_the_search(robot_radius: float) -> None:
    """A door that a long train stands in until it has gone: the robot is through soon after, and hits nothing."""
    walls = [Obstacle(Polyline([(8.0, s * 1.0), (8.0, s * 40.0)]), Stationary((0.0, 0.0)), "wall") for s in (-1, 1)]
    train = Obstacle(Polyline([(0.0, 0.0), (0.0, 18.0)], 0.3), ConstantVelocity((8.6, -12.0), (0.0, 2.0)), "train")
    robot = look_ahead(robot=Disc(robot_radius))
    decision = robot.decide(State((0.0, 0.0), (1.0, 0.0)), [*walls, train], Goal(Stationary((14.0, 0.0)), 0.5))
    assert isinstance(decision, SequenceDecision)
    assert decision.outcome is Outcome.CONSTRAINED
    # Its end, 0.3 m about (8.6, -12 + 2 t), has left the door at 6.5 s.
    assert 6.5 < decision.arrival < 12.0


# Timetables.


def table_of(j: Journey, *, include_future: bool = True, end: float = 20.0) -> PredictedObstacles:
    """From the start of a journey on."""
    return PredictedObstacles.of(
        j.obstacles, j.obstacles, j.robot, j.start, j.start + end, 1.7, include_future=include_future
    )


@pytest.mark.parametrize("first", draws(range(0, 40, 10), 2))
@each_dimension
def test_the_gap_is_the_least_distance(d: int, first: int) -> None:
    """To present obstacles, at any position and time of the table, its first and last included.

    Less than that by at most what pieces may be off. What is uncertain grows by straight lines, a chord of which lies
    above its parabola by a eighth of the square of its length.
    """
    for seed in range(first, first + 10):
        j, rng = journey(seed, d), np.random.default_rng([seed, d])
        tables = [table_of(j, include_future=known) for known in (True, False)]
        times = j.start + np.array([0.0, 20.0, 1.7, 3.4, *rng.uniform(0.0, 20.0, 40)])
        shares = rng.uniform(0.0, 1.2, (len(times), 1))
        positions = j.state.position + shares * (j.goal.trajectory.initial_position - j.state.position)
        gaps = [np.full(len(times), np.inf), *(body.gaps(j.robot, positions, times, j.start) for body in j.bodies)]
        chord = max((body.unsure[2] for body in j.bodies), default=0.0) * (20.0 / UNCERTAINTY_PIECES) ** 2 / 8.0
        for position, t, least in zip(positions, times, np.min(gaps, axis=0)):
            for table in tables:
                found = table.clearance(position, float(t))
                assert found == least or least - chord - SLACK <= found <= least + ROUNDING, (str(j), t, found, least)


SLACK = 1.5 * CERTIFIED + CONTACT
"""[m] Pieces of places and of directions are each off by a little."""


def test_what_is_not_there_has_no_gap() -> None:
    """Before it appears, after it has vanished, far beyond the table; and in an empty world."""
    brief = Obstacle(Disc(1.0), Sampled([2.0, 4.0], [(3.0, 0.0), (3.0, 1.0)]), "brief", after_end="leaves")
    robot, here = Disc(0.5), np.zeros(2)
    table = PredictedObstacles.of([brief], [brief], robot, 0.0, 10.0, 1.0)
    for now, gap in ((0.0, np.inf), (1.99, np.inf), (2.0, 1.5), (4.0, np.sqrt(10.0) - 1.5), (4.01, np.inf)):
        assert table.clearance(here, now) == pytest.approx(gap)
    beyond = PredictedObstacles.of([brief], [brief], robot, 0.0, 3.0, 1.0)
    assert [beyond.clearance(here, now) for now in (-1.0, 1.0, 50.0)] == [np.inf] * 3
    empty = PredictedObstacles.of([], [], robot, 0.0, 10.0, 1.0)
    assert [empty.clearance(here, now) for now in (-5.0, 0.0, 5.0, 10.0, 20.0)] == [np.inf] * 5
    never = PredictedObstacles.of([brief], [brief], robot, 5.0, 10.0, 1.0)
    assert [never.clearance(here, now) for now in (5.0, 7.0)] == [np.inf] * 2


def test_a_table_serves_for_what_it_was_made_of() -> None:
    """The very same obstacles in any sequence, not equal ones, between its start and its end."""
    world = [rock()]
    table = PredictedObstacles.of(world, world, Disc(0.5), 2.0, 10.0, 1.0)
    assert table.covers(world, 2.0, 10.0)
    assert table.covers(tuple(world), 2.0, 10.0)
    for others in ([rock()], [*world, rock()], []):
        assert not table.covers(others, 2.0, 10.0)
    assert not table.covers(world, 1.9, 10.0)
    assert not table.covers(world, 2.0, 10.1)
    assert not PredictedObstacles.of(None, world, Disc(0.5), 2.0, 10.0, 1.0).covers(world, 2.0, 10.0)
    assert table.known_at(3.0) == np.inf
    assert PredictedObstacles.of(world, world, Disc(0.5), 2.0, 10.0, 1.0, include_future=False).known_at(3.0) == 3.0


def test_of_many_observed_obstacles_the_nearest_and_those_at_rest_count() -> None:
    walkers = [Obstacle(Disc(0.2), Sampled([0.0, 9.0], [(k, 1.0), (k, 9.0)]), f"{k}") for k in range(FORESEEN + 20)]
    world = [*walkers[:30], Obstacle(Disc(0.2), Stationary((500.0, 0.0)), "rock"), *walkers[30:]]
    robot = Navigator(method("nao_ahead@observed"), Disc(0.2), Limits(1.0, 1.0))
    names = [motion.name for motion in motions_of(robot, world, 5.0, np.array([-3.0, 0.0]))]
    assert names == [*(f"{k}" for k in range(30)), "rock", *(f"{k}" for k in range(30, FORESEEN))]
    assert len(motions_of(robot, world, 5.0)) == len(world)


def test_arranging_before_the_first_decision_changes_nothing() -> None:
    world, goal = [rock(), *WALLS], Goal(Stationary((20.0, 0.0)), 0.5)
    robot = look_ahead()
    prepared = robot.prepared_for(world, 0.0)
    one, other = (r.decide(REST, world, goal) for r in (robot, prepared))
    assert told(one) == told(other)
    assert other.search.obstacles is prepared.prepared
    elsewhere = prepared.decide(REST, [rock()], goal)
    assert elsewhere.search.obstacles is not prepared.prepared
