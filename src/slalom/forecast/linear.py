"""Forecasts of other robots that are linear in the observed state, as tables."""

from collections.abc import Hashable
from functools import lru_cache
from math import ceil, log2
from typing import NamedTuple, cast

import numpy as np

from slalom import kernels
from slalom.base.checks import Array
from slalom.forecast.forecast import Forecast
from slalom.model.path import Path
from slalom.model.trajectory import ConstantAcceleration, PiecewisePolynomial


class LinearForecast(NamedTuple):
    """A forecast that is linear in the observed position, velocity and acceleration, as q cubic pieces."""

    times: Array  # (q + 1,) [s] since the observation
    shares: Array  # (q, 4, 3) of position, velocity and acceleration in each control point

    def points(self, states: Array) -> Array:
        """The control points (n, q, 4, d) [m] for states (n, 3, d)."""
        return kernels.predicted_points(self.shares, states)


def linear_forecast(forecast: Forecast, span: float) -> LinearForecast | None:
    """A forecast as a table over `span` [s]; None for one that is not linear in the observation."""
    units = np.zeros((3, 3, 2))
    units[[0, 1, 2], [0, 1, 2], 0] = 1.0
    paths = [_path(forecast, state, span) for state in units]
    probe = np.array([[3.0, -2.0], [0.7, 1.1], [-0.4, 0.9]])
    expected = _path(forecast, probe, span)
    if any(p.times.shape != expected.times.shape or not np.allclose(p.times, expected.times) for p in paths):
        return None
    table = LinearForecast(expected.times, np.stack([path.points[..., 0] for path in paths], axis=-1))
    return table if np.allclose(table.points(probe[None])[0], expected.points) else None


def table_until(forecast: Forecast, duration: float) -> LinearForecast | None:
    """A forecast as a table up to a `duration` [s] at least, one for many decisions; None: it is not linear."""
    return _tabulated(cast(Hashable, forecast), _span(duration))


def table_between(forecast: Forecast, since: float, horizon: float, parts: int) -> LinearForecast | None:
    """A forecast up to `horizon` [s] from a time `since` [s] after the observation, with times from then on.

    In equal `parts` at least. One for many decisions; None: the forecast is not linear.
    """
    return _window(cast(Hashable, forecast), since, horizon, parts)


@lru_cache(maxsize=64)
def _tabulated(forecast: Hashable, span: float) -> LinearForecast | None:
    return linear_forecast(cast(Forecast, forecast), span)


@lru_cache(maxsize=64)
def _window(forecast: Hashable, since: float, horizon: float, parts: int) -> LinearForecast | None:
    rule = _tabulated(forecast, _span(since + horizon))
    if rule is None:
        return None
    knots = np.union1d(np.clip(rule.times, since, since + horizon), np.linspace(since, since + horizon, parts + 1))
    path = Path(rule.times, rule.shares, np.zeros(len(rule.shares))).cut(knots)
    return LinearForecast(path.times - since, path.points)


def _span(duration: float) -> float:
    """A power of 2 [s] of at least a duration [s] and 1 s."""
    return 2.0 ** ceil(log2(max(duration, 1.0)))


def _path(forecast: Forecast, state: Array, span: float) -> Path:
    """The predicted path over `span` [s] of a robot observed in `state` (3, d) at time 0."""
    position, velocity, acceleration = state
    return forecast(ConstantAcceleration(position, velocity, acceleration, 0.0), 0.0).path(0.0, span)


def piecewise_polynomial(times: Array, points: Array) -> PiecewisePolynomial:
    """The trajectory of cubic pieces: `times` (q + 1,) [s], `points` (q, 4, d) [m]. Pieces without duration vanish."""
    return _piecewise_polynomial(times.tobytes(), points.tobytes(), points.shape[-1])


# Each robot that falls back meets the same paths.
@lru_cache(maxsize=1024)
def _piecewise_polynomial(times_as_bytes: bytes, points_as_bytes: bytes, dimension: int) -> PiecewisePolynomial:
    times, points = np.frombuffer(times_as_bytes), np.frombuffer(points_as_bytes).reshape(-1, 4, dimension)
    real = np.flatnonzero(np.diff(times) > 0.0)
    h = np.diff(times)[real]
    p0, p1, p2, p3 = (points[real, j] for j in range(4))
    powers = np.stack([p0, 3 * (p1 - p0), 3 * (p2 - 2 * p1 + p0), p3 - 3 * p2 + 3 * p1 - p0], axis=1)
    return PiecewisePolynomial(h, powers / h[:, None, None] ** np.arange(4)[None, :, None], float(times[0]))
