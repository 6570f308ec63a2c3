"""How far an obstacle may be from where it is foreseen: a radius that grows with the time of prediction."""

from dataclasses import dataclass
from math import erf, exp, log, pi, sqrt
from typing import Final, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, NotNegative, Positive, not_negative
from slalom.errors import InvalidInput


@runtime_checkable
class Uncertainty(Protocol):
    """A radius [m] about the foreseen place that holds the true one, by the time t [s] >= 0 since the prediction.

    Laws: it is 0 or more, never falls, and is convex in t, so that straight lines between its values lie above it.
    """

    def radius(self, t: npt.ArrayLike, dimension: int) -> Array:
        """The radius (...) [m] at times (...) in that dimension."""


@dataclass(frozen=True)
class BoundedError:
    """The error is at most position + velocity t + acceleration t^2 / 2 (m, m/s, m/s^2): of a sensor and of intentions.

    With velocity and acceleration the largest by which those of the obstacle may differ from the forecast.
    """

    position: NotNegative = 0.0
    velocity: NotNegative = 0.0
    acceleration: NotNegative = 0.0

    def __post_init__(self) -> None:
        for name in ("position", "velocity", "acceleration"):
            object.__setattr__(self, name, not_negative(getattr(self, name), name))

    def radius(self, t: npt.ArrayLike, dimension: int) -> Array:
        time = np.asarray(t, dtype=np.float64)
        return np.asarray(self.position + time * (self.velocity + 0.5 * time * self.acceleration))


@dataclass(frozen=True)
class GaussianError:
    """Position and velocity have independent Gaussian errors, `position` [m] and `velocity` [m/s] the standard
    deviations along every axis; the obstacle leaves its radius, at whatever time, with a probability of at most
    `probability`.

    With e and f the two errors and k^2 the chi-square quantile of that probability (with d degrees of freedom for each
    deviation above 0), |e|^2 / position^2 + |f|^2 / velocity^2 <= k^2 in all other cases; then, by Cauchy and Schwarz,
    |e + f t| <= k sqrt(position^2 + velocity^2 t^2) at all times at once. A robot that keeps out of this radius
    collides with the obstacle with at most that probability over the whole horizon. (The ellipsoid is the usual
    Mahalanobis region of a Gaussian; Du Toit and Burdick, IEEE T-RO 28(1), 2012, use such bounds for chance
    constraints. The radius for all times is derived here.)
    """

    position: NotNegative
    velocity: NotNegative = 0.0
    probability: Positive = 0.01

    def __post_init__(self) -> None:
        for name in ("position", "velocity"):
            object.__setattr__(self, name, not_negative(getattr(self, name), name))
        if not 0.0 < self.probability < 1.0:
            raise InvalidInput(f"probability: expected a number between 0 and 1, found {self.probability:g}")

    def radius(self, t: npt.ArrayLike, dimension: int) -> Array:
        time = np.asarray(t, dtype=np.float64)
        freedoms = dimension * ((self.position > 0.0) + (self.velocity > 0.0))
        deviation = np.sqrt(self.position**2 + (self.velocity * time) ** 2)
        return np.asarray(chi_quantile(self.probability, freedoms) * deviation if freedoms else 0.0 * time)


def chi_quantile(probability: float, freedoms: int) -> float:
    """The k that a chi-distributed number with that many degrees of freedom exceeds with `probability`.

    The number is the length of a vector of `freedoms` (2, 3, 4 or 6) independent standard normal numbers.
    """
    if freedoms == 2:
        return sqrt(-2.0 * log(probability))

    def beyond(k: float) -> float:
        half = 0.5 * k * k
        if freedoms == 3:
            return 1.0 - erf(k / sqrt(2.0)) + sqrt(2.0 / pi) * k * exp(-half)
        # For an even number 2 n of them: exp(-h) (1 + h + ... + h^(n - 1) / (n - 1)!), h = k^2 / 2.
        terms = 1.0 + half if freedoms == 4 else 1.0 + half + 0.5 * half * half
        return terms * exp(-half)

    low, high = 0.0, 50.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        if beyond(middle) > probability:
            low = middle
        else:
            high = middle
    return high


UNCERTAINTIES: Final[dict[str, type[Uncertainty]]] = {
    "bounded_error": BoundedError,
    "gaussian_error": GaussianError,
}
"""Every uncertainty by the name that scenario files and recordings use."""
