"""Laws of forecasts from several motion models, and of their sets."""

from dataclasses import replace

import numpy as np
import pytest

from slalom import (
    BoundedError,
    ConstantVelocity,
    Disc,
    FromModels,
    Goal,
    Limits,
    LookAhead,
    Navigator,
    Obstacle,
    Sampled,
    State,
    Stationary,
    method,
)
from slalom.forecast.from_models import ERROR_TIMES
from slalom.model.trajectory import Trajectory
from slalom.model.uncertainty import COVERAGES, Adjusted, Covering, Uncertainty, convex_radii
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


def with_error(track: Sampled, now: float) -> tuple[Trajectory, Uncertainty]:
    """The prediction of a track and its set."""
    ((_, mean),), error = FromModels().predictions([track], now)[0]
    return mean, error


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
    forecasts = [with_error(linear(p), now) for p in (positions, one)]
    np.testing.assert_array_equal(*[trajectory.position(now + AHEAD) for trajectory, _ in forecasts])
    assert forecasts[0][1] == forecasts[1][1]
    assert np.any(forecasts[0][0].velocity(now)) == (row > 0)


@pytest.mark.parametrize("seed", range(3))
def test_all_times_follow_the_sampling(seed: int) -> None:
    """A track that is observed twenty times as slowly is predicted at the same places, twenty times as late."""
    positions, now, slower = wandering(seed), 6.0, 20.0
    fast, small = with_error(linear(positions), now)
    slow, large = with_error(linear(positions, slower), slower * now)
    np.testing.assert_allclose(slow.position(slower * (now + AHEAD)), fast.position(now + AHEAD), atol=1e-8)
    np.testing.assert_allclose(large.radius(slower * AHEAD, 2), small.radius(AHEAD, 2), rtol=1e-6)


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


def test_sets_hold_the_share_of_errors_that_they_state() -> None:
    """Of walkers that turn and change speed at random, at four times, within 0.05; larger sets hold the smaller."""
    rng, rise, stamps = np.random.default_rng(5), 0.8, np.arange(0.0, 24.0, STEP)
    turns = rng.normal(0.0, 0.5, (40, len(stamps) // 20)).repeat(20, axis=1)
    speeds = 1.2 + rng.normal(0.0, 0.3, (40, len(stamps) // 12)).repeat(12, axis=1)
    courses = rng.uniform(0.0, 6.0, (40, 1)) + np.cumsum(STEP * turns, axis=1)
    steps = STEP * speeds[..., None] * np.stack([np.cos(courses), np.sin(courses)], axis=2)
    walkers = [Sampled(stamps, walk, "linear") for walk in np.cumsum(steps, axis=1) + rng.normal(0.0, 9.0, (40, 1, 2))]
    held = np.zeros((len(COVERAGES), len(ERROR_TIMES)))
    moments = np.arange(14.0, 22.0, 0.4)
    for now in moments.tolist():
        times = rise * np.array(ERROR_TIMES)
        for walker, found in zip(walkers, FromModels().predictions(walkers, now, rise), strict=True):
            away = np.linalg.norm(walker.position(now + times) - found.each[0][1].position(now + times), axis=1)
            assert isinstance(found.error, Covering)
            radii = [replace(found.error, coverage=share).radius(times, 2) for share in COVERAGES]
            assert (np.diff(radii, axis=0) >= 0.0).all()
            held += away <= radii
    np.testing.assert_allclose(held / len(walkers) / len(moments), np.outer(COVERAGES, np.ones(4)), atol=0.05)


def test_sets_follow_past_errors_and_the_own_uncertainty_of_an_obstacle_stays() -> None:
    smooth = STAMPS[:, None] * np.array([1.0, 0.5])
    noisy = smooth + np.random.default_rng(0).normal(0.0, 0.1, smooth.shape)
    small, large = (with_error(linear(p), 8.0)[1].radius(1.0, 2) for p in (smooth, noisy))
    assert 0.0 < small < 0.2 * large
    own = Obstacle(Disc(0.3), linear(noisy), uncertainty=BoundedError(0.1))
    assert predicted(own, FromModels(), 8.0).uncertainty is own.uncertainty


@pytest.mark.parametrize("seed", range(4))
def test_radii_of_sets_are_convex_and_do_not_fall(seed: int) -> None:
    """They are the least of these from the first given one on."""
    rng = np.random.default_rng(seed)
    times, given = np.array([0.25, 0.5, 1.0, 2.0]), np.sort(rng.uniform(0.0, 1.0, (3, 4)), axis=1)
    radii = convex_radii(times, given)
    slopes = np.diff(radii, axis=1) / np.diff(times)
    assert (radii >= given - 1e-12).all()
    assert (np.diff(slopes, axis=1) >= -1e-9).all()
    convex = (np.diff(np.diff(given, axis=1) / np.diff(times), axis=1) >= 0.0).all(axis=1)
    np.testing.assert_allclose(radii[convex], given[convex])
    curve = Adjusted(replace(Covering.of(0.8, COVERAGES, times, given), scale=2.0), until=1.5)
    fine = curve.radius(np.linspace(0.0, 1.5, 61), 2)
    assert (fine >= 0.0).all()
    assert (np.diff(fine, 2) >= -1e-9).all()
    assert (curve.radius(np.array([1.5, 9.0]), 2) == fine[-1]).all()
    np.testing.assert_allclose(curve.radius(times[:3], 2), 2.0 * radii[1, :3])


def test_an_uncertainty_that_grows_no_longer_than_a_robot_reacts_leaves_it_a_place() -> None:
    """Among discs at rest whose radii grow a robot that observes rests; one to which they are known sees no way."""
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
