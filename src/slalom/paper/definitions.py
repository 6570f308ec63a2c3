"""Figures of the definitions, and the claim `cone`: moving obstacle, VO, temporal element, NLVO, AO and NAO.

The obstacles are grown by the robot's radius; the robot is a point at the origin.
"""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slalom.base.checks import Array
from slalom.choice.control_obstacle import ControlObstacle
from slalom.forecast.forecast import AtConstantAcceleration, AtConstantVelocity
from slalom.model.response import Acceleration, Response, Velocity
from slalom.model.shape import Disc
from slalom.model.state import State
from slalom.model.trajectory import Circular, ConstantAcceleration, ConstantVelocity, Trajectory
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow
from slalom.paper import drawing
from slalom.paper.drawing import DASHES
from slalom.view.style import FAINT, GOAL, INK, ROBOT, disc, style

RADIUS: Final = 1.6
"""[m] Sum of the radii of obstacle and robot."""
ROBOT_VELOCITY: Final = (3.2, 0.3)
LINE: Final = ConstantVelocity((8.0, 5.0), (0.6, -1.3))
CIRCLE: Final = Circular((7.8, 8.7), 4.5, -2.2, phase=-0.37)
"""Obstacle that approaches the robot's path, on a collision course in 3 s at its present velocity, and turns away."""
HORIZON: Final = 10.0
TIMES: Final = (1.2, 1.6, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0)
LABELLED_UNTIL: Final = 2.0
"""[s] Latest time of an element that carries its time as a label."""
POINT_RADIUS: Final = 0.01
"""[m] Radius of the robot if the obstacles are already grown: shapes cannot be points."""


def obstacle_of(
    trajectory: Trajectory,
    response: Response,
    horizon: float = HORIZON,
    velocity: Sequence[float] = ROBOT_VELOCITY,
    radius: float = RADIUS,
) -> ControlObstacle:
    """Return the control obstacle of one obstacle for a robot at the origin."""
    traffic = ObstacleWindow([Obstacle(Disc(radius - POINT_RADIUS), trajectory)], 0.0, horizon)
    return ControlObstacle(response, State((0.0, 0.0), velocity), traffic, Disc(POINT_RADIUS))


def moving_obstacle() -> Figure:
    """Draw obstacle B on its path c(t), at c(t0) now, and robot A."""
    with style():
        figure, (ax,) = drawing.column((-2.0, 15.5, -2.5, 15.5))
        _workspace(ax, CIRCLE, (4, 7))
        drawing.label(ax, CIRCLE.position(0.0) + CIRCLE.velocity(0.0), r"$v_B$", offset=(5, -7))
        drawing.label(ax, CIRCLE.position(5.0), r"$c(t)$", offset=(-11, -2), color=FAINT)
        drawing.time_bar(ax, HORIZON)
    return figure


def _workspace(ax: Axes, trajectory: Trajectory, name_offset: tuple[int, int]) -> None:
    """Draw the obstacle now and later on its path, robot A, and both velocities; `name_offset` [pt] of B(t0)."""
    drawing.path(ax, trajectory, HORIZON)
    drawing.positions(ax, trajectory, RADIUS, (2.0, 4.0, 6.0, 8.0), HORIZON)
    start = trajectory.position(0.0)
    drawing.arrow(ax, start, start + trajectory.velocity(0.0), INK, "obstacle-velocity")
    drawing.label(ax, start, r"$B(t_0)$", offset=name_offset)
    drawing.robot_point(ax, np.zeros(2), "A", offset=(-7, 0))
    drawing.arrow(ax, (0, 0), ROBOT_VELOCITY, ROBOT, "velocity")
    drawing.label(ax, ROBOT_VELOCITY, r"$v_A$", offset=(6, 5), color=ROBOT)
    drawing.name_axes(ax, "x", "m")


def _velocities(ax: Axes, trajectory: Trajectory, times: Sequence[float], name: str) -> None:
    """Draw a union in velocity space with its elements and the robot's velocity."""
    blocked = obstacle_of(trajectory, Velocity())
    drawing.union(ax, blocked)
    drawing.elements(ax, blocked, times, labelled_until=LABELLED_UNTIL)
    inside = bool(blocked.contains(ROBOT_VELOCITY))
    drawing.control_point(ax, ROBOT_VELOCITY, r"$v_A$", offset=(11, -9))
    drawing.name_axes(ax, "v", "m/s")
    ax.set_title(f"{name}: $v_A$ is {'inside' if inside else 'outside'}", pad=4)


def linear_vo() -> Figure:
    """Draw the cone of the VO with its apex at the obstacle's velocity, cut off at the horizon."""
    with style():
        figure, (workspace_ax, ax) = drawing.page([(-1.5, 16.5, -9.5, 8.5), (-1.0, 10.0, -3.0, 8.0)])
        _workspace(workspace_ax, LINE, (2, 6))
        drawing.label(workspace_ax, LINE.position(0.0) + LINE.initial_velocity, r"$v_B$", offset=(-21, -5))
        workspace_ax.set_title("workspace (arrows: 1 s)", pad=4)
        _velocities(ax, LINE, TIMES, "VO")
        drawing.control_point(ax, LINE.initial_velocity, r"$v_B$", offset=(-4, -8), colour=INK)
        ends = LINE.initial_velocity + 1.6 * (LINE.initial_position + _tangent_offsets(LINE.initial_position))
        for end in ends:
            ax.plot(*np.array([LINE.initial_velocity, end]).T, color=INK, linewidth=0.7, linestyle=DASHES, zorder=1.2)
        drawing.time_bar(ax, HORIZON)
    return figure


def _tangent_offsets(centre: np.ndarray) -> np.ndarray:
    """Return the offsets (2, 2) [m] from the obstacle's centre to the tangent points of lines from the origin."""
    squared_distance = float(centre @ centre)
    along = -(RADIUS**2) / squared_distance * centre
    across = RADIUS * np.sqrt(squared_distance - RADIUS**2) / squared_distance * np.array([-centre[1], centre[0]])
    return np.stack([along + across, along - across])


def temporal_element() -> Figure:
    """Draw the obstacle at one time and its element: the obstacle scaled by 1 / t about the robot."""
    with style():
        figure, (ax,) = drawing.column((-4.0, 15.0, -2.0, 15.0))
        drawing.path(ax, CIRCLE, HORIZON, linestyle=DASHES)
        drawing.positions(ax, CIRCLE, RADIUS, (2.0, 6.0), HORIZON, labelled=False)
        blocked = obstacle_of(CIRCLE, Velocity())
        drawing.elements(ax, blocked, (2.0, 6.0))
        for t, offset in ((2.0, (-2, 14)), (6.0, (-16, 3))):
            centre = CIRCLE.position(t)
            for end in centre + _tangent_offsets(centre):
                ax.plot(*np.array([np.zeros(2), end]).T, color=FAINT, linewidth=0.6, zorder=1.6)
            drawing.label(ax, centre, f"$B({t:g}\\,$s$)$", offset=(0, 0))
            drawing.label(ax, centre / t, f"$VO({t:g}\\,$s$)$", offset=offset, size=7)
        drawing.label(ax, CIRCLE.position(0.0), r"$B(t_0)$")
        drawing.robot_point(ax, np.zeros(2), "A", offset=(-7, 0))
        drawing.name_axes(ax, "x", "m; velocities: m/s from A")
        ax.set_ylabel("y [m; m/s]", labelpad=1)
        drawing.time_bar(ax, HORIZON)
    return figure


def nlvo_circular() -> Figure:
    """Draw the NLVO of an obstacle on a circle."""
    with style():
        figure, (workspace_ax, ax) = drawing.page([(-2.0, 15.5, -2.0, 15.5), (-1.5, 9.5, -2.0, 9.0)])
        _workspace(workspace_ax, CIRCLE, (3, 8))
        workspace_ax.set_title("workspace (arrows: 1 s)", pad=4)
        _velocities(ax, CIRCLE, TIMES, "NLVO")
        drawing.time_bar(ax, HORIZON)
    return figure


def vo_beside_nlvo() -> Figure:
    """Draw VO and NLVO of the same obstacle: at constant velocity, and on the circle that it follows."""
    view = (-2.0, 9.5, -3.0, 8.0)
    with style():
        figure, (left, right) = drawing.page([view, view])
        _velocities(left, AtConstantVelocity()(CIRCLE, 0.0), TIMES, "VO")
        drawing.control_point(left, CIRCLE.velocity(0.0), r"$v_B$", offset=(-9, 0), colour=INK)
        _velocities(right, CIRCLE, TIMES, "NLVO")
        drawing.time_bar(right, HORIZON)
    return figure


LANE: Final = Circular((0.0, 20.0), 20.0, 8.0, phase=-0.5 * np.pi)
"""Lane of the robot, which is at the origin and follows it."""
CAR: Final = Circular((0.0, 20.0), 16.0, 9.2, phase=-0.5 * np.pi - 0.45)
"""Car on the next inner lane, faster than the robot and slightly behind it."""
CAR_RADIUS: Final = 2.5
CAR_HORIZON: Final = 6.0
CAR_TIMES: Final = (1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0)
CAR_ROBOT: Final = (8.0, 0.0)


def ao_nao() -> Figure:
    """Draw AO and NAO of a car in a curve with their elements, and the two predicted paths."""
    predicted = AtConstantAcceleration()(CAR, 0.0)
    span = (-7.5, 4.5, -2.5, 9.5)
    with style():
        figure, (workspace_ax, left, right) = drawing.page([(-10.5, 17.5, -5.0, 23.0), span, span], gap=0.47)
        drawing.path(workspace_ax, CAR, CAR_HORIZON)
        drawing.path(workspace_ax, predicted, 3.2, GOAL, linestyle=DASHES)
        drawing.positions(workspace_ax, CAR, CAR_RADIUS, (1.0, 2.0, 3.0, 4.0, 5.0), CAR_HORIZON)
        drawing.robot_point(workspace_ax, np.zeros(2), "A", offset=(-7, 0))
        drawing.arrow(workspace_ax, (0, 0), CAR_ROBOT, ROBOT, "velocity")
        drawing.label(workspace_ax, CAR_ROBOT, r"$v_A$", offset=(5, -6), color=ROBOT)
        drawing.path(workspace_ax, LANE, 2.2, ROBOT, linewidth=0.7, linestyle=DASHES)
        drawing.label(workspace_ax, CAR.position(0.0), r"$B$")
        drawing.label(workspace_ax, predicted.position(1.25), "AO", offset=(2, -7), color=GOAL)
        drawing.label(workspace_ax, CAR.position(3.5), "NAO", offset=(-12, 0), color=FAINT)
        drawing.name_axes(workspace_ax, "x", "m")
        workspace_ax.set_title("assumed paths", pad=4)
        for ax, trajectory, name in ((left, predicted, "AO"), (right, CAR, "NAO")):
            blocked = obstacle_of(trajectory, Acceleration(), CAR_HORIZON, CAR_ROBOT, CAR_RADIUS)
            drawing.union(ax, blocked)
            drawing.elements(ax, blocked, CAR_TIMES, labelled_until=1.6)
            lane_acceleration = LANE.acceleration(0.0)
            drawing.control_point(ax, lane_acceleration, r"$a_A$", offset=(9, -7))
            drawing.name_axes(ax, "a", "m/s²")
            ax.set_title(f"{name}: $a_A$ is {'inside' if blocked.contains(lane_acceleration) else 'outside'}", pad=4)
        drawing.control_point(left, CAR.acceleration(0.0), r"$a_B$", offset=(7, 5), colour=INK)
        drawing.time_bar(right, CAR_HORIZON)
    return figure


CONE: Final = ((0.0, 0.0), (1.5, 0.0), (0.0, 1.5))
"""[m/s] Velocities w of the robot relative to the obstacle."""
CONE_POSITION: Final = (7.0, 4.0)
CONE_ACCELERATION: Final = (-0.8, 0.4)


def ao_cone() -> Figure:
    """Draw the AO for three relative velocities; it is a straight cone if the relative velocity is zero."""
    span = (-2.5, 6.0, -3.0, 5.5)
    with style():
        figure, axes = drawing.page([span] * 3, gap=0.47)
        for ax, relative in zip(axes, CONE):
            trajectory = ConstantAcceleration(CONE_POSITION, -np.array(relative), CONE_ACCELERATION)
            blocked = obstacle_of(trajectory, Acceleration(), 8.0, (0.0, 0.0))
            drawing.union(ax, blocked)
            drawing.elements(ax, blocked, (1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 8.0), labelled_until=LABELLED_UNTIL)
            drawing.control_point(ax, CONE_ACCELERATION, r"$a_B$", offset=(-8, 0), colour=INK)
            drawing.name_axes(ax, "a", "m/s²")
            title = "$w = 0$" if not any(relative) else f"$w = ({relative[0]:g}, {relative[1]:g})$ m/s"
            ax.set_title(title, pad=4)
        for end in CONE_ACCELERATION + 1.6 * (np.array(CONE_POSITION) + _tangent_offsets(np.array(CONE_POSITION))):
            axes[0].plot(*np.array([CONE_ACCELERATION, end]).T, color=INK, linewidth=0.7, linestyle=DASHES, zorder=1.2)
        disc(axes[0], CONE_ACCELERATION, 1e-6, "apex", facecolor=INK)
        drawing.time_bar(axes[2], 8.0)
    return figure


CONE_HORIZON: Final = 50.0
"""[s] Long, so that the horizon cuts only a small tip off the cone."""
SEED: Final = 0


def in_cone(controls: Array, center: Array, radius: float, apex: Array) -> np.ndarray:
    """Return whether `controls` (n, 2) lie in the cone with this `apex` that a disc at `center` subtends at 0."""
    offsets = controls - apex
    distance = np.linalg.norm(center)
    projections = offsets @ center / distance
    cosine = np.sqrt(1.0 - (radius / distance) ** 2)
    return np.asarray(projections > cosine * np.linalg.norm(offsets, axis=1))


def measure_cone(quick: bool) -> dict[str, Any]:
    """Count, for each relative velocity, the random accelerations on which AO and cone disagree.

    Points closer to the apex than 4 times the last element are left out, because the horizon cuts the tip off.
    """
    center, apex = np.array(CONE_POSITION), np.array(CONE_ACCELERATION)
    count = 500 if quick else 20000
    rng = np.random.default_rng(SEED)
    points = rng.uniform((-3.0, -3.0), (8.0, 6.0), (count, 2))
    tip = 4.0 * 2.0 * (float(np.linalg.norm(center)) + RADIUS) / CONE_HORIZON**2
    points = points[np.linalg.norm(points - apex, axis=1) > tip]
    rows = []
    for relative in CONE:
        trajectory = ConstantAcceleration(CONE_POSITION, -np.array(relative), CONE_ACCELERATION)
        inside = obstacle_of(trajectory, Acceleration(), CONE_HORIZON, (0.0, 0.0)).contains(points)
        cone = in_cone(points, center, RADIUS, apex)
        rows.append(
            {
                "relative_velocity": list(relative),
                "points": len(points),
                "in_ao": int(inside.sum()),
                "in_cone": int(cone.sum()),
                "judged_differently": int((inside != cone).sum()),
            }
        )
    return {"seed": SEED, "horizon": CONE_HORIZON, "radius": RADIUS, "rows": rows}
