"""The motion of a point of a vehicle as a response: what a robot does that is committed to it."""

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path import Path, hermite
from slalom.model.response.protocol import Unsteered
from slalom.model.state import Affine, State
from slalom.vehicle.vehicle import Vehicle


class PointMotion(Unsteered):
    """Response whose motion is that of a point of a vehicle, whatever the control: gain 0. It ends at rest.

    Args:
        times: (m + 1,) [s] from now. path: (m + 1, 2) [m] of the point, velocities: (m + 1, 2) [m/s].
    """

    interpolation_error = 0.0

    def __init__(self, times: Array, path: Array, velocities: Array) -> None:
        self.times = times
        self._pieces: Path = hermite(times, path, velocities)

    def _affine(self, t: npt.ArrayLike, derivative: int) -> Affine:
        time = np.asarray(t, dtype=np.float64)
        return Affine(self._at(time, derivative), np.zeros_like(time))

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        return self._affine(t, 0)

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        return self._affine(t, 1)

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        return self._affine(t, 2)

    def _at(self, t: Array, derivative: int) -> Array:
        """Values (..., 2) of a derivative of the cubic pieces; at rest after the last one."""
        times = self.times
        over = t > times[-1]
        t = np.minimum(t, times[-1])
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        h = np.diff(times)[k]
        s = ((t - times[k]) / h)[..., None]
        p = np.moveaxis(self._pieces.points[k], -2, 0)
        if derivative == 0:
            r = 1.0 - s
            return np.asarray(r**3 * p[0] + 3.0 * r * r * s * p[1] + 3.0 * r * s * s * p[2] + s**3 * p[3])
        d = [3.0 * (b - a) / h[..., None] for a, b in pairwise(p)]
        if derivative == 1:
            found = (1.0 - s) ** 2 * d[0] + 2.0 * s * (1.0 - s) * d[1] + s * s * d[2]
        else:
            found = 2.0 * ((1.0 - s) * (d[1] - d[0]) + s * (d[2] - d[1])) / h[..., None]
        return np.where(over[..., None], 0.0, found)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        inner = self.times[(self.times > 0.0) & (self.times < horizon - 1e-9)]
        return np.concatenate([[0.0], inner, [horizon]])


def manoeuvre_of(vehicle: Vehicle, motions: Array, start: float) -> Manoeuvre:
    """The manoeuvre of the point of a vehicle on its motions (n, 5) at the ends of all periods from `start` [s] on."""
    rates = np.array([vehicle.turn_rate(speed, turn) for speed, turn in motions[:, 3:].tolist()])
    e = np.stack([np.cos(motions[:, 2]), np.sin(motions[:, 2])], axis=1)
    path = motions[:, :2] + vehicle.lever * e
    velocities = motions[:, 3:4] * e + (vehicle.lever * rates)[:, None] * np.stack([-e[:, 1], e[:, 0]], axis=1)
    times = vehicle.period * np.arange(len(motions), dtype=np.float64)
    return Manoeuvre(PointMotion(times, path, velocities), State(path[0], velocities[0]), np.zeros(2), start)
