"""Bounds on the distance of an obstacle from its predicted position: a radius that grows with the prediction time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import erf, exp, log, pi, sqrt
from typing import Any, Final, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, CheckedFields, Fraction, NotNegative, check_fields
from slalom.base.errors import InvalidInput


@runtime_checkable
class Uncertainty(Protocol):
    """Radius [m] about the predicted position that contains the true one, at time t [s] >= 0 since the prediction.

    Laws: the radius is 0 or more, non-decreasing and convex in t, so that linear interpolation between its values is an
    upper bound.
    """

    def radius(self, t: npt.ArrayLike, dimension: int) -> Array:
        """Radius (...) [m] at times t (...) [s] in `dimension`."""


@dataclass(frozen=True)
class BoundedError(CheckedFields):
    """Error of at most position + velocity t + acceleration t^2 / 2 (m, m/s, m/s^2), from sensors and intentions.

    `velocity` and `acceleration` are the largest differences between the obstacle and the forecast.
    """

    position: NotNegative = 0.0
    velocity: NotNegative = 0.0
    acceleration: NotNegative = 0.0

    def radius(self, t: npt.ArrayLike, dimension: int) -> Array:
        time = np.asarray(t, dtype=np.float64)
        return np.asarray(self.position + time * (self.velocity + 0.5 * time * self.acceleration))


@dataclass(frozen=True)
class GaussianError(CheckedFields):
    """Independent Gaussian errors of position and velocity.

    `position` [m] and `velocity` [m/s] are the standard deviations per axis. The obstacle leaves the radius, at any
    time, with a probability of at most `probability`.

    Let e and f be the two errors, and k^2 the chi-square quantile of that probability. It has d degrees of freedom for
    each deviation above 0. In all other cases |e|^2 / position^2 + |f|^2 / velocity^2 <= k^2. Then, by Cauchy and
    Schwarz, |e + f t| <= k sqrt(position^2 + velocity^2 t^2) at all times at once. A robot that stays outside this
    radius collides with the obstacle with at most that probability over the whole horizon. The ellipsoid is the usual
    Mahalanobis region of a Gaussian; Du Toit and Burdick, IEEE T-RO 28(1), 2012, use such bounds for chance
    constraints. The radius for all times is derived here.
    """

    position: NotNegative
    velocity: NotNegative = 0.0
    probability: Fraction = 0.01

    def radius(self, t: npt.ArrayLike, dimension: int) -> Array:
        time = np.asarray(t, dtype=np.float64)
        degrees = dimension * ((self.position > 0.0) + (self.velocity > 0.0))
        deviation = np.sqrt(self.position**2 + (self.velocity * time) ** 2)
        return np.asarray(chi_quantile(self.probability, degrees) * deviation if degrees else 0.0 * time)


@dataclass(frozen=True)
class KalmanError:
    """Error of a constant-velocity Kalman filter that predicts: Gaussian, with accelerations that are white noise.

    `position` [m] and `velocity` [m/s] are the largest standard deviations along any axis; `correlation` (0 to 1) is
    that of both errors. `acceleration` [m/s^2/sqrt(Hz)] is the root of the spectral density of the accelerations. At
    each time the obstacle is outside the radius with a probability of at most `probability`. Over all times of a
    horizon it may be more.

    The standard deviation at time t is sqrt(p^2 + 2 r p v t + v^2 t^2 + a^2 t^3 / 3). Source: Bar-Shalom, Li and
    Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.2. It is the norm of two
    convex functions that do not decrease, and therefore convex. A negative correlation counts as 0, an upper bound.
    """

    position: NotNegative
    velocity: NotNegative
    correlation: NotNegative = 0.0
    acceleration: NotNegative = 0.0
    probability: Fraction = 0.05

    def __post_init__(self) -> None:
        check_fields(self)
        if self.correlation > 1.0:
            raise InvalidInput(f"correlation: expected a number from 0 to 1, found {self.correlation:g}")

    def radius(self, t: npt.ArrayLike, dimension: int) -> Array:
        time = np.asarray(t, dtype=np.float64)
        mixed = 2.0 * self.correlation * self.position * self.velocity
        variance = self.position**2 + time * (mixed + time * (self.velocity**2 + time * self.acceleration**2 / 3.0))
        return np.asarray(chi_quantile(self.probability, dimension) * np.sqrt(variance))


@dataclass(frozen=True)
class Adjusted(CheckedFields):
    """A `share` (0 or more) of the radius of an uncertainty `of` a prediction that was made `age` [s] >= 0 before.

    From `until` [s] on it does not grow: by then the robot decides anew. It is convex up to then, see `radii_between`.
    """

    of: Uncertainty
    age: NotNegative = 0.0
    share: NotNegative = 1.0
    until: float = np.inf

    def radius(self, t: npt.ArrayLike, dimension: int) -> Array:
        time = np.minimum(np.asarray(t, dtype=np.float64), self.until)
        return self.share * self.of.radius(time + self.age, dimension)


COVERAGES: Final = (0.5, 0.8, 0.95)
"""[1] Shares of the errors of a forecast that its sets are stated to hold."""


@dataclass(frozen=True)
class Covering(CheckedFields):
    """Radius that holds the share `coverage` of the measured errors of a forecast, at each time.

    It is `scale` times a curve of straight lines through the radii (k,) [m] of that share in `sets`, at `times` (k,)
    [s], k of at least 2. The first and the last line go on, and no radius is below 0. See `convex_radii`.
    """

    coverage: Fraction
    times: tuple[float, ...]
    sets: tuple[tuple[float, tuple[float, ...]], ...]
    scale: NotNegative = 1.0

    @classmethod
    def of(cls, coverage: float, shares: Sequence[float], times: Array, radii: Array) -> "Covering":
        """The least convex curves with radii (c, k) [m] or more, each of one of `shares` (c,), at times (k,) [s]."""
        curves = map(tuple, convex_radii(times, radii).tolist())
        return cls(coverage, tuple(times.tolist()), tuple(zip(shares, curves, strict=True)))

    def radius(self, t: npt.ArrayLike, dimension: int) -> Array:
        time = np.asarray(t, dtype=np.float64)
        radii = _curve(dict(self.sets)[self.coverage], self.times, time.tobytes())
        return np.asarray(self.scale * radii.reshape(time.shape))


def set_of(error: Uncertainty | None, share: float) -> Uncertainty | None:
    """The error whose radius is stated to hold a `share` of errors, and grows without end; None without that set."""
    if isinstance(error, Covering):
        return replace(error, coverage=share) if share in dict(error.sets) else None
    if isinstance(error, GaussianError | KalmanError):
        return replace(error, probability=1.0 - share)
    if isinstance(error, Adjusted) and error.share == 1.0 and (inner := set_of(error.of, share)) is not None:
        return replace(error, of=inner, until=np.inf)
    return None


def until_of(error: Uncertainty | None) -> float:
    """[s] from which on an error does not grow."""
    return error.until if isinstance(error, Adjusted) else np.inf


def coverage_of(error: Uncertainty | None) -> float:
    """The share that the set of a `Covering` holds, also of an adjusted one; 1 without."""
    inner = error.of if isinstance(error, Adjusted) and error.share == 1.0 else error
    return inner.coverage if isinstance(inner, Covering) else coverage_of(inner) if inner is not error else 1.0


def with_share(error: Any, share: float) -> Any:
    """The error with its set of a `share` where it states a larger one, which grows as long; the same without it."""
    less: Any = set_of(error, share) if share < coverage_of(error) < 1.0 else None
    return error if less is None else replace(less, until=error.until) if isinstance(error, Adjusted) else less


def radii_between(error: Uncertainty, times: Array, dimension: int) -> Array:
    """Radii (n,) [m] at increasing times (n,) [s] between which straight lines are an upper bound."""
    last = float(times[min(int(np.searchsorted(times, until_of(error))), len(times) - 1)])
    return (replace(error, until=last) if isinstance(error, Adjusted) else error).radius(times, dimension)


# The sets of all tracks of a decision are one curve, at the same times.
@lru_cache(maxsize=256)
def _curve(radii: tuple[float, ...], knots: tuple[float, ...], times_as_bytes: bytes) -> Array:
    time, at = np.frombuffer(times_as_bytes), np.array(knots)
    values = np.array(radii)
    k = np.clip(np.searchsorted(at, time) - 1, 0, len(at) - 2)
    slopes = np.diff(values) / np.diff(at)
    return np.asarray(np.maximum(values[k] + (time - at[k]) * slopes[k], 0.0))


def convex_radii(times: Array, radii: Array) -> Array:
    """The least radii (..., k) [m] from the first on that never grow more slowly later: at times (k,) [s]."""
    widths = np.diff(times)
    slopes = np.maximum.accumulate(np.maximum(np.diff(radii, axis=-1) / widths, 0.0), axis=-1)
    return np.concatenate([radii[..., :1], radii[..., :1] + np.cumsum(slopes * widths, axis=-1)], axis=-1)


@lru_cache(maxsize=64)
def chi_quantile(probability: float, degrees: int) -> float:
    """Value k that a chi-distributed number with `degrees` degrees of freedom exceeds with `probability`.

    The number is the norm of `degrees` (2, 3, 4 or 6) independent standard normal numbers.
    """
    if degrees == 2:
        return sqrt(-2.0 * log(probability))

    def tail_probability(k: float) -> float:
        half = 0.5 * k * k
        if degrees == 3:
            return 1.0 - erf(k / sqrt(2.0)) + sqrt(2.0 / pi) * k * exp(-half)
        # For an even number 2 n: exp(-h) (1 + h + ... + h^(n - 1) / (n - 1)!), h = k^2 / 2.
        terms = 1.0 + half if degrees == 4 else 1.0 + half + 0.5 * half * half
        return terms * exp(-half)

    low, high = 0.0, 50.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        if tail_probability(middle) > probability:
            low = middle
        else:
            high = middle
    return high


UNCERTAINTIES: Final[dict[str, type[Uncertainty]]] = {
    "bounded_error": BoundedError,
    "gaussian_error": GaussianError,
    "kalman_error": KalmanError,
}
"""Every uncertainty by the name that scenario files and recordings use."""
