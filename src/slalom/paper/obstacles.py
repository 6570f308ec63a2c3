"""The drawn definitions: the moving obstacle, VO, its element, NLVO, VO beside NLVO, AO and NAO.

The obstacles are grown by the robot's radius, the robot is a point at the origin.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slalom.control_obstacle import ControlObstacle
from slalom.forecast import AtConstantAcceleration, AtConstantVelocity
from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.paper import drawing
from slalom.paper.drawing import DASHES
from slalom.response import Acceleration, Response, Velocity
from slalom.shape import Disc
from slalom.state import State
from slalom.trajectory import Circular, ConstantAcceleration, ConstantVelocity, Trajectory
from slalom.view.style import FAINT, GOAL, INK, ROBOT, disc, style

RADIUS: Final = 1.6
"""[m] Of the obstacle and the robot together."""
ROBOT_VELOCITY: Final = (3.2, 0.3)
STRAIGHT: Final = ConstantVelocity((8.0, 5.0), (0.6, -1.3))
ROUND: Final = Circular((7.8, 8.7), 4.5, -2.2, phase=-0.37)
"""Comes towards the robot's way, as if to meet it after 3 s, and turns off."""
HORIZON: Final = 10.0
TIMES: Final = (1.2, 1.6, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0)
NAMED: Final = 2.0
"""[s] Latest time that is written into its element."""
NEVER: Final = 0.01
"""[m] Radius of the robot where obstacles are grown already; shapes are not points."""


def obstacle_of(
    trajectory: Trajectory,
    response: Response,
    horizon: float = HORIZON,
    velocity: Sequence[float] = ROBOT_VELOCITY,
    radius: float = RADIUS,
) -> ControlObstacle:
    """The control obstacle of one obstacle for a robot at the origin."""
    traffic = ObstacleTable([Obstacle(Disc(radius - NEVER), trajectory)], 0.0, horizon)
    return ControlObstacle(response, State((0.0, 0.0), velocity), traffic, Disc(NEVER))


def moving_obstacle() -> Figure:
    """Obstacle B moves along c(t); the robot A sees it at c(t0)."""
    with style():
        figure, (ax,) = drawing.column((-2.0, 15.5, -2.5, 15.5))
        drawing.path(ax, ROUND, HORIZON)
        drawing.positions(ax, ROUND, RADIUS, (2.0, 4.0, 6.0, 8.0), HORIZON)
        start, speed = ROUND.position(0.0), ROUND.velocity(0.0)
        drawing.arrow(ax, start, start + speed, INK, "obstacle-velocity")
        drawing.label(ax, start + speed, r"$v_B$", away=(5, -7))
        drawing.label(ax, start, r"$B(t_0)$", away=(4, 7))
        drawing.label(ax, ROUND.position(5.0), r"$c(t)$", away=(-11, -2), color=FAINT)
        drawing.cross(ax, np.zeros(2), "A", away=(-7, 0))
        drawing.arrow(ax, (0, 0), ROBOT_VELOCITY, ROBOT, "velocity")
        drawing.label(ax, ROBOT_VELOCITY, r"$v_A$", away=(6, 5), color=ROBOT)
        drawing.name_axes(ax, "x", "m")
        drawing.time_bar(ax, HORIZON)
    return figure


def _velocities(ax: Axes, trajectory: Trajectory, times: Sequence[float], name: str) -> None:
    """A union in velocity space with its elements and the robot's velocity."""
    blocked = obstacle_of(trajectory, Velocity())
    drawing.union(ax, blocked)
    drawing.elements(ax, blocked, times, named=NAMED)
    inside = bool(blocked.contains(ROBOT_VELOCITY))
    drawing.point(ax, ROBOT_VELOCITY, r"$v_A$", away=(11, -9))
    drawing.name_axes(ax, "v", "m/s")
    ax.set_title(f"{name}: $v_A$ is {'inside' if inside else 'outside'}", pad=4)


def linear_vo() -> Figure:
    """A cone with its apex at the obstacle's velocity, cut off at the horizon."""
    with style():
        figure, (place, ax) = drawing.page([(-1.5, 16.5, -9.5, 8.5), (-1.0, 10.0, -3.0, 8.0)])
        _straight_scene(place)
        _velocities(ax, STRAIGHT, TIMES, "VO")
        drawing.point(ax, STRAIGHT.initial_velocity, r"$v_B$", away=(-4, -8), colour=INK)
        far = STRAIGHT.initial_velocity + 1.6 * (STRAIGHT.initial_position + _sides(STRAIGHT.initial_position))
        for end in far:
            ax.plot(
                *np.array([STRAIGHT.initial_velocity, end]).T, color=INK, linewidth=0.7, linestyle=DASHES, zorder=1.2
            )
        drawing.time_bar(ax, HORIZON)
    return figure


def _sides(centre: np.ndarray) -> np.ndarray:
    """From the centre of the obstacle to where the tangents from the origin touch it (2, 2)."""
    square = float(centre @ centre)
    along = -(RADIUS**2) / square * centre
    across = RADIUS * np.sqrt(square - RADIUS**2) / square * np.array([-centre[1], centre[0]])
    return np.stack([along + across, along - across])


def _straight_scene(ax: Axes) -> None:
    drawing.path(ax, STRAIGHT, HORIZON)
    drawing.positions(ax, STRAIGHT, RADIUS, (2.0, 4.0, 6.0, 8.0), HORIZON)
    start, speed = STRAIGHT.initial_position, STRAIGHT.initial_velocity
    drawing.arrow(ax, start, start + speed, INK, "obstacle-velocity")
    drawing.label(ax, start, r"$B(t_0)$", away=(2, 6))
    drawing.label(ax, start + speed, r"$v_B$", away=(9, 2))
    drawing.cross(ax, np.zeros(2), "A", away=(-7, 0))
    drawing.arrow(ax, (0, 0), ROBOT_VELOCITY, ROBOT, "velocity")
    drawing.label(ax, ROBOT_VELOCITY, r"$v_A$", away=(6, 6), color=ROBOT)
    drawing.name_axes(ax, "x", "m")
    ax.set_title("workspace (arrows: 1 s)", pad=4)


def temporal_element() -> Figure:
    """The obstacle at one time and the velocities that lead there: a copy scaled by 1 / t about the robot."""
    with style():
        figure, (ax,) = drawing.column((-4.0, 15.0, -2.0, 15.0))
        drawing.path(ax, ROUND, HORIZON, linestyle=DASHES)
        drawing.positions(ax, ROUND, RADIUS, (2.0, 6.0), HORIZON, name=False)
        blocked = obstacle_of(ROUND, Velocity())
        drawing.elements(ax, blocked, (2.0, 6.0))
        for t, away in ((2.0, (-2, 14)), (6.0, (-16, 3))):
            centre = ROUND.position(t)
            for end in centre + _sides(centre):
                ax.plot(*np.array([np.zeros(2), end]).T, color=FAINT, linewidth=0.6, zorder=1.6)
            drawing.label(ax, centre, f"$B({t:g}\\,$s$)$", away=(0, 0))
            drawing.label(ax, centre / t, f"$VO({t:g}\\,$s$)$", away=away, size=7)
        drawing.label(ax, ROUND.position(0.0), r"$B(t_0)$")
        drawing.cross(ax, np.zeros(2), "A", away=(-7, 0))
        drawing.name_axes(ax, "x", "m; velocities: m/s from A")
        ax.set_ylabel("y [m; m/s]", labelpad=1)
        drawing.time_bar(ax, HORIZON)
    return figure


def nlvo_circular() -> Figure:
    """The NLVO of an obstacle on a circle: the same union, bent as the path bends."""
    with style():
        figure, (place, ax) = drawing.page([(-2.0, 15.5, -2.0, 15.5), (-1.5, 9.5, -2.0, 9.0)])
        drawing.path(place, ROUND, HORIZON)
        drawing.positions(place, ROUND, RADIUS, (2.0, 4.0, 6.0, 8.0), HORIZON)
        start = ROUND.position(0.0)
        drawing.arrow(place, start, start + ROUND.velocity(0.0), INK, "obstacle-velocity")
        drawing.label(place, start, r"$B(t_0)$", away=(3, 8))
        drawing.cross(place, np.zeros(2), "A", away=(-7, 0))
        drawing.arrow(place, (0, 0), ROBOT_VELOCITY, ROBOT, "velocity")
        drawing.label(place, ROBOT_VELOCITY, r"$v_A$", away=(6, 5), color=ROBOT)
        drawing.name_axes(place, "x", "m")
        place.set_title("workspace (arrows: 1 s)", pad=4)
        _velocities(ax, ROUND, TIMES, "NLVO")
        drawing.time_bar(ax, HORIZON)
    return figure


def vo_beside_nlvo() -> Figure:
    """The same obstacle twice: as if it kept its velocity, and on the circle that it follows."""
    view = (-2.0, 9.5, -3.0, 8.0)
    with style():
        figure, (left, right) = drawing.page([view, view])
        _velocities(left, AtConstantVelocity()(ROUND, 0.0), TIMES, "VO")
        drawing.point(left, ROUND.velocity(0.0), r"$v_B$", away=(-9, 0), colour=INK)
        _velocities(right, ROUND, TIMES, "NLVO")
        drawing.time_bar(right, HORIZON)
    return figure


LANE: Final = Circular((0.0, 20.0), 20.0, 8.0, phase=-0.5 * np.pi)
"""The robot's lane; it is at the origin and follows it."""
CAR: Final = Circular((0.0, 20.0), 16.0, 9.2, phase=-0.5 * np.pi - 0.45)
"""On the next lane inside, faster, and a little behind."""
CAR_RADIUS: Final = 2.5
CAR_HORIZON: Final = 6.0
CAR_TIMES: Final = (1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0)
CAR_ROBOT: Final = (8.0, 0.0)


def ao_nao() -> Figure:
    """AO and NAO of a car in a curve with their elements, and the two paths that they assume."""
    assumed = AtConstantAcceleration()(CAR, 0.0)
    span = (-7.5, 4.5, -2.5, 9.5)
    with style():
        figure, (place, left, right) = drawing.page([(-10.5, 17.5, -5.0, 23.0), span, span], gap=0.47)
        drawing.path(place, CAR, CAR_HORIZON)
        drawing.path(place, assumed, 3.2, GOAL, linestyle=DASHES)
        drawing.positions(place, CAR, CAR_RADIUS, (1.0, 2.0, 3.0, 4.0, 5.0), CAR_HORIZON)
        drawing.cross(place, np.zeros(2), "A", away=(-7, 0))
        drawing.arrow(place, (0, 0), CAR_ROBOT, ROBOT, "velocity")
        drawing.label(place, CAR_ROBOT, r"$v_A$", away=(5, -6), color=ROBOT)
        drawing.path(place, LANE, 2.2, ROBOT, linewidth=0.7, linestyle=DASHES)
        drawing.label(place, CAR.position(0.0), r"$B$")
        drawing.label(place, assumed.position(1.25), "AO", away=(2, -7), color=GOAL)
        drawing.label(place, CAR.position(3.5), "NAO", away=(-12, 0), color=FAINT)
        drawing.name_axes(place, "x", "m")
        place.set_title("assumed paths", pad=4)
        for ax, trajectory, name in ((left, assumed, "AO"), (right, CAR, "NAO")):
            blocked = obstacle_of(trajectory, Acceleration(), CAR_HORIZON, CAR_ROBOT, CAR_RADIUS)
            drawing.union(ax, blocked)
            drawing.elements(ax, blocked, CAR_TIMES, named=1.6)
            own = LANE.acceleration(0.0)
            drawing.point(ax, own, r"$a_A$", away=(9, -7))
            drawing.name_axes(ax, "a", "m/s²")
            ax.set_title(f"{name}: $a_A$ is {'inside' if blocked.contains(own) else 'outside'}", pad=4)
        drawing.point(left, CAR.acceleration(0.0), r"$a_B$", away=(7, 5), colour=INK)
        drawing.time_bar(right, CAR_HORIZON)
    return figure


CONE: Final = ((0.0, 0.0), (1.5, 0.0), (0.0, 1.5))
"""Velocities w of the robot relative to the obstacle [m/s]."""
CONE_PLACE: Final = (7.0, 4.0)
CONE_ACCELERATION: Final = (-0.8, 0.4)


def ao_cone() -> Figure:
    """The AO is a straight cone with apex at the obstacle's acceleration if the relative velocity is zero."""
    span = (-2.5, 6.0, -3.0, 5.5)
    with style():
        figure, axes = drawing.page([span] * 3, gap=0.47)
        for ax, relative in zip(axes, CONE):
            trajectory = ConstantAcceleration(CONE_PLACE, -np.array(relative), CONE_ACCELERATION)
            blocked = obstacle_of(trajectory, Acceleration(), 8.0, (0.0, 0.0))
            drawing.union(ax, blocked)
            drawing.elements(ax, blocked, (1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 8.0), named=NAMED)
            drawing.point(ax, CONE_ACCELERATION, r"$a_B$", away=(-8, 0), colour=INK)
            drawing.name_axes(ax, "a", "m/s²")
            words = "$w = 0$" if not any(relative) else f"$w = ({relative[0]:g}, {relative[1]:g})$ m/s"
            ax.set_title(words, pad=4)
        for end in CONE_ACCELERATION + 1.6 * (np.array(CONE_PLACE) + _sides(np.array(CONE_PLACE))):
            axes[0].plot(*np.array([CONE_ACCELERATION, end]).T, color=INK, linewidth=0.7, linestyle=DASHES, zorder=1.2)
        disc(axes[0], CONE_ACCELERATION, 1e-6, "apex", facecolor=INK)
        drawing.time_bar(axes[2], 8.0)
    return figure
