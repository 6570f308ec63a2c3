"""Complete figures: one decision in two panels, a whole run, and a study over the values of a setting."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from slalom.base.checks import Array, array, vectors
from slalom.base.errors import InvalidInput
from slalom.decision import Decision
from slalom.decision.navigator import Navigator
from slalom.model.goal import Goal
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Shape
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import outline_parts
from slalom.sim.explanation import DrawnControls, beginning_of, drawn_controls, kind, known_at
from slalom.sim.sweep.tables import scenario_text, varied
from slalom.view.control_space import Extent, admissible_region, control_space
from slalom.view.style import COLUMN, GOAL, INK, NEUTRAL, PAGE, ROBOT, colour_at, colour_bar, halo, style
from slalom.view.workspace import (
    body,
    box_of,
    draw_goal,
    goal_box,
    label_axes,
    padded_extent,
    parts_at,
    times_within,
    workspace,
)

TIMES: Final = ListedColormap(mpl.colormaps["viridis_r"](np.linspace(0.06, 1.0, 256)))
"""Colour map of the times of a run: later is darker."""

_SMALL_SHARE: Final = 0.2
"""[1] An admissible set smaller than this share of the panel is also shown enlarged, in a corner."""


def decision(
    decision: Decision,
    navigator: Navigator,
    goal: Goal,
    *,
    track: npt.ArrayLike | None = None,
    title: str | None = None,
    axes: tuple[Axes, Axes] | None = None,
    extent: Extent | None = None,
    resolution: int = 201,
    uncertainty: bool = False,
) -> Figure:
    """Draw the workspace and the control space of one decision, side by side.

    The workspace is that of the decision. The control space is the one from which its manoeuvre was chosen: that of a
    kept manoeuvre is that of its start, as its title states.

    Args:
        decision: result of `navigator.decide` for `goal`.
        track: positions (T, d) [m] of the robot up to now.
        title: title above both panels; by default method and outcome, "" for none.
        axes: axes of the two panels; by default on a new figure of a page's width.
        extent: x from, x to, y from, y to [m] of the workspace; by default all positions, and the goal.
        resolution: number of grid points of the control space along each axis.
        uncertainty: whether to draw the regions that hold obstacles with an uncertainty.
    """
    now, then = known_at(decision), beginning_of(decision)
    present, controls = drawn_controls(now), drawn_controls(then)
    blocked, preferred = present.blocked, present.preferred
    state, traffic = blocked.state, blocked.obstacles
    target = now.goal if isinstance(goal, PathGoal) else None
    with style():
        left, right = axes or _panels(3 + (track is not None) + uncertainty + (target is not None))
        figure = left.get_figure(root=True)
        assert figure is not None
        workspace(
            left,
            traffic=traffic,
            state=state,
            robot=navigator.robot,
            goal=goal,
            target=target,
            manoeuvre=decision.manoeuvre,
            preferred=Manoeuvre(blocked.response, state, preferred, now.time),
            track=track,
            contact_times=blocked.times_to_collision(preferred),
            extent=extent,
            uncertainty=uncertainty,
        )
        whole = _velocity_extent(controls.blocked.response, navigator)
        control_space(
            right,
            blocked=controls.blocked,
            admissible=controls.admissible,
            preferred=controls.preferred,
            chosen=controls.chosen,
            extent=whole,
            resolution=resolution,
        )
        if then.time != now.time:
            right.set_title(f"{right.get_title()}, {now.time - then.time:.1f} s ago", pad=4)
        if whole is not None:
            _enlarge(right, controls, whole)
        heading = f"{navigator.method.name.upper()}: {decision.outcome.value}" if title is None else title
        if heading and axes is None:
            figure.suptitle(heading, y=0.985)
    return figure


def _panels(rows: int) -> tuple[Axes, Axes]:
    """Return two square panels of equal size on a page's width, with space for a title and `rows` of legend."""
    side, base = 2.7, 0.52 + 0.135 * rows
    height = base + side + 0.48
    figure = Figure(figsize=(PAGE, height))
    left, right = (
        figure.add_axes((x / PAGE, base / height, side / PAGE, side / height)) for x in (0.5, 0.5 + side + 0.68)
    )
    return left, right


def _velocity_extent(response: Any, navigator: Navigator) -> Extent | None:
    """Return an extent of all velocities up to the maximum speed; None for other controls."""
    if kind(response).name != "velocity":
        return None
    limit = 1.12 * navigator.limits.max_speed
    return (-limit, limit, -limit, limit)


def _enlarge(ax: Axes, controls: DrawnControls, extent: Extent) -> None:
    """Draw the surroundings of a small admissible set enlarged, in the corner farthest from the set."""
    height = None
    if controls.blocked.dimension == 3:
        height = float((controls.preferred if controls.chosen is None else controls.chosen)[2])
    region = admissible_region(controls.admissible, height)
    if region.is_empty:
        return
    left, low, right, high = region.bounds
    half = 0.75 * max(right - left, high - low)
    if 2.0 * half > _SMALL_SHARE * (extent[1] - extent[0]):
        return
    x, y = 0.5 * (left + right), 0.5 * (low + high)
    size = 0.36
    corner = (0.015 if x > 0.0 else 0.985 - size, 0.015 if y > 0.0 else 0.985 - size, size, size)
    inset = ax.inset_axes(corner, zorder=7)
    visible = bool(np.all(np.abs(controls.preferred[:2] - (x, y)) < half))
    control_space(
        inset,
        blocked=controls.blocked,
        admissible=controls.admissible,
        preferred=controls.preferred if visible else None,
        chosen=controls.chosen,
        extent=(x - half, x + half, y - half, y + half),
        resolution=121,
        decorations=False,
    )
    inset.set(xticks=[], yticks=[])
    ax.indicate_inset_zoom(inset, edgecolor="black", alpha=0.7, linewidth=0.6)
    for mark in ax.lines:
        mark.set_visible(not (mark.get_gid() == "chosen" or (mark.get_gid() == "preferred" and visible)))


def paths(
    times: npt.ArrayLike,
    positions: npt.ArrayLike,
    obstacles: Sequence[Obstacle],
    *,
    robot: Shape,
    goal: Goal | None,
    ax: Axes | None = None,
    snapshots: int = 5,
) -> Axes:
    """Draw a whole run in the workspace: the robot's track coloured by time, and snapshots of robot and obstacles.

    Args:
        times: (T + 1,) [s], increasing.
        positions: (T + 1, d) [m] of the robot.
        obstacles: obstacles with their true trajectories.
        goal: goal of the robot; None if it is too far away to be shown.
        ax: axes to draw on; by default on a new figure of a column's width.
        snapshots: number of equally spaced snapshots, including first and last time, at least 2.

    Returns:
        The axes, which `save` also accepts.

    Raises:
        InvalidInput: times not increasing, or another number of positions.
    """
    stamps, track_points = array(times, "times"), vectors(positions, "positions")
    if stamps.ndim != 1 or track_points.shape[:-1] != stamps.shape or stamps.size < 2 or np.any(np.diff(stamps) <= 0.0):
        raise InvalidInput(
            f"times: expected two or more in increasing order, and a position for each; "
            f"found shapes {stamps.shape} and {track_points.shape}"
        )
    start, end = float(stamps[0]), float(stamps[-1])
    scale = ScalarMappable(Normalize(start, end), TIMES)
    snapshot_times = np.linspace(start, end, max(2, snapshots))
    corners = [
        *([] if goal is None else [goal_box(goal, end)]),
        *(box_of(parts_at(robot, point)) for point in track_points),
        *obstacle_boxes(obstacles, snapshot_times),
    ]
    left, right, low, high = padded_extent(np.concatenate(corners), 0.4)
    with style():
        ax = column_axes((high - low) / (right - left)) if ax is None else ax
        obstacle_paths(ax, obstacles, snapshot_times, scale)
        if goal is not None:
            draw_goal(ax, goal, end, start, end)
        ax.plot(*track_points.T[:2], color="white", linewidth=2.8, zorder=3.9)
        lines = np.stack([track_points[:-1, :2], track_points[1:, :2]], axis=1)
        track = LineCollection(list(lines), array=0.5 * (stamps[1:] + stamps[:-1]), linewidths=1.6, zorder=4)
        track.set(cmap=scale.cmap, norm=scale.norm, capstyle="round", gid="track")
        ax.add_collection(track, autolim=False)
        _snapshots(ax, np.column_stack([stamps, track_points]), snapshot_times, robot, scale, 0.16 * (right - left))
        ax.set(xlim=(left, right), ylim=(low, high))
        ax.set_aspect("equal")
        label_axes(ax, "   (seen along z; z in m)" if track_points.shape[1] == 3 else "")
        colour_bar(scale, ax, "time [s]")
    return ax


def column_axes(ratio: float, head: float = 0.1) -> Axes:
    """Return axes of this ratio of height to width, `head` [inch] below the top of a figure of a column's width."""
    width = 2.42
    height = width * ratio + 0.48 + head
    figure = Figure(figsize=(COLUMN, height))
    return figure.add_axes((0.5 / COLUMN, 0.48 / height, width / COLUMN, width * ratio / height))


def obstacle_boxes(obstacles: Sequence[Obstacle], snapshot_times: Array) -> list[Array]:
    """Return the bounding boxes of the obstacles at the times `snapshot_times` [s]."""
    return [
        box_of(outline_parts(obstacle, float(t)))
        for obstacle in obstacles
        for t in snapshot_times
        if obstacle.exists(float(t))
    ]


def obstacle_paths(ax: Axes, obstacles: Sequence[Obstacle], snapshot_times: Array, scale: ScalarMappable) -> None:
    """Draw the paths of the obstacles, and their shapes at the times `snapshot_times` [s]."""
    for index, obstacle in enumerate(obstacles):
        if obstacle.at_rest:
            parts = outline_parts(obstacle, float(snapshot_times[0]))
            body(ax, parts, f"obstacle-{index}", zorder=1.5, facecolor=NEUTRAL, edgecolor=INK, linewidth=0.5)
            continue
        path_times = times_within(obstacle.trajectory, float(snapshot_times[0]), float(snapshot_times[-1]), 129)
        if path_times.size:
            ax.plot(*obstacle.trajectory.position(path_times).T[:2], color=NEUTRAL, linewidth=0.5, zorder=1)
        for k, t in enumerate(snapshot_times):
            if obstacle.exists(float(t)):
                colour = colour_at(scale, float(t))
                properties = {"facecolor": to_rgba(colour, 0.25), "edgecolor": to_rgba(colour, 0.85), "linewidth": 0.5}
                body(ax, outline_parts(obstacle, float(t)), f"obstacle-{index}-{k}", zorder=2, **properties)


def _snapshots(
    ax: Axes, samples: Array, snapshot_times: Array, robot: Shape, scale: ScalarMappable, min_distance: float
) -> None:
    """Draw the robot at the times `snapshot_times` [s], labelled with the time and, in space, the height.

    A label is above the robot, or below it if the last label above is near.

    Args:
        samples: (T + 1, 1 + d), times [s] and positions [m].
        min_distance: [m] between labels on the same side.
    """
    above, below = np.full(2, np.inf), np.full(2, np.inf)
    for number, t in enumerate(snapshot_times):
        center = np.array([np.interp(t, samples[:, 0], column) for column in samples.T[1:]])
        properties = {"facecolor": colour_at(scale, float(t)), "edgecolor": INK, "linewidth": 0.8}
        body(ax, parts_at(robot, center), f"robot-{number}", zorder=5, **properties)
        is_above = bool(
            np.abs(center[:2] - above).max() >= min_distance or np.abs(center[:2] - below).max() < min_distance
        )
        above, below = (center[:2], below) if is_above else (above, center[:2])
        text = ax.annotate(
            f"{t:.1f} s" + (f"\nz {center[2]:.1f}".replace("-", "−") if len(center) == 3 else ""),
            (center[0], center[1] + (robot.bounding_radius if is_above else -robot.bounding_radius)),
            xytext=(0, 2 if is_above else -2),
            textcoords="offset points",
            ha="center",
            va="bottom" if is_above else "top",
            fontsize=6.5,
            zorder=8,
        )
        text.set_path_effects(halo(2.0))
        text.set_gid(f"time-{number}")


def driven(
    times: npt.ArrayLike,
    positions: npt.ArrayLike,
    obstacles: Sequence[Obstacle],
    *,
    robot: Shape,
    goal: Goal | None,
    commands: Mapping[str, npt.ArrayLike],
) -> Figure:
    """Draw the path of a robot to the left, and its commands over time to the right.

    Args:
        times: (n,) [s], increasing. positions: (n, 2) [m].
        obstacles: those that it met, on their trajectories.
        commands: values (n,) by label, each in a panel.

    Raises:
        InvalidInput: as `paths`.
    """
    with style():
        figure = Figure(figsize=(PAGE, 0.48 * PAGE), layout="constrained")
        grid = figure.add_gridspec(max(len(commands), 1), 2, width_ratios=(1.5, 1.0))
        left = figure.add_subplot(grid[:, 0])
        paths(times, positions, obstacles, robot=robot, goal=goal, ax=left)
        since = np.asarray(times, dtype=np.float64) - np.asarray(times, dtype=np.float64)[0]
        for k, (label, values) in enumerate(commands.items()):
            ax = figure.add_subplot(grid[k, 1])
            ax.step(since, np.asarray(values, dtype=np.float64), where="post", color=(ROBOT, GOAL, INK)[k % 3], lw=0.9)
            ax.set_ylabel(label)
            ax.margins(x=0.0)
            ax.locator_params(min_n_ticks=3)
        figure.axes[-1].set_xlabel("time since the first command [s]")
    return figure


COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#222222")
"""Colours of lines in turn, distinct for the colour-blind (Okabe and Ito)."""
DASHES: Final = ("-", (0, (4, 2)), (0, (1, 1.5)), (0, (5, 1.5, 1, 1.5)))
MARKS: Final = "osD^v"
APART: Final = 0.012
"""[1] Distance of the marks of two lines at one value, as a share of the axis, so that intervals are seen apart."""


def axis_of(settings: Sequence[Mapping[str, float]]) -> str | None:
    """Return the setting on the horizontal axis: that with the most values, of equal ones the last.

    None if no setting has several values: then methods are on the axis.

    Raises:
        InvalidInput: scenarios without a value of it.
    """
    names = dict.fromkeys(name for one in settings for name in one)
    counts = {name: len({one[name] for one in settings if name in one}) for name in names}
    most = max(counts.values(), default=0)
    if most < 2:
        return None
    chosen = [name for name, count in counts.items() if count == most][-1]
    if any(chosen not in one for one in settings):
        raise InvalidInput(f"--figure: expected {chosen} in all rows of the study, found rows without it")
    return chosen


def study(tables: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw success and mean last arrival of a study over the setting with the most values, with 95 % intervals.

    A line for each scenario, method and combination of the other settings: the settings choose the colour, scenario and
    method the dashes; with one combination only, the method chooses the colour. Where no setting has several values,
    the methods are on the axis, with marks for each scenario.

    Args:
        tables: results of `slalom.sim.compare_all`.

    Raises:
        InvalidInput: as `axis_of`.
    """
    x = axis_of([table["settings"] for table in tables])
    others = [name for name in varied(tables) if name != x]
    ticks = list(dict.fromkeys(method for table in tables for method in table["methods"])) if x is None else []
    lines: dict[tuple[str, str], list[tuple[float, Mapping[str, Any]]]] = {}
    several = len({table["scenario"] for table in tables}) > 1
    for table in tables:
        own = ", ".join(f"{name} {table['settings'][name]:g}" for name in others if name in table["settings"])
        where = scenario_text(str(table["scenario"]), {}) if several else ""
        for method, row in table["methods"].items():
            parts = [where] if x is None else [where, method]
            at = ticks.index(method) if x is None else table["settings"][x]
            lines.setdefault((own, ", ".join(filter(None, parts))), []).append((at, row))
    owns, names = (list(dict.fromkeys(key[k] for key in lines)) for k in (0, 1))
    with style():
        figure = Figure(figsize=(PAGE, 2.9 + 0.13 * max(0, len(owns) + len(names) - 4)), layout="constrained")
        axes = figure.subplots(1, 2)
        spread = APART * float(np.ptp([value for points in lines.values() for value, _ in points]))
        handles = []
        for k, ((own, name), points) in enumerate(lines.items()):
            first, second = (owns.index(own), names.index(name)) if len(owns) > 1 else (names.index(name), 0)
            look: dict[str, Any] = {
                "color": COLOURS[first % len(COLOURS)],
                "linestyle": "" if x is None else DASHES[second % len(DASHES)],
                "marker": MARKS[(first // len(COLOURS) + second) % len(MARKS)],
            }
            points = sorted(points, key=lambda point: point[0])
            shift = spread * (k - 0.5 * (len(lines) - 1))
            _line(axes[0], points, "runs_successful", look, shift, 100.0)
            _line(axes[1], points, "time", look, shift, 1.0)
            handles.append(Line2D([], [], label=", ".join(filter(None, (own, name))), **look))
        axes[0].set(xlabel=x or "", ylabel="success [%]", ylim=(-4.0, 104.0))
        axes[1].set(xlabel=x or "", ylabel="last arrival [s]")
        for ax in axes:
            ax.grid(axis="y", color=INK, alpha=0.12, linewidth=0.5)
            ax.spines[["top", "right"]].set_visible(False)
            if ticks:
                ax.set_xticks(range(len(ticks)), ticks, rotation=30, ha="right", rotation_mode="anchor")
                ax.set_xlim(-0.5, len(ticks) - 0.5)
        if len(lines) > 1 or x is not None:
            figure.legend(handles=handles, loc="outside lower center", ncols=min(3, len(handles)))
    return figure


def _line(
    ax: Axes,
    points: Sequence[tuple[float, Mapping[str, Any]]],
    name: str,
    look: Mapping[str, Any],
    shift: float,
    scale: float,
) -> None:
    """Draw a value with its intervals; counts as shares of the runs. Rows without a value have no mark."""
    drawn = []
    for x, row in points:
        value = row[name] if scale == 1.0 else (row[name] / row["runs"] if row["runs"] else None)
        if value is not None:
            low, high = row[f"{name}_interval"] or (value, value)
            drawn.append((x + shift, scale * value, scale * max(value - low, 0.0), scale * max(high - value, 0.0)))
    if drawn:
        xs, values, below, above = np.array(drawn).T
        ax.errorbar(xs, values, yerr=(below, above), linewidth=1.1, markersize=3.2, elinewidth=0.6, capsize=1.5, **look)
