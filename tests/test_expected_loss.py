"""Laws of the robot that weighs time against closeness."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from slalom import (
    BoundedError,
    ConstantVelocity,
    Disc,
    ExpectedLoss,
    Goal,
    InvalidInput,
    Limits,
    LookAhead,
    Navigator,
    Obstacle,
    State,
    Stationary,
    Tracks,
    method,
)

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
    robot = ExpectedLoss(ahead(), margins, loss=8.0)
    single = [ahead(margin).decide(START, others, GOAL) for margin in margins]
    costs = [robot.cost(decision, others, GOAL, 0.0) for decision in single]
    np.testing.assert_array_equal(motion(robot.decide(START, others, GOAL)), motion(single[int(np.argmin(costs))]))


def test_the_expected_contacts_are_those_of_the_definition() -> None:
    """Sums of exponentials of true gaps; obstacles that overlap count as one contact each."""
    rng = np.random.default_rng(5)
    others, times, places = crowd(5), np.array([0.2, 0.7, 1.0]), rng.uniform(0.0, 6.0, (3, 2))
    robot = ExpectedLoss(ahead(), spread=BoundedError(0.2, 0.1))
    for t, place, found in zip(times, places, robot.contacts(places, others, times, 0.0), strict=True):
        there = np.array([other.trajectory.position(t) for other in others])
        gaps = cdist(place[None], there)[0] - 0.6
        assert found == pytest.approx(np.exp(-np.clip(gaps, 0.0, None) / (0.2 + 0.1 * t)).sum(), rel=1e-12)


def test_a_higher_loss_keeps_more_distance() -> None:
    """Past a disc at rest beside the way, and never less far in time than the way of a lower loss."""
    post = [Obstacle(Disc(0.5), Stationary([4.5, 0.5]))]
    closest, arrivals = [], []
    for loss in (0.0, 200.0):
        decision = ExpectedLoss(ahead(), (0.0, 0.4, 0.8), loss).decide(State([3.0, 0.0], [1.0, 0.0]), post, GOAL)
        path = decision.manoeuvre.position(np.linspace(0.0, 4.0, 200))
        closest.append(np.linalg.norm(path - post[0].trajectory.initial_position, axis=1).min() - 0.8)
        arrivals.append(decision.arrival)
    assert closest[1] > closest[0] + 0.2
    assert arrivals[1] > arrivals[0]


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


def test_wrong_settings_are_refused() -> None:
    for settings, said in (
        ({"robot": None}, "robot: expected a LookAhead"),
        ({"margins": ()}, "margins: expected one or more, found none"),
        ({"margins": (0.1, -1.0)}, r"margins\[1\]: expected"),
        ({"loss": -1.0}, "loss: expected"),
        ({"spread": None}, "spread: expected an uncertainty"),
    ):
        with pytest.raises(InvalidInput, match=said):
            ExpectedLoss(**{"robot": ahead(), **settings})
