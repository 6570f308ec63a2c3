"""The numbers of the study of oscillations in words and tables."""

from collections.abc import Callable
from typing import Final

import numpy as np

from slalom.paper.prose import Result, paragraph, table

SAME: Final = 0.1
"""[1] The claim counts as holding if consistent selection leaves at most this share of the oscillations."""


def oscillation(result: Result) -> list[str]:
    """Who changes sides, and what follows."""
    place, rule, drawn = result["scenario"], result["passing"], result["drawn"]
    few, many = result["seeds"], result["seeds_of_many"]
    return [
        paragraph(
            f"*Drawn:* above the paths of {drawn} robots where they meet, seed 0, greedy and by default, as discs the "
            "robots when all were nearest to the middle, and the time of the last arrival; below the two measures."
        ),
        paragraph(
            f"`circle`: robots (radius {place['robot_radius']:g} m, {place['max_speed']:g} m/s, "
            f"{place['max_acceleration']:g} m/s²) on a circle of {place['radius']:g} m swap sides; they see each "
            f"other's position, velocity and acceleration and decide every 0.1 s. The starts are off by "
            f"{1000.0 * place['noise']:g} mm (standard deviation); {few} seeds, {many} of {result['many']} robots. A "
            f"run ends with the last arrival or after {result['duration']:g} s. **greedy:** a robot takes afresh at "
            "every decision what costs least, to go on as it does among the rest, straight towards its goal (`--set "
            "patience=0 --set guided=0`). **kept:** it keeps what it chose until that has cost "
            f"{result['patience']:g} s (`--set guided=0`; left out for {result['many']} robots, which takes longest). "
            "**agreed:** greedy, but robots that will meet go around the meeting, all with it on their left, and give "
            "way to those that wait (`--set patience=0`). **both:** the library's default."
        ),
        paragraph(
            "Side flips per robot: how often the side changes on which it would pass another one (the sign of relative "
            f"velocity x relative position), while they approach (within {np.degrees(np.arccos(rule['towards'])):.0f} "
            f"degrees) and would be nearest within {rule['ahead']:g} s, missing each other's centre by at least "
            f"{rule['band']:g} of the sum of their radii. Heading variation: the sum of all turns [rad], in total, "
            f"while a robot is faster than {result['moving']:g} of its top speed. Changed: the share of decisions at "
            "which the committed manoeuvre was changed. Side flips / heading variation / changed, %:"
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
        paragraph(_part_of_the_obstacle(result)),
        paragraph(
            f"How much depends on the definitions: means per robot, all runs with fewer than {result['many']} robots."
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
    """A row for each number of robots and selection, a column for each method."""
    found = {(row["robots"], row["selection"], row["method"]): row for row in result["rows"]}
    names = list(dict.fromkeys(row["method"] for row in result["rows"]))
    lines = dict.fromkeys((robots, selection) for robots, selection, _ in found)
    order = sorted(lines, key=lambda line: (line[0], _selections(result).index(line[1])))
    return table(
        ["robots", "selection", *(f"`{name}`" for name in names)],
        [[str(n), selection, *(cell(found[n, selection, name]) for name in names)] for n, selection in order],
    )


def _means(result: Result, measure: str, many: bool = False) -> dict[str, float]:
    """The mean of a measure for each selection, of all rows with fewer than `many` robots or of the others."""
    found: dict[str, list[float]] = {}
    for row in result["rows"]:
        if (row["robots"] >= result["many"]) == many:
            found.setdefault(row["selection"], []).append(row[measure])
    return {selection: float(np.mean(values)) for selection, values in found.items()}


def _listed(values: dict[str, float], form: str) -> str:
    return ", ".join(f"{name} {format(value, form)}" for name, value in values.items())


def _verdict(result: Result) -> str:
    """Whether consistent selection ends the oscillations, and which part of it does."""
    said, holds, left = [], [], []
    for many in (False, True):
        flips, turns = (_means(result, name, many) for name in ("side_flips", "heading_variation"))
        if not flips:
            continue
        counts = sorted({row["robots"] for row in result["rows"] if (row["robots"] >= result["many"]) == many})
        said.append(
            f"{', '.join(str(n) for n in counts)} robots, means of all methods: side flips {_listed(flips, '.2f')}; "
            f"heading variation {_listed(turns, '.1f')} rad."
        )
        holds.append(flips["both"] <= SAME * flips["greedy"] and turns["both"] < turns["greedy"])
        size = f"with {result['many']} robots" if many else f"with fewer than {result['many']} robots"
        left.append(
            f"{_share(flips, 'both')} of the side flips and {_share(turns, 'both')} of the heading variation {size}"
        )
    flips, turns, changed = (_means(result, name) for name in ("side_flips", "heading_variation", "changed"))
    few = f"The claim holds with fewer than {result['many']} robots" if holds[0] else "The claim does not hold"
    said.append(
        f"{'The claim holds' if all(holds) else few}: with the same obstacles, consistent selection leaves "
        f"{', and '.join(left)}."
    )
    if "kept" in flips:
        said.append(
            "**Correction:** what counts is that robots agree with each other, not that each agrees with itself. "
            f"Keeping what was chosen leaves {_share(flips, 'kept')} of the side flips, the agreed side alone "
            f"{_share(flips, 'agreed')}; with it, keeping lowers the share of changed choices from "
            f"{100 * changed['agreed']:.0f} to {100 * changed['both']:.0f} %."
            if flips["kept"] > 0.5 * flips["greedy"] > flips["agreed"]
            else f"Keeping what was chosen leaves {_share(flips, 'kept')} of the side flips, the agreed side alone "
            f"{_share(flips, 'agreed')}."
        )
    return " ".join(said)


def _share(values: dict[str, float], name: str) -> str:
    """What is left with a selection, of the greedy one."""
    return f"{100.0 * values[name] / values['greedy']:.0f} %" if values["greedy"] else "-"


def _part_of_the_obstacle(result: Result) -> str:
    """What the methods differ in when each robot chooses for itself, and what is left of it."""
    parts = []
    for name in dict.fromkeys(row["method"] for row in result["rows"]):
        mine = [row for row in result["rows"] if row["method"] == name and row["selection"] == "greedy"]
        flips, turns = (float(np.mean([row[m] for row in mine])) for m in ("side_flips", "heading_variation"))
        times = [row["time"] for row in mine if row["time"] is not None]
        last = f", last arrival {np.mean(times):.0f} s" if times else ""
        parts.append(f"{name.upper()} {flips:.1f} and {turns:.1f} rad{last}")
    largest = max(row["robots"] for row in result["rows"])
    left, turned = (_of_each_method(result, largest, name) for name in ("side_flips", "heading_variation"))
    return (
        "The obstacle has its part in it. Greedy, side flips and heading variation are, means over the numbers of "
        f"robots, {'; '.join(parts)}. Few flips do not mean that nobody oscillates: robots that stop before each other "
        "and shiver there count in the time, and in the last table where slow motion does. By default, in brackets "
        f"greedy, the side flips of {largest} robots are {left} and their heading variation {turned} rad."
        f"{_swerving(result, largest)} And an agreed side is more than a choice among free controls: it sends robots "
        "around each other before the obstacles leave them a choice to make. It shows that velocity obstacles need not "
        "make robots oscillate, not that robots which choose by them alone do not."
    )


def _swerving(result: Result, robots: int) -> str:
    """Which methods turn about as much by default as greedily."""
    found = {(r["method"], r["selection"]): r["heading_variation"] for r in result["rows"] if r["robots"] == robots}
    names = dict.fromkeys(name for name, _ in found)
    much = [name.upper() for name in names if found[name, "both"] > 0.9 * found[name, "greedy"]]
    return f" With {', '.join(much)} they still swerve as much as greedy ones." if much else ""


def _of_each_method(result: Result, robots: int, measure: str) -> str:
    """A measure by default, and greedy."""
    found = {(row["method"], row["selection"]): row[measure] for row in result["rows"] if row["robots"] == robots}
    names = dict.fromkeys(name for name, _ in found)
    return ", ".join(f"{n.upper()} {found[n, 'both']:.1f} ({found[n, 'greedy']:.1f})" for n in names)
