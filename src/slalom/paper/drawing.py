"""Shared parts of the paper's figures: panels of a given size, unions with their elements, arrows and labels."""

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, PathPatch

from slalom.base.checks import Array
from slalom.choice.control_obstacle import ControlObstacle
from slalom.model.trajectory import Trajectory
from slalom.view.control_space import Extent, Plane, filled
from slalom.view.style import COLUMN, FAINT, INK, NEUTRAL, PAGE, ROBOT, colour_at, colour_bar, disc, halo, time_scale

UNION: Final = "#ececec"
"""Face colour of a union whose elements are drawn in colour."""
DASHES: Final = (0, (4, 2))


class Row(NamedTuple):
    """A figure and its panels, side by side."""

    figure: Figure
    axes: list[Axes]


def panels(extents: Sequence[Extent], *, width: float, gap: float = 0.5, bar: bool = True, legend: int = 0) -> Row:
    """Return panels of equal height side by side, with space for a colour bar on the right.

    Args:
        extents: x from, x to, y from, y to of each panel, which determine its shape.
        width: of the figure [inch]. gap: between panels [inch]. bar: whether a colour bar follows.
        legend: lines of text below the panels.
    """
    left = 0.44
    right = 0.52 if bar else 0.08
    bottom = 0.4 + 0.15 * legend
    top = 0.24
    ratios = [(b - a) / (d - c) for a, b, c, d in extents]
    height = (width - left - right - gap * (len(extents) - 1)) / sum(ratios)
    total_height = bottom + height + top
    figure = Figure(figsize=(width, total_height))
    axes = []
    x = left
    for (a, b, c, d), ratio in zip(extents, ratios):
        ax = figure.add_axes((x / width, bottom / total_height, height * ratio / width, height / total_height))
        ax.set(xlim=(a, b), ylim=(c, d))
        ax.set_aspect("equal")
        axes.append(ax)
        x += height * ratio + gap
    return Row(figure, axes)


def column(extent: Extent, **options: Any) -> Row:
    """Return one panel of a column's width."""
    return panels([extent], width=COLUMN, **options)


def page(extents: Sequence[Extent], **options: Any) -> Row:
    """Return panels across a page."""
    return panels(extents, width=PAGE, **options)


def name_axes(ax: Axes, letter: str, unit: str) -> None:
    """Label the axes: coordinates, or components of a velocity or an acceleration."""
    if letter == "x":
        ax.set_xlabel(f"x [{unit}]")
        ax.set_ylabel(f"y [{unit}]", labelpad=1)
    else:
        ax.set_xlabel(f"${letter}_x$ [{unit}]")
        ax.set_ylabel(f"${letter}_y$ [{unit}]", labelpad=1)


def union(ax: Axes, blocked: ControlObstacle, *, face: str = UNION, resolution: int = 361) -> None:
    """Fill the control obstacle within the view, from the contour of clearance 0."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    plane = Plane(np.linspace(left, right, resolution), np.linspace(low, high, resolution), None)
    # The clearance is unbounded far outside: clipping leaves the contour of 0 unchanged.
    field = np.clip(blocked.clearance(plane.controls), -1e3, 1e3)
    patch = PathPatch(filled(plane, field), facecolor=face, edgecolor=INK, linewidth=0.8, zorder=1)
    patch.set_gid("union")
    ax.add_patch(patch)


def elements(ax: Axes, blocked: ControlObstacle, times: Sequence[float], *, labelled_until: float = 0.0) -> None:
    """Draw temporal elements at `times` [s], coloured by time; those up to `labelled_until` [s] carry their time."""
    scale = time_scale(blocked.horizon)
    for t in sorted(times):
        colour = colour_at(scale, t)
        found = blocked.element(t)
        for centre, radius in zip(found.centers, found.radii):
            properties: dict[str, Any] = {"facecolor": to_rgba(colour, 0.3), "edgecolor": colour, "linewidth": 0.9}
            disc(ax, centre, radius, f"element-{t:g}", zorder=2.0 + 0.1 / t, **properties)
            if t <= labelled_until and _within(ax, centre):
                label(ax, centre, f"{t:g} s", size=6.5)


def _within(ax: Axes, position: Array) -> bool:
    """Return whether a label at `position` (2,) lies in the view, with a margin."""
    for value, inset, (low, high) in zip(position, (0.1, 0.05), (ax.get_xlim(), ax.get_ylim())):
        if not low + inset * (high - low) < value < high - inset * (high - low):
            return False
    return True


def time_bar(ax: Axes, horizon: float, title: str = "time t [s]", *, height: float = 1.0) -> None:
    """Draw the scale of times beside a panel; `height` 1 is that of the panel."""
    colour_bar(time_scale(horizon), ax, title, height=height)


def arrow(ax: Axes, tail: npt.ArrayLike, tip: npt.ArrayLike, colour: str, gid: str, zorder: float = 6.0) -> None:
    """Draw a vector in data units."""
    (x, y), (u, v) = np.asarray(tail, dtype=float)[:2], np.asarray(tip, dtype=float)[:2]
    drawn = FancyArrowPatch(
        (x, y), (u, v), arrowstyle="-|>,head_length=4,head_width=2", color=colour, linewidth=1.1, shrinkA=0, shrinkB=0
    )
    drawn.set(zorder=zorder, gid=gid)
    ax.add_patch(drawn)


def label(
    ax: Axes,
    position: npt.ArrayLike,
    text: str,
    *,
    offset: tuple[float, float] = (0, 0),
    size: float = 7.5,
    **properties: Any,
) -> None:
    """Write a label at `position` (2,), moved by `offset` [pt], readable on any colour."""
    x, y = np.asarray(position, dtype=float)[:2]
    options: dict[str, Any] = {"ha": "center", "va": "center", "color": INK, "zorder": 8} | properties
    drawn = ax.annotate(text, (float(x), float(y)), xytext=offset, textcoords="offset points", fontsize=size, **options)
    drawn.set_path_effects(halo(2.0))


def control_point(
    ax: Axes, position: npt.ArrayLike, text: str, *, offset: tuple[float, float], colour: str = ROBOT, size: float = 4.5
) -> None:
    """Draw a control (2,) of a size [pt] with a label."""
    x, y = np.asarray(position, dtype=float)[:2]
    (mark,) = ax.plot([x], [y], marker="o", markersize=size, markerfacecolor=colour, markeredgecolor="white", zorder=7)
    mark.set(linestyle="none", markeredgewidth=0.7)
    mark.set_gid("point")
    label(ax, position, text, offset=offset, color=colour)


def pointed_control(ax: Axes, position: npt.ArrayLike, text: str, *, offset: tuple[float, float]) -> None:
    """Write a label `offset` [pt] from a control (2,) with an arrow to it, so that no marker hides its surroundings."""
    x, y = np.asarray(position, dtype=float)[:2]
    properties = {
        "arrowstyle": "-|>,head_length=3,head_width=1.5",
        "color": ROBOT,
        "linewidth": 1.0,
        "mutation_scale": 1,
    }
    drawn = ax.annotate(
        text,
        (float(x), float(y)),
        xytext=offset,
        textcoords="offset points",
        ha="center",
        va="bottom",
        color=ROBOT,
        zorder=8,
        arrowprops={**properties, "shrinkA": 1, "shrinkB": 0, "path_effects": halo(2.4)},
    )
    drawn.set_path_effects(halo(2.0))
    drawn.set_gid("chosen")


def path(ax: Axes, trajectory: Trajectory, end: float, colour: Any = FAINT, **properties: Any) -> None:
    """Draw the path of an obstacle from now to `end` [s]."""
    points = trajectory.position(np.linspace(0.0, end, 241))
    ax.plot(*points.T[:2], **({"color": colour, "linewidth": 0.9, "zorder": 1.5} | properties))


def positions(
    ax: Axes, trajectory: Trajectory, radius: float, times: Sequence[float], horizon: float, *, labelled: bool = True
) -> None:
    """Draw an obstacle now and at later `times` [s], coloured by time."""
    scale = time_scale(horizon)
    disc(ax, trajectory.position(0.0), radius, "obstacle", facecolor=NEUTRAL, edgecolor=INK, linewidth=0.8, zorder=3)
    for t in times:
        colour = colour_at(scale, t)
        properties: dict[str, Any] = {"facecolor": to_rgba(colour, 0.3), "edgecolor": colour, "linewidth": 0.9}
        disc(ax, trajectory.position(t), radius, f"obstacle-{t:g}", zorder=2, **properties)
        if labelled:
            label(ax, trajectory.position(t), f"{t:g} s", size=6.5)


def robot_point(ax: Axes, position: Array, text: str, *, offset: tuple[float, float]) -> None:
    """Draw the robot as a point: the obstacles are grown by its radius."""
    ax.plot(*position[:2], marker="o", markersize=4.5, color=INK, zorder=7, linestyle="none", gid="robot")
    label(ax, position, text, offset=offset)
