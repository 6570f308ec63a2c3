"""What every decision does in one pass, against the same in operations on arrays; tables of responses, against maps."""

import numpy as np
import pytest

from slalom import (
    AccelerateThenBrake,
    AccelerateThenCoast,
    AccelerateThenStop,
    Acceleration,
    LaggedVelocity,
    State,
    Velocity,
    kernels,
)
from slalom.objective import _even_times, _geometric_times
from slalom.path import hermite
from slalom.response.time_invariant import TimeInvariant

RESPONSES = (
    Acceleration(),
    AccelerateThenCoast(1.0),
    AccelerateThenCoast(9.0),
    AccelerateThenStop(1.0, 0.4, 0.2),
    AccelerateThenBrake(1.0, 2.0),
    Velocity(),
    Velocity(0.3),
    LaggedVelocity(0.7),
)


@pytest.mark.parametrize("response", RESPONSES, ids=repr)
@pytest.mark.parametrize("dimension", [2, 3])
def test_tables_of_a_response_give_the_bits_of_its_maps(response: TimeInvariant, dimension: int) -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        state = State(*rng.normal(size=(3, dimension)))
        knots, drift, gain = response.pieces(state, 6.0, 120.0)
        assert np.array_equal(knots, response.knots(6.0, 120.0))
        place, speed = response.position(state, knots), response.velocity(state, knots)
        assert np.array_equal(drift, hermite(knots, place.drift, speed.drift).points)
        assert np.array_equal(gain, hermite(knots, place.gain[:, None], speed.gain[:, None]).points[..., 0])
        for t in (0.0, 0.5, 1.0, 4.0):
            for at_once, usual in (
                (response.velocity_at(state, t), response.velocity(state, t)),
                (response.acceleration_at(state, t), response.acceleration(state, t)),
            ):
                assert np.array_equal(at_once.drift, usual.drift)
                assert at_once.gain == usual.gain


@pytest.mark.parametrize("turning", [False, True])
@pytest.mark.parametrize("start", [-9.0, 0.0, 1.7, 30.0])
def test_pieces_within_a_window_are_those_that_overlap_it(start: float, turning: bool) -> None:
    rng = np.random.default_rng(1)
    body = np.repeat(np.arange(7), rng.integers(1, 12, 7))
    begins = rng.uniform(-3.0, 8.0, len(body))
    times = np.stack([begins, begins + rng.uniform(0.1, 2.0, len(body))], axis=1)
    columns = [times, rng.normal(size=(len(body), 4, 2)), *rng.normal(size=(2, len(body)))]
    turns = rng.normal(size=(len(body), 4, 2)) if turning else np.empty((0, 4, 2))
    *found, heads = kernels.pieces_within(*columns, turns, body, start, start + 4.0)
    keep = (times[:, 1] > start) & (times[:, 0] < start + 4.0)
    assert keep.any() == (start in (0.0, 1.7))
    wanted = [times[keep] - start, *(column[keep] for column in columns[1:]), turns[keep] if turning else turns]
    assert all(np.array_equal(a, b) for a, b in zip(found, [*wanted, body[keep]], strict=True))
    first = np.flatnonzero(np.diff(body[keep], prepend=-1))
    assert np.array_equal(heads, first[found[0][first, 0] <= 0.0])


@pytest.mark.parametrize("dimension", [2, 3])
def test_points_in_balls_are_within_every_radius(dimension: int) -> None:
    rng = np.random.default_rng(2)
    points, centers, radii = (
        rng.normal(size=(200, dimension)),
        rng.normal(size=(3, dimension)),
        np.array([2.0, 3.0, 2.5]),
    )
    far = np.linalg.norm(points[:, None] - centers, axis=2)
    inside = kernels.in_balls(points, centers, radii)
    assert np.array_equal(inside, (far <= radii).all(axis=1))
    assert inside.any()
    assert not inside.all()
    assert kernels.in_balls(points, centers[:0], radii[:0]).all()


def test_times_of_arrival_are_those_of_numpy() -> None:
    for last in np.random.default_rng(3).uniform(0.04, 60.0, 50):
        np.testing.assert_allclose(_geometric_times(last), np.geomspace(0.02, last, 64), rtol=1e-14)
        np.testing.assert_allclose(_even_times(0.02, last), np.linspace(0.02, last, 17), rtol=1e-14)
