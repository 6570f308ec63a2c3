"""Responses and forecasts as tables, for the kernel that decides for a crew."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.forecast import Forecast
from slalom.kernels.decision.tables import ResponseTable
from slalom.path import Path, hermite
from slalom.response import Response
from slalom.state import State
from slalom.tolerances import BALL_WINDOWS
from slalom.trajectory import ConstantAcceleration, PiecewisePolynomial

FASTEST = 100.0
"""[m/s] Cubic pieces of responses that are not cubic themselves are fine enough up to this speed."""


def response_table(kinds: Sequence[Sequence[Response]], horizon: float, span: float, dimension: int) -> ResponseTable:
    """The responses of each kind of robot as tables over `span` [s].

    What a response does to a robot is affine in its velocity as in the control, so one state stands for all.
    """
    unit = State(np.zeros(dimension), np.eye(dimension)[0])
    knots, place, gain, settled, aim, peaks, parts = [], [], [], [], [], [], []
    windows = np.linspace(0.0, horizon, BALL_WINDOWS + 1)
    for r, response in enumerate(response for kind in kinds for response in kind):
        times = response.knots(span, 2.0 * FASTEST)
        position, velocity = response.position(unit, times), response.velocity(unit, times)
        place.append(hermite(times, position.drift[:, :1], velocity.drift[:, :1]).points[..., 0])
        gain.append(hermite(times, position.gain[:, None], velocity.gain[:, None]).points[..., 0])
        knots.append(times)
        pieces = Path(times, np.stack([place[-1], gain[-1]], axis=-1), np.zeros(len(times) - 1))
        parts.append(pieces.cut(np.union1d(times[times < horizon], windows)))
        settled.append(response.settled(horizon))
        then = response.velocity(unit, settled[-1])
        aim.append((float(then.drift[0]), float(then.gain)))
        both = (response.speed_peaks(unit, horizon), response.acceleration_peaks(unit, horizon))
        for which, maps in enumerate(both):
            peaks += [(r, which, float(peak.drift[0]), float(peak.gain)) for peak in maps if float(peak.gain)]
    return ResponseTable(
        kinds=np.cumsum([0, *(len(kind) for kind in kinds)]),
        first=np.cumsum([0, *(len(pieces) for pieces in place)]),
        knots=np.concatenate(knots),
        velocity_gain=np.concatenate(place),
        gain=np.concatenate(gain),
        settled=np.array(settled),
        settled_velocity=np.array(aim),
        peaks=np.array(peaks, dtype=np.float64),
        cuts=np.cumsum([0, *(len(part.points) for part in parts)]),
        window=np.concatenate([np.searchsorted(windows, part.times[:-1], side="right") - 1 for part in parts]),
        cut_velocity_gain=np.concatenate([part.points[..., 0] for part in parts]),
        cut_gain=np.concatenate([part.points[..., 1] for part in parts]),
    )


class LinearForecast(NamedTuple):
    """A forecast that is linear in the position, velocity and acceleration seen: cubic pieces from that time on."""

    times: Array  # (q + 1,) [s]
    shares: Array  # (q, 4, 3) of position, velocity and acceleration in each control point

    def points(self, states: Array) -> Array:
        """The control points (..., q, 4, d) for states (..., 3, d)."""
        # Written out: numpy.einsum takes twice as long for the same sums.
        share, of = self.shares[..., None], states[..., None, None, :, :]
        near = share[..., 0, :] * of[..., 0, :] + share[..., 1, :] * of[..., 1, :]
        return np.asarray(near + share[..., 2, :] * of[..., 2, :])


def linear_forecast(forecast: Forecast, span: float) -> LinearForecast | None:
    """A forecast as a table over `span` [s], or None for one that is not linear in what was seen."""
    units = np.zeros((3, 3, 2))
    units[[0, 1, 2], [0, 1, 2], 0] = 1.0
    seen = [_path(forecast, state, span) for state in units]
    probe = np.array([[3.0, -2.0], [0.7, 1.1], [-0.4, 0.9]])
    real = _path(forecast, probe, span)
    if any(path.times.shape != real.times.shape or not np.allclose(path.times, real.times) for path in seen):
        return None
    table = LinearForecast(real.times, np.stack([path.points[..., 0] for path in seen], axis=-1))
    return table if np.allclose(table.points(probe), real.points) else None


def _path(forecast: Forecast, state: Array, span: float) -> Path:
    place, speed, push = state
    return forecast(ConstantAcceleration(place, speed, push, 0.0), 0.0).path(0.0, span)


def piecewise_polynomial(begin: Array, points: Array) -> PiecewisePolynomial:
    """The trajectory of cubic pieces, `begin` (q + 1,) [s], `points` (q, 4, d) [m]; those of no length left out."""
    real = np.flatnonzero(np.diff(begin) > 0.0)
    h = np.diff(begin)[real]
    p0, p1, p2, p3 = (points[real, j] for j in range(4))
    powers = np.stack([p0, 3 * (p1 - p0), 3 * (p2 - 2 * p1 + p0), p3 - 3 * p2 + 3 * p1 - p0], axis=1)
    return PiecewisePolynomial(h, powers / h[:, None, None] ** np.arange(4)[None, :, None], float(begin[0]))
