"""Drawing of the workspace: robot and obstacles now, their paths, and the first contact."""

from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch
from matplotlib.text import Annotation

from slalom.checks import Array, vectors
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.manoeuvre import Manoeuvre
from slalom.obstacle.minkowski import outline_parts
from slalom.obstacle.window import ObstacleWindow
from slalom.shape import Shape
from slalom.state import State
from slalom.view.bodies import body, box_of, parts_at
from slalom.view.extent import Extent, padded_extent, times_within
from slalom.view.goals import draw_goal, draw_target, goal_box
from slalom.view.style import (
    FAINT,
    INK,
    NEUTRAL,
    ROBOT,
    colour_at,
    dot,
    fading_line,
    halo,
    legend_below,
    style,
    time_scale,
    write_height,
)
from slalom.view.uncertain import uncertain_regions

_HEIGHT_LABEL: Final = (0.075, 0.04)
"""[1] Width and height of the label of a height as shares of the panel, at the width of a page."""

_MAX_HEIGHT_LABELS: Final = 12
"""In space: largest number of obstacles labelled with their height."""


def workspace(
    ax: Axes,
    *,
    traffic: ObstacleWindow,
    state: State,
    robot: Shape,
    goal: Goal | None = None,
    target: Goal | None = None,
    manoeuvre: Manoeuvre | None = None,
    preferred: Manoeuvre | None = None,
    track: npt.ArrayLike | None = None,
    contact_times: npt.ArrayLike | None = None,
    extent: Extent | None = None,
    uncertainty: bool = False,
) -> Axes:
    """Draw the input of one decision: positions now, and predicted paths over the horizon that fade with time.

    In space the view is along z; heights are written beside the balls.

    Args:
        traffic: predicted obstacles, from its `start` over its `horizon`.
        state, robot: state and shape of the robot now; an arrow shows its displacement in one second.
        target: point of the path of a `PathGoal` to which the preferred control leads.
        manoeuvre: chosen manoeuvre, drawn over the horizon with a dot at every second.
        preferred: manoeuvre of the preferred control, dashed up to the first contact, where both outlines are drawn.
        track: positions (T, d) [m] up to now.
        contact_times: (n,) [s] of contact with each obstacle under the preferred control, inf for none; sets its
            colour.
        extent: x from, x to, y from, y to [m]; by default all positions now, and the goal.
        uncertainty: whether to draw the regions that hold obstacles with an uncertainty, now and later.

    Returns:
        `ax`.

    Raises:
        InvalidInput: contact times or a track whose shape does not match the obstacles or the state.
    """
    times = _contact_times(contact_times, traffic)
    past = None if track is None else vectors(track, "track", state.dimension).reshape(-1, state.dimension)
    with style():
        handles = [
            _robot(ax, state, robot),
            *_obstacles(ax, traffic, times),
            *_robot_paths(ax, traffic, manoeuvre, preferred, past, times),
        ]
        if preferred is not None:
            _contact(ax, traffic, robot, preferred, times)
        if goal is not None:
            handles.append(draw_goal(ax, goal, traffic.start, traffic.start, traffic.start + traffic.horizon))
        if target is not None:
            handles.append(draw_target(ax, target.position(traffic.start)))
        if uncertainty:
            handles += uncertain_regions(ax, traffic)
        left, right, low, high = extent or _extent(traffic, state, robot, goal, past)
        _thin_heights(ax, right - left)
        ax.set(xlim=(left, right), ylim=(low, high))
        ax.set_aspect("equal")
        label_axes(ax, "" if state.dimension == 2 else "   (seen along z; numbers: z [m])")
        ax.set_title(f"workspace at t = {traffic.start:.4g} s", pad=4)
        legend_below(ax, handles, 2)
    return ax


def _contact_times(contact_times: npt.ArrayLike | None, traffic: ObstacleWindow) -> Array:
    count = len(traffic.obstacles)
    if contact_times is None:
        return np.full(count, np.inf)
    times = np.asarray(contact_times, dtype=np.float64)
    if times.shape != (count,):
        raise InvalidInput(f"contact_times: expected one for each of {count} obstacles, found shape {times.shape}")
    return times


def label_axes(ax: Axes, view: str) -> None:
    """Label the axes; `view` describes the projection in space."""
    ax.set_xlabel(f"x [m]{view}")
    ax.set_ylabel("y [m]", labelpad=1)


def _thin_heights(ax: Axes, side: float) -> None:
    """Remove heights that others hide in a square view of `side` [m]; first stays that of the robot, then the last."""
    kept: list[Array] = []
    texts = [text for text in ax.texts if text.get_gid() == "height"]
    for text in [*texts[:1], *texts[:0:-1]]:
        place = np.asarray(text.xy if isinstance(text, Annotation) else text.get_position())
        if any(np.all(np.abs(place - other) < np.multiply(_HEIGHT_LABEL, side)) for other in kept):
            text.remove()
        else:
            kept.append(place)


def _obstacles(ax: Axes, traffic: ObstacleWindow, times: Array) -> list[Line2D]:
    """Draw obstacles and predicted paths, coloured by time to collision, earliest on top; return legend entries."""
    scale = time_scale(traffic.horizon)
    present = [i for i, obstacle in enumerate(traffic.obstacles) if obstacle.exists(traffic.start)]
    labelled = sorted(present, key=lambda i: float(times[i]))[:_MAX_HEIGHT_LABELS]
    for rank, index in enumerate(sorted(range(len(times)), key=lambda i: -float(times[i]))):
        obstacle, colliding = traffic.obstacles[index], bool(np.isfinite(times[index]))
        colour: Any = colour_at(scale, times[index]) if colliding else NEUTRAL
        path_times = times_within(obstacle.trajectory, traffic.start, traffic.start + traffic.horizon, 49)
        if path_times.size:
            points = obstacle.trajectory.position(path_times)
            line_colour = colour if colliding else FAINT
            fading_line(
                ax,
                points,
                line_colour,
                width=1.0 if colliding else 0.6,
                min_opacity=0.08,
                zorder=2.0 if colliding else 1.0,
            )
        if index in present:
            z = 3.0 + 0.9 * rank / max(1, len(times))
            properties = {"facecolor": colour, "edgecolor": INK, "linewidth": 0.6 if colliding else 0.4}
            body(ax, outline_parts(obstacle, traffic.start), f"obstacle-{index}", zorder=z, **properties)
            if obstacle.dimension == 3 and index in labelled:
                write_height(ax, obstacle.trajectory.position(traffic.start), obstacle.shape.bounding_radius)
    handles = []
    if np.any(np.isfinite(times)):
        handles.append(dot(colour_at(scale, float(times.min())), INK, "hit by preferred (colour: t)"))
    if not np.all(np.isfinite(times)):
        handles.append(dot(NEUTRAL, INK, "obstacle and path"))
    return handles


def _robot_paths(
    ax: Axes,
    traffic: ObstacleWindow,
    manoeuvre: Manoeuvre | None,
    preferred: Manoeuvre | None,
    track: Array | None,
    times: Array,
) -> list[Line2D]:
    """Draw the robot's track, its preferred path up to the first contact, and its chosen path."""
    start, end = traffic.start, traffic.start + traffic.horizon
    handles = []
    if track is not None:
        (line,) = ax.plot(track[:, 0], track[:, 1], color=ROBOT, linewidth=1.0, alpha=0.55, zorder=4.1, label="track")
        line.set_gid("track")
        handles.append(line)
    if preferred is not None:
        contact = start + float(times.min(initial=np.inf))
        points = preferred.position(np.linspace(start, min(end, contact), 97))
        (line,) = ax.plot(*points.T[:2], color=INK, linewidth=0.9, linestyle=(0, (4, 2)), zorder=4.2)
        line.set_label("preferred" if contact > end else "preferred, to first contact")
        line.set_gid("preferred-path")
        handles.append(line)
    if manoeuvre is not None:
        properties: dict[str, Any] = {"color": ROBOT, "linewidth": 1.5, "marker": "o", "markersize": 2.4}
        path_times = np.linspace(start, end, 97)
        (line,) = ax.plot(*manoeuvre.position(path_times).T[:2], color=ROBOT, linewidth=1.5, zorder=4.3)
        line.set_path_effects(halo(2.7))
        line.set_gid("manoeuvre-path")
        seconds = np.arange(start + 1.0, end + 1e-9, 1.0)
        ax.plot(*manoeuvre.position(seconds).T[:2], **properties | {"linestyle": "none"}, zorder=4.4)
        handles.append(Line2D([], [], **properties, label="chosen, dot per second"))
    return handles


def _contact(ax: Axes, traffic: ObstacleWindow, robot: Shape, preferred: Manoeuvre, times: Array) -> None:
    """Outline the robot and the first obstacle that it collides with under the preferred control, at contact."""
    if not np.isfinite(times.min(initial=np.inf)):
        return
    first = int(np.argmin(times))
    contact_time, other = traffic.start + float(times[first]), traffic.obstacles[first]
    properties: dict[str, Any] = {
        "fill": False,
        "edgecolor": INK,
        "linewidth": 0.7,
        "linestyle": (0, (2, 1.2)),
        "zorder": 5.6,
    }
    body(ax, parts_at(robot, preferred.position(contact_time)), "contact-robot", **properties)
    body(ax, outline_parts(other, contact_time), "contact-obstacle", **properties)


def _robot(ax: Axes, state: State, robot: Shape) -> Line2D:
    """Draw the robot now, with an arrow of its displacement in one second."""
    body(ax, parts_at(robot, state.position), "robot", facecolor=ROBOT, edgecolor=INK, linewidth=0.7, zorder=5)
    if state.dimension == 3:
        write_height(ax, state.position, robot.bounding_radius)
    if np.linalg.norm(state.velocity[:2]) > 0.0:
        x, y = (float(c) for c in state.position[:2])
        arrow = FancyArrowPatch(
            (x, y),
            (x + float(state.velocity[0]), y + float(state.velocity[1])),
            arrowstyle="-|>,head_length=3,head_width=1.6",
            color=INK,
            linewidth=1.0,
            shrinkA=0,
            shrinkB=0,
            zorder=5.5,
        )
        arrow.set_gid("velocity")
        ax.add_patch(arrow)
    return dot(ROBOT, INK, "robot, arrow: 1 s")


def _extent(traffic: ObstacleWindow, state: State, robot: Shape, goal: Goal | None, track: Array | None) -> Extent:
    """Return a square around robot and obstacles now, the velocity arrow, the track and the goal."""
    points = [box_of(parts_at(robot, state.position)), state.position[None, :2] + state.velocity[:2]]
    for obstacle in traffic.obstacles:
        if obstacle.exists(traffic.start):
            points.append(box_of(outline_parts(obstacle, traffic.start)))
    if goal is not None:
        points.append(goal_box(goal, traffic.start))
    if track is not None:
        points.append(track[:, :2])
    return padded_extent(np.concatenate(points), 1.0)
