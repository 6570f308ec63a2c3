"""Figure of a run of several robots: all tracks alike, coloured by time."""

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from slalom.checks import Array
from slalom.path_goal import PathGoal
from slalom.sim import Recording
from slalom.view.bodies import body, box_of, parts_at
from slalom.view.extent import padded_extent
from slalom.view.figure import TIMES, column_axes, obstacle_boxes, obstacle_paths
from slalom.view.goals import draw_goal_path
from slalom.view.style import GOAL, INK, NEUTRAL, colour_at, colour_bar, halo, style
from slalom.view.workspace import label_axes

_HEAD: Final = 0.45
"""[inch] Height of the title and the legend of a fleet."""

SIDES: Final = (
    ((0, 1), "center", "bottom"),
    ((0, -1), "center", "top"),
    ((1, 0), "left", "center"),
    ((-1, 0), "right", "center"),
)
"""Sides of a robot for its name, in order: direction, and the alignment of the text."""

_CROSS: Final[dict[str, Any]] = {
    "marker": "x",
    "color": GOAL,
    "linestyle": "none",
    "markersize": 4.5,
    "markeredgewidth": 1.1,
}


def fleet(recording: Recording, *, names: bool = False, title: str | None = None) -> Figure:
    """Draw the tracks of all robots of a run, their bodies at the first and the last time, and their goals.

    The colour is the time, so that robots of one colour were there together; no robot is drawn unlike the others.

    Args:
        names: whether the name of each robot stands beside its start.
        title: by default scenario and method; "" for none.
    """
    times, positions = np.asarray(recording.times), np.asarray(recording.positions)
    scale = ScalarMappable(Normalize(float(times[0]), float(times[-1])), TIMES)
    ends = np.array([times[0], times[-1]])
    # In a periodic world the goals are far away, so that robots never arrive.
    goals = recording.goals if recording.period is None else ()
    corners = [box_of(parts_at(shape, positions[0, k])) for k, shape in enumerate(recording.shapes)]
    corners += [positions[:, k, :2] for k in range(positions.shape[1])]
    corners += [np.asarray(goal.position(float(times[-1])))[None, :2] for goal in goals]
    corners += [goal.points[:, :2] for goal in goals if isinstance(goal, PathGoal)]
    left, right, low, high = padded_extent(np.concatenate(corners + obstacle_boxes(recording.obstacles, ends)), 0.4)
    with style():
        ax = column_axes((high - low) / (right - left), _HEAD)
        figure = ax.get_figure(root=True)
        assert figure is not None
        obstacle_paths(ax, recording.obstacles, ends, scale)
        for k in range(positions.shape[1]):
            _robot(ax, recording, k, scale)
        for k, goal in enumerate(goals):
            ax.plot(*goal.position(float(times[-1]))[:2], **_CROSS, gid=f"goal-{k}", zorder=4.5)
            draw_goal_path(ax, goal)
        ax.set(xlim=(left, right), ylim=(low, high))
        ax.set_aspect("equal")
        if names:
            _names(ax, recording, positions[0])
        label_axes(ax, "   (seen along z)" if positions.shape[2] == 3 else "")
        colour_bar(scale, ax, "time [s]", MaxNLocator(6, steps=[1, 2, 5, 10]))
        _legend(ax, recording, bool(len(goals)))
        heading = f"{recording.scenario}, {recording.method}" if title is None else title
        figure.text(0.5, 0.985, heading, ha="center", va="top", fontsize=7.5)
    return figure


def _robot(ax: Axes, recording: Recording, k: int, scale: ScalarMappable) -> None:
    """Draw the track of a robot, a ring at its start, which others may end at, and its body at its end."""
    times, points = np.asarray(recording.times), np.asarray(recording.positions)[:, k]
    pieces = np.stack([points[:-1, :2], points[1:, :2]], axis=1)
    track = LineCollection(list(pieces), array=0.5 * (times[1:] + times[:-1]), linewidths=1.1, zorder=3)
    track.set(cmap=scale.cmap, norm=scale.norm, capstyle="round", gid=f"track-{k}")
    ax.add_collection(track, autolim=False)
    first, last = colour_at(scale, float(times[0])), colour_at(scale, float(times[-1]))
    shape = recording.shapes[k]
    body(ax, parts_at(shape, points[0]), f"start-{k}", zorder=4.4, facecolor="none", edgecolor=first, linewidth=0.9)
    body(ax, parts_at(shape, points[-1]), f"end-{k}", zorder=4.2, facecolor=last, edgecolor=INK, linewidth=0.5)


def _names(ax: Axes, recording: Recording, starts: Array) -> None:
    """Write the name of each robot beside its start: above it, or on the first side where it covers no other name."""
    ax.apply_aspect()
    taken: list[Bbox] = []
    for k, (name, start, shape) in enumerate(zip(recording.names, starts, recording.shapes, strict=True)):
        text = ax.annotate(name, start[:2], (0, 0), textcoords="offset points", fontsize=5, zorder=8)
        for (x, y), across, up in [*SIDES, SIDES[0]]:
            text.xy = (start[0] + x * shape.bounding_radius, start[1] + y * shape.bounding_radius)
            text.set(position=(x, y), ha=across, va=up)
            box = text.get_window_extent()
            if not box.count_overlaps(taken):
                break
        taken.append(box)
        text.set_path_effects(halo(1.6))
        text.set_gid(f"name-{k}")


def _legend(ax: Axes, recording: Recording, with_goals: bool) -> None:
    """Draw the legend above the axes."""
    middle = TIMES(0.5)
    circle: dict[str, Any] = {"marker": "o", "linestyle": "none", "markersize": 5}
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=middle, linewidth=1.1, label="track"),
        Line2D([], [], **circle, markerfacecolor="white", markeredgecolor=TIMES(0.0), label="start"),
        Line2D([], [], **circle, markerfacecolor=TIMES(1.0), markeredgecolor=INK, label="end"),
    ]
    if with_goals:
        handles.append(Line2D([], [], **_CROSS, label="goal"))
    if any(obstacle.at_rest for obstacle in recording.obstacles):
        handles.append(Patch(facecolor=NEUTRAL, edgecolor=INK, linewidth=0.5, label="obstacle"))
    ax.legend(
        handles=handles,
        loc="lower center",
        bbox_to_anchor=(0.5, 1.01),
        ncols=len(handles),
        borderaxespad=0.0,
        columnspacing=0.9,
        handlelength=1.2,
        handletextpad=0.4,
    )
