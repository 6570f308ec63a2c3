"""Radii of predictions that hold the promised share of the errors."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from slalom import AtConstantTurn, AtConstantVelocity, BoundedError, Calibration, ConstantVelocity, Tracks
from slalom.model.uncertainty import COVERAGES, Covering, set_of

RADII = st.lists(st.floats(0.0, 50.0), min_size=2, max_size=6)


def walked(calibration: Calibration, rng: np.random.Generator, steps: int, noise: float, drift: float = 0.0) -> None:
    """Observe 20 obstacles whose velocities change at random in each step, by `noise` [m/s], growing by `drift`."""
    places, velocities = rng.uniform(-9.0, 9.0, (20, 2)), rng.normal(size=(20, 2))
    for k in range(steps):
        calibration.observe(Tracks(places, velocities, 0.3, 0.25 * k))
        velocities = velocities + (noise + drift * k) * rng.normal(size=(20, 2))
        places = places + 0.25 * velocities


@pytest.mark.parametrize("confidence", [0.8, 0.9, 0.95, 0.99])
def test_the_promised_share_of_errors_is_held(confidence: float) -> None:
    calibration = Calibration(confidence, (0.25, 0.5, 1.0))
    walked(calibration, np.random.default_rng(1), 200, 0.1)
    for lead in calibration.coverage:
        assert lead.promised == confidence
        assert lead.errors > 3000
        assert lead.measured == pytest.approx(confidence, abs=0.015)


def test_the_radius_follows_errors_that_grow() -> None:
    """Also where old errors say less than the new ones."""
    calibration = Calibration(0.9, (0.5,))
    walked(calibration, np.random.default_rng(2), 400, 0.02, drift=0.002)
    assert calibration.coverage[0].measured == pytest.approx(0.9, abs=0.02)


def test_the_radius_is_the_quantile_of_normal_errors() -> None:
    """The change of velocity n is normal in each axis, so that its length is below s sqrt(-2 log(1 - p)) in p cases."""
    calibration = Calibration(0.9, (0.25,))
    walked(calibration, np.random.default_rng(3), 300, 0.1)
    expected = 0.25 * 0.1 * np.sqrt(-2.0 * np.log(0.1))
    # Positions of an observed track are predicted with the velocity of the step, which changes at its beginning.
    assert calibration.radii()[0] == pytest.approx(expected, rel=0.1)
    for share in COVERAGES:
        held = set_of(calibration.error, share).radius(0.25, 2)
        assert held == pytest.approx(0.025 * np.sqrt(-2.0 * np.log(1.0 - share)), rel=0.1)


def test_predictions_of_ones_own_are_judged_in_place_of_the_forecast() -> None:
    calibration = Calibration(0.5, (0.5,), prior=BoundedError())
    for k in range(9):
        tracks = Tracks([(0.3 * k, 0.0)], [(0.0, 0.0)], 0.3, 0.25 * k)
        calibration.observe(tracks, [ConstantVelocity((0.3 * k, 0.0), (1.0, 0.0), 0.25 * k)])
    assert calibration.radii() == pytest.approx(0.1)


def test_the_prior_holds_until_errors_are_known() -> None:
    calibration = Calibration(0.9, (0.5, 1.0), prior=BoundedError(0.1, 0.4))
    assert calibration.radii() == pytest.approx([0.3, 0.5])
    calibration.observe(Tracks([(0.0, 0.0)], [(1.0, 0.0)], 0.3, 0.0))
    assert calibration.radii() == pytest.approx([0.3, 0.5])
    assert np.isnan(calibration.coverage[0].measured)
    # One error above the prior counts at once, one below does not lower it.
    calibration.observe(Tracks([(1.5, 0.9)], [(1.0, 0.0)], 0.3, 0.5))
    assert calibration.radii()[0] == pytest.approx(np.hypot(1.0, 0.9))
    # It bounds later times, too, as if the velocity went on to change.
    assert calibration.radii()[1] == pytest.approx(4.0 * np.hypot(1.0, 0.9))


def test_predictions_that_overlap_count_as_one_error() -> None:
    """Of one track no more errors are independent than prediction times have passed: the largest is the radius."""
    calibration, rng, place = Calibration(0.9, (2.0,)), np.random.default_rng(4), np.zeros(2)
    seen, predicted = [], []
    for k in range(160):
        velocity = rng.normal(size=2)
        calibration.observe(Tracks([place], [velocity], 0.3, 0.1 * k))
        seen.append(place)
        predicted.append(place + 2.0 * velocity)
        place = place + 0.1 * velocity
    errors = [float(np.linalg.norm(there - ahead)) for there, ahead in zip(seen[20:], predicted)]
    # 7 prediction times have passed, 9 are needed for a quantile of 0.9.
    assert calibration.radii()[0] == pytest.approx(max(errors))
    short = Calibration(0.9, (0.1,))
    for k in range(160):
        short.observe(Tracks([seen[k]], [(0.0, 0.0)], 0.3, 0.1 * k))
    steps = sorted(np.linalg.norm(np.diff(seen, axis=0), axis=1).tolist())
    assert short.radii()[0] < steps[-5]


def test_the_share_is_steady_for_long_predictions_of_many_tracks() -> None:
    """Errors are known 4 s late: a level that follows each of them would oscillate."""
    phases, calibration, held = np.random.default_rng(5).uniform(0.0, 6.0, 20), Calibration(0.9, (4.0,)), []
    for t in 0.2 * np.arange(220.0):
        angles = phases + 0.6 * t + 0.1 * np.sin(0.2 * t + 7.0 * phases)
        speeds = 9.0 * (0.6 + 0.02 * np.cos(0.2 * t + 7.0 * phases))
        places = 9.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        ahead = speeds[:, None] * np.stack([-np.sin(angles), np.cos(angles)], axis=1)
        calibration.observe(Tracks(places, ahead, 0.3, t))
        lead = calibration.coverage[0]
        held.append(lead.errors * lead.measured if lead.errors else 0.0)
    assert (np.diff(held[60::25]) / (25 * 20)).min() > 0.85


def test_positions_between_observations_are_interpolated_and_long_gaps_are_not() -> None:
    calibration = Calibration(0.9, (0.5,), max_gap=1.0)
    for t in (0.0, 0.4, 0.8):
        calibration.observe(Tracks([(2.0 * t, 0.0)], [(2.0, 0.0)], 0.3, t, ids=["a"]))
    assert calibration.coverage[0].errors == 1
    calibration.observe(Tracks([(9.0, 0.0)], [(2.0, 0.0)], 0.3, 3.0, ids=["a"]))
    assert calibration.coverage[0].errors == 1
    assert calibration.coverage[0].measured == 1.0


def test_a_track_that_was_out_of_sight_begins_anew() -> None:
    calibration = Calibration(0.9, (0.5,))
    calibration.observe(Tracks([(0.0, 0.0)], [(1.0, 0.0)], 0.3, 0.0, ids=["a"]))
    calibration.observe(Tracks([(5.0, 0.0)], [(1.0, 0.0)], 0.3, 0.25, ids=["b"]))
    calibration.observe(Tracks([(9.0, 9.0)], [(1.0, 0.0)], 0.3, 0.5, ids=["a"]))
    assert calibration.coverage[0].errors == 0


def test_a_forecast_that_is_right_has_no_error() -> None:
    right, wrong = Calibration(0.9, (1.0,), AtConstantTurn()), Calibration(0.9, (1.0,), AtConstantVelocity())
    for t in 0.1 * np.arange(200):
        place, velocity = 4.0 * np.array([np.cos(t), np.sin(t)]), 4.0 * np.array([-np.sin(t), np.cos(t)])
        tracks = Tracks([place], [velocity], 0.3, float(t), accelerations=[-place])
        right.observe(tracks)
        wrong.observe(tracks)
    # Between observations the obstacle is taken to move straight: 0.1 s of the circle are off by 5 mm.
    assert right.radii()[0] < 0.01
    assert wrong.radii()[0] == pytest.approx(4.0 * np.hypot(1.0 - np.sin(1.0), np.cos(1.0) - 1.0), rel=0.3)


@given(radii=RADII)
def test_the_error_holds_all_radii_and_is_convex(radii: list[float]) -> None:
    """So that linear interpolation between any two times is an upper bound."""
    times = 0.25 * np.arange(1, len(radii) + 1)
    error = Covering.of(0.9, (0.9,), times, np.maximum.accumulate(radii)[None])
    found = error.radius(times, 2)
    assert np.all(found >= np.array(radii) - 1e-9)
    assert found[0] == pytest.approx(radii[0])
    fine = error.radius(np.linspace(0.0, 3.0, 61), 2)
    assert (np.diff(fine, 2) >= -1e-9).all()
    assert (np.diff(fine) >= -1e-9).all()
