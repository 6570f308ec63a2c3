"""Figure of a study: success and last arrival over the values of a setting."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from slalom.base.errors import InvalidInput
from slalom.sim.sweep.tables import scenario_text, varied
from slalom.view.style import INK, PAGE, style

COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#222222")
"""Colours of lines in turn, distinct for the colour-blind (Okabe and Ito)."""
DASHES: Final = ("-", (0, (4, 2)), (0, (1, 1.5)), (0, (5, 1.5, 1, 1.5)))
MARKS: Final = "osD^v"
APART: Final = 0.012
"""[1] Distance of the marks of two lines at one value, as a share of the axis, so that intervals are seen apart."""


def axis_of(settings: Sequence[Mapping[str, float]]) -> str:
    """Return the setting on the horizontal axis: that with the most values, of equal ones the last.

    Raises:
        InvalidInput: no setting has several values; scenarios without a value of it.
    """
    names = dict.fromkeys(name for one in settings for name in one)
    counts = {name: len({one[name] for one in settings if name in one}) for name in names}
    most = max(counts.values(), default=0)
    if most < 2:
        raise InvalidInput("--figure: expected a study with several values of a setting, found none")
    chosen = [name for name, count in counts.items() if count == most][-1]
    if any(chosen not in one for one in settings):
        raise InvalidInput(f"--figure: expected {chosen} in all rows of the study, found rows without it")
    return chosen


def study(tables: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw success and mean last arrival of a study over the setting with the most values, with 95 % intervals.

    A line for each scenario, method and combination of the other settings: the settings choose the colour, scenario and
    method the dashes; with one combination only, the method chooses the colour.

    Args:
        tables: results of `slalom.sim.compare_all`.

    Raises:
        InvalidInput: as `axis_of`.
    """
    x = axis_of([table["settings"] for table in tables])
    others = [name for name in varied(tables) if name != x]
    lines: dict[tuple[str, str], list[tuple[float, Mapping[str, Any]]]] = {}
    several = len({table["scenario"] for table in tables}) > 1
    for table in tables:
        own = ", ".join(f"{name} {table['settings'][name]:g}" for name in others if name in table["settings"])
        where = f"{scenario_text(str(table['scenario']), {})}, " if several else ""
        for method, row in table["methods"].items():
            lines.setdefault((own, f"{where}{method}"), []).append((table["settings"][x], row))
    owns, methods = (list(dict.fromkeys(key[k] for key in lines)) for k in (0, 1))
    with style():
        figure = Figure(figsize=(PAGE, 2.9 + 0.13 * max(0, len(owns) + len(methods) - 4)), layout="constrained")
        axes = figure.subplots(1, 2)
        spread = APART * float(np.ptp([value for points in lines.values() for value, _ in points]))
        handles = []
        for k, ((own, method), points) in enumerate(lines.items()):
            first, second = (owns.index(own), methods.index(method)) if len(owns) > 1 else (methods.index(method), 0)
            look: dict[str, Any] = {
                "color": COLOURS[first % len(COLOURS)],
                "linestyle": DASHES[second % len(DASHES)],
                "marker": MARKS[(first // len(COLOURS) + second) % len(MARKS)],
            }
            points = sorted(points, key=lambda point: point[0])
            shift = spread * (k - 0.5 * (len(lines) - 1))
            _line(axes[0], points, "runs_successful", look, shift, 100.0)
            _line(axes[1], points, "time", look, shift, 1.0)
            handles.append(Line2D([], [], label=", ".join(part for part in (own, method) if part), **look))
        axes[0].set(xlabel=x, ylabel="runs with success [%]", ylim=(-4.0, 104.0))
        axes[1].set(xlabel=x, ylabel="mean last arrival [s]")
        for ax in axes:
            ax.grid(axis="y", color=INK, alpha=0.12, linewidth=0.5)
            ax.spines[["top", "right"]].set_visible(False)
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
