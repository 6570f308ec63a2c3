"""Distances of the origin to hulls of points (`geometry.convex`), and along paths (`hull_bounds`, `hull_contacts`)."""

import numpy as np
import pytest

from slalom.kernels.arrays import Hulls
from slalom.kernels.geometry.cubic import new_stack
from slalom.kernels.geometry.hulls import (
    MovingHull,
    distance_bound,
    hull_below,
    hull_distance,
    hull_first_below,
    least_along,
    order,
    put_separating,
    signed_distance,
)

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_the_distance_is_attained_by_the_direction(n: int) -> None:
    """From afar, near an edge by as little as rounding shows, and inside: no corner is nearer along it."""
    rng, kinds = np.random.default_rng(n), set[tuple[float, bool]]()
    for _ in range(400):
        corners = np.zeros((n, 3))
        corners[:, :2] = rng.uniform(-1.0, 1.0, (n, 2))
        count = order(corners, n) if n > 2 else n
        a, b = corners[0, :2], corners[1 % count, :2]
        across = np.array([b[1] - a[1], a[0] - b[0]]) if count > 1 else np.array([1.0, 0.0])
        gap = rng.choice([1.0, 1e-3, 1e-8, 1e-10, 1e-12, -1e-3])
        position = a + rng.uniform(0.1, 0.9) * (b - a) + gap * across / np.linalg.norm(across)
        corners[:, :2] -= position
        distance, *direction = signed_distance(corners, count)
        kinds.add((gap, distance > 0.0))
        assert np.linalg.norm(direction) == pytest.approx(1.0)
        assert (corners[:count] @ direction).min() == pytest.approx(distance, rel=1e-3, abs=1e-15)
        if count > 2 and gap > 0.0:
            assert distance == pytest.approx(gap, rel=1e-3)
    assert len(kinds) >= 6


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.1])
@pytest.mark.parametrize("gap", [1e-7, 1e-9, 1e-10, 1e-12, 0.0])
def test_what_slides_along_a_hull_is_told_at_once(gap: float, angle: float) -> None:
    """It was cut into as many pieces as there are numbers. Nothing is found that is not there, nor deeper missed."""
    corners = np.zeros((4, 5))
    corners[:, :2] = turned(SQUARE, angle)
    hulls = Hulls(np.zeros(1, np.int64), np.empty((4, 2, 0)), corners, np.array([0, 4]), np.zeros(1, np.bool_))
    stack, q, normal = new_stack(), np.zeros((20, 3)), turned(np.array([[0.0, 1.0]]), angle)[0]
    along = turned(np.array([[1.0, 0.0]]), angle)[0]
    for depth, met in ((0.0, False), (1e-6, True)):
        course = np.zeros((4, 5))
        for k, (x, y) in enumerate(((-0.8, 0.0), (-0.3, -0.5), (0.3, -0.5), (0.8, 0.0))):
            # The origin of the hull, as seen by the robot, that comes nearer by a share of `depth` and leaves again.
            course[k, :2] = -x * along - (1.0 + gap + 2.0 * y * (depth + gap)) * normal
        course[:, 3] = 1.0
        moving = MovingHull(course, hulls, 0, 0.0, 0.0)
        first = hull_first_below(moving, stack, q, 1e-9)
        some, _ = hull_below(moving, stack, q)
        # On the very edge rounding decides.
        assert (gap == depth == 0.0) or (first >= 0.0) == met == (some >= 0.0)


def random_hull(rng: np.random.Generator, n: int, d: int) -> MovingHull:
    """A hull of n corners in dimension d near the origin, which moves, grows, and turns if it is in the plane."""
    corners, course = np.zeros((n, 5)), rng.normal(size=(4, 5))
    if n < 3:
        corners[:, :d] = rng.normal(size=(n, d))
    else:
        angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, n))
        corners[:, 3:] = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    course[:, 2] *= d == 3
    turns = np.cumsum([rng.uniform(0.0, 6.0), *rng.uniform(0.0, 0.5, 3)])
    course[:, 3], course[:, 4] = np.cos(turns), np.sin(turns)
    hulls = Hulls(np.zeros(1, np.int64), np.empty((4, 2, 0)), corners, np.array([0, n]), np.zeros(1, np.bool_))
    return MovingHull(course, hulls, 0, float(rng.choice([-0.2, 0.0, 0.3])), float(rng.choice([-0.2, 0.0, 0.2])))


@pytest.mark.parametrize(("n", "d"), [(1, 2), (2, 2), (5, 2), (1, 3), (2, 3)])
def test_bounds_along_turning_directions_hold_and_close_up(n: int, d: int) -> None:
    """Below every distance of the span, for any two directions; for the best ones of a short span nearly equal."""
    rng, q, separating, gaps = np.random.default_rng(n + d), np.zeros((4 * n + 4, 3)), np.zeros(7), []
    for _ in range(300):
        moving, a, width = random_hull(rng, n, d), rng.uniform(0.0, 0.9), float(10.0 ** rng.uniform(-3.0, -1.0))
        least = min(hull_distance(moving, x, q)[0] for x in np.linspace(a, a + width, 21))
        best = hull_distance(moving, a, q), hull_distance(moving, a + width, q)
        others = [(0.0, *v / np.linalg.norm(v)) for v in rng.normal(size=(2, 3)) * [1.0, 1.0, d == 3]]
        for early, late in (best, others, (best[0], others[0]), (best[0], best[0])):
            assert distance_bound(moving, a, a + width, early, late) <= least + 1e-12
        if width < 3e-3 and least > 0.1:
            gaps.append(least - distance_bound(moving, a, a + width, *best))
        gain, u, other = np.array([0.0, 0.1, 0.4, 1.0]), rng.normal(size=3), rng.normal(size=3)
        put_separating(moving, gain, np.empty((4, 0)), u, best[0], separating)
        course = moving.path.copy()
        course[:, :3] -= gain[:, None] * (other - u)
        moved = moving._replace(path=course)
        nearest = min(hull_distance(moved, x, q)[0] for x in (0.0, 0.3, 1.0))
        assert least_along(separating, gain, np.empty((4, 0)), other) <= nearest + 1e-12
    assert max(gaps) < 1e-4
    assert len(gaps) > 10
