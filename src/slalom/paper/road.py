"""The curved road: the figure of four vehicles with VO and NLVO, and the claim `curves`."""

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from slalom.choice.control_obstacle import ControlObstacle
from slalom.decision.methods import METHODS
from slalom.forecast.forecast import AtConstantAcceleration, AtConstantVelocity, Forecast, Known
from slalom.model.limits import admissible_ball
from slalom.model.response import Acceleration, Response, Velocity
from slalom.model.shape import Disc
from slalom.model.state import State
from slalom.model.trajectory import Circular
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow
from slalom.paper import drawing
from slalom.sim import Scenario
from slalom.sim.gallery import build
from slalom.view import control_space
from slalom.view.style import FAINT, GOAL, INK, NEUTRAL, ROBOT, colour_at, disc, style, time_scale

HORIZON: Final = 6.0
SPAN: Final = (-14.0, 14.0, -14.0, 14.0)
"""[m/s] Limits of the velocity panels."""
NUMBER_POSITIONS: Final = ((1.5, (0, 0)), (6.0, (-5, -4)), (1.2, (14, -3)))
"""For each car: the time [s] of the element next to its number, and the offset [pt] of the number."""


def control_obstacle_of(scenario: Scenario, method: str) -> ControlObstacle:
    """Return the VO or NLVO of all cars for the robot at the start."""
    forecast = METHODS[method].forecast
    cars = [Obstacle(car.shape, forecast(car.trajectory, 0.0)) for car in scenario.obstacles]
    return ControlObstacle(Velocity(), scenario.robot.state, ObstacleWindow(cars, 0.0, HORIZON), scenario.robot.shape)


def curved_road() -> Figure:
    """Draw the road, and VO and NLVO of the cars."""
    scenario = build("curved_road")
    state = scenario.robot.state
    with style():
        figure, (workspace_ax, left, right) = drawing.page([(14.0, 46.0, -16.0, 28.0), SPAN, SPAN], gap=0.47)
        _lanes(workspace_ax, scenario)
        for ax, method in ((left, "vo"), (right, "nlvo")):
            blocked = control_obstacle_of(scenario, method)
            control_space(
                ax,
                blocked=blocked,
                admissible=admissible_ball((0.0, 0.0), scenario.robot.limits.max_speed),
                extent=SPAN,
                resolution=281,
                decorations=False,
            )
            drawing.name_axes(ax, "v", "m/s")
            colliding = np.flatnonzero(np.isfinite(blocked.times_to_collision(state.velocity)))
            verdict = "hits " + " and ".join(f"car {k + 1}" for k in colliding) if colliding.size else "is free"
            ax.set_title(f"{method.upper()}: $v_A$ {verdict}", pad=4)
            drawing.control_point(ax, state.velocity, r"$v_A$", offset=(1, 9), size=3.0)
            _numbers(ax, blocked)
        drawing.time_bar(right, HORIZON, "time to collision [s]")
    return figure


def _lanes(ax: Axes, scenario: Scenario) -> None:
    """Draw the road, the robot, and the cars now and after 1 s and 2 s."""
    radii = sorted({car.trajectory.radius for car in scenario.obstacles if isinstance(car.trajectory, Circular)})
    outer = float(scenario.robot.state.position[0])
    for radius in (
        radii[0] - 2.0,
        *(0.5 * (a + b) for a, b in zip([*radii, outer][:-1], [*radii, outer][1:])),
        outer + 2.0,
    ):
        edge = radius in (radii[0] - 2.0, outer + 2.0)
        properties: dict[str, Any] = {"fill": False, "edgecolor": FAINT, "linewidth": 0.9 if edge else 0.6}
        ax.add_patch(Circle((0.0, 0.0), radius, linestyle="-" if edge else (0, (6, 5)), zorder=1, **properties))
    scale = time_scale(HORIZON)
    for k, car in enumerate(scenario.obstacles):
        for t in (1.0, 2.0):
            properties = {"facecolor": "none", "edgecolor": colour_at(scale, t), "linewidth": 0.8}
            disc(ax, car.trajectory.position(t), car.shape.bounding_radius, f"car-{k}-{t:g}", zorder=2, **properties)
        disc(
            ax,
            car.trajectory.position(0.0),
            car.shape.bounding_radius,
            f"car-{k}",
            fc=NEUTRAL,
            ec=INK,
            lw=0.7,
            zorder=3,
        )
        velocity = car.trajectory.velocity(0.0)
        drawing.arrow(ax, car.trajectory.position(0.0), car.trajectory.position(0.0) + velocity, INK, f"velocity-{k}")
        drawing.label(ax, car.trajectory.position(0.0), f"{k + 1}", size=7)
    state = scenario.robot.state
    disc(
        ax,
        state.position,
        scenario.robot.shape.bounding_radius,
        "robot",
        facecolor=ROBOT,
        edgecolor=INK,
        linewidth=0.7,
        zorder=5,
    )
    drawing.arrow(ax, state.position, state.position + state.velocity, ROBOT, "velocity")
    drawing.label(ax, state.position + state.velocity, r"$v_A$", offset=(9, 0), color=ROBOT)
    drawing.name_axes(ax, "x", "m")
    ax.set_title("curved road (arrows: 1 s)", pad=4)


def _numbers(ax: Axes, blocked: ControlObstacle) -> None:
    """Write the number of each car next to one of its elements."""
    for k, (t, offset) in enumerate(NUMBER_POSITIONS):
        found = blocked.element(t)
        centre = found.centers[list(found.owners).index(k)]
        position = np.clip(centre, 0.9 * SPAN[0], 0.9 * SPAN[1])
        drawing.label(ax, position, f"{k + 1}", offset=offset, size=7, color=GOAL, weight="bold")


# Claim `curves`: how often VO and AO raise an alarm on a curved road, and NLVO and NAO do not.
#
# Robot and car follow their lanes without end and never collide: every alarm is false. An alarm means that the robot's
# present velocity (acceleration) is in the VO or NLVO (AO or NAO) of the car.


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
