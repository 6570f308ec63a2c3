"""Predicted paths of many cars on circular lanes, for successive decisions, in a few array operations.

The sweep makes half a million decisions among 30 cars. Evaluating the forecast of each car separately would take
longer than deciding. The pieces are the same (`test_fleet_sees_what_forecasts_see`).
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array
from slalom.base.tolerances import INTERPOLATION
from slalom.model.path import Path, hermite_step
from slalom.model.trajectory import Circular
from slalom.model.trajectory.protocol import Endless
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow

Indices = npt.NDArray[np.intp]


class PredictedLane(Endless):
    """A car on its lane whose `path`, the only part that a decision uses, is the predicted one."""

    def __init__(self, lane: Circular) -> None:
        self.lane = lane
        self.predicted: Path | None = None

    @property
    def dimension(self) -> int:
        return 2

    def position(self, t: npt.ArrayLike) -> Array:
        return self.lane.position(t)

    def velocity(self, t: npt.ArrayLike) -> Array:
        return self.lane.velocity(t)

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return self.lane.acceleration(t)

    def speed_bound(self, start: float, end: float) -> float:
        return self.lane.speed_bound(start, end)

    def acceleration_bound(self, start: float, end: float) -> float:
        return self.lane.acceleration_bound(start, end)

    def path(self, start: float, end: float) -> Path:
        return self.lane.path(start, end) if self.predicted is None else self.predicted


class CarLanes:
    """Cars on circles about the origin.

    Args:
        cars: obstacles on Circular trajectories.
        known: whether their lanes are known (NAO), or only the present position, velocity and acceleration (AO).
    """

    def __init__(self, cars: Sequence[Obstacle], *, known: bool) -> None:
        lanes = [car.trajectory for car in cars]
        assert all(isinstance(lane, Circular) and not lane.center.any() for lane in lanes)
        self.radius, self.rate, self.phase = (
            np.array([getattr(lane, name) for lane in lanes]) for name in ("radius", "rate", "phase")
        )
        self.cars = [
            Obstacle(car.shape, PredictedLane(lane)) for car, lane in zip(cars, lanes) if isinstance(lane, Circular)
        ]
        self.known = known
        fourth = self.radius * np.abs(self.rate) ** 4
        self.fourth_derivative, self.max_step = (
            fourth,
            min((hermite_step(f, INTERPOLATION) for f in fourth), default=np.inf),
        )

    def traffic(self, now: float, horizon: float, position: Array, neighbours: int = 0) -> ObstacleWindow:
        """Return the cars as predicted at `now` [s] over `horizon` [s].

        Args:
            position: (2,) [m] of the robot. neighbours: number of cars nearest to `position`; 0 for all.
        """
        angle = self.phase + self.rate * now
        chosen = np.arange(len(self.cars))
        if neighbours:
            positions = self.radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
            chosen = np.argsort(np.linalg.norm(positions - position, axis=1), kind="stable")[:neighbours]
        times, points, error = (self._lanes if self.known else self._parabolas)(angle[chosen], chosen, now, horizon)
        for k, index in enumerate(chosen):
            assumed = self.cars[index].trajectory
            assert isinstance(assumed, PredictedLane)
            assumed.predicted = Path(times, points[k], error[k])
        return ObstacleWindow([self.cars[index] for index in chosen], now, horizon)

    def _lanes(self, angle: Array, chosen: Indices, now: float, horizon: float) -> tuple[Array, Array, Array]:
        """Return common times (n + 1,) [s], cubic pieces of the circles (k, n, 4, 2) [m] and their errors (k, n)."""
        count = max(1, int(np.ceil(horizon / self.max_step)))
        step = horizon / count
        radius, rate = self.radius[chosen][:, None], self.rate[chosen][:, None]
        angles = angle[:, None] + rate * np.linspace(0.0, horizon, count + 1)
        unit = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        positions = radius[..., None] * unit
        control_offset = (radius * rate * step / 3.0)[..., None] * np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
        points = np.empty((len(chosen), count, 4, 2))
        points[:, :, 0], points[:, :, 3] = positions[:, :-1], positions[:, 1:]
        points[:, :, 1], points[:, :, 2] = (
            positions[:, :-1] + control_offset[:, :-1],
            positions[:, 1:] - control_offset[:, 1:],
        )
        error = np.broadcast_to((self.fourth_derivative[chosen] * step**4 / 384.0)[:, None], (len(chosen), count))
        return np.linspace(now, now + horizon, count + 1), points, error

    def _parabolas(self, angle: Array, chosen: Indices, now: float, horizon: float) -> tuple[Array, Array, Array]:
        """Return times (2,) [s], parabolas (k, 1, 4, 2) [m] of the present acceleration, and errors (k, 1) of 0."""
        radius, rate = self.radius[chosen][:, None], self.rate[chosen][:, None]
        unit = np.column_stack([np.cos(angle), np.sin(angle)])
        positions, acceleration = radius * unit, -radius * rate**2 * unit
        velocity = radius * rate * np.column_stack([-unit[:, 1], unit[:, 0]])
        points = np.empty((len(chosen), 1, 4, 2))
        points[:, 0, 0] = positions
        points[:, 0, 1] = positions + horizon * velocity / 3.0
        points[:, 0, 2] = positions + horizon * (2.0 * velocity + 0.5 * horizon * acceleration) / 3.0
        points[:, 0, 3] = positions + horizon * (velocity + 0.5 * horizon * acceleration)
        return np.array([now, now + horizon]), points, np.zeros((len(chosen), 1))
