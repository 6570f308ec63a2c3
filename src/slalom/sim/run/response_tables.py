"""Responses, forecasts and passive obstacles as tables for the kernel that decides for a fleet."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.forecast import Forecast
from slalom.kernels.decision.tables import WINDOWS, PassiveObstacles, ResponseTable
from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.path import Path, hermite
from slalom.response import Response
from slalom.shape import Shape
from slalom.state import State
from slalom.tolerances import TABLE_SPEED
from slalom.trajectory import ConstantAcceleration, PiecewisePolynomial


def response_table(kinds: Sequence[Sequence[Response]], horizon: float, span: float, dimension: int) -> ResponseTable:
    """The responses of each kind of robot as tables over `span` [s].

    The motion under a response is affine in the robot's velocity and in the control, so one state stands for all.
    """
    unit = State(np.zeros(dimension), np.eye(dimension)[0])
    knots, velocity_gain, gain, settled, settled_velocity, peaks, parts = [], [], [], [], [], [], []
    windows = np.linspace(0.0, horizon, WINDOWS + 1)
    for r, response in enumerate(response for kind in kinds for response in kind):
        times = response.knots(span, 2.0 * TABLE_SPEED)
        position, velocity = response.position(unit, times), response.velocity(unit, times)
        velocity_gain.append(hermite(times, position.drift[:, :1], velocity.drift[:, :1]).points[..., 0])
        gain.append(hermite(times, position.gain[:, None], velocity.gain[:, None]).points[..., 0])
        knots.append(times)
        pieces = Path(times, np.stack([velocity_gain[-1], gain[-1]], axis=-1), np.zeros(len(times) - 1))
        parts.append(pieces.cut(np.union1d(times[times < horizon], windows)))
        settled.append(response.settled(horizon))
        then = response.velocity(unit, settled[-1])
        settled_velocity.append((float(then.drift[0]), float(then.gain)))
        both = (response.speed_peaks(unit, horizon), response.acceleration_peaks(unit, horizon))
        for which, maps in enumerate(both):
            peaks += [(r, which, float(peak.drift[0]), float(peak.gain)) for peak in maps if float(peak.gain)]
    return ResponseTable(
        kinds=np.cumsum([0, *(len(kind) for kind in kinds)]),
        first=np.cumsum([0, *(len(pieces) for pieces in velocity_gain)]),
        knots=np.concatenate(knots),
        velocity_gain=np.concatenate(velocity_gain),
        gain=np.concatenate(gain),
        settled=np.array(settled),
        settled_velocity=np.array(settled_velocity),
        peaks=np.array(peaks, dtype=np.float64),
        cuts=np.cumsum([0, *(len(part.points) for part in parts)]),
        window=np.concatenate([np.searchsorted(windows, part.times[:-1], side="right") - 1 for part in parts]),
        cut_velocity_gain=np.concatenate([part.points[..., 0] for part in parts]),
        cut_gain=np.concatenate([part.points[..., 1] for part in parts]),
    )


class LinearForecast(NamedTuple):
    """A forecast that is linear in the observed position, velocity and acceleration, as q cubic pieces."""

    times: Array  # (q + 1,) [s] since the observation
    shares: Array  # (q, 4, 3) of position, velocity and acceleration in each control point

    def points(self, states: Array) -> Array:
        """The control points (..., q, 4, d) [m] for states (..., 3, d)."""
        # Written out: numpy.einsum takes twice as long for the same sums.
        share, of = self.shares[..., None], states[..., None, None, :, :]
        first_two = share[..., 0, :] * of[..., 0, :] + share[..., 1, :] * of[..., 1, :]
        return np.asarray(first_two + share[..., 2, :] * of[..., 2, :])


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
    return table if np.allclose(table.points(probe), expected.points) else None


def _path(forecast: Forecast, state: Array, span: float) -> Path:
    """The predicted path over `span` [s] of a robot observed in `state` (3, d) at time 0."""
    position, velocity, acceleration = state
    return forecast(ConstantAcceleration(position, velocity, acceleration, 0.0), 0.0).path(0.0, span)


def piecewise_polynomial(times: Array, points: Array) -> PiecewisePolynomial:
    """The trajectory of cubic pieces: `times` (q + 1,) [s], `points` (q, 4, d) [m]. Pieces without duration vanish."""
    real = np.flatnonzero(np.diff(times) > 0.0)
    h = np.diff(times)[real]
    p0, p1, p2, p3 = (points[real, j] for j in range(4))
    powers = np.stack([p0, 3 * (p1 - p0), 3 * (p2 - 2 * p1 + p0), p3 - 3 * p2 + 3 * p1 - p0], axis=1)
    return PiecewisePolynomial(h, powers / h[:, None, None] ** np.arange(4)[None, :, None], float(times[0]))


def passive_obstacles(obstacles: Sequence[Obstacle], robot: Shape, now: float, horizon: float) -> PassiveObstacles:
    """Predicted obstacles grown by the shape of a robot, over the horizon [s] from `now` [s]."""
    bodies = ObstacleTable(obstacles, now, horizon).bodies(robot)
    d, end = robot.dimension, now + horizon
    staying = [o for o in obstacles if o.exists(end) and len(o.shape.parts) == 1]
    return PassiveObstacles(
        pieces=bodies.pieces,
        body_radius=bodies.radius,
        hull_radius=bodies.hull_radius,
        hull=bodies.hull,
        corners=bodies.maybe_corners,
        heads=bodies.heads,
        end_positions=np.array([o.trajectory.position(end) for o in staying]).reshape(-1, d),
        end_radii=np.array([o.shape.bounding_radius for o in staying]),
        robot_radius=robot.bounding_radius,
    )
