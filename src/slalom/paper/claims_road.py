"""Claim `curves`: how often VO and AO raise an alarm on a curved road, and NLVO and NAO do not.

Robot and car follow their lanes without end and never collide: every alarm is false. An alarm means that the robot's
present velocity (acceleration) is in the VO or NLVO (AO or NAO) of the car.
"""

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.choice.control_obstacle import ControlObstacle
from slalom.forecast.forecast import AtConstantAcceleration, AtConstantVelocity, Forecast, Known
from slalom.model.response import Acceleration, Response, Velocity
from slalom.model.shape import Disc
from slalom.model.state import State
from slalom.model.trajectory import Circular
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow

LANE: Final = 4.0
"""[m] Distance between the centre lines of neighbouring lanes."""
ROBOT_DISC: Final = Disc(1.0)
CAR: Final = Disc(1.5)
HORIZONS: Final = (3.0, 6.0)
RADII: Final = (15.0, 20.0, 30.0, 45.0, 70.0, 110.0)
"""[m] Radii of the robot's lane."""
SPEEDS: Final = (4.0, 6.0, 8.0, 10.0, 12.0)
"""[m/s] Speeds of the robot."""
RATIOS: Final = (0.7, 0.85, 1.0, 1.15, 1.3)
"""[1] Speed of the car over the speed of the robot."""
AHEAD: Final = tuple(float(s) for s in range(-20, 21, 2))
"""[m] Arc length along the robot's lane from the robot to the car; negative: the car is behind."""
SIDES: Final = {"inner": -1.0, "outer": 1.0}
"""Lane of the car relative to the robot's lane, in units of LANE."""

Alarms = npt.NDArray[np.bool_]


class Question(NamedTuple):
    """A response, two forecasts to compare, and the present control of a robot that follows its lane."""

    response: Response
    names: tuple[str, str]
    forecasts: tuple[Forecast, Forecast]
    control: Callable[[Circular], npt.NDArray[np.float64]]


QUESTIONS: Final = {
    "velocity": Question(
        Velocity(), ("vo", "nlvo"), (AtConstantVelocity(), Known()), lambda lane: np.asarray(lane.velocity(0.0))
    ),
    "acceleration": Question(
        Acceleration(),
        ("ao", "nao"),
        (AtConstantAcceleration(), Known()),
        lambda lane: np.asarray(lane.acceleration(0.0)),
    ),
}


def cars(radius: float, speed: float, side: float, ahead: Sequence[float], ratios: Sequence[float]) -> list[Obstacle]:
    """Return a car for each speed ratio and arc length, in the lane next to that of a robot at angle 0."""
    lane = radius + side * LANE
    return [Obstacle(CAR, Circular((0.0, 0.0), lane, ratio * speed, s / radius)) for ratio in ratios for s in ahead]


def alarms(question: Question, radius: float, speed: float, obstacles: Sequence[Obstacle], horizon: float) -> Alarms:
    """Return whether each obstacle raises an alarm under the first and the second forecast, (2, n)."""
    robot_lane = Circular((0.0, 0.0), radius, speed)
    state, control = State(robot_lane.position(0.0), robot_lane.velocity(0.0)), question.control(robot_lane)
    rows = []
    for forecast in question.forecasts:
        predicted = [Obstacle(o.shape, forecast(o.trajectory, 0.0)) for o in obstacles]
        blocked = ControlObstacle(question.response, state, ObstacleWindow(predicted, 0.0, horizon), ROBOT_DISC)
        rows.append(np.isfinite(blocked.times_to_collision(control)))
    return np.array(rows)


def counted(rows: Alarms) -> dict[str, int]:
    """Count the alarms of each kind in `rows` (2, n)."""
    first, second = rows
    return {
        "cases": int(first.size),
        "first": int(first.sum()),
        "second": int(second.sum()),
        "only_first": int((first & ~second).sum()),
        "only_second": int((second & ~first).sum()),
    }


def measure_curves(quick: bool, advance: Callable[[float], None]) -> dict[str, Any]:
    """Measure counts over the grid: all, by lane radius and by speed, for each question, horizon and side."""
    radii, speeds = (RADII[1::3], SPEEDS[1::3]) if quick else (RADII, SPEEDS)
    ahead, ratios = (AHEAD[::5], RATIOS[::2]) if quick else (AHEAD, RATIOS)
    result: dict[str, Any] = {
        "radii": radii,
        "speeds": speeds,
        "ratios": ratios,
        "ahead": ahead,
        "lane": LANE,
        "robot_radius": ROBOT_DISC.radius,
        "car_radius": CAR.radius,
        "tables": [],
    }
    keys = [(q, h, s) for q in QUESTIONS for h in HORIZONS for s in SIDES]
    for done, (name, horizon, side) in enumerate(keys):
        question = QUESTIONS[name]
        # (radii, speeds, 2, cars)
        grid = np.array(
            [[alarms(question, r, v, cars(r, v, SIDES[side], ahead, ratios), horizon) for v in speeds] for r in radii]
        )
        whole = grid.transpose(2, 0, 1, 3)
        result["tables"].append(
            {
                "question": name,
                "methods": question.names,
                "horizon": horizon,
                "side": side,
                "all": counted(whole.reshape(2, -1)),
                "by_radius": {f"{r:g}": counted(whole[:, i].reshape(2, -1)) for i, r in enumerate(radii)},
                "by_speed": {f"{v:g}": counted(whole[:, :, j].reshape(2, -1)) for j, v in enumerate(speeds)},
            }
        )
        advance((done + 1) / len(keys))
    return result
