"""Drawing of goals, of paths that lead to them, and of the point ahead on a path."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from slalom.checks import Array
from slalom.goal import Goal
from slalom.path_goal import PathGoal
from slalom.view.extent import disc_box, times_within
from slalom.view.style import GOAL, disc, dot, fading_line, halo, write_height

PATH_DASHES: Final = (0, (5, 2.5))
"""Dashes of the path that leads to a goal."""


def draw_goal(ax: Axes, goal: Goal, now: float, start: float, end: float) -> Line2D:
    """Draw the goal at time `now` [s]: tolerance as a circle, a cross at the center, its path if it moves or has one.

    The path of a goal that moves is that from `start` to `end` [s]; that of a `PathGoal` leads to it.
    """
    center = goal.position(now)
    disc(ax, center, goal.tolerance, "goal", fill=False, edgecolor=GOAL, linewidth=1.1, zorder=5.8)
    ax.plot(*center[:2], linestyle="none", marker="+", markersize=5, markeredgewidth=0.9, color=GOAL, zorder=5.8)
    if center.size == 3:
        write_height(ax, center, goal.tolerance)
    path_times = times_within(goal.trajectory, start, end, 49)
    if path_times.size and goal.trajectory.speed_bound(float(path_times[0]), float(path_times[-1])) > 0.0:
        fading_line(ax, goal.position(path_times), GOAL, width=0.8, min_opacity=0.1, zorder=2.1)
    handle = dot("none", GOAL, "goal")
    if isinstance(goal, PathGoal):
        draw_goal_path(ax, goal)
        handle.set(linestyle=PATH_DASHES, linewidth=0.9, color=GOAL, label="goal and path")
    return handle


def draw_goal_path(ax: Axes, goal: Goal, axes: Sequence[int] = (0, 1)) -> None:
    """Draw the path that leads to a `PathGoal`, along two axes; nothing for other goals."""
    if isinstance(goal, PathGoal):
        points = goal.points[:, list(axes)]
        ax.plot(*points.T, color=GOAL, linewidth=0.9, linestyle=PATH_DASHES, zorder=2.1, gid="goal-path")


def draw_target(ax: Axes, position: Array) -> Line2D:
    """Draw the point of the path to which the preferred control leads."""
    properties: dict[str, Any] = {"linestyle": "none", "marker": "D", "markersize": 3.4, "color": GOAL}
    (mark,) = ax.plot(*position[:2], **properties, zorder=5.7, gid="target")
    mark.set_path_effects(halo(2.0))
    return Line2D([], [], **properties, label="point ahead on the path")


def goal_box(goal: Goal, now: float) -> Array:
    """Return the corners (n, 2) [m] of what `draw_goal` draws at time `now` [s]."""
    box = disc_box(goal.position(now), goal.tolerance)
    return np.concatenate([box, goal.points[:, :2]]) if isinstance(goal, PathGoal) else box
