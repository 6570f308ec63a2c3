"""Many cars on circular lanes as one decision after the other sees them: all their pieces in a few array operations.

The sweep makes half a million decisions among 30 cars. Asking each car's forecast for its path, one by one, would take
longer than deciding; the pieces are the same (`test_fleet_sees_what_forecasts_see`).
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from slalom.checks import Array
from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.path import Path, hermite_step
from slalom.tolerances import INTERPOLATION
from slalom.trajectory import Circular
from slalom.trajectory.protocol import Endless

Indices = npt.NDArray[np.intp]


class Assumed(Endless):
    """A car on its lane; only `path`, which is all that a decision looks at, is what a forecast assumes of it."""

    def __init__(self, lane: Circular) -> None:
        self.lane = lane
        self.assumed: Path | None = None

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
        return self.lane.path(start, end) if self.assumed is None else self.assumed


class CarLanes:
    """Cars on circles about the origin.

    Args:
        cars: obstacles on Circular trajectories.
        known: whether their lanes are known (NAO), or only position, velocity and acceleration of the moment (AO).
    """

    def __init__(self, cars: Sequence[Obstacle], *, known: bool) -> None:
        lanes = [car.trajectory for car in cars]
        assert all(isinstance(lane, Circular) and not lane.center.any() for lane in lanes)
        self.radius, self.rate, self.phase = (
            np.array([getattr(lane, name) for lane in lanes]) for name in ("radius", "rate", "phase")
        )
        self.cars = [Obstacle(car.shape, Assumed(lane)) for car, lane in zip(cars, lanes) if isinstance(lane, Circular)]
        self.known = known
        fourth = self.radius * np.abs(self.rate) ** 4
        self.fourth, self.longest = fourth, min((hermite_step(f, INTERPOLATION) for f in fourth), default=np.inf)

    def traffic(self, now: float, horizon: float, place: Array, neighbours: int = 0) -> ObstacleTable:
        """The cars as assumed at `now` [s] over `horizon` [s]; only those nearest to `place` (2,), all for 0."""
        angle = self.phase + self.rate * now
        chosen = np.arange(len(self.cars))
        if neighbours:
            here = self.radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
            chosen = np.argsort(np.linalg.norm(here - place, axis=1), kind="stable")[:neighbours]
        times, points, error = (self._lanes if self.known else self._parabolas)(angle[chosen], chosen, now, horizon)
        for k, index in enumerate(chosen):
            assumed = self.cars[index].trajectory
            assert isinstance(assumed, Assumed)
            assumed.assumed = Path(times, points[k], error[k])
        return ObstacleTable([self.cars[index] for index in chosen], now, horizon)

    def _lanes(self, angle: Array, chosen: Indices, now: float, horizon: float) -> tuple[Array, Array, Array]:
        """Cubic pieces of the circles (k, n, 4, 2) between common times (n + 1,), and their errors (k, n)."""
        count = max(1, int(np.ceil(horizon / self.longest)))
        step = horizon / count
        radius, rate = self.radius[chosen][:, None], self.rate[chosen][:, None]
        turn = angle[:, None] + rate * np.linspace(0.0, horizon, count + 1)
        unit = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        place = radius[..., None] * unit
        third = (radius * rate * step / 3.0)[..., None] * np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
        points = np.empty((len(chosen), count, 4, 2))
        points[:, :, 0], points[:, :, 3] = place[:, :-1], place[:, 1:]
        points[:, :, 1], points[:, :, 2] = place[:, :-1] + third[:, :-1], place[:, 1:] - third[:, 1:]
        error = np.broadcast_to((self.fourth[chosen] * step**4 / 384.0)[:, None], (len(chosen), count))
        return np.linspace(now, now + horizon, count + 1), points, error

    def _parabolas(self, angle: Array, chosen: Indices, now: float, horizon: float) -> tuple[Array, Array, Array]:
        """One parabola each, (k, 1, 4, 2), from position, velocity and acceleration now."""
        radius, rate = self.radius[chosen][:, None], self.rate[chosen][:, None]
        unit = np.column_stack([np.cos(angle), np.sin(angle)])
        place, push = radius * unit, -radius * rate**2 * unit
        speed = radius * rate * np.column_stack([-unit[:, 1], unit[:, 0]])
        points = np.empty((len(chosen), 1, 4, 2))
        points[:, 0, 0] = place
        points[:, 0, 1] = place + horizon * speed / 3.0
        points[:, 0, 2] = place + horizon * (2.0 * speed + 0.5 * horizon * push) / 3.0
        points[:, 0, 3] = place + horizon * (speed + 0.5 * horizon * push)
        return np.array([now, now + horizon]), points, np.zeros((len(chosen), 1))
