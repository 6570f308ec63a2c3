"""Whole figures: one decision in two panels, and a whole run."""

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize, to_rgba
from matplotlib.figure import Figure

from slalom.checks import Array, array, vectors
from slalom.decision import Decision, Outcome
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import Admissible
from slalom.manoeuvre import Manoeuvre
from slalom.minkowski import outline_parts
from slalom.navigator import Navigator
from slalom.objective import Situation, preferred_control
from slalom.obstacle import Obstacle
from slalom.shape import Shape
from slalom.trajectory import Stationary
from slalom.view.bodies import body, box_of, placed
from slalom.view.control_space import Extent, control_space
from slalom.view.style import (
    COLUMN,
    INK,
    NEUTRAL,
    PAGE,
    admissible_region,
    colour_at,
    colour_bar,
    halo,
    kind,
    style,
)
from slalom.view.workspace import around, box, draw_goal, label_axes, moments, workspace

_TIMES: Final = ListedColormap(mpl.colormaps["viridis_r"](np.linspace(0.06, 1.0, 256)))
"""Colours of the times of a run: the later the darker."""

_SMALL: Final = 0.2
"""An admissible set smaller than this share of the panel is shown enlarged in a corner."""


class _Reading(NamedTuple):
    """A decision in terms of the control space that is drawn."""

    admissible: Admissible
    preferred: Array
    chosen: Array | None
    label: str


def decision(
    decision: Decision,
    navigator: Navigator,
    goal: Goal,
    *,
    track: npt.ArrayLike | None = None,
    title: str | None = None,
    axes: tuple[Axes, Axes] | None = None,
    resolution: int = 201,
) -> Figure:
    """The workspace and the control space of one decision, side by side.

    A manoeuvre that was kept may belong to another response than the control space that is drawn. Its control means
    nothing there; the filled marker is then what the robot applies over this period, and the legend says so.

    Args:
        decision: what `navigator.decide` returned for `goal`.
        track: positions (T, d) [m] of the robot up to now.
        title: above both panels; by default method and outcome, "" for none.
        axes: where to draw the two panels, by default on a new figure of a page's width.
        resolution: points of the grid of controls along each axis.
    """
    blocked = decision.blocked
    state, traffic = blocked.state, blocked.obstacles
    reading = _read(decision, navigator, goal)
    alone = Manoeuvre(blocked.response, state, reading.preferred, traffic.start)
    with style():
        left, right = axes or _panels(4 if track is not None else 3)
        figure = left.get_figure(root=True)
        assert figure is not None
        workspace(
            left,
            traffic=traffic,
            state=state,
            robot=navigator.robot,
            goal=goal,
            manoeuvre=decision.manoeuvre,
            preferred=alone,
            track=track,
            contact_times=blocked.times_to_collision(reading.preferred),
        )
        extent = _whole_speed_range(blocked.response, navigator)
        control_space(
            right,
            blocked=blocked,
            admissible=reading.admissible,
            preferred=reading.preferred,
            chosen=reading.chosen,
            extent=extent,
            resolution=resolution,
            chosen_label=reading.label,
        )
        if extent is not None:
            _enlarge(right, decision, reading, extent)
        words = f"{navigator.method.name.upper()}: {decision.outcome.value}" if title is None else title
        if words and axes is None:
            figure.suptitle(words, y=0.985)
    return figure


def _panels(rows: int) -> tuple[Axes, Axes]:
    """Two square panels of equal size on a page's width, with room for a title and `rows` of legend."""
    side, base = 2.7, 0.52 + 0.135 * rows
    height = base + side + 0.48
    figure = Figure(figsize=(PAGE, height))
    left, right = (
        figure.add_axes((x / PAGE, base / height, side / PAGE, side / height)) for x in (0.5, 0.5 + side + 0.68)
    )
    return left, right


def _read(decision: Decision, navigator: Navigator, goal: Goal) -> _Reading:
    blocked, manoeuvre = decision.blocked, decision.manoeuvre
    response, state, now = blocked.response, blocked.state, blocked.obstacles.start
    admissible = navigator.limits.admissible(response, state, navigator.horizon)
    preferred = decision.preferred
    if decision.outcome in (Outcome.KEPT, Outcome.CONTINUED):
        situation = Situation(response, state, goal, navigator.limits, admissible, now, navigator.horizon)
        preferred = preferred_control(navigator.objective.aims(situation))
    if manoeuvre.response == response and (manoeuvre.start == now or response.restartable):
        return _Reading(admissible, preferred, manoeuvre.control, "chosen")
    applied, what = manoeuvre.mean_acceleration(now, navigator.period), kind(response).name
    if what == "velocity":
        speed = state.velocity + navigator.period * applied
        return _Reading(admissible, preferred, speed, "next velocity (manoeuvre kept)")
    if what == "acceleration":
        return _Reading(admissible, preferred, applied, "applied now (manoeuvre kept)")
    return _Reading(admissible, preferred, None, "")


def _whole_speed_range(response: Any, navigator: Navigator) -> Extent | None:
    """For velocities: all that the robot's top speed allows, however few of them it can reach now."""
    if kind(response).name != "velocity":
        return None
    top = 1.12 * navigator.limits.max_speed
    return (-top, top, -top, top)


def _enlarge(ax: Axes, decision: Decision, reading: _Reading, extent: Extent) -> None:
    """The surroundings of a small admissible set once more, larger, in the corner farthest from it."""
    height = None
    if decision.blocked.dimension == 3:
        height = float((reading.preferred if reading.chosen is None else reading.chosen)[2])
    region = admissible_region(reading.admissible, height)
    if region.is_empty:
        return
    left, low, right, high = region.bounds
    half = 0.75 * max(right - left, high - low)
    if 2.0 * half > _SMALL * (extent[1] - extent[0]):
        return
    x, y = 0.5 * (left + right), 0.5 * (low + high)
    size = 0.36
    corner = (0.015 if x > 0.0 else 0.985 - size, 0.015 if y > 0.0 else 0.985 - size, size, size)
    inset = ax.inset_axes(corner, zorder=7)
    visible = bool(np.all(np.abs(reading.preferred[:2] - (x, y)) < half))
    control_space(
        inset,
        blocked=decision.blocked,
        admissible=reading.admissible,
        preferred=reading.preferred if visible else None,
        chosen=reading.chosen,
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
    """Draw a whole run in the workspace: the robot's track coloured by time, and everybody at a few moments.

    Args:
        times: (T + 1,) [s], increasing. positions: (T + 1, d) [m], the robot's.
        obstacles: with their true trajectories. goal: None where it is too far away to be shown.
        ax: where to draw, by default on a new figure of a column's width.
        snapshots: how many equally spaced moments, first and last included, at least 2.

    Returns:
        The axes; `save` takes them too.

    Raises:
        InvalidInput: times and positions that do not fit each other.
    """
    stamps, places = array(times, "times"), vectors(positions, "positions")
    if stamps.ndim != 1 or places.shape[:-1] != stamps.shape or stamps.size < 2 or np.any(np.diff(stamps) <= 0.0):
        raise InvalidInput(
            f"times: expected two or more that increase, and a position for each; "
            f"found shapes {stamps.shape} and {places.shape}"
        )
    start, end = float(stamps[0]), float(stamps[-1])
    scale = ScalarMappable(Normalize(start, end), _TIMES)
    shots = np.linspace(start, end, max(2, snapshots))
    target = [] if goal is None else [around(goal.position(end), goal.tolerance)]
    corners = [*target, *(box_of(placed(robot, place)) for place in places), *_corners(obstacles, shots)]
    left, right, low, high = box(np.concatenate(corners), 0.4)
    with style():
        ax = _column((high - low) / (right - left)) if ax is None else ax
        _passers(ax, obstacles, shots, scale)
        if goal is not None:
            draw_goal(ax, goal, end, start, end)
        ax.plot(*places.T[:2], color="white", linewidth=2.8, zorder=3.9)
        lines = np.stack([places[:-1, :2], places[1:, :2]], axis=1)
        track = LineCollection(list(lines), array=0.5 * (stamps[1:] + stamps[:-1]), linewidths=1.6, zorder=4)
        track.set(cmap=scale.cmap, norm=scale.norm, capstyle="round", gid="track")
        ax.add_collection(track, autolim=False)
        _snapshots(ax, np.column_stack([stamps, places]), shots, robot, scale, 0.16 * (right - left))
        ax.set(xlim=(left, right), ylim=(low, high))
        ax.set_aspect("equal")
        label_axes(ax, "   (seen along z; z in m)" if places.shape[1] == 3 else "")
        colour_bar(scale, ax, "time [s]")
    return ax


def _column(ratio: float) -> Axes:
    """Axes of that height per width on a new figure of a column's width."""
    width = 2.42
    height = width * ratio + 0.58
    figure = Figure(figsize=(COLUMN, height))
    return figure.add_axes((0.5 / COLUMN, 0.48 / height, width / COLUMN, width * ratio / height))


def _corners(obstacles: Sequence[Obstacle], shots: Array) -> list[Array]:
    """What the obstacles cover at the moments `shots` [s]."""
    return [
        box_of(outline_parts(obstacle, float(t))) for obstacle in obstacles for t in shots if obstacle.exists(float(t))
    ]


def _passers(ax: Axes, obstacles: Sequence[Obstacle], shots: Array, scale: ScalarMappable) -> None:
    """The obstacles' paths, and discs at the moments `shots` [s]."""
    for index, obstacle in enumerate(obstacles):
        if isinstance(obstacle.trajectory, Stationary):
            parts = outline_parts(obstacle, float(shots[0]))
            body(ax, parts, f"obstacle-{index}", zorder=1.5, facecolor=NEUTRAL, edgecolor=INK, linewidth=0.5)
            continue
        there = moments(obstacle.trajectory, float(shots[0]), float(shots[-1]), 129)
        if there.size:
            ax.plot(*obstacle.trajectory.position(there).T[:2], color=NEUTRAL, linewidth=0.5, zorder=1)
        for k, t in enumerate(shots):
            if obstacle.exists(float(t)):
                colour = colour_at(scale, float(t))
                look = {"facecolor": to_rgba(colour, 0.25), "edgecolor": to_rgba(colour, 0.85), "linewidth": 0.5}
                body(ax, outline_parts(obstacle, float(t)), f"obstacle-{index}-{k}", zorder=2, **look)


def _snapshots(ax: Axes, run: Array, shots: Array, robot: Shape, scale: ScalarMappable, apart: float) -> None:
    """The robot at the moments `shots` [s], with the time (and height) beside it: above, or below a near neighbour.

    Args:
        run: (T + 1, 1 + d), times [s] and places [m]. apart: [m] between labels on one side.
    """
    above, below = np.full(2, np.inf), np.full(2, np.inf)
    for number, t in enumerate(shots):
        place = np.array([np.interp(t, run[:, 0], column) for column in run.T[1:]])
        look = {"facecolor": colour_at(scale, float(t)), "edgecolor": INK, "linewidth": 0.8}
        body(ax, placed(robot, place), f"robot-{number}", zorder=5, **look)
        up = bool(np.abs(place[:2] - above).max() >= apart or np.abs(place[:2] - below).max() < apart)
        above, below = (place[:2], below) if up else (above, place[:2])
        text = ax.annotate(
            f"{t:.1f} s" + (f"\nz {place[2]:.1f}".replace("-", "−") if len(place) == 3 else ""),
            (place[0], place[1] + (robot.bounding_radius if up else -robot.bounding_radius)),
            xytext=(0, 2 if up else -2),
            textcoords="offset points",
            ha="center",
            va="bottom" if up else "top",
            fontsize=6.5,
            zorder=8,
        )
        text.set_path_effects(halo(2.0))
        text.set_gid(f"time-{number}")
