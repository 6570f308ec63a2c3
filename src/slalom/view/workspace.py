"""Drawing of the workspace: robot and obstacles now, their paths, and the first contact."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import shapely
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.text import Annotation

from slalom.base.checks import Array, vectors
from slalom.base.errors import InvalidInput
from slalom.model.goal import Goal
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Part, Shape
from slalom.model.state import State
from slalom.model.trajectory import Trajectory
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import outline_parts
from slalom.obstacle.window import ObstacleWindow
from slalom.view.style import (
    FAINT,
    GOAL,
    INK,
    NEUTRAL,
    ROBOT,
    colour_at,
    disc,
    dot,
    fading_line,
    halo,
    legend_below,
    style,
    time_scale,
    write_height,
)

# Drawing of shapes: circles for discs and balls, outlines of unions for other shapes; in space, projected along z.


def parts_at(shape: Shape, position: Array) -> list[Part]:
    """Return the parts of a shape that does not rotate, at `position` (d,) [m]."""
    return [Part(position + part.corners, part.radius) for part in shape.parts]


def region_of(parts: Sequence[Part]) -> Any:
    """Return the union of rounded convex hulls as a shapely geometry; circles have 256 corners."""
    hulls = [shapely.MultiPoint(part.corners[:, :2]).convex_hull for part in parts]
    return shapely.union_all([hull.buffer(part.radius, quad_segs=64) for hull, part in zip(hulls, parts)])


def outline(region: Any) -> Outline:
    """Return the boundaries of one or several polygons, or lines, as one matplotlib path."""
    rings = []
    for geometry in getattr(region, "geoms", [region]):
        if geometry.geom_type == "Polygon":
            rings += [
                Outline(np.asarray(ring.coords), closed=True) for ring in (geometry.exterior, *geometry.interiors)
            ]
        elif not geometry.is_empty:
            rings.append(Outline(np.asarray(geometry.coords)))
    return Outline.make_compound_path(*rings)


def silhouette(parts: Sequence[Part]) -> Outline:
    """Return the outline of `parts`, seen along the last axis in space; of walls without thickness, their lines."""
    region = region_of(parts)
    if region.area == 0.0:
        region = shapely.union_all([shapely.LineString(part.corners[:, :2]) for part in parts])
    return outline(region)


def body(ax: Axes, parts: Sequence[Part], gid: str, **properties: Any) -> Patch:
    """Draw the outline of `parts`, whose corners (n, d) [m] are in the world frame."""
    if len(parts) == 1 and len(parts[0].corners) == 1:
        return disc(ax, parts[0].corners[0], parts[0].radius, gid, **properties)
    drawn = silhouette(parts)
    if region_of(parts).area == 0.0:
        properties = {**properties, "fill": False, "linewidth": max(1.0, float(properties.get("linewidth", 1.0)))}
    patch = PathPatch(drawn, **properties)
    patch.set_gid(gid)
    ax.add_patch(patch)
    return patch


def box_of(parts: Sequence[Part]) -> Array:
    """Return the lower and upper corner (2, 2) [m] of the bounding box of `parts`."""
    low = np.min([part.corners[:, :2].min(axis=0) - part.radius for part in parts], axis=0)
    high = np.max([part.corners[:, :2].max(axis=0) + part.radius for part in parts], axis=0)
    return np.array([low, high])


STEPS: Final = 3
"""Predicted times of each obstacle beside the present one; more hide each other."""


def uncertain_regions(ax: Axes, traffic: ObstacleWindow) -> list[Line2D]:
    """Draw the region that holds each obstacle with an uncertainty, now and at STEPS predicted times.

    A region is the body of the obstacle, grown by the radius of its uncertainty.

    Returns:
        The legend entry, which states if no obstacle has an uncertainty.
    """
    known = [(i, one) for i, one in enumerate(traffic.obstacles) if one.uncertainty is not None]
    if not known:
        return [Line2D([], [], linestyle="none", label="no obstacle has an uncertainty")]
    times = np.linspace(0.0, traffic.horizon, STEPS + 1)
    for index, obstacle in known:
        assert obstacle.uncertainty is not None
        for t, radius in zip(times.tolist(), obstacle.uncertainty.radius(times, obstacle.dimension).tolist()):
            if not obstacle.exists(traffic.start + t):
                continue
            grown = [Part(part.corners, part.radius + radius) for part in outline_parts(obstacle, traffic.start + t)]
            opacity = 1.0 - 0.75 * t / traffic.horizon
            properties = {"fill": False, "edgecolor": INK, "linewidth": 0.7, "linestyle": (0, (1, 1.5))}
            body(ax, grown, f"uncertainty-{index}-{t:g}", zorder=2.6, alpha=opacity, **properties)
    shown = ", ".join(f"{t:.3g}" for t in times)
    return [Line2D([], [], color=INK, linewidth=0.7, linestyle=(0, (1, 1.5)), label=f"uncertainty, {shown} s")]


# Boxes and times of what is drawn.


Extent = tuple[float, float, float, float]
"""Limits x from, x to, y from, y to of a panel [m]."""

TIMES: Final = 40
"""[1] Times of a run at which the positions of obstacles enter the drawn box."""


def drawn_box(
    points: Array, radius: float, obstacles: Sequence[Obstacle], start: float, end: float
) -> tuple[Array, Array]:
    """Return the lower and upper corner (d,) [m] of the box of a run: robots, goals, and the obstacles near them.

    Args:
        points: (n, d) [m] positions of robots and goals. radius: [m] of the largest robot. start, end: [s] of the run.
    """
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    reach = 0.6 * float(np.max(high - low)) + 4.0 * radius
    inner_low, inner_high = low - reach, high + reach
    for obstacle in obstacles:
        first, last = max(start, obstacle.trajectory.span[0]), min(end, obstacle.trajectory.span[1])
        if first > last:
            continue
        if obstacle.at_rest:
            # A wall may begin far away: the part of its box that is near counts.
            parts = outline_parts(obstacle, first)
            corner = np.min([part.corners.min(axis=0) - part.radius for part in parts], axis=0)
            opposite = np.max([part.corners.max(axis=0) + part.radius for part in parts], axis=0)
            if ((opposite > inner_low) & (corner < inner_high)).all():
                low = np.minimum(low, np.maximum(corner, inner_low))
                high = np.maximum(high, np.minimum(opposite, inner_high))
            continue
        centres = obstacle.trajectory.position(np.linspace(first, last, TIMES))
        size = min(obstacle.shape.bounding_radius, reach)
        near = ((centres > inner_low) & (centres < inner_high)).all(axis=1)
        if near.any():
            low = np.minimum(low, np.maximum(centres[near].min(axis=0) - size, inner_low))
            high = np.maximum(high, np.minimum(centres[near].max(axis=0) + size, inner_high))
    pad = 0.04 * float(np.max(high - low)) + radius
    return low - pad, high + pad


def padded_extent(points: Array, min_aspect: float) -> Extent:
    """Return a bounding box of points (n, 2) with a margin of 5 %; the ratio of its sides is at least `min_aspect`."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, sides = 0.5 * (low + high), 1.1 * (high - low)
    half = 0.5 * np.maximum(sides, max(min_aspect * float(sides.max()), 1e-3))
    return (middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1])


def disc_box(center: Array, radius: float) -> Array:
    """Return the lower and upper corner (2, 2) of the bounding box of a disc."""
    return np.array([center[:2] - radius, center[:2] + radius])


def times_within(trajectory: Trajectory, start: float, end: float, count: int) -> Array:
    """Return evenly spaced times (count,) [s] from start to end within the span of a trajectory; none if disjoint."""
    first, last = trajectory.span
    begin, finish = max(start, first), min(end, last)
    return np.linspace(begin, finish, count) if begin < finish else np.empty(0)


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
    # So that two of them are not 0.
    ax.locator_params(min_n_ticks=3)


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
