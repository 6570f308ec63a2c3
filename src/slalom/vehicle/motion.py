"""Integration of the motion of a vehicle in one period, and its path as cubic pieces."""

from collections.abc import Callable
from itertools import pairwise
from math import cos, sin
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.affine import Affine
from slalom.checks import Array
from slalom.path import Path, hermite
from slalom.response.protocol import Unsteered
from slalom.state import State
from slalom.tolerances import QUADRATURE_STAGES


def _collocation() -> tuple[tuple[float, ...], tuple[float, ...], tuple[tuple[float, ...], ...]]:
    """Nodes, weights and weights of the integrals up to each node of Gauss quadrature on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(QUADRATURE_STAGES)
    nodes, weights = 0.5 * (1.0 + nodes), 0.5 * weights
    powers = np.arange(QUADRATURE_STAGES)
    up_to = (nodes[:, None] ** (powers + 1) / (powers + 1)) @ np.linalg.inv(nodes[:, None] ** powers)
    return tuple(nodes.tolist()), tuple(weights.tolist()), tuple(tuple(row) for row in up_to.tolist())


_NODES, _WEIGHTS, _UP_TO = _collocation()


class Motion(NamedTuple):
    """State of a vehicle as numbers: `Pose`."""

    x: float
    y: float
    heading: float
    speed: float
    turn: float


class Turning(NamedTuple):
    """Bounds (m,) for m periods on the absolute turn rate w of the heading [rad/s] and its first three derivatives."""

    w: Array
    w1: Array
    w2: Array
    w3: Array


def driven(
    start: Motion, speed: float, turn: float, duration: float, turn_rate: Callable[[float, float], float]
) -> Motion:
    """Motion after `duration` [s] in which speed [m/s] and turn change at constant rates to the given values.

    turn_rate: of the heading [rad/s], from speed and turn.
    """
    speeds = [start.speed + node * (speed - start.speed) for node in _NODES]
    rates = [turn_rate(v, start.turn + node * (turn - start.turn)) for v, node in zip(speeds, _NODES)]
    x, y = start.x, start.y
    for weight, row, v in zip(_WEIGHTS, _UP_TO, speeds):
        angle = start.heading + duration * sum(share * rate for share, rate in zip(row, rates))
        x += duration * weight * v * cos(angle)
        y += duration * weight * v * sin(angle)
    heading = start.heading + duration * sum(weight * rate for weight, rate in zip(_WEIGHTS, rates))
    return Motion(x, y, heading, speed, turn)


class BodyMotion(Unsteered):
    """Response whose motion is that of a point of a vehicle, whatever the control: gain 0.

    With it a `ControlObstacle` judges the motion of a vehicle as that of a robot.

    Args:
        times: (m + 1,) [s] from now. path: (m + 1, 2) [m] of the point, velocities: (m + 1, 2) [m/s].
        error: [m] of the cubic pieces between the times.
    """

    def __init__(self, times: Array, path: Array, velocities: Array, error: float) -> None:
        self.times, self.interpolation_error = times, error
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
        """Values (..., 2) of a derivative of the cubic pieces."""
        times = self.times
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        h = np.diff(times)[k]
        s = ((t - times[k]) / h)[..., None]
        p = np.moveaxis(self._pieces.points[k], -2, 0)
        if derivative == 0:
            r = 1.0 - s
            return np.asarray(r**3 * p[0] + 3.0 * r * r * s * p[1] + 3.0 * r * s * s * p[2] + s**3 * p[3])
        d = [3.0 * (b - a) / h[..., None] for a, b in pairwise(p)]
        if derivative == 1:
            return np.asarray((1.0 - s) ** 2 * d[0] + 2.0 * s * (1.0 - s) * d[1] + s * s * d[2])
        return np.asarray(2.0 * ((1.0 - s) * (d[1] - d[0]) + s * (d[2] - d[1])) / h[..., None])

    @property
    def start(self) -> State:
        """Position and velocity at time 0."""
        return State(self._at(np.zeros(()), 0), self._at(np.zeros(()), 1))

    def knots(self, horizon: float, speed_bound: float) -> Array:
        inner = self.times[(self.times > 0.0) & (self.times < horizon - 1e-9)]
        return np.concatenate([[0.0], inner, [horizon]])


def hermite_error(speeds: Array, turning: Turning, offset: float, step: float) -> float:
    """Largest error [m] of cubic pieces of `step` [s] for a point `offset` [m] ahead of the axle.

    `speeds` (m + 1,) [m/s] at the ends of the periods. With the unit vector e along the heading, the fourth derivative
    of the position is 3 v' e'' + v e''' plus `offset` times that of e.
    """
    fastest, rate = np.maximum(np.abs(speeds[:-1]), np.abs(speeds[1:])), np.abs(np.diff(speeds)) / step
    w, w1, w2, w3 = turning
    second, third = np.hypot(w1, w * w), np.hypot(w2 + w**3, 3.0 * w * w1)
    fourth = np.hypot(w3 + 6.0 * w * w * w1, 4.0 * w * w2 + 3.0 * w1 * w1 + w**4)
    largest = (3.0 * rate * second + fastest * third + abs(offset) * fourth).max(initial=0.0)
    return float(largest * step**4 / 384.0)
