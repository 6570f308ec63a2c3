"""How much of an estimated uncertainty a robot that looks ahead keeps clear of, and what it pays for it."""

from functools import cache

import numpy as np
import pytest
from draws import draws

import slalom
from slalom import Decision, Disc, Goal, Limits, LookAhead, Navigator, Obstacle, Outcome, Sampled, State, Stationary
from slalom.lookahead import navigator
from slalom.lookahead.navigator import SOONER_RISES, SOONER_SHARE, WIDER_RISES, WIDER_SHARE, SequenceDecision

NOW, RADIUS, MARGIN = 3.0, 0.25, 0.1
LIMITS = Limits(1.5, 1.5)
RISE = LIMITS.max_speed / LIMITS.max_acceleration
GOAL = Goal(Stationary((5.0, 0.0)), 0.3)
STATE = State((0.0, 0.0), (0.8, 0.0))
ROBOT = LookAhead(
    Navigator(slalom.method("nao_ahead").with_foresight("observed"), Disc(RADIUS), LIMITS, period=0.1, margin=MARGIN),
    time_horizon=12.0,
)


def crowd(seed: int) -> list[Obstacle]:
    """Walkers across the way, whose speeds vary, as far as they have been observed."""
    rng = np.random.default_rng(seed)
    t, people = np.arange(0.0, NOW + 0.05, 0.1), []
    for k in range(14):
        speed, side = rng.uniform(0.5, 1.2), rng.choice([-1.0, 1.0])
        y = side * (rng.uniform(-4.0, 4.0) + speed * (t - NOW)) + rng.normal(0.0, 0.04, len(t)).cumsum()
        x = rng.uniform(1.2, 4.0) + rng.normal(0.0, 0.02, len(t)).cumsum()
        people.append(Obstacle(Disc(RADIUS), Sampled(t, np.stack([x, y], axis=1)), f"person {k}"))
    return [one for one in people if np.linalg.norm(one.trajectory.position(NOW)) > 1.0]


@cache
def decided(seed: int) -> Decision:
    return ROBOT.decide(STATE, crowd(seed), GOAL, now=NOW)


def arrival(decision: Decision) -> float:
    return decision.arrival if isinstance(decision, SequenceDecision) else np.inf


def decided_without(seed: int, rules: dict[str, float], monkeypatch: pytest.MonkeyPatch) -> Decision:
    """The decision with other values of these constants."""
    for name, value in rules.items():
        monkeypatch.setattr(navigator, name, value)
    return ROBOT.decide(STATE, crowd(seed), GOAL, now=NOW)


def assert_same(one: Decision, other: Decision) -> None:
    assert one.outcome is other.outcome
    assert arrival(one) == arrival(other)
    np.testing.assert_array_equal(one.manoeuvre.control, other.manoeuvre.control)


@pytest.mark.parametrize("seed", draws(range(24), 8))
def test_less_of_the_uncertainty_brings_the_arrival_forward(seed, monkeypatch):
    """By SOONER_RISES or more; else the decision is the one without this rule."""
    found = decided_without(seed, {"WIDER_RISES": -np.inf}, monkeypatch)
    patient = decided_without(seed, {"SOONER_SHARE": 1.0}, monkeypatch)
    if isinstance(found, SequenceDecision) and found.doubt == SOONER_SHARE:
        assert found.outcome is Outcome.SQUEEZED
        assert arrival(found) <= arrival(patient) - SOONER_RISES * RISE
    else:
        assert_same(found, patient)


@pytest.mark.parametrize("seed", draws(range(24), 8))
def test_more_than_the_uncertainty_costs_little_time(seed, monkeypatch):
    """WIDER_RISES or less; else the decision is the one without this rule."""
    found = decided(seed)
    narrow = decided_without(seed, {"WIDER_RISES": -np.inf}, monkeypatch)
    if isinstance(found, SequenceDecision) and found.doubt == WIDER_SHARE:
        assert found.outcome in (Outcome.CLEAR, Outcome.CONSTRAINED)
        assert arrival(found) <= arrival(narrow) + WIDER_RISES * RISE
    else:
        assert_same(found, narrow)


@pytest.mark.parametrize("seed", draws(range(24), 8))
def test_a_sequence_keeps_its_share_of_the_uncertainty(seed):
    """At sampled times; how much of the margin it keeps depends on the distances now."""
    found = decided(seed)
    if not isinstance(found, SequenceDecision) or not np.isfinite(found.arrival):
        return
    times = np.linspace(NOW, found.arrival, 400)
    path = found.manoeuvre.position(times)
    tracks = [one.trajectory for one in crowd(seed)]
    for futures in ROBOT.navigator.method.forecast.predictions(tracks, NOW, RISE):
        ((_, ahead),) = futures.each
        distance = np.linalg.norm(ahead.position(times) - path, axis=1)
        assert (distance > 2.0 * RADIUS + found.doubt * futures.error.radius(times - NOW, 2) - 1e-6).all()


def test_these_crowds_have_all():
    shares = {one.doubt for one in map(decided, range(24)) if isinstance(one, SequenceDecision)}
    assert {1.0, SOONER_SHARE, WIDER_SHARE} <= shares
