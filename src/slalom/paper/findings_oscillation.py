"""Findings of the study of oscillations as text and tables."""

from collections.abc import Callable
from typing import Final

import numpy as np

from slalom.paper.prose import Result, paragraph, table

MAX_REMAINING_SHARE: Final = 0.1
"""[1] The claim holds if the side flips under consistent selection are at most this share of the greedy ones."""


def oscillation(result: Result) -> list[str]:
    """Render the findings of claim `oscillation`: side flips, heading variation, and conclusions."""
    scenario = result["scenario"]
    passing = result["passing"]
    drawn = result["drawn"]
    few, many = result["seeds"], result["seeds_of_many"]
    return [
        paragraph(
            f"*Shown:* Above: paths of {drawn} robots around the centre, seed 0, greedy and by default. Discs are the "
            "robots when their largest distance from the centre is least; the number is the last arrival. Below: the "
            "two measures over the number of robots."
        ),
        paragraph(
            f"`circle`: robots (radius {scenario['robot_radius']:g} m, {scenario['max_speed']:g} m/s, "
            f"{scenario['max_acceleration']:g} m/s²) on a circle of {scenario['radius']:g} m swap positions. They "
            "observe each other's position, velocity and acceleration and decide every 0.1 s. The starts are "
            f"displaced by {1000.0 * scenario['noise']:g} mm (standard deviation); {few} seeds, {many} of "
            f"{result['many']} robots. A run ends with the last arrival or after {result['duration']:g} s. "
            "**greedy** (`--set patience=0 --set guided=0`): at every decision a robot takes the manoeuvre of least "
            "cost, without preference for the committed one. It heads straight for its goal. **kept:** it keeps "
            f"the committed manoeuvre while that costs at most {result['patience']:g} of the time (`--set guided=0`; "
            f"left out for {result['many']} robots, the longest runs). **agreed** (`--set patience=0`): greedy, but "
            "robots on conflicting courses follow a traffic circle around the conflict, all on the same side. They "
            "yield to waiting robots. **both:** the library's default."
        ),
        paragraph(
            "Side flips per robot: number of changes of the side on which a robot would pass another one. The side is "
            "the sign of relative velocity x relative position. They are counted under three conditions. Two "
            f"robots approach, within {np.degrees(np.arccos(passing['towards'])):.0f} degrees. The closest approach "
            f"is within {passing['ahead']:g} s. Its distance between centres is at least {passing['band']:g} of the "
            "sum of the radii. Heading variation: sum of the absolute heading changes [rad] while a robot "
            "is faster than "
            f"{result['moving']:g} of its maximum speed. Changed: share of decisions that change the committed "
            "manoeuvre. Side flips / heading variation / changed, %:"
        ),
        _by_method(
            result, lambda r: f"{r['side_flips']:.1f} / {r['heading_variation']:.1f} / {100 * r['changed']:.0f}"
        ),
        "Pairs that collided / robots that arrived / last arrival, mean of the runs in which all arrived, s:",
        _by_method(
            result,
            lambda r: f"{r['collisions']} / {r['arrived']} of {r['runs'] * r['robots']} / {_time(r['time'])}",
        ),
        paragraph(_verdict(result)),
        paragraph(_effect_of_the_obstacle(result)),
        paragraph(
            f"Sensitivity to the definitions: means per robot over all runs with fewer than {result['many']} robots."
        ),
        table(
            ["measure", *_selections(result)],
            [[row["measure"], *(f"{row[s]:.2f}" for s in _selections(result))] for row in result["otherwise"]],
        ),
    ]


def _selections(result: Result) -> list[str]:
    return list(dict.fromkeys(row["selection"] for row in result["rows"]))


def _time(seconds: float | None) -> str:
    return "-" if seconds is None else f"{seconds:.1f}"


def _by_method(result: Result, cell: Callable[[Result], str]) -> str:
    """Return a table with a row for each number of robots and selection, and a column for each method."""
    found = {(row["robots"], row["selection"], row["method"]): row for row in result["rows"]}
    names = list(dict.fromkeys(row["method"] for row in result["rows"]))
    lines = dict.fromkeys((robots, selection) for robots, selection, _ in found)
    order = sorted(lines, key=lambda line: (line[0], _selections(result).index(line[1])))
    return table(
        ["robots", "selection", *(f"`{name}`" for name in names)],
        [[str(n), selection, *(cell(found[n, selection, name]) for name in names)] for n, selection in order],
    )


def _means(result: Result, measure: str, many: bool = False) -> dict[str, float]:
    """Return the mean of a measure by selection, over the rows with many robots or over the others."""
    found: dict[str, list[float]] = {}
    for row in result["rows"]:
        if (row["robots"] >= result["many"]) == many:
            found.setdefault(row["selection"], []).append(row[measure])
    return {selection: float(np.mean(values)) for selection, values in found.items()}


def _listed(values: dict[str, float], form: str) -> str:
    return ", ".join(f"{name} {format(value, form)}" for name, value in values.items())


def _verdict(result: Result) -> str:
    """State whether consistent selection removes the oscillations, and which part of it does."""
    sentences = []
    holds = []
    remaining = []
    for many in (False, True):
        flips, turns = (_means(result, name, many) for name in ("side_flips", "heading_variation"))
        if not flips:
            continue
        counts = sorted({row["robots"] for row in result["rows"] if (row["robots"] >= result["many"]) == many})
        sentences.append(
            f"{', '.join(str(n) for n in counts)} robots, means over all methods: side flips {_listed(flips, '.2f')}; "
            f"heading variation {_listed(turns, '.1f')} rad."
        )
        holds.append(flips["both"] <= MAX_REMAINING_SHARE * flips["greedy"] and turns["both"] < turns["greedy"])
        shares = _remaining_share(flips, "both"), _remaining_share(turns, "both")
        remaining.append(
            f"with {result['many']} robots {shares[0]} and {shares[1]}"
            if many
            else f"With fewer than {result['many']} robots consistent selection leaves {shares[0]} of the side flips "
            f"and {shares[1]} of the heading variation"
        )
    flips, turns, changed = (_means(result, name) for name in ("side_flips", "heading_variation", "changed"))
    few = f"The claim holds with fewer than {result['many']} robots" if holds[0] else "The claim does not hold"
    sentences.append(f"{'The claim holds' if all(holds) else few}.")
    sentences.append(f"{', '.join(remaining)}.")
    if "kept" in flips:
        sentences.append(
            "**Correction:** the effect comes from agreement between robots, not from the commitment of each robot. "
            f"Keeping the committed manoeuvre leaves {_remaining_share(flips, 'kept')} of the side flips, the agreed "
            f"side alone {_remaining_share(flips, 'agreed')}. Together with agreement, keeping lowers the share of "
            f"changed decisions from {100 * changed['agreed']:.0f} to {100 * changed['both']:.0f} %."
            if flips["kept"] > 0.5 * flips["greedy"] > flips["agreed"]
            else f"Keeping the committed manoeuvre leaves {_remaining_share(flips, 'kept')} of the side flips, the "
            f"agreed side alone {_remaining_share(flips, 'agreed')}."
        )
    return " ".join(sentences)


def _remaining_share(values: dict[str, float], name: str) -> str:
    """Format the value of a selection as a share of the greedy one."""
    return f"{100.0 * values[name] / values['greedy']:.0f} %" if values["greedy"] else "-"


def _effect_of_the_obstacle(result: Result) -> str:
    """State how the methods differ with greedy selection, and by how much by default."""
    parts = []
    for name in dict.fromkeys(row["method"] for row in result["rows"]):
        selected = [row for row in result["rows"] if row["method"] == name and row["selection"] == "greedy"]
        flips, turns = (float(np.mean([row[m] for row in selected])) for m in ("side_flips", "heading_variation"))
        times = [row["time"] for row in selected if row["time"] is not None]
        last = f", last arrival {np.mean(times):.0f} s" if times else ""
        parts.append(f"{name.upper()} {flips:.1f} and {turns:.1f} rad{last}")
    largest = max(row["robots"] for row in result["rows"])
    flips_by_method, turns_by_method = (
        _of_each_method(result, largest, name) for name in ("side_flips", "heading_variation")
    )
    return (
        "The method also has an effect. With greedy selection, side flips and heading variation are, as means over "
        f"the numbers of robots, {'; '.join(parts)}. Few side flips do not exclude oscillations. Robots that block "
        "each other at low speed appear in the arrival time, and in the last table in the row that includes slow "
        f"motion. The values of {largest} robots by default follow, with the greedy ones in parentheses. "
        f"Side flips: {flips_by_method}. Heading variation [rad]: "
        f"{turns_by_method}.{_swerving(result, largest)} An agreed "
        "side is more than a selection among free controls: it guides robots around each other before the obstacles "
        "constrain their controls. The result shows that velocity obstacles do not necessarily cause oscillations, "
        "not that robots with velocity obstacles alone are free of them."
    )


def _swerving(result: Result, robots: int) -> str:
    """Return a sentence about the methods whose heading variation by default is about the greedy one; or nothing."""
    found = {(r["method"], r["selection"]): r["heading_variation"] for r in result["rows"] if r["robots"] == robots}
    names = dict.fromkeys(name for name, _ in found)
    swerving = [name.upper() for name in names if found[name, "both"] > 0.9 * found[name, "greedy"]]
    return f" With {', '.join(swerving)} the heading variation is about the greedy one." if swerving else ""


def _of_each_method(result: Result, robots: int, measure: str) -> str:
    """Format a measure of each method by default, with the greedy value in parentheses."""
    found = {(row["method"], row["selection"]): row[measure] for row in result["rows"] if row["robots"] == robots}
    names = dict.fromkeys(name for name, _ in found)
    return ", ".join(f"{n.upper()} {found[n, 'both']:.1f} ({found[n, 'greedy']:.1f})" for n in names)
