"""Claim `oscillation`: do robots that swap positions on a circle oscillate because of the method or the selection?

All robots of a run use the same method. Two kinds of consistency are switched on and off: commitment to the chosen
manoeuvre (`patience`), and agreement on a side (traffic circles of guidance). The velocity or acceleration obstacles
are the same in all cases.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from joblib import Parallel, delayed
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from slalom.decision.methods import METHODS
from slalom.paper.drawing import DASHES
from slalom.sim import Recording, simulate
from slalom.sim.gallery import GALLERY, build
from slalom.sim.measure.metrics import (
    MOVING_SHARE,
    PASSING,
    Passing,
    changed_choices,
    flips_between,
    heading_variation,
    summary,
)
from slalom.view.style import FAINT, GOAL, INK, PAGE, ROBOT, disc, style

NAMES: Final = ("vo", "rvo", "ao", "nao")
ROBOTS: Final = (2, 4, 8, 20)
MANY_ROBOTS: Final = 20
"""[robots] From this number on a run takes a minute: a third of the seeds, and no rows of the selection `kept`."""
SELECTIONS: Final[dict[str, dict[str, float]]] = {
    "greedy": {"patience": 0.0, "guided": 0.0},
    "kept": {"guided": 0.0},
    "agreed": {"patience": 0.0},
    "both": {},
}
"""Scenario settings of each selection. Without patience a robot takes the control of least cost at every decision; the
committed one has no preference. Without guidance it moves straight to its goal. The library's default is `both`."""
VARIANTS: Final[dict[str, Passing | float]] = {
    "side flips": PASSING,
    "side flips, nearest within 3 s": PASSING._replace(ahead=3.0),
    "side flips, missing by 0.25 radii": PASSING._replace(band=0.25),
    "side flips, approaching at all": PASSING._replace(towards=0.0),
    "heading variation": MOVING_SHARE,
    "heading variation, down to 0.01 of maximum speed": 0.01,
}
"""The measures, each also with one constant changed."""
DRAWN_ROBOTS: Final = 4
"""[robots] Number of robots in the run whose paths are drawn, seed 0."""


class Cell(NamedTuple):
    """A row of the table: method, selection and number of robots."""

    method: str
    selection: str
    robots: int


def cells(quick: bool = False) -> list[Cell]:
    """Return the rows of the table; a few of them if `quick`."""
    names, counts, selections = (("vo", "nao"), (2, 4), ("greedy", "both")) if quick else (NAMES, ROBOTS, SELECTIONS)
    return [
        Cell(name, selection, count)
        for name in names
        for count in counts
        for selection in selections
        if count < MANY_ROBOTS or selection != "kept"
    ]


def run(cell: Cell, seed: int, duration: float) -> Recording:
    """Simulate one run; the seed displaces the starts by a millimetre, as in the gallery."""
    settings = {"robots": float(cell.robots), "duration": duration, **SELECTIONS[cell.selection]}
    return simulate(build("circle", settings, seed=seed), METHODS[cell.method], seed=seed)


def run_metrics(cell: Cell, seed: int, duration: float) -> dict[str, Any]:
    """Return the measures of one run; side flips and heading variation are means over the robots."""
    recording = run(cell, seed, duration)
    robots, result = range(cell.robots), summary(recording)
    flips, steps = flips_between(recording)

    def measured(rule: Passing | float) -> float:
        if isinstance(rule, Passing):
            return float(flips_between(recording, rule)[0].sum()) / cell.robots
        return float(np.mean([heading_variation(recording, k, rule) for k in robots]))

    return {
        "side_flips": measured(PASSING),
        "pairs_that_pass": int(np.count_nonzero(steps)) // 2,
        "pairs_that_flip": int(np.count_nonzero(flips)) // 2,
        "heading_variation": measured(MOVING_SHARE),
        "changed": float(np.mean([changed_choices(recording, k) for k in robots])),
        "collisions": result["collisions"],
        "arrived": result["arrived"],
        "time": result["time"],
        "otherwise": [measured(rule) for rule in VARIANTS.values()],
    }


def aggregate(cell: Cell, runs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return means and counts over the runs of one cell; `time` is the last arrival of runs in which all arrive."""
    times = [run["time"] for run in runs if run["arrived"] == cell.robots]
    means = {
        name: float(np.mean([run[name] for run in runs])) for name in ("side_flips", "heading_variation", "changed")
    }
    counts = ("pairs_that_pass", "pairs_that_flip", "collisions", "arrived")
    return {
        **cell._asdict(),
        "runs": len(runs),
        **means,
        **{name: sum(run[name] for run in runs) for name in counts},
        "time": float(np.mean(times)) if times else None,
    }


def measure(seeds: int, jobs: int, quick: bool, advance: Callable[[float], None]) -> dict[str, Any]:
    """Measure all rows, and the measures with other constants; the result does not depend on the number of jobs.

    Args:
        seeds: runs of each row with fewer than MANY_ROBOTS robots; the other rows have a third.
        advance: receives the share done.
    """
    rows, duration = cells(quick), 30.0 if quick else 100.0
    seeds_of_many = max(1, seeds // 3)
    work = [(cell, seed) for cell in rows for seed in range(seeds_of_many if cell.robots >= MANY_ROBOTS else seeds)]
    # The longest runs first, so that no process ends with a long run while the others are idle.
    work.sort(key=lambda case: -case[0].robots)
    found: dict[tuple[Cell, int], dict[str, Any]] = {}
    done = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(run_metrics)(cell, seed, duration) for cell, seed in work
    )
    total = sum(cell.robots**2 for cell, _ in work)
    for case, result in zip(work, done):
        found[case] = result
        advance(sum(cell.robots**2 for cell, _ in found) / total)
    runs = {cell: [result for (other_cell, _), result in sorted(found.items()) if other_cell == cell] for cell in rows}
    defaults = GALLERY["circle"].parameters
    return {
        "seeds": seeds,
        "seeds_of_many": seeds_of_many,
        "many": MANY_ROBOTS,
        "duration": duration,
        "patience": build("circle").patience,
        "scenario": {
            name: defaults[name] for name in ("radius", "robot_radius", "noise", "max_speed", "max_acceleration")
        },
        "passing": PASSING._asdict(),
        "moving": MOVING_SHARE,
        "drawn": DRAWN_ROBOTS,
        "rows": [aggregate(cell, runs[cell]) for cell in rows],
        "otherwise": _variants(runs),
    }


def _variants(runs: Mapping[Cell, Sequence[Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """Return the means of each variant of the measures over the runs with fewer than MANY_ROBOTS, by selection."""
    table = []
    for k, name in enumerate(VARIANTS):
        means = {}
        for selection in dict.fromkeys(cell.selection for cell in runs):
            selected = [
                run
                for cell, cell_runs in runs.items()
                if cell.selection == selection and cell.robots < MANY_ROBOTS
                for run in cell_runs
            ]
            means[selection] = float(np.mean([run["otherwise"][k] for run in selected]))
        table.append({"measure": name, **means})
    return table


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
