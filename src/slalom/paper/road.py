"""Figure of the curved road: four vehicles in three lanes, and VO and NLVO of three cars for the robot."""

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from slalom.choice.control_obstacle import ControlObstacle
from slalom.decision.methods import METHODS
from slalom.model.limits import admissible_ball
from slalom.model.response import Velocity
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
