"""Obstacles on the trajectories that a forecast predicts for them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from slalom.base.tolerances import REST
from slalom.forecast.forecast import Forecast, FromModels, FromPast
from slalom.model.trajectory import Trajectory
from slalom.model.uncertainty import BoundedError
from slalom.obstacle.obstacle import Headings, Obstacle


def predicted(obstacle: Obstacle, forecast: Forecast, now: float, rise: float = 0.0) -> Obstacle:
    """The obstacle on its predicted trajectory from `now` [s] on; the same object if the forecast changes nothing.

    `rise` [s] is the time of the robot from rest to its maximum speed, for forecasts that bound their error.
    An obstacle that is predicted to stay at rest keeps its last heading. After the end of its trajectory see
    `Obstacle.after_end`.

    Raises:
        OutsideSpan: the obstacle does not exist at `now`.
        InvalidInput: its trajectory ended before, and what follows is unknown.
    """
    obstacle = obstacle.known_at(now)
    if isinstance(forecast, FromModels):
        trajectory, error = forecast.with_error(obstacle.trajectory, now, rise)
        return _moving(obstacle, trajectory, now, error)
    trajectory = forecast(obstacle.trajectory, now)
    if trajectory is obstacle.trajectory:
        return obstacle
    if isinstance(forecast, FromPast) and forecast.growth and obstacle.uncertainty is None:
        speed = float(np.linalg.norm(trajectory.velocity(now)))
        obstacle = replace(obstacle, uncertainty=BoundedError(velocity=forecast.growth * speed))
    return _moving(obstacle, trajectory, now)


def futures(
    obstacles: Sequence[Obstacle], forecast: Forecast, now: float, there: Sequence[int], rise: float = 0.0
) -> list[list[Obstacle]]:
    """Obstacles `there`, by number, on each of their predicted trajectories; as `predicted` if there is one.

    With the probabilities of these. `FromModels` uses the past of all obstacles, also of those that have left.
    """
    if not isinstance(forecast, FromModels):
        return [[predicted(obstacles[k], forecast, now, rise)] for k in there]
    known = [obstacles[k].known_at(now) for k in there]
    found: list[list[Obstacle]] = []
    seen = [obstacle.continued.trajectory for obstacle in obstacles]
    several = forecast.predictions([one.trajectory for one in known], now, rise, seen)
    for one, number, (each, error) in zip(known, there, several, strict=True):
        if len(each) == 1:
            found.append([_moving(one, each[0][1], now, error)])
            continue
        one_of_several = one.probability < 1.0
        owner = one.owner or one.name if one_of_several else f"{one.name} (obstacle {number})"
        found.append(
            [
                replace(_moving(one, trajectory, now, error), probability=one.probability * p, owner=owner)
                for p, trajectory in each
            ]
        )
    return found


_NONE = BoundedError()


def _moving(obstacle: Obstacle, trajectory: Trajectory, now: float, error: BoundedError = _NONE) -> Obstacle:
    """The obstacle on a predicted trajectory, with this error of it unless it has an uncertainty of its own."""
    changed: dict[str, Any] = {"trajectory": trajectory}
    if obstacle.uncertainty is None and error != _NONE:
        changed["uncertainty"] = error
    if isinstance(obstacle.heading, Headings):
        changed["heading"] = float(obstacle.heading.angle(now))
    elif obstacle.turns and _rests(trajectory, now):
        x, y = obstacle.direction(now)
        changed["heading"] = float(np.arctan2(y, x))
    return replace(obstacle, **changed)


def _rests(trajectory: Trajectory, now: float) -> bool:
    """Whether an obstacle is predicted to stay at rest."""
    return bool(np.linalg.norm(trajectory.velocity(now)) <= REST) and not np.any(trajectory.acceleration(now))
