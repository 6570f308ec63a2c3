"""Picture of success over time in the CrowdNav++ test: runs with several losses of a contact, and published methods.

usage: python benchmarks/crowdnavpp_curve.py [RUNS.json] [--out PICTURE.png]

RUNS.json lists runs of benchmarks/crowdnavpp.py with the verdicts of the judge: for each the people ("random" or
"fixed"), the robot, the loss of a contact [s], the number of cases, the share of successes at the steps, and the mean
time of the successes [s]. Runs of one robot are joined in the order of the loss. Bars are 95 % intervals (Wilson).
The vertical axis is cut, and the dotted corner is the aim.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

HERE = Path(__file__).parent
RUNS = HERE / "results" / "crowdnavpp.json"
PICTURE = HERE.parent / "docs" / "images" / "crowdnavpp.png"
COLOURS = ("#1b6ca8", "#d95d39", "#6a994e", "#7d5ba6")
MARKERS = ("o", "D", "^", "v")
PUBLISHED = {
    "random": {"GST": (0.88, 14.14), "ORCA": (0.69, 14.77), "GenSafeNav (own draw)": (0.972, 17.69)},
    "fixed": {"GST": (0.92, 15.42), "social force": (0.34, 19.95)},
}
"""Share of successes and mean time [s], counted from the published logs: the 250 cases of the published test."""
TARGETS = {"random": (0.992, 13.4), "fixed": (0.992, 12.5)}
"""Share of successes and mean time [s] of the dotted corner."""
SPANS = ((0.865, 1.008), (0.3, 0.75))
"""Shares of the upper and of the lower panel."""
TITLES = {"random": "random people", "fixed": "people all alike"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path, nargs="?", default=RUNS)
    parser.add_argument("--out", type=Path, default=PICTURE)
    arguments = parser.parse_args()
    picture(json.loads(arguments.runs.read_text())).savefig(arguments.out, dpi=110)


def interval(share: float, cases: int) -> tuple[float, float]:
    """The 95 % interval of Wilson for a share of `cases`."""
    z = 1.96
    middle = (share + z * z / (2.0 * cases)) / (1.0 + z * z / cases)
    half = z * np.sqrt(share * (1.0 - share) / cases + z * z / (4.0 * cases**2)) / (1.0 + z * z / cases)
    return middle - half, middle + half


def picture(runs: Sequence[dict[str, Any]]) -> Figure:
    """One column for each kind of people; its lower panel holds the methods with few successes."""
    figure = Figure(figsize=(9.4, 5.2), layout="constrained")
    robots = list(dict.fromkeys(run["robot"] for run in runs))
    times = [run["time"] for run in runs] + [time for table in PUBLISHED.values() for _, time in table.values()]
    left, right = min(times) - 0.5, max(times) + 1.0
    panels = figure.subplots(2, 2, sharex="col", gridspec_kw={"height_ratios": (3.2, 1.0), "hspace": 0.04})
    for people, column in zip(PUBLISHED, panels.T):
        for axes, (low, high) in zip(column, SPANS):
            axes.set_ylim(low, high)
            methods(axes, PUBLISHED[people])
            axes.spines[["top", "right"]].set_visible(False)
            for robot, colour, marker in zip(robots, COLOURS, MARKERS):
                here = [run for run in runs if run["people"] == people and run["robot"] == robot]
                curve(axes, sorted(here, key=lambda run: run["loss"]), robot, colour, marker)
        success, time = TARGETS[people]
        column[0].plot([left, time, time], [success, success, 1.0], ":", color="#333333", linewidth=1, zorder=1)
        column[0].set(title=TITLES[people], xlim=(left, right), ylabel="share of successes")
        column[0].tick_params(bottom=False)
        column[0].spines["bottom"].set_visible(False)
        column[1].set_xlabel("mean time of successes [s]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=8, frameon=False)
    return figure


def methods(axes: Axes, published: dict[str, tuple[float, float]]) -> None:
    """Squares of published methods whose share lies in the span of the panel."""
    low, high = axes.get_ylim()
    for name, (success, time) in published.items():
        if low <= success <= high:
            axes.plot(time, success, "s", color="#8a8a8a")
            axes.annotate(name, (time, success), xytext=(0, 6), textcoords="offset points", ha="center", fontsize=8)


def curve(axes: Axes, runs: Sequence[dict[str, Any]], robot: str, colour: str, marker: str) -> None:
    """Runs of one robot, joined in the order of the loss of a contact: more loss, more time."""
    if not runs:
        return
    times, shares = np.array([(run["time"], run["success"]) for run in runs]).T
    low, high = np.array([interval(run["success"], run["cases"]) for run in runs]).T
    bars = np.maximum([shares - low, high - shares], 0.0)
    name = f"{robot}; loss " + " and ".join(f"{run['loss']:g}" for run in runs) + " s"
    axes.errorbar(times, shares, bars, fmt=f"{marker}-", color=colour, label=name, markersize=5, linewidth=1, capsize=2)


if __name__ == "__main__":
    main()
