"""Findings of each claim as text and tables, with corrections of the paper's statements."""

from collections.abc import Callable, Mapping, Sequence
from textwrap import fill
from typing import Any, Final

import numpy as np

# Markdown helpers of the claims: paragraphs, tables, counts with shares.


WIDTH: Final = 128
"""[characters] Largest length of a line of text."""

Result = Mapping[str, Any]


def paragraph(text: str) -> str:
    """Wrap text to lines of WIDTH."""
    return fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def count_and_share(part: int, whole: int) -> str:
    """Format a count with its share."""
    return f"{part} of {whole} ({100.0 * part / whole:.1f} %)"


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


def smoothness(result: Result) -> list[str]:
    """Render the findings of claim `smoothness`: acceleration and jerk."""
    head = [
        "method",
        "replan, s",
        "collided",
        "arrived",
        "time, s",
        "adjustments",
        "mean acc.",
        "mean jerk",
        "max jerk",
    ]
    lines = [
        [
            f"`{row['method']}`",
            f"{row['replan']:g}",
            str(row["runs_with_collision"]),
            str(row["runs_that_arrived"]),
            f"{row['time']:.1f}",
            f"{row['adjustments']:.1f}",
            f"{row['mean_acceleration']:.2f}",
            f"{row['mean_jerk']:.2f}",
            f"{row['max_jerk']:.1f}",
        ]
        for row in [*result["rows"]]
    ]
    return [
        paragraph(
            f"`roundabout_crossing`, {result['seeds']} seeds, steps of 0.1 s; jerk is the change of the applied "
            "acceleration from one step to the next over 0.1 s. Means over the runs, in m/s² and m/s³:"
        ),
        table(
            [*head, "heading change, rad"], [[*a, f"{r['heading_change']:.1f}"] for a, r in zip(lines, result["rows"])]
        ),
        paragraph(
            f"{_compared(result['rows'])} {_effects(result['rows'])} Motion is smooth if a free control is kept, "
            "which NAO permits for the longest time."
        ),
    ]


def _compared(rows: Sequence[Result]) -> str:
    """Return sentences with the mean acceleration and jerk of each method, one per interval."""
    sentences = []
    for replan in sorted({row["replan"] for row in rows}):
        means = [
            f"{row['method'].upper()} {row['mean_acceleration']:.2f} m/s² and {row['mean_jerk']:.1f} m/s³"
            for row in rows
            if row["replan"] == replan
        ]
        sentences.append(f"Mean acceleration and jerk with a decision every {replan:g} s: {'; '.join(means)}.")
    return " ".join(sentences)


def _effects(rows: Sequence[Result]) -> str:
    """State how much the kind of control and the forecast change mean jerk and mean acceleration.

    Each is compared at the same interval, the kind of control with the same forecast, the forecast with the same kind.
    """
    found = {(row["method"], row["replan"]): row for row in rows}
    of_control, of_forecast = (("ao", "vo"), ("nao", "nlvo")), (("nlvo", "vo"), ("nao", "ao"))

    def shares(pairs: Sequence[tuple[str, str]], measure: str) -> list[float]:
        return [
            found[one, replan][measure] / found[other, replan][measure]
            for one, other in pairs
            for replan in sorted({row["replan"] for row in rows})
            if {(one, replan), (other, replan)} <= found.keys()
        ]

    control = shares(of_control, "mean_jerk")
    forecast = shares(of_forecast, "mean_jerk")
    acceleration = shares(of_control, "mean_acceleration")
    if not (control and forecast):
        return ""
    if max(control) < 1.0:
        jerk = "In these runs the mean jerk is lower if accelerations are chosen."
    else:
        jerk = "**Correction:** the mean jerk is not always lower if accelerations are chosen."
    larger = " Known trajectories have the larger effect." if max(forecast) < min(control) else ""
    mean = "" if max(acceleration) < 1.0 else " **Correction:** the mean acceleration is not always lower."
    return (
        f"{jerk} With the same forecast, AO and NAO have {_range(control)} of the mean jerk of VO and NLVO. With the "
        f"same kind of control, NLVO and NAO have {_range(forecast)} of that of VO and AO.{larger}{mean} AO and NAO "
        f"have {_range(acceleration)} of the mean acceleration of VO and NLVO."
    )


def _range(shares: Sequence[float]) -> str:
    """Format the range of shares in percent."""
    return f"{100.0 * min(shares):.0f} to {100.0 * max(shares):.0f} %"


def curves(result: Result) -> list[str]:
    """Render the findings of claim `curves`: alarms on curved roads."""
    rows = []
    for row in result["tables"]:
        first, second = (name.upper() for name in row["methods"])
        counts = row["all"]
        rows.append(
            [
                f"{first}, {second}",
                row["side"],
                f"{row['horizon']:g}",
                count_and_share(counts["first"], counts["cases"]),
                count_and_share(counts["second"], counts["cases"]),
                str(counts["only_first"]),
                str(counts["only_second"]),
            ]
        )
    head = ["question", "lane of the car", "horizon, s", "first alarms", "second alarms", "only first", "only second"]
    radii = ", ".join(f"{r:g} m" for r in result["radii"])
    inner = [row for row in result["tables"] if row["side"] == "inner"]
    outer = [row for row in result["tables"] if row["side"] == "outer"]
    return [
        paragraph(
            f"The robot (radius {result['robot_radius']:g} m) drives on a circle of {radii}. Its speed is "
            f"{', '.join(f'{v:g}' for v in result['speeds'])} m/s. One car (radius {result['car_radius']:g} m) drives "
            f"in the next lane, {result['lane']:g} m farther in or out. Its speed is "
            f"{', '.join(f'{q:g}' for q in result['ratios'])} times that of the robot, and it is "
            f"{min(result['ahead']):g} to {max(result['ahead']):g} m ahead."
        ),
        table(head, rows),
        paragraph(
            f"A car in the inner lane: NLVO and NAO raise {sum(r['all']['second'] for r in inner)} alarms in "
            f"{sum(r['all']['cases'] for r in inner)} cases, VO and AO {sum(r['all']['first'] for r in inner)}. All "
            "are for cars whose straight line or parabola leaves the lane towards the robot. The claim holds. "
            "**Correction:** it holds only for cars in the inner lane. For a car in the outer lane NLVO and NAO "
            f"raise {sum(r['all']['second'] for r in outer)} alarms, more than VO and AO with "
            f"{sum(r['all']['first'] for r in outer)}. They use the car's lane, but assume that the robot holds its "
            "velocity or acceleration and thereby leaves its own lane outwards. That motion would collide, but a "
            "robot that follows the road does not execute it."
        ),
    ]


def crossing(result: Result) -> list[str]:
    """Render the findings of claim `crossing`: one constant acceleration."""
    seeds = result["seeds"]
    first = result["tables"][0]
    limits = list(first["anything_is_free"])
    rows = [
        [f"{t['lane_speed']:g}", entry, *(count_and_share(t["crossing_exists"][entry][a], seeds) for a in limits)]
        for t in result["tables"]
        for entry in t["crossing_exists"]
    ]
    shares = [
        100.0 * share
        for t in result["tables"]
        for shares_by_limit in t["share_of_crossings_free"].values()
        for share in shares_by_limit.values()
    ]
    held = [
        [f"{t['lane_speed']:g}", *(count_and_share(t["anything_is_free"][a], seeds) for a in limits)]
        + [count_and_share(t["held_first_choice_collides"][m], seeds) for m in ("nao", "ao")]
        for t in result["tables"]
    ]
    largest_limit = max(limits, key=float)
    collisions = sum(t["held_first_choice_collides"]["ao"] for t in result["tables"])
    return [
        paragraph(
            f"30 cars on circles of 12, 16 and 20 m at 5, 6.5 and 8 m/s times the lane speed, {seeds} random starts; "
            "robot from (-26 m, 0) towards the centre. An acceleration crosses under three conditions. The robot "
            "enters the circle of 26 m at once, leaves it within 45 degrees of straight ahead, and has no collision "
            f"for {result['horizon']:g} s. The search uses a grid of {result['step']:g} m/s². "
            "If the grid contains none, "
            "exact selection nearest to crossings 1 m/s² apart is added. The counts are lower bounds. Starts for "
            "which one was found, by the acceleration limit:"
        ),
        table(["lane speed", "entry speed, m/s", *(f"{a} m/s²" for a in limits)], rows),
        paragraph(
            f"Of all accelerations that cross an empty roundabout, {min(shares):.1f} to {max(shares):.1f} % are free "
            "on average. **Correction:** one constant acceleration crosses for many starts, but not for all. Its "
            "existence depends on the start, the entry speed and the limit. The next table counts starts with any "
            "free constant acceleration, found exactly (the robot may also turn back or leave on any side). The "
            "first choice is the free acceleration nearest to the preferred one. The table also counts its collisions "
            f"if it is held for {result['horizon']:g} s at 5 m/s and {largest_limit} m/s²:"
        ),
        table(
            [
                "lane speed",
                *(f"any free, {a} m/s²" for a in limits),
                "first NAO choice collides",
                "first AO choice collides",
            ],
            held,
        ),
        paragraph(
            "An acceleration outside the NAO at the start stays free to the horizon. One decision is therefore "
            "sufficient if a crossing exists. Held choices from the AO map collide in "
            f"{count_and_share(collisions, seeds * len(held))} cases."
        ),
    ]


def sweep(result: Result) -> list[str]:
    """Render the findings of claim `sweep`: NAO against AO."""
    rows, seeds = result["rows"], result["seeds"]
    replans = sorted({row["replan"] for row in rows})
    keys = list(dict.fromkeys((r["keep"], r["neighbours"], r["lane_speed"], r["method"]) for r in rows))
    found = {(r["keep"], r["neighbours"], r["lane_speed"], r["method"], r["replan"]): r for r in rows}
    lines = [
        ["kept" if keep else "chosen again", str(count or "all"), f"{speed:g}", f"`{method}`"]
        + [
            f"{found[keep, count, speed, method, t]['runs_with_collision']} / "
            f"{found[keep, count, speed, method, t]['adjustments']:.1f}"
            for t in replans
        ]
        for keep, count, speed, method in sorted(keys, key=lambda k: (not k[0], k[1], k[2], k[3] == "ao"))
    ]
    return [
        paragraph(
            f"The roundabout of the last claim, {seeds} seeds in each cell. The robot has 5 m/s, at most 4 m/s², no "
            "speed limit, a horizon of 6 s and a margin of 0.05 m. The preferred acceleration turns the "
            "velocity to 8 m/s "
            "towards the far side within 1 s. Control `kept`: the present acceleration is kept while it is free. "
            "Control `chosen again`: the free acceleration nearest to the preferred one is chosen at every decision. "
            "If none is free, the one with the latest collision is taken. A run ends 26 m from the centre, or after "
            "20 s. Separate code finds collisions in continuous time. Runs with a collision / adjustments per run, "
            "by the replan interval:"
        ),
        table(["control", "cars considered", "lane speed", "method", *(f"{t:g} s" for t in replans)], lines),
        *_sweep_details(result),
    ]


def _sweep_details(result: Result) -> list[str]:
    """Render the conclusions."""
    rows = result["rows"]
    all_cars = [row for row in rows if row["neighbours"] == 0]
    nearest_cars = [row for row in rows if row["neighbours"]]

    def count(part: Sequence[Result], method: str) -> str:
        selected = [row for row in part if row["method"] == method]
        return count_and_share(
            sum(row["runs_with_collision"] for row in selected), sum(row["runs"] for row in selected)
        )

    text = [
        "These are sums over all intervals, speeds and both controls. With all cars considered, NAO collides in "
        f"{count(all_cars, 'nao')} runs. AO collides in {count(all_cars, 'ao')}. **Corrections:** AO collides if its "
        "forecast becomes wrong before the next decision, that is, at long intervals or on fast lanes. "
        + _collisions_at_shortest_interval(all_cars)
        + " The lower number of adjustments results from keeping a free acceleration together with a forecast that "
        "stays correct. A robot that chooses again at every decision adjusts often with both methods. The file of all "
        "numbers also has speeds, accelerations and jerks, and other horizons and limits.",
    ]
    if nearest_cars:
        text.append(
            f"A robot that considers only the nearest 5 cars collides in {count(nearest_cars, 'nao')} runs with "
            f"NAO. With AO it collides in {count(nearest_cars, 'ao')}. Collisions of a robot that avoids "
            "only the nearest "
            "vehicles, as in the paper, are therefore weak evidence about AO."
        )
    return [paragraph(part) for part in text]


def _collisions_at_shortest_interval(rows: Sequence[Result]) -> str:
    """Return a sentence about the collisions of AO at the shortest interval and lane speed 1."""
    slow = [row for row in rows if row["method"] == "ao" and row["lane_speed"] == 1.0]
    shortest = min(row["replan"] for row in slow)
    collisions = sum(row["runs_with_collision"] for row in slow if row["replan"] == shortest)
    runs = sum(row["runs"] for row in slow if row["replan"] == shortest)
    return (
        f"With a decision every {shortest:g} s and exact accelerations at lane speed 1 it collides in "
        f"{count_and_share(collisions, runs)} runs."
    )


def cone(result: Result) -> list[str]:
    """Render the findings of claim `cone`: the straight cone."""
    rows = [
        [
            f"({row['relative_velocity'][0]:g}, {row['relative_velocity'][1]:g})",
            str(row["points"]),
            str(row["in_ao"]),
            str(row["in_cone"]),
            str(row["judged_differently"]),
        ]
        for row in result["rows"]
    ]
    return [
        paragraph(
            f"Obstacle of the figure `ao_cone` (radius {result['radius']:g} m), horizon {result['horizon']:g} s, seed "
            f"{result['seed']}. Accelerations are uniform in (-3, 8) x (-3, 6) m/s², without the tip that the horizon "
            "cuts off:"
        ),
        table(["w, m/s", "accelerations", "in the AO", "in the cone", "judged differently"], rows),
        paragraph(
            "The claim holds. The paper does not define the sign of the relative velocity. Erratum 6: w = v_A - v_B. "
            "The AO reaches the acceleration of the obstacle from the side of -w. Let w be parallel to the line to "
            "the obstacle. The centres of the elements still lie on a ray, but the elements have no two common "
            "tangents. The AO is straight, but not a cone."
        ),
    ]


CLAIMS: Final[dict[str, Callable[[Result], list[str]]]] = {
    "curves": curves,
    "crossing": crossing,
    "sweep": sweep,
    "smoothness": smoothness,
    "cone": cone,
    "oscillation": oscillation,
}
"""Function that renders the findings of each claim, by name."""
