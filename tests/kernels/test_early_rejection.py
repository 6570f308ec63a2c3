"""The early rejection of robots that cannot matter: it discards none that does, and passes few others."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from slalom.kernels.guidance.traffic_circle import CIRCLE_ARC, may_encounter, may_enter_circle, robot_rows

SIZES = st.integers(1, 70)


def crowd(n, size, seed, far=0.0, slow=(0.2, 0.2, 0.3, 0.1, 0.1, 0.1)):
    """Rows of n robots in a square of `size` [m] about the origin (far, -far), some at rest, some absent."""
    rng = np.random.default_rng(seed)
    position, velocity = np.zeros((n, 3)), np.zeros((n, 3))
    position[:, :2] = rng.uniform(-0.5 * size, 0.5 * size, (n, 2)) + np.array([far, -far])
    # Some are at rest, and some by rounding only.
    velocity[:, :2] = rng.uniform(-2.0, 2.0, (n, 2)) * rng.choice([1.0, 1.0, 1.0, 0.0, 1e-17, 1e-25], (n, 1), p=slow)
    present = rng.random(n) < 0.9
    return robot_rows(position, velocity, rng.uniform(0.1, 2.0, n), present), present


def encounters(rows, present, position, velocity, radius, end, closer):
    """The numbers of the robots that come near, by another formula than that of the kernel."""
    found = []
    for k in np.flatnonzero(present):
        r, m = rows.columns[:2, k] - position, rows.columns[2:4, k] - velocity
        when = -(r @ m) / max(m @ m, 1e-9)
        if 0.0 < when < end and np.linalg.norm(r + when * m) < closer * (radius + rows.columns[4, k]):
            found.append(k)
    return found


def entries(rows, present, circle, own):
    """The numbers of the robots on a circle or on their way into it, about `own` [m] away from its centre."""
    found = []
    for k in np.flatnonzero(present):
        x, y, vx, vy, radius = rows.columns[:5, k]
        to, size = circle[:2] - (x, y), circle[2] + 2.0 * radius
        speed = max(float(np.hypot(vx, vy)), 1e-9)
        along, across = (to[0] * vx + to[1] * vy) / speed, abs(vx * to[1] - vy * to[0]) / speed
        as_far = abs(np.linalg.norm(to) - own) <= CIRCLE_ARC * circle[2] + 2.0 * radius
        if as_far and ((along > 0.0 and across < size) or np.linalg.norm(to) < size):
            found.append(k)
    return found


@given(SIZES, st.floats(1.0, 3000.0), st.integers(0, 10**6), st.floats(1.0, 5.0), st.floats(0.1, 2000.0))
def test_no_robot_that_is_encountered_is_discarded(n, size, seed, closer, end):
    rows, present = crowd(n, size, seed)
    position, velocity = rows.columns[:2, 0].copy(), (1.0, -0.5)
    radius = rows.columns[4, -1] if present[-1] else 0.3
    found = rows.candidates[: may_encounter(position, velocity, radius, end, closer, rows)]
    assert set(encounters(rows, present, position, velocity, radius, end, closer)) <= set(found)
    assert present[found].all()


@given(SIZES, st.floats(1.0, 3000.0), st.integers(0, 10**6), st.floats(0.0, 30.0), st.floats(0.0, 1.0))
def test_no_robot_that_enters_a_circle_is_discarded(n, size, seed, radius, share):
    rows, present = crowd(n, size, seed)
    circle, own = np.array([0.3 * size, -0.1 * size, radius, 1.0]), share * size
    found = rows.candidates[: may_enter_circle(circle, own, rows)]
    assert set(entries(rows, present, circle, own)) <= set(found)
    assert present[found].all()


@pytest.mark.parametrize("far", [0.0, 1e5])
def test_few_others_pass(far):
    """Of 3000 robots on 1 km^2, and as far from the origin of the plane as maps are."""
    rows, present = crowd(3000, 1000.0, 1, far, (0.8, 0.0, 0.0, 0.2, 0.0, 0.0))
    for k in range(0, 3000, 300):
        position, velocity = rows.columns[:2, k].copy(), (1.2, 0.9)
        passed = may_encounter(position, velocity, 0.5, 300.0, 1.3, rows)
        assert passed <= 1.05 * len(encounters(rows, present, position, velocity, 0.5, 300.0, 1.3)) + 2
        circle = np.array([*position, 10.0, 1.0])
        for own in (15.0, 300.0):
            assert may_enter_circle(circle, own, rows) <= 1.05 * len(entries(rows, present, circle, own)) + 2
