"""Protocol of trajectories."""

from collections.abc import Callable
from math import comb
from typing import ClassVar, Final, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput, OutsideSpan
from slalom.base.tolerances import REST
from slalom.model.path import Path

FOREVER: Final = (-np.inf, np.inf)


@runtime_checkable
class Trajectory(Protocol):
    """Curve in the world frame over absolute time.

    Laws: `velocity` is the derivative of `position`, and `acceleration` that of `velocity`, except at `breaks`.
    `speed_bound` and `acceleration_bound` hold between breaks. `path` stays within its stated error. Times t may have
    any shape (...); results are (..., d).
    """

    @property
    def dimension(self) -> int:
        """2 or 3."""

    @property
    def span(self) -> tuple[float, float]:
        """First and last time [s] at which the obstacle exists; (-inf, inf) for obstacles that always exist."""

    def position(self, t: npt.ArrayLike) -> Array:
        """Position (..., d) [m]. Raises OutsideSpan outside `span`."""

    def velocity(self, t: npt.ArrayLike) -> Array:
        """Velocity (..., d) [m/s]; at a break, the value that follows it. Raises OutsideSpan."""

    def acceleration(self, t: npt.ArrayLike) -> Array:
        """Acceleration (..., d) [m/s^2]; at a break, the value that follows it. Raises OutsideSpan."""

    def breaks(self, start: float, end: float) -> Array:
        """Increasing times (k,) [s] strictly between start and end at which velocity or acceleration may jump."""

    def speed_bound(self, start: float, end: float) -> float:
        """Upper bound [m/s] of |velocity| from start to end [s]."""

    def acceleration_bound(self, start: float, end: float) -> float:
        """Upper bound [m/s^2] of |acceleration| between breaks from start to end [s]."""

    def path(self, start: float, end: float) -> Path:
        """Cubic pieces from start to end [s] (both within `span`), each within INTERPOLATION of the curve."""


def times_within(span: tuple[float, float], t: npt.ArrayLike) -> Array:
    """The times (...) as an array. Raises OutsideSpan for one outside of the `span` [s]."""
    time, (first, last) = np.asarray(t, dtype=np.float64), span
    outside = (time < first) | (time > last)
    if outside.any():
        raise OutsideSpan(f"t: expected a time from {first:g} to {last:g} s, found {time[outside].ravel()[0]:g} s")
    return time


class Endless:
    """Members shared by trajectories without start, end and breaks."""

    span: ClassVar = FOREVER

    def breaks(self, start: float, end: float) -> Array:
        return np.empty(0)


# Directions of motion along a trajectory, as cubic pieces with a certified error.
#
# They give the heading of bodies that turn with their motion.


STANDING: Final = 1e-3
"""[s] Turns of the heading within less time than this are not resolved: the body turns about on the spot. For that long
it counts as the disc about its position that holds it. Smaller: more pieces where speed vanishes."""


@runtime_checkable
class Directed(Protocol):
    """Trajectory with its own, more accurate direction of motion than its cubic pieces give."""

    def direction(self, start: float, end: float, tolerance: float) -> Path:
        """Unit vectors along the velocity from start to end [s], as cubic pieces within their stated errors.

        Zero vectors with an error of 0 stand for rest.
        """


def direction_path(
    trajectory: Trajectory, start: float, end: float, tolerance: float, before: Callable[[], Array] | None = None
) -> Path:
    """Unit vectors (cos, sin) along the velocity in the plane, as cubic pieces within `tolerance` [1] where possible.

    At rest (up to AT_REST) the last direction is kept. Before the first motion it is `before()` (2,), or without that
    the first one. Where the velocity reverses within STANDING seconds, the pieces are the zero vector with an error of
    1. The body then counts as its smallest disc about the position. So does, all the time, a body that turns at about
    100 rad/s or more.

    Raises:
        InvalidInput: the trajectory never moves, or neither has a direction nor consists of cubic pieces.
    """
    path = moving_direction(trajectory, start, end, tolerance)
    known = np.any(path.points != 0.0, axis=(1, 2))
    rests = ~known & (path.error == 0.0)
    if not np.any(rests):
        return path
    if not np.any(known):
        raise InvalidInput("heading: expected a trajectory that moves, found one at rest; give the heading as an angle")
    points = path.points.copy()
    last = np.maximum.accumulate(np.where(known, np.arange(len(known)), -1))
    first = points[np.argmax(known), 0] if before is None or not rests[0] else before()
    kept = np.where((last >= 0)[:, None], points[last, 3], first)
    points[rests] = kept[rests][:, None]
    return path._replace(points=points)


def moving_direction(trajectory: Trajectory, start: float, end: float, tolerance: float) -> Path:
    """As `direction_path`, but zero vectors with an error of 0 where the trajectory is at rest."""
    if trajectory.speed_bound(start, end) <= REST:
        return Path(np.array([start, end]), np.zeros((1, 4, 2)), np.zeros(1))
    if isinstance(trajectory, Directed):
        return trajectory.direction(start, end, tolerance)
    path = trajectory.path(start, end)
    if np.any(path.error > 0.0):
        raise InvalidInput(
            f"heading: expected a trajectory with a direction of motion, found {type(trajectory).__name__}, which "
            "has no `direction` and is no polynomial of degree 3; give the heading as an angle"
        )
    velocities = 3.0 * np.diff(path.points, axis=1) / np.diff(path.times)[:, None, None]
    return direction_pieces(path.times, velocities, tolerance)


def direction_pieces(times: Array, velocities: Array, tolerance: float) -> Path:
    """Directions of velocities that are polynomials between `times` (n + 1,) [s], control points (n, m + 1, 2).

    Each piece is the cubic Hermite interpolant w of the unit vectors e. The cross product w x v is a polynomial,
    bounded by its Bernstein coefficients. Divided by the least speed it bounds the angle between w and v. The length of
    w is bounded likewise. Then |w - e| <= sqrt(2) |w x v| / |v| + | |w|^2 - 1 |, as long as w . v > 0. Pieces above the
    tolerance are halved.

    A piece that is slower than AT_REST throughout is the zero vector with an error of 0.
    """
    moving = np.any(np.linalg.norm(velocities, axis=2) > REST, axis=1)
    if not np.any(moving):
        return Path(times, np.zeros((len(moving), 4, 2)), np.zeros(len(moving)))
    a = times[:-1][moving]
    b = times[1:][moving]
    v = _without_rest_at_ends(velocities[moving])
    accepted = []
    while len(a):
        pieces, error = _hermite_directions(v)
        done = error <= tolerance
        too_short = ~done & (b - a < STANDING)
        pieces[too_short], error[too_short] = 0.0, 1.0
        done |= too_short
        accepted.append((a[done], b[done], pieces[done], error[done]))
        a = a[~done]
        b = b[~done]
        v = v[~done]
        left, right = _halves(v)
        middle = 0.5 * (a + b)
        a = np.concatenate([a, middle])
        b = np.concatenate([middle, b])
        v = np.concatenate([left, right])
    a, b, pieces, error = (np.concatenate(part) for part in zip(*accepted))
    order = np.argsort(a)
    a = a[order]
    b = b[order]
    pieces = pieces[order]
    error = error[order]
    if np.all(moving):
        return Path(np.append(a, b[-1]), pieces, error)
    a = np.concatenate([a, times[:-1][~moving]])
    order = np.argsort(a)
    rests = int((~moving).sum())
    pieces = np.concatenate([pieces, np.zeros((rests, 4, 2))])[order]
    return Path(np.append(a[order], times[-1]), pieces, np.concatenate([error, np.zeros(rests)])[order])


def _without_rest_at_ends(v: Array) -> Array:
    """Control points (n, m + 1, 2) of polynomials of the same direction as `v`, not zero at 0 and 1.

    A velocity that is zero at 0 is x times another polynomial, with the control points v_j m / j. Raised to the degree
    of v it has the control points v_j + (m - j) / (j + 1) v_{j + 1}. At 1 likewise.
    """
    m = v.shape[1] - 1
    share = (m - np.arange(m))[:, None] / np.arange(1, m + 1)[:, None]
    v = v.copy()
    for _ in range(m):
        for each in (v, v[:, ::-1]):
            rests = ~np.any(each[:, 0] != 0.0, axis=1)
            each[rests, :-1] += share * each[rests, 1:]
    return v


def _hermite_directions(v: Array) -> tuple[Array, Array]:
    """Cubic pieces (n, 4, 2) and their certified errors (n,).

    `v` (n, m + 1, 2) are control points of polynomial velocities.
    """
    degree = v.shape[1] - 1
    ends = v[:, [0, -1]]
    speed = np.linalg.norm(ends, axis=-1, keepdims=True)
    starts_or_ends_at_rest = speed[..., 0].min(axis=1) <= 0.0
    e = ends / np.where(speed > 0.0, speed, 1.0)
    rates = degree * np.stack([v[:, min(1, degree)] - v[:, 0], v[:, -1] - v[:, max(degree - 1, 0)]], axis=1)
    # de/dx = (v x dv/dx) / |v|^2 times e rotated by 90 degrees.
    turn = _cross(ends, rates)[..., None] / np.where(speed > 0.0, speed, 1.0) ** 2
    slope = turn * np.stack([-e[..., 1], e[..., 0]], axis=-1)
    w = np.stack([e[:, 0], e[:, 0] + slope[:, 0] / 3.0, e[:, 1] - slope[:, 1] / 3.0, e[:, 1]], axis=1)
    mean = e.sum(axis=1)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    min_speed = np.einsum("nij,nj->ni", v, mean).min(axis=1)
    cross = np.abs(_product(w, v, _cross)).max(axis=1)
    dot = _product(w, v, _dot).min(axis=1)
    length_error = np.abs(_product(w, w, _dot) - 1.0).max(axis=1)
    certain = (min_speed > 0.0) & (dot > 0.0) & ~starts_or_ends_at_rest
    error = np.where(certain, np.sqrt(2.0) * cross / np.where(certain, min_speed, 1.0) + length_error, np.inf)
    return w, error


def _cross(p: Array, q: Array) -> Array:
    return np.asarray(p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0])


def _dot(p: Array, q: Array) -> Array:
    return np.asarray((p * q).sum(axis=-1))


def _product(p: Array, q: Array, multiply: Callable[[Array, Array], Array]) -> Array:
    """Bernstein coefficients (n, k + m + 1) of the product of two polynomials.

    Their control points are (n, k + 1, 2) and (n, m + 1, 2).
    """
    k, m = p.shape[1] - 1, q.shape[1] - 1
    result = np.zeros((len(p), k + m + 1))
    for i in range(k + 1):
        for j in range(m + 1):
            weight = comb(k, i) * comb(m, j) / comb(k + m, i + j)
            result[:, i + j] += weight * multiply(p[:, i], q[:, j])
    return result


def _halves(v: Array) -> tuple[Array, Array]:
    """Control points (n, m + 1, 2) of both halves of polynomials (n, m + 1, 2) (de Casteljau)."""
    left = np.empty_like(v)
    right = np.empty_like(v)
    rest = v
    for i in range(v.shape[1]):
        left[:, i], right[:, v.shape[1] - 1 - i] = rest[:, 0], rest[:, -1]
        rest = 0.5 * (rest[:, :-1] + rest[:, 1:])
    return left, right
