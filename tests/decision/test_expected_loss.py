"""Laws of the robot that weighs time against closeness."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from slalom import (
    BoundedError,
    Composite,
    ConstantVelocity,
    Disc,
    ExpectedLoss,
    Goal,
    InvalidInput,
    Limits,
    LookAhead,
    Navigator,
    Obstacle,
    Outcome,
    Polyline,
    Sampled,
    State,
    Stationary,
    Tracks,
    method,
)
from slalom.forecast.forecast import AtConstantTurn, AtConstantVelocity, Forecast, FromPast, Present

GOAL = Goal(Stationary([9.0, 0.0]), 0.3)
START = State([0.0, 0.0], [1.0, 0.0])


def ahead(margin: float = 0.1) -> LookAhead:
    """A robot of 0.3 m and 1 m/s that predicts constant velocities."""
    return LookAhead(
        Navigator(method("nao_ahead"), Disc(0.3), Limits(1.0, 4.0), period=0.25, horizon=1.5, margin=margin)
    )


def crowd(seed: int) -> list[Obstacle]:
    """Eight discs in the way."""
    rng = np.random.default_rng(seed)
    places, velocities = rng.uniform((1.5, -3.0), (8.0, 3.0), (8, 2)), rng.normal(scale=0.6, size=(8, 2))
    return [Obstacle(Disc(0.3), ConstantVelocity(p, v)) for p, v in zip(places, velocities, strict=True)]


def motion(decision) -> np.ndarray:
    """Positions of the next 3 s."""
    return decision.manoeuvre.position(np.linspace(0.0, 3.0, 31))


@pytest.mark.parametrize("seed", range(4))
def test_the_decision_is_the_cheapest_of_the_margins(seed: int) -> None:
    others, margins = crowd(seed), (0.0, 0.1, 0.3)
    robot = ExpectedLoss(ahead(), margins, (1.0, 1.0, 1.0), loss=8.0, deviates=False)
    single = [ahead(margin).decide(START, others, GOAL) for margin in margins]
    costs = [robot.cost(decision, others, GOAL, 0.0) for decision in single]
    np.testing.assert_array_equal(motion(robot.decide(START, others, GOAL)), motion(single[int(np.argmin(costs))]))


def test_a_share_of_the_uncertainty_counts_for_its_margin() -> None:
    """With the share 0 the decision is that among the same obstacles without uncertainty, and otherwise not."""
    certain = [Obstacle(Disc(0.5), ConstantVelocity([6.0, 1.1], [-0.5, 0.0]))]
    doubtful = [replace(other, uncertainty=BoundedError(velocity=0.3)) for other in certain]
    expected = motion(ahead().decide(START, certain, GOAL))
    for share, same in ((0.0, True), (1.0, False)):
        robot = ExpectedLoss(ahead(), (0.1,), (share,), deviates=False)
        assert np.array_equal(motion(robot.decide(START, doubtful, GOAL)), expected) is same


def test_the_expected_contacts_are_those_of_the_definition() -> None:
    """Sums of tails of true gaps; a gap below 0 is a contact unless the error exceeds it."""
    rng = np.random.default_rng(5)
    others, times, places = crowd(5), np.array([0.2, 0.7, 1.0]), rng.uniform(0.0, 6.0, (3, 2))
    places[0] = others[0].trajectory.position(0.2) + 0.2
    robot = ExpectedLoss(ahead(), spread=BoundedError(0.2, 0.1))
    for t, place, found in zip(times, places, robot.contacts(places, others, times, 0.0), strict=True):
        there = np.array([other.trajectory.position(t) for other in others])
        gaps = cdist(place[None], there)[0] - 0.6
        tails = [0.5 / (1.0 + abs(gap) / (0.2 + 0.1 * t)) ** 2 for gap in gaps]
        expected = sum(1.0 - tail if gap < 0.0 else tail for gap, tail in zip(gaps, tails, strict=True))
        assert found == pytest.approx(expected, rel=1e-12)


def test_a_decision_that_is_not_safe_costs_a_contact_after_the_last_moment() -> None:
    """Between two walls that close in faster than the robot; the same motion that is safe costs only its closeness."""
    wall = Polyline([(0.0, -9.0), (0.0, 9.0)], 0.05)
    others = [Obstacle(wall, ConstantVelocity([2.0 * side, 0.0], [-2.0 * side, 0.0])) for side in (-1.0, 1.0)]
    decision = ahead(0.0).decide(State([0.0, 0.0], [0.0, 0.0]), others, GOAL)
    assert not decision.outcome.safe
    robot = ExpectedLoss(ahead(), loss=50.0)
    safe = replace(decision, outcome=Outcome.CONTINUED)
    more = robot.cost(decision, others, GOAL, 0.0) - robot.cost(safe, others, GOAL, 0.0)
    assert more == pytest.approx(50.0 * 0.6**4)


def test_a_future_counts_with_its_probability() -> None:
    """Of two futures at one place with 0.3 and 0.7, together, as of one obstacle that is certain."""
    times, place = np.array([0.2, 0.7]), np.array([[1.0, 0.4], [1.2, 0.3]])
    robot, sure = ExpectedLoss(ahead()), Obstacle(Disc(0.3), ConstantVelocity([2.0, 0.5], [-0.5, 0.1]), "a")
    futures = [replace(sure, probability=share) for share in (0.3, 0.7)]
    expected = robot.contacts(place, [sure], times, 0.0)
    np.testing.assert_allclose(robot.contacts(place, futures, times, 0.0), expected, rtol=1e-12)
    np.testing.assert_allclose(robot.contacts(place, futures[:1], times, 0.0), 0.3 * expected, rtol=1e-12)


def test_a_deviation_is_taken_where_it_costs_less_than_the_plan() -> None:
    """Beside a fast obstacle; the motion keeps the limits, and without deviations the plan is worse."""
    others = [Obstacle(Disc(0.3), ConstantVelocity([-0.5, 0.68], [3.0, 0.0]))]
    settings = {"margins": (0.0,), "shares": (1.0,), "loss": 200.0, "spread": BoundedError(0.02, 0.0, 0.1)}
    robot = ExpectedLoss(ahead(), **settings)
    decision = robot.decide(START, others, GOAL)
    plan = ExpectedLoss(ahead(), **settings, deviates=False).decide(START, others, GOAL)
    assert decision.outcome is Outcome.DEVIATING
    assert plan.outcome is not Outcome.DEVIATING
    times = np.linspace(0.0, 1.0, 101)
    velocities = decision.manoeuvre.velocity(times)
    assert np.linalg.norm(velocities, axis=1).max() <= 1.0 + 1e-9
    assert np.linalg.norm(np.diff(velocities, axis=0), axis=1).max() <= 4.0 * 0.01 + 1e-9
    steps = np.array([0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0])
    closeness = [robot.contacts(d.manoeuvre.position(steps), others, steps, 0.0).sum() for d in (decision, plan)]
    assert closeness[0] < closeness[1]


def ramped(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Positions (8, 2) at 0.125, 0.25, ... 1 s with a velocity for 0.25 s and another after it, at 4 m/s^2 at most."""
    h, velocities = 1e-3, [START.velocity]
    for aim, count in ((first, 250), (second, 750)):
        for _ in range(count):
            change = aim - velocities[-1]
            size = float(np.linalg.norm(change))
            velocities.append(velocities[-1] + change * min(1.0, 4.0 * h / size if size > 0.0 else 1.0))
    v = np.array(velocities)
    places = START.position + np.cumsum(0.5 * h * (v[1:] + v[:-1]), axis=0)
    return places[124::125]


def test_the_deviation_is_the_best_of_the_promising_ones_with_a_plan_after_it() -> None:
    """Deviations are integrated here, velocity after velocity; a plan begins after the first velocity of each."""
    others = [Obstacle(Disc(0.3), ConstantVelocity([-0.5, 0.68], [3.0, 0.0]))]
    settings = {"margins": (0.0,), "shares": (1.0,), "loss": 200.0, "spread": BoundedError(0.02, 0.0, 0.1)}
    robot = ExpectedLoss(ahead(), **settings)
    decision, plan = robot.decide(START, others, GOAL), ahead(0.0).decide(START, others, GOAL)
    times, weights = 0.125 * np.arange(1, 9), 0.6 ** (np.arange(8) // 2) / 2.0
    there = plan.manoeuvre.position(0.5)

    def lost(places: np.ndarray) -> float:
        return 200.0 * float(robot.contacts(places, others, times, 0.0) @ weights)

    def rough(places: np.ndarray) -> float:
        return float(np.linalg.norm(places[3] - there)) + lost(places) + plan.arrival

    def exact(places: np.ndarray, state: State) -> float:
        after = ahead(0.0).decide(state, others, GOAL, now=0.25)
        return after.arrival + lost(np.concatenate([places[:2], after.manoeuvre.position(times[2:])]))

    whole = plan.arrival + lost(plan.manoeuvre.position(times))
    chosen = decision.manoeuvre
    cost = exact(chosen.position(times), State(chosen.position(0.25), chosen.velocity(0.25)))
    assert decision.outcome is Outcome.DEVIATING
    assert cost <= whole - 0.02
    angles = 2.0 * np.pi * np.arange(16) / 16
    ways = [np.array([np.cos(angle), np.sin(angle)]) for angle in angles]
    best: dict[int, float] = {}
    for k, first in enumerate(ways):
        for second in ways:
            # In 0.25 s the velocity changes by 1 m/s at most.
            if max(np.linalg.norm(first - START.velocity), np.linalg.norm(second - first)) <= 1.0 + 1e-9:
                best[k] = min(best.get(k, np.inf), rough(ramped(first, second)))
    assert len(best) == 5
    # No way at full speed is more promising than what was judged, but for the errors of the integration.
    first_three = sorted(best.values())[:3]
    assert rough(chosen.position(times)) <= first_three[-1] + 5e-3
    for k in sorted(best, key=best.__getitem__)[:1]:
        path = ramped(ways[k], ways[k])
        assert cost <= exact(path, State(path[1], ways[k])) + 0.05


def test_errors_that_are_larger_cost_more() -> None:
    """Twice the scale of an obstacle is twice the spread; other obstacles keep theirs."""
    times, place = np.array([0.2, 0.7]), np.array([[1.0, 0.4], [1.2, 0.3]])
    one = Obstacle(Disc(0.3), ConstantVelocity([2.0, 0.5], [-0.5, 0.1]), "a")
    other = replace(one, trajectory=ConstantVelocity([3.0, 0.5], [-0.5, 0.1]), name="b")
    narrow, wide = (ExpectedLoss(ahead(), spread=BoundedError(s, 0.0, 0.08)) for s in (0.005, 0.01))
    wide = replace(wide, spread=BoundedError(0.01, 0.0, 0.16))
    found = narrow.contacts(place, [one, other], times, 0.0, {"a": 2.0})
    expected = wide.contacts(place, [one], times, 0.0) + narrow.contacts(place, [other], times, 0.0)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    decision = narrow.decide(START, [one, other], GOAL)
    assert narrow.cost(decision, [one, other], GOAL, 0.0, {"a": 9.0}) > narrow.cost(decision, [one, other], GOAL, 0.0)
    with pytest.raises(InvalidInput, match=r"scales\['a'\]: expected 0 or more, found -1"):
        narrow.decide(START, [one], GOAL, scales={"a": -1.0})
    with pytest.raises(InvalidInput, match=r"scales: expected factors by names of obstacles, found \[1.0\]"):
        narrow.decide(START, [one], GOAL, scales=[1.0])


def test_an_obstacle_may_end_within_the_first_stage_of_a_deviation() -> None:
    """It continues at its last velocity, as for a plan."""
    path = Sampled([0.0, 0.1], [[-0.5, 0.68], [-0.2, 0.68]])
    settings = {"margins": (0.0,), "shares": (1.0,), "loss": 200.0, "spread": BoundedError(0.02, 0.0, 0.1)}
    robot = ExpectedLoss(ahead(), **settings)
    short = robot.decide(START, [Obstacle(Disc(0.3), path)], GOAL)
    long = robot.decide(START, [Obstacle(Disc(0.3), ConstantVelocity([-0.5, 0.68], [3.0, 0.0]))], GOAL)
    assert short.outcome is long.outcome is Outcome.DEVIATING
    np.testing.assert_allclose(motion(short), motion(long), atol=1e-6)


@pytest.mark.parametrize("forecast", [AtConstantVelocity(), FromPast(AtConstantTurn()), Present()])
def test_a_deviation_uses_nothing_that_comes_later(forecast: Forecast) -> None:
    """Obstacles that turn off or appear after the decision, and within the first stage, change no bit of it."""
    navigator = ahead(0.0).navigator
    robot = LookAhead(replace(navigator, method=replace(navigator.method, forecast=forecast)))
    weighing, outcomes = ExpectedLoss(robot, loss=200.0, spread=BoundedError(0.02, 0.0, 0.1)), set()
    for seed in range(6):
        rng, scenes = np.random.default_rng(seed), ([], [Obstacle(Disc(0.5), Sampled([0.1, 9.0], [[1.0, 0.0]] * 2))])
        for place, velocity, turned in zip(rng.normal(size=(5, 2)), *rng.normal(size=(2, 5, 2)), strict=True):
            place *= 2.0 + 0.6 / np.linalg.norm(place)
            straight = ConstantVelocity(place, velocity)
            corner = ConstantVelocity(straight.position(0.02), turned, 0.02)
            later = straight if isinstance(forecast, Present) else Composite((straight, corner), (0.02,))
            for scene, trajectory in zip(scenes, (straight, later), strict=True):
                scene.append(Obstacle(Disc(0.3), trajectory))
        first, second = (weighing.decide(START, scene, GOAL) for scene in scenes)
        outcomes.add(first.outcome)
        np.testing.assert_array_equal(motion(first), motion(second))
    assert Outcome.DEVIATING in outcomes


def test_without_a_spread_only_contacts_count() -> None:
    """By a spread of 0 or a scale of 0: 1 for a contact, 1/2 for touching, 0 beyond, and no warning."""
    others = [Obstacle(Disc(0.25), Stationary([x, 2.0]), "a") for x in (0.0, 0.75, 3.0)]
    robot, times = replace(ahead(), navigator=replace(ahead().navigator, robot=Disc(0.5))), np.array([0.5])
    for spread, scales in ((BoundedError(), None), (BoundedError(0.1), {"a": 0.0})):
        weighing = ExpectedLoss(robot, spread=spread)
        with np.errstate(all="raise", under="ignore"):
            assert weighing.contacts(np.array([[0.0, 2.0]]), others, times, 0.0, scales) == pytest.approx(1.5)
            assert weighing.contacts(np.array([[9.0, 9e6]]), others, times, 0.0, scales) == pytest.approx(0.0)


def test_tracks_are_taken_and_runs_arrive() -> None:
    """In closed loop among people that keep their velocity, without a contact."""
    rng = np.random.default_rng(2)
    places, velocities = rng.uniform((2.0, -4.0), (8.0, 4.0), (6, 2)), rng.normal(scale=0.5, size=(6, 2))
    robot, state, decision, gaps = ExpectedLoss(ahead()), State([0.0, 0.0], [0.0, 0.0]), None, []
    for k in range(100):
        now = 0.25 * k
        tracks = Tracks(places + now * velocities, velocities, 0.3, now)
        decision = robot.decide(state, tracks, GOAL, now=now, previous=decision)
        for t in np.linspace(now, now + 0.25, 6):
            gaps.append(np.linalg.norm(places + t * velocities - decision.manoeuvre.position(t), axis=1).min() - 0.6)
        state = State(decision.manoeuvre.position(now + 0.25), decision.manoeuvre.velocity(now + 0.25))
        if np.linalg.norm(state.position - GOAL.trajectory.initial_position) < GOAL.tolerance:
            break
    assert np.linalg.norm(state.position - GOAL.trajectory.initial_position) < GOAL.tolerance
    assert min(gaps) > 0.0
