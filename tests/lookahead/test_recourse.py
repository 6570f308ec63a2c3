"""Which sets of a forecast a robot that looks ahead keeps clear of, and for how long they grow."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from draws import draws

import slalom
from slalom import (
    BoundedError,
    Decision,
    Disc,
    GaussianError,
    Goal,
    KalmanError,
    Limits,
    LookAhead,
    Navigator,
    Obstacle,
    Outcome,
    Sampled,
    State,
    Stationary,
)
from slalom.forecast.from_models import FromModels
from slalom.lookahead.navigator import SequenceDecision
from slalom.model.uncertainty import Adjusted, with_share
from slalom.obstacle.window import Reaction, futures
from slalom.sim.explanation import explanation

NOW, RADIUS, MARGIN = 3.0, 0.25, 0.1
LIMITS = Limits(1.5, 1.5)
RISE = LIMITS.max_speed / LIMITS.max_acceleration
GOAL = Goal(Stationary((5.0, 0.0)), 0.3)
STATE = State((0.0, 0.0), (0.8, 0.0))
AHEAD, SINGLE = (
    Navigator(slalom.method(name).with_foresight("observed"), Disc(RADIUS), LIMITS, period=0.1, margin=MARGIN)
    for name in ("nao_ahead", "nao")
)
ROBOT = LookAhead(AHEAD, time_horizon=12.0)


def crowd(seed: int) -> list[Obstacle]:
    """Walkers across the way, whose speeds vary, as far as they have been observed."""
    rng = np.random.default_rng(seed)
    t, people = np.arange(0.0, NOW + 0.05, 0.1), []
    for k in range(24):
        speed, side = rng.uniform(0.5, 1.2), rng.choice([-1.0, 1.0])
        y = side * (rng.uniform(-4.0, 4.0) + speed * (t - NOW)) + rng.normal(0.0, 0.04, len(t)).cumsum()
        x = rng.uniform(1.2, 4.0) + rng.normal(0.0, 0.02, len(t)).cumsum()
        people.append(Obstacle(Disc(RADIUS), Sampled(t, np.stack([x, y], axis=1)), f"person {k}"))
    return [one for one in people if np.linalg.norm(one.trajectory.position(NOW)) > 0.6]


@cache
def decided(seed: int, robot: LookAhead | Navigator = ROBOT) -> Decision:
    return robot.decide(STATE, crowd(seed), GOAL, now=NOW)


@pytest.mark.parametrize("robot", [ROBOT, SINGLE], ids=["nao_ahead", "nao"])
@pytest.mark.parametrize("seed", draws(range(24), 8))
def test_a_decision_keeps_clear_of_the_sets_that_it_states(robot, seed):
    """Those of 0.95 as long as they grow, and those of 0.8, if it is safe; of its probability if it is LIKELY."""
    found = decided(seed, robot)
    if not (found.outcome.safe or found.outcome is Outcome.LIKELY):
        return
    until = found.arrival if isinstance(found, SequenceDecision) else NOW + ROBOT.navigator.horizon
    times, people = np.linspace(NOW, min(until, NOW + ROBOT.navigator.horizon), 400), crowd(seed)
    path = found.manoeuvre.position(times)
    for (ahead,) in futures(people, FromModels(), NOW, range(len(people)), Reaction(LIMITS, 0.1)):
        distance = np.linalg.norm(ahead.trajectory.position(times) - path, axis=1) - 2.0 * RADIUS
        grows = times <= NOW + ahead.uncertainty.until
        kept = [(0.95, grows), (0.8, times < np.inf)] if found.outcome.safe else [(found.probability, times < np.inf)]
        for share, then in kept:
            stated = with_share(ahead.uncertainty, share)
            assert (distance > stated.radius(times - NOW, 2) - 1e-6)[then].all()


@pytest.mark.parametrize("robot", [ROBOT, SINGLE], ids=["nao_ahead", "nao"])
@pytest.mark.parametrize(("gap", "probability"), [(3.0, 1.0), (0.8, 0.5), (0.3, 0.0)])
def test_a_robot_is_safe_only_where_the_whole_sets_leave_it_a_place(robot, gap, probability):
    """Ten walkers stand around it, as uneasy as they were so far."""
    rng, t, people = np.random.default_rng(0), np.arange(0.0, NOW + 0.05, 0.1), []
    for a in 2.0 * np.pi * np.arange(10) / 10:
        walk = rng.normal(0.0, 0.02, (len(t), 2)).cumsum(axis=0)
        place = (2.0 * RADIUS + gap) * np.array([np.cos(a), np.sin(a)])
        people.append(Obstacle(Disc(RADIUS), Sampled(t, walk - walk[-1] + place)))
    found = robot.decide(State((0.0, 0.0), (0.0, 0.0)), people, GOAL, now=NOW)
    assert found.probability == probability


@pytest.mark.parametrize("error", [BoundedError(0.0, 0.2), BoundedError(0.1, 0.5), BoundedError(0.0, 9.0)])
@pytest.mark.parametrize("delay", [0.0, 0.15])
def test_a_robot_reacts_when_it_is_out_of_the_set_or_stands(error, delay):
    """It has moved by the radius, and a period before it had not; else it has braked from its maximum speed."""
    period, limits = 0.1, Limits(1.5, 2.0)
    until = limits.time_to_react(error, period, delay, 2)
    moved = [0.5 * limits.max_acceleration * max(t - delay - period, 0.0) ** 2 for t in (until, until - period)]
    stands = until >= delay + period + limits.max_speed / limits.braking - 1e-9
    assert moved[0] >= error.radius(until, 2) or stands
    assert moved[1] < error.radius(until - period, 2)
    assert until <= delay + 2.0 * period + limits.max_speed / limits.braking


def test_a_set_grows_until_the_robot_reacts_and_then_moves_on():
    """Also one that was given: it is no estimate of the forecast, but a later decision corrects it too."""
    people = crowd(0)
    given = [Obstacle(one.shape, one.trajectory, uncertainty=BoundedError(0.0, 0.3)) for one in people]
    rule, every = FromModels(), range(len(people))
    for some in (people, given):
        bounded = futures(some, rule, NOW, every, Reaction(LIMITS, 0.1))
        for one, ((ahead,), error) in zip(
            some, zip(bounded, rule.predictions([o.trajectory for o in some], NOW, RISE))
        ):
            free = one.uncertainty or error.error
            less = free if one.uncertainty else replace(free, coverage=0.8)
            until = LIMITS.time_to_react(less, 0.1, 0.0, 2)
            early, late = np.linspace(0.0, until, 9), until + np.array([0.1, 1.0, 9.0])
            np.testing.assert_allclose(ahead.uncertainty.radius(early, 2), free.radius(early, 2))
            np.testing.assert_allclose(ahead.uncertainty.radius(late[:, None], 2), free.radius(until, 2))


@pytest.mark.parametrize("seed", draws(range(8), 3))
def test_a_decision_names_the_obstacle_that_it_most_likely_touches(seed):
    """The nearest set of 0.5 along the manoeuvre, at any of many times; the nearer, the more probable the contact."""
    found, people = decided(seed), crowd(seed)
    times = np.linspace(0.0, found.contact.seconds, 500)
    path, left = found.manoeuvre.position(NOW + times), {}
    for one, ((ahead,), error) in zip(people, FromModels().predictions([o.trajectory for o in people], NOW, RISE)):
        away = np.linalg.norm(ahead[1].position(NOW + times) - path, axis=1) - 2.0 * RADIUS
        left[one.name] = float((away - replace(error, coverage=0.5).radius(times, 2)).min())
    assert left[found.contact.obstacle] == pytest.approx(min(left.values()), abs=0.01)
    assert 0.0 < found.contact.probability < 1.0
    others = [one for one in people if one.name != found.contact.obstacle]
    alone = replace(found, inputs=found.inputs._replace(obstacles=tuple(others)))
    assert alone.contact.probability < found.contact.probability
    assert found.as_dict()["contact"] == found.contact._asdict()
    assert found.contact.obstacle in " ".join(explanation(found)["sentences"])


@pytest.mark.parametrize(
    "error",
    [GaussianError(0.05, 0.1), KalmanError(0.05, 0.1, probability=0.1), Adjusted(GaussianError(0.05, 0.1))],
    ids=["gaussian", "kalman", "aged"],
)
def test_errors_of_observed_tracks_give_the_probability_of_a_contact_too(error):
    """From the set of 0.5, whose radius is the median of the distances of a Gaussian; not from what is bounded."""
    places, velocities = [(2.0, 1.5), (3.0, -2.0)], [(0.0, -0.5), (0.0, 0.4)]
    robot = replace(SINGLE, method=slalom.method("nao"))
    for stated in (error, Adjusted(error, until=0.5)):
        tracks = slalom.Tracks(places, velocities, RADIUS, NOW, ids=("a", "b"), uncertainty=stated)
        found = robot.decide(STATE, tracks, GOAL, now=NOW)
        times = np.linspace(0.0, found.contact.seconds, 500)
        path, left = found.manoeuvre.position(NOW + times), {}
        for name, place, velocity in zip("ab", np.array(places), np.array(velocities), strict=True):
            away = np.linalg.norm(place + times[:, None] * velocity - path, axis=1) - 2.0 * RADIUS
            left[name] = (away - replace(GaussianError(0.05, 0.1), probability=0.5).radius(times, 2)).min()
        if not isinstance(error, KalmanError):
            assert left[found.contact.obstacle] == min(left.values())
        assert 0.0 < found.contact.probability < 1.0
    bounded = slalom.Tracks(places, velocities, RADIUS, NOW, uncertainty=BoundedError(0.1))
    assert robot.decide(STATE, bounded, GOAL, now=NOW).contact is None


@pytest.mark.parametrize("confidence", [0.5, 0.9])
def test_a_robot_takes_calibrated_errors_as_sets(confidence):
    """Also of a confidence that is none of the usual shares: those below it count where it leaves no arrival."""
    calibration = slalom.Calibration(confidence)
    for k in range(40):
        calibration.observe(slalom.Tracks([(0.1 * k, np.sin(k))], [(1.0, np.cos(k))], RADIUS, 0.1 * k))
    given = [replace(one, uncertainty=calibration.error) for one in crowd(0)]
    found = ROBOT.decide(STATE, given, GOAL, now=NOW)
    assert found.probability in (0.0, 0.5, 0.8, confidence, 1.0)
    assert found.contact is not None


def test_no_contact_is_stated_where_futures_are_known():
    robot = replace(ROBOT, navigator=replace(ROBOT.navigator, method=slalom.method("nao_ahead")))
    assert robot.decide(STATE, crowd(0), GOAL, now=NOW - 0.5).contact is None
