"""Laws of forecasts from several motion models, and of decisions with less of their uncertainty."""

import numpy as np
import pytest

from slalom import (
    BoundedError,
    ConstantVelocity,
    Disc,
    FromModels,
    Goal,
    InvalidInput,
    Limits,
    LookAhead,
    Navigator,
    Obstacle,
    Sampled,
    State,
    Stationary,
    method,
)
from slalom.forecast.from_models import MODEL_LEAD
from slalom.obstacle.window import predicted

STEP = 0.1
STAMPS = np.arange(0.0, 12.0, STEP)
AHEAD = np.linspace(0.0, 4.0, 21)
each_dimension = pytest.mark.parametrize("d", [2, 3])


def wandering(seed: int, d: int = 2) -> np.ndarray:
    """Positions at STAMPS of a track that accelerates at random."""
    rng = np.random.default_rng(seed)
    velocities = rng.normal(size=d) + np.cumsum(rng.normal(0.0, 0.1, (len(STAMPS), d)), axis=0)
    return np.asarray(np.cumsum(STEP * velocities, axis=0))


def linear(positions: np.ndarray, slower: float = 1.0) -> Sampled:
    return Sampled(slower * STAMPS, positions, "linear")


@each_dimension
@pytest.mark.parametrize("age", [0.0, 0.03, 0.1, 0.25, 0.7, 1.0, 3.0, 8.0])
def test_later_rows_do_not_matter(age: float, d: int) -> None:
    """Two tracks that part after the newest row are predicted alike, bit by bit; a new one has no velocity yet."""
    row = int(np.ceil(age / STEP - 1e-9))
    positions = wandering(1, d)
    one = positions.copy()
    one[row + 1 :] = positions[row] - 3.0 * (positions[row + 1 :] - positions[row])
    now = float(STAMPS[row])
    forecasts = [FromModels().with_error(linear(p), now, 1.0) for p in (positions, one)]
    np.testing.assert_array_equal(*[trajectory.position(now + AHEAD) for trajectory, _ in forecasts])
    assert forecasts[0][1] == forecasts[1][1]
    assert np.any(forecasts[0][0].velocity(now)) == (row > 0)


@pytest.mark.parametrize("seed", range(3))
def test_all_times_follow_the_sampling(seed: int) -> None:
    """A track that is observed twenty times as slowly is predicted at the same places, twenty times as late."""
    positions, now, slower = wandering(seed), 6.0, 20.0
    fast, small = FromModels().with_error(linear(positions), now)
    slow, large = FromModels().with_error(linear(positions, slower), slower * now)
    np.testing.assert_allclose(slow.position(slower * (now + AHEAD)), fast.position(now + AHEAD), atol=1e-8)
    assert large.velocity == pytest.approx(small.velocity / slower, rel=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_a_moved_and_turned_track_is_predicted_moved_and_turned(seed: int) -> None:
    positions, now = wandering(seed), 6.0
    turn, shift = np.array([[0.6, -0.8], [0.8, 0.6]]), np.array([300.0, -70.0])
    there = FromModels()(linear(positions), now).position(now + AHEAD)
    moved = FromModels()(linear(positions @ turn.T + shift), now).position(now + AHEAD)
    np.testing.assert_allclose(moved, there @ turn.T + shift, atol=1e-8)


@each_dimension
def test_constant_velocity_is_predicted_exactly(d: int) -> None:
    """From the second row on, also between rows."""
    velocity = np.arange(1.0, d + 1.0)
    track = linear(STAMPS[:, None] * velocity)
    for now in (0.02, 0.1, 0.45, 2.0, 9.03):
        expected = (now + AHEAD)[:, None] * velocity
        np.testing.assert_allclose(FromModels()(track, now).position(now + AHEAD), expected, atol=1e-8)


@pytest.mark.parametrize("kind", ["turn", "acceleration", "late turn"])
def test_the_model_that_fits_is_found(kind: str) -> None:
    """Constant turn and acceleration, and a turn after a straight: in half the error of a constant velocity.

    A third of this time ahead the predicted acceleration lasts.
    """
    turned = 0.5 * np.maximum(STAMPS - (4.0 if kind == "late turn" else 0.0), 0.0)
    headings = np.stack([np.cos(turned), np.sin(turned)], axis=1)
    speeds = 5.0 + (1.0 if kind == "acceleration" else 0.0) * STAMPS
    if kind == "acceleration":
        headings = np.tile([1.0, 0.0], (len(STAMPS), 1))
    track, now, later = linear(np.cumsum(STEP * speeds[:, None] * headings, axis=0)), 8.0, 9.5
    straight = ConstantVelocity(track.position(now), (track.position(now) - track.position(now - STEP)) / STEP, now)
    errors = [
        np.linalg.norm(motion.position(later) - track.position(later))
        for motion in (FromModels()(track, now), straight)
    ]
    assert errors[0] < 0.5 * errors[1]


def test_the_radius_is_a_share_of_past_errors() -> None:
    """Noise raises it; it grows with the rise of the robot beyond the lead, and with the shares."""
    smooth = STAMPS[:, None] * np.array([1.0, 0.5])
    noisy = smooth + np.random.default_rng(0).normal(0.0, 0.1, smooth.shape)
    small, large = (FromModels().with_error(linear(p), 8.0)[1].velocity for p in (smooth, noisy))
    assert 0.0 < small < 0.2 * large
    lead = MODEL_LEAD * STEP
    errors = [FromModels().with_error(linear(noisy), 8.0, rise)[1].velocity for rise in (0.5 * lead, lead, 3.0 * lead)]
    np.testing.assert_allclose(np.array(errors) / large, [1.0, 1.0, 3.0])
    twice = FromModels(share=0.2, offset=1.0).with_error(linear(noisy), 8.0)[1]
    assert twice.velocity == pytest.approx(2.0 * large)
    assert twice.position == pytest.approx(2.0 * FromModels().with_error(linear(noisy), 8.0)[1].position)
    own = Obstacle(Disc(0.3), linear(noisy), uncertainty=BoundedError(0.1))
    assert predicted(own, FromModels(), 8.0).uncertainty is own.uncertainty
    with pytest.raises(InvalidInput, match="share"):
        FromModels(-0.1)


def test_less_of_an_estimated_uncertainty_counts_where_it_leaves_no_safe_decision() -> None:
    """Among discs at rest whose radii grow, a robot that observes rests; with known trajectories it sees no way."""
    angles = 2.0 * np.pi * np.arange(8) / 8
    discs = [
        Obstacle(Disc(0.5), Stationary((1.5 * np.cos(a), 1.5 * np.sin(a))), uncertainty=BoundedError(velocity=1.0))
        for a in angles
    ]
    goal, state = Goal(Stationary((9.0, 0.0)), 0.3), State((0.0, 0.0), (0.0, 0.0))
    found = {}
    for name in ("nao_ahead@observed", "nao_ahead"):
        robot = Navigator(method(name), Disc(0.3), Limits(1.0, 2.0), period=0.1, horizon=3.0, margin=0.1)
        found[name] = LookAhead(robot, time_horizon=10.0).decide(state, discs, goal)
    assert found["nao_ahead@observed"].outcome.safe
    assert not found["nao_ahead"].outcome.safe
    path = found["nao_ahead@observed"].manoeuvre.position(np.linspace(0.0, 3.0, 61))
    gaps = [np.linalg.norm(path - disc.trajectory.initial_position, axis=1).min() for disc in discs]
    assert min(gaps) >= 0.8
