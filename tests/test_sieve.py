"""The sieve of robots that may matter: none is lost, and few come through for nothing."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from slalom.kernels.guidance.early_rejection import (
    listed,
    may_encounter,
    may_enter_circle,
    room_for,
    structure_of_arrays,
    to_single_precision,
)

SIZES = st.integers(1, 70)


def crowd(n, size, seed, far=0.0, slow=(0.2, 0.2, 0.3, 0.1, 0.1, 0.1)):
    """n robots in a square of `size` [m] about (far, -far), some at rest, some gone: rows, the origin, the sieve."""
    rng = np.random.default_rng(seed)
    position, velocity = np.zeros((n, 3)), np.zeros((n, 3))
    position[:, :2] = rng.uniform(-0.5 * size, 0.5 * size, (n, 2)) + np.array([far, -far])
    # Some rest, and some by rounding only.
    velocity[:, :2] = rng.uniform(-2.0, 2.0, (n, 2)) * rng.choice([1.0, 1.0, 1.0, 0.0, 1e-17, 1e-25], (n, 1), p=slow)
    present = rng.random(n) < 0.9
    rows = structure_of_arrays(position, velocity, rng.uniform(0.1, 2.0, n), present)
    coarse, maybe, words, which = room_for(n)
    off = to_single_precision(rows, far, -far, coarse)
    return rows, present, (coarse, off, maybe), lambda: list(which[: listed(maybe, words, which)])


def those_met(rows, present, place, velocity, reach, end, closer):
    """The numbers of those that come near, by a formula that is neither that of the kernel nor as quick."""
    found = []
    for k in np.flatnonzero(present):
        r, m = rows[:2, k] - place, rows[2:4, k] - velocity
        when = -(r @ m) / max(m @ m, 1e-9)
        if 0.0 < when < end and np.linalg.norm(r + when * m) < closer * (reach + rows[4, k]):
            found.append(k)
    return found


def those_that_join(rows, present, ring):
    found = []
    for k in np.flatnonzero(present):
        to, size = ring[:2] - rows[:2, k], ring[2] + 2.0 * rows[4, k]
        speed = max(float(np.linalg.norm(rows[2:4, k])), 1e-9)
        along, across = to @ rows[2:4, k] / speed, abs(rows[2, k] * to[1] - rows[3, k] * to[0]) / speed
        if (along > 0.0 and across < size) or np.linalg.norm(to) < size:
            found.append(k)
    return found


@given(SIZES, st.floats(1.0, 3000.0), st.integers(0, 10**6), st.floats(1.0, 5.0), st.floats(0.1, 2000.0))
def test_all_that_come_near_come_through(n, size, seed, closer, end):
    rows, present, sieve, found = crowd(n, size, seed)
    place, velocity, reach = rows[:2, 0].copy(), np.array([1.0, -0.5]), rows[4, -1] if present[-1] else 0.3
    may_encounter(*place, *velocity, reach, end, closer, *sieve)
    assert set(those_met(rows, present, place, velocity, reach, end, closer)) <= set(found())
    assert present[found()].all()


@given(SIZES, st.floats(1.0, 3000.0), st.integers(0, 10**6), st.floats(0.0, 30.0))
def test_all_that_join_a_ring_come_through(n, size, seed, radius):
    rows, present, sieve, found = crowd(n, size, seed)
    ring = np.array([0.3 * size, -0.1 * size, radius, 1.0])
    may_enter_circle(ring, 0.0, 0.0, sieve[0], sieve[1][0], sieve[2])
    assert set(those_that_join(rows, present, ring)) <= set(found())
    assert present[found()].all()


@pytest.mark.parametrize("far", [0.0, 1e5])
def test_few_come_through_for_nothing(far):
    """Of 3000 robots on 1 km^2, and as far from the origin of the plane as maps are."""
    rows, present, sieve, found = crowd(3000, 1000.0, 1, far, (0.8, 0.0, 0.0, 0.2, 0.0, 0.0))
    own = np.array([far, -far])
    for k in range(0, 3000, 100):
        place, velocity = rows[:2, k].copy(), np.array([1.2, 0.9])
        may_encounter(*(place - own), *velocity, 0.5, 300.0, 1.3, *sieve)
        assert len(found()) <= 1.05 * len(those_met(rows, present, place, velocity, 0.5, 300.0, 1.3)) + 2
        ring = np.array([*place, 10.0, 1.0])
        may_enter_circle(ring, far, -far, sieve[0], sieve[1][0], sieve[2])
        assert len(found()) <= 1.05 * len(those_that_join(rows, present, ring)) + 2
