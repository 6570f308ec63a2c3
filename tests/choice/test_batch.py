"""Many choices at once are the choices one by one, to the bit."""

import numpy as np
import pytest

from slalom import (
    AccelerateThenCoast,
    BoundedError,
    Circular,
    ConstantVelocity,
    ControlObstacle,
    Disc,
    Jerk,
    LaggedVelocity,
    Limits,
    Obstacle,
    ObstacleWindow,
    Rectangle,
    State,
    Status,
    Velocity,
    select,
    select_many,
)

LIMITS = Limits(6.0, 4.0)


def crowd(rng, count, shapes):
    """Obstacles on circles and straight lines, some of them unsure."""
    found = []
    for k in range(count):
        shape = shapes[k % len(shapes)]
        if k % 2:
            path = Circular(rng.uniform(-10, 10, 2), rng.uniform(3, 9), rng.uniform(-4, 4), rng.uniform(0, 6))
        else:
            path = ConstantVelocity(rng.uniform(-12, 12, 2), rng.uniform(-3, 3, 2))
        unsure = BoundedError(velocity=0.1) if k % 5 == 4 else None
        found.append(Obstacle(shape, path, heading="motion" if k % 3 == 1 else 0.0, uncertainty=unsure))
    return found


def one_by_one(preferred_controls, states, response, traffic, robot, margin):
    """The law."""
    return [
        select(
            preferred,
            LIMITS.admissible(response, state, traffic.horizon),
            ControlObstacle(response, state, traffic, robot, margin),
        )
        for preferred, state in zip(preferred_controls, states)
    ]


@pytest.mark.parametrize("response", [AccelerateThenCoast(1.0), Velocity(), LaggedVelocity(0.5), Jerk()])
@pytest.mark.parametrize("shapes", [(Disc(0.8),), (Disc(0.5), Rectangle(2.0, 1.0)), (Rectangle(2.0, 1.0), Disc(0.5))])
def test_many_are_one_by_one(response, shapes):
    """Whatever responds, with and without corners, overlapping or not; for any number of threads."""
    rng = np.random.default_rng(4)
    traffic = ObstacleWindow(crowd(rng, 9, shapes), 1.0, 4.0)
    states = [State(rng.uniform(-12, 12, 2), rng.uniform(-3, 3, 2), rng.uniform(-1, 1, 2)) for _ in range(24)]
    preferred = rng.uniform(-3, 3, (24, 2))
    choices = one_by_one(preferred, states, response, traffic, Disc(0.4), 0.1)
    for threads in (1, 3):
        found = select_many(preferred, states, response, LIMITS, traffic, Disc(0.4), margin=0.1, threads=threads)
        assert list(found.statuses) == [choice.status for choice in choices]
        assert list(found.safe) == [choice.safe for choice in choices]
        for control, choice in zip(found.controls, choices):
            assert np.isnan(control).all() if choice.control is None else (control == choice.control).all()
    assert {Status.CONSTRAINED, Status.OVERLAPPING} <= set(found.statuses)


def test_none_are_none():
    """No state, no choice."""
    found = select_many(np.empty((0, 2)), [], Velocity(), LIMITS, ObstacleWindow([], 0.0, 3.0), Disc(0.4))
    assert found.controls.shape == (0, 2)
    assert len(found.statuses) == 0


@pytest.mark.parametrize("columns", [2, 3])
def test_states_may_be_numbers(columns):
    """Position, velocity, and acceleration or none."""
    rng = np.random.default_rng(5)
    traffic, rows = ObstacleWindow(crowd(rng, 5, (Disc(0.8),)), 0.0, 4.0), rng.uniform(-3, 3, (6, columns, 2))
    preferred = rng.uniform(-3, 3, (6, 2))
    found = select_many(preferred, rows, Jerk(), LIMITS, traffic, Disc(0.4))
    expected = select_many(preferred, [State(*row) for row in rows], Jerk(), LIMITS, traffic, Disc(0.4))
    np.testing.assert_array_equal(found.controls, expected.controls)
    assert list(found.statuses) == list(expected.statuses)
