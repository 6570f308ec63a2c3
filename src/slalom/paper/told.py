"""The numbers of each claim in words and tables, and where the paper's statement needs a correction."""

from collections.abc import Callable, Sequence
from typing import Final

from slalom.paper.prose import Result, of, paragraph, table
from slalom.paper.told_oscillation import oscillation


def curves(result: Result) -> list[str]:
    """Alarms on curved roads."""
    rows = []
    for row in result["tables"]:
        first, second = (name.upper() for name in row["methods"])
        counts = row["all"]
        rows.append(
            [
                f"{first}, {second}",
                row["side"],
                f"{row['horizon']:g}",
                of(counts["first"], counts["cases"]),
                of(counts["second"], counts["cases"]),
                str(counts["only_first"]),
                str(counts["only_second"]),
            ]
        )
    head = ["question", "lane of the car", "horizon, s", "first alarms", "second alarms", "only first", "only second"]
    inner = [row for row in result["tables"] if row["side"] == "inner"]
    outer = [row for row in result["tables"] if row["side"] == "outer"]
    radii = [f"{r:g} m" for r in result["radii"]]
    return [
        paragraph(
            f"Robot (radius {result['robot_radius']:g} m) on a circle of {', '.join(radii)} at "
            f"{', '.join(f'{v:g}' for v in result['speeds'])} m/s; one car (radius {result['car_radius']:g} m) in the "
            f"next lane, {result['lane']:g} m farther in or out, at {', '.join(f'{q:g}' for q in result['ratios'])} "
            f"times the robot's speed and {min(result['ahead']):g} to {max(result['ahead']):g} m ahead."
        ),
        table(head, rows),
        "Alarms for a car in the inner lane by the robot's radius (VO and AO; NLVO and NAO in brackets):",
        table(
            ["question", "horizon, s", *radii],
            [
                [
                    ", ".join(name.upper() for name in row["methods"]),
                    f"{row['horizon']:g}",
                    *(f"{c['first']} ({c['second']}) of {c['cases']}" for c in row["by_radius"].values()),
                ]
                for row in inner
            ],
        ),
        paragraph(
            f"A car in the inner lane: NLVO and NAO raise {sum(r['all']['second'] for r in inner)} alarms in "
            f"{sum(r['all']['cases'] for r in inner)} cases, VO and AO {sum(r['all']['first'] for r in inner)}, all of "
            "them for cars whose straight line or parabola leaves the lane towards the robot. The claim holds. "
            "**Correction:** it holds for cars on the inside only. For a car in the outer lane NLVO and NAO raise "
            f"{sum(r['all']['second'] for r in outer)} alarms, more than VO and AO with "
            f"{sum(r['all']['first'] for r in outer)}: they know the car's lane but still assume that the robot holds "
            "its velocity or acceleration, so that it leaves its own lane outwards. That motion would collide, but a "
            "robot that follows the road does not make it."
        ),
    ]


def crossing(result: Result) -> list[str]:
    """One constant acceleration."""
    seeds = result["seeds"]
    first = result["tables"][0]
    limits = list(first["anything_is_free"])
    rows = [
        [f"{t['lane_speed']:g}", entry, *(of(t["crossing_exists"][entry][a], seeds) for a in limits)]
        for t in result["tables"]
        for entry in t["crossing_exists"]
    ]
    shares = [
        100.0 * share for t in result["tables"] for by in t["share_of_crossings_free"].values() for share in by.values()
    ]
    held = [
        [f"{t['lane_speed']:g}", *(of(t["anything_is_free"][a], seeds) for a in limits)]
        + [of(t["held_first_choice_collides"][m], seeds) for m in ("nao", "ao")]
        for t in result["tables"]
    ]
    most = max(limits, key=float)
    lost = sum(t["held_first_choice_collides"]["ao"] for t in result["tables"])
    return [
        paragraph(
            f"30 cars on 12, 16 and 20 m at 5, 6.5 and 8 m/s times the lane speed, {seeds} random starts; robot from "
            "(-26 m, 0) towards the centre. An acceleration crosses if the robot goes in at once, leaves the ring of "
            f"26 m within 45 degrees of straight on and touches nobody within {result['horizon']:g} s; looked for on a "
            f"grid of {result['step']:g} m/s² and, where that finds none, by the exact choice nearest to crossings 1 "
            "m/s² apart: the counts are lower bounds. Starts for which one was found, by the acceleration limit:"
        ),
        table(["lane speed", "entry speed, m/s", *(f"{a} m/s²" for a in limits)], rows),
        paragraph(
            f"Of all accelerations that would cross an empty roundabout, {min(shares):.1f} to {max(shares):.1f} % are "
            "free on average. **Correction:** one constant acceleration crosses for many starts, not for all: whether "
            "it exists depends on the start, the entry speed and the limit. Any free constant acceleration at all, "
            "found exactly (the robot may brake and go back, or leave on any side), and the first choice, the free one "
            f"nearest to the wish, held for {result['horizon']:g} s without looking again, at 5 m/s and {most} m/s²:"
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
            "What is free of the NAO at the beginning stays free to the horizon, which is why one decision is enough "
            f"where one exists; held choices from the AO map collide in {of(lost, seeds * len(held))} cases."
        ),
    ]


def sweep(result: Result) -> list[str]:
    """NAO against AO."""
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
            f"The roundabout of the last claim, {seeds} seeds in each cell, robot at 5 m/s limited to 4 m/s² and by no "
            "speed, horizon 6 s, margin 0.05 m. A free present acceleration is kept, or at every decision the free one "
            "nearest to the acceleration that turns the velocity to 8 m/s towards the far side within 1 s is chosen "
            "again. If none is free the one that collides last is taken. A run ends 26 m from the centre, or after 20 "
            "s. Collisions are judged in continuous time by separate code. Runs with a collision / adjustments per "
            "run, by the replan interval:"
        ),
        table(["control", "cars seen", "lane speed", "method", *(f"{t:g} s" for t in replans)], lines),
        *_sweep_details(result),
    ]


def _sweep_details(result: Result) -> list[str]:
    """More columns of the rows with all cars at lane speed 1, the rows about them, and what follows."""
    rows, seeds = result["rows"], result["seeds"]

    def line(row: Result, first: Sequence[str]) -> list[str]:
        time = "-" if row["time"] is None else f"{row['time']:.1f}"
        return [
            *first,
            f"{row['runs_with_collision']}",
            f"{row['adjustments_per_second']:.2f}",
            f"{100.0 * row['without_free_control']:.1f}",
            f"{row['left_the_ring']}",
            f"{row['far_side']}",
            time,
            f"{row['mean_acceleration']:.2f}",
            f"{row['mean_jerk']:.2f}",
        ]

    head = ["collided", "adjustments/s", "none free, %", "left", "far side", "time, s", "mean acc.", "mean jerk"]
    near = [row for row in rows if row["neighbours"] == 0 and row["lane_speed"] == 1.0]
    control = {True: "kept", False: "chosen again"}
    every = [row for row in rows if row["neighbours"] == 0]
    few = [row for row in rows if row["neighbours"]]

    def count(part: Sequence[Result], method: str) -> str:
        mine = [row for row in part if row["method"] == method]
        return of(sum(row["runs_with_collision"] for row in mine), sum(row["runs"] for row in mine))

    text = [
        f"More of the rows with all cars at lane speed 1 ({seeds} runs each; m/s² and m/s³):",
        table(
            ["control", "method", "replan, s", *head],
            [line(row, [control[row["keep"]], f"`{row['method']}`", f"{row['replan']:g}"]) for row in near],
        ),
        f"Other horizons and limits, kept, all cars, replan 0.5 s, {result['sensitivity_seeds']} runs each:",
        table(
            ["method", "horizon, s", "limit, m/s²", *head],
            [
                line(row, [f"`{row['method']}`", f"{row['horizon']:g}", f"{row['max_acceleration']:g}"])
                for row in result["sensitivity"]
            ],
        ),
        f"With all cars in sight, over all intervals, speeds and both choices, NAO collides in {count(every, 'nao')} "
        f"runs and AO in {count(every, 'ao')}. **Corrections:** AO collides where its forecast is wrong before the "
        "next decision can help, when decisions are rare or lanes are fast. "
        + _often(every)
        + " And fewer adjustments are an effect of keeping an acceleration that is still free, together with a "
        "forecast that stays right: a robot that chooses again at every decision adjusts often with both.",
    ]
    if few:
        text.append(
            f"A robot that looks at the nearest 5 cars only collides in {count(few, 'nao')} runs with NAO and in "
            f"{count(few, 'ao')} with AO: collisions of a robot that avoids the nearest vehicles, as the paper "
            "describes them, say little about AO."
        )
    return [part if part.startswith("|") else paragraph(part) for part in text]


def _often(rows: Sequence[Result]) -> str:
    """What AO does at the shortest interval and the slowest lanes."""
    slow = [row for row in rows if row["method"] == "ao" and row["lane_speed"] == 1.0]
    shortest = min(row["replan"] for row in slow)
    hit = sum(row["runs_with_collision"] for row in slow if row["replan"] == shortest)
    runs = sum(row["runs"] for row in slow if row["replan"] == shortest)
    return (
        f"Deciding every {shortest:g} s with exact accelerations at lane speed 1 it collides in {of(hit, runs)} runs."
    )


def smoothness(result: Result) -> list[str]:
    """Acceleration and jerk."""
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
            f"{_compared(result['rows'])} **Correction:** choosing accelerations does not by itself make motion "
            "smoother under one limit: a robot that chooses its control anew whenever a better one is free pushes to "
            "the limit and back with each of these methods. What makes it smooth is to keep a control that is still "
            "free, which NAO allows for longest: compare the mean jerk of the paper's own control, kept, in the claim "
            "`sweep`."
        ),
    ]


def _compared(rows: Sequence[Result]) -> str:
    """Mean acceleration and jerk of NAO against the others, at each interval."""
    found = []
    for replan in sorted({row["replan"] for row in rows}):
        means = [
            f"{row['method'].upper()} {row['mean_acceleration']:.2f} m/s² and {row['mean_jerk']:.1f} m/s³"
            for row in rows
            if row["replan"] == replan
        ]
        found.append(f"Deciding every {replan:g} s, mean acceleration and jerk are {', '.join(means)}.")
    return " ".join(found)


def cone(result: Result) -> list[str]:
    """The straight cone."""
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
            f"{result['seed']}, uniform accelerations in (-3, 8) x (-3, 6) m/s² but for the tip that the horizon cuts "
            "off:"
        ),
        table(["w, m/s", "accelerations", "in the AO", "in the cone", "judged differently"], rows),
        paragraph(
            "The claim holds. Two details: the sign of the relative velocity is not defined in the paper (erratum 6: "
            "w = v_A - v_B; the AO reaches the acceleration of the obstacle from the side of -w), and if w points "
            "along the line to the obstacle the centres of the elements still lie on a ray, but the elements share no "
            "two tangents: the AO is straight, not a cone."
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
"""How the numbers of each claim are told."""
