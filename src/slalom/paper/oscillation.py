"""Figure of the study of oscillations: paths of a few robots, and the measures over the number of robots."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from slalom.paper.claims_oscillation import Cell, run
from slalom.paper.drawing import DASHES
from slalom.view.style import FAINT, GOAL, INK, PAGE, ROBOT, disc, style

PATHS: Final = ("greedy", "both")
"""Selections whose paths are drawn."""
COLOURS: Final = (ROBOT, GOAL, INK, FAINT)
"""Colours of the robots whose paths are drawn."""
LINE_STYLES: Final[dict[str, dict[str, Any]]] = {
    "greedy": {"color": ROBOT, "linestyle": DASHES, "markerfacecolor": "white"},
    "kept": {"color": ROBOT, "markerfacecolor": ROBOT},
    "agreed": {"color": GOAL, "linestyle": DASHES, "markerfacecolor": "white"},
    "both": {"color": GOAL, "markerfacecolor": GOAL},
}
"""Line styles. Colour: whether robots agree on a side. Dashed: selection without commitment."""
HALF_SIDE: Final = 9.0
"""[m] Half the side of the drawn square, in which the robots pass each other."""
MIN_HEADING_VARIATION: Final = 0.1
"""[rad] Lower limit of the axis of heading variation; robots that block each other at rest have less."""
MEASURES: Final = (("side_flips", "side flips per robot"), ("heading_variation", "heading variation [rad]"))
LEFT = 0.5
RIGHT = 0.08
TOP = 0.24
BOTTOM = 0.62
GAP = 0.12
ROW = 0.42
PLOT = 1.1
"""[inch] Margins of the figure, between columns, between rows; height of the plots."""


def figure(result: Mapping[str, Any]) -> Figure:
    """Draw a column for each method: paths, greedy and by default, and the measures over the number of robots."""
    names = list(dict.fromkeys(row["method"] for row in result["rows"]))
    side = (PAGE - LEFT - RIGHT - GAP * (len(names) - 1)) / max(len(names), 4)
    heights = [side] * len(PATHS) + [PLOT] * len(MEASURES)
    gaps = [GAP] * (len(PATHS) - 1) + [ROW] * len(MEASURES)
    total_height = TOP + sum(heights) + sum(gaps) + BOTTOM
    with style():
        drawn = Figure(figsize=(PAGE, total_height))
        y, columns = total_height - TOP, []
        for height, gap in zip(heights, [*gaps, BOTTOM]):
            y -= height
            lefts = [LEFT + j * (side + GAP) for j in range(len(names))]
            columns.append(
                [drawn.add_axes((x / PAGE, y / total_height, side / PAGE, height / total_height)) for x in lefts]
            )
            y -= gap
        for selection, axes in zip(PATHS, columns):
            for name, ax in zip(names, axes):
                _paths(ax, Cell(name, selection, result["drawn"]), result)
                ax.tick_params(labelleft=ax is axes[0], labelbottom=selection == PATHS[-1])
                ax.set_xlabel("x [m]" if selection == PATHS[-1] else "", labelpad=1)
            axes[0].set_ylabel(f"{selection}: y [m]", labelpad=1)
        for (measure, label), axes in zip(MEASURES, columns[len(PATHS) :]):
            for name, ax in zip(names, axes):
                _plot_measure(ax, [row for row in result["rows"] if row["method"] == name], measure)
            _share_scale(axes, measure)
            axes[0].set_ylabel(label, labelpad=2)
        for name, ax in zip(names, columns[0]):
            ax.set_title(name.upper(), pad=4)
        for ax in columns[-1]:
            ax.set_xlabel("robots")
        handles, _ = columns[-1][0].get_legend_handles_labels()
        drawn.legend(handles=handles, loc="lower center", ncols=len(handles), bbox_to_anchor=(0.5, 0.0))
    return drawn


def _paths(ax: Axes, cell: Cell, result: Mapping[str, Any]) -> None:
    """Draw the paths of the robots of one run, and discs at the time when their largest distance from 0 is least."""
    recording = run(cell, 0, result["duration"])
    nearest = int(np.argmin(np.linalg.norm(recording.positions, axis=2).max(axis=1)))
    for k, colour in enumerate(COLOURS[: cell.robots]):
        points, radius = recording.positions[:, k], recording.shapes[k].bounding_radius
        disc(ax, points[nearest], radius, f"robot-{k}", fc=to_rgba(colour, 0.12), ec=colour, lw=0.6, zorder=2)
        ax.plot(*points.T, color=colour, linewidth=0.8, zorder=3, gid=f"path-{k}")
    ax.set(xlim=(-HALF_SIDE, HALF_SIDE), ylim=(-HALF_SIDE, HALF_SIDE), xticks=(-5, 0, 5), yticks=(-5, 0, 5))
    ax.set_aspect("equal")
    arrived = bool(np.all(np.isfinite(recording.arrived)))
    label = f"{recording.times[-1]:.0f} s" if arrived else f"not in {result['duration']:g} s"
    ax.text(0.97, 0.03, label, ha="right", va="bottom", transform=ax.transAxes, fontsize=6.5)


def _plot_measure(ax: Axes, rows: Sequence[Mapping[str, Any]], measure: str) -> None:
    """Plot a measure over the number of robots, with a line for each selection."""
    for selection, line_style in LINE_STYLES.items():
        points = sorted((row["robots"], row[measure]) for row in rows if row["selection"] == selection)
        if points:
            options: dict[str, Any] = {"marker": "o", "markersize": 3.2, "linewidth": 1.0} | line_style
            ax.plot(*zip(*points), label=selection, gid=f"{measure}-{selection}", zorder=3, **options)
    counts = sorted({row["robots"] for row in rows})
    ax.set_xscale("log")
    ax.set_xticks(counts, [str(count) for count in counts], minor=False)
    ax.set_xticks([], minor=True)


def _share_scale(axes: Sequence[Axes], measure: str) -> None:
    """Set the same scale for all methods, labelled only in the first panel."""
    if measure == "heading_variation":
        for ax in axes:
            ax.set_yscale("log")
    low, high = (f(ax.get_ylim()[k] for ax in axes) for k, f in enumerate((min, max)))
    for k, ax in enumerate(axes):
        ax.set_ylim(MIN_HEADING_VARIATION if measure == "heading_variation" else low, high)
        if k:
            ax.tick_params(labelleft=False)
