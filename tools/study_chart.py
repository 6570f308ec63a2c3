"""The chart of a study: success and mean last arrival of each method in each scenario."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.colors import Normalize
from matplotlib.figure import Figure

Row = Mapping[str, str]
"""A row of the table of a page by heading."""

NUMBERS: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7}


def cells(rows: Sequence[Row]) -> dict[tuple[str, str], tuple[float, str]]:
    """Success [%] and mean last arrival [s], "-" for none, by scenario and method.

    They are of the scenarios with rows of `nao_shared` and of `orca`. Rows with the setting guided=0 belong to the
    same scenario; their methods are named "..., not guided".
    """
    found = {}
    for row in rows:
        scenario, alone = row["scenario"].removesuffix("guided=0").rstrip(", "), "guided=0" in row["scenario"]
        method = row["method"] + (", not guided" if alone else "")
        runs, successful = (int(row[key].replace(",", " ").split()[0]) for key in ("runs", "success"))
        found[scenario.removesuffix(".csv"), method] = (100.0 * successful / runs, row["last arrival s"].split()[0])
    both = [where for where, method in found if method == "orca" and (where, "nao_shared") in found]
    return {key: value for key, value in found.items() if key[0] in both}


def chart(rows: Sequence[Row]) -> Figure:
    """A map of all cells: the colour is the success, the number the last arrival."""
    values = cells(rows)
    scenarios = list(dict.fromkeys(where for where, _ in values))
    methods = sorted(dict.fromkeys(method for _, method in values), key=lambda method: "not guided" in method)
    figure = Figure(figsize=(9.0, 0.3 * len(scenarios) + 1.8), layout="constrained")
    axes = figure.subplots()
    shares = [[values.get((where, method), (float("nan"), ""))[0] for method in methods] for where in scenarios]
    image = axes.imshow(shares, cmap="Blues", norm=Normalize(-10.0, 130.0), aspect="auto")
    for y, where in enumerate(scenarios):
        for x, method in enumerate(methods):
            share, arrival = values.get((where, method), (0.0, ""))
            axes.text(x, y, arrival, color="white" if share > 60.0 else "black", **NUMBERS)
    axes.set_xticks(range(len(methods)), methods, rotation=30, ha="right", rotation_mode="anchor", fontsize=8)
    axes.set_yticks(range(len(scenarios)), scenarios, fontsize=8)
    axes.set_xlabel("method")
    axes.set_ylabel("scenario")
    axes.set_xticks([x - 0.5 for x in range(1, len(methods))], minor=True)
    axes.set_yticks([y - 0.5 for y in range(1, len(scenarios))], minor=True)
    axes.grid(which="minor", color="white", linewidth=1.5)
    axes.tick_params(which="both", length=0)
    axes.spines[:].set_visible(False)
    bar = figure.colorbar(image, ax=axes, boundaries=range(101), ticks=range(0, 101, 25), fraction=0.03, pad=0.01)
    bar.set_label("success [% of the runs]", fontsize=8)
    bar.ax.tick_params(labelsize=8)
    return figure
