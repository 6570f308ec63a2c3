"""Picture of success over time in the CrowdNav++ test: runs with several losses of a contact, and published methods.

usage: python benchmarks/crowdnavpp_curve.py [RUNS.json] [--out PICTURE.png]

RUNS.json lists runs of benchmarks/crowdnavpp.py with the verdicts of the judge: for each the people ("random" or
"fixed"), the robot, the loss of a contact [s], the number of cases, the share of successes at the steps, and the mean
time of the successes [s]. Runs of one robot are joined in the order of the loss. Bars are 95 % intervals (Wilson).
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

HERE = Path(__file__).parent
RUNS = HERE / "results" / "crowdnavpp.json"
PICTURE = HERE.parent / "docs" / "images" / "crowdnavpp.png"
COLOURS = ("#1b6ca8", "#d95d39", "#6a994e", "#7d5ba6")
PUBLISHED = {
    "random": {"GST": (0.88, 14.14), "ORCA": (0.69, 14.77), "GenSafeNav (own draw)": (0.972, 17.69)},
    "fixed": {"GST": (0.92, 15.42), "social force": (0.34, 19.95)},
}
"""Success and mean time [s], counted from the published logs: the 250 cases of the published test."""
TARGETS = {"random": (0.99, 13.5), "fixed": (0.995, 13.0)}
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
    """One panel for each kind of people."""
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    robots = list(dict.fromkeys(run["robot"] for run in runs))
    for axes, (people, published) in zip(figure.subplots(1, 2), PUBLISHED.items()):
        for name, (success, time) in published.items():
            axes.plot(time, success, "s", color="#8a8a8a")
            axes.annotate(name, (time, success), xytext=(0, 6), textcoords="offset points", ha="center", fontsize=8)
        for robot, colour, aside in zip(robots, COLOURS, ((4, -22), (4, 5), (4, -12), (4, 14))):
            here = sorted((r for r in runs if r["people"] == people and r["robot"] == robot), key=lambda r: r["loss"])
            if not here:
                continue
            times, shares = np.array([(run["time"], run["success"]) for run in here]).T
            low, high = np.array([interval(run["success"], run["cases"]) for run in here]).T
            bars = np.maximum([shares - low, high - shares], 0.0)
            axes.errorbar(
                times, shares, bars, fmt="o-", color=colour, label=robot, markersize=4, linewidth=1, capsize=2
            )
            for run in here:
                where = {"xytext": aside, "textcoords": "offset points", "fontsize": 7, "color": colour}
                axes.annotate(f"{run['loss']:g} s", (run["time"], run["success"]), **where)
        axes.margins(x=0.15, y=0.08)
        success, time = TARGETS[people]
        axes.plot([axes.get_xlim()[0], time, time], [success, success, 1.0], ":", color="#333333", linewidth=1)
        axes.set(title=TITLES[people], xlabel="mean time of successes [s]", ylabel="share of successes")
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(loc="center right", bbox_to_anchor=(1.0, 0.45), fontsize=8, frameon=False)
    return figure


if __name__ == "__main__":
    main()
