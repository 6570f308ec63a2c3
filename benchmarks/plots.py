"""The figures of docs/performance.md: each from the results of all programs, by name."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from program import shown

OURS, THEIRS, PALE = "#1b6ca8", "#8a8a8a", "#c9c9c9"
PARTS = ("#1b6ca8", "#5fa8d3", "#f0a202", "#d95d39", "#6a994e", "#7d5ba6", "#bbbbbb")
SHORT_AXIS = 500.0
"""Ratio of the ends of a logarithmic axis below which 1, 2 and 5 of each decade are labelled."""
Results = dict[str, dict[str, Any]]


def decisions(results: Results) -> Figure:
    """Bars of the time of a decision of nao, on a logarithmic scale."""
    families = ("roundabout", "mixed")
    figure = Figure(figsize=(7.5, 3.4), layout="constrained")
    everything = []
    panels = figure.subplots(1, 2, sharey=True, sharex=True)
    for axes, family in zip(panels, families):
        spent = dict(results["sampling"]["results"][f"{family}, nao"]["us"])
        if "mpc" in results:
            spent["MPC with IPOPT"] = results["mpc"]["results"][family]["mpc_us"]
        spent.pop("future positions for the samplers")
        _bars(axes, spent, "us", family)
        everything += list(spent.values())
    panels[0].set_xlim(0.4 * min(everything), 10.0 * max(everything))
    return figure


def fleets(results: Results) -> Figure:
    """Bars of the time of a step per robot."""
    figure = Figure(figsize=(6.5, 2.6), layout="constrained")
    of = results["fleet_step"]
    title = f"{of['parameters']['robots']} robots, while driving"
    _bars(figure.subplots(), of["results"]["us_per_robot"]["while driving"], "us per robot", title)
    return figure


def _bars(axes: Any, values: dict[str, float], unit: str, title: str) -> None:
    names = list(values)[::-1]
    colors = [OURS if name.startswith("slalom") else THEIRS for name in names]
    axes.barh(names, [values[name] for name in names], color=colors)
    for k, name in enumerate(names):
        away = {"xytext": (3, 0), "textcoords": "offset points", "va": "center", "fontsize": 8}
        axes.annotate(shown(values[name]), (values[name], k), **away)
    axes.set_xscale("log")
    axes.set_xlim(0.4 * min(values.values()), 8.0 * max(values.values()))
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(f"time [{unit}]")
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)


def stages(results: Results) -> Figure:
    """One bar of stages for each family."""
    figure = Figure(figsize=(7.5, 2.6), layout="constrained")
    axes = figure.subplots()
    families = results["stages"]["results"]
    skip = ("the whole decision",)
    names = [n for n in next(iter(families.values()))["median_us"] if n not in skip and not n.startswith("of the")]
    before = np.zeros(len(families))
    for name, color in zip(names, PARTS):
        widths = np.array([max(family["median_us"][name], 0.0) for family in families.values()])
        axes.barh(list(families), widths, left=before, color=color, label=name)
        before = before + widths
    axes.set_xlabel("time [us]")
    axes.tick_params(labelsize=9)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside upper center", ncols=3, fontsize=8, frameon=False)
    return figure


def scaling(results: Results) -> Figure:
    """Three panels with logarithmic axes, each with a line of slope 1."""
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    curves = results["scaling"]["results"]
    for axes, what in zip(figure.subplots(1, 3), ("obstacles", "knots", "robots")):
        unit = "s" if what == "robots" else "us"
        lowest = np.inf
        for (name, curve), color in zip(((n, c) for n, c in curves.items() if n.startswith(what)), (OURS, "#d95d39")):
            label = name.partition(", ")[2] or name
            power = curve["exponents"]["upper"]
            axes.loglog(curve["sizes"], curve[unit], "o-", color=color, ms=4, label=f"{label}: {power:.2f}")
            lowest = min(lowest, curve[unit][0])
        sizes = np.array([curve["sizes"][0], max(curve["sizes"])], dtype=float)
        axes.loglog(sizes, lowest * sizes / sizes[0], ":", color=THEIRS)
        for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            if high < SHORT_AXIS * low:
                axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
                axis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.set_minor_formatter(NullFormatter())
        axes.set_xlabel(f"number of {what}")
        axes.set_ylabel("time of a step [s]" if unit == "s" else "time of a decision [us]")
        axes.legend(fontsize=8, frameon=False, title="exponent", title_fontsize=8)
        axes.tick_params(labelsize=8)
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def boundaries(results: Results) -> Figure:
    """Time against the share of wrong controls: the lower left corner is best."""
    figure = Figure(figsize=(5.5, 3.2), layout="constrained")
    axes = figure.subplots()
    of = results["boundaries"]
    least = 0.3 / of["parameters"]["points"] / of["parameters"]["scenes"]
    for family, mark in zip(of["results"], "os"):
        row = of["results"][family]
        for kind, color, label in (("slalom", OURS, "slalom"), ("discs", THEIRS, "200 discs each, shapely")):
            share = max(row[f"{kind}_wrong"], least)
            axes.loglog(row[f"{kind}_all_ms"], share, mark, color=color, ms=8, label=f"{label}, {family}")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("time for 30 obstacles [ms]")
    axes.set_ylabel("share of wrong controls")
    axes.margins(0.15)
    axes.legend(fontsize=8, frameon=False, loc="center", bbox_to_anchor=(0.5, 0.5))
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def memory(results: Results) -> Figure:
    """Growth of memory: one robot, and fleets with and without recording."""
    figure = Figure(figsize=(9.0, 2.8), layout="constrained")
    of, told = results["memory"]["results"], results["memory"]["parameters"]
    left, middle, right = figure.subplots(1, 3)
    alone = of["decisions"]
    left.plot(alone["at"], np.array(alone["mebibytes"]) - alone["mebibytes"][0], color=OURS)
    left.set_title("one robot, nothing recorded", fontsize=10)
    left.set_xlabel("decisions")
    for axes, what, robots, recorded in (
        (middle, "fleets", told["robots"], "all recorded"),
        (right, "unrecorded", told["many"], "nothing recorded"),
    ):
        for (name, run), color in zip(of[what].items(), (OURS, "#d95d39")):
            axes.plot(run["at"], np.array(run["mebibytes"]) - run["mebibytes"][0], color=color, label=name)
        axes.set_title(f"{robots} robots, {recorded}", fontsize=10)
        axes.set_xlabel("steps")
    kept = next(iter(of["fleets"].values()))
    at = np.array(kept["at"])
    middle.plot(
        at, at * told["robots"] * kept["held_per_robot"] / 2**20, ":", color=THEIRS, label="size of the recording"
    )
    left.set_ylabel("growth of the memory [MiB]")
    for axes in (left, middle, right):
        axes.tick_params(labelsize=8)
        axes.spines[["top", "right"]].set_visible(False)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=8, frameon=False)
    return figure
